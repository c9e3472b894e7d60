#!/usr/bin/env python3
"""Frames of bars by convert.py, computed by the program, against closed forms and SciPy: /usr/bin/python3 tests/postprocess/test_frames.py --program build/release/backspring"""
import contextlib
import io
import pathlib
import sys

import h5py
import numpy as np
import scipy.linalg

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "postprocess"), str(HERE.parent / "verify")]
import convert  # noqa: E402
from backspring_io import open_run  # noqa: E402
from harness import run_parts  # noqa: E402

E, A, RHO = 210e9, 1e-3, 7850.0
BARS = ["--youngs", str(E), "--area", str(A), "--density", str(RHO)]


def converted(source, target, *more):
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        convert.main([str(source), "-o", str(target), *BARS, *more])
    return target


def rod(folder, count, *more):
    """A rod of 2 m along x in `count` pieces, its left end held."""
    x = np.linspace(0, 2, count + 1)
    path = folder / "rod.obj"
    path.write_text("".join(f"v {v:.17g} 0 0\n" for v in x) + "l " + " ".join(str(k + 1) for k in range(count + 1)) + "\n")
    return converted(path, folder / "rod.h5", "--dim", "1", "--fixed", "near:0", *more)


def stretched(checks, folder):
    """Its own weight stretches a rod by rho g L^2/(2 E), whatever the number of pieces; so do K = E A and k = E A/L."""
    for law in ("hooke", "strain"):
        out = folder / f"{law}.h5md"
        checks.run({"bs_lattice_file": rod(folder, 7, "--spring_law", law), "bs_task": "statics", "bs_gravity": "9.81", "bs_output": out})
        with h5py.File(out) as f:
            x = f["particles/trajectory/position/value"][...]
        with open_run(out) as run:
            checks.near(f"{law}: tensions are the weight below", run.tensions(-1), RHO * A * 9.81 * (2 - (np.arange(7) + 0.5) * 2 / 7), 1e-6 * RHO * A * 9.81)
        checks.near(f"{law}: a rod under its own weight", x[-1].max() - 2, RHO * 9.81 * 4 / (2 * E), 1e-6 * RHO * 9.81 * 4 / (2 * E))


def vibrating(checks, folder):
    """omega_j = 2 c/h sin((2 j - 1) pi/(4 n)) of n pieces of h = L/n, c = sqrt(E/rho): the first tends to pi c/(2 L)."""
    n, c = 40, np.sqrt(E / RHO)
    out = folder / "rod.h5md"
    checks.run({"bs_lattice_file": rod(folder, n), "bs_task": "modes", "bs_modes": 5, "bs_output": out})
    with h5py.File(out) as f:
        omega = np.sqrt(f["modes/omega_squared"][...])
    exact = 2 * c * n / 2 * np.sin((2 * np.arange(1, 6) - 1) * np.pi / (4 * n))
    checks.near("a rod held at one end: frequencies", omega / exact, np.ones(5), 1e-9)
    checks.near("the first is that of the continuous rod", omega[0], np.pi * c / 4, 1e-3 * omega[0])


def stepped(checks, folder):
    """Two rods in a row of different section and material, drawn by a force: u = F (L_1/(E_1 A_1) + L_2/(E_2 A_2)), stresses F/A."""
    mesh = folder / "stepped.msh"
    mesh.write_text('$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n1 1 "thick"\n1 2 "thin"\n$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 2.5 0 0\n4 3 0 0\n$EndNodes\n'
                    "$Elements\n3\n1 1 2 1 1 1 2\n2 1 2 2 2 2 3\n3 1 2 2 3 3 4\n$EndElements\n")
    lattice, out, force = folder / "stepped.h5", folder / "stepped.h5md", 300.0
    with contextlib.redirect_stdout(io.StringIO()):
        convert.main([str(mesh), "-o", str(lattice), "--youngs", "thick=70e9,thin=210e9", "--area", "thick=1e-3,thin=1e-4", "--mass", "1", "--dim", "1", "--fixed", "xmin"])
    checks.run({"bs_lattice_file": lattice, "bs_task": "statics", "bs_group_end": "xmax", "bs_force_end": f"{force}", "bs_output": out, "bs_output_springs": ""})
    with h5py.File(out) as f:
        x, stress = f["particles/trajectory/position/value"][-1, :, 0], f["observables/springs/stress/value"][-1]
    u = force * (1 / 70e6 + 2 / 21e6)
    checks.near("two rods in a row", x[3] - 3, u, 1e-6 * u)
    checks.near("their stresses", stress, [force / 1e-3, force / 1e-4, force / 1e-4], 1e-6 * force / 1e-4)


def truss(checks, folder):
    """A truss by Gmsh, held at its physical group: K assembled here bar by bar, frequencies by SciPy; K d = m g for its sag, which is small."""
    path = converted(HERE / "gmsh" / "truss.msh", folder / "truss.h5", "--fixed", "supports")
    with h5py.File(path) as f:
        x, pairs, held = f["particles/position"][...], f["springs/pairs"][...], f["groups/supports"][...]
        load = int(f["groups/load"][0])
    stiffness, mass = np.zeros((18, 18)), np.zeros(18)
    for a, b in pairs:
        r = x[b] - x[a]
        length = np.linalg.norm(r)
        block = E * A / length * np.outer(r, r) / length ** 2
        at = [2 * a, 2 * a + 1, 2 * b, 2 * b + 1]
        stiffness[np.ix_(at, at)] += np.block([[block, -block], [-block, block]])
        mass[at] += RHO * A * length / 2
    free = np.setdiff1d(np.arange(18), np.concatenate([2 * held, 2 * held + 1]))
    kept = stiffness[np.ix_(free, free)]
    squared = scipy.linalg.eigh(kept, np.diag(mass[free]), eigvals_only=True)
    checks.run({"bs_lattice_file": path, "bs_task": "modes", "bs_modes": 6, "bs_output": folder / "m.h5md"})
    with h5py.File(folder / "m.h5md") as f:
        checks.near("a truss: frequencies as by SciPy", np.sqrt(f["modes/omega_squared"][...] / squared[:6]), np.ones(6), 1e-9)
    sag = np.linalg.solve(kept, (mass * np.tile([0.0, -9.81], 9))[free])[np.flatnonzero(free == 2 * load + 1)[0]]
    checks.run({"bs_lattice_file": path, "bs_task": "statics", "bs_gravity": "0,-9.81", "bs_output": folder / "s.h5md"})
    with h5py.File(folder / "s.h5md") as f:
        moved = f["particles/trajectory/position/value"][-1, load, 1]
    checks.near("its sag in the middle", moved, sag, 1e-3 * abs(sag))


if __name__ == "__main__":
    run_parts("frames of bars", (stretched, vibrating, stepped, truss))
