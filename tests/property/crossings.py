#!/usr/bin/env python3
"""Every ability beside every other: tasks, laws, boxes, supports, breaking, forces and outputs, chosen so that each two of them meet in some run. Whatever
the crossing: nothing that is not finite is written; an equilibrium is one by NumPy's forces, too; what broke existed, and broke once; the run stopped half-way
and continued, and the one on three ranks, are the uninterrupted one; and what is refused is refused in one line."""
import itertools
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import h5py
import numpy as np
from harness import Checks, write_lattice
from program import environment, words

ABILITIES = {
    "task": ("beuler", "cn", "bdf", "alpha2", "symplectic", "verlet", "rk", "statics", "arc", "moduli", "modes", "about"),
    "law": ("hooke", "strain", "zero_rest", "tension", "polynomial", "plastic", "mixed", "angles", "hinges"),
    "shape": ("chain", "net", "block"),
    "box": ("open", "periodic", "tilted", "strained", "stressed"),
    "support": ("free", "fixed", "roller", "velocity", "sinusoid", "rotation", "table", "expression", "anchors"),
    "breaking": ("none", "all", "worst", "force", "energy"),
    "force": ("none", "gravity", "drag", "axial", "simple", "given"),
    "output": ("plain", "stress", "single", "padded", "units"),
    "absent": ("no", "some"),  # springs of stiffness 0
}
STILL = ("statics", "arc", "moduli", "about")
HELD = ("fixed", "roller", "velocity", "sinusoid", "rotation", "table", "expression")
STEPS = {"beuler": 0.02, "cn": 0.02, "bdf": 0.02, "alpha2": 0.02, "symplectic": 0.002, "verlet": 0.002, "rk": 0.002}
UNKNOWN = ("matrix",)  # NaN until the run has ended well


def has_no_sense(case):
    """A chain has neither shears nor rotations, and springs of rest length 0 collapse where a given stress begins at nothing."""
    return (case["shape"] == "chain" and (case["box"] == "tilted" or case["support"] == "rotation")) or (case["law"] == "zero_rest" and case["box"] == "stressed")


def is_refused(case):
    """Whether the program says that it does not do this crossing; every other must run."""
    boxed, still, held = case["box"] != "open", case["task"] in STILL, case["support"] not in ("free", "anchors")
    return (
        (case["law"] == "angles" and case["shape"] == "chain")
        or (case["law"] == "hinges" and case["shape"] != "block")
        or (case["task"] == "moduli" and (not boxed or case["support"] != "free"))
        or (case["box"] == "stressed" and (case["task"] not in ("statics", "moduli", "about") or case["support"] != "free" or case["force"] == "gravity"))
        or (case["box"] == "stressed" and case["breaking"] != "none")
        or (case["task"] == "arc" and case["breaking"] != "none")
        or (case["box"] == "strained" and case["force"] == "drag" and case["task"] in STEPS)
        or (still and case["force"] == "gravity" and not held and case["support"] != "anchors")
    )


# --- one crossing as a lattice and options -------------------------------------------------------------------------------

def positions(shape, rng):
    """(N, d) of a chain, a triangular net or a block, moved a little, and the edges of the box that repeats them."""
    if shape == "chain":
        x, edges = np.arange(10.0)[:, None], np.array([[10.0]])
    elif shape == "net":
        x = np.array([(i + 0.5 * (j % 2), j * np.sqrt(0.75)) for j in range(4) for i in range(5)])
        edges = np.diag([5.0, 4 * np.sqrt(0.75)])
    else:
        x = np.array(list(itertools.product(range(3), repeat=3)), float)
        edges = np.diag([3.0, 3.0, 3.0])
    return x + rng.uniform(-0.03, 0.03, x.shape), edges


def springs(x, edges, reach, boxed):
    """Pairs nearer than `reach` and the box that the second end is in."""
    d, found = x.shape[1], []
    for s in itertools.product((-1, 0, 1), repeat=d) if boxed else [(0,) * d]:
        away = np.linalg.norm(x[None] + np.array(s) @ edges - x[:, None], axis=2)
        found += [(i, j, s) for i, j in zip(*np.nonzero(away < reach)) if i < j or (i == j and s > (0,) * d)]
    return np.array([f[:2] for f in found]), np.array([f[2] for f in found])


def lattice(path, case, rng):
    """Writes it; its anchors, or None."""
    x, edges = positions(case["shape"], rng)
    d, boxed = x.shape[1], case["box"] != "open"
    if case["box"] == "tilted":
        edges[1, 0] = 0.5 if case["shape"] == "net" else 0.0
        edges[-1, 0] += 0.3
    pairs, shift = springs(x, edges, {1: 2.3, 2: 1.3, 3: 1.6}[d], boxed)
    l = np.linalg.norm(x[pairs[:, 1]] + shift @ edges - x[pairs[:, 0]], axis=1)
    m = len(pairs)
    laws = {"mixed": ["hooke", "tension", "plastic"], "angles": ["hooke"], "hinges": ["hooke"], "zero_rest": ["hooke"]}.get(case["law"], [case["law"]])
    rest = np.zeros(m) if case["law"] == "zero_rest" else l * rng.uniform(0.97, 1.0, m)
    k = rng.uniform(90, 110, m)
    if case["absent"] == "some":
        k[rng.permutation(m)[: m // 8]] = 0
    columns = {}
    if "polynomial" in laws:
        columns.update(stiffness_2=20.0, stiffness_3=5.0)
    if "plastic" in laws:
        columns.update(yield_force=4.0, hardening=10.0)
    limits = {"all": ("critical_strain", 0.06), "worst": ("critical_strain", 0.06), "force": ("critical_force", 6.0), "energy": ("critical_energy", 0.2)}
    if case["breaking"] != "none":
        name, limit = limits[case["breaking"]]
        # Springs of rest length 0 have no strain, and bear what holds them together at the start.
        if case["law"] == "zero_rest":
            name, limit = "critical_force", 1.03 * (k * l).max()
        columns[name] = limit * rng.uniform(0.9, 1.1, m)
    damping = 0.3 if case["force"] in ("axial", "simple") else None
    drag = 0.1 if case["force"] == "simple" or case["task"] not in STILL else 0.0  # an axial damper has no direction where an anchor holds a particle alone
    anchors = dict(particle=[0, len(x) - 1], point=x[[0, -1]] + 0.05, stiffness=[40, 50], rest_length=[0, 0], damping=[drag, 0]) if case["support"] == "anchors" else None
    write_lattice(path, x, rng.uniform(0.5, 1.5, len(x)), pairs=pairs, stiffness=k, rest_length=rest, damping=damping, anchors=anchors, columns=columns,
                  laws=[laws[i % len(laws)] for i in range(m)], damping_law="simple" if case["force"] == "simple" else "axial",
                  box=edges if boxed else None, shift=shift if boxed else None)
    with h5py.File(path, "a") as f:
        if case["law"] in ("angles", "hinges"):
            put_interactions(f, case["law"], x, pairs, shift, edges, boxed)
        low, high = np.argsort(x[:, -1], kind="stable")[:3], np.argsort(x[:, -1], kind="stable")[-3:]
        f["groups/low"], f["groups/high"] = np.sort(low), np.sort(high)
    return anchors


def put_interactions(f, law, x, pairs, shift, edges, boxed):
    """Angle springs between every fifth two springs at a particle, or hinges over every fifth three that do not lie in a plane; in a box with the images that
    the springs join."""
    d, rows, boxes, rest = x.shape[1], [], [], []
    for b in range(len(x)):
        near = sorted([(int(j), tuple(s)) for (i, j), s in zip(pairs, shift) if i == b] + [(int(i), tuple(-s)) for (i, j), s in zip(pairs, shift) if j == b])
        near = [(p, s) for p, s in near if p != b]
        for others in list(itertools.combinations(near, 2 if law == "angles" else 3))[::5]:
            at = [x[p] + np.array(s) @ edges - x[b] for p, s in others]
            if law == "hinges" and d == 3 and abs(np.linalg.det(at)) < 0.3:
                continue
            rows.append([others[0][0], b, others[1][0]] if law == "angles" else [b, *(p for p, _ in others)])
            boxes.append(np.ravel([others[0][1], (0,) * d, others[1][1]] if law == "angles" else [(0,) * d, *(s for _, s in others)]))
            rest.append(0.98 * (angle(*at) if law == "angles" else fold(*at) if d == 3 else 0))
    group = "angles" if law == "angles" else "hinges"
    f[f"{group}/{'triples' if law == 'angles' else 'quads'}"], f[f"{group}/stiffness"], f[f"{group}/rest_angle"] = rows, np.full(len(rows), 2.0 if law == "angles" else 0.3), rest
    if boxed:
        f[f"{group}/shift"] = boxes


def angle(a, c):
    if len(a) == 2:
        return np.arctan2(a[0] * c[1] - a[1] * c[0], a @ c) % (2 * np.pi)
    return np.arccos(a @ c / np.linalg.norm(a) / np.linalg.norm(c))


def fold(e, u, w):
    return np.arctan2(np.cross(np.cross(w, e), np.cross(e, u)) @ e / np.linalg.norm(e), np.cross(e, u) @ np.cross(w, e))


def options(case, folder):
    d = {"chain": 1, "net": 2, "block": 3}[case["shape"]]
    last = "xyz"[d - 1]
    out = {"bs_lattice_file": folder / "lattice.h5", "bs_progress_interval": -1, "snes_rtol": 1e-12}
    if case["task"] in STEPS:
        out.update(ts_type=case["task"], ts_dt=STEPS[case["task"]], ts_max_time=8 * STEPS[case["task"]], ts_adapt_type="none")
    else:
        out["bs_task"] = {"arc": "statics", "about": "modes"}.get(case["task"], case["task"])
        if case["task"] in ("statics", "arc"):
            out["bs_load_steps"] = 6
        out.update({"arc": {"bs_load_control": "arc", "bs_arc_steps": 12}, "about": {"bs_modes_about": "equilibrium"}}.get(case["task"], {}))
        if case["task"] in ("modes", "about"):
            out["bs_modes"] = 4
    motion = {"fixed": "fixed", "roller": f"{last}=fixed", "velocity": ",".join([f"{last}=velocity:0.3", *("x=fixed",) * (d > 1)]), "sinusoid": f"{last}=sinusoid:0.2,0.3,0",
              "rotation": "rotation:0.3" + {2: ",2,1", 3: ",1,1,1,0,0,1"}.get(d, ""), "table": f"{last}=table:{folder / 'table.csv'}", "expression": f"{last}=expression:0.2*t^2+0.01*x0*t"}
    if case["support"] in motion:
        out.update(bs_motion_low="fixed", bs_motion_high=motion[case["support"]])
        (folder / "table.csv").write_text("0,0\n0.05,0.01\n1,0.3\n2,0.3\n")
    if case["support"] == "anchors":
        out.update(bs_anchor_motion="velocity", bs_anchor_velocity=("0.2", "0.2,0.1", "0.2,0.1,0")[d - 1])
    if case["box"] == "strained":
        out["bs_box_rate"] = "xx=0.1"
    if case["box"] == "stressed":
        out["bs_box_stress"] = "xx=2"
    out.update({"gravity": {"bs_gravity": ",".join(["0"] * (d - 1) + ["-2"])}, "drag": {"bs_stokes_drag": 0.2},
                "given": {"bs_force_low": ",".join(["0"] * (d - 1) + ["-0.6,total"]), "bs_force_high": ",".join(["0"] * (d - 1) + ["0.2"])}}.get(case["force"], {}))
    if case["breaking"] != "none":
        out.update(bs_break="worst" if case["breaking"] == "worst" else "all", bs_break_in="both" if case["breaking"] == "energy" else "tension")
    out.update({"stress": {"bs_output_stress": True, "bs_stress_groups": "low"}, "single": {"viewer_hdf5_sp_output": True}, "padded": {"bs_output_pad": 3},
                "units": {"bs_output_units": "SI"}}.get(case["output"], {}))
    return out


def crossings():
    """Each two abilities of two kinds that the program can join, in as few runs as a greedy search finds; the same list every time."""
    rng, names = np.random.default_rng(7), list(ABILITIES)
    every = [(name, value) for name in names for value in ABILITIES[name]]
    missing = {pair: 0 for pair in itertools.combinations(every, 2) if pair[0][0] != pair[1][0]}
    chosen = []
    while missing:
        wanted, best, gain = next(iter(missing)), None, 0
        for _ in range(200):
            case = {name: ABILITIES[name][rng.integers(len(ABILITIES[name]))] for name in names}
            case.update(wanted)
            new = 0 if is_refused(case) or has_no_sense(case) else sum(pair in missing for pair in itertools.combinations(case.items(), 2))
            if new > gain:
                best, gain = case, new
        if best is None:  # these two are never joined
            del missing[wanted]
            continue
        chosen.append(best)
        for pair in itertools.combinations(best.items(), 2):
            missing.pop(pair, None)
    return chosen


# --- what must hold ---------------------------------------------------------------------------------------------------------

class Run:
    """One run in a folder: exit code, both streams, report."""

    def __init__(self, checks, folder, given, ranks=1):
        command = [checks.program, *words(dict(given, bs_report=folder / "report.json", bs_overwrite=True))]
        done = subprocess.run((["mpirun", "-n", str(ranks)] if ranks > 1 else []) + command, cwd=folder, env=environment(ranks), capture_output=True, text=True, timeout=300)
        self.code, self.said, self.errors = done.returncode, done.stdout, done.stderr
        self.report = json.loads((folder / "report.json").read_text()) if (folder / "report.json").exists() else None
        self.command = " ".join(command)


def not_finite(path):
    """Names of datasets of a trajectory in which some number that should be known is none."""
    found = []

    def look(name, item):
        if not isinstance(item, h5py.Dataset) or item.dtype.kind != "f" or name.rsplit("/", 1)[-1] in UNKNOWN:
            return
        bad = ~np.isfinite(item[...])
        if name == "backspring/strain/value":  # of broken springs and of those without a rest length there is none
            bad = bad & ~without_strain(item.file, bad.shape)
        if name == "events/broken/strain":
            bad = bad & (item.file["connectivity/bonds_rest_length"][...][item.file["events/broken/spring"][...]] != 0)
        if bad.any():
            found.append(name)
    with h5py.File(path) as f:
        f.visititems(look)
    return found


def without_strain(f, shape):
    broken = f["backspring/broken/value"][...] == 1 if "backspring/broken" in f else np.zeros(shape, bool)
    return broken | (f["connectivity/bonds_rest_length"][...] == 0)[None] | ~existing(f)[None]


def existing(f):
    """Springs that can exert a force: one whose stiffnesses and damping are all 0 is none."""
    return np.any([f["connectivity/bonds_" + name][...] != 0 for name in ("stiffness", "stiffness_2", "stiffness_3", "damping") if "bonds_" + name in f["connectivity"]], axis=0)


def not_finite_report(value, path="report"):
    if isinstance(value, dict):
        return [bad for key, item in value.items() for bad in not_finite_report(item, f"{path}.{key}")]
    if isinstance(value, list):
        return [bad for k, item in enumerate(value) for bad in not_finite_report(item, f"{path}[{k}]")]
    return [path] if isinstance(value, float) and not np.isfinite(value) else []


def tension(laws, f, l):
    """Of every spring at the lengths l (M), by the formulas of the laws; f: the trajectory, whose last frame it is."""
    at = {name: f["connectivity/bonds_" + name][...] if "bonds_" + name in f["connectivity"] else 0.0 for name in ("stiffness", "rest_length", "stiffness_2", "stiffness_3")}
    k, L, s = at["stiffness"], at["rest_length"], l - at["rest_length"]
    e = f["backspring/plastic_stretch/value"][-1] if "backspring/plastic_stretch" in f else 0.0
    by_law = {"hooke": k * s, "strain": k * s / np.where(L > 0, L, 1), "tension": k * np.maximum(s, 0), "polynomial": k * s + at["stiffness_2"] * s**2 + at["stiffness_3"] * s**3,
              "plastic": k * (s - e)}
    out = np.select([laws == name for name in by_law], list(by_law.values()))
    return np.where(f["backspring/broken/value"][-1] == 1, 0, out) if "backspring/broken" in f else out


def free_force(f, case, anchors):
    """(largest force on a component that nothing holds, largest tension) at the last frame, of springs, weight, given forces and anchors, all but angle springs and hinges."""
    group = f["particles/trajectory"]
    d = {"chain": 1, "net": 2, "block": 3}[case["shape"]]
    x, pairs = group["position/value"][-1][:, :d].astype(float), f["connectivity/bonds"][...]
    r = x[pairs[:, 1]] - x[pairs[:, 0]]
    if case["box"] != "open":
        edges = group["box/edges/value"][-1]
        edges = (edges if edges.ndim == 2 else np.diag(edges))[:d, :d]
        r += f["connectivity/bonds_shift"][...] @ edges
    l = np.linalg.norm(r, axis=1)
    names = f["connectivity/bonds_law"].attrs["spring_laws"].decode().split(",") if "bonds_law" in f["connectivity"] else []
    laws = np.array([names[k] for k in f["connectivity/bonds_law"][...]] if names else [case["law"]] * len(l))
    laws = np.where(f["connectivity/bonds_rest_length"][...] == 0, "hooke", laws)
    T = tension(laws, f, l)
    force = np.zeros_like(x)
    each = (T / np.where(l > 0, l, 1))[:, None] * r
    np.add.at(force, pairs[:, 0], each)
    np.add.at(force, pairs[:, 1], -each)
    factor = f["observables/load_factor/value"][-1].item() if "observables/load_factor" in f else 1.0
    if case["force"] == "gravity":
        force[:, -1] -= 2 * factor * group["mass"][...].ravel()
    if case["force"] == "given":
        force[f["groups/low"][...], -1] -= 0.2 * factor
        force[f["groups/high"][...], -1] += 0.2 * factor
    if anchors is not None:
        velocity = np.array([0.2, 0.1, 0.0])[:d]
        for row, point, k in zip(anchors["particle"], anchors["point"], anchors["stiffness"]):
            force[row] += k * (point + factor * velocity - x[row])
    held = np.zeros_like(x, bool)
    if case["support"] in HELD:
        held[f["groups/low"][...]] = True
        held[f["groups/high"][...], -1 if case["support"] == "roller" else slice(None)] = True
        if case["support"] in ("velocity", "sinusoid", "table", "expression"):
            held[f["groups/high"][...], :] = False
            held[f["groups/high"][...], -1] = True
            if case["support"] == "velocity":
                held[f["groups/high"][...], 0] = True
    return np.abs(force[~held]).max(initial=0), np.abs(T).max()


def what_broke(checks, name, f):
    """Flags, events and the count agree, nothing breaks twice, and what broke carried a force."""
    flags, there = f["backspring/broken/value"][...], existing(f)
    rows = f["events/broken/spring"][...] if "events/broken" in f else np.zeros(0, int)
    checks.true(f"{name}: what broke is told once, and its flag stays", len(set(rows)) == len(rows) and (np.diff(flags, axis=0) >= 0).all() and set(np.flatnonzero(flags[-1])) == set(rows))
    checks.true(f"{name}: what broke existed", there[rows].all(), f"{(~there[rows]).sum()} of {len(rows)} could exert no force")


def same_end(checks, name, one, other, bound):
    """Frames that both have at the end, by their numbers."""
    with h5py.File(one) as f, h5py.File(other) as g:
        off = [f[p][-1] - g[p][-1] for p in ("particles/trajectory/position/value", "particles/trajectory/velocity/value")]
        worst = max(float(np.abs(o).max()) for o in off)
        broken = "backspring/broken" not in f or np.array_equal(f["backspring/broken/value"][-1], g["backspring/broken/value"][-1])
        checks.true(f"{name}: same times and breaks at the end", f["particles/trajectory/position/time"][-1] == g["particles/trajectory/position/time"][-1] and broken)
    checks.below(f"{name}: states at the end", worst, bound)


def check(checks, item):
    """All rules for one crossing."""
    number, case = item
    name = f"{number} {' '.join(case.values())}"
    with tempfile.TemporaryDirectory() as there:
        folder = pathlib.Path(there)
        anchors = lattice(folder / "lattice.h5", case, np.random.default_rng(number))
        given = options(case, folder)
        run = Run(checks, folder, dict(given, bs_output=folder / "run.h5md"))
        if run.code == 3 and case["task"] in STILL and case["force"] == "gravity" and case["breaking"] != "none":
            # parts that breaks have set free fall, and come to rest nowhere: that is to be said
            checks.true(f"{name}: no equilibrium after breaks", " had broken: compute the motion" in run.errors, run.errors.strip()[:900])
            return
        checks.true(f"{name}: runs", run.code == 0, run.errors.strip()[:900] + (f" [{run.command}]" if run.code else ""))
        if run.code:
            return
        bad = not_finite(folder / "run.h5md") + not_finite_report(run.report)
        checks.true(f"{name}: all that is written is finite", not bad, ", ".join(bad))
        with h5py.File(folder / "run.h5md") as f:
            if "backspring/broken" in f:
                what_broke(checks, name, f)
            if case["task"] in STILL and case["law"] not in ("angles", "hinges") and case["output"] != "single":
                left, size = free_force(f, case, anchors)
                checks.below(f"{name}: forces are balanced", left, 1e-8 * max(size, 1))
        if case["task"] in STEPS or case["task"] == "statics":
            continued(checks, name, case, folder, given)
        if number % 4 == 0:
            other = Run(checks, folder, dict(given, bs_output=folder / "three.h5md"), ranks=3)
            checks.true(f"{name}: runs on three ranks", other.code == 0, other.errors.strip()[:900])
            if other.code == 0:
                turns = case["support"] == "anchors" and run.report.get("zero_modes")  # about the line between the anchors, which nothing resists
                bound = 1e-6 if case["output"] == "single" or turns else 1e-12 if case["task"] in STILL and case["support"] == "free" else 1e-9
                same_end(checks, f"{name}, three ranks", folder / "run.h5md", folder / "three.h5md", bound)


def continued(checks, name, case, folder, given):
    """Stopped half-way and continued: every bit of the end."""
    parts = dict(given, bs_output=folder / "parts.h5md", bs_checkpoint=folder / "parts.ck")
    first = Run(checks, folder, dict(parts, ts_max_steps=3))
    second = Run(checks, folder, dict(bs_restart=folder / "parts.ck", ts_max_steps=100000, bs_output=folder / "parts.h5md", bs_progress_interval=-1)) if first.code == 0 else first
    checks.true(f"{name}: stops and goes on", second.code == 0, second.errors.strip()[:900])
    if second.code == 0:
        same_end(checks, f"{name}, continued", folder / "run.h5md", folder / "parts.h5md", 0)


def refusals(checks):
    """What does not go together ends with exit code 2 and one line that names an option or a dataset, on one rank and on three."""
    plain = {name: values[0] for name, values in ABILITIES.items()}
    pairs = [pair for pair in itertools.combinations([(n, v) for n in ABILITIES for v in ABILITIES[n]], 2) if pair[0][0] != pair[1][0]]
    cases = [case for pair in pairs if is_refused(case := {**plain, "shape": "net", **dict(pair)}) and not has_no_sense(case)]

    def one(checks, item):
        number, case = item
        name = " ".join(value for key, value in case.items() if value != plain[key])
        with tempfile.TemporaryDirectory() as there:
            folder = pathlib.Path(there)
            lattice(folder / "lattice.h5", case, np.random.default_rng(number))
            run = Run(checks, folder, options(case, folder), ranks=1 if number % 8 else 3)
            lines = [line for line in run.errors.splitlines() if line.startswith("backspring: error:")]
            checks.true(f"refused: {name}", run.code == 2 and len(lines) == 1, f"exit {run.code}: {run.errors.strip()[:200]}")
    checks.each(list(enumerate(cases)), one)


def main():
    checks = Checks(__doc__)
    if checks.wants("crossings"):
        checks.each(list(enumerate(crossings())), check)
    if checks.wants("refusals"):
        refusals(checks)
    checks.finish()


if __name__ == "__main__":
    main()
