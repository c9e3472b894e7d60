#!/usr/bin/env python3
"""Steps that fail: cut, counted by reason, never written; a floor; hard states that a careless step would lie about."""
import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import h5py
import numpy as np
from runs import BLOCK, frames, run, run_parts, told, write_lattice

# one way to make each kind of failure happen in a block of springs that is otherwise well
FAILURES = [
    ("iterations", {"snes_max_it": 2, "snes_rtol": 1e-12}),
    ("linear", {"ksp_type": "gmres", "pc_type": "none", "ksp_max_it": 40, "ksp_rtol": 1e-10}),
    ("newton", {"snes_divergence_tolerance": 1.5, "bs_lattice_perturbation": 0.09, "snes_linesearch_type": "guarded"}),
    ("error", {"ts_adapt_type": "basic", "ts_rtol": 1e-6, "bs_atol_x": 1e-5, "bs_atol_v": 1e-2, "bs_step_first": 0.01}),
]
IMPLICIT = (("beuler", {}), ("cn", {}), ("theta", {}), ("bdf", {"ts_adapt_type": "none"}), ("alpha2", {}), ("rosw", {"ts_adapt_type": "none"}),
            ("arkimex", {"ts_adapt_type": "none"}))


def report(folder):
    return json.loads((folder / "r.json").read_text())


def counted(checks, folder):
    """Every rejection has a reason; report, log and progress line agree; what is written are the accepted steps."""
    base = dict(BLOCK, ts_dt=0.02, ts_max_time=0.06, bs_output_interval=0.02, bs_output="run.h5md", bs_overwrite=True, bs_report="r.json",
                bs_progress_interval=0, bs_step_max_cuts=20)
    for reason, options in FAILURES:
        code, out, err = run(checks, folder, dict(base, **options))
        said = report(folder)
        n, by = said["rejected"], {k: said["rejected_" + k] for k in ("newton", "line_search", "iterations", "linear", "domain", "error")}
        checks.true(f"{reason}: met, and the run ends well", code == 0 and by[reason] > 0, f"{by} {err.strip()[:150]}")
        with h5py.File(folder / "run.h5md") as f:
            log = {k: v[...] for k, v in f["backspring/log"].items()}
        checks.true(f"{reason}: report = log", all(log["rejected_" + k].sum() == by[k] for k in by) and log["rejected"].sum() == n == sum(by.values()))
        checks.true(f"{reason}: named in progress and summary", f"rejected {n} (" in out and f"{n} attempt{'s' if n > 1 else ''} rejected" in out)
        checks.true(f"{reason}: the log's steps add up to the accepted time", abs(log["dt"].sum() - log["time"][-1]) < 1e-12 and (np.diff(log["time"]) > 0).all())
        with h5py.File(folder / "run.h5md") as f:
            time = f["particles/trajectory/position/time"][...]
        checks.near(f"{reason}: output times hit", time, np.arange(4) * 0.02, 1e-12)
    code, out, err = run(checks, folder, dict(base, snes_linesearch_type="bt", snes_linesearch_alpha=0.9, snes_linesearch_minlambda=0.3, bs_lattice_perturbation=0.09))
    said = report(folder)
    checks.true("line search: asked for too much, counted, and told at the end", code == 3 and said["rejected_line_search"] == said["rejected"] == 21 and "line search found no smaller residual" in err, err.strip()[:150])
    wild = dict(base, ts_type="beuler", ts_dt=0.5, ts_max_time=3, bs_output_interval=0.5)
    write_lattice(folder / "cross.h5", [[0.0], [1.0]], 1.0, velocity=[[1.0], [-1.0]], pairs=[[0, 1]], stiffness=1e-30, rest_length=1.0)
    for unused in ("bs_lattice_type", "bs_lattice_size", "bs_lattice_spacing", "bs_lattice_fixed", "bs_lattice_stiffness", "bs_spring_law", "bs_gravity", "bs_lattice_perturbation"):
        wild[unused] = None
    code, out, err = run(checks, folder, dict(wild, bs_lattice_file="cross.h5", snes_linesearch_type="basic"))
    said = report(folder)
    checks.true("domain: two ends that meet exactly: the spring is named and passed by", code == 0 and said["rejected_domain"] > 0 and "spring 0 reached zero length" in out, f"{said['rejected']} {out.strip()[-300:]}")
    with h5py.File(folder / "run.h5md") as f:
        x = f["particles/trajectory/position/value"][-1, :, 0]
    checks.near("domain: and the ends are where free flight takes them", x, np.array([3.0, -2.0]), 1e-7)


def every_type(checks, folder):
    """Rejections in the first step, for every implicit type: the state that is restored is the initial one, bit for bit,
    since the attempt that is accepted is the first step of a run that began with its length."""
    base = dict(BLOCK, ts_max_time=0.02, bs_output_interval=0, bs_overwrite=True, bs_report="r.json", bs_step_max_cuts=12)
    for name, options in IMPLICIT:
        # rosw solves no nonlinear equation
        fail = {"ts_adapt_type": "basic", "ts_rtol": 1e-7, "ts_atol": 1e-7} if name == "rosw" else {"snes_max_it": 2, "snes_rtol": 1e-9}
        code, out, err = run(checks, folder, dict(base, ts_type=name, ts_max_steps=2, bs_output="cut.h5md", **{**options, **fail}))
        rejected = report(folder)["rejected"]
        with h5py.File(folder / "cut.h5md") as f:
            h, tries = f["backspring/log/dt"][0], f["backspring/log/rejected"][0]
            a = [f["particles/trajectory/" + k + "/value"][1] for k in ("position", "velocity")]
        checks.true(f"{name}: {rejected} rejected, {tries} of them in the first step", code == 0 and tries > 0, f"h = {h:g} {err.strip()[:150]}")
        if name != "rosw":
            checks.near(f"{name}: cut to a quarter each time", h, 0.01 * 0.25**tries, 1e-15)
        run(checks, folder, dict(base, ts_type=name, ts_dt=float(h), ts_max_steps=1, bs_output="small.h5md", **{**fail, **options}))
        with h5py.File(folder / "small.h5md") as f:
            b = [f["particles/trajectory/" + k + "/value"][1] for k in ("position", "velocity")]
        checks.true(f"{name}: the state before the rejections is restored in every bit", all(np.array_equal(p, q) for p, q in zip(a, b)) and report(folder)["rejected"] == 0)


def floor(checks, folder):
    """At the floor: exit 3, one line with reason, time and remedy; the last good frame and a checkpoint, from which milder
    options go on."""
    for ranks in (1, 2):
        for kind, options, words in (("Newton", {"snes_max_it": 1, "snes_rtol": 1e-13, "bs_step_min": 1e-3}, "-snes_max_it"),
                                     ("error estimate", {"ts_adapt_type": "basic", "ts_rtol": 1e-12, "ts_atol": 1e-12, "bs_step_min": 1e-3}, "-ts_rtol"),
                                     ("cap on cuts", {"snes_max_it": 1, "snes_rtol": 1e-13, "bs_step_max_cuts": 3}, "rejected 4 times")):
            for old in folder.glob("run*"):
                old.unlink()
            code, _, err = run(checks, folder, dict(BLOCK, ts_max_time=0.1, bs_output="run.h5md", bs_report="r.json", bs_overwrite=True, **options), ranks)
            lines, name = told(err), f"{kind}, {ranks} rank(s)"
            checks.true(f"{name}: exit 3, one line with time and remedy", code == 3 and len(lines) == 1 and words in lines[0] and "t = " in lines[0] and "try " in lines[0], f"exit {code} {' '.join(lines)[:200]}")
            saved = folder / "run.h5md.checkpoint"
            checks.true(f"{name}: a frame and a checkpoint of the last good state", frames(folder / "run.h5md") >= 1 and saved.exists())
            with h5py.File(folder / "run.h5md") as f, h5py.File(saved) as c:
                checks.true(f"{name}: both are the same state", np.array_equal(f["particles/trajectory/position/value"][-1], c["state/position"][...])
                            and f["particles/trajectory/position/time"][-1] == c["run"].attrs["time"] == report(folder)["t"])
            mild = {"snes_max_it": 50, "snes_rtol": 1e-8, "ts_adapt_type": "none", "bs_step_min": 0, "bs_step_max_cuts": 10}
            code, _, err = run(checks, folder, dict(mild, bs_restart=saved.name), ranks)
            checks.true(f"{name}: milder options go on from there", code == 0 and frames(folder / "run.h5md") == 5, f"exit {code} {err.strip()[:150]}")
    explicit = dict(BLOCK, ts_type="euler", bs_lattice_stiffness=4e9, ts_max_time=10, bs_output_interval=0.05, bs_output="blow.h5md")
    code, _, err = run(checks, folder, explicit)
    with h5py.File(folder / "blow.h5md") as f:
        x, energy = f["particles/trajectory/position/value"][-1], f["observables/total_energy/value"][-1]
        checks.true("explicit overflow: the last frame is the last in which everything is finite", code == 3 and np.isfinite(x).all() and np.isfinite(energy).all(), err.strip()[:150])
    checks.true("explicit overflow: no checkpoint of a state without finite energies", not (folder / "blow.h5md.checkpoint").exists())


def blind(checks, folder):
    """Backward Euler's estimate needs a step before: under error control the first step is a thousandth of -ts_dt."""
    base = dict(BLOCK, ts_type="beuler", ts_adapt_type="basic", ts_rtol=1e-4, bs_atol_x=1e-4, bs_atol_v=1e-2, ts_dt=0.05, ts_max_time=0.02,
                bs_output_interval=0.02, bs_overwrite=True)
    ends = {}
    for name, options in (("default", {}), ("bold", {"bs_step_first": 0.02}), ("exact", {"ts_adapt_type": "none", "ts_dt": 1e-5})):
        code, _, err = run(checks, folder, dict(base, bs_output=name + ".h5md", **options))
        with h5py.File(folder / (name + ".h5md")) as f:
            ends[name] = f["particles/trajectory/position/value"][-1], f["backspring/log/dt"][0]
        checks.true(f"first step, {name}: ends", code == 0, err.strip()[:100])
    checks.near("first step: a thousandth of -ts_dt", ends["default"][1], 5e-5, 1e-12)
    error = {k: np.abs(ends[k][0] - ends["exact"][0]).max() for k in ("default", "bold")}
    checks.true("first step: a full one would go wrong unseen", error["default"] < 0.5 * error["bold"], f"errors {error['default']:.2g} and {error['bold']:.2g} m")


def tolerances(checks, folder):
    """A tighter tolerance of x alone, of v alone, makes smaller steps; each acts on its own."""
    base = dict(BLOCK, ts_type="bdf", ts_max_time=0.02, ts_rtol=1e-30, ts_atol=1.0, bs_report="r.json", bs_overwrite=True)
    steps = {}
    for name, options in (("loose", {}), ("x", {"bs_atol_x": 1e-6}), ("v", {"bs_atol_v": 1e-3}), ("both", {"bs_atol_x": 1e-6, "bs_atol_v": 1e-3}),
                          ("as one", {"bs_atol_x": 1.0, "bs_atol_v": 1.0})):
        code, _, err = run(checks, folder, dict(base, **options))
        steps[name] = report(folder)["steps"] if code == 0 else None
    checks.true("tolerances of x and v act apart", None not in steps.values() and steps["x"] > steps["loose"] and steps["v"] > steps["loose"] and steps["both"] >= max(steps["x"], steps["v"])
                and steps["as one"] == steps["loose"], str(steps))
    code, _, err = run(checks, folder, {"bs_model": "linear", "bs_linear_type": "rlc", "bs_atol_x": 1})
    checks.true("a linear system has no x and v", code == 2 and "apply to particles only" in "".join(told(err)), err.strip()[-120:])


if __name__ == "__main__":
    run_parts(__doc__, (counted, every_type, floor, blind, tolerances))
