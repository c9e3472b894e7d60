"""The panels plot.py is made of: each function draws one quantity of some runs into one axes."""
import matplotlib
matplotlib.use("Agg")
import numpy as np  # noqa: E402
from matplotlib.ticker import FuncFormatter, MaxNLocator  # noqa: E402

from scene import Scene, sample  # noqa: E402

COLORS = ["#1f5fa8", "#c8452e", "#3a8f5a", "#8a5aa8", "#c98a1b", "#4aa3b8", "#7a7a7a", "#b8477f"]
PARTS = {"elastic_energy": ("elastic", (0, (6, 1.5, 1, 1.5))), "kinetic_energy": ("kinetic", (0, (4, 1.5))), "potential_energy": ("potential", (0, (1, 1.2))),
         "total_energy": ("total", "-")}
DASHES = ["-", (0, (4, 1.5)), (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5))]
STYLE = {"font.size": 9, "axes.labelsize": 9, "axes.titlesize": 9, "legend.fontsize": 8, "xtick.labelsize": 8,
         "ytick.labelsize": 8, "axes.linewidth": 0.7, "lines.linewidth": 1.3, "axes.spines.top": False,
         "axes.spines.right": False, "xtick.direction": "out", "ytick.direction": "out", "legend.frameon": False,
         "axes.grid": True, "grid.color": "#e4e4e4", "grid.linewidth": 0.6, "axes.axisbelow": True,
         "axes.formatter.limits": (-3, 4), "axes.formatter.use_mathtext": True, "svg.fonttype": "none",
         "pdf.fonttype": 42, "mathtext.fontset": "dejavusans"}


def axis_label(name, unit):
    return f"{name} [{unit}]" if unit else name


def time_label(run):
    return axis_label("time $t$", run.unit("time"))


def missing(ax, what):
    """Says in the panel that the file has no such data; nothing is made up in its place."""
    ax.text(0.5, 0.5, f"no {what} in the file", transform=ax.transAxes, ha="center", va="center", color="#777777")
    ax.set_xticks([])
    ax.set_yticks([])
    ax.grid(False)


def finish(ax, run, ylabel, legend=True):
    ax.set_xlabel(time_label(run))
    ax.set_ylabel(ylabel)
    ax.margins(x=0.01)
    if legend and ax.get_legend_handles_labels()[0]:
        ax.legend(loc="best")


def tag(name, label, several):
    return f"{name}, {label}" if several else name


def _needless(runs, run):
    """The elastic part is drawn for a single run, where other potentials act beside it."""
    potential, elastic = run.series.get("potential_energy"), run.series["elastic_energy"]
    return len(runs) > 1 or (potential is not None and np.allclose(potential, elastic, rtol=1e-9, atol=1e-12))


def energy(ax, runs, labels, args):
    """Energies as the program wrote them."""
    drawn = False
    for i, run in enumerate(runs):
        for k, (name, (short, dash)) in enumerate(PARTS.items()):
            if name not in run.series or (short == "elastic" and _needless(runs, run)):
                continue
            drawn = True
            several = len(runs) > 1
            ax.plot(run.observable_times, run.series[name], ls=dash, label=None if several else short,
                    color=COLORS[(i if several else (3, 1, 2, 0)[k]) % len(COLORS)], lw=1.6 if short == "total" else 1.1)
    if not drawn:
        return missing(ax, "energies")
    if len(runs) > 1:
        ax.set_title("solid total, dashed kinetic, dotted potential", color="#555555", fontsize=8)
    finish(ax, runs[0], axis_label("energy", runs[0].unit("total_energy")))


def drift(ax, runs, labels, args):
    """Change of total energy since the first frame, relative to the energy in motion: the largest kinetic energy or the
    range of the potential, which do not depend on where the potential is zero."""
    drawn = False
    for i, run in enumerate(runs):
        total = run.series.get("total_energy")
        if total is None:
            continue
        kinetic, potential = (run.series.get(n) for n in ("kinetic_energy", "potential_energy"))
        scale = max([abs(total[0])] if kinetic is None or potential is None else [kinetic.max(), np.ptp(potential)])
        if scale > 0:
            drawn = True
            ax.plot(run.observable_times, (total - total[0]) / scale, color=COLORS[i % len(COLORS)])
    if not drawn:
        return missing(ax, "total energy")
    ax.axhline(0, color="#999999", lw=0.6)
    finish(ax, runs[0], r"$(E-E_0)\,/\,\max(E_\mathrm{kin},\,\Delta E_\mathrm{pot})$")


def _vector(ax, runs, labels, name, symbol):
    drawn = False
    for i, run in enumerate(runs):
        value = run.series.get(name)
        if value is None:
            continue
        drawn, value = True, value.reshape(len(value), -1)
        several = len(runs) > 1
        for k in range(value.shape[1]):
            text = f"${symbol}_{'xyz'[k]}$" if k < 3 else str(k)
            ax.plot(run.observable_times, value[:, k], label=None if several else text, color=COLORS[(i if several else k) % len(COLORS)],
                    ls=DASHES[k % len(DASHES)])
    if not drawn:
        return missing(ax, name.replace("_", " "))
    if len(runs) > 1:
        ax.set_title("solid x, dashed y, dotted z", color="#555555", fontsize=8)
    finish(ax, runs[0], axis_label(name.replace("_", " "), runs[0].unit(name)))


def momentum(ax, runs, labels, args):
    _vector(ax, runs, labels, "momentum", "p")


def angular_momentum(ax, runs, labels, args):
    _vector(ax, runs, labels, "angular_momentum", "L")


def strain(ax, runs, labels, args):
    """Strain of the springs over time: median, the middle 90 %, extremes."""
    drawn = False
    for i, run in enumerate(runs):
        if not np.any(run.springs.rest_length > 0):
            continue
        drawn, color = True, COLORS[i % len(COLORS)]
        rows = sample(range(run.frames), max(2, min(200, int(4e7 // len(run.springs)))))
        bands = np.array([np.nanpercentile(run.strains(r), [0, 5, 50, 95, 100]) for r in rows])
        t = run.times[rows]
        ax.fill_between(t, bands[:, 1], bands[:, 3], color=color, alpha=0.2, lw=0,
                        label="5 to 95 %" if len(runs) == 1 else None)
        ax.plot(t, bands[:, 2], color=color, label=None if len(runs) > 1 else "median")
        ax.plot(t, bands[:, 0], color=color, lw=0.7, ls=DASHES[2], label="extremes" if len(runs) == 1 else None)
        ax.plot(t, bands[:, 4], color=color, lw=0.7, ls=DASHES[2])
    if not drawn:
        return missing(ax, "springs with a rest length")
    finish(ax, runs[0], r"strain $(l-L)/L$")


def steps(ax, runs, labels, args):
    """Step size (left) and Newton and Krylov counts (right), one point a step; rejected attempts as crosses."""
    if not any("dt" in run.log and "time" in run.log for run in runs):
        return missing(ax, "log of steps")
    counts = ax.twinx()
    counts.spines["right"].set_visible(True)
    counts.grid(False)
    several = len(runs) > 1
    for i, run in enumerate(runs):
        log = run.log
        if "dt" not in log or "time" not in log:
            continue
        color = COLORS[i % len(COLORS)]
        ax.plot(log["time"], log["dt"], color=color, drawstyle="steps-pre", label=None if several else "step size")
        for k, name in enumerate(("newton", "krylov")):
            if name in log and np.any(log[name] > 0):
                counts.plot(log["time"], log[name], ".", ms=(4, 2)[k], alpha=0.75,
                            color=color if several else COLORS[k + 1], mew=0,
                            label=None if several else ("Newton", "Krylov")[k])
        rejected = np.asarray(log.get("rejected", np.zeros(0))) > 0
        if rejected.any():
            ax.plot(log["time"][rejected], log["dt"][rejected], "x", color="#222222", ms=4, mew=0.9,
                    label="rejected before" if i == 0 else None)
    dts = np.concatenate([run.log["dt"] for run in runs if "dt" in run.log])
    positive = dts[dts > 0]
    if len(positive) and positive.max() > 20 * positive.min():
        ax.set_yscale("log")
    else:
        ax.set_ylim(0, 1.35 * max(dts.max(), 1e-300))
    if counts.lines:
        counts.set_yscale("symlog", linthresh=1)
        counts.set_ylim(0, 30 * max(float(np.max(line.get_ydata())) for line in counts.lines))
        counts.set_ylabel("iterations a step")
        counts.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    else:
        counts.set_axis_off()
    finish(ax, runs[0], axis_label("step size", runs[0].unit("time")), legend=False)
    pairs = [axes.get_legend_handles_labels() for axes in (ax, counts)]
    ax.legend(pairs[0][0] + pairs[1][0], pairs[0][1] + pairs[1][1], ncol=2, loc="upper left")


def chosen(run, args):
    """Rows of the particles to follow: as asked by --particles (numbers as in the file's ids), else up to six free ones."""
    if args.particles:
        where = {int(v): i for i, v in enumerate(run.id)}
        unknown = [p for p in args.particles if p not in where]
        if unknown:
            raise run._error(f"no particle {unknown[0]}; the first is {run.id[0]}, the last {run.id[-1]}")
        return [where[p] for p in args.particles]
    free = np.flatnonzero(~run.fixed)
    return sample(free if len(free) else range(run.particles), 6)


def _followed(runs, args):
    """(colour, dash, particle's number, run, row) of every curve."""
    for i, run in enumerate(runs):
        for k, row in enumerate(chosen(run, args)):
            yield COLORS[k % len(COLORS)], DASHES[i % len(DASHES)], run.id[row], run, row


def _beside(ax, runs, labels):
    """The particles' legend to the right of the panel, the runs' line styles above it."""
    ax.legend(title="particle", title_fontsize=8, loc="upper left", bbox_to_anchor=(1.22 if ax.name == "3d" else 1.0, 1.03), handlelength=1.2, borderpad=0.2)
    if len(runs) > 1:
        ax.set_title("; ".join(f"{('solid', 'dashed', 'dotted', 'dash-dot')[i % 4]} {label}" for i, label in enumerate(labels)))


def paths(ax, runs, labels, args):
    """Where some particles go: x over t in one dimension, the path itself in two and three (with its start as a dot)."""
    unit = runs[0].unit("position")
    for color, dash, number, run, row in _followed(runs, args):
        x = run.position_path(row)
        label = str(number) if run is runs[0] else None
        line = (run.times, x[:, 0]) if run.dim == 1 else x.T
        ax.plot(*line, color=color, ls=dash, label=label)
        ax.plot(*[v[:1] for v in line], "o", color=color, ms=3.5)
    _beside(ax, runs, labels)
    if runs[0].dim == 1:
        return finish(ax, runs[0], axis_label("$x$", unit), legend=False)
    ax.set_xlabel(axis_label("$x$", unit))
    ax.set_ylabel(axis_label("$y$", unit))
    if runs[0].dim == 2:
        ax.set_aspect("equal", adjustable="datalim")
    else:
        ax.set_zlabel(axis_label("$z$", unit))
        ax.view_init(args.elev, args.azim)
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_major_locator(MaxNLocator(4))


def phase(ax, runs, labels, args):
    """Velocity over position of some particles, in one component."""
    k = min("xyz".index(args.component), runs[0].dim - 1)
    if any(run.velocities is None for run in runs):
        return missing(ax, "velocities")
    for color, dash, number, run, row in _followed(runs, args):
        ax.plot(run.position_path(row)[:, k], run.velocity_path(row)[:, k], color=color, ls=dash,
                label=str(number) if run is runs[0] else None)
    ax.set_xlabel(axis_label(f"${'xyz'[k]}$", runs[0].unit("position")))
    ax.set_ylabel(axis_label(f"$v_{'xyz'[k]}$", runs[0].unit("velocity")))
    _beside(ax, runs, labels)


def state_scene(run, args, limits=None):
    return Scene(run, [run.index(args.frame)], args.color, "light", args.up, args.elev, args.azim, 0.0, args.max_springs,
                 limits=limits)


def state(ax, runs, labels, args):
    """One frame drawn as springs or particles; shows runs[0] only."""
    run = runs[0]
    row = run.index(args.frame)
    scene = state_scene(run, args, args.limits)
    if scene.mapping() is not None:
        bar = ax.figure.colorbar(scene.mapping(), ax=ax, fraction=0.04, pad=0.02, shrink=0.75)
        bar.set_label(scene.label())
        bar.outline.set_linewidth(0.5)
        bar.locator = MaxNLocator(5)
        bar.update_ticks()
    scene.setup(ax, bar=run.dim == 3)
    scene.draw_frame(ax, row)
    if run.dim < 3:
        _ticks(ax, scene)
    ax.set_title(f"$t$ = {run.times[row]:.4g} {run.unit('time')}".rstrip()
                 + (f"   {labels[0]}" if labels[0] else ""), loc="left")


def _ticks(ax, scene):
    """Labels of the axes shown; where an axis points down its numbers grow downwards."""
    unit = scene.run.unit("position")
    for axis, shown in zip((ax.xaxis, ax.yaxis), scene.camera.plane_coordinates()):
        if shown is None:
            axis.set_visible(False)
            continue
        axis.set_label_text(axis_label(f"${'xyz'[shown[0]]}$", unit))
        if shown[1] < 0:
            axis.set_major_formatter(FuncFormatter(lambda v, _: f"{-v:.4g}" if v else "0"))


def states(ax, runs, labels, args):
    """States of a linear system over time."""
    for i, run in enumerate(runs):
        names = run.states.labels
        for name in args.states or names[:6]:
            if name not in names and not (name.isdigit() and int(name) < len(names)):
                raise run._error(f"no state '{name}'; there are {', '.join(names[:12])}" + (" ..." if len(names) > 12 else ""))
        picked = [names.index(s) if s in names else int(s) for s in args.states] if args.states else range(min(6, len(names)))
        for k, column in enumerate(picked):
            ax.plot(run.times, run.states.value[:run.frames, column], color=COLORS[k % len(COLORS)],
                    ls=DASHES[i % len(DASHES)], label=tag(names[column], labels[i], len(runs) > 1))
    finish(ax, runs[0], "state")


def sources(ax, runs, labels, args):
    """Sources of a linear system over time."""
    value = runs[0].sources.value
    if value is None:
        return missing(ax, "sources")
    table = np.asarray(value).reshape(len(value), -1)
    count = min(len(table), len(runs[0].sources.times))
    for k in range(min(6, table.shape[1])):
        ax.plot(runs[0].sources.times[:count], table[:count, k], color=COLORS[k % len(COLORS)],
                label=runs[0].sources.labels[k])
    finish(ax, runs[0], "source")


KINDS = {"energy": energy, "drift": drift, "momentum": momentum, "angular_momentum": angular_momentum, "strain": strain,
         "steps": steps, "paths": paths, "phase": phase, "state": state, "states": states, "sources": sources}
