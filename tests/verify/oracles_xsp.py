#!/usr/bin/env python3
"""XSpringies scenes: every file is read and accelerates as its equations say; every scene with a reference is run to
its end time by an accurate method, and by backward Euler at halved steps."""
import pathlib
import tempfile

from harness import Checks, direct, observed_orders, read_table
import numpy as np
from scipy.integrate import solve_ivp
from xsp_scene import Scene

# Backward Euler at three steps or more; the others at two.
CLOSELY = ("worm", "pend", "zingy", "square")
SMALL = """#1.0 a net of four masses, one fixed
mass 7 100 300 0 0 -1 0.9
mass 2 140 300 0 5 2 0.9
mass 5 140 260 -3 0 0.5 0.9
mass 9 100 255 0 0 0 0.9
spng 1 7 2 40 1 35
spng 2 2 5 25 0.5 45
spng 3 5 9 30 0 40
spng 4 9 7 30 2 50
spng 5 9 77 30 2 50
cent -1
frce 0 1 10 0
frce 1 0 5 2
frce 2 1 300 1
frce 3 1 500 1
visc 0.3
wall 1 0 1 1
"""


def in_order_of(trajectory, scene, values):
    """Rows of `values` in the scene's order, by the particles' ids."""
    row = {int(i): k for k, i in enumerate(trajectory.id)}
    return values[[row[int(i)] for i in scene.id]]


def check_read(checks, path, scene):
    """One forward Euler step of 1 s: x1 = x0 + v0, v1 = v0 + a(x0, v0)."""
    name = f"{path.stem} as read"
    with checks.group(name):
        r = checks.run({"bs_lattice_file": path, "ts_type": "euler", "ts_dt": 1.0, "ts_max_time": 1.0, "ts_max_steps": 1},
                       interval=1.0, grows=True).trajectory
        ids = sorted(r.id.astype(int)) == sorted(scene.id)
        checks.true(f"{name}, ids", ids, f"{len(r.id)} particles, {len(scene.id)} masses in the file")
        if not ids:
            return
        off = max(np.abs(in_order_of(r, scene, r.position[0]) - scene.x).max(), np.abs(in_order_of(r, scene, r.velocity[0]) - scene.v).max())
        checks.below(f"{name}, start", off, 0.0)
        a = scene.acceleration(scene.x, scene.v)
        off = in_order_of(r, scene, r.velocity[1]) - scene.v - a
        scale = np.abs(a).max() + np.abs(scene.v).max() + (scene.ks * (scene.rest + scene.size())).max(initial=0.0)
        checks.below(f"{name}, acceleration", np.abs(off).max() / max(scale, 1e-300), 1e-13)


def end_state(checks, path, scene, t_end, options):
    r = checks.run({"bs_lattice_file": path, "ts_max_time": t_end, **options}, interval=t_end).trajectory
    k = r.frame_at(t_end)
    return in_order_of(r, scene, r.position[k]), in_order_of(r, scene, r.velocity[k])


def check_accurate(checks, name, path, scene, t_end, x_ref, v_ref):
    with checks.group(f"{name} rk 5dp"):
        x, v = end_state(checks, path, scene, t_end, {"ts_type": "rk", "ts_rk_type": "5dp", "ts_adapt_type": "basic",
                                                      "ts_rtol": 1e-10, "ts_atol": 1e-10, "ts_dt": t_end / 1e4})
        size = max(scene.size(), np.ptp(x_ref, axis=0).max())
        checks.below(f"{name} rk 5dp x", np.abs(x - x_ref).max() / size, 1e-6)
        checks.below(f"{name} rk 5dp v", np.abs(v - v_ref).max() / max(np.abs(v_ref).max(), size / t_end), 1e-6)


def check_backward_euler(checks, name, path, scene, t_end, x_ref):
    """Its error falls as the step. Fast springs damped by the method itself delay that: then the step is halved again."""
    fastest = np.sqrt((scene.ks * (1 / scene.mass[scene.ends[:, 0]] + 1 / scene.mass[scene.ends[:, 1]])).max(initial=1.0))
    coarse = int(np.clip(np.ceil(t_end * fastest * 8), 100, 800))
    least = 3 if checks.full or name in CLOSELY else 2
    steps, errors, orders = [], [], []
    with checks.group(f"{name} beuler"):
        while len(steps) < 5 and not (len(steps) >= least and (0.8 <= orders[-1] <= 1.25 or errors[-1] < 1e-8 * scene.size())):
            n = coarse * 2 ** len(steps)
            o = {"ts_type": "beuler", "ts_adapt_type": "none", "ts_dt": t_end / n, **direct(checks.ranks)}
            steps.append(n)
            errors.append(np.abs(end_state(checks, path, scene, t_end, o)[0] - x_ref).max())
            orders = observed_orders([1 / n for n in steps], errors)
        note = f"error {errors[-1] / scene.size():.2g} of the size at {steps[-1]} steps"
        if errors[-1] < 1e-8 * scene.size():
            checks.true(f"{name} beuler", True, f"{note}: the scene is at rest, or comes to rest")
        else:
            checks.true(f"{name} beuler converges", bool(0.8 <= orders[-1] <= 1.25),
                        "orders " + ", ".join(f"{q:.2f}" for q in orders) + f", {note}")


def built_in(checks):
    """A small scene of our own, against SciPy."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "small.xsp"
        path.write_text(SMALL)
        scene = Scene(path)
        check_read(checks, path, scene)
        n = len(scene.id)
        def rhs(t, y):
            x, v = y.reshape(2, n, 2)
            return np.concatenate([v.ravel(), scene.acceleration(x, v).ravel()])
        y = solve_ivp(rhs, (0, 1), np.concatenate([scene.x.ravel(), scene.v.ravel()]), method="DOP853", rtol=1e-12, atol=1e-10).y
        x, v = y[:, -1].reshape(2, n, 2)
        check_accurate(checks, "small", path, scene, 1.0, x, v)
        check_backward_euler(checks, "small", path, scene, 1.0, x)


def check_scene(checks, path, folder, t_end, growth, note):
    name, scene = path.stem, Scene(path)
    check_read(checks, path, scene)
    if not t_end or float(growth) >= 1e3:
        checks.skip(name, "no end state: " + (note if not t_end else f"a start error grows {growth} times"))
        return
    table = read_table(folder / f"{name}.csv")
    row = {int(i): k for k, i in enumerate(table["id"])}
    at = [row[int(i)] for i in scene.id]
    x_ref, v_ref = (np.stack([table[a][at], table[b][at]], axis=1) for a, b in (("x", "y"), ("vx", "vy")))
    check_accurate(checks, name, path, scene, float(t_end), x_ref, v_ref)
    check_backward_euler(checks, name, path, scene, float(t_end), x_ref)


def main():
    checks = Checks("XSpringies scenes against accurate end states")
    scenes, folder = checks.oracles.parent / "data" / "xsp", checks.oracles / "xsp"
    here = scenes.is_dir() and (folder / "index.csv").exists()
    if checks.wants("small") or not here:
        built_in(checks)
    if not here:
        checks.finish(complete=False)
    index = read_table(folder / "index.csv")
    rows = {name: (t, g, note) for name, t, g, note in zip(*(index[q] for q in ("scene", "t_end", "error_growth", "note")))}
    files = [p for p in sorted(scenes.glob("*.xsp")) if checks.wants(p.stem)]
    checks.each(files, lambda mine, path: check_scene(mine, path, folder, *rows.get(path.stem, ("", "", "not in index.csv"))))
    checks.finish()


if __name__ == "__main__":
    main()
