"""What the program is to reach, against what was measured in this run. Nothing is filled in that was not measured."""
import math


def step(results, case, h, ranks, solver="default"):
    """s/step of that row, or None."""
    for row in results.get("steps", []):
        if (row["case"], row["h"], row["ranks"], row["solver"]) == (case, h, ranks, solver):
            return row.get("s_per_step")
    return None


def ratio(a, b):
    return a / b if a and b else None


def best(values):
    values = [v for v in values if v]
    return min(values) if values else None


def kernel(results, name):
    for row in results.get("kernels", {}).get("rows", []):
        if row["kernel"] == name:
            return row.get("springs_per_s")
    return None


def spread(results):
    """(what, largest over smallest time per particle) from 10^5 to 4.2 10^6 particles, as far as measured, the largest
    number of ranks."""
    rows = [r for r in results.get("sizes", []) if r.get("us_per_particle") and 9e4 <= r["particles"] <= 4.2e6]
    most = max((r["ranks"] for r in rows), default=1)
    rows = sorted((r for r in rows if r["ranks"] == most), key=lambda r: r["particles"])
    costs = [r["us_per_particle"] for r in rows]
    reach = f"{rows[0]['particles']:,} to {rows[-1]['particles']:,}" if len(rows) > 1 else "10^5 to 4 10^6"
    return (f"time per particle, {reach} particles at equal h omega, {most} rank(s): largest over smallest",
            max(costs) / min(costs) if len(costs) > 1 else None)


def converged(results, h):
    for row in results.get("steps", []):
        if row["case"] == "B2" and row["h"] == h and row["solver"] == "default" and row["ranks"] == 1:
            return None if "out of time" in row.get("failed", "") else float("failed" not in row and row["rejected"] == 0)
    return None


def peer(results, name, case, h=None):
    for row in results.get("peers", []):
        if row["peer"] == name and row["case"] == case and row.get("h" if h else "kind") == (h or row["kind"]):
            return row.get("s_per_10ms")
    return None


def loop_against(results, h):
    """Symplectic loop over ours, seconds per 0.01 s of B2."""
    ours = step(results, "B2", h, 1)
    return ratio(peer(results, "symplectic Euler, plain loop", "B2"), ours and ours * 0.01 / h)


def memory(results):
    """Of the largest B1 on one rank, where what every run takes weighs least."""
    rows = [r for r in results.get("steps", []) if r["case"] == "B1" and r["solver"] == "default"] + results.get("sizes", [])
    rows = [r for r in rows if r["ranks"] == 1 and "bytes_per_particle" in r]
    return max(rows, key=lambda r: r["particles"])["bytes_per_particle"] if rows else None


def largest(results, n):
    """Peak memory of that row of B3 [GB]."""
    for row in results.get("large", []):
        if row["particles"] == n ** 3 and row["ranks"] == 2 and row.get("peak_bytes"):
            return row["peak_bytes"] / 1e9
    return None


def frame(results):
    rows = [r for r in results.get("output", []) if r["particles"] >= 1e6 and r.get("raw_hdf5")]
    return max((r["s_per_frame"] / r["raw_hdf5"] for r in rows), default=None)


def table(results):
    """[(figure, target, measured or None, holds or None)]."""
    eigen = best(peer(results, name, "B1", 0.01) for name in ("Eigen CG + Jacobi", "Eigen CG + IncompleteCholesky"))
    free = [r for r in results.get("without_factors", []) if "peak_bytes" in r]
    free = max(free, key=lambda r: r["particles"])["bytes_per_particle"] if free else None
    def million(x):
        return x / 1e6 if x else None
    def over_full(h):
        return ratio(step(results, "B1", h, 1, "full"), step(results, "B1", h, 1))
    entries = [
        ("B1, h = 0.01, 1 rank: faster than the full AIJ with GMRES + ILU", ">=", 20, over_full(0.01), "x"),
        ("B1, h = 0.1, 1 rank: faster than the full AIJ with GMRES + ILU", ">=", 75, over_full(0.1), "x"),
        ("B1, h = 0.01, 1 rank: faster than the best Eigen CG", ">=", 5, ratio(eigen, step(results, "B1", 0.01, 1)), "x"),
        ("B1, h = 0.01: 2 ranks over 1", ">=", 1.5, ratio(step(results, "B1", 0.01, 1), step(results, "B1", 0.01, 2)), "x"),
        ("B2, h = 0.01, default options: converges without a rejected step (1: yes)", ">=", 1, converged(results, 0.01), ""),
        ("B2, h = 0.1, default options: converges without a rejected step (1: yes)", ">=", 1, converged(results, 0.1), ""),
        ("B2, h = 0.01: faster than the symplectic loop, per simulated second", ">=", 6, loop_against(results, 0.01), "x"),
        ("B2, h = 0.1: faster than the symplectic loop, per simulated second", ">=", 45, loop_against(results, 0.1), "x"),
        ("assembly of S, one core", ">=", 60, million(kernel(results, "assembly of S")), "million springs/s"),
        ("assembly of the 2dN AIJ, one core", ">=", 10, million(kernel(results, "assembly of the 2dN AIJ")), "million springs/s"),
        ("forces, one core", ">=", 150, million(kernel(results, "force")), "million springs/s"),
        ("peak memory, default options, largest B1 on one rank", "<=", 2900, memory(results), "bytes/particle"),
        ("peak memory, largest B1 without factors", "<=", 1500, free, "bytes/particle"),
        ("B3, n = 160, 2 ranks: peak memory of a step", "<=", 24, largest(results, 160), "GB"),
        ("10^7 particles without factors, 2 ranks: peak memory of a step", "<=", 24, largest(results, 216), "GB"),
        (spread(results)[0], "<=", 1.5, spread(results)[1], "x"),
        ("a frame of 10^6 particles over the raw collective HDF5 write", "<=", 1.3, frame(results), "x"),
    ]
    out = []
    for figure, sense, bound, measured, unit in entries:
        known = measured is not None and math.isfinite(measured)
        holds = (measured >= bound if sense == ">=" else measured <= bound) if known else None
        out.append((figure, f"{sense} {bound:g} {unit}".strip(), measured if known else None, holds))
    return out
