"""Equilibria, modes and moduli."""

import numpy as np

from . import errors
from ._library import end_session, new_session
from .errors import InputError
from .lattice import Lattice
from .options import joined, loads_of, settings_of, whole


class Equilibrium:
    """An equilibrium of a lattice under its loads. All arrays are in the order of the lattice, the same on every rank.

    x: (N, d) positions [m]. tension: (S,) [N], positive where a spring pulls, NaN where it is broken or can exert no force.
    reactions: {group: (d,)} forces of supports on the group [N]. energy: elastic energy [J]. load_factor: 1 under the full loads.
    newton, krylov: iterations of all load steps; steps, rejected: load steps taken and attempts that failed.
    observables: {name: numbers} as in a trajectory. lattice, settings, forces: what was solved.
    """

    def __init__(self, lattice, settings, forces, found):
        self.lattice, self.settings, self.forces = lattice, settings, forces
        self.observables, self.fields = found["observables"], found["fields"]
        self.load_factor, self.newton, self.krylov = found["load_factor"], found["newton"], found["krylov"]
        self.steps, self.rejected = found["steps"], found["rejected"]

    @property
    def x(self):
        return self.fields["position"].reshape(len(self.lattice), self.lattice.dim)

    @property
    def tension(self):
        return self.fields.get("tension", np.zeros(0))

    @property
    def energy(self):
        return self.observables["elastic_energy"]

    @property
    def reactions(self):
        return {name.split("/", 1)[1]: np.atleast_1d(value) for name, value in self.observables.items() if name.startswith("reaction/")}

    def plot(self, file=None, **look):
        """A picture of it, springs coloured by their tension; written to `file` if one is named. Returns the figure of matplotlib."""
        from .picture import draw

        return draw(self, file, **look)

    def __repr__(self):
        return f"<backspring.Equilibrium at the load factor {self.load_factor:g}: elastic energy {self.energy:.6g} J, {self.newton} Newton iterations>"


class Modes:
    """omega2: (K,) ascending [1/s^2]. shapes: (K, N, d), sum over particles of m |q|^2 = 1 [kg^-1/2]. residual: (K,) bounds of the errors of omega2
    [1/s^2]. zero: motions without stiffness in all, or -1 where they were not counted. Unpacks into omega2, shapes."""

    def __init__(self, found):
        self.omega2, self.shapes, self.residual, self.zero = found["omega_squared"], found["shapes"], found["residual"], found["zero_modes"]

    def __iter__(self):
        return iter((self.omega2, self.shapes))


class Moduli:
    """stiffness: (q, q) of a periodic lattice, rows xx, yy, xy in two dimensions, xx, yy, zz, yz, xz, xy in three [N/m^(d-1)].
    equilibrium: at which it was found. zero: motions without stiffness, or -1."""

    def __init__(self, found, equilibrium):
        self.stiffness, self.zero, self.equilibrium = found["stiffness"], found["zero_modes"], equilibrium


def _lattice_of(net, forces):
    """The lattice of a lattice or an equilibrium, and the settings and forces that go with it."""
    if isinstance(net, Equilibrium):
        files = ("-bs_output", "-bs_report", "-bs_checkpoint", "-bs_overwrite", "-bs_write_")
        return net.lattice, [one for one in net.settings if not one[0].startswith(files)], net.forces if forces is None else forces
    if not isinstance(net, Lattice):
        raise InputError(f"give a backspring.Lattice or an Equilibrium, not {type(net).__name__}")
    return net, [], forces


def _solve(net, settings, comm, forces, analysis):
    """(error, found) of `analysis` of a session of its own, and the lattice."""
    session, number = new_session(comm, net._arrays(), [], forces)
    try:
        error, found = analysis(session, settings)
        errors.pass_on(session.warnings)
    finally:
        end_session(session, number)
    return error, found


def _equilibrium(net, settings, comm, forces, analysis):
    """The equilibrium that an analysis found, and all that it found."""
    error, found = _solve(net, [("-bs_output_springs", "true")] + settings, comm, forces, analysis)
    state = Equilibrium(net, settings, forces, found) if found["fields"] else None
    errors.check(error, lambda: state)
    return state, found


def statics(net, loads=None, *, load_steps=1, total=False, forces=None, comm=None, **options):
    """The equilibrium of a lattice under loads that grow in `load_steps` steps, from the lattice as it is.

    loads: {group: (d,)} force on every particle of the group [N]; total: shared by its particles instead, for all groups or those named.
    forces: f(s, x, v) -> (N, d) [N] beside those of the options, s the load factor, not in the tangent (soft forces); on several ranks f(s, x, v, rows) for
    some rows of each rank at a time.
    comm: communicator of mpi4py, by default the world. Options of the program by their names: snes_rtol=1e-12, bs_gravity=(0, -9.81),
    bs_motion_top="y=velocity:0.1".
    Raises InputError, and ConvergenceError whose state is the last equilibrium on the way.
    """
    lattice, earlier, forces = _lattice_of(net, forces)
    settings = joined(earlier, loads_of(loads, total) + settings_of({"bs_load_steps": whole("load_steps", load_steps)}) + settings_of(options))
    return _equilibrium(lattice, settings, comm, forces, lambda session, more: session.statics(more))[0]


def moduli(net, loads=None, *, load_steps=1, total=False, forces=None, comm=None, **options):
    """The stiffness of a periodic lattice at its equilibrium; arguments as of statics."""
    lattice, earlier, forces = _lattice_of(net, forces)
    settings = joined(earlier, loads_of(loads, total) + settings_of({"bs_load_steps": whole("load_steps", load_steps)}) + settings_of(options))
    state, found = _equilibrium(lattice, settings, comm, forces, lambda session, more: session.moduli(more))
    return Moduli(found, state)


def modes(net, count=6, *, forces=None, comm=None, **options):
    """The `count` lowest free vibrations: of a lattice about its start, of an equilibrium about it (which is solved for again)."""
    lattice, settings, forces = _lattice_of(net, forces)
    about = [("-bs_modes_about", "equilibrium")] if isinstance(net, Equilibrium) else []
    error, found = _solve(lattice, joined(settings, about + settings_of(options)), comm, forces, lambda session, more: session.modes(whole("count", count), more))
    errors.check(error)
    return Modes(found)
