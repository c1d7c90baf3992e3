"""Two runs side by side: every series, map and run time with its verdict, and one verdict over all.

Takes plain values (definitions, samples, maps) so that it can be asked without a database.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Any, Literal

import msgspec

from spook_tracker.tracker.document.run_document import MapData, Sample, SeriesDefinition, from_number
from spook_tracker.tracker.document.wording import slug
from spook_tracker.tracker.judge.accepted import Accepted, acceptance
from spook_tracker.tracker.judge.compare_ladders import frontiers, run_times
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument, Side
from spook_tracker.tracker.judge.noise import Usual, judge_time
from spook_tracker.tracker.judge.verdict import RED, Verdict, judge, judge_map

Samples = Mapping[str, tuple[SeriesDefinition, Sample]]
FAMILY = {
    "scalar": "values",
    "ladder": "sweep",
    "order": "sweep",
    "time": "sweep",
    "break_point": "stability",
}
GROSS = 0.3  # decades: a time read off one session that doubled is worth a line, though it proves nothing
ORDER = (
    "missing",
    "regressed",
    "non_deterministic",
    "accepted",
    "not_comparable",
    "fixed",
    "improved",
    "changed",
    "new",
    "not_measured",
    "same",
    "identical",
)


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One side of a comparison."""

    side: Side
    samples: Samples
    maps: Sequence[MapData] = ()

    @property
    def night(self) -> date:
        return datetime.fromisoformat(self.side.started).astimezone(UTC).date()


def side_of(run: Any) -> Side:
    """The run (tracker.store.history.RunInfo or a RunDocument) as one side."""
    return Side(
        run=run.id,
        engine=run.engine.name,
        version=run.engine.version,
        git_hash=run.engine.git_hash,
        dirty=run.engine.dirty,
        started=run.started,
        machine=run.machine.fingerprint,
        float_environment=run.machine.float_environment,
    )


def compare(
    before: Measured,
    after: Measured,
    accepted: Sequence[Accepted] = (),
    first_bad: Mapping[str, tuple[str, str]] | None = None,
    usual: Mapping[str, Usual] | None = None,
) -> CompareDocument:
    """What changed from one to the other.

    `first_bad`: by series, the last good and first bad commit. `usual`: by series of run times, their level at
    the earlier version and the relative change that stands clear of their noise, where history knows them.
    """
    changes = _series_changes(before, after, usual or {}) + _map_changes(before, after)
    same_machine = before.side.machine == after.side.machine
    if same_machine and before.side.run != after.side.run:
        changes += run_times(before.samples, after.samples)
    changes = [_known(_accept(change, accepted, after.night), first_bad or {}) for change in changes]
    changes.sort(key=lambda change: (ORDER.index(change.word), change.role != "gate", change.series))
    verdict = _overall(changes)
    return CompareDocument(
        schema_version=1,
        before=before.side,
        after=after.side,
        verdict=verdict,
        exit_code={"regressed": 1, "not_comparable": 3}.get(verdict, 0),  # type: ignore[arg-type]
        counts=dict(Counter(change.word for change in changes)),
        changes=tuple(changes),
        frontiers=tuple(frontiers(before.samples, after.samples, same_machine)),
        notes=tuple(_notes(before, after, changes)),
    )


def _overall(changes: Sequence[Change]) -> Literal["identical", "same", "regressed", "not_comparable"]:
    """Red before anything; then whether what decides could be compared at all."""
    if any(change.red for change in changes):
        return "regressed"
    compared = [c for c in changes if c.word not in ("not_comparable", "new", "not_measured")]
    values = [change for change in changes if change.kind not in ("time", "run_time")]
    if not compared or any(c.word == "not_comparable" and c.role != "reported" for c in values):
        return "not_comparable"
    told = [change for change in compared if change.kind not in ("time", "run_time")] or compared
    return "identical" if all(change.word == "identical" for change in told) else "same"


def _series_changes(before: Measured, after: Measured, usual: Mapping[str, Usual]) -> list[Change]:
    old_run, new_run = before.side, after.side
    measured = {(definition.test, FAMILY[definition.kind]) for definition, _ in after.samples.values()}
    changes = []
    for key in before.samples.keys() | after.samples.keys():
        old, new = before.samples.get(key), after.samples.get(key)
        if old is None and new is not None:
            verdict = Verdict(word="new", sentence="measured for the first time")
            changes.append(_change(key, new[0], None, new[1], verdict))
        elif new is None and old is not None:
            asked = (old[0].test, FAMILY[old[0].kind]) in measured
            changes.append(_gone(key, old, asked))
        elif old is not None and new is not None:
            if new[0].kind == "time" and from_number(new[1].value) != from_number(old[1].value):
                same_machine = before.side.machine == after.side.machine
                verdict = _time_scalar(old, new, same_machine, usual.get(key))
            else:
                verdict = judge(
                    new[0],
                    old[1],
                    new[1],
                    same_definition=old[0].test_version == new[0].test_version,
                    same_environment=old_run.float_environment == new_run.float_environment,
                    same_commit=same_commit(old_run, new_run),
                )
            changes.append(_change(key, new[0], old[1], new[1], verdict))
    return changes


def same_commit(before: Side, after: Side) -> bool:
    """Built from one clean commit of one engine: the answers must agree bit for bit."""
    clean = before.git_hash != "" and not before.dirty and not after.dirty
    return clean and (before.engine, before.git_hash) == (after.engine, after.git_hash)


def _gone(key: str, old: tuple[SeriesDefinition, Sample], asked: bool) -> Change:
    """A value that is not there: a gap where the test was run, silence where it was not asked."""
    definition, sample = old
    if asked and definition.kind != "time":
        verdict = Verdict(word="missing", sentence="no longer measured by this test", name="missing")
        return _change(key, definition, sample, None, verdict)
    change = _change(key, definition, sample, None, Verdict(word="same", sentence="not measured in this run"))
    return msgspec.structs.replace(change, word="not_measured")


def _time_scalar(
    old: tuple[SeriesDefinition, Sample],
    new: tuple[SeriesDefinition, Sample],
    same_machine: bool,
    usual: Usual | None,
) -> Verdict:
    """Scalars read off one timing session carry its noise: their size is judged where history knows it."""
    if not same_machine:
        return Verdict(word="not_comparable", sentence="run times of another machine")
    verdict = judge(new[0], old[1], new[1], same_definition=old[0].test_version == new[0].test_version)
    if verdict.word in ("regressed", "improved", "changed") and old[1].outcome == new[1].outcome:
        if usual is not None:
            return judge_time(usual, from_number(new[1].value), new[0].better == "larger")
        gross = abs(verdict.decades or 0.0) > GROSS
        words = f"{verdict.sentence}, of one timing session"
        return Verdict(word="changed" if gross else "same", sentence=words, decades=verdict.decades)
    return verdict


def _change(
    key: str,
    definition: SeriesDefinition,
    before: Sample | None,
    after: Sample | None,
    verdict: Verdict,
) -> Change:
    return Change(
        series=key,
        test=definition.test,
        metric=definition.metric,
        configuration=definition.configuration,
        role=definition.role,
        kind=definition.kind,
        unit=definition.unit,
        word=verdict.word,
        red=verdict.word in RED,
        name=verdict.name,
        sentence=verdict.sentence,
        before=before.value if before else None,
        after=after.value if after else None,
        before_outcome=before.outcome if before else None,
        after_outcome=after.outcome if after else None,
        limit=definition.limit,
        decades=verdict.decades,
        ulps=verdict.ulps,
        page=page_of(definition.test),
    )


def _map_changes(before: Measured, after: Measured) -> list[Change]:
    old_maps = {(m.test, m.configuration, m.name): m for m in before.maps}
    changes = []
    for new in after.maps:
        key = (new.test, new.configuration, new.name)
        old = old_maps.get(key)
        if old is None:
            continue
        verdict = judge_map(old, new)
        changes.append(
            Change(
                series="/".join((new.test, new.configuration, f"map:{new.name}")),
                test=new.test,
                metric=f"map:{new.name}",
                configuration=new.configuration,
                role="companion",
                kind="map",
                unit="",
                word=verdict.word,
                red=verdict.red,
                name=verdict.name,
                sentence=verdict.sentence,
                before=None,
                after=None,
                before_outcome=None,
                after_outcome=None,
                limit=None,
                page=page_of(new.test),
            )
        )
    return changes


def _accept(change: Change, accepted: Sequence[Accepted], night: date) -> Change:
    """A red change at an accepted level is not red; it says who took it and why."""
    if not change.red or change.after is None:
        return change
    level = acceptance(accepted, change.series, from_number(change.after), night)
    if level is None:
        return change
    return msgspec.structs.replace(change, word="accepted", red=False, accepted=str(level))


def _known(change: Change, first_bad: Mapping[str, tuple[str, str]]) -> Change:
    if not change.red or change.series not in first_bad:
        return change
    good, bad = first_bad[change.series]
    return msgspec.structs.replace(change, last_good=good, first_bad=bad)


def _notes(before: Measured, after: Measured, changes: Sequence[Change]) -> list[str]:
    notes = []
    if before.side.machine != after.side.machine:
        notes.append("run times are not compared: the runs are of different machines")
    if before.side.float_environment != after.side.float_environment:
        notes.append("values are not compared: the runs are of different float environments")
    if before.side.engine != after.side.engine:
        notes.append(f"different engines: {before.side.engine} and {after.side.engine}")
    silent = sorted({change.test for change in changes if change.word == "not_measured"})
    if silent:
        notes.append(f"in part not measured in the later run: {', '.join(silent)}")
    return notes


def page_of(test: str) -> str:
    """The page of the website about a test."""
    return f"tests/{slug(test)}.html"
