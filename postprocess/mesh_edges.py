"""Meshes as points and edges: what a lattice of springs is made of."""
import contextlib
import io
import os
import re

import numpy as np

from backspring_io import RunError
from mesh_gmsh import bare_gmsh, reason, sections_left_out
from mesh_groups import physical_groups
from mesh_ply import read_ply
from mesh_vtk import READERS, read_by_vtk

# Edges of an element by its corner and mid-edge nodes; a mid-edge node splits the edge into two springs.
LINE = [(0, 1)]
TRIANGLE = [(0, 1), (1, 2), (2, 0)]
QUAD = [(0, 1), (1, 2), (2, 3), (3, 0)]
TETRA = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
HEXA = QUAD + [(4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
WEDGE = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)]
PYRAMID = QUAD + [(0, 4), (1, 4), (2, 4), (3, 4)]

IMPLIED = ("gmsh:", "facet_normals")  # data that every file of its format has: numbers of entities, what follows from the points
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


class Group:
    """Of elements: their points, ascending, and their edges."""

    def __init__(self, blocks):
        self.points = np.unique(np.concatenate([nodes.ravel() for _, nodes in blocks]))
        self.pairs = unique_edges(blocks)


def read_mesh(path):
    """Points (N, 3), unique edges (M, 2), {} or, of a mesh of lines alone with a field "stiffness" (as convert.py writes it), what it says of the lattice: ids,
    mass, velocity, fixed (N), stiffness, rest_length, damping (M); groups of elements {name: Group}; and what it says besides, in words."""
    fields, groups, notes, remarks = {}, {}, [], []
    if path.lower().endswith(".obj"):
        points, blocks, notes = _read_obj(path)
    elif path.lower().endswith(".ply"):
        points, blocks, notes = read_ply(path)
    else:
        points, blocks, fields, groups, notes, remarks = _read_meshio(path)
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
    except OverflowError:
        raise RunError(f"{path}: an element names a point beyond 64 bits, of {len(points)}") from None
    except (IndexError, ValueError) as error:
        raise RunError(f"{path}: an element lacks nodes ({error})") from None
    if not len(pairs) and not fields:
        raise RunError(f"{path}: holds no elements with edges, so there are no springs")
    groups = {name: Group(members) for name, members in groups.items()}
    if len(pairs) and pairs.min() < 0 or pairs.max(initial=0) >= len(points):
        raise RunError(f"{path}: an element names point {pairs.max() if pairs.min() >= 0 else pairs.min()} of {len(points)}")
    if fields:
        given = fields.pop("pairs", None)
        pairs = given if given is not None else np.asarray(blocks[0][1], dtype=np.int64) if len(pairs) else pairs
    return points[:, :3], pairs, fields, groups, remarks + ([f"left out: {', '.join(notes)}"] if notes else [])


def _read_meshio(path):
    """By meshio, and by VTK what meshio cannot read of its files."""
    ending = os.path.splitext(path)[1].lower()
    try:
        mesh, said = _by_meshio(path)
        blocks, data = [(block.type, block.data) for block in mesh.cells], (mesh.point_data, {k: v[0] for k, v in mesh.cell_data.items()}, mesh.field_data)
    except RunError as refusal:
        mesh, said = _by_vtk(path, refusal) if ending in READERS else None, ""
        if mesh is None:
            raise
        blocks, data = mesh.blocks(path), (mesh.point_data, mesh.cell_data, mesh.field_data)
    fields, unused = _fields(path, [kind for kind, _ in blocks], *data)
    groups, remarks = {}, []
    if ending == ".msh":
        groups, remarks = physical_groups(path, mesh)
        unused += sections_left_out(path)
    return mesh.points, blocks, fields, groups, unused + [line.strip() for line in said.splitlines() if line.strip()], remarks


def _by_vtk(path, refusal):
    """None where VTK, too, cannot read it, and meshio has said why."""
    try:
        mesh = read_by_vtk(path)
    except RunError:
        if path.lower().endswith(".vtp") or "POLYDATA" in str(refusal):  # of which meshio knows nothing
            raise
        return None
    if mesh is None:
        raise RunError(f"{refusal}; or install VTK, which reads it: sudo apt-get install python3-vtk9")
    return mesh


def _by_meshio(path):
    """The mesh, and what was complained of."""
    import meshio
    said = io.StringIO()
    with bare_gmsh(path) if path.lower().endswith(".msh") else open(path, "rb") as file:
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
    return mesh, said.getvalue()


def _fields(path, kinds, points, cells, field):
    """What a mesh of lines says of a lattice: all of it where write_vtu wrote it, else what is called as in a lattice; and the names of what it says besides."""
    from vtk_files import MARK, flat, said_of_lattice
    points, cells, field = flat(points), flat(cells), flat(field)
    if MARK in field and kinds in ([], ["line"], ["vertex"]):
        try:
            return said_of_lattice(points, cells if kinds == ["line"] else {}, field), []
        except (KeyError, IndexError, ValueError, TypeError) as error:
            raise RunError(f"{path}: what it says of its lattice is damaged ({error})") from None
    of_points, of_cells = ("mass", "velocity", "fixed", "id"), ("stiffness", "rest_length", "damping")
    if kinds != ["line"] or "stiffness" not in cells:
        of_points = of_cells = ()
    fields = {k: np.asarray(points[k], dtype=float) for k in of_points if k in points and k != "id"}
    if "id" in points and "id" in of_points:
        fields["ids"] = np.asarray(points["id"]).reshape(-1).astype(np.int64)
    fields.update({k: np.asarray(cells[k], dtype=float) for k in of_cells if k in cells})
    unused = [(kind, sorted(set(map(str, names)) - set(used))) for kind, names, used in (("point", points, of_points), ("cell", cells, of_cells), ("field", field, ()))]
    return fields, [f"{kind} data {name}" for kind, names in unused for name in names if not name.startswith(IMPLIED)]


def _read_obj(path):
    """Wavefront OBJ: v, f (polygons) and l (polylines); numbers may count from the end. Normals, textures, groups are left out."""
    points, blocks, besides = [], {"polygon": [], "polyline": []}, {}
    last, where = 0, None  # the largest number of a point, and its line: points may follow the elements
    with open(path, encoding="utf-8-sig", errors="replace") as file:
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
                    if min(index) < -len(points):
                        raise RunError(f"{path}:{number}: '{line.strip()[:60]}' names point {min(index)} from the end of {len(points)}")
                    if max(index) > last:
                        last, where = max(index), f"{path}:{number}: '{line.strip()[:60]}'"
                    blocks["polygon" if words[0] == "f" else "polyline"].append(
                        [i - 1 if i > 0 else len(points) + i for i in index])
                elif words and not words[0].startswith("#"):
                    besides[words[0]] = besides.get(words[0], 0) + 1
            except ValueError:
                raise RunError(f"{path}:{number}: cannot read '{line.strip()[:60]}'") from None
    if last > len(points):
        raise RunError(f"{where} names point {last} of {len(points)}")
    return points, list(blocks.items()), [f"{count} lines {word}" for word, count in besides.items()]
