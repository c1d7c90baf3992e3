"""Two runs side by side: every series, map and run time with its verdict, and one verdict over all.

Takes plain values (definitions, samples, maps) so that it can be asked without a database.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime
from typing import Literal

import msgspec

from spook_tracker.tracker.document.run_document import MapData, Run, Sample, SeriesDefinition

from .accepted import Accepted, acceptance
from .compare_ladders import frontiers, run_times
from .comparison_document import Change, CompareDocument, Side
from .explaining import TIMES, beside_run_times, calm
from .judged import BY_TIME, Judged, of_one_lineage, red_class
from .known import Known, known, newest_in
from .lane import (
    Records,
    asked_for,
    asked_in,
    asked_whole,
    histories,
    line_of,
    run_time_histories,
)
from .maps import NO_MAP, map_key, stands_of
from .series_history import Told, judge_all
from .slower import CONFIRM, Usual, judge_time, only_followed, to_be_confirmed
from .standing import FOLLOWED, NO_VALUE, honest, standing
from .tonight import not_compared
from .verdict import Verdict, judge, judge_map
from .vocabulary import OVERALL, RED, WORD_RANK, Class, Overall, Word
from .work import families_of, is_read_off

Samples = Mapping[str, tuple[SeriesDefinition, Sample]]
MOST_NAMES = 5  # of series, in a note
DOUBLED = 0.3  # decades: a time read off one session that doubled is worth a line, though it proves nothing


@dataclass(frozen=True, kw_only=True)
class ComparedRun:
    """One side of a comparison."""

    side: Side
    samples: Samples
    maps: Sequence[MapData] = ()
    whole: bool = False  # the whole catalogue was asked: what is not there was removed
    asked: Mapping[str, set[str]] | None = None  # tests by family; None: those it measured
    dropped: Collection[str] = ()  # keys of maps it may have had (tracker.judge.maps.may_be_dropped)
    runs: tuple[str, ...] = ()  # ids, the newest first, where the samples are of several

    @property
    def night(self) -> date:
        return datetime.fromisoformat(self.side.started).astimezone(UTC).date()


def side_of(run: Run) -> Side:
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
    before: ComparedRun,
    after: ComparedRun,
    accepted: Sequence[Accepted] = (),
    history: Known | None = None,
) -> CompareDocument:
    """What changed from one to the other; `history` is what is known about both beyond themselves."""
    history = history or Known()
    changes = _series_changes(before, after, history) + _map_changes(before, after)
    same_machine = before.side.machine == after.side.machine
    if same_machine and before.side.run != after.side.run:
        timed = run_times(before.samples, after.samples, history.usual.keys())
        changes += [_in_history(change, history) for change in timed]
    changes = beside_run_times(list(map(calm, changes)), before.samples, after.samples)
    changes = [_blamed(accept(change, accepted, after.night), history) for change in changes]
    changes.sort(key=lambda change: (WORD_RANK[change.word], change.role != "gate", change.series))
    verdict = overall(changes)
    return CompareDocument(
        schema_version=1,
        before=before.side,
        after=after.side,
        verdict=verdict,
        exit_code=exit_code(verdict),
        counts=dict(Counter(change.word for change in changes)),
        changes=tuple(changes),
        frontiers=tuple(frontiers(before.samples, after.samples, same_machine)),
        notes=tuple(_notes(before, after, changes)),
    )


def compare_in(
    records: Records,
    before: tuple[Run, ComparedRun],
    after: tuple[Run, ComparedRun],
    accepted: Sequence[Accepted] = (),
    against_history: bool = False,
) -> CompareDocument:
    """`compare` with what the history knows: the noise of run times, the first bad commit of what is red.

    The two measurements decide. Times that are red against their history and not against the earlier run are told by
    name; with `against_history` they are red here, too.
    """
    (old, earlier), (new, later) = before, after
    runs = [run for run in records.runs() if run.engine.name == new.engine.name]
    olds, news = earlier.runs or (old.id,), later.runs or (new.id,)
    newest = next((run for run in reversed(runs) if run.id in (*olds, *news)), new)
    line = line_of(runs, newest)
    rungs = {key for key, (d, s) in later.samples.items() if d.kind == "ladder" and s.timing is not None}
    alone = {key for key, (d, _) in later.samples.items() if d.kind == "time" and not is_read_off(d)}
    told: dict[str, Told] = {}
    if rungs and len(line) > 1:
        told |= judge_all(run_time_histories(records, line, rungs), accepted)
    if alone and len(line) > 1:
        told |= judge_all(histories(records, line, alone), accepted)
    measured = [run for run in runs if run.id in news] or [new]
    whole = any(map(asked_whole, measured))
    later = replace(later, whole=whole, asked=_asked(measured, later.samples))
    document = compare(earlier, later, accepted, known(told, olds, news))
    reds = {change.series for change in document.changes if change.red} - told.keys()
    times = dict(told)
    if reds:
        told |= judge_all(histories(records, line, reds), accepted)
        document = compare(earlier, later, accepted, known(told, olds, news))
    standing = {key: judged for key, judged in newest_in(times, news).items() if judged.red}
    document = _beside_history(document, standing, against_history)
    if of_one_lineage(line) or not any(change.first_bad for change in document.changes):
        return document
    return msgspec.structs.replace(document, notes=(*document.notes, f"the history is {BY_TIME}"))


def _asked(runs: Sequence[Run], samples: Samples) -> dict[str, set[str]]:
    """The tests that the runs of one side were asked for together, by family."""
    asked: dict[str, set[str]] = {}
    for run in runs:
        for family, tests in asked_for(run, samples).items():
            asked.setdefault(family, set()).update(tests)
    return asked


def _beside_history(
    document: CompareDocument, standing: Mapping[str, Judged], decides: bool
) -> CompareDocument:
    """The same, with the times that only their history calls red: in a note, or red where they decide."""
    only = {c.series for c in document.changes if not c.red and c.stands != "accepted"} & standing.keys()
    if not only:
        return document
    if not decides:
        names = ", ".join(sorted(only)[:MOST_NAMES]) + (", …" if len(only) > MOST_NAMES else "")
        many = "1 time is" if len(only) == 1 else f"{len(only)} times are"
        words = f"{many} red against the history and not against {document.before.version}: {names}; --against-history decides by that"
        return msgspec.structs.replace(document, notes=(*document.notes, words))
    changes = [
        _by_history(change, standing[change.series]) if change.series in only else change
        for change in document.changes
    ]
    changes.sort(key=lambda change: (WORD_RANK[change.word], change.role != "gate", change.series))
    verdict = overall(changes)
    return msgspec.structs.replace(
        document,
        changes=tuple(changes),
        counts=dict(Counter(change.word for change in changes)),
        verdict=verdict,
        exit_code=exit_code(verdict),
    )


def _by_history(change: Change, judged: Judged) -> Change:
    """The change from the level before to tonight's, as the history tells it."""
    told = judged.verdict
    before, after = judged.levels or (change.before, change.after)
    return msgspec.structs.replace(
        change, word="regressed", red=True, stands="watch", name=told.name or "slower", decades=told.decades, before=before, after=after,
        sentence=f"{told.sentence}, against the history",
    )  # fmt: skip


def overall(changes: Sequence[Change]) -> Overall:
    """Red before anything; then whether what decides could be compared at all."""
    if any(change.red for change in changes):
        return "regressed"
    compared = [c for c in changes if c.word not in ("not_comparable", "new", "not_measured")]
    values = [change for change in changes if change.kind not in TIMES]
    if not compared or any(c.word == "not_comparable" and c.role not in FOLLOWED for c in values):
        return "not_comparable"
    told = [change for change in compared if change.kind not in TIMES] or compared
    return "identical" if all(change.word == "identical" for change in told) else "same"


def exit_code(verdict: Overall) -> Literal[0, 1, 3]:
    """What a command ends with."""
    return OVERALL[verdict].code


def _series_changes(before: ComparedRun, after: ComparedRun, history: Known) -> list[Change]:
    old_run, new_run = before.side, after.side
    asked_of = asked_in(after.samples) if after.asked is None else after.asked
    changes = []
    for key in before.samples.keys() | after.samples.keys():
        old, new = before.samples.get(key), after.samples.get(key)
        if (old is None or new is None) and (old or new)[0].kind == "work":  # type: ignore[index]
            continue  # a sum of what is told by itself
        if old is None and new is not None:
            verdict = Verdict(word="new", sentence="measured for the first time")
            changes.append(_change(key, new[0], None, new[1], verdict))
        elif new is None and old is not None:
            of_times = old[0].kind == "time"
            here = not of_times or old_run.machine == new_run.machine
            families = families_of(old[0]) if here else ()
            asked = any(old[0].test in asked_of.get(family, ()) for family in families)
            removed = after.whole and old[0].role == "gate" and any(f in asked_of for f in families)
            changes.append(_gone(key, old, asked, removed))
        elif old is not None and new is not None:
            if why := _another_question(old[0], new[0]):
                verdict = Verdict(word="not_comparable", sentence=why)
            elif new[0].kind == "time" and new[1].value != old[1].value:
                same_machine = before.side.machine == after.side.machine
                verdict = _time_scalar(old, new, same_machine, history.usual.get(key))
                verdict = to_be_confirmed(verdict) if key in history.suspected else verdict
                verdict = only_followed(verdict) if is_read_off(new[0]) else verdict
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


def _gone(key: str, old: tuple[SeriesDefinition, Sample], missed: bool, removed: bool) -> Change:
    """A value that is not there: a gap where the test was run, silence where it was not asked."""
    definition, sample = old
    if sample.outcome == "missing" and (missed or removed):
        still = Verdict(word="identical", sentence="still missing", ulps=0)
        return _change(key, definition, sample, None, still)
    if missed:
        verdict = Verdict(word="missing", sentence="no longer measured by this test", name="missing")
        return _change(key, definition, sample, None, verdict)
    if removed:
        words = "the whole catalogue was asked, and this gate is not in it any more"
        return _change(key, definition, sample, None, Verdict(word="removed", sentence=words, name="removed"))
    change = _change(key, definition, sample, None, Verdict(word="same", sentence="not measured in this run"))
    return msgspec.structs.replace(change, word="not_measured")


def _another_question(old: SeriesDefinition, new: SeriesDefinition) -> str:
    """Why two definitions ask for different numbers though they carry one name and version; else empty."""
    if old.test_version != new.test_version:
        return ""  # told by the judge
    for what in ("unit", "better", "reference", "limit"):
        if getattr(old, what) != getattr(new, what):
            return f"another {what}: {getattr(old, what)} and {getattr(new, what)}"
    return ""


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
            return judge_time(usual, new[1].value, new[0].better == "larger", new[0].unit)
        gross = abs(verdict.decades or 0.0) > DOUBLED
        words = f"{verdict.sentence}, of one timing session"
        return Verdict(word="changed" if gross else "same", sentence=words, decades=verdict.decades)
    return verdict


def _in_history(change: Change, history: Known) -> Change:
    """A run time judged as the nights judge it, where they know its level and noise."""
    if change.series not in history.usual or change.series not in history.values:
        return change
    old, new = history.values[change.series]
    verdict = judge_time(history.usual[change.series], new)
    if change.series in history.suspected:
        verdict = to_be_confirmed(verdict)
    return msgspec.structs.replace(
        change, word=verdict.word, red=verdict.red, stands="watch" if verdict.red else "followed", name=verdict.name, sentence=verdict.sentence,
        before=old, after=new, decades=verdict.decades,
    )  # fmt: skip


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
        stands=_stands(definition, after, verdict),
        name=verdict.name,
        sentence=verdict.sentence,
        before=before.value if before else None,
        after=after.value if after else None,
        before_outcome=honest(before).outcome if before else None,
        after_outcome=honest(after).outcome if after else None,
        limit=definition.limit,
        decades=verdict.decades,
        ulps=verdict.ulps,
        rounding=definition.sensitivity.rounding if definition.sensitivity else None,
    )


def _stands(definition: SeriesDefinition, after: Sample | None, verdict: Verdict) -> Class:
    if after is None:
        return "fail" if verdict.red else "none"
    own = standing(definition, after)
    return red_class(own, after) if verdict.red else own


def _map_changes(before: ComparedRun, after: ComparedRun) -> list[Change]:
    asked = (asked_in(after.samples) if after.asked is None else after.asked).get("stability", set())
    new = {map_key(found): found for found in after.maps}
    changes = []
    for old in before.maps:
        key = map_key(old)
        if key not in new and (old.test not in asked or key in after.dropped):
            continue
        verdict = judge_map(old, new[key]) if key in new else NO_MAP
        changes.append(
            Change(
                series=key,
                test=old.test,
                metric=f"map:{old.name}",
                configuration=old.configuration,
                role="companion",
                kind="map",
                unit="",
                word=verdict.word,
                red=verdict.red,
                stands=stands_of(verdict),
                name=verdict.name,
                sentence=verdict.sentence,
                before=None,
                after=None,
                before_outcome=None,
                after_outcome=None,
                limit=None,
            )
        )
    return changes


def accept(change: Change, accepted: Sequence[Accepted], night: date) -> Change:
    """A red change at an accepted level is not red; it says who took it and why."""
    gone = (change.kind == "map" and change.word == "missing") or change.word == "removed"
    if not change.red or (change.after is None and not gone):
        return change
    value = math.nan if change.after is None else change.after
    level = acceptance(accepted, change.series, value, night, removed=gone)
    if level is None:
        return change
    word: Word = "expected" if level.expected else "accepted"
    return msgspec.structs.replace(change, word=word, red=False, stands="accepted", accepted=str(level))


def _blamed(change: Change, history: Known) -> Change:
    if not change.red or change.series not in history.first_bad:
        return change
    good, bad = history.first_bad[change.series]
    words = history.blame.get(change.series, "")
    return msgspec.structs.replace(change, last_good=good, first_bad=bad, blame=words)


def _notes(before: ComparedRun, after: ComparedRun, changes: Sequence[Change]) -> list[str]:
    notes = []
    if before.side.machine != after.side.machine:
        notes.append("run times are not compared: the runs are of different machines")
    if before.side.float_environment != after.side.float_environment:
        notes.append("values are not compared: the runs are of different float environments")
    if before.side.engine != after.side.engine:
        notes.append(f"different engines: {before.side.engine} and {after.side.engine}")
    if before.side.float_environment == after.side.float_environment:
        told = [
            (change.test, Verdict(word=change.word, sentence=change.sentence))
            for change in changes
            if change.kind not in ("work", *TIMES)
        ]
        notes += not_compared(told)
    slow = [f"{change.series} ({change.sentence})" for change in changes if CONFIRM in change.sentence]
    if slow:
        notes.append(
            f"slow for one night: {', '.join(slow[:MOST_NAMES])}{', …' if len(slow) > MOST_NAMES else ''}"
        )
    lost = sum(
        change.before_outcome in NO_VALUE and change.after_outcome in NO_VALUE and change.role not in FOLLOWED
        for change in changes
    )
    if lost:
        notes.append(f"no value on either side: {lost} series that should have one")
    silent = sorted({change.test for change in changes if change.word == "not_measured"})
    if silent:
        notes.append(f"in part not measured in the later run: {', '.join(silent)}")
    return notes
