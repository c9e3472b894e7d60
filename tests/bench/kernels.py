"""Loops over springs: springs/s, each counted once, and the share of STREAM's bandwidth the least traffic takes."""
import json
import tempfile
import pathlib

import cases
from running import Failed, execute, program

# What is measured: (name, log events of which the first that was logged counts, run that exercises it, least bytes of
# one call as a function of particles N and springs B). Least bytes: every number that must be read or written, once.
# A spring is K, L and two indices; position, force and mass are of each particle; blocks are 3 x 3 of 8 bytes.
KERNELS = [
    ("force", ["BSForces"], "explicit", lambda N, B: 24 * B + 56 * N),
    ("assembly of S", ["BSCondense", "BSCondensed", "BSAssembleS"], "default", lambda N, B: (24 + 72) * B + (32 + 72) * N),
    ("assembly of the 2dN AIJ", ["BSJacobian"], "full", lambda N, B: (24 + 2 * 144) * B + (32 + 288) * N),
    ("product with S", ["BSProduct", "BSApplyS", "MatMult S"], "default", lambda N, B: 76 * B + 124 * N),
    ("product with the 2dN AIJ", ["MatMult"], "full", lambda N, B: 12 * 36 * B + (12 * 36 + 96) * N),
]


def triad(context):
    """STREAM's triad [bytes/s] of one core; None where it could not be measured."""
    with tempfile.TemporaryDirectory(dir=context.scratch) as folder:
        try:
            out, _, _ = execute([context.peers / "triad", "--elements", context.triad_elements], 1, context.budget.limit(), pathlib.Path(folder))
            return json.loads(out)["bytes_per_s"]
        except (Failed, OSError) as why:
            context.say(f"triad: {why}")
            return None


def runs(context):
    n = context.n
    short = cases.problem("B1", n, 1e-6, 5)
    # in a very short step the mass rules: one sweep of Jacobi solves, what is timed is assembly and product
    return {"explicit": dict(cases.problem("B1", n, 1e-5, 50), ts_type="symplectic", bs_advise=0),
            "default": cases.problem("B1", n, 0.01, context.steps),
            "full": dict(short, mat_type="aij", ksp_type="gmres", pc_type="jacobi")}


def run(context):
    """{triad, rows}: rows {kernel, event, calls, s_per_call, springs_per_s, least_bytes, share_of_triad}."""
    N, B = cases.particles(context.n), cases.springs(context.n)
    done = {}
    for name, options in runs(context).items():
        try:
            done[name] = [program(context, options)["events"] for _ in range(context.repeats)]
        except Failed as why:
            context.say(f"kernels, {name} run: {why}")
    before = triad(context)
    rows = []
    for kernel, candidates, which, least in KERNELS:
        event = next((e for e in candidates if all(e in events for events in done.get(which, [{}]))), None)
        if event is None:
            rows.append({"kernel": kernel, "failed": f"none of the events {', '.join(candidates)} was logged"})
            continue
        times = sorted(events[event]["time"] / events[event]["count"] for events in done[which])
        each = times[len(times) // 2]
        rows.append({"kernel": kernel, "event": event, "calls": done[which][0][event]["count"], "s_per_call": each,
                     "springs_per_s": B / each, "least_bytes": least(N, B)})
        context.say(f"{kernel}: {B / each / 1e6:.1f} million springs/s")
    after = triad(context)
    best = max(filter(None, (before, after)), default=None)
    for row in rows:
        if best and "s_per_call" in row:
            row["share_of_triad"] = row["least_bytes"] / row["s_per_call"] / best
    return {"triad": best, "triad_before_after": [before, after], "rows": rows}
