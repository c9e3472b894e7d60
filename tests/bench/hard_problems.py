"""Cases on which implicit steps are hard: springs are pushed, sheets fold and buckle, neighbouring stiffnesses lie far apart. Each at two
sizes (about 10^3 and 10^5 particles), every random number from a fixed seed."""
import pathlib
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "verify"))
import numpy as np
from harness import write_lattice
import cases

LONGEST, MULTIPLE = 0.02, 300  # the step is the shorter of so many seconds and of so many explicit ones


class Case:
    """options: of the program, without the step. free: nothing outside acts on it, so momentum is conserved. driven: something outside
    does work on it that its energies do not count (wind, anchors that move). count: particles."""

    def __init__(self, name, options, count, free=False, driven=False):
        self.name, self.options, self.count, self.free, self.driven = name, options, count, free, driven


def sheet(nx, ny):
    """(indices of a nx x ny grid, {class: pairs}) of a cloth: structural and shear springs, bending springs over two edges."""
    at = np.arange(nx * ny).reshape(nx, ny)
    pairs = lambda a, b: np.column_stack([a.ravel(), b.ravel()])
    return at, {"structural": np.vstack([pairs(at[:-1], at[1:]), pairs(at[:, :-1], at[:, 1:])]),
                "shear": np.vstack([pairs(at[:-1, :-1], at[1:, 1:]), pairs(at[1:, :-1], at[:-1, 1:])]),
                "bending": np.vstack([pairs(at[:-2], at[2:]), pairs(at[:, :-2], at[:, 2:])])}


def write_sheet(path, flat, x, classes, mass, fixed, refined):
    """Rest lengths are those of the flat sheet; stiffness [N/m] of a refined sheet: the membrane's stays, bending's falls as h^2."""
    values = {"structural": (1000.0, 2e-3), "shear": (300.0, 1e-3), "bending": (5.0 / refined**2, 1e-4)}
    rest = lambda p: np.linalg.norm(flat[p[:, 0]] - flat[p[:, 1]], axis=1)
    column = lambda which: np.concatenate([np.full(len(p), values[name][which]) for name, p in classes.items()])
    return write_lattice(path, x, mass, fixed=fixed, pairs=np.vstack(list(classes.values())), stiffness=column(0), damping=column(1) / refined,
                         rest_length=np.concatenate([rest(p) for p in classes.values()]), spring_law="hooke", damping_law="axial")


def folding_cloth(folder, large):
    """A square metre of cloth, upright on its corner, which is held: it crumples above it as it falls. Axial dampers."""
    n, rng = (316, 60)[not large], np.random.default_rng(1)
    _, classes = sheet(n, n)
    u, v = (a.ravel() / (n - 1) for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    flat = np.column_stack([(u - v) / np.sqrt(2), np.zeros(n * n), (u + v) / np.sqrt(2)])
    lean = np.column_stack([np.zeros(n * n), 0.03 * flat[:, 2]**2 + 0.01 * np.sin(7 * u) * np.cos(5 * v), np.zeros(n * n)])
    x = flat + lean + 1e-4 / (n - 1) * rng.standard_normal(flat.shape)
    file = write_sheet(folder, flat, x, classes, 0.2 / n**2, np.arange(n * n) == 0, (n - 1) / 59)
    return Case("folding cloth", {"bs_lattice_file": file, "bs_gravity": (0, 0, -9.81)}, n * n)


def twisted_cloth(folder, large):
    """A strip whose ends are held two turns and 15 % of its length closer than they were, at rest: edges are pulled, the middle is
    pushed. Anchors can move an end along, not turn it, so that it starts twisted."""
    nx, ny = (1000, 100) if large else (100, 10)
    rng = np.random.default_rng(2)
    at, classes = sheet(nx, ny)
    s, w = (a.ravel() for a in np.meshgrid(np.arange(nx) / (nx - 1), (np.arange(ny) / (ny - 1) - 0.5) * (ny - 1) / (nx - 1), indexing="ij"))
    flat = np.column_stack([s, w, np.zeros(len(s))])
    angle = 4 * np.pi * s
    x = np.column_stack([0.85 * s, w * np.cos(angle), w * np.sin(angle)])
    fixed = np.zeros(nx * ny, bool)
    fixed[at[[0, -1]].ravel()] = True
    x[~fixed] += 1e-3 / (nx - 1) * rng.standard_normal((np.count_nonzero(~fixed), 3))
    file = write_sheet(folder, flat, x, classes, 0.2 / (nx * nx), fixed, (nx - 1) / 99)
    return Case("twisted cloth", {"bs_lattice_file": file, "bs_gravity": (0, 0, -9.81)}, nx * ny)


def icosphere(level):
    """(vertices on the unit sphere, triangles) after `level` divisions of an icosahedron's faces: 10 4^level + 2 vertices."""
    g = (1 + 5**0.5) / 2
    x = np.array([[s, t * g, 0] for s in (-1, 1) for t in (-1, 1)])
    x = np.vstack([np.roll(x, k, axis=1) for k in range(3)])
    edge = np.linalg.norm(x[:, None] - x[None], axis=2) < 2.1
    faces = [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if edge[i, j] and edge[j, k] and edge[i, k]]
    x, faces = x / np.linalg.norm(x[0]), np.array(faces)
    for _ in range(level):
        edges = np.sort(np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        ends, which = np.unique(edges, axis=0, return_inverse=True)
        middle = len(x) + which.reshape(3, -1).T
        a, b, c, (ab, bc, ca) = *faces.T, middle.T
        faces = np.vstack([np.column_stack(f) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        between = x[ends].mean(axis=1)
        x = np.vstack([x, between / np.linalg.norm(between, axis=1)[:, None]])
    return x, faces


def hinges(faces):
    """(edges, the two vertices opposite each)"""
    sides = np.vstack([np.column_stack([np.sort(faces[:, [k, (k + 1) % 3]], axis=1), faces[:, (k + 2) % 3]]) for k in range(3)])
    sides = sides[np.lexsort((sides[:, 1], sides[:, 0]))]
    return sides[::2, :2], np.column_stack([sides[::2, 2], sides[1::2, 2]])


def shell(folder, large, level=None):
    """A closed shell that folds: edges, bending springs between the vertices opposite each edge, axial dampers, gravity, drag in a
    wind; a patch on one side is held, the one on the other hangs on anchors that move. 2,562 vertices, or 40,962."""
    level = level or (6 if large else 4)
    x, faces = icosphere(level)
    coarser = 4.0 ** (4 - level)  # what a vertex stands for, in those of 2,562
    edges, across = hinges(faces)
    patch = np.arccos(np.clip(x[:, 0], -1, 1)) < 0.08
    held = np.nonzero(patch)[0]
    fixed = np.arccos(np.clip(-x[:, 0], -1, 1)) < 0.08
    x = 0.5 * x + [0, 0, 1.5]
    each = lambda a, b: np.repeat([a, b], [len(edges), len(across)])
    file = write_lattice(folder, x, 2e-4 * coarser, fixed=fixed, pairs=np.vstack([edges, across]), stiffness=each(35.0, 0.8) * coarser**0.5,
                         damping=each(0.004, 0.002) * coarser**0.5, spring_law="strain", damping_law="axial",
                         anchors={"particle": held, "point": x[held], "stiffness": np.full(len(held), 200 * coarser),
                                  "rest_length": np.zeros(len(held)), "damping": np.zeros(len(held))})
    return Case("shell", {"bs_lattice_file": file, "bs_gravity": (0, 0, -9.81), "bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": (-0.1, 0.22, 0.045),
                          "bs_anchor_frequency": 0.5, "bs_fluid_velocity": (-1, 1.2, 0.3), "bs_shape_drag": "sphere", "bs_shape_drag_rho": 1.2,
                          "bs_shape_drag_area": 6e-4 * coarser}, len(x), driven=True)


def column(folder, large):
    """A column of rubber (18 neighbours, 5 x 5 x 40 or 20 x 20 x 200) between two plates a tenth closer than its length."""
    nx, nz = (20, 200) if large else (5, 40)
    rng, a = np.random.default_rng(4), 0.05
    grid = np.array(np.meshgrid(np.arange(nx), np.arange(nx), np.arange(nz), indexing="ij")).reshape(3, -1).T
    row = np.arange(len(grid)).reshape(nx, nx, nz)
    pairs = []
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)):
        low = [slice(max(0, -s), n - max(0, s)) for s, n in zip(step, row.shape)]
        high = [slice(max(0, s), n - max(0, -s)) for s, n in zip(step, row.shape)]
        pairs.append(np.column_stack([row[tuple(low)].ravel(), row[tuple(high)].ravel()]))
    pairs = np.vstack(pairs)
    rest = a * np.linalg.norm(grid[pairs[:, 0]] - grid[pairs[:, 1]], axis=1)
    fixed = (grid[:, 2] == 0) | (grid[:, 2] == nz - 1)
    x = a * grid * [1, 1, 0.9]
    x[~fixed] += 1e-3 * a * rng.standard_normal((np.count_nonzero(~fixed), 3))
    file = write_lattice(folder, x, 1000 * a**3, fixed=fixed, pairs=pairs, stiffness=1e6, rest_length=rest, spring_law="hooke")
    return Case("pressed column", {"bs_lattice_file": file}, len(x))


def random_net(folder, large):
    """A free triangular net in space, hardly out of its plane, with rest lengths 30 % longer or shorter than its springs, thrown."""
    n = (316, 58)[not large]
    rng, a = np.random.default_rng(5), 0.05
    i, j = (g.ravel() for g in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    x = a * np.column_stack([i + 0.5 * (j % 2), j * 3**0.5 / 2, np.zeros(n * n)])
    at, odd = np.arange(n * n).reshape(n, n), np.arange(n - 1) % 2
    pairs = [np.column_stack([at[:-1].ravel(), at[1:].ravel()])]
    for k, o in enumerate(odd):
        pairs.append(np.column_stack([at[:, k], at[:, k + 1]]))
        shifted = (at[:-1, k], at[1:, k + 1]) if o else (at[1:, k], at[:-1, k + 1])
        pairs.append(np.column_stack(shifted))
    pairs = np.vstack(pairs)
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1) * rng.uniform(0.7, 1.3, len(pairs))
    x += 1e-3 * a * rng.standard_normal(x.shape)
    velocity = np.array([0.3, -0.2, 0.5]) + 0.1 * rng.standard_normal(x.shape)
    file = write_lattice(folder, x, 0.01, velocity=velocity, pairs=pairs, stiffness=1e5, rest_length=rest, spring_law="hooke")
    return Case("random net", {"bs_lattice_file": file}, len(x), free=True)


def b2(folder, large):
    n = 47 if large else 10
    options = cases.problem("B2", n)
    for name in ("ts_dt", "ts_max_steps", "ts_max_time"):
        del options[name]
    return Case("B2", options, n**3)


def pulled_chain(folder, large):
    """A crooked chain in the plane, springs of 1e2 and 1e10 N/m in turn; one end is held, a long soft spring pulls the other."""
    n = 100_000 if large else 1000
    x = 0.01 * np.column_stack([np.arange(n), 0.2 * np.sin(1.3 * np.arange(n))])
    k = np.where(np.arange(n - 1) % 2 == 1, 1e10, 1e2)
    file = write_lattice(folder, x, 1.0, fixed=np.arange(n) == 0, pairs=np.column_stack([np.arange(n - 1), np.arange(1, n)]), stiffness=k,
                         spring_law="hooke", anchors={"particle": [n - 1], "point": [x[-1] + [100, 100]], "stiffness": [1.0], "rest_length": [0.0],
                                                      "damping": [0.0]})
    return Case("pulled chain", {"bs_lattice_file": file}, n)


CASES = (folding_cloth, shell, twisted_cloth, column, random_net, b2, pulled_chain)


def problems(folder, size):
    """Every case, its lattice written into `folder`."""
    for make in CASES:
        yield make(folder / f"{make.__name__}_{size}.h5", size == "large")


def step(limit):
    """The step [s] of a case whose largest stable explicit step is `limit`."""
    return min(LONGEST, MULTIPLE * limit)
