#!/usr/bin/env python3
"""convert.py on PLY and Gmsh meshes made by hand in the forms that others write, and on meshes by Gmsh itself (gmsh/): /usr/bin/python3 tests/postprocess/test_meshes.py"""
import os
import pathlib
import shutil
import struct
import unittest
import unittest.mock

import numpy as np

from test_convert import MADE, Case
import lattices

try:
    import meshio
except ImportError:
    meshio = None

PLY_HEAD = ("ply\nformat {form} 1.0\ncomment by hand\nobj_info nothing\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n"
            "property float nx\nproperty uchar red\nproperty float quality\nelement face 3\nproperty uchar flags\nproperty list uchar int vertex_indices\n"
            "property list uchar float texcoord\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nproperty uchar red\nelement camera 1\n"
            "property float view_px\nend_header\n")
POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.5), (3, 3, 3)]
FACES = [(0, 1, 2), (0, 2, 3), (0, 1, 2, 3)]
EDGES = [(0, 1), (0, 2), (0, 3), (1, 2), (2, 3), (2, 4)]


class Ply(Case):
    def check(self, path, *args):
        found = self.lattice(path, *MADE, *args)
        np.testing.assert_array_equal(found["particles/position"], POINTS)
        self.assertEqual([tuple(p) for p in found["springs/pairs"].tolist()], EDGES)

    def binary(self, order):
        out = PLY_HEAD.format(form={"<": "binary_little_endian", ">": "binary_big_endian"}[order]).encode()
        out += b"".join(struct.pack(order + "dddfBf", *p, 0.5, 9, 0.1) for p in POINTS)
        for face in FACES:
            out += struct.pack(f"{order}BB{len(face)}i", 3, len(face), *face) + struct.pack(order + "B6f", 6, *range(6))
        return out + struct.pack(order + "iiB", 2, 4, 0) + struct.pack(order + "f", 1.5)

    def test_normals_colours_flags_texture_edges_cameras(self):
        text = PLY_HEAD.format(form="ascii") + "".join(f"{x} {y} {z} 0.5 9 0.1\n" for x, y, z in POINTS)
        text += "".join(f"3 {len(f)} {' '.join(map(str, f))} 6 0 1 2 3 4 5\n" for f in FACES) + "2 4 0\n1.5\n"
        if not meshio:
            self.skipTest("no meshio")
        self.check(self.write("a.ply", text))
        self.check(self.write("l.ply", self.binary("<")))
        self.check(self.write("b.ply", self.binary(">")))
        for raw in (self.binary("<")[:-30], text.encode()[:-20]):
            self.refuses(self.write("cut.ply", raw), *MADE, says="ends early: truncated?")
        self.refuses(self.write("s.ply", text.replace("element camera", "element tristrips")), *MADE, says="triangle strips")
        self.refuses(self.write("n.ply", text.replace("3 4 0 1 2 3", "3 4 0 1 2 9")), *MADE, says="names point 9 of 5")
        self.refuses(self.write("t.ply", text.replace("property float nx", "property quad nx")), *MADE, says="t.ply: malformed PLY")


    def test_points_that_are_none(self):
        """A number that is not whole is no point, in faces and edges, in text with the line, in bytes with the row."""
        head = PLY_HEAD.format(form="ascii")
        body = "".join(f"{x} {y} {z} 0.5 9 0.1\n" for x, y, z in POINTS) + "".join(f"3 {len(f)} {' '.join(map(str, f))} 6 0 1 2 3 4 5\n" for f in FACES) + "2 4 0\n1.5\n"
        at = head.count("\n") + len(POINTS)
        for bad in ("2.7", "nan", "inf", "-inf", "1e300"):
            for good, line, says in (("3 3 0 2 3 6", at + 2, "face 1 names point "), ("3 4 0 1 2 3 6", at + 3, "face 2 names point "), ("\n2 4 0", at + 4, "edge 0 names point ")):
                words = good.split(" ")
                words[2 if good[0] == "3" else 1] = bad
                self.assertIn(good, body)
                with self.subTest(bad=bad, of=good):
                    self.refuses(self.write("m.ply", head + body.replace(good, " ".join(words))), *MADE, says=f"m.ply:{line}: {says}{float(bad):.17g}; points are whole numbers")
        raw = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nelement face 1\nproperty list uchar float vertex_index\nend_header\n"
        raw += struct.pack("<6f", 0, 0, 1, 0, 0, 1)
        self.assertEqual(len(self.lattice(self.write("m.ply", raw + struct.pack("<B3f", 3, 0, 1, 2)), *MADE)["springs/pairs"]), 3)
        for bad in (1.5, float("nan")):
            self.refuses(self.write("m.ply", raw + struct.pack("<B3f", 3, 0, bad, 2)), *MADE, says=f"m.ply: face 0 names point {bad}; points are whole numbers")


class Obj(Case):
    def test_points_that_are_not_there(self):
        """Numbers of any size, counted from the start or from the end, in faces and lines, before and after the points: refused with the line."""
        points = "v 0 0 0\nv 1 0 0\nv 1 1 0\n"
        if not meshio:
            self.skipTest("no meshio")
        self.assertEqual(len(self.lattice(self.write("m.obj", "f 1 2 3\n" + points), *MADE)["springs/pairs"]), 3)
        self.assertEqual(len(self.lattice(self.write("m.obj", "\ufeff" + points + "f 1 2 3\n"), *MADE)["springs/pairs"]), 3)  # with a mark of UTF-8
        for bad in (4, 2 ** 31, 2 ** 63, 10 ** 30):
            for kind, element in (("f", f"f 1 2 {bad}"), ("l", f"l {bad} 1")):
                for text, line in ((points + element + "\n", 4), (element + "\n" + points, 1)):
                    with self.subTest(element=element, line=line):
                        self.refuses(self.write("m.obj", text), *MADE, says=f"m.obj:{line}: '{element}' names point {bad} of 3")
                negative = element.replace(str(bad), str(-bad))
                self.refuses(self.write("m.obj", points + negative + "\n"), *MADE, says=f"m.obj:4: '{negative}' names point {-bad} from the end of 3")


class Merge(Case):
    def test_one_point_for_those_that_a_chain_of_near_ones_joins(self):
        """Against the closure of "not farther apart than EPS" by matrix products, over points at random and at borders of cells of that size."""
        rng = np.random.default_rng(3)
        for reach, points in ((0.1, rng.uniform(0, 1, (60, 3))), (0.1, np.round(rng.uniform(0, 1, (60, 3)), 1)),
                              (1e-6, [[1.5e-6 - 1e-13, 0, 0], [1.5e-6 + 1e-13, 0, 0], [3.2e-6, 0, 0]]),
                              (1e-300, [[0, 0, 0], [1e300, 1, 1], [0, 0, 0]]), (0.5, [[0.4 * k, 0, 0] for k in range(9)])):
            points = np.asarray(points, float)
            with np.errstate(over="ignore"):
                near = np.linalg.norm(points[:, None] - points[None], axis=2) <= reach
            for _ in points:
                near = near @ near
            first = near.argmax(axis=1)
            kept, row = lattices.joined(points, reach)
            np.testing.assert_array_equal(kept, np.unique(first))
            np.testing.assert_array_equal(kept[row], first)

    @unittest.skipUnless(meshio, "no meshio")
    def test_merged_meshes(self):
        apart = "".join(f"v {x!r} 0 0\n" for x in (0.0, 1.5e-6 - 1e-13 + 1, 1.5e-6 + 1e-13 + 1, 2.0, 2.0 + 1.7e-6))
        found = self.lattice(self.write("m.obj", apart + "l 1 2\nl 3 4\nl 4 5\n"), *MADE, "--merge", "1e-6", "--dim", "1")
        self.assertEqual(found["springs/pairs"].tolist(), [[0, 1], [1, 2], [2, 3]])
        with unittest.mock.patch.object(lattices, "MOST_NEAR", 1000):
            many = "".join(f"v {k} 0 0\n" for k in range(500)) + "l 1 2\n"
            self.refuses(self.write("m.obj", many), *MADE, "--merge", "400", says="--merge 400: points have far too many others so near")


# Two triangles on a square in format 4.1 (form of Gmsh 4.8): the surface is in a physical group, the curve is not.
GROUPS = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
2 1 "sheet"
$EndPhysicalNames
$Entities
0 1 1 0
1 0 0 0 1 0 0 0 0
1 0 0 0 1 1 0 1 1 1 1
$EndEntities
$Nodes
2 4 1 4
1 1 0 2
1
2
0 0 0
1 0 0
2 1 0 2
3
4
1 1 0
0 1 0
$EndNodes
$Elements
2 3 1 3
1 1 1 1
1 1 2
2 1 2 2
2 1 2 3
3 1 3 4
$EndElements
"""
# The same in two parts: the entities are those of parts, and have parents.
PARTS = GROUPS.split("$Entities")[0] + """$Entities
0 1 1 0
1 0 0 0 1 0 0 0 0
1 0 0 0 1 1 0 1 1 1 1
$EndEntities
$PartitionedEntities
2
0
0 1 2 0
2 1 1 1 1 0 0 0 1 0 0 0 0
2 2 1 1 1 0 0 0 1 1 0 1 1 0
3 2 1 1 2 0 0 0 1 1 0 1 1 0
$EndPartitionedEntities
$Nodes
2 4 1 4
1 2 0 2
1
2
0 0 0
1 0 0
2 2 0 2
3
4
1 1 0
0 1 0
$EndNodes
$Elements
3 3 1 3
1 2 1 1
1 1 2
2 2 2 1
2 1 2 3
2 3 2 1
3 1 3 4
$EndElements
"""
QUADRATIC = GROUPS.split("$Nodes")[0] + """$Nodes
1 6 1 6
2 1 0 6
1
2
3
4
5
6
0 0 0
1 0 0
0 1 0
0.5 0 0
0.5 0.5 0
0 0.5 0
$EndNodes
$Elements
1 1 1 1
2 1 9 1
1 1 2 3 4 5 6
$EndElements
"""


FLAT = ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 1\n4 0 1 0\n$EndNodes\n"
        "$Elements\n2\n1 2 2 0 1 1 2 3\n2 2 2 0 1 1 3 4\n$EndElements\n")


@unittest.skipUnless(meshio, "no meshio")
class Gmsh(Case):
    def test_groups_on_some_entities_and_partitions(self):
        for text in (GROUPS, PARTS):
            found = self.lattice(self.write("m.msh", text), *MADE)
            np.testing.assert_array_equal(found["particles/position"], [[0, 0], [1, 0], [1, 1], [0, 1]])
            self.assertEqual(found["springs/pairs"].tolist(), [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]])

    def test_second_order(self):
        found = self.lattice(self.write("m.msh", QUADRATIC), *MADE)
        self.assertEqual(found["springs/pairs"].tolist(), [[0, 3], [0, 5], [1, 3], [1, 4], [2, 4], [2, 5]])

    def test_what_is_refused_by_name(self):
        cubic = QUADRATIC.replace("2 1 9 1\n1 1 2 3 4 5 6", "1 1 26 1\n1 1 2 4 5")
        for text, says in ((GROUPS.replace("4.1 0 8", "4 0 8"), "Gmsh format 4 is not supported; write 4.1 or 2.2"), ("$NOD\n1\n1 0 0 0\n$ENDNOD\n", "not a Gmsh mesh"),
                           (GROUPS.split("$EndElements")[0], "no whole section $Elements"), (cubic, "elements of type line4 are not supported"),
                           (GROUPS.replace("1 1 2\n", "1 1\n").replace("1 1 3\n", "1\n"), "m.msh: "),
                           (GROUPS.replace("2 1 0 2\n3", "2 1 1 2\n3"), "parametric"), ("", "not a Gmsh mesh"), ("solid cube\nfacet\n", "not a Gmsh mesh"),
                           (FLAT.replace("3 1 1 1", "3 one 1 1"), "m.msh: "), (FLAT.replace("$Nodes\n4", "$Nodes\n5"), "m.msh: "),
                           (FLAT.replace("1 1 2 3\n", "1 1 2 99\n"), "m.msh: "), (FLAT.replace("3 1 1 1", "3 nan 1 1"), "point 2 is not finite"),
                           (FLAT.replace("$Nodes\n4", "$Nodes\n2000000000"), "m.msh: ")):
            self.refuses(self.write("m.msh", text), *MADE, says=says)


BY_GMSH = pathlib.Path(__file__).resolve().parent / "gmsh"
BARS = ("--youngs", "2e11", "--area", "1e-3", "--density", "7850")


@unittest.skipUnless(meshio, "no meshio")
class Groups(Case):
    """Physical groups become groups of the lattice."""

    def by_gmsh(self, name, *args):
        shutil.copy(BY_GMSH / name, self.folder)
        return self.lattice(os.path.join(self.folder, name), *BARS, *args)

    def places(self, found, group):
        return sorted(map(tuple, np.round(found["particles/position"][found["groups/" + group]], 9).tolist()))

    def test_truss_as_meshio_reads_it(self):
        mesh = meshio.read(BY_GMSH / "truss.msh")
        labels = {name: (int(label), int(dim)) for name, (label, dim) in mesh.field_data.items()}
        for name in ("truss.msh", "truss_binary.msh", "truss_22.msh"):
            found = self.by_gmsh(name)
            self.assertEqual({k[7:] for k in found if k.startswith("groups/")}, set(labels))
            for group, (label, dim) in labels.items():
                rows = np.concatenate([block.data[tags == label].ravel() for block, tags in zip(mesh.cells, mesh.cell_data["gmsh:physical"])
                                       if (block.type == "vertex") == (dim == 0)])
                self.assertEqual(self.places(found, group), sorted(set(map(tuple, mesh.points[rows, :2].tolist()))), (name, group))
            self.assertNotIn("left out", found["said"])

    def test_plate_whole_and_in_parts(self):
        """By place: meshio cannot read groups of some entities, or of parts. A curve and a surface have one name, another is not made of letters alone."""
        for name in ("plate.msh", "plate_22_binary.msh", "plate_parts.msh", "plate_parts_binary.msh"):
            found = self.by_gmsh(name)
            x = found["particles/position"]
            self.assertEqual({k[7:] for k in found if k.startswith("groups/")}, {"left_side", "wall_curve", "wall_surface", "tip"}, name)
            for group, rows in (("left_side", x[:, 0] == 0), ("wall_curve", x[:, 0] == 2), ("wall_surface", x[:, 0] >= 0), ("tip", (x == [2, 1]).all(axis=1))):
                self.assertEqual(found["groups/" + group].tolist(), np.flatnonzero(rows).tolist(), (name, group))
            self.assertIn('the curve group "left side" is called left_side', found["said"])
            self.assertIn('the surface group "wall" is called wall_surface', found["said"])

    def test_groups_follow_points_that_are_merged_or_left_out(self):
        text = FLAT.replace("$Nodes\n4", "$Nodes\n6").replace("4 0 1 0\n", "4 0 1 0\n5 9 9 9\n6 1e-9 0 0\n").replace("$Elements\n2", "$Elements\n4")
        text = text.replace("$EndElements", "3 15 2 5 1 5\n4 15 2 6 1 6\n$EndElements").replace("2 2 2 0 1 1 3 4", "2 2 2 0 1 6 3 4").replace("1 1 1\n", "1 1 0\n")
        found = self.lattice(self.write("m.msh", text), *MADE, "--merge", "1e-6")
        self.assertEqual((len(found["particles/position"]), found["groups/point_6"].tolist()), (4, [0]))
        self.assertIn("groups without a particle left out: point_5", found["said"])
        self.assertNotIn("groups/point_5", found)
        damaged = GROUPS.replace("1 0 0 0 1 1 0 1 1 1 1", "1 0 0 0 1 1 0 1 x 1 1")
        self.refuses(self.write("m.msh", damaged), *MADE, says="its section of entities cannot be read")
        named = GROUPS.replace("$PhysicalNames\n1\n", '$PhysicalNames\n2\n1 4 "rim"\n')
        self.assertIn('the curve group "rim" has no elements', self.lattice(self.write("m.msh", named), *MADE)["said"])

    def test_flat_meshes_stay_in_space_when_asked(self):
        for more, d in (((), 2), (("--dim", "3"), 3)):
            found = self.by_gmsh("truss.msh", *more)
            self.assertEqual(found["particles/position"].shape, (9, d))

    def test_what_is_fixed(self):
        def fixed(what, *more):
            return np.flatnonzero(self.by_gmsh("truss.msh", "--fixed", what, *more).get("particles/fixed", [])).tolist()
        self.assertEqual(fixed("supports"), [0, 4])
        self.assertEqual(fixed("load,ymax"), [2, 5, 6, 7, 8])
        self.assertEqual(fixed("ids:0,3,6-7,supports"), [0, 3, 4, 6, 7])
        self.assertEqual(fixed("box:-1,-1,2.5,0.5,near:7.1,9"), [0, 1, 8])
        self.assertEqual(fixed("near:8,-3,1,near:0,0,0", "--dim", "3"), [0, 4])
        self.assertEqual(fixed("xmin"), [0])
        self.assertEqual(fixed("near:0,0", "--fixed", "near:8,0", "--fixed", "load"), fixed("near:0,0,near:8,0,load"))
        for what, says in (("top", "--fixed top: write xmin, xmax, ymin, ymax, a group (supports, load, chords, diagonals), box:"), ("zmin", "--fixed zmin"),
                           ("near:1,0", "particles 0 and 1 are equally near"), ("near:1", "needs 2 numbers here, d = 2: the coordinates of a point"),
                           ("box:0,1,2", "needs 4 numbers here"), ("box:5,5,6,6", "no particle lies in it"), ("ids:0,9", "there is no particle 9: they go from 0 to 8"),
                           ("ids:-1", "'-1' is no id"), ("ids:a", "'a' is no id"), ("supports:1", "--fixed supports: write")):
            shutil.copy(BY_GMSH / "truss.msh", self.folder)
            self.refuses(os.path.join(self.folder, "truss.msh"), *BARS, "--fixed", what, says=says)

    def test_bars(self):
        """k = E A/L, in strain form K = E A; half of rho A L at each end; the whole weighs rho A times the length of all bars."""
        found = self.by_gmsh("truss.msh")
        length = np.linalg.norm(np.diff(found["particles/position"][found["springs/pairs"]], axis=1)[:, 0], axis=1)
        np.testing.assert_allclose(found["springs/stiffness"], 2e8 / length, rtol=1e-14)
        np.testing.assert_allclose(found["particles/mass"].sum(), 7.85 * length.sum(), rtol=1e-14)
        np.testing.assert_allclose(found["particles/mass"][2], 7.85 / 2 * (2 + 2 + 2 * np.hypot(1, 1.5)), rtol=1e-14)
        self.assertEqual(set(self.by_gmsh("truss.msh", "--spring_law", "strain")["springs/stiffness"]), {2e8})
        np.testing.assert_allclose(self.by_gmsh("truss.msh", "--rest_length", "1.6")["springs/stiffness"], 2e8 / 1.6)
        path = os.path.join(self.folder, "truss.msh")
        for args, says in ((("--youngs", "1", "--mass", "1"), "--youngs needs the cross section"), (("--area", "1", *MADE), "--area is for --youngs and --density"),
                           ((*BARS, "--stiffness", "3"), "--youngs and --stiffness say the same"), ((*BARS, "--total_mass", "3"), "--density and --total_mass say the same"),
                           (("--youngs", "0", "--area", "1", "--mass", "1"), "--youngs 0: must be positive"), ((*BARS, "--rest_length", "0"), "spring 0 has no length"),
                           (("--area", "1", "--density", "1"), "or --youngs E [Pa] and --area A")):
            self.refuses(path, *args, says=says)
        np.testing.assert_array_equal(found["springs/area"], np.full(len(length), 1e-3))
        alone = self.write("alone.obj", "v 0 0 0\nv 1 0 0\nv 5 5 5\nl 1 2\n")
        self.refuses(alone, *BARS, "--keep_unused", says="point 2 has no springs, so that --density gives it no mass")


# A frame of two struts, a cable and a brace, which is of no group though both its ends are of the struts; "rod" is one of the struts' own, "foot" a point.
FRAME = ("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n4\n1 1 \"struts\"\n1 2 \"steel cables\"\n2 3 \"sheet\"\n0 4 \"foot\"\n$EndPhysicalNames\n$Nodes\n5\n"
         "1 0 0 0\n2 0 2 0\n3 3 2 0\n4 3 0 0\n5 6 0 0\n$EndNodes\n$Elements\n6\n1 15 2 4 1 1\n2 1 2 1 1 1 2\n3 1 2 1 2 3 2\n4 1 2 2 3 3 4\n5 1 2 0 4 1 3\n6 2 2 3 1 3 4 5\n$EndElements\n")


@unittest.skipUnless(meshio, "no meshio")
class BarsByGroup(Case):
    """E, A and rho of the springs that are edges of a physical group's elements."""

    def stiffness(self, *args, text=FRAME):
        found = self.lattice(self.write("frame.msh", text), *args)
        return {tuple(pair): k for pair, k in zip(found["springs/pairs"].tolist(), found["springs/stiffness"])}, found

    def test_values_of_groups_and_of_the_rest(self):
        k, found = self.stiffness("--youngs", "2e11,steel_cables=1e11", "--area", "1e-3", "--area", "struts=4e-3,steel_cables=5e-4", "--area=sheet=2e-3", "--density", "8000,sheet=1000", "--dim", "3",
                                  text=FRAME.replace("6 2 2 3 1 3 4 5", "6 2 2 3 1 4 5 4"))
        self.assertEqual(set(k), {(0, 1), (1, 2), (2, 3), (0, 2), (3, 4)})
        for pair, expected in (((0, 1), 2e11 * 4e-3 / 2), ((1, 2), 2e11 * 4e-3 / 3), ((2, 3), 1e11 * 5e-4 / 2), ((0, 2), 2e11 * 1e-3 / np.sqrt(13)), ((3, 4), 2e11 * 2e-3 / 3)):
            self.assertAlmostEqual(k[pair] / expected, 1, 13, pair)
        self.assertEqual(found["springs/area"].tolist(), [4e-3, 1e-3, 4e-3, 5e-4, 2e-3])
        np.testing.assert_allclose(found["particles/mass"], np.array([8000 * (4e-3 * 2 + 1e-3 * 13 ** 0.5), 8000 * 4e-3 * 5, 8000 * (4e-3 * 3 + 1e-3 * 13 ** 0.5 + 5e-4 * 2),
                                                                      8000 * 5e-4 * 2 + 1000 * 2e-3 * 3, 1000 * 2e-3 * 3]) / 2, rtol=1e-14)

    def test_groups_of_format_4_and_of_surfaces(self):
        """The plate's curve at its left, by Gmsh; `wall_surface` is all of it."""
        shutil.copy(BY_GMSH / "plate.msh", self.folder)
        found = self.lattice(os.path.join(self.folder, "plate.msh"), "--youngs", "1", "--area", "2", "--area", "left_side=3", "--mass", "1")
        left = (found["particles/position"][found["springs/pairs"]][:, :, 0] == 0).all(axis=1)
        self.assertEqual(found["springs/area"].tolist(), np.where(left, 3, 2).tolist())
        self.assertTrue(0 < left.sum() < len(left))
        found = self.lattice(os.path.join(self.folder, "plate.msh"), "--youngs", "wall_surface=1", "--area", "2", "--mass", "1")
        self.assertEqual(set(found["springs/area"]), {2})

    def test_groups_follow_points_that_are_merged(self):
        text = FRAME.replace("$Nodes\n5", "$Nodes\n6").replace("5 6 0 0\n", "5 6 0 0\n6 3 2 1e-9\n").replace("4 1 2 2 3 3 4", "4 1 2 2 3 4 6")
        k, found = self.stiffness("--youngs", "1", "--area", "1,steel_cables=7", "--mass", "1", "--merge", "1e-6", "--dim", "3", text=text)
        self.assertEqual(dict(zip(k, found["springs/area"])), {(0, 1): 1, (0, 2): 1, (1, 2): 1, (2, 3): 7, (2, 4): 1, (3, 4): 1})

    def test_what_is_refused_by_name(self):
        path = self.write("frame.msh", FRAME)
        for args, says in ((("--area", "1,ropes=2"), "--area ropes: no group with springs has this name; there are struts, steel_cables, sheet"), (("--area", "1,foot=2"), "--area foot: no group"),
                           (("--area", "struts=1,sheet=2"), "--area: the spring between points 0 and 2 is in none of the groups struts, sheet; add a value of all others, as in --area VALUE,struts=1"),
                           (("--area", "1,steel_cables=2,sheet=3"), "the spring between points 2 and 3 is of the groups steel_cables and sheet, which have different values"),
                           (("--area", "1,2"), "--area: gives two values of the whole"), (("--area", "1", "--area", "sheet=1,sheet=2"), "two values of group sheet"),
                           (("--area", "1,sheet=-2"), "--area sheet=-2: must be positive"), (("--area", "1,sheet"), "--area sheet: write a number, or GROUP=NUMBER"),
                           (("--area", "=1"), "names no group before the ="), (("--area", "nan"), "must be positive")):
            self.refuses(path, "--youngs", "1", "--mass", "1", *args, says=says)
        self.refuses(self.write("frame.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), "--youngs", "1,a=2", "--area", "1", "--mass", "1", says="--youngs a: no group with springs has this name; there are none: physical groups")


VTU = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid><Piece NumberOfPoints="4" NumberOfCells="2">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">{nodes} 0 2 3</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">{count} {end}</DataArray><DataArray type="UInt8" Name="types" format="ascii">{kind} 5</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>
"""


@unittest.skipUnless(meshio, "no meshio")
class Vtk(Case):
    def test_without_vtk_elements_that_meshio_leaves_out_are_refused_by_name(self):
        whole = self.lattice(self.write("m.vtu", VTU.format(nodes="0 1 2", count=3, end=6, kind=5)), *MADE)
        self.assertEqual(whole["springs/pairs"].tolist(), [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]])
        for nodes, kind, says in (("0 1 2", 4, "m.vtu: holds polylines, which cannot be read"), ("0 1 3 2", 6, "m.vtu: holds triangle strips")):
            count = len(nodes.split())
            with unittest.mock.patch("mesh_edges.read_by_vtk", return_value=None):
                self.refuses(self.write("m.vtu", VTU.format(nodes=nodes, count=count, end=count + 3, kind=kind)), *MADE, says=says)
                self.refuses(os.path.join(self.folder, "m.vtu"), *MADE, says="install VTK")

    def test_lines_with_stiffness_and_no_law(self):
        """What other programs, and earlier versions, write: hooke is assumed, and said."""
        mesh = meshio.Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), [("line", [[0, 1], [1, 2]])], point_data={"mass": np.ones(3)}, cell_data={"stiffness": [np.array([2.0, 3.0])]})
        meshio.write(os.path.join(self.folder, "m.vtu"), mesh)
        for args, says in (((), "says no spring law, hooke is assumed"), (("--spring_law", "strain"), "")):
            found = self.lattice(os.path.join(self.folder, "m.vtu"), *args)
            self.assertEqual((found["springs/pairs"].tolist(), found["springs/stiffness"].tolist()), ([[0, 1], [1, 2]], [2, 3]))
            self.assertIn(says, found["said"])
            self.assertEqual(bool(found["said"]), bool(says))


if __name__ == "__main__":
    unittest.main(verbosity=1)
