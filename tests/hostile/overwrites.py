#!/usr/bin/env python3
"""What a run must not write over: its own inputs, its other outputs, what other people keep, devices; and, when it is continued, the
frames that came after the checkpoint, until it has a frame to put in their place. --kill: the library that kills at counted writes."""
import os
import pathlib
import shutil
import stat
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "faults"))
import h5py
import numpy as np
from runs import BLOCK, content, difference, frames, run, run_parts, start, told, write_lattice

SHORT = {"bs_lattice_type": "chain", "bs_lattice_size": 5, "ts_dt": 0.01, "ts_max_time": 0.05, "bs_progress_interval": -1, "bs_advise": False}
VALUE = b"something of value\n"


def lattice(folder):
    x = np.array([[float(k), 0.0] for k in range(4)])
    return write_lattice(folder / "l.h5", x, 1.0, pairs=[[k, k + 1] for k in range(3)], stiffness=100.0, rest_length=1.0,
                         anchors={"particle": [0], "point": [[0.0, 1.0]], "stiffness": [10.0], "rest_length": [0.5], "damping": [0.0]})


def snapshot(folder):
    """Every file's bytes and kind, links as what they are."""
    found = {}
    for path in sorted(folder.rglob("*")):
        mode = path.lstat().st_mode
        found[str(path.relative_to(folder))] = os.readlink(path) if stat.S_ISLNK(mode) else path.read_bytes() if stat.S_ISREG(mode) else stat.S_IFMT(mode)
    return found


def one_file(checks, folder):
    """Two names for one file, in every spelling, and whether it is there or not."""
    lattice(folder)
    (folder / "table.csv").write_text("0,0,0\n1,0.1,0\n")
    (folder / "o.yaml").write_text("ts_max_time: 0.05\n")
    (folder / "sub").mkdir()
    (folder / "way").symlink_to(folder / "sub")
    (folder / "link.h5").symlink_to(folder / "l.h5")
    os.link(folder / "table.csv", folder / "hard.csv")
    shutil.copy(folder / "l.h5", folder / "k_M.h5")
    with_lattice = {"bs_lattice_file": "l.h5", "ts_dt": 0.01, "ts_max_time": 0.05, "bs_progress_interval": -1, "bs_advise": False}
    with_table = dict(with_lattice, bs_anchor_motion="table", bs_anchor_table="table.csv")
    heat = {"bs_model": "linear", "bs_linear_type": "heat1d", "bs_linear_size": 10, "bs_linear_source_table": "u.csv", "ts_dt": 0.01, "ts_max_time": 0.05}
    (folder / "u.csv").write_text("0,0\n1,1\n")
    code, _, err = run(checks, folder, dict(SHORT, bs_checkpoint="sub/ck"))
    checks.true("a checkpoint", code == 0, err.strip()[:120])
    before = snapshot(folder)
    cases = [("output and report", dict(SHORT, bs_output="a", bs_report="a")), ("output and checkpoint, ./", dict(SHORT, bs_output="a", bs_checkpoint="./a")),
             ("checkpoint and report by a link of folders", dict(SHORT, bs_checkpoint="sub/new", bs_report="way/new")),
             ("report and sidecar", dict(SHORT, bs_output="a", bs_report="./a.xdmf")), ("report and the checkpoint before", dict(SHORT, bs_checkpoint="a", bs_report="a.previous")),
             ("checkpoint and the other's lock", dict(SHORT, bs_output="a", bs_checkpoint="a.lock")),
             ("output and lattice", dict(with_lattice, bs_output="l.h5")), ("report and lattice by a link", dict(with_lattice, bs_report="link.h5")),
             ("checkpoint and lattice, sub/..", dict(with_lattice, bs_checkpoint="sub/../l.h5")), ("lattice by a link, output", dict(with_lattice, bs_lattice_file="link.h5", bs_output="l.h5")),
             ("report and anchors' table", dict(with_table, bs_report="table.csv")), ("output and anchors' table by a hard link", dict(with_table, bs_output="hard.csv")),
             ("report and sources' table", dict(heat, bs_report="u.csv")),
             ("report and option file", dict(SHORT, options_file="o.yaml", bs_report="o.yaml")), ("output and option file, ./", dict(SHORT, options_file="./o.yaml", bs_output="o.yaml")),
             ("report and matrices", dict(SHORT, bs_write_matrices="m", bs_report="m_K.mtx")), ("output and matrices, ./", dict(SHORT, bs_write_matrices="./m", bs_output="m_D.petsc")),
             ("matrices and lattice", dict(with_lattice, bs_lattice_file="k_M.h5", bs_write_matrices="k", bs_report="k_M.mtx")),
             ("option file and what PETSc logs", dict(SHORT, options_file="o.yaml", log_view=":o.yaml")), ("output and what PETSc prints", dict(SHORT, bs_output="a", snes_view="ascii:./a:ascii_info")),
             ("lattice and what PETSc prints", dict(with_lattice, ksp_monitor="ascii:l.h5")),
             ("output and the checkpoint that is continued", {"bs_restart": "sub/ck", "bs_output": "way/ck"}), ("report and the checkpoint that is continued", {"bs_restart": "sub/ck", "bs_report": "sub/ck"})]
    for name, options in cases:
        for ranks in ((1, 3) if name in ("output and report", "output and lattice") else (1,)):
            code, _, err = run(checks, folder, dict(options, bs_overwrite=True), ranks)
            lines = told(err)
            checks.true(f"{name}, {ranks} rank(s): exit 2, one line", code == 2 and len(lines) == 1 and "one file" in lines[0], f"exit {code}: {err.strip()[:140]}")
    checks.true("nothing is touched, nothing made", snapshot(folder) == before, str(sorted(set(snapshot(folder)) ^ set(before))))
    code, _, err = run(checks, folder, dict(with_table, bs_output="a", bs_report="r", bs_checkpoint="sub/a"))
    checks.true("different names are no fault", code == 0, err.strip()[:120])


def others(checks, folder):
    """What other people keep under names that the program makes of the ones it is given."""
    names = ("a.xdmf", "c.previous", "a.lock", "c.lock", "r.lock")
    given = dict(SHORT, bs_lattice_type="square", bs_lattice_size="3,3", bs_output="a", bs_checkpoint="c", bs_checkpoint_every=2, bs_report="r")
    for name in names:
        (folder / name).write_bytes(VALUE)
        for overwrite in (None, True):
            code, _, err = run(checks, folder, dict(given, bs_overwrite=overwrite))
            checks.true(f"{name} of somebody else{', -bs_overwrite' if overwrite else ''}: exit 2, one line", code == 2 and len(told(err)) == 1 and name in told(err)[0], f"exit {code}: {err.strip()[:140]}")
        checks.true(f"{name} is untouched", (folder / name).read_bytes() == VALUE and os.listdir(folder) == [name], str(os.listdir(folder)))
        (folder / name).unlink()
    (folder / "a.checkpoint").write_bytes(VALUE)
    code, _, err = run(checks, folder, dict(SHORT, bs_output="a"))
    checks.true("a.checkpoint of somebody else", code == 2 and "a.checkpoint" in err and (folder / "a.checkpoint").read_bytes() == VALUE, err.strip()[:140])
    (folder / "a.checkpoint").unlink()
    for name in ("a.tmp", "c.tmp", "r.tmp", "a.xdmf.tmp"):
        (folder / name).write_bytes(VALUE)
    code, _, err = run(checks, folder, given)
    checks.true("F.tmp of somebody else hinders nothing and is untouched", code == 0 and all((folder / n).read_bytes() == VALUE for n in ("a.tmp", "c.tmp", "r.tmp", "a.xdmf.tmp")), err.strip()[:120])
    code, _, err = run(checks, folder, dict(given, bs_overwrite=True))
    checks.true("what the program wrote itself is replaced", code == 0 and not err.strip(), err.strip()[:120])
    (folder / "mine").write_bytes(VALUE)
    code, _, err = run(checks, folder, {"bs_restart": "c", "ts_max_time": 0.07, "bs_checkpoint": "mine"})
    checks.true("a continued run replaces only checkpoints", code == 2 and "exists" in err and (folder / "mine").read_bytes() == VALUE, err.strip()[-140:])


def long_names(checks, folder):
    """Names of every length near the longest that a folder holds: refused before anything is computed, or good to the end, with all names
    that the program makes of them."""
    refused, good, wrong = 0, 0, []
    for option, extra in (("bs_output", {"bs_lattice_type": "square", "bs_lattice_size": "3,3"}), ("bs_checkpoint", {"bs_checkpoint_every": 2}), ("bs_report", {}), ("bs_write_matrices", {})):
        for length in (185, 191, 192, 202, 203, 204, 211, 212, 220, 221, 226, 235, 255, 256):
            here = folder / "here"
            here.mkdir()
            code, _, err = run(checks, here, dict(SHORT, **extra, **{option: "n" * length}))
            left = os.listdir(here)
            refused, good = refused + (code == 2), good + (code == 0)
            if not (code == 0 and left and not err.strip() or code == 2 and not left and len(told(err)) == 1 and "-" + option in err):
                wrong.append(f"-{option} {length}: exit {code}, {len(left)} files, {err.strip()[-120:]}")
            shutil.rmtree(here)
    checks.true(f"{good} names are good to the end, {refused} refused at the start", not wrong and good > 8 and refused > 8, "; ".join(wrong)[:300])
    fails = {"snes_max_it": 1, "snes_rtol": 1e-15, "snes_atol": 1e-300, "snes_stol": 0, "bs_step_max_cuts": 1}
    for length in (185, 191, 192):
        here = folder / "here"
        here.mkdir()
        code, _, err = run(checks, here, dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_max_time=0.1, bs_output="n" * length, **fails))
        kept = len([n for n in os.listdir(here) if n.endswith(".checkpoint")])
        checks.true(f"a failing run with a name of {length}: its state is kept, or the name is refused", (code, kept) in ((3, 1), (2, 0)), f"exit {code}, {kept}: {err.strip()[-160:]}")
        shutil.rmtree(here)


def reports(checks, folder):
    (folder / "r.json").write_bytes(VALUE)
    for ranks in (1, 3):
        code, _, err = run(checks, folder, dict(SHORT, bs_report="r.json"), ranks)
        checks.true(f"a report that exists, {ranks} rank(s): exit 2, untouched", code == 2 and "r.json exists" in err and "-bs_overwrite" in err and (folder / "r.json").read_bytes() == VALUE, err.strip()[:120])
    code, _, err = run(checks, folder, dict(SHORT, bs_report="r.json", bs_overwrite=True))
    checks.true("-bs_overwrite replaces it", code == 0 and b'"outcome": "ok"' in (folder / "r.json").read_bytes(), err.strip()[:120])
    process = start(checks, folder, dict(BLOCK, ts_type="symplectic", ts_dt=1e-3, ts_max_time=1.0, bs_output="late.h5md", bs_report="late.json"))
    while not (folder / "late.h5md").exists() and process.poll() is None:
        time.sleep(0.01)
    (folder / "late.json").write_bytes(VALUE)
    _, err = process.communicate(timeout=120)
    checks.true("a report made by somebody during the run: exit 4, untouched", process.returncode == 4 and len(told(err)) == 1 and (folder / "late.json").read_bytes() == VALUE, f"exit {process.returncode}: {err.strip()[:120]}")


def no_files(checks, folder):
    """Devices, pipes, folders, links to nothing."""
    os.mkfifo(folder / "pipe")
    (folder / "dir").mkdir()
    (folder / "dangling").symlink_to("nothing")
    names = ["pipe", "dir", "dangling", "/dev/null"]
    if subprocess.run(["mknod", str(folder / "full"), "c", "1", "7"], capture_output=True).returncode == 0:
        names.append("full")
    else:
        checks.skip("a device of one's own", "needs root")
    before = snapshot(folder)
    for name in names:
        for option in ("bs_output", "bs_checkpoint", "bs_report"):
            code, _, err = run(checks, folder, dict(SHORT, bs_overwrite=True, **{option: name}))
            checks.true(f"-{option} {name}: exit 2, one line", code == 2 and len(told(err)) == 1 and name in told(err)[0] and "-" + option in told(err)[0], f"exit {code}: {err.strip()[:120]}")
    checks.true("all are as they were", snapshot(folder) == before and stat.S_ISCHR(os.stat("/dev/null").st_mode))


def kept_tail(checks, folder):
    """Frames after the checkpoint: kept by a run that takes no step or fails at its first one."""
    options = dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_max_time=0.5, bs_output="o.h5md", bs_checkpoint="ck", bs_checkpoint_every=16)
    code, _, err = run(checks, folder, options)
    held = frames(folder / "o.h5md")
    with h5py.File(folder / "ck.previous") as f:
        at, there = f["run"].attrs["time"], int(f["run"].attrs["frames"])
    checks.true("the checkpoint lies frames before the end", code == 0 and held == 21 and there < held - 1, f"frame {there} of {held}")
    shutil.copy(folder / "o.h5md", folder / "whole.h5md")
    shutil.copy(folder / "ck.previous", folder / "old")
    fails = {"snes_max_it": 1, "snes_rtol": 1e-15, "snes_atol": 1e-300, "snes_stol": 0, "bs_step_max_cuts": 1}
    for name, more, expected in (("its end is reached", {"ts_max_time": float(at)}, 0), ("no step is allowed", {"ts_max_steps": 1}, 0), ("the first step fails", fails, 3)):
        for ranks in ((1, 2) if expected else (1,)):
            code, _, err = run(checks, folder, dict({"bs_restart": "old"}, **more), ranks)
            checks.true(f"{name}, {ranks} rank(s): exit {expected}", code == expected, f"exit {code}: {err.strip()[-140:]}")
            checks.true(f"{name}, {ranks} rank(s): every frame and row is still there", difference(folder / "o.h5md", folder / "whole.h5md")[1], f"{frames(folder / 'o.h5md')} frames")
    code, _, err = run(checks, folder, {"bs_restart": "old"})
    checks.true("a run that steps replaces them", code == 0 and difference(folder / "o.h5md", folder / "whole.h5md")[1] and not list(folder.glob("*.tail")), err.strip()[-140:])
    code, _, err = run(checks, folder, {"bs_restart": "old", "ts_max_time": float(at) + 0.05, "bs_checkpoint_every": 1})
    checks.true("and takes away what it does not come to", code == 0 and frames(folder / "o.h5md") == there + 2, f"{frames(folder / 'o.h5md')} frames")


def killed_while_cutting(checks, folder, shim):
    """SIGKILL at each of the first writes of a continued run: the old frames are in the trajectory or in the file beside it, or the
    new frame is whole."""
    options = dict(BLOCK, bs_lattice_size=(3, 3, 3), ts_max_time=0.5, bs_output="o.h5md", bs_checkpoint="ck", bs_checkpoint_every=16, bs_output_xdmf=False, bs_output_flush=0)
    run(checks, folder, options)
    whole = content(folder / "o.h5md")
    kept = {name: (folder / name).read_bytes() for name in ("o.h5md", "ck", "ck.previous")}
    with h5py.File(folder / "ck.previous") as f:
        there = int(f["run"].attrs["frames"])
    value, faults, seen = "particles/trajectory/position/value", {}, {"whole": 0, "beside": 0, "new": 0}
    moments = range(0, 153, 9)
    for at in moments:
        for old in folder.glob("o.h5md*"):
            old.unlink()
        for name, data in kept.items():
            (folder / name).write_bytes(data)
        code, _, _ = run(checks, folder, {"bs_restart": "ck.previous", "bs_output_xdmf": False}, extra={"LD_PRELOAD": shim, "BS_KILL_FILE": "/o.h5md", "BS_KILL_AT": str(at)})
        beside = list(folder.glob("o.h5md.*.tail"))
        held = frames(folder / "o.h5md")
        if code != -9:
            faults[at] = f"exit {code}"
        elif held == len(whole["time"]):
            seen["whole"] += 1
        elif held == there:
            seen["beside"] += 1
            good = len(beside) == 1
            if good:
                with h5py.File(beside[0]) as f:
                    good = np.array_equal(f[value][...], whole[value][there:]) and np.array_equal(f["particles/trajectory/position/time"][...], whole["time"][there:])
            if not good:
                faults[at] = f"{held} frames, {len(beside)} files beside"
        else:
            seen["new"] += 1
        with h5py.File(folder / "o.h5md") as f:
            n = min(held, there)
            if not np.array_equal(f[value][:n], whole[value][:n]):
                faults[at] = "other frames before the checkpoint"
    checks.true(f"kills at {len(moments)} writes: {seen}", not faults and min(seen.values()) > 0, str(faults)[:200])


if __name__ == "__main__":
    run_parts(__doc__, (one_file, others, long_names, reports, no_files, kept_tail, killed_while_cutting), library="--kill", with_library=(killed_while_cutting,))
