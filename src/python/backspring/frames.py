"""Moments of motions."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, Optional, Union

import numpy as np

from . import looks
from ._library import is_open
from .breaks import Events, broken_of, events_of
from .errors import Error
from .kinds import Floats, Mask, Observables
from .lattice import Lattice
from .readonly import read_only

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .motion import Simulation


class Frame:
    """A moment of a motion. t: its time [s]; lattice: what moves.

    Frames of run() keep all but the forces; those of observers look when they are asked, on all ranks, and keep what they found. What a loop over run()
    has changed in x or v when it goes on becomes the state, from which the method starts anew. Copies (pickle, copy) stand alone: they hold what is to be
    had at their moment, also the forces where the motion has not gone on (on several ranks: where they were asked for before). Frames of observers and copies
    cannot be written to, nor can forces, strains and what is broken: nothing would follow.
    """

    t: float
    lattice: Lattice

    def __init__(self, simulation: Simulation, changeable: bool = False) -> None:
        self._simulation: Optional[Simulation] = simulation
        self._changeable = changeable
        self._moment, self._rows = simulation._moment(), simulation.rows
        self.t, self.lattice = simulation.t, simulation.lattice
        self._kept: Optional[Dict[str, Any]] = None
        self._x: Optional[Floats] = None
        self._v: Optional[Floats] = None
        self._forces: Optional[Floats] = None

    def __getstate__(self) -> Dict[str, Any]:
        """What a copy has: all that reading finds, and no simulation. Collective for frames of observers."""
        here = self._simulation
        if here is not None and here._comm.size == 1 and is_open(here._number) and self._moment == here._moment():
            self._forces = here.get("force")
        kept = {**self._found(), "fields": {name: one for name, one in self._found()["fields"].items() if name not in ("position", "velocity")}}
        return {**vars(self), "_x": np.array(self.x), "_v": np.array(self.v), "_kept": kept, "_simulation": None}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        vars(self).update(state, _changeable=False)

    def _put(self, value: Floats) -> Floats:
        if self._simulation is None:
            raise Error("this frame is a copy, which no motion follows: change the frame of the loop, or set x and v of a simulation")
        if not self._changeable:
            raise Error("nothing follows this frame: change the frame of a loop over run(), or set x and v of a simulation between its steps")
        return value

    def _still(self) -> Simulation:
        if self._simulation is None:
            raise Error("this frame is a copy without the forces: ask for them before it is copied, while the motion has not gone on")
        if self._moment != self._simulation._moment():
            raise Error(f"the motion has gone on from t = {self.t:g} s: ask for it before, or take a frame of run(), which keeps all but the forces")
        return self._simulation

    def _found(self) -> Dict[str, Any]:
        if self._kept is None:
            self._kept = self._still().frame()
        return self._kept

    def _table(self, name: str) -> Floats:
        table: Floats = self._found()["fields"][name].reshape(len(self.lattice), -1)[:, : self.lattice.dim]
        return table

    def _own(self, name: str) -> Floats:
        return self.x if name == "position" else self.v

    def _changed(self, name: str) -> bool:
        """Whether positions or velocities are others than they were found; those that nobody has asked for are not."""
        own = self._x if name == "position" else self._v
        return own is not None and not np.array_equal(own, self._table(name))

    @property
    def x(self) -> Floats:
        """(N, d) positions [m], which a loop over run() may change."""
        if self._x is None:
            self._x = self._table("position").copy()
        return self._x if self._changeable else read_only(self._x)

    @x.setter
    def x(self, value: Floats) -> None:
        self._x = self._put(value)

    @property
    def v(self) -> Floats:
        """(N, d) velocities [m/s], which a loop over run() may change."""
        if self._v is None:
            self._v = self._table("velocity").copy()
        return self._v if self._changeable else read_only(self._v)

    @v.setter
    def v(self, value: Floats) -> None:
        self._v = self._put(value)

    @property
    def box(self) -> Optional[Floats]:
        """(d, d) edges of the periodic box at this moment, rows [m]; None: there is none."""
        return self.lattice._box_of(self.observables)

    @property
    def rows(self) -> slice:
        """The rows of this rank, of those of all particles."""
        return self._rows

    @property
    def forces(self) -> Floats:
        """(N, d) [N], as long as the motion has not gone on."""
        if self._simulation is not None or self._forces is None:
            self._forces = self._still().get("force")
        return read_only(self._forces)

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
        return read_only(self._found()["fields"].get("strain", np.zeros(0)))

    @property
    def tension(self) -> Floats:
        """(S,) [N], positive where a spring pulls, with bs_output_springs=True; else empty."""
        return read_only(self._found()["fields"].get("tension", np.zeros(0)))

    @property
    def broken(self) -> Mask:
        """(S,) whether a spring is broken."""
        return read_only(broken_of(self._found()["fields"], len(self.lattice.pairs)))

    @property
    def events(self) -> Events:
        """The springs that broke so far, and when."""
        return events_of(self._found()["breaks"])

    def plot(self, file: Union[str, os.PathLike[str], None] = None, **look: Any) -> Figure:
        """A picture of it, springs coloured by their strain [1]; written to `file` if one is named. Returns the figure of matplotlib. look: size [inch],
        dpi, cmap."""
        from .picture import draw

        return draw(self.lattice, self.x, self.strain if self.strain.size else None, "strain", f"t = {self.t:g} s", file=file, box=self.box, **look)

    def _repr_html_(self) -> str:
        rows = {"t": looks.number(self.t, "s"), "total energy": looks.number(self.energy, "J"),
                "fastest particle": looks.number(np.linalg.norm(self.v, axis=1).max(), "m/s")}
        if self.broken.any():
            rows["broken springs"] = f"{int(self.broken.sum()):,}"
        return looks.page("Frame", rows, looks.picture(self.lattice, self.x, self.strain if self.strain.size else None, "strain", box=self.box))

    def __repr__(self) -> str:
        return f"<backspring.Frame at t = {self.t:g} s, {len(self.lattice)} particles>"
