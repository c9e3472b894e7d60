"""Motions: steps in time."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Callable, Dict, Optional, Tuple, Type, Union

import numpy as np
from numpy.typing import ArrayLike

from . import errors
from ._library import end_session, is_open, new_session, on_all, require_same, world
from .analyses import moved_by, own_lattice, refuse_led, start_of
from .arguments import array_of, one_of
from .breaks import Events
from .changes import change, numbered
from .errors import InputError
from .frames import Frame
from .kinds import Comm, Floats, GivenForces, Loads, Mask, Observables, Option, Settings, Shared
from .lattice import Lattice
from .options import joined, loads_of, options_of, settings_of, whole
from .readonly import read_only
from .results import Equilibrium
from .watching import Found, Observe, Watched

if TYPE_CHECKING:
    from ._core import Problem, State

Path = Union[str, os.PathLike[str]]


class Simulation(Watched):
    """A lattice that is stepped in time. lattice: what moves, N particles and S springs in d dimensions.

    dt: the step [s]. forces: f(t, x, v) -> (N, d) [N] beside those of the options, not in the tangent of implicit methods (soft forces); on several ranks
    f(t, x, v, rows) for the rows of each rank. observe(t, frame) is called after every step; stop(t, frame) likewise, and where it returns
    True on some rank the call under way ends with this step on all of them (`stopped`); what they raise ends it, too. loads, total as of statics. Other
    options of the program by their names: ts_type="cn", ts_theta_theta=0.5. Calls are collective on `comm`. A context manager: files that options name
    are complete after close().
    """

    lattice: Lattice

    def __init__(self, net: Union[Lattice, Equilibrium], *, dt: Optional[float] = None, loads: Optional[Loads] = None, total: Shared = False,
                 forces: Optional[GivenForces] = None, observe: Optional[Observe] = None, stop: Optional[Observe] = None, comm: Comm = None,
                 **options: Option) -> None:
        self._number: Optional[int] = None
        super().__init__(world(comm), observe, stop)

        def checked() -> Tuple[Lattice, Settings, Settings, Optional[GivenForces]]:
            for name, one in (("observe", observe), ("stop", stop)):
                if one is not None and not callable(one):
                    raise InputError(f"{name}: {one!r} is no function of t and a frame")
            lattice, earlier, own = start_of(net, forces)
            given = loads_of(loads, total, lattice.dim) + settings_of({"ts_dt": dt}) + options_of(Simulation, options)
            both = joined(earlier, given)
            if isinstance(net, Equilibrium):
                refuse_led([one for one in both if one not in given], net.lattice)
            return lattice, both, given, own

        self.lattice, settings, given, forces = on_all(comm, checked)
        self._sets = 0
        self._session, self._number = new_session(comm, self.lattice, settings, forces)
        self._done(self._session.inherit(net._state) if isinstance(net, Equilibrium) else self._session.prepare())
        if any(name == "-bs_restart" for name, _ in settings):
            self.get("position", whole=False)  # reads the state, and with it the time
        elif isinstance(net, Equilibrium):
            self._refuse_moved(settings, given, own_lattice(net.lattice))
        self._attach()

    def _refuse_moved(self, settings: Settings, given: Settings, lattice: str) -> None:
        """What moves with time is where the equilibrium has it when a motion begins: what led it there and is not 0 then would be added once more."""
        if not any(name.startswith("-bs_motion_") for name, _ in settings):
            return
        away = np.abs(self.get("position") - self.lattice.x).max(axis=1)
        names = moved_by(settings, given, self.lattice, away > 1e-9 * (np.abs(self.lattice.x).max() or 1.0))
        if names:
            self._end()
            raise InputError(f"{names[0][1:]}: it has led the equilibrium where it is, and is not 0 when the motion begins, so that it would be added once more: give "
                             f"the motion another one ({names[0][1:]}=\"fixed\" holds the group where it is), or a lattice of its own, {lattice}")

    @classmethod
    def restart(cls, path: Path, net: Union[Lattice, Equilibrium], **arguments: Any) -> Simulation:
        """The simulation of the lattice `net` that goes on where checkpoint() was called, or bs_checkpoint wrote. The options of then hold again, those that
        are given here (arguments of Simulation) take their place."""
        return cls(net, bs_restart=path, **arguments)

    def _frame(self, changeable: bool = False) -> Frame:
        return Frame(self, changeable)

    def _same(self, name: str, check: Callable[[], Found]) -> Found:
        """An argument as `check` returns it, unless that raises or returns something else on some rank."""
        found = on_all(self._comm, check)
        require_same(self._comm, {name: found})
        return found

    def _moment(self) -> Tuple[int, int]:
        """Another one whenever the state is another."""
        return self._session.steps, self._sets

    def step(self, count: int = 1) -> None:
        """`count` steps."""
        def checked() -> int:
            if whole("count", count) < 0:
                raise InputError(f"count: {count} is negative")
            return whole("count", count)

        steps = self._same("count", checked)
        self._step(lambda: self._session.step(steps))

    def run_until(self, t: float) -> None:
        """Steps up to the time t [s], where the last one ends."""
        end = self._same("t", lambda: float(array_of("t", t, ())))
        self._step(lambda: self._session.run_until(end))

    def next_frame(self) -> bool:
        """Steps up to the next output time (bs_output_interval; without it, the next step) or the end (ts_max_time). False where the end was reached before."""
        return bool(self._step(self._session.run_to_frame)[1])

    def on_step(self, observer: Optional[Callable[..., Any]]) -> None:
        """observer(step, t, dt, newton, krylov, rejected) is called on every rank after every step: its number, the time and the step's length [s],
        iterations of Newton's and the Krylov method, rejected attempts; an exception in it ends the call. None: no more."""
        if not is_open(self._number):
            raise RuntimeError("the simulation is closed: make another one")
        self._on_step = observer
        self._attach()

    @property
    def t(self) -> float:
        """Time of the last good state [s]."""
        return self._session.time

    @property
    def steps(self) -> int:
        """Steps that were taken."""
        return self._session.steps

    @property
    def rows(self) -> slice:
        """The rows of this rank, for get() and set()."""
        first, count = self._session.rows
        return slice(first, first + count)

    def get(self, what: str, whole: bool = True) -> Floats:
        """position [m], velocity [m/s], force or reaction [N]: (N, d) of all particles, or of this rank's rows, a copy of the caller's own."""
        self._same("what", lambda: one_of(what, "position", "velocity", "force", "reaction"))
        return self._found(self._session.get(what, whole))

    def view(self, what: str) -> Floats:
        """position [m] or velocity [m/s] where the state has them, (N, d), read-only and without a copy: it follows steps and states that are set or restored,
        and stays as it is when the simulation ends. On one rank, with bs_ordering="rows" where particles would get another order, and without groups
        that are held or move by options; else an InputError says what is in the way. Within a step it may show an attempt. Ask anew after change()."""
        self._same("what", lambda: one_of(what, "position", "velocity"))
        return self._found(self._session.view(what))

    def set(self, what: str, numbers: ArrayLike, whole: bool = True) -> None:
        """position [m] or velocity [m/s]: (N, d) of all particles, or of this rank's rows, from which the method starts anew."""
        self._same("what", lambda: one_of(what, "position", "velocity"))
        require_same(self._comm, {"whole": bool(whole)})
        self._put(what, numbers, whole, bool(whole))

    def _put(self, what: str, numbers: ArrayLike, whole: bool, same: bool) -> None:
        """same: what other ranks give of the rows of this one must be the same, too."""
        rows = len(self.lattice) if whole else self.rows.stop - self.rows.start
        values = on_all(self._comm, lambda: array_of(what, numbers, (rows, self.lattice.dim)))
        if same:
            require_same(self._comm, {what: values})
        self._done(self._session.set_rows(what, values[self.rows] if whole else values))
        self._sets += 1

    def change(self, *, remove: ArrayLike = (), **numbers: ArrayLike) -> None:
        """Numbers from now on, (S,) or one number: stiffness [N/m], rest_length [m], damping [kg/s], or what the springs' law takes; mass, (N,) or one
        number [kg]; angle_stiffness, hinge_stiffness [N m/rad^2], angle_rest_angle, hinge_rest_angle [rad], one of each. remove:
        springs, rows or a mask (S,), that exert no force any more, whatever numbers they are given later, unless restore() brings them back. A method of several
        steps starts anew."""
        self.lattice = change(self._session, self.lattice, self._comm, remove, numbers)
        self._sets += 1

    def drive(self, group: str, places: ArrayLike, t: float) -> None:
        """The group, whose motion is an option's (bs_motion_NAME="given"), moves uniformly from where it is to `places`, (members, d) [m], at the time t [s],
        and stays there until the next call."""
        def checked() -> Tuple[Floats, float]:
            if group not in self.lattice.groups:
                raise InputError(f"the lattice has no group {group!r}: name one of its own, {', '.join(self.lattice.groups) or 'of which it has none'}; "
                                 f"groups of options (bs_group_...) cannot be driven: give it as groups={{{group!r}: rows}} of the lattice")
            members = np.flatnonzero(self.lattice.groups[group])
            every = np.array(self.lattice.x, dtype=float)
            every[members] = array_of(f"the array of places of {group}", places, (len(members), self.lattice.dim))
            return every, float(array_of("t", t, ()))

        every, time = on_all(self._comm, checked)
        require_same(self._comm, {"group": group, "t": time})
        self._done(self._session.drive(group, time, every[self.rows]))

    def save(self) -> State:
        """All that the motion is now, for restore(): the state, histories of springs, what is broken or removed, numbers that change() gave, works, the time,
        and what the method remembers of earlier steps."""
        return self._found(self._session.save())

    def restore(self, state: State) -> None:
        """Goes on from what save() of this simulation, or of another one of the same lattice on as many ranks, has returned, as often as it is wanted: the
        steps that follow are those that followed save(), to the last bit. Springs that broke since are whole again. A simulation of another method or step
        starts from there anew, and says so."""
        from . import _core

        if self.agreed(not isinstance(state, _core.State)):
            raise InputError("state: give on every rank what save() of a simulation of this lattice has returned")
        self._done(self._session.restore(state))
        self.lattice = numbered(self._session, self.lattice)
        self._sets += 1

    @property
    def x(self) -> Floats:
        """(N, d) positions [m], read-only, and set as a whole: simulation.x = new."""
        return read_only(self.get("position"))

    @x.setter
    def x(self, value: ArrayLike) -> None:
        self.set("position", value)

    @property
    def v(self) -> Floats:
        """(N, d) velocities [m/s], read-only, and set as a whole: simulation.v = new; simulation.v *= 0.5 sets them, too."""
        return read_only(self.get("velocity"))

    @v.setter
    def v(self, value: ArrayLike) -> None:
        self.set("velocity", value)

    @property
    def forces(self) -> Floats:
        """(N, d) forces [N]."""
        return read_only(self.get("force"))

    @property
    def reactions(self) -> Floats:
        """(N, d) forces that supports and motions exert on what is held, 0 elsewhere [N]."""
        return read_only(self.get("reaction"))

    def petsc(self) -> Any:
        """PETSc's stepper as petsc4py has it (petsc4py.PETSc.TS), with its SNES, KSP, state and matrices, to be looked at between steps: getSNES(),
        getSNES().getKSP(), getSolution(). It ends with the simulation, and with the next state that is set or restored: what is looked at stays, and what
        would compute is a RuntimeError then, of solvers and matrices that were taken from it, too."""
        return self._found(self._session.stepper())

    def frame(self) -> Dict[str, Any]:
        """{time [s], observables, fields, breaks} of this moment, as a trajectory has them."""
        return self._found(self._session.frame())

    @property
    def observables(self) -> Observables:
        """{name: number or array} of this moment, as in a trajectory."""
        return Frame(self).observables

    @property
    def broken(self) -> Mask:
        """(S,) whether a spring is broken."""
        return Frame(self).broken

    @property
    def events(self) -> Events:
        """The springs that broke so far, and when."""
        return Frame(self).events

    def checkpoint(self, path: Path, overwrite: bool = False) -> None:
        """Writes the present state as a checkpoint, from which restart() goes on to the same digits; where a file is there, with overwrite alone."""
        require_same(self._comm, {"path": str(path), "overwrite": overwrite})
        if not overwrite and self.agreed(os.path.exists(path)):
            raise InputError(f"path: {os.fspath(path)!r} is there already: give another name, or overwrite=True")
        self._done(self._session.checkpoint(os.fspath(path)))

    def close(self) -> None:
        """Ends stepping; files that options name are complete. What a step has failed with is not raised again."""
        errors.check(self._end())

    def _end(self) -> Problem:
        if self._bar:
            self._bar.close()
        return None if self._number is None else end_session(self._session, self._number)

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Any, trace: Any) -> None:
        if kind is None:
            self.close()
        else:
            self._end()

    def __repr__(self) -> str:
        at = "closed" if not is_open(self._number) else f"at t = {self.t:g} s after {self.steps} step{'s' * (self.steps != 1)}"
        return f"<backspring.Simulation of {len(self.lattice)} particles, {at}>"
