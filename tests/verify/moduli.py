#!/usr/bin/env python3
"""Stiffness of bond-diluted triangular nets: 40 x 40, four seeds, against the rigidity threshold; nets that are floppy, whose motions without
stiffness are counted as numpy counts them."""

from box import triangular
from harness import run_parts
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


if __name__ == "__main__":
    run_parts(__doc__, (threshold, zero_modes))
