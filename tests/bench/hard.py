#!/usr/bin/env python3
"""Hard cases (hard_problems.py): what Newton's method and its linear solves take on them under several options, from the explicit limit
to a thousand times it, beside symplectic Euler. Writes hard.json and hard.md into this folder (or -o FOLDER).

Processor times are user times of the process (/proc), less that of a run of one tiny explicit step; none is a wall-clock time."""
import argparse
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "verify"))
import h5py
import numpy as np
from program import environment, words
import hard_problems

VARIANTS = {"auto": {}, "exact": {"bs_tangent": "exact"}, "definite": {"bs_tangent": "definite"},
            "extrapolated guess": {"bs_guess": "extrapolate"}, "exact, trust region": {"bs_tangent": "exact", "snes_type": "newtontr"}}
OLD = "before"  # the column of --old
TYPES = {"beuler": {"ts_type": "beuler"}, "cn": {"ts_type": "cn"}, "bdf2": {"ts_type": "bdf", "ts_bdf_order": 2, "ts_adapt_type": "none"},
         "alpha2": {"ts_type": "alpha2", "ts_adapt_type": "none"}}
MULTIPLES = (1, 10, 100, 1000)
FRAMES = 5
SAFETY = 0.9  # of the largest stable explicit step: the estimate is of the starting state


def user_time(pid):
    """User time of the running process [s]"""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return int(fields[11]) / os.sysconf("SC_CLK_TCK")


def run(program, options, folder, limit):
    """(exit code, user time [s], whether it was stopped). Past `limit` seconds of user time it is asked to stop after the present step,
    past twice as many it is killed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with open(folder / "out.txt", "w") as out:
        process = subprocess.Popen([program] + words(options), cwd=folder, env=environment(1), stdout=out, stderr=subprocess.STDOUT,
                                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (int(2 * limit) + 1,) * 2))
        stopped = False
        while process.poll() is None:
            try:
                if not stopped and user_time(process.pid) > limit:
                    stopped = True
                    process.send_signal(signal.SIGTERM)
            except (FileNotFoundError, ProcessLookupError):
                pass
            time.sleep(0.05)
    return process.returncode, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, stopped


def read_frames(path):
    """{energy (T), motion (T): kinetic and elastic, momentum (T, d), largest: sum of m |v| at its largest; newton, krylov (steps)}"""
    with h5py.File(path, "r") as f:
        o = {name: g["value"][...] for name, g in f["observables"].items() if "value" in g}
        p = f["particles/trajectory"]
        mass = p["mass"][...].ravel()
        with np.errstate(over="ignore"):
            speed = max((mass * np.linalg.norm(v, axis=1)).sum() for v in p["velocity/value"])
        out = {"energy": np.ravel(o["total_energy"]), "motion": np.ravel(o["kinetic_energy"]) + np.ravel(o["elastic_energy"]),
               "momentum": o["momentum"].reshape(len(o["momentum"]), -1), "largest": float(speed)}
        for name in ("newton", "krylov", "dt"):
            out[name] = np.ravel(f["backspring/log"][name][...])
    return out


def judged(case, frames):
    """{drift, gain}: of the momentum against the largest sum of m |v|, where nothing acts from outside; of the energy above its first
    value against the largest kinetic and elastic energy, where nothing drives."""
    out = {}
    if case.free and frames["largest"] > 0:
        out["drift"] = float(np.abs(frames["momentum"] - frames["momentum"][0]).max() / frames["largest"])
    if not (np.isfinite(frames["energy"]).all() and np.isfinite(frames["motion"]).all()):
        out["gain"] = 1e300
    elif not case.driven and len(frames["energy"]) > 1 and frames["motion"].any():
        out["gain"] = float((frames["energy"][1:].max() - frames["energy"][0]) / np.abs(frames["motion"]).max())
    return out


def measure(program, case, options, h, steps, folder, limit, start_up):
    """{command, outcome, steps, rejected, newton, worst, krylov, indefinite, seconds, per_second, drift, gain}: newton and krylov a step,
    worst: the most Newton iterations that a step took, seconds of processor time, per_second: the same a simulated second."""
    for name in ("run.h5md", "report.json"):
        (folder / name).unlink(missing_ok=True)
    given = dict(case.options, ts_dt=h, ts_max_time=steps * h, **options)
    row = {"command": " ".join(words(given)), "h": h}
    given.update(bs_report="report.json", bs_overwrite=True, bs_progress_interval=-1, bs_advise=False, bs_output="run.h5md", bs_output_interval=steps * h / FRAMES,
                 bs_output_strain=False, bs_output_xdmf=False)
    code, seconds, stopped = run(program, given, folder, limit)
    row["seconds"] = max(seconds - start_up, 0.01)
    if not (folder / "report.json").exists():
        text = (folder / "out.txt").read_text().strip().splitlines() or [""]
        return dict(row, outcome=f"killed after {seconds:.0f} s" if stopped or code < 0 else f"exit code {code}: {text[-1][:200]}")
    r = json.loads((folder / "report.json").read_text())
    done = r["t"] / h
    row.update(outcome=f"{done:.3g} of {steps} steps in {seconds:.0f} s" if stopped else r["outcome"], steps=r["steps"], rejected=r["rejected"],
               newton=r["newton"] / max(1, r["steps"]), krylov=r["krylov"] / max(1, r["steps"]), indefinite=r.get("indefinite", 0), t=r["t"])
    if code == 3:
        row["reason"] = r.get("reason", "")
    if r["t"] > 0:
        row["per_second"] = row["seconds"] / r["t"]
    if (folder / "run.h5md").exists():
        frames = read_frames(folder / "run.h5md")
        row.update(judged(case, frames), worst=int(frames["newton"].max()) if len(frames["newton"]) else 0)
    return row


def explicit(program, case, limit_step, folder, limit, start_up, wanted):
    """Symplectic Euler at the largest step that lets the energy stay what it is: {h, steps, per_second}, or why there is none."""
    h = SAFETY * limit_step
    for _ in range(4):
        row = measure(program, case, {"ts_type": "symplectic"}, h, wanted, folder, limit, start_up)
        if "per_second" in row and row.get("gain", 0) < 0.1:
            return row
        h /= 2
    return row


def prepare(program, case, folder, limit):
    """(largest stable explicit step [s], user time of a run of one such step)"""
    code, seconds, _ = run(program, dict(case.options, ts_type="symplectic", ts_dt=1e-9, ts_max_time=1e-9, bs_report="report.json", bs_overwrite=True, bs_progress_interval=-1), folder, limit)
    if code != 0:
        raise SystemExit(f"{case.name}: " + (folder / "out.txt").read_text()[-300:])
    return json.loads((folder / "report.json").read_text())["largest_explicit_step"], seconds


def figure(value, form=".3g"):
    return "-" if value is None else f"{value:{form}}"


COLUMNS = ("outcome", "steps", "rejected", "Newton a step", "worst", "Krylov a step", "indefinite", "CPU s / s", "symplectic's", "momentum drift", "energy gained")


def cells(row, symplectic):
    get = row.get
    bold = lambda text, wins: f"**{text}**" if wins else text
    rate, other = get("per_second"), symplectic.get("per_second")
    return [get("outcome"), figure(get("steps"), "d"), figure(get("rejected"), "d"), figure(get("newton")), figure(get("worst"), "d"), figure(get("krylov")),
            figure(get("indefinite"), "d"), bold(figure(rate), rate and other and rate < other), figure(other), figure(get("drift"), ".1e"), figure(get("gain"), ".1e")]


def table(case, parts):
    lines = [f"### {case['name']}, {case['particles']} particles", "",
             f"Explicit limit {case['limit']:.3g} s, h = {case['h']:.3g} s ({case['h'] / case['limit']:.0f} times it); `{case['options']}`", ""]
    lines += ["| run | " + " | ".join(COLUMNS) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    for part in parts:
        for name, row in case.get(part, {}).items():
            lines.append(f"| {name} | " + " | ".join(cells(row, case["symplectic"])) + " |")
    return "\n".join(lines) + "\n"


HEAD = """# Hard cases

Measured by `tests/bench/hard.py`; the cases are in `hard_problems.py`. Each takes a few steps of h, the shorter of 0.02 s and 300 times the largest
stable explicit step that the program names at the start. Newton and Krylov iterations are those a step that was taken, "worst" the most Newton iterations of
one, rejected attempts at it included. "indefinite":
tangents that were not positive definite (before: linear solves that went to the fallback solver). "CPU s / s": user time
a simulated second, start-up left out; bold where it is below symplectic Euler's at 0.9 of its largest stable step (less where that
is not stable), measured in the same run. "momentum drift": against the largest sum of m |v|, where nothing acts from outside. "energy gained": above the first
value, against the largest kinetic and elastic energy, where no moving anchor and no wind does work; negative: lost.
A run that needs more processor time than --limit is stopped after the step it is at: its outcome says how far it came. Rows that are missing were not measured.
"""


def write(folder, results):
    (folder / "hard.json").write_text(json.dumps(results, indent=1) + "\n")
    text = HEAD
    for size, found in results["sizes"].items():
        text += f"\n## {size}\n"
        for case in found.values():
            text += "\n" + table(case, ("variants", "steps"))
    (folder / "hard.md").write_text(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default=str(hard_problems.cases.REPO / "build" / "release" / "backspring"))
    parser.add_argument("--old", help="an earlier program for comparison, on its default options")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=HERE)
    parser.add_argument("--filter", default="", help="only cases whose name contains this")
    parser.add_argument("--size", choices=("small", "large"), default="small")
    parser.add_argument("--variants", default=";".join(VARIANTS), help="which, separated by semicolons")
    parser.add_argument("--steps", type=int, help="steps of a run (20 small, 5 large)")
    parser.add_argument("--limit", type=float, default=8, help="seconds of processor time a run may take")
    parser.add_argument("--sweep", action=argparse.BooleanOptionalAction, help="types and steps from the explicit limit on; as a rule of small cases")
    parser.add_argument("--types", default=",".join(TYPES), help="of the sweep; large cases take beuler alone")
    a = parser.parse_args()
    found = {name: shutil.which(p) or sys.exit(f"{p}: no such program") for name, p in (("new", a.program), ("old", a.old)) if p}
    program = os.path.abspath(found["new"])
    small = a.size == "small"
    steps = a.steps or (20 if small else 5)
    sweep = small if a.sweep is None else a.sweep
    wanted = [v for v in a.variants.split(";") if v]
    if set(wanted) - set(VARIANTS):
        sys.exit(f"--variants: {set(wanted) - set(VARIANTS)} are not among {list(VARIANTS)}")
    saved = a.output / "hard.json"
    results = json.loads(saved.read_text()) if saved.exists() else {"sizes": {}}
    size = results["sizes"].setdefault(a.size, {})
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for case in hard_problems.problems(folder, a.size):
            if a.filter not in case.name:
                continue
            limit_step, start_up = prepare(program, case, folder, 10 * a.limit)
            h = hard_problems.step(limit_step)
            entry = size.setdefault(case.name, {"variants": {}, "steps": {}})
            entry.update(name=case.name, particles=case.count, limit=limit_step, h=h, start_up=start_up,
                         options=" ".join(words(case.options)).replace(str(folder) + "/", "").replace(str(hard_problems.cases.REPO) + "/", ""))
            keep = lambda row: dict(row, command=row["command"].replace(str(folder) + "/", "").replace(str(hard_problems.cases.REPO) + "/", ""))
            entry["symplectic"] = keep(explicit(program, case, limit_step, folder, a.limit / 2, start_up, max(20, min(2000, 3_000_000 // case.count))))
            jobs = [("variants", f"beuler, {v}", program, dict(TYPES["beuler"], **VARIANTS[v]), h, steps) for v in wanted]
            if a.old:
                jobs.append(("variants", f"beuler, {OLD}", os.path.abspath(found["old"]), TYPES["beuler"], h, steps))
            if sweep:
                jobs += [("steps", f"{t}, {m} times the limit", program, TYPES[t], m * limit_step, steps // 2)
                         for m in MULTIPLES for t in (a.types.split(",") if small else ("beuler",))]
            for part, name, which, options, length, count in jobs:
                entry[part][name] = keep(measure(which, case, options, length, count, folder, a.limit, start_up))
                print(f"{case.name}, {name}: " + " | ".join(f"{c} {v}" for c, v in zip(COLUMNS, cells(entry[part][name], entry["symplectic"])) if v != "-"), flush=True)
                write(a.output, results)


if __name__ == "__main__":
    main()
