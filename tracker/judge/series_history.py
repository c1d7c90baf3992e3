"""The history of a series, judged night by night: what is red, since when, and whether it came back.

This is the one way from a history to verdicts; commands, pages, feed and badge all show what comes out here.
A night is compared with the level that holds: the last night that was not red. A red level is not taken over,
so it stays red until it is mended or accepted; a red night worse than the red night before it is news of its
own. Small steps that each stay inside the tolerance are caught by comparing with the last release, and with
the level that was last accepted, as well, and are called drift. Values without noise are judged after one
run, exactly; run times by level segments: tracker/judge/run_times.py.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING

import msgspec
from msgspec.structs import replace

from spook_tracker.tracker.document.collection import no_collection
from spook_tracker.tracker.document.points import Points, columns
from spook_tracker.tracker.document.run_document import (
    Point,
    Runs,
    SeriesDefinition,
    SeriesHistory,
)

from .accepted import Accepted, acceptance
from .calibration import engines_own, taken_again, unquiet
from .exact_values import (
    KnownValue,
    Series,
    begun,
    judge_on,
    judge_values,
    why_not,
)
from .explaining import calm_nights
from .judged import Judged, is_release, night_of, red_class
from .lane import looked_at_again
from .lent import walk_with
from .noisy import Noisy
from .repeats import Nights, states_of
from .run_times import judged_and_segments
from .slower import by_outcome, only_followed
from .standing import NOT_SUPPORTED, standing
from .verdict import Verdict
from .vocabulary import Class, with_recoveries
from .work import is_read_off

if TYPE_CHECKING:
    from .checkpoints import Checkpoints

NOISY_NIGHTS = 400  # how far back run times are judged again night by night


@dataclass(frozen=True)
class Told:
    """A series with all its nights judged, oldest first."""

    key: str
    definition: SeriesDefinition
    nights: Sequence[Judged]

    @property
    def points(self) -> Sequence[Point]:
        """The nights without their verdicts."""
        nights = self.nights
        return nights.points if isinstance(nights, Nights) else [judged.night for judged in nights]

    @cached_property
    def lanes(self) -> list[tuple[list[Judged], Judged | None]]:
        """The nights that were judged against each other, without those that only repeat, and the night that ended them.

        A lane ends where the definition of the test changes for good. There are none where nothing ever became
        worse, as in most series: there is nothing to look for in them.
        """
        nights = self.nights
        if states_of(nights).isdisjoint(("detected", "accepted")):
            return []
        lane = on_one_clock if is_noisy(self.definition) else _question
        found = []
        told = nights.told if isinstance(nights, Nights) else range(len(nights))
        points = self.points
        for places in lanes_of(points, lane):
            over = nights[places[-1]].night.test_version != nights[-1].night.test_version
            found.append(([nights[i] for i in places if i in told], nights[places[-1] + 1] if over else None))
        return found


@no_collection()
def judge_all(
    histories: Mapping[str, SeriesHistory],
    accepted: Sequence[Accepted] = (),
    known: Checkpoints | None = None,
) -> dict[str, Told]:
    """Every series with the verdict of each of its nights, by key; `known` is where the judge stood before."""
    return {
        key: Told(
            key,
            found.definition,
            calm_nights(
                found.definition, judge_history(key, found.definition, found.points, accepted, known)
            ),
        )
        for key, found in histories.items()
    }


def judge_history(
    key: str,
    definition: SeriesDefinition,
    history: Sequence[Point],
    accepted: Sequence[Accepted] = (),
    known: Checkpoints | None = None,
) -> Sequence[Judged]:
    """Every night's verdict, oldest first."""
    taken = [level for level in accepted if level.names(key)]
    if is_noisy(definition):
        return _judge_times(key, definition, list(history), taken)
    series, points = Series(key, definition, taken), columns(history)
    if known is None:
        return Nights(points, _judge_lanes(series, points)[0])
    return known.judged(series, points, partial(_judge_lanes, series, points))


def _judge_lanes(
    series: Series, points: Points, mark: int = 0
) -> tuple[dict[int, Judged], KnownValue | None]:
    """The verdicts of what does not repeat, and what is known before the night at a place that is in the midst of the last
    lane; None where the place is not."""
    found: dict[int, Judged] = {}
    then: KnownValue | None = None
    for places in lanes_of(points, _question):
        start, end = places[0], places[-1] + 1
        before = _under_another_definition(points, found, start)
        if end - start == len(places):
            state, middle = begun(before), mark if start < mark < end == len(points) else start
            state, told = judge_on(series, points, state, start, middle)
            then = state if middle > start else None
            found |= told | judge_on(series, points, state, middle, end)[1]
        else:  # beside another lane: the night before is not the one that a night repeats
            nights = judge_values(series, [points[i] for i in places], before)
            found |= zip(places, nights, strict=True)
        if start > 0 and found[start].verdict.word == "new":
            why = Verdict(word="not_comparable", sentence=why_not(points[start - 1], points[start]))
            found[start] = msgspec.structs.replace(found[start], verdict=why)
    return found, then


def _under_another_definition(history: Points, found: Mapping[int, Judged], start: int) -> Judged | None:
    """The night before one that cannot be asked: an engine does not get rid of a question by another definition."""
    if history[start].sample.outcome != NOT_SUPPORTED:
        return None
    floats = history[start].run.machine.float_environment
    before = (i for i in reversed(range(start)) if history[i].run.machine.float_environment == floats)
    nights = Nights(history, found)
    return next((nights[i] for i in before), None)


def lanes_of(history: Sequence[Point], lane: Callable[[Point], Hashable]) -> list[list[int]]:
    """The places of the nights that can be compared with each other, lane by lane, in the order of their firsts."""
    one_machine = isinstance(history, Points) and len(_machines(history.runs)) == 1
    if isinstance(history, Points) and one_machine and len({said[1] for said in history.said.each}) == 1:
        return [list(range(len(history)))]
    known: dict[
        tuple[str, int], list[int]
    ] = {}  # few machines and definitions: a name each, not one each night
    lanes: dict[Hashable, list[int]] = {}
    version, machine, places = "", None, None
    for place, night in enumerate(history):
        if places is None or night.run.machine is not machine or night.test_version is not version:
            version, machine = night.test_version, night.run.machine
            places = known.get((version, id(machine)))
            if places is None:
                places = known[version, id(machine)] = lanes.setdefault(lane(night), [])
        places.append(place)
    return list(lanes.values())


@lru_cache(maxsize=16)
def _machines(runs: Runs) -> set[int]:
    return {id(run.machine) for run in runs}


def _question(night: Point) -> Hashable:
    """Values are comparable under one definition of the test in one float environment."""
    return night.test_version, night.run.machine.float_environment


def on_one_clock(night: Point) -> Hashable:
    """Run times are comparable under one definition of the test on one machine."""
    return night.test_version, night.run.machine.fingerprint


def is_noisy(definition: SeriesDefinition) -> bool:
    """Whether the same build may give another value: run times only."""
    return definition.kind == "time"


def _only_followed(noisy: Noisy) -> Noisy:
    if noisy.state not in ("detected", "suspected"):
        return noisy
    return noisy._replace(verdict=only_followed(noisy.verdict), state="green", first_bad=None, last_good=None)


def _judge_times(
    key: str, definition: SeriesDefinition, history: Sequence[Point], accepted: Sequence[Accepted]
) -> list[Judged]:
    """Run times: each machine and each definition of the test is a history of its own."""
    found: dict[int, Judged] = {}
    old = Verdict(word="same", sentence="too long ago to be judged again")
    for every in lanes_of(history, on_one_clock):
        loud = {place: why for place in every if (why := unquiet(history[place]))}
        looked = looked_at_again(len(every), NOISY_NIGHTS)
        again = [every[i] for i in looked]
        for place in (*sorted(set(every) - set(again)), *loud):
            own = standing(definition, history[place].sample)
            said = Verdict(word="not_comparable", sentence=loud[place]) if place in loud else old
            found[place] = Judged(night=history[place], verdict=said, state="unjudged", stands=own)
        places = [place for place in again if place not in loud]
        lane = [history[place] for place in places]
        values = engines_own(lane)
        taken = [
            acceptance(accepted, key, value, night_of(night.run), night.sample.outcome == "missing")
            if accepted
            else None
            for night, value in zip(lane, values, strict=True)
        ]
        walk = partial(
            judged_and_segments,
            values,
            larger_is_better=definition.better == "larger",
            releases=[is_release(night.run) for night in lane],
            tolerance=definition.relative_tolerance,
            absolute=definition.tolerance,
            ages=[i for i in looked if every[i] not in loud],
        )
        verdicts, segments = walk_with(walk, taken, [night_of(night.run) for night in lane])
        level_of = {i: segment for segment in segments for i in range(segment.first, segment.last + 1)}
        verdicts = [
            noisy if told is noisy.verdict else noisy._replace(verdict=told)
            for noisy, night in zip(verdicts, lane, strict=True)
            for told in (by_outcome(noisy.verdict, night.sample, definition.unit),)
        ]
        if is_read_off(definition):
            verdicts = list(map(_only_followed, verdicts))
        states = with_recoveries(noisy.state for noisy in verdicts)
        for i, (noisy, state) in enumerate(zip(verdicts, states, strict=True)):
            if more := taken_again(lane[i]):
                noisy = noisy._replace(
                    verdict=replace(noisy.verdict, sentence=f"{noisy.verdict.sentence}{more}")
                )
            own = standing(definition, lane[i].sample)
            stands: Class = "accepted" if noisy.state == "accepted" else own
            first = lane[noisy.first_bad] if noisy.first_bad is not None else None
            worse_at = lane[noisy.worse_at] if noisy.worse_at is not None else first
            good = lane[noisy.last_good] if noisy.last_good is not None else None
            later = noisy.worse_at if noisy.worse_at != noisy.first_bad else None
            before = lane[later - 1] if later else good
            found[places[i]] = Judged(
                night=lane[i],
                verdict=noisy.verdict,
                state=state,
                stands=red_class(own, lane[i].sample) if noisy.state == "detected" else stands,
                against=lane[noisy.against] if noisy.against is not None else None,
                first_bad=first,
                last_good=good,
                worse_at=worse_at,
                before_worse=before,
                accepted=str(taken[i]) if noisy.state == "accepted" else "",
                usual=noisy.usual,
                time=values[i],
                confirms=noisy.news,
                levels=noisy.levels,
                accused=None if noisy.accused is None else (lane[noisy.accused[0]], lane[noisy.accused[1]]),
                probability=noisy.probability,
                segment=level_of.get(i),
            )
    return [found[place] for place in sorted(found)]
