#!/usr/bin/env python3
"""Given forces (/particles/force, -bs_force_NAME): point loads on springs in closed form, an oscillator under a sinusoid with the orders of the methods, loads
that travel, a star dome's path, frequencies and compliance by formulas of its own, reactions, moments and energies, periodic boxes, and continued runs."""
import io
import subprocess

from harness import direct, observed_orders, run_parts, write_lattice
import h5py
import numpy as np
from program import environment, words
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

STATICS = {"bs_task": "statics", "snes_rtol": 1e-13}
K, F = 100.0, 3.0


def named(path, **groups):
    with h5py.File(path, "a") as f:
        for name, rows in groups.items():
            f["groups/" + name] = np.sort(rows)
    return path


def chain(path, dim=1, force=None, n=3):
    """Springs K of length 1 along the last axis, held at the first particle."""
    x = np.zeros((n, dim))
    x[:, -1] = np.arange(n)
    at = np.arange(n)
    columns = {} if force is None else {"force": np.reshape(force, x.shape)}
    write_lattice(path, x, 0.5, fixed=at == 0, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=K, rest_length=1.0, particle_columns=columns)
    return named(path, tip=[n - 1], wall=[0], both=[n - 2, n - 1])


def along(dim, value):
    return ",".join(["0"] * (dim - 1) + [str(value)])


def masks(checks, folder):
    """A group that is given by a truth value for each particle, as numpy makes them, is that of the rows."""
    file = chain(folder / "mask.h5", 2, n=4)
    with h5py.File(file, "a") as f:
        f["groups/mask"] = np.array([False, False, True, True])
        del f["particles/fixed"]
        f["particles/fixed"] = np.array([True, False, False, False])
    found = [checks.run({**STATICS, "bs_lattice_file": file, f"bs_force_{group}": "0,3"}, interval=0).trajectory.position[-1] for group in ("mask", "both")]
    checks.near("forces on a mask and on its rows", found[0], found[1], 0)
    checks.true("they move it", np.abs(found[0].max() - 3) > 1e-3)


def two_springs(checks, folder):
    """3 N on the end of two springs of 100 N/m: 0.03 and 0.06 m, by an option, shared, by the file, and by expression and table at full load."""
    (folder / "ramp.csv").write_text("0,0\n1,3\n")
    for dim in (1, 2, 3):
        plain = chain(folder / f"plain{dim}.h5", dim)
        loaded = chain(folder / f"loaded{dim}.h5", dim, [0.0] * (3 * dim - 1) + [F])
        ways = {"option": (plain, {"bs_force_tip": along(dim, F)}), "file": (loaded, {}), "shared by one": (plain, {"bs_force_tip": along(dim, F) + ",total"}),
                "expression": (plain, {"bs_force_tip": along(dim, "expression:3*t")}), "table": (plain, {"bs_force_tip": along(dim, f"table:{folder / 'ramp.csv'}")}),
                "file and option": (loaded, {"bs_force_wall": along(dim, 7)})}
        ends = {}
        for name, (path, more) in ways.items():
            r = checks.run({**STATICS, "bs_lattice_file": path, "bs_load_steps": 4, **more}, interval=0).trajectory
            s = r.time
            checks.near(f"{dim}D, {name}: displacements", r.position[:, :, -1] - np.arange(3), np.outer(s, [0, 0.03, 0.06]), 1e-13)
            checks.near(f"{dim}D, {name}: the wall bears them, and what acts on it", r.observables["reaction/wall"].reshape(len(s), -1)[:, -1], -(F + (7 if "and" in name else 0)) * s, 1e-11)
            checks.near(f"{dim}D, {name}: force on the tip", r.observables["force/tip"].reshape(len(s), -1)[:, -1], F * s, 1e-15)
            stored, work = r.observables["elastic_energy"].ravel(), r.observables["work/loads"].ravel()
            checks.near(f"{dim}D, {name}: stored", stored, 0.5 * F * 0.06 * s**2, 1e-12)
            checks.near(f"{dim}D, {name}: work of loads that grow, -u dF", work, -0.5 * F * 0.06 * s**2, 1e-12)
            checks.near(f"{dim}D, {name}: and the books close", r.observables["total_energy"].ravel(), work, 1e-13)
            ends[name] = r
        for name in ("file", "shared by one"):
            checks.near(f"{dim}D: {name} is the option, bit for bit", ends[name].position, ends["option"].position, 0)
        halves = checks.run({**STATICS, "bs_lattice_file": plain, "bs_force_both": along(dim, F) + ",total"}, interval=0).trajectory
        checks.near(f"{dim}D: shared evenly by two", halves.position[-1, :, -1] - np.arange(3), [0, 0.03, 0.045], 1e-13)
    kept = checks.run({**STATICS, "bs_lattice_file": loaded, "bs_output": "o.h5md", "bs_output_units": "SI"}, keep=("o.h5md",)).files["o.h5md"]
    with h5py.File(io.BytesIO(kept)) as f:
        checks.near("a trajectory has the forces of the lattice", f["particles/trajectory/applied_force"][...], [[0, 0, 0], [0, 0, 0], [0, 0, F]], 0)
        units = [f[name].attrs["unit"] for name in ("particles/trajectory/applied_force", "observables/force/value", "observables/moment/value")]
        checks.true("with their unit", units == ["kg m s-2", "kg m s-2", "kg m+2 s-2"], str(units))
    (folder / "again.h5md").write_bytes(kept)
    again = checks.run({**STATICS, "bs_lattice_file": folder / "again.h5md"}, interval=0).trajectory
    checks.near("and is a lattice again, that they stretch from where it is", again.position[-1, 2, 2], 2 + 0.06, 1e-12)


def scaled(checks, folder):
    """What -bs_load_scale names grows, the others act in full: forces, by number and by expression, and gravity."""
    path, g = chain(folder / "c.h5"), 0.8
    for text, full in ((str(F), lambda s: F * s), ("expression:5*t^2", lambda s: 5 * s**2)):
        for scale in (None, "forces", "gravity", "gravity,forces", "none"):
            r = checks.run({**STATICS, "bs_lattice_file": path, "bs_load_steps": 5, "bs_gravity": g, "bs_force_tip": text, "bs_load_scale": scale}, interval=0).trajectory
            s = r.time[1:]
            force, weight = (full(s) if scale is None or "forces" in scale else full(1) + 0 * s), 0.5 * g * (s if scale is None or "gravity" in scale else 1 + 0 * s)
            exact = np.stack([(force + 2 * weight) / K, (2 * force + 3 * weight) / K], 1)
            checks.near(f"{text}, scaled: {scale or 'all'}", r.position[1:, 1:, 0] - [1, 2], exact, 1e-13)


def moments(checks, folder):
    """Force and moment of groups about the origin."""
    rng = np.random.default_rng(3)
    x, f = rng.normal(size=(6, 3)), rng.normal(size=(6, 3))
    path = named(write_lattice(folder / "m.h5", x, 1.0, fixed=np.ones(6), particle_columns={"force": f}), a=[0, 1, 2], b=[2, 3], none=[5])
    o = checks.run({**STATICS, "bs_lattice_file": path, "bs_force_b": "1,2,3,total"}, interval=0).trajectory.observables
    f[2:4] += np.array([1, 2, 3]) / 2
    for name, rows in (("", range(6)), ("/a", [0, 1, 2]), ("/b", [2, 3])):
        rows = list(rows)
        checks.near(f"force{name}", o["force" + name][-1], f[rows].sum(0), 1e-14)
        checks.near(f"moment{name}", o["moment" + name][-1], np.cross(x[rows], f[rows]).sum(0), 1e-14)
        checks.near(f"reaction{name}", o["reaction" + name][-1] if name else 0, -f[rows].sum(0) if name else 0, 1e-14)


M, W, A = 0.7, 3.0, 1.3
TYPES = [("beuler", {"ts_type": "beuler"}, 1, 0.15, (400, 800)), ("cn", {"ts_type": "cn"}, 2, 0.15, (50, 100)), ("bdf 2", {"ts_type": "bdf", "ts_bdf_order": 2}, 2, 0.15, (200, 400)),
         ("alpha2", {"ts_type": "alpha2"}, 2, 0.15, (100, 200)), ("arkimex 3", {"ts_type": "arkimex"}, 3, 0.25, (80, 160)),
         ("rosw ra34pw2", {"ts_type": "rosw", "ts_rosw_type": "ra34pw2"}, 3, 0.25, (80, 160)), ("euler", {"ts_type": "euler"}, 1, 0.15, (1600, 3200)),
         ("symplectic", {"ts_type": "symplectic"}, 1, 0.2, (800, 1600)), ("verlet", {"ts_type": "verlet"}, 2, 0.2, (200, 400)), ("rk 4", {"ts_type": "rk", "ts_rk_type": "4"}, 4, 0.25, (80, 160))]


def oscillator(checks, folder):
    """m x'' + k x = A sin(w t) from rest: x = A/(m (w0^2 - w^2)) (sin w t - w/w0 sin w0 t); the work of the force is what the energy gains."""
    T, w0 = 1.2, np.sqrt(K / M)
    path = named(write_lattice(folder / "o.h5", [[0.0], [1.0]], M, fixed=[1, 0], pairs=[[0, 1]], stiffness=K, rest_length=1.0), mass=[1])
    c = A / (M * (w0**2 - W**2))
    x, v = 1 + c * (np.sin(W * T) - W / w0 * np.sin(w0 * T)), c * W * (np.cos(W * T) - np.cos(w0 * T))
    base = {"bs_lattice_file": path, "bs_force_mass": f"expression:{A}*sin({W}*t)", "ts_adapt_type": "none", "ts_max_time": T}
    for name, options, order, band, counts in TYPES:
        solver = direct(checks.ranks) if name.split()[0] in ("beuler", "cn", "bdf", "alpha2", "arkimex", "rosw") else {}
        errors = []
        for n in counts:
            r = checks.run({**base, **solver, **options, "ts_dt": T / n}, interval=T).trajectory
            errors.append(np.hypot(r.position[-1, 1, 0] - x, (r.velocity[-1, 1, 0] - v) / w0))
        found = observed_orders([T / n for n in counts], errors)[-1]
        checks.true(f"{name}: order {order}", abs(found - order) <= band, f"{found:.3f}, errors {errors}")
    o = checks.run({**base, **direct(checks.ranks), "ts_type": "cn", "ts_dt": T / 60, "snes_rtol": 1e-13}, interval=0).trajectory.observables
    checks.below("cn: energy gained is the work of the force", np.abs(o["total_energy"] - o["total_energy"][0] - o["work/forces"]).max() / np.abs(o["work/forces"]).max(), 1e-12)
    steady = {**base, "bs_force_mass": A, **direct(checks.ranks), "ts_type": "cn", "ts_dt": T / 60, "snes_rtol": 1e-13}
    r = checks.run(steady, interval=0).trajectory
    checks.below("cn: a dead load has a potential", np.ptp(r.observables["total_energy"]) / r.observables["elastic_energy"].max(), 1e-12)
    checks.true("and does no other work", not any(name.startswith("work") for name in r.observables))
    kinetic, stored = 0.5 * M * r.velocity[:, 1, 0] ** 2, 0.5 * K * (r.position[:, 1, 0] - 1) ** 2
    checks.near("its potential is -F u", r.observables["potential_energy"].ravel() - stored, -A * (r.position[:, 1, 0] - 1), 1e-13)
    checks.near("kinetic energy", r.observables["kinetic_energy"].ravel(), kinetic, 1e-13)


def jumps(checks, folder):
    """A force that begins where a step ends leaves methods of order 2 their order: m x'' + k x = A step(t - b) step(c - t), x by its two cosines."""
    T, b, c, w0 = 1.2, 0.3, 0.9, np.sqrt(K / M)
    path = named(write_lattice(folder / "j.h5", [[0.0], [1.0]], M, fixed=[1, 0], pairs=[[0, 1]], stiffness=K, rest_length=1.0), mass=[1])
    x, v = (A / K * (f(w0 * (T - c)) - f(w0 * (T - b))) * s for f, s in ((np.cos, 1), (np.sin, -w0)))
    base = {"bs_lattice_file": path, "bs_force_mass": f"expression:{A}*step(t-{b})*step({c}-t)", "ts_adapt_type": "none", "ts_max_time": T}
    for name, options in (("cn", direct(checks.ranks)), ("bdf", direct(checks.ranks)), ("theta", {**direct(checks.ranks), "ts_theta_endpoint": 0}), ("verlet", {})):
        errors, counts = [], (120, 240, 480)
        for n in counts:
            r = checks.run({**base, **options, "ts_type": name, "ts_dt": T / n}, interval=T).trajectory
            errors.append(np.hypot(r.position[-1, 1, 0] - 1 - x, (r.velocity[-1, 1, 0] - v) / w0))
        found = observed_orders([T / n for n in counts], errors)[-1]
        checks.true(f"{name}: order 2", abs(found - 2) <= 0.1, f"{found:.3f}, errors {errors}")


def bends(checks, folder):
    """A support that follows a table, whose rows lie where steps end, shakes a mass by a spring and a damper: m x'' = k (s - x) + d (s' - x'), against SciPy."""
    T, d, rows = 1.2, 4.0, np.array([[0, 0], [0.3, 0.2], [0.6, -0.1], [1.2, 0.1]])
    np.savetxt(folder / "shake.csv", rows, delimiter=",", header="t,s", comments="")
    path = named(write_lattice(folder / "b.h5", [[0.0], [1.0]], M, pairs=[[0, 1]], stiffness=K, rest_length=1.0, damping=d), support=[0])
    y = np.zeros(2)
    for (t0, s0), (t1, s1) in zip(rows, rows[1:]):
        v = (s1 - s0) / (t1 - t0)
        y = solve_ivp(lambda t, y: [y[1], (K * (s0 + v * (t - t0) - y[0]) + d * (v - y[1])) / M], (t0, t1), y, rtol=1e-12, atol=1e-14).y[:, -1]
    base = {"bs_lattice_file": path, "bs_motion_support": f"x=table:{folder / 'shake.csv'}", "ts_adapt_type": "none", "ts_max_time": T}
    for name, options in (("cn", direct(checks.ranks)), ("bdf", direct(checks.ranks)), ("theta", {**direct(checks.ranks), "ts_theta_endpoint": 0}), ("verlet", {})):
        errors, counts = [], (120, 240, 480)
        for n in counts:
            r = checks.run({**base, **options, "ts_type": name, "ts_dt": T / n}, interval=T).trajectory
            errors.append(np.hypot(r.position[-1, 1, 0] - 1 - y[0], (r.velocity[-1, 1, 0] - y[1]) / np.sqrt(K / M)))
        found = observed_orders([T / n for n in counts], errors)[-1]
        checks.true(f"{name}: order 2", abs(found - 2) <= 0.15, f"{found:.3f}, errors {errors}")
    if checks.ranks > 1:
        return
    adapted = {**base, "ts_adapt_type": "basic", "ts_rtol": 1e-8, "ts_atol": 1e-8, "ts_dt": 0.01}
    for name, options in (("rk", {"ts_rk_type": "5dp"}), ("rk", {"ts_rk_type": "3bs"}), ("arkimex", direct(checks.ranks)), ("bdf", direct(checks.ranks)), ("rosw", direct(checks.ranks)), ("cn", direct(checks.ranks))):
        r = checks.run({**adapted, **options, "ts_type": name}, interval=T).trajectory
        off = np.hypot(r.position[-1, 1, 0] - 1 - y[0], (r.velocity[-1, 1, 0] - y[1]) / np.sqrt(K / M))
        checks.below(f"{name} {options.get('ts_rk_type', '')} under error control, whose steps end at the bends", off, 5e-6)


def two_centres(checks, folder):
    """A particle between two masses that are at rest (Euler's problem of two fixed centres): its energy and its second invariant
    L1 L2 + 2 a (m1 cos(theta1) - m2 cos(theta2)) with Li = r_i x v, theta_i the angle of r_i, centres at -a and a; SciPy's path; a third mass on the way; a statics' equilibrium."""
    a, m1, m2 = 1.0, 3.0, 2.0
    centres, masses = np.array([[-a, 0], [a, 0]]), np.array([m1, m2])
    start = np.array([0.3, 1.6, 1.1, 0.2])
    write_lattice(folder / "one.h5", start[None, :2], 0.7, velocity=start[None, 2:])
    both = {"bs_central_G": 1, "bs_central_M0": m1, "bs_central_point": f"{-a},0", "bs_central_M0_b": m2, "bs_central_point_b": f"{a},0"}
    named = {"bs_central_G": 1, "bs_central_M0_b": m2, "bs_central_point_b": f"{a},0", "bs_central_M0_a": m1, "bs_central_point_a": f"{-a},0"}
    motion = {"bs_lattice_file": folder / "one.h5", "ts_max_time": 4.0, "ts_dt": 0.002, "ts_type": "rk", "ts_rk_type": "5dp", "ts_adapt_type": "none"}

    def slope(_, y):
        r = y[:2] - centres
        return np.concatenate([y[2:], -(masses[:, None] * r / np.hypot(*r.T)[:, None] ** 3).sum(0)])

    paths = {}
    for name, options in {"one without a name": both, "both named": named}.items():
        r = checks.run({**motion, **options}, interval=0.5).trajectory
        paths[name] = x, v = r.position[:, 0], r.velocity[:, 0]
        y = solve_ivp(slope, (0, 4), start, "DOP853", t_eval=r.time, rtol=1e-13, atol=1e-13).y.T
        checks.near(f"{name}: the path", np.hstack([x, v]), y, 1e-9)
        to = x[:, None] - centres
        far = np.hypot(to[..., 0], to[..., 1])
        turn = to[..., 0] * v[:, None, 1] - to[..., 1] * v[:, None, 0]
        second = turn.prod(1) + 2 * a * (m1 * to[:, 0, 0] / far[:, 0] - m2 * to[:, 1, 0] / far[:, 1])
        checks.below(f"{name}: the second invariant stays", np.ptp(second), 1e-9)
        checks.near(f"{name}: energy", r.observables["potential_energy"].ravel(), -0.7 * (masses / far).sum(1), 1e-12)
    checks.true("names do not matter", all(np.array_equal(p, q) for p, q in zip(*paths.values())))
    # three masses in the corners of a triangle attract a particle on a soft anchor in the middle no way: it stays, and one of half the mass moves it
    corners = np.stack([np.cos(2 * np.pi * np.arange(3) / 3), np.sin(2 * np.pi * np.arange(3) / 3)], 1)
    write_lattice(folder / "middle.h5", np.zeros((1, 2)), 1.0, anchors={"particle": [0], "point": [[0.0, 0]], "stiffness": [30.0], "rest_length": [0.0], "damping": [0.0]})

    def settled(third):
        mass = np.array([1.0, 1, third])
        options = {f"bs_central_{what}_{k}": value for k in range(3) for what, value in (("M0", mass[k]), ("point", f"{corners[k, 0]!r},{corners[k, 1]!r}"))}
        x = checks.run({**STATICS, "bs_lattice_file": folder / "middle.h5", "bs_central_G": 1, **options}, interval=0).trajectory.position[-1, 0]
        r = x - corners
        return x, -30 * x - (mass[:, None] * r / np.hypot(*r.T)[:, None] ** 3).sum(0)

    x, left = settled(1.0)
    checks.below("three equal masses: it stays", np.abs(x).max(), 1e-12)
    x, left = settled(0.5)
    checks.true("one of half the mass: it leaves", np.hypot(*x) > 0.01, f"{x}")
    checks.below("where all forces balance", np.abs(left).max(), 1e-10)


def travels(checks, folder):
    """A load that travels over a row of particles, which an expression says by where they start; against SciPy's integration."""
    n, T = 12, 1.0
    path = chain(folder / "row.h5", 1, n=n)
    named(path, row=np.arange(1, n))
    x0 = np.arange(1.0, n)

    def rate(t, y):
        u, v = y[: n - 1], y[n - 1:]
        stretch = np.diff(np.concatenate([[0], u]))
        f = 2 * np.exp(-(x0 - 9 * t) ** 2) - K * stretch
        f[:-1] += K * stretch[1:]
        return np.concatenate([v, f / 0.5])

    exact = solve_ivp(rate, (0, T), np.zeros(2 * (n - 1)), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    r = checks.run({"bs_lattice_file": path, "bs_force_row": "expression:2*exp(-(x0-9*t)^2)", "ts_type": "rk", "ts_rk_type": "5dp", "ts_dt": 1e-3, "ts_adapt_type": "none",
                    "ts_max_time": T}, interval=T).trajectory
    checks.near("positions", r.position[-1, 1:, 0] - x0, exact[: n - 1], 1e-11)
    checks.near("velocities", r.velocity[-1, 1:, 0], exact[n - 1:], 1e-10)


# --- a star dome of 24 bars: the crown at 8.216 cm, a ring of radius 25 cm at 6.216 cm, supports on a radius of 43.3 cm -------------------------------------

EA = 96051.0  # N: 303,000 N/cm^2 times 0.317 cm^2


def dome():
    """Places (13, 3), ends of the bars (24, 2), lengths."""
    turn = np.arange(6) * np.pi / 3
    x = np.array([(0, 0, 8.216), *((25 * np.cos(a), 25 * np.sin(a), 6.216) for a in turn), *((43.3 * np.cos(a), 43.3 * np.sin(a), 0) for a in turn + np.pi / 6)])
    bars = np.array([(0, 1 + i) for i in range(6)] + [(1 + i, 1 + (i + 1) % 6) for i in range(6)] + [(1 + i, 7 + i) for i in range(6)] + [(1 + (i + 1) % 6, 7 + i) for i in range(6)])
    return x, bars, np.linalg.norm(x[bars[:, 1]] - x[bars[:, 0]], axis=1)


def dome_forces(u):
    """Forces of the bars on the seven free nodes, and -df/dx, for displacements u (21)."""
    x, bars, L = dome()
    y = x.copy()
    y[:7] += u.reshape(7, 3)
    r = y[bars[:, 1]] - y[bars[:, 0]]
    l = np.linalg.norm(r, axis=1)
    f, S = np.zeros((13, 3)), np.zeros((13, 3, 13, 3))
    for (i, j), R, a, b in zip(bars, r, l, L):
        n, k = R / a, EA / b
        f[i] += k * (a - b) * n
        f[j] -= k * (a - b) * n
        block = k * (np.outer(n, n) + (1 - b / a) * (np.eye(3) - np.outer(n, n)))
        for p, q, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            S[p, :, q] += sign * block
    return f[:7].ravel(), S[:7, :, :7].reshape(21, 21)


def dome_under(w, u=None):
    """Load and displacements where the crown has sunk by w, by Newton's method with the crown held."""
    u = np.zeros(21) if u is None else u.copy()
    u[2], free = -w, np.arange(21) != 2
    for _ in range(50):
        f, S = dome_forces(u)
        if np.abs(f[free]).max() < 1e-11:
            break
        u[free] += np.linalg.solve(S[np.ix_(free, free)], f[free])
    return dome_forces(u)[0][2], u


def dome_limit():
    """Crown's sinking and load where the load is largest: there the tangent is singular. Bars of Green's or of logarithmic strain have it at 29.625 and 29.634."""
    least = lambda w: np.linalg.eigvalsh(dome_forces(dome_under(w)[1])[1])[0]
    w = brentq(least, 0.5, 1.0, xtol=1e-14)
    return w, dome_under(w)[0]


def star_dome(checks, folder):
    x, bars, L = dome()
    at = np.arange(13)
    path = named(write_lattice(folder / "dome.h5", x, 0.2, fixed=at > 6, pairs=bars, stiffness=EA / L, rest_length=L), crown=[0])
    w, limit = dome_limit()
    checks.near("limit of this dome by Newton's method and eigenvalues of its own", limit, 29.62928, 1e-4)
    base = {"bs_lattice_file": path, "bs_force_crown": f"0,0,{-limit}"}
    part = checks.run({**STATICS, **base, "bs_load_steps": 5, "bs_load_scale": "forces", "bs_force_crown": f"0,0,{-0.9 * limit}"}, interval=0).trajectory
    for frame, s in enumerate(part.time):
        exact = brentq(lambda sunk: dome_under(sunk)[0] - 0.9 * limit * s, -0.01, w, xtol=1e-15)
        checks.near(f"below the limit, at {s:.1f} of 0.9 of it: the crown", x[0, 2] - part.position[frame, 0, 2], exact, 1e-8)
    run = checks.run({**STATICS, **base, "bs_load_steps": 40, "bs_load_control": "arc", "bs_arc_end": 1.2, "bs_arc_steps": 500}, interval=0)
    r = run.trajectory
    s, sunk = r.observables["load_factor"].ravel(), x[0, 2] - r.position[:, 0, 2]
    u = np.zeros(21)
    off = 0.0
    for frame in range(len(s)):
        load, u = dome_under(sunk[frame], (r.position[frame, :7] - x[:7]).ravel())
        off = max(off, abs(load / limit - s[frame]), np.abs(u.reshape(7, 3) + x[:7] - r.position[frame, :7]).max())
    checks.below("by arc length through the limit points, loads and places", off, 1e-8)
    first = s[: np.argmax(sunk > 1.6)]
    checks.true("no load above the limit, and close to it", 0.985 < first.max() <= 1 + 1e-8 and run.report["turns"] >= 2, f"{first.max():.6g}, {run.report['turns']} turns")
    unstable = s[r.observables["stability"].ravel() < 0]
    checks.true("the first unstable equilibrium is named by its load factor", f"the first at the load factor {unstable[0]:.10g}," in run.stderr, f"{unstable[0]:.10g}: {run.stderr}")
    frequencies(checks, base, x, w, limit)


def frequencies(checks, base, x, w, limit):
    """Modes about the equilibrium under 0, 0.5 and 0.9 of the limit, and the crown's compliance there; dead loads change the equilibrium alone."""
    for part in (0.0, 0.5, 0.9):
        sunk = brentq(lambda down: dome_under(down)[0] - part * limit, -0.01, w, xtol=1e-15)
        S = dome_forces(dome_under(sunk)[1])[1]
        exact = np.sqrt(np.linalg.eigvalsh(S)[:6] / 0.2) / (2 * np.pi)
        loaded = {**base, "bs_force_crown": f"0,0,{-part * limit}"}
        found = checks.run({**loaded, "bs_task": "modes", "bs_modes": 6, "bs_modes_about": "equilibrium", "snes_rtol": 1e-13, "bs_load_steps": 4}).report
        checks.near(f"frequencies at {part} of the limit", np.sqrt(found["omega_squared"]) / (2 * np.pi) / exact, 1, 1e-8)
        C = np.array(checks.run({**STATICS, **loaded, "bs_compliance_groups": "crown", "bs_load_steps": 4}).report["compliance"]["matrix"]).reshape(3, 3)
        checks.near(f"compliance of the crown at {part} of the limit", C / np.linalg.inv(S)[2, 2], np.linalg.inv(S)[:3, :3] / np.linalg.inv(S)[2, 2], 1e-6)


def boxes(checks, folder):
    """A periodic ring of n springs pulled apart at two particles: both ways between them are springs in series; a net force has no equilibrium."""
    n, apart = 10, 3
    at = np.arange(n)
    shift = np.zeros((n, 1), int)
    shift[-1] = 1
    path = named(write_lattice(folder / "ring.h5", at[:, None].astype(float), 1.0, pairs=np.stack([at, (at + 1) % n], 1), stiffness=K, rest_length=1.0, box=[[float(n)]],
                               shift=shift), a=[0], b=[apart])
    both = {**STATICS, "bs_lattice_file": path, "bs_load_steps": 3}
    r = checks.run({**both, "bs_force_a": -F, "bs_force_b": F}, interval=0).trajectory
    checks.near("opening", r.position[-1, apart, 0] - r.position[-1, 0, 0] - apart, F / (K / apart + K / (n - apart)), 1e-12)
    checks.near("the centre of mass stays", r.position[-1].mean(), at.mean(), 1e-12)
    failed = checks.run({**both, "bs_force_b": F}, interval=0, expect=2)
    checks.true("a net force is refused", "nothing holds particle" in failed.stderr, failed.stderr.strip())
    free = checks.run({"bs_lattice_file": path, "bs_force_b": F, "ts_type": "cn", "ts_dt": 0.01, "ts_max_time": 0.5, **direct(checks.ranks)}, interval=0.5).trajectory
    checks.near("in time the whole is pushed along", free.position[-1].mean() - at.mean(), 0.5 * F / n * 0.25, 1e-10)


def driven(checks, folder):
    """A force on what is driven is borne by what drives it: its reaction and its work, which books the energy of a dead load."""
    path = chain(folder / "d.h5")
    base = {"bs_lattice_file": path, "bs_motion_tip": "x=sinusoid:0.1,0.4", "ts_type": "cn", "ts_dt": 0.01, "ts_max_time": 1.0, "snes_rtol": 1e-13,
            **direct(checks.ranks)}
    plain = checks.run(base, interval=0).trajectory
    loaded = checks.run({**base, "bs_force_tip": F}, interval=0).trajectory
    checks.near("the motion is the same", loaded.position, plain.position, 0)
    checks.near("the reaction bears the force", loaded.observables["reaction/tip"], plain.observables["reaction/tip"] - F, 1e-13)
    o = loaded.observables
    checks.below("energy and work", np.abs(o["total_energy"] - o["total_energy"][0] - o["work"]).max() / np.abs(o["work"]).max(), 1e-12)


def breaks(checks, folder):
    """Two parallel springs, one of which breaks under a load that grows: what the dead load sets free is what the energies lose."""
    path = named(write_lattice(folder / "b.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=[[0, 1], [0, 1]], stiffness=[K, 50.0], rest_length=1.0, columns={"critical_strain": [0.02, 9]}), tip=[1])
    r = checks.run({**STATICS, "bs_lattice_file": path, "bs_force_tip": 6.3, "bs_load_steps": 10, "bs_break": "all"}, interval=0).trajectory
    s, o = r.time, r.observables
    exact = np.where(6.3 * s / 150 > 0.02, 6.3 * s / 50, 6.3 * s / 150)
    checks.near("extension before and after", r.position[:, 1, 0] - 1, exact, 1e-12)
    held = o["total_energy"].ravel() + o["broken_energy"].ravel() + o["released_energy"].ravel() - o["work"].ravel()
    checks.below("the books close", np.ptp(held), 1e-12)


def continued(checks, folder):
    """Stopped half-way and continued: the same bits, the work of the force among them."""
    path = chain(folder / "r.h5", n=5)
    mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []
    for kind in ("cn", "verlet"):
        base = {"bs_lattice_file": path, "ts_type": kind, "ts_dt": 0.01, "ts_adapt_type": "none", "bs_force_tip": "expression:3*sin(4*t)", "bs_force_both": 0.5, "ts_max_time": 0.4,
                "bs_output": "r.h5md", "bs_output_interval": 0.02, "bs_checkpoint": "c", "bs_checkpoint_every": 7}
        whole, parts = folder / (kind + "_whole"), folder / (kind + "_parts")
        for there, *runs in ((whole, words(base)), (parts, [*words(base), "-ts_max_steps", "14"], ["-bs_restart", "c", "-bs_lattice_file", str(path), "-ts_max_steps", "1000"])):
            there.mkdir()
            for given in runs:
                done = subprocess.run([*mpi, checks.program, *given], cwd=there, capture_output=True, text=True, env=environment(checks.ranks))
                checks.true(f"{kind}: {given[0]} {given[1]}", done.returncode == 0, done.stderr.strip()[-300:])
        with h5py.File(whole / "r.h5md") as f, h5py.File(parts / "r.h5md") as g:
            for name in ("particles/trajectory/position", "particles/trajectory/velocity", "observables/work/forces", "observables/total_energy", "observables/force/tip"):
                checks.true(f"{kind} continued, {name}", np.array_equal(f[name + "/value"], g[name + "/value"]))
    base = {**STATICS, "bs_lattice_file": path, "bs_force_tip": "expression:3*t^2", "bs_force_both": 0.5, "bs_load_steps": 6}
    whole = checks.run(base, interval=0).trajectory
    checks.near("statics: tip", whole.position[:, -1, 0] - 4, (4 * 3 * whole.time**2 + (3 + 4) * 0.5 * whole.time) / K, 1e-12)


if __name__ == "__main__":
    run_parts("given forces", (masks, two_springs, scaled, moments, oscillator, jumps, bends, two_centres, travels, star_dome, boxes, driven, breaks, continued))
