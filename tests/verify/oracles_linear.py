#!/usr/bin/env python3
"""Linear systems G x + C x' = B u(t): the discrete formulas and closed forms by SciPy, then the reference results.

The built-in part needs no file: formulas stepped by dense solves, the matrix exponential, an LC tank, counted
factorisations, ranks, and every way to give a source or a matrix.
"""
import io
import json
import math
import pathlib
import re
import tempfile

from harness import Checks, observed_orders, read_table
import h5py
import numpy as np
import petsc_files
import scipy.io
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

TYPES = {"be": {"ts_type": "beuler"}, "tr": {"ts_type": "cn"}, "fe": {"ts_type": "euler"},
         "tr_after_one_be_step": {"ts_type": "cn", "bs_linear_be_steps": 1}}
DIGITS = 1e-12  # of the largest entry of a column


class States:
    """(T, n) states, times, (T, k) sources, labels, energy (or None), and the report, of one run."""

    def __init__(self, checks, options, interval=0.0, **keywords):
        options = {"bs_model": "linear", "ts_adapt_type": "none", "bs_output": "states.h5md",
                   "bs_output_interval": interval, **options}
        done = checks.run(options, keep=("states.h5md",), **keywords)
        with h5py.File(io.BytesIO(done.files["states.h5md"])) as f:
            self.value, self.time, self.step = (f["states/" + name][...] for name in ("value", "time", "step"))
            self.sources = f["sources/value"][...] if "sources" in f else None
            self.labels = [v.decode() for v in f["states/labels"][...]] if "labels" in f["states"] else None
            self.energy = f["observables/energy/value"][...] if "observables/energy" in f else None
        self.report, self.stdout, self.stderr = done.report, done.stdout, done.stderr


def write_system(folder, G, C, B, x0=None):
    """Writes G.mtx, C.mtx, B.mtx, x0.csv; returns the options that name them."""
    folder, options = pathlib.Path(folder), {}
    for name, matrix in (("G", G), ("C", C), ("B", B)):
        if matrix is not None:
            scipy.io.mmwrite(folder / f"{name}.mtx", scipy.sparse.coo_matrix(np.atleast_2d(matrix)), precision=17)
            options["bs_linear_" + name] = folder / f"{name}.mtx"
    if x0 is not None:
        (folder / "x0.csv").write_text("\n".join(f"{v:.17g}" for v in x0) + "\n")
        options["bs_linear_x0"] = folder / "x0.csv"
    return options


def relative(ours, theirs):
    """Largest difference, in units of each column's largest entry (of the whole where a column is zero)."""
    scale = np.abs(theirs).max(axis=0)
    scale = np.maximum(scale, 1e-3 * max(np.abs(theirs).max(), 1e-300))
    return float((np.abs(ours - theirs) / scale).max())


# ---- built-in ---------------------------------------------------------------------------------------------------------
def smooth_system():
    """Four states, not symmetric, C not diagonal but regular; one sine source."""
    rng = np.random.default_rng(3)
    C = np.eye(4) + 0.2 * rng.normal(size=(4, 4))
    G = C @ (np.diag([1.0, 2.0, 3.0, 5.0]) + 0.5 * rng.normal(size=(4, 4)))
    return G, C, rng.normal(size=(4, 1)), rng.normal(size=4)


def exact(G, C, B, x0, t, amp, freq, phase):
    """x(t) for u = amp sin(2 pi freq t + phase): the source's own oscillator joins the state of the exponential."""
    n, w = len(x0), 2 * math.pi * freq
    A = np.zeros((n + 2, n + 2))
    A[:n, :n], A[:n, n:n + 1] = -np.linalg.solve(C, G), np.linalg.solve(C, B)
    A[n, n + 1], A[n + 1, n] = w, -w
    start = np.concatenate([x0, [amp * math.sin(phase), amp * math.cos(phase)]])
    return (scipy.linalg.expm(A * t) @ start)[:n]


def check_orders(checks, folder):
    G, C, B, x0 = smooth_system()
    system = {**write_system(folder, G, C, B, x0), "bs_linear_source": "sine(amp=2,freq=0.7,phase=0.4)"}
    truth = exact(G, C, B, x0, 1.0, 2.0, 0.7, 0.4)
    for name, extra, order in (("be", {}, 1), ("tr", {}, 2), ("fe", {}, 1), ("bdf2", {"ts_type": "bdf", "ts_bdf_order": 2}, 2),
                               ("midpoint", {"ts_type": "theta", "ts_theta_theta": 0.5, "ts_theta_endpoint": 0}, 2)):
        steps, errors = [40, 80, 160, 320], []
        for n in steps:
            run = States(checks, {**system, **TYPES.get(name, {}), **extra, "ts_dt": 1.0 / n, "ts_max_time": 1.0})
            errors.append(np.abs(run.value[-1] - truth).max())
        observed = observed_orders([1.0 / n for n in steps], errors)
        checks.near(f"order of {name}", observed[-1], order, 0.05)


def check_jumps(checks, folder):
    """Sources that jump where steps end leave methods of order 2 their order, and algebraic states ring nowhere: x1' = x2 - x1, x2 = u, x1(1) by the integral
    of exp(t - 1) u(t). A run that goes on from a jump takes the same steps."""
    folder = pathlib.Path(folder)
    system = write_system(folder, [[1, -1], [0, 1]], np.diag([1.0, 0]), [[0.0], [1]])
    rise = lambda a, b: np.exp(b - 1) - np.exp(a - 1)
    (folder / "table.csv").write_text("t,u\n0,0\n0.25,2\n0.5,-1\n0.75,3\n2,0\n")
    held = {"bs_linear_source_table": folder / "table.csv", "bs_linear_source_table_kind": "step"}
    sources = {"step": ({"bs_linear_source": "step(1,0.5)"}, rise(0.5, 1), 1), "pulse": ({"bs_linear_source": "pulse(3,0.25,0,0.5)"}, 3 * rise(0.25, 0.75), 0),
               "PULSE of SPICE": ({"bs_linear_source": "PULSE(0 2 0.25 0 0.05 0.2 0.5)"}, None, None),
               "table": (held, 2 * rise(0.25, 0.5) - rise(0.5, 0.75) + 3 * rise(0.75, 1), 3)}
    sources["PULSE of SPICE"] = (sources["PULSE of SPICE"][0], 2 * sum(rise(a, a + 0.2) + falling(a + 0.2, 0.05) for a in (0.25, 0.75)), 0)
    for what, (source, truth, last) in sources.items():
        for name, method in (("tr", TYPES["tr"]), ("bdf2", {"ts_type": "bdf"}), ("theta", {"ts_type": "theta"})):
            steps, errors = [40, 80, 160], []
            for n in steps:
                run = States(checks, {**system, **source, **method, "ts_dt": 1.0 / n, "ts_max_time": 1.0})
                errors.append(abs(run.value[-1, 0] - truth))
            checks.below(f"error of {name}, {what}", errors[-1], 5e-4)
            if min(errors) > 1e-12:
                checks.near(f"order of {name}, {what}", observed_orders([1.0 / n for n in steps], errors)[-1], 2, 0.2)
            checks.near(f"algebraic state of {name}, {what}", run.value[-1, 1], last, 1e-12)
    whole = {**system, **sources["table"][0], **TYPES["tr"], "ts_dt": 0.05, "ts_max_time": 1.0}
    checks.run({"bs_model": "linear", **whole, "ts_max_time": 0.5, "bs_checkpoint": folder / "c.ck", "bs_output": "half.h5md"})
    on = checks.run({"bs_restart": folder / "c.ck", "ts_max_time": 1.0, "bs_output": "on.h5md"}, keep=("on.h5md",))
    with h5py.File(io.BytesIO(on.files["on.h5md"])) as f:
        checks.near("a run that goes on from a jump", f["states/value"][-1], States(checks, whole).value[-1], 0)


def falling(start, duration):
    """Integral of exp(t - 1) (1 - (t - start)/duration) over it."""
    return -np.exp(start - 1) + (np.exp(start + duration - 1) - np.exp(start - 1)) / duration


def check_formulas(checks, folder):
    """cn, beuler and euler are the formulas of the text, step for step, for a singular C too."""
    G, C, B, x0 = smooth_system()
    u = lambda t: 2 * np.sin(2 * np.pi * 0.7 * t + 0.4)
    singular = C.copy()
    singular[3] = 0
    h, n = 0.02, 50
    for name, M in (("tr", C), ("be", C), ("fe", C), ("tr", singular), ("be", singular)):
        system = {**write_system(folder, G, M, B, x0), "bs_linear_source": "sine(2,0.7,0.4)"}
        run = States(checks, {**system, **TYPES[name], "ts_dt": h, "ts_max_time": n * h})
        x, table = x0.copy(), [x0.copy()]
        for k in range(n):
            t0, t1 = k * h, (k + 1) * h
            if name == "tr":
                x = np.linalg.solve(G + 2 * M / h, -(G - 2 * M / h) @ x + B[:, 0] * (u(t0) + u(t1)))
            elif name == "be":
                x = np.linalg.solve(G + M / h, M @ x / h + B[:, 0] * u(t1))
            else:
                x = x + h * np.linalg.solve(M, B[:, 0] * u(t0) - G @ x)
            table.append(x)
        what = f"{name}{' singular C' if M is singular else ''}"
        checks.below(f"formula {what}", relative(run.value, np.array(table)), DIGITS)
        if name == "tr" and M is singular:
            checks.true("inconsistent start is warned about", "violates algebraic row 4" in run.stderr, run.stderr.strip()[:60])


def check_tank(checks, folder):
    """An LC tank: cn keeps its energy over 100 periods, beuler loses it by 1/(1 + (w h)^2) a step."""
    L, C, steps = 1e-3, 1e-6, 40
    period = 2 * math.pi * math.sqrt(L * C)
    h, n = period / steps, 100 * steps
    system = write_system(folder, np.array([[0.0, 1.0], [-1.0, 0.0]]), np.diag([C, L]), None, [1.0, 0.0])
    energy = {}
    for name in ("tr", "be"):
        run = States(checks, {**system, **TYPES[name], "ts_dt": h, "ts_max_time": n * h}, interval=100 * period)
        energy[name] = run.energy[-1] / run.energy[0]
    checks.near("LC tank, trapezoidal: energy after 100 periods", energy["tr"], 1.0, 1e-11)
    factor = (1 + h * h / (L * C)) ** -n
    checks.near("LC tank, backward Euler: log of energy", math.log(energy["be"]), math.log(factor), 1e-9 * abs(math.log(factor)))


def count_in_log(stdout, event):
    found = re.search(rf"^{event}\s+(\d+)", stdout, re.M)
    return int(found.group(1)) if found else 0


def check_factorisations(checks):
    """One for a constant step; one more for the length of the steps that land on output times; as -log_view counts."""
    ladder = {"bs_linear_type": "rc_ladder", "bs_linear_size": 30, "ts_dt": 1e-6, "log_view": True}
    for name, extra, expected in (("constant step", {"ts_max_time": 100e-6}, 1),
                                  ("be_steps 2", {"ts_max_time": 100e-6, "bs_linear_be_steps": 2}, 2),
                                  ("interval 2.5 h", {"ts_max_time": 50e-6, "bs_output_interval": 2.5e-6}, 2),
                                  ("interval 5 h, rounding only", {"ts_max_time": 300e-6, "bs_output_interval": 5e-6}, 1)):
        run = States(checks, {**ladder, **TYPES["tr"], **extra}, extra.get("bs_output_interval", 0.0))
        counted = run.report["matrix_setups"]
        # log_view adds up over ranks and stages: its count is the largest of any rank
        checks.true(f"factorisations, {name}", counted == expected == count_in_log(run.stdout, "MatLUFactorNum"),
                    f"{counted} counted, {count_in_log(run.stdout, 'MatLUFactorNum')} in -log_view, {expected} expected; "
                    f"{run.report['shortened_steps']} of {run.report['steps']} steps shortened")
    run = States(checks, {**ladder, "ts_type": "euler", "ts_dt": 1e-8, "ts_max_time": 1e-6})
    checks.true("factorisations, euler with diagonal C", count_in_log(run.stdout, "MatLUFactorNum") == 0 == run.report["matrix_setups"])
    run = States(checks, {**ladder, "ts_type": "euler", "ts_dt": 1e-5, "ts_max_time": 1e-4}, grows=True)
    checks.true("euler beyond its limit is said, at the start and once it has grown", "beyond the stability limit" in run.stderr and run.report["warnings"] == ["step_limit", "energy_growth"],
                run.stderr.strip()[-90:])


def check_adapted_steps(checks):
    """Steps that are adapted to an error are as long with frames as without, one after each of them, where no interval is given; of one length, 2000 frames are written at most."""
    ladder = {"bs_model": "linear", "bs_linear_type": "rc_ladder", "bs_linear_size": 10, "ts_type": "bdf", "ts_dt": 1e-9, "ts_max_time": 1e-4}
    for adapted, more in ((True, {"ts_adapt_type": "basic", "ts_rtol": 1e-4}), (False, {"ts_adapt_type": "none", "ts_dt": 2e-8})):
        free = checks.run({**ladder, **more}).report
        done = checks.run({**ladder, **more, "bs_output": "states.h5md"}, keep=("states.h5md",))
        with h5py.File(io.BytesIO(done.files["states.h5md"])) as f:
            frames = len(f["states/time"])
        expected = done.report["steps"] + 1 if adapted else 5000 / 3 + 1
        checks.true(f"{'adapted' if adapted else 'equal'} steps with frames", done.report["steps"] == free["steps"] and abs(frames - expected) < 1,
                    f"{done.report['steps']} steps, {free['steps']} without a trajectory, {frames} frames")


def check_explicit_limit(checks):
    """The largest stable step of explicit types on a rod's heat, where C^-1 G = (n + 1)^2 tridiag(-1, 2, -1): z/lambda_max, |R(-z)| = 1."""
    n = 20
    most = 4 * (n + 1) ** 2 * math.sin(n * math.pi / (2 * (n + 1))) ** 2
    for kind, z in (({"ts_type": "euler"}, 2.0), ({"ts_type": "rk", "ts_rk_type": "3bs"}, 2.5127453), ({"ts_type": "rk", "ts_rk_type": "4"}, 2.7852936)):
        for share in (0.98, 1.1):
            run = States(checks, {"bs_linear_type": "heat1d", "bs_linear_size": n, **kind, "ts_dt": share * z / most, "ts_max_time": 20 * z / most}, grows=True)
            said = re.search(r"beyond the stability limit of (.*) on this system, about (\S+) s", run.stderr)
            what = " ".join(map(str, kind.values()))
            checks.true(f"{what}, {share} of its limit: {'warned of' if share > 1 else 'no word'}", bool(said) == (share > 1), run.stderr.strip()[:90])
            if said:
                checks.near(f"{what}: its limit over the exact one", float(said[2]) * most / z, 1, 0.05)


def stability_polynomial(A, b):
    """R(z) = 1 + z b.(I - z A)^-1 1 of a tableau, as coefficients of 1, z, ..."""
    A, b, stage, R = np.array(A, float), np.array(b, float), np.ones(len(b)), [1.0]
    for _ in b:
        R.append(b @ stage)
        stage = A @ stage
    return np.polynomial.Polynomial(R)


BOGACKI = stability_polynomial([[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 3 / 4, 0, 0], [2 / 9, 1 / 3, 4 / 9, 0]], [2 / 9, 1 / 3, 4 / 9, 0])
CLASSIC = stability_polynomial([[0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6])
EXPLICIT = {"euler": ({"ts_type": "euler"}, np.polynomial.Polynomial([1, 1])), "rk 3bs": ({"ts_type": "rk", "ts_rk_type": "3bs"}, BOGACKI),
            "rk 4": ({"ts_type": "rk", "ts_rk_type": "4"}, CLASSIC), "rk 2b": ({"ts_type": "rk", "ts_rk_type": "2b"}, stability_polynomial([[0, 0], [2 / 3, 0]], [1 / 4, 3 / 4]))}


def oscillators():
    """(name, G, C): an LC circuit with a resistance in series, a top's two angles with damping, two coupled circuits one of which is damped hard."""
    inductance, capacity = 1e-3, 1e-6
    for resistance in (5.0, 40.0):
        yield f"RLC circuit, {resistance:g} ohm", np.array([[0.0, 1], [-1, resistance]]), np.diag([capacity, inductance])  # v, i: C v' = -i, L i' = v - R i
    spin, k, d = 30.0, 100.0, 0.8
    yield "gyroscope", np.block([[np.zeros((2, 2)), -np.eye(2)], [k * np.eye(2), np.array([[d, spin], [-spin, d]])]]), np.eye(4)
    yield "a slow damped oscillation beside a fast decay", np.array([[0.0, -1, 0], [4, 0.2, 0], [0, 0, 900]]), np.eye(3)


def check_complex_limit(checks, folder):
    """Complex eigenvalues: the largest step named against NumPy's eigenvalues and the method's polynomial; what runs below and above it do; what is said where no step is stable."""
    for name, G, C in oscillators():
        values = np.linalg.eigvals(-np.linalg.solve(C, G))
        x0 = np.linspace(1, 2, len(G))
        for method, (kind, R) in EXPLICIT.items():
            limit = min(first_exit(R, v) for v in values)
            for share in (0.97, 1.06):
                h = share * limit
                run = States(checks, {**write_system(folder, G, C, None, x0), **kind, "ts_dt": h, "ts_max_time": 400 * h}, grows=True)
                said = re.search(r"beyond the stability limit of (.*) on this system, about (\S+) s", run.stderr)
                step = sum(c * np.linalg.matrix_power(-h * np.linalg.solve(C, G), k) for k, c in enumerate(R.coef))
                exact = np.linalg.matrix_power(step, 400) @ x0
                checks.near(f"{name}, {method}, {share} of its limit: 400 steps of R(h A)", run.value[-1] / np.abs(exact).max(), exact / np.abs(exact).max(), 1e-9)
                radius = np.abs(np.linalg.eigvals(step)).max()
                checks.true(f"{name}, {method}, {share} of its limit: {'warned of' if share > 1 else 'no word'}", bool(said) == (share > 1) == (radius > 1), f"|R| = {radius:.6g}; {run.stderr.strip()[:90]}")
                if said:
                    checks.near(f"{name}, {method}: the limit named", float(said[2]), limit, 6e-3 * limit)
    omega, G = 3.0, np.array([[0.0, -1], [9, 0]])
    system = write_system(folder, G, np.eye(2), None, [1.0, 0])
    for method, h, T, word in (("euler", 0.01, 20, "no step of"), ("rk 2b", 0.2, 50, "no step of"), ("rk 2b", 1e-3, 1, ""), ("rk 4", 0.9 * 8**0.5 / omega, 50, ""),
                               ("rk 4", 1.1 * 8**0.5 / omega, 50, "beyond the stability limit"), ("rk 3bs", 1.1 * 3**0.5 / omega, 50, "beyond the stability limit")):
        kind, R = EXPLICIT[method]
        run = States(checks, {**system, **kind, "ts_dt": h, "ts_max_time": T}, grows=True)
        energy = (run.value**2 @ [9, 1]) / 9
        steps = run.report["steps"]
        whole = round(T / h) if abs(round(T / h) * h - T) < 1e-9 else steps - 1
        k = np.argmin(np.abs(run.time - whole * h))
        checks.near(f"an oscillation without damping, {method}, h = {h:.3g}: energy per step", np.log(energy[k]) / whole, 2 * np.log(abs(R(1j * omega * h))), 1e-9)
        checks.true(f"an oscillation without damping, {method}, h = {h:.3g}: {word or 'no word'}", word in run.stderr and bool(word) == ("the solution will grow" in run.stderr), run.stderr.strip()[:160])
    grows = write_system(folder, np.array([[-1.0]]), np.eye(1), None, [1.0])
    run = States(checks, {**grows, "ts_type": "euler", "ts_dt": 0.01, "ts_max_time": 3}, grows=True)
    checks.true("what grows by itself is not the step's fault", "stability" not in run.stderr and "no step" not in run.stderr, run.stderr.strip()[:90])
    run = States(checks, {**write_system(folder, G, np.eye(2), None, [1.0, 0]), "ts_type": "rk", "ts_rk_type": "3bs", "ts_dt": 1, "ts_max_time": 5, "ts_adapt_type": "basic"}, grows=True)
    checks.true("steps by error control are not judged by the first", "stability limit" not in run.stderr, run.stderr.strip()[:90])


def first_exit(R, value):
    """The first h > 0 at which |R(h value)| = 1: the least positive root of the polynomial |R|^2 - 1 in h."""
    z = np.polynomial.Polynomial([0, value])
    square = R(z) * np.polynomial.Polynomial(np.conj(R(z).coef))
    roots = np.polynomial.Polynomial((square - 1).coef.real[1:]).roots()
    return min(r.real for r in roots if abs(r.imag) < 1e-9 * abs(r) and r.real > 0)


def check_ranks(checks):
    for name, options in (("heat2d", {"bs_linear_type": "heat2d", "bs_linear_size": (17, 11), "ts_dt": 1e-3}),
                          ("rlc, five states", {"bs_linear_type": "rlc", "bs_linear_source": "sine(1,5000)", "ts_dt": 5e-6})):
        for kind in ("tr", "be"):
            runs = [States(checks, {**options, **TYPES[kind], "ts_max_time": 20 * options["ts_dt"]}, ranks=r) for r in (1, 2, 3)]
            off = max(relative(r.value, runs[0].value) for r in runs[1:])
            checks.below(f"ranks 1, 2, 3 agree: {name} {kind}", off, 1e-12)
            same = all(r.labels == runs[0].labels and np.array_equal(r.sources, runs[0].sources) for r in runs)
            checks.true(f"labels and sources on 1, 2, 3 ranks: {name} {kind}", same, str(runs[0].labels[:3]))


def check_sources(checks, folder):
    """u(t) as written to /sources, against closed forms; a state C x' = u in between has nothing to say."""
    folder = pathlib.Path(folder)
    system = write_system(folder, np.eye(1), np.eye(1), np.ones((1, 1)))
    h, n = 0.125, 80
    t = np.arange(n + 1) * h
    (folder / "table.csv").write_text("t,u\n0,1\n2.5,3\n7,-1\n10,0\n")
    forms = {
        "constant(2.5)": 0 * t + 2.5,
        "-1.5": 0 * t - 1.5,
        "step(amp=2)": 0 * t + 2,
        "step(2,1)": np.where(t >= 1, 2.0, 0.0),
        "pulse(amp=5,t0=1,rise=0.5,width=2,fall=1)": 5 * np.interp(t, [1, 1.5, 3.5, 4.5], [0, 1, 1, 0]),
        "pulse(5,1,0,2)": np.where((t >= 1) & (t < 3), 5.0, 0.0),
        "pulse(amp=1,width=1,period=2.5,offset=-1)": np.where(np.mod(t, 2.5) < 1, 0.0, -1.0),
        "sine(2,0.3,0.5,1,1.5)": 1 + 2 * np.sin(2 * np.pi * 0.3 * np.maximum(t - 1.5, 0) + 0.5),
        "exp(v1=1,v2=3,t1=1,tau1=0.5,t2=4,tau2=2)": 1 + 2 * (1 - np.exp(-np.maximum(t - 1, 0) / 0.5))
                                                  - 2 * (1 - np.exp(-np.maximum(t - 4, 0) / 2)),
        "pwl(1,0,2,4,5,-2)": np.interp(t, [1, 2, 5], [0, 4, -2]),
    }
    for text, expected in forms.items():
        run = States(checks, {**system, "bs_linear_source": text, "ts_type": "beuler", "ts_dt": h, "ts_max_time": n * h})
        checks.near(f"source {text}", run.sources[:, 0], expected, 1e-13)
    table = {**system, "bs_linear_source_table": folder / "table.csv", "ts_type": "beuler", "ts_dt": h, "ts_max_time": n * h}
    run = States(checks, table)
    checks.near("source table, linear", run.sources[:, 0], np.interp(t, [0, 2.5, 7, 10], [1, 3, -1, 0]), 1e-13)
    run = States(checks, {**table, "bs_linear_source_table_kind": "step"})
    checks.near("source table, steps", run.sources[:, 0], np.select([t >= 10, t >= 7, t >= 2.5], [0.0, -1.0, 3.0], 1.0), 0)
    two = write_system(folder, np.eye(2), np.eye(2), np.array([[1.0, 2.0], [0.0, -1.0]]))
    run = States(checks, {**two, "bs_linear_source": "step(1); sine(1,0.5)", "ts_type": "beuler", "ts_dt": h, "ts_max_time": 1.0})
    checks.near("two sources", run.sources, np.stack([1 + 0 * t[:9], np.sin(np.pi * t[:9])], axis=1), 1e-13)


def check_formats(checks, folder):
    """The same system from every kind of file; with the operating point."""
    folder = pathlib.Path(folder)
    n = 40
    G = np.diag(np.full(n, 2.0)) - np.diag(np.ones(n - 1), 1) - np.diag(np.ones(n - 1), -1)
    G[0, 0] += 0.5
    C, B, x0 = np.diag(np.linspace(1, 2, n)), np.eye(n)[:, :1], np.sin(np.arange(n))
    times = {"bs_linear_source": "step(1)", **TYPES["tr"], "ts_dt": 0.1, "ts_max_time": 1.0}
    reference = States(checks, {**write_system(folder, G, C, B, x0), **times})
    scipy.io.mmwrite(folder / "S.mtx", scipy.sparse.coo_matrix(G), symmetry="symmetric", precision=17)
    scipy.io.mmwrite(folder / "A.mtx", G, symmetry="general", precision=17)
    scipy.io.mmwrite(folder / "AS.mtx", G, symmetry="symmetric", precision=17)
    scipy.io.mmwrite(folder / "x.mtx", x0[:, None], precision=17)
    for wide in (4, 8):
        petsc_files.write(folder / f"G{wide}.bin", G, wide)
        petsc_files.write(folder / f"x{wide}.bin", x0, wide)
    (folder / "labels.txt").write_text("".join(f"node {k}\n" for k in range(n)))
    for name, files in (("coordinate symmetric", {"G": "S.mtx"}), ("array general", {"G": "A.mtx"}), ("array symmetric", {"G": "AS.mtx"}),
                        ("PETSc binary", {"G": "G4.bin"}), ("PETSc binary of 64-bit indices", {"G": "G8.bin"}), ("x0 Matrix Market", {"x0": "x.mtx"}),
                        ("x0 PETSc binary", {"x0": "x4.bin"}), ("x0 PETSc binary of 64-bit indices", {"x0": "x8.bin"}),
                        ("labels", {"labels": "labels.txt"})):
        options = {**write_system(folder, G, C, B, x0), **times, **{"bs_linear_" + k: folder / v for k, v in files.items()}}
        for ranks in (1, 3):
            run = States(checks, options, ranks=ranks)
            checks.below(f"{name}, {ranks} ranks", relative(run.value, reference.value), 1e-12)
            if name == "labels":
                checks.true("labels reach the file", run.labels == [f"node {k}" for k in range(n)])
    skew = np.array([[0.0, 0, 0], [3, 0, 0], [-1, 2, 0]])
    skew = skew - skew.T
    scipy.io.mmwrite(folder / "K.mtx", scipy.sparse.coo_matrix(skew), symmetry="skew-symmetric", precision=17)
    options = {**write_system(folder, skew, np.eye(3), None, [1, 2, 3]), **TYPES["tr"], "ts_dt": 0.1, "ts_max_time": 1.0}
    a = States(checks, options)
    b = States(checks, {**options, "bs_linear_G": folder / "K.mtx"})
    checks.below("skew-symmetric", relative(b.value, a.value), 1e-13)
    # energy is 1/2 x'C x, and skew G keeps it
    checks.near("energy 1/2 x'C x", a.energy, 0.5 * (a.value ** 2).sum(axis=1), 1e-12)
    options = {**write_system(folder, G, C, B), **times, "bs_linear_dc": True}
    run = States(checks, options)
    checks.below("operating point stays", relative(run.value, np.tile(np.linalg.solve(G, B[:, 0]), (len(run.value), 1))), 1e-12)


def weierstrass(rng, n, index):
    """(G, C) of a regular pencil of that index: P diag(A, I) Q and P diag(I, N) Q, N nilpotent with N^index = 0."""
    m = n // 2
    P, Q = (np.linalg.qr(rng.normal(size=(n, n)))[0] for _ in range(2))
    N = np.zeros((m, m))
    for k in range(index - 1):
        N[k, k + 1] = 1
    G = scipy.linalg.block_diag(np.diag(rng.uniform(1, 3, n - m)), np.eye(m))
    return P @ G @ Q, P @ scipy.linalg.block_diag(np.eye(n - m), N) @ Q


def circuits():
    """name: (G, C, rows that are named, or None where the index is 1)."""
    c, c2, L, L2, g = 1e-6, 3e-7, 1e-3, 2e-3, 1e-2
    return {
        # unknowns v1 iV: source u across a capacitor
        "capacitor across a source": ([[0, 1], [1, 0]], [[c, 0], [0, 0]], "row 2"),
        # v1 v2 iV: source - C1 - C2 - ground
        "loop of capacitors and a source": ([[0, 0, 1], [0, 0, 0], [1, 0, 0]], [[c, -c, 0], [-c, c + c2, 0], [0, 0, 0]], "row 3"),
        # v i1 i2: two inductors meet at a node with nothing else, g v1 elsewhere
        "cut-set of inductors": ([[0, 1, 1], [-1, 0, 0], [-1, 0, 1 / g]], [[0, 0, 0], [0, L, 0], [0, 0, L2]], "row 1"),
        # v i1 i2: the same with a resistor at the node
        "inductors and a resistor at a node": ([[g, 1, 1], [-1, 0, 0], [-1, 0, 1 / g]], [[0, 0, 0], [0, L, 0], [0, 0, L2]], None),
        # v i1 i2: a loop of inductors keeps its current: index 1
        "loop of inductors": ([[g, 1, 1], [-1, 0, 0], [-1, 0, 0]], [[0, 0, 0], [0, L, 0], [0, 0, L2]], None),
        # v1 v2: a capacitor between two resistors to ground: C is singular without an empty row
        "floating capacitor": ([[g, 0], [0, 3 * g]], [[c, -c], [-c, c]], None),
        "floating capacitors, a tiny one": ([[g, 0, 0], [0, g, 0], [0, 0, g]], [[c, -c, 0], [-c, c + 1e-18, -1e-18], [0, -1e-18, 1e-18]], None),
    }


def check_index(checks, folder):
    """Index 2 is warned of, with the row; index 1 is not, whatever C looks like."""
    stepping = {**TYPES["be"], "ts_dt": 1e-5, "ts_max_time": 5e-5, "bs_linear_source": "sine(1,1000)"}
    smooth = {**stepping, "ts_dt": 0.01, "ts_max_time": 0.05}
    for name, (G, C, named) in circuits().items():
        B = np.zeros((len(G), 1))
        B[-1 if named is None else 0 if "cut" in name else len(G) - 1] = 1
        for ranks in (1, 3):
            run = States(checks, {**write_system(folder, np.array(G, float), np.array(C, float), B), **stepping}, ranks=ranks)
            said = "index 2 or more" in run.stderr
            checks.true(f"{name}, {ranks} ranks", said == (named is not None) and (named is None or f"unknowns, {named} (" in run.stderr),
                        run.stderr.strip()[:120])
    rng = np.random.default_rng(7)
    for index in (1, 1, 1, 2, 2, 3):
        G, C = weierstrass(rng, 14, index)
        run = States(checks, {**write_system(folder, G, C, rng.normal(size=(14, 1))), **smooth})
        checks.true(f"random pencil of index {index}", ("index 2 or more" in run.stderr) == (index > 1), run.stderr.strip()[:60])
    # a ladder of 3000 nodes, each tenth with a capacitor: many algebraic rows, index 1; one source across a capacitor makes it 2
    n = 3000
    G = scipy.sparse.diags([np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], (-1, 0, 1)).tolil()
    C = scipy.sparse.diags([(np.arange(n) % 10 == 0).astype(float)], [0]).tolil()
    for name, expected in (("ladder", False), ("ladder with a source across a capacitor", True)):
        if expected:
            G.resize((n + 1, n + 1))
            C.resize((n + 1, n + 1))
            G[n, 50] = G[50, n] = 1
        B = np.zeros((G.shape[0], 1))
        B[-1] = 1
        options = {}
        for key, matrix in (("G", G), ("C", C), ("B", scipy.sparse.coo_matrix(B))):
            scipy.io.mmwrite(pathlib.Path(folder) / f"{key}.mtx", matrix.tocoo(), precision=17)
            options["bs_linear_" + key] = pathlib.Path(folder) / f"{key}.mtx"
        run = States(checks, {**options, **stepping})
        checks.true(f"{name} of {n} nodes", ("index 2 or more" in run.stderr) == expected, run.stderr.strip()[:60])


def check_index_advice(checks, folder):
    """What the warning says of the methods: the current -c u' of a source across a capacitor by beuler and bdf has their order."""
    c, w = 1e-6, 2 * math.pi * 1000
    system = write_system(folder, np.array([[0.0, 1], [1, 0]]), np.diag([c, 0.0]), np.array([[0.0], [1]]))
    for kind, extra, order in (("beuler", {}, 1), ("bdf", {"ts_bdf_order": 2}, 2)):
        steps, errors = [200, 400, 800], []
        for n in steps:
            run = States(checks, {**system, "bs_linear_source": "sine(1,1000)", "ts_type": kind, **extra, "ts_dt": 1e-3 / n, "ts_max_time": 1e-3})
            exact_current = -c * w * np.cos(w * run.time)
            errors.append(np.abs(run.value[10:, 1] - exact_current[10:]).max())
        checks.near(f"order of {kind} in a derivative of the source", observed_orders([1 / n for n in steps], errors)[-1], order, 0.05)


    run = States(checks, {**system, "bs_linear_source": "sine(1,1000)", "ts_type": "cn", "ts_dt": 1e-6, "ts_max_time": 1e-3})
    off = run.value[-2:, 1] + c * w * np.cos(w * run.time[-2:])
    checks.true("cn rings there", abs(off).min() > 0.5 * c * w and off[0] * off[1] < 0 and "cn loses its order in these, or rings" in run.stderr, str(off))


def check_start_words(checks, folder):
    """The warning of an inconsistent start names the method at work, and recommends what is not yet given."""
    folder = pathlib.Path(folder)
    G, C, B, x0 = smooth_system()
    C[3] = 0
    system = {**write_system(folder, G, C, B, x0), "bs_linear_source": "sine(2,0.7,0.4)", "ts_dt": 0.02, "ts_max_time": 0.1}
    for kind, extra, holds, lacks in (("cn", {}, ("cn keeps", "or -bs_linear_be_steps 1"), ()),
                                      ("cn", {"bs_linear_be_steps": 1}, ("by backward Euler, jumps",), ("cn keeps", "be_steps")),
                                      ("beuler", {}, ("the first step jumps",), ("cn", "be_steps")),
                                      ("bdf", {}, ("the first step jumps",), ("cn", "be_steps")),
                                      ("theta", {"ts_theta_theta": 0.5}, ("theta carries", "or -bs_linear_be_steps 1"), ("cn",))):
        run = States(checks, {**system, "ts_type": kind, **extra})
        checks.true(f"inconsistent start, {kind} {extra}", all(w in run.stderr for w in (*holds, "violates algebraic row 4", "-bs_linear_dc"))
                    and not any(re.search(rf"\b{w}\b", run.stderr) for w in lacks), run.stderr.strip()[60:])
    # no row of C is empty: its two rows add up to an algebraic equation; and an empty one beside large numbers elsewhere
    (folder / "cut.cir").write_text("t\nI1 0 a 1\nR1 a 0 1\nR2 b 0 1\nC1 a b 1\n")
    (folder / "stiff.cir").write_text("t\nI1 0 a 1\nR1 a 0 1\nR2 a b 1\nC1 b 0 1\nRs c d 1n\nC2 c 0 1\nC3 d 0 1\n")
    (folder / "stiff.csv").write_text("V(a),0\nV(b),0\nV(c),10\nV(d),10\n")
    times = {"ts_type": "cn", "ts_dt": 0.1, "ts_max_time": 0.5}
    for name, start, rows in (("cut", {"bs_linear_dc": False}, "violates algebraic row 1, with those that cancel its derivatives, by 1"), ("stiff", {"bs_linear_x0": folder / "stiff.csv"}, "violates algebraic row 1 by 1")):
        netlist = {"bs_model": "linear", "bs_netlist": folder / f"{name}.cir", **times}
        run = States(checks, {**netlist, **start})
        checks.true(f"{name}: inconsistent", rows in run.stderr and "or -bs_linear_be_steps 1" in run.stderr, run.stderr.strip())
    run = States(checks, {"bs_model": "linear", "bs_netlist": folder / "cut.cir", **times, "bs_linear_dc": True})
    checks.true("cut: an operating point is consistent", "violates" not in run.stderr, run.stderr.strip())
    run = States(checks, {**system, "bs_linear_x0": None, "bs_linear_dc": True, "ts_type": "cn"})
    checks.true("an operating point is not warned of", "violates" not in run.stderr, run.stderr)


def check_solves(checks, folder):
    """A linear solve that does not solve is refused or rejected; what solves agrees with LU."""
    heat = {"bs_linear_type": "heat2d", "bs_linear_size": (20, 20), "bs_linear_source": "step(1)", "ts_type": "beuler", "ts_dt": 0.01,
            "ts_max_time": 0.2}
    n, size = 20, 1 / 21
    K = scipy.sparse.diags([-np.ones(n - 1), np.full(n, 2.0), -np.ones(n - 1)], (-1, 0, 1))
    A = (scipy.sparse.kron(scipy.sparse.eye(n), K) + scipy.sparse.kron(K, scipy.sparse.eye(n))).tocsc()
    b = np.tile(np.eye(n)[0], n)
    x = np.zeros(n * n)
    for _ in range(20):
        x = scipy.sparse.linalg.spsolve(A + scipy.sparse.eye(n * n, format="csc") * size ** 2 / 0.01, b + x * size ** 2 / 0.01)
    for name, extra, ranks in (("LU", {}, 1), ("matrix-free", {"snes_mf": True}, 1), ("matrix-free, 2 ranks", {"snes_mf": True}, 2),
                               ("gmres and ilu", {"ksp_type": "gmres", "pc_type": "ilu"}, 1),
                               ("matrix-free with the matrix's LU", {"snes_mf_operator": True}, 1)):
        run = States(checks, {**heat, **extra}, ranks=ranks)
        checks.below(f"heat after 20 steps, {name}", relative(run.value[-1:], x[None]), 1e-8)
        if extra.get("snes_mf"):
            checks.true("the header says what solves", "KSP gmres, PC none" in run.stdout)
    for name, extra in (("jacobi alone", {"pc_type": "jacobi"}), ("ilu alone", {"pc_type": "ilu"})):
        for ranks in (1, 2):
            more = {"pc_type": "bjacobi"} if ranks == 2 and "ilu" in name else {}
            done = checks.run({"bs_model": "linear", **heat, "ksp_type": "preonly", **extra, **more}, ranks=ranks, expect=2)
            checks.true(f"{name} is refused, {ranks} ranks", "they do not solve the linear system" in done.stderr and done.stderr.count("backspring: ") == 1,
                        done.stderr.strip())
    few = {"ksp_type": "richardson", "pc_type": "jacobi", "ksp_convergence_test": "skip", "ksp_max_it": 2}
    done = checks.run({"bs_model": "linear", **heat, **few, "bs_step_max_cuts": 2}, expect=3)
    checks.true("two iterations called converged are rejected", "the linear solver left a residual of" in done.stderr
                and done.report["rejected_linear"] == done.report["rejected"] == 3, done.stderr.strip())
    done = checks.run({"bs_model": "linear", **heat, "snes_mf": True, "ksp_type": "preonly", "bs_step_max_cuts": 2}, expect=3)
    checks.true("no solver without a matrix is rejected", "the linear solver left a residual of" in done.stderr, done.stderr.strip())
    mass = write_system(folder, np.eye(3), np.array([[2.0, 1, 0], [1, 3, 1], [0, 1, 4]]), np.ones((3, 1)))
    done = checks.run({"bs_model": "linear", **mass, "bs_linear_source": "step(1)", "ts_type": "euler", "ts_dt": 0.01, "ts_max_time": 0.1,
                       "linear_c_pc_type": "jacobi"}, expect=2)
    checks.true("C by jacobi is refused", "-linear_c_pc_type lu" in done.stderr, done.stderr.strip())


def check_remarks(checks):
    for text, said in (("sine(0,3,200)", True), ("SIN(0 3 200)", False)):
        run = States(checks, {"bs_linear_type": "rlc", "bs_linear_source": text, "ts_dt": 1e-4, "ts_max_time": 5e-4})
        checks.true(f"{text}: amplitude of 0 {'' if said else 'not '}warned of", ("its amplitude is 0" in run.stderr) == said, run.stderr.strip()[:80])
        checks.near(f"{text}: u", run.sources[:, 0], 0 if said else 3 * np.sin(2 * np.pi * 200 * run.time), 1e-13)


def check_builtin(checks):
    for name, check in (("orders", check_orders), ("jumps", check_jumps), ("formulas", check_formulas), ("tank", check_tank), ("complex_limit", check_complex_limit), ("sources", check_sources),
                        ("formats", check_formats), ("index", check_index), ("index_advice", check_index_advice),
                        ("start_words", check_start_words), ("solves", check_solves)):
        if checks.wants(name):
            with checks.group(name), tempfile.TemporaryDirectory() as folder:
                check(checks, folder)
    for name, check in (("factorisations", check_factorisations), ("adapted_steps", check_adapted_steps), ("explicit_limit", check_explicit_limit), ("ranks", check_ranks), ("remarks", check_remarks)):
        if checks.wants(name):
            with checks.group(name):
                check(checks)


# ---- reference results ------------------------------------------------------------------------------------------------
def source_text(p):
    s = p["source"]
    if s["type"] == "zero":
        return "constant(0)"
    return s["type"] + "(" + ",".join(f"{k}={v:.17g}" for k, v in s.items() if k != "type") + ")"


def generator(p):
    """Options of the built-in system of this case, None if there is none."""
    if p["kind"] == "ladder":
        return {"bs_linear_type": "rc_ladder", "bs_linear_size": p["n"], "bs_linear_resistance": p["R0"],
                "bs_linear_capacitance": p["C0"], "bs_linear_vary": p["vary"]}
    if p["kind"] == "heat":
        return {"bs_linear_type": "heat1d", "bs_linear_size": p["n"], "bs_linear_conductivity": p["kappa"]}
    if p["kind"] == "rlc":
        return {"bs_linear_type": "rlc", "bs_linear_resistance": p["R"], "bs_linear_inductance": p["L"], "bs_linear_capacitance": p["Cap"]}
    if p["kind"] == "rc":
        return {"bs_linear_type": "rc_ladder", "bs_linear_size": 1, "bs_linear_resistance": p["R"], "bs_linear_capacitance": p["Cap"]}
    return None


def compare(checks, name, run, table):
    columns = [c for c in table if c not in ("step", "t")]
    rows = table["step"].astype(int)
    theirs = np.stack([table[c] for c in columns], axis=1)
    if rows.max() >= len(run.value):
        checks.true(name, False, f"{len(run.value)} frames, step {rows.max()} wanted")
        return
    checks.below(name, relative(run.value[rows], theirs), DIGITS)


def check_case(checks, folder):
    p = json.loads((folder / "params.json").read_text())
    files = {f"bs_linear_{m}": folder / f"{m}.mtx" for m in "GCB"}
    start = {"bs_linear_x0": folder / "x0.csv"}
    kinds = [("be", "be.csv", p["dt"]), ("tr", "tr.csv", p["dt"]), ("tr_after_one_be_step", "tr_after_one_be_step.csv", p["dt"]),
             ("fe", "fe.csv", p["dt"])]
    if (folder / "fe_small_dt.csv").exists():
        kinds.append(("fe", "fe_small_dt.csv", float(read_table(folder / "fe_small_dt_source.csv")["t"][1])))
    for kind, file, h in kinds:
        if not (folder / file).exists():
            continue
        table = read_table(folder / file)
        options = {**TYPES[kind], "ts_dt": h, "ts_max_time": int(table["step"][-1]) * h}
        sources = {"waveform": {"bs_linear_source": source_text(p)}}
        if kind != "fe":
            sources["table"] = {"bs_linear_source_table": checks.tables / f"{folder.name}.csv"}
            u = read_table(folder / "source.csv")
            sources["table"]["bs_linear_source_table"].write_text(
                "t,u\n" + "".join(f"{t:.17g},{v:.17g}\n" for t, v in zip(u["t"], u["u"])))
        for how, source in sources.items():
            run = States(checks, {**files, **start, **source, **options})
            compare(checks, f"{folder.name} {file} {how}", run, table)
            checks.true(f"{folder.name} {file} is not called of index 2", "index 2" not in run.stderr)
            if how == "waveform" and kind in ("be", "tr") and "fe" not in file:
                check_residual(checks, folder, kind, run)
        numbers = checks.tables / f"{folder.name}_x0.csv"  # the generator names its states otherwise
        numbers.write_text("".join(line.split(",")[1] + "\n" for line in (folder / "x0.csv").read_text().splitlines()[1:]))
        run = States(checks, {**generator(p), "bs_linear_x0": numbers, **sources["waveform"], **options})
        compare(checks, f"{folder.name} {file} generator", run, table)


def check_residual(checks, folder, kind, run):
    """Algebraic rows G x - B u: absolute 1e-14 of the tabulated ones, to rounding in G x."""
    path = folder / f"algebraic_residual_{kind}.csv"
    if not path.exists():
        return
    table = read_table(path)
    G, B = (scipy.io.mmread(folder / f"{m}.mtx").toarray() for m in "GB")
    r = run.value @ G.T - run.sources @ B.T
    for name in table:
        if name.startswith("row"):
            row = int(re.match(r"row(\d+)", name).group(1))
            off = np.abs(r[table["step"].astype(int), row] - table[name]).max()
            checks.below(f"{folder.name} {path.stem} {name}", off, 1e-13)


def main():
    checks = Checks(__doc__.splitlines()[0])
    check_builtin(checks)
    if not checks.have("B_linear"):
        checks.skip("reference results", f"{checks.oracles / 'B_linear'} is absent")
        checks.finish(complete=False)
    with tempfile.TemporaryDirectory() as tables:
        checks.tables = pathlib.Path(tables)
        for folder in sorted((checks.oracles / "B_linear").iterdir()):
            if folder.is_dir() and checks.wants(folder.name):
                with checks.group(folder.name):
                    check_case(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
