"""What colours of a scene say: which quantity, its scale over all frames, and whether it is anything but rounding."""
import matplotlib
import numpy as np
from matplotlib.colors import Normalize, to_rgb

from backspring_io import RunError
from figure_style import ROUNDING, axis_label, enlarged

OF_SPRINGS = ("strain", "tension", "stress")  # colours that belong to springs


class Colours:
    """Of a scene, which says what is drawn, and by which theme."""

    def _color(self, color):
        strained = len(self.run.springs) and np.any(self.run.springs.strained)
        if color == "auto":
            return "strain" if strained else ("speed" if self.run.velocities is not None else "none")
        if color == "tension" and (not len(self.run.springs) or self.run.tensions(0) is None):
            raise RunError(f"{self.run.path}: does not say the forces of its springs: --color tension needs their laws and what these take")
        if color == "stress" and (not len(self.run.springs) or self.run.stresses(0) is None):
            raise RunError(f"{self.run.path}: has no stresses of springs: --color stress needs a run with -bs_output_springs of a lattice with /springs/area")
        return "none" if (color == "strain" and not strained) or (color == "speed" and self.run.velocities is None) else color

    def _norm(self, rows, limits):
        if limits is not None:
            return Normalize(*limits)
        if self.color == "none":
            return Normalize(0, 1)
        tops = []
        for row in rows:
            values = self.values(row) if self.draw == "springs" else self._particle_values(row)
            values = values[np.isfinite(values)]
            tops.append([np.percentile(np.abs(values), 99.5), values.min(), values.max()] if len(values) else np.zeros(3))
        tops = np.array(tops)
        self.range = tops[:, 1].min(), tops[:, 2].max()
        most, largest = tops[:, 0].max(), np.abs(self.range).max()
        rounding = ROUNDING * self._known()
        self.nothing = largest <= rounding
        top = 1.0 if self.nothing else most if most > rounding else largest
        return Normalize(-top, top) if self.color in OF_SPRINGS else Normalize(0, top)

    def _known(self):
        """What the coloured quantity is measured by where rounding is to be told: strains by 1, tensions and stresses by those of a strain of 1, speeds by the scene's size in
        the time of the run."""
        if self.color == "strain":
            return 1.0
        if self.color == "speed":
            span = np.ptp(self.run.times)
            return self.size / span if span > 0 else 0.0
        springs, laws = self.run.springs, self.run.spring_laws
        if springs.stiffness is None:
            return 0.0
        lengths = np.where(springs.rest_length > 0, springs.rest_length, self.run.lengths(0))
        forces = np.abs(springs.stiffness) * (lengths if laws is None else np.where(laws == "strain", 1.0, lengths))
        area = springs.law_data.get("area") if self.color == "stress" else np.ones(len(springs))
        found = [] if area is None else forces[area > 0] / area[area > 0]
        return float(np.max(found, initial=0.0))

    def values(self, row):
        """The coloured quantity: per spring (strain) or per particle (speed)."""
        if self.color == "strain":
            return np.where(self.run.slack(row), np.nan, self.run.strains(row))
        if self.color in ("tension", "stress"):
            return np.where(self.run.slack(row) | ~self.run.acting(row), np.nan, self.run.tensions(row) if self.color == "tension" else self.run.stresses(row))
        return np.sqrt((self.run.velocity(row) ** 2).sum(axis=1))

    def _particle_values(self, row):
        """The coloured quantity per particle: strain as the mean over the springs that meet there."""
        values = self.values(row)
        if self.color == "speed":
            return values
        ends, good = self.run.springs.pairs, np.isfinite(values)
        total = np.zeros(self.run.particles)
        count = np.zeros(self.run.particles)
        for side in (0, 1):
            total += np.bincount(ends[good, side], values[good], self.run.particles)
            count += np.bincount(ends[good, side], minlength=self.run.particles)
        return total / np.maximum(count, 1)

    def _spring_values(self, row):
        if self.color in OF_SPRINGS:
            return self.values(row)[self.drawn]
        return self.values(row)[self.run.springs.pairs[self.drawn]].mean(axis=1)

    def _rgb(self, values, count):
        if self.color == "none" or self.nothing and self.color == "speed":
            return np.tile(to_rgb(self.theme.particle), (count, 1))
        if self.nothing:
            values = np.where(np.isfinite(values), 0.0, np.nan)
        rgb = self.cmap(self.norm(np.where(np.isfinite(values), values, 0.0)))[:, :3]
        rgb[~np.isfinite(values)] = to_rgb(self.theme.faint)
        return rgb

    def beyond(self):
        """At which ends of the colour scale there are values beyond it, as matplotlib's colour bars have it."""
        rounding = 1e-6 * (self.norm.vmax - self.norm.vmin)
        low, high = self.range[0] < self.norm.vmin - rounding, self.range[1] > self.norm.vmax + rounding
        return "both" if low and high else "min" if low else "max" if high else "neither"

    def mapping(self):
        """For a colour bar; None when nothing is coloured."""
        return None if self.color == "none" or self.nothing else matplotlib.cm.ScalarMappable(self.norm, self.cmap)

    def label(self):
        if self.color == "speed":
            return axis_label("speed", self.run.unit("velocity"))
        name = {"strain": self.run.strain_name, "tension": axis_label("tension", self.run.unit("reaction")), "stress": axis_label("stress", self.run.stated_unit("springs/stress") or "Pa")}[self.color]
        if self.draw != "springs":
            return "mean " + name + " at a particle"
        return name + self._dotted()

    def _dotted(self):
        return ", dotted: slack" if any(self.run.slack(row).any() for row in {self.first, self.last}) else ""

    def words(self):
        """What a title adds to the moment: how displacements are drawn, and what is 0 so that no colour bar or arrow says it."""
        zeros = f", {self.color} 0" + (self._dotted() if self.draw == "springs" else "") if self.nothing else ""
        return enlarged(self.deform) + zeros + (", reactions 0" if self.reactions is not None and not self.reactions.scale > 0 else "")


def share_colours(scenes):
    """One scale for all of them that have the same colours."""
    for color in {scene.color for scene in scenes} - {"none"}:
        some = [scene for scene in scenes if scene.color == color]
        telling = [scene.norm for scene in some if not scene.nothing]
        for scene in some if telling else []:
            scene.nothing, scene.norm = False, Normalize(min(n.vmin for n in telling), max(n.vmax for n in telling))
