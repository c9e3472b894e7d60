#!/usr/bin/env python3
"""The paper (src/package/paper): every number of its text is what short runs of the program and the benchmarks' results give, its figures are as they are drawn now, its citations and
its bibliography belong together. That a wrong number, one that nothing computes, one beside no comment and a comment beside no number are seen is tried."""
import contextlib
import io
import json
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO
from program import environment
from matplotlib import image

PAPER = REPO / "src" / "package" / "paper"
sys.path.insert(0, str(PAPER))
import make_paper  # noqa: E402

FIGURES = ("verification", "networks", "performance")
WORDS = (1500, 2500)
SECTIONS = ("Summary", "Statement of need", "Problem and equations", "Method", "Verification", "Performance", "Comparison with other programs and libraries", "Limits", "Availability", "References")


def numbers(checks, folder):
    """All computed anew and held against the text; the numbers, for the tests that follow."""
    done = subprocess.run([sys.executable, PAPER / "make_paper.py", "--program", checks.program, "-o", folder, "--kinds", "png", "--check"], capture_output=True, text=True, timeout=900,
                          env=environment(3))
    for line in done.stdout.splitlines():
        verdict, _, rest = line.strip().partition(" ")
        if verdict == "skip":
            checks.skip("paper.md", rest.strip())
        elif verdict in ("ok", "FAILED"):
            checks.true("paper.md", verdict == "ok", rest.strip())
    checks.true("paper.md to its end", done.returncode == 0, done.stdout.strip().splitlines()[-1] if done.stdout.strip() else done.stderr.strip()[-300:])
    return json.loads((folder / "numbers.json").read_text())


def pictures(checks, folder):
    """Those beside the paper are those drawn now, and are small enough to lie in the repository."""
    for name in FIGURES:
        shipped, now = PAPER / f"{name}.png", folder / f"{name}.png"
        one, other = (image.imread(path)[..., :3] for path in (shipped, now))
        share = (abs(one - other).max(axis=-1) > 0.2).mean() if one.shape == other.shape else 1.0
        checks.true(f"{name}.png as it is drawn now", share < 3e-3, f"{share:.2%} of the points are others")
        checks.below(f"{name}.png: size [kB]", shipped.stat().st_size / 1e3, 150)


def faults(checks, found):
    """What must be seen: each text is the paper's with one thing changed."""
    text = (PAPER / "paper.md").read_text()
    changes = {"a wrong number": ("64,000<!-- figure: b_particles -->", "65,000<!-- figure: b_particles -->"), "a bound that does not hold": ("below(1e-8, dome_off_load)", "below(-1, dome_off_load)"),
               "a number that nothing computes": ("figure: b_particles", "figure: c_particles"), "a number beside no comment": ("64,000<!-- figure: b_particles -->", "64,000"),
               "a comment beside no number": ("B1 is a sheared cube of 64,000<!-- figure", "B1 is a sheared cube of <!-- figure")}
    for what, (before, after) in changes.items():
        with contextlib.redirect_stdout(io.StringIO()) as said:
            wrong, _ = make_paper.check(text.replace(before, after, 1), found)
        checks.true(f"{what} is seen", text.count(before) >= 1 and wrong >= 1, "; ".join(re.sub(r"\s+", " ", line) for line in said.getvalue().splitlines() if "FAILED" in line)[:120])
    changed = dict(found, b1=found["b1"] * 1.1)
    with contextlib.redirect_stdout(io.StringIO()):
        wrong, _ = make_paper.check(text, changed)
    checks.true("a benchmark with another result is seen", wrong >= 1)


def citations(checks):
    """Keys of the text and of the bibliography, fields of its entries, and what CITATION.cff has."""
    text, bibliography = (PAPER / "paper.md").read_text(), (PAPER / "paper.bib").read_text()
    cited = set(re.findall(r"@(\w+)", " ".join(re.findall(r"\[(@[^\]]*)\]", text))))
    entries = dict(re.findall(r"^@\w+\{(\w+),\n(.*?)^\}", bibliography, re.S | re.M))
    checks.true(f"each of the {len(cited)} works cited has an entry, each entry is cited", len(cited) > 15 and cited == set(entries), f"{sorted(cited ^ set(entries))}")
    bare = [key for key, body in entries.items() if not all(re.search(rf"^\s*{field}\s*= \{{", body, re.M) for field in ("author", "title"))]
    checks.true("entries have authors and titles", not bare, f"{bare}")
    cff = (REPO / "CITATION.cff").read_text()
    for field, pattern in (("title", r'^title: "(.*)"$'), ("authors", r'^  - name: "(.*)"$')):
        checks.true(f"{field} as in CITATION.cff", re.findall(pattern, text, re.M) == re.findall(pattern, cff, re.M) != [])


def form(checks):
    """A short text with the sections of one."""
    text = re.sub(r"\A---\n.*?\n---\n", "", (PAPER / "paper.md").read_text(), flags=re.S)
    count = len(re.sub(r"<!--.*?-->", "", text, flags=re.S).split())
    checks.true(f"{WORDS[0]} to {WORDS[1]} words", WORDS[0] <= count <= WORDS[1], f"{count}")
    found = re.findall(r"^## (.*)$", text, re.M)
    checks.true("sections", tuple(found) == SECTIONS, f"{found}")


def main():
    checks = Checks(__doc__)
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        for part in (citations, form):
            with checks.group(part.__name__):
                part(checks)
        with checks.group("numbers"):
            found = numbers(checks, folder)
            pictures(checks, folder)
            faults(checks, found)
    checks.finish()


if __name__ == "__main__":
    main()
