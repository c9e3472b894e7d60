"""What every verification script shares: run the program, read what it wrote, count checks.

A script takes `--program PATH [--ranks N] [--filter X] [--oracles DIR]`, prints a line per check with its figure and
tolerance, ends with `N passed, N failed, N skipped`, and exits 0 (passed), 1 (failed) or 77 (the reference results
are absent; the built-in numbers passed).
"""
import sys

try:
    import h5py
    import numpy as np
    import scipy  # noqa: F401  (the scripts need it)
except ImportError as missing:
    sys.exit(f"{missing}\nneeded: apt install python3-h5py python3-numpy python3-scipy, and run with /usr/bin/python3")

import argparse
import concurrent.futures
import contextlib
import copy
import csv
import json
import os
import pathlib
import shutil
import subprocess
import tempfile

REPO = pathlib.Path(__file__).resolve().parents[2]
SKIPPED = 77

# TS options of each formula. Where a type would adapt the step, that is off.
METHODS = {
    "fe": {"ts_type": "euler"},
    "symplectic": {"ts_type": "symplectic"},
    "midpoint": {"ts_type": "rk", "ts_rk_type": "2b"},
    "rk4": {"ts_type": "rk", "ts_rk_type": "4"},
    "be": {"ts_type": "beuler"},
    "linbe": {"ts_type": "beuler", "snes_type": "ksponly"},
    "imp": {"ts_type": "theta", "ts_theta_theta": 0.5, "ts_theta_endpoint": 0},
    "tr": {"ts_type": "cn"},
}
EXPLICIT = ("fe", "symplectic", "midpoint", "rk4")
NEWTON_RTOL = 1e-12


def method_options(method, h, steps, ranks=1):
    """Options of `steps` steps of length h: a direct solve and Newton to rounding level, so that what is left is the
    time-stepping formula."""
    options = dict(METHODS[method], ts_adapt_type="none", ts_dt=h, ts_max_time=steps * h)
    if method not in EXPLICIT:
        options.update(direct(ranks))
    return options


def direct(ranks=1):
    """Newton to rounding level on a direct solve."""
    options = {"snes_rtol": NEWTON_RTOL, "ksp_type": "preonly", "pc_type": "lu"}
    if ranks > 1:
        options["pc_factor_mat_solver_type"] = "mumps"
    return options


class RunError(Exception):
    """The program ended otherwise than expected, or wrote no readable result."""


class Trajectory:
    """All frames in memory: position and velocity (T, N, d), time and step (T), id (N), observables by name, log."""

    def __init__(self, path):
        with h5py.File(path, "r") as f:
            group = f["particles/trajectory"]
            self.position = group["position/value"][...]
            self.velocity = group["velocity/value"][...]
            self.time = group["position/time"][...].ravel()
            self.step = group["position/step"][...].ravel()
            self.id = group["id"][...].ravel()
            self.mass = group["mass"][...].ravel()
            self.observables = {name: o["value"][...] for name, o in f.get("observables", {}).items()}
            self.log = {}
            if "backspring/log" in f:
                log = f["backspring/log"]
                names = log.dtype.names if isinstance(log, h5py.Dataset) else list(log)
                self.log = {name: log[name][...] for name in names}

    def frame_at(self, t, slack=1e-9):
        """Index of the frame at time t [s]; the times must agree to `slack` of the run's length."""
        k = int(np.argmin(np.abs(self.time - t)))
        if abs(self.time[k] - t) > slack * max(abs(self.time[-1]), abs(t), 1e-300):
            raise RunError(f"no frame at t = {t:.17g}; the nearest is {self.time[k]:.17g}")
        return k


class Result:
    """One finished run: exit code, both streams, the report (None if none was written) and the trajectory (or None)."""

    def __init__(self, code, stdout, stderr, report, trajectory, files):
        self.code, self.stdout, self.stderr, self.report, self.trajectory = code, stdout, stderr, report, trajectory
        self.files = files  # {name: bytes} of the files asked for by keep=


def words(options):
    """{"ts_dt": 0.1, "snes_mf": True, "bs_gravity": (0, -9.8)} -> command-line words; None leaves an option out."""
    if not isinstance(options, dict):
        return [str(w) for w in options]
    out = []
    for name, value in options.items():
        if value is None:
            continue
        out.append("-" + name)
        if value is not True:
            out.append(text(value))
    return out


def text(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple, np.ndarray)):
        return ",".join(text(v) for v in value)
    return f"{value:.17g}" if isinstance(value, (float, np.floating)) else str(value)


def environment(ranks):
    env = {k: v for k, v in os.environ.items() if k != "PETSC_OPTIONS"}
    env.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    if ranks > 1 and os.geteuid() == 0:
        env.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    if ranks > len(os.sched_getaffinity(0)):
        env.update(OMPI_MCA_rmaps_base_oversubscribe="1")
    return env


def run(program, options, ranks=1, expect=0, timeout=600, interval=None, keep=()):
    """Runs the program in a folder of its own and returns a Result.

    interval [s]: write a trajectory with that output interval. expect: the exit code, or None for any; another one
    raises RunError with the end of what the program said. keep: names of files it writes, returned as bytes.
    """
    with tempfile.TemporaryDirectory(prefix="backspring_") as folder:
        folder = pathlib.Path(folder)
        command = [str(program)] + words(options) + ["-bs_report", "report.json"]
        if interval is not None:
            command += ["-bs_output", "run.h5md", "-bs_output_interval", text(float(interval))]
        if ranks > 1:
            command = ["mpirun", "-n", str(ranks)] + command
        try:
            done = subprocess.run(command, cwd=folder, env=environment(ranks), timeout=timeout,
                                  capture_output=True, text=True, errors="replace")
        except subprocess.TimeoutExpired:
            raise RunError(f"no end after {timeout} s: {' '.join(command)}") from None
        if expect is not None and done.returncode != expect:
            said = " / ".join((done.stdout + done.stderr).strip().splitlines()[-4:])
            raise RunError(f"exit code {done.returncode}, expected {expect}: {said} [{' '.join(command)}]")
        try:
            report = json.loads((folder / "report.json").read_text()) if (folder / "report.json").exists() else None
            trajectory = Trajectory(folder / "run.h5md") if (folder / "run.h5md").exists() else None
            files = {name: (folder / name).read_bytes() for name in keep}
        except (OSError, KeyError, ValueError) as why:
            raise RunError(f"unreadable result: {why!r} [{' '.join(command)}]") from None
        if expect == 0 and interval is not None and trajectory is None:
            raise RunError(f"no trajectory was written [{' '.join(command)}]")
        return Result(done.returncode, done.stdout, done.stderr, report, trajectory, files)


def write_lattice(path, position, mass, velocity=None, fixed=None, radius=None, pairs=None, stiffness=None,
                  rest_length=None, damping=None, anchors=None, spring_law=None, damping_law=None):
    """Writes the HDF5 lattice. position (N, d), mass (N), pairs (M, 2) 0-based, anchors: dict of particle (A),
    point (A, d), stiffness, rest_length, damping (A); what is None is left out."""
    position = np.asarray(position, float)
    with h5py.File(path, "w") as f:
        def put(name, value, kind=float):
            if value is not None:
                f[name] = np.asarray(value, kind)
        put("particles/position", position)
        put("particles/velocity", velocity)
        put("particles/mass", np.broadcast_to(np.asarray(mass, float), len(position)))
        put("particles/fixed", fixed, np.uint8)
        put("particles/radius", radius)
        if pairs is not None and len(pairs):
            put("springs/pairs", pairs, np.int64)
            for name, value in (("stiffness", stiffness), ("rest_length", rest_length), ("damping", damping)):
                put("springs/" + name, None if value is None else np.broadcast_to(np.asarray(value, float), len(pairs)))
        if anchors is not None and len(anchors["particle"]):
            put("anchors/particle", anchors["particle"], np.int64)
            for name in ("point", "stiffness", "rest_length", "damping"):
                put("anchors/" + name, anchors.get(name))
        if spring_law:
            f.attrs["spring_law"] = spring_law
        if damping_law:
            f.attrs["damping_law"] = damping_law
    return path


def read_table(path):
    """A CSV file with one header line: dict of columns, floats where every entry is one, else lists of words."""
    with open(path, newline="") as f:
        rows = list(csv.reader(f))
    table = {}
    for k, name in enumerate(rows[0]):
        column = [row[k] for row in rows[1:]]
        try:
            table[name] = np.array([float(word) for word in column])
        except ValueError:
            table[name] = column
    return table


def observed_orders(steps, errors):
    """log(e1/e2) / log(h1/h2) of neighbouring steps."""
    steps, errors = np.asarray(steps, float), np.asarray(errors, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log(errors[:-1] / errors[1:]) / np.log(steps[:-1] / steps[1:])


class Checks:
    """Collects the verdicts. The command line is read here, once per script."""

    def __init__(self, title):
        parser = argparse.ArgumentParser(description=title)
        parser.add_argument("--program", required=True, help="the built program")
        parser.add_argument("--ranks", type=int, default=1, help="MPI ranks of every run")
        parser.add_argument("--filter", default="", help="only groups whose name contains this")
        parser.add_argument("--oracles", type=pathlib.Path, default=REPO.parent / "shared" / "oracles",
                            help="folder of reference results (default: ../shared/oracles beside the checkout)")
        parser.add_argument("--full", action="store_true", help="every tabulated run instead of a selection")
        self.arguments = parser.parse_args()
        found = shutil.which(self.arguments.program)
        if not found:
            sys.exit(f"--program {self.arguments.program}: no such program")
        self.program, self.ranks = os.path.abspath(found), self.arguments.ranks
        self.full, self.oracles = self.arguments.full, self.arguments.oracles
        self.passed = self.failed = self.skipped = 0
        self.buffer = None
        print(title)

    def run(self, options, **keywords):
        keywords.setdefault("ranks", self.ranks)
        return run(self.program, options, **keywords)

    def wants(self, name):
        return self.arguments.filter in name

    def have(self, folder):
        """Whether this folder of reference results is there."""
        return (self.oracles / folder).is_dir()

    def _line(self, verdict, name, note):
        line = f"  {verdict:6} {name}: {note}"
        if self.buffer is None:
            print(line, flush=True)
        else:
            self.buffer.append(line)

    def each(self, items, check):
        """check(checks, item) for every item, several at once (most of a short run is start-up, which waits); the
        lines come out in the items' order."""
        def one(item):
            mine = copy.copy(self)
            mine.passed = mine.failed = mine.skipped = 0
            mine.buffer = []
            check(mine, item)
            return mine
        workers = max(1, 2 * len(os.sched_getaffinity(0)) // self.ranks)
        with concurrent.futures.ThreadPoolExecutor(workers) as pool:
            for mine in pool.map(one, items):
                for line in mine.buffer:
                    print(line, flush=True)
                self.passed, self.failed = self.passed + mine.passed, self.failed + mine.failed
                self.skipped += mine.skipped

    def true(self, name, holds, note=""):
        self.passed, self.failed = self.passed + bool(holds), self.failed + (not holds)
        self._line("ok" if holds else "FAILED", name, note)

    def below(self, name, figure, tolerance, note=""):
        """figure <= tolerance; NaN fails."""
        self.true(name, bool(figure <= tolerance), f"{figure:.3g} <= {tolerance:.3g}{' ' if note else ''}{note}")

    def near(self, name, value, expected, tolerance):
        """|value - expected| <= tolerance."""
        off = float(np.max(np.abs(np.asarray(value, float) - expected)))
        shown = f"{value:.15g} for {expected:.15g}, off by " if np.ndim(value) == 0 else ""
        self.true(name, bool(off <= tolerance), f"{shown}{off:.3g} <= {tolerance:.3g}")

    def skip(self, name, why):
        self.skipped += 1
        self._line("skip", name, why)

    @contextlib.contextmanager
    def group(self, name):
        """A failed run inside the block counts as one failed check and ends the block."""
        try:
            yield
        except RunError as why:
            self.true(name, False, str(why))

    def finish(self, complete=True):
        """Prints the totals and ends the script; complete=False: the reference results were absent."""
        if self.passed + self.failed == 0 and complete:
            self.true("selection", False, f"--filter {self.arguments.filter!r} selects nothing")
        print(f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped")
        sys.exit(1 if self.failed else 0 if complete else SKIPPED)
