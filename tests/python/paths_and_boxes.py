"""What the package says of equilibria, motions, boxes and atoms holds: load factors on paths, settings that go on, places where motions begin, images, pictures."""
import base64
import re
import tempfile
import warnings

import numpy as np
from helpers import raised

import backspring as bs
from cases import cell, sheet

RISE = 0.3


def arch():
    """Two bars on supports that meet at an apex, which snaps through under a load."""
    side = float(np.hypot(1, RISE))
    return bs.Lattice([[-1.0, 0], [0, RISE], [1, 0]], [[0, 1], [1, 2]], stiffness=50.0, rest_length=side, fixed=[0, 2], groups={"apex": [1]})


def load_factors():
    """By arc length observers are told of the load that the arch bears at its height, which grows, falls and grows again; nothing is said of stability there."""
    side, seen = np.hypot(1, RISE), []
    bears = lambda y: 2 * 50 * (np.hypot(1, y) - side) * y / np.hypot(1, y) / -4
    options = dict(loads={"apex": (0, -4.0)}, load_steps=10, bs_load_control="arc")
    bs.statics(arch(), observe=lambda s, eq: seen.append((s, eq)), **options)
    factors = np.array([s for s, _ in seen])
    assert (np.diff(factors) < 0).any() and abs(factors[-1] - 1) < 1e-9
    for s, eq in seen:
        assert s == eq.load_factor == eq.observables["load_factor"] and abs(s - bears(eq.x[1, 1])) < 1e-8, (s, eq.x)
        assert eq.observables["stability"] == 0 and eq.observables["negative_pivots"] == -1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", bs.BackspringWarning)  # it ends unstable, on its way
        down = bs.statics(arch(), stop=lambda s, eq: s < 0, **options)
    assert down.load_factor < 0 and abs(down.load_factor - bears(down.x[1, 1])) < 1e-8, down
    with raised(bs.InputError, "load factor"):
        bs.Simulation(max(seen[:-1], key=lambda one: one[1].x[1, 1])[1], dt=0.1)


def steps_of_loads():
    """What follows from an equilibrium takes as many load steps, which decide what flows in a net of plastic springs; others take their place."""
    data = cell()
    many = len(data["pairs"])
    data.update(law="plastic", spring_columns={"yield_force": np.full(many, 0.1), "hardening": np.full(many, 0.2)}, rest_length=None)
    eq = bs.statics(bs.Lattice(**data), bs_box_strain="xy=expression:0.3*sin(3.141592653589793*t)", load_steps=20)
    again, within = bs.statics(eq), bs.moduli(eq).equilibrium
    with bs.Statics(eq) as solver:
        first = solver.solve()
    for one in (again, within, first):
        assert one.steps == eq.steps == 20 and np.array_equal(one.observables["stress"], eq.observables["stress"]), one
    assert bs.statics(eq, load_steps=5).steps == bs.statics(eq, bs_load_steps=5).steps == 5 and bs.statics(bs.Lattice(**data)).steps == 1


def where_motions_begin():
    """A motion of a group that leads an equilibrium and is not 0 at t = 0 would be added once more: it is refused, unless the group's motion is given anew;
    others go on."""
    net = bs.Lattice(**{**sheet(), "damping": 0.0})
    free = ~net.fixed & ~net.groups["bottom"]
    with tempfile.TemporaryDirectory() as folder:
        table = folder + "/way.csv"
        with open(table, "w") as file:
            file.write("0,0.02,-0.05\n1,0.05,-0.1\n2,0.05,-0.1\n")
        for motion in ("x=fixed,y=expression:-0.1", "x=fixed,y=sinusoid:0.1,0.3,1.0", "table:" + table):
            eq = bs.statics(net, bs_motion_bottom=motion, snes_rtol=1e-13)
            with raised(bs.InputError, "bs_motion_bottom", "once more", "replace"):
                bs.Simulation(eq, dt=1e-3)
            with bs.Simulation(eq, dt=1e-3, ts_type="cn", bs_motion_bottom="fixed") as simulation:
                assert np.array_equal(simulation.x, eq.x) and abs(simulation.forces[free]).max() < 1e-9
            with bs.Simulation(eq, dt=1e-3, bs_motion_bottom="x=fixed,y=expression:-0.02") as simulation:  # the caller's own step
                assert abs((simulation.x - eq.x)[net.groups["bottom"]] - (0, -0.02)).max() < 1e-12
    alone = net.replace(groups={})
    eq = bs.statics(alone, bs_group_low="ymin", bs_motion_low="x=fixed,y=expression:-0.1")
    with raised(bs.InputError, "bs_motion_low"):
        bs.Simulation(eq, dt=1e-3)
    for motion in ("rotation:0.1,0,0", "velocity:0.05,-0.1", "x=fixed,y=sinusoid:0.1,0.25,0"):
        eq = bs.statics(net, bs_motion_bottom=motion, snes_rtol=1e-13)
        with bs.Simulation(eq, dt=1e-3) as simulation:
            assert np.array_equal(simulation.x, eq.x) and abs(simulation.forces[free]).max() < 1e-9


def first_moments():
    """What goes on from a checkpoint is at its time and step before anything is read."""
    net = bs.Lattice([0.0, 1.0], [[0, 1]], stiffness=3.0, fixed=[0], velocity=[[0.0], [1.0]])
    with tempfile.TemporaryDirectory() as folder:
        with bs.Simulation(net, dt=0.1, ts_type="cn") as simulation:
            simulation.step(4)
            simulation.checkpoint(folder + "/c")
            there = simulation.x
        frames = list(bs.run(net, until=1.0, every=0.25, bs_restart=folder + "/c"))
        assert np.allclose([frame.t for frame in frames], [0.4, 0.5, 0.75, 1.0]) and np.array_equal(frames[0].x, there), [frame.t for frame in frames]
        with bs.Simulation(net, bs_restart=folder + "/c") as again:
            assert abs(again.t - 0.4) < 1e-12 and again.steps == 4 and "t = 0.4 s after 4 steps" in repr(again)


def images():
    """Springs join the images that they join in the program, in boxes that are skewed and repeat along some edges, whose others may be left 0; a motion from an
    equilibrium joins them, too."""
    rng, seen = np.random.default_rng(0), 0
    for _ in range(150):
        d = int(rng.integers(1, 4))
        box, periodic = rng.normal(size=(d, d)) * rng.choice([0.3, 1.0, 5.0], size=(d, 1)), rng.random(d) < 0.6
        if not periodic.any():
            continue
        net = bs.Lattice(2 * rng.normal(size=(20, d)), [[0, k] for k in range(1, 20)], rest_length=0.5, box=box, periodic=periodic)
        try:
            simulation = bs.Simulation(net, dt=0.1)
        except bs.InputError as refused:  # of boxes that are very narrow
            assert "63 boxes" in str(refused), refused
            continue
        with simulation:
            assert np.allclose(net.lengths(), 0.5 * (1 + simulation.frame()["fields"]["strain"]), rtol=1e-12), (box, periodic)
        seen += 1
    assert seen > 90
    skewed = bs.Lattice([[0.0, 0], [0.1, 1]], [[0, 1]], rest_length=0.5, box=[[1.0, 0], [5, 1.2]], periodic=(True, False), fixed=[0], groups={"end": [1]})
    open_side = bs.Lattice([[0.0, 0], [0.9, 0]], [[0, 1]], rest_length=0.2, box=[[1.0, 0], [0, 0]], periodic=(True, False), fixed=[0])
    for net, options in ((skewed, dict(loads={"end": (0.1, 0.2)})), (open_side, dict(snes_rtol=1e-14))):
        eq = bs.statics(net, **options)
        with bs.Simulation(eq, dt=0.1) as simulation:
            assert abs(float(simulation.observables["elastic_energy"]) - eq.energy) < 1e-12 and abs(simulation.forces[1]).max() < 1e-9
        assert "svg" in net._repr_html_() and net.plot() and eq.plot()
    assert abs(open_side.lengths()[0] - 0.1) < 1e-15
    with raised(bs.InputError, "box", "no volume"):
        open_side.replace(box=[[1.0, 0], [2, 0]]).lengths()


def shortest(way, edges):
    """Length of the shortest of way + sum of s_k edges_k over all whole s: all that are not longer than `way` itself are looked through."""
    q, r = np.linalg.qr(edges.T)
    along = q.T @ way
    across = way - q @ along

    def least(k, y):
        if k < 0:
            return y @ y
        away, step = np.linalg.norm(along) + 1e-9, abs(r[k, k])
        first, last = -y[k] / r[k, k] - away / step, -y[k] / r[k, k] + away / step
        return min(least(k - 1, y + s * r[:, k]) for s in range(int(np.floor(first)), int(np.ceil(last)) + 1))

    return np.sqrt(least(len(edges) - 1, along) + across @ across)


def skewed():
    """The images that springs join by themselves are the nearest of all, by the package and the program alike, in boxes whose edges lean by up to ten lengths along
    whichever of them they repeat."""
    rng, seen = np.random.default_rng(3), 0
    for _ in range(90):
        d = int(rng.integers(1, 4))
        periodic = rng.random(d) < 0.7
        if not periodic.any():
            continue
        turn = np.linalg.qr(rng.normal(size=(d, d)))[0]
        box = (np.tril(rng.uniform(-10, 10, (d, d)), -1) + np.diag(rng.uniform(0.7, 1.5, d))) @ turn
        net = bs.Lattice(rng.uniform(-1.5, 1.5, (20, d)), [[0, k] for k in range(1, 20)], rest_length=0.5, box=box, periodic=periodic)
        exact = [shortest(way, box[periodic]) for way in net.x[1:] - net.x[0]]
        assert np.allclose(net.lengths(), exact, rtol=1e-11, atol=1e-13), (box, periodic)
        try:
            simulation = bs.Simulation(net, dt=0.1)
        except bs.InputError as refused:
            assert "63 boxes" in str(refused), refused
            continue
        with simulation:
            assert np.allclose(0.5 * (1 + simulation.frame()["fields"]["strain"]), exact, rtol=1e-10), (box, periodic)
        seen += 1
    assert seen > 40, seen


def drawn(svg):
    """(S, 2, 2) ends of the lines of a picture in SVG [tenths of pixels], first ones and ways along, in no order."""
    text = base64.b64decode(re.search(r"base64,([^\"]*)", svg)[1]).decode()
    ways = []
    for path in re.findall(r' d="([^"]*)"', text):
        ways += [[int(one) for one in re.findall(r"-?\d+", way)] for way in re.findall(r"l[^ml]*", path)]
    return np.array(ways)


def strained_boxes():
    """Equilibria, frames and modes say which box they stand in, and pictures draw springs there, along the images that they join; the lattice that a message
    says to make of an equilibrium has its energy."""
    data = cell()
    net = bs.Lattice(**data, fixed=[0])
    eq = bs.statics(net, bs_box_strain="xy=velocity:1.0")
    *_, frame = bs.run(net, dt=0.1, until=0.5, bs_box_strain="xy=velocity:1.0")
    modes = bs.modes(eq, 2)
    for one, shear in ((eq, 1.0), (frame, 0.5), (modes, 1.0)):
        assert np.allclose(one.box, [[5, 0], [5 * shear, 5]], atol=1e-12), one.box
        ways = one.x[net.pairs[:, 1]] - one.x[net.pairs[:, 0]] + net.shift @ one.box
        if one is not modes:
            there = drawn(one._repr_html_()) * [1, -1]
            scale = np.linalg.norm(there, axis=1).max() / np.linalg.norm(ways, axis=1).max()
            assert np.allclose(sorted(np.linalg.norm(there, axis=1)), sorted(scale * np.linalg.norm(ways, axis=1)), atol=2), one
        lines = one.plot().axes[0].collections[-2 if one is modes else 0].get_segments()
        if one is not modes:
            assert np.allclose([line[1] - line[0] for line in lines], ways, atol=1e-12)
        assert np.ptp(np.concatenate(lines)[:, 0]) < 12
    assert bs.statics(bs.Lattice(**sheet())).box is None and np.array_equal(bs.modes(net, 1).box, net.box)
    free = {**data, "rest_length": None, "shift": None}
    for start, options in ((net, dict(bs_box_strain="xy=velocity:0.3")), (bs.Lattice(**free, fixed=[0]), dict(bs_box_strain="xx=velocity:0.2")),
                           (bs.Lattice(**{**sheet(), "rest_length": None}), dict(bs_force_bottom="0,expression:-3*t"))):
        eq = bs.statics(start, snes_rtol=1e-13, **options)
        with raised(bs.InputError, "replace") as refused:
            bs.Simulation(eq, dt=0.1)
        own = eval(str(refused.error).split("a lattice of its own, ")[1], {"eq": eq})
        loads = {name: "0,-3" for name in options if "force" in name}
        with bs.Simulation(own, dt=0.1, **loads) as simulation:
            assert eq.energy > 1e-3 and abs(float(simulation.observables["elastic_energy"]) / eq.energy - 1) < 1e-9
            assert abs(simulation.forces[~start.fixed]).max() < 1e-7


def said_plainly():
    """What would move nothing, be ignored or be taken for something else is refused or told of, and a lattice may go on without its box."""
    net = bs.Lattice(**sheet())
    seen = []

    def watching(t, frame):
        with raised(ValueError, "read-only"):
            frame.v[0] = 1.0
        with raised(bs.Error, "nothing follows", "run()"):
            frame.x *= 2
        for name in ("x", "v"):
            with raised(bs.Error, "nothing follows", "run()"):
                setattr(frame, name, 0 * net.x)
        seen.append(t)

    for frame in bs.run(net, dt=1e-3, until=3e-3, observe=watching):
        frame.v *= 0.5
        frame.x[20] += 1e-3
    assert len(seen) == 3
    with bs.Simulation(net, dt=1e-3) as simulation:
        simulation.v = np.ones_like(net.x)
        simulation.v *= 0.5
        assert (simulation.v[~net.fixed] == 0.5).all()
    for words, call in ((("bs_modes", "twice"), lambda: bs.modes(net, 1, bs_modes=2)), (("help", "backspring -help"), lambda: bs.statics(net, help=True)),
                        (("help",), lambda: bs.Simulation(net, dt=0.1, help=True))):
        with raised(bs.InputError, *words):
            call()
    with bs.Simulation(net, dt=0.1, bs_group_low="ymin", bs_motion_low="given") as simulation, raised(bs.InputError, "'low'", "bottom, hung", "groups={'low'"):
        simulation.drive("low", net.x[:7], 1.0)
    limited = net.replace(breaking={"critical_strain": 5.0}, angles={"triples": [[0, 1, 2]], "stiffness": 1.0, "rest_angle": np.pi, "critical_moment": 9.0})
    for call in (lambda **limits: bs.statics(limited, **limits), lambda **limits: bs.Simulation(limited, dt=0.1, **limits).close()):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            call(bs_break_strain=0.1, bs_break_force=1e6, bs_break_angle_moment=1.0)
        texts = [str(one.message) for one in told if "ignored" in str(one.message)]
        assert len(texts) == 2 and "critical_strain" in texts[0] and "bs_break_strain" in texts[0] and "bs_break_angle_moment" in texts[1], texts
    boxed = bs.Lattice(**cell(), angles={"triples": [[0, 1, 2]], "stiffness": 1.0, "rest_angle": np.pi}).with_images()
    bare = boxed.replace(box=None)
    assert bare.box is None and bare.shift is None and not any(bare.periodic) and np.array_equal(bare.lengths(), np.linalg.norm(np.diff(boxed.x[boxed.pairs], axis=1)[:, 0], axis=1))
    with bs.Simulation(bare, dt=0.1) as simulation:
        simulation.step()
