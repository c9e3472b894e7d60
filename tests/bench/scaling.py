"""How the cost of a step grows: with ranks at one share each, and with the size."""
import cases
from running import steps_row

UNKNOWN_NEED = 5000  # bytes per particle a run is taken to need before one was measured
MANY = 2_000_000  # particles from which two steps are enough to time


def free_memory():
    """Bytes the system says a program may still take."""
    with open("/proc/meminfo") as f:
        for line in f:
            if line.startswith("MemAvailable"):
                return 1024 * int(line.split()[1])
    return 0


def fits(context, count, ranks):
    """Whether `count` particles should fit, by the largest run on so many ranks up to now."""
    seen = context.seen.get(ranks)
    return (seen[1] if seen and seen[0] > 5e4 else UNKNOWN_NEED) * count < free_memory()


def row_of(context, label, n, h, ranks, layers=None, repeats=None):
    count = cases.particles(n, layers)
    if not fits(context, count, ranks):
        context.say(f"{label}: needs more memory than there is")
        return {"label": label, "ranks": ranks, "particles": count, "h": h, "failed": "needs more memory than there is"}
    row = steps_row(context, label, cases.problem("B1", n, h, context.steps if count < MANY else 2, layers), ranks, count, repeats=repeats)
    if "s_per_step" in row:
        row["us_per_particle"] = 1e6 * row["s_per_step"] / count
    return row


def weak(context):
    """n x n x (n ranks) particles: each rank keeps n^3 of them."""
    n = context.n
    return [row_of(context, f"weak {n} x {n} x {n * ranks}", n, 0.01, ranks, n * ranks) for ranks in context.ranks]


def sizes(context):
    """Cost per particle at equal h omega_max, on the largest number of ranks and on one."""
    rows = []
    for n in context.sizes:
        for ranks in context.ranks:
            h = cases.equal_swing(n)
            rows.append(row_of(context, f"size n={n} h={h:.3g}", n, h, ranks, repeats=context.repeats if n <= 64 else 1))
    return rows


def large(context):
    """B3: one backward Euler step of 0.01 s of the largest sizes, which h omega_max makes harder with n; without
    factors, of larger ones still at the h omega_max of n = 40."""
    rows = []
    ranks = context.ranks[-1]
    for edges, solver in ((context.large, {}), (context.large_free, cases.LOW_MEMORY)):
        for n in edges:
            h = cases.equal_swing(n) if solver else 0.01
            label = f"B3 n={n} h={h:.3g}" + (", without factors" if solver else "")
            row = {"label": label, "ranks": ranks, "particles": cases.particles(n), "failed": "needs more memory than there is"}
            if fits(context, cases.particles(n), ranks):
                row = steps_row(context, label, dict(cases.problem("B1", n, h, 1), **solver), ranks, cases.particles(n), repeats=1)
            else:
                context.say(f"{label}: needs more memory than there is")
            rows.append(row)
    return rows


def without_factors(context):
    """B1 with point-block Jacobi, and the largest of the sizes for its memory."""
    rows = []
    for n in sorted({context.n, max(context.sizes)}):
        for ranks in context.ranks if n == context.n else context.ranks[:1]:
            h = cases.equal_swing(n)
            options = dict(cases.problem("B1", n, h, context.steps if n == context.n else 1), **cases.LOW_MEMORY)
            rows.append(steps_row(context, f"B1 n={n} h={h:.3g}, without factors", options, ranks, cases.particles(n), repeats=1))
    return rows
