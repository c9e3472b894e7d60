"""Colours of a scene, and what is drawn around it: the axes' directions and the scale."""
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from figure_style import written

STRAIN_LIGHT = LinearSegmentedColormap.from_list(
    "strain_light", ["#0b3c8c", "#2f7fc9", "#8fb4cf", "#a8a49c", "#e39a6b", "#d1432f", "#8a0f1e"])
STRAIN_DARK = LinearSegmentedColormap.from_list(
    "strain_dark", ["#35b7ff", "#3f8fe0", "#6c88a8", "#9a9a9a", "#d29a6a", "#ff7a45", "#ff3b3b"])


@dataclass(frozen=True)
class Theme:
    background: str
    ink: str
    faint: str
    slack: str
    fixed: str
    particle: str
    strain: object
    speed: str


THEMES = {"light": Theme("#ffffff", "#1a1a1a", "#b8b8b8", "#8a8a8a", "#1a1a1a", "#3a3a3a", STRAIN_LIGHT, "viridis"),
          "dark": Theme("#10141a", "#e8e8e8", "#4a525e", "#8a929e", "#f2f2f2", "#d0d4da", STRAIN_DARK, "plasma")}


def triad(scene, ax):
    """Short arrows along the axes of the space, lower left; returns them."""
    if scene.run.dim == 1:
        return []
    drawn = []
    length = float(np.clip(0.045 * ax.get_window_extent().width * 72 / ax.figure.dpi, 11, 20))  # points
    corner = (1.5 * length, 1.5 * length)
    for axis in range(scene.run.dim):
        tip = scene.camera.basis[:2, axis] * length
        if np.hypot(*tip) < 0.15 * length:
            continue
        arrow = {"arrowstyle": "-|>", "color": scene.theme.ink, "lw": 0.8, "mutation_scale": 6, "shrinkA": 0, "shrinkB": 0}
        drawn.append(ax.annotate("", xy=(corner[0] + tip[0], corner[1] + tip[1]), xytext=corner, xycoords="axes points",
                                 textcoords="axes points", zorder=6, arrowprops=arrow))
        drawn.append(ax.annotate("xyz"[axis], xy=(corner[0] + 1.4 * tip[0], corner[1] + 1.4 * tip[1]), xycoords="axes points",
                                 ha="center", va="center", fontsize=min(8, 0.65 * length), color=scene.theme.ink,
                                 style="italic", zorder=6))
    return drawn


def scale_bar(scene, ax):
    """A bar of 1, 2 or 5 times a power of ten, lower right; with perspective it holds at the middle of the scene."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    raw = 0.2 * (x1 - x0)
    power = 10.0 ** np.floor(np.log10(raw))
    length = max(m for m in (1, 2, 5) if m * power <= raw) * power
    right, level = x1 - 0.04 * (x1 - x0), y0 + 0.05 * (y1 - y0)
    ax.plot([right - length, right], [level, level], color=scene.theme.ink, lw=1.6, solid_capstyle="butt", zorder=6)
    unit = scene.run.unit("position")
    ax.annotate(f"{length:g} {written(unit)}".strip(), xy=(right - 0.5 * length, level), xytext=(0, 3), ha="center", va="bottom",
                textcoords="offset points", fontsize=8, color=scene.theme.ink, zorder=6)
