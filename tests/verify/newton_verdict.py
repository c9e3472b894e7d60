#!/usr/bin/env python3
"""When Newton may say that it has converged: not for a step of nothing, not for the heaviest or stiffest part alone, and not before
the residual has ceased to fall at rounding level."""
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import numpy as np
from harness import Checks, write_lattice

NET = {"bs_lattice_type": "cubic", "bs_lattice_size": (5, 5, 5), "bs_lattice_perturbation": 0.1, "ts_max_steps": 20, "ts_dt": 0.01, "bs_energy_growth": 0}


def steps_of_nothing(checks):
    """Linear solvers that do nothing: the right answer, or an honest failure (exit code 3)."""
    truth = checks.run(NET).report["last_total_energy"][0]
    for label, options in (("ilu, absolute tolerance 1e10", {"ksp_type": "gmres", "pc_type": "ilu", "ksp_atol": 1e10}),
                           ("lmvm", {"pc_type": "lmvm", "ksp_rtol": 1e-5})):
        r = checks.run({**NET, "ts_max_reject": 0, **options}, expect=None)  # no step is cut, after which as many steps would end at another time
        wrong = abs(r.report["last_total_energy"][0] / truth - 1)
        checks.true(f"{label}: right, or not ok", r.report["outcome"] == "failed" or wrong < 1e-4, f"{r.report['outcome']}, energy off by {wrong:.2g}")
    asked = checks.run({**NET, "ksp_type": "gmres", "pc_type": "ilu", "ksp_rtol": 1}, expect=2)
    checks.true("relative tolerance 1: refused", "option -ksp_rtol: 1: give a number >= 0 and below 1" in asked.stderr, asked.stderr)


def net(n=6):
    """A plane net whose sides are stretched, at rest."""
    grid = np.array([[i, j] for i in range(n) for j in range(n)], dtype=float)
    pairs = [[i * n + j, (i + a) * n + j + b] for i in range(n) for j in range(n) for a, b in ((1, 0), (0, 1)) if i + a < n and j + b < n]
    return 1.1 * grid, pairs


def beside(checks):
    """The light net moves as if nothing else were there."""
    x, pairs = net()
    n, m = len(x), len(pairs)
    held = [i % 6 == 5 for i in range(n)]  # it hangs by its upper side
    other = {"heavy particle": ([[50.0, 0.0]], [1e12], [], [[3.0, 4.0]], []), "stiff pair": ([[50.0, 0.0], [51.001, 0.0]], [1.0, 1.0], [[n, n + 1]], [[0.0, 0.0]] * 2, [1e14])}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        options = {"bs_gravity": (0, -9.81), "ts_dt": 0.25, "ts_max_time": 0.5, "bs_energy_growth": 0}
        alone = write_lattice(folder / "net.h5", x, 0.1, fixed=held, pairs=pairs, stiffness=200.0, rest_length=1.0, spring_law="hooke")
        truth = checks.run({**options, "bs_lattice_file": alone, "snes_rtol": 1e-12}, interval=0.5).trajectory.velocity[-1]
        for name, (place, mass, more, speed, stiff) in other.items():
            file = write_lattice(folder / "both.h5", np.vstack([x, place]), np.concatenate([np.full(n, 0.1), mass]), velocity=np.vstack([np.zeros((n, 2)), speed]), fixed=held + [False] * len(mass),
                                 pairs=pairs + more, stiffness=np.concatenate([np.full(m, 200.0), stiff]), rest_length=1.0, spring_law="hooke")
            for ranks in (1, 2):
                r = checks.run({**options, "bs_lattice_file": file}, ranks=ranks, interval=0.5)
                off = np.abs(r.trajectory.velocity[-1][:n] - truth).max() / np.abs(truth).max()
                checks.below(f"net beside a {name}, {ranks} rank(s)", off, 1e-5, f"{r.report['newton']} Newton iterations")


def rounding_level(checks):
    """Implicit midpoint on a stiff net: what a tighter tolerance would add is gone by default, too."""
    x, pairs = net(8)
    with tempfile.TemporaryDirectory() as folder:
        file = write_lattice(pathlib.Path(folder) / "l.h5", 1 + x, 0.1, pairs=pairs, stiffness=1e7, rest_length=1.05, spring_law="hooke")
        options = {"bs_lattice_file": file, "ts_type": "theta", "ts_theta_theta": 0.5, "ts_adapt_type": "none", "ts_dt": 1e-3, "ts_max_time": 0.01, "bs_energy_growth": 0}
        loose, tight, tightest = (checks.run({**options, "snes_rtol": rtol}, interval=0.01) for rtol in (1e-8, 1e-13, 1e-15))
        v = tight.trajectory.velocity[-1]
        checks.below("stiff net, implicit midpoint", np.abs(loose.trajectory.velocity[-1] - v).max() / np.abs(v).max(), 1e-10, f"{loose.report['newton']} and {tight.report['newton']} Newton iterations")
        checks.true("what ended at rounding level is counted", tightest.report.get("newton_at_floor", 0) > 0, "rtol 1e-15 is out of reach")


def at_rest(checks):
    """A particle that rests on its spring: residuals are rounding errors from the start, of which one iteration may make greater ones; no step is rejected for that."""
    with tempfile.TemporaryDirectory() as folder:
        file = write_lattice(pathlib.Path(folder) / "rest.h5", [[0.0], [1.0]], 0.5, fixed=[1, 0], pairs=[[0, 1]], stiffness=70.0, rest_length=1.0)
        options = {"bs_lattice_file": file, "bs_group_mass": "ids:1", "bs_force_mass": "expression:step(t-0.3)", "ts_adapt_type": "none", "ts_max_time": 0.35}
        for kind in ("bdf", "cn", "arkimex"):
            for h in (2.5e-3, 1e-4):
                r = checks.run({**options, "ts_type": kind, "ts_dt": h}).report
                checks.true(f"{kind}, h = {h:g} s", r["rejected"] == 0 and not r["warnings"] and r["steps"] == round(0.35 / h), f"{r['rejected']} rejected, {r['steps']} steps, {r['warnings']}")


def in_flight(checks):
    """Strong dampers and drag where everything moves: a net that flies moves as the same net at rest does, and takes no more steps. What dampers exert is the
    difference of forces 1e11 times as large as that which a body's inertia resists."""
    u, T = np.array([1.0, 2.0, -1.0]), 0.5
    base = {"bs_lattice_type": "cubic", "bs_lattice_size": (3, 3, 3), "bs_lattice_particle_mass": 1e-6, "bs_lattice_stiffness": 1, "bs_lattice_perturbation": 0.1, "ts_dt": 0.1, "ts_max_time": T}
    kinds = {"beuler": {}, "bdf": {"ts_type": "bdf", "ts_adapt_type": "none"}, "alpha2": {"ts_type": "alpha2"}, "rosw": {"ts_type": "rosw", "ts_adapt_type": "none"},
             "simple dampers": {"bs_damping_law": "simple"}, "lu": {"pc_type": "lu"}, "incomplete factors": {"condensed_pc_type": "bicc", "condensed_ksp_type": "cg"},
             "far from the origin": {"bs_lattice_origin": (1e4, 0, 0)}}
    for name, options in kinds.items():
        for ranks in (1, 3) if name in ("beuler", "simple dampers") else (1,):
            for D in (1e5, 1e8):
                o = {**base, **options, "bs_lattice_damping": D}
                still, flying = (checks.run({**o, "bs_lattice_velocity": tuple(v)}, ranks=ranks, interval=T) for v in (0 * u, u))
                off = max(np.abs(flying.trajectory.position[-1] - flying.trajectory.position[0] - (still.trajectory.position[-1] - still.trajectory.position[0]) - u * T).max(),
                          np.abs(flying.trajectory.velocity[-1] - still.trajectory.velocity[-1] - u).max())
                checks.below(f"{name}, D = {D:g} kg/s, {ranks} rank(s): as at rest", off, 1e-7, f"{flying.report['newton']} and {still.report['newton']} Newton iterations")
                checks.true("in as many steps, none of them rejected", flying.report["rejected"] == 0 and flying.report["steps"] <= still.report["steps"], f"{flying.report['steps']}, {flying.report['rejected']} rejected")
    for a in (1e-8, 1e-10):
        sphere = {"bs_lattice_type": "chain", "bs_lattice_size": 1, "bs_lattice_dim": 1, "bs_lattice_particle_mass": 2000 * 4 / 3 * np.pi * a**3, "bs_radius": a, "bs_sphere_drag": True,
                  "bs_sphere_drag_rho": 1000, "bs_sphere_drag_mu": 1e-3, "bs_gravity": -9.81, "bs_fluid_velocity": 0.3, "ts_dt": 0.01, "ts_max_time": 0.1}
        r = checks.run(sphere, interval=0.1)
        checks.true(f"a sphere of {a:g} m in water that flows: 10 steps", r.report["steps"] == 10 and r.report["rejected"] == 0, f"{r.report['steps']}")
        slip = sphere["bs_lattice_particle_mass"] * 9.81 / (6 * np.pi * 1e-3 * a)  # Stokes
        checks.below("it flows along and sinks by Stokes' law", abs(r.trajectory.velocity[-1, 0, 0] - 0.3 + slip), 1e-13)


def main():
    checks = Checks(__doc__)
    for part in (steps_of_nothing, beside, rounding_level, at_rest, in_flight):
        if checks.wants(part.__name__):
            with checks.group(part.__name__):
                part(checks)
    checks.finish()


if __name__ == "__main__":
    main()
