"""Springs that broke."""

from __future__ import annotations

import dataclasses
from typing import Any, Dict, Mapping

import numpy as np

from .kinds import Floats, Mask, Whole


@dataclasses.dataclass(frozen=True, repr=False, eq=False)
class Events:
    """The springs that broke so far, B of them, in the order in which they did; rows are those of the lattice.

    time: (B,) of the step at whose end each was past its limit [s], in equilibria the place of the load step; load: (B,) the load factor then (1 in
    motions). spring: (B,) rows of the springs; ends: (B, 2) rows of their particles. strain: (B,) [1], NaN where the rest length is 0, and energy:
    (B,) [J] of each before it broke. avalanche: (B,) which of them belong together, from 0. Its len() is B.
    """

    time: Floats
    load: Floats
    spring: Whole
    ends: Whole
    strain: Floats
    energy: Floats
    avalanche: Whole

    def __len__(self) -> int:
        """How many springs broke, B."""
        return len(self.spring)

    def __repr__(self) -> str:
        count = len(set(self.avalanche.tolist()))
        return f"<backspring.Events: {len(self)} spring{'s' * (len(self) != 1)} broke in {count} avalanche{'s' * (count != 1)}>"


def events_of(found: Mapping[str, Any]) -> Events:
    """Of the columns that the extension gives, none of them where nothing broke."""
    kinds: Dict[str, Any] = {"time": float, "load": float, "spring": np.int64, "ends": np.int64, "strain": float, "energy": float, "avalanche": np.int64}
    columns = {name: np.asarray(found.get(name, ()), kind) for name, kind in kinds.items()}
    return Events(**{**columns, "ends": columns["ends"].reshape(-1, 2)})


def broken_of(fields: Mapping[str, Floats], springs: int) -> Mask:
    """(S,) of a frame's fields; none is where springs cannot break."""
    return np.asarray(fields["broken"], float) > 0 if "broken" in fields else np.zeros(springs, bool)
