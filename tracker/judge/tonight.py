"""What became of one recorded run, judged against everything recorded before it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.series_history import Finding, Night, Run, judge_maps, judge_run

RECENT = 60  # nights read with all their evidence: state hashes, failures, timings

Histories = dict[str, tuple[SeriesDefinition, list[Night]]]


def tonight(history: Any, run: Any, accepted: Sequence[Accepted] = ()) -> list[Finding]:
    """Findings of one recorded run against its history (tracker.store.history.History); red first."""
    runs = list(history.runs(run.engine.name))
    place = [other.id for other in runs].index(run.id)
    recent = {other.id: history.samples(other.id) for other in runs[max(0, place - RECENT + 1) : place + 1]}
    stored = history.series(recent[run.id], evidence=False)
    histories: Histories = {
        key: (found.definition, [_night(key, point, recent) for point in found.points])
        for key, found in stored.items()
    }
    findings = judge_run(histories | run_time_histories(histories, run), run, accepted)
    for other in reversed(runs[:place]):
        if other.machine.float_environment == run.machine.float_environment and history.maps(other.id):
            findings += judge_maps(history.maps(other.id), history.maps(run.id))
            break
    return sorted(findings, key=lambda finding: (not finding.red, finding.series))


def _night(key: str, point: Any, recent: Mapping[str, Mapping[str, Any]]) -> Night:
    """A point of a history, with its evidence if it is recent."""
    run, sample, version = point
    if run.id in recent and key in recent[run.id]:
        sample = recent[run.id][key][1]
    return Night(run, sample, version)


def run_time_histories(
    histories: Mapping[str, tuple[SeriesDefinition, Sequence[Night]]], run: Run
) -> Histories:
    """One series of run time for each ladder configuration: the geometric mean over the rungs timed in `run`.

    Nights that did not time all of these rungs are left out: means over other rungs say nothing.
    """
    ladders: dict[str, list[tuple[SeriesDefinition, Sequence[Night]]]] = {}
    for definition, history in histories.values():
        if definition.kind == "ladder" and any(n.run.id == run.id and n.sample.timing for n in history):
            key = f"{definition.test}/{definition.configuration}/{definition.metric}:run-time"
            ladders.setdefault(key, []).append((definition, history))
    return {key: _run_time(key, rungs) for key, rungs in ladders.items()}


def _run_time(
    key: str, rungs: Sequence[tuple[SeriesDefinition, Sequence[Night]]]
) -> tuple[SeriesDefinition, list[Night]]:
    by_run: dict[str, list[Night]] = {}
    for _, history in rungs:
        for night in history:
            if night.sample.timing is not None:
                by_run.setdefault(night.run.id, []).append(night)
    definition = msgspec.structs.replace(
        rungs[0][0],
        key=key,
        metric=f"{rungs[0][0].metric}:run-time",
        unit="s",
        kind="time",
        better="smaller",
        time_step=None,
    )
    order = [night.run.id for night in max((history for _, history in rungs), key=len)]
    told = []
    for run_id in order:
        found = by_run.get(run_id, [])
        if len(found) < len(rungs):
            continue
        logs = [math.log(min(n.sample.timing.seconds)) for n in found if n.sample.timing]
        seconds = math.exp(sum(logs) / len(logs))
        sample = Sample(series=key, value=seconds, outcome="value", passed=True, set_point_held=True)
        told.append(Night(found[0].run, sample, found[0].test_version))
    return definition, told
