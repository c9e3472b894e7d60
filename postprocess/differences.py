"""Differences of two runs of the same particles, or of the same linear system, frame by frame."""
from dataclasses import dataclass

import numpy as np

from backspring_io import RunError

SLACK = 1e-9  # two times are one if they differ by less than this share of the shorter run


@dataclass
class Differences:
    """One row a common time (T,); all figures are those of the quantity, in its unit."""
    quantity: str
    times: np.ndarray
    largest: np.ndarray      # max over particles of |a - b|, the length of the vector
    rms: np.ndarray          # root of the mean over particles of |a - b|^2
    scale: np.ndarray        # max over particles of |b|
    worst: np.ndarray        # the particle (its id) or state (its label) with the largest difference

    def first_above(self, atol, rtol):
        """Row of the first time at which largest > atol + rtol scale (or is no number); None if there is none."""
        above = np.flatnonzero(~(self.largest <= atol + rtol * self.scale))
        return int(above[0]) if len(above) else None


def quantities(run):
    """What two such runs can be compared in."""
    return ["state"] if run.kind == "linear" else ["position"] + (["velocity"] if run.velocities is not None else [])


def pair_particles(a, b):
    """Rows of a and rows of b that hold the same particles, or states; raises RunError where they are not the same."""
    if a.kind != b.kind or a.dim != b.dim:
        raise RunError(f"{a.path} and {b.path} hold systems of different kind or dimension")
    names = (a.states.labels, b.states.labels) if a.kind == "linear" else (a.id, b.id)
    what = "states" if a.kind == "linear" else "particles"
    if len(names[0]) != len(names[1]):
        raise RunError(f"{a.path} has {len(names[0])} {what}, {b.path} {len(names[1])}: they must be the same")
    order = [np.argsort(np.asarray(n), kind="stable") for n in names]
    sorted_names = [np.asarray(n)[o] for n, o in zip(names, order)]
    if not np.array_equal(*sorted_names):
        k = int(np.argmax(sorted_names[0] != sorted_names[1]))
        raise RunError(f"{a.path} has {what[:-1]} {sorted_names[0][k]}, {b.path} {sorted_names[1][k]} in its place: "
                       "they must be the same")
    return order


def common_frames(a, b):
    """Pairs (frame of a, frame of b) of equal time, in the order of time."""
    span = min(np.ptp(a.times), np.ptp(b.times))
    slack = SLACK * span if span > 0 else SLACK
    near = np.clip(np.searchsorted(b.times, a.times), 1, max(1, b.frames - 1))
    pairs = []
    for i, k in enumerate(near):
        j = min((k - 1, min(k, b.frames - 1)), key=lambda r: abs(b.times[r] - a.times[i]))
        if abs(b.times[j] - a.times[i]) <= slack and (not pairs or pairs[-1][1] != j):
            pairs.append((i, j))
    return pairs


def value(run, quantity, frame):
    """(n, d) of one frame."""
    if quantity == "state":
        return np.asarray(run.states.value[frame], dtype=float).reshape(-1, 1)
    return run.position(frame) if quantity == "position" else run.velocity(frame)


def between(run, quantity, time):
    """(n, d) at a time between two frames, by the cubic through both with the velocities as slopes (position of
    particles), else by the straight line."""
    k = int(np.clip(np.searchsorted(run.times, time), 1, run.frames - 1))
    t0, t1 = run.times[k - 1], run.times[k]
    s, h = (time - t0) / (t1 - t0), t1 - t0
    a, b = value(run, quantity, k - 1), value(run, quantity, k)
    if quantity != "position" or run.velocities is None:
        return (1 - s) * a + s * b
    # Hermite: (1 + 2s)(1 - s)^2 a + s^2 (3 - 2s) b + h s (1 - s)^2 a' - h s^2 (1 - s) b'
    return ((1 + 2 * s) * (1 - s) ** 2 * a + s * s * (3 - 2 * s) * b
            + h * s * (1 - s) ** 2 * run.velocity(k - 1) - h * s * s * (1 - s) * run.velocity(k))


def compare(a, b, quantity, rows=None, frames=None):
    """Differences of `quantity` between a and b. rows: from pair_particles; frames: pairs, or times for b between its
    frames (a's frames, None) as (frame of a, None)."""
    rows = rows or pair_particles(a, b)
    frames = frames if frames is not None else common_frames(a, b)
    if not frames:
        raise RunError(f"{a.path} and {b.path} have no time in common")
    names = np.asarray(a.states.labels if quantity == "state" else a.id)[rows[0]]
    table = []
    for i, j in frames:
        theirs = value(b, quantity, j) if j is not None else between(b, quantity, a.times[i])
        theirs = theirs[rows[1]]
        off = np.sqrt(((value(a, quantity, i)[rows[0]] - theirs) ** 2).sum(axis=1))
        bad = np.flatnonzero(~np.isfinite(off))
        worst = int(bad[0]) if len(bad) else int(off.argmax())
        table.append((a.times[i], off[worst], np.sqrt((off ** 2).mean()),
                      np.sqrt((theirs ** 2).sum(axis=1).max()), names[worst]))
    columns = list(zip(*table))
    return Differences(quantity, *[np.array(c, dtype=float) for c in columns[:4]], np.array(columns[4]))
