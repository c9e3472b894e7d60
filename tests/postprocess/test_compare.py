#!/usr/bin/env python3
"""Tests of compare.py and of the lazy frames, on files made by formula."""
import csv
import os
import shutil
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE]
import test_postprocess as base  # noqa: E402
import h5py  # noqa: E402
import numpy as np  # noqa: E402
import synthetic  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from differences import common_frames, compare  # noqa: E402

POSITION, VELOCITY = "particles/trajectory/position/value", "particles/trajectory/velocity/value"


class Lazy(base.Case):
    def test_indexing_is_numpys(self):
        with open_run(synthetic.chain(self.path("c.h5md"), 3)) as run, h5py.File(run.path, "r") as f:
            x = f[POSITION][...]
            self.assertEqual((run.positions.shape, len(run.positions)), ((30, 12, 3), 30))
            rows, mask = [5, -1, 0, 5], np.arange(12) % 3 == 0
            for where in (0, -1, slice(3, 20, 4), slice(None, None, -2), slice(5, 5), (slice(None), 4), (2, slice(1, 5), -1), Ellipsis,
                          (Ellipsis, 0), (slice(2, 9), Ellipsis, 1), rows, np.array(rows), (slice(4), rows), (7, rows, slice(0, 2)),
                          (slice(None), mask), (3, mask, 1), [], np.int64(4), (slice(-3, None), slice(None, None, -1))):
                np.testing.assert_array_equal(run.positions[where], x[where], err_msg=repr(where))
            np.testing.assert_array_equal(np.asarray(run.positions), x)
            np.testing.assert_array_equal(np.array(list(run.velocities)), f[VELOCITY][...])
            for wrong in (30, -31, (0, 12), (0, 0, 0, 0), [0, 30]):
                with self.assertRaises(IndexError):
                    run.positions[wrong]

    def test_a_frame_that_is_not_whole_is_not_there(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:
            f[VELOCITY].resize(17, axis=0)
        with open_run(path) as run:
            self.assertEqual((run.positions.shape, run.positions[-1].tolist()), ((17, 12, 2), run.position(16).tolist()))

    def test_units(self):
        with open_run(synthetic.chain(self.path("c.h5md"), 2)) as run:
            self.assertEqual([run.units[k] for k in ("time", "velocity", "momentum")], ["s", "m/s", "kg m/s"])
            self.assertEqual(set(run.units), {"time", "position", "velocity"} | set(run.series))


class Comparing(base.Case):
    def pair(self, change=None, **more):
        a, b = (synthetic.chain(self.path(n), 2, **more) for n in ("a.h5md", "b.h5md"))
        if change:
            with h5py.File(a, "a") as f:
                change(f)
        return a, b

    def verdict(self, *args, code):
        done = base.tool("compare.py", *args)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        return done

    def test_figures_are_those_computed_by_hand(self):
        noise = np.random.default_rng(3).normal(size=(30, 12, 2)) * 1e-4

        def change(f):
            f[POSITION][...] += noise
        a, b = self.pair(change)
        with open_run(a) as run, open_run(b) as reference:
            d = compare(run, reference, "position")
            off = np.linalg.norm(noise, axis=2)
            np.testing.assert_allclose(d.largest, off.max(axis=1), rtol=1e-9)
            np.testing.assert_allclose(d.rms, np.sqrt((off ** 2).mean(axis=1)), rtol=1e-9)
            np.testing.assert_array_equal(d.worst, off.argmax(axis=1) + 1)  # ids count from 1
            self.assertEqual(compare(run, reference, "velocity").largest.max(), 0.0)
        self.verdict(a, b, "--csv", self.path("d.csv"), "-o", self.path("d.png"), code=1)
        self.picture(self.path("d.png"))
        with open(self.path("d.csv"), newline="", encoding="utf-8") as f:
            rows = list(csv.DictReader(f))
        np.testing.assert_allclose([float(r["position_max"]) for r in rows], off.max(axis=1), rtol=1e-9)

    def test_verdict_and_first_time_above(self):
        def change(f):
            f[POSITION][12:, 7, 0] += 1e-5
            f[POSITION][25, 3, 1] += 1e-3
        a, b = self.pair(change)
        with open_run(a) as run:
            first = f"first at t = {run.times[12]:.9g} (particle 8, 1e-05)"
        said = self.verdict(a, b, "--quiet", code=1).stdout.splitlines()
        self.assertIn(first, said[0])
        self.assertIn("largest difference 0.001", said[0])
        self.assertIn("velocity: same", said[1])
        self.verdict(a, b, "--rtol", 0, "--atol", 1.1e-3, code=0)
        self.verdict(a, b, "--rtol", 0, "--atol", 0.9e-3, code=1)
        self.verdict(a, b, "--rtol", 0, "--quantity", "velocity", code=0)
        self.verdict(a, b, "--to", 0.7, code=0)
        self.verdict(a, b, "--from", 0.7, code=1)

    def test_a_number_that_is_none_is_different(self):
        def change(f):
            f[POSITION][29, 2, 0] = np.nan
        a, b = self.pair(change)
        self.assertIn("particle 3", self.verdict(a, b, "--rtol", 1e9, "--quiet", code=1).stdout)

    def test_particles_in_another_order(self):
        def shuffle(f):
            order = np.random.default_rng(1).permutation(12)
            group = f["particles/trajectory"]
            for name in ("position/value", "velocity/value"):
                group[name][...] = group[name][...][:, order]
            for name in ("id", "mass", "fixed"):
                group[name][...] = group[name][...][order]
        self.verdict(*self.pair(shuffle), "--rtol", 0, code=0)

    def test_common_times_and_between_them(self):
        a = synthetic.chain(self.path("a.h5md"), 2, frames=21)
        b = synthetic.chain(self.path("b.h5md"), 2, frames=31)
        with open_run(a) as run, open_run(b) as reference:
            self.assertEqual(common_frames(run, reference), [(2 * k, 3 * k) for k in range(11)])
        errors = []
        with open_run(synthetic.chain(self.path("dense.h5md"), 2, frames=301)) as dense:
            for frames in (31, 61):  # the cubic's error falls by 2^4
                with open_run(synthetic.chain(self.path("f.h5md"), 2, frames=frames)) as reference:
                    errors.append(compare(dense, reference, "position", None, [(k, None) for k in range(301)]).largest.max())
        self.assertAlmostEqual(np.log2(errors[0] / errors[1]), 4, delta=0.3)
        self.verdict(a, b, "--rtol", 1e-12, code=0)
        self.verdict(a, b, "--rtol", 1e-9, "--interpolate", code=1)
        self.verdict(a, b, "--rtol", 1e-3, "--interpolate", "--quantity", "position", code=0)

    def test_frames_that_only_one_run_has_are_told(self):
        """Of runs that were killed, whichever of the two it is, with other intervals, within the span that is asked for; none are told where every frame has its counterpart."""
        def alone(*args):
            return [line.split("compare.py: ")[1].split(" no counterpart")[0] for line in self.verdict(*args, "--rtol", 1e-3, "--quantity", "position", code=0).stderr.splitlines()]
        whole, coarse = synthetic.chain(self.path("whole.h5md"), 2, frames=31), synthetic.chain(self.path("coarse.h5md"), 2, frames=21)
        for frames in (1, 30):
            cut = self.path(f"cut{frames}.h5md")
            shutil.copy(whole, cut)
            with h5py.File(cut, "a") as f:
                for name in ("position/value", "position/time", "position/step", "velocity/value"):
                    f["particles/trajectory/" + name].resize(frames, axis=0)
            said = f"{31 - frames} of 31 frames of {whole} {'has' if frames == 30 else 'have'}"
            self.assertEqual((alone(cut, whole), alone(whole, cut)), ([said], [said]))
            self.assertEqual(alone(cut, whole, "--quiet"), [])
            with open_run(cut) as run:
                self.assertEqual(alone(cut, whole, "--to", run.times[-1]), [])
            self.assertEqual(alone(cut, whole, "--interpolate"), [said])
            if frames > 1:
                self.assertEqual(alone(whole, cut, "--interpolate"), [said])
        self.assertEqual(alone(coarse, whole), [f"10 of 21 frames of {coarse} have", f"20 of 31 frames of {whole} have"])
        self.assertEqual(alone(coarse, whole, "--interpolate"), [])
        self.assertEqual(alone(whole, whole), [])

    def test_linear_systems(self):
        a, b = synthetic.linear(self.path("a.h5")), synthetic.linear(self.path("b.h5"))
        self.verdict(a, b, code=0)
        with h5py.File(a, "a") as f:
            f["states/value"][10, 1] += 1e-3
        self.assertIn("state i_L", self.verdict(a, b, "--quiet", code=1).stdout)

    def test_what_cannot_be_compared(self):
        a, b = self.pair()
        one, few = synthetic.chain(self.path("one.h5md"), 1), synthetic.chain(self.path("few.h5md"), 2, n=11)
        late = synthetic.chain(self.path("late.h5md"), 2)
        with h5py.File(late, "a") as f:
            f["particles/trajectory/position/time"][...] += 100
        other = synthetic.chain(self.path("other.h5md"), 2)
        with h5py.File(other, "a") as f:
            f["particles/trajectory/id"][4] = 99
        for args, says in (((a, one), "dimension"), ((a, few), "12 particles"), ((a, late), "no time in common"), ((a, other), "particle 5"),
                           ((a, self.path("none.h5md")), "no such file"), ((a, b, "--quantity", "state"), "choose from position, velocity"),
                           ((a, b, "--rtol", -1), "0 or more"), ((a, b, "-o", self.path("x.doc")), "unknown ending")):
            self.refuses("compare.py", *args, says=says)


class Panels(base.Case):
    def axes(self, kind, *paths, **options):
        """The axes with one panel drawn into it."""
        import matplotlib.pyplot as plt
        import figures
        from plot import parse
        runs = [open_run(p) for p in paths]
        for run in runs:
            self.addCleanup(run.close)
        figure = plt.figure()
        self.addCleanup(plt.close, figure)
        args = parse([*paths, "-o", "x.png"])
        vars(args).update(options)
        ax = figure.add_subplot()
        figures.KINDS[kind](ax, runs, [os.path.basename(p) for p in paths], args)
        return ax, runs

    def cloth(self, name="c.h5md", change=None):
        path = synthetic.cloth(self.path(name), 8, frames=12)
        with h5py.File(path, "a") as f:
            kinetic, elastic = f["observables/kinetic_energy/value"][...], f["observables/potential_energy/value"][...]
            group = f.create_group("observables/elastic_energy")
            group["value"], group["time"] = elastic, f["particles/trajectory/position/time"]
            height = (f["particles/trajectory/mass"][...] * f[POSITION][...][:, :, 2]).sum(axis=1)
            f["observables/potential_energy/value"][...] = elastic + 9.8 * height
            f["observables/total_energy/value"][...] = kinetic + elastic + 9.8 * height
            if change:
                change(f)
        return path

    def test_energy_adds_up(self):
        ax, (run,) = self.axes("energy", self.cloth())
        lines = {line.get_label(): line.get_ydata() for line in ax.lines}
        np.testing.assert_allclose(lines["kinetic"] + lines["elastic"] + lines["gravity"], lines["total"], rtol=1e-12)
        np.testing.assert_allclose(lines["lost, $E_0-E$"], lines["total"][0] - lines["total"], atol=1e-14)
        np.testing.assert_allclose(lines["gravity"], 9.8 * (run.positions[:, :, 2] * run.mass).sum(axis=1), rtol=1e-9)

    def test_budget_is_level(self):
        def losing(f):
            total, potential, kinetic = (f[f"observables/{n}_energy/value"] for n in ("total", "potential", "kinetic"))
            total[...] = 5 - np.linspace(0, 1, 12)
            potential[...] = total[...] - kinetic[...]
        ax, (run,) = self.axes("budget", self.cloth(change=losing))
        self.assertEqual([t.get_text() for t in ax.get_legend().get_texts()], ["kinetic", "elastic", "gravity", "lost"])
        x, y = ax.collections[-1].get_paths()[0].vertices.T
        upper = [y[np.isclose(x, t)].max() for t in run.times]
        self.assertAlmostEqual(np.ptp(upper), 0, delta=1e-9)

    def test_histogram_counts_every_spring(self):
        ax, (run,) = self.axes("histogram", self.cloth())
        self.assertEqual(len(ax.patches), 4)
        for patch, row in zip(ax.patches, (0, 4, 7, 11)):
            share, edges, _ = patch.get_data()
            self.assertAlmostEqual(share.sum(), 100, places=9)
            inner = np.histogram(run.strains(row), edges[1:-1])[0] * 100 / len(run.springs)
            np.testing.assert_allclose(share[1:-1], inner, atol=1e-9)

    def test_steps_and_iterations_show_every_row_of_the_log(self):
        path = self.cloth()
        ax, (run,) = self.axes("steps", path)
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), run.log["dt"])
        self.assertEqual(len(ax.lines[1].get_xdata()), int((run.log["rejected"] > 0).sum()))
        ax, _ = self.axes("iterations", path)
        np.testing.assert_array_equal(ax.lines[0].get_ydata(), run.log["newton"])
        np.testing.assert_array_equal(ax.lines[1].get_ydata(), run.log["krylov"])

    def test_frames_side_by_side_share_window_and_colours(self):
        from figures_motion import state_scenes
        from plot import parse, plan
        path = self.cloth()
        args = parse([path, "-o", "x.png", "--frame=0,5,-1"])
        with open_run(path) as run:
            panels = plan(["state", "energy"], [run], args)
            self.assertEqual([(p[0], p[3].frame) for p in panels], [("state", 0), ("state", 5), ("state", -1), ("energy", -1)])
            scenes = [state_scenes([run], p[3])[0] for p in panels[:3]]
            for scene in scenes[1:]:
                np.testing.assert_array_equal([scene.low, scene.high], [scenes[0].low, scenes[0].high])
                self.assertEqual((scene.norm.vmin, scene.norm.vmax), (scenes[0].norm.vmin, scenes[0].norm.vmax))
        self.works("plot.py", path, "-o", self.path("f.png"), "--dpi", 60, "--kind", "state,histogram", "--frame=0,5,-1")
        self.picture(self.path("f.png"))
        self.refuses("plot.py", path, "-o", self.path("f.png"), "--frame=0,99", says="no frame 99")

    def test_several_runs_side_by_side(self):
        paths = [synthetic.cloth(self.path(f"{k}.h5md"), 6, parameters={"ts_type": k, "ts_dt": h}) for k, h in (("bdf", "1"), ("cn", "2"))]
        from plot import run_labels
        with open_run(paths[0]) as a, open_run(paths[1]) as b:
            self.assertEqual(run_labels([a, b]), ["ts_type bdf, ts_dt 1", "ts_type cn, ts_dt 2"])
        self.works("plot.py", *paths, "-o", self.path("s.png"), "--dpi", 60, "--kind", "state,budget,histogram,iterations,phase,paths")
        self.picture(self.path("s.png"))


class Camera(base.Case):
    def scene(self, path, **more):
        from scene import Scene
        run = open_run(path)
        self.addCleanup(run.close)
        return Scene(run, list(range(run.frames)), **more)

    def test_turning_and_following(self):
        path = synthetic.cube(self.path("c.h5md"), 5)
        turning, still = self.scene(path, turn=90.0, azim=10.0), self.scene(path, azim=100.0)
        np.testing.assert_allclose(turning._camera_at(11).basis, still.camera.basis, atol=1e-14)
        followed = self.scene(path, follow=True)
        free = ~followed.run.fixed
        middle = [followed.position(k)[free].mean(axis=0) for k in (0, 5, 11)]
        np.testing.assert_allclose(middle, [middle[0]] * 3, atol=1e-12)
        near = self.scene(path, zoom=2.0)
        np.testing.assert_allclose(near.high - near.low, (self.scene(path).high - self.scene(path).low) / 2)

    def test_a_film_that_turns(self):
        path = synthetic.cube(self.path("c.h5md"), 5, frames=4)
        self.works("movie.py", path, "-o", self.path("t.gif"), "--turn", 120, "--follow", "--zoom", 1.2, "--size", "200x160", "--quiet")
        self.refuses("movie.py", path, "-o", self.path("t.gif"), "--zoom", 0, says="--zoom")

    def test_hidden_discs_may_be_left_out(self):
        import splat
        r = np.random.default_rng(0)
        n = 30000
        points = (r.uniform(-1, 1, (n, 2)), r.uniform(-1, 1, n), r.uniform(size=(n, 3)), np.zeros(n))
        more = ((-1.1, 1.1, -1.1, 1.1), (300, 240), 0.06, (1, 1, 1), False)
        seen = splat._maybe_visible
        few = []
        try:
            splat._maybe_visible = lambda *a: few.append(len(seen(*a))) or seen(*a)
            culled = splat.splat(*points, *more)
            splat._maybe_visible = lambda c, *a: np.arange(len(c))
            np.testing.assert_array_equal(culled, splat.splat(*points, *more))
        finally:
            splat._maybe_visible = seen
        self.assertLess(few[0], 0.75 * n)


class Reading(unittest.TestCase):
    def test_errors_are_run_errors(self):
        with self.assertRaises(RunError):
            open_run("/nowhere/run.h5md")


if __name__ == "__main__":
    unittest.main(verbosity=1)
