#!/usr/bin/env python3
"""What a run went through and its last line must say, whatever the task: each warning is printed once, counted in the last line, named in the report and kept by
checkpoints; a run without any has none of these."""
import re

from harness import REPO, run_parts, write_lattice
import numpy as np


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


# pressed beyond its load, and without any cause to bend
COLUMN = {"bs_lattice_type": "chain", "bs_lattice_size": 2, "bs_lattice_dim": 2, "bs_lattice_stiffness": 3, "bs_lattice_fixed": "xmin", "bs_group_top": "xmax", "bs_force_top": "-0.5,0",
          "bs_load_steps": 1, "bs_equilibria": "any"}


def modes(checks, folder):
    """A chain under pressure that is free to buckle; as many modes as there are, and more."""
    at = np.arange(4)
    path = write_lattice(folder / "pressed.h5", np.stack([0.9 * at, 0 * at], 1), 1.0, fixed=(at == 0) | (at == 3), pairs=np.stack([at[:-1], at[1:]], 1), stiffness=1.0, rest_length=1.0)
    for count, keys in ((2, ("unstable",)), (9, ("fewer_modes", "unstable")), (None, ("unstable",))):
        run = checks.run({"bs_task": "modes", "bs_lattice_file": path, "bs_modes": count})
        checks.true("modes without a number: nobody asked for more" if count is None else f"{count} modes", told(run, *keys), run.stdout.splitlines()[-1])
    run = checks.run({"bs_task": "modes", "bs_modes_about": "equilibrium", "bs_modes": 2, **COLUMN})
    checks.true("what is met on the way to the equilibrium is told by the modes about it", told(run, "unstable_equilibria", "unstable"), f"{run.report['warnings']}, {run.stderr}")


CHAIN = {"bs_lattice_type": "chain", "bs_lattice_size": 4, "bs_lattice_fixed": "xmin", "ts_dt": 0.1, "ts_max_time": 0.3}


def components(checks, folder):
    """Vectors of fewer numbers than dimensions: -9.81 in the plane is along x, which is hardly meant. All of them, those of no effect, and one on a line are taken as they are."""
    sphere = {"bs_radius": 0.1, "bs_sphere_drag": True, "bs_sphere_drag_rho": 1, "bs_sphere_drag_mu": 1}
    anchor = {"bs_group_a": "xmax", "bs_anchor_group": "a", "bs_anchor_stiffness": 1}
    said = {1: "1 number in 2 dimensions: the others are 0, as in (9, 0)", 2: "2 numbers in 3 dimensions: the others are 0, as in (9, 9, 0)"}
    for option, more in (("bs_gravity", {}), ("bs_fluid_velocity", sphere), ("bs_central_point", {"bs_central_G": 1, "bs_central_M0": 1}), ("bs_xsp_attraction_center", {"bs_xsp_attraction": 1}),
                         ("bs_central_point_moon", {"bs_central_G": 1, "bs_central_M0_moon": 1}), ("bs_anchor_velocity", {**anchor, "bs_anchor_motion": "velocity"}),
                         ("bs_anchor_amplitude", {**anchor, "bs_anchor_motion": "sinusoid", "bs_anchor_frequency": 1})):
        for dim, given in ((2, 1), (3, 2), (1, 1), (2, 2), (3, 3)):
            run = checks.run({**CHAIN, **more, "bs_lattice_dim": dim, option: ",".join(given * ["9"])})
            few = given < dim
            checks.true(f"{option}, {given} in {dim}", told(run, "few_components") and f"option -{option} has {said[given]}" in run.stderr if few else told(run), run.stderr.strip())
    checks.true("none of any effect", told(checks.run({**CHAIN, "bs_lattice_dim": 3, "bs_gravity": 0})))
    run = checks.run({**COLUMN, "bs_task": "statics", "bs_force_top": None, "bs_gravity": 0.1})
    checks.true("in statics", told(run, "few_components"), run.stderr.strip())


def inputs(checks, folder):
    """What is said of options and input, before the run and by every part of the program, is counted as what the run met is."""
    bare = write_lattice(folder / "l.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=1.0, particle_columns={"colour": [1.0, 2.0]})
    heat = {"bs_model": "linear", "bs_linear_type": "heat1d", "bs_linear_size": 4, "ts_dt": 1e-3, "ts_max_time": 3e-3}
    (folder / "tran.cir").write_text("t\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.tran 1u 1m\n")
    (folder / "jump.cir").write_text("t\nV1 a 0 PULSE(0 5 0 0 0 0.5m 2m)\nR1 a b 1k\nC1 b 0 1u\n")
    (folder / "loop.cir").write_text("t\nV1 a 0 SIN(0 1 1k)\nC1 a 0 1u\nR1 a 0 1k\n")
    circuit = {"bs_model": "linear", "ts_dt": 1e-6, "ts_max_time": 3e-6}
    for name, options, keys in (("an option that nothing reads", {**CHAIN, "ksp_tpye": "cg"}, ("unused_options",)),
                                ("frames closer than the step", {**CHAIN, "bs_output": "r.h5md", "bs_output_interval": 0.05}, ("short_interval",)),
                                ("a parameter of no spring", {**CHAIN, "bs_spring_yield_force": 1}, ("ignored_options",)), ("the file has its own", {"bs_lattice_file": bare, "bs_lattice_spacing": 2, "ts_max_time": 0.01}, ("ignored_options", "ignored_input")),
                                ("a dataset that is none", {"bs_lattice_file": bare, "ts_max_time": 0.01}, ("ignored_input",)), ("a column of statics", {**COLUMN, "bs_task": "statics", "ksp_tpye": "cg"}, ("unused_options", "unstable_equilibria")),
                                ("springs that have yielded", {**CHAIN, "bs_spring_law": "plastic", "bs_spring_yield_force": 0.1, "bs_lattice_stiffness": 10, "bs_lattice_rest_length_factor": 0.9}, ("yielded_at_start",)),
                                ("dashpots beside adapted steps", {**CHAIN, "bs_spring_law": "maxwell", "bs_spring_relaxation_time": 1, "bs_gravity": 1, "ts_type": "bdf", "ts_adapt_type": "basic"}, ("maxwell_steps",)),
                                ("a sidecar that has no name", {**CHAIN, "bs_lattice_dim": 2, "bs_output": "\udcff.h5md"}, ("no_xdmf",)), ("a source of nothing", {**heat, "bs_linear_source": "sine(0,1)"}, ("waveform",)),
                                ("a step beyond its limit", {**heat, "bs_linear_source": "step(1)", "ts_type": "euler", "ts_dt": 1, "ts_max_time": 4}, ("step_limit", "energy_growth")),
                                (".tran", {**circuit, "bs_netlist": folder / "tran.cir"}, ("netlist",)), ("a jump", {**circuit, "bs_netlist": folder / "jump.cir", "ts_type": "cn"}, ("jump_at_start",)),
                                ("a loop of capacitors", {**circuit, "bs_netlist": folder / "loop.cir"}, ("higher_index",))):
        run = checks.run(options, grows=True)
        checks.true(name, told(run, *keys), f"{run.report['warnings']} {run.stderr.strip()}")
    run = checks.run({**CHAIN, "ksp_type": "gmres", "pc_type": "ilu"}, ranks=2)
    checks.true("a factorisation on every rank of two", told(run, "block_jacobi"), f"{run.report['warnings']} {run.stderr.strip()}")
    run = checks.run({"bs_task": "generate", "bs_output": "l.h5", **CHAIN})
    checks.true("options that a lattice file does not keep", told(run, "unused_options"), f"{run.report.get('warnings')} {run.stdout.splitlines()[-1]}")


def continued(checks, folder):
    """What a continued run says of itself is counted, beside what the part before it had said, which is not said again."""
    saved = folder / "c"
    checks.run({**CHAIN, "bs_lattice_dim": 2, "bs_gravity": 0.1, "bs_spring_yield_force": 1, "bs_checkpoint": saved, "bs_write_matrices": folder / "m"})
    for name, more, keys in (("as it was", {}, ("few_components", "ignored_options", "options_left_out")), ("with another type", {"ts_type": "cn"}, ("continued_otherwise",)), ("with an option of nothing", {"ksp_tpye": "cg"}, ("unused_options",))):
        run = checks.run({"bs_restart": saved, "ts_max_time": 0.4, **more})
        last = run.stdout.strip().splitlines()[-1]
        checks.true(name, set(keys) <= set(run.report["warnings"]) and last.endswith(f" warnings={len(run.report['warnings'])}"), f"{run.report['warnings']} {run.stderr.strip()}")


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


def documented(checks, folder):
    """src/tasks/README.md has a row for every name that the sources give a warning, and for no other."""
    given = set()
    for path in sorted((REPO / "src").rglob("*.[ch]pp")):
        text = path.read_text()
        for call in re.finditer(r"\b(?:warn|warn_here|warnings(?:_\.|->)add)\(\s*(?:[\w.]+(?:\(\))?,\s*)?(\"\w+\"|[A-Za-z]\w*)\s*,", text):
            word = call[1]
            given.update([word.strip('"')] if '"' in word else re.findall(rf'\b{word}(?:\[\])? = "(\w+)"', text[:call.start()])[-1:])
    page = (REPO / "src/tasks/README.md").read_text()
    table = re.findall(r"^\| (`[^|]*`) \|", page[page.index("## Warnings"):page.index("## Modes")], re.M)
    listed = re.findall(r"`(\w+)`", " ".join(table))
    checks.true("each warning has one row", sorted(listed) == sorted(given) and len(given) > 30, f"{len(given)} names; {sorted(given ^ set(listed))}")


if __name__ == "__main__":
    run_parts("warnings of a run", (cut, early, intervals, tolerances, matrix_free, modes, components, inputs, continued, lists, documented))
