#!/usr/bin/env python3
"""Components of a periodic box that are free under a given stress: closed forms, cells and nets solved by SciPy, compliances of diluted
nets, restarts, boxes that give way."""
import itertools
import json
import subprocess

from box import A1, A2, triangular
import h5py
from harness import run_parts, write_lattice
import numpy as np
from program import environment, words
from scipy.optimize import brentq, minimize, root

STATICS = {"bs_task": "statics"}
TRIANGULAR = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1, "bs_lattice_spacing": 1}
CUBE_BONDS = [np.array(b, float) for b in itertools.product((-1, 0, 1), repeat=3) if 0 < np.dot(b, b) <= 2 and b > (0, 0, 0)]


def stress_of(bonds, law, volume, F):
    """(sum of T/l r r)/V, with k = 1 of hooke, K = 1 of strain."""
    sigma = 0
    for b in bonds:
        r, L = F @ b, np.linalg.norm(b)
        l = np.linalg.norm(r)
        sigma = sigma + (l - L) / (1 if law == "hooke" else L) / l * np.outer(r, r)
    return sigma / (volume * np.linalg.det(F))


def pulled(checks, folder):
    """Triangular lattice pulled along x, y free: E = 2k/sqrt(3), nu = 1/3, then by the forces of a cell that is strained far."""
    bonds = (A1, A2, A2 - A1)
    eps = 1e-7
    r = checks.run({**TRIANGULAR, "bs_box_rate": f"xx={eps}", "bs_box_stress": "yy=0"}).report
    checks.near("E = 2k/sqrt(3)", r["last_stress"][0] / eps, 2 / np.sqrt(3), 1e-6)
    checks.near("nu = 1/3", -r["last_free_strain"][0] / eps, 1 / 3, 1e-6)
    for path in (None, triangular(folder / "t.h5", 4)):  # a rectangular box, and a rhombus
        for large in (0.3, -0.2):
            across = brentq(lambda y: stress_of(bonds, "hooke", np.sqrt(0.75), np.diag([1 + large, 1 + y]))[1, 1], -0.3, 0.3, xtol=1e-15)
            exact = stress_of(bonds, "hooke", np.sqrt(0.75), np.diag([1 + large, 1 + across]))
            o = {**TRIANGULAR, "bs_box_rate": f"xx={large}", "bs_box_stress": "yy=0", "bs_load_steps": 3}
            if path:
                o = {**STATICS, "bs_lattice_file": path, "bs_box_rate": f"xx={large}", "bs_box_stress": "yy=0", "bs_load_steps": 3}
            r = checks.run(o).report
            where = "rhombus" if path else "rectangle"
            checks.near(f"{where}, {large:+g}: lateral strain", r["last_free_strain"][0], across, 1e-10)
            checks.near(f"{where}, {large:+g}: stress", r["last_stress"], [exact[0, 0], 0, 0], 1e-10)
    exact = root(lambda g: stress_of(bonds, "hooke", np.sqrt(0.75), np.array([[1 + g[0], g[2]], [0, 1 + g[1]]]))[[0, 1, 0], [0, 1, 1]] - [0.4, 0, 0.1], np.zeros(3), tol=1e-14).x
    r = checks.run({**TRIANGULAR, "bs_box_stress": "xx=0.4,yy=0,xy=0.1"}).report
    checks.near("pulled and sheared in one step", r["last_free_strain"], exact, 1e-9)
    # Newton's method: six corrections by the whole change of the stress, more where its terms of the present stress are wrong
    checks.below("its corrections", r["box_corrections"], 6)
    x = brentq(lambda g: stress_of(bonds, "hooke", np.sqrt(0.75), np.eye(2) * (1 + g))[0, 0] - 0.4, 0, 2, xtol=1e-15)
    r = checks.run({**TRIANGULAR, "bs_box_stress": "xx=0.4,yy=0.4", "bs_load_steps": 2}).report
    checks.near("biaxial stress", r["last_free_strain"], [x, x], 1e-10)
    (folder / "s.csv").write_text("t,stress\n0,0\n0.5,0.9\n1,0.4\n")
    r = checks.run({**TRIANGULAR, "bs_box_stress": f"xx=table:{folder / 's.csv'},yy=expression:0.4*t", "bs_load_steps": 2}).report
    checks.near("the same by a table and an expression", r["last_free_strain"], [x, x], 1e-10)


def cube(checks, folder):
    """18 neighbours of strain springs under pressure, and sheared with all other components free under stresses: SciPy on one cell."""
    base = {**STATICS, "bs_lattice_type": "cubic", "bs_lattice_size": "2,2,3", "bs_lattice_periodic": "xyz", "bs_lattice_spacing": 1, "bs_spring_law": "strain",
            "bs_lattice_stiffness": 1}
    pressure = 0.3
    x = brentq(lambda g: stress_of(CUBE_BONDS, "strain", 1, np.eye(3) * (1 + g))[0, 0] + pressure, -0.5, 0, xtol=1e-15)
    r = checks.run({**base, "bs_box_stress": f"xx={-pressure},yy={-pressure},zz={-pressure}"}).report
    checks.near("hydrostatic pressure", r["last_free_strain"], [x] * 3, 1e-10)
    shear, given = 0.2, {(0, 0): 0.1, (1, 1): -0.05, (2, 2): 0.02, (0, 2): 0.03, (1, 2): -0.04}

    def off(g):
        F = np.eye(3)
        F[0, 1] = shear
        for (i, j), value in zip(given, g):
            F[i, j] += value
        sigma = stress_of(CUBE_BONDS, "strain", 1, F)
        return [sigma[place] - value for place, value in given.items()]
    exact = root(off, np.zeros(5), tol=1e-14).x
    stress = ",".join(f"{'xyz'[i]}{'xyz'[j]}={value}" for (i, j), value in given.items())
    r = checks.run({**base, "bs_box_rate": f"xy={shear}", "bs_box_stress": stress}).report
    checks.near("sheared, five components free: the box becomes triclinic", r["last_free_strain"], exact, 1e-9)


def diluted(checks, folder):
    """Small stresses on disordered nets: the strain by their stiffness tensors."""
    path = checks.oracles / "E_mechanics"
    if not (path / "diluted_moduli.csv").exists():
        checks.skip("diluted nets", "the reference results are not there")
        return
    for row in np.loadtxt(path / "diluted_moduli.csv", delimiter=",", skiprows=1):
        if row[0] not in (0.9, 0.8) or row[1] > 1:
            continue
        bonds = np.loadtxt(path / f"diluted_p{row[0]:g}_s{row[1]:.0f}.csv", delimiter=",", skiprows=1, dtype=int)
        C = np.array([[row[3], row[6], row[7]], [row[6], row[4], row[8]], [row[7], row[8], row[5]]])
        sigma = 1e-8 * np.array([1.0, -0.5, 0.7])
        r = checks.run({**STATICS, "bs_lattice_file": triangular(folder / "d.h5", 16, bonds),
                        "bs_box_stress": f"xx={float(sigma[0])!r},yy={float(sigma[1])!r},xy={float(sigma[2])!r}"}).report
        exact = np.linalg.solve(C, sigma)
        checks.below(f"diluted net, p = {row[0]:g}, seed {row[1]:.0f}: strain by the compliance", np.abs(r["last_free_strain"] - exact).max() / np.abs(exact).max(), 2e-5)


def disordered(checks, folder):
    """Stress met, and the strain found by an optimiser that knows nothing of the program's; frames, restarts, moduli of what was found."""
    rng = np.random.default_rng(8)
    n = 3
    base = triangular(folder / "p.h5", n)
    with h5py.File(base, "r+") as f:
        f["springs/rest_length"][...] = 1 + 0.1 * rng.standard_normal(len(f["springs/rest_length"]))
        f["springs/stiffness"][...] = np.exp(rng.standard_normal(len(f["springs/stiffness"])) / 2)
        x0, pairs, shift = f["particles/position"][...], f["springs/pairs"][...], f["springs/shift"][...]
        k, L = f["springs/stiffness"][...], f["springs/rest_length"][...]
    edges = np.array([n * A1, n * A2])

    def box(g):  # xx prescribed, yy and xy free
        return np.array([[1.05, g[1]], [0, 1 + g[0]]])

    def energy(z):
        e = edges @ box(z[:2]).T
        x = x0 + z[2:].reshape(-1, 2)
        r = x[pairs[:, 1]] + shift @ e - x[pairs[:, 0]]
        l = np.linalg.norm(r, axis=1)
        T = (k * (l - L) / l)[:, None] * r
        g = np.zeros_like(x)
        np.add.at(g, pairs[:, 1], T)
        np.add.at(g, pairs[:, 0], -T)
        pull = shift.T @ T  # dE/de_k
        return 0.5 * (k * (l - L) ** 2).sum(), np.concatenate([[(pull * edges[:, 1:] * [0, 1]).sum(), (pull * edges[:, 1:] * [1, 0]).sum()], g.ravel()])
    best = minimize(energy, np.zeros(2 + 2 * n * n), jac=True, method="BFGS", options={"gtol": 1e-12, "maxiter": 5000})
    options = {**STATICS, "bs_lattice_file": base, "bs_box_rate": "xx=0.05", "bs_box_stress": "xy=0,yy=0", "bs_load_steps": 6, "snes_rtol": 1e-13}
    run = checks.run(options, interval=0)
    checks.near("free strains of a disordered net, by SciPy", run.report["last_free_strain"], best.x[[1, 0]], 1e-9)
    checks.near("its energy", run.report["last_elastic_energy"][0], best.fun, 1e-11)
    o = run.trajectory.observables
    checks.below("the stresses are met at every step", np.abs(o["stress"][1:, 1:]).max() / np.abs(o["stress"]).max(), 1e-10)
    checks.true("the first frame is the lattice as it was given", np.all(o["free_strain"][0] == 0))
    continued(checks, folder, options)


def continued(checks, folder, options):
    """The checkpoint has the strains; the trajectory has the box that was found, whose moduli are those of it read back."""
    mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []

    def go(place, *more):
        (folder / place).mkdir(exist_ok=True)
        subprocess.run([*mpi, checks.program, *more], cwd=folder / place, check=True, capture_output=True, env=environment(checks.ranks))
    start = words({**options, "condensed_pc_type": "bicc", "bs_checkpoint": "c", "bs_output": "r.h5md", "bs_checkpoint_every": 3})
    go("whole", *start)
    go("parts", *start, "-ts_max_steps", "3")
    go("parts", "-bs_restart", "c", "-ts_max_steps", "1000", "-bs_lattice_file", str(options["bs_lattice_file"]))
    with h5py.File(folder / "whole" / "r.h5md") as a, h5py.File(folder / "parts" / "r.h5md") as b:
        checks.true("continued in every bit", all(np.array_equal(a[path + "/value"][...], b[path + "/value"][...]) for path in (
            "particles/trajectory/position", "particles/trajectory/box/edges", "observables/stress", "observables/free_strain", "observables/work/box")))
        edges, found = a["particles/trajectory/box/edges/value"][...], a["observables/free_strain/value"][-1]
    F = np.array([[1.05, found[0]], [0, 1 + found[1]]])
    checks.near("the box in the frames is what was found", edges[-1], edges[0] @ F.T, 1e-14)
    C = checks.run({**options, "bs_task": "moduli"}).report
    go("again", *words({"bs_lattice_file": "../whole/r.h5md", "bs_task": "moduli", "bs_report": "m.json"}))
    again = json.loads((folder / "again" / "m.json").read_text())
    checks.near("moduli of the relaxed box", C["stiffness"], again["stiffness"], 1e-9)


def gives_way(checks, folder):
    """Stress that no box bears: one clear error, the last good frame."""
    for name, options in (
            ("collapse under pressure", {"bs_box_stress": "xx=-2,yy=-1.9", "bs_load_steps": 5}),
            ("one edge pressed harder than springs of length 0 push", {"bs_box_stress": "xx=-2", "bs_load_steps": 5}),
            ("slack springs pressed", {"bs_box_stress": "xx=-0.1,yy=-0.1", "bs_spring_law": "tension"}),
            ("slack springs pulled one way, pressed the other", {"bs_box_stress": "xx=0.3,yy=-0.3", "bs_spring_law": "tension", "bs_load_steps": 2})):
        run = checks.run({**TRIANGULAR, **options}, interval=0, expect=3)
        said = [line for line in run.stderr.splitlines() if line.startswith("backspring: error")]
        checks.true(name, len(said) == 1 and "does not bear the stress" in said[0] and run.report["outcome"] == "failed", said[0] if said else "no error")
        o = run.trajectory.observables
        met = np.abs(o["stress"][1:, 0] - run.trajectory.observables["load_factor"][1:].ravel() * float(options["bs_box_stress"].split("=")[1].split(",")[0]))
        if "pressure" in name:
            checks.true(f"{name}: the frames before it bear their stress", len(met) > 0 and np.all(met <= 1e-9), f"{len(met)} frames")
    r = checks.run({**TRIANGULAR, "bs_spring_law": "tension", "bs_box_stress": "xx=0.1,yy=0.1"}).report
    bonds = (A1, A2, A2 - A1)
    x = brentq(lambda g: stress_of(bonds, "hooke", np.sqrt(0.75), np.eye(2) * (1 + g))[0, 0] - 0.1, 0, 2, xtol=1e-15)
    checks.near("slack springs pulled", r["last_free_strain"], [x, x], 1e-10)


def softening(checks, folder):
    """A periodic chain of springs T = s - s^2 bears 0.21 at s = 0.3, where dT/ds = 0.4, and at s = 0.7, where it is -0.4: under its own stress it stays at the one and
    leaves the other, which is no answer."""
    n = 6
    at = np.arange(n)
    for s, stable in ((0.3, True), (0.7, False)):
        path = write_lattice(folder / f"soft{stable}.h5", (1 + s) * at[:, None], 1.0, pairs=np.stack([at, (at + 1) % n], 1), stiffness=1.0, rest_length=1.0, spring_law="polynomial",
                             columns={"stiffness_2": -1.0, "stiffness_3": 0.0}, box=[[n * (1 + s)]], shift=(at == n - 1).astype(int)[:, None])
        run = checks.run({**STATICS, "bs_lattice_file": path, "bs_box_stress": "xx=0.21", "bs_load_scale": "none"}, interval=0, expect=None)
        found = run.report["last_free_strain"]
        checks.true(f"a softening chain under its own stress, s = {s}", run.code == (0 if stable else 3) and (not stable or abs(found[0]) < 1e-9), f"exit code {run.code}, {found}")
        if not stable:
            checks.true("and says why", "smallest disturbance" in run.stderr or "does not bear the stress" in run.stderr, run.stderr.strip()[-300:])


def met(checks, folder):
    """Stresses are met or the run fails; a stress far beyond the stiffness is met soon, and warned of."""
    square = {**STATICS, "bs_lattice_type": "square", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy", "bs_lattice_neighbors": 8, "bs_lattice_stiffness": 1000}
    for value in (1e10, 1e-5):
        run = checks.run({**square, "bs_box_stress": "xx=1", "bs_box_stress_rtol": value}, expect=2)
        checks.true(f"a tolerance of {value:g} is refused", "-bs_box_stress_rtol" in run.stderr and run.stderr.count("backspring: ") == 1, run.stderr.strip())
    run = checks.run({**square, "bs_box_stress": "xx=1", "bs_box_stress_rtol": 1e-6})
    checks.below("1e-6 is met", abs(run.report["last_stress"][0] - 1), 1e-6)
    run = checks.run({**square, "bs_box_stress": "xx=1e9", "bs_load_steps": 5})
    strain = run.report["last_free_strain"][0]
    # across the pull nothing is strained: springs along x and the diagonals, forces k (l - L), per height of 1
    exact = brentq(lambda g: (1000 * g + 2 * 1000 * (1 - np.sqrt(2) / np.hypot(1 + g, 1)) * (1 + g)) / 1e9 - 1, 1, 1e7, xtol=1e-4, rtol=1e-14)
    checks.below("a stress a million times the stiffness: strain", abs(strain / exact - 1), 1e-8)
    checks.true("in few steps, with a warning", run.report["steps"] < 200 and "box_strain" in run.report["warnings"] and "steps_cut" in run.report["warnings"],
                f"{run.report['steps']} steps, {run.report['warnings']}")


if __name__ == "__main__":
    run_parts(__doc__, (pulled, cube, diluted, disordered, gives_way, softening, met))
