#!/usr/bin/env python3
"""Converts meshes to lattices that backspring reads, and trajectories to files other programs read.

  postprocess/convert.py bunny.ply -o bunny.h5 --stiffness 100 --total_mass 0.5 --fixed zmin
  postprocess/convert.py truss.msh -o truss.h5 --youngs 210e9 --area 1e-3 --density 7850 --fixed supports --dim 3
  postprocess/convert.py data.network -o network.h5 --units lj      LAMMPS: springs and masses are in the file
  postprocess/convert.py 1ubi.pdb -o 1ubi.h5 --cutoff 15            C-alpha atoms, springs between all closer than that
  postprocess/convert.py run.h5md -o run.xyz                        extended XYZ, all frames (OVITO, ASE)
  postprocess/convert.py run.h5md -o run.pvd --stride 10            series of VTU files (ParaView)
  postprocess/convert.py run.h5md -o run.lammpstrj                  LAMMPS dump, or .gsd: all frames (OVITO, VMD)
  postprocess/convert.py run.h5md -o run_nm.h5md                    H5MD in nanometres: MDAnalysis with its defaults, VOTCA
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
from bars import OPTIONS, Values  # noqa: E402
from run_data import counted  # noqa: E402
from finite import check_run  # noqa: E402
from exports import write_atomically, write_gsd, write_nanometres, write_xyz  # noqa: E402
from lammps_data import is_lammps  # noqa: E402
from lammps_units import UNITS  # noqa: E402
from lammps_write import write_data, write_dump  # noqa: E402
from lattices import to_lattice  # noqa: E402
from listed import Listed  # noqa: E402
from selection import HELP  # noqa: E402
from vtk_files import DAMPING_LAWS, LAWS, write_pvd, write_vtp, write_vtu  # noqa: E402
import features  # noqa: E402

MESHES = (".vtk", ".vtu", ".vtp", ".obj", ".ply", ".stl", ".msh", ".off", ".xdmf")
LAMMPS = (".data", ".lmp", ".lammps")
LATTICES = (".h5", ".hdf5")
PROTEINS = (".pdb", ".ent")
SERIES = {".xyz": write_xyz, ".dump": write_dump, ".lammpstrj": write_dump, ".gsd": write_gsd, ".pvd": write_pvd, ".h5md": write_nanometres}
SINGLE = {".vtu": write_vtu, ".vtp": write_vtp, **dict.fromkeys(LAMMPS, write_data)}


READ_FORM = {".vtp": "vtu", ".ent": "pdb", **dict.fromkeys(LAMMPS, "data")}  # columns of features.READ
FORM = {".lammpstrj": "dump", ".pvd": "vtu", ".vtp": "vtu", **dict.fromkeys(LAMMPS, "data")}  # columns of features.TABLE


def units_of(run):
    """The units that a trajectory says it is in (-bs_output_units); SI where it is silent."""
    said = run.unit("position"), run.unit("time")
    return {("Angstrom", "fs"): "real", ("Angstrom", "ps"): "metal", ("nm", "ns"): "nano"}.get(said, "si")


def from_trajectory(args, ending):
    with open_run(args.input) as run:
        if run.kind != "particles":
            raise RunError(f"{args.input}: a linear system has no particles to convert")

        def options(write):
            if write in (write_data, write_nanometres):
                return {"units": args.units or units_of(run), **({"box_lengths": args.box_lengths} if write is write_nanometres else {})}
            return {"every": args.all_springs} if write in (write_vtu, write_vtp) else {}

        form, series = FORM.get(ending, ending[1:]), ending in SERIES
        if args.all_springs and form != "vtu":
            raise RunError(f"{args.output}: --all_springs is for .vtu, .vtp and .pvd, which flag what is broken")
        if args.box_lengths and form != "h5md":
            raise RunError(f"{args.output}: --box_lengths is for .h5md")
        rows = run.pick(args.frames, args.stride) if series else [run.index(args.frame)]
        check_run(run, rows)
        left_out = features.check(run, rows, form, args.output, not args.all_springs)
        if ending == ".pvd":
            write_pvd(run, rows, args.output, "." + args.pieces, args.all_springs)
        else:
            write = SERIES[ending] if series else SINGLE[ending]
            write_atomically(args.output, lambda part: write(run, rows if series else rows[0], part, **options(write)))
        if left_out:
            print(f"convert.py: {left_out}", file=sys.stderr)
        if series:
            return f"{counted(len(rows), 'frame')} of {counted(run.particles, 'particle')}"
        count = len(run.springs) if args.all_springs else np.count_nonzero(run.acting(rows[0]))
        return f"frame {rows[0]} of {counted(run.particles, 'particle')}, {counted(count, 'spring')}"


def parse(argv=None):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("input", help="mesh " + " ".join(MESHES) + ", LAMMPS data of any name, PDB file, or trajectory")
    p.add_argument("-o", "--output", required=True, help="lattice .h5; of a trajectory: " + " ".join([*SERIES, *SINGLE]))
    mesh = p.add_argument_group("meshes to lattices: springs are the unique edges of the elements, at rest as they lie")
    mesh.add_argument("--stiffness", type=float, help="of every spring: k [N/m] under hooke, K [N] under strain")
    mesh.add_argument("--damping", type=float, help="of every spring [kg/s] (default: none)")
    mesh.add_argument("--mass", type=float, help="of every particle [kg]")
    mesh.add_argument("--total_mass", type=float, help="of all particles, in equal shares [kg]")
    mesh.add_argument("--spring_law", choices=LAWS, help="of all springs (default: what the file says, else hooke); what polynomial, plastic and maxwell take besides is given by the program's options -bs_spring_...")
    mesh.add_argument("--damping_law", choices=DAMPING_LAWS, help="of all dampers (default: what the file says, else axial)")
    mesh.add_argument("--youngs", action="append", metavar="E[,GROUP=E...]", help="Young's modulus of bars [Pa], with --area: every spring has k = E A/L, under strain K = E A; of the "
                      "springs of physical groups by name, as in 210e9,cables=160e9")
    mesh.add_argument("--area", action="append", metavar="A[,GROUP=A...]", help="cross section of bars [m^2], for --youngs and --density; likewise by group")
    mesh.add_argument("--density", action="append", metavar="RHO[,GROUP=RHO...]", help="of bars [kg/m^3], with --area: every spring gives each of its ends half of rho A L; likewise by group")
    mesh.add_argument("--fixed", action=Listed, default="", metavar="WHAT,...", help="particles held still, with commas or the option repeated: " + HELP)
    mesh.add_argument("--dim", type=int, choices=(1, 2, 3), help="dimension (default 2 for flat meshes z = const, else 3; 3 keeps a flat mesh in space)")
    mesh.add_argument("--merge", type=float, default=0.0, metavar="EPS", help="one point for points not farther apart than EPS, directly or by way of others")
    mesh.add_argument("--keep_unused", action="store_true", help="keep points that belong to no element")
    mesh.add_argument("--rest_length", type=float, help="of every spring [m] (default: what the file says, else as they lie)")
    lammps = p.add_argument_group("LAMMPS data: springs are the harmonic bonds; mass, length and time stay in the file's units")
    lammps.add_argument("--units", choices=sorted(UNITS), help="units of the file, where it does not name them; energies are converted to mass "
                        "length^2/time^2. Of a trajectory: what it is in (default: what it says, else si)")
    lammps.add_argument("--si", action="store_true", help="convert everything to kg, m and s")
    lammps.add_argument("--boundary", default="p,p,p", metavar="X,Y,Z", help="p: the box is periodic, bonds join nearest images; f: it is not "
                        "(default p,p,p, as in LAMMPS)")
    lammps.add_argument("--atom_style", help="atom style where the file does not name it")
    protein = p.add_argument_group("PDB files: an elastic network of C-alpha atoms, in angstrom; mass and stiffness 1 unless they are given")
    protein.add_argument("--cutoff", type=float, help="springs join atoms not farther apart than this [angstrom] (default 15)")
    protein.add_argument("--chain", action=Listed, metavar="A,B", help="chains to take (default all)")
    protein.add_argument("--model", type=int, help="model to take, from 1 (default 1)")
    protein.add_argument("--altloc", metavar="A", help="of alternative places the one with this letter (default: the first of each residue)")
    run = p.add_argument_group("trajectories")
    run.add_argument("--frames", metavar="A:B", help="of a series, B excluded (default all)")
    run.add_argument("--stride", type=int, default=1, help="every STRIDE-th frame of a series")
    run.add_argument("--pieces", choices=("vtu", "vtp"), default="vtu", type=str, help="files of a .pvd series (default vtu)")
    run.add_argument("--all_springs", action="store_true", help="of VTU, VTP, PVD: broken springs, angle springs and hinges, and springs that carry nothing, too, with the flag broken")
    run.add_argument("--box_lengths", action="store_true", help="of H5MD: a periodic box along the axes as three lengths, as VOTCA has it (default: three vectors)")
    run.add_argument("--frame", type=int, default=-1, help="of a single file (default -1, the last)")
    return p.parse_args(argv)


def check_numbers(args):
    for name in ("stiffness", "damping", "mass", "total_mass", "merge", "rest_length", "cutoff"):
        value, positive = getattr(args, name), name not in ("stiffness", "damping", "merge", "rest_length")
        if value is not None and not (np.isfinite(value) and (value > 0 if positive else value >= 0)):
            raise RunError(f"--{name} {value}: must be " + ("positive" if positive else "0 or more"))
    for name in OPTIONS:
        if getattr(args, name) is not None:
            setattr(args, name, Values(f"--{name}", getattr(args, name)))
    for name, other in (("youngs", "stiffness"), ("density", "mass"), ("density", "total_mass"), ("mass", "total_mass")):
        if getattr(args, name) is not None and getattr(args, other) is not None:
            raise RunError(f"--{name} and --{other} say the same; give one of them")
    for name in ("youngs", "density"):
        if getattr(args, name) is not None and args.area is None:
            raise RunError(f"--{name} needs the cross section of the bars: add --area A [m^2]")
    if args.area is not None and args.youngs is None and args.density is None:
        raise RunError("--area is for --youngs and --density: add one of them")


def main(argv=None):
    args = parse(argv)
    if not os.path.isfile(args.input):
        raise RunError(f"{args.input}: no such file")
    if not os.path.isdir(os.path.dirname(args.output) or "."):
        raise RunError(f"{args.output}: no such folder")
    if os.path.exists(args.output) and os.path.samefile(args.input, args.output):
        raise RunError(f"{args.output}: is the input, too")
    check_numbers(args)
    source, target = (os.path.splitext(name)[1].lower() for name in (args.input, args.output))
    source, target = (".data" if os.path.basename(name).startswith("data.") and ending not in MESHES + tuple(SERIES) + LATTICES else ending
                      for name, ending in ((args.input, source), (args.output, target)))
    lammps = source in LAMMPS or not h5py.is_hdf5(args.input) and source not in MESHES + PROTEINS and is_lammps(args.input)
    protein = source in PROTEINS
    if not protein and any(getattr(args, name) is not None for name in ("cutoff", "chain", "model", "altloc")):
        raise RunError(f"{args.input}: --cutoff, --chain, --model and --altloc are for PDB files ({' '.join(PROTEINS)})")
    if source == ".xdmf" and os.path.isfile(args.input[:-5]) and h5py.is_hdf5(args.input[:-5]):
        raise RunError(f"{args.input}: is the sidecar of a trajectory: convert {args.input[:-5]} itself")
    if lammps or protein or source in MESHES:
        if target not in LATTICES:
            raise RunError(f"{args.output}: a mesh becomes a lattice; end the output in {' or '.join(LATTICES)}")
        said = to_lattice(args, "lammps" if lammps else "protein" if protein else "mesh")
    elif source == ".xsp":
        raise RunError(f"{args.input}: backspring reads it itself: -bs_lattice_file {args.input}")
    elif not h5py.is_hdf5(args.input):
        raise RunError(f"{args.input}: neither a trajectory (HDF5), nor LAMMPS data, nor a mesh ending in {' '.join(MESHES)}")
    elif target not in SERIES and target not in SINGLE:
        raise RunError(f"{args.output}: unknown ending '{target}'; a trajectory becomes " + " ".join([*SERIES, *SINGLE]))
    else:
        said = from_trajectory(args, target)
    print(f"{args.output}: {said}")


if __name__ == "__main__":
    launch.run(main, RunError)
