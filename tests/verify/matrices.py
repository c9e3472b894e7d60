#!/usr/bin/env python3
"""-bs_write_matrices: M, K = df/dx and D = df/dv against finite differences of forces written out here, and against the modes."""
import io
import pathlib
import tempfile

import numpy as np
from harness import Checks, write_lattice
from modes import Modes
from petsc_files import read_matrix
from scipy.io import mmread
from scipy.linalg import eigh

NAMES = ("M", "K", "D")
FILES = tuple(f"out_{name}{ending}" for name in NAMES for ending in (".mtx", ".petsc"))


def force(x, v, pairs, k, L, damping, drag):
    """Hooke springs with dampers along them, and Stokes drag."""
    f = -drag * v
    arm = x[pairs[:, 1]] - x[pairs[:, 0]]
    l = np.linalg.norm(arm, axis=1)[:, None]
    u = arm / l
    pull = k * (l - L) * u + damping * ((v[pairs[:, 1]] - v[pairs[:, 0]]) * u).sum(1)[:, None] * u
    np.add.at(f, pairs[:, 0], pull)
    np.add.at(f, pairs[:, 1], -pull)
    return f


def differences(call, at, free, h=1e-6):
    """d call/d at (free components) by central differences of fourth order."""
    columns = []
    for k in np.flatnonzero(free):
        step = np.zeros(at.size)
        step[k] = h
        step = step.reshape(at.shape)
        column = (8 * (call(at + step) - call(at - step)) - (call(at + 2 * step) - call(at - 2 * step))) / (12 * h)
        columns.append(column.ravel()[free])
    return np.array(columns).T


def main():
    checks = Checks("matrices for other programs")
    rng = np.random.default_rng(8)
    n, d = 9, 3
    x, v = rng.uniform(size=(n, d)), rng.normal(size=(n, d))
    m, fixed = rng.uniform(0.5, 2, n), np.arange(n) == 4
    v[fixed] = 0
    pairs = np.array([(i, j) for i in range(n) for j in range(i + 1, n) if (i + j) % 3])
    k, L, damping, drag = 3.0, 0.4, 0.2, 0.05
    free = np.repeat(~fixed, d)
    f = lambda x, v: force(x, v, pairs, k, L, damping, drag)  # noqa: E731
    with tempfile.TemporaryDirectory() as folder:
        lattice = write_lattice(pathlib.Path(folder) / "net.h5", x, m, velocity=v, fixed=fixed, pairs=pairs, stiffness=k, rest_length=L, damping=damping)
        options = {"bs_lattice_file": lattice, "bs_stokes_drag": drag, "ts_max_steps": 1, "bs_write_matrices": "out"}
        for ranks in (1, 2, 3):
            files = checks.run(options, ranks=ranks, keep=FILES).files
            found = {name: mmread(io.BytesIO(files[f"out_{name}.mtx"])).toarray() for name in NAMES}
            for name in NAMES:
                checks.near(f"{name}, {ranks} ranks: both formats alike", read_matrix(files[f"out_{name}.petsc"]), found[name], 0)
                checks.true(f"{name}, {ranks} ranks: its header says what it is", b"of M x'' = f(t, x, v)" in files[f"out_{name}.mtx"][:200])
            checks.near(f"M, {ranks} ranks", found["M"], np.diag(np.repeat(m, d)[free]), 0)
            checks.near(f"K, {ranks} ranks, by differences", found["K"], differences(lambda at: f(at, v), x, free), 1e-8)
            checks.near(f"D, {ranks} ranks, by differences", found["D"], differences(lambda at: f(x, at), v, free), 1e-8)
        still = write_lattice(pathlib.Path(folder) / "still.h5", x, m, fixed=fixed, pairs=pairs, stiffness=k, rest_length=L)
        files = checks.run({"bs_lattice_file": still, "bs_task": "modes", "bs_modes": 24, "bs_write_matrices": "out"}, keep=FILES).files
        K, M = (mmread(io.BytesIO(files[f"out_{name}.mtx"])).toarray() for name in "KM")
        checks.near("omega^2 of the written matrices", Modes(checks, still, 24).omega_squared, eigh(-K, M, eigvals_only=True), 1e-10)
        hung = write_lattice(pathlib.Path(folder) / "hung.h5", [[0.0, 0.0], [0.0, -1.0]], 2.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=50.0, rest_length=1.0)
        files = checks.run({"bs_lattice_file": hung, "bs_task": "statics", "bs_gravity": (0.0, -9.81), "bs_write_matrices": "out"}, keep=FILES).files
        K = mmread(io.BytesIO(files["out_K.mtx"])).toarray()
        checks.near("K at the equilibrium of a hung mass", K, -np.diag([2 * 9.81 / (1 + 2 * 9.81 / 50), 50.0]), 1e-8)
    checks.finish()


if __name__ == "__main__":
    main()
