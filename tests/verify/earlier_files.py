#!/usr/bin/env python3
"""Files of every earlier version are read: its option files, lattices, trajectories and checkpoints, stored in earlier/VERSION.tar.xz by the program of that version. Its runs, repeated and
continued from its checkpoints, end where it has ended; its trajectories are drawn, compared, converted and opened in Python, and are lattices for `-bs_task generate`."""
import os
import pathlib
import subprocess
import sys
import tarfile
import tempfile

from harness import Checks, REPO
from program import environment
import h5py
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent / "earlier"
sys.path.insert(0, str(HERE))
from make_files import RUNS  # noqa: E402

# Of a state's largest number; Newton's tolerance is 1e-8 of the forces by default. Next to nothing holds the pieces of what is torn.
RTOL, TORN = 1e-8, 1e-4


def call(command, folder):
    done = subprocess.run([str(word) for word in command], cwd=folder, env=dict(environment(1), MPLBACKEND="Agg"), capture_output=True, text=True, timeout=300)
    return done.returncode, (done.stdout + done.stderr).strip()


def last(path):
    """The last frame of a trajectory, its moment, and the springs that broke. What nothing holds, as in a periodic box, is where its centre is 0: earlier versions let it drift."""
    with h5py.File(path) as f:
        names = ["states"] if "states" in f else [f"particles/trajectory/{name}" for name in ("position", "velocity")]
        values = [f[f"{name}/value"][-1] for name in names]
        if "particles" in f and b"periodic" in f["particles/trajectory/box"].attrs["boundary"]:
            values[0] = values[0] - values[0].mean(axis=0)
        return values, float(f[f"{names[0]}/time"][-1]), f["events/broken/spring"][...].tolist() if "events/broken" in f else []


def option_files(checks, folder, version):
    """Each begins: two steps, of statics two load steps."""
    found = sorted((folder / "options/problems").glob("*.yaml"))
    solvers = [["-options_file", folder / "options/problems/cubic_lattice.yaml", "-options_file", path] for path in sorted((folder / "options/solvers").glob("*.yaml"))]
    wrong = []
    for options in [*(["-options_file", path] for path in found), *solvers]:
        code, said = call([checks.program, *options, "-ts_max_steps", "2", "-bs_progress_interval", "-1"], folder)
        if code or "backspring: ok" not in said or "there is no option" in said:
            wrong.append(f"{options[-1].name}: {said[-200:]}")
    checks.true(f"{version}: {len(found)} problems and {len(solvers)} solvers", len(found) > 15 and len(solvers) > 3 and not wrong, "; ".join(wrong))


def ends_alike(checks, name, now, then):
    """Both runs have the same moment last, the same state to the tolerance of their solvers, and the same springs that broke, in the same order."""
    (values, time, broken), (stored, moment, were_broken) = last(now), last(then)
    off = max(float(np.abs(a - b).max() / max(np.abs(b).max(), 1e-300)) if a.shape == b.shape else np.inf for a, b in zip(values, stored))
    checks.below(f"{name}, {len(broken)} springs broken", off if abs(time - moment) < 1e-9 and broken == were_broken else np.inf, TORN if len(broken) > 9 else RTOL)


def runs(checks, folder, version):
    for name, (options, _) in RUNS.items():
        if not (folder / f"{name}.h5md").exists():
            continue  # of a later version
        code, said = call([checks.program, *options, "-bs_output", "now.h5md", "-bs_overwrite", "-bs_progress_interval", "-1"], folder)
        checks.true(f"{version}: {name} is repeated", code == 0, said[-200:] if code else "")
        if code == 0:
            ends_alike(checks, f"{version}: {name}, repeated", folder / "now.h5md", folder / f"{name}.h5md")
        code, said = call([checks.program, "-bs_restart", f"{name}.ck", "-ts_max_steps", "1000000", "-bs_progress_interval", "-1"], folder)
        checks.true(f"{version}: {name} is continued from its checkpoint", code == 0, said[-200:] if code else "")
        if code == 0:
            ends_alike(checks, f"{version}: {name}, continued", folder / f"{name}_part.h5md", folder / f"{name}.h5md")


def trajectories(checks, folder, version):
    python, tools = sys.executable, REPO / "postprocess"
    found = sorted(path for path in folder.glob("*.h5md") if not path.stem.endswith(("_part", "now")))
    for path in found:
        code, said = call([python, tools / "plot.py", path, "-o", f"{path.stem}.png"], folder)
        checks.true(f"{version}: {path.stem} is drawn", code == 0 and (folder / f"{path.stem}.png").stat().st_size > 5000, said[-200:] if code else "")
        code, said = call([python, tools / "compare.py", path, path], folder)
        checks.true(f"{version}: {path.stem} is compared", code == 0, said[-200:] if code else "")
        if path.stem == "ladder":
            continue  # circuits have no particles
        code, said = call([python, tools / "convert.py", path, "-o", f"{path.stem}.pvd"], folder)
        checks.true(f"{version}: {path.stem} is converted", code == 0, said[-200:] if code else "")
        code, said = call([checks.program, "-bs_task", "generate", "-bs_lattice_file", path, "-bs_output", f"{path.stem}_last.h5"], folder)
        if code == 0:
            with h5py.File(path) as f:
                stored = f["particles/trajectory/position/value"][-1]
            with h5py.File(folder / f"{path.stem}_last.h5") as f:
                off = float(np.abs(f["particles/position"][...] - stored).max())
        checks.true(f"{version}: {path.stem} is a lattice", code == 0 and off == 0, said[-200:] if code else f"{off}")


def in_python(checks, folder, version):
    package = pathlib.Path(checks.program).parent / "python"
    if not (package / "backspring").is_dir():
        checks.skip(f"{version}: in Python", "the package was not built")
        return
    code = "import sys, backspring as bs\nfor path in sys.argv[1:]:\n    print(len(bs.open(path).times))"
    paths = [path for path in sorted(folder.glob("*.h5md")) if path.stem in RUNS and path.stem != "ladder"]
    done = subprocess.run([sys.executable, "-c", code, *paths], cwd=folder, env=dict(environment(1), PYTHONPATH=str(package)), capture_output=True, text=True)
    checks.true(f"{version}: trajectories are opened in Python", done.returncode == 0 and all(int(n) > 1 for n in done.stdout.split()), done.stderr[-200:] or ", ".join(done.stdout.split()) + " frames")


def main():
    checks = Checks(__doc__)
    archives = sorted(HERE.glob("*.tar.xz"))
    checks.true("versions whose files are stored", len(archives) > 0, ", ".join(path.name[:-7] for path in archives))
    for path in archives:
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch).resolve()
            with tarfile.open(path) as archive:
                archive.extractall(folder)
            for group in (option_files, trajectories, in_python, runs):
                if checks.wants(group.__name__):
                    with checks.group(group.__name__):
                        group(checks, folder, path.name[:-7])
    checks.finish()


if __name__ == "__main__":
    main()
