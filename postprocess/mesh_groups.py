"""Physical groups of Gmsh as groups of elements: names (always text), and which elements belong to which (labels of elements in 2.2, of entities in 4.1)."""
import re

import numpy as np

from backspring_io import RunError

WORDS = ("point", "curve", "surface", "volume")  # what Gmsh calls things of 0 to 3 dimensions
DIMENSIONS = {"vertex": 0, "line": 1, "line3": 1, "triangle": 2, "triangle6": 2, "quad": 2, "quad8": 2}  # all others 3


class _Numbers:
    """The numbers of a section, one after another, of text or binary: "i" integers, "n" counts, "d" reals."""

    def __init__(self, body, binary, size):
        self._words = None if binary else body.split()
        self._body, self._at = body, 0
        self._types = {"i": np.dtype("i4"), "n": np.dtype(f"u{size}"), "d": np.dtype("f8")}

    def take(self, kind, count=1):
        if self._words is not None:
            found = [float(w) if kind == "d" else int(w) for w in self._words[self._at:self._at + count]]
            self._at += count
        else:
            end = self._at + count * self._types[kind].itemsize
            found = np.frombuffer(self._body[self._at:end], self._types[kind]).tolist()
            self._at = end
        if len(found) != count:
            raise ValueError("ends early")
        return found

    def list(self, kind="i"):
        """A count, and as many numbers."""
        return self.take(kind, self.take("n")[0])


def _section(raw, name):
    """What stands between $name and $Endname, or None."""
    begin = re.search(rb"^\$" + name + rb"\r?\n", raw, re.M)
    end = begin and raw.find(b"$End" + name, begin.end())
    return None if not begin or end < 0 else raw[begin.end():end]


def _names(raw):
    """{(dimension, label): name}"""
    text = (_section(raw, b"PhysicalNames") or b"").decode(errors="replace")
    return {(int(d), abs(int(label))): name for d, label, name in re.findall(r'^\s*(\d)\s+(-?\d+)\s+"(.*)"\s*$', text, re.M)}


def _labels_of_entities(raw):
    """{(dimension, entity): [(dimension, label)]} of format 4.1. Elements of a mesh in parts belong to entities of the parts, which have the labels of their parents: those
    between two parts the labels of what was cut there."""
    head = raw[raw.find(b"$MeshFormat"):].split(None, 4)
    parted = _section(raw, b"PartitionedEntities")
    body = _section(raw, b"Entities") if parted is None else parted
    if body is None:
        return {}
    numbers, found = _Numbers(body, head[2] == b"1", int(head[3])), {}
    if parted is not None:
        numbers.take("n")
        numbers.take("i", 2 * numbers.take("n")[0])  # ghosts and their parts
    for dim, count in enumerate(numbers.take("n", 4)):
        for _ in range(count):
            entity = numbers.take("i")[0]
            owner = dim
            if parted is not None:
                owner = numbers.take("i", 2)[0]
                numbers.list()  # its parts
            numbers.take("d", 6 if dim else 3)  # its bounds
            found[dim, entity] = [(owner, abs(label)) for label in numbers.list()]
            if dim:
                numbers.list()  # its boundary
    return found


def _members(raw, mesh):
    """{(dimension, label): [(element type, nodes)]} of meshio's mesh."""
    found, by_element = {}, "gmsh:physical" in mesh.cell_data
    entities = {} if by_element else _labels_of_entities(raw)
    tags = mesh.cell_data.get("gmsh:physical" if by_element else "gmsh:geometrical", [])
    for block, here in zip(mesh.cells, tags):
        dim = DIMENSIONS.get(block.type, 3)
        for tag in np.unique(here):
            for key in [(dim, int(tag))] if by_element else entities.get((dim, int(tag)), []):
                if key[1]:
                    found.setdefault(key, []).append((block.type, np.asarray(block.data)[np.asarray(here) == tag]))
    return found


def physical_groups(path, mesh):
    """({name: [(element type, nodes)]}, remarks). Names have letters, digits and underscores, as groups of lattices do; a group without a name is called after
    its kind and label, as curve_7, and of two with one name the kind tells which is which."""
    with open(path, "rb") as file:
        raw = file.read()
    try:
        names, members = _names(raw), _members(raw, mesh)
    except (ValueError, IndexError, UnicodeDecodeError) as error:
        raise RunError(f"{path}: its section of entities cannot be read ({error})") from None
    groups, remarks = {}, []
    plain = {key: group_name(names.get(key, f"{WORDS[key[0]]}_{key[1]}")) for key in sorted(members)}
    for key, blocks in sorted(members.items()):
        name = plain[key] if list(plain.values()).count(plain[key]) == 1 else f"{plain[key]}_{WORDS[key[0]]}"
        groups[name if name not in groups else f"{name}_{key[1]}"] = blocks
        if key in names and name != names[key]:
            remarks.append(f'the {WORDS[key[0]]} group "{names[key]}" is called {name}')
    remarks += [f'the {WORDS[key[0]]} group "{name}" has no elements and is left out' for key, name in sorted(names.items()) if key not in members]
    return groups, remarks


def group_name(name):
    """Letters, digits and underscores, a letter first."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return name if re.match("[A-Za-z]", name) else "group_" + name
