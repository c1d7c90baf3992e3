"""Run times accepted until a day: after it they are held to the level from before again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import date

from .accepted import Accepted
from .noisy import Noisy
from .segments import Segment

Walk = Callable[..., tuple[list[Noisy], list[Segment]]]


def walk_with(
    walk: Walk, taken: Sequence[Accepted | None], nights: Sequence[date]
) -> tuple[list[Noisy], list[Segment]]:
    """Verdicts and segments, each night by the entries that hold on its day, and not by those that are over then.

    A night that is red because an entry is over is news once, on the first such night.
    """
    days = sorted({level.until for level in taken if level is not None and level.until is not None})
    told, segments = walk(accepted=[level is not None for level in taken])
    for day in days:
        first = next((i for i, night in enumerate(nights) if night > day), None)
        if first is None:
            break
        holds = [level is not None and (level.until is None or level.until > day) for level in taken]
        due, segments = walk(accepted=holds)
        if due[first].state == "detected" and first > 0 and told[first - 1].state != "detected":
            due[first] = due[first]._replace(news=True)
        told = [*told[:first], *due[first:]]
    return told, segments
