#!/usr/bin/env python3
"""Networks and what is computed of them, once by the package and once by the program. As a script: computes one case by the package and saves its
arrays; run it under mpirun for several ranks."""
import pathlib
import sys

import numpy as np

MESHES = pathlib.Path(__file__).resolve().parents[2] / "meshes"


def triangular(rows, columns, rng, slack=0.0):
    """Positions, pairs and stiffnesses of a triangular patch with uneven springs."""
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    x = np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=-1).reshape(-1, 2) + 0.05 * rng.standard_normal((rows * columns, 2))
    at = lambda r, c: r * columns + c
    pairs = [(at(r, c), at(r, c + 1)) for r in range(rows) for c in range(columns - 1)]
    pairs += [(at(r, c), at(r + 1, c)) for r in range(rows - 1) for c in range(columns)]
    pairs += [(at(r, c + 1), at(r + 1, c)) for r in range(rows - 1) for c in range(columns - 1)]
    pairs = np.array(pairs)
    L = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1) * (1 - slack)
    return x, pairs, rng.uniform(50, 150, len(pairs)), L


def sheet():
    """A patch that hangs on its upper row; its lower row is a group."""
    x, pairs, k, L = triangular(6, 7, np.random.default_rng(3), slack=0.01)
    top, bottom = np.arange(35, 42), np.arange(7)
    mass = np.random.default_rng(4).uniform(0.5, 1.5, len(x))
    return dict(x=x, pairs=pairs, stiffness=k, rest_length=L, mass=mass, damping=0.3, fixed=top, groups={"bottom": bottom, "hung": top})


def cell():
    """A periodic net of bent squares, braced by diagonals."""
    rng = np.random.default_rng(5)
    n = 5
    i, j = np.meshgrid(np.arange(n), np.arange(n))
    x = np.stack([i, j], axis=-1).reshape(-1, 2) + 0.1 * rng.standard_normal((n * n, 2))
    pairs, shift = [], []
    for r in range(n):
        for c in range(n):
            for dr, dc in ((0, 1), (1, 0), (1, 1)):
                pairs.append((r * n + c, (r + dr) % n * n + (c + dc) % n))
                shift.append(((c + dc) // n, (r + dr) // n))
    pairs, shift = np.array(pairs), np.array(shift)
    way = x[pairs[:, 1]] + shift @ (n * np.eye(2)) - x[pairs[:, 0]]
    return dict(x=x, pairs=pairs, stiffness=rng.uniform(1, 2, len(pairs)), rest_length=0.98 * np.linalg.norm(way, axis=1), box=(n, n), shift=shift)


def parts():
    """A strip with anchors, angle springs, hinges and springs that break."""
    x = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.1], [1, 1, 0], [2, 1, 0.2]])
    pairs = np.array([[0, 1], [1, 2], [3, 4], [4, 5], [0, 3], [1, 4], [2, 5], [1, 3], [2, 4]])
    return dict(x=x, pairs=pairs, stiffness=np.linspace(50, 90, 9), rest_length=np.linspace(0.9, 1.1, 9), damping=0.1, mass=0.2, fixed=[0],
                anchors=dict(particle=np.array([2, 5]), point=np.array([[2.5, 0, 0], [2.5, 1, 0.0]]), stiffness=np.array([20.0, 30]), rest_length=np.array([0.4, 0.5]),
                             damping=np.array([0.0, 0.1])),
                angles=dict(triples=np.array([[0, 1, 2], [3, 4, 5]]), stiffness=np.array([0.5, 0.6]), rest_angle=np.array([np.pi, 3.0])),
                hinges=dict(quads=np.array([[1, 3, 0, 4], [2, 4, 1, 5]]), stiffness=np.array([0.2, 0.3]), rest_angle=np.array([0.0, 0.1])),
                breaking=dict(critical_strain=np.full(9, 0.3)), area=np.full(9, 1e-3))


def strip():
    """The strip with angle springs and hinges away from angles that end their ranges."""
    net = parts()
    net["x"][1, 2], net["x"][4, 2] = -0.1, 0.3
    net["angles"]["rest_angle"] = np.array([2.9, 2.8])
    return net


def bent_cell():
    """The periodic net with angle springs, some of them across the edges of the box."""
    net = cell()
    middle = np.array([0, 4, 12, 20, 24])
    row, column = middle // 5, middle % 5
    triples = np.stack([row * 5 + (column - 1) % 5, middle, row * 5 + (column + 1) % 5], axis=1)
    return {**net, "fixed": [0], "angles": {"triples": triples, "stiffness": np.linspace(0.2, 0.4, 5), "rest_angle": np.linspace(2.5, 3.5, 5)}}


def folded_cell():
    """The periodic net in three dimensions, folded along its diagonals, with hinges at some of them, also across the edges of the box."""
    net, n = cell(), 5
    x = np.column_stack([net["x"], 0.15 * np.random.default_rng(6).standard_normal(n * n)])
    row, column = np.array([0, 1, 2, 4, 4, 3]), np.array([0, 2, 4, 1, 4, 3])
    at = lambda r, c: r % n * n + c % n
    quads = np.stack([at(row, column), at(row + 1, column + 1), at(row, column + 1), at(row + 1, column)], axis=1)
    return {**net, "x": x, "shift": np.pad(net["shift"], ((0, 0), (0, 1))), "box": (n, n, 40), "fixed": [0],
            "hinges": {"quads": quads, "stiffness": np.linspace(0.2, 0.4, 6), "rest_angle": np.linspace(-0.3, 0.5, 6)}}


def weak():
    """The patch with springs that break, those of few rows as they lie below the others' limits."""
    return {**sheet(), "breaking": {"critical_strain": np.random.default_rng(1).uniform(0.02, 0.4, 101)}}


LOAD = {"bottom": (0.3, -2.0)}
MOTION = dict(dt=2e-3, until=0.05, every=0.01, bs_gravity=(0, -9.81))
# name: (network, task and options of the program, what the package does)
CASES = {
    "statics": (sheet, {"bs_task": "statics", "bs_load_steps": 4, "bs_force_bottom": "0.3,-2", "bs_output_springs": 1},
                lambda bs, net: equilibrium(bs.statics(net, loads=LOAD, load_steps=4))),
    "statics_total": (sheet, {"bs_task": "statics", "bs_force_bottom": "0.3,-2,total", "bs_gravity": "0,-9.81", "bs_output_springs": 1},
                      lambda bs, net: equilibrium(bs.statics(net, loads=LOAD, total=True, bs_gravity=(0, -9.81)))),
    "modes": (sheet, {"bs_task": "modes", "bs_modes": 5}, lambda bs, net: vibrations(bs.modes(net, 5))),
    "modes_loaded": (sheet, {"bs_task": "modes", "bs_modes": 5, "bs_modes_about": "equilibrium", "bs_load_steps": 1, "bs_force_bottom": "0.3,-2"},
                     lambda bs, net: vibrations(bs.modes(bs.statics(net, loads=LOAD), 5))),
    "moduli": (cell, {"bs_task": "moduli"}, lambda bs, net: {"stiffness": bs.moduli(net).stiffness}),
    "cn": (sheet, {"ts_type": "cn"}, lambda bs, net: motion(bs.run(net, ts_type="cn", **MOTION))),
    "beuler": (sheet, {"ts_type": "beuler"}, lambda bs, net: motion(bs.run(net, **MOTION))),
    "verlet": (sheet, {"ts_type": "verlet"}, lambda bs, net: motion(bs.run(net, ts_type="verlet", **MOTION))),
    "alpha2": (sheet, {"ts_type": "alpha2"}, lambda bs, net: motion(bs.run(net, ts_type="alpha2", **MOTION))),
}
# networks of the program's own: generated, read from a scene, and one of every kind of part
GENERATED = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,5", "bs_lattice_dim": 2, "bs_lattice_perturbation": 0.1, "bs_lattice_stiffness": 300,
             "bs_lattice_fixed": "ymin", "bs_group_top": "ymax"}
CASES["generated"] = (None, {**GENERATED, "ts_type": "cn"}, lambda bs, net: motion(bs.run(bs.generate(
    "triangular", (6, 5), dim=2, perturbation=0.1, stiffness=300, fixed="ymin", bs_group_top="ymax"), ts_type="cn", **MOTION)))
CASES["scene"] = (None, {"bs_lattice_file": str(MESHES / "net.xsp"), "ts_dt": 1e-3, "ts_max_time": 0.02, "bs_output_interval": 0.01},
                  lambda bs, net: motion(bs.run(bs.read(MESHES / "net.xsp"), dt=1e-3, until=0.02, every=0.01)))
CASES["statics_breaking"] = (weak, {"bs_task": "statics", "bs_load_steps": 4, "bs_force_bottom": "0.3,-6.0", "bs_output_springs": 1},
                             lambda bs, net: broken(bs.statics(net, loads={"bottom": (0.3, -6.0)}, load_steps=4)))
CASES["breaking"] = (weak, {"ts_type": "verlet"}, lambda bs, net: falling_apart(bs.run(net, ts_type="verlet", dt=2e-3, until=0.2, every=0.05, bs_gravity=(0, -30.0))))
CASES["breaking"][1].update(ts_dt=2e-3, ts_max_time=0.2, bs_output_interval=0.05, bs_gravity="0,-30")
CASES["parts"] = (parts, {"ts_type": "beuler"}, lambda bs, net: motion(bs.run(net, **MOTION)))
for name in ("cn", "beuler", "verlet", "alpha2", "generated", "parts"):
    CASES[name][1].update(ts_dt=2e-3, ts_max_time=0.05, bs_output_interval=0.01, bs_gravity="0,-9.81")


def equilibrium(eq):
    return {"x": eq.x, "tension": eq.tension, "energy": eq.energy, "hung": eq.reactions["hung"], "newton": eq.newton}


def events(of):
    return {f"events_{name}": getattr(of.events, name) for name in ("time", "load", "spring", "ends", "strain", "energy", "avalanche")}


def broken(eq):
    return {**equilibrium(eq), **events(eq)}


def falling_apart(frames):
    all = list(frames)
    return {**motion(all), **events(all[-1])}


def vibrations(found):
    omega2, shapes = found
    return {"omega2": omega2, "shapes": shapes}


def motion(frames):
    all = [(f.t, f.x, f.v, f.energy) for f in frames]
    return {name: np.array([one[k] for one in all]) for k, name in enumerate(("t", "x", "v", "energy"))}


if __name__ == "__main__":
    import backspring as bs
    from mpi4py import MPI

    network, _, compute = CASES[sys.argv[1]]
    found = compute(bs, bs.Lattice(**network()) if network else None)
    if MPI.COMM_WORLD.rank == 0:
        np.savez(sys.argv[2], **found)

# a mesh of Gmsh with physical groups
SQUARE = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "held"
2 2 "plate"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
3
1 1 2 1 1 1 2
2 2 2 2 1 1 2 3
3 2 2 2 1 1 3 4
$EndElements
"""
