"""What fixed work takes on this machine, measured in the same run as what is limited: the units of the benches' limits.

operation    a double added, multiplied, divided or its root drawn, out of the first cache levels, in NumPy
byte         read and written again in memory far beyond the caches, in NumPy
entry        of a Python dictionary, made, looked up, sorted: commands, imports, the website
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from spook_tracker.tracker.measure import calibration

TIMES = 100  # the least counts: others at work on the machine only make it longer
ENTRIES = 2000
STREAM = 1 << 23  # doubles, 64 MiB: beyond the last cache of most machines
_stream = np.ones(STREAM)


def _bytes() -> float:
    started = time.thread_time()
    np.negative(_stream, out=_stream)
    return time.thread_time() - started


def _entries() -> float:
    started = time.thread_time()
    known: dict[str, tuple[int, str]] = {}
    for number in range(ENTRIES):
        name = f"series {number % 400}"
        known[name] = (number, known[name][1] if name in known else name.upper())
    "".join(text for _, text in sorted(known.values()))
    return time.thread_time() - started


FLOORS: dict[str, tuple[Callable[[], float], int, int]] = {  # seconds of a go, units in it, goes
    "operation": (calibration.calibrate, 4 * calibration.ROUNDS * calibration.LENGTH, TIMES),
    "byte": (_bytes, 2 * _stream.nbytes, TIMES // 10),
    "entry": (_entries, ENTRIES, TIMES),
}


def floor(unit: str) -> float:
    """Seconds of the processor that a unit takes now, at least."""
    work, units, goes = FLOORS[unit]
    return min(work() for _ in range(goes)) / units
