"""Exceptions: the one line that the program would print, by what kind of error it is."""

from __future__ import annotations

import pathlib
import sys
import warnings
from typing import Any, Callable, Dict, Iterable, Optional, Tuple, Type

HERE = str(pathlib.Path(__file__).resolve().parent)


class Error(Exception):
    """Of all errors of this package."""


class InputError(Error, ValueError):
    """An argument, an option or a file is not what it should be; the message says which and what to give instead."""


class NoReaction(InputError, KeyError):
    """Nothing holds the group whose reaction is asked for."""

    __str__ = Exception.__str__  # KeyError's would put it between quotes


class ConvergenceError(Error, RuntimeError):
    """A step or an equilibrium was not found. ``state`` is the last good one: an Equilibrium, a Frame, or None where there is none."""

    def __init__(self, message: str, state: Any = None) -> None:
        super().__init__(message)
        self.state = state


class FileError(Error, OSError):
    """A file could not be written."""


class Stopped(Error):
    """Another rank was interrupted, raised an exception in an observer or in forces, or left a loop over a motion."""


class BackspringWarning(UserWarning):
    """What the program would warn of."""


KINDS: Dict[int, Type[Exception]] = {2: InputError, 3: ConvergenceError, 4: FileError}


def check(error: Optional[Tuple[int, str]], state: Optional[Callable[[], Any]] = None) -> None:
    """Raises the exception of an error (kind, text); nothing where it is None. ``state``: makes the last good state of one that did not converge."""
    if error is None:
        return
    kind, text = error
    if kind == 3:
        raise ConvergenceError(text, state() if state else None)
    raise KINDS.get(kind, Stopped)(text)


def pass_on(texts: Iterable[str]) -> None:
    """Warnings of the program as Python's, of the line outside this package that called it."""
    texts = list(texts)
    if not texts:
        return
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and str(pathlib.Path(frame.f_code.co_filename).resolve().parent) == HERE:
        level, frame = level + 1, frame.f_back
    for text in texts:
        warnings.warn(text, BackspringWarning, stacklevel=level)
