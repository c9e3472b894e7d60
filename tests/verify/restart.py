#!/usr/bin/env python3
"""A run that is stopped and continued ends with the files of the run that was not stopped: every dataset and attribute of its trajectory and of its
last checkpoint, and every number of its report, in every bit, but wall clock times."""
import json
import subprocess

from breaking import plate
import h5py
from harness import run_parts, write_lattice
import numpy as np
from program import environment, words

MANY = 1000000
STATICS = {"bs_task": "statics"}
BLOCK = {"bs_lattice_type": "cubic", "bs_lattice_size": (3, 3, 4), "bs_lattice_spacing": 0.2, "bs_lattice_fixed": "zmin", "bs_lattice_stiffness": 4000,
         "bs_spring_law": "strain", "bs_gravity": (0, 0, -9.81), "bs_lattice_perturbation": 0.05, "ts_dt": 0.01, "ts_max_time": 0.12, "bs_output_interval": 0.025}

YIELDING = {"bs_spring_law": "plastic", "bs_spring_yield_force": 20, "bs_spring_hardening": 300, "bs_lattice_velocity_gradient": (0, 0, 3, 0, 0, 0, 0, 0, -4)}


def content(path):
    """Every attribute and dataset of an HDF5 file by name, as type, shape and bytes."""
    found = {}

    def put(name, value):
        value = np.asarray(value)
        found[name] = (str(value.dtype), value.shape, str(value.tolist()) if value.dtype == object else value.tobytes(), value)

    def keep(name, item):
        for key, value in item.attrs.items():
            put(f"{name}@{key}", value)
        if isinstance(item, h5py.Dataset):
            put(name, item[()])
    with h5py.File(path, "r") as f:
        keep("", f)
        f.visititems(keep)
    found.pop("parameters/options@ts_max_steps", None)  # of the run that made the trajectory: by it the test stops
    return found


def differences(a, b):
    """Names of what is not the same in every bit, with the first two of the values."""
    a, b = content(a), content(b)
    out = []
    for name in sorted(a.keys() | b.keys()):
        if name not in a or name not in b:
            out.append(f"{name} only in the {'whole' if name in a else 'continued'} run")
        elif a[name][:3] != b[name][:3]:
            out.append(f"{name}: {np.ravel(a[name][3])[:3]} for {np.ravel(b[name][3])[:3]}")
    return len(a), out


def go(checks, folder, options, expect=0):
    folder.mkdir(exist_ok=True)
    mpi = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []
    done = subprocess.run([*mpi, checks.program, *words(options)], cwd=folder, capture_output=True, text=True, env=environment(checks.ranks))
    if done.returncode != expect:
        raise ValueError(f"exit {done.returncode}: {done.stderr.strip()[-300:]}")
    return done


def report(folder):
    numbers = json.loads((folder / "r.json").read_text())
    return {key: value for key, value in numbers.items() if key != "wall"}


INPUTS = ("bs_lattice_file", "bs_netlist")  # which lie beside the folders of the runs


def compare(checks, folder, name, options, stops):
    """stops: the steps after which the run is stopped and continued, besides before the first; None: after every one."""
    base = {"bs_progress_interval": -1, "ts_max_steps": MANY, "bs_output": "r.h5md", "bs_checkpoint": "c", "bs_report": "r.json", **options}
    whole = folder / f"{name} whole"
    go(checks, whole, base)
    steps = report(whole)["steps"]
    for number, stop in enumerate((0, *stops)):
        parts = folder / f"{name} {number}"
        at = range(1, steps) if stop is None else [stop]
        where = "every step" if stop is None else f"step {stop} of {steps}"
        for k in at:
            first = k == at[0]
            go(checks, parts, {**base, "ts_max_steps": k} if first else {"bs_restart": "c", "ts_max_steps": k, "bs_report": "r.json", "bs_overwrite": True,
                                                                         **{key: options[key] for key in INPUTS if key in options}})
        go(checks, parts, {"bs_restart": "c", "ts_max_steps": MANY, "bs_report": "r.json", "bs_overwrite": True,
                           **{key: options[key] for key in INPUTS if key in options}})
        checks.true(f"{name}, stopped after {where}: it was on its way", 0 <= at[-1] < steps, f"{steps} steps")
        for kind, file in (("checkpoint", "c"), ("trajectory", "r.h5md"))[:1 if base["bs_output"] is None else 2]:
            count, differ = differences(whole / file, parts / file)
            checks.true(f"{name}, stopped after {where}: {kind}", not differ, f"{count} entries; " + "; ".join(differ)[:600])
        a, b = report(whole), report(parts)
        differ = [f"{key}: {a.get(key)} for {b.get(key)}" for key in sorted(a.keys() | b.keys()) if a.get(key) != b.get(key)]
        checks.true(f"{name}, stopped after {where}: report", not differ, f"{len(a)} entries; " + "; ".join(differ)[:600])


def taut_cables(folder):
    """A cube that is pulled upwards, with cables 10^4 times stiffer than its springs, which are slack at first: which pairs are stiff changes on the way."""
    n = 5
    grid = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
    row = np.arange(n**3).reshape(n, n, n)
    pairs = []
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1)):
        low, high = (tuple(slice(s * side, n - s * (1 - side)) for s in step) for side in (0, 1))
        pairs.append(np.column_stack([row[low].ravel(), row[high].ravel()]))
    pairs = np.vstack(pairs)
    cable = np.random.default_rng(1).random(len(pairs)) < 0.2
    x = 0.1 * grid
    length = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    file = write_lattice(folder / "cables.h5", x, 1.0, fixed=grid[:, 2] == 0, velocity=x * [0, 0, 4], pairs=pairs, stiffness=np.where(cable, 1e6, 10.0),
                         rest_length=length * np.where(cable, 1.005, 1), laws=np.where(cable, "tension", "hooke"))
    return {"bs_lattice_file": str(file), "bs_output_interval": 0.01, "ts_dt": 0.002, "ts_max_time": 0.02, "condensed_pc_type": "bicc", "bs_checkpoint_every": 1}


def dynamics(checks, folder):
    for name, options, stops in (("beuler", {}, (5, None)), ("cn", {"ts_type": "cn"}, (7, None)), ("bdf", {"ts_type": "bdf", "ts_adapt_type": "none"}, (5, None)),
                                 ("error control", {"ts_adapt_type": "basic", "ts_rtol": 1e-2, "ts_atol": 1e-2}, (5, 9)),
                                 ("alpha2", {"ts_type": "alpha2", "bs_lattice_damping": 0.5}, (5, None)),
                                 ("verlet, beyond its limit", {"ts_type": "verlet", "ts_dt": 0.02, "ts_max_time": 0.4, "bs_output_interval": 0.1, "bs_advise": False}, (2, 12, None)),
                                 ("rk, plastic springs", {"ts_type": "rk", "ts_adapt_type": "none", "ts_dt": 0.002, "ts_max_time": 0.03, "bs_output_interval": 0.01, **YIELDING}, (5, 9)),
                                 ("rk 5dp, plastic springs", {"ts_type": "rk", "ts_rk_type": "5dp", "ts_adapt_type": "none", "ts_dt": 0.002, "ts_max_time": 0.03, **YIELDING}, (5, 9)),
                                 ("rejected steps", {"bs_lattice_stiffness": 4e6, "snes_max_it": 3, "ts_max_time": 0.04}, (3, None)),
                                 ("another start", {"ts_init_time": 1.03, "ts_max_time": 1.15}, (5,)),
                                 ("loose tolerances", {"snes_rtol": 0.3, "bs_energy_growth": 0}, (5, None)),
                                 ("end at rest", {"bs_lattice_damping": 500, "ts_max_time": 100, "ts_dt": 0.5, "bs_stop_at_rest": 1e-3}, (2, None)),
                                 ("without a trajectory", {"bs_output": None, "ts_type": "verlet", "ts_dt": 0.005, "ts_max_time": 0.3, "bs_output_interval": 0.1}, (5, 41, None)),
                                 ("inner solver", {"condensed_pc_type": "bicc", "bs_checkpoint_every": 1}, (5, None)),
                                 ("guess by sub-steps", {"bs_lattice_velocity_gradient": (0, 0, 0, 0, 0, 0, 0, 0, -60), "condensed_pc_type": "bicc", "bs_checkpoint_every": 1, "ts_max_time": 0.08}, (1, 3, None))):
        compare(checks, folder, name, {**BLOCK, **options}, stops)
    # iterations take more work than factors, which take their place until the next checkpoint
    stiff = {"bs_lattice_size": (12, 12, 12), "bs_lattice_neighbors": 18, "bs_lattice_perturbation": 0, "bs_lattice_stiff_fraction": 0.25, "bs_lattice_stiff_factor": 1e6,
             "bs_gravity": (0.1, 0.1, -0.1), "ts_max_time": 0.04, "bs_checkpoint_every": 1, "condensed_pc_bicc_fill": 0}
    compare(checks, folder, "factors for iterations", {**BLOCK, **stiff}, (2,))
    changed = report(folder / "factors for iterations whole")["factored"]
    checks.true("factors for iterations: after every checkpoint", changed > 1, str(changed))
    compare(checks, folder, "factors filled by stiff springs", {**BLOCK, **stiff, "condensed_pc_bicc_fill": None}, (2,))
    compare(checks, folder, "cables that become taut", taut_cables(folder), (None,))
    heat = {"bs_model": "linear", "bs_linear_type": "heat1d", "bs_linear_size": 40, "bs_linear_source": "step(1)", "ts_type": "cn", "ts_dt": 0.001, "ts_max_time": 0.01, "bs_output_interval": 0.0025}
    compare(checks, folder, "linear system", heat, (4, None))
    (folder / "rl.cir").write_text("t\nV1 in 0 PULSE(0 5 0.13m 0.01m 0.01m 0.3m 1m)\nR1 in a 100\nL1 a b 10m\nC1 b 0 1u IC=1\nR2 b 0 1k\nI1 0 b SIN(0 1m 1k 0.1m)\n")
    circuit = {"bs_model": "linear", "bs_netlist": str(folder / "rl.cir"), "ts_type": "rosw", "ts_dt": 1e-5, "ts_max_time": 1e-3, "bs_output_interval": 3.7e-5}
    compare(checks, folder, "circuit, error control", circuit, (2, 4, 6, None))


def statics(checks, folder):
    """A truss that snaps through; a net that is not at rest as it is given; a column past its buckling load; a box under given stress."""
    file = write_lattice(folder / "truss.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0)
    compare(checks, folder, "truss", {**STATICS, "bs_lattice_file": str(file), "bs_gravity": "0,-0.02", "bs_load_steps": 8}, (2, 6, None))
    compare(checks, folder, "truss without a trajectory", {**STATICS, "bs_output": None, "bs_lattice_file": str(file), "bs_gravity": "0,-0.02", "bs_load_steps": 8}, (2, 6, None))
    net = {**STATICS, "bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_perturbation": 0.05, "bs_load_steps": 6}
    compare(checks, folder, "stressed net", {**net, "bs_lattice_fixed": "xmin,xmax", "bs_lattice_rest_length_factor": 1.05, "bs_gravity": "0,-0.01"}, (1, None))
    compare(checks, folder, "column", {**STATICS, "bs_lattice_type": "square", "bs_lattice_size": "3,12", "bs_lattice_stiffness": 100, "bs_lattice_neighbors": 8,
                                       "bs_lattice_fixed": "ymin", "bs_gravity": "0,-2", "bs_load_steps": 6}, (2, None))
    compare(checks, folder, "box under stress", {**net, "bs_lattice_periodic": "xy", "bs_box_strain": "xx=velocity:0.05", "bs_box_stress": "yy=0,xy=0.01"}, (2, None))
    compare(checks, folder, "inner solver", {**net, "bs_lattice_fixed": "xmin", "bs_gravity": "0,-0.01", "condensed_pc_type": "bicc", "bs_checkpoint_every": 1}, (2, None))


def breaking(checks, folder):
    x, pairs, _ = plate(6, 6)
    low, high = x[:, 1] == x[:, 1].min(), x[:, 1] == x[:, 1].max()
    file = str(write_lattice(folder / "flying.h5", x, 1.0, velocity=0.4 * (x - x.mean(axis=0)), pairs=pairs, stiffness=1.0, rest_length=1.0))
    held = str(write_lattice(folder / "held.h5", x, 1.0, fixed=low, pairs=pairs, stiffness=1.0, rest_length=1.0, damping=0.1))
    with h5py.File(held, "a") as f:
        f["groups/top"] = np.flatnonzero(high)
    motion = {"bs_lattice_file": file, "ts_dt": 0.1, "ts_max_time": 2, "bs_break_strain": 0.35, "bs_break_weibull": "4,1", "bs_output_interval": 0.25}
    for name, options in (("beuler", {"ts_type": "beuler"}), ("verlet", {"ts_type": "verlet"}), ("alpha2", {"ts_type": "alpha2"})):
        compare(checks, folder, name, {**motion, **options}, (8, None))
    pull = {**STATICS, "bs_lattice_file": held, "bs_motion_top": "velocity:0,2.0", "bs_load_steps": 12, "bs_break_strain": 0.2, "bs_break_weibull": "4,1", "bs_break": "worst"}
    for name, options in (("statics", {}), ("motions after breaks", {"bs_break_follow": "dynamics", "bs_break_output_interval": 20})):
        compare(checks, folder, name, {**pull, **options}, (4, 8, None))


def plastic(checks, folder):
    springs = {"bs_spring_law": "plastic", "bs_spring_yield_force": 0.1, "bs_spring_hardening": 0.2}
    x, pairs, _ = plate(5, 5)
    flying = str(write_lattice(folder / "flying.h5", x, 1.0, velocity=0.4 * (x - x.mean(axis=0)), pairs=pairs, stiffness=1.0, rest_length=1.0))
    motion = {**springs, "bs_lattice_file": flying, "ts_dt": 0.1, "ts_max_time": 1.5, "bs_output_interval": 0.25}
    for name, options in (("beuler", {}), ("verlet", {"ts_type": "verlet"}), ("that break", {"bs_break_strain": 0.35, "bs_break_weibull": "4,1"})):
        compare(checks, folder, name, {**motion, **options}, (7, None))
    held = str(write_lattice(folder / "held.h5", x, 1.0, fixed=x[:, 1] == x[:, 1].min(), pairs=pairs, stiffness=1.0, rest_length=1.0))
    with h5py.File(held, "a") as f:
        f["groups/top"] = np.flatnonzero(x[:, 1] == x[:, 1].max())
    for name, options in (("load steps", {}), ("given beyond the yield force", {"bs_spring_yield_force": 1e-3})):
        compare(checks, folder, name, {**springs, **STATICS, "bs_lattice_file": held, "bs_motion_top": "y=sinusoid:0.5,1", "bs_load_steps": 8, **options}, (3, None))


def driven(checks, folder):
    base = {"bs_lattice_type": "square", "bs_lattice_size": "5,5", "bs_lattice_stiffness": 100, "bs_lattice_damping": 0.1, "bs_group_left": "xmin", "bs_group_right": "xmax",
            "bs_motion_left": "fixed", "bs_motion_right": "x=sinusoid:0.1,0.5,y=free"}
    for kind in ("cn", "bdf", "alpha2", "verlet"):
        compare(checks, folder, kind, {**base, "ts_type": kind, "ts_dt": 0.02, "ts_max_time": 0.3, "ts_adapt_type": "none", "bs_output_interval": 0.05}, (6, None))
    compare(checks, folder, "load steps", {**base, **STATICS, "bs_lattice_neighbors": 8, "bs_load_steps": 6}, (2, None))
    compare(checks, folder, "angle springs in a box", {"bs_lattice_type": "square", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy", "bs_angle_stiffness": 3,
                                                       "bs_lattice_perturbation": 0.05, "bs_box_strain": "xy=velocity:0.05", "ts_dt": 0.05, "ts_max_time": 0.5}, (4,))
    compare(checks, folder, "box", {"bs_lattice_type": "triangular", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy", "bs_lattice_perturbation": 0.05, "bs_lattice_damping": 0.1,
                                    "bs_box_strain": "xy=velocity:0.05", "ts_dt": 0.1, "ts_max_time": 1, "bs_output_interval": 0.25}, (4, None))


SHEET = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_stiffness": 100, "bs_lattice_damping": 0.1, "bs_lattice_perturbation": 0.02, "ts_dt": 0.01, "ts_max_time": 0.1,
         "bs_output": "r.h5md", "bs_checkpoint": "c", "bs_progress_interval": -1}


def rows(path):
    """How many rows each dataset has that grows with the frames."""
    with h5py.File(path) as f:
        sizes = {}
        f.visititems(lambda name, item: sizes.__setitem__(name, len(item)) if name.endswith("/value") else None)
        return len(f["particles/trajectory/position/time"]), sizes


def form(checks, folder):
    """A trajectory that goes on keeps its form: what it cannot take is refused before the first step, and no byte is changed; what it lacks is warned of. Every dataset has a row for
    every frame."""
    box = {**SHEET, "bs_lattice_periodic": "xy"}
    refused = (("another width", SHEET, {"bs_output_pad": 3}, "the trajectory r.h5md has 2 columns per particle, and this run writes 3: leave out -bs_output_pad 3, or give another -bs_output"),
               ("a width less", {**SHEET, "bs_output_pad": 3}, {"bs_output_pad": 2}, "has 3 columns per particle, and this run writes 2: leave out -bs_output_pad 2"),
               ("without strains", SHEET, {"bs_output_strain": False}, "the trajectory r.h5md has /backspring/strain in every frame, and this run does not write it: leave out -bs_output_strain false"),
               ("tensions for strains", SHEET, {"bs_output_springs": True}, "has /backspring/strain in every frame"),
               ("without stresses", {**SHEET, "bs_output_stress": True}, {"bs_output_stress": False}, "has /particles/trajectory/stress_volume in every frame"),
               ("a box that shears", box, {"bs_box_strain": "xy=velocity:0.1"}, "the trajectory r.h5md has 2 numbers a frame in /particles/trajectory/box/edges, and this run writes 4"),
               ("springs that may break", SHEET, {"bs_break_strain": 0.1}, "option -bs_break_strain: c is the checkpoint of a run without it, in which that could not break: leave it out, or start a new run"))
    for name, first, more, message in refused:
        place = folder / name
        go(checks, place, first)
        before = {path.name: path.read_bytes() for path in place.iterdir()}
        done = go(checks, place, {"bs_restart": "c", "ts_max_time": 0.2, **more}, expect=2)
        errors = [line for line in done.stderr.splitlines() if "error" in line]
        checks.true(f"{name}: refused in one line", len(errors) == 1 and message in errors[0], done.stderr.strip()[-300:])
        after = {path.name: path.read_bytes() for path in place.iterdir() if not path.name.endswith(".lock")}
        checks.true(f"{name}: nothing is touched", after == {key: text for key, text in before.items() if not key.endswith(".lock")}, str([key for key in after if after[key] != before.get(key)]))
    given, lacks = "the trajectory r.h5md goes on in the form in which it was begun: ", "which this run leaves out"
    for name, more, message in (("stresses", {"bs_output_stress": True}, "it has no /particles/trajectory/stress_volume, " + lacks),
                                ("tensions beside strains", {"bs_output_springs": True, "bs_output_strain": True}, "it has no /observables/springs/tension, /observables/springs/strain, " + lacks),
                                ("units", {"bs_output_units": "SI"}, "it takes nothing of -bs_output_units SI: give another -bs_output"), ("single precision", {"viewer_hdf5_sp_output": True}, "it takes nothing of -viewer_hdf5_sp_output"),
                                ("a force on a group", {"bs_group_top": "ymax", "bs_force_top": "0,1"}, "it has no /observables/force"), ("nothing", {}, None),
                                ("frames at other times", {"bs_output_interval": 0.02, "bs_output_flush": 0}, None)):
        place = folder / f"warned {name}"
        go(checks, place, SHEET)
        said = go(checks, place, {"bs_restart": "c", "ts_max_time": 0.2, **more}).stderr
        checks.true(f"{name}: {'warned of' if message else 'no warning'}", given + message in said if message else given not in said, said.strip()[-300:])
        frames, sizes = rows(place / "r.h5md")
        checks.true(f"{name}: a row for every frame", frames > 11 and set(sizes.values()) == {frames}, f"{frames} frames; {[key for key in sizes if sizes[key] != frames]}")
    place = folder / "another file"
    go(checks, place, SHEET)
    said = go(checks, place, {"bs_restart": "c", "ts_max_time": 0.2, "bs_output": "other.h5md", "bs_output_pad": 3, "bs_output_springs": True}).stderr
    with h5py.File(place / "other.h5md") as f:
        checks.true("another file takes another form", given not in said and f["particles/trajectory/position/value"].shape[2] == 3 and "springs" in f["observables"], said.strip()[-200:])


def sidecars(checks, folder):
    """Without a sidecar from now on: the one that is there goes, where it is one of this trajectory's, and what is written for viewers stays as long as the rest."""
    for name, first, again in (("continued", {**SHEET, "bs_break_strain": 0.5}, {"bs_restart": "c", "ts_max_time": 0.2}), ("written anew", SHEET, {**SHEET, "bs_overwrite": True})):
        place = folder / name
        go(checks, place, first)
        there = (place / "r.h5md.xdmf").read_text()
        go(checks, place, {**again, "bs_output_xdmf": False})
        checks.true(f"{name}: the sidecar goes", "r.h5md:/" in there and not (place / "r.h5md.xdmf").exists())
        frames, sizes = rows(place / "r.h5md")
        checks.true(f"{name}: a row for every frame", set(sizes.values()) == {frames} and (name != "continued" or "backspring/drawn/value" in sizes), str(sizes))
        for kind, text in (("of another trajectory", there.replace("r.h5md:", "other.h5md:")), ("that is none", "notes")):
            (place / "r.h5md.xdmf").write_text(text)
            go(checks, place, {**again, "ts_max_time": 0.3, "bs_overwrite": True, "bs_output_xdmf": False})
            checks.true(f"{name}: a file {kind} stays", (place / "r.h5md.xdmf").read_text() == text)


def elsewhere(checks, folder):
    """A run is gone on with from any folder: the names in its checkpoint are those of the folder in which it was begun, where its files stay."""
    base = {"options_file": "in/o.yaml", "bs_lattice_file": "in/net.h5", "bs_force_top": "0,table:in/t.csv", "bs_output": "r.h5md", "bs_checkpoint": "c", "bs_progress_interval": -1}
    x, pairs, _ = plate(4, 4)

    def begun(name, **more):
        place = folder / name
        (place / "in").mkdir(parents=True)
        with h5py.File(write_lattice(place / "in/net.h5", x, 1.0, fixed=x[:, 1] == x[:, 1].min(), pairs=pairs, stiffness=1.0, rest_length=1.0), "a") as f:
            f["groups/top"] = np.flatnonzero(x[:, 1] == x[:, 1].max())
        (place / "in/o.yaml").write_text("ts: {dt: 0.1, max_time: 2}\nbs_spring_law: strain\n")
        (place / "in/t.csv").write_text("0,0\n3,0.5\n")
        (place / "out").mkdir()
        go(checks, place, {**base, **more})
        return place

    whole = begun("whole", ts_max_steps=MANY)
    for name, parts in (("once", (("beside", MANY),)), ("three times", (("beside", 9), ("beside", 12), ("below/deep", MANY)))):
        here = begun(name.replace(" ", "_"), ts_max_steps=5)
        for k, (at, steps) in enumerate(parts):
            (folder / at).mkdir(parents=True, exist_ok=True)
            with checks.group(f"{name}, part {k + 1}"):
                said = go(checks, folder / at, {"bs_restart": "../" * (1 + at.count("/")) + f"{here.name}/c", "ts_max_steps": steps}).stdout
                frames, _ = rows(here / "r.h5md")
                checks.true(f"{name}, part {k + 1}, from {at}: the trajectory goes on where it lies", frames == min(steps, 20) + 1 and not list((folder / at).iterdir()), said[-300:])
        for file in ("r.h5md", "c"):
            count, differ = differences(whole / file, here / file)
            checks.true(f"continued from elsewhere {name}: {file} as without a stop", not differ, f"{count} entries; " + "; ".join(differ)[:600])
    begun("apart", bs_checkpoint="out/c", ts_max_steps=5)
    said = go(checks, folder / "beside", {"bs_restart": "../apart/out/c"}, expect=2).stderr
    checks.true("a lattice that lies neither below this folder nor the checkpoint's: refused", "../apart/" in said and "give -bs_lattice_file again to read it all the same" in said, said)
    go(checks, folder / "apart", {"bs_restart": "out/c"})


if __name__ == "__main__":
    run_parts(__doc__, (dynamics, statics, breaking, plastic, driven, form, sidecars, elsewhere))
