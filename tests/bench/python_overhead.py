#!/usr/bin/env python3
"""What a step of B1 costs in Python beside the program: processor time between two numbers of steps, so that starting is no part of it, in turns.

  python_overhead.py --program build/release/backspring [--size 40] [--steps 2,12] [--rounds 5]

In Python every step is a call, after which the time is asked for. The positions after the last step are compared, too, bit for bit. For idle cores: the least of all rounds counts."""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import resource

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "verify"))
import h5py
import numpy as np
from program import environment

IN_PYTHON = """
import sys, time, numpy as np
import backspring as bs
size, few, many = (int(one) for one in sys.argv[1:4])
net = bs.generate("cubic", (size,) * 3, neighbors=18, spacing=1 / size, total_mass=1000, fixed="zmin", stiffness=250, velocity_gradient="0,0,1,0,0,0,0,0,0", bs_spring_law="strain")
with bs.Simulation(net, ts_type="beuler", dt=0.01, snes_rtol=1e-6, bs_gravity=(0, 0, -9.81)) as simulation:
    for k in range(many):
        if k == few: start = time.process_time()
        simulation.step()
        assert simulation.t > 0
    print(time.process_time() - start)
    np.save(sys.argv[4], simulation.x)
"""


def processor_time():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def in_python(program, size, few, many, folder):
    env = dict(environment(1), PYTHONPATH=str(pathlib.Path(program).parent / "python"))
    done = subprocess.run([sys.executable, "-c", IN_PYTHON, *map(str, (size, few, many)), folder / "x.npy"], env=env, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


def by_program(program, size, steps, folder):
    command = [program, "-options_file", HERE.parents[1] / "options/problems/bench_b1.yaml", "-bs_lattice_size", f"{size},{size},{size}", "-bs_lattice_spacing", repr(1 / size),
               "-ts_max_time", repr(steps * 0.01), "-bs_output", folder / "b1.h5md", "-bs_overwrite", "-bs_output_interval", repr(steps * 0.01)]
    before = processor_time()
    subprocess.run(list(map(str, command)), env=environment(1), stdout=subprocess.DEVNULL, check=True)
    return processor_time() - before


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(HERE.parents[1] / "build" / "release" / "backspring"))
    parser.add_argument("--size", type=int, default=40)
    parser.add_argument("--steps", default="2,12")
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    for name in ("OMPI_MCA_mpi_yield_when_idle", "OMPI_MCA_hwloc_base_binding_policy"):
        os.environ.pop(name, None)
    few, many = (int(one) for one in given.steps.split(","))
    program, times = str(pathlib.Path(given.program).resolve()), []
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        for _ in range(given.rounds):
            times.append([by_program(program, given.size, few, folder), by_program(program, given.size, many, folder), in_python(program, given.size, few, many, folder)])
            print("program, {} and {} steps: {:.3f} and {:.3f} s; Python, those between: {:.3f} s".format(few, many, *times[-1]), flush=True)
        with h5py.File(folder / "b1.h5md") as f:
            same = np.array_equal(f["particles/trajectory/position/value"][-1], np.load(folder / "x.npy"))
    short, long, ours = np.min(times, axis=0)
    print(f"of the least times: {(long - short) / (many - few):.4f} s a step by the program, {ours / (many - few):.4f} in Python, {ours / (long - short):.3f} of it; positions after {many} steps: {'the same in every bit' if same else 'OTHERS'}")
    sys.exit(0 if same else 1)


if __name__ == "__main__":
    main()
