"""Level segments of a noisy series, and where one begins: how probable each night is to be its first.

A boundary is found by least squares over two levels, told that there is one step (as Otava and asv split, and as
rustc-perf's issue 1339 asks: noise is taken inside the two segments, never across). With the levels and the noise
integrated out, a split after k of n nights is as probable as (k (n − k))^−½ SSE^−(n−2)/2 (Smith 1975). Nights far off
their level count as if they lay 3.5 noises off, and nights that remember each other count for fewer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

from spook_tracker.tracker.document.middle import median, median_of_sorted

if TYPE_CHECKING:
    from .normal_nights import Values

Standing = Literal["usual", "red", "accepted", "recovered", "flaky"]

NORMAL = 1.4826  # standard deviations in a median absolute deviation
FAR = 3.5  # noises: more of one night is an accident
CHOICES = (
    300_000  # of the first nights among all: by chance an older level as rarely as 4.5 standard deviations
)
FEWEST_LATER = 16  # nights behind an older level
APART = 4.0  # standard deviations inside both
SURE = 0.998  # of the accused range: its nights hold the true one with this probability


@dataclass(frozen=True, slots=True)
class Boundary:
    """The first nights that a segment may have, as places, and how probable each is; the sum is `SURE` at least."""

    places: tuple[int, ...]
    probabilities: tuple[float, ...]

    @property
    def best(self) -> int:
        return self.places[self.probabilities.index(max(self.probabilities))]

    @property
    def probability(self) -> float:
        """That the best is right."""
        return max(self.probabilities)


@dataclass(frozen=True, slots=True)
class Segment:
    """Nights of one level: `first` and `last` are places, `spread` the relative noise inside it."""

    first: int
    last: int
    level: float
    spread: float
    standing: Standing
    boundary: Boundary | None = None  # None: nothing is known before it


def until_the_next(segments: Sequence[Segment]) -> list[Segment]:
    """The same, each of them lasting until the next begins."""
    ends = [after.first - 1 for after in segments[1:]]
    lasting = [replace(one, last=end) for one, end in zip(segments, ends, strict=False)]
    return [*lasting, *segments[-1:]]


def spread_of(values: Sequence[float], level: float) -> float:
    """The relative standard deviation that the median deviation from the level tells."""
    return NORMAL * median([abs(value - level) for value in values]) / abs(level) if values and level else 0.0


def middle_and_noise(values: Values) -> tuple[float, float]:
    """The median, and the standard deviation that the median distance from it tells."""
    import numpy as np

    middle = median_of_sorted(np.sort(values))
    return middle, NORMAL * median_of_sorted(np.sort(np.abs(values - middle)))


def boundary(places: Sequence[int], costs: Sequence[float], after: int) -> Boundary:
    """Where the level changed among these nights, of which the last `after` lie behind it as far as is known."""
    import numpy as np

    count = len(costs)
    values = np.array(costs)
    split = min(max(1, count - after), count - 1)
    low, high = median_of_sorted(np.sort(values[:split])), median_of_sorted(np.sort(values[split:]))
    off = values - low
    off[split:] += low - high
    noise = NORMAL * median_of_sorted(np.sort(np.abs(off)))
    noise = max(noise, 1e-6 * max(abs(low), abs(high)))
    values = np.minimum(np.maximum(values, min(low, high) - FAR * noise), max(low, high) + FAR * noise)
    before, after_it, prior = _splits(count)
    sums, squares = values.cumsum(), float(values @ values)
    sums, rest = sums[:-1], sums[-1] - sums[:-1]
    left = squares - sums * sums / before - rest * rest / after_it
    left = np.maximum(left, count * (0.1 * noise) ** 2)
    best = int(left.argmin())
    off = values - sums[best] / before[best]
    off[best + 1 :] = values[best + 1 :] - rest[best] / after_it[best]
    memory = _memory(off)
    freedom = max(1.0, (count - 2) * (1.0 - memory) / (1.0 + memory))
    log = prior - 0.5 * freedom * np.log(left / left[best])
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    order = (-weight).argsort()
    needed = order[: int(weight[order].cumsum().searchsorted(SURE)) + 1]
    first, last = int(needed.min()), int(needed.max()) + 1
    return Boundary(tuple(places[first + 1 : last + 1]), tuple(weight[first:last].tolist()))


@lru_cache(maxsize=256)
def _splits(count: int) -> tuple[Values, Values, Values]:
    """Of so many nights: how many lie before each split and after it, and the logarithm of its prior."""
    import numpy as np

    before = np.arange(1.0, count)
    return before, count - before, -0.5 * np.log(before * (count - before))


def _memory(values: Values) -> float:
    """Autocorrelation of deviations from one night to the next where it is told from chance, else none."""
    total = float(values @ values)
    found = float(values[1:] @ values[:-1]) / total if total else 0.0
    return min(found, 0.9) if found > 2.6 / math.sqrt(len(values)) else 0.0


def inner_split(costs: Sequence[float], remembered: float, fewest: int = 8) -> int | None:
    """Where nights of one segment are of two: the largest rank statistic over places (Pettitt 1979); None if of one.

    `remembered` says how many nights count for one.
    """
    import numpy as np

    count = len(costs)
    if count < 2 * fewest:
        return None
    values = np.array(costs)
    ordered = values.copy()
    ordered.sort()
    ranks = ordered.searchsorted(values) + ordered.searchsorted(
        values, "right"
    )  # twice, less one; equal ones share it
    expected, spread = _by_chance(count, fewest)
    off = (ranks.cumsum()[fewest - 1 : count - fewest] - expected) / spread
    high, low = off.max(), off.min()
    if max(high, -low) <= 4.5 / math.sqrt(remembered):
        return None
    return int(off.argmax() if high >= -low else off.argmin()) + fewest


def begins_apart(costs: Sequence[float]) -> bool:
    """Whether the first nights lie outside of the last ones: a look that costs little, before `earlier_level`."""
    last = costs[-FEWEST_LATER:]
    low, high = min(last), max(last)
    return not low <= costs[0] <= high and not low <= costs[1] <= high


def earlier_level(costs: Values) -> int | None:
    """How many of the first nights are all slower, or all faster, than every later one, and stand clear of these.

    Of nights drawn from one level the first so many are that once in as many times as there are choices of them,
    whatever the noise is. Ranks alone tell few nights from many only to a limit. None where there are none.
    """
    import numpy as np

    count = len(costs)
    most = count - FEWEST_LATER
    if most < 2:
        return None
    above, below = np.minimum.accumulate(costs)[:most], np.maximum.accumulate(costs)[:most]
    later = costs[::-1]
    highest, lowest = np.maximum.accumulate(later)[::-1], np.minimum.accumulate(later)[::-1]
    for split in (
        np.flatnonzero((above > highest[1 : most + 1]) | (below < lowest[1 : most + 1])) + 1
    ).tolist():
        low, high = costs[:split], costs[split:]
        noise = math.sqrt((float(np.var(low)) * split + float(np.var(high)) * (count - split)) / count)
        if math.comb(count, split) >= CHOICES and abs(float(low.mean() - high.mean())) > APART * noise:
            return int(split)
    return None


@lru_cache(maxsize=128)
def _by_chance(count: int, fewest: int) -> tuple[Values, Values]:
    """Mean and standard deviation of the sum of the first so many 2 r − 1, r being the ranks of `count`, `fewest` on each side."""
    import numpy as np

    n = np.arange(fewest, count - fewest + 1, dtype=float)
    return n * count, np.sqrt(n * (count - n) * (count + 1) / 3.0)
