#!/usr/bin/env python3
"""Random combinations of TS, SNES, KSP, PC and Mat options on random systems: each ends right, or says why it does not.

  random_options.py --program build/release/backspring [--count 60] [--seed 1] [--only N] [--jobs 2] [--verbose]

Number N of a seed is always the same run. It must end within 60 s, or have taken steps until then and end on SIGTERM ("slow"),
and in one of three ways: exit code 0 and a right answer;
exit code 2 before the first step, or 3 with the frames before it, with exactly one line of error. Right means: of beuler, cn
and theta every step solves its equation (the correction Newton would still make, by NumPy, is below 1e-4 of what the step
changed); of other types the end is within the method's accuracy of SciPy's DOP853 (a matrix exponential for linear systems),
or, at long steps, of the same method with a direct solver. Ends with "N passed, N failed, 0 skipped"; exit code 0 or 1.
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import h5py
import numpy as np
import systems
from program import environment, words

SLOWER = int(os.environ.get("BS_SLOWER", 1))
TIMEOUT = 60 * SLOWER  # [s]
STEPS = 8
MOST = 40  # steps of a run whose steps are cut: it may end before its time
SOLVED = 1e-4   # correction left of a step, of the step's change
SAME = 1e-3     # of a step by two solvers, of the step's change

# type: (options and the order their error falls with)
TYPES = [({"ts_type": "beuler"}, 1), ({"ts_type": "cn"}, 2), ({"ts_type": "theta", "ts_theta_theta": 0.5, "ts_theta_endpoint": 0}, 2),
         ({"ts_type": "theta", "ts_theta_theta": 0.7, "ts_theta_endpoint": 1}, 1), 
         ({"ts_type": "euler"}, 1), ({"ts_type": "symplectic"}, 1)]
TYPES += [({"ts_type": "alpha2"}, 2), ({"ts_type": "alpha2", "ts_alpha_radius": 0.5}, 2), ({"ts_type": "verlet"}, 2)]
TYPES += [({"ts_type": "bdf", "ts_bdf_order": k}, min(k, 2)) for k in range(1, 7)]
TYPES += [({"ts_type": "rosw", "ts_rosw_type": k}, 2 if k != "theta1" else 1) for k in
          ("2m", "2p", "ra3pw", "ra34pw2", "rodas3", "sandu3", "assp3p3s1c", "lassp3p4s2c", "lasspl2", "ark3", "theta1", "theta2", "grk4t", "shamp4", "veldd4", "4l")]
TYPES += [({"ts_type": "arkimex", "ts_arkimex_type": k}, 1 if k == "1bee" else 2) for k in ("1bee", "a2", "l2", "ars122", "2c", "2d", "2e", "prssp2", "3", "bpr3", "ars443", "4", "5")]
TYPES += [({"ts_type": "rk", "ts_rk_type": k}, 1 if k == "1fe" else 2) for k in ("1fe", "2a", "2b", "3", "3bs", "4", "5f", "5dp", "5bs", "6vr", "7vr", "8vr")]
TYPES += [({"ts_type": "ssp", "ts_ssp_type": k}, 2) for k in ("rks2", "rks3", "rk104")]

EXPLICIT = ("euler", "symplectic", "verlet", "rk", "ssp")

SNES = ["newtonls", "newtonls", "newtonls", "newtontr", "ksponly", "qn", "ncg", "ngmres", "nrichardson", "anderson", "fas", "ngs", "nasm", "aspin",
        "composite", "ms", "vinewtonrsls", "vinewtonssls", "newtontrdc", "patch", "shell", "python"]
NEWTON = [{"snes_mf": True}, {"snes_mf_operator": True}, {"snes_fd": True}, {"snes_fd_color": True}, {"snes_lag_jacobian": 2}, {"snes_lag_jacobian": -2},
          {"snes_lag_preconditioner": 3}, {"snes_ksp_ew": True}, {"snes_max_it": 3}, {"snes_rtol": 1e-10}, {"bs_operator": "shell"}, {"bs_operator": "assembled"}]
NEWTON += [{"snes_linesearch_type": k} for k in ("basic", "bt", "l2", "cp", "nleqerr", "guarded", "energy")]
KSP = ["cg", "gmres", "gmres", "fgmres", "bcgs", "bcgsl", "tfqmr", "minres", "symmlq", "cr", "gcr", "lsqr", "cgne", "richardson", "chebyshev", "preonly", "bicg",
       "cgs", "tcqmr", "ibcgs", "fbcgs", "fbcgsr", "qmrcgs", "dgmres", "lgmres", "pgmres", "pipecg", "pipefgmres", "groppcg", "nash", "stcg", "gltr", "cgls", "lcd", "tsirm", "fetidp", "none"]
KSP_MORE = [{"ksp_rtol": 1e-2}, {"ksp_rtol": 1e-5}, {"ksp_rtol": 1e-10}, {"ksp_max_it": 2}, {"ksp_pc_side": "right"}, {"ksp_pc_side": "left"},
            {"ksp_norm_type": "none"}, {"ksp_norm_type": "natural"}, {"ksp_norm_type": "unpreconditioned"}, {"ksp_gmres_restart": 3},
            {"ksp_initial_guess_nonzero": True}, {"ksp_reuse_preconditioner": True}, {"ksp_diagonal_scale": True}]
CARELESS = [{"ksp_rtol": 0.999}, {"ksp_atol": 1e10}, {"ksp_max_it": 1}, {"ksp_convergence_test": "skip"}, {"ksp_atol": 1.0}, {"ksp_divtol": 1e-3}]
PC = ["none", "jacobi", "bjacobi", "sor", "eisenstat", "ilu", "icc", "lu", "lu", "cholesky", "gamg", "hypre", "mg", "asm", "gasm", "pbjacobi", "vpbjacobi", "svd", "ksp",
      "composite", "redundant", "fieldsplit", "kaczmarz", "lmvm", "telescope", "deflation", "bddc", "nn", "tfs", "patch", "galerkin", "redistribute", "cp", "mat", "shell", "lsc", "ml", "condensed"]
PC_MORE = [{"pc_factor_mat_solver_type": k} for k in ("mumps", "superlu", "superlu_dist", "umfpack", "petsc", "klu")]
PC_MORE += [{"pc_factor_levels": 2}, {"pc_factor_shift_type": "nonzero"}, {"pc_factor_mat_ordering_type": "rcm"}, {"pc_asm_overlap": 2}, {"pc_sor_its": 3}, {"pc_jacobi_type": "rowmax"}]
MAT = ["aij", "baij", "is", "hypre", "aijperm", "aijcrl", "aijsell", "dense", "sbaij", "sell", "nest", "shell", "maij", "seqaij", "mpiaij", "scalapack", "blockmat"]
CONDENSED = [{"condensed_ksp_type": k} for k in ("cg", "gmres", "minres", "bcgs", "fgmres", "pipecg", "preonly", "richardson", "chebyshev", "symmlq", "cr")]
CONDENSED += [{"condensed_pc_type": k} for k in ("bicc", "jacobi", "none", "ilu", "icc", "lu", "cholesky", "gamg", "hypre", "sor", "asm", "bjacobi")]
CONDENSED += [{"condensed_mat_type": k} for k in ("springs", "sbaij", "baij", "aij")] + [{"condensed_refresh": 5}, {"condensed_ksp_rtol": 1e-8}]


def pick(rng, table):
    return table[int(rng.integers(len(table)))]


def solver_options(rng, careless):
    """A few of each kind; most combinations leave most kinds alone."""
    chosen = {}
    if rng.random() < 0.35:
        chosen["snes_type"] = pick(rng, SNES)
    if rng.random() < 0.4:
        chosen.update(pick(rng, NEWTON))
    if rng.random() < 0.3:
        for _ in range(int(rng.integers(1, 3))):
            chosen.update(pick(rng, CONDENSED))
    else:
        if rng.random() < 0.6:
            chosen["ksp_type"] = pick(rng, KSP)
        if rng.random() < 0.6:
            chosen["pc_type"] = pick(rng, PC)
        if rng.random() < 0.3:
            chosen.update(pick(rng, PC_MORE))
        if rng.random() < 0.3:
            chosen["mat_type"] = pick(rng, MAT)
    if rng.random() < 0.4:
        chosen.update(pick(rng, KSP_MORE))
    if careless and rng.random() < 0.2:
        chosen.update(pick(rng, CARELESS))
    return chosen


class Case:
    """Number `number` of a seed: a system, a method and solver options."""

    def __init__(self, seed, number, careless):
        rng = np.random.default_rng([seed, number])
        self.system = systems.Circuit(rng) if rng.random() < 0.2 else systems.Particles(rng)
        explicit = rng.random() < 0.1
        method, self.order = pick(rng, [row for row in TYPES if (row[0]["ts_type"] in EXPLICIT) == explicit])
        self.type = method["ts_type"]
        long_steps = not explicit and rng.random() < 0.4
        self.h_omega = 10 ** rng.uniform(0, 1.5) if long_steps else 0.02 if self.order == 1 else 0.1
        h = self.h_omega / self.system.omega
        self.method = {**method, "ts_adapt_type": "none", "ts_dt": h, "ts_max_time": STEPS * h, "ts_max_steps": MOST, "bs_output": "run.h5md", "bs_progress_interval": -1, "bs_advise": False}
        self.solver = solver_options(rng, careless)
        self.ranks = 2 if rng.random() < 0.2 else 1

    def title(self):
        method = {k: v for k, v in self.method.items() if k.startswith("ts_") and k not in ("ts_dt", "ts_max_time", "ts_max_steps", "ts_adapt_type")}
        return f"{self.system.name}, h omega = {self.h_omega:.2g}, {self.ranks} rank(s): " + " ".join(words({**method, **self.solver}))


def steps_taken(folder):
    """Of a run that mpirun ended before it could say how far it came."""
    try:
        with h5py.File(folder / "run.h5md", "r") as file:
            return len(file["backspring/log/step"])
    except (OSError, KeyError):
        return 0


def run(program, case, folder, solver):
    """Exit code (None: no end), what was said, times and states of the frames (None: no file)."""
    options = {**case.system.options(folder), **case.method, **solver}
    command = (["mpirun", "-n", str(case.ranks)] if case.ranks > 1 else []) + [str(program), *words(options)]
    (folder / "command").write_text(" ".join(command) + "\n")
    process = subprocess.Popen(command, cwd=folder, env=environment(case.ranks), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                               text=True, errors="replace")
    try:
        said, _ = process.communicate(timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        process.terminate()
        try:
            said, _ = process.communicate(timeout=40)
            return "slow" if "backspring: stopped t=" in said or "backspring: failed t=" in said or steps_taken(folder) else None, said, None, None
        except subprocess.TimeoutExpired:
            process.kill()
            said, _ = process.communicate()
        return None, said, None, None
    path, t, y = folder / "run.h5md", None, None
    if path.exists():
        with h5py.File(path, "r") as file:
            y = case.system.states(file)
            t = file["observables"][next(iter(file["observables"]))]["time"][...].ravel()
        path.unlink()
    return process.returncode, said, t, y


def fault_of_end(code, said):
    errors = [line for line in said.splitlines() if line.startswith("backspring: error:")]
    if code is None:
        return f"did not end within {TIMEOUT} s"
    if code == "slow":
        return ""
    if code not in (0, 2, 3):
        return f"exit code {code}"
    if len(errors) != (1 if code in (2, 3) else 0):
        return f"exit code {code} with {len(errors)} lines of error"
    return "a PETSc error came through" if "PETSC ERROR" in said else ""


def fault_of_answer(program, case, folder, t, y):
    """What is wrong with a run that ended with 0."""
    system = case.system
    early = t is not None and len(t) <= MOST and abs(t[-1] - case.method["ts_max_time"]) > 1e-9 * t[-1]
    if y is None or len(y) != len(t) or early or not np.isfinite(y).all():
        return "the frames are not those of a run that ended"
    change = max(system.size(row - y[0]) for row in y)
    theta = {"theta": (case.method.get("ts_theta_theta"), bool(case.method.get("ts_theta_endpoint")))}.get(case.type, systems.THETA.get(case.type))
    if theta:
        worst = max(systems.step_error(system, y[k], y[k + 1], t[k + 1] - t[k], *theta) for k in range(len(t) - 1))
        return "" if worst <= SOLVED else f"a step misses its equation by {worst:.2g} of what it changed"
    if case.h_omega < 0.5:
        far = systems.exact(system, t)[-1]
        most = max(change, system.size(far - y[0]))
        off = system.size(y[-1] - far) / max(most, 1e-300)
        bound = 4 * STEPS * case.h_omega ** (case.order + 1) + 1e-5
        bound = max(bound, STEPS * case.h_omega) if case.order == 1 else bound
        return "" if off <= bound else f"off the exact solution by {off:.2g} of the motion, {bound:.2g} is the method's"
    code, said, _, direct = run(program, case, folder, {"snes_rtol": 1e-11, "ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"})
    if code != 0 or direct is None or len(direct) != len(y):
        return ""  # no step of this length: nothing to compare with
    # the first step: later ones may carry a difference to anywhere
    off = system.size(y[1] - direct[1]) / max(system.size(y[1] - y[0]), 1e-300)
    return "" if off <= SAME else f"off the direct solver's step by {off:.2g} of what it changes"


def check(program, seed, number, careless, keep):
    case = Case(seed, number, careless)
    with tempfile.TemporaryDirectory(prefix="hostile_") as folder:
        folder = keep or pathlib.Path(folder)
        code, said, t, y = run(program, case, folder, case.solver)
        command = (folder / "command").read_text().strip()
        wrong = fault_of_end(code, said)
        if not wrong and code == 0:
            try:
                wrong = fault_of_answer(program, case, folder, t, y)
            except (np.linalg.LinAlgError, ValueError, KeyError, OSError) as why:
                wrong = f"cannot be judged: {why!r}"
    line = next((line for line in said.splitlines() if line.startswith("backspring: error:")), "")
    return f"{number}: {case.title()}", wrong, code, line, command


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", required=True, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", type=int, help="only this number")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time")
    parser.add_argument("--verbose", action="store_true", help="show every run and its line of error")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the system and the command of --only")
    parser.add_argument("--careful", action="store_true", help="without options that ask the linear solver for nothing, like -ksp_rtol 0.999")
    arguments = parser.parse_args()
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)
    numbers = [arguments.only] if arguments.only is not None else range(arguments.first, arguments.first + arguments.count)
    ends, failed = collections.Counter(), 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for title, wrong, code, line, command in pool.map(lambda n: check(arguments.program, arguments.seed, n, not arguments.careful, arguments.keep), numbers):
            ends[code] += 1
            failed += bool(wrong)
            if wrong or arguments.verbose:
                print(f"{'FAIL' if wrong else 'ok  '} {title}", flush=True)
                for text in (wrong, line, command if arguments.keep else ""):
                    if text:
                        print(f"       {text}", flush=True)
    print("; ".join(f"exit code {code}: {count}" for code, count in sorted(ends.items(), key=str)))
    print(f"{sum(ends.values()) - failed} passed, {failed} failed, 0 skipped")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
