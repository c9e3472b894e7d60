#!/usr/bin/env python3
"""Memory limits from too small to enough: what is refused before it is begun, and what is not.

  memory_sweeps.py --program build/release/backspring [--filter WORD] [--full]

Limits go from what the smallest run takes to 1.15 times the peak of the run itself, which must do. Every run ends within 60 s, with exit
code 0 and all frames, or with one line of error that says "memory" (exit code 2, 3, or 4 where a file could not be written). What is
refused before it is begun must fail without that check, too. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import pathlib
import resource
import sys
import tempfile
import time

import h5py
from limits import CHAIN, CUBE, SLOWER, errors, finish, main, run, start

# Started in a folder with the trajectory l.h5md of a cubic lattice.
SWEEPS = {
    "lattice, 24^3": [*CUBE, "24,24,24"],
    "lattice, 24^3, explicit": [*CUBE, "24,24,24", "-ts_type", "euler", "-ts_dt", "1e-4"],
    "Jacobian, 20^3": [*CUBE, "20,20,20", "-pc_type", "jacobi", "-ksp_type", "gmres"],
    "HDF5": ["-bs_lattice_file", "l.h5md", "-ts_max_steps", "2"],
    "heat 300 x 300": ["-bs_model", "linear", "-bs_linear_type", "heat2d", "-bs_linear_size", "300,300", "-bs_linear_source", "step(1)", "-ts_max_steps", "2"],
}
LONG_SWEEPS = ("lattice, 24^3, explicit", "Jacobian, 20^3")
ULIMITS = {"-v": (resource.RLIMIT_AS, "VmPeak"), "-d": (resource.RLIMIT_DATA, "VmData")}
REFUSED = "of memory"  # in a refusal before the work is begun: "needs at least 118 MB of memory"


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
            if "VmPeak" in status and status.split()[1].startswith("backspring"):
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


def cases(program, full):
    parts = (0.02, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9) if full else (0.02, 0.4)
    for name, words in SWEEPS.items():
        for ranks in (1, 2):
            for option in ULIMITS:
                if full or ((ranks == 1) == (option == "-v") and name not in LONG_SWEEPS):
                    yield f"sweep: {name}, {ranks} rank(s), ulimit {option}", swept(program, ranks, words, option, parts)
    yield "a lattice of 8,000,000,000 particles", giant(program)


if __name__ == "__main__":
    sys.exit(main(cases, __doc__))
