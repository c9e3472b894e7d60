#!/usr/bin/env python3
"""Two builds of the program compute the same: the runs of runs.yaml by both, every frame, observable and event compared.

  tests/property/same_results.py --program build/release/backspring --reference ../before/build/release/backspring
"""
import argparse
import concurrent.futures
import json
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import h5py
import numpy as np
import yaml
from program import environment, words

import crossings

REPO = pathlib.Path(__file__).resolve().parents[2]
ROOTS = ("particles", "observables", "backspring", "events", "states")
LEFT_OUT = re.compile(r"backspring/(log|options|build|host)|/(step|author|creator)$|observables/unbalanced_force/")  # the last: what rounding leaves


def command_of(case, folder, program, more):
    options = {"bs_progress_interval": -1}
    if "crossing" in case:
        crossings.lattice(folder / "lattice.h5", case["crossing"], np.random.default_rng(5))
        options.update(crossings.options(case["crossing"], folder))
    else:
        options.update(case["options"])
        for name, place in (("options_file", "options/problems"), ("bs_lattice_file", "")):
            if name in options:
                options[name] = REPO / place / options[name]
    options.update(more)
    options.update(bs_output="run.h5md", bs_report="report.json", bs_overwrite=True)
    return (["mpirun", "-n", str(case["ranks"])] if case["ranks"] > 1 else []) + [str(program), *words(options)]


def numbers(path):
    """{name: array} of what was computed."""
    found = {}

    def add(name, item):
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiu" and name.split("/")[0] in ROOTS and not LEFT_OUT.search(name):
            found[name] = item[...]

    with h5py.File(path) as f:
        f.visititems(add)
    return found


def run(case, program, more):
    """(frames, counts) of one build; what went wrong as a RuntimeError."""
    with tempfile.TemporaryDirectory() as there:
        folder = pathlib.Path(there)
        command = command_of(case, folder, pathlib.Path(program).resolve(), more)
        done = subprocess.run(command, cwd=folder, env=environment(case["ranks"]), capture_output=True, text=True, timeout=600)
        if done.returncode:
            raise RuntimeError(f"exit {done.returncode}: {done.stderr.strip()[-300:]} [{' '.join(command)}]")
        report = json.loads((folder / "report.json").read_text())
        return numbers(folder / "run.h5md"), {name: report.get(name) for name in ("steps", "rejected", "newton", "krylov")}


def difference(new, old):
    """(largest difference relative to each dataset's largest number, its name) or why they cannot be compared."""
    if set(new) != set(old):
        return np.inf, "other datasets: " + ", ".join(sorted(set(new) ^ set(old)))
    worst, where = 0.0, ""
    for name, a in new.items():
        b = old[name]
        if a.shape != b.shape:
            return np.inf, f"{name}: shape {a.shape}, before {b.shape}"
        if np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
            continue
        size = max(float(np.nanmax(np.abs(b))), 1e-300)
        off = float(np.nanmax(np.abs(a.astype(float) - b.astype(float)))) / size
        if off > worst or not np.isfinite(off):
            worst, where = off, name
    return worst, where


def judge(case, program, reference, more):
    """(whether it is the same, the line that says so)"""
    try:
        (new, counts), (old, before) = run(case, program, more), run(case, reference, more)
    except (RuntimeError, OSError, KeyError, subprocess.TimeoutExpired) as why:
        return False, f"{case['name']}: {why}"
    counted = ", ".join(f"{name} {before[name]}" + (f" -> {counts[name]}" if counts[name] != before[name] else "") for name in counts if counts[name] is not None)
    if "counts" in case:
        good = all(abs((counts[n] or 0) - (before[n] or 0)) <= case["counts"] * max(before[n] or 0, 1) for n in ("newton", "krylov"))
        return good, f"{case['name']}: {'same within ' + format(case['counts'], '.0%') if good else 'OTHER COUNTS'}: {counted}"
    off, where = difference(new, old)
    bound = float(case.get("bound", 0))
    good = off <= bound
    verdict = "same in every bit" if off == 0 else f"{'same' if good else 'DIFFERENT'}: {off:.2g} (bound {bound:.2g}) in {where}"
    return good, f"{case['name']}: {verdict}; {counted}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--reference", required=True, help="the program of an earlier commit")
    parser.add_argument("--runs", type=pathlib.Path, default=pathlib.Path(__file__).with_name("runs.yaml"))
    parser.add_argument("--filter", default="", help="runs whose name contains this")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="an option for every run, e.g. bs_partition=geometric")
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    cases = [case for case in yaml.safe_load(args.runs.read_text()) if args.filter in case["name"]]
    more = dict(words.split("=", 1) for words in args.set)
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        results = list(pool.map(lambda case: judge(case, args.program, args.reference, more), cases))
    for good, line in results:
        print(line)
    bad = sum(not good for good, _ in results)
    print(f"{len(results) - bad} same, {bad} different")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
