"""Meshes as points and edges: what a lattice of springs is made of."""
import contextlib
import io
import os
import re

import numpy as np

from backspring_io import RunError
from mesh_gmsh import bare_gmsh, reason
from mesh_ply import read_ply

# Edges of an element by its corner and mid-edge nodes; a mid-edge node splits the edge into two springs.
LINE = [(0, 1)]
TRIANGLE = [(0, 1), (1, 2), (2, 0)]
QUAD = [(0, 1), (1, 2), (2, 3), (3, 0)]
TETRA = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
HEXA = QUAD + [(4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
WEDGE = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
PYRAMID = QUAD + [(0, 4), (1, 4), (2, 4), (3, 4)]

UNREAD = {2: "sets of vertices (poly vertex)", 4: "polylines", 6: "triangle strips"}  # of VTK; meshio leaves them out with a warning


def split(edges, corners):
    """Edges of the quadratic element whose mid-edge nodes follow the corners in the order of `edges`."""
    return [half for k, (a, b) in enumerate(edges) for half in ((a, corners + k), (corners + k, b))]


EDGES = {"line": LINE, "triangle": TRIANGLE, "quad": QUAD, "tetra": TETRA, "hexahedron": HEXA, "wedge": WEDGE,
         "pyramid": PYRAMID, "line3": split(LINE, 2), "triangle6": split(TRIANGLE, 3), "quad8": split(QUAD, 4),
         "tetra10": split(TETRA, 4), "hexahedron20": split(HEXA, 8)}


def unique_edges(blocks):
    """Sorted unique pairs (M, 2) of [(element type, nodes (n, k))]; elements of vertices have none."""
    found = [np.zeros((0, 2), dtype=np.int64)]
    for kind, nodes in blocks:
        if kind == "vertex":
            continue
        if kind in ("polygon", "polyline"):
            for ring in nodes:
                ring = np.asarray(ring, dtype=np.int64)
                ends = np.roll(ring, -1) if kind == "polygon" else ring[1:]
                found.append(np.stack([ring[:len(ends)], ends], axis=1))
            continue
        if kind not in EDGES:
            raise RunError(f"elements of type {kind} are not supported; there are {', '.join(EDGES)}, polygon (Gmsh: Mesh.ElementOrder = 1 or 2)")
        nodes = np.asarray(nodes, dtype=np.int64)
        found += [nodes[:, edge] for edge in EDGES[kind]]
    pairs = np.sort(np.concatenate(found), axis=1)
    return np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)


def read_mesh(path):
    """Points (N, 3), unique edges (M, 2), and {} or, of a mesh of lines alone with a field "stiffness" (as convert.py
    writes it), what it says of the lattice: ids, mass, velocity, fixed (N), stiffness, rest_length, damping (M)."""
    fields = {}
    if path.lower().endswith(".obj"):
        points, blocks = _read_obj(path)
    elif path.lower().endswith(".ply"):
        points, blocks = read_ply(path)
    else:
        points, blocks, fields = _read_meshio(path)
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or not len(points):
        raise RunError(f"{path}: holds no points")
    if points.shape[1] < 3:
        points = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    if not np.isfinite(points).all():
        raise RunError(f"{path}: point {int(np.argmin(np.isfinite(points).all(axis=1)))} is not finite")
    try:
        pairs = unique_edges(blocks)
    except RunError as error:
        raise RunError(f"{path}: {error}") from None
    except (IndexError, ValueError) as error:
        raise RunError(f"{path}: an element lacks nodes ({error})") from None
    if not len(pairs) and not fields:
        raise RunError(f"{path}: holds no elements with edges, so there are no springs")
    if len(pairs) and pairs.min() < 0 or pairs.max(initial=0) >= len(points):
        raise RunError(f"{path}: an element names point {pairs.max() if pairs.min() >= 0 else pairs.min()} of {len(points)}")
    if fields:
        given = fields.pop("pairs", None)
        pairs = given if given is not None else np.asarray(blocks[0][1], dtype=np.int64) if len(pairs) else pairs
    return points[:, :3], pairs, fields


def _read_meshio(path):
    import meshio
    said = io.StringIO()
    gmsh = path.lower().endswith(".msh")
    with bare_gmsh(path) if gmsh else open(path, "rb") as file:
        try:  # meshio prints its complaints, and ends the process over some of them
            with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
                mesh = meshio.read(file.name)
        except (SystemExit, Exception) as error:
            text = str(error) if not isinstance(error, SystemExit) else ""
            lines = (text or said.getvalue()).strip().splitlines() or [type(error).__name__]
            raise RunError(f"{path}: not readable as a {os.path.splitext(path)[1]} mesh ({reason(lines[0])[:120]})") from None
    left_out = sorted(set(re.findall(r"cannot handle \(type (\d+)\)", said.getvalue())))
    if left_out:
        names = ", ".join(UNREAD.get(int(k), f"VTK type {k}") for k in left_out)
        raise RunError(f"{path}: holds {names}, which cannot be read: write lines, triangles and other single elements (ParaView: filter Triangulate)")
    return mesh.points, [(block.type, block.data) for block in mesh.cells], _fields(path, mesh)


def _fields(path, mesh):
    """What a mesh of lines says of a lattice: all of it where write_vtu wrote it, else what is called as in a lattice."""
    from vtk_files import MARK, said_of_lattice
    kinds = [block.type for block in mesh.cells]
    if MARK in mesh.field_data and kinds in ([], ["line"], ["vertex"]):
        try:
            return said_of_lattice(mesh.point_data, {k: v[0] for k, v in mesh.cell_data.items()} if kinds == ["line"] else {}, mesh.field_data)
        except (KeyError, IndexError, ValueError, TypeError) as error:
            raise RunError(f"{path}: what it says of its lattice is damaged ({error})") from None
    if kinds != ["line"] or "stiffness" not in mesh.cell_data:
        return {}
    fields = {k: np.asarray(mesh.point_data[k], dtype=float) for k in ("mass", "velocity", "fixed") if k in mesh.point_data}
    if "id" in mesh.point_data:
        fields["ids"] = np.asarray(mesh.point_data["id"]).reshape(-1).astype(np.int64)
    fields.update({k: np.asarray(mesh.cell_data[k][0], dtype=float) for k in ("stiffness", "rest_length", "damping") if k in mesh.cell_data})
    return fields


def _read_obj(path):
    """Wavefront OBJ: v, f (polygons) and l (polylines); numbers may count from the end."""
    points, blocks = [], {"polygon": [], "polyline": []}
    with open(path, encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, 1):
            words = line.split()
            try:
                if words[:1] == ["v"]:
                    points.append([float(w) for w in words[1:4]])
                    if len(points[-1]) != 3:
                        raise ValueError
                elif words[:1] in (["f"], ["l"]):
                    index = [int(w.split("/")[0]) for w in words[1:]]
                    if len(index) < 2 or 0 in index:
                        raise ValueError
                    blocks["polygon" if words[0] == "f" else "polyline"].append(
                        [i - 1 if i > 0 else len(points) + i for i in index])
            except ValueError:
                raise RunError(f"{path}:{number}: cannot read '{line.strip()[:60]}'") from None
    return points, list(blocks.items())
