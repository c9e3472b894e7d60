#!/usr/bin/env python3
"""plot.py's panels of vibrations and networks against closed forms: /usr/bin/python3 tests/postprocess/test_networks.py --program build/release/backspring"""
import contextlib
import csv
import io
import json
import pathlib
import subprocess
import sys

import h5py
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT / "postprocess"), str(HERE.parent / "verify")]  # both have a module modes
import convert  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import plot  # noqa: E402
import figures_modes as panels  # noqa: E402
import figures_networks as networks  # noqa: E402
import study_average  # noqa: E402
from backspring_io import open_run  # noqa: E402
from harness import run_parts, write_lattice  # noqa: E402
from test_load_paths import curve, drawn  # noqa: E402


def triangular(size):
    """omega of all modes but the translations of a periodic triangular lattice of size x size particles: masses 1, springs 1 of length 1."""
    bonds = np.array([[1, 0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])
    m = np.arange(size)
    a, b = (v.ravel() / size for v in np.meshgrid(m, m))  # the box is a rectangle
    phases = 2 * np.pi * np.stack([a, b + a / 2, b - a / 2], axis=1)  # k.r of the three bonds
    dynamical = np.einsum("kb,bi,bj->kij", 2 - 2 * np.cos(phases), bonds, bonds)
    squared = np.sort(np.linalg.eigvalsh(dynamical).ravel())
    return np.sqrt(squared[2:])


def written(path, omega, dim, count, shape=None, mass=1.0):
    """A file with these modes of `count` particles."""
    with h5py.File(path, "w") as f:
        group = f.create_group("particles/trajectory")
        group["position/value"], group["position/time"], group["position/step"] = np.zeros((1, count, dim)), np.zeros(1), np.zeros(1, int)
        group["mass"] = np.broadcast_to(mass, count)
        group.create_group("box").attrs["dimension"] = dim
        f["modes/omega_squared"] = np.asarray(omega, float) ** 2
        if shape is not None:
            f["modes/shape"] = shape
    return path


def vibrations(checks, folder):
    """Debye's law, the closed form of the triangular lattice, and its own modes by the program."""
    size = 12
    net = {"bs_lattice_type": "triangular", "bs_lattice_size": f"{size},{size}", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1,
           "bs_lattice_spacing": 1, "bs_lattice_particle_mass": 1}
    path = folder / "modes.h5md"
    checks.run({"bs_task": "modes", "bs_modes": 2 * size * size - 2, "bs_output": path, **net})
    with open_run(path) as run:
        checks.near("the frequencies of a periodic triangular lattice", panels.frequencies(run)[0], triangular(size), 1e-9)
        edges = np.linspace(0, 3, 31)
        total = (panels.density(panels.frequencies(run)[0], edges, panels.motions_of(run)) * np.diff(edges)).sum()
        checks.near("D is 1 in sum, less the translations", total, 1 - 1 / size ** 2, 1e-12)
    large = 300
    big = written(folder / "big.h5md", triangular(large), 2, large * large)
    x, y = curve(drawn(big, kind="debye")[0])
    low = (x > 0.1) & (x < 0.4)
    checks.near("D/omega at low frequencies: a_c/(4 pi) (1/c_L^2 + 1/c_T^2)", y[low].mean(), np.sqrt(0.75) / (4 * np.pi) * (8 / 9 + 8 / 3), 0.01)
    exponent = np.polyfit(np.log(x[low]), np.log(y[low] * x[low]), 1)[0]
    checks.near("Debye's exponent d - 1", exponent, 1, 0.08)
    cubic = 2 * np.cbrt((np.arange(9000) + 0.5) / 9000)  # 3 omega^2/2^3 of 9000 modes, a third of all motions
    x, y = curve(drawn(written(folder / "cubic.h5md", cubic, 3, 9000), kind="debye")[0])
    checks.near("in three dimensions over omega^2", 8 * y[x > 0.5], 1, 0.05)


def participations(checks, folder):
    """Standing waves of a periodic chain have 2/3; motions alike 1, whatever the masses; one particle alone 1/N."""
    path = folder / "chain.h5md"
    checks.run({"bs_task": "modes", "bs_modes": 24, "bs_lattice_type": "chain", "bs_lattice_size": 25, "bs_lattice_periodic": "x", "bs_lattice_dim": 1,
                "bs_lattice_stiffness": 3, "bs_lattice_particle_mass": 0.5, "bs_output": path})
    curves, _, _ = drawn(path, kind="participation")
    x, y = max(curves.values(), key=lambda line: line.shape[1])
    checks.near("standing waves", y, 2 / 3, 1e-9)
    checks.near("over their frequencies", x, np.sort([2 * np.sqrt(6) * abs(np.sin(np.pi * k / 25)) for k in range(1, 25)]), 1e-9)
    mass = np.array([1.0, 2, 3, 4])
    shape = np.zeros((3, 4, 2))
    shape[0, :, 0], shape[1, 2, 1] = 1 / np.sqrt(mass), 1
    shape[2, :, 0], shape[2, :, 1] = np.cos(np.arange(4) * np.pi / 2) / np.sqrt(mass), np.sin(np.arange(4) * np.pi / 2) / np.sqrt(mass)
    with open_run(written(folder / "made.h5md", [1, 2, 3], 2, 4, shape, mass)) as run:
        checks.near("all alike, one alone, a travelling wave", panels.participation_ratios(run, [0, 1, 2]), [1, 0.25, 1], 1e-14)


def helix(count=40):
    turn = 100 * np.pi / 180 * np.arange(count)
    x = np.stack([2.3 * np.cos(turn), 2.3 * np.sin(turn), 1.5 * np.arange(count)], axis=1)
    b = 10 + 5 * np.cos(np.arange(count))
    return "".join(f"ATOM  {k + 1:5d}  CA  ALA A{k + 11:4d}    {p[0]:8.3f}{p[1]:8.3f}{p[2]:8.3f}  1.00{v:6.2f}           C\n" for k, (p, v) in enumerate(zip(x, b)))


def fluctuations(x, cutoff):
    """8 pi^2/3 times the traces of the blocks of the pseudo-inverse of the Hessian of springs of stiffness 1 within the cutoff."""
    n = len(x)
    hessian = np.zeros((n, 3, n, 3))
    for i in range(n):
        for j in range(i):
            r = x[i] - x[j]
            if r @ r <= cutoff ** 2:
                block = np.outer(r, r) / (r @ r)
                hessian[i, :, j] -= block
                hessian[j, :, i] -= block
                hessian[i, :, i] += block
                hessian[j, :, j] += block
    inverse = np.linalg.pinv(hessian.reshape(3 * n, 3 * n), rcond=1e-10, hermitian=True).reshape(n, 3, n, 3)
    return 8 * np.pi ** 2 / 3 * np.einsum("iaia->i", inverse)


def bfactors(checks, folder):
    """B-factors of elastic networks against the pseudo-inverse, fitted by least squares of numpy's own."""
    made = folder / "helix.pdb"
    made.write_text(helix())
    given = checks.arguments.oracles.parent / "data" / "pdb1ubi_ca.pdb"
    for pdb, first in ((made, "11"), (given, "1")):
        if not pdb.is_file():
            print(f"  {pdb}: not here, left out")
            continue
        net, path = folder / f"{pdb.stem}.h5", folder / f"{pdb.stem}.h5md"
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            convert.main([str(pdb), "-o", str(net), "--cutoff", "15", "--stiffness", "1"])
        lines = [line for line in pdb.read_text().splitlines() if line.startswith("ATOM") and line[12:16] == " CA "]
        x = np.array([[float(line[c:c + 8]) for c in (30, 38, 46)] for line in lines])
        b = np.array([float(line[60:66]) for line in lines])
        checks.run({"bs_lattice_file": net, "bs_task": "modes", "bs_modes": 3 * len(x) - 6, "bs_output": path})
        curves, labels, _ = drawn(path, "--pdb", str(pdb), kind="bfactor")
        exact = fluctuations(x, 15)
        slope, offset = np.polyfit(exact, b, 1)
        slope, offset = (slope, offset) if offset >= 0 else ((exact @ b) / (exact @ exact), 0.0)
        words = next(name for name in curves if name.startswith("modes"))
        checks.near(f"{pdb.stem}: B-factors by least squares", curves[words][1], offset + slope * exact, 1e-6)
        checks.near(f"{pdb.stem}: those of the file", curves[pdb.name][1], b, 1e-12)
        checks.true(f"{pdb.stem}: kT and correlation are said", f"$kT$ = {slope:.3g}, r = {np.corrcoef(exact, b)[0, 1]:.3f}" in words, words)
        checks.true(f"{pdb.stem}: labels", labels[0] == "residue", str(labels))
        from protein import read_pdb
        checks.true(f"{pdb.stem}: residues as in the file", read_pdb(pdb).residue[0] == first)


def avalanches(checks, folder):
    """Sizes of avalanches in bins 1, 2, 3-4, 5-8, ...; and of a chain whose weakest spring breaks."""
    checks.true("bins", networks.log_bins(20).tolist() == [1, 2, 3, 5, 9, 17, 33], str(networks.log_bins(20)))
    sizes, share = networks.distribution(np.array([1, 1, 1, 2, 3, 4, 4, 20]))
    checks.near("sizes", sizes, [1, 2, np.sqrt(12), np.sqrt(17 * 32)], 1e-14)
    checks.near("shares", share, np.array([3, 1, 3 / 2, 1 / 16]) / 8, 1e-14)
    path = folder / "broken.h5md"
    checks.run({"bs_task": "statics", "bs_lattice_type": "triangular", "bs_lattice_size": "8,6", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1, "bs_group_lower": "ymin",
                "bs_group_upper": "ymax", "bs_motion_lower": "fixed", "bs_motion_upper": "x=fixed,y=velocity:1", "bs_load_steps": 20, "bs_break_strain": 0.05,
                "bs_break_uniform": "0.5,3", "bs_output": path})
    curves, _, _ = drawn(path, kind="avalanches")
    words = next(iter(curves))
    with h5py.File(path) as f:
        numbers = f["events/broken/avalanche"][...]
    checks.true("avalanches of a plate", words == f"{len(set(numbers))} avalanches, {len(numbers)} springs", words)


def affine(checks, folder):
    """A periodic chain of springs k_1, k_2 in turn, strained by eps: every other particle lags behind the affine displacement by a eps (k_2 - k_1)/(k_1 + k_2)."""
    n, a, soft, stiff = 6, 0.5, 1.0, 4.0
    at = np.arange(n)
    net = write_lattice(folder / "chain.h5", a * at[:, None], 1.0, pairs=np.stack([at, (at + 1) % n], 1), stiffness=np.where(at % 2, stiff, soft), rest_length=a,
                        box=[[n * a]], shift=(at == n - 1).astype(int)[:, None])
    path = folder / "chain.h5md"
    checks.run({"bs_lattice_file": net, "bs_task": "statics", "bs_box_strain": "xx=velocity:0.1", "bs_load_steps": 5, "bs_output": path})
    x, y = curve(drawn(path, kind="nonaffine")[0])
    checks.near("non-affine displacements", y, 0.5 * a * x * (stiff - soft) / (stiff + soft), 1e-9)
    checks.near("over the strain", x, 0.02 * np.arange(6), 1e-12)
    path = folder / "net.h5md"
    checks.run({"bs_task": "statics", "bs_lattice_type": "triangular", "bs_lattice_size": "8,8", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1,
                "bs_lattice_stiff_fraction": 0.3, "bs_lattice_stiff_factor": 0.1, "bs_box_strain": "xy=velocity:0.04", "bs_load_steps": 2, "bs_output": path})
    figure, ax = plt.subplots()
    with open_run(path) as run, h5py.File(path) as f:
        networks.nonaffine_field(ax, [run], [""], plot.parse([str(path), "-o", "none.png", "--frame=1"]))
        x = f["particles/trajectory/position/value"][...]
    u = x[1] - x[0] - 0.02 * x[0][:, 1:] * [[1, 0]]
    arrows = next(c for c in ax.collections if hasattr(c, "U"))
    checks.near("arrows", np.stack([arrows.U, arrows.V], axis=1), u - u.mean(axis=0), 1e-12)
    checks.true("some are long", np.abs(u - u.mean(axis=0)).max() > 1e-3)
    checks.true("titled", ax.get_title(loc="left").startswith("load factor 0.5, arrows ×"), ax.get_title(loc="left"))
    plt.close(figure)


def dilution(checks, folder):
    """The shipped study on fewer nets: means and errors are those of the reports; sqrt(3)/4 k of the whole net, and close to the effective medium's with a tenth removed."""
    command = [sys.executable, str(ROOT / "postprocess/sweep.py"), str(ROOT / "options/studies/dilution.yaml"), "--program", str(checks.program), "-o"]
    study = folder / "study"
    small = (ROOT / "options/studies/dilution.yaml").read_text().replace("[0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4]", "[0, 0.1]").replace("8]", "8, 9, 10]")
    (folder / "small.yaml").write_text(small)
    command[2] = str(folder / "small.yaml")
    done = subprocess.run(command + [str(study)], capture_output=True, text=True, timeout=280)
    checks.true("the study runs", done.returncode == 0, done.stderr[-200:])
    means = {(r["column"], float(r["1-bs_lattice_remove_fraction"])): r for r in csv.DictReader((study / "averages.csv").open())}
    whole, diluted = (means["shear_modulus", p] for p in (1.0, 0.9))
    checks.near("shear modulus of the whole net", float(whole["mean"]), np.sqrt(3) / 4, 1e-9)
    checks.near("bulk modulus of the whole net", float(means["bulk_modulus", 1.0]["mean"]), np.sqrt(3) / 2, 1e-9)
    stiffness = [np.array(json.loads(path.read_text())["stiffness"]) for path in study.glob("*fraction-0.1_*/report.json")]
    shears = np.array([(c[0, 0] + c[1, 1] - 2 * c[0, 1]) / 8 + c[2, 2] / 2 for c in stiffness])
    checks.near("the mean over ten nets", [float(diluted[k]) for k in ("mean", "standard_error", "runs")], [shears.mean(), shears.std(ddof=1) / np.sqrt(10), 10], 1e-12)
    checks.near("close to 3 p - 2 of the whole net's", float(diluted["mean"]) / (np.sqrt(3) / 4), 0.7, 0.04)
    checks.true("a picture of each", all((study / f"{name}_modulus.png").stat().st_size > 5000 for name in ("shear", "bulk")))
    for more, says in ((["--show", "nothing"], "no such column"), (["--average", "bs_break"], "no varied option")):
        said = subprocess.run(command + [str(study), *more], capture_output=True, text=True, timeout=280)
        checks.true(f"{' '.join(more)} is refused", said.returncode == 2 and says in said.stderr, said.stderr[-200:])
    lame, shear = 2.0, 0.7
    c = np.zeros((6, 6))
    c[:3, :3], c[range(3), range(3)], c[range(3, 6), range(3, 6)] = lame, lame + 2 * shear, shear
    checks.near("moduli of an isotropic body", study_average.isotropic_moduli(c), [lame + 2 * shear / 3, shear], 1e-14)


if __name__ == "__main__":
    run_parts("networks", (vibrations, participations, bfactors, avalanches, affine, dilution))
