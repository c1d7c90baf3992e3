"""Which pages the website has."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from spook_tracker.tracker.judge.causes import Cause
from spook_tracker.tracker.website import page_overviews
from spook_tracker.tracker.website.comparisons import Comparisons
from spook_tracker.tracker.website.events import Event
from spook_tracker.tracker.website.live_module import live_page
from spook_tracker.tracker.website.nights import Book
from spook_tracker.tracker.website.page_index import index
from spook_tracker.tracker.website.page_rows import Page
from spook_tracker.tracker.website.page_test import test_page

NAVIGATION = (
    ("index.html", "Tonight"),
    ("error-time.html", "Error and run time"),
    ("stability.html", "Stability"),
    ("live.html", "Live"),
    ("compare.html", "Compare"),
    ("regressions.html", "Regressions"),
    ("versions.html", "Versions"),
    ("data.html", "Data"),
)


def pages(
    book: Book, events: Sequence[Event], causes: Sequence[Cause], compared: Comparisons, module: str = ""
) -> Iterator[Page]:
    """Every page of the website, from the first to the pages of the tests; `module` is the live engine's script."""
    if not book.nights:
        yield Page("index.html", "empty.html", "Nothing yet", "No night is recorded yet.")
        return
    yield index(book, causes)
    yield page_overviews.error_time(book)
    yield page_overviews.stability(book, events)
    yield live_page(module)
    yield page_overviews.compare(compared)
    yield page_overviews.regressions(book, causes)
    yield page_overviews.versions(book)
    yield page_overviews.data(book, events)
    yield page_overviews.document(book, events)
    for test in book.tests:
        yield test_page(book, test, events)
