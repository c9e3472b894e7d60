"""Short runs of the program for the paper, each beside numbers that were found in another way: SciPy's DOP853, Newton's method with the crown's sinking given,
dense matrices, closed forms. Every part returns (numbers, curves): what the text may quote, and what the figures draw."""
import concurrent.futures
import os
import pathlib
import subprocess
import sys

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np  # noqa: E402
from scipy.integrate import solve_ivp  # noqa: E402
from scipy.optimize import minimize_scalar  # noqa: E402

REPO = pathlib.Path(__file__).resolve().parents[3]
sys.path[1:1] = [str(REPO / "tests" / folder) for folder in ("verify", "property", "examples")]
import forces  # noqa: E402
import invariance  # noqa: E402
import orders as methods  # noqa: E402
import structures  # noqa: E402
from harness import observed_orders, write_lattice  # noqa: E402
from moduli import last_frame  # noqa: E402
from program import direct, environment, run, words  # noqa: E402

METHODS = ("beuler", "symplectic", "cn", "alpha2", "verlet", "rosw ra34pw2", "bdf 4", "rk 4")
SHARES, SEEDS, SIDE = (1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6), (1, 2, 3), 16
FIBRES = {"bs_lattice_type": "triangular", "bs_lattice_size": "16,16", "bs_lattice_periodic": "xy", "bs_lattice_stiffness": 1, "bs_lattice_remove_fraction": 0.45,
          "bs_lattice_prune": "dangling", "bs_lattice_seed": 3}
BENDING, SHEAR, SHEAR_STEPS = 1e-4, 0.32, 32
CHAIN = 50


def order_of_methods(program, folder):
    """Errors at three lengths of the step of a damped system of five masses with driven anchors and drag (tests/verify/orders.py)."""
    s = methods.system()
    exact = solve_ivp(s.rhs, (0, methods.T), s.state(), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1].reshape(2, s.n, s.dim)
    base = {**s.options(s.write(folder / "orders.h5", radius=methods.RADIUS)), "bs_sphere_drag": True, "bs_sphere_drag_rho": methods.RHO, "bs_sphere_drag_mu": methods.MU,
            "bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": methods.AMPLITUDE, "bs_anchor_frequency": methods.FREQUENCY, "bs_anchor_phase": methods.PHASE, "ts_adapt_type": "none"}

    def error(options, n):
        solver = direct() if options["ts_type"] in methods.IMPLICIT else {}
        r = run(program, {**base, **solver, **options, "ts_dt": methods.T / n, "ts_max_time": methods.T}, interval=methods.T).trajectory
        return max(np.abs(found[-1] - sought).max() / np.abs(sought).max() for found, sought in zip((r.position, r.velocity), exact))

    rows = [(name, options, order, counts) for name, options, order, _, counts in methods.TYPES if name in METHODS]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        tasks = {name: [pool.submit(error, options, n) for n in counts] for name, options, _, counts in rows}
        errors = {name: [task.result() for task in found] for name, found in tasks.items()}
    steps = {name: [methods.T / n for n in counts] for name, _, _, counts in rows}
    observed = {name: float(observed_orders(steps[name], errors[name])[-1]) for name in errors}
    return {"orders": observed, "masses": s.n, "order_methods": len(rows)}, {"orders": [(name, order, steps[name], errors[name]) for name, _, order, _ in rows]}


def dome_path(points=47, last=4.6):
    """Load over the crown's sinking by Newton's method with the crown held, and the minimum behind the first limit point."""
    sunk, states = np.linspace(0, last, points), [(0.0, np.zeros(21))]
    for w in sunk[1:]:
        states.append(forces.dome_under(w, states[-1][1]))
    values = np.array([value for value, _ in states])
    k = int(np.argmin(values))
    low = minimize_scalar(lambda w: forces.dome_under(w, states[k][1])[0], bounds=(sunk[k - 1], sunk[k + 1]), method="bounded", options={"xatol": 1e-7})
    return sunk, values, (low.x, low.fun)


def star_dome(program, folder):
    """The dome of the tutorial by arc length, every fifth frame against NumPy at the same sinking."""
    x, bars, L = forces.dome()
    at = np.arange(13)
    path = forces.named(write_lattice(folder / "dome.h5", x, 0.2, fixed=at > 6, pairs=bars, stiffness=forces.EA / L, rest_length=L), crown=[0])
    full = 30.0
    r = run(program, {"bs_task": "statics", "bs_lattice_file": path, "bs_force_crown": f"0,0,{-full}", "bs_load_control": "arc", "bs_load_steps": 20, "bs_arc_end": 1.2,
                      "bs_arc_steps": 500}, interval=0)
    load, sunk = full * r.trajectory.observables["load_factor"].ravel(), x[0, 2] - r.trajectory.position[:, 0, 2]
    off_load = off_place = 0.0
    for value, w, places in zip(load[::5], sunk[::5], r.trajectory.position[::5]):
        exact, u = forces.dome_under(w, (places[:7] - x[:7]).ravel())
        off_load, off_place = max(off_load, abs(value - exact)), max(off_place, np.abs(u.reshape(7, 3) + x[:7] - places[:7]).max())
    at_top, top = forces.dome_limit()
    line, values, (at_low, low) = dome_path()
    numbers = {"dome_bars": len(bars), "dome_top": top, "dome_low": low, "dome_found_top": load[: np.argmax(sunk > 1.6)].max(), "dome_found_low": load.min(), "dome_turns": r.report["turns"],
               "dome_frames": len(load), "dome_checked": len(load[::5]), "dome_off_load": off_load, "dome_off_place": off_place}
    return numbers, {"dome": (line, values, sunk, load, [(at_top, top), (at_low, low)])}


def ranks(program, folder):
    """One explicit and twenty implicit steps of a random lattice in space on 1, 2 and 3 ranks (tests/property/invariance.py)."""
    lattice = invariance.random_lattice(folder, 3, 13)
    base = dict(invariance.LAWS, bs_lattice_file=lattice, bs_gravity=invariance.gravity(3), ts_dt=0.01, ts_adapt_type="none")
    worst = {}
    for name, more in (("explicit", {"ts_type": "euler", "ts_max_time": 0.01}),
                       ("implicit", {"ts_type": "beuler", "ts_max_time": 0.2, "ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"})):
        alone, *others = [run(program, {**base, **more}, ranks=n, interval=0.01).trajectory for n in (1, 2, 3)]
        worst[name] = max(np.abs(getattr(other, what) - getattr(alone, what)).max() / np.abs(getattr(alone, what)).max() for other in others for what in ("position", "velocity"))
    return {"ranks_off": worst, "implicit_steps": 20}, {}


def dilution(program, folder):
    """Shear moduli of diluted periodic triangular nets, each against a dense matrix of its own springs."""
    base = {"bs_task": "moduli", "bs_lattice_type": "triangular", "bs_lattice_size": f"{SIDE},{SIDE}", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": 1}

    def modulus(share, seed):
        r = run(program, {**base, "bs_lattice_remove_fraction": 1 - share, "bs_lattice_seed": seed, "bs_output": "net.h5md"}, keep=("net.h5md",))
        file = folder / f"net_{share}_{seed}.h5md"
        file.write_bytes(r.files["net.h5md"])
        return r.report["stiffness"][2][2], r.report["zero_modes"]

    pairs = [(share, seed) for share in SHARES for seed in SEEDS]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        found = dict(zip(pairs, pool.map(lambda pair: modulus(*pair), pairs)))
    off = max(abs(found[pair][0] - relaxed_shear(folder / f"net_{pair[0]}_{pair[1]}.h5md")) for pair in pairs)
    means = {share: float(np.mean([found[share, seed][0] for seed in SEEDS])) for share in SHARES}
    numbers = {"net_side": SIDE, "net_seeds": len(SEEDS), "net_shear": {f"{share:g}": means[share] for share in SHARES}, "net_medium": {f"{share:g}": medium(share) for share in SHARES},
               "net_off": off}
    return numbers, {"dilution": (SHARES, [[found[share, seed][0] for seed in SEEDS] for share in SHARES])}


def relaxed_shear(file):
    """Shear modulus of springs k = 1 N/m at rest by least squares: what of their stretches under a shear no displacement takes back."""
    x, edges, ends, r, _, _ = last_frame(file)
    sheared, R = r[:, 0] * r[:, 1] / np.linalg.norm(r, axis=1), structures.stretches(ends, r, len(x))
    left = sheared - R @ np.linalg.lstsq(R, sheared, rcond=1e-12)[0]
    return left @ left / np.linalg.det(edges)


def medium(share):
    """Shear modulus of the effective medium of a triangular net with k = 1 N/m."""
    return np.sqrt(3) / 4 * max(3 * share - 2, 0.0)


class Recorder:
    """Takes the place of a test's checks: keeps how far each was off."""

    def __init__(self):
        self.off = {}

    def near(self, name, value, expected, tolerance):
        self.off[name] = float(np.max(np.abs(np.asarray(value, float) - expected)))

    def true(self, name, holds, note=""):
        self.off[name] = float(holds)


def stiffening(program, folder):
    """The fibre network of the tutorial, with and without bending, and what tests/examples/structures.py finds of it by dense matrices and least squares."""
    def call(*options):
        done = subprocess.run([program, *words({k: v for part in options for k, v in part.items()})], cwd=folder, env=environment(1), capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr.strip()[-300:])

    call({"bs_task": "generate", "bs_angle_stiffness": BENDING, "bs_output": "fibres.h5"}, FIBRES)
    call({"bs_task": "generate", "bs_output": "ropes.h5"}, FIBRES)
    shear = {"bs_task": "statics", "bs_box_strain": f"xy=velocity:{SHEAR}", "bs_load_steps": SHEAR_STEPS, "bs_output_interval": 0}
    for name in ("fibres", "ropes"):
        call(shear, {"bs_lattice_file": f"{name}.h5", "bs_output": f"{name}.h5md"})
    call({"bs_task": "moduli", "bs_lattice_file": "fibres.h5", "bs_output": "soft.h5md"})
    seen = Recorder()
    structures.fibres(seen, folder)
    stress = {}
    with structures.h5py.File(folder / "soft.h5md") as f:
        soft = f["moduli/stiffness"][2, 2]
    for name in ("fibres", "ropes"):
        with structures.h5py.File(folder / f"{name}.h5md") as f:
            stress[name] = f["observables/stress/value"][:, 2]
    step = SHEAR / SHEAR_STEPS
    strain = step * np.arange(SHEAR_STEPS + 1)
    slope = {name: np.diff(values) / step for name, values in stress.items()}
    taut = int(np.flatnonzero(stress["ropes"] > 1e-9)[0])
    numbers = {"fibre_removed": 100 * FIBRES["bs_lattice_remove_fraction"], "fibre_ratio": 1 / BENDING, "fibre_soft": soft, "fibre_stiff": slope["fibres"][-1],
               "fibre_off": seen.off["shear modulus of fibres"],
               "fibre_gain": slope["fibres"][-1] / soft, "fibre_taut": [strain[taut - 1], strain[taut]], "fibre_taut_by_scipy": seen.off["ropes are taut at the shear 0.31"]}
    return numbers, {"stiffening": (strain, slope, soft, strain[taut - 1: taut + 1])}


def vibrations(program, folder):
    """Lowest frequencies of a chain held at both ends: omega^2 = 4 k/m sin^2(q pi/(2 (N + 1)))."""
    n, count = CHAIN, 20
    at = np.arange(n + 2)
    path = write_lattice(folder / "chain.h5", at[:, None].astype(float), 0.5, fixed=(at == 0) | (at == n + 1), pairs=np.stack([at[:-1], at[1:]], 1), stiffness=100.0, rest_length=1.0)
    found = np.array(run(program, {"bs_task": "modes", "bs_lattice_file": path, "bs_modes": count}).report["omega_squared"])
    exact = 4 * 200.0 * np.sin(np.arange(1, count + 1) * np.pi / (2 * (n + 1))) ** 2
    return {"chain_masses": n, "chain_modes": count, "chain_off": float(np.abs(found / exact - 1).max())}, {}


PARTS = (order_of_methods, star_dome, ranks, dilution, stiffening, vibrations)
