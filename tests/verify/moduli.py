#!/usr/bin/env python3
"""Stiffness of bond-diluted triangular nets: 40 x 40, four seeds, against the rigidity threshold; nets that are floppy, whose motions without
stiffness are counted as numpy counts them."""

from box import triangular
from harness import run_parts, write_lattice
import h5py
import numpy as np
from scipy.io import mmread

SEEDS, SIZE = (0, 1, 2, 3), 40


def diluted(path, n, p, seed, **more):
    """The bonds of triangular(), each kept with probability p."""
    rows = np.array([(n * i + j, n * (k % n) + l % n, k // n, l // n)
                     for i in range(n) for j in range(n) for k, l in ((i + 1, j), (i, j + 1), (i + 1, j - 1))])
    return triangular(path, n, rows[np.random.default_rng(seed).random(len(rows)) < p], **more)


def threshold(checks, folder):
    """G/G_0 of 40 x 40 nets, G_0 = sqrt(3)/4, beside the effective medium's 3 (p - 2/3)."""
    for p, expected in ((0.9, 0.69), (0.8, 0.38), (0.7, 0.09)):
        ratios = [checks.run({"bs_task": "moduli", "bs_lattice_file": diluted(folder / "d.h5", SIZE, p, seed)}).report["stiffness"][2][2] / (np.sqrt(3) / 4)
                  for seed in SEEDS]
        note = f"{np.mean(ratios):.3f} of {', '.join(f'{r:.3f}' for r in ratios)}; 3(p - 2/3) = {3 * p - 2:.2f}"
        checks.true(f"p = {p}: G/G_0 about {expected}", abs(np.mean(ratios) - expected) < 0.03, note)
        checks.true(f"p = {p}: near the effective medium's", abs(np.mean(ratios) - (3 * p - 2)) < 0.05)


def zero_modes(checks, folder):
    """Counts against dense eigenvalues of the tangent that is exported."""
    n = 8
    for p, seed in ((1.0, 0), (0.9, 1), (0.8, 2), (0.7, 3), (0.6, 4), (0.5, 5), (0.3, 6), (0.02, 7)):
        run = checks.run({"bs_task": "moduli", "bs_lattice_file": diluted(folder / "z.h5", n, p, seed), "bs_write_matrices": "m", "bs_output": "m.h5md"},
                         keep=("m_K.mtx", "m.h5md"))
        (folder / "K.mtx").write_bytes(run.files["m_K.mtx"])
        (folder / "m.h5md").write_bytes(run.files["m.h5md"])
        omega = np.linalg.eigvalsh(-mmread(folder / "K.mtx").toarray())
        exact = int(np.sum(np.abs(omega) < 1e-9)) - 2
        gap = np.sort(np.abs(omega))
        checks.true(f"p = {p}: zero modes", run.report["zero_modes"] == exact, f"{run.report['zero_modes']}, numpy {exact}, next eigenvalue {gap[exact + 2] if exact + 2 < len(gap) else np.nan:.2g}")
        with h5py.File(folder / "m.h5md") as f:
            checks.true(f"p = {p}: in the file", f["moduli/zero_modes"][...].tolist() == [exact])
        if p <= 0.5:
            checks.below(f"p = {p}: nothing is carried", np.abs(run.report["stiffness"]).max(), 1e-12)
    for p in (0.72, 0.6):  # an iterative solver, which cannot bear so many soft motions
        options = {"bs_task": "moduli", "bs_lattice_file": diluted(folder / "s.h5", SIZE, p, 9)}
        direct = checks.run({**options, "condensed_pc_type": "cholesky"}).report
        iterative = checks.run({**options, "condensed_pc_type": "bicc", "bs_zero_modes_unknowns": 0}).report
        checks.near(f"p = {p}: the same stiffness by conjugate gradients", iterative["stiffness"], direct["stiffness"], 1e-9)
        checks.true(f"p = {p}: motions are counted only if they are to be", iterative["zero_modes"] == -1 and direct["zero_modes"] > 0)


def soft_parts(checks, folder):
    """Soft is not floppy: in a ring of springs in turn 1 and s the pairs move against each other with omega^2 of about s, which is not 0; in series
    their modulus is 2/(1 + 1/s) [N] of unit length."""
    n = 8
    pairs, shift = np.c_[np.arange(n), (np.arange(n) + 1) % n], np.r_[np.zeros(n - 1), 1][:, None]
    for soft, ranks in ((1e-5, 1), (1e-6, 1), (1e-6, 3), (0.0, 1)):
        k = np.where(np.arange(n) % 2, soft, 1.0)
        lattice = write_lattice(folder / "ring.h5", np.arange(float(n))[:, None], 1.0, pairs=pairs, stiffness=k, rest_length=1.0, box=[[float(n)]], shift=shift)
        A = np.zeros((n, n))
        for (i, j), ki in zip(pairs, k):
            A[[i, j, i, j], [i, j, j, i]] += [ki, ki, -ki, -ki]
        floppy_there = int((np.linalg.eigvalsh(A) < 1e-12).sum()) - 1
        got = checks.run({"bs_task": "moduli", "bs_lattice_file": lattice}, ranks=ranks).report
        checks.true(f"springs of 1 and {soft:g}, {ranks} rank(s): {floppy_there} motions without stiffness", got["zero_modes"] == floppy_there, str(got["zero_modes"]))
        if soft:
            checks.near(f"springs of 1 and {soft:g}, {ranks} rank(s): in series", got["stiffness"][0][0] * (1 + 1 / soft) / 2, 1.0, 1e-6)


def last_frame(file):
    """Places in the order of the input, edges of the box, and of the springs: ends, ways from the first to the second, stiffnesses, rest lengths."""
    with h5py.File(file) as f:
        x, edges = f["particles/trajectory/position/value"][-1], f["particles/trajectory/box/edges/value"][-1]
        x, edges = x[np.argsort(f["particles/trajectory/id"][...])], np.diag(edges) if edges.ndim == 1 else edges
        pairs, shift = f["connectivity/bonds"][...], f["connectivity/bonds_shift"][...]
        return x, edges, pairs, x[pairs[:, 1]] + shift @ edges - x[pairs[:, 0]], f["connectivity/bonds_stiffness"][...], f["connectivity/bonds_rest_length"][...]


def dense_stiffness(file, strain_law):
    """C = (H_ee - H_eu H_uu^+ H_ue)/V of the energy's second derivatives at the last frame, with the tensions there: of a spring with length l,
    direction n, tension T and rate k it is k (n.d)^2 + T/l (|d|^2 - (n.d)^2) for d = e dx + u_i - u_j."""
    x, edges, pairs, dx, K, L = last_frame(file)
    d, rate = x.shape[1], K / L if strain_law else K
    components = [(0, 0), (1, 1), (0, 1)] if d == 2 else [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    q, n = len(components), x.size
    H = np.zeros((q + n, q + n))
    for (i, j), r, k, length in zip(pairs, dx, rate, L):
        change = np.zeros((d, q + n))  # of r
        for a, (row, column) in enumerate(components):
            e = np.zeros((d, d))
            e[row, column] += 0.5
            e[column, row] += 0.5
            change[:, a] = e @ r
        for c in range(d):
            change[c, q + d * j + c] += 1
            change[c, q + d * i + c] -= 1
        l = np.linalg.norm(r)
        along = r / l @ change
        H += k * np.outer(along, along) + k * (l - length) / l * (change.T @ change - np.outer(along, along))
    return (H[:q, :q] - H[:q, q:] @ np.linalg.pinv(H[q:, q:], rcond=1e-14, hermitian=True) @ H[q:, :q]) / abs(np.linalg.det(edges))


def floppy(checks, folder):
    """Shears that nothing resists, and soft nets under a strain of 1e-8, whose tangent has eigenvalues of either sign next to 0: by dense matrices."""
    diluted_net = {"bs_lattice_type": "triangular", "bs_lattice_periodic": "xy", "bs_lattice_stiff_fraction": 0.32, "bs_lattice_stiff_factor": 0, "bs_lattice_seed": 2}
    cases = {
        "cube of 6 neighbours": {"bs_lattice_type": "cubic", "bs_lattice_neighbors": 6, "bs_lattice_size": "4,4,4", "bs_lattice_spacing": 0.1, "bs_lattice_particle_mass": 0.01,
                                 "bs_lattice_stiffness": 250, "bs_spring_law": "strain", "bs_lattice_periodic": "xyz"},
        "cloth without bending": {"bs_lattice_type": "cloth", "bs_lattice_neighbors": 12, "bs_lattice_size": "6,6", "bs_lattice_stiffness": "250,10,0", "bs_lattice_periodic": "xy"},
        "diluted net at rest": {**diluted_net, "bs_lattice_size": "16,16"},
        "diluted net, sheared by 1e-8": {**diluted_net, "bs_lattice_size": "16,16", "bs_box_strain": "xy=velocity:1e-8"},
    }
    for name, options in cases.items():
        for ranks in (1, 3):
            run = checks.run({**options, "bs_task": "moduli", "bs_output": "m.h5md"}, keep=("m.h5md",), ranks=ranks)
            (folder / "f.h5md").write_bytes(run.files["m.h5md"])
            exact = dense_stiffness(folder / "f.h5md", options.get("bs_spring_law") == "strain")
            found = np.array(run.report["stiffness"])
            checks.below(f"{name}, {ranks} rank(s)", np.abs(found - exact).max() / np.abs(exact).max(), 1e-7, f"smallest on the diagonal {found.diagonal().min():.3g}")
    large = {**diluted_net, "bs_task": "moduli", "bs_lattice_size": "40,40", "bs_box_strain": "xy=velocity:1e-8"}
    checks.true("40 x 40 net, sheared by 1e-8", checks.run(large).report["outcome"] == "ok")


def unbalanced(file):
    """Largest force that is left on a particle, and the largest of a spring."""
    x, _, pairs, r, K, L = last_frame(file)
    length = np.linalg.norm(r, axis=1)
    pull = (K * (length - L) / length)[:, None] * r
    force = np.zeros_like(x)
    np.add.at(force, pairs[:, 0], pull)
    np.add.at(force, pairs[:, 1], -pull)
    return np.linalg.norm(force, axis=1).max(), np.linalg.norm(pull, axis=1).max()


def relaxed(checks, folder):
    """Nets of springs that are too long, which relax until next to no force is left: balanced to 1e-11 of k a, without a load step that is cut."""
    for seed, ranks in ((0, 1), (2, 1), (5, 1), (7, 1), (9, 1), (0, 3), (7, 3)):
        net = {"bs_lattice_type": "triangular", "bs_lattice_size": "30,30", "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1, "bs_lattice_stiff_fraction": 0.36,
               "bs_lattice_stiff_factor": 0, "bs_lattice_rest_length_factor": 1.005, "bs_lattice_seed": seed}
        run = checks.run({**net, "bs_task": "moduli", "bs_output": "m.h5md"}, keep=("m.h5md",), ranks=ranks)
        (folder / "r.h5md").write_bytes(run.files["m.h5md"])
        left, largest = unbalanced(folder / "r.h5md")
        checks.true(f"net {seed}, {ranks} rank(s): balanced", run.report["rejected"] == 0 and run.report["outcome"] == "ok" and left < 1e-11 and largest < 1e-5,
                    f"{left:.2g} N of {largest:.2g} N, {run.report['rejected']} rejected")


if __name__ == "__main__":
    run_parts(__doc__, (threshold, zero_modes, soft_parts, floppy, relaxed))
