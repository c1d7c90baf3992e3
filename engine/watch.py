"""The time that a scene may take to be compiled, which is time of its run: as run/watch.hpp for a run itself."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Row = TypeVar("Row")
ROWS_A_LOOK = 256  # some milliseconds of work

_watch = threading.local()


@contextmanager
def until(end: float) -> Iterator[None]:
    """What is compiled inside, in this thread, raises TimeoutError after `end` [s, as `time.monotonic` tells it]."""
    before = getattr(_watch, "end", None)
    _watch.end = end
    try:
        yield
    finally:
        _watch.end = before


def time_left() -> float:
    """Seconds that are left, 0 for no limit; raises TimeoutError when none are."""
    end = getattr(_watch, "end", None)
    if end is None:
        return 0.0
    left: float = end - time.monotonic()
    if left <= 0.0:
        raise TimeoutError
    return max(left, sys.float_info.min)


def in_time(rows: Iterable[Row]) -> Iterator[Row]:
    """The same rows, one after the other, with a look at the clock now and then."""
    for place, row in enumerate(rows):
        if place % ROWS_A_LOOK == 0:
            time_left()
        yield row
