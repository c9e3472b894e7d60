#!/usr/bin/env python3
"""A run that is stopped and continued from its checkpoint writes the trajectory of the run that was not stopped."""
import pathlib
import shutil
import signal
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import h5py
import numpy as np
from runs import BLOCK, Checks, content, difference, frames, run, start, told, write_lattice

# name, options, ranks, steps before the stop, largest difference of positions and velocities (0: the same in every bit)
CASES = [
    ("beuler", {"ts_type": "beuler"}, 1, 13, 0),
    ("beuler, 2 ranks", {"ts_type": "beuler"}, 2, 13, 0),
    ("cn, 3 ranks", {"ts_type": "cn"}, 3, 13, 0),
    ("theta", {"ts_type": "theta"}, 1, 13, 0),
    ("euler", {"ts_type": "euler", "ts_dt": 0.001, "bs_output_interval": 0.0025}, 1, 13, 0),
    ("symplectic", {"ts_type": "symplectic", "ts_dt": 0.001}, 2, 13, 0),
    ("verlet, 2 ranks", {"ts_type": "verlet", "ts_dt": 0.001}, 2, 13, 0),
    ("verlet, dampers", {"ts_type": "verlet", "ts_dt": 0.001, "bs_lattice_damping": 0.5}, 1, 13, 0),
    ("rk 4", {"ts_type": "rk", "ts_rk_type": "4", "ts_adapt_type": "none", "ts_dt": 0.001}, 1, 13, 0),
    ("beuler, error control", {"ts_type": "beuler", "ts_adapt_type": "basic", "ts_rtol": 1e-3, "ts_atol": 1e-3}, 1, 13, 0),
    ("bdf 2", {"ts_type": "bdf", "ts_adapt_type": "none"}, 1, 13, 0),
    ("bdf 2, error control", {"ts_type": "bdf", "ts_rtol": 1e-3, "ts_atol": 1e-3}, 1, 13, 0),
    ("bdf 4, 2 ranks, while it starts", {"ts_type": "bdf", "ts_bdf_order": 4, "ts_adapt_type": "none", "bs_energy_growth": 0}, 2, 2, 0),
    ("bdf 5, after its start", {"ts_type": "bdf", "ts_bdf_order": 5, "ts_adapt_type": "none", "ts_dt": 0.002}, 1, 7, 0),
    ("bdf 6, in its first steps", {"ts_type": "bdf", "ts_bdf_order": 6, "ts_adapt_type": "none", "ts_dt": 0.002}, 1, 2, 0),
    ("bdf 3, error control", {"ts_type": "bdf", "ts_bdf_order": 3, "ts_rtol": 1e-3, "ts_atol": 1e-3}, 1, 13, 0),
    ("rosw", {"ts_type": "rosw", "ts_adapt_type": "none"}, 1, 5, 0),
    ("arkimex", {"ts_type": "arkimex", "ts_adapt_type": "none"}, 1, 5, 0),
    ("alpha2, 3 ranks", {"ts_type": "alpha2"}, 3, 13, 0),
    ("alpha2, damped, after its first step", {"ts_type": "alpha2", "ts_alpha_radius": 0.5}, 1, 1, 0),
    ("rk 5dp", {"ts_type": "rk", "ts_rk_type": "5dp", "ts_adapt_type": "none", "ts_dt": 0.001}, 1, 13, 1e-10),
    ("ssp", {"ts_type": "ssp", "ts_dt": 0.001}, 1, 13, 0),
    ("512 particles, Cholesky of MUMPS", {"bs_lattice_size": (8, 8, 8), "condensed_pc_type": "cholesky"}, 1, 7, 0),
]

HEAT = {"bs_model": "linear", "bs_linear_type": "heat1d", "bs_linear_size": 60, "bs_linear_source": "step(1)", "ts_type": "cn", "ts_dt": 0.001, "ts_max_time": 0.03,
        "bs_output_interval": 0.002, "bs_progress_interval": -1}


def compare(checks, folder, name, options, ranks, stop, bound, again=None):
    full, part = folder / "full.h5md", folder / "part.h5md"
    code, _, err = run(checks, folder, dict(options, bs_output=full.name, bs_overwrite=True), ranks)
    checks.true(f"{name}: undisturbed", code == 0, err.strip()[:120])
    code, _, err = run(checks, folder, dict(options, bs_output=part.name, bs_overwrite=True, ts_max_steps=stop, bs_checkpoint="ck"), ranks)
    checks.true(f"{name}: stopped after {stop} steps", code == 0, err.strip()[:120])
    code, out, err = run(checks, folder, {"bs_restart": "ck", "ts_max_steps": 1000000}, again or ranks)
    checks.true(f"{name}: continued in silence", code == 0 and not err.strip() and f"step {stop}" in out, err.strip()[:120])
    worst, same = difference(full, part)
    if bound == 0:
        checks.true(f"{name}: every bit of the trajectory and its log", same, f"off by {worst:.3g}")
    else:
        checks.below(f"{name}: positions and velocities", worst, bound)


def methods(checks, folder):
    for name, options, ranks, stop, bound in CASES:
        if checks.wants(name):
            end = 30 * float(options.get("ts_dt", 0.01))
            with checks.group(name):
                compare(checks, folder, name, dict(BLOCK, ts_max_time=end, **options), ranks, stop, bound)
    compare(checks, folder, "linear system", HEAT, 1, 7, 0)
    # the matrix is that of the first sigma, which from step to step differs by rounding
    compare(checks, folder, "linear system, bdf 5, in its first steps", dict(HEAT, ts_type="bdf", ts_bdf_order=5, ts_adapt_type="none"), 1, 2, 1e-12)
    compare(checks, folder, "linear system, bdf 5, after its start", dict(HEAT, ts_type="bdf", ts_bdf_order=5, ts_adapt_type="none"), 1, 9, 1e-12)
    compare(checks, folder, "linear system, 2 ranks", HEAT, 2, 7, 1e-12)
    compare(checks, folder, "from 2 ranks to 3", dict(BLOCK, ts_max_time=0.3), 2, 13, 1e-9, again=3)


def signals(checks, folder):
    """TERM and INT stop after the step and leave a checkpoint, USR1 leaves one and the run goes on; alone and under mpirun.
    Open MPI passes a TERM on after odls_base_sigkill_timeout seconds and kills after as many again."""
    wait = {"OMPI_MCA_odls_base_sigkill_timeout": "5"}
    short = dict(BLOCK, bs_lattice_size=(4, 4, 4), ts_max_time=3, bs_output_xdmf=False, bs_checkpoint="sig", bs_overwrite=True, bs_output_flush=0)
    code, _, err = run(checks, folder, dict(short, bs_output="full.h5md"))
    checks.true("signals: undisturbed", code == 0, err.strip()[:120])
    with h5py.File(folder / "sig") as f:
        steps = f["run"].attrs["step"]
    for sent, expected, ranks in ((signal.SIGTERM, 143, 1), (signal.SIGINT, 130, 1), (signal.SIGUSR1, 0, 2), (signal.SIGTERM, 1, 2)):
        for old in (*folder.glob("sig*"), *folder.glob("part*")):
            old.unlink()
        passed_on = ranks == 2 and sent == signal.SIGTERM
        process = start(checks, folder, dict(short, bs_output="part.h5md", ts_max_time=1e4 if passed_on else 3), ranks, extra=wait)
        path = folder / "part.h5md"
        begun = None
        while process.poll() is None and (begun is None or path.stat().st_size < begun + 8000):
            time.sleep(0.01)
            begun = path.stat().st_size if begun is None and path.exists() else begun
        process.send_signal(sent)
        _, err = process.communicate(timeout=300)
        name = f"{sent.name} on {ranks} rank(s)"
        checks.true(f"{name}: exit {expected}, a checkpoint", process.returncode == expected and (folder / "sig").exists(), f"exit {process.returncode} {err.strip()[:100]}")
        with h5py.File(folder / ("sig.previous" if sent == signal.SIGUSR1 else "sig"), "r") as f:
            step, at = f["run"].attrs["step"], f["run"].attrs["time"]
        if sent == signal.SIGUSR1:
            checks.true(f"{name}: the run went on", 0 < step < steps, f"written at step {step} of {steps}")
            continue
        end = 3 if not passed_on else float(np.ceil(at / 0.025) * 0.025 + 0.25)
        code, _, err = run(checks, folder, {"bs_restart": "sig", "ts_max_time": end}, ranks)
        checks.true(f"{name}: stopped at step {step}, continued", code == 0 and (passed_on or step < steps), err.strip()[:120])
        if passed_on:
            t = content(path)["time"]
            checks.near(f"{name}: no frame missing or double", t, 0.025 * np.arange(len(t)), 1e-9)
            checks.near(f"{name}: to the end", t[-1], end, 1e-9)
        else:
            worst, same = difference(folder / "full.h5md", path)
            checks.true(f"{name}: every bit of the trajectory", same, f"off by {worst:.3g}")


def schedule(checks, folder):
    base = dict(BLOCK, ts_max_time=0.25, bs_output_interval=2**-5, bs_overwrite=True, bs_output="part.h5md")
    code, _, err = run(checks, folder, dict(base, bs_checkpoint="every", bs_checkpoint_every=8))
    with h5py.File(folder / "every") as last, h5py.File(folder / "every.previous") as before:
        end, eighth = last["run"].attrs["step"], before["run"].attrs["step"]
    checks.true("every 8 steps: the last two are kept, the last one at the end", code == 0 and eighth % 8 == 0 and eighth >= end - 8, f"steps {eighth}, {end}")
    checks.true("nothing temporary is left", not list(folder.glob("*.tmp")))
    code, out, err = run(checks, folder, {"bs_restart": "every.previous"})
    checks.true("the one before goes on, too", code == 0 and not err.strip(), err.strip()[:120])
    code, out, err = run(checks, folder, {"bs_restart": "every", "ts_max_time": 0.375})
    checks.true("a finished run is prolonged", code == 0 and not err.strip() and content(folder / "part.h5md")["time"][-1] == 0.375, err.strip()[:120])
    code, _, err = run(checks, folder, dict(base, ts_max_time=0.375, bs_output="full.h5md"))
    checks.true("and is the longer run in every bit", difference(folder / "full.h5md", folder / "part.h5md")[1])
    code, _, err = run(checks, folder, dict(base, bs_checkpoint="clock", bs_checkpoint_minutes=1e-6))
    with h5py.File(folder / "clock.previous") as before:
        checks.true("by the clock", code == 0 and before["run"].attrs["step"] == end - 1, f"step {before['run'].attrs['step']}")


def refusals(checks, folder):
    base = dict(BLOCK, ts_max_time=0.1, bs_overwrite=True)
    run(checks, folder, dict(base, bs_checkpoint="ref", bs_output="ref.h5md"))
    kept = (folder / "ref").read_bytes()
    with h5py.File(folder / "newer", "w") as f, h5py.File(folder / "ref") as old:
        for item in old:
            old.copy(item, f)
        for key, value in old.attrs.items():
            f.attrs[key] = value
        f.attrs["version"] = 99
    damaged = bytearray(kept)
    at = kept.find(np.array(h5py.File(folder / "ref")["state/position"][60, 0]).tobytes())
    damaged[at] ^= 1
    (folder / "bit").write_bytes(bytes(damaged))
    shutil.copy(folder / "ref", folder / "word")
    with h5py.File(folder / "word", "r+") as f:
        f["options"].attrs["bs_gravity"] = np.bytes_("0,0,-9.91")
    shutil.copy(folder / "ref", folder / "number")
    with h5py.File(folder / "number", "r+") as f:
        f["run"].attrs["next_step"] *= 1 + 2**-52
    (folder / "half").write_bytes(kept[:len(kept) // 2])
    linear = dict(HEAT, bs_restart="ref")
    for name, options, words in (
            ("another stiffness", {"bs_restart": "ref", "bs_lattice_stiffness": 4001}, "another lattice"),
            ("another side fixed", {"bs_restart": "ref", "bs_lattice_fixed": "zmax"}, "another lattice"),
            ("another size", {"bs_restart": "ref", "bs_lattice_size": (5, 5, 6)}, "of 125 particles, not 150"),
            ("another dimension", {"bs_restart": "ref", "bs_lattice_type": "square", "bs_lattice_size": (5, 5), "bs_lattice_fixed": "xmin", "bs_gravity": "0,-9.81"}, "in 3 dimensions, not 2"),
            ("another model", linear, "of kind particles"),
            ("a newer version", {"bs_restart": "newer"}, "version 99"),
            ("a flipped bit", {"bs_restart": "bit"}, "checksum"),
            ("an option changed in the file", {"bs_restart": "word"}, "/options does not match its checksum"),
            ("a number changed in the file", {"bs_restart": "number"}, "/run does not match its checksum"),
            ("half a file", {"bs_restart": "half"}, "truncated or damaged"),
            ("no checkpoint but a trajectory", {"bs_restart": "ref.h5md"}, "is not a checkpoint"),
            ("no such file", {"bs_restart": "nothing"}, "no such file"),
            ("a trajectory of another run", {"bs_restart": "ref", "bs_output": "other.h5md"}, "not the trajectory this run wrote"),
            ("a schedule without a file", {"bs_checkpoint_every": 3, **base, "bs_output": None}, "-bs_checkpoint which file"),
            ("a checkpoint that exists", dict(BLOCK, ts_max_time=0.1, bs_checkpoint="ref"), "exists")):
        if name.startswith("a trajectory of another"):
            run(checks, folder, dict(base, ts_dt=0.003, bs_output="other.h5md", bs_output_interval=0.01))
            shutil.copy(folder / "other.h5md", folder / "copy.h5md")
        for ranks in (1, 3):
            code, _, err = run(checks, folder, options, ranks)
            lines = told(err)
            checks.true(f"refused on {ranks} rank(s): {name}", code == 2 and len(lines) == 1 and words in lines[0], "".join(lines)[:160])
    checks.true("what is refused is not touched", (folder / "ref").read_bytes() == kept)
    checks.true("nor is another run's trajectory", difference(folder / "other.h5md", folder / "copy.h5md")[1])
    for k, (name, options, words) in enumerate((("another method", {"ts_type": "bdf"}, "method is bdf"), ("another step", {"ts_dt": 0.005}, "-ts_dt 0.005"),
                                 ("another force", {"bs_gravity": (0, 0, -1)}, "-bs_gravity"))):
        code, _, err = run(checks, folder, dict(options, bs_restart="ref", ts_max_time=0.15, bs_checkpoint=f"new{k}", bs_output=f"new{k}.h5md"))
        checks.true(f"allowed and said: {name}", code == 0 and words in err and frames(folder / f"new{k}.h5md") >= 2, err.strip()[:120])


def inputs(checks, folder):
    """What a run reads besides its options must be what it was: numbers of the lattice each in its row, tables each for its component, to their ends."""
    x = np.array([[0.0, 0], [1, 0], [2, 0.1], [3, 0]])
    lattice = {"pairs": [[0, 1], [1, 2], [2, 3]], "rest_length": 1.0}
    long = "t,x\n" + "".join(f"{k / 10:.9f},{1e-4 * k:.9f}\n" for k in range(4000))
    base = {"bs_lattice_file": "l.h5", "bs_group_end": "ids:3", "bs_motion_end": "x=table:a.csv,y=table:b.csv", "ts_dt": 0.01, "ts_max_time": 0.1, "bs_checkpoint": "in", "bs_advise": False}

    def put(stiffness=(10, 20, 30), mass=(1, 2, 3, 4), tables=(long, "t,x\n0,0\n400,0.1\n")):
        write_lattice(folder / "l.h5", x, mass, stiffness=stiffness, **lattice)
        for name, text in zip("ab", tables):
            (folder / f"{name}.csv").write_text(text)
        return tables
    tables = put()
    code, _, err = run(checks, folder, base)
    checks.true("inputs: a table of several pieces", code == 0 and len(long) > 2**16, err.strip()[:160])
    for name, changes, words in (("as they were", {}, None), ("two springs changed places", {"stiffness": (10, 30, 20)}, "another lattice"),
                                 ("two masses changed places", {"mass": (1, 3, 2, 4)}, "another lattice"), ("tables changed places", {"tables": tables[::-1]}, "its contents have changed"),
                                 ("a table's last number", {"tables": (long[:-2] + "9\n", tables[1])}, "its contents have changed")):
        put(**changes)
        for ranks in (1, 3):
            code, _, err = run(checks, folder, {"bs_restart": "in", "ts_max_time": 0.11, "bs_checkpoint": f"out{ranks}", "bs_overwrite": True}, ranks)
            lines = told(err)
            good = code == 0 and not lines if words is None else code == 2 and len(lines) == 1 and words in lines[0]
            checks.true(f"inputs, {ranks} rank(s): {name}", good, "".join(lines)[:160])
    scene = "#1.0 *** XSpringies data file\nmass 1 100 100 0 0 1 0.9\nmass 2 150 100 0 0 -1 0.9\nspng 1 1 2 10 1 50\nfrce 0 1 {} 0\n"
    for gravity in (10, 11):
        (folder / "s.xsp").write_text(scene.format(gravity))
        first = {"bs_lattice_file": "s.xsp", "ts_dt": 0.01, "ts_max_time": 0.1, "bs_checkpoint": "sc", "bs_advise": False}
        code, _, err = run(checks, folder, first if gravity == 10 else {"bs_restart": "sc", "ts_max_time": 0.2})
        checks.true(f"inputs: a scene of gravity {gravity}", code == (0 if gravity == 10 else 2) and ("its contents have changed" in err) == (gravity == 11), err.strip()[:160])


def main():
    checks = Checks(__doc__)
    for part in (methods, signals, schedule, refusals, inputs):
        if checks.wants(part.__name__) or part is methods:
            with tempfile.TemporaryDirectory() as folder, checks.group(part.__name__):
                part(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
