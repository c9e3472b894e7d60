"""Frames of a trajectory against the same bytes written raw: collective HDF5, and MPI-IO."""
import json
import pathlib
import statistics
import tempfile
import time

import cases
from running import Failed, execute, program

FRAMES = 6
# A virtual machine hands memory that was free for seconds back to its host, and pays for every page of it again: the raw
# writes took 0.04 s a frame right after other runs and 0.15 s after a rest. The program's start takes seconds, so all rest.
REST = 4  # s


def frame_cost(context, n, ranks):
    """Seconds a frame, flushed to disk like those of raw_write, costs the program, of these in the observables and in writing fields: a run with a
    frame at every step less the same run with the first and the last. Forces that came with a frame's energies the next step does not compute."""
    runs = {}
    for interval in (0, 1):  # [s]; 1 is beyond the end
        options = dict(cases.problem("B1", n, 1e-6, 1 + FRAMES), ts_type="symplectic", bs_advise=0, bs_output="run.h5md", bs_output_flush=0,
                       bs_output_interval=interval, bs_energy_growth=0)  # which looks at the first steps without a frame, too
        time.sleep(REST)
        runs[interval] = program(context, options, ranks)

    def of(*keys):
        return sum(sign * runs[interval]["events"].get(key, {"time": 0})["time"] for interval, sign in ((0, 1), (1, -1)) for key in keys)
    wall = runs[0]["report"]["wall"] - runs[1]["report"]["wall"]
    return wall / FRAMES, of("BSEnergies", "BSForces") / FRAMES, of("BSWrite") / FRAMES


def raw_cost(context, n, ranks, mode):
    """Median seconds a frame of raw_write takes, flushed like the program's."""
    with tempfile.TemporaryDirectory(prefix="bench_", dir=context.scratch) as folder:
        time.sleep(REST)
        out, _, _ = execute([context.peers / "raw_write", "raw.bin", "--particles", cases.particles(n), "--frames", FRAMES + 1, "--mode", mode],
                            ranks, context.budget.limit(), pathlib.Path(folder))
    return statistics.median(json.loads(out)["seconds"][1:])


def run(context, missing):
    """[{ranks, particles, bytes, s_per_frame, s_observables, s_fields, raw_hdf5, raw_mpiio}]: medians of repeats."""
    rows, n = [], context.output_n
    for ranks in context.ranks:
        row = {"ranks": ranks, "particles": cases.particles(n), "bytes": 48 * cases.particles(n)}
        rows.append(row)
        try:
            if "raw_write" in missing:
                raise Failed(missing["raw_write"])
            found = []
            for _ in range(context.repeats):  # in turns, so that a slow moment of the disk meets all
                found.append((*frame_cost(context, n, ranks), raw_cost(context, n, ranks, 0), raw_cost(context, n, ranks, 1)))
            for key, values in zip(("s_per_frame", "s_observables", "s_fields", "raw_hdf5", "raw_mpiio"), zip(*found)):
                row[key] = statistics.median(values)
            context.say(f"output, {ranks} rank(s): {row['s_per_frame']:.4g} s a frame, raw HDF5 {row['raw_hdf5']:.4g} s, MPI-IO {row['raw_mpiio']:.4g} s")
        except Failed as why:
            row["failed"] = str(why)
            context.say(f"output, {ranks} rank(s): {why}")
    return rows
