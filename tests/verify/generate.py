#!/usr/bin/env python3
"""-bs_task generate: a run from the file that is written is the run from what it was made of, bit for bit on one rank (on more, rounding of solvers differs); the file written of it is the same again; files
of every dataset that a lattice may have come back whole."""
import io
import re

from harness import REPO, run_parts
import h5py
import numpy as np

TYPES = {"chain": "7", "square": "5,4", "triangular": "5,4", "cloth": "5,4", "cubic": "3,3,3", "bcc": "3,2,3", "fcc": "2,3,2", "kagome": "3,2", "honeycomb": "3,2", "diamond": "2,2,2"}
PERIODIC = {"chain": "x", "cubic": "xyz", "bcc": "xyz", "fcc": "xyz", "diamond": "xyz"}
SETTINGS = {  # of the lattice, and of the run, by what they are for
    "plain": ({"bs_lattice_damping": 0.1, "bs_lattice_fixed": "xmin"}, {"bs_gravity": (0.3,)}),
    "disorder": ({"bs_lattice_perturbation": 0.05, "bs_lattice_stiff_fraction": 0.3, "bs_lattice_stiff_factor": 3, "bs_lattice_seed": 4, "bs_lattice_velocity": (0.1,),
                  "bs_lattice_rest_length_factor": 0.9, "bs_lattice_radius": 0.1, "bs_lattice_total_mass": 9}, {"bs_viscosity": 0.2}),
    "diluted": ({"bs_lattice_remove_fraction": 0.3, "bs_lattice_prune": "dangling", "bs_lattice_seed": 7, "bs_lattice_fixed_particles": "0", "bs_lattice_damping": 0.1},
                {"bs_gravity": (0.1,)}),
    "groups": ({"bs_lattice_fixed_groups": "held", "bs_group_held": "xmin", "bs_group_pulled": "ids:3,5", "bs_anchor_group": "pulled", "bs_anchor_stiffness": 3,
                "bs_damping_law": "simple", "bs_anchor_damping": 0.2, "bs_spring_law": "maxwell", "bs_spring_relaxation_time": 0.5}, {"bs_force_pulled": (0.2,), "bs_anchor_motion": "sinusoid",
                                                                                                       "bs_anchor_amplitude": (0.1,), "bs_anchor_frequency": 0.5}),
    "periodic": ({"bs_lattice_perturbation": 0.02, "bs_lattice_remove_fraction": 0.05, "bs_lattice_remove_each": True, "bs_lattice_seed": 2, "bs_damping_law": "simple",
                  "bs_lattice_damping": 0.1}, {"bs_box_strain": "xx=velocity:0.1"}),
}


def lattice_of(kind, name):
    options = {"bs_lattice_type": kind, "bs_lattice_size": TYPES[kind], "bs_lattice_stiffness": 20, **SETTINGS[name][0]}
    if name == "periodic":
        options["bs_lattice_periodic"] = PERIODIC.get(kind, "xy")
        if kind == "triangular":
            options["bs_lattice_size"] = "6,4"
    return options


def contents(data):
    """{path: array or attribute} of an HDF5 file, without what names it or took time."""
    found = {}

    def add(name, item):
        for key, value in item.attrs.items():
            if not name.startswith(("h5md", "parameters")) and not isinstance(value, h5py.Reference):
                found[f"{name}@{key}"] = np.asarray(value)
        if isinstance(item, h5py.Dataset) and "wall" not in name:
            found[name] = item[...]

    with h5py.File(io.BytesIO(data)) as f:
        add("", f)
        f.visititems(add)
    return found


def differences(a, b):
    """Names of what is not the same in every bit."""
    same = lambda u, v: u.dtype == v.dtype and u.shape == v.shape and u.tobytes() == v.tobytes() if u.dtype.kind != "O" else np.array_equal(u, v)  # noqa: E731
    return sorted(set(a) ^ set(b)) + [name for name in a if name in b and not same(a[name], b[name])]


def written(checks, options, **more):
    return checks.run({**options, "bs_task": "generate", "bs_output": "l.h5"}, keep=("l.h5",), **more).files["l.h5"]


def again(checks, folder, data, **more):
    (folder / "l.h5").write_bytes(data)
    return written(checks, {"bs_lattice_file": folder / "l.h5"}, **more)


def compare(checks, name, folder, lattice, run, data):
    """The run from the lattice itself and from its file."""
    (folder / "l.h5").write_bytes(data)
    frames = [contents(checks.run({**given, **run, "bs_output": "r.h5md"}, keep=("r.h5md",)).files["r.h5md"]) for given in (lattice, {"bs_lattice_file": folder / "l.h5"})]
    wrong = differences(*frames)
    if checks.ranks == 1:
        checks.true(f"{name}: the run is the same in every bit", not wrong and len(frames[0]) > 10, ", ".join(wrong[:6]))
        return
    off = [np.nanmax(np.abs(a - frames[1][path]), initial=0) / max(np.nanmax(np.abs(a), initial=0), 1) for path, a in frames[0].items() if path in wrong and path in frames[1]
           and a.dtype.kind in "fi" and "log" not in path]
    checks.below(f"{name}: the run is the same", max(off, default=0), 1e-11)
    checks.true(f"{name}: the same datasets", set(frames[0]) == set(frames[1]))


STEPS = {"ts_dt": 0.02, "ts_max_time": 0.1, "ts_type": "beuler"}


def types(checks, folder):
    """Every type with every set of options; on several ranks a sixth of these."""
    def one(mine, item):
        kind, name = item
        lattice, here = lattice_of(kind, name), folder / f"{kind}_{name}"
        here.mkdir()
        data = written(mine, lattice)
        wrong = differences(contents(data), contents(again(mine, here, data, ranks=4 - mine.ranks)))
        mine.true(f"{kind}, {name}: read and written again it is the same", not wrong, ", ".join(wrong))
        compare(mine, f"{kind}, {name}", here, lattice, {**STEPS, **SETTINGS[name][1]}, data)
    every = [(kind, name) for kind in TYPES for name in SETTINGS]
    checks.each(every if checks.ranks == 1 else every[::6], one)


def tasks(checks, folder):
    """Equilibria, moduli and modes, with angle springs and with limits."""
    square = {"bs_lattice_type": "square", "bs_lattice_size": "6,6", "bs_lattice_neighbors": 8, "bs_lattice_stiffness": 10, "bs_angle_stiffness": 0.3, "bs_lattice_fixed": "ymin",
              "bs_lattice_perturbation": 0.1, "bs_lattice_seed": 3, "bs_group_top": "ymax"}
    net = {"bs_lattice_type": "triangular", "bs_lattice_size": "8,8", "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1, "bs_lattice_remove_fraction": 0.2, "bs_lattice_seed": 1,
           "bs_lattice_prune": "rattlers"}
    cloth = {"bs_lattice_type": "cloth", "bs_lattice_size": "6,5", "bs_lattice_dim": 3, "bs_lattice_stiffness": 100, "bs_lattice_fixed_particles": "0,5"}
    for name, lattice, run in (("statics", square, {"bs_task": "statics", "bs_motion_top": "velocity:0.3,0.1", "bs_load_steps": 3, "bs_break_strain": 0.2}),
                               ("moduli", net, {"bs_task": "moduli"}), ("modes", net, {"bs_task": "modes", "bs_modes": 20}),
                               ("cloth", cloth, {**STEPS, "bs_gravity": (0, 0, -9.81)})):
        compare(checks, name, folder, lattice, run, written(checks, lattice))


SCENE = """#1.0
cmas 1
elas 1
kspr 4
kdmp 1
fixm 0
shws 1
cent 2
frce 0 1 10 30
frce 1 1 2 0.5
frce 2 1 30 2
frce 3 1 100 1
visc 0.3
stck 0
step 0.01
prec 1
adpt 0
gsnp 20 0
wall 1 0 1 1
mass 1 100 100 0 0 1 1
mass 2 140 120 5 0 -2 1
mass 5 180 100 0 3 1.5 1
mass 7 100 100 0 0 1 1
spng 1 1 2 8 0.5 40
spng 2 2 5 8 0.5 45
spng 3 1 7 3 0 10
"""


def scenes(checks, folder):
    """What an .xsp scene implies goes with the file: forces, walls, step, and that springs without a direction exert none."""
    (folder / "s.xsp").write_text(SCENE)
    (folder / "middle.xsp").write_text(SCENE.replace("cent 2", "cent -1"))
    for path in (folder / "s.xsp", folder / "middle.xsp", REPO / "meshes/net.xsp"):
        lattice = {"bs_lattice_file": path}
        data = written(checks, lattice)
        wrong = differences(contents(data), contents(again(checks, folder, data)))
        checks.true(f"{path.name}: read and written again it is the same", not wrong, ", ".join(wrong))
        compare(checks, path.name, folder, lattice, {"ts_max_time": 0.05}, data)
        compare(checks, f"{path.name}, other gravity", folder, lattice, {"ts_max_time": 0.05, "bs_gravity": (0, 3)}, data)
    with h5py.File(folder / "l.h5", "r+") as f:
        f.attrs["implied_options"] = "-bs_gravity 0,-1 -bs_output x.h5md"
    said = checks.run({"bs_lattice_file": folder / "l.h5"}, expect=2).stderr
    checks.true("no other option is taken from a file", "attribute implied_options of /: '-bs_output' is no option of an .xsp scene" in said, said)


def trajectories(checks, folder):
    """The last frame of a run in which springs yielded and broke goes on the same."""
    start = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,5", "bs_lattice_stiffness": 50, "bs_spring_law": "plastic", "bs_spring_yield_force": 1, "bs_spring_hardening": 5,
             "bs_lattice_fixed": "xmin", "bs_lattice_damping": 0.2, "bs_group_right": "xmax"}
    run = checks.run({**start, **STEPS, "ts_max_time": 1, "bs_break_strain": 0.08, "bs_force_right": (3, 0), "bs_output": "r.h5md"}, keep=("r.h5md",))
    (folder / "before.h5md").write_bytes(run.files["r.h5md"])
    lattice = {"bs_lattice_file": folder / "before.h5md"}
    data = written(checks, lattice)
    found = contents(data)
    checks.true("there are broken and stretched springs", found["springs/broken"].any() and found["springs/plastic_stretch"].any())
    compare(checks, "a trajectory's last frame", folder, lattice, {**STEPS, "bs_break_strain": 0.08}, data)


def listed():
    """Datasets of a lattice as the table of meshes/README.md lists them."""
    found = set()
    for names in re.findall(r"^\| (`/[^|]*`[^|]*) \|", (REPO / "meshes/README.md").read_text(), re.M):
        group = ""
        for name in re.findall(r"`([\w/]+)`", names):
            group = name.rsplit("/", 1)[0] if name.startswith("/") else group
            found.add(name if name.startswith("/") else f"{group}/{name}")
    return found


def every_dataset(checks, folder):
    """A file with every dataset of the schema comes back as it was, number by number."""
    rng = np.random.default_rng(1)
    n, m, laws = 12, 20, ["hooke", "plastic", "maxwell", "polynomial"]
    pairs = rng.permutation([(i, j) for i in range(n) for j in range(i)])[:m]
    law = np.arange(m) % 4
    x = rng.uniform(0, 3, (n, 3))
    take = lambda k, low, high: np.where(law == k, rng.uniform(low, high, m), 0)  # noqa: E731
    sets = {"particles/position": x, "particles/mass": rng.uniform(1, 2, n), "particles/velocity": rng.uniform(-1, 1, (n, 3)) * (np.arange(n) % 5 != 0)[:, None], "particles/fixed": np.arange(n) % 5 == 0,
            "particles/radius": rng.uniform(0, 1, n), "particles/drag": rng.uniform(0, 1, n), "particles/force": rng.uniform(-1, 1, (n, 3)), "particles/id": 7 + 3 * np.arange(n),
            "springs/pairs": pairs, "springs/stiffness": rng.uniform(1, 2, m), "springs/rest_length": rng.uniform(1, 2, m), "springs/damping": rng.uniform(0, 1, m),
            "springs/area": rng.uniform(1, 2, m), "springs/shift": rng.integers(-1, 2, (m, 3)) * [1, 1, 0], "springs/law": law, "springs/stiffness_2": take(3, 1, 2),
            "springs/stiffness_3": take(3, 1, 2), "springs/yield_force": take(1, 1, 2), "springs/hardening": take(1, 1, 2), "springs/plastic_stretch": take(1, 0, 0.1),
            "springs/plastic_path": take(1, 0.2, 0.3), "springs/relaxation_time": take(2, 1, 2), "springs/viscous_stretch": take(2, 0, 0.1), "springs/viscous_loss": take(2, 0, 1),
            "springs/critical_strain": np.where(np.arange(m) % 3, np.inf, 0.4), "springs/critical_force": rng.uniform(5, 9, m), "springs/critical_energy": rng.uniform(5, 9, m),
            "springs/broken": (np.arange(m) % 7 == 0).astype(float), "anchors/particle": [1, 2], "anchors/point": rng.uniform(0, 3, (2, 3)), "anchors/stiffness": [1.0, 2.0],
            "anchors/rest_length": [0.5, 0.0], "anchors/damping": [0.1, 0.2], "groups/NAME": [2, 3, 7], "groups/a": [0], "box/edges": [[3.5, 0, 0], [0.5, 3.6, 0], [0, 0, 4.0]],
            "angles/triples": [[0, 1, 2], [3, 4, 5]], "angles/stiffness": [0.1, 0.2], "angles/rest_angle": [1.0, 2.0], "angles/shift": rng.integers(0, 2, (2, 9)) * ([1, 1, 0] * 3),
            "hinges/quads": [[0, 1, 2, 3], [4, 5, 6, 7], [7, 8, 9, 10]], "hinges/stiffness": [0.1, 0.2, 0.3], "hinges/rest_angle": [1.0, -2.0, 3.0],
            "hinges/shift": np.zeros((3, 12), int)}
    named = {name.lstrip("/") for name in listed()} | {"angles/shift", "hinges/shift"}
    checks.true("these are the datasets that meshes/README.md lists", named | {"groups/a"} == set(sets), str(sorted((named | {"groups/a"}) ^ set(sets))))
    with h5py.File(folder / "all.h5", "w") as f:
        for name, value in sets.items():
            f[name] = np.asarray(value) if np.asarray(value).dtype.kind != "b" else np.asarray(value, np.int64)
        f["box"].attrs["boundary"], f["box"].attrs["dimension"] = ["periodic", "periodic", "none"], 3
        f.attrs["spring_laws"], f.attrs["damping_law"], f.attrs["force_at_zero_length"], f.attrs["implied_options"] = laws, "simple", "none", "-bs_gravity 0,0,-1 -bs_viscosity 0.5"
    data = written(checks, {"bs_lattice_file": folder / "all.h5"})
    found = contents(data)
    names = str(found["@spring_laws"]).split(",")
    checks.true("every dataset is there and no other", {name for name in found if "@" not in name} == set(sets), str({n for n in found if "@" not in n} ^ set(sets)))
    for name, value in sets.items():
        got = found[name] if name != "springs/law" else np.array([laws.index(names[k]) for k in found[name]])
        checks.true(name, np.array_equal(got, value), "")
    said = {name[1:]: found[name] for name in found if name.startswith("@")}
    checks.true("attributes", {k: str(v) for k, v in said.items() if k != "spring_laws"} == {"damping_law": "simple", "force_at_zero_length": "none",
                                                                                          "implied_options": "-bs_gravity 0,0,-1 -bs_viscosity 0.5"}, str(said))
    wrong = differences(found, contents(again(checks, folder, data, ranks=4 - checks.ranks)))
    checks.true("written again it is the same", not wrong, ", ".join(wrong))


def files(checks, folder):
    """What is there stays, but with -bs_overwrite; options of runs are named."""
    chain = {"bs_lattice_type": "chain", "bs_lattice_size": 4, "bs_task": "generate"}
    path = folder / "l.h5"
    checks.run({**chain, "bs_output": path})
    before = path.read_bytes()
    said = checks.run({**chain, "bs_output": path}, expect=2).stderr
    checks.true("a file that is there is refused and stays", "exists: give another -bs_output or add -bs_overwrite" in said and path.read_bytes() == before, said)
    report = checks.run({**chain, "bs_lattice_size": 6, "bs_lattice_fixed": "xmin", "bs_output": path, "bs_overwrite": True}).report
    with h5py.File(path) as f:
        checks.true("-bs_overwrite replaces it", len(f["particles/mass"]) == 6)
    checks.true("the report counts", (report["task"], report["particles"], report["fixed_particles"], report["springs"], report["dimension"]) == ("generate", 6, 1, 5, 1), str(report))
    checks.true("nothing else is left", sorted(p.name for p in folder.iterdir()) == ["l.h5"])
    said = checks.run({**chain, "bs_output": folder / "m.h5", "bs_gravity": (0, 1), "ts_dt": 0.1}).stderr
    checks.true("options of runs are named", "options -bs_gravity, -ts_dt are not kept by the lattice file" in said, said)
    quiet = checks.run({**chain, "bs_output": folder / "n.h5"}).stderr
    checks.true("nothing is said where there are none", quiet == "", quiet)


if __name__ == "__main__":
    run_parts("lattices written as files", (types, tasks, scenes, trajectories, every_dataset, files))
