"""Forces that are computed in Python."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, Callable, List, Optional, Tuple

import numpy as np

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
    iterate, which converges for soft forces. energy: e(t, x) -> (n,) [J], where each particle's force is minus the gradient of its energy by its place and
    none depends on v: counted among the energies, and Newton's line search goes by them; without it, it goes by residuals.
    t: the time [s], in equilibria the load factor; x, v: (n, d) of all particles, in the order of the lattice; what of them is held is where it is held. On
    several ranks they are a rank's own, whose rows functions that take one argument more, `rows`, are told.
    """

    def __init__(self, force: Callable[..., Any], *, tangent: Optional[Callable[..., Any]] = None, energy: Optional[Callable[..., Any]] = None) -> None:
        self.force, self.tangent, self.energy = force, tangent, energy
        for name, one, what in (("forces", force, "t, x and v"), ("tangent", tangent, "t, x and v"), ("energy", energy, "t and x")):
            if not callable(one) and (one is not None or name == "forces"):
                raise InputError(f"{name}: {one!r} is no function of {what}")

    def __repr__(self) -> str:
        given = [name for name in ("tangent", "energy") if getattr(self, name) is not None]
        return f"<backspring.Forces by {getattr(self.force, '__name__', self.force)!s}{' with ' + ' and '.join(given) if given else ''}>"


def _with_rows(function: Callable[..., Any], count: int) -> Callable[..., Any]:
    """`function` of `count` arguments as one that is told the rows, too, whether it asks for them or not."""
    try:
        taken = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        taken = []
    needed = [one for one in taken if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD) and (one.default is one.empty or one.name == "rows")]
    if len(needed) > count:
        return function
    return lambda *arguments: function(*arguments[:-1])


def held_at(forces: GivenForces, t: float) -> Forces:
    """Forces as they are at the time t, whatever the time is."""
    own = forces if isinstance(forces, Forces) else Forces(forces)
    force: Any = _with_rows(own.force, 3)
    tangent: Any = own.tangent and _with_rows(own.tangent, 3)
    energy: Any = own.energy and _with_rows(own.energy, 2)
    return Forces(lambda _, x, v, rows: force(t, x, v, rows), tangent=tangent and (lambda _, x, v, rows: tangent(t, x, v, rows)),
                  energy=energy and (lambda _, x, rows: energy(t, x, rows)))


def _shaped(name: str, found: Any, shape: Tuple[int, ...]) -> Floats:
    """Numbers of that shape, or of the shape for each of the particles."""
    numbers = real_array(name, found)
    if numbers.shape != shape and not (len(shape) == 3 and numbers.shape == shape[1:]):
        raise ValueError(f"{name}: an array of the shape {numbers.shape} came: give {shape}")
    return np.broadcast_to(numbers, shape)


def functions_of(forces: Optional[GivenForces], settings: Settings) -> Optional[Functions]:
    """(force, tangent, energy) as the extension calls them: each of t, x, v and rows, to lists of arrays; None where there are no forces."""
    global _said
    if forces is None:
        return None
    own = forces if isinstance(forces, Forces) else Forces(forces)
    if own.energy is None and not _said and dict(settings).get("-ts_type") not in _EXPLICIT:
        _said = True
        pass_on(["forces without an energy: the line search of Newton's method goes by residuals. Where they have one, give Forces(f, tangent=..., energy=...)"])
    force = _with_rows(own.force, 3)
    tangent, energy = own.tangent and _with_rows(own.tangent, 3), own.energy and _with_rows(own.energy, 2)

    def forces_of(t: float, x: Floats, v: Floats, rows: Whole) -> List[Floats]:
        return [_shaped("forces", force(t, x, v, rows), x.shape)]

    def tangents_of(t: float, x: Floats, v: Floats, rows: Whole) -> List[Floats]:
        assert tangent
        found = tangent(t, x, v, rows)
        K, D = found if isinstance(found, tuple) else (found, np.zeros((x.shape[1], x.shape[1])))
        shape = (*x.shape, x.shape[1])
        return [_shaped("tangent", K, shape), _shaped("tangent", D, shape)]

    def energies_of(t: float, x: Floats, _: None, rows: Whole) -> List[Floats]:
        assert energy
        return [_shaped("energy", energy(t, x, rows), x.shape[:1])]

    return forces_of, tangents_of if tangent else None, energies_of if energy else None
