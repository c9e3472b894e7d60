#!/usr/bin/env python3
"""Angle springs and hinges in periodic boxes: the chain's dispersion relation, stress, moduli and motions from an energy written here, LAMMPS."""
import itertools
import shutil
import subprocess
import sys

import h5py
import numpy as np
from harness import REPO, run_parts, write_lattice
from hinges import angle as fold

PLACES = {2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}


def bend(x):
    """theta (B) of the places (B, 3, d); holds for complex ones. In the plane counted from the first arm to the last."""
    a, b = x[:, 0] - x[:, 1], x[:, 2] - x[:, 1]
    cosine = (a * b).sum(1)
    sine = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] if x.shape[2] == 2 else np.sqrt((np.cross(a, b) ** 2).sum(1))
    return np.pi - 2 * np.arctan(sine / (np.sqrt(cosine ** 2 + sine ** 2) - cosine))


class Net:
    """What a trajectory says of a periodic net: its energy at any places and edges."""

    def __init__(self, path, frame=0):
        with h5py.File(path) as f:
            p, c = f["particles/trajectory"], f["connectivity"]
            self.x, self.mass = p["position/value"][frame], p["mass"][...]
            edges = p["box/edges/value"][frame]
            self.edges = np.diag(edges) if edges.ndim == 1 else edges
            self.d = self.x.shape[1]
            self.pairs, self.k, self.L = c["bonds"][...], c["bonds_stiffness"][...], c["bonds_rest_length"][...]
            self.shift = c["bonds_shift"][...]
            self.more = [(name, c[name][...], c[name + "_shift"][...].reshape(len(c[name]), -1, self.d), c[name + "_stiffness"][...], c[name + "_rest_angle"][...])
                         for name in ("angles", "hinges") if name in c]

    def energy(self, x, G=None):
        """With all places and images strained by G."""
        F = np.eye(self.d) + (0 if G is None else G)
        r = (x[self.pairs[:, 1]] - x[self.pairs[:, 0]] + self.shift @ self.edges) @ F.T
        total = 0.5 * (self.k * (np.sqrt((r * r).sum(1)) - self.L) ** 2).sum()
        for name, ends, shift, stiffness, rest in self.more:
            at = (x[ends] + shift @ self.edges) @ F.T
            theta = bend(at) if name == "angles" else fold(at.reshape(-1, self.d), np.arange(4 * len(ends)).reshape(-1, 4))
            total = total + 0.5 * (stiffness * (theta - rest) ** 2).sum()
        return total

    def at(self, q):
        """Energy by one vector: places, then strains (engineering shears)."""
        G = np.zeros((self.d, self.d), dtype=q.dtype)
        for value, (r, c) in zip(q[self.x.size:], PLACES[self.d]):
            G[r, c] += value if r == c else 0.5 * value
            G[c, r] += 0 if r == c else 0.5 * value
        return self.energy(q[:self.x.size].reshape(self.x.shape), G)

    def slope(self, q):
        step = 1e-30j * np.eye(len(q))
        return np.array([self.at(q + s).imag for s in step]) / 1e-30

    def start(self):
        return np.concatenate([self.x.ravel(), np.zeros(len(PLACES[self.d]))])

    def stress(self):
        return self.slope(self.start())[self.x.size:] / abs(np.linalg.det(self.edges))

    def hessian(self):
        q, h = self.start(), 1e-3
        rows = []
        for k in range(len(q)):
            e = h * np.eye(len(q))[k]
            rows.append((8 * (self.slope(q + e) - self.slope(q - e)) - (self.slope(q + 2 * e) - self.slope(q - 2 * e))) / (12 * h))
        return 0.5 * (np.array(rows) + np.array(rows).T)

    def moduli(self):
        H, n = self.hessian(), self.x.size
        values, vectors = np.linalg.eigh(H[:n, :n])
        inverse = vectors[:, self.d:] / values[self.d:] @ vectors[:, self.d:].T
        return (H[n:, n:] - H[n:, :n] @ inverse @ H[:n, n:]) / abs(np.linalg.det(self.edges))


def sheet(folder):
    """Equilateral triangles that repeat in the plane x, y of a box in space, with hinges across all edges, buckled and shaken; by nearest images."""
    n, rows, a = 4, 4, 1.0
    rng = np.random.default_rng(4)
    edges = np.diag([n * a, rows * np.sqrt(0.75) * a, 5.0])
    x = np.array([(a * (i + 0.5 * (j % 2)), a * np.sqrt(0.75) * j, 0.0) for j in range(rows) for i in range(n)]) + 0.08 * rng.standard_normal((n * rows, 3))
    index = lambda i, j: (j % rows) * n + i % n  # noqa: E731
    quads, pairs = [], []
    for j, i in itertools.product(range(rows), range(n)):
        s = j % 2  # the row above is half a spacing to the right of odd rows' places
        p, right, up, over = index(i, j), index(i + 1, j), index(i + s, j + 1), index(i + s - 1, j + 1)
        pairs += [(p, right), (p, up), (p, over)]
        quads += [(p, up, over, right), (p, over, index(i - 1, j), up), (p, right, up, index(i + s, j - 1))]
    path = write_lattice(folder / "sheet.h5", x, rng.uniform(0.5, 2, len(x)), velocity=0.2 * rng.standard_normal(x.shape), pairs=pairs, stiffness=30.0, rest_length=0.98, box=edges)
    with h5py.File(path, "a") as f:
        f["hinges/quads"], f["hinges/stiffness"], f["hinges/rest_angle"] = quads, rng.uniform(0.5, 1.5, len(quads)), rng.uniform(-0.2, 0.2, len(quads))
    return {"bs_lattice_file": path}


def lattices(folder):
    plain = {"bs_lattice_perturbation": 0.1, "bs_lattice_seed": 3, "bs_lattice_spacing": 1.0, "bs_lattice_stiffness": 20, "bs_lattice_rest_length_factor": 0.97, "bs_angle_stiffness": 1.5}
    return {"square": {**plain, "bs_lattice_type": "square", "bs_lattice_size": "4,5", "bs_lattice_periodic": "xy", "bs_rest_angle": 3.0, "bs_lattice_neighbors": 8},
            "strip": {**plain, "bs_lattice_type": "square", "bs_lattice_size": "2,4", "bs_lattice_periodic": "xy", "bs_lattice_neighbors": 8},
            "cubic": {**plain, "bs_lattice_type": "cubic", "bs_lattice_size": "3,3,3", "bs_lattice_periodic": "xyz", "bs_lattice_neighbors": 18}, "sheet": sheet(folder)}


def frame(checks, folder, options, ranks=1, **more):
    done = checks.run({**options, "bs_output": "f.h5md", **more}, ranks=ranks, keep=("f.h5md",))
    (folder / "f.h5md").write_bytes(done.files["f.h5md"])
    return folder / "f.h5md", done


def dispersion(checks, folder):
    """n unit masses: omega^2 = 4 k sin^2(q/2) along the chain, 16 kappa sin^4(q/2) across it, q = 2 pi j/n."""
    k, kappa = 3.0, 0.7
    for n, d, ranks in ((1, 2, 1), (2, 2, 1), (2, 3, 2), (3, 2, 3), (4, 3, 1), (5, 2, 2), (8, 2, 1), (8, 3, 3), (24, 2, 3)):
        s2 = np.sin(np.pi * np.arange(n) / n) ** 2
        exact = np.sort(np.concatenate([4 * k * s2, *[16 * kappa * s2 ** 2] * (d - 1)]))
        for solver in ("dense", "direct"):
            options = {"bs_lattice_type": "chain", "bs_lattice_size": n, "bs_lattice_dim": d, "bs_lattice_spacing": 1, "bs_lattice_stiffness": k, "bs_angle_stiffness": kappa,
                       "bs_lattice_particle_mass": 1, "bs_lattice_periodic": "x", "bs_task": "modes", "bs_modes": n * d, "bs_modes_rigid": "keep", "bs_modes_solver": solver}
            path, _ = frame(checks, folder, options, ranks)
            with h5py.File(path) as f:
                found = np.sort(f["modes/omega_squared"][...])
            checks.near(f"chain of {n}, d = {d}, {solver}, {ranks} rank(s): all modes", found, exact[:len(found)], 1e-10)


def stresses(checks, folder):
    for name, options in lattices(folder).items():
        for ranks in (1, 2, 3):
            still = {"ts_type": "euler", "ts_dt": 1e-12, "ts_max_steps": 1}
            path, _ = frame(checks, folder, options, ranks, **still, bs_output_stress=True)
            net = Net(path)
            with h5py.File(path) as f:
                v, box, each = f["particles/trajectory/velocity/value"][0], f["observables/stress/value"][0], f["particles/trajectory/stress_volume/value"][0]
                elastic = float(f["observables/elastic_energy/value"][0])
            volume = abs(np.linalg.det(net.edges))
            kinetic = np.array([(net.mass * v[:, r] * v[:, c]).sum() for r, c in PLACES[net.d]]) / volume
            checks.near(f"{name}, {ranks} rank(s): energy", elastic, net.energy(net.x), 1e-13 * elastic)
            checks.near(f"{name}, {ranks} rank(s): stress", box, net.stress() - kinetic, 1e-12 * np.abs(net.k).max())
            checks.near(f"{name}, {ranks} rank(s): the sum of the particles' stress", each.sum(0) / volume, box, 1e-13 * np.abs(net.k).max())


def moduli(checks, folder):
    """At rest, of nets that are disordered and prestressed."""
    for name, options in lattices(folder).items():
        for ranks in (1, 3):
            path, done = frame(checks, folder, options, ranks, bs_task="moduli")
            net = Net(path, -1)
            force = net.slope(net.start())[:net.x.size]
            checks.below(f"{name}, {ranks} rank(s): forces at rest", np.abs(force).max(), 1e-8 * net.k.max())
            checks.near(f"{name}, {ranks} rank(s): stiffness", done.report["stiffness"], net.moduli(), 1e-7 * net.k.max())


def motions(checks, folder):
    """Strained boxes: the work of the box and the energy balance; ranks agree; a run goes on in the same bits and from its own trajectory."""
    for name, options in lattices(folder).items():
        moving = {**options, "bs_box_rate": "xy=0.2,xx=-0.05", "ts_type": "rk", "ts_rk_type": "4", "ts_adapt_type": "none", "ts_dt": 1e-3, "ts_max_time": 0.4, "bs_output_interval": 0.4}
        one = None
        for ranks in (1, 2, 3):
            path, _ = frame(checks, folder, moving, ranks)
            with h5py.File(path) as f:
                x, total, work = f["particles/trajectory/position/value"][-1], f["observables/total_energy/value"][...], f["observables/work/box/value"][...]
            if ranks == 1:
                one = x
                checks.below(f"{name}: total energy less the work of the box", abs(total[-1] - total[0] - work[-1]) / np.abs(total).max(), 2e-6)
            checks.below(f"{name}: {ranks} rank(s) agree", np.abs(x - one).max(), 1e-12)
        implicit = {**moving, "ts_type": "cn", "ts_rk_type": None, "ts_dt": 2e-2, "snes_rtol": 1e-12}
        first, _ = frame(checks, folder, implicit)
        with h5py.File(first) as f:
            x = f["particles/trajectory/position/value"][-1]
        for label, more, ranks in (("3 ranks", {}, 3), ("assembled", {"bs_operator": "assembled", "pc_type": "lu", "ksp_type": "preonly"}, 1),
                                   ("bicc", {"condensed_ksp_type": "cg", "condensed_pc_type": "bicc", "condensed_mat_type": "springs"}, 2)):
            path, _ = frame(checks, folder, {**implicit, **more}, ranks)
            with h5py.File(path) as f:
                checks.below(f"{name}: cn, {label}", np.abs(f["particles/trajectory/position/value"][-1] - x).max(), 1e-9)
        net = Net(path, -1)
        again = checks.run({"bs_lattice_file": path, "ts_type": "euler", "ts_dt": 1e-12, "ts_max_steps": 1, "bs_output": "again.h5md"}, ranks=2, keep=("again.h5md",))
        (folder / "again.h5md").write_bytes(again.files["again.h5md"])
        back = Net(folder / "again.h5md")
        checks.near(f"{name}: a trajectory read as a lattice has the same energy", back.energy(back.x), net.energy(net.x), 1e-12 * net.energy(net.x))
        checks.near(f"{name}: and the program says so", float(again.report["first_elastic_energy"][0]) if "first_elastic_energy" in again.report else net.energy(net.x), net.energy(net.x), 1e-12)


def statics(checks, folder):
    """Load steps of shear: at rest at every frame, and the work of the box is what the energy grew by."""
    for name, options in lattices(folder).items():
        path, _ = frame(checks, folder, options, 2, bs_task="statics", bs_box_strain="xy=velocity:0.05", bs_load_steps=4)
        with h5py.File(path) as f:
            frames = len(f["particles/trajectory/position/value"])
        for row in range(1, frames):
            net = Net(path, row)
            checks.below(f"{name}, load step {row}: forces at rest", np.abs(net.slope(net.start())[:net.x.size]).max(), 1e-8 * net.k.max())


def padded(checks, folder):
    """A trajectory of the plane that is written in three columns, for viewers, is a lattice of the plane: its angles may be beyond pi, and it goes on as the one of two columns does."""
    turn = np.cumsum(0.8 + 0.1 * np.sin(np.arange(6)))  # all to the left: angles of 2.3 or 4, as the rows of a triple are named
    x = np.cumsum(np.column_stack([np.cos(turn), np.sin(turn)]), axis=0)
    row = np.arange(4)
    triples = {"triples": np.column_stack([row + 2, row + 1, row]), "stiffness": 2.0, "rest_angle": 4.2}
    other = dict(triples, triples=triples["triples"][:, ::-1], rest_angle=2 * np.pi - 4.2)
    chain = dict(mass=1.0, velocity=0.1 * x[::-1], pairs=np.column_stack([np.arange(5), np.arange(1, 6)]), stiffness=20.0, rest_length=1.0)
    nets = {name: {"bs_lattice_file": write_lattice(folder / f"{name}.h5", x, angles=angles, **chain)} for name, angles in (("one way", triples), ("other way", other))}
    nets.update(square=lattices(folder)["square"], row={"bs_lattice_type": "chain", "bs_lattice_size": 5, "bs_lattice_dim": 2, "bs_lattice_periodic": "x", "bs_lattice_perturbation": 0.1, "bs_angle_stiffness": 1})
    start = {}
    for name, net in nets.items():
        for task in ("dynamics", "statics", "modes"):
            found = {}
            for pad in (None, 3):
                first = checks.run({**net, "bs_task": task, **({"ts_dt": 0.02, "ts_max_time": 0.1} if task == "dynamics" else {}), "bs_output": "f.h5md", "bs_output_pad": pad}, keep=("f.h5md",))
                file = folder / f"{name}_{task}_{pad}.h5md"
                file.write_bytes(first.files["f.h5md"])
                with h5py.File(file) as f:
                    width = f["particles/trajectory/position/value"].shape[2]
                then = checks.run({"bs_lattice_file": file, "ts_dt": 0.02, "ts_max_time": 0.1}, interval=0.02).trajectory
                found[width] = [then.position, then.velocity, then.observables["elastic_energy"]]
            same = sorted(found) == [2, 3] and all(a.shape == b.shape and np.array_equal(a, b) for a, b in zip(found[2], found[3]))
            checks.true(f"{name}, {task}: the same from a padded trajectory", same, str({width: one[0].shape for width, one in found.items()}))
            start[name] = float(found[2][2][0]) if task == "dynamics" else start[name]
    checks.near("an angle beyond pi, and what it leaves of a turn, named the other way", start["one way"], start["other way"], 1e-12 * start["one way"])


def lammps(checks, folder):
    """compute stress/atom shares the virial of an angle among its three particles, as here."""
    lmp = shutil.which("lmp")
    if not lmp:
        return checks.skip("LAMMPS", "no lmp here (apt install lammps)")
    options = {**lattices(folder)["cubic"], "bs_lattice_size": "5,5,5"}
    path, _ = frame(checks, folder, options, 2, ts_type="euler", ts_dt=1e-12, ts_max_steps=1, bs_output_stress=True)
    subprocess.run([sys.executable, REPO / "postprocess/convert.py", path, "-o", folder / "net.data", "--frame", "0", "--units", "lj"], check=True, capture_output=True, timeout=100)
    (folder / "net.in").write_text("""units lj
atom_style angle
boundary p p p
pair_style zero 1.2
bond_style harmonic
angle_style harmonic
read_data net.data
pair_coeff * *
compute s all stress/atom NULL virial
dump 1 all custom 1 stress.txt id c_s[1] c_s[2] c_s[3] c_s[6] c_s[5] c_s[4]
dump_modify 1 sort id format float %.17g
run 0
""")
    subprocess.run([lmp, "-in", "net.in", "-log", "none"], cwd=folder, check=True, capture_output=True, timeout=300)
    theirs = np.loadtxt((folder / "stress.txt").read_text().splitlines()[-125:])[:, 1:]
    with h5py.File(path) as f:
        ours = f["particles/trajectory/stress_volume/value"][0]
    checks.near("stress of every particle, LAMMPS", ours, theirs, 1e-12 * np.abs(theirs).max())


if __name__ == "__main__":
    run_parts(__doc__, (dispersion, stresses, moduli, motions, statics, padded, lammps))
