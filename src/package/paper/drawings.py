"""The figures of the paper, of the curves that runs.py and measured.py give."""
import pathlib
import sys

import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parents[3] / "postprocess"))
from figure_style import COLORS, STYLE  # noqa: E402  (chooses the backend, too)
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.ticker import FuncFormatter, NullLocator  # noqa: E402

MARKS = "osD^v<>P"


def lettered(axes):
    for letter, ax in zip("abc", axes):
        ax.set_title(f"({letter})", loc="left", fontweight="bold")


def orders(ax, rows):
    for (name, order, steps, errors), color, mark in zip(sorted(rows, key=lambda row: (row[1], row[3][-1])), COLORS, MARKS):
        hollow = {"markersize": 7, "markerfacecolor": "none"} if name == "alpha2" else {"markersize": 4}  # its errors are those of cn
        ax.loglog(steps, errors, color=color, marker=mark, label=f"{name.split(' ra')[0]}, order {order}", **hollow)
    ax.set(xlabel="length of a step $h$ [s]", ylabel="largest relative error of $x$ and $v$")
    ax.set_ylim(5e-8, 0.2)
    ax.set_yticks([10.0**k for k in range(-7, 0)])
    ax.yaxis.set_minor_locator(NullLocator())
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02), handlelength=1.6)


def dome(ax, curves):
    line, values, sunk, load, limits = curves
    ax.plot(line, values, color=COLORS[6], label="Newton's method in NumPy")
    ax.plot(sunk[::5], load[::5], "o", color=COLORS[0], markersize=3, label="program, arc length")
    for n, (w, value) in enumerate(limits):
        ax.plot(w, value, "x", color=COLORS[1], markersize=7, markeredgewidth=1.6, label=None if n else "limit points in NumPy")
        ax.annotate(f"{value:.2f} N".replace("-", "\N{MINUS SIGN}"), (w, value), xytext=(0, -12 if value < 0 else 7), textcoords="offset points", ha="center", fontsize=8, color=COLORS[1])
    ax.set(xlabel="sinking of the crown [m]", ylabel="load [N]", ylim=(-37, 62))
    ax.legend(loc="upper center", borderaxespad=0.1)


def verification(curves):
    figure, axes = plt.subplots(1, 2, figsize=(7.4, 3.0), layout="constrained", width_ratios=(1, 1.05))
    orders(axes[0], curves["orders"])
    dome(axes[1], curves["dome"])
    lettered(axes)
    return figure


def dilution(ax, curves, medium):
    shares, found = curves
    line = np.linspace(0.6, 1, 200)
    ax.plot(line, [medium(share) for share in line], color=COLORS[6], label="effective medium")
    spread = np.std(found, axis=1, ddof=1)
    ax.errorbar(shares, np.mean(found, axis=1), spread, fmt="o", color=COLORS[0], markersize=4, capsize=2, elinewidth=1, label="mean and deviation of nets")
    ax.axvline(2 / 3, color=COLORS[1], linewidth=1, linestyle=(0, (4, 2)))
    ax.annotate("Maxwell's count", (2 / 3, 0.2), xytext=(-3, 0), textcoords="offset points", rotation=90, ha="right", va="center", fontsize=8, color=COLORS[1])
    ax.set(xlabel="share of the springs that are left, $p$", ylabel="shear modulus [N/m]")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.03))


def stiffening(ax, curves):
    strain, slope, soft, (free, taut) = curves
    middle = (strain[1:] + strain[:-1]) / 2
    ax.axvspan(free, taut, color=COLORS[1], alpha=0.25, linewidth=0, label="critical strain lies here")
    ax.axhline(soft, color=COLORS[6], linewidth=1, linestyle=(0, (4, 2)), label="at rest")
    ax.semilogy(middle, np.abs(slope["fibres"]), color=COLORS[0], marker="o", markersize=3, label="with bending")
    ropes = np.where(np.abs(slope["ropes"]) > 1e-8, slope["ropes"], np.nan)
    ax.semilogy(middle, ropes, "D", color=COLORS[1], markersize=4, label="without bending")
    ax.set(xlabel="shear strain", ylabel="slope of the shear stress [N/m]", ylim=(3e-5, 3e-1), xlim=(0, 0.33))
    ax.legend(loc="upper left")


def networks(curves, medium):
    figure, axes = plt.subplots(1, 2, figsize=(7.2, 3.0), layout="constrained")
    dilution(axes[0], curves["dilution"], medium)
    stiffening(axes[1], curves["stiffening"])
    lettered(axes)
    return figure


def cost(ax, rows):
    for ranks, color, mark in ((1, COLORS[0], "o"), (2, COLORS[1], "s")):
        count, time = np.transpose(rows[ranks])
        ax.loglog(count, time, color=color, marker=mark, markersize=4, label=f"{ranks} rank{'s' if ranks > 1 else ''}")
    ax.set(xlabel="particles", ylabel="time of a step for each particle [µs]", ylim=(1, 60))
    ax.set_yticks([1, 2, 5, 10, 20, 50])
    ax.yaxis.set_minor_locator(NullLocator())
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.legend(loc="upper right")


def peers(ax, rows):
    at = np.arange(len(rows))[::-1]
    for column, color, mark, below, label in ((1, COLORS[0], "o", False, "B1: even cube"), (2, COLORS[1], "D", True, "B2: 1 % of the springs stiff")):
        ax.plot([row[column] or np.nan for row in rows], at, mark, color=color, markersize=5, label=label)
        for y, row in zip(at, rows):
            if row[column]:
                ax.annotate(f"{row[column]:.2g}", (row[column], y), xytext=(0, -4 if below else 4), textcoords="offset points", va="top" if below else "bottom", ha="center", fontsize=7, color=color)
            else:
                ax.annotate("B2: did not converge", (0.011, y), va="center", fontsize=7, color=color)
    ax.set_xscale("log")
    ax.set(xlim=(0.01, 30), ylim=(-0.6, len(rows) - 0.4), xlabel="seconds of computing for 0.01 s of motion")
    ax.set_yticks(at, [row[0] for row in rows])
    ax.legend(loc="lower center", bbox_to_anchor=(0.35, 1.0), ncols=2, columnspacing=1.0, handletextpad=0.2, borderaxespad=0.1)


def performance(curves):
    figure, axes = plt.subplots(1, 2, figsize=(7.6, 3.2), layout="constrained", width_ratios=(0.85, 1))
    cost(axes[0], curves["sizes"])
    peers(axes[1], curves["peers"])
    axes[0].set_title("(a)", loc="left", fontweight="bold")
    axes[1].annotate("(b)", (-0.72, 1.03), xycoords="axes fraction", fontweight="bold", fontsize=9)
    return figure


def draw(curves, medium, folder, kinds=("png", "pdf")):
    """verification, networks and performance in the folder, in every format."""
    plt.rcParams.update(STYLE)
    for name, figure in (("verification", verification(curves)), ("networks", networks(curves, medium)), ("performance", performance(curves))):
        for kind in kinds:
            figure.savefig(folder / f"{name}.{kind}", dpi=160, metadata={"Software": None} if kind == "png" else {"CreationDate": None})
        plt.close(figure)
