"""Benchmarks of other tools that stop while their siblings go on: missing, by name, until they are back.

Other tools store what they got and never say what they were asked for. A run is taken to be asked for what the last
run like it had, of the same engine on the same machine: one with which it has at least half of both together in
common. A run of some benchmarks alone, of another file or of another environment is like none of the others; but where
the last runs before all had the same ones, a run of a few of them has lost the rest. Where the tool keeps a list of its benchmarks, what left the list was removed and is not missed; what is on the list without any
result is missed in the newest run, if that run is of the list's time: everything it measured is on it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from itertools import groupby
from typing import Any, NamedTuple

from msgspec.structs import replace

from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import RunDocument, Sample, SeriesDefinition

from .other_tools import asv_cases, asv_series

Lane = tuple[str, str]  # engine, machine
LAST = 3  # runs before: where these are alike, their lane is always asked for the same
GONE = "its siblings were measured and it was not"
NEVER = "the tool's list names it, and there is no result"


class Listed(NamedTuple):
    """What a tool itself says of its benchmarks."""

    benchmarks: Mapping[str, Any] = {}  # by name; empty: it keeps no list
    grids: bool = False  # a run holds a benchmark with all the parameters that it has then


def with_missing(
    read: Iterable[tuple[RunDocument, Listed]], before: Callable[[RunDocument], Sequence[RunDocument]]
) -> Iterator[RunDocument]:
    """The runs, oldest first in each lane, each with a missing value for what it ought to have and has not.

    `before` are the last runs of the same lane that were stored earlier, `LAST` at most, the oldest first.
    """
    ordered = sorted(read, key=lambda one: (lane_of(one[0]), one[0].started))
    for _, runs in groupby(ordered, key=lambda one: lane_of(one[0])):
        of_lane = list(runs)
        last = [{d.key: d for d in run.series} for run in before(of_lane[0][0])]  # what the last runs had
        kinds: list[dict[str, SeriesDefinition]] = []  # what the last run of each kind had
        for had in last:
            kinds = [had, *(other for other in kinds if not _are_alike(had.keys(), other.keys()))]
        for run, listed in of_lane:
            here = {d.key: d for d in run.series}
            like = next((known for known in kinds if _are_alike(known.keys(), here.keys())), None)
            if like is None and _is_left_of(here.keys(), last):
                like = kinds[0]
            known = like or {}
            names = {_name(d) for d in run.series}
            missed = {
                key: (d, _why(d, run))
                for key, d in known.items()
                if key not in here and _stays(d, names, listed)
            }
            if run is of_lane[-1][0]:
                missed |= {d.key: (d, NEVER) for d in _never_measured(run, listed, missed)}
            whole = _with(run, missed)
            had = {d.key: d for d in whole.series}
            last = [*last, had][-LAST:]
            kinds = [had, *(other for other in kinds if other is not like)]
            yield whole


def lane_of(run: RunDocument) -> Lane:
    """Runs of one engine on one machine follow one another."""
    return run.engine.name, run.machine.fingerprint


def _are_alike(some: Set[str], others: Set[str]) -> bool:
    return 2 * len(some & others) >= len(some | others)


def _is_left_of(here: Set[str], last: Sequence[Mapping[str, SeriesDefinition]]) -> bool:
    """Whether a run has some of what the last ones had, all of them the same, and nothing else."""
    alike = len(last) == LAST and all(_are_alike(last[-1].keys(), other.keys()) for other in last)
    return alike and bool(here) and here < last[-1].keys()


def _why(definition: SeriesDefinition, run: RunDocument) -> str:
    """Why it is missing: another unit is another series, and else its siblings go on without it."""
    of_it = [
        d for d in run.series if (d.test, d.configuration) == (definition.test, definition.configuration)
    ]
    if len(of_it) != 1 or of_it[0].unit == definition.unit:
        return GONE
    return f"it is measured in {of_it[0].unit} now, which is followed as {of_it[0].key}"


def _stays(definition: SeriesDefinition, names: Set[str], listed: Listed) -> bool:
    """Whether the benchmark, with these parameters, is still one for all that the tool says."""
    name = _name(definition)
    if listed.grids and name in names:
        return False  # it was measured, and these parameters are none of its own any more
    if not listed.benchmarks:
        return True
    return name in listed.benchmarks and definition.test in asv_cases(name, listed.benchmarks[name])


def _never_measured(run: RunDocument, listed: Listed, missed: Iterable[str]) -> Iterator[SeriesDefinition]:
    names = {_name(d) for d in run.series}
    if not listed.benchmarks or not names <= listed.benchmarks.keys():
        return
    told = names | {key.partition("/")[0].partition("(")[0] for key in missed}
    for name in sorted(listed.benchmarks.keys() - told):
        yield asv_series(name, listed.benchmarks[name], run.series[0].configuration)


def _name(definition: SeriesDefinition) -> str:
    """The benchmark's, without its parameters."""
    return definition.test.partition("(")[0]


def _with(run: RunDocument, missed: Mapping[str, tuple[SeriesDefinition, str]]) -> RunDocument:
    if not missed:
        return run
    samples = tuple(
        Sample(
            series=key,
            value=Number(math.nan),
            outcome="missing",
            passed=False,
            set_point_held=False,
            failure=why,
        )
        for key, (_, why) in missed.items()
    )
    return replace(
        run, series=run.series + tuple(d for d, _ in missed.values()), samples=run.samples + samples
    )
