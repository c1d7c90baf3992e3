"""When is a run time slower? Statistics that say nothing about noise and something about a change.

Two sessions: the ratio of minima must pass a floor, and the repeats must differ by rank (Mann and
Whitney's U, p < 0.01 with five repeats or more) on most rungs of a ladder. Only interference makes a run slower, so the
minimum is the steadiest estimate; the floor rises with the spread the sessions show themselves. Where both took
processor time beside the calibration kernel, these are compared, as histories do: a slower machine cancels, and the
floor may fall to a per cent where repeats and rungs agree so well. One or two repeats a side prove nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from spook_tracker.tracker.document.middle import median
from spook_tracker.tracker.document.run_document import Timing

from .slower import LEAST

FLOOR = 0.10  # least relative change of run time worth a word, between two sessions by the clock
CLEAR = 8.0  # spreads: as histories ask of few nights
FEWEST_RUNGS = 4  # whose scatter shows what repeats of one session do not
REPEATED = 3  # repeats on each side, or nothing is said
SIGNIFICANT = 0.01
FEWEST = 5  # repeats for a rank test: three against three never falls below 0.05
SAME_WORK = 0.01  # relative change of retired instructions that says the same code ran
SAME_WORK_FLOOR = 0.5  # the same instructions: only a gross change of time is the engine's
EXACT_UP_TO = 40  # repeats together, for the exact distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeChange:
    """Run time of one side against another, over one ladder or one run."""

    ratio: float  # later / earlier, geometric mean over rungs: that of the values shown
    floor: float  # relative change that had to be passed
    significant: float  # share of rungs whose repeats differ by rank in the direction of the ratio
    rungs: int
    repeated: bool = True  # often enough to say anything

    @property
    def slower(self) -> bool:
        return self.ratio > 1.0 + self.floor and self.significant >= 0.5

    @property
    def faster(self) -> bool:
        return self.ratio < 1.0 / (1.0 + self.floor) and self.significant >= 0.5


def compare_times(
    before: Sequence[Timing], after: Sequence[Timing], tolerance: float = 0.0
) -> TimeChange | None:
    """The change over rungs measured on both sides, pairwise; None if there are none. A time of 0 is none.

    `tolerance`: the relative change below which the series' own definition tells none.
    """
    rungs = [pair for pair in zip(before, after, strict=True) if all(min(t.seconds) > 0.0 for t in pair)]
    if not rungs:
        return None
    own = all(t.cpu_seconds and t.calibration for pair in rungs for t in pair)
    values = [(_values(a, own), _values(b, own)) for a, b in rungs]
    logs = [math.log(min(b) / min(a)) for a, b in values]
    ratio = math.exp(sum(logs) / len(logs))
    spread = median(max(_spread(a), _spread(b)) for a, b in values)
    often = min(len(side) for pair in values for side in pair)
    floor = max(FLOOR, 2.0 * spread)
    if own and often >= FEWEST and len(rungs) >= FEWEST_RUNGS:
        scatter = median(abs(log - median(logs)) for log in logs)
        floor = max(LEAST, min(floor, CLEAR * max(spread, scatter)))  # better evidence never asks for more
    work = [b.instructions / a.instructions for a, b in rungs if a.instructions and b.instructions]
    if work and len(work) == len(rungs) and abs(median(work) - 1.0) < SAME_WORK:
        floor = max(floor, SAME_WORK_FLOOR)
    differing = sum(_differs(a, b, slower=ratio > 1.0) for a, b in values)
    return TimeChange(
        ratio=ratio,
        floor=max(floor, tolerance),
        significant=differing / len(rungs),
        rungs=len(rungs),
        repeated=often >= REPEATED,
    )


def _values(timing: Timing, own: bool) -> Sequence[float]:
    """Every repeat: in kernels where both sides have them, else in seconds."""
    if not own:
        return timing.seconds
    kernel = min(timing.calibration)
    return [seconds / kernel for seconds in timing.cpu_seconds]


def _spread(seconds: Sequence[float]) -> float:
    """How far the middle repeat lies above the fastest, relatively."""
    return median(seconds) / min(seconds) - 1.0


def _differs(before: Sequence[float], after: Sequence[float], slower: bool) -> bool:
    """By rank where there are repeats enough; else the two sets must not overlap at all."""
    low, high = (before, after) if slower else (after, before)
    if min(len(before), len(after)) < REPEATED:
        return False
    if min(len(before), len(after)) < FEWEST:
        return max(low) < min(high)
    return rank_test(low, high) < SIGNIFICANT


def rank_test(low: Sequence[float], high: Sequence[float]) -> float:
    """Probability that `high` ranks this far above `low` by chance: one-sided U test, ties counted half.

    Exact for up to 40 values together without ties, the normal approximation with tie correction beyond.
    """
    n, m = len(low), len(high)
    u = sum((y > x) + 0.5 * (y == x) for x in low for y in high)
    pooled = sorted((*low, *high))
    ties = [pooled.count(value) for value in set(pooled)]
    if n + m <= EXACT_UP_TO and max(ties) == 1:
        ways = ways_of_u(n, m)
        return sum(ways[math.ceil(u) :]) / sum(ways)
    total = n + m
    correction = sum(t**3 - t for t in ties) / (total * (total - 1.0))
    variance = n * m / 12.0 * (total + 1.0 - correction)
    if variance <= 0.0:
        return 1.0
    z = (u - 0.5 * n * m - 0.5) / math.sqrt(variance)
    return 0.5 * math.erfc(z / math.sqrt(2.0))


@lru_cache(maxsize=64)
def ways_of_u(n: int, m: int) -> tuple[int, ...]:
    """In how many orders of n low and m high values U is 0 … n m (Mann and Whitney's recursion)."""
    if n == 0 or m == 0:
        return (1,)
    total = [0] * (n * m + 1)
    for shift, part in ((m, ways_of_u(n - 1, m)), (0, ways_of_u(n, m - 1))):
        for u, count in enumerate(part):
            total[u + shift] += count
    return tuple(total)
