#!/usr/bin/env python3
"""What a run leaves behind and says at its end: the log of steps, old checkpoints, the name of a singular law.

  leftovers.py --program build/release/backspring
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import h5py  # noqa: E402
from harness import Checks, write_lattice  # noqa: E402
from program import environment, words  # noqa: E402

SPRING = {"bs_lattice_type": "chain", "bs_lattice_size": 2, "bs_lattice_perturbation": 0.1, "ts_type": "symplectic", "ts_dt": 1e-3}


def start(checks, folder, options, ranks=1, **keywords):
    command = [checks.program, *words(options)]
    return (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + command, dict(cwd=folder, env=environment(ranks), text=True, **keywords)


def finish(checks, folder, options, ranks=1):
    command, how = start(checks, folder, options, ranks, capture_output=True, timeout=120)
    return subprocess.run(command, **how)


def check_log(checks, folder):
    """Killed long before its second frame, a run has its rows in the file but for the last 4096 or the last two seconds."""
    command, how = start(checks, folder, {**SPRING, "ts_max_time": 1e6, "bs_output": "o.h5md", "bs_output_interval": 1e6,
                                          "bs_progress_interval": 0}, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    run = subprocess.Popen(command, **how)
    steps = 0
    for line in run.stdout:
        if line.startswith("t = "):
            steps = int(line.split("step ")[1].split(",")[0])
        if steps >= 20000:
            break
    run.kill()
    run.wait()
    with h5py.File(folder / "o.h5md") as f:
        rows = f["backspring/log/step"][...]
        frames = len(f["particles/trajectory/position/value"])
        checks.true("the log is written by size", len(rows) >= steps - 4096 and list(rows) == list(range(1, len(rows) + 1)) and frames == 1,
                    f"{len(rows)} rows of {steps} steps seen, {frames} frame")
    # a step every few milliseconds: time comes first
    slow = {"bs_lattice_type": "cubic", "bs_lattice_size": 24, "bs_lattice_perturbation": 0.05, "ts_type": "symplectic", "ts_dt": 1e-3}
    for ranks in (1, 2):
        command, how = start(checks, folder, {**slow, "ts_max_time": 1e6, "bs_output": f"slow{ranks}.h5md", "bs_output_interval": 1e6,
                                              "bs_progress_interval": -1}, ranks, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        run = subprocess.Popen(command, **how)
        found, deadline = 0, time.time() + 60
        while not found and time.time() < deadline:
            time.sleep(1)
            try:
                copy = folder / "copy.h5md"
                shutil.copyfile(folder / f"slow{ranks}.h5md", copy)
                with h5py.File(copy) as f:
                    found = len(f["backspring/log/step"])
            except (OSError, KeyError):
                continue
        run.terminate()
        run.wait()
        checks.true(f"the log is written by time, {ranks} ranks", 0 < found < 100000, f"{found} rows")


def wait_for_ranks(word, limit=60):
    """Ranks outlive a killed mpirun for a while, and go on writing: returns when no process has `word` on its command line."""
    def alive():
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                if word.encode() in (entry / "cmdline").read_bytes().split(b"\0"):
                    return True
            except OSError:
                continue  # it has ended meanwhile
        return False
    end = time.monotonic() + limit
    while alive():
        if time.monotonic() > end:
            raise TimeoutError(f"processes with {word} on their command line do not end")
        time.sleep(0.05)


def last_frame(path):
    with h5py.File(path) as f:
        return f["particles/trajectory/position/time"][-1], len(f["particles/trajectory/position/time"])


def last_frame_so_far(path):
    """Of a run that goes on, which may be writing: what was flushed can be read as soon as it has done so."""
    for _ in range(50):
        try:
            return last_frame(path)
        except OSError:
            time.sleep(0.1)
    return last_frame(path)


def check_flush(checks, folder):
    """Killed, a run has the frames it told of more than -bs_output_flush seconds ago, with 0 all that it told of; a signal flushes."""
    base = {**SPRING, "ts_dt": 1e-3, "ts_max_time": 1e5, "bs_output_interval": 0.05, "bs_progress_interval": 0, "bs_overwrite": True}
    for flush, after in ((0, 1.5), (None, 5), (0.5, 2.5)):
        for ranks in (1, 2):
            name = f"f_{flush}_{ranks}.h5md"  # its own: ranks outlive a killed mpirun for a while, and hold their file
            options = {**base, "bs_output": name, **({} if flush is None else {"bs_output_flush": flush})}
            command, how = start(checks, folder, options, ranks, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=1)
            run = subprocess.Popen(command, **how)
            told, begun = [], None
            for line in run.stdout:
                if not line.startswith("t = "):
                    continue
                now = time.monotonic()
                begun = begun or now
                told.append((now, float(line.split()[2])))
                if now - begun > after and told[-1][1] > 0.2:
                    break
            run.kill()
            run.wait()
            wait_for_ranks(name)
            held, count = last_frame(folder / name)
            # a line is printed before the frame of its step is written: that of the last line may be under way
            wait = (2 if flush is None else flush) + 0.5 * (flush != 0)
            due = [t for when, t in told[:-1] if when < told[-1][0] - wait]
            checks.true(f"flush {flush}, {ranks} ranks: frames up to t = {held:.3f} are there", count > 2 and held >= due[-1] - 0.0511,
                        f"{count} frames, {due[-1]:.3f} was told {wait} s before the kill")
    quick = {**base, "bs_output": "s.h5md", "bs_progress_interval": -1, "bs_output_flush": 1e6, "bs_checkpoint": "s.ck"}
    command, how = start(checks, folder, quick, 1, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    run = subprocess.Popen(command, **how)
    while not (folder / "s.h5md").exists() and run.poll() is None:
        time.sleep(0.05)
    time.sleep(0.5)
    before = last_frame_so_far(folder / "s.h5md")[1]
    run.send_signal(signal.SIGUSR1)  # a checkpoint, and the run goes on
    while not (folder / "s.ck").exists() and run.poll() is None:
        time.sleep(0.05)
    at_checkpoint = last_frame_so_far(folder / "s.h5md")[1]
    with h5py.File(folder / "s.ck") as f:
        marked = int(f["run"].attrs["frames"])
    checks.true("a checkpoint counts no frame that is not written", before <= marked <= at_checkpoint, f"{before} {marked} {at_checkpoint}")
    run.terminate()
    run.wait()
    checks.true("a signal flushes", last_frame(folder / "s.h5md")[1] > at_checkpoint, f"{last_frame(folder / 's.h5md')} after {at_checkpoint}")


def check_checkpoints(checks, folder):
    """A failed run's checkpoint goes when a later run overwrites the trajectory and succeeds; another's stays."""
    position = [[0.0, 0.0], [1.0, 0.0]]
    write_lattice(folder / "l.h5", position, 1.0, velocity=[[0, 0], [0.0, 5.0]], pairs=[[0, 1]], stiffness=1.0, rest_length=1.0)
    good = {"bs_lattice_file": "l.h5", "bs_output": "o.h5md", "ts_dt": 0.01, "ts_max_time": 0.05}
    bad = {**good, "ts_dt": 1.0, "ts_max_time": 2.0, "snes_max_it": 1, "snes_rtol": 1e-14, "snes_stol": 0, "bs_step_max_cuts": 0, "bs_overwrite": True}
    left = folder / "o.h5md.checkpoint"
    for ranks in (1, 2):
        for _ in range(2):
            done = finish(checks, folder, bad, ranks)
        checks.true(f"a failed run leaves a checkpoint, {ranks} ranks", left.exists() and (folder / "o.h5md.checkpoint.previous").exists(),
                    done.stderr.strip()[-100:])
        done = finish(checks, folder, {**good, "bs_overwrite": True}, ranks)
        checks.true(f"a later run that succeeds removes it, {ranks} ranks", done.returncode == 0 and not left.exists()
                    and not (folder / "o.h5md.checkpoint.previous").exists(), done.stderr.strip()[-100:])
    finish(checks, folder, bad)
    for name, code, put in (("of another trajectory", 0, lambda: (shutil.copy(left, folder / "mine"), shutil.copy(folder / "mine", folder / "p.h5md.checkpoint"))),
                      ("that is no checkpoint", 2, lambda: (folder / "p.h5md.checkpoint").write_text("notes")),
                      ("that is a link", 2, lambda: ((folder / "p.h5md.checkpoint").unlink(), os.symlink("mine", folder / "p.h5md.checkpoint"))),):
        put()
        done = finish(checks, folder, {**good, "bs_output": "p.h5md", "bs_overwrite": True})
        checks.true(f"a file {name} stays", done.returncode == code and os.path.lexists(folder / "p.h5md.checkpoint"), done.stderr.strip()[-100:])
    done = finish(checks, folder, {**good, "bs_overwrite": True, "bs_checkpoint": "o.h5md.checkpoint"})
    checks.true("the checkpoint that was asked for stays", done.returncode == 0 and left.exists(), done.stderr.strip()[-100:])


def check_words(checks, folder):
    """A singular law is named; that nothing is written is said."""
    write_lattice(folder / "fall.h5", [[0.0, 0.0], [3.0, 0.0]], 1.0)
    for ranks in (1, 2):
        done = finish(checks, folder, {"bs_lattice_file": "fall.h5", "bs_central_M0": 1.0, "bs_central_G": 1.0, "ts_max_steps": 3}, ranks)
        said = [line for line in done.stderr.splitlines() if line.startswith("backspring: error")]
        checks.true(f"central gravity is named, {ranks} ranks", done.returncode != 0 and len(said) == 1 and "particle 0" in said[0]
                    and "central gravity has no value there: lower -ts_dt, or keep the particle away from -bs_central_point" in said[0]
                    and "rest length" not in said[0], str(said))
    for options, expected in ((SPRING, True), ({**SPRING, "bs_output": "w.h5md"}, False)):
        done = finish(checks, folder, {**options, "ts_max_steps": 3})
        checks.true(f"that nothing is written is {'' if expected else 'not '}said", ("no trajectory is written: give -bs_output" in done.stdout) == expected)


def main():
    checks = Checks(__doc__.splitlines()[0])
    for name, check in (("log", check_log), ("flush", check_flush), ("checkpoints", check_checkpoints), ("words", check_words)):
        if checks.wants(name):
            with checks.group(name), tempfile.TemporaryDirectory() as folder:
                check(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
