#!/usr/bin/env python3
"""Time per step of a linear system whose matrix is factored once: the heat equation on an n x n grid.

Two runs of different length in one session: their difference is the steps, the rest is reading and factoring. Writes
JSON and prints a table; figures of one machine, to be compared as ratios.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from program import environment

REPO = pathlib.Path(__file__).resolve().parents[2]


def wall(program, n, steps, ranks, extra):
    """Report of a run of `steps` steps."""
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        command = ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [
            program, "-options_file", str(REPO / "options" / "problems" / "bench_heat2d.yaml"), "-bs_linear_size", f"{n},{n}",
            "-ts_max_steps", str(steps), "-bs_report", str(report), "-bs_overwrite", "-bs_progress_interval", "-1"] + extra
        subprocess.run(command, env=environment(ranks), check=True, stdout=subprocess.DEVNULL)
        return json.loads(report.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(REPO / "build" / "release" / "backspring"))
    parser.add_argument("--sizes", default="250,500,1000", help="grid sides")
    parser.add_argument("--ranks", default="1,2")
    parser.add_argument("--steps", type=int, default=20, help="steps of the longer run; the shorter one makes a quarter")
    parser.add_argument("-o", "--output", default="bench_linear.json")
    arguments = parser.parse_args()
    rows = []
    print(f"{'unknowns':>9} {'ranks':>5} {'solver':>10} {'s/step':>8} {'set-up s':>9} {'set-ups':>7}")
    for n in map(int, arguments.sizes.split(",")):
        for ranks in map(int, arguments.ranks.split(",")):
            for solver, extra in (("LU, MUMPS", []), ("CG + GAMG", ["-ksp_type", "cg", "-pc_type", "gamg", "-ksp_rtol", "1e-8"])):
                few, many = max(1, arguments.steps // 4), arguments.steps
                short, long = (wall(arguments.program, n, k, ranks, extra) for k in (few, many))
                step = (long["wall"] - short["wall"]) / (many - few)
                rows.append({"unknowns": n * n, "ranks": ranks, "solver": solver, "s_per_step": step,
                             "setup_s": short["wall"] - few * step, "matrix_setups": long.get("matrix_setups")})
                print(f"{n * n:9d} {ranks:5d} {solver:>10} {step:8.3f} {rows[-1]['setup_s']:9.2f} {rows[-1]['matrix_setups']!s:>7}", flush=True)
    pathlib.Path(arguments.output).write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
