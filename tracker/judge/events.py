"""What went wrong, since which night, and what came back: stretches of red nights of a series."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from spook_tracker.tracker.document.run_document import Run, SeriesDefinition

from .judged import Judged
from .series_history import Told
from .vocabulary import Class, Word

Standing = Literal["detected", "accepted", "recovered"]


@dataclass(frozen=True, slots=True)
class Event:
    """One stretch of nights on which a series was red, or one night accepted. Runs are those of the history."""

    definition: SeriesDefinition
    word: Word  # of the vocabulary
    name: str  # what happened: "limit crossed", "drift", "slower"
    sentence: str
    stands: Class  # FAIL or WATCH, of its last red night
    first: Run  # the run where it began
    last: Run  # the last red run
    good: Run | None  # the run it is compared with; None if there was nothing good before
    before: float  # the value then; NaN if there was none
    value: float  # the last value of the stretch
    standing: Standing
    end: Run | None  # the run where it came back or was accepted; None while it lasts
    accepted: str = ""
    worse_at: Run | None = None  # the run where it last became worse; `first`, or a later one

    @property
    def lasting(self) -> bool:
        """Whether it is red in the newest run of its series."""
        return self.standing == "detected"


def name_of(judged: Judged) -> str:
    """What happened, in a word or two."""
    verdict = judged.verdict
    if verdict.name:
        return verdict.name
    if judged.night.sample.outcome == "out_of_limit":
        return "outside the limit"
    if judged.night.sample.outcome == "unsettled":
        return "unsettled"
    if judged.stands == "watch" and not judged.night.sample.set_point_held:
        return "off its set point"
    return "no value" if judged.stands == "fail" else "worse"


def in_full(name: str, sentence: str) -> str:
    """What happened and by how much; the name is left out where the sentence says it, as in "crossed its limit"."""
    words = re.findall(r"\w+", sentence)
    return sentence if all(word in words for word in name.split()) else f"{name}: {sentence}"


def events_of(told: Told) -> list[Event]:
    """The red stretches of one series, oldest first."""
    return [event for nights, over in told.lanes for event in _events_in(told, nights, over)]


def _events_in(told: Told, nights: Sequence[Judged], over: Judged | None) -> list[Event]:
    """The red stretches among nights judged against each other; `over` is what ended them."""
    found: list[Event] = []
    stretch: list[Judged] = []
    for judged in nights:
        if judged.red:
            stretch.append(judged)
        elif stretch and judged.state != "unjudged":
            standing: Standing = "accepted" if judged.state == "accepted" else "recovered"
            found.append(_event(told, stretch, standing, judged))
            stretch = []
        elif judged.state == "accepted":
            found.append(_event(told, [judged], "accepted", judged))
    if stretch:
        found.append(_event(told, stretch, "recovered" if over else "detected", over))
    return found


def _event(told: Told, stretch: list[Judged], standing: Standing, end: Judged | None) -> Event:
    last = stretch[-1]
    first = last.first_bad or stretch[0].night
    good = last.last_good if last.red else last.against
    return Event(
        definition=told.definition,
        word=last.verdict.word if last.verdict.red else "regressed",
        name=name_of(last),
        sentence=last.verdict.sentence,
        stands=last.stands,
        first=first.run,
        last=last.night.run,
        good=good.run if good else None,
        before=last.levels[0] if last.levels else good.value if good else math.nan,
        value=last.levels[1] if last.levels else last.night.value,
        standing=standing,
        end=None if end is None else end.night.run,
        accepted="" if end is None else end.accepted,
        worse_at=last.worse_at.run if last.worse_at else first.run,
    )


def all_events(told: Iterable[Told]) -> list[Event]:
    """Every red stretch of every series."""
    return [event for series in told for event in events_of(series)]
