"""Panels of the motion: paths, phase portraits, one frame; states and sources of a linear system."""
import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator

from figure_style import COLORS, DASHES, axis_label, bar_beside, finish, missing, number, width
from scene import Scene, sample
from scene_colors import share_colours
from scene_window import share_window


def chosen(run, args, count=6):
    """Rows of the particles to follow: as asked by --particles (numbers as in the file's ids), else up to `count` free ones."""
    if args.particles:
        where = {int(v): i for i, v in enumerate(run.id)}
        unknown = [p for p in args.particles if p not in where]
        if unknown:
            raise run._error(f"no particle {unknown[0]}; the first is {run.id[0]}, the last {run.id[-1]}")
        return [where[p] for p in args.particles]
    free = np.flatnonzero(~run.fixed)
    return sample(free if len(free) else range(run.particles), count)


def _followed(runs, args):
    """(style, run, row) of every curve: the colour tells the particle, or the run if there are several
    (the line style then tells the particle)."""
    for i, run in enumerate(runs):
        for k, row in enumerate(chosen(run, args, 6 if len(runs) == 1 else 2)):
            color, dash = (k, 0) if len(runs) == 1 else (i, k)
            yield {"color": COLORS[color % len(COLORS)], "ls": DASHES[dash % len(DASHES)],
                   "lw": width(i, True) if len(runs) > 1 else 1.1}, run, row


def _key(ax, runs, args):
    """A legend of the particles, unless there is one only."""
    rows = chosen(runs[0], args, 6 if len(runs) == 1 else 2)
    if len(rows) < 2:
        return
    several = len(runs) > 1
    for k, row in enumerate(rows):
        ax.plot(*[[]] * (3 if ax.name == "3d" else 2), color="#555555" if several else COLORS[k % len(COLORS)],
                ls=DASHES[k % len(DASHES)] if several else "-", label=str(runs[0].id[row]))
    ax.legend(title="particle", title_fontsize=8, loc="center left", bbox_to_anchor=(1.0 if ax.name != "3d" else 1.2, 0.5), handlelength=1.2,
              borderpad=0.1, borderaxespad=0.2)


def paths(ax, runs, labels, args):
    """Where some particles go: x over t in one dimension, the path itself in two and three (with its start as a dot)."""
    unit = runs[0].unit("position")
    for style, run, row in _followed(runs, args):
        x = run.position_path(row)
        line = (run.times, x[:, 0]) if run.dim == 1 else x.T
        ax.plot(*line, **style)
        ax.plot(*[v[:1] for v in line], "o", color=style["color"], ms=3.5)
    _key(ax, runs, args)
    if runs[0].dim == 1:
        return finish(ax, runs, axis_label("$x$", unit))
    ax.set_xlabel(axis_label("$x$", unit))
    ax.set_ylabel(axis_label("$y$", unit))
    if runs[0].dim == 2:
        ax.set_aspect("equal", adjustable="datalim")
        return
    ax.set_zlabel(axis_label("$z$", unit), labelpad=2)
    ax.view_init(args.elev, args.azim)
    limits = np.array([ax.get_xlim(), ax.get_ylim(), ax.get_zlim()])
    half = 0.5 * np.maximum(np.ptp(limits, axis=1), 0.25 * np.ptp(limits, axis=1).max())
    for k, (axis, set_limits) in enumerate(zip((ax.xaxis, ax.yaxis, ax.zaxis), (ax.set_xlim, ax.set_ylim, ax.set_zlim))):
        set_limits(limits[k].mean() - half[k], limits[k].mean() + half[k])
        axis.set_major_locator(MaxNLocator(3))
        axis.set_pane_color((1, 1, 1, 0))
        axis._axinfo["grid"].update(color="#e0e0e0", linewidth=0.5)
    ax.tick_params(pad=1)
    ax.set_box_aspect(half, zoom=1.12)


def phase(ax, runs, labels, args):
    """Velocity over position of some particles, in one component: the one they move most in, unless --component says."""
    if any(run.velocities is None for run in runs):
        return missing(ax, "velocities")
    curves = [(style, run.position_path(row), run.velocity_path(row)) for style, run, row in _followed(runs, args)]
    reach = np.max([np.ptp(x, axis=0) for _, x, _ in curves], axis=0)
    k = min("xyz".index(args.component), runs[0].dim - 1) if args.component else int(reach.argmax())
    for style, x, v in curves:
        ax.plot(x[:, k], v[:, k], **style)
        ax.plot(x[:1, k], v[:1, k], "o", color=style["color"], ms=3.5)
    ax.set_xlabel(axis_label(f"${'xyz'[k]}$", runs[0].unit("position")))
    ax.set_ylabel(axis_label(f"$v_{'xyz'[k]}$", runs[0].unit("velocity")))
    _key(ax, runs, args)


def state_scenes(runs, args):
    """The scene of each run, over all frames asked for; one window and one colour scale for all, so that panels can be compared."""
    scenes = [Scene(run, [run.index(frame) for frame in args.frames], args.color, "light", args.up, args.elev, args.azim, 0.0, args.max_springs,
                    args.draw, deform=args.deform, reactions=args.reactions) for run in runs]
    share_window(scenes)
    share_colours(scenes)
    return scenes


def state(ax, runs, labels, args):
    """One frame drawn as springs or particles; shows runs[0] only, in the scene that it shares with others, if there is one."""
    run = runs[0]
    row = run.index(args.frame)
    scene = getattr(args, "scene", None) or state_scenes(runs[:1], args)[0]
    if scene.mapping() is not None:
        bar = ax.figure.colorbar(scene.mapping(), ax=ax, fraction=0.04, pad=0.02, shrink=0.75, extend=scene.beyond())
        bar.set_label(scene.label())
        bar.locator = MaxNLocator(5)
        bar.update_ticks()
        bar_beside(bar)
    scene.setup(ax, bar=run.dim == 3)
    scene.draw_frame(ax, row)
    if run.dim < 3:
        _ticks(ax, scene)
    ax.set_title(scene.title(row) + (f"   {labels[0]}" if labels[0] else ""), loc="left")


def _ticks(ax, scene):
    """Labels of the axes shown; where an axis points down its numbers grow downwards."""
    unit = scene.run.unit("position")
    for axis, shown in zip((ax.xaxis, ax.yaxis), scene.camera.plane_coordinates()):
        if shown is None:
            axis.set_visible(False)
            continue
        axis.set_label_text(axis_label(f"${'xyz'[shown[0]]}$", unit))
        if shown[1] < 0:
            axis.set_major_formatter(FuncFormatter(lambda v, _: number(-v) if v else "0"))


def _picked(run, kind, args):
    """Columns of the states or sources of a linear system that are drawn: those asked for, else the first six."""
    series = getattr(run, kind)
    count = len(series.labels) if kind == "states" else int(np.prod(series.value.shape[1:]))
    if kind == "sources" or not args.states:
        return list(range(min(6, count)))
    for name in args.states:
        if name not in series.labels and not (name.isdigit() and int(name) < count):
            raise run._error(f"no state '{name}'; there are {', '.join(series.labels[:12])}" + (" ..." if count > 12 else ""))
    return [series.labels.index(name) if name in series.labels else int(name) for name in args.states]


def units_drawn(run, kind, args):
    """Units of what `states` or `sources` would draw of this run, which has a panel for each; where nobody asked for sources, of those that vary."""
    series = getattr(run, kind)
    if series.value is None:
        return [""]
    shown = varying_sources(run) if kind == "sources" and args.kind is None else _picked(run, kind, args)
    return list(dict.fromkeys(series.units[k] for k in shown))


def varying_sources(run):
    """Columns of the first six sources of a linear system that do not stay as they are."""
    if run.sources.value is None:
        return []
    table = np.asarray(run.sources.value).reshape(len(run.sources.value), -1)[:, :6]
    return np.flatnonzero(np.ptp(table, axis=0) > 0).tolist()


def _lines(ax, runs, kind, args):
    """Those of one unit, by that of the first run; the colour tells which."""
    for i, run in enumerate(runs):
        series = getattr(run, kind)
        table = np.asarray(series.value).reshape(len(series.value), -1)
        count = min(len(table), len(series.times), run.frames) if kind == "states" else min(len(table), len(series.times))
        for k, (column, first) in enumerate(zip(_picked(run, kind, args), _picked(runs[0], kind, args))):
            if getattr(runs[0], kind).units[first] == args.unit:
                ax.plot(series.times[:count], table[:count, column], color=COLORS[k % len(COLORS)], ls=DASHES[i % len(DASHES)],
                        label=series.labels[column] if i == 0 else None)
    quantity = {"V": "voltage", "A": "current", "K": "temperature"}.get(args.unit, "")
    finish(ax, runs, axis_label(quantity, args.unit).strip() or kind.rstrip("s"))


def states(ax, runs, labels, args):
    """States of a linear system over time, of one unit."""
    _lines(ax, runs, "states", args)


def sources(ax, runs, labels, args):
    """Sources of a linear system over time, of one unit; they are those of the first run."""
    if runs[0].sources.value is None:
        return missing(ax, "sources")
    _lines(ax, runs[:1], "sources", args)
