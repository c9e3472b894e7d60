#!/usr/bin/env python3
"""model.py results.json: what a step of a lattice far larger than this machine would take, from the volumes counted here.

Every figure starts from a run on two or more ranks in results.json; what is assumed about the larger machine is an option.
"""
import argparse
import json
import math
import sys


def counted_row(results):
    """The run whose messages are counted: default options, most ranks, most particles; with the particles in a plane
    that cuts it in two."""
    rows = []
    for key in ("weak", "sizes", "steps"):
        for r in results.get(key, []):
            if r["ranks"] > 1 and r.get("events") and r.get("solver") != "full":
                rows.append(dict(r, plane=(r["particles"] / (r["ranks"] if key == "weak" else 1)) ** (2 / 3)))
    return max(rows, key=lambda r: (r["ranks"], r["particles"]), default=None)


def volumes(row):
    """Per step and rank of `row`: exchanges, bytes each sends per particle on the cut, reductions."""
    step = row["events"]["TSStep"]
    # two ranks share one plane of particles; PETSc counts what is sent and what is received
    sends = step["messages"] / 2 / row["steps"]
    each = step["bytes"] / step["messages"] / row["plane"] if step["messages"] else 0.0
    return {"exchanges": sends, "bytes": each,
            "reductions": step["reductions"] / row["steps"]}


def step_time(particles, ranks, seconds_per_particle, counted, latency, bandwidth):
    """(seconds of work, of halo exchange, of reductions) of one step: `particles` in cubes, one a rank."""
    share = particles / ranks
    edge = share ** (1 / 3)
    halo = 6 * edge ** 2 + 12 * edge  # one layer on the faces and edges: 18 neighbours reach no further
    partners = 18
    work = seconds_per_particle * share
    exchange = counted["exchanges"] * (partners * latency + halo * counted["bytes"] / bandwidth)
    reduction = counted["reductions"] * 2 * math.ceil(math.log2(max(2, ranks))) * latency
    return work, exchange, reduction


def report(results, particles=1e9, ranks=(100, 1000, 10000, 100000), latency=2e-6, bandwidth=5e8):
    """Lines of markdown; None where no run on several ranks was counted. latency [s] and bandwidth [bytes/s] of a rank."""
    row = counted_row(results)
    if row is None:
        return None
    counted = volumes(row)
    # all cores of the measuring machine were busy: memory bandwidth was shared as it will be there
    each = row["s_per_step"] * row["ranks"] / row["particles"]
    empty = {int(key): size for key, size in results["empty_bytes"].items()}
    memory = max(0.0, row["peak_bytes"] - empty.get(row["ranks"], 0)) / row["particles"]
    exponent = math.log10(particles)
    name = f"10^{exponent:.0f}" if abs(exponent - round(exponent)) < 1e-9 else f"{particles:.3g}"
    lines = [f"Counted in '{row['label']}' on {row['ranks']} ranks: {counted['exchanges']:.0f} halo exchanges a step of "
             f"{counted['bytes']:.1f} bytes per particle on the cut, {counted['reductions']:.0f} all-reduces,",
             f"{1e6 * each:.3g} us of one core per particle, {row['krylov']:.3g} Krylov iterations.", "",
             f"{name} particles at the same h omega_max and Krylov iterations; assumed: latency {latency:g} s, {bandwidth:g} bytes/s a rank.", "",
             "| ranks | particles/rank | GB/rank | work [s] | halo [s] | reductions [s] | s/step | efficiency |", "|" + "---|" * 8]
    for count in ranks:
        work, exchange, reduction = step_time(particles, count, each, counted, latency, bandwidth)
        total = work + exchange + reduction
        lines.append(f"| {count} | {particles / count:,.0f} | {memory * particles / count / 1e9:.3g} | {work:.3g} | {exchange:.3g} | {reduction:.3g} | "
                     f"{total:.3g} | {100 * work / total:.0f} % |")
    return lines + [""]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results")
    parser.add_argument("--particles", type=float, default=1e9)
    parser.add_argument("--ranks", type=lambda text: [int(word) for word in text.split(",")], default=[100, 1000, 10000, 100000])
    parser.add_argument("--latency", type=float, default=2e-6, help="of a message [s] (assumed)")
    parser.add_argument("--bandwidth", type=float, default=5e8,
                        help="of the network, a rank's share [bytes/s] (assumed: 24 GB/s a node of 48 ranks)")
    given = vars(parser.parse_args())
    with open(given.pop("results")) as f:
        lines = report(json.load(f), **given)
    if lines is None:
        sys.exit("no run on two ranks in this file: run bench.py with --ranks 1,2 and the sections weak or sizes")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
