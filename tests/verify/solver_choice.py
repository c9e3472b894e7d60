#!/usr/bin/env python3
"""Which linear solver is chosen where the user leaves it open, or names half of it; and what is said when it fails."""
import contextlib
import os
import re
import subprocess
import tempfile
import time

import numpy as np
from condensed import BLOCK, REFERENCE
from harness import Checks
from program import environment, knows, run, words

CUBE = dict(BLOCK, bs_lattice_size="10,10,10", ts_dt=0.02, ts_max_time=0.06)
CHAIN = dict(bs_lattice_type="chain", bs_lattice_size=1200, bs_lattice_dim=3, bs_lattice_spacing=0.05, bs_lattice_particle_mass=0.01,
             bs_lattice_stiffness=3000, bs_lattice_fixed="xmin", bs_gravity="0,-9.81,0", ts_dt=0.01, ts_max_time=0.03)
NET = dict(bs_lattice_type="square", bs_lattice_size="20,20", bs_lattice_dim=2, bs_lattice_spacing=0.05, bs_lattice_particle_mass=0.01,
           bs_lattice_stiffness=300, bs_lattice_fixed="ymax", bs_gravity="0,-9.81", ts_dt=0.01, ts_max_time=0.03)


def solver_of(result):
    return re.search(r"PC condensed \((.*)\)", result.report["solver"]).group(1)


def by_fill(checks):
    """Direct where the factors are cheap, whatever the number of unknowns; the same on any number of ranks."""
    for name, base, expected in (("cube of 10^3", CUBE, "cg + bicc"), ("chain of 1,200", CHAIN, "preonly + cholesky"), ("net of 20^2", NET, "preonly + cholesky")):
        said = {ranks: solver_of(run(checks.program, base, ranks=ranks)) for ranks in (1, 2, 3)}
        checks.true(f"{name}: {expected}", said[1].startswith(expected), said[1])
        whole = " of the whole on each rank"
        checks.true(f"{name}: the same on 1, 2 and 3 ranks", len({words.replace(whole, "") for words in said.values()}) == 1, str(said))
        checks.true(f"{name}: factors of the whole on each of several ranks", [whole in words for words in said.values()] == [False] + 2 * ["cholesky" in expected], str(said))
    divided = solver_of(run(checks.program, dict(NET, condensed_pc_factor_mat_solver_type="mumps"), ranks=2))
    checks.true("by a package that is named: divided among the ranks", divided.startswith("preonly + cholesky on"), divided)


def predicted_fill(checks):
    """A chain under nested dissection: factors of n log n entries at most; a cube of n^3: about 10 times more for twice the particles."""
    flops = {}
    for n in (6, 8, 10):
        said = solver_of(run(checks.program, dict(CUBE, bs_lattice_size=f"{n},{n},{n}", bs_lattice_fixed=None)))
        flops[n] = float(re.search(r"([0-9.e+]+) Mflop", said).group(1)) * 1e6
    order = np.log(flops[10] / flops[6]) / np.log(10**3 / 6**3)
    checks.true("cube: work grows with the square of the unknowns or a little more", 1.8 < order < 2.7, f"order {order:.2f}")
    # no ordering does less than factor the last separator, a plane of 10 x 10 particles
    checks.true("cube: more than its middle plane alone", flops[10] > 300**3 / 3, f"{flops[10]:.3g}")
    said = solver_of(run(checks.program, CHAIN))
    chain = float(re.search(r"([0-9.e+]+) Mflop", said).group(1)) * 1e6
    checks.true("chain: two to four blocks a column", 1200 * 3 * 6**2 * 0.9 < chain < 1200 * 3 * 12**2, f"{chain:.3g}")


STIFF = dict(bs_lattice_type="cubic", bs_lattice_size="13,13,13", bs_lattice_spacing=1 / 24, bs_lattice_neighbors=18, bs_lattice_particle_mass=0.0723, bs_lattice_stiffness=250,
             bs_lattice_fixed="zmin", bs_spring_law="strain", bs_gravity="1e-3,1e-3,-1e-3", bs_lattice_stiff_fraction=0.25, bs_lattice_stiff_factor=1e6, ts_dt=0.0277,
             ts_max_time=4 * 0.0277, snes_rtol=1e-9, ksp_rtol=1e-9, bs_advise=0, condensed_pc_bicc_fill=0)  # without fill iterations are many


def by_measured_work(checks):
    """A quarter of the springs is 1e6 times stiffer: iterations take more work than factors, which take their place. Springs that are all alike
    never do so, and a solver that is named stays."""
    expected = run(checks.program, dict(STIFF, condensed_pc_type="cholesky", condensed_pc_factor_mat_solver_type="mumps"), interval=0.0277)
    move = np.abs(expected.trajectory.position[-1] - expected.trajectory.position[0]).max()
    for ranks in (1, 3):
        result = run(checks.program, STIFF, interval=0.0277, ranks=ranks)
        checks.true(f"stiff springs, {ranks} ranks: factors once", result.report["factored"] == 1, str(result.report["factored"]))
        checks.true(f"stiff springs, {ranks} ranks: said", "Cholesky factors took the place of iterations" in result.stdout, result.stdout[-400:])
        checks.true(f"stiff springs, {ranks} ranks: one solve by iterations, the others by factors",
                    200 < result.report["krylov"] <= 2000 + result.report["newton"], f"{result.report['krylov']} of {result.report['newton']} solves")
        checks.below(f"stiff springs, {ranks} ranks: as by factors from the start", np.abs(result.trajectory.position[-1] - expected.trajectory.position[-1]).max(), 1e-6 * move)
    for ranks in (1, 2, 3):  # the ranks iterate side by side, while the factors of the whole are made by each of them: summed work would call for factors
        cheaper = run(checks.program, dict(STIFF, bs_lattice_size="16,16,16", bs_lattice_stiff_fraction=0.3, bs_lattice_stiff_factor=1e4, snes_rtol=1e-6, ksp_rtol=1e-6,
                                           condensed_pc_bicc_fill=None, ts_max_time=2 * 0.0277), ranks=ranks)
        checks.true(f"30 % of the springs 1e4 times stiffer, {ranks} ranks: iterations stay", cheaper.report["factored"] == 0 and cheaper.report["krylov"] > 100,
                    f"factored {cheaper.report['factored']}, krylov {cheaper.report['krylov']}")
    named = run(checks.program, dict(STIFF, condensed_pc_type="bicc", ts_max_time=0.0277))
    checks.true("-condensed_pc_type bicc: iterations stay", named.report["factored"] == 0 and named.report["krylov"] > 10 * named.report["newton"], str(named.report["krylov"]))
    alike = run(checks.program, dict(STIFF, bs_lattice_stiff_fraction=0))
    checks.true("springs that are all alike: iterations stay", alike.report["factored"] == 0, str(alike.report["krylov"]))
    still = {pc: run(checks.program, dict(STIFF, bs_task="statics", ts_dt=None, ts_max_time=None, snes_rtol=1e-11, ksp_rtol=1e-11, **named), interval=1)
             for pc, named in (("", {}), ("cholesky", {"condensed_pc_type": "cholesky", "condensed_pc_factor_mat_solver_type": "mumps"}))}
    at = {name: result.trajectory.position[-1] for name, result in still.items()}
    checks.true("statics: factors", still[""].report["factored"] >= 1, str(still[""].report["factored"]))
    checks.below("statics: as by factors from the start", np.abs(at[""] - at["cholesky"]).max(), 1e-6 * np.abs(at["cholesky"] - expected.trajectory.position[0]).max())


def half_named(checks):
    """A preconditioner that does not factor is used by conjugate gradients at any size."""
    base = dict(CUBE, ts_max_time=0.2)
    exact = run(checks.program, dict(base, condensed_pc_type="cholesky")).report["newton"]
    for pc in ("bicc", "gamg", *(["hypre"] if knows(checks.program, "hypre") else []), "sor", "jacobi"):
        result = run(checks.program, dict(base, condensed_pc_type=pc))
        checks.true(f"-condensed_pc_type {pc}: cg", solver_of(result).startswith("cg + "), solver_of(result))
        checks.true(f"-condensed_pc_type {pc}: few more Newton iterations than Cholesky", result.report["newton"] <= 1.6 * exact,
                    f"{result.report['newton']}, {exact}")
    result = run(checks.program, dict(base, condensed_ksp_type="cg"))
    checks.true("-condensed_ksp_type cg: not around a direct solver", solver_of(result).startswith("cg + bicc"), solver_of(result))
    result = run(checks.program, dict(base, condensed_ksp_type="preonly"))
    checks.true("-condensed_ksp_type preonly: a direct solver", solver_of(result).startswith("preonly + cholesky"), solver_of(result))


def out_of_iterations(checks):
    """Iterations that run out are not a tangent that is not positive definite, and are named."""
    base = dict(CUBE, ts_type="rosw", ts_adapt_type="none", ts_max_time=0.02, condensed_pc_type="jacobi", ksp_rtol=1e-10, condensed_ksp_max_it=2,
                bs_step_min=0.01)
    for ranks in (1, 3):
        result = run(checks.program, base, ranks=ranks, expect=3)
        checks.true(f"{ranks} ranks: named", "ran out of its 2 iterations (-condensed_ksp_max_it)" in result.stderr, result.stderr.strip()[-200:])
        checks.true(f"{ranks} ranks: counted", result.report["exhausted"] > 0 and result.report["indefinite"] == 0,
                    f"exhausted {result.report['exhausted']}, indefinite {result.report['indefinite']}")


def evaluations(checks):
    """-snes_max_funcs ends Newton's method."""
    few = run(checks.program, dict(CUBE, snes_max_funcs=2, bs_step_min=0.015), expect=3)
    checks.true("-snes_max_funcs 2 is named", "-snes_max_funcs" in few.stderr, few.stderr.strip()[-200:])
    many = run(checks.program, dict(CUBE, snes_max_funcs=1000))
    checks.true("-snes_max_funcs 1000: no rejections", many.report["rejected"] == 0, str(many.report["rejected"]))


def splits(checks):
    """-pc_type fieldsplit: named splits, numbered ones, PETSc's defaults."""
    base = dict(BLOCK, ts_dt=0.02, ts_max_time=0.06, snes_rtol=1e-11)
    expected = run(checks.program, dict(base, **REFERENCE), interval=0.06).trajectory.position[-1]
    for name, options in (("by itself", {}), ("numbered", {"pc_fieldsplit_0_fields": "0,1,2", "pc_fieldsplit_1_fields": "3,4,5"}),
                          ("with a block size", {"pc_fieldsplit_block_size": 6, "pc_fieldsplit_0_fields": "0,1,2", "pc_fieldsplit_1_fields": "3,4,5"}),
                          ("named", {"fieldsplit_velocity_ksp_type": "cg", "fieldsplit_velocity_pc_type": "gamg"}),
                          ("multiplicative", {"pc_fieldsplit_type": "multiplicative"}), ("of every number", {"pc_fieldsplit_default": True})):
        for ranks in (1, 3):
            result = run(checks.program, dict(base, pc_type="fieldsplit", **options), interval=0.06, ranks=ranks)
            checks.below(f"fieldsplit {name}, {ranks} ranks", np.abs(result.trajectory.position[-1] - expected).max(), 1e-9)
            checks.true(f"fieldsplit {name}, {ranks} ranks: no option is called unused", "not used" not in result.stderr, result.stderr.strip()[-200:])


def threads(checks):
    """The factors of the coarse grid start no threads: as many as a run without a coarse grid has, OMP_NUM_THREADS being given or not."""
    options = dict(CUBE, bs_lattice_size="24,24,24", condensed_pc_type="bicc", ts_max_time=0.2, bs_progress_interval=-1)
    for given in ({}, {"OMP_NUM_THREADS": "1"}):
        most = {}
        for unknowns in (-1, 0):
            variables = {name: value for name, value in environment(1).items() if not name.endswith("_NUM_THREADS")}
            command = [checks.program, *words(dict(options, condensed_pc_bicc_coarse=unknowns))]
            with tempfile.TemporaryDirectory() as folder, subprocess.Popen(command, cwd=folder, env=dict(variables, **given), stdout=subprocess.DEVNULL) as process:
                counts = [1]
                while process.poll() is None:
                    with contextlib.suppress(OSError):  # it ended between the two
                        counts.append(len(os.listdir(f"/proc/{process.pid}/task")))
                    time.sleep(0.002)
                most[unknowns] = max(counts)
                checks.true(f"threads, {given or 'nothing given'}: the run ends well", process.returncode == 0, str(process.returncode))
        checks.true(f"threads, {given or 'nothing given'}: none for the coarse grid", most[-1] == most[0], str(most))


def main():
    checks = Checks(__doc__)
    for group in (by_fill, predicted_fill, by_measured_work, half_named, out_of_iterations, evaluations, splits, threads):
        if checks.wants(group.__name__):
            group(checks)
    checks.finish()


if __name__ == "__main__":
    main()
