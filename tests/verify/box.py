#!/usr/bin/env python3
"""Periodic boxes: modes against dispersion relations, a chain without ends, stiffness tensors of diluted nets, shifts given and found, strain of
the box, stress and work, ranks, restarts."""
import io
import itertools
import subprocess

import h5py
from harness import write_lattice, run_parts
import numpy as np
from program import environment, words
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.special import jv

A1, A2 = np.array([1.0, 0.0]), np.array([0.5, np.sqrt(0.75)])


def triangular(path, n, bonds=None, move=None, shifts=True, **more):
    """n x n cells of the triangular lattice, k = m = a = 1, in the box of n a1 and n a2; row n i + j is at i a1 + j a2. bonds: (M, 4) ends and
    shifts of those there are. move: (N, 2) boxes by which particles are moved, and their springs with them."""
    x = np.array([i * A1 + j * A2 for i in range(n) for j in range(n)])
    if bonds is None:
        rows = []
        for i, j, (di, dj) in itertools.product(range(n), range(n), ((1, 0), (0, 1), (1, -1))):
            k, l = i + di, j + dj
            rows.append((n * i + j, n * (k % n) + l % n, k // n, l // n))
        bonds = np.array(rows)
    pairs, shift = bonds[:, :2], bonds[:, 2:]
    edges = np.array([n * A1, n * A2])
    if move is not None:
        x = x + move @ edges
        shift = shift + move[pairs[:, 0]] - move[pairs[:, 1]]
    return write_lattice(path, x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0, box=edges, shift=shift if shifts else None, **more)


def dispersion(checks, folder):
    """Every mode of the triangular lattice: eigenvalues of 2 sum of n n^T (1 - cos q.a n) over the three directions n, q = (2 pi/N)(p1, p2)."""
    n = 6
    exact = []
    for p in itertools.product(range(n), range(n)):
        D = np.zeros((2, 2))
        for i, j in ((1, 0), (0, 1), (1, -1)):
            e = i * A1 + j * A2
            D += 2 * np.outer(e, e) * (1 - np.cos(2 * np.pi * (p[0] * i + p[1] * j) / n))
        exact.extend(np.linalg.eigvalsh(D))
    options = {"bs_task": "modes", "bs_lattice_file": triangular(folder / "t.h5", n), "bs_modes": 2 * n * n, "bs_modes_rigid": "keep", "bs_output": "m.h5md"}
    run = checks.run(options, keep=("m.h5md",))
    (folder / "m.h5md").write_bytes(run.files["m.h5md"])
    with h5py.File(folder / "m.h5md") as f:
        checks.near("all modes of the triangular lattice", f["modes/omega_squared"][...], np.sort(exact), 1e-12)
    generated = checks.run({**options, "bs_lattice_file": None, "bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1},
                           keep=("m.h5md",))
    (folder / "g.h5md").write_bytes(generated.files["m.h5md"])
    exact = []
    for p in itertools.product(range(6), range(3)):  # of the rectangular cell of two particles: wave vectors of both its branches
        for q in (0, 1):
            D = np.zeros((2, 2))
            k = np.array([2 * np.pi * p[0] / 6, 2 * np.pi * (p[1] + 3 * q) / (6 * np.sqrt(0.75))])
            for e in (A1, A2, A2 - A1):
                D += 2 * np.outer(e, e) * (1 - np.cos(k @ e))
            exact.extend(np.linalg.eigvalsh(D))
    with h5py.File(folder / "g.h5md") as f:
        checks.near("the same generated, in a rectangular box", f["modes/omega_squared"][...], np.sort(exact), 1e-12)


def endless_chain(checks, folder):
    """One mass displaced by 1: u_n(t) = J_2n(2 omega_0 t)."""
    n, spacing, t = 101, 10.0, 20.0
    x = spacing * np.arange(n)[:, None]
    x[50] += 1
    pairs = np.stack([np.arange(n), (np.arange(n) + 1) % n], 1)
    path = write_lattice(folder / "chain.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=spacing, box=[[n * spacing]], shift=(pairs[:, 1:] == 0).astype(int))
    r = checks.run({"bs_lattice_file": path, "ts_type": "rk", "ts_rk_type": "4", "ts_adapt_type": "none", "ts_dt": 0.01, "ts_max_time": t}, interval=t).trajectory
    u = r.position[-1, :, 0] - spacing * np.arange(n)
    checks.near("endless chain, u_n = J_2n", u, jv(2 * np.abs(np.arange(n) - 50), 2 * t), 1e-8)
    checks.near("u_0 and u_5", u[[50, 55]], [0.0073668906, 0.1193833628], 1e-8)


def moduli(checks, folder):
    def stiffness(**options):
        return np.array(checks.run({"bs_task": "moduli", **options}).report["stiffness"])
    r3 = np.sqrt(3)
    isotropic = [[3 * r3 / 4, r3 / 4, 0], [r3 / 4, 3 * r3 / 4, 0], [0, 0, r3 / 4]]
    C = stiffness(bs_lattice_file=triangular(folder / "t.h5", 5))
    checks.near("triangular lattice: E = 2/sqrt(3), nu = 1/3, shear sqrt(3)/4", C, isotropic, 1e-14)
    K, a = 250.0, 0.5
    c11, c12 = (1 + np.sqrt(2)) * K / a**2, np.sqrt(0.5) * K / a**2
    C = stiffness(bs_lattice_type="cubic", bs_lattice_size="3,4,5", bs_lattice_periodic="xyz", bs_spring_law="strain", bs_lattice_stiffness=K, bs_lattice_spacing=a)
    exact = np.diag([c11 - c12] * 3 + [c12] * 3)
    exact[:3, :3] += c12
    checks.near("cube of 18 neighbours", C / c11, exact / c11, 1e-13)
    k, L, stretch = 3.0, 1.0, 1.1  # one dimension under tension: E'' of springs of length a along x, k a^2/a
    C = stiffness(bs_lattice_type="chain", bs_lattice_size=7, bs_lattice_periodic="x", bs_lattice_stiffness=k, bs_lattice_rest_length_factor=L / stretch)
    checks.near("stretched chain", C, [[k]], 1e-13)
    # two dimensions under tension T: k n n n n + (T/l)(I - n n) n n, by symmetric strains
    C = stiffness(bs_lattice_type="square", bs_lattice_dim=2, bs_lattice_neighbors=4, bs_lattice_size="4,4", bs_lattice_periodic="xy", bs_lattice_stiffness=k,
                  bs_lattice_rest_length_factor=0.9)
    checks.near("square net under tension: k, and T/2 in shear", C, np.diag([k, k, 0.5 * k * 0.1]), 1e-13)
    path = checks.oracles / "E_mechanics"
    if not (path / "diluted_moduli.csv").exists():
        checks.skip("diluted nets", "the reference results are not there")
        return
    for row in np.loadtxt(path / "diluted_moduli.csv", delimiter=",", skiprows=1):
        bonds = np.loadtxt(path / f"diluted_p{row[0]:g}_s{row[1]:.0f}.csv".replace("p1_", "p1.0_"), delimiter=",", skiprows=1, dtype=int)
        exact = np.array([[row[3], row[6], row[7]], [row[6], row[4], row[8]], [row[7], row[8], row[5]]])
        C = stiffness(bs_lattice_file=triangular(folder / "d.h5", 16, bonds))
        checks.near(f"diluted net, p = {row[0]:g}, seed {row[1]:.0f}", C, exact, 1e-12)
    bonds = np.loadtxt(path / "diluted_p0.8_s0.csv", delimiter=",", skiprows=1, dtype=int)
    C = stiffness(bs_lattice_file=triangular(folder / "d.h5", 16, bonds), condensed_pc_type="bicc")
    row = [one for one in np.loadtxt(path / "diluted_moduli.csv", delimiter=",", skiprows=1) if one[0] == 0.8 and one[1] == 0][0]
    checks.near("by conjugate gradients with bicc", [C[0, 0], C[2, 2]], [row[3], row[5]], 1e-9)


def shifts(checks, folder):
    """The same motion whichever image of a particle the file has, and with shifts found by nearest images."""
    rng = np.random.default_rng(4)
    n = 5
    motion = {"bs_lattice_file": triangular(folder / "a.h5", n, velocity=0.2 * rng.standard_normal((n * n, 2))), "ts_type": "cn", "ts_dt": 0.05, "ts_max_time": 2,
              "snes_rtol": 1e-13}
    one = checks.run(motion, interval=0.5).trajectory
    with h5py.File(folder / "a.h5") as f:
        velocity = f["particles/velocity"][...]
    found = checks.run({**motion, "bs_lattice_file": triangular(folder / "b.h5", n, shifts=False, velocity=velocity)}, interval=0.5).trajectory
    checks.true("shifts found by nearest images: the same in every bit", np.array_equal(one.position, found.position))
    move = rng.integers(-3, 4, (n * n, 2))
    moved = checks.run({**motion, "bs_lattice_file": triangular(folder / "c.h5", n, move=move, velocity=velocity)}, interval=0.5).trajectory
    checks.near("particles in other boxes", moved.position - move @ np.array([n * A1, n * A2]), one.position, 1e-11)
    far = triangular(folder / "d.h5", n, move=move, shifts=False, velocity=velocity)
    checks.near("their nearest images found", checks.run({**motion, "bs_lattice_file": far}, interval=0.5).trajectory.position, moved.position, 1e-12)
    # springs longer than half the box, by shifts of their own: those of a lattice twice as large that repeats itself
    twice = triangular(folder / "e.h5", 2, velocity=[[0.1, 0], [0, 0.2], [-0.1, 0.1], [0, 0]])
    small = checks.run({**motion, "bs_lattice_file": twice}, interval=0.5).trajectory
    v = np.array([[0.1, 0], [0, 0.2], [-0.1, 0.1], [0, 0]])
    large = triangular(folder / "f.h5", 4, velocity=[v[2 * (i % 2) + j % 2] for i in range(4) for j in range(4)])
    checks.near("a lattice of 2 x 2 cells moves as 4 x 4 that repeat it", checks.run({**motion, "bs_lattice_file": large}, interval=0.5).trajectory.velocity[:, [0, 1, 4, 5]],
                small.velocity, 1e-11)


def resting(checks, folder):
    """A perfect lattice stays at rest: forces that are rounding errors, of a particle at the origin too, ask for no shorter step."""
    for name, lattice in (("triangular", {"bs_lattice_type": "triangular", "bs_lattice_size": "4,4", "bs_lattice_dim": 2, "bs_lattice_periodic": "xy"}),
                          ("cube", {"bs_lattice_type": "cubic", "bs_lattice_size": "3,4,5", "bs_lattice_periodic": "xyz", "bs_lattice_spacing": 0.1}),
                          ("chain", {"bs_lattice_type": "chain", "bs_lattice_size": 7, "bs_lattice_periodic": "x", "bs_lattice_spacing": 0.3})):
        for storage in ("cholesky", "bicc"):
            r = checks.run({**lattice, "condensed_pc_type": storage, "ts_dt": 0.01, "ts_max_time": 0.1}).report
            checks.true(f"{name} at rest, {storage}", (r["steps"], r["rejected"]) == (10, 0) and r["newton"] <= 20, f"{r['steps']} steps, {r['rejected']} rejected, {r['newton']} corrections")


def strained(checks, folder):
    """Homogeneous motion of a perfect lattice, stress of the strain applied, work that is what the energy gains."""
    path = triangular(folder / "t.h5", 4)
    r3, rate, t = np.sqrt(3), 0.02, 1.5
    for name, text, F in (("shear", f"xy=velocity:{rate}", [[1, rate * t], [0, 1]]), ("uniaxial", f"xx=velocity:{rate}", [[1 + rate * t, 0], [0, 1]]),
                          ("biaxial", f"xx=velocity:{rate},yy=velocity:{rate}", [[1 + rate * t, 0], [0, 1 + rate * t]])):
        F = np.array(F)
        run = checks.run({"bs_lattice_file": path, "bs_box_strain": text, "ts_type": "beuler", "ts_dt": 0.1, "ts_max_time": t, "bs_output": "r.h5md",
                          "bs_output_interval": t}, keep=("r.h5md",))
        (folder / "r.h5md").write_bytes(run.files["r.h5md"])
        with h5py.File(folder / "r.h5md") as f:
            x, edges = f["particles/trajectory/position/value"][...], f["particles/trajectory/box/edges/value"][...]
            checks.near(f"{name}: every particle follows the box", x[-1], x[0] @ F.T, 1e-12)
            if name == "shear" or edges.ndim == 3:
                checks.near(f"{name}: the edges", edges[-1], edges[0] @ F.T, 1e-14)
            bonds = (A1, A2, A2 - A1)  # of one cell of area sqrt(3)/2
            sigma = sum((1 - 1 / np.linalg.norm(F @ b)) * np.outer(F @ b, F @ b) for b in bonds) / (r3 / 2 * np.linalg.det(F))
            checks.near(f"{name}: stress", f["observables/stress/value"][-1], [sigma[0, 0], sigma[1, 1], sigma[0, 1]], 1e-13)
    # a disordered lattice of linear springs (one dimension): the trapezoidal rule books work without error
    chain = {"bs_lattice_type": "chain", "bs_lattice_size": 9, "bs_lattice_periodic": "x", "bs_lattice_spacing": 1, "bs_lattice_perturbation": 0.1, "bs_lattice_stiffness": 7,
             "bs_box_strain": "xx=sinusoid:0.05,0.3", "ts_type": "cn", "ts_dt": 0.02, "ts_max_time": 4, "snes_rtol": 1e-13}
    o = checks.run(chain, interval=0.02).trajectory.observables
    gained = o["total_energy"] - o["total_energy"][0]
    checks.below("work of the box is what the energy gains", np.abs(gained - o["work/box"]).max() / np.abs(gained).max(), 1e-12)
    # statics: the strain grows with the load factor; stress times strain rate is the work's
    r = checks.run({"bs_task": "statics", "bs_lattice_type": "square", "bs_lattice_dim": 2, "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy",
                    "bs_lattice_perturbation": 0.05, "bs_lattice_seed": 3, "bs_box_strain": "xy=velocity:0.08,yy=velocity:0.02", "bs_load_steps": 8}, interval=0).trajectory
    o = r.observables
    gained, done = o["elastic_energy"][1:] - o["elastic_energy"][1], o["work/box"][1:] - o["work/box"][1]  # the first frame is not at rest
    checks.below("statics: work of the box by the trapezoidal rule", np.abs(gained - done).max() / gained[-1], 2e-3)
    half = checks.run({"bs_task": "statics", "bs_lattice_type": "square", "bs_lattice_dim": 2, "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy",
                       "bs_lattice_perturbation": 0.05, "bs_lattice_seed": 3, "bs_box_strain": "xy=velocity:0.08,yy=velocity:0.02", "bs_load_steps": 16},
                      interval=0).trajectory.observables
    error = [abs(np.diff(q["elastic_energy"][[first, -1]]) - np.diff(q["work/box"][[first, -1]]))[0] for first, q in ((1, o), (2, half))]
    checks.true("its error falls with the square of the steps", 3.5 < error[0] / error[1] < 4.5, f"{error[0]:.2g} {error[1]:.2g}")


def begun_strained(checks, folder):
    """A box that is strained at the start, or in full from the first load step on, has carried the lattice along in the first frame: the energy of the affine strain. A
    run that is continued is not strained again."""
    path, cube = triangular(folder / "t.h5", 4), folder / "cube.h5"
    checks.run({"bs_task": "generate", "bs_lattice_type": "cubic", "bs_lattice_size": "3,4,5", "bs_lattice_periodic": "xyz", "bs_lattice_stiffness": 2.5, "bs_output": cube})
    for name, file, F in (("triangular", path, np.array([[1.05, 0.03], [-0.02, 0.96]])), ("cube", cube, np.array([[1.03, 0.02, 0], [0, 0.98, 0.04], [-0.01, 0, 1.02]]))):
        with h5py.File(file) as f:
            x, pairs, shift, k, L = (f[one][...] for one in ("particles/position", "springs/pairs", "springs/shift", "springs/stiffness", "springs/rest_length"))
            edges = f["box/edges"][...]
        ways = x[pairs[:, 1]] - x[pairs[:, 0]] + shift @ (edges if edges.ndim == 2 else np.diag(edges))
        exact = 0.5 * np.sum(k * (np.linalg.norm(ways @ F.T, axis=1) - L)**2)
        G = F - np.eye(len(F))
        now, grows, flows = (",".join(f"{'xyz'[r]}{'xyz'[c]}={form}{G[r, c]!r}" for r, c in np.argwhere(G)) for form in ("expression:", "velocity:", "expression:0.5*t*"))
        for way, options in (("a motion", {"bs_box_strain": now, "ts_dt": 0.01, "ts_max_time": 0.02}),
                             ("a motion from t = 2 s on", {"bs_box_strain": flows, "ts_init_time": 2, "ts_dt": 0.01, "ts_max_time": 2.02}),
                             ("load steps", {"bs_task": "statics", "bs_box_strain": now}),
                             ("load steps at full strain", {"bs_task": "statics", "bs_box_strain": grows, "bs_load_scale": "none"})):
            r = checks.run({"bs_lattice_file": file, **options}, interval=0).trajectory
            checks.near(f"{name}, {way}: energy of the affine strain", r.observables["elastic_energy"][0] / exact, 1, 1e-12)
            checks.near(f"{name}, {way}: places", r.position[0], x @ F.T, 1e-14)
    base = words({"bs_lattice_type": "triangular", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy", "bs_box_strain": "xy=expression:0.1+0.2*t", "bs_lattice_velocity": "0.1,0", "ts_dt": 0.05, "ts_max_time": 0.5, "bs_checkpoint": "c",
                  "bs_output": "r.h5md", "bs_output_interval": 0})
    mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []
    for place, parts in (("straight", (base,)), ("stopped", ((*base, "-ts_max_steps", "4"), ("-bs_restart", "c", "-ts_max_steps", "1000")))):
        (folder / place).mkdir(exist_ok=True)
        for part in parts:
            subprocess.run([*mpi, checks.program, *part], cwd=folder / place, check=True, capture_output=True, env=environment(checks.ranks))
    with h5py.File(folder / "straight" / "r.h5md") as a, h5py.File(folder / "stopped" / "r.h5md") as b:
        name = "particles/trajectory/position/value"
        checks.true("strained at the start and continued, in every bit", a[name].shape == b[name].shape and np.array_equal(a[name][...], b[name][...]))


def held(checks, folder):
    """What is fixed in a box that is sheared stays where it is, at rest; what is free starts with the flow (0.5 y, 0)."""
    r = checks.run({"bs_lattice_type": "square", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.1, "bs_lattice_damping": 0.3,
                    "bs_lattice_fixed_particles": 5, "bs_box_rate": "xy=0.5", "ts_dt": 0.02, "ts_max_time": 0.2}, interval=0).trajectory
    checks.near("a fixed particle in a sheared box stays", r.position[:, 5] - r.position[0, 5], 0, 0)
    checks.near("its velocity", r.velocity[:, 5], 0, 0)
    free = np.arange(len(r.mass)) != 5
    checks.near("free ones start with the flow", r.velocity[0, free], np.stack([0.5 * r.position[0, free, 1], 0 * r.position[0, free, 1]], 1), 1e-15)


def continued(checks, folder):
    """Restart to the bit; a trajectory read back as a lattice goes on in its box; ranks."""
    base = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.05, "bs_lattice_damping": 0.1,
            "bs_box_strain": "xy=velocity:0.05", "ts_dt": 0.05, "ts_max_time": 1, "condensed_pc_type": "bicc"}
    mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []

    def go(place, *more):
        (folder / place).mkdir(exist_ok=True)
        subprocess.run([*mpi, checks.program, *more], cwd=folder / place, check=True, capture_output=True, env=environment(checks.ranks))
    start = words({**base, "bs_checkpoint": "c", "bs_checkpoint_every": 5, "bs_output": "r.h5md", "bs_output_interval": 0.25})
    go("whole", *start)
    go("parts", *start, "-ts_max_steps", "10")
    go("parts", "-bs_restart", "c", "-ts_max_steps", "1000")
    with h5py.File(folder / "whole" / "r.h5md") as a, h5py.File(folder / "parts" / "r.h5md") as b:
        checks.true("continued in every bit", all(np.array_equal(a[path + "/value"][...], b[path + "/value"][...]) for path in (
            "particles/trajectory/position", "particles/trajectory/velocity", "particles/trajectory/box/edges", "observables/stress", "observables/work/box")))
        edges = a["particles/trajectory/box/edges/value"][-1]
    again = checks.run({"bs_lattice_file": str(folder / "whole" / "r.h5md"), "bs_task": "moduli", "bs_output": "m.h5md"}, keep=("m.h5md",))
    (folder / "m.h5md").write_bytes(again.files["m.h5md"])
    with h5py.File(folder / "m.h5md") as f:
        checks.near("a trajectory read back has its last box", f["particles/trajectory/box/edges/value"][-1], edges, 0)
        checks.near("the stiffness in the file is the report's", f["moduli/stiffness"][...], again.report["stiffness"], 0)
    if checks.ranks == 1:
        for ranks in (2, 3):
            other = checks.run({**base, "snes_rtol": 1e-12}, interval=0.25, ranks=ranks).trajectory
            one = checks.run({**base, "snes_rtol": 1e-12}, interval=0.25).trajectory
            checks.near(f"{ranks} ranks", other.position, one.position, 1e-10)
            checks.near(f"stress on {ranks} ranks", other.observables["stress"], one.observables["stress"], 1e-10)


def disordered(path, n, kept, seed):
    """Such a net with masses and rest lengths by chance and a share of its springs; its masses, and the body of each particle."""
    rng = np.random.default_rng(seed)
    triangular(path, n)
    with h5py.File(path, "a") as f:
        pairs, stays = f["springs/pairs"][...], rng.uniform(size=len(f["springs/pairs"])) < kept
        for name in ("pairs", "shift", "stiffness", "rest_length"):
            rows = f["springs/" + name][...][stays]
            del f["springs/" + name]
            f["springs/" + name] = rows * rng.uniform(0.95, 1.05, len(rows)) if name == "rest_length" else rows
        f["particles/mass"][...] = mass = rng.uniform(0.5, 1.5, n * n)
    a, b = pairs[stays].T
    return mass, connected_components(coo_matrix((np.ones(len(a)), (a, b)), shape=(n * n, n * n)), directed=False)[1]


def centres_of_mass(checks, folder):
    """No force says where a body is that nothing holds: every centre of mass X stays, and in a box that is strained follows X = F(s) X_0."""
    for name, n, kept, options, exact in (
            ("at rest", 12, 1, {}, 1e-12), ("strained unevenly", 12, 1, {"bs_box_strain": "xx=sinusoid:0.1,0.3,xy=expression:0.1*t^2"}, 1e-12),
            ("in full from the start", 8, 1, {"bs_box_rate": "xx=0.1", "bs_load_scale": "none"}, 1e-12),
            ("under stress", 12, 1, {"bs_box_stress": "xx=0.1,xy=0.02"}, 1e-12), ("by arc length", 8, 1, {"bs_box_rate": "xx=0.1", "bs_load_control": "arc"}, 1e-12),
            ("many bodies", 12, 0.3, {"bs_box_rate": "xx=0.05"}, None), ("moduli", 12, 1, {"bs_task": "moduli"}, 1e-12)):
        mass, body = disordered(folder / "net.h5", n, kept, 3)
        given = {"bs_task": "statics", "bs_lattice_file": folder / "net.h5", **options, **({"bs_load_steps": 4} if options.get("bs_task") != "moduli" else {})}
        run = checks.run(given, interval=0, keep=("run.h5md",))
        found = run.trajectory
        with h5py.File(io.BytesIO(run.files["run.h5md"])) as f:
            edges = f["particles/trajectory/box/edges/value"][...]
        F = np.linalg.solve(edges[0] if "bs_load_scale" in options else np.array([n * A1, n * A2]), edges[-1]).T
        X = [np.array([mass[body == b] @ x[body == b] / mass[body == b].sum() for b in range(body.max() + 1)]) for x in (found.position[0], found.position[-1])]
        checks.near(f"centres of mass of {body.max() + 1} bodies, {name}", X[1], X[0] @ F.T, 1e-12)
        if checks.ranks == 1 and exact:
            checks.near(f"positions on 3 ranks, {name}", checks.run(given, interval=0, ranks=3).trajectory.position[-1], found.position[-1], exact)


def jacobians(checks, folder):
    """The full Jacobian of lattices whose springs meet their own images, against differences; every storage against it."""
    base = {"bs_lattice_type": "cubic", "bs_lattice_size": "1,2,3", "bs_lattice_periodic": "xyz", "bs_lattice_spacing": 1, "bs_lattice_perturbation": 0.1,
            "bs_lattice_damping": 0.5, "bs_lattice_velocity": "0.1,0,0", "bs_box_strain": "xy=velocity:0.1", "ts_dt": 0.01, "ts_max_time": 0.03, "snes_rtol": 1e-12}
    said = checks.run({**base, "bs_operator": "assembled", "mat_type": "aij", "pc_type": "lu", "ksp_type": "preonly", "snes_test_jacobian": True}).stdout
    ratios = [float(line.split("||J - Jfd||_F/||J||_F =")[1].split(",")[0]) for line in said.splitlines() if "||J - Jfd||_F/||J||_F =" in line]
    checks.true("Jacobian", bool(ratios) and max(ratios) < 1e-6, f"against differences {max(ratios, default=np.nan):.2g}")
    expected = checks.run({**base, "pc_type": "lu", "ksp_type": "preonly", "bs_operator": "assembled", **({"pc_factor_mat_solver_type": "mumps"} if checks.ranks > 1 else {})},
                          interval=0.03).trajectory.position[-1]
    for name, options in (("springs, bicc", {"condensed_pc_type": "bicc"}), ("sbaij", {"condensed_mat_type": "sbaij", "condensed_pc_type": "jacobi"}),
                          ("aij, gamg", {"condensed_mat_type": "aij", "condensed_pc_type": "gamg"}), ("cholesky", {"condensed_pc_type": "cholesky"}),
                          ("matrix-free", {"snes_mf": True, "snes_rtol": 1e-8})):
        found = checks.run({**base, **options}, interval=0.03).trajectory.position[-1]
        checks.near(name, found, expected, 1e-6 if "snes_mf" in options else 1e-9)


if __name__ == "__main__":
    run_parts(__doc__, (dispersion, endless_chain, moduli, shifts, resting, strained, begun_strained, held, continued, jacobians, centres_of_mass))
