"""Colours of a scene, and what is drawn around it: the axes' directions and the scale."""
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from figure_style import number, written

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
    reaction: str
    strain: object
    speed: str


THEMES = {"light": Theme("#ffffff", "#1a1a1a", "#b8b8b8", "#8a8a8a", "#1a1a1a", "#3a3a3a", "#2d7a3e", STRAIN_LIGHT, "viridis"),
          "dark": Theme("#10141a", "#e8e8e8", "#4a525e", "#8a929e", "#f2f2f2", "#d0d4da", "#7ee08f", STRAIN_DARK, "plasma")}


def arrow_length(scene, ax):
    """Of the triad [points]; 0 in one dimension, which has none."""
    return 0.0 if scene.run.dim == 1 else float(np.clip(0.045 * ax.get_window_extent().width * 72 / ax.figure.dpi, 10, 16))


def triad_reach(scene, ax):
    """How far the triad reaches [points] below and above its corner, over all views of a film."""
    length = arrow_length(scene, ax)
    cameras = [scene._eye(angle) for angle in range(0, 360, 30)] if scene.turn else [scene.camera]
    ups = [1.4 * length * camera.basis[1, axis] for camera in cameras for axis in range(scene.run.dim)] + [0.0]
    return (5 - min(ups), 5 + max(ups)) if length else (0.0, 0.0)


def make_room(scene, ax):
    """Shortens `ax` from below by a strip for the triad and the scale bar, which so cover nothing; returns the lower left corner of the strip and the lower right
    [points of the figure]."""
    figure, place = ax.figure, ax.get_position()
    width, height = figure.get_figwidth() * 72, figure.get_figheight() * 72
    strip = max(sum(triad_reach(scene, ax)), 20.0) / height
    ax.set_position([place.x0, place.y0 + strip, place.width, place.height - strip])
    return np.array([place.x0 * width, place.y0 * height]), np.array([place.x1 * width, place.y0 * height])


def _stroke(ax, start, end, **style):
    """A line or an arrow between two points of the figure [points]."""
    return ax.annotate("", xy=end, xytext=start, xycoords="figure points", textcoords="figure points", zorder=6, arrowprops={"shrinkA": 0, "shrinkB": 0, **style})


def triad(scene, ax, left):
    """Short arrows along the axes of the space, lower left; returns them."""
    drawn, length = [], arrow_length(scene, ax)
    corner = left + [1.6 * length + 4, triad_reach(scene, ax)[0]]
    for axis in range(scene.run.dim if length else 0):
        tip = scene.camera.basis[:2, axis] * length
        if np.hypot(*tip) < 0.15 * length:
            continue
        drawn.append(_stroke(ax, corner, corner + tip, arrowstyle="-|>", color=scene.theme.ink, lw=0.8, mutation_scale=6))
        drawn.append(ax.annotate("xyz"[axis], xy=corner + 1.4 * tip, xycoords="figure points", ha="center", va="center", fontsize=min(8, 0.65 * length),
                                 color=scene.theme.ink, style="italic", zorder=6))
    return drawn


def scale_bar(scene, ax, right):
    """A bar of 1, 2 or 5 times a power of ten, lower right; with perspective it holds at the middle of the scene."""
    x0, x1 = ax.get_xlim()
    raw = 0.2 * (x1 - x0)
    power = 10.0 ** np.floor(np.log10(raw))
    length = max(m for m in (1, 2, 5) if m * power <= raw) * power
    end = right + [-0.04 * ax.get_window_extent().width * 72 / ax.figure.dpi - 4, 4]
    start = end - [length * scene.points_per_unit(ax), 0]
    _stroke(ax, start, end, arrowstyle="-", color=scene.theme.ink, lw=1.6)
    unit = scene.run.unit("position")
    ax.annotate(f"{number(length, 'g')} {written(unit)}".strip(), xy=(start + end) / 2 + [0, 3], xycoords="figure points", ha="center", va="bottom", fontsize=8,
                color=scene.theme.ink, zorder=6)
