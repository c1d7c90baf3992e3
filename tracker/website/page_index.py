"""The first page: is the engine healthy tonight?"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from typing import Any

from spook_tracker.tracker.document.wording import clean, day, quantity, short_hash, version
from spook_tracker.tracker.website.events import Event, judged
from spook_tracker.tracker.website.nights import Book, State, TestHistory, Trend
from spook_tracker.tracker.website.page_rows import Page, address, event_row, row

HEAT_NIGHTS = 60
ORDER: dict[State, int] = {"fail": 0, "watch": 1, "none": 2, "pass": 3}


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
    seven = [row(t, test.card.title, address(test), book.nights) for test, t in gates if test.card.seven]
    others = [row(t, test.card.title, address(test), book.nights) for test, t in gates if not test.card.seven]
    others += [
        row(trend, test.card.title, address(test), book.nights)
        for test in book.tests
        if not test.gates()
        for trend in test.companions()[:1]
    ]
    steps = {t.definition.time_step for test, t in gates if test.card.seven}
    step = steps.pop() if len(steps) == 1 else None
    context = {
        "state": state,
        "headline": _headline(state, len(red), len(open_events)),
        "summary": summary(book),
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


def gates_at(book: Book) -> list[tuple[int, int]]:
    """Gates kept and gates measured, night by night."""
    kept, measured = [0] * len(book.nights), [0] * len(book.nights)
    for test in book.tests:
        for trend in test.gates():
            for night, outcome in zip(trend.nights, trend.outcomes, strict=True):
                measured[night] += 1
                kept[night] += outcome == "value"
    return list(zip(kept, measured, strict=True))


def _headline(state: State, red: int, watched: int) -> str:
    if state == "none":
        return "No limit was tested tonight"
    if state == "pass":
        return "Every limit is kept tonight"
    if state == "fail":
        return "One limit is broken tonight" if red == 1 else f"{red} limits are broken tonight"
    others = "one other series is red" if watched == 1 else f"{watched} other series are red"
    return f"Every gate is kept; {others}"


def summary(book: Book) -> str:
    """Tonight in two sentences."""
    fresh = [(test, t) for test in book.tests for t in test.gates() if t.nights[-1] == book.tonight.index]
    red = [trend for _, trend in fresh if trend.state == "fail"]
    seven = [trend for test, trend in fresh if test.card.seven]
    kept = sum(trend.state != "fail" for trend in seven)
    parts = []
    if seven:
        tests = len({trend.definition.test for trend in seven})
        of = "the thesis’ seven tests" if tests == 7 else f"{tests} of the thesis’ seven tests"
        how_many = f"All {len(seven)}" if kept == len(seven) else f"{kept} of {len(seven)}"
        parts.append(f"{how_many} gates of {of} hold.")
    put = {test.name for test, _ in fresh}
    engine = f"{clean(book.tonight.engine.name)} {version(book.tonight.engine)}"
    parts.append(f"{len(put)} {'test was' if len(put) == 1 else 'tests were'} put to {engine}.")
    missed = [test for test in book.tests if test.gates() and test.name not in put]
    if missed:
        parts.append(f"{len(missed)} {'was' if len(missed) == 1 else 'were'} not run tonight.")
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
        "width": round(left + max(700.0, step * len(shown)) + 20.0),
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
