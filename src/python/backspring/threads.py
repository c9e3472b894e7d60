"""Threads that wait for one another."""

from __future__ import annotations

import os
import sys
import threading
from types import FrameType
from typing import Any, Dict, Iterator, Optional


HERE = os.path.dirname(__file__)


def _frames(frame: Optional[FrameType]) -> Iterator[FrameType]:
    while frame is not None:
        yield frame
        frame = frame.f_back


def _awaited(frame: FrameType) -> Any:
    """The Thread or the Future that the thread with this frame waits for without a limit, by join() or result(); None: it does not."""
    codes = {threading.Thread.join.__code__}
    futures = sys.modules.get("concurrent.futures")
    if futures is not None:
        codes.add(futures.Future.result.__code__)
    for one in _frames(frame):
        if os.path.dirname(one.f_code.co_filename) == HERE:
            return None  # what called this package waits for nobody but it
        if one.f_code in codes and one.f_locals.get("timeout") is None:
            return one.f_locals.get("self")
    return None


def _computed(frame: FrameType) -> Any:
    """The Future that the thread with this frame computes, of a ThreadPoolExecutor; None: it computes none."""
    items: Any = getattr(sys.modules.get("concurrent.futures.thread"), "_WorkItem", None)
    for one in _frames(frame) if items is not None else ():
        if one.f_code is items.run.__code__:
            return getattr(one.f_locals.get("self"), "future", None)
    return None


def waits_for_this(holder: int) -> bool:
    """Whether the thread `holder` waits for the one that asks, by itself or by way of others: each would wait for the other for ever."""
    frames: Dict[int, FrameType] = sys._current_frames()
    own, seen = threading.get_ident(), set()
    while holder in frames and holder not in seen:
        seen.add(holder)
        awaited = _awaited(frames[holder])
        if awaited is None:
            return False
        if isinstance(awaited, threading.Thread):
            holder = awaited.ident or 0
        else:
            holder = next((ident for ident, frame in frames.items() if _computed(frame) is awaited), 0)
        if holder == own:
            return True
    return False
