"""What quantities of an equilibrium change by with the numbers of its springs: closed forms, differences of equilibria, ranks, and a net that is designed by it."""
import numpy as np
from helpers import python, raised
from scipy.optimize import minimize

import backspring as bs
from cases import bent_cell, cell, folded_cell, sheet, strip, weak

# code of several ranks: prints what one rank finds, too
ON_RANKS = '''
import backspring as bs, numpy as np
from mpi4py import MPI
from cases import bent_cell, folded_cell, sheet, strip
nets = ((sheet(), 2, dict(loads={"bottom": (0.3, -20.0)})), (strip(), 6, dict(loads={"tip": (0, 0, -0.3)}, bs_group_tip="xmax")),
        (bent_cell(), 4, dict(bs_box_strain="xy=velocity:0.05")), (folded_cell(), 4, dict(bs_box_strain="xy=velocity:0.05")))
for net, count, options in nets[1:2] if MPI.COMM_WORLD.size == 8 else nets:
    net = bs.Lattice(**net)
    slope = np.random.default_rng(5).standard_normal(net.x.shape)
    found = []
    for comm in (MPI.COMM_WORLD, MPI.COMM_SELF):
        with bs.Statics(net, snes_rtol=1e-13, comm=comm, **options) as solver:
            solver.solve()
            found.append(solver.sensitivities(slope))
    assert len(found[0]) == count, found[0].keys()
    for name in found[0]:
        assert abs(found[0][name] - found[1][name]).max() < 1e-9 * abs(found[1][name]).max(), name
'''


def differences(net, names, rows=5, step=1e-5, **options):
    """The worst relative disagreement of sensitivities with central differences of equilibria."""
    rng, worst = np.random.default_rng(3), 0.0
    with bs.Statics(net, snes_rtol=1e-13, **options) as solver:
        eq = solver.solve()
        weights = rng.standard_normal(eq.x.shape)
        quantity = lambda x: (weights * x).sum() + (x**2).sum() / 2
        found = solver.sensitivities(weights + eq.x)
        for name in names:
            before = solver._session.numbers(name)
            for row in rng.choice(len(before), rows, replace=False):
                h, values = step * max(abs(before[row]), 0.1), []
                for sign in (1, -1):
                    numbers = before.copy()
                    numbers[row] += sign * h
                    solver.change(**{name: numbers})
                    values.append(quantity(solver.solve().x))
                worst = max(worst, abs((values[0] - values[1]) / (2 * h) - found[name][row]) / abs(found[name]).max())
            solver.change(**{name: before})
            solver.solve()
    return worst


def sensitivities():
    """Two springs in series, nets under loads, motions and strains of the box, laws of every kind, angle springs and hinges beside them."""
    series = bs.Lattice([0.0, 1, 2], [[0, 1], [1, 2]], stiffness=[2.0, 3.0], rest_length=1.0, fixed=[0], groups={"end": [2]})
    with bs.Statics(series, loads={"end": 6.0}, snes_rtol=1e-12) as solver:
        with raised(bs.InputError, "no equilibrium"):
            solver.sensitivities(np.zeros((3, 1)))
        solver.solve()
        found = solver.sensitivities([[0], [0], [1]])
        assert np.allclose(found["stiffness"], [-6 / 2**2, -6 / 3**2], rtol=1e-9) and np.allclose(found["rest_length"], 1, rtol=1e-9), found
        with raised(bs.InputError, "slope", "(3, 1)"):
            solver.sensitivities(np.zeros(2))
        solver.change(stiffness=2.0)
        with raised(bs.InputError, "numbers of now"):
            solver.sensitivities(np.zeros((3, 1)))
    both = ("stiffness", "rest_length")
    pulled = dict(loads={"bottom": (0.3, -20.0)})
    assert differences(bs.Lattice(**sheet()), both, **pulled) < 1e-7
    assert differences(bs.Lattice(**sheet()), both, bs_motion_bottom="x=fixed,y=velocity:-0.5", load_steps=4) < 1e-7
    n = len(sheet()["pairs"])
    rng = np.random.default_rng(1)
    laws = bs.Lattice(**sheet(), law=[("hooke", "strain", "polynomial", "tension")[k % 4] for k in range(n)],
                      spring_columns={"stiffness_2": rng.uniform(-5, 5, n), "stiffness_3": rng.uniform(0, 5, n)})
    light = dict(loads={"bottom": (0.3, -2.0)}, load_steps=4)
    assert differences(laws, both, **light) < 1e-7 and differences(laws, ("stiffness_2", "stiffness_3"), step=1e-2, **light) < 1e-5
    assert differences(bs.Lattice(**cell(), fixed=[0]), both, bs_box_strain="xy=velocity:0.05") < 1e-7
    hung = dict(loads={"tip": (0, 0, -0.3)}, bs_group_tip="xmax")
    bends = ("angle_stiffness", "angle_rest_angle", "hinge_stiffness", "hinge_rest_angle")
    assert differences(bs.Lattice(**strip()), both, **hung) < 1e-6 and differences(bs.Lattice(**strip()), bends, rows=2, **hung) < 1e-6
    sheared = dict(bs_box_strain="xy=velocity:0.05")
    assert differences(bs.Lattice(**bent_cell()), (*both, *bends[:2]), **sheared) < 1e-6
    assert differences(bs.Lattice(**folded_cell()), (*both, *bends[2:]), rows=3, **sheared) < 1e-6
    torn = dict(loads={"bottom": (0.3, -8.0)}, load_steps=4)  # eight springs break
    assert differences(bs.Lattice(**weak()), both, rows=8, **torn) < 1e-7
    with bs.Statics(bs.Lattice(**weak()), **torn) as solver:
        eq = solver.solve()
        assert eq.broken.sum() == 8 and not solver.sensitivities(eq.x)["stiffness"][eq.broken].any()
    with bs.Statics(bs.Lattice(**cell())) as solver:
        solver.solve()
        with raised(bs.InputError, "tied to nothing"):
            solver.sensitivities(np.zeros((25, 2)))
    skew = bs.Forces(lambda s, x, v: 0 * x, tangent=lambda s, x, v: np.zeros((*x.shape, 2)))
    with bs.Statics(bs.Lattice(**sheet()), forces=skew) as solver:
        solver.solve()
        with raised(bs.InputError, "symmetric"):
            solver.sensitivities(np.zeros((42, 2)))


def bent():
    """Two bars, of which the first is held: the second, under a force F across it at its end, turns by phi where kappa (phi - phi_0) = -F cos(phi); then
    dphi/dphi_0 = kappa/(kappa - F sin(phi)) and dphi/dkappa = (phi_0 - phi)/(kappa - F sin(phi)). What is out of its range is refused, and what was before stays."""
    kappa, rest, F = 3.0, 0.4, 1.7
    net = bs.Lattice([[0.0, 0], [1, 0], [2, 0]], [[1, 2]], stiffness=1e6, rest_length=1.0, fixed=[0, 1], groups={"end": [2]},
                     angles={"triples": [[0, 1, 2]], "stiffness": kappa, "rest_angle": np.pi + rest})
    with bs.Statics(net, loads={"end": (0, -F)}, snes_rtol=1e-13) as solver:
        for kappa, rest in ((3.0, 0.4), (2.0, 0.4), (2.0, -0.1)):
            solver.change(angle_stiffness=kappa, angle_rest_angle=[np.pi + rest])
            x, y = solver.solve().x[2] - [1, 0]
            phi, slope = np.arctan2(y, x), np.zeros((3, 2))
            assert abs(kappa * (phi - rest) + F * np.hypot(x, y) * np.cos(phi)) < 1e-11, (kappa, rest, phi)
            slope[2] = -y, x  # of phi, where the bar is 1 long; it gives 1e-6
            found = solver.sensitivities(slope)
            assert abs(found["angle_rest_angle"][0] - kappa / (kappa - F * np.sin(phi))) < 1e-5, found
            assert abs(found["angle_stiffness"][0] - (rest - phi) / (kappa - F * np.sin(phi))) < 1e-5, found
        assert solver.lattice.angles["stiffness"][0] == 2 and solver.lattice.angles["rest_angle"][0] == np.pi - 0.1
        for wrong, words in ((dict(angle_stiffness=-1.0), ("angle spring 0", "angle_stiffness -1", "finite number >= 0")), (dict(angle_rest_angle=7.0), ("between 0 and 2 pi",)),
                             (dict(angle_stiffness=[1.0, 2.0]), ("angle_stiffness",)), (dict(hinge_stiffness=1.0), ("hinge_stiffness", "angle_stiffness"))):
            with raised(bs.InputError, *words):
                solver.change(**wrong)
        again = solver.solve(afresh=True).x[2] - [1, 0]
        assert abs(again - [x, y]).max() < 1e-9
        fresh = bs.statics(solver.lattice, loads={"end": (0, -F)}, snes_rtol=1e-13).x[2] - [1, 0]
        assert abs(fresh - [x, y]).max() < 1e-9


def designed():
    """The stiffnesses of a net by which its lower row comes to rest on a given curve, by SciPy's quasi-Newton method and these gradients."""
    net = bs.Lattice(**sheet())
    low = np.flatnonzero(net.groups["bottom"])
    with bs.Statics(net, loads={"bottom": (0, -4.0)}, snes_rtol=1e-12) as solver:
        start = solver.solve()
        wanted = start.x[low, 1] - 0.05 * np.sin(np.pi * np.arange(7) / 6)

        def misfit(logarithms):
            solver.change(stiffness=net.stiffness * np.exp(logarithms))
            eq = solver.solve()
            slope = np.zeros_like(eq.x)
            slope[low, 1] = eq.x[low, 1] - wanted
            return (slope**2).sum() / 2, solver.sensitivities(slope)["stiffness"] * solver.lattice.stiffness

        found = minimize(misfit, np.zeros(len(net.pairs)), jac=True, method="L-BFGS-B", options={"maxiter": 60, "ftol": 0, "gtol": 1e-12})
        solver.change(stiffness=net.stiffness * np.exp(found.x))
        assert abs(solver.solve().x[low, 1] - wanted).max() < 1e-5, (found.message, found.fun, found.nfev)


FOLLOWED = '''
import backspring as bs, numpy as np
from cases import sheet
net = bs.Lattice(**sheet())
options = dict(loads={"bottom": (0.3, -20.0)}, snes_rtol=1e-12)
rng = np.random.default_rng(8)
one = np.where(np.arange(len(net.pairs)) == 40, 3.0, 1.0)
with bs.Statics(net, **options) as solver:
    solver.solve()
    for factor in (one, 10 ** rng.uniform(-0.3, 0, len(one)), one, np.ones(len(one))):
        solver.change(stiffness=factor * net.stiffness)
        eq, afresh = solver.solve(), bs.statics(net.replace(stiffness=factor * net.stiffness), **options)
        assert abs(eq.x - afresh.x).max() < 1e-9, abs(eq.x - afresh.x).max()
        assert eq.newton <= 12 and eq.krylov > 0, (eq.newton, eq.krylov)  # iterations with the factors that were there, first
'''


def followed_on_ranks():
    """Equilibria that are followed with the factors of the last one, on one rank and three: where one spring has changed, and where all have."""
    for ranks in (1, 3):
        done = python(FOLLOWED, ranks, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr


def followed():
    """The same where the shape becomes unstable."""
    # two bars under the load P = 1 and a spring across that holds their joint: stable where its stiffness is above 2 P/l
    column = bs.Lattice([[0.0, 0], [1, 0], [2, 0], [1, 1]], [[0, 1], [1, 2], [1, 3]], stiffness=[50.0, 50, 3], rest_length=1.0, fixed=[0, 3], groups={"end": [2]})
    with bs.Statics(column, loads={"end": (-1.0, 0)}, bs_motion_end="y=fixed") as solver:
        for stiffness, bent in ((3, False), (2.5, False), (1.5, True), (1.6, True)):
            solver.change(stiffness=[50, 50, stiffness])
            eq = solver.solve()
            assert (abs(eq.x[1, 1]) > 0.05) == bent and eq.observables["stability"] == 1, (stiffness, eq.x)


def soft_beside_stiff():
    """A column a hair beyond its buckling load is unstable, however stiff what stands beside it is: P = 1 on bars of k = 50, two springs across of stiffness
    P/l - c/2 each, so that the curvature across is -c."""
    curvature, side = 5e-4, np.hypot(0.5, 0.8)
    for stiff in (50.0, 1e10):
        x = [[0, 0], [1, 0], [2, 0], [0.98, 1], [0.98, -1], [5, 0], [6, 0], [5.5, 0.8]]
        across = 1 / 0.98 - curvature / 2
        net = bs.Lattice(x, [[0, 1], [1, 2], [1, 3], [1, 4], [5, 7], [6, 7]], stiffness=[50, 50, across, across, stiff, stiff], rest_length=[1, 1, 1, 1, side, side],
                         fixed=[0, 3, 4, 5, 6], groups={"end": [2]})
        for load, negative in ((-1.0, 1), (-0.999, 0)):
            found = bs.statics(net, loads={"end": (load, 0)}, bs_motion_end="y=fixed", bs_equilibria="any").observables
            assert found["negative_pivots"] == negative and found["stability"] == (-1 if negative else 1), (stiff, load, found)


def on_ranks():
    """The same on three ranks as on one, and on eight, of which some have no particle of the strip, which has six."""
    for ranks in (3, 8):
        done = python(ON_RANKS, ranks, timeout=120)
        assert done.returncode == 0, done.stdout + done.stderr
