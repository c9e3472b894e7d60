#!/usr/bin/env python3
"""Options and option files that cannot be: each must end with exit code 2 and one line that says what to mend.

  bad_options.py --program build/release/backspring [--ranks 2] [--filter WORD] [--jobs 2] [--verbose | --list]

What is asked for is told in corpus.py. Options that PETSc knows and this run does not use are warned of before the first
step. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import os
import pathlib
import subprocess
import sys

import corpus

CHAIN = ("-bs_lattice_type", "chain", "-bs_lattice_size", "5", "-ts_max_steps", "1")
TRIANGLES = ("-bs_lattice_type", "triangular", "-bs_lattice_size", "4,4", "-bs_lattice_periodic", "xy")


def words(*more):
    return lambda folder: [*CHAIN, *more]


def endless(*more):
    """A maker of a run that no number of steps ends."""
    return lambda folder: [*CHAIN[:-2], *more]


def table(folder, *rows):
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    return folder / "table.csv"


def of_statics():
    """Options in the sections of the reference that are of statics alone."""
    reference, title, names = pathlib.Path(__file__).resolve().parents[2] / "options/reference/README.md", "", []
    for line in reference.read_text().splitlines():
        title = line if line.startswith("## ") else title
        if line.startswith("| `-bs_") and ("statics" in title or "moduli" in title):
            names.append(line.split("`")[1])
    return names


def option_file(content, name="o.yaml", *more):
    """A maker of a run whose options stand in a file."""
    def make(folder):
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return ["-options_file", name, *more]
    return make


def option_path(folder):
    (folder / "o.opts").write_text("-ts_dt 1\n")
    return folder / "o.opts"


def restarted(*more, written=()):
    """A maker of a run that goes on from a checkpoint, and where `written` says how with its trajectory."""
    def make(folder):
        first = [*CHAIN, "-bs_checkpoint", "c", *(("-bs_output", "r.h5md", *written) if written else ())]
        program = pathlib.Path(sys.argv[sys.argv.index("--program") + 1]).resolve()
        subprocess.run([str(program), *first], check=True, stdout=subprocess.DEVNULL, cwd=folder)
        return ["-bs_restart", str(folder / "c"), "-ts_max_steps", "2", *more]
    return make


GOOD_YAML = "bs_lattice_type: chain\nbs_lattice_size: 5\nts_max_steps: 1\n"

FILES = {
    "yaml: missing": (words("-options_file", "none.yaml"), "option file none.yaml: no such file"),
    "yaml: a folder": (lambda folder: [(folder / "d.yaml").mkdir(), "-options_file", "d.yaml"][1:], "option file d.yaml: is a folder"),
    "opts: missing": (words("-options_file", "none.opts"), "option file none.opts: no such file"),
    "yaml: two colons": (option_file(GOOD_YAML + "ts_dt: 1: 2\n"), "o.yaml line 4: not valid YAML (mapping values are not allowed"),
    "yaml: bracket left open": (option_file("bs_gravity: [0, -9.81\nts_dt: 1\n"), "o.yaml line 2: not valid YAML"),
    "yaml: tab": (option_file("\tts_dt: 1\n"), "o.yaml line 1: not valid YAML (found character that cannot start any token)"),
    "yaml: quote left open": (option_file('ts_type: "beuler\n'), "o.yaml line 2: not valid YAML"),
    "yaml: a name with its dash": (option_file(GOOD_YAML + "-bs_gravity: [0, -9.81]\n"), "o.yaml line 4: '-bs_gravity': names stand without their dash; write 'bs_gravity: value'"),
    "yaml: a word": (option_file("beuler\n"), "o.yaml line 1: holds no options; write 'name: value'"),
    "yaml: a list": (option_file("- a\n- b\n"), "o.yaml line 1: holds no options"),
    "yaml: list in a list": (option_file("bs_gravity: [[0, 1]]\n"), "o.yaml line 1: a list in a list"),
    "yaml: mapping in a list": (option_file(GOOD_YAML + "bs_gravity:\n  - x: 1\n"), "o.yaml line 5: a list in a list"),
    "yaml: name is a list": (option_file("[a, b]: 1\n"), "o.yaml line 1: a name must be a word"),
    "yaml: aliases without end": (option_file("a: &a {b: 1}\n" + "".join(
        f"x{k}: &x{k} {{p: *{'a' if k == 0 else f'x{k - 1}'}, q: *{'a' if k == 0 else f'x{k - 1}'}}}\n" for k in range(30))),
        "aliases that never end"),
    "yaml: unknown alias": (option_file("a: *nothing\n"), "o.yaml line 1: not valid YAML (found undefined alias)"),
    "yaml: bytes": (option_file(bytes(range(1, 256))), "o.yaml line 1: not valid YAML"),
    "yaml: misspelt option": (option_file(GOOD_YAML + "bs_grvity: 1\n"), "option -bs_grvity does not exist: did you mean -bs_gravity?"),
    "yaml: mapping for a number": (option_file("bs_lattice_type: chain\nbs_lattice_size: {a: 1}\n"), "-bs_lattice_size is missing"),
    "yaml: empty": (option_file(""), "no lattice is given; write -bs_lattice_file"),
    "yaml by name": (lambda folder: [(folder / "y").write_text("a: [\n"), "-options_file_yaml", "y"][1:], "option file y line 2: not valid YAML"),
    "opts: no dash": (option_file("ts_dt 1\n", "o.opts"), "o.opts line 1: ts_dt"),
    "opts: word too many": (option_file("-ts_dt 1 2\n", "o.opts"), "o.opts line 1: extra token 2"),
    "opts: names itself": (option_file("-ts_dt 1\n-options_file o.opts\n", "o.opts"), "option file o.opts line 2: option file o.opts: is already being read"),
    "opts: two that name each other": (lambda folder: [(folder / "a.opts").write_text("-options_file b.opts\n"), *option_file('-options_file "./a.opts"\n', "b.opts")(folder)][1:],
                                       "option file ./a.opts line 1: option file b.opts: is already being read"),
    "opts: names itself by a link": (lambda folder: [(folder / "l.opts").symlink_to("o.opts"), *option_file("-OPTIONS_FILE l.opts\n", "o.opts")(folder)][1:], "option file l.opts: is already being read"),
    "opts: names bad YAML": (lambda folder: [(folder / "y.yaml").write_text("a: [\n"), *option_file("-options_file y.yaml\n", "o.opts")(folder)][1:], "o.opts line 1: option file y.yaml line 2: not valid YAML"),
    "opts: names what is not there": (option_file("\n-options_file none.opts # not there\n", "o.opts"), "option file o.opts line 2: option file none.opts: no such file"),
    "opts: a pipe": (lambda folder: [os.mkfifo(folder / "p.opts"), "-options_file", "p.opts"][1:], "option file p.opts: is a device or a pipe"),
    "opts: a device": (words("-options_file", "/dev/zero"), "option file /dev/zero: is a device or a pipe"),
    "opts: names a device": (option_file("-options_file /dev/zero\n", "o.opts"), "o.opts line 1: option file /dev/zero: is a device or a pipe"),
    "opts: endless": (lambda folder: [os.truncate(option_path(folder), 1 << 40), "-options_file", "o.opts"][1:], "which no options need"),
    "opts: more than PETSc holds": (option_file("".join(f"-x{k} 1\n" for k in range(600)), "o.opts"), "too many options: PETSc holds 512"),
    "yaml: more than PETSc holds": (option_file("".join(f"x{k}: 1\n" for k in range(600))), "too many options: PETSc holds 512"),
    "yaml: names an option file": (option_file("ts_dt: 1\noptions_file: o.opts\n"), "o.yaml line 2: PETSc reads no option file that a YAML file names"),
    "yaml: an option twice": (option_file(GOOD_YAML + "# longer\nbs_lattice_size: 7\n"), "o.yaml line 5: 'bs_lattice_size' stands in line 2 already; write each option once"),
    "yaml: an option twice, in other letters": (option_file(GOOD_YAML + "BS_lattice_size: 7\n"), "o.yaml line 4: 'BS_lattice_size' stands in line 2 already"),
    "yaml: a name twice within two others": (option_file("ts: {max_steps: 1}\nbs:\n  lattice:\n    type: chain\n    size: 5\n    size: 7\n"), "o.yaml line 6: 'size' stands in line 5 already"),
    "yaml: a mapping twice": (option_file("bs:\n  lattice: {type: chain, size: 5}\nbs:\n  stokes_drag: 1\nts_max_steps: 1\n"), "o.yaml line 3: 'bs' stands in line 1 already"),
    "yaml: an option under both its names": (option_file(GOOD_YAML + "ts_dt: 0.1\nts_time_step: 0.1\n"), "options -ts_dt and -ts_time_step are two names of one option: give one of them"),
    "opts: bytes": (option_file(bytes(range(1, 256)) * 3, "o.opts"), "o.opts line"),
}

PROGRAM = {
    "a word without a dash": (words("stray"), "'stray' is neither an option nor the value of one"),
    "a list with a blank": (words("-bs_gravity", "0,", "-9.81"), "'-9.81' is neither an option nor the value of one"),
    "misspelt": (words("-bs_grvity", "1"), "option -bs_grvity does not exist: did you mean -bs_gravity?"),
    "misspelt, far from all": (words("-bs_xyzzy"), "option -bs_xyzzy does not exist: -help lists the options"),
    "misspelt without value": (words("-bs_overwrit"), "did you mean -bs_overwrite?"),
    "no value": (words("-bs_output"), "option -bs_output needs a value"),
    "empty list": (words("-bs_lattice_size", ","), "option -bs_lattice_size: an empty value is not a whole number: give a whole number"),
    "a word for a number": (words("-bs_gravity", "down"), "option -bs_gravity: down is not a number: give a number [m/s^2]"),
    "number and unit": (words("-bs_stokes_drag", "3kg/s"), "3kg/s is not a number: give a number [kg/s]"),
    "not finite": (words("-bs_viscosity", "inf"), "option -bs_viscosity: inf is not finite"),
    "negative": (words("-bs_stokes_drag", "-1"), "option -bs_stokes_drag: -1 is negative: give a number >= 0 [kg/s]"),
    "not positive": (words("-bs_lattice_spacing", "0"), "-bs_lattice_spacing"),
    "a fraction for a count": (words("-bs_step_grow_after", "2.5"), "option -bs_step_grow_after: 2.5 is not a whole number"),
    "too large a count": (words("-bs_step_grow_after", "99999999999999999999"), "is too large: give a whole number"),
    "too many numbers": (words("-bs_gravity", "1,2,3,4"), "1,2,3,4 are 4 numbers: give at most 3"),
    "component beyond the dimension": (words("-bs_gravity", "0,-9.81"), "has a component beyond the lattice's dimension 1"),
    "not among the choices": (words("-bs_partition", "metis"), "option -bs_partition: metis does not exist: give one of"),
    "neither true nor false": (words("-bs_overwrite", "maybe"), "maybe is neither true nor false"),
    "outside 0 to 1": (words("-bs_step_cut", "1"), "option -bs_step_cut: give a number between 0 and 1"),
    "step that is lost at the end": (endless("-ts_dt", "1e-18", "-ts_max_time", "0.2"), "a step of 1e-18 s is lost in the rounding of t = 0.2 s"),
    "steps without end": (endless("-ts_dt", "1e-11", "-ts_max_time", "0.2"), "the run would take 2e+10 steps, more than 2147483647"),
    "interval that is lost at the end": (endless("-ts_dt", "0.1", "-ts_max_time", "0.2", "-bs_output_interval", "1e-20"), "option -bs_output_interval: 1e-20 s is lost in the rounding of t = 0.2 s"),
    "load steps without end": (words("-bs_task", "statics", "-ts_max_steps", "5", "-bs_load_steps", "1000000000"), "option -bs_load_steps: 1000000000: give 100000000 at most"),
    **{f"{name} in dynamics": (words(name, "1"), f"option {name} does not go with this run: it is of -bs_task ") for name in of_statics()},
    "linear option of particles": (words("-bs_linear_G", "g.mtx"), "option -bs_linear_G does not go with this run: it is of -bs_model linear"),
    "loose by a notch": (lambda folder: ["-bs_lattice_type", "square", "-bs_lattice_size", "3,3", "-bs_lattice_fixed", "ymin", "-bs_gravity", "0,-1", "-bs_task", "statics",
                                         "-bs_break_strain", "10", "-bs_break_notch", "-1,0.5,9,0.5"], "nothing holds particle 3 and what is tied to it against its loads"),
    "spared group that is none": (words("-bs_break_strain", "0.1", "-bs_break_spare", "nogroup"), "option -bs_break_spare: there is no group nogroup: choose its particles by -bs_group_nogroup"),
    "negative interval": (words("-bs_output_interval", "-1"), "-bs_output_interval: -1 is negative"),
    "negative flush": (words("-bs_output_flush", "-0.5"), "-bs_output_flush: -0.5 is negative"),
    "flush without a number": (words("-bs_output_flush", "often"), "-bs_output_flush"),
    "output without a name": (words("-bs_output", " "), "option -bs_output: an empty value"),
    "buoyancy in no fluid": (words("-bs_buoyancy", "-bs_gravity", "0,0,-9.81", "-bs_radius", "0.1"), "need the density of the fluid: give -bs_fluid_density"),
    "added mass below 0": (words("-bs_added_mass", "-0.5", "-bs_fluid_density", "1", "-bs_radius", "0.1"), "-bs_added_mass: -0.5 is negative"),
    "added mass of a point": (words("-bs_added_mass", "0.5", "-bs_fluid_density", "1"), "has no radius, which added mass needs: give -bs_radius"),
    "buoyancy without gravity": (words("-bs_buoyancy", "-bs_fluid_density", "1", "-bs_radius", "0.1"), "option -bs_buoyancy needs -bs_gravity"),
    "two densities of a fluid": (words("-bs_added_mass", "0.5", "-bs_fluid_density", "2", "-bs_radius", "0.1", "-bs_sphere_drag", "-bs_sphere_drag_rho", "1", "-bs_sphere_drag_mu", "1"),
                                 "option -bs_sphere_drag_rho: the fluid has a density of 1 kg/m^3 here and of 2 kg/m^3 in another option: give one density"),
    "density of a fluid that does nothing": (words("-bs_fluid_density", "2"), "option -bs_fluid_density is for -bs_buoyancy and -bs_added_mass"),
    "fluid for Stokes drag": (words("-bs_stokes_drag", "1", "-bs_fluid_velocity", "1"), "option -bs_fluid_velocity applies to sphere and shape drag"),
    "fluid beyond the dimension": (words("-bs_lattice_dim", "2", "-bs_sphere_drag", "-bs_sphere_drag_rho", "1", "-bs_sphere_drag_mu", "1", "-bs_radius", "0.1",
                                         "-bs_fluid_velocity", "1,0,5"), "option -bs_fluid_velocity has a component beyond the lattice's dimension 2"),
    "central point beyond the dimension": (words("-bs_lattice_dim", "2", "-bs_central_G", "1", "-bs_central_M0", "1", "-bs_central_point", "9,9,5"),
                                           "option -bs_central_point has a component beyond the lattice's dimension 2"),
    "columns that a continued trajectory has not": (restarted("-bs_output_pad", "3", written=("-bs_output_flush", "0")), "has 1 column per particle, and this run writes 3: leave out -bs_output_pad 3, or give another -bs_output"),
    "fields that a continued run leaves out": (restarted("-bs_output_stress", "false", written=("-bs_output_stress",)), "has /particles/trajectory/stress_volume in every frame, and this run does not write it: leave out -bs_output_stress false"),
    "springs that could not break before": (restarted("-bs_break_strain", "0.1"), "option -bs_break_strain: "),
    "another start of a continued run": (restarted("-ts_init_time", "5"), "option -ts_init_time: a continued run begins at the time of its checkpoint"),
    "output in no folder": (words("-bs_output", "none/o.h5md"), "folder none of -bs_output none/o.h5md does not exist"),
    "report in no folder": (words("-bs_report", "none/r.json"), "folder none of -bs_report none/r.json does not exist"),
    "unknown task": (words("-bs_task", "statistics"), "option -bs_task: statistics does not exist"),
    "statics: time step": (words("-bs_task", "statics", "-ts_dt", "1"), "option -ts_dt does not go with -bs_task statics: load steps are numbered"),
    "statics: TS type": (words("-bs_task", "statics", "-ts_type", "cn"), "option -ts_type does not go with -bs_task statics"),
    "statics: preconditioner": (words("-bs_task", "statics", "-pc_type", "lu"), "choose the linear solver by -condensed_pc_type"),
    "statics: no load steps": (words("-bs_task", "statics", "-bs_load_steps", "0"), "option -bs_load_steps"),
    "statics: end at rest": (words("-bs_task", "statics", "-bs_stop_at_rest", "1e-8"), "option -bs_stop_at_rest does not go with -bs_task statics"),
    "arc length: ends where it begins": (words("-bs_task", "statics", "-bs_load_control", "arc", "-bs_arc_end", "0"), "option -bs_arc_end: the path begins"),
    "arc length: checkpoint": (words("-bs_task", "statics", "-bs_load_control", "arc", "-bs_checkpoint", "c"),
                               "option -bs_checkpoint does not go with -bs_load_control arc"),
    "arc length: unknown control": (words("-bs_task", "statics", "-bs_load_control", "work"), "option -bs_load_control"),
    "rest at any motion": (words("-bs_stop_at_rest", "1"), "option -bs_stop_at_rest: give a number between 0 and 1"),
    "statics: unknown load": (words("-bs_task", "statics", "-bs_load_scale", "gravity,wind"), "option -bs_load_scale: wind is no load"),
    "statics: free and driven": (words("-bs_task", "statics", "-bs_gravity", "1"), "nothing holds particle 0 and what is tied to it against its loads"),
    "stress of a box with held particles": (words("-bs_task", "statics", *TRIANGLES, "-bs_box_stress", "xx=0", "-bs_lattice_fixed", "xmin"),
                                            "option -bs_box_stress: fixed or driven particles do not follow the strain of the box: leave them out"),
    "stress of a box by arc length": (words("-bs_task", "statics", *TRIANGLES, "-bs_box_stress", "xx=0", "-bs_load_control", "arc"),
                                      "option -bs_box_stress does not go with -bs_load_control arc: give the strains by -bs_box_strain"),
    "stress of a box and minima": (words("-bs_task", "statics", *TRIANGLES, "-bs_box_stress", "xx=0", "-bs_equilibria", "minimum"),
                                   "option -bs_equilibria minimum does not go with -bs_box_stress"),
    "statics of a linear system": (lambda folder: ["-bs_task", "statics", "-bs_model", "linear", "-bs_linear_generate", "heat2d"], "linear"),
    "generate: no file": (words("-bs_task", "generate"), "-bs_task generate writes a lattice file: give its name by -bs_output F.h5"),
    "generate: name of a trajectory": (words("-bs_task", "generate", "-bs_output", "l.h5md"), "option -bs_output l.h5md: names of lattice files end in .h5 or .hdf5"),
    "generate: linear system": (lambda folder: ["-bs_task", "generate", "-bs_output", "l.h5", "-bs_model", "linear", "-bs_linear_type", "heat2d"], "-bs_task generate: a linear system has no lattice"),
    "generate: checkpoint": (words("-bs_task", "generate", "-bs_output", "l.h5", "-bs_checkpoint", "c"), "-bs_task generate has no steps to save: leave them out"),
    "generate: misspelt option": (words("-bs_task", "generate", "-bs_output", "l.h5", "-bs_gravty", "1"), "option -bs_gravty does not exist: did you mean -bs_gravity?"),
    "modes of no task": (words("-bs_modes", "3"), "option -bs_modes does not go with this run: it is of -bs_task modes"),
    "no modes": (words("-bs_task", "modes", "-bs_modes", "0"), "option -bs_modes: 0 is not positive"),
    "modes near nothing": (words("-bs_task", "modes", "-bs_modes_which", "target"), "say with -bs_modes_target near which omega^2"),
    "a target of the smallest modes": (words("-bs_task", "modes", "-bs_modes_target", "3"), "option -bs_modes_target: give -bs_modes_which target with it"),
    "modes of circuits": (words("-bs_task", "modes", "-bs_model", "linear", "-bs_linear_type", "rc_ladder", "-bs_linear_size", "3"), "system has no masses"),
    "modes where nothing can move": (words("-bs_task", "modes", "-bs_lattice_fixed_particles", "0,1,2,3,4"), "option -bs_task modes: no particle can move"),
    "modes of all-to-all forces": (words("-bs_task", "modes", "-bs_xsp_center_of_mass", "1"), "option -bs_task modes: forces that couple all particles"),
    "matrices in no folder": (words("-bs_write_matrices", "none/m"), "folder none of -bs_write_matrices none/m_M.mtx does not exist"),
    "matrices of circuits": (lambda folder: ["-bs_write_matrices", "m", "-bs_model", "linear", "-bs_linear_type", "rc_ladder", "-bs_linear_size", "3", "-ts_max_steps", "1"], "system has no forces"),
    "matrices of all-to-all forces": (words("-bs_write_matrices", "m", "-bs_xsp_center_of_mass", "1"), "forces that couple all particles have no sparse matrix"),
    "modes with checkpoints": (words("-bs_task", "modes", "-bs_checkpoint", "c"), "-bs_task modes has no steps to save"),
    "unknown model": (words("-bs_model", "fluid"), "option -bs_model: fluid does not exist"),
}

PETSC = {
    "ts_type unknown": (words("-ts_type", "leapfrog"), "-ts_type leapfrog is not one this program knows: use beuler"),
    "statics: time step under its other name": (words("-bs_task", "statics", "-ts_time_step", "1"), "option -ts_dt does not go with -bs_task statics: load steps are numbered"),
    "ts_dt a word": (words("-ts_dt", "small"), "option -ts_dt: small is not a number"),
    "ts_dt zero": (words("-ts_dt", "0"), "option -ts_dt: 0: give a time step > 0 [s]"),
    "ts_dt negative": (words("-ts_dt", "-0.1"), "option -ts_dt: -0.1: give a time step > 0 [s]"),
    "ts_dt nan": (words("-ts_dt", "nan"), "option -ts_dt: nan"),
    "ts_dt underflows": (words("-ts_dt", "1e-400"), "option -ts_dt: 0: give a time step > 0 [s]"),
    "ts_max_time before the start": (words("-ts_max_time", "-1"), "option -ts_max_time: -1: give a finite time at or after the start"),
    "ts_max_time infinite": (words("-ts_max_time", "inf"), "option -ts_max_time: inf"),
    "ts_init_time after the end": (words("-ts_init_time", "5"), "option -ts_max_time: 1: give a finite time at or after the start, t = 5 s"),
    "ts_max_steps a fraction": (words("-ts_max_steps", "1e3"), "option -ts_max_steps: 1e3 is not a whole number"),
    "ts_max_steps negative": (words("-ts_max_steps", "-5"), "option -ts_max_steps: -5: give a number of steps >= 0"),
    "ts_theta_theta": (words("-ts_type", "theta", "-ts_theta_theta", "7"), "option -ts_theta_theta: 7: give a number above 0"),
    "ts_rk_type unknown": (words("-ts_type", "rk", "-ts_rk_type", "9z"), " for -ts_rk_type. Available options:"),
    "ts_bdf_order": (words("-ts_type", "bdf", "-ts_bdf_order", "9"), "BDF Order 9 not implemented"),
    "ts_adapt_type unknown": (words("-ts_adapt_type", "magic"), 'Unknown TSAdapt type "magic" given'),
    "snes_type unknown": (words("-snes_type", "magic"), "Unable to find requested SNES type magic"),
    "snes_rtol negative": (words("-snes_rtol", "-1"), "option -snes_rtol: -1: give a number >= 0 and below 1"),
    "snes_rtol 1": (words("-snes_rtol", "1"), "option -snes_rtol: 1: give a number >= 0 and below 1"),
    "snes_stol negative": (words("-snes_stol", "-2"), "option -snes_stol: -2: give a number >= 0"),
    "ksp_rtol negative": (words("-ksp_rtol", "-2"), "option -ksp_rtol: -2: give a number >= 0 and below 1"),
    "ksp_atol not a number": (words("-condensed_ksp_atol", "nan"), "option -condensed_ksp_atol: nan: give a number >= 0"),
    "ts_atol negative": (words("-ts_atol", "-1"), "option -ts_atol: -1: give a number >= 0"),
    "snes_max_it a word": (words("-snes_max_it", "many"), "option -snes_max_it: many is not a whole number"),
    "guess unknown": (words("-bs_guess", "magic"), "option -bs_guess: magic does not exist: give one of auto, extrapolate, substeps"),
    "guess of a method that has none": (words("-bs_guess", "substeps", "-ts_type", "bdf"), "option -bs_guess substeps: needs -ts_type beuler, cn or theta"),
    "guess of load steps": (words("-bs_guess", "substeps", "-bs_task", "statics"), "option -bs_guess substeps: needs steps in time, not load steps"),
    "guess of no sub-steps": (words("-bs_guess_substeps", "0"), "option -bs_guess_substeps: 0 is not positive: give a whole number > 0"),
    "line search unknown": (words("-snes_linesearch_type", "magic"), "Unable to find requested Line Search type magic"),
    "ksp_type unknown": (words("-ksp_type", "magic"), "Unable to find requested KSP type magic"),
    "pc_type unknown": (words("-pc_type", "magic"), "Unable to find requested PC type magic"),
    "mat_type unknown": (words("-mat_type", "magic"), "option -mat_type: magic cannot hold the Jacobian of particles: give aij"),
    "mat_type dense": (words("-mat_type", "dense"), "option -mat_type: dense cannot hold the Jacobian of particles: give aij"),
    "mat_type sell": (words("-mat_type", "sell"), "option -mat_type: sell cannot hold"),
    "mat_type blockmat": (words("-mat_type", "blockmat"), "option -mat_type: blockmat cannot hold"),
    "mat_type preallocator": (words("-mat_type", "preallocator"), "option -mat_type: preallocator cannot hold"),
    "mat_type scalapack": (words("-mat_type", "scalapack"), "option -mat_type: scalapack cannot hold"),
    "mat_type sbaij": (words("-mat_type", "sbaij"), "option -mat_type: sbaij cannot hold"),
    "mat_type with -snes_mf_operator": (words("-mat_type", "is", "-snes_mf_operator"), "options -mat_type and -snes_mf_operator cannot be combined"),
    "snes_type patch": (words("-snes_type", "patch"), "option -snes_type: patch needs a mesh"),
    "mat_type without such a factorisation": (words("-mat_type", "is", "-ksp_type", "preonly", "-pc_type", "lu"), "Could not locate a solver type for factorization type LU"),
}

GOOD = {
    "good: YAML": option_file(GOOD_YAML),
    "good: YAML with nested names, lists, comments, flags": option_file(
        "# a chain\nbs:\n  lattice: {type: chain, size: 5, dim: 2}\n  gravity: [0, -9.81]\n  overwrite:\nts_max_steps: 1\n"),
    "good: YAML, a name in several mappings": option_file("bs: {lattice: {type: chain, size: 5}}\nts: {max_steps: 1, type: cn}\nsnes: {type: newtonls}\n"),
    "good: YAML, remarks of one name": option_file(GOOD_YAML + "$$remark: a chain\n$$remark: of five\n"),
    "good: opts": option_file("-bs_lattice_type chain # a comment\n-bs_lattice_size 5\n\n-ts_max_steps 1\n", "o.opts"),
    "good: opts that name another, twice": lambda folder: [(folder / "b.opts").write_text("-ts_max_steps 1\n"), *option_file(
        "-bs_lattice_type chain\n-bs_lattice_size 5\n-options_file b.opts\n-options_file b.opts\n", "o.opts")(folder)][1:],
    "good: negative numbers are values": words("-bs_lattice_dim", "2", "-bs_gravity", "-1,-9.81", "-ts_init_time", "-1", "-ts_max_time", "-0.5"),
    "good: ILU on any number of ranks": words("-ksp_type", "gmres", "-pc_type", "ilu", "-pc_factor_levels", "1"),
    "good: ICC inside the condensed solve on any number of ranks": words("-condensed_pc_type", "icc"),
    "good: a continued run": restarted(),
    "good: a constrained Newton without bounds": words("-bs_lattice_perturbation", "0.1", "-pc_type", "lu", "-ksp_type", "preonly", "-snes_type", "vinewtonrsls"),
    "good: mat_type baij": words("-mat_type", "baij"),
    "good: upper case": words("-BS_STOKES_DRAG", "1"),
}

# warned of, in one line each
UNUSED = {
    "unused: misspelt": (words("-ksp_tpye", "cg"), "option -ksp_tpye is not used by this run"),
    "unused: of a solver not chosen": (words("-ksp_gmres_restart", "50"), "option -ksp_gmres_restart is not used by this run"),
    "unused: no such prefix": (words("-snse_rtol", "1e-3"), "option -snse_rtol is not used by this run"),
}

ENDS = ("-bs_lattice_dim", "2", "-bs_group_right", "xmax")

SUPPORTS = {
    "group by no face": (words("-bs_group_a", "xmid"), "option -bs_group_a: 'xmid' chooses no particles: write faces"),
    "group on a missing axis": (words("-bs_group_a", "ymin"), "option -bs_group_a: 'ymin' chooses no particles"),
    "group of rows that are not there": (words("-bs_group_a", "ids:0,9"), "option -bs_group_a: ids: there is no particle 9: write rows from 0 to 4"),
    "group of rows backwards": (words("-bs_group_a", "ids:3-1"), "option -bs_group_a: ids: '3-1' is no row of particles"),
    "group without rows": (words("-bs_group_a", "ids:"), "ids: '' is no row of particles: write rows and ranges such as ids:0,5,7-12"),
    "group in half a box": (words("-bs_group_a", "box:0"), "option -bs_group_a: box: needs"),
    "empty group": (words("-bs_lattice_dim", "1", "-bs_group_a", "box:10,11"), "group a of chain lattice 5, 2 neighbours has no particles: choose some by -bs_group_a"),
    "group without a name": (words("-bs_group_", "xmin"), "is no name of a group: write letters, digits and underscores"),
    "group named anchors": (words("-bs_group_anchors", "xmin"), "a group is named anchors, as the springs to given points are: give it another name"),
    "anchors of no group": (words("-bs_anchor_group", "a", "-bs_anchor_stiffness", "1"), "option -bs_anchor_group: there is no group a: choose its particles by -bs_group_a"),
    "stress of no group": (words(*ENDS, "-bs_stress_groups", "left"), "option -bs_stress_groups: there is no group left: choose its particles by -bs_group_left, or name some of right"),
    "compliance of no group": (words(*ENDS, "-bs_task", "statics", "-bs_lattice_fixed", "xmin", "-bs_compliance_groups", "left"),
                               "option -bs_compliance_groups: there is no group left: choose its particles by -bs_group_left, or name some of right"),
    "compliance of a group twice": (words(*ENDS, "-bs_task", "statics", "-bs_lattice_fixed", "xmin", "-bs_compliance_groups", "right,right"), "the group right is named twice: name it once"),
    "compliance of what is free": (words(*ENDS, "-bs_task", "statics", "-bs_compliance_groups", "right"),
                                   "option -bs_compliance_groups: bodies that are tied to nothing (1 of them) yield to loads without end: fix a particle of each"),
    "moduli without a box": (words("-bs_task", "moduli"), "-bs_task moduli: the lattice has no periodic box"),
    "moduli of what is held": (words("-bs_lattice_dim", "1", "-bs_lattice_periodic", "x", "-bs_lattice_fixed_particles", "0", "-bs_task", "moduli"),
                               "-bs_task moduli: fixed or driven particles do not follow the strain of the box: leave them out"),
    "fixed group that is none": (words(*ENDS, "-bs_lattice_fixed_groups", "right,left"),
                                 "option -bs_lattice_fixed_groups: there is no group left: choose its particles by -bs_group_left, or name one of right"),
    "motion of no group": (words(*ENDS, "-bs_motion_left", "fixed"), "option -bs_motion_left: there is no group left: choose its particles by -bs_group_left, or name one of right"),
    "motion without any group": (words("-bs_motion_left", "fixed"), "option -bs_motion_left: there is no group left: choose its particles by -bs_group_left"),
    "motion of a group that is named as what does other work": (words(*ENDS, "-bs_group_loads", "xmax", "-bs_motion_loads", "velocity:1,0"),
                                                                "option -bs_motion_loads: work/loads of a trajectory is that of something else"),
    "force on no group": (words(*ENDS, "-bs_force_left", "1"), "option -bs_force_left: there is no group left: choose its particles by -bs_group_left, or name one of right"),
    "force of three components in the plane": (words(*ENDS, "-bs_force_right", "1,2,3"), "option -bs_force_right: 3 components in 2 dimensions: give 1 to 2 of them [N]"),
    "force of no component": (words(*ENDS, "-bs_force_right", "total"), "option -bs_force_right: 0 components in 2 dimensions: give 1 to 2 of them [N]"),
    "force of words": (words(*ENDS, "-bs_force_right", "1,much"), "option -bs_force_right: 'much' is no finite force: write a number [N], expression:TEXT in t or table:FILE"),
    "force that is not finite": (words(*ENDS, "-bs_force_right", "nan"), "option -bs_force_right: 'nan' is no finite force"),
    "force whose square overflows": (words(*ENDS, "-bs_force_right", "1e200"), "option -bs_force_right: '1e200' is no finite force"),
    "force with total in front": (words(*ENDS, "-bs_force_right", "total,1"), "option -bs_force_right: 'total' is no finite force"),
    "force by an expression of nothing known": (words(*ENDS, "-bs_force_right", "expression:q*t"), "option -bs_force_right: 'q*t': character 1: q is unknown"),
    "force by an expression that grows beyond all bounds": (words(*ENDS, "-bs_force_right", "0,expression:1/(t-t)"), "is not finite at t ="),
    "force by a table that is not there": (words(*ENDS, "-bs_force_right", "table:none.csv"), "none.csv"),
    "force by a table that ends too soon": (lambda folder: [*CHAIN[:-2], *ENDS, "-ts_max_time", "2", "-bs_force_right", f"table:{table(folder, '0,0', '1,1')}"],
                                            "the table of -bs_force_right does not reach the end of the run, t = 2 s: add rows or lower -ts_max_time"),
    "force on a body that nothing holds": (words(*ENDS, "-bs_task", "statics", "-bs_force_right", "1"), "nothing holds particle 0 and what is tied to it against its loads"),
    "motion that nobody gives": (words(*ENDS, "-bs_motion_right", "given"), "option -bs_motion_right: given motions are said by a program on the library: write another one"),
    "motion unknown": (words(*ENDS, "-bs_motion_right", "shaken"), "option -bs_motion_right: 'shaken' is no motion: write fixed, velocity:VX,VY,VZ"),
    "motion of too few numbers": (words(*ENDS, "-bs_motion_right", "velocity:1"), "option -bs_motion_right: velocity: needs 2 numbers [m/s]"),
    "motion of words": (words(*ENDS, "-bs_motion_right", "velocity:1,fast"), "option -bs_motion_right: '1,fast' are not finite numbers"),
    "motion that is not finite": (words(*ENDS, "-bs_motion_right", "velocity:1,inf"), "'1,inf' are not finite numbers"),
    "rotation without a point": (words(*ENDS, "-bs_motion_right", "rotation:1"), "rotation: write the angular velocity and a point, rotation:W,CX,CY"),
    "rotation on a line": (words("-bs_lattice_dim", "1", "-bs_group_right", "xmax", "-bs_motion_right", "rotation:1,0"), "rotation: one dimension has no rotations"),
    "component that is not there": (words(*ENDS, "-bs_motion_right", "z=fixed"), "option -bs_motion_right: the lattice has no component z"),
    "component twice": (words(*ENDS, "-bs_motion_right", "x=fixed,x=free"), "component x is given twice"),
    "component unknown": (words(*ENDS, "-bs_motion_right", "x=still"), "'still' is no motion of a component: write free, fixed, velocity:V"),
    "nothing held": (words(*ENDS, "-bs_motion_right", "x=free,y=free"), "option -bs_motion_right: no component is held"),
    "expression of nothing known": (words(*ENDS, "-bs_motion_right", "x=expression:q*t"), "'q*t': character 1: q is unknown: write an expression in t [s] and the initial position"),
    "expression that is none": (words(*ENDS, "-bs_motion_right", "x=expression:(t"), "'(t': at its end: an operator or ')' is missing"),
    "expression with a character of none": (words(*ENDS, "-bs_motion_right", "x=expression:10%*t"), "option -bs_motion_right: '10%*t': character 3: '%' has no meaning in an expression"),
    "expression of 40 kB": (words(*ENDS, "-bs_motion_right", "x=expression:" + "(" * 40000), "has 40000 characters: write 10000 at most"),
    "expression with 2,000 functions": (words(*ENDS, "-bs_motion_right", "x=expression:" + "sin(" * 2000 + "t" + ")" * 2000), "has 10001 characters"),
    "place in a strain": (words("-bs_lattice_dim", "1", "-bs_lattice_periodic", "x", "-bs_box_strain", "xx=expression:x0"), "option -bs_box_strain: xx: 'x0': character 1: x0 is unknown: write an expression in t alone"),
    "strain in percent": (words("-bs_lattice_dim", "1", "-bs_lattice_periodic", "x", "-bs_box_strain", "xx=expression:1%*t"), "option -bs_box_strain: xx: '1%*t': character 2: '%' has no meaning"),
    "stress in percent": (words("-bs_lattice_dim", "1", "-bs_lattice_periodic", "x", "-bs_task", "statics", "-bs_box_stress", "xx=expression:1%*t"), "option -bs_box_stress: xx: '1%*t': character 2"),
    "table after the run": (lambda folder: [*CHAIN, *ENDS, "-ts_max_time", "0.05", "-bs_motion_right", f"x=table:{table(folder, 't,s', '5,0', '6,1')}"],
                            "the table of -bs_motion_right begins after the end of the run, t = 0.05 s: its times are those of the run"),

    "table of a motion missing": (words(*ENDS, "-bs_motion_right", "table:none.csv"), "none.csv: no such file"),
    "fixed and driven": (words(*ENDS, "-bs_lattice_fixed", "xmax", "-bs_motion_right", "velocity:1,0"),
                         "particle 4 is fixed, but belongs to the group right, which -bs_motion_right moves: take it out of one of them"),
    "driven twice": (words(*ENDS, "-bs_group_last", "ids:4", "-bs_motion_right", "velocity:1,0", "-bs_motion_last", "x=fixed"),
                     "whose motions both hold its component x: let one of them leave it free"),
    "driven where the method looks back": (words(*ENDS, "-bs_motion_right", "velocity:1,0", "-ts_type", "rosw", "-ts_rosw_type", "grk4t"),
                                           "evaluates the forces or sources at a time before its step"),
}

GROUPS = {"option files": FILES, "options of the program": PROGRAM, "options of PETSc": PETSC,
          "groups and motions": SUPPORTS}

if __name__ == "__main__":
    sys.exit(corpus.main(__doc__, GROUPS, GOOD, UNUSED))
