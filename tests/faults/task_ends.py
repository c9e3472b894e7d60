#!/usr/bin/env python3
"""Modes, compliances, moduli and matrices of runs that fail or are stopped: nothing is claimed, and nothing of an earlier run is left under the names that the
run was allowed to overwrite."""
import json
import pathlib
import signal
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import h5py
from runs import SLOWER, run, run_parts, start, told

CUBE = {"bs_lattice_type": "cubic", "bs_lattice_size": (7, 7, 7), "bs_lattice_spacing": 0.2, "bs_lattice_fixed": "zmin", "bs_lattice_stiffness": 4000,
        "bs_gravity": (0, 0, -1), "bs_lattice_perturbation": 0.01, "bs_progress_interval": -1, "bs_advise": False, "bs_overwrite": True, "bs_report": "r.json",
        "bs_output": "o.h5md"}
BOX = {k: v for k, v in CUBE.items() if k not in ("bs_lattice_fixed", "bs_gravity")} | {"bs_lattice_periodic": "xyz", "bs_task": "moduli"}
SLOW = {"bs_load_steps": 1000000}  # longer than anybody waits
MATRICES = [f"m_{name}.{ending}" for name in "MKD" for ending in ("mtx", "petsc")]
TASKS = {
    "modes about the equilibrium": dict(CUBE, bs_task="modes", bs_modes_about="equilibrium", bs_modes_solver="direct", bs_write_matrices="m"),
    "compliance": dict(CUBE, bs_task="statics", bs_group_top="zmax", bs_compliance_groups="top", condensed_pc_type="cholesky", bs_write_matrices="m"),
    "moduli": dict(BOX, condensed_pc_type="cholesky", bs_write_matrices="m"),
}


def datasets(path):
    names = []
    with h5py.File(path) as f:
        f.visit(names.append)
    return names


def earlier(checks, folder, name, options):
    code, _, err = run(checks, folder, options)
    there = [file for file in MATRICES if (folder / file).exists()]
    checks.true(f"{name}: a run that ends well has its results", code == 0 and there == MATRICES and json.loads((folder / "r.json").read_text())["outcome"] == "ok",
                f"{code} {there} {err.strip()[-200:]}")


def nothing_claimed(checks, folder, name, outcome):
    said = json.loads((folder / "r.json").read_text()) if (folder / "r.json").exists() else {"outcome": None}
    checks.true(f"{name}: the report tells of this run or is not there", said["outcome"] in (None, outcome), said["outcome"])
    checks.true(f"{name}: the report claims nothing", not said.get("omega_squared") and said.get("completeness") in (None, "unknown")
                and "compliance" not in said and "stiffness" not in said, str(said)[:300])
    checks.true(f"{name}: no matrices", not any((folder / file).exists() for file in MATRICES), str([file for file in MATRICES if (folder / file).exists()]))
    left = [file.name for file in folder.iterdir() if ".tmp" in file.name]
    checks.true(f"{name}: nothing temporary is left", not left, str(left))
    with h5py.File(folder / "o.h5md") as f:
        squared = [item for item in datasets(folder / "o.h5md") if item.endswith("omega_squared")]
        checks.true(f"{name}: the file holds no modes", all(f[item].size == 0 for item in squared), str(squared))
        for table in ("compliance/matrix", "moduli/stiffness"):
            checks.true(f"{name}: the file has no {table} of numbers", table not in f or not (f[table][...] == f[table][...]).any())


def failures(checks, folder):
    """By a solver without memory."""
    for name, options in TASKS.items():
        earlier(checks, folder, name, options)
        code, _, err = run(checks, folder, dict(options, bs_lattice_size=(9, 9, 9), condensed_pc_type="cholesky", condensed_mat_mumps_icntl_23=1))
        checks.true(f"{name}: exit 3, one line", code == 3 and len(told(err)) == 1, f"{code} {err.strip()[-300:]}")
        nothing_claimed(checks, folder, name, "failed")


def failed_search(checks, folder):
    """The search for modes itself has no memory: the equilibrium's file stands, its modes do not."""
    options = dict(TASKS["modes about the equilibrium"], bs_lattice_size=(9, 9, 9))
    earlier(checks, folder, "search", options)
    code, _, err = run(checks, folder, dict(options, mat_mumps_icntl_23=1))
    said = json.loads((folder / "r.json").read_text()) if (folder / "r.json").exists() else {"outcome": "none"}
    checks.true("search without memory: exit 3, no report of the earlier run", code == 3 and said["outcome"] != "ok", f"{code} {said['outcome']} {err[-200:]}")


def signals(checks, folder):
    for name, options in TASKS.items():
        for number, exit_code in ((signal.SIGTERM, 143), (signal.SIGINT, 130)):
            what = f"{name}, {number.name}"
            earlier(checks, folder, what, options)
            process = start(checks, folder, dict(options, **SLOW, bs_progress_interval=0))
            for line in process.stdout:
                if ", load step " in line:
                    break
            process.send_signal(number)
            out, err = process.communicate(timeout=60 * SLOWER)
            checks.true(f"{what}: exit {exit_code}", process.returncode == exit_code, f"{process.returncode} {out.strip()[-200:]} {err.strip()[-200:]}")
            checks.true(f"{what}: the last line says so", "stopped" in (out + err), out.strip()[-300:])
            nothing_claimed(checks, folder, what, "stopped")


if __name__ == "__main__":
    run_parts(__doc__, (failures, failed_search, signals))
