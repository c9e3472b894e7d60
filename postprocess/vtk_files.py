"""VTK's XML files of a frame: springs as lines, particles as points, with all that a lattice is made of, so that a VTU becomes the same lattice again."""
import base64
import os
from pathlib import Path

import numpy as np

from backspring_io import RunError
from run_data import HISTORIES, LAW_DATA, TURN_LIMITS
from exports import padded, write_atomically

LAWS = ("hooke", "strain", "tension", "polynomial", "plastic", "maxwell")  # the numbers in the cell data `law`
DAMPING_LAWS = ("axial", "simple")
PARTICLE_COLUMNS = ("radius", "drag", "force")
MOST_MODES = 100  # in a file
MARK = "backspring_lattice"  # field data: a file that says all of its lattice
VTK_TYPES = {"f8": "Float64", "i8": "Int64", "i4": "Int32", "u1": "UInt8"}
VTK_LINE, VTK_VERTEX = 3, 1


def fields(run, row, every):
    """What VTK files carry: of particles, and of springs. `every`: of all springs, those that are not there flagged."""
    points = {"id": run.id, "fixed": run.fixed.astype(np.int32)}
    if run.velocities is not None:
        points["velocity"] = padded(run.velocity(row))
    if run.mass is not None:
        points["mass"] = run.mass
    points["displacement"] = padded(run.position(row) - run.position(0))
    points.update(mode_shapes(run))
    columns = {name: run.particle_column(name) for name in PARTICLE_COLUMNS}
    points.update({name: padded(values) if values.ndim == 2 else values for name, values in columns.items() if values is not None})
    springs = run.springs
    if not len(springs):
        return points, {}, springs.pairs
    kept = np.ones(len(springs), bool) if every else run.acting(row)
    data = {"strain": run.strains(row)}
    if run.tensions(row) is not None:
        data["tension"] = run.tensions(row)
    if run.stresses(row) is not None:
        data["stress"] = run.stresses(row)
    data.update({k: getattr(springs, k) for k in ("stiffness", "rest_length", "damping") if getattr(springs, k) is not None})
    data.update({**springs.law_data, **springs.limits})
    data.update({k: run.spring_state(k, row) for k in HISTORIES if run.spring_state(k, row) is not None})
    if run.broken(row) is not None:
        data["broken"] = run.broken(row).astype(np.int32)
    if run.spring_laws is not None:
        data["law"] = _law_numbers(run)
    if springs.shift is not None:  # a line across the box is a point in the picture: its ends are told apart
        data["ends"], data["shift"] = springs.pairs, springs.shift
    return points, {k: v[kept] for k, v in data.items()}, springs.lines[kept]


def mode_shapes(run):
    """The first shapes of a run of free vibrations as vectors, the largest displacement of each 1: ParaView's filter Warp By Vector shows them."""
    squared = run._array("/modes/omega_squared")
    shapes = [run._read("/modes/shape", k) for k in range(min(MOST_MODES, 0 if squared is None else len(squared)))]
    return {f"mode_{k:03d}": padded(q / max(np.sqrt((q ** 2).sum(axis=1)).max(), 1e-300)) for k, q in enumerate(shapes)}


def _law_numbers(run):
    unknown = sorted(set(run.spring_laws) - set(LAWS))
    if unknown:
        raise RunError(f"{run.path}: springs obey the law {unknown[0]}; VTK files have numbers for {', '.join(LAWS)}")
    return np.array([LAWS.index(law) for law in run.spring_laws], np.int32)


def lattice_fields(run, row, every=False):
    """What belongs neither to a particle nor to a spring. `every`: angle springs and hinges that are broken, too, with a flag."""
    out = {MARK: np.array([1]), "dimension": np.array([run.dim]), "time": np.array([run.times[row]])}
    law = run.parameters.get("bs_damping_law", DAMPING_LAWS[0])
    out["damping_law"] = np.array([DAMPING_LAWS.index(law)])
    angles, hinges = (run.angles, run.hinges) if every else (run.angles_at(row), run.hinges_at(row))
    if angles:
        out.update({"angles_triples": angles.triples, "angles_stiffness": angles.stiffness, "angles_rest_angle": angles.rest_angle})
        out.update({"angles_" + name: values for name, values in angles.limits.items()})
        if angles.shift is not None:
            out["angles_shift"] = angles.shift.reshape(len(angles), -1)
    for kind in ("angles", "hinges") if every else ():
        broken = run.broken_turns(kind, row)
        if broken is not None:
            out[f"{kind}_broken"] = broken.astype(np.int32)
    for name, table in (("hinges_", hinges), ("anchors_", run.anchors)):
        out.update({name + k: v for k, v in (table or {}).items()})
    out.update({"group_" + name: run.group(name) for name in run.groups})
    if run.has_modes:
        out["omega_squared"] = run._array("/modes/omega_squared")
    out.update({name.replace("/", "_"): run.series[name][row].reshape(-1) for name in run.series if name.startswith("reaction/") and row < len(run.series[name])})
    if any(run.periodic):
        out["box_edges"], out["box_periodic"] = run.box_edges(row), np.array(run.periodic, np.int32)
    return out


def _array(name, values, tuples=False):
    values = np.ascontiguousarray(values)
    values = values if values.dtype.str[1:] in VTK_TYPES else values.astype(np.int64 if values.dtype.kind in "iu" else float)
    raw = values.tobytes()
    parts = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    parts += f' NumberOfTuples="{len(values)}"' if tuples else ""
    return (f'<DataArray type="{VTK_TYPES[values.dtype.str[1:]]}" Name="{name}"{parts} '
            f'format="binary">{base64.b64encode(np.uint64(len(raw)).tobytes() + raw).decode()}</DataArray>\n')


def _write(run, row, path, kind, every):
    points, data, lines = fields(run, row, every)
    vertices = not len(run.springs)
    corners = np.arange(run.particles)[:, None] if vertices else lines
    ends = np.cumsum(np.full(len(corners), corners.shape[1], np.int64))
    cells = _array("connectivity", corners.astype(np.int64).ravel()) + _array("offsets", ends)
    place = "Cells" if kind == "UnstructuredGrid" else "Verts" if vertices else "Lines"
    if kind == "UnstructuredGrid":
        cells += _array("types", np.full(len(corners), VTK_VERTEX if vertices else VTK_LINE, np.uint8))
    counted = "Cells" if place == "Cells" else place
    sections = [("PointData", "".join(_array(k, v) for k, v in points.items())), ("CellData", "".join(_array(k, v) for k, v in data.items())),
                ("Points", _array("Points", padded(run.position(row)))), (place, cells)]
    with open(path, "w", encoding="ascii") as f:
        f.write(f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n<{kind}>\n<FieldData>\n'
                + "".join(_array(k, v, True) for k, v in lattice_fields(run, row, every).items())
                + f'</FieldData>\n<Piece NumberOfPoints="{run.particles}" NumberOf{counted}="{len(corners)}">\n'
                + "".join(f"<{name}>\n{body}</{name}>\n" for name, body in sections) + f"</Piece>\n</{kind}>\n</VTKFile>\n")


def write_vtu(run, row, path, every=False):
    """Springs as lines, particles as points, with their fields."""
    _write(run, row, path, "UnstructuredGrid", every)


def write_vtp(run, row, path, every=False):
    """The same as VTK PolyData."""
    _write(run, row, path, "PolyData", every)


def write_pvd(run, rows, path, ending=".vtu", every=False):
    """A collection with the times, beside a folder of VTU or VTP files."""
    stem = os.path.splitext(path)[0]
    os.makedirs(stem, exist_ok=True)
    entries = []
    for row in rows:
        name = os.path.join(stem, f"frame_{row:06d}{ending}")
        (write_vtp if ending == ".vtp" else write_vtu)(run, row, name, every)
        entries.append(f'    <DataSet timestep="{float(run.times[row])!r}" file="{os.path.basename(stem)}/{os.path.basename(name)}"/>\n')
    text = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n  <Collection>\n' \
        + "".join(entries) + "  </Collection>\n</VTKFile>\n"
    write_atomically(path, lambda part: Path(part).write_text(text, encoding="utf-8"))


def flat(table):
    """Columns of one number as numbers: some writers say so of them."""
    return {k: np.asarray(v)[:, 0] if np.ndim(v) == 2 and np.shape(v)[1] == 1 else np.asarray(v) for k, v in table.items()}


def said_of_lattice(points, cells, one):
    """{attribute of lattices.Lattice: value} of the point, cell and field data of a VTU that write_vtu wrote."""
    out = {k: points[k] for k in ("mass", "velocity", "fixed") if k in points}
    out["ids"] = points["id"].astype(np.int64)
    out.update({k: cells[k] for k in ("stiffness", "rest_length", "damping") if k in cells})
    out["spring_columns"] = {k: cells[k] for k in (*LAW_DATA, *HISTORIES) if k in cells}
    if "broken" in cells and cells["broken"].any():
        out["spring_columns"]["broken"] = cells["broken"].astype(float)
    out["particle_columns"] = {k: points[k] for k in PARTICLE_COLUMNS if k in points}
    if "force" in points:
        out["particle_columns"]["force"] = points["force"][:, :int(one["dimension"][0])]
    if "law" in cells:
        out["laws"] = np.array(LAWS)[cells["law"].astype(int)]
    out["damping_law"], out["dim"] = DAMPING_LAWS[int(one["damping_law"][0])], int(one["dimension"][0])
    turns = ("stiffness", "rest_angle", "shift", *TURN_LIMITS, "broken")
    for name, keys in (("angles", ("triples", *turns)), ("hinges", ("quads", *turns)), ("anchors", ("particle", "point", "stiffness", "rest_length", "damping"))):
        if f"{name}_{keys[0]}" in one:
            out[name] = {k: one[f"{name}_{k}"] for k in keys if f"{name}_{k}" in one}
    if "anchors" in out:
        out["anchors"]["point"] = out["anchors"]["point"].reshape(-1, out["dim"])
    out["groups"] = {k[len("group_"):]: v for k, v in one.items() if k.startswith("group_")}
    if "box_edges" in one:
        out["box"] = one["box_edges"].reshape(out["dim"], -1), [bool(v) for v in one["box_periodic"]]
        out["shift"] = cells["shift"].reshape(-1, out["dim"]) if "shift" in cells else None
        out["pairs"] = cells["ends"] if "ends" in cells else None
    return out
