#!/usr/bin/env python3
"""PETSc's own count: no object and no block of its memory is left at the end (-malloc_dump, -objects_dump).

  dumps.py --program build/release/backspring

Every kind of run, and runs that end in a fault, on 1 and 2 ranks. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from program import environment  # noqa: E402

DUMP = ["-malloc_debug", "-malloc_dump", "-objects_dump"]
CLOTH = ["-bs_lattice_type", "cloth", "-bs_lattice_size", "5,5", "-bs_gravity", "0,0,-9.81", "-bs_lattice_fixed", "ymax"]
BICC = ["-condensed_ksp_type", "cg", "-condensed_pc_type", "bicc"]
NET = ["-bs_lattice_type", "triangular", "-bs_lattice_size", "6,6", "-bs_lattice_dim", "2", "-bs_lattice_spacing", "1", "-bs_lattice_stiffness", "1"]
PERIODIC = [*NET, "-bs_lattice_periodic", "xy"]
TORN = [*NET, "-bs_group_lower", "ymin", "-bs_group_upper", "ymax", "-bs_motion_lower", "fixed", "-bs_motion_upper", "x=fixed,y=velocity:1", "-bs_task", "statics",
        "-bs_load_steps", "5", "-bs_break_strain", "0.1", "-bs_break_uniform", "0.5,1", "-bs_break_spare", "lower,upper"]
LADDER = ["-bs_model", "linear", "-bs_linear_type", "rc_ladder", "-bs_linear_size", "9", "-bs_linear_source", "step(1)", "-ts_dt",
          "1e-6", "-ts_max_time", "3e-6"]
CASES = {  # name: (words, exit code)
    "implicit run with output": ([*CLOTH, "-ts_max_steps", "2", "-bs_output", "o.h5md"], 0),
    "matrix-free Newton": ([*CLOTH, "-ts_max_steps", "2", "-snes_mf"], 0),
    "explicit run": ([*CLOTH, "-ts_type", "rk", "-ts_max_steps", "2"], 0),
    "symplectic run": ([*CLOTH, "-ts_type", "symplectic", "-ts_dt", "1e-3", "-ts_max_steps", "2"], 0),
    "arkimex": ([*CLOTH, "-ts_type", "arkimex", "-ts_max_steps", "2"], 0),
    "searches by energy": ([*CLOTH, "-ts_dt", "0.3", "-ts_max_steps", "3", *BICC], 0),
    "bdf": ([*CLOTH, "-ts_type", "bdf", "-ts_max_steps", "3"], 0),
    "alpha2": ([*CLOTH, "-ts_type", "alpha2", "-ts_max_steps", "2"], 0),
    "statics": ([*CLOTH, "-bs_task", "statics", "-bs_load_steps", "3"], 0),
    "statics, conjugate gradients": ([*CLOTH, "-bs_task", "statics", *BICC], 0),
    "springs that break": ([*TORN, *BICC], 0),
    "springs that break in motion": ([*TORN, "-bs_break_follow", "dynamics"], 0),
    "modes": ([*CLOTH, "-bs_task", "modes", "-bs_modes", "3"], 0),
    "moduli": ([*PERIODIC, "-bs_task", "moduli"], 0),
    "given stresses": ([*PERIODIC, "-bs_task", "statics", "-bs_box_stress", "xx=0.1,yy=0"], 0),
    "linear system": (LADDER, 0),
    "bad option": ([*CLOTH, "-bs_step_cut", "2"], 2),
    "bad option, found late": ([*CLOTH, "-bs_grvity", "2"], 2),
    "missing lattice": (["-bs_lattice_file", "none.h5"], 2),
    "overflow": ([*CLOTH, "-ts_type", "euler", "-ts_dt", "1e3", "-ts_max_time", "1e6"], 3),
}


def run(program, ranks, words):
    with tempfile.TemporaryDirectory(prefix="dumps_") as folder:
        done = subprocess.run([*(["mpirun", "-n", str(ranks)] if ranks > 1 else []), str(program), *words, *DUMP], cwd=folder, env=environment(ranks), text=True,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120 * int(os.environ.get("BS_SLOWER", 1)))
    return done.returncode, done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=lambda path: pathlib.Path(path).resolve())
    program = parser.parse_args().program
    failed = count = 0
    for ranks in (1, 2):
        for name, (words, wanted) in CASES.items():
            code, said = run(program, ranks, words)
            left = [line for line in said.splitlines() if re.search(r"\d+ bytes \w+\(\)|^\[\s*\d+\] \d+ bytes|objects that were never freed|The following objects", line)]
            wrong = ([f"exit code {code}, should be {wanted}"] if code != wanted else []) + left
            count += 1
            failed += bool(wrong)
            print(f"{'FAIL' if wrong else 'ok  '} {name} on {ranks}", *wrong[:20], sep="\n       ", flush=True)
    print(f"{count - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
