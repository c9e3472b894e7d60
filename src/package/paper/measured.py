"""What the benchmarks of the repository have measured (tests/bench/*.json and README.md), as numbers for the paper's text and curves for its figures."""
import json
import pathlib
import re

import numpy as np

BENCH = pathlib.Path(__file__).resolve().parents[3] / "tests" / "bench"
FOLDED = ("folding cloth", "shell", "twisted cloth")


def read(name):
    return json.loads((BENCH / name).read_text())


def steps():
    """Backward Euler on B1 and B2, and other programs on the same lattice, as seconds of computing per 0.01 s simulated."""
    results = read("results.json")
    own = {(r["case"], r["h"], r["ranks"], r["solver"]): r for r in results["steps"]}
    second = lambda case, h, ranks=1, solver="default": own[case, h, ranks, solver]["s_per_step"]
    peers = {(r["peer"], r["case"], r["ranks"]): r for r in results["peers"]}
    peer = lambda name, case: peers[name, case, 1].get("s_per_10ms")
    loop, lammps, adams, bdf = "symplectic Euler, plain loop", "LAMMPS, velocity Verlet", "SUNDIALS CVODE, Adams", "SUNDIALS CVODE, BDF + GMRES"
    report = own["B1", 0.01, 1, "default"]["report"]
    numbers = {"b_particles": own["B1", 0.01, 1, "default"]["particles"], "b_springs": peers[loop, "B1", 1]["springs"], "h_short": 0.01, "h_long": 0.1, "h_omega": report["h_omega_max"],
               "h_omega_stiff": own["B2", 0.01, 1, "default"]["report"]["h_omega_max"],
               "b1": second("B1", 0.01), "b1_long": second("B1", 0.1), "b2": second("B2", 0.01), "b2_long": second("B2", 0.1),
               "b1_two": second("B1", 0.01) / second("B1", 0.01, 2), "b1_newton": own["B1", 0.01, 1, "default"]["newton"], "b1_krylov": own["B1", 0.01, 1, "default"]["krylov"],
               "b2_newton": own["B2", 0.01, 1, "default"]["newton"], "b2_krylov": own["B2", 0.01, 1, "default"]["krylov"],
               "full_short": second("B1", 0.01, 1, "full") / second("B1", 0.01), "full_long": second("B1", 0.1, 1, "full") / second("B1", 0.1),
               "full_stiff": second("B2", 0.01, 1, "full") / second("B2", 0.01),
               "b1_loop": peer(loop, "B1"), "b1_lammps": peer(lammps, "B1"), "b1_adams": peer(adams, "B1"), "b1_bdf": peer(bdf, "B1"), "b2_loop": peer(loop, "B2"), "b2_lammps": peer(lammps, "B2"),
               "loop_steps_stiff": peers[loop, "B2", 1]["steps"]}
    rows = [("backspring, h = 0.01 s", second("B1", 0.01), second("B2", 0.01)), ("backspring, h = 0.1 s", second("B1", 0.1) / 10, second("B2", 0.1) / 10),
            ("full Jacobian, GMRES + ILU", second("B1", 0.01, 1, "full"), second("B2", 0.01, 1, "full"))]
    rows += [(label, peer(name, "B1"), peer(name, "B2")) for label, name in (("symplectic Euler loop", loop), ("LAMMPS, Verlet", lammps), ("CVODE, Adams", adams), ("CVODE, BDF + GMRES", bdf))]
    return numbers, {"peers": rows}


def sizes():
    """Time and memory of a particle over the size of the lattice, Krylov iterations over the number of ranks."""
    results = read("results.json")
    rows = {ranks: [(r["particles"], r["us_per_particle"]) for r in results["sizes"] if r["ranks"] == ranks] for ranks in (1, 2)}
    krylov = {r["ranks"]: r for r in results["coarse"]["iterations"]}
    large = results["large"][0]
    few = [cost for count, cost in rows[1] if count >= 1e4]
    numbers = {"size_from": rows[1][2][0], "size_to": rows[1][-1][0], "cost_from": min(few), "cost_to": max(few), "first_size": rows[1][0][0], "first_newton": results["sizes"][0]["newton"],
               "krylov_alone": krylov[1]["krylov"], "krylov_eight": krylov[8]["krylov"], "bare_alone": krylov[1]["krylov_without"], "bare_eight": krylov[8]["krylov_without"],
               "weak_particles": krylov[1]["particles"],
               "kilobytes": next(r["bytes_per_particle"] for r in results["sizes"] if r["particles"] == 1e6 and r["ranks"] == 1) / 1e3, "large_particles": large["particles"],
               "large_gigabytes": large["peak_bytes"] / 1e9, "large_seconds": large["s_per_step"]}
    return numbers, {"sizes": rows, "krylov": [(n, krylov[n]["krylov"], krylov[n]["krylov_without"]) for n in sorted(krylov)]}


def searches():
    """Newton iterations of each line search over the fewest of any, as the geometric mean of all cases (as tests/bench/line_search.py has it)."""
    results = read("line_search.json")["results"]
    mean = {}
    for name in next(iter(results.values())):
        ratios = []
        for rows in results.values():
            fewest = min(row["newton"] for row in rows.values() if row["outcome"] == "ok")
            if rows[name]["outcome"] == "ok":
                ratios.append(rows[name]["newton"] / max(fewest, 1))
        mean[name] = float(np.exp(np.mean(np.log(ratios))))
    others = [mean[name] for name in mean if name != "energy"]
    rejected = {name: sum(rows[name].get("rejected", 0) for rows in results.values()) for name in mean}
    return {"search_cases": len(results), "search_energy": mean["energy"], "search_best_other": min(others), "search_worst_other": max(others), "search_rejected": rejected["energy"],
            "search_rejected_other": min(n for name, n in rejected.items() if name != "energy")}, {}


def equilibria():
    """A diluted net beside SciPy's Newton; disordered nets by the defaults; what the defaults lose to other options."""
    statics, survey, nets = read("statics.json"), read("survey.json"), read("disordered.json")
    default = next(row for row in statics["net"] if row["solver"] == "default")
    cube = max((row for row in statics["cube"] if row["load"] == "stretched"), key=lambda row: row["springs"])
    paths = survey["sheared"] + survey["plates"]
    plate = {row["by"]: row for row in nets["plate_0.9"]["rows"]}
    own = [row for row in nets["pushed_1"]["rows"] if row["by"] in ("default", "exact tangent")]
    numbers = {"net_springs": default["springs"], "net_seconds": default["user"], "net_scipy": min(row["user"] for row in statics["scipy"]),
               "cube_springs": cube["springs"], "cube_seconds": cube["user"],
               "survey_runs": len(paths), "survey_steps": sum(row["load_steps"] for row in paths), "survey_cut": sum(row["cut"] for row in paths), "survey_pseudo": sum(row["pseudo"] for row in paths),
               "survey_unstable": sum(row["unstable"] for row in paths), "pushed_ratio": own[0]["time"] / own[1]["time"],
               "plate_steps": nets["plate_0.9"]["load_steps"], "plate_default": plate["default"]["time"], "plate_shifts": plate["Newton, sparse LU, shifts"]["time"],
               "plate_stopped": min(plate[name]["time"] for name in ("FIRE", "L-BFGS") if plate[name]["why"] == "stopped")}
    torn = max(read("breaking.json"), key=lambda row: row["springs"])
    numbers.update(torn_springs=torn["springs"], torn_broken=torn["broken_springs"], torn_minutes=torn["wall"] / 60, torn_ranks=torn["ranks"])
    return numbers, {}


def limits():
    """Folding sheets beside symplectic Euler, and iterations where a part of the springs is stiff (a table of tests/bench/README.md)."""
    sizes = read("hard.json")["sizes"]
    ratio = lambda size, name: sizes[size][name]["variants"]["beuler, auto"]["per_second"] / sizes[size][name]["symplectic"]["per_second"]
    small = [ratio("small", name) for name in FOLDED]
    text = (BENCH / "README.md").read_text()
    krylov = {share: (int(one), int(eight)) for share, one, eight in re.findall(r"^\| (\d+) % \| (\d+) \| (\d+) \| [\d,]+ \| [\d,]+ \|$", text, re.M)}
    even = float(re.search(r"^\| cube 16 x 16 x 16 \| 25 \| ([\d.]+),", text, re.M)[1])
    return {"fold_least": min(small), "fold_most": max(small), "shell_particles": sizes["large"]["shell"]["particles"], "shell_large": ratio("large", "shell"),
            "stiff_tenth": krylov["10"][0], "stiff_most": max(one for one, _ in krylov.values()), "stiff_most_on_eight": max(eight for _, eight in krylov.values()),
            "even_krylov": even, "stiff_side": 16}, {}


PARTS = (steps, sizes, searches, equilibria, limits)
