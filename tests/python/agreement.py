#!/usr/bin/env python3
"""What the Python package computes is what the program computes, in every bit: equilibria, modes, moduli, motions and what breaks in them, on one rank and several."""
import io
import os
import pathlib
import subprocess
import sys
import tempfile

import h5py
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, write_lattice  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import cases  # noqa: E402


def by_package(checks, name, folder):
    """Arrays of a case, computed by a process of its own on checks.ranks ranks."""
    out = pathlib.Path(folder) / "found.npz"
    words = ["mpirun", "-n", str(checks.ranks)] if checks.ranks > 1 else []
    environment = dict(os.environ, PYTHONPATH=str(pathlib.Path(checks.program).parent / "python"), SCOTCH_PTHREAD_NUMBER="1")
    done = subprocess.run([*words, sys.executable, str(HERE / "cases.py"), name, str(out)], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    return dict(np.load(out))


def write(net, path):
    """The file of a network."""
    fixed = np.zeros(len(net["x"]), int)
    fixed[np.asarray(net.get("fixed", ()), int)] = 1
    box = None if "box" not in net else np.diag(np.asarray(net["box"], float))
    write_lattice(path, net["x"], net.get("mass", 1.0), fixed=fixed, pairs=net["pairs"], stiffness=net["stiffness"], rest_length=net["rest_length"],
                  damping=net.get("damping"), spring_law="hooke", box=box, shift=net.get("shift"), anchors=net.get("anchors"), angles=net.get("angles"),
                  columns={**net.get("breaking", {}), **({"area": net["area"]} if "area" in net else {})})
    with h5py.File(path, "a") as f:
        for name, values in net.get("hinges", {}).items():
            f[f"hinges/{name}"] = values
        for group, rows in net.get("groups", {}).items():
            f[f"groups/{group}"] = np.asarray(rows, np.int64)
    return path


def by_program(checks, name, folder):
    """The same arrays from the program's trajectory, the network from a file."""
    network, options, _ = cases.CASES[name]
    file = {"bs_lattice_file": str(write(network(), pathlib.Path(folder) / "net.h5"))} if network else {}
    done = checks.run({**options, **file, "bs_output": "out.h5md"}, keep=("out.h5md",))
    with h5py.File(io.BytesIO(done.files["out.h5md"])) as f:
        value = lambda path: f[path + "/value"][...]
        if name.startswith("modes"):
            return {"omega2": f["modes/omega_squared"][...], "shapes": f["modes/shape"][...]}
        if name == "moduli":
            return {"stiffness": f["moduli/stiffness"][...]}
        events = {f"events_{one}": f[f"events/broken/{one}"][...] for one in ("time", "load", "spring", "ends", "strain", "energy", "avalanche")} if "breaking" in name else {}
        x, v, t = value("particles/trajectory/position"), value("particles/trajectory/velocity"), f["particles/trajectory/position/time"][...]
        if name.startswith("statics"):
            return {"x": x[-1], "tension": value("observables/springs/tension")[-1], "energy": value("observables/elastic_energy")[-1],
                    "hung": value("observables/reaction/hung")[-1], "newton": done.report["newton"], **events}
        return {"t": t, "x": x, "v": v, "energy": value("observables/total_energy"), **events}


def main():
    checks = Checks("What the Python package computes is what the program computes")
    os.environ["SCOTCH_PTHREAD_NUMBER"] = "1"  # for both: the same division of the network among ranks
    for name in cases.CASES:
        if not checks.wants(name):
            continue
        with checks.group(name), tempfile.TemporaryDirectory() as folder:
            ours, theirs = by_package(checks, name, folder), by_program(checks, name, folder)
            for what, expected in theirs.items():
                same = ours[what].shape == np.shape(expected) and np.array_equal(ours[what], expected, equal_nan=True)
                checks.true(f"{name} {what}", same, f"{np.shape(ours[what])}, largest difference {np.abs(ours[what] - expected).max():.3g}" if
                            np.shape(ours[what]) == np.shape(expected) else f"{np.shape(ours[what])} for {np.shape(expected)}")
    checks.finish()


if __name__ == "__main__":
    main()
