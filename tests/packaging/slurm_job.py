#!/usr/bin/env python3
"""The Slurm script without Slurm: srun and scontrol are played by two short programs. A job that is told that its time is over, queued again and started again
ends in the bits of the run that nobody stopped; a job that is cancelled, that gets no further or that fails is not queued again."""
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
from program import environment
import h5py

SCRIPT = REPO / "src/package/slurm/backspring.sbatch"
# srun as the manual has it: a signal that it gets is passed on to the ranks, and their exit code is its own
SRUN = "#!/bin/sh\necho \"srun $*\" >>calls\nexec \"$@\"\n"
SCONTROL = "#!/bin/sh\necho \"scontrol $*\" >>calls\ncase $1 in show) echo \"JobId=7 JobState=${STATE:-RUNNING} Reason=None\";; esac\n"
# Few enough unknowns for a direct solver, with which a continued run repeats the whole one bit for bit
RUN = ["-options_file", "cloth", "-bs_lattice_size", "14", "-bs_lattice_fixed_particles", "182,195", "-ts_max_time", "2", "-bs_progress_interval", "-1"]


def job(checks, folder, arguments, told=None, **variables):
    """Exit code, what was printed and what srun and scontrol were called with; `told`: TERM goes to the script alone once this is true."""
    for name, text in (("srun", SRUN), ("scontrol", SCONTROL)):
        (folder / "bin").mkdir(exist_ok=True)
        (folder / "bin" / name).write_text(text)
        (folder / "bin" / name).chmod(0o755)
    (folder / "calls").write_text("")
    env = dict(environment(1), PATH=f"{folder}/bin:{os.environ['PATH']}", BACKSPRING=str(checks.program), SLURM_JOB_ID="7", **variables)
    process = subprocess.Popen(["bash", SCRIPT, *arguments], cwd=folder, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    limit = time.monotonic() + 120
    while told and not told() and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.02)
    if told:
        process.send_signal(signal.SIGTERM)
    printed = process.communicate(timeout=300)[0]
    return process.returncode, printed, (folder / "calls").read_text().splitlines()


def state(path):
    with h5py.File(path) as f:
        where = f["particles/trajectory"]
        return {(name, part): where[name][part][:].tobytes() for name in ("position", "velocity") for part in ("value", "time")}


def growing(path, bytes_before_the_signal=20_000):
    """Whether the run is on its way: its first frames are on the disk."""
    return lambda: path.exists() and path.stat().st_size > bytes_before_the_signal


def stopped_and_continued(checks, folder):
    code, printed, calls = job(checks, folder, ["whole", *RUN])
    checks.true("a job with time enough ends", code == 0 and "backspring: ok t=2 " in printed, printed[-200:])
    checks.true("it is not queued again", not any("requeue" in call for call in calls) and sum(call.startswith("srun") for call in calls) == 1, f"{calls}")
    # told before the second frame: most of the run is left for later jobs
    code, printed, calls = job(checks, folder, ["parts", *RUN, "-bs_output_flush", "0"], told=growing(folder / "parts.h5md"))
    checks.true("told that the time is over, it asks to be queued again", code == 0 and calls[-1:] == ["scontrol requeue 7"], f"{code} {calls[-1:]} {printed[-200:]}")
    checks.true("with a checkpoint", (folder / "parts.ck").is_file() and "stopped with a checkpoint" in printed)
    checks.true("and before the end", "backspring: ok" not in printed and state(folder / "parts.h5md") != state(folder / "whole.h5md"))
    code, printed, calls = job(checks, folder, ["parts", *RUN, "-bs_output_flush", "0"], SLURM_RESTART_COUNT="1")
    checks.true("started again, it continues to the end", code == 0 and "-bs_restart parts.ck" in calls[0] and "backspring: ok t=2 " in printed, printed[-300:])
    checks.true("in the bits of the whole run, every frame once", state(folder / "parts.h5md") == state(folder / "whole.h5md"))
    checks.true("nothing is left behind", not list(folder.glob("*.started.*")), f"{list(folder.glob('*.started.*'))}")


def not_again(checks, folder):
    """What would be queued again without end, or against somebody's will, is not."""
    code, printed, calls = job(checks, folder, ["off", *RUN, "-bs_output_flush", "0"], told=growing(folder / "off.h5md"), STATE="COMPLETING")
    checks.true("a cancelled job", code == 143 and not any("requeue" in call for call in calls) and "not queued again" in printed, f"{code} {printed[-200:]}")
    stuck = folder / "stuck"  # a program that ends on TERM without a checkpoint, as one whose step takes too long does when it is killed
    stuck.write_text("#!/bin/sh\ntouch begun\nexec sleep 60\n")
    stuck.chmod(0o755)
    code, printed, calls = job(checks, folder, ["off", *RUN], told=(folder / "begun").exists, SRUN=str(stuck))
    checks.true("one that got no further", code == 143 and not any("requeue" in call for call in calls) and "no checkpoint was written" in printed, f"{code} {printed[-200:]}")
    code, printed, calls = job(checks, folder, ["bad", "-options_file", "cloth", "-bs_no_such", "1"])
    checks.true("one with bad options", code == 2 and not any("requeue" in call for call in calls), f"{code}")
    code, printed, _ = job(checks, folder, ["lonely"])
    checks.true("one without options is told how", code == 2 and "give the name of the run" in printed, printed)


def begun_anew(checks, folder):
    """A node failed before the first checkpoint: what the job left is no obstacle; of a new job it is."""
    short = ["young", "-options_file", "pendulum", "-ts_max_time", "0.04", "-bs_progress_interval", "-1"]
    (folder / "young.h5md").write_bytes(b"half a file")
    code, printed, _ = job(checks, folder, short)
    checks.true("a file of the run's name is not replaced by a new job", code == 2 and "exists" in printed, printed[-200:])
    code, printed, _ = job(checks, folder, short, SLURM_RESTART_COUNT="1")
    checks.true("but by the same job", code == 0 and "begins anew" in printed, printed[-200:])


def main():
    checks = Checks(__doc__)
    for name, group in (("stopped and continued", stopped_and_continued), ("not again", not_again), ("begun anew", begun_anew)):
        if checks.wants(name):
            with tempfile.TemporaryDirectory() as folder, checks.group(name):
                group(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
