#!/usr/bin/env python3
"""Equilibria by the Python package beside plain SciPy on the same networks: 1,000 solves of a net, one stiffness changed in each, and one solve of 10^5
springs, as it is and sheared. `followed`: by a solver that stays (bs.Statics), from the last equilibrium; all others start from the net as it is; `same work`:
what SciPy does, the load at once in the place of a load step from the equilibrium without it, and any equilibrium, without asking whether it is stable. SciPy has analytic gradients, sparse tangents assembled without loops,
Newton's method with SuperLU, in its default order of columns and in the quickest for these nets, and L-BFGS (not on the large net); all must find the same positions.
Times are processor seconds of this process, the least of `--repeats`.

    PYTHONPATH=build/release/python /usr/bin/python3 tests/bench/beside_scipy.py --program build/release/backspring
"""
import argparse
import os
import pathlib
import sys
import time

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np  # noqa: E402
import scipy  # noqa: E402
from scipy.optimize import minimize  # noqa: E402
from scipy.sparse import csc_matrix  # noqa: E402
from scipy.sparse.linalg import splu  # noqa: E402

QUICKEST = dict(permc_spec="MMD_AT_PLUS_A", options=dict(SymmetricMode=True))
WEIGHT = 8.0  # of all particles [N]: large nets sag as small ones do


def net_of(n, shear=0.0):
    """A triangular net of n x n particles, uneven, stretched by a fifth and sheared, held along its edge."""
    rng = np.random.default_rng(1)
    i, j = np.meshgrid(np.arange(n), np.arange(n))
    x = np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=-1).reshape(-1, 2) + 0.05 * rng.standard_normal((n * n, 2))
    at = np.arange(n * n).reshape(n, n)
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ((at[:, :-1], at[:, 1:]), (at[:-1], at[1:]), (at[:-1, 1:], at[1:, :-1]))])
    length = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1)
    edge = np.zeros((n, n), bool)
    edge[[0, -1]] = edge[:, [0, -1]] = True
    return x + shear * x[:, [1]] * [1, 0], pairs, rng.uniform(0.5, 1.5, len(pairs)), length / 1.2, edge.ravel()


class ByScipy:
    """E = sum of k (l - L)^2/2 + w y over the free particles."""

    def __init__(self, x, pairs, L, held):
        self.x0, self.pairs, self.L, self.weight = x, pairs, L, WEIGHT / len(x)
        self.free = np.flatnonzero(np.repeat(~held, 2))
        place = np.full(x.size, -1)
        place[self.free] = np.arange(len(self.free))
        dofs = (2 * pairs[:, :, None] + np.arange(2)).reshape(-1, 4)
        rows, columns = np.broadcast_arrays(place[dofs][:, :, None], place[dofs][:, None, :])
        self.kept = ((rows >= 0) & (columns >= 0)).ravel()
        self.where = rows.ravel()[self.kept], columns.ravel()[self.kept]
        self.dofs = dofs

    def forces(self, q, k):
        x = self.x0.ravel().copy()
        x[self.free] = q
        r = x.reshape(-1, 2)[self.pairs[:, 1]] - x.reshape(-1, 2)[self.pairs[:, 0]]
        l = np.linalg.norm(r, axis=1)
        pull = (k * (l - self.L) / l)[:, None] * r
        g = np.bincount(self.dofs.ravel(), np.concatenate([-pull, pull], axis=1).ravel(), x.size)
        g[1::2] += self.weight
        return r, l, 0.5 * (k * (l - self.L) ** 2).sum() + self.weight * x[1::2].sum(), g[self.free]

    def tangent(self, r, l, k):
        u = r / l[:, None]
        across = (k * (1 - self.L / l))[:, None, None]
        block = (k[:, None, None] - across) * u[:, :, None] * u[:, None, :] + across * np.eye(2)
        whole = np.block([[block, -block], [-block, block]])
        return csc_matrix((whole.ravel()[self.kept], self.where), shape=(len(self.free),) * 2)

    def newton(self, k, **order):
        q = self.x0.ravel()[self.free].copy()
        for iteration in range(50):
            r, l, _, g = self.forces(q, k)
            if abs(g).max() < 1e-10:
                return self.whole(q)
            q -= splu(self.tangent(r, l, k), **(order or QUICKEST)).solve(g)
        raise RuntimeError("SciPy's Newton did not converge")

    def lbfgs(self, k):
        found = minimize(lambda q: self.forces(q, k)[2:], self.x0.ravel()[self.free], jac=True, method="L-BFGS-B",
                         options=dict(maxiter=100000, maxfun=100000, maxcor=20, gtol=1e-9, ftol=1e-16))
        return self.whole(found.x)

    def whole(self, q):
        x = self.x0.ravel().copy()
        x[self.free] = q
        return x.reshape(-1, 2)


def timed(call, repeats):
    """(least processor seconds, what it gave last)."""
    least = np.inf
    for _ in range(repeats):
        begin = time.process_time()
        found = call()
        least = min(least, time.process_time() - begin)
    return least, found


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--program", required=True)
    options.add_argument("--repeats", type=int, default=3)
    options.add_argument("--check", action="store_true", help="small: whether all find the same")
    options = options.parse_args()
    sys.path.insert(0, str(pathlib.Path(options.program).resolve().parent / "python"))
    import backspring as bs

    def rows(name, n, solves, methods, repeats, shear=0.0):
        x, pairs, k, L, held = net_of(n, shear)
        net, scipys = bs.Lattice(x, pairs, stiffness=k, rest_length=L, mass=WEIGHT / len(x), fixed=held), ByScipy(x, pairs, L, held)
        changed = [np.where(np.arange(len(k)) == 7 * one % len(k), 2 * k, k) for one in range(solves)]
        ways = {"backspring": lambda one: bs.statics(net.replace(stiffness=one), bs_gravity=(0, -1.0)).x,
                "same work": lambda one: bs.statics(net.replace(stiffness=one), bs_gravity=(0, -1.0), bs_load_scale="none", bs_equilibria="any", bs_stability_iterations=0).x,
                "SciPy, Newton": lambda one: scipys.newton(one, permc_spec="COLAMD"), "SciPy, quickest": scipys.newton, "SciPy, L-BFGS": scipys.lbfgs}
        solver = bs.Statics(net, bs_gravity=(0, -1.0))

        def follow(one):
            solver.change(stiffness=one)
            return solver.solve().x

        ways["followed"] = follow
        ways["backspring"](changed[0])  # starts MPI and PETSc
        solver.solve()
        print(f"{name}: {len(x):,} particles, {len(pairs):,} springs, {solves:,} solves")
        for way, (share, most) in methods.items():
            some = changed[: max(1, solves // share)]
            seconds, found = timed(lambda: [ways[way](one) for one in some], repeats)
            if way == "backspring":
                reference = found
            apart = max(abs(a - b).max() for a, b in zip(found, reference))
            assert apart < most, f"{way}: positions differ by {apart:.3g} m"
            print(f"  {way:15s} {1e3 * seconds / len(some):10.2f} ms a solve, {seconds * solves / len(some):8.2f} s in all, positions within {apart:.1e} m", flush=True)

    print(f"SciPy {scipy.__version__}, NumPy {np.__version__}; load of the machine {os.getloadavg()[0]:.1f}")
    if options.check:
        rows("one stiffness changed", 8, 5, {"backspring": (1, 1), "same work": (1, 1e-7), "followed": (1, 1e-7), "SciPy, Newton": (1, 1e-6), "SciPy, quickest": (1, 1e-6), "SciPy, L-BFGS": (1, 1e-5)}, 1)
        rows("sheared", 8, 1, {"backspring": (1, 1), "same work": (1, 1e-7), "SciPy, Newton": (1, 1e-6)}, 1, shear=0.3)
        return
    rows("one stiffness changed", 20, 1000, {"backspring": (1, 1), "same work": (1, 1e-7), "followed": (1, 1e-7), "SciPy, Newton": (1, 1e-6), "SciPy, quickest": (1, 1e-6), "SciPy, L-BFGS": (20, 1e-5)}, options.repeats)
    for name, shear in (("10^5 springs", 0.0), ("10^5 springs, sheared", 0.3)):  # L-BFGS takes minutes
        rows(name, 183, 1, {"backspring": (1, 1), "same work": (1, 1e-7), "SciPy, Newton": (1, 1e-6), "SciPy, quickest": (1, 1e-6)}, options.repeats, shear)


if __name__ == "__main__":
    main()
