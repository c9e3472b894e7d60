#!/usr/bin/env python3
"""What a person meets: warnings, verdicts, exit codes, files that survive a failure, a signal and a kill."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import h5py
import numpy as np
from harness import Checks
from program import environment, words

BLOCK = {"bs_lattice_type": "cubic", "bs_lattice_size": (5, 5, 5), "bs_lattice_spacing": 0.2, "bs_lattice_fixed": "zmin",
         "bs_lattice_stiffness": 4000, "bs_spring_law": "strain", "bs_gravity": (0, 0, -9.81), "ts_dt": 0.01, "ts_max_time": 0.1}
SLOWER = int(os.environ.get("BS_SLOWER", 1))  # how much longer a sanitised build takes


def start(checks, folder, options, ranks=1):
    command = ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [checks.program] + words(options)
    return subprocess.Popen(command, cwd=folder, env=environment(ranks), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def finish(process, timeout=120):
    out, err = process.communicate(timeout=timeout * SLOWER)
    return process.returncode, out, err


def run(checks, folder, options, ranks=1):
    return finish(start(checks, folder, options, ranks))


def frames(path):
    with h5py.File(path, "r") as f:
        time_, x = f["particles/trajectory/position/time"][...], f["particles/trajectory/position/value"]
        return len(time_), len(x) >= len(time_) and np.isfinite(x[:len(time_)]).all()


def words_said(checks, folder):
    code, out, err = run(checks, folder, dict(BLOCK, foo=3, ksp_typ="cg"))
    checks.true("unused options: warned about before step 1", code == 0 and "-foo" in err and "-ksp_typ " in err, err.strip()[:80])
    checks.true("unused options: repeated in the summary", "option -foo was never used" in out)
    code, out, err = run(checks, folder, dict(BLOCK, sub_pc_type="ilu", ksp_type="gmres", pc_type="bjacobi", ts_view=True))
    checks.true("options of inner solvers and viewers are no misspelling", code == 0 and "warning" not in err, err.strip()[:80])
    code, out, err = run(checks, folder, dict(BLOCK, bs_gravty=3))
    checks.true("unknown option names the nearest", code == 2 and "-bs_gravity" in err and err.count("\n") == 1, err.strip())
    code, out, err = run(checks, folder, {"bs_version": True})
    checks.true("-bs_version", code == 0 and out.startswith("backspring "), out.strip())
    code, out, err = run(checks, folder, {"help": True})
    checks.true("-help lists the options and ends well", code == 0 and "-bs_gravity" in out and "-snes_rtol" in out, err.strip()[:80])
    code, out, err = run(checks, folder, dict(BLOCK, bs_progress_interval=0))
    checks.true("progress: a line a step", code == 0 and out.count("step ") >= 10)
    last = out.strip().splitlines()[-1].split()
    checks.true("verdict parses", last[:2] == ["backspring:", "ok"] and float(dict(w.split("=") for w in last[2:])["t"]) == 0.1)


def failures(checks, folder):
    path = pathlib.Path(folder) / "run.h5md"
    base = dict(BLOCK, bs_output="run.h5md", bs_output_interval=0.01, bs_report="r.json", bs_overwrite=True)
    for name, options in (
            ("explicit blow-up", {"ts_type": "euler", "bs_lattice_stiffness": 4e9, "ts_max_time": 10, "bs_lattice_perturbation": 0.02}),
            ("linear solver that cannot", {"ksp_type": "gmres", "pc_type": "none", "ksp_max_it": 1, "ksp_rtol": 1e-14})):
        for ranks in (1, 2):
            code, out, err = run(checks, folder, dict(base, **options), ranks)
            told = [line for line in err.splitlines() if line.startswith("backspring: error:")]
            checks.true(f"{name}, {ranks} rank(s): exit 3, told once", code == 3 and len(told) == 1 and "PETSC ERROR" not in err, "".join(told)[:100])
            count, whole = frames(path)
            checks.true(f"{name}, {ranks} rank(s): {count} good frame(s) kept", count >= 1 and whole)
            checks.true(f"{name}, {ranks} rank(s): report says so", json.loads((pathlib.Path(folder) / "r.json").read_text())["outcome"] == "failed")
    before = path.read_bytes()
    code, out, err = run(checks, folder, dict(BLOCK, bs_output="run.h5md"))
    checks.true("an existing trajectory is refused and untouched", code == 2 and path.read_bytes() == before, err.strip())
    code, out, err = run(checks, folder, dict(BLOCK, bs_output="none/run.h5md"))
    checks.true("a missing folder is named", code == 2 and "none" in err, err.strip())


def interruptions(checks, folder):
    long = dict(BLOCK, ts_max_time=1e4, bs_output="long.h5md", bs_output_interval=0.05, bs_output_flush=0.2, bs_overwrite=True)
    path = pathlib.Path(folder) / "long.h5md"
    for sent, expected in ((signal.SIGTERM, 143), (signal.SIGINT, 130), (signal.SIGKILL, -9)):
        if path.exists():
            path.unlink()
        process = start(checks, folder, long)
        while not path.exists() or path.stat().st_size < 50000:
            time.sleep(0.2)
        time.sleep(SLOWER)
        process.send_signal(sent)
        code, out, err = finish(process)
        count, whole = frames(path)
        checks.true(f"{sent.name}: exit {expected}, {count} frames readable", code == expected and count > 1 and whole, f"exit {code}")


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        words_said(checks, folder)
        failures(checks, folder)
        interruptions(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
