"""Levels that a machine goes to and leaves again: from the third visit on, one no longer than those before is no news.

A red stretch that ended by itself is a visit, and so are stretches that never were red, in the noise: those are found
in the values themselves. Changes are relative, and for the worse.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from spook_tracker.tracker.document.middle import median, quartile
from spook_tracker.tracker.judge.slower import LEAST

VISITS = 2  # to a level, before it is known as one of the machine's
LONGER = 2  # times its longest visit, and it is no visit any more
STRAYS = 2  # nights of a visit so far above its level that it is another
REMEMBERED = 400  # nights in which visits are looked for
NEAR = 0.15  # of its distance: so near to a level is at it
QUARTER = 2.22  # standard deviations in the lower quartile of the differences from night to night


@dataclass
class Visited:
    """A level that was left again: how often, how far off, and for how long at most."""

    change: float
    times: int
    longest: int


@dataclass
class Visits:
    """The levels that are known, and the visit that lasts. `size_of` says how far some nights lie off, in the middle."""

    size_of: Callable[[Sequence[int]], float]
    noise: Callable[[], float]  # the relative change that may be noise about a level
    levels: list[Visited] = field(default_factory=list)
    staying: list[int] = field(default_factory=list)  # nights in a row at a level that was visited before
    strayed: int = 0  # how many of them lie above it

    def known(self, change: float, nights: int = 1) -> Visited | None:
        """The level that so many nights lie so far off at in the middle; halfway to it is enough to stay there."""
        for level in self.levels:
            if level.times >= VISITS and change > 0.5 * level.change:
                noise = self.noise()
                near = abs(change - level.change) <= max(LEAST, noise / math.sqrt(nights))
                if near or (self.staying and change < 1.5 * level.change + 0.5 * noise):
                    return level
        return None

    def takes(self, place: int, change: float, threshold: float) -> tuple[bool, list[int]]:
        """Whether the night is part of a visit; and if a visit turns out to be none, the nights it seemed to last."""
        known = self.known(change)
        stays = known is not None and (bool(self.staying) or change > threshold)
        if not stays and self._strays(change):
            self.strayed += 1
            if self.strayed < STRAYS:
                self.staying.append(place)
                return True, []
            return False, self.end()
        if known is None or not stays:
            self.left(change)
            return False, []
        self.staying.append(place)
        if len(self.staying) <= LONGER * known.longest:
            return True, []
        self.levels.remove(known)
        return False, self.end()[:-1]

    def left(self, change: float, counts: bool = True) -> None:
        """A visit that ended by itself, by a night so far off, tells more of its level where it counts."""
        nights = self.end()
        known = self.known(self.size_of(nights), len(nights)) if nights else None
        if known is not None and counts and change < 0.5 * known.change:
            known.change += (self.size_of(nights) - known.change) / (known.times + 1)
            known.times += 1
            known.longest = max(known.longest, len(nights))

    def above_the_nearest(self, change: float) -> float:
        """How far a night that lies so far off is above the level it is nearest to, the usual one among them."""
        return min((change - level for level in (0.0, *(known.change for known in self.levels))), key=abs)

    def add(self, change: float, nights: int) -> None:
        """A red stretch that ended by itself."""
        for known in self.levels:
            if abs(change - known.change) <= self.noise():
                known.times += 1
                known.longest = max(known.longest, nights)
                return
        self.levels.append(Visited(change, 1, nights))

    def begin(self, nights: list[int], level: Visited | None = None) -> None:
        """A visit of these nights, to a level that may not have been known."""
        self.levels += [] if level is None else [level]
        self.staying = nights

    def end(self) -> list[int]:
        """The nights of a visit that is over, or was none."""
        nights, self.staying, self.strayed = self.staying, [], 0
        return nights

    def _strays(self, change: float) -> bool:
        """Whether a night of a visit lies above the level that is visited: one is noise, two are another level."""
        return bool(self.staying) and math.isfinite(change) and change > self.size_of(self.staying)


def left_before(cost: Sequence[float], here: float, level: float, span: int) -> Visited | None:
    """The level `here`, the mean of `span` nights, if earlier ones reached it and left it again, twice at least.

    `cost` are all nights before these, of which larger is worse, `level` what is usual.
    """
    import numpy as np

    values = np.array(cost[-REMEMBERED:])
    values = values[np.isfinite(values)]
    if len(values) < 2 * span:
        return None
    level = min(quartile(values.tolist()), level)
    short = max(steadiness(values.tolist()) / math.sqrt(span), NEAR * (here - level))
    times, longest, since = 0, 0, -1
    for place, mean in enumerate(np.convolve(values, np.full(span, 1.0 / span), "valid")):
        if since < 0 and mean >= here - short:
            since = place
        elif since >= 0 and mean < 0.5 * (here + level):
            times, longest, since = times + 1, max(longest, place - since + span // 2), -1
    return Visited(here / level - 1.0, times, longest) if times >= VISITS else None


def steadiness(values: Sequence[float]) -> float:
    """The standard deviation about a level, whatever levels there are.

    Most nights are at the level of the night before: of their differences the lower quartile is noise alone.
    """
    steps = sorted(abs(after - before) for before, after in itertools.pairwise(values))
    return QUARTER * median(steps[: (len(steps) + 1) // 2])
