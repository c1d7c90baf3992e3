"""Lines of tables: a series as of its newest night, an event; and what a page is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypedDict

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.wording import (
    band,
    clean,
    conditions,
    day,
    limit,
    margin,
    named,
    number,
    pair,
    quantity,
    seconds,
    slug,
)
from spook_tracker.tracker.judge.judged import blame
from spook_tracker.tracker.judge.standing import expected
from spook_tracker.tracker.judge.vocabulary import Class

from .events import Event
from .nights import Book, Night, TestHistory, Trend
from .svg import Spark, sparkline

if TYPE_CHECKING:
    from collections.abc import Mapping

    from spook_tracker.tracker.document.run_document import Run, StageChoice

    from .stage_times import StageTimes

SPARK_NIGHTS = 40


@dataclass
class Page:
    """A page to be written: where, from which template, with what."""

    path: str
    template: str
    title: str
    description: str
    context: Mapping[str, object] = field(default_factory=dict)
    plotly: bool = False
    nightly: tuple[str, Times] | None = None  # the test, and what `times.html` tells of its run times


class Times(TypedDict):
    """What the page of a test says of run times, which every night writes anew."""

    rows: list[Row]
    stage_times: list[StageTimes]
    saving: str
    saved: list[StageChoice]


@dataclass
class Row:
    """One series as a line of a table or a card."""

    test: str
    title: str
    address: str
    what: str
    definition: str  # of stable, for a break point
    configuration: str
    time_step: str
    time_step_value: float | str
    parameters: str
    value: str
    exact: str
    limit: str
    limit_source: str
    limit_kind: str
    set_point: str
    set_point_kind: str
    margin: str
    share: str | None  # of the gauge, per cent
    state: Class
    judged: bool
    failure: str
    spark: Spark
    stale: str  # the night the value is of, if it is not tonight
    search: str  # what the words of the line do not say
    more: int = 0  # gates of the same test that are not shown


def row(trend: Trend, title: str, address: str, nights: Sequence[Night] = ()) -> Row:
    """The line of one series, as of its newest night; `nights` tell whether that is tonight."""
    d = trend.definition
    inside = margin(d, trend.value)
    share = inside.share
    state = trend.state
    if trend.definition.limit is not None and state == "fail":
        share = 1.0
    ends = slice(-SPARK_NIGHTS, None)
    states = [trend.state_at(i) for i in range(*ends.indices(len(trend.values)))]
    failed = trend.latest.failure if trend.latest else ""
    word = trend.outcomes[-1].replace("_", " ") if trend.outcomes else "no value"
    return Row(
        test=d.test,
        title=title,
        address=address,
        what=named(d)[0],
        definition=named(d)[1],
        configuration=d.configuration,
        time_step=number(d.time_step, 4),
        time_step_value="" if d.time_step is None else d.time_step,
        parameters=", ".join(f"{key} {number(value)}" for key, value in sorted(d.parameters.items())),
        value=_shown(trend, word),
        exact=repr(trend.value),
        limit=limit(d),
        limit_source=d.limit_source,
        limit_kind=d.limit_kind,
        set_point=band(d.set_point, d.unit) if d.set_point else "",
        set_point_kind=d.set_point_kind,
        margin=inside.text if math.isfinite(trend.value) else "no value",
        share=None if share is None else f"{100.0 * min(1.0, max(share, 0.012)):.1f}",
        state=state,
        judged=expected(d),
        failure=failed,
        spark=sparkline(trend.values[ends], states),
        stale=day(nights[last].started) if nights and (last := trend.nights[-1]) != nights[-1].index else "",
        search=clean(d.test).lower(),
    )


def _shown(trend: Trend, word: str) -> str:
    """The newest value in words; run times with a fitting prefix."""
    d = trend.definition
    if d.kind == "time" and math.isinf(trend.value):
        return "never"
    if not math.isfinite(trend.value):
        return word
    if d.kind == "time" and d.unit == "s":
        return seconds(trend.value)
    return quantity(trend.value, d.unit) + (", unsettled" if word == "unsettled" else "")


def address(test: TestHistory, root: str = "") -> str:
    """Where the page of a test is."""
    return f"{root}{page_of(test.name)}"


class EventRow(TypedDict):
    """An event as a line of a table."""

    test: str
    what: str
    address: str
    anchor: str
    state: Class
    name: str
    sentence: str
    now: str
    before: str
    night: Run
    again: Run | None
    blame: str
    good: Run | None
    end: Run | None
    standing: str
    accepted: str
    key: str


def event_row(event: Event, book: Book) -> EventRow:
    """An event as a line of a table."""
    d = event.definition
    test = next(t for t in book.tests if t.name == d.test)
    before, now = pair(event.before, event.value, d.unit)
    return {
        "test": test.card.title,
        "what": f"{named(d)[0]} ({conditions(d)})",
        "address": address(test),
        "anchor": f"e-{slug(d.key + '/' + event.first.id)}",
        "state": event.stands,
        "name": event.name,
        "sentence": event.sentence,
        "now": now,
        "before": before if math.isfinite(event.before) else "–",
        "night": event.first,
        "again": event.worse_at if event.worse_at is not event.first else None,
        "blame": blame(event.first, event.good),
        "good": event.good,
        "end": event.end,
        "standing": event.standing,
        "accepted": event.accepted,
        "key": d.key,
    }
