#!/usr/bin/env python3
"""The commands of the documents run as they stand: every ```sh block, in order, in a scratch copy's place; links lead somewhere."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
from program import environment
import h5py
import numpy as np
from scipy.optimize import brentq

WITH_COMMANDS = ("README.md", "options/README.md", "options/tutorial/README.md", "meshes/README.md")


def blocks(text):
    """[(line number, commands)] of the ```sh blocks."""
    found = []
    for match in re.finditer(r"^```sh\n(.*?)^```$", text, re.S | re.M):
        found.append((text[:match.start()].count("\n") + 2, match[1]))
    return found


def scratch(folder, program):
    """What a checkout has, built: build/release is the folder of the program."""
    for name in os.listdir(REPO):
        if name not in ("build", "out", ".git", "README.md"):
            (folder / name).symlink_to(REPO / name)
    (folder / "build").mkdir()
    (folder / "build/release").symlink_to(pathlib.Path(program).parent)


def run_document(checks, name, folder):
    parts = blocks((REPO / name).read_text())
    checks.true(f"{name}: has commands", len(parts) > 0, f"{len(parts)} blocks")
    script = "set -eo pipefail\n" + "".join(f"echo '@@ {line}'\n{commands}" for line, commands in parts) + "echo '@@ end'\n"
    env = dict(environment(8), MPLBACKEND="Agg")
    done = subprocess.run(["bash", "-c", script], cwd=folder, env=env, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=900, errors="replace")
    reached = re.findall(r"^@@ (\w+)$", done.stdout, re.M)
    tail = " / ".join(done.stdout.strip().splitlines()[-3:])[-300:]
    for line, commands in parts:
        went = str(line) in reached and reached[-1] != str(line)
        checks.true(f"{name} line {line}: {commands.splitlines()[0][:70]}", went, "" if went else tail)
    checks.true(f"{name}: to the end", done.returncode == 0, "" if done.returncode == 0 else tail)
    return done.stdout


def links(checks):
    """Relative links and pictures of all documents."""
    for path in sorted(REPO.rglob("*.md")):
        relative = path.relative_to(REPO)
        if relative.parts[0] in ("build", "out"):
            continue
        targets = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", path.read_text())
        dead = [t for t in targets if not (path.parent / t).exists()]
        checks.true(f"{relative}: {len(targets)} links", not dead, f"{dead}" if dead else "")


def numbers(checks, folder):
    """What the documents say of results, against closed forms and a loop of its own."""
    def drag(v):
        re = 2 * 0.01 * 0.9 * v / 1.693e-5
        return 0.5 * 0.9 * np.pi * 1e-4 * (24 / re + 6 / (1 + np.sqrt(re)) + 0.4) * v * v

    m, h, v = 0.003841120617789121, 0.25, [0.001] * 2
    for _ in range(8):  # 2 s by forward Euler, and by backward Euler through bisection
        v[0] += h * (9.8 - drag(v[0]) / m)
        v[1] = brentq(lambda u, old=v[1]: u - old - h * (9.8 - drag(u) / m), v[1], v[1] + h * 9.8, xtol=1e-13)
    with h5py.File(folder / "tutorial/fall_fe.h5md") as fe, h5py.File(folder / "tutorial/fall_be.h5md") as be:
        found = [f["particles/trajectory/velocity/value"][8, 0, 0] for f in (fe, be)]
    checks.near("tutorial: velocities after 2 s", found, v, 1e-6)
    said = (REPO / "options/tutorial/README.md").read_text()
    checks.true("tutorial: says them", f"backward Euler has {v[1]:.2f} m/s, forward Euler {v[0]:.2f} m/s" in said)
    with h5py.File(folder / "tutorial/rlc_rings.h5md") as rings, h5py.File(folder / "tutorial/rlc_cured.h5md") as cured:
        checks.near("tutorial: v1 rings between 0 and 2 V", rings["states/value"][:5, 0], [0, 2, 0, 2, 0], 1e-9)
        checks.near("tutorial: and does not after one step of backward Euler", cured["states/value"][1:, 0], 1, 1e-9)


def main():
    checks = Checks(__doc__)
    links(checks)
    for name in WITH_COMMANDS:
        if checks.wants(name):
            with tempfile.TemporaryDirectory() as folder, checks.group(name):
                scratch(pathlib.Path(folder), checks.program)
                run_document(checks, name, folder)
                if name == "options/tutorial/README.md":
                    numbers(checks, pathlib.Path(folder))
    checks.finish()


if __name__ == "__main__":
    main()
