#!/usr/bin/env python3
"""Angle springs: Hencky's chain, motions integrated by SciPy, LAMMPS; orders, ranks, storages, restarts, trajectories read back."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np
from harness import REPO, Checks, observed_orders, write_lattice
from petsc_files import read_matrix
from program import METHODS, direct, run
from scipy.integrate import solve_ivp

ORACLE = "E_mechanics/hencky.txt"
TIGHT_RK = {"ts_type": "rk", "ts_rk_type": "5dp", "ts_rtol": 1e-12, "ts_atol": 1e-13, "ts_dt": 1e-3, "ts_adapt_type": "basic"}


class Chain:
    """n particles, Hooke springs between neighbours, angle springs over every three of them."""

    def __init__(self, x, v, m, k, L, kappa, rest, fixed=()):
        self.x, self.v, self.m = np.asarray(x, float), np.asarray(v, float), np.broadcast_to(m, len(x)).astype(float)
        n, self.d = self.x.shape
        self.k, self.L, self.kappa = k, L, np.broadcast_to(kappa, n - 2).astype(float)
        self.rest = np.broadcast_to(rest, n - 2).astype(float)
        self.free = np.ones(n, bool)
        self.free[list(fixed)] = False
        self.v = np.where(self.free[:, None], self.v, 0)
        self.pairs = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
        self.triples = np.stack([np.arange(n - 2), np.arange(1, n - 1), np.arange(2, n)], axis=1)

    def write(self, path):
        return write_lattice(path, self.x, self.m, velocity=self.v, fixed=~self.free, pairs=self.pairs, stiffness=self.k,
                             rest_length=self.L, spring_law="hooke",
                             angles={"triples": self.triples, "stiffness": self.kappa, "rest_angle": self.rest})

    def angles(self, x):
        """theta (A) and its gradient by the two arms, (A, d) each: arg b - arg a in the plane, else from the arc cosine."""
        a, b = x[:-2] - x[1:-1], x[2:] - x[1:-1]
        la, lb = np.linalg.norm(a, axis=1)[:, None], np.linalg.norm(b, axis=1)[:, None]
        if self.d == 2:
            theta = np.mod(np.angle((b[:, 0] + 1j * b[:, 1]) / (a[:, 0] + 1j * a[:, 1])), 2 * np.pi)
            return theta, np.stack([a[:, 1], -a[:, 0]], 1) / la ** 2, np.stack([-b[:, 1], b[:, 0]], 1) / lb ** 2
        cosine = (a * b).sum(1)[:, None] / (la * lb)
        sine = np.sqrt(1 - cosine ** 2)
        return np.arccos(cosine)[:, 0], -(b / lb - cosine * a / la) / (la * sine), -(a / la - cosine * b / lb) / (lb * sine)

    def energy(self, x):
        l = np.linalg.norm(np.diff(x, axis=0), axis=1)
        return 0.5 * (self.k * (l - self.L) ** 2).sum() + 0.5 * (self.kappa * (self.angles(x)[0] - self.rest) ** 2).sum()

    def force(self, x):
        f, step = np.zeros_like(x), np.diff(x, axis=0)
        l = np.linalg.norm(step, axis=1)[:, None]
        pull = self.k * (l - self.L) * step / l
        f[:-1] += pull
        f[1:] -= pull
        theta, ga, gb = self.angles(x)
        moment = (self.kappa * (theta - self.rest))[:, None]
        f[:-2] -= moment * ga
        f[2:] -= moment * gb
        f[1:-1] += moment * (ga + gb)
        return np.where(self.free[:, None], f, 0)

    def at(self, T):
        """(x, v) at time T, by DOP853."""
        def rate(_, y):
            x, v = y.reshape(2, *self.x.shape)
            return np.concatenate([np.where(self.free[:, None], v, 0).ravel(), (self.force(x) / self.m[:, None]).ravel()])
        start = np.concatenate([self.x.ravel(), self.v.ravel()])
        return solve_ivp(rate, (0, T), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1].reshape(2, *self.x.shape)


def arc(d, n=12, rest=np.pi, kappa=2.0, spread=0.3):
    """A bent chain that swings; no angle near a singular one. In two dimensions some pass through pi."""
    rng = np.random.default_rng(10 * d + n)
    turn = np.cumsum(rng.uniform(-spread, spread, n) + (0 if d == 2 else 0.35))
    x = np.zeros((n, d))
    x[:, 0], x[:, 1] = np.cumsum(np.cos(turn)), np.cumsum(np.sin(turn))
    if d == 3:
        x[:, 2] = 0.3 * np.arange(n) + 0.1 * np.sin(np.arange(n))
    return Chain(x, 0.4 * rng.standard_normal((n, d)), rng.uniform(0.5, 2, n), 60.0, 1.0, kappa * rng.uniform(0.5, 1.5, n - 2), rest, (0,))


def hencky_chain(d, n, a, kappa, P, k=1e4):
    """n straight links of length a under the load P, both ends pinned."""
    x = np.zeros((n + 1, d))
    x[:, 0] = a * np.arange(n + 1)
    return Chain(x, 0 * x, 0.5, k, a + P / k, kappa, np.pi, (0, n))


def hencky(checks, folder):
    """Stiffness across a chain of n links pinned at both ends: mode j has (4 s^2/a) (4 kappa s^2/a - P), s = sin(j pi/2n)."""
    n, a, kappa = 8, 0.5, 3.0
    critical = 4 * kappa / a * np.sin(np.pi / (2 * n)) ** 2
    found = checks.oracles / ORACLE
    if found.exists():
        checks.near("Hencky's load against the reference", critical, float(found.read_text().split("=")[-1]), 1e-14)
    s2 = np.sin(np.arange(1, n) * np.pi / (2 * n)) ** 2
    for d, ranks in ((2, 1), (2, 3), (3, 1), (3, 2)):
        for part in (0.9, 1.0, 1.1):
            chain, h = hencky_chain(d, n, a, kappa, part * critical), 0.1
            chain.x[1:-1, 1:] += 1e-8 * np.random.default_rng(1).standard_normal((n - 1, d - 1))  # for Newton to have something to do
            options = dict(direct(ranks), bs_lattice_file=chain.write(folder / "hencky.h5"), ts_dt=h, ts_max_steps=1, ts_type="beuler",
                           bs_operator="assembled", bs_partition="rows", bs_ordering="rows", ksp_view_mat="binary:J")
            blob = run(checks.program, options, ranks=ranks, keep=("J",)).files["J"]
            J = read_matrix(blob).reshape(n + 1, 2, d, n + 1, 2, d)
            K = J[1:-1, 1, :, 1:-1, 0, :]  # -df/dx of the free particles
            for c in range(1, d):
                eigen = np.sort(np.linalg.eigvalsh(K[:, c, :, c]))
                expected = np.sort(4 * s2 / a * (4 * kappa * s2 / a - part * critical))
                checks.near(f"Hencky, d = {d}, axis {c}, {ranks} rank(s), P = {part} P_cr: all modes", eigen, expected, 1e-10)
            lowest = np.linalg.eigvalsh(K.reshape(d * (n - 1), -1))[0]
            checks.true(f"Hencky, d = {d}, P = {part} P_cr: sign of the lowest", (np.sign(np.round(lowest, 9)) == np.sign(1 - part)), f"{lowest:.3e}")
    for part in (0.9, 1.1):
        chain = hencky_chain(2, n, a, kappa, part * critical)
        chain.x[:, 1] = 1e-7 * np.sin(np.pi * np.arange(n + 1) / n)
        rate = 4 * s2[0] / a * (4 * kappa * s2[0] / a - part * critical) / 0.5
        T = 2.0
        options = dict(TIGHT_RK, bs_lattice_file=chain.write(folder / "buckle.h5"), ts_max_time=T)
        for ranks in (1, 2, 3):
            x = run(checks.program, options, ranks=ranks, interval=T).trajectory.position[-1]
            grown = (x[:, 1] * np.sin(np.pi * np.arange(n + 1) / n)).sum() * 2 / n / 1e-7
            checks.near(f"first mode under {part} P_cr after {T} s, {ranks} rank(s)", grown, np.real(np.cos(np.sqrt(complex(rate)) * T)), 1e-5)


def motions(checks, folder):
    T = 1.0
    for name, chain in (("plane, straight at rest", arc(2)), ("plane, bent at rest, through pi", arc(2, rest=2.8)),
                        ("plane, rest angles beyond pi", arc(2, rest=3.6)), ("space, straight at rest", arc(3)),
                        ("space, bent at rest", arc(3, rest=2.2))):
        lattice = chain.write(folder / "motion.h5")
        x, v = chain.at(T)
        size = np.abs(x).max()
        for ranks in (1, 2, 3):
            got = run(checks.program, dict(TIGHT_RK, bs_lattice_file=lattice, ts_max_time=T), ranks=ranks, interval=T).trajectory
            checks.below(f"{name}: SciPy's motion, {ranks} rank(s)", np.abs(got.position[-1] - x).max() / size, 1e-9)
            checks.below(f"{name}: its velocities", np.abs(got.velocity[-1] - v).max() / np.abs(v).max(), 1e-8)
            checks.near(f"{name}: elastic energy at the start", float(got.observables["elastic_energy"][0]), chain.energy(chain.x), 1e-12 * chain.energy(chain.x))
            E = got.observables["total_energy"].ravel()
            checks.below(f"{name}: energy stays", abs(E[-1] - E[0]) / E[0], 1e-9)
    straight = arc(2)
    turned = straight.angles(straight.x)[0]
    checks.true("the plane's chains have angles on both sides of pi", turned.min() < np.pi < turned.max(), f"{turned.min():.2f} {turned.max():.2f}")


def orders(checks, folder):
    for d in (2, 3):
        chain, T = arc(d), 0.5
        lattice, x = chain.write(folder / "orders.h5"), chain.at(T)[0]
        for method, order in (("be", 1), ("tr", 2), ("symplectic", 1)):
            steps, errors = (50, 100, 200), []
            for count in steps:
                options = dict(METHODS[method], **({} if method == "symplectic" else direct()), ts_adapt_type="none", ts_dt=T / count, ts_max_time=T,
                               bs_lattice_file=lattice)
                errors.append(np.abs(run(checks.program, options, interval=T).trajectory.position[-1] - x).max())
            seen = observed_orders([T / n for n in steps], errors)[-1]
            checks.near(f"order of {method}, d = {d}", seen, order, 0.15)


def solvers(checks, folder):
    """Storages, tangents and ways to solve reach the factored Jacobian's motion; J against differences."""
    for d in (2, 3):
        base = dict(bs_lattice_file=arc(d, 30).write(folder / "solvers.h5"), ts_type="beuler", ts_dt=0.05, ts_max_time=0.5, snes_rtol=1e-11)
        expected = run(checks.program, dict(base, **direct()), interval=0.5).trajectory.position[-1]
        cg = {"condensed_ksp_type": "cg"}
        for name, options, ranks in (
                ("condensed, direct", {}, (1, 3)), ("springs + bicc", dict(cg, condensed_pc_type="bicc", condensed_mat_type="springs"), (1, 3)),
                ("springs + jacobi", dict(cg, condensed_pc_type="jacobi"), (2,)),
                ("shell, springs + jacobi", dict(cg, condensed_pc_type="jacobi", bs_operator="shell"), (2,)),
                ("sbaij + icc", dict(cg, condensed_pc_type="icc"), (1,)),
                ("sbaij + bjacobi", dict(cg, condensed_mat_type="sbaij", condensed_pc_type="bjacobi", condensed_sub_pc_type="icc"), (2,)),
                ("baij + pbjacobi", dict(cg, condensed_mat_type="baij", condensed_pc_type="pbjacobi"), (1, 2)),
                ("aij + gamg", dict(cg, condensed_pc_type="gamg"), (2,)),
                ("-bs_tangent exact", {"bs_tangent": "exact"}, (1,)), ("-bs_tangent definite", {"bs_tangent": "definite", "snes_max_it": 400}, (2,)),
                ("full AIJ, GMRES", {"pc_type": "bjacobi", "ksp_type": "gmres", "ksp_rtol": 1e-10}, (2,)),
                ("full BAIJ, GMRES", {"mat_type": "baij", "pc_type": "bjacobi", "ksp_type": "gmres", "ksp_rtol": 1e-10}, (2,)),
                ("-snes_fd_color", {"snes_fd_color": True}, (1, 2)), ("-snes_mf", {"snes_mf": True, "snes_rtol": 1e-9, "ts_dt": 0.05}, (1,))):
            for count in ranks:
                found = run(checks.program, dict(base, **options), ranks=count, interval=0.5).trajectory.position[-1]
                checks.below(f"d = {d}: {name}, {count} rank(s)", np.abs(found - expected).max(), 1e-7 if name == "-snes_mf" else 1e-9)
        for ranks in (1, 2, 3):
            for mat in ("aij", "baij"):
                said = run(checks.program, dict(base, ts_max_time=0.15, snes_test_jacobian=True, mat_type=mat), ranks=ranks).stdout
                found = [float(w) for w in re.findall(r"\|\|J - Jfd\|\|_F/\|\|J\|\|_F = (\S+),", said)]
                checks.true(f"d = {d}: J against differences, {mat}, {ranks} rank(s)", len(found) >= 3 and max(found) < 1e-6, f"{max(found, default=9):.1e}")


def ranks(checks, folder):
    """A sheet with bending stiffness: explicit runs agree bit for bit on any ranks, implicit ones to the tolerance."""
    sheet = dict(bs_lattice_type="cloth", bs_lattice_size="9,8", bs_lattice_spacing=0.1, bs_lattice_particle_mass=0.02, bs_lattice_perturbation=0.01,
                 bs_lattice_fixed_particles="0,8", bs_lattice_stiffness=60, bs_angle_stiffness=0.05, bs_gravity=(0, 0, -9.81))
    for name, options, tolerance in (("symplectic", {"ts_type": "symplectic", "ts_dt": 1e-3, "ts_max_time": 0.2}, 0.0),
                                     ("beuler", {"ts_type": "beuler", "ts_dt": 0.01, "ts_max_time": 0.2, "snes_rtol": 1e-12}, 1e-10)):
        one = run(checks.program, {**sheet, **options}, interval=0.2)
        for count in (2, 3):
            for partition in ("graph", "rows"):
                many = run(checks.program, {**sheet, **options, "bs_partition": partition}, ranks=count, interval=0.2).trajectory
                checks.below(f"{name} on 1 and {count} ranks, -bs_partition {partition}", np.abs(many.position[-1] - one.trajectory.position[-1]).max(), tolerance)
    checks.true("springs over every three along x and y", "110 angle springs" in one.stdout, "7 x 8 + 9 x 6 = 110")


def advice(checks, folder):
    """omega_max of a chain that bends faster than it stretches: the Ritz value plus its residual, 0 to 3 % above the exact one."""
    for d in (2, 3):
        chain, h = arc(d, 40, kappa=500.0, spread=0.1), 1e-5
        n = len(chain.x)
        K = np.zeros((n * d, n * d))
        for k in range(n * d):
            step = np.zeros(n * d)
            step[k] = h
            K[:, k] = (chain.force(chain.x - step.reshape(n, d)) - chain.force(chain.x + step.reshape(n, d))).ravel() / (2 * h)
        free = np.repeat(chain.free, d)
        root = np.sqrt(np.repeat(chain.m, d)[free])
        exact = np.sqrt(np.linalg.eigvalsh(K[np.ix_(free, free)] / np.outer(root, root))[-1])
        for ranks in (1, 3):
            said = run(checks.program, dict(bs_lattice_file=chain.write(folder / "advice.h5"), ts_dt=1e-4, ts_max_steps=1), ranks=ranks).stdout
            found = float(re.search(r"omega_max about (\S+) 1/s", said)[1])
            checks.true(f"fastest oscillation, d = {d}, {ranks} rank(s)", 0.99 <= found / exact <= 1.06, f"{found} for {exact:.5g} 1/s")


def large(checks, folder):
    """Past the limit of direct solves: conjugate gradients with bicc, and with GAMG where asked for, reach the direct solve's motion."""
    sheet = dict(bs_lattice_type="square", bs_lattice_neighbors=8, bs_lattice_dim=3, bs_lattice_size="84,84", bs_lattice_spacing=0.02,
                 bs_lattice_particle_mass=1e-3, bs_lattice_perturbation=1e-4, bs_lattice_stiffness=200, bs_angle_stiffness=1e-2,
                 bs_lattice_fixed="xmin", bs_gravity=(0, 0, -9.81), ts_dt=0.01, ts_max_time=0.02, snes_rtol=1e-10)
    factored = dict(condensed_pc_type="cholesky", condensed_ksp_type="preonly", condensed_pc_factor_mat_solver_type="mumps")
    expected = run(checks.program, dict(sheet, **factored), interval=0.02).trajectory.position[-1]
    for name, options, ranks, words in (("the default", {}, 1, "cg + bicc with rigid motions of groups on springs"), ("the default", {}, 2, "cg + bicc with rigid"),
                                        ("gamg", {"condensed_pc_type": "gamg"}, 2, "cg + gamg on AIJ")):
        result = run(checks.program, dict(sheet, **options), ranks=ranks, interval=0.02)
        checks.below(f"a sheet of 21168 unknowns by {name}, {ranks} rank(s)", np.abs(result.trajectory.position[-1] - expected).max(), 1e-9)
        checks.true("the header names the solver", words in result.stdout, words)


def sheared(checks, folder):
    """A block whose springs resist no shear, but whose lines resist bending, gets hats, at most a quarter of GAMG's 784 and 776 iterations (1 and 3 ranks)
    and of those with rigid motions, 405 and 455; where springs resist every strain it gets rigid motions."""
    block = dict(bs_lattice_type="cubic", bs_lattice_size="10,10,100", bs_lattice_spacing=1, bs_lattice_neighbors=6, bs_lattice_particle_mass=1,
                 bs_lattice_stiffness=1000, bs_angle_stiffness=100, bs_lattice_fixed="zmin", bs_gravity=(1e-5, 2e-5, -1e-4), ts_dt=250 / 84.6,
                 ts_max_time=750 / 84.6)
    for ranks in (1, 3):
        report = run(checks.program, block, ranks=ranks, interval=block["ts_max_time"]).report
        checks.true(f"a block of bending lines, {ranks} rank(s): hats", "rigid" not in report["solver"], report["solver"])
        checks.true(f"a block of bending lines, {ranks} rank(s): iterations", report["krylov"] < 195, f"{report['krylov']}")
    report = run(checks.program, dict(block, bs_lattice_neighbors=18, ts_max_time=250 / 84.6), interval=250 / 84.6).report
    checks.true("a block of springs that resist shear: rigid motions", "rigid" in report["solver"], report["solver"])


def singular(checks, folder):
    """A step that ends where the law has no force: the run ends, and names spring and place. Other springs are not concerned."""
    for name, x, v, words in (("straight, bent at rest", [[-1, 0, 0], [0, 0.5, 0], [1, 0, 0]], [0, -1, 0], "angle spring 1 met a straight angle"),
                              ("folded", [[1, 0, 0], [0, 0.5, 0], [2, 0, 0]], [0, -1, 0], "angle spring 1 met an angle of 0"),
                              ("an arm of no length", [[1, 0, 0], [0, 0.5, 0], [2, 1, 0]], [2, -1, 0], "angle spring 1 met an arm of zero length")):
        far = np.array([[5, 0, 0], [6, 0.5, 0], [7, 0, 0]])
        path = write_lattice(folder / "singular.h5", np.concatenate([far, x]), 1.0, velocity=[[0, 0, 0]] * 4 + [v, [0, 0, 0]],
                             fixed=[1, 1, 1, 1, 0, 1], angles={"triples": [[0, 1, 2], [3, 4, 5]], "stiffness": 0.0, "rest_angle": 2.0})
        for ranks in (1, 2, 3):
            result = run(checks.program, dict(bs_lattice_file=path, ts_type="euler", ts_dt=0.5, ts_max_time=2.0), ranks=ranks, expect=3)
            checks.true(f"{name}, {ranks} rank(s)", words in result.stdout + result.stderr, words)


def states(path):
    with h5py.File(path) as f:
        return f["state/position"][...], f["state/velocity"][...]


def restarts(checks, folder):
    for name, options, count in (("beuler", {"ts_type": "beuler"}, 2), ("cn", {"ts_type": "cn"}, 1), ("symplectic", {"ts_type": "symplectic"}, 3)):
        base = dict(options, bs_lattice_file=arc(3).write(folder / "restart.h5"), ts_dt=0.01, ts_adapt_type="none", bs_checkpoint_every=10)
        whole, half, rest = (folder / f"{name}_{part}.ck" for part in ("whole", "half", "rest"))
        run(checks.program, dict(base, ts_max_time=0.2, bs_checkpoint=whole), ranks=count)
        run(checks.program, dict(base, ts_max_time=0.1, bs_checkpoint=half), ranks=count)
        run(checks.program, {"bs_restart": half, "bs_checkpoint": rest, "ts_max_time": 0.2}, ranks=count)
        same = all(np.array_equal(a, b) for a, b in zip(states(whole), states(rest)))
        checks.true(f"{name} continued on {count} rank(s): the same bits", same)
    chain = arc(3)
    chain.kappa = chain.kappa * 1.01
    chain.write(folder / "restart.h5")
    refused = run(checks.program, {"bs_restart": folder / "beuler_half.ck", "ts_max_time": 0.2}, expect=2)
    checks.true("another angle stiffness is another lattice", "lattice" in refused.stderr, refused.stderr.strip()[:150])


def read_back(checks, folder):
    chain = arc(3, rest=2.2)
    out = folder / "back.h5md"
    run(checks.program, dict(bs_lattice_file=chain.write(folder / "back.h5"), bs_output=out, ts_max_steps=2, ts_dt=0.01), ranks=2)
    with h5py.File(out) as f:
        checks.true("triples are written", np.array_equal(f["connectivity/angles"][...], chain.triples))
        checks.true("and stiffnesses", np.array_equal(f["connectivity/angles_stiffness"][...], chain.kappa))
        checks.true("and rest angles", np.array_equal(f["connectivity/angles_rest_angle"][...], chain.rest))
        last = float(f["observables/elastic_energy/value"][-1])
    again = run(checks.program, dict(bs_lattice_file=out, ts_max_steps=1, ts_dt=1e-6), ranks=3, interval=1e-6)
    checks.near("a trajectory read as a lattice has its angle springs", float(again.trajectory.observables["elastic_energy"][0]), last, 1e-13 * last)


def lammps(checks, folder):
    """angle_style harmonic, E = K (theta - theta_0)^2: our stiffness is 2 K. Velocity Verlet errs by h^2."""
    lmp = shutil.which("lmp")
    if not lmp:
        checks.skip("LAMMPS", "no lmp here (apt install lammps)")
        return
    for name, rest in (("straight", np.pi), ("bent", 2.2)):
        chain, T, h = arc(3, 10, rest=rest), 1.0, 1e-4
        chain.free[:] = True
        chain.kappa[:] = chain.kappa[0]
        n = len(chain.x)
        lines = ["angle chain", "", f"{n} atoms", f"{n - 1} bonds", f"{n - 2} angles", f"{n} atom types", "1 bond types", "1 angle types",
                 "-50 50 xlo xhi", "-50 50 ylo yhi", "-50 50 zlo zhi", "", "Masses", ""]
        lines += [f"{i + 1} {m:.17g}" for i, m in enumerate(chain.m)] + ["", "Atoms # angle", ""]
        lines += [f"{i + 1} 1 {i + 1} " + " ".join(f"{c:.17g}" for c in p) for i, p in enumerate(chain.x)] + ["", "Velocities", ""]
        lines += [f"{i + 1} " + " ".join(f"{c:.17g}" for c in v) for i, v in enumerate(chain.v)] + ["", "Bonds", ""]
        lines += [f"{k + 1} 1 {k + 1} {k + 2}" for k in range(n - 1)] + ["", "Angles", ""]
        lines += [f"{k + 1} 1 {k + 1} {k + 2} {k + 3}" for k in range(n - 2)]
        lines += ["", "Bond Coeffs # harmonic", "", f"1 {chain.k / 2:.17g} {chain.L:.17g}", "", "Angle Coeffs # harmonic", "",
                  f"1 {chain.kappa[0] / 2:.17g} {np.degrees(rest):.17g}"]
        (folder / "chain.data").write_text("\n".join(lines) + "\n")
        (folder / "chain.in").write_text(f"""units lj
atom_style angle
boundary f f f
pair_style zero 10.0
bond_style harmonic
angle_style harmonic
read_data chain.data
pair_coeff * *
fix 1 all nve
timestep {h}
dump 1 all custom {round(T / h)} end.txt id x y z
dump_modify 1 sort id format float %.17g
run {round(T / h)}
""")
        subprocess.run([lmp, "-in", "chain.in", "-log", "none"], cwd=folder, check=True, capture_output=True, timeout=300)
        theirs = np.loadtxt((folder / "end.txt").read_text().splitlines()[-n:])[:, 1:]
        moved = np.abs(theirs - chain.x).max()
        subprocess.run([sys.executable, REPO / "postprocess/convert.py", "chain.data", "-o", "read.h5", "--units", "lj"], cwd=folder, check=True,
                       capture_output=True, timeout=100)
        with h5py.File(folder / "read.h5") as f:
            checks.true(f"{name}: convert.py reads the triples", np.array_equal(f["angles/triples"][...], chain.triples))
            checks.near(f"{name}: and the stiffnesses", f["angles/stiffness"][...], chain.kappa, 1e-15)
            checks.near(f"{name}: and the rest angles", f["angles/rest_angle"][...], chain.rest, 1e-15)
        for ranks, lattice in ((2, chain.write(folder / "lammps.h5")), (1, folder / "read.h5")):
            ours = run(checks.program, dict(TIGHT_RK, bs_lattice_file=lattice, ts_max_time=T), ranks=ranks, interval=T)
            back = folder / "back.h5md"
            if ranks == 1:  # a data file of the trajectory's start is the file it came from
                run(checks.program, dict(bs_lattice_file=lattice, bs_output=back, bs_overwrite=True, ts_dt=1e-3, ts_max_steps=1))
                for words in (("back.h5md", "-o", "again.data", "--units", "lj", "--frame", "0"), ("again.data", "-o", "again.h5")):
                    subprocess.run([sys.executable, REPO / "postprocess/convert.py", *words], cwd=folder, check=True, capture_output=True, timeout=100)
                with h5py.File(folder / "again.h5") as f:
                    checks.true(f"{name}: a data file and back", np.array_equal(f["angles/triples"][...], chain.triples))
                    checks.near(f"{name}: its stiffnesses", f["angles/stiffness"][...], chain.kappa, 1e-14)
                    checks.near(f"{name}: its rest angles", f["angles/rest_angle"][...], chain.rest, 1e-15)
            checks.below(f"LAMMPS, {name} at rest, {lattice.name}: positions after it moved {moved:.2g}", np.abs(ours.trajectory.position[-1] - theirs).max(), 2e-7)


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        for group in (hencky, motions, orders, solvers, ranks, advice, large, sheared, singular, restarts, read_back, lammps):
            if checks.wants(group.__name__):
                with checks.group(group.__name__):
                    group(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
