#!/usr/bin/env python3
"""Which files of src an implicit step enters: the lines that run more often in two steps of a 6 x 6 net than in one, by gcov.

  cmake --preset coverage && cmake --build --preset coverage --target backspring
  tests/bench/files_per_step.py                 the files, by their lines that the second step runs
  tests/bench/files_per_step.py -- -ts_type cn  of other options
"""
import argparse
import collections
import gzip
import json
import pathlib
import subprocess
import sys
import tempfile

REPO = pathlib.Path(__file__).resolve().parents[2]
NET = ["-bs_lattice_type", "square", "-bs_lattice_size", "6,6", "-bs_lattice_fixed", "xmin", "-bs_gravity", "0,-9.81", "-ts_type", "beuler", "-ts_dt", "0.01"]


def counts(build, options):
    """{(file, line): how often it ran} of one run."""
    for old in build.rglob("*.gcda"):
        old.unlink()
    subprocess.run([build / "backspring", *NET, *options], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    found = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        data = [str(path) for path in build.rglob("*.gcda")]
        subprocess.run(["gcov", "--json-format", *data], cwd=folder, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for path in pathlib.Path(folder).glob("*.json.gz"):
            with gzip.open(path) as f:
                for file in json.load(f)["files"]:
                    name = (build / file["file"]).resolve()
                    if (REPO / "src") in name.parents:
                        for line in file["lines"]:
                            found[str(name.relative_to(REPO / "src")), line["line_number"]] += line["count"]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=REPO / "build/coverage", help="folder of a build with -DBS_COVERAGE=ON")
    parser.add_argument("options", nargs="*", help="further options of the run, after --")
    arguments = parser.parse_args()
    build = arguments.build.resolve()
    if not (build / "backspring").exists():
        sys.exit(f"{build}/backspring is not there: cmake --preset coverage && cmake --build --preset coverage --target backspring")
    one, two = (counts(build, [*arguments.options, "-ts_max_steps", str(steps)]) for steps in (1, 2))
    lines = collections.Counter(name for (name, line), count in two.items() if count > one[name, line])
    for name, number in lines.most_common():
        print(f"{number:5d} {name}")
    folders = {str(pathlib.PurePath(name).parent) for name in lines}
    print(f"{len(lines)} files in {len(folders)} folders, {sum(lines.values())} lines")


if __name__ == "__main__":
    main()
