#!/usr/bin/env python3
"""Files that options of PETSc's name and that cannot be written: one line that names option and file, exit code 4, before anything is computed."""
import re
import sys
import pathlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from runs import run, run_parts, told

NET = {"bs_lattice_type": "square", "bs_lattice_size": "3,3", "bs_lattice_perturbation": 0.01, "ts_dt": 0.01, "ts_max_time": 0.02, "bs_progress_interval": -1, "bs_advise": False,
       "bs_output": "o.h5md", "bs_overwrite": True}
BY_VIEWER = ("log_view", "options_view", "ksp_view", "snes_view", "ts_view", "mat_view", "condensed_ksp_view", "snes_monitor", "ksp_monitor", "snes_converged_reason", "ts_view_solution")
BY_NAME = ("info", "log_trace", "citations", "malloc_view")


def refused(checks, folder, name, value, file, ranks=1):
    (folder / "o.h5md").unlink(missing_ok=True)
    code, _, err = run(checks, folder, dict(NET, **{name: value}), ranks)
    lines = told(err)
    checks.true(f"-{name} {value}, {ranks} rank(s): exit 4, one line that names the file", code == 4 and len(lines) == 1 and file in lines[0] and "PETSC ERROR" not in err, f"{code} {err.strip()[-300:]}")
    return lines[0] if lines else ""


def viewers(checks, folder):
    (folder / "is_folder").mkdir()
    for name in BY_VIEWER:
        said = refused(checks, folder, name, ":none/x", "none/x")
        checks.true(f"-{name}: is named, and nothing is computed", f"-{name} " in said and not (folder / "o.h5md").exists(), said)
    for value in ("ascii:none/x", "binary:none/x", "ascii:none/x:ascii_info", ":none/x:ascii_info_detail:append", ":is_folder", "hdf5:/none/x"):
        for ranks in (1, 2):
            refused(checks, folder, "ksp_view", value, value.split(":")[1], ranks)
    code, _, err = run(checks, folder, dict(NET, ksp_view=":view.txt", log_view=":log.txt:ascii_info_detail", snes_monitor="ascii:monitor.txt", ts_view="ascii:stdout"))
    there = all((folder / file).stat().st_size > 0 for file in ("view.txt", "log.txt", "monitor.txt"))
    checks.true("files that can be written are", code == 0 and there, err.strip()[-300:])


def names(checks, folder):
    for name in BY_NAME:
        refused(checks, folder, name, "none/x", "none/x")


def help_of_views(checks, folder):
    """All that -help of a run calls a view."""
    _, out, _ = run(checks, folder, dict(NET, help=True))
    listed = sorted({name for name in re.findall(r"^ +-(\w+)", out, re.M) if "view" in name and not name.startswith("bs_")} - {"malloc_view", "memory_view", "device_view", "device_view_host"})
    checks.true("views are listed", len(listed) > 3, str(listed))
    for name in listed:
        refused(checks, folder, name, ":none/x", "none/x")


def logicals(checks, folder):
    """What PETSc reads at the very end is refused at the start."""
    for name, value in (("options_view", ":view.txt"), ("options_left", "perhaps"), ("memory_view", ":view.txt")):
        (folder / "o.h5md").unlink(missing_ok=True)
        code, _, err = run(checks, folder, dict(NET, **{name: value}))
        said = told(err)
        checks.true(f"-{name} {value}: refused, before anything is computed", code == 2 and len(said) == 1 and f"-{name}" in said[0] and value in said[0] and not (folder / "o.h5md").exists(),
                    f"{code} {err.strip()[-300:]}")


if __name__ == "__main__":
    run_parts(__doc__, (viewers, names, help_of_views, logicals))
