#!/usr/bin/env python3
"""Hard cases (tests/bench/hard_problems.py) on the program's own options at steps up to 0.02 s or 300 times the explicit limit: they end, within a
stated number of rejected attempts and Newton iterations; momentum is kept, no energy comes from nowhere; ranks agree; a linear solve
that fails costs a shorter step, not the run; sheets that fold go through whole steps, to solutions of the step's equation."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bench"))
import h5py
import numpy as np
from harness import run_parts
import hard_problems

# The step in explicit ones (0.02 s at most), steps of a run; bounds on attempts rejected in it and on Newton iterations a step, those of rejected
# attempts included: with a margin over what it takes, since the way through a fold depends on rounding.
BOUNDS = {"folding cloth": (30, 1, 0, 60), "shell": (300, 2, 0, 40), "twisted cloth": (300, 2, 1, 100), "pressed column": (300, 3, 1, 60), "random net": (20, 1, 1, 100),
          "B2": (300, 4, 0, 12), "pulled chain": (300, 20, 0, 8)}
UNIQUE = ("B2", "pulled chain")  # the others buckle: where to is decided by rounding


def small_cases(folder):
    for make in hard_problems.CASES:
        file = folder / f"{make.__name__}.h5"
        yield make(file, False, level=3) if make is hard_problems.shell else make(file, False)


def explicit_limit(checks, case):
    """Of symplectic Euler [s], as the program estimates it."""
    return checks.run(dict(case.options, ts_type="symplectic", ts_dt=1e-9, ts_max_time=1e-9), ranks=1).report["largest_explicit_step"]


def conserved(checks, name, case, trajectory):
    """Momentum against the largest sum of m |v|; energy against the largest kinetic and elastic energy."""
    o = {key: value.reshape(len(value), -1) for key, value in trajectory.observables.items()}
    speeds = (trajectory.mass[:, None] * np.linalg.norm(trajectory.velocity, axis=2).T).sum(axis=0)
    if case.free:
        checks.below(f"{name}: momentum", np.abs(o["momentum"] - o["momentum"][0]).max() / speeds.max(), 1e-9)
    if not case.driven:
        motion = np.abs(o["kinetic_energy"] + o["elastic_energy"]).max()
        checks.below(f"{name}: energy gained", (o["total_energy"][1:].max() - o["total_energy"][0, 0]) / motion, 1e-9)


def one_case(checks, case):
    multiple, steps, rejected, newton = BOUNDS[case.name]
    limit = explicit_limit(checks, case)
    h = min(hard_problems.step(limit), multiple * limit)
    given = dict(case.options, ts_type="beuler", ts_dt=h, ts_max_time=steps * h, bs_advise=False)
    runs = {}
    for ranks in (1, 2):
        name = f"{case.name}, {ranks} rank(s)"
        runs[ranks] = r = checks.run(given, ranks=ranks, interval=h)
        checks.true(f"{name}: ends ok", r.report["outcome"] == "ok", f"{r.report['steps']} steps of {h:.3g} s")
        checks.below(f"{name}: rejected attempts", r.report["rejected"], rejected)
        checks.below(f"{name}: Newton iterations a step", r.report["newton"] / r.report["steps"], newton)
        conserved(checks, name, case, r.trajectory)
        if case.name not in UNIQUE:
            break
    if case.name in UNIQUE:
        a, b = (runs[ranks].trajectory for ranks in (1, 2))
        moved = np.abs(a.position[-1] - a.position[0]).max()
        checks.below(f"{case.name}: the same on 1 and 2 ranks", np.abs(a.position[-1] - b.position[-1]).max() / moved, 1e-5)


def hard(checks, folder):
    for case in small_cases(folder):
        with checks.group(case.name):
            one_case(checks, case)


def failed_solve(checks, folder):
    """A pressed column on which the linear system of a long step takes more iterations than are allowed, that of a shorter one
    does not: the run goes on with shorter steps. rosw keeps its Jacobian over the stages of a step, and must not keep that of a failed
    one."""
    case = hard_problems.column(folder / "pressed.h5", False)
    for name, options in (("alpha2", {"ts_type": "alpha2"}), ("rosw", {"ts_type": "rosw"})):
        with checks.group(name):
            given = dict(case.options, **options, ts_adapt_type="none", ts_dt=0.005, ts_max_time=0.005, bs_advise=False, condensed_pc_type="bicc",
                         condensed_ksp_max_it=10, condensed_fallback_ksp_max_it=10)
            r = checks.run(given, interval=0.005)
            checks.true(f"{name}: solves failed", r.report["rejected_linear"] > 0, f"{r.report['rejected_linear']} of them")
            checks.true(f"{name}: the run went on", r.report["outcome"] == "ok", f"{r.report['steps']} steps, {r.report['krylov']} linear iterations")
            checks.true(f"{name}: in its steps, to the end", abs(np.sum(r.trajectory.log["dt"]) - 0.005) < 1e-12)


def left_of_step(file, t, theta=1):
    """The largest M (v - v_n)/h - theta f(x, v) - (1 - theta) f(x_n, v_n) of a particle that is not held, of each frame but the first, against the largest
    force of a spring, in NumPy: Hooke's springs, axial dampers, gravity. h is the time between frames."""
    with h5py.File(file) as f:
        ends, k, damping, rest = (f["springs/" + name][...] for name in ("pairs", "stiffness", "damping", "rest_length"))
        fixed, mass = f["particles/fixed"][...] != 0, f["particles/mass"][...]
    pulls, forces = [], []
    for x, v in zip(t.position, t.velocity):
        d, w = (a[ends[:, 0]] - a[ends[:, 1]] for a in (x, v))
        length = np.linalg.norm(d, axis=1)
        pulls.append(k * (length - rest) + damping * (d * w).sum(axis=1) / length)
        f = mass[:, None] * [0, 0, -9.81]
        np.add.at(f, ends[:, 0], -(pulls[-1] / length)[:, None] * d)
        np.add.at(f, ends[:, 1], (pulls[-1] / length)[:, None] * d)
        forces.append(f)
    h, worst = t.time[1] - t.time[0], 0
    for n in range(len(forces) - 1):
        left = mass[:, None] * (t.velocity[n + 1] - t.velocity[n]) / h - theta * forces[n + 1] - (1 - theta) * forces[n]
        worst = max(worst, np.abs(left[~fixed]).max())
    return worst / max(np.abs(p).max() for p in pulls[1:])


def folding(checks, folder):
    """Sheets that fold: no step of 0.02 s, about a hundred explicit ones, is cut; what each ends at solves backward Euler's equations, whatever
    minimum it is."""
    for make, steps in ((hard_problems.twisted_cloth, 3), (hard_problems.folding_cloth, 2)):
        case = make(folder / f"{make.__name__}_folding.h5", False)
        given = dict(case.options, ts_type="beuler", ts_dt=0.02, ts_max_time=steps * 0.02, bs_advise=False)
        for ranks in (1, 2):
            name = f"{case.name}, {ranks} rank(s)"
            r = checks.run(given, ranks=ranks, interval=0.02)
            checks.true(f"{name}: whole steps", r.report["outcome"] == "ok" and r.report["steps"] == steps and r.report["rejected"] == 0,
                        f"{r.report['rejected']} attempts rejected, {r.report['newton']} Newton iterations")
            checks.true(f"{name}: through negative curvature", r.report["indefinite"] > 0, f"{r.report['indefinite']} tangents")
            checks.below(f"{name}: left of the step's equation, of the largest tension", left_of_step(case.options["bs_lattice_file"], r.trajectory), 1e-6)
            conserved(checks, name, case, r.trajectory)


def guesses(checks, folder):
    """Newton's first iterates by sub-steps: fewer iterations where sheets fold, to solutions of the step's equation; nothing changes where nothing folds.
    Rounding decides where to a sheet folds: iterations are counted over several starts that differ by as much."""
    for make, type_of, steps, starts, fewer in ((hard_problems.twisted_cloth, "beuler", 12, 1, 0.85), (hard_problems.folding_cloth, "beuler", 8, 2, 0.9),
                                                (hard_problems.twisted_cloth, "cn", 3, 1, None)):
        case = make(folder / f"{make.__name__}_guesses.h5", False)
        given = dict(case.options, ts_type=type_of, ts_dt=0.02, ts_max_time=steps * 0.02, bs_advise=False)
        runs = {}
        for guess in ("extrapolate", "auto"):
            gravities = [tuple(g * (1 + 1e-13 * k) for g in case.options["bs_gravity"]) for k in range(starts)]
            runs[guess] = [checks.run(dict(given, bs_guess=guess, bs_gravity=g), ranks=1, interval=0.02) for g in gravities]
            name, r = f"{case.name}, {type_of}, {guess}", runs[guess][0]
            checks.true(f"{name}: sub-steps", (r.report["guess_substeps"] > 0) == (guess == "auto"), f"{r.report['guess_substeps']}")
            if r.report["steps"] == steps:
                checks.below(f"{name}: left of the step's equation, of the largest tension",
                             left_of_step(case.options["bs_lattice_file"], r.trajectory, 0.5 if type_of == "cn" else 1), 1e-6)
        for count in ("newton", "krylov") if fewer else ():
            now, before = (sum(r.report[count] for r in runs[guess]) for guess in ("auto", "extrapolate"))
            checks.below(f"{case.name}: {count}, of that without", now / before, fewer)
    case = hard_problems.pulled_chain(folder / "chain_guesses.h5", False)
    given = dict(case.options, ts_type="beuler", ts_dt=0.002, ts_max_time=0.02, bs_advise=False)
    one, other = (checks.run(dict(given, bs_guess=guess), ranks=1, interval=0.002) for guess in ("extrapolate", "auto"))
    checks.true(f"{case.name}: nothing folds", other.report["indefinite"] == 0 and other.report["guess_substeps"] == 0)
    checks.near(f"{case.name}: the same bits", one.trajectory.position, other.trajectory.position, 0)


if __name__ == "__main__":
    run_parts(__doc__, (hard, folding, guesses, failed_solve))
