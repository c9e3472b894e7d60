"""Diagrams of a study: error over step, error over cost, time over ranks."""
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.ticker import FuncFormatter, NullFormatter  # noqa: E402

from figure_layout import settle  # noqa: E402
from figure_style import COLORS, STYLE, key  # noqa: E402
from study_orders import efficiency  # noqa: E402

MARKS = "osD^vP*X"
UNITS = {"ts_dt": "step $h$ [s]", "wall": "wall-clock time [s]", "krylov": "Krylov iterations", "steps": "steps"}


def _save(figure, path, dpi=200):
    settle(figure)
    figure.savefig(path, dpi=dpi, facecolor="white", bbox_inches="tight", pad_inches=0.06)
    plt.close(figure)
    return path


def _decades(axis):
    """Labels at 1, 2, 5 times powers of ten where the axis spans less than two decades."""
    low, high = axis.get_view_interval()
    if high / low < 60:
        axis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        axis.set_minor_formatter(NullFormatter())


def short(label):
    return label.replace("ts_type=", "").replace("=", " ")


def _pretty(column):
    words = column.split("_")  # error_position_rms
    how = {"rms": "rms", "max": "largest", "worst": "largest over time"}.get(words[-1], words[-1])
    unit = {"position": " [m]", "velocity": " [m/s]"}.get(words[1], "")
    return f"{words[1]} error, {how}{unit}"


def convergence(series, against, column, path, floor=0.0):
    """Errors over the step with the fitted powers."""
    with plt.rc_context(STYLE):
        figure, ax = plt.subplots(figsize=(4.6, 3.4))
        for k, s in enumerate(series):
            color = COLORS[k % len(COLORS)]
            good = np.isfinite(s.error) & (s.error > 0)
            text = short(s.label) + (f", order {s.order:.2f}" if np.isfinite(s.order) else "")
            ax.plot(s.x[good], s.error[good], MARKS[k % len(MARKS)], color=color, ms=5, mfc="white", mew=1.2, label=text, zorder=3)
            if np.isfinite(s.order) and s.used.sum() > 1:
                x, e = s.x[s.used], s.error[s.used]
                c = np.exp(np.mean(np.log(e) - s.order * np.log(x)))
                ends = np.array([x.min() / 1.15, x.max() * 1.15])
                ax.plot(ends, c * ends ** s.order, color=color, lw=1.1)
        if floor > 0:
            ax.axhline(floor, color="#999999", lw=0.8, ls=(0, (4, 2)), label="reference's own error, estimated")
        ax.set_xscale("log")
        ax.set_yscale("log")
        _decades(ax.xaxis)
        ax.set_xlabel(UNITS.get(against, against))
        ax.set_ylabel(_pretty(column))
        key(ax)
        return _save(figure, path)


def work_precision(series, column, path):
    """Errors over what they cost, in seconds and in linear iterations (steps where there are none): lower and further
    left is better."""
    iterations = "krylov" if all((r.get("krylov") or 0) > 0 for s in series for r in s.rows) else "steps"
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(7.2, 3.1), constrained_layout=True, sharey=True)
        for ax, cost in zip(axes, ("wall", iterations)):
            for k, s in enumerate(series):
                w = np.array([float(r.get(cost) or np.nan) for r in s.rows])
                good = np.isfinite(s.error) & (s.error > 0) & (w > 0)
                ax.plot(w[good], s.error[good], MARKS[k % len(MARKS)] + "-", color=COLORS[k % len(COLORS)], ms=5, mfc="white",
                        mew=1.2, lw=1.1, label=short(s.label))
            ax.set_xscale("log")
            ax.set_yscale("log")
            _decades(ax.xaxis)
            ax.set_xlabel(UNITS.get(cost, cost))
        axes[0].set_ylabel(_pretty(column))
        key(axes[1])
        return _save(figure, path)


def scaling(groups, path):
    """Wall-clock time and efficiency over the number of ranks."""
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(7.0, 3.0), constrained_layout=True)
        for k, (label, rows) in enumerate(groups.items()):
            color, mark = COLORS[k % len(COLORS)], MARKS[k % len(MARKS)]
            ranks, wall = np.array([r["ranks"] for r in rows]), np.array([r["wall"] for r in rows])
            size = np.array([r.get("unknowns") or 1 for r in rows], float)
            left.plot(ranks, wall, mark + "-", color=color, ms=5, mfc="white", mew=1.2, label=label if label != "all" else "measured")
            left.plot(ranks, wall[0] * (size / size[0]) * ranks[0] / ranks, color=color, lw=0.8, ls=(0, (4, 2)),
                      label="ideal" if k == len(groups) - 1 else None)
            right.plot(ranks, efficiency(rows, rows[0]), mark + "-", color=color, ms=5, mfc="white", mew=1.2)
        every = sorted({r["ranks"] for rows in groups.values() for r in rows})
        for ax in (left, right):
            ax.set_xscale("log", base=2)
            ax.set_xticks(every)
            ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            ax.xaxis.set_minor_formatter(NullFormatter())
            ax.set_xlabel("ranks")
        left.set_yscale("log")
        _decades(left.yaxis)
        left.set_ylabel("wall-clock time [s]")
        key(left)
        right.axhline(1, color="#999999", lw=0.8, ls=(0, (4, 2)))
        right.set_ylim(0, max(1.1, right.get_ylim()[1]))
        right.set_ylabel("parallel efficiency")
        return _save(figure, path)
