"""Equilibria, modes and moduli of networks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Dict, List, Optional, Tuple, Union

from . import errors
from ._library import agreed, end_session, new_session, on_all, tell
from .errors import InputError
from .forces import held_at
from .kinds import Comm, GivenForces, Loads, Mask, Option, Settings, Shared
from .lattice import Lattice
from .options import joined, loads_of, options_of, settings_of, whole
from .progress import Progress
from .results import Equilibrium, Moduli, Modes

if TYPE_CHECKING:
    from ._core import Found, Problem, Session


def lattice_of(net: Union[Lattice, Equilibrium], forces: Optional[GivenForces]) -> Tuple[Lattice, Settings, Optional[GivenForces]]:
    """The lattice of a lattice or an equilibrium, and the settings and forces that go with it."""
    if isinstance(net, Equilibrium):
        files = ("-bs_output", "-bs_report", "-bs_checkpoint", "-bs_overwrite", "-bs_write_")
        return net.lattice, [one for one in net.settings if not one[0].startswith(files)], net.forces if forces is None else forces
    if not isinstance(net, Lattice):
        raise InputError(f"give a backspring.Lattice or an Equilibrium, not {type(net).__name__}")
    return net, [], forces


def own_lattice(lattice: Lattice) -> str:
    """How a lattice of its own is made of an equilibrium `eq` of this one, as messages say it: at its places, in its box, with the rest lengths and images of before."""
    given = ["x=eq.x"] + (["box=eq.box"] if lattice.box is not None else []) + (["rest_length=eq.lattice.lengths()"] if lattice.rest_length is None else [])
    return f"eq.lattice{'.with_images()' if lattice.box is not None else ''}.replace({', '.join(given)})"


def refuse_led(settings: Settings, lattice: Lattice) -> None:
    """What led an equilibrium to its place at t = 1 is elsewhere at t = 0, where a motion begins."""
    for name, text in settings:
        varies = name in ("-bs_box_strain", "-bs_box_rate") or (name == "-bs_anchor_motion" and text != "fixed")
        if varies or (name.startswith("-bs_force_") and any(form in str(text) for form in ("expression:", "table:"))):
            another = "another one, which strains the equilibrium's box," if name.startswith("-bs_box_") else "another one,"
            raise InputError(f"{name[1:]}: it has the equilibrium where it is at t = 1, and a motion begins at t = 0: give the motion {another} or a lattice "
                             f"of its own, {own_lattice(lattice)}")


def moved_by(settings: Settings, given: Settings, lattice: Lattice, gone: Mask) -> List[str]:
    """The motions of `settings` that have taken particles, a mask (N,) of those that are not where the equilibrium has them, without those that the caller of
    a motion has given anew."""
    from ._core import kept_name

    anew = {kept_name(name).lower() for name, _ in given}
    groups = {name: lattice.groups.get(name[len("-bs_motion_"):]) for name, _ in settings if name.startswith("-bs_motion_")}
    rest = gone.copy()
    for name, members in groups.items():
        if members is not None and kept_name(name).lower() in anew:
            rest &= ~members
    kept = {name: members for name, members in groups.items() if kept_name(name).lower() not in anew}
    found = [name for name, members in kept.items() if members is not None and (rest & members).any()]
    return found or [name for name, members in kept.items() if members is None and rest.any()]


def start_of(net: Union[Lattice, Equilibrium], forces: Optional[GivenForces]) -> Tuple[Lattice, Settings, Optional[GivenForces]]:
    """Where a motion begins, at rest, and the settings and forces that go with it: of an equilibrium without those by which it was found."""
    lattice, settings, own = lattice_of(net, forces)
    if not isinstance(net, Equilibrium):
        return lattice, settings, own
    if forces is None and own is not None:
        own = held_at(own, 1.0)
    if abs(net.load_factor - 1) > 1e-9:
        raise InputError(f"the equilibrium stands at the load factor {net.load_factor:g}, and a motion has all loads in full: give one under the full loads, or "
                         f"{own_lattice(lattice)} and the loads of the motion")
    rest = lattice.rest_length if lattice.rest_length is not None else lattice.lengths()
    found_by = ("-bs_load_", "-bs_arc_", "-bs_step_", "-bs_stop_", "-bs_stability_", "-bs_equilibria", "-bs_compliance_", "-bs_zero_modes_", "-bs_box_stress_",
                "-bs_break_dt", "-bs_break_follow", "-bs_break_max_steps", "-bs_break_output_interval")
    box = {} if lattice.box is None else {"box": net.box}
    there = lattice.with_images().replace(x=net.x, velocity=0 * net.x, rest_length=rest, **box)
    return there, [one for one in settings if one[0].startswith("-bs_") and not one[0].startswith(found_by)], own


Analysis = Callable[["Session", Settings], Tuple["Problem", "Found"]]
Watch = Callable[[float, "Equilibrium"], Any]


class _Watched:
    """What is told of the load steps of an analysis: a bar of progress and the caller's functions of (load factor, equilibrium)."""

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
        """Whether this equilibrium is the last, the same on all ranks. An exception on one rank ends the call on all. s: the load factor, or by arc length how
        far the path has come."""
        self.bar.at(s, step)
        self._steps, self._newton, self._krylov, self._rejected = step, self._newton + newton, self._krylov + krylov, self._rejected + rejected
        if not (self._observe or self._stop):
            return False
        counts = {"newton": self._newton, "krylov": self._krylov, "steps": self._steps, "rejected": self._rejected}
        said = False
        error, frame = session.frame()
        try:
            errors.check(error)
            observables = {"stability": 0.0, "negative_pivots": -1.0, **frame["observables"]}  # on the way nothing is said of stability
            factor = float(observables.get("load_factor", s))
            state = Equilibrium(*self._of, {**frame, "observables": observables, "load_factor": factor, **counts})
            if self._observe:
                self._observe(factor, state)
            said = self._stop is not None and bool(self._stop(factor, state))
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
            tell(session)
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


def _asked(call: Callable[..., Any], net: Union[Lattice, Equilibrium], loads: Optional[Loads], total: Shared, load_steps: Optional[int], forces: Optional[GivenForces],
           comm: Comm, options: Dict[str, Option]) -> Tuple[Lattice, Settings, Optional[GivenForces]]:
    """Collective. The lattice, the settings and the forces of an analysis under loads that `call` was asked for."""
    def checked() -> Tuple[Lattice, Settings, Optional[GivenForces]]:
        lattice, earlier, own = lattice_of(net, forces)
        steps = None if load_steps is None else whole("load_steps", load_steps)
        later = loads_of(loads, total, lattice.dim) + settings_of({"bs_load_steps": steps}) + options_of(call, options)
        return lattice, joined(earlier, later), own

    return on_all(comm, checked)


def statics(net: Union[Lattice, Equilibrium], loads: Optional[Loads] = None, *, load_steps: Optional[int] = None, total: Shared = False, forces: Optional[GivenForces] = None,
            observe: Optional[Watch] = None, stop: Optional[Watch] = None, progress: bool = False, comm: Comm = None, **options: Option) -> Equilibrium:
    """The equilibrium of a lattice under loads that grow in `load_steps` steps (by default 1, of an equilibrium those by which it was found), from the lattice
    as it is.

    loads: {group: (d,)} force on every particle of the group [N]; total: shared by its particles instead, for all groups or those named.
    forces: f(s, x, v) -> (N, d) [N] beside those of the options, s the load factor, not in the tangent (soft forces); on several ranks f(s, x, v, rows) for
    the rows of each rank. observe(s, equilibrium) is called after every load step, s its load factor; stop(s, equilibrium) likewise, and where it returns True on
    some rank that equilibrium is the last, and what is returned. progress: a bar of tqdm along the load steps.
    comm: communicator of mpi4py, by default the world. Options of the program by their names: snes_rtol=1e-12, bs_gravity=(0, -9.81),
    bs_motion_top="y=velocity:0.1".
    Raises InputError, and ConvergenceError whose state is the last equilibrium on the way.
    """
    lattice, settings, forces = _asked(statics, net, loads, total, load_steps, forces, comm, options)
    state = _equilibrium(lattice, settings, comm, forces, lambda session, more: session.statics(more), progress, observe, stop)[0]
    assert state is not None
    return state


def moduli(net: Union[Lattice, Equilibrium], loads: Optional[Loads] = None, *, load_steps: Optional[int] = None, total: Shared = False, forces: Optional[GivenForces] = None,
           progress: bool = False, comm: Comm = None, **options: Option) -> Moduli:
    """The stiffness of a periodic lattice at its equilibrium [N/m^(d-1)]; arguments as of statics."""
    lattice, settings, forces = _asked(moduli, net, loads, total, load_steps, forces, comm, options)
    state, found = _equilibrium(lattice, settings, comm, forces, lambda session, more: session.moduli(more), progress)
    return Moduli(found, state)


def modes(net: Union[Lattice, Equilibrium], count: Optional[int] = None, *, forces: Optional[GivenForces] = None, comm: Comm = None, **options: Option) -> Modes:
    """The `count` lowest free vibrations, by default 10, or all where there are fewer: of a lattice about its start, or with
    bs_modes_about="equilibrium" about the equilibrium under its full loads; of an equilibrium about it as it stands, under the loads of its load factor. forces, comm, options as of statics."""
    def checked() -> Tuple[Optional[int], Lattice, Settings, Optional[GivenForces]]:
        asked = options.pop("bs_modes", None) if count is None else count
        number = None if asked is None else whole("count", asked)
        lattice, earlier, own = lattice_of(net, forces)
        about = [("-bs_modes_about", "equilibrium")] if isinstance(net, Equilibrium) else []
        earlier = [one for one in earlier if one[0].startswith("-bs_")]  # the others are PETSc's, of solves that there are none of
        given = options_of(modes, options)
        joined([], settings_of({"bs_modes": number}) + given)  # how many they are is said once
        return number, lattice, joined(joined(earlier, about), given), own

    number, lattice, settings, forces = on_all(comm, checked)
    state = net._state if isinstance(net, Equilibrium) else None
    error, found = _solve(lattice, settings, comm, forces, lambda session, more: session.modes(number, more, state))
    errors.check(error)
    return Modes(found, lattice)
