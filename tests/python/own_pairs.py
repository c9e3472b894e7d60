"""Forces of one's own between particles: springs in Python are the built-in ones, on any number of ranks."""
import numpy as np

import backspring as bs
from cases import cell, sheet

STIFFNESS = 40.0


def tied():
    """A net, pairs of its particles that no spring joins, and the rest lengths of springs between these."""
    net, rng = bs.Lattice(**sheet()), np.random.default_rng(2)
    joined = {tuple(pair) for pair in np.sort(net.pairs, axis=1).tolist()}
    drawn = np.unique(np.sort(rng.choice(len(net), (60, 2)), axis=1), axis=0).tolist()
    links = np.array([pair for pair in drawn if pair[0] != pair[1] and tuple(pair) not in joined])
    return net, links, 0.9 * np.linalg.norm(net.x[links[:, 1]] - net.x[links[:, 0]], axis=1)


def in_python(links, rest):
    """Springs between these particles as forces of one's own, of which a rank computes those at its particles."""
    def at(x, rows):
        place = np.full(links.max() + 1, -1)
        known = rows <= links.max()
        place[rows[known]] = np.flatnonzero(known)
        i, j = place[links].T
        here = (i >= 0) & (j >= 0)
        way = x[j[here]] - x[i[here]]
        return i[here], j[here], way, np.linalg.norm(way, axis=1), rest[here]

    def force(t, x, v, rows):
        f = np.zeros_like(x)
        i, j, way, l, L = at(x, rows)
        pull = (STIFFNESS * (l - L) / l)[:, None] * way
        np.add.at(f, i, pull)
        np.add.at(f, j, -pull)
        return f

    def energy(t, x, rows):
        e = np.zeros(len(x))
        i, j, _, l, L = at(x, rows)
        for end in (i, j):
            np.add.at(e, end, STIFFNESS / 4 * (l - L) ** 2)
        return e

    def tangent(t, x, v, rows, pairs):
        K, (i, j, way, l, L) = np.zeros((len(x), 2, 2)), at(x, rows)
        uu = way[:, :, None] * way[:, None, :] / (l**2)[:, None, None]
        blocks = STIFFNESS * (uu + (1 - L / l)[:, None, None] * (np.eye(2) - uu))
        for end in (i, j):
            np.add.at(K, end, -blocks)
        of = {**dict(zip(zip(i, j), blocks)), **dict(zip(zip(j, i), blocks))}
        return K, np.zeros((2, 2)), np.reshape([of[tuple(pair)] for pair in pairs.tolist()], (-1, 2, 2))

    return bs.Forces(force, tangent=tangent, energy=energy, between=np.vstack([links, links[:, ::-1]]))


def compare():
    net, links, rest = tied()
    own = in_python(links, rest)
    built_in = net.replace(pairs=np.vstack([net.pairs, links]), stiffness=np.append(net.stiffness, np.full(len(links), STIFFNESS)),
                           rest_length=np.append(net.rest_length, rest), damping=np.append(np.full(len(net.pairs), 0.3), np.zeros(len(links))))
    implicit = dict(dt=0.05, snes_rtol=1e-13)
    for options in (dict(ts_type="verlet", dt=1e-3), implicit, dict(implicit, ts_type="cn"), dict(implicit, condensed_pc_type="gamg"), dict(implicit, snes_mf="", pc_type="none"),
                    dict(implicit, pc_type="jacobi", ksp_type="gmres")):
        newton = [[], []]
        with bs.Simulation(net, forces=own, **options) as mine, bs.Simulation(built_in, **options) as theirs:
            for simulation, counts in zip((mine, theirs), newton):
                simulation.on_step(lambda step, t, dt, count, *_: counts.append(count))
                simulation.step(10)
            assert abs(mine.x - theirs.x).max() < 1e-13 and abs(sum(newton[0]) - sum(newton[1])) <= 0.2 * sum(newton[1]), (options, mine.x - theirs.x, newton)
            assert abs(mine.observables["total_energy"] - theirs.observables["total_energy"]) < 1e-11
    loads = dict(bs_gravity=(0, -1.0), snes_rtol=1e-12)
    eq, expected = bs.statics(net, forces=own, **loads), bs.statics(built_in, **loads)
    assert abs(eq.x - expected.x).max() < 1e-13 and eq.newton == expected.newton
    assert np.allclose(bs.modes(eq, 5).omega2, bs.modes(expected, 5).omega2, rtol=1e-12)


def between_on_ranks():
    """Before this process starts MPI."""
    from helpers import python  # of a run that has the program's path, which compare() on several ranks has not

    done = python("import own_pairs; own_pairs.compare()", 3, timeout=240)
    assert done.returncode == 0, done.stdout + done.stderr


def between_particles():
    """On one rank; one force alone that follows another particle; pairs that are none."""
    from helpers import raised

    compare()
    # the third mass follows the second one, which does not feel it: x'' = -k (x - y - 1) with y = 1 + t
    chain = bs.Lattice([[0.0], [1.0], [2.0]], [[0, 1]], stiffness=1.0, rest_length=1.0, mass=1.0, velocity=[[1.0], [1.0], [0.0]])
    k = 25.0
    follows = bs.Forces(lambda t, x, v: np.array([[0], [0], k * (x[1] - x[2] + 1)]), between=[[2, 1]],
                        tangent=lambda t, x, v: (np.reshape([0, 0, -k], (3, 1, 1)), np.zeros((1, 1)), np.full((1, 1, 1), k)))
    with bs.Simulation(chain, dt=1e-3, ts_type="cn", snes_rtol=1e-13, forces=follows) as simulation:
        simulation.run_until(1.0)
        w = np.sqrt(k)  # x_3 = 2 + t - sin(w t)/w
        assert abs(simulation.x[2, 0] - (3 - np.sin(w) / w)) < 1e-4 and abs(simulation.x[1, 0] - 2) < 1e-12, simulation.x
    net, force = bs.Lattice(**sheet()), lambda t, x, v: 0 * x
    for words, pairs in ((("between, row 1", "[3, 3]"), [[0, 1], [3, 3]]), (("between", "(P, 2)"), [0, 1, 2]), (("between", "float64"), [[0.0, 1.0]])):
        with raised(bs.InputError, *words):
            bs.Forces(force, between=pairs)
    with raised(bs.InputError, "between, row 0", "42 particles"):
        bs.Simulation(net, dt=1e-3, forces=bs.Forces(force, between=[[0, 42]]))
    with raised(bs.InputError, "between particles", "periodic box"):
        bs.moduli(bs.Lattice(**cell()), forces=bs.Forces(force, between=[[0, 1]]))
    with raised(ValueError, "tangent", "K_between"):
        bs.statics(net, forces=bs.Forces(force, between=[[0, 1]], tangent=lambda t, x, v: np.zeros((2, 2))))
