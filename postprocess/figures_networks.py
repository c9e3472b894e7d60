"""Panels of disordered networks: sizes of avalanches, displacements that are not affine."""
import numpy as np
from matplotlib.collections import LineCollection

from backspring_io import RunError
from figure_style import COLORS, axis_label, bar_beside, few_powers, key, missing, moment, number, progress_of, time_label, width
from figures_stress import box_strains
from run_data import TENSOR, counted
from scene import sample


def avalanche_sizes(run):
    """(A,): how many springs broke in each avalanche, in order; None in a file without breaks."""
    numbers = run._array("/events/broken/avalanche")
    if numbers is None or not len(numbers):
        return None
    return np.unique(numbers, return_counts=True)[1]


def log_bins(largest):
    """First sizes of the bins 1, 2, 3-4, 5-8, 9-16, ..., and the one behind the last."""
    edges, last = [1], 1
    while edges[-1] <= largest:
        edges.append(last + 1)
        last *= 2
    return np.array(edges)


def distribution(sizes):
    """(sizes (B,), P (B,)): share of the avalanches at each size s, in bins of growing width; the size of a bin is the geometric mean of its first and last."""
    edges = log_bins(sizes.max())
    count = np.histogram(sizes, edges - 0.5)[0]
    full = count > 0
    return np.sqrt(edges[:-1] * (edges[1:] - 1.0))[full], (count / np.diff(edges) / len(sizes))[full]


def avalanches(ax, runs, labels, args):
    """How often avalanches of each size are, in logarithmic bins; of several runs (seeds, say) all together, each run faintly beside it."""
    found = [(i, sizes) for i, sizes in ((i, avalanche_sizes(run)) for i, run in enumerate(runs)) if sizes is not None]
    if not found:
        return missing(ax, "springs that broke")
    together = np.concatenate([sizes for _, sizes in found])
    if len(found) > 1:
        for i, sizes in found:
            ax.plot(*distribution(sizes), "o", ms=3, mew=0, alpha=0.6, color=COLORS[i % len(COLORS)])
    ax.plot(*distribution(together), "o-", ms=5, mfc="white", mew=1.2, color="#222222" if len(found) > 1 else COLORS[0],
            label=f"{counted(len(together), 'avalanche')}, {counted(together.sum(), 'spring')}" + (f" of {len(found)} runs" if len(found) > 1 else ""))
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        few_powers(axis)
    ax.set_xlabel("size of an avalanche $s$ [springs]")
    ax.set_ylabel("share of the avalanches $P(s)$")
    key(ax)


def affine_map(run, row):
    """F (d, d) that takes the first frame to this one: of a periodic box the box' own, else by least squares over the particles."""
    if any(run.periodic):
        return (np.linalg.inv(run.box_edges(0)) @ run.box_edges(row)).T
    start, now = (x - x.mean(axis=0) for x in (run.position(0), run.position(row)))
    return np.linalg.lstsq(start, now, rcond=None)[0].T


def nonaffine_displacements(run, row):
    """(N, d): x - F X less its mean over the particles, X of the first frame [m]."""
    start, now = run.position(0), run.position(row)
    rest = now - start @ affine_map(run, row).T
    return rest - rest.mean(axis=0)


def nonaffine(ax, runs, labels, args):
    """Root mean square of the displacements that are not affine, over the largest strain of a periodic box, or over time."""
    several, over = len(runs) > 1, {}  # words for what a run is drawn over, and the runs; without words: over time
    for i, run in enumerate(runs):
        rows = sample(range(run.frames), 200)
        if len(rows) < 2:
            continue
        rms = np.array([np.sqrt((nonaffine_displacements(run, row) ** 2).sum(axis=1).mean()) for row in rows])
        x, words = run.times[rows], ""
        if any(run.periodic):
            strains = box_strains(run, rows)
            k = int(np.abs(strains).max(axis=0).argmax())
            if np.abs(strains[:, k]).max() > 0:
                name = TENSOR[run.dim][k]
                x, words = strains[:, k], rf"shear strain $\gamma_{{{name}}}$" if name[0] != name[-1] else rf"strain $\epsilon_{{{name}}}$"
        over.setdefault(words, []).append(run)
        ax.plot(x, rms, color=COLORS[i % len(COLORS)], lw=width(i, several), label=labels[i] or None)
    if not over:
        return missing(ax, "displacements")
    if len(over) > 1:
        (words, (run, *_)), (others, (other, *_)) = list(over.items())[:2]
        raise RunError(f"{run.path} goes by {words or progress_of(run)}, {other.path} by {others or progress_of(other)}: plot them one at a time")
    words = next(iter(over))
    ax.set_xlabel(words or time_label(over[words]))
    ax.set_ylabel(axis_label("non-affine displacement, rms", runs[0].unit("position")))
    ax.set_ylim(0, None)
    ax.margins(x=0.02)


def nonaffine_field(ax, runs, labels, args):
    """Arrows of the displacements that are not affine, in the plane, of one frame, the longest drawn as long as three springs."""
    run = runs[0]
    if run.dim != 2:
        return missing(ax, "plane")
    row = run.index(args.frame)
    x, u = run.position(row), nonaffine_displacements(run, row)
    size = np.linalg.norm(u, axis=1)
    if not size.max() > 1e-12 * np.linalg.norm(np.ptp(x, axis=0)):
        return missing(ax, "displacements that are not affine")
    springs = run.springs
    lines = springs.pairs[springs.inside & run.acting(row)]
    ax.add_collection(LineCollection(x[lines], colors="#d4d4d4", linewidths=0.4, zorder=1))
    step = float(np.median(run.lengths(0))) if len(springs) else 0.05 * np.ptp(x)
    longest = np.percentile(size, 99)
    arrows = ax.quiver(*x.T, *u.T, size, cmap="viridis", angles="xy", scale_units="xy", scale=longest / (3 * step), width=0.004, zorder=2)
    arrows.set_clim(0, longest)
    bar = ax.figure.colorbar(arrows, ax=ax, fraction=0.04, pad=0.02, shrink=0.75)
    bar.set_label(axis_label("non-affine displacement", run.unit("position")))
    bar_beside(bar)
    ax.set_aspect("equal", adjustable="datalim")
    ax.autoscale_view()
    ax.set_xlabel(axis_label("$x$", run.unit("position")))
    ax.set_ylabel(axis_label("$y$", run.unit("position")))
    ax.set_title(moment(run, row) + f", arrows × {number(3 * step / longest, '.3g')}" + (f"   {labels[0]}" if labels[0] else ""), loc="left")
