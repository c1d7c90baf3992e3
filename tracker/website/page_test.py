"""The page of one test: question, result, theory, figures, error against run time, stability, stages, data."""

from __future__ import annotations

import re
from collections.abc import Sequence

from spook_tracker.tracker.document.wording import clean, day, slug
from spook_tracker.tracker.judge.vocabulary import Class
from spook_tracker.tracker.website.broken import MOST_CARDS, MOST_CHARTS, broken, shown
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
from spook_tracker.tracker.website.model_history import model_history
from spook_tracker.tracker.website.nights import Book, TestHistory
from spook_tracker.tracker.website.page_rows import Page, address, event_row, row
from spook_tracker.tracker.website.replays import replay
from spook_tracker.tracker.website.scenery import scenery
from spook_tracker.tracker.website.stage_times import stage_times


def test_page(book: Book, test: TestHistory, events: Sequence[Event]) -> Page:
    """Everything about one test."""
    here = address(test)
    every = {id(t): row(t, test.card.title, here) for t in test.trends}
    found = broken(test)
    cards = found[:MOST_CARDS]
    first = [one.trend for one in found if one.trend.definition.kind != "ladder"][:MOST_CHARTS]
    gates = [every[id(t)] for t in test.gates()]
    judged = test.gates() + test.companions()
    break_points = test.of_kind("break_point")
    scalars = judged + test.reported()
    newest = max((t.nights[-1] for t in test.trends), default=book.tonight.index)
    charts = ladder_charts(test, peers=book.peers(test.name), earlier=book.earlier)
    contents = [("broken", "What is wrong tonight")] if found else []
    history = model_history(test.trends)
    contents += [("releases", "What changed with which version")] if history else []
    contents += [("scene", "The question"), ("versions", "Over versions")]
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
        "broken": [{**vars(every[id(one.trend)]), **one.card} for one in cards],
        "broken_left_out": len(found) - len(cards),
        "broken_charts": [view(trend_chart(t, book.nights, events)) for t in first],
        "seen": shown(test, found, book),
        "stale": "" if newest == book.tonight.index else day(book.nights[newest].started),
        "gates": gates,
        "model_history": history,
        "contents": contents,
        "trends": [
            view(trend_chart(t, book.nights, events)) for t in [*judged, *break_points] if t not in first
        ],
        "more_trends": [
            view(trend_chart(t, book.nights, events))
            for t in [*test.reported(), *test.of_kind("time")]
            if t not in first
        ],
        "figures": [view(figure_chart(f)) for f in test.figures],
        "ladders": [view(c) for c in charts],
        "earlier": earlier_choices(book, charts),
        "orders": [every[id(t)] for t in [*test.of_kind("order"), *test.of_kind("time")]],
        "maps": [grid_view(map_grid(m)) for m in test.maps],
        "break_points": [every[id(t)] for t in break_points],
        "conclusions": concluded(test.card.conclusion, test.state),
        "events": [event_row(e, book) for e in of_test(events, test)[:20]],
        "scalars": [every[id(t)] for t in scalars],
    }
    return Page(here, "test.html", clean(test.card.title), clean(test.card.question), context, plotly=True)


def earlier_choices(book: Book, charts: Sequence[Chart]) -> list[tuple[str, str]]:
    """The earlier nights that stand in some chart, as a list to choose from: key and words."""
    drawn = {line.night for chart in charts for line in chart.lines if line.night}
    return [(one.key, one.told(book.nights[one.index])) for one in book.earlier if one.key in drawn]


CONCLUSION = re.compile(r"(?:Green|If it passes): (.*?)\s+(?:Red|If it fails): (.*)", re.DOTALL)


def concluded(text: str, state: Class) -> list[tuple[str, str]]:
    """What to conclude, that of tonight first: from what the test stands for, as its sign says it.

    A conclusion that has no two sides stands as it is.
    """
    sides = CONCLUSION.fullmatch(text)
    if sides is None:
        return [("", text)]
    passed, failed = sides.groups()
    if state == "fail":
        return [("It failed tonight", failed), ("If it passes", passed)]
    if state == "pass":
        return [("It passed tonight", passed), ("If it fails", failed)]
    return [("If it passes", passed), ("If it fails", failed)]
