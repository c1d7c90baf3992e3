"""The page of one test: question, result, theory, figures, error against run time, stability, stages, data."""

from __future__ import annotations

import re
from collections.abc import Sequence

from spook_tracker.tracker.document.coverage import saved
from spook_tracker.tracker.document.run_document import SceneDrawing
from spook_tracker.tracker.document.wording import clean, day, slug
from spook_tracker.tracker.judge.vocabulary import Class

from .broken import MOST_CARDS, MOST_CHARTS, broken, shown
from .chart_files import nightly_file
from .diagrams import (
    View,
    figure_chart,
    grid_view,
    ladder_charts,
    map_grid,
    moving,
    trend_chart,
    view,
)
from .events import Event, of_test
from .known_charts import KnownCharts
from .model_history import model_history
from .nights import Book, TestHistory
from .page_rows import Page, Times, address, event_row, row
from .replays import replay
from .scenery import scenery
from .stage_times import stage_times
from .svg import Spark

NO_SPARK: Spark = {"path": "", "last": None, "failed": [], "width": 0.0, "height": 0.0}
LARGE = 3  # charts over nights that are not folded


def test_page(book: Book, test: TestHistory, events: Sequence[Event], charts: KnownCharts) -> Page:
    """Everything about one test."""
    here = address(test)
    every = {id(t): row(t, test.card.title, here) for t in test.trends}
    for steady in {id(t) for t in test.trends} - {id(t) for t in moving(test.trends)}:
        every[steady].spark = NO_SPARK  # a level line grows every night and says nothing
    found = broken(test)
    cards = found[:MOST_CARDS]
    first = [one.trend for one in found if one.trend.definition.kind != "ladder"][:MOST_CHARTS]
    told = {id(one.trend) for one in cards}  # not once more among the gates
    gates = [every[id(t)] for t in test.gates() if id(t) not in told]
    judged = test.gates() + test.companions()
    break_points = test.of_kind("break_point")
    scalars = judged + test.reported()
    newest = max((t.nights[-1] for t in test.trends), default=book.tonight.index)
    ladders = ladder_views(test, book)
    times = test.of_kind("time")
    over = [
        t
        for t in moving([*judged, *break_points, *test.of_kind("order"), *test.reported()])
        if t not in first
    ]
    first = moving(first)
    contents = [("broken", "What is wrong tonight")] if found else []
    history = model_history(test.trends)
    contents += [("releases", "What changed with which version")] if history else []
    contents += [("scene", "The question")]
    contents += [("versions", "Over versions")] if over else []
    contents += [("figures", "Figures")] if test.figures else []
    contents += [("error-time", "Error against run time")] if ladders else []
    contents += [("stability", "Stability")] if test.maps or break_points else []
    contents += [("stages", "Stages")] if test.card.stages else []
    contents += [("conclusion", "Conclusions")] if test.card.conclusion else []
    contents += [("data", "Data")]
    context = {
        "card": test.card,
        "slug": slug(test.name),
        "replay": replay(book.motions[test.name], over_another_version=bool(history)),
        "scenery": scenery(drawn) if (drawn := _drawn(book, test)) else None,
        "state": test.state,
        "broken": [{**vars(every[id(one.trend)]), **one.card} for one in cards],
        "broken_left_out": len(found) - len(cards),
        "broken_charts": list(map(charts.view, first)),
        "seen": shown(test, found, book),
        "stale": "" if newest == book.tonight.index else day(book.nights[newest].started),
        "gates": gates,
        "model_history": history,
        "contents": contents,
        "trends": list(map(charts.view, over[:LARGE])),
        "more_trends": list(map(charts.view, over[LARGE:])),
        "time_trends": [view(trend_chart(t, book.nights, events), slug(test.name)) for t in moving(times)],
        "figures": [view(figure_chart(f)) for f in test.figures],
        "ladders": ladders,
        "run_times": nightly_file(slug(test.name)) if times or ladders else "",
        "orders": [every[id(t)] for t in test.of_kind("order")],
        "maps": [grid_view(map_grid(m)) for m in test.maps],
        "break_points": [every[id(t)] for t in break_points],
        "conclusions": concluded(test.card.conclusion, test.state),
        "events": [event_row(e, book) for e in of_test(events, test)[:20]],
        "scalars": [every[id(t)] for t in scalars],
    }
    times_told: Times = {
        "rows": [every[id(t)] for t in times],
        "stage_times": stage_times(test),
        "saving": saved(test.card.saving),
        "saved": [s for s in test.card.stages if not s.kept and s.saved_seconds_per_step],
    }
    page = Page(here, "test.html", clean(test.card.title), clean(test.card.question), context, plotly=True)
    page.nightly = (slug(test.name), times_told) if context["run_times"] else None
    return page


def _drawn(book: Book, test: TestHistory) -> SceneDrawing | None:
    """The scene as it is described; of a model file, which describes none, as its replay begins."""
    motions = book.motions[test.name]
    if test.card.scene is not None or not motions:
        return test.card.scene
    return SceneDrawing(solids=motions[0].recorded.solids, gravity=motions[0].recorded.gravity)


def ladder_views(test: TestHistory, book: Book, prefix: str = "") -> list[View]:
    """Error against run time, which every night measures anew, and against work, which stands still."""
    charts = ladder_charts(test, prefix, peers=book.peers(test.name), earlier=book.earlier)
    return [view(chart, "" if chart.name.endswith("-work") else slug(test.name)) for chart in charts]


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
    if state == "watch":  # what is worse asks first what it may mean
        return [("If it fails", failed), ("If it passes", passed)]
    return [("If it passes", passed), ("If it fails", failed)]
