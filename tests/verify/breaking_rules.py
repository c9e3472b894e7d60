#!/usr/bin/env python3
"""Springs that break, the rules one by one: which of equal springs goes first, notches, the work of plastic springs, what is whole again after an
avalanche that found no end, restarts between avalanches, the same motion after a break on any number of ranks."""
import math

from breaking import events, go, plate, ran, uniform, weibull
import h5py
from harness import run_parts, write_lattice
import numpy as np
from program import words


def ties(checks, folder):
    """Chains side by side, pulled apart: all springs of a chain are stretched alike up to rounding, and the first row of the input breaks; then its
    chain is slack. Chains whose limit is lower by more than the width of a tie, 1e-9, go before; by less, they do not."""
    chains, springs = 6, 7
    lengths = 1 + 0.1 * np.arange(springs) / 3  # strains are equal, rounding is not
    ends = np.concatenate([[0], np.cumsum(lengths)])
    points = springs + 1
    x = np.concatenate([ends + 0.1 * c for c in range(chains)])[:, None]
    near = np.array([(points * c + s, points * c + s + 1) for c in range(chains) for s in range(springs)])
    of, rest = np.repeat(np.arange(chains), springs), np.tile(lengths, chains)
    row = np.random.default_rng(3).permutation(len(near))
    low = {3: 1 - 1e-7, 1: 1 - 3e-10}  # by chain
    limit = 0.05 * np.array([low.get(c, 1.0) for c in of])
    # stiffness 1/L: the strains of springs in series are equal
    write_lattice(folder / "l.h5", x, 1.0, fixed=np.arange(len(x)) % points == 0, pairs=near[row], stiffness=1 / rest[row], rest_length=rest[row],
                  columns={"critical_strain": limit[row]})
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/far"] = np.flatnonzero(np.arange(len(x)) % points == springs)
    order = []
    for chain in [3] + [c for c in of[row] if c != 3]:
        if chain not in [of[row][s] for s in order]:
            order.append(int(np.flatnonzero(of[row] == chain)[0]))
    ran(checks, folder, {"bs_task": "statics", "bs_load_steps": 3, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_far": f"velocity:{0.06 * ends[-1]:.17g}",
                         "bs_break": "worst"})
    found = events(folder)
    checks.true("of equal springs the first row breaks", list(found["spring"]) == order, f"{list(found['spring'])} for {order}")
    checks.near("at one load", found["load"], 1.0, 1e-12)


def crosses(p, q, a, b):
    """Whether the segments pq and ab cross: the point of both lines lies within both."""
    try:
        s, t = np.linalg.solve(np.column_stack([q - p, a - b]), a - p)
    except np.linalg.LinAlgError:
        return False
    return 0 < s < 1 and 0 < t < 1


def notch(checks, folder):
    """A slanting line through a plate that ends within it: the springs across it are broken from the start, and the motion is in every bit that of a
    lattice which gives them as broken."""
    x, pairs, _ = plate(9, 8)
    a, b = np.array([1.3, 0.9]), np.array([5.2, 4.4])
    cut = np.array([crosses(x[i], x[j], a, b) for i, j in pairs])
    v = 0.1 * np.random.default_rng(6).standard_normal(x.shape)
    base = {"ts_type": "verlet", "ts_dt": 0.02, "ts_max_time": 2, "bs_output_interval": 1, "bs_lattice_file": str(folder / "l.h5")}
    write_lattice(folder / "l.h5", x, 1.0, velocity=v, pairs=pairs, stiffness=1.0, rest_length=1.0, damping=0.1)
    seen = []
    for options in ({"bs_break_notch": (*a, *b)}, {}):
        ran(checks, folder, {**base, **options})
        with h5py.File(folder / "b.h5md") as f:
            seen.append((f["backspring/broken/value"][0], f["particles/trajectory/position/value"][...], f["observables/momentum/value"][...]))
        write_lattice(folder / "l.h5", x, 1.0, velocity=v, pairs=pairs, stiffness=1.0, rest_length=1.0, damping=0.1, columns={"broken": cut.astype(float)})
    checks.true("springs across the notch", np.array_equal(seen[0][0] != 0, cut), f"{np.count_nonzero(seen[0][0])} of {len(pairs)}, {np.count_nonzero(cut)} cross it")
    checks.true("the motion is that with these springs given as broken", np.array_equal(seen[0][1], seen[1][1]))
    checks.near("momentum", seen[0][2], seen[0][2][0], 1e-13)


def scattered(checks, folder):
    """Fibres side by side between a wall and a plate that moves: each breaks at the first load at which its strain, force or energy passes its own limit times
    its own factor, limits of the lattice's columns as those of options. The plate's work, with springs that break at it, is what is stored and broken."""
    n, steps, pull, W = 24, 400, 1.2, 0.6
    rng = np.random.default_rng(8)
    k, own = rng.uniform(0.5, 2, n), rng.uniform(0.2, 0.4, n)
    spread = {"weibull": weibull(n, 3.0, 1), "uniform": np.array([1 + W * (2 * uniform(5, row) - 1) for row in range(n)])}
    statics, dynamics = {"bs_task": "statics", "bs_load_steps": steps}, {"ts_type": "verlet", "ts_dt": 1 / steps, "ts_max_time": 1}
    for kind, law, column, task in (("strain", "weibull", True, statics), ("force", "uniform", True, statics), ("energy", "weibull", True, dynamics), ("energy", "uniform", False, statics),
                                    ("strain", "weibull", False, dynamics)):
        limit = (own if column else 0.3) * spread[law]
        write_lattice(folder / "l.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=np.tile([0, 1], (n, 1)), stiffness=k, rest_length=1.0, columns={"critical_" + kind: own} if column else None)
        with h5py.File(folder / "l.h5", "a") as f:
            f["groups/plate"] = [1]
        ran(checks, folder, {**task, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_plate": f"velocity:{pull}", "bs_output_interval": 1 / steps,
                             "bs_break_" + law: "3,1" if law == "weibull" else f"{W},5", **({} if column else {"bs_break_" + kind: 0.3})})
        name = f"{kind} of the {'lattice' if column else 'options'}, {law}"
        u = {"strain": limit, "force": limit / k, "energy": np.sqrt(2 * limit / k)}[kind]
        step = np.ceil(u / pull * steps - 1e-9)
        order = [row for row in np.lexsort((np.arange(n), step)) if step[row] <= steps]
        found = events(folder)
        checks.true(f"{name}: springs in their order", list(found["spring"]) == order and n / 3 < len(order), f"{len(order)} of {n}")
        if list(found["spring"]) == order:
            checks.near(f"{name}: at their {'loads' if task is statics else 'times'}", found["load" if task is statics else "time"], step[order] / steps, 1e-12)
        with h5py.File(folder / "b.h5md") as f:
            checks.near(f"{name}: thresholds in the trajectory", f[f"connectivity/bonds_threshold_{kind}"][...] / limit, 1.0, 1e-14)
            s, work, pulled = (f[name][...].ravel() for name in ("particles/trajectory/position/time", "observables/work/plate/value", "observables/reaction/plate/value"))
        until = pull * np.where(step <= steps, step / steps, np.inf)
        held = np.minimum(pull * s[:, None], until)
        checks.near(f"{name}: work", work, (0.5 * k * held**2).sum(1), 1e-12)
        checks.near(f"{name}: reaction", pulled, (k * pull * s[:, None] * (pull * s[:, None] < until - 1e-12)).sum(1), 1e-12)


def sides(checks, folder):
    """A spring that is pulled or pushed past its strain, force or energy breaks where its side is asked for, and not else."""
    write_lattice(folder / "l.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=[[0, 1]], stiffness=2.0, rest_length=1.0)
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/end"] = [1]
    for kind, limit in (("strain", 0.1), ("force", 0.2), ("energy", 0.01)):
        broken = {}
        for side in ("tension", "compression", "both"):
            for pull in (0.15, -0.15):
                result = ran(checks, folder, {"bs_task": "statics", "bs_load_steps": 2, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_end": f"velocity:{pull}", "bs_break_in": side,
                                              "bs_break_" + kind: limit})
                broken[side, pull > 0] = result.report["broken_springs"]
        checks.true(f"{kind}: sides", broken == {(side, pulled): int(side in ("both", "tension" if pulled else "compression")) for side, pulled in broken}, f"{broken}")


def furthest(checks, folder):
    """The worst of springs that are past limits of several kinds: strains and forces count in proportion, energies by their square root."""
    k, pull = 2.0, 0.3
    force, energy = k * pull, 0.5 * k * pull**2
    for over in ((1.5, 1.2, 2.0), (1.5, 1.6, 2.0), (1.3, 1.2, 2.0), (1.1, 1.2, 1.15), (1.1, 1.05, 1.3)):
        columns = np.full((3, 3), np.inf)  # spring by limit
        np.fill_diagonal(columns, np.array([pull, force, energy]) / over)
        write_lattice(folder / "l.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=np.tile([0, 1], (3, 1)), stiffness=k, rest_length=1.0,
                      columns={f"critical_{kind}": columns[:, c] for c, kind in enumerate(("strain", "force", "energy"))})
        with h5py.File(folder / "l.h5", "a") as f:
            f["groups/end"] = [1]
        ran(checks, folder, {"bs_task": "statics", "bs_load_steps": 1, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_end": f"velocity:{pull}", "bs_break": "worst"})
        right = list(np.argsort([-over[0], -over[1], -math.sqrt(over[2])]))
        checks.true(f"strain {over[0]}, force {over[1]}, energy {over[2]} times its limit", list(events(folder)["spring"]) == right, f"{list(events(folder)['spring'])} for {right}")


def no_springs(checks, folder):
    """Springs that can exert no force are none. Springs of every law side by side are pulled past their limits: those of stiffness 0 do not break unless
    another term or a damper is left. And a diluted plate tears, in a notch and under load, as the plate without its springs of stiffness 0 does; these have
    no strain."""
    n, m, z = np.nan, 1.0, 0.0
    kinds = [("hooke", m, z, z, z, z, z), ("hooke", z, z, z, z, z, z), ("strain", z, z, z, z, z, z), ("tension", z, z, z, z, z, z), ("tension", m, z, z, z, z, z), ("polynomial", z, z, z, z, z, z),
             ("polynomial", z, m, z, z, z, z), ("polynomial", z, z, m, z, z, z), ("plastic", z, z, z, 0.1, 0.5, z), ("plastic", m, z, z, 0.1, 0.5, z), ("hooke", z, z, z, z, z, m), ("polynomial", z, z, z, z, z, m)]
    table = np.array([kind[1:] for kind in kinds])
    law = [kind[0] for kind in kinds]
    write_lattice(folder / "l.h5", [[0.0], [1.0]], 1.0, fixed=[1, 0], pairs=np.tile([0, 1], (len(kinds), 1)), stiffness=table[:, 0], rest_length=1.0, damping=table[:, 5], laws=law,
                  columns={"stiffness_2": table[:, 1], "stiffness_3": table[:, 2], "yield_force": table[:, 3], "hardening": table[:, 4]})
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/end"] = [1]
    there = np.array([k != 0 or d != 0 or (name == "polynomial" and (k2 != 0 or k3 != 0)) for name, k, k2, k3, _, _, d in kinds])
    for task in ({"bs_task": "statics", "bs_load_steps": 1}, {"ts_type": "beuler", "ts_dt": 0.25, "ts_max_time": 1, "bs_energy_growth": 0}):
        result = ran(checks, folder, {**task, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_end": "velocity:0.2", "bs_break_strain": 0.15})
        with h5py.File(folder / "b.h5md") as f:
            flags, strain, total = f["backspring/broken/value"][-1], f["backspring/strain/value"][0], f["observables/broken_springs/value"][-1]
        checks.true("of each law those break that there are", np.array_equal(flags != 0, there) and total == result.report["broken_springs"] == there.sum(), f"{flags}")
        checks.true("the others have no strain", np.array_equal(np.isfinite(strain), there), f"{strain}")
    x, pairs, held = plate(9, 8)
    k = np.where(np.random.default_rng(5).random(len(pairs)) < 0.15, 0.0, 1.0)
    k[(held[pairs]).any(axis=1)] = 1  # the grips stay tied
    seen = []
    for some in (np.arange(len(pairs)), np.flatnonzero(k)):
        write_lattice(folder / "l.h5", x, 1.0, fixed=held & (x[:, 1] == 0), pairs=pairs[some], stiffness=k[some], rest_length=1.0)
        with h5py.File(folder / "l.h5", "a") as f:
            f["groups/top"] = np.flatnonzero(x[:, 1] == x[:, 1].max())
        ran(checks, folder, {"bs_task": "statics", "bs_load_steps": 5, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_top": "x=fixed,y=velocity:0.8", "bs_break_strain": 0.08,
                             "bs_break_notch": (2.9, 3.1, 5.2, 3.2), "bs_output_interval": 0.2})
        found = events(folder)
        with h5py.File(folder / "b.h5md") as f:
            seen.append((some[found["spring"]], found["load"], some[np.flatnonzero(f["backspring/broken/value"][0])], f["observables/broken_springs/value"][...],
                         f["observables/broken_energy/value"][...], some[np.flatnonzero(np.isfinite(f["backspring/strain/value"][-1]))]))
    for name, a, b in zip(("springs", "loads", "springs of the notch", "count", "energy", "springs with a strain"), *seen):
        checks.true(f"a diluted plate: {name}", len(a) > 3 and np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=1e-9, atol=1e-12), f"{len(a)} and {len(b)}")


def plastic_work(checks, folder):
    """Two plastic springs are pulled together until the weaker one breaks: T - H e = Y while they yield, so that e = (k u - Y)/(k + H) and each has lost Y e;
    what the broken one lost is booked once and stays."""
    k, H, Y, steps, pull = 2.0, 0.5, 0.1, 20, 0.4
    write_lattice(folder / "l.h5", [[0.0], [0.0], [1.0]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=k, rest_length=1.0,
                  columns={"critical_strain": [0.25, np.inf]})
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/end"] = [2]
    ran(checks, folder, {"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_end": f"velocity:{pull}", "bs_spring_law": "plastic",
                         "bs_spring_yield_force": Y, "bs_spring_hardening": H, "bs_output_interval": 1 / steps})
    with h5py.File(folder / "b.h5md") as f:
        o = {name: f[f"observables/{name}/value"][...] for name in ("dissipated_energy", "broken_energy", "elastic_energy", "work/end")}
        s = f["observables/load_factor/value"][...]
    lost = Y * np.maximum(0, (k * pull * s - Y) / (k + H))
    at = events(folder)["load"][0]
    first = np.minimum(lost, Y * (k * pull * at - Y) / (k + H))
    checks.near("broken where the strain passes its limit", at, math.ceil(0.25 / pull * steps - 1e-9) / steps, 1e-12)
    checks.near("lost by both springs", o["dissipated_energy"], lost + first, 1e-14)
    u, e = pull * at, (k * pull * at - Y) / (k + H)
    checks.near("stored in the one that broke", o["broken_energy"][-1], 0.5 * k * (u - e) ** 2 + 0.5 * H * e * e, 1e-14)


def whole_again(checks, folder):
    """Two plastic fibres hold a weight that grows; the weaker one breaks, the other one cannot hold it: the run ends, and its last frame is that of the load
    before, the last one that both bear, with both whole, what they store (k (u - e)^2 + H e^2 of both) and what they have lost."""
    k, H, Y, steps, F = 2.0, 0.5, 0.1, 20, 0.71
    write_lattice(folder / "l.h5", [[0.0], [0.0], [1.0]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=k, rest_length=1.0, damping=0.1,
                  columns={"critical_strain": [0.5, 0.6]})
    result = ran(checks, folder, {"bs_task": "statics", "bs_load_steps": steps, "bs_lattice_file": str(folder / "l.h5"), "bs_gravity": F, "bs_spring_law": "plastic",
                                  "bs_spring_yield_force": Y, "bs_spring_hardening": H, "bs_output_interval": 1 / steps}, expect=3)
    with h5py.File(folder / "b.h5md") as f:
        last = {name: f[f"observables/{name}/value"][-1] for name in ("elastic_energy", "dissipated_energy", "broken_energy", "load_factor")}
        flags, place = f["backspring/broken/value"][-1], f["particles/trajectory/position/value"][-1].max()
    T = F * last["load_factor"] / 2
    e = (T - Y) / H
    u = T / k + e
    checks.true("the run ends where a fibre breaks", "no equilibrium was found" in result.stderr and 0.5 - F / steps / 2 * (1 / k + 1 / H) <= u < 0.5, f"strain {u:.4f}")
    checks.true("both are whole in the last frame, and nothing is listed", not flags.any() and not events(folder) and last["broken_energy"] == 0)
    checks.near("place", place, 1 + u, 1e-10)
    checks.near("what they store", last["elastic_energy"], k * (u - e) ** 2 + H * e * e, 1e-10)
    checks.near("what they lost", last["dissipated_energy"], 2 * Y * e, 1e-10)


def between_avalanches(checks, folder):
    """Load steps with motions after breaks, continued from a checkpoint between two avalanches: times of frames and events, steps, energies, counts."""
    base = {**PULLED, "bs_break_output_interval": 20, "condensed_pc_type": "bicc"}
    start = words({**base, "bs_checkpoint": "c", "bs_checkpoint_every": 1, "bs_output": "r.h5md"})
    go(checks, folder / "whole", *start, "-bs_report", "r.json")
    with h5py.File(folder / "whole/r.h5md") as f:
        load = f["events/broken/load"][...]
        steps = [k for k in range(1, PULLED["bs_load_steps"]) if 0 < np.count_nonzero(load <= k / PULLED["bs_load_steps"] + 1e-9) < len(load)]
    go(checks, folder / "parts", *start, "-ts_max_steps", str(steps[0]))
    go(checks, folder / "parts", "-bs_restart", "c", "-ts_max_steps", "1000", "-bs_report", "r.json")
    with h5py.File(folder / "whole/r.h5md") as a, h5py.File(folder / "parts/r.h5md") as b:
        paths = ["particles/trajectory/position/" + name for name in ("value", "time", "step")] + ["backspring/broken/value"]
        paths += [f"observables/{name}/value" for name in a["observables"] if "value" in a["observables"][name]] + ["events/broken/" + key for key in a["events/broken"]]
        differ = [p for p in paths if not np.array_equal(a[p][...], b[p][...], equal_nan=True)]
        checks.true("continued in every bit", len(paths) > 15 and not differ, f"{len(load)} springs, {np.count_nonzero(load <= steps[0] / PULLED['bs_load_steps'] + 1e-9)} before; differ: {differ}")
        checks.true("a motion before and one after", a["events/broken/time"][0] < a["events/broken/time"][-1] and b["particles/trajectory/position/time"][-1] > 10)


def motions_on_ranks(checks, folder):
    """What breaks in a motion, in the same order at the same times, on 1, 2 and 3 ranks: steps of the motion, too, are the same."""
    seen = []
    for ranks in (1, 2, 3):
        ran(checks, folder, {**PULLED, "bs_load_steps": 1, "bs_output_interval": 1, "bs_motion_upper": "x=fixed,y=velocity:0.35", "bs_lattice_perturbation": 0.05}, ranks=ranks)
        with h5py.File(folder / "b.h5md") as f:
            x = f["particles/trajectory/position/value"][-1][np.argsort(f["particles/trajectory/id"][...])]
        seen.append((events(folder), x))
    one, x = seen[0]
    checks.true("most break in motion", np.count_nonzero(one["time"] > one["time"][0]) > 10, f"{np.count_nonzero(one['time'] > one['time'][0])} of {len(one['time'])}")
    for ranks, (more, y) in zip((2, 3), seen[1:]):
        checks.true(f"{ranks} ranks: springs in their order", np.array_equal(more["spring"], one["spring"]))
        if len(more["time"]) == len(one["time"]):
            checks.near(f"{ranks} ranks: times", more["time"], one["time"], 1e-12)
            checks.near(f"{ranks} ranks: strains", more["strain"], one["strain"], 1e-11)
        checks.near(f"{ranks} ranks: where it comes to rest", y, x, 1e-10)


PULLED = {"bs_task": "statics", "bs_load_steps": 10, "bs_lattice_type": "triangular", "bs_lattice_size": "10,8", "bs_lattice_dim": 2, "bs_lattice_spacing": 1,
          "bs_lattice_stiffness": 1, "bs_lattice_damping": 0.5, "bs_group_lower": "ymin", "bs_group_upper": "ymax", "bs_motion_lower": "fixed",
          "bs_motion_upper": "x=fixed,y=velocity:0.5", "bs_break_strain": 0.06, "bs_break_weibull": "5,3", "bs_break_spare": "lower,upper", "bs_break_follow": "dynamics",
          "bs_output_interval": 0.1}

def free_flight(checks, folder):
    """A pulled chain loses its hold at one end, shrinks, and at the other end the wave breaks the last spring by compression: what flies off never comes to
    rest. The motion ends all the same, once long steps leave its kinetic energy as it is, and long before the steps allowed run out."""
    n = 8
    x = np.arange(n + 2.0)[:, None]
    limit = np.full(n + 1, np.inf)
    limit[-1], limit[0] = 0.1, 0.107
    write_lattice(folder / "l.h5", x, 1.0, fixed=x[:, 0] == 0, pairs=[[i, i + 1] for i in range(n + 1)], stiffness=1.0, rest_length=1.0, columns={"critical_strain": limit})
    with h5py.File(folder / "l.h5", "a") as f:
        f["groups/end"] = [n + 1]
    ran(checks, folder, {"bs_task": "statics", "bs_load_steps": 11, "bs_lattice_file": str(folder / "l.h5"), "bs_motion_end": "x=velocity:0.99", "bs_break_in": "both",
                         "bs_break_follow": "dynamics", "bs_break_dt": 0.05, "bs_break_output_interval": 5})
    found = events(folder)
    checks.true("the held end breaks, then the other one by compression", list(found["spring"]) == [n, 0] and found["strain"][1] < 0, f"{found['strain']}")
    with h5py.File(folder / "b.h5md") as f:
        clock, steps, kinetic = (f[name][...].ravel() for name in ("particles/trajectory/position/time", "particles/trajectory/position/step", "observables/kinetic_energy/value"))
        momentum = f["observables/momentum/value"][...].ravel()
    flying = kinetic > 0
    checks.true("what is free flies at a constant speed", flying.sum() > 5 and abs(momentum[flying][-1]) > 0.05 and np.ptp(momentum[flying][-4:]) < 1e-9, f"{momentum[flying][-1]:.4g} kg m/s")
    checks.below("kinetic energy left is that of the flight alone", abs(kinetic[flying][-1] / (momentum[flying][-1]**2 / (2 * n)) - 1), 0.02)
    checks.true("and the motion ends", steps[-1] < 20000 and clock[-1] < 1e4, f"{steps[-1]} steps, {clock[-1]:.4g} s")


if __name__ == "__main__":
    run_parts(__doc__, (ties, notch, scattered, sides, furthest, no_springs, plastic_work, whole_again, free_flight),
              on_one_rank=(between_avalanches, motions_on_ranks))  # the last one starts more ranks by itself
