#!/usr/bin/env python3
"""What convert.py makes of every feature of every format that it reads: the table of features.READ, walked over pair by pair: /usr/bin/python3 tests/postprocess/test_formats_read.py"""
import pathlib
import unittest

import h5py
import numpy as np

from test_convert import Case, data

import convert
import features
from backspring_io import RunError

try:
    import meshio
    import vtk  # noqa: F401
except ImportError:
    meshio = None

ROOT = pathlib.Path(__file__).resolve().parents[2]
MADE = ("--stiffness", "7", "--mass", "0.5", "--dim", "3")
POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1), (0.5, 0, 0)]
LINE, POLYLINE, TRIANGLE, STRIP, POLYGON, QUAD, TETRA, TRIANGLE6, LAGRANGE = 3, 4, 5, 6, 7, 9, 10, 22, 68
CELLS = {  # cells by VTK's numbers, and the springs that they become
    "lines": ([(LINE, (0, 1)), (LINE, (1, 2))], [[0, 1], [1, 2]]),
    "polylines": ([(POLYLINE, (0, 1, 2, 3)), (LINE, (3, 4))], [[0, 1], [1, 2], [2, 3], [3, 4]]),
    "triangles and quadrangles": ([(TRIANGLE, (0, 1, 4)), (QUAD, (0, 1, 2, 3))], [[0, 1], [0, 3], [0, 4], [1, 2], [1, 4], [2, 3]]),
    "triangle strips": ([(STRIP, (0, 1, 3, 2))], [[0, 1], [0, 3], [1, 2], [1, 3], [2, 3]]),
    "polygons": ([(POLYGON, (0, 1, 2, 4, 3))], [[0, 1], [0, 3], [1, 2], [2, 4], [3, 4]]),
    "solid elements": ([(TETRA, (0, 1, 2, 4))], [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]),  # the points that are used, in order
    "elements of second order": ([(TRIANGLE6, (0, 1, 2, 5, 4, 3))], [[0, 3], [0, 5], [1, 4], [1, 5], [2, 3], [2, 4]]),
    "elements of third order": ([(LAGRANGE, (0, 1, 2, 3))], None),
    "points without elements": ([(TRIANGLE, (0, 1, 2))], [[0, 1], [0, 2], [1, 2]]),
}
MESHIO = {LINE: "line", TRIANGLE: "triangle", QUAD: "quad", TETRA: "tetra", TRIANGLE6: "triangle6", LAGRANGE: "line4"}
FLAT = {"stl": [(TRIANGLE, (0, 1, 4)), (TRIANGLE, (0, 1, 2))], "off": [(TRIANGLE, (0, 1, 4)), (TRIANGLE, (0, 1, 2))]}  # of triangles alone
SAID = {"points without elements": "points merged or without springs left out", "elements of third order": "not supported", "triangle strips": "triangle strips",
        "polygons": "only read triangular", "further data, normals, colours": "left out: ", "names of groups": "left out: ", "molecules cut by the box": "molecules were put together",
        "bonds that are not harmonic": "bond style fene is not a spring", "angles that are not harmonic": "angle style cosine is no angle spring",
        "dihedrals, pair forces, charges": "charges, Pair Coeffs left out", "alternative places, other models": "1 alternative places left out", "other atoms than C-alpha": "1 atoms other than C-alpha left out",
        "numbers that are not finite": ""}


def array(kind, values, name=""):
    return f'<DataArray type="{kind}" {name} format="ascii">{" ".join(map(str, values))}</DataArray>\n'


def vtu(cells, points=POINTS, fields=""):
    nodes, ends = [n for _, c in cells for n in c], np.cumsum([len(c) for _, c in cells])
    return ('<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid>'
            f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{len(cells)}">\n{fields}<Points>' + array("Float64", np.ravel(points), 'NumberOfComponents="3"') + "</Points>\n<Cells>"
            + array("Int64", nodes, 'Name="connectivity"') + array("Int64", ends, 'Name="offsets"') + array("UInt8", [k for k, _ in cells], 'Name="types"')
            + "</Cells></Piece></UnstructuredGrid></VTKFile>\n")


def legacy(cells, points=POINTS, fields=""):
    return ("# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET UNSTRUCTURED_GRID\n" + f"POINTS {len(points)} double\n" + "".join(f"{x} {y} {z}\n" for x, y, z in points)
            + f"CELLS {len(cells)} {sum(len(c) + 1 for _, c in cells)}\n" + "".join(f"{len(c)} {' '.join(map(str, c))}\n" for _, c in cells)
            + f"CELL_TYPES {len(cells)}\n" + "".join(f"{k}\n" for k, _ in cells) + fields)


def poly_data(cells, points=POINTS):
    """The same cells as PolyData: lines, polygons and strips in sections."""
    text = "# vtk DataFile Version 3.0\nby hand\nASCII\nDATASET POLYDATA\n" + f"POINTS {len(points)} double\n" + "".join(f"{x} {y} {z}\n" for x, y, z in points)
    for section, kinds in (("LINES", (LINE, POLYLINE)), ("POLYGONS", (TRIANGLE, QUAD, POLYGON)), ("TRIANGLE_STRIPS", (STRIP,))):
        here = [c for k, c in cells if k in kinds]
        if here:
            text += f"{section} {len(here)} {sum(len(c) + 1 for c in here)}\n" + "".join(f"{len(c)} {' '.join(map(str, c))}\n" for c in here)
    return text


def ply(cells, points=POINTS, more=""):
    faces, edges = ([c for k, c in cells if (k == LINE) == one] for one in (False, True))
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n" + (f"property uchar {more}\n" if more else "")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nelement edge {len(edges)}\nproperty int vertex1\nproperty int vertex2\n"
    return head + "end_header\n" + "".join(f"{x} {y} {z}{' 9' if more else ''}\n" for x, y, z in points) + "".join(f"{len(c)} {' '.join(map(str, c))}\n" for c in faces) \
        + "".join(f"{a} {b}\n" for a, b in edges)


def obj(cells, points=POINTS, more=""):
    return more + "".join(f"v {x} {y} {z}\n" for x, y, z in points) + "".join(f"{'l' if k in (LINE, POLYLINE) else 'f'} {' '.join(str(n + 1) for n in c)}\n" for k, c in cells)


def atom(serial, name, x, altloc=" ", residue=1):
    return f"ATOM  {serial:5d} {name}{altloc}ALA A{residue:4d}    {x:>8}{0:8.3f}{0:8.3f}  1.00 10.00\n"


PDB = atom(7, " CA ", "0.000", residue=1) + atom(9, " CA ", "3.000", residue=2)
ANGLES = "Angle Coeffs # {style}\n\n1 6 120\n\n"


def lammps(feature):
    """A data file of a feature."""
    line = "1 1 1 1 5 5\n2 1 1 2 5 5\n3 1 1 3 6 5\n"
    if feature == "molecules cut by the box":
        return data(atoms="1 1 1 9.5 5 5\n2 1 1 0.5 5 5\n3 1 1 1.5 5 5\n")
    if feature == "periodic box":
        return data(atoms="".join(f"{i + 1} 1 1 {2.5 * i} 5 5\n" for i in range(4)), bonds="1 1 1 2\n2 1 2 3\n3 1 3 4\n4 1 4 1\n")
    if feature == "bonds that are not harmonic":
        return data(coefficients="Bond Coeffs # fene\n\n1 30 1.5 1 1\n\n")
    if feature in ("angle springs", "angles that are not harmonic"):
        style = "harmonic" if feature == "angle springs" else "cosine"
        return data(atoms=line, more="1 angles\n1 angle types\n").replace("Atoms #", ANGLES.format(style=style) + "Atoms #") + "\nAngles\n\n1 1 1 2 3\n"
    if feature.startswith("dihedrals"):
        return data(style=" # full", atoms="1 1 1 0.5 1 5 5\n2 1 1 -0.5 2 5 5\n3 1 1 0 3 6 5\n", more="4 dihedrals\n").replace("Atoms #", "Pair Coeffs # lj/cut\n\n1 0.1 3.2\n\nAtoms #")
    if feature.startswith("numbers"):
        return data(atoms=line.replace("2 5 5", "nan 5 5"))
    return data(atoms=line) + "\nVelocities\n\n1 1 2 3\n2 0 0 0\n3 0 0 0\n"


@unittest.skipUnless(meshio, "no meshio or no VTK")
class Walk(Case):
    def path_of(self, form, cells, points=POINTS, name=""):
        """A file of these cells, by hand or, where that is much, by meshio."""
        by_hand = {"vtu": vtu, "vtk": legacy, "ply": ply, "obj": obj}
        name = f"m{name}.{form}"
        if form == "ply" and cells[0][0] == STRIP:
            return self.write(name, ply([], points).replace("element face 0\nproperty list uchar int vertex_indices", "element tristrips 1\nproperty list int int vertex_indices") + "4 0 1 3 2\n")
        if form in by_hand:
            return self.write(name, by_hand[form](cells, points))
        if form == "xdmf" and cells[0][0] == LAGRANGE:
            return self.write(name, '<Xdmf Version="3.0"><Domain><Grid Name="g"><Geometry GeometryType="XYZ"><DataItem DataType="Float" Dimensions="4 3" Format="XML" Precision="8">'
                              '0 0 0 1 0 0 1 1 0 0 1 0</DataItem></Geometry><Topology NumberOfElements="1" TopologyType="Edge_4"><DataItem DataType="Int" Dimensions="1 4" Format="XML" Precision="8">'
                              '0 1 2 3</DataItem></Topology></Grid></Domain></Xdmf>\n')
        if form == "off" and any(k != TRIANGLE for k, _ in cells):
            return self.write(name, "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")
        path = str(pathlib.Path(self.folder) / name)
        mesh = meshio.Mesh(np.array(points, float), [(MESHIO[k], np.array([c])) for k, c in cells])
        meshio.write(path, mesh, **({"file_format": "gmsh22"} if form == "msh" else {}))
        return path

    def test_every_pair(self):
        for feature, row in features.READ.items():
            for form, word in row.items():
                if word:
                    with self.subTest(feature=feature, form=form):
                        self.pair(feature, form, word)

    def pair(self, feature, form, word):
        path, args, good = self.case(feature, form)
        if word == features.REFUSED:
            says = "not readable as a .xdmf mesh" if (feature, form) == ("elements of third order", "xdmf") else SAID[feature]
            self.refuses(path, *args, says=says)
            if feature.startswith("numbers"):
                with self.assertRaisesRegex(RunError, r"(point|position, row|:\d+:|line) ?.*(finite|nan|coordinate)"):
                    self.lattice(path, *args)
            return
        found = self.lattice(path, *args)
        if word == features.DROPPED:
            self.assertIn(SAID[feature], found["said"])
        else:
            self.assertNotIn("left out: ", found["said"])
        if good is not None:
            self.assertTrue(good(found), str({k: v for k, v in found.items() if "springs" in k}))

    def case(self, feature, form):
        """File, arguments, and what must hold of the lattice."""
        pairs = lambda expected: lambda found: sorted(found["springs/pairs"].tolist()) == expected  # noqa: E731
        if form == "data":
            return self.of_lammps(feature)
        if form == "pdb":
            return self.of_pdb(feature)
        if feature in CELLS:
            cells, expected = CELLS[feature]
            if form in FLAT and feature == "triangles and quadrangles":
                cells, expected = FLAT[form], None
            return self.path_of(form, cells), MADE, pairs(expected) if expected else None
        if feature.startswith("numbers"):
            cells = [(TRIANGLE, (0, 1, 2))]
            return self.path_of(form, cells, [*POINTS[:1], (np.nan, 0, 0), *POINTS[2:]]), MADE, None
        if feature == "further data, normals, colours":
            return self.further(form), MADE, None
        if feature == "names of groups":
            return self.named(form), MADE, (lambda found: found["groups/sheet"].tolist() == [0, 1, 2]) if form == "msh" else None
        return self.of_lattice(feature, form)

    def further(self, form):
        cells = [(TRIANGLE, (0, 1, 2))]
        if form == "vtk":
            return self.write("m.vtk", legacy(cells, fields="POINT_DATA 6\nSCALARS heat double 1\nLOOKUP_TABLE default\n1 2 3 4 5 6\n"))
        if form == "vtu":
            return self.write("m.vtu", vtu(cells, fields="<PointData>" + array("Float64", range(6), 'Name="heat"') + "</PointData>\n"))
        if form == "obj":
            return self.write("m.obj", obj(cells, more="vn 0 0 1\n"))
        if form == "ply":
            return self.write("m.ply", ply(cells, more="red"))
        if form == "msh":
            return self.write("m.msh", pathlib.Path(self.path_of("msh", cells)).read_bytes() + b'$NodeData\n1\n"heat"\n1\n0.0\n3\n0\n1\n1\n1 5.0\n$EndNodeData\n')
        path = str(pathlib.Path(self.folder) / f"m.{form}")
        meshio.write(path, meshio.Mesh(np.array(POINTS, float), [("triangle", np.array([[0, 1, 2]]))], point_data={"heat": np.arange(6.0)}))
        return path

    def named(self, form):
        cells = [(TRIANGLE, (0, 1, 2))]
        if form == "obj":
            return self.write("m.obj", obj(cells, more="g sheet\n"))
        path = str(pathlib.Path(self.folder) / "m.msh")
        meshio.write(path, meshio.Mesh(np.array(POINTS, float), [("triangle", np.array([[0, 1, 2]]))], cell_data={k: [np.array([1])] for k in ("gmsh:physical", "gmsh:geometrical")},
                                       field_data={"sheet": np.array([1, 2])}), file_format="gmsh22")
        return path

    def of_lattice(self, feature, form):
        """A lattice as fields of lines: of convert.py's own VTU, or of others by the names of the fields."""
        if form == "vtu":
            return self.whole_lattice(feature == "periodic box")
        path = str(pathlib.Path(self.folder) / f"m.{form}")
        mesh = meshio.Mesh(np.array(POINTS[:3], float), [("line", np.array([[0, 1], [1, 2]]))], point_data={"mass": np.arange(1.0, 4), "velocity": np.ones((3, 3)), "fixed": np.array([1.0, 0, 0]),
                                                                                                        "id": np.array([7, 8, 3])},
                           cell_data={"stiffness": [np.array([2.0, 3])], "rest_length": [np.array([0.5, 0.7])]})
        meshio.write(path, mesh)
        return path, ("--dim", "3"), lambda f: (f["particles/mass"].tolist(), f["springs/stiffness"].tolist(), f["springs/rest_length"].tolist(), f["particles/id"].tolist(),
                                                 f["particles/fixed"].tolist(), f["particles/velocity"].sum()) == ([1, 2, 3], [2, 3], [0.5, 0.7], [7, 8, 3], [1, 0, 0], 9)

    def whole_lattice(self, boxed):
        """Field data and columns of a VTU as write_vtu names them; test_formats.py has them of runs."""
        from vtk_files import MARK
        names = {"point": {"id": [7, 8, 3], "fixed": [1, 0, 0], "mass": [1.0, 2, 3], "velocity": np.ones((3, 3)), "radius": [0.1] * 3},
                 "cell": {"stiffness": [2.0, 3], "rest_length": [0.5, 0.7], "damping": [0.0, 1], "law": [4, 0], "yield_force": [1.0, 0], "plastic_stretch": [0.1, 0], "critical_strain": [0.3, np.inf],
                          "broken": [0, 1]},
                 "field": {MARK: [1], "dimension": [3], "time": [0.5], "damping_law": [1], "angles_triples": [[0, 1, 2]], "angles_stiffness": [4.0], "angles_rest_angle": [1.5], "hinges_quads": [[0, 1, 2, 0]],
                           "hinges_stiffness": [6.0], "hinges_rest_angle": [-0.5], "anchors_particle": [2],
                           "anchors_point": [[1.0, 2, 3]], "anchors_stiffness": [5.0], "anchors_rest_length": [0.0], "anchors_damping": [0.0], "group_left": [0, 1]}}
        if boxed:  # angle springs and hinges do not go with boxes
            names["field"] = {**{k: v for k, v in names["field"].items() if not k.startswith(("angles", "hinges"))}, "box_edges": np.diag([4.0, 5, 6]), "box_periodic": [1, 0, 1]}
            names["cell"].update({"ends": [[0, 1], [1, 2]], "shift": [[0, 0, 0], [1, 0, 0]]})
        mesh = {of: {k: np.array(v) for k, v in table.items()} for of, table in names.items()}
        kinds = {"f": "Float64", "i": "Int64"}

        def text(table, tuples=False):
            return "".join(array(kinds[v.dtype.kind], v.ravel(), f'Name="{k}" NumberOfComponents="{v.shape[1] if v.ndim > 1 else 1}"' + (f' NumberOfTuples="{len(v)}"' if tuples else ""))
                           for k, v in table.items())
        body = vtu([(LINE, (0, 1)), (LINE, (1, 2))], POINTS[:3], f"<PointData>{text(mesh['point'])}</PointData><CellData>{text(mesh['cell'])}</CellData>\n")
        path = self.write("m.vtu", body.replace("<UnstructuredGrid>", f"<UnstructuredGrid><FieldData>{text(mesh['field'], True)}</FieldData>", 1))

        def good(found):
            with h5py.File(pathlib.Path(self.folder) / "out.h5") as f:
                if boxed:
                    self.assertEqual((f["box/edges"][...].tolist(), list(f["box"].attrs["boundary"]), f["springs/shift"][...].tolist()),
                                     (np.diag([4.0, 5, 6]).tolist(), ["periodic", "none", "periodic"], [[0, 0, 0], [1, 0, 0]]))
                for name, value in (("springs/stiffness", [2, 3]), ("springs/yield_force", [1, 0]), ("springs/plastic_stretch", [0.1, 0]), ("springs/critical_strain", [0.3, np.inf]), ("springs/broken", [0, 1]),
                                    ("springs/damping", [0, 1]), ("particles/radius", [0.1] * 3), ("angles/triples", [[0, 1, 2]]), ("angles/stiffness", [4]), ("angles/rest_angle", [1.5]),
                                    ("hinges/quads", [[0, 1, 2, 0]]), ("hinges/stiffness", [6]), ("hinges/rest_angle", [-0.5]),
                                    ("anchors/particle", [2]), ("anchors/point", [[1, 2, 3]]), ("groups/left", [0, 1]), ("particles/velocity", np.ones((3, 3))), ("particles/fixed", [1, 0, 0]),
                                    ("particles/id", [7, 8, 3]), ("particles/mass", [1, 2, 3])):
                    if not (boxed and name.startswith(("angles", "hinges"))):
                        np.testing.assert_array_equal(f[name][...], value, name)
                self.assertEqual([f.attrs["spring_laws"][k] for k in f["springs/law"]], ["plastic", "hooke"])
                self.assertEqual(f.attrs["damping_law"], "simple")
            return True
        return path, (), good

    def of_lammps(self, feature):
        good = {"lines": lambda f: f["springs/pairs"].tolist() == [[0, 1], [1, 2]], "mass, stiffness, rest lengths": lambda f: set(f["springs/stiffness"]) == {20.0} and set(f["particles/mass"]) == {12.0},
                "velocities": lambda f: f["particles/velocity"][0].tolist() == [1, 2, 3], "ids": lambda f: f["particles/id"].tolist() == [1, 2, 3], "angle springs": lambda f: f["angles/stiffness"].tolist() == [12],
                "periodic box": lambda f: f["springs/shift"][3].tolist() == [1, 0, 0]}.get(feature)
        boundary = ("--boundary", "f,f,f") if "angle" in feature else ()
        return self.write("m.data", lammps(feature)), ("--dim", "3", *boundary), good

    def of_pdb(self, feature):
        more = {"alternative places, other models": atom(11, " CA ", "3.100", "B", residue=2), "other atoms than C-alpha": atom(12, " N  ", "1.000", residue=1),
                "numbers that are not finite": atom(13, " CA ", "nan", residue=3)}.get(feature, "")
        return self.write("m.pdb", PDB + more), (), (lambda f: f["particles/id"].tolist() == [7, 9]) if feature == "ids" else None

    def test_poly_data(self):
        """Lines, polygons and strips of PolyData: legacy, and XML as VTK writes it."""
        from vtkmodules.vtkIOLegacy import vtkPolyDataReader
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter
        for feature in ("lines", "polylines", "triangles and quadrangles", "triangle strips", "polygons"):
            cells, expected = CELLS[feature]
            path = self.write("m.vtk", poly_data(cells))
            reader, writer = vtkPolyDataReader(), vtkXMLPolyDataWriter()
            reader.SetFileName(path)
            writer.SetInputConnection(reader.GetOutputPort())
            writer.SetFileName(path[:-4] + ".vtp")
            writer.Write()
            for name in (path, path[:-4] + ".vtp"):
                self.assertEqual(sorted(self.lattice(name, *MADE)["springs/pairs"].tolist()), expected, (feature, name))
        whole = poly_data(CELLS["polylines"][0])
        self.refuses(self.write("cut.vtk", whole[:len(whole) // 2]), *MADE, says="cut.vtk: not readable as a .vtk mesh")
        self.refuses(self.write("cut.vtp", "<VTKFile"), *MADE, says="cut.vtp: not readable as a .vtp mesh")

    def test_table(self):
        """README's table is features.READ, and every ending that is read is a column of it."""
        endings = [e for e in (*convert.MESHES, *convert.LAMMPS, *convert.PROTEINS)]
        self.assertEqual({convert.READ_FORM.get(e, e[1:]) for e in endings}, set(features.READ_FORMATS))
        text = (ROOT / "postprocess" / "README.md").read_text()
        rows = {c[0].strip(): [w.strip() for w in c[1:]] for c in (line.strip("| \n").split("|") for line in text.splitlines() if line.startswith("|")) if len(c) == 1 + len(features.READ_FORMATS)}
        for feature, row in features.READ.items():
            self.assertEqual(rows.get(feature), [row[form] or "-" for form in features.READ_FORMATS], feature)

    def test_what_is_not_read(self):
        for name, text, says in (("run.xsp", "#1.0\n", "backspring reads it itself: -bs_lattice_file"), ("run.gsd", "gsd", "neither a trajectory (HDF5), nor LAMMPS data, nor a mesh"),
                                 ("run.xyz", "1\n\nX 0 0 0\n", "neither a trajectory"), ("run.dump", "ITEM: TIMESTEP\n0\n", "neither a trajectory")):
            self.refuses(self.write(name, text), *MADE, says=says)
        with h5py.File(pathlib.Path(self.folder) / "run.h5md", "w"):
            pass
        self.refuses(self.write("run.h5md.xdmf", "<Xdmf/>"), *MADE, says="is the sidecar of a trajectory: convert")


if __name__ == "__main__":
    unittest.main(verbosity=1)
