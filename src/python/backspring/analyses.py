"""Equilibria, modes and moduli."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Callable, Dict, Iterator, Optional, Tuple, Union

import numpy as np

from . import errors, looks
from ._library import agreed, end_session, new_session, on_all
from .breaks import Events, broken_of, events_of
from .errors import InputError
from .kinds import Comm, Floats, GivenForces, Loads, Mask, Observables, Option, Settings, Shared
from .lattice import Lattice
from .options import joined, loads_of, settings_of, whole
from .progress import Progress

if TYPE_CHECKING:
    from ._core import Found, Problem, Session
    from matplotlib.figure import Figure


class Equilibrium:
    """An equilibrium of a lattice under its loads. All arrays are in the order of the lattice, the same on every rank.

    load_factor: 1 under the full loads [1]. newton, krylov: iterations of all load steps; steps, rejected: load steps taken and attempts that failed.
    observables: {name: numbers} as in a trajectory; fields: {name: array}, likewise. events: the springs that broke, and at which load.
    lattice, settings, forces: what was solved.
    """

    lattice: Lattice
    settings: Settings
    forces: Optional[GivenForces]
    observables: Observables
    fields: Dict[str, Floats]
    load_factor: float
    newton: int
    krylov: int
    steps: int
    rejected: int
    events: Events

    def __init__(self, lattice: Lattice, settings: Settings, forces: Optional[GivenForces], found: Found) -> None:
        self.lattice, self.settings, self.forces = lattice, settings, forces
        self.observables, self.fields, self.events = found["observables"], found["fields"], events_of(found["breaks"])
        self.load_factor, self.newton, self.krylov = found["load_factor"], found["newton"], found["krylov"]
        self.steps, self.rejected = found["steps"], found["rejected"]
        self._state = found["state"]

    @property
    def x(self) -> Floats:
        """(N, d) positions [m]."""
        return self.fields["position"].reshape(len(self.lattice), -1)[:, : self.lattice.dim]

    @property
    def tension(self) -> Floats:
        """(S,) [N], positive where a spring pulls, NaN where it is broken or can exert no force."""
        return self.fields.get("tension", np.zeros(0))

    @property
    def broken(self) -> Mask:
        """(S,) whether a spring is broken."""
        return broken_of(self.fields, len(self.lattice.pairs))

    @property
    def energy(self) -> float:
        """Elastic energy [J]."""
        return float(self.observables["elastic_energy"])

    @property
    def reactions(self) -> Dict[str, Floats]:
        """{group: (d,)} forces of supports on the group [N]."""
        return {name.split("/", 1)[1]: np.atleast_1d(value) for name, value in self.observables.items() if name.startswith("reaction/")}

    def plot(self, file: Union[str, os.PathLike[str], None] = None, **look: Any) -> Figure:
        """A picture of it, springs coloured by their tension [N]; written to `file` if one is named. Returns the figure of matplotlib. look: size [inch],
        dpi, cmap."""
        from .picture import draw

        return draw(self.lattice, self.x, self.tension, "tension / N", f"load factor {self.load_factor:g}", file=file, **look)

    def _repr_html_(self) -> str:
        rows = {"load factor": f"{self.load_factor:g}", "elastic energy": looks.number(self.energy, "J"), "largest tension": looks.number(looks.most(self.tension), "N"),
                "largest compression": looks.number(looks.most(-self.tension), "N")}
        rows.update({f"reaction of {name}": looks.vector(force, "N") for name, force in self.reactions.items()})
        if self.broken.any():
            rows["broken springs"] = f"{int(self.broken.sum()):,}"
        rows["Newton iterations"] = f"{self.newton} in {self.steps} load step{'s' * (self.steps != 1)}" + (f", {self.rejected} rejected" if self.rejected else "")
        return looks.page("Equilibrium", rows, looks.picture(self.lattice, self.x, self.tension, "tension", "N"))

    def __repr__(self) -> str:
        broken = f", {int(self.broken.sum())} springs broken" if self.broken.any() else ""
        return f"<backspring.Equilibrium at the load factor {self.load_factor:g}: elastic energy {self.energy:.6g} J, {self.newton} Newton iterations{broken}>"


class Modes:
    """Free vibrations, K of them. omega2: (K,) ascending [1/s^2]. shapes: (K, N, d), sum over particles of m |q|^2 = 1 [kg^-1/2]. residual: (K,) bounds
    of the errors of omega2 [1/s^2]. zero: motions without stiffness in all, or -1 where they were not counted. lattice: of which they are, x: (N, d)
    about which [m]. Unpacks into omega2, shapes."""

    omega2: Floats
    shapes: Floats
    residual: Floats
    zero: int
    lattice: Lattice
    x: Floats

    def __init__(self, found: Found, lattice: Lattice, x: Floats) -> None:
        self.omega2, self.shapes, self.residual, self.zero = found["omega_squared"], found["shapes"], found["residual"], found["zero_modes"]
        self.lattice, self.x = lattice, x

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

    def plot(self, k: int = 0, file: Union[str, os.PathLike[str], None] = None, size_of_motion: float = 0.1, **look: Any) -> Figure:
        """A picture of the mode k: springs moved along it, coloured by their lengthening as a part of the largest [1], the lattice at rest in grey; written
        to `file` if one is named. Returns the figure of matplotlib. look: size [inch], dpi, cmap."""
        from .picture import draw

        x = self.moved(k, size_of_motion)
        title = f"mode {k}: $\\omega^2$ = {self.omega2[k]:.4g} s$^{{-2}}$"
        return draw(self.lattice, x, looks.stretches(self.lattice, self.x, self.shapes[k]), "lengthening", title, behind=self.x, file=file, **look)

    def _repr_html_(self) -> str:
        rows = {"modes": str(len(self)), "omega<sup>2</sup>": ", ".join(f"{one:.4g}" for one in self.omega2[:6]) + (", ..." if len(self) > 6 else "") + " s<sup>-2</sup>"}
        if self.zero >= 0:
            rows["without stiffness"] = str(self.zero)
        pictures = [looks.picture(self.lattice, self.moved(k), looks.stretches(self.lattice, self.x, self.shapes[k]), width=200, caption=f"{k}: {one:.4g} s<sup>-2</sup>")
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


def _lattice_of(net: Union[Lattice, Equilibrium], forces: Optional[GivenForces]) -> Tuple[Lattice, Settings, Optional[GivenForces]]:
    """The lattice of a lattice or an equilibrium, and the settings and forces that go with it."""
    if isinstance(net, Equilibrium):
        files = ("-bs_output", "-bs_report", "-bs_checkpoint", "-bs_overwrite", "-bs_write_")
        return net.lattice, [one for one in net.settings if not one[0].startswith(files)], net.forces if forces is None else forces
    if not isinstance(net, Lattice):
        raise InputError(f"give a backspring.Lattice or an Equilibrium, not {type(net).__name__}")
    return net, [], forces


Analysis = Callable[["Session", Settings], Tuple["Problem", "Found"]]
Watch = Callable[[float, "Equilibrium"], Any]


class _Watched:
    """What is told of the load steps of an analysis: a bar of progress and the caller's functions of (s, equilibrium)."""

    def __init__(self, net: Lattice, settings: Settings, forces: Optional[GivenForces], comm: Comm, progress: bool, observe: Optional[Watch], stop: Optional[Watch]) -> None:
        for name, one in (("observe", observe), ("stop", stop)):
            if one is not None and not callable(one):
                raise InputError(f"{name}: {one!r} is no function of the load factor and an equilibrium")
        self._of, self._comm, self._observe, self._stop, self._shown = (net, settings, forces), comm, observe, stop, progress
        self.bar = Progress(progress, comm, 0.0, 1.0, "load")
        self._steps = self._newton = self._krylov = self._rejected = 0
        self._raised: Optional[BaseException] = None
        self._others = False

    def attach(self, session: Session) -> None:
        if self._shown or self._observe or self._stop:
            session.observe(lambda step, s, *more: self._after_step(session, step, s, *more))

    def _after_step(self, session: Session, step: int, s: float, h: float, newton: int, krylov: int, rejected: int) -> bool:
        """Whether this equilibrium is the last, the same on all ranks. An exception on one rank ends the call on all."""
        self.bar.at(s, step)
        self._steps, self._newton, self._krylov, self._rejected = step, self._newton + newton, self._krylov + krylov, self._rejected + rejected
        if not (self._observe or self._stop):
            return False
        counts = {"load_factor": s, "newton": self._newton, "krylov": self._krylov, "steps": self._steps, "rejected": self._rejected}
        said = False
        error, frame = session.frame()
        try:
            errors.check(error)
            state = Equilibrium(*self._of, {**frame, **counts})  # type: ignore[typeddict-item]
            if self._observe:
                self._observe(s, state)
            said = self._stop is not None and bool(self._stop(s, state))
        except BaseException as one:
            self._raised = one
        wrong = agreed(self._comm, self._raised is not None)
        self._others = wrong and self._raised is None
        return wrong or agreed(self._comm, said)

    def check(self) -> None:
        """After the analysis, on all ranks: what this one's functions raised, or that those of another did."""
        if self._raised is not None:
            raise self._raised
        if self._others:
            raise errors.Stopped("another rank raised an exception in observe or stop")


def _solve(net: Lattice, settings: Settings, comm: Comm, forces: Optional[GivenForces], analysis: Analysis,
           watched: Optional[_Watched] = None) -> Tuple[Problem, Found]:
    """(error, found) of `analysis` of a session of its own, and the lattice."""
    try:
        session, number = new_session(comm, net, [], forces, settings)
        try:
            if watched:
                watched.attach(session)
            error, found = analysis(session, settings)
            if watched:
                watched.check()
            errors.pass_on(session.warnings)
        finally:
            end_session(session, number)
    finally:
        if watched:
            watched.bar.close()
    return error, found


def _equilibrium(net: Lattice, settings: Settings, comm: Comm, forces: Optional[GivenForces], analysis: Analysis, progress: bool = False,
                 observe: Optional[Watch] = None, stop: Optional[Watch] = None) -> Tuple[Optional[Equilibrium], Found]:
    """The equilibrium that an analysis found, and all that it found."""
    watched = on_all(comm, lambda: _Watched(net, settings, forces, comm, progress, observe, stop))
    error, found = _solve(net, [("-bs_output_springs", "true")] + settings, comm, forces, analysis, watched)
    state = Equilibrium(net, settings, forces, found) if found["fields"] else None
    errors.check(error, lambda: state)
    return state, found


def _asked(net: Union[Lattice, Equilibrium], loads: Optional[Loads], total: Shared, load_steps: int, forces: Optional[GivenForces], comm: Comm,
           options: Dict[str, Option]) -> Tuple[Lattice, Settings, Optional[GivenForces]]:
    """Collective. The lattice, the settings and the forces of an analysis under loads."""
    def checked() -> Tuple[Lattice, Settings, Optional[GivenForces]]:
        lattice, earlier, own = _lattice_of(net, forces)
        later = loads_of(loads, total) + settings_of({"bs_load_steps": whole("load_steps", load_steps)}) + settings_of(options)
        return lattice, joined(earlier, later), own

    return on_all(comm, checked)


def statics(net: Union[Lattice, Equilibrium], loads: Optional[Loads] = None, *, load_steps: int = 1, total: Shared = False, forces: Optional[GivenForces] = None,
            observe: Optional[Watch] = None, stop: Optional[Watch] = None, progress: bool = False, comm: Comm = None, **options: Option) -> Equilibrium:
    """The equilibrium of a lattice under loads that grow in `load_steps` steps, from the lattice as it is.

    loads: {group: (d,)} force on every particle of the group [N]; total: shared by its particles instead, for all groups or those named.
    forces: f(s, x, v) -> (N, d) [N] beside those of the options, s the load factor, not in the tangent (soft forces); on several ranks f(s, x, v, rows) for
    some rows of each rank at a time. observe(s, equilibrium) is called after every load step; stop(s, equilibrium) likewise, and where it returns True on
    some rank that equilibrium is the last, and what is returned. progress: a bar of tqdm along the load steps.
    comm: communicator of mpi4py, by default the world. Options of the program by their names: snes_rtol=1e-12, bs_gravity=(0, -9.81),
    bs_motion_top="y=velocity:0.1".
    Raises InputError, and ConvergenceError whose state is the last equilibrium on the way.
    """
    lattice, settings, forces = _asked(net, loads, total, load_steps, forces, comm, options)
    state = _equilibrium(lattice, settings, comm, forces, lambda session, more: session.statics(more), progress, observe, stop)[0]
    assert state is not None
    return state


def moduli(net: Union[Lattice, Equilibrium], loads: Optional[Loads] = None, *, load_steps: int = 1, total: Shared = False, forces: Optional[GivenForces] = None,
           progress: bool = False, comm: Comm = None, **options: Option) -> Moduli:
    """The stiffness of a periodic lattice at its equilibrium [N/m^(d-1)]; arguments as of statics."""
    lattice, settings, forces = _asked(net, loads, total, load_steps, forces, comm, options)
    state, found = _equilibrium(lattice, settings, comm, forces, lambda session, more: session.moduli(more), progress)
    return Moduli(found, state)


def modes(net: Union[Lattice, Equilibrium], count: int = 6, *, forces: Optional[GivenForces] = None, comm: Comm = None, **options: Option) -> Modes:
    """The `count` lowest free vibrations: of a lattice about its start, of an equilibrium about it as it stands, under the loads of its load factor. forces,
    comm, options as of statics."""
    def checked() -> Tuple[int, Lattice, Settings, Optional[GivenForces]]:
        lattice, earlier, own = _lattice_of(net, forces)
        about = [("-bs_modes_about", "equilibrium")] if isinstance(net, Equilibrium) else []
        earlier = [one for one in earlier if one[0].startswith("-bs_")]  # the others are PETSc's, of solves that there are none of
        return whole("count", count), lattice, joined(joined(earlier, about), settings_of(options)), own

    wanted, lattice, settings, forces = on_all(comm, checked)
    state = net._state if isinstance(net, Equilibrium) else None
    error, found = _solve(lattice, settings, comm, forces, lambda session, more: session.modes(wanted, more, state))
    errors.check(error)
    return Modes(found, lattice, net.x)
