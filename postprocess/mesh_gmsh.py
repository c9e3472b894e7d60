"""Gmsh meshes for meshio: nodes and elements alone, of which springs are made."""
import tempfile

from backspring_io import RunError

REASONS = (("parametric", "its nodes carry parametric coordinates; write it with Mesh.SaveParametric = 0"),
           ("array dimensions", "its elements carry labels of different number (a partitioned binary 2.2 mesh); write it as text or as 4.1"))


def bare_gmsh(path):
    """A temporary file with the sections $MeshFormat, $Nodes and $Elements of the mesh: physical groups of some entities and
    partitions, which meshio cannot read, stand in the others (mesh_groups.py)."""
    with open(path, "rb") as file:
        raw = file.read()
    if not raw.startswith((b"$MeshFormat", b"$Comments")):
        raise RunError(f"{path}: not a Gmsh mesh of format 2.2 or 4.1, which begins with $MeshFormat; write it by gmsh -save -format msh41")
    version = (raw[raw.find(b"$MeshFormat"):].split(None, 2) + [b"", b""])[1].decode("ascii", "replace")
    if version not in ("2", "2.0", "2.1", "2.2", "4.1"):
        raise RunError(f"{path}: Gmsh format {version[:8]} is not supported; write 4.1 or 2.2 (gmsh -save -format msh41)")
    out = tempfile.NamedTemporaryFile(suffix=".msh")
    for name in (b"$MeshFormat", b"$Nodes", b"$Elements"):
        end = b"\n" + name.replace(b"$", b"$End")
        first = 0 if raw.startswith(name) else raw.find(b"\n" + name + b"\n") + 1 or raw.find(b"\n" + name + b"\r\n") + 1
        last = raw.find(end, first)
        if last < 0 or (first == 0 and not raw.startswith(name)):
            raise RunError(f"{path}: has no whole section {name.decode()}: truncated?")
        out.write(raw[first:last] + end + b"\n")
    out.flush()
    return out


def sections_left_out(path):
    """Names of the other sections that say something of nodes or elements."""
    with open(path, "rb") as file:
        raw = file.read()
    names = ("NodeData", "ElementData", "ElementNodeData", "Periodic")
    return [f"section {name}" for name in names if b"$" + name.encode() in raw]


def reason(text):
    """What meshio's complaint means."""
    return next((said for word, said in REASONS if word in text), text)
