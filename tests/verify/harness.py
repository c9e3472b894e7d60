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
import os
import pathlib
import shutil
import tempfile

from program import EXPLICIT, METHODS, NEWTON_RTOL, Result, RunError, Trajectory, direct, method_options, run  # noqa: F401

REPO = pathlib.Path(__file__).resolve().parents[2]
SKIPPED = 77


def write_lattice(path, position, mass, velocity=None, fixed=None, radius=None, pairs=None, stiffness=None,
                  rest_length=None, damping=None, anchors=None, spring_law=None, damping_law=None, angles=None, laws=None, columns=None, particle_columns=None,
                  box=None, boundary=None, shift=None):
    """Writes the HDF5 lattice. position (N, d), mass (N), pairs (M, 2) 0-based, anchors: dict of particle (A),
    point (A, d), stiffness, rest_length, damping (A); angles: dict of triples (A, 3), stiffness, rest_angle (A); laws: the name
    of each spring's law (M); columns, particle_columns: dicts of other datasets of the springs and of the particles; box: edges (d, d) of a
    periodic box, boundary: words along them (all periodic), shift: the box of each spring's second end (M, d); what is None is left out."""
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
        for name, value in (particle_columns or {}).items():
            put("particles/" + name, value)
        if pairs is not None and len(pairs):
            put("springs/pairs", pairs, np.int64)
            for name, value in (("stiffness", stiffness), ("rest_length", rest_length), ("damping", damping)):
                put("springs/" + name, None if value is None else np.broadcast_to(np.asarray(value, float), len(pairs)))
            for name, value in (columns or {}).items():
                put("springs/" + name, np.broadcast_to(np.asarray(value, float), len(pairs)))
            if laws is not None:
                names = sorted({str(law) for law in laws})
                put("springs/law", [names.index(law) for law in laws], np.int64)
                f.attrs["spring_laws"] = names
        if box is not None:
            put("box/edges", box)
            f["box"].attrs["dimension"] = position.shape[1]
            f["box"].attrs["boundary"] = list(boundary or ["periodic"] * position.shape[1])
        put("springs/shift", shift, np.int64)
        if anchors is not None and len(anchors["particle"]):
            put("anchors/particle", anchors["particle"], np.int64)
            for name in ("point", "stiffness", "rest_length", "damping"):
                put("anchors/" + name, anchors.get(name))
        if angles is not None and len(angles["triples"]):
            put("angles/triples", angles["triples"], np.int64)
            for name in ("stiffness", "rest_angle"):
                put("angles/" + name, np.broadcast_to(np.asarray(angles[name], float), len(angles["triples"])))
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
            with mine.group(str(item)):
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
        """A failed run or an unusable table inside the block counts as one failed check and ends the block."""
        try:
            yield
        except RunError as why:
            self.true(name, False, str(why))
        except (KeyError, IndexError, ValueError, OSError) as why:
            self.true(name, False, repr(why))

    def finish(self, complete=True):
        """Prints the totals and ends the script; complete=False: the reference results were absent."""
        if self.passed + self.failed == 0 and complete:
            self.true("selection", False, f"--filter {self.arguments.filter!r} selects nothing")
        print(f"{self.passed} passed, {self.failed} failed, {self.skipped} skipped")
        sys.exit(1 if self.failed else 0 if complete else SKIPPED)


def run_parts(title, parts, on_one_rank=(), given=lambda part: ()):
    """A script's main: each part that the command line asks for, in a folder of its own. on_one_rank: those that are left out on more; given: what a
    part takes besides."""
    checks = Checks(title)
    for part in (*parts, *(on_one_rank if checks.ranks == 1 else ())):
        if checks.wants(part.__name__):
            with checks.group(part.__name__), tempfile.TemporaryDirectory() as folder:
                part(checks, pathlib.Path(folder), *given(part))
    checks.finish()
