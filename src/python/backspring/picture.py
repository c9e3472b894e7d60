"""Quick pictures of lattices, equilibria, motions and modes, by matplotlib."""

from __future__ import annotations

import os
from typing import Any, Optional, Tuple, Union

import numpy as np

from ._library import world
from .kinds import Floats
from .lattice import Lattice
from .looks import COLOURS

QUIET = "0.8"  # of what stays behind


def _segments(lattice: Lattice, x: Floats, box: Optional[Floats]) -> Floats:
    """(S, 2, 2 or 3) ends of the springs as they are drawn; one dimension along a line."""
    first = x[lattice.pairs[:, 0]]
    lines = np.stack([first, first + lattice._ways_at(x, box)], axis=1)
    return np.asarray(np.concatenate([lines, np.zeros_like(lines)], axis=-1) if lattice.dim == 1 else lines, float)


def _limit(axes: Any, ends: Floats, solid: bool) -> None:
    """One scale along all axes; slender bodies in space get some room across."""
    low, high = ends.min(axis=0), ends.max(axis=0)
    longest = float(max(high - low)) or 1.0
    half = np.maximum((high - low) / 2 + 0.05 * longest, 0.2 * longest if solid else 0.0)
    for axis, middle, h in zip("xyz", (low + high) / 2, half):
        getattr(axes, f"set_{axis}lim")(middle - h, middle + h)
        getattr(axes, f"set_{axis}label")(f"${axis}$ [m]")
        if solid:
            getattr(axes, f"{axis}axis").labelpad = (4 if axis == "z" else 0) + min(4 * half.max() / half.min(), 12)  # beside the numbers, also of slender bodies
            axes.locator_params(axis=axis, nbins=max(1, round(5 * h / half.max()) - 1))
    if solid:
        axes.tick_params(labelsize="small")
        axes.set_box_aspect(half, zoom=0.85)


def draw(lattice: Lattice, x: Floats, values: Optional[Floats] = None, label: str = "", title: str = "", *, behind: Optional[Floats] = None, box: Optional[Floats] = None,
         file: Union[str, os.PathLike[str], None] = None, size: Tuple[float, float] = (6.0, 5.0), dpi: float = 200,
         cmap: Any = None, largest: Optional[float] = None) -> Any:
    """Springs at x, coloured by values, grey without; particles that are fixed as squares; springs at `behind` in light grey below. cmap: of
    matplotlib, by default from blue (negative) by grey to red. largest: the value from which on springs have its last colour, by default the largest there is. box: its edges, where
    they are others than the lattice's."""
    import matplotlib

    if file:
        matplotlib.use("Agg", force=False)
    import matplotlib.pyplot as plt
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap

    lines, solid = _segments(lattice, x, box), lattice.dim == 3
    shown = np.concatenate([x, np.zeros_like(x)], axis=1) if lattice.dim == 1 else x
    width = min(1.5, 20 / np.sqrt(len(lattice) + 1)) if solid else min(2.0, 60 / np.sqrt(len(lattice) + 1))
    figure = plt.figure(figsize=size, layout="constrained")
    if solid:
        from mpl_toolkits.mplot3d.art3d import Line3DCollection as Collection

        axes = figure.add_subplot(projection="3d", computed_zorder=False)
    else:
        Collection, axes = LineCollection, figure.add_subplot()
        axes.set_aspect("equal")
    if behind is not None:
        axes.add_collection(Collection(_segments(lattice, behind, box), colors=QUIET, linewidths=0.7 * width, zorder=1))
    style: Any = dict(colors="0.45")
    if values is not None:
        found = np.nanmax(np.abs(values)) if np.isfinite(values).any() else 0.0
        most = largest or found or 1.0
        style = dict(cmap=cmap or LinearSegmentedColormap.from_list("pushed and pulled", COLOURS / 255), norm=plt.Normalize(-most, most))
    drawn = axes.add_collection(Collection(lines, linewidths=width, zorder=2, **style, **({} if solid else dict(capstyle="round"))))
    axes.scatter(*shown[lattice.fixed].T, marker="s", s=12, color="0.2", zorder=3)
    _limit(axes, np.concatenate([lines.reshape(-1, lines.shape[-1]), shown]), solid)
    if lattice.dim == 1:
        axes.yaxis.set_visible(False)
    if values is not None:
        drawn.set_array(np.asarray(values, float))
        figure.colorbar(drawn, label=label, shrink=0.8, extend="both" if found > most else "neither")
    axes.set_title(title)
    if file:
        root, kind = os.path.splitext(os.fspath(file))
        part = f"{root}.{world(None).rank}.part{kind or '.png'}"  # ranks that write one file would spoil what the others write
        figure.savefig(part, dpi=dpi)
        os.replace(part, root + (kind or ".png"))
        plt.close(figure)
    return figure
