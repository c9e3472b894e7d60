#!/usr/bin/env python3
"""The benchmark itself still runs: every section at a tiny size, its peers agree, its files hold together."""
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import cases
import coarse
import model
import targets

BENCH = [sys.executable, str(HERE / "bench.py"), "--repeats", "1", "--budget", "200", "--triad-elements", "1000000"]


def bench(folder, arguments, ranks):
    done = subprocess.run(BENCH + arguments + ["--folder", str(folder), "--ranks", ranks], capture_output=True, text=True)
    print(done.stdout + done.stderr)
    assert done.returncode == 0, f"exit code {done.returncode}"
    return json.loads((folder / "results.json").read_text()), (folder / "results.md").read_text()


def closed_counts():
    """springs() against a count one by one."""
    for n, layers in ((3, 3), (4, 2), (2, 5)):
        places = [(x, y, z) for x in range(n) for y in range(n) for z in range(layers)]
        near = sum(1 for a in places for b in places if a < b and sum((p - q) ** 2 for p, q in zip(a, b)) in (1, 2))
        assert cases.springs(n, layers) == near, (n, layers, cases.springs(n, layers), near)
    assert cases.springs(40) == 552240


def no_invention():
    """Without measurements no target is said to be reached or missed."""
    assert all(measured is None and holds is None for _, _, measured, holds in targets.table({})), targets.table({})


def close(found, expected, what):
    assert abs(found - expected) <= 1e-12 * abs(expected), (what, found, expected)


def past_one_machine():
    """The model of larger machines against figures worked out by hand, and the size of the coarse grid as the program has it."""
    # 64,000 particles: at most 2,200 unknowns, 733 nodes, 9^3 of them; 2,000: 100, 33, 3^3; 200: 10, 3, none; 10^9 on 1000 ranks: 300,000^0.75, 4,272, 16^3
    assert [coarse.unknowns(n) for n in (64000, 2000, 200)] == [2187, 81, 0]
    assert coarse.unknowns(1e9, 1000) == 12288 and coarse.unknowns(64000, given=3200) == 3000
    times = [{"unknowns": 125, "s_per_application": 3e-4, "s_per_set_up": 0.1}, {"unknowns": 1000, "s_per_application": 1.2375e-3, "s_per_set_up": 1.084375}]
    rates = model.coarse_rates(times)
    close(rates["application"], 9.375e-4 / (10000 - 625), "an application")
    close(rates["set_up"], 0.984375 / (1000000 - 15625), "a set-up")
    counted = {"applications": 20, "set_ups": 0.5}
    made, sent = model.coarse_time(1000, {"application": 1e-9, "set_up": 1e-9}, counted, 5e8)
    close(made, 20 * 1e-9 * 10000 + 0.5 * 1e-9 * 1000000, "the coarse grid's work")
    close(sent, 2 * (20 * 8000 + 0.5 * 64 * 14000 / 3) / 5e8, "the coarse grid's sums")
    close(model.coarse_bytes(1000), 8 * 15 * 10000 + (9 * 12 + 64) * 14000 / 3, "the coarse grid's memory")
    rows = [{"ranks": r, "particles": 1000 * r, "krylov": k, "krylov_without": w} for r, k, w in ((1, 10.0, 12.0), (2, 12.0, 18.0), (8, 15.0, 30.0))]
    assert model.growth(rows, 2) == (1.25, 2.5) and model.growth(rows, 4) == (1.5, 3.0)
    event = lambda count, time: {"count": count, "time": time, "messages": 0.0, "bytes": 0.0, "reductions": 0.0}
    row = {"label": "a run", "ranks": 2, "particles": 2000, "steps": 2, "s_per_step": 1.0, "krylov": 12.0, "peak_bytes": 5e6,
           "events": {"TSStep": dict(event(2, 2.0), messages=80.0, bytes=6400.0, reductions=60.0), "BSProduct": event(30, 0.4), "BSTriangles": event(30, 0.5),
                      "BSCoarse": event(40, 0.1), "BSCoarseSetUp": event(1, 0.1)}}
    results = {"weak": [row], "empty_bytes": {"2": 0}, "coarse": {"times": times, "iterations": rows}}
    part = model.coarse_part(results, row)
    close(part["share"], 0.5, "share of the Krylov iterations")
    assert (part["applications"], part["set_ups"]) == (20, 0.5)
    lines = model.report(results, particles=1e9, ranks=(1000,), latency=0.0)
    cells = [float(cell.strip(" %")) for cell in lines[-2].strip("|").replace(",", "").split("|")]
    # on 1000 ranks 10^6 particles each; the run's own coarse grid of 81 unknowns is taken from its second a step
    each = (1 - 20 * rates["application"] * 81 ** (4 / 3) - 0.5 * rates["set_up"] * 6561) / 1000
    assert abs(cells[3] / (1e6 * each * (1 + 0.5 * 0.25)) - 1) < 1e-2, (cells, each)
    made, sent = model.coarse_time(12288, rates, {"applications": 25, "set_ups": 0.5}, 5e8)
    assert abs(cells[4] / (made + sent) - 1) < 1e-2, (cells, made, sent)
    assert abs(cells[2] / (1e-9 * ((5e6 - 2 * model.coarse_bytes(81)) / 2000 * 1e6 + model.coarse_bytes(12288))) - 1) < 1e-2, cells
    worst = sum(model.coarse_time(12288, rates, {"applications": 50, "set_ups": 0.5}, 5e8))
    assert abs(cells[-1] / (1e6 * each * (1 + 0.5 * 1.5) + worst) - 1) < 1e-2, (cells, worst)
    del results["coarse"]
    assert any("not measured" in line for line in model.report(results))


def hard_cases(program):
    """One case of hard.py, two steps: every column is filled that its kind allows."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([sys.executable, str(HERE / "hard.py"), "--program", program, "-o", folder, "--filter", "chain", "--steps", "2", "--no-sweep",
                               "--variants", "auto"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        case = json.loads((pathlib.Path(folder) / "hard.json").read_text())["sizes"]["small"]["pulled chain"]
        row = case["variants"]["beuler, auto"]
        assert row["outcome"] == "ok" and row["per_second"] > 0 and row["worst"] >= 1 and row["gain"] < 1e-9, row
        assert abs(case["h"] / case["limit"] - 300) < 1e-6 and case["symplectic"]["per_second"] > 0, case
        assert "pulled chain" in (pathlib.Path(folder) / "hard.md").read_text()


def breaking_net(program):
    """breaking.py on a small net, by both rules: the same load breaks about as many springs, and the shares are those of one run."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([sys.executable, str(HERE / "breaking.py"), "--program", program, "-o", folder, "--cases", "all:16,worst:16"], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        at_once, one_by_one = json.loads((pathlib.Path(folder) / "breaking.json").read_text())
        assert at_once["springs"] == 705 and 0 < one_by_one["broken_springs"] <= at_once["broken_springs"], (at_once, one_by_one)
        assert one_by_one["newton"] > at_once["newton"] and all(0 < sum(r["shares"].values()) < 1 for r in (at_once, one_by_one)), (at_once, one_by_one)
        assert "| 705 | worst | 2 |" in (pathlib.Path(folder) / "breaking.md").read_text()


def main():
    arguments = sys.argv[1:]
    closed_counts()
    no_invention()
    past_one_machine()
    hard_cases(arguments[arguments.index("--program") + 1])
    breaking_net(arguments[arguments.index("--program") + 1])
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        results, text = bench(folder, arguments + ["--n", "6", "--steps", "2", "--output-n", "6", "--sizes", "6", "--sections",
                                                   "steps,kernels,peers,sizes,without_factors,output"], "1")
        assert all("s_per_step" in row for row in results["steps"] if row["h"] == 0.01), "a step failed"
        assert all(row["newton"] >= 1 and row["peak_bytes"] > 1e6 for row in results["steps"] if "newton" in row)
        assert len(results["steps"]) == 7 and results["sizes"][0]["us_per_particle"] > 0
        force = next(row for row in results["kernels"]["rows"] if row["kernel"] == "force")
        assert force["springs_per_s"] > 1e5 and force["calls"] >= 50, force
        assert "## Targets" in text and "The targets are for n = 40" in text
        built = [row for row in results["peers"] if "last" in row]
        assert len(results["checks"]) >= len(built) - 2 and any(row["peer"].startswith("symplectic") for row in built)
        results, _ = bench(folder, arguments + ["--n", "4", "--steps", "1", "--sections", "weak,coarse"], "2")
        assert "s_per_step" in results["weak"][0], results["weak"]
        assert results["coarse"]["iterations"][-1]["ranks"] == 8 and results["coarse"]["times"][1]["unknowns"] == 5184, results["coarse"]
        modelled = subprocess.run([sys.executable, str(HERE / "model.py"), str(folder / "results.json")], capture_output=True, text=True)
        assert modelled.returncode == 0 and "10^9" in modelled.stdout and "65856, 12288, 2187, 2187 unknowns" in modelled.stdout, modelled.stdout + modelled.stderr
    print("bench: ok")


if __name__ == "__main__":
    main()
