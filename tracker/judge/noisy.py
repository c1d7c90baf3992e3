"""What is said of a night of a noisy series."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .slower import Usual
from .verdict import Verdict
from .vocabulary import State


class Noisy(NamedTuple):
    """One night's verdict; `against`, `first_bad`, `last_good`, `worse_at` and `accused` are places in the sequence."""

    verdict: Verdict
    state: State
    against: int | None = None
    first_bad: int | None = None
    last_good: int | None = None
    worse_at: int | None = None  # where it last became worse: the first bad night, or a later segment's
    news: bool = False  # red for a segment that is told tonight
    accused: tuple[int, int] | None = None  # last surely good, first surely bad
    probability: float | None = None  # that `worse_at` is right
    levels: tuple[float, float] | None = None  # what the percentage is of: before, now
    usual: Usual | None = None  # after this night: the level that is held to, and what stands clear of it

    def scaled(self, back: Callable[[float], float]) -> Noisy:
        usual = self.usual and (back(self.usual[0]), self.usual[1])
        return self._replace(levels=self.levels and (back(self.levels[0]), back(self.levels[1])), usual=usual)
