#!/usr/bin/env python3
"""Runs the program over a product of options and says what came out: a table, study.csv, study.h5, diagrams.

  postprocess/sweep.py --options_file options/problems/free_fall.yaml --vary "-ts_type=beuler,cn,bdf" \\
                       --vary "-ts_dt=0.4,0.2,0.1,0.05" --reference "-ts_type rk -ts_dt 0.001" --jobs 2 -o study
  postprocess/sweep.py --options_file block.yaml --np 1,2,4 -o scaling            strong scaling
  postprocess/sweep.py options/studies/cloth.yaml -o study                        from a YAML file

Called again with the same -o it goes on where it stopped: a finished point is never run twice.
"""
import argparse
import os
import shutil
import signal
import sys

if __name__ == "__main__":
    import launch
    launch.require("numpy", "scipy", "h5py", "matplotlib")

import numpy as np  # noqa: E402

import study_average  # noqa: E402
import study_orders as orders  # noqa: E402
import study_reference  # noqa: E402
import study_run  # noqa: E402
import study_table  # noqa: E402
import study_warnings  # noqa: E402
from backspring_io import RunError  # noqa: E402
from listed import Listed  # noqa: E402
from study import Axis, Point, axes_of_file, frame_interval, name_of, option_words, parse_vary, read_file, span, zipped  # noqa: E402

# The checkout, or share/backspring of an installed program; links are followed second.
ROOTS = [os.path.dirname(os.path.dirname(f)) for f in (os.path.abspath(__file__), os.path.realpath(__file__))]
TAKE_WORDS = ("--vary", "--options", "--reference")  # their words begin with a dash


def parse(argv=None):
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    p.add_argument("study", nargs="?", help="YAML file whose keys are the options below without dashes; the command line adds to it")
    p.add_argument("--options_file", action="append", default=[], metavar="F", help="option file of every point; may be repeated")
    p.add_argument("--options", action="append", default=[], metavar='"-o v ..."', help="options of every point")
    p.add_argument("--vary", action="append", default=[], metavar='"-o=a,b,c"', help="an axis; may be repeated. Semicolons where "
                   'values hold commas; "-a=1,2 -b=3,4" moves both together')
    p.add_argument("--zip", nargs="?", const="", metavar="A,B", help="axes that advance together instead of spanning a product: "
                   "all of them, or those named (np, ts_dt, ...)")
    p.add_argument("--np", action=Listed, metavar="N,M", help="numbers of MPI ranks")
    p.add_argument("--jobs", type=int, help="points that run at once (default 1)")
    p.add_argument("-o", "--output", help="folder of the study")
    p.add_argument("--program", help="the program (default: build/release/backspring of this checkout, else the one on PATH)")
    p.add_argument("--reference", metavar="finest|FILE|OPTIONS", help="errors against the finest run of the study, a trajectory, or "
                   'a run with these options on top: "-ts_type rk -ts_dt 1e-4"')
    p.add_argument("--against", metavar="OPTION", help="option whose values the orders are fitted over (default ts_dt), or what --show is drawn over; "
                   "1-OPTION: over one less its value")
    p.add_argument("--show", action=Listed, metavar="A,B", help="columns of the table to draw: shear_modulus, bulk_modulus, stiffness_xx_xx, ...")
    p.add_argument("--average", metavar="OPTION", help="varied option (a seed) that --show is averaged over, with standard errors")
    p.add_argument("--label", metavar="TEXT", help="what the axis of --against is called in the pictures of --show")
    p.add_argument("--error", metavar="COLUMN", help="error shown: error_position_rms, _max, _worst, error_velocity_..., "
                   "error_state_... (default position or state, rms)")
    p.add_argument("--interval", metavar="DT", help="simulated time between frames (default: one that no varied step has to be "
                   "cut for, else that of the options)")
    p.add_argument("--timeout", type=float, metavar="S", help="a point that takes longer counts as failed [s]")
    p.add_argument("--retry_failed", action="store_true", help="run failed points again")
    p.add_argument("--picture", choices=("png", "pdf", "svg"), default="png", help="format of the diagrams (default png)")
    p.add_argument("--list", action="store_true", help="print the command lines and run nothing")
    words, given = [], list(sys.argv[1:] if argv is None else argv)
    while given:
        word = given.pop(0)
        words.append(f"{word}={given.pop(0)}" if word in TAKE_WORDS and given else word)
    return p.parse_args(words)


def beside(path, study):
    """A path in a study file is meant from the file's own folder, or from where we are."""
    there = os.path.normpath(os.path.join(os.path.dirname(study), path))
    return there if os.path.exists(there) else path


def by_name(name, folders):
    """The file of this name as it stands, else NAME or NAME.yaml in options/ and these folders of it, as the program does."""
    there = [os.path.join(root, "options", folder, name + ending) for root in ROOTS for folder in ("", *folders) for ending in ("", ".yaml")]
    return next((path for path in [name, *there] if os.path.isfile(path)), name)


def merge(args):
    """The command line joined with the YAML study file; one dict."""
    args.study = by_name(args.study, ["studies"]) if args.study else None
    found = read_file(args.study) if args.study else {}
    as_list = lambda v: [] if v is None else v if isinstance(v, list) else [v]  # noqa: E731
    plan = {k: found.get(k) if getattr(args, k) is None else getattr(args, k)
            for k in ("zip", "np", "jobs", "output", "program", "reference", "against", "error", "interval", "timeout", "show",
                      "average", "label")}
    plan["show"] = [w.strip() for v in as_list(plan["show"]) for w in str(v).split(",") if w.strip()]
    plan["average"] = (plan["average"] or "").lstrip("-")
    plan["complement"] = bool(plan["show"]) and (plan["against"] or "").startswith("1-")
    plan["against"] = plan["against"][2:] if plan["complement"] else plan["against"]
    plan["files"] = [beside(str(f), args.study) for f in as_list(found.get("options_file"))] + args.options_file
    plan["files"] = [by_name(f, ["problems", "solvers"]) for f in plan["files"]]
    plan["options"] = option_words(found.get("options")) + [w for text in args.options for w in option_words(text)]
    axes = axes_of_file(found.get("vary"), args.study) + [parse_vary(v) for v in args.vary]
    try:
        ranks = [int(n) for n in (plan["np"] if isinstance(plan["np"], list) else str(plan["np"] or "").split(",")) if str(n).strip()]
        plan["jobs"], plan["timeout"] = int(plan["jobs"] or 1), None if plan["timeout"] is None else float(plan["timeout"])
    except ValueError:
        raise RunError("np and jobs are whole numbers, timeout is seconds") from None
    if ranks and min(ranks) < 1 or plan["jobs"] < 1:
        raise RunError("np and jobs must be at least 1")
    if ranks:
        axes.append(Axis("np", [{"np": n} for n in ranks]))
    names = [n for a in axes for n in a.name.split()]
    twice = [n for n in names if names.count(n) > 1]
    if twice:
        raise RunError(f"-{twice[0]} is varied twice")
    if plan["zip"] is not None and plan["zip"] is not False:
        wanted = plan["zip"] if isinstance(plan["zip"], list) else str(plan["zip"] if plan["zip"] is not True else "").split(",")
        axes = zipped(axes, [n.strip().lstrip("-") for n in wanted if n.strip()])
    plan["names"], plan["axes"] = [n for n in names if n != "np" or len(set(ranks)) > 1], axes
    if not plan["output"]:
        raise RunError("-o names the folder of the study")
    for path in plan["files"]:
        if not os.path.isfile(path):
            raise RunError(f"{path}: no such options file")
    return plan


def find_program(given):
    """Path of the program; raises RunError."""
    usual = [os.path.join(root, *parts) for root in ROOTS for parts in (("build", "release", "backspring"), ("..", "..", "bin", "backspring"))]
    candidates = [given] if given else usual + [shutil.which("backspring") or ""]
    for path in candidates:
        if path and os.access(path, os.X_OK) and os.path.isfile(path):
            return os.path.realpath(path) if ".." in path else path
    raise RunError(f"{given}: no such program" if given else "no program in build/release and none on PATH; name it by --program")


def make_point(plan, setting, extra=(), prefix=""):
    """The point with these settings. What the sweep itself adds stands before the option files, so that they win."""
    ranks = setting.get("np", 1)
    words = ["-ts_adapt_type", "none"] if any("ts_dt" in a.name.split() for a in plan["axes"]) else []
    for path in plan["files"]:
        words += ["-options_file", path]
    words += plan["options"]
    for name, value in setting.items():
        if name != "np":
            words += ["-" + name] + ([value] if value else [])
    words += list(extra)
    if plan["interval"]:
        words += ["-bs_output_interval", str(plan["interval"])]
    return Point(setting, words, ranks, prefix + name_of(setting, words, ranks, plan["files"]))


def make_points(plan):
    settings = span(plan["axes"])
    if not plan["interval"] and not any("bs_output_interval" in w for w in plan["options"] + plan["names"]):
        try:
            plan["interval"] = frame_interval(settings)
        except ValueError as error:
            raise RunError(f"-ts_dt takes numbers ({error})") from None
    points, seen = [make_point(plan, s) for s in settings], set()
    for point in points:
        if point.name in seen:
            raise RunError(f"the point {point.label()} is there twice; write every value of what varies once")
        seen.add(point.name)
    return points


def draw(plan, series, groups, floor, ending):
    """The diagrams that the study allows; their paths."""
    import study_figures
    made = []
    where = lambda name: os.path.join(plan["output"], f"{name}.{ending}")  # noqa: E731
    if any(np.isfinite(s.error).any() for s in series):
        made.append(study_figures.convergence(series, plan["against"], plan["error"], where("convergence"), floor))
        made.append(study_figures.work_precision(series, plan["error"], where("work_precision")))
    if groups:
        made.append(study_figures.scaling(groups, where("scaling")))
    return made


def choose_axis(plan, rows):
    """The option that orders are fitted over; None where nothing numeric varies."""
    numeric = [n for n in orders.numeric_axes(rows, plan["names"]) if n != "np"]
    if plan["against"]:
        plan["against"] = plan["against"].lstrip("-")
        if plan["against"] not in numeric:
            raise RunError(f"--against {plan['against']}: no varied option with numbers; there are {', '.join(numeric) or 'none'}")
        return plan["against"]
    return next((n for n in ["ts_dt"] + numeric if n in numeric), None)


def choose_error(plan, rows):
    """The column of errors that is shown; None where there are no errors."""
    there = sorted({c for r in rows for c in r if c.startswith("error_")})
    if plan["error"] and plan["error"] not in there and there:
        raise RunError(f"--error {plan['error']}: no such column; there are {', '.join(there)}")
    usual = [c for c in ("error_position_rms", "error_state_rms") if c in there]
    return (plan["error"] or (usual or there)[0]) if there else None


def evaluate(plan, points, extra, ending):
    """Collects, compares, writes and prints; `extra` is the point of the reference, or None."""
    study = plan["output"]
    rows = study_table.rows_of(study, points)
    study_average.add_moduli(rows)
    plan["against"] = choose_axis(plan, rows)
    reference = study_reference.find(plan, points, rows, extra)
    if reference is not None:
        for note in study_table.add_errors(study, points, rows, reference.path):
            print(f"sweep.py: {note}", file=sys.stderr)
    plan["error"] = choose_error(plan, rows)
    series, floor = [], 0.0
    if plan["error"] and plan["against"]:
        series = orders.series_of(rows, plan["names"], plan["against"])
        floor = study_reference.own_error(study, reference, series, plan["error"])
        orders.fit(series, plan["error"], reference.point, floor)
    groups = orders.scaling_series(rows, plan["names"]) if "np" in plan["names"] else {}
    study_table.write_csv(os.path.join(study, "study.csv"), rows)
    study_table.write_h5(os.path.join(study, "study.h5"), study, points, rows)
    print()
    print(orders.points_table(rows, plan["names"], plan["error"]))
    for line in study_warnings.told(study, points):
        print(line)
    if series:
        print(f"\n{plan['error']} against {reference.text}\n{orders.orders_table(series, plan['against'])}")
    if groups:
        print(f"\n{orders.scaling_table(groups)}")
    cut = [r for r in rows if r.get("shortened_steps") and "ts_dt" in plan["names"]]
    if cut:
        print(f"sweep.py: {len(cut)} points had steps cut to hit output times: choose --interval as a multiple of every step",
              file=sys.stderr)
    shown = study_average.report(plan, rows, ending) if plan["show"] else []
    print("\n" + "\n".join([os.path.join(study, n) for n in ("study.csv", "study.h5")] + draw(plan, series, groups, floor, ending) + shown))


def main(argv=None):
    args = parse(argv)
    plan = merge(args)
    program = find_program(plan["program"])
    points = make_points(plan)
    extra = study_reference.own_point(plan, make_point)
    every = ([extra] if extra else []) + points
    use_mpirun = any(p.ranks > 1 for p in every)
    runner = study_run.Runner(plan["output"], program, plan["jobs"], plan["timeout"], args.retry_failed, use_mpirun,
                              tell=lambda line: print(line, flush=True))
    if args.list:
        import shlex
        for p in every:
            print(shlex.join(study_run.command(p, runner.folder(p), program, use_mpirun)))
        return 0
    signal.signal(signal.SIGTERM, lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()))
    os.makedirs(plan["output"], exist_ok=True)
    runner.run(every)
    evaluate(plan, points, extra, args.picture)
    idle = study_warnings.without_effect(plan["output"], points)
    failed = study_run.failures(plan["output"], every)
    if idle:
        raise RunError(f"-{', -'.join(idle)}: varied, but not used by any point: misspelt, or of a solver that is not chosen")
    return 3 if failed else 0


if __name__ == "__main__":
    launch.run(main, RunError, apart=False)  # it reads what its own runs wrote
