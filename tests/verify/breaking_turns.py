#!/usr/bin/env python3
"""Angle springs and hinges that break: closed forms at their limits, a beam torn in statics and one in motion beside programs of their own in numpy and
scipy, what follows springs that break, restarts, lattices read back, the same bits on any number of ranks."""
import math

from breaking import ran
import h5py
from harness import run_parts, write_lattice
import numpy as np
from restart import compare
from scipy.optimize import brentq, minimize

TIE = 1e-9


def events(folder, kind, name="b.h5md"):
    with h5py.File(folder / name) as f:
        return {key: value[...] for key, value in f[f"events/broken_{kind}"].items()} if f"events/broken_{kind}" in f else {}


def put(file, group, **columns):
    with h5py.File(file, "a") as f:
        for name, value in columns.items():
            f[f"{group}/{name}"] = value


def series(seed, stream, count, modulus):
    """The factors of the interactions of a kind: numbers of the documented generator, the last counter 1 + kind."""
    mask = (1 << 64) - 1

    def mix(z):
        z = (z + 0x9E3779B97F4A7C15) & mask
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        return z ^ (z >> 31)
    u = [(mix((mix((mix((mix(seed) + 3) & mask) + row) & mask) + stream) & mask) >> 11) * 2.0**-53 for row in range(count)]
    return np.array([(-math.log1p(-one)) ** (1 / modulus) for one in u])


def three_points(checks, folder):
    """A straight beam of two springs and an angle spring, both ends held, under its own weight P: E(w) = k (l - 1)^2 + kappa/2 (2 atan w)^2, l^2 = 1 + w^2,
    in equilibrium at P = E'(w). It breaks at 2 atan w = c, w_c = tan(c/2), and hangs by its springs then."""
    k, kappa, c = 3.0, 2.0, 0.4
    w = math.tan(c / 2)
    springs = lambda w: 2 * k * (1 - 1 / math.sqrt(1 + w * w)) * w
    load = springs(w) + kappa * 2 * math.atan(w) * 2 / (1 + w * w)
    file = write_lattice(folder / "l.h5", [[-1, 0], [0, 0], [1, 0]], 1.0, fixed=[1, 0, 1], pairs=[[0, 1], [1, 2]], stiffness=k,
                         angles={"triples": [[0, 1, 2]], "stiffness": kappa, "rest_angle": math.pi})
    for limit, value in (("change", c), ("moment", kappa * c), ("energy", kappa * c * c / 2)):
        for part in (0.999, 1.001):
            options = {"bs_task": "statics", "bs_load_steps": 1, "bs_lattice_file": str(file), "bs_gravity": (0, -part * load), f"bs_break_angle_{limit}": value}
            result = ran(checks, folder, options)
            found, breaks = events(folder, "angles"), part > 1
            name = f"{limit}, {part} of the load"
            checks.true(f"{name}: {'breaks' if breaks else 'holds'}", len(found.get("angle", [])) == int(breaks) and result.report["broken_angles"] == int(breaks))
            with h5py.File(folder / "b.h5md") as f:
                y = -f["particles/trajectory/position/value"][-1, 1, 1]
                flag, energy = f["backspring/broken_angles/value"][-1], f["observables/broken_energy/value"][-1]
            force = springs(y) + (0 if breaks else kappa * 2 * math.atan(y) * 2 / (1 + y * y))
            checks.near(f"{name}: in equilibrium with what is whole", force, part * load, 1e-7 * load)
            checks.true(f"{name}: the flag", list(flag) == [int(breaks)])
            if breaks:
                at = brentq(lambda w: springs(w) + kappa * 2 * math.atan(w) * 2 / (1 + w * w) - part * load, 0, 2)
                turn = -2 * math.atan(at)  # below: the angle, counted from the first arm to the second, is more or less than pi
                checks.near(f"{name}: change of the angle", abs(found["change"][0]), abs(turn), 1e-8)
                checks.near(f"{name}: energy", energy, kappa * turn**2 / 2, 1e-8)
                checks.true(f"{name}: ends, row, avalanche", list(found["ends"][0]) == [0, 1, 2] and found["angle"][0] == 0 and found["avalanche"][0] == 0)
    steps = 10
    ran(checks, folder, {"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": str(file), "bs_gravity": (0, -1.3 * load), "bs_break_angle_change": c})
    checks.near("the load at which it breaks", events(folder, "angles")["load"][0], math.ceil(steps / 1.3) / steps, 1e-12)


def two_triangles(checks, folder):
    """A hinge of two triangles, one of them held, a load P across the flat sheet at the free corner: at the angle theta and the distance r from the edge
    kappa theta = P r cos theta and 2 k (1 - L/l) r = P sin theta, l^2 = r^2 + 1/4."""
    k, kappa, c, r0 = 50.0, 2.0, 0.3, math.sqrt(0.75)
    pull = lambda r: 2 * k * (1 - 1 / math.hypot(r, 0.5)) * r
    r = brentq(lambda r: pull(r) - kappa * c * math.tan(c) / r, r0, 2)
    load = kappa * c / (r * math.cos(c))
    x = [[0, 0, 0], [1, 0, 0], [0.5, -r0, 0], [0.5, r0, 0]]
    file = write_lattice(folder / "l.h5", x, 1.0, fixed=[1, 1, 1, 0], pairs=[[0, 1], [0, 2], [1, 2], [0, 3], [1, 3]], stiffness=k, rest_length=1.0)
    put(file, "hinges", quads=[[1, 0, 2, 3]], stiffness=[kappa], rest_angle=[0.0])
    for limit, value in (("change", c), ("moment", kappa * c), ("energy", kappa * c * c / 2)):
        for sense in (1, -1):
            for part in (0.999, 1.001):
                ran(checks, folder, {"bs_task": "statics", "bs_load_steps": 1, "bs_lattice_file": str(file), "bs_gravity": (0, 0, sense * part * load),
                                     f"bs_break_hinge_{limit}": value})
                found = events(folder, "hinges")
                checks.true(f"{limit}, sense {sense}, {part} of the load", len(found.get("hinge", [])) == int(part > 1))
                if part > 1:
                    checks.below(f"{limit}, sense {sense}: the angle at which it broke", abs(abs(found["change"][0]) - c), 2e-3 * c)
                    checks.true(f"{limit}, sense {sense}: ends", list(found["ends"][0]) == [1, 0, 2, 3])
                    with h5py.File(folder / "b.h5md") as f:
                        end = f["particles/trajectory/position/value"][-1, 3]
                    # it hangs from the edge: 2 k (1 - 1/l) r = P
                    checks.near(f"{limit}, sense {sense}: hangs from the edge", end, [0.5, 0, sense * brentq(lambda r: pull(r) - part * load, r0, 3)], 1e-5)


class Beam:
    """Points in the plane with Hooke springs between neighbours and angle springs at rest where they are straight."""

    def __init__(self, n, k, kappa):
        self.x, self.k, self.kappa = np.column_stack([np.arange(n, dtype=float), np.zeros(n)]), k, np.full(n - 2, kappa)

    def turns(self, x):
        a, b = x[:-2] - x[1:-1], x[2:] - x[1:-1]
        return np.arctan2(-(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), -(a * b).sum(1)), a, b

    def energy(self, x):
        return 0.5 * self.k * ((np.linalg.norm(np.diff(x, axis=0), axis=1) - 1) ** 2).sum() + 0.5 * (self.kappa * self.turns(x)[0] ** 2).sum()

    def force(self, x):
        r = np.diff(x, axis=0)
        l = np.linalg.norm(r, axis=1)[:, None]
        pull = self.k * (l - 1) * r / l
        f = np.zeros_like(x)
        f[:-1] += pull
        f[1:] -= pull
        turn, a, b = self.turns(x)
        across = lambda v: np.column_stack([-v[:, 1], v[:, 0]]) / (v * v).sum(1)[:, None]
        moment = (self.kappa * turn)[:, None]  # d turn = across(b).db - across(a).da
        fa, fb = moment * across(a), -moment * across(b)
        f[:-2] += fa
        f[2:] += fb
        f[1:-1] -= fa + fb
        return f


def torn_in_motion(checks, folder):
    """A clamped beam in flight by velocity Verlet: which angle springs break after which step, with scatter, and where its points are."""
    n, h, steps = 12, 0.02, 400
    beam = Beam(n, 20.0, 1.5)
    rng = np.random.default_rng(4)
    x, v = beam.x.copy(), 0.35 * rng.standard_normal((n, 2))
    v[:2] = 0
    difference = [(beam.energy(x + d) - beam.energy(x - d)) / 2e-6 + (beam.force(x) * d / 1e-6).sum()
                  for d in 1e-6 * rng.standard_normal((3, n, 2)) for x in [beam.x + 0.1 * rng.standard_normal((n, 2))]]
    checks.below("the reference's force is that of its energy", max(map(abs, difference)), 1e-6)
    file = write_lattice(folder / "l.h5", beam.x, 1.0, velocity=v, fixed=np.arange(n) < 2, pairs=np.column_stack([np.arange(n - 1), np.arange(1, n)]), stiffness=beam.k,
                         rest_length=1.0, angles={"triples": np.column_stack([np.arange(n - 2), np.arange(1, n - 1), np.arange(2, n)]), "stiffness": 1.5, "rest_angle": math.pi})
    limit = 0.3 * series(9, 1, n - 2, 3.0)
    order, lost = [], 0.0
    f = beam.force(x)
    for s in range(1, steps + 1):
        half = v + 0.5 * h * f
        half[:2] = 0
        x = x + h * half
        f = beam.force(x)
        v = half + 0.5 * h * f
        v[:2] = 0
        turn = beam.turns(x)[0]
        for row in np.flatnonzero((beam.kappa > 0) & (np.abs(turn) >= limit * (1 - TIE))):
            lost += 0.5 * beam.kappa[row] * turn[row] ** 2
            beam.kappa[row] = 0
            order.append((row, s))
        f = beam.force(x)
    result = ran(checks, folder, {"ts_type": "verlet", "ts_dt": h, "ts_max_time": steps * h, "bs_output_interval": 1.0, "bs_lattice_file": str(file), "bs_break_angle_change": 0.3,
                                  "bs_break_weibull": "3,9"})
    found = events(folder, "angles")
    checks.true("rows in the order in which they break", list(found["angle"]) == [row for row, _ in order] and len(order) >= 3, f"{order}")
    checks.near("when", found["time"], np.array([s for _, s in order]) * h, 1e-9)
    with h5py.File(folder / "b.h5md") as f:
        checks.near("points at the end", f["particles/trajectory/position/value"][-1], x, 1e-9)
        checks.near("energy of what broke", f["observables/broken_energy/value"][-1], lost, 1e-10)
        checks.near("limits in the trajectory", f["connectivity/angles_threshold_change"][...], limit, 1e-14)
        flags = f["backspring/broken_angles/value"][-1]
    checks.true("flags", list(np.flatnonzero(flags)) == sorted(row for row, _ in order))
    checks.true("the report counts", result.report["broken_angles"] == len(order))
    ran(checks, folder, {"ts_type": "verlet", "ts_dt": h, "ts_max_time": 2 * h, "bs_lattice_file": str(folder / "b.h5md")}, name="again.h5md")
    with h5py.File(folder / "again.h5md") as f:
        checks.true("read back, what is broken is broken", (f["backspring/broken_angles/value"][0] == flags).all())
        checks.near("and bears nothing", f["observables/elastic_energy/value"][0], beam.energy(x), 1e-9)


def torn_in_statics(checks, folder):
    """A beam between held ends under its weight: one angle spring at a time, the next equilibrium by scipy, until nothing breaks; the same avalanches."""
    n, steps = 9, 4
    beam = Beam(n, 40.0, 4.0)
    limit = 0.1 * series(2, 1, n - 2, 6.0)
    file = write_lattice(folder / "l.h5", beam.x, 1.0, fixed=(np.arange(n) == 0) | (np.arange(n) == n - 1), pairs=np.column_stack([np.arange(n - 1), np.arange(1, n)]),
                         stiffness=beam.k, rest_length=1.0,
                         angles={"triples": np.column_stack([np.arange(n - 2), np.arange(1, n - 1), np.arange(2, n)]), "stiffness": 4.0, "rest_angle": math.pi})
    g, order, sizes = 1.5, [], []
    x = beam.x.copy()

    def settle(x, load):
        def cost(z):
            at = x.copy()
            at[1:-1] = z.reshape(-1, 2)
            return beam.energy(at) + load * at[1:-1, 1].sum(), (-beam.force(at)[1:-1] + [0, load]).ravel()
        at = x.copy()
        at[1:-1] = minimize(cost, x[1:-1].ravel(), jac=True, method="BFGS", options={"gtol": 1e-9, "maxiter": 2000}).x.reshape(-1, 2)
        return at
    for s in range(1, steps + 1):
        size = 0
        x = settle(x, g * s / steps)
        while True:
            excess = np.where(beam.kappa > 0, np.abs(beam.turns(x)[0]) / limit, 0)
            if excess.max() < 1:
                break
            row = int(excess.argmax())
            order.append((row, s))
            beam.kappa[row] = 0
            size += 1
            x = settle(x, g * s / steps)
        if size:
            sizes.append(size)
    options = {"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": str(file), "bs_gravity": (0, -g), "bs_break_angle_change": 0.1, "bs_break_weibull": "6,2",
               "bs_break": "worst", "snes_rtol": 1e-12}
    result = ran(checks, folder, options)
    found = events(folder, "angles")
    checks.true("the same rows in the same order", list(found["angle"]) == [row for row, _ in order] and len(order) >= 4, f"{order}")
    checks.near("at the same loads", found["load"], np.array([s for _, s in order]) / steps, 1e-12)
    checks.true("the same avalanches", list(np.bincount(found["avalanche"])) == sizes and max(sizes) > 1, f"{sizes}")
    checks.true("the largest one in the report", result.report["largest_avalanche"] == max(sizes))
    with h5py.File(folder / "b.h5md") as f:
        checks.near("the last equilibrium", f["particles/trajectory/position/value"][-1], x, 1e-5)


def sheet(n):
    """A sheet of 2 n^2 triangles, its springs and hinges."""
    from hinges import hinges_of
    at = lambda i, j: (n + 1) * j + i
    x = np.array([[i + 0.5 * j, j * math.sqrt(0.75), 0] for j in range(n + 1) for i in range(n + 1)])
    triangles = [t for j in range(n) for i in range(n) for t in ((at(i, j), at(i + 1, j), at(i, j + 1)), (at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)))]
    pairs = np.array(sorted({tuple(sorted(e)) for a, b, c in triangles for e in ((a, b), (b, c), (c, a))}))
    return x, pairs, hinges_of(triangles)


def flying_sheet(folder, columns=()):
    x, pairs, quads = sheet(6)
    v = 0.25 * np.random.default_rng(8).standard_normal(x.shape)
    file = write_lattice(folder / "sheet.h5", x, 1.0, velocity=v, fixed=x[:, 1] == 0, pairs=pairs, stiffness=8.0, rest_length=1.0, damping=0.05)
    put(file, "hinges", quads=quads, stiffness=np.full(len(quads), 0.4), rest_angle=np.zeros(len(quads)), **dict(columns))
    return file, pairs, quads


MOTION = {"ts_dt": 0.02, "ts_max_time": 2.0, "bs_output_interval": 0.5, "bs_break_hinge_moment": 0.2, "bs_break_weibull": "4,5", "bs_break_strain": 0.2}


def same_bits(checks, folder):
    """Explicit motion of a sheet that loses hinges and springs, on 1, 2 and 3 ranks, in every bit; limits of the file take precedence."""
    file, _, _ = flying_sheet(folder, {"critical_change": np.where(np.arange(len(sheet(6)[2])) % 3 == 0, np.inf, 0.5)}.items())
    seen = []
    for ranks in (1, 2, 3):
        result = ran(checks, folder, {**MOTION, "ts_type": "verlet", "bs_lattice_file": str(file), "bs_break_with_springs": True}, name=f"{ranks}.h5md", ranks=ranks)
        with h5py.File(folder / f"{ranks}.h5md") as f:
            seen.append({name: f[name][...] for name in ("particles/trajectory/position/value", "backspring/broken_hinges/value", "backspring/broken/value")}
                        | {f"{group}/{key}": value[...] for group in ("broken", "broken_hinges") for key, value in f[f"events/{group}"].items()})
    for ranks, other in ((2, seen[1]), (3, seen[2])):
        differ = [name for name in seen[0] if seen[0][name].tobytes() != other[name].tobytes()]
        checks.true(f"{ranks} ranks", not differ, f"{differ}")
    numbers = np.concatenate([seen[0]["broken/number"], seen[0]["broken_hinges/number"]])
    checks.true("both kinds break, and are numbered through", len(seen[0]["broken/number"]) > 3 and len(seen[0]["broken_hinges/number"]) > 3
                and sorted(numbers) == list(range(len(numbers))), f"{len(seen[0]['broken/number'])} springs, {len(seen[0]['broken_hinges/number'])} hinges")
    checks.true("the report counts them", result.report["broken_springs"] + result.report["broken_hinges"] == len(numbers))


def follow(checks, folder):
    """With springs: a hinge is broken from the moment on at which the first spring along a side of its triangles is. Without: none is."""
    file, pairs, quads = flying_sheet(folder)
    row = {tuple(pair): k for k, pair in enumerate(pairs)}
    sides = [[row[tuple(sorted((q[a], q[b])))] for a, b in ((0, 1), (0, 2), (1, 2), (0, 3), (1, 3))] for q in quads]
    base = {"ts_type": "verlet", "ts_dt": 0.02, "ts_max_time": 2.0, "bs_output_interval": 0.25, "bs_lattice_file": str(file), "bs_break_strain": 0.1}
    ran(checks, folder, {**base, "bs_break_with_springs": True})
    with h5py.File(folder / "b.h5md") as f:
        springs, hinges = f["backspring/broken/value"][...] > 0, f["backspring/broken_hinges/value"][...] > 0
        spring_at = dict(zip(f["events/broken/spring"][...], f["events/broken/time"][...]))
        hinge_at = dict(zip(f["events/broken_hinges/hinge"][...], f["events/broken_hinges/time"][...]))
    expected = np.array([[any(frame[side]) for side in sides] for frame in springs])
    checks.true("in every frame", (hinges == expected).all() and springs[-1].sum() > 3 and not hinges[-1].all(), f"{springs[-1].sum()} springs, {hinges[-1].sum()} hinges")
    checks.true("at the same times", all(hinge_at[h] == min(spring_at[s] for s in sides[h] if s in spring_at) for h in hinge_at))
    ran(checks, folder, base)
    with h5py.File(folder / "b.h5md") as f:
        checks.true("unless asked for, hinges bear on", "broken_hinges" not in f["backspring"] and "broken_hinges" not in f["events"] and f["backspring/broken/value"][-1].sum() > 3)
    # springs that are broken from the start
    put(file, "springs", broken=(np.arange(len(pairs)) == 7).astype(float))
    ran(checks, folder, {**base, "bs_break_strain": None, "bs_break_with_springs": True, "ts_max_time": 0.1})
    with h5py.File(folder / "b.h5md") as f:
        checks.true("those along springs that are broken from the start", list(np.flatnonzero(f["backspring/broken_hinges/value"][0])) == [h for h, s in enumerate(sides) if 7 in s])


def spared(checks, folder):
    """Interactions with an end in a spared group do not break."""
    file, _, quads = flying_sheet(folder)
    group = [3, 17]
    put(file, "groups", kept=group)
    options = {"ts_type": "verlet", "ts_dt": 0.02, "ts_max_time": 3.0, "bs_output_interval": 1.0, "bs_lattice_file": str(file), "bs_break_hinge_energy": 1e-3}
    for name, more in (("all", {}), ("spared", {"bs_break_spare": "kept"})):
        ran(checks, folder, {**options, **more})
        touched = np.isin(quads, group).any(axis=1)[events(folder, "hinges")["hinge"]]
        checks.true(f"{name}: {'some' if name == 'all' else 'none'} of the group break", touched.any() == (name == "all") and len(touched) > 20, f"{touched.sum()} of {len(touched)}")


def continued(checks, folder):
    file, _, _ = flying_sheet(folder)
    for kind in ("verlet", "beuler"):
        compare(checks, folder, kind, {**MOTION, "ts_dt": 0.1, "ts_type": kind, "bs_lattice_file": str(file), "bs_break_with_springs": True}, (6, None))
    n = 9
    beam = write_lattice(folder / "beam.h5", Beam(n, 1, 1).x, 1.0, fixed=(np.arange(n) == 0) | (np.arange(n) == n - 1), pairs=np.column_stack([np.arange(n - 1), np.arange(1, n)]),
                         stiffness=40.0, rest_length=1.0,
                         angles={"triples": np.column_stack([np.arange(n - 2), np.arange(1, n - 1), np.arange(2, n)]), "stiffness": 4.0, "rest_angle": math.pi})
    pull = {"bs_task": "statics", "bs_load_steps": 8, "bs_lattice_file": str(beam), "bs_gravity": (0, -1.5), "bs_break_angle_change": 0.25, "bs_break_weibull": "6,2", "bs_break": "worst"}
    for name, options in (("statics", {}), ("motions after breaks", {"bs_break_follow": "dynamics"})):
        compare(checks, folder, name, {**pull, **options}, (3, None))


if __name__ == "__main__":
    run_parts(__doc__, (three_points, two_triangles, torn_in_motion, torn_in_statics, same_bits, follow, spared, continued))
