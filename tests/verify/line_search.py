#!/usr/bin/env python3
"""The energy-based line search from outside: on a quadratic potential a full step changes it by half its slope, for every type
it serves; trajectories agree with those of other searches and on any ranks; what it cannot serve is said."""
import itertools
import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import numpy as np
from harness import Checks, write_lattice

# springs without rest length, simple dampers, drag and weight: forces are linear, Phi is quadratic
QUADRATIC = {"bs_lattice_type": "square", "bs_lattice_size": (5, 4), "bs_lattice_fixed": "xmin", "bs_lattice_rest_length_factor": 0, "bs_lattice_stiffness": 70,
             "bs_lattice_damping": 0.8, "bs_damping_law": "simple", "bs_lattice_velocity": (0.3, -1), "bs_gravity": (0.5, -9.81), "bs_stokes_drag": 0.4, "bs_viscosity": 0.3,
             "ts_dt": 0.05, "ts_max_time": 0.2, "snes_linesearch_monitor": True, "snes_linesearch_full_step_rtol": 0, "snes_max_it": 8}
CROOKED = {"bs_lattice_type": "cubic", "bs_lattice_size": (5, 4, 4), "bs_lattice_spacing": 0.2, "bs_lattice_fixed": "zmin", "bs_spring_law": "strain", "bs_lattice_stiffness": 400,
           "bs_lattice_perturbation": 0.06, "bs_lattice_stiff_fraction": 0.1, "bs_lattice_stiff_factor": 100, "bs_gravity": (0, 0, -9.81), "bs_stokes_drag": 0.1, "ts_dt": 0.02, "ts_max_time": 0.2, "snes_rtol": 1e-12}
TYPES = {"beuler": {}, "cn": {}, "theta 0.5": {"ts_type": "theta"}, "theta 0.7 with end points": {"ts_type": "theta", "ts_theta_theta": 0.7, "ts_theta_endpoint": 1},
         "bdf": {"ts_adapt_type": "none"}}


def trials(text):
    """(lambda, change, slope, verdict) of every trial."""
    found = re.findall(r"energy: lambda (\S+), change (\S+), slope (\S+): (\w+)", text)
    return [(float(a), float(b.rstrip(".")), float(c), verdict) for a, b, c, verdict in found]


def quadratic(checks):
    for name, options in TYPES.items():
        given = {"ts_type": name.split()[0], **QUADRATIC, **options}
        out = checks.run(given).stdout
        whole = [t for t in trials(out) if t[0] == 1 and abs(t[2]) > 1e-6]
        checks.true(f"{name}: full steps downhill", len(whole) >= 4 and all(t[2] < 0 and t[3] == "taken" for t in whole), f"{len(whole)} of them")
        checks.below(f"{name}: half the slope", max(abs(t[1] / t[2] - 0.5) for t in whole), 1e-5)
        half = [t for t in trials(checks.run(dict(given, snes_linesearch_damping=0.5, snes_max_it=60)).stdout) if t[0] == 0.5 and abs(t[2]) > 1e-4]
        checks.below(f"{name}: three eighths of it at half a step", max(abs(t[1] / t[2] - 0.375) for t in half), 1e-5)


def in_boxes(checks):
    """Short steps from near rest are nearly quadratic: half the slope again, with the springs of every image."""
    net = {**QUADRATIC, "bs_lattice_rest_length_factor": 0.9, "bs_lattice_fixed": None, "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.01}
    net.update(dict.fromkeys(("bs_lattice_velocity", "bs_gravity", "bs_viscosity", "bs_stokes_drag")))
    for (name, options), shear in itertools.product(TYPES.items(), (0, 2)):
        out = checks.run({"ts_type": name.split()[0], **net, **options, "bs_box_rate": f"xy={shear}" if shear else None}).stdout
        checks.below(f"{name}, a box sheared by {shear}/s: half the slope", max(abs(t[1] / t[2] - 0.5) for t in trials(out) if t[0] == 1 and abs(t[2]) > 1e-6), 1e-3)


def agreement(checks):
    runs = {}
    for search in ("energy", "bt", "guarded"):
        for ranks in ((1, 2, 3) if search == "energy" else (1,)):
            runs[search, ranks] = checks.run(dict(CROOKED, snes_linesearch_type=search), ranks=ranks, interval=0.2)
    one = runs["energy", 1].trajectory
    for (search, ranks), r in runs.items():
        off = max(np.abs(r.trajectory.position[-1] - one.position[-1]).max(), 0.02 * np.abs(r.trajectory.velocity[-1] - one.velocity[-1]).max())
        checks.below(f"{search}, {ranks} rank(s): the same motion", off, 1e-9, f"{r.report['newton']} Newton iterations")
    newton = [r.report["newton"] for r in runs.values()]
    checks.true("by different ways", max(newton) > min(newton))
    checks.true("the default is energy", "line search energy," in checks.run(CROOKED).stdout)


def nothing_to_go_by(checks):
    cases = {"sphere drag": {"bs_sphere_drag": True, "bs_sphere_drag_rho": 1.2, "bs_sphere_drag_mu": 1.8e-5, "bs_radius": 0.01},
             "this -ts_type": {"ts_type": "alpha2"}, "a force that couples all particles": {"bs_xsp_center_of_mass": 3}}
    for what, options in cases.items():
        energy, guarded = (checks.run(dict(CROOKED, **options, snes_linesearch_type=s), interval=0.2, grows="ts_type" in options) for s in ("energy", "guarded"))
        checks.true(f"{what}: said", f"energy (residual norms: {what} has no potential)" in energy.stdout)
        checks.true(f"{what}: every bit that of residual norms", np.array_equal(energy.trajectory.position, guarded.trajectory.position))


def zero_length(checks):
    """A particle whose first full step ends exactly on the other end of its spring, where there is no force."""
    with tempfile.TemporaryDirectory() as folder:
        file = write_lattice(pathlib.Path(folder) / "l.h5", [[0.0], [1.0]], 1.0, velocity=[[0.0], [-2.0]], fixed=[1, 0], pairs=[[0, 1]], stiffness=1.0, rest_length=1.0, spring_law="hooke")
        r = checks.run({"bs_lattice_file": file, "ts_dt": 1.0, "ts_max_time": 1.0, "snes_linesearch_monitor": True}, interval=1.0)
    checks.true("zero length: the full step is refused", any(t[0] == 1 and t[3] == "refused" for t in trials(r.stdout)))
    x, v = r.trajectory.position[-1, 1, 0], r.trajectory.velocity[-1, 1, 0]
    checks.true("zero length: and never taken", x != 0)
    checks.below("zero length: the step equation holds", max(abs(v + 2 - np.sign(x) * (1 - abs(x))), abs(x - 1 - v)), 1e-7, f"x = {x:g} m")


def without_transposed(checks):
    """A search that fails rejects its step, also where the tangent is not symmetric and PETSc cannot ask for a minimum of the residual's norm."""
    crumpled = {"bs_lattice_type": "square", "bs_lattice_size": (6, 6), "bs_lattice_perturbation": 0.3, "bs_lattice_rest_length_factor": 1.5, "bs_lattice_stiffness": 1000,
                "bs_angle_stiffness": 50, "bs_rest_angle": 1, "ts_dt": 0.5, "ts_max_time": 3, "snes_linesearch_type": "bt"}
    for damping in (0, 5):
        r = checks.run(dict(crumpled, bs_lattice_damping=damping), interval=3.0, expect=None, grows=True)
        said = r.stdout + r.stderr
        checks.true(f"failed searches, damping {damping}: steps are rejected, not the option", r.code in (0, 3) and "transposed" not in said and "line search" in said, said[-200:])


def main():
    checks = Checks(__doc__)
    for part in (quadratic, in_boxes, agreement, nothing_to_go_by, zero_length, without_transposed):
        if checks.wants(part.__name__):
            with checks.group(part.__name__):
                part(checks)
    checks.finish()


if __name__ == "__main__":
    main()
