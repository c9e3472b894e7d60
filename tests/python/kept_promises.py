"""What the package says of equilibria, motions, boxes and atoms holds: load factors on paths, settings that go on, places where motions begin, images, pictures."""
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
