"""Exceptions: the one line that the program would print, by what kind of error it is."""

import warnings


class Error(Exception):
    """Of all errors of this package."""


class InputError(Error, ValueError):
    """An argument, an option or a file is not what it should be; the message says which and what to give instead."""


class ConvergenceError(Error, RuntimeError):
    """A step or an equilibrium was not found. ``state`` is the last good one: an Equilibrium, a Frame, or None where there is none."""

    def __init__(self, message, state=None):
        super().__init__(message)
        self.state = state


class FileError(Error, OSError):
    """A file could not be written."""


class Stopped(Error):
    """Another rank was interrupted, or raised an exception in an observer or in forces."""


class BackspringWarning(UserWarning):
    """What the program would warn of."""


KINDS = {2: InputError, 3: ConvergenceError, 4: FileError}


def check(error, state=None):
    """Raises the exception of an error (kind, text); nothing where it is None. ``state``: makes the last good state of one that did not converge."""
    if error is None:
        return
    kind, text = error
    if kind == 3:
        raise ConvergenceError(text, state() if state else None)
    raise KINDS.get(kind, Stopped)(text)


def pass_on(texts):
    """Warnings of the program as Python's."""
    for text in texts:
        warnings.warn(text, BackspringWarning, stacklevel=4)
