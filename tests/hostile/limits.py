#!/usr/bin/env python3
"""Limits of the machine: memory that runs out at any point, names of files up to the system's longest, signals sent twice.

  limits.py --program build/release/backspring [--filter WORD] [--full]

Asked for under a memory limit: an end within 60 s; exit code 0, or 2 or 3 with exactly one line of error, which says
"memory". --full tries 24 limits for each run in the place of 3. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
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

SLOWER = int(os.environ.get("BS_SLOWER", 1))
CHAIN = ["-bs_lattice_type", "chain", "-bs_lattice_size", "5", "-ts_max_steps", "2"]
CUBE = ["-bs_lattice_type", "cubic", "-bs_lattice_perturbation", "0.1", "-ts_max_steps", "2", "-bs_lattice_size"]
# What is held is different: block factors and BLAS, a large coarse grid, MUMPS on S, PETSc's LU on J, MUMPS and its orderings on a linear system.
RUNS = {
    "condensed, 24^3": [*CUBE, "24,24,24"],
    "coarse grid of 17,496 unknowns": [*CUBE, "24,24,24", "-condensed_pc_bicc_coarse", "20000"],
    "direct, 12^3": [*CUBE, "12,12,12"],
    "PETSc's LU, 8^3": [*CUBE, "8,8,8", "-pc_type", "lu", "-ksp_type", "preonly"],
    "heat 200 x 200": ["-bs_model", "linear", "-bs_linear_type", "heat2d", "-bs_linear_size", "200,200", "-bs_linear_source", "step(1)", "-ts_max_steps", "2"],
}
LIMITS = {"short": [100_000, 163_840, 180_000], "full": list(range(60_000, 290_000, 10_000)) + [163_840]}  # [kB] of data a process may have


def start(program, ranks, words, folder, memory=None, kind=resource.RLIMIT_DATA):
    limit = (lambda: resource.setrlimit(kind, (memory, memory))) if memory else None
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    return subprocess.Popen([*launcher, str(program), *map(str, words)], cwd=folder, env=environment(ranks), text=True, errors="replace",
                            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=limit)


def finish(process, seconds=60):
    try:
        said, _ = process.communicate(timeout=seconds * SLOWER)
    except subprocess.TimeoutExpired:
        process.kill()
        return None, process.communicate()[0]
    return process.returncode, said


def run(program, ranks, words, folder, memory=None, kind=resource.RLIMIT_DATA):
    return finish(start(program, ranks, words, folder, memory, kind))


def errors(said):
    return [line for line in said.splitlines() if "backspring: error:" in line]


def under_limit(program, ranks, words, kilobytes):
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        code, said = run(program, ranks, words, folder, kilobytes * 1024)
    if code not in (0, 2, 3):
        yield f"exit code {code}" if code is not None else "did not end within 60 s", said
    elif code and (len(errors(said)) != 1 or "memory" not in errors(said)[0]):
        yield f"exit code {code}, lines of error: {[line[:300] for line in errors(said)]}", said
    elif "PETSC ERROR" in said:
        yield "a PETSc error came through", said


def long_names(program, ranks, length):
    """A trajectory, a checkpoint and a continued run whose absolute names have `length` characters."""
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        deep = pathlib.Path(folder)
        while len(str(deep)) < length - 12:
            deep /= "d" * max(1, min(100, length - 12 - len(str(deep)) - 1))
        deep.mkdir(parents=True)
        trajectory, checkpoint = deep / "t.h5md", deep / "c"
        code, said = run(program, ranks, [*CHAIN, "-bs_output", trajectory, "-bs_checkpoint", checkpoint, "-bs_report", deep / "r"], folder)
        if code != 0 or not trajectory.exists() or not checkpoint.exists():
            yield f"{len(str(trajectory))} characters: exit code {code}", said
        for words in (["-bs_restart", checkpoint, "-ts_max_steps", "4"], ["-bs_lattice_file", trajectory, "-ts_max_steps", "1"]):
            code, said = run(program, ranks, words, folder)
            if code != 0:
                yield f"{words[0]} of {len(str(words[1]))} characters: exit code {code}", said


def too_long(program, option):
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        code, said = run(program, 1, [*CHAIN, option, "/" + "/".join(["d" * 100] * 50) + "/f.h5"], folder)
        if code != 2 or len(errors(said)) != 1:
            yield f"exit code {code}, {len(errors(said))} lines of error", said


def wait_for_handler(process, number, seconds=30):
    """Until the program handles the signal (a busy machine may take seconds to start it), and a moment into its steps."""
    end = time.monotonic() + seconds * SLOWER
    while process.poll() is None and time.monotonic() < end:
        caught = [line for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines() if line.startswith("SigCgt")]
        if caught and int(caught[0].split()[1], 16) >> (number - 1) & 1:
            break
        time.sleep(0.05)
    time.sleep(1.5 * SLOWER)


def twice(program, number):
    """A second signal half a second after the first, while a factorisation of many seconds is under way."""
    words = [*CUBE, "12,12,12", "-pc_type", "lu", "-ksp_type", "preonly", "-ts_max_time", "1e6", "-bs_progress_interval", "0"]
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        process = start(program, 1, words, folder)
        wait_for_handler(process, number)
        process.send_signal(number)
        time.sleep(0.5)
        early = process.poll()
        process.send_signal(number)
        began = time.monotonic()
        code, said = finish(process)
        if early is not None or code != 128 + number or time.monotonic() - began > 1 or "a second signal" not in said:
            yield f"exit code {code} (before the second one: {early}) after {time.monotonic() - began:.1f} s", said


def sent_double(program):
    """timeout(1) signals a process and its group at once: that is one signal, and the present step is finished."""
    words = [*CHAIN[:4], "-ts_dt", "1e-4", "-ts_max_time", "1e5"]
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        process = start(program, 1, words, folder)
        wait_for_handler(process, signal.SIGTERM)
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGTERM)
        code, said = finish(process)
        if code != 143 or not said.splitlines()[-1].startswith("backspring: stopped t="):
            yield f"exit code {code}", said


def cases(program, full):
    for name, words in RUNS.items():
        for ranks in (1, 2):
            for kilobytes in LIMITS["full" if full else "short"]:
                if full or ranks == 1 or kilobytes == 180_000:
                    yield f"memory: {name}, {ranks} rank(s), {kilobytes} kB", under_limit(program, ranks, words, kilobytes)
    for length in (240, 256, 1000, 4000):
        for ranks in (1, 2):
            if full or ranks == 1 or length == 256:
                yield f"names of {length} characters, {ranks} rank(s)", long_names(program, ranks, length)
    for option in ("-bs_output", "-bs_checkpoint", "-bs_report", "-bs_lattice_file", "-bs_restart", "-options_file"):
        yield f"name of 5055 characters, {option}", too_long(program, option)
    for number in (signal.SIGTERM, signal.SIGINT):
        yield f"a second {number.name} ends at once", twice(program, number)
    yield "SIGTERM sent double is one, and ends the run as stopped", sent_double(program)


def main(cases, about):
    """Runs the cases that the command line asks for; cases(program, full) gives names and checks."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("--program", required=True, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--filter", default="")
    parser.add_argument("--full", action="store_true")
    arguments = parser.parse_args()
    count = failed = 0
    for name, check in cases(arguments.program, arguments.full):
        if arguments.filter not in name:
            continue
        wrong = list(check)
        count += 1
        failed += bool(wrong)
        print(f"{'FAIL' if wrong else 'ok  '} {name}", flush=True)
        for what, said in wrong:
            print("       " + "\n       ".join([what, *[line[:300] for line in said.splitlines()[-8:]]]))
    print(f"{count - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed or not count else 0


if __name__ == "__main__":
    sys.exit(main(cases, __doc__))
