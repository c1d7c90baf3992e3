"""Level and noise of the nights that hold, and how far they reached."""

from __future__ import annotations

import math
from collections.abc import Sequence

from spook_tracker.tracker.document.middle import median

NORMAL = 1.4826  # standard deviations in a median absolute deviation


def outermost_two(reached: Sequence[float]) -> list[float]:
    """The largest two, the largest first."""
    if len(reached) < 2:
        return list(reached)
    largest = max(reached)
    rest = list(reached)
    rest.remove(largest)
    return [largest, max(rest)]


def level_and_noise(values: Sequence[float]) -> tuple[float, float]:
    """The median, and the relative standard deviation that the median deviation from it tells."""
    finite = values if all(map(math.isfinite, values)) else list(filter(math.isfinite, values))
    level = median(finite) if finite else math.inf
    if level in (0.0, math.inf):
        return level, 0.0
    return level, NORMAL * median([abs(value - level) for value in finite]) / abs(level)
