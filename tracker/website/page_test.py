"""The page of one test: question, result, theory, figures, error against run time, stability, stages, data."""

from __future__ import annotations

import re
from collections.abc import Sequence

from spook_tracker.tracker.document.wording import clean, day, slug
from spook_tracker.tracker.judge.vocabulary import Class
from spook_tracker.tracker.website.charts import Chart
from spook_tracker.tracker.website.diagrams import (
    figure_chart,
    grid_view,
    ladder_charts,
    map_grid,
    trend_chart,
    view,
)
from spook_tracker.tracker.website.events import Event, of_test
from spook_tracker.tracker.website.nights import Book, TestHistory
from spook_tracker.tracker.website.page_rows import Page, address, event_row, row
from spook_tracker.tracker.website.replays import replay
from spook_tracker.tracker.website.scenery import scenery
from spook_tracker.tracker.website.stage_times import stage_times


def test_page(book: Book, test: TestHistory, events: Sequence[Event]) -> Page:
    """Everything about one test."""
    here = address(test)
    every = {id(t): row(t, test.card.title, here) for t in test.trends}
    gates = [every[id(t)] for t in test.gates()]
    shown = test.gates() + test.companions()
    break_points = test.of_kind("break_point")
    scalars = shown + test.reported()
    newest = max((t.nights[-1] for t in test.trends), default=book.tonight.index)
    charts = ladder_charts(test, peers=book.peers(test.name), earlier=book.earlier)
    contents = [("scene", "The question"), ("versions", "Over versions")]
    contents += [("figures", "Figures")] if test.figures else []
    contents += [("error-time", "Error against run time")] if charts else []
    contents += [("stability", "Stability")] if test.maps or break_points else []
    contents += [("stages", "Stages")] if test.card.stages else []
    contents += [("conclusion", "Conclusions")] if test.card.conclusion else []
    contents += [("data", "Data")]
    context = {
        "card": test.card,
        "slug": slug(test.name),
        "stage_times": stage_times(test),
        "replay": replay(book.motions[test.name]),
        "scenery": scenery(test.card.scene) if test.card.scene else None,
        "state": test.state,
        "stale": "" if newest == book.tonight.index else day(book.nights[newest].started),
        "gates": gates,
        "contents": contents,
        "trends": [view(trend_chart(t, book.nights, events)) for t in [*shown, *break_points]],
        "more_trends": [
            view(trend_chart(t, book.nights, events)) for t in [*test.reported(), *test.of_kind("time")]
        ],
        "figures": [view(figure_chart(f)) for f in test.figures],
        "ladders": [view(c) for c in charts],
        "earlier": earlier_choices(book, charts),
        "orders": [every[id(t)] for t in [*test.of_kind("order"), *test.of_kind("time")]],
        "maps": [grid_view(map_grid(m)) for m in test.maps],
        "break_points": [every[id(t)] for t in break_points],
        "conclusions": concluded(test.card.conclusion, [gate.state for gate in gates]),
        "events": [event_row(e, book) for e in of_test(events, test)[:20]],
        "scalars": [every[id(t)] for t in scalars],
    }
    return Page(here, "test.html", clean(test.card.title), clean(test.card.question), context, plotly=True)


def earlier_choices(book: Book, charts: Sequence[Chart]) -> list[tuple[str, str]]:
    """The earlier nights that stand in some chart, as a list to choose from: key and words."""
    drawn = {line.night for chart in charts for line in chart.lines if line.night}
    return [(one.key, one.told(book.nights[one.index])) for one in book.earlier if one.key in drawn]


CONCLUSION = re.compile(r"Green: (.*?)\s+Red: (.*)", re.DOTALL)


def concluded(text: str, gates: Sequence[Class]) -> list[tuple[str, str]]:
    """What tonight's gates say of the test, first; a conclusion that has no two sides stands as it is."""
    sides = CONCLUSION.fullmatch(text)
    if sides is None or not gates:
        return [("", text)]
    green, red = sides.groups()
    if "fail" in gates:
        return [("Red tonight", red), ("When it is green", green)]
    return [("Green tonight", green), ("When it is red", red)]
