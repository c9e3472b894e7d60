"""Results of a study over one of its options, averaged over another (seeds): means with standard errors, averages.csv, a diagram of each column."""
import csv
import os

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

import study_orders as orders  # noqa: E402
from backspring_io import RunError  # noqa: E402
from figure_layout import settle  # noqa: E402
from figure_style import COLORS, STYLE, axis_label, key  # noqa: E402
from run_data import TENSOR  # noqa: E402

MARKS = "osD^vP*X"


def isotropic_moduli(stiffness):
    """(bulk, shear modulus) of a stiffness (q, q) averaged over all directions (Voigt); None in one dimension."""
    d = {3: 2, 6: 3}.get(len(stiffness))
    if d is None:
        return None
    c = np.asarray(stiffness, float)
    normal, across, shears = np.trace(c[:d, :d]), c[:d, :d].sum() - np.trace(c[:d, :d]), np.trace(c[d:, d:])
    if d == 2:
        return (normal + across) / 4, ((normal - across) / 4 + shears) / 2
    return (normal + across) / 9, (normal - across / 2 + 3 * shears) / 15


def add_moduli(rows):
    """bulk_modulus and shear_modulus of the rows with a stiffness [N/m^(d-1)]."""
    for row in rows:
        for d, names in TENSOR.items():
            values = [[row.get(f"stiffness_{a}_{b}") for b in names] for a in names]
            found = None if any(orders.number(v) is None for line in values for v in line) else isotropic_moduli(values)
            if found and len([k for k in row if k.startswith("stiffness_")]) == len(names) ** 2:
                row["bulk_modulus"], row["shear_modulus"] = found


def averages(rows, names, against, over, column):
    """{label: [(x, mean, standard error, count)]} of the finished rows, x ascending: one series for every setting of the other axes. The standard error is NaN of a
    single row."""
    found = {}
    for series in orders.series_of(rows, [n for n in names if n != over], against):
        points = []
        for x in sorted(set(series.x)):
            values = [orders.number(r.get(column)) for r in series.rows if orders.number(r[against]) == x]
            values = np.array([v for v in values if v is not None and np.isfinite(v)])
            if len(values):
                points.append((x, values.mean(), values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan, len(values)))
        if points:
            found[series.label] = points
    return found


def _picture(path, found, column, unit, label, moved):
    """Means with their standard errors over `against`."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(4.6, 3.4))
        for k, (name, points) in enumerate(found.items()):
            x, mean, error, count = np.transpose(points)
            ax.errorbar(moved(x), mean, np.nan_to_num(error), fmt=MARKS[k % len(MARKS)] + "-", ms=4.5, lw=1.0, capsize=2.5, color=COLORS[k % len(COLORS)], mfc="white", mew=1.1,
                        label=(name + ", " if name != "all" else "") + (f"{int(count.min())} to {int(count.max())} runs" if count.min() < count.max() else f"{int(count[0])} runs") + " each")
        ax.axhline(0, color="#999999", lw=0.6)
        ax.set_xlabel(label)
        ax.set_ylabel(axis_label(column.replace("_", " "), unit))
        key(ax)
        settle(figure)
        figure.savefig(path, dpi=200, facecolor="white", bbox_inches="tight", pad_inches=0.06)
        plt.close(figure)
    return path


def unit_of(column, rows):
    """N/m or Pa for moduli; nothing is known of other columns."""
    if "modulus" not in column and not column.startswith("stiffness_"):
        return ""
    return "Pa" if any("stiffness_zz_zz" in row for row in rows) else "N/m"


def report(plan, rows, ending):
    """Prints the means of the columns of plan["show"] and writes averages.csv and a diagram of each; their paths. plan["complement"]: over 1 - x."""
    folder, against, over = plan["output"], plan["against"], plan["average"]
    if over and over not in plan["names"]:
        raise RunError(f"--average {over}: no varied option; there are {', '.join(plan['names'])}")
    if not against or against == over:
        raise RunError("--show needs a varied option with numbers, named by --against")
    unknown = [c for c in plan["show"] if not any(c in row for row in rows)]
    if unknown:
        raise RunError(f"--show {unknown[0]}: no such column; see study.csv")
    name, moved = (f"1-{against}", lambda x: 1 - x) if plan["complement"] else (against, lambda x: x)
    made, lines = [], []
    for column in plan["show"]:
        found = averages(rows, plan["names"], against, over, column)
        lines += [[column, label, moved(x), mean, error, count] for label, points in found.items() for x, mean, error, count in points]
        made.append(_picture(os.path.join(folder, f"{column}.{ending}"), found, column, unit_of(column, rows), plan["label"] or name.replace("1-", "1 - "), moved))
    header = ["column", "series", name, "mean", "standard_error", "runs"]
    path = os.path.join(folder, "averages.csv")
    with open(path + ".part", "w", newline="", encoding="utf-8") as f:
        csv.writer(f).writerows([header] + lines)
    os.replace(path + ".part", path)
    print("\n" + orders.table([header[0], *header[2:]] if {line[1] for line in lines} == {"all"} else header,
                              [[line[0], *line[2:]] if {other[1] for other in lines} == {"all"} else line for line in lines]))
    return [path] + made
