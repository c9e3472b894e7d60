#!/usr/bin/env python3
"""That panels of plot.py say what the numbers mean: /usr/bin/python3 tests/postprocess/test_panels.py"""
import contextlib
import io
import os
import shutil
import sys
import tempfile
import unittest

import h5py
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(os.path.dirname(os.path.dirname(HERE)), "postprocess")]
import matplotlib.pyplot as plt  # noqa: E402
import plot  # noqa: E402
import synthetic  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from figures_motion import state_scenes  # noqa: E402


def observable(path, name, value):
    with h5py.File(path, "a") as f:
        group = f.require_group("observables/" + name)
        group["value"], group["time"] = value, f["particles/trajectory/position/time"]


class Panels(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.addCleanup(plt.close, "all")

    def path(self, name):
        return os.path.join(self.folder, name + ".h5md")

    def static(self, name, frames, load=None, **parameters):
        """Load steps of a chain that is drawn out; `load`, where it is not the time of a frame."""
        path = synthetic.chain(self.path(name), 2, frames=frames, parameters={"bs_task": "statics", **parameters})
        with h5py.File(path, "a") as f:
            time = f["particles/trajectory/position/time"]
            time[...] = np.linspace(0, 1, frames)
            load = time[...] if load is None else load
        observable(path, "load_factor", load)
        return path

    def sheet(self, *args):
        """{kind: axes} of the sheet of these arguments."""
        args = plot.parse([*args, "-o", "none.png"])
        with contextlib.ExitStack() as stack:
            runs = [stack.enter_context(open_run(path)) for path in args.files]
            panels = plot.plan(args.kind.split(",") if args.kind else plot.default_kinds(runs), runs, args)
            figure = plot.sheet(panels, args)
        found = {}
        for (kind, *_), ax in zip(panels, [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]):
            found.setdefault(kind, []).append(ax)
        return found

    def curves(self, ax):
        return {line.get_label(): line for line in ax.get_lines()}

    def refused(self, *args):
        with self.assertRaises(RunError) as caught:
            self.sheet(*args)
        return str(caught.exception)

    def test_points_of_short_curves_are_marked(self):
        for frames, mark in ((2, "o"), (9, "o"), (10, "None")):
            panels = self.sheet(self.static(f"s{frames}", frames))
            for kind in ("force", "energy"):
                drawn = [line for line in panels[kind][0].get_lines() if line.get_transform() == panels[kind][0].transData]
                self.assertEqual({line.get_marker() for line in drawn} - {"s"}, {mark}, (kind, frames))

    def test_work_between_load_steps_is_no_test_of_conservation(self):
        path = self.static("s", 5)
        observable(path, "work/loads", np.linspace(0, 2, 5))
        panels = self.sheet(path, "--kind", "energy,drift,budget")
        self.assertIn("work done on it, $W$", self.curves(panels["energy"][0]))
        self.assertFalse([label for label in self.curves(panels["energy"][0]) if label.startswith("lost")])
        self.assertEqual([text.get_text() for text in panels["drift"][0].texts], ["no total energy of a motion in the file"])
        self.assertNotIn("lost", panels["budget"][0].get_legend_handles_labels()[1])

    def test_what_is_booked_is_not_lost(self):
        """E = 1, W = 2 t, D = 1.5 t and B = 0.25 t - 0.3, as a continued run may begin: what is left over is 0.25 t of a kinetic energy of 4."""
        path, t = synthetic.chain(self.path("b"), 2, frames=20), np.linspace(0, 2, 20)
        with h5py.File(path, "a") as f:
            for name, value in (("kinetic_energy", 0 * t + 4), ("potential_energy", 0 * t - 3), ("total_energy", 0 * t + 1)):
                f[f"observables/{name}/value"][...] = value
        for name, value in (("work/wall", 2 * t), ("dissipated_energy", 1.5 * t), ("broken_energy", 0.25 * t - 0.3)):
            observable(path, name, value)
        panels = self.sheet(path, "--kind", "energy,drift")
        curves = self.curves(panels["energy"][0])
        for label, value in (("dissipated, $D$", 1.5 * t), ("broken, $B$", 0.25 * t), ("lost, $E_0+W-E-D-B$", 0.25 * t)):
            np.testing.assert_allclose(curves[label].get_ydata(), value, atol=1e-14)
        np.testing.assert_allclose(panels["drift"][0].get_lines()[0].get_ydata(), -0.25 * t / 4, atol=1e-14)
        self.assertTrue(panels["drift"][0].get_ylabel().startswith("$(E+D+B-E_0-W)"), panels["drift"][0].get_ylabel())

    def test_runs_without_an_axis_in_common_are_refused(self):
        static, arc, moving = self.static("s", 5), self.static("a", 5, bs_load_control="arc"), synthetic.chain(self.path("m"), 2)
        self.assertIn("s.h5md goes by load factor, ", self.refused(static, moving))
        for other in (arc, moving):
            for kind in ("energy", "strain", "steps", "iterations", "momentum", "nonaffine"):
                self.assertIn("no axis in common; plot them one at a time", self.refused(static, other, "--kind", kind))
        self.assertIn("no axis in common", self.refused(static, moving, "--kind", "force"))
        titles = self.sheet(static, moving, "--kind", "state,histogram")
        self.assertEqual(titles["histogram"][0].get_title("left"), "frame -1 of each")
        self.sheet(static, arc, "--kind", "force")
        panel = self.sheet(static, moving, "--kind", "force", "--against", "displacement")["force"][0]
        self.assertIn("displacement of particle", panel.get_xlabel())
        with h5py.File(arc, "a") as f:
            f["particles/trajectory/id"][...] += 100
        self.assertEqual(self.sheet(static, arc, "--kind", "force")["force"][0].get_xlabel(), "displacement [m]")
        self.assertIn("by strain $", self.refused(static, self.strained("b", 5), "--kind", "nonaffine"))
        held = self.static("h", 5)
        observable(held, "reaction/wall", np.ones((5, 2)))
        self.assertIn("write --load", self.refused(static, held, "--kind", "force"))

    def strained(self, name, frames):
        path = self.static(name, frames)
        observable(path, "stress", np.linspace([0, 0, 0], [1, 2, 3], frames))
        with h5py.File(path, "a") as f:
            box = f["particles/trajectory/box"]
            box.attrs["boundary"], box["edges/value"] = np.array([b"periodic", b"periodic"]), np.linspace([2, 2], [2.1, 2], frames)
        return path

    def test_a_modulus_needs_three_strains(self):
        for frames, told in ((2, False), (3, True)):
            path, out = self.strained(f"b{frames}", frames), os.path.join(self.folder, "b.png")
            for words in ([], ["--kind", "stress"]):
                said = io.StringIO()
                with contextlib.redirect_stdout(said):
                    plot.main([path, "-o", out, "--dpi", "40", *words])
                self.assertEqual("modulus" in said.getvalue(), told, said.getvalue())
        self.assertEqual([text.get_text() for text in self.sheet(self.path("b2"), "--kind", "modulus")["modulus"][0].texts], ["no stress at three strains or more in the file"])

    def test_states_of_a_sheet_have_one_window_and_one_scale(self):
        for make in (lambda name, **more: synthetic.chain(self.path(name), 2, **more), lambda name, n=4: synthetic.cube(self.path(name), n)):
            one, other = make("one"), make("other", n=5)
            with h5py.File(other, "a") as f:
                f["particles/trajectory/position/value"][...] *= 3
            panels = self.sheet(one, other, "--kind", "state")["state"]
            self.assertEqual(panels[0].get_xlim(), panels[1].get_xlim())
            self.assertEqual(panels[0].get_ylim(), panels[1].get_ylim())
            with open_run(one) as a, open_run(other) as b:
                alone, wide = state_scenes([a], plot.parse([one, "-o", "n.png"]))[0], state_scenes([a, b], plot.parse([one, "-o", "n.png"]))
            self.assertEqual((wide[0].norm.vmin, wide[0].norm.vmax), (wide[1].norm.vmin, wide[1].norm.vmax))
            self.assertGreater(wide[0].high[0] - wide[0].low[0], 2 * (alone.high[0] - alone.low[0]))

    def test_a_scale_says_where_it_is_exceeded(self):
        """One spring or two of 1000 are strained far more than the others."""
        for high, low, ends in ((3.0, 0.0, "max"), (0.0, -0.5, "min"), (3.0, -0.5, "both"), (0.0, 0.0, "neither")):
            x = np.cumsum(np.r_[0, 1 + 1e-3 * (-1.0) ** np.arange(1000)])
            x[300:] += high
            x[700:] += low
            path = synthetic.write_run(self.path("long"), x[None, :, None], 0 * x[None, :, None], np.zeros(1), np.stack([np.arange(1000), np.arange(1, 1001)], 1), rest=np.ones(1000))
            with open_run(path) as run:
                scene = state_scenes([run], plot.parse([path, "-o", "n.png"]))[0]
            self.assertEqual(scene.beyond(), ends)
            panel = self.sheet(path, "--kind", "state")["state"][0]
            self.assertEqual([ax._colorbar.extend for ax in panel.figure.axes if ax is not panel], [ends])

    def test_limit_points_are_not_those_of_breaks(self):
        for broken, marked in ((None, True), (np.zeros(41), True), (np.r_[np.zeros(20), np.ones(21)], False)):
            path = self.static("s", 41)
            with h5py.File(path, "a") as f:
                f["groups/wall"] = np.array([11])
                f["particles/trajectory/position/value"][:, 11, 0] = 1 + np.linspace(0, 2, 41)
            observable(path, "reaction/wall", np.stack([np.sin(np.linspace(0, 6, 41)), np.zeros(41)], axis=1))
            if broken is not None:
                observable(path, "broken_energy", broken)
            self.assertEqual("limit points" in self.curves(self.sheet(path, "--kind", "force")["force"][0]), marked)

    def test_steps_go_by_load_factor_and_frames_by_motions_too(self):
        moved = np.r_[np.linspace(0, 0.5, 10), np.full(5, 0.5)]
        panels = self.sheet(self.static("m", 15, moved), "--kind", "energy,iterations,steps")
        self.assertEqual([panels[kind][0].get_xlabel() for kind in ("energy", "iterations", "steps")], ["progress: load factor + time in motion [s]", "load factor", "load factor"])
        panels = self.sheet(self.static("s", 15), self.path("m"), "--kind", "energy")
        self.assertEqual(panels["energy"][0].get_xlabel(), "progress: load factor + time in motion [s]")

    def modes(self, count):
        path = synthetic.cube(self.path(f"modes{count}"), 4, frames=1)
        with h5py.File(path, "a") as f:
            x, pairs = f["particles/trajectory/position/value"][0], f["connectivity/bonds"][...]
            f["connectivity/bonds_rest_length"][...] = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1)
            f["modes/omega_squared"], f["modes/shape"], f["modes/motions"] = np.arange(1.0, count + 1), np.ones((count, 64, 3)), np.array([144])
        return path

    def test_pictures_of_modes(self):
        few, many = self.modes(14), self.modes(15)
        panels = self.sheet(many)
        self.assertEqual(list(panels), ["state", "spectrum", "dos"])
        self.assertEqual(list(self.sheet(few)), ["state", "spectrum"])
        said = io.StringIO()
        with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
            plot.main([few, "-o", os.path.join(self.folder, "f.png"), "--dpi", "40"])
        self.assertIn("holds 14 of 144 modes", said.getvalue())
        self.assertEqual(panels["state"][0].get_title("left"), "undeformed")
        self.assertEqual((panels["spectrum"][0].get_ylabel(), panels["dos"][0].get_xlabel()), (r"frequency $\omega/2\pi$ [Hz]", r"frequency $\omega$ [rad/s]"))
        self.assertEqual([text.get_text() for text in panels["dos"][0].get_legend().get_texts()], ["the modes"])

    def test_minus_signs_are_those_of_the_axes(self):
        from figure_style import number
        from load_path import in_words
        self.assertEqual([number(v) for v in (-1.5, -12345.0, 2.0)], ["\N{MINUS SIGN}1.5", "\N{MINUS SIGN}12340", "2"])
        self.assertEqual(in_words(np.array([0.012, -0.99])), "(0.012, \N{MINUS SIGN}0.99)")


if __name__ == "__main__":
    unittest.main(verbosity=1)
