"""What the tutorial of structures says of its results, found in other ways: Newton's method with a given displacement, a sum of sines, dense matrices,
the effective medium."""
import csv

import h5py
import numpy as np

import forces


def trusses(run, k, keep=lambda a, b: np.full(len(a), True)):
    """Places, bonds with directions, and the dense stiffness matrix of a run's net at its start, of the springs that `keep(ends, ends)` leaves."""
    with h5py.File(run) as f:
        x, bonds = f["particles/trajectory/position/value"][0], f["connectivity/bonds"][...]
        groups = {name: f["groups/" + name][...] for name in f["groups"]}
    bonds = bonds[keep(x[bonds[:, 0]], x[bonds[:, 1]])]
    n, d = x.shape
    e = x[bonds[:, 1]] - x[bonds[:, 0]]
    e /= np.linalg.norm(e, axis=1)[:, None]
    K = np.zeros((n, d, n, d))
    for p, q, sign in ((0, 0, 1), (1, 1, 1), (0, 1, -1), (1, 0, -1)):
        np.add.at(K, (bonds[:, p], slice(None), bonds[:, q]), sign * k * e[:, :, None] * e[:, None, :])
    return bonds, e, K.reshape(n * d, n * d), groups


def displaced(K, held, given):
    """Displacements where the components `held` have the values `given`."""
    free = np.setdiff1d(np.arange(len(K)), held)
    u = np.zeros(len(K))
    u[held] = given
    u[free] = np.linalg.lstsq(K[np.ix_(free, free)], -K[np.ix_(free, held)] @ u[held], rcond=None)[0]
    return u


def grid_sink(n, pull):
    """Sinking of the middle of n x n meshes under F l/T = pull: a sum over the sines that vanish at the frame."""
    k = np.arange(1, n) * np.pi / n
    s = np.sin(k * n / 2) ** 2
    return pull * 4 / n**2 * np.sum(np.outer(s, s) / (4 * np.sin(k[:, None] / 2) ** 2 + 4 * np.sin(k / 2) ** 2))


def numbers(checks, folder):
    checks.near("limit load of the dome", forces.dome_limit()[1], 29.629, 5e-4)
    with h5py.File(folder / "net_light.h5md") as f:
        sunk = -f["particles/trajectory/position/value"][-1, 40, 2]
    checks.near("the middle of the net", sunk, grid_sink(8, 0.1 * 0.25 / 50), 1e-9)
    bonds, e, K, groups = trusses(folder / "beam.h5md", 1000.0)
    left, right, load = (2 * groups[name][0] for name in ("left", "right", "load"))
    u = displaced(K, [left, left + 1, right + 1, load + 1], [0, 0, 0, 1]).reshape(-1, 2)
    checks.near("stiffness of the beam", (K @ u.ravel())[load + 1], 9.24, 5e-3)
    checks.near("the beam yields at", 2 / (1000 * np.abs(np.sum((u[bonds[:, 1]] - u[bonds[:, 0]]) * e, axis=1)).max()), 0.134, 5e-4)

    def spared(a, b):
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (11 - a[:, 1]) / (b[:, 1] - a[:, 1])
        return ~((s > 0) & (s < 1) & (a[:, 0] + s * (b[:, 0] - a[:, 0]) < 9))

    _, _, K, groups = trusses(folder / "crack.h5md", 1.0, spared)
    ends = np.concatenate([groups["lower"], groups["upper"]])
    held = np.concatenate([2 * ends, 2 * ends + 1])
    u = displaced(K, held, np.isin(held, 2 * groups["upper"] + 1).astype(float))
    checks.near("stiffness of the plate", (K @ u)[2 * groups["upper"] + 1].sum(), 1.604, 5e-4)
    with open(folder / "dilution/averages.csv") as f:
        rows = [row for row in csv.DictReader(f) if row["column"] == "shear_modulus"]
    for row in rows:
        p = float(row["1-bs_lattice_stiff_fraction"])
        tolerance = 1e-12 if p in (0.6, 1) else 2.5 * float(row["standard_error"])
        checks.near(f"shear modulus at p = {p:g}", float(row["mean"]), max(0, np.sqrt(3) / 4 * (3 * p - 2)), tolerance)
