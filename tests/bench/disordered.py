#!/usr/bin/env python3
"""Statics of disordered nets: the program by default, by options tuned by hand, and beside other methods. Writes disordered.json and disordered.md into this folder (or -o FOLDER).

  disordered.py --program build/release/backspring [--nets plate_0.72,shear_2] [--variants "default,CG with bicc"] [-o FOLDER]
  disordered.py --program build/release/backspring --check

plate_P: a triangular plate of 50 x 50 particles, bonds present with the probability P, a notch to 0.4 of its width; its upper row is pulled by 4 in 40 load steps. shear_SEED: a
periodic triangular net of 40 x 40 particles of which 42 % of the springs have stiffness 1, the others 0, floppy at first, sheared by 0.2 in the first 20 of 60 load steps of 0.01
each. pushed_SEED: such a net of 30 x 30 with 36 %, whose springs are 0.5 % too long, comes to rest. pulled: the net of statics.py, one load step. Springs are linear, of stiffness 1,
at rest at the start (those of `pulled` at rest before the pull).

A load step is met where the 2-norm of the forces on the free particles, computed by NumPy at the places found, has fallen to 1e-8 of that at its beginning: at the last places,
with what is driven, or moved affinely with the box. The program works to its own tolerances (1e-12, or the rounding errors of its forces); the others stop at 1e-8. They are in
disordered_peers.py and share forces by sparse products in NumPy, without the springs of stiffness 0. A load step is unstable where factors of the tangent plus 1e-8 have negative
pivots, judged alike for all. Times are user and system times of one process; of the program's, that of a run of three particles is taken away, of the others nothing but solving is
counted. The default is run first and last, the shorter time counts. Where springs of stiffness 0 can be left out, all options but the default's run without them. Options are
stopped after 1.3 times the time of the default or twice that of the quickest so far (3 s at least), peers after 1.5 times the default's (10 s at least); beside a peer that was
stopped stands its share of the default's time for the load steps that it came through. Methods find different equilibria, so that energies differ; in the sheared nets rounding
alone leads to others: the rows "default" and "springs of stiffness 0 left out" differ by nothing else."""
import argparse
import contextlib
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE.parent / "verify"))  # behind this folder, whose statics.py is meant
import h5py
import numpy as np
from disordered_peers import PEERS, SpringNet
from harness import write_lattice
from program import environment
from statics import diluted_net, start_up

GOAL, JUDGED = 1e-8, 1e-8
BARE = "springs of stiffness 0 left out"
DIRECT = "-condensed_ksp_type preonly -condensed_pc_type cholesky -condensed_pc_factor_mat_solver_type "
TUNED = {"default": "", BARE: "", "any equilibrium": "-bs_equilibria any", "MUMPS": DIRECT + "mumps", "PETSc's Cholesky": DIRECT + "petsc",
         "CG with bicc": "-condensed_ksp_type cg -condensed_pc_type bicc", "exact tangent": "-bs_tangent exact", "definite tangent": "-bs_tangent definite",
         "search bt": "-snes_linesearch_type bt", "search basic": "-snes_linesearch_type basic", "search guarded": "-snes_linesearch_type guarded",
         "trust region": "-snes_type newtontr", "pseudo time at once": "-snes_max_it 1", "pseudo time after 10": "-snes_max_it 10"}


def plate(n, p, seed):
    """Positions, pairs, rows below and above of a diluted triangular plate with a notch from the left."""
    x = np.array([[i + 0.5 * (j % 2), 0.75**0.5 * j] for j in range(n) for i in range(n)])
    rng, pairs = np.random.default_rng(seed), []
    for j in range(n):
        for i in range(n):
            for a, b in ((i + 1, j), (i + j % 2, j + 1), (i - 1 + j % 2, j + 1)):
                if 0 <= a < n and b < n and rng.random() < p:
                    pairs.append((j * n + i, b * n + a))
    pairs, half = np.array(pairs), 0.75**0.5 * (n - 1) / 2 + 1e-3
    a, b = x[pairs[:, 0]], x[pairs[:, 1]]
    pairs = pairs[~(((a[:, 1] - half) * (b[:, 1] - half) < 0) & ((a[:, 0] + b[:, 0]) / 2 < 0.4 * n))]
    tied = np.bincount(pairs.ravel(), minlength=n * n) > 0
    number, row = np.cumsum(tied) - 1, np.arange(n * n) // n
    return x[tied], number[pairs], number[np.flatnonzero(tied & (row == 0))], number[np.flatnonzero(tied & (row == n - 1))]


def bare(path, kept):
    """The lattice with these springs alone."""
    other = path.with_name("bare_" + path.name)
    with h5py.File(path) as f, h5py.File(other, "w") as g:
        for name in f:
            f.copy(name, g)
        for name in f["springs"]:
            del g["springs"][name]
            g["springs"][name] = f["springs"][name][...][kept]
    return other


class Case:
    """A net in a file, the option that loads it, with how much of that a load step adds, how many load steps are made, and where they begin."""

    def __init__(self, path, options, a_step, steps, shear=0.0):
        self.path, self.load, self.a_step, self.steps, self.shear = path, options, a_step, steps, shear
        with h5py.File(path) as f:
            self.x = f["particles/position"][:, :2]
            pairs, stiffness = f["springs/pairs"][...], f["springs/stiffness"][...]
            self.edges = f["box/edges"][:2, :2] if "box" in f else np.zeros((2, 2))
            shift = f["springs/shift"][:, :2] if "springs/shift" in f else np.zeros((len(pairs), 2))
            r = self.x[pairs[:, 1]] - self.x[pairs[:, 0]] + shift @ self.edges
            rest = f["springs/rest_length"][...] if "springs/rest_length" in f else np.linalg.norm(r, axis=1)
            held = f["particles/fixed"][...] > 0 if "particles/fixed" in f else np.zeros(len(self.x), bool)
            self.driven = f["groups/up"][...] if "groups/up" in f else np.zeros(0, int)
            held[self.driven] = True
            if "groups/lo" in f:
                held[f["groups/lo"][...]] = True
        there = stiffness > 0
        self.bare = None if there.all() else bare(path, there)
        self.net = SpringNet(pairs[there], stiffness[there], rest[there], shift[there], ~held)

    def options(self, steps):
        """For the first load steps alone."""
        return f"{self.load.format(self.a_step * steps)} -bs_load_steps {steps}".split()

    def box(self, n):
        """Edges after n load steps: rows, each followed by the shear of a load step."""
        return self.edges @ np.array([[1, 0], [self.shear * n, 1]])

    def moved(self, n, x):
        """Where load step n begins: (places, edges)."""
        y = x.copy()
        if self.edges.any():
            y = x @ np.array([[1, 0], [self.shear, 1]])
        y[self.driven] = self.x[self.driven] + [0, 0.1 * n]
        return y, self.box(n)


def make_case(name, program, folder):
    path = folder / f"{name}.h5"
    if name == "pulled":
        x, held, pairs = diluted_net()
        return Case(write_lattice(path, x, 1.0, fixed=held, pairs=pairs, stiffness=1.0, rest_length=1.0), "", 0, 1)
    if name.startswith("shear_"):
        words = ("-bs_task generate -bs_lattice_type triangular -bs_lattice_size 40,40 -bs_lattice_periodic xy -bs_lattice_dim 2 -bs_lattice_stiffness 1 "
                 "-bs_lattice_stiff_fraction 0.42 -bs_lattice_stiff_factor 0 -bs_lattice_seed").split()
        subprocess.run([program, *words, name[6:], "-bs_output", path], env=environment(1), capture_output=True, check=True)
        return Case(path, "-bs_box_strain xy=velocity:{}", 0.01, 20, 0.01)
    if name.startswith("pushed_"):
        words = ("-bs_task generate -bs_lattice_type triangular -bs_lattice_size 30,30 -bs_lattice_periodic xy -bs_lattice_dim 2 -bs_lattice_stiffness 1 "
                 "-bs_lattice_stiff_fraction 0.36 -bs_lattice_stiff_factor 0 -bs_lattice_rest_length_factor 1.005 -bs_lattice_seed").split()
        subprocess.run([program, *words, name[7:], "-bs_output", path], env=environment(1), capture_output=True, check=True)
        return Case(path, "", 0, 1)
    p = float(name.split("_")[1])
    x, pairs, low, up = plate(50, p, 15 if p == 0.72 else 1)
    write_lattice(path, x, 1.0, pairs=pairs, stiffness=1.0)
    with h5py.File(path, "r+") as f:
        f["groups/lo"], f["groups/up"] = low, up
    return Case(path, "-bs_motion_lo fixed -bs_motion_up x=fixed,y=velocity:{}", 0.1, 40)


def judge(case, states):
    """What NumPy finds at the places after each load step."""
    met = unstable = 0
    worst = energy = 0.0
    before = case.x
    for n, x in enumerate(states, 1):
        y, edges = case.moved(n, before)
        first = np.linalg.norm(case.net.forces(case.net.place(y, edges))[0])
        z = case.net.place(x, edges)
        f, energy = case.net.forces(z)
        left = np.linalg.norm(f) / first
        met, worst = met + (left <= GOAL), max(worst, left)
        unstable += case.net.factor(case.net.tangent(z), JUDGED)[1] > 0
        before = x
    return {"steps": len(states), "not_met": len(states) - int(met), "worst": float(worst), "unstable": int(unstable), "energy": energy}


def processor_time():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def call(command, folder, limit):
    """The exit code; where it takes more processor time than the limit [s], it is ended. (RLIMIT_CPU counts time that a virtual machine was not given, too.)"""
    process = subprocess.Popen(command, cwd=folder, env=environment(1), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None:
        with contextlib.suppress(OSError):
            fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
            if limit and (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK") > limit:
                process.kill()
        time.sleep(0.01)
    return process.returncode


def run(program, case, folder, label, steps, limit, least):
    """A row of the program's."""
    (folder / "d.json").unlink(missing_ok=True)
    before = processor_time()
    path = case.path if label == "default" else case.bare or case.path
    code = call([program, "-bs_task", "statics", "-bs_lattice_file", str(path), *case.options(steps), "-bs_output", "d.h5md", "-bs_overwrite", "-bs_report", "d.json",
                 *TUNED[label].split()], folder, limit)
    used, report, states = processor_time() - before, {}, []
    with contextlib.suppress(OSError, ValueError, KeyError):
        report = json.loads((folder / "d.json").read_text())
        with h5py.File(folder / "d.h5md") as f:
            at = {round(t * steps): k for k, t in enumerate(f["particles/trajectory/position/time"][...]) if abs(t * steps - round(t * steps)) < 1e-6}  # others: of steps that were cut
            for n in range(1, steps + 1):
                states.append(f["particles/trajectory/position/value"][at[n], :, :2])
    why = "" if code == 0 else "stopped" if limit and code < 0 else f"exit code {code}"
    counts = {"newton": "newton", "pseudo": "pseudo_transient", "saddles": "saddle_points", "unknown": "stability_unknown", "factors": "condensed_refreshed", "cut": "rejected"}
    return {"time": used - least, **{key: report.get(name) for key, name in counts.items()}, "why": why, **judge(case, states)}


def follow(case, solve, limit):
    """A row of a peer's, which goes on from where a load step ended, met or not, until its time is over."""
    net, x, states, count = case.net, case.x, [], 0
    net.evaluations = net.factors = 0
    started = time.process_time()
    while len(states) < case.steps and time.process_time() < started + limit:
        y, edges = case.moved(len(states) + 1, x)
        z = net.place(y, edges)
        z, more = solve(net, z, GOAL * np.linalg.norm(net.forces(z)[0]), started + limit)
        count += more
        if time.process_time() < started + limit:
            x = net.at(z).copy()
            states.append(x)
    used, evaluations, factors = time.process_time() - started, net.evaluations, net.factors
    return {"time": used, "iterations": count, "evaluations": evaluations, "factors": factors, "why": "" if len(states) == case.steps else "stopped", **judge(case, states)}


def measure(program, name, folder, least, variants):
    case = make_case(name, program, folder)
    print(f"{name}: {len(case.net.pairs)} springs", flush=True)
    rows, default, limit = [], None, None
    for label in variants:
        if label == BARE and not case.bare:
            continue
        row = run(program, case, folder, label, case.steps, limit, least)
        default = default or row["time"]
        if not row["why"] and not row["not_met"]:
            limit = max(3, min(limit or np.inf, 1.3 * default, 2 * row["time"]))
        rows.append({"by": label, "options": TUNED[label], **row})
        print(rows[-1], flush=True)
    again = run(program, case, folder, variants[0], case.steps, None, least)["time"]
    default = rows[0]["time"] = min(default, again)
    for label, solve in PEERS.items():
        row = follow(case, solve, max(10, 1.5 * default))
        row["default"] = default if row["steps"] == case.steps else run(program, case, folder, "default", row["steps"], None, least)["time"] if row["steps"] else None
        rows.append({"by": label, **row})
        print(rows[-1], flush=True)
    return {"springs": len(case.net.pairs), "load_steps": case.steps, "rows": rows}


def check(program, folder):
    """What disagrees about the net that has one equilibrium near its start."""
    found = measure(program, "pulled", folder, 0.0, ["default", "search basic"])
    print(document({"pulled": found}))
    rows, energy = found["rows"], found["rows"][0]["energy"]
    return [f"{r['by']}: {r}" for r in rows if r["why"] or r["steps"] != 1 or r["not_met"] or r["unstable"] or abs(r["energy"] - energy) > 1e-9 * energy]


NOTES = {"pseudo": "by pseudo time", "saddles": "saddle points left", "cut": "attempts cut", "unknown": "stability unknown"}


def cell(value):
    return "" if value is None else f"{value:,}"


def net_lines(name, found):
    rows = found["rows"]
    default, tuned = rows[0]["time"], [r for r in rows if "options" in r]
    good = [r for r in tuned if not r["why"] and r["steps"] == found["load_steps"] and r["not_met"] == 0]
    best = min(good, key=lambda r: r["time"], default=None)
    lines = ["", f"## {name}: {found['springs']:,} springs, load steps: {found['load_steps']}", "",
             "| by | time [s] | of the default's for the same load steps | iterations | factorisations | evaluations | load steps | not met | largest residual | unstable | last energy | |",
             "|---|---|---|---|---|---|---|---|---|---|---|---|"]
    for r in rows:
        took = f"{'> ' if r['why'] == 'stopped' else ''}{r['time']:.2f}"
        same = default if "options" in r else r["default"]
        share = f"{r['time'] / same:.2f}" if same and r["steps"] and (r["steps"] == found["load_steps"] or "options" not in r) else ""
        notes = [r["why"], *(f"{name}: {r[key]}" for key, name in NOTES.items() if r.get(key))]
        judged = f"{r['not_met']} | {r['worst']:.1e} | {r['unstable']} | {r['energy']:.7g}" if r["steps"] else " | | |"
        lines.append(f"| {r['by']} | {took} | {share} | {cell(r.get('newton', r.get('iterations')))} | {cell(r.get('factors'))} | {cell(r.get('evaluations'))} | {r['steps']} | "
                     f"{judged} | {'; '.join(note for note in notes if note)} |")
    if best:
        lines += ["", f"The default takes {default / best['time']:.2f} times what the best options ({best['by']}{': `' + best['options'] + '`' if best['options'] else ''}) take."]
    return lines


def document(found):
    lines = ["# Statics of disordered nets", "", "Measured by `tests/bench/disordered.py`, which says what the nets are and what is compared. Rows that name options are of the program."]
    for name in sorted(found):
        lines += net_lines(name, found[name])
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--program", default=str(HERE.parents[1] / "build" / "release" / "backspring"))
    parser.add_argument("--nets", default="plate_0.72,plate_0.8,plate_0.9,shear_1,pushed_1,pulled", help="those that are measured; the files keep what they hold of others")
    parser.add_argument("--variants", default=",".join(TUNED), help="of the program, the default first")
    parser.add_argument("-o", type=pathlib.Path, default=HERE)
    parser.add_argument("--check", action="store_true", help="small: all methods find the same equilibrium of one net; nothing is written")
    arguments = parser.parse_args()
    for name in ("OMPI_MCA_mpi_yield_when_idle", "OMPI_MCA_hwloc_base_binding_policy"):
        os.environ.pop(name, None)  # they slow MUMPS on one rank
    kept = arguments.o / "disordered.json"
    found = json.loads(kept.read_text()) if kept.exists() else {}
    with tempfile.TemporaryDirectory() as scratch:
        folder, program = pathlib.Path(scratch), str(pathlib.Path(arguments.program).resolve())
        if arguments.check:
            sys.exit("\n".join(check(program, folder)) or 0)
        least = min(start_up(program, folder, processor_time) for _ in range(5))
        for name in arguments.nets.split(","):
            found[name] = measure(program, name, folder, least, arguments.variants.split(","))
            kept.write_text(json.dumps(found, indent=1) + "\n")
            (arguments.o / "disordered.md").write_text(document(found))


if __name__ == "__main__":
    main()
