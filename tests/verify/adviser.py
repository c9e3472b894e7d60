#!/usr/bin/env python3
"""What the program says at its start of omega_max, the largest explicit step and the motion: against closed forms, and
against eigenvalues SciPy finds of matrices assembled here."""
import pathlib
import re
import subprocess
import tempfile
import threading

from harness import Checks, write_lattice
import h5py
import numpy as np
from program import environment, words as program_words
import scipy.sparse as sparse
import scipy.sparse.linalg as linalg

SAFE = 0.03  # how far the bound may stand above the exact value; it may not fall below it by more than 1e-4


def advice(checks, folder, lattice, grows=False, **options):
    """Closing report of one short run on `lattice`, keywords of write_lattice."""
    path = write_lattice(pathlib.Path(folder) / "lattice.h5", **lattice)
    given = {"bs_lattice_file": path, "ts_dt": 1e-6, "ts_max_steps": 1, "ts_type": "symplectic", **options}
    return checks.run(given, grows=grows)


def stiffness_of(position, mass, pairs, k, fixed):
    """M^-1/2 K M^-1/2 of unstretched springs: the sum of k u u^T over springs, fixed particles left out."""
    n, d = position.shape
    u = position[pairs[:, 0]] - position[pairs[:, 1]]
    u /= np.linalg.norm(u, axis=1)[:, None]
    row = np.repeat(np.arange(len(pairs)), 2 * d)
    column = np.hstack([d * pairs[:, e, None] + np.arange(d) for e in (0, 1)]).ravel()
    stretch = sparse.csc_matrix((np.hstack([u, -u]).ravel(), (row, column)), shape=(len(pairs), d * n))
    free = np.repeat(~np.asarray(fixed, bool), d)
    half = sparse.diags(np.sqrt(k)) @ stretch @ sparse.diags(1 / np.sqrt(np.repeat(mass, d)))
    half = half[:, free]
    return half.T @ half


def within(checks, name, value, exact):
    checks.true(name, (1 - 1e-4) * exact <= value <= (1 + SAFE) * exact, f"{value:.9g} for {exact:.9g}")


def closed_forms(checks, folder):
    k, m = 12.0, 3.0
    pair = dict(position=[[0, 0, 0], [1, 0, 0]], mass=[m, m], pairs=[[0, 1]], stiffness=k, rest_length=1.0)
    report = advice(checks, folder, pair).report
    checks.near("two masses: omega = sqrt(2k/m)", report["omega_max"], np.sqrt(2 * k / m), 1e-5)
    checks.near("two masses: 2/omega", report["largest_explicit_step"], 2 / np.sqrt(2 * k / m), 1e-5)
    report = advice(checks, folder, dict(pair, mass=[m, 7 * m])).report
    checks.near("unequal masses: omega = sqrt(k/m1 + k/m2)", report["omega_max"], np.sqrt(k / m + k / (7 * m)), 1e-5)
    moving = dict(pair, velocity=[[1, 0, 0], [-1, 0, 0]])
    checks.near("motion along the spring has its rate", advice(checks, folder, moving).report["motion_rate"],
                np.sqrt(2 * k / m), 1e-4)
    checks.true("at rest nothing is said of the motion", report["motion_rate"] == 0)
    damped = advice(checks, folder, dict(pair, damping=5.0)).report
    w, c = np.sqrt(2 * k / m), 2 * 5.0 / m
    checks.near("damper: rate 2D/m", damped["damping_rate_max"], c, 1e-5)
    checks.near("damper: (h w)^2 + 2 h c = 4", (damped["largest_explicit_step"] * w) ** 2 + 2 * damped["largest_explicit_step"] * c,
                4.0, 1e-4)
    n = 200
    chain = dict(position=np.arange(n)[:, None] * 0.5, mass=np.full(n, m), stiffness=k, rest_length=0.5,
                 pairs=np.c_[np.arange(n - 1), np.arange(1, n)], fixed=np.arange(n) % (n - 1) == 0)
    exact = 2 * np.sqrt(k / m) * np.sin(np.pi / 2 * (n - 2) / (n - 1))
    within(checks, "chain held at both ends: 2 sqrt(k/m) sin", advice(checks, folder, chain).report["omega_max"], exact)


def threshold(checks, folder):
    """Symplectic Euler is bounded just below the step told and grows just above it; verlet below and above its own."""
    pair = dict(position=[[0, 0], [1.01, 0]], mass=[1.0, 1.0], pairs=[[0, 1]], stiffness=8.0, rest_length=1.0)
    for damping in (0.0, 1.5):
        limit = advice(checks, folder, dict(pair, damping=damping)).report["largest_explicit_step"]
        for factor, stable in ((0.98, True), (1.02, False)):
            h = factor * limit
            done = advice(checks, folder, dict(pair, damping=damping), grows=not stable, ts_dt=h, ts_max_steps=None, ts_max_time=60 * h)
            grown = done.report["last_total_energy"][0] / done.report["first_total_energy"][0]
            checks.true(f"damping {damping}: {factor} of the step told", (grown < 100) == stable, f"energy by {grown:.3g}")
            checks.true(f"damping {damping}: {factor}: hint only above", ("exceeds the stability limit" in done.report["hint"]) != stable)
        w, c = done.report["omega_max"], done.report["damping_rate_max"]
        limit = 2 / (c + np.hypot(c, w))  # (h w)^2 + 4 h c = 4
        for factor, stable in ((0.98, True), (1.02, False)):
            h = factor * limit
            done = advice(checks, folder, dict(pair, damping=damping), grows=not stable, ts_type="verlet", ts_dt=h, ts_max_steps=None, ts_max_time=200 * h)
            grown = done.report["last_total_energy"][0] / done.report["first_total_energy"][0]
            checks.true(f"verlet, damping {damping}: {factor} of its limit", (grown < 100) == stable, f"energy by {grown:.3g}")
            checks.true(f"verlet, damping {damping}: {factor}: hint only above", ("exceeds the stability limit" in done.report["hint"]) != stable)


def lattices(checks, folder):
    rng = np.random.default_rng(5)
    for name, n, d, spread in (("plain cube", 5, 3, 0), ("random masses and springs", 6, 3, 2), ("plane", 15, 2, 1)):
        grid = np.array(np.meshgrid(*[np.arange(n)] * d, indexing="ij")).reshape(d, -1).T.astype(float)
        near = np.linalg.norm(grid[:, None] - grid[None], axis=2)
        pairs = np.argwhere(np.triu((near > 0) & (near < 1.5)))
        mass = 10.0 ** rng.uniform(-spread, 0, len(grid))
        k = 10.0 ** rng.uniform(0, 2 * spread, len(pairs))
        fixed = grid[:, -1] == 0
        exact = np.sqrt(linalg.eigsh(stiffness_of(grid, mass, pairs, k, fixed), k=1, which="LA", return_eigenvectors=False)[0])
        lattice = dict(position=grid, mass=mass, pairs=pairs, stiffness=k, rest_length=near[tuple(pairs.T)], fixed=fixed)
        reports = [advice(checks, folder, lattice, **more).report for more in ({}, {"ts_type": "beuler"})]
        within(checks, name, reports[0]["omega_max"], exact)
        checks.true(f"{name}: Ritz value below", reports[0]["omega_max_ritz"] <= exact * (1 + 1e-4))
        checks.near(f"{name}: the same for implicit types", reports[1]["omega_max"], reports[0]["omega_max"], 1e-12 * exact)
        checks.true(f"{name}: at most 15 evaluations", 2 <= reports[0]["advice_evaluations"] <= 15)
        path = pathlib.Path(folder) / "lattice.h5"
        split = checks.run({"bs_lattice_file": path, "ts_dt": 1e-6, "ts_max_steps": 1, "ts_type": "symplectic"}, ranks=3).report
        checks.near(f"{name}: 3 ranks", split["omega_max"] / exact, reports[0]["omega_max"] / exact, 1e-6)


def words(checks, folder):
    cube = {"bs_lattice_type": "cubic", "bs_lattice_size": (6, 6, 6), "bs_lattice_fixed": "zmin", "bs_gravity": (0, 0, -9.81),
            "bs_lattice_stiffness": 1e4, "bs_lattice_velocity_gradient": (0, 0, 1, 0, 0, 0, 0, 0, 0), "ts_max_steps": 1}
    said = checks.run({**cube, "ts_dt": 0.01}).stdout
    checks.true("short implicit step: explicit is cheaper", "hint: 2 steps of -ts_type symplectic" in said, said[-300:])
    said = checks.run({**cube, "ts_dt": 10.0, "bs_gravity": None}).stdout
    checks.true("long implicit step: accuracy", "long for resolving the motion" in said and "steps of -ts_type" not in said)
    said = checks.run({**cube, "ts_dt": 1e-3}).stdout
    checks.true("step within the limit", "hint: -ts_type symplectic is stable at this step" in said)
    said = checks.run({**cube, "ts_dt": 0.01, "ts_type": "euler"}).stdout
    checks.true("euler without damping", "amplifies undamped oscillations at any step" in said)
    said = checks.run({**cube, "ts_dt": 0.01, "ts_type": "bdf"}).stdout
    checks.true("steps that adapt: no hint", "omega_max" in said and "hint" not in said)
    said = checks.run({**cube, "ts_dt": 0.01, "ts_type": "bdf", "ts_adapt_type": "none"}).stdout
    checks.true("bdf at a fixed step: explicit is cheaper, accuracy will do", "hint: 2 steps" in said and "long for" not in said)
    quiet = checks.run({**cube, "ts_dt": 0.01, "bs_advise": 0})
    checks.true("-bs_advise 0", "omega_max" not in quiet.stdout and "omega_max" not in quiet.report)
    drop = checks.run({"bs_lattice_type": "chain", "bs_lattice_size": 1, "bs_gravity": (-9.81,), "bs_lattice_dim": 1,
                       "ts_max_steps": 1})
    checks.true("a falling particle: nothing to say", "omega_max" not in drop.stdout and "hint" not in drop.stdout)
    heat = checks.run({"bs_model": "linear", "bs_linear_type": "heat1d", "bs_linear_size": 20, "ts_max_steps": 1})
    checks.true("a linear system: nothing to say", "omega_max" not in heat.stdout and "hint" not in heat.stdout)


def cost(checks, folder):
    """A run by implicit steps that explicit ones would do many times faster says so once it has taken some seconds, on its way; one whose steps are long
    does not. How fast the machine is does not matter: the run goes on until it has said it."""
    cube = {"bs_lattice_type": "cubic", "bs_lattice_size": (14, 14, 14), "bs_lattice_fixed": "zmin", "bs_gravity": (0, 0, -9.81), "bs_lattice_stiffness": 1e4,
            "ts_max_time": 1e9, "ts_max_steps": 100000, "bs_progress_interval": -1}
    for name, h, expected in (("short steps", 0.005, True), ("long steps", 50.0, False)):
        command = ["mpirun", "-n", "2", checks.program, *program_words({**cube, "ts_dt": h})]
        run = subprocess.Popen(command, cwd=folder, env=environment(2), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        threading.Timer(120 if expected else 15, run.terminate).start()
        said = []
        for line in run.stdout:
            said.append(line)
            if "explicit steps would cost less" in line:
                run.terminate()
        run.wait()
        found = [re.search(r"(\d+) steps? to t = (\S+) s took (\S+) s, for which -ts_type symplectic -ts_dt (\S+) would take about (\S+) s", line) for line in said]
        found = [one for one in found if one]
        checks.true(f"{name}: {'said once' if expected else 'nothing said'}", len(found) == expected, "".join(said)[-600:])
        for one in found:
            steps, t, took, step, other = map(float, one.groups())
            checks.near(f"{name}: the time reached", t, steps * h, 1e-9 * t)
            checks.true(f"{name}: much longer", took >= 5 and took >= 2 * other > 0, one.group())
            checks.true(f"{name}: a step that is stable", 0 < step < 2 / np.sqrt(1e4), one.group())  # masses of 1 kg, six springs each: omega_max^2 above k/m


def trajectory(checks, folder):
    path = pathlib.Path(folder) / "advice.h5md"
    for ranks in (1, 2):
        report = checks.run({"bs_lattice_type": "chain", "bs_lattice_size": 5, "ts_max_steps": 1, "bs_output": path,
                             "bs_overwrite": True}, ranks=ranks).report
        with h5py.File(path, "r") as f:
            for name in ("omega_max", "h_omega_max", "damping_rate_max", "motion_rate", "largest_explicit_step"):
                checks.true(f"{name} in the trajectory, {ranks} rank(s)", f[f"backspring/advice/{name}"][0] == report[name])


def main():
    checks = Checks("adviser: fastest oscillation, stable step, hints")
    with tempfile.TemporaryDirectory() as folder:
        for group in (closed_forms, threshold, lattices, words, cost, trajectory):
            if checks.wants(group.__name__):
                with checks.group(group.__name__):
                    group(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
