#!/usr/bin/env python3
"""Files of a released version, which later ones are tested to read (earlier_files.py): make_files.py --program PROGRAM --source CHECKOUT -o tests/verify/earlier/VERSION.tar.xz

PROGRAM is built of CHECKOUT, both of that version. The archive has its option files and meshes, lattice files, and of each run of RUNS the trajectory, and the trajectory and the
checkpoint of a run that ended after some of its steps.
"""
import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tarfile
import tempfile

import h5py
import numpy as np

PROBLEM = "options/problems/{}.yaml"
# name: (options, steps or load steps of the run that ends early)
RUNS = {
    "pendulum": (["-options_file", PROBLEM.format("pendulum"), "-ts_max_time", "0.8"], 30),
    "net": (["-options_file", PROBLEM.format("springies_net"), "-ts_max_time", "1"], 20),
    "cycle": (["-options_file", PROBLEM.format("plastic_cycle"), "-ts_max_time", "1.2"], 45),
    "pulled": (["-options_file", PROBLEM.format("pulled_net"), "-bs_lattice_size", "6,4", "-ts_max_time", "1"], 40),
    "sheared": (["-options_file", PROBLEM.format("sheared_net"), "-bs_lattice_size", "6,6", "-bs_lattice_seed", "3"], 8),
    "torn": (["-options_file", PROBLEM.format("notched_plate"), "-bs_lattice_size", "14,10", "-bs_break_notch", "-1,4,4,4", "-bs_break_follow", "statics", "-bs_output_interval", "0.25"], 12),
    "ladder": (["-options_file", PROBLEM.format("rc_ladder"), "-bs_linear_size", "8"], 90),
    "beam": (["-bs_lattice_file", "beam.h5", "-bs_gravity", "0,-9.81", "-ts_dt", "0.005", "-ts_max_time", "0.2", "-bs_output_interval", "0.05"], 15),
    "sheet": (["-bs_lattice_file", "sheet.h5", "-bs_gravity", "0,0,-9.81", "-ts_dt", "0.002", "-ts_max_time", "0.1", "-bs_output_interval", "0.02", "-bs_output_strain"], 20),
}


def sheet(path, hinges):
    """A lattice file with everything but a box: two laws, dampers, angle springs, a hinge if the version has them, groups, drag, limits, velocities, fixed particles."""
    x = np.array([[i, j, 0.05 * (i * j % 2)] for i in range(4) for j in range(3)], float) * 0.1
    row = lambda i, j: 3 * i + j
    pairs = [(row(i, j), row(i + 1, j)) for i in range(3) for j in range(3)] + [(row(i, j), row(i, j + 1)) for i in range(4) for j in range(2)]
    pairs += [(row(i, j), row(i + 1, j + 1)) for i in range(3) for j in range(2)]
    count = len(pairs)
    with h5py.File(path, "w") as f:
        f["particles/position"], f["particles/mass"] = x, np.linspace(0.01, 0.02, len(x))
        f["particles/velocity"] = 0.1 * np.cos(np.arange(x.size)).reshape(x.shape)
        f["particles/fixed"], f["particles/drag"] = (x[:, 0] == 0).astype(np.uint8), np.full(len(x), 0.002)
        f["springs/pairs"] = np.array(pairs, np.int64)
        f["springs/stiffness"], f["springs/damping"] = np.linspace(200.0, 400.0, count), np.full(count, 0.01)
        f["springs/rest_length"] = np.linalg.norm(x[[b for _, b in pairs]] - x[[a for a, _ in pairs]], axis=1) * 0.99
        f["springs/law"], f["springs/critical_strain"] = np.arange(count) % 2, np.where(np.arange(count) == 4, 0.02, np.inf)
        f["angles/triples"] = np.array([[row(0, j), row(1, j), row(2, j)] for j in range(3)], np.int64)
        f["angles/stiffness"], f["angles/rest_angle"] = np.full(3, 0.05), np.full(3, np.pi)
        if hinges:
            f["hinges/quads"] = np.array([[row(0, 0), row(1, 1), row(1, 0), row(0, 1)]], np.int64)
            f["hinges/stiffness"], f["hinges/rest_angle"] = np.array([0.02]), np.array([0.1])
        f["groups/tip"] = np.flatnonzero(x[:, 0] > 0.29)
        f.attrs["spring_laws"], f.attrs["damping_law"] = ["hooke", "strain"], "axial"


def make(program, source, folder):
    for name in ("options/problems", "options/solvers", "meshes"):
        shutil.copytree(source / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "README.md", "bench_*", "make_lattice.py"))
    subprocess.run([sys.executable, source / "meshes/make_lattice.py", folder / "beam.h5"], check=True)
    sheet(folder / "sheet.h5", "/hinges" in (source / "meshes/README.md").read_text())
    environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    for name, (options, steps) in RUNS.items():
        for more in (["-bs_output", f"{name}.h5md"], ["-bs_output", f"{name}_part.h5md", "-bs_checkpoint", f"{name}.ck", "-ts_max_steps", str(steps)]):
            done = subprocess.run([program, *options, *more, "-bs_progress_interval", "-1"], cwd=folder, env=environment, capture_output=True, text=True)
            print(f"{name}: {(done.stdout + done.stderr).strip().splitlines()[-1]}")
            if done.returncode:
                sys.exit(done.stdout + done.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, type=pathlib.Path)
    parser.add_argument("--source", required=True, type=pathlib.Path)
    parser.add_argument("-o", "--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        make(arguments.program.resolve(), arguments.source.resolve(), folder)
        with tarfile.open(arguments.output, "w:xz", preset=9) as archive:
            for path in sorted(folder.rglob("*")):
                if path.is_file() and path.suffix not in (".xdmf", ".previous", ".lock"):
                    archive.add(path, path.relative_to(folder))
    print(f"{arguments.output}: {arguments.output.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
