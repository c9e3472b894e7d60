#!/usr/bin/env python3
"""What a run went through and its last line must say, whatever the task: each warning is printed once, counted in the last line, named in the report and kept by
checkpoints; a run without any has none of these."""
import json
import subprocess

from harness import run_parts, write_lattice
import numpy as np
from program import environment, words


def told(run, *keys):
    """Whether the report, the last line and stderr agree on these warnings."""
    last = run.stdout.strip().splitlines()[-1]
    printed = run.stderr.count("backspring: warning: ")
    return run.report["warnings"] == list(keys) and printed == len(keys) and (last.endswith(f" warnings={len(keys)}") if keys else "warnings=" not in last)


# Krylov iterations without a preconditioner do not solve these steps
STIFF = {"bs_lattice_type": "chain", "bs_lattice_size": 20, "bs_lattice_dim": 2, "bs_lattice_spacing": 0.1, "bs_lattice_stiffness": 1e6, "bs_lattice_particle_mass": 0.1,
         "bs_lattice_fixed": "xmin", "bs_gravity": "0,-9.81", "ts_dt": 0.01, "ts_max_time": 0.05}


def cut(checks, folder):
    run = checks.run({**STIFF, "snes_mf": True})
    checks.true("steps cut a hundredfold", told(run, "steps_cut") and run.report["steps"] > 500 and f"{run.report['steps']} were taken where 5 were asked for" in run.stderr,
                run.stdout.splitlines()[-1])
    run = checks.run(STIFF)
    checks.true("the same by the default solver", told(run) and run.report["steps"] == 5, run.stdout.splitlines()[-1])
    saved = folder / "c"
    checks.run({**STIFF, "snes_mf": True, "bs_checkpoint": saved, "ts_max_steps": 600})
    run = checks.run({"bs_restart": saved, "ts_max_steps": 5000})
    checks.true("a continued run keeps what it was before", run.report["warnings"] == ["steps_cut"], str(run.report["warnings"]))


def early(checks, folder):
    """-ts_max_steps ends a run before its end, whatever the task."""
    lattice = {"bs_lattice_type": "chain", "bs_lattice_size": 4, "bs_lattice_fixed": "xmin", "bs_gravity": -0.1}
    (folder / "G").write_text("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 1\n")
    linear = {"bs_model": "linear", "bs_linear_G": folder / "G", "bs_linear_C": folder / "G", "ts_dt": 0.1}
    for name, options in (("dynamics", {**lattice, "ts_dt": 0.01}), ("by an explicit type", {**lattice, "ts_dt": 0.001, "ts_type": "symplectic"}),
                          ("statics", {**lattice, "bs_task": "statics", "bs_load_steps": 10}), ("linear", linear)):
        whole = {} if "bs_task" in options else {"ts_max_time": 10 * options["ts_dt"]}
        run = checks.run({**options, **whole, "ts_max_steps": 5})
        checks.true(f"{name}, ended halfway", told(run, "ended_early") and run.report["outcome"] == "ok", run.stdout.splitlines()[-1])
        run = checks.run({**options, **whole})
        checks.true(f"{name}, to its end", told(run) and run.report["steps"] == 10, run.stdout.splitlines()[-1])


def modes(checks, folder):
    """A chain under pressure that is free to buckle; as many modes as there are, and more."""
    at = np.arange(4)
    path = write_lattice(folder / "pressed.h5", np.stack([0.9 * at, 0 * at], 1), 1.0, fixed=(at == 0) | (at == 3), pairs=np.stack([at[:-1], at[1:]], 1), stiffness=1.0, rest_length=1.0)
    for count, keys in ((2, ("unstable",)), (9, ("fewer_modes", "unstable"))):
        run = checks.run({"bs_task": "modes", "bs_lattice_file": path, "bs_modes": count})
        checks.true(f"{count} modes", told(run, *keys), run.stdout.splitlines()[-1])


if __name__ == "__main__":
    run_parts("warnings of a run", (cut, early, modes))
