"""Where the frames of a scene are seen from, and how much of them: one camera and one window for all."""
import numpy as np

from camera import Camera, guess_up


class Window:
    """Of a scene, which says what runs, which frames, how large displacements are drawn and what goes round or is followed."""

    def position(self, row):
        """Positions (N, d), the centre of mass (of the free particles) kept where it was first if it is followed."""
        x = self._shape(row)
        return x - (self._centre(row) - self._centre(self.first)) if self.follow else x

    def _shape(self, row):
        """Positions (N, d), displacements as many times as large as asked for."""
        x = self.run.position(row)
        if self.deform is None:
            return x
        start = self.run.position(0)
        return start + self.deform * (x - start)

    def _centre(self, row):
        free = ~self.run.fixed if not self.run.fixed.all() else np.ones(self.run.particles, dtype=bool)
        weights = self.run.mass[free] if self.run.mass is not None else None
        return np.average(self._shape(row)[free], axis=0, weights=weights)

    def _reach(self, rows):
        """Lower and upper corner of all that these frames show."""
        lo, hi = np.full(self.run.dim, np.inf), np.full(self.run.dim, -np.inf)
        for row in rows:
            x = self._shown(row)
            lo, hi = np.fmin(lo, np.nanmin(x, axis=0)), np.fmax(hi, np.nanmax(x, axis=0))
        return lo, hi

    def _size(self, rows):
        lo, hi = self._reach(rows)
        return float(np.linalg.norm(hi - lo)) or 1.0

    def _shown(self, row):
        """Positions of a frame, and the ends of arrows."""
        x = self.position(row)
        return x if self.reactions is None else np.array([*x, *(end for _, tail, tip, _ in self.reactions.arrows(row, x) for end in (tail, tip))])

    def _frame_window(self, rows, up, elev, azim, perspective, zoom):
        """The same window for all frames: everything that is ever seen, and a margin."""
        self.framed = list(rows) + ([0] if self.deform is not None and 0 not in rows else [])
        up = up or guess_up(self.run.dim, self.run.parameters.get("bs_gravity"))
        self._camera_of = lambda angle, target, size: Camera(self.run.dim, up, elev, azim + angle, target, size, perspective)
        self.zoom = zoom
        share_window([self])

    def _look_at(self, lo, hi):
        """The eye as far off as it must be to see the space between two corners."""
        self.size, self.bounds = float(np.linalg.norm(hi - lo)) or 1.0, (lo, hi)
        target = 0.5 * (lo + hi) if self.run.dim == 3 else None
        self._eye = lambda angle: self._camera_of(angle, target, self.size)
        self.camera = self._eye(0.0)

    def _extents(self):
        """Lowest and highest (3,) in the plane and in depth of all that is framed."""
        seen = [np.column_stack(self._camera_at(row).project(self._shown(row))) for row in self.framed]
        return np.min([points.min(axis=0) for points in seen], axis=0), np.max([points.max(axis=0) for points in seen], axis=0)

    def _camera_at(self, row):
        if not self.turn or self.last == self.first:
            return self.camera
        return self._eye(self.turn * (row - self.first) / (self.last - self.first))

    def setup_limits(self, ax):
        """The same window for all frames, with equal scales; call again when `ax` changes its size."""
        box = ax.get_window_extent()
        half = 0.5 * (self.high - self.low)
        half = np.array([max(half[0], half[1] * box.width / box.height), max(half[1], half[0] * box.height / box.width)])
        middle = 0.5 * (self.low + self.high)
        ax.set_xlim(middle[0] - half[0], middle[0] + half[0])
        ax.set_ylim(middle[1] - half[1], middle[1] + half[1])

    def points_per_unit(self, ax):
        """Points of the page (1/72 inch) per unit of length in the picture."""
        box = ax.get_window_extent()
        (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
        return min(box.width / abs(x1 - x0), box.height / abs(y1 - y0)) * 72.0 / ax.figure.dpi


def share_window(scenes):
    """One window for all of them, as wide as what any of them ever shows, and a margin."""
    corners = [scene._reach(scene.framed) for scene in scenes]
    for scene in scenes:
        scene._look_at(np.min([lo for lo, _ in corners], axis=0), np.max([hi for _, hi in corners], axis=0))
    extents = [scene._extents() for scene in scenes]
    low, high = np.min([lo for lo, _ in extents], axis=0), np.max([hi for _, hi in extents], axis=0)
    middle, half = 0.5 * (low + high)[:2], 0.5 * (high - low)[:2]
    half = np.maximum(half, 0.12 * half.max() if half.max() > 0 else 0.5) * 1.12
    for scene in scenes:
        scene.low, scene.high, scene.depth = middle - half / scene.zoom, middle + half / scene.zoom, [low[2], high[2]]
