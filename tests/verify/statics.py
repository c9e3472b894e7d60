#!/usr/bin/env python3
"""Equilibria (-bs_task statics) against closed forms: a hanging chain, a truss of two bars, a column of links with elastic hinges, the elastic
constants of lattices, dU/dk, the end of a slow motion, bodies that nothing holds, and a run continued from a checkpoint."""

from harness import run_parts, write_lattice
import numpy as np
from scipy.optimize import brentq
from scipy.spatial import cKDTree


def statics(checks, path, steps=1, expect=0, **more):
    return checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_load_steps": steps, **more}, interval=0, expect=expect)


def hanging_chain(checks, folder):
    """n springs, horizontal tension H: V_i linear in i, T_i = sqrt(H^2 + V_i^2), l_i = l_0 + T_i/k."""
    n, k, l0, m, g, H = 10, 50.0, 0.1, 0.2, 9.81, 3.0
    V = m * g * ((n - 1) / 2 - np.arange(n))
    T = np.hypot(H, V)
    steps = ((l0 + T / k) / T)[:, None] * np.stack([np.full(n, H), -V], 1)
    exact = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, 0)])
    checks.near("span of the closed form", exact[-1, 0], 1.18163116976, 1e-11)
    start = np.stack([np.linspace(0, exact[-1, 0], n + 1), np.zeros(n + 1)], 1)
    at = np.arange(n + 1)
    path = write_lattice(folder / "chain.h5", start, m, fixed=(at == 0) | (at == n), pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k, rest_length=l0)
    for count in (1, 5):
        r = statics(checks, path, count, bs_gravity="0,-9.81").trajectory
        checks.near(f"hanging chain, {count} load steps, positions", r.position[-1], exact, 1e-12)
        checks.near("sag", -r.position[-1, :, 1].min(), 0.86323879015, 1e-11)
        checks.near("a frame for each load step, at its load factor", r.time, np.linspace(0, 1, count + 1), 1e-15)
        checks.below("at rest", np.abs(r.velocity).max(), 0)
    swing = write_lattice(folder / "swing.h5", np.stack([0.1 * at, 0 * at], 1), m, fixed=at == 0, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k,
                          rest_length=l0)
    lengths = l0 + m * g * (n - np.arange(n)) / k
    r = statics(checks, swing, bs_gravity="0,-9.81").trajectory
    checks.near("a chain of loose hinges, held level at one end, hangs down", r.position[-1],
                np.stack([0 * at, -np.concatenate([[0], np.cumsum(lengths)])], 1), 1e-9)


def truss(folder):
    return write_lattice(folder / "truss.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0)


def load_of(h, l0=np.hypot(1, 0.3)):
    """The load that the two bars bear with their apex at height h; 0.3 without load."""
    return 2 * h * (l0 / np.hypot(1, h) - 1)


def von_mises(checks, folder):
    path, limit = truss(folder), 0.0099499169577446
    r = statics(checks, path, 10, bs_gravity="0,-0.009").trajectory
    checks.near("truss below its limit load", r.position[:, 2, 1], [brentq(lambda h: load_of(h) - 0.009 * s, 0.19, 0.31, xtol=1e-15) for s in r.time], 1e-12)
    run = statics(checks, path, 10, bs_gravity="0,-0.02")
    r = run.trajectory
    over = r.time * 0.02 > limit
    checks.near("truss before it snaps through", r.position[~over, 2, 1],
                [brentq(lambda h: load_of(h) - 0.02 * s, 0.19, 0.31, xtol=1e-15) for s in r.time[~over]], 1e-12)
    checks.near("and after", r.position[over, 2, 1], [brentq(lambda h: load_of(h) - 0.02 * s, -0.6, -0.3, xtol=1e-15) for s in r.time[over]], 1e-12)


def arc_length(checks, folder):
    """The truss along its whole path: up to the limit load, back through its negative and up again, to twice the limit load."""
    run = statics(checks, truss(folder), 20, bs_gravity="0,-0.02", bs_load_control="arc")
    r = run.trajectory
    factor, height = r.observables["load_factor"].ravel(), r.position[:, 2, 1]
    checks.near("path by arc length: load of the two bars at every height", 0.02 * factor, load_of(height), 1e-14)
    checks.near("its highest load before the end is the limit load", 0.02 * factor[height > 0].max(), 0.00994991696, 1e-5)
    checks.near("and its lowest the negative one", 0.02 * factor.min(), -0.00994991696, 1e-5)
    checks.near("it ends at the load factor 1", float(factor[-1]), 1.0, 0)
    pivots = r.observables["negative_pivots"].ravel()
    checks.true("one negative pivot between the limit points, none elsewhere", bool(np.array_equal(pivots[1:], (np.abs(height[1:]) < 0.17159).astype(float))),
                f"{pivots.sum():g} of {len(pivots)}")
    checks.true("turns are counted", run.report["turns"] == 2 and run.report["inertia_changes"] == 2, f"{run.report['turns']}, {run.report['inertia_changes']}")
    chain = folder / "chain.h5"
    if not chain.exists():
        hanging_chain(checks, folder)
    one, other = (statics(checks, chain, 5, bs_gravity="0,-9.81", **more).trajectory for more in ({}, {"bs_load_control": "arc"}))
    checks.near("a chain by arc length and by load", other.position[-1], one.position[-1], 1e-12)


def rest(checks, folder):
    """A damped oscillator ends where its force and velocity have fallen far enough, which its closed form says."""
    path = write_lattice(folder / "one.h5", [[0.0], [1.5]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=4.0, rest_length=1.0, damping=1.0)
    run = checks.run({"bs_lattice_file": path, "ts_type": "cn", "ts_dt": 0.01, "ts_max_time": 1000, "bs_stop_at_rest": 1e-6}, interval=1)
    checks.below("a damped oscillator ends at rest", abs(run.report["t"] + 2 * np.log(1e-6)), 2.0, "near 27.6 s")
    checks.true("said in the summary", "ended at rest" in run.stdout)


def column(checks, folder):
    """Hencky's column: rigid links with elastic hinges, both ends pinned, buckles at 4 kappa/a sin^2(pi/2n)."""
    n, a, kappa, k, critical = 8, 0.5, 3.0, 1e7, 0.913445609864564
    at = np.arange(n + 1)
    x = np.stack([a * at, 0 * at], 1).astype(float)
    angles = {"triples": np.stack([at[:-2], at[1:-1], at[2:]], 1), "stiffness": kappa, "rest_angle": np.pi}
    pairs = np.stack([at[:-1], at[1:]], 1)
    for load, unstable in ((0.999, 0), (1.001, 1)):
        # the ends are held apart by less than their length: the links carry the load
        squeezed = x * [1 - load * critical / k / a, 1]
        path = write_lattice(folder / f"column{unstable}.h5", squeezed, 1.0, fixed=(at == 0) | (at == n), pairs=pairs, stiffness=k, rest_length=a, angles=angles)
        run = statics(checks, path)
        checks.near(f"straight column at {load} of its buckling load: negative pivots", float(run.trajectory.observables["negative_pivots"][-1]), unstable, 0)
        checks.true("said in the summary", ("unstable: the tangent there has negative pivots" in run.stdout) == bool(unstable))
    squeezed[1:-1, 1] = 1e-3 * np.sin(np.pi * at[1:-1] / n)
    path = write_lattice(folder / "bent.h5", squeezed * [0.9, 1], 1.0, fixed=(at == 0) | (at == n), pairs=pairs, stiffness=1e4, rest_length=a, angles=angles)
    run = statics(checks, path)
    checks.near("squeezed by a tenth it bends into a stable shape", float(run.trajectory.observables["negative_pivots"][-1]), 0, 0)
    checks.below("all of one sign", 0.5, run.trajectory.position[-1, n // 2, 1])


def net(n, rows):
    """A triangular net of unit springs: particles and pairs."""
    i, j = (q.ravel() for q in np.meshgrid(np.arange(n), np.arange(rows)))
    x = np.stack([i + 0.5 * (j % 2), np.sqrt(3) / 2 * j], 1)
    return x, np.array(sorted(cKDTree(x).query_pairs(1.01))), (i == 0) | (i == n - 1) | (j == 0) | (j == rows - 1)


def moduli(checks, folder):
    """The energy of a patch held at its rim and strained by e and -e: U'' = A C(e, e); of the triangular net C11 = 9k/(4 sqrt 3) and C12 = C11/3,
    that is E = 2k/sqrt 3, nu = 1/3; of the cubic one of springs along the edges C11 = k/a, C12 = C44 = 0."""
    k, e = 1.0, 1e-4
    x, pairs, rim = net(9, 9)
    energies = {}
    rng = np.random.default_rng(3)
    for name, gradient in (("xx", [[1, 0], [0, 0]]), ("both", [[1, 0], [0, 1]]), ("shear", [[0, 1], [0, 0]])):
        total = 0
        for sign in (1, -1):
            y = x + sign * e * x @ np.transpose(gradient)
            y[~rim] += rng.normal(0, 1e-2, (np.count_nonzero(~rim), 2))
            path = write_lattice(folder / "patch.h5", y, 1.0, fixed=rim, pairs=pairs, stiffness=k, rest_length=1.0)
            total += statics(checks, path).trajectory.observables["elastic_energy"][-1]
        energies[name] = total / e**2
    # a lattice strained alike everywhere: the sum over its springs of k (u.E u)^2
    u = x[pairs[:, 1]] - x[pairs[:, 0]]
    for name, strain in (("xx", [[1, 0], [0, 0]]), ("both", np.eye(2)), ("shear", [[0, 0.5], [0.5, 0]])):
        checks.near(f"strained patch, {name}: inner particles follow", energies[name], float(np.sum(np.einsum("ki,ij,kj->k", u, np.asarray(strain), u)**2)), 1e-6)
    bulk = lambda name, n: statics_of_bulk(checks, folder, name, n, e)  # noqa: E731
    c11, c12 = bulk("xx", 9) * 1.0, 0.5 * (bulk("both", 9) - 2 * bulk("xx", 9))
    checks.near("triangular net: E = 2k/sqrt 3", c11 - c12**2 / c11, 2 / np.sqrt(3), 2e-5)
    checks.near("triangular net: nu = 1/3", c12 / c11, 1 / 3, 2e-5)


def statics_of_bulk(checks, folder, name, n, e):
    """C(e, e) of the inner cells: the springs inside the rim, by the strains that the run writes."""
    x, pairs, rim = net(n, n)
    gradient = {"xx": [[1, 0], [0, 0]], "both": [[1, 0], [0, 1]]}[name]
    total = 0
    for sign in (1, -1):
        path = write_lattice(folder / "bulk.h5", x + sign * e * x @ np.transpose(gradient), 1.0, fixed=rim, pairs=pairs, stiffness=1.0, rest_length=1.0)
        y = statics(checks, path).trajectory.position[-1]
        inner = np.flatnonzero(~rim)
        stretch = np.linalg.norm(y[pairs[:, 1]] - y[pairs[:, 0]], axis=1) - 1
        weight = 0.5 * np.isin(pairs, inner).sum(1)  # half a spring for each inner end: an inner particle's cell
        total += 0.5 * np.sum(weight * stretch**2)
    return total / (e**2 * len(inner) * np.sqrt(3) / 2)


def cubic(checks, folder):
    k, a, e, n = 3.0, 0.5, 1e-4, 6
    i = np.stack([q.ravel() for q in np.meshgrid(*3 * [np.arange(n)], indexing="ij")], 1)
    x, rim = a * i, ((i == 0) | (i == n - 1)).any(1)
    pairs = np.array(sorted(cKDTree(x).query_pairs(1.01 * a)))
    y = x * [1 + e, 1, 1]
    y[~rim] += np.random.default_rng(5).normal(0, 1e-4, (np.count_nonzero(~rim), 3))
    path = write_lattice(folder / "cubic.h5", y, 1.0, fixed=rim, pairs=pairs, stiffness=k, rest_length=a)
    r = statics(checks, path).trajectory
    # n^2 rows of n - 1 springs
    checks.near("cubic lattice: C11 = k/a", r.observables["elastic_energy"][-1] * 2 / (e**2 * n**2 * (n - 1) * a**3), k / a, 1e-7)


def derivative(checks, folder):
    """dU/dk of one spring of a loaded net is (l - L)^2/2, whatever the rest does."""
    x, pairs, rim = net(7, 7)
    k = np.random.default_rng(7).uniform(0.5, 2, len(pairs))
    y = x * [1.1, 1.05]
    one, step, energy = 40, 1e-4, []
    for change in (-step, 0, step):
        k_now = k.copy()
        k_now[one] += change
        path = write_lattice(folder / "net.h5", y, 1.0, fixed=rim, pairs=pairs, stiffness=k_now, rest_length=1.0)
        r = statics(checks, path).trajectory
        energy.append(r.observables["elastic_energy"][-1])
        if change == 0:
            stretch = np.linalg.norm(r.position[-1, pairs[one, 1]] - r.position[-1, pairs[one, 0]]) - 1
    checks.near("dU/dk of a spring of a stretched net", (energy[2] - energy[0]) / (2 * step), 0.5 * stretch**2, 1e-9)


def slow_motion(checks, folder):
    """A cloth hung by two corners, by load steps and by a damped motion that has come to rest."""
    x, pairs, _ = net(6, 6)
    corner = (x[:, 1] > x[:, 1].max() - 1e-9) & ((x[:, 0] < 0.6) | (x[:, 0] > 5.4))
    common = {"bs_lattice_file": write_lattice(folder / "cloth.h5", x, 0.01, fixed=corner, pairs=pairs, stiffness=20.0, rest_length=1.0),
              "bs_gravity": "0,-9.81"}
    still = statics(checks, common["bs_lattice_file"], 3, bs_gravity="0,-9.81").trajectory
    o = {**common, "bs_stokes_drag": 0.04, "ts_type": "beuler", "ts_dt": 0.25, "ts_max_time": 100, "snes_rtol": 1e-12}
    moving = checks.run(o, interval=100).trajectory
    checks.near("cloth hung by its corners: the end of a damped motion", still.position[-1], moving.position[-1], 1e-8)


def loose(checks, folder):
    path = write_lattice(folder / "loose.h5", [[0, 0], [1.2, 0], [5, 5], [7, 7], [8.1, 7]], 1.0, fixed=[0, 0, 0, 1, 0], pairs=[[0, 1], [3, 4]], stiffness=1.0,
                         rest_length=1.0)
    run = statics(checks, path)
    checks.near("free bodies relax about their centres of mass", run.trajectory.position[-1], [[0.1, 0], [1.1, 0], [5, 5], [7, 7], [8, 7]], 1e-8)
    checks.true("and are counted", run.report["free_bodies"] == 2, str(run.report["free_bodies"]))
    half = write_lattice(folder / "half.h5", [[0, 0], [1.2, 0], [2.5, 0.1]], [1, 2, 3], pairs=[[0, 1], [1, 2]], stiffness=1.0, rest_length=1.0)
    x = statics(checks, half, bs_group_all="all", bs_motion_all="y=fixed").trajectory.position[-1]
    checks.near("a body on rollers stays where it can move freely", x @ [1, 0] @ [1, 2, 3] / 6, 9.9 / 6, 1e-15)
    run = statics(checks, path, bs_gravity="0,-1", expect=2)
    checks.true("driven ones are refused", "nothing holds particle 0" in run.stderr, run.stderr.strip()[-200:])
    path = write_lattice(folder / "fixed.h5", [[0, 0], [1.2, 0]], 1.0, fixed=[1, 1], pairs=[[0, 1]], stiffness=1.0, rest_length=1.0)
    run = statics(checks, path, 2, bs_gravity="0,-1")
    checks.near("all fixed: nothing moves", run.trajectory.position[-1], [[0, 0], [1.2, 0]], 0)


def crushed(checks, folder):
    """A net pressed together by 40 % with its particles in disorder: whatever has to be done, what is written is an equilibrium."""
    x, pairs, rim = net(12, 12)
    y = x * [0.6, 1]
    y[~rim] += np.random.default_rng(1).normal(0, 0.1, (np.count_nonzero(~rim), 2))
    run = statics(checks, write_lattice(folder / "crushed.h5", y, 1.0, fixed=rim, pairs=pairs, stiffness=1.0, rest_length=1.0))
    z = run.trajectory.position[-1]
    u = z[pairs[:, 1]] - z[pairs[:, 0]]
    length = np.linalg.norm(u, axis=1)
    force = np.zeros_like(z)
    pull = ((1 - 1 / length)[:, None]) * u
    np.add.at(force, pairs[:, 0], pull)
    np.add.at(force, pairs[:, 1], -pull)
    checks.below("crushed net: forces on free particles", np.abs(force[~rim]).max(), 1e-12)
    checks.near("stable", float(run.trajectory.observables["negative_pivots"][-1]), 0, 0)


def continued(checks, folder):
    path = truss(folder)
    whole = statics(checks, path, 10, bs_gravity="0,-0.02").trajectory
    saved = folder / "half.checkpoint"
    statics(checks, path, 10, bs_gravity="0,-0.02", bs_checkpoint=saved, ts_max_steps=4)
    rest = checks.run({"bs_restart": saved, "ts_max_steps": 5000}, interval=0).trajectory
    checks.true("a run continued from a checkpoint is the same in every bit", bool(np.array_equal(rest.position[-1], whole.position[-1])),
                f"{np.abs(rest.position[-1] - whole.position[-1]).max():.3g}")


if __name__ == "__main__":
    run_parts("statics", (hanging_chain, von_mises, arc_length, rest, column, moduli, cubic, derivative, slow_motion, loose, crushed, continued))
