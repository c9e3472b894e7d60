#!/usr/bin/env python3
"""States at which a careless step goes wrong: compressed and nearly collapsed springs, huge steps, an inverted cloth,
stiffnesses 1e8 and masses 1e6 apart. Each run ends well; energy and momentum, or a dense solution, say whether it is right."""
import json
import pathlib
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import h5py
import numpy as np
from runs import Checks, run, write_lattice

STEP = {"ts_type": "beuler", "bs_output": "run.h5md", "bs_overwrite": True, "bs_report": "r.json", "bs_progress_interval": -1, "bs_advise": False}


def advance(checks, folder, name, options, ranks=1):
    code, _, err = run(checks, folder, dict(STEP, **options), ranks)
    said = json.loads((folder / "r.json").read_text())
    checks.true(f"{name}: ends well", code == 0, f"{said['steps']} steps, {said['rejected']} rejected, {said['newton']} Newton {err.strip()[:120]}")
    with h5py.File(folder / "run.h5md") as f:
        return {"x": f["particles/trajectory/position/value"][...], "v": f["particles/trajectory/velocity/value"][...],
                "E": f["observables/total_energy/value"][...], "p": f["observables/momentum/value"][...], "t": f["particles/trajectory/position/time"][...]}


def no_gain(checks, name, r):
    """Backward Euler takes energy and gives none; what its Newton leaves undone is below 1e-6 of the start's."""
    checks.true(f"{name}: no energy from nowhere", (r["E"] <= r["E"][0] + 1e-6 * abs(r["E"][0])).all(), f"{r['E'][0]:.6g} J, at most {r['E'].max():.6g} J later")


def pair(length, k, rest=1.0):
    return dict(position=[[0.0, 0.0], [length * 0.8, length * 0.6]], mass=1.0, pairs=[[0, 1]], stiffness=k, rest_length=rest, spring_law="hooke")


def springs(checks, folder):
    for name, lattice, h in (("a spring at 1 % of its length", pair(0.01, 1e6), 0.1), ("at 1e-9 of its length", pair(1e-9, 1e3), 0.01),
                             ("at 1e-9, a large step", pair(1e-9, 1e6), 1.0), ("stretched a thousandfold", pair(1e3, 1e6), 0.1)):
        write_lattice(folder / "l.h5", **lattice)
        r = advance(checks, folder, name, {"bs_lattice_file": "l.h5", "ts_dt": h, "ts_max_time": 20 * h, "bs_output_interval": h})
        no_gain(checks, name, r)
        scale = np.abs(r["v"]).max()
        checks.below(f"{name}: momentum kept", np.abs(r["p"] - r["p"][0]).max(), 1e-7 * scale)
        direction = r["x"][:, 1] - r["x"][:, 0]
        checks.below(f"{name}: stays on its line", np.abs(direction @ np.array([0.6, -0.8])).max(), 1e-6 * np.abs(direction).max())


def large_step(checks, folder):
    block = {"bs_lattice_type": "cubic", "bs_lattice_size": (5, 5, 5), "bs_lattice_spacing": 0.2, "bs_lattice_stiffness": 4000, "bs_lattice_perturbation": 0.05,
             "bs_lattice_velocity": None, "bs_lattice_file": None}
    for h, ranks in ((1.0, 1), (100.0, 1), (1.0, 2)):
        name = f"block, h = {h:g} s, {ranks} rank(s)"
        r = advance(checks, folder, name, dict(block, ts_dt=h, ts_max_time=10 * h, bs_output_interval=h), ranks)
        no_gain(checks, name, r)
        checks.below(f"{name}: at rest in the end", r["E"][-1], 1e-2 * r["E"][0])
        checks.below(f"{name}: momentum stays zero", np.abs(r["p"]).max(), 1e-7 * np.abs(r["v"]).max() * 125)


def inverted_cloth(checks, folder):
    n = 7
    grid = np.array([[i, j, 0.0] for i in range(n) for j in range(n)])
    at = lambda i, j: i * n + j
    pairs = [[at(i, j), at(i + a, j + b)] for i in range(n) for j in range(n) for a, b in ((1, 0), (0, 1), (1, 1), (1, -1)) if i + a < n and 0 <= j + b < n]
    rest = [np.linalg.norm(grid[a] - grid[b]) for a, b in pairs]
    inside = np.array([0 < i < n - 1 and 0 < j < n - 1 for i in range(n) for j in range(n)])
    x = grid.copy()
    x[inside] = 6.0 - x[inside]  # every inner cell turned through half a circle: its edges cross
    x[inside, 2] = 0.01 * np.sin(np.arange(inside.sum()))
    fixed = np.array([i in (0, n - 1) and j in (0, n - 1) for i in range(n) for j in range(n)])
    write_lattice(folder / "cloth.h5", x, 0.1, fixed=fixed, pairs=pairs, stiffness=1000.0, rest_length=rest, damping=0.05)
    for h in (0.01, 0.2):
        name = f"inverted cloth, h = {h:g} s"
        r = advance(checks, folder, name, {"bs_lattice_file": "cloth.h5", "ts_dt": h, "ts_max_time": 20 * h, "bs_output_interval": h})
        no_gain(checks, name, r)
        checks.true(f"{name}: stays within reach", np.isfinite(r["x"]).all() and np.abs(r["x"]).max() < 20)


def ratios(checks, folder):
    """Chains on a line, whose springs are linear while none turns over: backward Euler by a dense solve."""
    n, h, steps = 20, 0.01, 30
    rng = np.random.default_rng(5)
    odd = np.arange(n) % 2 == 1
    for name, mass, k in (("stiffnesses 1e8 apart", np.ones(n), np.where(odd[1:], 1e8, 1.0)), ("masses 1e6 apart", np.where(odd, 1e6, 1.0), np.full(n - 1, 1e4)),
                          ("both", np.where(odd, 1e6, 1.0), np.where(np.arange(n - 1) % 3 == 0, 1e8, 1.0))):
        x, v = np.arange(n) + 1e-4 * rng.standard_normal(n), 1e-2 * rng.standard_normal(n)
        write_lattice(folder / "l.h5", x[:, None], mass, velocity=v[:, None], pairs=[[i, i + 1] for i in range(n - 1)], stiffness=k, rest_length=1.0, spring_law="hooke")
        r = advance(checks, folder, name, {"bs_lattice_file": "l.h5", "ts_dt": h, "ts_max_time": steps * h, "bs_output_interval": h, "snes_rtol": 1e-12})
        K, pull = np.zeros((n, n)), np.zeros(n)
        for i in range(n - 1):
            K[np.ix_([i, i + 1], [i, i + 1])] += k[i] * np.array([[1, -1], [-1, 1]])
            pull[[i, i + 1]] += k[i] * np.array([-1.0, 1.0])  # of the rest length 1
        for _ in range(steps):
            v = np.linalg.solve(np.diag(mass) + h * h * K, mass * v + h * (pull - K @ x))
            x = x + h * v
        no_gain(checks, name, r)
        # rounding of positions of size n, times the ratio 1e8
        checks.below(f"{name}: positions of a dense solve", np.abs(r["x"][-1, :, 0] - x).max(), 1e-7)
        checks.below(f"{name}: velocities of a dense solve", np.abs(r["v"][-1, :, 0] - v).max(), 1e-6)


def main():
    checks = Checks(__doc__)
    for part in (springs, large_step, inverted_cloth, ratios):
        if checks.wants(part.__name__):
            with tempfile.TemporaryDirectory() as folder, checks.group(part.__name__):
                part(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
