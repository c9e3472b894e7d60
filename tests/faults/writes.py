#!/usr/bin/env python3
"""Runs killed between two writes to the trajectory: among the first frames, at new chunks, at the end, and in between; with a
flush every frame, and with frames that wait and are written together.

A random moment seldom falls into the microseconds in which HDF5 brings a file from one state to the next; here the moments
are counted writes. Each time: the file opens, its completed frames and its log are the undisturbed run's, a continued run
(itself killed once more, while it shortens the file or later) ends, and every bit is the undisturbed run's.
--shim: the library that counts and kills; --every: one of so many writes is tried.
"""
import argparse
import pathlib
import random
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from runs import BLOCK, Checks, content, difference, run

OPTIONS = dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_dt=0.005, ts_max_time=1.5, bs_output_interval=0.005, bs_output_xdmf=False,
               bs_output="part.h5md", bs_checkpoint="ck", bs_checkpoint_every=40)
# A flush every frame: the 129th, 257th, ... frame brings new chunks everywhere. Else frames wait for a checkpoint, which makes every run write alike.
VARIANTS = {"flush every frame": dict(OPTIONS, bs_output_flush=0), "frames together": dict(OPTIONS, bs_output_flush=1000)}
FRAMES, CHUNK = 301, 128
KILLED = -9


def whole_frames(full, path):
    """What differs from the undisturbed run in the frames that are complete, and in the log; empty: nothing."""
    import h5py
    import numpy as np
    with h5py.File(path, "r") as part:
        held = len(part["particles/trajectory/position/time"])
        wrong = []

        def look(name, item):
            if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "if" or name.startswith("parameters"):
                return
            log = name.startswith("backspring/log")
            rows = min(len(item), max(0, held - 1)) if log else held if name.endswith(("value", "time", "step")) else len(item)
            item[...]  # no part of the file is out of reach
            if len(item) < rows or not np.array_equal(item[:rows], full[name][:rows], equal_nan=True):
                wrong.append(name)
        part.visititems(look)
    return wrong


def killed_at(checks, folder, shim, at, options):
    return run(checks, folder, options, extra={"LD_PRELOAD": shim, "BS_KILL_FILE": "/part.h5md", "BS_KILL_AT": str(at)})[0]


def one_kill(checks, folder, shim, at, again, full, options):
    """Kill at write `at`, look, go on with a kill at write `again`, go on to the end. What was wrong, or None."""
    for old in (*folder.glob("part*"), *folder.glob("ck*")):
        old.unlink()
    path = folder / "part.h5md"
    code = killed_at(checks, folder, shim, at, options)
    if code != KILLED:
        return f"exit {code} where the run was to be killed"
    for attempt in range(2):
        if path.exists():
            try:
                wrong = whole_frames(full, path)
            except (OSError, KeyError, ValueError, RuntimeError) as why:
                return f"kill {attempt + 1}: {why!r}"
            if wrong:
                return f"kill {attempt + 1}: {wrong} differ"
        following = {"bs_restart": "ck"} if (folder / "ck").exists() else dict(options, bs_overwrite=True)
        if attempt == 0:
            killed_at(checks, folder, shim, again, following)
    code, _, err = run(checks, folder, following)
    if code != 0:
        return f"continued: exit {code} {err.strip()[:200]}"
    return None if difference(folder / "full.h5md", path)[1] else "continued: other bits"


def variant(checks, folder, name, options, mine):
    import h5py
    extra = {"LD_PRELOAD": mine.shim, "BS_KILL_FILE": "/part.h5md", "BS_KILL_COUNT": str(folder / "count")}
    code, _, err = run(checks, folder, options, extra=extra)
    checks.true(f"{name}: undisturbed run", code == 0, err.strip()[:100])
    total = int((folder / "count").read_text())
    (folder / "part.h5md").rename(folder / "full.h5md")
    full = content(folder / "full.h5md")
    with h5py.File(folder / "full.h5md", "r") as f:
        f.visititems(lambda n, item: full.setdefault(n, item[...]) if isinstance(item, h5py.Dataset) else None)
    chance = random.Random(31)
    chosen = {chance.randrange(total) for _ in range(300 // mine.every)} | set(range(total - 40, total, mine.every))
    if options.get("bs_output_flush") == 0:  # the first frames, new chunks everywhere
        per_frame = total / FRAMES
        marked = [*range(0, int(8 * per_frame)), *range(int((2 * CHUNK - 1.5) * per_frame), int((2 * CHUNK + 2.5) * per_frame))]
        chosen |= set(marked[::mine.every])
    else:
        chosen |= set(range(0, total, max(1, mine.every // 2)))
    faults = {}
    for at in sorted(chosen):
        fault = one_kill(checks, folder, mine.shim, at, chance.choice((chance.randrange(60), chance.randrange(total))), full, options)
        if fault:
            faults[at] = fault
    checks.true(f"{name}: {len(chosen)} of {total} writes: file, frames, log and continued run", not faults, str(dict(list(faults.items())[:4]))[:600])
    checks.true(f"{name}: the kills are spread over the run", len(chosen) > 10 and total > 300, f"{len(chosen)} of {total}")


def main():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--shim", required=True)
    parser.add_argument("--every", type=int, default=1)
    mine, rest = parser.parse_known_args()
    sys.argv[1:] = rest
    checks = Checks(__doc__)
    for name, options in VARIANTS.items():
        with tempfile.TemporaryDirectory() as folder, checks.group(name):
            variant(checks, pathlib.Path(folder), name, options, mine)
    checks.finish()


if __name__ == "__main__":
    main()
