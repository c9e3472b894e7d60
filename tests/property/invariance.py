#!/usr/bin/env python3
"""What must not change: results under the number of ranks, under frames on the way, momentum of a free lattice, motion under
a rigid rotation."""
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import numpy as np
from harness import Checks, write_lattice
from program import direct, run


def random_lattice(folder, d, seed, free=False):
    """Points of a jittered grid, springs between near ones, unequal masses and dampers; some fixed unless `free`."""
    rng = np.random.default_rng(seed)
    side = {1: 30, 2: 6, 3: 4}[d]
    grid = np.stack(np.meshgrid(*[np.arange(side)] * d, indexing="ij"), -1).reshape(-1, d)
    x = 0.2 * grid + 0.03 * rng.standard_normal(grid.shape)
    # the rows of the file are no help to a partitioner
    x = x[rng.permutation(len(x))]
    n = len(x)
    i, j = np.triu_indices(n, 1)
    near = np.linalg.norm(x[i] - x[j], axis=1) < 0.33
    pairs = np.stack([i[near], j[near]], 1)
    m = len(pairs)
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * rng.uniform(0.9, 1.05, m)
    rest[::7] = 0
    fixed = np.zeros(n)
    anchors = None
    if not free:
        fixed[:3] = 1
        anchors = {"particle": [5, 9], "point": x[[5, 9]] + 0.1, "stiffness": [30.0, 20.0], "rest_length": [0.05, 0.0],
                   "damping": [0.1, 0.0]}
    path = pathlib.Path(folder) / f"random{d}{free:d}.h5"
    write_lattice(path, x, rng.uniform(0.05, 0.3, n), velocity=rng.standard_normal(x.shape) * 0.3, fixed=fixed,
                  radius=np.full(n, 0.02), pairs=pairs, stiffness=rng.uniform(20, 60, m), rest_length=rest,
                  damping=np.where(rest > 0, rng.uniform(0, 0.2, m), 0), anchors=anchors, spring_law="strain",
                  damping_law="axial")
    return path


LAWS = {"bs_sphere_drag": True, "bs_sphere_drag_rho": 1.2, "bs_sphere_drag_mu": 1.8e-5, "bs_stokes_drag": 0.01}


def gravity(d):
    return (0.3, -9.8, 1.1)[:d]


def ranks_agree(checks, folder):
    for d in (1, 2, 3):
        lattice = random_lattice(folder, d, 10 + d)
        base = dict(LAWS, bs_lattice_file=lattice, bs_gravity=gravity(d), ts_dt=0.01, ts_adapt_type="none")
        for name, extra, tolerance in (
                ("one explicit step", {"ts_type": "euler", "ts_max_time": 0.01}, 1e-14),
                ("20 implicit steps", {"ts_type": "beuler", "ts_max_time": 0.2, "ksp_type": "preonly", "pc_type": "lu",
                                       "pc_factor_mat_solver_type": "mumps"}, 1e-10)):
            reference = run(checks.program, dict(base, **extra), interval=0.01).trajectory
            for ranks in (2, 3, 4):
                for partition in ("graph", "geometric", "rows"):
                    if partition == "rows" and ranks == 4:
                        continue
                    other = run(checks.program, dict(base, bs_partition=partition, **extra), ranks=ranks, interval=0.01).trajectory
                    error = max(np.abs(other.position - reference.position).max() / np.abs(reference.position).max(),
                                np.abs(other.velocity - reference.velocity).max() / np.abs(reference.velocity).max())
                    checks.below(f"{name}, d = {d}, {ranks} ranks, partition {partition}", error, tolerance)


def momentum(checks, folder):
    for d in (2, 3):
        lattice = random_lattice(folder, d, 20 + d, free=True)
        for method, options in (("beuler", direct()), ("cn", direct()), ("symplectic", {})):
            result = run(checks.program, dict(options, bs_lattice_file=lattice, ts_type=method, ts_dt=0.005, ts_max_time=0.25,
                                              bs_spring_law="strain"), interval=0.05).trajectory
            p = result.observables["momentum"]
            scale = np.abs(result.mass[:, None] * result.velocity[0]).sum()
            checks.below(f"momentum of a free lattice, d = {d}, {method}", np.abs(p - p[0]).max() / scale, 1e-11)
            if method == "symplectic":
                # with x and v staggered by h/2 it is exact: L of (x_n, v_n) is conserved by velocity-first Euler
                L = result.observables["angular_momentum"]
                checks.below(f"angular momentum, d = {d}, {method}", np.abs(L - L[0]).max() / scale, 1e-11)
        midpoint = run(checks.program, dict(direct(), bs_lattice_file=lattice, ts_type="theta", ts_theta_theta=0.5,
                                            ts_theta_endpoint=0, ts_adapt_type="none", ts_dt=0.005, ts_max_time=0.25),
                       interval=0.05).trajectory
        L = midpoint.observables["angular_momentum"]
        checks.below(f"angular momentum, d = {d}, implicit midpoint", np.abs(L - L[0]).max() / scale, 1e-11)


def frames(checks, folder):
    """A run is the same with a frame at every step and with the last alone, bit for bit but for the reductions of linear solvers on several
    ranks; energies are those of the frames' states."""
    import h5py
    lattice = random_lattice(folder, 3, 50)
    with h5py.File(lattice, "r+") as f:
        springs = f["springs"]
        springs["rest_length"][...] = np.maximum(springs["rest_length"][...], 0.1)
        springs["damping"][...] = 0
        del f["anchors"]
        pairs, K, L = (springs[name][...] for name in ("pairs", "stiffness", "rest_length"))
    h = 1 / 256
    for method in ("symplectic", "euler", "verlet", "beuler", "cn", "bdf"):
        for ranks in (1, 3):
            options = {"bs_lattice_file": lattice, "ts_type": method, "ts_dt": h, "ts_max_time": 16 * h, "ts_adapt_type": "none",
                       "bs_gravity": gravity(3)}
            every, last = (run(checks.program, options, ranks=ranks, interval=interval).trajectory for interval in (h, 16 * h))
            error = max(np.abs(every.position[-1] - last.position[-1]).max(), np.abs(every.velocity[-1] - last.velocity[-1]).max())
            exact = ranks == 1 or method in ("symplectic", "euler", "verlet")
            checks.below(f"{method}, {ranks} ranks: frames at every step leave the end as it is", error, 0 if exact else 1e-12)
            l = np.linalg.norm(every.position[:, pairs[:, 0]] - every.position[:, pairs[:, 1]], axis=2)
            elastic = (K * (l - L)**2 / (2 * L)).sum(axis=1)
            checks.below(f"{method}, {ranks} ranks: elastic energy of the frames", np.abs(every.observables["elastic_energy"] / elastic - 1).max(), 1e-12)


def rigid_motion(checks, folder):
    import h5py
    lattice = random_lattice(folder, 3, 33, free=True)
    angles = (0.4, 1.1, -0.7)
    R = np.eye(3)
    for axis, a in enumerate(angles):
        q = np.eye(3)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        q[i, i] = q[j, j] = np.cos(a)
        q[i, j], q[j, i] = -np.sin(a), np.sin(a)
        R = q @ R
    shift, boost = np.array([0.5, -1.5, 0.25]), np.array([0.2, 0.1, -0.3])
    turned = pathlib.Path(folder) / "turned.h5"
    turned.write_bytes(lattice.read_bytes())
    with h5py.File(turned, "r+") as f:
        f["particles/position"][...] = f["particles/position"][...] @ R.T + shift
        f["particles/velocity"][...] = f["particles/velocity"][...] @ R.T + boost
    options = dict(direct(), ts_type="beuler", ts_dt=0.01, ts_max_time=0.2)
    a = run(checks.program, dict(options, bs_lattice_file=lattice), interval=0.1).trajectory
    b = run(checks.program, dict(options, bs_lattice_file=turned), interval=0.1).trajectory
    expected = a.position @ R.T + shift + boost * a.time[:, None, None]
    checks.below("a turned, moved and boosted lattice moves alike", np.abs(b.position - expected).max(), 1e-10)


def thrown_net(path, seed, unit):
    """A net of 24 particles that is thrown about, its times in a unit of so many seconds."""
    rng = np.random.default_rng(seed)
    x = np.array([(i + 0.5 * (j % 2), 0.866 * j) for j in range(4) for i in range(6)]) + rng.uniform(-0.05, 0.05, (24, 2))
    i, j = np.triu_indices(24, 1)
    near = (np.linalg.norm(x[i] - x[j], axis=1) < 1.25) & (rng.uniform(size=len(i)) < 0.8)
    pairs = np.stack([i[near], j[near]], 1)
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * rng.uniform(0.95, 1.05, len(pairs))
    write_lattice(path, x, rng.uniform(0.2, 0.5, 24), velocity=rng.uniform(-3, 3, x.shape) / unit, fixed=[k < 6 for k in range(24)], pairs=pairs,
                  stiffness=rng.uniform(20, 100, len(pairs)) / unit**2, rest_length=rest, spring_law="hooke")
    return path


def units(checks, folder):
    """Large implicit steps take Newton's method the same way in any unit of time, and equilibria do not depend on the masses: no search may compare F_x, which has
    masses and times in it, with forces."""
    for kind, h in (("beuler", 0.3), ("cn", 0.2)):
        for seed in range(6):
            places = []
            for unit in (1.0, 2.0**10, 2.0**-10):
                net = thrown_net(pathlib.Path(folder) / "thrown.h5", seed, unit)
                places.append(run(checks.program, {"bs_lattice_file": net, "bs_gravity": (0, -30 / unit**2), "ts_type": kind, "ts_dt": h * unit, "ts_max_time": 1.2 * unit,
                                                   "ts_adapt_type": "none", "snes_rtol": 1e-10}, interval=1.2 * unit).trajectory.position[-1])
            checks.below(f"{kind}, net {seed}, in other units of time", max(np.abs(other - places[0]).max() for other in places[1:]), 1e-6)
    x = np.array([[0, 0], [1, 0], [2, 0], [0.5, 0.8], [1.5, 0.8], [1, 1.6]])
    pairs = np.array([(0, 3), (1, 3), (1, 4), (2, 4), (3, 4), (3, 5), (4, 5)])
    for seed in (35, 36, 37, 38):
        rng = np.random.default_rng(seed)
        places = x + rng.uniform(-0.15, 0.15, x.shape)
        net = dict(pairs=pairs, stiffness=rng.uniform(20, 100, 7), rest_length=np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1), spring_law="hooke",
                   fixed=[1, 1, 1, 0, 0, 0], columns={"critical_strain": rng.uniform(0.05, 0.3, 7)})
        pull = np.random.default_rng(seed + 1000).uniform(-1.5, 1.5, 2)
        energies = []
        for mass in (1, 2.0**20):
            path = write_lattice(pathlib.Path(folder) / "masses.h5", places, mass, **net)
            energies.append(run(checks.program, {"bs_task": "statics", "bs_lattice_file": path, "bs_group_tip": "ids:5", "bs_load_steps": 2,
                                                 "bs_motion_tip": f"x=velocity:{pull[0]},y=velocity:{pull[1]}"}, interval=0).trajectory.observables["elastic_energy"].ravel())
        checks.near(f"equilibria of net {seed} with other masses", energies[1], energies[0], 1e-9)


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        ranks_agree(checks, folder)
        momentum(checks, folder)
        frames(checks, folder)
        rigid_motion(checks, folder)
        units(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
