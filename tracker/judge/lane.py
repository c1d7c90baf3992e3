"""The histories to be judged: of one line of runs, with the series that are made from others.

Run times of a ladder become one series per configuration, exact work one per configuration and counter. Both
are made here and nowhere else, so that whoever judges a history judges them, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any, Protocol

import msgspec

from spook_tracker.tracker.document.run_document import (
    MapData,
    Point,
    Run,
    Sample,
    SeriesDefinition,
    SeriesHistory,
)
from spook_tracker.tracker.document.wording import instant

RECENT = 60  # runs read with all their evidence: state hashes, failures, counters, timings

Samples = Mapping[str, tuple[SeriesDefinition, Sample]]


class Records(Protocol):
    """What is read of a history (tracker.store.history.History)."""

    def runs(self, engine: str | None = None) -> Sequence[Any]: ...
    def series(self, keys: Iterable[str] | None = None, *, evidence: bool = True) -> Mapping[str, Any]: ...
    def samples(self, run_id: str) -> Samples: ...
    def maps(self, run_id: str) -> Sequence[MapData]: ...


def line_of(runs: Sequence[Any], run: Any) -> list[Any]:
    """The runs of its engine that come before a run in commit order, and the run itself.

    A build with local changes or without a commit has no place in that order: it stands in nobody's history,
    unless none of the engine's runs has a place; then time orders them.
    """
    of_engine = [other for other in runs if other.engine.name == run.engine.name]
    place = next(i for i, other in enumerate(of_engine) if other.id == run.id)
    versioned = any(_placed(other) for other in of_engine)
    before = [other for other in of_engine[:place] if _placed(other) or not versioned]
    return [*before, of_engine[place]]


def lines(runs: Sequence[Any]) -> list[list[Any]]:
    """One line of runs per engine, up to its newest; first the engine of the newest run that was not imported."""
    if not runs:
        return []
    own = [run for run in runs if run.trigger != "import"] or runs
    first = max(own, key=_started).engine.name
    engines = sorted(dict.fromkeys(run.engine.name for run in runs), key=lambda name: name != first)
    return [_line([run for run in runs if run.engine.name == name]) for name in engines]


def _line(runs: Sequence[Any]) -> list[Any]:
    """The runs with a place in the commit order, and the newest one whatever it was built from.

    This is what `latest` and `previous` choose from on the command line.
    """
    newest = max(runs, key=_started)
    versioned = any(_placed(run) for run in runs)
    return [run for run in runs if _placed(run) or run is newest or not versioned]


def _started(run: Any) -> datetime:
    return instant(run.started) or datetime.min.replace(tzinfo=UTC)


def _placed(run: Any) -> bool:
    return bool(run.engine.git_hash) and not run.engine.dirty


def histories(
    records: Records, runs: Sequence[Run], keys: Iterable[str] | None = None
) -> dict[str, SeriesHistory]:
    """The histories of all series (or those named) over these runs, the made ones among them."""
    place = {run.id: run for run in runs}
    recent = {run.id: records.samples(run.id) for run in runs[-RECENT:]}
    found: dict[str, SeriesHistory] = {}
    for key, stored in records.series(keys, evidence=False).items():
        points = []
        for run, sample, version in stored.points:
            if run.id in place:
                evidence = recent.get(run.id, {}).get(key)
                points.append(Point(place[run.id], evidence[1] if evidence else sample, version))
        if points:
            found[key] = SeriesHistory(stored.definition, tuple(points))
    return found | run_times(found)


def run_times(found: Mapping[str, SeriesHistory]) -> dict[str, SeriesHistory]:
    """One series of run time for each ladder configuration: the geometric mean over the rungs timed last.

    Nights that did not time all of these rungs are left out: means over other rungs say nothing.
    """
    ladders: dict[str, list[SeriesHistory]] = {}
    for series in found.values():
        definition = series.definition
        if definition.kind == "ladder" and any(p.sample.timing for p in series.points):
            key = f"{definition.test}/{definition.configuration}/{definition.metric}:run-time"
            ladders.setdefault(key, []).append(series)
    return {key: _run_time(key, rungs) for key, rungs in ladders.items()}


def _run_time(key: str, rungs: Sequence[SeriesHistory]) -> SeriesHistory:
    timed = [[point for point in rung.points if point.sample.timing] for rung in rungs]
    order: dict[str, int] = {}
    for rung in sorted(rungs, key=lambda r: -len(r.points)):
        for point in rung.points:
            order.setdefault(point.run.id, len(order))
    newest = max((points[-1].run.id for points in timed), key=order.__getitem__)
    chosen = [points for points in timed if points[-1].run.id == newest]
    by_run: dict[str, list[Point]] = {}
    for points in chosen:
        for point in points:
            by_run.setdefault(point.run.id, []).append(point)
    first = rungs[0].definition
    definition = msgspec.structs.replace(
        first, key=key, metric=f"{first.metric}:run-time", description=f"run time of {first.description}",
        unit="s", kind="time", better="smaller", time_step=None, role="reported", limit=None, set_point=None,
        reference=None,
    )  # fmt: skip
    told = []
    for found in by_run.values():
        if len(found) == len(chosen):
            seconds = geometric_mean(min(p.sample.timing.seconds) for p in found if p.sample.timing)
            sample = Sample(series=key, value=seconds, outcome="value", passed=True, set_point_held=True)
            told.append(Point(found[0].run, sample, found[0].test_version))
    return SeriesHistory(definition, tuple(sorted(told, key=lambda point: order[point.run.id])))


def geometric_mean(values: Iterable[float]) -> float:
    """The mean of logarithms, as a value."""
    logs = [math.log(value) for value in values]
    return math.exp(sum(logs) / len(logs))
