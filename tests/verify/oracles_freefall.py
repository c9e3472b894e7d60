#!/usr/bin/env python3
"""A sphere that falls through air: every method, every step, against the exact discrete solutions.

The tabulated runs called be_seed, befd_seed and be_testafter stop Newton by a test of the residual before its last
update; SNES tests the iterate it returns, so those runs cannot be had digit for digit. Their answer is be_exact to
about ten digits, and that is what a converged Newton is compared with here; be_seed itself is met to those digits.
"""
import json
import math

from harness import EXPLICIT, METHODS, Checks, method_options, observed_orders, read_table
import numpy as np
from scipy.optimize import brentq

CLASSIC = {"rho_g": 0.9, "a": 0.01, "mu": 1.693e-5, "g": 9.8, "rho_p": 917.0, "u0": 0.001, "z0": 0.0, "T": 25.0}


def mass(p):
    return p["rho_p"] * 4 / 3 * math.pi * p["a"] ** 3


def drag(p, u):
    """D = 6 pi mu a u + rho pi a^2 u|u| (6/(1 + sqrt(Re)) + 0.4)/2: C_D with its 24/Re term written as Stokes' drag."""
    reynolds = 2 * p["a"] * p["rho_g"] * abs(u) / p["mu"]
    rest = 6 / (1 + math.sqrt(reynolds)) + 0.4
    return 6 * math.pi * p["mu"] * p["a"] * u + p["rho_g"] * math.pi * p["a"] ** 2 * u * abs(u) * rest / 2


def system(p):
    """One particle, one dimension, the axis pointing down."""
    return {"bs_lattice_type": "chain", "bs_lattice_size": 1, "bs_lattice_dim": 1, "bs_lattice_particle_mass": mass(p),
            "bs_lattice_velocity": p["u0"], "bs_gravity": p["g"], "bs_radius": p["a"], "bs_sphere_drag": True,
            "bs_sphere_drag_rho": p["rho_g"], "bs_sphere_drag_mu": p["mu"]}


def fall(checks, p, options, interval):
    """(t, u, z) of all frames."""
    r = checks.run({**system(p), **options}, interval=interval).trajectory
    return r.time, r.velocity[:, 0, 0], r.position[:, 0, 0]


def check_method(checks, name, p, method, n, table):
    """All steps of u and z; returns them for the error table. Newton leaves n tau |u| h behind at most."""
    h = p["T"] / n
    _, u, z = fall(checks, p, method_options(method, h, n, checks.ranks), h)
    if len(u) != n + 1:
        checks.true(name, False, f"{len(u)} frames for {n} steps")
        return None
    digits = 2e-14 if method in EXPLICIT else 1e-12
    checks.below(f"{name} u", np.abs(u - table["u"]).max() / np.abs(table["u"]).max(), digits)
    checks.below(f"{name} z", np.abs(z - table["z"]).max() / np.abs(table["z"]).max(), digits)
    return u, z


def check_errors(checks, name, p, ours, table, reference):
    """Errors against the reference at t_mid and T are the tabulated ones to three digits; orders follow."""
    orders = {}
    for method in sorted({m for m, _ in ours}):
        worst, hs, errors = 0.0, [], []
        for k in range(len(table["method"])):
            n = int(table["N"][k])
            if table["method"][k] != method or (method, n) not in ours:
                continue
            u, z = ours[method, n]
            for t, eu, ez in ((p["t_mid"], "err_u_tmid", "err_z_tmid"), (p["T"], "err_u_T", "err_z_T")):
                at, ref = round(t / p["T"] * n), int(np.argmin(np.abs(reference["t"] - t)))
                for value, exact, tab in ((u, reference["u"], table[eu][k]), (z, reference["z"], table[ez][k])):
                    noise = 2e-11 * abs(exact[ref]) if method not in EXPLICIT else 1e-12 * abs(exact[ref])
                    worst = max(worst, abs(abs(value[at] - exact[ref]) - tab) / (1e-3 * tab + noise))
            hs.append(p["T"] / n)
            errors.append(abs(u[round(p["t_mid"] / p["T"] * n)] - reference["u"][int(np.argmin(np.abs(reference["t"] - p["t_mid"])))]))
        orders[method] = observed_orders(hs, errors)
        shown = ", ".join(f"{q:.2f}" for q in orders[method]) or "-"
        checks.below(f"{name} {method} errors", worst, 1.0, f"of 0.1 % of the tabulated errors; orders {shown}")


def check_case(checks, folder):
    p, name = json.loads((folder / "params.json").read_text()), folder.name
    reference = read_table(folder / "reference.csv")
    ours = {}
    for path in sorted(folder.glob("*_exact_N*.csv")):
        method, n = path.stem.split("_exact_N")
        if method not in METHODS:
            checks.skip(f"{name} {path.name}", "unknown method")
            continue
        label = f"{name} {method} N={n}"
        with checks.group(label):
            got = check_method(checks, label, p, method, int(n), read_table(path))
            if got is not None:
                ours[method, int(n)] = got
    check_errors(checks, name, p, ours, read_table(folder / "convergence.csv"), reference)
    for path in sorted(folder.glob("*_seed_N*.csv")):
        method, n = path.stem.split("_seed_N")
        method = {"befd": "be"}.get(method, method)
        if (method, int(n)) in ours:
            table, (u, z) = read_table(path), ours[method, int(n)]
            digits = 1e-13 if method == "fe" else 1e-10
            off = max(np.abs(u - table["u"]).max() / np.abs(table["u"]).max(), np.abs(z - table["z"]).max() / np.abs(table["z"]).max())
            checks.below(f"{name} {path.stem}", off, digits)
    check_jacobian_variants(checks, name, p, folder)
    check_accurate(checks, name, p, reference)
    summary = {k: float(v) for k, v in zip(*[read_table(folder / "summary.csv")[q] for q in ("key", "value")])}
    with checks.group(f"{name} terminal velocity"):
        _, u, _ = fall(checks, p, method_options("be", 100 * p["T"], 100, checks.ranks), 1e4 * p["T"])
        checks.below(f"{name} terminal velocity", abs(u[-1] / summary["terminal_velocity"] - 1), 1e-12)


def check_jacobian_variants(checks, name, p, folder):
    """Jacobians by finite differences, matrix-free and by colouring converge to the same discrete solution."""
    path = sorted(folder.glob("be_exact_N*.csv"))[0]
    n, table = int(path.stem.split("N")[-1]), read_table(path)
    newton = {"snes_rtol": 1e-10, "snes_stol": 0}
    variants = {"snes_fd": {**newton, "snes_fd": True}, "snes_fd_color": {**newton, "snes_fd_color": True},
                "snes_mf": {**newton, "snes_mf": True, "ksp_rtol": 1e-8},
                "snes_mf_operator": {**newton, "snes_mf_operator": True, "ksp_type": "gmres"}}
    for variant, options in variants.items():
        label = f"{name} {variant} N={n}"
        with checks.group(label):
            o = {"ts_type": "beuler", "ts_adapt_type": "none", "ts_dt": p["T"] / n, "ts_max_time": p["T"], **options}
            _, u, z = fall(checks, p, o, p["T"] / n)
            checks.below(label, max(np.abs(u - table["u"]).max() / np.abs(table["u"]).max(),
                                    np.abs(z - table["z"]).max() / np.abs(table["z"]).max()), 1e-6)


def check_accurate(checks, name, p, reference):
    """Dormand-Prince with tight tolerances meets the reference at all its times. sqrt(Re) costs smoothness near u = 0."""
    with checks.group(f"{name} rk 5dp"):
        interval = reference["t"][1] - reference["t"][0]
        o = {"ts_type": "rk", "ts_rk_type": "5dp", "ts_adapt_type": "basic", "ts_rtol": 1e-12, "ts_atol": 1e-14,
             "ts_dt": p["T"] * 1e-6, "ts_max_time": p["T"]}
        t, u, z = fall(checks, p, o, interval)
        at = [int(np.argmin(np.abs(t - s))) for s in reference["t"]]
        checks.below(f"{name} rk 5dp frames", np.abs(t[at] - reference["t"]).max() / p["T"], 1e-12)
        checks.below(f"{name} rk 5dp u", np.abs(u[at] - reference["u"]).max() / reference["u"].max(), 1e-10)
        checks.below(f"{name} rk 5dp z", np.abs(z[at] - reference["z"]).max() / reference["z"].max(), 1e-10)


def built_in(checks):
    """The classic sphere: two numbers of the literature's run, the terminal velocity, and the step equation itself."""
    p, n = CLASSIC, 100
    h = p["T"] / n
    with checks.group("classic sphere"):
        _, u, z = fall(checks, p, method_options("be", h, n, checks.ranks), h)
        checks.near("backward Euler N=100 u(25 s)", u[-1], 24.663376145544252, 1e-10)
        checks.near("backward Euler N=100 z(25 s)", z[-1], 574.20550942120713, 1e-9)
        step = [m_u - h * (p["g"] - drag(p, m_u) / mass(p)) - before for m_u, before in zip(u[1:], u[:-1])]
        checks.below("backward Euler, u1 - u0 - h g(u1)", np.abs(step).max(), 1e-10)
        checks.below("backward Euler, z1 - z0 - h u1", np.abs(z[1:] - z[:-1] - h * u[1:]).max(), 1e-10)
        _, u, _ = fall(checks, p, method_options("be", 10 * p["T"], 100, checks.ranks), 1e3 * p["T"])
        limit = brentq(lambda w: mass(p) * p["g"] - drag(p, w), 1.0, 100.0, xtol=1e-14)
        checks.near("terminal velocity", u[-1], limit, 1e-11)
        # Upwards the drag changes sign: a sphere thrown up at -2 u_terminal comes to rest and falls.
        up = {**p, "u0": -2 * limit, "T": 1.0}
        _, u, _ = fall(checks, up, method_options("fe", 0.5, 2), 0.5)
        checks.near("thrown upwards, one forward Euler step", u[1], up["u0"] + 0.5 * (p["g"] - drag(p, up["u0"]) / mass(p)), 1e-12)


def main():
    checks = Checks("a falling sphere against exact discrete solutions")
    if checks.wants("built-in") or not checks.have("A_freefall"):
        built_in(checks)
    if not checks.have("A_freefall"):
        checks.finish(complete=False)
    for folder in sorted(q for q in (checks.oracles / "A_freefall").iterdir() if (q / "params.json").exists()):
        if checks.wants(folder.name):
            check_case(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
