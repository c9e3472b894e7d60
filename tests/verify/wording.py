#!/usr/bin/env python3
"""What runs print is written for people: one particle is not "1 particles", and times have no more digits than they need."""
import pathlib
import tempfile

from harness import Checks, write_lattice
from plurals import LONG, PLURAL


def main():
    checks = Checks("texts for people")
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        one = write_lattice(folder / "one.h5", [[0.0]], 1.0, velocity=[[1.0]], anchors={"particle": [0], "point": [[-1.0]], "stiffness": [3.0]})
        two = write_lattice(folder / "two.h5", [[0.0, 0], [1.0, 0]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=3.0, particle_columns={"force": [[0, 0], [0.0, 0.1]]})
        loose = write_lattice(folder / "loose.h5", [[0.0, 0], [1.0, 0]], 1.0, pairs=[[0, 1]], stiffness=3.0)
        arch = write_lattice(folder / "arch.h5", [[0.0, 0], [1.0, 0.3], [2.0, 0]], 1.0, fixed=[1, 0, 1], pairs=[[0, 1], [1, 2]], stiffness=10.0)
        column = write_lattice(folder / "column.h5", [[0.0, 0], [1.0, 0]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=3.0)
        net = {"bs_lattice_type": "triangular", "bs_lattice_size": "4,4", "bs_lattice_periodic": "xy"}
        motion = {"ts_dt": 0.1, "ts_max_time": 0.3, "ts_type": "beuler", "bs_output": "r.h5md"}
        group = {"bs_group_tip": "ids:1"}
        for name, options in {"one particle": {"bs_lattice_file": one, **motion}, "one spring": {"bs_lattice_file": two, **motion},
                              "one driven": {"bs_lattice_file": two, **motion, **group, "bs_motion_tip": "velocity:0.1,0"},
                              "one force": {"bs_lattice_file": two, **motion, **group, "bs_force_tip": "0.3,0"},
                              "one step shortened": {"bs_lattice_file": two, **motion, "ts_max_time": 0.27, "bs_output_interval": 0.27},
                              "statics": {"bs_lattice_file": two, "bs_task": "statics", "bs_gravity": "0.1,0", "bs_load_steps": 3},
                              "one load step": {"bs_lattice_file": two, "bs_task": "statics", "bs_gravity": "0.1,0", "bs_load_steps": 1},
                              "one step of many": {"bs_lattice_file": two, **motion, "ts_max_steps": 1},
                              "one body tied to nothing": {"bs_lattice_file": loose, "bs_task": "statics", "bs_load_steps": 1},
                              "one spring breaks": {"bs_lattice_file": two, "bs_task": "statics", **group, "bs_motion_tip": "velocity:0.2,0", "bs_break_strain": 0.1, "bs_load_steps": 2},
                              "one jump": {"bs_lattice_file": arch, "bs_task": "statics", "bs_group_top": "ids:1", "bs_force_top": "0,-2", "bs_load_steps": 1},
                              "an unstable equilibrium": {"bs_lattice_file": column, "bs_task": "statics", "bs_group_top": "ids:1", "bs_force_top": "-0.5,0", "bs_load_steps": 1},
                              "an unstable mode": {"bs_lattice_file": column, "bs_task": "modes", "bs_group_top": "ids:1", "bs_force_top": "-0.5,0", "bs_load_steps": 1, "bs_modes": 1, "bs_modes_about": "equilibrium"},
                              "one mode of none": {"bs_lattice_file": two, "bs_task": "modes", "bs_modes": 3, "bs_modes_rigid": "keep"},
                              "moduli": {**net, "bs_task": "moduli"}, "one loose particle": {**net, "bs_task": "moduli", "bs_lattice_dim": 1, "bs_lattice_type": "chain", "bs_lattice_size": 3,
                                         "bs_lattice_periodic": "x", "bs_lattice_stiff_fraction": 0.34, "bs_lattice_stiff_factor": 0},
                              "modes": {"bs_lattice_file": two, "bs_task": "modes", "bs_modes": 1}}.items():
            done = checks.run(options, ranks=1)
            text = done.stdout + done.stderr
            found = [m.group(0) for pattern in (PLURAL, LONG) for m in pattern.finditer(text)]
            checks.true(name, len(text) > 100 and not found, ", ".join(found))
        done = checks.run({"bs_lattice_file": two, **motion}, ranks=1)
        checks.true("the last line says the time as it is", " t=0.3" in done.stdout + done.stderr, (done.stdout + done.stderr)[-120:].strip())
    checks.finish()


if __name__ == "__main__":
    main()
