#!/usr/bin/env python3
"""The Python package by itself: its errors, states that are written back, observers, interruptions, sessions side by side, memory, pictures, tools."""
import os
import pathlib
import pickle
import re
import subprocess
import sys
import tempfile
import time
import warnings

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from helpers import HERE, PYTHON, python, raised  # noqa: E402

import backspring as bs  # noqa: E402
import numpy as np  # noqa: E402
from cases import MESHES, cell, parts, sheet  # noqa: E402
from design import designed, on_ranks, sensitivities  # noqa: E402
from states import foreign_states, healed, histories, removed_for_good, restored, resumed, room  # noqa: E402


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


def closed_forms():
    """Two masses and a spring; a bar under its end load; one spring's modulus."""
    two = bs.Lattice([-0.1, 1.1], [[0, 1]], stiffness=50.0, rest_length=1.0, mass=2.0)
    assert abs(bs.modes(two, 1).omega2[0] - 50.0) < 1e-9
    bar = bs.Lattice([[0.0], [1.0]], [[0, 1]], stiffness=100.0, fixed=[0], groups={"end": [1], "wall": [0]})
    eq = bs.statics(bar, loads={"end": 5.0}, load_steps=3)
    assert abs(eq.x[1, 0] - 1.05) < 1e-12 and abs(eq.tension[0] - 5) < 1e-10 and abs(eq.reactions["wall"][0] + 5) < 1e-10, (eq.x, eq.tension, eq.reactions)
    assert abs(eq.energy - 0.125) < 1e-12 and eq.load_factor == 1 and eq.steps == 3
    assert abs(bs.modes(eq, 1).omega2[0] - 100) < 1e-8
    ring = bs.Lattice([[0.0], [0.4]], [[0, 1], [1, 0]], stiffness=[3.0, 6.0], box=(1.0,), shift=[[0], [1]])
    assert abs(bs.moduli(ring).stiffness[0, 0] - 2.0) < 1e-10  # two springs in series over a length of 1


def changed_numbers():
    """Closed forms of a bar and of two springs side by side; a net's equilibria as statics() finds them afresh; motions; what cannot change."""
    bar = bs.Lattice([[0.0], [1.0]], [[0, 1], [0, 1]], stiffness=[100.0, 50.0], fixed=[0], groups={"end": [1], "wall": [0]}, parallel=True)
    with bs.Statics(bar, loads={"end": 6.0}) as solver:
        assert abs(solver.solve().x[1, 0] - 1.04) < 1e-12
        for stiffness, away, expected in ((200.0, (), 1.015), ([100, 20], (), 1.05), ([100, 20], [1], 1.06)):
            solver.change(stiffness=stiffness, remove=away)
            eq = solver.solve()
            assert abs(eq.x[1, 0] - expected) < 1e-12 and abs(eq.reactions["wall"][0] + 6) < 1e-10, (eq.x, eq.reactions)
        assert np.isnan(eq.tension[1]) and list(eq.lattice.stiffness) == [100, 0] and list(bar.stiffness) == [100, 50]
        solver.change(rest_length=[1.1, 1.0])
        assert abs(solver.solve().x[1, 0] - 1.16) < 1e-12
        for words, change in ((("stiffness", "row 0"), dict(stiffness=np.nan)), (("spring 1", "stiffness"), dict(stiffness=[1, -1])),
                              (("area", "stiffness"), dict(area=1.0)), (("remove", "entry 0", "2 springs"), dict(remove=[7])), (("shape",), dict(mass=[1, 2, 3])),
                              (("damper",), dict(stiffness=5.0, damping=1.0))):
            with raised(bs.InputError, *words):
                solver.change(**change)
        assert abs(solver.solve().x[1, 0] - 1.16) < 1e-12 and abs(solver.solve(afresh=True).x[1, 0] - 1.16) < 1e-12
        assert "Statics" in repr(solver) and "closed" not in repr(solver)
    with raised(RuntimeError, "closed"):
        solver.solve()
    net = bs.Lattice(**sheet())
    rng = np.random.default_rng(3)
    with bs.Statics(net, bs_gravity=(0, -1.0), snes_rtol=1e-12) as solver:
        solver.solve()
        for _ in range(5):
            k = net.stiffness * rng.uniform(0.5, 2, len(net.pairs))
            solver.change(stiffness=k)
            followed, afresh = solver.solve(), bs.statics(net.replace(stiffness=k), bs_gravity=(0, -1.0), snes_rtol=1e-12)
            assert abs(followed.x - afresh.x).max() < 1e-9 and abs(followed.energy - afresh.energy) < 1e-9 * afresh.energy
            assert np.allclose(bs.modes(followed, 3).omega2, bs.modes(afresh, 3).omega2, rtol=1e-8)
    one = bs.Lattice([-0.1, 1.1], [[0, 1]], stiffness=50.0, rest_length=1.0, mass=2.0)
    with bs.Simulation(one, dt=0.01, ts_type="cn", snes_rtol=1e-13) as simulation:
        simulation.step(10)
        stretch, moving = np.ptp(simulation.x) - 1, simulation.observables["kinetic_energy"]
        simulation.change(stiffness=80.0)
        assert abs(simulation.observables["elastic_energy"] - 0.5 * 80 * stretch**2) < 1e-12
        simulation.step(50)
        total = simulation.observables["kinetic_energy"] + simulation.observables["elastic_energy"]
        assert abs(total - (moving + 0.5 * 80 * stretch**2)) < 1e-9, total  # cn keeps the energy of a linear spring
        assert simulation.steps == 60 and simulation.lattice.stiffness[0] == 80


def load_steps():
    """What a bar does under a load that grows: seen step by step, stopped half way, and ended by an exception."""
    bar = bs.Lattice([[0.0], [1.0]], [[0, 1]], stiffness=100.0, fixed=[0], groups={"end": [1]})
    seen = []
    eq = bs.statics(bar, loads={"end": 6.0}, load_steps=6, observe=lambda s, state: seen.append((s, state.x[1, 0], state.tension[0], state.load_factor, state.steps)))
    assert np.allclose(seen, [(k / 6, 1 + 0.01 * k, k, k / 6, k) for k in range(1, 7)], atol=1e-11), seen
    assert abs(eq.x[1, 0] - 1.06) < 1e-12
    eq = bs.statics(bar, loads={"end": 6.0}, load_steps=6, stop=lambda s, state: state.tension[0] > 2.5)
    assert abs(eq.load_factor - 0.5) < 1e-12 and abs(eq.tension[0] - 3) < 1e-10 and eq.steps == 3, eq

    def failing(s, state):
        if s > 0.3:
            raise KeyError("enough")

    with raised(KeyError, "enough"):
        bs.statics(bar, loads={"end": 6.0}, load_steps=6, observe=failing)
    with raised(bs.InputError, "observe"):
        bs.statics(bar, loads={"end": 6.0}, observe=3)


def breaking_turns():
    """A beam of three points on two rollers, pressed in its middle: its angle spring breaks beyond M = F l/2, also when it was saved and read, and the beam
    folds up."""
    x, pairs, force, length = [[0.0, 0], [1, 0], [2, 0]], [[0, 1], [1, 2]], 0.5, 1.0
    beam = lambda limit: bs.Lattice(x, pairs, stiffness=1e5, groups={"ends": [0, 2], "middle": [1]},
                                    angles={"triples": [[0, 1, 2]], "stiffness": 2.0, "rest_angle": np.pi, "critical_moment": limit})
    solve = lambda net: bs.statics(net, loads={"middle": (0, -force)}, load_steps=10, bs_motion_ends="y=fixed", bs_motion_middle="x=fixed")
    moment = force * length / 2
    whole = solve(beam(1.05 * moment))
    assert not whole.fields["broken_angles"].any() and abs(whole.x[1, 1] + 0.0623) < 1e-3, whole.x
    with tempfile.TemporaryDirectory() as folder:
        beam(0.95 * moment).save(folder + "/beam.h5")
        again = bs.read(folder + "/beam.h5")
        assert again.angles["critical_moment"][0] == 0.95 * moment
        for net in (again, beam(0.95 * moment)):
            folded = solve(net)
            assert folded.fields["broken_angles"].all() and abs(folded.x[1, 1] + length) < 1e-5 and abs(np.diff(folded.x[[0, 2], 0])) < 1e-9, folded.x
    with raised(bs.InputError, "critical_moment", "row 0"):
        beam(np.nan)
    assert not solve(beam(np.inf)).fields["broken_angles"].any()
    with tempfile.TemporaryDirectory() as folder:  # one spring bears whatever comes
        bundle = bs.Lattice([[0.0], [1.0]], [[0, 1]] * 2, stiffness=1.0, fixed=[0], groups={"end": [1]}, parallel=True, breaking={"critical_force": [np.inf, 0.5]})
        bundle.save(folder + "/bundle.h5")
        again = bs.read(folder + "/bundle.h5")
        assert again.breaking["critical_force"].tolist() == [np.inf, 0.5]
        for net in (bundle, again):
            assert bs.statics(net, loads={"end": 1.5}, load_steps=10).broken.tolist() == [False, True]
    with raised(bs.InputError, "critical_moment"):
        solve(beam(-1.0))


def written_back():
    """A state that is changed is what a new motion from it would be; it starts the method anew."""
    net = bs.Lattice(**sheet())
    for options in (dict(), dict(ts_type="cn"), dict(ts_type="verlet"), dict(ts_type="bdf", ts_bdf_order=2, ts_adapt_type="none"), dict(ts_type="alpha2")):
        changed = []
        for frame in bs.run(net, dt=2e-3, until=0.04, every=0.02, **options):
            changed.append((frame.t, frame.x.copy(), frame.v.copy()))
            if len(changed) == 2:
                frame.v *= 0.5
                frame.x[5, 0] += 0.01
        (_, _, _), (_, x, v), (t, x_end, v_end) = changed
        x[5, 0] += 0.01
        *_, anew = bs.run(net.replace(x=x, velocity=0.5 * v), dt=2e-3, until=0.04, every=0.02, ts_init_time=0.02, **options)
        assert t == anew.t == 0.04, (t, anew.t)
        # methods of several steps leave a rounding error in the velocity of what is fixed, which a new lattice takes for 0
        most = 1e-14 if v[net.fixed].any() else 0.0
        assert abs(x_end - anew.x).max() <= most and abs(v_end - anew.v).max() <= 100 * most, (options, abs(x_end - anew.x).max())
    for more in (dict(), dict(bs_motion_bottom="y=velocity:0.5,x=fixed")):
        held, free = (bs.Simulation(net, dt=2e-3, **more) for _ in range(2))
        held.step(2)
        moved = held.x
        moved[net.fixed] += 0.1
        moved[net.groups["bottom"]] += 0.1 if more else 0.0
        held.x = moved  # of what is held or moves as given nothing changes
        free.step(2)
        free.x = free.x
        assert held.steps == 2 and np.array_equal(held.x, free.x)
        held.step()
        free.step()
        assert held.steps == 3 and np.array_equal(held.x, free.x) and not np.array_equal(held.x, moved)
    with tempfile.TemporaryDirectory() as folder, raised(bs.InputError, "bs_output"):
        with bs.Simulation(net, dt=2e-3, bs_output=f"{folder}/a.h5md") as writing:
            writing.v = 0 * writing.v


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


def own_forces():
    """A spring computed in Python is the built-in one; an error in it is raised; gravity by hand."""
    x, pairs = np.arange(5.0)[:, None], np.array([[i, i + 1] for i in range(4)])
    base = dict(stiffness=40.0, rest_length=0.95, mass=0.5, fixed=[0])
    for options in (dict(ts_type="verlet", dt=1e-3), dict(dt=1e-3, snes_rtol=1e-12), dict(ts_type="rk", dt=1e-3)):
        def pull(t, x, v, rows):
            f = np.zeros_like(x)
            assert rows.tolist() == [0, 1, 2, 3, 4] and x.shape == v.shape == (5, 1) and t >= 0
            force = 7.0 * (x[4] - x[2] - 1.5)
            f[2], f[4] = force, -force
            return f

        ours = bs.Simulation(bs.Lattice(x, pairs, **base), forces=pull, **options)
        theirs = bs.Simulation(bs.Lattice(x, np.vstack([pairs, [2, 4]]), **{**base, "stiffness": [40.0] * 4 + [7], "rest_length": [0.95] * 4 + [1.5]}), **options)
        ours.step(100)
        theirs.step(100)
        assert abs(ours.x - theirs.x).max() < 1e-13, (options, abs(ours.x - theirs.x).max())
    net = bs.Lattice(**sheet())
    weight = lambda s, x, v, rows: s * np.array([0, -2.0]) * net.mass[rows, None]
    eq, expected = bs.statics(net, forces=weight, load_steps=2), bs.statics(net, bs_gravity=(0, -2.0), load_steps=2)
    assert abs(eq.x - expected.x).max() < 1e-11 and np.allclose(eq.tension, expected.tension, atol=1e-9)

    # all particles in their order, whatever is fixed or driven: rows of the net are those of the forces
    held, wind = bs.Lattice(**{**sheet(), "fixed": [0, 1, 2, 20, 22]}), np.linspace(0, 1, 2 * len(net)).reshape(-1, 2)
    for options in (dict(ts_type="verlet"), {}, dict(bs_motion_bottom="x=fixed")):
        with bs.Simulation(held, dt=1e-3, forces=lambda t, x, v: wind, **options) as ours, \
                bs.Simulation(held.replace(particle_columns={"force": wind}), dt=1e-3, **options) as theirs:
            ours.step(20)
            theirs.step(20)
            assert abs(ours.x - theirs.x).max() < 1e-12, (options, abs(ours.x - theirs.x).max())
    with raised(bs.InputError, "forces", "real"):
        bs.Simulation(net, dt=1e-3, forces=lambda t, x, v: 1j * x).step()

    def broken(t, x, v):
        if t > 0.0045:
            raise ZeroDivisionError("in the wind")
        return 0 * x

    simulation = bs.Simulation(net, dt=1e-3, forces=broken)
    with raised(ZeroDivisionError, "in the wind"):
        simulation.run_until(1.0)
    assert simulation.steps == 4
    with raised(ValueError, "shape"):
        bs.Simulation(net, dt=1e-3, forces=lambda t, x, v: x[0]).step()
    with raised(bs.InputError, "function"):
        bs.statics(net, forces=3)


def implicit_forces():
    """Forces with their tangent and energy: a built-in spring's motion and Newton iterations, an equilibrium far from the start, modes, energies."""
    x, pairs = np.array([[0.0, 0], [1, 0.1], [2, 0]]), [[0, 1], [1, 2]]
    base = dict(stiffness=40.0, rest_length=[1.0, 1.1], mass=0.5)
    net = bs.Lattice(x, pairs, fixed=[0], **base)
    k, L, point = 300.0, 0.4, np.array([2.5, 0.8])
    last = lambda rows: (np.asarray(rows) == 2).astype(float)[:, None]

    def pull(t, x, v, rows):
        way = x - point
        l = np.linalg.norm(way, axis=1)[:, None]
        return -last(rows) * k * (l - L) * way / l

    def tangent(t, x, v, rows):
        way = x - point
        l = np.linalg.norm(way, axis=1)[:, None, None]
        uu = way[:, :, None] * way[:, None, :] / l**2
        return -last(rows)[:, None] * k * (uu + (1 - L / l) * (np.eye(2) - uu))

    def energy(t, x, rows):
        return last(rows)[:, 0] * k / 2 * (np.linalg.norm(x - point, axis=1) - L) ** 2

    ours = bs.Forces(pull, tangent=tangent, energy=energy)
    assert "tangent and energy" in repr(ours)
    tied = bs.Lattice(np.vstack([x, point]), [*pairs, [2, 3]], stiffness=[40.0, 40, k], rest_length=[1.0, 1.1, L], mass=0.5, fixed=[0, 3])
    for options in (dict(dt=0.05, snes_rtol=1e-13), dict(dt=0.05, snes_rtol=1e-13, ts_type="cn")):
        with bs.Simulation(net, forces=ours, **options) as mine, bs.Simulation(tied, **options) as theirs:
            counts = [[], []]
            for simulation, count in zip((mine, theirs), counts):
                simulation.on_step(lambda step, t, dt, newton, *_: count.append(newton))
                simulation.step(20)
            assert abs(mine.x - theirs.x[:3]).max() < 1e-12, abs(mine.x - theirs.x[:3]).max()
            assert np.array_equal(*counts), counts
            assert abs(mine.observables["total_energy"] - theirs.observables["total_energy"]) < 1e-11
    eq, expected = bs.statics(net, forces=ours), bs.statics(tied)
    assert abs(eq.x - expected.x[:3]).max() < 1e-9 and eq.newton <= expected.newton + 2, (eq.x - expected.x[:3], eq.newton, expected.newton)
    assert np.allclose(bs.modes(eq, 4).omega2, bs.modes(expected, 4).omega2, rtol=1e-8)
    # stiff drag, which no explicit part of Newton's method bears
    drag = bs.Forces(lambda t, x, v: -1e4 * v, tangent=lambda t, x, v: (np.zeros((2, 2)), -1e4 * np.eye(2)))
    stokes = dict(dt=0.1, bs_gravity=(0, -9.81), snes_rtol=1e-13)
    with bs.Simulation(net, forces=drag, **stokes) as mine, bs.Simulation(net, bs_stokes_drag=1e4, **stokes) as theirs:
        mine.step(5)
        theirs.step(5)
        assert abs(mine.x - theirs.x).max() < 1e-12
    with raised(ValueError, "tangent", "(3, 2, 2)"):
        bs.statics(net, forces=bs.Forces(pull, tangent=lambda t, x, v: np.zeros(3)))
    with raised(bs.InputError, "energy"):
        bs.Forces(pull, energy=3)


def coupled():
    """Two halves of a chain, each step repeated until they agree on the place of and the force on the particle that they share, are the whole chain."""
    x, k, options = 1.05 * np.arange(9.0)[:, None], 60.0, dict(dt=0.02, snes_rtol=1e-13)
    part = lambda a, b, **more: bs.Lattice(x[a:b], [[i, i + 1] for i in range(b - a - 1)], stiffness=k, rest_length=1.0, mass=1.0, groups={"end": [b - a - 1]}, **more)
    force = [0.0]
    pull = lambda t, x, v, rows: np.where((np.asarray(rows) == 0)[:, None], force[0], 0.0)
    with bs.Simulation(part(0, 9, fixed=[0]), **options) as whole, bs.Simulation(part(0, 5, fixed=[0]), bs_motion_end="given", **options) as left, \
            bs.Simulation(part(4, 9), forces=bs.Forces(pull), **options) as right:
        place = left.x[4, 0]
        for n in range(1, 11):
            states = left.save(), right.save()
            for _ in range(50):
                left.restore(states[0])
                right.restore(states[1])
                left.drive("end", [[place]], 0.02 * n)
                left.step()
                force[0] = -left.reactions[4, 0]
                right.step()
                off = right.x[0, 0] - place
                place += 0.9 * off
                if abs(off) < 1e-13:
                    break
            whole.step()
            assert abs(np.vstack([left.x, right.x[1:]]) - whole.x).max() < 1e-11, n
        with raised(bs.InputError, "given"):
            whole.drive("end", [[0.0]], 9.0)
        with raised(bs.InputError, "group 'top'"):
            left.drive("top", [[0.0]], 9.0)
        with raised(bs.InputError, "shape"):
            left.drive("end", [0.0], 9.0)
        with raised(bs.InputError, "later time"):
            left.drive("end", [[0.0]], 0.1)
        with raised(bs.InputError, "checkpoint"):
            left.checkpoint("left.checkpoint")
    with raised(bs.InputError, "bs_output"), tempfile.TemporaryDirectory() as folder:
        with bs.Simulation(part(0, 3), bs_output=f"{folder}/a.h5md", **options) as writing:
            writing.restore(writing.save())


def petsc_of(module):
    """The PETSc libraries that a file of machine code is linked with."""
    linked = subprocess.run(["ldd", module], capture_output=True, text=True, check=True).stdout
    return {os.path.realpath(path) for path in re.findall(r"=> (\S*libpetsc\S*)", linked)}


def in_petsc():
    """The stepper of a simulation as petsc4py has it: its solvers, its state, the size of its Jacobian; no petsc4py of another PETSc is loaded."""
    import petsc4py

    net = bs.Lattice(**sheet())
    ours = next(pathlib.Path(bs.__file__).parent.glob("_core*.so"))
    theirs = next(pathlib.Path(petsc4py.__file__).parent.glob("lib/**/PETSc.*.so"))
    if petsc_of(ours) != petsc_of(theirs):
        with bs.Simulation(net, dt=2e-3) as simulation, raised(ImportError, "built without petsc4py: petsc4py belongs to the PETSc in", "build it again"):
            simulation.petsc()
        return
    from petsc4py import PETSc

    with bs.Simulation(net, dt=2e-3, ts_type="cn", snes_rtol=1e-12, bs_operator="assembled") as simulation:
        simulation.step(3)
        ts = simulation.petsc()
        assert isinstance(ts, PETSc.TS) and ts.getType() == "theta" or ts.getType() == "cn", ts.getType()
        assert ts.getStepNumber() == 3 and abs(ts.getTime() - 6e-3) < 1e-15 and ts.getSNES().getConvergedReason() > 0
        assert ts.getSNES().getTolerances()[0] == 1e-12 and isinstance(ts.getSNES().getKSP(), PETSc.KSP)
        y = ts.getSolution().getArray(readonly=True).reshape(len(net), 2, 2)
        assert np.array_equal(np.sort(y[:, 0], axis=0), np.sort(simulation.x, axis=0))
        J = ts.getSNES().getJacobian()[0]
        assert J.getSize() == (4 * len(net), 4 * len(net))
    assert ts.getRefCount() == 1
    with bs.Statics(net, bs_gravity=(0, -9.81), snes_rtol=1e-12) as solver:
        with raised(bs.InputError, "no equilibrium"):
            solver.petsc()
        solver.solve()
        solver.change(stiffness=1.01 * net.stiffness)
        eq, ts = solver.solve(), solver.petsc()
        assert ts.getSNES().getConvergedReason() > 0 and abs(ts.getTime() - 1) < 1e-15 and ts.getSNES().getTolerances()[0] == 1e-12
        y = ts.getSolution().getArray(readonly=True).reshape(len(net), 2, 2)
        assert np.array_equal(np.sort(y[:, 0], axis=0), np.sort(eq.x, axis=0))


SQUARE = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "held"
2 2 "plate"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
3
1 1 2 1 1 1 2
2 2 2 2 1 1 2 3
3 2 2 2 1 1 3 4
$EndElements
"""


def files():
    """Networks go to files and come back as they were, also those that the program has read or generated."""
    with tempfile.TemporaryDirectory() as folder:
        diamond = bs.generate("diamond", (2, 2, 2), periodic="xyz", perturbation=0.05)
        for k, net in enumerate((bs.Lattice(**sheet()), bs.Lattice(**cell()), bs.Lattice(**parts()), bs.read(MESHES / "net.xsp"), diamond)):
            net.save(f"{folder}/{k}.h5")
            back = bs.read(f"{folder}/{k}.h5")
            for name, value in vars(net).items():
                found = getattr(back, name)
                for key in value if isinstance(value, dict) else ():
                    assert np.array_equal(value[key], found[key]), (k, name, key)
                assert isinstance(value, dict) or name == "parallel" or np.array_equal(value, found), (k, name, value, found)
            assert back.parallel  # files may have such springs
            assert repr(back) == repr(net)
        with raised(bs.InputError, "0.h5"):
            back.save(f"{folder}/0.h5")
        back.save(f"{folder}/0.h5", overwrite=True)
        assert len(bs.read(f"{folder}/0.h5")) == len(diamond) == 64 and diamond.periodic == (True, True, True)
        with raised(bs.InputError, "nowhere.h5"):
            bs.read(f"{folder}/nowhere.h5")
        with raised(bs.InputError, "bs_lattice_sise"):
            bs.generate("chain", 5, sise=3)
        mesh = pathlib.Path(folder) / "square.msh"
        mesh.write_text(SQUARE)
        square = bs.read(mesh, stiffness=100, total_mass=2.0, fixed=["held"], bs_group_top="ymax")
        assert square.pairs.shape == (5, 2) and set(square.groups) >= {"held", "plate", "top"} and square.fixed.tolist() == [True, True, False, False], square.groups
        assert (square.stiffness == 100).all() and np.allclose(square.mass, 0.5) and np.allclose(square.lengths().max(), 2**0.5) and square.dim == 2
        assert bs.read(mesh, stiffness=100, mass=1, dim=3, bs_gravity=None).dim == 3
        for words, options in (("stiffnes_", dict(stiffnes_=1)), ("positive", dict(stiffness=1, mass=-1)), ("bs_group_tip", dict(stiffness=1, mass=1, bs_group_tip="zmax_"))):
            with raised(bs.InputError, words):
                bs.read(mesh, **options)
        with raised(bs.InputError, "nowhere.msh: no such file"):
            bs.read(f"{folder}/nowhere.msh", stiffness=1)
        with raised(bs.InputError, "stiffness", "replace"):
            bs.read(f"{folder}/0.h5", stiffness=3)
    part = parts()
    for words, more in ((("anchors['particle'], row 1",), dict(anchors={**part["anchors"], "particle": [0, 6]})), (("anchors", "'spot'"), dict(anchors={"spot": 1})),
                        (("angles['triples']", "(n, 3)"), dict(angles={**part["angles"], "triples": [[0, 1]]})), (("hinges", "quads"), dict(hinges={"stiffness": 1.0})),
                        (("hinges['stiffness'], row 0",), dict(hinges={**part["hinges"], "stiffness": np.nan})), (("area, row 0", "positive"), dict(area=0.0))):
        with raised(bs.InputError, *words):
            bs.Lattice(**{**part, **more})
    with raised(bs.InputError, "critical_stress"):
        bs.Simulation(bs.Lattice(**{**part, "breaking": {"critical_stress": 1.0}}), dt=1e-3)


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


def every_step():
    """Without a distance there is a frame after every step, the last at the end."""
    net = bs.Lattice(**sheet())
    assert np.allclose([frame.t for frame in bs.run(net, dt=0.01, until=0.035)], [0, 0.01, 0.02, 0.03, 0.035], rtol=0, atol=1e-15)


def so_many_steps():
    """A run that ts_max_steps ends has the frame of then as its last, says so, and counts what was before a state was written back."""
    net = bs.Lattice(**sheet())
    for more, back, times in ((dict(ts_max_steps=2), False, [0, 0.01, 0.02]), (dict(ts_max_steps=7, every=0.05), False, [0, 0.05, 0.07]), (dict(ts_max_steps=0), False, [0]),
                              (dict(ts_max_steps=7, every=0.05), True, [0, 0.05, 0.07]), (dict(ts_max_steps=10), False, 0.01 * np.arange(11)),
                              (dict(ts_max_steps="12"), True, 0.01 * np.arange(11))):
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", bs.BackspringWarning)
            found = []
            for frame in bs.run(net, dt=0.01, until=0.1, **more):
                found.append(frame.t)
                frame.v *= 0.5 if back else 1.0
        assert np.allclose(found, times, rtol=0, atol=1e-12) and len(said) == (times[-1] < 0.1 - 1e-9), (more, found, [str(one.message) for one in said])
        assert all("ts_max_steps" in str(one.message) and one.filename == __file__ for one in said)


def held_groups():
    """Forces of supports by groups that are held; what else is held has its own, particle by particle."""
    bar = bs.Lattice([[0.0], [1.0], [2.0]], [[0, 1], [1, 2]], stiffness=[100.0, 200.0], fixed=[0, 2], groups={"middle": [1], "wall": [0]})
    eq = bs.statics(bar, loads={"middle": 3.0}, total=np.True_)
    assert list(eq.reactions) == ["wall"] and eq.reactions.get("middle") is None and "middle" not in eq.reactions and abs(eq.reactions["wall"][0] + 1) < 1e-12
    with raised(KeyError, "nothing holds", "'middle'", "wall"):
        eq.reactions["middle"]
    with bs.Simulation(eq, dt=1.0) as simulation:
        assert abs(simulation.reactions[:, 0] - [-1, 0, -2]).max() < 1e-12


def remembered():
    """What follows from an equilibrium goes by its loads and forces, and writes none of its files."""
    net = bs.Lattice(**sheet())
    pull = lambda s, x, v, rows: np.where(rows[:, None] < 7, s * np.array([0.0, -20.0]), 0.0)
    by_hand, by_option = bs.statics(net, forces=pull), bs.statics(net, loads={"bottom": (0, -20.0)})
    assert abs(by_hand.x - by_option.x).max() < 1e-10 and abs(bs.statics(by_hand).x - by_hand.x).max() < 1e-10
    assert np.allclose(bs.modes(by_hand, 3).omega2, bs.modes(by_option, 3).omega2, rtol=1e-8)
    with tempfile.TemporaryDirectory() as folder:
        bs.modes(bs.statics(net, loads={"bottom": (0, -20.0)}, bs_output=f"{folder}/eq.h5md"), 2)


def pulled():
    """A string of two springs of stiffness 1 and rest length 1, held at its first end and along y at its other end, which is pulled; unit masses."""
    return bs.Lattice([[0.0, 0], [1, 0], [2, 0]], [[0, 1], [1, 2]], stiffness=1.0, rest_length=1.0, fixed=[0], groups={"end": [2]})


def modes_where_it_stands():
    """Modes about an equilibrium as it stands: on the way to the full loads, in an observer, on a branch that a snap has led to; by closed forms."""
    across = lambda s: [(3 - np.sqrt(5)) / 2, 2 * s / (1 + s), (3 + np.sqrt(5)) / 2]  # along the string; across it 2 T/(m l) with T = s, l = 1 + s
    seen = []
    half = bs.statics(pulled(), loads={"end": (1.0, 0)}, load_steps=4, bs_motion_end="y=fixed", stop=lambda s, eq: s > 0.4,
                      observe=lambda s, eq: seen.append((s, bs.modes(eq, 3).omega2)))
    assert half.load_factor == 0.5 and len(seen) == 2
    for s, omega2 in [*seen, (0.5, bs.modes(half, 3).omega2), (0.5, bs.modes(pickle.loads(pickle.dumps(half)), 3).omega2)]:
        assert np.allclose(omega2, sorted(across(s)), rtol=1e-9), (s, omega2)
    rise, k = 0.3, 1000.0
    side = float(np.hypot(1, rise))
    truss = bs.Lattice([[-1.0, 0], [1, 0], [0, rise]], [[0, 2], [1, 2]], stiffness=k, rest_length=side, fixed=[0, 1], groups={"apex": [2]})
    with bs.Statics(truss, loads={"apex": (0, -1.0)}) as solver:
        for rest in (side, 0.9, side):
            solver.change(rest_length=rest)
            snapped = solver.solve()
    assert snapped.x[2, 1] < -0.2 and bs.statics(truss, loads={"apex": (0, -1.0)}).x[2, 1] > 0.2
    ways = snapped.x[2] - truss.x[:2]
    lengths = np.linalg.norm(ways, axis=1)
    K = sum(k * ((1 - side / l) * np.eye(2) + side / l * np.outer(r, r) / l**2) for r, l in zip(ways, lengths))
    assert np.allclose(bs.modes(snapped, 2).omega2, np.linalg.eigvalsh(K), rtol=1e-9)
    assert np.array_equal(bs.modes(half, 3, bs_break_strain=5.0).omega2, bs.modes(half, 3).omega2)  # limits that nothing has come to


def rests():
    """A motion from an equilibrium under its loads, forces and broken springs stays there; from one on the way to them it is refused."""
    held = dict(bs_motion_end="y=fixed")
    pull = lambda s, x, v, rows: np.where(rows[:, None] == 2, s * np.array([1.0, 0.0]), 0.0)
    loads = {"end": (1.0, 0)}
    for eq in (bs.statics(pulled(), loads=loads, load_steps=4, snes_rtol=1e-12, bs_step_max_cuts=3, **held), bs.statics(pulled(), forces=pull, **held)):
        for frame in bs.run(eq, dt=0.1, until=1.0, ts_type="cn"):
            assert abs(frame.x - [[0, 0], [2, 0], [4, 0]]).max() < 1e-9 and frame.rows == slice(0, 3), frame.x
    with bs.Simulation(eq, dt=0.1, forces=lambda t, x, v: 0 * x) as simulation:
        assert abs(simulation.forces[2, 0] + 1) < 1e-9  # other forces take their place
    side_by_side = bs.Lattice([0.0, 1.0], [[0, 1]] * 2, stiffness=1.0, rest_length=1.0, fixed=[0], groups={"end": [1]}, parallel=True,
                              breaking={"critical_force": [0.3, 9.0]})
    torn = bs.statics(side_by_side, loads={"end": 1.0}, load_steps=4, bs_break_max_steps=50)
    assert torn.broken.tolist() == [True, False] and abs(torn.x[1, 0] - 2) < 1e-9  # one spring bears the load of 1
    with bs.Simulation(torn, dt=0.1) as simulation:
        simulation.step(5)
        assert abs(simulation.x[1, 0] - 2) < 1e-9 and simulation.broken.tolist() == [True, False] and simulation.events.spring.tolist() == [0]
        assert simulation.lattice.stiffness.tolist() == [1, 1]  # as they were given
    assert abs(bs.modes(torn, 1).omega2[0] - 1) < 1e-9
    half = bs.statics(pulled(), loads=loads, load_steps=4, stop=lambda s, eq: s > 0.4, **held)
    with raised(bs.InputError, "load factor 0.5", "replace"):
        bs.Simulation(half, dt=0.1)
    with bs.Simulation(pulled(), dt=0.1) as simulation, raised(bs.InputError, "velocity, row 1", "finite"):
        simulation.set("velocity", [[0, 0], [np.nan, 0], [0, 0]])


def on_two_ranks():
    """An exception of one rank ends the call on all; many sessions end with the interpreter; changes of one rank's frame are all ranks'."""
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "square.msh").write_text(SQUARE)
        done = python(f"""
import backspring as bs
from mpi4py import MPI
comm, rank = MPI.COMM_WORLD, MPI.COMM_WORLD.rank
net = bs.read("{folder}/square.msh", stiffness=100, mass=1.0)
assert comm.allgather(net.pairs.tolist()) == [net.pairs.tolist()] * 2 and len(net) == 4
said = ""
try: bs.read("{folder}/square.msh", stiffness=100, mass=1.0 + rank)
except bs.InputError as error: said = str(error)
assert "mass" in said, said
try: bs.read("{folder}/none.msh", stiffness=100)
except bs.InputError as error: said = str(error)
assert "no such file" in said, said
""", 2, timeout=60)
        assert done.returncode == 0, done.stdout + done.stderr
    head = f"import sys; sys.path.insert(0, {str(HERE)!r}); import backspring as bs, numpy as np; from mpi4py import MPI; from cases import sheet; rank = MPI.COMM_WORLD.rank; net = bs.Lattice(**sheet()); say = lambda *words: [print(one) for one in MPI.COMM_WORLD.gather(' '.join(map(str, words))) or []]; "
    for code, expected in (('''
def forces(t, x, v, rows):
    if rank == 1 and t > 0.0045: raise KeyError("here")
    return 0 * x
simulation = bs.Simulation(net, dt=1e-3, forces=forces)
try: simulation.run_until(1.0)
except Exception as error: say(rank, type(error).__name__, simulation.steps)
''', ["0 Stopped 4", "1 KeyError 4"]), ('''
def stop(step, *_):
    if rank == 0 and step == 3: raise KeyError("here")
simulation = bs.Simulation(net, dt=1e-3)
simulation.on_step(stop)
try: simulation.step(10)
except Exception as error: say(rank, type(error).__name__)
''', ["0 KeyError", "1 Stopped"]), ('''
all = [bs.Simulation(net, dt=1e-3) for _ in range(12)]
for one in all: one.step()
del all
say(rank, "ended")
''', ["0 ended", "1 ended"]), ('''
simulation = bs.Simulation(net, dt=1e-3)
simulation.step()
stepper = simulation.petsc()
from petsc4py import PETSc
try: stepper.getSNES().getJacobian()[0].getDiagonalBlock()
except PETSc.Error as error: said = error.ierr > 0
try: stepper.getSNES().getKSP().setType("nix")
except PETSc.Error as error: simulation.step(); say(rank, simulation.steps, said, error.ierr > 0)
''', ["0 2 True True", "1 2 True True"]), ('''
last = None
for frame in bs.run(net, dt=1e-3, until=4e-3, every=2e-3):
    if rank == 0 and frame.t > 1e-3 and last is None: frame.v *= 0.5
    last = frame.t
say(rank, last)
''', ["0 0.004", "1 0.004"]), ('''
def raises(s, state):
    if rank == 1 and s > 0.4: raise KeyError("here")
for name in ("observe", "stop"):
    try: bs.statics(net, loads={"bottom": (0, -1.0)}, load_steps=4, **{name: raises})
    except Exception as error: say(rank, name, type(error).__name__)
''', ["0 observe Stopped", "0 stop Stopped", "1 observe KeyError", "1 stop KeyError"]), ('''
simulation, told = bs.Simulation(net, dt=1e-3, bs_motion_bottom="given"), []
for call in (lambda: simulation.set("velocity", net.x[:3] if rank else net.x), lambda: simulation.set("velocity", net.x * (np.nan if rank else 1)),
             lambda: simulation.change(stiffness=[1.0, 2] if rank else 5.0), lambda: simulation.drive("bottom", net.x[: 2 if rank else 7], 1.0),
             lambda: bs.statics(net, loads={"bottom": (0, -1.0)}, total=["nix"] if rank else False), lambda: bs.statics(net, observe=3 if rank else None),
             lambda: bs.statics(net, load_steps=2.5 if rank else 2), lambda: bs.Statics(net, load_steps=2.5 if rank else 2),
             lambda: bs.modes(net, 2.5 if rank else 2), lambda: bs.moduli(net, load_steps=2.5 if rank else 2),
             lambda: bs.run(net, dt=1e-3, until="a" if rank else 1.0, progress=True), lambda: bs.run(net, dt=1e-3, until=1.0, every=-1 if rank else 0.1),
             lambda: bs.Simulation(net, dt=1e-3, stop=3 if rank else None), lambda: simulation.drive("nix" if rank else "bottom", net.x[:7], 1.0),
             lambda: simulation.drive("bottom", net.x[:7], np.nan if rank else 1.0), lambda: simulation.step(-1 if rank else 1),
             lambda: simulation.run_until(np.nan if rank else 1.0), lambda: simulation.get("nix" if rank else "position"),
             lambda: bs.Statics(net).sensitivities(np.zeros(3 if rank else net.x.shape))):
    try: call()
    except bs.InputError as error: told.append(str(error).startswith("rank 1: ") == (rank == 0))
simulation.step()
for call in (lambda: simulation.step(2 + rank), lambda: simulation.run_until(1.0 + rank), lambda: simulation.drive("bottom", net.x[:7], 1.0 + rank),
             lambda: simulation.set("velocity", net.x * (1.0 + rank)), lambda: simulation.set("velocity", net.x[simulation.rows], whole=rank == 0)):
    try: call()
    except bs.InputError as error: told.append("rank 1 gives something else" in str(error))
simulation.step()
say(rank, len(told), all(told), simulation.steps)
''', ["0 24 True 2", "1 24 True 2"]), ('''
net = bs.Lattice([[0.0, 0], [1, 0], [2, 0]], [[0, 1], [1, 2]], stiffness=1.0, rest_length=1.0, fixed=[0], groups={"end": [2]})
half = bs.statics(net, loads={"end": (1.0, 0)}, load_steps=4, bs_motion_end="y=fixed", stop=lambda s, eq: s > 0.4)
say(rank, *(round(bs.modes(half, 3, comm=comm).omega2[1], 6) for comm in (None, MPI.COMM_SELF)))
''', ["0 0.666667 0.666667", "1 0.666667 0.666667"]), ('''
import os, shutil, tempfile
folder = MPI.COMM_WORLD.bcast(tempfile.mkdtemp())
for one in (net, bs.statics(net)): one.plot(f"{folder}/{type(one).__name__}.png")
frames = list(bs.run(net, dt=1e-3, until=1.0, ts_max_steps=3))
frames[0].plot(f"{folder}/Frame{rank}.png")
MPI.COMM_WORLD.barrier()
say(rank, len(frames), *sorted(os.listdir(folder)))
if rank == 0: shutil.rmtree(folder)
''', [f"{rank} 4 Equilibrium.png Frame0.png Frame1.png Lattice.png" for rank in (0, 1)])):
        done = subprocess.run(["mpirun", "-n", "2", sys.executable, "-c", head + code], capture_output=True, text=True, timeout=120, env=dict(os.environ, PYTHONPATH=PYTHON))
        assert done.returncode == 0 and sorted(done.stdout.splitlines()) == expected, done.stdout + done.stderr


def without_steps():
    """Energies, forces and fields of a moment; a balance of forces."""
    net = bs.Lattice(**sheet())
    with bs.Simulation(net, dt=1e-3, bs_gravity=(0, -9.81), bs_output_springs=True) as simulation:
        simulation.step(3)
        f, frame = simulation.forces, simulation.frame()
        a, b = net.pairs.T
        way = simulation.x[b] - simulation.x[a]
        pull = way / np.linalg.norm(way, axis=1)[:, None] * frame["fields"]["tension"][:, None]
        sums = np.zeros_like(f) - [0, 9.81] * net.mass[:, None]
        np.add.at(sums, a, pull)
        np.add.at(sums, b, -pull)
        damped = simulation.lattice.damping.any()
        assert damped and abs(sums - f)[~net.fixed].max() < 3 * abs(f).max(), "tension holds the springs' forces"
        kinetic = 0.5 * (net.mass[:, None] * simulation.v**2)[~net.fixed].sum()
        assert abs(frame["observables"]["kinetic_energy"] - kinetic) < 1e-12 * (1 + kinetic)


def observers():
    """Called after every step; what they raise ends the call and leaves the last good state."""
    net, seen = bs.Lattice(**sheet()), []
    simulation = bs.Simulation(net, dt=1e-3)
    simulation.on_step(lambda step, t, dt, newton, krylov, rejected: seen.append((step, round(t, 6), newton > 0)))
    simulation.step(3)
    assert seen == [(1, 0.001, True), (2, 0.002, True), (3, 0.003, True)], seen

    def stop(step, *_):
        if step == 5:
            raise ZeroDivisionError("enough")

    simulation.on_step(stop)
    with raised(ZeroDivisionError, "enough"):
        simulation.run_until(1.0)
    assert 5 <= simulation.steps <= 6
    simulation.on_step(None)
    simulation.step(2)
    assert 7 <= simulation.steps <= 8


def interrupted():
    """An interrupt ends a long call with KeyboardInterrupt; the interpreter, and the session, go on."""
    code = f"""
import sys, threading, time, os, signal
sys.path.insert(0, {str(HERE)!r})
import backspring as bs
from cases import sheet
simulation = bs.Simulation(bs.Lattice(**sheet()), dt=1e-4)
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    simulation.run_until(1e6)
except KeyboardInterrupt:
    before = simulation.steps
    simulation.step(2)
    print("interrupted", before > 10, simulation.steps == before + 2)
"""
    done = python(code, timeout=120)
    assert done.stdout.split() == ["interrupted", "True", "True"] and done.returncode == 0, done.stdout + done.stderr


def side_by_side():
    """Two motions by turns are the same two one after the other."""
    nets = [bs.Lattice(**sheet()), bs.Lattice(**cell())]
    alone = []
    for net in nets:
        simulation = bs.Simulation(net, dt=1e-3, ts_type="cn", bs_break_strain=None)
        simulation.step(6)
        alone.append(simulation.x)
    both = [bs.Simulation(net, dt=1e-3, ts_type="cn") for net in nets]
    for _ in range(6):
        for simulation in both:
            simulation.step()
    for simulation, x in zip(both, alone):
        assert np.array_equal(simulation.x, x)


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


def memory():
    """A thousand solves in one process."""
    net = bs.Lattice(**sheet())
    resident = lambda: int(pathlib.Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    for _ in range(100):
        bs.statics(net, loads={"bottom": (0, -1.0)})
    before = resident()
    for _ in range(1000):
        bs.statics(net, loads={"bottom": (0, -1.0)})
    grown = resident() - before
    assert grown < 1e6, f"{grown} bytes in 1000 solves"


def pictures_and_tools():
    with tempfile.TemporaryDirectory() as folder:
        eq = bs.statics(bs.Lattice(**sheet()), loads={"bottom": (0, -1.0)})
        eq.plot(f"{folder}/state.png")
        assert os.path.getsize(f"{folder}/state.png") > 20000
        for frame in bs.run(bs.Lattice(**sheet()), dt=1e-3, until=5e-3, every=1e-3, bs_output=f"{folder}/run.h5md"):
            last = frame
        run = bs.open(f"{folder}/run.h5md")
        assert np.array_equal(run.position(len(run.times) - 1), last.x)
        done = subprocess.run([sys.executable, "-m", "backspring", "plot", f"{folder}/run.h5md", "-o", f"{folder}/energy.png", "--kind", "energy"],
                              capture_output=True, text=True, env=dict(os.environ, PYTHONPATH=PYTHON))
        assert done.returncode == 0 and os.path.exists(f"{folder}/energy.png"), done.stderr


def documented():
    """The commands of the page run as they stand."""
    page = (HERE.parents[1] / "src/python/README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", page, re.S)
    assert blocks
    with tempfile.TemporaryDirectory() as folder:
        done = python(blocks[0], cwd=folder, timeout=120)
        assert done.returncode == 0 and len(done.stdout.splitlines()) >= 8 and os.path.exists(f"{folder}/state.png"), done.stdout + done.stderr


def imported():
    """Without a launcher, and ended without a word."""
    done = python("import sys, backspring; print([name for name in ('mpi4py', 'h5py', 'matplotlib') if name in sys.modules])", timeout=60)
    assert done.stdout == "[]\n", done.stdout + done.stderr
    done = python("import backspring as bs; s = bs.Simulation(bs.Lattice([0.0, 1.0], [[0, 1]]), dt=0.1); s.step()", timeout=60)
    assert done.returncode == 0 and done.stdout + done.stderr == "", done.stdout + done.stderr


def main():
    chosen = sys.argv[sys.argv.index("--filter") + 1] if "--filter" in sys.argv else ""
    for part in (on_two_ranks, on_ranks, foreign_states, healed, resumed,  # before this process starts MPI
                 bad_arguments, copied, closed_forms, changed_numbers, restored, removed_for_good, modes_where_it_stands, rests, histories, room, sensitivities, designed, load_steps, breaking_turns, written_back, told_once, own_forces, implicit_forces, coupled, in_petsc, files, misuse, every_step, so_many_steps, held_groups, remembered, without_steps, observers, interrupted, side_by_side, failures, memory, pictures_and_tools, documented, imported):
        if chosen in part.__name__:
            begin = time.time()
            part()
            print(f"{part.__name__}: ok, {time.time() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
