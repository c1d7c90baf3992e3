"""Which pages the website has and what stands on each: contexts for the templates, no markup."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from tracker.diagrams import figure_chart, grid_view, ladder_charts, map_grid, trend_chart, view
from tracker.events import Event, all_events, judged
from tracker.nights import Book, Night, State, TestHistory, Trend
from tracker.svg import sparkline
from tracker.wording import (
    band,
    clean,
    day,
    limit,
    margin,
    number,
    opening,
    quantity,
    short_hash,
    slug,
    version,
)

SPARK_NIGHTS = 40
HEAT_NIGHTS = 60
NAVIGATION = (
    ("index.html", "Tonight"),
)
ORDER: dict[State, int] = {"fail": 0, "watch": 1, "none": 2, "pass": 3}


@dataclass
class Page:
    """A page to be written: where, from which template, with what."""

    path: str
    template: str
    title: str
    description: str
    context: dict[str, Any] = field(default_factory=dict)
    plotly: bool = False


@dataclass
class Row:
    """One series as a line of a table or a card."""

    test: str
    title: str
    address: str
    what: str
    configuration: str
    time_step: str
    time_step_value: float | str
    parameters: str
    value: str
    exact: str
    limit: str
    limit_source: str
    set_point: str
    margin: str
    share: str | None  # of the gauge, per cent
    state: State
    judged: bool
    failure: str
    spark: dict[str, object]
    search: str


def row(trend: Trend, title: str, address: str) -> Row:
    """The line of one series, as of its newest night."""
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
        what=opening(d.description),
        configuration=d.configuration,
        time_step=number(d.time_step, 4),
        time_step_value="" if d.time_step is None else d.time_step,
        parameters=", ".join(f"{key} {number(value)}" for key, value in sorted(d.parameters.items())),
        value=quantity(trend.value, d.unit) if math.isfinite(trend.value) else word,
        exact=repr(trend.value),
        limit=limit(d),
        limit_source=d.limit_source,
        set_point=band(d.set_point, d.unit) if d.set_point else "",
        margin=inside.text if math.isfinite(trend.value) else "no value",
        share=None if share is None else f"{100.0 * min(1.0, max(share, 0.012)):.1f}",
        state=state,
        judged=judged(trend),
        failure=failed,
        spark=sparkline(trend.values[ends], states),
        search=clean(f"{d.test} {title} {d.description} {d.configuration}").lower(),
    )


def address(test: TestHistory, root: str = "") -> str:
    """Where the page of a test is."""
    return f"{root}tests/{slug(test.name)}.html"


def pages(book: Book) -> Iterator[Page]:
    """Every page of the website."""
    if not book.nights:
        yield Page("index.html", "empty.html", "Nothing yet", "No night is recorded yet.")
        return
    events = all_events(book.tests, book.nights)
    yield index(book, events)
    for test in book.tests:
        yield test_page(book, test)


def health(book: Book, events: Sequence[Event]) -> tuple[State, int, int]:
    """The verdict of the newest night: state, gates kept, gates."""
    fresh = [t for test in book.tests for t in test.gates() if t.nights[-1] == book.tonight.index]
    red = sum(trend.state == "fail" for trend in fresh)
    watched = any(event.lasting for event in events)
    state: State = "fail" if red else "none" if not fresh else "watch" if watched else "pass"
    return state, len(fresh) - red, len(fresh)


def index(book: Book, events: Sequence[Event]) -> Page:
    """Is the engine healthy tonight?"""
    gates = [(test, trend) for test in book.tests for trend in test.gates()]
    fresh = [(test, trend) for test, trend in gates if trend.nights[-1] == book.tonight.index]
    red = [trend for _, trend in fresh if trend.state == "fail"]
    banded = [
        trend
        for test in book.tests
        for trend in test.trends
        if trend.definition.set_point and trend.nights[-1] == book.tonight.index
    ]
    held = [trend for trend in banded if trend.held[-1]]
    open_events = [e for e in events if e.lasting]
    state, kept, _ = health(book, events)
    seven = [row(t, test.card.title, address(test)) for test, t in gates if test.card.seven]
    others = [row(t, test.card.title, address(test)) for test, t in gates if not test.card.seven]
    others += [
        row(trend, test.card.title, address(test))
        for test in book.tests
        if not test.gates()
        for trend in test.companions()[:1]
    ]
    steps = {t.definition.time_step for test, t in gates if test.card.seven}
    step = steps.pop() if len(steps) == 1 else None
    context = {
        "state": state,
        "headline": _headline(state, len(red), len(open_events)),
        "summary": _summary(book, fresh, red),
        "kept": kept,
        "gates": len(fresh),
        "held": len(held),
        "set_points": len(banded),
        "nights": len(book.nights),
        "seven": seven,
        "others": others,
        "common_step": _step_words(step),
        "heat": heat(book),
        "open": [event_row(e, book) for e in open_events[:12]],
    }
    return Page("index.html", "index.html", "Tonight", str(context["summary"]), context)


def _headline(state: State, red: int, watched: int) -> str:
    if state == "none":
        return "No limit was tested tonight"
    if state == "pass":
        return "Every limit is kept tonight"
    if state == "fail":
        return "One limit is broken tonight" if red == 1 else f"{red} limits are broken tonight"
    return "Every limit is kept; " + (
        "one set point is not" if watched == 1 else f"{watched} set points or companions are not"
    )


def _summary(book: Book, fresh: Sequence[tuple[TestHistory, Trend]], red: Sequence[Trend]) -> str:
    seven = [trend for test, trend in fresh if test.card.seven]
    kept = sum(trend.state != "fail" for trend in seven)
    parts = []
    if seven:
        parts.append(
            f"All {len(seven)} gates of the thesis’ seven tests hold."
            if kept == len(seven)
            else f"{kept} of {len(seven)} gates of the thesis’ seven tests hold."
        )
    tests = len({test.name for test, _ in fresh})
    parts.append(
        f"{tests} tests were put to {clean(book.tonight.engine.name)} {version(book.tonight.engine)}."
    )
    if red:
        names = list(dict.fromkeys(trend.definition.test for trend in red))
        parts.append("Red: " + ", ".join(clean(n)[:60] for n in names[:5]) + ("…" if len(names) > 5 else "."))
    return " ".join(parts)


def _step_words(step: float | None) -> str:
    if step is None:
        return ""
    inverse = 1.0 / step
    return f"1/{round(inverse)} s" if abs(inverse - round(inverse)) < 1e-6 * inverse else quantity(step, "s")


def heat(book: Book) -> dict[str, Any]:
    """Tests against nights: cells of equal verdict beside each other are one bar."""
    shown = book.nights[-HEAT_NIGHTS:]
    first = shown[0].index if shown else 0
    left, step = 168.0, min(30.0, 700.0 / max(1, len(shown)))
    rows: list[dict[str, Any]] = []
    for i, test in enumerate(book.tests):
        states = [night_state(test, night.index) for night in shown]
        runs: list[dict[str, Any]] = []
        for j, state in enumerate(states):
            x = left + j * step
            told = f"{day(shown[j].started)} {short_hash(shown[j].engine)}: {state}"
            runs.append(
                {"state": state, "x": round(x, 2), "width": round(step - 2.0, 2), "told": told,
                 "places": [round(x + (step - 2.0) / 2.0, 2)]}
            )  # fmt: skip
        title = clean(test.card.title)
        rows.append(
            {"title": title if len(title) < 25 else title[:23] + "…", "address": address(test), "y": 22 + 22 * i,
             "runs": runs}
        )  # fmt: skip
    every = max(1, math.ceil(46.0 / step))
    ticks = [
        (round(left + j * step + step / 2.0 - 1.0, 2), day(night.started)[5:])
        for j, night in reversed(list(enumerate(shown)))
        if (len(shown) - 1 - j) % every == 0
    ]
    return {
        "columns": shown,
        "rows": rows,
        "ticks": ticks,
        "width": round(left + step * max(len(shown), 1) + 20.0),
        "height": 26 + 22 * len(rows),
        "first": first,
        "description": f"{len(rows)} tests over {len(shown)} nights; "
        f"{sum(r['state'] == 'fail' for x in rows for r in x['runs'])} red.",
    }


def night_state(test: TestHistory, night: int) -> State:
    """The verdict of a test on one night, as recorded then."""
    worst: State = "none"
    for trend in test.trends:
        if not judged(trend):
            continue
        place = place_of(trend, night)
        if place is None:
            continue
        state = trend.state_at(place)
        if state == "fail" and trend.definition.role != "gate":
            state = "watch"
        if worst == "none" or ORDER[state] < ORDER[worst]:
            worst = state
    return worst


def place_of(trend: Trend, night: int) -> int | None:
    """Where a night stands in a series, if it does."""
    place = bisect_left(trend.nights, night)
    return place if place < len(trend.nights) and trend.nights[place] == night else None


def event_row(event: Event, book: Book) -> dict[str, Any]:
    """An event as a line of a table."""
    d = event.trend.definition
    test = next(t for t in book.tests if t.name == d.test)
    return {
        "test": test.card.title,
        "what": opening(f"{d.description} ({d.configuration})"),
        "address": address(test),
        "state": event.state,
        "now": quantity(event.value, d.unit, 6),
        "before": quantity(event.before, d.unit, 6) if math.isfinite(event.before) else "–",
        "limit": limit(d),
        "set_point": band(d.set_point, d.unit) if d.set_point else "–",
        "night": event.first,
        "last": event.last,
        "back": event.back,
        "key": d.key,
    }


def test_page(book: Book, test: TestHistory) -> Page:
    """One test: question, result, theory, figures, error against run time, stability, stages, data."""
    here = address(test)
    every = {id(t): row(t, test.card.title, here) for t in test.trends}
    gates = [every[id(t)] for t in test.gates()]
    shown = test.gates() + test.companions()
    break_points = test.of_kind("break_point")
    scalars = shown + test.reported()
    newest = max((t.nights[-1] for t in test.trends), default=book.tonight.index)
    charts = ladder_charts(test)
    contents = [("scene", "The question"), ("versions", "Over versions")]
    contents += [("figures", "Figures")] if test.figures else []
    contents += [("error-time", "Error against run time")] if charts else []
    contents += [("stability", "Stability")] if test.maps or break_points else []
    contents += [("stages", "Stages")] if test.card.stages else []
    contents += [("conclusion", "Conclusions"), ("data", "Data")]
    context = {
        "card": test.card,
        "slug": slug(test.name),
        "state": test.state,
        "stale": "" if newest == book.tonight.index else day(book.nights[newest].started),
        "gates": gates,
        "contents": contents,
        "trends": [view(trend_chart(t, book.nights)) for t in [*shown, *break_points]],
        "more_trends": [view(trend_chart(t, book.nights)) for t in [*test.reported(), *test.of_kind("time")]],
        "figures": [view(figure_chart(f)) for f in test.figures],
        "ladders": [view(c) for c in charts],
        "orders": [every[id(t)] for t in [*test.of_kind("order"), *test.of_kind("time")]],
        "maps": [grid_view(map_grid(m)) for m in test.maps],
        "break_points": [every[id(t)] for t in break_points],
        "scalars": [every[id(t)] for t in scalars],
    }
    return Page(here, "test.html", clean(test.card.title), clean(test.card.question), context, plotly=True)


def newest_first(nights: Sequence[Night]) -> list[Night]:
    """Nights from the newest back."""
    return list(reversed(nights))
