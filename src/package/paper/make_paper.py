#!/usr/bin/env python3
"""Figures and numbers of the paper, of short runs of the program (runs.py, adjoint.py) and of what the benchmarks have measured (measured.py).

    src/package/paper/make_paper.py --program build/release/backspring -o FOLDER     # verification, networks, performance as .png and .pdf, numbers.json, numbers.md
    src/package/paper/make_paper.py --program build/release/backspring --check       # every number of paper.md against them
    src/package/paper/make_paper.py --numbers FOLDER/numbers.json --check            # the same without new runs

Behind a number of paper.md stands what it is, `<!-- figure: EXPRESSION within TOLERANCE -->`, as in the other documents (tests/examples/figures.py), with the names of numbers.md.
`below(1e-14, off)` is for bounds: it is 1e-14 unless `off` is larger, which is a fault. Numbers without such a comment are faults, other than in headings, formulas, code,
citations, links and names (ALLOWED).
"""
import argparse
import json
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
REPO = HERE.parents[2]
sys.path[:0] = [str(HERE), str(REPO / "tests/examples")]
import figures as document  # noqa: E402

ALLOWED = ("C++17", "H5MD", "HDF5", "B1", "B2", "DOP853", "BSD 2-clause", "Debian 12", "Figure 1", "Figure 2", "Figure 3")  # names with digits
FORMATS = {bool: str, int: "{:,}".format, float: "{:.6g}".format}


def adjoint(program):
    """Numbers of the Python package beside the program, none where it is not built."""
    package = program.parent / "python"
    if not package.is_dir():
        return {}
    env = dict(os.environ, PYTHONPATH=str(package), OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    return json.loads(subprocess.run([sys.executable, HERE / "adjoint.py"], env=env, check=True, capture_output=True, text=True).stdout)


def collect(program):
    """All numbers and curves."""
    import measured
    import runs
    numbers, curves = {"bad_inputs": document.Folder(HERE).bad_inputs()}, {}
    with tempfile.TemporaryDirectory() as scratch:
        for part in [*measured.PARTS, *(lambda part=part: part(program, pathlib.Path(scratch)) for part in runs.PARTS)]:
            found, drawn = part()
            numbers.update(found)
            curves.update(drawn)
    numbers.update(adjoint(program))
    return json.loads(json.dumps(numbers, default=lambda value: value.item())), curves, runs.medium


def table(numbers):
    """numbers.md: every name and its value."""
    def rows(name, value):
        if isinstance(value, dict):
            return [row for key, one in value.items() for row in rows(f'{name}["{key}"]', one)]
        if isinstance(value, list):
            return [row for k, one in enumerate(value) for row in rows(f"{name}[{k}]", one)]
        return [f"| `{name}` | {FORMATS[type(value)](value)} |"]
    return "\n".join(["# Numbers of the paper", "", "| name | value |", "|---|---|", *(row for name in numbers for row in rows(name, numbers[name]))]) + "\n"


def bare_numbers(text, comment):
    """[(line, number)] of the numbers with no comment behind them; what need not have one is blanked first, line by line."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match[0])
    for pattern in (r"\A---\n.*?\n---\n", r"^#.*$", r"```.*?```", r"\$\$.*?\$\$", r"\$[^$]*\$", r"`[^`]*`", r"\[[^\]]*@[^\]]*\]", r"@\w+", r"\]\([^)]*\)", *map(re.escape, ALLOWED)):
        text = re.sub(pattern, blank, text, flags=re.S if pattern.startswith(("\\A", "```", "\\$\\$")) else re.M)
    found, begin = [], 0
    for match in [*comment.finditer(text), None]:
        piece = text[begin:match.start() if match else len(text)]
        numbers = list(re.finditer(r"\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?", re.sub(r"<!--.*?-->", blank, piece, flags=re.S)))
        for number in numbers[:-1] if match else numbers:
            found.append((text[:begin + number.start()].count("\n") + 1, number[0]))
        begin = match.end() if match else begin
    return found


def check(text, numbers):
    """A line for each number of the text; how many were wrong and how many could not be computed."""
    names = {**numbers, "abs": abs, "min": min, "max": max, "below": lambda bound, value: bound if value <= bound else math.nan}
    wrong = skipped = 0
    for line, shown, expression, tolerance in document.comments(text):
        try:
            value = float(eval(expression, {"__builtins__": {}}, names))
        except NameError as missing:
            known = "adjoint" in str(missing) and "adjoint_off" not in numbers  # the Python package may be left out
            skipped, wrong = skipped + known, wrong + (not known)
            print(f"  {'skip' if known else 'FAILED':6} line {line}: {shown}: {missing}")
            continue
        right = shown is not None and document.agrees(shown, value, tolerance)
        wrong += not right
        print(f"  {'ok' if right else 'FAILED':6} line {line}: {shown}: {expression} = {value:.6g}" + (f", within {tolerance}" if tolerance else ", to its digits"))
    for line, number in bare_numbers(text, document.COMMENT):
        wrong += 1
        print(f"  FAILED line {line}: {number}: no comment says what it is")
    return wrong, skipped


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, help="the built program")
    parser.add_argument("-o", "--output", type=pathlib.Path, help="folder of figures and numbers")
    parser.add_argument("--numbers", type=pathlib.Path, help="numbers.json of an earlier call, in the place of runs")
    parser.add_argument("--check", action="store_true", help="hold the paper's numbers against those computed and read")
    parser.add_argument("--paper", type=pathlib.Path, default=HERE / "paper.md")
    parser.add_argument("--kinds", default="png,pdf", help="formats of the figures")
    arguments = parser.parse_args()
    if not arguments.numbers and not arguments.program:
        parser.error("--program or --numbers is needed")
    begin, curves = time.time(), None
    if arguments.numbers:
        numbers = json.loads(arguments.numbers.read_text())
    else:
        numbers, curves, medium = collect(arguments.program.resolve())
    if arguments.output and curves:
        import drawings
        arguments.output.mkdir(parents=True, exist_ok=True)
        drawings.draw(curves, medium, arguments.output, arguments.kinds.split(","))
        (arguments.output / "numbers.json").write_text(json.dumps(numbers, indent=1) + "\n")
        (arguments.output / "numbers.md").write_text(table(numbers))
    if arguments.check:
        wrong, skipped = check(arguments.paper.read_text(), numbers)
        print(f"{wrong} wrong, {skipped} skipped, {time.time() - begin:.0f} s")
        sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
