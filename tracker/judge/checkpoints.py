"""Where the judge of values stood some months of nights ago, so that one more night costs what a night costs.

Kept for a series that was green all the way to that night, and had settled: what is known of it then is three nights and
a class. It counts where all that the judge has read up to there is as it was: the runs of the line, the definition, what is
accepted, each value. Whatever else becomes of a series, all of it is judged again.
"""

from __future__ import annotations

import hashlib
from array import array
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence

import msgspec

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.points import Points
from spook_tracker.tracker.document.run_document import Point, Run, Runs, Said

from . import lane
from .exact_values import KnownValue, Series, judge_on
from .judged import Judged
from .lane import asked_whole, settled_nights
from .repeats import Earlier, Nights
from .vocabulary import Class

LATE = 144  # nights that are always judged again: more than any page shows one by one
STEP = 64  # nights by which the checkpoint moves at once
Whole = Callable[
    [int], tuple[dict[int, Judged], KnownValue | None]
]  # all nights, and the state before a place


class Checkpoint(msgspec.Struct, frozen=True, array_like=True):
    """What is known before a night of a series: `place` is that night's."""

    made_from: bytes
    place: int
    level: int
    release: int
    settled: int
    stands: Class
    recent: list[tuple[int, Class]]  # the last nights before it that did not repeat, and what they stand for


class _Stored(msgspec.Struct, frozen=True, array_like=True):
    line: bytes  # of the runs that follow
    upto: int
    series: dict[str, Checkpoint]


class Checkpoints:
    """Of the series over a line of runs."""

    def __init__(self, kept: Kept, line: Sequence[Run]) -> None:
        self._name = f"judged/{line[-1].engine.name}"
        self._place = {run.id: place for place, run in enumerate(line)}
        self._facts: list[bytes] = []
        for run in line:
            if not (content := getattr(run, "content", "")):
                break  # of this one and all later ones nothing can be kept
            self._facts.append(_digest(_facts(run, content)))
        self._upto = min(len(self._facts), max(0, len(line) - LATE)) // STEP * STEP
        self._stored: Mapping[str, Checkpoint] = {}
        self._new: dict[str, Checkpoint] = {}
        self._said: dict[int, bytes] = {}
        self._indices: dict[Runs, array[int]] = {}
        stored = kept.get(self._name, _Stored)
        settled = min(settled_nights(len(line), lane.RECENT), len(self._facts))
        if stored is not None and stored.upto <= settled and stored.line == self._line(stored.upto):
            self._stored = stored.series

    def keep(self, kept: Kept) -> None:
        """For the next time."""
        if self._new:
            kept.put(self._name, _Stored(self._line(self._upto), self._upto, self._new))

    def judged(self, series: Series, points: Points, whole: Whole) -> Nights:
        """Every night's verdict, from the last checkpoint on, or by `whole`."""
        mark = bisect_left(self._indices_of(points.runs), self._upto)
        before = self._stored.get(series.key)
        if before is None or not self._holds(before, series, points):
            told, state = whole(mark)
            early = [(place, judged) for place, judged in told.items() if place < mark]
            if state is not None and all(judged.state == "green" for _, judged in early):
                self._put(
                    series, points, mark, state, [(place, judged.stands) for place, judged in sorted(early)]
                )
            return Nights(points, told)
        state = KnownValue(
            "calm", points[before.level], points[before.release], points[before.settled], before.stands
        )
        recent, told = list(before.recent), {}
        if mark > before.place:
            state, told = judge_on(series, points, state, before.place, mark)
            if all(judged.state == "green" for judged in told.values()):
                stood = recent + [(place, judged.stands) for place, judged in told.items()]
                self._put(series, points, mark, state, stood)
        elif mark == before.place:
            self._new[series.key] = before
        _, later = judge_on(series, points, state, max(mark, before.place), len(points))
        return Nights(points, told | later, Earlier(before.place, recent, lambda: whole(0)[0]))

    def _holds(self, before: Checkpoint, series: Series, points: Points) -> bool:
        """Whether nothing that was read up to a checkpoint has changed, and all that follows is of the same lane."""
        if not before.place <= len(points) or before.made_from != self._made_from(
            series, points, before.place
        ):
            return False
        last = points[before.place - 1]
        floats = last.run.machine.float_environment
        return all(run.machine.float_environment == floats for run in points.runs[before.place :]) and all(
            version == last.test_version for _, _, (_, version, _) in points.said.from_place(before.place)
        )

    def _put(
        self, series: Series, points: Points, mark: int, state: KnownValue, stood: list[tuple[int, Class]]
    ) -> None:
        s = state
        settled = s.name == "calm" and not s.gone and s.lent is None and s.failing is None
        if mark == 0 or not settled or not stood or s.level is None or s.release is None or s.settled is None:
            return
        first = max(0, bisect_left(stood, mark - LATE, key=lambda one: one[0]) - 1)
        self._new[series.key] = Checkpoint(
            self._made_from(series, points, mark),
            mark,
            self._place_in(points, s.level),
            self._place_in(points, s.release),
            self._place_in(points, s.settled),
            s.stands,
            stood[first:],
        )

    def _made_from(self, series: Series, points: Points, place: int) -> bytes:
        """All that is read of the nights before a place; that of the line is looked at once for all series."""
        known = self._said
        found = hashlib.blake2b(encode((series.definition, repr(series.accepted))), digest_size=16)
        found.update(self._indices_of(points.runs)[:place].tobytes())
        count = bisect_left(points.said.ends, place) + 1  # stretches, the last of them perhaps in part
        each, ends = points.said.each[:count], array("i", points.said.ends[:count])
        ends[-1] = place
        for said in {id(said): said for said in each if id(said) not in known}.values():
            known[id(said)] = _said_digest(said)
        found.update(b"".join([known[id(said)] for said in each]))
        found.update(ends.tobytes())
        return found.digest()

    def _indices_of(self, runs: Runs) -> array[int]:
        """The places of these runs in the line."""
        if runs not in self._indices:
            self._indices[runs] = array("i", [self._place[run.id] for run in runs])
        return self._indices[runs]

    def _place_in(self, points: Points, point: Point) -> int:
        return bisect_left(self._indices_of(points.runs), self._place[point.run.id])

    def _line(self, upto: int) -> bytes:
        return _digest(b"".join(self._facts[:upto]))


def _facts(run: Run, content: str) -> bytes:
    """All that the judge may read of a run."""
    whole = asked_whole(run)
    return encode((run.id, run.started, run.trigger, run.engine, run.machine, run.asked, whole, content))


def _said_digest(said: Said) -> bytes:
    return _digest(encode(said))


def _digest(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=8).digest()
