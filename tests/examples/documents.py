#!/usr/bin/env python3
"""The commands of the documents run as they stand: every ```sh block, in order, in a scratch copy's place; links lead somewhere; figures that
are marked (figures.py) are what the commands gave."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
from program import environment
import figures
import structures
import h5py
from matplotlib import image

WITH_COMMANDS = ("README.md", "options/README.md", "options/tutorial/README.md", "options/tutorial/structures.md", "meshes/README.md",
                 *(str(path.relative_to(REPO)) for path in sorted((REPO / "src/package/site").rglob("*.md")) if "```sh\n" in path.read_text()))


def hosted(target):
    """A badge leads to the runs of a workflow, which are beside the files where the project is hosted; here the workflow's file has to be there."""
    return re.sub(r"^\.\./\.\./actions/(workflows/\w+\.yml)(/badge\.svg)?$", r".github/\1", target)


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
        dead = [t for t in targets if not (path.parent / hosted(t)).exists()]
        checks.true(f"{relative}: {len(targets)} links", not dead, f"{dead}" if dead else "")


def pictures(checks, name, inside):
    """Those of a document's own folder are what its commands have drawn."""
    for picture in sorted(set(re.findall(r"!\[[^\]]*\]\((\w+\.png)\)", (REPO / name).read_text()))):
        drawn = list(inside.rglob(picture))
        checks.true(f"{name}: {picture} is drawn by a command", len(drawn) == 1)
        if len(drawn) == 1:
            shipped, now = (image.imread(path)[..., :3] for path in ((REPO / name).parent / picture, drawn[0]))
            same = shipped.shape == now.shape
            other = (abs(shipped - now).max(axis=-1) > 0.2).mean() if same else 1.0
            checks.true(f"{name}: {picture} as it is drawn now", other < 3e-4, f"{other:.2%} of the points are others" if same else f"{shipped.shape}, {now.shape}")


def numbers(checks, folder):
    """What the tutorial says of results, against a loop of its own and closed forms; and that a wrong figure is seen."""
    here = figures.Folder(folder)
    for run, implicit in (("fall_be", 1), ("fall_fe", 0)):
        checks.near(f"tutorial: {run} after 2 s", here.value(f'at("{run}", velocity("{run}"), 2)[0, 0]'), here.falling_sphere(8, 0.25, implicit), 1e-6)
    with h5py.File(folder / "rlc_rings.h5md") as rings, h5py.File(folder / "rlc_cured.h5md") as cured:
        checks.near("tutorial: v1 rings between 0 and 2 V", rings["states/value"][:5, 0], [0, 2, 0, 2, 0], 1e-9)
        checks.near("tutorial: and does not after one step of backward Euler", cured["states/value"][1:, 0], 1, 1e-9)
    for shown, measured, tolerance, same in (("15.82", 15.8249, None, True), ("15.82", 15.8251, None, False), ("1.4e-7", 2.7e-12, "a factor of 300", False),
                                             ("3e-12", 2.7e-12, "a factor of 300", True), ("175", 180.0, "5 %", True), ("175", 190.0, "5 %", False)):
        checks.true(f"a figure {shown} for {measured}: {'passes' if same else 'is seen'}", figures.agrees(shown, measured, tolerance) == same)


def main():
    checks = Checks(__doc__)
    links(checks)
    for name in WITH_COMMANDS:
        if checks.wants(name):
            with tempfile.TemporaryDirectory() as folder, checks.group(name):
                scratch(pathlib.Path(folder), checks.program)
                printed = run_document(checks, name, folder)
                inside = pathlib.Path(folder) / {"README.md": "out", "options/tutorial/README.md": "tutorial", "options/tutorial/structures.md": "structures"}.get(name, ".")
                figures.check(checks, name, (REPO / name).read_text(), inside, printed)
                pictures(checks, name, inside)
                if name == "options/tutorial/README.md":
                    numbers(checks, inside)
                if name == "options/tutorial/structures.md":
                    structures.numbers(checks, inside)
    checks.finish()


if __name__ == "__main__":
    main()
