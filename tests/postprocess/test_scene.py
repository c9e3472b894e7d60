#!/usr/bin/env python3
"""What pictures draw beside the springs: slack cables, enlarged displacements: /usr/bin/python3 tests/postprocess/test_scene.py"""
import contextlib
import io
import os
import shutil
import sys
import tempfile
import unittest
import unittest.mock

import h5py
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(os.path.dirname(os.path.dirname(HERE)), "postprocess")]
import matplotlib.pyplot as plt  # noqa: E402
import movie  # noqa: E402
import plot  # noqa: E402
import synthetic  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from figure_style import number  # noqa: E402
from matplotlib.collections import LineCollection  # noqa: E402
from matplotlib.colors import to_rgb  # noqa: E402
from scene import Scene  # noqa: E402


class Drawn(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.path = os.path.join(self.folder, "run.h5md")

    def net(self, law="tension", laws=None):
        """A row of five particles, 1 apart, that moves: the first two springs become 0.8 long, the others 1.1 and 1.3."""
        x = np.zeros((2, 5, 2))
        x[0, :, 0], x[1, :, 0] = np.arange(5), [0, 0.8, 1.6, 2.7, 4.0]
        pairs = np.stack([np.arange(4), np.arange(1, 5)], axis=1)
        synthetic.write_run(self.path, x, 0 * x, np.arange(2.0), pairs, rest=np.ones(4), parameters={"bs_spring_law": law})
        if laws:
            with h5py.File(self.path, "a") as f:
                f["connectivity/bonds_law"] = laws
                f["connectivity/bonds_law"].attrs["spring_laws"] = "hooke,tension"
        return self.path

    def lines(self, scene, row):
        """[(segments (n, 2, 2), colours, dotted)] of one frame."""
        figure, ax = plt.subplots()
        scene.setup(ax)
        scene.draw_frame(ax, row)
        found = [(np.array(c.get_segments()), c.get_colors()[:, :3], c.get_linestyle()[0][1] is not None) for c in ax.collections if isinstance(c, LineCollection)]
        limits = np.array([ax.get_xlim(), ax.get_ylim()])
        plt.close(figure)
        return found, limits

    def test_cables_that_are_shorter_than_at_rest_are_slack(self):
        with open_run(self.net()) as run:
            self.assertEqual(run.slack(1).tolist(), [True, True, False, False])
            self.assertEqual(run.slack(0).tolist(), [False] * 4)
            scene = Scene(run, [0, 1])
            (dotted, _, is_dotted), (taut, colors, is_taut_dotted) = self.lines(scene, 1)[0]
            self.assertEqual((is_dotted, is_taut_dotted), (True, False))
            np.testing.assert_allclose(dotted[:, :, 0], [[0, 0.8], [0.8, 1.6]])
            np.testing.assert_allclose(np.sort(taut[:, :, 0], axis=0), [[1.6, 2.7], [2.7, 4.0]])
            self.assertFalse(np.any(np.all(np.isclose(colors, to_rgb(scene.theme.slack)), axis=1)))
            self.assertLessEqual(scene.norm.vmax, 0.3)  # of the taut ones alone
            self.assertIn("dotted: slack", scene.label())

    def test_springs_that_push_are_not(self):
        with open_run(self.net("hooke")) as run:
            self.assertFalse(run.slack(1).any())
            self.assertEqual(len(self.lines(Scene(run, [0, 1]), 1)[0]), 1)
            self.assertNotIn("slack", Scene(run, [0, 1]).label())
        with open_run(self.net(laws=[0, 1, 1, 0])) as run:
            self.assertEqual(run.slack(1).tolist(), [False, True, False, False])

    def test_enlarged_displacements_stand_before_the_first_shape(self):
        with open_run(self.net("hooke")) as run:
            scene = Scene(run, [1], deform=10.0)
            np.testing.assert_allclose(scene.position(1)[:, 0], [0, -1, -2, 0, 4], atol=1e-12)
            (behind, gray, _), (shape, _, _) = self.lines(scene, 1)[0]
            np.testing.assert_allclose(behind[:, :, 0], [[0, 1], [1, 2], [2, 3], [3, 4]], atol=1e-12)
            np.testing.assert_allclose(gray[0], to_rgb(scene.theme.faint))
            np.testing.assert_allclose([shape[:, :, 0].min(), shape[:, :, 0].max()], [-2, 4])
            limits = self.lines(scene, 1)[1]
            self.assertTrue(limits[0, 0] < -2 and limits[0, 1] > 4)
            np.testing.assert_allclose(run.strains(1), [-0.2, -0.2, 0.1, 0.3])  # strains are those of the file
            self.assertEqual(len(self.lines(Scene(run, [1]), 1)[0]), 1)
            self.assertEqual(len(self.lines(Scene(run, [0, 1], deform=1.0, follow=True), 1)[0]), 2)

    def test_pictures_say_so(self):
        picture = os.path.join(self.folder, "p.svg")
        with contextlib.redirect_stdout(io.StringIO()):
            for main, more in ((movie.main, ["--frame", "1", "--quiet"]), (plot.main, ["--kind", "state"])):
                main([self.net(), "-o", picture, "--deform", "3", *more])
                with open(picture, encoding="utf-8") as f:
                    self.assertIn("displacements × 3", f.read())
                main([self.path, "-o", picture, *more])
                with open(picture, encoding="utf-8") as f:
                    self.assertNotIn("displacements", f.read())
        with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()):
            movie.main([self.path, "-o", picture, "--deform", "inf"])

    def test_reactions_point_away_from_the_body(self):
        """As long as the forces are large, the largest 0.16 of the scene; within the window; pulled ends have the arrow's tail, pushed ones its tip."""
        with h5py.File(self.net("hooke"), "a") as f:
            for name, row, force in (("left", 0, [[0, 0], [-3.0, 0]]), ("right", 4, [[0, 0], [-1.0, 1.0]])):
                f[f"groups/{name}"] = [row]
                f[f"observables/reaction/{name}/value"], f[f"observables/reaction/{name}/time"] = force, [0.0, 1.0]
        with open_run(self.path) as run:
            scene = Scene(run, [0, 1], reactions=True)
            arrows = scene.reactions.arrows(1, run.position(1))
            scale = 0.16 * 4 / 3
            for found, (end, tail, tip, size) in zip(arrows, (("tail", [0, 0], [-3 * scale, 0], 3), ("tip", [4 + scale, -scale], [4, 0], np.sqrt(2)))):
                self.assertEqual(found[0], end)
                np.testing.assert_allclose(np.concatenate([*found[1:3], [found[3]]]), [*tail, *tip, size], atol=1e-12)
            self.assertEqual(scene.reactions.arrows(0, run.position(0)), [])
            figure, ax = plt.subplots()
            scene.setup(ax)
            scene.draw_frame(ax, 1)
            self.assertEqual([t.get_text() for t in ax.texts if t.get_text().endswith(" N")], ["3 N", "1.41 N"])
            self.assertTrue(ax.get_xlim()[0] < -3 * scale and ax.get_xlim()[1] > 4 + scale)
            plt.close(figure)

    def test_numbers_of_arrows_and_titles(self):
        for value, form, words in ((1000, ".3g", "1000"), (1234.5, ".3g", "1230"), (0.05, ".3g", "0.05"), (99999, ".3g", "$10^{5}$"), (2.5e6, ".3g", r"$2.5\times10^{6}$"),
                                   (-1e-7, "g", "$-10^{-7}$"), (1.5, ".4g", "1.5"), (0, "g", "0")):
            self.assertEqual(number(value, form), words)

    def test_no_reactions(self):
        """An error where no group has any; of those that are 0 the title says so."""
        with open_run(self.net("hooke")) as run, self.assertRaises(RunError) as caught:
            Scene(run, [0, 1], reactions=True)
        self.assertIn("--reactions: no group has a reaction", str(caught.exception))
        with h5py.File(self.path, "a") as f:
            f["groups/left"] = [0]
            f["observables/reaction/left/value"], f["observables/reaction/left/time"] = np.zeros((2, 2)), [0.0, 1.0]
        with open_run(self.path) as run:
            self.assertEqual(Scene(run, [1], reactions=True).words(), ", reactions 0")

    def test_rounding_is_drawn_as_zero(self):
        """One colour, no bar, and a word in the title; strains of 1e-9 are strains, and so is a single one among many that have none."""
        path = self.net("hooke")
        for size, nothing in ((5e-16, True), (1e-9, False)):
            with h5py.File(path, "a") as f:
                f["particles/trajectory/position/value"][1, :, 0] = np.arange(5)
                f["connectivity/bonds_rest_length"][...] = 1 - size * np.array([0, 1, 2, 4])
            with open_run(path) as run:
                for color in ("strain", "tension"):
                    scene = Scene(run, [1], color)
                    self.assertEqual((scene.nothing, scene.mapping() is None, scene.words()), (nothing, nothing, f", {color} 0" if nothing else ""))
                    colours = self.lines(scene, 1)[0][0][1]
                    self.assertEqual(len(np.unique(colours, axis=0)) == 1, nothing)
                scene = Scene(run, [1], "speed")
                self.assertEqual((scene.nothing, scene.words()), (True, ", speed 0"))
                self.assertEqual(Scene(run, [1], limits=(-1, 1)).nothing, False)
        with h5py.File(path, "a") as f:
            f["connectivity/bonds_rest_length"][...] = 1
        with open_run(path) as run:
            scene = Scene(run, [1])
            with unittest.mock.patch.object(run, "strains", lambda row: np.where(np.arange(4) == 2, 0.1, 1e-16)):
                self.assertAlmostEqual(scene._norm([1], None).vmax, 0.1, delta=1e-2)

    def test_tensions_by_their_laws(self):
        """k = 50, l - L = -0.2, -0.2, 0.1, 0.3, all rest lengths 1: hooke and strain alike, cables only pull."""
        expected = 50 * np.array([-0.2, -0.2, 0.1, 0.3])
        for law, forces in (("hooke", expected), ("strain", expected), ("tension", np.maximum(expected, 0)), ("plastic", None), ("unknown", None)):
            with open_run(self.net(law)) as run:
                found = run.tensions(1)
                self.assertIsNone(found) if forces is None else np.testing.assert_allclose(found, forces, atol=1e-12)
        with h5py.File(self.net("plastic"), "a") as f:
            f["backspring/plastic_stretch/value"] = np.array([[0] * 4, [0, -0.1, 0, 0.2]])
        with open_run(self.path) as run:
            np.testing.assert_allclose(run.tensions(1), 50 * np.array([-0.2, -0.1, 0.1, 0.1]), atol=1e-12)
            scene = Scene(run, [0, 1], color="tension")
            self.assertEqual(scene.label(), "tension [N]")
            self.assertGreater(scene.norm.vmax, 9)
            with self.assertRaisesRegex(RunError, "-bs_output_springs"):
                Scene(run, [0, 1], color="stress")
        carried = np.array([[0.0] * 4, [np.nan, -7, 8, 9]])
        with h5py.File(self.path, "a") as f:  # what the run wrote goes before what its laws say
            for name, values in (("tension", carried), ("stress", 1e4 * carried)):
                f[f"observables/springs/{name}/value"] = values
        with open_run(self.path) as run:
            np.testing.assert_array_equal(run.tensions(1), [0, -7, 8, 9])
            scene = Scene(run, [0, 1], color="stress")
            self.assertEqual(scene.label(), "stress [Pa]")
            np.testing.assert_array_equal(scene.values(1), 1e4 * carried[1])
            self.assertNotIn("springs/tension", run.series)
        with h5py.File(self.net("polynomial"), "a") as f:
            f["connectivity/bonds_stiffness_3"] = np.full(4, 1000.0)
        with open_run(self.path) as run:
            np.testing.assert_allclose(run.tensions(1), expected + [-8, -8, 1, 27], atol=1e-12)

    def test_discs_have_dots_behind(self):
        path = synthetic.cube(os.path.join(self.folder, "c.h5md"), 8, frames=3)
        with open_run(path) as run:
            figure, ax = plt.subplots()
            scene = Scene(run, [2], draw="particles", deform=2.0)
            scene.setup(ax)
            scene.draw_frame(ax, 2)
            self.assertEqual(len(ax.collections[0].get_offsets()), 512)
            plt.close(figure)


if __name__ == "__main__":
    unittest.main(verbosity=1)
