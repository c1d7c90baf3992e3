"""Where the level of a noisy series changed: the largest rank statistic over places, and a permutation test.

Mann and Whitney's U of the values before and after a place, in its standard deviations, is largest where the level
changed (Pettitt 1979); its probability by permuting the ranks, (extreme + 1) / (permutations + 1), seeded by the
series' name so that the same history gives the same answer. Found places split the series and both parts are searched
again. A level must hold for a few values and differ by a least share to be one.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]

PERMUTATIONS = 999
TOGETHER = 50  # permutations drawn at once: they stay in the cache
SIGNIFICANT = 0.005
FIRST, GIVE_UP = 99, 5  # of the first permutations so many as extreme: it can no longer become significant
PERSISTENCE = 4  # values a level must hold
LEAST_CHANGE = 0.03  # of the level
BESIDE = 15  # values on each side of a place that say what the levels there are
NUDGE = (
    5  # values by which a place is moved to where these two levels fit best: ranks of other levels pull at it
)
NEWEST = 1000  # values looked at: older ones were looked at when they were new


@dataclass(frozen=True, slots=True)
class ChangePoint:
    """The level differs from `place` on. Levels are medians."""

    place: int
    before: float
    after: float
    probability: float


def change_points(
    values: Sequence[float], name: str = "", least_change: float = LEAST_CHANGE
) -> list[ChangePoint]:
    """Places where the level changed, in order. What is not finite is left out of the statistics."""
    places = [i for i, value in enumerate(values) if math.isfinite(value)][-NEWEST:]
    finite = np.array([values[i] for i in places])
    seed = int.from_bytes(hashlib.sha256(name.encode("utf-8", "replace")).digest()[:8], "big")
    if not places:
        return []
    found = sorted(_split(finite, 0, np.random.default_rng(seed), least_change))
    ends = [0, *(place for place, _ in found), len(finite)]
    levels = [float(np.median(finite[a:b])) for a, b in pairwise(ends)]
    return [
        ChangePoint(places[place], before, after, probability)
        for (place, probability), (before, after) in zip(found, pairwise(levels), strict=True)
    ]


def _split(
    values: Values, start: int, random: np.random.Generator, least_change: float
) -> Iterator[tuple[int, float]]:
    """Significant places of a stretch, and of both its parts."""
    if len(values) < 2 * PERSISTENCE:
        return
    ranks = _ranks(values)
    places, statistics = _largest(ranks[None, :])
    place, statistic = int(places[0]), float(statistics[0])
    begin, end = max(0, place - BESIDE), place + BESIDE
    before, after = np.median(values[begin:place]), np.median(values[place:end])
    scale = max(abs(before), abs(after))
    if scale == 0.0 or abs(after - before) < least_change * scale:
        return
    extreme = 0
    pieces = range(FIRST, PERMUTATIONS, TOGETHER)
    for count in (FIRST, *(min(TOGETHER, PERMUTATIONS - done) for done in pieces)):
        _, drawn = _largest(random.permuted(np.tile(ranks, (count, 1)), axis=1))
        extreme += int(np.sum(drawn >= statistic))
        if count == FIRST and extreme >= GIVE_UP:
            return
    probability = (extreme + 1) / (PERMUTATIONS + 1)
    if probability > SIGNIFICANT:
        return
    nearer = np.abs(values[begin:end] - before) - np.abs(values[begin:end] - after)
    sums = np.array(
        [0.0, *np.cumsum(nearer)]
    )  # how much worse the level before fits the first nights than that after
    low, high = max(PERSISTENCE, place - NUDGE), min(len(values) - PERSISTENCE, place + NUDGE)
    place = low + int(np.argmin(sums[low - begin : high - begin + 1]))
    yield start + place, probability
    yield from _split(values[:place], start, random, least_change)
    yield from _split(values[place:], start + place, random, least_change)


def _ranks(values: Values) -> Values:
    """Places in order, from 1; equal values share the mean of theirs."""
    _, which, counts = np.unique(values, return_inverse=True, return_counts=True)
    last = np.cumsum(counts)
    found: Values = (last - 0.5 * (counts - 1.0))[which]
    return found


def _largest(ranks: Values) -> tuple[npt.NDArray[np.intp], Values]:
    """For each row the place with the largest difference in rank between its two sides, and that difference."""
    count = ranks.shape[1]
    n = np.arange(PERSISTENCE, count - PERSISTENCE + 1)
    sums = np.cumsum(ranks, axis=1)[:, n - 1]
    off = np.abs(sums - 0.5 * n * (count + 1)) / np.sqrt(n * (count - n) * (count + 1) / 12.0)
    best = np.argmax(off, axis=1)
    return n[best], off[np.arange(len(off)), best]
