#!/usr/bin/env python3
"""Stability of equilibria (-bs_task statics): unstable directions against the eigenvalues of K by NumPy, snap-through of trusses of two bars against
their limit load, and what a path by arc length goes by."""
import h5py
import numpy as np
import scipy.io
from harness import run_parts, write_lattice
from scipy.optimize import brentq, minimize

STATICS = {"bs_task": "statics"}
LIMIT = 0.0099499169577446  # of the truss
UNSTABLE, JUMPS, END = "unstable_equilibria", "snap_through", "path_end"


def matrix(run, folder, name):
    path = folder / name
    path.write_bytes(run.files[name])
    return scipy.io.mmread(path).toarray()


def counted(checks, folder):
    """Random periodic nets, relaxed: some come to rest at saddle points. K q = -omega^2 M q of what was written has as many negative omega^2 as are told.
    Where minima are looked for, as by default, there is none, and less energy is left."""
    seen = set()
    for fraction, factor, seed in ((0.1, 0.95, 1), (0.2, 1.005, 1), (0.25, 1.005, 3), (0.3, 0.95, 2), (0.35, 0.95, 1), (0.4, 0.95, 1), (0.4, 0.95, 4)):
        net = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "16,16", "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1,
               "bs_lattice_stiff_fraction": fraction, "bs_lattice_stiff_factor": 0, "bs_lattice_seed": seed, "bs_lattice_rest_length_factor": factor, "bs_write_matrices": "m"}
        run = checks.run({**net, "bs_equilibria": "any"}, interval=0, keep=("m_K.mtx",), expect=None)
        if run.code != 0:
            continue  # Newton's method need not come to rest within its steps
        K = matrix(run, folder, "m_K.mtx")
        omega2 = np.linalg.eigvalsh(-0.5 * (K + K.T))
        exact = int(np.sum(omega2 < -1e-9))
        seen.add(exact > 0)
        o = run.trajectory.observables
        name = f"removed {fraction}, rest lengths x {factor}, seed {seed}"
        checks.near(f"{name}: unstable directions", float(o["negative_pivots"][-1]), exact, 0)
        checks.true(f"{name}: told", (UNSTABLE in run.report["warnings"]) == (exact > 0) == (o["stability"].ravel()[-1] == -1) == (run.report["unstable"] == 1)
                    and (f"in up to {exact} direction{'s' * (exact != 1)}:" in run.stderr) == (exact > 0) and set(run.report["warnings"]) <= {UNSTABLE, "start_not_at_rest"}, run.stdout.splitlines()[-1])
        lower = checks.run(net, interval=0, keep=("m_K.mtx",))
        K = matrix(lower, folder, "m_K.mtx")
        checks.true(f"{name}: a minimum by default", np.linalg.eigvalsh(-0.5 * (K + K.T))[0] > -1e-9 and lower.report["unstable"] == 0 == run.report["saddle_points"]
                    and UNSTABLE not in lower.report["warnings"], lower.stdout.splitlines()[-1])
        energies = [float(r.trajectory.observables["total_energy"].ravel()[-1]) for r in (lower, run)]
        checks.true(f"{name}: the energy is lower where a saddle point was left", energies[0] < energies[1] if exact else lower.report["saddle_points"] == 0, str(energies))
    checks.true("stable and unstable ones are among them", seen == {True, False})


def column(folder, load, n=8, a=0.5, kappa=3.0, k=1e5, critical=0.913445609864564):
    """Links with elastic hinges between two walls that press it by a part of its buckling load."""
    at = np.arange(n + 1)
    angles = {"triples": np.stack([at[:-2], at[1:-1], at[2:]], 1), "stiffness": kappa, "rest_angle": np.pi}
    return write_lattice(folder / f"column{load}.h5", np.stack([a * at * (1 - load * critical / k / a), 0 * at], 1), 1.0, fixed=(at == 0) | (at == n),
                         pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k, rest_length=a, angles=angles)


def iterative(checks, folder):
    """Without factors: an unstable direction is found or not, and nothing is claimed that is not known."""
    for load, solver, more, verdict in ((1.5, "cholesky", {}, -1), (0.5, "cholesky", {}, 1), (1.5, "bicc", {}, -1), (0.5, "bicc", {}, 0), (1.5, "jacobi", {}, -1),
                                        (1.5, "bicc", {"bs_stability_iterations": 0}, 0)):
        run = checks.run({**STATICS, "bs_equilibria": "any", "bs_lattice_file": column(folder, load), "condensed_pc_type": solver, **more}, interval=0)
        name = f"column at {load} of its buckling load, {solver} {more or ''}"
        o = run.trajectory.observables
        checks.true(name, o["stability"].ravel()[-1] == verdict and (run.report["warnings"] == [UNSTABLE]) == (verdict < 0)
                    and [run.report[key] for key in ("unstable", "stability_unknown", "stable")] == [int(verdict == v) for v in (-1, 0, 1)],
                    f"{o['stability'].ravel()}, {run.report['warnings']}")
        checks.true(f"{name}: the summary says what is not known", ("not known whether" in run.stdout) == (verdict == 0))
    flat = {**STATICS, "bs_lattice_type": "cloth", "bs_lattice_size": "10,10", "bs_lattice_neighbors": 12, "bs_lattice_spacing": 0.04, "bs_lattice_particle_mass": 1e-3,
            "bs_lattice_fixed_particles": "90,99", "bs_lattice_stiffness": "20,10,0.5", "bs_spring_law": "strain"}
    for solver in ("cholesky", "bicc"):
        run = checks.run({**flat, "condensed_pc_type": solver}, interval=0)
        checks.true(f"a flat cloth at rest, whose motions out of its plane cost nothing, is not called unstable: {solver}", run.report["warnings"] == [], str(run.report["warnings"]))


def energy_of_column(x, load, n=8, a=0.5, kappa=3.0, k=1e5, critical=0.913445609864564):
    """Of column(): stretched links, and the angles by which each turns against the one before [J]; with its gradient."""
    X = np.zeros((n + 1, 2))
    X[n, 0] = n * a * (1 - load * critical / k / a)
    X[1:n] = x.reshape(-1, 2)
    d = np.diff(X, axis=0)
    length, phi = np.hypot(*d.T), np.arctan2(d[:, 1], d[:, 0])
    turn = np.diff(phi)
    along, across = d / length[:, None], np.stack([-d[:, 1], d[:, 0]], 1) / length[:, None] ** 2
    of_phi = kappa * (np.concatenate([[0], turn]) - np.concatenate([turn, [0]]))
    of_link = k * (length - a)[:, None] * along + of_phi[:, None] * across
    return 0.5 * k * np.sum((length - a) ** 2) + 0.5 * kappa * np.sum(turn**2), (of_link[:-1] - of_link[1:]).ravel()


def minima(checks, folder):
    """Columns beyond their buckling load: the shape leaves the straight line, for the one that SciPy's search for the least energy finds."""
    for load in (1.02, 1.5, 6.0):
        start = column(folder, load)
        guess = np.stack([np.linspace(0, 4, 9), 0.1 * np.sin(np.pi * np.linspace(0, 1, 9))], 1)[1:-1].ravel()
        least = minimize(energy_of_column, guess, args=(load,), jac=True, method="BFGS", options={"gtol": 1e-11, "maxiter": 20000}).fun
        for solver in ("cholesky", "bicc", "jacobi"):
            run = checks.run({**STATICS, "bs_lattice_file": start, "condensed_pc_type": solver}, interval=0)
            name = f"column at {load} of its buckling load, {solver}"
            checks.near(f"{name}: energy", float(run.trajectory.observables["total_energy"].ravel()[-1]) / least, 1, 1e-9)
            checks.true(f"{name}: told", run.report["warnings"] == [] and run.report["unstable"] == 0 and run.report["saddle_points"] == 1 and "saddle point" in run.stdout,
                        f"{run.report['warnings']}, {run.report['saddle_points']}")
            checks.true(f"{name}: bent to one side", np.ptp(run.trajectory.position[-1][:, 1]) > 1e-3, str(np.ptp(run.trajectory.position[-1][:, 1])))
    # two bars that are 1e-7 too long, beside springs that hold 10^17 times the energy which they lose by bending aside
    strain = 1e-7
    slight = write_lattice(folder / "slight.h5", [[-1, 0], [0, 0], [1, 0], [-1, 3], [0, 3], [1, 3]], 1.0, fixed=[1, 0, 1, 1, 0, 1],
                           pairs=[[0, 1], [1, 2], [3, 4], [4, 5]], stiffness=[1.0, 1.0, 1e3, 1e3], rest_length=[1 + strain, 1 + strain, 0.1, 0.1])
    for solver in ("cholesky", "bicc"):
        run = checks.run({**STATICS, "bs_lattice_file": slight, "condensed_pc_type": solver}, interval=0)
        height = run.trajectory.position[-1, np.argsort(run.trajectory.id)[1], 1]
        checks.near(f"bars 1e-7 beyond their buckling load, {solver}: bent", abs(height) / np.sqrt(2 * strain + strain**2), 1, 1e-5)
        checks.true(f"bars 1e-7 beyond their buckling load, {solver}: told", run.report["saddle_points"] == 1 and run.report["unstable"] == 0, str(run.report["warnings"]))
    # pressed by a wall in load steps, and continued from between them
    at = np.arange(9)
    angles = {"triples": np.stack([at[:-2], at[1:-1], at[2:]], 1), "stiffness": 3.0, "rest_angle": np.pi}
    path = write_lattice(folder / "pressed.h5", np.stack([0.5 * at, 0 * at], 1), 1.0, fixed=at == 0, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=1e5, rest_length=0.5,
                         angles=angles)
    with h5py.File(path, "r+") as f:
        f["groups/wall"] = [8]
    load = 4.0
    base = {**STATICS, "bs_lattice_file": path, "bs_motion_wall": f"velocity:{-load * 8 * 0.913445609864564 / 1e5},0", "bs_load_steps": 8}
    whole = checks.run(base, interval=0)
    for steps in (1, 2, 5):
        saved = folder / f"pressed{steps}.checkpoint"
        checks.run({**base, "bs_checkpoint": saved, "ts_max_steps": steps}, interval=0)
        rest = checks.run({"bs_restart": saved, "ts_max_steps": 5000}, interval=0)
        checks.true(f"pressed, continued from load step {steps}: every bit", np.array_equal(whole.trajectory.position[-1], rest.trajectory.position[-1]))
        checks.true(f"pressed, continued from load step {steps}: counts", all(whole.report[key] == rest.report[key] for key in ("saddle_points", "unstable", "stable", "snap_through_unknown")))
    checks.true("a pressed column buckles in the first load step beyond its buckling load", whole.report["saddle_points"] == 1 and whole.report["snap_through"] == 0
                and whole.report["snap_through_unknown"] == 1 and whole.report["warnings"] == [], f"{whole.report['saddle_points']}, {whole.report['warnings']}")
    sag = np.ptp(whole.trajectory.position[:, :, 1], axis=1)
    checks.true("pressed: straight up to there, bent from there", bool(np.all(sag[:3] < 1e-9) and np.all(np.diff(sag[2:]) > 0)), str(sag))
    fail = checks.run({**STATICS, "bs_lattice_file": truss(folder), "bs_gravity": "0,-0.02", "bs_load_control": "arc", "bs_equilibria": "minimum"}, expect=2)
    checks.true("paths by arc length refuse it", "-bs_equilibria minimum does not go with -bs_load_control arc" in fail.stderr, fail.stderr)


def searches(checks, folder):
    """Diluted plates whose loose bars seem to buckle by what the tolerance leaves: the same minima by every line search, whichever way leads there."""
    for seed in (2, 3, 4):
        plate = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "12,12", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1, "bs_lattice_remove_fraction": 0.15,
                 "bs_lattice_seed": seed, "bs_group_lower": "ymin", "bs_group_upper": "ymax", "bs_motion_lower": "fixed", "bs_motion_upper": "x=fixed,y=velocity:4", "bs_load_steps": 20}
        default = checks.run(plate, interval=0)
        for search in ("cp", "bt", "l2", "basic", "guarded"):
            run = checks.run({**plate, "snes_linesearch_type": search}, interval=0)
            checks.near(f"plate {seed}, {search}: energies", run.trajectory.observables["total_energy"].ravel(), default.trajectory.observables["total_energy"].ravel(), 1e-9)
            checks.true(f"plate {seed}, {search}: minima", run.report["unstable"] == 0 and run.report["stable"] == 20, f"{run.report['unstable']}, {run.report['stable']}")


def tangent(x, r, pairs, k, L):
    """-K of springs, dense: k u u^T + T/l (1 - u u^T) between their ends."""
    n, d = x.shape
    l = np.linalg.norm(r, axis=1)
    u, across = r / l[:, None], (k * (l - L) / l)[:, None, None]
    along = u[:, :, None] * u[:, None]
    blocks, H = k[:, None, None] * along + across * (np.eye(d) - along), np.zeros((n, n, d, d))
    for a, b, sign in ((0, 0, 1), (1, 1, 1), (0, 1, -1), (1, 0, -1)):
        np.add.at(H, (pairs[:, a], pairs[:, b]), sign * blocks)
    return H.transpose(0, 2, 1, 3).reshape(n * d, n * d)


def slightly(checks, folder):
    """Sheared nets, floppy at first, in which bars press by 1e-10 of k a while some parts are tied to nothing: the count of every frame is that of NumPy's eigenvalues."""
    seen = 0
    for seed in (1, 6, 10):
        net = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "16,16", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1,
               "bs_lattice_remove_fraction": 0.42, "bs_lattice_seed": seed, "bs_box_strain": "xy=velocity:0.4", "bs_load_steps": 20, "bs_output": "p.h5md"}
        run = checks.run(net, keep=("p.h5md",))
        (folder / "p.h5md").write_bytes(run.files["p.h5md"])
        with h5py.File(folder / "p.h5md") as f:
            order, pairs, shift = np.argsort(f["particles/trajectory/id"][...]), f["connectivity/bonds"][...], f["connectivity/bonds_shift"][...]
            k, L = f["connectivity/bonds_stiffness"][...], f["connectivity/bonds_rest_length"][...]
            told = f["observables/negative_pivots/value"][...].ravel()
            places, boxes = f["particles/trajectory/position/value"][:, order], f["particles/trajectory/box/edges/value"][...]
        omega2 = np.array([np.linalg.eigvalsh(tangent(x, x[pairs[:, 1]] + shift @ edges - x[pairs[:, 0]], pairs, k, L)) for x, edges in zip(places, boxes)])
        surely, perhaps = np.sum(omega2 < -1e-9, axis=1), np.sum(omega2 < -1e-11, axis=1)
        seen += perhaps.sum()  # which of them are, rounding decides
        checks.true(f"net {seed}: unstable directions of {len(told)} frames", run.report["free_bodies"] > 0 and bool(np.all((surely <= told) & (told <= perhaps))),
                    f"{told}, numpy {surely} to {perhaps}")
    checks.true("some are unstable", seen > 0 or checks.ranks > 1)


def load_of(h, b=1.0, k=1.0):
    """What two bars of rest length sqrt(1 + 0.3^2) over half a span b bear with their apex at height h."""
    return 2 * k * h * (np.hypot(1, 0.3) / np.hypot(b, h) - 1)


def truss(folder, n=1, **more):
    """n trusses beside one another, the k-th of stiffness 1 + k."""
    x = np.concatenate([[[-1, 3 * k], [1, 3 * k], [0, 3 * k + 0.3]] for k in range(n)])
    pairs = np.concatenate([[[3 * k, 3 * k + 2], [3 * k + 1, 3 * k + 2]] for k in range(n)])
    return write_lattice(folder / f"truss{n}.h5", x, 1.0, fixed=np.tile([1, 1, 0], n), pairs=pairs, stiffness=1.0 + pairs[:, 0] // 3, rest_length=np.hypot(1, 0.3), **more)


def said(run):
    """Load factors between which the first jump is said to be."""
    text = next(line for line in run.stderr.splitlines() if "snap-through" in line).split("between the load factors ")[1].split(",")[0]
    return [float(word) for word in text.split(" and ")]


def snaps(checks, folder):
    path = truss(folder)
    for steps, load in ((1, 0.02), (7, 0.02), (40, 0.02), (1, 0.0098), (3, 0.00994), (40, 0.00994)):
        run = checks.run({**STATICS, "bs_lattice_file": path, "bs_load_steps": steps, "bs_gravity": f"0,{-load}"}, interval=0)
        over = load > LIMIT
        name = f"truss under {load / LIMIT:.4g} of its limit load in {steps} load steps"
        checks.true(f"{name}: snap-through", run.report["warnings"] == ([JUMPS] if over else []) and run.report["snap_through"] == int(over),
                    f"{run.report['warnings']}, height {run.trajectory.position[-1, 2, 1]:.6g} m")
        if over:
            low, high = said(run)
            checks.true(f"{name}: where", low < LIMIT / load + 1e-6 and high > LIMIT / load - 1e-6 and high - low < 1.1 / 32 / steps + 1e-5, f"{low} to {high} for {LIMIT / load:.6g}")
            checks.near(f"{name}: the state is the one behind it", run.trajectory.position[-1, 2, 1], brentq(lambda h: load_of(h) - load, -0.6, -0.3, xtol=1e-15), 1e-11)
    run = checks.run({**STATICS, "bs_lattice_file": path, "bs_load_steps": 20, "bs_gravity": "0,-0.02", "bs_load_control": "arc"}, interval=0)
    checks.true("followed by arc length it does not jump; the part of the path between the limit points is unstable", run.report["warnings"] == [UNSTABLE]
                and "snap-through" not in run.stderr, str(run.report["warnings"]))
    run = checks.run({**STATICS, "bs_lattice_file": truss(folder, 3), "bs_load_steps": 20, "bs_gravity": "0,-0.025"}, interval=0)
    checks.true("of three trusses of stiffness 1, 2 and 3 two snap, each in a load step of its own", run.report["snap_through"] == 2 and run.report["warnings"] == [JUMPS],
                str(run.report["snap_through"]))
    hang = {"bs_lattice_type": "chain", "bs_lattice_size": 9, "bs_lattice_dim": 2, "bs_lattice_fixed": "xmin", "bs_gravity": "0,-9.81", "bs_load_steps": 4}
    loose = {"bs_lattice_type": "triangular", "bs_lattice_size": "10,10", "bs_lattice_stiff_fraction": 0.35, "bs_lattice_stiff_factor": 0, "bs_lattice_seed": 2, "bs_group_b": "ymin",
             "bs_group_t": "ymax", "bs_motion_b": "fixed", "bs_motion_t": "x=velocity:0.3,y=fixed", "bs_load_steps": 3}
    for name, options in (("a chain of loose hinges that swings down by its first load has no branch to jump from", hang),
                          ("a sheared net whose loose ends are moved without resistance releases no energy", loose)):
        run = checks.run({**STATICS, **options})
        checks.true(name, JUMPS not in run.report["warnings"], str(run.report["warnings"]))


def first_step(checks, folder):
    """Trusses that are given 2 % shorter than they are without stress: the first load step is looked at, too, from the lattice at rest."""
    rest = 1.02 * np.hypot(1, 0.3)
    path = write_lattice(folder / "stressed.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0, rest_length=rest)
    load_at = lambda h: 2 * h * (rest / np.hypot(1, h) - 1)  # noqa: E731
    limit = load_at(np.linspace(0.05, 0.4, 400001)).max()
    for load in (1.5 * limit, 1.02 * limit, 0.98 * limit):
        run = checks.run({**STATICS, "bs_lattice_file": path, "bs_gravity": f"0,{-load}"}, interval=0)
        over = load > limit
        name = f"a stressed truss under {load / limit:.4g} of its limit load in one load step"
        checks.true(f"{name}: snap-through", run.report["warnings"] == ([JUMPS] if over else []) and run.report["snap_through"] == int(over)
                    and run.report["snap_through_unknown"] == 0, str(run.report["warnings"]))
        h = run.trajectory.position[-1, np.argsort(run.trajectory.id)[2], 1]
        checks.near(f"{name}: height", h, brentq(lambda h: load_at(h) - load, *((-0.8, -0.35) if over else (0.21, 0.4)), xtol=1e-15), 1e-11)
        if over:
            low, high = said(run)
            checks.true(f"{name}: where", low - 1e-6 < limit / load < high + 1e-6 and high - low < 1.1 / 32, f"{low} to {high} for {limit / load:.6g}")


def not_looked_for(checks, folder):
    """Where snap-through is not looked for the report has no number, and the summary says why."""
    base = {**STATICS, "bs_lattice_file": truss(folder), "bs_load_steps": 4, "bs_gravity": "0,-0.005"}
    net = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.05, "bs_box_stress": "xx=0.01"}
    for name, options, words in (("by arc length", {**base, "bs_load_control": "arc"}, "along a path by arc length"), ("box under given stress", net, "in a box under given stress"),
                                 ("trust regions", {**base, "snes_type": "newtontr"}, "with another -snes_type")):
        run = checks.run(options, interval=0)
        checks.true(f"{name}: null, and told", run.report["snap_through"] is None and f"snap-through was not looked for {words}" in run.stdout, str(run.report["snap_through"]))
    run = checks.run(base, interval=0)
    checks.true("else it is a number, of which nothing is told", run.report["snap_through"] == 0 == run.report["snap_through_unknown"] and "snap-through" not in run.stdout)
    # three fibres beside one another break in two load steps
    path = write_lattice(folder / "fibres.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=[[0, 1]] * 3, stiffness=1.0, rest_length=1.0,
                         columns={"critical_strain": [0.05, 0.13, 9.0]})
    saved = folder / "broken.checkpoint"
    fibres = {**STATICS, "bs_lattice_file": path, "bs_load_steps": 10, "bs_gravity": 0.3}
    for name, options in (("at once", fibres), ("continued", {"bs_restart": saved, "ts_max_steps": 100})):
        run = checks.run(options, interval=0)
        seen = len(set(np.round(run.trajectory.observables["broken_springs"].ravel()))) - 1
        checks.true(f"{name}: load steps in which springs broke are not looked at all the way", run.report["snap_through"] == 0 and run.report["snap_through_unknown"] == 2
                    and "2 load steps in which snap-through was not looked for" in run.stdout, f"{run.report['snap_through_unknown']}, {seen}")
        if name == "at once":
            checks.run({**fibres, "bs_checkpoint": saved, "ts_max_steps": 5}, interval=0)


def crossings(checks, folder):
    """Snap-through with springs that break, in a periodic box that is strained, and over a restart."""
    k = {"bs_lattice_file": truss(folder, 2), "bs_load_steps": 20, "bs_gravity": "0,-0.018"}
    for name, limit, broken in (("none breaks", 10, 0), ("two break in front of the jump", 0.004, 2)):
        path = truss(folder, 2, columns={"critical_strain": [limit, limit, 10, 10]})
        with_net = write_lattice(folder / "net.h5", [[-1, 0], [1, 0], [0, 0.3], [-1, 3], [1, 3], [0, 3.3], [0, 2.3]], 1.0, fixed=[1, 1, 0, 1, 1, 0, 1],
                                 pairs=[[0, 2], [1, 2], [3, 5], [4, 5], [6, 2]], stiffness=[1, 1, 1, 1, 0.5], rest_length=[np.hypot(1, 0.3)] * 4 + [2.0],
                                 columns={"critical_strain": [limit, limit, 10, 10, 10]})
        run = checks.run({**STATICS, **k, "bs_lattice_file": with_net if broken else path, "bs_break_in": "both"}, interval=0)
        checks.true(f"snap-through, {name}", run.report["snap_through"] == 1 and run.report["broken_springs"] == broken, f"{run.report['snap_through']}, {run.report['broken_springs']} broken")
    # period 2, the base is fixed, the box is strained along the base: half a span of 1 + 0.02 s
    box = write_lattice(folder / "box.h5", [[0, 0], [1, 0.3]], 1.0, fixed=[1, 0], pairs=[[0, 1], [1, 0]], stiffness=1.0, rest_length=np.hypot(1, 0.3), box=[[2, 0], [0, 5]],
                        shift=[[0, 0], [1, 0]])
    for load in (0.008, 0.003):
        run = checks.run({**STATICS, "bs_lattice_file": box, "bs_load_steps": 10, "bs_gravity": f"0,{-load}", "bs_box_rate": "xx=0.02"}, interval=0, expect=None)
        if run.code == 2:
            checks.skip("snap-through in a box", run.stderr.strip())
            break
        heights = np.linspace(0.02, 0.3, 4001)
        limit = brentq(lambda s: load_of(heights, 1 + 0.02 * s).max() - load * s, 0.1, 3)
        checks.true(f"in a periodic box that is strained, load {load}", run.report["warnings"] == ([JUMPS] if limit < 1 else []), f"limit at {limit:.4g}: {run.report['warnings']}")
        if limit < 1:
            low, high = said(run)
            checks.true("where it is", low - 1e-4 < limit < high + 1e-4, f"{low} to {high} for {limit:.5g}")
    path, saved = truss(folder), folder / "half.checkpoint"
    base = {**STATICS, "bs_lattice_file": path, "bs_load_steps": 20, "bs_gravity": "0,-0.02"}
    whole = checks.run(base, interval=0).report
    first = checks.run({**base, "bs_checkpoint": saved, "ts_max_steps": 15}, interval=0)
    rest = checks.run({"bs_restart": saved, "ts_max_steps": 5000}, interval=0).report
    checks.true("a run that is stopped short of its end says so", first.report["warnings"] == ["ended_early", JUMPS] and first.stdout.splitlines()[-1].endswith(" warnings=2"),
                str(first.report["warnings"]))
    same = ("warnings", "snap_through", "stable", "unstable", "inertia_changes")
    checks.true("continued it tells what the whole run tells", all(whole[key] == rest[key] for key in same), str([(whole[key], rest[key]) for key in same]))


def directions(checks, folder):
    """Paths on which the load factor alone says where forward is, and ends that lie behind the start."""
    # a mass on an anchor that swings to and fro: between two steps the place turns back, the load factor does not
    path = write_lattice(folder / "anchored.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=1.0, rest_length=1.0,
                         anchors={"particle": [1], "point": [[1.0]], "stiffness": [1.0], "rest_length": [0.0], "damping": [0.0]})
    swing = {**STATICS, "bs_lattice_file": path, "bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": 0.4, "bs_anchor_frequency": 1.3, "bs_load_control": "arc", "bs_load_steps": 40,
             "bs_arc_steps": 500}
    run = checks.run(swing, interval=0)
    s = run.trajectory.observables["load_factor"].ravel()
    checks.near("driven to and fro: places along the path", run.trajectory.position[:, 1, 0], 1 + 0.2 * np.sin(2.6 * np.pi * s), 1e-12)
    checks.true("the load factor grows all the way to 1", bool(np.all(np.diff(s) > 0)) and s[-1] == 1 and run.report["warnings"] == [], f"{len(s)} frames to {s[-1]:.6g}")
    for end, where in ((-0.01, "between the limit points"), (-0.03, "between the limit points")):
        run = checks.run({**STATICS, "bs_lattice_file": truss(folder), "bs_load_steps": 20, "bs_gravity": "0,-0.02", "bs_load_control": "arc", "bs_arc_end": end}, interval=0)
        h = run.trajectory.position[-1, 2, 1]
        checks.near(f"a path that ends at the load factor {end} is on its way back there", h, brentq(lambda h: load_of(h) - 0.02 * end, -0.17, 0.17, xtol=1e-15), 1e-10)
    pulled = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_fixed": "xmin", "bs_group_r": "xmax", "bs_motion_r": "velocity:2,0",
              "bs_load_control": "arc", "bs_arc_steps": 30}
    for end in (-1, 1e300):
        run = checks.run({**pulled, "bs_arc_end": end})
        checks.true(f"a path that never comes to the load factor {end:g} says so", run.report["warnings"] == [END] and run.stdout.splitlines()[-1].endswith(" warnings=1")
                    and ("-bs_arc_begin lower begins the other way" in run.stderr) == (end < 0), str(run.report["warnings"]))
    down = {"bs_load_control": "arc", "bs_arc_begin": "lower", "bs_arc_end": -1}
    run = checks.run({**STATICS, "bs_lattice_file": truss(folder), "bs_load_steps": 20, "bs_gravity": "0,-0.02", **down}, interval=0)
    s, h = run.trajectory.observables["load_factor"].ravel(), run.trajectory.position[:, 2, 1]
    checks.near("a path that begins by lowering the load factor: heights", h, [brentq(lambda h, s=s: load_of(h) - 0.02 * s, 0.2, 0.9, xtol=1e-15) for s in s], 1e-11)
    checks.true("and it falls all the way to its end", bool(np.all(np.diff(s) < 0)) and s[-1] == -1 and run.report["warnings"] == [], f"{len(s)} frames to {s[-1]:.6g}")
    run = checks.run({**STATICS, "bs_lattice_file": truss(folder), "bs_load_steps": 20, "bs_gravity": "0,-0.02", **down, "bs_arc_end": 1, "bs_arc_steps": 40}, interval=0)
    checks.true("one that cannot come to a positive end says so", run.report["warnings"] == [END] and "-bs_arc_begin raise begins the other way" in run.stderr, str(run.report["warnings"]))
    ends = [checks.run({**pulled, "bs_arc_steps": 1000, "bs_load_steps": 8, "bs_motion_r": motion, **more}, interval=0).trajectory.position[-1]
            for motion, more in (("velocity:-0.3,0.4", down), ("velocity:0.3,-0.4", {"bs_load_control": "load"}))]
    checks.near("a net that is pulled by a load factor of -1 is that of the reversed motion", ends[0], ends[1], 1e-12)
    run = checks.run({**STATICS, "bs_lattice_file": truss(folder), "bs_load_steps": 20, "bs_gravity": "0,-0.02", "bs_load_control": "arc", "bs_arc_steps": 30})
    checks.true("nor does one that is given too few steps", END in run.report["warnings"], str(run.report["warnings"]))
    run = checks.run({**pulled, "bs_load_steps": 5})
    checks.true("one that comes there does not", run.report["warnings"] == [], str(run.report["warnings"]))


if __name__ == "__main__":
    run_parts("stability", (counted, minima, searches, slightly, snaps, first_step, crossings), (iterative, not_looked_for, directions))
