"""Bars that grow with a run, of tqdm: on the terminal, or in a notebook its own."""

from __future__ import annotations

from typing import Any, Optional

from .kinds import Comm


class Progress:
    """A bar from `start` to `end`, on the first rank of `comm`; nothing where none is wanted, and then tqdm is not needed."""

    def __init__(self, wanted: bool, comm: Comm, start: float, end: float, what: str) -> None:
        self._bar: Optional[Any] = None
        if not wanted:
            return
        try:
            from tqdm.auto import tqdm
        except ImportError:
            raise ImportError("progress: tqdm is not installed: apt install python3-tqdm, or pip install tqdm, or leave progress out") from None
        from ._library import world

        if world(comm).rank == 0:
            form = "{l_bar}{bar}| " + what + " = {n:.4g} of {total:.4g} [{elapsed}<{remaining}{postfix}]"
            self._bar = tqdm(total=end, initial=start, bar_format=form)

    def at(self, place: float, step: int) -> None:
        """The run has come to `place`, in so many steps."""
        if self._bar is not None:
            self._bar.set_postfix_str(f"step {step}", refresh=False)
            self._bar.update(min(place, self._bar.total) - self._bar.n)

    def close(self) -> None:
        """The bar stays where it is."""
        if self._bar is not None:
            self._bar.refresh()
            self._bar.close()
            self._bar = None
