"""Loops over springs: springs/s, each counted once, and the share of STREAM's bandwidth the least traffic takes."""
import json
import tempfile
import pathlib

import cases
from running import Failed, execute, program

# What is measured: (name, log event, run that exercises it, least bytes of one call as a function of particles N and
# springs B). Least bytes: every number that must be read or written, once. A spring is K, L and two indices; position,
# force and mass are of each particle. S by default is four floats a spring and a 3 x 3 block of doubles a particle, its
# factors are 3 x 3 blocks of floats, read forward and backward; SBAIJ and AIJ hold doubles.
KERNELS = [
    ("force", "BSForces", "explicit", lambda N, B: 24 * B + 56 * N),
    ("assembly of S", "BSCondense", "default", lambda N, B: (24 + 16) * B + (32 + 72) * N),
    ("assembly of S, SBAIJ", "BSCondense", "sbaij", lambda N, B: (24 + 72) * B + (32 + 72) * N),
    ("assembly of the 2dN AIJ", "BSJacobian", "full", lambda N, B: (24 + 2 * 144) * B + (32 + 288) * N),
    ("product with S", "BSProduct", "default", lambda N, B: 20 * B + (72 + 48) * N),
    ("product with S, SBAIJ", "MatMult", "sbaij", lambda N, B: 76 * B + (76 + 48) * N),
    ("product with the 2dN AIJ", "MatMult", "full", lambda N, B: 12 * 36 * B + (12 * 36 + 96) * N),
    ("triangular solves of ICC", "BSTriangles", "default", lambda N, B: 2 * 40 * B + (2 * 36 + 48) * N),
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
            "sbaij": dict(cases.problem("B1", n, 0.01, 2), condensed_pc_type="icc"),
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
    rows, before = [], triad(context)
    for kernel, event, which, least in KERNELS:
        if which not in done or not all(event in events for events in done[which]):
            rows.append({"kernel": kernel, "failed": f"{event} was not logged"})
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
