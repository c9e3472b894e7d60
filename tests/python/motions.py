"""Motions: states that are written back, frames, observers, interruptions, simulations side by side."""
import tempfile
import warnings

import numpy as np
from helpers import HERE, python, raised

import backspring as bs
from cases import cell, sheet


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
        moved = held.get("position")
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


def remembered():
    """What follows from an equilibrium goes by its loads and forces, and writes none of its files."""
    net = bs.Lattice(**sheet())
    pull = lambda s, x, v, rows: np.where(rows[:, None] < 7, s * np.array([0.0, -20.0]), 0.0)
    by_hand, by_option = bs.statics(net, forces=pull), bs.statics(net, loads={"bottom": (0, -20.0)})
    assert abs(by_hand.x - by_option.x).max() < 1e-10 and abs(bs.statics(by_hand).x - by_hand.x).max() < 1e-10
    assert np.allclose(bs.modes(by_hand, 3).omega2, bs.modes(by_option, 3).omega2, rtol=1e-8)
    with tempfile.TemporaryDirectory() as folder:
        bs.modes(bs.statics(net, loads={"bottom": (0, -20.0)}, bs_output=f"{folder}/eq.h5md"), 2)


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
