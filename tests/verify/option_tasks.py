#!/usr/bin/env python3
"""Every option with every task: one that the task has no use for is refused or warned of by a line that names the tasks that have it, others are not.

Which sections of -help belong to which tasks is said here; that is all the tests know.
"""
import pathlib
import re
import subprocess
import sys
import tempfile

from harness import Checks
from program import environment

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "options/reference"))
from make_reference import sections  # noqa: E402

CHAIN = "-bs_lattice_type chain -bs_lattice_size 5 -bs_lattice_dim 2".split()
HELD = [*CHAIN, "-bs_lattice_fixed", "xmin"]
RUNS = {"dynamics": [*HELD, "-ts_max_steps", "1"], "statics": [*HELD, "-bs_task", "statics"], "modes": [*HELD, "-bs_task", "modes"],
        "moduli": [*CHAIN, "-bs_lattice_periodic", "x", "-bs_task", "moduli"],
        "generate": [*CHAIN, "-bs_task", "generate", "-bs_output", "l.h5"],
        "linear": "-bs_model linear -bs_linear_type rc_ladder -bs_linear_size 3 -ts_max_steps 1".split()}
PARTICLES, STEPPED, EQUILIBRIA = {"dynamics", "statics", "moduli", "modes"}, {"dynamics", "linear", "statics", "moduli"}, {"statics", "moduli"}
TASKS = {**dict.fromkeys(("Task", "Memory", "Model", "Output options", "Program"), set(RUNS)), "Lattice: particles and springs": {*PARTICLES, "generate"},
         **dict.fromkeys(("Form of the trajectory", "Matrices"), {*PARTICLES, "linear"}),
         **dict.fromkeys(("Frames and progress", "Stepping", "Checkpoints", "Linear solver", "Newton's tangent", "Newton's first iterate"), STEPPED),
         **dict.fromkeys(("Motion in time", "Advice", "Error control"), {"dynamics", "linear"}),
         **dict.fromkeys(("Loads (-bs_task statics)", "After a break in statics", "Stability of equilibria (-bs_task statics)",
                          "Given stresses of a periodic box (-bs_task statics)", "Compliance (-bs_task statics)"), EQUILIBRIA),
         "Moduli (-bs_task moduli)": {"moduli"}, "Modes": {"modes"}, "Linear system G x + C x' = B u(t)": {"linear"}}
OWN_WORDS = {("modes", "-bs_checkpoint"), ("modes", "-bs_restart"), ("statics", "-bs_stop_at_rest"), ("moduli", "-bs_stop_at_rest"),
             ("generate", "-bs_checkpoint"), ("generate", "-bs_restart")}  # refused, for reasons of their own


def home(tasks):
    """What the program calls them."""
    particles = [task for task in ("dynamics", "statics", "moduli", "modes") if task in tasks]
    return "-bs_model linear" if not particles else "-bs_model particles" if len(particles) == len(PARTICLES) else "-bs_task " + " or ".join(particles)


def main():
    checks = Checks("options of other tasks")
    found = sections(checks.program)

    def said(task, *words):
        with tempfile.TemporaryDirectory() as folder:
            return subprocess.run([pathlib.Path(checks.program).resolve(), *RUNS[task], *words], cwd=folder, capture_output=True, text=True, timeout=60,
                                  env=environment(1)).stderr

    def complaints(text):
        return [line for line in text.splitlines() if re.search("does not go with this run|used by this run|does not exist|not kept by the lattice file", line)]

    def one_section(mine, title):
        tasks = TASKS.get(title, PARTICLES)
        given = [(name.replace("NAME", "g"), default or "1") for name, default, _ in found[title]]
        for task in RUNS:
            if task in tasks:  # several may contradict each other; whatever is said of that, they are known
                text = said(task, *(word for name, default in given if name != "-bs_task" and name != "-bs_model" for word in (name, default)))
                mine.true(f"{title}: {task} has them", not complaints(text), text.strip()[-300:])
                continue
            wrong = []
            for name, default in given:
                text = said(task, name, default)
                own = (task, name) in OWN_WORDS or name == "-bs_netlist"  # which chooses its model itself
                expected = "not kept by the lattice file" if task == "generate" else "of " + home(tasks)
                if not (own or any(name in line and expected in line for line in complaints(text))):
                    wrong.append(f"{name}: {text.strip()[-200:]}")
            mine.true(f"{title}: {task} says that they are of {home(tasks)}", not wrong, "; ".join(wrong))

    checks.each(list(found), one_section)
    text = said("modes", *"-ts_type theta -ts_theta_theta 0.6 -snes_rtol 1e-9 -ksp_type gmres -pc_type none -foo 1 -log_view :/dev/null -eps_tol 1e-9".split())
    checks.true("PETSc's options of motions in modes", "options -ksp_type, -pc_type, -snes_rtol, -ts_theta_theta, -ts_type are not used by this run: they are of -bs_task dynamics" in text
                and "option -foo is not used by this run: it is misspelt" in text and len(complaints(text)) == 2, text)
    text = said("dynamics", *"-BS_Arc_Steps 3".split())
    checks.true("in capitals", "it is of -bs_task statics or moduli" in text, text)
    text = said("dynamics", "-bs_arc_stepps", "3")
    checks.true("misspelt names are looked for among all tasks", "-bs_arc_stepps does not exist: did you mean -bs_arc_steps?" in text, text)
    text = said("modes", *"-bs_modes_about equilibrium -bs_load_steps 2 -snes_rtol 1e-9 -eps_tol 1e-9 -foo 1".split())
    checks.true("modes about the equilibrium have options of statics", len(complaints(text)) == 1 and "option -foo is" in complaints(text)[0], text)
    checks.finish()


if __name__ == "__main__":
    main()
