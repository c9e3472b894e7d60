"""Where two abilities of the package meet: saved states and given motions, changes and losses, equilibria and the motions from them, failures and what
follows them."""
import pathlib
import tempfile

import backspring as bs
import numpy as np

from cases import cell, sheet
from helpers import python, raised

CHAIN = dict(x=[0.0, 1.0, 2.0], pairs=[[0, 1], [1, 2]], stiffness=10.0, damping=0.5, fixed=[0], groups={"end": [2]})


def led():
    """A motion that is given comes back with where it leads, and its work with it: into this simulation, into another one, and where a system is made anew."""
    net = bs.Lattice(**{**CHAIN, "pairs": [[0, 1], [1, 2], [0, 2]], "stiffness": [10.0, 10.0, 0.0]})
    for kind in ("beuler", "cn", "bdf", "alpha2", "verlet", "symplectic"):
        options = dict(dt=0.01, ts_type=kind, bs_motion_end="given")
        with bs.Simulation(net, **options) as simulation, bs.Simulation(net, **options) as other:
            simulation.drive("end", [[2.4]], 0.4)
            simulation.step(10)
            state = simulation.save()
            here = [simulation.v, simulation.forces, simulation.reactions]
            simulation.step(30)
            straight = [simulation.x, simulation.v, simulation.observables["work/end"], simulation.observables["total_energy"]]
            assert abs(straight[0][2, 0] - 2.4) < 1e-12
            for of in (other, simulation):
                of.restore(state)
                assert all(np.array_equal(a, b) for a, b in zip(here, [of.v, of.forces, of.reactions])), kind
                of.step(30)
                assert all(np.array_equal(a, b) for a, b in zip(straight, [of.x, of.v, of.observables["work/end"], of.observables["total_energy"]])), kind
            simulation.restore(state)
            simulation.change(stiffness=[10.0, 10.0, 1e-9])  # had no room in the matrices
            simulation.step(30)
            anew = 0.05 if kind in ("bdf", "alpha2") else 1e-6  # methods with a past begin anew
            assert abs(simulation.x - straight[0]).max() < anew and abs(simulation.observables["work/end"] - straight[2]) < anew, kind


def losses():
    """What was dissipated stays when numbers change and springs go; states bring back what had been by then. Two bars in turn, by closed form."""
    bar = bs.Lattice([0.0, 1.0], [[0, 1]], stiffness=20.0, rest_length=1.0, fixed=[0], groups={"end": [1]}, law="plastic",
                     spring_columns={"yield_force": [2.0], "hardening": [0.0]})
    with bs.Simulation(bar, dt=0.01, ts_type="cn", bs_motion_end="velocity:0.5") as simulation:
        lost = lambda: float(simulation.observables["dissipated_energy"])
        simulation.step(100)
        assert abs(lost() - 2.0 * (0.5 - 0.1)) < 1e-9, lost()
        state = simulation.save()
        simulation.change(yield_force=[1.0])
        assert abs(lost() - (0.8 + 0.05)) < 1e-9, lost()  # the force falls to 1 at once, by a flow of 0.05
        simulation.step(100)
        assert abs(lost() - (0.85 + 0.5)) < 1e-9, lost()
        after = lost()
        simulation.change(remove=[0])
        assert lost() == after
        simulation.restore(state)
        assert abs(lost() - 0.8) < 1e-12 and simulation.lattice.spring_columns["yield_force"].tolist() == [2.0]
        simulation.step(100)
        assert abs(lost() - 2.0 * (1.0 - 0.1)) < 1e-9, lost()


def removed():
    """Springs that were removed have no sensitivities; what no law of a spring takes is no part of a checkpoint's lattice."""
    chain = bs.Lattice([0.0, 1.0, 2.0], [[0, 1], [1, 2], [0, 2]], stiffness=[2.0, 3.0, 1.0], fixed=[0], groups={"end": [2]})
    with bs.Statics(chain, loads={"end": 1.0}, snes_rtol=1e-13) as solver:
        solver.solve()
        solver.change(remove=[2])
        solver.solve()
        found = solver.sensitivities([[0.0], [0.0], [1.0]])
        assert np.allclose(found["stiffness"], [-1 / 4, -1 / 9, 0]) and np.allclose(found["rest_length"], [1, 1, 0])
    two = bs.Lattice([0.0, 1.0, 2.0], [[0, 1], [1, 2]], stiffness=10.0, fixed=[0], law=["plastic", "hooke"], spring_columns={"yield_force": [0.1, 0.2], "hardening": [0.0, 0.0]})
    with tempfile.TemporaryDirectory() as folder, bs.Simulation(two, dt=0.01, ts_type="cn", bs_gravity=1.0) as simulation:
        simulation.change(yield_force=[0.3, 0.2])
        simulation.step(5)
        simulation.checkpoint(f"{folder}/c")
        with bs.Simulation.restart(f"{folder}/c", simulation.lattice) as again:
            assert np.array_equal(again.x, simulation.x)


def from_equilibria():
    """A motion from an equilibrium begins at rest, joined to the images that its springs and angle springs were joined to; what moves in time by the load
    factor is refused, unless the motion has another."""
    thrown = bs.Lattice([0.0, 1.0], [[0, 1]], stiffness=2.0, fixed=[0], velocity=[[0.0], [3.0]], groups={"end": [1]})
    with bs.Simulation(bs.statics(thrown, loads={"end": 1.0}), dt=0.01) as simulation:
        assert not simulation.v.any() and abs(simulation.forces[1, 0]) < 1e-9
    far = bs.Lattice([[0.0, 0], [4, 0]], [[0, 1]], stiffness=1.0, rest_length=4.0, box=[10.0, 10], fixed=[0], groups={"end": [1]})
    bent = bs.Lattice([[0.0, 0], [3, 0], [3, 3]], [[0, 1], [1, 2]], stiffness=10.0, rest_length=3.0, box=[10.0, 10], fixed=[1], groups={"end": [0]},
                      angles={"triples": [[0, 1, 2]], "stiffness": 5.0, "rest_angle": 4.7})
    for net, load in ((far, (2.0, 0)), (bent, (-30.0, -3.0))):
        eq = bs.statics(net, loads={"end": load}, snes_rtol=1e-13)
        assert np.linalg.norm(eq.x[net.pairs[0, 1]] - eq.x[net.pairs[0, 0]]) > 5  # the nearest image is another one
        with bs.Simulation(eq, dt=0.01, ts_type="cn") as simulation:
            assert abs(simulation.forces[~net.fixed]).max() < 1e-8 and abs(float(simulation.observables["elastic_energy"]) - eq.energy) < 1e-9
    for net, options in ((bs.Lattice(**sheet()), dict(bs_force_bottom="expression:3*t,expression:-2*t,total")), (bs.Lattice(**cell(), fixed=[0]), dict(bs_box_strain="xy=velocity:0.05"))):
        eq = bs.statics(net, **options)
        with raised(bs.InputError, *options, "t = 1", "replace"):
            bs.Simulation(eq, dt=0.01)
        still = {name: "0,0" if "force" in name else "xy=velocity:0" for name in options}
        with bs.Simulation(eq, dt=0.01, **still) as simulation:
            if net.box is not None:  # its strain counts from the equilibrium's box
                assert np.allclose(simulation.observables["/particles/trajectory/box/edges"], eq.box, rtol=0, atol=1e-12) and abs(simulation.forces[~net.fixed]).max() < 1e-6


def without_tangent():
    """Forces of one's own without a tangent: sensitivities are refused, no verdict on stability, no moduli; with it they are those of K."""
    spring = bs.Lattice([0.0, 1.0], [[0, 1]], stiffness=2.0, fixed=[0], groups={"end": [1]})
    push = lambda s, x, v: 3 * (x - [[0.0], [1.0]]) * [[0.0], [1.0]]
    eq = bs.statics(spring, forces=push, bs_stability_iterations=20)
    assert eq.observables["stability"] == 0 and eq.observables["negative_pivots"] == -1, eq.observables
    told = bs.Forces(push, tangent=lambda s, x, v: (np.array([[[0.0]], [[3.0]]]), np.zeros((2, 1, 1))))
    assert bs.statics(spring, forces=told).observables["stability"] == -1
    with bs.Statics(spring, loads={"end": 1.0}, forces=lambda s, x, v: -(x - [[0.0], [1.0]])) as solver:
        solver.solve()
        with raised(bs.InputError, "sensitivities", "tangent"):
            solver.sensitivities([[0.0], [1.0]])
    with raised(bs.InputError, "place in space"):
        bs.moduli(bs.Lattice(**cell()), forces=lambda s, x, v: 0 * x)


def followed_boxes():
    """Equilibria in boxes under stresses, whatever these are of the load factor, follow changes of the springs as if they were solved for anew."""
    net = bs.Lattice(**cell())
    for text in ("xx=0.02,yy=-0.005", "xx=0,yy=0", "xx=expression:0.02*t*t,yy=0"):
        for factor in (1.0, 1.0 + 1e-9, 1.2):
            with bs.Statics(net, bs_box_stress=text, load_steps=4, snes_rtol=1e-13) as solver:
                solver.solve()
                stiffness = net.stiffness * np.where(np.arange(len(net.pairs)) % 3, 1.0, factor)
                solver.change(stiffness=stiffness)
                fresh = bs.statics(net.replace(stiffness=stiffness), bs_box_stress=text, load_steps=4, snes_rtol=1e-13)
                assert np.allclose(solver.solve().observables["free_strain"], fresh.observables["free_strain"], rtol=0, atol=1e-9), (text, factor)


# one process for each type: what goes wrong hangs
FAILING = '''
import backspring as bs, faulthandler, numpy as np, sys, warnings
faulthandler.dump_traceback_later(60, exit=True)
warnings.simplefilter("ignore")
kind, how = sys.argv[1:]
net = bs.Lattice([[0, 0], [1, 0], [.5, .8]], [[0, 1], [1, 2], [2, 0]], stiffness=100., mass=.1, fixed=[0, 1])
bad = False
def forces(t, x, v):
    if bad and how == "raise": raise KeyError("mine")
    return x * np.nan if bad else 0 * x
options = dict(dt=.01, bs_gravity=(0, -9), ts_type=kind, bs_step_max_cuts=4)
with bs.Simulation(net, forces=forces, **options) as simulation, bs.Simulation(net, forces=forces, **options) as other:
    for of in (simulation, other): of.step(5)
    for attempt in range(2):
        bad = True
        try: simulation.step(3)
        except (KeyError, bs.ConvergenceError): pass
        else: raise AssertionError("no step fails")
        bad = False
        if simulation.steps > other.steps: other.step(simulation.steps - other.steps)  # by forces that were known
        assert simulation.steps < 8 and all(np.array_equal(a, b) for a, b in zip([simulation.t, simulation.x, simulation.v], [other.t, other.x, other.v])), kind
        other.set("position", other.x)  # a method that begins here
    for of in (simulation, other): of.step(7)
    assert simulation.steps == other.steps and np.array_equal(simulation.x, other.x) and simulation.t == other.t, (kind, abs(simulation.x - other.x).max())
'''


def after_failures():
    """A step that fails is as if it had not been tried: the next one begins with the last good state, and a method without history."""
    for kind in ("euler", "symplectic", "verlet", "rk", "beuler", "cn", "theta", "rosw", "arkimex", "bdf", "alpha2"):
        for how in ("raise", "nan"):
            done = python("import sys; sys.argv = " + repr(["", kind, how]) + "\n" + FAILING, timeout=120)
            assert done.returncode == 0, (kind, how, done.stdout + done.stderr)
    net = bs.Lattice([[0, 0], [1, 0], [0.5, 0.8]], [[0, 1], [1, 2], [2, 0]], stiffness=100.0, mass=0.1, fixed=[0, 1])
    with tempfile.TemporaryDirectory() as folder:
        with raised(bs.ConvergenceError), bs.Simulation(net, dt=0.5, bs_gravity=(0, -900), snes_max_it=1, snes_rtol=1e-14, bs_step_min=0.1, bs_output=f"{folder}/r.h5md") as simulation:
            with raised(bs.ConvergenceError):
                simulation.step(1)
            assert simulation.t == 0 and np.array_equal(simulation.x, net.x)  # can still be read
            simulation.step(1)  # its trajectory ends there
        assert pathlib.Path(f"{folder}/r.h5md").exists()


def forces_in_no_file():
    """A checkpoint of a motion with forces of one's own is not continued without them."""
    net = bs.Lattice(**CHAIN)
    pull = lambda t, x, v: 0.5 - 0.1 * x
    with tempfile.TemporaryDirectory() as folder, bs.Simulation(net, dt=0.01, forces=pull) as simulation:
        simulation.step(3)
        simulation.checkpoint(f"{folder}/c")
        simulation.step(3)
        with raised(bs.InputError, "forces"):
            bs.Simulation.restart(f"{folder}/c", net)
        with bs.Simulation.restart(f"{folder}/c", net, forces=pull) as again:
            again.step(3)
            assert np.array_equal(again.x, simulation.x)
