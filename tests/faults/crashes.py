#!/usr/bin/env python3
"""Runs that are killed, starved of disk, or given files they cannot write: what is left on disk, and whether it goes on.

--kills N: that many runs are killed by SIGKILL, at moments spread at random over the run's length.
"""
import argparse
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from runs import BLOCK, Checks, difference, frames, run, start, told

FAST = {"bs_lattice_size": (4, 4, 4), "ts_dt": 0.005, "ts_max_time": 0.75, "bs_output_interval": 0.005, "bs_output_xdmf": False}


def kills(checks, folder, count):
    """SIGKILL at `count` random moments. Each time: the trajectory opens, its completed frames are the undisturbed run's,
    a run from the last checkpoint (from the start where there was none yet) ends, and every bit is the undisturbed run's."""
    options = dict(BLOCK, **FAST, bs_checkpoint="ck", bs_checkpoint_every=4)
    options["ts_max_time"] = 1.5
    began = time.monotonic()
    code, _, err = run(checks, folder, dict(options, bs_output="full.h5md"))
    window = 0.9 * (time.monotonic() - began)
    checks.true(f"undisturbed run, {window / 0.9:.1f} s", code == 0, err.strip()[:100])
    chance = random.Random(20240229)
    path, intact, ended, same, from_start, tried, at = folder / "part.h5md", 0, 0, 0, 0, 0, []
    while len(at) < count and tried < 4 * count:
        tried += 1
        for old in (*folder.glob("part*"), *folder.glob("ck*")):
            old.unlink()
        if not killed(start(checks, folder, dict(options, bs_output=path.name)), chance.uniform(0.03, 1) * window):
            window *= 0.8  # over before the kill: the machine is faster than it was, and another moment is drawn
            continue
        try:
            at.append(frames(path) if path.exists() else 0)
            intact += same_frames(folder / "full.h5md", path, at[-1])
        except (OSError, KeyError, ValueError) as why:
            at.append(0)
            checks.true("trajectory after a kill", False, repr(why))
            continue
        if (folder / "ck").exists():
            code, _, err = run(checks, folder, {"bs_restart": "ck"})
        else:
            from_start, window = from_start + 1, window * 1.1
            code, _, err = run(checks, folder, dict(options, bs_output=path.name, bs_overwrite=True))
        ended += code == 0
        same += code == 0 and difference(folder / "full.h5md", path)[1]
        if code != 0:
            checks.true("continued after a kill", False, err.strip()[:200])
    spread = f"with {min(at, default=0)} to {max(at, default=0)} frames written, {from_start} before the first checkpoint, {tried - len(at)} came too late"
    checks.true(f"{count} runs killed while under way", len(at) == count, spread)
    checks.true(f"{count} kills: the trajectory opens and holds the undisturbed run's frames", intact == count, f"{intact} of {count}")
    checks.true(f"{count} kills: the continued run ends", ended == count, f"{ended} of {count}")
    checks.true(f"{count} kills: every bit of the undisturbed run", same == count, f"{same} of {count}")
    checks.true("the kills hit different stages of the run", len(set(at)) > count // 4, spread)


def killed(process, after):
    """SIGKILL to `process` after that many seconds; False if it had ended by itself."""
    try:
        process.communicate(timeout=after)
        return False
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return process.returncode == -signal.SIGKILL


def same_frames(full, part, count):
    import h5py
    import numpy as np
    if count == 0:
        return True
    with h5py.File(full, "r") as a, h5py.File(part, "r") as b:
        return all(np.array_equal(a[f"particles/trajectory/{n}"][:count], b[f"particles/trajectory/{n}"][:count])
                   for n in ("position/value", "velocity/value", "position/time", "position/step"))


def rank_killed(checks, folder):
    options = dict(BLOCK, **FAST, bs_checkpoint="ck", bs_checkpoint_every=10, bs_output="part.h5md", bs_overwrite=True)
    options["ts_max_time"] = 30
    process = start(checks, folder, options, ranks=2, start_new_session=True)
    path = folder / "part.h5md"
    deadline = time.monotonic() + 60
    while not (folder / "ck.previous").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    victims = children(process.pid, pathlib.Path(checks.program).name)
    checks.true("one rank killed: two ranks were running", len(victims) == 2, f"{len(victims)} found")
    os.kill(victims[-1], signal.SIGKILL)
    began = time.monotonic()
    try:
        process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    took = time.monotonic() - began
    checks.true("one rank killed: the job ends within seconds", took < 20 and process.returncode != 0, f"{took:.1f} s, exit {process.returncode}")
    held = frames(path)
    checks.true(f"one rank killed: {held} frames can be read", held > 1)
    code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": (held + 5) * 0.005}, 2)
    checks.true("one rank killed: the run goes on", code == 0 and frames(path) == held + 6, f"exit {code}, {frames(path)} frames {err.strip()[:100]}")


def children(pid, name):
    """Process ids of `name` below `pid`."""
    found = []
    for entry in pathlib.Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and (entry / "comm").read_text().strip() == name[:15]:
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                while parent > 1 and parent != pid:
                    parent = int((pathlib.Path("/proc") / str(parent) / "stat").read_text().rsplit(")", 1)[1].split()[1])
                if parent == pid:
                    found.append(int(entry.name))
        except (OSError, ValueError):
            pass
    return sorted(found)


def disk_full(checks, folder):
    """A file system of 2 MB: the trajectory, then the checkpoint, does not fit."""
    mount = folder / "small"
    mount.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=2m", "none", str(mount)], capture_output=True).returncode:
        return checks.skip("disk full", "a small file system cannot be mounted here (needs root)")
    try:
        options = dict(BLOCK, **FAST, bs_checkpoint=str(folder / "ck"), bs_checkpoint_every=5, bs_output="small/part.h5md")
        options.update(ts_max_time=10, bs_lattice_size=(7, 7, 7))
        for ranks in (1, 2):
            for old in mount.iterdir():
                old.unlink()
            code, _, err = run(checks, folder, dict(options, bs_overwrite=True), ranks)
            lines = told(err)
            name = f"disk full, {ranks} rank(s)"
            checks.true(f"{name}: exit 4, one line", code == 4 and len(lines) == 1 and "No space left" in lines[0], f"exit {code}: {' '.join(lines)[:140]}")
            held = frames(mount / "part.h5md")
            checks.true(f"{name}: {held} earlier frames intact", held > 3)
        shutil.copy(mount / "part.h5md", folder / "moved.h5md")
        code, _, err = run(checks, folder, {"bs_restart": str(folder / "ck"), "bs_output": "moved.h5md", "ts_max_time": (held + 3) * 0.005}, 2)
        checks.true("disk full: goes on in a copy with room", code == 0 and frames(folder / "moved.h5md") == held + 4, f"exit {code} {err.strip()[:120]}")
        (mount / "part.h5md").unlink()
        filler = mount / "filler"
        net = dict(BLOCK, bs_lattice_type="square", bs_lattice_size=(20, 20), bs_lattice_fixed="ymin", bs_gravity=(0, -9.81), ts_max_time=0.05, bs_output_xdmf=False, bs_overwrite=True)
        at_frame_0, wrong = 0, []
        (mount / "part.h5md").write_bytes(b"an older file")
        for room in range(340_000, 640_000, 50_000):
            for name, ranks in (("small/new.h5md", 1), ("small/part.h5md", 1), ("small/new.h5md", 2)):
                filler.unlink(missing_ok=True)
                filler.write_bytes(b"0" * max(0, os.statvfs(mount).f_bavail * os.statvfs(mount).f_frsize - room))
                before = {p.name: p.read_bytes() for p in mount.iterdir()}
                code, _, err = run(checks, folder, dict(net, bs_output=name), ranks)
                lines = told(err)
                at_frame_0 += code == 4 and "frame 0" in err
                after = {p.name: p.read_bytes() for p in mount.iterdir()}
                if not (code == 0 and frames(folder / name) > 1 or code == 4 and len(lines) == 1 and "No space left" in lines[0] and (after == before or "frame 0" not in err and frames(folder / name) > 0)):
                    wrong.append(f"{room} {name} {ranks}: exit {code}, {sorted(after)}, {' '.join(lines)[:100]}")
                (mount / "new.h5md").unlink(missing_ok=True)
                (mount / "part.h5md").write_bytes(b"an older file")
        checks.true(f"disk full at frame 0, {at_frame_0} times: no file without frames has the name, what had it is untouched", at_frame_0 >= 3 and not wrong, "; ".join(wrong)[:300])
        filler.unlink()
        (mount / "part.h5md").unlink()
        small = dict(BLOCK, bs_lattice_size=(12, 12, 12), ts_max_time=0.03, ts_type="symplectic", ts_dt=1e-3, bs_checkpoint="small/ck", bs_checkpoint_every=5, bs_output="roomy.h5md")
        code, _, err = run(checks, folder, small)
        checks.true("checkpoint and its predecessor fit", code == 0 and (mount / "ck.previous").exists(), err.strip()[:100])
        kept = (mount / "ck").read_bytes()
        filler.write_bytes(b"0" * (os.statvfs(mount).f_bavail * os.statvfs(mount).f_frsize - 4096))
        code, _, err = run(checks, folder, {"bs_restart": "small/ck", "ts_max_time": 0.06})
        lines = told(err)
        checks.true("no room for a checkpoint: exit 4, one line", code == 4 and len(lines) == 1 and "No space left" in lines[0] and "intact" in lines[0], f"exit {code}: {' '.join(lines)[:140]}")
        checks.true("no room for a checkpoint: the one before is untouched, nothing half-written", (mount / "ck").read_bytes() == kept and not list(mount.glob("*.tmp")))
    finally:
        subprocess.run(["umount", str(mount)], capture_output=True)


def unwritable(checks, folder):
    """Folders and files that cannot be written are named before anything is computed."""
    options = dict(BLOCK, ts_max_time=0.05)
    locked = folder / "locked"
    locked.mkdir()
    readonly = folder / "readonly"
    readonly.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "ro,size=64k", "none", str(readonly)], capture_output=True).returncode == 0
    try:
        (folder / "there.h5md").write_bytes(b"something of value")
        (folder / "there.ck").write_bytes(b"something of value")
        cases = [("a missing folder", "none/run.h5md", "none"), ("a folder in the file's place", "locked", "is a folder"),
                 ("a file that exists", "there.h5md", "exists"), ("a path through a file", "there.h5md/run.h5md", "there.h5md")]
        if os.geteuid() != 0:  # root writes where nobody may
            (locked / "file").write_bytes(b"")
            (locked / "file").chmod(0o444)
            cases.append(("a file without permission", "locked/file", "locked/file"))
        if mounted:
            cases.append(("a read-only folder", "readonly/run.h5md", "Read-only file system"))
        else:
            checks.skip("a read-only folder", "a read-only file system cannot be mounted here (needs root)")
        for option in ("bs_output", "bs_checkpoint", "bs_report"):
            for name, file, word in cases:
                for ranks in ((1, 3) if option == "bs_checkpoint" else (1,)):
                    code, out, err = run(checks, folder, dict(options, **{option: file.replace("there.h5md", "there.ck") if option == "bs_checkpoint" else file}), ranks)
                    lines = told(err)
                    word_ = word.replace("there.h5md", "there.ck") if option == "bs_checkpoint" else word
                    checks.true(f"-{option}, {ranks} rank(s): {name}", code == 2 and len(lines) == 1 and word_ in lines[0] and "-" + option in lines[0], f"exit {code}: {' '.join(lines)[:120]}")
        checks.true("what existed is untouched", (folder / "there.h5md").read_bytes() == b"something of value" == (folder / "there.ck").read_bytes())
    finally:
        if mounted:
            subprocess.run(["umount", str(readonly)], capture_output=True)


def lattice_changed(checks, folder):
    """The lattice's file is edited between checkpoint and restart."""
    import h5py
    import numpy as np
    from runs import write_lattice
    x = np.array([[k, 0.0] for k in range(6)])
    chain = dict(pairs=[[k, k + 1] for k in range(5)], stiffness=100.0, rest_length=1.0, damping=0.1, fixed=[1, 0, 0, 0, 0, 0])
    options = {"bs_lattice_file": "chain.h5", "bs_gravity": (0, -9.81), "ts_dt": 0.01, "ts_max_time": 0.2, "bs_progress_interval": -1,
               "bs_output": "chain.h5md", "bs_checkpoint": "ck", "bs_overwrite": True}
    for name, dataset, change in (("a mass", "particles/mass", 2.0), ("a stiffness", "springs/stiffness", 100.0000001), ("a rest length", "springs/rest_length", 1.5),
                                  ("a damper", "springs/damping", 0.0), ("which particle is fixed", "particles/fixed", 0)):
        write_lattice(folder / "chain.h5", x, 1.0, **chain)
        run(checks, folder, options)
        with h5py.File(folder / "chain.h5", "r+") as f:
            f[dataset][0] = change
        code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.3})
        checks.true(f"changed since the checkpoint: {name}", code == 2 and len(told(err)) == 1 and "another lattice" in err, err.strip()[:120])
    write_lattice(folder / "chain.h5", x, 1.0, **chain)
    code, _, err = run(checks, folder, {"bs_restart": "ck", "ts_max_time": 0.3})
    checks.true("written anew as it was: goes on", code == 0 and frames(folder / "chain.h5md") == 31, err.strip()[:120])


def main():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--kills", type=int, default=30)
    mine, rest = parser.parse_known_args()
    sys.argv[1:] = rest
    checks = Checks(__doc__)
    for part, arguments in ((kills, [mine.kills]), (rank_killed, []), (disk_full, []), (unwritable, []), (lattice_changed, [])):
        if checks.wants(part.__name__):
            with tempfile.TemporaryDirectory() as folder, checks.group(part.__name__):
                part(checks, pathlib.Path(folder), *arguments)
    checks.finish()


if __name__ == "__main__":
    main()
