#!/usr/bin/env python3
"""Pictures by the extents of what they are made of: letters do not meet, legends and scale bars cover no data: /usr/bin/python3 tests/postprocess/test_layout.py"""
import contextlib
import io
import itertools
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
import figure_layout  # noqa: E402
import figures  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import movie  # noqa: E402
import plot  # noqa: E402
import synthetic  # noqa: E402
from backspring_io import open_run  # noqa: E402
from faces import is_sheet, three_cliques, triangles_of  # noqa: E402
from figure_style import STYLE, few_powers  # noqa: E402
from matplotlib.text import Annotation  # noqa: E402
from scene import Scene  # noqa: E402


def observable(f, name, value):
    group = f.create_group("observables/" + name)
    group["value"], group["time"] = value, f["particles/trajectory/position/time"]


def loaded(path, scale=1.0):
    """A static analysis of a net in a box that is sheared: everything that panels of statics, boxes and breaks ask for. `scale` makes numbers long."""
    points, pairs = synthetic.grid_lattice((6, 6), 1.0, 1.5)
    load = np.linspace(0, 1, 12)
    x = np.repeat(points[None], 12, axis=0)
    x[:, :, 0] += 0.3 * load[:, None] * points[:, 1] + 0.02 * np.sin(9 * points[:, 0] + points[:, 1]) * load[:, None]
    synthetic.write_run(path, x, 0 * x, load, pairs, fixed=points[:, 1] == 0, parameters={"bs_task": "statics"})
    with h5py.File(path, "a") as f:
        observable(f, "load_factor", load)
        observable(f, "stress", scale * np.stack([load ** 2, -load ** 2, load + load ** 3], axis=1))
        observable(f, "reaction/top", scale * np.stack([np.sin(5 * load), load], axis=1))
        f["groups/top"] = np.flatnonzero(points[:, 1] == 5)
        box = f["particles/trajectory/box"]
        box.attrs["boundary"] = np.array([b"periodic", b"periodic"])
        edges = np.repeat(6 * np.eye(2)[None], 12, axis=0)
        edges[:, 1, 0] = 6 * 0.3 * load
        box["edges/value"] = edges
        f["events/broken/avalanche"] = np.repeat(np.arange(40), 1 + np.arange(40) % 7 ** 2)
    return path


def vibrating(path):
    """Modes of a cube, by formula."""
    synthetic.cube(path, 4, frames=1)
    omega = np.sort(np.random.default_rng(1).uniform(0.2, 30, 150))
    with h5py.File(path, "a") as f:
        f["modes/omega_squared"], f["modes/shape"] = omega ** 2, np.random.default_rng(2).normal(size=(150, 64, 3))
        f["modes/fluctuation"] = np.linspace(0.1, 1, 64) ** 2
    return path


class Layout(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def figure(self, *args):
        """The sheet that plot.py makes of these arguments."""
        made = []
        settle = figure_layout.settle
        try:
            plot.settle = lambda figure: made.append(figure) or settle(figure)
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), unittest.mock.patch("matplotlib.figure.Figure.savefig"):
                plot.main([*map(str, args), "-o", self.path("p.png"), "--dpi", "60"])
        finally:
            plot.settle = settle
        self.addCleanup(plt.close, made[0])
        made[0].canvas.draw()
        return made[0]

    def letters(self, figure):
        """[(words, box)] of all letters in view."""
        renderer, found = figure.canvas.get_renderer(), []
        for ax in figure.axes:
            words = [ax.title, ax._left_title, *ax.texts]
            if ax.axison and ax.name != "3d":
                for axis in (ax.xaxis, ax.yaxis):
                    if axis.get_visible():
                        words += [axis.label, axis.offsetText]
                        found += [("tick", box) for box in figure_layout.shown_labels(axis)]
            legend = ax.get_legend()
            if legend:
                found.append(("legend", legend.get_window_extent(renderer)))
            found += [(w.get_text(), w.get_window_extent(renderer) if not isinstance(w, Annotation) else super(Annotation, w).get_window_extent(renderer))
                      for w in words if w.get_text() and w.get_visible()]
        return found + [("legend of all", legend.get_window_extent(renderer)) for legend in figure.legends]

    def check(self, figure, what):
        found = self.letters(figure)
        for (a, one), (b, other) in itertools.combinations(found, 2):
            apart = one.x1 < other.x0 + 1 or other.x1 < one.x0 + 1 or one.y1 < other.y0 + 1 or other.y1 < one.y0 + 1
            self.assertTrue(apart, f"{what}: '{a}' meets '{b}': {one.extents.round()}, {other.extents.round()}")
        for words, box in found:
            self.assertTrue(box.x0 > -1 and box.y0 > -1 and box.x1 < figure.bbox.x1 + 1 and box.y1 < figure.bbox.y1 + 1, f"{what}: '{words}' leaves the sheet: {box.extents.round()}")
        for ax in figure.axes:
            legend = ax.get_legend()
            if legend and ax.name != "3d":
                box = legend.get_window_extent(figure.canvas.get_renderer()).extents
                self.assertEqual(figure_layout.covered(figure_layout.data_points(ax), box, 0), 0, f"{what}: the legend covers data")

    def test_all_kinds(self):
        runs = {"chain1": synthetic.chain(self.path("1.h5md"), 1), "chain2": synthetic.chain(self.path("2.h5md"), 2), "cube": synthetic.cube(self.path("3.h5md"), 4)}
        motion = [k for k in figures.KINDS if k not in ("states", "sources", "spectrum", "dos", "debye", "participation", "bfactor", "avalanches", "nonaffine", "nonaffine_field",
                                                        "stress", "modulus", "force")]
        seen = set(motion)
        for name, path in runs.items():
            for some in (motion[:5], motion[5:9], motion[9:]):
                self.check(self.figure(path, "--kind", ",".join(some)), f"{name} {some}")
        for name, scale in (("stiff", 123456.0), ("soft", 3.1e-7)):
            kinds = ["force", "stress", "modulus", "avalanches", "nonaffine", "nonaffine_field", "state", "energy"]
            seen.update(kinds)
            self.check(self.figure(loaded(self.path(name + ".h5md"), scale), "--kind", ",".join(kinds)), name)
        kinds = ["spectrum", "dos", "debye", "participation", "bfactor"]
        self.check(self.figure(vibrating(self.path("m.h5md")), "--kind", ",".join(kinds)), "modes")
        self.check(self.figure(synthetic.linear(self.path("l.h5"))), "linear")
        self.assertEqual(seen | set(kinds) | {"states", "sources"}, set(figures.KINDS))

    def test_several_runs_with_long_names(self):
        paths = [synthetic.cloth(self.path(f"{k}.h5md"), 9, parameters={"ts_type": f"arkimex_{k}", "ts_adapt_type": f"basic_{k}", "ts_arkimex_type": "ars443" * k}) for k in (1, 2, 3)]
        self.check(self.figure(*paths, "--kind", "state,histogram,phase,energy,iterations"), "three runs")

    def test_crowded_axes(self):
        """Ticks of many digits in small panels are thinned; a legend over data that fills its panel gets room above them."""
        with plt.rc_context(STYLE):
            figure, ax = plt.subplots(figsize=(1.6, 1.5))
            t = np.linspace(1000000.001, 1000000.009, 200)
            for k in range(4):
                ax.plot(t, np.sin(t * 9e3 * (k + 1)), label=f"a curve {k}")
            ax.xaxis.get_major_formatter().set_useOffset(False)
            ax.legend(loc="upper left", borderaxespad=0).movable = True
            figure.canvas.draw()
            self.assertTrue(figure_layout._crowded(ax.xaxis))
            figure_layout.settle(figure)
            self.assertFalse(figure_layout._crowded(ax.xaxis))
            box = ax.get_legend().get_window_extent(figure.canvas.get_renderer()).extents
            self.assertEqual(figure_layout.covered(figure_layout.data_points(ax), box, 0), 0)
            plt.close(figure)

    def test_panels_that_say_nothing_are_left_out(self):
        varied = synthetic.chain(self.path("v.h5md"), 2)
        with h5py.File(varied, "a") as f:
            f["backspring/log/dt"][5] *= 0.5
        steady = synthetic.chain(self.path("s.h5md"), 2)
        with h5py.File(steady, "a") as f:
            n = len(f["backspring/log/dt"])
            for name, value in (("dt", np.r_[np.full(n - 1, 0.1), 0.03]), ("rejected", np.zeros(n)), ("newton", np.ones(n)), ("krylov", np.zeros(n))):
                f[f"backspring/log/{name}"][...] = value
        with open_run(varied) as a, open_run(steady) as b:
            self.assertEqual(plot.default_kinds([a])[-2:], ["steps", "iterations"])
            self.assertEqual(plot.default_kinds([b]), ["state", "energy", "drift", "phase"])
            self.assertEqual(plot.default_kinds([a, b])[-2:], ["steps", "iterations"])
        with h5py.File(steady, "a") as f:
            energy = f["observables/total_energy/value"]
            energy[...] = energy[0] * (1 + 1e-15 * np.arange(len(energy)).reshape(energy.shape))
        with open_run(steady) as rounding:
            self.assertEqual(plot.default_kinds([rounding]), ["state", "energy", "phase"])

    def test_sources_that_stay_as_they_are_have_no_panel_of_their_own(self):
        path = synthetic.linear(self.path("l.h5"))
        units = lambda *words: [ax.get_ylabel() for ax in self.figure(path, *words).axes]  # noqa: E731
        self.assertEqual(units(), ["state"])
        with h5py.File(path, "a") as f:
            t = f["sources/time"][...]
            for name in ("value", "labels"):
                del f["sources/" + name]
            f["sources/value"], f["sources/labels"] = np.stack([np.sin(t / t[-1]), np.ones(len(t))], axis=1), np.array([b"V1", b"I1"])
            f["sources/units"] = np.array([b"V", b"A"])
        self.assertEqual(units(), ["state", "voltage [V]"])
        self.assertEqual(units("--kind", "sources"), ["voltage [V]", "current [A]"])

    def test_logarithmic_axes_have_two_figures_at_least(self):
        """A histogram of few springs has shares from 1/M on: of one run, of two, and where all strains are one, or rounding."""
        for name, n in (("a", 4), ("b", 7), ("c", 30)):
            synthetic.chain(self.path(name + ".h5md"), 2, n=n)
        synthetic.chain(self.path("d.h5md"), 1, n=9)
        with h5py.File(self.path("d.h5md"), "a") as f:
            f["particles/trajectory/position/value"][...] = f["particles/trajectory/position/value"][:1] * (1 + 1e-15)
        for names in (["a"], ["b"], ["c"], ["d"], ["a", "b"]):
            figure = self.figure(*(self.path(name + ".h5md") for name in names), "--kind", "histogram")
            axis = figure.axes[0].yaxis
            low, high = axis.get_view_interval()
            ticks = [tick.label1.get_text() for tick in axis.get_major_ticks() + axis.get_minor_ticks() if low <= tick.get_loc() <= min(high, 100) and tick.label1.get_text()]
            self.assertGreater(len(ticks), 1, names)
            self.assertNotIn("10^{−1", figure.axes[0].xaxis.get_offset_text().get_text(), names)
        with plt.rc_context(STYLE):
            for low, high in ((25, 160), (4, 5), (1.1, 70), (0.02, 0.3), (3e5, 9e6), (1e-7, 1e3)):
                figure, ax = plt.subplots()
                ax.plot([1, 2], [low, high])
                ax.set_yscale("log")
                ax.set_ylim(low, high)
                few_powers(ax.yaxis)
                self.assertGreater(sum(low <= v <= high for v in ax.get_yticks()), 1, (low, high))
                plt.close(figure)

    def test_marks_at_the_first_step_are_whole(self):
        figure = self.figure(synthetic.chain(self.path("c.h5md"), 2), "--kind", "iterations,steps")
        marks = [line for ax in figure.axes for line in ax.lines if line.get_marker() in ("o", "x") and len(line.get_xdata())]
        self.assertEqual([line.get_clip_on() for line in marks], [False] * 3)

    def test_the_power_of_ten_of_a_colour_bar_lies_beside_the_scene(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:
            f["particles/trajectory/position/value"][...] = f["particles/trajectory/position/value"][:1] * (1 + 1e-5)
            f["connectivity/bonds_rest_length"][...] = np.linalg.norm(np.diff(f["particles/trajectory/position/value"][0] / (1 + 1e-5), axis=0), axis=1)
        figure = self.figure(path, "--kind", "state")
        scene, bar = figure.axes
        words = bar.yaxis.get_offset_text()
        self.assertIn("10^{−5}", words.get_text())
        self.assertGreater(words.get_window_extent(figure.canvas.get_renderer()).x0, scene.get_window_extent().x1)

    def test_options_with_several_values_add_up(self):
        for words in (["--frame=0,2", "--frame=-1"], ["--frame", "0", "--frame=2,-1"]):
            args = plot.parse(["f", "-o", "p.png", *words, "--kind", "state", "--kind=force,energy", "--groups", "a", "--groups", "b,c", "--particles", "1", "--particles", "2"])
            self.assertEqual((args.frames, args.kind, args.groups, args.particles, args.states), ([0, 2, -1], "state,force,energy", ["a", "b", "c"], [1, 2], []))
        args = plot.parse(["f", "-o", "p.png"])
        self.assertEqual((args.frames, args.kind, args.groups), ([-1], None, []))

    def test_units_of_circuits_and_of_short_times(self):
        path = synthetic.linear(self.path("l.h5"))
        labels = lambda figure: [(ax.get_xlabel(), ax.get_ylabel(), [t.get_text() for t in ax.get_legend().get_texts()]) for ax in figure.axes]  # noqa: E731
        self.assertEqual(labels(self.figure(path))[0], ("time $t$ [ms]", "state", ["v_out", "i_L", "v_in"]))
        with h5py.File(path, "a") as f:
            f.create_group("parameters/options").attrs["bs_linear_type"] = "rlc"
            f["states/time"][...] *= 1e-3
        found = labels(self.figure(path, "--kind", "states"))
        self.assertEqual(found, [("time $t$ [µs]", "voltage [V]", ["v_out", "v_in"]), ("time $t$ [µs]", "current [A]", ["i_L"])])
        self.assertEqual(labels(self.figure(path, "--kind", "states", "--states", "v_out,v_in"))[0][1:], ("voltage [V]", ["v_out", "v_in"]))
        with h5py.File(path, "a") as f:
            f["states/units"] = np.array([b"kPa", b"kPa", b"kPa"])
        self.assertEqual(labels(self.figure(path, "--kind", "states"))[0][1], "[kPa]")

    def test_marks_of_scenes_cover_nothing(self):
        """Triad, scale bar and time stamp lie outside of the axes, to which all that moves is clipped, in films that turn, too."""
        for path, more in ((synthetic.cube(self.path("c.h5md"), 6), {"turn": 180.0}), (synthetic.cube(self.path("d.h5md"), 6), {"zoom": 3.0}),
                           (loaded(self.path("l.h5md")), {}), (synthetic.chain(self.path("1.h5md"), 1), {})):
            with open_run(path) as run:
                rows = [0, run.frames // 2, run.frames - 1]
                scene = Scene(run, rows, **more)
                figure, ax, stamp = movie.compose(scene, (640, 400), 100)
                for row in rows:
                    movie.show(scene, ax, stamp, row)
                    figure.canvas.draw()
                    panel, renderer = ax.get_window_extent(), figure.canvas.get_renderer()
                    words = [t for t in ax.texts if isinstance(t, Annotation)]
                    self.assertEqual(len(words) > 1, True)
                    for mark in [*words, stamp]:
                        box = mark.get_window_extent(renderer)
                        self.assertFalse(box.x1 > panel.x0 + 1 and box.x0 < panel.x1 - 1 and box.y1 > panel.y0 + 1 and box.y0 < panel.y1 - 1, f"{path} {more} {row}: {mark}")
                        self.assertTrue(box.x0 >= -1 and box.y0 >= -1 and box.y1 <= 401, f"{mark} leaves the picture: {box.extents}")
                    self.assertTrue(all(a.get_clip_on() for a in ax._backspring if a not in words))
                plt.close(figure)


class Triangles(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)

    def test_triples_as_counted_one_by_one(self):
        rng = np.random.default_rng(3)
        pairs = np.array([p for p in itertools.combinations(range(14), 2) if rng.random() < 0.4])
        joined = {tuple(p) for p in pairs.tolist()}
        expected = [t for t in itertools.combinations(range(14), 3) if {t[:2], t[1:], t[::2]} <= joined]
        self.assertEqual(sorted(map(tuple, three_cliques(pairs[:, ::-1], 14).tolist())), expected)
        self.assertEqual(three_cliques(np.zeros((0, 2), int), 5).shape, (0, 3))

    def test_sheets(self):
        """A cloth with both diagonals and bending springs: four triangles a square; cubes are none, discs are drawn of their particles."""
        with open_run(synthetic.cloth(os.path.join(self.folder, "c.h5md"), 21)) as run:
            triangles = triangles_of(run)
            self.assertEqual(len(triangles), 4 * 20 * 20)
            self.assertTrue(is_sheet(run, triangles))
            self.assertEqual(Scene(run, [0]).draw, "triangles")
            self.assertEqual(Scene(run, [0], draw="springs").draw, "springs")
            scene = Scene(run, [0])
            figure, ax = plt.subplots()
            scene.setup(ax)
            scene.draw_frame(ax, 5)
            self.assertEqual(len(ax.collections[0].get_paths()), 1600)
            plt.close(figure)
        with open_run(synthetic.cube(os.path.join(self.folder, "d.h5md"), 8)) as run:
            self.assertFalse(is_sheet(run, triangles_of(run)))
            self.assertEqual(Scene(run, [0]).draw, "springs")

    def test_triangles_that_lost_a_spring_are_gone(self):
        path = synthetic.cloth(os.path.join(self.folder, "c.h5md"), 21)
        with h5py.File(path, "a") as f:
            pairs = f["connectivity/bonds"][...]
            row = int(np.flatnonzero((np.sort(pairs, axis=1) == [0, 1]).all(axis=1))[0])
            broken = np.zeros((20, len(pairs)), np.uint8)
            broken[10:, row] = 1
            f["backspring/broken/value"] = broken
        with open_run(path) as run:
            scene = Scene(run, [0])
            self.assertEqual([int(scene._whole(k).sum()) for k in (0, 12)], [1600, 1598])


if __name__ == "__main__":
    unittest.main(verbosity=1)
