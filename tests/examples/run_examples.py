#!/usr/bin/env python3
"""Every option file in options/ runs as written, and what it writes holds together."""
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
from program import environment
import h5py
import numpy as np

TERMINAL_VELOCITY = 24.66337697900565  # m/s, of the ball of ice in free_fall.yaml


def run_here(checks, folder, arguments, ranks, timeout=300):
    """One run from the project's folder, so that meshes/ is found; returns (exit code, report, trajectory path, text)."""
    out = pathlib.Path(folder)
    command = ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [checks.program] + arguments + [
        "-bs_output", str(out / "run.h5md"), "-bs_report", str(out / "report.json"), "-bs_overwrite"]
    done = subprocess.run(command, cwd=REPO, env=environment(ranks), capture_output=True, text=True, timeout=timeout)
    report = json.loads((out / "report.json").read_text()) if done.returncode == 0 else None
    # what explicit steps would cost is measured, and beside other tests a run takes longer
    said = "".join(line for line in (done.stdout + done.stderr).splitlines(True) if "warning: explicit steps would cost less" not in line)
    return done.returncode, report, out / "run.h5md", said


def problems(checks, folder):
    structure = pathlib.Path(__file__).resolve().parents[1] / "verify" / "test_h5md.py"
    for file in sorted((REPO / "options" / "problems").glob("*.yaml")):
        if file.stem.startswith("bench_"):
            continue
        for ranks in (1, 2):
            code, report, path, said = run_here(checks, folder, ["-options_file", str(file)], ranks)
            checks.true(f"{file.stem} on {ranks} rank(s)", code == 0, said.strip().splitlines()[-1])
            if code:
                continue
            checks.true(f"{file.stem}: no warning", "warning:" not in said and set(report["warnings"]) <= {"explicit_cheaper"}, f"{report['warnings']}")
            modes = report.get("task") == "modes"
            verdict = "backspring: ok modes=" if modes else "backspring: ok t="
            checks.true(f"{file.stem}: last line is the verdict", said.strip().splitlines()[-1].startswith(verdict))
            with h5py.File(path, "r") as f:
                if "particles" in f:
                    x = f["particles/trajectory/position/value"][...]
                    checks.true(f"{file.stem}: {len(x)} finite frames", len(x) == report["frames"] and np.isfinite(x).all())
                    checks.true(f"{file.stem}: something moves", modes and np.abs(f["modes/shape"][...]).max() > 0 or np.abs(x[-1] - x[0]).max() > 1e-6)
            if ranks == 2 and "particles" in report["model"]:
                checked = subprocess.run([sys.executable, str(structure), str(path)], capture_output=True, text=True)
                checks.true(f"{file.stem}: H5MD structure", checked.returncode == 0, checked.stdout.strip()[-200:])
        if file.stem == "free_fall":
            with h5py.File(path, "r") as f:
                checks.near("free_fall: terminal velocity", f["particles/trajectory/velocity/value"][-1, 0, 0],
                            TERMINAL_VELOCITY, 2e-6)


def solvers(checks, folder):
    """Every solver file gives the direct solve's trajectory, to its own tolerance, or solves another formula."""
    base = ["-options_file", "options/problems/cubic_lattice.yaml", "-bs_lattice_size", "5,5,5", "-ts_max_time", "0.05"]
    _, reference, path, _ = run_here(checks, folder, base, 1)
    with h5py.File(path, "r") as f:
        expected = f["particles/trajectory/position/value"][-1]
    for file in sorted((REPO / "options" / "solvers").glob("*.yaml")):
        for ranks in (1, 2):
            code, report, path, said = run_here(checks, folder, base + ["-options_file", str(file)], ranks)
            checks.true(f"solver {file.stem} on {ranks} rank(s)", code == 0, said.strip().splitlines()[-1])
            if code or file.stem in ("second_order", "adaptive"):
                continue
            with h5py.File(path, "r") as f:
                checks.below(f"solver {file.stem} on {ranks} rank(s): same motion",
                             np.abs(f["particles/trajectory/position/value"][-1] - expected).max(), 1e-6)


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        problems(checks, folder)
        solvers(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
