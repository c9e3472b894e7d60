"""The conda recipe: its fields, what it needs against the other recipes, its calls of CMake and its own test."""
import re

import docker
import project
import yaml

# conda-forge's names of what Debian calls otherwise; the rest is python3-NAME there
AS_IN_DEBIAN = {"python3": "python", "python3-matplotlib": "matplotlib-base", "python3-yaml": "pyyaml", "ffmpeg": "ffmpeg", "openmpi-bin": "openmpi"}


def check(checks, package):
    path = package / "conda/recipe.yaml"
    recipe = yaml.safe_load(path.read_text())
    version = re.search(r"VERSION (\d+\.\d+\.\d+)", (project.REPO / "CMakeLists.txt").read_text())[1]
    checks.true("conda: the version is CMake's", recipe["context"]["version"] == version and recipe["package"]["name"] == "backspring", f"{recipe['context']}")
    checks.true("conda: the source is this checkout", (path.parent / recipe["source"]["path"]).resolve() == project.REPO)
    calls = docker.cmake_calls(recipe["build"]["script"])
    wrong = project.wrong_calls(calls)
    checks.true("conda: calls of CMake", len(calls) == 4 and not wrong, f"{wrong}")
    for part in ("host", "run"):
        names = {need.split()[0] for need in recipe["requirements"][part]}
        checks.true(f"conda: {part} has what the program is linked with", {"petsc", "slepc", "openmpi"} <= names, f"{sorted(names)}")
    debian = {AS_IN_DEBIAN.get(name, name.removeprefix("python3-")) for name in project.recommended_packages()}
    lacks = debian - {need.split()[0] for need in recipe["requirements"]["run"]}
    checks.true("conda: run has what the tools want", not lacks and len(debian) > 9, f"{sorted(lacks)}")
    minimum = re.search(r"VERSION (\d+\.\d+)", (project.REPO / "CMakeLists.txt").read_text())[1]
    checks.true("conda: the oldest CMake", f"cmake >={minimum}" in recipe["requirements"]["build"])
    oldest, newest = re.search(r"PETSc 3\.(\d+) to 3\.(\d+)", (project.REPO / "README.md").read_text()).groups()
    checks.true("conda: the releases of PETSc", f"petsc >=3.{oldest},<3.{int(newest) + 1}" in recipe["requirements"]["host"])
    checks.true("conda: the licence is there", (project.REPO / recipe["about"]["license_file"]).is_file())
    words = " ".join(recipe["tests"][0]["script"]).split()
    options = {word for word in words if word.startswith("-bs_")}
    known = set(re.findall(r"`(-bs_\w+)`", (project.REPO / "options/reference/README.md").read_text()))
    checks.true("conda: its test names options that exist", options and options <= known, f"{options - known}")
