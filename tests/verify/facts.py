#!/usr/bin/env python3
"""Closed forms: step matrices of an oscillator, frequencies of chains, equilibria, energy and momentum identities."""
import math
import pathlib
import tempfile

from equilibria import column, sag
from harness import METHODS, Checks, method_options, read_table
import numpy as np
from particles import System, columns

FACTS = "D_facts"


def chains(modes, n, K, L, spacing, m, amplitude, dim=1, across=0):
    """One chain of n free masses between fixed ends per mode j, displaced in it (axis `across`): a System, all in one.
    Particle rows: chain by chain. The chains do not touch each other."""
    k = np.arange(n + 2)
    x, fixed, pairs = [], [], []
    for c, j in enumerate(modes):
        p = np.zeros((n + 2, dim))
        p[:, 0] = k * spacing
        p[:, across] += amplitude * np.sin(j * math.pi * k / (n + 1)) * (k > 0) * (k <= n)
        x.append(p)
        fixed.append((k == 0) | (k == n + 1))
        pairs.append(np.stack([k[:-1], k[1:]], axis=1) + c * (n + 2))
    x, pairs = np.concatenate(x), np.concatenate(pairs)
    one = np.ones(len(pairs))
    return System(x, 0 * x, m * np.ones(len(x)), np.concatenate(fixed), pairs, K * one, L * one, 0 * one)


def mode_amplitudes(values, modes, n, spacing, across=0):
    """(T, modes): the component of each chain's displacement (T, N, d) along its own mode."""
    k, out = np.arange(n + 2), []
    for c, j in enumerate(modes):
        q = values[:, c * (n + 2):(c + 1) * (n + 2), across] - (k * spacing if across == 0 else 0)
        out.append(q @ np.sin(j * math.pi * k / (n + 1)) * 2 / (n + 1))
    return np.stack(out, axis=1)


def oscillator_factors(checks, scratch, rows):
    """(method, h omega, amplitude factor, phase): eigenvalues of the step matrix. All h omega of a method in one run of
    h = 1 s: a pair of oscillators K = m (h omega)^2 each, one started at x = 1, the other at v = 1."""
    for method in dict.fromkeys(r[0] for r in rows):
        mine = [r for r in rows if r[0] == method]
        w = np.repeat([r[1] for r in mine], 2)
        start, point = np.tile([1.0, 0.0], len(mine)), np.zeros((len(w), 1))
        m = np.full(len(w), 0.2)
        anchors = {"particle": np.arange(len(w)), "point": point, "stiffness": m * w * w, "rest_length": 0 * w, "damping": 0 * w}
        s = System(start[:, None], 1 - start[:, None], m, anchors=anchors)
        with checks.group(f"oscillator {method}"):
            o = {**s.options(s.write(scratch / f"oscillator_{method}.h5")), **method_options(method, 1.0, 1, checks.ranks)}
            r = checks.run(o, interval=1.0, grows=True).trajectory
            y = np.stack([r.position[-1, :, 0], r.velocity[-1, :, 0]])
            for k, (_, hw, factor, phase) in enumerate(mine):
                eigen = np.linalg.eigvals(y[:, 2 * k:2 * k + 2])
                size, angle = np.abs(eigen).max(), abs(np.angle(eigen[np.argmax(np.abs(eigen))]))
                # Rounding is magnified where eigenvalues are close, and by positions and velocities of unlike size.
                gap = max(abs(eigen[0] - eigen[1]) / size, 1e-8) / max(1.0, hw)
                checks.near(f"oscillator {method} h omega={hw:.4g} amplitude", size / factor, 1.0, 1e-13 / gap)
                checks.near(f"oscillator {method} h omega={hw:.4g} phase", angle, phase, 1e-13 / gap)


def growth(method, z):
    """Eigenvalue of largest size of one step on x'' = -omega^2 x, z = h omega: the closed forms."""
    i = 1j * z
    if method == "symplectic":
        half = 1 - z * z / 2
        return half - np.sqrt(complex(half * half - 1)) if half < 0 else half + np.sqrt(complex(half * half - 1))
    return {"fe": 1 + i, "midpoint": 1 + i + i * i / 2, "rk4": 1 + i + i**2 / 2 + i**3 / 6 + i**4 / 24,
            "be": 1 / (1 - i), "linbe": 1 / (1 - i), "imp": (1 + i / 2) / (1 - i / 2), "tr": (1 + i / 2) / (1 - i / 2)}[method]


def closed_factors():
    return [(method, z, abs(growth(method, z)), abs(np.angle(growth(method, z)))) for method in METHODS for z in (0.05, 0.7, 5.0)]


def chain_modes(checks, scratch, n, K, L, spacing, m, along, across):
    """Forces of small displacements give the eigenvalues (along: omega^2, across: its square, any sign); the motion of
    the chains, exactly linear in one dimension, gives the frequencies."""
    modes = np.arange(1, n + 1)
    for label, dim, axis, amplitude, eigen in (("longitudinal", 1, 0, 2e-3, along ** 2), ("transverse", 2, 1, 1e-7, across)):
        if eigen is None:
            continue
        s = chains(modes, n, K, L, spacing, m, amplitude, dim, axis)
        with checks.group(f"chain {label}"):
            o = {**s.options(s.write(scratch / f"{label}.h5")), **method_options("fe", 1.0, 1)}
            q = -mode_amplitudes(checks.run(o, interval=1.0, grows=True).trajectory.velocity - 0.0, modes, n, 0.0, axis)[-1] / amplitude
            # Rounding of K |d|/L relative to the restoring force m eigen amplitude; cubic terms across.
            tolerance = 1e-14 * K * spacing / L / (m * amplitude) + (10 * (amplitude / spacing) ** 2 * K / (m * L) if axis else 0)
            checks.near(f"chain {label} eigenvalues", q, eigen, tolerance)
    T = 1.0
    s = chains(modes, n, K, L, spacing, m, 2e-3)
    with checks.group("chain motion"):
        o = {**s.options(s.write(scratch / "motion.h5")), "ts_type": "rk", "ts_rk_type": "5dp", "ts_rtol": 1e-11, "ts_atol": 1e-13,
             "ts_dt": 1e-4, "ts_max_time": T}
        r = checks.run(o, interval=T / 20).trajectory
        q = mode_amplitudes(r.position, modes, n, spacing) / 2e-3
        checks.near("chain motion, cos(omega_j t) of every mode", q, np.cos(np.outer(r.time, along)), 1e-7)


def dispersion(checks, scratch, n, K, L, m, h, modes, seen):
    """A standing wave under each method: what frequency and damping the method makes of it.
    seen: {method: (omega (modes), amplitude factor per step (modes))}."""
    s = chains(modes, n, K, L, L, m, 1e-3 * L)
    path, steps = s.write(scratch / "dispersion.h5"), 40
    for method, (omega, factor) in seen.items():
        with checks.group(f"wave {method}"):
            r = checks.run({**s.options(path), **method_options(method, h, steps, checks.ranks)}, interval=10 * h).trajectory
            q = mode_amplitudes(r.position, modes, n, L) / (1e-3 * L)
            step = np.round(r.time / h)[:, None]
            angle = h * omega * step
            expected = factor ** step * np.cos(angle)
            if method == "symplectic":  # velocity first: x1 = (1 - (h omega)^2) x0, so not symmetric in time
                expected = np.cos(angle) - np.tan(h * omega / 2) * np.sin(angle)
            checks.near(f"wave {method}, {len(modes)} modes, {steps} steps", q, expected, 1e-9)


def spring_tensor(checks, scratch, rows):
    """Force and derivative of single springs: dF/dd has -K/L along d and -(K/L)(1 - L/|d|) across it."""
    step = 1e-6
    for dim in sorted({int(r["dim"]) for r in rows}):
        mine = [r for r in rows if int(r["dim"]) == dim]
        d = np.array([[r["dx"], r["dy"], r["dz"]][:dim] for r in mine])
        K, L = np.array([r["K"] for r in mine]), np.array([r["L"] for r in mine])
        shifts = [np.zeros(dim)] + [sign * step * np.eye(dim)[c] for c in range(dim) for sign in (1, -1)]
        ends = np.concatenate([d + e for e in shifts])
        count, copies = len(ends), len(shifts)
        x = np.concatenate([ends, np.zeros((count, dim))])
        s = System(x, 0 * x, np.ones(2 * count), np.arange(2 * count) >= count, np.arange(2 * count).reshape(2, -1).T,
                   np.tile(K, copies), np.tile(L, copies), np.zeros(count))
        with checks.group(f"spring in {dim} dimensions"):
            o = {**s.options(s.write(scratch / f"tensor{dim}.h5")), **method_options("fe", 1.0, 1)}
            f = checks.run(o, interval=1.0).trajectory.velocity[-1, :count].reshape(copies, len(mine), dim)
            table = np.array([[r["Fx"], r["Fy"], r["Fz"]][:dim] for r in mine])
            checks.near(f"spring in {dim} dimensions, force", f[0], table, 1e-13 * K.max())
            J = np.stack([(f[1 + 2 * c] - f[2 + 2 * c]) / (2 * step) for c in range(dim)], axis=2)
            for k, r in enumerate(mine):
                expected = np.sort([r["axial_eig_of_dFdd"]] + (dim - 1) * [r["transverse_eig_of_dFdd"]])
                checks.near(f"spring case {r['case']} dF/dd", np.linalg.eigvalsh((J[k] + J[k].T) / 2), expected, 1e-7 * K[k] / L[k])


def linear_energy(checks, scratch, system, table, h, steps):
    """Zero-rest-length springs are linear: energies after 1 and all steps; backward Euler loses |dv|_M^2/2 + |dx|_H^2/2."""
    path = system.write(scratch / "net.h5")
    for k, method in enumerate(table["method"]):
        with checks.group(f"linear net {method}"):
            r = checks.run({**system.options(path), **method_options(method, h, steps, checks.ranks)}, interval=h, grows=method == "fe").trajectory
            e = np.ravel(r.observables["total_energy"])
            for at, column_name in ((0, "E0"), (1, "E1"), (steps, f"E{steps}")):
                checks.near(f"linear net {method} {column_name}", e[at], table[column_name][k], 1e-12 * max(table["E0"][0], table[column_name][k]))
            identity(checks, system, method, r, e, h)


def identity(checks, system, method, r, e, h):
    x, v, m = r.position, r.velocity, system.m[:, None]
    if method == "be":
        dx, dv = np.diff(x, axis=0), np.diff(v, axis=0)
        # |dx|_H^2 = -dx.f(dx): the force is linear.
        lost = [((m * b * b).sum() - (a * system.force(a, 0 * a)).sum()) / 2 for a, b in zip(dx, dv)]
        checks.near("linear net be, energy lost in every step", np.diff(e), -np.array(lost), 1e-12 * e[0])
    elif method == "symplectic":
        shadow = e + h / 2 * np.array([(b * system.force(a, b)).sum() for a, b in zip(x, v)])
        checks.near("linear net symplectic, E + (h/2) v.f", shadow, shadow[0], 1e-11 * e[0])
    elif method in ("tr", "imp"):
        checks.near(f"linear net {method}, energy", e, e[0], 1e-11 * e[0])


def momenta(checks, scratch):
    """A free net: backward Euler keeps sum m v and changes the angular momentum by -h^2 sum v1 x f(x1, v1)."""
    rng, n, h = np.random.default_rng(3), 7, 0.02
    x, v = rng.uniform(-1, 1, (n, 2)), rng.uniform(-1, 1, (n, 2))
    pairs = np.array([(i, j) for i in range(n) for j in range(i)])
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * rng.uniform(0.8, 1.2, len(pairs))
    s = System(x, v, rng.uniform(0.5, 2, n), None, pairs, rng.uniform(5, 20, len(pairs)), rest, rng.uniform(0, 0.5, len(pairs)))
    with checks.group("free net"):
        o = {**s.options(s.write(scratch / "free.h5")), **method_options("be", h, 20, checks.ranks)}
        r = checks.run(o, interval=h).trajectory
        p = r.observables["momentum"].reshape(len(r.time), -1)
        checks.near("free net, momentum", p, (s.m[:, None] * v).sum(0), 1e-11)
        cross = [-h * h * (b[:, 0] * f[:, 1] - b[:, 1] * f[:, 0]).sum()
                 for a, b in zip(r.position[1:], r.velocity[1:]) for f in [s.force(a, b)]]
        checks.near("free net, angular momentum lost in every step", np.diff(r.observables["angular_momentum"][:, 2]), cross, 1e-11)


def centres(checks, scratch):
    """Pulls to a centre that is a particle, and of the centre of mass: their energies make the sum that the motion keeps, by the formulas of the laws."""
    rng, n, h, p, value = np.random.default_rng(8), 6, 0.01, 1.5, 300.0
    x, v, m = rng.uniform(20, 60, (n, 2)), rng.uniform(-3, 3, (n, 2)), rng.uniform(0.5, 2, n)
    x[0], v[0], fixed = 0, 0, np.arange(n) == 0
    path = System(x, v, m, fixed).write(scratch / "centre.h5")
    run = {"bs_model": "particles", "bs_lattice_file": path, "ts_type": "verlet", "ts_dt": h, "ts_max_time": 200 * h}
    pull = {"bs_xsp_attraction": value, "bs_xsp_attraction_exponent": p}
    whole = {"bs_xsp_center_of_mass": 40.0, "bs_xsp_center_particle": 0}
    with checks.group("centres"):
        found = {name: checks.run({**run, **o}, interval=10 * h).trajectory
                 for name, o in (("a point", {**pull, "bs_xsp_attraction_center": (0, 0)}), ("a particle", {**pull, "bs_xsp_center_particle": 0}), ("the centre of mass", whole))}
        energies = {name: np.ravel(r.observables["total_energy"]) for name, r in found.items()}
        checks.near("pull to a particle: the energy is that to a point there", energies["a particle"], energies["a point"] - energies["a point"][0] + energies["a particle"][0], 1e-9)
        for name, e in energies.items():
            checks.below(f"pull, {name}: energy is kept", np.ptp(e), 2e-3 * np.ptp(np.ravel(found[name].observables["kinetic_energy"])))
        r = found["the centre of mass"]
        X = (m[1:, None] * r.position[:, 1:]).sum(1) / m[1:].sum()
        checks.near("pull of the centre of mass: its energy", np.ravel(r.observables["potential_energy"]), 20.0 * (X**2).sum(1), 1e-9)


def built_in(checks, scratch):
    """The same facts at other numbers, from their formulas."""
    oscillator_factors(checks, scratch, closed_factors())
    n, K, L, spacing, m = 6, 3.0, 0.2, 0.25, 0.05
    half = np.sin(np.arange(1, n + 1) * math.pi / (2 * (n + 1)))
    chain_modes(checks, scratch, n, K, L, spacing, m, 2 * np.sqrt(K / L / m) * half, 4 * K / m * (1 / L - 1 / spacing) * half ** 2)
    z = np.concatenate([[0], -np.cumsum([0.1 * (1 + 0.02 * 9.8 * (4 - k) / 30) for k in range(4)])])
    column(checks, scratch, "of four", z, 0.1, 30.0, 0.02, 9.8)
    momenta(checks, scratch)
    centres(checks, scratch)


def tabulated(checks, scratch):
    """The tables, topic by topic."""
    table = {p.stem: read_table(p) for p in (checks.oracles / FACTS).glob("*.csv")}
    facts = dict(zip(table["facts"]["key"], table["facts"]["value"]))
    if checks.wants("oscillator"):
        t = table["oscillator_factors"]
        oscillator_factors(checks, scratch, list(zip(t["method"], t["h_omega"], t["amplitude_factor_per_step"], t["phase_per_step"])))
    if checks.wants("chain modes"):
        t = table["chain_modes"]
        chain_modes(checks, scratch, len(t["j"]), 5.0, 0.05, 0.06, 0.01, t["omega_longitudinal"], t["eig_transverse"])
    if checks.wants("wave"):
        t = table["wave_dispersion"]
        one = np.ones(len(t["j"]))
        both = t["omega_seen_by_trapezoid_or_implicit_midpoint"]
        dispersion(checks, scratch, 500, 1.0, 0.01, 0.001, 0.0025, t["j"].astype(int),
                   {"be": (t["omega_seen_by_be"], t["be_amplitude_factor_per_step"]), "tr": (both, one), "imp": (both, one),
                    "symplectic": (t["omega_seen_by_symplectic"], one)})
    if checks.wants("spring tensor"):
        t = table["spring_tensor"]
        spring_tensor(checks, scratch, [{q: t[q][k] for q in t} for k in range(len(t["case"]))])
    if checks.wants("column"):
        column(checks, scratch, "standing", table["column_standing"]["z"], 0.1, 12000.0, 0.01, 9.8)
        column(checks, scratch, "hanging", table["column_hanging"]["z"], 0.1, 50.0, 0.01, 9.8)
    if checks.wants("hanging chain"):
        checks.near("hanging chain, the table's own sag", float(facts["sag_symmetric_sag"]), -table["sag_symmetric"]["y"].min(), 1e-15)
        sag(checks, scratch, "soft", table["sag_symmetric"], 5.0, 0.05, 0.01, 9.8, 1e-11)
        sag(checks, scratch, "stiff", table["sag_stiff"], 5e6, 0.06, 0.01, 9.8, 1e-9)
    if checks.wants("linear net"):
        p, q = table["linear_energy_system_particles"], table["linear_energy_system_springs"]
        net = System(columns(p, "xy"), columns(p, ["vx", "vy"]), p["mass"], p["fixed"], columns(q, "ij"), q["stiffness"],
                     q["rest_length"], q["damping"])
        linear_energy(checks, scratch, net, table["linear_energy_identities"], 0.05, 50)


def main():
    checks = Checks("closed-form facts")
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        if checks.wants("built-in") or not checks.have(FACTS):
            built_in(checks, scratch)
        if not checks.have(FACTS):
            checks.finish(complete=False)
        tabulated(checks, scratch)
    checks.finish()


if __name__ == "__main__":
    main()
