"""The red stretches of the judge, as pages need them: in order, and by test."""

from __future__ import annotations

from collections.abc import Sequence

from spook_tracker.tracker.judge import events
from spook_tracker.tracker.judge.events import Event, events_of
from spook_tracker.tracker.judge.verdict import Verdict
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK

from .nights import Book, TestHistory, as_night

__all__ = ["Event", "all_events", "events_of", "map_verdicts", "of_test"]


def all_events(book: Book) -> list[Event]:
    """Every red stretch of every series: FAIL before WATCH among what is red tonight, then the newest first."""
    found = events.all_events(trend.told for test in book.tests for trend in test.trends)

    def rank(event: Event) -> tuple[int, int, str]:
        stands = CLASS_RANK[event.stands] if event.lasting else len(CLASS_RANK)
        return stands, -as_night(event.first).index, event.definition.key

    return sorted(found, key=rank)


def map_verdicts(test: TestHistory) -> dict[str, Verdict]:
    """What became of the stability maps of a test since the night before that has them, by series key."""
    return {told.key: told.verdict for told in test.told_maps}


def of_test(events: Sequence[Event], test: TestHistory) -> list[Event]:
    """The events of one test."""
    return [event for event in events if event.definition.test == test.name]
