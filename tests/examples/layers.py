#!/usr/bin/env python3
"""The layers of the source hold: a folder of src includes only what the table of src/README.md lets it include, base nothing but itself, and what the
table says of PETSc's types is so. Where position and velocity lie in a state is known to systems/layout.hpp alone. The unit tests are where the source is: a folder of tests/unit is one of src, and what lies in it includes a header of that folder.
The functions and files that src/README.md names exist. At the top lies what belongs there."""
import argparse
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src"
UNIT = ROOT / "tests" / "unit"
TOP = {"CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "CITATION.cff", "CHANGELOG.md", "CONTRIBUTING.md", "check", "demo", "cmake", "src", "options", "meshes", "tests",
       "postprocess"}
FOREIGN = {"physics": r"petsc|mpi\.h|\bMPI_|\bVec\b|\bMat\b", "lattice": r"petsc|mpi\.h|\bMPI_", "solvers": r"petscts|\bTS\b|\bTS[A-Z]\w*", "linalg": r"petscts|\bTS\b|\bTS[A-Z]\w*"}

STATES = ("systems/", "solvers/", "time/", "tasks/", "output/", "checkpoint/", "session/")  # what handles states asks Layout where things lie in them
DECODED = r"\b2 \* (static_cast<[\w:]+>\()?(\w+(\.|->))*(d|dim|dim_|dim\(\))(?![\w(.])"


def table(text):
    """folder -> the folders it may include, from the rows | `folder/` | holds | may include |."""
    rows = re.findall(r"^\| `(\w+)/` \|.*\| ([^|]*) \|$", text, re.M)
    return {name: set(re.findall(r"`(\w+)`", allowed)) for name, allowed in rows}


def faults(files, allowed):
    """What of the files {path below src: text} is against the table."""
    found = []
    for path, text in sorted(files.items()):
        room = path.split("/")[0] if "/" in path else None
        if room is None:
            continue  # main
        if room not in allowed:
            found.append(f"{path}: the table of src/README.md has no row {room}/")
            continue
        for name in re.findall(r'^#include "([^"]+)"', text, re.M):
            if name not in files:
                found.append(f"{path}: there is no src/{name}")
            elif name.split("/")[0] not in allowed[room] | {room} and allowed[room] != {"all"}:
                found.append(f"{path} includes {name}: {room}/ may include {', '.join(sorted(allowed[room])) or 'nothing else'}")
        code = re.sub(r'//[^\n]*|"(\\.|[^"\\\n])*"', "", re.sub(r'^#include "[^\n]*', "", text, flags=re.M))
        if room in FOREIGN and (hit := re.search(FOREIGN[room], code)):
            found.append(f"{path} names {hit.group(0)}, which {room}/ does not know")
        if path.startswith(STATES) and path != "systems/layout.hpp" and (hit := re.search(DECODED, code)):
            found.append(f"{path} computes places in a state ({hit.group(0)}): ask Layout (systems/layout.hpp)")
    return found


def unit_faults(tests, folders):
    """What of the unit tests {path below tests/unit: text} does not mirror the folders {folder of src: whether it has .cpp files}."""
    found = []
    for path, text in sorted(tests.items()):
        folder = path.rpartition("/")[0]
        if folder not in folders:
            found.append(f"tests/unit/{path}: there is no src/{folder}")
        elif not any(name.startswith(folder + "/") for name in re.findall(r'^#include "([^"]+)"', text, re.M)):
            found.append(f"tests/unit/{path} includes no header of src/{folder}/")
    return found


def missing_names(text, files):
    """What a document names in `code` that the source {path: text} does not have: members `Class::member`, files `folder/name.cpp` (`b.cpp` after `folder/a.cpp`, `::b` after `A::a`)."""
    code = "\n".join(files.values())
    found, folder = [], ""
    for quoted in re.findall(r"`([^`\n]+)`", text):
        for member in re.findall(r"\b[A-Z]\w+::(\w+)", quoted) if not quoted.startswith("-") else []:
            if not re.search(rf"\b{member}\b\s*[({{;=\[]", code):
                found.append(quoted)
        if re.fullmatch(r"[\w/]+\.[ch]pp", quoted):
            folder = quoted.rpartition("/")[0] if "/" in quoted else folder
            if not any(path == quoted or path.endswith("/" + quoted) or path == f"{folder}/{quoted}" for path in files):
                found.append(quoted)
    return found


def strangers(names):
    """What of the files of the project {names relative to its top} belongs to no folder: leftovers of tests are easily committed."""
    return sorted({name for name in names if name.split("/")[0] not in TOP and not name.startswith(".")})


def main():
    argparse.ArgumentParser(description=__doc__).parse_args()
    files = {str(p.relative_to(SOURCE)): p.read_text() for p in SOURCE.rglob("*") if p.suffix in (".hpp", ".cpp")}
    files = {path: text for path, text in files.items() if not path.startswith("package/")}
    allowed = table((SOURCE / "README.md").read_text())
    found = faults(files, allowed)
    # the test itself: what is wrong is seen
    wrong = {"solvers/a.hpp": '#include "time/b.hpp"\nvoid f(TS ts);\n', "time/b.hpp": "", "attic/c.cpp": "", "lattice/d.cpp": '#include "lattice/none.hpp"\n',
             "time/e.cpp": "a[i * 2 * net_->dim + c] = 0;\n", "systems/f.hpp": "v[i * 2 * d + d] = 2 * dt + 2 * d.x;\n"}
    if len(faults(wrong, allowed)) != 6:
        found.append("the test does not see " + "; ".join(wrong))
    tests = {str(p.relative_to(UNIT)): p.read_text() for p in UNIT.rglob("*.cpp")}
    tests = {path: text for path, text in tests.items() if not path.startswith("support/")}
    folders = {str(p.relative_to(SOURCE)): any(p.glob("*.cpp")) for p in SOURCE.rglob("*") if p.is_dir() and p.name != "package"}
    found += unit_faults(tests, folders)
    wrong = {"time/a.cpp": '#include "base/b.hpp"\n', "attic/c.cpp": "", "d.cpp": ""}
    if len(unit_faults(wrong, folders)) != 3:
        found.append("the test does not see " + "; ".join(wrong))
    found += [f"src/README.md names {name}, which the source does not have" for name in missing_names((SOURCE / "README.md").read_text(), files)]
    if missing_names("`Run::fly` of `base/none.cpp`, `Run::set_up` in `tasks/run.cpp`", files) != ["Run::fly", "base/none.cpp"]:
        found.append("the test does not see names that the source lacks")
    order = [name for name in allowed]
    for name, others in allowed.items():
        if others != {"all"}:
            found += [f"the table lets {name}/ and {other}/ include one another" for other in others if name in allowed[other] and order.index(other) > order.index(name)]
    kept = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True).stdout.split("\n")[:-1]  # none where there is no git
    found += [f"{name} lies at the top, where nothing belongs but {', '.join(sorted(TOP))}" for name in strangers(kept)]
    if strangers([".ci/run", "src/main.cpp", "left.xsp"]) != ["left.xsp"]:
        found.append("the test does not see files at the top")
    print("\n".join(found) or f"{len(files)} files in {len(allowed)} folders keep to the table, {len(tests)} unit tests lie where the source is")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
