"""States that are saved and restored, with the numbers that have changed since, and springs that are removed for good."""
import numpy as np
from helpers import python, raised

import backspring as bs
from cases import sheet

FALLING = dict(dt=2e-3, bs_gravity=(0, -9.81))
# code of several ranks: each net's state for the other, nothing, states of two moments; then the run goes on as if nothing had been asked
FOREIGN = '''
import backspring as bs, numpy as np
from mpi4py import MPI
from cases import sheet
rank, comm = MPI.COMM_WORLD.rank, MPI.COMM_WORLD
parts = {**sheet(), "damping": 0.0}
net = bs.Lattice(**parts)
one = bs.Simulation(net, dt=1e-3)
other = bs.Simulation(bs.Lattice([0.0, 1.0, 2.0], [[0, 1], [1, 2]]), dt=1e-3)
fixed = bs.Simulation(net, dt=1e-3, bs_motion_bottom="fixed")
stiffer = bs.Simulation(net.replace(stiffness=2 * net.stiffness), dt=1e-3)
breaking = bs.Simulation(net, dt=1e-3, bs_break_strain=10.0)
alone = bs.Simulation(net, dt=1e-3, comm=MPI.COMM_SELF)
undisturbed = bs.Simulation(net, dt=1e-3)
for simulation in (one, undisturbed): simulation.step(3)
old = one.save()
for simulation in (one, undisturbed): simulation.step(3)
now = one.save()
given = [other.save(), fixed.save(), stiffer.save(), breaking.save(), None, [1.0]]
if comm.size > 1: given += [alone.save(), None if rank == 0 else old, old if rank == 0 else now]
said = []
for state in given:
    try: one.restore(state)
    except bs.InputError as error: said.append(str(error))
for simulation in (one, undisturbed): simulation.step(3)
all, same = comm.gather(said), np.array_equal(one.x, undisturbed.x)
if rank == 0:
    assert same and len(said) == len(given) and all.count(said) == comm.size, (same, all)
    for one in said: print(one)
'''


def numbers_of(net):
    return [getattr(net, name) for name in ("stiffness", "rest_length", "damping", "mass")]


def restored():
    """What save() returned is, to the bit, what a run goes on from, whatever was changed since; also in another simulation of the same network."""
    net, rng = bs.Lattice(**sheet()), np.random.default_rng(8)
    uneven = lambda numbers: numbers * rng.uniform(0.7, 1.3, len(numbers))
    for kind in ("beuler", "cn", "verlet"):
        with bs.Simulation(net, ts_type=kind, **FALLING) as simulation, bs.Simulation(net, ts_type=kind, **FALLING) as branch:
            def goes_on(state, of):
                of.restore(state)
                of.step(4)
                return [of.t, of.x, of.v, of.forces, of.observables["total_energy"], *numbers_of(of.lattice)]

            simulation.step(3)
            states = [simulation.save()]
            expected = [goes_on(states[0], simulation)]
            for change in (dict(mass=uneven(net.mass)), dict(stiffness=uneven(net.stiffness), damping=0.0, remove=[3, 40]), dict(rest_length=uneven(net.rest_length))):
                simulation.change(**change)
                simulation.step()
                states.append(simulation.save())
                expected.append(goes_on(states[-1], simulation))
            for k in (0, 3, 1, 2, 0, 2):
                for of in (simulation, branch):
                    for one, other in zip(goes_on(states[k], of), expected[k]):
                        assert np.array_equal(one, other), (kind, k, of is branch, abs(one - other).max())
    bare = bs.Lattice([[0.0], [1.3]], [[0, 1]], stiffness=10.0, fixed=[0])  # rest lengths are the initial distances
    with bs.Simulation(bare, dt=0.01, bs_gravity=1.0) as simulation:
        simulation.step()
        state = simulation.save()
        simulation.change(rest_length=1.0)
        simulation.restore(state)
        assert abs(simulation.forces[1, 0] - (1 - 10 * (simulation.x[1, 0] - 1.3))) < 1e-12 and simulation.lattice.rest_length[0] == 1.3


def foreign_states():
    """States of other networks, laws, ranks or moments, and what is none, are refused on all ranks in one line, and nothing changes."""
    for ranks in (1, 3):
        done = python(FOREIGN, ranks, timeout=120)
        lines = done.stdout.splitlines()
        words = ["another lattice"] * 4 + ["save()"] * 2 + (["another number of ranks", "save()", "one moment"] if ranks > 1 else [])
        assert done.returncode == 0 and len(lines) == len(words), done.stdout + done.stderr
        assert all(word in line for word, line in zip(words, lines)), lines


def removed_for_good():
    """Springs that were removed are those of a network that never had them, whatever is given later, until an earlier state is restored."""
    net, gone = bs.Lattice(**sheet()), [3, 40]
    there = np.ones(len(net.pairs), bool)
    there[gone] = False
    without = net.replace(pairs=net.pairs[there], stiffness=2 * net.stiffness[there], rest_length=net.rest_length[there], damping=net.damping[there] / 2)
    with bs.Simulation(net, ts_type="verlet", **FALLING) as simulation, bs.Simulation(without, ts_type="verlet", **FALLING) as other:
        state = simulation.save()
        simulation.change(remove=gone[:1])
        simulation.change(remove=gone[1:])
        simulation.change(stiffness=2 * net.stiffness, damping=net.damping / 2)
        assert not simulation.lattice.stiffness[gone].any() and not simulation.lattice.damping[gone].any()
        for one in (simulation, other):
            one.step(20)
        assert np.array_equal(simulation.x, other.x)
        simulation.restore(state)
        simulation.change(stiffness=3 * net.stiffness)
        assert np.array_equal(simulation.lattice.stiffness, 3 * net.stiffness) and np.array_equal(simulation.lattice.damping, net.damping)
    options = dict(bs_gravity=(0, -1.0), snes_rtol=1e-12)
    with bs.Statics(net, **options) as solver:
        solver.solve()
        solver.change(remove=gone)
        solver.change(stiffness=2 * net.stiffness)
        expected = bs.statics(without, **options).x
        for afresh in (False, True):
            assert abs(solver.solve(afresh).x - expected).max() < 1e-9
        with raised(bs.InputError, "stiffness"):
            solver.change(stiffness=-1.0)
