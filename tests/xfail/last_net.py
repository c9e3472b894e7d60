#!/usr/bin/env python3
"""What nobody foresaw still ends in one line: memory that runs out, and crashes.

  last_net.py --program build/release/backspring

Crashes are made by sending the signal to a rank of a long run. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import argparse
import os
import pathlib
import resource
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from program import environment  # noqa: E402

LONG = ["-bs_lattice_type", "chain", "-bs_lattice_size", "9", "-ts_dt", "1e-4", "-ts_max_time", "1000", "-bs_output", "run.h5md",
        "-bs_output_interval", "1e-2"]
GIANT = ["-bs_lattice_type", "cubic", "-bs_lattice_size", "250,250,250", "-ts_max_steps", "1", "-ts_type", "euler"]
CRASHES = {signal.SIGSEGV: "segmentation fault", signal.SIGBUS: "bus error", signal.SIGFPE: "floating-point exception",
           signal.SIGABRT: "abort"}


def start(program, ranks, words, folder, memory=None):
    limit = (lambda: resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))) if memory else None
    return subprocess.Popen(["mpirun", "-n", str(ranks), str(program), *words], cwd=folder, env=environment(max(2, ranks)), text=True,  # for mpirun
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=limit)


def ranks_of(process):
    """Process ids of the ranks that mpirun started."""
    found = []
    for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir():
        found += [int(word) for word in (task / "children").read_text().split()]
    return sorted(found)


def finish(process):
    try:
        said, _ = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.terminate()
        return None, process.communicate()[0]
    return process.returncode, said


def crash(program, number, ranks, victim, words=()):
    """Sends a signal to one rank once the first frames are on disk."""
    with tempfile.TemporaryDirectory(prefix="last_net_") as folder:
        process = start(program, ranks, [*LONG, *words], folder)
        for _ in range(400):
            time.sleep(0.05)
            if (pathlib.Path(folder) / "run.h5md").exists():
                break
        time.sleep(0.3)
        os.kill(ranks_of(process)[victim], number)
        return finish(process)


def check_one_line(code, said, wanted_code, fragment):
    lines = [line for line in said.splitlines() if "backspring: error:" in line]
    if code != wanted_code:
        yield f"exit code {code}, should be {wanted_code}"
    if len(lines) != 1:
        yield f"{len(lines)} lines of error, should be one"
    if not any(fragment in line for line in lines):
        yield f"no {fragment!r} in {lines}"
    for page in ("PETSC ERROR", "terminate called", "Backtrace", "*** Process received signal ***"):
        if page in said:
            yield f"{page!r} came through"


def memory_runs_out(program, ranks):
    with tempfile.TemporaryDirectory(prefix="last_net_") as folder:
        code, said = finish(start(program, ranks, GIANT, folder, 1 << 29))
        return said, list(check_one_line(code, said, 2, "emory"))


def told(program, number, ranks, victim):
    code, said = crash(program, number, ranks, victim)
    return said, list(check_one_line(code, said, 128 + number, CRASHES[number] + " inside the program"))


def traced(program):
    code, said = crash(program, signal.SIGSEGV, 1, 0, ["-bs_trace"])
    return said, [] if code and "PETSC ERROR" in said else [f"exit code {code}, PETSc's page is missing"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=lambda path: pathlib.Path(path).resolve())
    program = parser.parse_args().program
    cases = {f"{CRASHES[number]}": (lambda number=number: told(program, number, 1, 0)) for number in CRASHES}
    cases["segmentation fault of rank 0 of 2"] = lambda: told(program, signal.SIGSEGV, 2, 0)
    cases["segmentation fault of rank 1 of 2"] = lambda: told(program, signal.SIGSEGV, 2, 1)
    cases["-bs_trace shows PETSc's traceback"] = lambda: traced(program)
    cases["memory runs out on 1 rank"] = lambda: memory_runs_out(program, 1)
    cases["memory runs out on 2 ranks"] = lambda: memory_runs_out(program, 2)
    failed = 0
    for name, case in cases.items():
        said, wrong = case()
        print(f"{'FAIL' if wrong else 'ok  '} {name}", flush=True)
        if wrong:
            failed += 1
            print("       " + "\n       ".join(wrong + said.splitlines()[-25:]))
    print(f"{len(cases) - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
