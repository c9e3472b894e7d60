#!/usr/bin/env python3
"""Free vibrations (-bs_task modes): closed forms, dense SciPy, an elastic network of a protein, buckling; ranks, solvers, counts."""
import io
import pathlib
import tempfile

import h5py
import numpy as np
from harness import REPO, Checks, read_table, write_lattice
from scipy.linalg import eigh
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree

RUNS = (("dense", 1), ("dense", 3), ("direct", 1), ("direct", 2), ("direct", 3), ("iterative", 1), ("iterative", 2), ("iterative", 3))


class Modes:
    """What a run wrote: omega_squared (K), shape (K, N, d), residual (K), participation (K, d), fluctuation (N), the report and stderr."""

    def __init__(self, checks, lattice, count, expect=0, ranks=None, **options):
        done = checks.run({"bs_lattice_file": lattice, "bs_task": "modes", "bs_modes": count, **options}, interval=0.0,
                          keep=("run.h5md",) if expect == 0 else (), expect=expect, **({} if ranks is None else {"ranks": ranks}))
        self.report, self.stderr, self.stdout = done.report, done.stderr, done.stdout
        if expect == 0:
            self.bytes = done.files["run.h5md"]
            with h5py.File(io.BytesIO(self.bytes), "r") as f:
                for name in ("omega_squared", "shape", "residual", "participation", "fluctuation"):
                    setattr(self, name, f["modes/" + name][...])


def stiffness(x, pairs, k, rest):
    """-K (N d, N d) of Hooke springs, from the textbook's block k (1 - L/l) (I - u u^T) + k u u^T."""
    n, d = x.shape
    A = np.zeros((n * d, n * d))
    for (i, j), ki, L in zip(pairs, np.broadcast_to(k, len(pairs)), np.broadcast_to(rest, len(pairs))):
        l = np.linalg.norm(x[j] - x[i])
        u = (x[j] - x[i]) / l
        block = ki * (np.outer(u, u) + (1 - L / l) * (np.eye(d) - np.outer(u, u)))
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            A[a * d:a * d + d, b * d:b * d + d] += sign * block
    return A


def dense(A, m, d, free=None):
    """Ascending omega^2 and M-normalised shapes (K, N, d) of SciPy."""
    n = len(m)
    keep = np.repeat(np.ones(n, bool) if free is None else free, d)
    values, vectors = eigh(A[np.ix_(keep, keep)], np.diag(np.repeat(m, d)[keep]))
    shapes = np.zeros((len(values), n * d))
    shapes[:, keep] = vectors.T
    return values, shapes.reshape(len(values), n, d)


def projector_gap(shapes, others, m):
    """Sine of the largest angle between the spaces that two sets of M-normalised shapes span."""
    root = np.sqrt(m)[None, :, None]
    P, Q = ((root * s).reshape(len(s), -1) for s in (shapes, others))
    return np.linalg.norm(P.T @ P - Q.T @ Q, 2)


def clusters(values, tolerance=1e-6):
    """Ranges of indices with equal omega^2."""
    cuts = [0, *(k for k in range(1, len(values)) if values[k] - values[k - 1] > tolerance * abs(values[k])), len(values)]
    return list(zip(cuts[:-1], cuts[1:]))


def grid(counts):
    return np.stack(np.meshgrid(*[np.arange(c) for c in counts], indexing="ij"), -1).reshape(-1, len(counts)).astype(float)


def near_pairs(x, distance):
    return np.array(sorted(cKDTree(x).query_pairs(distance)))


def check_chain(checks, folder):
    table = checks.oracles / "E_mechanics" / "chain_modes.csv"
    n, pairs = 10, np.c_[np.arange(11), np.arange(1, 12)]
    exact = 2 * np.sin(np.arange(1, n + 1) * np.pi / (2 * (n + 1)))
    if table.exists():
        checks.near("the table of the chain is the closed form", np.sort(read_table(table)["omega"]), exact, 1e-14)
    lattice = write_lattice(folder / "chain.h5", np.arange(12.)[:, None], 1.0, fixed=[1] + [0] * 10 + [1], pairs=pairs, stiffness=1.0, rest_length=1.0)
    for solver in ("dense", "direct"):
        for ranks in (1, 2, 3):
            got = Modes(checks, lattice, n, ranks=ranks, bs_modes_solver=solver)
            checks.near(f"chain, {solver}, {ranks} ranks: omega_j = 2 sin(j pi/22)", np.sqrt(got.omega_squared), exact, 1e-12)
            shape = np.sqrt(2 / (n + 1)) * np.sin(np.outer(np.arange(1, n + 1), np.arange(12)) * np.pi / (n + 1))
            shape *= np.sign(np.take_along_axis(shape, np.argmax(np.abs(shape) > (1 - 1e-6) * np.abs(shape).max(1, keepdims=True), 1)[:, None], 1))
            checks.near(f"chain, {solver}, {ranks} ranks: shapes with their largest component positive", got.shape[:, :, 0], shape, 1e-6)
    small = Modes(checks, lattice, 50)
    checks.true("more modes than the system has: all of them, and a warning", len(small.omega_squared) == n and "fewer than the 50" in small.stderr)
    checks.near("participation adds up to the moving mass", small.participation.sum(0), 10.0, 1e-12)
    checks.near("fluctuations are sum q^2/omega^2", small.fluctuation, (small.shape[:, :, 0] ** 2 / small.omega_squared[:, None]).sum(0), 1e-12)
    two = Modes(checks, lattice, 2, bs_modes_which="largest", bs_modes_solver="direct")
    checks.near("the two largest", two.omega_squared, exact[-2:] ** 2, 1e-10)
    for solver in ("dense", "direct"):
        middle = Modes(checks, lattice, 3, bs_modes_which="target", bs_modes_target=2.1, bs_modes_solver=solver)
        closest = np.sort(sorted(exact ** 2, key=lambda w: abs(w - 2.1))[:3])
        checks.near(f"three nearest to 2.1, {solver}", middle.omega_squared, closest, 1e-12)


def check_protein(checks, folder):
    data, table = REPO.parent / "shared" / "data" / "pdb1ubi_ca.pdb", checks.oracles / "E_mechanics" / "anm_1ubi.csv"
    if not (data.exists() and table.exists()):
        checks.skip("protein", "no reference results")
        return
    x = np.array([[float(line[k:k + 8]) for k in (30, 38, 46)] for line in data.read_text().splitlines() if line.startswith("ATOM")])
    pairs = near_pairs(x, 15.0)
    checks.true("76 particles, 1,428 springs", len(x) == 76 and len(pairs) == 1428)
    lattice = write_lattice(folder / "anm.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1))
    every = np.sort(read_table(table)["eigenvalue"])[6:]
    for ranks in (1, 3):
        got = Modes(checks, lattice, 222, ranks=ranks)
        checks.near(f"all 222 eigenvalues of ubiquitin's network, {ranks} ranks", got.omega_squared / every, 1.0, 1e-10)
        checks.near(f"the first three, {ranks} ranks", got.omega_squared[:3], [0.0339324, 0.1524283, 0.3597947], 5e-8)
        checks.true(f"six zero modes counted, {ranks} ranks", got.report["zero_modes"] == 6 and got.report["rigid_motions"] == 6)
    for solver in ("direct", "iterative"):
        got = Modes(checks, lattice, 20, bs_modes_solver=solver)
        checks.near(f"20 eigenvalues, {solver}", got.omega_squared / every[:20], 1.0, 1e-10)
    kept = Modes(checks, lattice, 8, bs_modes_rigid="keep", bs_modes_solver="direct")
    checks.near("rigid motions kept among the K", kept.omega_squared, np.r_[np.zeros(6), every[:2]], 1e-10)
    root = kept.shape[:6].reshape(6, -1)
    centred = x - x.mean(0)
    turns = [np.cross(axis, centred) for axis in np.eye(3)] + [np.tile(axis, (76, 1)) for axis in np.eye(3)]
    basis = np.linalg.qr(np.array(turns).reshape(6, -1).T)[0]
    checks.below("they span translations and rotations", np.linalg.norm(root.T @ root - basis @ basis.T, 2), 1e-10)


def check_cube(checks, folder):
    """Equal masses make omega^2 multiple; random ones and a stretched state do not."""
    x = grid((4, 4, 4))
    pairs = near_pairs(x, 1.5)
    rest = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    rng = np.random.default_rng(5)
    cases = {"free cube": (x, np.ones(64), rest, None), "held cube": (x, np.ones(64), rest, x[:, 2] > 0),
             "stretched cube of unequal masses": (x * [1.1, 1.0, 0.97], 10.0 ** rng.uniform(-1, 1, 64), rest, x[:, 2] > 0)}
    for name, (at, m, L, free) in cases.items():
        lattice = write_lattice(folder / "cube.h5", at, m, pairs=pairs, stiffness=2.0, rest_length=L, fixed=None if free is None else ~free)
        values, shapes = dense(stiffness(at, pairs, 2.0, L), m, 3, free)
        zero = 0 if free is not None else 6
        for solver, ranks in RUNS:
            got = Modes(checks, lattice, 14, ranks=ranks, bs_modes_solver=solver)
            label = f"{name}, {solver}, {ranks} ranks"
            expected = values[zero:zero + 14]
            checks.near(label + ": omega^2 of SciPy", got.omega_squared / expected, 1.0, 1e-10)
            checks.below(label + ": omega^2 within the residual", np.max(np.abs(got.omega_squared - expected) - got.residual), 1e-12)
            gram = np.einsum("kid,i,lid->kl", got.shape, m, got.shape)
            checks.near(label + ": M-normalised", gram, np.eye(14), 1e-9)
            gap = max([projector_gap(got.shape[a:b], shapes[zero + a:zero + b], m) for a, b in clusters(values[zero:]) if b <= 14] or [np.inf])
            checks.below(label + ": spaces of equal omega^2", gap, 1e-6)
            checks.true(label + f": {zero} rigid motions", got.report["rigid_motions"] == zero)


def check_residual(checks, folder):
    """The residual in the file is |M^-1/2 (K q + omega^2 M q)| of the shapes in it; a loose tolerance leaves it far above rounding."""
    x = grid((4, 4, 4))
    pairs, held = near_pairs(x, 1.5), x[:, 2] == 0
    rest, m = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1), np.linspace(0.5, 2.0, 64)
    lattice = write_lattice(folder / "cube.h5", x, m, pairs=pairs, stiffness=2.0, rest_length=rest, fixed=held)
    A, root = stiffness(x, pairs, 2.0, rest), np.sqrt(np.repeat(m, 3))
    for ranks in (1, 3):
        got = Modes(checks, lattice, 8, ranks=ranks, bs_modes_solver="iterative", eps_tol=1e-7)
        q = got.shape.reshape(8, -1)
        left = np.linalg.norm(((q @ A - got.omega_squared[:, None] * q * root ** 2) / root)[:, np.repeat(~held, 3)], axis=1)
        checks.true(f"residuals are above rounding, {ranks} ranks", left.min() > 1e-12 and left.max() > 1e-9, f"{left.min():.2g} to {left.max():.2g}")
        checks.near(f"residuals are those of the shapes, {ranks} ranks", got.residual / left, 1.0, 1e-2)
        checks.near(f"the mass that moves, {ranks} ranks", got.report["moving_mass"], m[~held].sum(), 1e-12)


def check_motions(checks, folder):
    """There are as many modes as components that can move, whatever holds the others; by that number densities of states are normed."""
    square = {"bs_task": "modes", "bs_lattice_type": "square", "bs_lattice_size": (4, 4), "bs_lattice_neighbors": 8, "bs_modes": 100, "bs_modes_rigid": "keep", "bs_modes_solver": "dense"}
    for name, held, motions, mass in (("fixed", {"bs_lattice_fixed": "xmin"}, 24, 12), ("held by a motion", {"bs_group_A": "xmin", "bs_motion_A": "fixed"}, 24, 12),
                                      ("driven", {"bs_group_A": "xmin", "bs_motion_A": "velocity:0.1,0"}, 24, 12),
                                      ("on rollers", {"bs_group_A": "xmin", "bs_motion_A": "x=fixed", "bs_lattice_fixed_particles": 5}, 26, 15)):
        for ranks in (1, 3):
            run = checks.run({**square, **held, "bs_output": folder / "m.h5md", "bs_overwrite": True}, ranks=ranks)
            with h5py.File(folder / "m.h5md") as f:
                found = f["modes/motions"][0], len(f["modes/omega_squared"]), run.report["moving_mass"]
            checks.true(f"{name}, {ranks} ranks", found == (motions, motions, mass), str(found))


def check_fluctuation(checks, folder):
    """Modes that are zero or grow have no mean square displacement: a free chain with its zero mode kept, and a pressed one."""
    n = 8
    pairs = np.c_[np.arange(n - 1), np.arange(1, n)]
    free = write_lattice(folder / "free.h5", np.arange(float(n))[:, None], 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0)
    values, shapes = dense(stiffness(np.arange(float(n))[:, None], pairs, 1.0, 1.0), np.ones(n), 1)
    x = np.c_[np.arange(float(n)), np.zeros(n)]
    pressed = write_lattice(folder / "pressed.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.2, fixed=[1] + [0] * (n - 2) + [1])
    along = dense(stiffness(x, pairs, 1.0, 1.2), np.ones(n), 2, np.arange(n) % (n - 1) > 0)
    for solver in ("dense", "direct"):
        got = Modes(checks, free, n, bs_modes_rigid="keep", bs_modes_solver=solver)
        checks.near(f"fluctuation of a free chain, zero mode kept, {solver}", got.fluctuation, (shapes[1:, :, 0] ** 2 / values[1:, None]).sum(0), 1e-9)
        got = Modes(checks, pressed, 2 * (n - 2), bs_modes_solver=solver)
        stable = along[0] > 0
        checks.true(f"{(~stable).sum()} modes of the pressed chain grow, {solver}", got.report["unstable_modes"] == (~stable).sum() > 0)
        checks.near(f"fluctuation of a pressed chain, {solver}", got.fluctuation, ((along[1][stable] ** 2).sum(2) / along[0][stable, None]).sum(0), 1e-9)


def check_floppy(checks, folder):
    """A square net without diagonals: as many zero modes as the rank of its stiffness lacks."""
    x = grid((6, 5))
    pairs = near_pairs(x, 1.1)
    A = stiffness(x, pairs, 1.0, 1.0)
    values = np.linalg.eigvalsh(A)
    zero = int((values < 1e-10).sum())
    lattice = write_lattice(folder / "net.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0)
    for solver in ("dense", "direct"):
        for ranks in (1, 3):
            got = Modes(checks, lattice, 5, ranks=ranks, bs_modes_solver=solver)
            checks.near(f"floppy net, {solver}, {ranks} ranks: the first omega^2 other than 0", got.omega_squared, values[zero:zero + 5], 1e-10)
            checks.true(f"floppy net, {solver}, {ranks} ranks: {zero} zero modes, 3 of them rigid",
                        (got.report["zero_modes"], got.report["rigid_motions"]) == (zero, 3), str(got.report["zero_modes"]))


def check_beam(checks, folder):
    """A thin body, whose lowest modes bend: the search is preconditioned by rigid motions of groups."""
    x = grid((3, 4, 80))
    pairs, held = near_pairs(x, 1.5), x[:, 2] == 0
    lattice = write_lattice(folder / "beam.h5", x, 1.0, fixed=held, pairs=pairs, stiffness=1.0, rest_length=np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1),
                            spring_law="hooke")
    u = x[pairs[:, 1]] - x[pairs[:, 0]]
    u /= np.linalg.norm(u, axis=1)[:, None]
    rows = np.repeat(np.arange(len(pairs)), 6)
    columns = np.concatenate([3 * pairs[:, :1] + np.arange(3), 3 * pairs[:, 1:] + np.arange(3)], axis=1).ravel()
    strain = csc_matrix((np.concatenate([-u, u], axis=1).ravel(), (rows, columns)), shape=(len(pairs), x.size))[:, np.repeat(~held, 3)]
    exact = np.sort(eigsh(csc_matrix(strain.T @ strain), 6, sigma=0, return_eigenvectors=False))
    for ranks in (1, 3):
        got = Modes(checks, lattice, 6, ranks=ranks, bs_modes_solver="iterative")
        checks.near(f"a beam, {ranks} ranks", got.omega_squared / exact, 1.0, 1e-8)
        checks.true(f"a beam, {ranks} ranks: iterations", got.report["iterations"] < 1000, f"{got.report['iterations']}")


def check_pendulum(checks, folder):
    """One particle on a spring to a fixed one: one motion as a rigid body in the plane, two in space."""
    for d in (2, 3):
        x = np.zeros((2, d))
        x[1, 0] = 1
        lattice = write_lattice(folder / "pendulum.h5", x, 2.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=8.0, rest_length=1.0)
        got = Modes(checks, lattice, 1)
        checks.near(f"a particle on a spring, d = {d}", got.omega_squared[0], 4.0, 1e-14)
        checks.true(f"it turns about the fixed one, d = {d}", got.report["rigid_motions"] == d - 1)


def check_buckling(checks, folder):
    """Hencky: omega^2 = lambda (kappa lambda/a^2 - P/a)/m with lambda = 4 sin^2(pi/2n) changes its sign at P = 4 kappa/a sin^2(pi/2n)."""
    n, a, kappa, k, m = 8, 0.5, 3.0, 1e4, 0.7
    curve = 4 * np.sin(np.pi / (2 * n)) ** 2
    critical = kappa * curve / a
    checks.near("the buckling load", critical, 0.913445609864564, 1e-14)
    x = np.c_[a * np.arange(n + 1), np.zeros(n + 1)]
    triples = np.c_[np.arange(n - 1), np.arange(1, n), np.arange(2, n + 1)]
    for factor in (0.0, 0.9, 1 - 1e-6, 1 + 1e-6, 1.5):
        P = factor * critical
        lattice = write_lattice(folder / "hencky.h5", x, m, fixed=[1] + [0] * (n - 1) + [1], pairs=np.c_[np.arange(n), np.arange(1, n + 1)],
                                stiffness=k, rest_length=a + P / k, angles={"triples": triples, "stiffness": kappa, "rest_angle": np.pi})
        for solver in ("dense", "direct"):
            got = Modes(checks, lattice, 2, bs_modes_solver=solver)
            checks.near(f"omega^2 under {factor} P_cr, {solver}", got.omega_squared[0], curve * (kappa * curve / a ** 2 - P / a) / m, 1e-9)
            unstable = factor > 1
            checks.true(f"instability under {factor} P_cr, {solver}: {unstable}",
                        (got.report["unstable_modes"] == 1) == unstable and ("unstable" in got.stderr) == unstable)


def check_equilibrium(checks, folder):
    """A mass hanging on a spring, l = L + m g/k: it swings with omega^2 = g/l and bounces with k/m; at the start it does neither."""
    k, L, m, g = 50.0, 1.0, 2.0, 9.81
    lattice = write_lattice(folder / "hung.h5", [[0.0, 0.0], [0.0, -1.0]], m, fixed=[1, 0], pairs=[[0, 1]], stiffness=k, rest_length=L)
    for ranks in (1, 2):
        got = Modes(checks, lattice, 2, ranks=ranks, bs_gravity=(0.0, -g), bs_modes_about="equilibrium")
        checks.near(f"about the equilibrium, {ranks} ranks", got.omega_squared, [g / (L + m * g / k), k / m], 1e-9)
    written_lattice(checks, folder)
    start = Modes(checks, lattice, 2, bs_gravity=(0.0, -g))
    checks.true("about the start: no equilibrium, one motion without stiffness", "no equilibrium" in start.stdout and start.report["zero_modes"] == 1)


def check_part_of_loads(checks, folder):
    """About an equilibrium by arc length that ends at half the loads: what is driven, and the box, stand there; that of half the motion under full loads."""
    sheet = {"bs_lattice_type": "triangular", "bs_lattice_size": (5, 4), "bs_lattice_perturbation": 0.05, "bs_lattice_stiffness": 100, "bs_lattice_fixed": "ymin",
             "bs_group_top": "ymax"}
    cell = {"bs_lattice_type": "triangular", "bs_lattice_size": (5, 4), "bs_lattice_perturbation": 0.05, "bs_lattice_stiffness": 100, "bs_lattice_periodic": "xy",
            "bs_lattice_fixed_particles": 0}
    half = {"bs_load_control": "arc", "bs_arc_end": 0.5, "bs_load_steps": 8}
    for name, net, moved in (("driven", sheet, lambda rate: {"bs_motion_top": f"x=fixed,y=velocity:{rate!r}"}),
                             ("box", cell, lambda rate: {"bs_box_strain": f"xy=velocity:{rate!r}"})):
        found, file = [], folder / f"half_{name}.h5"
        checks.run({**net, "bs_task": "generate", "bs_output": file})
        for rate, control in ((0.4, half), (0.2, {"bs_load_steps": 4})):
            found.append(Modes(checks, file, 6, **moved(rate), **control, bs_modes_about="equilibrium", snes_rtol=1e-12).omega_squared)
        checks.below(f"half the loads, {name}: omega^2", np.max(np.abs(found[0] / found[1] - 1)), 1e-6)


def written_lattice(checks, folder):
    """The lattice in the file is that of the input, whatever the modes are about."""
    n = 10
    x, pairs = np.c_[np.arange(float(n)), np.zeros(n)], np.c_[np.arange(n - 1), np.arange(1, n)]
    m, k, L = np.arange(1.0, n + 1), np.arange(10.0, n + 9), np.linspace(0.7, 0.9, n - 1)
    lattice = write_lattice(folder / "written.h5", x, m, fixed=[1] + [0] * (n - 2) + [1], pairs=pairs, stiffness=k, rest_length=L, damping=0.5)
    with h5py.File(lattice, "a") as f:
        f["groups/odd"] = np.arange(1, n, 2)
    expected = {"connectivity/bonds": pairs, "connectivity/bonds_stiffness": k, "connectivity/bonds_rest_length": L, "connectivity/bonds_damping": 0.5,
                "particles/trajectory/mass": m, "particles/trajectory/id": np.arange(n), "groups/odd": np.arange(1, n, 2)}
    for about in ("start", "equilibrium"):
        for ranks in (1, 3):
            got = Modes(checks, lattice, 4, ranks=ranks, bs_gravity=(0.0, -9.81), bs_modes_about=about)
            with h5py.File(io.BytesIO(got.bytes), "r") as f:
                for name, value in expected.items():
                    checks.near(f"modes about the {about}, {ranks} ranks: {name}", f[name][...], value, 0)
                frame = f["particles/trajectory/position/value"][0]
            checks.true(f"modes about the {about}, {ranks} ranks: the frame is that state", (frame[4, 1] < -0.1) == (about == "equilibrium"))


def check_masses(checks, folder):
    """Two masses 24 orders of magnitude apart: the product of the two omega^2 is 3 k^2/(m_1 m_2)."""
    for masses in ((1e-12, 1e12), (1e-12, 1e-12), (1e12, 1e12)):
        lattice = write_lattice(folder / "two.h5", np.arange(4.)[:, None], [1.0, *masses, 1.0], fixed=[1, 0, 0, 1],
                                pairs=[[0, 1], [1, 2], [2, 3]], stiffness=1.0, rest_length=1.0)
        half, product = 1 / masses[0] + 1 / masses[1], 3 / (masses[0] * masses[1])
        high = half + np.sqrt(half * half - product)
        for solver in ("dense", "direct"):
            got = Modes(checks, lattice, 2, bs_modes_solver=solver)
            checks.near(f"masses {masses}, {solver}", got.omega_squared / [product / high, high], 1.0, 1e-9)


def check_failures(checks, folder):
    lattice = write_lattice(folder / "cube.h5", grid((6, 6, 6)), 1.0, pairs=near_pairs(grid((6, 6, 6)), 1.5), stiffness=1.0)
    got = Modes(checks, lattice, 10, expect=3, bs_modes_solver="iterative", eps_max_it=3)
    checks.true("unconverged: exit 3, said and reported", "modes converged in 3 iterations" in got.stderr and got.report["outcome"] == "failed")
    damped = write_lattice(folder / "damped.h5", np.arange(3.)[:, None], 1.0, fixed=[1, 0, 1], pairs=[[0, 1], [1, 2]], stiffness=1.0, rest_length=1.0,
                           damping=0.3, velocity=[[0.], [5.], [0.]])
    got = Modes(checks, damped, 1, bs_stokes_drag=0.1)
    checks.true("damping is said to be left out", "damping is left out" in got.stdout)
    checks.near("omega^2 without damping, at rest", got.omega_squared[0], 2.0, 1e-14)
    pulled = Modes(checks, damped, 1, bs_gravity=(1.0,))
    checks.true("a start that is no equilibrium is said to be none", "no equilibrium" in pulled.stdout)


def check_earlier_file(checks, folder):
    """A run that finds no equilibrium takes the place of the run before it, as one of statics does: its last state and no modes."""
    file, held = folder / "run_again.h5md", {"bs_lattice_type": "square", "bs_lattice_size": "5,5", "bs_lattice_fixed": "ymax", "bs_overwrite": True}
    for ranks in (1, 3):
        for more, code, outcome in (({"snes_atol": 1e30}, 3, "failed"), ({"bs_load_steps": 10, "ts_max_steps": 3}, 3, "failed"),
                                    ({"bs_load_control": "arc", "bs_load_steps": 10, "bs_arc_steps": 2}, 3, "failed"), ({"bs_lattice_fixed": "no such group"}, 2, None)):
            checks.run({**held, "bs_output": file, "bs_task": "modes", "bs_modes": 4}, ranks=ranks)
            before = file.read_bytes()
            done = checks.run({**held, "bs_output": file, "bs_task": "modes", "bs_modes_about": "equilibrium", "bs_gravity": (0.0, -5.0), **more}, ranks=ranks, expect=None)
            label = f"modes about an equilibrium that is not found, {', '.join(more)}, {ranks} ranks"
            checks.true(label + f": exit {code}", done.code == code, str(done.code))
            with h5py.File(file, "r") as f:
                left, frames = len(f["modes/omega_squared"]), len(f["particles/trajectory/position/value"])
            if outcome:
                checks.true(label + ": no modes, one frame", (left, frames) == (0, 1), f"{left} modes, {frames} frames")
                checks.true(label + ": the report says so", done.report is not None and (done.report["outcome"], done.report["modes"], done.report["completeness"]) == (outcome, 0, "unknown")
                            and ("converged" in done.report["reason"] or "load factor" in done.report["reason"]))
            else:
                checks.true(label + ": the earlier file is as it was", file.read_bytes() == before)


def main():
    checks = Checks("modes of free vibration")
    with tempfile.TemporaryDirectory() as name:
        for title, check in list(globals().items()):
            if title.startswith("check_") and checks.wants(title):
                with checks.group(title):
                    check(checks, pathlib.Path(name))
    checks.finish(checks.have("E_mechanics"))


if __name__ == "__main__":
    main()
