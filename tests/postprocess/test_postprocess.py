#!/usr/bin/env python3
"""Tests of postprocess/ on files made by formula: /usr/bin/python3 tests/postprocess/test_postprocess.py"""
import itertools
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ET

try:
    import h5py
    import matplotlib.image
    import numpy as np
except ImportError as error:
    sys.exit(f"{error}; install with: sudo apt-get install python3-h5py python3-matplotlib, then use /usr/bin/python3")

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
TOOLS = os.path.join(ROOT, "postprocess")
sys.path[:0] = [HERE, TOOLS]
import scene  # noqa: E402
import synthetic  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from camera import Camera, guess_up  # noqa: E402

try:
    import meshio
except ImportError:
    meshio = None


def tool(name, *args, env=None, python=None):
    command = [python or sys.executable, os.path.join(TOOLS, name), *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=env)


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as f:
            f.write(text)
        return self.path(name)

    def works(self, name, *args):
        done = tool(name, *args)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn("Warning", done.stderr)
        return done

    def refuses(self, name, *args, says):
        done = tool(name, *args)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
        self.assertIn(says, done.stderr)

    def picture(self, path, least=0.005):
        """Not blank: at least this share of pixels differs from the corner's colour, in several colours."""
        image = matplotlib.image.imread(path)[..., :3]
        different = np.abs(image - image[0, 0]).max(axis=2) > 0.05
        self.assertGreater(different.mean(), least, path)
        self.assertGreater(image[different].std(), 0.02, path)
        return image


class Reading(Case):
    def test_values_come_back_in_every_dimension(self):
        for d in (1, 2, 3):
            with open_run(synthetic.chain(self.path(f"chain{d}.h5md"), d)) as run, h5py.File(run.path, "r") as f:
                self.assertEqual((run.frames, run.particles, run.dim, run.kind), (30, 12, d, "particles"))
                x = f["particles/trajectory/position/value"][...]
                np.testing.assert_array_equal(run.position(-1), x[29])
                np.testing.assert_array_equal(run.position_path(4), x[:, 4])
                rest = 1 / 11
                expected = [(np.linalg.norm(x[7, i + 1] - x[7, i]) - rest) / rest for i in range(11)]
                np.testing.assert_allclose(run.strains(7), expected, atol=1e-14)
                self.assertEqual(run.fixed.nonzero()[0].tolist(), [0, 11])
                self.assertEqual(run.id.tolist(), list(range(1, 13)))
                self.assertEqual(run.series["momentum"].shape, (30, d) if d > 1 else (30,))
                self.assertEqual(run.series["angular_momentum"].shape, (30, 3))
                self.assertEqual([run.parameters[k] for k in ("ts_type", "ranks", "program")], ["beuler", "2", "backspring"])
                self.assertEqual(len(run.log["dt"]), 290)

    def test_observables_are_those_of_the_file(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:
            f["observables/total_energy/value"][...] = 42.0  # not what positions and velocities would give
        with open_run(path) as run:
            self.assertTrue((run.series["total_energy"] == 42.0).all())

    def test_a_run_that_goes_on_while_it_is_read(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:  # frames as they were when they were counted, observables as they are now
            for name in ("position", "velocity"):
                whole = f[f"particles/trajectory/{name}/value"][...]
                del f[f"particles/trajectory/{name}/value"]
                f[f"particles/trajectory/{name}/value"] = whole[:7]
        with open_run(path) as run:
            self.assertEqual((run.frames, len(run.observable_times), len(run.series["total_energy"])), (7, 7, 7))

    def test_pandas_table(self):
        try:
            import pandas  # noqa: F401
        except ImportError:
            self.skipTest("no pandas")
        with open_run(synthetic.chain(self.path("c.h5md"), 2)) as run:
            table = run.observables
            self.assertEqual(len(table), 30)
            np.testing.assert_array_equal(table.index, run.times)
            np.testing.assert_array_equal(table["angular_momentum_z"], run.series["angular_momentum"][:, 2])
            self.assertIn("angular_momentum_z", table.columns)
            self.assertNotIn("momentum_z", table.columns)

    def test_killed_run(self):
        path = synthetic.chain(self.path("killed.h5md"), 2)
        with h5py.File(path, "a") as f:
            f["particles/trajectory/velocity/value"].resize(17, axis=0)  # positions of frame 17 were written, velocities not
            del f["observables/total_energy"]
            f["observables/total_energy/value"] = np.arange(16.0)
            f["observables/total_energy/time"] = f["particles/trajectory/position/time"][:16]
            krylov = f["backspring/log/krylov"][:100]
            del f["backspring/log/krylov"]
            f["backspring/log/krylov"] = krylov
        with open_run(path) as run:
            self.assertEqual((run.frames, len(run.times)), (17, 17))
            self.assertEqual({len(v) for v in run.series.values()}, {16})
            self.assertEqual(len(run.observable_times), 16)
            self.assertEqual({len(v) for v in run.log.values()}, {100})
            with self.assertRaises(RunError):
                run.position(17)
        self.works("plot.py", path, "-o", self.path("killed.png"), "--dpi", 80)
        self.picture(self.path("killed.png"))

    def test_padded_output_keeps_its_dimension(self):
        x = np.random.default_rng(1).normal(size=(4, 5, 3))
        x[..., 2] = 0
        path = synthetic.write_run(self.path("pad.h5md"), x, 0 * x, np.arange(4.0), np.array([[0, 1]]), dim=2)
        with open_run(path) as run:
            self.assertEqual((run.dim, run.position(0).shape), (2, (5, 2)))
        with h5py.File(path, "a") as f:  # as the program has it: the box is padded, too
            f["particles/trajectory/box"].attrs["dimension"] = 3
            del f["observables/momentum/value"]
            f["observables/momentum/value"] = np.zeros((4, 2))
        with open_run(path) as run:
            self.assertEqual((run.dim, run.position(0).shape), (2, (5, 2)))
        with h5py.File(path, "a") as f:
            del f["observables/momentum/value"]
            f["observables/momentum/value"] = np.zeros(4)
        with open_run(path) as run:
            self.assertEqual((run.dim, run.position(0).shape), (1, (5, 1)))

    def test_absent_datasets(self):
        path = synthetic.chain(self.path("bare.h5md"), 3, drop=(
            "velocity", "log", "kinetic_energy", "potential_energy", "total_energy", "momentum", "angular_momentum",
            "bonds_rest_length", "bonds_stiffness"))
        with open_run(path) as run:
            self.assertTrue(run.springs.rest_length_assumed)
            np.testing.assert_allclose(run.strains(0), 0, atol=1e-14)
            self.assertIsNone(run.springs.stiffness)
            self.assertEqual((run.series, run.log), ({}, {}))
        done = self.works("plot.py", path, "-o", self.path("bare.png"), "--dpi", 60)
        self.assertIn("no rest lengths", done.stderr)

    def test_springs_that_are_none(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:
            x, k = f["particles/trajectory/position/value"][...], f["connectivity/bonds_stiffness"]
            k[[2, 4, 6]] = 0.0
            f["connectivity/bonds_damping"][[2, 6]] = 0.0
            f["connectivity/bonds_stiffness_3"] = np.where(np.arange(len(k)) == 6, 1.0, 0.0)
            f["particles/trajectory/position/value"][:, 3:] = x[:, 3:] + [7.0, 0.0]  # spring 2 is eighty times as long
        with open_run(path) as run:
            self.assertEqual(np.flatnonzero(run.springs.idle).tolist(), [2])
            self.assertEqual(np.flatnonzero(np.isnan(run.strains(5))).tolist(), [2])
            shown = scene.Scene(run, list(range(run.frames)))
            self.assertEqual(np.setdiff1d(np.arange(len(run.springs)), shown.drawn).tolist(), [2])
            self.assertLess(shown.norm.vmax, 1)
        done = self.works("plot.py", path, "-o", self.path("none.png"), "--kind", "state,histogram,strain", "--dpi", 60)
        self.assertEqual(done.stderr, "")

    def test_choice_of_frames(self):
        with open_run(synthetic.chain(self.path("c.h5md"), 1)) as run:
            self.assertEqual(run.pick("5:20", 5), [5, 10, 15])
            self.assertEqual(run.pick("-2:"), [28, 29])
            times = run.times[run.pick(every=0.5)]
            np.testing.assert_allclose(times, [0, 0.5, 1.0, 1.5, 2.0], atol=1.01 * run.times[1] / 2)
            for wrong in ("a:b", "7:7", "99"):
                with self.assertRaises(RunError):
                    run.pick(wrong)

    def test_linear_system(self):
        path = synthetic.linear(self.path("linear.h5"))
        with open_run(path) as run:
            self.assertEqual((run.kind, run.states.labels, run.sources.labels), ("linear", ["v_out", "i_L", "v_in"], ["V1"]))
            np.testing.assert_allclose(run.states.value[-1, 0], 1 - np.exp(-5))
        self.works("plot.py", path, "-o", self.path("linear.png"), "--states", "v_out,1", "--dpi", 80)
        self.picture(self.path("linear.png"))
        self.refuses("plot.py", path, "-o", self.path("x.png"), "--states", "v_nowhere", says="no state 'v_nowhere'")
        self.refuses("movie.py", path, "-o", self.path("x.mp4"), says="linear")


class View(unittest.TestCase):
    def test_basis_is_orthonormal_and_right_handed(self):
        for up in ("x", "y", "z", "-x", "-y", "-z"):
            basis = Camera(3, up, 25, 40).basis
            np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-14)
            self.assertAlmostEqual(np.linalg.det(basis), 1.0)
            axis = np.eye(3)["xyz".index(up[-1])] * (-1 if up[0] == "-" else 1)
            self.assertGreater(basis[1] @ axis, 0.5)   # shown upwards
            self.assertAlmostEqual(basis[0] @ axis, 0.0)

    def test_plane_and_line(self):
        x = np.array([[1.0, 2.0]])
        np.testing.assert_allclose(Camera(2, "y").project(x)[0], [[1, 2]])
        np.testing.assert_allclose(Camera(2, "-y").project(x)[0], [[1, -2]])
        np.testing.assert_allclose(Camera(1, "-x").project([[3.0]])[0], [[0, -3]])

    def test_up_is_against_gravity(self):
        self.assertEqual([guess_up(3, "0,-9.8,0"), guess_up(1, "9.8"), guess_up(2, None), guess_up(3, "0,0,0")],
                         ["y", "-x", "y", "z"])

    def test_near_things_are_larger_and_hide_far_ones(self):
        camera = Camera(3, "z", 0, 0, target=np.zeros(3), size=1.0, perspective=0.5)  # the eye on the x axis
        near, far = (camera.project([[s, 1.0, 0.0]])[0][0, 0] for s in (0.5, -0.5))
        self.assertGreater(abs(near), abs(far))
        from splat import splat
        depth, colors = np.array([1.0, 2.0]), np.array([[1.0, 0, 0], [0, 0, 1.0]])
        for order in ([0, 1], [1, 0]):
            image = splat(np.zeros((2, 2)), depth[order], colors[order], np.zeros(2), (-1, 1, -1, 1), (64, 64), 0.2, (1, 1, 1), False)
            np.testing.assert_allclose(image[32, 32], [0, 0, 1, 1])
            self.assertEqual(image[2, 2, 3], 0)
            self.assertAlmostEqual(image[..., 3].mean(), np.pi * 0.2 ** 2 / 4, delta=0.01)


class Pictures(Case):
    def test_sheets_in_every_dimension(self):
        for d in (1, 2, 3):
            path = synthetic.chain(self.path(f"chain{d}.h5md"), d)
            self.works("plot.py", path, "-o", self.path(f"{d}.png"), "--dpi", 80)
            self.picture(self.path(f"{d}.png"))
            self.works("plot.py", path, "-o", self.path(f"k{d}.png"), "--dpi", 60,
                       "--kind", "momentum,angular_momentum,strain,paths,phase,drift")
            self.picture(self.path(f"k{d}.png"))

    def test_vector_formats(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        for ending, start in (("pdf", b"%PDF"), ("svg", b"<?xml")):
            self.works("plot.py", path, "-o", self.path("c." + ending), "--kind", "energy")
            with open(self.path("c." + ending), "rb") as f:
                self.assertEqual(f.read(len(start)), start)

    def test_legend_names_what_differs(self):
        from plot import run_labels
        paths = [synthetic.chain(self.path(f"{k}.h5md"), 2, parameters={"ts_type": k, "bs_output": k}) for k in ("bdf", "rk")]
        with open_run(paths[0]) as a, open_run(paths[1]) as b:
            self.assertEqual(run_labels([a, b]), ["ts_type bdf", "ts_type rk"])
            self.assertEqual(run_labels([a]), [""])
        self.works("plot.py", *paths, "-o", self.path("two.png"), "--dpi", 60)
        self.picture(self.path("two.png"))

    def test_stills(self):
        cloth, cube = synthetic.cloth(self.path("cloth.h5md"), 15), synthetic.cube(self.path("cube.h5md"), 8)
        for name, args in {"cloth": (cloth,), "dark": (cloth, "--theme", "dark"), "speed": (cube, "--color", "speed"),
                           "none": (cloth, "--color", "none"), "discs": (cube, "--draw", "particles"),
                           "up": (cube, "--up=-x", "--elev", 40), "few": (cube, "--draw", "springs", "--max_springs", 500)}.items():
            self.works("movie.py", *args, "-o", self.path(name + ".png"), "--size", "480x360", "--dpi", 80)
            self.assertEqual(self.picture(self.path(name + ".png"), 0.03).shape[:2], (360, 480))

    def test_large_lattices_become_discs(self):
        path = synthetic.cube(self.path("big.h5md"), 22, frames=2, reach=1.0)
        self.works("movie.py", path, "-o", self.path("big.png"), "--size", "480x360")
        self.picture(self.path("big.png"), 0.1)

    def test_window_stays_and_picture_moves(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        self.works("movie.py", path, "-o", self.path("c.gif"), "--size", "320x240", "--frames", "0:30", "--stride", 10, "--quiet")
        from PIL import Image
        with Image.open(self.path("c.gif")) as film:
            self.assertEqual(film.n_frames, 3)
            pictures = []
            for k in range(3):
                film.seek(k)
                pictures.append(np.asarray(film.convert("RGB"), dtype=float))
        self.assertGreater(np.abs(pictures[0] - pictures[2]).mean(), 0.5)

    def test_still_particles_without_springs(self):
        x = np.random.default_rng(2).uniform(size=(3, 50, 2))
        path = synthetic.write_run(self.path("free.h5md"), x, x, np.arange(3.0), np.zeros((0, 2), dtype=int))
        self.works("movie.py", path, "-o", self.path("free.png"), "--size", "320x240")
        self.picture(self.path("free.png"))
        one = synthetic.write_run(self.path("one.h5md"), x[:, :1, :1], x[:, :1, :1], np.arange(3.0), np.zeros((0, 2), dtype=int),
                                  parameters={"bs_gravity": "9.8"})
        self.works("plot.py", one, "-o", self.path("one.png"), "--dpi", 60)

    def test_springs_that_carry_nothing_are_not_drawn(self):
        """Without stiffness and damping; with one of them they are there."""
        from figures import histogram
        from scene import Scene
        import argparse
        import matplotlib.pyplot as plt
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:
            for name, rows in (("stiffness", [2, 3, 4]), ("damping", [3, 4])):
                value = f["connectivity/bonds_" + name][...]
                value[rows] = 0
                f["connectivity/bonds_" + name][...] = value
        with open_run(path) as run:
            self.assertEqual(np.flatnonzero(~run.acting(-1)).tolist(), [3, 4])
            self.assertEqual(np.flatnonzero(np.isnan(run.strains(5))).tolist(), [3, 4])
            self.assertEqual(Scene(run, [0]).drawn.tolist(), [0, 1, 2, 5, 6, 7, 8, 9, 10])
            run.springs.stiffness[:], run.springs.damping[:] = 0, 0  # and where none carries anything
            figure, ax = plt.subplots()
            histogram(ax, [run], [""], argparse.Namespace(frames=[-1], frame=-1))
            plt.close(figure)
        with h5py.File(path, "a") as f:
            f["connectivity/bonds_stiffness"][...], f["connectivity/bonds_damping"][...] = 0, 0
        for kind in ("state", "strain", "histogram"):
            self.works("plot.py", path, "-o", self.path("p.png"), "--kind", kind, "--dpi", 50)

    def test_forces_of_supports_that_do_not_move_keep_their_sign(self):
        """The left support pulls, the right one pushes back: opposite signs, along y, in which the larger is positive."""
        import argparse
        import matplotlib.pyplot as plt
        from figures_supports import force
        path = synthetic.chain(self.path("c.h5md"), 2, frames=5)
        pulled = np.array([[0, 0], [0, 1], [0, 3], [0, -2], [0, 1.0]])
        with h5py.File(path, "a") as f:
            for name, value in (("left", pulled), ("right", -0.5 * pulled)):
                f[f"groups/{name}"] = [0 if name == "left" else 11]
                f[f"observables/reaction/{name}/value"], f[f"observables/reaction/{name}/time"] = value, f["particles/trajectory/position/time"][...]
        figure, ax = plt.subplots()
        with open_run(path) as run:
            force(ax, [run], [""], argparse.Namespace(against="time", groups=[]))
        drawn = {line.get_label(): line.get_ydata() for line in ax.get_lines()}
        np.testing.assert_allclose(drawn["left"], pulled[:, 1])
        np.testing.assert_allclose(drawn["right"], -0.5 * pulled[:, 1])
        self.assertIn("along $y$", ax.get_ylabel())
        plt.close(figure)

    @unittest.skipUnless(shutil.which("ffmpeg"), "no ffmpeg")
    def test_films(self):
        path = synthetic.cloth(self.path("c.h5md"), 8, frames=6)
        for ending, magic in (("mp4", b"ftyp"), ("webm", b"webm")):
            self.works("movie.py", path, "-o", self.path("f." + ending), "--size", "321x241", "--fps", 5)
            with open(self.path("f." + ending), "rb") as f:
                self.assertIn(magic, f.read(64))
            said = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames,width,height",
                                   "-of", "csv=p=0", self.path("f." + ending)], capture_output=True, text=True).stdout
            self.assertEqual(said.strip(), "322,242,6")
        here = os.getcwd()
        os.chdir(self.folder)
        self.addCleanup(os.chdir, here)
        for name in ("http:x.mp4", "pipe:1.mkv", "-y.gif"):  # names of files, whatever they are to ffmpeg
            self.works("movie.py", path, f"--output={name}", "--size", "160x120", "--frames", "0:2")
            self.assertGreater(os.path.getsize(name), 500)
        self.assertEqual([f for f in os.listdir(self.folder) if ".part" in f], [])

    def test_without_ffmpeg_a_gif_is_written_and_said(self):
        path = synthetic.cloth(self.path("c.h5md"), 6, frames=3)
        done = tool("movie.py", path, "-o", self.path("f.mp4"), "--size", "160x120", env={**os.environ, "PATH": "/nowhere"})
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("no ffmpeg", done.stderr)
        with open(self.path("f.gif"), "rb") as f:
            self.assertEqual(f.read(4), b"GIF8")


TETRA = [(0, 1, 2, 3), (1, 2, 3, 4)]
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
SPRINGS = ("--stiffness", 7, "--mass", 0.5)


class Converting(Case):
    def lattice(self, source, *args):
        self.works("convert.py", source, "-o", self.path("out.h5"), *args)
        with h5py.File(self.path("out.h5"), "r") as f:
            found = {name: f[name][...] for name in ("particles/position", "particles/mass", "springs/pairs", "springs/stiffness")}
            found.update({k: f[k][...] for k in ("particles/fixed", "particles/velocity", "springs/rest_length", "springs/damping")
                          if k in f})
            found.update(f.attrs)
        return found

    @staticmethod
    def edges(cells):
        """Of simplices: every pair of corners."""
        return sorted({tuple(sorted(pair)) for cell in cells for pair in itertools.combinations(cell, 2)})

    def same_edges(self, lattice, cells):
        self.assertEqual([tuple(p) for p in lattice["springs/pairs"].tolist()], self.edges(cells))
        self.assertEqual(lattice["springs/pairs"].dtype, np.int64)

    @unittest.skipUnless(meshio, "no meshio")
    def test_tetrahedra_through_every_format(self):
        mesh = meshio.Mesh(POINTS, [("tetra", np.array(TETRA))])
        for ending, form in (("vtk", "vtk"), ("vtu", "vtu"), ("msh", "gmsh22"), ("msh", "gmsh")):
            path = self.path("m." + ending)
            meshio.write(path, mesh, file_format=form)
            lattice = self.lattice(path, *SPRINGS)
            self.same_edges(lattice, TETRA)
            np.testing.assert_allclose(lattice["particles/position"], POINTS)
            self.assertEqual((set(lattice["springs/stiffness"]), set(lattice["particles/mass"])), ({7.0}, {0.5}))

    @unittest.skipUnless(meshio, "no meshio")
    def test_surfaces(self):
        faces = list(itertools.combinations(range(4), 3))
        mesh = meshio.Mesh(POINTS[:4], [("triangle", np.array(faces))])
        for ending in ("ply", "stl"):
            meshio.write(self.path("m." + ending), mesh)
            lattice = self.lattice(self.path("m." + ending), *SPRINGS, "--merge", 1e-6)
            self.assertEqual((len(lattice["particles/position"]), len(lattice["springs/pairs"])), (4, 6))

    def test_obj_by_hand(self):
        if not meshio:
            self.skipTest("no meshio")
        path = self.write("m.obj", "# a square, a line, a loose point\nv 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nv 2 2 0\n"
                                   "v 9 9 0\nf 1/1 2/2 3//3 -3\nl 3 5\n")
        lattice = self.lattice(path, "--stiffness", 3, "--total_mass", 10, "--fixed", "xmin", "--damping", 0.25)
        self.assertEqual(lattice["springs/pairs"].tolist(), [[0, 1], [0, 3], [1, 2], [2, 3], [2, 4]])
        self.assertEqual(lattice["particles/position"].shape, (5, 2))      # flat: d = 2; the loose point left out
        self.assertEqual(lattice["particles/fixed"].tolist(), [1, 0, 0, 1, 0])
        np.testing.assert_allclose(lattice["particles/mass"], 2.0)
        np.testing.assert_allclose(lattice["springs/damping"], 0.25)
        self.assertEqual((lattice["spring_law"], lattice["damping_law"]), ("hooke", "axial"))
        self.assertEqual(self.lattice(path, *SPRINGS, "--dim", 3, "--keep_unused")["particles/position"].shape, (6, 3))

    @unittest.skipUnless(meshio, "no meshio")
    def test_edges_of_grids_and_of_quadratic_elements(self):
        n = 3
        index = np.arange(n ** 3).reshape(n, n, n)
        corner = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        cells = [[index[i + a, j + b, k + c] for a, b, c in corner] for i, j, k in itertools.product(range(n - 1), repeat=3)]
        points = np.array(list(itertools.product(range(n), repeat=3)), dtype=float)
        meshio.write(self.path("h.vtu"), meshio.Mesh(points, [("hexahedron", np.array(cells))]))
        lattice = self.lattice(self.path("h.vtu"), *SPRINGS)
        self.assertEqual(len(lattice["springs/pairs"]), 3 * n * n * (n - 1))
        ends = lattice["particles/position"][lattice["springs/pairs"]]
        np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 1.0)
        corners = POINTS[:4]
        middles = np.array([(corners[a] + corners[b]) / 2 for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))])
        meshio.write(self.path("q.vtu"), meshio.Mesh(np.concatenate([corners, middles]), [("tetra10", np.arange(10)[None])]))
        lattice = self.lattice(self.path("q.vtu"), *SPRINGS)
        ends = lattice["particles/position"][lattice["springs/pairs"]]
        lengths = np.sort(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
        np.testing.assert_allclose(lengths, [0.5] * 6 + [np.sqrt(0.5)] * 6)  # both halves of every edge

    @unittest.skipUnless(meshio and shutil.which("gmsh"), "no meshio or no gmsh")
    def test_a_mesh_from_gmsh_itself(self):
        geo = self.write("b.geo", 'SetFactory("OpenCASCADE"); Box(1) = {0,0,0, 1,1,1}; Mesh.MeshSizeMax = 0.4;\n')
        for version in ("2.2", "4.1"):
            subprocess.run(["gmsh", "-3", geo, "-format", "msh" + version.replace(".", ""), "-o", self.path("b.msh")], check=True,
                           capture_output=True)
            lattice = self.lattice(self.path("b.msh"), *SPRINGS, "--fixed", "zmin")
            n, m = len(lattice["particles/position"]), len(lattice["springs/pairs"])
            tetra = next(b.data for b in meshio.read(self.path("b.msh")).cells if b.type == "tetra")
            self.assertEqual(m, len(self.edges(tetra)))
            self.assertEqual(n, len(np.unique(tetra)))
            np.testing.assert_array_equal(lattice["particles/fixed"], lattice["particles/position"][:, 2] == 0)

    LAMMPS = ("# LAMMPS data, units = lj\n\n3 atoms\n2 bonds\n2 atom types\n2 bond types\n0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n\nMasses\n\n"
              "1 1.5\n2 2.5\n\nBond Coeffs # harmonic\n\n1 10 1.0\n2 20 0.0\n\nAtoms # bond\n\n7 1 1 9.5 0 0 0 0 0\n3 1 2 0.5 0 1 1 0 0\n"
              "5 1 1 0.25 2 0 1 0 0 # comment\n\nVelocities\n\n3 0 1 2\n7 3 4 5\n5 0 0 0\n\nBonds\n\n1 1 7 3\n2 2 3 5\n")

    def test_lammps_data(self):
        lattice = self.lattice(self.write("n.data", self.LAMMPS))
        np.testing.assert_allclose(lattice["particles/position"], [[9.5, 0, 0], [10.5, 0, 1], [10.25, 2, 0]])  # unwrapped
        np.testing.assert_allclose(lattice["particles/mass"], [1.5, 2.5, 1.5])
        np.testing.assert_allclose(lattice["particles/velocity"], [[3, 4, 5], [0, 1, 2], [0, 0, 0]])
        self.assertEqual(lattice["springs/pairs"].tolist(), [[0, 1], [1, 2]])
        np.testing.assert_allclose(lattice["springs/stiffness"], [20, 40])     # E = K (r - r0)^2
        np.testing.assert_allclose(lattice["springs/rest_length"], [1, 0])
        strained = self.lattice(self.path("n.data"), "--spring_law", "strain")
        np.testing.assert_allclose(strained["springs/stiffness"], [20 * 1.0, 40])
        for before, after, says in (("1 1 7 3", "1 1 7 4", "no atom 4"), ("# harmonic", "# fene", "fene"),
                                    ("1 10 1.0", "1 10 1.0 3", "not harmonic"), ("0.5 0 1", "0.5 zero 1", "'zero' in Atoms is not a number"),
                                    ("Atoms # bond", "Atom # bond", "no section Atoms"), ("3 1 2 0.5", "7 1 2 0.5", "Atoms names atom 7 a second time")):
            self.assertIn(before, self.LAMMPS)
            path = self.write("bad.data", self.LAMMPS.replace(before, after))
            self.refuses("convert.py", path, "-o", self.path("x.h5"), says=says)

    def test_trajectory_to_lammps_and_back(self):
        path = synthetic.cube(self.path("c.h5md"), 4, frames=3)
        done = self.works("convert.py", path, "-o", self.path("c.data"), "--frame", 1)
        self.assertIn("hooke is assumed", done.stderr)
        strained = synthetic.cube(self.path("s.h5md"), 4, frames=3, parameters={"bs_spring_law": "strain"})
        done = self.works("convert.py", strained, "-o", self.path("s.data"))
        self.assertEqual(done.stderr, f"convert.py: {self.path('s.data')}: left out: 360 dampers, which particles are fixed (16)\n")
        with open_run(strained) as run:  # the rate of a strain spring is K/L
            np.testing.assert_allclose(self.lattice(self.path("s.data"))["springs/stiffness"],
                                       run.springs.stiffness / run.springs.rest_length, rtol=1e-15)
        lattice = self.lattice(self.path("c.data"))
        with open_run(path) as run:
            np.testing.assert_array_equal(lattice["particles/position"], run.position(1))
            np.testing.assert_array_equal(lattice["particles/velocity"], run.velocity(1))
            np.testing.assert_array_equal(lattice["springs/pairs"], run.springs.pairs)
            np.testing.assert_allclose(lattice["springs/stiffness"], run.springs.stiffness, rtol=1e-15)
            np.testing.assert_allclose(lattice["springs/rest_length"], run.springs.rest_length, rtol=1e-15)

    def test_extended_xyz(self):
        path = synthetic.chain(self.path("c.h5md"), 2)
        self.works("convert.py", path, "-o", self.path("c.xyz"), "--frames", "0:10", "--stride", 3)
        with open(self.path("c.xyz"), encoding="utf-8") as f:
            lines = f.read().splitlines()
        self.assertEqual(len(lines), 4 * 14)
        with open_run(path) as run:
            self.assertIn(f"Time={run.times[9]:.17g} ", lines[3 * 14 + 1])
            for k, i in ((1, 0), (3, 5)):
                words = lines[k * 14 + 2 + i].split()
                np.testing.assert_array_equal([float(w) for w in words[1:4]], [*run.position(3 * k)[i], 0])
                np.testing.assert_array_equal([float(w) for w in words[4:7]], [*run.velocity(3 * k)[i], 0])

    def test_vtp_as_vtk_reads_it(self):
        try:
            import vtk
            from vtk.util.numpy_support import vtk_to_numpy
        except ImportError:
            self.skipTest("no vtk: apt install python3-vtk9")
        path = synthetic.cube(self.path("c.h5md"), 3, frames=5)
        self.works("convert.py", path, "-o", self.path("s.pvd"), "--pieces", "vtp")
        self.works("convert.py", synthetic.chain(self.path("d.h5md"), 2), "-o", self.path("d.vtp"))
        with open_run(path) as run:
            for k in range(5):
                reader = vtk.vtkXMLPolyDataReader()
                reader.SetFileName(self.path(f"s/frame_{k:06d}.vtp"))
                reader.Update()
                data = reader.GetOutput()
                np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), run.position(k))
                np.testing.assert_array_equal(vtk_to_numpy(data.GetPointData().GetArray("velocity")), run.velocity(k))
                np.testing.assert_array_equal(vtk_to_numpy(data.GetCellData().GetArray("strain")), run.strains(k))
                lines = vtk_to_numpy(data.GetLines().GetConnectivityArray()).reshape(-1, 2)
                np.testing.assert_array_equal(lines, run.springs.pairs)
        if shutil.which("xvfb-run"):  # VTK draws it, without a screen
            subprocess.run(["xvfb-run", "-a", sys.executable, os.path.join(HERE, "render_vtk.py"), self.path("s/frame_000004.vtp"),
                            self.path("s.png")], check=True, timeout=120)
            self.picture(self.path("s.png"), 0.02)

    @unittest.skipUnless(meshio, "no meshio")
    def test_lattice_through_vtu_and_back(self):
        path = synthetic.cube(self.path("c.h5md"), 3, frames=3)
        with h5py.File(path, "a") as f:
            f["particles/trajectory/fixed"][...] = np.arange(27) < 4
        self.works("convert.py", path, "-o", self.path("c.vtu"), "--frame", 1)
        lattice = self.lattice(self.path("c.vtu"))
        with open_run(path) as run:
            for name, expected in (("particles/position", run.position(1)), ("particles/velocity", run.velocity(1)), ("particles/mass", run.mass),
                                   ("particles/fixed", run.fixed), ("springs/pairs", run.springs.pairs), ("springs/damping", run.springs.damping),
                                   ("springs/stiffness", run.springs.stiffness), ("springs/rest_length", run.springs.rest_length)):
                np.testing.assert_array_equal(lattice[name], expected, name)
        self.assertEqual(set(self.lattice(self.path("c.vtu"), "--stiffness", 3)["springs/stiffness"]), {3.0})

    def test_gsd(self):
        try:
            import gsd.hoomd
        except ImportError:
            self.skipTest("no gsd: apt install python3-gsd")
        path = synthetic.chain(self.path("c.h5md"), 2)
        self.works("convert.py", path, "-o", self.path("c.gsd"), "--stride", 10)
        with open_run(path) as run, gsd.hoomd.open(self.path("c.gsd"), "rb") as frames:
            self.assertEqual(len(frames), 3)
            for k, frame in enumerate(frames):
                np.testing.assert_array_equal(frame.particles.position[:, :2], run.position(10 * k).astype(np.float32))
                np.testing.assert_array_equal(frame.particles.velocity[:, :2], run.velocity(10 * k).astype(np.float32))
                np.testing.assert_array_equal(frame.bonds.group, run.springs.pairs)
                self.assertEqual((frame.log["time"][0], frame.configuration.step), (run.times[10 * k], run.step[10 * k]))
                self.assertGreater(frame.configuration.box[0], 2 * np.abs(run.position(10 * k)).max())

    def test_lammps_dump(self):
        path = synthetic.cube(self.path("c.h5md"), 3, frames=4)
        self.works("convert.py", path, "-o", self.path("c.lammpstrj"), "--stride", 2)
        with open_run(path) as run:
            blocks = open(self.path("c.lammpstrj"), encoding="utf-8").read().split("ITEM: TIMESTEP\n")[1:]
            for k, block in zip((0, 2), blocks):
                table = np.array([line.split() for line in block.split("mass\n")[1].splitlines()], dtype=float)
                np.testing.assert_array_equal(table[:, 0], np.arange(1, 28))
                np.testing.assert_array_equal(table[:, 2:5], run.position(k))
                np.testing.assert_array_equal(table[:, 5:8], run.velocity(k))
                self.assertEqual(int(block.split()[0]), run.step[k])
            try:
                import MDAnalysis
            except ImportError:
                return
            seen = MDAnalysis.Universe(self.path("c.lammpstrj"), format="LAMMPSDUMP", lammps_coordinate_convention="unscaled")
            self.assertEqual((len(seen.trajectory), seen.atoms.n_atoms), (2, 27))
            seen.trajectory[1]  # noqa: B018
            x, seen_x = run.position(2), seen.atoms.positions  # MDAnalysis counts from the corner of the box
            np.testing.assert_allclose(seen_x - seen_x.min(axis=0), x - x.min(axis=0), rtol=1e-6, atol=1e-6)

    @unittest.skipUnless(meshio, "no meshio")
    def test_vtu_and_pvd(self):
        path = synthetic.cube(self.path("c.h5md"), 3, frames=5)
        self.works("convert.py", path, "-o", self.path("s.pvd"), "--stride", 2)
        entries = ET.parse(self.path("s.pvd")).getroot().findall("./Collection/DataSet")
        with open_run(path) as run:
            self.assertEqual([float(e.get("timestep")) for e in entries], run.times[[0, 2, 4]].tolist())
            mesh = meshio.read(os.path.join(self.folder, entries[1].get("file")))
            np.testing.assert_allclose(mesh.points, run.position(2))
            np.testing.assert_allclose(mesh.cell_data["strain"][0], run.strains(2))
            np.testing.assert_array_equal(mesh.cells[0].data, run.springs.pairs)
        self.works("convert.py", path, "-o", self.path("one.vtu"))
        self.assertEqual(len(meshio.read(self.path("one.vtu")).points), 27)

    @unittest.skipUnless(meshio, "no meshio")
    def test_vtu_has_displacements_modes_and_reactions(self):
        """For ParaView: vectors at the points, read back by meshio."""
        path = synthetic.chain(self.path("c.h5md"), 2)
        shapes = np.random.default_rng(4).normal(size=(3, 12, 2))
        with h5py.File(path, "a") as f:
            f["modes/omega_squared"], f["modes/shape"] = [1.0, 4.0, 9.0], shapes
            f["observables/reaction/end/value"], f["observables/reaction/end/time"] = np.stack([np.arange(30.0), -np.arange(30.0)], axis=1), np.linspace(0, 2, 30)
        self.works("convert.py", path, "-o", self.path("c.vtu"), "--frame", 7)
        mesh = meshio.read(self.path("c.vtu"))
        with open_run(path) as run:
            np.testing.assert_array_equal(mesh.point_data["displacement"][:, :2], run.position(7) - run.position(0))
            for k in range(3):
                np.testing.assert_allclose(mesh.point_data[f"mode_{k:03d}"][:, :2], shapes[k] / np.linalg.norm(shapes[k], axis=1).max(), atol=1e-15)
            self.assertFalse(mesh.point_data["mode_000"][:, 2].any())
        self.assertEqual((mesh.field_data["omega_squared"].tolist(), mesh.field_data["reaction_end"].tolist()), ([1, 4, 9], [7, -7]))

    def test_example_lattice(self):
        script = os.path.join(ROOT, "meshes", "make_lattice.py")
        subprocess.run([sys.executable, script, self.path("beam.h5")], check=True)
        with h5py.File(self.path("beam.h5"), "r") as f:
            x, pairs = f["particles/position"][...], f["springs/pairs"][...]
            lengths = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1)
            self.assertEqual((x.shape, len(pairs), int(f["particles/fixed"][...].sum())), ((42, 2), 101, 2))
            self.assertTrue(np.all(np.isclose(lengths, 0.1) | np.isclose(lengths, 0.1 * np.sqrt(2))))


class WrongFiles(Case):
    def test_wrong_trajectories(self):
        good = synthetic.chain(self.path("good.h5md"), 2)
        text = self.write("text.h5md", "not HDF5\n")
        with h5py.File(self.path("empty.h5"), "w"):
            pass
        with h5py.File(self.path("lattice.h5"), "w") as f:
            f["particles/position"] = np.zeros((2, 2))
        with open(good, "rb") as f, open(self.path("cut.h5md"), "wb") as g:
            g.write(f.read()[:3000])
        shutil.copy(good, self.path("bond.h5md"))
        with h5py.File(self.path("bond.h5md"), "a") as f:
            f["connectivity/bonds"][3] = (1, 99)
        with h5py.File(self.path("zero.h5md"), "w") as f:
            f["particles/trajectory/position/value"] = np.zeros((0, 3, 2))
        with h5py.File(self.path("shape.h5md"), "w") as f:
            f["particles/trajectory/position/value"] = np.zeros((4, 3))
        for path, says in ((self.path("absent.h5md"), "no such file"), (self.folder, "folder"), (text, "not an HDF5 file"),
                           (self.path("empty.h5"), "no trajectory"), (self.path("lattice.h5"), "a lattice"),
                           (self.path("cut.h5md"), "truncated"), (self.path("bond.h5md"), "row 3 joins 1 and 99"),
                           (self.path("zero.h5md"), "no frame yet"), (self.path("shape.h5md"), "shape (4, 3)")):
            for name in ("plot.py", "movie.py"):
                self.refuses(name, path, "-o", self.path("x.png"), says=says)
        self.assertFalse(os.path.exists(self.path("x.png")))

    def test_numbers_in_other_files_are_not_followed(self):
        """External storage, links to other files and virtual datasets show what is in any file: each tool refuses them by name."""
        secret = self.write("secret.bin", "not for you" * 100)
        with h5py.File(self.path("other.h5"), "w") as f:
            f["mass"] = np.full(12, 7.0)
        def planted(name, plant):
            path = synthetic.chain(self.path(name), 2)
            with h5py.File(path, "a") as f:
                del f["particles/trajectory/mass"]
                plant(f["particles/trajectory"])
            return path
        def virtual(group):
            layout = h5py.VirtualLayout((12,), float)
            layout[:] = h5py.VirtualSource(self.path("other.h5"), "mass", (12,))
            group.create_virtual_dataset("mass", layout)
        files = (planted("stored.h5md", lambda g: g.create_dataset("mass", (12,), float, external=[(secret, 0, 96)])),
                 planted("linked.h5md", lambda g: g.__setitem__("mass", h5py.ExternalLink(self.path("other.h5"), "/mass"))), planted("virtual.h5md", virtual))
        good = synthetic.chain(self.path("good.h5md"), 2)
        for path, says in zip(files, ("is in external storage", "is a link to another file", "is a virtual dataset")):
            with self.assertRaises(RunError) as caught:
                open_run(path)
            self.assertIn(f"{path}: /particles/trajectory/mass {says}", str(caught.exception))
            if path is not files[0]:
                continue  # all tools open files by open_run
            for name, args in (("plot.py", ("-o", self.path("x.png"))), ("movie.py", ("-o", self.path("x.png"))), ("convert.py", ("-o", self.path("x.data"))),
                               ("compare.py", (good,)), ("sweep.py", ("--vary=-ts_dt=1,2", "--program", "/bin/true", "-o", self.path("s"), "--reference", path))):
                self.refuses(name, *(() if name == "sweep.py" else (path,)), *args, says=f"{path}: /particles/trajectory/mass {says}")
        self.assertFalse(any(os.path.exists(self.path(name)) for name in ("x.png", "x.data", "s")))

    def test_what_hdf5_itself_stumbles_over_is_one_line(self):
        """A damaged block of a compressed dataset: reading it fails inside h5py."""
        path = synthetic.chain(self.path("c.h5md"), 2)
        with h5py.File(path, "a") as f:
            x = f["particles/trajectory/position/value"][...]
            del f["particles/trajectory/position/value"]
            data = f["particles/trajectory/position"].create_dataset("value", data=x, chunks=x.shape, compression="gzip")
            f.flush()
            at, size = data.id.get_chunk_info(0).byte_offset, data.id.get_chunk_info(0).size
        with open(path, "r+b") as f:
            f.seek(at + size // 3)
            f.write(b"\xff" * (size // 3))
        for name, ending in (("plot.py", "png"), ("movie.py", "png"), ("convert.py", "xyz")):
            self.refuses(name, path, "-o", self.path("x." + ending), says="is damaged")

    def test_a_crash_of_the_library_is_one_line(self):
        """A process that libhdf5 takes down: exit code 2 and the name of the file; other ends are those of the tool itself, signals too."""
        path = synthetic.chain(self.path("c.h5md"), 2)
        for does, code, says in (("os.kill(os.getpid(), signal.SIGSEGV)", 2, f"plot.py: libhdf5 crashed: {path} is damaged\n"), ("os.abort()", 2, "is damaged"),
                                 ("sys.exit(3)", 3, ""), ("os.kill(os.getpid(), signal.SIGTERM)", 128 + 15, "")):
            script = f"import os, signal, sys; sys.path.insert(0, {TOOLS!r}); import launch; sys.argv = ['plot.py', {path!r}]; launch.run(lambda: {does}, ValueError)"
            done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(says, done.stderr)

    def test_wrong_arguments(self):
        good = synthetic.chain(self.path("good.h5md"), 2)
        for name, args, says in (
                ("plot.py", ("-o", self.path("x.doc")), "unknown ending"), ("plot.py", ("-o", "/nowhere/x.png"), "no such folder"),
                ("plot.py", ("-o", self.path("x.png"), "--kind", "beauty"), "choose from"),
                ("plot.py", ("-o", self.path("x.png"), "--kind", "paths", "--particles", "1,77"), "no particle 77"),
                ("movie.py", ("-o", self.path("x.png"), "--frame", 30), "no frame 30"),
                ("movie.py", ("-o", self.path("x.gif"), "--frames", "40:"), "select none"),
                ("movie.py", ("-o", self.path("x.gif"), "--size", "big"), "WxH"),
                ("convert.py", ("-o", self.path("x.doc")), "unknown ending"), ("convert.py", ("-o", good), "is the input")):
            self.refuses(name, good, *args, says=says)

    @unittest.skipUnless(meshio, "no meshio")
    def test_wrong_meshes(self):
        good = self.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 3\n")
        for text, args, says in ((None, (), "says nothing of stiffness"), (None, ("--stiffness", 1), "says nothing of mass"),
                                 (None, ("--stiffness", -1), "0 or more"), (None, (*SPRINGS, "--dim", 2), "would drop z"),
                                 (None, (*SPRINGS, "--fixed", "top"), "--fixed top"), ("v 0 0\nf 1 2\n", SPRINGS, ":1:"),
                                 ("v 0 0 0\n", SPRINGS, "no elements"), ("v 0 0 0\nv 0 1 0\nf 1 2 9\n", SPRINGS, "bad.obj:3: 'f 1 2 9' names point 9 of 2"),
                                 ("v 0 0 0\nv 0 0 0\nl 1 2\n", SPRINGS, "at one place")):
            path = good if text is None else self.write("bad.obj", text)
            self.refuses("convert.py", path, "-o", self.path("x.h5"), *args, says=says)
        for ending in ("vtk", "vtu", "ply", "stl", "msh"):
            self.refuses("convert.py", self.write("bad." + ending, "nonsense\n1 2 3\n"), "-o", self.path("x.h5"), *SPRINGS, says="bad." + ending)
        self.refuses("convert.py", self.path("none.vtk"), "-o", self.path("x.h5"), says="no such file")
        self.refuses("convert.py", good, "-o", self.path("x.xyz"), *SPRINGS, says="becomes a lattice")
        self.assertFalse(os.path.exists(self.path("x.h5")))


class Starting(Case):
    def test_help(self):
        for name in ("plot.py", "movie.py", "convert.py", "compare.py", "sweep.py"):
            done = tool(name, "--help")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("--" if name != "convert.py" else "--stiffness", done.stdout)

    def fake(self, system):
        """launch.require under an interpreter without numpy, with `system` as the interpreter to try next."""
        code = (f"import sys; sys.path.insert(0, {TOOLS!r}); sys.modules['numpy'] = None; import launch; "
                f"launch.SYSTEM_PYTHON = {system!r}; sys.argv = ['plot.py']; launch.require('numpy', 'sys'); print('went on')")
        return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)

    def test_interpreter_without_numpy(self):
        done = self.fake("/nowhere/python3")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(len(done.stderr.splitlines()), 1)
        self.assertIn("apt-get install python3-numpy", done.stderr)
        other = self.write("python3", '#!/bin/sh\necho "again: $@ $BACKSPRING_REEXEC"\n')
        os.chmod(other, 0o755)
        done = self.fake(other)
        self.assertEqual((done.returncode, done.stdout), (0, "again: plot.py 1\n"))


if __name__ == "__main__":
    unittest.main(verbosity=1)
