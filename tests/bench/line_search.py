#!/usr/bin/env python3
"""Which line search: every type on easy and on hard steps, with the program's own options otherwise. Writes line_search.json
and line_search.md into this folder (or -o FOLDER). `hard_cases.json` holds three single steps on which Newton has trouble."""
import argparse
import json
import os
import pathlib
import resource
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "verify"))
import numpy as np
from harness import write_lattice
from program import environment, words
from running import read_events
import cases

SEARCHES = ("bt", "cp", "l2", "basic", "guarded", "energy")
BLOCK = {"bs_lattice_type": "cubic", "bs_lattice_neighbors": 18, "bs_spring_law": "strain", "bs_lattice_stiffness": 250, "bs_gravity": (0, 0, -9.81),
         "bs_lattice_seed": 3}


def benchmarks(n):
    for name in ("B1", "B2"):
        for h in (0.01, 0.1):
            yield f"{name}, n = {n}, h = {h:g} s", cases.problem(name, n, h)


def single_steps(folder):
    for name, case in json.loads((HERE / "hard_cases.json").read_text()).items():
        file = write_lattice(folder / f"{name}.h5", case["position"], case["mass"], velocity=case["velocity"], fixed=case["fixed"], pairs=case["pairs"],
                             stiffness=case["stiffness"], rest_length=case["rest_length"], spring_law="strain")
        yield name, {"bs_lattice_file": file, "bs_gravity": case["gravity"], "ts_dt": case["h"], "ts_max_time": case["h"]}


def compressed(n):
    """Blocks whose springs stand at 0.5 and 0.3 of their rest lengths, particles shifted at random by up to a tenth of the
    spacing: free, or held at the bottom."""
    for share in (0.5, 0.3):
        for fixed in (None, "zmin"):
            for h in (0.01, 0.1):
                yield (f"block at {share:g} of its spacing{', held' if fixed else ''}, h = {h:g} s",
                       dict(BLOCK, bs_lattice_size=(n, n, n), bs_lattice_spacing=1.0 / n, bs_lattice_total_mass=1000 * (n / 20)**3, bs_lattice_perturbation=0.1 / n,
                            bs_lattice_rest_length_factor=1 / share, bs_lattice_fixed=fixed, ts_dt=h, ts_max_time=5 * h))
    yield ("net at 0.3 of its spacing, h = 0.1 s",
           dict(BLOCK, bs_lattice_type="cloth", bs_lattice_neighbors=12, bs_lattice_size=(20, 20), bs_lattice_spacing=0.05, bs_lattice_perturbation=0.005, bs_lattice_stiffness=50,
                bs_lattice_particle_mass=0.05, bs_lattice_rest_length_factor=1 / 0.3, bs_lattice_fixed_particles=(0, 19), ts_dt=0.1, ts_max_time=0.5))


def inverted_cloth(folder):
    """Every inner cell turned through half a circle, so that its edges cross."""
    n = 7
    grid = np.array([[i, j, 0.0] for i in range(n) for j in range(n)])
    pairs = [[i * n + j, (i + a) * n + j + b] for i in range(n) for j in range(n) for a, b in ((1, 0), (0, 1), (1, 1), (1, -1))
             if i + a < n and 0 <= j + b < n]
    rest = [np.linalg.norm(grid[a] - grid[b]) for a, b in pairs]
    inside = np.array([0 < i < n - 1 and 0 < j < n - 1 for i in range(n) for j in range(n)])
    x = grid.copy()
    x[inside] = 6.0 - x[inside]
    x[inside, 2] = 0.01 * np.sin(np.arange(inside.sum()))
    fixed = np.array([i in (0, n - 1) and j in (0, n - 1) for i in range(n) for j in range(n)])
    file = write_lattice(folder / "cloth.h5", x, 0.1, fixed=fixed, pairs=pairs, stiffness=1000.0, rest_length=rest, spring_law="hooke")
    for h in (0.01, 0.2):
        yield f"inverted cloth, h = {h:g} s", {"bs_lattice_file": file, "ts_dt": h, "ts_max_time": 20 * h}


def ratios(folder, n=30):
    """Chains in the plane, bent, with neighbours of very different stiffness or mass."""
    odd = np.arange(n) % 2 == 1
    x = np.column_stack([np.arange(n), 0.2 * np.sin(1.3 * np.arange(n))])
    fixed = np.arange(n) == 0
    for name, mass, k in (("stiffnesses 1e8 apart", np.ones(n), np.where(odd[1:], 1e8, 1.0)), ("masses 1e6 apart", np.where(odd, 1e6, 1.0), np.full(n - 1, 1e4))):
        file = write_lattice(folder / f"{name.split()[0]}.h5", x, mass, fixed=fixed, pairs=[[i, i + 1] for i in range(n - 1)], stiffness=k, rest_length=1.0, spring_law="hooke")
        for h in (0.01, 0.1):
            yield f"{name}, h = {h:g} s", {"bs_lattice_file": file, "bs_gravity": (0, -9.81), "ts_dt": h, "ts_max_time": 20 * h}


def collapsed(folder):
    """Two particles on a spring at a billionth of its length, and a chain falling through its anchor."""
    file = write_lattice(folder / "pair.h5", [[0.0, 0.0], [0.8e-9, 0.6e-9]], 1.0, pairs=[[0, 1]], stiffness=1e6, rest_length=1.0, spring_law="hooke")
    yield "spring at 1e-9 of its length, h = 1 s", {"bs_lattice_file": file, "ts_dt": 1.0, "ts_max_time": 20.0}
    file = write_lattice(folder / "chain.h5", [[0.0, 0.5 * (i + 1)] for i in range(8)], 1.0, pairs=[[i, i + 1] for i in range(7)], stiffness=1e4, rest_length=0.5,
                         spring_law="hooke", anchors={"particle": [0], "point": [[0.01, 0.0]], "stiffness": [1e4], "rest_length": [0.5], "damping": [0.0]})
    yield "chain falling through its anchor, h = 0.1 s", {"bs_lattice_file": file, "bs_gravity": (0, -9.81), "ts_dt": 0.1, "ts_max_time": 4.0}


def problems(folder, n):
    yield from benchmarks(n)
    yield from single_steps(folder)
    yield from compressed(max(4, n // 2))
    yield from inverted_cloth(folder)
    yield from ratios(folder)
    yield from collapsed(folder)


def measure(program, options, search, folder, limit, repeats):
    """{outcome, newton, residuals, energies, krylov, steps, rejected, seconds, energy}"""
    given = dict(options, snes_linesearch_type=search, bs_report="r.json", bs_overwrite=True, bs_progress_interval=-1, bs_advise=False, log_view=":log.csv:ascii_csv")
    times = []
    while len(times) < repeats and (not times or times[0] < 2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([program] + words(given), cwd=folder, env=environment(1), capture_output=True, text=True, errors="replace",
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)))
        if done.returncode == -signal.SIGKILL:
            return {"outcome": f"not done in {limit} s"}
        if done.returncode not in (0, 3):
            raise SystemExit(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
    events = read_events(folder / "log.csv")
    r = json.loads((folder / "r.json").read_text())
    count = lambda name: events.get(name, {"count": 0})["count"]
    return {"outcome": r["outcome"], "newton": r["newton"], "residuals": count("BSForces"), "energies": count("BSPotential"), "krylov": r["krylov"], "steps": r["steps"],
            "rejected": r["rejected"], "uphill": r.get("search_uphill", 0), "seconds": statistics.median(times), "energy": float(np.ravel(r["last_total_energy"])[0])}


def cell(row, best):
    if row["outcome"] != "ok":
        return row["outcome"]
    text = f"{row['newton']} / {row['krylov']}" + (f" ({row['rejected']} cut)" if row["rejected"] else "")
    return f"**{text}**" if row["newton"] <= 1.1 * best else text


def table(results):
    """Newton / Krylov iterations of a run, in brackets the attempts at a step that were rejected."""
    lines = ["| case | " + " | ".join(SEARCHES) + " |", "|---" * (len(SEARCHES) + 1) + "|"]
    for name, rows in results.items():
        best = min((r["newton"] for r in rows.values() if r["outcome"] == "ok"), default=0)
        lines.append(f"| {name} | " + " | ".join(cell(rows[s], best) for s in SEARCHES) + " |")
    lines += ["", "| all cases | " + " | ".join(SEARCHES) + " |", "|---" * (len(SEARCHES) + 1) + "|"]
    ratio = {s: [] for s in SEARCHES}
    for rows in results.values():
        best = min((r["newton"] for r in rows.values() if r["outcome"] == "ok"), default=None)
        for s, r in rows.items():
            if r["outcome"] == "ok":
                ratio[s].append(r["newton"] / max(best, 1))
    column = lambda of: " | ".join(of(s) for s in SEARCHES)
    lines.append("| Newton iterations over the fewest, geometric mean | " + column(lambda s: f"{np.exp(np.mean(np.log(ratio[s]))):.2f}") + " |")
    lines.append("| the same, worst | " + column(lambda s: f"{max(ratio[s]):.1f}") + " |")
    total = lambda key: column(lambda s: str(sum(rows[s].get(key, 0) for rows in results.values())))
    for key, title in (("residuals", "residual evaluations"), ("energies", "energy evaluations"), ("krylov", "Krylov iterations"), ("rejected", "rejected attempts")):
        lines.append(f"| {title} | " + total(key) + " |")
    lines.append("| processor time [s], start-up included | " + column(lambda s: f"{sum(rows[s].get('seconds', 0) for rows in results.values()):.3g}") + " |")
    lines.append("| runs that did not end well | " + column(lambda s: str(sum(rows[s]["outcome"] != "ok" for rows in results.values()))) + " |")
    return "\n".join(lines) + "\n"


def write(folder, results, limit):
    (folder / "line_search.json").write_text(json.dumps({"limit": limit, "results": results}, indent=1) + "\n")
    (folder / "line_search.md").write_text("# Line searches\n\nMeasured by `tests/bench/line_search.py`. " + " ".join(table.__doc__.split())
                                           + f" Bold: within a tenth of the fewest Newton iterations. A run may take {limit} s of processor time.\n\n" + table(results))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default=str(cases.REPO / "build" / "release" / "backspring"))
    parser.add_argument("-o", "--output", type=pathlib.Path, default=HERE)
    parser.add_argument("--n", type=int, default=20, help="particles along an edge of B1 and B2; compressed blocks have half")
    parser.add_argument("--filter", default="", help="only cases whose name contains this")
    parser.add_argument("--limit", type=int, default=60, help="seconds of processor time a run may take")
    parser.add_argument("--repeats", type=int, default=3, help="runs of which the median counts, while they are short")
    parser.add_argument("--keep", action="store_true", help="cases that line_search.json holds already are not measured again")
    a = parser.parse_args()
    program = os.path.abspath(shutil.which(a.program) or sys.exit(f"--program {a.program}: no such program"))
    saved = a.output / "line_search.json"
    before = json.loads(saved.read_text()) if a.keep and saved.exists() else {}
    results = before.get("results", {})
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, options in problems(folder, a.n):
            if a.filter not in name:
                continue
            if name in results:
                continue
            results[name] = {s: measure(program, options, s, folder, a.limit, a.repeats) for s in SEARCHES}
            print(name + ": " + ", ".join(f"{s} {cell(r, 0)}" for s, r in results[name].items()), flush=True)
            write(a.output, results, a.limit)
    print(table(results))


if __name__ == "__main__":
    main()
