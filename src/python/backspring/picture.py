"""Quick pictures of equilibria."""

import numpy as np


def draw(equilibrium, file=None, size=(6.0, 5.0), dpi=200, cmap="coolwarm"):
    """Springs coloured by tension [N], particles that are fixed as squares. One dimension is drawn along a line."""
    import matplotlib

    if file:
        matplotlib.use("Agg", force=False)
    import matplotlib.pyplot as plt
    from matplotlib.collections import LineCollection

    lattice, x = equilibrium.lattice, equilibrium.x
    first = x[lattice.pairs[:, 0]]
    lines, shown = np.stack([first, first + lattice.replace(x=x).ways()], axis=1), x
    if lattice.dim == 1:
        lines, shown = (np.concatenate([a, np.zeros_like(a)], axis=-1) for a in (lines, x))
    tension = np.asarray(equilibrium.tension)
    most = np.nanmax(np.abs(tension)) if np.isfinite(tension).any() else 1.0
    style = dict(cmap=cmap, norm=plt.Normalize(-(most or 1.0), most or 1.0), linewidths=min(2.0, 60 / np.sqrt(len(lattice) + 1)))
    figure = plt.figure(figsize=size, layout="constrained")
    if lattice.dim == 3:
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        axes = figure.add_subplot(projection="3d")
        drawn = axes.add_collection(Line3DCollection(lines, **style))
        axes.set_box_aspect(np.ptp(x, axis=0) + 1e-12)
    else:
        axes = figure.add_subplot()
        drawn = axes.add_collection(LineCollection(lines, capstyle="round", **style))
        axes.set_aspect("equal")
    drawn.set_array(tension)
    axes.scatter(*shown[lattice.fixed].T, marker="s", s=12, color="0.2", zorder=3)
    low, high = lines.reshape(-1, lines.shape[-1]).min(axis=0), lines.reshape(-1, lines.shape[-1]).max(axis=0)
    room = 0.05 * max(high - low)
    for axis, a, b in zip("xyz", low - room, high + room):
        getattr(axes, f"set_{axis}lim")(a, b)
        getattr(axes, f"set_{axis}label")(f"${axis}$ / m")
    figure.colorbar(drawn, label="tension / N", shrink=0.8)
    axes.set_title(f"load factor {equilibrium.load_factor:g}")
    if file:
        figure.savefig(file, dpi=dpi)
        plt.close(figure)
    return figure
