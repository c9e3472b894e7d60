#!/usr/bin/env python3
"""What others read: the trajectory against H5MD's rules, with MDAnalysis, and by its XDMF sidecar, with ParaView; both
where installed."""
import itertools
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks
from program import environment
import h5py
import numpy as np

CLOTH = ["-bs_lattice_type", "cloth", "-bs_lattice_size", "6,5", "-bs_lattice_fixed", "xmin", "-bs_gravity", "0,0,-9.81",
         "-ts_dt", "0.01", "-ts_max_time", "0.08"]
SQUARE = ["-bs_lattice_type", "square", "-bs_lattice_size", "4,4", "-bs_gravity", "0,-9.81", "-ts_dt", "0.01", "-ts_max_time", "0.03"]
TORN = ["-bs_lattice_type", "triangular", "-bs_lattice_size", "6,6", "-bs_lattice_stiffness", "1", "-bs_lattice_velocity_gradient", "0.6,0,0,0.3", "-bs_break_strain", "0.3", "-bs_break_weibull", "5,2",
        "-ts_type", "verlet", "-ts_dt", "0.02", "-ts_max_time", "1.6", "-bs_output_interval", "0.2"]
CHAIN = ["-bs_lattice_type", "chain", "-bs_lattice_size", "5", "-ts_dt", "0.01", "-ts_max_time", "0.03"]


def run(checks, folder, arguments, ranks=1, name="run.h5md"):
    command = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [checks.program] + arguments + [
        "-bs_output", name, "-bs_overwrite", "-bs_progress_interval", "-1"]
    done = subprocess.run(command, cwd=folder, env=environment(ranks), capture_output=True, text=True, timeout=120)
    checks.true(f"{name} on {ranks} rank(s) runs", done.returncode == 0, (done.stdout + done.stderr).strip().splitlines()[-1])
    return pathlib.Path(folder) / name


def numbers(text):
    return [int(w) for w in text.split()]


def dataset(folder, words):
    file, path = words.split(":", 1)
    with h5py.File(folder / file, "r") as f:
        return f[path][...]


def whole(item, folder):
    """A DataItem of a whole dataset: its shape, type and precision must be the dataset's."""
    data = dataset(folder, item.text.strip())
    said = (numbers(item.get("Dimensions")), item.get("NumberType"), int(item.get("Precision")))
    real = (list(data.shape), "Float" if data.dtype.kind == "f" else "Int", data.dtype.itemsize)
    if said != real:
        raise ValueError(f"{item.text}: said {said}, is {real}")
    return data


def difference(item, folder, read):
    """An item that both XDMF 2 and 3 compute from two others."""
    if item.get("Function") != "$0 - $1":
        raise ValueError(f"unknown function {item.get('Function')}")
    first, second = (read(one, folder) for one in item.findall("DataItem"))
    if list(first.shape) != numbers(item.get("Dimensions")):
        raise ValueError(f"said {item.get('Dimensions')}, is {first.shape}")
    return first - second


def by_items(item, folder):
    """XDMF 2: start, stride, count in one item, the whole dataset in the other."""
    if item.get("ItemType") == "Function":
        return difference(item, folder, by_items)
    if item.get("Type") != "HyperSlab":
        return whole(item, folder)
    where, source = item.findall("DataItem")
    start, stride, count = np.array(numbers(where.text)).reshape(numbers(where.get("Dimensions")))
    data = whole(source, folder)[tuple(slice(s, s + n * d, d) for s, d, n in zip(start, stride, count))]
    return data.reshape(numbers(item.get("Dimensions")))


def by_words(item, folder):
    """XDMF 3: FILE:PATH|start:stride:count:shape."""
    if item.get("ItemType") == "Function":
        return difference(item, folder, by_words)
    if "|" not in (item.text or ""):
        return whole(item, folder)
    place, selection = item.text.split("|")
    start, stride, count, shape = (numbers(w) for w in selection.split(":"))
    data = dataset(folder, place)
    if list(data.shape) != shape:
        raise ValueError(f"{place}: said {shape}, is {data.shape}")
    return data[tuple(slice(s, s + n * d, d) for s, d, n in zip(start, stride, count))].reshape(numbers(item.get("Dimensions")))


def compare(checks, path, label, expected_frames=None, live=False):
    """Every frame of the sidecar against h5py's own reading; the strain against the formula."""
    folder, root = path.parent, ET.parse(f"{path}.xdmf").getroot()
    grids = root.findall("Domain/Grid/Grid")
    with h5py.File(path, "r") as f:
        x, v = (f[f"particles/trajectory/{n}/value"][...] for n in ("position", "velocity"))
        t = f["particles/trajectory/position/time"][...]
        bonds = f["connectivity/bonds"][...] if "connectivity/bonds" in f else np.zeros((0, 2), int)
        rest = f["connectivity/bonds_rest_length"][...] if len(bonds) else np.zeros(0)
        stress = f["particles/trajectory/stress_volume/value"][...] if "stress_volume" in f["particles/trajectory"] else x[:, :, :0]
        parts = ("xx", "yy", "zz", "yz", "xz", "xy") if stress.shape[2] > 3 else ("xx", "yy", "xy")[:stress.shape[2]]
    if not live:
        checks.true(f"{label}: all frames", len(grids) == len(t), f"{len(grids)} of {len(t)}")
    if expected_frames:
        checks.true(f"{label}: {expected_frames} frames", len(grids) == expected_frames, f"{len(grids)}")
    if live:
        return len(grids)
    for read in (by_items, by_words):
        good = 0
        for k, grid in enumerate(grids):
            named = {a.get("Name"): (a.get("Center"), read(a.find("DataItem"), folder)) for a in grid.findall("Attribute")}
            length = np.linalg.norm(x[k, bonds[:, 1]] - x[k, bonds[:, 0]], axis=1)
            good += (float(grid.find("Time").get("Value")) == t[k] and np.array_equal(read(grid.find("Geometry/DataItem"), folder), x[k])
                     and grid.find("Geometry").get("GeometryType") == {2: "XY", 3: "XYZ"}[x.shape[2]]
                     and np.array_equal(read(grid.find("Topology/DataItem"), folder), bonds)
                     and named["velocity"][0] == "Node" and np.array_equal(named["velocity"][1], v[k])
                     and named["displacement"][0] == "Node" and np.array_equal(named["displacement"][1], x[k] - x[0])
                     and all(named["stress_volume_" + part][0] == "Node" and np.array_equal(named["stress_volume_" + part][1], stress[k, :, c])
                             for c, part in enumerate(parts))
                     and named["strain"][0] == "Cell" and np.allclose(named["strain"][1], (length - rest) / rest, rtol=0, atol=1e-14))
        checks.true(f"{label}: {read.__name__} gives h5py's positions, velocities, springs and strains", good == len(grids) > 0,
                    f"{good} of {len(grids)} frames")
    return len(grids)


def contents(checks, folder):
    text = {}
    for ranks in (1, 2, 3):
        path = run(checks, folder, CLOTH, ranks)
        compare(checks, path, f"cloth on {ranks} rank(s)", 9)
        text[ranks] = pathlib.Path(f"{path}.xdmf").read_text()
    checks.true("the sidecar does not depend on the ranks", text[1] == text[2] == text[3])
    checks.true("no temporary file is left", not list(pathlib.Path(folder).glob("*.tmp")))
    compare(checks, run(checks, folder, SQUARE), "two dimensions", 4)
    compare(checks, run(checks, folder, SQUARE + ["-bs_output_stress"]), "two dimensions, with stress", 4)
    compare(checks, run(checks, folder, CLOTH + ["-bs_output_stress"], 2), "cloth, with stress", 9)
    compare(checks, run(checks, folder, CHAIN + ["-bs_output_stress", "-bs_output_pad", "2"], name="padded.h5md"), "one dimension, padded, with stress", 4)
    run(checks, folder, CHAIN, name="chain.h5md")
    checks.true("one dimension: none", not (pathlib.Path(folder) / "chain.h5md.xdmf").exists())
    compare(checks, run(checks, folder, CHAIN + ["-bs_output_pad", "3"], name="padded.h5md"), "one dimension, padded", 4)
    path = run(checks, folder, CLOTH + ["-bs_output_xdmf", "false", "-bs_output_strain", "false"], name="without.h5md")
    checks.true("-bs_output_xdmf false: none", not pathlib.Path(f"{path}.xdmf").exists())
    with h5py.File(path, "r") as f:
        checks.true("-bs_output_strain false: none", "strain" not in f["backspring"])
    path = run(checks, folder, CLOTH + ["-viewer_hdf5_sp_output"], name="single.h5md")
    item = ET.parse(f"{path}.xdmf").getroot().find("Domain/Grid/Grid/Geometry/DataItem")
    checks.true("single precision is said", item.get("Precision") == "4" and by_items(item, pathlib.Path(folder)).dtype == np.float32)
    path = run(checks, folder, ["-bs_lattice_type", "chain", "-bs_lattice_size", "1", "-bs_gravity", "-1", "-bs_output_pad", "3",
                                "-ts_dt", "0.1", "-ts_max_time", "0.2"], name="a&b.h5md")
    root = ET.parse(f"{path}.xdmf").getroot()
    checks.true("without springs: points", root.find("Domain/Grid/Grid/Topology").get("TopologyType") == "Polyvertex")
    checks.true("a file name with & is escaped", by_words(root.find("Domain/Grid/Grid/Geometry/DataItem"), pathlib.Path(folder)).shape == (1, 3))


def threshold_by_vtk(points, cells, broken):
    """Places of the ends of the springs that VTK's Threshold leaves between 0 and 0 of `broken`: the filter of ParaView."""
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    grid, place, flags = vtk.vtkUnstructuredGrid(), vtk.vtkPoints(), numpy_to_vtk(np.ascontiguousarray(broken, float), deep=True)
    place.SetData(numpy_to_vtk(np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), deep=True))
    grid.SetPoints(place)
    for a, b in cells:
        grid.InsertNextCell(vtk.VTK_LINE, 2, (int(a), int(b)))
    flags.SetName("broken")
    grid.GetCellData().AddArray(flags)
    cut = vtk.vtkThreshold()
    cut.SetInputData(grid)
    cut.SetInputArrayToProcess(0, 0, 0, vtk.vtkDataObject.FIELD_ASSOCIATION_CELLS, "broken")
    cut.SetThresholdFunction(vtk.vtkThreshold.THRESHOLD_BETWEEN)
    cut.SetLowerThreshold(0)
    cut.SetUpperThreshold(0)
    cut.Update()
    left = cut.GetOutput()
    where = vtk_to_numpy(left.GetPoints().GetData()) if left.GetNumberOfCells() else np.zeros((0, 3))
    return [[where[left.GetCell(i).GetPointId(end)] for end in (0, 1)] for i in range(left.GetNumberOfCells())]


def holes(checks, folder):
    """Springs that break: every frame of the sidecar has lines for the springs that /events/broken has not named by then and points for the others; a threshold on
    its cell field `broken` leaves the lines alone, between the places of their ends."""
    try:
        import vtk  # noqa: F401
    except ImportError:
        checks.skip("VTK", "apt install python3-vtk9")
        return
    for ranks in (1, 2):
        path = run(checks, folder, TORN, ranks)
        with h5py.File(path, "r") as f:
            x, t = f["particles/trajectory/position/value"][...], f["particles/trajectory/position/time"][...]
            bonds, when, spring = f["connectivity/bonds"][...], f["events/broken/time"][...], f["events/broken/spring"][...]
        grids = ET.parse(f"{path}.xdmf").getroot().findall("Domain/Grid/Grid")
        for read in (by_items, by_words):
            good, counts, lines = 0, [], 0
            for k, grid in enumerate(grids):
                topology, gone = read(grid.find("Topology/DataItem"), path.parent), spring[when <= t[k] + 1e-9]
                lines += np.array_equal(np.flatnonzero(topology[:, 0] != topology[:, 1]), np.delete(np.arange(len(bonds)), gone)) and np.array_equal(
                    topology, np.where(np.isin(np.arange(len(bonds)), gone)[:, None], bonds[:, :1], bonds))
                field = next(a for a in grid.findall("Attribute") if a.get("Name") == "broken")
                seen = threshold_by_vtk(read(grid.find("Geometry/DataItem"), path.parent), read(grid.find("Topology/DataItem"), path.parent),
                                        read(field.find("DataItem"), path.parent))
                whole = np.delete(bonds, spring[when <= t[k] + 1e-9], axis=0)
                expected = np.pad(x[k][whole], ((0, 0), (0, 0), (0, 3 - x.shape[2])))
                counts.append(len(whole))
                good += field.get("Center") == "Cell" and field.get("AttributeType") == "Scalar" and np.array_equal(np.array(seen).reshape(expected.shape), expected)
            checks.true(f"{ranks} rank(s), {read.__name__}: no line for a broken spring", lines == len(t) > 3, f"{lines} of {len(t)} frames")
            checks.true(f"{ranks} rank(s), {read.__name__}: a threshold on `broken` leaves the springs that are whole", good == len(t) > 3, f"{good} of {len(t)} frames")
            checks.true("and fewer from frame to frame", counts[0] == len(bonds) > counts[-1] > 0 and np.all(np.diff(counts) <= 0) and len(set(counts)) > 3, f"{counts}")


def modes(checks, folder):
    """Shapes of free vibrations as vectors of the particles, in the plane, in space, and in the plane with a third component; springs and tensions of the same run as ever."""
    for name, options, ranks in (("square", SQUARE, 2), ("cloth", CLOTH, 1), ("square", SQUARE + ["-bs_output_pad", "3"], 1)):
        still = [word for pair in zip(options[::2], options[1::2]) for word in pair if pair[0] not in ("-ts_dt", "-ts_max_time")]
        path = run(checks, folder, still + ["-bs_task", "modes", "-bs_modes", "5", "-bs_output_springs"], ranks, "modes.h5md")
        grid = ET.parse(f"{path}.xdmf").getroot().find("Domain/Grid/Grid")
        with h5py.File(path) as f:
            shapes, tension = f["modes/shape"][...], f["observables/springs/tension/value"][0]
        for read in (by_items, by_words):
            found = {a.get("Name"): (a.get("AttributeType"), a.get("Center"), read(a.find("DataItem"), path.parent)) for a in grid.findall("Attribute")}
            good = [k for k in range(5) if found[f"mode_{k:03d}"][:2] == ("Vector", "Node") and np.array_equal(found[f"mode_{k:03d}"][2], shapes[k])]
            checks.true(f"{name} on {ranks} rank(s), {read.__name__}: five modes as they are in the file", good == list(range(5)) and np.abs(shapes).max() > 0 and "mode_005" not in found, f"{sorted(found)}")
            checks.true(f"{name}, {read.__name__}: no displacement, and tensions", not found["displacement"][2].any() and np.array_equal(found["tension"][2], tension, equal_nan=True))


def holes_continued(checks, folder):
    """The same in a run that is taken up again, also with a trajectory of an earlier version, which has no lines of its own for every frame, and without a sidecar."""
    expected = None
    for label, change, options in (("whole", None, []), ("of an earlier version", lambda f: f["backspring"].__delitem__("drawn"), []), ("without a sidecar", None, ["-bs_output_xdmf", "false"])):
        path = run(checks, folder, TORN + ["-bs_checkpoint", "t.ck", "-ts_max_time", "0.8"] + options)
        with h5py.File(path, "a") as f:
            checks.true(f"{label}: lines are kept where there is a sidecar", ("drawn" in f["backspring"]) == (not options))
            if change:
                change(f)
        done = subprocess.run([checks.program, "-bs_restart", "t.ck", "-ts_max_time", "1.6", "-bs_progress_interval", "-1"], cwd=folder, env=environment(1), capture_output=True, text=True, timeout=120)
        checks.true(f"{label}: taken up again", done.returncode == 0, (done.stdout + done.stderr).strip()[-160:])
        with h5py.File(path) as f:
            broken = f["backspring/broken/value"][...] != 0
            expected = broken if expected is None else expected
            checks.true(f"{label}: the same springs break", np.array_equal(broken, expected) and broken[-1].any() and len(broken) > 6, f"{len(broken)} frames")
            if "drawn" in f["backspring"]:
                drawn = f["backspring/drawn/value"][...]
                checks.true(f"{label}: no line for a broken spring", drawn.dtype == np.int32 and np.array_equal(drawn[:, :, 0] == drawn[:, :, 1], broken))
        pathlib.Path(f"{path}.xdmf").unlink(missing_ok=True)


def diluted(checks, folder):
    """Springs without stiffness and damping, and those across a periodic box, are points in the sidecar's topology; all others are as they are."""
    net = ["-bs_lattice_type", "triangular", "-bs_lattice_size", "8,8", "-bs_lattice_stiff_factor", "0", "-bs_lattice_seed", "3", "-ts_dt", "0.01", "-ts_max_time", "0.02"]
    for periodic, ranks, fraction in itertools.product((False, True), (1, 3), ("0.3", "0")):
        label = f"{'periodic' if periodic else 'open'}, a share of {fraction} without stiffness, {ranks} ranks"
        path = run(checks, folder, net + ["-bs_lattice_stiff_fraction", fraction] + ["-bs_lattice_periodic", "xy"] * periodic, ranks)
        topology = by_items(ET.parse(f"{path}.xdmf").getroot().find("Domain/Grid/Grid/Topology/DataItem"), pathlib.Path(folder))
        with h5py.File(path, "r") as f:
            bonds, k = f["connectivity/bonds"][...], f["connectivity/bonds_stiffness"][...]
            across = f["connectivity/bonds_shift"][...].any(axis=1) if periodic else np.zeros(len(k), bool)
        point = across | (k == 0)
        checks.true(f"{label}: drawn", ((k == 0).sum() > 20) == (fraction != "0") and across.any() == periodic
                    and np.array_equal(topology, np.where(point[:, None], bonds[:, :1], bonds)), f"{point.sum()} points of {len(k)}")


def in_units(folder):
    """Runs with units of all that a file can hold: the check asks every real number for one."""
    net = ["-bs_lattice_type", "triangular", "-bs_lattice_size", "6,6", "-bs_lattice_perturbation", "0.05", "-bs_output_units", "SI"]
    motion, load = ["-ts_dt", "0.01", "-ts_max_time", "0.03"], ["-bs_task", "statics", "-bs_load_steps", "2"]
    box, ends = ["-bs_lattice_periodic", "xy", "-bs_box_strain", "xy=velocity:0.05"], ["-bs_group_low", "ymin", "-bs_group_top", "ymax"]
    hinged = pathlib.Path(folder) / "hinged.h5"
    with h5py.File(hinged, "w") as f:
        f["particles/position"], f["particles/mass"], f["particles/force"] = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0.1], [-1, 0, 0.2]]), np.ones(4), np.zeros((4, 3))
        f["springs/pairs"], f["springs/stiffness"], f["springs/area"] = np.array([[0, 1], [0, 2], [1, 2], [0, 3], [1, 3]]), np.ones(5), np.ones(5)
        f["hinges/quads"], f["hinges/stiffness"], f["hinges/rest_angle"] = np.array([[0, 1, 2, 3]]), np.ones(1), np.zeros(1)
    return (("box", net + motion + box + ["-bs_angle_stiffness", "1", "-bs_output_springs", "-bs_output_stress", "-bs_break_strain", "0.1", "-bs_break_weibull", "4,1", "-bs_break_angle_change", "3"]),
            ("box under stress", net + load + box + ["-bs_box_stress", "yy=0"]), ("cube", ["-bs_lattice_type", "cubic", "-bs_lattice_size", "3,3,3", "-bs_lattice_periodic", "xyz", "-bs_output_units", "metal"] + motion),
            ("loads", net + load + ends + ["-bs_motion_low", "fixed", "-bs_force_top", "0,0.01", "-bs_stress_groups", "top", "-bs_compliance_groups", "low,top"]),
            ("plastic", net + motion + ends + ["-bs_motion_low", "fixed", "-bs_motion_top", "y=velocity:0.1", "-bs_spring_law", "plastic", "-bs_spring_yield_force", "0.01", "-bs_spring_hardening", "0.1"]),
            ("relaxing", net + motion + ["-bs_spring_law", "maxwell", "-bs_spring_relaxation_time", "1"]), ("by strain", net + motion + ["-bs_spring_law", "strain", "-bs_advise"]),
            ("shaken", net + ["-bs_task", "modes", "-bs_modes", "4"]), ("stiffness", net + ["-bs_task", "moduli", "-bs_lattice_periodic", "xy"]),
            ("hinges", ["-bs_lattice_file", str(hinged), "-bs_break_hinge_moment", "1e9", "-bs_output_springs", "-bs_output_units", "nano"] + motion))


def types(checks, folder):
    """What the sidecar calls a scalar has one number in a row, what it calls a vector two or three: of every attribute, also of those that lattices give."""
    forced = pathlib.Path(folder) / "forced.h5"
    for name, options in (("forces", SQUARE), ("forces, padded", SQUARE + ["-bs_output_pad", "3"]), ("forces in space", CLOTH), ("forces on a line", CHAIN + ["-bs_output_pad", "3"]), ("springs", CLOTH + ["-bs_output_springs", "-bs_output_stress"]),
                          ("breaking", TORN)):
        if name.startswith("forces"):
            made = subprocess.run([checks.program, *options[:4], "-bs_task", "generate", "-bs_output", str(forced), "-bs_overwrite"], capture_output=True, text=True)
            checks.true(f"{name}: a lattice with forces", made.returncode == 0, made.stderr.strip()[-160:])
            with h5py.File(forced, "a") as f:
                f["particles/force"] = 0.1 * f["particles/position"][...]
            options = ["-bs_lattice_file", str(forced)] + options[4:]
        path = run(checks, folder, options)
        with h5py.File(path) as f:
            count = {"Node": len(f["particles/trajectory/mass"]), "Cell": len(f["connectivity/bonds"])}
        seen, wrong = set(), []
        for one in ET.parse(f"{path}.xdmf").getroot().iter("Attribute"):
            shape, kind = numbers(one.find("DataItem").get("Dimensions")), one.get("AttributeType")
            values, per = int(np.prod(shape)), count[one.get("Center")]
            seen.add(one.get("Name"))
            if values % per or kind != {1: "Scalar", 2: "Vector", 3: "Vector"}.get(values // per, "Matrix"):
                wrong.append(f"{one.get('Name')}: {kind} of {shape}")
        checks.true(f"{name}: types of {len(seen)} attributes", not wrong and {"mass", "velocity"} <= seen and ("applied_force" in seen) == name.startswith("forces"), f"{wrong[:3]} {sorted(seen)}")


def names(checks, folder):
    """A name that XML cannot hold has no sidecar, and a warning says so; other letters are what they are."""
    for name, fits in (("\u03bb\U0001f9f5.h5md", True), (b"caf\xe9.h5md", False), (b"\xc0\xaf.h5md", False), (b"\xed\xa0\x80.h5md", False), (b"a\x01b.h5md", False), (b"cut\xe2\x82.h5md", False)):
        file = os.fsencode(name)
        done = subprocess.run([os.fsencode(str(word)) for word in [checks.program, *SQUARE, "-bs_progress_interval", "-1", "-bs_output"]] + [file], cwd=folder, env=environment(1), capture_output=True, timeout=120)
        there, said = os.path.exists(os.path.join(os.fsencode(folder), file + b".xdmf")), done.stderr.decode(errors="replace")
        checks.true(f"{file!r}: {'a sidecar' if fits else 'none, and a warning'}", done.returncode == 0 and os.path.exists(os.path.join(os.fsencode(folder), file)) and there == fits
                    and ("is not UTF-8: its sidecar for ParaView is not written" in said) == (not fits), said[-200:])
        if there:
            text = next(ET.parse(os.path.join(os.fsencode(folder), file + b".xdmf").decode()).getroot().iter("DataItem")).text
            checks.true("it names the trajectory", text.startswith(file.decode() + ":"), text)


def h5md(checks, folder):
    """H5MD 1.1 by its rules, and as an independent reader of H5MD sees it."""
    structure = pathlib.Path(__file__).resolve().parents[1] / "verify" / "test_h5md.py"
    for name, options in (("cloth", CLOTH), ("square", SQUARE), ("units", CLOTH + ["-bs_output_units", "SI"]),
                          ("stress", CLOTH + ["-bs_output_stress", "-bs_output_units", "SI"]), *in_units(folder)):
        path = run(checks, folder, options, 2, name + ".h5md")
        done = subprocess.run([sys.executable, str(structure), str(path)], capture_output=True, text=True)
        checks.true(f"{name}: H5MD 1.1", done.returncode == 0, (done.stdout + done.stderr).strip()[-160:])
    broken = pathlib.Path(folder) / "broken.h5md"
    for what, change in (("a version", lambda f: f["h5md"].attrs.modify("version", np.array([2, 0], np.int32))),
                         ("a copy in place of a hard link", lambda f: replace(f, "particles/trajectory/velocity/time")),
                         ("a bond to nobody", lambda f: f["connectivity/bonds"].__setitem__((0, 1), 10 ** 6)),
                         ("a missing box", lambda f: f["particles/trajectory"].__delitem__("box"))):
        shutil.copy(pathlib.Path(folder) / "cloth.h5md", broken)
        with h5py.File(broken, "a") as f:
            change(f)
        done = subprocess.run([sys.executable, str(structure), str(broken)], capture_output=True, text=True)
        checks.true(f"the check sees {what}", done.returncode == 1, done.stderr.strip()[-120:])
    try:
        import MDAnalysis
    except ImportError:
        checks.skip("MDAnalysis", "apt install python3-mdanalysis")
        return
    with h5py.File(pathlib.Path(folder) / "cloth.h5md", "r") as f:
        x, t = f["particles/trajectory/position/value"][...], f["particles/trajectory/position/time"][...]
    universe = MDAnalysis.Universe.empty(x.shape[1], trajectory=False)
    universe.load_new(str(pathlib.Path(folder) / "cloth.h5md"), format="H5MD", convert_units=False)
    seen = [(frame.time, frame.positions.copy()) for frame in universe.trajectory]
    checks.true("MDAnalysis reads times and positions", [s[0] for s in seen] == t.tolist()
                and np.array_equal([s[1] for s in seen], x.astype(np.float32)))
    convert = pathlib.Path(__file__).resolve().parents[2] / "postprocess" / "convert.py"
    # with its defaults, which convert to angstrom and ps: what a length, and a time, of the file is in these
    for name, options, length, clock in (("real", ["-bs_output_units", "real"], 1, 1e-3), ("real_nm", [], 1, 1e-3),
                                         ("metal", ["-bs_output_units", "metal"], 1, 1), ("nano", ["-bs_output_units", "nano"], 10, 1000),
                                         ("cloth_nm", [], 1e10, 1e12), ("square_nm", [], 1e10, 1e12)):
        path = pathlib.Path(folder) / f"{name}.h5md"
        source = run(checks, folder, CLOTH + options, 1, f"{name}.h5md") if options else pathlib.Path(folder) / f"{name[:-3]}.h5md"
        if not options:
            done = subprocess.run([sys.executable, str(convert), str(source), "-o", str(path)], capture_output=True, text=True)
            checks.true(f"convert.py to {name}.h5md", done.returncode == 0, done.stderr.strip()[-120:])
        with h5py.File(source, "r") as f:
            x, v, t = (f[f"particles/trajectory/{k}"][...] for k in ("position/value", "velocity/value", "position/time"))
        universe = MDAnalysis.Universe.empty(x.shape[1], trajectory=False)
        universe.load_new(str(path), format="H5MD")
        last = universe.trajectory[-1]
        d = x.shape[2]
        checks.near(f"MDAnalysis with its defaults, {name}: positions", last.positions[:, :d] / length, x[-1], 1e-6 * np.abs(x).max())
        if name != "real":  # MDAnalysis up to 2.9 inverts the factor of angstrom/fs, its issue 5051
            checks.near(f"MDAnalysis with its defaults, {name}: velocities", last.velocities[:, :d] / (length / clock), v[-1], 1e-6 * np.abs(v).max())
        checks.near(f"MDAnalysis with its defaults, {name}: time", last.time / clock, t[-1], 1e-9)


def replace(f, path):
    values = f[path][...]
    del f[path]
    f[path] = values


def interrupted(checks, folder):
    """A run killed in the middle leaves a whole sidecar of frames that are there; one that is stopped, all frames."""
    path = pathlib.Path(folder) / "long.h5md"
    for sign, name in ((signal.SIGKILL, "killed"), (signal.SIGTERM, "stopped")):
        command = [checks.program] + CLOTH + ["-ts_max_time", "1e6", "-bs_output", str(path), "-bs_overwrite"]
        process = subprocess.Popen(command, env=environment(1), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        sidecar = pathlib.Path(f"{path}.xdmf")
        deadline, seen, whole_texts = time.time() + 60, 0, True
        while time.time() < deadline and seen < 120:
            if sidecar.exists():
                text = sidecar.read_text()
                whole_texts = whole_texts and text.endswith("</Domain></Xdmf>\n")
                seen = text.count("<Time ")
            time.sleep(0.01)
        process.send_signal(sign)
        process.wait(60)
        checks.true(f"{name}: the sidecar was always whole", whole_texts and seen >= 120, f"{seen} frames seen")
        with h5py.File(path, "r") as f:
            frames = f["particles/trajectory/position/time"].shape[0]
        described = compare(checks, path, name, live=True)
        least = frames if sign == signal.SIGTERM else 0.97 * frames - 1
        checks.true(f"{name}: describes {described} of {frames} frames", least <= described <= frames)
        sidecar.unlink()


def continued(checks, folder):
    """A run that is taken up from a checkpoint before its last frames: the sidecar has the frames that are there."""
    arguments = CLOTH + ["-bs_checkpoint", "c.ck", "-bs_checkpoint_every", "5"]
    path = run(checks, folder, arguments, 1)
    command = [checks.program, "-bs_restart", "c.ck.previous", "-ts_max_time", "0.12", "-bs_progress_interval", "-1"]
    done = subprocess.run(command, cwd=folder, env=environment(1), capture_output=True, text=True, timeout=120)
    checks.true("continued from the checkpoint before the last", done.returncode == 0, (done.stdout + done.stderr).strip()[-120:])
    compare(checks, path, "continued", 13)


PARAVIEW = """
import sys
import numpy as np
import paraview.simple as ps
from paraview import servermanager
from vtk.util.numpy_support import vtk_to_numpy
kind, source, picture, out = sys.argv[1:5]
reader = ps.XDMFReader(FileNames=[source]) if kind == "XDMFReader" else getattr(ps, kind)(FileName=[source])
reader.UpdatePipelineInformation()
times = list(np.atleast_1d(reader.TimestepValues))
reader.UpdatePipeline(times[-1])
data = servermanager.Fetch(reader)
data = data.GetBlock(0) if data.IsA("vtkMultiBlockDataSet") else data
cells = [[data.GetCell(i).GetPointId(j) for j in range(data.GetCell(i).GetNumberOfPoints())] for i in range(data.GetNumberOfCells())]
modes = {k: vtk_to_numpy(data.GetPointData().GetArray(k)) for k in ("displacement", "mode_000", "mode_003") if data.GetPointData().GetArray(k)}
strain = data.GetCellData().GetArray("strain")
np.savez(out, **modes, times=times, points=vtk_to_numpy(data.GetPoints().GetData()), cells=cells,
         velocity=vtk_to_numpy(data.GetPointData().GetArray("velocity")), strain=vtk_to_numpy(strain))
view = ps.CreateView("RenderView")
view.ViewSize = [600, 450]
view.ViewTime = times[-1]
shown = ps.Show(reader, view)
shown.SetRepresentationType("Wireframe")
ps.ColorBy(shown, ("CELLS", "strain"))
shown.RescaleTransferFunctionToDataRange(True)
shown.LineWidth = 3
view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [6, -9, 4], [0, 0, 0], [0, 0, 1]
ps.ResetCamera(view)
ps.SaveScreenshot(picture, view)
"""


def paraview(checks, folder):
    missing = [tool for tool in ("pvpython", "xvfb-run") if not shutil.which(tool)]
    if missing:
        checks.skip("ParaView", f"no {' and '.join(missing)}: apt install paraview python3-paraview xvfb xauth libgl1-mesa-dri")
        return
    import matplotlib.image
    path = run(checks, folder, CLOTH)
    script = pathlib.Path(folder) / "read.py"
    script.write_text(PARAVIEW)
    with h5py.File(path, "r") as f:
        x, v = (f[f"particles/trajectory/{n}/value"][-1] for n in ("position", "velocity"))
        x0 = f["particles/trajectory/position/value"][0]
        t, bonds, strain = f["particles/trajectory/position/time"][...], f["connectivity/bonds"][...], f["backspring/strain/value"][-1]
    shaken = run(checks, folder, SQUARE[:4] + ["-bs_task", "modes", "-bs_modes", "5"], name="modes.h5md")
    with h5py.File(shaken) as f:
        shapes = f["modes/shape"][...]
    for kind in ("XDMFReader", "Xdmf3ReaderS", "Xdmf3ReaderT"):
        picture, out = (pathlib.Path(folder) / f"modes_{kind}.{e}" for e in ("png", "npz"))
        done = subprocess.run(["xvfb-run", "-a", "pvpython", "--force-offscreen-rendering", str(script), kind, f"{shaken}.xdmf", str(picture), str(out)], cwd=folder, capture_output=True, text=True, timeout=180)
        with np.load(out) as seen:
            checks.true(f"{kind}: shapes of modes", all(np.array_equal(seen[f"mode_{k:03d}"][:, :2], shapes[k]) for k in (0, 3)) and "ERR" not in done.stdout + done.stderr, (done.stdout + done.stderr)[-200:])
        picture, out = (pathlib.Path(os.environ.get("BS_TEST_PICTURES", folder)) / f"{kind}.{e}" for e in ("png", "npz"))
        command = ["xvfb-run", "-a", "pvpython", "--force-offscreen-rendering", str(script), kind, f"{path}.xdmf", str(picture), str(out)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=180)
        checks.true(f"ParaView's {kind} reads it", done.returncode == 0 and out.exists(), (done.stdout + done.stderr).strip()[-160:])
        if not out.exists():
            continue
        checks.true(f"{kind}: without a complaint", "ERR" not in done.stdout + done.stderr, (done.stdout + done.stderr)[-160:])
        with np.load(out) as seen:
            checks.true(f"{kind}: times, points, springs", np.array_equal(seen["times"], t) and np.array_equal(seen["points"], x)
                        and np.array_equal(seen["cells"], bonds))
            checks.true(f"{kind}: velocity and strain", np.array_equal(seen["velocity"], v) and np.array_equal(seen["strain"], strain))
            if kind == "XDMFReader":  # the others compute nothing and leave it out
                checks.true(f"{kind}: displacement", "displacement" in seen and np.array_equal(seen["displacement"], x - x0), f"{sorted(seen)}")
        image = matplotlib.image.imread(picture)[..., :3]
        drawn = np.abs(image - image[0, 0]).max(axis=2) > 0.05
        colours = len(np.unique((image[drawn] * 15).astype(int), axis=0))
        checks.true(f"{kind}: the picture shows a coloured lattice", drawn.mean() > 0.02 and colours > 10,
                    f"{drawn.mean():.3f} of the pixels, {colours} colours")


def main():
    checks = Checks(__doc__)
    for group in (contents, modes, holes, holes_continued, diluted, types, names, h5md, interrupted, continued, paraview):
        if checks.wants(group.__name__):
            with tempfile.TemporaryDirectory() as folder, checks.group(group.__name__):
                group(checks, folder)
    checks.finish()


if __name__ == "__main__":
    main()
