#!/usr/bin/env python3
"""What is left of the forces at an equilibrium: soft networks against linear algebra, soft chains beside stiff ones, lattices without any load, and
solvers whose tolerances end them early, which must not be called ok."""
import h5py
import numpy as np
import scipy.sparse as sp
from harness import run_parts, write_lattice

ROOT = 3**0.5 / 2


def fibre_net(path, n, kept, kappa, seed):
    """A triangular net of unit springs, each kept with probability `kept`, with angle springs along its straight lines; its positions, its linear
    stiffness, and which particles are at the bottom and at the top."""
    rng = np.random.default_rng(seed)
    x = np.array([[i + 0.5 * (j % 2), ROOT * j] for j in range(n) for i in range(n)])
    bond = {}
    for j in range(n):
        for i in range(n):
            for d, (k, l) in enumerate(((i + 1, j), (i + j % 2, j + 1), (i - 1 + j % 2, j + 1))):
                if 0 <= k < n and l < n and rng.random() < kept:
                    bond[n * j + i, d] = n * l + k
    pairs = np.array([(a, b) for (a, _), b in bond.items()])
    lines = np.array([(a, b, bond[b, d]) for (a, d), b in bond.items() if (b, d) in bond])
    write_lattice(path, x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0, angles={"triples": lines, "stiffness": np.full(len(lines), kappa), "rest_angle": np.full(len(lines), np.pi)})
    rows, columns, values = [], [], []
    for row, (a, b) in enumerate(pairs):  # elongations n.(u_b - u_a)
        e = x[b] - x[a]
        rows += [row] * 4
        columns += [2 * a, 2 * a + 1, 2 * b, 2 * b + 1]
        values += [-e[0], -e[1], e[0], e[1]]
    for row, (a, b, c) in enumerate(lines, len(pairs)):  # turns t.(u_a - 2 u_b + u_c), scaled
        t = np.sqrt(kappa) * np.array([x[a][1] - x[b][1], x[b][0] - x[a][0]])
        rows += [row] * 6
        columns += [2 * a, 2 * a + 1, 2 * b, 2 * b + 1, 2 * c, 2 * c + 1]
        values += [t[0], t[1], -2 * t[0], -2 * t[1], t[0], t[1]]
    B = sp.coo_matrix((values, (rows, columns)), shape=(len(pairs) + len(lines), 2 * n * n)).tocsr()
    at = np.arange(n * n)
    return x, (B.T @ B).toarray(), at < n, at >= n * (n - 1)


def soft_network(checks, folder):
    """Sheared by so little that it is linear: reactions of bending a million times softer than stretching, with parts that hang loose."""
    n, kappa = 20, 1e-6
    x, K, bottom, top = fibre_net(folder / "f.h5", n, 0.55, kappa, 1)
    free = np.repeat(~(bottom | top), 2)
    for strain, bound in ((1e-6, 1e-3), (1e-7, 1e-2)):
        u = np.zeros(2 * n * n)
        u[0::2][top] = strain * x[top, 1][0]
        u[free] = -np.linalg.lstsq(K[np.ix_(free, free)], K[free] @ u, rcond=1e-14)[0]
        exact = (K @ u)[0::2][top].sum()
        for ranks in (1, 3):
            r = checks.run({"bs_task": "statics", "bs_lattice_file": folder / "f.h5", "bs_group_b": f"ids:0-{n - 1}", "bs_group_t": f"ids:{n * (n - 1)}-{n * n - 1}", "bs_motion_b": "fixed",
                            "bs_motion_t": f"x=velocity:{strain * x[top, 1][0]!r},y=fixed"}, interval=0, ranks=ranks)
            found = [side * r.trajectory.observables[f"reaction/{g}"][-1][0] for g, side in (("t", 1), ("b", -1))]
            label = f"shear {strain:g}, {ranks} rank(s)"
            checks.below(f"{label}: reactions at either side", np.abs(np.array(found) / exact - 1).max(), bound, f"{found[0]:.5g}, {found[1]:.5g} N, exact {exact:.5g}")
            left = r.report["last_unbalanced_force"][0] if isinstance(r.report["last_unbalanced_force"], list) else r.report["last_unbalanced_force"]
            checks.below(f"{label}: unbalanced force", left, 1e-13)
            checks.true(f"{label}: told where it is above 1e-6 of the reactions", ("unbalanced_force" in r.report["warnings"]) == (left > 1e-6 * exact) and r.report["unbalanced"] == (left > 1e-6 * exact),
                        str(r.report["warnings"]))


def beside(checks, folder):
    """A chain of soft springs, its end moved, beside a stressed chain that is stiffer by up to 10^10: the soft one takes up the motion evenly."""
    for k in (1e-4, 1e2, 1e6):
        x = [[1.01 * i, 0.0] for i in range(6)] + [[i, 30.0] for i in range(6)]
        path = write_lattice(folder / "b.h5", x, 1.0, fixed=[1, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0], pairs=[[i, i + 1] for i in range(11) if i != 5], stiffness=[k] * 5 + [1e-4] * 5, rest_length=1.0)
        for way in (1e-3, 1e-6):
            r = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_group_e": "ids:11", "bs_motion_e": f"x=velocity:{way},y=fixed"}, interval=0)
            moved = (r.trajectory.position[-1] - r.trajectory.position[0])[6:, 0] / way
            checks.near(f"{k / 1e-4:g} times stiffer, moved by {way:g} m", moved, np.linspace(0, 1, 6), 1e-5)


def without_stiffness(checks, folder):
    """Periodic nets with so few springs that they bear no shear: an equilibrium has every spring at its rest length, and no load step needs to be shorter."""
    n, strain = 14, 0.1
    edges = n * np.array([[1, 0], [0.5, ROOT]])
    for seed in (1, 2, 3):
        rng = np.random.default_rng(seed)
        kept = [(i, j, i + di, j + dj) for i in range(n) for j in range(n) for di, dj in ((1, 0), (0, 1), (1, -1)) if rng.random() < 0.58]
        pairs = np.array([(n * i + j, n * (k % n) + l % n) for i, j, k, l in kept])
        shift = np.array([(k // n, l // n) for _, _, k, l in kept])
        x = np.array([[i + 0.5 * j, ROOT * j] for i in range(n) for j in range(n)])
        path = write_lattice(folder / "w.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0, box=edges, shift=shift)
        for ranks in (1, 3):
            r = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_box_strain": f"xy=velocity:{strain}", "bs_load_steps": 6}, interval=0, ranks=ranks)
            y, sheared = r.trajectory.position[-1], edges @ np.array([[1, strain], [0, 1]]).T
            length = np.linalg.norm(y[pairs[:, 1]] + shift @ sheared - y[pairs[:, 0]], axis=1)
            checks.below(f"net {seed}, {ranks} rank(s): springs as long as at rest", np.abs(length - 1).max(), 1e-8)
            checks.true(f"net {seed}, {ranks} rank(s): in the load steps asked for", r.report["steps"] == 6 and r.report["rejected"] == 0, f"{r.report['steps']}, {r.report['rejected']} rejected")


def diluted_plate(path, n, kept, seed):
    """A triangular plate with some of its springs, notched from the left; groups lo and up; particles without springs are left out, loose ends stay."""
    rng, middle = np.random.default_rng(seed), ROOT * (n - 1) / 2 + 1e-3
    x = np.array([[i + 0.5 * (j % 2), ROOT * j] for j in range(n) for i in range(n)])
    ends = ((n * j + i, k, l) for j in range(n) for i in range(n) for k, l in ((i + 1, j), (i + j % 2, j + 1), (i - 1 + j % 2, j + 1)))
    pairs = np.array([(a, n * l + k) for a, k, l in ends if 0 <= k < n and l < n and rng.random() < kept])
    a, b = x[pairs[:, 0]], x[pairs[:, 1]]
    pairs = pairs[~(((a[:, 1] - middle) * (b[:, 1] - middle) < 0) & ((a[:, 0] + b[:, 0]) / 2 < 0.4 * n))]
    used, pairs = np.unique(pairs, return_inverse=True)
    x, pairs = x[used], pairs.reshape(-1, 2)
    write_lattice(path, x, 1.0, pairs=pairs, stiffness=1.0, rest_length=np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1))
    with h5py.File(path, "a") as f:
        f["groups/lo"], f["groups/up"] = np.flatnonzero(used < n), np.flatnonzero(used >= n * (n - 1))
    return path, x, pairs


def linkages(checks, folder):
    """Plates near their rigidity threshold: linkages in them turn far under forces that are tiny beside those of their bars."""
    path, start, pairs = diluted_plate(folder / "p.h5", 24, 0.7, 5)
    with h5py.File(path) as f:
        free = np.setdiff1d(np.arange(len(start)), np.concatenate([f["groups/lo"][()], f["groups/up"][()]]))
    for ranks in (1, 3):
        r = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_motion_lo": "fixed", "bs_motion_up": "x=fixed,y=velocity:0.5", "bs_load_steps": 8}, interval=0, ranks=ranks)
        checks.true(f"{ranks} rank(s): in the load steps asked for", r.report["steps"] == 8 and r.report["rejected"] == 0, f"{r.report['steps']}, {r.report['rejected']} rejected")
        checks.true(f"{ranks} rank(s): by pseudo-transient continuation", r.report["pseudo_transient"] > 0, f"{r.report['pseudo_transient']} of 8")
        y, force = r.trajectory.position[-1], np.zeros_like(start)
        way = y[pairs[:, 1]] - y[pairs[:, 0]]
        length, rest = np.linalg.norm(way, axis=1), np.linalg.norm(start[pairs[:, 1]] - start[pairs[:, 0]], axis=1)
        np.add.at(force, pairs[:, 0], ((length - rest) / length)[:, None] * way)
        np.add.at(force, pairs[:, 1], -((length - rest) / length)[:, None] * way)
        checks.below(f"{ranks} rank(s): force left on free particles, by the largest tension", np.abs(force[free]).max() / np.abs(length - rest).max(), 1e-9)


NET = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_fixed": "ymax", "bs_gravity": "0,-1"}
BOX = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.1, "bs_lattice_seed": 1, "bs_lattice_rest_length_factor": 1.05}


def early_ends(checks, folder):
    """Tolerances and solvers of the user's that end before there is an equilibrium: exit code 3, the lattice as it was given in the file."""
    tasks = {"statics": {**NET, "bs_task": "statics"}, "ten load steps": {**NET, "bs_task": "statics", "bs_load_steps": 10}, "arc length": {**NET, "bs_task": "statics", "bs_load_control": "arc"},
             "moduli": {**BOX, "bs_task": "moduli"}, "given stress": {**BOX, "bs_task": "statics", "bs_box_stress": "xx=1,yy=1"}, "modes": {**NET, "bs_task": "modes", "bs_modes": 2, "bs_modes_about": "equilibrium"}}
    early = {"snes_atol": {"snes_atol": 1e30}, "ksponly": {"snes_type": "ksponly"}}
    for task, options in tasks.items():
        for name, more in early.items():
            for ranks in (1, 3) if task in ("statics", "moduli") else (1,):
                if name == "ksponly" and task in ("arc length", "given stress"):
                    continue  # they repeat the linear solves themselves
                r = checks.run({**options, **more, "bs_energy_growth": None}, expect=3, ranks=ranks)
                checks.true(f"{task}, {name}, {ranks} rank(s)", "unbalanced force" in r.stderr, next((line for line in r.stderr.splitlines() if "error" in line), r.stderr[-200:])[:200])
    stressed = [checks.run({**tasks["given stress"], **more}).report["box_stress"]["strain"] for more in ({}, early["ksponly"])]
    checks.near("given stress, ksponly: the same strain", stressed[1], stressed[0], 1e-9)
    for name, more in {"one iteration": {"snes_max_it": 1}, "no test": {"snes_convergence_test": "skip"}, "rtol 1e-2": {"snes_rtol": 1e-2}}.items():
        r = checks.run({**NET, "bs_task": "statics", **more}, expect=None)
        truth = checks.run({**NET, "bs_task": "statics"}).report["last_total_energy"][0]
        checks.true(f"statics, {name}: right, or not ok", r.report["outcome"] == "failed" or abs(r.report["last_total_energy"][0] / truth - 1) < 1e-9, r.report["outcome"])
    loose = checks.run({**NET, "bs_gravity": "0,-5", "ts_max_time": 0.1, "snes_atol": 100}).report
    checks.true("dynamics, snes_atol 100: warned of", "newton_loose" in loose["warnings"] and loose["newton_loose"] == loose["steps"], str(loose["warnings"]))
    checks.true("and not by default", not checks.run({**NET, "bs_gravity": "0,-5", "ts_max_time": 0.1}).report["warnings"])


def at_rest(checks, folder):
    """Nothing acts: rounding errors are no fault."""
    for name, options in {"net": {**NET, "bs_gravity": None}, "free net": {"bs_lattice_type": "triangular", "bs_lattice_size": "5,5"},
                          "box": {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy"},
                          "cube, far from the origin": {"bs_lattice_type": "cubic", "bs_lattice_size": "4,4,4", "bs_lattice_origin": "1e3,1e3,1e3", "bs_lattice_fixed": "zmax"}}.items():
        report = checks.run({**options, "bs_task": "statics", "bs_load_steps": 3}).report
        checks.true(f"{name} at rest", report["outcome"] == "ok" and report["warnings"] == [] and report["unbalanced"] == 0, f"{report['warnings']}, {report['last_unbalanced_force']}")


def slow_drive(checks, folder):
    """A row driven so slowly that positions hardly keep its motion takes the steps asked for, and moves as at any speed."""
    options = {"bs_lattice_type": "square", "bs_lattice_size": "4,4", "bs_group_g": "xmin", "ts_dt": 0.01, "ts_max_time": 0.05}
    exact = checks.run({**options, "bs_motion_g": "x=velocity:1e-4"}, interval=0.05).trajectory.velocity[-1] / 1e-4
    for speed in (1e-8, 1e-9, 1e-10):
        for ranks in (1, 3):
            r = checks.run({**options, "bs_motion_g": f"x=velocity:{speed}"}, interval=0.05, ranks=ranks)
            checks.true(f"{speed:g} m/s, {ranks} rank(s): steps", r.report["steps"] == 5 and r.report["rejected"] == 0, f"{r.report['steps']} steps, {r.report['newton']} iterations")
            checks.near(f"{speed:g} m/s, {ranks} rank(s): velocities", r.trajectory.velocity[-1] / speed, exact, 1e-12 / speed)


if __name__ == "__main__":
    run_parts(__doc__, (soft_network, beside, without_stiffness, linkages, early_ends, at_rest, slow_drive))
