"""Every scalar test of the catalogue, put to the engine: because it is in the catalogue, not because it is named here."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import EngineError, SimulationFailed, simulate
from spook_tracker.scalar_tests.case import Figure, Measurement, ScalarTest, Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.measure.remembered import Remembered
from tests.toys.broken_engines import BROKEN


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_value_keeps_its_limit_and_its_set_point_and_every_figure_is_drawn(name: str) -> None:
    """As in a night nothing of a test is simulated twice."""
    once = Remembered(simulate)
    for measurement in CATALOGUE[name].measurements:
        keeps(measurement, once)
    for figure in CATALOGUE[name].figures:
        is_drawn(figure, once)


def keeps(measurement: Measurement, simulate: Simulate) -> None:
    values = measurement.measure(simulate)

    assert set(values) >= {metric.name for metric in measurement.metrics}
    for metric in measurement.metrics:
        value = values[metric.name]
        assert type(value) is float, metric.name
        assert metric.passes(value), (measurement.configuration, metric.name, value)
        assert metric.holds_set_point(value), (measurement.configuration, metric.name, value)


def is_drawn(figure: Figure, simulate: Simulate) -> None:
    drawing = figure.draw(simulate)

    assert drawing.x_label and drawing.y_label and drawing.curves
    for curve in drawing.curves:
        assert len(curve.x) == len(curve.y) > 1, curve.name
        assert np.isfinite(curve.y).any(), curve.name


def gate_is_red(test: ScalarTest, engine: Simulate) -> bool:
    """Whether some gate of the test fails with this engine, by its value or because the run did not complete."""
    for measurement in test.measurements:
        gates = [metric for metric in measurement.metrics if metric.role == "gate"]
        if gates:
            try:
                values = measurement.measure(engine)
            except SimulationFailed:
                return True
            except EngineError:  # refused by name: not an answer
                continue
            if not all(metric.passes(values[metric.name]) for metric in gates):
                return True
    return False


@pytest.mark.parametrize("name", CATALOGUE)
def test_some_fault_of_an_engine_turns_a_gate_red(name: str) -> None:
    """A gate that no fault reaches says nothing."""
    assert any(gate_is_red(CATALOGUE[name], engine) for engine in BROKEN.values())
