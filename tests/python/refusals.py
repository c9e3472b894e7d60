"""What the package refuses, and in which words."""
import json
import pathlib
import tempfile

import numpy as np
from helpers import python, raised

import backspring as bs
from cases import cell, sheet


def bad_arguments():
    """One exception, which names the argument and the row."""
    x, pairs = np.array([[0.0, 0], [1, 0], [2, 0.5]]), np.array([[0, 1], [1, 2]])
    net = lambda **more: bs.Lattice(**{**dict(x=x, pairs=pairs), **more})
    holed = x.copy()
    holed[1, 1] = np.nan
    for words, more in ((("x, row 1", "finite"), dict(x=holed)), (("x", "shape"), dict(x=np.zeros((3, 4)))), (("x", "shape"), dict(x=np.zeros((0, 2)))),
                        (("pairs, row 1", "0 to 2"), dict(pairs=[[0, 1], [1, 3]])), (("pairs", "shape"), dict(pairs=[0, 1])),
                        (("pairs", "float64"), dict(pairs=pairs * 1.0)), (("pairs, row 1", "row 0", "parallel"), dict(pairs=[[0, 1], [1, 0]])),
                        (("pairs, row 0", "itself"), dict(pairs=[[1, 1]])), (("stiffness", "(3,)", "(2,)"), dict(stiffness=[1, 2, 3])),
                        (("stiffness, row 1",), dict(stiffness=[1, np.inf])), (("stiffness", "numbers"), dict(stiffness="soft")),
                        (("mass, row 2", "positive"), dict(mass=[1, 1, 0])), (("fixed, entry 0", "7"), dict(fixed=[7])), (("fixed", "mask"), dict(fixed=[True])),
                        (("fixed", "whole numbers"), dict(fixed=[0.5])), (("groups['a'], entry 1",), dict(groups={"a": [0, -1]})),
                        (("velocity", "shape"), dict(velocity=[1, 2, 3])), (("periodic", "box"), dict(periodic=(True, True))),
                        (("box", "shape"), dict(box=(1, 2, 3))), (("rest_length, row 0",), dict(rest_length=[np.nan, 1])),
                        (("x", "real numbers"), dict(x=x + 0j)), (("stiffness", "real numbers"), dict(stiffness=[1, 2j])), (("stiffness", "numbers"), dict(stiffness=["1", "2"])),
                        (("x", "masked"), dict(x=np.ma.masked_array(x, mask=x > 1.5))), (("pairs", "every row"), dict(pairs=[[0, 1], [1]])),
                        (("box", "numbers"), dict(box="big")), (("box", "shape"), dict(box=5.0)), (("x", "every row"), dict(x=[[0, 1], [1]])),
                        *((("periodic", "2 truth values"), dict(box=(5, 5), periodic=wrong)) for wrong in (True, "xy", ["False", "False"], [True], [0, 2], [None, None])),
                        (("law: None",), dict(law=None)), (("law: 3",), dict(law=3)), (("law, row 1: 3",), dict(law=["hooke", 3])), (("law", "1 names"), dict(law=["hooke"])),
                        (("damping_law: None",), dict(damping_law=None)), (("particle_columns['drag']", "every row"), dict(particle_columns={"drag": [[1.0], [1, 2], [3]]})),
                        *((("angles['shift']", word), dict(angles={"triples": [[0, 1, 2]], "stiffness": 1.0, "shift": wrong}))
                          for word, wrong in (("every row", [[[0, 0], [1]]]), ("(1, 3, 2)", [[0, 0]]), ("(1, 3, 2)", np.zeros((3, 1, 2))))),
                        *((("breaking['critical_strain'], row 1", "inf"), dict(breaking={"critical_strain": [1, wrong]})) for wrong in (np.nan, -np.inf, 0, -1)),
                        (("breaking['broken'], row 0", "finite"), dict(breaking={"broken": np.inf})),
                        (("hinges['critical_change'], row 0", "inf"), dict(x=np.eye(4, 3), hinges={"quads": [[0, 1, 2, 3]], "stiffness": 1.0, "critical_change": -np.inf}))):
        with raised(bs.InputError, *words):
            net(**more)
    assert net(box=(5, 5), periodic=np.array([True, False])).periodic == net(box=(5, 5), periodic=[1, 0]).periodic == (True, False)
    with raised(bs.InputError, "pairs, row 1", "parallel"):
        net().replace(pairs=[[0, 1], [1, 0]])
    double = net(pairs=[[0, 1], [1, 0]], parallel=True)
    assert len(double.replace(pairs=[[0, 1], [0, 1], [1, 2]], stiffness=1.0, rest_length=None, damping=0.0).replace(x=2 * x).pairs) == 3
    with raised(bs.InputError, "pairs, row 1", "parallel"):
        double.replace(parallel=False)
    assert issubclass(bs.InputError, ValueError)
    with raised(bs.InputError, "bs_load_steps"):
        bs.statics(net(fixed=[0, 1, 2]), load_steps=0)
    with raised(bs.InputError, "group", "nowhere"):
        bs.statics(net(fixed=[0]), loads={"nowhere": (0, 1)})
    with raised(bs.InputError, "springy"):
        bs.statics(net(law="springy", fixed=[0]))
    with raised(bs.InputError, "ts_dt"):
        next(bs.run(net(), dt=-1.0, until=1.0))
    with tempfile.TemporaryDirectory() as folder:  # PETSc would read up to the NUL
        for options in ({"bs_output": f"{folder}/a\0b.h5md"}, {"bs_output": pathlib.Path(folder) / "a\0b.h5md"}, {"bs_gravity": [0, "1\0"]}, {"bs_gravity\0": (0, 1)}):
            with raised(bs.InputError, "option", "NUL"):
                next(bs.run(net(), dt=0.1, until=0.2, **options))
        with raised(bs.InputError, "option bs_output", "NUL"):
            net(options={"bs_output": f"{folder}/a\0b.h5md"})
        assert not list(pathlib.Path(folder).iterdir())
    with raised(bs.InputError, "Lattice"):
        bs.statics(x)
    with raised(bs.InputError, "shape"):
        simulation = bs.Simulation(net(), dt=0.1)
        simulation.x = x[:2]
    with raised(bs.InputError, "finite"):
        simulation.x = holed
    with raised(bs.InputError, "velocity", "real numbers"):
        simulation.v = x * 1j
    with raised(bs.InputError, "position", "numbers"):
        simulation.x = "a"


def copied():
    """What becomes of the arrays that a lattice was made of is nothing to it, nor to what replace() makes of it."""
    x, ends = np.zeros((4, 3)) + np.arange(4.0)[:, None], np.arange(4, dtype=np.int64)[None]
    given = dict(x=x, pairs=ends[:, :2].copy(), stiffness=np.ones(1), rest_length=np.ones(1), damping=np.ones(1), area=np.ones(1), mass=np.ones(4), velocity=x.copy(),
                 fixed=np.zeros(4, bool), groups={"a": np.ones(4, bool)}, box=9 * np.eye(3), shift=np.zeros((1, 3), np.int64), spring_columns={"s": np.ones(1)},
                 particle_columns={"drag": np.ones(4), "force": x.copy()}, anchors={"particle": ends[0, :1].copy(), "point": x[:1].copy(), "stiffness": np.ones(1)},
                 angles={"triples": ends[:, :3].copy(), "stiffness": np.ones(1), "rest_angle": np.ones(1), "shift": np.zeros((1, 9), np.int64), "critical_change": np.ones(1)},
                 hinges={"quads": ends.copy(), "stiffness": np.ones(1), "shift": np.zeros((1, 12), np.int64)}, breaking={"critical_strain": np.ones(1)})
    arrays = lambda one: [array for value in one.values() for array in (arrays(value) if isinstance(value, dict) else [value]) if isinstance(array, np.ndarray)]
    net = bs.Lattice(**given)
    again = net.replace()
    held = {name: getattr(net, name) for name in given}
    assert len(arrays(held)) >= len(arrays(given)) == 27, len(arrays(given))
    for theirs, own in ((given, held), (held, {name: getattr(again, name) for name in given})):
        assert not any(np.shares_memory(a, b) for a in arrays(theirs) for b in arrays(own))


def misuse():
    """What is closed, under way, or said twice raises an exception and harms nothing."""
    net = bs.Lattice(**sheet())
    simulation = bs.Simulation(net, dt=1e-3)
    seen = []
    simulation.on_step(lambda *_: seen.append((simulation.x.sum(), simulation.observables["kinetic_energy"])))
    simulation.step(2)
    assert len(seen) == 2 and seen[1][0] == simulation.x.sum()
    for call in (lambda *_: simulation.step(), lambda *_: simulation.close(), lambda *_: setattr(simulation, "v", 0 * net.x)):
        simulation.on_step(call)
        with raised(RuntimeError, "under way"):
            simulation.step()
    simulation.on_step(None)
    simulation.step()
    simulation.close()
    simulation.close()
    for call in (lambda: simulation.x, lambda: simulation.t, simulation.step, simulation.frame, lambda: simulation.on_step(None), lambda: simulation.rows):
        with raised(RuntimeError, "closed"):
            call()
    for frame in bs.run(net, dt=1e-3, until=2e-3):
        pass
    with raised(RuntimeError, "closed"):
        frame.forces
    assert frame.energy == frame.observables["total_energy"] > 0  # are kept
    inner = bs.Simulation(net, dt=1e-3, forces=lambda t, x, v: inner.x)
    with raised(RuntimeError, "under way"):
        inner.step()
    for words, call in ((("bs_load_steps", "twice"), lambda: bs.statics(net, load_steps=2, bs_load_steps=3)),
                        (("bs_force_bottom", "twice"), lambda: bs.statics(net, loads={"bottom": (0, -1)}, bs_force_bottom="0,1")),
                        (("ts_dt", "twice"), lambda: bs.Simulation(net, dt=0.1, ts_dt=0.2)),
                        (("ts_dt and ts_time_step", "two names"), lambda: bs.Simulation(net, dt=0.1, ts_time_step=0.2)), (("t: nan",), lambda: bs.Simulation(net, dt=0.1).run_until(np.nan)), (("bs_lattice_type", "twice"), lambda: bs.generate("chain", 4, type="square")),
                        (("load_steps", "2.5"), lambda: bs.statics(net, load_steps=2.5)), (("count", "-3"), lambda: bs.Simulation(net, dt=0.1).step(-3)),
                        (("total", "'tpo'"), lambda: bs.statics(net, loads={"bottom": (0, -1)}, total=["tpo"])), (("loads",), lambda: bs.statics(net, loads=(0, -1))),
                        *((("total: ", "list of names"), lambda wrong=wrong: bs.statics(net, loads={"bottom": (0, -1)}, total=wrong)) for wrong in (1, 0, 3.5, {"bottom": False}, [1])),
                        *((("loads['bottom']", word), lambda wrong=wrong: bs.statics(net, loads={"bottom": wrong})) for word, wrong in (
                            ("(2,)", 3.0), ("(2,)", [1.0]), ("(2,)", [1, 2, 3]), ("every row", [[1], [1, 2]]), ("finite", [0, np.nan]), ("numbers", [None, 1]))),
                        *((("until", word), lambda wrong=wrong, bar=bar: bs.run(net, dt=1e-3, until=wrong, progress=bar))
                          for word, wrong in (("numbers", "a"), ("finite", np.inf), ("shape", [1.0])) for bar in (False, True)),
                        *((("every", word), lambda wrong=wrong: bs.run(net, dt=1e-3, until=1.0, every=wrong))
                          for word, wrong in (("numbers", "a"), ("positive", 0), ("positive", -0.1), ("positive", np.nan))),
                        (("ts_max_time", "twice"), lambda: bs.run(net, dt=1e-3, until=1.0, ts_max_time=2.0)),
                        (("bs_output_interval", "twice"), lambda: bs.run(net, dt=1e-3, until=1.0, every=0.1, bs_output_interval=0.2)),
                        (("ts_init_time",), lambda: next(bs.run(net, dt=1e-3, until=1.0, ts_init_time="a", progress=True))),
                        (("comm: 3", "mpi4py"), lambda: bs.statics(net, comm=3)), (("comm: 3", "mpi4py"), lambda: net.save("/nowhere.h5", comm=3)),
                        (("'foo'", "hung"), lambda: bs.statics(net).reactions["foo"]),
                        (("'foo'",), lambda: bs.Simulation(net, dt=0.1).set("foo", net.x)), (("fixed", "twice"), lambda: net.replace(fixed=[1, 1, 0])),
                        (("shift, row 0", "whole"), lambda: bs.Lattice(**{**cell(), "shift": cell()["shift"] + 0.5})), (("groups",), lambda: net.replace(groups=["a"])),
                        (("nowhere",), lambda: bs.open("/nowhere.h5md"))):
        with raised(bs.InputError, *words):
            call()


def told_once():
    """What forces without an energy mean is said once in a process, and only where it matters."""
    code = """
import warnings, backspring as bs
net = bs.Lattice([[0.0], [1]], [[0, 1]], stiffness=1.0, fixed=[0])
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    for options in (dict(ts_type="verlet"), {}, {}): bs.Simulation(net, dt=0.1, forces=lambda t, x, v: 0 * x, **options).step()
    bs.statics(net, forces=bs.Forces(lambda t, x, v: 0 * x, energy=lambda t, x: 0 * x[:, 0]))
print(*[one.message for one in said], sep="\\n")
"""
    lines = python(code).stdout.splitlines()
    assert len(lines) == 1 and "goes by residuals" in lines[0], lines


def failures():
    """What does not converge says so and has the last good state."""
    net = bs.Lattice(**sheet())
    with raised(bs.ConvergenceError, "rejected") as failed:
        bs.statics(net, loads={"bottom": (50, -2000)}, load_steps=4, snes_max_it=3, bs_step_max_cuts=1)
    state = failed.error.state
    assert isinstance(state, bs.Equilibrium) and state.load_factor < 1 and state.rejected == 2 and np.isfinite(state.x).all(), state
    simulation = bs.Simulation(net, dt=0.1, snes_max_it=1, bs_step_max_cuts=0, bs_gravity=(0, -9.81))
    with raised(bs.ConvergenceError) as failed:
        simulation.step(50)
    assert isinstance(failed.error.state, bs.Frame) and failed.error.state.t == simulation.t
    with tempfile.TemporaryDirectory() as folder:  # what a step has raised is not raised once more at the end, and stands in the report
        report = pathlib.Path(folder, "failed.json")
        with bs.Simulation(net, dt=0.1, snes_max_it=1, bs_step_max_cuts=0, bs_gravity=(0, -9.81), bs_report=report) as ended:
            with raised(bs.ConvergenceError, "rejected"):
                ended.step(50)
        assert json.loads(report.read_text())["outcome"] == "failed", report.read_text()
