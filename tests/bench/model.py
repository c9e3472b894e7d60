#!/usr/bin/env python3
"""model.py results.json: what a step of a lattice far larger than this machine would take, from the volumes counted here.

Every figure starts from a run on two or more ranks in results.json; what is assumed about the larger machine is an option.
"""
import argparse
import json
import math
import sys


def counted_row(results):
    """The run whose messages are counted: default options, most ranks, most particles."""
    rows = [r for key in ("weak", "sizes", "steps") for r in results.get(key, []) if r.get("ranks", 1) > 1 and r.get("events") and r.get("solver") != "full"]
    return max(rows, key=lambda r: (r["ranks"], r["particles"]), default=None)


def volumes(row):
    """Per step and rank of `row`: exchanges, bytes each sends per particle on the cut, reductions."""
    step = row["events"]["TSStep"]
    # two ranks share one plane of particles; PETSc counts what is sent and what is received
    plane = (row["particles"] / row["ranks"]) ** (2 / 3)
    sends = step["messages"] / 2 / row["steps"]
    return {"exchanges": sends, "bytes_per_boundary_particle": step["bytes"] / step["messages"] / plane if step["messages"] else 0.0,
            "reductions": step["reductions"] / row["steps"]}


def step_time(particles, ranks, seconds_per_particle, counted, machine):
    """(seconds of work, of halo exchange, of reductions) of one step: `particles` in cubes, one a rank."""
    share = particles / ranks
    edge = share ** (1 / 3)
    halo = 6 * edge ** 2 + 12 * edge  # one layer on the faces and edges: 18 neighbours reach no further
    partners = 18
    work = seconds_per_particle * share
    exchange = counted["exchanges"] * (partners * machine.latency + halo * counted["bytes_per_boundary_particle"] / machine.bandwidth)
    reduction = counted["reductions"] * 2 * math.ceil(math.log2(max(2, ranks))) * machine.latency
    return work, exchange, reduction


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results")
    parser.add_argument("--particles", type=float, default=1e9)
    parser.add_argument("--ranks", default="100,1000,10000,100000")
    parser.add_argument("--latency", type=float, default=2e-6, help="of a message [s] (assumed)")
    parser.add_argument("--bandwidth", type=float, default=5e8, help="of the network, a rank's share [bytes/s] (assumed: 24 GB/s a node of 48 ranks)")
    machine = parser.parse_args()
    with open(machine.results) as f:
        results = json.load(f)
    row = counted_row(results)
    if row is None:
        sys.exit("no run on two ranks in this file: run bench.py with --ranks 1,2 and the sections weak or sizes")
    counted = volumes(row)
    # all cores of the measuring machine were busy: memory bandwidth was shared as it will be there
    each = row["s_per_step"] * row["ranks"] / row["particles"]
    print(f"counted in '{row['label']}' on {row['ranks']} ranks: {counted['exchanges']:.0f} halo exchanges a step of {counted['bytes_per_boundary_particle']:.1f} bytes "
          f"per particle on the cut, {counted['reductions']:.0f} all-reduces, {1e6 * each:.3g} us of one core per particle, Krylov {row['krylov']:.3g} a step")
    exponent = math.log10(machine.particles)
    name = f"10^{exponent:.0f}" if abs(exponent - round(exponent)) < 1e-9 else f"{machine.particles:.3g}"
    print(f"\n{name} particles at the same h omega_max; latency {machine.latency:g} s, {machine.bandwidth:g} bytes/s a rank, Krylov iterations as counted:\n")
    print("| ranks | particles/rank | GB/rank | work [s] | halo [s] | reductions [s] | s/step | efficiency |\n|---|---|---|---|---|---|---|---|")
    for ranks in map(int, machine.ranks.split(",")):
        work, exchange, reduction = step_time(machine.particles, ranks, each, counted, machine)
        total = work + exchange + reduction
        memory = row.get("bytes_per_particle", 0) * machine.particles / ranks / 1e9
        print(f"| {ranks} | {machine.particles / ranks:,.0f} | {memory:.3g} | {work:.3g} | {exchange:.3g} | {reduction:.3g} | {total:.3g} | {100 * work / total:.0f} % |")


if __name__ == "__main__":
    main()
