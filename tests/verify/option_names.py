#!/usr/bin/env python3
"""PETSc's options whose names changed between its versions are understood under both: from the command line, from option files, from PETSC_OPTIONS and in any
mixture of these, of which the command line's counts. What a run does and records does not tell which name was given."""
import re
import subprocess

import h5py
import numpy as np
from harness import run_parts
from program import environment

NET = ["-bs_lattice_type", "square", "-bs_lattice_size", "4,4", "-bs_lattice_perturbation", "0.1", "-ts_max_time", "0.08", "-bs_progress_interval", "-1", "-bs_advise", "false"]


class Runs:
    def __init__(self, checks, folder):
        self.program, self.folder, self.count = checks.program, folder, 0

    def __call__(self, *words, files=None, petsc_options=None):
        """Exit code, what was said, positions of all frames, their times and the recorded options."""
        self.count += 1
        for name, text in (files or {}).items():
            (self.folder / name).write_text(text)
        env = environment(1)
        if petsc_options:
            env["PETSC_OPTIONS"] = petsc_options
        output = self.folder / f"{self.count}.h5md"
        done = subprocess.run([self.program, *NET, *words, "-bs_output", output.name], cwd=self.folder, env=env, capture_output=True, text=True, timeout=300)
        if done.returncode:
            return done.returncode, done.stdout + done.stderr, None, None
        with h5py.File(output) as f:
            group = f["particles/trajectory/position"]
            return 0, done.stdout + done.stderr, group["value"][...], group["time"][...].ravel()


def steps(checks, folder):
    """Each way of giving a step of 0.02 s, beside others that it overrides."""
    run = Runs(checks, folder)
    want = run("-ts_dt", "0.02")
    ways = {"its other name": dict(words=("-ts_time_step", "0.02")),
            "its other name in capitals": dict(words=("-TS_Time_Step", "0.02")),
            "a file": dict(words=("-options_file", "f.yaml"), files={"f.yaml": "ts_time_step: 0.02\n"}),
            "a file of PETSc's form": dict(words=("-options_file", "f.opts"), files={"f.opts": "-ts_time_step 0.02\n"}),
            "PETSC_OPTIONS": dict(words=(), petsc_options="-ts_time_step 0.02"),
            "new over old in a file": dict(words=("-options_file", "f.yaml", "-ts_time_step", "0.02"), files={"f.yaml": "ts_dt: 0.1\n"}),
            "old over new in a file": dict(words=("-options_file", "f.yaml", "-ts_dt", "0.02"), files={"f.yaml": "ts_time_step: 0.1\n"}),
            "new over new in PETSC_OPTIONS": dict(words=("-ts_time_step", "0.02"), petsc_options="-ts_time_step 0.1"),
            "the later on the command line": dict(words=("-ts_dt", "0.1", "-ts_time_step", "0.02"))}
    checks.true("-ts_dt: four steps of 0.02 s", want[0] == 0 and abs(want[3][-1] - 0.08) < 1e-12, str(want[3]))
    for name, way in ways.items():
        got = run(*way.pop("words"), **way)
        same = got[0] == 0 and np.array_equal(got[2], want[2]) and np.array_equal(got[3], want[3])
        checks.true(f"step by {name}: the same run, no warning", same and "warning" not in got[1], "" if same else got[1][-300:])


def rejections(checks, folder):
    """Newton has one iteration, so that steps are rejected until they are short; none may be."""
    run = Runs(checks, folder)
    hard = ("-ts_type", "beuler", "-ts_dt", "0.5", "-snes_max_it", "1", "-snes_rtol", "1e-9", "-bs_gravity", "0,-9.81", "-bs_lattice_fixed", "ymin", "-bs_step_max_cuts", "40")
    most = [run(*hard, name, "0") for name in ("-ts_max_reject", "-ts_max_step_rejections")]
    free = run(*hard)
    checks.true("rejections are limited under both names", all(r[0] == 3 and "step" in r[1] for r in most) and free[1] != most[0][1], f"{[r[0] for r in most]}")
    said = [re.sub(r"\d+\.h5md", "", r[1].splitlines()[-1]) for r in most]
    checks.true("... in the same words", said[0] == said[1] and "converged" in said[0], said[1])
    unread = run("-bs_task", "modes", "-bs_modes", "2", "-ts_max_step_rejections", "3")
    checks.true("one that the run has no use for is told", any("-ts_max_reject" in line and "not used by this run" in line for line in unread[1].splitlines()), unread[1][-300:])


def stages(checks, folder):
    run = Runs(checks, folder)
    few, *many = (run("-ts_type", "ssp", "-ts_dt", "0.02", *words) for words in ((), ("-ts_ssp_nstages", "8"), ("-ts_ssp_num_stages", "8")))
    checks.true("stages of ssp under both names", all(r[0] == 0 and np.array_equal(r[2], many[0][2]) for r in many) and not np.array_equal(few[2], many[0][2]), many[1][1][-200:])


def line_searches(checks, folder):
    run = Runs(checks, folder)
    fall = ("-bs_gravity", "0,-9.81", "-bs_lattice_fixed", "ymin", "-ts_dt", "0.02")
    for options in (("-snes_linesearch_type", "l2"), ("-snes_linesearch_type", "bt", "-snes_linesearch_maxstep", "0.5")):
        other = [{"l2": "secant", "-snes_linesearch_maxstep": "-snes_linesearch_maxlambda"}.get(word, word) for word in options]
        one, two = run(*fall, *options), run(*fall, *other)
        same = one[0] == two[0] == 0 and np.array_equal(one[2], two[2])
        checks.true(f"{' '.join(options)}: the same as {' '.join(other)}", same and "warning" not in two[1] + one[1], "" if same else two[1][-300:])


def values(checks, folder):
    """PETSc's options for numbers and types without a value, and an end that lies before the checkpoint, are refused; -help begins without warnings."""
    chain = [checks.program, "-bs_lattice_type", "chain", "-bs_lattice_size", "4"]
    call = lambda *words: subprocess.run(words, cwd=folder, env=environment(1), capture_output=True, text=True, timeout=60)
    for words, name in ((("-ts_dt", "-ts_max_time", "1"), "-ts_dt"), (("-ts_max_time",), "-ts_max_time"), (("-snes_rtol", "-ts_dt", "0.1"), "-snes_rtol"), (("-fieldsplit_x_ksp_type",), "-fieldsplit_x_ksp_type")):
        done = call(*chain, *words)
        checks.true(f"{' '.join(words)}: refused", done.returncode == 2 and f"option {name} needs a value" in done.stderr, done.stderr[-200:])
    first = call(*chain, "-ts_dt", "0.1", "-ts_max_time", "0.4", "-bs_checkpoint", "c.ck")
    checks.true("a run with a checkpoint", first.returncode == 0, first.stderr[-200:])
    for end, code in (("0.2", 2), ("0.4", 0), ("0.6", 0)):
        done = call(checks.program, "-bs_restart", "c.ck", "-ts_max_time", end, "-bs_overwrite")
        checks.true(f"continued to t = {end} s: exit {code}", done.returncode == code and (code == 0 or "c.ck is at t = 0.4 s already" in done.stderr), done.stderr[-200:])
    help_of_all = call(checks.program, "-help")
    checks.true("-help begins without a warning", help_of_all.returncode == 0 and "warning" not in help_of_all.stderr and help_of_all.stdout.startswith("backspring: implicit"), help_of_all.stderr[:200])


if __name__ == "__main__":
    run_parts(__doc__, (steps, rejections, stages, line_searches, values))
