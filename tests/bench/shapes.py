#!/usr/bin/env python3
"""Linear solves of lattices of every shape: Krylov iterations for six digits (K), flops and time per digit of the default beside other
preconditioners. K is that of one Newton step, mean over the linear solves of one time step.

--check compares K of small shapes with bounds, on one rank and on several: counts, so that a busy machine does not matter.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
import numpy as np
from harness import write_lattice
from program import environment, words

HERE = pathlib.Path(__file__).resolve().parent
REPO = HERE.parents[1]
REST = {"ts_type": "beuler", "ts_max_steps": 1, "ts_max_time": 1e9, "ksp_rtol": 1e-6, "snes_rtol": 1e-6, "bs_advise": 0, "bs_overwrite": True,
        "bs_progress_interval": -1}
SOLVERS = {"default": {"condensed_pc_type": "bicc"},
           "hats": {"condensed_pc_type": "bicc", "condensed_pc_bicc_coarse_space": "hats"},
           "rigid": {"condensed_pc_type": "bicc", "condensed_pc_bicc_coarse_space": "rigid"},
           "bicc, no coarse space": {"condensed_pc_type": "bicc", "condensed_pc_bicc_coarse": 0},
           "gamg": {"condensed_pc_type": "gamg", "condensed_ksp_type": "cg"},
           "hypre": {"condensed_pc_type": "hypre", "condensed_ksp_type": "cg"},
           "MUMPS": {"condensed_pc_type": "cholesky", "condensed_pc_factor_mat_solver_type": "mumps"}}
OMEGA = 3.13  # largest frequency of the cubic lattice on 18 neighbours over sqrt(k/m), k: spring constant along an axis


def cubic(size, swing, load=1e-3, fixed="zmin", **more):
    """A lattice on 18 neighbours whose step is `swing` over its largest frequency, under a small load in all directions."""
    a, mass, K = 1 / 24, 1000 / 24**3, 250.0
    return dict(REST, bs_lattice_type="cubic", bs_lattice_size=size, bs_lattice_spacing=a, bs_lattice_neighbors=18, bs_lattice_particle_mass=mass,
                bs_lattice_stiffness=K, bs_lattice_fixed=fixed, bs_spring_law="strain", bs_gravity=(load, load, -load),
                ts_dt=swing / (OMEGA * (K / a / mass) ** 0.5), **more)


def cloth(n):
    return dict(REST, bs_lattice_type="cloth", bs_lattice_size=(n, n), bs_lattice_neighbors=12, bs_lattice_spacing=0.04,
                bs_lattice_particle_mass=0.3 / 576, bs_lattice_fixed_particles=(n * n - n, n * n - 1), bs_lattice_stiffness=(20, 10, 0.5),
                bs_lattice_damping=(0.01, 0.005, 0.001), bs_spring_law="strain", bs_damping_law="axial", bs_stokes_drag=1e-4,
                bs_gravity=(1e-3, 1e-3, -1e-3), ts_dt=0.02)


def filed(folder, name, n, swing, keep=None, stiff=None):
    """The cube on 18 neighbours as a file: springs with keep(a, b), those with stiff(a, b) 10^4 times stiffer; a, b: (springs, 3), the ends' places in the grid."""
    spacing, mass = 1 / n, 1000 / n**3
    grid = np.array(np.meshgrid(*[np.arange(n)] * 3, indexing="ij")).reshape(3, -1).T
    row = np.arange(n**3).reshape(n, n, n)
    pairs = []
    for step in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)):
        low = tuple(slice(max(0, -s), n - max(0, s)) for s in step)
        high = tuple(slice(max(0, s), n - max(0, -s)) for s in step)
        pairs.append(np.column_stack([row[low].ravel(), row[high].ravel()]))
    pairs = np.vstack(pairs)
    if keep:
        pairs = pairs[keep(grid[pairs[:, 0]], grid[pairs[:, 1]])]
    a, b = grid[pairs[:, 0]], grid[pairs[:, 1]]
    file = write_lattice(folder / f"{name}_{n}.h5", spacing * grid, mass, fixed=grid[:, 2] == 0, pairs=pairs,
                         stiffness=np.where(stiff(a, b), 2.5e6, 250.0) if stiff else 250.0, rest_length=spacing * np.linalg.norm(a - b, axis=1),
                         spring_law="strain")
    return dict(REST, bs_lattice_file=file, bs_gravity=(1e-3, 1e-3, -1e-3), ts_dt=swing / (OMEGA * (250.0 / spacing / mass) ** 0.5))


def thinned(folder, n, share):
    """The cube without a share of its springs, drawn at random."""
    return filed(folder, f"thinned_{100 * share:g}", n, 250, keep=lambda a, b: np.random.default_rng(1).random(len(a)) >= share)


def reinforced(folder, kind, n, swing=25):
    """The cube with stiff fibres along x, stiff layers across z, a stiff third, or stiff grains."""
    centres = np.random.default_rng(0).uniform(0, n, (12, 3))
    within = lambda x: (np.linalg.norm(x[:, None] - centres, axis=2) < n / 6).any(1)
    stiff = {"fibres": lambda a, b: ((a - b)[:, 1:] == 0).all(1) & (a[:, 1] % 4 == 1) & (a[:, 2] % 4 == 1),
             "layers": lambda a, b: (a[:, 2] == b[:, 2]) & (a[:, 2] % 5 == 2),
             "third": lambda a, b: (a[:, 0] < n / 3) & (b[:, 0] < n / 3),
             "grains": lambda a, b: within(a) & within(b)}
    return filed(folder, kind, n, swing, stiff=stiff[kind])


def shapes(folder):
    """{name: options}"""
    cases = {f"cube {n}, h omega {swing}": cubic((n, n, n), swing) for n, swing in ((16, 25), (24, 25), (24, 250), (40, 250))}
    for swing, load in ((240, 1e-5), (24000, 1e-6)):
        cases[f"beam 4 x 4 x 1000, h omega {swing}"] = cubic((4, 4, 1000), swing, load)
        cases[f"plate 60 x 60 x 3, h omega {swing}"] = cubic((60, 60, 3), swing, load, "xmin")
    cases["cloth 300 x 300"] = cloth(300)
    for power in (4, 6):
        for share in (0.01, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 0.9):
            cases[f"cube 16, {100 * share:g} % of the springs 10^{power} stiffer"] = cubic((16, 16, 16), 25, bs_lattice_stiff_fraction=share,
                                                                                        bs_lattice_stiff_factor=10**power)
    for kind in ("fibres", "layers", "third", "grains"):
        for n in (16, 32):
            cases[f"cube {n}, stiff {kind}"] = reinforced(folder, kind, n)
    for share in (0.3, 0.5, 0.6):
        cases[f"cube 18, {100 * share:g} % of the springs removed"] = thinned(folder, 18, share)
    return cases


def checks(folder):
    """name: (options, largest K on one rank, on three); measured 10 to 30 % below"""
    return {"cube": (cubic((16, 16, 16), 250), 25, 31), "beam": (cubic((4, 4, 250), 240, 1e-5), 25, 28),
            "beam, nearly static": (cubic((4, 4, 250), 24000, 1e-6), 30, 35), "plate": (cubic((30, 30, 3), 240, 1e-5, "xmin"), 28, 34),
            "plate that bends far": (cubic((40, 40, 3), 24000, 1e-3, "xmin"), 40, 50),
            "cloth": (cloth(60), 42, 53),
            "a fifth of the springs stiff": (cubic((12, 12, 12), 25, bs_lattice_stiff_fraction=0.2, bs_lattice_stiff_factor=1e4), 55, 95),
            "stiff springs, cut by ranks": (cubic((12, 12, 12), 25, bs_lattice_stiff_fraction=0.1, bs_lattice_stiff_factor=1e4), 48, 78),
            "half of the springs stiff": (cubic((12, 12, 12), 25, bs_lattice_stiff_fraction=0.5, bs_lattice_stiff_factor=1e4), 20, 60),
            "stiff fibres": (reinforced(folder, "fibres", 16), 23, 32), "stiff layers": (reinforced(folder, "layers", 16, 250), 23, 32),
            "a stiff third": (reinforced(folder, "third", 16), 25, 50)}


def solve(program, options, ranks, folder, limit):
    """{K, newton, flops per digit, seconds per digit}, or the reason why not."""
    given = dict(options, bs_report="report.json", log_view=":log.txt")
    command = (["mpirun", "-n", str(ranks)] if ranks > 1 else []) + [program] + words(given)
    try:
        run = subprocess.run(command, cwd=folder, env=environment(ranks), capture_output=True, text=True, timeout=limit)
    except subprocess.TimeoutExpired:
        return {"failed": f"not done in {limit:g} s"}
    if run.returncode:
        return {"failed": (run.stderr.strip().splitlines() or ["failed"])[-1][:120]}
    counts = {word.split("=")[0]: float(word.split("=")[1]) for word in run.stdout.strip().splitlines()[-1].split() if "=" in word}
    events = {line.split()[0]: line.split() for line in (folder / "log.txt").read_text().splitlines() if line[:8] in ("KSPSolve", "PCSetUp ")}
    solves = max(1.0, counts["newton"])
    kind = lambda column: sum(float(events[name][column]) for name in events) / (6 * solves)
    return {"K": counts["krylov"] / solves, "newton": counts["newton"], "s_per_digit": kind(3), "flop_per_digit": kind(5)}


def check(program, ranks, folder):
    wrong = []
    for name, (options, *bounds) in checks(folder).items():
        for n, bound in zip((1, 3), bounds):
            found = solve(program, dict(options, **SOLVERS["default"]), n, folder, 300)
            print(f"{name}, {n} ranks: {found.get('failed') or format(found['K'], '.1f')} (at most {bound})", flush=True)
            if "failed" in found or found["K"] > bound:
                wrong.append(name)
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(REPO / "build" / "release" / "backspring"))
    parser.add_argument("--ranks", default="1,8")
    parser.add_argument("--filter", default="", help="only shapes whose name contains this")
    parser.add_argument("--solvers", default=",".join(name for name in SOLVERS if "," not in name))
    parser.add_argument("--limit", type=float, default=120, help="seconds a run may take")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("-o", "--output", default="bench_shapes.json")
    a = parser.parse_args()
    program = str(pathlib.Path(a.program).resolve())
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if a.check:
            wrong = check(program, (1, 3), folder)
            sys.exit(f"too many iterations: {wrong}" if wrong else 0)
        results = {}
        print("| shape | ranks | solver | K | flop per digit | s per digit |\n|---|---|---|---|---|---|")
        for name, options in shapes(folder).items():
            for ranks in (int(r) for r in a.ranks.split(",")):
                for solver in a.solvers.split(","):
                    if a.filter not in name:
                        continue
                    found = solve(program, dict(options, **SOLVERS[solver]), ranks, folder, a.limit)
                    results[f"{name}; {ranks}; {solver}"] = found
                    cells = found.get("failed") or f"{found['K']:.1f} | {found['flop_per_digit']:.2g} | {found['s_per_digit']:.2g}"
                    print(f"| {name} | {ranks} | {solver} | {cells} |", flush=True)
        pathlib.Path(a.output).write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    main()
