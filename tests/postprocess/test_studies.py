#!/usr/bin/env python3
"""Tests of sweep.py, and of reading runs alive and killed, with the program itself:
/usr/bin/python3 tests/postprocess/test_studies.py --program build/release/backspring"""
import csv
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE]
import test_postprocess as base  # noqa: E402
import h5py  # noqa: E402
import numpy as np  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from study_orders import efficiency, fit_order, scaling_series  # noqa: E402

PROGRAM = ""
FALL = os.path.join(base.ROOT, "options", "problems", "free_fall.yaml")
CLOTH = ["-bs_lattice_type", "cloth", "-bs_lattice_size", "6,6", "-bs_lattice_spacing", "0.1", "-bs_lattice_total_mass", "0.05",
         "-bs_lattice_stiffness", "20,10,0.5", "-bs_lattice_damping", "0.01", "-bs_spring_law", "strain", "-bs_lattice_fixed_particles",
         "30,35", "-bs_gravity", "0,0,-9.81"]


class Sweeping(base.Case):
    def sweep(self, *args, code=0, out="study"):
        command = [sys.executable, os.path.join(base.TOOLS, "sweep.py"), "--program", PROGRAM, "-o", self.path(out), *map(str, args)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=280, cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        return done

    def rows(self, out="study"):
        with open(os.path.join(self.path(out), "study.csv"), newline="", encoding="utf-8") as f:
            return list(csv.DictReader(f))

    def orders(self, text):
        """{series: order} of the table with the orders."""
        lines = text.splitlines()
        start = next(k for k, line in enumerate(lines) if line.endswith("order"))
        return {line.split()[0]: float(line.split()[-1]) for line in lines[start + 1:start + 4]}

    def check_orders(self, done, least=0.93):
        found = self.orders(done.stdout)
        expected = {"ts_type=beuler": 1, "ts_type=cn": 2, "ts_type=bdf": 2}
        self.assertEqual(set(found), set(expected))
        for name, order in expected.items():
            self.assertTrue(least * order <= found[name] <= 1.06 * order, done.stdout)

    def test_orders_of_free_fall(self):
        done = self.sweep(os.path.join(base.ROOT, "options", "studies", "free_fall.yaml"))
        self.check_orders(done)
        for name in ("convergence.png", "work_precision.png"):
            self.picture(os.path.join(self.path("study"), name))
        # The figures of the table are those of the files.
        rows = self.rows()
        self.assertEqual(len(rows), 12)
        reference = next(n for n in os.listdir(self.path("study")) if n.startswith("reference_"))

        def last(point):
            with h5py.File(os.path.join(self.path("study"), point, "run.h5md"), "r") as f:
                group = f["particles/trajectory"]
                return group["position/time"][-1], group["position/value"][-1], group["velocity/value"][-1]
        t, x, v = last(reference)
        self.assertEqual(t, 25)
        for row in rows:
            other = last(row["point"])
            self.assertEqual((other[0], row["status"], int(row["steps"])), (25, "ok", round(25 / float(row["ts_dt"]))))
            self.assertAlmostEqual(float(row["error_position_rms"]), abs(float(other[1] - x)), delta=1e-12)
            self.assertAlmostEqual(float(row["error_velocity_max"]), abs(float(other[2] - v)), delta=1e-12)
        self.same_numbers(rows)
        # Called again nothing is run, and the finest run is a reference, too: the orders allow for its own error.
        again = self.sweep(os.path.join(base.ROOT, "options", "studies", "free_fall.yaml"), "--reference", "finest")
        self.assertIn("12 of 12 points are finished, 0 to run", again.stdout)
        self.check_orders(again)

    def same_numbers(self, rows):
        with h5py.File(os.path.join(self.path("study"), "study.h5"), "r") as f:
            np.testing.assert_allclose(f["table/ts_dt"][...], [float(r["ts_dt"]) for r in rows])
            self.assertEqual([t.decode() for t in f["table/ts_type"][...]], [r["ts_type"] for r in rows])
            group = f[f"points/{rows[5]['point']}"]
            with open_run(os.path.join(self.path("study"), rows[5]["point"], "run.h5md")) as run:
                np.testing.assert_array_equal(group["observables/total_energy"][...], run.series["total_energy"])
                np.testing.assert_array_equal(group["log/newton"][...], run.log["newton"])
                self.assertAlmostEqual(float(rows[5]["last_total_energy"]), run.series["total_energy"][-1], delta=1e-12)

    def test_a_file_as_reference(self):
        args = ["--options_file", FALL, "--options", "-ts_max_time 2", "--vary", "-ts_type=cn", "--vary", "-ts_dt=0.5,0.25", "--error",
                "error_velocity_max"]
        self.sweep(*args, out="first")
        file = os.path.join(self.path("first"), self.rows("first")[1]["point"], "run.h5md")
        done = self.sweep(*args, "--reference", file, out="second")
        first, second = self.rows("second")
        with open_run(file) as a, open_run(os.path.join(self.path("second"), first["point"], "run.h5md")) as b:
            self.assertAlmostEqual(float(first["error_velocity_max"]), abs(a.velocities[-1] - b.velocities[-1]).max(), delta=1e-15)
            self.assertAlmostEqual(float(first["error_velocity_worst"]), abs(a.velocities[:] - b.velocities[:]).max(), delta=1e-15)
        self.assertEqual(float(second["error_velocity_max"]), 0.0)
        self.assertIn(f"error_velocity_max against {file}", done.stdout)
        done = self.sweep(*args, "--reference", self.path("none.h5md"), out="third", code=2)
        self.assertIn("no such file", done.stderr)
        self.assertFalse(os.path.exists(self.path("third")))

    def test_orders_of_a_cloth(self):
        done = self.sweep("--options", shlex.join(CLOTH + ["-ts_max_time", "0.12", "-snes_rtol", "1e-10"]), "--vary",
                          "-ts_type=beuler,cn,bdf", "--vary", "-ts_dt=0.002,0.001,0.0005,0.00025", "--jobs", 2, "--reference",
                          "-ts_type rk -ts_rk_type 4 -ts_dt 1e-4", "--picture", "svg")
        self.check_orders(done)
        self.assertTrue(os.path.getsize(os.path.join(self.path("study"), "convergence.svg")) > 5000)

    def test_failed_points_are_listed_and_tried_again_only_when_told(self):
        args = ["--options_file", FALL, "--options", "-ts_max_time 1", "--vary", "-ts_type=beuler,nonsense", "--vary", "-ts_dt=0.5,0.25"]
        done = self.sweep(*args, code=3)
        self.assertIn("2 of 4 points failed", done.stderr)
        self.assertIn("ts_type=nonsense ts_dt=0.25: exit code", done.stderr)
        self.assertEqual([r["status"] for r in self.rows()], ["ok", "ok", "failed", "failed"])
        self.assertIn("nonsense", self.rows()[2]["reason"])
        self.assertIn("4 of 4 points are finished, 0 to run", self.sweep(*args, code=3).stdout)
        again = self.sweep(*args, "--retry_failed", code=3)
        self.assertIn("2 of 4 points are finished, 2 to run", again.stdout)
        # A study that grows keeps its points, whatever the order of the values.
        more = self.sweep("--options_file", FALL, "--options", "-ts_max_time 1", "--vary", "-ts_type=cn,beuler", "--vary", "-ts_dt=0.25,0.5")
        self.assertIn("2 of 4 points are finished, 2 to run", more.stdout)
        # The command line that is kept runs the point again.
        script = os.path.join(self.path("study"), self.rows()[0]["point"], "command.sh")
        done = subprocess.run([script, "-bs_overwrite"], capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_warnings_of_points_are_told(self):
        """An option that no point uses is no axis; one that some use is, and what the others say of it is told once."""
        args = ["--options_file", FALL, "--options", "-ts_max_time 1"]
        done = self.sweep(*args, "--vary", "-ts_dtt=0.1,0.2", code=2)
        self.assertIn("sweep.py: -ts_dtt: varied, but not used by any point", done.stderr)
        self.assertEqual(done.stdout.count("warning: option -ts_dtt is not used by this run"), 1, done.stdout)
        self.assertEqual([r["warnings"] for r in self.rows()], ["1", "1"])
        done = self.sweep(*args, "--vary", "-ts_type=rk,bdf", "--vary", "-ts_bdf_order=1,2", out="some")
        self.assertEqual([r["warnings"] for r in self.rows("some")], ["1", "1", "0", "0"])
        self.assertEqual(done.stdout.count("warning (2 of 4 points): option -ts_bdf_order is not used by this run"), 1, done.stdout)
        self.assertIn("-ts_dtt: varied", self.sweep(*args, "--vary", "-ts_dtt=0.1,0.2", code=2).stderr)  # also of points that are not run again

    def test_a_step_that_is_none_fails_alone(self):
        for steps in ("-1,0.5,0.25", "0.5,0,0.25"):
            bad = next(s for s in steps.split(",") if float(s) <= 0)
            done = self.sweep("--options_file", FALL, "--options", "-ts_max_time 1 -ts_type cn", "--vary", f"-ts_dt={steps}", code=3, out=f"study{steps}")
            rows = {r["ts_dt"]: r for r in self.rows(f"study{steps}")}
            self.assertEqual({s: r["status"] for s, r in rows.items()}, {"0.5": "ok", "0.25": "ok", bad: "failed"}, done.stderr)
            self.assertIn("-ts_dt", rows[bad]["reason"])
            self.assertNotIn("-bs_output_interval", done.stderr)
            self.assertIn("1 of 3 points failed", done.stderr)

    def test_values_given_twice(self):
        """The same point twice is refused before anything is run, on the command line, in a file, by ranks, and by axes that say the same; the same value beside others is not."""
        vary = "options_file: " + FALL + "\nvary:\n"
        for args, says in ((["--options_file", FALL, "--vary", "-ts_dt=0.1,0.2,0.1"], "ts_dt=0.1"), ([self.write("a.yaml", vary + "  ts_dt: [0.1, 0.1]\n")], "ts_dt=0.1"),
                           (["--options_file", FALL, "--np", "1,1"], "np=1"), (["--options_file", FALL, "--vary", "-ts_type=cn,cn -ts_dt=1,1"], "ts_type=cn ts_dt=1"),
                           ([self.write("b.yaml", vary + "  ts_dt: [0.1, 0.2]\n  method: [{ts_type: cn, ts_dt: 0.3}]\n")], "ts_dt=0.3 ts_type=cn")):
            done = self.sweep(*args, code=2)
            self.assertEqual(done.stderr, f"sweep.py: the point {says} is there twice; write every value of what varies once\n")
            self.assertFalse(os.path.exists(self.path("study")))
        self.assertEqual(len(self.commands("--vary", "-ts_type=cn,cn -ts_dt=0.1,0.2", "--options_file", FALL)), 2)

    def test_an_interrupted_sweep_goes_on(self):
        args = ["--options_file", FALL, "--options", "-ts_max_time 1e8 -bs_output_interval 1", "--vary", "-ts_dt=0.25,0.2", "--interval", 1]
        command = [sys.executable, os.path.join(base.TOOLS, "sweep.py"), "--program", PROGRAM, "-o", self.path("study"), *map(str, args)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=self.folder) as process:
            self.first_frame(os.path.join(self.path("study")))
            process.send_signal(signal.SIGTERM)
            said = process.communicate(timeout=60)
        self.assertEqual((process.returncode, said[1].strip()), (130, "sweep.py: stopped"), said)
        folders = os.listdir(self.path("study"))
        self.assertEqual([n for n in folders if os.path.exists(os.path.join(self.path("study"), n, "point.json"))], [])
        done = self.sweep(*args, "--timeout", 3, code=3)
        self.assertIn("no end after 3 s", done.stderr)
        self.assertIn("2 of 2 points failed", done.stderr)

    def first_frame(self, folder):
        for _ in range(300):
            for name in os.listdir(folder) if os.path.isdir(folder) else []:
                try:
                    with open_run(os.path.join(folder, name, "run.h5md")):
                        return
                except RunError:
                    pass
            time.sleep(0.1)
        self.fail("no frame after 30 s")

    def commands(self, *args):
        return self.sweep("--list", *args).stdout.splitlines()

    def test_points_of_axes(self):
        product = self.commands("--vary", "-ts_type=beuler,cn", "--vary", "-ts_dt=0.1,0.05,0.2")
        self.assertEqual(len(product), 6)
        self.assertIn("-ts_type beuler -ts_dt 0.1 -bs_output_interval 0.2", product[0])  # the least common multiple
        self.assertIn("-ts_adapt_type none", product[0])
        self.assertEqual(len({line.split("-bs_report ")[1] for line in product}), 6)
        together = self.commands("--vary", "-ts_type=beuler,cn", "--vary", "-ts_dt=0.1,0.05", "--zip")
        self.assertEqual([" ".join(line.split()[3:7]) for line in together], ["-ts_type beuler -ts_dt 0.1", "-ts_type cn -ts_dt 0.05"])
        weak = self.commands("--vary", "-bs_lattice_size=4,4,4;4,4,8", "--vary", "-ts_type=beuler,cn", "--zip", "np,bs_lattice_size", "--np", "1,2")
        self.assertEqual(len(weak), 4)
        for line in weak:
            self.assertIn("-n 2 " if "4,4,8" in line else "-n 1 ", line)
        shutil.copy(FALL, self.path("same.yaml"))  # the content counts, not the path
        names = [[line.split("-bs_report ")[1] for line in self.commands("--options_file", f)] for f in (FALL, "same.yaml", "./same.yaml")]
        self.assertEqual(names[0], names[1])
        self.assertEqual(names[0], names[2])
        with open(self.path("same.yaml"), "a", encoding="utf-8") as f:
            f.write("# changed\n")
        self.assertNotEqual(names[0], [line.split("-bs_report ")[1] for line in self.commands("--options_file", "same.yaml")])
        by_name = [line.split("-bs_report ")[1] for line in self.commands("--options_file", "free_fall")]  # found as the program finds it
        self.assertEqual(by_name, [line.split("-bs_report ")[1] for line in self.commands("--options_file", FALL)])
        self.assertEqual(len(self.commands("cloth")), 13)
        linked = self.commands("--vary", "-ts_type=rk,bdf -ts_dt=0.1,0.2")
        self.assertEqual(len(linked), 2)
        self.assertIn("-ts_type bdf -ts_dt 0.2", linked[1])

    def test_yaml_says_the_same_as_the_command_line(self):
        study = self.write("s.yaml", f"options_file: {FALL}\noptions: {{snes_rtol: 1.0e-9, bs_lattice_size: [1]}}\nnp: [1, 2]\n"
                                     "vary:\n  ts_dt: [0.5, 0.25]\n  method:\n    - {ts_type: cn}\n    - {ts_type: bdf, ts_bdf_order: 3}\n")
        by_file = self.commands(study)
        by_words = self.commands("--options_file", FALL, "--options", "-snes_rtol 1e-09 -bs_lattice_size 1", "--vary", "-ts_dt=0.5,0.25",
                                 "--np", "1,2")
        self.assertEqual(len(by_file), 8)
        cut = {line.split(" -bs_output_interval")[0].replace(" -ts_type cn", "") for line in by_file if " cn" in line}
        self.assertEqual(cut, {line.split(" -bs_output_interval")[0] for line in by_words})
        self.assertIn("-ts_dt 0.25 -ts_type bdf -ts_bdf_order 3", by_file[-1])

    def test_scaling(self):
        done = self.sweep("--options", "-bs_lattice_type cubic -bs_lattice_size 6,6,6 -bs_lattice_stiffness 100 -ts_dt 0.01 -ts_max_time 0.05",
                          "--np", "1,2")
        rows = self.rows()
        self.assertEqual([(r["ranks"], r["unknowns"]) for r in rows], [("1", "1296"), ("2", "1296")])
        share = float(rows[0]["wall"]) / float(rows[1]["wall"]) / 2
        line = next(li for li in done.stdout.splitlines() if li.startswith("all") and li.split()[1] == "2")
        self.assertAlmostEqual(float(line.split()[-1]), share, delta=0.01 * share)
        self.picture(os.path.join(self.path("study"), "scaling.png"))

    def test_wrong_studies(self):
        good = ["--options_file", FALL]
        bad = self.write("bad.yaml", "vari: {}\n")
        for args, says in ((good + ["--vary", "ts_dt=1"], "-option=value"), (["--options_file", "none.yaml"], "no such options file"),
                           ([bad], "unknown key 'vari'"), ([self.write("x.yaml", "a: [")], "not a YAML file"),
                           (good + ["--np", "two"], "whole numbers"), (good + ["--vary", "-a=1,2", "--vary", "-a=3"], "varied twice"),
                           (good + ["--vary", "-a=1,2", "--vary", "-b=1,2,3", "--zip"], "equally many"),
                           (good + ["--vary", "-ts_dt=0.1,x"], "takes numbers"), (good + ["--zip", "c"], "no such axis")):
            done = self.sweep(*args, code=2)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
            self.assertIn(says, done.stderr)
        done = base.tool("sweep.py", *good, "-o", self.path("s"), "--program", "/nowhere/backspring")
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (2, 1))
        self.assertEqual(base.tool("sweep.py", "--help").returncode, 0)

    def test_study_files_of_the_wrong_kind(self):
        """Every key with every kind of value that is not its own: one line that names it, never a traceback."""
        import contextlib
        import io
        import sweep
        values = ("5", "[1, 2]", "{a: 1}", "[[1]]", "true", "{a: {b: c}}", "[{a: 1}]", "'\"'", "{1: [2]}", "{a: [[1]]}", "{a: [{1: 2}]}", "2001-99-99", ".nan", "-1")
        refused = 0
        for key in ("options_file", "options", "vary", "zip", "np", "jobs", "reference", "program", "timeout", "output"):
            for value in values:
                keys = {"vary": "{ts_dt: [1, 2]}", "output": self.path("s"), "program": "/bin/true", key: value}
                path = self.write("s.yaml", "".join(f"{k}: {v}\n" for k, v in keys.items()))
                try:
                    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
                        sweep.main([path, "--list"])
                except RunError as error:
                    refused += 1
                    self.assertNotIn("\n", str(error))
                except OSError as error:
                    self.assertTrue(error.strerror)
        self.assertGreater(refused, 80)
        for text in ("vary: " + "{" * 5000, "[" * 100000):
            done = self.sweep(self.write("deep.yaml", text), code=2)
            self.assertIn("brackets are nested too deeply", done.stderr)
            self.assertEqual(len(done.stderr.splitlines()), 1)


class Reasons(unittest.TestCase):
    def test_the_line_that_tells_why(self):
        from study_run import reason_of
        self.assertEqual(reason_of("t = 1\nbackspring: error: no such thing: try that\n-----\nmpirun noticed ...\n"), "no such thing: try that")
        self.assertEqual(reason_of("-----\nmpirun has detected an attempt to run as root.\n\nmore\n-----\n"),
                         "mpirun has detected an attempt to run as root.")
        self.assertEqual((reason_of("a\nb\n"), reason_of("")), ("b", "it said nothing"))


class Fitting(unittest.TestCase):
    H = np.array([0.4, 0.2, 0.1, 0.05])

    def test_orders(self):
        for p in (1, 2, 3.5):
            self.assertAlmostEqual(fit_order(self.H, 7 * self.H ** p), p, places=9)
            self.assertAlmostEqual(fit_order(self.H[:3], 7 * (self.H[:3] ** p - 0.05 ** p), 0.05), p, places=4)
        self.assertTrue(np.isnan(fit_order([0.1], [1e-3])) and np.isnan(fit_order([0.2, 0.1], [0.0, 0.0])))

    def test_efficiency(self):
        rows = [{"status": "ok", "ranks": p, "wall": w, "unknowns": n, "np": p, "size": n}
                for p, w, n in ((1, 10.0, 100), (2, 10.0, 200), (4, 20.0, 400))]
        self.assertEqual(efficiency(rows, rows[0]), [1, 1, 0.5])   # weak
        self.assertEqual(list(scaling_series(rows, ["size", "np"])), ["all"])
        strong = [{**r, "unknowns": 100} for r in rows]
        self.assertEqual(efficiency(strong, strong[0]), [1, 0.5, 0.125])


class Alive(base.Case):
    def test_a_run_going_on_and_then_killed(self):
        path = self.path("run.h5md")
        command = [PROGRAM, *CLOTH, "-ts_dt", "0.002", "-ts_max_time", "1000", "-bs_output", path, "-bs_output_interval", "0.01"]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                seen = []
                for _ in range(300):
                    time.sleep(0.1)
                    try:
                        with open_run(path) as run:
                            self.assertTrue(np.isfinite(run.positions[-1]).all() and np.isfinite(run.velocities[-1]).all())
                            self.assertEqual(len(run.observables), run.frames)
                            np.testing.assert_allclose(run.times, 0.01 * np.arange(run.frames), atol=1e-12)
                            seen.append(run.frames)
                            time.sleep(0.3)
                            self.assertGreaterEqual(run.refresh(), seen[-1])
                            seen.append(run.frames)
                    except RunError as error:
                        self.assertFalse(seen, error)  # only before the first frame
                    if len(seen) >= 6 and len(set(seen)) >= 3:
                        break
                self.assertGreaterEqual(len(set(seen)), 3, seen)
                done = base.tool("plot.py", path, "-o", self.path("alive.png"), "--dpi", 60)
                self.assertEqual(done.returncode, 0, done.stderr)
            finally:
                process.kill()
        with open_run(path) as run:
            self.assertGreaterEqual(run.frames, seen[-1])
            self.assertEqual(run.positions.shape, (run.frames, 36, 3))
            self.assertAlmostEqual(run.observables["kinetic_energy"].iloc[-1],
                                   float(0.5 * (run.mass * (run.velocities[-1] ** 2).sum(axis=1)).sum()), delta=1e-12)
            self.assertTrue({"dt", "newton", "krylov", "rejected"} <= set(run.log))


if __name__ == "__main__":
    if "--program" not in sys.argv[:-1]:
        sys.exit("usage: test_studies.py --program build/release/backspring [test ...]")
    where = sys.argv.index("--program")
    PROGRAM = os.path.abspath(sys.argv[where + 1])
    del sys.argv[where:where + 2]
    os.environ.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")
    unittest.main(verbosity=1)
