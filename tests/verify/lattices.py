#!/usr/bin/env python3
"""Kagome, honeycomb and diamond lattices: springs, modes, moduli and motions without stiffness against nets that NumPy makes of other lattices by leaving
particles out, and against closed forms; nets with springs removed against dense matrices of the springs that are left, and the effective medium's moduli."""
import itertools

from harness import run_parts
import h5py
import numpy as np

H = np.sqrt(0.75)


def places(kind, n):
    """(N, d) particles of the unit spacing and the edges of the box of n cells: of the triangular lattice a fourth (kagome) or a third (honeycomb, turned by
    a right angle) is left out; diamond: two face-centred cubes."""
    if kind == "diamond":
        half = [p for p in itertools.product(*(range(2 * k) for k in n)) if sum(p) % 2 == 0]
        return np.array([np.array(p) / 2 + a for p in half for a in (0, 0.25)]), np.array(n, float)
    edges = np.array([2 * n[0], 4 * H * n[1]] if kind == "kagome" else [2 * H * n[0], 3 * n[1]])
    wide, high = edges if kind == "kagome" else edges[::-1]
    x = []
    for j in range(round(high / H)):
        for i in range(round(wide)):
            i -= j // 2  # the rows of a rectangle
            if (i % 2 and j % 2) if kind == "kagome" else (i - j) % 3 == 0:
                continue
            x.append((i + j / 2, j * H))
    return np.array(x) if kind == "kagome" else np.array(x)[:, ::-1], edges


def bonds(x, edges, shells):
    """Ends, ways from the first to the second, and shell of all springs."""
    d, rows = x.shape[1], []
    for k in itertools.product((-1, 0, 1), repeat=d):
        r = x[None] + np.array(k) * edges - x[:, None]
        length = np.linalg.norm(r, axis=2)
        for s, wanted in enumerate(shells):
            i, j = np.nonzero(abs(length - wanted) < 1e-9)
            rows += [(a, b, s, *r[a, b]) for a, b in zip(i, j) if (a, tuple(-c for c in k)) < (b, k)]
    rows = np.array(rows)
    return rows[:, :2].astype(int), rows[:, 3:], rows[:, 2].astype(int)


def tangent(n, pairs, r, k):
    """H_ee, H_eu, H_uu of springs at rest, strains in the order of the program, then displacements."""
    d = r.shape[1]
    components = [(0, 0), (1, 1), (0, 1)] if d == 2 else [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    unit = r / np.linalg.norm(r, axis=1)[:, None]
    A = np.zeros((len(r), len(components) + n * d))
    for a, (p, q) in enumerate(components):
        A[:, a] = unit[:, p] * r[:, q]
    for c in range(d):
        np.add.at(A, (np.arange(len(r)), len(components) + d * pairs[:, 1] + c), unit[:, c])
        np.add.at(A, (np.arange(len(r)), len(components) + d * pairs[:, 0] + c), -unit[:, c])
    T = A.T @ (np.asarray(k)[:, None] * A)
    q = len(components)
    return T[:q, :q], T[:q, q:], T[q:, q:]


def stiffness(n, pairs, r, k, volume):
    """The stiffness tensor, all particles relaxed, and the number of motions without stiffness beyond the translations."""
    ee, eu, uu = tangent(n, pairs, r, k)
    omega = np.linalg.eigvalsh(uu)
    return (ee - eu @ np.linalg.pinv(uu, rcond=1e-12, hermitian=True) @ eu.T) / volume, int(np.sum(omega < 1e-9 * max(omega[-1], 1e-300))) - r.shape[1]


SHELLS = {("kagome", 4): (1,), ("kagome", 8): (1, 2 * H), ("honeycomb", 3): (1,), ("honeycomb", 9): (1, 2 * H), ("honeycomb", 12): (1, 2 * H, 2),
          ("diamond", 4): (H / 2,), ("diamond", 16): (H / 2, np.sqrt(0.5))}


def generated(kind, neighbors, n, **more):
    return {"bs_lattice_type": kind, "bs_lattice_neighbors": neighbors, "bs_lattice_size": ",".join(map(str, n)), "bs_lattice_periodic": "xyz"[:len(n)],
            "bs_lattice_stiffness": "1,0.3,0.1", "bs_lattice_spacing": 1, **more}


def nets(checks, folder):
    for (kind, neighbors), shells in SHELLS.items():
        n = (3, 2) if kind != "diamond" else (2, 2, 2)
        x, edges = places(kind, n)
        pairs, r, shell = bonds(x, edges, shells)
        checks.true(f"{kind}, {neighbors}: as many neighbours everywhere", set(np.bincount(pairs.ravel(), minlength=len(x))) == {neighbors})
        k = np.array([1, 0.3, 0.1])[shell]
        C, floppy = stiffness(len(x), pairs, r, k, np.prod(edges))
        got = checks.run({**generated(kind, neighbors, n), "bs_task": "moduli"}).report
        checks.near(f"{kind}, {neighbors}: stiffness", got["stiffness"], C, 1e-12)
        checks.true(f"{kind}, {neighbors}: motions without stiffness", got["zero_modes"] == floppy, f"{got['zero_modes']}, numpy {floppy}")
        run = checks.run({**generated(kind, neighbors, n), "bs_task": "modes", "bs_modes": x.size, "bs_modes_rigid": "keep", "bs_output": "m.h5md"}, keep=("m.h5md",))
        (folder / "m.h5md").write_bytes(run.files["m.h5md"])
        with h5py.File(folder / "m.h5md") as f:
            checks.near(f"{kind}, {neighbors}: every mode", f["modes/omega_squared"][...], np.linalg.eigvalsh(tangent(len(x), pairs, r, k)[2]), 1e-11)


def closed_forms(checks, folder):
    """Springs k = 1 between nearest neighbours at rest. Kagome deforms affinely: B = sqrt(3)/4, G = sqrt(3)/8. Honeycomb resists only the change of its area, B = 1/(2 sqrt(3)),
    diamond (cube of edge 1) only that of its volume, B = 1/3."""
    G = np.sqrt(3) / 8
    for kind, n, exact in (("kagome", (5, 4), [[3 * G, G, 0], [G, 3 * G, 0], [0, 0, G]]), ("honeycomb", (5, 4), np.pad(np.full((2, 2), 1 / np.sqrt(12)), (0, 1))),
                           ("diamond", (3, 2, 4), np.pad(np.full((3, 3), 1 / 3), (0, 3)))):
        got = checks.run({**generated(kind, 0, n), "bs_task": "moduli"}).report["stiffness"]
        checks.near(f"{kind}: stiffness", got, exact, 1e-12)


TRIANGLES = {"bs_lattice_type": "triangular", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1, "bs_lattice_spacing": 1}


def springs_of(checks, folder, options, **more):
    """The report, and particles, pairs, ways and stiffness of the springs at the start of a run."""
    run = checks.run({**options, "bs_output": "r.h5md"}, keep=("r.h5md",), **more)
    (folder / "r.h5md").write_bytes(run.files["r.h5md"])
    with h5py.File(folder / "r.h5md") as f:
        x, order = f["particles/trajectory/position/value"][0], np.argsort(f["particles/trajectory/id"][...])
        if "connectivity" not in f:
            return run.report, x[order], np.zeros((0, 2), int), np.zeros((0, x.shape[1])), np.zeros(0)
        pairs, k = f["connectivity/bonds"][...], f["connectivity/bonds_stiffness"][...]
        edges = f["particles/trajectory/box/edges/value"][0] if "connectivity/bonds_shift" in f else None
        shift = f["connectivity/bonds_shift"][...] if edges is not None else 0
    x = x[order]
    r = x[pairs[:, 1]] - x[pairs[:, 0]] + (shift @ (np.diag(edges) if edges.ndim == 1 else edges) if edges is not None else 0)
    return run.report, x, pairs, r, k


def removed(checks, folder):
    """Springs that are removed are not there: exactly as many as asked for, and the moduli are those of the rest."""
    for net, springs in (({**TRIANGLES, "bs_lattice_size": "10,10"}, 300), ({**generated("kagome", 8, (3, 2))}, 6 * 3 * 2 * 4), ({**generated("diamond", 16, (2, 2, 2))}, 64 * 8)):
        kind = net["bs_lattice_type"]
        for fraction in (0.1, 0.3, 1):
            options = {**net, "bs_lattice_remove_fraction": fraction, "bs_lattice_seed": 5, "bs_task": "moduli"}
            report, x, pairs, r, k = springs_of(checks, folder, options, ranks=1)
            checks.true(f"{kind}, {fraction} removed: springs", len(pairs) == springs - round(fraction * springs), str(len(pairs)))
            on_3 = springs_of(checks, folder, options, ranks=3)
            checks.true(f"{kind}, {fraction} removed: the same springs on three ranks", np.array_equal(on_3[2], pairs) and np.array_equal(on_3[3], r))
            if len(pairs) == 0:
                checks.true(f"{kind}: nothing left is stiff", not np.any(report["stiffness"]))
                continue
            with h5py.File(folder / "r.h5md") as f:
                edges = f["particles/trajectory/box/edges/value"][-1]
            C, floppy = stiffness(len(x), pairs, r, k, abs(np.prod(edges) if edges.ndim == 1 else np.linalg.det(edges)))
            checks.near(f"{kind}, {fraction} removed: stiffness", report["stiffness"], C, 1e-9)
            checks.true(f"{kind}, {fraction} removed: motions without stiffness", report["zero_modes"] == floppy, f"{report['zero_modes']}, numpy {floppy}")
    said = checks.run({**TRIANGLES, "bs_lattice_size": "10,10", "bs_lattice_remove_fraction": 0.25, "bs_task": "moduli"}).stdout
    checks.true("the header says how many", "75 of 300 springs removed (0.25)" in said)


def pruned(checks, folder):
    """What is pruned bears nothing: the stiffness is that of the whole net, its motions without stiffness are gone; dangling ends and rattlers by a search in NumPy."""
    for net, fraction in (({**TRIANGLES, "bs_lattice_size": "16,16"}, 0.34), (generated("diamond", 16, (3, 3, 3)), 0.6)):
        kind = net["bs_lattice_type"]
        options = {**net, "bs_lattice_remove_fraction": fraction, "bs_lattice_seed": 2, "bs_task": "moduli"}
        whole, x, pairs, r, k = springs_of(checks, folder, options)
        for rule in ("dangling", "rattlers"):
            stay = np.ones(len(x), bool)
            while True:
                there = stay[pairs].all(axis=1)
                go = []
                for p in np.flatnonzero(stay):
                    ways = r[there & (pairs == p).any(axis=1)]
                    bears = len(ways) > 1 if rule == "dangling" else len(ways) and np.linalg.matrix_rank(ways) < len(ways)
                    go += [] if bears else [p]
                if not go:
                    break
                stay[go] = False
            report, y, left, ways, stiff = springs_of(checks, folder, {**options, "bs_lattice_prune": rule})
            checks.true(f"{kind}, {rule}: {len(x) - stay.sum()} of {len(x)} particles", np.array_equal(y, x[stay]) and (stay.sum() < len(x) or rule == "dangling"), str(len(y)))
            checks.true(f"{kind}, {rule}: the springs of the rest", np.array_equal(ways, r[there]))
            checks.near(f"{kind}, {rule}: the stiffness of the net", report["stiffness"], whole["stiffness"], 1e-9)
            floppy = whole["zero_modes"] - int(x.shape[1] * (len(x) - stay.sum()) - (~there).sum())
            checks.true(f"{kind}, {rule}: fewer motions without stiffness", report["zero_modes"] == floppy, f"{report['zero_modes']} of {whole['zero_modes']}")


def motion(checks, folder):
    """Diluted and pruned nets in motion: the same from ranks to ranks, and bit for bit when a run goes on from its checkpoint."""
    net = {"bs_lattice_type": "triangular", "bs_lattice_size": "12,12", "bs_lattice_dim": 2, "bs_lattice_stiffness": 100, "bs_lattice_spacing": 1, "bs_lattice_fixed": "ymax",
           "bs_lattice_remove_fraction": 0.3, "bs_lattice_prune": "rattlers", "bs_lattice_perturbation": 0.05, "bs_break_strain": 0.4, "bs_gravity": "0,-1",
           "ts_type": "rk", "ts_dt": 0.01}
    one = checks.run({**net, "ts_max_time": 1}, interval=0.5, ranks=1).trajectory
    three = checks.run({**net, "ts_max_time": 1}, interval=0.5, ranks=3).trajectory
    checks.near("on three ranks", three.position[-1], one.position[-1], 1e-10)
    half = checks.run({**net, "ts_max_time": 0.5, "bs_checkpoint": "c.h5"}, keep=("c.h5",))
    (folder / "c.h5").write_bytes(half.files["c.h5"])
    on = checks.run({"bs_restart": folder / "c.h5", "ts_max_time": 1}, interval=0.5).trajectory
    straight = checks.run({**net, "ts_max_time": 1}, interval=0.5).trajectory
    checks.true("continued from a checkpoint", np.array_equal(on.position[-1], straight.position[-1]))


def without_stiffness(checks, folder):
    """Springs without stiffness and damper are none: forces, equilibria and the work of factors are those of the net without them."""
    net = {**TRIANGLES, "bs_lattice_size": "12,12", "bs_lattice_stiff_fraction": 0.2, "bs_lattice_stiff_factor": 0, "bs_lattice_seed": 3}
    whole = folder / "whole.h5"
    whole.write_bytes(checks.run({**net, "bs_task": "generate", "bs_output": "l.h5"}, keep=("l.h5",)).files["l.h5"])
    less = folder / "less.h5"
    less.write_bytes(whole.read_bytes())
    with h5py.File(less, "r+") as f:
        there = f["springs/stiffness"][:] > 0
        for name, rows in [(name, f["springs"][name][:]) for name in f["springs"]]:
            if rows.shape[:1] == there.shape:
                del f["springs"][name]
                f["springs"][name] = rows[there]
    checks.true("some are without stiffness", 0.1 < np.mean(~there) < 0.3, str(np.mean(there)))
    for name, more in (("sheared", {"bs_task": "statics", "bs_box_strain": "xy=velocity:0.1", "bs_load_steps": 4}),
                       ("in motion", {"bs_gravity": "0,-1", "ts_dt": 0.1, "ts_max_time": 1, "bs_box_strain": "xy=velocity:0.1"})):
        with_them, without = (checks.run({**more, "bs_lattice_file": path, "bs_lattice_periodic": "xy", "snes_rtol": 1e-11}, interval=0) for path in (whole, less))
        checks.near(f"{name}: places", with_them.trajectory.position[-1], without.trajectory.position[-1], 1e-8)
        said, same = (run.report["solver"].split("; KSP")[1] for run in (with_them, without))
        checks.true(f"{name}: factors", said == same and "Mflop" in said, f"{said}, {same}")


def effective_medium(checks, folder):
    """G/G_0 = 3 (p - 2/3) where p of the springs are left, G_0 = sqrt(3)/4: the mean of four nets of 40 x 40; below the threshold, 0.66, no stiffness."""
    for p, room in ((0.9, 0.02), (0.8, 0.03), (0.7, 0.05)):
        ratios = [checks.run({**TRIANGLES, "bs_task": "moduli", "bs_lattice_size": "40,40", "bs_lattice_remove_fraction": 1 - p, "bs_lattice_seed": seed}).report["stiffness"][2][2]
                  / (np.sqrt(3) / 4) for seed in (1, 2, 3, 4)]
        checks.near(f"p = {p}: G/G_0", np.mean(ratios), 3 * p - 2, room)
    for seed in (1, 2, 3, 4):
        C = checks.run({**TRIANGLES, "bs_task": "moduli", "bs_lattice_size": "40,40", "bs_lattice_remove_fraction": 0.38, "bs_lattice_seed": seed}).report["stiffness"]
        checks.below(f"p = 0.62, net {seed}: no stiffness", np.abs(C).max(), 1e-6)


if __name__ == "__main__":
    run_parts(__doc__, (nets, closed_forms, removed, pruned, motion, without_stiffness), on_one_rank=(effective_medium,))
