"""Forces that are computed in Python, sessions that share a boundary, and what petsc4py sees."""
import os
import pathlib
import re
import subprocess
import tempfile

import numpy as np
from helpers import raised

import backspring as bs
from cases import sheet


REACH = 0.1


def barrier(gap):
    """Energy, force and its slope of the logarithmic barrier of incremental potential contact (M. Li et al., ACM Trans. Graph. 39, 2020) at a gap > 0, 0 beyond REACH."""
    inside = gap < REACH
    with np.errstate(invalid="ignore"):
        log = np.log(np.where(inside, gap, REACH) / REACH)
    far = np.where(inside, gap - REACH, 0.0)
    return -50 * far**2 * log, 50 * (2 * far * log + far**2 / gap), 50 * (2 * log + 4 * far / gap - far**2 / gap**2)


def barriers():
    """A plate that repels within a short distance alone is not jumped over by steps that are far longer, which end where the forces balance; without a limit of
    Newton's steps it is."""
    def plate(side, limited=True):
        """On particles that are above it (side 1) or below it."""
        def slopes(t, x, v):
            K = np.zeros((len(x), 2, 2))
            K[:, 1, 1] = barrier(np.abs(x[:, 1]))[2]
            return K

        def limit(t, x, dx):
            toward = -dx[:, 1] / x[:, 1]
            return 0.8 / toward.max() if (toward > 0).any() else np.inf

        return bs.Forces(lambda t, x, v: np.stack([0 * x[:, 0], np.sign(x[:, 1]) * barrier(np.abs(x[:, 1]))[1]], 1), tangent=slopes,
                         energy=lambda t, x: barrier(np.abs(x[:, 1]))[0], **({"step_limit": limit} if limited else {}))

    low, high = 1e-6, REACH
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if barrier(np.array(middle))[1] > 2.0 * 10 else (low, middle)
    fall = dict(x=[[0.3, 1.0], [0.8, 2.5]], pairs=np.zeros((0, 2), int), mass=2.0)
    for side in (1, -1):
        for options in ({}, dict(snes_linesearch_type="guarded"), dict(ts_type="theta", ts_theta_theta=0.8, ts_theta_endpoint=True)):
            drop = {**fall, "x": np.array(fall["x"]) * [1, side]}
            with bs.Simulation(bs.Lattice(**drop), dt=0.5, forces=plate(side), bs_gravity=(0, -10 * side), bs_stokes_drag=2.0, **options) as simulation:
                heights = [(simulation.step(), simulation.x[:, 1] * side)[1] for _ in range(60)]
            assert np.min(heights) > 0, (options, np.min(heights))
            assert abs(heights[-1] - low).max() < 1e-6, (options, heights[-1], low)
    with bs.Simulation(bs.Lattice(**fall), dt=0.5, forces=plate(1, limited=False), bs_gravity=(0, -10), bs_stokes_drag=2.0) as simulation:
        simulation.step(10)
        assert (simulation.x[:, 1] < -1).all()  # the case is one
    # an equilibrium: a spring pulls a particle to the other side of the plate
    hung = bs.Lattice([[0.0, -1.0], [0, 0.6]], [[0, 1]], stiffness=30.0, rest_length=0.5, fixed=[0])
    only = bs.Forces(lambda t, x, v: np.where([[0], [1]], plate(1).force(t, x, v), 0), tangent=lambda t, x, v: plate(1).tangent(t, x, v) * np.array([0, 1])[:, None, None],
                     energy=lambda t, x: plate(1).energy(t, x) * [0, 1], step_limit=plate(1).step_limit)
    stays = bs.statics(hung, forces=only, load_steps=1).x[1, 1]
    assert 0 < stays < REACH and abs(barrier(np.array(stays))[1] - 30 * (stays + 1 - 0.5)) < 1e-8, stays


def flying_pair():
    """Two that fly at each other, on any number of ranks, and one that follows: they do not pass through each other. What cannot limit steps is refused."""
    def slopes_between(t, x, v, rows, pairs):
        at = {int(row): k for k, row in enumerate(rows)}
        K, across = np.zeros((len(x), 1, 1)), np.zeros((len(pairs), 1, 1))
        if 0 in at and 1 in at:
            slope = barrier(x[at[1], 0] - x[at[0], 0])[2]
            K[at[0]] = K[at[1]] = slope
            across[:] = -slope
        return K, 0 * K, across

    def near(x, rows):
        at = {int(row): k for k, row in enumerate(rows)}
        return (at[0], at[1]) if 0 in at and 1 in at else None

    def between(t, x, v, rows):
        f, ends = np.zeros_like(x), near(x, rows)
        if ends:
            push = barrier(x[ends[1], 0] - x[ends[0], 0])[1]
            f[ends[0]], f[ends[1]] = -push, push
        return f

    def energies(t, x, rows):
        E, ends = np.zeros(len(x)), near(x, rows)
        if ends:
            E[list(ends)] = 0.5 * barrier(x[ends[1], 0] - x[ends[0], 0])[0]
        return E

    def closing(t, x, dx, rows):
        ends = near(x, rows)
        if not ends:
            return np.inf
        gap, change = (q[ends[1], 0] - q[ends[0], 0] for q in (x, dx))
        return -0.8 * gap / change if change < 0 else np.inf

    forces = bs.Forces(between, tangent=slopes_between, energy=energies, between=[[0, 1], [1, 0]], step_limit=closing)
    line = bs.Lattice([[-1.0], [1.0], [3.0]], [[1, 2]], stiffness=5.0, rest_length=2.0, mass=1.0, velocity=[[9.0], [-8.0], [0.0]])
    with bs.Simulation(line, dt=0.5, forces=forces) as simulation:
        gaps = [(simulation.step(), np.diff(simulation.x[:2, 0])[0])[1] for _ in range(20)]
        assert min(gaps) > 0 and gaps[-1] > REACH, gaps
        momentum = simulation.v[:, 0].sum()
    assert abs(momentum - 1.0) < 1e-7, momentum
    with raised(bs.InputError, "step_limit"):
        bs.Forces(between, step_limit=0.5)
    with raised(ValueError, "step_limit"):
        bs.Simulation(line, dt=0.5, forces=bs.Forces(between, step_limit=lambda t, x, dx: -1.0)).step()
    for options in (dict(ts_type="verlet"), dict(ts_type="bdf"), dict(snes_linesearch_type="basic")):
        with raised(bs.InputError, "limit", "ts_type beuler"):
            bs.Simulation(line, dt=0.01, forces=forces, **options).step()


def own_forces():
    """A spring computed in Python is the built-in one; an error in it is raised; gravity by hand."""
    x, pairs = np.arange(5.0)[:, None], np.array([[i, i + 1] for i in range(4)])
    base = dict(stiffness=40.0, rest_length=0.95, mass=0.5, fixed=[0])
    for options in (dict(ts_type="verlet", dt=1e-3), dict(dt=1e-3, snes_rtol=1e-14), dict(ts_type="rk", dt=1e-3, ts_adapt_type="none")):
        def pull(t, x, v, rows):
            f = np.zeros_like(x)
            assert rows.tolist() == [0, 1, 2, 3, 4] and x.shape == v.shape == (5, 1) and t >= 0
            force = 7.0 * (x[4] - x[2] - 1.5)
            f[2], f[4] = force, -force
            return f

        ours = bs.Simulation(bs.Lattice(x, pairs, **base), forces=pull, **options)
        theirs = bs.Simulation(bs.Lattice(x, np.vstack([pairs, [2, 4]]), **{**base, "stiffness": [40.0] * 4 + [7], "rest_length": [0.95] * 4 + [1.5]}), **options)
        ours.step(100)
        theirs.step(100)
        assert abs(ours.x - theirs.x).max() < 1e-14 and abs(ours.forces - theirs.forces).max() < 2e-13, (options, abs(ours.x - theirs.x).max())  # 40 N/m
    net = bs.Lattice(**sheet())
    weight = lambda s, x, v, rows: s * np.array([0, -2.0]) * net.mass[rows, None]
    eq, expected = bs.statics(net, forces=weight, load_steps=2), bs.statics(net, bs_gravity=(0, -2.0), load_steps=2)
    assert abs(eq.x - expected.x).max() < 1e-11 and np.allclose(eq.tension, expected.tension, atol=1e-9)

    # all particles in their order, whatever is fixed or driven: rows of the net are those of the forces
    held, wind = bs.Lattice(**{**sheet(), "fixed": [0, 1, 2, 20, 22]}), np.linspace(0, 1, 2 * len(net)).reshape(-1, 2)
    for options in (dict(ts_type="verlet"), {}, dict(bs_motion_bottom="x=fixed")):
        with bs.Simulation(held, dt=1e-3, forces=lambda t, x, v: wind, **options) as ours, \
                bs.Simulation(held.replace(particle_columns={"force": wind}), dt=1e-3, **options) as theirs:
            ours.step(20)
            theirs.step(20)
            assert abs(ours.x - theirs.x).max() < 1e-12, (options, abs(ours.x - theirs.x).max())
    with raised(bs.InputError, "forces", "real"):
        bs.Simulation(net, dt=1e-3, forces=lambda t, x, v: 1j * x).step()

    def broken(t, x, v):
        if t > 0.0045:
            raise ZeroDivisionError("in the wind")
        return 0 * x

    simulation = bs.Simulation(net, dt=1e-3, forces=broken)
    with raised(ZeroDivisionError, "in the wind"):
        simulation.run_until(1.0)
    assert simulation.steps == 4
    with raised(ValueError, "shape"):
        bs.Simulation(net, dt=1e-3, forces=lambda t, x, v: x[0]).step()
    with raised(bs.InputError, "function"):
        bs.statics(net, forces=3)


def implicit_forces():
    """Forces with their tangent and energy: a built-in spring's motion and Newton iterations, an equilibrium far from the start, modes, energies."""
    x, pairs = np.array([[0.0, 0], [1, 0.1], [2, 0]]), [[0, 1], [1, 2]]
    base = dict(stiffness=40.0, rest_length=[1.0, 1.1], mass=0.5)
    net = bs.Lattice(x, pairs, fixed=[0], **base)
    k, L, point = 300.0, 0.4, np.array([2.5, 0.8])
    last = lambda rows: (np.asarray(rows) == 2).astype(float)[:, None]

    def pull(t, x, v, rows):
        way = x - point
        l = np.linalg.norm(way, axis=1)[:, None]
        return -last(rows) * k * (l - L) * way / l

    def tangent(t, x, v, rows):
        way = x - point
        l = np.linalg.norm(way, axis=1)[:, None, None]
        uu = way[:, :, None] * way[:, None, :] / l**2
        return -last(rows)[:, None] * k * (uu + (1 - L / l) * (np.eye(2) - uu))

    def energy(t, x, rows):
        return last(rows)[:, 0] * k / 2 * (np.linalg.norm(x - point, axis=1) - L) ** 2

    ours = bs.Forces(pull, tangent=tangent, energy=energy)
    assert "tangent and energy" in repr(ours)
    tied = bs.Lattice(np.vstack([x, point]), [*pairs, [2, 3]], stiffness=[40.0, 40, k], rest_length=[1.0, 1.1, L], mass=0.5, fixed=[0, 3])
    for options in (dict(dt=0.05, snes_rtol=1e-13), dict(dt=0.05, snes_rtol=1e-13, ts_type="cn")):
        with bs.Simulation(net, forces=ours, **options) as mine, bs.Simulation(tied, **options) as theirs:
            counts = [[], []]
            for simulation, count in zip((mine, theirs), counts):
                simulation.on_step(lambda step, t, dt, newton, *_: count.append(newton))
                simulation.step(20)
            assert abs(mine.x - theirs.x[:3]).max() < 1e-12, abs(mine.x - theirs.x[:3]).max()
            assert np.array_equal(*counts), counts
            assert abs(mine.observables["total_energy"] - theirs.observables["total_energy"]) < 1e-11
    eq, expected = bs.statics(net, forces=ours), bs.statics(tied)
    assert abs(eq.x - expected.x[:3]).max() < 1e-9 and eq.newton <= expected.newton + 2, (eq.x - expected.x[:3], eq.newton, expected.newton)
    assert np.allclose(bs.modes(eq, 4).omega2, bs.modes(expected, 4).omega2, rtol=1e-8)
    # stiff drag, which no explicit part of Newton's method bears
    drag = bs.Forces(lambda t, x, v: -1e4 * v, tangent=lambda t, x, v: (np.zeros((2, 2)), -1e4 * np.eye(2)))
    stokes = dict(dt=0.1, bs_gravity=(0, -9.81), snes_rtol=1e-13)
    with bs.Simulation(net, forces=drag, **stokes) as mine, bs.Simulation(net, bs_stokes_drag=1e4, **stokes) as theirs:
        mine.step(5)
        theirs.step(5)
        assert abs(mine.x - theirs.x).max() < 1e-12
    with raised(ValueError, "tangent", "(3, 2, 2)"):
        bs.statics(net, forces=bs.Forces(pull, tangent=lambda t, x, v: np.zeros(3)))
    with raised(bs.InputError, "energy"):
        bs.Forces(pull, energy=3)


def kicks(number, rows):
    """Random numbers of a step, one for each particle, whatever rank it is on."""
    return np.random.default_rng([5, number]).normal(size=5)[np.asarray(rows), None]


class Kicked:
    """Forces that are drawn anew for every step, and what they were told."""

    def __init__(self):
        self.force, self.told = None, []

    def begin(self, t, h, number, attempt, x, v, rows):
        self.told.append((t, h, number, attempt, x.copy(), v.copy(), rows.copy()))
        self.force = kicks(number, rows) / h**0.5

    def forces(self):
        return bs.Forces(lambda t, x, v: 0 * x if self.force is None else self.force, tangent=lambda t, x, v: np.zeros((1, 1)), begin_step=self.begin)


def kicked_chain():
    """Forces drawn once a step: a chain's motion by each method is its recursion in NumPy, on any number of ranks."""
    x0, steps, h, k, m = np.arange(5.0), 30, 0.02, 40.0, 0.5
    net = bs.Lattice(x0[:, None], [[i, i + 1] for i in range(4)], stiffness=k, rest_length=1.0, mass=m, fixed=[0])
    K = k * (np.diag([0, 2, 2, 2, 1.0]) - np.diag([0, 1, 1, 1.0], 1) - np.diag([0, 1, 1, 1.0], -1))[1:, 1:]
    one = np.eye(4)
    for kind, c in (("beuler", 0.8), ("cn", 0.8), ("symplectic", 0.8), ("verlet", 0.0), ("rk", 0.8)):
        kicked, u, v = Kicked(), np.zeros(4), np.zeros(4)
        implicit = dict(snes_rtol=1e-14) if kind in ("beuler", "cn") else dict(ts_adapt_type="none")
        with bs.Simulation(net, dt=h, ts_type=kind, forces=kicked.forces(), bs_stokes_drag=c, **implicit) as simulation:
            simulation.step(steps)
            for n in range(1, steps + 1):
                F = kicks(n, range(1, 5))[:, 0] / h**0.5
                a = lambda u, v: (F - K @ u - c * v) / m
                if kind == "beuler":
                    v = np.linalg.solve((m / h + c) * one + h * K, m / h * v - K @ u + F)
                    u = u + h * v
                elif kind == "cn":
                    before, was = a(u, v), v
                    v = np.linalg.solve((m + h / 2 * c) * one + h * h / 4 * K, m * v + h / 2 * (m * before + F - K @ (u + h / 2 * v)))
                    u = u + h / 2 * (was + v)
                elif kind == "symplectic":
                    v = v + h * a(u, v)
                    u = u + h * v
                elif kind == "verlet":
                    v = v + h / 2 * a(u, v)
                    u = u + h * v
                    v = v + h / 2 * a(u, v)
                else:  # Bogacki and Shampine's third order, PETSc's default
                    p, q = v, a(u, v)
                    p2, q2 = v + h / 2 * q, a(u + h / 2 * p, v + h / 2 * q)
                    p3, q3 = v + 3 * h / 4 * q2, a(u + 3 * h / 4 * p2, v + 3 * h / 4 * q2)
                    u, v = u + h * (2 * p + 3 * p2 + 4 * p3) / 9, v + h * (2 * q + 3 * q2 + 4 * q3) / 9
            worst = max(abs(simulation.x[1:, 0] - x0[1:] - u).max(), abs(simulation.v[1:, 0] - v).max())
            assert worst < 1e-10 * abs(v).max(), (kind, worst)
        told = kicked.told
        assert [one[2:4] for one in told] == [(n, 0) for n in range(1, steps + 1)], (kind, [one[2:4] for one in told])
        assert np.allclose([one[:2] for one in told], [(h * n, h) for n in range(steps)], rtol=1e-13, atol=1e-14)
        rows = told[0][6]
        assert (told[0][4][:, 0] == x0[rows]).all() and (len(rows) < 2 or abs(told[-1][4] - told[0][4]).max() > 1e-3 < abs(told[-1][5]).max())


def random_forces():
    """On one rank; a step that is rejected is begun again from where it began; equilibria; what goes wrong at a beginning."""
    kicked_chain()
    # iterations run out where the steps are long: attempts count from 0, are shorter and from the same place
    kicked = Kicked()
    flat = bs.Lattice(np.array([[0.0, 0], [1, 0], [2, 0]]), [[0, 1], [1, 2]], stiffness=1e4, rest_length=1.0, mass=0.5, fixed=[0])
    begin = lambda t, h, number, attempt, x, v: kicked.told.append((t, h, number, attempt, x.copy(), v.copy()))
    wind = bs.Forces(lambda t, x, v: np.array([0, -50.0]) + 0 * x, tangent=lambda t, x, v: np.zeros((2, 2)), energy=lambda t, x: 50 * x[:, 1], begin_step=begin)
    with bs.Simulation(flat, dt=0.2, forces=wind, snes_max_it=4) as simulation:
        simulation.step(2)
    again = [(a, b) for a, b in zip(kicked.told, kicked.told[1:]) if b[3] > 0]
    assert again, [one[:4] for one in kicked.told]
    for a, b in again:
        assert b[2] == a[2] and b[3] == a[3] + 1 and b[1] < a[1] and b[0] == a[0] and (b[4] == a[4]).all() and (b[5] == a[5]).all(), (a, b)
    # equilibria: every load step begins, by its load factor
    kicked.told.clear()
    pull = bs.Forces(lambda s, x, v: np.array([s, 0]) + 0 * x, tangent=lambda s, x, v: np.zeros((2, 2)), energy=lambda s, x: -s * x[:, 0], begin_step=begin)
    bs.statics(flat, load_steps=4, forces=pull)
    assert [one[2:4] for one in kicked.told] == [(n, 0) for n in range(1, 5)] and np.allclose([one[0] for one in kicked.told], [0, 0.25, 0.5, 0.75]), kicked.told

    def broken(t, h, number, *_):
        if number == 3:
            raise ZeroDivisionError("at the beginning")

    simulation = bs.Simulation(flat, dt=1e-3, forces=bs.Forces(lambda t, x, v: 0 * x, begin_step=broken))
    with raised(ZeroDivisionError, "at the beginning"):
        simulation.step(5)
    assert simulation.steps == 2, simulation.steps
    with raised(bs.InputError, "begin_step"):
        bs.Forces(lambda t, x, v: x, begin_step=3)


def coupled():
    """Two halves of a chain, each step repeated until they agree on the place of and the force on the particle that they share, are the whole chain."""
    x, k, options = 1.05 * np.arange(9.0)[:, None], 60.0, dict(dt=0.02, snes_rtol=1e-13)
    part = lambda a, b, **more: bs.Lattice(x[a:b], [[i, i + 1] for i in range(b - a - 1)], stiffness=k, rest_length=1.0, mass=1.0, groups={"end": [b - a - 1]}, **more)
    force = [0.0]
    pull = lambda t, x, v, rows: np.where((np.asarray(rows) == 0)[:, None], force[0], 0.0)
    with bs.Simulation(part(0, 9, fixed=[0]), **options) as whole, bs.Simulation(part(0, 5, fixed=[0]), bs_motion_end="given", **options) as left, \
            bs.Simulation(part(4, 9), forces=bs.Forces(pull), **options) as right:
        place = left.x[4, 0]
        for n in range(1, 11):
            states = left.save(), right.save()
            for _ in range(50):
                left.restore(states[0])
                right.restore(states[1])
                left.drive("end", [[place]], 0.02 * n)
                left.step()
                force[0] = -left.reactions[4, 0]
                right.step()
                off = right.x[0, 0] - place
                place += 0.9 * off
                if abs(off) < 1e-13:
                    break
            whole.step()
            assert abs(np.vstack([left.x, right.x[1:]]) - whole.x).max() < 1e-11, n
        with raised(bs.InputError, "given"):
            whole.drive("end", [[0.0]], 9.0)
        with raised(bs.InputError, "group 'top'"):
            left.drive("top", [[0.0]], 9.0)
        with raised(bs.InputError, "shape"):
            left.drive("end", [0.0], 9.0)
        with raised(bs.InputError, "later time"):
            left.drive("end", [[0.0]], 0.1)
        with raised(bs.InputError, "checkpoint"):
            left.checkpoint("left.checkpoint")
    with raised(bs.InputError, "bs_output"), tempfile.TemporaryDirectory() as folder:
        with bs.Simulation(part(0, 3), bs_output=f"{folder}/a.h5md", **options) as writing:
            writing.restore(writing.save())


def petsc_of(module):
    """The PETSc libraries that a file of machine code is linked with."""
    linked = subprocess.run(["ldd", module], capture_output=True, text=True, check=True).stdout
    return {os.path.realpath(path) for path in re.findall(r"=> (\S*libpetsc\S*)", linked)}


def in_petsc():
    """The stepper of a simulation as petsc4py has it: its solvers, its state, the size of its Jacobian; no petsc4py of another PETSc is loaded."""
    import petsc4py

    net = bs.Lattice(**sheet())
    ours = next(pathlib.Path(bs.__file__).parent.glob("_core*.so"))
    theirs = next(pathlib.Path(petsc4py.__file__).parent.glob("lib/**/PETSc.*.so"))
    if petsc_of(ours) != petsc_of(theirs):
        with bs.Simulation(net, dt=2e-3) as simulation, raised(ImportError, "built without petsc4py: petsc4py belongs to the PETSc in", "build it again"):
            simulation.petsc()
        return
    from petsc4py import PETSc

    with bs.Simulation(net, dt=2e-3, ts_type="cn", snes_rtol=1e-12, bs_operator="assembled") as simulation:
        simulation.step(3)
        ts = simulation.petsc()
        assert isinstance(ts, PETSc.TS) and ts.getType() == "theta" or ts.getType() == "cn", ts.getType()
        assert ts.getStepNumber() == 3 and abs(ts.getTime() - 6e-3) < 1e-15 and ts.getSNES().getConvergedReason() > 0
        assert ts.getSNES().getTolerances()[0] == 1e-12 and isinstance(ts.getSNES().getKSP(), PETSc.KSP)
        y = ts.getSolution().getArray(readonly=True).reshape(len(net), 2, 2)
        assert np.array_equal(np.sort(y[:, 0], axis=0), np.sort(simulation.x, axis=0))
        J = ts.getSNES().getJacobian()[0]
        assert J.getSize() == (4 * len(net), 4 * len(net))
    assert ts.getRefCount() == 1
    with bs.Statics(net, bs_gravity=(0, -9.81), snes_rtol=1e-12) as solver:
        with raised(bs.InputError, "no equilibrium"):
            solver.petsc()
        solver.solve()
        solver.change(stiffness=1.01 * net.stiffness)
        eq, ts = solver.solve(), solver.petsc()
        assert ts.getSNES().getConvergedReason() > 0 and abs(ts.getTime() - 1) < 1e-15 and ts.getSNES().getTolerances()[0] == 1e-12
        y = ts.getSolution().getArray(readonly=True).reshape(len(net), 2, 2)
        assert np.array_equal(np.sort(y[:, 0], axis=0), np.sort(eq.x, axis=0))
