"""VTK files by VTK itself, in a process of its own, which a damaged file may end: what meshio leaves out (PolyData, polylines, triangle strips, sets of vertices)."""
import os
import subprocess
import sys
import tempfile

import numpy as np

from backspring_io import RunError

READERS = {".vtk": "vtkDataSetReader", ".vtu": "vtkXMLUnstructuredGridReader", ".vtp": "vtkXMLPolyDataReader"}
SCRIPT = """
import sys
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules import vtkIOLegacy, vtkIOXML
name, source, target = sys.argv[1:]
reader = getattr(vtkIOXML if "XML" in name else vtkIOLegacy, name)()
reader.SetFileName(source)
if name == "vtkDataSetReader":
    for kind in ("Scalars", "Vectors", "Normals", "Tensors", "ColorScalars", "TCoords", "Fields"):
        getattr(reader, f"ReadAll{kind}On")()
reader.Update()
data = reader.GetOutput()
if data is None or not data.GetNumberOfPoints():
    sys.exit("holds no points")
out = {"points": np.array([data.GetPoint(k) for k in range(data.GetNumberOfPoints())])}
count = data.GetNumberOfCells()
nodes, sizes, types = [], [], []
for k in range(count):
    cell = data.GetCell(k)
    here = [cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())]
    nodes += here
    sizes.append(len(here))
    types.append(data.GetCellType(k))
out.update(nodes=np.array(nodes, np.int64), sizes=np.array(sizes, np.int64), types=np.array(types, np.int64))
for group, of in (("point", data.GetPointData()), ("cell", data.GetCellData()), ("field", data.GetFieldData())):
    for k in range(of.GetNumberOfArrays()):
        if of.GetArray(k) is not None:
            out[f"{group}:{of.GetArrayName(k)}"] = vtk_to_numpy(of.GetArray(k))
np.savez(target, **out)
"""
VERTEX, POLYVERTEX, LINE, POLYLINE, STRIP, POLYGON, PIXEL, VOXEL = 1, 2, 3, 4, 6, 7, 8, 11
NAMES = {LINE: "line", 5: "triangle", 9: "quad", 10: "tetra", 12: "hexahedron", 13: "wedge", 14: "pyramid", 21: "line3", 22: "triangle6", 23: "quad8", 24: "tetra10",
         25: "hexahedron20"}


class Mesh:
    """points (N, 3), blocks [(kind of element, nodes)], and arrays by name of points, cells and the whole."""

    def __init__(self, found):
        self.points = found["points"]
        self.types, self.nodes = found["types"], np.split(found["nodes"], np.cumsum(found["sizes"])[:-1]) if len(found["sizes"]) else []
        self.point_data, self.cell_data, self.field_data = ({key.split(":", 1)[1]: found[key] for key in found.files if key.startswith(group + ":")} for group in ("point", "cell", "field"))

    def blocks(self, path):
        """As mesh_edges takes them: strips as their triangles' edges, sets of vertices as nothing."""
        out = {}
        for kind, nodes in zip(self.types.tolist(), self.nodes):
            if kind in (VERTEX, POLYVERTEX):
                continue
            if kind == POLYLINE:
                out.setdefault("polyline", []).append(nodes)
            elif kind == STRIP:
                out.setdefault("triangle", []).extend(nodes[k:k + 3] for k in range(len(nodes) - 2))
            elif kind == POLYGON:
                out.setdefault("polygon", []).append(nodes)
            elif kind in (PIXEL, VOXEL):  # the elements of images, whose nodes go along the axes
                out.setdefault("quad" if kind == PIXEL else "hexahedron", []).append(nodes[[0, 1, 3, 2] if kind == PIXEL else [0, 1, 3, 2, 4, 5, 7, 6]])
            elif kind in NAMES:
                out.setdefault(NAMES[kind], []).append(nodes)
            else:
                raise RunError(f"{path}: holds elements of VTK's type {kind}, which are not supported")
        return [(kind, nodes if kind.startswith("poly") else np.array(nodes)) for kind, nodes in out.items()]


def read_by_vtk(path):
    """The mesh, or None where there is no VTK in this Python."""
    import importlib.util
    if importlib.util.find_spec("vtkmodules") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "mesh.npz")
        ending = os.path.splitext(path)[1].lower()
        done = subprocess.run([sys.executable, "-c", SCRIPT, READERS[ending], path, target], capture_output=True, text=True, errors="replace")
        said = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        if done.returncode or said or not os.path.exists(target):
            words = next((line for line in said if "Error" in line or "): " in line), said[-1] if said else f"VTK ended with {done.returncode}")
            raise RunError(f"{path}: not readable as a {ending} mesh ({words[-120:]})")
        with np.load(target) as found:
            return Mesh(found)
