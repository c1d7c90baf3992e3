"""Every scalar test of the catalogue, put to the engine: because it is in the catalogue, not because it is named here."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import EngineError, SimulationFailed, simulate
from spook_tracker.scalar_tests.case import Figure, Measurement, ScalarTest, Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.measure.remembered import Remembered
from tests.toys.broken_engines import BROKEN

# test, configuration, metric, value known from a closed form or an independent prototype, |difference| allowed
KNOWN = (
    ("falling_object", "plain", "position_error", 1.635, 1e-9),
    ("falling_object", "plain", "position_error_read_late", 4.903637, 1e-6),
    ("falling_object", "half-step", "position_error", 0.0, 1e-11),
    ("pendulum", "plain", "length_deviation", 0.407038, 0.407038e-5),
    ("pendulum", "plain", "energy_deviation", 3.433, 5e-4),
    ("pendulum", "curved", "length_deviation", 9.3e-4, 5e-6),
    ("pendulum", "curved twice", "length_deviation", 2.5e-6, 5e-8),
    ("n_pendulum", "plain", "length_deviation", 34.483, 34.483e-4),
    ("n_pendulum", "plain", "length_deviation_early", 12.164, 12.164e-4),
    ("n_pendulum", "plain", "weakest_link", 25.0, 0.0),
    ("n_pendulum", "plain", "energy_at_the_end", -35.85, 5e-3),
    ("n_pendulum", "plain", "energy_gain", 0.24, 5e-3),
    ("n_pendulum", "two substeps", "length_deviation", 13.0, 0.05),
    ("n_pendulum", "curved twice", "length_deviation", 10.0, 0.05),
    ("n_pendulum", "small motion", "frequency_error", 0.0, 1e-8),
    ("planetarium", "plain", "energy_oscillation", 9.843e-4, 5e-8),
    ("planetarium", "plain", "energy_oscillation_as_printed", 2.2857, 5e-5),
    ("planetarium", "plain", "angular_momentum_drift", 0.0, 1e-12),
    ("planetarium", "plain", "position_error", 2.5e-4, 5e-6),
    ("planetarium", "half-step", "position_error", 5.2e-7, 1e-8),
    ("planetarium", "long run", "energy_drift", 0.0, 1e-7),
    ("oscillator_spring", "plain", "difference", 0.0, 0.0),
    ("oscillator_filter", "plain", "left_at_100", 0.961, 5e-4),
    ("oscillator_filter", "plain", "left_at_50", 0.857, 5e-4),
    ("oscillator_filter", "plain", "left_at_20", 0.414, 5e-4),
    ("oscillator_filter", "plain", "left_at_10", 0.0667, 5e-5),
    ("oscillator_filter", "plain", "left_at_7", 0.0142, 5e-5),
    ("oscillator_filter", "plain", "left_at_5", 2.7e-3, 5e-5),
    ("oscillator_filter", "plain", "left_at_2", 7.45e-5, 5e-7),
    ("beam", "plain", "height_deviation", 0.0, 1e-12),
    ("beam", "compliant", "sag", 2.134e-7, 2.134e-10),
    ("door", "damped", "weight_error", -4.3e-7, 5e-9),
    ("door", "damped", "weight_error_settled", 0.0, 1e-9),
    ("door", "printed", "weight_error_at_20_s", 0.0090, 5e-5),
    ("door", "damped", "split_error", 0.0, 1e-9),
    ("friction", "cone", "force_ratio", 0.5, 1e-9),
    ("friction", "cone", "sliding_error", 0.0, 1e-9),
    ("friction", "cone", "direction_error", 0.0, 1e-6),
    ("friction", "box", "anisotropy", 0.1, 1e-3),
    ("cantilever", "dynamic", "tip_against_statics", 0.0, 1e-7),
    ("cantilever", "self-weight", "self_weight_ratio", 0.9925, 1e-4),
    ("resting_box", "direct", "depth_on_plane", 0.0, 1e-12),
    ("resting_box", "direct", "depth_on_box", 0.0, 1e-12),
    ("resting_ball", "direct", "weight_error", 0.0, 1e-12),
    ("resting_stack", "direct", "load_error", 0.0, 1e-9),
    ("resting_stack", "direct", "overlap", 0.0, 1e-9),
    ("door", "printed", "weight_error_to_65_s", -0.0193, 5e-5),
)


def first(test: str, configuration: str, metric: str) -> Measurement:
    """Of the measurements of that configuration, the first one that has it; a beam of 2000 boxes is left to the night."""
    asked = (m for m in CATALOGUE[test].measurements if m.configuration == configuration)
    return next(
        m for m in asked if metric in {one.name for one in m.metrics} and m.parameters.get("N") != 2000.0
    )


OWED = [(first(test, how, metric), metric, value, allowed) for test, how, metric, value, allowed in KNOWN]


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
    for known, name, owed, allowed in OWED:
        if known is measurement:
            assert abs(values[name] - owed) <= allowed, (measurement.configuration, name, values[name])


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
