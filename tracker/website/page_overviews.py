"""Pages over all tests: error against run time, stability, regressions, versions, data, the printed report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypedDict

from spook_tracker.tracker.document.coverage import HEADINGS, coverage, rungs, summary
from spook_tracker.tracker.document.wording import clean, slug, web_address
from spook_tracker.tracker.judge.causes import Cause
from spook_tracker.tracker.judge.maps import map_key
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK, OVERALL, spaced

from .causes import hit_row, told
from .charts import drawable
from .comparisons import Comparisons, choice, pair_name
from .diagrams import (
    figure_chart,
    grid_view,
    ladder_charts,
    map_grid,
    moving,
)
from .events import Event, map_verdicts
from .feed import badge_words
from .judged_nights import BLOCK, file_stem
from .known_charts import KnownCharts
from .nights import Book, TestHistory, as_night
from .page_index import RED, counts_by_night, health, lead
from .page_rows import Page, address, row
from .page_test import concluded, ladder_views
from .scenery import scenery
from .svg import grid_picture, picture

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import TestCard
    from spook_tracker.tracker.judge.standing import Count
    from spook_tracker.tracker.judge.vocabulary import Class

    from .causes import HitRow, ToldCause
    from .nights import Trend
    from .page_rows import Row
    from .scenery import Scenery
    from .svg import Picture

MOST_CAUSES = 200  # on the page of regressions; the file has all
MOST_ROWS, FEW_ROWS = 500, 25  # series of all causes; of one that is over
MOST_CHANGES = 100  # of a comparison read without scripts
MOST_NIGHTS = 120


def error_time(book: Book) -> Page:
    """What accuracy costs, for all tests."""
    charts = [
        ("work" if shown.name.endswith("-work") else "seconds", shown, address(test))
        for test in book.tests
        for shown in ladder_views(test, book, f"{slug(test.name)}-")
    ]
    rows = {
        kind: [_row(t, test) for test in book.tests for t in test.of_kind(kind)] for kind in ("order", "time")
    }
    context = {
        "charts": charts,
        "orders": rows["order"],
        "scalars": rows["time"],
    }
    title = "Error against run time"
    return Page("error-time.html", "error-time.html", title, "What accuracy costs.", context, plotly=True)


def _row(trend: Trend, test: TestHistory) -> Row:
    return row(trend, test.card.title, address(test))


def stability(book: Book, charts: KnownCharts) -> Page:
    """Break points and maps of all tests."""
    points = [(test, t) for test in book.tests for t in test.of_kind("break_point")]
    context = {
        "break_points": [_row(t, test) for test, t in points],
        "maps": [
            (
                grid_view(map_grid(m, f"{slug(test.name)}-", test.card.title)),
                address(test),
                map_verdicts(test).get(map_key(m)),
            )
            for test in book.tests
            for m in test.maps
        ],
        "trends": [
            charts.view(t, test.card.title)
            for test in book.tests
            for t in moving(test.of_kind("break_point"))
        ],
    }
    return Page(
        "stability.html", "stability.html", "Stability", "Break points and maps.", context, plotly=True
    )


def covered(book: Book) -> Page:
    """What is known of every scene, and what is not."""
    rows = []
    for test in book.tests:
        ladders = rungs((t.definition, t.latest) for t in test.of_kind("ladder") if t.latest is not None)
        told = coverage(
            test.name,
            test.card.title,
            ladders.get(test.name, {}).values(),
            len(test.of_kind("break_point")),
            len(test.maps),
            test.card.saving,
            test.card.lacks,
        )
        rows.append((told, address(test)))
    context = {"rows": rows, "headings": HEADINGS, "summary": summary([told for told, _ in rows])}
    return Page("coverage.html", "coverage.html", "Coverage", "What is known of every scene.", context)


class Group(TypedDict):
    """A cause and the lines of what it hit."""

    told: ToldCause
    rows: list[HitRow]


def regressions(book: Book, causes: Sequence[Cause]) -> Page:
    """Every cause with all that it hit, those that last first; the oldest without their rows."""
    left = MOST_ROWS
    groups: list[Group] = []
    for cause in causes[:MOST_CAUSES]:
        hits = cause.hits[: min(left, MOST_ROWS if cause.standing == "detected" else FEW_ROWS)]
        left -= len(hits)
        groups.append({"told": told(cause, book), "rows": [hit_row(hit, book) for hit in hits]})
    context = {
        "red": [group for group in groups if group["told"].standing == "detected"],
        "closed": [group for group in groups if group["told"].standing != "detected"],
        "left_out": max(0, len(causes) - MOST_CAUSES),
    }
    title = "What became worse, since which commit, and what became of it."
    return Page("regressions.html", "regressions.html", "Regressions", title, context)


def compare(told: Comparisons, book: Book) -> Page:
    """Two versions, chosen in the page; without scripts, the newest two."""
    first = None
    if len(told.nights) > 1:
        before, after = told.nights[-2:]
        pair = told.pairs[pair_name(before, after)]
        counts = ", ".join(f"{n} {spaced(word)}" for word, n in pair["counts"].items())
        first = {
            "before": choice(before),
            "after": choice(after),
            "headline": OVERALL[pair["verdict"]].headline,
            "counts": f"{counts}.",
            "changes": pair["changes"][:MOST_CHANGES],
            "left_out": max(0, len(pair["changes"]) - MOST_CHANGES),
        }
    choices = []
    for chapter in book.engines:
        name = "" if chapter is book else f"{clean(chapter.name)} "
        for night in chapter.nights:
            made = choice(night)
            choices.append([night.id, name + made["label"], made["hash"]])
    engines = [
        [file_stem(chapter, book), len(chapter.nights), clean(chapter.name)] for chapter in book.engines
    ]
    context = {
        "versions": choices,
        "first": first,
        "choices": {"nights": choices, "engines": engines, "block": BLOCK},
    }
    return Page("compare.html", "compare.html", "Compare two versions", "Two versions side by side.", context)


def versions(book: Book, events: Sequence[Event]) -> Page:
    """Versions and machines; a night stands for its limits, and for what is known by now to have been worse then."""
    nights = list(reversed(book.nights))
    counts = counts_by_night(book, MOST_NIGHTS)
    states = _states(counts, events)
    machines = Counter(night.machine for night in book.nights)
    context = {
        "nights": [
            {
                "night": night,
                "anchor": slug(night.id),
                "machine": slug(night.machine.fingerprint),
                "kept": counts[night.index].kept,
                "gates": counts[night.index].limits,
                "state": states[night.index],
                "log": web_address(night.ci_address),
            }
            for night in nights[:MOST_NIGHTS]
        ],
        "left_out": max(0, len(nights) - MOST_NIGHTS),
        "machines": [
            {"machine": machine, "anchor": slug(machine.fingerprint), "nights": count}
            for machine, count in machines.most_common()
        ],
    }
    return Page("versions.html", "versions.html", "Versions and machines", "Versions and machines.", context)


def _states(counts: Mapping[int, Count], events: Sequence[Event]) -> dict[int, Class]:
    states: dict[int, Class] = {
        night: "fail" if found.broken else "pass" if found.limits else "none"
        for night, found in counts.items()
    }
    for event in events:
        if event.standing == "accepted":
            continue
        for night in range(as_night(event.first).index, as_night(event.last).index + 1):
            if night in states and CLASS_RANK[event.stands] < CLASS_RANK[states[night]]:
                states[night] = event.stands
    return states


def data(book: Book, events: Sequence[Event]) -> Page:
    """Every number as a file."""
    _, found = health(book)
    context = {
        "badge": f"physics: {badge_words(found)}",
        "months": list(dict.fromkeys(n.started[:7] for n in book.nights))
        if any(test.of_kind("time") for test in book.tests)
        else [],
        "tests": [{"title": t.card.title, "address": address(t), "slug": slug(t.name)} for t in book.tests],
    }
    return Page("data.html", "data.html", "Data", "Every number as CSV and JSON.", context)


def document(book: Book, causes: Sequence[Cause]) -> Page:
    """The report of tonight in one piece: the lead of the first page, failing tests, then the rest.

    What fails and the tests of the thesis are told whole, in the order of the thesis' appendix A; any other is a table.
    """
    ordered = sorted(
        book.tests, key=lambda test: CLASS_RANK[test.state] if test.state in RED else len(CLASS_RANK)
    )
    tests = [_chapter(test, book) for test in ordered]
    whole = [test for test in ordered if _told_whole(test)]
    gates = [{**vars(_row(gate, test)), "slug": slug(test.name)} for test in whole for gate in test.gates()]
    context = {**lead(book, causes), "gates": gates, "tests": tests}
    return Page("document.html", "document.html", "Report", "The report of tonight, for printing.", context)


def _told_whole(test: TestHistory) -> bool:
    return test.card.seven or test.state in RED


class ReportedTest(TypedDict):
    """What the report tells of one test."""

    card: TestCard
    slug: str
    whole: bool
    scenery: Scenery | None
    state: Class
    kept: list[str]
    left_out: int
    rows: list[Row]
    pictures: list[tuple[Picture, str]]
    conclusions: list[tuple[str, str]]


def _chapter(test: TestHistory, book: Book) -> ReportedTest:
    """What the report tells of one test."""
    name, whole = slug(test.name), _told_whole(test)
    scalars = test.gates() + test.companions()
    pictures = []
    if whole:
        scalars += test.reported() + test.of_kind("order")
        charts = [figure_chart(f, f"{name}-") for f in test.figures]
        charts += [
            chart
            for chart in ladder_charts(test, f"{name}-", earlier=book.earlier[:1])
            if chart.name.endswith("-seconds")
        ]
        pictures = [(picture(chart, shown := drawable(chart)), shown.note) for chart in charts]
        grids = [map_grid(m, f"{name}-") for m in test.maps]
        pictures += [(grid_picture(grid), grid.note) for grid in grids]
    return {
        "card": test.card,
        "slug": name,
        "whole": whole,
        "scenery": scenery(test.card.scene) if whole and test.card.scene else None,
        "state": test.state,
        "kept": [s.stage for s in test.card.stages if s.kept],
        "left_out": sum(not s.kept for s in test.card.stages),
        "rows": [_row(t, test) for t in [*scalars, *test.of_kind("break_point")]],
        "pictures": pictures,
        "conclusions": concluded(test.card.conclusion, test.state),
    }
