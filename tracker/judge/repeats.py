"""The judged nights of a series, of which those that repeat the night before to the bit need no object of their own.

Most series stand still most nights: ten million nights with a verdict each would take gigabytes, and say nothing.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import overload

from spook_tracker.tracker.document.points import Points
from spook_tracker.tracker.judge.judged import Judged
from spook_tracker.tracker.judge.verdict import Verdict
from spook_tracker.tracker.judge.vocabulary import Class

IDENTICAL = Verdict(word="identical", sentence="the same bits", ulps=0)


class Nights(Sequence[Judged]):
    """A verdict for each point. `told` are those by their place that do not repeat; the first night is among them."""

    __slots__ = ("_places", "points", "told")

    def __init__(self, points: Points, told: Mapping[int, Judged]) -> None:
        self.points, self.told = points, told
        self._places = sorted(told)

    def __len__(self) -> int:
        return len(self.points)

    @overload
    def __getitem__(self, place: int) -> Judged: ...
    @overload
    def __getitem__(self, place: slice) -> list[Judged]: ...
    def __getitem__(self, place: int | slice) -> Judged | list[Judged]:
        if isinstance(place, slice):
            return [self[i] for i in range(*place.indices(len(self)))]
        i = range(len(self))[place]
        found = self.told.get(i)
        return self._repeated(i) if found is None else found

    def __iter__(self) -> Iterator[Judged]:
        return map(self.__getitem__, range(len(self)))

    def stands(self, place: int) -> Class:
        """What a night stands for."""
        i = range(len(self))[place]
        return self.told[self._places[bisect_right(self._places, i) - 1]].stands

    def looked_at(self) -> list[Judged]:
        """Those that do not repeat the night before, oldest first."""
        return [self.told[i] for i in self._places]

    def changed(self, change: Callable[[Judged], Judged]) -> Nights:
        """The same, each night that does not repeat given to a function."""
        return Nights(self.points, {i: change(judged) for i, judged in self.told.items()})

    def _repeated(self, i: int) -> Judged:
        points = self.points
        return Judged(
            night=points[i],
            verdict=IDENTICAL,
            state="green",
            stands=self.stands(i),
            against=points[i - 1],
        )


def looked_at(nights: Sequence[Judged]) -> Sequence[Judged]:
    """The nights without those that are known to repeat the night before: no red one is left out."""
    return nights.looked_at() if isinstance(nights, Nights) else nights
