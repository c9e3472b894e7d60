#!/usr/bin/env python3
"""The recipes of images and packages and the workflows of public CI agree with the project: what they install exists and is what the program is linked with, what they copy is there,
CMake is called as the presets say, options and components are those of CMake, and the groups of tests that the workflows run are all that there are."""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
import conda
import docker
import project
import spack_stub
import workflows

PACKAGE = REPO / "src/package"


def exist_in_debian(checks, where, packages):
    """`packages` are Debian's; without apt's lists this cannot be known."""
    known = subprocess.run(["apt-cache", "pkgnames"], capture_output=True, text=True).stdout.split() if shutil.which("apt-cache") else []
    if "petsc-dev" not in known:
        checks.skip(f"{where}: Debian's packages", "apt has no list of them: apt-get update")
        return
    checks.true(f"{where}: {len(packages)} packages exist", not set(packages) - set(known), f"{sorted(set(packages) - set(known))}")


def image_packages(checks, stages):
    """The lists of the three stages, against CMake's messages, the linker and the .deb packages."""
    install = {name: set(docker.packages(stages[name])) for name in stages}
    for name, packages in install.items():
        exist_in_debian(checks, f"Dockerfile, {name}", packages)
    asked = project.packages_that_cmake_names()
    checks.true("the stage build has what CMake asks for", len(asked) > 8 and asked <= install["build"], f"{sorted(asked - install['build'])}")
    owners = project.owners_of_libraries(checks.program)
    checks.true("the stage program has the libraries that the program is linked with", len(owners) > 6 and owners <= install["program"], f"{sorted(owners - install['program'])}")
    recommended = project.recommended_packages()
    lacks = recommended - install["tools"] - install["program"]
    checks.true("the stage tools has what the tools and the Python package want", len(recommended) > 9 and not lacks, f"{sorted(lacks)}")


def dockerfile(checks):
    stages = docker.read(PACKAGE / "docker/Dockerfile")
    checks.true("Dockerfile: its stages", list(stages) == ["build", "program", "tools"], f"{list(stages)}")
    image_packages(checks, stages)
    checks.true("Dockerfile: images have the program as entry point", ("ENTRYPOINT", '["backspring"]') in stages["program"])
    for stage, calls in ((name, docker.cmake_calls(text for word, text in steps if word == "RUN")) for name, steps in stages.items()):
        wrong = project.wrong_calls(calls)
        checks.true(f"Dockerfile, {stage}: {len(calls)} calls of CMake", not wrong and (len(calls) == 4) == (stage == "build"), f"{wrong}")
    wrong = project.wrong_calls(["cmake --preset pakcage", "cmake --install build/release --component runtim", "cmake --preset package -DBS_NATVE=ON"])
    checks.true("calls that are wrong are seen", len(wrong) == 3, f"{wrong}")
    made = {prefix for call in docker.cmake_calls(text for _, text in stages["build"]) for prefix in re.findall(r"--prefix (\S+)", call)}
    taken = {source for steps in stages.values() for word, text in steps if word == "COPY" for source in re.findall(r"--from=build (\S+)", text)}
    checks.true("Dockerfile: what the build installs is what the images take", made == taken and len(made) == 2, f"{made} {taken}")


def context(checks):
    """CMake in a copy that holds what .dockerignore lets through, and nothing else."""
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder) / "source"
        count = docker.copy_context(REPO, copy)
        checks.true("context of the images", 300 < count < 1500 and not (copy / "tests").exists() and not (copy / "postprocess/gallery").exists(), f"{count} files")
        done = subprocess.run(["cmake", "--preset", "package"], cwd=copy, capture_output=True, text=True, timeout=300,
                              env={k: v for k, v in os.environ.items() if k not in ("PETSC_DIR", "PETSC_ARCH", "SLEPC_DIR", "HDF5_ROOT")})
        checks.true("cmake --preset package in the context", done.returncode == 0 and (copy / "build/package/build.ninja").exists(), done.stderr[-300:] if done.returncode else "")


def apptainer(checks):
    stages, model = docker.read_apptainer(PACKAGE / "apptainer/backspring.def"), docker.read(PACKAGE / "docker/Dockerfile")
    checks.true("Apptainer: its stages", list(stages) == ["build", "program"], f"{list(stages)}")
    for name in ("build", "program"):
        checks.true(f"Apptainer, {name}: the packages of the Dockerfile", docker.packages_of(stages[name]["post"]) == docker.packages(model[name]))
    calls = docker.cmake_calls([stages["build"]["post"]])
    checks.true("Apptainer: CMake is called as in the Dockerfile", calls == docker.cmake_calls(text for word, text in model["build"] if word == "RUN")[:3], f"{calls}")
    copied = {line.split()[0] for line in stages["build"]["files"].splitlines() if line.strip()}
    kept = {line[1:] for line in (REPO / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    checks.true("Apptainer: the files are those of the Dockerfile's context", copied == kept and all((REPO / name).exists() for name in copied), f"{copied ^ kept}")
    for stage, sections in stages.items():
        for part in {"post", "runscript", "test", "environment"} & set(sections):
            done = subprocess.run(["bash", "-n"], input=sections[part], capture_output=True, text=True)
            checks.true(f"Apptainer, {stage}: %{part} is a script", done.returncode == 0, done.stderr)


def scripts(checks):
    for path in [*PACKAGE.rglob("*.sbatch"), REPO / ".ci/run", REPO / ".ci/setup.sh", REPO / "demo", REPO / "check"]:
        done = subprocess.run(["bash", "-n", path], capture_output=True, text=True)
        checks.true(f"{path.relative_to(REPO)} is a script", done.returncode == 0, done.stderr)
        if shutil.which("shellcheck") and path.suffix == ".sbatch":
            done = subprocess.run(["shellcheck", path], capture_output=True, text=True)
            checks.true(f"{path.relative_to(REPO)}: shellcheck", done.returncode == 0, done.stdout[-400:])
    done = subprocess.run(["git", "check-ignore", "-q", "src/package/README.md"], cwd=REPO)
    checks.true("the recipes are not ignored by git", done.returncode != 0)


def demo(checks):
    """`./demo` installs what the scripts that it calls import, on a system that has nothing of it."""
    called = re.findall(r"postprocess/(\w+\.py)", (REPO / "demo").read_text())
    installed = re.search(r'^demo_packages="([^"]*)"', (REPO / ".ci/setup.sh").read_text(), re.M).group(1).split()
    exist_in_debian(checks, "demo", installed)
    imported = {f"python3-{name.lower()}" for name in project.modules_of(called)} - {"python3-pil", "python3-pandas"}  # of matplotlib; of tables that it does not ask for
    checks.true("demo installs what its scripts import", len(imported) > 3 and imported <= set(installed), f"{sorted(imported - set(installed))}")


def main():
    checks = Checks(__doc__)
    build = pathlib.Path(checks.program).parent
    for name, group in (("docker", dockerfile), ("context", context), ("apptainer", apptainer), ("scripts", scripts), ("demo", demo), ("spack", lambda c: spack_stub.check(c, PACKAGE)),
                        ("conda", lambda c: conda.check(c, PACKAGE)), ("workflows", lambda c: workflows.check(c, build))):
        if checks.wants(name):
            with checks.group(name):
                group(checks)
    checks.finish()


if __name__ == "__main__":
    main()
