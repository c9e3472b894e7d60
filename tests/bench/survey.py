#!/usr/bin/env python3
"""Statics of many disordered nets by default, without any option of a solver. Writes survey.json and survey.md into this folder (or -o FOLDER).

  survey.py --program build/release/backspring [--families sheared,moduli,plates] [--ranks 1,2] [-o FOLDER]
  survey.py --program build/release/backspring --check

sheared: periodic triangular nets of 40 x 40 particles, 42 % of the springs of stiffness 1, the others 0, seeds 0 to 9, sheared by 0.6 in 60 load steps. moduli: the same of 30 x 30 with
36 % and rest lengths of 1.005 times the initial distances, which all push at first. plates: plates of 50 x 50 with a notch (disordered.py), 50 seeds for bonds present with
probabilities from 0.68 to 0.9, and one that is known to be hard (0.72, seed 15), pulled by 4 in 40 load steps. Load steps are met to the program's own tolerances; how many of them
end in an equilibrium that is unstable is what the program reports of the frames, one for each, `not known` how many it could not judge, and `unbalanced` how many are left with more than 1e-6 of the largest load
or reaction, for which rounding leaves no other choice."""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "verify"))  # behind this folder, whose statics.py is meant
import h5py
import numpy as np
from disordered import plate
from harness import write_lattice
from program import environment

NET = "-bs_lattice_type triangular -bs_lattice_periodic xy -bs_lattice_dim 2 -bs_lattice_stiffness 1 -bs_lattice_stiff_factor 0".split()
SHEARED = "-bs_task statics -bs_lattice_size 40,40 -bs_lattice_stiff_fraction 0.42 -bs_box_strain xy=velocity:0.6 -bs_load_steps 60 -bs_lattice_seed".split()
MODULI = "-bs_task moduli -bs_lattice_size 30,30 -bs_lattice_stiff_fraction 0.36 -bs_lattice_rest_length_factor 1.005 -bs_lattice_seed".split()
PULLED = "-bs_task statics -bs_motion_lo fixed -bs_motion_up x=fixed,y=velocity:4 -bs_load_steps 40 -bs_lattice_file".split()
COUNTS = {"load_steps": "steps", "newton": "newton", "cut": "rejected", "pseudo": "pseudo_transient", "saddles": "saddle_points", "stable": "stable", "unstable": "unstable", "unknown": "stability_unknown", "unbalanced": "unbalanced"}


def plates():
    """{name: (P, seed)}."""
    return {f"{p:.4f}, {seed}": (p, seed) for seed, p in [*enumerate(np.linspace(0.68, 0.9, 50)), (15, 0.72)]}


FAMILIES = {"sheared": range(10), "moduli": range(10), "plates": plates()}


def arguments_of(family, net, folder):
    """What the program is given."""
    if family != "plates":
        return [*NET, *(SHEARED if family == "sheared" else MODULI), str(net)]
    x, pairs, low, up = plate(50, *FAMILIES["plates"][net])
    path = write_lattice(folder / "plate.h5", x, 1.0, pairs=pairs, stiffness=1.0)
    with h5py.File(path, "r+") as f:
        f["groups/lo"], f["groups/up"] = low, up
    return [*PULLED, str(path)]


def run(program, family, net, ranks, folder):
    """A row: how far it came, and by what."""
    report = folder / "report.json"
    report.unlink(missing_ok=True)
    # a frame for every load step: equilibria are judged where there is one
    command = [program, *arguments_of(family, net, folder), "-bs_report", report, "-bs_output", folder / "frames.h5md", "-bs_overwrite"]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), *command]
    done = subprocess.run(command, cwd=folder, env=environment(ranks), capture_output=True, text=True)
    found = json.loads(report.read_text()) if report.exists() else {}
    why = "" if done.returncode == 0 else f"exit code {done.returncode}: {found.get('reason', done.stderr.strip()[-200:])}"
    return {"net": str(net), "ranks": ranks, **{key: found.get(name, 0) for key, name in COUNTS.items()}, "why": why}


def document(found):
    lines = ["# Disordered nets by default", "", "Measured by `tests/bench/survey.py`, which says what the nets are. No option of a solver is given."]
    for family, rows in found.items():
        whole = sum(not row["why"] for row in rows)
        lines += ["", f"## {family}: {whole} of {len(rows)} runs come to their end", "",
                  f"| {'P, seed' if family == 'plates' else 'seed'} | ranks | load steps | Newton | cut | by pseudo time | saddle points left | stable | unstable | not known | unbalanced | |",
                  "|---|---|---|---|---|---|---|---|---|---|---|---|"]
        for row in rows:
            lines.append(f"| {row['net']} | {row['ranks']} | {row['load_steps']} | {row['newton']:,} | {row['cut']} | {row['pseudo']} | {row['saddles']} | {row['stable']} | {row['unstable']} | {row['unknown']} | {row['unbalanced']} | {row['why']} |")
        total = {key: sum(row[key] for row in rows) for key in COUNTS}
        lines += ["", f"Of {total['load_steps']:,} load steps {total['cut']} attempts were cut, {total['pseudo']} went by pseudo time, and {total['unstable']} of {total['stable'] + total['unstable'] + total['unknown']:,} equilibria judged are unstable."]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(HERE.parents[1] / "build" / "release" / "backspring"))
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--ranks", default="1,2", help="plates and moduli by the first alone")
    parser.add_argument("-o", type=pathlib.Path, default=HERE)
    parser.add_argument("--check", action="store_true", help="one net of each family; nothing is written")
    given = parser.parse_args()
    program, ranks = str(pathlib.Path(given.program).resolve()), [int(one) for one in given.ranks.split(",")]
    kept = given.o / "survey.json"
    found = json.loads(kept.read_text()) if kept.exists() and not given.check else {}
    with tempfile.TemporaryDirectory() as scratch:
        for family in given.families.split(","):
            nets = list(FAMILIES[family])[2:3] if given.check else FAMILIES[family]
            found[family] = []
            for net in nets:
                for count in ranks if family == "sheared" else ranks[:1]:
                    found[family].append(run(program, family, net, count, pathlib.Path(scratch)))
                    print(family, found[family][-1], flush=True)
            if not given.check:
                kept.write_text(json.dumps(found, indent=1) + "\n")
                (given.o / "survey.md").write_text(document(found))
    if given.check:
        print(document(found))
        sys.exit("\n".join(row["why"] for rows in found.values() for row in rows if row["why"]) or 0)


if __name__ == "__main__":
    main()
