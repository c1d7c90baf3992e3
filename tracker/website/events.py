"""What went wrong, since which night, and what came back: the verdicts of `tracker.judge.series_history` as stretches.

A series that stands still costs nothing: nights with the same bits as the night before and after are left out
before judging, which changes no verdict.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast

from spook_tracker.tracker.document.run_document import MapData
from spook_tracker.tracker.judge import series_history as analyse
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.verdict import Verdict, same_bits
from spook_tracker.tracker.website.nights import Book, Night, State, TestHistory, Trend

NOISY_NIGHTS = 400  # how far back run times are judged again on every publication
Standing = Literal["detected", "accepted", "recovered"]


@dataclass(frozen=True)
class Event:
    """One stretch of nights on which a series was red."""

    trend: Trend
    name: str  # what it is called: "limit crossed", "drift", "slower"
    sentence: str
    first: Night  # where it began
    last: Night  # the last red night
    good: Night | None  # the night it is compared with
    before: float  # the value then; NaN if there was none
    value: float  # the last value of the stretch
    standing: Standing
    end: Night | None  # the night it came back or was accepted; None while it lasts
    accepted: str = ""

    @property
    def lasting(self) -> bool:
        """Whether it is red tonight."""
        return self.standing == "detected"

    @property
    def state(self) -> State:
        """fail if the limit is broken or there is no value; watch if it only got worse."""
        i = self.trend.nights.index(self.last.index)
        return (
            "fail" if self.trend.outcomes[i] != "value" and self.trend.definition.role == "gate" else "watch"
        )


def judged(trend: Trend) -> bool:
    """Whether a limit or a set point makes this series red on its own."""
    return trend.definition.role != "reported"


def telling_nights(trend: Trend) -> list[int]:
    """The places whose neighbours differ: the others say nothing."""
    last = len(trend.nights) - 1

    def same(i: int, j: int) -> bool:
        return (
            trend.outcomes[i] == trend.outcomes[j]
            and trend.versions[i] == trend.versions[j]
            and trend.held[i] == trend.held[j]
            and same_bits(trend.values[i], trend.values[j])
        )

    return [i for i in range(last + 1) if i in (0, last) or not (same(i, i - 1) and same(i, i + 1))]


def events_of(trend: Trend, nights: Sequence[Night], accepted: Sequence[Accepted] = ()) -> list[Event]:
    """The red stretches of one series, oldest first."""
    noisy = analyse.is_noisy(trend.definition)
    places = telling_nights(trend)
    if noisy:
        places = list(range(max(0, len(trend.nights) - NOISY_NIGHTS), len(trend.nights)))
    history = [analyse.Night(nights[trend.nights[i]], trend.samples[i], trend.versions[i]) for i in places]
    verdicts = analyse.judge_history(trend.definition.key, trend.definition, history, accepted)
    found: list[Event] = []
    stretch: list[int] = []  # places in `verdicts`
    for at, verdict in enumerate(verdicts):
        if verdict.state == "detected" and (verdict.verdict.word != "new" or judged(trend)):
            stretch.append(at)
        elif stretch and verdict.state != "suspected":
            standing: Standing = "accepted" if verdict.state == "accepted" else "recovered"
            found.append(_event(trend, nights, places, verdicts, stretch, standing, at))
            stretch = []
        elif verdict.state == "accepted":
            found.append(_event(trend, nights, places, verdicts, [at], "accepted", at))
    if stretch:
        found.append(_event(trend, nights, places, verdicts, stretch, "detected", None))
    return found


def _event(
    trend: Trend,
    nights: Sequence[Night],
    places: Sequence[int],
    verdicts: Sequence[analyse.Judged],
    stretch: Sequence[int],
    standing: Standing,
    end: int | None,
) -> Event:
    worst = verdicts[stretch[-1]]
    first = worst.first_bad or verdicts[stretch[0]].night
    good = worst.last_good or worst.against
    level = cast(Night, good.run) if good else None  # the runs given to `analyse` are nights of ours
    if level is not None and level.index >= cast(Night, first.run).index:
        level = None  # red from its first night on: there was nothing good before
    before = math.nan if level is None else trend.values[trend.nights.index(level.index)]
    return Event(
        trend=trend,
        name=worst.verdict.name or ("outside the limit" if not worst.night.sample.passed else "worse"),
        sentence=worst.verdict.sentence,
        first=cast(Night, first.run),
        last=nights[trend.nights[places[stretch[-1]]]],
        good=level,
        before=before,
        value=trend.values[places[stretch[-1]]],
        standing=standing,
        end=None if end is None else nights[trend.nights[places[end]]],
        accepted="" if end is None else verdicts[end].accepted,
    )


def all_events(book: Book, accepted: Sequence[Accepted] = ()) -> list[Event]:
    """Every red stretch of every series, newest beginning first."""
    found = [
        event
        for test in book.tests
        for trend in test.trends
        for event in events_of(trend, book.nights, accepted)
    ]
    return sorted(found, key=lambda e: (-e.first.index, e.trend.definition.key))


def map_verdicts(test: TestHistory) -> dict[str, Verdict]:
    """What became of the stability maps of a test since the night before that has them, by series key."""
    found = analyse.judge_maps(test.earlier_maps, test.maps)
    return {finding.series: finding.verdict for finding in found}


def map_key(stability_map: MapData) -> str:
    """The series key of a map."""
    return f"{stability_map.test}/{stability_map.configuration}/map:{stability_map.name}"


def of_test(events: Sequence[Event], test: TestHistory) -> list[Event]:
    """The events of one test."""
    return [event for event in events if event.trend.definition.test == test.name]
