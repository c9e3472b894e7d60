#!/usr/bin/env python3
"""Converts meshes to lattices that backspring reads, and trajectories to files other programs read.

  postprocess/convert.py bunny.ply -o bunny.h5 --stiffness 100 --total_mass 0.5 --fixed zmin
  postprocess/convert.py network.data -o network.h5                 LAMMPS: springs and masses are in the file
  postprocess/convert.py run.h5md -o run.xyz                        extended XYZ, all frames (OVITO, ASE)
  postprocess/convert.py run.h5md -o run.pvd --stride 10            series of VTU files (ParaView)
  postprocess/convert.py run.h5md -o run.lammpstrj                  LAMMPS dump, or .gsd: all frames (OVITO, VMD)
  postprocess/convert.py run.h5md -o last.data                      LAMMPS data, VTU or VTP: one frame
  postprocess/convert.py last.vtu -o again.h5                       such a file as a lattice: springs and masses are in it

What is done follows from the input's content and the output's ending.
"""
import argparse
import os
import sys

if __name__ == "__main__":
    import launch
    launch.require("numpy", "h5py")

import h5py  # noqa: E402
import numpy as np  # noqa: E402

from backspring_io import RunError, open_run  # noqa: E402
from exports import write_atomically, write_data, write_dump, write_gsd, write_pvd, write_vtp, write_vtu, write_xyz  # noqa: E402

MESHES = (".vtk", ".vtu", ".obj", ".ply", ".stl", ".msh", ".off", ".xdmf")
LAMMPS = (".data", ".lmp", ".lammps")
LATTICES = (".h5", ".hdf5")
SERIES = {".xyz": write_xyz, ".dump": write_dump, ".lammpstrj": write_dump, ".gsd": write_gsd, ".pvd": write_pvd}
SINGLE = {".vtu": write_vtu, ".vtp": write_vtp, **dict.fromkeys(LAMMPS, write_data)}
FACES = {f"{axis}{end}": (k, end) for k, axis in enumerate("xyz") for end in ("min", "max")}


def need_meshio():
    try:
        import meshio  # noqa: F401
    except ImportError:
        raise RunError("no meshio in this Python; install with: sudo apt-get install python3-meshio") from None


# ---- meshes to lattices -------------------------------------------------------------------------------------------
def reduce_dimension(position, dim, path):
    """Positions (N, d): d as asked, else 2 where all z are equal, else 3. Components dropped must not vary."""
    size = np.ptp(position, axis=0)
    flat = size <= 1e-12 * max(size.max(), 1e-300)
    if dim is None:
        dim = 2 if flat[2] else 3
    varying = [a for k, a in enumerate("xyz") if k >= dim and not flat[k]]
    if varying:
        raise RunError(f"{path}: --dim {dim} would drop {varying[0]}, which varies; project the mesh first")
    return position[:, :dim]


def tidy(position, pairs, merge, keep_unused):
    """Merges points closer than `merge`, drops springs that became points or doubles, and points without springs.
    Returns positions, pairs and the rows kept."""
    kept = np.arange(len(position))
    if merge > 0:
        _, first, inverse = np.unique(np.round(position / merge).astype(np.int64), axis=0, return_index=True, return_inverse=True)
        order = np.argsort(first)
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        kept, pairs = first[order], np.sort(rank[inverse][pairs], axis=1)
        pairs = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    if not keep_unused:
        used = np.zeros(len(kept), dtype=bool)
        used[pairs.ravel()] = True
        kept, pairs = kept[used], (np.cumsum(used) - 1)[pairs]
    return position[kept], pairs, kept


def fixed_mask(position, faces):
    """Particles on the named faces of the bounding box, within 1e-6 of its size."""
    mask = np.zeros(len(position), dtype=bool)
    size = float(np.ptp(position, axis=0).max())
    for name in faces:
        axis, end = FACES.get(name, (9, ""))
        if axis >= position.shape[1]:
            raise RunError(f"--fixed {name}: write {', '.join(f for f in FACES if FACES[f][0] < position.shape[1])}")
        column = position[:, axis]
        mask |= np.abs(column - (column.min() if end == "min" else column.max())) <= 1e-6 * size
    return mask


def check_springs(path, position, pairs, rest_length):
    """A spring to itself or of no length has no direction."""
    itself = np.flatnonzero(pairs[:, 0] == pairs[:, 1])
    if len(itself):
        raise RunError(f"{path}: spring {itself[0]} joins point {pairs[itself[0], 0]} to itself")
    length = np.sqrt(((position[pairs[:, 1]] - position[pairs[:, 0]]) ** 2).sum(axis=1))
    none = np.flatnonzero((length == 0) & (True if rest_length is None else rest_length > 0))
    if len(none):
        raise RunError(f"{path}: points {pairs[none[0], 0]} and {pairs[none[0], 1]} lie at one place; use --merge 1e-6")


def write_lattice(path, position, pairs, stiffness, mass, velocity=None, fixed=None, rest_length=None, damping=None,
                  spring_law="hooke", damping_law="axial"):
    """The lattice as backspring reads it (meshes/README.md)."""
    with h5py.File(path, "w") as f:
        f["particles/position"], f["particles/mass"] = position, mass
        f["springs/pairs"], f["springs/stiffness"] = pairs.astype(np.int64), stiffness
        for name, data in (("particles/velocity", velocity), ("springs/rest_length", rest_length), ("springs/damping", damping),
                           ("particles/fixed", fixed.astype(np.uint8) if fixed is not None and fixed.any() else None)):
            if data is not None:
                f[name] = data
        f.attrs["spring_law"], f.attrs["damping_law"] = spring_law, damping_law


def to_lattice(args, ending):
    velocity = mass = stiffness = rest_length = held = damping = None
    if ending in LAMMPS:
        from lammps_data import read_lammps
        data = read_lammps(args.input, args.atom_style)
        for note in data.notes:
            print(f"convert.py: {args.input}: {note}", file=sys.stderr)
        position, pairs = data.position, data.pairs
        velocity, mass, stiffness, rest_length = data.velocity, data.mass, data.stiffness, data.rest_length
        if args.merge:
            raise RunError("--merge is for meshes; atoms keep their identity")
    else:
        need_meshio()
        from mesh_edges import read_mesh
        points, edges, said = read_mesh(args.input)
        if said and args.merge:
            raise RunError(f"{args.input}: is a lattice already; --merge is for meshes")
        velocity, mass, stiffness, rest_length, held, damping = (
            said.get(k) for k in ("velocity", "mass", "stiffness", "rest_length", "fixed", "damping"))
        position, pairs, kept = (points, edges, points) if said else tidy(points, edges, args.merge, args.keep_unused)
        if len(kept) < len(points):
            print(f"convert.py: {args.input}: {len(points) - len(kept)} points merged or without springs left out", file=sys.stderr)
    position = reduce_dimension(position, args.dim, args.input)
    if velocity is not None:
        velocity = reduce_dimension(velocity, position.shape[1], args.input + " (velocities)")
    if args.stiffness is not None:
        stiffness = np.full(len(pairs), args.stiffness)
    elif stiffness is not None and args.spring_law == "strain" and ending in LAMMPS:
        stiffness = stiffness * np.where(rest_length > 0, rest_length, 1.0)  # K/L [N/m] in the file, K [N] in the lattice
    if args.mass is not None or args.total_mass is not None:
        mass = np.full(len(position), args.mass if args.mass is not None else args.total_mass / len(position))
    if stiffness is None and len(pairs):
        raise RunError(f"{args.input}: says nothing of stiffness; add --stiffness "
                       + ("K [N]" if args.spring_law == "strain" else "k [N/m]"))
    if mass is None:
        raise RunError(f"{args.input}: says nothing of mass; add --mass m [kg] of a particle or --total_mass M [kg]")
    check_springs(args.input, position, pairs, rest_length)
    fixed = fixed_mask(position, args.fixed) | (np.zeros(len(position), bool) if held is None else held != 0)
    damping = np.full(len(pairs), args.damping) if args.damping is not None else damping
    stiffness = np.zeros(0) if stiffness is None else stiffness
    write_atomically(args.output, lambda part: write_lattice(part, position, pairs, stiffness, mass, velocity, fixed,
                                                             rest_length, damping, args.spring_law, args.damping_law))
    return f"{len(position)} particles ({int(fixed.sum())} fixed), {len(pairs)} springs, d = {position.shape[1]}"


def from_trajectory(args, ending):
    with open_run(args.input) as run:
        if run.kind != "particles":
            raise RunError(f"{args.input}: a linear system has no particles to convert")
        if ending in SERIES:
            rows = run.pick(args.frames, args.stride)
            if ending == ".pvd":
                if args.pieces == "vtu":
                    need_meshio()
                write_pvd(run, rows, args.output, "." + args.pieces)
            else:
                write_atomically(args.output, lambda part: SERIES[ending](run, rows, part))
            return f"{len(rows)} frames of {run.particles} particles"
        row = run.index(args.frame)
        if ending == ".vtu":
            need_meshio()
        write_atomically(args.output, lambda part: SINGLE[ending](run, row, part))
        return f"frame {row} of {run.particles} particles, {len(run.springs)} springs"


def parse(argv=None):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("input", help="mesh " + " ".join(MESHES) + ", LAMMPS data " + " ".join(LAMMPS) + ", or trajectory")
    p.add_argument("-o", "--output", required=True, help="lattice .h5; of a trajectory: " + " ".join([*SERIES, *SINGLE]))
    mesh = p.add_argument_group("meshes to lattices: springs are the unique edges of the elements, at rest as they lie")
    mesh.add_argument("--stiffness", type=float, help="of every spring: k [N/m] under hooke, K [N] under strain")
    mesh.add_argument("--damping", type=float, help="of every spring [kg/s] (default: none)")
    mesh.add_argument("--mass", type=float, help="of every particle [kg]")
    mesh.add_argument("--total_mass", type=float, help="of all particles, in equal shares [kg]")
    mesh.add_argument("--spring_law", choices=("hooke", "strain"), default="hooke")
    mesh.add_argument("--damping_law", choices=("axial", "simple"), default="axial")
    mesh.add_argument("--fixed", type=lambda s: s.split(","), default=[], metavar="FACE,...",
                      help="faces of the bounding box held still: " + " ".join(FACES))
    mesh.add_argument("--dim", type=int, choices=(1, 2, 3), help="dimension (default 2 for flat meshes z = const, else 3)")
    mesh.add_argument("--merge", type=float, default=0.0, metavar="EPS", help="one point for points closer than EPS")
    mesh.add_argument("--keep_unused", action="store_true", help="keep points that belong to no element")
    mesh.add_argument("--atom_style", help="LAMMPS atom style where the file does not name it")
    run = p.add_argument_group("trajectories")
    run.add_argument("--frames", metavar="A:B", help="of a series, B excluded (default all)")
    run.add_argument("--stride", type=int, default=1, help="every STRIDE-th frame of a series")
    run.add_argument("--pieces", choices=("vtu", "vtp"), default="vtu", type=str, help="files of a .pvd series (default vtu)")
    run.add_argument("--frame", type=int, default=-1, help="of a single file (default -1, the last)")
    return p.parse_args(argv)


def main(argv=None):
    args = parse(argv)
    if not os.path.isfile(args.input):
        raise RunError(f"{args.input}: no such file")
    if not os.path.isdir(os.path.dirname(args.output) or "."):
        raise RunError(f"{args.output}: no such folder")
    if os.path.exists(args.output) and os.path.samefile(args.input, args.output):
        raise RunError(f"{args.output}: is the input, too")
    for name in ("stiffness", "damping", "mass", "total_mass", "merge"):
        value = getattr(args, name)
        if value is not None and not (np.isfinite(value) and (value > 0 if "mass" in name else value >= 0)):
            raise RunError(f"--{name} {value}: must be " + ("positive" if "mass" in name else "0 or more"))
    source, target = (os.path.splitext(name)[1].lower() for name in (args.input, args.output))
    if source in MESHES + LAMMPS:
        if target not in LATTICES:
            raise RunError(f"{args.output}: a mesh becomes a lattice; end the output in {' or '.join(LATTICES)}")
        said = to_lattice(args, source)
    elif not h5py.is_hdf5(args.input):
        raise RunError(f"{args.input}: neither a trajectory (HDF5) nor a mesh ending in {' '.join(MESHES + LAMMPS)}")
    elif target not in SERIES and target not in SINGLE:
        raise RunError(f"{args.output}: unknown ending '{target}'; a trajectory becomes " + " ".join([*SERIES, *SINGLE]))
    else:
        said = from_trajectory(args, target)
    print(f"{args.output}: {said}")


if __name__ == "__main__":
    launch.run(main, RunError)
