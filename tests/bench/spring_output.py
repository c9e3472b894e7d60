#!/usr/bin/env python3
"""What tension and strain of every spring cost in the frames of a trajectory: time per byte written, of frames with them over frames without.

  spring_output.py --program build/release/backspring [--n 40] [--frames 30] [--repeats 5] [--ranks 1]

A run of explicit steps with a frame at every step less the same run with the first and the last, right after it; with and without springs by turns, so that slow moments meet both; the
median of some. Processor time is that of all ranks; the ratio is (seconds a byte with springs)/(seconds a byte without).
"""
import argparse
import json
import pathlib
import resource
import subprocess
import sys
import tempfile
from statistics import median

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from program import environment

REPO = pathlib.Path(__file__).resolve().parents[2]
WITHOUT, WITH = ("-bs_output_strain", "false"), ("-bs_output_springs",)


def cost(program, lattice, steps, ranks, words, folder):
    """(processor time, wall-clock time) [s] of a run, and the bytes of its trajectory."""
    command = ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [program, *lattice, *words, "-ts_type", "symplectic", "-ts_dt", "1e-4", "-ts_max_time", "1", "-ts_max_steps", str(steps),
                                                                      "-bs_advise", "false", "-bs_energy_growth", "0", "-bs_output", "o.h5md", "-bs_overwrite", "-bs_progress_interval", "-1", "-bs_report", "r.json"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, cwd=folder, env=environment(ranks), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, json.loads((folder / "r.json").read_text())["wall"]), (folder / "o.h5md").stat().st_size


def measure(program, lattice, frames, repeats, ranks):
    """{"without": (processor time, wall-clock time), "with": ...} of a frame [s], and bytes a frame of each."""
    seconds, size = {}, {}
    with tempfile.TemporaryDirectory(prefix="spring_output_") as scratch:
        for _ in range(repeats):
            for name, words in (("without", WITHOUT), ("with", WITH)):
                for kind, more in (("all", ()), ("two", ("-bs_output_interval", "9"))):
                    times, size[name, kind] = cost(program, lattice, frames + 1, ranks, (*words, *more), pathlib.Path(scratch))
                    seconds.setdefault((name, kind), []).append(times)
    names = ("without", "with")
    return ({name: [median((a - b) / frames for a, b in zip(*both)) for both in zip(zip(*seconds[name, "all"]), zip(*seconds[name, "two"]))] for name in names},
            {name: (size[name, "all"] - size[name, "two"]) / frames for name in names})


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(REPO / "build" / "release" / "backspring"))
    parser.add_argument("--n", type=int, default=40, help="particles along an edge of the cube")
    parser.add_argument("--neighbors", default="6,18")
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--ranks", type=int, default=1)
    arguments = parser.parse_args()
    program = str(pathlib.Path(arguments.program).resolve())
    print("| springs to | frames | MB | processor time [ms] | ns/byte | wall-clock time [ms] | ns/byte |\n|---|---|---|---|---|---|---|")
    for neighbors in arguments.neighbors.split(","):
        lattice = ["-bs_lattice_type", "cubic", "-bs_lattice_size", ",".join([str(arguments.n)] * 3), "-bs_lattice_neighbors", neighbors, "-bs_lattice_stiffness", "100", "-bs_lattice_velocity", "1,0,0",
                   "-bs_lattice_velocity_gradient", "0,1,0,0,0,0,0,0,0"]
        seconds, size = measure(program, lattice, arguments.frames, arguments.repeats, arguments.ranks)
        rate = {}
        for name, (processor, wall) in seconds.items():
            rate[name] = [1e9 * s / size[name] for s in (processor, wall)]
            print(f"| {neighbors} | {name} | {1e-6 * size[name]:.2f} | {1e3 * processor:.2f} | {rate[name][0]:.3f} | {1e3 * wall:.2f} | {rate[name][1]:.3f} |")
        print(f"| | ratio | | | {rate['with'][0] / rate['without'][0]:.2f} | | {rate['with'][1] / rate['without'][1]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
