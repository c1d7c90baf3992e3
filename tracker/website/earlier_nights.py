"""Earlier nights that a reader may lay beside tonight's ladders: the last, a week, a month, each release.

They are named by what they are to tonight, not by their date: a link to "a week before" still means that in a month.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.wording import day, instant, version
from spook_tracker.tracker.judge.judged import is_release

if TYPE_CHECKING:
    from .nights import Night

MOST_RELEASES = 4  # the newest
BEFORE = "before"
BACK = (("week", "a week before", 7), ("month", "a month before", 30))


@dataclass(frozen=True)
class Earlier:
    """One of them."""

    key: str  # in the address of a page
    words: str  # to the reader
    index: int  # of the night

    def told(self, night: Night) -> str:
        """The words with the day and the version of the night."""
        return f"{self.words} ({day(night.started)}, {version(night.engine)})"


def earlier_nights(tonight: Night, older: Sequence[Night]) -> list[Earlier]:
    """The choices among older nights, the newest of them first; each night once. Only nights with ladders are asked."""
    found = [Earlier(BEFORE, "the night before", older[-1].index)] if older else []
    now = instant(tonight.started)
    for key, words, days in BACK:
        place = _last_until(older, now - timedelta(days=days)) if now else None
        if place is not None:
            found.append(Earlier(key, words, place))
    releases: dict[str, Earlier] = {}
    for night in older:
        if is_release(night):
            name = version(night.engine)
            releases[name] = Earlier(f"release-{name}", f"release {name}", night.index)
    found += sorted(releases.values(), key=lambda one: -one.index)[:MOST_RELEASES]
    once: dict[int, Earlier] = {}
    for one in found:
        once.setdefault(one.index, one)
    return list(once.values())


def _last_until(nights: Sequence[Night], moment: datetime) -> int | None:
    started = [(instant(night.started), night.index) for night in nights]
    return max((index for at, index in started if at is not None and at <= moment), default=None)
