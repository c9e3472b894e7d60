#!/usr/bin/env python3
"""Angle springs along straight lines of lattices (-bs_angle_stiffness): which there are, and the modes that they give, against a search of NumPy for straight pairs of springs and
the dense matrix of springs and angle springs; of whole lattices, of those with springs removed, and of one that only they make rigid."""
from harness import run_parts
import h5py
import numpy as np

# size, axes that repeat, angle springs for each particle
LATTICES = {"triangular": ("6,6", "xy", 3), "kagome": ("2,2", "xy", 2), "bcc": ("3,3,3", "xyz", 4), "fcc": ("3,2,3", "xyz", 6), "square": ("5,5", "xy", 2), "cubic": ("3,4,3", "xyz", 3)}
KAPPA = 0.3


def net(checks, folder, kind, ranks, **more):
    """Places, springs (pairs, ways), angle springs and omega^2 of a lattice of masses 1."""
    size, axes, _ = LATTICES[kind]
    options = {"bs_lattice_type": kind, "bs_lattice_size": size, "bs_lattice_periodic": axes, "bs_lattice_stiffness": 1, "bs_angle_stiffness": KAPPA, "bs_task": "modes",
               "bs_lattice_dim": len(axes), "bs_modes": 1000, "bs_modes_rigid": "keep", "bs_output": "m.h5md", "bs_lattice_neighbors": {"square": 4, "cubic": 6, "bcc": 8}.get(kind, 0), **more}
    run = checks.run(options, keep=("m.h5md",), ranks=ranks)
    (folder / "m.h5md").write_bytes(run.files["m.h5md"])
    with h5py.File(folder / "m.h5md") as f:
        x, pairs = f["particles/trajectory/position/value"][0], f["connectivity/bonds"][...]
        edges = f["particles/trajectory/box/edges/value"][0]
        shift = f["connectivity/bonds_shift"][...] if "connectivity/bonds_shift" in f else np.zeros((len(pairs), x.shape[1]), int)
        angles = f["connectivity/angles"][...] if "connectivity/angles" in f else np.zeros((0, 3), int)
        omega = f["modes/omega_squared"][...]
    ways = x[pairs[:, 1]] - x[pairs[:, 0]] + shift @ (np.diag(edges) if edges.ndim == 1 else edges)
    return x, pairs, ways, angles, omega


def straight(pairs, ways):
    """(end, middle, end, way in, way out) of every two springs that meet straight."""
    out = []
    legs = {}
    for (i, j), r in zip(pairs, ways):
        legs.setdefault(i, []).append((j, r))
        legs.setdefault(j, []).append((i, -r))
    for b, near in legs.items():
        for k, (i, r) in enumerate(near):
            out += [(i, b, j, -r, s) for j, s in near[:k] if np.linalg.norm(r + s) < 1e-9]
    return out


def omega_squared(x, pairs, ways, lines):
    """Eigenvalues of springs k = 1 at rest and of bends: E = kappa/2 |P (u_1 - u_2)/l_1 + P (u_3 - u_2)/l_2|^2, P across the line."""
    n, d = x.shape
    K = np.zeros((n * d, n * d))
    row = np.zeros((1, n * d))

    def block(i):
        return slice(i * d, (i + 1) * d)
    for (i, j), r in zip(pairs, ways):
        row[:] = 0
        u = r / np.linalg.norm(r)
        row[0, block(j)] += u
        row[0, block(i)] -= u
        K += row.T @ row
    for i, b, j, r, s in lines:
        u = r / np.linalg.norm(r)
        P = np.eye(d) - np.outer(u, u)
        B = np.zeros((d, n * d))
        for end, way in ((i, r), (j, s)):
            B[:, block(end)] += P / np.linalg.norm(way)
            B[:, block(b)] -= P / np.linalg.norm(way)
        K += KAPPA * B.T @ B
    return np.linalg.eigvalsh(K)


def compare(checks, name, found):
    x, pairs, ways, angles, omega = found
    lines = straight(pairs, ways)
    ends = sorted((b, min(i, j), max(i, j)) for i, b, j, _, _ in lines)
    checks.true(f"{name}: the angle springs are the straight pairs of springs", sorted((b, min(i, j), max(i, j)) for i, b, j in angles) == ends, f"{len(angles)}, numpy {len(lines)}")
    checks.near(f"{name}: every mode", omega, omega_squared(x, pairs, ways, lines), 1e-11)


def whole(checks, folder):
    for kind, (_, _, each) in LATTICES.items():
        found = net(checks, folder, kind, checks.ranks)
        checks.true(f"{kind}: {each} for each particle", len(found[3]) == each * len(found[0]), str(len(found[3]) / len(found[0])))
        compare(checks, kind, found)


def diluted(checks, folder):
    """An angle spring goes with either of its springs; which do does not depend on the ranks."""
    for kind, (_, _, each) in LATTICES.items():
        more = {"bs_lattice_remove_fraction": 0.3, "bs_lattice_seed": 3}
        found = net(checks, folder, kind, 1, **more)
        checks.true(f"{kind}: about 0.7^2 are left", abs(len(found[3]) / (each * len(found[0])) - 0.49) < 0.15 and len(found[3]) > 0, str(len(found[3]) / (each * len(found[0]))))
        compare(checks, f"{kind} diluted", found)
        on_3 = net(checks, folder, kind, 3, **more)
        checks.true(f"{kind}: the same on three ranks", np.array_equal(on_3[3], found[3]))


def rigid(checks, folder):
    """A square net of springs between nearest neighbours has a motion without stiffness for every line; with bending only the translations are left, and in the kagome net, too."""
    for kind in ("square", "kagome"):
        found = net(checks, folder, kind, checks.ranks)
        free = int(np.sum(omega_squared(found[0], found[1], found[2], []) < 1e-10))
        checks.true(f"{kind}: bending holds what springs do not", free > 2 and np.sum(found[4] < 1e-10) == 2, f"{free} motions without, {np.sum(found[4] < 1e-10)} with")


if __name__ == "__main__":
    run_parts("angle springs along the lines of lattices", (whole, diluted, rigid))
