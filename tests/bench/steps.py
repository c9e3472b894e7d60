"""Implicit steps of B1 and B2 on one and two ranks, on default options and on the full Jacobian."""
import cases
from running import steps_row


def run(context):
    """[rows]: default options at both steps, the full matrix with GMRES + ILU beside them."""
    cells = [("B1", 0.01, "default"), ("B1", 0.1, "default"), ("B2", 0.01, "default"), ("B2", 0.1, "default"), ("B1", 0.01, "full"), ("B1", 0.1, "full")]
    rows = [row_of(context, *cell, ranks) for ranks in context.ranks for cell in cells if ranks == context.ranks[0] or cell != ("B1", 0.1, "full")]
    return rows + [row_of(context, "B2", 0.01, "full", context.ranks[0])]


def row_of(context, case, h, solver, ranks):
    full = solver == "full"
    options = cases.problem(case, context.n, h, 1 if full and (case, h) != ("B1", 0.01) else context.steps)
    if full:
        options.update(cases.FULL[min(ranks, 2)])
    label = f"{case} n={context.n} h={h:g}" + (", full AIJ, GMRES + ILU" if full else "")
    row = steps_row(context, label, options, ranks, cases.particles(context.n), output=True, repeats=1 if full else None)
    return dict(row, case=case, solver=solver)


def check(rows, n):
    """[(what, deviation [m], allowed, holds)]: the last particle against the known position, or among the runs."""
    found = [row for row in rows if row.get("last") and row["case"] == "B1" and row["h"] == cases.CHECK_H and row["steps"] == cases.CHECK_STEPS]
    known = cases.CHECK_POSITION if n == cases.CHECK_N else (found[0]["last"] if found else None)
    out = []
    for row in found:
        off = max(abs(a - b) for a, b in zip(row["last"], known))
        out.append((f"{row['label']}, {row['ranks']} rank(s): last particle", off, cases.CHECK_TOLERANCE, off <= cases.CHECK_TOLERANCE))
    return out
