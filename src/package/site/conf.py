"""The documents as a site: Sphinx reads the folders' READMEs where they lie, with the pages of this folder and the Python package's docstrings."""
import importlib.util
import os
import pathlib
import re
import sys

sys.path[:0] = [os.environ["BS_PYTHON_PACKAGE"], str(pathlib.Path(__file__).resolve().parent)]
from pages import captions  # noqa: E402

project = "backspring"
author = copyright = "The backspring authors"
version = release = os.environ["BS_VERSION"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
root_doc = "README"
source_suffix = {".md": "markdown"}
exclude_patterns = ["src/package/site/*.py"]
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # the gallery's pictures are headings of the third level under the first
nitpicky = False
highlight_language = "none"
html_theme = "furo"
html_title = f"backspring {version}"
html_copy_source = html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {"sidebar_hide_name": False}
pygments_style = "default"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_mock_imports = [] if importlib.util.find_spec("ase") else ["ase"]
html_static_path = ["style.css"]
html_css_files = ["style.css"]
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "undoc-members": True, "show-inheritance": True}
linkcheck_ignore = [r".*"]  # the site is built without a network


def contents(app, docname, source):
    """The table of contents hangs on the README, which is the first page; its badges are for where the project is hosted."""
    source[0] = re.sub(r"\]\((\S*notebooks/\w+)\.ipynb\)", r"](\1.md)", source[0])  # notebooks are pages here
    if docname != root_doc:
        return
    text = re.sub(r"^\[!\[.*badge\.svg\).*\n", "", source[0], flags=re.M)
    for title, documents in captions(pathlib.Path(app.srcdir)):
        listed = "\n".join(documents)
        text += f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n{listed}\n```\n"
    source[0] = text


def plain(app, what, name, obj, options, lines):
    """Docstrings are plain text: `name: what it is` begins an item, an indented block is code, a star, a bar or a final underscore is itself."""
    out, item = [], False
    for line in lines:
        if not line.strip() or line.startswith("    "):
            begins_code = line.startswith("    ") and out and not out[-1].strip() and not any(one.startswith("    ") for one in out[-2:])
            if begins_code:
                out += ["::", ""]
            item = False
            out.append(line)
            continue
        text = "".join(part if n % 2 else re.sub(r"[*|\\]|_(?!\w)", r"\\\g<0>", part) for n, part in enumerate(re.split(r"(``.*?``|`[^`]*`)", line)))
        begins = re.match(r"(\w+): (.*)", text)
        before = out[-1].rstrip() if out else ""
        if begins and (item or not before or before.endswith(".")):
            out += ([] if item or not before else [""]) + [f"* **{begins[1]}**: {begins[2]}"]
            item = True
        else:
            out.append("  " + text if item else text)
    lines[:] = out


def setup(app):
    app.connect("source-read", contents)
    app.connect("autodoc-process-docstring", plain)
