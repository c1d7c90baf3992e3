"""Scalars read off a ladder of error against run time: order, time at equal error, error at equal time.

All logarithmic: between two neighbouring points of a ladder error and time are taken as powers of the step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations, pairwise

from .middle import median

FEWEST_POINTS = 3


def observed_order(time_steps: Sequence[float], errors: Sequence[float]) -> float | None:
    """Median slope of log error against log time step over all pairs; None below three usable points.

    One point spoiled by rounding or by a lucky zero crossing does not move it (Theil and Sen's estimate).
    """
    points = [
        (math.log(h), math.log(abs(e)))
        for h, e in zip(time_steps, errors, strict=True)
        if h > 0.0 and math.isfinite(e) and e != 0.0
    ]
    if len(points) < FEWEST_POINTS:
        return None
    slopes = [(y2 - y1) / (x2 - x1) for (x1, y1), (x2, y2) in combinations(points, 2) if x1 != x2]
    return median(slopes) if slopes else None


def in_range(time_step: float, order_range: tuple[float, float] | None) -> bool:
    """Whether a time step lies in the asymptotic range, its ends included up to rounding."""
    if order_range is None:
        return True
    low, high = sorted(order_range)
    return low * (1.0 - 1e-9) <= time_step <= high * (1.0 + 1e-9)


def time_at_error(seconds: Sequence[float], errors: Sequence[float], target: float) -> float:
    """Seconds the ladder needs for |error| <= target; infinity if no point reaches it."""
    return least_cost(seconds, [abs(error) for error in errors])(target)


def error_in_time(seconds: Sequence[float], errors: Sequence[float], target: float) -> float:
    """Smallest |error| the ladder gives within `target` seconds; infinity if every point takes longer."""
    return least_cost([abs(error) for error in errors], seconds)(target)


def least_cost(cost: Sequence[float], quality: Sequence[float]) -> Callable[[float], float]:
    """Least cost at which quality falls to a target, between neighbours by powers: a ladder asked many times."""
    points = [
        (c, q) for c, q in zip(cost, quality, strict=True) if math.isfinite(c) and math.isfinite(q) and c >= 0
    ]
    between = [(a, b) for a, b in pairwise(points) if min(*a, *b) > 0.0]

    def at(target: float) -> float:
        found = [c for c, q in points if q <= target]
        for (c1, q1), (c2, q2) in between if target > 0.0 else ():
            if (q1 - target) * (q2 - target) < 0.0:
                found.append(_along(c1, c2, _powers(target, q1) / _powers(q2, q1)))
        return min(found, default=math.inf)

    return at


TELLS = (1e-300, 1e300)  # ratios that are neither lost below the smallest number nor above the largest


def _powers(one: float, other: float) -> float:
    """The logarithm of the ratio of two positive numbers, however far apart."""
    ratio = one / other
    return math.log(ratio) if TELLS[0] < ratio < TELLS[1] else math.log(one) - math.log(other)


def _along(one: float, other: float, share: float) -> float:
    """The number at a share of the way between two positive ones, by powers."""
    ratio = other / one
    if TELLS[0] < ratio < TELLS[1]:
        return float(one * ratio**share)
    return math.exp(math.log(one) + share * _powers(other, one))
