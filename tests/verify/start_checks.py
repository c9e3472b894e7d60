"""What a particle case does at its initial state: forces and Jacobian blocks."""
from harness import read_table
import numpy as np
from particles import columns
from petsc_files import read_matrix
from scipy.io import mmread


def check_forces(case):
    """One forward Euler step of h = 1: v1 - v0 = f(x0, v0)/m."""
    s, name = case.system, f"{case.name} forces at the start"
    t = read_table(case.folder / "forces0.csv")
    with case.checks.group(name):
        r = case.checks.run(case.options("fe", 1.0, 1), interval=1.0, grows=True).trajectory
        table = columns(t, ["fx", "fy", "fz"][:s.dim])
        off = np.abs(s.m[:, None] * (r.velocity[1] - r.velocity[0]) - table).max(axis=1)
        tolerance = 1e-14 * s.force_scale(s.x) + 1e-15 * s.m * np.abs(s.v).max()
        case.checks.below(name, (off / tolerance)[~s.fixed].max(), 1.0, "of 1e-14 of the terms' sizes")
        case.checks.near(f"{case.name} fixed particles stay", np.abs(r.position[1] - s.x)[s.fixed].max(initial=0), 0.0, 0.0)


def check_jacobian(case):
    """J = [sigma I, -I; -K, sigma M - D] with sigma = 1 of the first Newton matrix; the order of particles in it is the
    program's own, so what is compared does not depend on it: the entries and the eigenvalues."""
    s, d, name = case.system, case.system.dim, f"{case.name} Jacobian"
    if not (case.folder / "dFdx0.mtx").exists():
        return
    with case.checks.group(name):
        o = {**case.options("linbe", 1.0, 1), "ksp_view_mat": "binary:J.dat"}
        J = read_matrix(case.checks.run(o, keep=["J.dat"], grows=True).files["J.dat"])
        is_v = np.arange(len(J)) % (2 * d) >= d
        free = np.repeat(~s.fixed, d)
        def full(file):
            A = np.zeros((s.n * d, s.n * d))
            if (case.folder / file).exists():
                A[np.ix_(free, free)] = mmread(case.folder / file).toarray()
            return A
        M = np.diag(np.repeat(s.m, d))
        for part, ours, expected in (("df/dx", -J[np.ix_(is_v, ~is_v)], full("dFdx0.mtx")),
                                     ("M - df/dv", J[np.ix_(is_v, is_v)], M - full("dFdv0.mtx"))):
            size = np.abs(expected).max() or 1.0
            eigen = [np.linalg.eigvalsh((A + A.T) / 2) for A in (ours, expected)]
            case.checks.near(f"{name} {part} entries", np.sort(ours, axis=None), np.sort(expected, axis=None), 1e-13 * size)
            case.checks.near(f"{name} {part} eigenvalues", eigen[0], eigen[1], 1e-12 * size)
