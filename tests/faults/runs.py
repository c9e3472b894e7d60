"""Runs of the program in one folder, and what their files hold: shared by the tests of faults and restarts."""
import argparse
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import h5py
import harness
from harness import Checks, write_lattice  # noqa: F401
import numpy as np
from program import environment, words

BLOCK = {"bs_lattice_type": "cubic", "bs_lattice_size": (5, 5, 5), "bs_lattice_spacing": 0.2, "bs_lattice_fixed": "zmin",
         "bs_lattice_stiffness": 4000, "bs_spring_law": "strain", "bs_gravity": (0, 0, -9.81), "bs_lattice_perturbation": 0.02,
         "ts_dt": 0.01, "bs_output_interval": 0.025, "bs_progress_interval": -1, "bs_advise": False}

SLOWER = int(os.environ.get("BS_SLOWER", 1))  # how much longer a sanitised build takes


def start(checks, folder, options, ranks=1, extra=None, **keywords):
    command = ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [checks.program] + words(options)
    return subprocess.Popen(command, cwd=folder, env=dict(environment(ranks), **(extra or {})), stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True, **keywords)


def run(checks, folder, options, ranks=1, timeout=120, **keywords):
    """(exit code, stdout, stderr)"""
    process = start(checks, folder, options, ranks, **keywords)
    try:
        out, err = process.communicate(timeout=timeout * SLOWER)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        return "no end", out, err
    return process.returncode, out, err


def content(path):
    """Every dataset of numbers of a trajectory by name, without what describes the run itself."""
    found = {}

    def keep(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "if" and not name.startswith("parameters"):
            found[name] = item[...]
    with h5py.File(path, "r") as f:
        f.visititems(keep)
        found["time"] = f["particles/trajectory/position/time"][...] if "particles/trajectory/position" in f else f["states/time"][...]
    return found


def difference(a, b):
    """Largest difference of the frames of two trajectories and whether they are the same in every bit of every dataset."""
    a, b = content(a), content(b)
    if a.keys() != b.keys() or any(a[k].shape != b[k].shape for k in a):
        return np.inf, False
    same = all(np.array_equal(a[k], b[k]) for k in a)
    worst = max(float(np.max(np.abs(a[k].astype(float) - b[k]), initial=0)) for k in a if k.endswith("value") and ("trajectory" in k or "states" in k))
    return worst, same


def frames(path):
    """Number of completed frames; raises OSError where the file cannot be opened, ValueError where a frame is not whole."""
    with h5py.File(path, "r") as f:
        group = f["particles/trajectory"]
        time = group["position/time"][...]
        for name in ("position", "velocity"):
            value = group[name + "/value"]
            if len(value) < len(time) or not np.isfinite(value[:len(time)]).all() or not (np.ptp(value[:len(time)], axis=(1, 2)) > 0)[name == "velocity":].all():
                raise ValueError(f"{name} of {len(time)} frames is not whole")
        for name, item in f["observables"].items():
            if len(item["value"]) < len(time):
                raise ValueError(f"{name} of {len(time)} frames is not whole")
        return len(time)


def told(err):
    return [line for line in err.splitlines() if line.startswith("backspring: error:")]


def run_parts(title, parts, library=None, with_library=()):
    """A test's main: each part that the command line asks for, in a folder of its own. `library`: an option that names a shared library,
    which the parts `with_library` are given."""
    given = None
    if library:
        parser = argparse.ArgumentParser(add_help=False)
        parser.add_argument(library, dest="library", required=True)
        mine, rest = parser.parse_known_args()
        given, sys.argv[1:] = os.path.abspath(mine.library), rest
    harness.run_parts(title, parts, given=lambda part: [given] if part in with_library else [])
