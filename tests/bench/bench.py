#!/usr/bin/env python3
"""Benchmarks of implicit steps of spring lattices: kernels, steps, peers, scaling, output; JSON, tables and a plot.

    /usr/bin/python3 tests/bench/bench.py --budget 1800            # everything, within half an hour
    /usr/bin/python3 tests/bench/bench.py --sections steps,kernels --n 20 --budget 120
"""
import argparse
import datetime
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import traceback

import cases
import coarse
import kernels
import output
import peers
import scaling
import steps
import tables
from running import Budget, Failed, program

HERE = pathlib.Path(__file__).resolve().parent
# In this order, with the share of the time each may claim; what one leaves over the later ones get.
SECTIONS = {"steps": 7, "kernels": 1, "peers": 4, "weak": 1, "coarse": 1, "sizes": 4, "without_factors": 1, "output": 1, "large": 4}


class Context:
    """What every section needs: the program, sizes, budget, and where to say how far it is."""

    def __init__(self, arguments, scratch):
        self.program = str(pathlib.Path(arguments.program).resolve())
        self.n, self.steps, self.repeats, self.output_n = arguments.n, arguments.steps, arguments.repeats, arguments.output_n
        self.ranks, self.sizes = arguments.ranks, arguments.sizes
        self.large, self.large_free = arguments.large, arguments.large_free
        self.triad_elements, self.scratch = arguments.triad_elements, str(scratch)
        self.peers = pathlib.Path(arguments.peers).resolve()
        self.budget = Budget(arguments.budget, arguments.longest)
        self.started = time.monotonic()
        self.seen = {}  # {ranks: (particles, bytes a particle) of the largest run yet}

    def say(self, text):
        print(f"[{time.monotonic() - self.started:6.0f} s] {text}", flush=True)


def whole_numbers(text):
    return [int(word) for word in text.split(",") if word]


def read_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(cases.REPO / "build" / "release" / "backspring"))
    parser.add_argument("--budget", type=float, default=1800, help="seconds for everything; what does not fit is left out and said so")
    parser.add_argument("--longest", type=float, default=180, help="seconds one run may take")
    parser.add_argument("--sections", default=",".join(SECTIONS), help=f"among {', '.join(SECTIONS)}")
    parser.add_argument("--n", type=int, default=40, help="particles along an edge of B1 and B2")
    parser.add_argument("--steps", type=int, default=5)
    parser.add_argument("--repeats", type=int, default=3, help="runs the median is taken of, while a run is quick")
    parser.add_argument("--ranks", type=whole_numbers, default=[1, 2])
    parser.add_argument("--sizes", type=whole_numbers, default=[10, 16, 25, 40, 64, 100],
                        help="edges of the lattices of the cost per particle; 160: 4.1 million")
    parser.add_argument("--large", type=whole_numbers, default=[], help="edges of B3, one step each, e.g. 100,160")
    parser.add_argument("--large-free", type=whole_numbers, default=[], help="the same without factors, e.g. 216 (10 million)")
    parser.add_argument("--output-n", type=int, default=100, help="edge of the lattice whose frames are written")
    parser.add_argument("--triad-elements", type=int, default=20_000_000, help="of each of STREAM's three arrays")
    parser.add_argument("--peers", default=str(cases.REPO / "build" / "peers"), help="folder the peers are built in")
    parser.add_argument("--folder", default=str(HERE), help="where results.json, results.md and results.png go")
    parser.add_argument("--keep", action="store_true", help="keep what results.json holds of the sections that are not measured now")
    parser.add_argument("--scratch", default=None, help="folder for trajectories; the output section measures its disk (default: the system's)")
    return parser.parse_args()


def empty_run(context, ranks):
    """Peak memory [bytes] of a run of eight particles: what libraries and MPI take."""
    try:
        return program(context, dict(cases.problem("B1", 2, 0.01, 1), ts_type="symplectic", ts_dt=1e-3), ranks)["peak_bytes"]
    except Failed as why:
        sys.exit(f"the program does not run: {why}")


def run_sections(context, wanted, results):
    needs_peers = {"peers", "output", "kernels"} & set(wanted)
    missing = peers.build(context) if needs_peers else {}
    runners = {"steps": lambda: steps.run(context), "kernels": lambda: kernels.run(context),
               "peers": lambda: peers.accurate(context, missing) + peers.implicit(context, missing),
               "weak": lambda: scaling.weak(context), "coarse": lambda: coarse.run(context), "sizes": lambda: scaling.sizes(context),
               "without_factors": lambda: scaling.without_factors(context), "output": lambda: output.run(context, missing),
               "large": lambda: scaling.large(context)}
    wanted = [name for name in SECTIONS if name in wanted]
    for at, name in enumerate(wanted):
        context.budget.open_part(SECTIONS[name] / sum(SECTIONS[other] for other in wanted[at:]))
        if context.budget.left() < 1:
            context.say(f"section {name} left out: the budget of time is spent")
            continue
        context.say(f"== {name}, {context.budget.left():.0f} s for it")
        try:
            results[name] = runners[name]()
        except Exception:  # one section that breaks must not cost the others' figures
            results.setdefault("errors", {})[name] = traceback.format_exc()
            print(results["errors"][name], file=sys.stderr, flush=True)
        yield


def main():
    arguments = read_arguments()
    wanted = arguments.sections.split(",")
    unknown = set(wanted) - set(SECTIONS)
    if unknown or not shutil.which(arguments.program):
        sys.exit(f"unknown section {', '.join(unknown)}: there are {', '.join(SECTIONS)}" if unknown else f"--program {arguments.program}: no such program")
    folder = pathlib.Path(arguments.folder)
    folder.mkdir(parents=True, exist_ok=True)
    pathlib.Path(arguments.peers).mkdir(parents=True, exist_ok=True)
    version = subprocess.run([arguments.program, "-bs_version"], capture_output=True, text=True).stdout.strip()
    results = {"date": datetime.date.today().isoformat(), "version": version, "machine": tables.machine(), "n": arguments.n, "repeats": arguments.repeats,
               "arguments": {k: v for k, v in vars(arguments).items() if k not in ("program", "peers", "folder", "scratch")}}
    if arguments.keep and (folder / "results.json").exists():
        results = dict(json.loads((folder / "results.json").read_text()), date=results["date"], version=version)
    with tempfile.TemporaryDirectory(prefix="bench_", dir=arguments.scratch) as scratch:
        context = Context(arguments, scratch)
        results["empty_bytes"] = {ranks: empty_run(context, ranks) for ranks in arguments.ranks}
        for _ in run_sections(context, wanted, results):
            stepped = results.get("steps", [])
            results["checks"] = steps.check(stepped, arguments.n) + peers.check(results.get("peers", []), stepped)
            (folder / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    (folder / "results.md").write_text(tables.markdown(results) + "\n")
    try:
        import plots
        plots.draw(results, folder / "results.png")
    except ImportError as why:
        context.say(f"no plot: {why}")
    print("\n".join(tables.targets_table(results)))
    for what, off, allowed, holds in results.get("checks", []):
        if not holds:
            print(f"DIFFERS: {what}: off by {off:.3g} m, allowed {allowed:.3g}")
    print(f"written: {folder / 'results.json'}, results.md, results.png")
    sys.exit(1 if results.get("errors") or not all(c[3] for c in results.get("checks", [])) else 0)


if __name__ == "__main__":
    main()
