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
import targets

BENCH = [sys.executable, str(HERE / "bench.py"), "--repeats", "1", "--budget", "100", "--triad-elements", "1000000"]


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


def main():
    arguments = sys.argv[1:]
    closed_counts()
    no_invention()
    hard_cases(arguments[arguments.index("--program") + 1])
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
        results, _ = bench(folder, arguments + ["--n", "4", "--steps", "1", "--sections", "weak"], "2")
        assert "s_per_step" in results["weak"][0], results["weak"]
        modelled = subprocess.run([sys.executable, str(HERE / "model.py"), str(folder / "results.json")], capture_output=True, text=True)
        assert modelled.returncode == 0 and "10^9" in modelled.stdout, modelled.stdout + modelled.stderr
    print("bench: ok")


if __name__ == "__main__":
    main()
