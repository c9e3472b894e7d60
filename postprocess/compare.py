#!/usr/bin/env python3
"""Compares two runs of the same particles (or of the same linear system). The exit code is the verdict: 0 the same within the
tolerance at every common time, 1 different, 2 they cannot be compared.

  postprocess/compare.py run.h5md reference.h5md --rtol 1e-8
  postprocess/compare.py coarse.h5md fine.h5md --quantity position --atol 1e-3 -o differences.png --csv differences.csv
"""
import argparse
import csv
import os
import sys
from contextlib import ExitStack

if __name__ == "__main__":
    import launch
    launch.require("numpy", "h5py")

import numpy as np  # noqa: E402

import differences  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from listed import Listed  # noqa: E402
from run_data import counted  # noqa: E402

ENDINGS = (".png", ".pdf", ".svg")


def parse(argv=None):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("file", help="trajectory written with -bs_output")
    p.add_argument("reference", help="trajectory it is compared with")
    p.add_argument("--quantity", action=Listed, help="position, velocity, or state of a linear system; several with commas (default: all there are)")
    p.add_argument("--rtol", type=float, default=1e-8, help="tolerance relative to the reference's largest value at that time (default 1e-8)")
    p.add_argument("--atol", type=float, default=0.0, help="tolerance on top, in the quantity's unit (default 0)")
    p.add_argument("--from", dest="start", type=float, default=-np.inf, metavar="T", help="only times from T [s]")
    p.add_argument("--to", dest="end", type=float, default=np.inf, metavar="T", help="only times up to T [s]")
    p.add_argument("--interpolate", action="store_true", help="compare at all times of FILE, the reference in between by cubics (states "
                   "and velocities by straight lines); without it, at the times both have")
    p.add_argument("--rows", type=int, default=10, help="lines of the table (default 10)")
    p.add_argument("--csv", metavar="F", help="every common time as CSV")
    p.add_argument("-o", "--output", metavar="F", help="differences over time as a picture: .png .pdf .svg")
    p.add_argument("--quiet", action="store_true", help="print the verdict alone, without the table and without the number of frames that only one file has")
    return p.parse_args(argv)


def frames_of(a, b, args):
    """Pairs (frame of a, frame of b or None) to compare."""
    if args.interpolate:
        slack = differences.SLACK * max(np.ptp(b.times), 1e-300)
        if b.frames < 2:
            raise RunError(f"{b.path}: one frame alone, nothing lies between")
        frames = [(i, None) for i, t in enumerate(a.times) if b.times[0] - slack <= t <= b.times[-1] + slack]
    else:
        frames = differences.common_frames(a, b)
    frames = [f for f in frames if args.start <= a.times[f[0]] <= args.end]
    if not frames:
        raise RunError(f"{a.path} and {b.path} have no time in common in this span (--interpolate compares between frames)")
    return frames


def tell_left_out(a, b, args):
    """Says how many frames of each have no counterpart in the other, as where one run was killed; with --interpolate those beyond the other's span."""
    pairs = np.array(differences.common_frames(a, b)).reshape(-1, 2)
    for k, (run, other) in enumerate(((a, b), (b, a))):
        slack = differences.SLACK * np.ptp(b.times)
        compared = (run.times >= other.times[0] - slack) & (run.times <= other.times[-1] + slack) if args.interpolate else np.isin(np.arange(run.frames), pairs[:, k])
        asked = (run.times >= args.start) & (run.times <= args.end)
        alone = np.count_nonzero(asked & ~compared)
        if alone:
            said = f"{alone} of {counted(np.count_nonzero(asked), 'frame')} of {run.path} {'has' if alone == 1 else 'have'}"
            print(f"compare.py: {said} no counterpart in {other.path}: not compared", file=sys.stderr)


def report(d, unit, args, a):
    """Prints the table of one quantity."""
    rows = np.unique(np.linspace(0, len(d.times) - 1, max(2, args.rows)).round().astype(int))
    unit = f" [{unit}]" if unit else ""
    who = "state" if d.quantity == "state" else "particle"
    print(f"{d.quantity}{unit}, {len(d.times)} common times")
    print(f"  {'time':>12}  {'max':>11}  {'rms':>11}  {'max/scale':>11}  {who}")
    for k in rows:
        share = d.largest[k] / d.scale[k] if d.scale[k] > 0 else np.nan
        print(f"  {d.times[k]:12.6g}  {d.largest[k]:11.4g}  {d.rms[k]:11.4g}  {share:11.3g}  {d.worst[k]}")


def verdict(d, args, a):
    """One line about one quantity; returns whether it is within the tolerance."""
    row = d.first_above(args.atol, args.rtol)
    worst = int(np.argmax(np.where(np.isfinite(d.largest), d.largest, np.inf)))
    most = f"largest difference {d.largest[worst]:.4g} at t = {d.times[worst]:.9g}"
    if row is None:
        print(f"{d.quantity}: same within {args.rtol:g} x scale + {args.atol:g}: {most}")
    else:
        who = "state" if d.quantity == "state" else "particle"
        print(f"{d.quantity}: DIFFERENT: above {args.rtol:g} x scale + {args.atol:g} first at t = {d.times[row]:.9g} "
              f"({who} {d.worst[row]}, {d.largest[row]:.4g}); {most}")
    return row is None


def write_csv(path, found):
    with open(path, "w", newline="", encoding="utf-8") as f:
        writer = csv.writer(f)
        writer.writerow(["time"] + [f"{d.quantity}_{c}" for d in found for c in ("max", "rms", "scale", "worst")])
        for k, t in enumerate(found[0].times):
            writer.writerow([repr(float(t))] + [v for d in found for v in (repr(float(d.largest[k])), repr(float(d.rms[k])),
                                                                           repr(float(d.scale[k])), d.worst[k])])


def draw(path, found, a, args):
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    import figure_style as figures
    from figure_layout import settle
    with plt.rc_context(figures.STYLE):
        figure, axes = plt.subplots(1, len(found), figsize=(0.6 + 3.6 * len(found), 2.9), constrained_layout=True, squeeze=False)
        for ax, d in zip(axes[0], found):
            for values, color, dash, label in ((d.largest, figures.COLORS[0], "-", "largest"),
                                               (d.rms, figures.COLORS[1], (0, (4, 1.5)), "rms")):
                ax.plot(d.times, np.where(values > 0, values, np.nan), color=color, ls=dash, label=label)
            ax.plot(d.times, args.atol + args.rtol * d.scale, color="#777777", lw=0.9, ls=(0, (1, 1.2)), label="tolerance")
            if np.any(d.largest > 0) or args.atol + args.rtol * d.scale.max() > 0:
                ax.set_yscale("log")
            figures.finish(ax, [a], figures.axis_label(f"difference of {d.quantity}", a.unit(d.quantity)))
        settle(figure)
        figure.savefig(path, dpi=200, facecolor="white")
        plt.close(figure)


def main(argv=None):
    args = parse(argv)
    for path, endings in ((args.output, ENDINGS), (args.csv, None)):
        if path and endings and os.path.splitext(path)[1].lower() not in endings:
            raise RunError(f"{path}: unknown ending; use one of {' '.join(endings)}")
        if path and not os.path.isdir(os.path.dirname(path) or "."):
            raise RunError(f"{path}: no such folder")
    if not (args.rtol >= 0 and args.atol >= 0):
        raise RunError("--rtol and --atol must be 0 or more")
    with ExitStack() as stack:
        a, b = (stack.enter_context(open_run(f)) for f in (args.file, args.reference))
        rows = differences.pair_particles(a, b)
        allowed = [q for q in differences.quantities(a) if q in differences.quantities(b)]
        wanted = args.quantity.split(",") if args.quantity else allowed
        for quantity in wanted:
            if quantity not in allowed:
                raise RunError(f"--quantity {quantity}: for these files choose from {', '.join(allowed)}")
        frames = frames_of(a, b, args)
        found = [differences.compare(a, b, q, rows, frames) for q in wanted]
        if not args.quiet:
            for d in found:
                report(d, a.unit(d.quantity), args, a)
            tell_left_out(a, b, args)
        if args.csv:
            write_csv(args.csv, found)
        if args.output:
            draw(args.output, found, a, args)
        same = [verdict(d, args, a) for d in found]
    return 0 if all(same) else 1


if __name__ == "__main__":
    launch.run(main, RunError)
