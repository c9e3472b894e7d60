#!/usr/bin/env python3
"""convert.py on LAMMPS data made by hand: /usr/bin/python3 tests/postprocess/test_convert.py"""
import base64
import contextlib
import gzip
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
import synthetic  # noqa: E402
from backspring_io import RunError  # noqa: E402

MADE = ("--stiffness", "7", "--mass", "0.5")


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="backspring_")
        self.addCleanup(shutil.rmtree, self.folder)

    def write(self, name, data):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as f:
            f.write(data if isinstance(data, bytes) else data.encode())
        return path

    def lattice(self, path, *args):
        """What the lattice holds, and what was said on the way."""
        said, out = io.StringIO(), os.path.join(self.folder, "out.h5")
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            convert.main([path, "-o", out, *args])
        with h5py.File(out, "r") as f:
            found = {name: f[name][...] for group in ("particles", "springs", "angles", "box", "groups") if group in f for name in (f"{group}/{k}" for k in f[group])}
        found["said"] = said.getvalue()
        return found

    def refuses(self, path, *args, says):
        with self.assertRaises(RunError) as caught:
            self.lattice(path, *args)
        self.assertIn(says, str(caught.exception))
        self.assertNotIn("\n", str(caught.exception))


def data(title="by hand, units = lj", box="0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n", atoms="1 1 1 9.5 5 5\n2 1 1 0.5 5 5\n3 1 1 1.5 5 9.5\n",
         bonds="1 1 1 2\n2 1 2 3\n", style=" # bond", coefficients="Bond Coeffs # harmonic\n\n1 10 1.0\n\n", more=""):
    count = [len(t.splitlines()) for t in (atoms, bonds)]
    return (f"{title}\n\n{count[0]} atoms\n{count[1]} bonds\n{more}1 atom types\n1 bond types\n{box}\nMasses\n\n1 12.0\n\n{coefficients}"
            f"Atoms{style}\n\n{atoms}\nBonds\n\n{bonds}")


class Lammps(Case):
    def test_molecules_cut_by_the_box_are_put_together(self):
        found = self.lattice(self.write("data.cut", data(atoms="1 1 1 9.5 5 5\n2 1 1 0.5 5 5\n3 1 1 1.5 5 5\n")))
        np.testing.assert_allclose(found["particles/position"], [[9.5, 5], [10.5, 5], [11.5, 5]])
        self.assertIn("1 bond crosses the periodic box", found["said"])
        self.assertEqual(found["particles/id"].tolist(), [1, 2, 3])
        open_box = self.lattice(self.write("data.cut", data(atoms="1 1 1 9.5 5 5\n2 1 1 0.5 5 5\n3 1 1 1.5 5 5\n")), "--boundary", "f,p,p")
        np.testing.assert_allclose(open_box["particles/position"][:, 0], [9.5, 0.5, 1.5])  # the user knows better
        self.assertEqual(open_box["said"], "")

    def test_flags_and_bonds_that_disagree(self):
        """LAMMPS takes a bond between nearest images whatever the flags say."""
        atoms = "1 1 1 9.5 5 5 2 0 0\n2 1 1 0.5 5 5 0 0 0\n3 1 1 4 4 4 0 0 1\n"
        found = self.lattice(self.write("data.x", data(atoms=atoms, bonds="1 1 2 1\n")))
        np.testing.assert_allclose(found["particles/position"], [[-0.5, 5, 5], [0.5, 5, 5], [4, 4, 14]])

    def test_tilted_box(self):
        box = "0 10 xlo xhi\n0 10 ylo yhi\n0 10 zlo zhi\n2 -1 3 xy xz yz\n"
        found = self.lattice(self.write("data.t", data(box=box, atoms="1 1 1 5 5 5 1 2 3\n2 1 1 6 5 5 1 2 3\n", bonds="1 1 1 2\n")), "--dim", "3")
        np.testing.assert_allclose(found["particles/position"][0], [5 + 10 + 2 * 2 - 3, 5 + 20 + 3 * 3, 5 + 30])
        found = self.lattice(self.write("data.t", data(box=box, atoms="1 1 1 5 9.9 5\n2 1 1 3 0.1 5\n", bonds="1 1 1 2\n")), "--dim", "3")
        np.testing.assert_allclose(found["particles/position"][1], [3 + 2, 0.1 + 10, 5])

    def test_networks_of_periodic_boxes_keep_the_box(self):
        ring = data(atoms="".join(f"{i + 1} 1 1 {2.5 * i} 5 5\n" for i in range(4)), bonds="1 1 1 2\n2 1 2 3\n3 1 3 4\n4 1 4 1\n")
        found = self.lattice(self.write("data.ring", ring), "--dim", "3")
        np.testing.assert_array_equal(found["springs/shift"], [[0, 0, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0]])
        np.testing.assert_array_equal(found["box/edges"], np.diag([10.0, 10, 10]))
        self.assertIn("the lattice is periodic", found["said"])
        flat = self.lattice(self.write("data.ring", ring), "--boundary", "p,p,f", "--dim", "2")
        np.testing.assert_array_equal(flat["springs/shift"], [[0, 0], [0, 0], [0, 0], [1, 0]])
        self.assertEqual(len(self.lattice(self.write("data.ring", ring), "--boundary", "f,f,f", "--dim", "3")["springs/pairs"]), 4)
        self.refuses(self.write("data.ring", ring), "--boundary", "periodic", says="--boundary periodic: write p")

    def test_units(self):
        """K in kcal/mol per square angstrom, mass in g/mol, time in fs: 1 kcal/mol is 4184 J/mol."""
        path = self.write("data.u", data(title="no units here"))
        self.refuses(path, says="does not say the units of its Bond Coeffs; add --units")
        for units, expected in (("lj", 20.0), ("real", 20 * 4184e-7), ("metal", 20 * 9648.53321233), ("nano", 20.0)):
            np.testing.assert_allclose(self.lattice(path, "--units", units)["springs/stiffness"], expected, rtol=1e-10)
        si = self.lattice(path, "--units", "real", "--si", "--dim", "3")
        np.testing.assert_allclose(si["springs/stiffness"], 20 * 4184 / 6.02214076e23 / 1e-20, rtol=1e-12)
        np.testing.assert_allclose(si["particles/mass"], 12e-3 / 6.02214076e23, rtol=1e-12)
        np.testing.assert_allclose(si["particles/position"][2], [11.5e-10, 5e-10, 9.5e-10], rtol=1e-12)
        np.testing.assert_allclose(si["springs/rest_length"], 1e-10, rtol=1e-12)
        self.refuses(path, "--units", "lj", "--si", says="lj are relative")
        self.refuses(self.write("data.v", data(title="LAMMPS data file, units = real")), "--units", "metal", says="says units = real, --units says metal")
        self.assertEqual(self.lattice(path, *MADE, "--rest_length", "2")["springs/stiffness"].tolist(), [7, 7])  # nothing of the file's is used
        found = self.lattice(path, *MADE)  # but for the rest lengths
        self.assertEqual((found["springs/stiffness"].tolist(), found["springs/rest_length"].tolist()), ([7, 7], [1, 1]))

    def test_springs_of_the_users(self):
        fene = data(coefficients="Bond Coeffs # fene\n\n1 30 1.5 1 1\n\n")
        path = self.write("data.fene", fene)
        self.refuses(path, says="bond style fene is not a spring")
        found = self.lattice(path, "--stiffness", "3", "--rest_length", "0.97")
        np.testing.assert_array_equal(found["springs/rest_length"], [0.97, 0.97])
        strain = self.lattice(path, "--stiffness", "3", "--rest_length", "0", "--spring_law", "strain")
        np.testing.assert_array_equal((strain["springs/stiffness"], strain["springs/rest_length"]), ([3, 3], [0, 0]))
        self.refuses(path, "--rest_length", "-1", says="--rest_length -1.0: must be 0 or more")

    def test_styles_and_names(self):
        """Without a hint, by what fits; with bonds only styles that have bonds; gzip; velocities along z keep three dimensions."""
        found = self.lattice(self.write("water.init", data(style="", atoms="1 1 1 -0.8 9.5 5 5\n2 1 1 0.4 0.5 5 5\n3 1 1 .4 1 5 5\n")))
        self.assertIn("read as full", found["said"])
        found = self.lattice(self.write("data.gz", gzip.compress(data().encode())))
        self.assertEqual(len(found["particles/mass"]), 3)
        hybrid = data(style=" # hybrid", atoms="1 1 1 5 5 7 0 0\n2 1 2 5 5 8 0 0\n3 1 3 5 5 9 0 0\n")
        np.testing.assert_allclose(self.lattice(self.write("data.h", hybrid))["particles/position"][:, 0], [1, 2, 3])
        flat = data(atoms="1 1 1 1 5 0\n2 1 1 2 5 0\n3 1 1 3 5 0\n") + "\nVelocities\n\n1 0 0 2\n2 0 0 2\n3 0 0 2\n"
        self.assertEqual(self.lattice(self.write("data.flat", flat))["particles/velocity"].shape, (3, 3))
        labels = data().replace("Atoms", "Atom Type Labels\n\n1 C\n\nAtoms").replace(" 1 1 9.5", " 1 C 9.5")
        self.assertEqual(self.lattice(self.write("data.label", labels))["particles/mass"].tolist(), [12, 12, 12])
        self.assertIn("4 angles left out", self.lattice(self.write("data.a", data(more="4 angles\n")))["said"])
        for change, says in ((("2 1 1 0.5 5 5\n", ""), "announces 3 atoms, section Atoms has 2 rows; truncated?"), (("# bond", "# smd"), "unknown style 'smd'"),
                             (("# bond", "# template"), "molecule file"), (("10 xlo xhi", "10 xlo xhi\n1 2 3 avec"), "general triclinic"),
                             (("0.5 5 5", "0.5 5 5 5 5 5 5 5"), "columns, atom style bond"), (("9.5 5 5", "0.5 5 5"), "1 and 2 lie at one place")):
            self.assertIn(change[0], data())
            self.refuses(self.write("data.bad", data().replace(*change)), says=says)

    def test_numbers_that_are_none(self):
        """What is not finite, negative stiffnesses, masses of 0: refused with the line, as in meshes and PDB files."""
        for before, after, says in (("9.5 5 5", "nan 5 5", ":21: 'nan 5 5' in Atoms: nan is not a finite number"), ("1 10 1.0", "1 -5 1.0", "in Bond Coeffs: -5 is negative"),
                                    ("1 10 1.0", "1 1e400 1.0", ":17: '1e400 1.0' in Bond Coeffs: 1e400 is not a finite number"),
                                    ("1 10 1.0", "1 10 inf", "inf is not a finite number"), ("1 12.0", "1 0.0", "in Masses: a mass must be positive"),
                                    ("1 12.0", "1 nan", "nan is not a finite number"), ("0 10 ylo", "0 inf ylo", "in the header: inf is not a finite number")):
            self.assertIn(before, data())
            self.refuses(self.write("data.bad", data().replace(before, after)), says=says)
        self.refuses(self.write("data.v", data() + "\nVelocities\n\n1 0 0 -inf\n2 0 0 0\n3 0 0 0\n"), says="in Velocities: -inf is not a finite number")

    def test_rows_of_another_width(self):
        """A row with a column too few or too many is refused with its line, whatever the section; so is a row that names again what another one named."""
        whole = data(more="1 angles\n1 angle types\n").replace("Atoms #", "Angle Coeffs # harmonic\n\n1 6 120\n\nAtoms #") \
            + "\nAngles\n\n1 1 1 2 3\n\nVelocities\n\n1 0 0 1\n2 0 0 2\n3 0 0 3\n"
        lines = whole.split("\n")
        self.assertEqual(self.lattice(self.write("data.whole", whole))["particles/velocity"][:, 2].tolist(), [1, 2, 3])
        for section in ("Masses", "Bonds", "Angles", "Velocities"):
            at = next(k for k, line in enumerate(lines) if line.startswith(section)) + 2
            for row, how in ((lines[at] + " 1", "one more"), (lines[at].rsplit(" ", 1)[0], "one less")):
                with self.subTest(section=section, how=how):
                    self.refuses(self.write("data.bad", "\n".join([*lines[:at], row, *lines[at + 1:]])), says=f"data.bad:{at + 1}: '{row}' in {section}")
        for section, key in (("Masses", "type 1"), ("Bond Coeffs", "type 1"), ("Angle Coeffs", "type 1"), ("Atoms", "atom 1"), ("Velocities", "atom 1")):
            at = next(k for k, line in enumerate(lines) if line.startswith(section)) + 2
            rest = at + 2 if section in ("Atoms", "Velocities") else at + 1  # in place of the next row where the number of rows is announced
            again = [*lines[:at + 1], lines[at], *lines[rest:]]
            with self.subTest(section=section, how="twice"):
                self.refuses(self.write("data.bad", "\n".join(again)), says=f"data.bad:{at + 2}: {section} names {key} a second time, after line {at + 1}")
        cut = whole.replace("3 atoms\n", "").replace("3 0 0 3\n", "")
        self.refuses(self.write("data.bad", cut), says="Velocities has no row of atom 3")
        turning = data(style=" # sphere", atoms="1 1 1 1 1 5 5\n2 1 1 1 2 5 5\n3 1 1 1 3 5 5\n") + "\nVelocities\n\n" + "".join(f"{i} 0 0 {i} 7 8 9\n" for i in (3, 1, 2))
        self.assertEqual(self.lattice(self.write("data.turning", turning))["particles/velocity"][:, 2].tolist(), [1, 2, 3])
        self.refuses(self.write("data.bad", turning.replace(" 7 8 9", "")), says="write 7: id vx vy vz wx wy wz")

    def test_whole_numbers_and_boxes(self):
        for before, after, says in (("3 1 1 1.5", f"{2 ** 63} 1 1 1.5", f"'{2 ** 63}' in Atoms has more than 64 bits"),
                                    ("3 1 1 1.5", "3.5 1 1 1.5", "'3.5' in Atoms is not a whole number"),
                                    ("2 1 2 3", f"2 1 2 {2 ** 63}", "has more than 64 bits"),
                                    ("2 1 2 3", "2 1 2 2.5", ":28: '2.5' in the column of an atom is not a whole number"),
                                    ("0 10 xlo", "10 0 xlo", ":7: '10 0 xlo xhi': the box ends below where it begins")):
            self.assertIn(before, data())
            self.refuses(self.write("data.bad", data().replace(before, after)), says=says)
        largest = data().replace("3 1 1 1.5", f"{2 ** 63 - 1} 1 1 1.5").replace("2 1 2 3", f"2 1 2 {2 ** 63 - 1}")
        self.assertEqual(self.lattice(self.write("data.big", largest))["particles/id"][2], 2 ** 63 - 1)

    def test_angles(self):
        """E = K (theta - theta0)^2: kappa = 2 K, energies as for bonds; in the plane angles start below pi; what is no angle spring is named."""
        def bent(coefficients="Angle Coeffs # harmonic\n\n1 6 120\n\n", title="by hand, units = lj", atoms="1 1 1 1 5 0\n2 1 1 2 5 0\n3 1 1 3 6 0\n", rows="1 1 1 2 3\n"):
            return (data(title=title, atoms=atoms, more=f"{len(rows.splitlines())} angles\n1 angle types\n").replace("Atoms #", coefficients + "Atoms #")
                    + f"\nAngles\n\n{rows}")
        def found(**how):
            return self.lattice(self.write("data.angle", bent(**how)), "--boundary", "f,f,f")
        # from (1, 5) to (3, 6) about (2, 5) it is 225 degrees counter-clockwise: turned round
        flat = found()
        self.assertEqual(flat["angles/triples"].tolist(), [[2, 1, 0]])
        np.testing.assert_allclose([flat["angles/stiffness"], flat["angles/rest_angle"]], [[12], [2 * np.pi / 3]], rtol=1e-15)
        self.assertEqual(found(rows="1 1 3 2 1\n")["angles/triples"].tolist(), [[2, 1, 0]])
        solid = found(atoms="1 1 1 1 5 0\n2 1 1 2 5 0\n3 1 1 3 6 1\n", title="by hand, units = real")
        self.assertEqual(solid["angles/triples"].tolist(), [[0, 1, 2]])
        np.testing.assert_allclose(solid["angles/stiffness"], 12 * 4.184e-4, rtol=1e-12)  # g/mol angstrom^2/fs^2 of a kcal/mol
        si = self.lattice(self.write("data.si", bent(title="by hand, units = real")), "--boundary", "f,f,f", "--si")
        np.testing.assert_allclose(si["angles/stiffness"], 12 * 4184 / 6.02214076e23, rtol=1e-12)
        for how, says in (({"coefficients": ""}, "1 angles left out: the file has no Angle Coeffs"),
                          ({"coefficients": "Angle Coeffs # cosine\n\n1 6\n\n"}, "angle style cosine is no angle spring"),
                          ({"coefficients": "Angle Coeffs\n\n1 6 120 1 2\n\n"}, "are not harmonic K theta0"),
                          ({"coefficients": "Angle Coeffs\n\n2 6 120\n\n"}, "Angle Coeffs has no angle type 1")):
            left = found(**how)
            self.assertIn(says, left["said"])
            self.assertNotIn("angles/triples", left)
        self.refuses(self.write("data.neg", bent(coefficients="Angle Coeffs # harmonic\n\n1 -6 120\n\n")), says="-6 is negative")
        self.refuses(self.write("data.nan", bent(coefficients="Angle Coeffs # harmonic\n\n1 6 nan\n\n")), says="nan is not a finite number")
        self.refuses(self.write("data.flat", bent(coefficients="Angle Coeffs # harmonic\n\n1 6 0\n\n")), says="a rest angle lies above 0")
        self.refuses(self.write("data.few", bent().replace("1 angles", "2 angles")), says="announces 2 angles, section Angles has 1 row")
        self.refuses(self.write("data.odd", bent(rows="1 1 1 2 9\n")), says="9")

    def test_trajectories_become_files_called_data(self):
        run = synthetic.cube(os.path.join(self.folder, "c.h5md"), 3, frames=2)
        out = os.path.join(self.folder, "data.cube")
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            convert.main([run, "-o", out, "--units", "metal"])
        with open(out, encoding="utf-8") as f:
            text = f.read()
        rows = text.split("Atoms # bond\n\n")[1].split("\n\n")[0].splitlines()
        self.assertEqual([r.split()[0] for r in rows], [str(i + 1) for i in range(27)])
        self.assertIn("units = metal", text)
        np.testing.assert_allclose(self.lattice(out)["springs/stiffness"], 50.0, rtol=1e-12)

    def test_times_and_steps_of_every_series(self):
        """Frames 1 to 3 of four, ten steps apart: the first is left out, so that neither a frame's number nor its row is its step."""
        run = synthetic.cube(os.path.join(self.folder, "c.h5md"), 3, frames=4)
        with h5py.File(run, "r") as f:
            t, step = (f["particles/trajectory/position/" + name][1:] for name in ("time", "step"))
        self.assertEqual(step.tolist(), [10, 20, 30])

        def put(ending, *args):
            out = os.path.join(self.folder, "series" + ending)
            with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                convert.main([run, "-o", out, *args])
            return out

        def numbers(path, pattern):
            with open(path, encoding="utf-8") as f:
                return [float(found) for found in re.findall(pattern, f.read())]
        xyz, pvd = put(".xyz", "--frames", "1:4"), put(".pvd", "--frames", "1:4")
        self.assertEqual((numbers(xyz, r" Time=(\S+)"), numbers(xyz, r" Step=(\S+)")), (t.tolist(), step.tolist()))
        self.assertEqual(numbers(put(".dump", "--frames", "1:4"), r"ITEM: TIMESTEP\n(\d+)"), step.tolist())
        self.assertEqual(numbers(pvd, r'timestep="(\S+)"'), t.tolist())
        with open(put(".vtu", "--frame", "2"), encoding="ascii") as f:
            coded = re.search(r'Name="time"[^>]*>([^<]*)<', f.read()).group(1)
        self.assertEqual(np.frombuffer(base64.b64decode(coded)[8:]).tolist(), [t[1]])
        with h5py.File(put("_nm.h5md", "--frames", "1:4", "--units", "real"), "r") as f:  # femtoseconds, angstrom/femtosecond
            group = f["particles/trajectory"]
            np.testing.assert_allclose(group["position/time"][...], 1e-15 * t, rtol=1e-14)
            self.assertEqual(group["velocity/step"][...].tolist(), step.tolist())
            with h5py.File(run, "r") as own:
                np.testing.assert_allclose(group["velocity/value"][...], 1e5 * own["particles/trajectory/velocity/value"][1:], rtol=1e-14)
        try:
            import gsd.hoomd
        except ImportError:
            return
        with gsd.hoomd.open(put(".gsd", "--frames", "1:4"), "rb") as frames:
            self.assertEqual([(frame.configuration.step, frame.log["time"][0]) for frame in frames], list(zip(step, t)))

    def test_fixed_particles_are_types_of_their_own(self):
        x = np.array([[[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]])
        run, out = os.path.join(self.folder, "f.h5md"), os.path.join(self.folder, "f.data")
        synthetic.write_run(run, x, 0 * x, np.zeros(1), np.array([[0, 1], [1, 2]]), mass=np.array([1.0, 1.0, 2.0]), fixed=np.array([1, 0, 0]))
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            convert.main([run, "-o", out])
        with open(out, encoding="utf-8") as f:
            text = f.read()
        masses = [line.split() for line in text.split("Masses\n\n")[1].split("\n\n")[0].splitlines()]
        kind = [line.split()[2] for line in text.split("Atoms # bond\n\n")[1].split("\n\n")[0].splitlines()]
        held = {line[0] for line in masses if "fixed" in line}
        self.assertEqual([float(dict((line[0], line[1]) for line in masses)[k]) for k in kind], [1.0, 1.0, 2.0])
        self.assertEqual([k in held for k in kind], [True, False, False])


if __name__ == "__main__":
    unittest.main(verbosity=1)
