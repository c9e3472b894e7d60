#!/usr/bin/env python3
"""Laws of springs by name and spring by spring: recurrence of a nonlinear chain, cables that go slack, plastic cycles and their
history, lattices of every law at once, against NumPy and SciPy."""
import pathlib
import tempfile

import h5py
import numpy as np
from harness import Checks, write_lattice
from program import Trajectory, run
from scipy.integrate import solve_ivp

DIRECT = {"snes_rtol": 1e-12, "ts_adapt_type": "none"}

# --- Fermi, Pasta, Ulam and Tsingou -----------------------------------------------------------------------------------

FPUT_STEP, FPUT_ALPHA, FPUT_N = 0.05, 0.25, 32


def fput_forces(q):
    """On the moving masses at displacements q (n + 2, ends 0): T = s + alpha s^2."""
    s = np.diff(q)
    return np.diff(s * (1 + FPUT_ALPHA * s))


def mode_energy(q, v):
    """Energy of the first mode; q, v: (..., n)."""
    shape = np.sqrt(2 / (FPUT_N + 1)) * np.sin(np.pi * np.arange(1, FPUT_N + 1) / (FPUT_N + 1))
    omega = 2 * np.sin(np.pi / (2 * (FPUT_N + 1)))
    return 0.5 * (v @ shape) ** 2 + 0.5 * (omega * (q @ shape)) ** 2


def fput(checks, folder):
    """One half sine of amplitude 1: nearly all energy is back in the first mode at t = 10,148."""
    n, h, end, every = FPUT_N, FPUT_STEP, 10300.0, 4.0
    q = np.concatenate([[0], np.sin(np.pi * np.arange(1, n + 1) / (n + 1)), [0]])
    chain = write_lattice(folder / "fput.h5", (np.arange(n + 2) + q)[:, None], 1.0, fixed=[1] + n * [0] + [1], pairs=[(i, i + 1) for i in range(n + 1)], stiffness=1.0, rest_length=1.0)
    done = run(checks.program, dict(bs_lattice_file=chain, bs_spring_law="polynomial", bs_spring_stiffness_2=FPUT_ALPHA, ts_type="verlet",
                                    ts_dt=h, ts_max_time=end, bs_output_strain=False), interval=every, ranks=1)
    t, x = done.trajectory.time, done.trajectory.position[:, :, 0] - np.arange(n + 2)
    v = done.trajectory.velocity[:, 1:-1, 0]
    share = mode_energy(x[:, 1:-1], v)
    share /= share[0]
    late = t > 5000
    best = np.argmax(np.where(late, share, 0))
    checks.near("FPUT: time of the first recurrence", t[best], 10148, 20)
    checks.near("FPUT: share of the first mode at it", share[best], 0.981, 0.001)
    checks.below("FPUT: the energy had left the first mode", share[late].min(), 0.2)
    # velocity Verlet of the first 200 time units, by NumPy
    mine, speed = q.copy(), np.zeros(n)
    for _ in range(round(200 / h)):
        speed += 0.5 * h * fput_forces(mine)
        mine[1:-1] += h * speed
        speed += 0.5 * h * fput_forces(mine)
    checks.below("FPUT: positions at t = 200 are velocity Verlet's", np.abs(x[round(200 / every)] - mine).max(), 1e-11)


# --- forces of any law, for SciPy -------------------------------------------------------------------------------------

class Springs:
    """Springs of several laws in d dimensions. e: plastic stretch as committed last."""

    def __init__(self, x, pairs, laws, k, L, columns, fixed, mass, gravity):
        self.x, self.pairs, self.laws, self.k, self.L = x, np.asarray(pairs), np.asarray(laws), k, L
        self.c, self.free, self.mass, self.gravity = columns, ~np.asarray(fixed, bool), mass, np.asarray(gravity, float)
        self.e = np.zeros(len(pairs))
        self.yields = np.flatnonzero(self.laws == "plastic")

    def stretch(self, x):
        dx = x[self.pairs[:, 0]] - x[self.pairs[:, 1]]
        l = np.linalg.norm(dx, axis=1)
        return dx, l, l - self.L

    def flow(self, s):
        c = self.c
        xi = self.k * (s - self.e) - c["hardening"] * self.e
        return np.where(self.laws == "plastic", np.sign(xi) * np.maximum(np.abs(xi) - c["yield_force"], 0) / (self.k + c["hardening"]), 0)

    def tension(self, s):
        k, c = self.k, self.c
        return np.select([self.laws == "hooke", self.laws == "strain", self.laws == "tension", self.laws == "polynomial"],
                         [k * s, k * s / self.L, k * np.maximum(s, 0), k * s + c["stiffness_2"] * s ** 2 + c["stiffness_3"] * s ** 3],
                         k * (s - self.e - self.flow(s)))

    def rate(self, _, y):
        n, d = self.x.shape
        x, v = y[:n * d].reshape(n, d), y[n * d:].reshape(n, d)
        dx, l, s = self.stretch(x)
        pull = -(self.tension(s) / l)[:, None] * dx
        f = np.zeros_like(x)
        np.add.at(f, self.pairs[:, 0], pull)
        np.add.at(f, self.pairs[:, 1], -pull)
        a = (f / self.mass[:, None] + self.gravity) * self.free[:, None]
        return np.concatenate([(v * self.free[:, None]).ravel(), a.ravel()])

    def stretching(self, y):
        """Rates of length of the plastic springs."""
        n, d = self.x.shape
        x, v = y[:n * d].reshape(n, d), y[n * d:].reshape(n, d)
        dx, l, _ = self.stretch(x)
        w = v[self.pairs[:, 0]] - v[self.pairs[:, 1]]
        return ((dx * w).sum(axis=1) / l)[self.yields]

    def solve(self, v, end):
        """The state at `end`. While a plastic spring's length changes one way its tension is a function of length: its history is
        committed where that turns."""
        y, t = np.concatenate([self.x.ravel(), v.ravel()]), 0.0

        def turns(k):
            def event(_, y):
                return self.stretching(y)[k]
            event.terminal = True
            return event
        self.e += self.flow(self.stretch(self.x)[2])  # what starts beyond its yield force has yielded
        events = [turns(k) for k in range(len(self.yields))]
        while t < end:
            done = solve_ivp(self.rate, (t, end), y, method="DOP853", rtol=1e-11, atol=1e-12, events=events or None)
            t, y = done.t[-1], done.y[:, -1]
            self.e += self.flow(self.stretch(y[:self.x.size].reshape(self.x.shape))[2])
            if t < end:  # past the turn, so that it is not found again
                ahead = min(1e-7, end - t)
                y, t = y + ahead * self.rate(t, y + 0.5 * ahead * self.rate(t, y)), t + ahead
        return y[:self.x.size].reshape(self.x.shape)


def net(d, n, seed):
    """A crooked net: positions, pairs, fixed corners, velocities."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), axis=-1).reshape(-1, 2).astype(float)
    x = np.zeros((n * n, d))
    x[:, :min(2, d)] = grid[:, :min(2, d)]
    x += rng.uniform(-0.1, 0.1, x.shape)
    index = np.arange(n * n).reshape(n, n)
    pairs = np.concatenate([np.stack([index[:-1].ravel(), index[1:].ravel()], axis=1), np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], axis=1)])
    fixed = np.zeros(n * n, int)
    fixed[[index[0, 0], index[0, -1], index[-1, 0], index[-1, -1]]] = 1
    return x, pairs, fixed, rng.uniform(-1, 1, x.shape) * (1 - fixed)[:, None]


def against_scipy(checks, folder, name, laws_of, h, tolerance, end=0.5):
    x, pairs, fixed, v = net(2, 4, 3)
    rng = np.random.default_rng(8)
    m = len(pairs)
    laws = laws_of(m)
    length = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    k, L = rng.uniform(40, 80, m), length * rng.uniform(0.9, 1.1, m)
    columns = {"stiffness_2": rng.uniform(-60, 20, m), "stiffness_3": rng.uniform(0, 80, m), "yield_force": rng.uniform(1, 5, m),
               "hardening": rng.uniform(0, 20, m)}
    springs = Springs(x, pairs, laws, k, L, columns, fixed, np.full(len(x), 0.7), (0, -9.81))
    expected = springs.solve(v, end)
    one = len(set(laws)) == 1
    used = {} if one and laws[0] in ("hooke", "tension") else columns
    path = write_lattice(folder / "net.h5", x, 0.7, velocity=v, fixed=fixed, pairs=pairs, stiffness=k, rest_length=L, columns=used,
                         **({"spring_law": str(laws[0])} if one else {"laws": laws}))
    options = dict(bs_lattice_file=path, bs_gravity=(0, -9.81), ts_max_time=end, ts_adapt_type="none")
    frames = {}
    for ranks in (1, 3):
        done = run(checks.program, dict(options, ts_type="rk", ts_rk_type="4", ts_dt=h), interval=0.05, ranks=ranks)
        frames[ranks] = done.trajectory
        checks.below(f"{name}, rk 4 on {ranks} rank(s) against SciPy", np.abs(done.trajectory.position[-1] - expected).max(), tolerance)
    checks.below(f"{name}, rk 4: 3 ranks and 1", np.abs(frames[3].position - frames[1].position).max(), 1e-13)
    coarse = {}
    for ranks in (1, 3):
        done = run(checks.program, dict(options, **DIRECT, ts_type="cn", ts_dt=0.002), interval=0.05, ranks=ranks)
        coarse[ranks] = done.trajectory
        checks.below(f"{name}, cn on {ranks} rank(s) against SciPy", np.abs(done.trajectory.position[-1] - expected).max(), 3e-3)
    checks.below(f"{name}, cn: 3 ranks and 1", np.abs(coarse[3].position - coarse[1].position).max(), 1e-9)
    energy = frames[1].observables
    total = energy["total_energy"] + energy.get("dissipated_energy", 0)
    checks.below(f"{name}: energy kept, with what is dissipated", np.abs(total - total[0]).max() / np.abs(energy["kinetic_energy"]).max(), 1e-4)
    return springs, frames[1], path


def cables(checks, folder):
    springs, frames, _ = against_scipy(checks, folder, "cable net", lambda m: np.array(["tension"] * m), 2e-4, 1e-6)
    slack = [(springs.stretch(x)[2] < 0) for x in frames.position]
    checks.true("cable net: cables go slack and taut", np.any(np.diff(np.array(slack, int), axis=0) > 0) and np.any(np.diff(np.array(slack, int), axis=0) < 0))


def mixture(checks, folder):
    names = ["hooke", "tension", "polynomial", "plastic", "strain"]
    _, frames, path = against_scipy(checks, folder, "every law", lambda m: np.array([names[i % 5] for i in range(m)]), 1e-4, 1e-6)
    lost = frames.observables["dissipated_energy"].ravel()
    checks.true("every law: some springs yield", lost[-1] > 0.1 and (np.diff(lost) >= 0).all(), f"{lost[-1]:.3g} J dissipated")
    # a trajectory is a lattice: what follows its last frame is the same motion
    base = dict(bs_gravity=(0, -9.81), ts_type="symplectic", ts_dt=1e-3)
    half = folder / "half.h5md"
    run(checks.program, dict(base, bs_lattice_file=path, ts_max_time=0.25, bs_output=half, bs_output_interval=0.25))
    whole = run(checks.program, dict(base, bs_lattice_file=path, ts_max_time=0.5), interval=0.5).trajectory.position[-1]
    for ranks in (1, 3):
        rest = run(checks.program, dict(base, bs_lattice_file=half, ts_max_time=0.25), interval=0.25, ranks=ranks)
        checks.below(f"a trajectory read as a lattice keeps laws and history, {ranks} rank(s)", np.abs(rest.trajectory.position[-1] - whole).max(), 1e-12)
    with h5py.File(half) as f:
        checks.true("trajectory: laws by name", f["connectivity/bonds_law"].attrs["spring_laws"] == b"hooke,strain,tension,polynomial,plastic,maxwell"
                    or f["connectivity/bonds_law"].attrs["spring_laws"] == "hooke,strain,tension,polynomial,plastic,maxwell")
        checks.true("trajectory: plastic stretch of every spring and frame", f["backspring/plastic_stretch/value"].shape == (2, len(f["connectivity/bonds"])))


def one_of_another_law(checks, folder):
    """A law that coincides with the others' here, given to one spring: the same motion and energies, in every dimension, with dampers and without,
    whether the others obey Hooke's law or the strain law."""
    for d in (1, 2, 3):
        x, pairs, fixed, v = net(d, 6, 11)
        rng = np.random.default_rng(12)
        length = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
        L = length * rng.uniform(0.6, 0.7, len(pairs))  # so taut that none goes slack
        for law in ("hooke", "strain"):
            k = np.full(len(pairs), 200.0 if law == "hooke" else 100.0)
            one = pairs.shape[0] // 2
            other = k.copy()
            other[one] /= L[one] if law == "strain" else 1.0  # tension-only springs are Hooke's
            for damping in (0.0, 0.3):
                given = dict(velocity=0.1 * v, fixed=fixed, pairs=pairs, rest_length=L, damping=damping)
                uniform = write_lattice(folder / "uniform.h5", x, 0.7, stiffness=k, spring_law=law, **given)
                mixed = write_lattice(folder / "mixed.h5", x, 0.7, stiffness=other, laws=[law] * one + ["tension"] + [law] * (len(k) - one - 1), **given)
                for method in (dict(ts_type="rk", ts_rk_type="4", ts_adapt_type="none"), DIRECT):
                    runs = [run(checks.program, dict(method, bs_lattice_file=path, ts_dt=0.01, ts_max_time=0.1, snes_rtol=1e-12), interval=0.05, ranks=ranks)
                            for path, ranks in ((uniform, 1), (mixed, 1), (mixed, 3 if d == 2 else 1))]
                    a, b, c = (r.trajectory for r in runs)
                    name = f"{d}-D, {law}, damping {damping:g}, {method.get('ts_type', 'beuler')}: "
                    checks.below(name + "places", np.abs(b.position - a.position).max(), 1e-12)
                    checks.below(name + "energies", max(np.abs(b.observables[key] - a.observables[key]).max() for key in ("elastic_energy", "kinetic_energy")), 1e-10)
                    checks.below(name + "again, in 2-D on 3 ranks", np.abs(c.position - b.position).max(), 1e-12)


# --- plastic cycles ---------------------------------------------------------------------------------------------------

def bilinear(stretch, k, Y, H):
    """Plastic stretch at each of a sequence of stretches: it follows where the stretch leaves the elastic range, Y/k to either side of
    e (1 + H/k)."""
    e, out = 0.0, []
    for s in stretch:
        e = min(max(e, (k * s - Y) / (k + H)), (k * s + Y) / (k + H))
        out.append(e)
    return np.array(out)


def cycles(checks, folder):
    k, Y, H, stiff, drive = 100.0, 2.0, 25.0, 5000.0, 0.1
    path = write_lattice(folder / "one.h5", [[0.0], [1.0]], 0.001, fixed=[1, 0], pairs=[[0, 1]], stiffness=k, rest_length=1.0, damping=20.0,
                         anchors={"particle": [1], "point": [[1.0]], "stiffness": [stiff]}, spring_law="plastic",
                         columns={"yield_force": Y, "hardening": H})
    corners, turns = [(0.0, 0.0)], 2
    for i in range(2 * turns + 1):
        corners += [(corners[-1][0] + (0.5 if i == 0 else 1.0), drive * (-1) ** i)]
        corners += [(corners[-1][0] + 0.3, drive * (-1) ** i)]  # held until it is at rest
    table = folder / "cycles.csv"
    table.write_text("t,x\n" + "".join(f"{t},{u}\n" for t, u in corners))
    end = corners[-1][0]
    options = dict(DIRECT, bs_lattice_file=path, bs_anchor_motion="table", bs_anchor_table=table, ts_dt=0.01, ts_max_time=end)
    # at rest at the ends: stiff (u - q) = k (q - e), e = (k q - Y)/(k + H)
    rate = k * H / (k + H)
    q = (stiff * drive - k * Y / (k + H)) / (stiff + rate)
    e = (k * q - Y) / (k + H)
    for ts in ("beuler", "bdf", "cn", "alpha2", "arkimex"):
        file = folder / f"{ts}.h5md"
        done = run(checks.program, dict(options, ts_type=ts, bs_output=file, bs_output_interval=0))
        out = Trajectory(file)
        with h5py.File(file) as f:
            history = f["backspring/plastic_stretch/value"][:, 0]
        stretch = out.position[:, 1, 0] - out.position[:, 0, 0] - 1.0
        checks.near(f"plastic cycles, {ts}: stretch at the end of a half cycle", stretch[-1], q, 1e-9 if ts == "beuler" else 1e-5)
        checks.near(f"plastic cycles, {ts}: plastic stretch follows the closed form", history, bilinear(stretch, k, Y, H), 1e-12)
        lost = out.observables["dissipated_energy"].ravel()
        checks.near(f"plastic cycles, {ts}: energy dissipated", lost[-1], Y * e * (1 + 4 * turns), 1e-9 if ts == "beuler" else 2e-3)
        checks.true(f"plastic cycles, {ts}: no warning of energy", "energy grew" not in done.stderr)


def given_beyond(checks, folder):
    """Springs that the input holds beyond their yield force have yielded in the first frame, which is said with its energy; a continued run does not repeat it."""
    k, Y, H, n = 100.0, 4.0, 10.0, 4
    lost = (n - 1) * Y * (0.1 * k - Y) / (k + H)
    base = {"bs_lattice_type": "chain", "bs_lattice_size": n, "bs_lattice_rest_length_factor": 0.9, "bs_lattice_stiffness": k, "bs_spring_law": "plastic",
            "bs_spring_hardening": H, "ts_dt": 1e-3, "ts_max_time": 2e-3}
    says = "springs are given beyond their yield force: they have yielded in the first frame, which dissipated "
    for ranks in (1, 3):
        file = folder / f"beyond{ranks}.h5md"
        done = run(checks.program, dict(base, bs_spring_yield_force=Y, bs_output=file, bs_checkpoint=folder / "b.ck", bs_overwrite=True), ranks=ranks)
        checks.true(f"beyond the yield force, {ranks} ranks: said", done.stderr.count(f"{says}{lost:.6g} J") == 1, done.stderr.strip())
        checks.near(f"beyond the yield force, {ranks} ranks: in the first frame's books", Trajectory(file).observables["dissipated_energy"].ravel()[0], lost, 1e-12)
    again = run(checks.program, {"bs_restart": folder / "b.ck", "ts_max_time": 3e-3})
    within = run(checks.program, dict(base, bs_spring_yield_force=1.01 * 0.1 * k))
    checks.true("beyond the yield force: not of a continued run, nor of springs within it", says not in again.stderr + within.stderr, again.stderr + within.stderr)


def yielding_chain(folder):
    """A chain of unequal plastic springs that is hit at one end."""
    n = 14
    rng = np.random.default_rng(2)
    v = np.zeros((n, 2))
    v[-1] = (6.0, 1.0)
    return write_lattice(folder / "chain.h5", np.stack([np.arange(n), 0.1 * rng.uniform(-1, 1, n)], axis=1), 0.5, velocity=v, fixed=[1] + [0] * (n - 1),
                         pairs=[(i, i + 1) for i in range(n - 1)], stiffness=rng.uniform(50, 90, n - 1), damping=0.02, spring_law="plastic",
                         columns={"yield_force": rng.uniform(2, 6, n - 1), "hardening": rng.uniform(0, 20, n - 1)})


def restarts(checks, folder):
    path = yielding_chain(folder)
    for ts, extra in (("beuler", {}), ("cn", {}), ("bdf", {"ts_bdf_order": 2}), ("alpha2", {}), ("rosw", {}), ("arkimex", {}), ("symplectic", {"ts_dt": 0.002}),
                      ("rk", {"ts_rk_type": "4", "ts_dt": 0.002}), ("rk", {"ts_rk_type": "5dp", "ts_dt": 0.002, "ts_adapt_type": "basic"}),
                      ("beuler", {"ts_adapt_type": "basic"})):
        base = dict({"ts_dt": 0.01, "ts_adapt_type": "none", "snes_rtol": 1e-10}, bs_lattice_file=path, ts_type=ts, **extra)
        name = f"-ts_type {ts}" + "".join(f" -{k} {v}" for k, v in extra.items() if k != "ts_dt")
        for ranks in (1, 3) if ts in ("beuler", "symplectic") else (1,):
            saved = folder / "saved.h5"
            whole = run(checks.program, dict(base, ts_max_time=0.6), interval=0.6, ranks=ranks).trajectory
            run(checks.program, dict(base, ts_max_time=0.6, ts_max_steps=23, bs_checkpoint=saved, bs_overwrite=True), expect=None, ranks=ranks)
            lost = whole.observables["dissipated_energy"].ravel()
            for again in (ranks, 4 - ranks):
                rest = run(checks.program, dict(base, bs_restart=saved, bs_checkpoint=folder / "other.h5", bs_overwrite=True, ts_max_time=0.6, ts_max_steps=10 ** 6),
                           interval=0.6, ranks=again).trajectory
                off = np.abs(rest.position[-1] - whole.position[-1]).max() + np.abs(rest.velocity[-1] - whole.velocity[-1]).max()
                exact = again == ranks and "5dp" not in name
                checks.below(f"{name}: continued in the middle of yielding, {ranks} then {again} ranks", off, 0 if exact else 1e-7 if "adapt_type" in extra else 1e-8)
                checks.near(f"{name}: dissipated, {ranks} then {again} ranks", rest.observables["dissipated_energy"].ravel()[-1], lost[-1], 0 if exact else 1e-7)
        checks.true(f"{name}: springs yield before and after", lost[-1] > 1)


def rejected(checks, folder):
    """Attempts that are given up leave no trace: steps that Newton's limit of iterations cuts end as the steps taken outright do."""
    path = yielding_chain(folder)
    base = dict(bs_lattice_file=path, ts_type="beuler", ts_adapt_type="none", snes_rtol=1e-12, ts_max_time=0.2)
    cut = run(checks.program, dict(base, ts_dt=0.1, bs_step_cut=0.25, bs_step_grow_after=1000, snes_max_it=4), interval=0.0)
    checks.true("attempts are rejected", cut.report["rejected"] > 0 if "rejected" in cut.report else "rejected=" in cut.stdout)
    steps = np.diff(cut.trajectory.time)
    same = run(checks.program, dict(base, ts_dt=steps.min()), interval=0.0)
    if np.ptp(steps) < 1e-12:
        checks.below("rejected attempts leave the history alone", np.abs(cut.trajectory.position[-1] - same.trajectory.position[-1]).max(), 1e-9)


def iterative(checks, folder):
    """Yielding and softening springs through the condensed solve's own storage, against a direct one."""
    x, pairs, fixed, v = net(3, 7, 5)
    names = ["polynomial", "plastic", "tension", "hooke"]
    laws = [names[i % 4] for i in range(len(pairs))]
    path = write_lattice(folder / "it.h5", x, 0.2, velocity=3 * v, fixed=fixed, pairs=pairs, stiffness=300.0, rest_length=0.95, laws=laws,
                         columns={"stiffness_2": -900.0, "stiffness_3": 1500.0, "yield_force": 6.0, "hardening": 10.0})
    base = dict(bs_lattice_file=path, bs_gravity=(0, 0, -9.81), ts_type="beuler", ts_dt=0.01, ts_max_time=0.2, snes_rtol=1e-11)
    expected = run(checks.program, dict(base, pc_type="lu", ksp_type="preonly", bs_operator="assembled"), interval=0.2).trajectory.position[-1]
    for name, options in (("condensed, chosen", {}), ("conjugate gradients and bicc", {"condensed_ksp_type": "cg", "condensed_pc_type": "bicc"}),
                          ("-snes_mf", {"snes_mf": True, "snes_rtol": 1e-9}), ("-bs_tangent exact", {"bs_tangent": "exact"})):
        for ranks in (1, 3):
            found = run(checks.program, dict(base, **options), interval=0.2, ranks=ranks)
            checks.below(f"every law through the solvers: {name}, {ranks} rank(s)", np.abs(found.trajectory.position[-1] - expected).max(), 1e-6)


def without_stiffness(checks, folder):
    """Springs that exert nothing, as those that a diluted lattice lacks, may be of any length, zero too: the run is that of the lattice without them."""
    for d in (1, 2, 3):
        x = np.zeros((5, d))
        x[:, 0] = (-1, 1, 3, 4.5, 6)  # the first two meet at t = 1, to the bit
        v = np.zeros((5, d))
        v[:2, 0] = (1, -1)
        for laws in (None, ["hooke", "hooke", "tension"]):
            tied = dict(stiffness=[7.0, 7.0], laws=laws and laws[1:])
            alone = write_lattice(folder / "alone.h5", x, 1.0, velocity=v, pairs=[(2, 3), (3, 4)], rest_length=1.0, **tied)
            slack = write_lattice(folder / "slack.h5", x, 1.0, velocity=v, pairs=[(0, 1), (2, 3), (3, 4)], rest_length=1.0, stiffness=[0.0, 7.0, 7.0], laws=laws)
            for ts in ("symplectic", "verlet", "beuler", "cn"):
                for ranks in (1, 3) if d == 2 else (1,):
                    base = dict(ts_type=ts, ts_dt=0.25, ts_max_time=2, snes_rtol=1e-12, ts_adapt_type="none")
                    a, b = (run(checks.program, dict(base, bs_lattice_file=file), interval=0.25, ranks=ranks).trajectory for file in (alone, slack))
                    name = f"springs without stiffness, {d}-D, {'several laws' if laws else 'one law'}, {ts}, {ranks} rank(s)"
                    met = np.abs(b.position[4, 0] - b.position[4, 1]).max()
                    off = max(np.abs(a.position - b.position).max(), np.abs(a.observables["elastic_energy"] - b.observables["elastic_energy"]).max())
                    checks.true(f"{name}: ends meet, nothing changes", met == 0 and off <= 1e-13, f"distance {met:.3g} m, off by {off:.3g}")


# --- relaxing springs -------------------------------------------------------------------------------------------------

def maxwell(checks, folder):
    """Springs in series with dashpots: decay at constant strain, a mass on one against SciPy, statics, ranks, continued runs."""
    k, tau, e, m = 7.0, 0.3, 0.4, 0.5
    given = dict(pairs=[(0, 1)], stiffness=k, rest_length=1.0, spring_law="maxwell", columns={"relaxation_time": tau})
    held = write_lattice(folder / "held.h5", [[0.0], [1 + e]], m, **given)
    groups = {"bs_group_a": "ids:0", "bs_motion_a": "fixed", "bs_group_b": "ids:1", "bs_motion_b": "fixed", "ts_adapt_type": "none"}
    for ts, h in (("beuler", 0.001), ("beuler", 0.25), ("cn", 0.1), ("bdf", 0.05), ("rosw", 0.1), ("alpha2", 0.1), ("rk", 0.1), ("verlet", 0.02)):
        for start in (0.0, 0.7):
            out = run(checks.program, dict(groups, bs_lattice_file=held, ts_type=ts, ts_dt=h, ts_init_time=start, ts_max_time=start + 20 * h), interval=0.0).trajectory
            left = k * e * np.exp(-(out.time - start) / tau)
            name = f"constant strain, {ts}, h = {h:g} from {start:g}: "
            checks.below(name + "tension k e exp(-t/tau)", np.abs(np.abs(out.observables["reaction/a"].ravel()) - left).max() / (k * e), 1e-14)
            checks.below(name + "energy stored and lost", np.abs(out.observables["elastic_energy"] + out.observables["dissipated_energy"] - k * e * e / 2).max(), 1e-14)

    def rate(_, y):
        return [y[1], -k / m * (y[0] - 1 - y[2]), (y[0] - 1 - y[2]) / tau]
    end = 0.8
    expected = solve_ivp(rate, (0, end), [1 + e, 0.3, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]
    one = write_lattice(folder / "one.h5", [[0.0], [1 + e]], m, velocity=[[0.0], [0.3]], fixed=[1, 0], **given)
    for ts in ("beuler", "cn", "bdf", "rosw", "arkimex", "alpha2", "rk", "symplectic", "verlet"):
        off = [abs(run(checks.program, dict(DIRECT, bs_lattice_file=one, ts_type=ts, ts_dt=h, ts_max_time=end), interval=end).trajectory.position[-1, 1, 0] - expected)
               for h in (0.005, 0.0025)]
        checks.near(f"a mass on a maxwell spring, {ts}: order against SciPy, errors {off[0]:.1e} and {off[1]:.1e}", np.log2(off[0] / off[1]), 1, 0.08)
    pulled = run(checks.program, dict(bs_task="statics", bs_lattice_file=one, bs_gravity=2.0, bs_load_steps=3, snes_rtol=1e-12), interval=0.0).trajectory
    checks.near("statics: a maxwell spring answers with its stiffness", pulled.position[-1, 1, 0], 1 + m * 2.0 / k, 1e-12)

    x, pairs, fixed, v = net(2, 5, 3)
    rng = np.random.default_rng(4)
    names = ["maxwell", "maxwell", "plastic", "hooke"]
    file = write_lattice(folder / "net.h5", x, 0.7, velocity=v, fixed=fixed, pairs=pairs, stiffness=rng.uniform(40, 80, len(pairs)), rest_length=0.95, laws=[names[i % 4] for i in range(len(pairs))],
                         columns={"relaxation_time": rng.uniform(0.05, 0.5, len(pairs)), "yield_force": 3.0, "hardening": 5.0})
    for ts, h in (("beuler", 0.01), ("cn", 0.01), ("bdf", 0.01), ("rosw", 0.01), ("alpha2", 0.01), ("rk", 0.002), ("verlet", 0.002)):
        base = dict(bs_lattice_file=file, bs_gravity=(0, -9.81), ts_type=ts, ts_dt=h, ts_adapt_type="none", snes_rtol=1e-12, ts_max_time=30 * h)
        whole = {ranks: run(checks.program, base, interval=30 * h, ranks=ranks).trajectory for ranks in (1, 3)}
        checks.below(f"relaxing net, {ts}: 3 ranks and 1", np.abs(whole[3].position - whole[1].position).max(), 1e-9)
        for ranks in (1, 3):
            saved = folder / "saved.h5"
            run(checks.program, dict(base, ts_max_steps=13, bs_checkpoint=saved, bs_overwrite=True), expect=None, ranks=ranks)
            rest = run(checks.program, dict(base, bs_restart=saved, bs_checkpoint=folder / "other.h5", bs_overwrite=True, ts_max_steps=10 ** 6), interval=30 * h, ranks=ranks).trajectory
            lost = rest.observables["dissipated_energy"].ravel()[-1] - whole[ranks].observables["dissipated_energy"].ravel()[-1]
            # factors on several ranks do not sum in the same order in every run
            exact = ranks == 1 or ts in ("beuler", "rk", "verlet")
            checks.below(f"relaxing net, {ts}, continued on {ranks} rank(s)", np.abs(rest.position[-1] - whole[ranks].position[-1]).max() + abs(lost), 0 if exact else 1e-12)


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        for group in (fput, cables, mixture, one_of_another_law, cycles, given_beyond, restarts, rejected, iterative, without_stiffness, maxwell):
            if checks.wants(group.__name__):
                with checks.group(group.__name__):
                    group(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
