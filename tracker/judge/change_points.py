"""Where the level of a noisy series changed: E-divisive means with a permutation test.

Energy distance between the values before and after a place (Szekely and Rizzo 2005), maximised over places;
its probability by permuting the values, (extreme + 1) / (permutations + 1), seeded by the series' name so
that the same history gives the same answer. Found places split the series and both parts are searched again
(Matteson and James 2014). A level must hold for a few values and differ by a least share to be one.
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
SIGNIFICANT = 0.005
GIVE_UP = 5  # permutations as extreme: it can no longer become significant, nor is it worth the time
PERSISTENCE = 4  # values a level must hold
LEAST_CHANGE = 0.03  # of the level
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
    distance = np.abs(values[:, None] - values[None, :])
    place, statistic = _best(distance)
    before, after = np.median(values[:place]), np.median(values[place:])
    scale = max(abs(before), abs(after))
    if scale == 0.0 or abs(after - before) < least_change * scale:
        return
    extreme = 0
    for _ in range(PERMUTATIONS):
        order = random.permutation(len(values))
        extreme += _best(distance[np.ix_(order, order)])[1] >= statistic
        if extreme >= GIVE_UP:
            return
    probability = (extreme + 1) / (PERMUTATIONS + 1)
    if probability > SIGNIFICANT:
        return
    yield start + place, probability
    yield from _split(values[:place], start, random, least_change)
    yield from _split(values[place:], start + place, random, least_change)


def _best(distance: Values) -> tuple[int, float]:
    """The place with the largest scaled energy distance between its two sides."""
    count = len(distance)
    rows = np.cumsum(distance, axis=1)
    within_left = np.array([0.0, *np.cumsum(np.diagonal(rows))])  # sum over pairs i < j < k, by k
    across = np.array([0.0, *np.cumsum(rows[:, -1])])  # sum over i < k and all j
    total = within_left[-1]
    n = np.arange(PERSISTENCE, count - PERSISTENCE + 1)
    m = count - n
    left = within_left[n]
    between = across[n] - 2.0 * left
    right = total - left - between
    energy = 2.0 * between / (n * m) - 2.0 * left / (n * (n - 1)) - 2.0 * right / (m * (m - 1))
    statistic = energy * n * m / count
    best = int(np.argmax(statistic))
    return int(n[best]), float(statistic[best])
