"""Other programs on the same lattice: built on demand, each measured as seconds per step or per 0.01 s simulated."""
import json
import pathlib
import re
import shutil
import statistics
import subprocess
import tempfile

import cases
from running import Failed, execute

HERE = pathlib.Path(__file__).resolve().parent
PACKAGES = {"eigen_be": "libeigen3-dev", "cvode": "libsundials-dev", "raw_write": "libhdf5-openmpi-dev", "lmp": "lammps"}


def build(context):
    """Compiles what the packages at hand allow into context.peers; {name of what is missing: reason}."""
    context.say("building the peers")
    folder = context.peers
    log = []
    for command in (["cmake", "-S", str(HERE / "peers"), "-B", str(folder), "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release"],
                    ["cmake", "--build", str(folder), "--parallel", "2", "--", "-k", "0"]):
        done = subprocess.run(command, capture_output=True, text=True)
        log.append(done.stdout + done.stderr)
    (folder / "build.log").write_text("\n".join(log))
    missing = {}
    for name in ("triad", "symplectic", "lammps_data", "eigen_be", "cvode", "raw_write"):
        if not (folder / name).exists():
            missing[name] = f"not built: apt install {PACKAGES[name]}" if name in PACKAGES else f"not built: see {folder / 'build.log'}"
    if not shutil.which("lmp"):
        missing["lmp"] = f"not installed: apt install {PACKAGES['lmp']}"
    for name, why in missing.items():
        context.say(f"peer {name} skipped: {why}")
    return missing


def json_run(context, name, ranks=1, **arguments):
    """Figures a peer prints as its last line, with wall and peak memory."""
    words = [str(context.peers / name)]
    for key, value in arguments.items():
        words += [f"--{key}", f"{value:.17g}"]
    with tempfile.TemporaryDirectory(prefix="bench_", dir=context.scratch) as folder:
        out, wall, peak = execute(words, ranks, context.budget.limit(), pathlib.Path(folder))
    figures = json.loads(out.strip().splitlines()[-1])
    if not figures.get("converged", 1):
        raise Failed(f"did not converge (step {figures['steps']:.0f})" if wall < 0.5 * context.budget.longest else f"not done in {wall:.0f} s")
    return dict(figures, wall=wall, peak_bytes=peak)


def lammps(context, ranks, stiff, h, steps):
    """Velocity Verlet of LAMMPS: {seconds, last, ...}."""
    n = context.n
    with tempfile.TemporaryDirectory(prefix="bench_", dir=context.scratch) as folder:
        folder = pathlib.Path(folder)
        with open(folder / "lattice.data", "w") as data:
            subprocess.run([str(context.peers / "lammps_data"), "--n", str(n), "--stiff", str(int(stiff))], stdout=data, check=True)
        weight = -9.81 * 1000.0 / n ** 3
        variables = {"data": "lattice.data", "dt": f"{h:.17g}", "steps": steps, "weight": f"{weight:.17g}", "reach": 3.5 / n,
                     "skin": 0.5 / n}
        words = ["lmp", "-in", str(HERE / "peers" / "lattice.lmp"), "-log", "none"]
        for key, value in variables.items():
            words += ["-var", key, str(value)]
        out, wall, peak = execute(words, ranks, context.budget.limit(), folder)
    loop = re.search(r"Loop time of (\S+) on", out)
    last = re.search(r"^last (\S+) (\S+) (\S+)", out, re.MULTILINE)
    if not loop or not last:
        raise Failed("LAMMPS printed no loop time or position")
    return {"seconds": float(loop[1]), "last": [float(x) for x in last.groups()], "steps": steps, "h": h, "wall": wall, "peak_bytes": peak}


def repeated(context, one, key):
    """The run of median `key`, repeated while quick."""
    runs = [one()]
    while len(runs) < context.repeats and runs[-1]["wall"] < 0.2 * context.budget.longest and context.budget.left() > 2 * runs[-1]["wall"]:
        runs.append(one())
    values = [run[key] for run in runs]
    return dict(runs[values.index(statistics.median_low(values))], **{key: statistics.median(values), "all": values})


def best_tolerance(context, **arguments):
    """Of the linear solver: the one that makes Eigen's first step fastest."""
    times = {}
    for linear in (1e-2, 1e-4, 1e-5):
        try:
            times[linear] = json_run(context, "eigen_be", steps=1, linear=linear, **arguments)["s_per_step"]
        except Failed:
            continue
    if not times:
        raise Failed("did not converge at any tolerance of the linear solver")
    return min(times, key=times.get)


def implicit(context, missing):
    """Backward Euler by Eigen, at the steps of the reference problems."""
    rows = []
    for ic, label in ((0, "Eigen CG + Jacobi"), (1, "Eigen CG + IncompleteCholesky")):
        linear = None
        for name, h in (("B1", 0.01), ("B1", 0.1), ("B2", 0.01)):
            row = {"peer": label, "case": name, "h": h, "ranks": 1, "kind": "implicit"}
            rows.append(row)
            if "eigen_be" in missing:
                row["failed"] = missing["eigen_be"]
                continue
            try:
                # it ends by itself a little before the budget would, with the steps it has made
                given = dict(n=context.n, h=h, stiff=name == "B2", ic=ic, limit=0.5 * context.budget.limit())
                linear = linear or best_tolerance(context, **given)
                run = repeated(context, lambda: json_run(context, "eigen_be", steps=context.steps, linear=linear, **given), "s_per_step")
                row.update(run, linear_tolerance=linear, s_per_10ms=run["s_per_step"] * 0.01 / h)
                row.update({key: run[key] / run["steps"] for key in ("newton", "krylov")})
                context.say(f"{label}, {name}, h = {h:g}: {row['s_per_step']:.4g} s/step")
            except Failed as why:
                row["failed"] = str(why)
                context.say(f"{label}, {name}, h = {h:g}: {why}")
    return rows


def accurate(context, missing):
    """Explicit loops at their largest step, and CVODE at its own: all follow the true motion."""
    rows, steps_of = [], {}
    times = {"B1": 0.05, "B2": 0.01}
    def attempt(label, name, key, one, ranks=1):
        row = {"peer": label, "case": name, "ranks": ranks, "kind": "accurate", "time": times[name]}
        rows.append(row)
        if key in missing:
            row["failed"] = missing[key]
            return
        try:
            run = repeated(context, one, "seconds")
            row.update(run, s_per_10ms=run["seconds"] * 0.01 / times[name])
            context.say(f"{label}, {name}, {ranks} rank(s): {row['s_per_10ms']:.4g} s per 0.01 s simulated")
        except (Failed, subprocess.CalledProcessError) as why:
            row["failed"] = str(why)
            context.say(f"{label}, {name}: {why}")
    for name, T in times.items():
        stiff = name == "B2"
        attempt("symplectic Euler, plain loop", name, "symplectic", lambda: json_run(context, "symplectic", n=context.n, time=T, stiff=stiff))
        steps_of[name] = rows[-1]
        for ranks in context.ranks:
            if "steps" in steps_of[name]:
                attempt("LAMMPS, velocity Verlet", name, "lmp",
                        lambda: lammps(context, ranks, stiff, steps_of[name]["h"], int(steps_of[name]["steps"])), ranks)
        for adams, label in ((0, "SUNDIALS CVODE, BDF + GMRES"), (1, "SUNDIALS CVODE, Adams")):
            attempt(label, name, "cvode", lambda: json_run(context, "cvode", n=context.n, time=T, stiff=stiff, adams=adams,
                                                           limit=0.8 * context.budget.limit()))
    return rows


def check(rows, steps_rows):
    """[(what, deviation [m], allowed, holds)]: implicit peers against the program's run of the same step, accurate ones
    among each other, to what their order allows."""
    out = []
    for row in rows:
        if "last" not in row:
            continue
        if row["kind"] == "implicit":
            ours = next((r for r in steps_rows if r.get("last") and r["case"] == row["case"] and r["h"] == row["h"]
                         and r["steps"] == row["steps"] and r["solver"] == "default"), None)
            allowed = cases.CHECK_TOLERANCE if row["case"] == "B1" else 1e-4
        else:
            ours = next((r for r in rows if r.get("last") and r["kind"] == "accurate" and r["case"] == row["case"]), None)
            # symplectic Euler, the first of them, is off by h/2 of every velocity's change
            allowed = 1e-3 + 9.81 * (ours["h"] if ours else 0) * row["time"]
        if ours is None or ours is row:
            continue
        off = max(abs(a - b) for a, b in zip(row["last"], ours["last"]))
        out.append((f"{row['peer']}, {row['case']}: last particle", off, allowed, off <= allowed))
    return out
