"""Implicit steps of B1 and B2 on one and two ranks, on default options and on the full Jacobian."""
import cases
from running import steps_row


def run(context):
    """[rows]; default options at both steps, the full matrix with GMRES + ILU beside them."""
    n, rows = context.n, []
    count = cases.particles(n)
    for name, h in (("B1", 0.01), ("B1", 0.1), ("B2", 0.01), ("B2", 0.1)):
        for ranks in context.ranks:
            options = cases.problem(name, n, h, context.steps)
            rows.append(dict(steps_row(context, f"{name} n={n} h={h:g}", options, ranks, count, output=True), case=name, solver="default"))
    for name, h, ranks_list in (("B1", 0.01, context.ranks), ("B1", 0.1, context.ranks[:1]), ("B2", 0.01, context.ranks[:1])):
        for ranks in ranks_list:
            options = dict(cases.problem(name, n, h, context.steps if h < 0.1 and name == "B1" else 1), **cases.FULL[min(ranks, 2)])
            rows.append(dict(steps_row(context, f"{name} n={n} h={h:g}, full AIJ, GMRES + ILU", options, ranks, count, output=True,
                                       repeats=1), case=name, solver="full"))
    return rows


def check(rows, n):
    """[(what, deviation [m], allowed, holds)]: the last particle against the known position, or among the runs."""
    found = [row for row in rows if row.get("last") and row["case"] == "B1" and row["h"] == cases.CHECK_H and row["steps"] == cases.CHECK_STEPS]
    known = cases.CHECK_POSITION if n == cases.CHECK_N else (found[0]["last"] if found else None)
    out = []
    for row in found:
        off = max(abs(a - b) for a, b in zip(row["last"], known))
        out.append((f"{row['label']}, {row['ranks']} rank(s): last particle", off, cases.CHECK_TOLERANCE, off <= cases.CHECK_TOLERANCE))
    return out
