"""The present level of a noisy series: what is usual there, and what stands clear of it.

Noise is that of nights about the level of their own segment. Where the segment is young, the last nights before it
help out, about theirs. What nights that hold have reached is learnt, so that two clusters and spikes raise no alarm;
so is by how much twenty of them usually lie off the twenty before, so that a level that wanders raises few.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.middle import median, median_of_sorted

from .normal_nights import exceeded
from .segments import (
    NORMAL,
    Boundary,
    Standing,
    begins_apart,
    earlier_level,
    inner_split,
    middle_and_noise,
)
from .shifts import (
    BASE,
    CLIP,
    FEWEST_BASE,
    MANY,
    REACHED,
    SPANS,
    clusters,
    remembered,
    standard_error,
)
from .slower import FROM_NONE, LEAST, worse_by

if TYPE_CHECKING:
    from .shifts import Shift, Values

FEWEST_SPAN = min(SPANS)
WINDOW = 30  # nights that say what is usual, and that are remembered of the segments before
FEWEST = 5  # of them before noise can be told; until then only a gross change counts
FEW_NIGHTS_FLOOR = 0.5  # relative, while the noise is not known
FLOOR = 0.05  # relative; less where the noise is less than an eighth of it, of nights enough
ENOUGH = 20  # nights
CLEAR = 8.0  # noises, below the floor: the noise of few nights may be told too small
SIGMAS = 4.0
REACH = 1.25  # times the second largest deviation of nights that hold
UNSEEN = 25  # nights: of fewer, as much again may be reached by those to come
ROOM = 400  # powers of two about one: squares of so large values, summed, are doubles
CREEP = 5  # nights in each median that is compared for drift
APART_BY_CHANCE = 1.25  # times the distance of two clusters that medians of their nights may be apart
FEWEST_MOVES = 10  # for the worse, before they tell how nights move
RANGES = 2.0  # times what nights of a segment range over: none that remember each other go so far


@dataclass
class Growing:
    """The present segment while it grows."""

    places: list[int]  # of its nights that hold
    standing: Standing = "usual"
    before: list[int] = field(default_factory=list)  # the last nights of the segment before it
    where: Boundary | None = None
    size: float = 0.0  # of a red: the change when it was told
    stay: int = 0  # nights that a flaky level lasts


@dataclass(frozen=True)
class Reference:
    """What the present segment is held to: the last usual or accepted level."""

    level: float
    threshold: float
    noise: float
    last: int  # its last night
    nights: int  # that tell it


def clear_of(noise: float) -> float:
    """The relative change that stands clear of noise alone."""
    return max(FLOOR, SIGMAS * noise)


@dataclass
class PresentLevel:
    """The present segment and what is remembered of those before it."""

    values: Sequence[float]
    larger_is_better: bool
    tolerance: float
    absolute: float
    now: Growing = field(default_factory=lambda: Growing([]))
    better: bool = False  # the side on which the last nights stand clear
    remembers: list[float] = field(default_factory=list)  # relative deviations of nights before the segment
    earlier: list[float] = field(default_factory=list)  # the same, more of them, also of segments not told
    reached: list[float] = field(
        default_factory=list
    )  # the same of its own when they joined it; worse is positive
    runs: list[list[float]] = field(
        default_factory=lambda: [[]]
    )  # values since each segment was told to begin
    until: int = 0  # nights seen
    start: int = 0  # the first night there is, or the last that was accepted
    timed: Sequence[
        bool
    ] = ()  # whether each night has a time: none is infinite, and so is that of a rate of zero
    _told: tuple[float, float, float] | None = None  # what `_level` said, until a night joins or leaves
    _outer: float | None = None  # the second largest of what its own nights reached, while it is known

    def __post_init__(self) -> None:
        zero = self.larger_is_better
        self.timed = [math.isfinite(value) and not (zero and value == 0.0) for value in self.values]

    def _costs(self, places: Sequence[int]) -> list[float]:
        """Values of which larger is worse, and a change as many per cent: a rate gives the time of one."""
        if not self.larger_is_better:
            return list(map(self.values.__getitem__, places))
        return [1.0 / value if (value := self.values[i]) else math.inf for i in places]

    def _level(self) -> tuple[float, float, float]:
        """Level, noise and threshold of the present segment, by its last nights."""
        if self._told is not None:
            return self._told
        own = sorted(map(self.values.__getitem__, self.now.places[-WINDOW:]))  # distances come nearly sorted
        level = median_of_sorted(own)
        off = [abs(value / level - 1.0) for value in own] if level else [0.0]
        if len(own) < ENOUGH:
            off += map(abs, self.remembers[len(own) - WINDOW :])
        noise = NORMAL * median(off)
        self._told = level, noise, self._threshold(level, noise, len(own), len(off))
        return self._told

    def _threshold(self, level: float, noise: float, own: int, count: int) -> float:
        """The relative change that stands clear: of the noise, of what nights reached, of what is tolerated."""
        tolerated = self._tolerated(level)
        if count < FEWEST or level == 0.0:
            return max(FEW_NIGHTS_FLOOR, tolerated)
        clear = clear_of(noise)
        if own >= ENOUGH:
            clear = max(LEAST, min(clear, CLEAR * noise))
        reached = self._reached()
        if len(reached) >= 2:
            outer = self._outer if reached is self.reached else None
            if outer is None:
                outer = second_largest(reached)
            self._outer = outer if reached is self.reached else None
            clear = max(clear, REACH * (1.0 + UNSEEN / len(reached)) * outer)
        return max(clear, tolerated)

    def _strays(self) -> float:
        """The relative change that nights of the segment go beyond now and then, and others do not; infinite if none do."""
        _, noise, threshold = self._level()
        if threshold <= FLOOR:
            return math.inf
        clear = clear_of(noise)
        return clear if threshold > clear else math.inf

    def _strays_often(self, off: int) -> bool:
        """Whether nights stray, and so many of the last ones, `off` of them not joined yet, that they may be a level."""
        if self._strays() == math.inf:
            return False
        return 2 * (sum(reached > FLOOR for reached in self.reached[-max(MANY) :]) + off) >= min(MANY)

    def _last_above(self, level: float, off: Sequence[int]) -> float:
        """How far the mean of the last few nights lies above a level."""
        nights = [*self.now.places[-FEWEST_SPAN:], *off] if off else self.now.places
        last = nights[-FEWEST_SPAN:]
        mean = sum(map(self.values.__getitem__, last)) / len(last)
        return worse_by(level, mean, self.larger_is_better)

    def _reached(self) -> list[float]:
        """Deviations of nights that hold: the segment's own, filled up by those before it while it is young."""
        missing = WINDOW - len(self.reached)
        return [*self.remembers[-missing:], *self.reached] if missing > 0 else self.reached

    def _tolerated(self, level: float) -> float:
        return max(self.tolerance, self.absolute / abs(level) if self.absolute and level else 0.0)

    def _worse_by(self, level: float, value: float) -> float:
        return worse_by(level, value, self.larger_is_better)

    def _costlier_by(self, level: float, value: float) -> float:
        """The same of a time and of a rate: half the rate is twice the time, so that no fall is too deep to be told."""
        change = worse_by(level, value, self.larger_is_better)
        return way_back(-change) if self.larger_is_better else change

    def _stands_clear(self, change: float) -> bool:
        """Whether a night beyond what is usual is beyond where nights that remember each other go, too."""
        import numpy as np

        base = self._base()
        if len(base) < FEWEST_BASE or not (memory := remembered(base, self._earlier())):
            return True
        far = RANGES * float(np.max(base) - np.min(base))  # whatever they remember
        return change * median_of_sorted(np.sort(base)) > min(standard_error(base, 1, memory), far)

    def _reach_down(self, threshold: float) -> float:
        """What stands clear for the better: of where nights that hold have been."""
        reached = self._reached()
        if len(reached) < 2:
            return threshold
        return REACH * (1.0 + UNSEEN / len(reached)) * second_largest(list(map(way_back, reached)))

    def _join(self, places: Sequence[int]) -> None:
        """Nights that hold."""
        if len(self.now.places) >= FEWEST:
            level = self._level()[0]
            costlier = self._costlier_by if self.larger_is_better else self._worse_by
            self.reached += [costlier(level, self.values[i]) for i in places]
            if self._outer is not None:
                moved = [*self.reached[-len(places) :], *self.reached[:-REACHED]]
                self._outer = self._outer if max(moved) < self._outer else None
            del self.reached[:-REACHED]
        self.now.places += places
        self._told = None
        self.runs[-1] += [self.values[i] for i in places]

    def _moves(self) -> list[float]:
        """How far the sum of twenty nights lay above that of the twenty before, relatively, on the last nights.

        What lies far off the forty counts as if it lay nearer: a rare slow night would move every sum that it is in.
        """
        import numpy as np

        moves: list[float] = []
        for run in reversed(self.runs):
            near = run[len(moves) - REACHED - 2 * ENOUGH + 1 :]  # as many as give the moves that are missing
            if len(near) >= 2 * ENOUGH:
                forties = np.lib.stride_tricks.sliding_window_view(near, 2 * ENOUGH)
                middle = np.median(forties, axis=1, keepdims=True)
                far = CLIP * NORMAL * np.median(np.abs(forties - middle), axis=1, keepdims=True)
                sums = np.clip(forties, middle - far, middle + far).reshape(-1, 2, ENOUGH).sum(axis=2)
                moves += [self._worse_by(before, after) for before, after in sums.tolist()]
            if len(moves) >= REACHED:
                break
        return moves

    def _moves_by(self, found: Shift) -> float:
        """The relative change that is no step: what is tolerated, and what stands clear of how nights usually move.

        Nights that wander move by more than their noise from one to the next tells (the variance of their means does
        not fall as one over their number), which no short segment shows. By medians, so that the few steps that no rule
        told apart blind to no other, and by those for the worse alone where they are smaller: a series that became
        faster little by little did not wander. What lies off two clusters is no move between them.
        """
        moves = [] if found.apart else self._moves()
        worse = [move for move in moves if move > 0.0]
        if len(moves) < WINDOW or len(worse) < FEWEST_MOVES:
            return self._tolerated(self._level()[0])
        usual = NORMAL * min(median(worse), median([abs(move) for move in moves]))
        return max(SIGMAS * usual, self._tolerated(self._level()[0]))

    def _split_inside(self) -> None:
        """Nights of an older level leave the segment: they say nothing of its noise."""
        count = len(self.now.places)
        if count < FEWEST_BASE or count % FEWEST:
            return
        costs = self._costs(self.now.places[-BASE:])
        if inner_split(costs, 1.0) is None and not begins_apart(costs):
            return  # nearly always
        base = self._base()
        costs = base.tolist()
        split = inner_split(costs, 1.0) or earlier_level(base)
        if split is None:
            return
        import numpy as np

        low, high = base[:split], base[split:]
        memory = remembered(np.concatenate([low - low.mean(), high - high.mean()]))
        if memory and inner_split(costs, (1.0 - memory) / (1.0 + memory)) is None:
            return
        self.earlier = [*self.earlier, *(low / low.mean() - 1.0)][-REACHED:]
        nights = self.now.places
        cut = len(nights) - len(base) + split
        self.now.places = nights[cut:]
        self._reach_again()

    def _reach_again(self) -> None:
        """What the segment's nights reached, of other nights than before."""
        self._told = None
        level = self._level()[0]
        self.reached = [self._costlier_by(level, self.values[i]) for i in self.now.places[-REACHED:]]
        self._told = self._outer = None

    def _base(self) -> Values:
        """Nights of the segment; what lies far off, accidents and an older level, counts as if it lay nearer."""
        import numpy as np

        base = np.array(self._costs(self.now.places[-BASE:]))
        middle, noise = middle_and_noise(base)
        far = CLIP * noise
        return np.minimum(np.maximum(base, middle - far), middle + far) if far > 0.0 else base

    def _earlier(self) -> list[float]:
        """How far nights before those of `_base` lay off their own level, for what they remember."""
        own = self._costs(self.now.places[-REACHED:-BASE])
        level = sum(own) / len(own) if own else 0.0
        return [*self.earlier, *(value / level - 1.0 for value in own)] if level else self.earlier

    def _wanders(self) -> float:
        """How far medians of a few nights lie apart by chance: where nights remember each other, or are of two clusters.

        Of what they remember a trend of these nights is no part; of two clusters either may hold the median.
        """
        import numpy as np

        base = self._base()
        if len(base) < FEWEST_BASE:
            return 0.0
        nights = np.arange(len(base))
        level = base - np.polyval(np.polyfit(nights, base, 1), nights)
        if memory := remembered(level, self._earlier()):
            return math.sqrt(2.0) * standard_error(level, CREEP, memory)
        split = clusters(base)
        return APART_BY_CHANCE * (split[1] - split[0]) if split else 0.0

    def _chance(self, nights: Sequence[int]) -> float:
        """How probable it is that these nights lie so far off by chance: the tail of Student's t."""
        level, noise, _ = self._level()
        own, off = len(self.now.places), [self._costlier_by(level, self.values[i]) for i in nights]
        if self.better:
            off = list(map(way_back, off))
        known = min(own, WINDOW) if own >= ENOUGH else min(WINDOW, own + len(self.remembers))
        if known < FEWEST:
            noise = max(noise, FEW_NIGHTS_FLOOR / SIGMAS)
        if noise <= 0.0:
            return 0.0
        t = sum(off) / len(off) / (noise * math.sqrt(1.0 / len(off) + 1.0 / min(own, WINDOW)))
        return exceeded(min(t, 1e9), max(FEWEST, known + len(off) - 2))


def way_back(change: float) -> float:
    """What undoes a relative change: twice as fast is as far from a level as twice as slow."""
    return -change / (1.0 + change) if -1.0 < change < math.inf else math.copysign(math.inf, -change)


def second_largest(values: Sequence[float]) -> float:
    """Of two values at least."""
    place = values.index(max(values))
    return max(max(values[:place], default=-math.inf), max(values[place + 1 :], default=-math.inf))


def exponent_of(values: Sequence[float]) -> int:
    """The power of two by which values are divided so that their squares are doubles, too; zero of nearly all."""
    sizes = [size for value in values if math.isfinite(value) and (size := abs(value))]
    if not sizes or (min(sizes) > 2.0**-ROOM and max(sizes) < 2.0**ROOM):
        return 0
    return math.frexp(sorted(sizes)[len(sizes) // 2])[1]


def times_two_to(exponent: int, value: float) -> float:
    """Exact, and infinite beyond the doubles."""
    try:
        return math.ldexp(value, exponent)
    except OverflowError:
        return math.copysign(math.inf, value)


def as_usual(
    values: Sequence[float], absolute: float
) -> tuple[list[float], float, bool, Callable[[float], float]] | None:
    """Values whose squares and ratios are doubles, and a tolerance in their unit; whether signs are turned, and the way back.

    None where they are that already.
    """
    if any(value < 0.0 for value in values) and not any(value > 0.0 for value in values):
        return [-value for value in values], absolute, True, _negated
    if exponent := exponent_of(values):
        near = [times_two_to(-exponent, value) for value in values]
        return near, times_two_to(-exponent, absolute), False, partial(times_two_to, exponent)
    if least := _least_for_none(values):
        return [value or least for value in values], absolute, False, partial(_none_of, least)
    return None


def _negated(value: float) -> float:
    """Without a negative zero."""
    return 0.0 - value


def _least_for_none(values: Sequence[float]) -> float:
    """What stands for a value of 0 among positive ones, so that changes from it are as finite as others; 0: nothing has to."""
    if not any(value == 0.0 for value in values):
        return 0.0
    return min((value for value in values if value > 0.0), default=0.0) / FROM_NONE


def _none_of(least: float, value: float) -> float:
    """Back again."""
    return 0.0 if value <= least else value
