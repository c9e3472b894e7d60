#!/usr/bin/env python3
"""Springs that break: bundles of fibres, nets torn in statics and in dynamics beside programs of their own in numpy and scipy, scatter, the energy
of what breaks, restarts, lattices read back, the threshold of a crack."""
import json
import math
import subprocess
import time

import h5py
from harness import run_parts, write_lattice
import numpy as np
from program import environment, words
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

TIE, MASK = 1e-9, (1 << 64) - 1


def splitmix(z):
    z = (z + 0x9E3779B97F4A7C15) & MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
    return z ^ (z >> 31)


def uniform(seed, row):
    """The number of the documented generator for the limit of a spring."""
    return (splitmix((splitmix((splitmix((splitmix(seed & MASK) + 3) & MASK) + row) & MASK)) & MASK) >> 11) * 2.0**-53


def weibull(count, modulus, seed):
    return np.array([(-math.log1p(-uniform(seed, row))) ** (1 / modulus) for row in range(count)])


class Net:
    """Hooke springs between points; k becomes 0 where one breaks."""

    def __init__(self, x, pairs, k, L, free):
        self.x, self.pairs, self.L, self.free = np.array(x, float), np.array(pairs), np.broadcast_to(np.asarray(L, float), len(pairs)), np.asarray(free)
        self.k = np.broadcast_to(np.asarray(k, float), len(pairs)).copy()

    def lengths(self):
        r = self.x[self.pairs[:, 1]] - self.x[self.pairs[:, 0]]
        return r, np.linalg.norm(r, axis=1)

    def strain(self):
        return (self.lengths()[1] - self.L) / self.L

    def energies(self):
        return 0.5 * self.k * (self.lengths()[1] - self.L) ** 2

    def force(self):
        r, l = self.lengths()
        each = (self.k * (l - self.L) / l)[:, None] * r
        f = np.zeros_like(self.x)
        np.add.at(f, self.pairs[:, 0], each)
        np.add.at(f, self.pairs[:, 1], -each)
        f[~self.free] = 0
        return f

    def equilibrium(self):
        """Newton's method with the exact tangent of the free points."""
        d = self.x.shape[1]
        for _ in range(60):
            f = self.force()
            r, l = self.lengths()
            u = r / l[:, None]
            K = {}
            rows, columns, values = [], [], []
            for s, (a, b) in enumerate(self.pairs):
                if self.k[s] == 0:
                    continue
                B = self.k[s] * (np.outer(u[s], u[s]) + (1 - self.L[s] / l[s]) * (np.eye(d) - np.outer(u[s], u[s])))
                for p, q, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                    if self.free[p] and self.free[q]:
                        for c in range(d):
                            for e in range(d):
                                rows.append(d * p + c), columns.append(d * q + e), values.append(sign * B[c, e])
            K = sp.csc_matrix((values, (rows, columns)), shape=(self.x.size, self.x.size))
            loose = np.flatnonzero(np.asarray(abs(K).sum(axis=1)).ravel() == 0)
            K = K + sp.csc_matrix((np.ones(len(loose)), (loose, loose)), shape=K.shape)
            step = spsolve(K, f.ravel()).reshape(self.x.shape)
            self.x += step
            if np.abs(step).max() < 1e-14:
                return
        raise ValueError("the reference finds no equilibrium")


def past(excess, worst):
    """Rows of the springs that break."""
    if excess.max(initial=0) < 1 - TIE:
        return np.array([], int)
    if worst:
        return np.flatnonzero(excess >= excess.max() * (1 - TIE))[:1]
    return np.flatnonzero(excess >= 1 - TIE)


def plate(n, rows):
    """A triangular lattice of n x rows points, a = 1, its lowest and highest rows held."""
    x = np.array([(i + 0.5 * (j % 2), j * math.sqrt(0.75)) for j in range(rows) for i in range(n)])
    near = {(a, b) for a in range(len(x)) for b in range(a + 1, len(x)) if abs(np.linalg.norm(x[b] - x[a]) - 1) < 1e-9}
    pairs = np.array(sorted(near))
    held = (np.arange(len(x)) < n) | (np.arange(len(x)) >= n * (rows - 1))
    return x, pairs, held


def events(folder, name="b.h5md"):
    with h5py.File(folder / name) as f:
        if "events/broken" not in f:
            return {}
        return {key: value[...] for key, value in f["events/broken"].items()}


def ran(checks, folder, options, name="b.h5md", **more):
    result = checks.run({**options, "bs_output": name}, keep=(name,), **more)
    (folder / name).write_bytes(result.files[name])
    return result


def bundle(checks, folder):
    """N fibres that share a load equally: at load F n intact ones are stretched by F/(n k); those past their limits break, until none is or none is left."""
    N, k, L, modulus = 200, 1.0, 1.0, 2.0
    x = np.vstack([np.zeros((N, 1)), [[L]]])
    pairs = np.column_stack([np.arange(N), np.full(N, N)])
    write_lattice(folder / "l.h5", x, 1.0, fixed=[1] * N + [0], pairs=pairs, stiffness=k, rest_length=L)
    limit = 0.2 * weibull(N, modulus, 7)
    steps, F = 50, 20.0
    for rule in ("all", "worst"):
        whole, sizes, order = np.ones(N, bool), [], []
        for s in range(1, steps + 1):
            size = 0
            while whole.any():
                gone = past(np.where(whole, F * s / steps / (whole.sum() * k) / L / limit, 0), rule == "worst")
                if len(gone) == 0:
                    break
                whole[gone] = False
                size += len(gone)
                order.extend(gone)
            if not whole.any():
                break
            if size:
                sizes.append(size)
        lost_at = s / steps
        options = {"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": str(folder / "l.h5"), "bs_gravity": F, "bs_break_strain": 0.2,
                   "bs_break_weibull": f"{modulus},7", "bs_break": rule, "snes_rtol": 1e-12}
        result = ran(checks, folder, {**options, "bs_output_interval": 1 / steps}, expect=3)
        found = events(folder)
        kept = sum(sizes)
        checks.true(f"{rule}: order of the breaks", list(found.get("spring", [])) == order[:kept], f"{kept} fibres")
        checks.true(f"{rule}: sizes of the avalanches", list(np.bincount(found["avalanche"])) == sizes, f"{sizes}")
        with h5py.File(folder / "b.h5md") as f:
            last = f["particles/trajectory/position/time"][-1]
            energy = f["observables/broken_energy/value"][-1]
        checks.near(f"{rule}: energy of the fibres as they broke", energy, found["energy"].sum(), 1e-12 * energy)
        checks.true(f"{rule}: the bundle's end is an error, and the last equilibrium is there", "no equilibrium was found" in result.stderr and abs(last - lost_at) < 1.5 / steps,
                    f"load {lost_at}, last frame {last}: {result.stderr.strip()[:90]}")
        checks.true(f"{rule}: the report counts", result.report["broken_springs"] == kept and result.report["largest_avalanche"] == max(sizes))


def torn_in_statics(checks, folder):
    """A plate pulled in ten load steps, one spring at a time and all at once, with scatter: the same springs in the same order as the reference."""
    n, rows = 8, 7
    x, pairs, held = plate(n, rows)
    top = np.arange(len(x)) >= n * (rows - 1)
    free = ~held
    write_lattice(folder / "l.h5", x, 1.0, fixed=held & ~top, pairs=pairs, stiffness=1.0, rest_length=1.0)
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/top"] = np.flatnonzero(top)
    limit = 0.06 * (1 + 0.4 * (2 * np.array([uniform(3, row) for row in range(len(pairs))]) - 1))
    for rule in ("worst", "all"):
        # all at once, nothing is to come loose: the reference has no equilibrium of its own then
        pull = (0.12 if rule == "worst" else 0.05) * (rows - 1) * math.sqrt(0.75)
        net, order, sizes, lost = Net(x, pairs, 1.0, 1.0, free), [], [], 0.0
        for s in range(1, 11):
            net.x[top] = x[top] + (0, pull * s / 10)
            net.equilibrium()
            size = 0
            while True:
                gone = past(np.where(net.k > 0, np.maximum(net.strain(), 0) / limit, 0), rule == "worst")
                if len(gone) == 0:
                    break
                lost += net.energies()[gone].sum()
                net.k[gone] = 0
                order.extend(gone)
                size += len(gone)
                net.equilibrium()
            if size:
                sizes.append(size)
        options = {"bs_task": "statics", "bs_load_steps": 10, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_top": f"x=fixed,y=velocity:{pull:.17g}",
                   "bs_break_strain": 0.06, "bs_break_uniform": "0.4,3", "bs_break": rule, "snes_rtol": 1e-12, "bs_output_interval": 0.1}
        ran(checks, folder, options)
        found = events(folder)
        checks.true(f"{rule}: springs in their order", list(found["spring"]) == order, f"{len(order)} of {len(pairs)} springs")
        checks.true(f"{rule}: avalanches", list(np.bincount(found["avalanche"])) == sizes, f"{sizes}")
        with h5py.File(folder / "b.h5md") as f:
            at = np.argsort(f["particles/trajectory/id"][...])
            checks.near(f"{rule}: the last equilibrium", f["particles/trajectory/position/value"][-1][at], net.x, 1e-8)
            checks.near(f"{rule}: energy of what broke", f["observables/broken_energy/value"][-1], lost, 1e-8 * lost)
            checks.true(f"{rule}: flags of the last frame", np.array_equal(f["backspring/broken/value"][-1] != 0, net.k == 0))
            checks.true(f"{rule}: ends", np.array_equal(found["ends"], np.sort(pairs[order], axis=1)))
            o = {name: f[f"observables/{name}/value"][...] for name in ("elastic_energy", "broken_energy", "released_energy", "work/top")}
            books = o["elastic_energy"] + o["broken_energy"] + o["released_energy"] - o["work/top"]
            checks.below(f"{rule}: work = stored + broken + released, up to the rule of work over a load step", np.abs(books).max() / o["work/top"][-1], 0.05)


def torn_in_time(checks, folder):
    """Nets in the plane and in space flung apart, by velocity Verlet: every break of the reference's own loop at its step; limits of strain, force and energy, in tension and in
    compression."""
    rng = np.random.default_rng(5)
    x, pairs, _ = plate(6, 6)
    fling(checks, folder, rng, x, pairs, "")
    x = np.array([(i, j, k) for i in range(4) for j in range(4) for k in range(4)], float) + rng.uniform(-0.05, 0.05, (64, 3))
    pairs = np.array([(a, b) for a in range(64) for b in range(a + 1, 64) if np.linalg.norm(x[b] - x[a]) < 1.6])
    fling(checks, folder, rng, x, pairs, " in space")


def fling(checks, folder, rng, x, pairs, where):
    v = 0.6 * (x - x.mean(axis=0)) + 0.3 * rng.standard_normal(x.shape)
    k, h, steps = rng.uniform(0.5, 2, len(pairs)), 0.02, 150
    cases = {"strain": ("strain", 0.3, "tension", lambda e, T, E: np.maximum(e, 0)), "force": ("force", 0.4, "tension", lambda e, T, E: np.maximum(T, 0)),
             "energy": ("energy", 0.1, "both", lambda e, T, E: np.sqrt(E)), "compression": ("strain", 0.15, "compression", lambda e, T, E: np.maximum(-e, 0)),
             "both, worst": ("strain", 0.25, "both", lambda e, T, E: np.abs(e))}
    write_lattice(folder / "l.h5", x, 1.0, velocity=v, pairs=pairs, stiffness=k, rest_length=1.0)
    for name, (kind, limit, side, size) in cases.items():
        net, speed, order, when = Net(x, pairs, k, 1.0, np.ones(len(x), bool)), v.copy(), [], []
        worst, most = "worst" in name, math.sqrt(limit) if kind == "energy" else limit
        a = net.force()
        for step in range(1, steps + 1):
            half = speed + h / 2 * a
            net.x += h * half
            a = net.force()
            speed = half + h / 2 * a
            excess = size(net.strain(), net.k * (net.lengths()[1] - 1), net.energies()) / most
            gone = past(np.where(net.k > 0, excess, 0), worst)
            if len(gone):
                net.k[gone] = 0
                order.extend(gone)
                when.extend([step * h] * len(gone))
                a = net.force()
        options = {"ts_type": "verlet", "ts_dt": h, "ts_max_time": steps * h, "bs_lattice_file": str(folder / "l.h5"), f"bs_break_{kind}": limit,
                   "bs_break_in": side, "bs_break": "worst" if worst else "all", "bs_output_interval": 0.1}
        ran(checks, folder, options, grows=True)
        found = events(folder)
        checks.true(f"{name}{where}: springs", list(found.get("spring", [])) == order, f"{len(order)} of {len(pairs)}")
        checks.near(f"{name}{where}: times", found["time"], np.array(when), 1e-9)
        with h5py.File(folder / "b.h5md") as f:
            at = np.argsort(f["particles/trajectory/id"][...])
            checks.near(f"{name}{where}: places at the end", f["particles/trajectory/position/value"][-1][at], net.x, 1e-9)
            total = f["observables/total_energy/value"][...] + f["observables/broken_energy/value"][...]
            checks.below(f"{name}{where}: energy with what broke", np.abs(total / total[0] - 1).max(), 2e-2, "by Verlet's own error")
            momentum = f["observables/momentum/value"][...]
            checks.near(f"{name}{where}: momentum", momentum, momentum[0], 1e-11)


def every_method(checks, folder):
    """Two masses fly apart; their spring breaks at strain 0.5, and then they keep their speeds: u'' = -omega^2 u until t_b, linear after it."""
    write_lattice(folder / "l.h5", [[0.0], [1.0]], 2.0, velocity=[[-1.0], [1.0]], pairs=[[0, 1]], stiffness=1.0, rest_length=1.0)
    # l - L = 2 sin(t) with omega^2 = 2k/m = 1
    t_b = math.asin(0.25)
    slope = 2 * math.cos(t_b)
    end = 1.0
    exact = 1 + 0.5 + slope * (end - t_b)
    for method in ({"ts_type": "rk", "ts_rk_type": "5dp"}, {"ts_type": "rk", "ts_rk_type": "4"}, {"ts_type": "symplectic"}, {"ts_type": "verlet"}, {"ts_type": "beuler"},
                   {"ts_type": "cn"}, {"ts_type": "alpha2"}, {"ts_type": "bdf"}, {"ts_type": "rosw"}, {"ts_type": "arkimex"}):
        errors = []
        for steps in (200, 800):
            h = end / steps
            run = checks.run({**method, "ts_adapt_type": "none", "ts_dt": h, "ts_max_time": end, "bs_lattice_file": str(folder / "l.h5"), "bs_break_strain": 0.5, "snes_rtol": 1e-12},
                             interval=end, ranks=min(checks.ranks, 2))
            x = run.trajectory.position[-1][np.argsort(run.trajectory.id), 0]
            errors.append(abs(x[1] - x[0] - exact))
        # the break is seen up to a step late: first order, and never more than the step times the change of speed
        checks.true(" ".join(method.values()), errors[0] < 2 * end / 200 and errors[1] < 2 * end / 800, f"errors {errors[0]:.2g}, {errors[1]:.2g}")


def energy_balance(checks, folder):
    """A notched strip pulled slowly, trapezoidal rule: work = kinetic + stored + broken in every frame to 1e-6 of the work."""
    n, rows = 14, 9
    x, pairs, held = plate(n, rows)
    top, bottom = np.arange(len(x)) >= n * (rows - 1), np.arange(len(x)) < n
    middle = 0.5 * (rows - 1) * math.sqrt(0.75)
    centre = 0.5 * (x[pairs[:, 0]] + x[pairs[:, 1]])
    crosses = (np.sign(x[pairs[:, 0], 1] - middle - 0.1) != np.sign(x[pairs[:, 1], 1] - middle - 0.1)) & (centre[:, 0] < 4.5)
    pairs = pairs[~crosses]
    write_lattice(folder / "l.h5", x, 1.0, pairs=pairs, stiffness=1.0, rest_length=1.0)
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/top"], f["groups/bottom"] = np.flatnonzero(top), np.flatnonzero(bottom)
    options = {"bs_lattice_file": str(folder / "l.h5"), "bs_motion_bottom": "fixed", "bs_motion_top": "x=fixed,y=velocity:0.02", "bs_break_strain": 0.04,
               "bs_break_spare": "top,bottom", "ts_type": "cn", "ts_dt": 0.005, "ts_max_time": 30, "bs_output_interval": 0.5, "snes_rtol": 1e-11}
    ran(checks, folder, options)
    found = events(folder)
    with h5py.File(folder / "b.h5md") as f:
        o = {name: f[f"observables/{name}/value"][...] for name in ("kinetic_energy", "elastic_energy", "broken_energy", "work/top")}
    work = o["work/top"]
    books = o["kinetic_energy"] + o["elastic_energy"] + o["broken_energy"] - work
    checks.below("the books close in every frame", np.abs(books - books[0]).max() / work.max(), 1e-6)
    checks.true("the crack has run", len(found["spring"]) > 8 and found["energy"].sum() > 0.05 * work.max(), f"{len(found['spring'])} springs, {found['energy'].sum():.3g} of {work.max():.3g} J")


def go(checks, place, *more, expect=0):
    """A run in the folder `place`, where others may have left their files."""
    place.mkdir(exist_ok=True)
    mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []
    done = subprocess.run([*mpi, checks.program, *more], cwd=place, capture_output=True, text=True, env=environment(checks.ranks), timeout=300)
    if done.returncode != expect:
        raise ValueError(done.stderr)


def continued(checks, folder):
    """Restart to the bit, with the list; a trajectory read back has its broken springs; plastic springs that break."""
    x, pairs, _ = plate(6, 6)
    write_lattice(folder / "l.h5", x, 1.0, velocity=0.4 * (x - x.mean(axis=0)), pairs=pairs, stiffness=1.0, rest_length=1.0)
    for name, more in {"beuler": {"ts_type": "beuler"}, "verlet": {"ts_type": "verlet"}, "alpha2": {"ts_type": "alpha2"},
                       "plastic": {"bs_spring_law": "plastic", "bs_spring_yield_force": 0.1, "bs_spring_hardening": 0.2}}.items():
        base = {"bs_lattice_file": "../l.h5", "ts_dt": 0.05, "ts_max_time": 2, "bs_break_strain": 0.35, "bs_break_weibull": "4,1", "condensed_pc_type": "bicc", **more}
        start = words({**base, "bs_checkpoint": "c", "bs_checkpoint_every": 5, "bs_output": "r.h5md", "bs_output_interval": 0.25})
        go(checks, folder / name, *start, "-bs_report", "r.json")
        go(checks, folder / (name + "2"), *start, "-ts_max_steps", "20")
        go(checks, folder / (name + "2"), "-bs_restart", "c", "-ts_max_steps", "1000", "-bs_report", "r.json", "-bs_lattice_file", "../l.h5")
        counts = [[json.loads((folder / place / "r.json").read_text())[key] for key in ("broken_springs", "avalanches", "largest_avalanche")] for place in (name, name + "2")]
        checks.true(f"{name}: the same counts", counts[0] == counts[1], f"{counts}")
        with h5py.File(folder / name / "r.h5md") as a, h5py.File(folder / (name + "2") / "r.h5md") as b:
            paths = ["particles/trajectory/position/value", "particles/trajectory/velocity/value", "backspring/broken/value", "observables/broken_energy/value"]
            paths += ["events/broken/" + key for key in a["events/broken"]]
            checks.true(f"{name}: continued in every bit, with its events", len(paths) > 8 and all(np.array_equal(a[p][...], b[p][...], equal_nan=True) for p in paths),
                        f"{len(a['events/broken/spring'])} springs")
            before = np.count_nonzero(a["events/broken/time"][...] <= 1.0)
            checks.true(f"{name}: some broke before and some after", 0 < before < len(a["events/broken/time"]), f"{before} of {len(a['events/broken/time'])}")
            if name != "plastic":
                continue
            gone = a["observables/dissipated_energy/value"][...]
            checks.true("plastic work is not lost with the spring", np.all(np.diff(gone) >= 0) and gone[-1] > 0, f"{gone[-1]:.3g} J")
    with h5py.File(folder / "beuler" / "r.h5md") as f:
        flags, last = f["backspring/broken/value"][-1], f["particles/trajectory/position/value"][-1]
    back = ran(checks, folder, {"bs_lattice_file": str(folder / "beuler" / "r.h5md"), "ts_dt": 0.05, "ts_max_time": 0.05}, grows=True)
    with h5py.File(folder / "b.h5md") as f:
        checks.true("a trajectory read back: its broken springs stay broken", np.array_equal(f["backspring/broken/value"][0], flags) and flags.any())
        checks.near("and it begins where that ended", f["particles/trajectory/position/value"][0], last, 0)
    checks.true("and nothing breaks anew without limits", back.report["broken_springs"] == 0)


def followed(checks, folder):
    """Two fibres hold a weight that grows; when the weaker one breaks at load F, the other one is stretched to F/k at rest, but to 2 F/k - F/2k by the weight's
    inertia: a limit between the two is reached in motion alone. Then the weight falls onto a third fibre, slack until then, that holds it."""
    x = [[0.0], [0.0], [-3.0], [1.0]]
    write_lattice(folder / "l.h5", x, 1.0, fixed=[1, 1, 1, 0], pairs=[[0, 3], [1, 3], [2, 3]], stiffness=[1.0, 1.0, 0.5], rest_length=[1.0, 1.0, 5.0], laws=["hooke", "hooke", "tension"],
                  columns={"critical_strain": [0.1, 0.24, np.inf]})
    base = {"bs_task": "statics", "bs_load_steps": 40, "bs_lattice_file": str(folder / "l.h5"), "bs_gravity": 0.21, "bs_output_interval": 0.025, "snes_rtol": 1e-12}
    still = ran(checks, folder, base)
    checks.true("at rest the second fibre holds", list(events(folder)["spring"]) == [0] and still.report["broken_springs"] == 1)
    ran(checks, folder, {**base, "bs_break_follow": "dynamics", "bs_break_dt": 0.01, "bs_break_output_interval": 0.5})
    found = events(folder)
    checks.true("in motion it breaks in the same avalanche", list(found["spring"]) == [0, 1] and list(found["avalanche"]) == [0, 0], f"{found['strain']}")
    # u = F/k - F/2k cos t from rest at F/2k, omega = 1: where u = 0.24
    F = 0.21 * found["load"][0]
    when = math.acos((F - 0.24) / (F / 2))
    checks.near("after the time that the free vibration takes to its limit", found["time"][1] - found["time"][0], when, 0.03)
    with h5py.File(folder / "b.h5md") as f:
        o = {name: f[f"observables/{name}/value"][...] for name in ("kinetic_energy", "potential_energy", "broken_energy", "released_energy", "load_factor")}
        place = f["particles/trajectory/position/value"][:, list(f["particles/trajectory/id"][...]).index(3), 0]
        clock = f["particles/trajectory/position/time"][...]
    checks.near("it comes to rest on the third fibre", place[-1], 2 + 0.21 / 0.5, 1e-8)
    checks.true("frames of the motion: their times and places", np.all(np.diff(clock) > 0) and np.count_nonzero(o["kinetic_energy"] > 1e-6) > 3, f"{len(clock)} frames")
    during = np.flatnonzero(np.abs(o["load_factor"] - found["load"][0]) < 1e-12)
    books = (o["kinetic_energy"] + o["potential_energy"] + o["broken_energy"] + o["released_energy"])[during]
    checks.below("what is stored, broken, released and moves is the same all through the motion", np.ptp(books), 1e-10)


def stopped(checks, folder):
    """A signal ends a run during an avalanche that would last for hours: its last state is the equilibrium before it, whole, and a continued run breaks there."""
    write_lattice(folder / "l.h5", [[0.0], [0.0], [1.0]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0, rest_length=1.0,
                  columns={"critical_strain": [0.1, np.inf]})
    base = {"bs_task": "statics", "bs_load_steps": 40, "bs_lattice_file": "l.h5", "bs_gravity": 0.21, "bs_output_interval": 0.025, "bs_break_follow": "dynamics",
            "bs_break_max_steps": 10**9, "bs_output": "r.h5md", "bs_checkpoint": "c"}
    how = {"cwd": folder, "env": environment(1), "text": True}
    run = subprocess.Popen([checks.program, *words({**base, "bs_break_dt": 1e-7, "bs_break_output_interval": 2e-4})], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **how)
    time.sleep(8)
    checks.true("the avalanche goes on", run.poll() is None)
    run.terminate()
    code = run.wait(timeout=60)
    with h5py.File(folder / "r.h5md") as f:
        broken, load = f["backspring/broken/value"][-1], f["particles/trajectory/position/time"][-1]
        clock, steps = (f["particles/trajectory/position/" + name][...] for name in ("time", "step"))
        moved = np.count_nonzero(f["observables/kinetic_energy/value"][...])
        checks.true("a signal ends it", code == 143 and not broken.any() and "events" not in f, f"exit {code}, load factor {load:.4g}")
        checks.true("time has passed in the frames of the motion, and does not go back", moved > 3 and np.all(np.diff(clock) > 0) and np.all(np.diff(steps) > 0), f"{moved} frames")
    done = subprocess.run([checks.program, *words({"bs_restart": "c", "bs_break_dt": 0.05})], capture_output=True, **how)
    with h5py.File(folder / "r.h5md") as f:
        checks.true("continued, the spring breaks", done.returncode == 0 and list(f["events/broken/spring"][...]) == [0], done.stderr.strip()[-200:])
        checks.near("and the other one bears the load", f["particles/trajectory/position/value"][-1].max(), 1.21, 1e-9)


def griffith(checks, folder):
    """A strip with a long crack along which springs may break, pulled in load steps. At Griffith's strain eps_c sqrt(2 k a/(C22 H)), C22 = 3 sqrt(3) k/4,
    the energy that a step of the crack sets free is that of the two springs it breaks; the lattice holds the crack until the first spring ahead of it is
    stretched by eps_c, at the load of the reference, and then it runs through the strip."""
    n, rows = 60, 17
    x, pairs, held = plate(n, rows)
    H, eps_c, C22 = (rows - 1) * math.sqrt(0.75), 0.02, 0.75 * math.sqrt(3)
    middle = H / 2 + 0.2
    crosses = (x[pairs[:, 0], 1] - middle) * (x[pairs[:, 1], 1] - middle) < 0
    along = 0.5 * (x[pairs[:, 0], 0] + x[pairs[:, 1], 0])
    top = np.arange(len(x)) >= n * (rows - 1)
    eps_g = eps_c * math.sqrt(2 / (C22 * H))
    stored = []
    for length in (20, 21):
        net = Net(x, pairs, np.where(crosses & (along < length), 0, 1.0), 1.0, ~held)
        net.x[:, 1] *= 1 + eps_g
        net.equilibrium()
        stored.append(net.energies().sum())
        if length == 20:
            strain = net.strain()[crosses & (along > length)].max()
    checks.near("Griffith: energy set free over that of two springs", (stored[0] - stored[1]) / eps_c**2, 1.0, 0.03)
    columns = {"broken": (crosses & (along < 20)).astype(float), "critical_strain": np.where(crosses, eps_c, np.inf)}
    write_lattice(folder / "l.h5", x, 1.0, fixed=held & ~top, pairs=pairs, stiffness=1.0, rest_length=1.0, columns=columns)
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/top"] = np.flatnonzero(top)
    steps = 100
    options = {"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_top": f"x=fixed,y=velocity:{2.5 * eps_g * H:.17g}", "bs_break": "worst",
               "bs_output_interval": 0.1}
    ran(checks, folder, options)
    found = events(folder)
    first, expected = 2.5 * found["load"][0], eps_c / strain
    checks.true("the first spring breaks at the strain of the reference", abs(first - expected) < 2.5 / steps + 0.005 * expected and expected > 1,
                f"{first:.4f} eps_G, {expected:.4f} by the reference, steps of {2.5 / steps:.3f}")
    run = found["avalanche"] == np.argmax(np.bincount(found["avalanche"]))
    whole, ends = np.count_nonzero(crosses & (along > 20)), x[pairs[found["spring"][run]]]
    checks.true("and the crack runs straight on, both directions of springs in turn", np.count_nonzero(run) > 0.6 * whole and 2.5 * found["load"][run][0] < 1.05 * first
                and np.all(np.diff(ends.mean(axis=1)[:, 0]) > 0), f"{np.count_nonzero(run)} of {whole} springs at {2.5 * found['load'][run][0]:.4f} eps_G")


if __name__ == "__main__":
    run_parts(__doc__, (bundle, torn_in_statics, torn_in_time, continued, followed),
              on_one_rank=(every_method, energy_balance, stopped, griffith))  # long runs, or a signal, which mpirun does not leave time for
