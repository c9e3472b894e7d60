#!/usr/bin/env python3
"""Groups that are driven, held in part or fixed: places exact at every frame, orders of the methods against closed forms, Jacobians, rollers
against SciPy, reactions against momentum and weight, work against energy, restarts."""
import pathlib
import subprocess
import tempfile

import h5py
from harness import Checks, direct, observed_orders, write_lattice
import numpy as np
from program import environment, words
from scipy.integrate import solve_ivp

T = 1.2
MASS, STIFFNESS, DAMPING, OMEGA = 0.7, 40.0, 0.6, 3.0
IMPLICIT = ("beuler", "cn", "theta", "bdf", "alpha2", "arkimex", "rosw")

# name, options, order, band, numbers of steps
TYPES = [
    ("beuler", {"ts_type": "beuler"}, 1, 0.15, (400, 800)),
    ("cn", {"ts_type": "cn"}, 2, 0.15, (50, 100)),
    ("theta midpoint", {"ts_type": "theta", "ts_theta_theta": 0.5, "ts_theta_endpoint": 0}, 2, 0.15, (50, 100)),
    ("bdf 2", {"ts_type": "bdf", "ts_bdf_order": 2}, 2, 0.15, (200, 400)),
    ("bdf 4", {"ts_type": "bdf", "ts_bdf_order": 4}, 4, 0.35, (160, 320)),
    ("alpha2", {"ts_type": "alpha2"}, 2, 0.15, (100, 200)),
    ("arkimex 3", {"ts_type": "arkimex"}, 3, 0.25, (80, 160)),
    ("rosw ra34pw2", {"ts_type": "rosw", "ts_rosw_type": "ra34pw2"}, 3, 0.25, (80, 160)),
    ("euler", {"ts_type": "euler"}, 1, 0.15, (1600, 3200)),
    ("symplectic", {"ts_type": "symplectic"}, 1, 0.2, (800, 1600)),
    ("verlet", {"ts_type": "verlet"}, 2, 0.2, (200, 400)),
    ("rk 4", {"ts_type": "rk", "ts_rk_type": "4"}, 4, 0.25, (80, 160)),
    ("ssp", {"ts_type": "ssp"}, 2, 0.15, (200, 400)),
]
CHAIN = {"bs_lattice_type": "chain", "bs_lattice_size": 2, "bs_lattice_particle_mass": MASS, "bs_lattice_stiffness": STIFFNESS,
         "bs_group_end": "xmax", "ts_adapt_type": "none"}


def solver(checks, options):
    return direct(checks.ranks) if options["ts_type"] in IMPLICIT else {}


def damped_forced(t):
    """Place and velocity of a mass tied by a spring of no rest length and a damper to a point that turns about the origin, in the complex
    plane: m z'' = k (Z - z) + c (Z' - z'), Z = exp(i w t), from rest at 0."""
    m, k, c, w = MASS, STIFFNESS, DAMPING, OMEGA
    p = (k + 1j * c * w) / (k + 1j * c * w - m * w * w)
    roots = np.roots([m, c, k]).astype(complex)
    a = np.linalg.solve([[1, 1], roots], [-p, -1j * w * p])
    z = a @ np.exp(roots * t) + p * np.exp(1j * w * t)
    v = a @ (roots * np.exp(roots * t)) + 1j * w * p * np.exp(1j * w * t)
    return np.array([z.real, z.imag]), np.array([v.real, v.imag])


def turning_end(checks):
    """Orders in a problem whose drive has a velocity that matters, and exact places of the driven end."""
    x_ref, v_ref = damped_forced(T)
    base = {**CHAIN, "bs_lattice_dim": 2, "bs_lattice_rest_length_factor": 0, "bs_lattice_damping": DAMPING, "bs_damping_law": "simple",
            "bs_motion_end": f"rotation:{OMEGA},0,0"}
    for name, options, order, band, counts in TYPES:
        if not checks.wants(name):
            continue
        with checks.group(name):
            errors = []
            for n in counts:
                r = checks.run({**base, **solver(checks, options), **options, "ts_dt": T / n, "ts_max_time": T}, interval=T / 4).trajectory
                errors.append(max(np.abs(r.position[-1, 0] - x_ref).max(), np.abs(r.velocity[-1, 0] - v_ref).max() / OMEGA))
            order_seen = observed_orders([T / n for n in counts], errors)[-1]
            checks.true(f"{name} order {order}", abs(order_seen - order) <= band, f"observed {order_seen:.3f} (+-{band}), error {errors[-1]:.2g}")
            angle = OMEGA * r.time
            exact = np.stack([np.cos(angle), np.sin(angle)], axis=1)
            turned = np.stack([-np.sin(angle), np.cos(angle)], axis=1) * OMEGA
            checks.near(f"{name} driven place", r.position[:, 1], exact, 4e-16)
            checks.near(f"{name} driven velocity", r.velocity[:, 1], turned, 2e-15)


def same_motions(checks):
    """One motion said in several ways; a table against its constant velocity."""
    base = {**CHAIN, "bs_lattice_dim": 1, "ts_type": "cn", "ts_dt": T / 60, "ts_max_time": T, **direct(checks.ranks)}
    sine = checks.run({**base, "bs_motion_end": "x=sinusoid:0.1,0.5,0.3"}, interval=T / 3).trajectory
    text = checks.run({**base, "bs_motion_end": "x=expression:0.1*sin(2*pi*0.5*t+0.3)"}, interval=T / 3).trajectory
    checks.near("expression and sinusoid", text.position, sine.position, 1e-14)
    checks.near("velocity of an expression", text.velocity, sine.velocity, 1e-13)
    checks.near("reaction with an expression", text.observables["reaction/end"], sine.observables["reaction/end"], 1e-12)
    with tempfile.TemporaryDirectory() as scratch:
        path = pathlib.Path(scratch) / "motion.csv"
        path.write_text("t,x\n0,0\n0.5,0.1\n2,0.4\n")
        table = checks.run({**base, "bs_motion_end": f"table:{path}"}, interval=T / 3).trajectory
    line = checks.run({**base, "bs_motion_end": "velocity:0.2"}, interval=T / 3).trajectory
    checks.near("table and velocity", table.position, line.position, 1e-14)
    place = checks.run({**base, "bs_group_all": "all", "bs_group_end": "ids:1", "bs_motion_all": "x=expression:0.1*x0*t"}, interval=T / 3).trajectory
    checks.near("expression of the place", place.position[:, :, 0], np.array([[0, 1 + 0.1 * t] for t in place.time]), 1e-15)


def fixed_groups(checks):
    """-bs_lattice_fixed_groups fixes what -bs_lattice_fixed and a file's column do, to the bit: generated and disordered, and from a file."""
    base = {"bs_gravity": (0, -2), "ts_type": "verlet", "ts_dt": 0.01, "ts_max_time": 0.5}
    lattice = {**base, "bs_lattice_type": "triangular", "bs_lattice_size": "7,5", "bs_lattice_perturbation": 0.1, "bs_lattice_velocity": (0.3, 0.1)}
    by_face = checks.run({**lattice, "bs_lattice_fixed": "xmin,ymax"}, interval=0.5).trajectory
    by_group = checks.run({**lattice, "bs_group_a": "xmin", "bs_group_b": "ymax", "bs_group_c": "xmax", "bs_lattice_fixed_groups": "a,b"}, interval=0.5).trajectory
    checks.near("fixed groups and faces", by_group.position, by_face.position, 0)
    x, pairs, k, rest, m = net()
    with tempfile.TemporaryDirectory() as scratch:
        path = pathlib.Path(scratch) / "net.h5"
        write_lattice(path, x, m, velocity=0 * x + 0.1, fixed=np.arange(16) % 4 == 0, pairs=pairs, stiffness=k, rest_length=rest)
        by_column = checks.run({**base, "bs_lattice_file": path}, interval=0.5).trajectory
        with h5py.File(path, "r+") as f:
            f["groups/left"] = np.arange(0, 16, 4)
            f["particles/fixed"][...] = 0
        by_group = checks.run({**base, "bs_lattice_file": path, "bs_lattice_fixed_groups": "left"}, interval=0.5).trajectory
    checks.near("fixed groups and a column of a file", by_group.position, by_column.position, 0)
    checks.true("the rest moves", np.abs(by_group.position[-1] - by_group.position[0]).max() > 0.05)


def net():
    """A triangulated net in the plane with unequal springs and masses."""
    rng = np.random.default_rng(5)
    x = np.array([[i, j] for j in range(4) for i in range(4)], float)
    pairs = [(a, b) for a in range(16) for b in range(a + 1, 16) if np.abs(x[a] - x[b]).max() < 1.5 and (x[b] - x[a])[0] * (x[b] - x[a])[1] >= 0]
    x += 0.1 * rng.standard_normal(x.shape) * ((x[:, :1] > 0) & (x[:, :1] < 3))
    pairs = np.array(pairs)
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * 0.97
    return x, pairs, 50 + 100 * rng.random(len(pairs)), rest, 0.5 + rng.random(16)


def rolling_net(checks):
    """Left edge on rollers along y, right edge pulled along x and free along y, one corner fixed: against SciPy."""
    x, pairs, k, rest, m = net()
    left, right = np.flatnonzero(np.abs(x[:, 0]) < 1e-9), np.flatnonzero(np.abs(x[:, 0] - 3) < 1e-9)
    speed = 0.3

    def acceleration(t, y):
        p, v = y.reshape(2, 16, 2)
        p, v = p.copy(), v.copy()
        p[left, 0], v[left, 0] = x[left, 0], 0
        p[right, 0], v[right, 0] = x[right, 0] + speed * t, speed
        p[0], v[0] = x[0], 0
        d = p[pairs[:, 0]] - p[pairs[:, 1]]
        length = np.linalg.norm(d, axis=1)
        pull = (k * (length - rest) / length)[:, None] * d
        f = np.zeros_like(p)
        np.add.at(f, pairs[:, 0], -pull)
        np.add.at(f, pairs[:, 1], pull)
        f[:, 1] -= 2.0 * m
        a = f / m[:, None]
        a[left, 0] = a[right, 0] = 0
        a[0] = 0
        v_free = v.copy()
        return np.concatenate([v_free.ravel(), a.ravel()])

    start = np.concatenate([x.ravel(), np.zeros(32)])
    start[32:].reshape(16, 2)[right, 0] = speed
    reference = solve_ivp(acceleration, (0, T), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1].reshape(2, 16, 2)
    with tempfile.TemporaryDirectory() as scratch:
        lattice = pathlib.Path(scratch) / "net.h5"
        write_lattice(lattice, x, m, pairs=pairs, stiffness=k, rest_length=rest, spring_law="hooke")
        with h5py.File(lattice, "r+") as f:
            f["groups/left"], f["groups/right"], f["groups/corner"] = left, right, [0]
        base = {"bs_lattice_file": lattice, "bs_gravity": (0, -2), "bs_motion_left": "x=fixed", "bs_motion_right": f"x=velocity:{speed},y=free",
                "bs_motion_corner": "y=fixed", "ts_adapt_type": "none", "ts_max_time": T}
        for name, options in (("rk 4", {"ts_type": "rk", "ts_rk_type": "4", "ts_dt": T / 400}),
                              ("bdf 4", {"ts_type": "bdf", "ts_bdf_order": 4, "ts_dt": T / 1600, **direct(checks.ranks)}),
                              ("rosw 3", {"ts_type": "rosw", "ts_dt": T / 800, **direct(checks.ranks)})):
            with checks.group(name):
                r = checks.run({**base, **options}, interval=T).trajectory
                checks.near(f"rollers by {name}: places", r.position[-1], reference[0], 2e-6)
                checks.near(f"rollers by {name}: velocities", r.velocity[-1], reference[1], 2e-5)
                checks.true(f"rollers by {name}: held exactly", bool(np.all(r.position[-1, left, 0] == x[left, 0])))
        results = {}
        for name, options in (("direct", direct(checks.ranks)), ("springs, bicc", {"condensed_ksp_type": "cg", "condensed_pc_type": "bicc", "condensed_mat_type": "springs", "condensed_ksp_rtol": 1e-12}),
                              ("sbaij", {"condensed_ksp_type": "cg", "condensed_pc_type": "jacobi", "condensed_mat_type": "sbaij", "condensed_ksp_rtol": 1e-12}),
                              ("aij, gamg", {"condensed_ksp_type": "cg", "condensed_pc_type": "gamg", "condensed_mat_type": "aij", "condensed_ksp_rtol": 1e-12})):
            with checks.group(name):
                r = checks.run({**base, "ts_type": "cn", "ts_dt": 0.02, "snes_rtol": 1e-11, **options}, interval=T)
                results[name] = r.trajectory.position[-1]
                if name != "direct":
                    checks.near(f"rollers, {name}", results[name], results["direct"], 1e-8)
        jacobian(checks, "rollers", {**base, "ts_type": "cn", "ts_dt": 0.02})
        r = checks.run({**base, "ts_type": "cn", "ts_dt": 0.002, **direct(checks.ranks)}, interval=0.002).trajectory
        o = r.observables
        change = np.diff(o["momentum"], axis=0)
        total = o["reaction/left"] + o["reaction/right"]  # the corner belongs to the left
        pushed = 0.002 * (0.5 * (total[1:] + total[:-1]) + np.array([0, -2.0 * m.sum()]))
        checks.near("momentum and reactions", change, pushed, 1e-9)
        checks.below("energy and work", np.abs(o["total_energy"] - o["total_energy"][0] - o["work/right"]).max() / np.abs(o["work/right"]).max(), 3e-4)


def coarse_grid(checks):
    """A cube with a face on rollers: the coarse grid changes the iterations, not the result."""
    base = {"bs_lattice_type": "cubic", "bs_lattice_size": (12, 12, 12), "bs_lattice_neighbors": 18, "bs_lattice_spacing": 0.1, "bs_lattice_total_mass": 20,
            "bs_lattice_stiffness": 400, "bs_spring_law": "strain", "bs_lattice_velocity_gradient": (0, 0, 1, 0, 0, 0, 0, 0, 0), "bs_gravity": (0, 0, -9.81),
            "bs_group_floor": "zmin", "bs_motion_floor": "x=free,y=free,z=fixed", "ts_dt": 0.2, "ts_max_time": 0.4, "snes_rtol": 1e-11,
            "condensed_ksp_type": "cg", "condensed_pc_type": "bicc", "condensed_mat_type": "springs", "condensed_ksp_rtol": 1e-10}
    without, with_it = (checks.run({**base, "condensed_pc_bicc_coarse": unknowns}, interval=0.4) for unknowns in (0, 200))
    checks.near("rollers and a coarse grid", with_it.trajectory.position[-1], without.trajectory.position[-1], 1e-8)
    checks.true("rollers and a coarse grid: fewer iterations", 1.5 * with_it.report["krylov"] < without.report["krylov"],
                f"{with_it.report['krylov']}, without {without.report['krylov']}")


def jacobian(checks, name, options):
    r = checks.run({**options, "ts_max_steps": 1, "snes_test_jacobian": True, "pc_type": "none", "ksp_type": "gmres", "ksp_max_it": 500, "bs_operator": "assembled"})
    ratios = [float(line.split("||J - Jfd||_F/||J||_F =")[1].split(",")[0]) for line in r.stdout.splitlines() if "||J - Jfd||_F/||J||_F =" in line]
    checks.true(f"{name}: Jacobian", bool(ratios) and max(ratios) < 1e-6, f"against differences {max(ratios, default=np.nan):.2g}")


def chain_in_balance(checks):
    """Linear springs by the trapezoidal rule: what the driven end does is what the energy gains, to rounding."""
    base = {"bs_lattice_type": "chain", "bs_lattice_size": 9, "bs_lattice_dim": 1, "bs_lattice_stiffness": 100, "ts_type": "cn", "ts_dt": 0.01, "ts_max_time": 2,
            "ts_adapt_type": "none", "bs_group_left": "xmin", "bs_group_right": "xmax", "bs_motion_left": "fixed", "bs_motion_right": "x=sinusoid:0.1,0.5",
            **direct(checks.ranks)}
    o = checks.run(base, interval=0.01).trajectory.observables
    checks.below("energy gained and work", np.abs(o["total_energy"] - o["total_energy"][0] - o["work/right"]).max() / np.abs(o["work/right"]).max(), 1e-12)
    jacobian(checks, "driven chain", base)
    anchored = checks.run({**base, "bs_motion_right": None, "bs_anchor_particles": 4, "bs_anchor_stiffness": 30, "bs_anchor_motion": "sinusoid",
                           "bs_anchor_amplitude": 0.2, "bs_anchor_frequency": 0.7}, interval=0.01).trajectory.observables
    checks.below("energy gained and work of an anchor", np.abs(anchored["total_energy"] - anchored["total_energy"][0] - anchored["work/anchors"]).max()
                 / np.abs(anchored["work/anchors"]).max(), 1e-12)
    hung = checks.run({**base, "bs_lattice_dim": 2, "bs_motion_right": None, "bs_group_right": None, "bs_lattice_size": 3, "bs_lattice_damping": 40,
                       "bs_gravity": (9.81, 0), "ts_type": "beuler", "ts_dt": 0.05, "ts_max_time": 20}, interval=20).trajectory.observables
    checks.near("support of a hanging chain carries its weight", hung["reaction/left"][-1], [-3 * 9.81, 0], 1e-6)


def inertia(checks):
    """What moves a driven group bears its inertia: particles that no spring holds, on a sinusoid, at a growing speed and in a circle."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_lattice(pathlib.Path(folder) / "two.h5", [[0.0, 0.0], [1.0, 0.5], [3.0, 0.0]], [2.0, 0.5, 1.0], pairs=[[1, 2]], stiffness=0.0, rest_length=1.0)
        base = {"bs_lattice_file": path, "bs_group_g": "ids:0,1", "ts_dt": 0.05, "ts_max_time": 1, "ts_adapt_type": "none"}
        w = np.pi
        for motion, force in (("x=sinusoid:1,0.5,y=fixed", lambda t: np.stack([-2.5 * w**2 * np.sin(w * t), 0 * t], 1)),
                              ("x=expression:0.5*t^2,y=expression:t^3", lambda t: np.stack([2.5 + 0 * t, 15 * t], 1)),
                              (f"rotation:{w},0,0", lambda t: -0.5 * w**2 * np.stack([np.cos(w * t) - 0.5 * np.sin(w * t), np.sin(w * t) + 0.5 * np.cos(w * t)], 1))):
            for kind in ("beuler", "cn", "alpha2", "verlet"):
                r = checks.run({**base, "bs_motion_g": motion, "ts_type": kind, **solver(checks, {"ts_type": kind})}, interval=0.05).trajectory
                checks.near(f"{motion}, {kind}: reaction is mass times acceleration", r.observables["reaction/g"], force(np.asarray(r.time)), 1e-9)


def at_rest_with_dampers(checks):
    """Equilibria under a driven group do not know of dampers: it stands where its motion is, without the velocity."""
    base = {"bs_task": "statics", "bs_lattice_type": "triangular", "bs_lattice_size": "5,5", "bs_lattice_stiffness": 3, "bs_load_steps": 4, "bs_group_l": "xmin",
            "bs_group_r": "xmax", "bs_motion_l": "fixed", "bs_motion_r": "x=velocity:0.5,y=fixed"}
    without = checks.run(base, interval=0).trajectory
    for law in ("axial", "simple"):
        r = checks.run({**base, "bs_lattice_damping": 0.5, "bs_damping_law": law}, interval=0).trajectory
        checks.near(f"{law} dampers: positions", r.position[-1], without.position[-1], 1e-11)
        for name in ("reaction/l", "reaction/r", "elastic_energy"):
            checks.near(f"{law} dampers: {name}", r.observables[name], without.observables[name], 1e-11)
        checks.near(f"{law} dampers: nothing moves", r.observables["kinetic_energy"], 0 * np.asarray(r.time), 0)


def continued(checks):
    """Stopped and continued, in every bit, work included."""
    base = {"bs_lattice_type": "square", "bs_lattice_size": 6, "bs_lattice_dim": 2, "bs_lattice_stiffness": 100, "ts_dt": 0.02, "bs_group_left": "xmin",
            "bs_group_right": "xmax", "bs_group_top": "ids:33", "bs_motion_left": "fixed", "bs_motion_right": "x=sinusoid:0.1,0.5,y=free",
            "bs_motion_top": "x=expression:0.1*sin(t)", "bs_output": "r.h5md", "bs_overwrite": True, "ts_adapt_type": "none",
            "condensed_pc_type": "bicc"}  # MUMPS on several ranks does not repeat its last digits
    for kind in ("cn", "bdf", "alpha2", "verlet"):
        with tempfile.TemporaryDirectory() as whole, tempfile.TemporaryDirectory() as parts:
            mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []

            def go(folder, *more):
                subprocess.run([*mpi, checks.program, *more], cwd=folder, env=environment(checks.ranks), check=True, capture_output=True)
            start = words({**base, "ts_type": kind, "bs_checkpoint": "c", "bs_checkpoint_every": 7})
            go(whole, *start, "-ts_max_time", "0.6")
            go(parts, *start, "-ts_max_time", "0.6", "-ts_max_steps", "14")
            go(parts, "-bs_restart", "c", "-ts_max_steps", "1000")
            same = True
            with h5py.File(pathlib.Path(whole) / "r.h5md") as a, h5py.File(pathlib.Path(parts) / "r.h5md") as b:
                for path in ("particles/trajectory/position", "particles/trajectory/velocity", "observables/work/right", "observables/work/top",
                             "observables/reaction/left"):
                    same = same and np.array_equal(a[path + "/value"][...], b[path + "/value"][...])
            checks.true(f"{kind} continued in every bit", same)


def ranks_agree(checks):
    base = {"bs_lattice_type": "triangular", "bs_lattice_size": "9,7", "bs_lattice_stiffness": 100, "ts_dt": 0.02, "ts_max_time": 0.4, "bs_group_left": "xmin",
            "bs_group_right": "xmax", "bs_motion_left": "x=fixed", "bs_motion_right": "rotation:0.5,4,3", "ts_adapt_type": "none", "bs_group_one": "ids:20",
            "bs_motion_one": "y=expression:0.1*t^2"}
    for kind in ("verlet", "cn"):
        one = checks.run({**base, "ts_type": kind, "snes_rtol": 1e-12}, interval=0.1, ranks=1).trajectory
        more = checks.run({**base, "ts_type": kind, "snes_rtol": 1e-12}, interval=0.1, ranks=2 if checks.ranks == 1 else checks.ranks).trajectory
        for name, tolerance in (("position", 1e-10), ("velocity", 1e-9)):
            checks.near(f"{kind}, ranks, {name}", getattr(one, name), getattr(more, name), tolerance)
        for name in ("reaction/left", "reaction/right", "work/right", "work/one"):
            checks.near(f"{kind}, ranks, {name}", one.observables[name], more.observables[name], 1e-8)


def main():
    checks = Checks("driven, rolling and fixed groups")
    turning_end(checks)
    for name, part in (("motions", same_motions), ("fixed", fixed_groups), ("rollers", rolling_net), ("coarse grid", coarse_grid), ("balance", chain_in_balance), ("inertia", inertia), ("dampers in statics", at_rest_with_dampers), ("restart", continued), ("ranks", ranks_agree)):
        if checks.wants(name):
            with checks.group(name):
                part(checks)
    checks.finish()


if __name__ == "__main__":
    main()
