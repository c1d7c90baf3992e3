"""The history of a series, judged night by night: what is red, since when, and whether it came back.

A night is compared with the level that holds: the last night that was not red. A red level is not taken over,
so it stays red until it is mended or accepted. Small steps that each stay inside the tolerance are caught by
comparing with the last release as well, and are called drift. Values without noise are judged after one run,
exactly; run times by the robust statistics of tracker/judge/noise.py.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from typing import Any, Literal, Protocol

from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    MapData,
    Sample,
    SeriesDefinition,
    from_number,
)
from spook_tracker.tracker.judge.accepted import Accepted, acceptance
from spook_tracker.tracker.judge.noise import judge_noisy
from spook_tracker.tracker.judge.verdict import Verdict, judge, judge_map

RELEASE = re.compile(r"v?\d+(\.\d+)*")
NOISY_NIGHTS = 400  # how far back run times are judged again
State = Literal["green", "detected", "accepted", "recovered", "suspected"]


class Run(Protocol):
    """What is read of a run: tracker.store.history.RunInfo, or any value with these."""

    @property
    def id(self) -> str: ...
    @property
    def started(self) -> str: ...
    @property
    def engine(self) -> EngineVersion: ...
    @property
    def machine(self) -> Machine: ...


@dataclass(frozen=True, slots=True)
class Night:
    """One value in the history of a series."""

    run: Run
    sample: Sample
    test_version: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A night with its verdict. `against` is the night it was compared with."""

    night: Night
    verdict: Verdict
    state: State
    against: Night | None = None
    first_bad: Night | None = None  # where the present red began
    last_good: Night | None = None
    accepted: str = ""

    @property
    def red(self) -> bool:
        return self.state == "detected"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What became of one series or map tonight."""

    series: str
    definition: SeriesDefinition | None  # None for a map
    test: str
    judged: Judged | None  # None for a map
    verdict: Verdict
    red: bool

    @property
    def first_bad(self) -> str:
        """The commit where it began, as far as the history knows."""
        if self.judged is None or self.judged.first_bad is None:
            return ""
        return commit_of(self.judged.first_bad.run)

    @property
    def last_good(self) -> str:
        if self.judged is None or self.judged.last_good is None:
            return ""
        return commit_of(self.judged.last_good.run)


def commit_of(run: Run) -> str:
    """How a reader finds the version: twelve digits of its commit, or its version."""
    return run.engine.git_hash[:12] or run.engine.version


def night_of(run: Run) -> date:
    """The day of a run in UTC."""
    return datetime.fromisoformat(run.started).astimezone(UTC).date()


def is_release(run: Run) -> bool:
    """Whether the engine's version is one that was released, not one in between."""
    return RELEASE.fullmatch(run.engine.version) is not None and not run.engine.dirty


def nights(points: Iterable[Iterable[Any]]) -> list[Night]:
    """Nights from (run, sample, test version), as the history keeps them, in commit order."""
    return [Night(*point) for point in points]


def judge_history(
    key: str, definition: SeriesDefinition, history: Sequence[Night], accepted: Sequence[Accepted] = ()
) -> list[Judged]:
    """Every night's verdict, oldest first."""
    if is_noisy(definition):
        return _judge_times(key, definition, history, accepted)
    return list(_judge_values(key, definition, history, accepted))


def is_noisy(definition: SeriesDefinition) -> bool:
    """Whether the same build may give another value: run times only."""
    return definition.kind == "time"


def _judge_values(
    key: str, definition: SeriesDefinition, history: Sequence[Night], accepted: Sequence[Accepted]
) -> Iterator[Judged]:
    level: Night | None = None  # the last night that was not red
    release: Night | None = None  # the last release, or the first night there is
    first_bad: Night | None = None
    for night in history:
        if level is None or not _comparable(level, night):
            why = "the first value" if level is None else _why_not(level, night)
            word: Literal["new", "not_comparable"] = "new" if level is None else "not_comparable"
            level, release, first_bad = night, night, None
            state: State = "green"
            if _broken(definition, night):
                state, first_bad = "detected", night
            yield Judged(
                night=night, verdict=Verdict(word=word, sentence=why), state=state, first_bad=first_bad
            )
            continue
        verdict = _against(definition, level, night)
        against = level
        if not verdict.red and release is not None and release is not level:
            drifted = _against(definition, release, night)
            if drifted.word == "regressed":
                verdict, against = _drift(drifted, release), release
        taken = acceptance(accepted, key, from_number(night.sample.value), night_of(night.run))
        bad = verdict.red or _broken(definition, night)
        if bad and taken is None:
            first_bad = first_bad or night
            yield Judged(
                night=night,
                verdict=verdict,
                state="detected",
                against=against,
                first_bad=first_bad,
                last_good=None if _broken(definition, level) else level,
            )
            continue
        state = "accepted" if bad else "recovered" if first_bad is not None else "green"
        yield Judged(
            night=night,
            verdict=verdict,
            state=state,
            against=against,
            accepted=str(taken) if bad else "",
        )
        level, first_bad = night, None
        if bad or is_release(night.run) or verdict.word in ("improved", "fixed"):
            release = night


def _broken(definition: SeriesDefinition, night: Night) -> bool:
    """Outside a limit that decides, whatever the nights before were: red until it holds or is accepted."""
    return not night.sample.passed and definition.role != "reported"


def _drift(verdict: Verdict, release: Night) -> Verdict:
    version = release.run.engine.version
    return replace(verdict, name="drift", sentence=f"{verdict.sentence}, little by little since {version}")


def _against(definition: SeriesDefinition, before: Night, after: Night) -> Verdict:
    return judge(definition, before.sample, after.sample, same_commit=_same_commit(before.run, after.run))


def _same_commit(before: Run, after: Run) -> bool:
    old, new = before.engine, after.engine
    clean = old.git_hash != "" and not old.dirty and not new.dirty
    return clean and (old.name, old.git_hash) == (new.name, new.git_hash)


def _comparable(before: Night, after: Night) -> bool:
    same_test = before.test_version == after.test_version
    return same_test and before.run.machine.float_environment == after.run.machine.float_environment


def _why_not(before: Night, after: Night) -> str:
    if before.test_version != after.test_version:
        return "the definition of the test changed"
    return "measured in another float environment"


def _judge_times(
    key: str, definition: SeriesDefinition, history: Sequence[Night], accepted: Sequence[Accepted]
) -> list[Judged]:
    """Run times: each machine and each definition of the test is a history of its own."""
    lanes: dict[tuple[str, str], list[int]] = {}
    for place, night in enumerate(history):
        lanes.setdefault((night.run.machine.fingerprint, night.test_version), []).append(place)
    found: dict[int, Judged] = {}
    for places in lanes.values():
        lane = [history[place] for place in places]
        values = [from_number(night.sample.value) for night in lane]
        taken = [
            acceptance(accepted, key, value, night_of(night.run))
            for night, value in zip(lane, values, strict=True)
        ]
        verdicts = judge_noisy(
            values,
            larger_is_better=definition.better == "larger",
            releases=[is_release(night.run) for night in lane],
            accepted=[level is not None for level in taken],
        )
        for i, noisy in enumerate(verdicts):
            found[places[i]] = Judged(
                night=lane[i],
                verdict=noisy.verdict,
                state=noisy.state,
                against=lane[noisy.against] if noisy.against is not None else None,
                first_bad=lane[noisy.first_bad] if noisy.first_bad is not None else None,
                last_good=lane[noisy.last_good] if noisy.last_good is not None else None,
                accepted=str(taken[i]) if noisy.state == "accepted" else "",
            )
    return [found[place] for place in range(len(history))]


def judge_run(
    histories: Mapping[str, tuple[SeriesDefinition, Sequence[Night]]],
    run: Run,
    accepted: Sequence[Accepted] = (),
) -> list[Finding]:
    """What each series measured in `run` came to, judged against the nights before it; red first."""
    findings = []
    for key, (definition, history) in histories.items():
        until = next((i for i in reversed(range(len(history))) if history[i].run.id == run.id), None)
        if until is None:
            continue
        told = telling(definition, history[: until + 1])
        judged = judge_history(key, definition, told, accepted)[-1]
        findings.append(
            Finding(
                series=key,
                definition=definition,
                test=definition.test,
                judged=judged,
                verdict=judged.verdict,
                red=judged.red,
            )
        )
    return sorted(findings, key=lambda finding: (not finding.red, finding.series))


def telling(definition: SeriesDefinition, history: Sequence[Night]) -> Sequence[Night]:
    """The nights that can change the last verdict: of a stretch of equal values its ends and its releases."""
    if is_noisy(definition):
        return history[-NOISY_NIGHTS:]
    facts = [
        (
            repr(night.sample.value),
            night.sample.outcome,
            night.sample.state_hash,
            night.test_version,
            night.run.machine.float_environment,
        )
        for night in history
    ]
    last = len(history) - 1
    return [
        night
        for i, night in enumerate(history)
        if i in (0, last) or facts[i] != facts[i - 1] or facts[i] != facts[i + 1] or is_release(night.run)
    ]


def judge_maps(before: Sequence[MapData], after: Sequence[MapData]) -> list[Finding]:
    """Tonight's stability maps against those of an earlier night."""
    old = {(m.test, m.configuration, m.name): m for m in before}
    findings = []
    for new in after:
        earlier = old.get((new.test, new.configuration, new.name))
        if earlier is None:
            continue
        verdict = judge_map(earlier, new)
        key = f"{new.test}/{new.configuration}/map:{new.name}"
        findings.append(
            Finding(series=key, definition=None, test=new.test, judged=None, verdict=verdict, red=verdict.red)
        )
    return findings
