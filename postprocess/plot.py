#!/usr/bin/env python3
"""Plots of one or several runs.

  postprocess/plot.py run.h5md -o run.png                              a sheet: state, energies, drift, strains, steps, iterations
  postprocess/plot.py run.h5md -o strain.pdf --kind strain,momentum
  postprocess/plot.py beuler.h5md bdf.h5md -o compare.png --kind drift  the legend names the options that differ
  postprocess/plot.py truss.h5md -o force.png --kind force --against displacement:apex --component y
  postprocess/plot.py sheared.h5md -o stress.png --kind stress          stress over strain, and its slope beside it
  postprocess/plot.py circuit.h5md -o circuit.svg --states v_out,i_L
"""
import argparse
import os
import sys
from contextlib import ExitStack

if __name__ == "__main__":
    import launch
    launch.require("numpy", "h5py", "matplotlib")

import matplotlib  # noqa: E402
matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.lines import Line2D  # noqa: E402

import figures  # noqa: E402
from figure_layout import settle  # noqa: E402
from figure_style import COLORS, DASHES, STYLE, mark_points  # noqa: E402
from figures_modes import few_of_all  # noqa: E402
from figures_motion import state_scenes  # noqa: E402
from figures_steps import iterated, steps_vary  # noqa: E402
from figures_stress import box_strains, has_slope  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from listed import Listed  # noqa: E402
from run_data import TENSOR  # noqa: E402
from camera import AXES, finite_number  # noqa: E402

ENDINGS = (".png", ".pdf", ".svg")
NOT_SETTINGS = ("output", "report", "overwrite", "version", "options_file", "options_left", "log_view", "progress")
FIRST = ("ts_type", "ts_dt", "ts_adapt_type")  # what tells runs apart best


def run_labels(runs):
    """A label for each run: the options in which they differ (three at most), those that count most first; with the name of the
    file if that leaves two alike; '' for a single run."""
    if len(runs) == 1:
        return [""]
    keys = sorted({k for run in runs for k in run.parameters if not any(w in k for w in NOT_SETTINGS)},
                  key=lambda k: (FIRST.index(k) if k in FIRST else len(FIRST), k.startswith("ts_adapt"), k))
    differ = [k for k in keys if len({run.parameters.get(k) for run in runs}) > 1][:3]
    names = [os.path.splitext(os.path.basename(run.path))[0] for run in runs]
    labels = [", ".join(f"{k} {run.parameters[k]}".strip() for k in differ if k in run.parameters)
              or (f"without {differ[0]}" if differ else "") for run in runs]
    if len(set(labels)) < len(runs):
        names = names if len(set(names)) == len(names) else [run.path for run in runs]
        labels = [f"{n}: {text}" if text else n for n, text in zip(names, labels)]
    return labels


def default_kinds(runs):
    """The panels of a sheet: those that have something to say."""
    if runs[0].has_modes:
        return ["state", "spectrum"] + ([] if any(map(few_of_all, runs)) else ["dos"])
    if runs[0].kind == "linear":
        return ["states"] + (["sources"] if figures.varying_sources(runs[0]) else [])
    many = ["histogram"] if len(runs[0].springs) > 20 else []
    log = (["steps"] if any(map(steps_vary, runs)) else []) + (["iterations"] if any(map(iterated, runs)) else [])
    if all(run.static for run in runs):
        strained = any(any(run.periodic) and "stress" in run.series and np.ptp(box_strains(run, [0, -1]), axis=0).max() > 0 for run in runs)
        return ["state", "stress" if strained else "force", "energy"] + many + [kind for kind in log if kind == "iterations"]
    return ["state", "energy"] + (["drift"] if any(map(figures.drifts, runs)) else []) + ([] if len(runs) > 1 else many or ["phase"]) + log


def plan(kinds, runs, args):
    """Panels as (kind, runs, labels, arguments); some kinds are drawn once for every run, a state for every frame asked for,
    states and sources for every unit."""
    labels = run_labels(runs)
    panels = []
    for kind in kinds:
        if kind == "state":
            panels += [(kind, [run], [label], argparse.Namespace(**{**vars(args), "frame": frame, "scene": scene}))
                       for run, label, scene in zip(runs, labels, state_scenes(runs, args)) for frame in args.frames]
        elif kind in ("states", "sources"):
            panels += [(kind, runs, labels, argparse.Namespace(**{**vars(args), "unit": unit})) for unit in figures.units_drawn(runs[0], kind, args)]
        elif kind in figures.BY_RUN:
            panels += [(kind, [run], [label], args) for run, label in zip(runs, labels)]
        else:
            panels.append((kind, runs, labels, args))
    return panels


def sheet(panels, args):
    """The figure: panels in rows of two, of one or three where that fits better."""
    count = len(panels)
    columns = 1 if count == 1 else 3 if count in (3, 5, 6, 9) else 2
    rows = -(-count // columns)
    runs, labels = max(((p[1], p[2]) for p in panels), key=lambda pair: len(pair[0]))
    keyed = len(runs) > 1 and any(kind not in figures.BY_RUN + ("states", "sources") for kind, *_ in panels)
    styled = len(runs) > 1 and not keyed and any(kind == "states" for kind, *_ in panels)
    head = 0.35 + (0.19 * len(runs) if keyed or styled else 0)  # inches above the panels
    gap = (1.45 if {"state", "paths", "phase", "nonaffine_field"} & {p[0] for p in panels} else 1.1, 0.8)
    wide, high = (4.2, 2.9) if columns == 1 else (2.75, 2.3)
    size = args.size or (0.8 + columns * wide + (columns - 1) * gap[0] + 0.75, head + rows * high + (rows - 1) * gap[1] + 0.55)
    if size[0] > 60 or size[1] > 60:
        raise RunError(f"{count} panels are too many for one sheet")
    figure = plt.figure(figsize=size, dpi=args.dpi)
    inner = ((size[0] - 1.55 - (columns - 1) * gap[0]) / columns, (size[1] - head - 0.55 - (rows - 1) * gap[1]) / rows)
    if min(inner) < 0.5:
        raise RunError(f"{size[0]:g}x{size[1]:g} inches are too small for {count} panels")
    grid = figure.add_gridspec(rows, columns, left=0.8 / size[0], right=1 - 0.75 / size[0], bottom=0.55 / size[1],
                               top=1 - head / size[1], wspace=gap[0] / inner[0], hspace=gap[1] / inner[1])
    if keyed or styled:
        lines = [Line2D([], [], color=COLORS[i % len(COLORS)] if keyed else "#555555", lw=2 if keyed else 1.3,
                        ls="-" if keyed else DASHES[i % len(DASHES)]) for i in range(len(runs))]
        figure.legend(lines, labels, loc="upper left", bbox_to_anchor=(0.7 / size[0], 1 - 0.02 / size[1]))
    for k, (kind, shown, names, own) in enumerate(panels):
        solid = kind == "paths" and shown[0].dim == 3
        ax = figure.add_subplot(grid[k // columns, k % columns], **({"projection": "3d"} if solid else {}))
        figures.KINDS[kind](ax, shown, names, own)
        if kind not in ("state", "nonaffine_field"):
            mark_points(ax)
    settle(figure)
    return figure


def parse(argv=None):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("files", nargs="+", metavar="FILE", help="trajectories written with -bs_output")
    p.add_argument("-o", "--output", required=True, help="picture: .png .pdf .svg")
    p.add_argument("--kind", action=Listed, help="panels, with commas or the option repeated, as in all that takes several: " + ", ".join(figures.KINDS) + " (default: a sheet)")
    p.add_argument("--states", action=Listed, type=lambda s: s.split(","), default=[], help="states of a linear system, by label or number")
    p.add_argument("--particles", action=Listed, type=lambda s: [int(v) for v in s.split(",")], default=[],
                   help="ids to follow in paths and phase (default: six of them)")
    p.add_argument("--against", metavar="WHAT", help="what force is drawn against: time, load, arc, displacement or displacement:GROUP, "
                   "a group's name or a particle's id (default: time, in statics displacement)")
    p.add_argument("--groups", action=Listed, type=lambda s: s.split(","), default=[], help="groups shown in force (default: the one that moves most)")
    p.add_argument("--load", action="store_true", help="draw the load factor in force, not reactions")
    p.add_argument("--component", choices=("x", "y", "z", *TENSOR[3]), help="component shown in phase and force (x, y, z), in stress and modulus (xx, "
                   "..., xy; default: the one with most motion)")
    p.add_argument("--frame", dest="frames", action=Listed, type=lambda s: [int(v) for v in s.split(",")], default=[-1], metavar="K,L",
                   help="frames shown in state, one panel each, and in histogram; write --frame=-1 (default: the last)")
    p.add_argument("--color", choices=("auto", "strain", "tension", "stress", "speed", "none"), default="auto", help="colour of state")
    p.add_argument("--deform", type=finite_number, metavar="F", help="draw displacements since the first frame F times as large, and the shape of that frame behind"
                   " (in state)")
    p.add_argument("--reactions", action="store_true", help="draw the reactions of groups as arrows, with their sizes (in state)")
    p.add_argument("--up", choices=AXES, default="", help="axis that points up (default: against gravity); write --up=-x")
    p.add_argument("--elev", type=float, default=18, help="elevation of the eye [degree] (default 18)")
    p.add_argument("--azim", type=float, default=-60, help="azimuth of the eye [degree] (default -60)")
    p.add_argument("--draw", choices=("auto", "springs", "triangles", "particles"), default="auto", help="how state is drawn, as by movie.py")
    p.add_argument("--max_springs", type=int, default=20000, help="more springs than this are drawn as discs (default 20000)")
    p.add_argument("--pdb", help="PDB file whose B-factors bfactor is compared with")
    p.add_argument("--length_unit", metavar="U", help="what the unit of lengths is called, for example angstrom (default: as the file says, else m)")
    p.add_argument("--size", type=lambda s: tuple(float(v) for v in s.split("x")), metavar="WxH", help="size of the sheet [inch]")
    p.add_argument("--dpi", type=float, default=200, help="pixels per inch (default 200)")
    args = p.parse_args(argv)
    args.frame = args.frames[-1]
    args.tensor = args.component if len(args.component or "") == 2 else None
    args.component = None if args.tensor else args.component
    return args


def main(argv=None):
    args = parse(argv)
    ending = os.path.splitext(args.output)[1].lower()
    if ending not in ENDINGS:
        raise RunError(f"{args.output}: unknown ending '{ending}'; use one of {' '.join(ENDINGS)}")
    if not os.path.isdir(os.path.dirname(args.output) or "."):
        raise RunError(f"{args.output}: no such folder")
    if (args.size and (len(args.size) != 2 or min(args.size) <= 0.5)) or not 10 <= args.dpi <= 2400:
        raise RunError("--size wants inches as WxH, --dpi a number from 10 to 2400")
    with ExitStack() as stack:
        runs = [stack.enter_context(open_run(f)) for f in args.files]
        if len({run.kind for run in runs}) > 1 or len({run.dim for run in runs}) > 1:
            raise RunError("the files hold systems of different kind or dimension; plot them one at a time")
        for run in runs:
            run.length_unit = args.length_unit
        kinds = args.kind.split(",") if args.kind else default_kinds(runs)
        sloped = "stress" in kinds and "modulus" not in kinds and any(map(has_slope, runs))
        kinds = [k for kind in kinds for k in ((kind, "modulus") if kind == "stress" and sloped else (kind,))]
        if runs[0].has_modes and not args.kind and "dos" not in kinds:
            print(f"plot.py: {next(filter(None, map(few_of_all, runs)))}: a density of states of so few is drawn where it is asked for, by --kind dos", file=sys.stderr)
        allowed = ("states", "sources", "steps") if runs[0].kind == "linear" else \
            [k for k in figures.KINDS if k not in ("states", "sources")]
        for kind in kinds:
            if kind not in allowed:
                raise RunError(f"--kind {kind}: for this system choose from {', '.join(allowed)}")
        for run in runs:
            if run.kind == "particles" and run.springs.rest_length_assumed and ({"strain", "state"} & set(kinds)):
                print(f"plot.py: {run.path}: no rest lengths, strains are relative to the first frame", file=sys.stderr)
        with plt.rc_context(STYLE):
            figure = sheet(plan(kinds, runs, args), args)
            figure.savefig(args.output, dpi=args.dpi, facecolor="white")
    print(f"{args.output}: {', '.join(kinds)}")


if __name__ == "__main__":
    launch.run(main, RunError)
