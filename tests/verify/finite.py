#!/usr/bin/env python3
"""What is given over time (motions, boxes, anchors, tables, expressions, loads) may jump, grow beyond all bounds or leave a box without volume, and
numbers may be too large: whatever a run leaves behind, every number in its files is finite, and the last frame is one that can be."""
import decimal
import itertools
import json
import pathlib
import subprocess
import tempfile

import h5py
from harness import run_parts
import numpy as np
from program import environment, words

DRIVEN = {"bs_lattice_type": "square", "bs_lattice_size": "3,3", "bs_lattice_fixed": "ymin", "bs_lattice_damping": 0.1, "bs_group_g": "ymax"}
BOXED = {"bs_lattice_type": "square", "bs_lattice_size": "3,3", "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.1, "bs_lattice_seed": 2}
ANCHORED = {**DRIVEN, "bs_anchor_group": "g", "bs_anchor_stiffness": 1}
STEPPED = {"ts_dt": 0.05, "ts_max_time": 0.5}
TYPES = {"beuler": {}, "cn": {}, "symplectic": {}, "verlet": {}, "alpha2": {}, "bdf": {}, "rk": {"ts_adapt_type": "none"}}


def motion(text):
    return {**DRIVEN, "bs_motion_g": text}


SOURCES = {
    "a velocity": motion("velocity:0.1,0"), "a velocity of 1e200": motion("velocity:1e200,0"), "a velocity of 1e308": motion("velocity:1e308,0"),
    "a sinusoid": motion("x=sinusoid:0.1,2"), "a sinusoid of 1e200 Hz": motion("x=sinusoid:0.1,1e200"), "a rotation": motion("rotation:1,0,0"),
    "a rotation of 1e300": motion("rotation:1e300,0,0"), "1/t": motion("x=expression:1/t"), "log(t)": motion("x=expression:log(t)"),
    "sin(t)/t": motion("x=expression:sin(t)/t"), "sqrt(t)": motion("x=expression:sqrt(t)"), "t^1.5": motion("x=expression:t^1.5"),
    "a pole": motion("x=expression:0.1/(t-0.3)"), "a pole beside the steps": motion("x=expression:0.1/(t-0.3123)"), "exp(1e4*t)": motion("x=expression:exp(1e4*t)"),
    "sqrt(0.3-t)": motion("x=expression:sqrt(0.3-t)"), "a jump at a step": motion("x=expression:0.1*step(t-0.3)"),
    "a jump between steps": motion("x=expression:0.1*step(t-0.3123)"), "a jump by the place": motion("x=expression:0.1*step(t-0.3-0.01*x0)"),
    "a jump of the sign": motion("x=expression:0.1*(t-0.3)/abs(t-0.3)"), "a ramp": motion("x=expression:0.1*(t*(1-step(t-0.3))+0.3*step(t-0.3))"),
    "a table": motion("x=table:ramp.csv"), "box: a rate": {**BOXED, "bs_box_rate": "xx=0.5"}, "box: to nothing": {**BOXED, "bs_box_rate": "xx=-2.5"},
    "box: through nothing": {**BOXED, "bs_box_rate": "xx=-9"}, "box: through nothing twice": {**BOXED, "bs_box_rate": "xx=-9,yy=-9"},
    "box: nothing from the start": {**BOXED, "bs_box_strain": "xx=expression:-1"}, "box: 1/t": {**BOXED, "bs_box_strain": "xx=expression:1/t"},
    "box: a jump": {**BOXED, "bs_box_strain": "xy=expression:0.1*step(t-0.3)"}, "box: 1e300": {**BOXED, "bs_box_strain": "xx=velocity:1e300"},
    "box: a table": {**BOXED, "bs_box_strain": "xy=table:ramp.csv"}, "anchors of 1e308": {**ANCHORED, "bs_anchor_motion": "velocity", "bs_anchor_velocity": "1e308,0"},
    "anchors at 1e200 Hz": {**ANCHORED, "bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": "1e200,0", "bs_anchor_frequency": 1e200},
    "gravity of 1e300": {**DRIVEN, "bs_gravity": "0,-1e300"}, "masses of 1e-300": {**DRIVEN, "bs_lattice_particle_mass": 1e-300, "bs_gravity": "0,-1"},
    "masses of 1e300": {**DRIVEN, "bs_lattice_particle_mass": 1e300, "bs_lattice_velocity": "1e10,0"}, "speeds of 1e200": {**DRIVEN, "bs_lattice_velocity": "1e200,0"},
    "stiffness of 1e305": {**DRIVEN, "bs_lattice_stiffness": 1e305, "bs_lattice_perturbation": 0.1},
}


def not_finite(file, failed):
    """Datasets and attributes of real numbers that are not finite. Documented: strains of springs that have none; what the
    run finds at its end until it has ended well."""
    bad, ends = [], ("compliance/matrix", "moduli/stiffness")
    with h5py.File(file) as f:
        def look(name, item):
            for key, value in item.attrs.items():
                if isinstance(value, (float, np.floating)) and not np.isfinite(value):
                    bad.append(f"{name}@{key}")
            if not isinstance(item, h5py.Dataset) or item.dtype.kind != "f":
                return
            values = item[...]
            if not (np.isfinite(values) | ((name == "backspring/strain/value") | (failed and name in ends)) & np.isnan(values)).all():
                bad.append(name)
        f.visititems(look)
    return bad


def leave(checks, options):
    """(exit code, what it says, what in its files is not finite, {file: exists})."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "ramp.csv").write_text("t,s\n0,0\n0.3,0.1\n1,0.1\n")
        mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []
        modes = options.get("bs_task") == "modes"
        kept = {} if modes else {"bs_checkpoint": "c.ck", "bs_checkpoint_every": 2}
        done = subprocess.run([*mpi, checks.program, *words({**options, **kept, "bs_output": "r.h5md", "bs_report": "r.json"})], cwd=folder, capture_output=True,
                              text=True, timeout=60, env=environment(checks.ranks))
        bad = [f"{file.name}:{one}" for file in folder.iterdir() if file.name in ("r.h5md", "c.ck", "r.h5md.checkpoint") for one in not_finite(file, done.returncode != 0)]
        if (folder / "r.json").exists():
            report = json.loads((folder / "r.json").read_text())
            bad += [key for key, value in report.items() if key.startswith(("first_", "last_")) and None in np.ravel(value).tolist()]
        return done.returncode, done.stderr.strip(), bad


def walk(checks, folder):
    """Sources x tasks, with three types in turn for each source (--full: all)."""
    kinds = itertools.cycle(TYPES)
    runs = []
    for name, source in SOURCES.items():
        chosen = list(TYPES) if checks.full else list(itertools.islice(kinds, 3))
        runs += [(f"{name}, {kind}", {**source, **STEPPED, "ts_type": kind, **TYPES[kind]}) for kind in chosen]
        tasks = ["statics", "modes", *(["moduli"] if source["bs_lattice_size"] and "bs_lattice_periodic" in source else [])]
        runs += [(f"{name}, {task}", {**source, "bs_task": task, **({"bs_load_steps": 4} if task != "modes" else {"bs_modes": 3})}) for task in tasks]
    texts = dict(runs)

    def one(mine, name):
        code, said, bad = leave(mine, texts[name])
        known = code in (0, 2, 3) and (code == 0 or said.count("backspring: error: ") == 1)
        mine.true(name, known and not bad, f"exit {code}, not finite: {bad}, {said[-160:]}" if bad or not known else f"exit {code}")
    checks.each([name for name, _ in runs], one)


def jumps(checks, folder):
    """A jump ends dynamics before it begins and is a load like others in statics; what only bends is followed."""
    chain = {"bs_lattice_type": "chain", "bs_lattice_size": 5, "bs_lattice_dim": 1, "bs_lattice_stiffness": 8, "bs_lattice_fixed": "xmin", "bs_group_g": "xmax"}
    for kind, more in TYPES.items():
        code, said, bad = leave(checks, {**chain, "bs_motion_g": "x=expression:0.1*step(t-0.5)", "ts_type": kind, **more, "ts_dt": 0.01, "ts_max_time": 1})
        checks.true(f"jump, {kind}", code == 2 and "-bs_motion_g: the motion of particle 4 jumps at t = 0.5 s" in said, said)
    r = checks.run({**chain, "bs_motion_g": "x=expression:0.1*step(t-0.5)", "bs_task": "statics", "bs_load_steps": 4}, interval=0).trajectory
    checks.near("in statics the springs bear k u/4 from there on", np.ravel(r.observables["reaction/g"]), np.array([0, 0, 1, 1, 1]) * 8 * 0.1 / 4, 1e-12)
    (folder / "rest.csv").write_text("t,s\n0,0\n0.5,0\n1,0.05\n")
    for kind, more in TYPES.items():
        found = [checks.run({**chain, "bs_motion_g": text, "ts_type": kind, **more, "ts_dt": 0.01, "ts_max_time": 1}, interval=0.25).trajectory
                 for text in ("x=expression:0.1*(t-0.5)*step(t-0.5)", f"x=table:{folder / 'rest.csv'}")]
        checks.near(f"what bends from rest is followed, {kind}", found[0].position, found[1].position, 1e-14)
    (folder / "s.csv").write_text("t,s\n0,0\n0.5,0.05\n1,0.05\n")
    bent = {**chain, "ts_type": "cn", "ts_dt": 0.01, "ts_max_time": 1}
    found = [checks.run({**bent, "bs_motion_g": text}, interval=0.25).trajectory
             for text in ("x=expression:0.1*(t*(1-step(t-0.5))+0.5*step(t-0.5))", f"x=table:{folder / 's.csv'}", "x=expression:0.05*(t+0.5-abs(t-0.5))")]
    for k, name in ((1, "a ramp by step() is the table's"), (2, "a ramp by abs() too")):
        checks.near(name, found[0].position, found[k].position, 1e-14)
        checks.near(name + ", velocities", found[0].velocity, found[k].velocity, 1e-13)


def decimals(checks, folder):
    """Steps end at the decimals that their number says, where rows of tables and step() are met by their own time, not missed by the rounding of a sum."""
    chain = {"bs_lattice_type": "chain", "bs_lattice_size": 3, "bs_lattice_dim": 1, "bs_lattice_fixed": "xmin", "bs_group_g": "xmax", "bs_lattice_damping": 1}
    for kind, h, start, interval in (("beuler", "0.1", "0", 0), ("cn", "0.01", "0", 0), ("symplectic", "0.003", "0", 0), ("beuler", "0.1", "0.05", 0), ("bdf", "0.07", "0", 0.21)):
        steps, row = 60, 27
        times = [float(decimal.Decimal(start) + k * decimal.Decimal(h)) for k in range(steps + 1)]
        (folder / "row.csv").write_text("t,s\n-1,0\n" + f"{times[row]},0\n{times[-1]},{times[-1] - times[row]}\n")
        for name, text in (("table", f"x=table:{folder / 'row.csv'}"), ("expression", f"x=expression:(t-{times[row]})*step(t-{times[row]})")):
            r = checks.run({**chain, "bs_motion_g": text, "ts_type": kind, "ts_dt": h, "ts_init_time": start, "ts_max_time": times[-1], **({"ts_adapt_type": "none"} if kind == "bdf" else {})},
                           interval=interval).trajectory
            last = r.velocity[:, np.argsort(r.id)][:, -1, 0]
            stride, at_row = 3 if interval else 1, 0.5 if kind in ("cn", "bdf") else 1.0  # the mean of both slopes where it keeps order 2
            ends = np.array(times[::stride])
            checks.near(f"{kind}, {name}, steps of {h} s from {start} s: their ends", r.time, ends, 0)
            checks.near(f"{kind}, {name}, steps of {h} s from {start} s: the row is met at its time", last, np.where(ends == times[row], at_row, np.where(ends > times[row], 1.0, 0.0)), 1e-12)


def volumes(checks, folder):
    """A box that is about to have no volume ends the run with the last frame that has one."""
    base = {**BOXED, "ts_dt": 0.01, "ts_max_time": 0.1}
    for rate, last in ((-10, 0.09), (-20, 0.04)):
        result = checks.run({**base, "bs_box_rate": f"xx={rate}"}, interval=0, expect=3)
        checks.true(f"rate {rate}: told", "the periodic box has no volume left on the way from" in result.stderr, result.stderr[-200:])
        checks.near(f"rate {rate}: last frame", result.trajectory.time[-1], last, 1e-12)
    half = checks.run({**base, "bs_box_rate": "xx=-5"}, interval=0)
    checks.true("to half its length it is followed", half.code == 0 and abs(half.trajectory.time[-1] - 0.1) < 1e-12)
    for task, strain, code in (("statics", "velocity:-2", 3), ("statics", "velocity:-1", 3), ("moduli", "velocity:-1", 2), ("statics", "velocity:-0.5", 0)):
        result = checks.run({**BOXED, "bs_task": task, "bs_box_strain": f"xx={strain}", **({"bs_load_steps": 4} if code != 2 else {})}, interval=0, expect=code)
        checks.true(f"{task}, {strain}: exit {code}", result.code == code)
    twice = checks.run({**base, "ts_dt": 0.1, "bs_box_rate": "xx=-20,yy=-20"}, expect=2)  # det F = 1 at both ends of the step
    checks.true("through nothing along both edges", "no volume left" in twice.stderr, twice.stderr[-200:])


if __name__ == "__main__":
    run_parts(__doc__, (walk, jumps, decimals, volumes))
