"""The histories to be judged: of one line of runs, with the series that are made from others.

Run times of a ladder become one series per configuration, exact work one per configuration and counter. Both
are made here and nowhere else, so that every judge of a history judges them, too.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from datetime import timedelta
from functools import cache
from typing import Protocol, TypeVar

import msgspec

from spook_tracker.tracker.document.about import about, started
from spook_tracker.tracker.document.json_form import NAN, Number
from spook_tracker.tracker.document.points import Evidence, Points, Stretches, columns
from spook_tracker.tracker.document.run_document import (
    MapData,
    Point,
    Run,
    Runs,
    Sample,
    SeriesDefinition,
    SeriesHistory,
)

from .calibration import ladder_timing, that_counts
from .work import FAMILIES, Samples, Sums, families_of, with_work

NIGHT = timedelta(days=1)  # runs of several machines within it are of one
OneRun = TypeVar("OneRun", bound=Run)
RECENT = 60  # runs read with all their evidence: state hashes, failures, counters, timings;
SPARSE = 16  # of those before them one in so many, so that what was lost then is not forgotten


class Records(Protocol):
    """What is read of a history (tracker.store.history.History)."""

    def runs(self, engine: str | None = None) -> Sequence[Run]: ...
    def series(
        self, keys: Iterable[str] | None = None, *, evidence: bool = True
    ) -> Mapping[str, SeriesHistory]: ...
    def series_of(self, engine: str) -> Mapping[str, SeriesHistory]: ...
    def samples(self, run_id: str) -> Samples: ...
    def samples_of(
        self, run_ids: Sequence[str], tests: set[str] | None = None, keys: Iterable[str] | None = None
    ) -> Mapping[str, Samples]: ...
    def answered(self, run_ids: Sequence[str]) -> Mapping[str, Collection[tuple[str, str]]]: ...
    def maps(self, run_id: str) -> Sequence[MapData]: ...
    def with_maps(self) -> Collection[str]: ...


def line_of(runs: Sequence[OneRun], run: OneRun) -> list[OneRun]:
    """The runs of its engine that come before a run in commit order and on its own branch, and the run itself.

    A build with local changes or without a commit has no place in that order: it stands in no history,
    unless none of the engine's runs has a place; then time orders them.
    """
    of_engine = [other for other in runs if other.engine.name == run.engine.name]
    place = next(i for i, other in enumerate(of_engine) if other.id == run.id)
    versioned = any(is_placed(other) for other in of_engine)
    before = [other for other in of_engine[:place] if is_placed(other) or not versioned]
    if run.engine.git_hash:
        aside = elsewhere(before, run)
        before = [other for other in before if other.engine.git_hash not in aside]
    return [*before, of_engine[place]]


def of_version(runs: Sequence[OneRun], run: OneRun) -> list[OneRun]:
    """The runs of a run's version among these, in their order: all of its commit.

    Without a commit, those of one version string within a day: a string says less, as it may stay the same for months.
    Of a build with local changes, itself alone: nothing says that another one has the same.
    """
    if run.engine.dirty:
        return [run]
    if not is_placed(run):
        same = [o for o in runs if (o.engine.name, o.engine.version) == (run.engine.name, run.engine.version)]
        mine = (o for o in same if not o.engine.git_hash and not o.engine.dirty)
        return [o for o in mine if abs(started(o) - started(run)) < NIGHT]
    version = run.engine.name, run.engine.git_hash
    return [o for o in runs if is_placed(o) and (o.engine.name, o.engine.git_hash) == version]


def machine_of(run: Run) -> str:
    """A run's machine in a few words that tell it from others."""
    processor, lane = run.machine.processor, run.machine.fingerprint
    return processor if processor == lane else f"{processor} ({lane[:8]})"


def forked_from(runs: Sequence[OneRun], run: OneRun, main_line: set[str]) -> OneRun | None:
    """The nearest measured ancestor of a run on the main line; where that is not known, the run before it.

    None if nothing was measured before.
    """
    before = line_of(runs, run)[:-1]
    on_main = [other for other in before if other.engine.git_hash in main_line]
    others = [other for other in before if other.engine.git_hash != run.engine.git_hash]
    return next(reversed(on_main or others), None)


def elsewhere(runs: Sequence[Run], run: Run) -> set[str]:
    """Commits among these runs that lie on another branch than a run's commit, as far as parents tell.

    From both commits back along measured parents: a commit is elsewhere if both ways meet and it is on one
    of them only. Where a way breaks off at a commit that was not measured, the order of commits has to do.
    """
    parents = {other.engine.git_hash: other.engine.parents for other in (*runs, run)}

    def back(commit: str) -> set[str]:
        seen: set[str] = set()
        ahead = [commit]
        while ahead:
            here = ahead.pop()
            if here in parents and here not in seen:
                seen.add(here)
                ahead.extend(parents[here])
        return seen

    mine = back(run.engine.git_hash)
    return {
        commit
        for commit in parents
        if commit not in mine and run.engine.git_hash not in (way := back(commit)) and mine & way
    }


def lines(runs: Sequence[OneRun]) -> list[list[OneRun]]:
    """One line of runs per engine, up to its newest; first that of the engine which the history is about.

    Runs of other branches stand in no line: they are judged by themselves, against the commit they forked from.
    """
    if not runs:
        return []
    first = about(runs)
    engines = sorted(dict.fromkeys(run.engine.name for run in runs), key=lambda name: name != first)
    return [_line([run for run in runs if run.engine.name == name]) for name in engines]


def _line(runs: Sequence[OneRun]) -> list[OneRun]:
    """The runs with a place in the commit order, and the newest one whatever it was built from.

    This is what `latest` and `previous` choose from on the command line.
    """
    newest = max(runs, key=started)
    placed = [run for run in runs if is_placed(run)]
    if not placed:
        return list(runs)
    line = line_of(placed, placed[-1])
    here = {run.id for run in line}
    aside = [run for run in placed if run.id not in here]
    if aside and len(other := line_of(placed, aside[-1])) > len(line):
        line = other  # a branch that was measured once is not what the history is about
    return line if is_placed(newest) else [*line, newest]


def is_placed(run: Run) -> bool:
    """Whether a run has a place in the commit order: of a commit, and without local changes."""
    return bool(run.engine.git_hash) and not run.engine.dirty


def histories(
    records: Records, runs: Sequence[Run], keys: Iterable[str] | None = None
) -> dict[str, SeriesHistory]:
    """The histories of all series (or those named) over these runs, the made ones among them."""
    place = {run.id: run for run in runs}
    tests = None if keys is None else {key.partition("/")[0] for key in keys}
    looked_at = [runs[i] for i in looked_at_again(len(runs), RECENT)]
    recent = records.samples_of([run.id for run in looked_at], tests)
    found: dict[str, SeriesHistory] = {}
    known: dict[Runs, tuple[list[int] | None, Runs, list[int], list[Samples]]] = {}
    stored_of = (
        records.series_of(runs[0].engine.name) if keys is None else records.series(keys, evidence=False)
    )
    for key, stored in stored_of.items():
        points = columns(stored.points)
        if points.runs not in known:
            known[points.runs] = _of_line(points.runs, place, recent)
        chosen, ours, places, measured = known[points.runs]
        said = points.said if chosen is None else Stretches.of(map(points.said.__getitem__, chosen))
        if said:
            found[key] = SeriesHistory(stored.definition, Points(ours, said, Evidence(key, places, measured)))
    whole = None if tests is None else cache(lambda run_id: _families(records.answered([run_id])[run_id]))
    found = with_missing(found, runs, recent, whole)
    return found | run_times(found) | work(looked_at, recent, tests)


def _of_line(
    runs: Runs, place: Mapping[str, Run], recent: Mapping[str, Samples]
) -> tuple[list[int] | None, Runs, list[int], list[Samples]]:
    """Which of these runs stand in the line (None: all), as they stand there, the places of those with evidence, and it."""
    chosen = [i for i, run in enumerate(runs) if run.id in place]
    ours = Runs(place[runs[i].id] for i in chosen)
    places = [i for i, run in enumerate(ours) if recent.get(run.id)]
    measured = [recent[ours[i].id] for i in places]
    return None if len(chosen) == len(runs) else chosen, ours, places, measured


def run_time_histories(
    records: Records, runs: Sequence[Run], keys: Iterable[str]
) -> dict[str, SeriesHistory]:
    """Only the run times of these ladders' rungs: what a comparison of two runs asks of all nights."""
    looked_at = [runs[i] for i in looked_at_again(len(runs), RECENT)]
    measured = records.samples_of([run.id for run in looked_at], keys=keys)
    points: dict[str, list[Point]] = {}
    newest: dict[str, SeriesDefinition] = {}
    for run in looked_at:
        for key, (definition, sample) in measured[run.id].items():
            newest[key] = definition
            points.setdefault(key, []).append(Point(run, sample, definition.test_version))
    return run_times({key: SeriesHistory(newest[key], tuple(found)) for key, found in points.items()})


def looked_at_again(count: int, recent: int) -> list[int]:
    """Places of the nights that are looked at closely: the last ones, and one in `SPARSE` before them.

    Where the last ones begin moves by so many nights at once: one more night leaves what was said of the others.
    """
    dense = settled_nights(count, recent)
    return [*range(0, dense, SPARSE), *range(dense, count)]


def settled_nights(count: int, recent: int) -> int:
    """How many of the first nights are looked at as they will be from now on, whatever follows them."""
    return max(0, count - recent) // SPARSE * SPARSE


def _says(run: Run) -> bool:
    """Whether a run tells what it was asked for."""
    return getattr(run, "asked", None) is not None


def work(
    runs: Sequence[Run], measured: Mapping[str, Samples], tests: set[str] | None
) -> dict[str, SeriesHistory]:
    """The histories of exact work of these tests (all if None): tracker/judge/work.py."""
    points: dict[str, list[Point]] = {}
    newest: dict[str, SeriesDefinition] = {}
    known = Sums()
    for run in runs:
        counted = measured.get(run.id, {})
        if tests is not None:
            counted = {key: pair for key, pair in counted.items() if key.partition("/")[0] in tests}
        for key, (definition, sample) in with_work(counted, run.engine, known).items():
            if definition.kind == "work":
                newest[key] = definition
                points.setdefault(key, []).append(Point(run, sample, definition.test_version))
    return {key: SeriesHistory(newest[key], tuple(found)) for key, found in points.items()}


def with_missing(
    found: Mapping[str, SeriesHistory],
    runs: Sequence[Run],
    measured: Mapping[str, Samples],
    whole: Callable[[str], dict[str, set[str]]] | None = None,
) -> dict[str, SeriesHistory]:
    """The histories with a point for every value that was asked for and not answered.

    What a run was asked for it stores. Of a run that does not say (recorded by an earlier tracker, or by another
    tool), it is taken to be every value of the tests and families (values, sweep, stability) it measured, and for
    a nightly the whole catalogue. If the whole catalogue was asked, a gate whose test is gone is removed, not
    forgotten. A run time is missed on a machine that timed it before; what is read off a ladder's clock is not missed: a
    machine may be too busy for it. A run that neither says nor is among the measured is not asked. Where `measured` are some tests alone, `whole` tells of all that a run
    answered.
    """
    place = {run.id: i for i, run in enumerate(runs)}
    ids = [run.id for run in runs]
    telling = [i for i, run in enumerate(runs) if run.id in measured or _says(run)]

    @cache
    def asked(i: int) -> dict[str, set[str]]:
        return asked_for(runs[i], measured.get(ids[i], {}))

    @cache
    def silences(answered: Runs) -> list[int]:
        """Places of the runs that tell, and come after the first of these without being one of them."""
        first, having = place[answered[0].id], {run.id for run in answered}
        return [i for i in telling if i > first and ids[i] not in having]

    def removed(i: int, family: str, gate: bool) -> bool:
        """Whether a run was asked for everything of a family, so that a gate of a test it was not asked for is gone."""
        if not gate or not asked_whole(runs[i]):
            return False
        return family in (asked(i) if whole is None or _says(runs[i]) else whole(ids[i]))

    told = {}
    for key, series in found.items():
        definition = series.definition
        families = families_of(definition)
        if definition.kind == "work" or not families:
            told[key] = series
            continue
        silent = silences(columns(series.points).runs)
        points = list(series.points) if silent else []
        begun = _begun(series, place) if silent and definition.kind == "time" else None
        for i in silent:
            if runs[i].engine.name != points[0].run.engine.name:
                continue
            if begun is not None and (
                getattr(runs[i], "trigger", "") == "import" or begun.get(runs[i].machine.fingerprint, i) >= i
            ):
                continue  # what an imported run misses it says itself; or that machine has never timed it
            gone = not any(definition.test in asked(i).get(family, ()) for family in families)
            if gone and not any(removed(i, family, definition.role == "gate") for family in families):
                continue
            why = "removed from the catalogue" if gone else "asked for and not answered"
            lost = Sample(
                series=key, value=NAN, outcome="missing", passed=False, set_point_held=False, failure=why
            )
            points.append(Point(runs[i], lost, definition.test_version, recorded=False))
        if len(points) > len(series.points):
            points.sort(key=lambda point: place[point.run.id])
            series = SeriesHistory(definition, tuple(points))
        told[key] = series
    return told


def _begun(series: SeriesHistory, place: Mapping[str, int]) -> dict[str, int]:
    """By machine, the place of the first run that timed a series."""
    first: dict[str, int] = {}
    for point in series.points:
        first.setdefault(point.run.machine.fingerprint, place[point.run.id])
    return first


def asked_for(run: Run, samples: Samples) -> dict[str, set[str]]:
    """The tests a run was asked for, by family."""
    stored = getattr(run, "asked", None)
    if stored is not None:
        return {family: set(stored.tests) for family in stored.families}
    return asked_in(samples)


def asked_in(samples: Samples) -> dict[str, set[str]]:
    """The tests that were measured, by family: all that is known of a run that does not say."""
    return _families((definition.test, definition.kind) for definition, _ in samples.values())


def _families(answered: Iterable[tuple[str, str]]) -> dict[str, set[str]]:
    """Tests by family, of tests and kinds of series."""
    asked: dict[str, set[str]] = {}
    for test, kind in answered:
        asked.setdefault(FAMILIES[kind], set()).add(test)
    return asked


def asked_whole(run: Run) -> bool:
    """Whether a run was asked for the whole catalogue."""
    stored = getattr(run, "asked", None)
    return getattr(run, "trigger", "") == "nightly" if stored is None else bool(stored.whole)


def run_times(found: Mapping[str, SeriesHistory]) -> dict[str, SeriesHistory]:
    """One series of run time for each ladder configuration: the geometric mean over the rungs timed last.

    Nights that did not time all of these rungs are left out: means over other rungs say nothing.
    """
    ladders: dict[str, list[SeriesHistory]] = {}
    for series in found.values():
        definition = series.definition
        if definition.kind == "ladder" and columns(series.points).timed():
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
    together: Iterable[Sequence[Point]]
    ids = [[point.run.id for point in points] for points in chosen]
    if all(of_rung == ids[0] for of_rung in ids):  # nearly always: every rung every night
        together = zip(*chosen, strict=True)
    else:
        by_run: dict[str, list[Point]] = {}
        for points in chosen:
            for point in points:
                by_run.setdefault(point.run.id, []).append(point)
        together = by_run.values()
    first = rungs[0].definition
    definition = msgspec.structs.replace(
        first, key=key, metric=f"{first.metric}:run-time", description=f"run time of {first.description}",
        unit="s", kind="time", better="smaller", time_step=None, role="reported", limit=None, set_point=None,
        reference=None, tolerance=0.0, relative_tolerance=first.time_tolerance,
    )  # fmt: skip
    told = []
    for found in together:
        if len(found) == len(chosen):
            timing = ladder_timing(p.sample.timing for p in found if p.sample.timing)
            sample = Sample(
                series=key,
                value=Number(that_counts(timing).seconds[0]),
                outcome="value",
                passed=True,
                set_point_held=True,
                timing=timing,
            )
            told.append(Point(found[0].run, sample, found[0].test_version))
    return SeriesHistory(definition, tuple(sorted(told, key=lambda point: order[point.run.id])))
