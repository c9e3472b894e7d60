#!/usr/bin/env python3
"""Factors for which MUMPS gets no memory, on every path that has factors: the run fails and says memory, why and what to give."""
import json
import sys
import pathlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from runs import run, run_parts, told

CUBE = {"bs_lattice_type": "cubic", "bs_lattice_size": (9, 9, 9), "bs_lattice_spacing": 0.2, "bs_lattice_fixed": "zmin", "bs_lattice_stiffness": 4000,
        "bs_gravity": (0, 0, -1), "bs_lattice_perturbation": 0.01, "bs_progress_interval": -1, "bs_advise": False, "bs_overwrite": True, "bs_report": "r.json"}
STEPS = {"ts_dt": 0.01, "ts_max_time": 0.02}
DIRECT = {"condensed_pc_type": "cholesky"}
BOX = dict(CUBE, bs_lattice_periodic="xyz", bs_lattice_fixed=None, bs_gravity=None)


def statics(**more):
    return dict(CUBE, bs_task="statics", **more)


def modes(**more):
    return dict(CUBE, bs_task="modes", bs_modes_solver="direct", **more)


# name: (options, prefix of the factors' options, whether the run is known to reach its end and to write a report)
PATHS = {
    "steps, condensed": (dict(CUBE, **STEPS, **DIRECT), "condensed_", True),
    "steps, the whole system": (dict(CUBE, **STEPS, ksp_type="preonly", pc_type="lu", pc_factor_mat_solver_type="mumps"), "", True),
    "steps, blocks": (dict(CUBE, **STEPS, ksp_type="gmres", pc_type="bjacobi", sub_pc_type="lu", sub_pc_factor_mat_solver_type="mumps"), "sub_", True),
    "load steps": (statics(**DIRECT), "condensed_", True),
    "arc length": (statics(bs_load_control="arc", **DIRECT), "condensed_", True),
    "compliance": (statics(bs_group_top="zmax", bs_compliance_groups="top", bs_gravity=None, bs_lattice_perturbation=None, condensed_ksp_max_it=3,
                           condensed_pc_type="none"), "", True),
    "moduli": (dict(BOX, bs_task="moduli", **DIRECT), "condensed_", True),
    "modes, smallest": (modes(), "", False),
    "modes, largest": (modes(bs_modes_which="largest"), "", False),
    "modes, target": (modes(bs_modes_which="target", bs_modes_target=100), "", False),
}


def paths(checks, folder, ranks):
    for name, (options, prefix, report) in PATHS.items():
        for icntl, value, number in ((23, 1, -19), (14, -95, -9)):
            if icntl == 14 and not name.startswith("steps"):
                continue
            what = f"{name}, -mat_mumps_icntl_{icntl} {value}, {ranks} rank(s)"
            (folder / "r.json").unlink(missing_ok=True)
            given = {k: v for k, v in options.items() if v is not None}
            code, out, err = run(checks, folder, dict(given, **{f"{prefix}mat_mumps_icntl_{icntl}": value}), ranks, timeout=60)
            lines = told(err)
            checks.true(f"{what}: exit 3, one line", code == 3 and len(lines) == 1, f"{code} {err.strip()[-300:]}")
            said = lines[0] if lines else ""
            checks.true(f"{what}: says memory and the option", "no memory" in said and f"icntl_{icntl}" in said and "INFOG(1) = " in said, said)
            checks.true(f"{what}: names the prefix", not report or f"-{prefix}mat_mumps_icntl_{icntl}" in said, said)
            if report and (folder / "r.json").exists():
                checks.true(f"{what}: report says failed", json.loads((folder / "r.json").read_text())["outcome"] == "failed")


def one_rank(checks, folder):
    paths(checks, folder, 1)


def two_ranks(checks, folder):
    paths(checks, folder, 2)


if __name__ == "__main__":
    run_parts(__doc__, (one_rank, two_ranks))
