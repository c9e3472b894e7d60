"""Frames of a trajectory in the formats of other programs: extended XYZ, LAMMPS data, VTU and PVD."""
import os
import sys
from pathlib import Path

import numpy as np

from backspring_io import RunError


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


def write_data(run, row, path):
    from lammps_data import write_lammps
    springs = run.springs
    if run.mass is None:
        raise RunError(f"{run.path}: holds no masses, which a LAMMPS data file needs")
    if len(springs) and springs.stiffness is None:
        raise RunError(f"{run.path}: holds no stiffnesses, which a LAMMPS data file needs")
    stiffness = springs.stiffness
    if len(springs) and run.spring_law is None:
        print(f"{run.path}: does not say which spring law, hooke is assumed", file=sys.stderr)
    if run.spring_law == "strain":  # K in newtons: the rate is K/L; a rest length of 0 has the rate itself
        stiffness = np.where(springs.rest_length > 0, stiffness / np.where(springs.rest_length > 0, springs.rest_length, 1.0), stiffness)
    velocity = padded(run.velocity(row)) if run.velocities is not None else None
    title = f"backspring {os.path.basename(run.path)}, t = {run.times[row]:.17g}, dampers left out"
    write_lammps(path, title, padded(run.position(row)), velocity, run.mass, run.fixed, run.id, springs.pairs, stiffness,
                 springs.rest_length)


def write_vtu(run, row, path):
    """Springs as lines with strain, particles as points with velocity, mass and id."""
    import meshio
    points = {"id": run.id, "fixed": run.fixed.astype(np.int32)}
    if run.velocities is not None:
        points["velocity"] = padded(run.velocity(row))
    if run.mass is not None:
        points["mass"] = run.mass
    springs = run.springs
    if len(springs):
        cells, data = [("line", springs.pairs)], {"strain": [run.strains(row)]}
        data.update({k: [v] for k, v in (("stiffness", springs.stiffness), ("rest_length", springs.rest_length)) if v is not None})
    else:
        cells, data = [("vertex", np.arange(run.particles)[:, None])], {}
    meshio.write(path, meshio.Mesh(padded(run.position(row)), cells, point_data=points, cell_data=data), file_format="vtu")


def write_pvd(run, rows, path):
    """A collection with the times, beside a folder of VTU files."""
    stem = os.path.splitext(path)[0]
    os.makedirs(stem, exist_ok=True)
    entries = []
    for row in rows:
        name = os.path.join(stem, f"frame_{row:06d}.vtu")
        write_vtu(run, row, name)
        entries.append(f'    <DataSet timestep="{run.times[row]:.17g}" file="{os.path.basename(stem)}/{os.path.basename(name)}"/>\n')
    text = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n  <Collection>\n' \
        + "".join(entries) + "  </Collection>\n</VTKFile>\n"
    write_atomically(path, lambda part: Path(part).write_text(text, encoding="utf-8"))
