"""MPI and PETSc, started at the first use of the package and ended with the interpreter."""

from __future__ import annotations

import atexit
import functools
import hashlib
import itertools
import sys
import traceback
import weakref
from typing import TYPE_CHECKING, Any, Callable, Dict, Generator, Mapping, Optional, Tuple, TypeVar, cast

import numpy as np

from .errors import InputError, check, pass_on
from .forces import functions_of
from .kinds import Comm, GivenForces, Settings

if TYPE_CHECKING:
    from mpi4py import MPI

    from ._core import LatticeArrays, Problem, Session
    from .lattice import Lattice

Checked = TypeVar("Checked")

_open: Dict[int, Any] = {}  # number: session. Calls are collective, also the end: on several ranks it must not depend on when garbage is collected
_loops: Dict[int, "weakref.ref[Generator[Any, None, None]]"] = {}  # loops over motions, by the numbers of their sessions
_numbers = itertools.count()
_told: "weakref.WeakKeyDictionary[Session, int]" = weakref.WeakKeyDictionary()  # how many of its warnings were passed on


@atexit.register
def _end() -> None:
    """Loops end before their sessions, sessions before PETSc does, PETSc before MPI. What one of them raises, a warning that is an error, say, is printed,
    for nobody can catch it any more, and the others end all the same."""
    def ends(call: Callable[[], Any]) -> None:
        try:
            call()
        except Exception:
            traceback.print_exc()

    for _, loop in sorted(_loops.items()):
        frames = loop()
        if frames is not None:
            ends(frames.close)
    for number, held in sorted(_open.items()):
        session = held() if isinstance(held, weakref.ref) else held
        if session is not None:
            ends(functools.partial(end_session, session, number))
    if "backspring._core" in sys.modules:
        sys.modules["backspring._core"].finish()


def world(comm: Comm) -> MPI.Comm:
    """A communicator of mpi4py, by default the world."""
    from mpi4py import MPI

    if comm is not None and not (isinstance(comm, MPI.Comm) and comm):  # COMM_NULL is false
        raise InputError(f"comm: {comm!r} is no communicator of mpi4py")
    return MPI.COMM_WORLD if comm is None else comm


def agreed(comm: Comm, some: bool) -> bool:
    """Collective. Whether it is so on some rank."""
    ranks = world(comm)
    return bool(some) if ranks.size == 1 else bool(ranks.allreduce(int(some)))


def on_all(comm: Comm, check: Callable[[], Checked]) -> Checked:
    """Collective. What `check` returns. Where it raises on some rank every rank raises, before a call that the others would wait in."""
    ranks, found, raised = world(comm), None, None  # type: MPI.Comm, Optional[Checked], Optional[Exception]
    try:
        found = check()
    except Exception as error:
        raised = error
    said = [raised and str(raised)] if ranks.size == 1 else ranks.allgather(raised and str(raised))
    if raised is not None:
        raise raised
    for rank, one in enumerate(said):
        if one is not None:
            raise InputError(f"rank {rank}: {one}")
    return cast(Checked, found)


def started(comm: Comm) -> Tuple[Any, int]:
    """The extension, and the handle of a communicator of mpi4py; None: the world."""
    handle = world(comm).py2f()  # before PETSc: mpi4py starts MPI, and ends it when all else has ended
    from . import _core

    if not _core.start():
        raise RuntimeError("MPI and PETSc could not be started")
    return _core, handle


def _digest(value: Any) -> bytes:
    """Of an array, or of a dictionary, list or text."""
    found = hashlib.blake2b(digest_size=8)
    if isinstance(value, np.ndarray):
        found.update(str((value.dtype, value.shape)).encode())
        found.update(np.ascontiguousarray(value).view(np.uint8).data if value.size else b"")
    elif isinstance(value, Mapping):
        for name in sorted(value):
            found.update(str(name).encode() + _digest(value[name]))
    else:
        found.update(repr(value).encode())
    return found.digest()


def require_same(comm: Comm, arguments: Mapping[str, Any]) -> None:
    """Collective. Every rank raises where an argument is another on some rank."""
    ranks = world(comm)
    if ranks.size == 1:
        return
    all = ranks.allgather({name: _digest(value) for name, value in arguments.items()})
    for name in arguments:
        for rank, one in enumerate(all):
            if one.get(name) != all[0].get(name):
                raise InputError(f"{name}: rank {rank} gives something else than rank 0: arguments are the same on every rank")


class InProcess:
    """What holds a session, and cannot be copied or sent."""

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise TypeError(f"a {type(self).__name__} stays in its process: send its lattice, a frame or an equilibrium, or go on elsewhere from Simulation.checkpoint()")


def new_session(comm: Comm, lattice: Lattice, settings: Settings, forces: Optional[GivenForces] = None, more: Settings = []) -> Tuple[Session, int]:
    """A session of the extension, and its number among those that are open. forces: f(t, x, v) or f(t, x, v, rows), or Forces; more: settings of
    the call that follows."""
    core, handle = started(comm)
    called = functions_of(forces, settings, len(lattice))
    options = {name[1:]: value for name, value in settings + more}
    require_same(comm, {**vars(lattice), "the names of options": sorted(options), **options, "forces": called is not None, "between": called and called[3]})
    session = core.Session(handle, lattice._arrays(), settings, called)
    check(session.error)
    pass_on(lattice._outdone(settings + more))
    number = next(_numbers)
    _open[number] = weakref.ref(session, lambda _: _open.pop(number, None)) if world(comm).size == 1 else session
    return session, number


def ends_first(frames: Generator[Any, None, None], number: Optional[int]) -> None:
    """A loop over the session of that number ends before it, also with the interpreter."""
    if number is not None:
        own = number
        _loops[own] = weakref.ref(frames, lambda _: _loops.pop(own, None))


def tell(session: Session) -> None:
    """What the session has warned of since it was last told. After every call that may warn."""
    warned, before = session.warnings, _told.get(session, 0)
    _told[session] = len(warned)
    pass_on(warned[before:])


def is_open(number: Optional[int]) -> bool:
    """Whether the session of that number has not ended."""
    return number in _open


def end_session(session: Session, number: int) -> Problem:
    """Collective. What the session's end has failed with; what it warns of is told. Nothing where it has ended before."""
    if not is_open(number):
        return None
    try:
        error = session.finish()
        warned = session.warnings[_told.get(session, 0) :]
    finally:
        session.close()
        _open.pop(number, None)
    pass_on(warned)
    return error
