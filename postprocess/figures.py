"""The panels plot.py is made of: each function draws one quantity of some runs into one axes."""
import numpy as np
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from energy_books import BOOKS, books_of, lost_of, signs, work_of
from figure_style import COLORS, DASHES, axis_label, cleared, few_powers, finish, key, missing, moment, width
from figures_motion import paths, phase, sources, state, states, units_drawn, varying_sources
from figures_steps import iterations, steps
from figures_modes import bfactor, debye, dos, participation, spectrum
from figures_networks import avalanches, nonaffine, nonaffine_field
from figures_stress import modulus, stress
from figures_supports import force
from scene import sample

BOOKED = {"dissipated": COLORS[5], "broken": COLORS[7], "released": COLORS[6]}
TIMES = ["#a9c6e4", "#5c94cc", "#1f5fa8", "#0b2f5c"]  # early to late


def parts_of(run):
    """Energies of one run as [(name, (T,), dash, colour)], as the program wrote them; the potential that is not in springs is
    named gravity where nothing else has a potential. What is 0 throughout is left out."""
    have, found = run.series, []
    kinetic, elastic, potential, total = (have.get(n + "_energy") for n in ("kinetic", "elastic", "potential", "total"))
    if kinetic is not None and np.any(kinetic):
        found.append(("kinetic", kinetic, DASHES[1], COLORS[1]))
    if elastic is not None and potential is not None:
        if np.any(elastic):
            found.append(("elastic", elastic, DASHES[3], COLORS[3]))
        field = potential - elastic
        if np.abs(field).max() > 1e-12 * max(np.abs(potential).max(), 1e-300):
            others = any(k.startswith(("bs_central", "bs_xsp_", "bs_attraction", "bs_walls", "bs_center", "bs_force_")) for k in run.parameters) or \
                run.particle_column("force") is not None
            found.append(("other potential" if others else "gravity", field, DASHES[2], COLORS[2]))
    elif potential is not None:
        found.append(("potential", potential, DASHES[2], COLORS[2]))
    if total is not None:
        found.append(("total", total, DASHES[0], COLORS[0]))
    return found


def energy(ax, runs, labels, args):
    """Energies over time; of a single run also the work W of what is driven, what was dissipated, broken and released, and in motions what was lost."""
    several = len(runs) > 1
    if not any(parts_of(run) for run in runs):
        return missing(ax, "energies")
    seen = {}
    for i, run in enumerate(runs):
        for name, value, dash, color in parts_of(run):
            if several and name not in ("total", "kinetic"):
                continue
            seen[name] = dash
            ax.plot(run.observable_times, value, ls=dash, label=None if several else name,
                    color=COLORS[i % len(COLORS)] if several else color, lw=width(i, several) if several or name == "total" else 1.1,
                    zorder=1.9 if name == "total" and not several else 2)  # under the part that it may consist of
        if not several and "total" in seen:
            _books(ax, run)
    if several:
        for name, dash in seen.items():
            ax.plot([], [], ls=dash, color="#555555", label=name)
    finish(ax, runs, axis_label("energy", runs[0].unit("total_energy")), ncol=2, columnspacing=1.2)


def _books(ax, run):
    """Lines of the work done, of what is booked, and of what is not."""
    work, lost = work_of(run), lost_of(run)
    if np.any(work):
        ax.plot(run.observable_times, work, color=COLORS[4], lw=1.1, label="work done on it, $W$")
    for name, value in books_of(run).items():
        ax.plot(run.observable_times, value, color=BOOKED[name], ls=DASHES[1], lw=1.1, label=f"{name}, ${BOOKS[name]}$")
    if lost is not None:
        ax.plot(run.observable_times, lost, color="#8a8a8a", lw=1.1, label="lost, $E_0{}-E{}$".format(*signs([run])))


def budget(ax, runs, labels, args):
    """Where the energy of one run (runs[0]) is: kinetic, elastic, potential above its lowest value, dissipated, broken, released, and in motions lost, stacked. The upper
    edge is level as long as nothing does work on the system; the work of what is driven is what it rises by."""
    run = runs[0]
    parts = [p for p in parts_of(run) if p[0] != "total"]
    if not parts or run.series.get("total_energy") is None:
        return missing(ax, "energies")
    names, values, colors = [], [], []
    for name, value, _, color in parts:
        low = value.min() if name in ("gravity", "other potential", "potential") else 0.0
        names.append(name)
        values.append(value - low)
        colors.append(color)
    for name, value in books_of(run).items():
        names, values, colors = names + [name], values + [value], colors + [BOOKED[name]]
    work, lost = work_of(run), lost_of(run)
    lost = np.zeros_like(work) if lost is None else lost
    if lost.min() < -1e-3 * max(np.sum(values, axis=0).max(), 1e-300):
        gained = -np.minimum(lost, 0)
        ax.plot(run.observable_times, np.sum(values, axis=0) - gained, color="#222222", lw=0.9, ls=DASHES[1], label="without energy gained")
    lost = np.maximum(lost, 0)
    if lost.max() > 1e-6 * max(np.sum(values, axis=0).max(), 1e-300):
        names, values, colors = names + ["lost"], values + [lost], colors + ["#b5b5b5"]
    if np.any(work):
        ax.plot(run.observable_times, np.sum([v for n, v in zip(names, values) if n != "lost"], axis=0)[0] + work, color="#222222", lw=1.1,
                label="start and work done")
    ax.stackplot(run.observable_times, *values, labels=names, colors=colors, alpha=0.85, lw=0)
    ax.set_ylim(0, 1.05 * np.sum(values, axis=0).max())
    finish(ax, [run], axis_label("energy", run.unit("total_energy")), ncol=2, handlelength=1.2, columnspacing=1.2)
    if labels[0]:
        ax.set_title(labels[0], loc="left")


def drift_of(run):
    """What was lost since the first frame, taken negative, relative to the energy in motion: the largest kinetic energy or the
    range of the potential, which do not depend on where the potential is zero. None where there is no such energy."""
    total, lost = run.series.get("total_energy"), lost_of(run)
    if lost is None:
        return None
    kinetic, potential = (run.series.get(n) for n in ("kinetic_energy", "potential_energy"))
    scale = max([abs(total[0])] if kinetic is None or potential is None else [kinetic.max(), np.ptp(potential)])
    return -lost / scale if scale > 0 else None


def drifts(run):
    """Whether there is more to see than rounding errors."""
    change = drift_of(run)
    return change is not None and np.abs(change).max() > 1e-12


def drift(ax, runs, labels, args):
    changes = [drift_of(run) for run in runs]
    if all(change is None for change in changes):
        return missing(ax, "total energy of a motion")
    for i, (run, change) in enumerate(zip(runs, changes)):
        if change is not None:
            ax.plot(run.observable_times, change, color=COLORS[i % len(COLORS)], lw=width(i, len(runs) > 1))
    ax.axhline(0, color="#999999", lw=0.6)
    work, booked = (part.translate(str.maketrans("+-", "-+")) for part in signs(runs))
    finish(ax, runs, rf"$(E{booked}-E_0{work})\,/\,\max(E_\mathrm{{kin}},\,\Delta E_\mathrm{{pot}})$")


def _vector(ax, runs, labels, name, symbol):
    several, drawn = len(runs) > 1, 0
    for i, run in enumerate(runs):
        value = run.series.get(name)
        if value is None:
            continue
        value = value.reshape(len(value), -1)
        drawn = max(drawn, value.shape[1])
        for k in range(value.shape[1]):
            text = f"${symbol}_{'xyz'[k]}$" if k < 3 else str(k)
            ax.plot(run.observable_times, value[:, k], label=None if several else text, ls=DASHES[k % len(DASHES)],
                    color=COLORS[(i if several else k) % len(COLORS)])
    if not drawn:
        return missing(ax, name.replace("_", " "))
    for k in range(drawn if several else 0):
        ax.plot([], [], ls=DASHES[k % len(DASHES)], color="#555555", label=f"${symbol}_{'xyz'[k]}$" if k < 3 else str(k))
    finish(ax, runs, axis_label(name.replace("_", " "), runs[0].unit(name)))


def momentum(ax, runs, labels, args):
    _vector(ax, runs, labels, "momentum", "p")


def angular_momentum(ax, runs, labels, args):
    _vector(ax, runs, labels, "angular_momentum", "L")


def strain(ax, runs, labels, args):
    """Strain of the springs over time: median, the middle 90 %, extremes."""
    drawn = False
    for i, run in enumerate(runs):
        if not np.any(run.springs.strained):
            continue
        color = COLORS[i % len(COLORS)]
        rows = sample(range(run.frames), max(2, min(200, int(4e7 // len(run.springs)))))
        rows = [r for r in rows if np.isfinite(run.strains(r)).any()]
        if not rows:
            continue
        drawn = True
        bands = cleared(np.array([np.nanpercentile(run.strains(r), [0, 5, 50, 95, 100]) for r in rows]))
        t = run.times[rows]
        ax.fill_between(t, bands[:, 1], bands[:, 3], color=color, alpha=0.2, lw=0,
                        label="5 to 95 %" if len(runs) == 1 else None)
        ax.plot(t, bands[:, 2], color=color, lw=width(i, len(runs) > 1), label=None if len(runs) > 1 else "median")
        ax.plot(t, bands[:, 0], color=color, lw=0.7, ls=DASHES[2], label="extremes" if len(runs) == 1 else None)
        ax.plot(t, bands[:, 4], color=color, lw=0.7, ls=DASHES[2])
    if not drawn:
        return missing(ax, "springs with a rest length")
    finish(ax, runs, r"strain $(l-L)/L$")


def histogram(ax, runs, labels, args):
    """Distribution of the springs' strains: of one run at four times, of several runs in the frame chosen. The outermost
    thousandth on either side is gathered in the last bars."""
    asked = sample(range(runs[0].frames), 4) if len(args.frames) == 1 else [runs[0].index(frame) for frame in args.frames]
    frames = [(run, row) for run in runs for row in (asked if len(runs) == 1 else [run.index(args.frame)])]
    frames = [(run, row) for run, row in frames if np.any(run.springs.strained)]
    if not frames:
        return missing(ax, "springs with a rest length")
    values = [v[np.isfinite(v)] for v in (run.strains(row) for run, row in frames)]
    frames = [frame for frame, v in zip(frames, values) if len(v)]
    values = [v for v in values if len(v)]
    values = np.split(cleared(np.concatenate(values)), np.cumsum([len(v) for v in values[:-1]])) if values else []
    if not frames:
        return missing(ax, "springs with a strain")
    low = min(np.quantile(v, 0.001) for v in values)
    high = max(np.quantile(v, 0.999) for v in values)
    size = max(abs(low), abs(high))
    pad = 0.02 * (high - low) if high - low > 1e-9 * size else 0.02 * size or 1e-3  # all alike, but for rounding
    edges = np.linspace(low - pad, high + pad, 61)
    for i, ((run, row), v) in enumerate(zip(frames, values)):
        share, _ = np.histogram(np.clip(v, edges[0], edges[-1]), edges)
        color = TIMES[i % len(TIMES)] if len(runs) == 1 else COLORS[i % len(COLORS)]
        ax.stairs(100 * share / len(v), edges, color=color, lw=1.3,
                  label=moment(run, row, ".3g") if len(runs) == 1 else None)
    ax.set_yscale("log")
    ax.set_xlabel(r"strain $(l-L)/L$")
    ax.set_ylabel("share of the springs [%]")
    ax.xaxis.set_major_locator(MaxNLocator(5))
    ax.margins(x=0.01)
    if len(runs) == 1:
        if not few_powers(ax.yaxis, 100):
            ax.yaxis.set_major_locator(FixedLocator(10.0 ** np.arange(np.ceil(np.log10(ax.get_ylim()[0])), 2.5)))  # no marks above 100 %
            ax.yaxis.set_minor_locator(NullLocator())
        key(ax)
    else:
        few_powers(ax.yaxis, 100)
        moments = list(dict.fromkeys(moment(run, run.index(args.frame), ".3g") for run in runs))
        ax.set_title(moments[0] if len(moments) == 1 else f"frame {args.frame} of each", loc="left")


KINDS = {"energy": energy, "budget": budget, "force": force, "drift": drift, "momentum": momentum, "angular_momentum": angular_momentum,
         "strain": strain, "histogram": histogram, "steps": steps, "iterations": iterations, "paths": paths, "phase": phase,
         "stress": stress, "modulus": modulus, "state": state, "states": states, "sources": sources,
         "spectrum": spectrum, "dos": dos, "debye": debye, "participation": participation, "bfactor": bfactor,
         "avalanches": avalanches, "nonaffine": nonaffine, "nonaffine_field": nonaffine_field}
BY_RUN = ("state", "budget", "nonaffine_field")  # one panel for every run
