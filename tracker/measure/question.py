"""Put one question to the engine and write down whatever happens.

A measurement that fails is a sample like any other, with an outcome class and one sentence; nothing a test
does ends the run. The work counters and the hash of the final state are taken from every simulation behind a
value by standing between the test and the engine.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import msgspec

from spook_tracker.engine.protocol import NotSupported
from spook_tracker.engine.result import Result, SimulationFailed
from spook_tracker.scalar_tests.case import (
    BreakPoint,
    Estimate,
    Figure,
    Measurement,
    Metric,
    OutOfTime,
    ScalarTest,
    Simulate,
    StabilityMap,
    StabilityStudy,
)
from spook_tracker.tracker.document.json_form import Number, Numbers
from spook_tracker.tracker.document.run_document import (
    Curve,
    FigureData,
    MapData,
    OutcomeClass,
    Sample,
    Sensitivity,
    SeriesDefinition,
)

from .definition import definition_hash

if TYPE_CHECKING:
    from spook_tracker.engine.scene import Scene

DEFAULT_TIME_LIMIT = (
    300.0  # s per simulation, for tests that set none: a hanging engine must not stop a night
)
SENTENCE = 300  # characters kept of a failure


@dataclass
class Witness:
    """Stands between a test and the engine: forwards, and keeps counters and state hashes."""

    simulate: Simulate
    time_limit: float | None = DEFAULT_TIME_LIMIT
    counters: dict[str, int] = field(default_factory=dict)
    hashes: list[str] = field(default_factory=list)
    seconds: float = 0.0  # that the simulations took, while others may have been at work
    unsettled: Result | None = None  # the simulation whose solver left the most

    def __call__(self, scene: Scene, **options: Any) -> Result:
        if options.get("time_limit") is None:
            options["time_limit"] = self.time_limit
        result = self.simulate(scene, **options)
        for name, count in result.counters.items():
            self.counters[name] = self.counters.get(name, 0) + int(count)
        self.hashes.append(result.state_hash)
        self.seconds += result.seconds
        if result.status == "unsettled" and (
            self.unsettled is None or result.residual > self.unsettled.residual
        ):
            self.unsettled = result
        return result

    @property
    def state_hash(self) -> str:
        """The only simulation's own hash, or a hash over all of them in order."""
        if len(self.hashes) <= 1:
            return "".join(self.hashes)
        return hashlib.sha256("\n".join(self.hashes).encode()).hexdigest()[: len(self.hashes[0]) or 16]


@dataclass(frozen=True)
class Outcome:
    """What came of asking: a value, or an outcome class with one sentence."""

    value: Any
    outcome: OutcomeClass = "value"
    failure: str = ""

    def settled(self, witness: Witness) -> Outcome:
        """The same; a value that rests on a solve which did not settle is "unsettled", with body, step, residual."""
        if self.outcome != "value" or witness.unsettled is None:
            return self
        return Outcome(self.value, "unsettled", sentence(witness.unsettled.failure))


class NoAnswer(Exception):
    """No answer will come any more: the process was lost. `outcome` says how."""

    def __init__(self, outcome: OutcomeClass, failure: str) -> None:
        super().__init__(failure)
        self.outcome = outcome


def ask(question: Callable[[], Any]) -> Outcome:
    """Call a test's function; any exception but OutOfTime becomes an outcome with one sentence."""
    try:
        return Outcome(question())
    except OutOfTime:
        raise  # of a first look, which leaves it out
    except SimulationFailed as failure:
        status = failure.result.status
        if status == "completed" or status == "unsettled":  # both kept their values
            return Outcome(None, "crashed", sentence(str(failure)))
        return Outcome(None, status, sentence(str(failure)))
    except NoAnswer as lost:
        return Outcome(None, lost.outcome, str(lost))
    except NotSupported as lack:
        return Outcome(None, "not_supported", sentence(str(lack)))
    except ZeroDivisionError:
        return Outcome(
            None, "not_finite", "the measurement divided by zero: a force or a length it needs was none"
        )
    except SystemExit:
        return Outcome(None, "crashed", "the test tried to end the tracker")
    except RecursionError:
        return Outcome(None, "crashed", "the test called itself without end")
    except MemoryError:
        return Outcome(None, "crashed", "the test ran out of memory")
    except Exception as error:
        return Outcome(None, "crashed", sentence(f"{type(error).__name__}: {error}"))


def sentence(text: str) -> str:
    """One line of bounded length, for a table."""
    line = " ".join(text.split())
    return line if len(line) <= SENTENCE else line[: SENTENCE - 1] + "…"


def series_key(
    test: str, configuration: str, name: str, time_step: float | None, parameters: Mapping[str, float]
) -> str:
    """Readable, unique within a run (checked there) and independent of order and wording."""
    parts = [test, configuration, name]
    parts += [f"{key}={value:g}" for key, value in sorted(parameters.items())]
    if time_step is not None:
        parts.append(f"h={time_step:.6g}")
    return "/".join(parts)


def metric_series(name: str, test: ScalarTest, measurement: Measurement, metric: Metric) -> SeriesDefinition:
    """The series a metric of a measurement belongs to."""
    facts = (
        metric.formerly[0] if metric.formerly else metric.name,
        metric.unit,
        metric.better,
        metric.limit,
        metric.reference,
        measurement.configuration,
        measurement.time_step,
        dict(measurement.parameters),
    )
    return SeriesDefinition(
        key=series_key(
            name, measurement.configuration, metric.name, measurement.time_step, measurement.parameters
        ),
        test=name,
        title=test.title,
        configuration=measurement.configuration,
        metric=metric.name,
        description=metric.description,
        unit=metric.unit,
        role=metric.role,
        better=metric.better,
        kind="time" if metric.noisy else "scalar",
        time_step=measurement.time_step,
        parameters={key: float(value) for key, value in measurement.parameters.items()},
        limit=metric.limit,
        limit_source=metric.limit_source,
        limit_kind=metric.limit_kind,
        set_point=metric.set_point,
        set_point_source=metric.set_point_source,
        set_point_kind=metric.set_point_kind,
        reference=None if metric.reference_kind == "of another method" else metric.reference,
        tolerance=metric.tolerance,
        relative_tolerance=metric.relative_tolerance,
        test_version=definition_hash(measurement.measure, facts),
        iteration_tolerance=test.iteration_tolerance,
        counter_roles=dict(test.counter_roles),
    )


Measured = tuple[tuple[SeriesDefinition, Sample], ...]


def measure(name: str, test: ScalarTest, measurement: Measurement, simulate: Simulate) -> Measured:
    """Every metric of one measurement with its series, whatever happens on the way."""
    witness = Witness(simulate)
    answer = ask(lambda: _mapping(measurement.measure(witness)))
    measured = []
    for metric in measurement.metrics:
        outcome = answer
        if outcome.outcome == "value":
            if metric.name in answer.value:
                outcome = ask(partial(float, answer.value[metric.name])).settled(witness)
            else:
                there = ", ".join(sorted(map(str, answer.value))) or "nothing"
                outcome = Outcome(
                    None, "missing", sentence(f"the measurement gave no {metric.name!r}, only {there}")
                )
        series = metric_series(name, test, measurement, metric)
        given = answer.value.get(metric.name) if answer.outcome == "value" else None
        if isinstance(given, Estimate):
            series = msgspec.structs.replace(series, sensitivity=_sensitivity(given))
            if given.unsettled and outcome.outcome == "value":
                outcome = Outcome(outcome.value, "unsettled", sentence(given.unsettled))
        measured.append((series, judged_sample(series.key, metric, outcome, witness)))
    return tuple(measured)


def _sensitivity(given: Estimate) -> Sensitivity:
    return Sensitivity(
        rounding=Number(given.rounding),
        step_error=None if given.step_error is None else Number(given.step_error),
        scale=None if given.scale is None else Number(given.scale),
    )


def _mapping(values: object) -> Mapping[str, float]:
    if not isinstance(values, Mapping):
        raise TypeError(f"a measurement returns a mapping from metric to value, not {type(values).__name__}")
    return values


def judged_sample(key: str, metric: Metric, outcome: Outcome, witness: Witness) -> Sample:
    """A sample judged against tonight's limit and set point; what is not finite never passes."""
    value = float("nan") if outcome.value is None else float(outcome.value)
    kind, failure = outcome.outcome, outcome.failure
    if kind in ("value", "unsettled") and not math.isfinite(value):
        kind, failure = "not_finite", failure or f"the value is {value}"
    elif kind in ("value", "unsettled") and not metric.passes(value):
        kind = "out_of_limit"  # the worse class; the sentence still says what was unsettled
    return Sample(
        series=key,
        value=Number(value),
        outcome=kind,
        passed=kind == "value",
        set_point_held=kind in ("value", "unsettled", "out_of_limit") and metric.holds_set_point(value),
        failure=failure,
        counters=dict(sorted(witness.counters.items())),
        state_hash=witness.state_hash,
    )


def draw(name: str, figure: Figure, simulate: Simulate) -> FigureData:
    """A figure of the test from this run; one that cannot be drawn says why in its note."""
    drawn = ask(lambda: figure.draw(Witness(simulate)))
    drawing = drawn.value
    return FigureData(
        test=name,
        name=figure.name,
        title=figure.title,
        thesis=figure.thesis,
        x_label=drawing.x_label if drawing else "",
        y_label=drawing.y_label if drawing else "",
        x_scale=drawing.x_scale if drawing else "linear",
        y_scale=drawing.y_scale if drawing else "linear",
        note=drawing.note if drawing else f"could not be drawn: {drawn.failure}",
        curves=tuple(
            Curve(
                name=curve.name,
                x=Numbers(Number(x) for x in curve.x),
                y=Numbers(Number(y) for y in curve.y),
                style=curve.style,
            )
            for curve in (drawing.curves if drawing else ())
        ),
    )


def study(
    name: str, test: ScalarTest, question: StabilityStudy, simulate: Simulate, lost: Outcome | None = None
) -> Measured | MapData:
    """A break point as a series of its own, or a map; a failed study is a break point that failed.

    `lost` is what came of asking elsewhere, where the process was lost: then no engine is asked here.
    """
    witness = Witness(simulate)
    answer = lost or ask(lambda: question.study(witness))
    found = answer.value
    if isinstance(found, StabilityMap):
        return _map(name, question, found)
    if answer.outcome == "value" and not isinstance(found, BreakPoint):
        answer = Outcome(
            None, "crashed", f"the study gave {type(found).__name__}, not a break point or a map"
        )
        found = None
    metric = Metric(
        name=f"stability:{question.name}",
        description=question.title,
        unit=question.unit,
        role="companion",
        better=question.better,
        set_point=question.expected,
        set_point_source=question.expected_source,
        relative_tolerance=found.resolution if found else 0.0,
    )
    series = SeriesDefinition(
        key=series_key(name, question.configuration, metric.name, None, {}),
        test=name,
        title=test.title,
        configuration=question.configuration,
        metric=metric.name,
        description=f"{question.title} ({question.definition})",
        unit=question.unit,
        role=metric.role,
        better=metric.better,
        kind="break_point",
        time_step=None,
        parameters={},
        limit=None,
        limit_source="",
        set_point=question.expected,
        set_point_source=question.expected_source,
        reference=None,
        tolerance=0.0,
        relative_tolerance=metric.relative_tolerance,
        test_version=definition_hash(question.study, (question.name, question.unit, question.better)),
        iteration_tolerance=test.iteration_tolerance,
        counter_roles=dict(test.counter_roles),
    )
    if found is not None:
        witness.counters["evaluations"] = found.evaluations
        answer = Outcome(found.value)
    return ((series, judged_sample(series.key, metric, answer, witness)),)


def _map(name: str, question: StabilityStudy, found: StabilityMap) -> MapData:
    prediction = found.prediction
    return MapData(
        test=name,
        name=question.name,
        title=question.title,
        configuration=question.configuration,
        definition=question.definition,
        x_label=found.x_label,
        y_label=found.y_label,
        x=tuple(map(float, found.x)),
        y=tuple(map(float, found.y)),
        cells=found.cells,
        prediction=tuple(tuple(map(Number, row)) for row in prediction) if prediction else None,
        note=found.note,
    )
