"""What analyses find: equilibria, modes and moduli."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Dict, Iterator, Optional, Union

import numpy as np

from . import looks
from .breaks import Events, broken_of, events_of
from .errors import NoReaction
from .kinds import Floats, GivenForces, Mask, Observables, Settings
from .lattice import Lattice
from .readonly import read_only

if TYPE_CHECKING:
    from ._core import Found
    from matplotlib.figure import Figure


class Reactions(Dict[str, Floats]):
    """{group: (d,)} forces of supports on it [N], of groups that something holds."""

    def __missing__(self, group: str) -> Floats:
        held = ", ".join(self) or "none"
        raise NoReaction(f"reactions: nothing holds a group {group!r}; groups that are held: {held}; the forces on all particles that are held, in a group or not: "
                         "reaction, (N, d)")


def _places(fields: Dict[str, Floats], lattice: Lattice) -> Floats:
    return fields["position"].reshape(len(lattice), -1)[:, : lattice.dim]


class Equilibrium:
    """An equilibrium of a lattice under its loads. All arrays are in the order of the lattice, the same on every rank.

    load_factor: 1 under the full loads [1]. newton, krylov: iterations of all load steps; steps, rejected: load steps taken and attempts that failed.
    observables: {name: numbers} as in a trajectory; fields: {name: array}, likewise. events: the springs that broke, and at which load.
    reaction: (N, d) forces that supports and motions exert on all that is held, in a group or not, 0 elsewhere [N].
    lattice, settings, forces: what was solved.
    """

    lattice: Lattice
    settings: Settings
    forces: Optional[GivenForces]
    observables: Observables
    fields: Dict[str, Floats]
    reaction: Floats
    load_factor: float
    newton: int
    krylov: int
    steps: int
    rejected: int
    events: Events

    def __init__(self, lattice: Lattice, settings: Settings, forces: Optional[GivenForces], found: Found) -> None:
        self.lattice, self.settings, self.forces = lattice, settings, forces
        self.observables, self.fields, self.events = found["observables"], found["fields"], events_of(found["breaks"])
        self.reaction = found["reaction"]
        self.load_factor, self.newton, self.krylov = found["load_factor"], found["newton"], found["krylov"]
        self.steps, self.rejected = found["steps"], found["rejected"]
        self._state = found["state"]

    @property
    def x(self) -> Floats:
        """(N, d) positions [m], read-only: another state is a lattice of its own, eq.lattice.replace(x=new)."""
        return read_only(_places(self.fields, self.lattice))

    @property
    def box(self) -> Optional[Floats]:
        """(d, d) edges of the periodic box as it stands, rows [m]; None: there is none."""
        return self.lattice._box_of(self.observables)

    @property
    def tension(self) -> Floats:
        """(S,) [N], positive where a spring pulls, NaN where it is broken or can exert no force."""
        return read_only(self.fields.get("tension", np.zeros(0)))

    @property
    def broken(self) -> Mask:
        """(S,) whether a spring is broken."""
        return read_only(broken_of(self.fields, len(self.lattice.pairs)))

    @property
    def energy(self) -> float:
        """Elastic energy [J]."""
        return float(self.observables["elastic_energy"])

    @property
    def reactions(self) -> Dict[str, Floats]:
        """{group: (d,)} forces of supports on the group [N], of groups that something holds; particle by particle, of those in no group, too: reaction."""
        return Reactions({name.split("/", 1)[1]: np.atleast_1d(value) for name, value in self.observables.items() if name.startswith("reaction/")})

    def plot(self, file: Union[str, os.PathLike[str], None] = None, **look: Any) -> Figure:
        """A picture of it, springs coloured by their tension [N]; written to `file` if one is named. Returns the figure of matplotlib.
        look: size [inch], dpi, cmap."""
        from .picture import draw

        return draw(self.lattice, self.x, self.tension, "tension [N]", f"load factor {self.load_factor:g}", file=file, box=self.box, **look)

    def _repr_html_(self) -> str:
        rows = {"load factor": f"{self.load_factor:g}", "elastic energy": looks.number(self.energy, "J"), "largest tension": looks.number(looks.most(self.tension), "N"),
                "largest compression": looks.number(looks.most(-self.tension), "N")}
        rows.update({f"reaction of {name}": looks.vector(force, "N") for name, force in self.reactions.items()})
        if self.broken.any():
            rows["broken springs"] = f"{int(self.broken.sum()):,}"
        rows["Newton iterations"] = f"{self.newton} in {self.steps} load step{'s' * (self.steps != 1)}" + (f", {self.rejected} rejected" if self.rejected else "")
        return looks.page("Equilibrium", rows, looks.picture(self.lattice, self.x, self.tension, "tension", "N", box=self.box))

    def __repr__(self) -> str:
        broken = f", {int(self.broken.sum())} springs broken" if self.broken.any() else ""
        return f"<backspring.Equilibrium at the load factor {self.load_factor:g}: elastic energy {self.energy:.6g} J, {self.newton} Newton iterations{broken}>"


class Modes:
    """Free vibrations, K of them. omega2: (K,) ascending [1/s^2]. shapes: (K, N, d), sum over particles of m |q|^2 = 1 [kg^-1/2]. residual: (K,) bounds
    of the errors of omega2 [1/s^2]. zero: motions without stiffness in all, or -1 where they were not counted. lattice: of which they are, x: (N, d)
    and box: (d, d) about which [m]. Unpacks into omega2, shapes."""

    omega2: Floats
    shapes: Floats
    residual: Floats
    zero: int
    lattice: Lattice
    x: Floats
    box: Optional[Floats]

    def __init__(self, found: Found, lattice: Lattice) -> None:
        self.omega2, self.shapes, self.residual, self.zero = found["omega_squared"], found["shapes"], found["residual"], found["zero_modes"]
        self.lattice, self.x, self.box = lattice, _places(found["fields"], lattice), lattice._box_of(found["observables"])

    def __iter__(self) -> Iterator[Floats]:
        """omega2, shapes."""
        return iter((self.omega2, self.shapes))

    def __len__(self) -> int:
        """How many, K."""
        return len(self.omega2)

    @property
    def frequencies(self) -> Floats:
        """(K,) omega/(2 pi) [1/s], negative where a mode is unstable (omega2 < 0)."""
        return np.asarray(np.sign(self.omega2) * np.sqrt(np.abs(self.omega2)) / (2 * np.pi), float)

    def moved(self, k: int, size: float = 0.1) -> Floats:
        """(N, d) positions along the mode k, its largest displacement `size` times the lattice's extent [m]."""
        shape = self.shapes[k]
        most = np.linalg.norm(shape, axis=1).max() or 1.0
        return np.asarray(self.x + shape * (size * np.ptp(self.x, axis=0).max() / most), float)

    def _stretches(self, k: int) -> Floats:
        return looks.stretches(self.lattice, self.x, self.shapes[k], self.box)

    def plot(self, k: int = 0, file: Union[str, os.PathLike[str], None] = None, size_of_motion: float = 0.1, **look: Any) -> Figure:
        """A picture of the mode k: springs moved along it, coloured by their lengthening as a part of the largest [1], the lattice at rest in grey; written
        to `file` if one is named. Returns the figure of matplotlib. look: size [inch], dpi, cmap."""
        from .picture import draw

        x = self.moved(k, size_of_motion)
        title = f"mode {k}: $\\omega^2$ = {self.omega2[k]:.4g} s$^{{-2}}$"
        return draw(self.lattice, x, self._stretches(k), "lengthening", title, behind=self.x, file=file, box=self.box, **look)

    def _repr_html_(self) -> str:
        rows = {"modes": str(len(self)), "omega<sup>2</sup>": ", ".join(f"{one:.4g}" for one in self.omega2[:6]) + (", ..." if len(self) > 6 else "") + " s<sup>-2</sup>"}
        if self.zero >= 0:
            rows["without stiffness"] = str(self.zero)
        pictures = [looks.picture(self.lattice, self.moved(k), self._stretches(k), width=200, caption=f"{k}: {one:.4g} s<sup>-2</sup>", box=self.box)
                    for k, one in enumerate(self.omega2[:4])]
        return looks.page("Modes", rows, *pictures)

    def __repr__(self) -> str:
        span = f", omega^2 from {self.omega2[0]:.6g} to {self.omega2[-1]:.6g} s^-2" if len(self) else ""
        return f"<backspring.Modes: {len(self)} of {len(self.lattice)} particles{span}>"


class Moduli:
    """stiffness: (q, q) of a periodic lattice, rows xx, yy, xy in two dimensions, xx, yy, zz, yz, xz, xy in three [N/m^(d-1)].
    equilibrium: at which it was found. zero: motions without stiffness, or -1."""

    stiffness: Floats
    zero: int
    equilibrium: Optional[Equilibrium]

    def __init__(self, found: Found, equilibrium: Optional[Equilibrium]) -> None:
        self.stiffness, self.zero, self.equilibrium = found["stiffness"], found["zero_modes"], equilibrium

    def _repr_html_(self) -> str:
        table = "<br>".join(" &nbsp; ".join(f"{0.0 if abs(one) < 1e-12 * abs(self.stiffness).max() else one:.4g}" for one in row) for row in self.stiffness)
        rows = {"stiffness": table}
        if self.zero >= 0:
            rows["without stiffness"] = str(self.zero)
        return looks.page("Moduli", rows)

    def __repr__(self) -> str:
        return f"<backspring.Moduli: stiffness {' '.join(f'{one:.6g}' for one in np.diag(self.stiffness))} along its diagonal>"
