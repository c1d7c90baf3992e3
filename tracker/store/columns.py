"""What the runs of an engine said, series by series, in stretches of runs that said the same: read once, and kept.

The runs stand in the order of the history. Those that are kept count as far as they are the first of today's, each with
the content that it had: one more night is read by itself, and of a run that came late or went, what comes after it is.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from collections.abc import Iterable, Sequence

import msgspec

from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.run_document import OutcomeClass

from .reader import Row

SampleRow = tuple[
    int, float | None, str | None, OutcomeClass, bool | int, bool | int
]  # a row of `sample` without its run and its series


class Column:
    """One series: where each stretch begins and ends among the runs, and the place of what it says."""

    __slots__ = ("begins", "codes", "ends")

    def __init__(self, begins: bytes = b"", ends: bytes = b"", codes: bytes = b"") -> None:
        self.begins, self.ends, self.codes = (array("i", part) for part in (begins, ends, codes))

    def add(self, place: int, code: int) -> None:
        """What is said by one more run."""
        if self.ends and self.ends[-1] == place and self.codes[-1] == code:
            self.ends[-1] = place + 1
        else:
            self.begins.append(place)
            self.ends.append(place + 1)
            self.codes.append(code)

    def cut(self, length: int) -> None:
        """Leave so many runs."""
        number = bisect_left(self.begins, length)
        for part in (self.begins, self.ends, self.codes):
            del part[number:]
        if self.ends and self.ends[-1] > length:
            self.ends[-1] = length

    def covered(self) -> list[tuple[int, int]]:
        """The runs that it has, as ranges of places."""
        if self.ends[-1] - self.begins[0] == sum(self.ends) - sum(self.begins):
            return [(self.begins[0], self.ends[-1])]
        found: list[tuple[int, int]] = []
        for begin, end in zip(self.begins, self.ends, strict=True):
            if found and found[-1][1] == begin:
                found[-1] = found[-1][0], end
            else:
                found.append((begin, end))
        return found


class _Stored(msgspec.Struct, frozen=True, array_like=True):
    runs: list[tuple[int, str]]
    told: list[SampleRow]
    series: dict[int, tuple[bytes, bytes, bytes]]


class Lane:
    """All series over the runs of one engine, of which `runs` says key and content."""

    def __init__(self, name: str, runs: Sequence[tuple[int, str]], kept: Kept) -> None:
        self.name, self.runs = name, runs
        self.told: dict[SampleRow, int] = {}
        self.series: dict[int, Column] = {}
        self.known = 0  # runs that need not be read
        if (stored := kept.get(f"values/{name}", _Stored)) is not None:
            self._take(stored)

    def _take(self, stored: _Stored) -> None:
        for one, other in zip(stored.runs, self.runs, strict=False):
            if one != other or not one[1]:
                break
            self.known += 1
        self.told = {told: code for code, told in enumerate(stored.told)}
        self.series = {series_id: Column(*parts) for series_id, parts in stored.series.items()}
        if self.known < len(stored.runs):
            for column in self.series.values():
                column.cut(self.known)
            self.series = {series_id: column for series_id, column in self.series.items() if column.ends}

    def add(self, place: int, rows: Iterable[Row]) -> None:
        """The samples of the run at a place: series, and what is said."""
        told, series = self.told, self.series
        for series_id, *said in rows:
            code = told.setdefault(tuple(said), len(told))
            column = series.get(series_id)
            if column is None:
                column = series[series_id] = Column()
            column.add(place, code)

    def keep(self, kept: Kept) -> None:
        """For the next time."""
        series = {
            series_id: (column.begins.tobytes(), column.ends.tobytes(), column.codes.tobytes())
            for series_id, column in self.series.items()
        }
        kept.put(f"values/{self.name}", _Stored(list(self.runs), list(self.told), series))


def together(columns: Sequence[Column], wins: Sequence[bool]) -> Column:
    """One series of several that were one all along: where two have a run, the one that wins, else the first."""
    chosen: dict[int, tuple[bool, int]] = {}
    for column, first in zip(columns, wins, strict=True):
        for begin, end, code in zip(column.begins, column.ends, column.codes, strict=True):
            for place in range(begin, end):
                if place not in chosen or (first and not chosen[place][0]):
                    chosen[place] = first, code
    found = Column()
    for place in sorted(chosen):
        found.add(place, chosen[place][1])
    return found
