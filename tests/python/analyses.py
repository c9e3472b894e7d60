"""Equilibria, modes and moduli: closed forms, numbers that change, what breaks on the way, load steps that are watched."""
import pickle
import tempfile

import numpy as np
from helpers import raised

import backspring as bs
from cases import sheet, strip


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
    flap, options = strip(), dict(dt=2e-3, bs_gravity=(0, 0, -9.81), snes_rtol=1e-12)
    flap.pop("breaking")
    bends = dict(angle_stiffness=[0.9, 0.4], hinge_rest_angle=[0.3, -0.2])
    with bs.Simulation(bs.Lattice(**flap), **options) as simulation:
        simulation.step(20)
        x, v = simulation.x.copy(), simulation.v.copy()
        simulation.change(**bends)
        simulation.step(20)
        after, end = simulation.lattice, simulation.x.copy()
    assert np.array_equal(after.angles["stiffness"], [0.9, 0.4]) and np.array_equal(after.hinges["stiffness"], flap["hinges"]["stiffness"])
    flap["angles"]["stiffness"], flap["hinges"]["rest_angle"] = np.array(bends["angle_stiffness"]), np.array(bends["hinge_rest_angle"])
    with bs.Simulation(bs.Lattice(**{**flap, "x": x, "velocity": v, "damping": 0.1}), **options) as begun, bs.Simulation(after.replace(x=x, velocity=v), **options) as other:
        for one in (begun, other):
            one.step(20)
            assert abs(one.x - end).max() < 1e-9, abs(one.x - end).max()


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


def flat_nets():
    """Paths by arc length of nets of cables that lie flat and have no stiffness across before their load: they end where load steps do (what is slack may lie
    elsewhere), and sag further with every step."""
    n = 7
    x = np.array([[i, j, 0.0] for j in range(n) for i in range(n)])
    pairs = [(k, k + 1) for k in range(n * n) if k % n < n - 1] + [(k, k + n) for k in range(n * n - n)]
    rim = [k for k in range(n * n) if k % n in (0, n - 1) or k // n in (0, n - 1)]
    for held in (rim, [0, n - 1, n * n - n, n * n - 1]):
        net = bs.Lattice(x, pairs, stiffness=1000.0, rest_length=1.0, law="tension", fixed=held, groups={"middle": [n * n // 2]})
        load, factors = dict(loads={"middle": (0, 0, -1.0)}, snes_rtol=1e-10), []
        steps = bs.statics(net, load_steps=10, **load)
        path = bs.statics(net, load_steps=50, bs_load_control="arc", observe=lambda s, eq: factors.append((s, eq.x[n * n // 2, 2])), **load)
        sag = np.array(factors)
        assert path.load_factor == 1 and abs(path.energy / steps.energy - 1) < 1e-6 and abs(sag[-1, 1] - steps.x[n * n // 2, 2]) < 1e-6 and (np.diff(sag[:, 0]) > 0).all() and (np.diff(sag[:, 1]) < 0).all(), sag


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


def held_groups():
    """Forces of supports by groups that are held; what else is held has its own, particle by particle."""
    bar = bs.Lattice([[0.0], [1.0], [2.0]], [[0, 1], [1, 2]], stiffness=[100.0, 200.0], fixed=[0, 2], groups={"middle": [1], "wall": [0]})
    eq = bs.statics(bar, loads={"middle": 3.0}, total=np.True_)
    assert list(eq.reactions) == ["wall"] and eq.reactions.get("middle") is None and "middle" not in eq.reactions and abs(eq.reactions["wall"][0] + 1) < 1e-12
    with raised(KeyError, "nothing holds", "'middle'", "wall"):
        eq.reactions["middle"]
    assert abs(eq.reaction[:, 0] - [-1, 0, -2]).max() < 1e-12
    with bs.Simulation(eq, dt=1.0) as simulation:
        assert np.array_equal(simulation.reactions, eq.reaction)


def balanced():
    """What holds a sheet bears its weight and its loads, in forces and moments, and pulls each particle back that its springs pull away; on the way to the
    full loads the part of them that has been come to."""
    g, pull = np.array([0.0, -9.81]), np.array([0.3, -2.0])
    data = sheet()
    net = bs.Lattice(**{**data, "groups": {"bottom": data["groups"]["bottom"]}})  # what is fixed is in no group
    turn = lambda x, f: float((x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]).sum())
    for options in (dict(), dict(bs_motion_bottom="x=fixed"), dict(bs_motion_bottom="y=velocity:-0.1"), dict(stop=lambda s, eq: s > 0.4)):
        seen = []
        eq = bs.statics(net, loads={"bottom": pull}, load_steps=4, bs_gravity=g, snes_rtol=1e-13, observe=lambda s, state: seen.append(state.reaction.copy()), **options)
        s, held = eq.load_factor, net.fixed.copy()
        given = s * net.mass[:, None] * g
        given[net.groups["bottom"]] += s * pull
        assert abs(eq.reaction.sum(axis=0) + given.sum(axis=0)).max() < 1e-8 and abs(turn(eq.x, eq.reaction) + turn(eq.x, given)) < 1e-8, options
        assert len(seen) == eq.steps and np.array_equal(seen[-1], eq.reaction) and not np.array_equal(seen[0], seen[1])
        if "bs_motion_bottom" in options:
            held |= net.groups["bottom"]
            assert np.allclose(eq.reaction[net.groups["bottom"]].sum(axis=0), eq.reactions["bottom"], rtol=0, atol=1e-9)
        way = eq.x[net.pairs[:, 1]] - eq.x[net.pairs[:, 0]]
        springs = way / np.linalg.norm(way, axis=1)[:, None] * eq.tension[:, None]
        for end, sign in ((0, 1), (1, -1)):
            np.add.at(given, net.pairs[:, end], sign * springs)
        assert abs(eq.reaction + given).max() < 1e-8 and not eq.reaction[~held].any() and eq.reaction[net.fixed].any(axis=1).all(), options
