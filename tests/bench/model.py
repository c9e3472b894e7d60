#!/usr/bin/env python3
"""model.py results.json: what a step of a lattice far larger than this machine would take, from the volumes counted here.

Every figure starts from a run on two or more ranks in results.json; what is assumed about the larger machine is an option.
"""
import argparse
import json
import math
import sys

import coarse


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


# Of a coarse grid of u unknowns in three dimensions: entries of its Cholesky factors over u^(4/3), counted at 2,187 to 12,288 unknowns (14.5 to 15.9);
# neighbours of a node with numbers that are not lower.
FACTOR_ENTRIES, NEIGHBOURS = 15, 14


def coarse_rates(times):
    """Seconds an application takes for each entry of the factors, to a constant, a set-up for each squared unknown, as operations grow in nested dissection:
    by the difference of a large and a small grid over the same lattice, in which what every particle does is the same."""
    small, large = sorted(times, key=lambda row: row["unknowns"])
    slope = lambda key, power: max(0.0, (large[key] - small[key]) / (large["unknowns"] ** power - small["unknowns"] ** power))
    return {"application": slope("s_per_application", 4 / 3), "set_up": slope("s_per_set_up", 2)}


def coarse_bytes(unknowns):
    """Of each rank: the factors, E as a matrix (9 numbers and columns a block), and by blocks of 8 numbers while it is made."""
    return 8 * FACTOR_ENTRIES * unknowns ** (4 / 3) + (9 * 12 + 64) * NEIGHBOURS * unknowns / 3


def coarse_time(unknowns, rates, counted, bandwidth):
    """Seconds of one step: solves with E, its factors, and what of both is summed over the ranks (each number sent and received once)."""
    work = counted["applications"] * rates["application"] * unknowns ** (4 / 3) + counted["set_ups"] * rates["set_up"] * unknowns**2
    summed = counted["applications"] * 8 * unknowns + counted["set_ups"] * 64 * NEIGHBOURS * unknowns / 3
    return work, 2 * summed / bandwidth


def growth(iterations, ranks):
    """Krylov iterations on the most ranks over those on `ranks`: with the coarse grid, and without it on the most."""
    rows = sorted(iterations, key=lambda row: row["ranks"])
    base = next((row for row in rows if row["ranks"] == ranks), rows[0])["krylov"]
    return rows[-1]["krylov"] / base, rows[-1]["krylov_without"] / base


def coarse_part(results, row):
    """What is known of the coarse grid beside `row`: {rates, applications and set-ups a step, growth, shares}; None where it was not measured."""
    measured = results.get("coarse") or {}
    if not measured.get("times"):
        return None
    events, steps = row["events"], row["steps"]
    count = lambda *names: next((events[name]["count"] for name in names if name in events), 0) / steps
    time = lambda name: events.get(name, {"time": 0.0})["time"] / steps
    return {"rates": coarse_rates(measured["times"]), "applications": count("BSCoarse"), "set_ups": count("BSCoarseSetUp", "BSFactor"),
            "growth": growth(measured["iterations"], row["ranks"]), "rows": measured["iterations"],
            "share": min(1.0, (time("BSProduct") + time("BSTriangles") + time("BSCoarse")) / row["s_per_step"])}


def total_time(particles, ranks, each, counted, part, more, latency, bandwidth):
    """(work, coarse grid, halo, reductions) [s] of a step that takes `more` times the Krylov iterations counted."""
    work, exchange, reduction = step_time(particles, ranks, each, counted, latency, bandwidth)
    if not part:
        return work, 0.0, exchange, reduction
    made, sent = coarse_time(coarse.unknowns(particles, ranks), part["rates"], dict(part, applications=part["applications"] * more), bandwidth)
    return work * (1 + part["share"] * (more - 1)), made + sent, exchange * more, reduction * more


def report(results, particles=1e9, ranks=(100, 1000, 10000, 100000), latency=2e-6, bandwidth=5e8):
    """Lines of markdown; None where no run on several ranks was counted. latency [s] and bandwidth [bytes/s] of a rank."""
    row = counted_row(results)
    if row is None:
        return None
    counted, part = volumes(row), coarse_part(results, row)
    own = coarse.unknowns(row["particles"], row["ranks"])
    replicated = coarse_time(own, part["rates"], part, bandwidth)[0] if part else 0.0
    # all cores of the measuring machine were busy: memory bandwidth was shared as it will be there
    each = max(0.0, row["s_per_step"] - replicated) * row["ranks"] / row["particles"]
    empty = {int(key): size for key, size in results["empty_bytes"].items()}
    memory = max(0.0, row["peak_bytes"] - empty.get(row["ranks"], 0) - row["ranks"] * coarse_bytes(own)) / row["particles"]
    exponent = math.log10(particles)
    name = f"10^{exponent:.0f}" if abs(exponent - round(exponent)) < 1e-9 else f"{particles:.3g}"
    lines = [f"Counted in '{row['label']}' on {row['ranks']} ranks: {counted['exchanges']:.0f} halo exchanges a step of "
             f"{counted['bytes']:.1f} bytes per particle on the cut, {counted['reductions']:.0f} all-reduces,",
             f"{1e6 * each:.3g} us of one core per particle, {row['krylov']:.3g} Krylov iterations.", ""]
    lines += coarse_lines(part, particles, ranks) + [f"{name} particles at the same h omega_max; assumed: latency {latency:g} s, {bandwidth:g} bytes/s a rank.", ""]
    lines += ["| ranks | particles/rank | GB/rank | work [s] | coarse grid [s] | halo [s] | reductions [s] | s/step | efficiency | s/step at most |", "|" + "---|" * 10]
    for count in ranks:
        shown, most = (total_time(particles, count, each, counted, part, more, latency, bandwidth) for more in (part["growth"] if part else (1, 1)))
        gigabytes = (memory * particles / count + coarse_bytes(coarse.unknowns(particles, count))) / 1e9
        lines.append(f"| {count} | {particles / count:,.0f} | {gigabytes:.3g} | " + " | ".join(f"{value:.3g}" for value in shown) +
                     f" | {sum(shown):.3g} | {100 * each * particles / count / sum(shown):.0f} % | {f'{sum(most):.3g}' if part else 'not measured'} |")
    return lines + [""]


def coarse_lines(part, particles, ranks):
    if not part:
        return ["**The coarse grid's time and the growth of iterations were not measured (section coarse): neither is in the table.**", ""]
    rows = part["rows"]
    words = lambda key: ", ".join(f"{row[key]:.1f}" for row in rows)
    sizes = [coarse.unknowns(particles, count) for count in ranks]
    each = lambda value, form: ", ".join(format(value(size), form) for size in sizes)
    return [f"Krylov iterations a step of {rows[0]['particles']:,} particles a rank on {', '.join(str(row['ranks']) for row in rows)} ranks: {words('krylov')}; without "
            f"the coarse grid {words('krylov_without')}. The table takes {part['growth'][0]:.2f} times those of the run counted, its last column, for a coarse grid "
            f"that no longer helps, {part['growth'][1]:.2f} times.", "",
            f"On {', '.join(f'{count:g}' for count in ranks)} ranks the coarse grid has {each(int, 'd')} unknowns, on every rank {each(lambda u: coarse_bytes(u) / 1e6, '.0f')} MB; "
            f"{each(lambda u: 1e3 * part['rates']['application'] * u ** (4 / 3), '.3g')} ms an application, {each(lambda u: part['rates']['set_up'] * u**2, '.3g')} s a set-up; "
            f"{part['applications']:.3g} and {part['set_ups']:.3g} of them a step.", ""]


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
