#!/usr/bin/env python3
"""What -bs_task modes says of its lists: nets with many equal, zero and negative omega^2, against all eigenvalues of a dense matrix.

A list that is called counted or searched holds the right values with all copies, zero and unstable modes are counted or said to be at least so many, and no
run fails. `unknown` is allowed to the iterative solver beside many zero modes, which it meets one after the other."""
import collections
import itertools
import pathlib
import tempfile

import numpy as np
from harness import Checks, write_lattice
from modes import dense, grid, near_pairs, stiffness

COUNT = 9
KINDS = ("smallest", "largest", "target")
SOLVERS = ("dense", "direct", "iterative")
NOTHING = 1e-12  # of the largest omega^2: below it a dense eigenvalue is rounding


class Net:
    """A lattice file and all its omega^2, ascending, those that are rounding put to 0."""

    def __init__(self, folder, name, x, pairs, k, rest, mass=1.0, fixed=None, box=None, shift=None, inside=0.5):
        self.name, self.inside, n = name, inside, len(x)
        free = np.ones(n, bool) if fixed is None else ~fixed
        ends = x if box is None else np.concatenate([x, x[pairs[:, 1]] + shift @ box])
        joined = pairs if box is None else np.c_[pairs[:, 0], n + np.arange(len(pairs))]
        A = stiffness(ends, joined, k, rest)
        if box is not None:  # an image moves as its particle does
            d = x.shape[1]
            fold = np.kron(np.r_[np.eye(n), np.eye(n)[pairs[:, 1]]], np.eye(d))
            A = fold.T @ A @ fold
        self.values = dense(A, np.broadcast_to(mass, n), x.shape[1], free)[0]
        self.values[np.abs(self.values) < NOTHING * self.values[-1]] = 0
        self.zero, self.unstable = int((self.values == 0).sum()), int((self.values < 0).sum())
        self.file = write_lattice(folder / (name.replace(" ", "_") + ".h5"), x, mass, fixed=fixed, pairs=pairs, stiffness=k, rest_length=rest, box=box, shift=shift)

    def target(self):
        """Inside the spectrum, near a multiple omega^2."""
        return 1.001 * self.values[int(self.inside * len(self.values))]

    def nearest(self, kind, keep):
        """The K omega^2 that the list must hold, ascending."""
        values = self.values if keep else self.values[self.values != 0]
        order = {"smallest": values, "largest": -values, "target": np.abs(values - self.target())}[kind]
        return np.sort(values[np.argsort(order, kind="stable")[:COUNT]])


def edges_of(x):
    return (x == x.min(0)).any(1) | (x == x.max(0)).any(1)


def flat(counts):
    """A square net in the plane z = 0 of space, with its pairs."""
    x = np.c_[grid(counts), np.zeros(np.prod(counts))]
    return x, near_pairs(x, 1.1)


def triangular(n):
    """A rhombus of n x n particles in a periodic box, which has the lattice's sixfold axis."""
    edges = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    cells = grid((n, n)).astype(int)
    pairs, shift = [], []
    for step in ((1, 0), (0, 1), (-1, 1)):
        to = cells + step
        pairs.append(np.c_[np.arange(n * n), (to % n) @ [n, 1]])
        shift.append(to // n)
    return cells @ edges, np.concatenate(pairs), n * edges, np.concatenate(shift)


def nets(folder):
    x, pairs = flat((11, 11))
    yield Net(folder, "membrane", x, pairs, 1.0, 0.5, fixed=edges_of(x[:, :2]))
    x, pairs, box, shift = triangular(12)
    yield Net(folder, "periodic triangles", x, pairs, 1.0, 1.0, box=box, shift=shift)
    x = grid((5, 5, 5))
    pairs = near_pairs(x, 1.5)
    yield Net(folder, "free cube", x, pairs, 1.0, np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1))
    x = grid((6, 6, 6))
    pairs = near_pairs(x, 1.5)  # enough unknowns for an iterative search inside the spectrum
    yield Net(folder, "held cube", x, pairs, 1.0, np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1), fixed=x[:, 2] == 0, inside=0.05)
    x = flat((10, 10))[0]
    pairs = near_pairs(x, 1.5)
    yield Net(folder, "cloth", x, pairs, 20.0, np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1), mass=1e-3, fixed=(x[:, 0] == 9) & (x[:, 1] % 9 == 0))
    x, pairs = flat((10, 10))
    yield Net(folder, "pressed net", x, pairs, 1.0, 1.02, fixed=edges_of(x[:, :2]))


def walk(checks, net, kind, solver, ranks, keep, seen):
    label = f"{net.name}, {kind}, {solver}, {ranks} ranks{', zero modes kept' if keep else ''}"
    options = {"bs_lattice_file": net.file, "bs_task": "modes", "bs_modes": COUNT, "bs_modes_which": kind, "bs_modes_solver": solver,
               "bs_modes_target": net.target() if kind == "target" else None, "bs_modes_rigid": "keep" if keep else None}
    done = checks.run(options, ranks=ranks, expect=None)
    got, expected = done.report, net.nearest(kind, keep)
    checks.true(label + ": exit 0", done.code == 0, done.stderr.strip().splitlines()[-1] if done.code else "")
    if done.code:
        seen[kind, solver, "exit 3"] += 1
        return
    known = got["completeness"]
    seen[kind, solver, known] += 1
    many_zero = solver == "iterative" and net.zero > 10 * COUNT
    checks.true(label + ": completeness", known in (("searched", "counted", "unknown") if many_zero else ("searched", "counted") if solver == "iterative" else ("counted",)), known)
    checks.true(label + ": completeness is said", f"completeness={known} " in done.stdout and ("copies of a multiple" in done.stderr) == (known == "unknown"))
    found = np.array(got["omega_squared"])
    error = np.max(np.abs(found - expected)) / net.values[-1] if len(found) == len(expected) else np.inf
    checks.below(label + f": omega^2 with copies, {got['completeness']}", error, 1e-9)
    for what, true in (("zero", net.zero), ("unstable", net.unstable)):
        count, exact = got[what + "_modes"], got[what + "_modes_exact"]
        checks.true(label + f": {what} modes are exact only where they are counted", known == "counted" or not exact)
        checks.true(label + f": {what} modes", count == true if exact else count <= true, f"{count}{'' if exact else ' or more'}, {true} there")


def check_soft(checks, folder):
    """A chain on a soft anchor swings as a whole: k_a/m of the total mass, small but not zero."""
    n, soft = 70, 1e-5
    x, pairs = np.arange(float(n))[:, None], np.c_[np.arange(n - 1), np.arange(1, n)]
    anchors = {"particle": [0], "point": [[-1.0]], "stiffness": [soft], "rest_length": [1.0], "damping": [0.0]}
    file = write_lattice(folder / "soft.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0, anchors=anchors)
    A = stiffness(x, pairs, 1.0, 1.0)
    A[0, 0] += soft
    exact = np.linalg.eigvalsh(A)[0]
    checks.near("a chain on a soft anchor: k_a/m to first order", exact / (soft / n), 1.0, 1e-3)
    for solver in SOLVERS:
        got = checks.run({"bs_lattice_file": file, "bs_task": "modes", "bs_modes": 1, "bs_modes_solver": solver}).report
        checks.near(f"a chain on a soft anchor, {solver}: omega^2", got["omega_squared"][0] / exact if got["omega_squared"] else 0.0, 1.0, 1e-7)
        checks.true(f"a chain on a soft anchor, {solver}: no zero mode", got["zero_modes"] == got["rigid_motions"] == 0)


def check_exhausted(checks, folder):
    """Of 98 motions without stiffness all that the iterative solver searches in converges at once."""
    cloth = {"bs_lattice_type": "cloth", "bs_lattice_size": "10,10", "bs_lattice_neighbors": 12, "bs_lattice_spacing": 0.04, "bs_lattice_particle_mass": 1e-3,
             "bs_lattice_fixed_particles": "90,99", "bs_lattice_stiffness": "20,10,0.5", "bs_spring_law": "strain", "bs_task": "modes", "bs_modes": 3}
    got, expected = (checks.run({**cloth, "bs_modes_solver": solver}).report for solver in ("iterative", "dense"))
    checks.near("a cloth with 98 motions without stiffness: omega^2", np.array(got["omega_squared"]) / expected["omega_squared"], 1.0, 1e-9)
    checks.true("and how many these are", got["zero_modes"] <= expected["zero_modes"] == 98 and got["unstable_modes"] == 0, f"{got['zero_modes']}")


def main():
    checks = Checks("completeness of lists of modes")
    seen = collections.Counter()
    with tempfile.TemporaryDirectory() as name:
        for title, check in (("soft", check_soft), ("exhausted", check_exhausted)):
            if checks.wants(title):
                with checks.group(title):
                    check(checks, pathlib.Path(name))
        for net in nets(pathlib.Path(name)):
            if not checks.wants(net.name):
                continue
            cases = [c for c in itertools.product(KINDS, SOLVERS, (1, 3), (False, True)) if not c[3] or (c[0] == "smallest" and c[2] == 1)]
            with checks.group(net.name):
                checks.each([c for c in cases if c[2] == 1], lambda mine, case, net=net: walk(mine, net, *case, seen))
                for case in cases:  # ranks that wait for each other slow down what runs beside them
                    if case[2] > 1:
                        walk(checks, net, *case, seen)
    for (kind, solver, what), count in sorted(seen.items()):
        print(f"  {kind}, {solver}: {what} in {count} runs")
    checks.finish()


if __name__ == "__main__":
    main()
