#!/usr/bin/env python3
"""Stress of single particles and of groups: sums over springs written out here, the stress of the box, LAMMPS' compute stress/atom."""
import shutil
import subprocess

from box import A1, A2, triangular
import h5py
from harness import write_lattice, run_parts
import numpy as np

PLACES = {1: ((0, 0),), 2: ((0, 0), (1, 1), (0, 1)), 3: ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))}


def expected(x, v, mass, pairs, r, k, L, D, relative, flow):
    """(N, q): half of (T/l) r r of every spring to either end, T with its axial damper; - m c c with c = v - flow x. relative: velocities of r."""
    d = x.shape[1]
    l = np.linalg.norm(r, axis=1)
    T = k * (l - L) + D * (relative * r).sum(1) / l
    each = (T / l)[:, None, None] * r[:, :, None] * r[:, None, :]
    total = np.zeros((len(x), d, d))
    for end in (0, 1):
        np.add.at(total, pairs[:, end], 0.5 * each)
    c = v - x @ flow.T
    total -= mass[:, None, None] * c[:, :, None] * c[:, None, :]
    return np.stack([total[:, a, b] for a, b in PLACES[d]], axis=1)


def frames(checks, folder, options):
    run = checks.run({**options, "bs_output": "s.h5md", "bs_overwrite": True, "bs_output_stress": True}, keep=("s.h5md",))
    (folder / "s.h5md").write_bytes(run.files["s.h5md"])
    return h5py.File(folder / "s.h5md")


def periodic(checks, folder):
    """A sheared box in motion, dampers at work, a particle driven."""
    n, rate = 5, 0.3
    rng = np.random.default_rng(2)
    path = triangular(folder / "t.h5", n, velocity=0.3 * rng.standard_normal((n * n, 2)), damping=0.4)
    with h5py.File(path) as f:
        pairs, shift = f["springs/pairs"][...], f["springs/shift"][...]
    edges = np.array([n * A1, n * A2])
    with frames(checks, folder, {"bs_lattice_file": path, "bs_box_rate": f"xy={rate}", "ts_type": "cn", "ts_dt": 0.02, "ts_max_time": 0.2, "bs_output_interval": 0.1,
                                 "bs_group_left": "ids:0-6", "bs_group_rest": "ids:7-24", "bs_stress_groups": "left,rest",
                                 "bs_group_hand": "ids:12", "bs_motion_hand": "velocity:0.4,-0.2"}) as f:
        stress = f["particles/trajectory/stress_volume/value"][...]
        x, v, t = (f[f"particles/trajectory/position/{name}"][...] if name != "velocity" else f["particles/trajectory/velocity/value"][...] for name in ("value", "velocity", "time"))
        box, groups = f["observables/stress/value"][...], [f[f"observables/stress_volume/{name}/value"][...] for name in ("left", "rest")]
        for row in range(len(t)):
            F, G = np.array([[1, rate * t[row]], [0, 1]]), np.array([[0, rate], [0, 0]])
            flow = G @ np.linalg.inv(F)
            r = x[row][pairs[:, 1]] - x[row][pairs[:, 0]] + shift @ (edges @ F.T)
            relative = v[row][pairs[:, 1]] - v[row][pairs[:, 0]] + shift @ (edges @ G.T)
            exact = expected(x[row], v[row], np.ones(n * n), pairs, r, 1.0, 1.0, 0.4, relative, flow)
            checks.near(f"periodic net, frame {row}", stress[row], exact, 1e-13)
            checks.near(f"frame {row}: the sum is that of the box", stress[row].sum(0) / abs(np.linalg.det(edges @ F.T)), box[row], 1e-14)
        checks.near("groups", groups[0], stress[:, :7].sum(1), 1e-13)
        checks.near("all groups", groups[0] + groups[1], stress.sum(1), 1e-13)
        checks.true("unit and frames", f["particles/trajectory/stress_volume/value"].shape == (3, n * n, 3))


def open_lattices(checks, folder):
    """One and three dimensions without a box; fixed particles have no kinetic part; statics."""
    rng = np.random.default_rng(5)
    for d, shape in ((1, (7,)), (3, (3, 3, 3))):
        x = np.stack(np.meshgrid(*[np.arange(s, dtype=float) for s in shape], indexing="ij"), -1).reshape(-1, d) + 0.1 * rng.standard_normal((np.prod(shape), d))
        pairs = np.array([(i, j) for i in range(len(x)) for j in range(i) if np.linalg.norm(x[i] - x[j]) < 1.4])
        fixed = np.arange(len(x)) < 2
        v = rng.standard_normal(x.shape) * ~fixed[:, None]
        mass = rng.uniform(1, 2, len(x))
        path = write_lattice(folder / "o.h5", x, mass, velocity=v, fixed=fixed, pairs=pairs, stiffness=3.0, rest_length=0.9, damping=0.2)
        with frames(checks, folder, {"bs_lattice_file": path, "ts_dt": 0.01, "ts_max_time": 0.01}) as f:
            r, w = x[pairs[:, 1]] - x[pairs[:, 0]], v[pairs[:, 1]] - v[pairs[:, 0]]
            exact = expected(x, v, mass, pairs, r, 3.0, 0.9, 0.2, w, np.zeros((d, d)))
            checks.near(f"{d} dimension(s), open", f["particles/trajectory/stress_volume/value"][0], exact, 1e-13)
        with frames(checks, folder, {"bs_lattice_file": path, "bs_task": "statics"}) as f:
            y = f["particles/trajectory/position/value"][-1]
            exact = expected(y, 0 * y, mass, pairs, y[pairs[:, 1]] - y[pairs[:, 0]], 3.0, 0.9, 0.0, 0 * r, np.zeros((d, d)))
            checks.near(f"{d} dimension(s), in equilibrium", f["particles/trajectory/stress_volume/value"][-1], exact, 1e-12)


def driven(checks, folder):
    """A particle of a group that moves as given has its share, its kinetic part among it, at its own velocity."""
    x = np.array([[0.0, 0.0], [1.1, 0.0], [0.4, 0.9], [1.5, 1.0]])
    pairs = np.array([(0, 1), (0, 2), (1, 2), (1, 3), (2, 3)])
    v = np.array([[0.0, 0.0], [0.3, -0.2], [0.5, 0.1], [-0.4, 0.2]])
    mass = np.array([1.0, 2.0, 1.5, 3.0])
    path = write_lattice(folder / "d.h5", x, mass, velocity=v, fixed=[1, 0, 0, 0], pairs=pairs, stiffness=2.0, rest_length=0.9, damping=0.3)
    with h5py.File(path, "a") as f:
        f["groups/hand"], f["groups/all"] = [1, 3], [0, 1, 2, 3]
    with frames(checks, folder, {"bs_lattice_file": path, "ts_type": "cn", "ts_dt": 0.01, "ts_max_time": 0.1, "bs_output_interval": 0.05, "bs_motion_hand": "x=velocity:0.3,y=velocity:-0.2",
                                 "bs_stress_groups": "hand,all"}) as f:
        y, w = f["particles/trajectory/position/value"][...], f["particles/trajectory/velocity/value"][...]
        for row in range(3):
            checks.near(f"frame {row}: the hand moves", w[row][[1, 3]], [0.3, -0.2], 1e-15)
            exact = expected(y[row], w[row], mass, pairs, y[row][pairs[:, 1]] - y[row][pairs[:, 0]], 2.0, 0.9, 0.3, w[row][pairs[:, 1]] - w[row][pairs[:, 0]], np.zeros((2, 2)))
            checks.near(f"frame {row}: every particle", f["particles/trajectory/stress_volume/value"][row], exact, 1e-13)
            for name, members in (("hand", [1, 3]), ("all", slice(None))):
                checks.near(f"frame {row}: group {name}", f[f"observables/stress_volume/{name}/value"][row], exact[members].sum(0), 1e-13)


def lammps(checks, folder):
    """compute stress/atom of the same net, in motion, in a periodic box."""
    lmp = shutil.which("lmp")
    if not lmp:
        checks.skip("LAMMPS", "no lmp here (apt install lammps)")
        return
    rng = np.random.default_rng(11)
    n, box = 40, np.array([6.0, 5.0, 7.0])
    x, v = rng.uniform(0, 1, (n, 3)) * box, rng.standard_normal((n, 3))
    pairs, shift = [], []
    for i in range(n):
        for j in range(i):
            s = -np.round((x[j] - x[i]) / box).astype(int)
            if np.linalg.norm(x[j] - x[i] + s * box) < 2.0:
                pairs.append((i, j))
                shift.append(s)
    path = write_lattice(folder / "l.h5", x, 1.5, velocity=v, pairs=pairs, stiffness=20.0, rest_length=1.2, box=np.diag(box), shift=shift)
    text = f"net\n\n{n} atoms\n{len(pairs)} bonds\n1 atom types\n1 bond types\n\n" + "".join(f"0 {b} {a}lo {a}hi\n" for a, b in zip("xyz", box))
    text += "\nMasses\n\n1 1.5\n\nBond Coeffs # harmonic\n\n1 10 1.2\n\nAtoms # bond\n\n"
    text += "".join(f"{i + 1} 1 1 {p[0]:.17g} {p[1]:.17g} {p[2]:.17g}\n" for i, p in enumerate(x))
    text += "\nVelocities\n\n" + "".join(f"{i + 1} {p[0]:.17g} {p[1]:.17g} {p[2]:.17g}\n" for i, p in enumerate(v))
    text += "\nBonds\n\n" + "".join(f"{k + 1} 1 {i + 1} {j + 1}\n" for k, (i, j) in enumerate(pairs))
    (folder / "data.net").write_text(text)
    (folder / "in.net").write_text(
        "units lj\natom_style bond\nboundary p p p\nbond_style harmonic\npair_style zero 2.2\nspecial_bonds lj/coul 1 1 1\nread_data data.net\npair_coeff * *\n"
        "compute s all stress/atom NULL ke bond\ndump 1 all custom 1 s.dump id c_s[1] c_s[2] c_s[3] c_s[6] c_s[5] c_s[4]\n"
        "dump_modify 1 sort id format float %.17g\nrun 0\n")
    done = subprocess.run([lmp, "-in", "in.net", "-log", "none"], cwd=folder, capture_output=True, text=True, timeout=120)
    checks.true("LAMMPS runs", done.returncode == 0, done.stdout.strip().splitlines()[-1] if done.returncode else "")
    if done.returncode:
        return
    theirs = np.array([[float(w) for w in line.split()[1:]] for line in (folder / "s.dump").read_text().splitlines()[9:]])
    with frames(checks, folder, {"bs_lattice_file": path, "ts_dt": 0.01, "ts_max_time": 0.01}) as f:
        checks.near("LAMMPS' compute stress/atom", f["particles/trajectory/stress_volume/value"][0], theirs, 1e-11)


if __name__ == "__main__":
    run_parts(__doc__, (periodic, open_lattices, driven, lammps))
