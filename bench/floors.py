"""What this machine takes for fixed work, measured in the same run as what is limited.

A limit in seconds holds on the machine whose fixed work stands below: it is a multiple of what that took, and is
carried to another by measuring the same work there:

    arithmetic    double precision out of the first cache levels, in NumPy: the engine's steps
    interpreter   objects, dictionaries and texts in Python: commands, imports, the website

    python bench/floors.py

prints both beside what the limits' own machine takes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from spook_tracker.tracker.measure.calibration import calibrate

TIMES = 200  # the least counts: others at work on the machine only make it longer


def _objects() -> float:
    """Seconds of processor time for a fixed piece of Python."""
    started = time.thread_time()
    known: dict[str, tuple[int, str]] = {}
    for number in range(2000):
        name = f"series {number % 400}"
        known[name] = (number, known[name][1] if name in known else name.upper())
    "".join(text for _, text in sorted(known.values()))
    return time.thread_time() - started


KINDS: dict[str, tuple[Callable[[], float], float]] = {  # how it is measured, s on the limits' own machine
    "arithmetic": (calibrate, 0.46e-3),
    "interpreter": (_objects, 0.27e-3),
}


@cache
def speed(kind: str) -> float:
    """How many times as long as the limits' own machine this one takes."""
    measure, own = KINDS[kind]
    return min(measure() for _ in range(TIMES)) / own


def here(limit: float, kind: str) -> float:
    """A limit [s, or what is proportional to it] on this machine."""
    return limit * speed(kind)


def main() -> None:
    for kind, (_, own) in KINDS.items():
        print(f"{kind:<14}{1e3 * own * speed(kind):8.3f} ms, {speed(kind):.2f} × the limits' own machine")


if __name__ == "__main__":
    main()
