"""Closed forms and tight integrations in the engine's place: each physical limit of the catalogue is kept by them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import pytest

from spook_tracker.engine.protocol import run
from spook_tracker.scalar_tests.case import Measurement, Metric, ScalarTest
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from tests.oracles.ideal import FORMS, Ideal


def physical(test: ScalarTest) -> Iterator[tuple[Measurement, list[Metric]]]:
    """What a test asks of any engine; a limit that configurations of ours share is asked once."""
    asked = set()
    for measurement in test.measurements:
        fresh = []
        for metric in measurement.metrics:
            question = (metric.name, metric.limit, measurement.time_step, *measurement.parameters.items())
            if metric.limit is not None and metric.limit_kind == "physical" and question not in asked:
                asked.add(question)
                fresh.append(metric)
        if fresh:
            yield measurement, fresh


QUESTIONS = {name: list(physical(CATALOGUE[name])) for name in CATALOGUE}


def test_every_physical_question_has_its_closed_form_or_tight_integration() -> None:
    assert set(FORMS) == {name for name, asked in QUESTIONS.items() if asked}


@pytest.mark.parametrize("name", FORMS)
def test_an_ideal_engine_keeps_every_physical_limit(name: str) -> None:
    for measurement, metrics in QUESTIONS[name]:
        values = measurement.measure(partial(run, Ideal(FORMS[name])))
        for metric in metrics:
            assert metric.passes(values[metric.name]), (metric.name, values[metric.name])
