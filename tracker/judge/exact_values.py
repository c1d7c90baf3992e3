"""Values without noise: a machine that takes a history night by night.

`step` takes a series, what is known of it and one more night; it returns what is known then, and the night's verdict.
Nights that repeat a calm one are passed over by `judge_values` before it comes to that. A
series is in one of four states, named by the last verdict that said anything:

| state   | the last night | what it may become |
|---------|----------------|--------------------|
| nothing | there is none of this definition | calm, held, red |
| calm    | held its level, and a night of the same bits does, too, without a look | any |
| held    | was accepted, was expected to fail, could not be asked, or is accepted until a day | any |
| red     | is worse than the level that holds | held by acceptance; calm where it recovers |

A night is looked at by the rules of `step`, from top to bottom; each is a function below.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import msgspec
from msgspec.structs import replace

from spook_tracker.tracker.document.points import Points, columns
from spook_tracker.tracker.document.run_document import (
    Point,
    Runs,
    Sample,
    SeriesDefinition,
)

from .accepted import Accepted, acceptance
from .judged import Judged, commit_of, is_release, night_of, red_class, same_commit
from .repeats import Nights
from .standing import NOT_SUPPORTED, standing
from .verdict import NEW_DEFINITION, Verdict, judge, same_bits
from .vocabulary import WORSE_THAN_EXPECTED, Class

LONG_DRIFT = 5.0  # tolerances a series may lose over many releases before that is called drift, too
UNASKED = Verdict(word="not_comparable", sentence="not supported by this engine")
BROKEN: tuple[Class, ...] = ("fail", "watch")  # what a night is on its own, whatever was before
NOT_GOOD: tuple[Class, ...] = (*BROKEN, "none")


class Series(msgspec.Struct, frozen=True):
    """What stays the same from night to night."""

    key: str
    definition: SeriesDefinition
    accepted: Sequence[Accepted] = ()


class KnownValue(msgspec.Struct, frozen=True, gc=False):
    """What is known of a series after a night."""

    name: Literal["nothing", "calm", "held", "red"] = "nothing"
    level: Point | None = None  # the last night that was not red
    release: Point | None = None  # the last release that was not red, or the first night there is
    settled: Point | None = None  # the last accepted level, or the first night there is
    stands: Class = "none"  # what the calm night stood for
    red: Judged | None = None  # the last night, where it was red
    gone: frozenset[float] = frozenset()  # bad values that had been mended
    lent: tuple[Point, Accepted] | None = None  # the level before one that is accepted until a day
    failing: Point | None = None  # the last night that was expected to fail


class Seen(msgspec.Struct, frozen=True):
    """A night looked at: what it is on its own, and against what holds."""

    night: Point
    own: Class
    verdict: Verdict
    against: Point | None


def judge_values(series: Series, history: Sequence[Point], before: Judged | None = None) -> Nights:
    """Every night's verdict, oldest first; `before` is the last night of another definition of the test."""
    points = columns(history)
    return Nights(points, judge_on(series, points, begun(before), 0, len(points))[1])


def begun(before: Judged | None) -> KnownValue:
    """What is known before the first night; `before` is the last night of another definition of the test."""
    if before is not None and (level := _last_answer(before)) is not None:
        return KnownValue("held", level, level, level)
    return KnownValue()


def judge_on(
    series: Series, points: Points, state: KnownValue, start: int, end: int
) -> tuple[KnownValue, dict[int, Judged]]:
    """From what is known before a night on to another: what is known then, and the verdicts of what does not repeat."""
    told: dict[int, Judged] = {}
    i = start
    while i < end:
        again = min(_repeating(state, points, i), end)
        if again > i:
            last = _last_release(points.runs, i, again)
            state = _stood_still(state, points[again - 1], state.release if last is None else points[last])
            i = again
        else:
            state, told[i] = step(series, state, points[i])
            i += 1
    return state, told


def _repeating(state: KnownValue, points: Points, start: int) -> int:
    """The place after the last night from `start` on that repeats the calm night before; `start` if it does not."""
    if state.name != "calm" or state.level is None:
        return start
    level, end = state.level.sample, start
    for _, last, (sample, *_) in points.stretches(start):
        if sample is not level or sample.value != sample.value:
            if not _repeats(level, sample):
                break
            level = sample
        end = last
    return end


def _last_release(runs: Runs, start: int, end: int) -> int | None:
    """The last place of a release among these."""
    places = _releases(runs)
    before = bisect_left(places, end)
    return places[before - 1] if before and places[before - 1] >= start else None


@lru_cache(maxsize=16)
def _releases(runs: Runs) -> list[int]:
    return [i for i, run in enumerate(runs) if is_release(run)]


def step(series: Series, state: KnownValue, night: Point) -> tuple[KnownValue, Judged]:
    """One more night."""
    if state.lent is not None and state.lent[1].over(night_of(night.run)):
        state = _given_back(state, state.lent[0])
    own = standing(series.definition, night.sample)
    if own == "none":
        if not _was_asked(state):
            return _unasked(state, night)
        seen = Seen(night, own, *_against_what_holds(series.definition, state, night))
    elif state.level is None or not _comparable(state.level, night):
        state, seen = _first(state, night, own)
    else:
        seen = _seen(series.definition, state, night, own)
    if not (seen.verdict.red or own in NOT_GOOD):
        return _holds(state, seen)
    taken = _taken(series, night)
    if taken is None:
        return _is_red(series.definition, state, seen)
    if taken.expected:
        return _fails_as_expected(series.definition, state, seen, taken)
    return _accepts(state, seen, taken)


# Rules: what becomes of a night.


def _stood_still(state: KnownValue, night: Point, release: Point | None) -> KnownValue:
    """The same bits under the same definition up to this night: nothing to judge."""
    s = state
    return KnownValue("calm", night, release, s.settled, s.stands, None, s.gone, None, s.failing)


def _given_back(state: KnownValue, level: Point) -> KnownValue:
    """What was lent is due: the old level counts again."""
    name = "held" if state.red is None else state.name
    return replace(state, name=name, level=level, release=level, settled=level, lent=None)


def _unasked(state: KnownValue, night: Point) -> tuple[KnownValue, Judged]:
    """An engine that never could be asked, or was accepted to be so no more: nothing became of the level that holds."""
    name = "held" if state.name == "calm" else state.name
    return replace(state, name=name), Judged(night=night, verdict=UNASKED, state="unjudged", stands="none")


def _first(state: KnownValue, night: Point, own: Class) -> tuple[KnownValue, Seen]:
    """The first value there is, or the first of another definition."""
    if state.level is None:
        verdict = Verdict(word="new", sentence="the first value")
    else:
        verdict = Verdict(word="not_comparable", sentence=why_not(state.level, night))
    begun = replace(state, name="nothing", level=night, release=night, settled=night, red=None)
    return begun, Seen(night, own, verdict, None)


def _holds(state: KnownValue, seen: Seen) -> tuple[KnownValue, Judged]:
    """Not worse than what holds: the night is the level from now on."""
    night, verdict = seen.night, seen.verdict
    better = verdict.word in ("improved", "fixed")
    release = night if better or is_release(night.run) else state.release
    lent = None if better else state.lent
    held = KnownValue(
        name="calm" if lent is None else "held",
        level=night,
        release=release,
        settled=night if better else state.settled,
        stands=seen.own,
        gone=_mended(state),
        lent=lent,
        failing=state.failing,
    )
    said: Literal["recovered", "green"] = "green" if state.red is None else "recovered"
    return held, Judged(night=night, verdict=verdict, state=said, stands=seen.own, against=seen.against)


def _is_red(definition: SeriesDefinition, state: KnownValue, seen: Seen) -> tuple[KnownValue, Judged]:
    """Worse, and not accepted: red until it is mended, and news where it is worse than it was while red."""
    night, before, level = seen.night, state.red, state.level
    good = before.last_good if before is not None else None
    if good is None and level is not None and level is not night:
        good = None if standing(definition, level.sample) in BROKEN else level
    worse = before is None or _against(definition, before.night, night).red
    judged = Judged(
        night=night,
        verdict=seen.verdict,
        state="detected",
        stands=red_class(seen.own, night.sample),
        against=seen.against,
        first_bad=night if before is None else before.first_bad,
        last_good=good,
        worse_at=night if before is None or worse else before.worse_at,
        before_worse=good if before is None else before.night if worse else before.before_worse,
    )
    return replace(state, name="red", red=judged), judged


def _fails_as_expected(
    definition: SeriesDefinition, state: KnownValue, seen: Seen, taken: Accepted
) -> tuple[KnownValue, Judged]:
    """Bad, as accepted.toml said it would be: the level from before stays, and worse than expected is told."""
    words, name = f"expected to fail; {seen.verdict.sentence}", ""
    if state.failing is not None and (grown := _against(definition, state.failing, seen.night)).red:
        words += f"; since {commit_of(state.failing.run)}: {grown.sentence}"
        name = WORSE_THAN_EXPECTED
    return replace(state, name="held", red=None, failing=seen.night), Judged(
        night=seen.night,
        verdict=replace(seen.verdict, word="expected", sentence=words, name=name),
        state="green" if state.red is None else "accepted",
        stands="accepted",
        against=seen.against,
        accepted=str(taken),
    )


def _accepts(state: KnownValue, seen: Seen, taken: Accepted) -> tuple[KnownValue, Judged]:
    """Bad, and accepted: the night is the level from now on, or until the day that was named."""
    night, level = seen.night, state.level
    lent = None
    if taken.until is not None and level is not None and level is not night:
        lent = state.lent or (level, taken)
    held = replace(
        state,
        name="held",
        level=night,
        release=night,
        settled=night,
        red=None,
        gone=_mended(state),
        lent=lent,
    )
    return held, Judged(
        night=night,
        verdict=seen.verdict,
        state="accepted",
        stands="accepted",
        against=seen.against,
        accepted=str(taken),
    )


# What the rules ask.


def _taken(series: Series, night: Point) -> Accepted | None:
    """The entry that takes a bad night, if there is one."""
    removed = night.sample.outcome == NOT_SUPPORTED or (
        night.sample.outcome == "missing" and night.sample.failure.startswith("removed")
    )
    return acceptance(series.accepted, series.key, night.value, night_of(night.run), removed)


def _was_asked(state: KnownValue) -> bool:
    """Whether the engine could be asked before: that it cannot any more is a loss, and mends nothing that is red."""
    return state.level is not None and (state.red is not None or state.level.sample.outcome != NOT_SUPPORTED)


def _last_answer(before: Judged) -> Point | None:
    """The last night on which the engine could be asked, unless it was accepted that it cannot."""
    if before.night.sample.outcome != NOT_SUPPORTED:
        return before.night
    return before.against if before.red else None


def _mended(state: KnownValue) -> frozenset[float]:
    """The bad values that came and went, with the one that goes now."""
    return state.gone if state.red is None else state.gone | {state.red.night.value}


def _seen(definition: SeriesDefinition, state: KnownValue, night: Point, own: Class) -> Seen:
    verdict, against = _against_what_holds(definition, state, night)
    if verdict.word == "regressed" and night.value in state.gone:
        words = f"{verdict.sentence}; this value came and went before"
        verdict = replace(verdict, name="flip-flop", sentence=words)
    return Seen(night, own, verdict, against)


def _against_what_holds(
    definition: SeriesDefinition, state: KnownValue, night: Point
) -> tuple[Verdict, Point | None]:
    """Against the level that holds, then against the last release, then against the last accepted level."""
    level = state.level
    assert level is not None
    verdict = _against(definition, level, night)
    if verdict.red:
        return verdict, level
    for anchor, allowed in ((state.release, 1.0), (state.settled, LONG_DRIFT)):
        if anchor is level or anchor is None:
            continue
        drifted = _against(with_tolerance(definition, allowed), anchor, night)
        if drifted.word == "regressed":
            return _drift(drifted, anchor), anchor
        if drifted.word == "improved" and verdict.word == "changed" and allowed == 1.0:
            return _drift(drifted, anchor), anchor
    return verdict, level


def _against(definition: SeriesDefinition, before: Point, after: Point) -> Verdict:
    return judge(definition, before.sample, after.sample, same_commit=same_commit(before.run, after.run))


def _drift(verdict: Verdict, anchor: Point) -> Verdict:
    words = f"{verdict.sentence}, little by little since {anchor.run.engine.version}"
    return replace(verdict, name="drift" if verdict.red else "", sentence=words)


def with_tolerance(definition: SeriesDefinition, factor: float) -> SeriesDefinition:
    """The definition with so many times its tolerances."""
    if factor == 1.0:
        return definition
    return replace(
        definition,
        tolerance=factor * definition.tolerance,
        relative_tolerance=factor * definition.relative_tolerance,
    )


def _repeats(old: Sample, new: Sample) -> bool:
    """The same bits of the same state under the same definition. Both are of one lane."""
    if old is new:
        return old.value == old.value
    return (
        old.value == new.value
        and (old.value != 0.0 or same_bits(old.value, new.value))  # only zeros are equal and may differ
        and old.outcome == new.outcome
        and old.set_point_held == new.set_point_held
        and (old.state_hash == new.state_hash or "" in (old.state_hash, new.state_hash))
    )


def _comparable(before: Point, after: Point) -> bool:
    same_test = before.test_version == after.test_version
    return same_test and before.run.machine.float_environment == after.run.machine.float_environment


def why_not(before: Point, after: Point) -> str:
    """Why two nights that are not comparable are none."""
    if before.test_version != after.test_version:
        return NEW_DEFINITION
    return "measured in another float environment"
