"""Panels of the step log: step sizes with rejections, Newton and Krylov counts."""
import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

from figure_style import COLORS, axis_label, few_powers, finish, missing, short_marks, width


def steps(ax, runs, labels, args):
    """Step size, one value a step; a cross where attempts were rejected before the step succeeded."""
    logged = [(i, run.log) for i, run in enumerate(runs) if "dt" in run.log and "time" in run.log and len(run.log["dt"])]
    if not logged:
        return missing(ax, "log of steps")
    several, crossed = len(runs) > 1, False
    for i, log in logged:
        color = COLORS[i % len(COLORS)]
        ax.plot(log["time"], log["dt"], color=color, lw=width(i, True) if several else 1.0, drawstyle="steps-pre")
        rejected = np.asarray(log.get("rejected", np.zeros(len(log["dt"])))) > 0
        if rejected.any():
            ax.plot(log["time"][rejected], log["dt"][rejected], "x", color=color if several else COLORS[1], ms=3.5, mew=0.8, zorder=3, clip_on=False,
                    label=None if crossed else "after rejected attempts" + ("" if several else _reasons(log)))
            crossed = True
    dts = np.concatenate([log["dt"] for _, log in logged])
    positive = dts[dts > 0]
    if len(positive) and positive.max() > 20 * positive.min():
        ax.set_yscale("log")
        ax.set_ylim(positive.min() / 1.5, positive.max() * 1.5)
        few_powers(ax.yaxis)
    else:
        ax.set_ylim(0, 1.15 * max(dts.max(), 1e-300))
    finish(ax, runs, "load step" if runs[0].static else axis_label("step size", runs[0].unit("time")), of_steps=True)


def steps_vary(run):
    """Whether the log of steps has more to say than one step size; the last step may be cut at the end."""
    dt = run.log.get("dt", np.zeros(0))
    return bool(np.any(run.log.get("rejected", 0))) or len(dt) > 2 and np.ptp(dt[:-1]) > 1e-6 * dt.max()


def iterated(run):
    """Whether the number of iterations differs from step to step."""
    return any(len(count) and np.ptp(count) > 0 for count in (run.log.get(name, ()) for name in ("newton", "krylov")))


def _reasons(log):
    """" (10 error, 2 newton)", or their number alone where the log gives no reasons."""
    reasons = {k[len("rejected_"):].replace("_", " "): int(np.sum(v)) for k, v in log.items() if k.startswith("rejected_")}
    told = ", ".join(f"{count} {name}" for name, count in reasons.items() if count)
    return f" ({told or int(np.sum(log['rejected']))})"


def iterations(ax, runs, labels, args):
    """Newton (discs) and Krylov iterations (rings) of every step; one kind where both counts are the same (a direct solver)."""
    logged = [(i, run.log) for i, run in enumerate(runs) if "time" in run.log and np.any(run.log.get("newton", 0) + run.log.get("krylov", 0))]
    if not logged:
        return missing(ax, "iterations")
    several, top, low = len(runs) > 1, 0, np.inf
    same = all(np.array_equal(log["newton"], log["krylov"]) for _, log in logged if "newton" in log and "krylov" in log)
    for i, log in logged:
        size, opacity = short_marks(len(log["time"]))
        for name, color, face in (("newton", COLORS[i % len(COLORS)] if several else COLORS[0], True),
                                  ("krylov", COLORS[i % len(COLORS)] if several else COLORS[1], False)):
            if name not in log or not np.any(log[name] > 0) or (name == "krylov" and same):
                continue
            top, low = max(top, log[name].max()), min(low, log[name][log[name] > 0].min())
            ax.plot(log["time"], np.where(log[name] > 0, log[name], np.nan), "o", ms=size, mew=0 if face else 0.6, alpha=opacity,
                    mfc=color if face else "none", mec=color, clip_on=False)
    if not same:
        for name, face in (("Newton", True), ("Krylov", False)):
            color = "#555555" if several else COLORS[0 if face else 1]
            ax.plot([], [], "o", ms=4, mew=0 if face else 0.8, mfc=color if face else "none", mec=color, label=name)
    if top > 15 * low:
        ax.set_yscale("log")
        ax.set_ylim(low / 1.5, top * 1.5)
        few_powers(ax.yaxis)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    else:
        ax.set_ylim(0, 1.1 * top + 0.5)
        ax.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    finish(ax, runs, "Newton iterations a step" if same else "iterations a step", of_steps=True, ncol=2)
