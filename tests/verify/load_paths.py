#!/usr/bin/env python3
"""Load paths of -bs_task statics against closed forms: springs in series and a lattice beam that yield, unload and yield the other way, loads and motions that the load factor
scales or leaves alone, and the signs of the pivots along the path of a column through its buckling loads."""
import io

import h5py
import numpy as np
from harness import run_parts, write_lattice
from scipy.optimize import brentq


class Series:
    """Elastic-plastic springs in series. With the force P, |P - H e| <= Y: e is moved as little as that needs, and s = P/k + e."""

    def __init__(self, k, Y, H):
        self.k, self.Y, self.H = k, Y, H
        self.e, self.lost = np.zeros(len(k)), 0.0

    def stretches(self, P):
        return P / self.k + np.clip(self.e, (P - self.Y) / self.H, (P + self.Y) / self.H)

    def pull(self, total):
        """The force at this total stretch, and what each spring bears of it."""
        P = brentq(lambda force: self.stretches(force).sum() - total, -100, 100, xtol=1e-15, rtol=1e-15)
        s = self.stretches(P)
        before, self.e = self.e, s - P / self.k
        self.lost += np.sum(self.Y * np.abs(self.e - before))
        return P, s


def plastic(checks, folder):
    """Four springs in series, whose end is pulled past the yield forces, pushed back past them and pulled again, in 40 load steps."""
    rng, n, steps = np.random.default_rng(6), 4, 40
    k, Y, H = rng.uniform(50, 100, n), rng.uniform(1, 3, n), rng.uniform(5, 30, n)
    at = np.arange(n + 1)
    path = write_lattice(folder / "series.h5", at[:, None] * 1.0, 1.0, fixed=at == 0, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k, rest_length=1.0,
                         spring_law="plastic", columns={"yield_force": Y, "hardening": H})
    with h5py.File(path, "r+") as f:
        f["groups/end"], f["groups/middle"] = [n], [2]
    motion = "x=expression:0.8*sin(2.25*pi*t)"
    run = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_load_steps": steps, "bs_motion_end": motion, "bs_compliance_groups": "middle",
                      "bs_output": "p.h5md"}, keep=("p.h5md",))
    with h5py.File(io.BytesIO(run.files["p.h5md"])) as f:
        s = f["particles/trajectory/position/time"][...]
        x, e = f["particles/trajectory/position/value"][:, :, 0], f["backspring/plastic_stretch/value"][...]
        force, lost = f["observables/reaction/end/value"][...].ravel(), f["observables/dissipated_energy/value"][...].ravel()
    model = Series(k, Y, H)
    forces, stretches, plastics, losts = [], [], [], []
    for total in 0.8 * np.sin(2.25 * np.pi * s):
        P, stretch = model.pull(total)
        forces.append(P), stretches.append(stretch), plastics.append(model.e), losts.append(model.lost)
    checks.near("plastic springs: force of the driven end at every load step", force, forces, 1e-10)
    checks.near("plastic springs: stretches", np.diff(x, axis=1) - 1, stretches, 1e-11)
    checks.near("plastic springs: plastic stretches", e, plastics, 1e-11)
    checks.near("plastic springs: energy dissipated", lost, losts, 1e-10)
    plastics = np.array(plastics)
    checks.true("all yield, and all yield the other way", bool(np.all(plastics.max(0) > 0.02) and np.all(plastics.min(0) < -0.02)))
    checks.near("compliance: they unload elastically", run.report["compliance"]["matrix"][0], 1 / (1 / np.sum(1 / k[:2]) + 1 / np.sum(1 / k[2:])), 1e-12)


def beam_net(columns=13):
    """(positions, pairs) of a beam of three rows of particles, one apart, with both diagonals."""
    at = np.arange(3 * columns).reshape(3, columns)
    x = np.stack([np.tile(np.arange(columns, dtype=float), 3), np.repeat(np.arange(3.0), columns)], 1)
    ends = [at[:, :-1], at[:, 1:], at[:-1], at[1:], at[:-1, :-1], at[1:, 1:], at[:-1, 1:], at[1:, :-1]]
    return x, np.concatenate([np.stack([a.ravel(), b.ravel()], 1) for a, b in zip(ends[::2], ends[1::2])])


class Beam:
    """Elastic-plastic bars with kinematic hardening: Newton's method with dense matrices, each bar returned to |T - H e| <= Y from the plastic stretch that the last
    load step ended with."""

    def __init__(self, x, pairs, k, Y, H, free):
        self.x, self.pairs, self.k, self.Y, self.H, self.free = x.copy(), pairs, k, Y, H, free
        self.L, self.e = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1), np.zeros(len(pairs))

    def bars(self):
        """Tensions, their slopes by the lengths, plastic stretches, directions, lengths."""
        r = self.x[self.pairs[:, 1]] - self.x[self.pairs[:, 0]]
        l = np.linalg.norm(r, axis=1)
        trial = self.k * (l - self.L - self.e) - self.H * self.e
        over = np.maximum(np.abs(trial) - self.Y, 0)
        e = self.e + np.sign(trial) * over / (self.k + self.H)
        return self.k * (l - self.L - e), np.where(over > 0, self.k * self.H / (self.k + self.H), self.k), e, r / l[:, None], l

    def forces(self):
        T, slope, _, u, l = self.bars()
        f, K = np.zeros_like(self.x), np.zeros((self.x.size,) * 2)
        np.add.at(f, self.pairs[:, 0], T[:, None] * u)
        np.add.at(f, self.pairs[:, 1], -T[:, None] * u)
        blocks = (slope - T / l)[:, None, None] * u[:, :, None] * u[:, None, :] + (T / l)[:, None, None] * np.eye(2)
        for (a, b), block in zip(2 * self.pairs, blocks):
            for p, q, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                K[p:p + 2, q:q + 2] += sign * block
        return f, K

    def bend(self, driven, y):
        """The particle is moved to the height y; the force that takes."""
        self.x[driven, 1] = y
        f, K = self.forces()
        for _ in range(100):
            left = np.linalg.norm(f[self.free])
            if left < 1e-11:
                break
            start, way, part = self.x.copy(), np.linalg.solve(K[np.ix_(self.free.ravel(), self.free.ravel())], f[self.free]), 1.0
            while True:
                self.x[self.free] = start[self.free] + part * way
                f, K = self.forces()
                if np.linalg.norm(f[self.free]) < left or part < 1e-3:
                    break
                part /= 2
        assert left < 1e-11, f"the beam's own Newton iteration leaves {left:.1e} N"
        self.e = self.bars()[2]
        return -f[driven, 1]


def beam(checks, folder):
    """A lattice beam on two supports, whose upper middle is pushed down past its yield load, pulled up past that of the other sense, and pushed down again."""
    x, pairs = beam_net()
    n, steps = 13, 40
    rng = np.random.default_rng(3)
    k, Y, H = rng.uniform(80, 120, len(pairs)), rng.uniform(1.5, 2.5, len(pairs)), rng.uniform(3, 10, len(pairs))
    left, right, middle = 0, n - 1, 2 * n + n // 2
    path = write_lattice(folder / "beam.h5", x, 1.0, fixed=np.arange(3 * n) == left, pairs=pairs, stiffness=k, spring_law="plastic", columns={"yield_force": Y, "hardening": H})
    with h5py.File(path, "r+") as f:
        f["groups/right"], f["groups/middle"] = [right], [middle]
    run = checks.run({"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": path, "bs_motion_right": "y=fixed", "bs_motion_middle": "y=expression:-0.9*sin(2.25*pi*t)",
                      "bs_output": "beam.h5md"}, keep=("beam.h5md",))
    free = np.ones((3 * n, 2), bool)
    free[left], free[right, 1], free[middle, 1] = False, False, False
    own = Beam(x, pairs, k, Y, H, free)
    rows = [(own.bend(middle, 2 - 0.9 * np.sin(2.25 * np.pi * s / steps)), own.x.copy(), own.e.copy()) for s in range(1, steps + 1)]
    forces, places, plastics = (np.array(one) for one in zip(*rows))
    with h5py.File(io.BytesIO(run.files["beam.h5md"])) as f:
        found = f["particles/trajectory/position/value"][1:, :, :2]
        e, reaction = f["backspring/plastic_stretch/value"][1:], f["observables/reaction/middle/value"][1:, 1]
    checks.near("lattice beam: force at its middle at every load step", reaction, forces, 1e-9)
    checks.near("lattice beam: places", found, places, 1e-9)
    checks.near("lattice beam: plastic stretches", e, plastics, 1e-9)
    checks.true("bars of it yield, some both ways, and some do not", bool((np.abs(plastics).max(0) == 0).any() and ((plastics.max(0) > 1e-3) & (plastics.min(0) < -1e-3)).any()))


def scaled(checks, folder):
    """A mass hung between a wall and an anchor that moves, x = x0 + (k_a A(s) + m g(s))/(k + k_a): what -bs_load_scale names grows with s, the
    other acts in full."""
    k, ka, m, g = 30.0, 12.0, 2.0, 1.7
    path = write_lattice(folder / "anchored.h5", [[0.0], [1.0]], m, fixed=[1, 0], pairs=[[0, 1]], stiffness=k, rest_length=1.0,
                         anchors={"particle": [1], "point": [[1.0]], "stiffness": [ka], "rest_length": [0.0], "damping": [0.0]})
    path_of = {"velocity": ({"bs_anchor_motion": "velocity", "bs_anchor_velocity": 0.25}, lambda t: 0.25 * t),
               "sinusoid": ({"bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": 0.4, "bs_anchor_frequency": 0.6}, lambda t: 0.4 * np.sin(1.2 * np.pi * t))}
    for motion, (options, place) in path_of.items():
        for scale, of_anchor, of_weight in ((None, True, True), ("anchors", True, False), ("gravity", False, True), ("anchors,gravity", True, True), ("none", False, False)):
            r = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_load_steps": 8, "bs_gravity": g, "bs_load_scale": scale, **options}, interval=0).trajectory
            s = r.time[1:]
            exact = 1 + (ka * place(s if of_anchor else 1 + 0 * s) + m * g * (s if of_weight else 1)) / (k + ka)
            checks.near(f"anchors by {motion}, scaled: {scale or 'all'}", r.position[1:, 1, 0], exact, 1e-13)
    with h5py.File(path, "r+") as f:
        f["groups/wall"] = [0]
        f["particles/fixed"][...] = 0
    for scale, of_wall in (("driven", True), ("gravity", False)):
        r = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_load_steps": 8, "bs_load_scale": scale, "bs_motion_wall": "velocity:0.3"}, interval=0).trajectory
        s = r.time[1:] if of_wall else 1.0
        checks.near(f"a driven wall, scaled: {scale}", r.position[1:, 1, 0], 1 + k * 0.3 * s / (k + ka) + 0 * r.time[1:], 1e-13)


def branches(checks, folder):
    """Hencky's column, links of stiffness k with elastic hinges kappa, compressed along its axis: it stays straight, and at the load P there are as
    many negative pivots as there are modes m with 4 kappa sin^2(pi m/2n) < P a, a the length of a compressed link."""
    n, a, kappa, k = 8, 0.5, 3.0, 1e5
    at = np.arange(n + 1)
    angles = {"triples": np.stack([at[:-2], at[1:-1], at[2:]], 1), "stiffness": kappa, "rest_angle": np.pi}
    path = write_lattice(folder / "column.h5", np.stack([a * at, 0 * at], 1), 1.0, fixed=at == 0, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k, rest_length=a,
                         angles=angles)
    with h5py.File(path, "r+") as f:
        f["groups/end"] = [n]
    most = 10.0
    for control, more in (("arc", {"bs_load_control": "arc"}), ("load", {"bs_equilibria": "any"})):
        run = checks.run({"bs_task": "statics", "bs_lattice_file": path, "bs_load_steps": 25, "bs_motion_end": f"velocity:{-most * n / k:.17g},0", **more}, interval=0)
        r = run.trajectory
        P = -r.observables["reaction/end"][1:, 0]
        length = np.linalg.norm(np.diff(r.position[1:], axis=1), axis=2)
        checks.near(f"column by {control}: all links bear the load", P[:, None] / k, a - length, 1e-13)
        exact = [sum(4 * kappa * np.sin(np.pi * m / (2 * n)) ** 2 < force * (a - force / k) for m in range(1, n)) for force in P]
        seen = r.observables["negative_pivots"].ravel()[1:]
        checks.true(f"column by {control}: negative pivots at every load", bool(np.array_equal(seen, exact)), f"{seen.astype(int).tolist()} for {exact}")
        checks.true(f"column by {control}: it passes three branch points, and they are counted", max(exact) == 3 == run.report["inertia_changes"] and run.report["turns"] == 0,
                    f"{run.report['inertia_changes']} changes, {run.report['turns']} turns")


def onwards(checks, folder):
    """Paths by arc length go on the way they went: a particle whose place turns round while the load grows; and a truss that snaps through close below the
    load at which its path ends, past which it comes on the way back only."""
    path = write_lattice(folder / "pulled.h5", [[0.0], [1.0], [2.0]], 1.0, fixed=[1, 0, 0], pairs=[[0, 1], [1, 2]], stiffness=1.0, rest_length=1.0)
    with h5py.File(path, "r+") as f:
        f["groups/end"] = [2]
    base = {"bs_task": "statics", "bs_load_control": "arc", "bs_arc_steps": 400}
    for steps in (14, 20):
        run = checks.run({**base, "bs_lattice_file": path, "bs_load_steps": steps, "bs_motion_end": "x=sinusoid:0.1,0.5"}, interval=0)
        s = run.trajectory.observables["load_factor"].ravel()
        checks.near(f"to and fro, {steps} steps: half way between the ends", run.trajectory.position[:, 1, 0], 1 + 0.05 * np.sin(np.pi * s), 1e-10)
        checks.true(f"to and fro, {steps} steps: the load only grows, to its end", bool(np.all(np.diff(s) > 0)) and s[-1] == 1 and run.report["turns"] == 0, f"{len(s)} frames to {s[-1]:.4g}")
    limit, rest = 0.0099499169577446511, np.hypot(1, 0.3)
    path = write_lattice(folder / "truss.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0)
    for steps in (14, 16):
        run = checks.run({**base, "bs_lattice_file": path, "bs_load_steps": steps, "bs_gravity": (0, -limit), "bs_arc_end": 1.001}, interval=0)
        s, h = run.trajectory.observables["load_factor"].ravel(), run.trajectory.position[:, 2, 1]
        checks.near(f"truss, {steps} steps: loads along its path", s * limit, 2 * h * (rest / np.hypot(1, h) - 1), 1e-10)
        checks.true(f"truss, {steps} steps: through both limit points", run.report["turns"] == 2 and s[-1] == 1.001 and h[-1] < -0.3 and -1 <= s.min() < -0.97, f"{s.min():.4g} to {s[-1]:.6g}")


if __name__ == "__main__":
    run_parts("load paths", (plastic, beam, scaled, branches, onwards))
