"""How the cost of a step grows: with ranks at one share each, and with the size."""
import cases
from running import steps_row

MEMORY_PER_PARTICLE = 2600  # bytes, what a run is assumed to need when it is decided whether it fits


def free_memory():
    """Bytes the system says a program may still take."""
    with open("/proc/meminfo") as f:
        for line in f:
            if line.startswith("MemAvailable"):
                return 1024 * int(line.split()[1])
    return 0


def row_of(context, label, n, h, ranks, layers=None, repeats=None):
    count = cases.particles(n, layers)
    if MEMORY_PER_PARTICLE * count > free_memory():
        context.say(f"{label}: needs more memory than there is")
        return {"label": label, "ranks": ranks, "particles": count, "h": h, "failed": "needs more memory than there is"}
    row = steps_row(context, label, cases.problem("B1", n, h, context.steps, layers), ranks, count, repeats=repeats)
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
    """B3: one backward Euler step of 0.01 s of the largest sizes, which h omega_max makes harder with n."""
    rows = []
    for n in context.large:
        row = {"label": f"B3 n={n}", "ranks": context.ranks[-1], "particles": cases.particles(n), "failed": "needs more memory than there is"}
        if MEMORY_PER_PARTICLE * cases.particles(n) < free_memory():
            row = steps_row(context, f"B3 n={n} h=0.01", cases.problem("B1", n, 0.01, 1), context.ranks[-1], cases.particles(n), repeats=1)
        rows.append(row)
    return rows
