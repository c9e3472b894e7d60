#!/usr/bin/env python3
"""Load-displacement and stress-strain curves of plot.py against closed forms, of runs of the program itself:
/usr/bin/python3 tests/postprocess/test_load_paths.py --program build/release/backspring"""
import os
import pathlib
import sys

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "postprocess"), str(HERE.parent / "verify")]  # both have a module modes
import figures  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import movie  # noqa: E402
import plot  # noqa: E402
import study_table  # noqa: E402
from backspring_io import RunError, open_run  # noqa: E402
from harness import run_parts, write_lattice  # noqa: E402
from load_path import limit_points  # noqa: E402


def drawn(path, *words, kind="force"):
    """The panel of one run as {words of the legend: (x, y)} and the labels of its axes."""
    args = plot.parse([str(path), "-o", "none.png", "--kind", kind, *words])
    figure, ax = plt.subplots()
    with open_run(path) as run:
        figures.KINDS[kind](ax, [run], [""], args)
    curves = {line.get_label(): np.array(line.get_data()) for line in ax.get_lines()}
    labels = ax.get_xlabel(), ax.get_ylabel()
    texts = [text.get_text() for text in ax.texts]
    plt.close(figure)
    return curves, labels, texts


def curve(curves):
    """The one curve that is no mark and no axis."""
    return max(curves.values(), key=lambda line: line.shape[1])


def refused(path, *words, kind="force"):
    try:
        drawn(path, *words, kind=kind)
    except RunError as error:
        return str(error)
    return ""


def truss(folder):
    """Two bars of stiffness 1 N/m from (-1, 0) and (1, 0) to (0, h): pushed down by w = 0.3 - h the apex resists with 2 h (L/sqrt(1 + h^2) - 1), which has its
    extremes at h^2 = L^(2/3) - 1."""
    rest = np.hypot(1, 0.3)
    path = write_lattice(folder / "truss.h5", [[-1, 0], [1, 0], [0, 0.3]], 1.0, fixed=[1, 1, 0], pairs=[[0, 2], [1, 2]], stiffness=1.0)
    height = np.sqrt(np.cbrt(rest) ** 2 - 1)
    return path, lambda w: 2 * (0.3 - w) * (rest / np.hypot(1, 0.3 - w) - 1), np.array([0.3 - height, 0.3 + height])


def run(checks, path, **options):
    """Equilibria, in the file `path`."""
    checks.run({"bs_task": "statics", "bs_output": path, **options})
    return path


def snapping(checks, folder):
    """The von Mises truss by arc length under weight, and with its apex driven: one curve with two limit points, whatever the signs."""
    path, force, at = truss(folder)
    limit = force(at[0])
    arc = run(checks, folder / "arc.h5md", bs_lattice_file=path, bs_gravity="0,-0.02", bs_load_control="arc", bs_load_steps=20)
    curves, labels, texts = drawn(arc)
    x, y = curve(curves)
    checks.near("by arc length: the load factor over the apex' way down", 0.02 * y, force(x), 1e-10)
    checks.true("its labels", labels == ("displacement of particle 2 along $-y$ [m]", "load factor"), str(labels))
    checks.near("its limit points", 0.02 * curves["limit points"][1], [limit, -limit], 2e-6 * limit)
    checks.near("where they are", curves["limit points"][0], at, 1e-4)
    checks.true("their numbers beside them", texts == [f"{limit / 0.02:.4g}", f"\N{MINUS SIGN}{limit / 0.02:.4g}"], str(texts))
    x, y = curve(drawn(arc, "--component", "y", "--against", "displacement:2")[0])
    checks.near("along y: downwards is negative", 0.02 * y, force(-x), 1e-10)
    x, y = curve(drawn(arc, "--against", "arc")[0])
    checks.true("over the arc length", np.all(np.diff(x) > 0) and y[-1] == 1)
    driven = run(checks, folder / "driven.h5md", bs_lattice_file=path, bs_group_apex="ids:2", bs_motion_apex="x=fixed,y=velocity:-0.6", bs_load_steps=30)
    curves, labels, _ = drawn(driven)
    x, y = curve(curves)
    checks.near("driven: what the apex' support exerts along its way", y, force(x), 1e-10)
    checks.near("driven: limit points between load steps", curves["limit points"][1], [limit, -limit], 2e-4 * limit)
    checks.true("driven: labels", labels == ("displacement of apex along $-y$ [m]", "force of the support along $-y$ [N]"), str(labels))
    x, y = curve(drawn(driven, "--against", "load")[0])
    checks.near("driven: over the load factor", y, force(0.6 * x), 1e-10)
    checks.true("a path without arc length has none", "paths by arc length" in refused(driven, "--against", "arc"))
    checks.true("other words are refused", "displacement:GROUP" in refused(driven, "--against", "sideways"))
    checks.true("groups that are not there are named", "nobody" in refused(driven, "--against", "displacement:nobody"))


def chain(checks, folder):
    """n springs k in a row, drawn out by its end group: F = (k/n) u at the end, and at the middle twice that over its own displacement."""
    n, k = 8, 50.0
    at = np.arange(n + 1)
    path = write_lattice(folder / "chain.h5", np.stack([0.1 * at, 0 * at], 1), 0.1, pairs=np.stack([at[:-1], at[1:]], 1), stiffness=k)
    pulled = run(checks, folder / "pulled.h5md", bs_lattice_file=path, bs_group_wall="ids:0", bs_group_end=f"ids:{n}", bs_group_middle=f"ids:{n // 2}", bs_motion_wall="fixed",
                 bs_motion_end="velocity:0.2,0", bs_load_steps=4)
    curves, _, _ = drawn(pulled)
    x, y = curve(curves)
    checks.near("a chain's stiffness", y[1:] / x[1:], k / n, 1e-9)
    checks.true("without limit points", "limit points" not in curves)
    x, y = curve(drawn(pulled, "--against", "displacement:middle")[0])
    checks.near("over the displacement of its middle", y[1:] / x[1:], 2 * k / n, 1e-9)
    x, y = curve(drawn(pulled, "--groups", "wall")[0])
    checks.near("the wall pulls the other way", y[1:] / x[1:], -k / n, 1e-9)
    checks.true("a group without a reaction is told", "--groups middle: this group has no reaction; those with a reaction: end, wall" in refused(pulled, "--groups", "middle"),
                refused(pulled, "--groups", "middle"))
    checks.true("so is one that is not there", "--groups top: there is no such group" in refused(pulled, "--groups", "wall,top"), refused(pulled, "--groups", "wall,top"))
    checks.true("and the load factor against itself", "write --against displacement" in refused(pulled, "--load", "--against", "load"), refused(pulled, "--load", "--against", "load"))
    checks.true("the reaction against the load factor is none of these", not refused(pulled, "--against", "load"))
    checks.true("a direction that is not there is refused", "there are 2 dimensions" in refused(pulled, "--groups", "wall", "--against", "load", "--component", "z"))
    padded = run(checks, folder / "padded.h5md", bs_lattice_file=path, bs_group_wall="ids:0", bs_group_end=f"ids:{n}", bs_motion_wall="fixed", bs_motion_end="velocity:0.2,0",
                 bs_load_steps=4, bs_output_pad=3)
    for words in ([], ["--component", "y"], ["--groups", "wall,end", "--against", "load"]):
        (lines, *_), (plain, *_) = drawn(padded, *words), drawn(pulled, *words)
        checks.near(f"padded: {' '.join(words)}", [*lines.values()][0], [*plain.values()][0], 1e-12)
    for name in (padded, pulled):
        plot.main([str(name), "-o", str(folder / "arrows.png"), "--kind", "state", "--reactions"])
        movie.main([str(name), "-o", str(folder / "arrows.png"), "--reactions"])
    with open_run(pulled) as opened:
        checks.true("its sheet has the curve", plot.default_kinds([opened]) == ["state", "force", "energy", "iterations"], str(plot.default_kinds([opened])))
    picture = folder / "state.svg"
    plot.main([str(pulled), "-o", str(picture), "--kind", "state,force", "--frame=2"])
    checks.true("titled by its load factor", "load factor 0.5" in picture.read_text() and os.path.getsize(picture) > 1000)


def marks(checks, folder):
    """Which points are marked: extremes between rows, none of a straight or noisy line, ends not."""
    x = np.linspace(0, 4, 41)
    limits, backs = limit_points(x, np.sin(np.pi * x / 2))
    checks.near("extremes of a sine", limits, [(1, 1, 1), (3, -1, 0)], 1e-4)
    checks.true("it does not turn back", backs == [])
    limits, backs = limit_points(np.sin(np.pi * x / 2), x)
    checks.near("turned on its side", backs, [(1, 1), (-1, 3)], 1e-4)
    checks.true("and has no limit points then", limits == [])
    noise = 1e-4 * (-1.0) ** np.arange(41)
    checks.true("nor has a line with small errors, or a level one", limit_points(x, x + noise) == ([], []) and limit_points(x, 0 * x + 3) == ([], []))
    jump = np.where(x < 2, x, x - 1.5)
    checks.near("a jump: the rows before and behind", limit_points(x, jump)[0], [(1.9, 1.9, 1), (2.0, 0.5, 0)], 1e-12)
    way = np.concatenate([np.linspace(0, 2, 21), np.linspace(1.9, 0, 20)])  # a softening curve, its peak at x = 1, from which the way back is straight
    limits, backs = limit_points(way, np.where(np.arange(41) <= 20, way * np.exp(1 - way), 2 * np.exp(-1) - 2 * (2 - way)))
    checks.near("turned back where it falls: the peak alone is a limit point", limits, [(1, 1, 1)], 1e-4)
    checks.near("and the end of the way a turning point", backs, [(2, 2 * np.exp(-1))], 1e-12)
    rising = np.where(np.arange(41) <= 20, way, 2 - 3 * (2 - way))
    checks.true("turned back where it rises: no limit point at all", limit_points(way, rising) == ([], [(2.0, 2.0)]), str(limit_points(way, rising)))


def sheared(checks, folder):
    """A triangular lattice of springs k in simple shear: stress summed here over its three kinds of spring, modulus sqrt(3)/4 k at the start, as -bs_task moduli has it."""
    k, top = 100.0, 0.1
    net = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": k, "bs_lattice_spacing": 1}
    path = run(checks, folder / "sheared.h5md", bs_box_strain=f"xy=velocity:{top}", bs_load_steps=40, **net)
    springs = np.array([[1, 0], [0.5, np.sqrt(0.75)], [-0.5, np.sqrt(0.75)]])

    def stress(gamma):
        r = springs @ np.array([[1, 0], [gamma, 1]])
        length = np.linalg.norm(r, axis=1)
        return k * np.array([(((length - 1) / length) * r[:, a] * r[:, b]).sum() for a, b in ((0, 0), (1, 1), (0, 1))]) / np.sqrt(0.75)

    curves, labels, _ = drawn(path, kind="stress")
    for column, name in enumerate(("xx", "yy", "xy")):
        x, y = curves[rf"$\sigma_{{{name}}}$"]
        checks.near(f"stress {name} over the shear", y, [stress(g)[column] for g in x], 1e-10)
        checks.near("the shear", x, np.linspace(0, top, 41), 1e-14)
    checks.true("labels", labels == (r"shear strain $\gamma_{xy}$", r"stress $\sigma$ [N/m]"), str(labels))
    curves, labels, _ = drawn(path, kind="modulus")
    x, y = curve(curves)
    h = 1e-6
    checks.near("its slope", y, [(stress(g + h)[2] - stress(g - h)[2]) / (2 * h) for g in x], 3e-3)
    stiffness = checks.run({"bs_task": "moduli", **net}).report["stiffness"]
    checks.near("the slope at the start: the closed form", y[0], np.sqrt(3) / 4 * k, 3e-3)
    checks.near("the slope at the start: -bs_task moduli", y[0], stiffness[2][2], 3e-3)
    with open_run(path) as opened:
        names = list(opened.observables.columns)
        checks.true("its sheet has stress over strain", plot.default_kinds([opened])[:2] == ["state", "stress"], str(plot.default_kinds([opened])))
    checks.true("columns of tables have the components' names", {"stress_xx", "stress_yy", "stress_xy"} <= set(names) and "stress_x" not in names, str(names))
    checks.true("a component that is not there is refused", "there are xx, yy, xy" in refused(path, "--component", "zz", kind="stress"))
    curves, labels, _ = drawn(path, "--component", "yy", kind="stress")
    x, y = curves[r"$\sigma_{yy}$"]
    checks.near("a normal stress over the shear", y, [stress(g)[1] for g in x], 1e-10)
    checks.true("which is the strain that there is", labels[0] == r"shear strain $\gamma_{xy}$" and np.ptp(x) > 0.09, str(labels))
    curves, labels, _ = drawn(path, "--component", "yy", kind="modulus")
    x, y = curve(curves)
    checks.near("its slope over the shear", y, [(stress(g + h)[1] - stress(g - h)[1]) / (2 * h) for g in x], 3e-3)
    checks.true("and the slope's name", labels[1] == r"modulus $d\sigma_{yy}/d\gamma_{xy}$ [N/m]", str(labels))


def pulled(checks, folder):
    """The same lattice drawn along x, free across: its modulus 2/sqrt(3) k; and a loading that turns back has a slope on either way."""
    net = {"bs_lattice_type": "triangular", "bs_lattice_size": "6,6", "bs_lattice_periodic": "xy", "bs_lattice_dim": 2, "bs_lattice_stiffness": 100}
    report = folder / "report.json"
    path = run(checks, folder / "pulled.h5md", bs_box_stress="xx=1e-3,yy=0,xy=0", bs_load_steps=4, **net)
    x, y = curve(drawn(path, kind="modulus")[0])
    checks.near("Young's modulus", y, 200 / np.sqrt(3), 1e-2)
    with open_run(path) as opened:
        names = list(opened.observables.columns)
    checks.true("free strains have the components' names", {"free_strain_xx", "free_strain_yy", "free_strain_xy"} <= set(names), str(names))
    report.write_text('{"stiffness": [[1, 2, 3], [4, 5, 6], [7, 8, 9]], "last_stress": [1, 2, 3], "last_momentum": [1, 2], "box_stress": {"components": ["xy", "xx"], "strain": [1, 2]}}')
    row = study_table.flat_report(str(report))
    checks.true("so do columns of studies", (row["stiffness_xx_xy"], row["stiffness_xy_xx"], row["last_stress_xy"], row["last_momentum_y"], row["box_stress_strain_xx"]) == (3, 7, 3, 2, 2))
    cyclic = run(checks, folder / "cyclic.h5md", bs_box_strain="xy=sinusoid:0.01,1", bs_load_steps=41, **net)
    x, y = curve(drawn(cyclic, kind="modulus")[0])
    checks.near("to and fro", y, np.sqrt(3) / 4 * 100, 0.05)


if __name__ == "__main__":
    run_parts("load paths", (snapping, chain, marks, sheared, pulled))
