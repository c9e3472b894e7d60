#!/usr/bin/env python3
"""Nets that are torn in load steps: how many springs break in what time, and where the time goes. Writes breaking.json and breaking.md into this folder
(or -o FOLDER).

  breaking.py --program build/release/backspring [--cases all:183,all:578,worst:183] [--ranks 2] [-o FOLDER]

A triangular net of n x n particles with unit springs; its lower row is held, its upper row pulled in 20 load steps by 5 % of the net's height. A spring breaks at a
critical strain whose values scatter about 0.2 by Weibull's distribution of modulus 2. "all": every spring past its limit breaks at once, "worst": one
at a time, with a new equilibrium after each. Times are wall times of all ranks together, so nothing else should run; the shares are of the rank that took longest."""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "verify"))
from program import environment, words
from running import read_events

LOAD_STEPS, PULL = 20, 0.05
PARTS = {"factors": ("BSCondense", "BSFactor", "BSCoarseSetUp"), "Krylov iterations": ("BSProduct", "BSTriangles", "BSCoarse", "VecTDot", "VecAXPY", "VecAYPX", "VecNorm"),
         "forces and energies": ("BSForces", "BSPotential", "BSEnergies"), "frames": ("BSWrite",)}


def options(rule, n):
    height = (n - 1) * 0.75**0.5
    return {"bs_task": "statics", "bs_load_steps": LOAD_STEPS, "bs_lattice_type": "triangular", "bs_lattice_size": (n, n), "bs_lattice_dim": 2, "bs_lattice_spacing": 1,
            "bs_lattice_stiffness": 1, "bs_group_lower": "ymin", "bs_group_upper": "ymax", "bs_motion_lower": "fixed", "bs_motion_upper": f"x=fixed,y=velocity:{PULL * height:.6g}",
            "bs_break_strain": 0.2, "bs_break_weibull": "2,1", "bs_break": rule, "bs_break_spare": "lower,upper", "bs_output": "b.h5md", "bs_output_interval": 0.5,
            "bs_report": "b.json", "bs_overwrite": True, "log_view": ":log.csv:ascii_csv"}


def measure(program, rule, n, ranks, folder):
    command = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [program] + words(options(rule, n))
    done = subprocess.run(command, cwd=folder, env=environment(ranks), capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    report, events = json.loads((folder / "b.json").read_text()), read_events(folder / "log.csv")
    shares = {part: sum(events[name]["time"] for name in names if name in events) / report["wall"] for part, names in PARTS.items()}
    keys = ("broken_springs", "avalanches", "largest_avalanche", "newton", "krylov", "wall", "rejected")
    return {"rule": rule, "n": n, "ranks": ranks, "springs": 3 * n * n - 4 * n + 1, **{key: report[key] for key in keys}, "shares": shares}


def document(rows):
    lines = ["# Nets that are torn", "", "Measured by `tests/bench/breaking.py`, which says what the cases are.", "",
             "| springs | which break | ranks | broken | avalanches | largest | Newton | Krylov | seconds | " + " | ".join(PARTS) + " |", "|" + "---|" * (9 + len(PARTS))]
    for r in rows:
        parts = " | ".join(f"{100 * r['shares'][part]:.0f} %" for part in PARTS)
        lines.append(f"| {r['springs']:,} | {r['rule']} | {r['ranks']} | {r['broken_springs']:,} | {r['avalanches']} | {r['largest_avalanche']:,} | {r['newton']:,} | {r['krylov']:,} | "
                     f"{r['wall']:.0f} | {parts} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(HERE.parents[1] / "build" / "release" / "backspring"))
    parser.add_argument("--cases", default="all:183,all:578,worst:183")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("-o", type=pathlib.Path, default=HERE)
    arguments = parser.parse_args()
    rows = []
    for case in arguments.cases.split(","):
        rule, n = case.split(":")
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(str(pathlib.Path(arguments.program).resolve()), rule, int(n), arguments.ranks, pathlib.Path(folder)))
        print(rows[-1], flush=True)
    (arguments.o / "breaking.json").write_text(json.dumps(rows, indent=1) + "\n")
    (arguments.o / "breaking.md").write_text(document(rows))


if __name__ == "__main__":
    main()
