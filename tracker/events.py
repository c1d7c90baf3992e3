"""What left its limit or set point, since which night, and what came back.

An event is a stretch of nights on which one series stood worse than the night before the stretch. It is read
from the verdicts as they were recorded on each night, so a limit that changes later rewrites no history.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tracker.nights import Night, State, TestHistory, Trend

RANK = {"pass": 0, "watch": 1, "fail": 2}


@dataclass(frozen=True)
class Event:
    """One stretch of one series outside its limit (fail) or set point (watch)."""

    trend: Trend
    state: State  # the worst of the stretch
    first: Night
    last: Night  # the last bad night
    before: float  # the value before it; NaN if it was never good
    value: float  # the last value of the stretch
    back: Night | None  # the night it came back; None while it lasts

    @property
    def lasting(self) -> bool:
        """Whether the newest value is still outside."""
        return self.back is None


def judged(trend: Trend) -> bool:
    """Whether anything about this series can be red."""
    return trend.definition.role != "reported"


def events_of(trend: Trend, nights: Sequence[Night]) -> list[Event]:
    """The stretches of one series, oldest first."""
    found: list[Event] = []
    start: int | None = None
    states = [trend.state_at(i) for i in range(len(trend.values))]
    for i, state in enumerate([*states, "pass"]):
        if state != "pass" and start is None:
            start = i
        elif start is not None and (state == "pass"):
            lasting = i == len(states)
            found.append(
                Event(
                    trend=trend,
                    state="fail" if "fail" in states[start:i] else "watch",
                    first=nights[trend.nights[start]],
                    last=nights[trend.nights[i - 1]],
                    before=trend.values[start - 1] if start else math.nan,
                    value=trend.values[i - 1],
                    back=None if lasting else nights[trend.nights[i]],
                )
            )
            start = None
    return found


def all_events(tests: Sequence[TestHistory], nights: Sequence[Night]) -> list[Event]:
    """Every stretch of every judged series, newest beginning first."""
    found = [
        event
        for test in tests
        for trend in test.trends
        if judged(trend)
        for event in events_of(trend, nights)
    ]
    return sorted(found, key=lambda e: (-e.first.index, e.trend.definition.key))
