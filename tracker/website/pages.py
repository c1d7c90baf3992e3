"""Which pages the website has."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from spook_tracker.tracker.document.wording import clean
from spook_tracker.tracker.judge.causes import Cause

from . import page_engines, page_overviews
from .comparisons import Comparisons
from .events import Event
from .known_charts import KnownCharts
from .live_module import live_page
from .nights import Book
from .page_index import index
from .page_mutants import PATH, Mutant, mutants_page
from .page_rows import Page, address
from .page_test import test_page
from .recorded import Recorded

NAVIGATION = (  # in the order of need
    ("index.html", "Tonight"),
    ("regressions.html", "Regressions"),
    ("error-time.html", "Error and run time"),
    ("stability.html", "Stability"),
    ("engines.html", "Engines"),
    ("live.html", "Live"),
    ("compare.html", "Compare"),
    ("versions.html", "Versions"),
    ("data.html", "Data"),
)


@dataclass(frozen=True)
class Planned:
    """A page that is going to be made: where it stands, what it is called, and how."""

    path: str
    title: str
    make: Callable[[], Page]


def pages(
    book: Book,
    events: Sequence[Event],
    causes: Sequence[Cause],
    compared: Callable[[], Comparisons],
    charts: KnownCharts,
    module: str = "",
    mutants: Sequence[Mutant] = (),
    recorded: Recorded | None = None,
) -> Iterator[Planned]:
    """Every page of the website, from the first to the pages of the tests; `module` is the live engine's script."""
    if not book.nights:
        words = "No night is recorded yet."
        yield Planned(
            "index.html", "Nothing yet", lambda: Page("index.html", "empty.html", "Nothing yet", words)
        )
        return
    yield Planned("index.html", "Tonight", partial(index, book, causes))
    yield Planned("error-time.html", "Error against run time", partial(page_overviews.error_time, book))
    yield Planned("stability.html", "Stability", partial(page_overviews.stability, book, charts))
    yield Planned("coverage.html", "Coverage", partial(page_overviews.covered, book))
    if module:
        yield Planned("live.html", "Live", partial(live_page, module))
    if recorded is None or book.others:
        beside = page_engines.RECORDED if recorded is not None else ""
        yield Planned(page_engines.ENGINES, "Engines", partial(page_engines.engines, book, beside=beside))
    if recorded is not None:
        path, beside = (
            (page_engines.RECORDED, page_engines.ENGINES) if book.others else (page_engines.ENGINES, "")
        )
        yield Planned(path, "Engines", partial(page_engines.engines, book, recorded, path, beside))
        for chapter in recorded.chapters:
            if chapter.name != book.name:
                path = page_engines.engine_address(chapter.name, "recorded")
                yield Planned(
                    path, clean(chapter.name), partial(page_engines.engine_page, book, chapter, recorded)
                )
    for chapter in book.others:
        path = page_engines.engine_address(chapter.name)
        yield Planned(path, clean(chapter.name), partial(page_engines.engine_page, book, chapter))
    yield Planned("compare.html", "Compare", lambda: page_overviews.compare(compared(), book))
    yield Planned("regressions.html", "Regressions", partial(page_overviews.regressions, book, causes))
    if mutants:
        yield Planned(PATH, "Mutation tests", partial(mutants_page, mutants, book))
    yield Planned("versions.html", "Versions", partial(page_overviews.versions, book, events))
    yield Planned("data.html", "Data", partial(page_overviews.data, book, events))
    yield Planned("document.html", "Report", partial(page_overviews.document, book, causes))
    for test in book.tests:
        yield Planned(address(test), clean(test.card.title), partial(test_page, book, test, events, charts))
