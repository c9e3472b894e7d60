#!/usr/bin/env python3
"""Every particle case with reference results: states, energies, momenta, errors, orders, forces, Jacobian blocks."""
import math
import pathlib
import tempfile

from harness import EXPLICIT, NEWTON_RTOL, Checks, method_options, observed_orders, read_table
import newton_cases
import numpy as np
from particles import System, read_case, read_motion, read_states
from scipy.integrate import solve_ivp
from start_checks import check_forces, check_jacobian


class Case:
    def __init__(self, checks, folder, scratch):
        self.checks, self.folder, self.name = checks, folder, folder.name
        self.system, self.params = read_case(folder)
        self.lattice = self.system.write(scratch / f"{self.name}.h5")
        self.noise = {}
        t = read_table(folder / "noise.csv")
        for k in range(len(t["method"])):
            self.noise[t["method"][k], t["h"][k]] = {name: t[name][k] for name in t if name != "method"}
        extent = np.ptp(self.system.x, axis=0).max() or 1.0
        sizes = [r["abs_dx_double_vs_oracle"] / r["rel_dx"] for r in self.noise.values() if r["rel_dx"] > 0]
        self.size = max(sizes + [extent])

    def omega(self):
        """Highest frequency at the start [rad/s]."""
        t = read_table(self.folder / "checks.csv")
        return float(dict(zip(t["key"], t["value"])).get("omega_max_initial", 0.0))

    def options(self, method, h, steps):
        return {**self.system.options(self.lattice), **method_options(method, h, steps, self.checks.ranks)}

    def tolerances(self, method, h, steps, speed):
        """(position, velocity): rounding, and for implicit methods what Newton's tolerance leaves behind."""
        noise = self.noise.get((method, h), {})
        grow = noise.get("amplification_of_initial_dx", 1.0)
        grow = 1.0 if math.isnan(grow) else max(1.0, grow)
        tx = max(100 * noise.get("abs_dx_double_vs_oracle", 0.0), 1e-13 * self.size)
        tv = max(100 * noise.get("abs_dv_double_vs_oracle", 0.0), 1e-13 * speed)
        if method not in EXPLICIT:
            tx += steps * NEWTON_RTOL * speed * h * grow
            tv += steps * NEWTON_RTOL * speed * grow
        return tx, tv


def frames_of(case, method, h, steps, wanted):
    """{step: (x, v, frame observables)} at the wanted steps. A long run is written sparsely, step 1 by a run of its own."""
    def take(n, every):
        r = case.checks.run(case.options(method, h, n), interval=every * h).trajectory
        return {round(t / h): k for k, t in enumerate(r.time)}, r
    found = {}
    sparse = steps > 100
    every = math.gcd(*[s for s in wanted if s > 1 or not sparse], steps)
    for n, e in ([(1, 1)] if sparse and every > 1 else []) + [(steps, every)]:
        index, r = take(n, e)
        for s in wanted:
            if s in index and s <= n:
                k = index[s]
                found[s] = r.position[k], r.velocity[k], {q: o[k] for q, o in r.observables.items()}, int(r.step[k])
    return found


def check_run(case, method, h, steps):
    checks, name, d = case.checks, f"{case.name} {method} h={h:g}", case.system.dim
    states = read_states(case.folder / f"states_{method}_h{h:g}.csv", case.system.n, d)
    energy = read_table(case.folder / f"energy_{method}_h{h:g}.csv")
    rows = {int(s): k for k, s in enumerate(energy["step"])}
    stored = sorted(int(s) for s in states)
    with checks.group(name):
        found = frames_of(case, method, h, steps, sorted(set(stored) | (set(rows) - {0})))
        speed = max([np.abs(v).max() for _, _, v in states.values()] + [np.abs(case.system.v).max()])
        tx, tv = case.tolerances(method, h, steps, speed)
        missing = [s for s in stored if s not in found]
        checks.true(f"{name} frames", not missing and found[steps][3] == steps, f"steps {stored}, missing {missing}")
        both = [s for s in stored if s in found]
        checks.below(f"{name} x", max(np.abs(found[s][0] - states[s][1]).max() for s in both), tx)
        checks.below(f"{name} v", max(np.abs(found[s][1] - states[s][2]).max() for s in both), tv)
        check_observables(case, name, found, energy, rows, tx, tv)
        check_errors(case, name, method, h, found, tx, tv)


def check_observables(case, name, found, energy, rows, tx, tv):
    """Energies and momenta; the tolerance follows from those of the states by the differentials of the formulas."""
    s, worst = case.system, {}
    m = np.where(s.fixed, 0.0, s.m)
    for step in sorted(set(found) & set(rows)):
        x, v, o, _ = found[step]
        row = {q: energy[q][rows[step]] for q in energy}
        mv, arm = (m[:, None] * np.abs(v)).sum(), np.abs(x).max() + 1e-300
        tol_k = mv * tv + 1e-13 * abs(row["kinetic"])
        tol_p = s.force_scale(x).sum() * (tx + 1e-15 * case.size) + 1e-13 * sum(abs(row[q]) for q in ("elastic", "gravity", "central"))
        tol_m = m.sum() * tv + 1e-13 * mv
        potential = row["elastic"] + row["gravity"] + row["central"]
        expected = {"kinetic_energy": ([row["kinetic"]], tol_k), "potential_energy": ([potential], tol_p),
                    "total_energy": ([row["total"]], tol_k + tol_p),
                    "momentum": ([row["px"], row["py"], row["pz"]][:s.dim], tol_m),
                    "angular_momentum": ([0, 0, row["Lz"]] if s.dim == 2 else [row["Lx"], row["Ly"], row["Lz"]],
                                         m.sum() * arm * tv + mv * tx + 1e-13 * mv * arm)}
        for q, (value, tolerance) in expected.items():
            off = np.abs(np.ravel(o.get(q, np.nan)) - value).max()
            worst[q] = max(worst.get(q, 0.0), off / max(tolerance, 1e-30), key=lambda r: math.inf if math.isnan(r) else r)
    for q, ratio in worst.items():
        case.checks.below(f"{name} {q}", ratio, 1.0, "of its tolerance")


def check_errors(case, name, method, h, found, tx, tv):
    """Our error against the accurate reference is the tabulated one, to two digits and more."""
    if not (case.folder / "errors_vs_reference.csv").exists():
        return
    t = read_table(case.folder / "errors_vs_reference.csv")
    reference = read_states(case.folder / "reference.csv", case.system.n, case.system.dim, key="t")
    worst = 0.0
    for k in range(len(t["method"])):
        if t["method"][k] != method or t["h"][k] != h or t["step"][k] not in found or t["t"][k] not in reference:
            continue
        x, v = found[t["step"][k]][:2]
        _, rx, rv = reference[t["t"][k]]
        for ours, table, noise in ((np.abs(x - rx).max(), t["max_abs_dx"][k], tx), (np.abs(v - rv).max(), t["max_abs_dv"][k], tv)):
            worst = max(worst, abs(ours - table) / (5e-3 * table + 2 * noise))
    case.checks.below(f"{name} error against the reference", worst, 1.0, "of 0.5 % of the tabulated error")


def check_orders(case):
    """Errors at T for halved steps are the tabulated ones (2 digits), so the observed orders are too."""
    if not (case.folder / "orders.csv").exists():
        return
    t = read_table(case.folder / "orders.csv")
    T = t["T"][0]
    y = solve_ivp(case.system.rhs, (0, T), case.system.state(), method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    x_ref = y.reshape(2, case.system.n, case.system.dim)[0]
    for method in dict.fromkeys(t["method"]):
        rows = [k for k in range(len(t["method"])) if t["method"][k] == method]
        rows = rows if case.checks.full else rows[:2]
        name = f"{case.name} {method} order"
        with case.checks.group(name):
            errors, tolerance = [], []
            for k in rows:
                h, n = t["h"][k], int(t["N"][k])
                r = case.checks.run(case.options(method, h, n), interval=n * h).trajectory
                errors.append(np.abs(r.position[-1] - x_ref).max() / case.size)
                noise = case.tolerances(method, h, n, np.abs(r.velocity[-1]).max())[0] / case.size + 1e-12
                tolerance.append(abs(errors[-1] / t["rel_err_x"][k] - 1) / (0.02 + 3 * noise / t["rel_err_x"][k]))
            orders = ", ".join(f"{p:.2f}" for p in observed_orders(t["h"][rows], errors))
            case.checks.below(name, max(tolerance), 1.0, f"of 2 % of the tabulated errors; orders {orders}")


def check_accurate(case):
    """Dormand-Prince with tight tolerances against the reference and, where there is one, the closed form."""
    files = [f for f in ("reference.csv", "exact.csv") if (case.folder / f).exists()]
    if not files:
        return
    name = f"{case.name} rk 5dp"
    tables = {f: read_motion(case.folder / f, case.system) for f in files}
    end = max(tables[files[0]])
    times = sorted(t for t in tables[files[0]] if t >= end / 100)
    every = math.gcd(*[round(t / end * 10 ** 6) for t in times]) * end / 10 ** 6
    with case.checks.group(name):
        o = {**case.system.options(case.lattice), "ts_type": "rk", "ts_rk_type": "5dp", "ts_adapt_type": "basic",
             "ts_rtol": 1e-12, "ts_atol": 1e-13, "ts_dt": end / 1e4, "ts_max_time": end}
        r = case.checks.run(o, interval=every).trajectory
        for f in files:
            near = {t: min(tables[f], key=lambda q: abs(q - t)) for t in times}
            off = [np.abs(r.position[r.frame_at(t)] - tables[f][q][1]).max() for t, q in near.items() if abs(q - t) < 1e-9 * end]
            case.checks.below(f"{name} against {f}", max(off), 1e-9 * case.size, f"at {len(off)} times")


def check_blowup(case):
    """Explicit methods at the implicit step: the step at which |x - x0| passes 1e6 sizes, +-1."""
    if not (case.folder / "blowup.csv").exists():
        return
    t = read_table(case.folder / "blowup.csv")
    for method, h, step in zip(t["method"], t["h"], t["step_where_dx_exceeds_1e6_lattice_sizes"]):
        name = f"{case.name} {method} h={h:g} blow-up"
        with case.checks.group(name):
            r = case.checks.run(case.options(method, h, int(step) + 1), interval=h, expect=None, grows=True).trajectory
            with np.errstate(invalid="ignore"):
                far = ~(np.abs(r.position - r.position[0]).max(axis=(1, 2)) < 1e6 * case.size)
            case.checks.near(name, float(np.argmax(far)) if far.any() else math.inf, step, 1.0)


def check_case(case):
    check_forces(case)
    check_jacobian(case)
    if (case.folder / "roots.csv").exists():
        newton_cases.check(case)
        return
    for run in case.params["runs"]:
        check_run(case, run["method"], run["h"], run["N"])
    check_accurate(case)
    check_orders(case)
    check_blowup(case)


def built_in(checks, scratch):
    """Without the folder: a damped oscillator in closed form, two masses on a Kepler circle, backward Euler's factor."""
    s = System([[0.0], [0.6]], [[0.0], [0.0]], [1.0, 0.2], [1, 0], [[0, 1]], [40.0], [0.0], [0.8], law="strain")
    path, w2, g = s.write(scratch / "oscillator.h5"), 40 / 0.2, 0.8 / 0.2
    w = math.sqrt(w2 - g * g / 4)
    x, T = (lambda t: 0.6 * math.exp(-g * t / 2) * (math.cos(w * t) + g / (2 * w) * math.sin(w * t))), 0.5
    with checks.group("damped oscillator"):
        o = {"bs_lattice_file": path, "ts_type": "rk", "ts_rk_type": "5dp", "ts_rtol": 1e-12, "ts_atol": 1e-13,
             "ts_dt": 1e-4, "ts_max_time": T}
        checks.near("damped oscillator, closed form", checks.run(o, interval=T).trajectory.position[-1, 1, 0], x(T), 1e-10)
        for method, step_matrix in (("be", lambda A, h: np.linalg.inv(np.eye(2) - h * A)),
                                    ("tr", lambda A, h: np.linalg.solve(np.eye(2) - h / 2 * A, np.eye(2) + h / 2 * A))):
            y = np.linalg.matrix_power(step_matrix(np.array([[0, 1], [-w2, -g]]), 0.01), 50) @ [0.6, 0.0]
            r = checks.run({"bs_lattice_file": path, **method_options(method, 0.01, 50, checks.ranks)}, interval=0.5)
            checks.near(f"damped oscillator, {method} step matrix", r.trajectory.position[-1, 1, 0], y[0], 1e-12)


def main():
    checks = Checks("particle systems against reference results")
    with tempfile.TemporaryDirectory() as scratch:
        scratch = pathlib.Path(scratch)
        if checks.wants("built-in") or not checks.have("C_particles"):
            built_in(checks, scratch)
        if not checks.have("C_particles"):
            checks.finish(complete=False)
        folders = sorted(p for p in (checks.oracles / "C_particles").iterdir() if (p / "params.json").exists())
        checks.each([p for p in folders if checks.wants(p.name)], lambda mine, folder: check_case(Case(mine, folder, scratch)))
    checks.finish()


if __name__ == "__main__":
    main()
