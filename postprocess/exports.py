"""Frames of a trajectory in the formats of other programs: extended XYZ, H5MD in nanometres, GSD (VTK: vtk_files.py, LAMMPS: lammps_write.py)."""
import os
import warnings

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


def box_of(run, row):
    """Edges (3, 3) of the box of a frame as rows, and which of them are periodic; along the others as long as the longest of these."""
    cell, periodic = np.zeros((3, 3)), np.array(run.periodic + [False] * 3)[:3]
    cell[:run.dim, :run.dim] = run.box_edges(row)
    longest = np.sqrt((cell[periodic] ** 2).sum(axis=1)).max()
    for k in np.flatnonzero(~periodic):
        if not cell[k].any():
            cell[k, k] = longest
    return cell, periodic


def write_xyz(run, rows, path):
    """Extended XYZ, a block of lines a frame; of periodic boxes with the edges."""
    moving = run.velocities is not None
    properties = "species:S:1:pos:R:3" + (":velo:R:3" if moving else "") + (":mass:R:1" if run.mass is not None else "") \
        + ":id:I:1:fixed:I:1"
    with open(path, "w", encoding="utf-8") as f:
        for row in rows:
            columns = [padded(run.position(row))] + ([padded(run.velocity(row))] if moving else []) \
                + ([run.mass[:, None]] if run.mass is not None else [])
            reals, box = np.concatenate(columns, axis=1), 'pbc="F F F"'
            if any(run.periodic):
                cell, periodic = box_of(run, row)
                box = 'Lattice="' + " ".join(f"{v:.17g}" for v in cell.ravel()) + '" pbc="' + " ".join("FT"[int(one)] for one in periodic) + '"'
            f.write(f"{run.particles}\nProperties={properties} Time={run.times[row]:.17g} Step={run.step[row]} {box}\n")
            form = "X " + "%.17g " * reals.shape[1] + "%d %d\n"
            f.writelines(form % (*values, i, held) for values, i, held in zip(reals.tolist(), run.id.tolist(), run.fixed.tolist()))


def gsd_frame(run, row, reach):
    """Box [lx, ly, lz, xy, xz, yz] about the origin, as HOOMD has it, positions within it, images and velocities. An open box no particle ever leaves; tilts are
    in units of the second edge's own height."""
    from lammps_box import frame_of
    if not any(run.periodic):
        return [max(2.2 * reach, 1e-6)] * 3 + [0, 0, 0], padded(run.position(row)), None, run.velocities is not None and padded(run.velocity(row))
    half = 1.1 * max(reach, 1e-6)
    frame = frame_of(run, row, lambda x: (np.full(3, -half), np.full(3, half)), run.acting(row))
    cell, x = frame.cell, frame.position + frame.images @ frame.cell
    images = np.where(frame.periodic, np.floor(x @ np.linalg.inv(cell) + 0.5), 0).astype(np.int32)
    box = [*np.diag(cell), cell[1, 0] / cell[1, 1], cell[2, 0] / cell[2, 2], cell[2, 1] / cell[2, 2]]
    return box, x - images @ cell, images, frame.velocity


def write_gsd(run, rows, path):
    """All frames with the bonds and angles that are there (HOOMD's schema, single precision: its own limit): OVITO, VMD, HOOMD-blue."""
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
            frame.configuration.box, position, images, velocity = gsd_frame(run, row, reach)
            frame.particles.N, frame.particles.types = run.particles, ["free", "fixed"]
            frame.particles.position, frame.particles.typeid = position, run.fixed.astype(np.uint32)
            if images is not None:
                frame.particles.image = images
            if run.velocities is not None:
                frame.particles.velocity = velocity
            if run.mass is not None:
                frame.particles.mass = run.mass
            there, angles = run.springs.pairs[run.acting(row)], run.angles_at(row)
            for group, ends, name in ((frame.bonds, there, "spring"), (frame.angles, angles.triples if angles else np.zeros((0, 3), int), "angle spring")):
                if len(run.springs) if name == "spring" else run.angles:
                    group.N, group.types, group.group, group.typeid = len(ends), [name], ends, np.zeros(len(ends), dtype=np.uint32)
            frame.log["time"] = np.array([run.times[row]])
            out.append(frame)


def write_nanometres(run, rows, path, units="si", box_lengths=False):
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
        boundary = np.array([b"periodic" if one else b"none" for one in (run.periodic + [False] * 3)[:3]])
        group.create_group("box").attrs.update({"dimension": 3, "boundary": boundary})
        for name, unit, factor, of in (("position", "nm", length / 1e-9, run.position), ("velocity", "m s-1", length / time, run.velocity)):
            if name == "position" or run.velocities is not None:
                value = group.create_dataset(name + "/value", (count, run.particles, 3), dtype=float)
                for k, row in enumerate(rows):
                    value[k] = factor * padded(of(row))
                value.attrs["unit"] = unit
        group["position/time"], group["position/step"] = time * run.times[rows], run.step[rows]
        group["position/time"].attrs["unit"] = "s"
        if any(run.periodic):  # three vectors, also of boxes along the axes: MDAnalysis before 2.5 takes three lengths for none; VOTCA knows nothing else
            edges = length / 1e-9 * np.array([box_of(run, row)[0] for row in rows])
            if box_lengths and (edges * (1 - np.eye(3))).any():
                raise RunError(f"{run.path}: --box_lengths: the edges of the box are not along the axes")
            group["box/edges/value"] = np.einsum("tkk->tk", edges) if box_lengths else edges
            group["box/edges/value"].attrs["unit"] = "nm"
        else:
            group["box/edges/value"] = np.zeros((count, 3))
        group["id"] = run.id
        if run.mass is not None:
            group["mass"] = run.mass
            group["mass"].attrs["unit"] = run.unit("mass")
        for other in ("velocity", "box/edges"):
            if other in group:
                group[other + "/time"], group[other + "/step"] = group["position/time"], group["position/step"]
