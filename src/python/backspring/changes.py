"""Numbers of a lattice that change while what was made of it lives, and equilibria that follow them."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Tuple, Type, Union

import numpy as np
from numpy.typing import ArrayLike

from . import errors
from ._library import InProcess, end_session, is_open, new_session, on_all, require_same, tell
from .analyses import _asked
from .arguments import array_of, mask_of, numbers_in
from .errors import InputError
from .kinds import Comm, Floats, GivenForces, Loads, Option, Shared, Whole
from .lattice import INTERACTIONS, Lattice
from .results import Equilibrium

if TYPE_CHECKING:
    from ._core import Session


def of_interactions(lattice: Lattice, kind: str) -> List[Tuple[str, str]]:
    """Of the numbers that angle springs or hinges (`kind`: their group) take: the name in the group, and that by which they are changed."""
    return [(of, f"{kind[:-1]}_{of}") for of in ("stiffness", "rest_angle")] if getattr(lattice, kind) else []


def change(session: Session, lattice: Lattice, comm: Comm, remove: ArrayLike, numbers: Any) -> Lattice:
    """The lattice as it is after numbers of its springs or particles were given anew to `session`. Raises InputError, and then none is changed."""
    counts = {name: len(lattice.pairs) for name in ("stiffness", "rest_length", "damping", *lattice.spring_columns)}
    counts.update({"mass": len(lattice)}, **{name: len(getattr(lattice, kind)[of]) for kind in INTERACTIONS for of, name in of_interactions(lattice, kind)})

    def checked() -> Tuple[Whole, Dict[str, Floats]]:
        for name in numbers:
            if name not in counts:
                raise InputError(f"{name!r} cannot be changed: give {', '.join(counts)} or remove")
        order = sorted(numbers, key=lambda name: bool(name == "rest_length"))  # last: what is the initial distance could not be given back
        given = {name: numbers_in(name, numbers[name], counts[name]) for name in order}
        return np.flatnonzero(mask_of("remove", remove, len(lattice.pairs), "springs")), given

    gone, given = on_all(comm, checked)
    require_same(comm, {"remove": gone, **given})
    was = {name: session.numbers(name) for name in given}
    for done, (name, values) in enumerate(given.items()):
        error = session.set_numbers(name, values)
        if error is not None:
            for earlier in list(given)[:done]:
                session.set_numbers(earlier, was[earlier])
            tell(session)
            errors.check(error)
    error = session.remove_springs(gone) if len(gone) else None
    tell(session)
    errors.check(error)
    return numbered(session, lattice, "rest_length" in given)


def numbered(session: Session, lattice: Lattice, lengths: bool = False) -> Lattice:
    """The lattice with the numbers that `session` has now. lengths: rest lengths, too, where they were the initial distances."""
    now = copy.copy(lattice)
    now.stiffness, now.damping, now.mass = session.numbers("stiffness"), session.numbers("damping"), session.numbers("mass")
    if now.rest_length is not None or lengths:
        now.rest_length = session.numbers("rest_length")
    now.spring_columns = {name: session.numbers(name) for name in lattice.spring_columns}
    for kind in INTERACTIONS:
        changed = {of: session.numbers(name) for of, name in of_interactions(lattice, kind)}
        setattr(now, kind, {**getattr(lattice, kind), **changed} if changed else None)
    return now


class Statics(InProcess):
    """Equilibria of one lattice whose numbers change, by a solver that stays: partition, patterns and orderings are made once.

        with bs.Statics(net, loads={"top": (0, -5.0)}) as solver:
            first = solver.solve()
            solver.change(stiffness=k)
            second = solver.solve()

    The first equilibrium is that of statics(), whose arguments these are; each of the others is what the one before becomes under the full loads when
    the numbers change: the same branch, as far as Newton's method can follow it. Calls are collective on `comm`. lattice: with the numbers of now.
    """

    lattice: Lattice

    def __init__(self, net: Union[Lattice, Equilibrium], loads: Optional[Loads] = None, *, load_steps: Optional[int] = None, total: Shared = False,
                 forces: Optional[GivenForces] = None, comm: Comm = None, **options: Option) -> None:
        self._number: Optional[int] = None
        self.lattice, self._settings, self._forces = _asked(Statics, net, loads, total, load_steps, forces, comm, options)
        self._all = [("-bs_output_springs", "true")] + self._settings
        self._comm, self._stands = comm, False
        self._session, self._number = new_session(comm, self.lattice, [], self._forces, self._all)
        self._session.expect_changes()

    def change(self, *, remove: ArrayLike = (), **numbers: ArrayLike) -> None:
        """Numbers from now on, (S,) or one number: stiffness [N/m], rest_length [m], damping [kg/s], or what the springs' law takes; mass, (N,) or one
        number [kg]; angle_stiffness, hinge_stiffness [N m/rad^2], angle_rest_angle, hinge_rest_angle [rad], one of each. remove: springs, rows or a mask (S,), that exert no force any more, whatever numbers they are given later."""
        self._require_open()
        self.lattice = change(self._session, self.lattice, self._comm, remove, numbers)

    def solve(self, afresh: bool = False) -> Equilibrium:
        """The equilibrium of now. afresh: from the lattice as it was given, by load steps, in the place of the last equilibrium. Raises ConvergenceError,
        whose state is the last equilibrium; the next call starts there again."""
        self._require_open()
        follows = self._stands and not afresh
        error, found = self._session.follow() if follows else self._session.statics(self._all)
        tell(self._session)
        self._stands = follows or error is None
        state = Equilibrium(self.lattice, self._settings, self._forces, found) if found["fields"] else None
        errors.check(error, lambda: state)
        assert state is not None
        return state

    def sensitivities(self, slope: ArrayLike) -> Dict[str, Floats]:
        """What a quantity J of the last equilibrium, a function of its positions, changes by with the numbers of each spring, angle spring and hinge as the
        equilibrium follows: {"stiffness": dJ/dk, "rest_length": dJ/dL, ..., "hinge_rest_angle": dJ/dtheta_0}, one of each, by one linear solve. slope: (N, d) dJ/dx at the equilibrium, 0 where J does not depend
        on a position; where J depends on the numbers themselves, too, that is to be added. Histories of springs are taken as they are.

            target = eq.x[tip] - wanted                     # J = |x_tip - wanted|^2 / 2
            slope = np.zeros_like(eq.x); slope[tip] = target
            downhill = -solver.sensitivities(slope)["stiffness"]
        """
        self._require_open()
        values = on_all(self._comm, lambda: array_of("slope", slope, (len(self.lattice), self.lattice.dim)))
        require_same(self._comm, {"slope": values})
        error, found = self._session.sensitivities(values)
        tell(self._session)
        errors.check(error)
        return found

    def petsc(self) -> Any:
        """PETSc's stepper of the load steps as petsc4py has it (petsc4py.PETSc.TS), with its SNES, KSP, state and tangent at the last equilibrium. It ends with
        the solver, and with the next solve(afresh=True): what is looked at stays, and what would compute is a RuntimeError then."""
        self._require_open()
        error, stepper = self._session.load_stepper()
        tell(self._session)
        errors.check(error)
        return stepper

    def _require_open(self) -> None:
        if not is_open(self._number):
            raise RuntimeError("the solver is closed: make another one")

    def close(self) -> None:
        """Frees what the solver holds."""
        if self._number is not None:
            end_session(self._session, self._number)

    def __enter__(self) -> Statics:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], value: Any, trace: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<backspring.Statics of {len(self.lattice)} particles{'' if is_open(self._number) else ', closed'}>"
