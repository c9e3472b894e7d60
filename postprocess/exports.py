"""Frames of a trajectory in the formats of other programs: extended XYZ, H5MD in nanometres, GSD, VTU, VTP and PVD (LAMMPS: lammps_write.py)."""
import base64
import os
import warnings
from pathlib import Path

import h5py
import numpy as np

from backspring_io import RunError
from lammps_units import UNITS


def write_atomically(path, write):
    """Calls write(temporary name) and renames: the file appears whole or not at all."""
    stem, ending = os.path.splitext(path)
    part = f"{stem}.part{ending}"
    try:
        write(part)
        os.replace(part, path)
    finally:
        if os.path.exists(part):
            os.remove(part)


def padded(values):
    """(n, d) as (n, 3)."""
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))


def write_xyz(run, rows, path):
    """Extended XYZ, a block of lines a frame."""
    moving = run.velocities is not None
    properties = "species:S:1:pos:R:3" + (":velo:R:3" if moving else "") + (":mass:R:1" if run.mass is not None else "") \
        + ":id:I:1:fixed:I:1"
    with open(path, "w", encoding="utf-8") as f:
        for row in rows:
            columns = [padded(run.position(row))] + ([padded(run.velocity(row))] if moving else []) \
                + ([run.mass[:, None]] if run.mass is not None else [])
            reals = np.concatenate(columns, axis=1)
            f.write(f"{run.particles}\nProperties={properties} Time={run.times[row]:.17g} Step={run.step[row]} "
                    'pbc="F F F"\n')
            form = "X " + "%.17g " * reals.shape[1] + "%d %d\n"
            f.writelines(form % (*values, i, held) for values, i, held in zip(reals.tolist(), run.id.tolist(), run.fixed.tolist()))


def write_gsd(run, rows, path):
    """All frames with the bonds (HOOMD's schema, single precision: its own limit): OVITO, VMD, HOOMD-blue."""
    try:
        import gsd.hoomd
    except ImportError:
        raise RunError("no gsd in this Python; install with: sudo apt-get install python3-gsd") from None
    reach = max(float(np.abs(run.position(row)).max()) for row in rows)
    with gsd.hoomd.open(path, "wb") as out, warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # gsd 2.7 compares lists with arrays
        for row in rows:
            frame = gsd.hoomd.Snapshot()
            frame.configuration.step = int(run.step[row])
            frame.configuration.dimensions = run.dim if run.dim > 1 else 2
            frame.configuration.box = [max(2.2 * reach, 1e-6)] * 3 + [0, 0, 0]  # open: no particle ever leaves it
            frame.particles.N, frame.particles.types = run.particles, ["free", "fixed"]
            frame.particles.position, frame.particles.typeid = padded(run.position(row)), run.fixed.astype(np.uint32)
            if run.velocities is not None:
                frame.particles.velocity = padded(run.velocity(row))
            if run.mass is not None:
                frame.particles.mass = run.mass
            if len(run.springs):
                inside = run.springs.inside
                frame.bonds.N, frame.bonds.types, frame.bonds.group = inside.sum(), ["spring"], run.springs.pairs[inside]
                frame.bonds.typeid = np.zeros(inside.sum(), dtype=np.uint32)
            frame.log["time"] = np.array([run.times[row]])
            out.append(frame)


def write_nanometres(run, rows, path, units="si"):
    """H5MD in nanometres, m/s and seconds, of three components: the length is one that MDAnalysis knows, and VOTCA's own."""
    if UNITS[units] is None:
        raise RunError("--units lj: relative units cannot be put in nanometres")
    _, length, time = UNITS[units][:3]
    count = len(rows)
    with h5py.File(path, "w") as f:
        f.create_group("h5md").attrs["version"] = np.array([1, 1], dtype=np.int32)
        for name in ("author", "creator"):
            f.create_group("h5md/" + name).attrs.update({"name": "backspring", "version": "convert.py"} if name == "creator" else {"name": "unknown"})
        f.create_group("h5md/modules/units").attrs.update({"version": np.array([1, 0], dtype=np.int32), "system": "SI"})
        group = f.create_group("particles/trajectory")
        group.create_group("box").attrs.update({"dimension": 3, "boundary": np.array([b"none"] * 3)})
        for name, unit, factor, of in (("position", "nm", length / 1e-9, run.position), ("velocity", "m s-1", length / time, run.velocity)):
            if name == "position" or run.velocities is not None:
                value = group.create_dataset(name + "/value", (count, run.particles, 3), dtype=float)
                for k, row in enumerate(rows):
                    value[k] = factor * padded(of(row))
                value.attrs["unit"] = unit
        group["position/time"], group["position/step"] = time * run.times[rows], run.step[rows]
        group["position/time"].attrs["unit"] = "s"
        group["box/edges/value"] = np.zeros((count, 3))
        for other in ("velocity", "box/edges"):
            if other in group:
                group[other + "/time"], group[other + "/step"] = group["position/time"], group["position/step"]


def fields(run, row):
    """What VTK files carry: of particles, and of springs."""
    points = {"id": run.id, "fixed": run.fixed.astype(np.int32)}
    if run.velocities is not None:
        points["velocity"] = padded(run.velocity(row))
    if run.mass is not None:
        points["mass"] = run.mass
    springs, data = run.springs, {}
    if len(springs):
        data["strain"] = run.strains(row)
        data.update({k: getattr(springs, k) for k in ("stiffness", "rest_length", "damping") if getattr(springs, k) is not None})
    return points, data


def write_vtu(run, row, path):
    """Springs as lines, particles as points, with their fields."""
    import meshio
    points, data = fields(run, row)
    cells = [("line", run.springs.lines)] if len(run.springs) else [("vertex", np.arange(run.particles)[:, None])]
    meshio.write(path, meshio.Mesh(padded(run.position(row)), cells, point_data=points, cell_data={k: [v] for k, v in data.items()}),
                 file_format="vtu")


VTK_TYPES = {"f8": "Float64", "i8": "Int64", "i4": "Int32"}


def _array(name, values):
    values = np.ascontiguousarray(values)
    raw = values.tobytes()
    return (f'<DataArray type="{VTK_TYPES[values.dtype.str[1:]]}" Name="{name}" NumberOfComponents="{values.shape[1] if values.ndim > 1 else 1}" '
            f'format="binary">{base64.b64encode(np.uint64(len(raw)).tobytes() + raw).decode()}</DataArray>\n')


def write_vtp(run, row, path):
    """The same as VTK PolyData: lines, or vertices where there are no springs."""
    points, data = fields(run, row)
    count = len(run.springs) or run.particles
    corners, kind = (run.springs.lines.ravel(), "Lines") if len(run.springs) else (np.arange(count), "Verts")
    ends = np.arange(1, count + 1, dtype=np.int64) * (2 if kind == "Lines" else 1)
    sections = [("PointData", "".join(_array(k, v) for k, v in points.items())), ("CellData", "".join(_array(k, v) for k, v in data.items())),
                ("Points", _array("Points", padded(run.position(row)))),
                (kind, _array("connectivity", corners.astype(np.int64)) + _array("offsets", ends))]
    with open(path, "w", encoding="ascii") as f:
        f.write('<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n<PolyData>\n'
                f'<Piece NumberOfPoints="{run.particles}" NumberOf{kind}="{count}">\n'
                + "".join(f"<{name}>\n{body}</{name}>\n" for name, body in sections) + "</Piece>\n</PolyData>\n</VTKFile>\n")


def write_pvd(run, rows, path, ending=".vtu"):
    """A collection with the times, beside a folder of VTU or VTP files."""
    stem = os.path.splitext(path)[0]
    os.makedirs(stem, exist_ok=True)
    entries = []
    for row in rows:
        name = os.path.join(stem, f"frame_{row:06d}{ending}")
        (write_vtp if ending == ".vtp" else write_vtu)(run, row, name)
        entries.append(f'    <DataSet timestep="{run.times[row]:.17g}" file="{os.path.basename(stem)}/{os.path.basename(name)}"/>\n')
    text = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n  <Collection>\n' \
        + "".join(entries) + "  </Collection>\n</VTKFile>\n"
    write_atomically(path, lambda part: Path(part).write_text(text, encoding="utf-8"))
