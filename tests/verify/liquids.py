#!/usr/bin/env python3
"""Spheres in liquids: buoyancy and added mass against closed forms (Stokes' limit, terminal velocity, a sphere on a spring) and SciPy's integration of the full law."""
import h5py
import numpy as np
from harness import run_parts, write_lattice
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

G, RHO, MU = 9.81, 1000.0, 1e-3
WATER = {"bs_buoyancy": True, "bs_added_mass": 0.5}
DRAG = {"bs_sphere_drag": True, "bs_sphere_drag_rho": RHO, "bs_sphere_drag_mu": MU}


def volume(a):
    return 4 / 3 * np.pi * np.asarray(a) ** 3


def drag(u, a):
    """1/2 rho pi a^2 C_D |u| u, C_D = 24/Re + 6/(1 + sqrt(Re)) + 0.4, of velocities (..., d)."""
    s = np.linalg.norm(u, axis=-1, keepdims=True)
    reynolds = 2 * a * RHO * s / MU
    return (6 * np.pi * MU * a + RHO * np.pi * a**2 / 2 * s * (6 / (1 + np.sqrt(reynolds)) + 0.4)) * u


def ball(density, a, **more):
    """One sphere in one dimension, the axis pointing down."""
    return {"bs_lattice_type": "chain", "bs_lattice_size": 1, "bs_lattice_dim": 1, "bs_lattice_particle_mass": float(density * volume(a)), "bs_radius": a, "bs_gravity": G, **more}


def stokes(checks, folder):
    """v = v_inf (1 - exp(-D t/(m + m_a))), v_inf = (m - rho V) g/D: of a sphere that sinks and of one that rises; and backward Euler's own solution, step by step."""
    a, T = 1e-4, 0.02
    D = 6 * np.pi * MU * a
    for density in (2500.0, 100.0):
        m, m_f = density * volume(a), RHO * volume(a)
        for name, options, weight, inertia in (("both", WATER, m - m_f, m + m_f / 2), ("buoyancy alone", {"bs_buoyancy": True}, m - m_f, m), ("added mass alone", {"bs_added_mass": 1.5}, m, m + 1.5 * m_f)):
            system = {**ball(density, a, bs_stokes_drag=D, bs_fluid_density=RHO), **options, "ts_max_time": T}
            run = checks.run({**system, "ts_type": "rk", "ts_rk_type": "4", "ts_dt": T / 2000, "ts_adapt_type": "none"}, interval=T / 10)
            t, v = run.trajectory.time, run.trajectory.velocity[:, 0, 0]
            end = weight * G / D
            checks.near(f"{density:g} kg/m^3, {name}: velocity", v, end * -np.expm1(-D * t / inertia), 1e-10 * abs(end))
            o = run.trajectory.observables
            checks.near("kinetic energy: the fluid's, too", o["kinetic_energy"].ravel(), inertia * v**2 / 2, 1e-13 * inertia * end**2)
            checks.near("potential energy: of what is left of the weight", o["potential_energy"].ravel(), -weight * G * run.trajectory.position[:, 0, 0], 1e-13 * abs(weight) * G)
            h = T / 20
            v = checks.run({**system, "ts_type": "beuler", "ts_dt": h, "snes_rtol": 1e-12}, interval=h).trajectory.velocity[:, 0, 0]
            checks.near("backward Euler, every step", v, end * (1 - (1 + h * D / inertia) ** -np.arange(21.0)), 1e-10 * abs(end))


def full_law(checks, folder):
    """Spheres of several radii and densities in a stream, in space, against solve_ivp (DOP853); steps by error control."""
    a, density = np.array([1e-3, 4e-3, 2.5e-3, 1e-3, 6e-3]), np.array([2500.0, 7800.0, 200.0, 1000.0, 1100.0])
    rng = np.random.default_rng(3)
    x, v, stream, g = rng.uniform(-1, 1, (5, 3)), rng.uniform(-0.3, 0.3, (5, 3)), np.array([0.2, -0.1, 0.05]), np.array([0.0, 0.0, -G])
    m, m_f, T = density * volume(a), RHO * volume(a), 0.6
    path = write_lattice(folder / "five.h5", x, m, velocity=v, radius=np.where(a == 2.5e-3, 0.0, a))

    def rate(_, y):
        u = y[15:].reshape(5, 3)
        force = (m - m_f)[:, None] * g - drag(u - stream, a[:, None])
        return np.concatenate([u.ravel(), (force / (m + m_f / 2)[:, None]).ravel()])
    exact = solve_ivp(rate, (0, T), np.concatenate([x.ravel(), v.ravel()]), method="DOP853", rtol=1e-12, atol=1e-14, t_eval=np.linspace(0, T, 7))
    for method in ({"ts_type": "rk", "ts_rk_type": "8vr"}, {"ts_type": "rosw", "ts_rosw_type": "rodas3"}):
        tight = 1e-12 if method["ts_type"] == "rk" else 1e-8
        run = checks.run({"bs_lattice_file": path, "bs_gravity": tuple(g), "bs_radius": 2.5e-3, "bs_fluid_velocity": tuple(stream), **DRAG, **WATER, **method, "ts_dt": 1e-4, "ts_max_time": T,
                          "ts_adapt_type": "basic", "ts_rtol": tight, "ts_atol": tight}, interval=T / 6)
        checks.near(f"{method['ts_type']}: positions", run.trajectory.position.reshape(7, -1), exact.y[:15].T, 100 * tight + 1e-10)
        checks.near(f"{method['ts_type']}: velocities", run.trajectory.velocity.reshape(7, -1), exact.y[15:].T, 1000 * tight + 1e-10)


def terminal(checks, folder):
    """(m - rho V) g = drag(u), whatever the added mass is; a sphere as heavy as the fluid stays."""
    a = 3e-3
    for density in (2500.0, 300.0):
        weight = (density - RHO) * volume(a) * G
        end = np.sign(weight) * brentq(lambda u: drag(np.array([u]), a)[0] - abs(weight), 1e-9, 10, xtol=1e-15, rtol=1e-15)
        for coefficient in (0, 0.5):
            run = checks.run({**ball(density, a), **DRAG, "bs_buoyancy": True, "bs_added_mass": coefficient, "ts_type": "beuler", "ts_dt": 1e3, "ts_max_time": 1e5, "snes_rtol": 1e-12}, interval=1e5)
            checks.near(f"{density:g} kg/m^3, C = {coefficient}: terminal velocity", run.trajectory.velocity[-1, 0, 0], end, 1e-11 * abs(end))
    run = checks.run({**ball(RHO, a), **DRAG, **WATER, "ts_type": "cn", "ts_dt": 0.1, "ts_max_time": 1}, interval=1)
    checks.near("as heavy as the fluid: it stays", run.trajectory.velocity[-1, 0, 0], 0, 1e-12)


def spring(checks, folder):
    """Spheres on springs in a fluid without viscosity: omega^2 = k/(m + m_a) in time and by modes, x = (m - rho V) g/k at rest, energies kept."""
    a, density, k, L = 0.02, 2500.0, 5.0, 0.3
    m, m_f = density * volume(a), RHO * volume(a)
    path = write_lattice(folder / "hung.h5", [[0.0], [L]], m, fixed=[1, 0], radius=[a, a], pairs=[[0, 1]], stiffness=k, rest_length=L)
    system = {"bs_lattice_file": path, "bs_gravity": G, "bs_fluid_density": RHO, **WATER}
    omega, sag = np.sqrt(k / (m + m_f / 2)), (m - m_f) * G / k
    T = 2 * np.pi / omega
    run = checks.run({**system, "ts_type": "rk", "ts_rk_type": "4", "ts_dt": T / 4000, "ts_max_time": T, "ts_adapt_type": "none"}, interval=T / 8)
    t, x = run.trajectory.time, run.trajectory.position[:, 1, 0]
    checks.near("it swings about its rest", x, L + sag * (1 - np.cos(omega * t)), 1e-9 * sag)
    run = checks.run({**system, "ts_type": "cn", "ts_dt": T / 40, "ts_max_time": 3 * T, "snes_rtol": 1e-13}, interval=T / 8)
    energy = run.trajectory.observables["total_energy"].ravel()
    checks.below("the trapezoidal rule keeps the energy", np.ptp(energy) / ((m - m_f) * G * sag), 1e-10)
    run = checks.run({**system, "bs_task": "statics"}, interval=0)
    checks.near("at rest", run.trajectory.position[-1, 1, 0], L + sag, 1e-10)
    o = run.trajectory.observables
    checks.near("work of the load that grows", o["work/loads"].ravel()[-1], -(m - m_f) * G * (L + sag / 2), 1e-9)
    checks.run({**system, "bs_task": "modes", "bs_modes": 1, "bs_output": folder / "modes.h5md"})
    with h5py.File(folder / "modes.h5md") as f:
        checks.near("its mode", f["modes/omega_squared"][0], omega**2, 1e-10 * omega**2)


def driven(checks, folder):
    """A support that moves a sphere exerts (m + m_a) A - (m - rho V) g + drag on it."""
    a, density, A, f, h = 0.01, 3000.0, 0.05, 2.0, 1e-3
    m, m_f, w = density * volume(a), RHO * volume(a), 4 * np.pi
    run = checks.run({**ball(density, a), **DRAG, **WATER, "bs_group_held": "all", "bs_motion_held": f"x=sinusoid:{A},{f},0", "ts_type": "cn", "ts_dt": h, "ts_max_time": 0.2}, interval=0.02)
    t = run.trajectory.time
    v = A * w * np.cos(w * t)
    expected = -(m + m_f / 2) * A * w**2 * np.sin(w * t) - (m - m_f) * G + drag(v[:, None], a)[:, 0]
    checks.near("the force of its support", run.trajectory.observables["reaction/held"].ravel(), expected, 1e-12 * np.abs(expected).max())


if __name__ == "__main__":
    run_parts("spheres in liquids", (stokes, full_law, terminal, spring, driven))
