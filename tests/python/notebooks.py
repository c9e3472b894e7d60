#!/usr/bin/env python3
"""What notebooks show: tables and pictures of lattices, equilibria, modes and frames, and the notebooks of the package, run from their first cell to their
last; what they assert is theirs."""
import base64
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


def executed():
    """Every notebook of the package, from the beginning to the end; they are stored small, without what they show."""
    notebooks = sorted(FOLDER.glob("*.ipynb"))
    assert len(notebooks) >= 4
    for notebook in notebooks:
        cells = json.loads(notebook.read_text())["cells"]
        code = [one for one in cells if one["cell_type"] == "code"]
        assert notebook.stat().st_size < 10_000 and all(one["outputs"] == [] and one["execution_count"] is None for one in code), notebook.name
        assert any("assert" in line for one in code for line in one["source"]), f"{notebook.name} checks nothing"
        with tempfile.TemporaryDirectory() as folder:
            words = [sys.executable, "-m", "nbconvert", "--to", "notebook", "--execute", str(notebook), "--output-dir", folder, "--ExecutePreprocessor.timeout=200"]
            done = subprocess.run(words, capture_output=True, text=True, env=dict(os.environ, PYTHONPATH=PYTHON), cwd=folder)
            assert done.returncode == 0, done.stderr[-3000:]
            outputs = [out for one in json.loads((pathlib.Path(folder) / notebook.name).read_text())["cells"] for out in one.get("outputs", ())]
            kinds = [set(out.get("data", ())) for out in outputs]
            assert any("text/html" in one for one in kinds) and any("image/png" in one for one in kinds), f"{notebook.name}: {kinds}"
        print(f"  {notebook.name}: ok", flush=True)


def main():
    chosen = sys.argv[sys.argv.index("--filter") + 1] if "--filter" in sys.argv else ""
    for part in (pages, large, plots):
        if chosen in part.__name__:
            part()
            print(f"{part.__name__}: ok", flush=True)
    try:
        import ipykernel  # noqa: F401
        import nbconvert  # noqa: F401
    except ImportError:
        print("notebooks are not run: apt install python3-nbconvert python3-ipykernel")
        sys.exit(77)
    if chosen in "executed":
        executed()
        print("executed: ok")


if __name__ == "__main__":
    main()
