"""The calibration kernel: a fixed piece of work that takes the same time as long as the machine does not change.

It is taken beside every repeat of every timing, by the processor's clock, and knows nothing of the engine: when it
and the engine are slower together, the machine is. Work of the engine's kind, double precision out of the first
cache levels, in NumPy.
"""

from __future__ import annotations

import time

import numpy as np

LENGTH = 2048  # numbers: 16 KiB
ROUNDS = 120  # about a millisecond on a machine of 2020

_x = np.linspace(0.5, 1.5, LENGTH)
_y = np.empty(LENGTH)


def calibrate() -> float:
    """Seconds of processor time that the kernel takes now."""
    started = time.thread_time()
    _y[:] = _x
    for _ in range(ROUNDS):
        np.multiply(_y, _x, out=_y)
        np.add(_y, 1.0, out=_y)
        np.sqrt(_y, out=_y)
        np.divide(_y, _x, out=_y)
    return time.thread_time() - started
