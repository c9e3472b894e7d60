"""What all diagrams share: colours, line styles, letters, labels."""
import matplotlib
import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullLocator

from backspring_io import RunError
matplotlib.use("Agg")

ROUNDING = 1e-12  # of what a quantity could be: less than this share of it is rounding, and drawn as 0

COLORS = ["#1f5fa8", "#c8452e", "#3a8f5a", "#8a5aa8", "#c98a1b", "#4aa3b8", "#7a7a7a", "#b8477f"]
DASHES = ["-", (0, (4, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5))]
STYLE = {"font.size": 9, "axes.labelsize": 9, "axes.titlesize": 9, "legend.fontsize": 8, "xtick.labelsize": 8,
         "ytick.labelsize": 8, "axes.linewidth": 0.7, "lines.linewidth": 1.3, "axes.spines.top": False,
         "axes.spines.right": False, "xtick.direction": "out", "ytick.direction": "out", "legend.frameon": False,
         "axes.grid": True, "grid.color": "#e4e4e4", "grid.linewidth": 0.6, "axes.axisbelow": True,
         "axes.formatter.limits": (-3, 4), "axes.formatter.use_mathtext": True, "svg.fonttype": "none",
         "pdf.fonttype": 42, "mathtext.fontset": "dejavusans"}


def written(unit):
    """A unit as it is written in pictures."""
    return "Å" if unit.lower() == "angstrom" else unit


def number(value, form=".4g"):
    """A number in words of a picture as axes have theirs: in figures below 100 000, with a power of ten above and where it is very small."""
    text = f"{value:{form}}"
    mantissa, exponent, power = text.partition("e")
    if not exponent or 0 <= int(power) < 5:
        return (f"{float(text):.0f}" if exponent else text).replace("-", "−")
    factor = {"1": "", "-1": "-"}.get(mantissa, mantissa + r"\times")
    return f"${factor}10^{{{int(power)}}}$"


def cleared(strains):
    """Strains, or zeros where they are nothing but rounding."""
    return strains if np.nanmax(np.abs(strains), initial=0.0) > ROUNDING else 0.0 * strains


def few_powers(axis, top=np.inf):
    """Ticks of a logarithmic axis up to `top` in figures, 1, 2 and 5 times powers of ten or closer, where these are too few to tell a scale; elsewhere nothing changes."""
    low, high = sorted(axis.get_view_interval())
    powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    inside = lambda ticks: [v for v in ticks if low * (1 - 1e-9) <= v <= min(high, top) * (1 + 1e-9)]  # noqa: E731
    if high / low >= 60 and len(inside(powers)) > 1:
        return False
    ticks = inside(np.outer(powers, (1, 2, 5)).ravel())
    ticks = ticks if len(ticks) > 2 else inside(MaxNLocator(5).tick_values(low, min(high, top)))
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FuncFormatter(lambda v, _: number(v, "g")))
    axis.set_minor_locator(NullLocator())
    return True


def bar_beside(bar):
    """The power of ten that the ticks of a colour bar share begins at the bar's left edge, in place of ending at its right, over the scene."""
    bar.outline.set_linewidth(0.5)
    bar.ax.yaxis.set_offset_position("left")


def axis_label(name, unit):
    return f"{name} [{written(unit)}]" if unit else name


def progress_of(run):
    """What the frames of a run follow one another by."""
    return "time" if not run.static else "arc length" if run.parameters.get("bs_load_control") == "arc" else "load factor"


def time_label(runs, of_steps=False):
    """The times of a static analysis are its load factors, the way along a path by arc length, or load factors and the time that motions after breaks have taken, which are
    not among the steps. Raises RunError where runs have no such axis in common."""
    words = progress_of(runs[0])
    for run in runs[1:]:
        if progress_of(run) != words:
            raise RunError(f"{runs[0].path} goes by {words}, {run.path} by {progress_of(run)}: they have no axis in common; plot them one at a time, or together what has no such "
                           "axis: --kind state,histogram, of static analyses --kind force, too")
    if words == "time":
        return axis_label("time $t$", runs[0].unit("time"))
    moved = words == "load factor" and not of_steps and any(list(run.series["load_factor"]) != list(run.observable_times) for run in runs)
    return "progress: load factor + " + axis_label("time in motion", runs[0].unit("time")) if moved else words


def moment(run, row, form=".4g"):
    """Words for the moment of a frame: its time, or in a static analysis its load factor, with the time that motions after breaks have taken by then."""
    if not run.static or row >= len(run.series["load_factor"]):
        return f"$t$ = {number(run.times[row], form)} {run.unit('time')}".rstrip()
    load = run.series["load_factor"][row]
    words, moving = f"load factor {number(load, form)}", run.times[row] - load
    if run.parameters.get("bs_load_control") != "arc" and abs(moving) > 1e-9 * max(abs(load), 1e-3):
        words += f", {number(moving, form)} {run.unit('time')} in motion"
    return words


def missing(ax, what):
    """Says in the panel that the file has no such data; nothing is made up in its place."""
    ax.text(0.5, 0.5, f"no {what} in the file", transform=ax.transAxes, ha="center", va="center", color="#777777")
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(False)


def key(ax, **more):
    """A legend of what has a label; figure_layout moves it to where it covers nothing."""
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="upper left", borderaxespad=0.0, **more).movable = True


def finish(ax, runs, ylabel, of_steps=False, **legend):
    """Labels of a panel over time, that of frames or of steps, and its legend."""
    ax.set_xlabel(time_label(runs, of_steps))
    if not runs[0].static and runs[0].unit("time") == "s":
        scaled_seconds(ax)
    ax.set_ylabel(ylabel)
    ax.margins(x=0.01)
    key(ax, **legend)


def scaled_seconds(ax):
    """Short times in milliseconds, microseconds or nanoseconds."""
    top = np.abs(ax.xaxis.get_data_interval()).max()
    for unit, factor, below in (("ms", 1e3, 0.02), ("µs", 1e6, 1e-3), ("ns", 1e9, 1e-6)):
        if not 0 < top < below:
            return
        ax.xaxis.set_major_formatter(FuncFormatter(lambda t, _, factor=factor: number(t * factor, ".6g")))
        ax.set_xlabel(axis_label("time $t$", unit))


def short_marks(count):
    """Size and opacity of a point's mark where `count` of them share a panel."""
    return (4.0, 0.9) if count <= 150 else (2.5, 0.7) if count <= 1000 else (1.6, 0.45)


def mark_points(ax, few=10):
    """Marks the points of curves that have fewer than `few`, so that a straight line between two of them is not taken for a result."""
    for line in ax.lines:
        data = line.get_data_3d() if ax.name == "3d" else line.get_data()
        if line.get_transform() == ax.transData and line.get_marker() in ("None", "none", "") and 0 < np.isfinite(np.array(data, float)).all(axis=0).sum() < few:
            line.set(marker="o", markersize=3.5)


def width(i, several):
    """Line width of run i: of several, later ones are thinner, so that those they cover can be seen."""
    return max(0.8, 2.0 - 0.5 * i) if several else 1.5


def enlarged(deform):
    """Words for displacements that are drawn larger than they are."""
    return f", displacements × {number(deform, 'g')}" if deform is not None and deform != 1 else ""
