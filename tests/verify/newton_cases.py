"""One backward Euler step on which Newton's method has trouble. With the program's own options it must end in a root of
the step equation, at the full step or by smaller ones, and never in an unconverged step."""
from harness import read_table
import numpy as np
from particles import columns


def step_residual(system, x0, v0, x1, v1, h):
    """|M (v1 - v0) - h f(x1, v1)| and |x1 - x0 - h v1| m/h, both in momentum units, largest component."""
    free = ~system.fixed
    kick = system.m[:, None] * (v1 - v0) - h * system.force(x1, v1)
    drift = system.m[:, None] * (x1 - x0 - h * v1) / h
    return max(np.abs(kick[free]).max(), np.abs(drift[free]).max())


def step_back(system, x1, v1, h):
    """The state that one backward Euler step of h takes to (x1, v1): the step equation, read backwards, is explicit."""
    free = ~system.fixed[:, None]
    return np.where(free, x1 - h * v1, x1), np.where(free, v1 - h * system.acceleration(x1, v1), v1)


def check(case):
    """The unique-root cases with the program's own options and with tight ones; `h` is tried once, then smaller steps."""
    for run in case.params["runs"]:
        for label, extra, tolerance in (("default options", {}, 1e-6), ("tight Newton", {"snes_rtol": 1e-12}, 1e-10)):
            check_one(case, run["h"], label, extra, tolerance)


def check_one(case, h, label, extra, tolerance):
    s, checks, name = case.system, case.checks, f"{case.name} h={h:g}, {label}"
    with checks.group(name):
        # No line search, no step control of ours: what the user gets.
        o = {**s.options(case.lattice), "ts_type": "beuler", "ts_dt": h, "ts_max_time": h, **extra}
        r = checks.run(o, interval=h).trajectory
        dts = np.ravel(r.log["dt"])
        checks.near(f"{name} reaches the end", float(r.time[-1]), h, 1e-12 * h)
        checks.near(f"{name} accepted steps ({len(dts)}) add up to it", float(dts.sum()), h, 1e-12 * h)
        # The momentum at stake: what the residual is to be compared with.
        scale = h * np.abs(s.force(s.x, s.v)).max() + (s.m[:, None] * np.abs(s.v)).max()
        x, v = r.position[-1], r.velocity[-1]
        back = (x, v)
        for dt in dts[:0:-1]:
            back = step_back(s, *back, dt)
        # Reading n steps backwards magnifies an error of the last state by up to (1 + (h omega)^2) each; a hundred is allowed.
        grow = min(np.prod([1 + (dt * case.omega()) ** 2 for dt in dts[1:]]), 100.0)
        left = step_residual(s, s.x, s.v, *back, dts[0]) / scale
        checks.below(f"{name} step equation", left, tolerance * grow, f"after {len(dts)} step(s)")
        if (~s.fixed).sum() == 1:
            near, which = nearest_listed(case, x, v, dts)
            checks.below(f"{name} {which}", near, 10 * tolerance * grow)


def nearest_listed(case, x, v, dts):
    """Relative distance to the nearest listed end state: roots of the full step, or equal substeps of it. A net has more
    roots than any list, so for nets the step equation alone decides."""
    n, d = case.system.n, case.system.dim
    if len(dts) == 1:
        listed, which = read_groups(case.folder / "roots.csv", "root", n, d), "is a listed root"
    else:
        listed, which = read_groups(case.folder / "states_be_substeps.csv", "substeps", n, d), "is a listed state"
        if len(dts) not in listed or np.ptp(dts) > 1e-9 * dts[0]:
            return 0.0, f"has {len(dts)} substeps that are not tabulated"
        listed = {len(dts): listed[len(dts)]}
    return min(max(np.abs(x - a).max() / case.size, np.abs(v - b).max() / (1 + np.abs(b).max()))
               for a, b in listed.values()), which


def read_groups(path, key, n, d):
    """{key: (x, v)}: the last n rows (n particles by id) of each key."""
    t, out = read_table(path), {}
    for value in np.unique(t[key]):
        at = np.nonzero(t[key] == value)[0][-n:]
        at = at[np.argsort(t["id"][at])]
        out[int(value)] = (columns(t, "xyz"[:d])[at], columns(t, ["vx", "vy", "vz"][:d])[at])
    return out
