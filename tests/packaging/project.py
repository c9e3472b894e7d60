"""What the project itself says of its packages, presets, options and components."""
import ast
import json
import os
import pathlib
import re
import subprocess
import sys

REPO = pathlib.Path(__file__).resolve().parents[2]
CMAKE = [REPO / "CMakeLists.txt", *sorted((REPO / "cmake").glob("*.cmake")), REPO / "src/package/install.cmake", REPO / "src/python/CMakeLists.txt", REPO / "tests/CMakeLists.txt"]
PRESETS = json.loads((REPO / "CMakePresets.json").read_text())


def presets(kind):
    return {preset["name"]: preset for preset in PRESETS[f"{kind}Presets"]}


def components():
    return set(re.search(r"CPACK_COMPONENTS_ALL (.*?)\)", (REPO / "src/package/install.cmake").read_text())[1].split()) | {"python"}


def variables():
    """Variables of CMake that the project reads or declares, and those of CMake's own that the recipes give."""
    text = "\n".join(path.read_text() for path in CMAKE)
    return set(re.findall(r"\b(BS_\w+)\b", text)) | {"PETSC_DIR", "PETSC_ARCH", "SLEPC_DIR", "HDF5_ROOT"} & set(re.findall(r"\w+", text)) | {
        "CMAKE_CXX_FLAGS", "CMAKE_INSTALL_PREFIX", "CMAKE_INSTALL_LIBDIR", "CMAKE_BUILD_TYPE"}


def wrong_calls(calls):
    """What of calls of cmake is against presets, options and components."""
    wrong = []
    for call in calls:
        for kind, pattern in (("build", r"--build --preset (\S+)"), ("configure", r"cmake --preset (\S+)")):
            wrong += [f"{call}: there is no {kind} preset {name}" for name in re.findall(pattern, call) if name not in presets(kind)]
        wrong += [f"{call}: CMake reads no {name}" for name in re.findall(r"-D(\w+)=", call) if name not in variables()]
        wrong += [f"{call}: there is no component {name}" for name in re.findall(r"--component (\S+)", call) if name not in components()]
        for folder in re.findall(r"--install (\S+)", call):
            if "${sourceDir}/" + folder not in {preset.get("binaryDir") for preset in presets("configure").values()}:
                wrong.append(f"{call}: no preset builds in {folder}")
    return wrong


def packages_that_cmake_names():
    """Debian's packages in the messages about missing parts, but for those of the tests, of other choices and of petsc4py, which the images
    are without: the package brings four PETScs along."""
    text = (REPO / "cmake/dependencies.cmake").read_text()
    named = " ".join(re.findall(r'bs_missing\("[^"]*" "([^"]*)"', text))
    named += " " + " ".join(re.findall(r"is left out: apt install ([^\"]*)\"", (REPO / "src/python/CMakeLists.txt").read_text()))
    return set(re.sub(r"\([^)]*\)", "", named).split())


def recommended_packages():
    """What the .deb packages recommend for the tools and need for Python."""
    text = (REPO / "src/package/install.cmake").read_text()
    named = re.findall(r'CPACK_DEBIAN_(?:RUNTIME_PACKAGE_RECOMMENDS|PYTHON_PACKAGE_DEPENDS)\s+"([^"]*)"', text)
    return {word.strip() for word in re.sub(r"\([^)]*\)", "", ",".join(named)).split(",")}


def modules_of(scripts):
    """Modules that the scripts of postprocess and those of them that they import take from elsewhere than Python itself, also within functions."""
    seen, found, left = set(), set(), [REPO / "postprocess" / name for name in scripts]
    while left:
        script = left.pop()
        seen.add(script)
        for node in ast.walk(ast.parse(script.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module] if isinstance(node, ast.ImportFrom) else []
            for name in {name.split(".")[0] for name in names}:
                own = script.parent / f"{name}.py"
                if own.exists():
                    left += [own] if own not in seen else []
                elif name not in sys.stdlib_module_names:
                    found.add(name)
    return found


def owners_of_libraries(program):
    """Debian's packages that own the libraries which the program itself is linked with."""
    if not os.path.exists("/usr/bin/dpkg-query"):
        return set()
    needed = re.findall(r"\(NEEDED\).*\[(.*)\]", subprocess.run(["readelf", "-d", program], capture_output=True, text=True, check=True).stdout)
    where = dict(re.findall(r"^\s*(\S+) => (\S+)", subprocess.run(["ldd", program], capture_output=True, text=True, check=True).stdout, re.M))
    owners = set()
    for name in needed:
        real = os.path.realpath(where[name])
        for path in (real, real.removeprefix("/usr")):  # dpkg may know a library under the name of before the two folders became one
            done = subprocess.run(["dpkg-query", "-S", path], capture_output=True, text=True)
            if done.returncode == 0:
                owners.add(done.stdout.split(":")[0])
                break
        else:
            owners.add(f"owner of {real}")
    return owners
