"""Our questions put to an engine that has configurations of its own.

A question is a metric at a time step with its parameters. It is asked once in each of the engine's
configurations, whatever configuration of ours asks it first. What judges SPOOK's method goes: limits and set points
of the kind "method", the limits of companions, orders of accuracy, references that are what SPOOK gives. A gate whose limit is physical stays one. A team's
own questions are about its own method: there both kinds hold.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TypeVar

from spook_tracker.engine.method import PLAIN
from spook_tracker.engine.protocol import Configuration
from spook_tracker.engine.result import Result
from spook_tracker.scalar_tests import case
from spook_tracker.scalar_tests.case import Ladder, Measurement, Metric, ScalarTest
from spook_tracker.scalar_tests.catalogue import CATALOGUE

from .catalogues import Changed

Answer = TypeVar("Answer")


def asked_of(
    tests: Mapping[str, ScalarTest],
    configurations: Sequence[Configuration],
    gating: bool,
    every_setting: bool = True,
) -> Mapping[str, ScalarTest]:
    """The catalogue as another engine is asked it: no figures and no stability studies, they are SPOOK's.

    Single values are asked in each configuration, or in the first alone; ladders in each.
    """
    single = configurations if every_setting else configurations[:1]

    def asked(name: str, test: ScalarTest) -> ScalarTest:
        if test.as_given:
            return test
        return replace(
            test,
            measurements=tuple(_measurements(test, single, gating, both_kinds=not _is_ours(name, test))),
            ladders=tuple(_ladder(ladder, one) for ladder in test.ladders for one in configurations),
            figures=(),
            stability=(),
        )

    return Changed(tests, asked)


def in_configuration(
    measure: Callable[..., Answer], configuration: str, simulate: Callable[..., Result], *rest: object
) -> Answer:
    """Call a test's function with `simulate` bound to a configuration of the engine."""
    return measure(partial(simulate, configuration=configuration), *rest)


def _measurements(
    test: ScalarTest, configurations: Sequence[Configuration], gating: bool, both_kinds: bool
) -> Iterator[Measurement]:
    asked: set[tuple[str, float | None, tuple[tuple[str, float], ...]]] = set()
    for measurement in sorted(test.measurements, key=_after_gates):
        fresh = []
        for metric in measurement.metrics:
            question = (metric.name, measurement.time_step, tuple(sorted(measurement.parameters.items())))
            if question not in asked:
                asked.add(question)
                fresh.append(metric)
        if not fresh:
            continue
        for position, one in enumerate(configurations):
            yield replace(
                measurement,
                configuration=one.name,
                metrics=tuple(_metric(metric, gating and position == 0, both_kinds) for metric in fresh),
                measure=partial(in_configuration, measurement.measure, one.name),
                note=one.reason,
            )


def _after_gates(measurement: Measurement) -> bool:
    return all(metric.role != "gate" for metric in measurement.metrics)


def _is_ours(name: str, test: ScalarTest) -> bool:
    return name in CATALOGUE and CATALOGUE[name] is test


def _metric(metric: Metric, gates: bool, both_kinds: bool) -> Metric:
    gate = metric.role == "gate" and (both_kinds or metric.limit_kind == "physical")
    expected = gate and metric.set_point_kind == "physical"
    return replace(
        metric,
        role="gate" if gate and gates else "explaining" if metric.role == "explaining" else "reported",
        limit=metric.limit if gate else None,
        limit_source=metric.limit_source if gate else "",
        set_point=metric.set_point if expected else None,
        set_point_source=metric.set_point_source if expected else "",
        reference_kind="of another method"
        if metric.reference_kind == "method" and not both_kinds
        else metric.reference_kind,
    )


def _ladder(ladder: Ladder, one: Configuration) -> Ladder:
    return replace(
        ladder,
        time_steps=ladder.all_steps(),
        configurations=(case.Configuration(name=one.name, method=PLAIN, expected_order=None),),
        error=partial(in_configuration, ladder.error, one.name),
        run=partial(in_configuration, ladder.timed, one.name),
    )
