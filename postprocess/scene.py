"""Draws one frame of a run: springs as lines, a sheet as shaded triangles, or particles as shaded discs where there are too many springs."""
import matplotlib
matplotlib.use("Agg")
import numpy as np  # noqa: E402
from matplotlib.collections import LineCollection, PolyCollection  # noqa: E402
from matplotlib.colors import to_rgb  # noqa: E402

from backspring_io import RunError  # noqa: E402
from figure_style import enlarged, moment  # noqa: E402
from faces import is_sheet, shaded, triangles_of  # noqa: E402
from reactions import Reactions  # noqa: E402
from scene_colors import OF_SPRINGS, Colours  # noqa: E402
from scene_marks import THEMES, make_room, scale_bar, triad  # noqa: E402
from scene_window import Window  # noqa: E402

SHEET = 400  # particles from which on a sheet is drawn as triangles


def sample(rows, count):
    """At most `count` of `rows`, evenly spaced, ends included."""
    if len(rows) <= count:
        return list(rows)
    return [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, count).round().astype(int))]


class Scene(Colours, Window):
    """What stays the same over all frames: camera, window, colour scale, which springs are drawn."""

    def __init__(self, run, rows, color="auto", theme="light", up="", elev=20.0, azim=-60.0, perspective=0.0,
                 max_springs=20000, draw="auto", limits=None, zoom=1.0, turn=0.0, follow=False, deform=None, reactions=False):
        """turn: degrees by which the eye goes round over the frames; follow: the centre of mass stays in the middle; deform: displacements since the first
        frame are drawn this many times as large, with the shape of the first frame behind; reactions: those of groups are drawn as arrows."""
        self.run, self.theme, self.deform, self.reactions = run, THEMES[theme], deform, None
        self.turn, self.follow, self.first, self.last = turn if run.dim == 3 else 0.0, follow, rows[0], rows[-1]
        self.draw = self._way(draw, max_springs)
        self.drawn = np.flatnonzero(run.springs.inside & ~run.springs.idle)  # lines across a periodic box would hide the rest
        if self.draw == "springs" and len(self.drawn) > max_springs:  # asked for lines: an even choice of the springs
            self.drawn = self.drawn[np.unique(np.linspace(0, len(self.drawn) - 1, max_springs).astype(np.int64))]
        self.color = self._color(color)
        budget = max(2, int(4e7 // max(1, run.particles)))
        seen = sample(rows, min(200, budget))
        self.reactions = Reactions(run, rows, self._size(seen)) if reactions else None
        self._frame_window(seen, up, elev, azim, perspective, zoom)
        self.nothing = False  # whether the coloured quantity is 0 but for rounding, and drawn in one colour
        self.range = (0.0, 0.0)  # of the coloured quantity, where the scale is taken from it
        self.norm = self._norm(sample(rows, min(40, budget)), limits)
        self.cmap = matplotlib.colormaps.get_cmap(self.theme.speed) if self.color == "speed" else self.theme.strain
        self.dots = None

    def _way(self, draw, max_springs):
        """What is drawn: springs, triangles or particles."""
        count = len(self.run.springs)
        if draw == "triangles" or draw == "auto" and self.run.dim == 3 and self.run.particles >= SHEET and count <= 10 * self.run.particles:
            self.triangles = triangles_of(self.run)
            if draw == "triangles" and not len(self.triangles):
                raise RunError(f"{self.run.path}: has no triangles of springs; write --draw springs or particles")
            if draw == "triangles" or is_sheet(self.run, self.triangles):
                return "triangles"
        return "particles" if not count or draw == "particles" or draw == "auto" and count > max_springs else "springs"

    def _fog(self, depth, strength):
        """Share of background colour: 0 in front, `strength` far behind."""
        span = self.depth[1] - self.depth[0]
        return strength * np.clip((self.depth[1] - depth) / span, 0, 1) if span > 0 else np.zeros_like(depth)

    def title(self, row, form=".4g"):
        """Words for a frame: the moment, and what colours and arrows do not say. The one frame of a file of modes is the state that they are about."""
        if not self.run.has_modes or self.run.frames > 1:
            return moment(self.run, row, form) + self.words()
        return "undeformed" + enlarged(self.deform) if self.nothing and self.color == "strain" else "the state of the modes" + self.words()

    # ---- drawing ------------------------------------------------------------------------------------------------
    def setup(self, ax, bar=True):
        """Prepares `ax`, with a triad and a scale bar if `bar`; call once, then draw_frame(ax, row) for every frame."""
        ax.set_facecolor(self.theme.background)
        self.setup_limits(ax)
        ax._backspring = []
        if bar:
            ax.set_axis_off()
            self.corner, right = make_room(self, ax)
            self.setup_limits(ax)
            if not self.turn:
                triad(self, ax, self.corner)
            scale_bar(self, ax, right)

    def draw_frame(self, ax, row):
        """Replaces the frame shown in `ax` by frame `row`."""
        for artist in ax._backspring:
            artist.remove()
        ax._backspring = []
        if self.turn:
            self.camera = self._camera_at(row)
            ax._backspring += triad(self, ax, self.corner)
        plane, depth = self.camera.project(self.position(row))
        if self.deform is not None:
            self._draw_undeformed(ax)
        if self.draw == "springs":
            self._draw_springs(ax, row, plane, depth)
        elif self.draw == "triangles":
            self._draw_triangles(ax, row, plane, depth)
        elif self.run.particles > 400:
            self._draw_surface(ax, row, plane, depth)
        else:
            self._draw_dots(ax, row, plane, depth, 30.0)
        if self.reactions is not None:
            ax._backspring += self.reactions.draw(ax, self.reactions.arrows(row, self.position(row)), self.camera, self.theme)
        fixed = np.flatnonzero(self.run.fixed)
        if len(fixed) and len(fixed) <= 2000 and (self.draw != "particles" or self.run.particles <= 400):
            size = np.clip(0.25 * self._spacing(ax), 1.5, 5.0)
            front = depth[fixed] >= np.median(depth) if self.run.dim == 3 else np.ones(len(fixed), dtype=bool)
            for some, level in ((fixed[front], 5), (fixed[~front], 1)):  # those behind go under the springs
                ax._backspring += ax.plot(plane[some, 0], plane[some, 1], "s", ms=size, mfc=self.theme.fixed,
                                          mec=self.theme.background, mew=0.3, zorder=level, ls="none")

    def _spacing(self, ax):
        """Median length of a spring, in points."""
        springs = self.run.springs
        lengths = self.run.lengths(0)[:: max(1, len(springs) // 10000)] if len(springs) else np.array([self.size / 10])
        return float(np.median(lengths)) * self.points_per_unit(ax)

    def _draw_springs(self, ax, row, plane, depth):
        slack = self.run.slack(row)[self.drawn]
        there = self.run.acting(row)[self.drawn] & ~slack
        if slack.any():
            ax._backspring.append(ax.add_collection(LineCollection(plane[self.run.springs.pairs[self.drawn][slack]], colors=self.theme.slack, linewidths=0.8,
                                                                   linestyles=(0, (1, 1.6)), zorder=1.5), autolim=False))
        pairs = self.run.springs.pairs[self.drawn][there]
        values = None if self.color == "none" else self._spring_values(row)[there]
        middle = 0.5 * (depth[pairs[:, 0]] + depth[pairs[:, 1]])
        rgb = self._rgb(values, len(pairs))
        order = np.argsort(middle) if self.run.dim == 3 else np.argsort(np.abs(values), kind="stable") \
            if self.color in OF_SPRINGS else np.arange(len(pairs))
        crowd = max(1.0, 2 * len(self.run.springs) / self.run.particles / 6)  # thinner where many springs meet
        width = np.clip(0.12 * self._spacing(ax) / np.sqrt(crowd), 0.25, 2.2)
        if self.run.dim == 3:
            fog = self._fog(middle, 0.65)[:, None]
            rgb = (1 - fog) * rgb + fog * np.array(to_rgb(self.theme.background))
            width = width * (1.25 - 0.6 * self._fog(middle, 1.0))[order]
        lines = LineCollection(plane[pairs[order]], colors=rgb[order], linewidths=width, capstyle="round", zorder=2)
        ax._backspring.append(ax.add_collection(lines, autolim=False))
        if self.run.particles <= 400 and self._spacing(ax) > 6:
            self._draw_dots(ax, row, plane, depth, np.clip(0.1 * self._spacing(ax), 1, 5) ** 2)

    def _draw_triangles(self, ax, row, plane, depth):
        """From far to near; a triangle that has lost a spring is gone."""
        triangles = self.triangles[self._whole(row)]
        middle = depth[triangles].mean(axis=1)
        order = np.argsort(middle)
        triangles = triangles[order]
        values = None if self.color == "none" else self._particle_values(row)[triangles].mean(axis=1)
        rgb = np.clip(self._rgb(values, len(triangles)) * shaded(self.position(row), triangles, self.camera.basis)[:, None], 0, 1) if self.run.dim == 3 \
            else self._rgb(values, len(triangles))
        fog = self._fog(middle[order], 0.35)[:, None]
        rgb = (1 - fog) * rgb + fog * np.array(to_rgb(self.theme.background))
        ax._backspring.append(ax.add_collection(PolyCollection(plane[triangles], facecolors=rgb, edgecolors=rgb, linewidths=0.4, zorder=2), autolim=False))

    def _whole(self, row):
        """Which triangles have all their springs."""
        broken = self.run.broken(row)
        if broken is None or not broken.any():
            return np.ones(len(self.triangles), bool)
        gone = np.sort(self.run.springs.pairs[broken], axis=1)
        sides = self.triangles[:, [[0, 1], [0, 2], [1, 2]]]
        return ~np.isin(sides[..., 0] * self.run.particles + sides[..., 1], gone[:, 0] * self.run.particles + gone[:, 1]).any(axis=1)

    def _draw_undeformed(self, ax):
        """The shape of the first frame, faintly: springs as thin lines, or dots where particles are drawn."""
        plane, _ = self.camera.project(self.position(0))
        if self.draw != "particles":
            lines = LineCollection(plane[self.run.springs.pairs[self.drawn[self.run.acting(0)[self.drawn]]]], colors=self.theme.faint, linewidths=0.5, zorder=0.5)
            ax._backspring.append(ax.add_collection(lines, autolim=False))
        else:
            ax._backspring.append(ax.scatter(*plane.T, s=2, c=self.theme.faint, linewidths=0, zorder=0.5))

    def _draw_dots(self, ax, row, plane, depth, area):
        free = np.flatnonzero(~self.run.fixed)
        free = free[np.argsort(depth[free])]
        colored = self.draw == "particles" and self.color != "none"
        color = self._rgb(self._particle_values(row), self.run.particles)[free] if colored else \
            np.tile(to_rgb(self.theme.particle), (len(free), 1))
        fog = self._fog(depth[free], 0.7 if self.run.dim == 3 else 0.0)[:, None]
        color = (1 - fog) * color + fog * np.array(to_rgb(self.theme.background))
        ax._backspring.append(ax.scatter(plane[free, 0], plane[free, 1], s=area, c=color, linewidths=0, zorder=4))

    def _draw_surface(self, ax, row, plane, depth):
        """Discs drawn into an image with a depth buffer, lit from the upper left."""
        from splat import splat
        values = None if self.color == "none" else self._particle_values(row)
        rgb = self._rgb(values, self.run.particles)
        rgb[self.run.fixed] = 0.55 * rgb[self.run.fixed] + 0.45 * np.array(to_rgb(self.theme.fixed))
        box = ax.get_window_extent()
        (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
        fine = 2 if self.run.particles < 3000000 else 1  # smooth outlines
        image = splat(plane, depth, rgb, self._fog(depth, 0.35), (x0, x1, y0, y1),
                      (fine * round(box.width), fine * round(box.height)), self._disc_radius(),
                      to_rgb(self.theme.background), shaded=self.run.dim == 3)
        image = image.reshape(image.shape[0] // fine, fine, image.shape[1] // fine, fine, 4).mean(axis=(1, 3))
        ax._backspring.append(ax.imshow(image, extent=(x0, x1, y0, y1), origin="lower", interpolation="nearest",
                                        aspect="auto", zorder=2))
        ax.set_xlim(x0, x1)
        ax.set_ylim(y0, y1)

    def _disc_radius(self):
        """Half the diagonal of a cell, so that neighbours close the surface [m]."""
        if len(self.run.springs):
            rest = self.run.lengths(0)[:: max(1, len(self.run.springs) // 20000)]
            return 0.85 * float(np.percentile(rest[rest > 0], 25)) if np.any(rest > 0) else self.size / 200
        lo, hi = self.bounds
        extent = np.maximum(hi - lo, 1e-3 * self.size)
        return 0.5 * float((np.prod(extent) / self.run.particles) ** (1.0 / self.run.dim))
