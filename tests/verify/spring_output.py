#!/usr/bin/env python3
"""-bs_output_springs: tensions, strains and stresses of every spring against their laws in NumPy, the balance of forces that they make, the same bits
on one rank and on three and of continued runs."""
import pathlib
import tempfile

from harness import Checks, write_lattice
import h5py
import numpy as np

LAWS = ("hooke", "strain", "tension", "polynomial", "plastic", "maxwell")
MOTION = {"ts_type": "verlet", "ts_dt": 0.005, "ts_max_time": 0.5, "bs_output_interval": 0.1}
NAMES = ("tension", "strain", "stress")


def net(path, periodic, n=5, halves=False):
    """A square lattice with diagonals, of all laws by turns or of one in each of its `halves`, some springs of rest length 0, one without any force."""
    rng = np.random.default_rng(11)
    x = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2) + 0.1 * rng.uniform(-1, 1, (n * n, 2))
    pairs, shift = [], []
    for i in range(n):
        for j in range(n):
            for a, b in ((1, 0), (0, 1), (1, 1)):
                if periodic or max(i + a, j + b) < n:
                    pairs.append((i * n + j, (i + a) % n * n + (j + b) % n))
                    shift.append(((i + a) // n, (j + b) // n))
    m = len(pairs)
    order = rng.permutation(m)
    pairs, shift = np.array(pairs)[order], np.array(shift)[order]
    columns = {"area": rng.uniform(1e-4, 2e-4, m), "stiffness_2": 3.0, "stiffness_3": 5.0, "yield_force": 0.5, "hardening": 2.0, "relaxation_time": 0.2}
    laws = np.array([LAWS[int(pairs[k, 0] >= n * n // 2)] if halves else LAWS[k % 6] for k in range(m)])
    stiffness, rest = rng.uniform(20, 40, m), rng.uniform(0.8, 1.4, m)
    laws[:3], rest[:2], stiffness[2] = "hooke", 0, 0
    box = {"box": n * np.eye(2), "shift": shift} if periodic else {}
    return write_lattice(path, x, rng.uniform(1, 2, n * n), velocity=rng.standard_normal(x.shape), pairs=pairs, stiffness=stiffness, rest_length=rest,
                         laws=laws, columns=columns, **box)


def run(checks, folder, name, options, ranks=None):
    """The file of a run with the fields, open."""
    done = checks.run({"bs_output": "s.h5md", "bs_output_springs": True, **options}, keep=("s.h5md",), **({"ranks": ranks} if ranks else {}))
    (folder / name).write_bytes(done.files["s.h5md"])
    return h5py.File(folder / name)


def expected(lattice, f, row):
    """Tensions and strains by the laws, with the histories that the frame has."""
    s = {name: value[...] for name, value in lattice["springs"].items()}
    names = [str(w) for w in lattice.attrs["spring_laws"]]
    laws = np.array([names[k] for k in s["law"]])
    x = f["particles/trajectory/position/value"][row]
    r = x[s["pairs"][:, 1]] - x[s["pairs"][:, 0]]
    if "shift" in s:
        r = r + s["shift"] @ lattice["box/edges"][...]
    l, k, L = np.linalg.norm(r, axis=1), s["stiffness"], s["rest_length"]
    q, (e, v) = l - L, (f[f"backspring/{name}/value"][row] if name in f["backspring"] else 0 * l for name in ("plastic_stretch", "viscous_stretch"))
    T = np.select([laws == name for name in LAWS],
                  [k * q, k * q / np.where(L > 0, L, 1), k * np.maximum(q, 0), k * q + s["stiffness_2"] * q**2 + s["stiffness_3"] * q**3, k * (q - e), k * (q - v)])
    T[L == 0] = (k * l)[L == 0]
    T[k == 0] = np.nan
    with np.errstate(divide="ignore", invalid="ignore"):
        return T, np.where((L > 0) & (k > 0), q / L, np.nan), r / l[:, None], laws


def fields(f):
    return [f[f"observables/springs/{name}/value"][...] for name in NAMES]


def off(found, exact):
    """Largest difference; infinite where one is NaN and the other not."""
    both = np.isnan(found) == np.isnan(exact)
    return np.nanmax(np.abs(found - exact)) if both.all() else np.inf


def laws(checks, folder):
    for label, shape in (("open net", {"periodic": False}), ("periodic net", {"periodic": True}), ("net of two halves", {"periodic": False, "n": 20, "halves": True})):
        path = net(folder / "net.h5", **shape)
        with h5py.File(path) as lattice, run(checks, folder, "one.h5md", {"bs_lattice_file": path, **MOTION}, ranks=1) as f:
            tension, strain, stress = fields(f)
            exact = [expected(lattice, f, row) for row in range(len(tension))]
            for law in LAWS[: 2 if "halves" in shape else None]:
                of = exact[0][3] == law
                checks.below(f"{label}: tensions of the law {law}", max(off(tension[row][of], exact[row][0][of]) for row in range(len(tension))), 1e-12)
            checks.below(f"{label}: strains", max(off(strain[row], exact[row][1]) for row in range(len(strain))), 1e-13)
            checks.true(f"{label}: stress is tension by cross-section", np.array_equal(stress, tension / lattice["springs/area"][...], equal_nan=True))
            if "halves" not in shape:
                checks.true(f"{label}: some spring has yielded, some relaxed, some cable is slack",
                            all(np.any(f[f"backspring/{name}/value"][-1] != 0) for name in ("plastic_stretch", "viscous_stretch")) and np.any(tension[-1][exact[-1][3] == "tension"] == 0))
            checks.true(f"{label}: the strain is written once", "strain" not in f["backspring"])
            checks.true(f"{label}: cross-sections are in the trajectory", np.array_equal(f["connectivity/bonds_area"][...], lattice["springs/area"][...]))
        for ranks in (2, 3):
            with h5py.File(folder / "one.h5md") as f, run(checks, folder, "more.h5md", {"bs_lattice_file": path, **MOTION}, ranks=ranks) as g:
                checks.true(f"{label}: {ranks} ranks have the bits of one", all(np.array_equal(a, b, equal_nan=True) for a, b in zip(fields(f), fields(g))))


def continued(checks, folder):
    """A run that is stopped and continued appends the frames of the undisturbed one; its file is a lattice that goes on with the cross-sections."""
    path = net(folder / "net.h5", False)
    options = {"bs_lattice_file": path, **MOTION, "bs_output": folder / "c.h5md", "bs_output_springs": True, "bs_checkpoint": folder / "c.chk"}
    checks.run({**options, "ts_max_time": 0.3})
    checks.run({**options, "bs_restart": folder / "c.chk"})
    with run(checks, folder, "whole.h5md", {"bs_lattice_file": path, **MOTION}) as f, h5py.File(folder / "c.h5md") as g:
        checks.true("a continued run is the undisturbed one", len(fields(f)[0]) == 6 and all(np.array_equal(a, b, equal_nan=True) for a, b in zip(fields(f), fields(g))))
    with run(checks, folder, "again.h5md", {"bs_lattice_file": folder / "c.h5md", **MOTION}) as f, h5py.File(path) as lattice:
        checks.true("a trajectory is a lattice with cross-sections", np.array_equal(f["connectivity/bonds_area"][...], lattice["springs/area"][...]))
        last = fields(f)[2][0]
        with h5py.File(folder / "c.h5md") as g:
            checks.below("it begins with the stresses that the other ended with", off(last, fields(g)[2][-1]) / np.nanmax(np.abs(last)), 1e-14)


def balance(checks, folder):
    """Statics of a hanging net: springs carry the weight of every free particle, and their sum at the supports is the reaction."""
    n, g = 4, 9.81
    x = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2).astype(float)
    pairs = np.array([(i, j) for i in range(n * n) for j in range(i) if np.linalg.norm(x[i] - x[j]) < 1.5])
    top = x[:, 1] == n - 1
    path = write_lattice(folder / "hang.h5", x, np.linspace(0.5, 1.5, n * n), fixed=top, pairs=pairs, stiffness=300.0, rest_length=1.0, damping=0.3)
    with h5py.File(path, "a") as f:
        f["groups/top"] = np.flatnonzero(top)
        mass = f["particles/mass"][...]
    options = {"bs_lattice_file": path, "bs_task": "statics", "bs_gravity": f"0,-{g}", "bs_motion_top": "fixed", "bs_load_steps": 2}
    with run(checks, folder, "hang.h5md", options) as f:
        for row in (-2, -1):
            y, T = f["particles/trajectory/position/value"][row], f["observables/springs/tension/value"][row]
            r = y[pairs[:, 1]] - y[pairs[:, 0]]
            pull = (T / np.linalg.norm(r, axis=1))[:, None] * r
            sums = np.zeros_like(y)
            np.add.at(sums, pairs[:, 0], pull)
            np.add.at(sums, pairs[:, 1], -pull)
            load = (0.5 if row == -2 else 1.0) * g * mass
            checks.below(f"statics, frame {row}: springs carry the weight", max(np.abs(sums[~top, 0]).max(), np.abs(sums[~top, 1] - load[~top]).max()), 1e-6)
            R = f["observables/reaction/top/value"][row]
            checks.near(f"statics, frame {row}: sum at the supports is the reaction", R - [0, load[top].sum()], -sums[top].sum(0), 1e-9)
        checks.true("without cross-sections there is no stress", "stress" not in f["observables/springs"])


def broken(checks, folder):
    """A chain that is pulled until its weak spring breaks: NaN from then on."""
    path = write_lattice(folder / "chain.h5", [[0.0], [1.0], [2.0]], 1.0, velocity=[[0], [0], [2.0]], fixed=[1, 0, 0], pairs=[[0, 1], [1, 2]], stiffness=10.0, rest_length=1.0,
                         columns={"critical_strain": [np.inf, 0.1]})
    with run(checks, folder, "chain.h5md", {"bs_lattice_file": path, **MOTION}) as f:
        flags, tension = f["backspring/broken/value"][...] != 0, f["observables/springs/tension/value"][...]
        checks.true("tensions are NaN where springs are broken, and there alone", np.array_equal(np.isnan(tension), flags) and flags.any() and not flags.all())


def main():
    checks = Checks("what springs carry")
    with tempfile.TemporaryDirectory() as scratch:
        for part in (laws, continued, balance, broken):
            part(checks, pathlib.Path(scratch))
    checks.finish()


if __name__ == "__main__":
    main()
