"""Orders of convergence, parallel efficiency, and the tables that show them."""
from dataclasses import dataclass, field

import numpy as np

MARGIN = 10.0  # errors closer than this factor to the reference's own error say nothing about the order


@dataclass
class Series:
    """The points that differ only in one option, by its value."""
    label: str
    x: np.ndarray                    # values of that option, descending
    rows: list
    error: np.ndarray = None         # nan where there is none
    order: float = np.nan            # fitted
    used: np.ndarray = field(default=None)   # which points the fit used


def number(value):
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def numeric_axes(rows, names):
    """Those of `names` whose values are numbers, at least two different ones."""
    return [n for n in names if all(number(r.get(n)) is not None for r in rows if n in r)
            and len({number(r.get(n)) for r in rows if n in r}) > 1]


def series_of(rows, names, against):
    """Series of the finished rows; `names` are the axes."""
    groups = {}
    for row in rows:
        if row["status"] == "ok" and number(row.get(against)) is not None:
            key = tuple((n, row[n]) for n in names if n != against and n in row)
            groups.setdefault(key, []).append(row)
    found = []
    for key, members in groups.items():
        members.sort(key=lambda r: -number(r[against]))
        label = " ".join(f"{k}={v}" for k, v in key) or "all"
        found.append(Series(label, np.array([number(r[against]) for r in members]), members))
    return found


def fit_order(x, error, own=None):
    """p of error = C x^p by least squares in logarithms; of error = C |x^p - own^p| if the reference is the run with
    x = own of the same series. nan from fewer than two points."""
    x, error = np.asarray(x, float), np.asarray(error, float)
    if len(x) < 2 or not np.all(error > 0):
        return np.nan
    if own is None:
        return float(np.polyfit(np.log(x), np.log(error), 1)[0])
    from scipy.optimize import minimize_scalar

    def spread(p):
        return np.var(np.log(error) - np.log(np.abs(x ** p - own ** p)))
    return float(minimize_scalar(spread, bounds=(0.05, 12), method="bounded", options={"xatol": 1e-6}).x)


def fit(series, column, reference=None, floor=0.0):
    """Fills error, used and order of every series. reference: name of the point that is the reference, or None;
    floor: the reference's own error."""
    for s in series:
        s.error = np.array([np.nan if number(r.get(column)) is None else number(r.get(column)) for r in s.rows])
        own = [v for v, r in zip(s.x, s.rows) if r["point"] == reference]
        with np.errstate(invalid="ignore"):
            s.used = np.isfinite(s.error) & (s.error > (0.0 if own else MARGIN * floor))
        s.order = fit_order(s.x[s.used], s.error[s.used], own[0] if own else None)


def efficiency(rows, base):
    """Work done per rank and second, relative to the row `base`: (N/(p t)) / (N0/(p0 t0)). For one N this is strong
    scaling's t0 p0/(t p), for N growing with p weak scaling's t0/t."""
    def rate(row):
        size = row.get("unknowns") or 1
        return size / (row["ranks"] * row["wall"])
    return [rate(r) / rate(base) for r in rows]


def scaling_series(rows, names):
    """Series over the number of ranks. A size that changes with the ranks is no axis of its own."""
    finished = [r for r in rows if r["status"] == "ok" and r.get("wall")]
    fixed = [n for n in names if n != "np"]
    for together in list(fixed):  # zipped with np: its value follows from np
        pairs = {(r["ranks"], r.get(together)) for r in finished}
        values = {r.get(together) for r in finished}
        if len(pairs) == len({r["ranks"] for r in finished}) and len(values) > 1:
            fixed.remove(together)
    groups = {}
    for row in finished:
        groups.setdefault(tuple((n, row.get(n)) for n in fixed), []).append(row)
    return {" ".join(f"{k}={v}" for k, v in key) or "all": sorted(g, key=lambda r: r["ranks"])
            for key, g in groups.items() if len({r["ranks"] for r in g}) > 1}


# ---- tables ---------------------------------------------------------------------------------------------------------
def show(value):
    if value is None or value == "" or (isinstance(value, float) and np.isnan(value)):
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def table(header, lines):
    """Columns aligned, the first to the left, the others to the right."""
    cells = [[show(c) for c in line] for line in [header] + lines]
    width = [max(len(line[k]) for line in cells) for k in range(len(header))]
    return "\n".join("  ".join(c.ljust(w) if k == 0 else c.rjust(w) for k, (c, w) in enumerate(zip(line, width))).rstrip()
                     for line in cells)


def points_table(rows, names, column):
    header = ["point"] + ["status", "steps", "rejected", "newton", "krylov", "wall [s]", "warnings"] + ([column] if column else [])
    return table(header, [[" ".join(f"{n}={r[n]}" for n in names if n in r) or "as given", r["status"]]
                          + [r.get(k) for k in ("steps", "rejected", "newton", "krylov", "wall", "warnings")]
                          + ([r.get(column)] if column else []) for r in rows])


def orders_table(series, against):
    values = sorted({v for s in series for v in s.x}, reverse=True)
    lines = []
    for s in series:
        known = dict(zip(s.x, s.error))
        lines.append([s.label] + [known.get(v) for v in values] + [f"{s.order:.2f}" if np.isfinite(s.order) else "-"])
    return table([f"{against} ="] + [f"{v:g}" for v in values] + ["order"], lines)


def scaling_table(groups):
    lines = []
    for label, rows in groups.items():
        for r, e in zip(rows, efficiency(rows, rows[0])):
            lines.append([label, r["ranks"], r.get("unknowns"), r["wall"], rows[0]["wall"] / r["wall"], e])
    return table(["scaling", "ranks", "unknowns", "wall [s]", "t(first)/t", "efficiency"], lines)
