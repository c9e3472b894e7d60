"""What a trajectory is made of, apart from the file: springs, angle springs, tables over time, units, and words for numbers."""
from dataclasses import dataclass, field

import numpy as np

PARTICLES = "/particles/trajectory"
BONDS = "/connectivity/bonds"
LIMITS = ("critical_strain", "critical_force", "critical_energy")
TURNS = {"angles": "angle spring", "hinges": "hinge"}  # what has an angle: its name in files and the word for one
TURN_LIMITS = ("critical_change", "critical_moment", "critical_energy")
LAW_DATA = ("stiffness_2", "stiffness_3", "yield_force", "hardening", "relaxation_time", "area", *LIMITS)
HISTORIES = ("plastic_stretch", "plastic_path", "viscous_stretch", "viscous_loss")
SI = {"time": "s", "position": "m", "velocity": "m/s", "kinetic_energy": "J", "potential_energy": "J",
      "total_energy": "J", "momentum": "kg m/s", "angular_momentum": "kg m²/s", "mass": "kg",
      "reaction": "N", "force": "N", "moment": "N m", "work": "J", "stress_volume": "J"}
TENSOR = {1: ["xx"], 2: ["xx", "yy", "xy"], 3: ["xx", "yy", "zz", "yz", "xz", "xy"]}  # components of a stress in d dimensions


@dataclass
class Springs:
    """Springs between particles: ends are rows of position, 0-based."""
    pairs: np.ndarray                  # (M, 2) int64
    stiffness: np.ndarray = None       # (M,) or None: not in the file
    rest_length: np.ndarray = None     # (M,)
    damping: np.ndarray = None         # (M,)
    shift: np.ndarray = None           # (M, d) boxes the second end is in; None: no periodic box
    law_data: dict = field(default_factory=dict)  # what laws take besides, {name: (M,)}: stiffness_2, yield_force, ...; critical_strain, ...
    limits: dict = field(default_factory=dict)  # {critical_strain, ...: (M,)}: what each spring bears, times the factor drawn for it
    rest_length_assumed: bool = False  # True: the file has none, lengths of the first frame are used

    def __len__(self):
        return len(self.pairs)

    @property
    def idle(self):
        """(M,) springs that carry nothing: without stiffness of any order and without damping."""
        parts = [v for v in (self.stiffness, self.damping, *(self.law_data.get(k) for k in ("stiffness_2", "stiffness_3"))) if v is not None]
        return np.all([v == 0 for v in parts], axis=0) if self.stiffness is not None and len(self.pairs) else np.zeros(len(self.pairs), bool)

    @property
    def strained(self):
        """(M,) whether a spring has a strain."""
        return (self.rest_length > 0) & ~self.idle

    @property
    def inside(self):
        """(M,) whether a spring stays within the periodic box, so that a line between its ends shows it."""
        return np.ones(len(self.pairs), bool) if self.shift is None else ~self.shift.any(axis=1)

    @property
    def lines(self):
        """pairs with a point in the place of every line across a periodic box."""
        return np.where(self.inside[:, None], self.pairs, self.pairs[:, :1])


@dataclass
class Series:
    """A table over time: value (T, n) in the file, read when indexed."""
    value: object = None
    times: np.ndarray = None
    labels: list = field(default_factory=list)
    units: list = field(default_factory=list)  # '' where nothing says one


@dataclass
class Angles:
    """Angle springs: rows of three particles, the middle one second."""
    triples: np.ndarray     # (A, 3) int64
    stiffness: np.ndarray   # (A,)
    rest_angle: np.ndarray  # (A,) [rad]
    shift: np.ndarray       # (A, 3, d) the periodic box each end is in, or None
    limits: dict = field(default_factory=dict)  # {critical_change, ...: (A,)}: what each bears, times the factor drawn for it
    rows: np.ndarray = None  # (A,) where they stand in the file, for messages

    def __len__(self):
        return len(self.triples)

    def taken(self, which):
        """Those of them alone."""
        return Angles(self.triples[which], self.stiffness[which], self.rest_angle[which], None if self.shift is None else self.shift[which],
                      {name: values[which] for name, values in self.limits.items()}, self.rows[which])


def counted(number, thing):
    """"1 particle", "2 particles"."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def text(value):
    """An HDF5 string of any kind as str."""
    if isinstance(value, np.ndarray):
        return ",".join(text(v) for v in value.ravel())
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
