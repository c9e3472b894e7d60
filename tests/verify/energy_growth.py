#!/usr/bin/env python3
"""Energy that grows without a drive is warned of, once; what swings, is driven or blown is not.

Every other script of this folder fails, too, where one of its runs brings a warning that it does not expect (program.py).
"""
import io
import pathlib
import tempfile

import h5py
from harness import Checks, write_lattice
import numpy as np

CLOTH = {"bs_lattice_type": "cloth", "bs_lattice_size": (10, 10), "bs_lattice_spacing": 0.05, "bs_lattice_total_mass": 0.1,
         "bs_lattice_fixed_particles": (90, 99), "bs_lattice_perturbation": 1e-3, "bs_lattice_seed": 3, "bs_gravity": (0, 0, -9.81),
         "ts_dt": 0.02, "ts_max_time": 1.0}
BLOCK = {"bs_lattice_type": "cubic", "bs_lattice_size": 4, "bs_lattice_perturbation": 0.1}


def grown(done):
    """Whether growth is all that is warned of, besides the limit of the step (step_limit)."""
    return [name for name in done.report["warnings"] if name != "step_limit"] == ["energy_growth"]


def check_growth(checks):
    """The step named is the first one looked at above the factor, by the energies of the frames; the run goes on and ends with ok."""
    cases = {"cloth, one linear solve a step": ({**CLOTH, "bs_lattice_stiffness": 1e5, "snes_type": "ksponly"}, 10),
             "cloth by cn, one linear solve a step": ({**CLOTH, "bs_lattice_stiffness": 1e3, "snes_type": "ksponly", "ts_type": "cn"}, 10),
             "cloth by rk4 at a long step": ({**CLOTH, "bs_lattice_stiffness": 1e3, "ts_type": "rk", "ts_rk_type": "4", "ts_max_time": 0.06}, 100),
             "block by euler": ({**BLOCK, "ts_type": "euler", "ts_dt": 0.05, "ts_max_time": 5}, 100)}
    for name, (options, factor) in cases.items():
        for ranks in (1, 2):
            done = checks.run(options, ranks=ranks, grows=True, interval=0.0)
            last = done.stdout.strip().splitlines()[-1]
            checks.true(f"{name}, {ranks} ranks: said once, in the last line and in the report", grown(done) and last.startswith("backspring: ok ")
                        and last.endswith(" warnings=1") and done.stderr.count("warning: energy grew") == 1, last)
        e = done.trajectory.observables
        inner = e["kinetic_energy"] + e["elastic_energy"]
        step = int(done.stderr.split("first seen at step ")[1].split(",")[0])
        release = np.maximum.accumulate(np.maximum(0, (e["potential_energy"] - e["elastic_energy"])[0] - (e["potential_energy"] - e["elastic_energy"])))
        # the budget is between what the start and the fall gave and that and as much again
        checks.true(f"{name}: the step", inner[step] > factor * (inner[0] + release[step]) and
                    (inner[:step] < factor * (2 * (inner[0] + release[:step]) + inner[:step].max() / factor)).all(), f"step {step}")
        done = checks.run({**options, "bs_energy_growth": 0}, grows=True)
        checks.true(f"{name}: not watched", done.report["warnings"] == [] and "warnings=" not in done.stdout)


def oscillator(folder, **more):
    """One mass on a spring of zero rest length to an anchor: omega = 2 rad/s, displaced by 1 m."""
    anchors = {"particle": [0], "point": [[0.0, 0.0]], "stiffness": [4.0], "rest_length": [0.0], "damping": [0.0]}
    return {"bs_lattice_file": write_lattice(pathlib.Path(folder) / "o.h5", [[1.0, 0.0]], 1.0, anchors=anchors), **more}


def check_quiet(checks):
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder) / "jump.csv"
        table.write_text("t,x\n0,0\n1,0\n1.000001,5\n50,5\n")
        resting = {"bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": (0.1, 0), "bs_anchor_frequency": 1 / np.pi}
        still = write_lattice(pathlib.Path(folder) / "s.h5", [[0.0, 0.0]], 1.0, anchors={"particle": [0], "point": [[0.0, 0.0]],
                              "stiffness": [4.0], "rest_length": [0.0], "damping": [0.0]})
        cases = {
            "symplectic Euler at 0.95 of its limit": oscillator(folder, ts_type="symplectic", ts_dt=0.95, ts_max_time=500),
            "block by symplectic Euler": {**BLOCK, "ts_type": "symplectic", "ts_dt": 2e-3, "ts_max_time": 2},
            "cn": oscillator(folder, ts_type="cn", ts_dt=0.5, ts_max_time=100),
            "implicit midpoint": oscillator(folder, ts_type="theta", ts_theta_theta=0.5, ts_theta_endpoint=False, ts_dt=0.5, ts_max_time=100),
            "resonance by cn": {"bs_lattice_file": still, **resting, "ts_type": "cn", "ts_dt": 0.05, "ts_max_time": 150},
            "resonance by symplectic Euler, drive in step with 64 steps": {"bs_lattice_file": still, **resting, "ts_type": "symplectic",
                                                                           "ts_dt": np.pi / 64, "ts_max_time": 150},
            "anchors that jump within a step": {"bs_lattice_file": still, "bs_anchor_motion": "table", "bs_anchor_table": table,
                                                "ts_dt": 0.1, "ts_max_time": 20},
            "anchors that are pulled away": {"bs_lattice_file": still, "bs_anchor_motion": "velocity", "bs_anchor_velocity": (30, 0), "ts_type": "bdf",
                                             "ts_dt": 0.05, "ts_max_time": 20},
            "wind on particles at rest": {**BLOCK, "bs_lattice_perturbation": 0, "bs_shape_drag": "sphere", "bs_shape_drag_rho": 1.2,
                                          "bs_shape_drag_area": 0.1, "bs_fluid_velocity": (20, 0, 0), "ts_dt": 0.05, "ts_max_time": 5},
            "fall from rest by forward Euler": {"bs_lattice_type": "chain", "bs_lattice_size": 3, "bs_gravity": -9.81, "ts_type": "euler",
                                                "ts_dt": 1e-3, "ts_max_time": 1},
            "pull of the centre of mass outwards": {**BLOCK, "bs_lattice_perturbation": 0, "bs_xsp_center_of_mass": -50,
                                                    "bs_xsp_attraction_center": (5, 5, 5), "ts_dt": 0.01, "ts_max_time": 2},
            "a block at rest": {**BLOCK, "bs_lattice_perturbation": 0, "bs_lattice_origin": (1e3, 1e3, 1e3), "ts_dt": 0.1, "ts_max_time": 5},
            "cloth": {**CLOTH, "bs_lattice_stiffness": 1e3}}
        for name, options in cases.items():
            done = checks.run(options)
            checks.true(name, done.report["warnings"] == [] and "warnings=" not in done.stdout, done.stdout.strip().splitlines()[-1])


def mtx(path, A):
    """A dense matrix as a Matrix Market file."""
    A = np.atleast_2d(A)
    rows = [f"{i + 1} {j + 1} {A[i, j]:.17g}" for i in range(A.shape[0]) for j in range(A.shape[1]) if A[i, j] != 0]
    path.write_text("%%MatrixMarket matrix coordinate real general\n" + f"{A.shape[0]} {A.shape[1]} {len(rows)}\n" + "\n".join(rows) + "\n")
    return path


def check_linear(checks):
    """A circuit of L and C with a resistance R swings with h omega = 0.05: forward Euler makes its energy grow by (h omega)^2 - h R/L a step, which is one over 100
    once the sum passes log(100); Runge-Kutta methods and implicit ones do not, sources and active elements may."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        C, L, h = 2e-6, 3e-3, 0.05 * np.sqrt(6e-9)

        def circuit(R, **more):  # C v' = -i, L i' = v - R i
            return {"bs_model": "linear", "bs_linear_G": mtx(folder / f"G{R}", np.array([[0, 1], [-1, R]])), "bs_linear_C": mtx(folder / "C", np.diag([C, L])),
                    "bs_linear_x0": mtx(folder / "x0", np.array([[1.0], [0.0]])), "ts_type": "euler", "ts_dt": h, **more}
        for ranks in (1, 2):
            done = checks.run(circuit(0, ts_max_time=4000 * h, bs_output="r.h5md", bs_output_interval=h), ranks=ranks, grows=True, keep=("r.h5md",))
            with h5py.File(io.BytesIO(done.files["r.h5md"])) as f:
                e = f["observables/energy/value"][...].ravel()
            checks.near(f"LC by forward Euler, {ranks} ranks: its energy grows by 1 + (h omega)^2 a step", np.log(e[1000] / e[0]) / 1000, np.log1p(0.0025), 1e-9)
            step = int(done.stderr.split("first seen at step ")[1].split(",")[0])
            checks.true(f"LC by forward Euler, {ranks} ranks: told where it is a hundredfold", grown(done) and e[step] > 100 * e[0] > e[step - 1], f"step {step}")
        for name, options in {
                "RLC by forward Euler, damped enough": circuit(0.0026 * L / h, ts_max_time=4000 * h), "LC by rk4": circuit(0, ts_max_time=4000 * h, ts_type="rk", ts_rk_type="4"),
                "LC by cn": circuit(0, ts_max_time=4000 * h, ts_type="cn"),
                "an active element by forward Euler": circuit(-0.01 * L / h, ts_max_time=1000 * h),
                "a pulse of four steps on a circuit at rest": circuit(0.01 * L / h, ts_max_time=1000 * h, bs_linear_x0=None, bs_linear_B=mtx(folder / "B", np.array([[0.0], [1.0]])),
                                                                      bs_linear_source=f"pulse(1,{300 * h},{h},{2 * h},{h},0,1)"),
                "a resonant source": circuit(0.003 * L / h, ts_max_time=3000 * h, bs_linear_x0=None, bs_linear_B=mtx(folder / "B", np.array([[0.0], [1.0]])),
                                             bs_linear_source=f"sine(1,{0.05 / h / 2 / np.pi})")}.items():
            done = checks.run(options)
            checks.true(name, done.report["warnings"] == [], done.stdout.strip().splitlines()[-1])
        done = checks.run({"bs_model": "linear", "bs_linear_G": mtx(folder / "g", 3.0), "bs_linear_C": mtx(folder / "c", 1.0), "bs_linear_x0": mtx(folder / "x", 1.0), "ts_type": "euler",
                           "ts_dt": 1.0, "ts_max_time": 20}, grows=True)
        checks.true("one decay by forward Euler beyond its limit", grown(done), done.stdout.strip().splitlines()[-1])
        for theta, step in ((0.1, 1.0), (0.3, 10.0), (0.5, 10.0), (0.3, 1.0)):  # of decays 3/s: stable up to h = 2/(3 (1 - 2 theta))
            done = checks.run({"bs_model": "linear", "bs_linear_G": mtx(folder / "g", 3.0), "bs_linear_C": mtx(folder / "c", 1.0), "bs_linear_x0": mtx(folder / "x", 1.0),
                               "ts_type": "theta", "ts_theta_theta": theta, "ts_theta_endpoint": True, "ts_dt": step, "ts_max_time": 40 * step}, grows=True)
            checks.true(f"one decay by theta = {theta}, h = {step} s", grown(done) == (theta < 0.5 and 3 * step * (1 - 2 * theta) > 2), done.stdout.strip().splitlines()[-1])


def check_limit(checks):
    """A mass between two stiffening springs, T = s + 40 s^3: symplectic Euler at half the limit of the start goes beyond it where 2 (1 + 120 s^2) h^2 > 4."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_lattice(pathlib.Path(folder) / "stiffens.h5", [[0.0], [1.0], [2.0]], 1.0, velocity=[[0.0], [0.5], [0.0]], fixed=[1, 0, 1], pairs=[[0, 1], [1, 2]], stiffness=1.0,
                             rest_length=1.0, spring_law="polynomial", columns={"stiffness_2": 0.0, "stiffness_3": 40.0})
        for ranks, h, beyond in ((1, 0.05, False), (1, 0.5, True), (2, 0.5, True)):
            done = checks.run({"bs_lattice_file": path, "ts_type": "symplectic", "ts_dt": h, "ts_max_time": 20, "bs_energy_growth": 0}, ranks=ranks, interval=0.0, expect=None)
            checks.true(f"stiffening springs, h = {h}, {ranks} ranks: {'beyond' if beyond else 'within'} the limit", ("step_limit" in done.report["warnings"]) == beyond,
                        str(done.report["warnings"]))
            s = np.abs(done.trajectory.position[:, 1, 0] - 1)
            over = h * np.sqrt(2 * (1 + 120 * s**2)) > 2
            if beyond:
                step = int(done.stderr.split("since step ")[1].split(" ")[0])
                checks.true("at a step where it is", bool(over[step]), f"step {step} of {np.flatnonzero(over)[:6]}")
            else:
                checks.true("at no step it is", not over.any())


def main():
    checks = Checks(__doc__.splitlines()[0])
    for name, check in (("growth", check_growth), ("quiet", check_quiet), ("linear", check_linear), ("limit", check_limit)):
        if checks.wants(name):
            with checks.group(name):
                check(checks)
    checks.finish()


if __name__ == "__main__":
    main()
