#!/usr/bin/env python3
"""Builds the documents as static HTML with search: make_site.py --program build/release/backspring --python build/release/python --output build/release/site

Sphinx reads a folder of links to the documents where they lie in the checkout, so that links between them are right in both; the glossary and pages of the notebooks are generated into it.
Warnings (a link or a heading that is not there, a document without a place) are errors.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys

import glossary
import notebooks
from pages import OWN

REPO = pathlib.Path(__file__).resolve().parents[3]


def tracked(top):
    """Files of the checkout below `top`, without what builds and editors leave."""
    return [path for path in sorted(top.rglob("*")) if path.is_file() and not {"__pycache__", ".ipynb_checkpoints"} & set(path.parts)]


def stage(folder, program):
    """`folder`: links to all files, which pages show or offer, and the generated pages."""
    shutil.rmtree(folder, ignore_errors=True)
    for top in (*sorted(REPO.glob("*.md")), *(REPO / name for name in ("LICENSE", "CITATION.cff", "CMakeLists.txt", "CMakePresets.json", "demo", "check", "options", "meshes", "postprocess", "src", "tests"))):
        for path in [top] if top.is_file() else tracked(top):
            link = folder / path.relative_to(REPO)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(path)
    told = subprocess.run([program, "-help"], capture_output=True, text=True, cwd=folder)
    if "-bs_task" not in told.stdout:
        sys.exit(f"{program} -help: {told.stderr.strip()[-300:]}")
    text = glossary.page(told.stdout, (REPO / "options/reference/README.md").read_text())
    (folder / OWN / "glossary.md").write_text(text)
    notebooks.pages(REPO, folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True, type=pathlib.Path)
    parser.add_argument("--python", required=True, type=pathlib.Path, help="the folder of the built Python package")
    parser.add_argument("--output", required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    source = output.with_name(output.name + "_source")
    stage(source, arguments.program.resolve())
    shutil.rmtree(output, ignore_errors=True)
    version = re.search(r"VERSION (\d+\.\d+\.\d+)", (REPO / "CMakeLists.txt").read_text())[1]
    env = dict(os.environ, BS_PYTHON_PACKAGE=str(arguments.python.resolve()), BS_VERSION=version, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-j", "auto", "-b", "html", "-c", REPO / OWN, "-d", f"{source}/.doctrees", source, output]
    if subprocess.run([str(word) for word in command], env=env).returncode:
        sys.exit("the site has faults: see above")
    shutil.copy(output / "README.html", output / "index.html")
    print(f"{output}/index.html")


if __name__ == "__main__":
    main()
