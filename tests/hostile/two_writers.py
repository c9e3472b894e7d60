#!/usr/bin/env python3
"""Two runs that want to write one file: the second ends with exit 2 and names the first; what is written is the first one's.
--shim: the library that makes locks fail."""
import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "faults"))
import h5py
from crashes import children
from runs import BLOCK, content, difference, frames, run, run_parts, start, told

LONG = dict(BLOCK, bs_lattice_size=(4, 4, 4), ts_type="symplectic", ts_dt=1e-3, ts_max_time=1e4, bs_output_interval=0.05)
SHORT = dict(LONG, ts_max_time=1.0)


def wait_for(path, seconds=120):
    end = time.monotonic() + seconds
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.02)
    return path.exists()


def end(process):
    """Waits for a run that was told to end; one that does not is killed."""
    try:
        return process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.communicate()


def refused(checks, name, folder, options, owner, ranks=1):
    code, _, err = run(checks, folder, options, ranks)
    lines = told(err)
    good = code == 2 and len(lines) == 1 and any(f"process {pid} on host {socket.gethostname()}" in lines[0] for pid in owner)
    checks.true(f"{name}, {ranks} rank(s): exit 2, one line with host and process", good, f"exit {code}: {' '.join(lines)[:160]}")


def one_after_the_other(checks, folder):
    (folder / "sub").mkdir()
    (folder / "way").symlink_to(folder)
    for ranks in (1, 2):
        for old in (*folder.glob("o.h5md*"), *folder.glob("ck*")):
            old.unlink()
        first = start(checks, folder, dict(LONG, bs_output="o.h5md", bs_checkpoint="ck", bs_report="r.json", bs_write_matrices="m", bs_overwrite=True), ranks)
        owner = []
        try:
            there = wait_for(folder / "o.h5md")
            owner = [first.pid] if ranks == 1 else children(first.pid, pathlib.Path(checks.program).name)
            checks.true(f"first run on {ranks} rank(s) writes", there and len(owner) == ranks, f"{owner}")
            refused(checks, f"the same output, without -bs_overwrite ({ranks})", folder, dict(SHORT, bs_output="o.h5md"), owner)
            for name, options in (("the same output", {"bs_output": "o.h5md"}), ("./ before it", {"bs_output": "./o.h5md"}),
                                  ("by another way", {"bs_output": "way/sub/../o.h5md"}), ("the same checkpoint", {"bs_checkpoint": "ck"}),
                                  ("the same report", {"bs_report": "r.json"}), ("its output as a report", {"bs_report": "o.h5md"}),
                                  ("the checkpoint before its checkpoint", {"bs_checkpoint": "ck.previous"}), ("its lock", {"bs_output": "o.h5md.lock"}),
                                  ("its sidecar, by another way", {"bs_report": "way/o.h5md.xdmf"}), ("its checkpoint as one before", {"bs_checkpoint": "way/ck.previous"}),
                                  ("one of its matrices", {"bs_report": "./m_K.mtx"}), ("its matrices", {"bs_write_matrices": "m"})):
                for again in ((1, 3) if name == "the same output" else (1,)):
                    refused(checks, f"{name} ({ranks})", folder, dict(SHORT, bs_overwrite=True, **options), owner, again)
            for _ in range(3):  # HDF5 itself asks for a lock: it gets it
                try:
                    held = frames(folder / "o.h5md")
                    break
                except OSError:
                    time.sleep(0.1)
                    held = 0
            checks.true(f"the trajectory can be read meanwhile ({ranks})", held > 0, f"{held} frames")
        finally:
            for pid in owner:
                os.kill(pid, signal.SIGTERM)
            end(first)
        checks.true(f"nothing is left of the lock at the end ({ranks})", not list(folder.glob("*.lock")) and frames(folder / "o.h5md") > 1, str(list(folder.glob("*.lock"))))


def derived(checks, folder):
    """A name that this run makes of its own ones and another run was given."""
    first = start(checks, folder, dict(LONG, bs_output="a.xdmf", bs_report="b.previous", bs_checkpoint="c_D.mtx"))
    there = wait_for(folder / "a.xdmf")
    for name, options in (("its sidecar", {"bs_output": "a"}), ("its checkpoint before", {"bs_checkpoint": "b"}), ("its matrices", {"bs_write_matrices": "c"})):
        refused(checks, f"{name} is what another run writes", folder, dict(SHORT, bs_overwrite=True, **options), [first.pid])
    code, _, err = run(checks, folder, dict(SHORT, bs_output="d", bs_checkpoint="./d.checkpoint", bs_report="./d.checkpoint.report", bs_write_matrices="./d"))
    checks.true("names of one run that look like made ones", there and code == 0, f"exit {code}: {err.strip()[:160]}")
    first.send_signal(signal.SIGTERM)
    end(first)


def killed(checks, folder):
    first = start(checks, folder, dict(LONG, bs_output="o.h5md"))
    there = wait_for(folder / "o.h5md")
    first.kill()
    first.communicate()
    checks.true("a killed run leaves its lock file", there and (folder / "o.h5md.lock").exists())
    code, _, err = run(checks, folder, dict(SHORT, bs_output="o.h5md", bs_overwrite=True))
    checks.true("which hinders nobody, and is cleared away", code == 0 and not (folder / "o.h5md.lock").exists(), f"exit {code} {err.strip()[:100]}")


def at_once(checks, folder):
    code, _, err = run(checks, folder, dict(SHORT, bs_output="full.h5md"))
    checks.true("undisturbed", code == 0, err.strip()[:100])
    both_ended, right, rounds = 0, 0, 4
    for k in range(rounds):
        options = dict(SHORT, bs_output=f"o{k}.h5md")
        pair = [start(checks, folder, options) for _ in range(3)]
        said = [p.communicate(timeout=120) for p in pair]
        codes = sorted(p.returncode for p in pair)
        both_ended += codes == [0, 2, 2] and all(len(told(err)) == 1 for p, (_, err) in zip(pair, said) if p.returncode)
        right += difference(folder / "full.h5md", folder / f"o{k}.h5md")[1]
    checks.true(f"three at once, {rounds} times: one writes, two end with 2", both_ended == rounds, f"{both_ended} times")
    checks.true("and what it wrote is the undisturbed run's, in every bit", right == rounds, f"{right} times")
    checks.true("nothing temporary is left", not list(folder.glob("*.tmp")) and not list(folder.glob("*.lock")))


def restarts(checks, folder):
    code, _, err = run(checks, folder, dict(SHORT, bs_output="o.h5md", bs_checkpoint="ck"))
    checks.true("first part", code == 0, err.strip()[:100])
    again = {"bs_restart": "ck", "ts_max_time": 1e4}
    first = start(checks, folder, again)
    there = wait_for(folder / "o.h5md.lock") and wait_for(folder / "ck.lock")
    checks.true("the checkpoint is continued", there)
    for ranks in (1, 2):
        refused(checks, "a second restart of the checkpoint", folder, again, [first.pid], ranks)
    code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 1.2, "bs_output": "mine.h5md", "bs_checkpoint": "mine.ck"})
    checks.true("one that writes elsewhere goes on", code == 0, err.strip()[:100])
    first.send_signal(signal.SIGTERM)
    end(first)
    held = content(folder / "o.h5md")
    checks.true("the frames are those of one run", (held["time"][1:] > held["time"][:-1]).all() and first.returncode == 143, f"exit {first.returncode}")


def no_locks(checks, folder, shim):
    extra = {"LD_PRELOAD": shim, "BS_NO_LOCKS": "1"}
    code, _, err = run(checks, folder, dict(SHORT, bs_output="o.h5md"), extra=extra)
    checks.true("a file system without locks: the run says so and goes on", code == 0 and "has no locks" in err, err.strip()[:160])
    first = start(checks, folder, dict(LONG, bs_output="p.h5md"), extra=extra)
    wait_for(folder / "p.h5md")
    code, _, err = run(checks, folder, dict(SHORT, bs_output="p.h5md", bs_overwrite=True), extra=extra)
    checks.true("and still notices a run on the same host", code == 2 and f"process {first.pid}" in err, err.strip()[:160])
    first.kill()
    first.communicate()


if __name__ == "__main__":
    run_parts(__doc__, (one_after_the_other, derived, killed, at_once, restarts, no_locks), library="--shim", with_library=(no_locks,))
