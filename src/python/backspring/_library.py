"""MPI and PETSc, started at the first use of the package and ended with the interpreter."""

import atexit
import inspect
import sys
import weakref

from .errors import InputError

_sessions = weakref.WeakSet()


@atexit.register
def _end():
    """Sessions end before PETSc does, PETSc before MPI."""
    for session in list(_sessions):
        session.close()
    if "backspring._core" in sys.modules:
        sys.modules["backspring._core"].finish()


def _with_rows(forces):
    """As the extension calls it: (t, x, v, rows)."""
    if forces is None:
        return None
    if not callable(forces):
        raise InputError(f"forces: {forces!r} is no function of t, x and v")
    try:
        inspect.signature(forces).bind(0.0, None, None, None)
        return forces
    except TypeError:
        return lambda t, x, v, rows: forces(t, x, v)


def started(comm):
    """The extension, and the handle of a communicator of mpi4py; None: the world."""
    from mpi4py import MPI  # starts MPI, and ends it when all else has ended

    from . import _core

    if not _core.start():
        raise RuntimeError("MPI and PETSc could not be started")
    return _core, (MPI.COMM_WORLD if comm is None else comm).py2f()


def new_session(comm, lattice, settings, forces=None):
    """A session of the extension. lattice: LatticeArrays; forces: f(t, x, v) or f(t, x, v, rows), computed in Python."""
    core, handle = started(comm)
    session = core.Session(handle, lattice, settings, _with_rows(forces))
    if session.error is None:
        _sessions.add(session)
    return session
