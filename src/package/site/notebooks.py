"""Pages of the Python package's notebooks, of what is stored in them; nothing is run."""
import base64
import json

FOLDER = "src/python/notebooks"


def fenced(language, text):
    return f"```{language}\n{text.rstrip()}\n```\n"


def page(notebook, folder):
    """The text of a page; plots are written into `folder`, beside it."""
    parts, plots = [], 0
    for cell in json.loads(notebook.read_text())["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source + "\n")
            continue
        parts.append(fenced("python", source))
        for output in cell["outputs"]:
            data = output.get("data", {})
            if "image/png" in data:
                plots += 1
                name = f"{notebook.stem}_{plots}.png"
                (folder / name).write_bytes(base64.b64decode(data["image/png"]))
                parts.append(f"![{notebook.stem.replace('_', ' ')}: plot {plots}]({name})\n")
            elif "text/html" in data:  # a table with its picture
                parts.append(fenced("{raw} html", "".join(data["text/html"])))
            else:
                parts.append(fenced("", "".join(output.get("text") or data["text/plain"])))
    title, _, rest = "\n".join(parts).partition("\n")
    return f"{title}\n\nThis page shows what is stored in [the notebook]({notebook.name}).\n{rest}"


def pages(root, folder):
    """One page for each notebook of the checkout `root`, into the folder that Sphinx reads."""
    for notebook in sorted((root / FOLDER).glob("*.ipynb")):
        (folder / FOLDER / f"{notebook.stem}.md").write_text(page(notebook, folder / FOLDER))
