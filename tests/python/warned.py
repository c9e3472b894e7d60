"""Warnings of the program are Python's, whenever they are given: also those of a motion's end, once. What keywords mean, and which are mistakes."""
import re
import subprocess
import tempfile
import warnings

import numpy as np
from helpers import PROGRAM, python, raised

import backspring as bs
from backspring import options as keywords


def said_by(call):
    """What `call` warns of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        call()
    assert all(issubclass(one.category, bs.BackspringWarning) for one in said), said
    return [str(one.message) for one in said]


def small():
    """A mass on a spring, in micrometres: its whole motion is small beside the tolerances of the adapted methods, so that the end of a motion tells of them."""
    return bs.Lattice([[0.0], [1.2e-6]], [[0, 1]], stiffness=1.0, rest_length=1e-6, mass=[1.0, 0.025], fixed=[0])


def told_at_the_end():
    """By close(), where a with block ends or is left, where a loop ends or is left, and at the interpreter's end; once each. The same of every motion."""
    options, seen = dict(dt=0.01, ts_type="bdf"), []

    def closed():
        simulation = bs.Simulation(small(), **options)
        simulation.run_until(1.0)
        seen.append(simulation.t)
        simulation.close()
        simulation.close()

    def within(kind=None):
        try:
            with bs.Simulation(small(), **options) as simulation:
                simulation.run_until(1.0)
                if kind:
                    raise kind("of the caller")
                simulation.close()
        except ZeroDivisionError:
            seen.append(kind)

    def looped(leave=False):
        for frame in bs.run(small(), until=1.0, **options):
            if leave and frame.t > 0.9:
                break

    for call in (closed, within, lambda: within(ZeroDivisionError), looped, lambda: looped(True)):
        said = said_by(call)
        assert len(said) == 1 and "-ts_atol" in said[0], (call, said)
    assert seen == [1.0, ZeroDivisionError], seen
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation = bs.Simulation(small(), **options)
        simulation.run_until(1.0)
        try:
            simulation.close()
        except bs.BackspringWarning as one:
            seen.append(str(one))
        assert "-ts_atol" in seen[-1] and repr(simulation).endswith("closed>"), seen
        simulation.close()
    loose = said_by(lambda: list(bs.run(small(), until=1.0, dt=0.01, ts_type="cn", snes_atol=1e-3)))
    assert len(loose) == 1 and "snes_atol" in loose[0], loose


AT_THE_END = """
import atexit
import backspring as bs
from backspring import options as keywords
small = lambda: bs.Lattice([[0.0], [1.2e-6]], [[0, 1]], stiffness=1.0, rest_length=1e-6, mass=[1.0, 0.025], fixed=[0])
options = dict(dt=0.01, ts_type="bdf")
held = bs.run(small(), until=1.0, **options)
for _ in range(3): next(held)
first, second = (bs.Simulation(small(), **options) for _ in range(2))
for one in (first, second): one.run_until(1.0)
closed_late = bs.Simulation(small(), **options)
atexit._run_exitfuncs()
first.close(); closed_late.close(); held.close()
print(first, flush=True)
"""


def told_by_the_interpreter():
    """What is still open when the interpreter ends tells, too, and ends, where warnings are errors as well; nothing is raised afterwards."""
    for ranks in (1, 2):
        done = python(AT_THE_END, ranks, timeout=60)
        assert done.returncode == 0 and done.stdout.count("closed>") == ranks, done.stdout + done.stderr
        told = re.findall("BackspringWarning: steps were adapted.* the motion is small, ([0-9.]+) of", done.stderr)
        assert len(told) == len(set(told)) == 2, done.stderr  # by the first rank: of the loop, and of the two motions alike, which Python shows once
        assert "Traceback" not in done.stderr, done.stderr
    code = AT_THE_END.replace("atexit._run_exitfuncs()\nfirst.close(); closed_late.close(); held.close()\n", "")
    done = python('import warnings\nwarnings.simplefilter("error", UserWarning)\n' + code, timeout=60)
    assert done.returncode == 0 and "BackspringWarning: steps were adapted" in done.stderr and "PETSC" not in done.stderr, done.stdout + done.stderr


def told_by_analyses():
    """Statics, moduli and modes tell of what they are warned of, also where they fail."""
    net = bs.Lattice([[0.0, 0], [1, 0]], [[0, 1]], stiffness=1.0, fixed=[0], groups={"end": [1]})
    for call in (lambda: bs.statics(net, loads={"end": (0.1, 0)}, ts_adapt_typ="none"), lambda: bs.modes(net, 1, ts_adapt_typ="none"),
                 lambda: bs.Statics(net, loads={"end": (0.1, 0)}, ts_adapt_typ="none").solve()):
        said = said_by(call)
        assert sum("ts_adapt_typ" in one for one in said) == 1, said

    def watched():
        try:
            bs.statics(net, loads={"end": (0.1, 0)}, ts_adapt_typ="none", observe=lambda s, eq: 1 / 0)
        except ZeroDivisionError:
            pass

    assert sum("ts_adapt_typ" in one for one in said_by(watched)) == 1


FLAGS = """
import sys
import backspring as bs
from backspring import options as keywords
net = bs.Lattice([[0.0, 0], [1, 0]], [[0, 1]], stiffness=1.0, fixed=[0], groups={"end": [1]})
def solved(of, **options):
    print(f"{options}:", flush=True)
    return bs.statics(of, loads={"end": (0.1, 0)}, **options)
for name in ("snes_monitor", "ksp_monitor", "snes_converged_reason", "ksp_converged_reason", "snes_linesearch_monitor", "ts_view"):
    solved(net, **{name: True})
    solved(net, **{name: False})
eq = solved(net, snes_monitor=True)
solved(eq)
solved(eq, snes_monitor=False)
print({"ts_monitor": True}, flush=True)
last = [frame.t for frame in bs.run(net, dt=0.1, until=0.2, ts_monitor=True, ts_type="theta", ts_theta_theta=0.6, ts_theta_endpoint=True)][-1]
"""


def flags():
    """True gives a flag of whatever kind, by which PETSc prints, too, and False none; what is recorded of flags can be continued."""
    done = python(FLAGS, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    printed = {head: text for head, text in re.findall(r"^(\{.*?\}):?\n((?:(?!\{).*\n)*)", done.stdout, re.M)}
    expected = {"snes_monitor": "SNES Function norm", "ksp_monitor": "KSP", "snes_converged_reason": "Nonlinear solve converged", "ksp_converged_reason": "Linear solve converged",
                "snes_linesearch_monitor": "", "ts_view": "TS Object", "ts_monitor": "0 TS dt 0.1 time 0."}
    for name, words in expected.items():
        assert words in printed[str({name: True})] and printed.get(str({name: False}), "") == "", (name, done.stdout)
    assert len(printed[str({"snes_monitor": True})].splitlines()) >= 2 and printed["{}"] == printed[str({"snes_monitor": True})], done.stdout
    net = bs.Lattice([[0.0, 0], [1, 0]], [[0, 1]], stiffness=1.0, fixed=[0])
    with tempfile.TemporaryDirectory() as folder:
        options = dict(dt=0.01, ts_type="theta", ts_theta_theta=0.6, ts_theta_endpoint=True, bs_gravity=(1, 0), bs_output_springs=True)
        with bs.Simulation(net, bs_output=f"{folder}/run.h5md", **options) as simulation:
            simulation.step(3)
            simulation.checkpoint(f"{folder}/then.h5")
            assert "tension" in simulation.frame()["fields"]
            simulation.step(3)
            end = simulation.x
        with bs.Simulation.restart(f"{folder}/then.h5", net) as again:
            again.step(3)
            assert np.array_equal(end, again.x)
    with raised(bs.InputError, "bs_gravity needs a value"):
        bs.statics(net, bs_gravity=True)


def misspelt():
    """A keyword that can be no option is a mistake; what may be PETSc's is warned of where nothing reads it. All that PETSc lists may be given."""
    net = bs.Lattice([[0.0, 0], [1, 0]], [[0, 1]], stiffness=1.0, fixed=[0], groups={"end": [1]})
    motion = dict(dt=0.1, until=0.2)
    for words, call in ((("load_step: no such argument", "did you mean load_steps?"), lambda: bs.statics(net, loads={"end": (0.1, 0)}, load_step=10)),
                        (("load: ", "loads?"), lambda: bs.Statics(net, load={"end": (0.1, 0)})), (("totals: ", "total?"), lambda: bs.moduli(net, totals=True)),
                        (("counts: ", "count?"), lambda: bs.modes(net, counts=3)), (("observer: ", "observe?"), lambda: bs.Simulation(net, dt=0.1, observer=print)),
                        (("evry: ", "every?"), lambda: bs.run(net, evry=0.1, **motion)), (("gravity: ", "begin with bs_"), lambda: bs.run(net, gravity=(0, -1), **motion)),
                        (("-bs_gravity: ",), lambda: bs.statics(net, **{"-bs_gravity": (0, -1)})), (("until: ",), lambda: bs.Simulation(net, **motion)),
                        (("bs_gravty", "bs_gravity?"), lambda: bs.statics(net, bs_gravty=(0, -1)))):
        with raised(bs.InputError, *words):
            call()
    said = said_by(lambda: bs.Simulation(net, dt=0.1, ts_typ="cn", Condensed_fallback_ksp_rtoll=1e-3).step())
    assert len(said) >= 1 and "ts_typ" in "".join(said) and "ksp_rtoll" in "".join(said), said
    listed = subprocess.run([PROGRAM, "-help"], capture_output=True, text=True, timeout=60).stdout
    names = re.findall(r"^ +-+((?!bs_)[a-z][a-z_0-9]*)", listed, re.M)
    odd = [name for name in names if not keywords._is_petscs(name)]
    assert len(names) > 400 and not odd, odd


def so_many_modes():
    """Without a number they are as many as of the program, or all that there are, without a word: nobody has asked for more."""
    held, free = (bs.Lattice([[0.0, 0], [1, 0], [0.5, 0.8]], [[0, 1], [1, 2], [2, 0]], stiffness=1.0, mass=0.1, fixed=fixed) for fixed in ([0, 1], ()))
    long = bs.Lattice(np.arange(40.0), np.column_stack([np.arange(39), np.arange(1, 40)]), stiffness=1.0, fixed=[0])
    found = []
    for net in (held, free, long):
        said = said_by(lambda: found.append(bs.modes(net)))
        assert not said, said
    said = said_by(lambda: found.extend([bs.modes(long, bs_modes=3), bs.modes(held, bs_modes=2)]))
    assert not said and [len(one) for one in found] == [2, 3, 10, 3, 2], (said, [len(one) for one in found])
    for call in (lambda: bs.modes(held, 10), lambda: bs.modes(held, bs_modes=10)):
        said = said_by(call)
        assert len(said) == 1 and "fewer than the 10" in said[0], said
    said = said_by(lambda: found.append(bs.modes(free, count=100)))
    assert len(said) == 1 and "fewer than the 100" in said[0] and len(found[-1]) == 3, said
    with tempfile.TemporaryDirectory() as folder:
        long.save(f"{folder}/net.h5")
        done = subprocess.run([PROGRAM, "-bs_task", "modes", "-bs_lattice_file", f"{folder}/net.h5"], capture_output=True, text=True, timeout=60)
    assert "modes=10 " in done.stdout, done.stdout + done.stderr
