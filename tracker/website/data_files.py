"""The numbers behind the pages as files: CSV for a spreadsheet, JSON for a program.

Numbers keep every digit. Text that a spreadsheet would read as a formula is given an apostrophe; the JSON holds
the text as it was recorded.
"""

from __future__ import annotations

import csv
import io
import json
import math
from array import array
from collections.abc import Iterable, Sequence
from itertools import repeat
from typing import Any

from spook_tracker.tracker.document.json_form import boxed, encode
from spook_tracker.tracker.document.outside import escaped
from spook_tracker.tracker.website.events import Event
from spook_tracker.tracker.website.nights import Book, Night, TestHistory, Trend

FORMULA = ("=", "+", "-", "@", "\t", "\r")
COLUMNS = (
    "test", "configuration", "metric", "time_step_s", "parameters", "role", "kind", "value", "unit", "outcome",
    "limit_low", "limit_high", "set_point_low", "set_point_high", "set_point_held", "seconds", "spread",
    "instructions", "operations", "state_hash", "started", "engine", "version", "git_hash", "failure",
)  # fmt: skip


def inert(cell: Any) -> Any:
    """A cell no spreadsheet takes for a formula; numbers are left alone, None is empty."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return repr(cell)
    if isinstance(cell, str):
        text = cell.replace("\x00", "\N{REPLACEMENT CHARACTER}")
        return f"'{text}" if text.startswith(FORMULA) else text
    return cell


def table(columns: Sequence[str], lines: Iterable[Sequence[Any]]) -> bytes:
    """A CSV file in UTF-8, lines ended as RFC 4180 says."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow([inert(name) for name in columns])
    known: dict[str, str] = {}  # the same texts stand night after night

    def shown(cell: Any) -> Any:
        if type(cell) is not str:
            return inert(cell)
        found = known.get(cell)
        if found is None:
            found = known[cell] = inert(cell)
        return found

    writer.writerows([list(map(shown, line)) for line in lines])
    return out.getvalue().encode("utf-8", "replace")


def records(columns: Sequence[str], lines: Iterable[Sequence[Any]]) -> bytes:
    """The same table as JSON: a list of objects, non-finite numbers as strings."""
    found = [
        {
            name: boxed(cell) if isinstance(cell, float) else cell
            for name, cell in zip(columns, line, strict=True)
        }
        for line in lines
    ]
    return json.dumps(found, ensure_ascii=True, allow_nan=False, separators=(",", ":")).encode()


Table = tuple[Sequence[str], list[list[Any]]]  # names of the columns, lines


def newest(book: Book, tests: Sequence[TestHistory]) -> Table:
    """Every series of some tests at its newest night, a line each."""
    return COLUMNS, [_line(trend, book.nights) for test in tests for trend in test.trends]


def newest_csv(book: Book, tests: Sequence[TestHistory]) -> bytes:
    """`newest` as CSV."""
    return table(*newest(book, tests))


def _line(trend: Trend, nights: Sequence[Night]) -> list[Any]:
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
        sample.state_hash if sample else "", night.started, night.engine.name, night.engine.version,
        night.engine.git_hash, sample.failure if sample else "",
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


def history_csv(book: Book, test: TestHistory) -> bytes:
    """Scalars of one test over all nights: a line for each night, a column for each series."""
    shown = [t for t in test.trends if t.definition.kind != "ladder"]
    columns = ("started", "version", "git_hash", *(t.definition.key for t in shown))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    writer.writerow(map(inert, columns))
    writer.writerows(_by_night(book.nights, shown))
    return out.getvalue().encode("utf-8", "replace")


def _by_night(nights: Sequence[Night], trends: Sequence[Trend]) -> Iterable[list[str]]:
    """The cells of each night in which any of these has a value; column by column, for there are many."""
    facts = {n.index: [inert(n.started), inert(n.engine.version), inert(n.engine.git_hash)] for n in nights}
    every = list(facts)
    columns: list[Iterable[str]] = []
    for trend in trends:
        column = map(repr, trend.values)
        if trend.nights != every:  # nights were left out
            column = map(dict(zip(trend.nights, column, strict=True)).get, every, repeat(""))
        columns.append(column)
    lines = map(list, zip(*zip(*facts.values(), strict=True), *columns, strict=True))
    if any(trend.nights == every for trend in trends):
        yield from lines
        return
    shown = set().union(*(trend.nights for trend in trends))
    yield from (line for place, line in zip(every, lines, strict=True) if place in shown)


def regressions(events: Sequence[Event]) -> Table:
    """Every regression: what, from what to what, between which commits, and what became of it."""
    columns = (
        "series", "name", "sentence", "before", "after", "unit", "last_good", "first_bad", "first_bad_started",
        "first_bad_subject", "first_bad_author",
        "standing", "ended", "accepted",
    )  # fmt: skip
    return columns, [_event_line(event) for event in events]


def _event_line(event: Event) -> list[Any]:
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


def _night_line(night: Night) -> list[Any]:
    e, m = night.engine, night.machine
    return [
        night.id, night.started, night.finished, night.trigger, e.name, e.version, e.git_hash, e.dirty,
        e.commit_time, e.subject, e.author, e.compiler, e.flags, m.fingerprint, m.processor, m.cores, m.operating_system,
        m.float_environment, night.tracker_version, night.ci_address,
    ]  # fmt: skip


def test_json(book: Book, test: TestHistory) -> bytes:
    """Everything about one test: its card, and each series with its definition and all values."""
    whole = {
        "test": test.card,
        "nights": [
            {"run": n.id, "started": n.started, "version": n.engine.version, "git_hash": n.engine.git_hash}
            for n in book.nights
        ],
        "series": [
            {
                "definition": t.definition,
                "nights": t.nights,
                "values": _as_json(t.values),
                "outcomes": t.outcomes,
                "newest": t.latest,
            }
            for t in test.trends
        ],
        "figures": test.figures,
        "maps": test.maps,
    }
    return escaped(encode(whole).decode()).encode()


def _as_json(values: Sequence[float]) -> Sequence[float | str]:
    """Many values as JSON carries them; nearly always all are finite, which one sum tells."""
    if math.isfinite(sum(values)):
        return array("d", values).tolist()
    return [boxed(value) for value in values]
