#!/usr/bin/env python3
"""Avalanches of statics, fibre by fibre: what plastic springs store, lose and release in them, steps and times of the motion that is followed, and what is
told where nothing holds any more."""
import math

from breaking import events, ran
import h5py
from harness import run_parts, write_lattice
import numpy as np

STATICS = {"bs_task": "statics", "snes_rtol": 1e-12}
BOOKS = ("kinetic_energy", "potential_energy", "dissipated_energy", "broken_energy", "released_energy")


def observed(folder, *names):
    with h5py.File(folder / "b.h5md") as f:
        at = f["particles/trajectory/position/time"][...]
        return {"clock": at, **{name: f[f"observables/{name}/value"][...] for name in names}}


def plastic_fibres(checks, folder):
    """Two plastic fibres hold a weight that grows; the weaker one breaks and the other yields further, by load steps as far as T - H e = Y says: what has been
    lost, what the broken one stored and what was released then follow. In motion it yields beyond that; what is stored, lost, broken, released and moves is one sum."""
    k, H, Y, steps, F = 2.0, 0.5, 0.1, 20, 0.41
    write_lattice(folder / "l.h5", [[0.0], [0.0], [1.0]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=k, rest_length=1.0,
                  columns={"critical_strain": [0.25, np.inf]})
    base = {**STATICS, "bs_load_steps": steps, "bs_lattice_file": str(folder / "l.h5"), "bs_gravity": F, "bs_spring_law": "plastic", "bs_spring_yield_force": Y,
            "bs_spring_hardening": H, "bs_output_interval": 1 / steps}

    def state(tension):
        """Stretch, what is stored and what has been lost."""
        e = (tension - Y) / H
        return tension / k + e, 0.5 * tension**2 / k + 0.5 * H * e * e, Y * e
    s = math.ceil(2 * (0.25 + Y / H) / (1 / k + 1 / H) / F * steps) / steps
    (u, stored, lost), (u2, stored2, lost2) = state(F * s / 2), state(F * s)
    ran(checks, folder, {**base, "bs_checkpoint": folder / "c", "ts_max_steps": round(s * steps)})
    o = observed(folder, "load_factor", *BOOKS)
    at = np.flatnonzero(np.abs(o["load_factor"] - s) < 1e-12)[-1]
    with h5py.File(folder / "c") as f:
        checks.near("the state behind it is not the way to the one before", f["state/velocity"][...], 0, 0)
    checks.near("the weaker one breaks", events(folder)["load"], [s], 1e-12)
    checks.near("by load steps: lost", o["dissipated_energy"][at], lost + lost2, 1e-10)
    checks.near("by load steps: stored in what broke", o["broken_energy"][at], stored, 1e-10)
    checks.near("by load steps: released", o["released_energy"][at], F * s * (u2 - u) - (stored2 - stored) - (lost2 - lost), 1e-10)
    ran(checks, folder, {**base, "bs_break_follow": "dynamics", "bs_break_output_interval": 0.5})
    o = observed(folder, "load_factor", *BOOKS)
    during = np.flatnonzero(np.abs(o["load_factor"] - s) < 1e-12)
    checks.true("in motion it yields further", np.count_nonzero(o["kinetic_energy"][during] > 1e-3) > 3 and o["dissipated_energy"][during[-1]] > lost + lost2 + 1e-3)
    checks.below("in motion: one sum", np.ptp(sum(o[name] for name in BOOKS)[during]), 1e-10)


def falls(F, k, limit, h):
    """Time at which steps h of backward Euler take a mass of 1 kg, let go at F/2k on a spring k under the weight F, past its limit."""
    u, v, n = F / (2 * k), 0.0, 0
    while u <= limit:
        v = (v + h * (F - k * u)) / (1 + h * h * k)
        u, n = u + h * v, n + 1
    return n * h


def steps_in_motion(checks, folder):
    """A weight on two fibres, of which one breaks, then the other in motion, when the steps have become long: stiff springs beside them make the mean frequency high, and
    with it the time short after which steps grow. The second break makes them short again, so that the fall onto the third fibre is resolved."""
    h, every, F, n = 0.01, 0.05, 0.21, 3
    for name, stiff, limit in (("at once", 0.0, 0.24), ("after a while", 5e4, 0.24)):
        x = [[0.0], [0.0], [-3.0], [1.0]] + [[5.0 + j] for j in range(n)]
        pairs = [[0, 3], [1, 3], [2, 3]] + [[4 + j, 5 + j] for j in range(n - 1)]
        write_lattice(folder / "l.h5", x, 1.0, fixed=[1, 1, 1, 0] + [1] + [0] * (n - 1), pairs=pairs, stiffness=[1.0, 1.0, 0.5] + [stiff or 1.0] * (n - 1),
                      rest_length=[1.0, 1.0, 5.0] + [1.0] * (n - 1), laws=["hooke", "hooke", "tension"] + ["hooke"] * (n - 1),
                      columns={"critical_strain": [0.1, limit] + [np.inf] * n})
        ran(checks, folder, {**STATICS, "bs_load_steps": 40, "bs_lattice_file": str(folder / "l.h5"), "bs_gravity": F, "bs_output_interval": 0.025, "bs_break_follow": "dynamics",
                             "bs_break_dt": h, "bs_break_output_interval": every})
        found = events(folder)
        clock = observed(folder)["clock"]
        first, second = found["time"]
        before, after = (np.diff(clock[(clock >= a) & (clock <= b)]) for a, b in ((first, second), (second, second + 0.4)))
        checks.true(f"{name}: both break", list(found["spring"]) == [0, 1])
        if not stiff:
            checks.near(f"{name}: when", second - first, falls(F * found["load"][0], 1.0, limit, h), 1e-9)
        checks.true(f"{name}: steps before the second break are {'long' if stiff else 'short'}", (before.max() > 1.5 * every) == bool(stiff), f"{before.max():.3g} s")
        checks.true(f"{name}: those after it are short", len(after) > 5 and after.max() < every + 1.5 * h, f"{after.max():.3g} s")
        checks.below(f"{name}: frames are no closer than asked for", every * (1 - 1e-9), np.diff(clock[(clock > first) & (clock < second)]).min())


def nothing_holds(checks, folder):
    """Three fibres under a weight; each that breaks takes the next with it, one at a time."""
    write_lattice(folder / "l.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=[[0, 1]] * 3, stiffness=1.0, rest_length=1.0, columns={"critical_strain": [0.1, 0.12, 0.2]})
    done = ran(checks, folder, {**STATICS, "bs_load_steps": 10, "bs_lattice_file": str(folder / "l.h5"), "bs_gravity": 0.35}, expect=3)
    checks.true("how many had broken is told", "at load factor 0.9 no equilibrium was found after 3 springs had broken" in done.stderr, done.stderr.strip()[-200:])


if __name__ == "__main__":
    run_parts(__doc__, (plastic_fibres, steps_in_motion, nothing_holds))
