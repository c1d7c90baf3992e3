"""The recorded history as pages need it: nights in order, and for each series its values over them.

A night is one run. Series of one test stay together; the newest wording of a test is its card. Values are kept
in parallel lists, because ten years of nights are a million of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise, repeat
from operator import attrgetter
from typing import Protocol, TypeVar, overload

from spook_tracker.tracker.document.kept import Kept
from spook_tracker.tracker.document.points import Stretches, columns
from spook_tracker.tracker.document.run_document import (
    Asked,
    EngineVersion,
    FigureData,
    Machine,
    MapData,
    Run,
    Runs,
    Sample,
    SeriesDefinition,
    SeriesHistory,
    TestCard,
    Trajectory,
)
from spook_tracker.tracker.document.wording import day, short_hash, version
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.checkpoints import Checkpoints
from spook_tracker.tracker.judge.lane import histories, lines
from spook_tracker.tracker.judge.maps import ToldMap, map_key, told_maps
from spook_tracker.tracker.judge.repeats import Nights
from spook_tracker.tracker.judge.series_history import Told, judge_all
from spook_tracker.tracker.judge.standing import worst
from spook_tracker.tracker.judge.vocabulary import Class

from .earlier_nights import Earlier, earlier_nights
from .motions import Motion, kept_motions
from .topics import order_of

NIGHTS_FOR_FIGURES = 12  # how far back figures, maps and cards are looked for


@dataclass(frozen=True)
class Night:
    """One run, without its values."""

    index: int  # place in commit order
    id: str
    started: str
    finished: str
    trigger: str
    ci_address: str
    tracker_version: str
    engine: EngineVersion
    machine: Machine
    asked: Asked | None = None  # None: not known
    content: str = ""  # hash of what was measured; empty: not known
    lineage: str = ""  # as in tracker.store.versions.RunInfo

    @cached_property
    def label(self) -> str:
        """Version, commit and day in a line."""
        words = (version(self.engine), short_hash(self.engine), day(self.started))
        return " · ".join(filter(None, words))


def as_night(run: Run | None) -> Night:
    """A run of a history that was read for the website: its runs are nights."""
    if not isinstance(run, Night):
        raise TypeError(f"{run!r} is no night")
    return run


Cell = TypeVar("Cell")
_VALUE = attrgetter("value")
_OUTCOME = attrgetter("outcome")
_HELD = attrgetter("set_point_held")


class Column(Sequence[Cell]):
    """One thing that samples say, night by night, read where it is asked for."""

    __slots__ = ("_read", "_said")

    def __init__(self, said: Stretches, read: Callable[[Sample], Cell]) -> None:
        self._said, self._read = said, read

    def __len__(self) -> int:
        return len(self._said)

    @overload
    def __getitem__(self, place: int) -> Cell: ...
    @overload
    def __getitem__(self, place: slice) -> list[Cell]: ...
    def __getitem__(self, place: int | slice) -> Cell | list[Cell]:
        if isinstance(place, slice):
            return list(Column(self._said[place], self._read))
        return self._read(self._said[place][0])

    def __iter__(self) -> Iterator[Cell]:
        read = self._read
        for start, end, said in self._said.from_place(0):
            yield from repeat(read(said[0]), end - start)


@dataclass
class Trend:
    """One series over the nights, in order, each night judged."""

    told: Told
    nights: list[int]
    said: Stretches
    latest: Sample | None = None  # of the newest night that has one, with its evidence
    earlier: dict[int, Sample] = field(default_factory=dict)  # of a ladder: by index of `Chapter.earlier`
    order: int = 0  # place in its run's document

    @property
    def definition(self) -> SeriesDefinition:
        """The newest."""
        return self.told.definition

    @property
    def values(self) -> Column[float]:
        """Night by night."""
        return Column(self.said, _VALUE)

    @property
    def outcomes(self) -> Column[str]:
        """The class of each night's answer."""
        return Column(self.said, _OUTCOME)

    @property
    def held(self) -> Column[bool]:
        """Whether its set point was held."""
        return Column(self.said, _HELD)

    @cached_property
    def changes(self) -> list[tuple[int, Sample]]:
        """The places at which it begins, reads otherwise than before, or comes back after nights without it."""
        nights = self.nights
        back: list[int] = []
        if nights and nights[-1] - nights[0] != len(nights) - 1:
            back = [i for i, (one, other) in enumerate(pairwise(nights), start=1) if other != one + 1]
        found: list[tuple[int, Sample]] = []
        told = ("", "", False)
        following = 0
        known: dict[int, tuple[str, str, bool]] = {}  # what samples say, which come again and again
        for start, end, (sample, *_) in self.said.from_place(0):
            now = known.get(id(sample))
            if now is None:
                now = known[id(sample)] = repr(sample.value), sample.outcome, sample.set_point_held
            if now != told:
                found.append((start, sample))
                told = now
            while following < len(back) and back[following] < end:
                if not found or found[-1][0] != back[following]:
                    found.append((back[following], sample))
                following += 1
        return found

    @property
    def distinct(self) -> list[Sample]:
        """What it has ever said, most nights' saying the same once."""
        return [said[0] for said in {id(said): said for said in self.said.each}.values()]

    @property
    def value(self) -> float:
        """The newest value; NaN if there is none."""
        return self.values[-1] if self.values else math.nan

    @property
    def state(self) -> Class:
        """What the newest night stands for."""
        return self.state_at(-1) if self.values else "none"

    def state_at(self, place: int) -> Class:
        """What one night stands for, as the judge says."""
        nights = self.told.nights
        return nights.stands(place) if isinstance(nights, Nights) else nights[place].stands


@dataclass
class TestHistory:
    """Everything recorded about one test of the newest engine."""

    __test__ = False  # not a test class

    name: str
    card: TestCard
    trends: list[Trend]
    figures: tuple[FigureData, ...] = ()
    motions: tuple[tuple[Night, Trajectory], ...] = ()  # as recorded, newest first; see Book.motions
    maps: tuple[MapData, ...] = ()
    told_maps: tuple[ToldMap, ...] = ()  # what became of them, as the judge says

    def gates(self) -> list[Trend]:
        """The series that decide green or red."""
        return [t for t in self.trends if t.definition.role == "gate"]

    def companions(self) -> list[Trend]:
        """The scalars that keep the gates honest."""
        return [t for t in self.trends if t.definition.role == "companion" and t.definition.kind == "scalar"]

    def reported(self) -> list[Trend]:
        """Scalars that are only followed."""
        return [
            t
            for t in self.trends
            if t.definition.role in ("reported", "explaining") and t.definition.kind == "scalar"
        ]

    def of_kind(self, kind: str) -> list[Trend]:
        """Series of a kind: ladder, order, time, break_point."""
        return [t for t in self.trends if t.definition.kind == kind]

    @property
    def lost_maps(self) -> tuple[ToldMap, ...]:
        """Those that are gone, and were not given up."""
        return tuple(told for told in self.told_maps if told.stands == "fail")

    @property
    def red_maps(self) -> tuple[ToldMap, ...]:
        """Those of which the newest night tells that they are gone, or that cells became worse."""
        return tuple(told for told in self.told_maps if told.tonight and told.verdict.red)

    @property
    def state(self) -> Class:
        """The worst of its series and of maps that are gone or worse; none where nothing was judged."""
        maps = [*self.lost_maps, *self.red_maps]
        return worst([*(t.state for t in self.trends), *(told.stands for told in maps)])


@dataclass
class Chapter:
    """One engine: its nights in order, at least one, and its tests."""

    nights: list[Night]
    tests: list[TestHistory]
    earlier: list[Earlier]  # nights to lay beside tonight's ladders

    @property
    def tonight(self) -> Night:
        """The newest night."""
        return self.nights[-1]

    @property
    def name(self) -> str:
        """The engine's."""
        return self.tonight.engine.name


@dataclass
class Book(Chapter):
    """All that the website tells: the engine it is about, and beside it the others."""

    others: list[Chapter] = field(default_factory=list)

    @property
    def engines(self) -> list[Chapter]:
        """Every engine, ours first."""
        return [self, *self.others]

    @cached_property
    def motions(self) -> dict[str, tuple[Motion, ...]]:
        """By test, newest first: what can be replayed within the budget of a site."""
        return kept_motions(self.tests)

    def peers(self, test: str) -> list[tuple[str, TestHistory]]:
        """The same test put to other engines, where it ran on the machine of tonight."""
        machine = self.tonight.machine.fingerprint if self.nights else ""
        return [
            (f"{chapter.name} {version(chapter.tonight.engine)}", found)
            for chapter in self.others
            if chapter.tonight.machine.fingerprint == machine
            for found in chapter.tests
            if found.name == test
        ]


class StoredRun(Run, Protocol):
    """What a page says of a run besides."""

    @property
    def finished(self) -> str: ...
    @property
    def ci_address(self) -> str: ...
    @property
    def tracker_version(self) -> str: ...


class Records(Protocol):
    """What is read of `tracker.store.history.History`."""

    kept: Kept

    def runs(self, engine: str | None = None) -> Sequence[StoredRun]: ...
    def series(
        self, keys: Iterable[str] | None = None, *, evidence: bool = True
    ) -> Mapping[str, SeriesHistory]: ...
    def series_of(self, engine: str) -> Mapping[str, SeriesHistory]: ...
    def samples(self, run_id: str) -> Mapping[str, tuple[SeriesDefinition, Sample]]: ...
    def samples_of(
        self, run_ids: Sequence[str], tests: set[str] | None = None, keys: Iterable[str] | None = None
    ) -> Mapping[str, Mapping[str, tuple[SeriesDefinition, Sample]]]: ...
    def content(self, run_id: str) -> str: ...
    def answered(self, run_ids: Sequence[str]) -> Mapping[str, Collection[tuple[str, str]]]: ...
    def cards(self, run_id: str) -> Sequence[TestCard]: ...
    def figures(self, run_id: str) -> Sequence[FigureData]: ...
    def maps(self, run_id: str) -> Sequence[MapData]: ...
    def with_maps(self) -> Collection[str]: ...
    def trajectories(self, run_id: str) -> Sequence[Trajectory]: ...


def book(history: Records, accepted: Sequence[Accepted] = (), kept: Kept | None = None) -> Book:
    """The book of a history. The engine it is about comes first. What is `kept` of an earlier one is not made again."""
    if kept is not None:
        history.kept = kept
    runs = list(history.runs())
    if not runs:
        return Book([], [], [])
    first, *others = lines(runs)
    chapters = [_chapter(history, line, accepted) for line in others]
    return Book(*_chapter(history, first, accepted), [Chapter(*chapter) for chapter in chapters])


def chapters(history: Records) -> list[Chapter]:
    """A chapter for each engine of a history, whichever that is about."""
    runs = list(history.runs())
    return [Chapter(*_chapter(history, line, ())) for line in lines(runs)]


def _chapter(
    history: Records, runs: Sequence[StoredRun], accepted: Sequence[Accepted]
) -> tuple[list[Night], list[TestHistory], list[Earlier]]:
    """One engine's nights and tests, and the nights to lay beside tonight's ladders."""
    nights = [
        Night(
            index, run.id, run.started, run.finished, run.trigger, run.ci_address, run.tracker_version,
            run.engine, run.machine, getattr(run, "asked", None), history.content(run.id), getattr(run, "lineage", ""),
        )
        for index, run in enumerate(runs)
    ]  # fmt: skip
    trends: dict[str, Trend] = {}
    places: dict[Runs, list[int]] = {}
    known = Checkpoints(history.kept, nights)
    judged_all = judge_all(histories(history, nights), accepted, known)
    known.keep(history.kept)
    for key, told in judged_all.items():
        if not told.nights:
            continue
        judged = told.nights
        points = judged.points if isinstance(judged, Nights) else columns([one.night for one in judged])
        if points.runs not in places:
            places[points.runs] = [as_night(run).index for run in points.runs]
        trends[key] = Trend(told, places[points.runs], points.said, latest=points[-1].sample)
    _add_evidence(history, nights, trends)
    earlier = _add_earlier_ladders(history, nights, trends)
    cards: dict[str, TestCard] = {}
    figures: dict[str, list[FigureData]] = {}
    motions: dict[str, list[tuple[Night, Trajectory]]] = {}
    maps: dict[str, MapData] = {}
    documents: list[Sequence[TestCard]] = []
    for night in reversed(nights[-NIGHTS_FOR_FIGURES:]):
        figures_found = set(figures)
        documents.append(history.cards(night.id))
        for card in documents[-1]:
            cards.setdefault(card.name, card)
        for figure in history.figures(night.id):
            if figure.test not in figures_found:
                figures.setdefault(figure.test, []).append(figure)
        for motion in history.trajectories(night.id):
            motions.setdefault(motion.test, []).append((night, motion))
        for stability_map in history.maps(night.id):
            maps.setdefault(map_key(stability_map), stability_map)
    told_of_maps = told_maps(history, nights, accepted)
    for told_map in told_of_maps:
        maps.setdefault(told_map.key, told_map.newest)
    by_test: dict[str, list[Trend]] = {}
    for trend in trends.values():
        by_test.setdefault(trend.definition.test, []).append(trend)
    for test, of_test in by_test.items():
        cards.setdefault(test, _bare_card(test, of_test[0].definition.title))
    for ordered in by_test.values():
        ordered.sort(key=lambda trend: trend.order)
    tests = [
        TestHistory(
            name=test,
            card=card,
            trends=by_test.get(test, []),
            figures=tuple(figures.get(test, ())),
            motions=tuple(motions.get(test, ())),
            maps=tuple(m for m in maps.values() if m.test == test),
            told_maps=tuple(told_map for told_map in told_of_maps if told_map.newest.test == test),
        )
        for test, card in cards.items()
    ]
    place = order_of(documents)
    tests.sort(key=lambda test: (not test.card.seven, *place(test.card)))
    return nights, tests, earlier


def _bare_card(name: str, title: str) -> TestCard:
    """A test of which only values came: results of another tool, perhaps."""
    return TestCard(
        name=name, title=title or name, question="", why="", model="", parameters=(), theory=(), reference="",
        conclusion="", source="", misprints=(), seven=False, stages=(),
    )  # fmt: skip


def _add_evidence(history: Records, nights: Sequence[Night], trends: Mapping[str, Trend]) -> None:
    """The newest sample of every series in full: failure, counters, timing."""
    wanted: dict[int, list[str]] = {}
    for key, trend in trends.items():
        wanted.setdefault(trend.nights[-1], []).append(key)
    for place in sorted(wanted, reverse=True)[:NIGHTS_FOR_FIGURES]:
        samples = history.samples(nights[place].id)
        places = {key: i for i, key in enumerate(samples)}
        for key in wanted[place]:
            trends[key].order = places.get(key, len(places))
            if key in samples:
                trends[key].latest = samples[key][1]


def _add_earlier_ladders(
    history: Records, nights: Sequence[Night], trends: Mapping[str, Trend]
) -> list[Earlier]:
    """The ladders of earlier nights beside tonight's."""
    timed = {key: trend for key, trend in trends.items() if trend.definition.kind == "ladder"}
    older = sorted({index for trend in timed.values() for index in trend.nights[:-1]})
    earlier = earlier_nights(nights[-1], [nights[index] for index in older])
    samples = history.samples_of([nights[one.index].id for one in earlier], keys=timed)
    for one in earlier:
        of_night = samples[nights[one.index].id]
        for key, trend in timed.items():
            if key in of_night and one.index in trend.nights[:-1]:
                trend.earlier[one.index] = of_night[key][1]
    return earlier
