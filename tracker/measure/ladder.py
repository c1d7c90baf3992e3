"""Error against run time: a ladder of time steps in each configuration, measured under one protocol.

Errors come from runs that record, in any process; run times from separate runs with nothing recorded, alone
and interleaved. A point that fails stays a point with its outcome class. From each configuration's points
come the scalars that make a trend: observed order, time at a given error, error in a given time. A rung that gave
its error and fails while it is timed has the class of that failure: a crash is one wherever it comes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from spook_tracker.engine.method import Method
from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests.case import Configuration, Ladder, ScalarTest, Simulate
from spook_tracker.tracker.document.json_form import NAN, Number
from spook_tracker.tracker.document.order import error_in_time, in_range, observed_order, time_at_error
from spook_tracker.tracker.document.run_document import (
    OutcomeClass,
    Sample,
    SeriesDefinition,
    Timing,
)

from .definition import definition_hash
from .question import Outcome, Witness, ask, sentence, series_key
from .timing import Prepare, Repeats, Timed, interleaved
from .workers import NOWHERE, Lost, at

LADDER_TIME_LIMIT = 60.0  # s per run: a point that takes longer is a point of its own class
ORDER_BAND = 0.1


@dataclass(frozen=True)
class ErrorPoint:
    """One rung in one configuration."""

    time_step: float  # s
    error: float
    outcome: OutcomeClass
    failure: str
    counters: dict[str, int]
    state_hash: str
    seconds: float = 0.0  # that it took here; not its run time, which is taken alone on the machine


@dataclass(frozen=True)
class ErrorPoints:
    """All rungs of one configuration, coarse to fine."""

    points: tuple[ErrorPoint, ...]


Pair = tuple[SeriesDefinition, Sample]


def error_points(ladder: Ladder, configuration: Configuration, simulate: Simulate) -> ErrorPoints:
    """The errors of one configuration; failures are kept with their class.

    A rung finer than one that ran out of time has more steps to take: it is not tried, and says so.
    """
    points: list[ErrorPoint] = []
    for h in ladder.steps_of(configuration):
        slow = next((p for p in points if p.outcome == "timed_out" and p.time_step > h), None)
        points.append(_error_point(ladder, configuration, h, simulate) if slow is None else _untried(h, slow))
    return ErrorPoints(tuple(points))


def _untried(h: float, slow: ErrorPoint) -> ErrorPoint:
    why = f"not tried: at {slow.time_step:g} s a step, with fewer steps, the time limit was reached"
    return ErrorPoint(h, math.nan, "timed_out", why, {}, "")


def _error_point(ladder: Ladder, configuration: Configuration, h: float, simulate: Simulate) -> ErrorPoint:
    witness = Witness(simulate, time_limit=LADDER_TIME_LIMIT)
    answer = ask(lambda: float(ladder.error(witness, h, configuration.method))).settled(witness)
    error = math.nan if answer.value is None else answer.value
    outcome, failure = answer.outcome, answer.failure
    if outcome in ("value", "unsettled") and not math.isfinite(error):
        outcome, failure = "not_finite", f"the error is {error}"
    counters = dict(sorted(witness.counters.items()))
    return ErrorPoint(h, error, outcome, failure, counters, witness.state_hash, witness.seconds)


Errors = Mapping[tuple[str, int, int], ErrorPoints]  # by test, ladder and configuration
Place = tuple[str, int, int, int]  # of a rung: test, ladder, configuration, step


def timed_series(
    tests: Mapping[str, ScalarTest],
    errors: Errors,
    simulate: Simulate,
    repeats: int | Repeats,
    prepare: Prepare | None = None,
) -> list[Pair]:
    """Every ladder's series with timings, and the scalars read off them; run alone on the machine.

    `prepare` is the engine's, where it compiles apart from running. Ladders that ask two questions of the same
    simulations share their times."""
    found: dict[Place, Timing | Outcome] = {}
    places = _to_be_timed(tests, errors)
    for name, test in tests.items():
        same: dict[Simulated, Place] = {}
        for i, ladder in enumerate(test.ladders):
            mine = [place for place in places if place[:2] == (name, i)]
            first_of = {place: same.setdefault(_simulated(ladder, place), place) for place in mine}
            here = [place for place in mine if first_of[place] == place]
            runs = [_run_of(ladder, place) for place in here]
            numbers = [places.index(place) for place in here]
            expected = [errors[place[:3]].points[place[3]].seconds for place in here]
            staged = {min(alike, key=lambda number: expected[number]) for alike in _by_configuration(here)}
            timings = interleaved(
                runs, simulate, repeats, partial(_begin, numbers), prepare, expected, staged
            )
            at(NOWHERE)
            found |= zip(here, timings, strict=True)
            found |= {place: found[first] for place, first in first_of.items()}
    return _all_pairs(tests, errors, found)


def _by_configuration(places: Sequence[Place]) -> Iterable[list[int]]:
    """The numbers of the rungs of each configuration: the shortest of them tells its stages, however long it is."""
    found: dict[int, list[int]] = {}
    for number, place in enumerate(places):
        found.setdefault(place[2], []).append(number)
    return found.values()


def _begin(places: Sequence[int], number: int) -> None:
    at(places[number])


def untimed_series(tests: Mapping[str, ScalarTest], errors: Errors, lost: Lost) -> list[Pair]:
    """The same where the process that timed them was lost: told of the rung it was at, of all if that is not known."""
    places = _to_be_timed(tests, errors)
    if 0 <= lost.at < len(places):
        name, i, j, k = places[lost.at]
        ladder = tests[name].ladders[i]
        rung = ladder.configurations[j]
        why = f"{lost.failure}, with [{rung.name}] at h = {ladder.steps_of(rung)[k]:g} s"
        places = [places[lost.at]]
    else:
        why = lost.failure
    failed = dict.fromkeys(places, Outcome(None, lost.outcome, lost.failure))
    return _all_pairs(tests, errors, failed, Outcome(None, lost.outcome, why))


def _to_be_timed(tests: Mapping[str, ScalarTest], errors: Errors) -> list[Place]:
    """The rungs that have a value, in the order in which they are timed."""
    return [
        (name, i, j, k)
        for name, test in tests.items()
        for i, ladder in enumerate(test.ladders)
        for j in range(len(ladder.configurations))
        for k, point in enumerate(errors[name, i, j].points)
        if point.outcome == "value"
    ]


Simulated = tuple[Callable[[Simulate, float, Method], Result], float, str]


def _simulated(ladder: Ladder, place: Place) -> Simulated:
    """What a rung runs."""
    configuration = ladder.configurations[place[2]]
    return ladder.timed, ladder.steps_of(configuration)[place[3]], repr(configuration.method)


def _run_of(ladder: Ladder, place: Place) -> Timed:
    configuration = ladder.configurations[place[2]]
    step = ladder.steps_of(configuration)[place[3]]
    return lambda simulate: ladder.timed(simulate, step, configuration.method)


def _all_pairs(
    tests: Mapping[str, ScalarTest],
    errors: Errors,
    found: Mapping[Place, Timing | Outcome],
    lost: Outcome | None = None,
) -> list[Pair]:
    """What came of every ladder; `lost`: why there are no times of it at all."""
    pairs: list[Pair] = []
    for name, test in tests.items():
        for i, ladder in enumerate(test.ladders):
            for j, configuration in enumerate(ladder.configurations):
                points = errors[name, i, j]
                timed = [found.get((name, i, j, k)) for k in range(len(points.points))]
                pairs += _ladder_pairs(name, test, ladder, configuration, points, timed, lost)
    return pairs


def _ladder_pairs(
    name: str,
    test: ScalarTest,
    ladder: Ladder,
    configuration: Configuration,
    points: ErrorPoints,
    timed: list[Timing | Outcome | None],
    lost: Outcome | None,
) -> Iterator[Pair]:
    version = _version(ladder, configuration)
    common = _series(name, test, ladder, configuration, version)
    for point, timing in zip(points.points, timed, strict=True):
        series = _rung(common, ladder, point.time_step)
        if isinstance(timing, Outcome):
            point, timing = _failed_when_timed(point, timing), None
        yield (
            series,
            Sample(
                series=series.key,
                value=Number(point.error),
                outcome=point.outcome,
                passed=point.outcome == "value",
                set_point_held=point.outcome == "value",
                failure=point.failure,
                counters=point.counters,
                state_hash=point.state_hash,
                timing=timing,
            ),
        )
    yield from _scalars(ladder, configuration, common, points, timed, lost)


def _rung(common: SeriesDefinition, ladder: Ladder, time_step: float) -> SeriesDefinition:
    return replace_series(
        common,
        metric=f"ladder:{ladder.name}",
        description=ladder.description,
        kind="ladder",
        time_step=time_step,
    )


def rung_series(name: str, test: ScalarTest) -> Iterator[SeriesDefinition]:
    """The series of every rung of a test's ladders, nothing being measured."""
    for ladder in test.ladders:
        for configuration in ladder.configurations:
            common = _series(name, test, ladder, configuration, _version(ladder, configuration))
            for time_step in ladder.steps_of(configuration):
                yield _rung(common, ladder, time_step)


def _failed_when_timed(point: ErrorPoint, failed: Outcome) -> ErrorPoint:
    """The rung as it ended; what only did not settle keeps its value."""
    value = point.error if failed.outcome == "unsettled" else math.nan
    words = sentence(f"while it was timed: {failed.failure}")
    return replace(point, error=value, outcome=failed.outcome, failure=words)


def _version(ladder: Ladder, configuration: Configuration, *more: object) -> str:
    """Version of what a series of the ladder measures; `more` is what its rungs do not depend on."""
    name = configuration.formerly[0] if configuration.formerly else configuration.name
    facts = (ladder.name, ladder.unit, name, configuration.method, *more)
    return definition_hash(ladder.error, facts)


def _series(
    name: str, test: ScalarTest, ladder: Ladder, configuration: Configuration, version: str
) -> SeriesDefinition:
    return SeriesDefinition(
        key=name,
        test=name,
        title=test.title,
        configuration=configuration.name,
        metric=f"ladder:{ladder.name}",
        description=ladder.description,
        unit=ladder.unit,
        role="reported",
        better="smaller_magnitude",
        kind="ladder",
        time_step=None,
        parameters={},
        limit=None,
        limit_source="",
        set_point=None,
        set_point_source="",
        reference=None,
        tolerance=0.0,
        relative_tolerance=1e-9,
        test_version=version,
        time_tolerance=ladder.time_tolerance,
        iteration_tolerance=test.iteration_tolerance,
        counter_roles=dict(test.counter_roles),
    )


def replace_series(series: SeriesDefinition, **changes: object) -> SeriesDefinition:
    """A series with other facts and the key that goes with them."""
    import msgspec

    changed: SeriesDefinition = msgspec.structs.replace(series, **changes)
    key = series_key(changed.test, changed.configuration, changed.metric, changed.time_step, {})
    return msgspec.structs.replace(changed, key=key)


def _scalars(
    ladder: Ladder,
    configuration: Configuration,
    common: SeriesDefinition,
    points: ErrorPoints,
    timed: list[Timing | Outcome | None],
    lost: Outcome | None,
) -> Iterator[Pair]:
    metric = f"ladder:{ladder.name}"
    expected = configuration.expected_order
    if expected is not None:
        band = (expected - ORDER_BAND, expected + ORDER_BAND)
        series = replace_series(
            common,
            metric=f"{metric}:order",
            description=f"observed order of {ladder.description}",
            unit="1",
            role="companion",
            better="inside",
            kind="order",
            limit=band,
            limit_source=f"the method's order, {expected:g}, within {ORDER_BAND:g}",
            reference=expected,
            test_version=_version(
                ladder, configuration, ladder.steps_of(configuration), configuration.order_range
            ),
        )
        used = [p for p in points.points if in_range(p.time_step, configuration.order_range)]
        order = observed_order([p.time_step for p in used], [p.error for p in used])
        yield series, _scalar(series, order, "fewer than three usable points in the asymptotic range", band)
    reached = [
        (min(timing.seconds), point.error)
        for point, timing in zip(points.points, timed, strict=True)
        if isinstance(timing, Timing)
    ]
    failed = lost or next((timing for timing in timed if isinstance(timing, Outcome)), None)
    seconds, errors = [s for s, _ in reached], [e for _, e in reached]
    if ladder.target_error is not None:
        series = replace_series(
            common,
            metric=f"{metric}:time-to-error",
            description=f"time to reach {ladder.target_error:g} {ladder.unit}: {ladder.description}",
            unit="s",
            better="smaller",
            kind="time",
            parameters={"target_error": ladder.target_error},
            test_version=_version(ladder, configuration, ladder.steps_of(configuration), ladder.target_error),
        )
        value = time_at_error(seconds, errors, ladder.target_error)
        why_not = f"no step reaches {ladder.target_error:g} {ladder.unit}"
        yield series, _untimed(series, failed) or _scalar(series, value, why_not)
    if ladder.target_seconds is not None:
        series = replace_series(
            common,
            metric=f"{metric}:error-in-time",
            description=f"error reached in {ladder.target_seconds:g} s: {ladder.description}",
            kind="time",
            parameters={"target_seconds": ladder.target_seconds},
            test_version=_version(
                ladder, configuration, ladder.steps_of(configuration), ladder.target_seconds
            ),
        )
        value = error_in_time(seconds, errors, ladder.target_seconds)
        why_not = f"every step takes longer than {ladder.target_seconds:g} s"
        yield series, _untimed(series, failed) or _scalar(series, value, why_not)


def _untimed(series: SeriesDefinition, failed: Outcome | None) -> Sample | None:
    """What is read off the clock has no value where a rung failed while it was timed: other rungs tell another."""
    if failed is None:
        return None
    return Sample(
        series=series.key,
        value=NAN,
        outcome=failed.outcome,
        passed=False,
        set_point_held=False,
        failure=sentence(f"not timed: {failed.failure}"),
    )


def _scalar(
    series: SeriesDefinition, value: float | None, why_not: str, band: tuple[float, float] | None = None
) -> Sample:
    outcome: OutcomeClass = "value"
    if value is None:
        outcome = "missing"
    elif not math.isfinite(value):
        outcome = "not_finite"
    elif band is not None and not band[0] <= value <= band[1]:
        outcome = "out_of_limit"
    return Sample(
        series=series.key,
        value=NAN if value is None else Number(value),
        outcome=outcome,
        passed=outcome == "value",
        set_point_held=outcome in ("value", "out_of_limit"),
        failure=why_not if outcome in ("missing", "not_finite") else "",
    )
