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

# code of several ranks: nets of plastic and elastic springs, angles and hinges that break as they fall, with numbers that change on the way
HEALED = '''
import backspring as bs, numpy as np
from cases import parts, sheet
rng = np.random.default_rng(2)
plastic = dict(law=["plastic" if k % 2 else "hooke" for k in range(101)], spring_columns={"yield_force": np.full(101, 0.4), "hardening": np.zeros(101)})
torn = bs.Lattice(**{**sheet(), **plastic, "breaking": {"critical_strain": rng.uniform(0.02, 0.4, 101)}})
strip = parts()
strip["angles"]["critical_change"] = np.array([0.02, 0.2])
strip["hinges"]["critical_change"] = np.array([0.05, 9.0])
strip["breaking"] = {"critical_strain": np.linspace(0.05, 0.4, 9)}
for net, kind, dt in ((torn, "verlet", 2e-3), (torn, "beuler", 1e-2), (bs.Lattice(**strip), "cn", 5e-3)):
    options = dict(dt=dt, ts_type=kind, bs_gravity=(0, -30.0) + (0,) * (net.dim - 2), bs_output_springs=True)
    with bs.Simulation(net, **options) as simulation, bs.Simulation(net, **options) as branch:
        def goes_on(state, of):
            of.restore(state)
            first = of.forces
            of.step(6)
            frame, numbers = of.frame(), [of.lattice.stiffness, of.lattice.damping]
            for bends in filter(None, (of.lattice.angles, of.lattice.hinges)): numbers += [bends["stiffness"], bends["rest_angle"]]
            flags = [frame["fields"][name] for name in sorted(frame["fields"]) if "broken" in name or "plastic" in name]
            return [of.t, first, of.x, of.v, of.forces, of.observables["total_energy"], of.events.spring, of.events.time, *flags, *numbers]
        states, broken = [], []
        for k in range(4):
            states.append(simulation.save())
            broken.append([int(simulation.frame()["fields"][name].sum()) for name in sorted(simulation.frame()["fields"]) if "broken" in name])
            bends = dict(angle_stiffness=0.5 + k / 10, angle_rest_angle=[np.pi, 3 - k / 20], hinge_stiffness=0.2 * k, hinge_rest_angle=k / 10) if net.angles else {}
            if k in (1, 2): simulation.change(stiffness=net.stiffness * (1 + k / 10), damping=0.05 * k, **bends)
            simulation.step(30)
        assert broken[0] == [0] * len(broken[0]) and all(last > 0 for last in broken[-1]), broken
        expected = [goes_on(state, bs.Simulation(net, **options)) for state in states]
        for k in (3, 0, 2, 1, 0):
            for of in (simulation, branch):
                for one, other in zip(goes_on(states[k], of), expected[k]):
                    assert np.array_equal(one, other), (kind, k, of is branch)
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


# code of several ranks: what follows save() follows restore() to the last bit, also in another simulation, whatever the method remembers
RESUMED = '''
import backspring as bs, numpy as np
from mpi4py import MPI
from cases import sheet
net = bs.Lattice(**{**sheet(), "damping": 0.3})
torn = net.replace(law=["plastic" if k % 2 else "hooke" for k in range(101)], spring_columns={"yield_force": np.full(101, 0.4), "hardening": np.zeros(101)},
                   breaking={"critical_strain": np.random.default_rng(2).uniform(0.02, 0.4, 101)})
methods = [dict(ts_type=kind) for kind in ("euler", "rk", "symplectic", "verlet", "beuler", "cn", "theta", "rosw", "arkimex", "bdf", "alpha2")]
methods += [dict(ts_type="bdf", ts_bdf_order=4), dict(ts_type="bdf", ts_bdf_order=2, ts_adapt_type="basic"), dict(ts_type="beuler", ts_adapt_type="basic"),
            dict(ts_type="cn", condensed_ksp_type="cg", condensed_pc_type="bicc"), dict(ts_type="cn", every=7e-3)]
def now(of):
    frame = of.frame()
    return [of.t, of.steps, of.x, of.v, of.forces, *(frame["fields"][name] for name in sorted(frame["fields"])), *(v for _, v in sorted(of.observables.items()))]
for one in (net, torn):
    for method in methods:
        if one is torn and method["ts_type"] not in ("verlet", "cn", "bdf"): continue
        method = dict(method)
        options = dict(dt=2e-3, bs_gravity=(0, -9.81), bs_output_interval=method.pop("every", None), **method)
        with bs.Simulation(one, **options) as simulation, bs.Simulation(one, **options) as other:
            simulation.step(7)
            state = simulation.save()
            simulation.step(9)
            straight = now(simulation)
            simulation.change(stiffness=1.5 * one.stiffness)
            simulation.step(2)
            for of in (simulation, other):
                of.restore(state)
                assert of.steps == 7
                of.step(9)
                assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(now(of), straight)), (options, of is other)
            other.restore(state)
            other.x = other.x  # set: the method starts anew
            assert other.steps == 7
            other.step(1)
            assert other.steps == 8
with bs.Simulation(net, dt=2e-3, ts_type="bdf") as first, bs.Simulation(net, dt=1e-3, ts_type="cn") as second:
    first.step(5)
    import warnings
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        second.restore(first.save())
        second.step(1)
    assert abs(second.t - first.t - 1e-3) < 1e-15 and second.steps == 6, (second.t, first.t, second.steps)
    if MPI.COMM_WORLD.rank == 0: print("\\n".join(str(one.message) for one in told))
'''


def resumed():
    """A state that is restored goes on as the motion did, to the bit; where the method or the step is another one it is told."""
    for ranks in (1, 3):
        done = python(RESUMED, ranks, timeout=240)
        assert done.returncode == 0, done.stdout + done.stderr
        assert "the saved state: the method is cn; it was bdf: it starts afresh" in done.stdout and "the step is -ts_dt 0.001; it was 0.002" in done.stdout, done.stdout


def healed():
    """What broke or flowed after save() is whole after restore(), to the bit what a simulation that was restored at once has, whatever was changed since."""
    for ranks in (1, 3):
        done = python(HEALED, ranks, timeout=240)
        assert done.returncode == 0, done.stdout + done.stderr


def room():
    """Springs that exert nothing at first, and get a stiffness while the system lives: what a system that is made with it does, in motions and equilibria."""
    start = sheet()
    start["stiffness"] = np.where(np.random.default_rng(4).random(101) < 0.15, 0.0, start["stiffness"])
    start["damping"] = 0.0
    whole = sheet()["stiffness"]
    for kind in ("beuler", "cn", "verlet"):
        with bs.Simulation(bs.Lattice(**start), ts_type=kind, snes_rtol=1e-12, **FALLING) as late, bs.Simulation(bs.Lattice(**start), ts_type=kind, snes_rtol=1e-12, **FALLING) as branch:
            late.step(5)
            state = late.save()
            late.change(stiffness=whole)
            with bs.Simulation(bs.Lattice(**{**start, "stiffness": whole, "x": late.x, "velocity": late.v}), ts_type=kind, snes_rtol=1e-12, ts_init_time=late.t, **FALLING) as soon:
                for one in (late, soon):
                    one.step(10)
                assert abs(late.x - soon.x).max() < 1e-9 and late.lattice.stiffness.all() and late.steps == 15, kind
            after = late.save()
            branch.restore(after)
            branch.step(3)
            late.step(3)
            assert abs(late.x - branch.x).max() < 1e-9, kind
            late.restore(state)
            assert np.array_equal(late.lattice.stiffness, start["stiffness"]) and late.steps == 5
            branch.restore(state)
            for one in (late, branch):
                one.step(4)
            assert np.array_equal(late.x, branch.x), kind
    pulled = dict(loads={"bottom": (0.3, -20.0)}, snes_rtol=1e-12)
    with bs.Statics(bs.Lattice(**start), **pulled) as solver:
        first = solver.solve()
        solver.change(stiffness=whole)
        second = solver.solve()
        assert second.newton < 20 and abs(second.x - bs.statics(bs.Lattice(**{**start, "stiffness": whole}), **pulled).x).max() < 1e-9
        solver.change(stiffness=start["stiffness"])
        assert abs(solver.solve().x - first.x).max() < 1e-8
    limited = bs.Lattice(**{**start, "breaking": {"critical_strain": 0.3}})
    with bs.Simulation(limited, ts_type="verlet", dt=2e-3, bs_gravity=(0, -30.0)) as simulation:
        simulation.change(remove=[0, 1, 2])
        simulation.step(300)
        gone = set(np.flatnonzero(start["stiffness"] == 0)) | {0, 1, 2}
        assert len(simulation.events) > 0 and not gone & set(simulation.events.spring), "what exerts nothing does not break"


def histories():
    """A motion from an equilibrium goes on with what its springs went through: bars that flowed or broke swing about it with their unloading stiffness."""
    bar = bs.Lattice([[0.0], [1.0]], [[0, 1]] * 2, stiffness=[4.0, 1.0], rest_length=1.0, fixed=[0], groups={"end": [1]}, parallel=True, mass=2.0,
                     law=["plastic", "hooke"], spring_columns={"yield_force": [1.0, 0.0], "hardening": [0.0, 0.0]})
    eq = bs.statics(bar, load_steps=8, snes_rtol=1e-12, bs_force_end="expression:8.5*t-6*t*t")  # 3 at most, of which 1 is the flowing bar's
    assert abs(eq.load_factor - 1) < 1e-12 and abs(eq.x[1, 0] - 2.9) < 1e-9 and np.allclose(eq.tension, [0.6, 1.9]), (eq.x, eq.tension)
    with bs.Simulation(eq, dt=1e-3, ts_type="cn", bs_force_end="2.0") as simulation:  # 0.5 less: elastic, by 0.1
        most = []
        for _ in range(4):
            simulation.step(250)
            most.append(simulation.x[1, 0])
        expected = [2.9 - 0.1 * (1 - np.cos(np.sqrt(5 / 2) * t)) for t in (0.25, 0.5, 0.75, 1.0)]
        assert np.allclose(most, expected, atol=1e-6), (most, expected)
        assert not simulation._session.warnings, simulation._session.warnings
    beam = bs.Lattice([[0.0, 0], [1, 0], [2, 0]], [[0, 1], [1, 2]], stiffness=1e5, groups={"ends": [0, 2], "middle": [1]},
                      angles={"triples": [[0, 1, 2]], "stiffness": 2.0, "rest_angle": np.pi, "critical_moment": 0.2})
    folded = bs.statics(beam, load_steps=10, bs_motion_ends="y=fixed", bs_motion_middle="x=fixed,y=velocity:-0.3")
    with bs.Simulation(folded, dt=1e-2, bs_motion_middle="fixed") as simulation:
        assert abs(simulation.forces[1, 1]) < 1e-9  # nothing bends it back
        simulation.step(10)
        assert folded.fields["broken_angles"].all() and simulation.frame()["fields"]["broken_angles"].all() and abs(simulation.x - folded.x).max() < 1e-9


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
