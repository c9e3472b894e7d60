"""Modes of free vibration (-bs_task modes) as motions, and their plots."""
import os

import numpy as np

from backspring_io import Run, RunError
from figure_style import COLORS, missing

FRAMES = 48  # of one period


def _modes(run, name):
    values = run._array("/modes/" + name)
    if values is None:
        raise RunError(f"{run.path}: holds no modes; write them with -bs_task modes -bs_output")
    return values


class ModeRun(Run):
    """Mode `number` (from 0) as one period of motion about the frame it was taken at, with its largest displacement `scale` of
    the lattice's size. Rows are moments of the period; a mode that grows or costs no force is shown as if it swung, in 1 s. Strains are those of the mode, linear in
    its displacements: a rotation has none, however large it is drawn."""
    strain_name = r"strain of the mode $\mathbf{n}\cdot(\mathbf{q}_2-\mathbf{q}_1)/L$"
    static = False  # about an equilibrium or not, it swings

    def __init__(self, path, number, scale):
        super().__init__(path)
        try:
            if self.kind != "particles":
                raise RunError(f"{self.path}: a linear system has no modes")
            squared = _modes(self, "omega_squared")
            if not 0 <= number < len(squared):
                raise RunError(f"{self.path}: no mode {number}; there are {len(squared)}, counted from 0")
            self.omega_squared = float(squared[number])
            shape = self._read("/modes/shape", number)
            x = self.position(0)
            size = float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0
            q = scale * size * shape / np.sqrt((shape ** 2).sum(axis=1).max())
        except RunError:
            self.close()
            raise
        period = 2 * np.pi / np.sqrt(self.omega_squared) if self.omega_squared > 0 else 1.0
        phase = 2 * np.pi * np.arange(FRAMES) / FRAMES
        self.sine = np.sin(phase)
        self._largest = self._strain_at_largest(q)
        self.frames, self.times, self.step = FRAMES, phase / (2 * np.pi) * period, np.arange(FRAMES)
        self.positions = x[None] + self.sine[:, None, None] * q[None]
        self.velocities = (2 * np.pi / period) * np.cos(phase)[:, None, None] * q[None]

    def _strain_at_largest(self, q):
        """(M,): n.(q_2 - q_1)/L with the spring's direction n where the mode was taken."""
        springs = self.springs
        apart = self.position(0)[springs.pairs[:, 1]] - self.position(0)[springs.pairs[:, 0]]
        if springs.shift is not None:
            apart = apart + springs.shift @ self.box_edges(0)
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (apart * (q[springs.pairs[:, 1]] - q[springs.pairs[:, 0]])).sum(axis=1) / np.sqrt((apart ** 2).sum(axis=1))
            return np.where((springs.rest_length > 0) & self.acting(0), along / springs.rest_length, np.nan)

    def strains(self, frame):
        """Strains (M,) of the mode alone, first order in its displacements; NaN as in any run."""
        return self.sine[frame] * self._largest

    def box_edges(self, frame):
        return super().box_edges(0)

    def broken(self, frame):
        return super().broken(0)

    def spring_state(self, name, frame):
        return super().spring_state(name, 0)


def dos(ax, runs, labels, args):
    """Density of states: how many modes there are for each frequency; ticks at the modes themselves where they are few."""
    few = 200
    for i, run in enumerate(runs):
        squared = _modes(run, "omega_squared")
        f = np.sqrt(squared[squared > 0]) / (2 * np.pi)
        if not len(f):
            return missing(ax, "modes with omega^2 > 0")
        bins = max(5, min(80, int(2 * len(f) ** 0.5)))
        ax.hist(f, bins=bins, histtype="step", color=COLORS[i % len(COLORS)], lw=1.3, label=labels[i] or None)
        if len(f) <= few and len(runs) == 1:
            ax.plot(f, np.zeros_like(f), "|", color=COLORS[1], ms=9, clip_on=False)
    ax.set_xlabel(r"frequency $\omega/2\pi$ [1/s]")
    ax.set_ylabel("modes in each interval")
    ax.margins(x=0.01)


def spectrum(ax, runs, labels, args):
    """Frequencies of the modes in ascending order; unstable ones below zero, as growth rates."""
    for i, run in enumerate(runs):
        squared = _modes(run, "omega_squared")
        ax.plot(np.arange(len(squared)), np.sign(squared) * np.sqrt(np.abs(squared)) / (2 * np.pi), ".", color=COLORS[i % len(COLORS)], label=labels[i] or None)
    ax.axhline(0, color="#999999", lw=0.6)
    ax.set_xlabel("mode")
    ax.set_ylabel(r"frequency $\omega/2\pi$ [1/s]")


def bfactor(ax, runs, labels, args):
    """Mean square fluctuations by the modes as B-factors; beside those of --pdb, to which they are scaled, with the correlation."""
    for i, run in enumerate(runs):
        moves = _modes(run, "fluctuation") * 8 * np.pi ** 2 / 3
        said = labels[i] or "modes"
        if args.pdb:
            from protein import read_pdb
            given = read_pdb(args.pdb).b_factor
            if len(given) != len(moves):
                raise RunError(f"{args.pdb}: {len(given)} C-alpha atoms, {len(moves)} particles in {run.path}")
            moves = moves * given.sum() / moves.sum()
            said += f", r = {np.corrcoef(given, moves)[0, 1]:.3f}"
            if i == 0:
                ax.plot(given, color="#555555", lw=1.0, label=os.path.basename(args.pdb))
        ax.plot(moves, color=COLORS[i % len(COLORS)], lw=1.3, label=said)
    ax.set_xlabel("particle")
    ax.set_ylabel("B-factor" + (r" [$\mathrm{\AA}^2$]" if args.pdb else r"$/kT$, $8\pi^2/3\,\sum q^2/\omega^2$"))
    ax.legend(loc="best")
    ax.margins(x=0.01)
