"""Is a change slower than its base? Decided from fresh processes of both, taken in random order in one job.

A process keeps a level of its own (where its memory came to lie, which core it got), so the spread that counts lies
between processes, and one number of each is all that is compared. The first process of each side only says which run
times are worth a second look. Those are measured in blocks of as many processes of either side, in an order that is
drawn for each block. If the change is as fast as its base, every order was as likely as the one drawn, whatever the
noise is like; Mann and Whitney's U, counted inside the blocks and added over them, then has an exact distribution
without any model of the noise (van Elteren, 1960). With K run times under test, each look may call one of them
slower if so large a U has a probability of at most ERROR / (looks × K): no more than ERROR of all unchanged changes are blocked. The
first process is not part of the test, so K may follow from it. A change up to the smallest effect is none.

A value is exact where every process repeats it. One that is worse with a probability q, by the process, would have n
processes of the base alike and n of the change alike and worse in (q (1 − q))ⁿ ≤ 4⁻ⁿ of all unchanged changes.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

from spook_tracker.tracker.document.middle import median

from .timing_statistics import ways_of_u

ERROR = 1e-3  # share of unchanged changes that may be blocked, over all their run times together
SMALLEST = (
    0.02  # relative change of a run time that is worth a red; a series' own tolerance where that is larger
)
BLOCKS = (5, 7, 10)  # processes of either side in each block
LOOKS = (
    len(BLOCKS) - 1
)  # that may call it slower: of the first block there are too few orders, it only lets go
HOPELESS = 0.2  # probability by chance above which a run time is not pursued

NIGHTS = 5  # of a machine, before what is usual on it is known
UNUSUAL = 2.0  # times what is usual: a spread between processes beyond it is said

Decision = Literal["open", "slower", "not slower", "not proven"]


@dataclass(kw_only=True)
class Paired:
    """One number a process of either side, larger is worse; inf where there is none."""

    smallest: float = SMALLEST
    first: tuple[float, float]  # of the base, of the change
    blocks: list[tuple[Sequence[float], Sequence[float]]] = field(default_factory=list)

    @property
    def worth_a_look(self) -> bool:
        """Whether the first process of each side leaves it open: above half the smallest effect."""
        base, change = self.first
        return change > base * (1.0 + 0.5 * self.smallest)

    @property
    def ratio(self) -> float:
        """Median of the change over median of the base, of all processes; NaN where either has none."""
        base, change = (median([self.first[side], *self._all(side)]) for side in (0, 1))
        return change / base if 0.0 < base < math.inf and math.isfinite(change) else math.nan

    @property
    def spread(self) -> float:
        """How far the processes of a side lie from its median, in the middle, relatively; NaN of less than three."""
        off = []
        for side in (0, 1):
            levels = [level for level in (self.first[side], *self._all(side)) if math.isfinite(level)]
            centre = median(levels) if levels else 0.0
            off += [abs(level / centre - 1.0) for level in levels] if centre > 0.0 and len(levels) > 2 else []
        return median(off) if off else math.nan

    @property
    def probability(self) -> float:
        """That chance alone puts the change so far above the base; ties count for the base."""
        if not self.blocks:
            return 1.0
        allowed = 1.0 + self.smallest
        u = sum(y > x * allowed for base, change in self.blocks for x in base for y in change)
        return at_least(tuple(len(base) for base, _ in self.blocks), u)

    def decision(self, tested: int) -> Decision:
        """What is known after the last block, where so many run times are under test."""
        if len(self.blocks) > 1 and self.probability <= ERROR / (LOOKS * max(1, tested)):
            return "slower"
        if self.probability > HOPELESS:
            return "not slower"
        return "open" if len(self.blocks) < len(BLOCKS) else "not proven"

    def _all(self, side: Literal[0, 1]) -> list[float]:
        return [level for block in self.blocks for level in block[side]]


def usual_spread(levels: Sequence[float]) -> float:
    """How far a night of a machine lies from its level, in the middle, relatively; NaN of less than NIGHTS.

    From night to the next, so that a level that changed once counts once: two nights differ by √2 of what one is off.
    """
    sound = [level for level in levels if 0.0 < level < math.inf]
    if len(sound) < NIGHTS:
        return math.nan
    return median([abs(math.log(b / a)) for a, b in itertools.pairwise(sound)]) / math.sqrt(2.0)


def to_be_repeated(values: int) -> int:
    """In how many more processes of either side so many values must stay what they were in the first, to be exact."""
    return math.ceil(math.log(max(1, values) / ERROR, 4.0)) - 1


def at_least(blocks: tuple[int, ...], u: int) -> float:
    """Probability that U, over blocks of so many processes of either side in random order, is `u` or more."""
    orders = _orders(blocks)
    return sum(orders[max(0, u) :]) / sum(orders)


@lru_cache(maxsize=64)
def _orders(blocks: tuple[int, ...]) -> tuple[int, ...]:
    """In how many orders U is 0, 1, 2, … over all blocks."""
    total: tuple[int, ...] = (1,)
    for size in blocks:
        ways = ways_of_u(size, size)
        found = [0] * (len(total) + len(ways) - 1)
        for i, a in enumerate(total):
            for j, b in enumerate(ways):
                found[i + j] += a * b
        total = tuple(found)
    return total
