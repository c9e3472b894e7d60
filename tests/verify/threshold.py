#!/usr/bin/env python3
"""Where a triangular net loses its rigidity as its bonds are removed one after the other: by bisection with the program's moduli against the rank of the rigidity matrix in
NumPy; the means over nets against p_c = 0.6602 of Jacobs and Thorpe, Phys. Rev. Lett. 75, 4051 (1995)."""
from harness import run_parts
import h5py
import numpy as np

NETS = {16: (1, 2, 3, 4), 24: (1, 2, 3, 4)}  # particles along an edge: seeds

FLOPPY = 1e-8  # of the springs' stiffness: solves leave 1e-9 of it where there is none


class Net:
    """A periodic net of unit springs whose places are disordered, so that no line is straight, with all springs at rest; with the first `removed` springs of the seed's order left out."""

    def __init__(self, checks, folder, size, seed):
        self.checks, self.path, self.size, self.seed, self.springs = checks, folder / "net.h5", size, seed, 3 * size * size

    def write(self, removed):
        self.path.unlink(missing_ok=True)
        self.checks.run({"bs_task": "generate", "bs_lattice_type": "triangular", "bs_lattice_size": (self.size, self.size), "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1,
                         "bs_lattice_perturbation": 0.12, "bs_lattice_seed": self.seed, "bs_lattice_remove_fraction": removed / self.springs, "bs_output": self.path})
        with h5py.File(self.path, "r+") as f:
            del f["springs/rest_length"]  # then springs are at rest where they are
            return len(f["springs/stiffness"])

    def softest(self, removed):
        """The least eigenvalue of the stiffness tensor."""
        left = self.write(removed)
        if left != self.springs - removed:
            raise ValueError(f"{left} springs are left, not {self.springs - removed}")
        report = self.checks.run({"bs_task": "moduli", "bs_lattice_file": self.path, "condensed_pc_type": "cholesky"}).report
        return np.linalg.eigvalsh(report["stiffness"])[0]

    def resisted(self):
        """Of the three strains those that no motion of the particles follows without stretching a spring: rank of (R, E) less that of R."""
        with h5py.File(self.path) as f:
            x, pairs, shift, edges = (f[name][...] for name in ("particles/position", "springs/pairs", "springs/shift", "box/edges"))
        r = x[pairs[:, 1]] - x[pairs[:, 0]] + shift @ edges
        u = r / np.linalg.norm(r, axis=1)[:, None]
        R, row = np.zeros((len(r), 2 * len(x))), np.arange(len(r))
        for c in range(2):
            np.add.at(R, (row, 2 * pairs[:, 1] + c), u[:, c])
            np.add.at(R, (row, 2 * pairs[:, 0] + c), -u[:, c])
        E = np.stack([u[:, 0] * r[:, 0], u[:, 1] * r[:, 1], u[:, 0] * r[:, 1]], axis=1)
        return np.linalg.matrix_rank(np.hstack([R, E])) - np.linalg.matrix_rank(R)


def last_rigid(net):
    """How many bonds can go before a strain meets no resistance."""
    low, high = round(0.28 * net.springs), round(0.40 * net.springs)
    while high - low > 1:
        middle = (low + high) // 2
        if net.softest(middle) > FLOPPY:
            low = middle
        else:
            high = middle
    return low


def threshold(checks, folder):
    everything, exact = [], 0
    for size, seeds in NETS.items():
        shares = []
        for seed in seeds:
            net = Net(checks, folder, size, seed)
            removed = last_rigid(net)
            shares.append(1 - (removed + 1) / net.springs)
            stiff, floppy = net.softest(removed), net.softest(removed + 1)
            checks.true(f"{size} x {size}, seed {seed}: without {removed} bonds rigid, without one more not", stiff > FLOPPY > abs(floppy), f"{stiff:.3g} and {floppy:.3g}")
            ranks = []
            for more in range(3):
                net.write(removed + more)
                ranks.append(net.resisted())
            checks.true(f"{size} x {size}, seed {seed}: numpy says so", ranks[0] == 3 > ranks[2], f"strains resisted as further bonds go: {ranks}")
            exact += ranks[1] < 3
        print(f"  {size} x {size}: p_c = {np.mean(shares):.4f}, standard deviation of {len(seeds)} nets {np.std(shares, ddof=1):.4f}", flush=True)
        everything += shares
    checks.true("to the very bond but where one more leaves a stiffness below 1e-8", exact >= len(everything) - 1, f"{exact} of {len(everything)}")
    checks.near("the mean of all thresholds", np.mean(everything), 0.6602, 0.01)


if __name__ == "__main__":
    run_parts("threshold of rigidity of diluted triangular nets", (threshold,))
