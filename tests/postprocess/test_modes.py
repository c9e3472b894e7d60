#!/usr/bin/env python3
"""Proteins as lattices, and modes as plots and films: /usr/bin/python3 tests/postprocess/test_modes.py"""
import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
import unittest

import h5py
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(os.path.dirname(os.path.dirname(HERE)), "postprocess")]
import convert  # noqa: E402
import movie  # noqa: E402
import plot  # noqa: E402
import synthetic  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from figure_style import number  # noqa: E402
from modes import FRAMES, ModeRun  # noqa: E402


def atom(serial, name, residue, chain, number, x, b=10.0, altloc=" ", record="ATOM  ", element="C"):
    return f"{record}{serial:5d} {name}{altloc}{residue} {chain}{number:4d}    {x[0]:8.3f}{x[1]:8.3f}{x[2]:8.3f}  1.00{b:6.2f}          {element:>2}\n"


FILE = ("HEADER    made by hand\nMODEL        1\n" + atom(1, " N  ", "MET", "A", 1, (9, 9, 9), element="N") + atom(2, " CA ", "MET", "A", 1, (0, 0, 0), 11)
        + atom(3, " CA ", "GLN", "A", 2, (3, 0, 0), 12, "A") + atom(4, " CA ", "GLN", "A", 2, (3, 1, 0), 13, "B")
        + atom(5, " CA ", "MSE", "A", 3, (3, 3, 0), 14, record="HETATM") + atom(6, "CA  ", " CA", "A", 90, (1, 1, 1), record="HETATM", element="CA")
        + atom(7, " CA ", "ILE", "B", 1, (0, 3, 0), 15) + "ENDMDL\nMODEL        2\n" + atom(2, " CA ", "MET", "A", 1, (0, 0, 5)) + "ENDMDL\nEND\n")


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name, text=None):
        path = os.path.join(self.folder, name)
        if text is not None:
            with open(path, "w", encoding="latin-1") as f:
                f.write(text)
        return path

    def lattice(self, *args, text=FILE):
        said, out = io.StringIO(), self.path("out.h5")
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            convert.main([self.path("made.pdb", text), "-o", out, *args])
        with h5py.File(out, "r") as f:
            return {name: f[name][...] for group in ("particles", "springs") for name in (f"{group}/{k}" for k in f[group])} | {"said": said.getvalue()}

    def refuses(self, call, says):
        with self.assertRaises(RunError) as caught:
            call()
        self.assertIn(says, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))


class Proteins(Case):
    def test_alpha_carbons_of_one_model_are_joined_within_the_cutoff(self):
        found = self.lattice("--cutoff", "3.1", "--stiffness", "2.5")
        self.assertEqual(found["particles/position"].tolist(), [[0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0]])
        self.assertEqual(found["particles/id"].tolist(), [2, 3, 5, 7])
        self.assertEqual(found["particles/mass"].tolist(), [1] * 4)
        self.assertEqual(sorted(map(tuple, found["springs/pairs"])), [(0, 1), (0, 3), (1, 2), (2, 3)])
        np.testing.assert_allclose(found["springs/rest_length"], 3)
        self.assertEqual(found["springs/stiffness"].tolist(), [2.5] * 4)
        self.assertIn("model 1 of 2", found["said"])
        self.assertIn("1 alternative places left out", found["said"])
        self.assertEqual(len(self.lattice("--cutoff", "5")["springs/pairs"]), 6)
        self.assertEqual(len(self.lattice("--cutoff", "3")["springs/pairs"]), 4)  # as close counts

    def test_chain_model_and_place_can_be_chosen(self):
        self.assertEqual(self.lattice("--chain", "B")["particles/position"].tolist(), [[0, 3, 0]])
        self.assertEqual(self.lattice("--model", "2")["particles/position"].tolist(), [[0, 0, 5]])
        self.assertEqual(self.lattice("--altloc", "B")["particles/position"][1].tolist(), [3, 1, 0])

    def test_what_cannot_be_is_said_in_one_line(self):
        self.refuses(lambda: self.lattice("--chain", "X"), "no C-alpha in chain X; there are A, B")
        self.refuses(lambda: self.lattice("--model", "3"), "no model 3; there are 2, counted from 1")
        self.refuses(lambda: self.lattice(text="END\n"), "no C-alpha atom")
        self.refuses(lambda: self.lattice(text=FILE.replace("   3.000", "   three")), "is no coordinate (columns 31 to 38)")
        self.refuses(lambda: self.lattice(text=FILE.replace("   3.000   3.000   0.000", "   0.000   3.000   0.000")),
                     "atoms 5 (chain A, residue 3) and 7 (chain B, residue 1) lie at one place")
        self.refuses(lambda: self.lattice("--cutoff", "0"), "--cutoff 0.0: must be positive")
        mesh = synthetic.cube(self.path("c.h5md"), 3, frames=2)
        self.refuses(lambda: convert.main([mesh, "-o", self.path("o.xyz"), "--cutoff", "5"]), "are for PDB files")


    def test_records_that_do_not_begin_in_column_1(self):
        """A mark of UTF-8 at the start is passed over; other characters before an atom or a model are refused with the line: what follows would be passed over."""
        mark, whole = "\xef\xbb\xbf", self.lattice()
        self.assertEqual(self.lattice(text=mark + FILE)["particles/id"].tolist(), whole["particles/id"].tolist())
        atoms = "".join(line + "\n" for line in FILE.split("ENDMDL")[0].splitlines() if line.startswith(("ATOM", "HETATM")))
        self.assertEqual(self.lattice(text=mark + atoms)["particles/id"].tolist(), whole["particles/id"].tolist())
        self.assertEqual(self.lattice(text=FILE.replace("made by hand", "J\xfcrgen's atom  and ATOM"))["particles/id"].tolist(), whole["particles/id"].tolist())
        lines = FILE.splitlines()
        for k in [k for k, line in enumerate(lines) if line.startswith(("ATOM", "HETATM", "MODEL"))]:
            for spoilt in ("\xef" + lines[k], " " + lines[k], mark + lines[k], lines[k].replace("ATOM  ", "ATOM\t").replace("HETATM", "hetatm").replace("MODEL", "?MODEL")):
                with self.subTest(line=spoilt):
                    self.refuses(lambda: self.lattice(text="\n".join([*lines[:k], spoilt, *lines[k + 1:]])), f"made.pdb line {k + 1}: {ascii(spoilt.strip()[:30])} is no record")


class Drawn(Case):
    def modes(self):
        """A cube with three made-up modes: up and down, a growing one, sideways."""
        path = synthetic.cube(self.path("c.h5md"), 3, frames=1)
        q = np.zeros((3, 27, 3))
        q[0, :, 2], q[1, 0, 0], q[2, :, 0] = -0.5, 1.0, 0.25
        with h5py.File(path, "a") as f:
            f["modes/omega_squared"], f["modes/shape"] = np.array([4.0, -1.0, 9.0]), q
            f["modes/fluctuation"] = np.linspace(1, 2, 27)
        return path

    def test_a_mode_is_a_period_of_motion(self):
        path = self.modes()
        with ModeRun(path, 0, 0.1) as run:
            size = np.linalg.norm(np.ptp(run.position(0), axis=0))
            self.assertEqual(run.frames, FRAMES)
            self.assertEqual(run.words(), "mode 0: 0.31831 Hz; modes count from 0, it is number 1 of the 3 in the file")
            self.assertAlmostEqual(run.times[-1] + run.times[1], np.pi)  # 2 pi/omega
            moved = run.position(FRAMES // 4) - run.position(0)
            np.testing.assert_allclose(moved, np.tile([0, 0, -0.1 * size], (27, 1)), atol=1e-12)
            np.testing.assert_allclose(run.velocity(0), 2.0 * moved, atol=1e-12)
        with ModeRun(path, 1, 0.1) as run:
            self.assertEqual(run.title(), "mode 1: growing at 1 1/s")
            run.omega_squared = 4e14 * np.pi ** 2
            self.assertEqual((run.title(), run.title(number)), ("mode 1: 1e+07 Hz", "mode 1: $10^{7}$ Hz"))
        self.refuses(lambda: ModeRun(path, 3, 0.1), "no mode 3; there are 3, counted from 0")
        self.refuses(lambda: ModeRun(synthetic.cube(self.path("d.h5md"), 3, frames=1), 0, 0.1), "holds no modes")

    def test_strains_of_a_mode_are_those_of_first_order(self):
        """A rotation, drawn far, strains nothing; a stretch by a along x strains a spring along (cx, cy, cz) by a cx^2."""
        path = synthetic.cube(self.path("c.h5md"), 3, frames=1)
        with h5py.File(path, "a") as f:
            x, pairs = f["particles/trajectory/position/value"][0], f["connectivity/bonds"][...]
            q = np.zeros((2, 27, 3))
            q[0, :, 0], q[0, :, 1], q[1, :, 0] = -x[:, 1], x[:, 0], x[:, 0]
            f["modes/omega_squared"], f["modes/shape"] = np.array([1.0, 4.0]), q
            f["connectivity/bonds_rest_length"][...] = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1)
        with ModeRun(path, 0, 0.5) as run:
            np.testing.assert_allclose(run.strains(FRAMES // 4), 0, atol=1e-14)
        with ModeRun(path, 1, 0.5) as run:
            far = 0.5 * np.linalg.norm(np.ptp(x, axis=0)) / np.abs(x[:, 0]).max()
            along = x[pairs[:, 1]] - x[pairs[:, 0]]
            np.testing.assert_allclose(run.strains(FRAMES // 4), far * along[:, 0] ** 2 / (along ** 2).sum(axis=1), rtol=1e-13, atol=1e-15)
            np.testing.assert_allclose(run.strains(FRAMES // 4 * 3), -run.strains(FRAMES // 4), rtol=1e-12)

    def test_films_of_modes_in_periodic_boxes(self):
        """Every frame of the period has the box, and the broken springs, of the state that the mode was taken at."""
        path = synthetic.chain(self.path("p.h5md"), 2, frames=1)
        with h5py.File(path, "a") as f:
            box, n = f["particles/trajectory/box"], 12
            box.attrs["boundary"], box["edges/value"] = ["periodic", "none"], np.array([[1.0 + 1 / 11, 5.0]])
            bonds = np.concatenate([f["connectivity/bonds"][...], [[n - 1, 0]]])
            for name, data in (("", bonds), ("_shift", np.eye(1, 2 * n, 2 * n - 2).reshape(n, 2).astype(int)), ("_stiffness", np.ones(n)), ("_rest_length", np.full(n, 1 / 11)),
                               ("_damping", np.zeros(n))):
                if "connectivity/bonds" + name in f:
                    del f["connectivity/bonds" + name]
                f["connectivity/bonds" + name] = data
            f["backspring/broken/value"] = np.eye(1, n, 3)
            q = np.zeros((1, n, 2))
            q[0, 4, 1] = 1.0
            f["modes/omega_squared"], f["modes/shape"] = np.array([4.0]), q
        with contextlib.redirect_stdout(io.StringIO()):
            movie.main([path, "-o", self.path("m.gif"), "--mode", "0", "--size", "160x120", "--quiet", "--stride", "12"])
        self.assertGreater(os.path.getsize(self.path("m.gif")), 1000)
        with ModeRun(path, 0, 0.1) as run:
            self.assertEqual(np.flatnonzero(~np.isfinite(run.strains(40))).tolist(), [3])
            self.assertLess(run.lengths(30)[-1], 0.3)  # through the face, not across the chain

    def test_the_unit_of_lengths_of_the_lattice(self):
        """convert.py says it in the lattice; who reads a trajectory finds it as long as the lattice is there and of these particles."""
        self.lattice("--chain", "A,B")
        path = synthetic.chain(self.path("c.h5md"), 3, n=4)
        with h5py.File(path, "a") as f:
            f["parameters/options"].attrs["bs_lattice_file"] = "out.h5"
            f["particles/trajectory/id"][...] = [2, 3, 5, 7]

        def unit():
            with open_run(path) as run:
                return run.unit("position"), run.unit("velocity")
        self.assertEqual(unit(), ("Angstrom", "m/s"))
        with h5py.File(path, "a") as f:
            f["particles/trajectory/position/value"].attrs["unit"] = "m"
            f["particles/trajectory/id"][0] = 1
        self.assertEqual(unit()[0], "m")
        with h5py.File(path, "a") as f:
            del f["particles/trajectory/position/value"].attrs["unit"]
        self.assertEqual(unit()[0], "m")  # other particles
        os.remove(self.path("out.h5"))
        self.assertEqual(unit()[0], "m")

    def test_pictures(self):
        path, still = self.modes(), self.path("still.png")
        with contextlib.redirect_stdout(io.StringIO()):
            movie.main([path, "-o", still, "--mode", "2", "--frame", "12", "--quiet"])
            movie.main([path, "-o", self.path("still.svg"), "--mode", "2", "--frame", "12", "--quiet", "--length_unit", "angstrom"])
            plot.main([path, "-o", self.path("sheet.png"), "--dpi", "50"])
            plot.main([path, "-o", self.path("b.png"), "--kind", "bfactor", "--dpi", "50"])
            self.refuses(lambda: plot.main([path, "-o", self.path("p.png"), "--kind", "bfactor", "--pdb", self.path("made.pdb", FILE)]),
                         "4 C-alpha atoms, 27 particles")
        with open(self.path("still.svg"), encoding="utf-8") as f:
            drawn = f.read()
        for words in ("[0-9.]+ Å", "mode 2: 0.47746 Hz, .t. = .* s, strain 0"):
            self.assertTrue(re.search(f"<!-- {words} -->", drawn), words)
        for name in ("still.png", "sheet.png", "b.png"):
            self.assertGreater(os.path.getsize(self.path(name)), 1000)


if __name__ == "__main__":
    unittest.main(verbosity=1)
