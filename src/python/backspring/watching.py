"""Calls that take steps, and what watches them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Callable, Optional, Tuple, TypeVar

from . import errors
from ._library import InProcess, agreed, tell
from .progress import Progress

if TYPE_CHECKING:
    from mpi4py import MPI

    from ._core import Session
    from .frames import Frame

Observe = Callable[[float, "Frame"], Any]
Found = TypeVar("Found")


class Watched(InProcess):
    """A session whose steps functions of the caller's are told of. stopped: whether one of them has ended the last call."""

    stopped: bool
    _session: Session

    def __init__(self, comm: MPI.Comm, observe: Optional[Observe], stop: Optional[Observe]) -> None:
        self._comm = comm
        self._observe, self._stop, self._on_step = observe, stop, None  # type: Optional[Observe], Optional[Observe], Optional[Callable[..., Any]]
        self._bar: Optional[Progress] = None
        self.stopped, self._raised, self._others = False, None, False  # type: bool, Optional[BaseException], bool

    def _frame(self, changeable: bool = False) -> Frame:
        raise NotImplementedError

    def _last(self, changeable: bool = False) -> Frame:
        """The frame of now, with what it keeps. changeable: the motion follows what is changed in it."""
        frame = self._frame(changeable)
        frame._found()
        return frame

    def _attach(self) -> None:
        self._session.observe(self._after_step if self._observe or self._stop or self._on_step or self._bar else None)

    def _after_step(self, step: int, t: float, *more: Any) -> bool:
        """Whether the call ends with this step: the same on all ranks."""
        said = False
        try:
            if self._on_step:
                self._on_step(step, t, *more)
            frame = self._frame()
            if self._observe:
                self._observe(t, frame)
            said = self._stop is not None and bool(self._stop(t, frame))
        except BaseException as error:
            self._raised = error
        if self._bar:
            self._bar.at(t, step)
        wrong = self.agreed(self._raised is not None)
        self._others = wrong and self._raised is None
        self.stopped = not wrong and self._stop is not None and self.agreed(said)
        return wrong or self.stopped

    def _step(self, call: Callable[[], Any]) -> Any:
        """A call that takes steps."""
        self.stopped, self._raised, self._others = False, None, False
        found = call()
        error = found[0] if isinstance(found, tuple) and len(found) == 2 and isinstance(found[1], bool) else found
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised
        if self._others:
            raise errors.Stopped("another rank was interrupted, or raised an exception in an observer or in forces")
        self._done(error)
        return found

    def _done(self, error: Optional[Tuple[int, str]]) -> None:
        tell(self._session)
        errors.check(error, self._last)

    def _found(self, answer: Tuple[Optional[Tuple[int, str]], Found]) -> Found:
        """What a call found, unless it failed."""
        self._done(answer[0])
        return answer[1]

    def agreed(self, some: bool) -> bool:
        """Whether it is so on some rank."""
        return agreed(self._comm, some)
