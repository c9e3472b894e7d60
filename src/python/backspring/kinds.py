"""Types in signatures: what arguments may be, and what comes back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from mpi4py import MPI

    from .forces import Forces

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]
Mask = NDArray[np.bool_]
Comm = Optional["MPI.Comm"]
"""A communicator of mpi4py; None: the world."""
Option = Any
"""A number, a text, a path, a flag (True, False), a list of them; None leaves the option out."""
Settings = List[Tuple[str, str]]
"""Options of the program by their names with the dash, values as text."""
GivenForces = Union[Callable[..., ArrayLike], "Forces"]
"""f(t, x, v) or f(t, x, v, rows), forces (N, d) or (rows, d) [N], or Forces with a tangent and an energy."""
Loads = Mapping[str, Any]
"""{group: (d,) [N]}."""
Shared = Union[bool, str, Sequence[str], None]
Observables = Dict[str, Any]
"""{name: number or array}, as in a trajectory."""
