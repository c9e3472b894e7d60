#!/usr/bin/env python3
"""The methods for M x'' = f that are the program's own, verlet and alpha2, and the first steps of bdf: energies, reversal, damping
of stiff oscillations, evaluations a step, output times and cuts where they hurt most, ranks. Against closed forms, the
methods' published formulas in NumPy, and SciPy's DOP853."""
import pathlib
import re
import subprocess
import tempfile

from every_type import Lattice
from harness import Checks, direct, observed_orders, write_lattice
import numpy as np
from orders import T, system
from program import environment, words

CHAIN = 20
STIFF, MASS = 50.0, 0.7


def chain(folder, velocity=None):
    """A chain with both ends held, its particles moving along it at random: linear, and its K as a matrix."""
    rng = np.random.default_rng(3)
    x, fixed = np.arange(CHAIN, dtype=float)[:, None], np.arange(CHAIN) % (CHAIN - 1) == 0
    v = 0.1 * rng.standard_normal((CHAIN, 1)) * ~fixed[:, None] if velocity is None else velocity
    pairs = np.c_[np.arange(CHAIN - 1), np.arange(1, CHAIN)]
    path = write_lattice(pathlib.Path(folder) / "chain.h5", x, MASS, v, fixed, pairs=pairs, stiffness=STIFF, rest_length=1.0)
    K = STIFF * (2 * np.eye(CHAIN) - np.eye(CHAIN, k=1) - np.eye(CHAIN, k=-1))[1:-1, 1:-1]
    return path, x[1:-1, 0], K


def energies_of_verlet(checks, folder):
    """On a linear chain velocity Verlet keeps v.M v/2 + u.K (1 - h^2/4 M^-1 K) u/2 exactly, so its energy cannot drift."""
    path, rest, K = chain(folder)
    h = 9 / 128  # times are exact, and no step is cut by rounding; 0.59 of the limit, which is 0.118
    r = checks.run({"bs_lattice_file": path, "ts_type": "verlet", "ts_dt": h, "ts_max_time": 100000 * h}, interval=500 * h).trajectory
    u, v = r.position[:, 1:-1, 0] - rest, r.velocity[:, 1:-1, 0]
    force = u @ K
    energy = (MASS * v ** 2).sum(1) / 2 + (u * force).sum(1) / 2
    kept = energy - h ** 2 / 8 * (force ** 2).sum(1) / MASS
    checks.true("verlet, 1e5 steps of 0.59 of the limit: 201 frames", len(energy) == 201)
    checks.below("verlet, 1e5 steps: what it keeps exactly", np.abs(kept / kept[0] - 1).max(), 1e-10)
    drift = np.polyfit(np.linspace(0, 1, len(energy)), energy / energy.mean(), 1)[0]
    checks.below("verlet, 1e5 steps: drift of the energy in all", abs(drift), 0.02, f"it swings by {np.ptp(energy) / energy.mean():.2g}")


def reversal(checks, folder):
    """A nonlinear lattice without damping, its velocities turned round after N steps, comes back to its start."""
    rng = np.random.default_rng(8)
    n = 4
    x = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2) + 0.05 * rng.standard_normal((n * n, 2))
    pairs = np.array([(i, j) for i in range(n * n) for j in range(i) if np.linalg.norm(x[i] - x[j]) < 1.6])
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * 0.97
    v, h, steps = 0.3 * rng.standard_normal(x.shape), 0.02, 2000
    for kind, solver, bound in (("verlet", {}, 1e-9), ("alpha2", {**direct(checks.ranks), "snes_rtol": 1e-13}, 1e-7)):
        def advance(x, v):
            path = write_lattice(pathlib.Path(folder) / "turn.h5", x, 1.3, v, pairs=pairs, stiffness=40.0, rest_length=rest)
            r = checks.run({"bs_lattice_file": path, "ts_type": kind, "ts_dt": h, "ts_max_time": steps * h, **solver}, interval=steps * h).trajectory
            return r.position[-1], r.velocity[-1]
        there = advance(x, v)
        back = advance(there[0], -there[1])
        checks.true(f"{kind}: {steps} steps lead somewhere else", np.abs(there[0] - x).max() > 0.1)
        checks.below(f"{kind}: {steps} steps there and back", max(np.abs(back[0] - x).max(), np.abs(back[1] + v).max()), bound, "m, m/s")


def conservative(checks, folder):
    """Order 2 of verlet without forces that depend on velocities, and with output times that cut steps short in no rhythm."""
    s = system()
    s.motion = s.extra_force = None
    s.damping, s.anchors = np.zeros_like(s.damping), {**s.anchors, "damping": np.zeros(2)}
    from scipy.integrate import solve_ivp
    reference = solve_ivp(s.rhs, (0, T), s.state(), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1].reshape(2, s.n, s.dim)
    lattice = s.write(pathlib.Path(folder) / "conservative.h5")
    for name, share in (("", 1), (", output times between the steps", np.sqrt(2) / 9)):
        errors = []
        for n in (100, 200, 400):
            r = checks.run({**s.options(lattice), "ts_type": "verlet", "ts_dt": T / n, "ts_max_time": T}, interval=T * share).trajectory
            errors.append(max(np.abs(a - b).max() / np.abs(b).max() for a, b in zip((r.position[-1], r.velocity[-1]), reference)))
        seen = observed_orders([1 / n for n in (100, 200, 400)], errors)
        checks.true(f"verlet without damping{name}: order 2", abs(seen[-1] - 2) <= 0.15, "observed " + ", ".join(f"{q:.3f}" for q in seen) + f", error {errors[-1]:.2g}")


def evaluations(checks, folder):
    """Forces are evaluated once a step, and once before the first."""
    path, *_ = chain(folder)
    for steps in (10, 60):
        line = [str(checks.program), *words({"bs_lattice_file": path, "ts_type": "verlet", "ts_dt": 1e-3, "ts_max_steps": steps, "bs_advise": False,
                                             "bs_energy_growth": 0, "log_view": True})]
        said = subprocess.run(line, env=environment(1), capture_output=True, text=True, timeout=120).stdout
        found = re.search(r"^BSForces +(\d+)", said, re.M)
        checks.true(f"verlet, {steps} steps: evaluations of the forces", bool(found) and int(found.group(1)) == steps + 1, found.group(1) if found else "none counted")


def oscillator(checks, folder, kind, omega, x0, v0, steps, every=1, **options):
    """(x, v) after every so many of some steps of 1 s of m x'' = -m omega^2 x."""
    path = write_lattice(pathlib.Path(folder) / "one.h5", [[x0]], 1.0, [[v0]],
                         anchors={"particle": [0], "point": [[0.0]], "stiffness": [omega ** 2], "rest_length": [0.0], "damping": [0.0]})
    r = checks.run({"bs_lattice_file": path, "ts_type": kind, "ts_dt": 1, "ts_max_time": steps, "bs_energy_growth": 0, **options}, interval=every).trajectory
    return np.stack([r.position[:, 0, 0], r.velocity[:, 0, 0]], 1)


def alpha_matrix(rho, q):
    """One step of 1 s of Chung and Hulbert's method on x'' = -q x, on (x, v, a), solved from its equations as published
    (with their alpha_m and alpha_f, 1 less those of the program)."""
    am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma, beta = 0.5 - am + af, (1 - am + af) ** 2 / 4
    # (1 - am) a1 + am a0 + q ((1 - af) x1 + af x0) = 0;  x1 = ..., v1 = ...
    left = np.array([[1, 0, -beta], [0, 1, -gamma], [q * (1 - af), 0, 1 - am]])
    right = np.array([[1, 1, 0.5 - beta], [0, 1, 1 - gamma], [-q * af, 0, -am]])
    return np.linalg.solve(left, right)


def damping_of_alpha2(checks, folder):
    for rho in (1.0, 0.8, 0.5, 0.2, 0.0):
        for omega in (0.7, 3.0, 1e4):
            A = alpha_matrix(rho, omega ** 2)
            z = [np.array([0.3, 0.2, -omega ** 2 * 0.3])]
            for _ in range(40):
                z.append(A @ z[-1])
            seen = oscillator(checks, folder, "alpha2", omega, 0.3, 0.2, 40, ts_alpha_radius=rho, snes_rtol=1e-14)
            z = np.array(z)[:, :2]
            off = np.abs(seen - z).max(0) / np.abs(z).max(0)
            checks.below(f"alpha2, radius {rho}, h omega = {omega:g}: the published formulas, 40 steps", off.max(), 1e-8)
        # the double root -rho at infinity lets the amplitude go as n rho^n
        if rho > 0:
            size = np.abs(seen[:, 1])
            checks.near(f"alpha2, radius {rho}: amplitude of a stiff oscillation a step", (size[40] / size[20]) ** (1 / 20), rho, 0.1 * rho)
        else:
            checks.below("alpha2, radius 0: a stiff oscillation after 5 steps", np.abs(seen[5, 1] / seen[0, 1]), 1e-3)
    z = oscillator(checks, folder, "alpha2", 0.7, 0.3, 0.2, 10000, every=100, snes_rtol=1e-14)
    energy = z[:, 1] ** 2 / 2 + (0.7 * z[:, 0]) ** 2 / 2
    checks.below("alpha2, radius 1: energy of a linear oscillator, 1e4 steps", np.abs(energy / energy[0] - 1).max(), 1e-10)


def error_of(problem, trajectory):
    return max(np.abs(a - b).max() / np.abs(b).max() for a, b in zip((trajectory.position[-1], trajectory.velocity[-1]), problem.reference))


def cuts(checks, problem):
    """Newton that fails in the first steps: they are cut and counted, and shorter steps make no larger error."""
    for name, options, first in (("alpha2", {"ts_type": "alpha2", "ts_alpha_radius": 0.5}, 20), ("bdf 3", {"ts_type": "bdf", "ts_bdf_order": 3}, 1),
                                 ("bdf 5", {"ts_type": "bdf", "ts_bdf_order": 5}, 3)):
        o = {**problem.options, **direct(checks.ranks), "ts_adapt_type": "none", **options, "ts_dt": T / 10, "snes_rtol": 1e-7}
        whole = error_of(problem, checks.run(o, interval=T).trajectory)
        cut = checks.run({**o, "snes_max_it": 2}, interval=T)
        log = cut.trajectory.log["rejected"].ravel()
        checks.true(f"{name}: some of the first {first} steps were cut", log[:first].sum() > 0 and log.sum() == cut.report["rejected"],
                    f"{log.sum():.0f} rejected, {cut.report['steps']} steps")
        checks.below(f"{name}: error after cuts, against none", error_of(problem, cut.trajectory), 1.2 * whole)


def landings(checks, problem):
    """Output times that shorten the first steps of bdf."""
    for order, bound in ((3, 5e-5), (4, 2e-6), (6, 5e-9)):
        o = {**problem.options, **direct(checks.ranks), "ts_adapt_type": "none", "ts_type": "bdf", "ts_bdf_order": order, "ts_dt": T / 200}
        r = checks.run({**o, "ts_max_time": T}, interval=T / 200 * 2.5).trajectory
        error = error_of(problem, r)
        checks.below(f"bdf {order}: error with every third step cut short", error, bound)


def ranks(checks, folder):
    block = {"bs_lattice_type": "cubic", "bs_lattice_size": "5,5,5", "bs_lattice_perturbation": 0.05, "bs_lattice_damping": 0.3, "bs_gravity": "0,0,-9.81",
             "bs_lattice_fixed": "zmin", "ts_dt": 0.002, "ts_max_time": 0.1}
    for name, options, bound in (("verlet", {"ts_type": "verlet"}, 0), ("alpha2", {"ts_type": "alpha2", "ts_alpha_radius": 0.7, "snes_rtol": 1e-11}, 1e-11),
                                 ("alpha2, full Jacobian", {"ts_type": "alpha2", "ts_alpha_radius": 0.7, "snes_rtol": 1e-11, "ksp_type": "gmres", "pc_type": "bjacobi", "ksp_rtol": 1e-10}, 1e-10),
                                 ("bdf 5", {"ts_type": "bdf", "ts_bdf_order": 5, "ts_adapt_type": "none", "snes_rtol": 1e-11}, 1e-10)):
        at = [checks.run({**block, **options}, interval=0.05, ranks=n).trajectory for n in (1, 2, 3)]
        off = max(np.abs(getattr(at[k], q)[-1] - getattr(at[0], q)[-1]).max() for k in (1, 2) for q in ("position", "velocity"))
        checks.true(f"{name}: 1, 2 and 3 ranks", off <= bound, f"{off:.2g} <= {bound:g}")


def main():
    checks = Checks(__doc__.split(":")[0])
    with tempfile.TemporaryDirectory() as folder:
        for part in (energies_of_verlet, reversal, conservative, evaluations, damping_of_alpha2, ranks):
            if checks.wants(part.__name__):
                with checks.group(part.__name__):
                    part(checks, folder)
        if checks.wants("cuts") or checks.wants("landings"):
            problem = Lattice(folder, True)
            for part in (cuts, landings):
                if checks.wants(part.__name__):
                    with checks.group(part.__name__):
                        part(checks, problem)
    checks.finish()


if __name__ == "__main__":
    main()
