#!/usr/bin/env python3
"""The bad inputs of the corpora as one table: how many of each kind, and two examples of input and message.

  table.py                            prints it
  table.py --write tests/README.md    puts it where the file's marks are
  table.py --check tests/README.md    exit code 1 if the file holds another

`bad_lattices.py --list` and its neighbours print every row.
"""
import argparse
import pathlib
import sys

import bad_lattices
import bad_linear
import bad_options

BEGIN, END = "<!-- table.py: begin -->\n", "<!-- table.py: end -->\n"


def table():
    lines = ["| what is read | bad inputs | for example | the line holds |", "|---|---|---|---|"]
    total = 0
    for corpus in (bad_lattices, bad_linear, bad_options):
        for group, rows in corpus.GROUPS.items():
            total += len(rows)
            telling = sorted(rows, key=lambda name: -len(rows[name][1]))[:2]
            for k, name in enumerate(telling):
                message = rows[name][1].replace("|", "\\|")
                first = f"{group} | {len(rows)}" if k == 0 else " | "
                lines.append(f"| {first} | {name.split(': ')[-1]} | {message} |")
    return "\n".join([*lines, f"| **all** | **{total}** | | |"]) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=pathlib.Path)
    parser.add_argument("--check", type=pathlib.Path)
    arguments = parser.parse_args()
    path = arguments.write or arguments.check
    if not path:
        print(table(), end="")
        return 0
    text = path.read_text()
    before, rest = text.split(BEGIN)
    present, after = rest.split(END)
    if arguments.write:
        path.write_text(before + BEGIN + table() + END + after)
    elif present != table():
        print(f"{path} is behind the corpora: run tests/xfail/table.py --write {path}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
