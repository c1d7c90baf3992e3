"""The judged nights of a series, of which those that repeat the night before to the bit need no object of their own.

Most series stand still most nights: ten million nights with a verdict each would take gigabytes, and say nothing.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, overload

from spook_tracker.tracker.document.points import Points

from .judged import Judged
from .verdict import Verdict
from .vocabulary import Class, State

IDENTICAL = Verdict(word="identical", sentence="the same bits", ulps=0)


EARLIER = Verdict(word="same", sentence="green that night")


class Earlier(NamedTuple):
    """The nights before a place, all of them green and not judged again until their verdicts are asked for."""

    end: int
    recent: Sequence[tuple[int, Class]]  # the last of them that do not repeat, and what they stand for
    tell: Callable[
        [], Mapping[int, Judged]
    ]  # the verdicts of all that do not repeat, of these nights and the later


class Nights(Sequence[Judged]):
    """A verdict for each point. `told` are those by their place that do not repeat; the first night is among them."""

    __slots__ = ("_earlier", "_places", "_told", "points")

    def __init__(self, points: Points, told: Mapping[int, Judged], earlier: Earlier | None = None) -> None:
        self.points, self._told, self._earlier = points, told, earlier
        self._places = sorted(told)

    @property
    def told(self) -> Mapping[int, Judged]:
        """The verdicts of the nights that do not repeat, by place."""
        if self._earlier is not None:
            self._told = self._earlier.tell()
            self._earlier, self._places = None, sorted(self._told)
        return self._told

    @property
    def resumed(self) -> bool:
        """Whether the early ones have not been judged again."""
        return self._earlier is not None

    def states(self) -> set[State]:
        """What the nights are."""
        found = {judged.state for judged in self._told.values()}
        return found | {"green"} if self._earlier is not None else found

    def state_at(self, place: int) -> Judged:
        """A night, of the early ones that were all green no more than that."""
        if self._earlier is not None and place < self._earlier.end:
            return Judged(night=self.points[place], verdict=EARLIER, state="green", stands="none")
        return self[place]

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
        told = self._told if self._earlier is not None and i >= self._earlier.end else self.told
        found = told.get(i)
        return self._repeated(i) if found is None else found

    def __iter__(self) -> Iterator[Judged]:
        return map(self.__getitem__, range(len(self)))

    def stands(self, place: int) -> Class:
        """What a night stands for."""
        i = range(len(self))[place]
        if self._earlier is not None and (not self._places or i < self._places[0]):
            number = bisect_right(self._earlier.recent, i, key=_place)
            if number:
                return self._earlier.recent[number - 1][1]
        told = (
            self._told if self._earlier is not None and self._places and i >= self._places[0] else self.told
        )
        return told[self._places[bisect_right(self._places, i) - 1]].stands

    def looked_at(self) -> list[Judged]:
        """Those that do not repeat the night before, oldest first."""
        told = self.told
        return [told[i] for i in self._places]

    def changed(self, change: Callable[[Judged], Judged]) -> Nights:
        """The same, each night that does not repeat given to a function; what it stands for, and that it is green, stays."""

        def changed(told: Mapping[int, Judged]) -> dict[int, Judged]:
            return {i: change(judged) for i, judged in told.items()}

        earlier = self._earlier
        if earlier is not None:
            tell = earlier.tell
            earlier = earlier._replace(tell=lambda: changed(tell()))
        return Nights(self.points, changed(self._told), earlier)

    def _repeated(self, i: int) -> Judged:
        points = self.points
        return Judged(
            night=points[i],
            verdict=IDENTICAL,
            state="green",
            stands=self.stands(i),
            against=points[i - 1],
        )


def _place(one: tuple[int, Class]) -> int:
    return one[0]


def states_of(nights: Sequence[Judged]) -> set[State]:
    """What some nights are."""
    return nights.states() if isinstance(nights, Nights) else {judged.state for judged in nights}


def looked_at(nights: Sequence[Judged]) -> Sequence[Judged]:
    """The nights without those that are known to repeat the night before: no red one is left out."""
    return nights.looked_at() if isinstance(nights, Nights) else nights
