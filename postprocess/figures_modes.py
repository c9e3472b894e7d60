"""Panels of modes of free vibration: frequencies, densities of states, participation ratios, B-factors."""
import os

import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from backspring_io import RunError
from figure_style import COLORS, axis_label, few_powers, key, missing, number, short_marks
from modes import modes_of, per_time


def frequencies(run):
    """omega (n,) [1/s] of the modes that swing, ascending, and their places among all in the file."""
    squared = modes_of(run, "omega_squared")
    where = np.flatnonzero(squared > 0)
    return np.sqrt(squared[where]), where


def density(omega, edges, motions):
    """D(omega) (bins,) [s]: modes in each interval over its width and the number of motions there are, so that it is 1 in sum over all."""
    return np.histogram(omega, edges)[0] / np.diff(edges) / motions


def motions_of(run):
    """Components of particles that can move; those of particles that are not fixed in files of versions that did not write them."""
    written = run._array("/modes/motions")
    return int(written[0]) if written is not None else run.dim * max(1, int((~run.fixed).sum()))


def few_of_all(run):
    """Words for the modes in the file where they are less than a tenth of all: too few to tell a density; '' where they are not."""
    found, every = len(modes_of(run, "omega_squared")), motions_of(run)
    return f"{run.path}: holds {found} of {every} modes" if 10 * found < every else ""


def dos(ax, runs, labels, args):
    """Density of states D(omega); ticks at the modes themselves where they are few, and of one run. A file with the lowest modes alone has the beginning of it."""
    few = 200
    for i, run in enumerate(runs):
        omega, _ = frequencies(run)
        if not len(omega):
            return missing(ax, "modes with omega^2 > 0")
        edges = np.linspace(omega[0], max(omega[-1], omega[0] * (1 + 1e-9)), 1 + max(5, min(80, int(2 * len(omega) ** 0.5))))
        ax.stairs(density(omega, edges, motions_of(run)), edges, color=COLORS[i % len(COLORS)], lw=1.3, label=labels[i] or None)
        if len(omega) <= few and len(runs) == 1:
            ax.plot(omega, np.zeros_like(omega), "|", color=COLORS[1], ms=9, clip_on=False, label="the modes")
            key(ax)
    ax.set_xlabel(axis_label(r"frequency $\omega$", "rad/" + runs[0].unit("time")))
    ax.set_ylabel(axis_label(r"density of states $D(\omega)$", runs[0].unit("time")))
    ax.margins(x=0.01)


def debye(ax, runs, labels, args):
    """D(omega)/omega^(d-1), in intervals of equal ratios: level where Debye's law holds."""
    power = runs[0].dim - 1
    for i, run in enumerate(runs):
        omega, _ = frequencies(run)
        if len(omega) < 12 or omega[-1] < 1.05 * omega[0]:
            return missing(ax, "range of frequencies")
        edges = reduced_edges(omega)
        if len(edges) < 4:
            return missing(ax, "range of frequencies")
        middle = np.sqrt(edges[1:] * edges[:-1])
        value = density(omega, edges, motions_of(run)) / middle ** power
        full = value > 0
        ax.plot(middle[full], value[full], "o-", ms=3.5, lw=1.0, color=COLORS[i % len(COLORS)], label=labels[i] or None)
    ax.set_xscale("log")
    ax.set_yscale("log")
    for axis in (ax.xaxis, ax.yaxis):
        if not few_powers(axis):
            axis.set_minor_formatter(NullFormatter())
    ax.set_xlabel(axis_label(r"frequency $\omega$", "rad/" + runs[0].unit("time")))
    unit = runs[0].unit("time") + {1: "", 2: "$^2$", 3: "$^3$"}[runs[0].dim]
    ax.set_ylabel(axis_label(r"$D(\omega)$" + {0: "", 1: r"$/\omega$", 2: r"$/\omega^2$"}[power], unit))


def reduced_edges(omega, least=6):
    """Edges of intervals of equal ratios, wide enough for `least` modes in the mean; joined from below until each of the first holds as many."""
    count = int(np.clip(len(omega) / least, 3, 40))
    edges = np.geomspace(omega[0] * (1 - 1e-9), omega[-1] * (1 + 1e-9), count + 1)
    kept = [edges[0]]
    for edge in edges[1:]:
        if ((omega >= kept[-1]) & (omega < edge)).sum() >= least or edge == edges[-1]:
            kept.append(edge)
    return np.array(kept)


def participation_ratios(run, where):
    """(n,): (sum of e^2)^2/(N sum of e^4) over the particles, e^2 = m q.q: 1 where all move alike, 2/3 of a standing wave, 1/N where one moves."""
    mass = np.ones(run.particles) if run.mass is None else run.mass
    out = []
    for mode in where:
        energy = mass * (run._read("/modes/shape", int(mode)) ** 2).sum(axis=1)
        out.append(energy.sum() ** 2 / (run.particles * (energy ** 2).sum()))
    return np.array(out)


def participation(ax, runs, labels, args):
    """Participation ratio of every mode over its frequency."""
    for i, run in enumerate(runs):
        omega, where = frequencies(run)
        if not len(omega):
            return missing(ax, "modes with omega^2 > 0")
        size, opacity = short_marks(len(omega))
        ax.plot(omega, participation_ratios(run, where), "o", ms=size, mew=0, alpha=opacity, color=COLORS[i % len(COLORS)], label=labels[i] or None)
    ax.axhline(2 / 3, color="#999999", lw=0.8, ls=(0, (4, 2)), zorder=1)
    ax.annotate("2/3", (1, 2 / 3), xycoords=("axes fraction", "data"), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8, color="#777777")
    ax.set_ylim(0, 1.05)
    ax.set_xlabel(axis_label(r"frequency $\omega$", "rad/" + runs[0].unit("time")))
    ax.set_ylabel("participation ratio")


def spectrum(ax, runs, labels, args):
    """Frequencies of the modes in ascending order; unstable ones below zero, as growth rates."""
    for i, run in enumerate(runs):
        squared = modes_of(run, "omega_squared")
        ax.plot(np.arange(len(squared)), np.sign(squared) * np.sqrt(np.abs(squared)) / (2 * np.pi), ".", color=COLORS[i % len(COLORS)], label=labels[i] or None)
    ax.axhline(0, color="#999999", lw=0.6)
    ax.set_xlabel("mode")
    ax.set_ylabel(axis_label(r"frequency $\omega/2\pi$", per_time(runs[0])))


def _residues(ax, protein):
    """Residue numbers along the axis, with the chain where there are several; a line where a chain ends."""
    several = len(set(protein.chain)) > 1
    ax.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: (protein.chain[round(v)] + " " if several else "") + protein.residue[round(v)]
                                               if 0 <= round(v) < len(protein.residue) else ""))
    for k in range(1, len(protein.chain)):
        if protein.chain[k] != protein.chain[k - 1]:
            ax.axvline(k - 0.5, color="#bbbbbb", lw=0.8)
    ax.set_xlabel("residue")


def fitted(given, moves):
    """(B_0, kT) of least squares of given - B_0 - kT moves, B_0 >= 0."""
    offset, scale = np.linalg.lstsq(np.stack([np.ones_like(moves), moves], axis=1), given, rcond=None)[0]
    return (offset, scale) if offset >= 0 else (0.0, (given @ moves) / (moves @ moves))


def bfactor(ax, runs, labels, args):
    """B-factors 8 pi^2/3 kT sum of q^2/omega^2; beside those of --pdb, B_0 + kT times them by least squares, with the correlation. B_0, what all atoms have in common
    (disorder of the crystal, motion of the whole), is 0 where it came out negative."""
    ax.set_xlabel("particle")
    for i, run in enumerate(runs):
        moves = modes_of(run, "fluctuation") * 8 * np.pi ** 2 / 3
        said = labels[i] or "modes"
        if args.pdb:
            from protein import read_pdb
            protein = read_pdb(args.pdb)
            given = protein.b_factor
            if len(given) != len(moves):
                raise RunError(f"{args.pdb}: {len(given)} C-alpha atoms, {len(moves)} particles in {run.path}")
            offset, scale = fitted(given, moves)
            moves = offset + scale * moves
            said += f", $B_0$ = {number(offset, '.3g')}, $kT$ = {number(scale, '.3g')}, r = {np.corrcoef(given, moves)[0, 1]:.3f}"
            if i == 0:
                ax.plot(given, color="#555555", lw=1.0, label=os.path.basename(args.pdb))
                _residues(ax, protein)
        ax.plot(moves, color=COLORS[i % len(COLORS)], lw=1.3, label=said)
    ax.set_ylabel("B-factor" + (r" [$\mathrm{\AA}^2$]" if args.pdb else r"$/kT$, $8\pi^2/3\,\sum q^2/\omega^2$"))
    ax.margins(x=0.01)
    key(ax, ncol=2, columnspacing=1.2)
