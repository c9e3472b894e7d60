#!/usr/bin/env python3
"""What a run went through and its last line must say, whatever the task: each warning is printed once, counted in the last line, named in the report and kept by
checkpoints; a run without any has none of these."""
import json
import subprocess

from harness import run_parts, write_lattice
import numpy as np
from program import environment, words


def told(run, *keys):
    """Whether the report, the last line and stderr agree on these warnings."""
    last = run.stdout.strip().splitlines()[-1]
    printed = run.stderr.count("backspring: warning: ")
    return run.report["warnings"] == list(keys) and printed == len(keys) and (last.endswith(f" warnings={len(keys)}") if keys else "warnings=" not in last)


# Krylov iterations without a preconditioner do not solve these steps
STIFF = {"bs_lattice_type": "chain", "bs_lattice_size": 20, "bs_lattice_dim": 2, "bs_lattice_spacing": 0.1, "bs_lattice_stiffness": 1e6, "bs_lattice_particle_mass": 0.1,
         "bs_lattice_fixed": "xmin", "bs_gravity": "0,-9.81", "ts_dt": 0.01, "ts_max_time": 0.05}


def cut(checks, folder):
    run = checks.run({**STIFF, "snes_mf": True})
    checks.true("steps cut a hundredfold", told(run, "steps_cut") and run.report["steps"] > 500 and f"{run.report['steps']} were taken where 5 were asked for" in run.stderr,
                run.stdout.splitlines()[-1])
    checks.true("the warning names the option that keeps a preconditioner", "give -snes_mf_operator" in run.stderr, run.stderr.strip())
    failed = checks.run({**STIFF, "snes_mf": True, "bs_step_max_cuts": 2}, expect=3)
    checks.true("so does the error, where it ends the run", "give -snes_mf_operator" in failed.stderr, failed.stderr.strip())
    header = checks.run({**STIFF, "snes_mf": True, "pc_type": "jacobi", "bs_lattice_stiffness": 100}).stdout
    checks.true("the header shows the preconditioner in force, not the one that is asked for in vain", "PC none" in header and "PC jacobi" not in header,
                next(line for line in header.splitlines() if line.startswith("solver")))
    run = checks.run(STIFF)
    checks.true("the same by the default solver", told(run) and run.report["steps"] == 5, run.stdout.splitlines()[-1])
    saved = folder / "c"
    checks.run({**STIFF, "snes_mf": True, "bs_checkpoint": saved, "ts_max_steps": 600})
    run = checks.run({"bs_restart": saved, "ts_max_steps": 5000})
    checks.true("a continued run keeps what it was before", run.report["warnings"] == ["steps_cut"], str(run.report["warnings"]))


def early(checks, folder):
    """-ts_max_steps ends a run before its end, whatever the task."""
    lattice = {"bs_lattice_type": "chain", "bs_lattice_size": 4, "bs_lattice_fixed": "xmin", "bs_gravity": -0.1}
    (folder / "G").write_text("%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 1\n")
    linear = {"bs_model": "linear", "bs_linear_G": folder / "G", "bs_linear_C": folder / "G", "ts_dt": 0.1}
    for name, options in (("dynamics", {**lattice, "ts_dt": 0.01}), ("by an explicit type", {**lattice, "ts_dt": 0.001, "ts_type": "symplectic"}),
                          ("statics", {**lattice, "bs_task": "statics", "bs_load_steps": 10}), ("linear", linear)):
        whole = {} if "bs_task" in options else {"ts_max_time": 10 * options["ts_dt"]}
        run = checks.run({**options, **whole, "ts_max_steps": 5})
        checks.true(f"{name}, ended halfway", told(run, "ended_early") and run.report["outcome"] == "ok", run.stdout.splitlines()[-1])
        run = checks.run({**options, **whole})
        checks.true(f"{name}, to its end", told(run) and run.report["steps"] == 10, run.stdout.splitlines()[-1])


def intervals(checks, folder):
    """Frames that are closer together than the step is long shorten it, which is said; not of equal or longer ones, of steps that adapt, of load steps."""
    base = {"bs_lattice_type": "chain", "bs_lattice_size": 4, "bs_lattice_fixed": "xmin", "bs_gravity": -0.1, "ts_max_time": 4}
    text = "option -bs_output_interval: 0.25 s is shorter than the step of 2 s: steps end at output times, so that they are 0.25 s long"
    run = checks.run({**base, "ts_dt": 2}, interval=0.25)
    checks.true("shorter", text in run.stderr and run.report["steps"] == 16, run.stderr.strip())
    checks.true("shorter: so says the header", "fixed step h = 2 s, cut to 0.25 s by -bs_output_interval" in run.stdout, run.stdout)
    for name, more, interval in (("equal", {"ts_dt": 2}, 2), ("longer", {"ts_dt": 0.5}, 2), ("adapting", {"ts_dt": 2, "ts_type": "bdf", "ts_adapt_type": "basic"}, 0.25),
                                 ("none", {"ts_dt": 2}, 0), ("longer than the run", {"ts_dt": 2, "ts_max_time": 0.5}, 0.5)):
        run = checks.run({**base, **more}, interval=interval)
        checks.true(name, "-bs_output_interval" not in run.stderr and "cut to" not in run.stdout, run.stderr.strip())
    run = checks.run({"bs_task": "statics", **base, "ts_max_time": None, "bs_load_steps": 2}, interval=0.1)
    checks.true("of load steps", "-bs_output_interval" not in run.stderr, run.stderr.strip())


def tolerances(checks, folder):
    """Steps that follow an error estimate, where the whole motion is hardly more than the error they may make; not where it is, nor at rest."""
    base = {"bs_lattice_type": "chain", "bs_lattice_size": 4, "bs_lattice_dim": 1, "bs_lattice_fixed": "xmin", "bs_lattice_stiffness": 40, "ts_dt": 0.01, "ts_max_time": 1}
    small = {**base, "bs_lattice_spacing": 1e-6, "bs_gravity": -1e-5}
    for kind, more in (("bdf", {"ts_adapt_type": "basic"}), ("rk", {}), ("beuler", {"ts_adapt_type": "basic"})):
        steps = {"ts_type": kind, **more}
        run = checks.run({**small, **steps})
        checks.true(f"{kind}: micrometres", told(run, "tolerance_loose") and "give about -ts_atol" in run.stderr, run.stderr.strip())
        run = checks.run({**small, **steps, "ts_atol": 1e-11, "ts_rtol": 1e-6})
        checks.true(f"{kind}: as it says", told(run), run.stderr.strip())
        checks.true(f"{kind}: metres", told(checks.run({**base, **steps, "bs_gravity": -1})))
        checks.true(f"{kind}: at rest", told(checks.run({**base, **steps})))
    run = checks.run({**small, "ts_type": "cn"})
    checks.true("constant steps", told(run), run.stderr.strip())


def matrix_free(checks, folder):
    """A step that is cut since its linear solve has no preconditioner says in the summary what to give, also where the shorter steps go well."""
    run = checks.run({"options_file": "cubic_lattice", "snes_mf": True, "ts_max_steps": 2, "bs_output": None})
    said = [line for line in run.stdout.splitlines() if line.startswith("the last rejection:")]
    checks.true("-snes_mf_operator is named", run.report["rejected_linear"] > 0 and len(said) == 1 and "-snes_mf_operator" in said[0], run.stdout)


def modes(checks, folder):
    """A chain under pressure that is free to buckle; as many modes as there are, and more."""
    at = np.arange(4)
    path = write_lattice(folder / "pressed.h5", np.stack([0.9 * at, 0 * at], 1), 1.0, fixed=(at == 0) | (at == 3), pairs=np.stack([at[:-1], at[1:]], 1), stiffness=1.0, rest_length=1.0)
    for count, keys in ((2, ("unstable",)), (9, ("fewer_modes", "unstable"))):
        run = checks.run({"bs_task": "modes", "bs_lattice_file": path, "bs_modes": count})
        checks.true(f"{count} modes", told(run, *keys), run.stdout.splitlines()[-1])


def lists(checks, folder):
    """Whatever a task lists, its report says what is known to be complete: omega^2, motions without stiffness, equilibria, breaks."""
    net = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_perturbation": 0.05}
    pulled = {**net, "bs_group_t": "ymax", "bs_group_b": "ymin", "bs_motion_b": "fixed", "bs_motion_t": "x=fixed,y=velocity:0.2"}
    box, statics = {**net, "bs_lattice_periodic": "xy"}, {"bs_task": "statics", "bs_load_steps": 3}
    broken = "springs broke, as judged where each step ends"
    for name, options, known, words in (
            ("modes", {**net, "bs_task": "modes", "bs_modes": 4}, {"completeness": "counted"}, "no mode is missing among them"),
            ("modes that cannot be counted", {**net, "bs_task": "modes", "bs_modes": 4, "bs_modes_solver": "iterative", "bs_modes_which": "largest"}, {"completeness": None}, "missing"),
            ("moduli", {**box, "bs_task": "moduli"}, {"zero_modes": 0}, ""),
            ("moduli without a count", {**box, "bs_task": "moduli", "bs_zero_modes_unknowns": 0}, {"zero_modes": -1}, ""),
            ("load steps", {**pulled, **statics}, {"stability_unknown": 0, "snap_through_unknown": 0}, ""),
            ("load steps, no factors", {**pulled, **statics, "condensed_pc_type": "jacobi", "condensed_ksp_type": "cg"}, {"stability_unknown": None}, "stab"),
            ("load steps after a break", {**pulled, **statics, "bs_break_strain": 0.03}, {"snap_through_unknown": None}, "snap-through was not looked for"),
            ("a path by arc length", {**pulled, **statics, "bs_load_control": "arc"}, {"snap_through_unknown": None}, ""),
            ("breaks of statics", {**pulled, **statics, "bs_break_strain": 0.03}, {"broken_springs": None}, broken),
            ("breaks in motion", {**pulled, "ts_dt": 0.01, "ts_max_time": 1, "bs_break_strain": 0.03}, {"broken_springs": None}, broken)):
        for ranks in (1, 3):
            run = checks.run(options, ranks=ranks)
            found = {key: run.report.get(key) for key in known}
            good = all(value is not None and (expected is None or value == expected) for value, expected in zip(found.values(), known.values()))
            checks.true(f"{name}, {ranks} rank(s)", good and words in run.stdout + run.stderr, f"{found}")


if __name__ == "__main__":
    run_parts("warnings of a run", (cut, early, intervals, tolerances, matrix_free, modes, lists))
