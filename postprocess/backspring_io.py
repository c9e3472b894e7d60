"""Reads a trajectory of backspring (HDF5, H5MD 1.1). This, run_springs.py and run_tables.py are the only
places that know the layout of the file; what is read is in the types of run_data.py.

    from backspring_io import open_run
    with open_run("run.h5md") as run:
        x = run.positions[-1]                   # (N, d) of the last frame; run.positions is (T, N, d), read when indexed
        run.observables.plot()                  # a DataFrame: one row a frame, its index the time
        strain = run.strains(-1)                # (M,)

Numbers are those of the file. Runs in progress or killed can be read: a frame counts once all its parts are there;
refresh() takes in what was written since.
"""
import time

import numpy as np

from lazy import Frames
from open_hdf5 import RunError, first_line, h5py, open_hdf5
from run_data import PARTICLES, Series, counted, text
from run_springs import JoinedRun
from run_tables import TabledRun


class Run(JoinedRun, TabledRun):
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
        """Of the space: a padded trajectory has more columns of positions, velocities and edges, not of its momentum and all else."""
        columns, box, momentum = position.shape[2], self._file.get(f"{PARTICLES}/box"), self._get("/observables/momentum/value")
        if momentum is not None and momentum.ndim:
            columns = min(columns, momentum.shape[1] if momentum.ndim > 1 else 1)
        try:
            return max(1, min(columns, int(box.attrs["dimension"])))
        except (AttributeError, KeyError, TypeError, ValueError):
            return max(1, columns)

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
    def _constant(self, name, dtype, width=1):
        """(N,) constant of the particles, with a `width` above 1 (N, width); or None."""
        if name not in self._cache:
            data = self._array(f"{PARTICLES}/{name}")
            if data is not None and data.size != self.particles * width:
                raise self._error(f"{PARTICLES}/{name} has {counted(data.size, 'row')} for {counted(self.particles, 'particle')}")
            self._cache[name] = None if data is None else np.asarray(data, dtype=dtype).reshape((-1, width) if width > 1 else -1)
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
        """(N,) of /particles/trajectory/NAME, or (N, d) of its applied_force, which a lattice calls force; or None."""
        if name != "force":
            return self._constant(name, float)
        found = self._constant("applied_force", float, self.dim)
        return found if found is None else found.reshape(self.particles, self.dim)

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


def open_run(path):
    """Opens a trajectory for reading; a context manager. Raises RunError."""
    return Run(path)


def _why_no_trajectory(file):
    if "/particles/position" in file:
        return "a lattice, not a trajectory: run backspring with -bs_lattice_file and -bs_output first"
    return "HDF5, but no trajectory: neither /particles/trajectory/position nor /states is there"
