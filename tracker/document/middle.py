"""The median, of few values and often: `numpy.median` takes ten times as long for as few as a series has."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


def median(values: Iterable[float]) -> float:
    """The middle value, of an even number the mean of the middle two; of at least one, none of them NaN."""
    return median_of_sorted(sorted(values))


def quartile(values: Iterable[float]) -> float:
    """The lower quartile, between two values in proportion; NumPy's first call of its own imports a room of it."""
    ordered = sorted(values)
    place = 0.25 * (len(ordered) - 1)
    below = int(place)
    low, high, share = ordered[below], ordered[min(below + 1, len(ordered) - 1)], place - below
    return low + (high - low) * share if share < 0.5 else high - (high - low) * (1.0 - share)


def median_of_sorted(ordered: Sequence[float] | npt.NDArray[np.float64]) -> float:
    """The same of values, a list or an array, that are in order already."""
    half, odd = divmod(len(ordered), 2)
    return float(ordered[half] if odd else (ordered[half - 1] + ordered[half]) / 2.0)
