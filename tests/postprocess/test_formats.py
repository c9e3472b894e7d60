#!/usr/bin/env python3
"""What convert.py makes of every feature of a run in every format, and back: kept exactly (by energies, arrays, the run that goes on), or told by a
line, or refused by name. The readers are independent of convert.py: LAMMPS, gsd, VTK, ASE and MDAnalysis where installed, MDAnalysis' rules for H5MD."""
import argparse
import contextlib
import io
import itertools
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import warnings

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "postprocess"), str(ROOT / "tests" / "verify")]
from harness import Checks, write_lattice
from program import environment
import h5py
import numpy as np

import convert
import features
from backspring_io import RunError, open_run

WRITERS = {**convert.SERIES, **convert.SINGLE}
FIRST = {}
for _ending, _write in WRITERS.items():
    FIRST.setdefault(_write, _ending)
FORMATS = sorted((ending[1:] for ending in FIRST.values()), key="pvd".__eq__)  # a PVD's pieces are compared with the VTU
TWINS = {ending: FIRST[write] for ending, write in WRITERS.items() if FIRST[write] != ending}  # other endings of the same format
ALL = set(FORMATS)
VTK = {"vtu", "vtp", "pvd"}
STEP = ["-ts_type", "rk", "-ts_rk_type", "4", "-ts_adapt_type", "none", "-ts_dt", "0.005", "-bs_progress_interval", "-1"]


def net(d):
    """A perturbed grid and springs between points closer than 1.6."""
    rng = np.random.default_rng(5)
    x = np.array(list(itertools.product(*[range(n) for n in ((6,), (3, 3), (3, 3, 2))[d - 1]])), float)
    pairs = np.array([(i, j) for i, j in itertools.combinations(range(len(x)), 2) if np.linalg.norm(x[i] - x[j]) < 1.6])
    return x + rng.uniform(-0.1, 0.1, x.shape), pairs


def given(d, folder, **more):
    """A lattice file of that net; what `more` says in place of hooke springs of 20 to 40 N/m at random rest lengths."""
    x, pairs = net(d)
    rng = np.random.default_rng(7)
    table = {"mass": 0.5 + np.arange(len(x)) / len(x), "velocity": rng.uniform(-0.3, 0.3, x.shape), "stiffness": np.linspace(20, 40, len(pairs)),
             "rest_length": rng.uniform(0.9, 1.2, len(pairs))}
    table.update({k: v(x, pairs) if callable(v) else v for k, v in more.items()})
    ids = table.pop("ids", None)
    write_lattice(folder / "in.h5", x, table.pop("mass"), pairs=pairs, **table)
    if ids:
        with h5py.File(folder / "in.h5", "a") as f:
            f["particles/id"] = ids
    return ["-bs_lattice_file", "in.h5"]


def periodic(kind, axes, *more):
    size = {"triangular": "6,6", "cubic": "4,4,4"}[kind]
    return lambda folder: ["-bs_lattice_type", kind, "-bs_lattice_size", size, "-bs_lattice_periodic", axes, "-bs_lattice_perturbation", "0.1", "-bs_lattice_stiffness", "30",
                           "-bs_lattice_spacing", "1", *more]


def law(*names, **columns):
    """Springs of these laws in turn."""
    laws = lambda x, pairs: [names[k % len(names)] for k in range(len(pairs))]  # noqa: E731
    return lambda folder: given(2, folder, laws=laws, columns=columns)


def bent(d, angles, **limits):
    """Angle springs at those angles, rest angles given [degree], 2-D or 3-D; what each bears, by `limits`."""
    def make(folder):
        at = np.radians(np.array([a for a, _ in angles]))
        x = np.concatenate([[[10 * k + np.cos(0.4), np.sin(0.4)], [10 * k, 0], [10 * k + np.cos(0.4 + a), np.sin(0.4 + a)]] for k, a in enumerate(at)])
        x = np.pad(x, ((0, 0), (0, d - 2)))
        n = len(angles)
        pairs = np.concatenate([[[3 * k, 3 * k + 1], [3 * k + 1, 3 * k + 2]] for k in range(n)])
        write_lattice(folder / "in.h5", x, 1.0, pairs=pairs, stiffness=10.0, rest_length=0.9,
                      angles={"triples": np.arange(3 * n).reshape(n, 3), "stiffness": np.linspace(1, 2, n), "rest_angle": np.radians([r for _, r in angles])})
        with h5py.File(folder / "in.h5", "a") as f:
            f["angles"].update(limits)
        return ["-bs_lattice_file", "in.h5"]
    return make


def far_bent(folder):
    """An angle spring whose arms are longer than half the box."""
    x = np.array([[0.2, 0.2, 0.1], [1.0, 0.3, 0.2], [2.2, 1.5, 1.0]])
    write_lattice(folder / "in.h5", x, 1.0, pairs=[[0, 1], [1, 2]], stiffness=10.0, box=3.0 * np.eye(3), angles={"triples": [[0, 1, 2]], "stiffness": [2.0], "rest_angle": [2.0]})
    with h5py.File(folder / "in.h5", "a") as f:
        f["angles/shift"] = [[1, 0, 0, 0, 0, 0, 0, 0, 0]]
    return ["-bs_lattice_file", "in.h5"]


def hinged(**limits):
    """A net in space with two hinges; what each bears, by `limits`."""
    def make(folder):
        words = given(3, folder)
        with h5py.File(folder / "in.h5", "a") as f:
            f["hinges/quads"], f["hinges/stiffness"], f["hinges/rest_angle"] = [[0, 6, 2, 1], [6, 12, 8, 7]], [2.0, 3.0], [0.25, -1.5]
            f["hinges"].update(limits)
        return words
    return make


def anchors(x, pairs):
    d = x.shape[1]
    return {"particle": [3, 0], "point": np.arange(2.0 * d).reshape(2, d), "stiffness": [5.0, 7.0], "rest_length": [0.2, 0.0], "damping": [0.3, 0.0]}


def unlike(x, pairs):
    """Rest lengths of three sizes that differ by rounding."""
    return np.array([0.9, 1.0, 1.1])[np.arange(len(pairs)) % 3] * (1 + 2e-16 * (np.arange(len(pairs)) % 4))


# name: (lattice, options, formats that keep it, formats that refuse it, the word by which the others tell it)
NO_SPRINGS = {"xyz", "dump", "h5md"}
CASES = {
    "one dimension": (lambda f: given(1, f), [], VTK | {"data"}, set(), "springs"),
    "two dimensions": (lambda f: given(2, f), [], VTK | {"data"}, set(), "springs"),
    "three dimensions": (lambda f: given(3, f), [], VTK | {"data"}, set(), "springs"),
    "broken springs": (lambda f: given(2, f, columns={"critical_strain": 0.12}), ["-bs_break", "all"], set(), set(), {"springs", "broken springs"}),
    "springs that carry nothing": (lambda f: given(2, f, stiffness=lambda x, p: np.where(np.arange(len(p)) % 4, 30.0, 0.0)), [], set(), set(),
                                   {"springs", "springs that carry nothing"}),
    "law strain": (law("strain"), [], VTK | {"data"}, set(), {"springs", "law strain"}),
    "law tension": (law("tension"), [], VTK, {"data"}, {"springs", "law tension"}),
    "law polynomial": (law("polynomial", stiffness_2=5.0, stiffness_3=7.0), [], VTK, {"data"}, {"springs", "law polynomial"}),
    "law plastic, with its history": (law("plastic", yield_force=1.0, hardening=2.0), [], VTK, {"data"}, {"springs", "law plastic"}),
    "law maxwell, with its history": (law("maxwell", relaxation_time=0.5), [], VTK, {"data"}, {"springs", "law maxwell"}),
    "all laws": (law("hooke", "strain", "tension", "polynomial", "plastic", stiffness_2=5.0, yield_force=1.0), [], VTK, {"data"}, {"springs", "law plastic"}),
    "dampers": (lambda f: given(2, f, damping=lambda x, p: np.linspace(0, 1, len(p))), [], VTK, set(), {"springs", "dampers"}),
    "simple dampers": (lambda f: given(2, f, damping=0.5, damping_law="simple"), [], VTK, set(), {"springs", "dampers"}),
    "limits of springs": (lambda f: given(2, f, columns=lambda x, p: {"critical_strain": np.where(np.arange(len(p)) % 2, 0.9, np.inf)}), [], VTK, set(),
                          {"springs", "limits of springs"}),
    "limits that scatter": (lambda f: given(2, f), ["-bs_break_strain", "0.9", "-bs_break_uniform", "0.3,1"], VTK, set(), {"springs", "limits of springs"}),
    "rules of breaking": (lambda f: given(2, f), ["-bs_break_strain", "0.9"], set(), set(), {"springs", "rules of breaking (-bs_break_strain"}),
    "angle springs in the plane": (bent(2, [(70, 90), (200, 250), (179, 120)]), [], VTK | {"data"}, set(), "angle springs"),
    "angle springs in space": (bent(3, [(70, 90), (120, 60)]), [], VTK | {"data"}, set(), "angle springs"),
    "angle springs across pi": (bent(2, [(70, 90), (170, 190)]), [], VTK, {"data"}, "angle springs"),
    "broken angle springs": (bent(3, [(70, 90), (120, 60), (100, 95)], critical_change=[0.1, np.inf, 0.3]), [], set(), set(), {"angle springs", "broken angle spring"}),
    "limits of angle springs": (bent(3, [(70, 90), (120, 60)], critical_moment=[9.0, np.inf]), [], VTK, set(), {"angle springs", "limit of an angle spring"}),
    "limits of angle springs that scatter": (bent(3, [(70, 90), (120, 60)]), ["-bs_break_angle_energy", "90", "-bs_break_uniform", "0.3,1"], VTK, set(),
                                             {"angle springs", "limits of angle springs"}),
    "an angle spring broken on the far side of pi": (bent(2, [(170, 190), (70, 90)], critical_change=[0.1, np.inf]), [], set(), set(), {"angle springs", "broken angle spring"}),
    "hinges": (hinged(), [], VTK, set(), {"springs", "hinges"}),
    "broken hinges": (hinged(critical_change=[0.01, np.inf]), [], set(), set(), {"hinges", "broken hinge"}),
    "limits of hinges": (hinged(critical_energy=[np.inf, 90.0]), [], VTK, set(), {"hinges", "limit of a hinge"}),
    "anchors": (lambda f: given(2, f, anchors=anchors), [], VTK, set(), "anchors"),
    "motion of anchors": (lambda f: given(2, f, anchors=anchors), ["-bs_anchor_motion", "velocity", "-bs_anchor_velocity", "0.3,0.1"], set(), set(),
                          "motion of anchors (-bs_anchor_motion velocity; the points are those at the start"),
    "fixed particles": (lambda f: given(2, f, fixed=lambda x, p: np.arange(len(x)) < 2), [], VTK | {"xyz", "gsd"}, set(), "are fixed"),
    "groups": (lambda f: given(2, f), ["-bs_group_left", "xmin"], VTK, set(), "groups left"),
    "motion of groups": (lambda f: given(2, f), ["-bs_group_left", "xmin", "-bs_motion_left", "velocity:0.1,0"], set(), set(), "motion of groups (-bs_motion_left"),
    "forces on groups": (lambda f: given(2, f), ["-bs_group_left", "xmin", "-bs_force_left", "0.1,0"], set(), set(), "forces on groups (-bs_force_left"),
    "forces on particles": (lambda f: given(2, f, particle_columns={"force": np.linspace(-1, 1, 18).reshape(9, 2)}), [], VTK, set(), "forces on particles"),
    "gravity": (lambda f: given(2, f), ["-bs_gravity", "0,-9.81"], set(), set(), "gravity (-bs_gravity"),
    "drag": (lambda f: given(2, f), ["-bs_stokes_drag", "0.5"], set(), set(), "drag (-bs_stokes_drag"),
    "central gravity": (lambda f: given(2, f), ["-bs_central_M0", "1e11", "-bs_central_point", "5,5"], set(), set(), "other forces (-bs_central_M0"),
    "buoyancy and added mass": (lambda f: given(2, f, particle_columns={"radius": np.full(9, 0.1)}), ["-bs_buoyancy", "-bs_added_mass", "0.5",
                                "-bs_fluid_density", "1", "-bs_gravity", "0,-1"], set(), set(),
                                "other forces (-bs_added_mass 0.5, -bs_buoyancy"),
    "drag and radii of particles": (lambda f: given(2, f, particle_columns={"drag": np.linspace(0, 1, 9), "radius": np.full(9, 0.1)}), [], VTK, set(), "of particles"),
    "ids": (lambda f: given(2, f, ids=[90, 3, 7, 55, 20, 21, 22, 8, 14]), [], ALL - {"gsd"}, set(), "ids"),
    "rest lengths that differ by rounding": (lambda f: given(2, f, rest_length=unlike, stiffness=20.0), [], VTK | {"data"}, set(), "springs"),
    "units": (lambda f: given(3, f), ["-bs_output_units", "real"], {"h5md", "data"}, set(), "units (Angstrom, fs)"),
    "units of angle springs": (bent(3, [(70, 90), (120, 60)]), ["-bs_output_units", "real"], {"h5md", "data"}, set(), "units (Angstrom, fs)"),
    "SI units": (lambda f: given(3, f), ["-bs_output_units", "SI"], {"h5md", "data"}, set(), "units (m, s)"),
    "SI units in a periodic box": (periodic("cubic", "xyz"), ["-bs_output_units", "SI"], {"h5md", "data"}, set(), "units (m, s)"),
    "periodic box along the axes": (periodic("cubic", "xyz"), [], ALL, set(), None),
    "periodic plane": (periodic("triangular", "xy", "-bs_lattice_dim", "2"), [], ALL, set(), None),
    "periodic along x": (periodic("triangular", "x", "-bs_lattice_dim", "2"), [], ALL, set(), None),
    "strained box": (periodic("cubic", "xyz"), ["-bs_box_strain", "xx=velocity:0.3,yy=velocity:-0.2"], set(), set(), "strain of the box (-bs_box_strain"),
    "tilted box": (periodic("cubic", "xyz"), ["-bs_box_strain", "xx=velocity:0.3,yy=velocity:-0.2,xy=velocity:1,xz=velocity:-0.5,yz=velocity:0.4"], set(), set(), "strain of the box (-bs_box_strain"),
    "images": (periodic("cubic", "xyz", "-bs_lattice_velocity", "40,-30,20"), [], ALL, set(), None),
    "angle springs in a periodic box": (periodic("cubic", "xyz", "-bs_angle_stiffness", "2"), [], VTK | {"data"}, set(), "angle springs"),
    "angle springs in a periodic plane": (periodic("cubic", "xy", "-bs_lattice_type", "square", "-bs_lattice_size", "4,5", "-bs_lattice_dim", "2", "-bs_angle_stiffness", "2"), [],
                                          VTK | {"data"}, set(), "angle springs"),
    "angle springs to far images": (far_bent, [], VTK, {"data", "gsd"}, "angle spring"),
    "springs longer than half the box": (lambda f: periodic("triangular", "xy", "-bs_lattice_dim", "2")(f) + ["-bs_lattice_size", "2,2", "-bs_lattice_perturbation", "0"], [],
                                         ALL - {"gsd", "data"}, {"gsd", "data"}, "does not join the nearest images"),
}
OPEN_END = ("strained box", "tilted box")  # the rest of the run is not that of a lattice in a strained box: its strain begins anew
MOVED_ANCHORS = ("motion of anchors",)  # anchors of files are where they were at the start, as the trajectory has them


def simulate(checks, folder, words, name, end, options=()):
    done = subprocess.run([checks.program, *words, *options, *STEP, "-ts_max_time", repr(end), "-bs_output", name, "-bs_output_interval", "0.05", "-bs_overwrite",
                           "-bs_report", "report.json"], cwd=folder, env=environment(1), capture_output=True, text=True, timeout=120)
    if done.returncode:
        raise ValueError(done.stderr.strip()[-300:])
    return json.loads((folder / "report.json").read_text())


def converted(source, target, *args):
    """(refusal or None, lines on stderr)."""
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
            convert.main([str(source), "-o", str(target), *map(str, args)])
    except RunError as error:
        return str(error), said.getvalue()
    return None, said.getvalue()


FLAGS = {"springs": "backspring/broken/value", "angles": "backspring/broken_angles/value", "hinges": "backspring/broken_hinges/value"}


class Truth:
    """A frame as the trajectory has it, read by h5py alone."""

    def __init__(self, path, frame):
        with h5py.File(path, "r") as f:
            p, c = f["particles/trajectory"], f["connectivity"]
            self.x, self.v, self.time = p["position/value"][frame], p["velocity/value"][frame], p["position/time"][frame]
            self.mass, self.id, self.fixed, self.dim = p["mass"][...], p["id"][...], p["fixed"][...], self.x.shape[1]
            self.pairs, self.k, self.rest = c["bonds"][...], c["bonds_stiffness"][...], c["bonds_rest_length"][...]
            self.there = self.k > 0
            if "backspring/broken/value" in f:
                self.there &= f["backspring/broken/value"][frame] == 0
            self.periodic = np.array([w == b"periodic" for w in p["box"].attrs["boundary"]])
            self.shift = c["bonds_shift"][...] if "bonds_shift" in c else np.zeros((len(self.pairs), self.dim), int)
            edges = p["box/edges/value"][frame]
            self.cell = np.diag(edges) if edges.ndim == 1 else edges
            self.elastic = f["observables/elastic_energy/value"][frame]
            self.angles, self.triples = "angles" in c, c["angles"][...] if "angles" in c else None
            self.flags = {kind: f[path][frame] != 0 for kind, path in FLAGS.items() if path in f}
            if "angles" in self.flags:
                self.triples = self.triples[~self.flags["angles"]]
        self.length = np.linalg.norm(self.x[self.pairs[:, 1]] - self.x[self.pairs[:, 0]] + self.shift @ self.cell, axis=1)[self.there]

    def nearest(self, x, cell, pairs=None):
        """Lengths of the springs that are there, to nearest images."""
        pairs = self.pairs[self.there] if pairs is None else pairs
        apart = x[pairs[:, 1]] - x[pairs[:, 0]]
        periodic = np.pad(self.periodic, (0, 3 - self.dim))
        moves = np.array(list(itertools.product(*[(-2, -1, 0, 1, 2) if one else (0,) for one in periodic]))) @ cell
        return np.linalg.norm(apart[:, None, :] + moves[None], axis=2).min(axis=1)


def three(values):
    return np.pad(values, ((0, 0), (0, 3 - values.shape[1])))


def see_xyz(checks, name, path, truth):
    lines = path.read_text().splitlines()
    count = int(lines[0])
    table = np.array([line.split()[1:] for line in lines[2 - (count + 2):] if line.startswith("X ")][-count:], float)
    head = lines[-count - 1]
    expected = np.concatenate([three(truth.x), three(truth.v), truth.mass[:, None], truth.id[:, None], truth.fixed[:, None]], axis=1)
    checks.true(f"{name}: positions, velocities, masses, ids, fixed", np.array_equal(table, expected))
    pbc = re.search(r'pbc="(\w) (\w) (\w)"', head).groups()
    checks.true(f"{name}: which edges are periodic", [w == "T" for w in pbc] == [*truth.periodic, *[False] * (3 - truth.dim)], head[-60:])
    if truth.periodic.any():
        cell = np.array(re.search(r'Lattice="([^"]*)"', head).group(1).split(), float).reshape(3, 3)
        checks.true(f"{name}: periodic edges, a cell with a volume", np.array_equal(cell[:truth.dim, :truth.dim][truth.periodic], truth.cell[truth.periodic]) and abs(np.linalg.det(cell)) > 0)


    with contextlib.suppress(ImportError):
        import ase.io
        atoms = ase.io.read(path, index=-1, format="extxyz")
        checks.true(f"{name}: ASE reads the same", np.array_equal(atoms.positions, three(truth.x)) and np.array_equal(atoms.arrays["velo"], three(truth.v))
                    and np.array_equal(atoms.arrays["mass"], truth.mass) and np.array_equal(atoms.pbc[:truth.dim], truth.periodic) and atoms.info["Time"] == truth.time)
        if truth.periodic.any():
            checks.true(f"{name}: ASE has the cell", np.array_equal(np.asarray(atoms.cell)[:truth.dim, :truth.dim][truth.periodic], truth.cell[truth.periodic]))


def see_dump(checks, name, path, truth):
    block = path.read_text().split("ITEM: TIMESTEP\n")[-1].splitlines()
    at = next(k for k, line in enumerate(block) if line.startswith("ITEM: ATOMS"))
    words = block[at].split()[2:]
    table = np.array([line.split() for line in block[at + 1:]], float)
    column = {word: table[:, k] for k, word in enumerate(words)}
    bounds = np.array([line.split() for line in block[4:7]], float)
    tilt = bounds[:, 2] if bounds.shape[1] == 3 else np.zeros(3)
    xy, xz, yz = tilt
    wide = bounds[:, 1] - bounds[:, 0]
    wide[0] -= max(0, xy, xz, xy + xz) - min(0, xy, xz, xy + xz)
    wide[1] -= max(0, yz) - min(0, yz)
    cell = np.array([[wide[0], 0, 0], [xy, wide[1], 0], [xz, yz, wide[2]]])
    x = np.stack([column[k] for k in "xyz"], axis=1)
    if truth.periodic.any():
        low = bounds[:, 0] - [min(0, xy, xz, xy + xz), min(0, yz), 0]
        in_their_boxes(checks, name, x, np.stack([column["i" + k] for k in "xyz"], axis=1), cell, low, truth)
    checks.near(f"{name}: lengths of springs", np.sort(truth.nearest(x, cell)), np.sort(truth.nearest(three(truth.x), full(truth))), 1e-9)
    checks.near(f"{name}: speeds", np.linalg.norm(np.stack([column["v" + k] for k in "xyz"], axis=1), axis=1), np.linalg.norm(truth.v, axis=1), 1e-12)
    own = truth.id if truth.id.min() > 0 else np.arange(1, len(truth.x) + 1)
    checks.true(f"{name}: masses and ids", np.array_equal(column["mass"], truth.mass) and np.array_equal(column["id"], own))


def in_their_boxes(checks, name, x, images, cell, low, truth):
    """Particles lie in the box, and the images that they are in lead back to where they are, up to a turn."""
    inside = ((x - low) @ np.linalg.inv(cell))[:, np.pad(truth.periodic, (0, 3 - truth.dim))]
    checks.true(f"{name}: particles lie in the box", inside.min() > -1e-9 and inside.max() < 1 + 1e-9, f"{inside.min():.3g} to {inside.max():.3g}")
    there, given = x + images @ cell, three(truth.x)
    apart = [np.linalg.norm(p[:, None] - p[None], axis=2) for p in (there, given)]
    checks.below(f"{name}: distances by the images", np.abs(apart[0] - apart[1]).max(), 1e-9 * max(1, apart[1].max()))


def full(truth):
    cell = np.eye(3)
    cell[:truth.dim, :truth.dim] = truth.cell
    return cell


def see_gsd(checks, name, path, truth):
    try:
        import gsd.hoomd
    except ImportError:
        return checks.skip(name, "apt install python3-gsd")
    with gsd.hoomd.open(str(path), "rb") as file:
        frame = file[len(file) - 1]
    lx, ly, lz, xy, xz, yz = frame.configuration.box
    cell = np.array([[lx, 0, 0], [xy * ly, ly, 0], [xz * lz, yz * lz, lz]])
    x = frame.particles.position.astype(float)
    inside = x @ np.linalg.inv(cell)
    checks.below(f"{name}: particles lie in the box", np.abs(inside).max(), 0.5 + 1e-6)
    checks.near(f"{name}: bonds that are there, their lengths", truth.nearest(x, cell, np.asarray(frame.bonds.group, int)), truth.length, 2e-5)
    checks.true(f"{name}: bonds between the right particles", np.array_equal(frame.bonds.group, truth.pairs[truth.there]))
    placed = x + frame.particles.image @ cell
    if not np.triu(truth.cell, 1).any():
        checks.near(f"{name}: positions with images", placed[:, :truth.dim], truth.x, 2e-5 * max(1, np.abs(truth.x).max()))
    checks.near(f"{name}: masses and speeds", [frame.particles.mass, np.linalg.norm(frame.particles.velocity, axis=1)], [truth.mass, np.linalg.norm(truth.v, axis=1)],
                1e-6 * max(1, np.abs(truth.v).max()))
    checks.true(f"{name}: fixed particles by type", np.array_equal(np.array(frame.particles.types)[frame.particles.typeid] == "fixed", truth.fixed != 0))
    if truth.angles:
        checks.true(f"{name}: angles between the right particles, of one type", np.array_equal(frame.angles.group, truth.triples)
                    and list(frame.angles.types) == ["angle spring"] and not np.any(frame.angles.typeid))


def as_mdanalysis(path, frame):
    """What MDAnalysis 2.4 (Debian 12) reads of an H5MD file with its defaults, by the rules of its reader: KeyError or ValueError where it gives up."""
    units = {"time": {"ps": 1, "fs": 1e-3, "ns": 1e3, "s": 1e12}, "position": {"Angstrom": 1, "nm": 10, "pm": 1e-2},
             "velocity": {"Angstrom ps-1": 1, "nm ps-1": 10, "m s-1": 1e-2, "nm ns-1": 1e-2, "Angstrom fs-1": 1e3}}
    with h5py.File(path, "r") as f:
        group = f["particles"][list(f["particles"])[0]]
        members = [f["observables"][key] for key in f.get("observables", {})]
        if not all("value" in one and "time" in one and "step" in one for one in members) or not all(name in ("box", "position", "velocity") or not isinstance(of, h5py.Group) or "value" in of
                                                                                                     for name, of in group.items()):
            raise ValueError("a group that is no quantity")
        if group["box"].attrs["dimension"] != 3:
            raise ValueError("MDAnalysis only supports 3-dimensional simulation boxes")
        factor = {k: units[k][group[k + "/value"].attrs["unit"]] for k in ("position", "velocity") if k in group}
        seen = {k: factor[k] * group[k + "/value"][frame] for k in factor}
        seen["time"] = units["time"][group["position/time"].attrs["unit"]] * group["position/time"][frame]
        for key in f.get("observables", {}):
            f["observables"][key]["value"][frame]
        edges = group["box/edges/value"][frame, :]
    seen["box"] = None  # of three lengths, (T, 3), versions before 2.5 make none
    if edges.shape == (3, 3) and np.linalg.det(edges) > 0:
        lengths = np.linalg.norm(edges, axis=1)
        seen["box"] = [*factor["position"] * lengths,
                       *(np.degrees(np.arccos(edges[a] @ edges[b] / lengths[a] / lengths[b])) for a, b in ((1, 2), (0, 2), (0, 1)))]
    return seen


def see_h5md(checks, name, path, truth, scale):
    """`scale`: angstrom of one unit of length of the trajectory."""
    seen = as_mdanalysis(path, -1)
    with contextlib.suppress(ImportError), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a box without volume
        import MDAnalysis
        universe = MDAnalysis.Universe.empty(len(truth.x), trajectory=False)
        universe.load_new(str(path), format="H5MD")
        last = universe.trajectory[-1]
        checks.near(f"{name}: MDAnalysis itself, positions", last.positions, seen["position"], 1e-6 * max(1, np.abs(seen["position"]).max()))
        checks.true(f"{name}: MDAnalysis itself, box", (last.dimensions is None) == (seen["box"] is None) and (seen["box"] is None or np.allclose(last.dimensions, seen["box"], rtol=1e-6)),
                    f"{last.dimensions}")
    checks.near(f"{name}: positions [angstrom]", seen["position"] / scale, three(truth.x), 1e-9 * max(1, np.abs(truth.x).max()))
    if truth.periodic.any():
        cell = full(truth)
        for k in range(truth.dim):
            if truth.periodic[k]:
                checks.near(f"{name}: edge {k} of the box", seen["box"][k] / scale, np.linalg.norm(cell[k]), 1e-9 * np.abs(cell).max())
        if truth.dim == 3:
            angles = [np.degrees(np.arccos(cell[a] @ cell[b] / np.linalg.norm(cell[a]) / np.linalg.norm(cell[b]))) for a, b in ((1, 2), (0, 2), (0, 1))]
            checks.near(f"{name}: angles of the box", seen["box"][3:], angles, 1e-9)
    else:
        checks.true(f"{name}: no box", seen["box"] is None)


def directly(checks, folder):
    """What MDAnalysis reads of a trajectory as it is, with driven groups, stresses of groups and a tilted box: its rules, and itself where it is installed."""
    words = ["-bs_lattice_type", "cubic", "-bs_lattice_size", "3,3,3", "-bs_lattice_periodic", "xyz", "-bs_lattice_perturbation", "0.1", "-bs_lattice_spacing", "1",
             "-bs_lattice_stiffness", "30", "-bs_group_left", "xmin", "-bs_group_right", "xmax", "-bs_motion_left", "fixed", "-bs_motion_right", "velocity:0.1,0,0",
             "-bs_stress_groups", "left,right", "-bs_box_strain", "xy=velocity:0.1", "-bs_output_units", "real"]
    simulate(checks, folder, words, "run.h5md", 0.1)
    truth = Truth(folder / "run.h5md", 2)
    see_h5md(checks, "a trajectory as it is", folder / "run.h5md", truth, 1.0)
    with open_run(folder / "run.h5md") as run:
        names = set(run.series)
        checks.true("the groups are there, too", {"reaction/left", "reaction/right", "work/right", "work/box", "stress_volume/left"} <= names, str(names))
        for kind in ("reaction", "work", "stress_volume"):
            parts = [value for name, value in run.series.items() if name.startswith(kind + "/")]
            checks.near(f"{kind}: the sum over the groups", run.series[kind], np.sum(parts, axis=0), 1e-12 * max(np.abs(p).max() for p in parts))


def axes(checks, folder):
    """A trajectory of a box along the axes, as it is: three lengths a frame, which is what others take; with SI units, which MDAnalysis does not know, by way of nanometres."""
    words = periodic("cubic", "xyz")(folder)
    simulate(checks, folder, [*words, "-bs_output_units", "real"], "run.h5md", 0.1)
    truth = Truth(folder / "run.h5md", 2)
    with h5py.File(folder / "run.h5md") as f:
        checks.true("a box along the axes: three lengths a frame", f["particles/trajectory/box/edges/value"].shape == (3, 3) and truth.cell.shape == (3, 3))
    checks.near("a box along the axes: MDAnalysis' rules, positions", as_mdanalysis(folder / "run.h5md", -1)["position"], truth.x, 1e-12)
    simulate(checks, folder, [*words, "-bs_output_units", "SI"], "si.h5md", 0.1)
    try:
        as_mdanalysis(folder / "si.h5md", -1)
        checks.true("SI units: MDAnalysis does not know the metre", False)
    except KeyError as unit:
        checks.true("SI units: MDAnalysis does not know the metre", unit.args == ("m",), str(unit))
    refusal, _ = converted(folder / "si.h5md", folder / "si_nm.h5md")
    checks.true("SI units: in nanometres", refusal is None, str(refusal))
    see_h5md(checks, "SI units, a box along the axes, in nanometres", folder / "si_nm.h5md", Truth(folder / "si.h5md", 2), 1e10)


def older(checks, folder):
    """A trajectory that lacks an observable of today's goes on without it."""
    words = ["-bs_lattice_type", "square", "-bs_lattice_size", "4,4", "-bs_group_left", "xmin", "-bs_motion_left", "velocity:0.1,0", "-bs_checkpoint", "run.ck"]
    simulate(checks, folder, words, "run.h5md", 0.1)
    with h5py.File(folder / "run.h5md", "a") as f:
        for name in ("reaction", "work"):
            for part in ("value", "step", "time"):
                del f[f"observables/{name}/{part}"]
    done = subprocess.run([checks.program, "-bs_restart", "run.ck", "-ts_max_time", "0.2"], cwd=folder, env=environment(1), capture_output=True, text=True, timeout=120)
    checks.true("an older trajectory goes on", done.returncode == 0, done.stderr.strip()[-200:])
    with open_run(folder / "run.h5md") as run:
        checks.true("with whole frames", run.frames == 5 and len(run.series["reaction/left"]) == 5 and "reaction" not in run.series, f"{run.frames} frames")
    for name in ("value", "time", "step"):
        done = subprocess.run([checks.program, *words[:4], f"-bs_group_{name}", "xmin", "-ts_max_steps", "1", "-ts_dt", "0.01"], cwd=folder, env=environment(1), capture_output=True,
                              text=True, timeout=120)
        checks.true(f"a group named {name} is refused", done.returncode == 2 and f"a group is named {name}" in done.stderr, done.stderr.strip()[-100:])


def see_vtp(checks, name, path, truth):
    try:
        import vtk
        from vtk.util.numpy_support import vtk_to_numpy
    except ImportError:
        return checks.skip(name, "apt install python3-vtk9")
    seen = []
    for kind, file in (("PolyData", path), ("UnstructuredGrid", path.with_suffix(".vtu"))):
        reader = getattr(vtk, f"vtkXML{kind}Reader")()
        reader.SetFileName(str(file))
        reader.Update()
        data = reader.GetOutput()
        cells = (data.GetLines() if kind == "PolyData" else data.GetCells()).GetConnectivityArray()
        tables = {"points": data.GetPoints().GetData(), "lines": cells}
        for group, of in (("point", data.GetPointData()), ("cell", data.GetCellData()), ("field", data.GetFieldData())):
            tables.update({f"{group} {of.GetArrayName(k)}": of.GetArray(k) for k in range(of.GetNumberOfArrays())})
        seen.append({k: vtk_to_numpy(v) for k, v in tables.items()})
    checks.true(f"{name}: VTK reads the same of both files", seen[0].keys() == seen[1].keys() and all(np.array_equal(seen[0][k], seen[1][k], equal_nan=seen[0][k].dtype.kind == "f")
                                                                                                 for k in seen[0]))
    drawn = truth.pairs.copy()
    across = truth.shift.any(axis=1)
    drawn[across, 1] = drawn[across, 0]
    checks.true(f"{name}: lines are the springs that are there", np.array_equal(seen[0]["lines"].reshape(-1, 2), drawn[truth.there]))
    checks.true(f"{name}: points", np.array_equal(seen[0]["points"], three(truth.x)))


def see_vtu(checks, folder, name, path, truth, options, source):
    """Read back, it is the lattice that goes on as the run did."""
    refusal, _ = converted(path, folder / "back.h5")
    checks.true(f"{name}: becomes a lattice", refusal is None, refusal or "")
    if refusal or name.split(",")[0] in MOVED_ANCHORS:
        return
    limits_of(checks, name, folder / "back.h5", source)
    report = simulate(checks, folder, ["-bs_lattice_file", "back.h5"], "back.h5md", 0.05, options)
    checks.near(f"{name}: elastic energy", report["first_elastic_energy"][0], truth.elastic, 1e-12 * max(1, truth.elastic))
    if name.split(",")[0] not in OPEN_END:
        with h5py.File(folder / "back.h5md") as a, h5py.File(source) as b:
            checks.near(f"{name}: where it goes", a["particles/trajectory/position/value"][-1], b["particles/trajectory/position/value"][2], 1e-11)


def limits_of(checks, name, lattice, source):
    """What springs, angle springs and hinges bear, those that are whole, with the factors that were drawn for them."""
    with h5py.File(lattice) as a, h5py.File(source) as b:
        for kind, flags in FLAGS.items():
            whole = b[flags][1] == 0 if flags in b else slice(None)
            for limit in ("strain", "force", "change", "moment", "energy"):
                drawn = [b[path][whole] for path in (f"connectivity/{kind.replace('springs', 'bonds')}_{word}_{limit}" for word in ("threshold", "critical")) if path in b]
                if drawn:
                    checks.true(f"{name}: what {kind} bear, {limit}", np.array_equal(a[f"{kind}/critical_{limit}"][...], drawn[0]))


def see_flags(checks, folder, truth, options, source):
    """With --all_springs a VTU has all of them, and angle springs and hinges, the broken ones flagged, and read back they stay broken."""
    refusal, said = converted(source, folder / "all.vtu", "--frame", 1, "--all_springs")
    checks.true("--all_springs: written, nothing left out", refusal is None and "broken" not in said, said)
    refusal, _ = converted(folder / "all.vtu", folder / "all.h5")
    with h5py.File(folder / "all.h5") as f:
        checks.true("--all_springs: all springs are there", len(f["springs/pairs"]) == len(truth.pairs))
        for kind, broken in truth.flags.items():
            flagged = f[f"{kind}/broken"][...] != 0 if f"{kind}/broken" in f else np.zeros(len(broken), bool)
            checks.true(f"--all_springs: broken {kind} stay broken", np.array_equal(flagged, broken))
    report = simulate(checks, folder, ["-bs_lattice_file", "all.h5"], "all.h5md", 0.05, options)
    checks.near("--all_springs: elastic energy", report["first_elastic_energy"][0], truth.elastic, 1e-12)


def see_data(checks, folder, name, path, truth):
    text = path.read_text()
    if name.startswith("rest lengths that differ by rounding"):
        checks.true(f"{name}: bond types", "3 bond types" in text, re.search(r"\d+ bond types", text).group())
    words = " ".join("p" if one else "f" for one in [*truth.periodic, False, False][:3])
    style = "angle" if truth.angles else "bond"
    units = "real" if "units = real" in text else "si"
    beside = ("anchors", "motion of anchors", "hinges", "broken hinges", "limits of hinges")  # whose energy is no springs'
    elastic = truth.elastic if name.split(",")[0] not in beside else 0.5 * (truth.k * (truth.length - truth.rest) ** 2).sum()
    if truth.periodic.any():
        low, high = np.array([line.split()[:2] for line in text.splitlines() if line.endswith("hi")], float).T
        tilt = [line.split()[:3] for line in text.splitlines() if line.endswith("xy xz yz")]
        xy, xz, yz = map(float, tilt[0]) if tilt else (0, 0, 0)
        rows = np.array([line.split() for line in re.split(r"\n[A-Z][a-z]+\n", text.split("\nAtoms # ")[1].split("\n", 2)[2])[0].split("\n") if line], float)
        wide = high - low
        in_their_boxes(checks, name, rows[:, 3:6], rows[:, 6:9], np.array([[wide[0], 0, 0], [xy, wide[1], 0], [xz, yz, wide[2]]]), low, truth)
    refusal, _ = converted(path, folder / "data.h5", "--boundary", words.replace(" ", ","), "--dim", truth.dim, "--units", units)
    checks.true(f"{name}: becomes a lattice", refusal is None, refusal or "")
    if not refusal:
        report = simulate(checks, folder, ["-bs_lattice_file", "data.h5"], "back.h5md", 0.005)
        checks.near(f"{name}: elastic energy of that", report["first_elastic_energy"][0], elastic, 1e-10 * max(1, elastic))
        with h5py.File(folder / "data.h5") as f:
            checks.near(f"{name}: masses of that", f["particles/mass"][...], truth.mass, 1e-15)
            checks.near(f"{name}: speeds of that", np.linalg.norm(f["particles/velocity"][...], axis=1), np.linalg.norm(truth.v, axis=1), 1e-12)
    if not shutil.which("lmp"):
        return checks.skip(name, "apt install lammps")
    (folder / "in.lmp").write_text(f"units {units}\natom_style {style}\nboundary {words}\nbond_style harmonic\n" + ("angle_style harmonic\n" if truth.angles else "")
                                   + "pair_style zero 2.5\nneighbor 0.5 bin\ncomm_modify cutoff 5\nspecial_bonds lj/coul 1 1 1\nbox tilt large\n"
                                   f"read_data {path.name}\npair_coeff * *\nthermo_style custom step pe ke\nthermo_modify norm no format float %.17g\nrun 0\n")
    done = subprocess.run(["lmp", "-in", "in.lmp", "-log", "log.lmp", "-screen", "none"], cwd=folder, env=environment(1), capture_output=True, text=True, timeout=120)
    log = (folder / "log.lmp").read_text()
    found = re.search(r"^ *Step .*\n(?:WARNING.*\n)*( *[-+\d.][-+\d.e ]*)\n", log, re.M)
    checks.true(f"{name}: LAMMPS reads it", done.returncode == 0 and found, done.stderr[-200:])
    if not found:
        return
    scale = 4.184e-4 if units == "real" else 1.0
    row = np.array(found.group(1).split(), float)
    checks.near(f"{name}: LAMMPS' energy", row[1] * scale, elastic, 1e-9 * max(1.0, elastic))


SEEN = set()  # (feature, ending) that some case has walked


def by_table(checks, label, ending, found, refusal, said):
    """What is said of every feature that the run has is what the table says."""
    form = convert.FORM.get(ending, ending[1:])
    SEEN.update((feature, ending) for feature in found)
    if refusal:
        return
    verdict = {feature: features.TABLE[feature][form] for feature in found}
    owner = {part: whole for whole, parts in features.INSIDE.items() for part in parts if verdict.get(whole) == features.DROPPED}
    wrong = [feature for feature, word in verdict.items() if word == features.REFUSED or (word == features.DROPPED) != (found[owner.get(feature, feature)] in said)
             and feature not in ("springs", "angle springs")]
    checks.true(f"{label}: what the table says of all that is there", not wrong, f"{wrong}: {said.strip()}")


def twins(checks, folder, label, target, source, frames):
    """Other endings of a format give the same file."""
    for ending, first in TWINS.items():
        if first == target.suffix:
            refusal, _ = converted(source, target.with_suffix(ending), *frames)
            checks.true(f"{label}: the same as {ending}", refusal is None and target.with_suffix(ending).read_bytes() == target.read_bytes(), str(refusal))


def crossing(checks, folder, name):
    """One feature through all formats."""
    make, options, kept, refused, word = CASES[name]
    source = folder / "run.h5md"
    words = make(folder)
    simulate(checks, folder, words, "run.h5md", 0.1, options)
    truth = Truth(source, 1)
    if name in ("broken springs", "springs that carry nothing"):
        checks.true(f"{name}: some are there, some are not", 0 < truth.there.sum() < len(truth.there), f"{truth.there.sum()} of {len(truth.there)}")
    if name.startswith("broken "):
        kind = {"angle springs": "angles"}.get(name[len("broken "):], name[len("broken "):])
        checks.true(f"{name}: some are broken, some are not", 0 < truth.flags[kind].sum() < len(truth.flags[kind]), str(truth.flags[kind]))
        see_flags(checks, folder, truth, options, source)
    with open_run(source) as run:
        found = features.found_in(run, 1)
    for form in FORMATS:
        target, label = folder / ("out_nm.h5md" if form == "h5md" else f"out.{form}"), f"{name}, {form}"
        frames = ("--frame", 1) if "." + form in convert.SINGLE else ("--frames", "0:2")
        refusal, said = converted(source, target, *frames)
        for ending in ["." + form, *(twin for twin, first in TWINS.items() if first == "." + form)]:
            by_table(checks, label, ending, found, refusal, said)
        tell = word if isinstance(word, (set, tuple)) else {word} if word else set()
        if form in refused:
            checks.true(f"{label}: refused by name", refusal is not None and any(w in refusal for w in tell | {"other side of 180"}) and "\n" not in refusal and not target.exists(), str(refusal))
            continue
        checks.true(f"{label}: written", refusal is None, refusal or "")
        if refusal:
            continue
        checks.true(f"{label}: at most one line is said", len(said.splitlines()) <= 1, said.strip())
        if form in kept:
            mine = tell - ({"springs"} if form not in NO_SPRINGS else set())
            checks.true(f"{label}: not said to be left out", not any(f"{w}" in said for w in mine if w != "springs"), said.strip())
        elif tell:
            checks.true(f"{label}: told", any(w in said for w in tell), said.strip())
        if form == "pvd":
            checks.true(f"{label}: its frame is the VTU", (folder / "out" / "frame_000001.vtu").read_bytes() == vtu)
            continue
        twins(checks, folder, label, target, source, frames)
        see = {"xyz": see_xyz, "dump": see_dump, "gsd": see_gsd, "vtp": see_vtp}
        if form in see:
            see[form](checks, label, target, truth)
        elif form == "h5md":
            lengths = folder / "lengths_nm.h5md"
            if truth.periodic.any() and name != "tilted box":
                converted(source, lengths, "--frames", "0:2", "--box_lengths")
                with h5py.File(lengths) as f:
                    checks.near(f"{label}: --box_lengths", f["particles/trajectory/box/edges/value"][-1][:truth.dim] / 1e9, np.diag(truth.cell), 1e-12 * np.abs(truth.cell).max())
            elif truth.periodic.any():
                checks.true(f"{label}: --box_lengths", "not along the axes" in str(converted(source, lengths, "--box_lengths")[0]))
            see_h5md(checks, label, target, truth, 1.0 if name.startswith("units") else 1e10)
        elif form == "vtu":
            vtu = target.read_bytes()
            see_vtu(checks, folder, label, target, truth, options, source)
        elif form == "data":
            see_data(checks, folder, label, target, truth)
        else:
            checks.true(f"{label}: this test knows how to read it", False)


def table(checks):
    """The table in README.md is the one that convert.py goes by."""
    text = (ROOT / "postprocess" / "README.md").read_text()
    rows = {cells[0].strip(): [c.strip() for c in cells[1:]] for cells in (line.strip("| \n").split("|") for line in text.splitlines() if line.startswith("|")) if len(cells) == 7}
    for feature, verdict in features.TABLE.items():
        checks.true(f"README's table: {feature}", rows.get(feature) == [verdict[form] for form in features.FORMATS], str(rows.get(feature)))
    said = subprocess.run([checks.program, "-help"], capture_output=True, text=True, env=environment(1), timeout=60).stdout
    for option in re.findall(r"^ *-(bs_break\w*): ", said, re.M):  # every one of them, also those that are still to come
        run = argparse.Namespace(parameters={option: "1"})
        checks.true(f"-{option} is told", features.by_options(run, "rules of breaking") == f"-{option} 1")


def not_finite(checks, folder):
    """A number that is none, anywhere: refused by frame, dataset and row, and nothing is written."""
    simulate(checks, folder, periodic("cubic", "xyz", "-bs_lattice_velocity", "1,0,0")(folder), "run.h5md", 0.1)
    for dataset, place, says in (("particles/trajectory/position/value", (1, 17, 2), "frame 1: /particles/trajectory/position/value, row 17, is not finite"),
                                 ("particles/trajectory/velocity/value", (1, 3, 0), "frame 1: /particles/trajectory/velocity/value, row 3,"),
                                 ("particles/trajectory/box/edges/value", (1, 2), "frame 1: /particles/trajectory/box/edges/value, row "),
                                 ("particles/trajectory/position/time", (1,), "frame 1: /particles/trajectory/position/time"),
                                 ("particles/trajectory/mass", (5,), "/particles/trajectory/mass, row 5,"), ("connectivity/bonds_stiffness", (9,), "/connectivity/bonds_stiffness, row 9,"),
                                 ("connectivity/bonds_rest_length", (9,), "/connectivity/bonds_rest_length, row 9,")):
        for bad in (np.nan, np.inf):
            shutil.copy(folder / "run.h5md", folder / "bad.h5md")
            with h5py.File(folder / "bad.h5md", "a") as f:
                f[dataset][place] = bad
            for ending in WRITERS:
                target = folder / ("out_nm.h5md" if ending == ".h5md" else f"out{ending}")
                refusal, _ = converted(folder / "bad.h5md", target, *(("--frame", 1) if ending in convert.SINGLE else ()))
                checks.true(f"{bad} in {dataset}, {ending}: refused by name", refusal is not None and says in refusal and str(bad) in refusal and "\n" not in refusal, str(refusal))
                checks.true(f"{bad} in {dataset}, {ending}: nothing is written", not target.exists() and not (folder / "out").exists())
    for ending in (".pdb", ".xdmf", ".obj", ".txt", ""):
        refusal, _ = converted(folder / "run.h5md", folder / f"out{ending}")
        checks.true(f"ending '{ending}': refused, with those that there are", refusal is not None and f"unknown ending '{ending}'" in refusal and all(e in refusal for e in WRITERS), str(refusal))


def covered(checks):
    """Every feature of the table has met every ending."""
    missing = [pair for pair in itertools.product(features.TABLE, WRITERS) if pair not in SEEN]
    checks.true("every feature has met every format", not missing, str(missing[:8]))
    columns = {convert.FORM.get(ending, ending[1:]) for ending in WRITERS}
    checks.true("every format is a column of the table", columns == set(features.FORMATS) and all(set(row) == columns for row in features.TABLE.values()), str(columns))


def main():
    checks = Checks(__doc__)
    if checks.wants("table"):
        with checks.group("table"):
            table(checks)
    for group in (directly, axes, older, not_finite):
        if checks.wants(group.__name__):
            with tempfile.TemporaryDirectory() as folder, checks.group(group.__name__):
                group(checks, pathlib.Path(folder))
    for name in CASES:
        if checks.wants(name):
            with tempfile.TemporaryDirectory() as folder, checks.group(name):
                crossing(checks, pathlib.Path(folder), name)
    if all(checks.wants(name) for name in CASES):
        covered(checks)
    checks.finish()


if __name__ == "__main__":
    main()
