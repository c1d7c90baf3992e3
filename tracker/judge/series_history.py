"""The history of a series, judged night by night: what is red, since when, and whether it came back.

This is the one way from a history to verdicts; commands, pages, feed and badge all show what comes out here.
A night is compared with the level that holds: the last night that was not red. A red level is not taken over,
so it stays red until it is mended or accepted; a red night worse than the red night before it is news of its
own. Small steps that each stay inside the tolerance are caught by comparing with the last release, and with
the level that was last accepted, as well, and are called drift. Values without noise are judged after one
run, exactly; run times by level segments: tracker/judge/run_times.py.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from functools import cached_property, lru_cache, partial
from operator import attrgetter

import msgspec
from msgspec.structs import replace

from spook_tracker.tracker.document.collection import no_collection
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import Point, Run, Sample, SeriesDefinition, SeriesHistory
from spook_tracker.tracker.judge.accepted import Accepted, acceptance
from spook_tracker.tracker.judge.calibration import engines_own, taken_again, unquiet
from spook_tracker.tracker.judge.explaining import calm_nights
from spook_tracker.tracker.judge.lane import looked_at_again
from spook_tracker.tracker.judge.lent import walk_with
from spook_tracker.tracker.judge.run_times import Noisy, judged_and_segments
from spook_tracker.tracker.judge.segments import Segment
from spook_tracker.tracker.judge.slower import Usual, by_outcome, only_followed
from spook_tracker.tracker.judge.standing import NO_VALUE, standing
from spook_tracker.tracker.judge.verdict import NEW_DEFINITION, Verdict, judge, same_bits
from spook_tracker.tracker.judge.vocabulary import Class, State, with_recoveries

RELEASE = re.compile(r"v?\d+(\.\d+)*")
NOISY_NIGHTS = 400  # how far back run times are judged again night by night
SURE = 0.995  # a boundary as probable needs no range
LONG_DRIFT = 5.0  # tolerances a series may lose over many releases before that is called drift, too
IDENTICAL = Verdict(word="identical", sentence="the same bits", ulps=0)


class Judged(msgspec.Struct, frozen=True, kw_only=True):
    """A night with its verdict. `against` is the night it was compared with."""

    night: Point
    verdict: Verdict
    state: State
    stands: Class  # what a reader sees: FAIL, WATCH, PASS …
    against: Point | None = None
    first_bad: Point | None = None  # where the present red began
    last_good: Point | None = None
    worse_at: Point | None = None  # where it last became worse while red: first_bad, or a later night
    before_worse: Point | None = None  # the night before that
    accepted: str = ""
    usual: Usual | None = None  # of run times: level and noise after this night
    time: float | None = None  # of run times: the value judged (tracker.judge.calibration.engines_own)
    confirms: bool | None = None  # of run times: whether a red segment is told for the first time tonight
    levels: tuple[float, float] | None = None  # of run times: what the percentage is of, before and now
    accused: tuple[Point, Point] | None = None  # of red run times: last surely good, first surely bad night
    probability: float | None = None  # that `worse_at` is right
    segment: Segment | None = (
        None  # of run times: the level that the night belongs to, as far as is known today
    )

    @property
    def red(self) -> bool:
        return self.state == "detected"

    @property
    def news(self) -> bool:
        """Red for a reason of tonight, or red since tonight, and not only still red."""
        return self.red and (self.worse_at is self.night if self.confirms is None else self.confirms)

    @property
    def pair(self) -> tuple[Number | None, Number]:
        """What is printed beside the sentence: the value before and now, of run times red or recovered their levels."""
        if self.state in ("detected", "recovered") and self.levels is not None:
            return Number(self.levels[0]), Number(self.levels[1])
        return None if self.against is None else self.against.sample.value, self.night.sample.value


@dataclass(frozen=True)
class Told:
    """A series with all its nights judged, oldest first."""

    key: str
    definition: SeriesDefinition
    nights: tuple[Judged, ...]

    @cached_property
    def lanes(self) -> list[tuple[list[Judged], Judged | None]]:
        """The nights that were judged against each other, and the night that ended them.

        A lane ends where the definition of the test changes for good. There are none where nothing ever became
        worse, as in most series: nobody has anything to look for in them.
        """
        nights = self.nights
        if {judged.state for judged in nights}.isdisjoint(("detected", "accepted")):
            return []
        lane = on_one_clock if is_noisy(self.definition) else _question
        found = []
        for places in lanes_of([judged.night for judged in nights], lane):
            over = nights[places[-1]].night.test_version != nights[-1].night.test_version
            found.append(([nights[i] for i in places], nights[places[-1] + 1] if over else None))
        return found


VERSION, MACHINE = attrgetter("test_version"), attrgetter("run.machine")  # of a night


def commit_of(run: Run) -> str:
    """How a reader finds the version: twelve digits of its commit, or its version."""
    return run.engine.git_hash[:12] or run.engine.version


def night_of(run: Run) -> date:
    """The day of a run in UTC."""
    return datetime.fromisoformat(run.started).astimezone(UTC).date()


def is_release(run: Run) -> bool:
    """Whether the engine's version is one that was released, not one in between."""
    return not run.engine.dirty and _released(run.engine.version)


@lru_cache(maxsize=4096)
def _released(version: str) -> bool:
    return RELEASE.fullmatch(version) is not None


def blame_of(judged: Judged) -> str:
    """Which commit a red series became worse with, and how sure that is; empty if it is not red."""
    if judged.worse_at is None:
        return ""
    words = blame(judged.worse_at.run, judged.before_worse and judged.before_worse.run)
    if judged.accused is None or judged.probability is None or judged.probability >= SURE:
        return words
    good, bad = (commit_of(night.run) for night in judged.accused)
    return f"{words} ({100.0 * judged.probability:.0f} % sure; surely after {good}, up to {bad})"


def blame(bad: Run, good: Run | None) -> str:
    """Which commit, or which range of commits, a change came with."""
    if good is None:
        return f"first bad commit {commit_of(bad)}, last good unknown"
    if bad.engine.git_hash and good.engine.git_hash not in ("", *bad.engine.parents):
        return f"bad since {commit_of(bad)}, last good {commit_of(good)}: any commit between may be the first"
    return f"first bad commit {commit_of(bad)}, last good {commit_of(good)}"


@no_collection()
def judge_all(histories: Mapping[str, SeriesHistory], accepted: Sequence[Accepted] = ()) -> dict[str, Told]:
    """Every series with the verdict of each of its nights, by key."""
    return {
        key: Told(
            key,
            found.definition,
            tuple(
                calm_nights(found.definition, judge_history(key, found.definition, found.points, accepted))
            ),
        )
        for key, found in histories.items()
    }


def judge_history(
    key: str, definition: SeriesDefinition, history: Sequence[Point], accepted: Sequence[Accepted] = ()
) -> list[Judged]:
    """Every night's verdict, oldest first."""
    taken = [level for level in accepted if level.names(key)]
    if is_noisy(definition):
        return _judge_times(key, definition, history, taken)
    lanes = lanes_of(history, _question)
    if len(lanes) < 2:
        return list(_judge_values(key, definition, history, taken))
    found: dict[int, Judged] = {}
    for places in lanes:
        told = _judge_values(key, definition, [history[i] for i in places], taken)
        found |= zip(places, told, strict=True)
        if (start := places[0]) > 0 and found[start].verdict.word == "new":
            why = Verdict(word="not_comparable", sentence=_why_not(history[start - 1], history[start]))
            found[start] = msgspec.structs.replace(found[start], verdict=why)
    return [found[place] for place in range(len(history))]


def lanes_of(history: Sequence[Point], lane: Callable[[Point], Hashable]) -> list[list[int]]:
    """The places of the nights that can be compared with each other, lane by lane, in the order of their firsts."""
    versions, machines = set(map(VERSION, history)), set(map(id, map(MACHINE, history)))
    if len(versions) == len(machines) == 1:
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


def _question(night: Point) -> Hashable:
    """Values are comparable under one definition of the test in one float environment."""
    return night.test_version, night.run.machine.float_environment


def on_one_clock(night: Point) -> Hashable:
    """Run times are comparable under one definition of the test on one machine."""
    return night.test_version, night.run.machine.fingerprint


def is_noisy(definition: SeriesDefinition) -> bool:
    """Whether the same build may give another value: run times only."""
    return definition.kind == "time"


def is_read_off(definition: SeriesDefinition) -> bool:
    """Whether a time is read off a ladder: time to an error, error in a time."""
    return definition.metric.endswith((":time-to-error", ":error-in-time"))


def _judge_values(
    key: str, definition: SeriesDefinition, history: Sequence[Point], accepted: Sequence[Accepted]
) -> Iterator[Judged]:
    level: Point | None = None  # the last night that was not red
    release: Point | None = None  # the last release, or the first night there is
    settled: Point | None = None  # the last accepted level, or the first night there is
    red: Judged | None = None  # the night before, if it was red
    calm: Class | None = None  # what the night before stood for, if it can be repeated without a look
    gone: set[float] = set()  # bad values that had been mended
    lent: tuple[Point, Accepted] | None = None  # the level before one that is accepted until a day
    failing: Point | None = None  # the last night that was expected to fail
    looked = 0  # from here on nights were repeated without a look whether they are releases
    for place, night in enumerate(history):
        if lent is not None and lent[1].over(night_of(night.run)):
            level, lent, calm = lent[0], None, None  # what was lent is due: the old level counts again
            release = settled = level
        sample = night.sample
        if (
            calm is not None
            and level is not None
            and ((sample is level.sample and sample.value == sample.value) or _repeats(level, night))
        ):
            yield Judged(night=night, verdict=IDENTICAL, state="green", stands=calm, against=level)
            level = night
            continue
        release = next((old for old in reversed(history[looked:place]) if is_release(old.run)), release)
        looked = place + 1
        own = standing(definition, night.sample)
        if own == "none":  # the engine cannot be asked this: nothing became of the level that holds
            unasked = Verdict(word="not_comparable", sentence="not supported by this engine")
            yield Judged(night=night, verdict=unasked, state="unjudged", stands=own)
            calm = None
            continue
        broken = own in ("fail", "watch")
        if level is None or settled is None or release is None or not _comparable(level, night):
            word, why = (
                ("new", "the first value") if level is None else ("not_comparable", _why_not(level, night))
            )
            level = release = settled = night
            verdict, against = Verdict(word=word, sentence=why), None  # type: ignore[arg-type]
            red = None
        else:
            verdict, against = _judged(definition, level, release, settled, night)
            if verdict.word == "regressed" and night.value in gone:
                words = f"{verdict.sentence}; this value came and went before"
                verdict = replace(verdict, name="flip-flop", sentence=words)
        bad = verdict.red or broken
        gone_for_good = night.sample.outcome == "missing" and night.sample.failure.startswith("removed")
        taken = acceptance(accepted, key, night.value, night_of(night.run), gone_for_good) if bad else None
        if taken is not None and taken.expected:  # the level from before stays
            words = f"expected to fail; {verdict.sentence}"
            if failing is not None and (grown := _against(definition, failing, night)).red:
                words += f"; since {commit_of(failing.run)}: {grown.sentence}"
            failing = night
            known = replace(verdict, word="expected", sentence=words, name="")
            ended: State = "accepted" if red is not None else "green"
            red, calm = None, None
            yield Judged(
                night=night,
                verdict=known,
                state=ended,
                stands="accepted",
                against=against,
                accepted=str(taken),
            )
            continue
        if bad and taken is None:
            worse = red is None or _worsened(definition, red.night, night)
            good = (
                None if level is night or standing(definition, level.sample) in ("fail", "watch") else level
            )
            if red is not None and red.last_good is not None:
                good = red.last_good
            red = Judged(
                night=night,
                verdict=verdict,
                state="detected",
                stands=red_class(own, night.sample),
                against=against,
                first_bad=night if red is None or red.first_bad is None else red.first_bad,
                last_good=good,
                worse_at=night if worse or red is None else red.worse_at,
                before_worse=(red.night if red else good) if worse or red is None else red.before_worse,
            )
            calm = None
            yield red
            continue
        state: State = "accepted" if bad else "recovered" if red is not None else "green"
        if red is not None:
            gone.add(red.night.value)
        yield Judged(
            night=night,
            verdict=verdict,
            state=state,
            stands="accepted" if bad else own,
            against=against,
            accepted=str(taken) if bad else "",
        )
        if taken is not None and taken.until is not None and level is not night:
            lent = lent or (level, taken)
        elif bad or verdict.word in ("improved", "fixed"):
            lent = None
        level, red, calm = night, None, None if bad or lent else own
        if bad or verdict.word in ("improved", "fixed"):
            release = settled = night
        if is_release(night.run):
            release = night


def red_class(own: Class, sample: Sample) -> Class:
    """A limit broken or no value is FAIL; what only became worse than it was is WATCH."""
    return (
        "fail" if own == "fail" or sample.outcome in NO_VALUE or not math.isfinite(sample.value) else "watch"
    )


def _repeats(before: Point, after: Point) -> bool:
    """The same bits of the same state under the same definition: nothing to judge. Both are of one lane."""
    old, new = before.sample, after.sample
    return (
        old.value == new.value
        and same_bits(old.value, new.value)
        and old.outcome == new.outcome
        and old.set_point_held == new.set_point_held
        and (old.state_hash == new.state_hash or "" in (old.state_hash, new.state_hash))
    )


def _judged(
    definition: SeriesDefinition, level: Point, release: Point, settled: Point, night: Point
) -> tuple[Verdict, Point]:
    """Against the level that holds, then against the last release, then against the last accepted level."""
    verdict = _against(definition, level, night)
    if verdict.red:
        return verdict, level
    for anchor, allowed in ((release, 1.0), (settled, LONG_DRIFT)):
        if anchor is level:
            continue
        wide = replace_tolerance(definition, allowed)
        drifted = _against(wide, anchor, night)
        if drifted.word == "regressed":
            return _drift(drifted, anchor), anchor
        if drifted.word == "improved" and verdict.word == "changed" and allowed == 1.0:
            return _drift(drifted, anchor), anchor
    return verdict, level


def replace_tolerance(definition: SeriesDefinition, factor: float) -> SeriesDefinition:
    """The definition with so many times its tolerances."""
    if factor == 1.0:
        return definition
    return msgspec.structs.replace(
        definition,
        tolerance=factor * definition.tolerance,
        relative_tolerance=factor * definition.relative_tolerance,
    )


def _worsened(definition: SeriesDefinition, before: Point, after: Point) -> bool:
    """Whether a red night is worse than the red night before it."""
    return _against(definition, before, after).red


def _drift(verdict: Verdict, anchor: Point) -> Verdict:
    words = f"{verdict.sentence}, little by little since {anchor.run.engine.version}"
    return replace(verdict, name="drift" if verdict.red else "", sentence=words)


def _against(definition: SeriesDefinition, before: Point, after: Point) -> Verdict:
    return judge(definition, before.sample, after.sample, same_commit=same_commit(before.run, after.run))


def same_commit(before: Run, after: Run) -> bool:
    """Built from one clean commit of one engine: the answers must agree bit for bit."""
    old, new = before.engine, after.engine
    clean = old.git_hash != "" and not old.dirty and not new.dirty
    return clean and (old.name, old.git_hash) == (new.name, new.git_hash)


def _comparable(before: Point, after: Point) -> bool:
    same_test = before.test_version == after.test_version
    return same_test and before.run.machine.float_environment == after.run.machine.float_environment


def _why_not(before: Point, after: Point) -> str:
    if before.test_version != after.test_version:
        return NEW_DEFINITION
    return "measured in another float environment"


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
        looked_at = looked_at_again(len(every), NOISY_NIGHTS)
        again = [every[i] for i in looked_at]
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
            ages=[i for i in looked_at if every[i] not in loud],
        )
        verdicts, segments = walk_with(walk, taken, [night_of(night.run) for night in lane])
        level_of = {i: segment for segment in segments for i in range(segment.first, segment.last + 1)}
        verdicts = [
            noisy._replace(verdict=by_outcome(noisy.verdict, night.sample))
            for noisy, night in zip(verdicts, lane, strict=True)
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
            before = lane[noisy.worse_at - 1] if noisy.worse_at else good
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
