#!/usr/bin/env python3
"""The energies of static analyses: what is stored, dissipated, broken with springs and released against the work of supports, boxes and loads; what a
lattice that is given under stress releases before its first load step, by closed forms and SciPy; and paths that begin with such a lattice."""
import h5py
import numpy as np
from harness import run_parts, write_lattice
from scipy.optimize import brentq, minimize

STATICS = {"bs_task": "statics"}
NET = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "7,6", "bs_lattice_stiffness": 50, "bs_lattice_fixed": "xmin", "bs_lattice_rest_length_factor": 0.95,
       "bs_lattice_perturbation": 0.05, "bs_lattice_seed": 3}


def books(o):
    """What is stored, lost and released less the work done: the same in all frames, but for the trapezoidal rule of the work."""
    held = sum(o[name].ravel() for name in ("total_energy", "dissipated_energy", "broken_energy", "released_energy") if name in o)
    return held - o["work"].ravel() if "work" in o else held


def closed_forms(checks, folder):
    """A weight on a spring that is given stretched by u, in one dimension: k u^2/2 are released, and with x = 1 + m g s/k what remains is exact."""
    k, m, g, u = 40.0, 2.0, 3.0, 0.3
    path = write_lattice(folder / "one.h5", [[0.0], [1 + u]], m, fixed=[1, 0], pairs=[[0, 1]], stiffness=k, rest_length=1.0)
    for steps in (1, 7):
        run = checks.run({**STATICS, "bs_lattice_file": path, "bs_gravity": g, "bs_load_steps": steps}, interval=0)
        o, s = run.trajectory.observables, run.trajectory.time
        name = f"a weight on a stretched spring, {steps} load steps: "
        checks.near(name + "the first frame is the lattice as it is given", run.trajectory.position[0][np.argsort(run.trajectory.id), 0], [0, 1 + u], 0)
        checks.near(name + "released", o["released_energy"].ravel(), np.where(s > 0, k * u**2 / 2, 0), 1e-14)
        checks.near(name + "work of the weight that grows", o["work/loads"].ravel(), -m * g * (s + m * g * s**2 / (2 * k)), 1e-13)
        checks.near(name + "all the work there is", o["work"].ravel(), o["work/loads"].ravel(), 0)
        checks.near(name + "stored", o["total_energy"].ravel()[1:], (k / 2 * (m * g * s / k) ** 2 - m * g * s * (1 + m * g * s / k))[1:], 1e-13)
        checks.below(name + "the books close", np.ptp(books(o)), 1e-13)
        checks.true(name + "iterations to the rest are told apart", run.report["start_newton"] > 0 and run.report["newton"] >= run.report["start_newton"],
                    f"{run.report['start_newton']} of {run.report['newton']}")
    run = checks.run({**STATICS, "bs_lattice_file": path, "bs_gravity": g, "bs_load_scale": "none"}, interval=0)
    o = run.trajectory.observables
    checks.near("a weight that acts in full from the start: all is released", o["released_energy"].ravel()[-1], k / 2 * (u - m * g / k) ** 2, 1e-13)
    checks.true("and loads that do not grow do no work", "work/loads" not in o and "work" not in o)
    # the plastic spring k_p yields as the mass between two walls comes to rest: k_s e_s = T, T = Y + H e in it
    ks, kp, Y, H, start = 30.0, 50.0, 1.5, 10.0, 0.2
    path = write_lattice(folder / "yields.h5", [[0.0], [1 + start], [3.0]], 1.0, fixed=[1, 0, 1], pairs=[[0, 1], [1, 2]], stiffness=[ks, kp], rest_length=[1.0, 1.4],
                         laws=["hooke", "plastic"], columns={"yield_force": [0.0, Y], "hardening": [0.0, H]})
    run = checks.run({**STATICS, "bs_lattice_file": path}, interval=0, expect=None)
    o = run.trajectory.observables

    def law(l, e0):
        x = kp * (l - 1.4 - e0) - H * e0
        return e0 + np.sign(x) * max(0.0, abs(x) - Y) / (kp + H)
    e0 = law(3.0 - 1 - start, 0.0)
    x = brentq(lambda x: ks * (x - 1) - kp * (3 - x - 1.4 - law(3 - x, e0)), 0.9, 1.9, xtol=1e-15)
    e = law(3 - x, e0)
    stored = [ks / 2 * (p - 1) ** 2 + kp / 2 * (3 - p - 1.4 - q) ** 2 + H / 2 * q**2 for p, q in ((1 + start, e0), (x, e))]
    checks.true("a spring that yields on the way to rest: it does", e > e0 > 0, f"{e0:.4g}, {e:.4g}")
    checks.near("a spring that yields on the way to rest: dissipated", o["dissipated_energy"].ravel(), [Y * e0, Y * e], 1e-13)
    checks.near("a spring that yields on the way to rest: stored", o["total_energy"].ravel(), stored, 1e-13)
    checks.near("a spring that yields on the way to rest: released", o["released_energy"].ravel(), [0, stored[0] - stored[1] - Y * (e - e0)], 1e-13)


def net_at_rest(checks, folder):
    """The energy that a disordered net of strained springs releases, by minimising its energy; the sum is kept over a restart, bit for bit."""
    rng = np.random.default_rng(4)
    i, j = (q.ravel() for q in np.meshgrid(np.arange(6), np.arange(5)))
    x = np.stack([i + 0.5 * (j % 2), 0.9 * j], 1) + rng.uniform(-0.1, 0.1, (30, 2))
    pairs = np.array([(a, b) for a in range(30) for b in range(a + 1, 30) if np.linalg.norm(x[a] - x[b]) < 1.35])
    k, L, m, g = rng.uniform(20, 60, len(pairs)), rng.uniform(0.8, 1.0, len(pairs)), rng.uniform(0.1, 0.3, 30), np.array([0.4, -1.5])
    path = write_lattice(folder / "net.h5", x, m, fixed=i == 0, pairs=pairs, stiffness=k, rest_length=L)
    free = i > 0

    def energy(q, s):
        y = x.copy()
        y[free] = q.reshape(-1, 2)
        d = y[pairs[:, 1]] - y[pairs[:, 0]]
        l = np.linalg.norm(d, axis=1)
        pull, f = (k * (l - L) / l)[:, None] * d, -s * m[:, None] * g
        np.add.at(f, pairs[:, 1], pull)
        np.subtract.at(f, pairs[:, 0], pull)
        return 0.5 * np.sum(k * (l - L) ** 2) - s * np.sum(m[free, None] * g * y[free]), f[free].ravel()
    at_rest = minimize(energy, x[free].ravel(), (0.0,), jac=True, method="BFGS", options={"gtol": 1e-9, "maxiter": 5000})
    loaded = minimize(energy, at_rest.x, (1.0,), jac=True, method="BFGS", options={"gtol": 1e-9, "maxiter": 5000})
    released = energy(x[free].ravel(), 0.0)[0] - at_rest.fun
    base = {**STATICS, "bs_lattice_file": path, "bs_gravity": f"{g[0]},{g[1]}", "bs_load_steps": 12}
    whole = checks.run(base, interval=0)
    o = whole.trajectory.observables
    checks.near("net: energy released before the first load step", o["released_energy"].ravel()[1:], released, 1e-9 * released)
    checks.near("net: energy under the full load", o["total_energy"].ravel()[-1], loaded.fun, 1e-9 * abs(loaded.fun))
    saved = folder / "half.checkpoint"
    checks.run({**base, "bs_checkpoint": saved, "ts_max_steps": 5}, interval=0)
    rest = checks.run({"bs_restart": saved, "ts_max_steps": 5000}, interval=0)
    same = ("total_energy", "released_energy", "work", "work/loads")
    bound = 0 if checks.ranks == 1 else 1e-14  # MUMPS adds up on several ranks as messages arrive
    off = [np.max(np.abs(o[name][6:] - rest.trajectory.observables[name][1:]) / np.max(np.abs(o[name]))) for name in same]
    checks.true("net: continued, the same energies, on one rank in every bit", max(off) <= bound
                and np.abs(whole.trajectory.position[6:] - rest.trajectory.position[1:]).max() <= 10 * bound,
                f"{max(off):.3g}, positions {np.abs(whole.trajectory.position[6:] - rest.trajectory.position[1:]).max():.3g}")
    checks.true("net: and the iterations before the first load step", whole.report["start_newton"] == rest.report["start_newton"] > 0, str(rest.report["start_newton"]))


def second_order(checks, folder):
    """Lattices that are given under stress, by 20 and by 40 load steps: the books close to the error of the trapezoidal rule, which falls to a quarter."""
    rng = np.random.default_rng(5)
    x = np.array([[0.0, 0], [1, 0], [2, 0], [0.4, 1], [1.5, 1.1]])
    held = write_lattice(folder / "anchored.h5", x, 0.5, pairs=[[0, 1], [1, 2], [0, 3], [1, 3], [1, 4], [2, 4], [3, 4]], stiffness=rng.uniform(5, 20, 7), rest_length=0.9,
                         anchors={"particle": [0, 2, 3], "point": x[[0, 2, 3]] - 0.2, "stiffness": [30.0, 20, 10], "rest_length": [0.0, 0.0, 0.0], "damping": [0.0, 0, 0]})
    series = write_lattice(folder / "plastic.h5", [[0.0], [1.1], [2.0], [3.0]], 1.0, fixed=[1, 0, 0, 0], pairs=[[0, 1], [1, 2], [2, 3]], stiffness=[60.0, 80, 70], rest_length=1.0,
                           spring_law="plastic", columns={"yield_force": [1.0, 1.7, 1.3], "hardening": [8.0, 20, 11]})
    with h5py.File(series, "r+") as f:
        f["groups/end"] = [3]
    box = {**NET, "bs_lattice_fixed": None, "bs_lattice_periodic": "xy", "bs_lattice_size": "6,6"}
    pulled = {**NET, "bs_group_r": "xmax", "bs_motion_r": "velocity:0.8,0.5"}
    # under 2 % of the work by 20 steps, and what it leaves falls to a quarter of that by 40, 80
    cases = {"pulled": pulled, "turned": {**NET, "bs_group_r": "xmax", "bs_motion_r": "rotation:0.6,3,2"}, "gravity": {**NET, "bs_gravity": "0.3,-1"},
             "gravity, pulled": {**pulled, "bs_gravity": "0.3,-1"}, "a motion that does not grow, gravity": {**pulled, "bs_gravity": "0.3,-1", "bs_load_scale": "gravity"},
             "a central mass": {**NET, "bs_central_G": 1, "bs_central_M0": 20, "bs_central_point": "9,-2"},
             "two central masses": {**NET, "bs_central_G": 1, "bs_central_M0_a": 20, "bs_central_point_a": "9,-2", "bs_central_M0_b": 15, "bs_central_point_b": "-8,3"},
             "anchors, gravity": {**STATICS, "bs_lattice_file": held, "bs_anchor_motion": "velocity", "bs_anchor_velocity": "0.7,-0.4", "bs_gravity": "0,-2"},
             "strained box": {**box, "bs_box_rate": "xx=0.2,xy=0.1"}, "box under stress": {**box, "bs_box_stress": "xx=3,yy=-1,xy=1"},
             "plastic": {**STATICS, "bs_lattice_file": series, "bs_motion_end": "x=expression:0.3*sin(3*t)"},
             "plastic net": {**pulled, "bs_spring_law": "plastic", "bs_spring_yield_force": 4, "bs_spring_hardening": 20},
             "breaking": {**pulled, "bs_break_strain": 0.16},
             "breaking plastic net": {**pulled, "bs_spring_law": "plastic", "bs_spring_yield_force": 4, "bs_spring_hardening": 20, "bs_break_strain": 0.2},
             "breaking in motion": {**pulled, "bs_break_strain": 0.16, "bs_break_follow": "dynamics"}}
    for name, options in cases.items():
        left, broken = [], []
        for steps in (20, 40):
            run = checks.run({**options, "bs_load_steps": steps}, interval=0)
            o = run.trajectory.observables
            left.append(np.abs(books(o) - books(o)[0]).max())
            broken.append(run.report.get("broken_springs", 0))
            size = np.abs(o["work"]).max()
        told = f"{left[0]:.3g}, {left[1]:.3g} of {size:.3g} J" + (f", {broken} springs broke" if any(broken) else "")
        checks.true(f"{name}: it begins under stress", o["released_energy"].ravel()[1] > 0.01 * size, f"{o['released_energy'].ravel()[1]:.3g} J")
        checks.true(f"{name}: the books close by the second order", left[0] < 2e-2 * size and (left[1] < 0.3 * left[0] or left[0] < 1e-12 * size)
                    and (max(broken) > 0) == ("breaking" in name), told)


def bars(h, rest, k=1.0):
    """Two bars over half a span of 1 with their apex at height h: load, energy stored."""
    l = np.hypot(1, h)
    return 2 * k * h * (rest / l - 1), k * (l - rest) ** 2


def paths(checks, folder):
    """A truss of two bars that is given with its apex at 0.3, 2 % shorter than its bars are without stress: by load, where it snaps through, and by arc length."""
    rest = 1.02 * np.hypot(1, 0.3)
    path = write_lattice(folder / "truss.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0, rest_length=rest)
    top = np.sqrt(rest**2 - 1)
    base = {**STATICS, "bs_lattice_file": path, "bs_gravity": "0,-0.03"}
    run = checks.run({**base, "bs_load_control": "arc", "bs_load_steps": 40}, interval=0)
    o, order = run.trajectory.observables, np.argsort(run.trajectory.id)
    s, h = o["load_factor"].ravel(), run.trajectory.position[:, order[2], 1]
    checks.near("by arc length: it begins as it is given", h[0], 0.3, 0)
    checks.near("by arc length: load of the two bars at every height", 0.03 * s[1:], bars(h[1:], rest)[0], 1e-13)
    checks.true("by arc length: from the unloaded height down", np.all(np.diff(h[1:]) < 0) and 0 < top - h[1] < 0.02, f"{top:.4g} to {h[1]:.4g}")
    checks.near("by arc length: released", o["released_energy"].ravel()[-1], bars(0.3, rest)[1], 1e-14)
    checks.below("by arc length: the books close through both limit points", np.ptp(books(o)), 2e-3 * np.ptp(o["work"]))
    # by load it falls at the limit load from the height of the largest load to that of the other branch: what that releases is in no sum
    heights = np.linspace(0.05, top, 200001)
    limit = heights[np.argmax(bars(heights, rest)[0])]
    load = bars(limit, rest)[0]
    low = brentq(lambda q: bars(q, rest)[0] - load, -0.8, -0.3, xtol=1e-15)
    exact = bars(limit, rest)[1] + load * limit - bars(low, rest)[1] - load * low
    left = []
    for steps in (100, 400):
        run = checks.run({**base, "bs_load_steps": steps}, interval=0)
        left.append(-np.ptp(books(run.trajectory.observables)))
        checks.true(f"by {steps} load steps: the jump is told", run.report["warnings"] == ["snap_through"], str(run.report["warnings"]))
    checks.true("what a snap-through releases stays visible in the books", abs(left[1] + exact) < 0.3 * abs(left[0] + exact) < 0.3 * exact, f"{left} J for {-exact:.6g} J")
    # nets far from equilibrium
    for name, more in (("net", {}), ("net that is squeezed", {"bs_lattice_rest_length_factor": 1.2, "bs_lattice_perturbation": 0.2})):
        options = {**NET, **more, "bs_group_r": "xmax", "bs_motion_r": "velocity:0.5,0.2", "bs_load_steps": 10}
        one, other = (checks.run({**options, **control}, interval=0) for control in ({}, {"bs_load_control": "arc"}))
        checks.near(f"{name}: the end of a path by arc length is that by load", other.trajectory.position[-1], one.trajectory.position[-1], 1e-9)
        checks.near(f"{name}: and the same was released", other.report["last_released_energy"], one.report["last_released_energy"], 1e-10)


def no_rest(checks, folder):
    """A weight on a spring that gives way under it, until another one catches it at its full motion: there is no equilibrium to begin with."""
    path = write_lattice(folder / "falls.h5", [[0.0], [1.0], [5.0]], 1.0, fixed=[1, 0, 0], pairs=[[0, 1], [2, 1]], stiffness=[1.0, 10.0], rest_length=[1.0, 2.0],
                         laws=["polynomial", "tension"], columns={"stiffness_2": [0.0, 0.0], "stiffness_3": [-1.0, 0.0]})
    with h5py.File(path, "r+") as f:
        f["groups/catch"] = [2]
    run = checks.run({**STATICS, "bs_lattice_file": path, "bs_gravity": 0.5, "bs_load_scale": "driven", "bs_motion_catch": "velocity:-6.3"}, interval=0)
    x = run.trajectory.position[-1, np.argsort(run.trajectory.id)[1], 0]
    checks.near("caught", x - 1 - (x - 1) ** 3 + 10 * (x + 1.3 - 2), 0.5, 1e-11)
    checks.true("it is told that nothing is known of the start", run.report["warnings"] == ["start_not_at_rest"] and run.report["last_released_energy"] == [0.0]
                and "in vain" in run.stdout and run.stdout.splitlines()[-1].endswith("warnings=1"), str(run.report["warnings"]))
    # where the first load step fails, the last good state is the lattice at rest: continued, it goes on from there
    path = write_lattice(folder / "softens.h5", [[0.0], [1.2]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=[1.0], rest_length=[1.0], laws=["polynomial"],
                         columns={"stiffness_2": [0.0], "stiffness_3": [-1.0]})
    saved = folder / "first.checkpoint"
    run = checks.run({**STATICS, "bs_lattice_file": path, "bs_gravity": 2, "bs_step_max_cuts": 1, "bs_checkpoint": saved}, interval=0, expect=3)
    checks.near("a first load step that fails: the frame is the lattice as it is given", run.trajectory.position[:, np.argsort(run.trajectory.id)[1], 0], [1.2], 0)
    run = checks.run({"bs_restart": saved, "bs_gravity": 0.3}, interval=0)
    x, o = run.trajectory.position[-1, np.argsort(run.trajectory.id)[1], 0], run.trajectory.observables
    released = 0.5 * 0.2**2 - 0.25 * 0.2**4
    checks.near("continued under a smaller load: where it hangs", x - 1 - (x - 1) ** 3, 0.3, 1e-12)
    checks.near("and what the start released", o["released_energy"].ravel(), released, 1e-14)


if __name__ == "__main__":
    run_parts("energies of static analyses", (closed_forms, net_at_rest, second_order, paths, no_rest))
