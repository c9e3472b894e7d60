"""What the errors of a study are measured against."""
import os
from dataclasses import dataclass

import numpy as np

import differences
import study_orders as orders
from backspring_io import RunError, open_run
from study import option_words


@dataclass
class Reference:
    path: str           # of its trajectory
    text: str           # for the reader
    point: str = None   # its name, if it is a point of the study itself


def own_point(plan, make_point):
    """The point of a reference given as options; None for another kind of reference. Raises RunError for a wrong file."""
    given = plan["reference"]
    if isinstance(given, str) and given != "finest" and not given.lstrip().startswith("-"):
        open_run(given).close()  # a wrong file is told before anything is run
    if isinstance(given, dict) or (isinstance(given, str) and given.lstrip().startswith("-")):
        return make_point(plan, {}, option_words(given), "reference_")
    return None


def find(plan, points, rows, extra):
    """The reference, or None where none is asked for. `extra`: from own_point."""
    given, study = plan["reference"], plan["output"]
    if not given:
        return None
    if extra is not None:
        path = os.path.join(study, extra.name, "run.h5md")
        if not os.path.exists(path):
            raise RunError("the run of the reference failed, there are no errors")
        return Reference(path, "a run with " + " ".join(option_words(given)))
    if given != "finest":
        with open_run(given) as run:
            return Reference(run.path, run.path)
    if not plan["against"]:
        raise RunError("--reference finest needs a varied option with numbers, such as -ts_dt")
    row = _finest(study, rows, plan)
    label = next(p for p in points if p.name == row["point"]).label()
    return Reference(os.path.join(study, row["point"], "run.h5md"), f"the finest run, {label}", row["point"])


def _gap(study, series, column):
    """Difference between the two finest runs of a series, in the norm of `column`; inf if there is one only."""
    if len(series.rows) < 2:
        return np.inf
    paths = [os.path.join(study, r["point"], "run.h5md") for r in series.rows[-2:]]
    with open_run(paths[0]) as a, open_run(paths[1]) as b:
        quantity = column.split("_")[1] if column else differences.quantities(a)[0]
        d = differences.compare(a, b, quantity)
    return float({"max": d.largest[-1], "worst": d.largest.max()}.get((column or "").split("_")[-1], d.rms[-1]))


def _finest(study, rows, plan):
    """The row with the smallest value of the option; of several, the one that differs least from the next coarser run of its
    own series, as it has converged furthest."""
    series = orders.series_of(rows, plan["names"], plan["against"])
    if not series:
        raise RunError("--reference finest: no point has finished")
    smallest = min(s.x[-1] for s in series)
    return min((s for s in series if s.x[-1] == smallest), key=lambda s: _gap(study, s, plan["error"])).rows[-1]


def own_error(study, reference, series, column):
    """An estimate of the reference's own error where it is a point of the study (0 else), by extrapolation: two runs of
    order p with steps h and r h differ by (r^p - 1) times the error of the finer."""
    for s in series:
        if s.rows[-1]["point"] == reference.point and len(s.rows) > 2:
            orders.fit([s], column, reference.point)
            if np.isfinite(s.order):
                return _gap(study, s, column) / ((s.x[-2] / s.x[-1]) ** s.order - 1)
    return 0.0
