#!/usr/bin/env python3
"""What notebooks show: tables and pictures of lattices, equilibria, modes and frames, and the notebooks of the package, run from their first cell to their
last; what they assert is theirs. What they show is stored in them and held against what they show now. With --write it is stored anew."""
import base64
import copy
import html
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from helpers import HERE, PYTHON, python  # noqa: E402

import backspring as bs  # noqa: E402
import numpy as np  # noqa: E402
from cases import cell, parts, sheet, triangular  # noqa: E402

FOLDER = HERE.parents[1] / "src/python/notebooks"
LARGEST = 250_000  # bytes of a notebook
NUMBER = r"-?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?"
NEAR, TINY = 1e-3, 2e-6  # by what part a number may be another one (four digits are shown), and below what both are nothing
ITERATIONS = 0.1  # Newton's method may take some more or less with other libraries


def drawn(page):
    """The pictures of a page, each an image of its own."""
    return [ET.fromstring(base64.b64decode(one)) for one in re.findall(r'src="data:image/svg\+xml;base64,([^"]*)"', page)]


def shown(one):
    """The page of an object: its title, {row: value} of its table, and its pictures."""
    text = one._repr_html_()
    page = ET.fromstring(re.sub(r"&nbsp;|&minus;", "-", text).replace("<br>", "<br/>"))
    rows = [["".join(cell.itertext()) for cell in row] for row in page.iter("tr")]
    assert len(drawn(text)) == len(list(page.iter("img")))
    return rows[0][0], dict(rows[1:]), drawn(text)


def ends_of(svg):
    """(S, 2, 2) of the lines of a picture, in pixels, and the colour of each."""
    paths = list(svg.iter("{http://www.w3.org/2000/svg}path"))
    scale = float(svg.get("width")) / float(svg.get("viewBox").split()[2])
    moves = [np.array(re.findall(r"-?\d+", path.get("d")), float).reshape(-1, 2) for path in paths]
    lines = [np.cumsum(one, axis=0).reshape(-1, 2, 2) * scale for one in moves]
    return np.concatenate([np.zeros((0, 2, 2)), *lines]), [path.get("stroke") for path, some in zip(paths, lines) for _ in some]


def pages():
    """Numbers of the table, springs of the picture where they are, coloured by what pulls and what pushes."""
    net = bs.Lattice(**sheet())
    eq = bs.statics(net, loads={"bottom": (0.3, -20.0)})
    title, rows, (svg,) = shown(net)
    assert title == "Lattice" and rows["particles"].startswith("42 ") and rows["springs"] == "101" and "bottom (7)" in rows["groups"], rows
    assert len(list(svg.iter("{http://www.w3.org/2000/svg}rect"))) == 7 and float(svg.get("width")) == 360
    title, rows, (svg,) = shown(eq)
    assert title == "Equilibrium" and f"{eq.energy:.4g} J" == rows["elastic energy"] and "reaction of hung" in rows, rows
    (lines, colours), springs = ends_of(svg), eq.x[net.pairs] * [1, -1]
    scale = np.linalg.norm(np.diff(lines, axis=1), axis=2).sum() / np.linalg.norm(np.diff(springs, axis=1), axis=2).sum()
    springs = scale * springs + lines.mean(axis=(0, 1)) - scale * springs.mean(axis=(0, 1))
    order = np.array([np.argmin(abs(lines - one).sum(axis=(1, 2))) for one in springs])
    assert sorted(order) == list(range(101)) and abs(lines[order] - springs).max() < 0.15, "lines are drawn to scale"
    red = np.array([int(one[1:3], 16) - int(one[5:7], 16) for one in colours])[order]
    assert red[np.argmax(eq.tension)] > 80 and red[np.argmin(eq.tension)] < red[np.argmax(eq.tension)], "what pulls is red"
    assert colours[-1] == colours[order[np.argmax(abs(eq.tension))]], "the largest is drawn last"
    title, rows, pictures = shown(bs.modes(net, 6))
    assert title == "Modes" and rows["modes"] == "6" and len(pictures) == 4
    simulation = bs.Simulation(net, dt=1e-3)
    simulation.step()
    (frame,) = [f for k, f in enumerate(bs.run(net, dt=1e-3, until=1e-3)) if k == 1]
    assert shown(frame)[1]["t"] == "0.001 s" and len(ends_of(shown(frame)[2][0])[0]) == 101
    assert "stiffness" in shown(bs.moduli(bs.Lattice(**cell())))[1]
    for one in (bs.Lattice(**parts()), bs.Lattice([0.0, 1.0], [[0, 1]]), bs.Lattice([[0.0, 0]]), bs.Lattice([[1.0, 1], [1, 2]], [[0, 1]], groups={"a": [0]})):
        assert len(ends_of(shown(one)[2][0])[0]) == len(one.pairs)
    for one, words in ((eq, "Newton"), (bs.modes(net, 2), "2 of 42"), (frame, "t = 0.001 s"), (simulation, "1 step"), (eq.events, "0 springs"), (net, "101 springs")):
        assert repr(one).startswith("<backspring.") and words in repr(one) and len(repr(one)) < 160, repr(one)
    weak = np.where(np.arange(101) == np.argmax(eq.tension), 1e-3, 10.0)
    broken = bs.statics(net.replace(breaking={"critical_strain": weak}), loads={"bottom": (0.3, -20.0)})
    assert 1 == broken.broken.sum() == 101 - len(ends_of(shown(broken)[2][0])[0]) and shown(broken)[1]["broken springs"] == str(broken.broken.sum())


def large():
    """Of a large net a map, small and quickly made, where the largest values are to be seen; matplotlib has no part in it."""
    x, pairs, k, _ = triangular(150, 150, np.random.default_rng(2))
    net = bs.Lattice(x, pairs, stiffness=k)
    from backspring import looks

    values = np.zeros(len(pairs))
    values[40000] = -7.0
    begin = time.process_time()
    page = looks.picture(net, x, values, "tension", "N")
    assert len(page) < 150_000 and time.process_time() - begin < 5, len(page)
    (svg,) = drawn(page)
    strongest = [path.get("d") for path in svg.iter("{http://www.w3.org/2000/svg}path") if path.get("fill") == "#2166ac"]
    assert len(strongest) == 1 and strongest[0].count("M") == 1, "one square has the colour of the largest push"
    done = python("import sys, backspring as bs, numpy as np; net = bs.Lattice(np.eye(3), [[0, 1], [1, 2]]); net._repr_html_(); print('matplotlib' in sys.modules)")
    assert done.stdout == "False\n", done.stdout + done.stderr


def plots():
    """Pictures by matplotlib, in one dimension, two and three."""
    line = bs.Lattice([0.0, 1.0, 2.5], [[0, 1], [1, 2]], stiffness=5.0, fixed=[0], groups={"end": [2]})
    with tempfile.TemporaryDirectory() as folder:
        for k, net in enumerate((line, bs.Lattice(**sheet()), bs.Lattice(**parts()))):
            found = (net, bs.modes(net, 2), next(bs.run(net, dt=1e-3, until=1e-3)))
            for one in (*found, bs.statics(net)):
                name = f"{folder}/{k}_{type(one).__name__}.png"
                figure = one.plot(file=name)
                assert os.path.getsize(name) > 10000 and len(figure.axes) == (1 if one is net else 2), name


def run(notebook):
    """The notebook after its run, as jupyter gives it."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", str(notebook), "--output-dir", folder, "--ExecutePreprocessor.timeout=200"]
        done = subprocess.run(words, capture_output=True, text=True, env=dict(os.environ, PYTHONPATH=PYTHON), cwd=folder)
        assert done.returncode == 0, done.stderr[-3000:]
        return json.loads((pathlib.Path(folder) / notebook.name).read_text())


def small(png):
    """The picture with 256 colours, which plots can do with, and without the name of what has drawn it."""
    from PIL import Image

    out = io.BytesIO()
    Image.open(io.BytesIO(base64.b64decode(png))).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(out, "PNG", optimize=True)
    return base64.b64encode(out.getvalue()).decode()


def lines(text):
    return "".join(text).splitlines(keepends=True)


def kept(notebook, ran):
    """The notebook with what its run has shown: of each output the richest form alone, nothing of where and when it ran."""
    stored = copy.deepcopy(notebook)
    for count, (one, now) in enumerate(((a, b) for a, b in zip(stored["cells"], ran["cells"]) if a["cell_type"] == "code"), 1):
        one["metadata"], one["execution_count"], one["outputs"] = {}, count, []
        for out in now["outputs"]:
            if out["output_type"] == "stream":
                one["outputs"].append({"output_type": "stream", "name": out["name"], "text": lines(out["text"])})
                continue
            data = out["data"]
            form = next(form for form in ("text/html", "image/png", "text/plain") if form in data)
            shows = {"output_type": out["output_type"], "metadata": {}, "data": {form: small(data[form]) if form == "image/png" else lines(data[form])}}
            one["outputs"].append(dict(shows, execution_count=count) if out["output_type"] == "execute_result" else shows)
    return stored


def written(notebook):
    """As jupyter writes it."""
    return json.dumps(notebook, indent=1, sort_keys=True, ensure_ascii=False) + "\n"


def words_of(out):
    """The text of an output, its HTML without tags."""
    text = "".join(out["text"] if out["output_type"] == "stream" else next((v for k, v in out["data"].items() if k.startswith("text/")), ""))
    return html.unescape(re.sub(r"<[^>]*>", " ", text)).replace("\N{MINUS SIGN}", "-").split()


def differs(stored, now):
    """In what two texts differ, by more than their numbers may; None where in nothing."""
    if len(stored) != len(now) or re.sub(NUMBER, "#", " ".join(stored)) != re.sub(NUMBER, "#", " ".join(now)):
        return f"{' '.join(stored)!r} is stored, {' '.join(now)!r} came"
    for k, (a, b) in enumerate(zip(stored, now)):
        room = ITERATIONS if "iterations" in stored[max(0, k - 1):k] else NEAR
        for one, other in zip(re.findall(NUMBER, a), re.findall(NUMBER, b)):
            one, other = (float(number.replace(",", "")) for number in (one, other))
            if abs(one - other) > max(room * max(abs(one), abs(other)), TINY):
                return f"{' '.join(stored[max(0, k - 4):k + 1])} is stored, {b} came"
    return None


def looks_other(stored, now):
    """In what two pictures differ: of the same size by more than a few points, otherwise (other fonts) in their size by more than a few."""
    from matplotlib import image

    stored, now = (image.imread(io.BytesIO(base64.b64decode(png)), format="png")[..., :3] for png in (stored, now))
    if stored.shape == now.shape:
        other = (abs(stored - now).max(axis=-1) > 0.25).mean()
        return f"{other:.1%} of the points of a picture are others" if other > 0.003 else None
    return f"a picture of {stored.shape} is stored, one of {now.shape} came" if np.abs(np.array(stored.shape) - now.shape).max() > 30 else None


def faults(stored, ran):
    """What of a stored notebook is not as its run has it."""
    now = kept(stored, ran)
    for one, fresh in zip(stored["cells"], now["cells"]):
        if one["cell_type"] != "code":
            continue
        name = one["id"]
        forms = [[(out["output_type"], *out.get("data", {})) for out in some["outputs"]] for some in (one, fresh)]
        if forms[0] != forms[1] or one["execution_count"] != fresh["execution_count"]:
            yield f"{name}: {forms[0]} is stored, {forms[1]} came"
            continue
        if one["metadata"]:
            yield f"{name}: {one['metadata']} is stored with it"
        for out, other in zip(one["outputs"], fresh["outputs"]):
            if out.get("name") == "stderr" or re.search(r"/(tmp|home|root|usr|work)/", " ".join(words_of(out))):
                yield f"{name}: {' '.join(words_of(out))[:200]!r} is nothing to be stored"
            text = differs(words_of(out), words_of(other))
            shown_other = looks_other(out["data"]["image/png"], other["data"]["image/png"]) if "image/png" in out.get("data", ()) else None
            yield from (f"{name}: {fault}" for fault in (text, shown_other) if fault)
            images = [drawn("".join(some.get("data", {}).get("text/html", ""))) for some in (out, other)]
            counts = [[(svg.get("width"), len(ends_of(svg)[0])) for svg in some] for some in images]
            if counts[0] != counts[1]:
                yield f"{name}: pictures with widths and numbers of springs {counts[0]} are stored, {counts[1]} came"


def faults_are_seen(stored, ran):
    """A number that is another one, an output that is gone or too many and a picture of something else are told."""
    code = [n for n, one in enumerate(stored["cells"]) if one["cell_type"] == "code"]
    tables = [n for n in code if any("text/html" in out.get("data", ()) for out in stored["cells"][n]["outputs"])]
    plot = next(n for n in code if any("image/png" in out.get("data", ()) for out in stored["cells"][n]["outputs"]))

    def number(cells):
        (table,) = (out["data"]["text/html"] for out in cells[tables[0]]["outputs"] if "text/html" in out["data"])
        table[:] = [re.sub(r"(?<=>)\d[\d,]*(?=[ <])", "7.5", "".join(table), count=1)]

    def picture(cells):
        out = next(out for out in cells[plot]["outputs"] if "image/png" in out.get("data", ()))
        from matplotlib import image
        png = io.BytesIO()
        image.imsave(png, image.imread(io.BytesIO(base64.b64decode(out["data"]["image/png"])), format="png")[::-1], format="png")
        out["data"]["image/png"] = base64.b64encode(png.getvalue()).decode()

    for spoil in (number, picture, lambda cells: cells[plot].update(outputs=[]), lambda cells: cells[plot]["outputs"].extend(cells[tables[0]]["outputs"]),
                  lambda cells: cells[plot].update(metadata={"execution": "at noon"})):
        other = copy.deepcopy(stored)
        spoil(other["cells"])
        assert list(faults(other, ran)), "a fault is not seen"


def executed(write=False):
    """Every notebook of the package, from the beginning to the end: what it shows is stored in it, and no more."""
    notebooks = sorted(FOLDER.glob("*.ipynb"))
    assert len(notebooks) >= 4
    for notebook in notebooks:
        stored = json.loads(notebook.read_text())
        assert any("assert" in line for one in stored["cells"] if one["cell_type"] == "code" for line in one["source"]), f"{notebook.name} checks nothing"
        ran = run(notebook)
        if write:
            stored = kept(stored, ran)
            notebook.write_text(written(stored))
        found = list(faults(stored, ran))
        assert not found, f"{notebook.name}: {found}\ntests/python/notebooks.py --program PROGRAM --write stores what the notebooks show now"
        assert notebook.stat().st_size < LARGEST and notebook.read_text() == written(stored), f"{notebook.name}: {notebook.stat().st_size} bytes, or not as jupyter writes it"
        forms = {form for one in stored["cells"] for out in one.get("outputs", ()) for form in out.get("data", ())}
        assert {"text/html", "image/png"} <= forms, f"{notebook.name}: {forms}"
        faults_are_seen(stored, ran)
        print(f"  {notebook.name}: ok, {notebook.stat().st_size / 1000:.0f} kB", flush=True)


def main():
    chosen = sys.argv[sys.argv.index("--filter") + 1] if "--filter" in sys.argv else ""
    write = "--write" in sys.argv
    for part in (pages, large, plots):
        if chosen in part.__name__ and not write:
            part()
            print(f"{part.__name__}: ok", flush=True)
    try:
        import ipykernel  # noqa: F401
        import nbconvert  # noqa: F401
    except ImportError:
        print("notebooks are not run: apt install python3-nbconvert python3-ipykernel")
        sys.exit(77)
    if chosen in "executed":
        executed(write)
        print("executed: ok")


if __name__ == "__main__":
    main()
