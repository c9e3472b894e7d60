#!/usr/bin/env python3
"""Equilibria beside SciPy, and how the iterations of the linear solver grow with the lattice. Writes statics.json and statics.md into this folder
(or -o FOLDER).

  statics.py --program build/release/backspring [--sizes 10,20,40] [--part net|cube] [-o FOLDER]

The net: 60 x 60 particles of a triangular lattice, a tenth of the bonds removed, its left and right columns held 5 % further apart than they were, the rest where it
was. SciPy: Newton's method with the exact tangent, sparse LU (SuperLU, by its default ordering and by the fastest found) and a search by the energy, on the same
net to the same tolerance. User times of the processes, less that of a run of three particles; reading and writing are the program's alone. The cube: the lattice of B1 (26 neighbours), two faces held 10 % further apart ("stretched"), or hung by one face under
a weight of 0.1 k a along each row of particles ("hung"); the residual is that of forces summed by NumPy at the positions written, over the 2-norm of the loads: the forces on the free
particles at the start. Memory is the largest resident set of the process; beside it that of two steps of backward Euler from the same start."""
import argparse
import contextlib
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "verify"))
import h5py
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as la
from harness import write_lattice
from program import environment
from scipy.spatial import cKDTree

TOLERANCE = 1e-10


def diluted_net(n=60, removed=0.1, pull=0.05):
    """Positions at the start, those held, pairs; rest lengths are 1."""
    i, j = (q.ravel() for q in np.meshgrid(np.arange(n), np.arange(n)))
    x = np.stack([i + 0.5 * (j % 2), np.sqrt(3) / 2 * j], 1)
    pairs = np.array(sorted(cKDTree(x).query_pairs(1.01)))
    pairs = pairs[np.random.default_rng(1).random(len(pairs)) >= removed]
    held = (i == 0) | (i == n - 1)
    x[i == n - 1, 0] += pull * (n - 1)
    return x, held, pairs


def cube(n, stretch=0.1):
    """B1's block: n^3 particles, springs to 26 neighbours; two faces held apart, or without stretch one held."""
    i = np.stack([q.ravel() for q in np.meshgrid(*3 * [np.arange(n)], indexing="ij")], 1).astype(float)
    pairs = []
    at = np.arange(n**3).reshape(n, n, n)
    for step in ((a, b, c) for a in (-1, 0, 1) for b in (-1, 0, 1) for c in (-1, 0, 1) if (a, b, c) > (0, 0, 0)):
        low = tuple(slice(max(0, -s), n - max(0, s)) for s in step)
        high = tuple(slice(max(0, s), n - max(0, -s)) for s in step)
        pairs.append(np.stack([at[low].ravel(), at[high].ravel()], 1))
    pairs = np.concatenate(pairs)
    rest = np.linalg.norm(i[pairs[:, 1]] - i[pairs[:, 0]], axis=1)
    held = (i[:, 0] == 0) | ((i[:, 0] == n - 1) & (stretch > 0))
    x = i.copy()
    x[i[:, 0] == n - 1, 0] += stretch * (n - 1)
    return x, held, pairs, rest


def size_of_forces(x, held, pairs, rest, weight):
    """2-norm of the forces on the free particles of unit springs."""
    f = np.zeros_like(x)
    f[:, 0] = weight
    for first in range(0, len(pairs), 1 << 20):
        part = pairs[first:first + (1 << 20)]
        u = x[part[:, 1]] - x[part[:, 0]]
        u *= (1 - rest[first:first + (1 << 20)] / np.linalg.norm(u, axis=1))[:, None]
        for c in range(3):
            f[:, c] += np.bincount(part[:, 0], u[:, c], len(x)) - np.bincount(part[:, 1], u[:, c], len(x))
    return float(np.linalg.norm(f[~held]))


class Scipy:
    """Newton's method on the free particles of a net of unit springs."""

    def __init__(self, x, held, pairs):
        self.x, self.pairs, self.free = x.copy(), pairs, np.flatnonzero(~np.repeat(held, 2))

    def forces(self, x):
        u = x[self.pairs[:, 1]] - x[self.pairs[:, 0]]
        length = np.linalg.norm(u, axis=1)
        pull = (1 - 1 / length)[:, None] * u
        f = np.zeros_like(x)
        np.add.at(f, self.pairs[:, 0], pull)
        np.add.at(f, self.pairs[:, 1], -pull)
        return f.ravel()[self.free], 0.5 * np.sum((length - 1)**2)

    def tangent(self, x):
        u = x[self.pairs[:, 1]] - x[self.pairs[:, 0]]
        length = np.linalg.norm(u, axis=1)
        u /= length[:, None]
        across = 1 - 1 / length
        B = across[:, None, None] * np.eye(2) + (1 - across)[:, None, None] * u[:, :, None] * u[:, None, :]
        rows, columns, values = [], [], []
        for a, b, sign in ((0, 0, 1), (1, 1, 1), (0, 1, -1), (1, 0, -1)):
            for r in range(2):
                for c in range(2):
                    rows.append(2 * self.pairs[:, a] + r)
                    columns.append(2 * self.pairs[:, b] + c)
                    values.append(sign * B[:, r, c])
        K = sp.csc_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=2 * (x.size,))
        return K[self.free][:, self.free].tocsc()

    def solve(self, **ordering):
        f, energy = self.forces(self.x)
        size, steps = np.linalg.norm(f), 0
        shift = 1e-10 * sp.identity(len(self.free), format="csc")
        while np.linalg.norm(f) > TOLERANCE * size and steps < 200:
            z = la.splu(self.tangent(self.x) + shift, **ordering).solve(f)
            slope, part = -f @ z, 1.0
            while True:
                y = self.x.ravel().copy()
                y[self.free] += part * z
                y = y.reshape(self.x.shape)
                g, there = self.forces(y)
                if there <= energy + 1e-4 * part * slope + 1e-14 * energy or part < 1e-8:
                    break
                part *= 0.5
            self.x, f, energy, steps = y, g, there, steps + 1
        return steps, float(np.linalg.norm(f) / size), energy


def solve(program, path, folder, *more):
    """(user time [s], report, positions at the end)"""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime, time.time()
    done = subprocess.run([program, "-bs_task", "statics", "-bs_lattice_file", path, "-snes_rtol", str(TOLERANCE), "-bs_output", "s.h5md", "-bs_overwrite",
                           "-bs_report", "s.json", *more], cwd=folder, env=environment(1), capture_output=True, text=True)
    used = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    if done.returncode:
        sys.exit(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    with h5py.File(folder / "s.h5md") as f:
        x = f["particles/trajectory/position/value"][-1]
    return used, time.time() - started, json.loads((folder / "s.json").read_text()), x


def user_time():
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime


def start_up(program, folder, clock=user_time):
    before = clock()
    subprocess.run([program, "-bs_lattice_type", "chain", "-bs_lattice_size", "3", "-ts_type", "symplectic", "-ts_max_steps", "1"], cwd=folder,
                   env=environment(1), capture_output=True, check=True)
    return clock() - before


ORDERINGS = {"default ordering": {}, "symmetric ordering": {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.01, "options": {"SymmetricMode": True}}}


def scipy_rows(folder):
    x, held, pairs = diluted_net()
    rows = []
    for label, ordering in ORDERINGS.items():
        other = Scipy(x, held, pairs)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        steps, left, energy = other.solve(**ordering)
        rows.append({"label": label, "user": resource.getrusage(resource.RUSAGE_SELF).ru_utime - before, "newton": steps, "left": left, "energy": energy})
    return rows


def net_row(program, folder, label, *more):
    x, held, pairs = diluted_net()
    path = write_lattice(folder / "net.h5", x, 1.0, fixed=held, pairs=pairs, stiffness=1.0, rest_length=1.0)
    used, _, report, y = solve(program, path, folder, *more)
    least = min(start_up(program, folder) for _ in range(5))
    return {"solver": label, "springs": len(pairs), "user": used - least, "start_up": least, "newton": report["newton"], "krylov": report["krylov"],
            "energy": report["last_elastic_energy"][0], "force": float(np.linalg.norm(Scipy(x, held, pairs).forces(y)[0]))}


def peak(command, folder):
    """(largest resident set [MB], seconds, user time [s]) of a process; the system's own figure of a child begins with that of this one, so the
    program's is asked for while it runs."""
    started, most = time.time(), 0
    process = subprocess.Popen(command, cwd=folder, env=environment(1), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    while os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
        with contextlib.suppress(OSError):
            status = pathlib.Path(f"/proc/{process.pid}/status").read_text()
            if os.readlink(f"/proc/{process.pid}/exe") == os.path.realpath(command[0]) and "VmHWM" in status:
                most = max(most, int(status.split("VmHWM:")[1].split()[0]) / 1024)
        time.sleep(0.005)
    said = process.stderr.read()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"exit code {process.returncode}: {said.strip()[-300:]}")
    return most, time.time() - started, used.ru_utime


def cube_row(program, folder, n, load):
    x, held, pairs, rest = cube(n, 0.1 if load == "stretched" else 0.0)
    weight = 0.1 / n if load == "hung" else 0.0
    path = write_lattice(folder / "cube.h5", x, 1.0, fixed=held, pairs=pairs, stiffness=1.0, rest_length=rest)
    common = [program, "-bs_lattice_file", str(path), "-bs_output_strain", "false", "-bs_gravity", f"{weight!r},0,0", "-bs_output", "s.h5md", "-bs_overwrite",
              "-bs_report", "s.json", "-bs_progress_interval", "-1"]
    memory, wall, used = peak([*common, "-bs_task", "statics", "-snes_rtol", str(TOLERANCE)], folder)
    report = json.loads((folder / "s.json").read_text())
    with h5py.File(folder / "s.h5md") as f:
        y = f["particles/trajectory/position/value"][-1]
    left = size_of_forces(y, held, pairs, rest, weight) / size_of_forces(x, held, pairs, rest, weight)
    moving, _, _ = peak([*common, "-ts_dt", "0.1", "-ts_max_time", "0.2", "-bs_output_interval", "0.2"], folder)
    return {"load": load, "n": n, "particles": n**3, "springs": len(pairs), "user": used, "wall": wall, "newton": report["newton"], "krylov": report["krylov"],
            "krylov_a_newton": report["krylov"] / max(1, report["newton"]), "residual": left, "memory": memory, "memory_of_dynamics": moving}


def document(found):
    lines = ["# Equilibria", "", "Measured by `tests/bench/statics.py`, which says what the cases are; relative tolerance 1e-10.", "",
             "## A net of 60 x 60 particles, a tenth of the bonds removed, pulled by 5 %", "",
             "| | user time [s] | of SciPy's by default | of SciPy's best | Newton | Krylov |", "|---|---|---|---|---|---|"]
    default, best = found["scipy"][0]["user"], min(r["user"] for r in found["scipy"])
    for r in found["net"]:
        lines.append(f"| {r['solver']} | {r['user']:.3f} | {r['user'] / default:.2f} | {r['user'] / best:.2f} | {r['newton']} | {r['krylov']} |")
    for r in found["scipy"]:
        lines.append(f"| SciPy, {r['label']} | {r['user']:.3f} | {r['user'] / default:.2f} | {r['user'] / best:.2f} | {r['newton']} | - |")
    for load, title in (("stretched", "B1's cube stretched by 10 %"), ("hung", "B1's cube hung by one face")):
        lines += ["", f"## {title}", "", "| n | springs | user time [s] | Newton | Krylov | Krylov a Newton iteration | residual | memory a particle [kB] | of dynamics |",
                  "|---|---|---|---|---|---|---|---|---|"]
        for r in (row for row in found["cube"] if row["load"] == load):
            lines.append(f"| {r['n']} | {r['springs']:,} | {r['user']:.1f} | {r['newton']} | {r['krylov']} | {r['krylov_a_newton']:.1f} | {r['residual']:.1e} | "
                         f"{r['memory'] * 1.048576e3 / r['particles']:.2f} | {r['memory'] / r['memory_of_dynamics']:.2f} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(HERE.parents[1] / "build" / "release" / "backspring"))
    parser.add_argument("--sizes", default="10,20,40")
    parser.add_argument("--part", choices=("net", "cube"), help="measures this alone and keeps what the files hold of the other")
    parser.add_argument("-o", type=pathlib.Path, default=HERE)
    arguments = parser.parse_args()
    found = json.loads((arguments.o / "statics.json").read_text()) if arguments.part else {}
    found.update({"net": [], "cube": []} if not arguments.part else {arguments.part: []})
    with tempfile.TemporaryDirectory() as scratch:
        folder, program = pathlib.Path(scratch), str(pathlib.Path(arguments.program).resolve())
        for label, more in () if arguments.part == "cube" else (("default", ()), ("direct", ("-condensed_ksp_type", "preonly", "-condensed_pc_type", "cholesky",
                                                         "-condensed_pc_factor_mat_solver_type", "mumps"))):
            found["net"].append(net_row(program, folder, label, *more))
            print(found["net"][-1], flush=True)
        if arguments.part != "cube":
            found["scipy"] = scipy_rows(folder)
            print(found["scipy"], flush=True)
        for load, n in () if arguments.part == "net" else [(load, int(n)) for load in ("stretched", "hung") for n in arguments.sizes.split(",")]:
            found["cube"].append(cube_row(program, folder, n, load))
            print(found["cube"][-1], flush=True)
    (arguments.o / "statics.json").write_text(json.dumps(found, indent=1) + "\n")
    (arguments.o / "statics.md").write_text(document(found))


if __name__ == "__main__":
    main()
