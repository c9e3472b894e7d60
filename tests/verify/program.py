"""Runs the program in a folder of its own and reads what it wrote; the options of each method."""
import atexit
import functools
import itertools
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

import h5py
import numpy as np

# TS options of each formula. Where a type would adapt the step, that is off.
METHODS = {
    "fe": {"ts_type": "euler"},
    "symplectic": {"ts_type": "symplectic"},
    "midpoint": {"ts_type": "rk", "ts_rk_type": "2b"},
    "rk4": {"ts_type": "rk", "ts_rk_type": "4"},
    "be": {"ts_type": "beuler"},
    "linbe": {"ts_type": "beuler", "snes_type": "ksponly"},
    "imp": {"ts_type": "theta", "ts_theta_theta": 0.5, "ts_theta_endpoint": 0},
    "tr": {"ts_type": "cn"},
}
EXPLICIT = ("fe", "symplectic", "midpoint", "rk4")
NEWTON_RTOL = 1e-12
SESSION = itertools.count()


def method_options(method, h, steps, ranks=1):
    """Options of `steps` steps of length h: a direct solve and Newton to rounding level, so that what is left is the
    time-stepping formula."""
    options = dict(METHODS[method], ts_adapt_type="none", ts_dt=h, ts_max_time=steps * h)
    if method not in EXPLICIT:
        options.update(direct(ranks))
    return options


def direct(ranks=1):
    """Newton to rounding level on a direct solve."""
    options = {"snes_rtol": NEWTON_RTOL, "ksp_type": "preonly", "pc_type": "lu"}
    if ranks > 1:
        options["pc_factor_mat_solver_type"] = "mumps"
    return options


class RunError(Exception):
    """The program ended otherwise than expected, or wrote no readable result."""


class Trajectory:
    """All frames in memory: position and velocity (T, N, d), time and step (T), id (N), observables by name, log."""

    def __init__(self, path):
        with h5py.File(path, "r") as f:
            group = f["particles/trajectory"]
            self.position = group["position/value"][...]
            self.velocity = group["velocity/value"][...]
            self.time = group["position/time"][...].ravel()
            self.step = group["position/step"][...].ravel()
            self.id = group["id"][...].ravel()
            self.mass = group["mass"][...].ravel()
            self.observables = {name: o["value"][...] for name, o in f.get("observables", {}).items() if "value" in o}
            for kind in ("reaction", "work", "force", "moment", "stress_volume"):
                self.observables.update({f"{kind}/{name}": o["value"][...] for name, o in f.get(f"observables/{kind}", {}).items() if isinstance(o, h5py.Group)})
            self.log = {}
            if "backspring/log" in f:
                log = f["backspring/log"]
                names = log.dtype.names if isinstance(log, h5py.Dataset) else list(log)
                self.log = {name: log[name][...] for name in names}

    def frame_at(self, t, slack=1e-9):
        """Index of the frame at time t [s]; the times must agree to `slack` of the run's length."""
        k = int(np.argmin(np.abs(self.time - t)))
        if abs(self.time[k] - t) > slack * max(abs(self.time[-1]), abs(t), 1e-300):
            raise RunError(f"no frame at t = {t:.17g}; the nearest is {self.time[k]:.17g}")
        return k


class Result:
    """One finished run: exit code, both streams, the report (None if none was written) and the trajectory (or None)."""

    def __init__(self, code, stdout, stderr, report, trajectory, files):
        self.code, self.stdout, self.stderr, self.report, self.trajectory = code, stdout, stderr, report, trajectory
        self.files = files  # {name: bytes} of the files asked for by keep=


def words(options):
    """{"ts_dt": 0.1, "snes_mf": True, "bs_gravity": (0, -9.8)} -> command-line words; None leaves an option out."""
    if not isinstance(options, dict):
        return [str(w) for w in options]
    out = []
    for name, value in options.items():
        if value is None:
            continue
        out.append("-" + name)
        if value is not True:
            out.append(text(value))
    return out


def text(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple, np.ndarray)):
        return ",".join(text(v) for v in value)
    return f"{value:.17g}" if isinstance(value, (float, np.floating)) else str(value)


@functools.lru_cache(maxsize=None)
def sessions():
    """A folder for the sessions of runs without mpirun, until this process ends."""
    folder = tempfile.mkdtemp(prefix="bs_sessions_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def environment(ranks):
    """Variables for a run on so many ranks: one thread each; shared memory, without the search for fast networks that takes Open MPI half of a short run;
    one rank without the daemon that takes it half of what is left, and with a session in a folder of its own, since runs beside each other would meet there;
    more ranks than cores, for Open MPI 4 (OMPI) and from 5 on (PRTE)."""
    env = {k: v for k, v in os.environ.items() if k != "PETSC_OPTIONS"}
    env.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", OMPI_MCA_pml="ob1")
    if ranks == 1:
        env.update(OMPI_MCA_ess_singleton_isolated="1", OMPI_MCA_orte_tmpdir_base=f"{sessions()}/{next(SESSION)}")
    if os.geteuid() == 0:
        env.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    if ranks > len(os.sched_getaffinity(0)):
        env.update(OMPI_MCA_rmaps_base_oversubscribe="1", PRTE_MCA_rmaps_default_mapping_policy=":oversubscribe")
    return env


def knows(program, name):
    """Whether -help names it: a part that a PETSc may have been built without."""
    line = [str(program), *words({"bs_lattice_type": "chain", "bs_lattice_size": 4, "help": True})]
    return name in subprocess.run(line, env=environment(1), capture_output=True, text=True, timeout=120).stdout.split()


def miscounted(stdout, stderr, report, continued):
    """What is wrong with how often a run says that it warned: the last line and the report agree, and nothing is printed that they leave out. A key may stand for several
    lines; one that a run before had, for none."""
    last = re.findall(r"^backspring: (?:ok|failed|stopped) .*?(?: warnings=(\d+))?$", stdout, re.M)
    if report is None or not last:
        return ""
    printed, counted, named = len(re.findall("^backspring: warning: ", stderr, re.M)), int(last[-1] or 0), len(report.get("warnings", []))
    good = counted == named and (counted > 0 or printed == 0) and (continued or printed >= counted)
    return "" if good else f"{printed} warnings printed, {counted} in the last line, {report.get('warnings')} in the report: {stderr.strip()[-300:]}"


def run(program, options, ranks=1, expect=0, timeout=600, interval=None, keep=(), grows=False):
    """Runs the program in a folder of its own and returns a Result.

    interval [s]: write a trajectory with that output interval. expect: the exit code, or None for any; another one
    raises RunError with the end of what the program said; so do warnings that are not counted, and that of energy that grows
    without a drive, unless `grows` (the run is meant to). keep: names of files it writes, returned as bytes.
    """
    with tempfile.TemporaryDirectory(prefix="backspring_") as folder:
        folder = pathlib.Path(folder)
        command = [str(program)] + words(options) + ["-bs_report", "report.json"]
        if interval is not None:
            command += ["-bs_output", "run.h5md", "-bs_output_interval", text(float(interval))]
        if ranks > 1:
            command = ["mpirun", "-n", str(ranks)] + command
        try:
            done = subprocess.run(command, cwd=folder, env=environment(ranks), timeout=timeout,
                                  capture_output=True, text=True, errors="replace")
        except subprocess.TimeoutExpired:
            raise RunError(f"no end after {timeout} s: {' '.join(command)}") from None
        if expect is not None and done.returncode != expect:
            said = " / ".join((done.stdout + done.stderr).strip().splitlines()[-4:])
            raise RunError(f"exit code {done.returncode}, expected {expect}: {said} [{' '.join(command)}]")
        if "energy grew" in done.stderr and not grows:
            raise RunError(f"{done.stderr.strip()} [{' '.join(command)}]")
        try:
            report = json.loads((folder / "report.json").read_text()) if (folder / "report.json").exists() else None
            trajectory = Trajectory(folder / "run.h5md") if (folder / "run.h5md").exists() else None
            files = {name: (folder / name).read_bytes() for name in keep}
        except (OSError, KeyError, ValueError) as why:
            raise RunError(f"unreadable result: {why!r} [{' '.join(command)}]") from None
        if wrong := miscounted(done.stdout, done.stderr, report, "-bs_restart" in command):
            raise RunError(f"{wrong} [{' '.join(command)}]")
        if expect == 0 and interval is not None and trajectory is None:
            raise RunError(f"no trajectory was written [{' '.join(command)}]")
        return Result(done.returncode, done.stdout, done.stderr, report, trajectory, files)
