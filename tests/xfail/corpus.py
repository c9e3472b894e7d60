"""Runs a table of bad inputs: each must end in one line that says what to mend.

For each row the input is written to a fresh folder and the program is run on it. Asked for: exit code 2; exactly one line
that begins "backspring: error:"; the fragment of the row in that line; no "1 rows" and the like; no "PETSC ERROR"; an end within 60 s. A few good
inputs, which must run, guard against a program that refuses everything; of what must only be warned of, the warning must
come before the first step. --list prints the tables instead, with the message each fragment belongs to.
"""
import argparse
import concurrent.futures
import functools
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from plurals import BESIDE  # noqa: E402
from program import environment  # noqa: E402

TIMEOUT = 60 * int(os.environ.get("BS_SLOWER", 1))  # [s]


def run(program, ranks, words, folder):
    """Exit code (None: did not end) and all that was said."""
    command = [*(["mpirun", "-n", str(ranks)] if ranks > 1 else []), str(program), *map(str, words)]
    process = subprocess.Popen(command, cwd=folder, env=environment(ranks), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True, errors="replace")
    try:
        said, _ = process.communicate(timeout=TIMEOUT)
        return process.returncode, said
    except subprocess.TimeoutExpired:
        process.terminate()  # mpirun ends its ranks
        said, _ = process.communicate()
        return None, said


def lines_of(said, kind):
    return [line for line in said.splitlines() if line.startswith(f"backspring: {kind}:")]


def faults_of_bad(code, said, fragment):
    """What is wrong with how the program ended."""
    lines = lines_of(said, "error")
    if code != 2:
        yield f"exit code {code}, should be 2"
    if len(lines) != 1:
        yield f"{len(lines)} lines of error, should be one"
    if not any(fragment in line for line in lines):
        yield f"no {fragment!r} in {lines}"


def faults_of_warned(code, said, fragment):
    yield from faults_of_good(code, said)
    if not any(fragment in line for line in lines_of(said, "warning")):
        yield f"no warning with {fragment!r}"


def faults_of_good(code, said):
    if code != 0 or lines_of(said, "error"):
        yield f"exit code {code}, should be 0: {lines_of(said, 'error')}"


@functools.lru_cache
def version(program):
    return subprocess.run([program, "-bs_version"], capture_output=True, text=True, check=True).stdout


def check(row, program, ranks, step):
    name, make, kind, fragment = row
    if name.endswith("beyond the indices") and "64-bit indices" in version(program):
        fragment = "needs at least"  # so many can be counted, there is no memory for them
    if name.endswith("more than PETSc holds") and "PETSc 3.18." not in version(program):
        fragment = "no lattice is given"  # 3.25 holds any number
    with tempfile.TemporaryDirectory(prefix="bad_input_") as folder:
        words = make(pathlib.Path(folder))
        code, said = run(program, ranks, [*words, *step], folder)
    if code is None:
        wrong = [f"did not end within {TIMEOUT} s"]
    elif kind == "good":
        wrong = list(faults_of_good(code, said))
    elif kind == "warned":
        wrong = list(faults_of_warned(code, said, fragment))
    else:
        wrong = list(faults_of_bad(code, said, fragment))
    if "PETSC ERROR" in said:
        wrong.append("a PETSc error came through")
    wrong += [f"'{found}' in a message" for line in lines_of(said, "error") + lines_of(said, "warning") for found in BESIDE.findall(line)]
    line = next(iter(lines_of(said, "error") + lines_of(said, "warning")), "")
    return name, wrong, line.replace(str(folder) + "/", ""), said


def rows_of(groups, good, warned):
    rows = [(name, make, "good", None) for name, make in good.items()]
    rows += [(name, make, "warned", fragment) for name, (make, fragment) in warned.items()]
    rows += [(name, make, "bad", fragment) for group in groups.values() for name, (make, fragment) in group.items()]
    names = [row[0] for row in rows]
    assert len(names) == len(set(names)), "a name in two groups would hide one"
    return rows


def main(doc, groups, good, warned=None, step=()):
    """Runs the rows of `groups` ({group: {name: (maker, fragment)}}), `good` ({name: maker}) and `warned`."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--program", type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--filter", default="", help="only cases whose name holds this")
    parser.add_argument("--jobs", type=int, default=2, help="runs at a time")
    parser.add_argument("--verbose", action="store_true", help="show each message")
    parser.add_argument("--list", action="store_true", help="print the table of inputs and messages, run nothing")
    arguments = parser.parse_args()
    if arguments.list:
        for group, table in groups.items():
            print(f"\n## {group}: {len(table)}\n\n| input | the message holds |\n|---|---|")
            for name, (_, fragment) in table.items():
                print(f"| {name} | `{fragment}` |")
        return 0
    if not arguments.program or not arguments.program.exists():
        sys.exit(f"{arguments.program}: no such program; build it, then give --program build/release/backspring")

    chosen = [row for row in rows_of(groups, good, warned or {}) if arguments.filter in row[0]]
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for name, wrong, line, said in pool.map(lambda row: check(row, arguments.program, arguments.ranks, step), chosen):
            print(f"{'FAIL' if wrong else 'ok  '} {name}")
            if arguments.verbose and line:
                print(f"       {line}")
            if wrong:
                failed += 1
                print("       " + "\n       ".join(wrong + said.splitlines()[:20]))
    print(f"{len(chosen) - failed} passed, {failed} failed, 0 skipped")
    if not chosen:
        sys.exit("no case has such a name")
    return 1 if failed else 0
