"""Forces that are computed in Python."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Callable, List, Optional, Tuple

import numpy as np
from numpy.typing import ArrayLike

from .arguments import real_array
from .errors import InputError, pass_on
from .kinds import Floats, GivenForces, Settings, Whole

if TYPE_CHECKING:
    from ._core import Functions

_EXPLICIT = ("euler", "rk", "ssp", "symplectic", "verlet")
_said = False  # what forces without an energy mean for implicit methods


class Forces:
    """Forces of one's own beside those of the options, with what implicit methods want to know of them.

    force: f(t, x, v) -> (n, d) [N]. tangent: g(t, x, v) -> K, or (K, D), what the force on each particle changes by with its own place and velocity,
    (n, d, d) or (d, d) for all, df/dx [N/m] and df/dv [N s/m]: the forces are then implicit; without it Newton's method takes them as they were at its last
    iterate, which converges for soft forces. energy: e(t, x) -> (n,) [J], where each particle's force is minus the gradient of the sum of all by its place
    and none depends on v: counted among the energies, and Newton's line search goes by them; without it, it goes by residuals.
    between: (P, 2) rows (i, j) of particles where the force on i depends on where j is, or how fast; both (i, j) and (j, i) where each feels the other; not
    in a periodic box. The tangent then returns (K, D, K_between) or (K, D, K_between, D_between), the blocks between particles being (P, d, d): what the
    force on i changes by with j.
    begin_step: b(t, h, number, attempt, x, v), called once before every attempt at a step of length h from there: what the forces draw or look up for a
    whole step, as random forces do. number counts steps from 1 on, attempt from 0: a step that was rejected is begun again from the same place, shorter.
    Before the first of them the other functions are asked at the start, too; otherwise they must return the same for the same arguments.
    step_limit: l(t, x, dx) -> lambda > 0, the largest part of a change dx of places, inf where there is none, for which the forces are as they should be all
    the way from x to x + lambda dx: Newton's method (beuler, cn, theta and equilibria) goes at most that far at once, so that nothing gets to the other
    side of a barrier without having met it. On several ranks the least of all.
    t: the time [s], in equilibria the load factor; x, v: (n, d) of all particles, in the order of the lattice; what of them is held is where it is held. On
    several ranks they are a rank's own and those that `between` couples to them, whose rows functions that take one argument more, `rows`, are told; a
    tangent that takes another one, `pairs`, is told which of `between` are asked for, by their places among the rows.
    """

    def __init__(self, force: Callable[..., Any], *, tangent: Optional[Callable[..., Any]] = None, energy: Optional[Callable[..., Any]] = None,
                 between: ArrayLike = (), begin_step: Optional[Callable[..., Any]] = None, step_limit: Optional[Callable[..., Any]] = None) -> None:
        self.force, self.tangent, self.energy, self.between, self.begin_step, self.step_limit = force, tangent, energy, _pairs_in(between), begin_step, step_limit
        for name, one, what in (("forces", force, "t, x and v"), ("tangent", tangent, "t, x and v"), ("energy", energy, "t and x"), ("begin_step", begin_step, "t, h, number, attempt, x and v"),
                                ("step_limit", step_limit, "t, x and dx")):
            if not callable(one) and (one is not None or name == "forces"):
                raise InputError(f"{name}: {one!r} is no function of {what}")

    def __repr__(self) -> str:
        given = [name for name in ("tangent", "energy", "begin_step", "step_limit") if getattr(self, name) is not None]
        return f"<backspring.Forces by {getattr(self.force, '__name__', self.force)!s}{' with ' + ' and '.join(given) if given else ''}>"


def _pairs_in(between: ArrayLike) -> Whole:
    found = np.asarray(between)
    if found.size == 0:
        return np.zeros((0, 2), dtype=np.int64)
    if found.ndim != 2 or found.shape[1] != 2 or found.dtype.kind not in "iu":
        raise InputError(f"between: rows of particles, (P, 2) whole numbers: an array of {found.dtype} of the shape {found.shape} came")
    for k in np.flatnonzero((found[:, 0] == found[:, 1]) | (found < 0).any(axis=1)):
        raise InputError(f"between, row {k}: {found[k].tolist()} are no two particles")
    return found.astype(np.int64)


def _with_rows(function: Callable[..., Any], count: int, most: int = 1) -> Callable[..., Any]:
    """`function` of `count` arguments as one that is told `most` more, the rows first, whichever of them it asks for."""
    try:
        taken = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        taken = []
    needed = [one for one in taken if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD) and (one.default is one.empty or one.name in ("rows", "pairs"))]
    told = min(max(len(needed) - count, 0), most)
    return lambda *arguments: function(*arguments[:count + told])


def held_at(forces: GivenForces, t: float) -> Forces:
    """Forces as they are at the time t, whatever the time is."""
    own = forces if isinstance(forces, Forces) else Forces(forces)
    force: Any = _with_rows(own.force, 3)
    tangent: Any = own.tangent and _with_rows(own.tangent, 3, 2)
    energy: Any = own.energy and _with_rows(own.energy, 2)
    begin = own.begin_step and _with_rows(own.begin_step, 6)
    limit: Any = own.step_limit and _with_rows(own.step_limit, 3)
    return Forces(lambda _, x, v, rows: force(t, x, v, rows), tangent=tangent and (lambda _, x, v, rows, pairs: tangent(t, x, v, rows, pairs)),
                  energy=energy and (lambda _, x, rows: energy(t, x, rows)), between=own.between, begin_step=begin,
                  step_limit=limit and (lambda _, x, dx, rows: limit(t, x, dx, rows)))


def _shaped(name: str, found: Any, shape: Tuple[int, ...]) -> Floats:
    """Numbers of that shape, or of the shape for each of the particles."""
    numbers = real_array(name, found)
    if numbers.shape != shape and not (len(shape) == 3 and numbers.shape == shape[1:]):
        raise ValueError(f"{name}: an array of the shape {numbers.shape} came: give {shape}")
    return np.broadcast_to(numbers, shape)


def functions_of(forces: Optional[GivenForces], settings: Settings, particles: int) -> Optional[Functions]:
    """(force, tangent, energy, between, begin_step, step_limit) as the extension wants them: functions of t, x, v, rows and pairs to lists of arrays; None where there are no
    forces."""
    global _said
    if forces is None:
        return None
    own = forces if isinstance(forces, Forces) else Forces(forces)
    for k in np.flatnonzero((own.between >= particles).any(axis=1)):
        raise InputError(f"between, row {k}: {own.between[k].tolist()}: there are {particles} particles")
    if own.energy is None and not _said and dict(settings).get("-ts_type") not in _EXPLICIT:
        _said = True
        pass_on(["forces without an energy: the line search of Newton's method goes by residuals. Where they have one, give Forces(f, tangent=..., energy=...)"])
    force = _with_rows(own.force, 3)
    tangent, energy = own.tangent and _with_rows(own.tangent, 3, 2), own.energy and _with_rows(own.energy, 2)

    def forces_of(t: float, x: Floats, v: Floats, rows: Whole, _: Whole) -> List[Floats]:
        return [_shaped("forces", force(t, x, v, rows), x.shape)]

    def tangents_of(t: float, x: Floats, v: Floats, rows: Whole, pairs: Whole) -> List[Floats]:
        assert tangent
        found = tangent(t, x, v, rows, pairs)
        given = list(found) if isinstance(found, tuple) else [found]
        d, wanted = x.shape[1], 3 if len(own.between) else 1
        if not wanted <= len(given) <= wanted + 1:
            raise ValueError(f"tangent: {len(given)} arrays came: give {'K, D and K_between, or D_between, too' if wanted > 1 else 'K, or K and D'}")
        given += [np.zeros((d, d))] * (4 - len(given))
        return [_shaped("tangent", one, (len(of), d, d)) for one, of in zip(given, (x, x, pairs, pairs))]

    def energies_of(t: float, x: Floats, _: None, rows: Whole, __: Whole) -> List[Floats]:
        assert energy
        return [_shaped("energy", energy(t, x, rows), x.shape[:1])]

    limit = own.step_limit and _with_rows(own.step_limit, 3)

    def limit_of(t: float, x: Floats, dx: Floats, rows: Whole, _: Whole) -> List[Floats]:
        assert limit
        largest = np.asarray(limit(t, x, dx, rows), dtype=float)
        if largest.shape != () or not largest > 0:
            raise ValueError(f"step_limit: {largest} came: give one number > 0, inf where nothing limits")
        return [largest.reshape(1)]

    return (forces_of, tangents_of if tangent else None, energies_of if energy else None, own.between.tolist(),
            own.begin_step and _with_rows(own.begin_step, 6), limit_of if limit else None)
