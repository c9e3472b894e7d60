#!/usr/bin/env python3
"""Kagome, honeycomb and diamond lattices: springs, modes, moduli and motions without stiffness against nets that NumPy makes of other lattices by leaving
particles out, and against closed forms."""
import itertools

from harness import run_parts
import h5py
import numpy as np

H = np.sqrt(0.75)


def places(kind, n):
    """(N, d) particles of the unit spacing and the edges of the box of n cells: of the triangular lattice a fourth (kagome) or a third (honeycomb, turned by
    a right angle) is left out; diamond: two face-centred cubes."""
    if kind == "diamond":
        half = [p for p in itertools.product(*(range(2 * k) for k in n)) if sum(p) % 2 == 0]
        return np.array([np.array(p) / 2 + a for p in half for a in (0, 0.25)]), np.array(n, float)
    edges = np.array([2 * n[0], 4 * H * n[1]] if kind == "kagome" else [2 * H * n[0], 3 * n[1]])
    wide, high = edges if kind == "kagome" else edges[::-1]
    x = []
    for j in range(round(high / H)):
        for i in range(round(wide)):
            i -= j // 2  # the rows of a rectangle
            if (i % 2 and j % 2) if kind == "kagome" else (i - j) % 3 == 0:
                continue
            x.append((i + j / 2, j * H))
    return np.array(x) if kind == "kagome" else np.array(x)[:, ::-1], edges


def bonds(x, edges, shells):
    """Ends, ways from the first to the second, and shell of all springs."""
    d, rows = x.shape[1], []
    for k in itertools.product((-1, 0, 1), repeat=d):
        r = x[None] + np.array(k) * edges - x[:, None]
        length = np.linalg.norm(r, axis=2)
        for s, wanted in enumerate(shells):
            i, j = np.nonzero(abs(length - wanted) < 1e-9)
            rows += [(a, b, s, *r[a, b]) for a, b in zip(i, j) if (a, tuple(-c for c in k)) < (b, k)]
    rows = np.array(rows)
    return rows[:, :2].astype(int), rows[:, 3:], rows[:, 2].astype(int)


def tangent(n, pairs, r, k):
    """H_ee, H_eu, H_uu of springs at rest, strains in the order of the program, then displacements."""
    d = r.shape[1]
    components = [(0, 0), (1, 1), (0, 1)] if d == 2 else [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    unit = r / np.linalg.norm(r, axis=1)[:, None]
    A = np.zeros((len(r), len(components) + n * d))
    for a, (p, q) in enumerate(components):
        A[:, a] = unit[:, p] * r[:, q]
    for c in range(d):
        np.add.at(A, (np.arange(len(r)), len(components) + d * pairs[:, 1] + c), unit[:, c])
        np.add.at(A, (np.arange(len(r)), len(components) + d * pairs[:, 0] + c), -unit[:, c])
    T = A.T @ (np.asarray(k)[:, None] * A)
    q = len(components)
    return T[:q, :q], T[:q, q:], T[q:, q:]


def stiffness(n, pairs, r, k, volume):
    """The stiffness tensor, all particles relaxed, and the number of motions without stiffness beyond the translations."""
    ee, eu, uu = tangent(n, pairs, r, k)
    omega = np.linalg.eigvalsh(uu)
    return (ee - eu @ np.linalg.pinv(uu, rcond=1e-12, hermitian=True) @ eu.T) / volume, int(np.sum(omega < 1e-9 * max(omega[-1], 1e-300))) - r.shape[1]


SHELLS = {("kagome", 4): (1,), ("kagome", 8): (1, 2 * H), ("honeycomb", 3): (1,), ("honeycomb", 9): (1, 2 * H), ("honeycomb", 12): (1, 2 * H, 2),
          ("diamond", 4): (H / 2,), ("diamond", 16): (H / 2, np.sqrt(0.5))}


def generated(kind, neighbors, n, **more):
    return {"bs_lattice_type": kind, "bs_lattice_neighbors": neighbors, "bs_lattice_size": ",".join(map(str, n)), "bs_lattice_periodic": "xyz"[:len(n)],
            "bs_lattice_stiffness": "1,0.3,0.1", "bs_lattice_spacing": 1, **more}


def nets(checks, folder):
    for (kind, neighbors), shells in SHELLS.items():
        n = (3, 2) if kind != "diamond" else (2, 2, 2)
        x, edges = places(kind, n)
        pairs, r, shell = bonds(x, edges, shells)
        checks.true(f"{kind}, {neighbors}: as many neighbours everywhere", set(np.bincount(pairs.ravel(), minlength=len(x))) == {neighbors})
        k = np.array([1, 0.3, 0.1])[shell]
        C, floppy = stiffness(len(x), pairs, r, k, np.prod(edges))
        got = checks.run({**generated(kind, neighbors, n), "bs_task": "moduli"}).report
        checks.near(f"{kind}, {neighbors}: stiffness", got["stiffness"], C, 1e-12)
        checks.true(f"{kind}, {neighbors}: motions without stiffness", got["zero_modes"] == floppy, f"{got['zero_modes']}, numpy {floppy}")
        run = checks.run({**generated(kind, neighbors, n), "bs_task": "modes", "bs_modes": x.size, "bs_modes_rigid": "keep", "bs_output": "m.h5md"}, keep=("m.h5md",))
        (folder / "m.h5md").write_bytes(run.files["m.h5md"])
        with h5py.File(folder / "m.h5md") as f:
            checks.near(f"{kind}, {neighbors}: every mode", f["modes/omega_squared"][...], np.linalg.eigvalsh(tangent(len(x), pairs, r, k)[2]), 1e-11)


def closed_forms(checks, folder):
    """Springs k = 1 between nearest neighbours at rest. Kagome deforms affinely: B = sqrt(3)/4, G = sqrt(3)/8. Honeycomb resists only the change of its area, B = 1/(2 sqrt(3)),
    diamond (cube of edge 1) only that of its volume, B = 1/3."""
    G = np.sqrt(3) / 8
    for kind, n, exact in (("kagome", (5, 4), [[3 * G, G, 0], [G, 3 * G, 0], [0, 0, G]]), ("honeycomb", (5, 4), np.pad(np.full((2, 2), 1 / np.sqrt(12)), (0, 1))),
                           ("diamond", (3, 2, 4), np.pad(np.full((3, 3), 1 / 3), (0, 3)))):
        got = checks.run({**generated(kind, 0, n), "bs_task": "moduli"}).report["stiffness"]
        checks.near(f"{kind}: stiffness", got, exact, 1e-12)


if __name__ == "__main__":
    run_parts(__doc__, (nets, closed_forms))
