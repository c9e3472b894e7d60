"""Reactions of supports as arrows in scenes: at the middle of each group, as long as the force is large."""
import numpy as np

from backspring_io import RunError
from figure_style import number

LONGEST = 0.16  # of the scene's size, of the largest reaction in any frame


def reactions_of(run, row):
    """{group: force (d,) [N]} of a frame."""
    found = {}
    for name, values in run.series.items():
        if name.startswith("reaction/") and row < len(values):
            found[name.partition("/")[2]] = np.asarray(values[row], float).reshape(-1)
    return found


class Reactions:
    """The arrows of a scene; their scale is the same over all its frames."""

    def __init__(self, run, rows, size):
        if not any(name.startswith("reaction/") for name in run.series):
            raise RunError(f"{run.path}: --reactions: no group has a reaction; one has that -bs_motion_NAME holds (fixed) or moves, particles that the lattice fixes have none")
        self.run = run
        largest = max([np.linalg.norm(force) for row in rows for force in reactions_of(run, row).values()], default=0.0)
        self.scale = LONGEST * size / largest if largest > 0 else 0.0

    def arrows(self, row, position):
        """[("tail" or "tip", tail (d,), tip (d,), size [N])]: that end lies at the middle of the group, the other away from the body, be it pulled or pushed."""
        out, middle = [], position.mean(axis=0)
        for name, force in reactions_of(self.run, row).items():
            at, size = position[self.run.group(name)].mean(axis=0), float(np.linalg.norm(force))
            pulled = force @ (at - middle) > 0
            tail = at if pulled else at - self.scale * force
            if size * self.scale > 0:
                out.append(("tail" if pulled else "tip", tail, tail + self.scale * force, size))
        return out

    def draw(self, ax, arrows, camera, theme):
        """Draws them with their sizes; returns the artists."""
        drawn, unit = [], self.run.unit("reaction")
        for at, tail, tip, size in arrows:
            (start, end), _ = camera.project(np.array([tail, tip]))
            drawn.append(ax.annotate("", xy=end, xytext=start, zorder=7, annotation_clip=True,
                                     arrowprops={"arrowstyle": "-|>", "color": theme.reaction, "lw": 1.6, "shrinkA": 0, "shrinkB": 2, "mutation_scale": 10}))
            near, far = (start, end) if at == "tail" else (end, start)
            away = np.where(np.abs(far - near) > 0.3 * np.abs(far - near).max(), np.sign(far - near), 0)
            drawn.append(ax.annotate(f"{number(size, '.3g')} {unit}".strip(), xy=far, xytext=3 * away, textcoords="offset points", zorder=7, annotation_clip=True, fontsize=8,
                                     color=theme.reaction, ha=["right", "center", "left"][int(away[0]) + 1], va=["top", "center", "bottom"][int(away[1]) + 1]))
        return drawn
