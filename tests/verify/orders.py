#!/usr/bin/env python3
"""Observed order of every time-stepping method on a damped nonlinear system with unequal masses, none equal to 1:
springs with axial dampers, sphere drag, springs to points that oscillate as given. The reference is SciPy's DOP853."""
import pathlib
import tempfile

from harness import Checks, direct, observed_orders
import numpy as np
from particles import System
from scipy.integrate import solve_ivp

T = 0.4
RHO, MU = 1.3, 0.02
AMPLITUDE, FREQUENCY, PHASE = np.array([0.08, -0.05]), 1.3, 0.4
RADIUS = np.array([0.05, 0.08, 0.04, 0.06, 0.07])
IMPLICIT = ("beuler", "cn", "theta", "bdf", "alpha2", "arkimex", "rosw")

# name, options, order, band, numbers of steps. Higher orders need larger steps to stay above rounding.
TYPES = [
    ("beuler", {"ts_type": "beuler"}, 1, 0.15, (200, 400, 800)),
    ("cn", {"ts_type": "cn"}, 2, 0.15, (50, 100, 200)),
    ("theta midpoint", {"ts_type": "theta", "ts_theta_theta": 0.5, "ts_theta_endpoint": 0}, 2, 0.15, (50, 100, 200)),
    ("bdf 1", {"ts_type": "bdf", "ts_bdf_order": 1}, 1, 0.15, (200, 400, 800)),
    ("bdf 2", {"ts_type": "bdf", "ts_bdf_order": 2}, 2, 0.15, (100, 200, 400)),
    ("bdf 3", {"ts_type": "bdf", "ts_bdf_order": 3}, 3, 0.15, (100, 200, 400)),
    ("bdf 4", {"ts_type": "bdf", "ts_bdf_order": 4}, 4, 0.25, (80, 160, 320)),
    ("bdf 5", {"ts_type": "bdf", "ts_bdf_order": 5}, 5, 0.25, (160, 320, 640)),
    ("bdf 6", {"ts_type": "bdf", "ts_bdf_order": 6}, 6, 0.25, (40, 80, 160)),
    ("alpha2", {"ts_type": "alpha2"}, 2, 0.15, (50, 100, 200)),
    ("alpha2, radius 0.5", {"ts_type": "alpha2", "ts_alpha_radius": 0.5}, 2, 0.15, (50, 100, 200)),
    ("alpha2, radius 0", {"ts_type": "alpha2", "ts_alpha_radius": 0}, 2, 0.15, (100, 200, 400)),
    ("arkimex 3", {"ts_type": "arkimex"}, 3, 0.25, (40, 80, 160)),
    ("arkimex 2e", {"ts_type": "arkimex", "ts_arkimex_type": "2e"}, 2, 0.15, (50, 100, 200)),
    ("arkimex 4", {"ts_type": "arkimex", "ts_arkimex_type": "4"}, 4, 0.25, (40, 80, 160)),
    ("rosw ra34pw2", {"ts_type": "rosw", "ts_rosw_type": "ra34pw2"}, 3, 0.25, (40, 80, 160)),
    ("euler", {"ts_type": "euler"}, 1, 0.15, (200, 400, 800)),
    ("symplectic", {"ts_type": "symplectic"}, 1, 0.15, (200, 400, 800)),
    ("verlet", {"ts_type": "verlet"}, 2, 0.15, (100, 200, 400)),
    ("rk 2b", {"ts_type": "rk", "ts_rk_type": "2b"}, 2, 0.15, (50, 100, 200)),
    ("rk 4", {"ts_type": "rk", "ts_rk_type": "4"}, 4, 0.25, (40, 80, 160)),
    ("rk 5dp", {"ts_type": "rk", "ts_rk_type": "5dp"}, 5, 0.25, (80, 160, 320)),
    ("ssp", {"ts_type": "ssp"}, 2, 0.15, (50, 100, 200)),
    ("ssp rks3", {"ts_type": "ssp", "ts_ssp_type": "rks3", "ts_ssp_nstages": 4}, 3, 0.25, (40, 80, 160)),
    ("ssp rk104", {"ts_type": "ssp", "ts_ssp_type": "rk104"}, 4, 0.25, (40, 80, 160)),
]


def system():
    """Five masses in the plane, seven springs, two springs to driven points. All fly fast through the gas, so that the
    drag is smooth on the way (its sqrt(Re) is not at rest)."""
    x = np.array([[0.0, 0.0], [0.5, 0.1], [0.9, -0.2], [0.4, 0.6], [-0.3, 0.5]])
    v = np.array([[2.0, 1.0], [2.2, 0.6], [1.7, 1.3], [2.1, 1.1], [1.8, 0.7]])
    pairs = np.array([[0, 1], [1, 2], [2, 3], [3, 0], [3, 4], [4, 0], [1, 3]])
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * np.array([1.1, 0.9, 1.0, 1.2, 0.85, 0.95, 1.05])
    anchors = {"particle": np.array([1, 4]), "point": np.array([[0.2, -1.0], [-1.2, 0.9]]), "stiffness": np.array([9.0, 14.0]),
               "rest_length": np.array([0.8, 1.1]), "damping": np.array([0.3, 0.2])}
    s = System(x, v, [0.3, 0.7, 1.9, 0.45, 2.3], None, pairs, [30.0, 45.0, 25.0, 60.0, 35.0, 40.0, 20.0], rest,
               [0.4, 0.2, 0.6, 0.3, 0.5, 0.1, 0.35], anchors, gravity=[0.3, -9.8])
    s.extra_force, s.motion = sphere_drag, motion
    return s


def motion(t):
    """Displacement and velocity of the points that springs are tied to."""
    w = 2 * np.pi * FREQUENCY
    return AMPLITUDE * np.sin(w * t + PHASE), AMPLITUDE * w * np.cos(w * t + PHASE)


def sphere_drag(x, v):
    """Spheres in a gas at rest: Stokes' drag and rho pi a^2 |v| v (6/(1 + sqrt(Re)) + 0.4)/2."""
    speed = np.linalg.norm(v, axis=1)
    reynolds = 2 * RADIUS * RHO * speed / MU
    c = 6 * np.pi * MU * RADIUS + RHO * np.pi * RADIUS ** 2 * speed * (6 / (1 + np.sqrt(reynolds)) + 0.4) / 2
    return -c[:, None] * v


def main():
    checks = Checks("observed orders of the time-stepping methods")
    s = system()
    reference = solve_ivp(s.rhs, (0, T), s.state(), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    x_ref, v_ref = reference.reshape(2, s.n, s.dim)
    with tempfile.TemporaryDirectory() as scratch:
        lattice = s.write(pathlib.Path(scratch) / "orders.h5", radius=RADIUS)
        base = {**s.options(lattice), "bs_sphere_drag": True, "bs_sphere_drag_rho": RHO, "bs_sphere_drag_mu": MU,
                "bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": AMPLITUDE, "bs_anchor_frequency": FREQUENCY,
                "bs_anchor_phase": PHASE, "ts_adapt_type": "none"}
        for name, options, order, band, counts in TYPES:
            if not checks.wants(name):
                continue
            newton = direct(checks.ranks) if options["ts_type"] in IMPLICIT else {}
            with checks.group(name):
                errors = []
                for n in counts:
                    r = checks.run({**base, **newton, **options, "ts_dt": T / n, "ts_max_time": T}, interval=T).trajectory
                    errors.append(max(np.abs(r.position[-1] - x_ref).max() / np.abs(x_ref).max(),
                                      np.abs(r.velocity[-1] - v_ref).max() / np.abs(v_ref).max()))
                orders = observed_orders([T / n for n in counts], errors)
                checks.true(f"{name} order {order}", bool(abs(orders[-1] - order) <= band), "observed "
                            + ", ".join(f"{q:.3f}" for q in orders) + f" (+-{band}), error {errors[-1]:.2g}")
    checks.finish()


if __name__ == "__main__":
    main()
