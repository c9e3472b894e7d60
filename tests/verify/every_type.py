#!/usr/bin/env python3
"""Every subtype of every time-stepping type that this PETSc names, once against its order: on a damped nonlinear lattice with
masses other than 1 whose anchors are driven (on one at rest where the subtype is refused with driven ones), and on a
descriptor system with a source that depends on time. What cannot be right is refused by name before the first step.

The expected orders are those of the program's own table, src/time/methods.cpp, which in turn must be what the methods'
authors claim, PUBLISHED. A type or subtype that PETSc names and the program neither runs nor refuses by name fails.
"""
import pathlib
import re
import subprocess
import tempfile

import h5py
from harness import REPO, Checks, direct, observed_orders, write_lattice
import numpy as np
from orders import AMPLITUDE, FREQUENCY, MU, PHASE, RADIUS, RHO, T, system
from program import environment, words
from scipy.integrate import solve_ivp
from scipy.linalg import expm

OPTION = {"rosw": "ts_rosw_type", "arkimex": "ts_arkimex_type", "rk": "ts_rk_type", "ssp": "ts_ssp_type", "bdf": "ts_bdf_order"}
# Orders as PETSc's manual and the papers it names give them.
PUBLISHED = {
    ("beuler", ""): 1, ("cn", ""): 2, ("theta", ""): 2, ("alpha2", ""): 2, ("euler", ""): 1, ("symplectic", ""): 1, ("verlet", ""): 2,
    **{("bdf", str(k)): k for k in range(1, 7)},
    **{("rosw", s): k for s, k in (("theta1", 1), ("theta2", 2), ("2m", 2), ("2p", 2), ("ra3pw", 3), ("ra34pw2", 3), ("rodas3", 3),
                                   ("sandu3", 3), ("assp3p3s1c", 3), ("lassp3p4s2c", 3), ("llssp3p4s2c", 3), ("ark3", 3),
                                   ("grk4t", 4), ("shamp4", 4), ("veldd4", 4), ("4l", 4))},
    **{("arkimex", s): k for s, k in (("1bee", 1), ("a2", 2), ("l2", 2), ("ars122", 2), ("2c", 2), ("2d", 2), ("2e", 2), ("prssp2", 2),
                                      ("3", 3), ("bpr3", 3), ("ars443", 3), ("4", 4), ("5", 5))},
    **{("rk", s): k for s, k in (("1fe", 1), ("2a", 2), ("2b", 2), ("3", 3), ("3bs", 3), ("4", 4), ("5f", 5), ("5dp", 5), ("5bs", 5),
                                 ("6vr", 6), ("7vr", 7), ("8vr", 8))},
    **{("ssp", s): k for s, k in (("rks2", 2), ("rks3", 3), ("rk104", 4))}}
# The second stage of these is at t - 2 h in PETSc 3.18, before the step and before the start.
LOOKS_BACK = {("rosw", s) for s in ("grk4t", "shamp4", "veldd4", "4l")}
# Types for positions and velocities alone.
SECOND_ORDER = ("symplectic", "verlet", "alpha2")
# Numbers of steps at which the order shows, above rounding; by order where nothing is said.
STEPS = {1: (400, 800), 2: (100, 200), 3: (80, 160), 4: (80, 160), 5: (40, 80), 6: (20, 40), 7: (20, 40), 8: (10, 20)}
OWN_STEPS = {("rosw", "2p"): (800, 1600), ("rk", "5dp"): (80, 160), ("bdf", "5"): (160, 320), ("bdf", "6"): (40, 80)}
BAND = 0.25
NEWER = {"rosw": {"r34prw", "r3prl2", "rodaspr", "rodaspr2"}}  # not in PETSc 3.18, and refused
RLC = {"R": 20.0, "L": 1e-3, "C": 1e-6, "f": 5000.0, "T": 2e-4}


def table():
    """{(type, subtype): (order, order on descriptor systems, has an error estimate, is implicit)} as the program has it."""
    source = (REPO / "src/time/methods.cpp").read_text()
    implicit = {name: kind == "IMPLICIT" for name, kind in re.findall(r'TypeTraits \w+\{"(\w+)", (\w+),', source)}
    rows = re.findall(r'\{&(\w+),\s*"(\w*)",\s*\w+,\s*(\d+),\s*(\d+),\s*(\w+),\s[^}]*\}', source)
    return {(t.lower(), s): (int(order), int(descriptor), estimate == "true", implicit[t.lower()]) for t, s, order, descriptor, estimate in rows}


def refused_types():
    """{type: words of its refusal} as the program has it."""
    rows = re.findall(r'\{"(\w+)",\s*(?:"([^"]*)"|NOT_BUILT),\s*"[^"]*"\}', (REPO / "src/time/methods.cpp").read_text())
    return {name: reason or "is not part of this PETSc" for name, reason in rows}


def types_of_petsc(checks):
    """Those that PETSc has registered, as -help lists them, and those that its header names."""
    line = [str(checks.program), *words({"bs_lattice_type": "chain", "bs_lattice_size": 4, "help": True})]
    said = subprocess.run(line, env=environment(1), capture_output=True, text=True, timeout=120).stdout
    found = re.search(r"-ts_type .*\(one of\) ([^()]*)", said)
    return set(found.group(1).split()) if found else set()


def named_by_petsc(checks, kind):
    """Subtypes of a type as -help lists them."""
    line = [str(checks.program), *words({"bs_lattice_type": "chain", "bs_lattice_size": 4, "ts_type": kind, "help": True})]
    said = subprocess.run(line, env=environment(1), capture_output=True, text=True, timeout=120).stdout
    found = re.search(rf"-{OPTION[kind]}:? .*one of\)? ([^()]*)", said)
    return set(found.group(1).split()) if found else set()


def options_of(method):
    kind, subtype = method
    o = {"ts_type": kind, **({OPTION[kind]: subtype} if subtype else {})}
    return {**o, "ts_theta_theta": 0.5} if kind == "theta" else o


class Lattice:
    """The lattice of orders.py, with driven anchors or without, and its state at T by DOP853."""

    def __init__(self, folder, driven):
        s = system()
        if not driven:
            s.motion = None
        self.reference = solve_ivp(s.rhs, (0, T), s.state(), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1].reshape(2, s.n, s.dim)
        lattice = s.write(pathlib.Path(folder) / ("driven.h5" if driven else "still.h5"), radius=RADIUS)
        self.options = {**s.options(lattice), "bs_sphere_drag": True, "bs_sphere_drag_rho": RHO, "bs_sphere_drag_mu": MU, "ts_max_time": T}
        if driven:
            self.options.update({"bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": AMPLITUDE, "bs_anchor_frequency": FREQUENCY,
                                 "bs_anchor_phase": PHASE})

    def error(self, checks, options, n):
        r = checks.run({**self.options, "ts_adapt_type": "none", **options, "ts_dt": T / n}, interval=T).trajectory
        return max(np.abs(a - b).max() / np.abs(b).max() for a, b in zip((r.position[-1], r.velocity[-1]), self.reference))


class Circuit:
    """R, L and C in series with a source: three of five equations are algebraic. Driven: sin(2 pi f t), from rest; still: u = 1
    from a consistent state that is not at rest. The reference: DOP853 on v3 and iL alone."""

    def __init__(self, folder, driven):
        R, L, C, f, end = (RLC[k] for k in "RLCfT")
        source = (lambda t: np.sin(2 * np.pi * f * t)) if driven else (lambda t: 1.0)
        v3, i = solve_ivp(lambda t, y: [y[1] / C, (source(t) - R * y[1] - y[0]) / L], (0, end), [0, 0], method="DOP853", rtol=1e-13,
                          atol=1e-16).y[:, -1]
        self.reference = np.array([source(end), source(end) - R * i, v3, i, -i])
        self.options = {"bs_model": "linear", "bs_linear_type": "rlc", "bs_linear_resistance": R, "bs_linear_inductance": L,
                        "bs_linear_capacitance": C, "bs_linear_source": f"sine(1,{f})" if driven else "1", "ts_max_time": end}
        if not driven:
            start = pathlib.Path(folder) / "start.csv"
            start.write_text("1\n1\n0\n0\n0\n")
            self.options["bs_linear_x0"] = start

    def error(self, checks, options, n):
        with tempfile.TemporaryDirectory() as folder:
            end, file = self.options["ts_max_time"], pathlib.Path(folder) / "out.h5"
            checks.run({**self.options, "ts_adapt_type": "none", **options, "ts_dt": end / n, "bs_output": file, "bs_output_interval": end})
            with h5py.File(file) as f:
                state = f["states/value"][-1].ravel()
        return np.max(np.abs(state - self.reference) / [1, 1, 1, 0.01, 0.01])


def check_order(checks, name, problem, options, counts, order):
    errors = [problem.error(checks, options, n) for n in counts]
    seen = observed_orders([1 / n for n in counts], errors)[-1]
    checks.true(name, bool(abs(seen - order) <= BAND), f"order {seen:.2f} for {order} (+-{BAND}), error {errors[-1]:.2g}")


def refused(checks, name, options, *parts):
    """Exit code 2 and one line that holds `parts`."""
    done = checks.run(options, expect=None)
    lines = [line for line in done.stderr.splitlines() if "error:" in line]
    good = done.code == 2 and len(lines) == 1 and all(part in lines[0] for part in parts)
    checks.true(f"{name} is refused", good, f"exit code {done.code}: {lines[0][18:] if lines else 'no error'}")


PULSE = {"from": 0.7301, "to": 0.7318, "period": 0.6, "end": 1.6}  # short beside the steps before it


def pulses(A, b, x):
    """x(end) of x' = A x + b u(t) from x, u = 1 in the pulses of PULSE, by matrix exponentials."""
    n, t = len(b), 0.0
    knots = [(PULSE[k] + i * PULSE["period"], k == "from") for i in range(2) for k in ("from", "to")]
    on = False
    for time, begins in [*knots, (PULSE["end"], False)]:
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[:n, n] = A, b if on else 0
        x = (expm(M * (time - t)) @ np.append(x, 1))[:n]
        t, on = time, begins
    return x


def check_pulses(checks, name, options, circuits):
    """Steps under error control end where what is given jumps, however short what follows is: two pulses of a force on an oscillator, by an expression, and
    of a current into two nodes, each against matrix exponentials."""
    control = {**options, "ts_adapt_type": "basic", "ts_rtol": 1e-6, "ts_atol": 1e-6, "ts_dt": 0.01, "ts_max_time": PULSE["end"]}
    m, k, d, F = 0.5, 20.0, 0.4, 100.0
    gate = "+".join(f"step(t-{PULSE['from'] + i * PULSE['period']:.6g})*step({PULSE['to'] + i * PULSE['period']:.6g}-t)" for i in range(2))
    with tempfile.TemporaryDirectory() as folder:
        lattice = write_lattice(pathlib.Path(folder) / "l.h5", [[0.0], [1.01]], m, fixed=[1, 0], pairs=[[0, 1]], stiffness=k, rest_length=1.0, damping=d, spring_law="hooke")
        netlist = pathlib.Path(folder) / "pulse.cir"
        width = PULSE["to"] - PULSE["from"]
        netlist.write_text(f"pulses\nI1 0 a PULSE(0 100 {PULSE['from']} 0 0 {width:.6g} {PULSE['period']})\nR1 a 0 1\nC1 a 0 0.1\nR2 a b 1\nC2 b 0 0.05\n")
        force = {**control, "bs_lattice_file": lattice, "bs_group_mass": "ids:1", "bs_force_mass": f"expression:{F}*({gate})"}
        current = {key: value for key, value in {**control, "bs_netlist": netlist}.items() if not key.startswith("condensed")}
        r = checks.run(force, interval=PULSE["end"]).trajectory
        x, v = pulses(np.array([[0, 1], [-k / m, -d / m]]), np.array([0, F / m]), np.array([0.01, 0]))
        checks.below(f"{name}: an oscillator after two short pulses of a force", max(abs(r.position[-1, 1, 0] - 1 - x), abs(r.velocity[-1, 1, 0] - v) / np.sqrt(k / m)), 1e-3 * F / k)
        if not circuits:
            return
        current["bs_output"], current["bs_output_interval"] = pathlib.Path(folder) / "p.h5", PULSE["end"]
        checks.run(current)
        with h5py.File(current["bs_output"]) as f:
            seen = f["states/value"][-1].ravel()
        C = np.array([0.1, 0.05])
        exact = pulses(-np.array([[2, -1], [-1, 1]]) / C[:, None], np.array([100 / C[0], 0]), np.zeros(2))
        checks.below(f"{name}: nodes after two short pulses of a current", np.abs(seen - exact).max(), 1e-3)


def check_control(checks, name, options):
    """Tolerances bound the error of an oscillation that nothing drives, and ten thousand times tighter ones make it smaller."""
    m, k, T = 0.5, 20.0, 2.0
    w, errors = np.sqrt(k / m), []
    with tempfile.TemporaryDirectory() as folder:
        lattice = write_lattice(pathlib.Path(folder) / "l.h5", [[0.0], [1.2]], m, fixed=[1, 0], pairs=[[0, 1]], stiffness=k, rest_length=1.0, spring_law="hooke")
        for tolerance in (1e-3, 1e-7):
            o = {**options, "bs_lattice_file": lattice, "ts_adapt_type": "basic", "ts_rtol": tolerance, "ts_atol": tolerance, "ts_dt": 0.01, "ts_max_time": T}
            r = checks.run(o, interval=T).trajectory
            errors.append(max(abs(r.position[-1, 1, 0] - 1 - 0.2 * np.cos(w * T)), abs(r.velocity[-1, 1, 0] / w + 0.2 * np.sin(w * T))))
    checks.true(f"{name}: tolerances bound the error of an oscillation", errors[0] < 0.15 and errors[1] < min(2e-3, 0.2 * errors[0]), f"{errors[0]:.3g} and {errors[1]:.3g} m")


def check_method(checks, method, problems):
    order, descriptor, estimate, implicit = checks.table[method]
    name, options, counts = " ".join(method).strip(), options_of(method), OWN_STEPS.get(method, STEPS[order])
    solver = direct(checks.ranks) if implicit and method[0] != "rosw" else {}
    back = method in LOOKS_BACK
    checks.true(f"{name} in the table", order == PUBLISHED.get(method), f"order {order}")
    check_order(checks, f"{name} on {'a lattice at rest' if back else 'a driven lattice'}", problems["still" if back else "driven"],
                {**solver, **options}, counts, order)
    if back:
        refused(checks, f"{name} on a driven lattice", {**problems["driven"].options, **options}, name.split()[1], "t - 2 h")
        refused(checks, f"{name} on a driven circuit", {**problems["circuit"].options, **options}, name.split()[1], "t - 2 h")
    if descriptor:
        check_order(checks, f"{name} on {'a circuit at u = 1' if back else 'a driven circuit'}",
                    problems["still circuit" if back else "circuit"], options, counts, descriptor)
    elif method[0] in SECOND_ORDER:
        refused(checks, f"{name} on a circuit", {**problems["circuit"].options, **options}, "needs positions and velocities", name)
    else:
        refused(checks, f"{name} on a circuit with a singular C", {**problems["circuit"].options, **options}, "C is singular", name.split()[-1])
    adaptive = {**problems["still"].options, **options, "ts_adapt_type": "basic", "ts_max_steps": 2}
    if estimate:
        check_control(checks, name, {**solver, **options})
    if estimate and not back:
        check_pulses(checks, name, {**solver, **options}, method[0] not in SECOND_ORDER)
    if not estimate:
        refused(checks, f"{name} with -ts_adapt_type basic", adaptive, "does not estimate its error", name.split()[-1])
    else:
        checks.true(f"{name} with -ts_adapt_type basic", checks.run(adaptive, expect=None).code == 0, "runs")


ALPHAS = (0.9, 0.5, 0.0)
CHAIN = {"bs_lattice_type": "chain", "bs_lattice_size": 5, "ts_max_steps": 2}
# what no method can go with, and what one of them cannot
REFUSALS = {
    **{f"-ts_type {t}": ({"ts_type": t}, f"-ts_type {t} {reason}: use ") for t, reason in refused_types().items()},
    "-ts_type magic": ({"ts_type": "magic"}, "-ts_type magic is not one this program knows"),
    "adapter glee": ({"ts_adapt_type": "glee"}, "write basic, dsp or none"),
    "adapter cfl": ({"ts_adapt_type": "cfl"}, "write basic, dsp or none"),
    "adapter history": ({"ts_adapt_type": "history"}, "write basic, dsp or none"),
    "convergence estimate": ({"ts_convergence_estimate": True}, "postprocess/sweep.py"),
    "time span": ({"ts_time_span": "0,1"}, "-bs_output_interval"),
    "multirate": ({"ts_type": "rk", "ts_rk_multirate": True}, "leave it out"),
    "rtol nan": ({"ts_adapt_type": "basic", "ts_rtol": "nan"}, "option -ts_rtol: nan"),
    "rtol negative": ({"ts_rtol": -1e-3}, "option -ts_rtol: -0.001"),
    "rtol 1": ({"ts_adapt_type": "basic", "ts_rtol": 1}, "option -ts_rtol: 1: give a number >= 0 and below 1"),
    "atol infinite": ({"ts_adapt_type": "basic", "ts_atol": "inf"}, "option -ts_atol: inf"),
    "no tolerance": ({"ts_adapt_type": "basic", "ts_rtol": 0, "ts_atol": 0}, "without error control"),
    "a tolerance of x alone": ({"ts_adapt_type": "basic", "ts_rtol": 0, "ts_atol": 0, "bs_rtol_x": 1e-6}, "without error control"),
    "rks2 of -3 stages": ({"ts_type": "ssp", "ts_ssp_nstages": -3}, "-ts_ssp_nstages: -3"),
    "rks2 of 1 stage": ({"ts_type": "ssp", "ts_ssp_nstages": 1}, "-ts_ssp_nstages: 1"),
    "rks3 of 5 stages": ({"ts_type": "ssp", "ts_ssp_type": "rks3", "ts_ssp_nstages": 5}, "square"),
    "rk104 of 4 stages": ({"ts_type": "ssp", "ts_ssp_type": "rk104", "ts_ssp_nstages": 4}, "rk104 has 10 stages"),
    "alpha2, radius 2": ({"ts_type": "alpha2", "ts_alpha_radius": 2}, "give -ts_alpha_radius, 0 to 1"),
    "alpha2, beta 0.2": ({"ts_type": "alpha2", "ts_alpha_beta": 0.2}, "give -ts_alpha_radius, 0 to 1"),
    "alpha2 of order 1": ({"ts_type": "alpha2", "ts_alpha_gamma": 0.6}, "has order 2 only with gamma"),
    "rosw, lagged Jacobian": ({"ts_type": "rosw", "snes_lag_jacobian": 3}, "option -snes_lag_jacobian: 3"),
    "rosw, Jacobian of the first step": ({"ts_type": "rosw", "snes_lag_jacobian": -2}, "option -snes_lag_jacobian: -2"),
    "rosw, lagged preconditioner": ({"ts_type": "rosw", "snes_lag_preconditioner": 2}, "option -snes_lag_preconditioner: 2"),
    "ksponly, lagged Jacobian": ({"snes_type": "ksponly", "snes_lag_jacobian": 2}, "option -snes_lag_jacobian: 2"),
    "rosw by Newton": ({"ts_type": "rosw", "snes_type": "newtonls"}, "option -snes_type"),
    "rosw, -snes_mf": ({"ts_type": "rosw", "snes_mf": True}, "option -snes_mf:"),
    "rosw, -snes_fd with an explicit stage": ({"ts_type": "rosw", "ts_rosw_type": "ark3", "snes_fd": True}, "option -snes_fd:"),
    "a step below the clock": ({"ts_init_time": 1e9, "ts_max_time": 1.1e9, "ts_dt": 1e-9}, "a step of 1e-09 s is lost in the rounding"),
    "a first step below the clock": ({"ts_init_time": 1, "ts_max_time": 2, "ts_adapt_type": "basic", "bs_step_first": 1e-14},
                                     "a step of 1e-14 s is lost in the rounding"),
    "output times below the clock": ({"ts_init_time": 1, "ts_max_time": 2, "bs_output_interval": 1e-18}, "option -bs_output_interval: 1e-18 s is lost"),
}


def check_clock(checks):
    """A run whose steps become too short for the time it is at ends; one that starts at 1e-5 s and steps by 1e-17 s counts right."""
    late = checks.run({"bs_lattice_type": "chain", "bs_lattice_size": 5, "ts_adapt_type": "basic", "ts_dt": 1, "bs_step_first": 1,
                       "ts_adapt_dt_max": 1e-15, "ts_max_time": 3}, expect=None)
    checks.true("steps that shrink below the clock end the run", late.code == 3 and "a step of 1e-15 s is lost in the rounding of t = " in late.stderr,
                f"exit code {late.code}: {late.stderr.strip().splitlines()[-1:]}")
    o = {**CHAIN, "ts_dt": 1e-17, "ts_init_time": 1e-5, "ts_max_steps": 20, "bs_output_interval": 1e-17, "bs_output": "run.h5md"}
    time = checks.run(o).trajectory.time
    checks.true("20 steps of 1e-17 s at 1e-5 s are 20 frames, each later than the one before", len(time) == 21 and bool((np.diff(time) > 0).all()),
                f"{len(time)} frames, {np.diff(time).min():.3g} to {np.diff(time).max():.3g} s apart")


def check_scale(checks):
    """All forces and masses times a factor: the same motion, also where PETSc's factorisations take small pivots for zero."""
    base = {"bs_lattice_type": "cubic", "bs_lattice_size": "4,4,4", "bs_lattice_perturbation": 0.1, "ts_dt": 0.01, "ts_max_time": 0.03}
    solvers = {"default": {}, "lu": {"pc_type": "lu", "ksp_type": "preonly"}, "gmres, ilu": {"pc_type": "ilu", "ksp_type": "gmres"},
               "gmres, blocks of ilu": {"pc_type": "bjacobi", "ksp_type": "gmres"}, "cholesky": {"condensed_pc_type": "cholesky"},
               "bicc": {"condensed_pc_type": "bicc", "condensed_ksp_type": "cg"}, "rosw": {"ts_type": "rosw", "ts_adapt_type": "none"}}
    for name, solver in solvers.items():
        if checks.ranks > 1 and name in ("lu", "gmres, ilu", "cholesky"):
            continue
        at = {}
        for factor in (1, 1e-20, 1e20):
            o = {**base, **solver, "bs_lattice_particle_mass": 0.7 * factor, "bs_lattice_stiffness": 300 * factor, "snes_rtol": 1e-10, "ksp_rtol": 1e-12}
            at[factor] = checks.run(o, interval=0.03).trajectory.position[-1]
        off = max(np.abs(at[f] - at[1]).max() for f in (1e-20, 1e20))
        checks.below(f"scaled by 1e-20 and 1e20, {name}: positions agree", off, 1e-7, "m")


def main():
    checks = Checks("every subtype of every time-stepping type against its order")
    checks.table = table()
    with tempfile.TemporaryDirectory() as scratch:
        problems = {"driven": Lattice(scratch, True), "still": Lattice(scratch, False), "circuit": Circuit(scratch, True),
                    "still circuit": Circuit(scratch, False)}
        if checks.wants("table"):
            types, here = types_of_petsc(checks), {t for t, _ in checks.table} | set(refused_types())
            checks.true("every type of this PETSc is in the table or refused", bool(types) and types <= here, " ".join(sorted(types - here)) or f"{len(types)} types")
            for kind in ("rosw", "arkimex", "rk", "ssp"):
                names = named_by_petsc(checks, kind)
                more = names - {s for t, s in checks.table if t == kind}
                checks.true(f"{kind}: the table has what PETSc names", names and len(names - more) == sum(t == kind for t, _ in checks.table) and more <= NEWER.get(kind, set()), " ".join(sorted(names)))
                for name in sorted(more):
                    refused(checks, f"{kind} {name}", {**CHAIN, "ts_type": kind, OPTION[kind]: name}, "a subtype this program does not know")
        checks.each([m for m in checks.table if checks.wants(" ".join(m))], lambda c, m: check_method(c, m, problems))
        for radius in [r for r in ALPHAS if checks.wants(f"alpha {r}")]:
            o = {**direct(checks.ranks), "ts_type": "alpha2", "ts_alpha_radius": radius}
            check_order(checks, f"alpha2, radius {radius}, on a driven lattice", problems["driven"], o, STEPS[2], 2)
            check_order(checks, f"alpha2, radius {radius}, one linear solve a step", problems["driven"], {**o, "snes_type": "ksponly"}, STEPS[2], 2)
        checks.each([r for r in REFUSALS if checks.wants("refusals") or (checks.arguments.filter and checks.wants(r))],
                    lambda c, r: refused(c, r, {**CHAIN, **REFUSALS[r][0]}, REFUSALS[r][1]))
        if checks.wants("clock"):
            with checks.group("clock"):
                check_clock(checks)
        if checks.wants("scale"):
            with checks.group("scale"):
                check_scale(checks)
    checks.finish()


if __name__ == "__main__":
    main()
