"""Reads a trajectory of backspring (HDF5, H5MD 1.1). The only place that knows the layout of the file.

    from backspring_io import open_run
    with open_run("run.h5md") as run:
        x = run.positions[-1]                   # (N, d) of the last frame; run.positions is (T, N, d), read when indexed
        run.observables.plot()                  # a DataFrame: one row a frame, its index the time
        strain = run.strains(-1)                # (M,)

Numbers are those of the file. Runs in progress or killed can be read: a frame counts once all its parts are there;
refresh() takes in what was written since.
"""
import time
from dataclasses import dataclass, field

import numpy as np

from lazy import Frames
from open_hdf5 import RunError, first_line, h5py, open_hdf5

PARTICLES = "/particles/trajectory"
BONDS = "/connectivity/bonds"
LIMITS = ("critical_strain", "critical_force", "critical_energy")
LAW_DATA = ("stiffness_2", "stiffness_3", "yield_force", "hardening", "relaxation_time", *LIMITS)
HISTORIES = ("plastic_stretch", "plastic_path", "viscous_stretch", "viscous_loss")
SI = {"time": "s", "position": "m", "velocity": "m/s", "kinetic_energy": "J", "potential_energy": "J",
      "total_energy": "J", "momentum": "kg m/s", "angular_momentum": "kg m²/s", "mass": "kg",
      "reaction": "N", "work": "J", "stress_volume": "J"}
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


def counted(number, thing):
    """"1 particle", "2 particles"."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def text(value):
    """An HDF5 string of any kind as str."""
    if isinstance(value, np.ndarray):
        return ",".join(text(v) for v in value.ravel())
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


@dataclass
class Angles:
    """Angle springs: rows of three particles, the middle one second."""
    triples: np.ndarray     # (A, 3) int64
    stiffness: np.ndarray   # (A,)
    rest_angle: np.ndarray  # (A,) [rad]
    shift: np.ndarray       # (A, 3, d) the periodic box each end is in, or None

    def __len__(self):
        return len(self.triples)


class Run:
    """An open trajectory; use open_run."""
    strain_name = "strain $(l-L)/L$"  # what strains() are, for labels
    length_unit = None                # what the unit of positions is called, whatever the file says

    def __init__(self, path):
        self.path = str(path)
        self._begin()

    def _begin(self):
        self._file = open_hdf5(self.path)
        self._cache = {}
        try:
            self._read_frames()
        except RunError:
            self.close()
            raise
        except (OSError, KeyError, ValueError, AttributeError, RuntimeError, TypeError, OverflowError) as error:
            self.close()
            raise self._error(f"cannot be read as a trajectory ({first_line(error)})") from error

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._file.close()

    def refresh(self):
        """Takes in what a run in progress has written since the file was opened; returns the number of frames."""
        self.close()
        self._begin()
        return self.frames

    def _error(self, message):
        return RunError(f"{self.path}: {message}")

    def _get(self, path):
        found = self._file.get(path)
        return found if isinstance(found, h5py.Dataset) else None

    def _array(self, path):
        return None if self._get(path) is None else self._read(path, ...)

    def _read(self, path, where):
        """What the dataset holds there. A run that writes may move things between two looks of HDF5: open again, then."""
        for pause in (0.02, 0.1, 0.3, None):
            try:
                return self._file[path][where]
            except (OSError, KeyError, RuntimeError, TypeError, ValueError) as error:
                if pause is None:
                    raise self._error(f"dataset {path} is damaged ({first_line(error)})") from error
            time.sleep(pause)
            self.close()
            self._file = open_hdf5(self.path)

    @property
    def has_modes(self):
        """Whether modes of free vibration are there (-bs_task modes)."""
        return self._get("/modes/omega_squared") is not None

    @property
    def angles(self):
        """Angle springs, or None."""
        triples = self._array("/connectivity/angles")
        return None if triples is None else Angles(triples, *(self._array("/connectivity/angles_" + k) for k in ("stiffness", "rest_angle")), self._shift("angles", 3))

    def _shift(self, kind, ends):
        """The periodic box that each end is in, (A, ends, d), or None."""
        shift = self._array(f"/connectivity/{kind}_shift")
        return None if shift is None else shift.reshape(len(shift), ends, -1)

    @property
    def hinges(self):
        """Hinges between triangles, {"quads" (H, 4), "stiffness", "rest_angle" (H)}: the edge's ends, then the wings; "shift" (H, 4 d) in periodic boxes; or
        None."""
        found = {k: self._array("/connectivity/hinges" + name) for k, name in (("quads", ""), ("stiffness", "_stiffness"), ("rest_angle", "_rest_angle"), ("shift", "_shift"))}
        return None if found["quads"] is None else {k: v for k, v in found.items() if v is not None}

    @property
    def anchors(self):
        """Springs to given points, {"particle" (A), "point" (A, d), "stiffness", "rest_length", "damping" (A)}, or None."""
        path = "/backspring/anchors/"
        return None if self._get(path + "particle") is None else {k: self._array(path + k) for k in ("particle", "point", "stiffness", "rest_length", "damping")}

    # ---- frames -------------------------------------------------------------------------------------------------
    def _read_frames(self):
        position = self._get(f"{PARTICLES}/position/value")
        states = self._get("/states/value")
        if position is None and states is None:
            raise self._error(_why_no_trajectory(self._file))
        self.kind = "particles" if position is not None else "linear"
        group = f"{PARTICLES}/position" if self.kind == "particles" else "/states"
        velocity = self._get(f"{PARTICLES}/velocity/value")
        value = position if position is not None else states
        if value.ndim != (3 if self.kind == "particles" else 2):
            raise self._error(f"{value.name} has shape {value.shape}, expected "
                              + ("(frames, particles, d)" if self.kind == "particles" else "(frames, n)"))
        times, steps = self._array(f"{group}/time"), self._array(f"{group}/step")
        lengths = [len(value)] + [len(a) for a in (times, steps) if a is not None and a.ndim]
        if velocity is not None:
            if velocity.shape[1:] != position.shape[1:]:
                raise self._error(f"{velocity.name} has shape {velocity.shape}, positions {position.shape}")
            lengths.append(len(velocity))
        self.frames = min(lengths)                              # T
        if self.frames == 0:
            raise self._error("holds no frame yet")
        count = self.frames
        self.times = np.arange(float(count)) if times is None else np.asarray(times[:count], dtype=float)
        self.step = np.arange(count) if steps is None or not steps.ndim else np.asarray(steps[:count])
        self.particles = position.shape[1] if position is not None else 0   # N
        self.dim = self._dimension(position)
        self.positions = None if position is None else self._frames_of(position)    # (T, N, d), read when indexed
        self.velocities = None if velocity is None else self._frames_of(velocity)
        self.states = Series()
        if states is not None:
            lazy = Frames(lambda where: self._read("/states/value", where), (count, states.shape[1]))
            labels = self._labels("/states", states.shape[1], "x")
            self.states = Series(lazy, self.times, labels, self._units_of("/states", labels))

    def _frames_of(self, data):
        path = data.name
        return Frames(lambda where: self._read(path, where), (self.frames, self.particles, self.dim))

    def _dimension(self, position):
        if position is None:
            return 0
        columns, box = position.shape[2], self._file.get(f"{PARTICLES}/box")
        try:  # a padded trajectory has more columns than the space has dimensions
            return max(1, min(columns, int(box.attrs["dimension"])))
        except (AttributeError, KeyError, TypeError, ValueError):
            return columns

    def position(self, frame):
        """Positions (N, d) of one frame [m]; negative frames count from the end."""
        return self._frame(self.positions, frame, "positions")

    def velocity(self, frame):
        """Velocities (N, d) of one frame [m/s]."""
        return self._frame(self.velocities, frame, "velocities")

    def position_path(self, particle):
        """Positions (T, d) of the particle in row `particle`."""
        return self._column(self.positions, particle, "positions")

    def velocity_path(self, particle):
        """Velocities (T, d) of the particle in row `particle`."""
        return self._column(self.velocities, particle, "velocities")

    def _frame(self, data, frame, what):
        if data is None:
            raise self._error(f"holds no {what}")
        return data[self.index(frame)]

    def _column(self, data, particle, what):
        if data is None:
            raise self._error(f"holds no {what}")
        if not 0 <= particle < self.particles:
            raise self._error(f"no particle row {particle}; there are {self.particles}, counted from 0")
        return data[:, particle]

    def index(self, frame):
        """The frame as a row 0 .. T-1."""
        if not -self.frames <= frame < self.frames:
            raise self._error(f"no frame {frame}; there are {self.frames}, counted from 0")
        return frame % self.frames

    def pick(self, frames=None, stride=1, every=None):
        """Rows chosen by "a:b" (b excluded, either may be left out), every `stride`-th, or `every` seconds of
        simulated time."""
        try:
            parts = [int(p) if p.strip() else None for p in (frames or ":").split(":")]
            rows = list(range(self.frames))[slice(*parts)] if len(parts) > 1 else [self.index(parts[0])]
        except ValueError:
            raise RunError(f"frames '{frames}': write a:b, for example 0:100 or -50:") from None
        if stride < 1 or (every is not None and not every > 0):
            raise RunError("the stride and the interval must be positive")
        if every is not None and rows:
            t = self.times[rows]
            marks = np.arange(t[0], t[-1] + 0.5 * every, every)
            rows = sorted({rows[int(np.abs(t - mark).argmin())] for mark in marks})
        rows = rows[::stride]
        if not rows:
            raise self._error(f"frames '{frames}' select none of {self.frames}")
        return rows

    # ---- constants ----------------------------------------------------------------------------------------------
    def _constant(self, name, dtype):
        """(N,) constant of the particles, or None."""
        if name not in self._cache:
            data = self._array(f"{PARTICLES}/{name}")
            if data is not None and data.size != self.particles:
                raise self._error(f"{PARTICLES}/{name} has {data.size} rows for {self.particles} particles")
            self._cache[name] = None if data is None else np.asarray(data, dtype=dtype).reshape(-1)
        return self._cache[name]

    @property
    def mass(self):
        return self._constant("mass", float)

    @property
    def radius(self):
        return self._constant("radius", float)

    @property
    def id(self):
        """The user's numbers; row indices where the file has none."""
        ids = self._constant("id", np.int64)
        return np.arange(self.particles) if ids is None else ids

    @property
    def fixed(self):
        """(N,) bool; False throughout where the file has none."""
        fixed = self._constant("fixed", bool)
        return np.zeros(self.particles, dtype=bool) if fixed is None else fixed

    @property
    def springs(self):
        """Springs between particles; length 0 where the file has none."""
        if "springs" not in self._cache:
            self._cache["springs"] = self._read_springs()
        return self._cache["springs"]

    def _read_springs(self):
        pairs = self._array(BONDS)
        if pairs is None or pairs.size == 0:
            return Springs(np.zeros((0, 2), dtype=np.int64), *(np.zeros(0),) * 3)
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise self._error(f"{BONDS} has shape {pairs.shape}, expected (springs, 2)")
        pairs = pairs.astype(np.int64)
        if pairs.min() < 0 or pairs.max() >= self.particles:
            row = int(np.argmax(((pairs < 0) | (pairs >= self.particles)).any(axis=1)))
            raise self._error(f"{BONDS} row {row} joins {pairs[row, 0]} and {pairs[row, 1]}; rows go from 0 to "
                              f"{self.particles - 1}")
        columns = {name: self._column_of_springs(name, len(pairs)) for name in ("stiffness", "rest_length", "damping")}
        shift = self._array(f"{BONDS}_shift")
        law_data = {name: self._column_of_springs(name, len(pairs)) for name in LAW_DATA if self._get(f"{BONDS}_{name}") is not None}
        drawn = {name: self._column_of_springs(name.replace("critical", "threshold"), len(pairs)) for name in LIMITS}
        limits = {name: law_data.get(name) if drawn[name] is None else drawn[name] for name in LIMITS}
        springs = Springs(pairs, **columns, shift=None if shift is None else shift.astype(np.int64), law_data=law_data,
                          limits={name: values for name, values in limits.items() if values is not None})
        self._cache["springs"] = springs  # lengths() looks at it
        if springs.rest_length is None:
            springs.rest_length, springs.rest_length_assumed = self.lengths(0), True
        return springs

    def _column_of_springs(self, name, count):
        data = self._array(f"{BONDS}_{name}")
        if data is not None and data.size != count:
            raise self._error(f"{BONDS}_{name} has {data.size} rows for {count} springs")
        return None if data is None else data.astype(float).reshape(-1)

    @property
    def periodic(self):
        """[bool] * d: along which edges of its box the lattice is repeated."""
        box = self._file.get(f"{PARTICLES}/box")
        words = [text(w) for w in np.atleast_1d(box.attrs.get("boundary", []))] if box is not None else []
        return ([w == "periodic" for w in words] + [False] * self.dim)[:self.dim]

    def box_edges(self, frame):
        """Edge vectors (d, d) of the box of a frame as rows [m]."""
        edges = np.asarray(self._read(f"{PARTICLES}/box/edges/value", frame), float)
        return (np.diag(edges) if edges.ndim == 1 else edges)[:self.dim, :self.dim]

    def lengths(self, frame):
        """Lengths (M,) of the springs [m], to the image of the second end that they join."""
        x, springs = self.position(frame), self.springs
        apart = x[springs.pairs[:, 1]] - x[springs.pairs[:, 0]]
        if springs.shift is not None:
            apart = apart + springs.shift @ self.box_edges(frame)
        return np.sqrt((apart ** 2).sum(axis=1))

    def broken(self, frame):
        """Which springs (M,) are broken; None in a run whose springs cannot break."""
        path = "/backspring/broken/value"
        return None if self._get(path) is None else np.asarray(self._read(path, frame)) != 0

    def acting(self, frame):
        """Which springs (M,) are there: neither broken nor without any stiffness and damping."""
        broken = self.broken(frame)
        return ~self.springs.idle if broken is None else ~(self.springs.idle | broken)

    def slack(self, frame):
        """Which springs (M,) only pull and are shorter than their rest length, so that they carry nothing."""
        laws = self.spring_laws
        if laws is None or not np.any(laws == "tension"):
            return np.zeros(len(self.springs), bool)
        return (laws == "tension") & (self.lengths(frame) < self.springs.rest_length * (1 - 1e-12)) & self.acting(frame)

    def spring_state(self, name, frame):
        """What springs carry from step to step (M,), plastic_stretch and the like; None where no law has it."""
        path = f"/backspring/{name}/value"
        return None if self._get(path) is None else np.asarray(self._read(path, frame), float)

    def strains(self, frame):
        """Strains (M,) = (l - L)/L; NaN where the rest length L is 0 and where the spring is broken or carries nothing."""
        rest = self.springs.rest_length
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where((rest > 0) & self.acting(frame), (self.lengths(frame) - rest) / rest, np.nan)

    @property
    def parameters(self):
        """Options in force and versions: {name without the leading dash: text}."""
        if "parameters" not in self._cache:
            found = {}
            for path in ("/parameters", "/parameters/options"):
                group = self._file.get(path)
                found.update({} if group is None else {text(k).lstrip("-"): text(v) for k, v in group.attrs.items()})
            self._cache["parameters"] = found
        return self._cache["parameters"]

    def particle_column(self, name):
        """(N,) of /particles/trajectory/NAME, or None."""
        return self._constant(name, float)

    @property
    def groups(self):
        """Names of the groups."""
        return [name for name in self._file.get("/groups", {}) if self._get(f"/groups/{name}") is not None]

    def group(self, name):
        """Rows of the particles of a group."""
        rows = self._array(f"/groups/{name}")
        if rows is None:
            raise self._error(f"has no group {name}; it has {', '.join(self._file.get('/groups', {})) or 'none'}")
        return rows.reshape(-1).astype(np.int64)

    @property
    def spring_law(self):
        """The name of the law that all springs obey; None where the file does not say, or has a law for each (spring_laws)."""
        return self.parameters.get("bs_spring_law", self.parameters.get("spring_law"))

    @property
    def spring_laws(self):
        """The name of each spring's law (M,); None where the file does not say."""
        places = self._array(f"{BONDS}_law")
        if places is None:
            return None if self.spring_law is None else np.full(len(self.springs), self.spring_law)
        names = text(self._get(f"{BONDS}_law").attrs.get("spring_laws", "")).split(",")
        if places.size != len(self.springs) or places.min(initial=0) < 0 or places.max(initial=0) >= len(names):
            raise self._error(f"{BONDS}_law does not name a law of attribute spring_laws for each of {len(self.springs)} springs")
        return np.array(names)[places.reshape(-1).astype(np.int64)]

    def unit(self, name):
        """The unit of a quantity: what the file says, else SI; '' for what has none."""
        said = self.stated_unit(name)
        if name == "position" and self.length_unit:
            return self.length_unit
        if name == "stress" and said is None:
            return ["N", "N/m", "Pa"][self.dim - 1]
        return SI.get(name.partition("/")[0], "") if said is None else said

    def stated_unit(self, name):
        """The unit that the file says, or None."""
        group = PARTICLES if name in ("position", "velocity") else "/observables"
        owner = self._get(f"{PARTICLES}/position/time" if name == "time" else f"{group}/{name}/value")
        said = owner.attrs.get("unit") if owner is not None else None
        return None if said is None else text(said)

    @property
    def units(self):
        """{name: unit} of time, positions, velocities and every observable."""
        return {name: self.unit(name) for name in ("time", "position", "velocity", *self.series)}

    # ---- tables over time ---------------------------------------------------------------------------------------
    @property
    def series(self):
        """The observables as arrays {name: (T,) or (T, k)}; all have the length of observable_times."""
        return self._observables()[0]

    @property
    def observable_times(self):
        return self._observables()[1]

    def _observables(self):
        if "observables" not in self._cache:
            found, times = {}, self.times
            items = dict(self._file.get("/observables", {}).items())
            for name, item in list(items.items()):  # reaction/NAME and work/NAME lie one level deeper
                if isinstance(item, h5py.Group):
                    items.update({f"{name}/{own}": inner for own, inner in item.items() if isinstance(inner, h5py.Group)})
            for name, item in items.items():
                value = self._array(f"/observables/{name}/value") if isinstance(item, h5py.Group) else None
                if value is not None and value.ndim and len(value):
                    flat = value.reshape(len(value), -1).astype(float)
                    found[name] = flat[:, 0] if flat.shape[1] == 1 else flat
                    own = self._array(f"/observables/{name}/time")
                    times = own if own is not None and own.ndim and len(own) else times
            count = min([len(times)] + [len(v) for v in found.values()])
            if count > self.frames and np.array_equal(times[:self.frames], self.times):
                count = self.frames  # a run that goes on has written more since the frames were counted
            self._cache["observables"] = {k: v[:count] for k, v in found.items()}, np.asarray(times[:count], float)
        return self._cache["observables"]

    def components(self, name, count):
        """Names of the `count` columns of an observable."""
        if name.startswith("stress") and count == len(TENSOR.get(self.dim, ())):
            return TENSOR[self.dim]
        asked = [word.partition("=")[0].strip() for word in self.parameters.get("bs_box_stress", "").split(",")]
        if name == "free_strain" and len(asked) == count:
            return asked
        return list("xyz"[:count]) if count <= 3 else [str(i) for i in range(count)]

    @property
    def static(self):
        """Whether the frames are equilibria under a load factor (-bs_task statics), and no motion."""
        return "load_factor" in self.series

    @property
    def observables(self):
        """The observables as a pandas DataFrame: one row a frame, its index the time, vectors as name_x, name_y, name_z, stresses as name_xx, name_yy, ..."""
        try:
            import pandas
        except ImportError:
            raise RunError("no pandas in this Python; install with: sudo apt-get install python3-pandas") from None
        columns = {}
        for name, value in self.series.items():
            if value.ndim == 1:
                columns[name] = value
            else:
                columns.update({f"{name}_{part}": value[:, i] for i, part in enumerate(self.components(name, value.shape[1]))})
        return pandas.DataFrame(columns, index=pandas.Index(self.observable_times, name="time"))

    @property
    def log(self):
        """One row a step: {"step", "time", "dt", "newton", "krylov", "rejected"}; {} where the file has none."""
        if "log" not in self._cache:
            group = self._file.get("/backspring/log", {})
            found = {k: self._array(f"/backspring/log/{k}") for k in group if self._get(f"/backspring/log/{k}") is not None}
            found = {k: v.reshape(-1) for k, v in found.items()}
            count = min([len(v) for v in found.values()], default=0)
            self._cache["log"] = {k: v[:count] for k, v in found.items()} if count else {}
        return self._cache["log"]

    @property
    def sources(self):
        """Sources of a linear system over time; value is None where the file has none."""
        value = self._get("/sources/value")
        if value is None:
            return Series()
        times = self._array("/sources/time")
        labels = self._labels("/sources", value.shape[1] if value.ndim > 1 else 1, "u")
        return Series(value, self.times if times is None else times, labels, self._units_of("/sources", labels))

    def _labels(self, group, count, letter):
        labels = self._array(f"{group}/labels")
        found = [] if labels is None else [text(v) for v in labels.ravel()]
        return found + [f"{letter}{i}" for i in range(len(found), count)]


    def _units_of(self, group, labels):
        """The unit of each state or source: as the file says (units, a dataset), else, of circuits, by the letter that its label begins with."""
        said = self._array(f"{group}/units")
        if said is not None:
            return ([text(v) for v in said.ravel()] + [""] * len(labels))[:len(labels)]
        circuit = self.parameters.get("bs_linear_type") in ("rc_ladder", "rlc") or "bs_netlist" in self.parameters
        return [{"v": "V", "i": "A", "u": "V"}.get(label[:1].lower(), "") if circuit else "" for label in labels]


def open_run(path):
    """Opens a trajectory for reading; a context manager. Raises RunError."""
    return Run(path)


def _why_no_trajectory(file):
    if "/particles/position" in file:
        return "a lattice, not a trajectory: run backspring with -bs_lattice_file and -bs_output first"
    return "HDF5, but no trajectory: neither /particles/trajectory/position nor /states is there"
