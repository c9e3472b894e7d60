#!/usr/bin/env python3
"""Hinges between triangles: closed forms, a rolled sheet's bending stiffness, motions and equilibria by SciPy, LAMMPS; ranks, storages, restarts."""
import pathlib
import re
import shutil
import subprocess
import tempfile

import h5py
import numpy as np
from harness import Checks, write_lattice
from program import direct, run
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

TIGHT_RK = {"ts_type": "rk", "ts_rk_type": "5dp", "ts_rtol": 1e-12, "ts_atol": 1e-13, "ts_dt": 1e-3, "ts_adapt_type": "basic"}


def angle(x, quads):
    """theta (H) from the wings' heights over the edge, by 2 atan(s/(1 + c)), which holds for complex places too."""
    p0, p1, p2, p3 = (x[quads[:, k]] for k in range(4))
    dot = lambda a, b: (a * b).sum(1)[:, None]
    e = (p1 - p0) / np.sqrt(dot(p1 - p0, p1 - p0))
    h1, h2 = ((p - p0) - dot(p - p0, e) * e for p in (p2, p3))
    h1, h2 = h1 / np.sqrt(dot(h1, h1)), h2 / np.sqrt(dot(h2, h2))
    cosine, sine = -dot(h1, h2)[:, 0], dot(np.cross(e, h1), h2)[:, 0]
    return 2 * np.arctan(sine / (1 + cosine))


def hinges_of(triangles):
    """(H, 4): the common edge of two triangles, then the corner of each that is not on it; the first triangle sees the edge in its own order."""
    at = {}
    for a, b, c in triangles:
        for i, j, k in ((a, b, c), (b, c, a), (c, a, b)):
            at[i, j] = k
    return np.array([(i, j, at[i, j], at[j, i]) for i, j in at if i < j and (j, i) in at])


class Sheet:
    """Hooke springs along the edges of triangles, hinges across them."""

    def __init__(self, x, triangles, k, stiffness, rest=0.0, m=1.0, rest_length=None, fixed=()):
        self.x, self.v, self.m = np.asarray(x, float), np.zeros_like(x, dtype=float), np.broadcast_to(m, len(x)).astype(float)
        self.pairs = np.array(sorted({tuple(sorted(e)) for a, b, c in triangles for e in ((a, b), (b, c), (c, a))}))
        self.quads = hinges_of(triangles)
        self.k, self.stiffness = k, np.broadcast_to(stiffness, len(self.quads)).astype(float)
        self.rest = np.broadcast_to(rest, len(self.quads)).astype(float)
        l = np.linalg.norm(self.x[self.pairs[:, 1]] - self.x[self.pairs[:, 0]], axis=1)
        self.L = l if rest_length is None else np.broadcast_to(rest_length, len(self.pairs)).astype(float)
        self.free = np.ones(len(x), bool)
        self.free[list(fixed)] = False

    def write(self, path):
        write_lattice(path, self.x, self.m, velocity=self.v, fixed=~self.free, pairs=self.pairs, stiffness=self.k, rest_length=self.L, spring_law="hooke")
        with h5py.File(path, "a") as f:
            f["hinges/quads"], f["hinges/stiffness"], f["hinges/rest_angle"] = self.quads, self.stiffness, self.rest
        return path

    def energy(self, x):
        step = x[self.pairs[:, 1]] - x[self.pairs[:, 0]]
        l = np.sqrt((step * step).sum(1))
        return 0.5 * (self.k * (l - self.L) ** 2).sum() + 0.5 * (self.stiffness * (angle(x, self.quads) - self.rest) ** 2).sum()

    def force(self, x):
        """By complex steps through the energy."""
        f = np.zeros_like(x)
        for i in np.flatnonzero(self.free):
            for c in range(3):
                z = x.astype(complex)
                z[i, c] += 1e-30j
                f[i, c] = -self.energy(z).imag / 1e-30
        return f

    def at(self, T):
        def rate(_, y):
            x, v = y.reshape(2, *self.x.shape)
            return np.concatenate([np.where(self.free[:, None], v, 0).ravel(), (self.force(x) / self.m[:, None]).ravel()])
        return solve_ivp(rate, (0, T), np.concatenate([self.x.ravel(), self.v.ravel()]), "DOP853", rtol=1e-12, atol=1e-12).y[:, -1].reshape(2, *self.x.shape)


def triangular(columns, rows, a=1.0):
    """Places (N, 2) and triangles of a patch of the triangular net."""
    x = np.array([(a * (i + 0.5 * (j % 2)), a * np.sqrt(0.75) * j) for j in range(rows) for i in range(columns)])
    triangles = []
    for j in range(rows - 1):
        for i in range(columns - 1):
            p, up = j * columns + i, (j + 1) * columns + i
            triangles += [(p, p + 1, up), (p + 1, up + 1, up)] if j % 2 == 0 else [(p, p + 1, up + 1), (p, up + 1, up)]
    return x, triangles


def crumpled(rest=0.0, stiffness=0.5, fixed=(0, 1), seed=5):
    """A small sheet, bent and shaken, no edge straight."""
    rng = np.random.default_rng(seed)
    flat, triangles = triangular(4, 3)
    x = np.c_[flat, 0.4 * np.sin(1.3 * flat[:, 0]) + 0.2 * flat[:, 1] ** 2] + 0.08 * rng.standard_normal((len(flat), 3))
    sheet = Sheet(x, triangles, 40.0, stiffness, rest, rng.uniform(0.5, 2, len(x)), fixed=fixed)
    sheet.v[sheet.free] = 0.4 * rng.standard_normal((sheet.free.sum(), 3))
    return sheet


def closed_forms(checks, folder):
    """Two equilateral triangles of side a, flat: omega^2 = 16 k/(3 m a^2) of the only motion that bends them."""
    for a, k, m in ((1.0, 3.0, 0.5), (1e-3, 2e-6, 1e-4), (2.5, 1e4, 10.0)):
        x = np.array([[0, 0, 0], [a, 0, 0], [a / 2, np.sqrt(0.75) * a, 0], [a / 2, -np.sqrt(0.75) * a, 0]])
        turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
        sheet = Sheet(x @ turn, [(0, 1, 2), (1, 0, 3)], 1e3 * k / a ** 2, k, m=m)
        for ranks in (1, 3):
            options = dict(bs_lattice_file=sheet.write(folder / "two.h5"), bs_task="modes", bs_modes=6)
            done = run(checks.program, options, ranks=ranks, interval=0.0, keep=("run.h5md",))
            (folder / "two.h5md").write_bytes(done.files["run.h5md"])
            with h5py.File(folder / "two.h5md") as f:
                found = np.sort(f["modes/omega_squared"][...])
            checks.near(f"omega^2 of two triangles, a = {a}, {ranks} rank(s)", found[0] * 3 * m * a ** 2 / (16 * k), 1, 1e-9)


def rolled(checks, folder):
    """A net of triangles rolled to a cylinder has the bending stiffness sqrt(3)/2 k (H. S. Seung, D. R. Nelson, Phys. Rev. A 38, 1005, 1988):
    sqrt(3)/4 k A/R^2 of energy, up to parts of (a/R)^2."""
    errors = []
    for around in (40, 80):
        rows, radius = 8, around / (2 * np.pi)
        flat, _ = triangular(around, rows)
        index = lambda i, j: j * around + i % around
        triangles = [t for j in range(rows - 1) for i in range(around) for t in
                     (((index(i, j), index(i + 1, j), index(i, j + 1)), (index(i + 1, j), index(i + 1, j + 1), index(i, j + 1))) if j % 2 == 0 else
                      ((index(i, j), index(i + 1, j), index(i + 1, j + 1)), (index(i, j), index(i + 1, j + 1), index(i, j + 1))))]
        phi = flat[:, 0] / radius
        x = np.c_[radius * np.cos(phi), radius * np.sin(phi), flat[:, 1]]
        sheet = Sheet(x, triangles, 1.0, 2.0)
        result = run(checks.program, dict(bs_lattice_file=sheet.write(folder / "rolled.h5"), ts_dt=1e-9, ts_max_steps=1), ranks=2, interval=1e-9)
        energy = float(result.trajectory.observables["elastic_energy"][0])
        checks.near(f"energy of {len(sheet.quads)} hinges against NumPy", energy, sheet.energy(x), 1e-12)
        theta, level = angle(x, sheet.quads), sheet.quads[:, 0] // around == sheet.quads[:, 1] // around
        found = ((theta[level] ** 2).mean() + 2 * (theta[~level] ** 2).mean()) / np.sqrt(3)  # a particle has an edge along its row, two across
        errors.append(abs(found * radius ** 2 / (np.sqrt(3) / 4) - 1))
    checks.below("bending stiffness of a rolled net, sqrt(3)/2 k", errors[-1], 5e-3)
    checks.near("it converges with the square of a/R", np.log2(errors[0] / errors[1]), 2, 0.1)


def motions(checks, folder):
    T = 1.0
    for name, sheet in (("flat at rest", crumpled()), ("bent at rest", crumpled(0.9)), ("free", crumpled(-0.6, fixed=(), seed=8)), ("stiff hinges", crumpled(0.2, 8.0))):
        lattice, (x, v) = sheet.write(folder / "motion.h5"), sheet.at(T)
        for ranks in (1, 2, 3):
            got = run(checks.program, dict(TIGHT_RK, bs_lattice_file=lattice, ts_max_time=T), ranks=ranks, interval=T).trajectory
            checks.below(f"{name}: SciPy's motion, {ranks} rank(s)", np.abs(got.position[-1] - x).max() / np.abs(x).max(), 1e-9)
            checks.below(f"{name}: its velocities", np.abs(got.velocity[-1] - v).max() / np.abs(v).max(), 1e-8)
            energy = got.observables["total_energy"].ravel()
            checks.below(f"{name}: energy stays", abs(energy[-1] - energy[0]) / energy[0], 1e-9)


def solvers(checks, folder):
    base = dict(bs_lattice_file=crumpled(0.4, 2.0).write(folder / "solvers.h5"), ts_type="beuler", ts_dt=0.05, ts_max_time=0.5, snes_rtol=1e-11)
    expected = run(checks.program, dict(base, **direct()), interval=0.5).trajectory.position[-1]
    cg = {"condensed_ksp_type": "cg"}
    for name, options, ranks in (("condensed, direct", {}, (1, 3)), ("springs + bicc", dict(cg, condensed_pc_type="bicc", condensed_mat_type="springs"), (1, 3)),
                                 ("springs + jacobi", dict(cg, condensed_pc_type="jacobi"), (2,)), ("aij + gamg", dict(cg, condensed_pc_type="gamg"), (2,)),
                                 ("-bs_tangent definite", {"bs_tangent": "definite", "snes_max_it": 400}, (2,)), ("-snes_fd_color", {"snes_fd_color": True}, (2,)),
                                 ("full AIJ, GMRES", {"pc_type": "bjacobi", "ksp_type": "gmres", "ksp_rtol": 1e-10}, (2,))):
        for count in ranks:
            found = run(checks.program, dict(base, **options), ranks=count, interval=0.5).trajectory.position[-1]
            checks.below(f"{name}, {count} rank(s)", np.abs(found - expected).max(), 1e-9)
    for ranks in (1, 3):
        said = run(checks.program, dict(base, ts_max_time=0.15, snes_test_jacobian=True), ranks=ranks).stdout
        found = [float(w) for w in re.findall(r"\|\|J - Jfd\|\|_F/\|\|J\|\|_F = (\S+),", said)]
        checks.true(f"J against differences, {ranks} rank(s)", len(found) >= 3 and max(found) < 1e-6, f"{max(found, default=9):.1e}")


def equilibria(checks, folder):
    """A strip that is held at one end and rests bent, and one under weight: energies and places of SciPy's minimum."""
    flat, triangles = triangular(7, 3)
    held = np.flatnonzero(flat[:, 0] < 0.8)
    for name, rest, weight in (("rests bent", 0.3, 0.0), ("carries weight", 0.0, 0.02)):
        sheet = Sheet(np.c_[flat, np.zeros(len(flat))], triangles, 30.0, 0.5, rest, fixed=held)
        z = np.where(sheet.free[:, None], [0, 0, -weight], 0)

        def total(y):
            x = sheet.x.copy()
            x[sheet.free] = y.reshape(-1, 3)
            return sheet.energy(x) - (z * x).sum(), -(sheet.force(x) + z)[sheet.free].ravel()
        best = minimize(total, sheet.x[sheet.free].ravel(), jac=True, method="BFGS", options={"gtol": 1e-9, "maxiter": 4000})
        options = dict(bs_lattice_file=sheet.write(folder / "strip.h5"), bs_task="statics", bs_gravity=(0, 0, -weight))
        for ranks in (1, 3):
            got = run(checks.program, options, ranks=ranks, interval=0.0).trajectory
            checks.below(f"a strip that {name}, {ranks} rank(s): SciPy's minimum", np.abs(got.position[-1][sheet.free] - best.x.reshape(-1, 3)).max(), 2e-6)
            elastic = best.fun + (z[sheet.free] * best.x.reshape(-1, 3)).sum()
            checks.near(f"its elastic energy, {ranks} rank(s)", float(got.observables["elastic_energy"][-1]), elastic, 1e-6 * abs(elastic))


def passes_through_pi(checks, folder):
    """A hinge that folds past pi goes on from the other side: theta jumps by 2 pi, and a rest angle of pi pulls either way."""
    a = np.sqrt(0.75)
    for off in (3.0, -3.0):
        x = np.array([[0, 0, 0], [1, 0, 0], [0.5, a, 0], [0.5, -a * np.cos(off), a * np.sin(off)]])
        sheet = Sheet(x, [(0, 1, 2), (1, 0, 3)], 1e3, 2.0, np.pi, fixed=(0, 1, 2))
        got = run(checks.program, dict(bs_lattice_file=sheet.write(folder / "pi.h5"), ts_dt=1e-9, ts_max_steps=1), interval=1e-9).trajectory
        gap = np.pi - off  # of theta in (-pi, pi]
        checks.near(f"energy at {off} rad of a hinge that rests folded", float(got.observables["elastic_energy"][0]), gap ** 2, 1e-12)


def states(path):
    with h5py.File(path) as f:
        return f["state/position"][...], f["state/velocity"][...]


def files(checks, folder):
    """Written and read back, continued in every bit; a run that meets a wing without area names the hinge."""
    sheet, out = crumpled(0.4), folder / "back.h5md"
    lattice = sheet.write(folder / "back.h5")
    run(checks.program, dict(bs_lattice_file=lattice, bs_output=out, ts_max_steps=2, ts_dt=0.01), ranks=2)
    with h5py.File(out) as f:
        for name, expected in (("", sheet.quads), ("_stiffness", sheet.stiffness), ("_rest_angle", sheet.rest)):
            checks.true(f"/connectivity/hinges{name} is what was read", np.array_equal(f["connectivity/hinges" + name][...], expected))
        last = float(f["observables/elastic_energy/value"][-1])
    again = run(checks.program, dict(bs_lattice_file=out, ts_max_steps=1, ts_dt=1e-6), ranks=3, interval=1e-6)
    checks.near("a trajectory read as a lattice has its hinges", float(again.trajectory.observables["elastic_energy"][0]), last, 1e-13 * last)
    for name, count in (("beuler", 2), ("symplectic", 3)):
        base = dict(ts_type=name, bs_lattice_file=lattice, ts_dt=0.01, ts_adapt_type="none", bs_checkpoint_every=10)
        whole, half, rest = (folder / f"{name}_{part}.ck" for part in ("whole", "half", "rest"))
        run(checks.program, dict(base, ts_max_time=0.2, bs_checkpoint=whole), ranks=count)
        run(checks.program, dict(base, ts_max_time=0.1, bs_checkpoint=half), ranks=count)
        run(checks.program, {"bs_restart": half, "bs_checkpoint": rest, "ts_max_time": 0.2}, ranks=count)
        checks.true(f"{name} continued on {count} rank(s): the same bits", all(np.array_equal(a, b) for a, b in zip(states(whole), states(rest))))
    fallen = Sheet([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0]], [(0, 1, 2), (1, 0, 3)], 1e-9, 0.0, fixed=(0, 1, 2))
    fallen.v[3] = (0, 1, 0)
    for ranks in (1, 3):
        result = run(checks.program, dict(bs_lattice_file=fallen.write(folder / "fallen.h5"), ts_type="euler", ts_dt=0.5, ts_max_time=2.0), ranks=ranks, expect=3)
        checks.true(f"a wing without area ends the run, {ranks} rank(s)", "hinge 0 met a second wing without area" in result.stderr, result.stderr.strip()[:200])


def lammps(checks, folder):
    """dihedral_style table of k (phi - phi_0)^2/2, whose splines are exact for it; phi = pi - theta [rad]: forces of one crumpled sheet."""
    lmp = shutil.which("lmp")
    if not lmp:
        checks.skip("LAMMPS", "no lmp here (apt install lammps)")
        return
    for rest in (0.0, 0.7):
        sheet = crumpled(rest, fixed=())
        n, H = len(sheet.x), len(sheet.quads)
        lines = ["sheet", "", f"{n} atoms", f"{H} dihedrals", f"{n} atom types", "1 dihedral types", "-50 50 xlo xhi", "-50 50 ylo yhi", "-50 50 zlo zhi",
                 "", "Masses", ""] + [f"{i + 1} {m:.17g}" for i, m in enumerate(sheet.m)] + ["", "Atoms # molecular", ""]
        lines += [f"{i + 1} 1 {i + 1} " + " ".join(f"{c:.17g}" for c in p) for i, p in enumerate(sheet.x)] + ["", "Dihedrals", ""]
        lines += [f"{k + 1} 1 {q[2] + 1} {q[0] + 1} {q[1] + 1} {q[3] + 1}" for k, q in enumerate(sheet.quads)]
        (folder / "sheet.data").write_text("\n".join(lines) + "\n")
        phi = np.arange(-180.0, 180.0, 0.5)
        off = (np.radians(180.0 - phi) - rest + np.pi) % (2 * np.pi) - np.pi
        rows = [f"{k + 1} {p:.17g} {e:.17g}" for k, (p, e) in enumerate(zip(phi, sheet.stiffness[0] * off ** 2 / 2))]
        (folder / "sheet.table").write_text("\n".join(["# energies", "", "HINGE", f"N {len(phi)} DEGREES NOF", "", *rows]) + "\n")
        (folder / "sheet.in").write_text(f"""units lj
atom_style molecular
boundary f f f
pair_style zero 10.0
dihedral_style table spline 720
read_data sheet.data
pair_coeff * *
dihedral_coeff 1 sheet.table HINGE
fix 1 all nve
dump 1 all custom 1 force.txt id fx fy fz
dump_modify 1 sort id format float %.17g
run 0
""")
        subprocess.run([lmp, "-in", "sheet.in", "-log", "none"], cwd=folder, check=True, capture_output=True, timeout=300)
        theirs = np.loadtxt((folder / "force.txt").read_text().splitlines()[-n:])[:, 1:]
        sheet.k, sheet.v = 0.0, 0 * sheet.v
        h = 1e-3  # the first step of symplectic Euler, v = h f/m
        got = run(checks.program, dict(bs_lattice_file=sheet.write(folder / "sheet.h5"), ts_type="symplectic", ts_dt=h, ts_max_steps=1), ranks=2, interval=h)
        ours = got.trajectory.velocity[-1] * sheet.m[:, None] / h
        checks.below(f"forces of LAMMPS, rest angle {rest}", np.abs(ours - theirs).max() / np.abs(theirs).max(), 1e-10)


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        for group in (closed_forms, rolled, motions, solvers, equilibria, passes_through_pi, files, lammps):
            if checks.wants(group.__name__):
                with checks.group(group.__name__):
                    group(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
