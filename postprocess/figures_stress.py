"""Stress over strain of a periodic box, and the slope of it."""
import numpy as np

from backspring_io import RunError
from run_data import TENSOR
from figure_style import COLORS, DASHES, axis_label, key, missing, width


def box_strains(run, rows):
    """(len(rows), d (d+1)/2): components of F - I in the order of stresses, where F takes the edges of the first frame to those of each row, e = F E."""
    start = np.linalg.inv(run.box_edges(0))
    gradients = np.array([(start @ run.box_edges(int(row))).T - np.eye(run.dim) for row in rows])
    return np.stack([gradients[:, "xyz".index(a), "xyz".index(b)] for a, b in TENSOR[run.dim]], axis=1)


def slope(x, y):
    """dy/dx (T,) along a curve, of second order, by pieces on which x goes one way; NaN where a piece has fewer than three points."""
    out = np.full(len(x), np.nan)
    ways = np.sign(np.diff(x))
    ends = np.concatenate([[0], 1 + np.flatnonzero(ways[1:] != ways[:-1]), [len(x) - 1]])
    for a, b in zip(ends[:-1], ends[1:]):
        if b - a > 1 and ways[a]:
            out[a:b + 1] = np.gradient(y[a:b + 1], x[a:b + 1], edge_order=2)
    return out


def curve_of(run, component=None):
    """(the stress' component, the strain's, strains (T,), stresses (T, k)): of the component that is asked for, or is strained most; of one that is not strained over the
    strain of that which is most. None without stress or without strain."""
    stress = run.series.get("stress")
    if stress is None or not any(run.periodic):
        return None
    stress = stress.reshape(len(stress), -1)
    names, rows = TENSOR[run.dim], np.arange(min(run.frames, len(stress)))
    if component and component not in names:
        raise RunError(f"--component {component}: there are {', '.join(names)}")
    strains = box_strains(run, rows)
    reach = np.ptp(strains, axis=0)
    most = int(reach.argmax())
    k = names.index(component) if component else most
    over = k if reach[k] > 1e-9 * reach[most] else most
    return (names[k], names[over], strains[:, over], stress[rows]) if reach[most] > 0 else None


def has_slope(run):
    """Whether the stress is there at enough strains for a slope: three, one way."""
    found = curve_of(run)
    return found is not None and bool(np.isfinite(slope(found[2], found[3][:, 0])).any())


def _strain(name):
    """The sign of a component of the strain."""
    return rf"\{'gamma' if name[0] != name[-1] else 'epsilon'}_{{{name}}}"


def _axes(ax, runs, over, ylabel):
    ax.set_xlabel(f"{'shear ' if over[0] != over[-1] else ''}strain ${_strain(over)}$")
    ax.set_ylabel(axis_label(ylabel, runs[0].unit("stress")))
    ax.margins(x=0.02)
    key(ax)


def stress(ax, runs, labels, args):
    """Stress over the strain of the box, of one component; of a single run the others beside it."""
    name, several = None, len(runs) > 1
    for i, run in enumerate(runs):
        found = curve_of(run, getattr(args, "tensor", None) or name)
        if found is None:
            continue
        name, over, strain, values = found
        k = TENSOR[run.dim].index(name)
        for other in range(values.shape[1]):
            if other != k and not several:
                ax.plot(strain, values[:, other], color=COLORS[1 + (other + (other < k)) % 7], ls=DASHES[1 + other % 3], lw=1.0,
                        label=rf"$\sigma_{{{TENSOR[run.dim][other]}}}$", zorder=2)
        ax.plot(strain, values[:, k], color=COLORS[i % len(COLORS)], lw=width(i, several), label=None if several else rf"$\sigma_{{{name}}}$", zorder=3)
    if name is None:
        return missing(ax, "stress of a box that is strained")
    ax.axhline(0, color="#999999", lw=0.6)
    _axes(ax, runs, over, rf"stress $\sigma_{{{name}}}$" if several else r"stress $\sigma$")


def modulus(ax, runs, labels, args):
    """The slope of the stress over the strain, the differential modulus."""
    name, several = None, len(runs) > 1
    for i, run in enumerate(runs):
        found = curve_of(run, getattr(args, "tensor", None) or name)
        if found is None or not has_slope(run):
            continue
        name, over, strain, values = found
        ax.plot(strain, slope(strain, values[:, TENSOR[run.dim].index(name)]), color=COLORS[i % len(COLORS)], lw=width(i, several))
    if name is None:
        return missing(ax, "stress at three strains or more")
    low, high = ax.get_ylim()
    if high - low < 1e-6 * max(abs(low), abs(high)):  # a straight line, and rounding
        ax.set_ylim(0.9 * low, 1.1 * high) if low > 0 else ax.set_ylim(1.1 * low - 1, 1.1 * high + 1)
    _axes(ax, runs, over, rf"modulus $d\sigma_{{{name}}}/d{_strain(over)}$")
