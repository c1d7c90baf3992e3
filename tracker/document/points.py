"""The nights of a series as columns: what it said in stretches of nights that said the same."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, repeat
from operator import sub
from typing import overload

from .run_document import Point, Runs, Said, Sample, SeriesDefinition


class Stretches(Sequence[Said]):
    """What a series said, night by night, kept as stretches of nights that say the same: `each` has what is said in each of
    them, `ends` the place after its last night. Most series stand still: ten million nights are some hundred thousand."""

    __slots__ = ("each", "ends")

    def __init__(self, each: Sequence[Said], ends: Sequence[int]) -> None:
        self.each, self.ends = each, ends

    @classmethod
    def of(cls, said: Iterable[Said]) -> Stretches:
        """Of what is said night by night; nights that say the same share one object."""
        each: list[Said] = []
        ends: list[int] = []
        place = 0
        for place, now in enumerate(said, start=1):
            if each and each[-1] is now:
                ends[-1] = place
            else:
                each.append(now)
                ends.append(place)
        return cls(each, ends)

    def __len__(self) -> int:
        return self.ends[-1] if self.ends else 0

    @overload
    def __getitem__(self, place: int) -> Said: ...
    @overload
    def __getitem__(self, place: slice) -> Stretches: ...
    def __getitem__(self, place: int | slice) -> Said | Stretches:
        if isinstance(place, slice):
            start, end, step = place.indices(len(self))
            if step != 1:
                return Stretches.of(self[i] for i in range(start, end, step))
            found = [(until, said) for _, until, said in self.from_place(start, end)]
            return Stretches([said for _, said in found], [until - start for until, _ in found])
        return self.each[bisect_right(self.ends, range(len(self))[place])]

    def __iter__(self) -> Iterator[Said]:
        lengths = map(sub, self.ends, chain((0,), self.ends))
        return chain.from_iterable(map(repeat, self.each, lengths))

    def from_place(self, start: int, end: int | None = None) -> Iterator[tuple[int, int, Said]]:
        """The stretches from a place on, up to another: first place, the place after the last, what is said."""
        last = len(self) if end is None else end
        for number in range(bisect_right(self.ends, start), len(self.ends)):
            if start >= last:
                return
            until = min(self.ends[number], last)
            yield start, until, self.each[number]
            start = until


class Evidence:
    """The samples with all that stands behind them, of the nights that were read so: their `places` among a series' nights,
    ascending, and by night the samples of all series, which these share."""

    __slots__ = ("key", "measured", "places")

    def __init__(
        self,
        key: str,
        places: Sequence[int],
        measured: Sequence[Mapping[str, tuple[SeriesDefinition, Sample]]],
    ) -> None:
        self.key, self.places, self.measured = key, places, measured

    def number(self, number: int) -> Said | None:
        """What the series said in one of these nights; None where it was not measured."""
        found = self.measured[number].get(self.key)
        return None if found is None else (found[1], found[0].test_version, True)

    def at(self, place: int) -> Said | None:
        """The same at a place."""
        number = bisect_left(self.places, place)
        return self.number(number) if self.places[number : number + 1] == [place] else None


class Points(Sequence[Point]):
    """Points as two columns: `runs`, which series that were measured in the same runs share, and `said`; a point is made
    when it is asked for. What `evidence` has of a night stands for what is said in it: the same, and more."""

    __slots__ = ("evidence", "runs", "said")

    def __init__(self, runs: Runs, said: Sequence[Said], evidence: Evidence | None = None) -> None:
        self.runs, self.evidence = runs, evidence
        self.said = said if isinstance(said, Stretches) else Stretches.of(said)

    def __len__(self) -> int:
        return len(self.said)

    @overload
    def __getitem__(self, place: int) -> Point: ...
    @overload
    def __getitem__(self, place: slice) -> Points: ...
    def __getitem__(self, place: int | slice) -> Point | Points:
        if isinstance(place, slice):
            here = range(len(self))[place]
            return Points(Runs(self.runs[place]), list(map(self._said_at, here)))
        return Point(self.runs[place], *self._said_at(range(len(self))[place]))

    def __iter__(self) -> Iterator[Point]:
        for start, end, said in self.stretches():
            for run in self.runs[start:end]:
                yield Point(run, *said)

    def stretches(self, start: int = 0) -> Iterator[tuple[int, int, Said]]:
        """The stretches from a place on, a night of which there is evidence by itself: as `Stretches.from_place`."""
        if self.evidence is None:
            yield from self.said.from_place(start)
            return
        places, number = self.evidence.places, self.evidence.number
        following = bisect_left(places, start)
        for begin, end, said in self.said.from_place(start):
            while following < len(places) and places[following] < end:
                place, own = places[following], number(following)
                following += 1
                if own is None:
                    continue
                if begin < place:
                    yield begin, place, said
                yield place, place + 1, own
                begin = place + 1
            if begin < end:
                yield begin, end, said

    def timed(self) -> bool:
        """Whether any of them has a run time."""
        return any(sample.timing for _, _, (sample, *_) in self.stretches())

    def _said_at(self, place: int) -> Said:
        own = None if self.evidence is None else self.evidence.at(place)
        return self.said[place] if own is None else own


def columns(points: Sequence[Point]) -> Points:
    """The same points as columns."""
    if isinstance(points, Points):
        return points
    return Points(
        Runs(point.run for point in points),
        [(point.sample, point.test_version, point.recorded) for point in points],
    )
