"""MPI and PETSc, started at the first use of the package and ended with the interpreter."""

import atexit
import itertools
import sys
import weakref

from .errors import check
from .forces import functions_of

_open = {}  # number: session. Calls are collective, also the end: on several ranks it must not depend on when garbage is collected
_numbers = itertools.count()


@atexit.register
def _end():
    """Sessions end before PETSc does, PETSc before MPI."""
    for _, session in sorted(_open.items()):
        session = session() if isinstance(session, weakref.ref) else session
        if session is not None:
            session.close()
    _open.clear()
    if "backspring._core" in sys.modules:
        sys.modules["backspring._core"].finish()


def world(comm):
    """A communicator of mpi4py, by default the world."""
    from mpi4py import MPI

    return MPI.COMM_WORLD if comm is None else comm


def started(comm):
    """The extension, and the handle of a communicator of mpi4py; None: the world."""
    handle = world(comm).py2f()  # before PETSc: mpi4py starts MPI, and ends it when all else has ended
    from . import _core

    if not _core.start():
        raise RuntimeError("MPI and PETSc could not be started")
    return _core, handle


def new_session(comm, lattice, settings, forces=None):
    """A session of the extension. lattice: LatticeArrays; forces: f(t, x, v) or f(t, x, v, rows), or Forces."""
    core, handle = started(comm)
    session = core.Session(handle, lattice, settings, functions_of(forces, settings))
    check(session.error)
    number = next(_numbers)
    _open[number] = weakref.ref(session, lambda _: _open.pop(number, None)) if world(comm).size == 1 else session
    return session, number


def end_session(session, number):
    """Collective."""
    session.close()
    _open.pop(number, None)
