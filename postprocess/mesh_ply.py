"""PLY meshes (text and binary): vertices, faces and edges, whatever else the file gives of them or beside them."""
import numpy as np

from backspring_io import RunError

TYPES = {"char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2", "int": "i4",
         "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8"}
FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class NotWhole(Exception):
    """A number of a point that is none: in which row of which element, and what stands there."""


def read_ply(path):
    """Points (N, 3), blocks [(kind of element, nodes)] as mesh_edges takes them, and what is left out, in words."""
    with open(path, "rb") as file:
        raw = file.read()
    try:
        order, elements, body = _header(raw)
        tables, starts = (_text if order == "" else _binary)(body, elements, order)
        return *_mesh(tables), _besides(tables)
    except NotWhole as error:
        name, row, value = error.args
        line = f":{_line(raw, body, starts[name][row])}" if name in starts else ""
        raise RunError(f"{path}{line}: {name} {row} names point {value:.17g}; points are whole numbers, counted from 0") from None
    except RunError as error:
        raise RunError(f"{path}: {error}") from None
    except (ValueError, IndexError, KeyError, OverflowError) as error:
        raise RunError(f"{path}: malformed PLY ({error})") from None


def _header(raw):
    """Byte order, [(element, count, [(property, type of the length or None, type)])], and what follows the header."""
    end = raw.find(b"end_header")
    if not raw.startswith(b"ply") or end < 0:
        raise RunError("not a PLY mesh, which begins with ply and has a line end_header")
    order, elements = None, []
    for line in raw[:end].decode("ascii", "replace").splitlines()[1:]:
        words = line.split()
        if words[:1] == ["format"]:
            order = FORMS[words[1]]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:2] == ["property", "list"]:
            elements[-1][2].append((words[4], TYPES[words[2]], TYPES[words[3]]))
        elif words[:1] == ["property"]:
            elements[-1][2].append((words[2], None, TYPES[words[1]]))
    if order is None:
        raise RunError("the PLY header names no format")
    return order, elements, raw[raw.index(b"\n", end) + 1:]


def _line(raw, body, word):
    """The line of the file on which a word of its body stands."""
    number = raw[:len(raw) - len(body)].count(b"\n")
    for line in body.split(b"\n"):
        number, word = number + 1, word - len(line.split())
        if word < 0:
            break
    return number


def _text(body, elements, _):
    """{element: {property: column, or list of rows}}, from words, and {element: the first word of every row}."""
    words, at, tables, starts = body.split(), 0, {}, {}
    for name, count, properties in elements:
        if not any(length for _, length, _ in properties):
            width = len(properties)
            if at + count * width > len(words):
                raise RunError(f"element {name} ends early: truncated?")
            block = np.array(words[at:at + count * width], dtype=float).reshape(count, width)
            tables[name], starts[name] = {p[0]: block[:, k] for k, p in enumerate(properties)}, range(at, at + count * width, max(width, 1))
            at += count * width
            continue
        table, starts[name] = {p[0]: [] for p in properties}, []
        for _ in range(count):
            starts[name].append(at)
            for key, length, _ in properties:
                size = int(words[at]) if length else 1
                at += 1 if length else 0
                if size < 0 or at + size > len(words):
                    raise RunError(f"element {name} ends early: truncated?")
                row = [float(w) for w in words[at:at + size]]
                table[key].append(row if length else row[0])
                at += size
        tables[name] = table
    return tables, starts


def _binary(body, elements, order):
    """The same from bytes, without the words. Rows whose lists are as long as the first row's are read at once, as far as they go."""
    at, tables = 0, {}
    for name, count, properties in elements:
        table, done = {p[0]: [] for p in properties}, 0
        while done < count and properties:
            row = _row_type(body, at, properties, order, name)
            most = min(count - done, (len(body) - at) // row.itemsize)
            if most < 1:
                raise RunError(f"element {name} ends early: truncated?")
            block = np.frombuffer(body, row, most, at)
            same = np.ones(most, dtype=bool)
            for key, length, _ in properties:
                if length:
                    same &= block["length of " + key] == block["length of " + key][0]
            take = most if same.all() else int(np.argmin(same))
            for key, _, _ in properties:
                table[key].append(block[key][:take])
            at, done = at + take * row.itemsize, done + take
        tables[name] = {key: [r for part in parts for r in part] if any(p[0] == key and p[1] for p in properties)
                        else np.concatenate(parts or [np.zeros(0)]) for key, parts in table.items()}
    return tables, {}


def _row_type(body, at, properties, order, name):
    """The type of a row at byte `at`, its lists as long as they are there."""
    parts = []
    for key, length, kind in properties:
        if length:
            here = at + np.dtype(parts).itemsize if parts else at
            size = np.dtype(order + length).itemsize
            if here + size > len(body):
                raise RunError(f"element {name} ends early: truncated?")
            parts += [("length of " + key, order + length), (key, order + kind, (int(np.frombuffer(body, order + length, 1, here)[0]),))]
        else:
            parts.append((key, order + kind))
    return np.dtype(parts)


USED = {"vertex": "xyz", "face": ("vertex_indices", "vertex_index"), "edge": ("vertex1", "vertex2")}


def _besides(tables):
    return [f"element {name}" if name not in USED else f"property {key} of {name}" for name, table in tables.items() for key in (table if name in USED else [""])
            if name not in USED or key not in USED[name]]


def _points_of(values, name, rows):
    """Rows of points as whole numbers; `rows`: those of the element `name` that these are."""
    values = np.asarray(values)
    none = ~(np.abs(values) < 2.0 ** 53) | (np.floor(values) != values)
    if none.any():
        k = int(none.any(axis=1).argmax())
        raise NotWhole(name, int(rows[k]), float(values[k][none[k]][0]))
    return values.astype(np.int64)


def _mesh(tables):
    if "tristrips" in tables:
        raise RunError("triangle strips (element tristrips) are not supported; write triangles as element face")
    vertex = tables.get("vertex", {})
    if "x" not in vertex or "y" not in vertex:
        raise RunError("has no vertices with x and y")
    points = np.stack([np.asarray(vertex.get(k, np.zeros(len(vertex["x"]))), dtype=float) for k in "xyz"], axis=1)
    blocks, faces = [], tables.get("face", {})
    rings = faces.get("vertex_indices", faces.get("vertex_index", []))
    sizes = np.array([len(r) for r in rings], dtype=int)
    for size in np.unique(sizes):
        if size > 1:
            these = np.flatnonzero(sizes == size)
            nodes = _points_of([rings[k] for k in these], "face", these)
            blocks.append(({3: "triangle", 4: "quad"}.get(int(size), "polygon"), nodes))
    edge = tables.get("edge", {})
    if "vertex1" in edge and "vertex2" in edge:
        ends = np.stack([edge["vertex1"], edge["vertex2"]], axis=1)
        blocks.append(("line", _points_of(ends, "edge", np.arange(len(ends)))))
    return points, blocks
