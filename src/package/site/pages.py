"""Which documents the site has, and in what order they stand in its table of contents."""
import pathlib

OWN = "src/package/site"
# caption: documents that come first, in this order, and folders whose other documents follow
CAPTIONS = {
    "Learning": (["options/tutorial/README", "options/tutorial/structures", "postprocess/gallery/README"], ["options/tutorial"]),
    "I want to ...": ([], [f"{OWN}/tasks"]),
    "Fields": ([], [f"{OWN}/fields"]),
    "Using": (["options/README", "meshes/README", "postprocess/README", "src/package/README", f"{OWN}/cite"], ["options", "meshes", "postprocess"]),
    "Reference": (["options/reference/README", f"{OWN}/glossary", f"{OWN}/python", f"{OWN}/cpp", "src/python/README"], ["options/reference"]),
    "Notebooks": ([], ["src/python/notebooks"]),
    "How it works": (["src/tasks/README", "src/physics/README", "src/time/README", "src/solvers/README", "src/systems/linear/README", "src/output/README", "src/checkpoint/README"], []),
    "The project": (["src/README", "CONTRIBUTING", "CHANGELOG", "tests/README", "tests/bench/README"], ["src", "tests", ""]),
}


def documents(root):
    """Names of all documents below `root`, links followed."""
    found = []
    for path in sorted(root.iterdir()):
        if path.is_dir():
            found += [f"{path.name}/{name}" for name in documents(path)]
        elif path.suffix == ".md":
            found.append(path.stem)
    return found


def captions(root):
    """[(caption, documents)]: every document but the README itself, once."""
    left = [name for name in documents(pathlib.Path(root)) if name != "README"]
    placed = {caption: [name for name in first if name in left] for caption, (first, _) in CAPTIONS.items()}
    left = [name for name in left if not any(name in names for names in placed.values())]
    for caption, (_, folders) in CAPTIONS.items():
        for folder in folders:
            found = [name for name in left if not folder or name.startswith(folder + "/")]
            # the site's own pages go under their own captions
            found = [name for name in found if folder.startswith(OWN) or not name.startswith(OWN)]
            placed[caption] += found
            left = [name for name in left if name not in found]
    if left:
        raise SystemExit(f"no caption has {left}")
    return [(caption, names) for caption, names in placed.items() if names]
