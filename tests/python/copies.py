#!/usr/bin/env python3
"""What is found outlives the motion, the process and the session that it was found by: copies and pickles."""
import copy
import gc
import os
import pathlib
import pickle
import subprocess
import sys
import tempfile

import numpy as np
from helpers import HERE, PYTHON, raised

import backspring as bs
from cases import cell, parts, sheet

AWAY = """
import pickle, sys
frames, rest = pickle.load(open(sys.argv[1], "rb"))
assert "mpi4py" not in sys.modules
pickle.dump(([(f.t, f.x, f.v, f.energy, f.strain, f.broken, f.events.spring, sorted(f.observables), f.rows) for f in frames], [repr(one) for one in rest]),
            open(sys.argv[1], "wb"))
"""

POOL = """
import multiprocessing, sys
import backspring as bs
from cases import sheet

def swing(factor):
    net = bs.Lattice(**{**sheet(), "mass": factor * sheet()["mass"]})
    return list(bs.run(net, dt=1e-3, until=3e-3)), bs.statics(net, loads={"bottom": (0, -factor)}), net

if __name__ == "__main__":
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = pool.map(swing, [1.0, 2.0])
    for factor, (frames, eq, net) in zip((1.0, 2.0), found):
        own = swing(factor)
        assert (frames[-1].x == own[0][-1].x).all() and (eq.x == own[1].x).all() and (net.mass == own[2].mass).all()
    print("pooled")
"""


def read(frame):
    """All that a frame says, but its forces."""
    return frame.t, frame.x, frame.v, frame.energy, frame.strain, frame.broken, frame.events.spring, sorted(frame.observables), frame.rows


def same(one, other):
    return len(one) == len(other) and all(np.array_equal(a, b, equal_nan=getattr(a, "dtype", None) == float) for a, b in zip(one, other))


def frames_alone():
    """A frame is copied with what it says at its moment, after the motion has gone on and ended, too, and what the loop has changed; a copy cannot be written to."""
    net = bs.Lattice(**{**sheet(), "breaking": {"critical_strain": np.random.default_rng(1).uniform(0.02, 0.4, 101)}})
    copies, frames, forces = [], [], []
    for frame in bs.run(net, dt=2e-3, until=0.4, every=0.1, ts_type="verlet", bs_gravity=(0, -30.0)):
        if frame.t == 0.2:
            frame.v *= 0.9
        frames.append(frame)
        copies.append([pickle.loads(pickle.dumps(frame)), copy.deepcopy(frame), copy.copy(frame)])
        forces.append(frame.forces.copy())
    assert len(frames[-1].events) > 3 and frames[-1].broken.any()
    for frame, force, made in zip(frames, forces, copies):
        for one in [*made, pickle.loads(pickle.dumps(made[0]))]:
            assert same(read(one), read(frame)) and np.array_equal(one.forces, force), frame
            assert repr(one) == repr(frame) and one._repr_html_() == frame._repr_html_()
    late = pickle.loads(pickle.dumps(bs.run(net, dt=2e-3, until=0.1).__next__()))  # whose loop has ended
    ended = pickle.loads(pickle.dumps(list(bs.run(net, dt=1e-3, until=3e-3))))
    assert len({id(one.lattice) for one in ended}) == 1 and ended[-1].rows == slice(0, 42)
    with raised(bs.Error, "copy", "forces"):
        ended[0].forces
    for name in ("x", "v"):
        with raised(bs.Error, "copy", "loop"):
            setattr(late, name, 2 * getattr(late, name))
        with raised(ValueError, "read-only"):
            getattr(late, name)[0] = 1.0
    seen = []
    simulation = bs.Simulation(net, dt=1e-3, observe=lambda t, frame: seen.append((pickle.dumps(frame), frame.x, frame.forces)))
    simulation.step(2)
    for at, (one, x, force) in enumerate(seen):
        one = pickle.loads(one)
        assert abs(one.t - 1e-3 * (at + 1)) < 1e-15 and np.array_equal(one.x, x) and np.array_equal(one.forces, force)


def found_alone():
    """Lattices, equilibria, modes, moduli, events and errors come back as they went, in another process without MPI, too."""
    net = bs.Lattice(**sheet())
    eq = bs.statics(net, loads={"bottom": (0, -1.0)})
    modes, moduli, strip = bs.modes(eq, 3), bs.moduli(bs.Lattice(**cell())), bs.Lattice(**parts())
    frames, rest = list(bs.run(net, dt=1e-3, until=3e-3)), [net, strip, eq, modes, moduli, eq.events]
    for again in (pickle.loads(pickle.dumps(rest)), copy.deepcopy(rest)):
        for one, other in zip(again, rest):
            assert repr(one) == repr(other) and one is not other
        assert np.array_equal(again[2].x, eq.x) and np.array_equal(again[2].reaction, eq.reaction) and list(again[2].reactions) == list(eq.reactions)
        assert np.array_equal(again[3].shapes, modes.shapes) and np.array_equal(again[4].stiffness, moduli.stiffness)
        assert np.array_equal(again[4].equilibrium.x, moduli.equilibrium.x) and np.array_equal(bs.modes(again[2], 3).omega2, modes.omega2)
        assert np.array_equal(bs.statics(again[0], loads={"bottom": (0, -1.0)}).x, eq.x) and np.array_equal(again[1].angles["triples"], strip.angles["triples"])
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "found"
        file.write_bytes(pickle.dumps((frames, rest)))
        done = subprocess.run([sys.executable, "-c", AWAY, str(file)], capture_output=True, text=True, timeout=60, env=dict(os.environ, PYTHONPATH=PYTHON))
        assert done.returncode == 0 and done.stderr == "", done.stderr
        said, words = pickle.loads(file.read_bytes())
    assert all(same(one, read(frame)) for one, frame in zip(said, frames)) and words == [repr(one) for one in rest]
    for error in (bs.ConvergenceError("none", frames[-1]), bs.InputError("x"), bs.Stopped("y")):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error) and ("state" not in vars(error) or np.array_equal(again.state.x, frames[-1].x))


def bound():
    """What lives in a session is not copied, and says what can be; a saved state is its own copy."""
    net = bs.Lattice(**sheet())
    with bs.Simulation(net, dt=1e-3) as simulation, bs.Statics(net) as solver:
        simulation.step()
        state = simulation.save()
        for one, words in ((state, ("checkpoint()", "restart()")), (simulation, ("Simulation", "checkpoint()")), (solver, ("Statics", "equilibrium"))):
            with raised(TypeError, *words):
                pickle.dumps(one)
        for one in (simulation, solver):
            with raised(TypeError, "stays in its process"):
                copy.deepcopy(one)
        simulation.step(2)
        x = simulation.x
        for again in (copy.copy(state), copy.deepcopy(state)):
            simulation.restore(again)
            simulation.step(2)
            assert np.array_equal(simulation.x, x)


def pooled():
    """Processes of a pool compute and send what they find."""
    with tempfile.TemporaryDirectory() as folder:
        script = pathlib.Path(folder) / "pool.py"
        script.write_text(POOL)
        done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60, env=dict(os.environ, PYTHONPATH=f"{PYTHON}:{HERE}"))
    assert done.returncode == 0 and done.stdout == "pooled\n" and done.stderr == "", done.stdout + done.stderr


def views():
    """Views are at every moment, bit for bit, what a copy is: of every method, in observers, after states that are set, restored and changed. They outlive the
    simulation, cannot be written to, and are refused where the state does not stand in the lattice's order."""
    net, rows = bs.Lattice(**sheet()), dict(dt=1e-3, bs_gravity=(0, -9.81), bs_ordering="rows")
    for more in (dict(), dict(ts_type="cn"), dict(ts_type="verlet"), dict(ts_type="symplectic"), dict(ts_type="rk"), dict(ts_type="arkimex"), dict(ts_type="alpha2"),
                 dict(ts_type="bdf", ts_bdf_order=2, ts_adapt_type="none"), dict(ts_type="rosw")):
        simulation = bs.Simulation(net, **rows, **more)
        x, v = simulation.view("position"), simulation.view("velocity")
        start, seen = x.copy(), []
        agree = lambda: np.array_equal(x, simulation.x) and np.array_equal(v, simulation.v)
        assert x.shape == net.x.shape and np.array_equal(x, net.x) and agree(), more
        simulation.on_step(lambda *_: seen.append(agree()))
        simulation.step(3)
        assert agree() and seen == [True] * 3 and not np.array_equal(x[~net.fixed], start[~net.fixed]), more
        state, then = simulation.save(), x.copy()
        simulation.v = 0.5 * simulation.v
        assert np.array_equal(v[~net.fixed], simulation.v[~net.fixed]) and agree(), more
        simulation.step(2)
        simulation.restore(state)
        assert np.array_equal(x, then) and agree(), more
        simulation.change(stiffness=2 * net.stiffness)
        simulation.step(2)
        assert agree() and np.shares_memory(x, simulation.view("position")), more
    with raised(ValueError, "read-only"):
        x[0] = 1.0
    with raised(ValueError):
        x.setflags(write=True)
    end = simulation.x
    simulation.close()
    del simulation, agree
    gc.collect()
    for one in [bs.Simulation(net, **rows) for _ in range(20)]:  # which would take memory that was freed
        one.step()
    assert np.array_equal(x, end)
    for words, more in ((("-bs_ordering rows",), dict(bs_ordering=None)), (("groups", "copies"), dict(bs_motion_bottom="y=velocity:0.1"))):
        with raised(bs.InputError, *words):
            bs.Simulation(net, **{**rows, **more}).view("position")
    with raised(bs.InputError, "velocity"):
        bs.Simulation(net, **rows).view("force")
    unread = list(bs.run(net, dt=1e-3, until=2e-3))
    assert all(frame._x is None and frame._v is None for frame in unread)  # nothing is copied that is not asked for
