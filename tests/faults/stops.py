#!/usr/bin/env python3
"""A run that signals stop at any moment, and that is continued each time, is the run that nothing stopped: in every bit of every frame, event and row
of the log, in what it reports and counts. Over tasks, features and ranks; moments are spread over the run's wall-clock time."""
import json
import random
import signal
import subprocess

import h5py
import numpy as np
from runs import SLOWER, content, run, run_parts, start

PULLED = {"bs_lattice_type": "triangular", "bs_lattice_dim": 2, "bs_lattice_spacing": 1, "bs_lattice_stiffness": 1, "bs_group_lower": "ymin", "bs_group_upper": "ymax",
          "bs_motion_lower": "fixed", "bs_break_weibull": "5,3", "bs_break_spare": "lower,upper", "bs_progress_interval": -1, "bs_advise": False}
STATICS = {**PULLED, "bs_task": "statics", "bs_break_strain": 0.04, "condensed_pc_type": "cholesky"}
DYNAMICS = {**PULLED, "bs_lattice_size": (16, 12), "bs_lattice_damping": 0.1, "bs_break_strain": 0.06, "ts_max_time": 40, "bs_output_interval": 2, "bs_motion_upper": "x=fixed,y=velocity:0.05"}
PLASTIC = {"bs_spring_law": "plastic", "bs_spring_yield_force": 0.02, "bs_spring_hardening": 0.2}
PERIODIC = {"bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.1, "bs_group_lower": None, "bs_group_upper": None, "bs_motion_lower": None, "bs_break_spare": None,
            "bs_motion_upper": None}

# name, options, ranks
CASES = [
    ("avalanches of statics", {**STATICS, "bs_lattice_size": (24, 24), "bs_load_steps": 12, "bs_break": "worst", "bs_motion_upper": "x=fixed,y=velocity:2", "bs_output_interval": 0.25}, 1),
    ("avalanches of statics, plastic springs", {**STATICS, **PLASTIC, "bs_lattice_size": (12, 12), "bs_load_steps": 12, "bs_motion_upper": "x=fixed,y=velocity:1.5", "bs_output_interval": 0.25}, 1),
    ("avalanches followed by dynamics", {**STATICS, "bs_lattice_size": (12, 10), "bs_lattice_damping": 0.3, "bs_load_steps": 6, "bs_break_follow": "dynamics", "bs_break_output_interval": 15,
                                         "bs_motion_upper": "x=fixed,y=velocity:0.8", "bs_output_interval": 1 / 3}, 1),
    ("avalanches of a strained box", {**STATICS, **PERIODIC, "bs_lattice_size": (12, 12), "bs_load_steps": 10, "bs_box_strain": "yy=velocity:0.15", "bs_output_interval": 0.1}, 1),
    ("stress of a box", {"bs_task": "statics", "bs_lattice_type": "triangular", "bs_lattice_size": (20, 20), "bs_lattice_dim": 2, "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.15,
                         "bs_load_steps": 20, "bs_box_stress": "xx=velocity:0.1,xy=velocity:0.02", "bs_output_interval": 0.05, "bs_progress_interval": -1, "condensed_pc_type": "cholesky"}, 1),
    ("breaking in motion, beuler", {**DYNAMICS, "ts_type": "beuler", "ts_dt": 0.1, "condensed_pc_type": "cholesky"}, 1),
    ("breaking in motion, plastic springs, alpha2", {**DYNAMICS, **PLASTIC, "ts_type": "alpha2", "ts_dt": 0.1, "condensed_pc_type": "cholesky"}, 1),
    ("breaking in motion, verlet", {**DYNAMICS, "ts_type": "verlet", "ts_dt": 0.02}, 1),
    ("breaking in a box that is strained, bdf", {**DYNAMICS, **PERIODIC, "bs_box_strain": "xx=velocity:0.005", "ts_type": "bdf", "ts_adapt_type": "none", "ts_dt": 0.1, "condensed_pc_type": "cholesky"}, 1),
    ("until it rests", {"bs_lattice_type": "triangular", "bs_lattice_size": (14, 14), "bs_lattice_dim": 2, "bs_lattice_spacing": 0.1, "bs_lattice_stiffness": 500, "bs_lattice_damping": 2,
                        "bs_lattice_fixed": "ymax", "bs_gravity": "0,-9.81", "bs_stop_at_rest": 1e-3, "ts_type": "beuler", "ts_dt": 0.02, "ts_max_time": 100, "bs_output_interval": 0.2,
                        "bs_progress_interval": -1, "bs_advise": False, "condensed_pc_type": "cholesky"}, 1),
    ("avalanches of statics, 3 ranks", {**STATICS, "bs_lattice_size": (16, 12), "bs_load_steps": 8, "condensed_pc_type": "bicc", "bs_break": "worst", "bs_motion_upper": "x=fixed,y=velocity:1",
                                        "bs_output_interval": 0.25}, 3),
    ("breaking in motion, 3 ranks", {**DYNAMICS, **PLASTIC, "ts_type": "verlet", "ts_dt": 0.02}, 3),
]
# of a report: what tells of the machine, and of this process alone
OF_THE_RUN = ("wall", "reason", "outcome")


def reported(path):
    return {key: value for key, value in json.loads(path.read_text()).items() if key not in OF_THE_RUN and not key.startswith("first_")}


def differ(a, b):
    """Names of what is not the same in every bit."""
    x, y = content(a), content(b)
    return [name for name in sorted(x.keys() | y.keys()) if name not in x or name not in y or not np.array_equal(x[name], y[name], equal_nan=True)]


def disturb(process, after, sent):
    """Sends the signal `after` seconds after the program has named its solver, unless the run is over before. Returns its exit code and what it said."""
    for line in process.stdout:
        if line.startswith("solver:"):
            break
    try:
        out, err = process.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        process.send_signal(sent)
        out, err = process.communicate(timeout=300 * SLOWER)
    return process.returncode, out, err


def legs(checks, folder, name, options, ranks, wall, moments):
    """Starts the run and stops it at each of the moments, fractions of the undisturbed run's time; returns the steps at which it was."""
    wait = {"OMPI_MCA_odls_base_sigkill_timeout": "60"}
    more = {"bs_restart": "part.ck", "bs_report": "part.json", "bs_overwrite": True}
    at = []
    for old in folder.glob("part*"):
        old.unlink()
    for moment, sent in moments:
        given = more if at else {**options, "bs_output": "part.h5md", "bs_checkpoint": "part.ck", "bs_report": "part.json", "bs_overwrite": True}
        code, _, err = disturb(start(checks, folder, given, ranks, extra=wait), moment * wall, sent)
        # -signal: it came when the run was at its end already
        checks.true(f"{name}: ended as it should by {sent.name}", code in (0, -sent, 1 if ranks > 1 else 128 + sent), f"exit {code} {err.strip()[:120]}")
        with h5py.File(folder / "part.ck") as f:
            at.append(int(f["run"].attrs["step"]))
        if json.loads((folder / "part.json").read_text())["outcome"] == "ok":
            return at
    code, _, err = run(checks, folder, more, ranks)
    checks.true(f"{name}: continued to the end", code == 0, f"exit {code} {err.strip()[:160]}")
    return at


def same(checks, folder, name):
    off = differ(folder / "full.h5md", folder / "part.h5md")
    checks.true(f"{name}: every bit", not off, f"differ: {off[:6]}" if off else "")
    a, b = reported(folder / "full.json"), reported(folder / "part.json")
    off = [key for key in a.keys() | b.keys() if a.get(key) != b.get(key)]
    checks.true(f"{name}: the report", not off, f"differ: {[(key, a.get(key), b.get(key)) for key in sorted(off)[:6]]}" if off else "")


def one(checks, folder, name, options, ranks, seed):
    """Stopped by SIGTERM and by SIGINT (which mpirun does not pass on), asked for a checkpoint by SIGUSR1; then continued from that one, too."""
    chance = random.Random(seed)
    code, _, err = run(checks, folder, {**options, "bs_output": "full.h5md", "bs_report": "full.json", "bs_checkpoint": "full.ck", "bs_overwrite": True}, ranks)
    wall = json.loads((folder / "full.json").read_text())["wall"]
    checks.true(f"{name}: undisturbed", code == 0, err.strip()[:160] or f"{wall:.2g} s")
    moments = [(chance.uniform(0.02, 0.4), sent) for sent in (signal.SIGTERM, signal.SIGINT if ranks == 1 else signal.SIGTERM, signal.SIGUSR1)]
    at = legs(checks, folder, name, options, ranks, wall, moments)
    same(checks, folder, f"{name}: with stops at {at}")
    if len(at) < len(moments) or not (folder / "part.ck.previous").exists():
        return
    with h5py.File(folder / "part.ck.previous") as f:
        step = f["run"].attrs["step"]
    code, _, err = run(checks, folder, {"bs_restart": "part.ck.previous", "bs_report": "part.json", "bs_overwrite": True}, ranks)
    checks.true(f"{name}: continued from the checkpoint that was asked for", code == 0, f"exit {code} {err.strip()[:160]}")
    same(checks, folder, f"{name}: from step {step}")


def walk(checks, folder):
    for k, (name, options, ranks) in enumerate(CASES):
        one(checks, folder, name, options, ranks, seed=k)


if __name__ == "__main__":
    run_parts(__doc__, (walk,))
