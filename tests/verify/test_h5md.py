#!/usr/bin/python3
"""Checks that a trajectory is H5MD 1.1 in the layout of src/output/README.md.

    test_h5md.py FILE [--live]

Exits with 1 and a reason at the first thing that is wrong. --live: the file is being written or its run was killed,
so datasets may have rows that `time` does not count yet.
"""
import re
import sys

try:
    import h5py
    import numpy as np
except ImportError as missing:
    sys.exit(f"{missing}: apt-get install python3-h5py, or try /usr/bin/python3 {sys.argv[0]}")


# Real numbers without a dimension; and shapes of modes, in kg^-1/2, which H5MD's notation does not have.
PURE = re.compile(r".*/(\w*strain|load|load_factor|stability|negative_pivots|broken\w*|\w+_change|change|rest_angle|\w+_rest_angle|h_omega_max)(/value)?|modes/shape")


class Wrong(Exception):
    pass


def need(condition, reason):
    if not condition:
        raise Wrong(reason)


def address(thing):
    """Where the object lies in the file: the same for two hard links to it."""
    return h5py.h5o.get_info(thing.id).addr


def text(value):
    return value.decode() if isinstance(value, bytes) else value


DRAWN = "/backspring/drawn"  # springs as viewers draw them, whole numbers


def attribute(group, name):
    need(name in group.attrs, f"{group.name} has no attribute {name}")
    return group.attrs[name]


def dataset(group, name, kinds, shape=None):
    path = f"{group.name.rstrip('/')}/{name}"
    need(name in group and isinstance(group[name], h5py.Dataset), f"{path} is no dataset")
    d = group[name]
    need(d.dtype.kind in kinds and d.dtype.itemsize == 8, f"{path} has type {d.dtype}")
    need(shape is None or d.shape == shape, f"{path} has shape {d.shape}, not {shape}")
    return d


def check_head(f):
    need("h5md" in f, "no group /h5md")
    need(list(attribute(f["h5md"], "version")) == [1, 1], "/h5md version is not [1, 1]")
    for group, name in (("author", "name"), ("creator", "name"), ("creator", "version")):
        need(group in f["h5md"], f"no group /h5md/{group}")
        value = attribute(f["h5md"][group], name)
        need(isinstance(value, str) and value, f"/h5md/{group} {name} is no string of variable length")


def moving_groups(f):
    """Every group with a value for each frame."""
    found = []
    f.visititems(lambda path, it: found.append(it) if isinstance(it, h5py.Group) and "value" in it else None)
    return found


def check_clock(f, live):
    """The one step and the one time, hard-linked wherever there is a value; returns the number of frames."""
    groups = moving_groups(f)
    if not groups:
        return 0
    first = groups[0]
    step, time = dataset(first, "step", "i"), dataset(first, "time", "f")
    frames = time.shape[0]
    for g in groups:
        for name, same in (("step", step), ("time", time)):
            need(name in g, f"{g.name} has no {name}")
            need(isinstance(g.get(name, getlink=True), h5py.HardLink), f"{g.name}/{name} is no hard link")
            need(address(g[name]) == address(same), f"{g.name}/{name} is not the dataset of {first.name}")
        rows = g["value"].shape[0]
        need(rows == frames or (live and rows > frames), f"{g.name}/value has {rows} rows, time has {frames}")
        need(g["value"].dtype == np.int32 if g.name == DRAWN else g["value"].dtype.kind == "f", f"{g.name}/value has type {g['value'].dtype}")
    need(step.ndim == 1 and time.ndim == 1, "step and time are not one-dimensional")
    need(step.shape == time.shape or live, f"step has {step.shape[0]} rows, time {frames}")
    need(np.all(np.isfinite(time[:])), "time is not finite")
    need(np.all(np.diff(time[:]) > 0), "time does not grow")
    need(np.all(np.diff(step[:frames]) > 0), "step does not grow")
    return frames


def check_particles(f):
    """Box and fields of the one particle group; returns the number of particles."""
    if "particles" not in f:
        return None
    need(list(f["particles"]) == ["trajectory"], f"/particles holds {list(f['particles'])}, not one group trajectory")
    p = f["particles/trajectory"]
    need("box" in p, "no group /particles/trajectory/box")
    dim = int(attribute(p["box"], "dimension"))
    boundary = [text(b) for b in attribute(p["box"], "boundary")]
    need(len(boundary) == dim and set(boundary) <= {"none", "periodic"}, f"box: boundary {boundary} in {dim} dimensions")
    if "edges" in p["box"] or "periodic" in boundary:
        need(p["box/edges/value"].shape[1:] in ((dim,), (dim, dim)), f"box/edges/value has shape {p['box/edges/value'].shape}")
    need("position" in p, "no group /particles/trajectory/position")
    shape = p["position/value"].shape
    need(len(shape) == 3 and shape[2] == dim, f"position/value has shape {shape} in {dim} dimensions")
    for name in p:
        if name != "box" and isinstance(p[name], h5py.Group):
            numbers = max(shape[2], dim * (dim + 1) // 2) if name == "stress_volume" else shape[2]  # a symmetric tensor
            need(p[name]["value"].shape[1:] == (shape[1], numbers), f"{name}/value has shape {p[name]['value'].shape}")
    count = shape[1]
    if "mass" in p:
        need(np.all(dataset(p, "mass", "f", (count,))[:] > 0), "a mass is not positive")
    if "id" in p:
        need(len(np.unique(dataset(p, "id", "iu", (count,))[:])) == count, "an id occurs twice")
    return count


def check_bonds(f, count):
    if "connectivity" not in f:
        return
    c = f["connectivity"]
    bonds = dataset(c, "bonds", "iu")
    need(bonds.ndim == 2 and bonds.shape[1] == 2, f"/connectivity/bonds has shape {bonds.shape}")
    if bonds.shape[0]:
        need(bonds[:].min() >= 0 and bonds[:].max() < count, "/connectivity/bonds names a particle that is not there")
    group = f[attribute(bonds, "particles_group")]
    need(group.name == "/particles/trajectory" or address(group) == address(f["particles/trajectory"]),
         f"particles_group of /connectivity/bonds is {group.name}")
    for name in c:
        if name.startswith("bonds_"):
            width = {"bonds_drawn": (2,), "bonds_shift": c[name].shape[1:]}.get(name, ())
            dataset(c, name, "iu" if name == "bonds_law" or width else "f", (bonds.shape[0], *width))
    if "angles" in c:
        angles = dataset(c, "angles", "iu")
        need(angles.ndim == 2 and angles.shape[1] == 3, f"/connectivity/angles has shape {angles.shape}")
        need(angles.shape[0] == 0 or (angles[:].min() >= 0 and angles[:].max() < count), "/connectivity/angles names a particle that is not there")
        need(address(f[attribute(angles, "particles_group")]) == address(f["particles/trajectory"]), "particles_group of /connectivity/angles")
        for name in ("angles_stiffness", "angles_rest_angle"):
            dataset(c, name, "f", (angles.shape[0],))


def check_observables(f):
    items = dict(f.get("observables", {}).items())
    kinds = ("reaction", "work", "stress_volume", "force", "moment")  # by group of particles, and their sum; of given forces that of all
    items.update({f"springs/{name}": group for name, group in items.pop("springs", {}).items()})
    for kind in kinds:
        if kind not in items:
            continue
        parts = {f"{kind}/{name}": group for name, group in items[kind].items() if isinstance(group, h5py.Group)}
        items.update(parts)
        if kind in kinds[3:]:
            continue
        value = items[kind]["value"][...]
        rows = min([len(value)] + [len(group["value"]) for group in parts.values()])
        total = sum(group["value"][:rows] for group in parts.values())
        need(parts and np.allclose(value[:rows], total, rtol=1e-12, atol=1e-12 * max(np.abs(group["value"][...]).max(initial=0) for group in parts.values())),
             f"/observables/{kind}/value is not the sum over the groups")
    for name, group in items.items():
        need(isinstance(group, h5py.Group) and ({"value", "step", "time"} <= set(group) if name in kinds else
                                                set(group) == {"value", "step", "time"}), f"/observables/{name} is not a group of value, step and time")
        shape = group["value"].shape
        need(len(shape) == 1 or (len(shape) == 2 and shape[1] > 1), f"/observables/{name}/value has shape {shape}")


def check_log(f, live):
    need("backspring/log" in f, "no group /backspring/log")
    log, rows = f["backspring/log"], None
    for name in ("step", "time", "dt", "newton", "krylov", "rejected"):
        d = dataset(log, name, "f" if name in ("time", "dt") else "i")
        need(d.ndim == 1, f"{d.name} is not one-dimensional")
        rows = d.shape[0] if rows is None else rows
        need(d.shape[0] == rows or live, f"{d.name} has {d.shape[0]} rows, not {rows}")


def check_parameters(f):
    need("parameters/options" in f, "no group /parameters/options")
    for name in ("program", "version", "petsc_version"):
        need(isinstance(attribute(f["parameters"], name), str), f"/parameters {name} is no string")
    need(int(attribute(f["parameters"], "ranks")) >= 1, "/parameters ranks is not positive")
    for name, value in f["parameters/options"].attrs.items():
        need(isinstance(value, str), f"/parameters/options {name} is no string")


def check_units(f):
    """All or none: with the module of units, time and every particle field have one."""
    module = "modules" in f["h5md"] and "units" in f["h5md/modules"]
    found = []
    f.visititems(lambda path, it: found.append((path, it.attrs["unit"])) if "unit" in it.attrs else None)
    need(module or not found, f"{found[0][0] if found else ''} has a unit, but there is no /h5md/modules/units")
    for path, unit in found:
        need(isinstance(unit, str), f"unit of {path} is no string of variable length")
    if module:
        need(list(attribute(f["h5md/modules/units"], "version")) == [1, 0], "/h5md/modules/units version is not [1, 0]")
        for g in moving_groups(f):
            need("unit" in g["time"].attrs, f"{g.name}/time has no unit")
        if "particles" in f:
            f.visititems(lambda path, it: need(not isinstance(it, h5py.Dataset) or it.dtype.kind != "f" or "unit" in it.attrs or PURE.fullmatch(path), f"{path} has no unit"))


def main(arguments):
    files = [a for a in arguments if not a.startswith("--")]
    live = "--live" in arguments
    if len(files) != 1:
        sys.exit(__doc__)
    try:
        with h5py.File(files[0], "r") as f:
            check_head(f)
            frames = check_clock(f, live)
            count = check_particles(f)
            check_bonds(f, count)
            check_observables(f)
            check_log(f, live)
            check_parameters(f)
            check_units(f)
    except (Wrong, OSError, KeyError) as wrong:
        sys.exit(f"{files[0]}: {wrong}")
    particles = "" if count is None else f", {count} particles"
    print(f"{files[0]}: H5MD, {frames} frames{particles}")


if __name__ == "__main__":
    main(sys.argv[1:])
