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

DUMP = ["-malloc_debug", "-malloc_dump", "-objects_dump"]
CLOTH = ["-bs_lattice_type", "cloth", "-bs_lattice_size", "5,5", "-bs_gravity", "0,0,-9.81", "-bs_lattice_fixed", "ymax"]
LADDER = ["-bs_model", "linear", "-bs_linear_type", "rc_ladder", "-bs_linear_size", "9", "-bs_linear_source", "step(1)", "-ts_dt",
          "1e-6", "-ts_max_time", "3e-6"]
MESH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n2\n1 0 0 0\n2 1 0 0\n$EndNodes\n$Elements\n1\n1 1 2 1 1 1 2\n$EndElements\n"
CASES = {  # name: (words, exit code)
    "implicit run with output": ([*CLOTH, "-ts_max_steps", "2", "-bs_output", "o.h5md"], 0),
    "matrix-free Newton": ([*CLOTH, "-ts_max_steps", "2", "-snes_mf"], 0),
    "explicit run": ([*CLOTH, "-ts_type", "rk", "-ts_max_steps", "2"], 0),
    "symplectic run": ([*CLOTH, "-ts_type", "symplectic", "-ts_dt", "1e-3", "-ts_max_steps", "2"], 0),
    "arkimex": ([*CLOTH, "-ts_type", "arkimex", "-ts_max_steps", "2"], 0),
    "linear system": (LADDER, 0),
    "Gmsh mesh": (["-bs_lattice_file", "m.msh", "-bs_lattice_particle_mass", "1", "-bs_lattice_stiffness", "1", "-ts_max_steps", "2"], 0),
    "bad option": ([*CLOTH, "-bs_step_cut", "2"], 2),
    "bad option, found late": ([*CLOTH, "-bs_grvity", "2"], 2),
    "missing lattice": (["-bs_lattice_file", "none.h5"], 2),
    "overflow": ([*CLOTH, "-ts_type", "euler", "-ts_dt", "1e3", "-ts_max_time", "1e6"], 3),
}


def run(program, ranks, words):
    environment = dict(os.environ, OMPI_MCA_rmaps_base_oversubscribe="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    if os.geteuid() == 0:
        environment.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    with tempfile.TemporaryDirectory(prefix="dumps_") as folder:
        (pathlib.Path(folder) / "m.msh").write_text(MESH)
        done = subprocess.run(["mpirun", "-n", str(ranks), str(program), *words, *DUMP], cwd=folder, env=environment, text=True,
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
            print(f"{'FAIL' if wrong else 'ok  '} {name} on {ranks}", *wrong[:20], sep="\n       ")
    print(f"{count - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
