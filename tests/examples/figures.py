"""Figures in documents, held against what the document's own commands have left in its folder.

Behind a figure stands a comment that says what it is and how far it may be off:

    It loses 4.92 J<!-- figure: energy("run")[0] - energy("run")[-1] --> in 4 s.

The figure is the last number before the comment, in the same paragraph. Without a tolerance it must be what is measured, rounded to
its digits; `within 5 %`, `within 1e-12` (of its own unit) and `within a factor of 30` allow more, the last for figures that are rounding.
Behind an indented block stands `<!-- printed -->` where every line of it must be one that the commands printed.
The expression is Python, with numpy as np and the names below; "run" is run.h5md of that folder.
"""
import json
import math
import pathlib
import re

import h5py
import numpy as np
from scipy.optimize import brentq

COMMENT = re.compile(r"<!-- figure: (.*?)(?: within ([^>]*?))? -->", re.S)
PRINTED = re.compile(r"((?:^    .*\n)+)\n?<!-- printed -->", re.M)
NUMBER = re.compile(r"[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?")


def comments(text):
    """[(line number, the figure as it is written, expression, tolerance or None)] of a document; the figure is None where none stands
    before the comment."""
    found = []
    for match in COMMENT.finditer(text):
        before = COMMENT.sub("", text[:match.start()].rpartition("\n\n")[2])
        numbers = NUMBER.findall(before)
        found.append((text[:match.start()].count("\n") + 1, numbers[-1].rstrip(",") if numbers else None, match[1].strip(), match[2]))
    return found


def half_a_digit(shown):
    """Half a unit of the last digit of a number as it is written."""
    mantissa, _, exponent = shown.replace(",", "").partition("e")
    return 0.5 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def agrees(shown, measured, tolerance):
    """Whether the number as written is the measured one within the tolerance."""
    said = float(shown.replace(",", ""))
    if not math.isfinite(measured):
        return False
    if tolerance is None:
        return abs(said - measured) <= half_a_digit(shown) * (1 + 1e-9)
    words = tolerance.split()
    if words[:3] == ["a", "factor", "of"]:
        return said * measured > 0 and 1 / float(words[3]) <= measured / said <= float(words[3])
    share = float(words[0]) * (0.01 * abs(said) if words[1:] == ["%"] else 1.0)
    return abs(said - measured) <= share


class Folder:
    """What expressions may name, of the runs in a folder."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.names = {"np": np, "abs": abs, "min": min, "max": max, "sum": sum, "len": len}
        self.names.update({name: getattr(self, name) for name in dir(Folder) if not name.startswith("_") and name != "value"})

    def value(self, expression):
        return float(eval(" ".join(expression.split()), dict(self.names)))  # the documents are the project's own

    def _read(self, run, path):
        with h5py.File(self.folder / (run if "." in run else run + ".h5md")) as f:
            return f[path][...]

    def table(self, run, path):
        return self._read(run, path)

    def position(self, run):
        """(frames, particles, d)"""
        return self._read(run, "particles/trajectory/position/value")

    def velocity(self, run):
        return self._read(run, "particles/trajectory/velocity/value")

    def time(self, run):
        with h5py.File(self.folder / f"{run}.h5md") as f:
            return f["particles/trajectory/position/time" if "particles" in f else "states/time"][...]

    def at(self, run, values, t):
        """The frame of `values` at the time t, which must be one of a frame."""
        k = int(np.argmin(np.abs(self.time(run) - t)))
        if abs(self.time(run)[k] - t) > 1e-9 * max(1.0, abs(t)):
            raise ValueError(f"{run} has no frame at t = {t}")
        return values[k]

    def energy(self, run, kind="total"):
        return self._read(run, f"observables/{kind}_energy/value")

    def state(self, run, label):
        """A state of a linear system over time."""
        labels = [w.decode() if isinstance(w, bytes) else w for w in self._read(run, "states/labels")]
        return self._read(run, "states/value")[:, labels.index(label)]

    def steps(self, run, column):
        """A column of the log of steps, summed."""
        return self._read(run, f"backspring/log/{column}").sum()

    def difference(self, one, other):
        """Largest distance between the same particles of two runs."""
        return np.linalg.norm(self.position(one) - self.position(other), axis=2).max()

    def advice(self, run, name):
        return self._read(run, f"backspring/advice/{name}")[0]

    def bad_inputs(self):
        """How many tabulated inputs tests/README.md has, which its own test holds against the corpora."""
        text = (pathlib.Path(__file__).resolve().parents[1] / "README.md").read_text()
        return int(re.search(r"\| \*\*all\*\* \| \*\*(\d+)\*\*", text)[1])

    def second(self, label, ranks=1):
        """Of a step [s], as the benchmarks of steps have measured it (tests/bench/results.json); of a peer: for 0.01 s simulated."""
        found = json.loads((pathlib.Path(__file__).resolve().parents[1] / "bench" / "results.json").read_text())
        own = [row["s_per_step"] for row in found["steps"] if row["label"] == label and row["ranks"] == ranks]
        return own[0] if own else next(row["s_per_10ms"] for row in found["peers"] if f"{row['peer']}, {row['case']}" == label and row["ranks"] == ranks)

    def falling_sphere(self, steps, h, implicit=1):
        """Speed of the ball of ice of free_fall.yaml by backward (or forward) Euler, each step solved by bisection."""
        def drag(v):
            reynolds = 2 * 0.01 * 0.9 * v / 1.693e-5
            return 0.5 * 0.9 * np.pi * 1e-4 * (24 / reynolds + 6 / (1 + np.sqrt(reynolds)) + 0.4) * v * v
        m, v = 0.003841120617789121, 0.001
        for _ in range(steps):
            old = v
            v = brentq(lambda u: u - old - h * (9.8 - drag(u) / m), old, old + h * 9.8, xtol=1e-15, rtol=1e-15) if implicit \
                else old + h * (9.8 - drag(old) / m)
        return v


def check(checks, name, text, folder, printed):
    """Every commented figure of a document, and the blocks that its commands are said to have printed."""
    here = Folder(folder)
    for line, shown, expression, tolerance in comments(text):
        label = f"{name} line {line}: {shown}"
        try:
            measured = here.value(expression)
        except Exception as why:  # a check that cannot be made is a failed one, whatever the reason
            checks.true(label, False, f"{expression}: {why!r}")
            continue
        checks.true(label, shown is not None and agrees(shown, measured, tolerance),
                    f"measured {measured:.6g}" + (f", within {tolerance}" if tolerance else ", to its digits"))
    lines = {" ".join(line.split()) for line in printed.splitlines()}
    for block in PRINTED.finditer(text):
        for row in block[1].splitlines():
            checks.true(f"{name}: printed: {row.strip()[:60]}", " ".join(row.split()) in lines, "")
