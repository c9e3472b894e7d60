"""Numbers that a conversion takes must be finite: a file of another program says nothing of those that are not."""
import numpy as np

from backspring_io import RunError
from run_data import BONDS, HISTORIES, LIMITS, PARTICLES, TURN_LIMITS


def first_bad(values, unbounded=False):
    """(row, value) of the first number that is not finite, or None. `unbounded`: infinity is one, as of what a spring bears."""
    values = np.asarray(values)
    if values.dtype.kind != "f":
        return None
    bad = np.isnan(values) if unbounded else ~np.isfinite(values)
    if not bad.any():
        return None
    place = np.unravel_index(int(bad.argmax()), values.shape) if values.ndim else ()
    return (int(place[0]) if place else 0), float(values[place])


def _require(path, where, values, unbounded=False):
    bad = None if values is None else first_bad(values, unbounded)
    if bad:
        raise RunError(f"{path}: {where}, row {bad[0]}, is not finite ({bad[1]})")


def check_run(run, rows):
    """Refuses frames, and what holds for all of them, by frame, dataset and row."""
    springs, angles, anchors = run.springs, run.angles, run.anchors or {}
    for name, values in (("mass", run.mass), *((name, run.particle_column(name)) for name in ("radius", "drag", "force"))):
        _require(run.path, f"{PARTICLES}/{name}", values)
    for name, values in (*((k, getattr(springs, k)) for k in ("stiffness", "rest_length", "damping")), *springs.law_data.items(), *springs.limits.items()):
        _require(run.path, f"{BONDS}_{name}", values, name in LIMITS)
    for name in ("stiffness", "rest_angle") if angles else ():
        _require(run.path, f"/connectivity/angles_{name}", getattr(angles, name))
    for name, values in (angles.limits if angles else {}).items():
        _require(run.path, f"/connectivity/angles_{name}", values, True)
    for name, values in (run.hinges or {}).items():
        _require(run.path, f"/connectivity/hinges_{name}", values, name in TURN_LIMITS)
    for name, values in anchors.items():
        _require(run.path, f"/backspring/anchors/{name}", values)
    for row in rows:
        of = {f"{PARTICLES}/position/time": run.times[row], f"{PARTICLES}/position/value": run.position(row)}
        if run.velocities is not None:
            of[f"{PARTICLES}/velocity/value"] = run.velocity(row)
        if any(run.periodic):
            of[f"{PARTICLES}/box/edges/value"] = run.box_edges(row)
        of.update({f"/backspring/{name}/value": run.spring_state(name, row) for name in HISTORIES})
        for dataset, values in of.items():
            _require(run.path, f"frame {row}: {dataset}", values)


def check_lattice(path, lattice):
    """Refuses a lattice by what is not finite, and its row."""
    for name in ("position", "velocity", "mass", "stiffness", "rest_length", "damping"):
        _require(path, name, getattr(lattice, name))
    for what, table in (("", lattice.spring_columns), ("", lattice.particle_columns), ("angles: ", lattice.angles), ("hinges: ", lattice.hinges), ("anchors: ", lattice.anchors)):
        for name, values in (table or {}).items():
            _require(path, what + name, values, name in LIMITS + TURN_LIMITS)
    if lattice.box:
        _require(path, "edges of the box", lattice.box[0])
