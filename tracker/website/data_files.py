"""The numbers behind the pages as files: CSV for a spreadsheet, JSON for a program.

Numbers keep every digit. Text that a spreadsheet would read as a formula is given an apostrophe; the JSON holds
the text as it was recorded.
"""

from __future__ import annotations

import csv
import io
import json
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain, groupby
from typing import TYPE_CHECKING

import msgspec
from msgspec import structs

from spook_tracker.tracker.document.json_form import boxed, encode
from spook_tracker.tracker.document.outside import escaped
from spook_tracker.tracker.document.run_document import SeriesDefinition

from .events import Event
from .nights import Book, Night, TestHistory, Trend

if TYPE_CHECKING:
    from spook_tracker.tracker.document.json_form import Writable

Cell = str | float | int | None  # of a table
FORMULA = ("=", "+", "-", "@", "\t", "\r")
COLUMNS = (
    "test", "configuration", "metric", "time_step_s", "parameters", "role", "kind", "value", "unit", "outcome",
    "limit_low", "limit_high", "set_point_low", "set_point_high", "set_point_held", "seconds", "spread",
    "instructions", "operations", "state_hash", "started", "failure",
)  # fmt: skip


def inert(cell: Cell) -> Cell:
    """A cell no spreadsheet takes for a formula; numbers are left alone, None is empty."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, str):
        text = cell.replace("\x00", "\N{REPLACEMENT CHARACTER}")
        return f"'{text}" if text.startswith(FORMULA) else text
    return cell


class _Inert(dict[str, Cell]):
    """Texts as cells, as the same ones stand night after night; what is no text `csv` writes as `inert` does."""

    def __missing__(self, text: str) -> Cell:
        self[text] = cell = inert(text)
        return cell


def table(columns: Sequence[str], lines: Iterable[Sequence[Cell]]) -> bytes:
    """A CSV file in UTF-8, lines ended as RFC 4180 says."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow([inert(name) for name in columns])
    known = _Inert()
    writer.writerows([[known[cell] if type(cell) is str else cell for cell in line] for line in lines])
    return out.getvalue().encode("utf-8", "replace")


def records(columns: Sequence[str], lines: Iterable[Sequence[Cell]]) -> bytes:
    """The same table as JSON: a list of objects, non-finite numbers as strings."""
    found = [
        {
            name: boxed(cell) if isinstance(cell, float) else cell
            for name, cell in zip(columns, line, strict=True)
        }
        for line in lines
    ]
    return json.dumps(found, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()


Table = tuple[Sequence[str], list[list[Cell]]]  # names of the columns, lines


def newest(book: Book, tests: Sequence[TestHistory]) -> Table:
    """Every series of some tests at its newest night, a line each; work stands in a file of its own."""
    return COLUMNS, [
        _line(trend, book.nights)
        for test in tests
        for trend in test.trends
        if trend.definition.kind != "work"
    ]


def work(book: Book) -> Table:
    """Operations and iterations counted, of every configuration of every test and each part of a night (values, ladders,
    stability): a line for the first night, and one for each that changed any of them or counts one no more; a column for
    each kind."""
    groups: dict[tuple[str, str, str], dict[str, Trend]] = {}
    for test in book.tests:
        for t in test.trends:
            if t.definition.kind == "work":
                # as judge/work.py names them; a document from outside may hold any name
                part, _, kind = t.definition.metric.removeprefix("work:").partition(":")
                groups.setdefault((test.name, t.definition.configuration, part), {})[kind or "count"] = t
    kinds = sorted({kind for counted in groups.values() for kind in counted})
    lines: list[list[Cell]] = []
    for group, counted in groups.items():
        told = {t.nights[i] for t in counted.values() for i, _ in t.changes}
        for night in sorted(told | _without_one(list(counted.values()))):
            counts = {kind: _counted(t, night) for kind, t in counted.items()}
            lines.append([*group, book.nights[night].started, *map(counts.get, kinds)])
    return ("test", "configuration", "part", "since", *kinds), lines


def _without_one(counted: Sequence[Trend]) -> set[int]:
    """The nights on which one of them is not there any more, and another is."""
    if len({tuple(t.nights) for t in counted}) < 2:
        return set()
    ended = {night + 1 for t in counted for night in set(t.nights) - {night - 1 for night in t.nights}}
    return ended & {night for t in counted for night in t.nights}


def _counted(trend: Trend, night: int) -> Cell:
    place = bisect_left(trend.nights, night)
    if trend.nights[place : place + 1] != [night]:
        return None
    value = trend.said[place][0].value
    return int(value) if value.is_integer() else value


def _line(trend: Trend, nights: Sequence[Night]) -> list[Cell]:
    d, sample, night = trend.definition, trend.latest, nights[trend.nights[-1]]
    low, high = ends(d.limit, d.better)
    timing = sample.timing if sample else None
    quickest = min(timing.seconds) if timing and timing.seconds else None
    return [
        d.test, d.configuration, d.metric, d.time_step,
        " ".join(f"{key}={value:g}" for key, value in sorted(d.parameters.items())), d.role, d.kind,
        trend.value, d.unit, trend.outcomes[-1], low, high, *(d.set_point or (None, None)),
        trend.held[-1], quickest, max(timing.seconds) if timing and timing.seconds else None,
        timing.instructions if timing else None, sum(sample.counters.values()) if sample else None,
        sample.state_hash if sample else "", night.started, sample.failure if sample else "",
    ]  # fmt: skip


def ends(limit: float | tuple[float, float] | None, better: str) -> tuple[float | None, float | None]:
    """The limit as its two ends; None where there is none."""
    if limit is None:
        return None, None
    if isinstance(limit, tuple):
        return limit
    if better == "larger":
        return limit, None
    return (None, limit) if better == "smaller" else (-limit, limit)


CHANGES = (
    "test", "configuration", "metric", "time_step_s", "parameters", "role", "kind", "unit",
    "limit_low", "limit_high", "set_point_low", "set_point_high", "value", "outcome", "set_point_held",
    "since", "version", "git_hash",
)  # fmt: skip


def changes_csv(test: TestHistory, texts: NightTexts) -> bytes:
    """Every series of a test but run times: a line for its first night, and one for each that changed it.

    A night without a change leaves the file as it is.
    """
    lines = chain.from_iterable(_changes(trend, texts) for trend in steady(test))
    return b"".join((table(CHANGES, ()), "".join(lines).encode("utf-8", "replace")))


def steady(test: TestHistory) -> list[Trend]:
    """The values of a test that the same engine answers alike every night: no run times; work has its own file."""
    return [trend for trend in test.trends if trend.definition.kind not in ("time", "work")]


class NightTexts:
    """What files say of a night, written once: thousands of lines name the same, and most nights are in none."""

    def __init__(self, nights: Sequence[Night]) -> None:
        self._nights = nights
        self._cells: dict[int, str] = {}
        self._fields: dict[int, tuple[str, msgspec.Raw]] = {}

    def cells(self, place: int) -> str:
        """The last cells of a line of a CSV file, with its end."""
        if place not in self._cells:
            night = self._nights[place]
            told = _written(night.started, night.engine.version, night.engine.git_hash)
            self._cells[place] = f"{told}\r\n"
        return self._cells[place]

    def fields(self, place: int) -> tuple[str, msgspec.Raw]:
        """Its id, and fields in JSON."""
        if place not in self._fields:
            night = self._nights[place]
            told = {
                "started": night.started, "version": night.engine.version, "git_hash": night.engine.git_hash,
            }  # fmt: skip
            self._fields[place] = night.id, msgspec.Raw(encode(told))
        return self._fields[place]


def _written(*cells: Cell) -> str:
    """Cells beside each other as `table` writes them, without the end of the line."""
    out = io.StringIO()
    csv.writer(out, lineterminator="").writerow([inert(cell) for cell in cells])
    return out.getvalue()


def _changes(trend: Trend, texts: NightTexts) -> Iterable[str]:
    d, nights = trend.definition, trend.nights
    low, high = ends(d.limit, d.better)
    parameters = " ".join(f"{key}={value:g}" for key, value in sorted(d.parameters.items()))
    first = _written(
        d.test, d.configuration, d.metric, d.time_step, parameters, d.role, d.kind, d.unit, low, high,
        *(d.set_point or (None, None)),
    )  # fmt: skip
    known: dict[int, str] = {}  # what samples say, which come again and again
    for i, sample in trend.changes:
        said = known.get(id(sample))
        if said is None:
            said = known[id(sample)] = f"{first},{sample.value!r},{sample.outcome},{sample.set_point_held},"
        yield said
        yield texts.cells(nights[i])


def run_times(book: Book) -> Iterator[tuple[str, bytes, Callable[[], bytes]]]:
    """A table for each month of nights: a line for each night, a column for each run time of every test. Month,
    what the table is made from, and how: a month that is over is not made again."""
    trends = [t for test in book.tests for t in test.trends if t.definition.kind == "time"]
    keys = [t.definition.key for t in trends]
    values: list[dict[int, float]] = [dict(zip(t.nights, t.values, strict=True)) for t in trends]
    for month, group in groupby(book.nights if trends else (), key=lambda night: night.started[:7]):
        lines = [
            [
                night.started,
                night.engine.version,
                night.engine.git_hash,
                *(of.get(night.index) for of in values),
            ]
            for night in group
        ]
        columns = ("started", "version", "git_hash", *keys)
        yield month, repr((columns, lines)).encode("utf-8", "replace"), partial(table, columns, lines)


def regressions(events: Sequence[Event]) -> Table:
    """Every regression: what, from what to what, between which commits, and what became of it."""
    columns = (
        "series", "name", "sentence", "before", "after", "unit", "last_good", "first_bad", "first_bad_started",
        "first_bad_subject", "first_bad_author",
        "standing", "ended", "accepted",
    )  # fmt: skip
    return columns, [_event_line(event) for event in events]


def _event_line(event: Event) -> list[Cell]:
    good, end = event.good, event.end
    return [
        event.definition.key, event.name, event.sentence, event.before, event.value,
        event.definition.unit, good.engine.git_hash if good else "", event.first.engine.git_hash,
        event.first.started, event.first.engine.subject, event.first.engine.author, event.standing, end.started if end else "", event.accepted,
    ]  # fmt: skip


def nights(book: Book) -> Table:
    """All nights: what ran when, where, on which engine."""
    columns = (
        "run", "started", "finished", "trigger", "engine", "version", "git_hash", "changed_tree", "commit_time",
        "subject", "author",
        "compiler", "flags", "machine", "processor", "cores", "operating_system", "float_environment", "tracker",
        "ci_address",
    )  # fmt: skip
    return columns, [_night_line(night) for night in book.nights]


def _night_line(night: Night) -> list[Cell]:
    e, m = night.engine, night.machine
    return [
        night.id, night.started, night.finished, night.trigger, e.name, e.version, e.git_hash, e.dirty,
        e.commit_time, e.subject, e.author, e.compiler, e.flags, m.fingerprint, m.processor, m.cores, m.operating_system,
        m.float_environment, night.tracker_version, night.ci_address,
    ]  # fmt: skip


def test_json(test: TestHistory, texts: NightTexts) -> bytes:
    """Everything about one test but run times, work and the drawing of its scene: its card, definitions, and each series
    with the place of its definition, what it says beside, and what it was on the nights that changed it."""
    definitions: dict[str, int] = {}
    nights: dict[str, msgspec.Raw] = {}
    series = [_series(t, definitions, nights, texts) for t in steady(test)]
    card = {
        name: value for name, value in structs.asdict(test.card).items() if name not in ("scene", "saving")
    }
    card["stages"] = [{"stage": s.stage, "kept": s.kept, "reason": s.reason} for s in test.card.stages]
    whole: Writable = {
        "test": card,
        "nights": nights,
        "definitions": [json.loads(text) for text in definitions],
        "series": series,
        "figures": test.figures,
        "maps": test.maps,
    }
    return escaped(encode(whole).decode()).encode()


FIELDS = structs.fields(SeriesDefinition)
OWN = ("key", "time_step", "parameters")  # of a series: all else of its definition others share
WHOLE = ("test", "title")  # what the card says


def _series(
    trend: Trend, definitions: dict[str, int], used: dict[str, msgspec.Raw], texts: NightTexts
) -> dict[str, Writable]:
    said: dict[str, Writable] = {
        field.name: value
        for field in FIELDS
        if (value := getattr(trend.definition, field.name)) != field.default and value not in ({}, (), "")
    }
    own = {name: said.pop(name) for name in OWN if name in said}
    shared = encode({name: value for name, value in said.items() if name not in WHOLE}).decode()
    changes = []
    nights = trend.nights
    known: dict[int, tuple[float | str, str]] = {}  # what samples say, which come again and again
    for i, sample in trend.changes:
        night, told = texts.fields(nights[i])
        used[night] = told
        now = known.get(id(sample))
        if now is None:
            now = known[id(sample)] = boxed(sample.value), sample.outcome
        changes.append((night, *now))
    newest = {"state_hash": trend.latest.state_hash, "failure": trend.latest.failure} if trend.latest else {}
    return {
        **own,
        "definition": definitions.setdefault(shared, len(definitions)),
        "changes": changes,
        **{name: value for name, value in newest.items() if value},
    }
