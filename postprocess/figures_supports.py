"""What supports do: reactions and loads over time, or against how far something has been moved."""
import numpy as np
from matplotlib.ticker import MaxNLocator

from backspring_io import RunError
from figure_style import COLORS, axis_label, finish, missing, number, time_label, width
from load_path import abscissa, check_against, farthest, in_words, limit_points, mean_displacement, unit_vector
from scene import sample


def groups_of(run):
    """Names of the groups with a reaction."""
    return [name.split("/", 1)[1] for name in run.series if name.startswith("reaction/")]


def check_groups(runs, names):
    """Raises RunError for a group that is asked for and has no reaction in any of the runs."""
    reacting = list(dict.fromkeys(name for run in runs for name in groups_of(run)))
    for name in [name for name in names if name not in reacting]:
        have = f"; those with a reaction: {', '.join(reacting)}" if reacting else ", as no group has: one has that -bs_motion_NAME holds (fixed) or moves"
        raise RunError(f"{runs[0].path}: --groups {name}: " + (f"this group has no reaction{have}" if any(name in run.groups for run in runs) else f"there is no such group{have}"))


def strongest(run, names):
    """Where nothing that reacts moves: the direction of the largest reaction of any of these groups, its largest component positive; None without any."""
    values = [run.series[key].reshape(len(run.observable_times), -1) for key in (f"reaction/{name}" for name in names) if key in run.series]
    if not values:
        return None
    largest = max((v[np.linalg.norm(v, axis=1).argmax()] for v in values), key=np.linalg.norm)
    size = np.linalg.norm(largest)
    if not size > 0:
        largest, size = np.eye(len(largest))[0], 1.0
    return largest / size * np.sign(largest[np.abs(largest).argmax()])


def curves_of(run, args):
    """What force draws of one run: [(words, x (T,), y (T,))], labels of x and y, the unit of y. Raises RunError; no curve where there is nothing to draw."""
    reacting, component = groups_of(run), getattr(args, "component", None)
    what, group = check_against(getattr(args, "against", None))
    x, xlabel, direction, moves = abscissa(run, what or ("displacement" if run.static else "time"), group, component, reacting)
    names = getattr(args, "groups", None) or []
    if getattr(args, "load", False) or (not reacting and not names):
        if run.static and xlabel == "load factor":
            raise RunError(f"{run.path}: --against {what}: the load factor against itself says nothing; write --against displacement, or displacement:WHAT of a group or particle"
                           + (", or leave out --load to see reactions" if reacting else "; no group has a reaction to draw, as groups with -bs_motion_NAME have"))
        return ([("load factor", x, run.series["load_factor"][:len(x)])] if run.static and moves else []), xlabel, "load factor"
    leader = farthest(run, reacting)
    names = [name for name in names or ([leader] if leader else reacting) if name in reacting]
    if leader is None or not names:
        along = strongest(run, names or reacting)
    else:
        along = direction if direction is not None and group in (None, leader) else unit_vector(mean_displacement(run, sample(range(run.frames), 50), run.group(leader)), component)
    along = unit_vector(np.zeros((1, run.dim)), component) if component else along
    curves = [(name, x, run.series["reaction/" + name].reshape(len(run.observable_times), -1)[:len(x)] @ along) for name in names]
    return (curves if moves else []), xlabel, axis_label(f"force of the support along {in_words(along)}", run.unit("reaction/" + reacting[0]))


def common_axes(runs, args):
    """Raises RunError where the curves of these runs would be of different quantities, or over different ones."""
    what, _ = check_against(getattr(args, "against", None))
    if what == "time" or what is None and not all(run.static for run in runs):
        time_label(runs)
    loads, reacting = ([run for run in runs if bool(groups_of(run)) == has and (has or run.static)] for has in (False, True))
    if not getattr(args, "load", False) and loads and reacting:
        raise RunError(f"{reacting[0].path} has reactions of supports, {loads[0].path} has a load factor alone: write --load for the load factors of static analyses")


def mark_limits(ax, curves, labelled=8, marked=60):
    """Discs at limit points, squares where a curve [(x, y)] turns back in x, with the loads beside them where they are few; nothing where they are too many."""
    found = [limit_points(x, y) for x, y in curves if len(x) > 2]
    limits, backs = [p for some, _ in found for p in some], [p for _, some in found for p in some]
    if len(limits) + len(backs) > marked:
        return
    for points, mark, words in (([p[:2] for p in limits], "o", "limit points"), (backs, "s", "turning points of displacement")):
        if points:
            ax.plot(*np.transpose(points), mark, ms=5, mfc="white", mec="#222222", mew=1.1, zorder=4, ls="none", label=words)
    size, told = np.array([np.diff(ax.get_xlim())[0], np.diff(ax.get_ylim())[0]]), []
    for x, y, top in limits if len(limits) <= labelled else []:
        place = np.array([x, y]) / size
        if not any(np.abs(place - other).max() < 0.02 for other in told):  # those of another run may lie there
            ax.annotate(number(y), (x, y), xytext=(0, 6 if top else -6), textcoords="offset points", ha="center", va="bottom" if top else "top", fontsize=8, color="#222222")
        told.append(place)


def force(ax, runs, labels, args):
    """Reaction of groups, the force their support exerts on them, or the load factor: in statics against the displacement of what moves most, else over time, or as --against
    says. Along --component, or the direction in which the group moved most, or, where none moves, that of the largest reaction. Limit points of statics are marked, where nothing breaks."""
    several, everything = len(runs) > 1, []
    common_axes(runs, args)
    if not getattr(args, "load", False):
        check_groups(runs, getattr(args, "groups", None) or [])
    for i, run in enumerate(runs):
        curves, xlabel, ylabel = curves_of(run, args)
        for k, (name, x, y) in enumerate(curves):
            ax.plot(x, y, color=COLORS[(i if several else k) % len(COLORS)], lw=width(i, several), label=None if len(curves) == 1 else name)
        everything += [(run, xlabel, ylabel, curve) for curve in curves]
    if not everything:
        return missing(ax, "reactions or loads of what moves" if check_against(getattr(args, "against", None))[0] == "displacement" else "reactions and load factors")
    ax.axhline(0, color="#999999", lw=0.6)
    ax.margins(y=0.12)
    ax.autoscale_view()
    mark_limits(ax, [(x, y) for run, *_, (_, x, y) in everything if run.static and not np.any(run.series.get("broken_energy", 0.0))])  # a break is no limit point
    run = everything[0][0]
    xlabels, ylabels = (list(dict.fromkeys(labels)) for labels in list(zip(*everything))[1:3])
    finish(ax, [run], ylabels[0] if len(ylabels) == 1 else axis_label("force of the support", run.unit("reaction")))
    moved = (check_against(getattr(args, "against", None))[0] or ("displacement" if run.static else "time")) == "displacement"  # of other particles, or another way
    ax.set_xlabel(xlabels[0] if len(xlabels) == 1 else axis_label("displacement", run.unit("position")) if moved else time_label(runs))
    ax.margins(x=0.03)
    ax.xaxis.set_major_locator(MaxNLocator(5))
