#!/usr/bin/env python3
"""The condensed solve against the full Jacobian factored: every TS type, storage and preconditioner, indefinite systems."""
import pathlib
import subprocess
import tempfile

import h5py
from harness import Checks
from jacobian import cloud
import numpy as np
from program import environment, knows, run, words

REFERENCE = {"pc_type": "lu", "ksp_type": "preonly", "pc_factor_mat_solver_type": "mumps", "bs_operator": "assembled"}
OPTIONS = pathlib.Path(__file__).resolve().parents[2] / "options" / "problems"
TIGHT = {"snes_rtol": 1e-11}

# 300 particles: small enough to factor, large enough for several aggregates and a rank boundary
BLOCK = dict(bs_lattice_type="cubic", bs_lattice_size="6,7,8", bs_lattice_neighbors=18, bs_lattice_spacing=0.1,
             bs_lattice_total_mass=20, bs_lattice_fixed="zmin", bs_lattice_stiffness=400, bs_spring_law="strain",
             bs_lattice_velocity_gradient="0,0,1,0,0,0,0,0,0", bs_gravity="0,0,-9.81")
CLOTH = dict(bs_lattice_type="cloth", bs_lattice_size="14,12", bs_lattice_dim=3, bs_lattice_spacing=0.05,
             bs_lattice_particle_mass=0.01, bs_lattice_stiffness="300,100,30", bs_lattice_damping="0.3,0.2,0.1",
             bs_lattice_fixed_particles="0,13", bs_gravity="0,0,-9.81", bs_stokes_drag=0.01)
ITERATIVE = {"condensed_ksp_type": "cg", "condensed_pc_type": "bicc"}


def last(checks, options, ranks=None):
    result = run(checks.program, {**TIGHT, **options}, interval=options["ts_max_time"], ranks=ranks or checks.ranks)
    return result.trajectory.position[-1], result


def compare(checks, name, base, options, tolerance, ranks=None, reference=None):
    expected = last(checks, dict(base, **(REFERENCE if reference is None else reference)))[0]
    found, result = last(checks, dict(base, **options), ranks)
    checks.below(name, np.abs(found - expected).max(), tolerance)
    return result


def types(checks):
    for ts, extra in (("beuler", {}), ("cn", {}), ("theta", {"ts_theta_theta": 0.7}), ("bdf", {"ts_bdf_order": 2}), ("alpha2", {}),
                      ("arkimex", {}), ("rosw", {"ts_rosw_type": "ra34pw2"})):
        base = dict(BLOCK, ts_type=ts, ts_adapt_type="none", ts_dt=0.02, ts_max_time=0.1, **extra)
        # rosw solves one linear system a stage, and its error is the solve's
        tight = {"ksp_rtol": 1e-13} if ts == "rosw" else {}
        compare(checks, f"-ts_type {ts}, direct", base, {"condensed_pc_type": "cholesky"}, 1e-9)
        compare(checks, f"-ts_type {ts}, CG and bicc", base, dict(ITERATIVE, **tight), 1e-9)


def storages(checks):
    base = dict(BLOCK, ts_dt=0.05, ts_max_time=0.2)
    for method in ("minres", "gmres", "pipecg"):
        compare(checks, f"springs, bicc, {method}", base, {"condensed_pc_type": "bicc", "condensed_ksp_type": method}, 1e-9)
    for name, options in (("springs, jacobi", {"condensed_pc_type": "jacobi"}),
                          ("springs, factors in double", {"condensed_pc_type": "bicc", "condensed_pc_bicc_precision": "double"}),
                          ("SBAIJ, icc", {"condensed_pc_type": "icc"}),
                          ("BAIJ, pbjacobi", {"condensed_pc_type": "pbjacobi", "condensed_mat_type": "baij"}),
                          ("AIJ, sor", {"condensed_pc_type": "sor"}),
                          ("AIJ, gamg with rigid modes", {"condensed_pc_type": "gamg"}),
                          ("AIJ, hypre", {"condensed_pc_type": "hypre"}),
                          ("AIJ, MUMPS", {"condensed_pc_type": "cholesky", "condensed_ksp_type": "preonly",
                                          "condensed_pc_factor_mat_solver_type": "mumps"})):
        if name == "AIJ, hypre" and not knows(checks.program, "hypre"):
            continue
        parallel = [1] if "icc" in name and "SBAIJ" in name else [1, 2]
        for ranks in parallel:
            cg = {} if "MUMPS" in name else {"condensed_ksp_type": "cg"}
            compare(checks, f"{name}, {ranks} ranks", base, dict(options, **cg), 1e-9, ranks)
    compare(checks, "SBAIJ, block Jacobi icc, 2 ranks", base, {"condensed_pc_type": "bjacobi", "condensed_sub_pc_type": "icc",
            "condensed_mat_type": "sbaij", "condensed_ksp_type": "cg"}, 1e-9, 2)


def operators(checks):
    base = dict(BLOCK, ts_dt=0.05, ts_max_time=0.2)
    for name, options in (("shell operator", {"bs_operator": "shell"}), ("shell operator under GMRES", {"bs_operator": "shell", "ksp_type": "fgmres"}),
                          ("-snes_mf_operator", {"snes_mf_operator": True}),
                          ("-snes_fd_color", {"snes_fd_color": True}), ("-pc_type ilu", {"pc_type": "ilu", "ksp_rtol": 1e-9}),
                          ("-pc_type lu", {"pc_type": "lu"}), ("-ksp_type gmres", {"ksp_type": "gmres", "ksp_rtol": 1e-9})):
        ranks = 1 if name in ("-pc_type ilu", "-pc_type lu") else 2
        compare(checks, name, base, options, 1e-8 if "mf" in name else 1e-9, ranks)


def matrix_free(checks):
    """-snes_mf takes no preconditioner and differences the residual: small steps, a tolerance above the noise."""
    base = dict(BLOCK, ts_dt=0.002, ts_max_time=0.01, snes_rtol=1e-8)
    expected = last(checks, dict(base, **REFERENCE))[0]
    found, result = last(checks, dict(base, snes_mf=True, ksp_rtol=1e-6))
    checks.below("-snes_mf", np.abs(found - expected).max(), 1e-8)
    checks.true("-snes_mf takes every step", result.report["rejected"] == 0, f"{result.report['rejected']} rejected")


def switched_off(checks):
    """Switches of PETSc's that are given and off are as if they were not given."""
    def end(options):
        result = run(checks.program, options, interval=0)
        return result.trajectory.position[-1], [result.report[name] for name in ("solver", "newton", "krylov")]

    dynamics = dict(BLOCK, ts_dt=0.05, ts_max_time=0.1)
    statics = dict(BLOCK, bs_task="statics", bs_load_steps=2, bs_lattice_velocity_gradient=None)
    for task, base, off in (("dynamics", dynamics, "false"), ("statics", statics, "0")):
        expected, solver = end(base)
        for name in ("snes_mf", "snes_mf_operator", "snes_fd", "snes_fd_color", "snes_ksp_ew", "ksp_diagonal_scale"):
            found, used = end({**base, name: off})
            checks.true(f"{task}: -{name} {off}", used == solver and np.array_equal(found, expected), f"{used}, without {solver}")


def dampers(checks, folder):
    """What makes S unsymmetric: the outer Krylov method makes up for it."""
    for ranks in (1, 2):
        compare(checks, f"cloth with axial dampers, iterative, {ranks} ranks", dict(CLOTH, ts_dt=0.02, ts_max_time=0.2),
                dict(ITERATIVE, bs_operator="shell"), 1e-9, ranks)
    compare(checks, "cloth with simple dampers, iterative", dict(CLOTH, bs_damping_law="simple", ts_dt=0.02, ts_max_time=0.2), ITERATIVE, 1e-9)
    strong = {"bs_lattice_damping": 20, "ts_dt": 0.02, "ts_max_time": 0.2}  # with one linear solve a step or a stage, nothing else makes up for them
    for name, base in (("ksponly", dict(CLOTH, snes_type="ksponly")), ("rosw", dict(BLOCK, ts_type="rosw", ts_rosw_type="ra34pw2", ts_adapt_type="none"))):
        for solver, options in (("iterative", ITERATIVE), ("direct", {"condensed_pc_type": "cholesky"})):
            compare(checks, f"strong axial dampers, {name}, {solver}", {**base, **strong}, options, 1e-9)
    for d in (1, 2, 3):
        path = cloud(folder, "condensed", d, True, stiffness=30.0, damping=2.0, spring_law="strain",
                     anchors={"particle": [1, 2], "point": np.ones((2, d)), "stiffness": [20.0, 30.0], "rest_length": [0.5, 0.0],
                              "damping": [1.0, 0.0]})
        base = dict(bs_lattice_file=path, bs_stokes_drag=0.5, bs_sphere_drag=True, bs_sphere_drag_rho=90.0, bs_sphere_drag_mu=1.0,
                    ts_dt=0.05, ts_max_time=0.5)
        for ts in ("beuler", "cn", "arkimex"):
            compare(checks, f"dampers, anchors and drag, d = {d}, {ts}", dict(base, ts_type=ts, ts_adapt_type="none"), ITERATIVE, 1e-8)


def indefinite(checks):
    """A bar squeezed to half its length buckles: S is not positive definite, and the result must be the same nevertheless."""
    base = dict(bs_lattice_type="cubic", bs_lattice_size="4,4,12", bs_lattice_neighbors=18, bs_lattice_spacing=0.1,
                bs_lattice_total_mass=2, bs_lattice_fixed="zmin", bs_lattice_stiffness=4000, bs_spring_law="strain",
                bs_lattice_rest_length_factor=1.6, bs_lattice_perturbation=0.001, ts_dt=0.02, ts_max_time=0.02,
                snes_linesearch_type="guarded")  # which needs solutions where the energy search makes do with directions
    result = compare(checks, "squeezed block: MINRES takes over", base, ITERATIVE, 1e-8)
    checks.true("squeezed block: indefinite solves are counted", result.report.get("indefinite", 0) > 0,
                f"{result.report.get('indefinite')} of them")


def stiff(checks):
    """Stiffnesses that differ by 1e4 and 1e8 in one lattice."""
    for factor, tolerance in ((1e4, 1e-8), (1e8, 1e-7)):
        base = dict(BLOCK, bs_lattice_stiff_fraction=0.02, bs_lattice_stiff_factor=factor, ts_dt=0.01, ts_max_time=0.05, snes_rtol=1e-9)
        for ranks in (1, 2):
            compare(checks, f"2 % of the springs {factor:g} times stiffer, {ranks} ranks", base, ITERATIVE, tolerance, ranks)


def stiff_chains(checks):
    """One spring in twenty 10^4 times stiffer: chains and rings of stiff springs are factored with their fill (without it: 109 iterations a solve)."""
    report = run(checks.program, {"options_file": str(OPTIONS / "bench_b2.yaml"), "bs_lattice_size": "16,16,16", "bs_lattice_spacing": 1 / 16,
                                  "bs_lattice_stiff_fraction": 0.05, "ts_dt": 0.1, "ts_max_time": 0.2, "ts_max_steps": 2, **ITERATIVE},
                 interval=0.2, ranks=1).report
    checks.true("chains of stiff springs", report["krylov"] < 30 * report["newton"], f"{report['krylov']} iterations in {report['newton']} solves")


def thin(checks):
    """A beam of 800 particles, whose coarse grid consists of rigid motions: against factors of the full Jacobian, moving far, with dampers that make S
    unsymmetric, on rollers; the same on any ranks; continued in every bit."""
    beam = dict(BLOCK, bs_lattice_size="4,4,50", bs_lattice_velocity_gradient="0,0,1,0,0,0,0,0,0", ts_dt=0.1, ts_max_time=0.4)
    rigid = dict(ITERATIVE, ksp_rtol=1e-8)
    for name, more in (("a beam", {}), ("a beam with axial dampers", {"bs_lattice_damping": 3, "bs_damping_law": "axial"}),
                       ("a beam on rollers", {"bs_group_side": "xmin", "bs_motion_side": "x=fixed,y=free,z=free"}),
                       ("a beam with few groups", {"condensed_pc_bicc_coarse": 30})):
        for ranks in (1, 3):
            result = compare(checks, f"{name}, {ranks} ranks", dict(beam, **more), rigid, 1e-8, ranks)
            checks.true(f"{name}, {ranks} ranks: rigid motions", "rigid motions" in result.report["solver"], result.report["solver"])
    counts = [last(checks, dict(beam, **rigid, condensed_pc_bicc_coarse_space=space))[1].report["krylov"] for space in ("rigid", "hats")]
    checks.true("a beam: rigid motions take fewer iterations than hats", 2 * counts[0] < counts[1], f"{counts[0]} and {counts[1]}")
    for ranks in (1, 3):
        continued(checks, dict(beam, **ITERATIVE), ranks)


def continued(checks, options, ranks):
    launcher = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    start = words({**options, "bs_output": "r.h5md", "bs_overwrite": True, "bs_checkpoint": "c", "bs_checkpoint_every": 2})
    with tempfile.TemporaryDirectory() as whole, tempfile.TemporaryDirectory() as parts:
        for folder, more in ((whole, start), (parts, [*start, "-ts_max_steps", "2"]), (parts, ["-bs_restart", "c", "-ts_max_steps", "1000"])):
            subprocess.run([*launcher, checks.program, *more], cwd=folder, env=environment(ranks), check=True, capture_output=True, timeout=120)
        with h5py.File(pathlib.Path(whole) / "r.h5md") as a, h5py.File(pathlib.Path(parts) / "r.h5md") as b:
            frames = [f["particles/trajectory/position/value"][...] for f in (a, b)]
    checks.true(f"a beam continued in every bit, {ranks} ranks", frames[0].shape == frames[1].shape and np.array_equal(*frames))


def rigid_modes(checks):
    """Multigrid on a hanging beam knows its rotations: it takes a third of the iterations it takes with translations alone (349)."""
    beam = dict(BLOCK, bs_lattice_size="4,4,120", bs_lattice_spacing=0.025, bs_lattice_fixed="zmax", bs_lattice_stiffness=250,
                bs_lattice_total_mass=1000, bs_lattice_velocity_gradient=(0,) * 9, condensed_pc_type="gamg", ksp_rtol=1e-6, snes_rtol=1e-6, ts_dt=0.1,
                ts_max_time=0.2)
    for ranks in (1, 3):
        report = run(checks.program, beam, interval=0.2, ranks=ranks).report
        checks.true(f"beam, CG and gamg, {ranks} ranks", report["newton"] == 6 and report["krylov"] < 150,
                    f"{report['krylov']} iterations in {report['newton']} solves")


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        types(checks)
        storages(checks)
        rigid_modes(checks)
        thin(checks)
        operators(checks)
        matrix_free(checks)
        switched_off(checks)
        dampers(checks, folder)
        indefinite(checks)
        stiff(checks)
        stiff_chains(checks)
    checks.finish()


if __name__ == "__main__":
    main()
