"""What the tutorial of structures says of its results, found in other ways: Newton's method with a given displacement, a sum of sines, dense matrices,
the effective medium, least squares, the rank of a matrix."""
import csv

import h5py
import numpy as np
from scipy.optimize import least_squares

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
        p = float(row["1-bs_lattice_remove_fraction"])
        tolerance = 1e-12 if p in (0.6, 1) else 2.5 * float(row["standard_error"])
        checks.near(f"shear modulus at p = {p:g}", float(row["mean"]), max(0, np.sqrt(3) / 4 * (3 * p - 2)), tolerance)
    fibres(checks, folder)
    packing(checks, folder)


def directions(path):
    """Places, ends, ways to the other end, and the rows (M, N d) that take displacements to the springs' stretches, of a periodic lattice file."""
    with h5py.File(path) as f:
        x, pairs, shift, edges = (f[name][...] for name in ("particles/position", "springs/pairs", "springs/shift", "box/edges"))
    r = x[pairs[:, 1]] - x[pairs[:, 0]] + shift @ edges
    return x, pairs, shift, edges, r, stretches(pairs, r, len(x))


def stretches(pairs, r, n):
    row, u = np.arange(len(pairs)), r / np.linalg.norm(r, axis=1)[:, None]
    R = np.zeros((len(pairs), n, 2))
    R[row, pairs[:, 1]] += u
    R[row, pairs[:, 0]] -= u
    return R.reshape(len(pairs), -1)


def fibres(checks, folder):
    """The shear modulus of springs and bends b.(u_1 - u_2)/l_1 + b.(u_3 - u_2)/l_2, b across a line, with the particles relaxed; whether the net without bending can be sheared freely."""
    x, pairs, shift, edges, r, R = directions(folder / "fibres.h5")
    with h5py.File(folder / "fibres.h5") as f:
        triples, boxes, kappa = f["angles/triples"][...], f["angles/shift"][...].reshape(-1, 3, 2), f["angles/stiffness"][...]
    at = [x[triples[:, a]] + boxes[:, a] @ edges for a in range(3)]
    B, strained = np.zeros((len(triples), len(x), 2)), np.zeros(len(triples))
    along = at[2] - at[0]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    for end in (0, 2):
        way = at[end] - at[1]
        weight = across / np.linalg.norm(way, axis=1)[:, None]
        np.add.at(B, (np.arange(len(triples)), triples[:, end]), weight)
        np.add.at(B, (np.arange(len(triples)), triples[:, 1]), -weight)
        strained += weight[:, 0] * way[:, 1]  # u = (y, 0) gamma
    C = np.vstack([R, np.sqrt(kappa)[:, None] * B.reshape(len(triples), -1)])
    e = np.concatenate([r[:, 0] * r[:, 1] / np.linalg.norm(r, axis=1), np.sqrt(kappa) * strained])
    left = e - C @ np.linalg.lstsq(C, e, rcond=1e-12)[0]
    with h5py.File(folder / "soft.h5md") as f:
        checks.near("shear modulus of fibres", f["moduli/stiffness"][2, 2], left @ left / np.linalg.det(edges), 1e-9)

    x, pairs, shift, edges, r, _ = directions(folder / "ropes.h5")
    with h5py.File(folder / "ropes.h5") as f:
        rest = f["springs/rest_length"][...]
    with h5py.File(folder / "ropes.h5md") as f:
        start = f["particles/trajectory/position/value"][30]  # at the shear 0.30

    def ways(y, shear):
        return y.reshape(-1, 2)[pairs[:, 1]] - y.reshape(-1, 2)[pairs[:, 0]] + shift @ edges @ np.array([[1, shear], [0, 1]]).T
    checks.near("stretches of ropes at the shear 0.30", np.linalg.norm(ways(start, 0.30), axis=1), rest, 1e-6)
    found = least_squares(lambda y: np.linalg.norm(ways(y, 0.31), axis=1) - rest, (start + np.outer(start[:, 1] * 0.01, [1, 0])).ravel(),
                          jac=lambda y: stretches(pairs, ways(y, 0.31), len(x)), xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=60)
    checks.true("ropes are taut at the shear 0.31", found.cost > 1e-6, f"{found.cost:.2g} J")


def packing(checks, folder):
    x, pairs, _, _, _, R = directions(folder / "packing.h5")
    with h5py.File(folder / "packing.h5md") as f:
        omega = f["modes/omega_squared"][...]
    rank = np.linalg.matrix_rank(R)
    checks.true("motions less states of self-stress of the packing", (np.sum(omega < 1e-12), len(pairs) - rank) == (2, 33) and x.size - len(pairs) == 2 - 33, f"{len(pairs) - rank} states")
    checks.near("squares of the packing's frequencies", omega, np.linalg.eigvalsh(R.T @ R), 1e-12)
