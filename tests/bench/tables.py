"""results.md: the tables of one measured run, the machine named."""
import os
import platform
import subprocess

import model
import targets


def machine():
    """What the figures belong to."""
    facts = {"kernel": platform.release(), "cores": len(os.sched_getaffinity(0))}
    try:
        text = subprocess.run(["lscpu"], capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"}).stdout
        for line in text.splitlines():
            key, _, value = line.partition(":")
            if key.strip() in ("Model name", "L2 cache", "L3 cache", "Hypervisor vendor"):
                facts[key.strip().lower()] = value.strip()
    except OSError:
        pass
    with open("/proc/meminfo") as f:
        facts["memory"] = f"{int(f.readline().split()[1]) / 2 ** 20:.0f} GiB"
    facts["load"] = os.getloadavg()[0]
    return facts


def number(value, digits=3):
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return str(value)
    return f"{value:.{digits}g}" if abs(value) < 1e4 else f"{value:,.0f}"


def grid(head, rows):
    out = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return out + ["| " + " | ".join(number(cell) for cell in row) + " |" for row in rows] + [""]


def over(a, b, factor=1.0):
    """factor a / b; None where either is not there."""
    return factor * a / b if a is not None and b else None


def steps_table(rows):
    head = ("run", "ranks", "s/step", "Newton/step", "Krylov/step", "worth force evaluations", "MB at peak", "bytes/particle", "us/particle")
    return grid(head, [(r["label"], r["ranks"], r.get("failed") or r["s_per_step"], r.get("newton"), r.get("krylov"),
                        r.get("force_evaluations"), over(r.get("peak_bytes"), 1e6), r.get("bytes_per_particle"), over(r.get("s_per_step"), r["particles"], 1e6))
                       for r in rows])


def strong_table(rows):
    """Speed-up over one rank of every case that was run on several."""
    alone = {(r["case"], r["h"], r["solver"]): r["s_per_step"] for r in rows if r["ranks"] == 1 and "s_per_step" in r}
    found = [(r["label"], r["ranks"], alone[key] / r["s_per_step"]) for r in rows if r["ranks"] > 1 and "s_per_step" in r
             for key in [(r["case"], r["h"], r["solver"])] if key in alone]
    return grid(("run", "ranks", "times faster than one"), found)


def peers_table(rows):
    head = ("peer", "case", "h or span [s]", "ranks", "s per 0.01 s simulated", "s/step or steps", "Newton", "Krylov", "MB at peak")
    return grid(head, [(r["peer"], r["case"], r["h"] if r["kind"] == "implicit" else r["time"], r["ranks"], r.get("failed") or r["s_per_10ms"],
                        r.get("s_per_step", r.get("steps")), r.get("newton"), r.get("krylov"), over(r.get("peak_bytes"), 1e6)) for r in rows])


def kernels_table(kernels):
    lines = []
    if kernels.get("triad"):
        lines = [f"STREAM triad of one core in the same run: {kernels['triad'] / 1e9:.3g} GB/s.", ""]
    head = ("kernel", "event", "million springs/s", "ms/call", "least traffic over triad")
    return lines + grid(head, [(r["kernel"], r.get("event"), r.get("failed") or r["springs_per_s"] / 1e6,
                                over(r.get("s_per_call"), 1, 1e3), r.get("share_of_triad")) for r in kernels["rows"]])


def output_table(rows):
    head = ("ranks", "particles", "MB/frame", "s/frame", "of it observables", "of it fields (VecView)", "raw HDF5 s", "raw MPI-IO s", "frame/raw HDF5", "MB/s")
    return grid(head, [(r["ranks"], r["particles"], r["bytes"] / 1e6, r.get("failed") or r["s_per_frame"], r.get("s_observables"), r.get("s_fields"),
                        r.get("raw_hdf5"), r.get("raw_mpiio"), over(r.get("s_per_frame"), r.get("raw_hdf5")),
                        over(r["bytes"], r.get("s_per_frame"), 1e-6)) for r in rows])


def targets_table(results):
    words = {True: "reached", False: "**missed**", None: ""}
    return grid(("figure", "target", "measured", ""), [(f, t, "not measured" if m is None else m, words[h]) for f, t, m, h in targets.table(results)])


PARTS = (("Steps", "steps", steps_table), ("Strong scaling", "steps", strong_table), ("Peers on the same lattice", "peers", peers_table),
         ("Kernels", "kernels", kernels_table), ("Weak scaling", "weak", steps_table),
         ("Cost against size, h omega_max as at n = 40", "sizes", steps_table), ("Large lattices", "large", steps_table),
         ("Without factors", "without_factors", steps_table), ("Output", "output", output_table))


def markdown(results):
    """The whole file as text."""
    facts = results["machine"]
    lines = ["# Benchmark results", "", f"Written by `bench.py` on {results['date']}; {results['version']}, medians of up to {results['repeats']} runs.",
             "Machine: " + ", ".join(f"{key} {number(value)}" for key, value in facts.items()) + ".",
             "An empty run takes " + ", ".join(f"{size / 1e6:.0f} MB on {ranks} rank(s)" for ranks, size in results["empty_bytes"].items()) + ".", ""]
    if facts["load"] > 0.5:
        lines += [f"**The machine was busy when this started (load {facts['load']:.2f}): compare ratios only, if at all.**", ""]
    for title, key, table in PARTS:
        if results.get(key):
            lines += [f"## {title}", ""] + table(results[key])
    if results.get("checks"):
        words = {True: "agrees", False: "**differs**"}
        lines += ["## Agreement", ""] + grid(("position", "off by [m]", "allowed", ""), [(*check[:3], words[check[3]]) for check in results["checks"]])
    lines += ["## Past one machine", ""] + (model.report(results) or ["No run on several ranks was counted.", ""])
    note = [] if results["n"] == 40 else [f"The targets are for n = 40; this run had n = {results['n']}.", ""]
    return "\n".join(lines + ["## Targets", ""] + note + targets_table(results))
