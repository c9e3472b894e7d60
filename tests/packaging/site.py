#!/usr/bin/env python3
"""The documents as a site: it is built without a warning, has every document and notebook, every picture and link of its pages leads somewhere, search knows what is on them, each public name of the
Python package, each header of the library and each option has its place. That a broken link, a lost heading and a wrong name are seen is tried."""
import ast
import base64
import html.parser
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "verify"))
from harness import Checks, REPO, SKIPPED

SITE = REPO / "src/package/site"
OUTSIDE = ("build", "out", ".git", ".github", ".ci")


class Page(html.parser.HTMLParser):
    """Ids, and what href and src name, of one page."""

    def __init__(self, path):
        super().__init__()
        self.ids, self.targets = set(), set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        self.ids.add(attributes.get("id"))
        if tag in ("a", "img", "link", "script"):
            self.targets.update(attributes[name] for name in ("href", "src") if attributes.get(name))


def build(program, output):
    folder = pathlib.Path(program).parent / "python"
    return subprocess.run([sys.executable, SITE / "make_site.py", "--program", program, "--python", folder, "--output", output], capture_output=True, text=True, timeout=900)


def dead_links(site):
    """What pages name and is not there: files, and headings of pages."""
    pages = {path: Page(path) for path in site.rglob("*.html")}
    dead = []
    for path, page in pages.items():
        for target in page.targets:
            parts = urllib.parse.urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            there = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            if not there.is_file():
                dead.append(f"{path.relative_to(site)}: {target}")
            elif parts.fragment and there in pages and parts.fragment not in pages[there].ids:
                dead.append(f"{path.relative_to(site)}: {target}: no such heading")
    return dead, len(pages)


def documents(checks, site):
    found = [path.relative_to(REPO) for path in sorted(REPO.rglob("*.md")) if path.relative_to(REPO).parts[0] not in OUTSIDE]
    lost = [str(path) for path in found if not (site / path.with_suffix(".html")).is_file()]
    checks.true(f"each of the {len(found)} documents is a page", len(found) > 30 and not lost, f"{lost}")
    contents = (site / "index.html").read_text()
    lost = [str(path) for path in found if f'href="{path.with_suffix(".html")}"' not in contents and str(path) != "README.md"]
    checks.true("and stands in the table of contents", not lost, f"{lost}")
    pictures = [(path, name) for path in found for name in re.findall(r"!\[[^\]]*\]\(([^):]+)\)", (REPO / path).read_text()) if "badge.svg" not in name]
    lost = [name for _, name in pictures if not (site / "_images" / pathlib.Path(name).name).is_file()]
    checks.true(f"with its pictures ({len(pictures)})", len(pictures) > 20 and not lost, f"{lost}")
    dead, count = dead_links(site)
    checks.true(f"links inside {count} pages lead somewhere", count > len(found) and not dead, f"{dead[:5]}")


def notebooks(checks, site):
    """Each is a page with its words, as many plots and drawings as are stored, and all that is printed; links to notebooks lead to their pages."""
    folder = pathlib.PurePath("src/python/notebooks")
    found = sorted((REPO / folder).glob("*.ipynb"))
    contents = (site / "index.html").read_text()
    for notebook in found:
        cells = json.loads(notebook.read_text())["cells"]
        outputs = [output for cell in cells for output in cell.get("outputs", ())]
        page = site / folder / f"{notebook.stem}.html"
        text = page.read_text() if page.is_file() else ""
        plots = [output["data"]["image/png"] for output in outputs if "image/png" in output.get("data", ())]
        drawings = [one for output in outputs for one in re.findall(r"data:image/svg[^\"]*", "".join(output.get("data", {}).get("text/html", "")))]
        shown = [(site / "_images" / name).read_bytes() for name in re.findall(r'src="[./]*_images/([^"]+)"', text)]
        checks.true(f"{notebook.name}: its {len(plots)} plots and {len(drawings)} drawings are shown", plots and drawings and shown == [base64.b64decode(one) for one in plots]
                    and all(one in text for one in drawings), f"{len(shown)} plots, {text.count('data:image/svg')} drawings")
        headings = re.findall(r"^#+ (.*)$", "".join("".join(cell["source"]) + "\n" for cell in cells if cell["cell_type"] == "markdown"), re.M)
        printed = [line for output in outputs for line in output.get("text", ())]
        lost = [one for one in (*headings, *printed) if one.strip() not in re.sub(r"<[^>]*>", "", text)]
        checks.true(f"{notebook.name}: with its headings and what is printed, in the table of contents, with no mark-up left", not lost and f'href="{folder / notebook.stem}.html"' in contents
                    and "$" not in re.sub(r"<div class=.highlight.*?</div>", "", text, flags=re.S), f"{lost}")
    text = (site / "src/python/README.html").read_text()
    lost = [notebook.stem for notebook in found if f'href="notebooks/{notebook.stem}.html"' not in text]
    checks.true(f"the document of the Python package leads to the pages of the {len(found)} notebooks", len(found) > 4 and not lost, f"{lost}")


def names(checks, site):
    """The Python package's names by its source, the headers by backspring.hpp, options by -help."""
    tree = ast.parse((REPO / "src/python/backspring/__init__.py").read_text())
    public = next(ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign) and node.targets[0].id == "__all__")
    page = Page(site / "src/package/site/python.html")
    lost = [name for name in public if f"backspring.{name}" not in page.ids and not any(one and one.endswith(f".{name}") for one in page.ids)]
    checks.true(f"an entry for each of the {len(public)} names of the Python package", len(public) > 15 and not lost, f"{lost}")
    methods = [node.name for node in next(node for node in ast.parse((REPO / "src/python/backspring/motion.py").read_text()).body if getattr(node, "name", "") == "Simulation").body
               if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
    lost = [name for name in methods if f"backspring.Simulation.{name}" not in page.ids]
    checks.true(f"and for each of the {len(methods)} methods of Simulation", len(methods) > 5 and not lost, f"{lost}")
    headers = re.findall(r'#include "([^"]+)"', (REPO / "src/backspring.hpp").read_text())
    shown = (SITE / "cpp.md").read_text()
    checks.true("the headers that <backspring/backspring.hpp> includes are shown", len(headers) > 2 and all(f"../../{name}" in shown for name in headers))
    told = subprocess.run([checks.program, "-help"], capture_output=True, text=True).stdout
    options = set(re.findall(r"^\s+(-bs_\w+)", told, re.M))
    glossary = (site / "src/package/site/glossary.html").read_text()
    lost = [name for name in options if f">{name}<" not in re.sub(r"</?span[^>]*>", "", glossary).replace('<code class="docutils literal notranslate">', ">").replace("</code>", "<")]
    checks.true(f"the glossary has the {len(options)} options of -help", len(options) > 150 and not lost, f"{sorted(lost)[:5]}")
    prefixes = re.findall(r"-(ts|snes|ksp|mat|vec)_<", re.sub(r"</?span[^>]*>", "", glossary))
    checks.true("and the prefixes of PETSc", {"ts", "snes", "ksp", "mat"} <= set(prefixes), f"{sorted(set(prefixes))}")


def search(checks, site):
    text = (site / "searchindex.js").read_text()
    index = json.loads(text[text.index("(") + 1:text.rindex(")")])
    where = {name: n for n, name in enumerate(index["docnames"])}

    def known(word, document):
        hits = index["terms"].get(word, []), index["titleterms"].get(word, [])
        return any(where[document] in (hit if isinstance(hit, list) else [hit]) for hit in hits)
    for word, document in (("avalanch", "src/physics/README"), ("requeu", "src/package/README"), ("netlist", "src/systems/linear/README"), ("checkpoint", "src/checkpoint/README")):
        checks.true(f"search for {word} finds {document}", known(word, document))
    checks.true("search does not find what is not there", not known("avalanch", "src/package/site/cite"))


def installed(checks, site, folder):
    """The Python package brings the pages with it."""
    done = subprocess.run(["cmake", "--install", site.parent, "--component", "python", "--prefix", folder / "prefix"], capture_output=True, text=True)
    page = folder / "prefix/share/doc/python3-backspring/html/src/package/site/python.html"
    checks.true("the reference is installed with the Python package", done.returncode == 0 and page.is_file() and page.read_bytes() == (site / "src/package/site/python.html").read_bytes(),
                done.stderr[-200:])


def faults(checks, site, folder):
    """Faults are seen: of links, in a copy of one page; of documents, by the tool itself."""
    copy = folder / "copy"
    copy.mkdir()
    (copy / "a.html").write_text('<a id="here" href="#here"></a><a href="#gone"></a><a href="b.html"></a><a href="https://example.org/x"></a>')
    checks.true("a link to nothing and a heading that is gone are seen", len(dead_links(copy)[0]) == 2, f"{dead_links(copy)}")
    source = folder / "wrong"
    source.mkdir()
    (source / "README.md").write_text("# Title\n\n[a heading that is gone](other.md#gone) and [a file](none.md)\n")
    (source / "other.md").write_text("# Other\n")
    done = subprocess.run([sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-C", "-D", "extensions=myst_parser", "-D", "root_doc=README", "-D", "myst_heading_anchors=4",
                           source, folder / "out"], capture_output=True, text=True)
    checks.true("so does Sphinx see them", done.returncode != 0 and "other.md#gone" in done.stderr and "none.md" in done.stderr, done.stderr[-200:])


def main():
    checks = Checks(__doc__)
    missing = [name for name in ("sphinx", "myst_parser", "furo") if subprocess.run([sys.executable, "-c", f"import {name}"], capture_output=True).returncode]
    if missing or not (pathlib.Path(checks.program).parent / "python").is_dir():
        print(f"skipped: no {', '.join(missing) or 'Python package'}: apt install python3-sphinx python3-myst-parser furo pybind11-dev python3-dev python3-mpi4py")
        print("0 passed, 0 failed, 1 skipped")
        sys.exit(SKIPPED)
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch).resolve()
        site = pathlib.Path(checks.program).parent / "site"  # where the target writes it, and from where it is installed
        done = build(checks.program, site)
        checks.true("the site is built without a warning", done.returncode == 0 and not done.stderr.strip(), (done.stdout + done.stderr)[-600:] if done.returncode or done.stderr.strip() else "")
        if (site / "index.html").exists():
            for group in (documents, notebooks, names, search):
                with checks.group(group.__name__):
                    group(checks, site)
            with checks.group("installed"):
                installed(checks, site, folder)
        with checks.group("faults"):
            faults(checks, site, folder)
        shutil.rmtree(site, ignore_errors=True)
    checks.finish()


if __name__ == "__main__":
    main()
