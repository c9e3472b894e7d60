"""Load paths: what a force or load is drawn against, and the limit points of the curve."""
import numpy as np

from backspring_io import RunError
from figure_style import axis_label, number, time_label
from scene import sample

AGAINST = ("time", "load", "arc", "displacement")
SMALL = 2e-3  # of a curve's range: turns that are smaller are not marked


def check_against(text):
    """The words of --against as (what, group or None); raises RunError."""
    what, _, group = (text or "").partition(":")
    if text and (what not in AGAINST or (group and what != "displacement")):
        raise RunError(f"--against {text}: choose from time, load, arc, displacement, displacement:GROUP")
    return what or None, group or None


def mean_displacement(run, rows, members):
    """(len(rows), d): mean displacement of particles since the first frame [m]."""
    start = run.position(0)[members].mean(axis=0)
    return np.array([run.position(int(row))[members].mean(axis=0) - start for row in rows])


def farthest(run, groups):
    """The group whose mean displacement comes furthest; None where all stay, but for rounding."""
    frames, name = sample(range(run.frames), 50), None
    best = 1e-12 * np.linalg.norm(np.ptp(run.position(0), axis=0))
    for group in groups:
        far = np.linalg.norm(mean_displacement(run, frames, run.group(group)), axis=1).max()
        if far > best:
            best, name = far, group
    return name


def _members(run, name, reacting):
    """Rows of the particles whose displacement is meant, and words for them: a group or a particle's number as given; else the group that moves furthest, of those
    with a reaction first; else the particle that does."""
    if name is not None:
        if name not in run.groups and name.lstrip("-").isdigit():
            where = np.flatnonzero(run.id == int(name))
            if not len(where):
                raise RunError(f"{run.path}: no group and no particle {name}")
            return where, f"particle {name}"
        return run.group(name), name
    name = farthest(run, reacting) or farthest(run, [g for g in run.groups if g not in reacting])
    if name is not None:
        return run.group(name), name
    far = np.max([np.linalg.norm(run.position(row) - run.position(0), axis=1) for row in sample(range(run.frames), 20)], axis=0)
    return np.array([far.argmax()]), f"particle {run.id[far.argmax()]}"


def unit_vector(path, component):
    """The direction (d,) that a path (T, d) is measured along: an axis if one is given, else that to its farthest point."""
    if component:
        if "xyz".index(component) >= path.shape[1]:
            raise RunError(f"--component {component}: there are {path.shape[1]} dimensions")
        return np.eye(path.shape[1])["xyz".index(component)]
    far = path[np.linalg.norm(path, axis=1).argmax()]
    size = np.linalg.norm(far)
    return far / size if size > 0 else np.eye(path.shape[1])[0]


def in_words(direction):
    """The direction as letters of a label: an axis, "$-y$", or components."""
    axis = np.flatnonzero(np.abs(direction) > 1 - 1e-6)
    if len(axis):
        return "$" + ("-" if direction[axis[0]] < 0 else "") + "xyz"[axis[0]] + "$"
    return "(" + ", ".join(number(c, ".2g") for c in direction) + ")"


def abscissa(run, what, group, component, reacting):
    """What a force is drawn against: values (T,), the axis' label, and of displacements the direction (else None) and whether anything moves."""
    rows = np.arange(min(run.frames, len(run.observable_times)))
    if what == "displacement":
        members, words = _members(run, group, reacting)
        path = mean_displacement(run, rows, members)
        direction = unit_vector(path, component)
        moves = np.linalg.norm(path, axis=1).max() > 1e-12 * np.linalg.norm(np.ptp(run.position(0), axis=0))
        return path @ direction, axis_label(f"displacement of {words} along {in_words(direction)}", run.unit("position")), direction, moves
    if what in ("load", "arc") and not run.static:
        raise RunError(f"{run.path}: --against {what} is for static analyses (-bs_task statics)")
    if what == "load":
        return run.series["load_factor"][rows], "load factor", None, True
    if what == "arc" and run.parameters.get("bs_load_control") != "arc":
        raise RunError(f"{run.path}: --against arc is for paths by arc length (-bs_load_control arc)")
    return run.observable_times[rows], time_label([run]), None, True


def turns(values):
    """Rows of the local extremes of `values` (T,) along a curve, ends left out; a swing of less than SMALL of the range is none."""
    found, reach, low, high, rising = [], SMALL * np.ptp(values), 0, 0, None
    if not reach > 1e-9 * np.abs(values).max():
        return []
    for k, v in enumerate(values):
        high, low = (k if v > values[high] else high), (k if v < values[low] else low)
        if rising is not False and v < values[high] - reach:
            found.append(high)
            rising, low, high = False, k, k
        elif rising is not True and v > values[low] + reach:
            found.append(low)
            rising, low, high = True, k, k
    return [k for k in found if 0 < k < len(values) - 1]


def refined(k, x, y):
    """(x, y) where y has its extreme next to row k: by the quartic in x through five rows, where the curve bends one way over them (it does not across a jump); else
    row k itself."""
    if not 2 <= k < len(x) - 2:
        return x[k], y[k]
    some = slice(k - 2, k + 3)
    step, slope = np.diff(x[some]), np.diff(y[some])
    if not (np.all(step > 0) or np.all(step < 0)):
        return x[k], y[k]
    bends = np.diff(slope / step) * np.sign(step[0])
    if not (np.all(bends > 0) or np.all(bends < 0)):
        return x[k], y[k]
    way = np.linspace(x[k - 1] - x[k], x[k + 1] - x[k], 4001)
    there = np.polyval(np.polyfit(x[some] - x[k], y[some], 4), way)
    at = (there * -np.sign(bends[1])).argmax()
    return x[k] + way[at], there[at]


def limit_points(x, y):
    """Limit points [(x, y, whether it is a maximum)] of a curve, where y has an extreme along it, and the points [(x, y)] where it turns back in x; between rows by
    interpolation. Where both turn in one row the path itself turns back, as where what is driven does: that is no limit point."""
    returns, extremes = turns(x), turns(y)
    limits = [(*refined(k, x, y), y[k] > y[k - 1] or y[k] > y[k + 1]) for k in extremes if k not in returns]
    backs = [refined(k, y, x)[::-1] for k in returns]
    return limits, backs
