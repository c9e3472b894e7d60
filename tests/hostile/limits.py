#!/usr/bin/env python3
"""Limits of the machine: memory that runs out at any point, names of files up to the system's longest, signals sent twice.

  limits.py --program build/release/backspring [--filter WORD] [--full]

Asked for under a memory limit: an end within 60 s; exit code 0, or 2 or 3 (4 where output is asked for) with exactly one line of error, which says
"memory". --full tries 24 limits for each run in the place of 3. Sweeps go from what the smallest run takes to 1.15 times the peak of the
run itself, which must do; what is refused before it is begun must fail without that check, too. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
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

import h5py

SLOWER = int(os.environ.get("BS_SLOWER", 1))
CHAIN = ["-bs_lattice_type", "chain", "-bs_lattice_size", "5", "-ts_max_steps", "2"]
CUBE = ["-bs_lattice_type", "cubic", "-bs_lattice_perturbation", "0.1", "-ts_max_steps", "2", "-bs_lattice_size"]
# What is held is different: block factors and BLAS, MUMPS on S, PETSc's LU on J, MUMPS and its orderings on a linear system.
RUNS = {
    "condensed, 24^3": [*CUBE, "24,24,24"],
    "direct, 12^3": [*CUBE, "12,12,12"],
    "PETSc's LU, 8^3": [*CUBE, "8,8,8", "-pc_type", "lu", "-ksp_type", "preonly"],
    "heat 200 x 200": ["-bs_model", "linear", "-bs_linear_type", "heat2d", "-bs_linear_size", "200,200", "-bs_linear_source", "step(1)", "-ts_max_steps", "2"],
}
LIMITS = {"short": [100_000, 163_840, 180_000], "full": list(range(60_000, 290_000, 10_000)) + [163_840]}  # [kB] of data a process may have


# Started in a folder with the trajectory l.h5md of a cubic lattice.
SWEEPS = {
    "lattice, 24^3": [*CUBE, "24,24,24"],
    "lattice, 24^3, explicit": [*CUBE, "24,24,24", "-ts_type", "euler", "-ts_dt", "1e-4"],
    "Jacobian, 20^3": [*CUBE, "20,20,20", "-pc_type", "jacobi", "-ksp_type", "gmres"],
    "HDF5": ["-bs_lattice_file", "l.h5md", "-ts_max_steps", "2"],
    "heat 250 x 250": ["-bs_model", "linear", "-bs_linear_type", "heat2d", "-bs_linear_size", "250,250", "-bs_linear_source", "step(1)", "-ts_max_steps", "2"],
}
LONG_SWEEPS = ("lattice, 24^3, explicit", "Jacobian, 20^3")
ULIMITS = {"-v": (resource.RLIMIT_AS, "VmPeak"), "-d": (resource.RLIMIT_DATA, "VmData")}
REFUSED = "of memory"  # in a refusal before the work is begun: "needs at least 118 MB of memory"


def start(program, ranks, words, folder, memory=None, kind=resource.RLIMIT_DATA):
    environment = dict(os.environ, OMPI_MCA_rmaps_base_oversubscribe="1", OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1",
                       OMPI_MCA_hwloc_base_binding_policy="none")
    if os.geteuid() == 0:
        environment.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    limit = (lambda: resource.setrlimit(kind, (memory, memory))) if memory else None
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    return subprocess.Popen([*launcher, str(program), *map(str, words)], cwd=folder, env=environment, text=True, errors="replace",
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


def peaks(program, ranks, words, folder):
    """The most memory that a rank of a run without limits takes [bytes], as ulimit -v and -d count it."""
    process, most = start(program, ranks, words, folder), dict.fromkeys(ULIMITS, 0)
    while process.poll() is None:
        children = [path.read_text().split() for path in pathlib.Path(f"/proc/{process.pid}/task").glob("*/children")] if ranks > 1 else [[process.pid]]
        for number in sum(children, []):
            try:
                status = pathlib.Path(f"/proc/{number}/status").read_text()
            except OSError:
                continue
            if "VmPeak" in status and status.split()[1].startswith("backspring"[:15]):
                for option, (_, name) in ULIMITS.items():
                    most[option] = max(most[option], 1024 * int(status.split(name + ":")[1].split()[0]))
        time.sleep(0.002)
    return most, finish(process)


def frames_of(trajectory):
    """Frames of a trajectory; 0 where there is none that opens."""
    try:
        with h5py.File(trajectory) as file:
            return len(file["particles/trajectory/position/time"])
    except (OSError, KeyError):
        return 0


def one_limit(program, ranks, words, folder, option, limit, whole, seen):
    """What is wrong with a run under one limit, whose trajectory would have `whole` frames; counts refusals before the work in seen[0]."""
    trajectory = folder / "o.h5md"
    words = [*words, "-bs_output", trajectory, "-bs_progress_interval", "0"]
    code, said = run(program, ranks, words, folder, limit, ULIMITS[option][0])
    name = f"ulimit {option} {limit // 1024}"
    if code not in (0, 2, 3, 4):
        yield f"{name}: " + (f"exit code {code}" if code is not None else "did not end within 60 s"), said
    elif code and (len(errors(said)) != 1 or "memory" not in errors(said)[0]):
        yield f"{name}: exit code {code}, lines of error: {[line[:300] for line in errors(said)]}", said
    elif "PETSC ERROR" in said:
        yield f"{name}: a PETSc error came through", said
    elif ("backspring: ok" in said) != (code == 0) or (code == 0 and frames_of(trajectory) != whole):
        yield f"{name}: exit code {code} and {frames_of(trajectory)} frames of {whole}", said
    trajectory.unlink(missing_ok=True)
    if code and any(REFUSED in line for line in errors(said)):
        seen[0] += 1
        again, without = run(program, ranks, [*words, "-bs_memory_check", "false"], folder, limit, ULIMITS[option][0])
        trajectory.unlink(missing_ok=True)
        if again == 0:
            yield f"{name}: refused, and went well without the check: {errors(said)[0][:200]}", without


def swept(program, ranks, words, option, parts):
    with tempfile.TemporaryDirectory(prefix="hostile_") as name:
        folder, seen = pathlib.Path(name), [0]
        if "l.h5md" in words:
            code, said = run(program, 1, [*CUBE, "24,24,24", "-ts_type", "euler", "-bs_output", "l.h5md"], folder)
            if code:
                yield f"the lattice to read: exit code {code}", said
                return
        least, _ = peaks(program, ranks, CHAIN, folder)
        most, (code, said) = peaks(program, ranks, [*words, "-bs_output", "o.h5md"], folder)
        whole = frames_of(folder / "o.h5md")
        (folder / "o.h5md").unlink(missing_ok=True)
        if code or most[option] <= least[option]:
            yield f"without a limit: exit code {code}, peaks {least} and {most}", said
            return
        for part in parts:
            limit = int(least[option] + part * (most[option] - least[option]))
            yield from one_limit(program, ranks, words, folder, option, limit, whole, seen)
        code, said = run(program, ranks, words, folder, int(1.15 * most[option]), ULIMITS[option][0])
        if code:
            yield f"ulimit {option} {int(1.15 * most[option]) // 1024}, 1.15 times the peak: exit code {code}", said
        if not seen[0]:
            yield "nothing was refused before it was begun", ""


def giant(program):
    """What cannot be is said at once, not when memory has run out."""
    words = [*CUBE[:2], "-bs_lattice_size", "2000,2000,2000"]
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        began = time.monotonic()
        code, said = run(program, 1, words, folder)
        if code != 2 or len(errors(said)) != 1 or "TB of memory" not in errors(said)[0] or time.monotonic() - began > 5 * SLOWER:
            yield f"exit code {code} after {time.monotonic() - began:.1f} s", said


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


def twice(program, number):
    """A second signal half a second after the first, while a factorisation of many seconds is under way."""
    words = [*CUBE, "12,12,12", "-pc_type", "lu", "-ksp_type", "preonly", "-ts_max_time", "1e9", "-bs_progress_interval", "0"]
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        process = start(program, 1, words, folder)
        time.sleep(1.5 * SLOWER)
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
    words = [*CHAIN[:4], "-ts_dt", "1e-4", "-ts_max_time", "1e6"]
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        process = start(program, 1, words, folder)
        time.sleep(1.5 * SLOWER)
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
    parts = (0.02, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9) if full else (0.02, 0.4)
    for name, words in SWEEPS.items():
        for ranks in (1, 2):
            for option in ULIMITS:
                if full or ((ranks == 1) == (option == "-v") and name not in LONG_SWEEPS):
                    yield f"sweep: {name}, {ranks} rank(s), ulimit {option}", swept(program, ranks, words, option, parts)
    yield "a lattice of 8,000,000,000 particles", giant(program)
    for length in (240, 256, 1000, 4000):
        for ranks in (1, 2):
            if full or ranks == 1 or length == 256:
                yield f"names of {length} characters, {ranks} rank(s)", long_names(program, ranks, length)
    for option in ("-bs_output", "-bs_checkpoint", "-bs_report", "-bs_lattice_file", "-bs_restart", "-options_file"):
        yield f"name of 5055 characters, {option}", too_long(program, option)
    for number in (signal.SIGTERM, signal.SIGINT):
        yield f"a second {number.name} ends at once", twice(program, number)
    yield "SIGTERM sent double is one, and ends the run as stopped", sent_double(program)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
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
    sys.exit(main())
