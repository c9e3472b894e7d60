"""Moments of motions."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, Optional, Union

import numpy as np

from . import looks
from .breaks import Events, broken_of, events_of
from .errors import Error
from .kinds import Floats, Mask, Observables
from .lattice import Lattice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .motion import Simulation


class Frame:
    """A moment of a motion. t: its time [s]; lattice: what moves.

    Frames of run() keep all but the forces; those of observers look when they are asked, on all ranks, and keep what they found. What a loop over run()
    has changed in x or v when it goes on becomes the state, from which the method starts anew.
    """

    t: float
    lattice: Lattice

    def __init__(self, simulation: Simulation) -> None:
        self._simulation, self._moment = simulation, simulation._moment()
        self.t, self.lattice = simulation.t, simulation.lattice
        self._kept: Optional[Dict[str, Any]] = None
        self._x: Optional[Floats] = None
        self._v: Optional[Floats] = None

    def _still(self) -> Simulation:
        if self._moment != self._simulation._moment():
            raise Error(f"the motion has gone on from t = {self.t:g} s: ask for it before, or take a frame of run(), which keeps all but the forces")
        return self._simulation

    def _found(self) -> Dict[str, Any]:
        if self._kept is None:
            self._kept = self._still().frame()
        return self._kept

    def _table(self, name: str) -> Floats:
        return np.array(self._found()["fields"][name].reshape(len(self.lattice), -1)[:, : self.lattice.dim])

    @property
    def x(self) -> Floats:
        """(N, d) positions [m], which a loop over run() may change."""
        if self._x is None:
            self._x = self._table("position")
        return self._x

    @x.setter
    def x(self, value: Floats) -> None:
        self._x = value

    @property
    def v(self) -> Floats:
        """(N, d) velocities [m/s], which a loop over run() may change."""
        if self._v is None:
            self._v = self._table("velocity")
        return self._v

    @v.setter
    def v(self, value: Floats) -> None:
        self._v = value

    @property
    def rows(self) -> slice:
        """The rows of this rank, of those of all particles."""
        return self._simulation.rows

    @property
    def forces(self) -> Floats:
        """(N, d) [N], as long as the motion has not gone on."""
        return self._still().forces

    @property
    def observables(self) -> Observables:
        """{name: number or array} as in a trajectory."""
        observables: Observables = self._found()["observables"]
        return observables

    @property
    def energy(self) -> float:
        """Kinetic and potential energy [J]."""
        return float(self.observables["total_energy"])

    @property
    def strain(self) -> Floats:
        """(S,) (l - L)/L of the springs [1], NaN where they are broken or can exert no force; empty with bs_output_strain=False."""
        return np.asarray(self._found()["fields"].get("strain", np.zeros(0)), float)

    @property
    def tension(self) -> Floats:
        """(S,) [N], positive where a spring pulls, with bs_output_springs=True; else empty."""
        return np.asarray(self._found()["fields"].get("tension", np.zeros(0)), float)

    @property
    def broken(self) -> Mask:
        """(S,) whether a spring is broken."""
        return broken_of(self._found()["fields"], len(self.lattice.pairs))

    @property
    def events(self) -> Events:
        """The springs that broke so far, and when."""
        return events_of(self._found()["breaks"])

    def plot(self, file: Union[str, os.PathLike[str], None] = None, **look: Any) -> Figure:
        """A picture of it, springs coloured by their strain [1]; written to `file` if one is named. Returns the figure of matplotlib. look: size [inch],
        dpi, cmap."""
        from .picture import draw

        return draw(self.lattice, self.x, self.strain if self.strain.size else None, "strain", f"t = {self.t:g} s", file=file, **look)

    def _repr_html_(self) -> str:
        rows = {"t": looks.number(self.t, "s"), "total energy": looks.number(self.energy, "J"),
                "fastest particle": looks.number(np.linalg.norm(self.v, axis=1).max(), "m/s")}
        if self.broken.any():
            rows["broken springs"] = f"{int(self.broken.sum()):,}"
        return looks.page("Frame", rows, looks.picture(self.lattice, self.x, self.strain if self.strain.size else None, "strain", ""))

    def __repr__(self) -> str:
        return f"<backspring.Frame at t = {self.t:g} s, {len(self.lattice)} particles>"
