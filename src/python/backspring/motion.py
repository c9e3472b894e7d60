"""Motions: steps in time."""

import numpy as np

from . import errors
from ._library import end_session, new_session, world
from .analyses import Equilibrium
from .errors import InputError
from .lattice import Lattice
from .options import joined, loads_of, settings_of, whole


class Frame:
    """A moment of a motion. t [s]; x, v: (N, d) positions [m] and velocities [m/s] of all particles in the lattice's order. What a loop over run() has
    changed in x or v when it goes on becomes the state, from which the method starts anew."""

    def __init__(self, simulation):
        self._simulation = simulation
        self.t, self.x, self.v = simulation.t, simulation.x, simulation.v

    @property
    def forces(self):
        """(N, d) [N], of this moment as long as the motion has not gone on."""
        return self._simulation.forces

    @property
    def observables(self):
        """{name: numbers} as in a trajectory, of this moment as long as the motion has not gone on."""
        return self._simulation.observables

    @property
    def energy(self):
        """Kinetic and potential energy [J], of this moment as long as the motion has not gone on."""
        return self.observables["total_energy"]

    def __repr__(self):
        return f"<backspring.Frame at t = {self.t:g} s, {len(self.x)} particles>"


class Simulation:
    """A lattice that is stepped in time. dt: the step [s]. forces: f(t, x, v) -> (N, d) [N] beside those of the options, not in the tangent of implicit
    methods (soft forces); on several ranks f(t, x, v, rows) for some rows of each rank at a time. Other options of the program by their names: ts_type="cn", ts_theta_theta=0.5. Calls are
    collective on `comm`. A context manager: files that options name are complete after close()."""

    def __init__(self, net, *, dt=None, loads=None, total=False, forces=None, comm=None, **options):
        if isinstance(net, Equilibrium):
            net = net.lattice.replace(x=net.x, rest_length=net.lattice.rest_length if net.lattice.rest_length is not None else net.lattice.lengths())
        if not isinstance(net, Lattice):
            raise InputError(f"give a backspring.Lattice or an Equilibrium, not {type(net).__name__}")
        self.lattice = net
        settings = joined([], loads_of(loads, total) + settings_of({"ts_dt": dt}) + settings_of(options))
        self._session, self._number = new_session(comm, net._arrays(), settings, forces)
        self._comm, self._warned = world(comm), 0
        self._done(self._session.prepare())

    def _done(self, error):
        warned = self._session.warnings
        errors.pass_on(warned[self._warned:])
        self._warned = len(warned)
        errors.check(error, lambda: Frame(self))

    def step(self, count=1):
        """`count` steps."""
        self._done(self._session.step(self._count(count)))

    @staticmethod
    def _count(count):
        count = whole("count", count)
        if count < 0:
            raise InputError(f"count: {count} is negative")
        return count

    def run_until(self, t):
        """Steps up to the time t [s], where the last one ends."""
        if not np.isfinite(t):
            raise InputError(f"t: {t} is no time")
        self._done(self._session.run_until(float(t)))

    def next_frame(self):
        """Steps up to the next output time (bs_output_interval; without it, the next step) or the end (ts_max_time). False where the end was reached before."""
        error, more = self._session.run_to_frame()
        self._done(error)
        return more

    def on_step(self, observer):
        """observer(step, t, dt, newton, krylov, rejected) is called on every rank after every step; an exception in it ends the call. None: no more."""
        self._session.observe(observer)

    @property
    def t(self):
        """Time of the last good state [s]."""
        return self._session.time

    @property
    def steps(self):
        """Steps that were taken."""
        return self._session.steps

    @property
    def rows(self):
        """The rows of this rank, for get() and set()."""
        first, count = self._session.rows
        return slice(first, first + count)

    def get(self, what, whole=True):
        """position, velocity, force or reaction: (N, d) of all particles, or of this rank's rows."""
        if what not in ("position", "velocity", "force", "reaction"):
            raise InputError(f"{what!r}: give position, velocity, force or reaction")
        error, numbers = self._session.get(what, whole)
        self._done(error)
        return numbers

    def set(self, what, numbers, whole=True):
        """position or velocity: (N, d) of all particles, or of this rank's rows, from which the method starts anew."""
        if what not in ("position", "velocity"):
            raise InputError(f"{what!r}: give position or velocity")
        numbers = np.asarray(numbers, dtype=float)
        expected = (len(self.lattice), self.lattice.dim) if whole else (self.rows.stop - self.rows.start, self.lattice.dim)
        if numbers.shape != expected:
            raise InputError(f"{what} has the shape {numbers.shape}: give {expected}")
        self._done(self._session.set_rows(what, numbers[self.rows] if whole else numbers))

    def drive(self, group, places, t):
        """The group, whose motion is an option's (bs_motion_NAME="given"), moves uniformly from where it is to `places`, (members, d), at the time t [s],
        and stays there until the next call."""
        members = np.flatnonzero(self._member(group))
        places = np.asarray(places, dtype=float)
        if places.shape != (len(members), self.lattice.dim):
            raise InputError(f"places of {group} have the shape {places.shape}: give {(len(members), self.lattice.dim)}")
        every = np.array(self.lattice.x, dtype=float)
        every[members] = places
        self._done(self._session.drive(group, float(t), every[self.rows]))

    def _member(self, group):
        if group not in self.lattice.groups:
            raise InputError(f"there is no group {group!r}: name one of {', '.join(self.lattice.groups) or 'those that the lattice is given'}")
        return self.lattice.groups[group]

    def save(self):
        """All that the motion is now, for restore(): the state, histories of springs and what is broken, works, the time."""
        error, state = self._session.save()
        self._done(error)
        return state

    def restore(self, state):
        """Goes on from what save() of this simulation has returned, as often as it is wanted; a method of several steps starts anew."""
        self._done(self._session.restore(state))

    def agreed(self, some):
        """Whether it is so on some rank."""
        return bool(self._comm.allreduce(int(some)))

    x = property(lambda self: self.get("position"), lambda self, value: self.set("position", value), doc="(N, d) positions [m].")
    v = property(lambda self: self.get("velocity"), lambda self, value: self.set("velocity", value), doc="(N, d) velocities [m/s].")
    forces = property(lambda self: self.get("force"), doc="(N, d) forces [N].")
    reactions = property(lambda self: self.get("reaction"), doc="(N, d) forces that supports and motions exert on what is held, 0 elsewhere [N].")

    def frame(self):
        """{time, observables, fields} of this moment, as a trajectory has them."""
        error, found = self._session.frame()
        self._done(error)
        return found

    observables = property(lambda self: self.frame()["observables"], doc="{name: numbers} of this moment, as in a trajectory.")

    def close(self):
        """Ends stepping; files that options name are complete."""
        if self._number is None:
            return
        error = self._session.finish()
        self._end()
        errors.check(error)

    def _end(self):
        if self._number is not None:
            end_session(self._session, self._number)
            self._number = None

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        if kind is None:
            self.close()
        else:
            self._end()


def run(net, *, until, dt=None, every=None, loads=None, total=False, forces=None, comm=None, **options):
    """Frames of a motion from t = 0 to `until` [s], the first of them the start, then one every `every` [s] (None: after every step); steps end at them.

    for frame in bs.run(net, ts_type="cn", dt=1e-3, until=2.0, every=0.1):
        frame.v *= 0.99

    Options of the program by their names. Raises InputError, and ConvergenceError whose state is the last good frame.
    """
    simulation = Simulation(net, dt=dt, loads=loads, total=total, forces=forces, comm=comm, **{"ts_max_time": until, "bs_output_interval": every, **options})
    return _frames(simulation)


def _frames(simulation):
    with simulation:
        while True:
            frame = Frame(simulation)
            x, v = frame.x.copy(), frame.v.copy()
            yield frame
            for what, before, after in (("position", x, frame.x), ("velocity", v, frame.v)):
                if simulation.agreed(not np.array_equal(before, after)):
                    simulation.set(what, after)
            if not simulation.next_frame():
                return
