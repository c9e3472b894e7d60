"""Energy that grows without a drive is warned of, once; what swings, is driven or blown is not.

Every other script of this folder fails, too, where one of its runs brings a warning that it does not expect (program.py).
"""
import tempfile
import pathlib

from harness import Checks, write_lattice
import numpy as np

CLOTH = {"bs_lattice_type": "cloth", "bs_lattice_size": (10, 10), "bs_lattice_spacing": 0.05, "bs_lattice_total_mass": 0.1,
         "bs_lattice_fixed_particles": (90, 99), "bs_lattice_perturbation": 1e-3, "bs_lattice_seed": 3, "bs_gravity": (0, 0, -9.81),
         "ts_dt": 0.02, "ts_max_time": 1.0}
BLOCK = {"bs_lattice_type": "cubic", "bs_lattice_size": 4, "bs_lattice_perturbation": 0.1}


def grown(done):
    return done.report["warnings"] == ["energy_growth"]


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
        resting = {"bs_anchor_motion": "sinusoid", "bs_anchor_amplitude": 0.1, "bs_anchor_frequency": 1 / np.pi}
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
            "anchors that are pulled away": {"bs_lattice_file": still, "bs_anchor_motion": "velocity", "bs_anchor_velocity": 30, "ts_type": "bdf",
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


def main():
    checks = Checks(__doc__.splitlines()[0])
    for name, check in (("growth", check_growth), ("quiet", check_quiet)):
        if checks.wants(name):
            with checks.group(name):
                check(checks)
    checks.finish()


if __name__ == "__main__":
    main()
