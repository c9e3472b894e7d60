"""Runs the points of a study, each in its own folder, several at a time; a finished point is never run again.

A folder holds command.sh (the exact command line), output.txt (both streams), run.h5md, report.json and, once the run
has ended of its own accord, point.json with the verdict.
"""
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor, as_completed

VERDICT = "point.json"
STOPPED = (130, 143, -signal.SIGINT, -signal.SIGTERM, -signal.SIGKILL, 137)  # not the point's fault: run it again


def command(point, folder, program, use_mpirun):
    """The words of the point's command line; files of the run go to `folder`."""
    words = ["mpirun", "-n", str(point.ranks)] if use_mpirun else []
    return words + [program] + point.options + ["-bs_output", os.path.join(folder, "run.h5md"),
                                                "-bs_report", os.path.join(folder, "report.json")]


def environment(jobs, ranks):
    """One thread a rank; Open MPI binds every job's first rank to the same core unless told not to. (PRTE: Open MPI from 5 on.)"""
    env = {k: v for k, v in os.environ.items() if k != "PETSC_OPTIONS"}  # it would act behind the command line's back
    env.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    if jobs > 1:
        env.update(OMPI_MCA_hwloc_base_binding_policy="none", PRTE_MCA_hwloc_default_binding_policy="none")
    if ranks > (os.cpu_count() or 1):
        env.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")
        env.setdefault("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
    return env


def verdict(folder):
    """The verdict of a point that has ended, or None."""
    try:
        with open(os.path.join(folder, VERDICT), encoding="utf-8") as f:
            return json.load(f)
    except (OSError, ValueError):
        return None


def reason_of(said):
    """The line of a failed run's output that tells why."""
    lines = [line.strip() for line in said.splitlines() if line.strip(" -*=\t")]
    for line in reversed(lines):
        if line.startswith("backspring: ") and not line.startswith("backspring: ok"):
            return line.removeprefix("backspring: ").removeprefix("error: ")
    refused = [line for line in lines if line.startswith(("mpirun ", "There are not enough slots"))]
    return (refused or lines[-1:] or ["it said nothing"])[0]


def write_whole(path, text):
    with open(path + ".part", "w", encoding="utf-8") as f:
        f.write(text)
    os.replace(path + ".part", path)


class Runner:
    """Runs points and tells of each; stop() ends what is running, and nothing of that counts as finished."""

    def __init__(self, study, program, jobs=1, timeout=None, retry=False, use_mpirun=False, tell=print):
        self.study, self.program, self.jobs, self.timeout, self.retry = study, program, jobs, timeout, retry
        self.use_mpirun, self.tell = use_mpirun, tell
        self.lock, self.running, self.stopping = threading.Lock(), set(), False

    def folder(self, point):
        return os.path.join(self.study, point.name)

    def pending(self, points):
        """The points that are still to be run."""
        left = []
        for point in points:
            found = verdict(self.folder(point))
            if found is None or (self.retry and found["status"] != "ok"):
                left.append(point)
        return left

    def run(self, points):
        """Runs what is pending among `points`."""
        todo = self.pending(points)
        if len(todo) < len(points):
            self.tell(f"{len(points) - len(todo)} of {len(points)} points are finished, {len(todo)} to run")
        start, done = time.monotonic(), 0
        with ThreadPoolExecutor(self.jobs) as pool:
            futures = {pool.submit(self._one, point): point for point in todo}
            try:
                for future in as_completed(futures):
                    found, done = future.result(), done + 1
                    left = (time.monotonic() - start) / done * (len(todo) - done)
                    note = f"{found['seconds']:.1f} s" if found["status"] == "ok" else found["reason"]
                    self.tell(f"[{done:{len(str(len(todo)))}}/{len(todo)}] {found['status']:6} {futures[future].label()}: {note}"
                              + (f"; {_clock(left)} left" if done < len(todo) else ""))
            except BaseException:
                self.stop()
                for future in futures:
                    future.cancel()
                raise

    def stop(self):
        with self.lock:
            self.stopping = True
            for process in self.running:
                process.terminate()

    def _one(self, point):
        folder = self.folder(point)
        if os.path.isdir(folder):
            shutil.rmtree(folder)
        os.makedirs(folder)
        words = command(point, folder, self.program, self.use_mpirun)
        script = os.path.join(folder, "command.sh")
        with open(script, "w", encoding="utf-8") as f:
            f.write(f"#!/bin/sh\ncd {shlex.quote(os.getcwd())} &&\nexec {shlex.join(words)} \"$@\"\n")
        os.chmod(script, 0o755)
        start = time.monotonic()
        code, late = self._wait(words, folder, point.ranks)
        found = {"status": "ok" if code == 0 else "failed", "exit_code": code, "seconds": time.monotonic() - start,
                 "reason": "", "setting": point.setting, "ranks": point.ranks, "command": words, "folder": os.getcwd()}
        if code:
            with open(os.path.join(folder, "output.txt"), encoding="utf-8", errors="replace") as f:
                said = reason_of(f.read()[-20000:])
            found["reason"] = f"no end after {self.timeout:g} s" if late else f"exit code {code}: {said}"
        if (late or code not in STOPPED) and not self.stopping:
            write_whole(os.path.join(folder, VERDICT), json.dumps(found, indent=1) + "\n")
        return found

    def _wait(self, words, folder, ranks):
        """(exit code, whether it was ended for taking too long)."""
        with open(os.path.join(folder, "output.txt"), "wb") as out:
            with self.lock:
                if self.stopping:
                    return -signal.SIGTERM, False
                try:
                    process = subprocess.Popen(words, stdout=out, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
                                               env=environment(self.jobs, ranks), start_new_session=True)
                except OSError as error:
                    out.write(f"{words[0]}: {error.strerror}\n".encode())
                    return 127, False
                self.running.add(process)
            try:
                return process.wait(self.timeout), False
            except subprocess.TimeoutExpired:
                process.terminate()  # the program ends after the present step, its file whole
                try:
                    return process.wait(10), True
                except subprocess.TimeoutExpired:
                    process.kill()
                    return process.wait(), True
            finally:
                with self.lock:
                    self.running.discard(process)


def _clock(seconds):
    minutes, seconds = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{seconds:02d}" if minutes >= 60 else f"{minutes}:{seconds:02d}"


def failures(study, points):
    """Prints the points that failed and why; returns their number."""
    found = [(p, v) for p in points for v in [verdict(os.path.join(study, p.name))] if v and v["status"] != "ok"]
    if found:
        print(f"{len(found)} of {len(points)} points failed (run again with --retry_failed):", file=sys.stderr)
    for point, v in found:
        print(f"  {point.label()}: {v['reason']} [{os.path.join(study, point.name)}]", file=sys.stderr)
    return len(found)
