#!/usr/bin/env python3
"""-bs_compliance_groups: what structures yield to unit loads on groups, against closed forms of chains and of a truss, and against the matrices that
-bs_write_matrices gives, solved by NumPy and SciPy; what nothing holds is refused."""
import io

import h5py
import numpy as np
import scipy.sparse.linalg as la
from harness import run_parts, write_lattice
from scipy.io import mmread

STATICS = {"bs_task": "statics", "bs_overwrite": True}


def grouped(path, **groups):
    with h5py.File(path, "r+") as f:
        for name, rows in groups.items():
            f[f"groups/{name}"] = np.asarray(rows)
    return path


def compliance(checks, path, names, keep=(), **more):
    """The matrix of the report, which must be that of the trajectory, and the run."""
    run = checks.run({**STATICS, "bs_lattice_file": path, "bs_compliance_groups": names, "bs_output": "c.h5md", **more}, keep=("c.h5md", *keep))
    said = run.report["compliance"]
    C = np.array(said["matrix"])
    C = C.reshape(2 * (int(np.sqrt(len(C))),))
    with h5py.File(io.BytesIO(run.files["c.h5md"])) as f:
        checks.true("trajectory and report agree", np.array_equal(f["compliance/matrix"][...], C))
        checks.true("groups are named", f["compliance/matrix"].attrs["groups"].decode() == ",".join(names) == ",".join(said["groups"]), str(names))
    return C, run


def of_matrices(run, moves, members, d):
    """The same from K: columns -K^-1 f, f a unit load spread over a group. moves: (N, d)."""
    K = mmread(io.BytesIO(run.files["m_K.mtx"])).tocsc()
    place = np.flatnonzero(moves.ravel())
    loads = np.zeros((moves.size, len(members) * d))
    for g, rows in enumerate(members):
        for c in range(d):
            loads[np.asarray(rows) * d + c, g * d + c] = 1 / len(rows)
    u = np.zeros_like(loads)
    u[place] = la.splu(-K).solve(loads[place])
    return loads.T @ u


def chains(checks, folder):
    """Springs in series: C_ij = sum of 1/k up to the nearer end, and its means over groups."""
    n, rng = 12, np.random.default_rng(2)
    k = rng.uniform(0.5, 5, n)
    at = np.arange(n + 1)
    path = write_lattice(folder / "chain.h5", at[:, None] * 1.0, 2.0, fixed=at == 0, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k, rest_length=1.0)
    members = {"tip": [n], "some": [2, 5, 9], "wall": [0], "half": [0, 6]}
    grouped(path, **members)
    single = np.array([[np.sum(1 / k[:min(i, j)]) for j in at] for i in at])
    exact = np.array([[single[np.ix_(a, b)].mean() for b in members.values()] for a in members.values()])
    C, _ = compliance(checks, path, tuple(members))
    checks.near("chain: sums of 1/k", C, exact, 1e-13)
    checks.near("the tip of the chain, hung", compliance(checks, path, ("tip",), bs_gravity=9.81)[0], exact[:1, :1], 1e-13)


def truss(checks, folder):
    """Two bars that bear the load P(h) = 2 h (L/l - 1) at the height h of their apex: C = -dh/dP up and down, also where P falls and the
    equilibrium is unstable."""
    L = np.hypot(1, 0.3)
    path = grouped(write_lattice(folder / "truss.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0), apex=[2])
    for name, more in (("stable", {"bs_gravity": "0,-0.009", "bs_load_steps": 5}),
                       ("unstable", {"bs_gravity": "0,-0.02", "bs_load_control": "arc", "bs_load_steps": 20, "bs_arc_end": -0.3})):
        C, run = compliance(checks, path, ("apex",), **more)
        with h5py.File(io.BytesIO(run.files["c.h5md"])) as f:
            h = f["particles/trajectory/position/value"][-1, 2, 1]
        l = np.hypot(1, h)
        up, across = -2 * (L / l - 1 - L * h**2 / l**3), 2 * (1 - L / l + L / l**3)
        checks.near(f"truss, {name}: along y", C[1, 1] * up, 1, 1e-9)
        checks.near(f"truss, {name}: along x", C[0, 0] * across, 1, 1e-9)
        checks.true(f"truss, {name}: sign", (C[1, 1] < 0) == (name == "unstable"), f"{C[1, 1]:.6g}")


def net(checks, folder):
    """A loaded net in space with fixed particles, rollers and anchors: K by NumPy, reciprocity, ranks."""
    rng, n = np.random.default_rng(4), 40
    x = rng.uniform(0, 2, (n, 3))
    pairs = np.array([(i, j) for i in range(n) for j in range(i + 1, n) if np.linalg.norm(x[i] - x[j]) < 1.2])
    length = np.linalg.norm(x[pairs[:, 0]] - x[pairs[:, 1]], axis=1)
    fixed = np.arange(n) < 4
    anchors = {"particle": [7, 8], "point": x[[7, 8]], "stiffness": [3.0, 4.0], "rest_length": [0.0, 0.0], "damping": [0.0, 0.0]}
    members = {"few": [10, 11, 12], "mixed": [2, 3, 20, 21, 22], "one": [39], "rolls": [30, 31]}
    path = grouped(write_lattice(folder / "net.h5", x, rng.uniform(0.5, 2, n), fixed=fixed, pairs=pairs, stiffness=rng.uniform(20, 80, len(pairs)),
                                 rest_length=0.97 * length, anchors=anchors), **members)
    more = {"bs_gravity": "0,0,-1", "bs_motion_rolls": "y=fixed", "bs_write_matrices": "m"}
    moves = np.repeat(~fixed[:, None], 3, 1)
    moves[members["rolls"], 1] = False
    found = {}
    for ranks in (1, 3):
        C, run = compliance(checks, path, tuple(members), keep=("m_K.mtx",), **more) if ranks == checks.ranks else \
            of_ranks(checks, ranks, path, members, more)
        found[ranks] = C
        checks.near(f"net, {ranks} ranks: K by SciPy", C, of_matrices(run, moves, list(members.values()), 3), 1e-12 * np.abs(C).max())
        checks.near(f"net, {ranks} ranks: reciprocity", C, C.T, 1e-12 * np.abs(C).max())
    checks.near("net: ranks agree", found[1], found[3], 1e-12 * np.abs(found[1]).max())
    checks.near("net: nothing along the rollers' axis", np.abs(found[1][10]).max(), 0, 0)


def of_ranks(checks, ranks, path, members, more):
    keep, checks.ranks = checks.ranks, ranks
    try:
        return compliance(checks, path, tuple(members), keep=("m_K.mtx",), **more)
    finally:
        checks.ranks = keep


def block(checks, folder):
    """An iterative solver with a matrix in single precision and without coarse grid's help: a cube held at one face."""
    size, corner = 8, [8**3 - 1]
    more = {**STATICS, "bs_lattice_type": "cubic", "bs_lattice_size": size, "bs_lattice_neighbors": 26, "bs_lattice_stiffness": 30.0, "bs_lattice_fixed": "xmin",
            "bs_group_end": "xmax", "bs_group_corner": f"ids:{corner[0]}", "bs_compliance_groups": "end,corner", "bs_write_matrices": "m",
            "condensed_ksp_type": "cg", "condensed_pc_type": "bicc"}
    run = checks.run(more, interval=1, keep=("m_K.mtx",))
    C = np.array(run.report["compliance"]["matrix"]).reshape(6, 6)
    x = run.trajectory.position[0]
    end = np.flatnonzero(x[:, 0] == x[:, 0].max())
    moves = np.repeat((x[:, 0] > x[:, 0].min())[:, None], 3, 1)
    checks.near("cube by conjugate gradients: K by SciPy", C, of_matrices(run, moves, [end, corner], 3), 1e-10 * np.abs(C).max())


def loose(checks, folder):
    """Free bodies are refused before the run, other motions without resistance at its end, by one line."""
    at = np.arange(4)
    pairs = np.stack([at[:-1], at[1:]], 1)
    x = np.stack([at * 1.0, 0 * at], 1)
    for fixed, code, line in ((None, 2, "bodies that are tied to nothing (1 of them)"), ([1, 0, 0, 0], 3, "no displacement bears a load on the group tip along y")):
        path = grouped(write_lattice(folder / "loose.h5", x, 1.0, fixed=fixed, pairs=pairs, stiffness=1.0, rest_length=1.0), tip=[3])
        run = checks.run({**STATICS, "bs_lattice_file": path, "bs_compliance_groups": "tip"}, expect=code)
        checks.true(f"{'free' if code == 2 else 'loose hinges'}: refused", line in run.stderr and run.stderr.count("backspring: ") == 1, run.stderr.strip()[-300:])
    frame = write_lattice(folder / "frame.h5", [[0, 0], [1, 0], [0, 1], [1, 1]], 1.0, fixed=[1, 0, 0, 0], pairs=[[0, 1], [0, 2], [1, 3], [2, 3], [0, 3], [1, 2]],
                          stiffness=1.0)
    run = checks.run({**STATICS, "bs_lattice_file": grouped(frame, far=[3]), "bs_compliance_groups": "far"}, expect=3)
    checks.true("a frame that turns about one pin: refused", "no displacement bears a load on the group far along" in run.stderr, run.stderr.strip()[-300:])
    checks.true("the report says so", run.report["outcome"] == "failed" and "compliance" not in run.report)


def continued(checks, folder):
    """A run stopped half way has no numbers yet; continued, it has those of the whole."""
    path = grouped(write_lattice(folder / "again.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0), apex=[2])
    base = {"bs_gravity": "0,-0.009", "bs_load_steps": 4}
    whole, _ = compliance(checks, path, ("apex",), **base)
    trajectory, saved = folder / "again.h5md", folder / "again.checkpoint"
    checks.run({**STATICS, "bs_lattice_file": path, "bs_compliance_groups": "apex", **base, "bs_output": trajectory, "bs_checkpoint": saved, "ts_max_steps": 2})
    with h5py.File(trajectory) as f:
        half = f["compliance/matrix"][...]
    run = checks.run({"bs_restart": saved, "ts_max_steps": 100, "bs_overwrite": True})
    with h5py.File(trajectory) as f:
        checks.true("continued: the values of the whole run", np.array_equal(f["compliance/matrix"][...], whole) and not np.array_equal(half, whole))
        checks.true("continued: groups", f["compliance/matrix"].attrs["groups"].decode() == "apex")
    checks.near("continued: report", np.array(run.report["compliance"]["matrix"]).reshape(2, 2), whole, 0)


if __name__ == "__main__":
    run_parts("compliance to unit loads on groups", (chains, truss, net, block, loose, continued))
