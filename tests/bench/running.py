"""Runs commands within a budget of time, with peak memory; reads the program's report, events and last position."""
import csv
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from program import environment, words

import h5py

HERE = pathlib.Path(__file__).resolve().parent
LARGEST_OUTPUT = 300_000  # particles; above, positions are not looked at


class Budget:
    """Seconds that may be spent, and what one run may take."""

    def __init__(self, seconds, longest):
        self.end, self.longest = time.monotonic() + seconds, longest
        self.part_end = self.end

    def open_part(self, share):
        """The next section may take this share of what is left."""
        self.part_end = min(self.end, time.monotonic() + share * (self.end - time.monotonic()))

    def left(self):
        return self.part_end - time.monotonic()

    def limit(self):
        """What the next run may take: never all of a section's time, so that others come to be measured, too."""
        return max(0.0, min(self.longest, 0.6 * self.left()))


class Failed(Exception):
    """A run that did not end well, in one line."""


def execute(command, ranks, limit, folder):
    """(stdout, wall [s], peak memory of all ranks [bytes]); Failed says why not."""
    if limit < 1:
        raise Failed("out of time")
    wrapped = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    wrapped += [sys.executable, str(HERE / "measure.py"), str(folder / "rss")] + [str(word) for word in command]
    started = time.monotonic()
    process = subprocess.Popen(wrapped, cwd=folder, env=environment(ranks), stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True, errors="replace", start_new_session=True)
    try:
        out, err = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        stop(process)
        raise Failed(f"not done in {limit:.0f} s") from None
    if process.returncode:
        lines = [line for line in (err + "\n" + out).splitlines() if line.strip(" -\n")] or [f"exit code {process.returncode}"]
        raise Failed(next((line for line in lines if "error" in line.lower()), lines[-1])[:200])
    peak = sum(int(file.read_text()) for file in folder.glob("rss.*"))
    return out, time.monotonic() - started, peak


def stop(process):
    """Ends the process and all it started."""
    import os
    import signal
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
            process.communicate(timeout=5)
        except (ProcessLookupError, subprocess.TimeoutExpired):
            continue
        return


def read_events(path):
    """{event: {count, time (longest rank), messages, bytes, reductions (of all ranks' average)}} of -log_view's CSV."""
    events, ranks = {}, {}
    with open(path, newline="") as f:
        for row in csv.DictReader(f):
            name, count = row["Event Name"].strip(), float(row["Count"])
            if name == "summary" or count == 0:
                continue
            e = events.setdefault(name, {"count": 0, "time": 0.0, "messages": 0.0, "bytes": 0.0, "reductions": 0.0})
            ranks.setdefault(name, set()).add(row["Rank"])
            e["count"] = max(e["count"], int(count))
            e["time"] = max(e["time"], float(row["Time"]))
            for key, column in (("messages", "Num Messages"), ("bytes", "Message Length"), ("reductions", "Num Reductions")):
                e[key] += float(row[column])
    for name, e in events.items():
        for key in ("messages", "bytes", "reductions"):
            e[key] /= len(ranks[name])
    return events


def program(context, options, ranks=1, output=False):
    """One run of the program: {report, events, s_per_step, wall, peak_bytes, last}."""
    with tempfile.TemporaryDirectory(prefix="bench_", dir=context.scratch) as folder:
        folder = pathlib.Path(folder)
        given = dict(options, bs_report="report.json", bs_overwrite=True, bs_progress_interval=-1, log_view=":log.csv:ascii_csv")
        if output:
            given.update(bs_output="run.h5md", bs_output_interval=1e9)
        _, wall, peak = execute([context.program] + words(given), ranks, context.budget.limit(), folder)
        report = json.loads((folder / "report.json").read_text())
        events = read_events(folder / "log.csv")
        last = None
        if output:
            with h5py.File(folder / "run.h5md", "r") as f:
                last = f["particles/trajectory/position/value"][-1, -1].tolist()
        steps = events.get("TSStep", {"count": 0})["count"]
        return {"report": report, "events": events, "wall": wall, "peak_bytes": peak, "last": last,
                "s_per_step": events["TSStep"]["time"] / steps if steps else None}


def median_of(context, one, repeats):
    """`one()` repeated while it is quick and time is left: the run of median s_per_step, with all of them."""
    runs = [one()]
    while len(runs) < repeats and runs[-1]["wall"] < 0.2 * context.budget.longest and context.budget.left() > 2 * runs[-1]["wall"]:
        runs.append(one())
    times = [run["s_per_step"] for run in runs]
    middle = statistics.median_low(times)
    return dict(runs[times.index(middle)], s_per_step=statistics.median(times), all_s_per_step=times)


def steps_row(context, label, options, ranks, count, output=False, repeats=None):
    """One row of the tables: {label, ranks, particles, s_per_step, newton, krylov (per step), bytes_per_particle, ...}."""
    row = {"label": label, "ranks": ranks, "particles": count, "h": options["ts_dt"]}
    try:
        run = median_of(context, lambda: program(context, options, ranks, output and count <= LARGEST_OUTPUT),
                        context.repeats if repeats is None else repeats)
    except Failed as why:
        row["failed"] = str(why)
        context.say(f"{label}, {ranks} rank(s): {why}")
        return row
    report = run["report"]
    steps = max(1, report["steps"])
    row.update(s_per_step=run["s_per_step"], all_s_per_step=run["all_s_per_step"], steps=report["steps"],
               rejected=report["rejected"], newton=report["newton"] / steps, krylov=report["krylov"] / steps,
               bytes_per_particle=run["peak_bytes"] / count, peak_bytes=run["peak_bytes"], wall=run["wall"], last=run["last"],
               report={key: value for key, value in report.items() if not key.startswith(("first_", "last_"))}, events=run["events"])
    if count >= context.seen.get(ranks, (0, 0))[0]:
        context.seen[ranks] = (count, row["bytes_per_particle"])
    forces = run["events"].get("BSForces")
    if forces:
        row["force_evaluations"] = row["s_per_step"] * forces["count"] / forces["time"]
    context.say(f"{label}, {ranks} rank(s): {row['s_per_step']:.4g} s/step, Newton {row['newton']:.3g}, Krylov {row['krylov']:.4g}, "
                f"{row['bytes_per_particle']:.4g} bytes/particle")
    return row
