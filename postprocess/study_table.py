"""What a study found: one row a point, errors against a reference, study.csv and study.h5."""
import csv
import json
import os

import h5py
import numpy as np

import differences
import study_run
import study_warnings
from backspring_io import RunError, open_run
from energy_books import lost_of
from run_data import TENSOR

COMPONENTS = "xyz"
MISSING = ""


def parts_of(name, count):
    """Names of the components of a vector, or of a stress or a row of a stiffness."""
    tensor = {len(names): names for names in TENSOR.values()}.get(count)
    if tensor and ("stress" in name or name.startswith("stiffness")):
        return tensor
    return COMPONENTS[:count] if count <= 3 else range(count)


def flat_report(path):
    """The closing report as {name: number or text}; vectors become name_x, name_y, ..., stresses name_xx, ..., the stiffness stiffness_xx_yy, ..."""
    try:
        with open(path, encoding="utf-8") as f:
            report = json.load(f)
    except (OSError, ValueError):
        return {}
    flat = {}

    def add(name, value, parts=None):
        if isinstance(value, dict):
            for key, inner in value.items():
                add(f"{name}_{key}" if name else key, inner, value.get("components") if key in ("strain", "stress") else None)
        elif isinstance(value, list) and len(value) == 1 and parts is None:
            add(name, value[0])
        elif isinstance(value, list):
            for part, inner in zip(parts or parts_of(name, len(value)), value):
                add(f"{name}_{part}", inner)
        else:
            flat[name] = value
    add("", report)
    return flat


def row_of(study, point):
    """The row of one point: settings, verdict, report, size, drift of energy."""
    folder = os.path.join(study, point.name)
    found = study_run.verdict(folder) or {"status": "not run", "reason": "", "seconds": None}
    row = {"point": point.name, "status": found["status"], "reason": found["reason"], **point.setting, "ranks": point.ranks,
           "seconds": found["seconds"], "warnings": len(study_warnings.warnings_of(folder))}
    for key, value in flat_report(os.path.join(folder, "report.json")).items():
        if not key.startswith("warnings"):  # their texts; their number is there, also of runs without a report
            row.setdefault(key if key != "reason" else "ended", value)
    if found["status"] == "ok":
        with open_run(os.path.join(folder, "run.h5md")) as run:
            row["unknowns"] = 2 * run.dim * run.particles if run.kind == "particles" else len(run.states.labels)
            lost = lost_of(run)
            if lost is not None:
                row["energy_drift"] = float(np.abs(lost).max())
    return row


def rows_of(study, points):
    return [row_of(study, point) for point in points]


def columns_of(rows):
    names = []
    for row in rows:
        names += [n for n in row if n not in names]
    return names


def add_errors(study, points, rows, reference):
    """Adds error_QUANTITY_max, _rms (at the last frame) and error_QUANTITY_worst (largest over time) to the rows.
    reference: path of a trajectory. Returns a line for every point that could not be compared."""
    notes = []
    with open_run(reference) as b:
        for point, row in zip(points, rows):
            path = os.path.join(study, point.name, "run.h5md")
            if row["status"] != "ok" or os.path.realpath(path) == os.path.realpath(reference):
                continue
            with open_run(path) as a:
                try:
                    _add_error(a, b, row)
                except RunError as error:
                    notes.append(f"{point.label()}: no error: {error}")
    return notes


def _add_error(a, b, row):
    pairs, frames = differences.pair_particles(a, b), differences.common_frames(a, b)
    if not frames or a.times[-1] - a.times[frames[-1][0]] > differences.SLACK * np.ptp(a.times):
        raise RunError(f"{b.path} has no frame at t = {a.times[-1]:.9g} s, the end of {a.path}")
    for quantity in differences.quantities(a):
        d = differences.compare(a, b, quantity, pairs, frames)
        row[f"error_{quantity}_max"], row[f"error_{quantity}_rms"] = float(d.largest[-1]), float(d.rms[-1])
        row[f"error_{quantity}_worst"] = float(d.largest.max())


def write_csv(path, rows):
    names = columns_of(rows)
    with open(path + ".part", "w", newline="", encoding="utf-8") as f:
        writer = csv.DictWriter(f, names, restval=MISSING)
        writer.writeheader()
        writer.writerows({k: (MISSING if v is None else v) for k, v in row.items()} for row in rows)
    os.replace(path + ".part", path)


def _column(values):
    """Numbers as float64 (nan where missing), else text."""
    try:
        return np.array([np.nan if v in (None, MISSING) else float(v) for v in values])
    except (TypeError, ValueError):
        return np.array([("" if v is None else str(v)).encode() for v in values])


def write_h5(path, study, points, rows):
    """/table/NAME (points) and, for every finished point, /points/NAME/{time, observables/*, log/*, report}."""
    with h5py.File(path + ".part", "w") as f:
        table = f.create_group("table")
        for name in columns_of(rows):
            table[name] = _column([row.get(name) for row in rows])
        for point, row in zip(points, rows):
            group = f.create_group(f"points/{point.name}")
            group.attrs.update({k: str(v) for k, v in point.setting.items()})
            group.attrs["status"], group.attrs["reason"] = row["status"], row["reason"]
            if row["status"] != "ok":
                continue
            with open_run(os.path.join(study, point.name, "run.h5md")) as run:
                group["time"] = run.observable_times
                for name, value in run.series.items():
                    group[f"observables/{name}"] = value
                for name, value in run.log.items():
                    group[f"log/{name}"] = value
    os.replace(path + ".part", path)
