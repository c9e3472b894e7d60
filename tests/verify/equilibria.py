"""Systems at rest under gravity against closed forms."""
import math

from harness import direct, method_options
import numpy as np
from particles import System, columns


def column(checks, scratch, label, z, a, K, m, g):
    """A column in one dimension is linear: one huge backward Euler step is its equilibrium."""
    n, sign = len(z), math.copysign(1, z[-1])
    x = sign * a * np.arange(n)[:, None]
    one, at = np.ones(n - 1), np.arange(n)
    s = System(x, 0 * x, m * np.ones(n), at == 0, np.stack([at[:-1], at[1:]], 1), K * one, a * one, 0 * one, gravity=[-g])
    with checks.group(f"column {label}"):
        h = 1e6
        o = {**s.options(s.write(scratch / f"column_{label}.h5")), **method_options("be", h, 3, checks.ranks)}
        r = checks.run(o, interval=3 * h).trajectory
        checks.near(f"column {label}, layers", r.position[-1, :, 0], z, 1e-11 * a)


def sag(checks, scratch, label, table, K, L, m, g, tolerance):
    """A chain hung from a polygon of unstretched links comes to rest on the discrete elastic catenary: first damped
    small steps, then large ones, which backward Euler damps by itself."""
    x_end = columns(table, "xy")
    n = len(x_end)
    span = x_end[-1, 0] - x_end[0, 0]
    links = n - 1
    # (links - 1)/2 links slope down, one is level, the rest slope up; where the chain is shorter than the span: straight.
    slope = (span - L) / (links - 1) if links * L > span else span / links
    down = -math.sqrt(max(L * L - slope * slope, 0.0))
    dx, dy = np.full(links, slope), np.repeat([down, 0.0, -down], [links // 2, links % 2, links // 2])
    if links * L > span:
        dx[links // 2] = L
    x = x_end[0] + np.concatenate([np.zeros((1, 2)), np.cumsum(np.stack([dx, dy], 1), axis=0)])
    x[-1] = x_end[-1]
    at, one = np.arange(n), np.ones(links)
    s = System(x, 0 * x, m * np.ones(n), (at == 0) | (at == n - 1), np.stack([at[:-1], at[1:]], 1), K * one, L * one, 0 * one,
               gravity=[0, -g], drag=m * 10)
    with checks.group(f"hanging chain {label}"):
        newton = direct(checks.ranks)
        for h, steps, name in ((0.01, 300, "small"), (10.0, 20, "large")):
            o = {**s.options(s.write(scratch / f"sag_{label}_{name}.h5")), "ts_type": "beuler", "ts_dt": h, "ts_max_time": steps * h, **newton}
            r = checks.run(o, interval=steps * h).trajectory
            s.x, s.v = r.position[-1], r.velocity[-1]
        checks.near(f"hanging chain {label}, positions", s.x, x_end, tolerance)
        stretch = np.linalg.norm(np.diff(s.x, axis=0), axis=1) / L - 1
        tension = np.array([float(w) for w in table["tension_of_link_to_next"][:links]])
        checks.near(f"hanging chain {label}, tensions", K * stretch, tension, 4e-16 * K / L + 100 * tolerance)
        checks.near(f"hanging chain {label}, sag", float(x_end[:, 1].min()), float(s.x[:, 1].min()), tolerance)
