"""What the package shows of states, and what becomes of it: arrays that nothing follows, places that modes are about, motions without an end, velocities in
boxes that are strained."""
import copy
import pickle
import tempfile
import warnings

import h5py
import numpy as np
from helpers import python, raised

import backspring as bs
from cases import sheet


def assigned(holder, name):
    getattr(holder, name)[0] = 0


def read_only():
    """Nothing is written into a copy in silence: arrays of simulations, frames and equilibria refuse it and say what to write; a whole array, and one that is
    computed from the last, is taken. What was computed from them is an ordinary array."""
    net = bs.Lattice(**{**sheet(), "breaking": {"critical_strain": 9.0}})
    seen = []

    def observe(t, frame):
        for name in ("x", "v", "forces", "strain", "broken"):
            with raised(ValueError, "read-only", "simulation.v = v"):
                assigned(frame, name)
        seen.append(frame.v)

    with bs.Simulation(net, dt=1e-3, bs_gravity=(0, -9.81), observe=observe) as simulation:
        simulation.step(2)
        before = [simulation.get(what) for what in ("position", "velocity", "force", "reaction")]
        for name in ("x", "v", "forces", "reactions", "broken"):
            with raised(ValueError, "read-only", "simulation.v = v"):
                assigned(simulation, name)
            with raised(ValueError, "read-only"):
                np.add(getattr(simulation, name), 1, out=getattr(simulation, name), casting="unsafe")
        with raised(ValueError, "read-only"):
            simulation.v[3] += 1.0
        assert all(np.array_equal(one, getattr(simulation, name)) for one, name in zip(before, ("x", "v", "forces", "reactions")))
        before[1][3] = 1.0  # get() gives a copy of one's own
        for change in ("v *= 0.5", "v += 0.25", "v -= 0.5", "v /= 2"):
            expected = {"one": simulation.v.copy()}
            exec(change.replace("v", "one", 1), expected)
            exec("simulation." + change)
            assert np.array_equal(simulation.v[~net.fixed], expected["one"][~net.fixed]), change
        own = simulation.v.copy()
        own[10, 0] = 7.0
        simulation.v = own
        assert simulation.v[10, 0] == 7.0 and len(seen) == 2
        twice, total, slope = 2 * simulation.v, simulation.v.sum(), np.zeros_like(simulation.x)
        assert type(twice) is np.ndarray and isinstance(total, float) and repr(simulation.v) == repr(own) and type(simulation.v.max(axis=0)) is np.ndarray
        slope[3] = 1.0
        twice[3] = slope[3]
        assert np.array_equal(pickle.loads(pickle.dumps(simulation.v)), own) and np.array_equal(copy.deepcopy(simulation.v), own)
    eq = bs.statics(net, bs_gravity=(0, -9.81))
    for one in (eq, pickle.loads(pickle.dumps(eq))):
        for name in ("x", "tension", "broken"):
            with raised(ValueError, "read-only"):
                assigned(one, name)
    for frame in bs.run(net, dt=1e-3, until=2e-3):
        frame.v[3] += 1.0  # which the motion follows
        with raised(ValueError, "read-only"):
            frame.forces[3] = 1.0
    assert abs(frame.v[3]).min() > 0.5


def modes_about():
    """The places of modes are those that they are about: of the equilibrium that was found for them, and of groups that are driven, where they are then."""
    bar = bs.Lattice([[0.0], [1.0]], [[0, 1]], stiffness=100.0, fixed=[0], groups={"end": [1]})
    about = bs.modes(bar, 1, bs_modes_about="equilibrium", bs_force_end=5.0)
    assert abs(about.x[1, 0] - 1.05) < 1e-9 and abs(about.omega2[0] - 100) < 1e-8 and about.box is None, about.x
    net = bs.Lattice(**sheet())
    for more in (dict(), dict(bs_motion_bottom="y=velocity:-0.1")):
        eq = bs.statics(net, bs_gravity=(0, -9.81), load_steps=2, **more)
        found = bs.modes(net, 3, bs_modes_about="equilibrium", bs_gravity=(0, -9.81), bs_load_steps=2, **more)
        assert abs(found.x - eq.x).max() < 1e-9 and abs(eq.x - net.x).max() > 1e-3 and np.array_equal(bs.modes(eq, 3).x, eq.x)
        assert np.allclose(found.omega2, bs.modes(eq, 3).omega2, rtol=1e-6)
    assert np.array_equal(bs.modes(net, 3).x, net.x)
    cell = bs.generate("triangular", (4, 4), dim=2, periodic="xy", perturbation=0.1, seed=1)
    strained = bs.modes(cell, 2, bs_modes_about="equilibrium", bs_box_strain="xy=velocity:0.1")
    assert np.allclose(strained.box, cell.box @ np.array([[1, 0], [0.1, 1]])) and np.array_equal(bs.modes(cell, 2).box, cell.box)


def without_an_end():
    """A motion that nobody has given an end has none, however short its steps are: twenty of 0.4 ns, from later times, too; one that is given is kept."""
    net = bs.Lattice([-0.1, 1.1], [[0, 1]], stiffness=50e12, rest_length=1.0, mass=2.0)
    for start in (0.0, 1e-3):
        with bs.Simulation(net, dt=4e-10, ts_type="cn", ts_init_time=start) as simulation:
            simulation.step(20)
            assert abs(simulation.t - start - 8e-9) < 1e-16 and simulation.steps == 20
    with raised(bs.InputError, "2.5e+09 steps", "-ts_max_time"):
        bs.Simulation(net, dt=4e-10, ts_max_time=1.0).step()


def flowing_boxes():
    """A trajectory of a sheared box is a lattice that goes on as the motion would have: its velocities are those beside the flow, which a motion adds again."""
    net = bs.generate("triangular", (6, 6), dim=2, periodic="xy", perturbation=0.1, seed=3, damping=0.2)
    net = net.replace(velocity=0.2 * np.random.default_rng(1).standard_normal(net.x.shape))
    flow = dict(bs_box_strain="xy=velocity:0.5", ts_type="cn", dt=0.01, snes_rtol=1e-13)
    L = np.array([[0, 0.5], [0, 0]])
    with tempfile.TemporaryDirectory() as folder:
        first = list(bs.run(net, until=0.5, every=0.5, bs_output=f"{folder}/a.h5md", **flow))[-1]
        whole = list(bs.run(net, until=1.0, every=1.0, **flow))[-1]
        assert abs(list(bs.run(net, until=0.0, **flow))[0].v - net.velocity - net.x @ L.T).max() < 1e-14
        again = bs.read(f"{folder}/a.h5md")
        assert abs(again.velocity - (first.v - first.x @ L.T)).max() < 1e-13 and np.array_equal(again.x, first.x)
        begun = list(bs.run(again, until=0.5, every=0.5, **flow))
        assert abs(begun[0].v - first.v).max() < 1e-13 and abs(begun[-1].x - whole.x).max() < 1e-10 and abs(begun[-1].v - whole.v).max() < 1e-10
        with h5py.File(f"{folder}/a.h5md", "a") as f:  # as earlier versions wrote it
            del f["particles/trajectory/box/velocity_gradient"]
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            assert np.array_equal(bs.read(f"{folder}/a.h5md").velocity, first.v)
        assert ["bs_box_strain" in str(one.message) and "once more" in str(one.message) for one in told] == [True], told
        again.save(f"{folder}/lattice.h5")
        assert np.array_equal(bs.read(f"{folder}/lattice.h5").velocity, again.velocity)
        still = list(bs.run(net, until=0.1, every=0.1, bs_output=f"{folder}/still.h5md", **{**flow, "bs_box_strain": None}))[-1]
        assert np.array_equal(bs.read(f"{folder}/still.h5md").velocity, still.v)


SOLVERS = """
import gc
import backspring as bs
import numpy as np
from cases import sheet
net, gravity = bs.Lattice(**sheet()), dict(bs_gravity=(0, -9.81))
def taken(ts):
    snes = ts.getSNES()
    return ts, snes, snes.getKSP(), snes.getJacobian()[0], ts.getSolution()
def refused(call):
    try:
        call()
    except RuntimeError as error:
        return "ask the simulation for its solver again" in str(error)
def ended(ts, snes, ksp, J, y, implicit=True):
    others = [bs.Simulation(net, dt=1e-3) for _ in range(10)]  # which take memory that was freed
    for one in others: one.step()
    b, x = y.duplicate(), y.duplicate()
    b.set(1.0)
    calls = [ts.step, lambda: ts.solve(y)]
    if implicit: calls += [lambda: snes.solve(None, x), lambda: ksp.solve(b, x), lambda: snes.computeFunction(y, x), lambda: ts.computeIFunction(0.0, y, b, x)]
    if implicit and J.getType() == "shell": calls += [lambda: J.mult(b, x)]
    before = y.norm()
    assert [k for k, call in enumerate(calls) if not refused(call)] == [], ts.getType()
    assert y.norm() == before and ts.getStepNumber() == 3 and (not implicit or J.getSize()[0] == 4 * len(net)), ts.getType()
for options in (dict(), dict(ts_type="cn", bs_operator="assembled"), dict(ts_type="alpha2"), dict(ts_type="bdf", ts_bdf_order=2, ts_adapt_type="none"), dict(snes_type="newtonls", pc_type="lu", bs_operator="assembled"), dict(ts_type="rk"), dict(ts_type="verlet"), dict(ts_type="symplectic")):
    implicit = options.get("ts_type") not in ("rk", "verlet", "symplectic")
    simulation = bs.Simulation(net, dt=1e-3, **gravity, **options)
    start = simulation.save()
    simulation.step(3)
    own = taken(simulation.petsc())
    simulation.restore(start)
    simulation.step(2)
    x = simulation.x
    ended(*own, implicit)
    assert np.array_equal(simulation.x, x) and simulation.petsc().getStepNumber() == 2
    simulation.step()
    own = taken(simulation.petsc())
    simulation.close()
    del simulation
    gc.collect()
    ended(*own, implicit)
    del own
    gc.collect()
solver = bs.Statics(net, **gravity)
solver.solve()
ts, snes, ksp, J, y = taken(solver.petsc())
solver.close()
assert refused(ts.step) and refused(lambda: snes.solve(None, y)) and refused(lambda: J.mult(y, y.duplicate())) and abs(ts.getTime() - 1) < 1e-15
print("ended")
"""


def solvers_that_ended():
    """PETSc's solvers of a simulation that has ended, or gone on from another state, can be looked at, and refuse to compute: in a process of its own."""
    try:
        with bs.Simulation(bs.Lattice(**sheet()), dt=1e-3) as simulation:
            simulation.petsc()
    except ImportError:
        return
    done = python(SOLVERS, timeout=100)
    assert done.returncode == 0 and done.stdout.endswith("ended\n"), (done.returncode, done.stdout, done.stderr[-3000:])
