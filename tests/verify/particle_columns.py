#!/usr/bin/env python3
"""Numbers of each particle: free particles with a drag coefficient each, /particles/drag, against the closed form
v = v0 exp(-c t/m), x = x0 + v0 m/c (1 - exp(-c t/m)), c = /particles/drag + -bs_stokes_drag; and the column in the trajectory,
which is a lattice again."""
import pathlib
import tempfile

from harness import Checks, direct, observed_orders, write_lattice
import h5py
import numpy as np

T, STOKES = 0.8, 0.25
TYPES = [("rk 4", {"ts_type": "rk", "ts_rk_type": "4"}, 4, (10, 20, 40)),
         ("beuler", {"ts_type": "beuler"}, 1, (200, 400, 800)),
         ("cn", {"ts_type": "cn"}, 2, (40, 80, 160))]


class Particles:
    """Seven particles in the plane, no springs; one of them without drag of its own."""

    def __init__(self):
        rng = np.random.default_rng(17)
        self.x, self.v = rng.uniform(-3, 3, (7, 2)), rng.uniform(1, 4, (7, 2))
        self.m, self.drag = rng.uniform(0.3, 2, 7), rng.uniform(0.2, 3, 7)
        self.drag[4] = 0

    def write(self, path, **columns):
        return write_lattice(path, self.x, self.m, self.v, particle_columns=columns)

    def at(self, t, stokes):
        """Position and velocity at time t, and the rate c/m."""
        rate = ((self.drag + stokes) / self.m)[:, None]
        with np.errstate(invalid="ignore"):
            way = np.where(rate > 0, -np.expm1(-rate * t) / rate, t)
        return self.x + self.v * way, self.v * np.exp(-rate * t), rate


def error(r, x, v):
    return max(np.abs(r.position[-1] - x).max() / np.abs(x).max(), np.abs(r.velocity[-1] - v).max() / np.abs(v).max())


def orders(checks, particles, path):
    x, v, rate = particles.at(T, STOKES)
    for name, options, order, counts in TYPES:
        newton = {} if name.startswith("rk") else direct(checks.ranks)
        errors = []
        for n in counts:
            o = {"bs_lattice_file": path, "bs_stokes_drag": STOKES, "ts_adapt_type": "none", **newton, **options, "ts_dt": T / n, "ts_max_time": T}
            r = checks.run(o, interval=T).trajectory
            errors.append(error(r, x, v))
        found = observed_orders([T / n for n in counts], errors)
        checks.true(f"{name} order {order}", bool(abs(found[-1] - order) <= 0.1),
                    "observed " + ", ".join(f"{q:.3f}" for q in found) + f", error {errors[-1]:.2g}")
        if name == "beuler":
            exact = particles.v / (1 + T / counts[-1] * rate) ** counts[-1]
            checks.below("beuler: its own closed form v0/(1 + h c/m)^n", np.abs(r.velocity[-1] - exact).max() / np.abs(exact).max(), 1e-11)


def trajectory(checks, particles, folder):
    """The column is in the trajectory with its unit; a run from the trajectory goes on with it."""
    base = {"ts_type": "rk", "ts_rk_type": "4", "ts_adapt_type": "none", "ts_dt": T / 400, "ts_max_time": T}
    path = particles.write(folder / "own.h5", drag=particles.drag, radius=np.linspace(0.1, 0.7, 7))
    first = folder / "first.h5md"
    first.write_bytes(checks.run({"bs_lattice_file": path, **base, "bs_output_units": "si"}, interval=T, keep=("run.h5md",)).files["run.h5md"])
    with h5py.File(first) as f:
        for name, value, unit in (("drag", particles.drag, "kg s-1"), ("radius", np.linspace(0.1, 0.7, 7), "m")):
            stored = f["particles/trajectory/" + name]
            checks.true(f"{name} in the trajectory, with its unit", bool(np.array_equal(stored[:], value) and stored.attrs["unit"] == unit),
                        str(stored.attrs["unit"]))
    r = checks.run({"bs_lattice_file": first, **base}, interval=T).trajectory
    x, v, _ = particles.at(2 * T, 0)
    checks.below("a run from the trajectory goes on with the drag", error(r, x, v), 1e-11)
    bare = particles.write(folder / "bare.h5")
    r = checks.run({"bs_lattice_file": bare, **base}, interval=T).trajectory
    checks.below("a lattice without the column has no drag", np.abs(r.velocity[-1] - particles.v).max(), 1e-15)


def main():
    checks = Checks("numbers of each particle")
    particles = Particles()
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        orders(checks, particles, particles.write(folder / "drag.h5", drag=particles.drag))
        trajectory(checks, particles, folder)
    checks.finish()


if __name__ == "__main__":
    main()
