"""Where motions end and go on, what their checkpoints may not replace, and what a trajectory gives back as a network."""
import pathlib
import tempfile
import warnings

import h5py
import numpy as np
from helpers import raised

import backspring as bs

OSCILLATOR = dict(stiffness=3.0, fixed=[0], velocity=[[0.0], [1.0]])


def oscillator(**more):
    return bs.Lattice([0.0, 1], [[0, 1]], **{**OSCILLATOR, **more})


def ends_of_calls():
    """An end that run_until() is given is that of its call alone: output times and the end of the settings stay what they are, whatever calls come between."""
    def times(simulation, most=9):
        found = []
        while len(found) < most and simulation.next_frame():
            found.append(round(simulation.t, 10))
        return found

    for first in (lambda s: s.run_until(0.35), lambda s: s.step(3), lambda s: (s.run_until(0.35), s.step(1))):
        with bs.Simulation(oscillator(), dt=0.1, ts_max_time=1.0, bs_output_interval=0.25) as simulation:
            first(simulation)
            assert times(simulation) == [0.5, 0.75, 1.0], simulation.t
            simulation.step(2)
            assert simulation.t > 1.1 and times(simulation) == []
            simulation.run_until(1.5)
            assert abs(simulation.t - 1.5) < 1e-12 and times(simulation) == []
        with bs.Simulation(oscillator(), dt=0.1, bs_output_interval=0.25) as simulation:
            first(simulation)
            assert times(simulation, 3) == [0.5, 0.75, 1.0]
    with tempfile.TemporaryDirectory() as folder:
        for name, stops, expected in (("a", (0.55, 1.5), (0, 0.2, 0.4, 0.55, 0.6, 0.8, 1.0, 1.2, 1.4, 1.5)), ("b", (0.5, 0.55, 0.58, 1.0), (0, 0.2, 0.4, 0.5, 0.55, 0.58, 0.6, 0.8, 1.0))):
            with bs.Simulation(oscillator(), dt=0.1, bs_output=f"{folder}/{name}.h5md", bs_output_interval=0.2) as simulation:
                for stop in stops:
                    simulation.run_until(stop)
            with h5py.File(f"{folder}/{name}.h5md") as file:
                found = file["particles/trajectory/position/time"][...]
            assert np.allclose(found, expected, atol=1e-12) and len(found) == len(expected), found
    # a motion that ends at rest does so for all calls that go by an end
    damped = bs.Lattice([0.0, 1.2], [[0, 1]], stiffness=10.0, rest_length=1.0, damping=5.0, fixed=[0])
    frames = [f.t for f in bs.run(damped, dt=0.05, until=100.0, every=1.0, bs_stop_at_rest=1e-3)]
    with bs.Simulation(damped, dt=0.05, bs_stop_at_rest=1e-3) as simulation:
        simulation.run_until(100.0)
        rest = simulation.t
        simulation.run_until(100.0)
        assert simulation.t == rest and not simulation.next_frame()
        simulation.step(3)
        assert simulation.t > rest
    assert frames[:-1] == [float(k) for k in range(len(frames) - 1)] and abs(frames[-1] - rest) < 1e-12 and 1 < rest < 10, (frames, rest)


def ends_of_tables():
    """What a table gives ends with it: a motion without an end stops there, and one that does not come to it needs no more of it."""
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder) / "table.csv"
        table.write_text("0,0\n1,0.1\n")
        short = pathlib.Path(folder) / "short.csv"
        short.write_text("0,0\n0.5,0.05\n")
        net = bs.Lattice([0.0, 1, 2], [[0, 1], [1, 2]], stiffness=3.0, fixed=[0], groups={"end": [2]})
        for name, option in (("motion", dict(bs_motion_end=f"x=table:{table}")), ("force", dict(bs_force_end=f"table:{table}"))):
            with bs.Simulation(net, dt=0.1, **option) as simulation:
                with raised(bs.InputError, "table of -bs_"):
                    simulation.step(16)
                assert simulation.steps == 10 and abs(simulation.t - 1.0) < 1e-9, (name, simulation.steps, simulation.t)
            frames = []
            with raised(bs.InputError, "table of -bs_"), bs.Simulation(net, dt=0.1, bs_output_interval=0.5, **option) as simulation:
                while simulation.next_frame():
                    frames.append(round(simulation.t, 9))
            assert frames == [0.5, 1.0], (name, frames)
        for go in (lambda s: s.step(10), lambda s: s.run_until(0.4)):
            with bs.Simulation(net, dt=0.01, bs_motion_end=f"x=table:{short}") as simulation:
                go(simulation)
        with bs.Simulation(net, dt=0.01, bs_motion_end=f"x=table:{short}") as simulation, raised(bs.InputError, "table of -bs_"):
            simulation.run_until(0.6)


def names_of_checkpoints():
    """A checkpoint takes no folder's place, nor that of what the motion writes or has read."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "there").mkdir()
        net = oscillator()
        net.save(folder / "net.h5")
        with bs.Simulation(net, dt=0.1, bs_output=str(folder / "a.h5md"), bs_report=str(folder / "a.json")) as simulation:
            simulation.step(3)
            for taken, word in ((folder / "there", "folder"), (folder / "a.h5md", "-bs_output"), (folder / "a.h5md.xdmf", "-bs_output"), (folder / "a.json", "-bs_report"),
                                (folder / "nowhere" / "c", "does not exist")):
                for _ in range(2):
                    with raised(bs.Error, word):
                        simulation.checkpoint(str(taken), overwrite=True)
            for _ in range(3):
                simulation.step()
                simulation.checkpoint(str(folder / "good"), overwrite=True)
            simulation.step()
        assert sorted(p.name for p in folder.iterdir()) == ["a.h5md", "a.json", "good", "good.previous", "net.h5", "there"], sorted(folder.iterdir())
        assert (folder / "there").is_dir() and bs.open(folder / "a.h5md").frames == 8
        with bs.Simulation.restart(str(folder / "good"), net) as again:
            assert again.steps == 6


def given_back():
    """A trajectory as a network has the anchors that the motion had, and goes on as it would have; a box that is sheared from a later time on carries
    particles along with its rate there."""
    rng = np.random.default_rng(7)
    x = np.array([[i, j] for i in range(3) for j in range(3)], dtype=float)
    pairs = [[a, b] for a in range(9) for b in range(a) if abs(x[a] - x[b]).sum() == 1]
    net = bs.Lattice(x, pairs, stiffness=20.0, rest_length=1.0, mass=0.3, velocity=0.4 * rng.standard_normal((9, 2)),
                     anchors={"particle": [0, 8], "point": [[0.0, -1], [2, 3.0]], "stiffness": [5.0, 9.0], "rest_length": [1.0, 0.7], "damping": [0.0, 0.0]})
    options = dict(ts_type="verlet", dt=1e-3)
    with tempfile.TemporaryDirectory() as folder, bs.Simulation(net, **options) as whole:
        with bs.Simulation(net, bs_output=f"{folder}/half.h5md", bs_output_interval=0.2, **options) as half:
            half.run_until(0.2)
        whole.run_until(0.4)
        again = bs.read(f"{folder}/half.h5md")
        for name, one in net.anchors.items():
            assert np.allclose(again.anchors[name], one, atol=1e-15), name
        with bs.Simulation(again, **options) as rest:
            rest.run_until(0.2)
            assert abs(rest.x - whole.x).max() < 1e-12, abs(rest.x - whole.x).max()
    box = bs.Lattice(x, pairs, stiffness=20.0, rest_length=1.0, box=(4.0, 4.0), periodic=(True, True), fixed=())
    with bs.Simulation(box, dt=1e-3, ts_init_time=2.0, bs_box_strain="xy=expression:0.1*t*t") as simulation:
        rate, strain = 2 * 0.1 * 2.0, 0.1 * 4.0
        assert abs(simulation.v[:, 0] - rate * simulation.x[:, 1]).max() < 1e-12 and abs(simulation.v[:, 1]).max() < 1e-12, (simulation.v, strain)


def long_boxes():
    """Which image of a particle is nearest is known beside edges that are thousands of times longer than the springs."""
    for edges, periodic in (((3e4, 1.0), (True, True)), ((3.0, 1e5), (True, False)), ((1e7, 2.0), (True, True))):
        eq = bs.statics(bs.Lattice([[0.0, 0], [1, 0.2]], [[0, 1]], stiffness=1.0, rest_length=0.5, box=edges, periodic=periodic, fixed=[0]))
        assert abs(np.hypot(*(eq.x[1] - eq.x[0])) - 0.5) < 1e-9, edges
    with raised(bs.InputError, "equally near"):
        bs.statics(bs.Lattice([[0.0, 0], [1.5, 0.2]], [[0, 1]], stiffness=1.0, rest_length=0.5, box=(3.0, 1e5), periodic=(True, False), fixed=[0]))


def what_estimates_miss():
    """Steps that follow an error do not see dashpots: it is told. Own forces with an energy have a symmetric tangent, which sensitivities want."""
    chain = bs.Lattice([0.0, 1], [[0, 1]], stiffness=5.0, rest_length=1.0, law="maxwell", spring_columns={"relaxation_time": [0.3]}, fixed=[0])
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with bs.Simulation(chain, dt=0.01, ts_type="arkimex") as simulation:
            simulation.step()
    assert any("-ts_adapt_dt_max" in str(one.message) for one in said), [str(one.message) for one in said]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with bs.Simulation(chain, dt=0.01) as simulation:
            simulation.step()
    assert not said, [str(one.message) for one in said]
    net = bs.Lattice([0.0, 1], [[0, 1]], stiffness=3.0, rest_length=1.0, fixed=[0])
    weak = bs.Forces(lambda t, x, v: t * (2 - 0.5 * x), tangent=lambda t, x, v: np.full((1, 1), -0.5 * t), energy=lambda t, x: t * (0.25 * x[:, 0]**2 - 2 * x[:, 0]))
    with bs.Statics(net, forces=weak) as solver:
        eq = solver.solve()
        place = (2 + 3 * 1.0) / 3.5  # 2 - x/2 = k (x - L)
        assert abs(eq.x[1, 0] - place) < 1e-10
        slopes = solver.sensitivities([[0.0], [1.0]])
        assert abs(slopes["stiffness"][0] + (place - 1) / 3.5) < 1e-9 and abs(slopes["rest_length"][0] - 3 / 3.5) < 1e-9, slopes


def told_apart():
    """Groups that differ by capitals alone are refused; what waits for a load is not at rest; springs that are given at a later time stretched as their supports have it there have not
    yielded; a force that couples all particles beside one linear solve a step is solved for."""
    net = bs.Lattice([0.0, 1, 2], [[0, 1], [1, 2]], stiffness=3.0, rest_length=1.0, fixed=[0], groups={"A": [1], "a": [2]})
    with tempfile.TemporaryDirectory() as folder, raised(bs.InputError, "capitals"):
        net.save(f"{folder}/net.h5")
        next(bs.run(f"{folder}/net.h5", dt=0.1, until=1.0))
    waits = net.replace(groups={"end": [2]})
    frames = [f.t for f in bs.run(waits, dt=0.1, until=2.0, every=0.5, bs_force_end="expression:step(t-0.75)", bs_stop_at_rest=1e-3)]
    assert frames == [0.0, 0.5, 1.0, 1.5, 2.0], frames
    plastic = bs.Lattice([0.0, 1], [[0, 1]], stiffness=100.0, rest_length=1.0, law="plastic", spring_columns={"yield_force": [1.0], "hardening": [0.0]}, fixed=[0], groups={"end": [1]})
    with bs.Simulation(plastic, dt=0.01, ts_init_time=10.0, bs_motion_end="x=expression:0.1*(t-10)") as simulation:
        simulation.step(5)
        assert abs(simulation.reactions[1, 0] - 100 * 0.1 * 0.05) < 1e-9, simulation.reactions
    chain = bs.Lattice(np.stack([np.arange(450.0), 0.05 * np.sin(np.arange(450))], 1), [[k, k + 1] for k in range(449)], stiffness=50.0, rest_length=1.0)
    pull = dict(bs_xsp_center_of_mass=500, bs_xsp_center_of_mass_damping=5, bs_xsp_attraction_center=(100, 50), ts_type="rosw")
    with bs.Simulation(chain, dt=0.02, ts_adapt_type="none", **pull) as apart, bs.Simulation(chain, dt=0.02, ts_adapt_type="none", bs_dense_coupling_max=1000, **pull) as whole:
        apart.step(5)
        whole.step(5)
        assert abs(apart.x - whole.x).max() < 1e-7, abs(apart.x - whole.x).max()


def strained_starts():
    """A box that is strained where a motion or an equilibrium begins has carried along all that is free, once: the energy is that of the affine strain."""
    n, k = 4, 3.0
    edges = n * np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    x = np.array([(i * edges[0] + j * edges[1]) / n for i in range(n) for j in range(n)])
    pairs = np.array([(n * i + j, n * ((i + a) % n) + (j + b) % n) for i in range(n) for j in range(n) for a, b in ((1, 0), (0, 1), (1, n - 1))])
    net = bs.Lattice(x, pairs, stiffness=k, rest_length=1.0, box=edges, mass=2.0)
    F = np.array([[1.06, 0.04], [-0.02, 0.97]])
    now = "xx=expression:0.06,xy=expression:0.04,yx=expression:-0.02,yy=expression:-0.03"
    flows = "xx=velocity:0.03,xy=velocity:0.02,yx=velocity:-0.01,yy=velocity:-0.015"
    energy = 0.5 * k * np.sum((np.linalg.norm(net.ways() @ F.T, axis=1) - 1)**2)
    for options, rate in ((dict(bs_box_strain=now), np.zeros((2, 2))), (dict(bs_box_strain=flows, ts_init_time=2.0), (F - np.eye(2)) / 2)):
        with warnings.catch_warnings(), bs.Simulation(net, dt=1e-3, ts_type="cn", **options) as simulation:
            warnings.simplefilter("error")
            assert abs(float(simulation.observables["elastic_energy"]) - energy) < 1e-12 * energy and np.allclose(simulation.x, x @ F.T, rtol=0, atol=1e-14)
            assert np.allclose(simulation.v, x @ np.transpose(rate), rtol=0, atol=1e-14)
            simulation.step(3)
            simulation.x = simulation.x  # begins anew where it is
            assert np.allclose(simulation.x, x @ (F + simulation.steps * 1e-3 * rate).T, rtol=0, atol=1e-9)
    for more in (dict(bs_box_strain=now), dict(bs_box_strain=now.replace("expression", "velocity"), bs_load_scale="none")):
        eq = bs.statics(net, **more)
        assert abs(eq.energy - energy) < 1e-12 * energy and np.allclose(eq.x, x @ F.T, rtol=0, atol=1e-12), more
    # springs that yield: those of a lattice that is not carried along do where they go across the edges, which stays
    brittle = net.replace(law="plastic", spring_columns={"yield_force": np.full(len(pairs), 0.3), "hardening": np.zeros(len(pairs))})
    assert abs(bs.statics(brittle, bs_box_strain=now).energy - energy) < 1e-12 * energy
    # what is held stays where it is, a roller along its rail; the others go along
    part = net.replace(fixed=[5], groups={"rail": [9]})
    with bs.Simulation(part, dt=1e-3, bs_box_strain=now, bs_motion_rail="y=fixed") as simulation:
        free = ~np.isin(np.arange(n * n), (5, 9))
        assert np.array_equal(simulation.x[5], x[5]) and simulation.x[9, 1] == x[9, 1] and np.allclose(simulation.x[free], x[free] @ F.T, rtol=0, atol=1e-14)


def dragged():
    """Drag against a fluid that does not flow with the box is refused, whichever drag it is, from where the box flows on; not where it stands, and not in equilibria."""
    cell = bs.Lattice([[0.0, 0], [1, 0], [0, 1], [1, 1]], [[0, 1], [0, 2], [1, 3], [2, 3]], stiffness=20.0, rest_length=1.0, box=(3.0, 3.0))
    ball = dict(bs_sphere_drag=True, bs_sphere_drag_rho=1.0, bs_sphere_drag_mu=1.0, bs_radius=0.1)
    shape = dict(bs_shape_drag="cube", bs_shape_drag_rho=1.0, bs_shape_drag_area=0.1)
    for drag in (dict(bs_stokes_drag=1.0), dict(bs_viscosity=1.0), ball, shape):
        for end in ({}, dict(ts_max_time=1.0)):
            with raised(bs.InputError, "drag" if "bs_viscosity" not in drag else "viscosity", "bs_box_strain", "images"):
                with bs.Simulation(cell, dt=0.01, bs_box_strain="xy=velocity:0.1", **drag, **end) as simulation:
                    simulation.step()
        with bs.Simulation(cell, dt=0.01, bs_box_strain="xy=expression:0.1", **drag) as simulation:
            simulation.step(2)
        bs.statics(cell.replace(fixed=[0]), bs_box_strain="xy=velocity:0.1", **drag)
    with raised(bs.InputError, "drag of each particle"):
        with bs.Simulation(cell.replace(particle_columns={"drag": np.ones(4)}), dt=0.01, bs_box_rate="xx=0.1") as simulation:
            simulation.step()
    # against the flow of the box it is a force of one's own, the same whichever image of a particle the lattice has
    net, L = cell.replace(velocity=[[0.3, 0], [0, 0], [0, -0.2], [0.1, 0]]).with_images(), np.array([[0.0, 0.1], [0, 0]])
    x, shift = net.x + [[0, 0], [0, 0], [0, 0], [0, 3.0]], net.shift - [[0, 0], [0, 0], [0, 1], [0, 1]]
    found = []
    for one in (net, net.replace(x=x, shift=shift)):
        with bs.Simulation(one, dt=0.01, ts_type="rk", ts_adapt_type="none", forces=lambda t, x, v: -(v - x @ L.T), bs_box_strain="xy=velocity:0.1") as simulation:
            simulation.step(20)
            found.append(simulation.x)
    assert np.allclose(found[1] - found[0], [[0, 0], [0, 0], [0, 0], [0.1 * 0.2 * 3.0, 3.0]], rtol=0, atol=1e-12), found[1] - found[0]
