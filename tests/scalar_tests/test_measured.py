"""Scenes that were measured: digits, their standard deviations and the statistics behind the limits, without the engine."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from scipy.stats import chi2

from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.impacts import last_bounce, oblique_impact
from spook_tracker.scalar_tests.oscillators import bar_pendulum, seconds_pendulum
from spook_tracker.scalar_tests.readings import Reading, deviation, farthest
from spook_tracker.scalar_tests.rotation import rolling_beats
from spook_tracker.tracker.website.nights import book
from spook_tracker.tracker.website.page_index import index
from tests.histories.synthetic import history

MEASURED = {name: test for name, test in CATALOGUE.items() if test.measured}
MODULES = {
    "oblique_impact": oblique_impact,
    "bar_pendulum": bar_pendulum,
    "seconds_pendulum": seconds_pendulum,
    "last_bounce": last_bounce,
    "rolling_beats": rolling_beats,
}


def test_five_scenes_at_least_stand_against_measured_data() -> None:
    assert len(MEASURED) >= 5
    assert set(MEASURED) == set(MODULES)


@pytest.mark.parametrize("name", MEASURED)
def test_each_says_its_source_its_digits_and_what_the_model_leaves_out(name: str) -> None:
    test, readings = MEASURED[name], MODULES[name].READINGS
    gate = next(metric for _, metric in test.metrics() if metric.name == "deviation")

    assert gate.role == "gate" and gate.limit_kind == "physical"
    assert MODULES[name].SOURCE in gate.limit_source and MODULES[name].SOURCE in test.reference
    assert any(line.startswith("Left out: ") for line in test.theory)
    digits = {label: value for label, value in test.parameters if label.startswith("measured, ")}
    assert len(digits) == len(readings)
    for one in readings:
        assert one.sigma > 0.0
        assert f"{one.value:.6g} ± {one.sigma:.2g}" in digits[f"measured, {one.at}"]


@pytest.mark.parametrize("count", [1, 4, 5, 7])
def test_a_right_model_is_further_off_once_in_a_thousand(count: int) -> None:
    assert farthest(count) == pytest.approx(math.sqrt(chi2.isf(1e-3, count) / count), rel=1e-12)


def test_a_deviation_is_counted_in_standard_deviations() -> None:
    readings = (Reading(at="a", value=1.0, sigma=0.1), Reading(at="b", value=2.0, sigma=0.5))

    assert deviation((1.1, 2.0), readings) == pytest.approx(math.sqrt(0.5))
    assert deviation((1.0, 1.0), readings) == pytest.approx(math.sqrt(2.0))


def test_two_who_read_the_same_figure_differ_by_the_standard_deviation_of_the_impact() -> None:
    """Brought to one angle along the slope of the curve that both read."""

    def curve(angle: float) -> float:
        return oblique_impact.sliding(angle)[0]

    apart = [
        (a - curve(at_a)) - (b - curve(at_b))
        for (at_a, a), (at_b, b) in zip(oblique_impact.FIRST, oblique_impact.SECOND, strict=True)
    ]

    assert np.sqrt(np.mean(np.square(apart))) == pytest.approx(oblique_impact.SIGMA, rel=0.05)


def test_the_impact_of_a_real_ball_is_not_that_of_a_frictionless_or_a_gripping_one() -> None:
    """What the gate would say of models that are wrong about the world."""
    none = [math.degrees(math.atan(math.tan(math.radians(a)))) for a in oblique_impact.ANGLES]
    gripping = [math.degrees(math.atan(5 / 7 * math.tan(math.radians(a)))) for a in oblique_impact.ANGLES]

    assert deviation(none, oblique_impact.READINGS) > 20.0 * farthest(4)
    assert deviation(gripping, oblique_impact.READINGS) > 10.0 * farthest(4)


def test_bars_swing_neither_as_threads_do_nor_by_small_swings_alone() -> None:
    bars = list(zip(bar_pendulum.LENGTHS, bar_pendulum.STARTS, strict=True))
    exact = deviation((bar_pendulum.right(*bar) for bar in bars), bar_pendulum.READINGS)
    threads = [2.0 * math.pi * math.sqrt(length / bar_pendulum.GRAVITY) for length, _ in bars]

    assert exact < farthest(5) < deviation(threads, bar_pendulum.READINGS)
    small = [2.0 * math.pi * math.sqrt(2.0 * length / (3.0 * bar_pendulum.GRAVITY)) for length, _ in bars]
    assert deviation(small, bar_pendulum.READINGS) > exact


def test_a_second_of_1818_knows_gravity_to_five_digits() -> None:
    def off(gravity: float) -> float:
        beat = math.pi * math.sqrt(seconds_pendulum.LENGTH / gravity)
        return deviation((beat,), seconds_pendulum.READINGS)

    assert off(seconds_pendulum.GRAVITY) < 1.0
    assert off(9.81) > 2.0 * farthest(1), "two thousandths of gravity are seen"
    assert off(seconds_pendulum.GRAVITY + 140e-6) > off(seconds_pendulum.GRAVITY), "Potsdam was too high"


def test_the_limit_of_the_last_bounce_is_a_step_for_each_bounce_that_is_heard() -> None:
    """Counted bounce by bounce: flights of an ideal ball, each e times as long as the one before."""
    g, flight, begun, last, count = last_bounce.GRAVITY, last_bounce.FIRST, 0.0, 0.0, 0
    while g * flight**2 / 8.0 > last_bounce.HEARD:
        speed = 0.5 * g * flight
        last = begun + (speed + math.sqrt(speed**2 - 2.0 * g * last_bounce.HEARD)) / g
        begun, flight, count = begun + flight, flight * math.sqrt(last_bounce.KEPT), count + 1
    metric = next(m for _, m in CATALOGUE["last_bounce"].metrics() if m.name == "theory_error")

    assert last == pytest.approx(last_bounce.heard(), rel=1e-12) and last < last_bounce.END
    assert metric.limit == pytest.approx((count + 1) * last_bounce.TIME_STEP / last, rel=1e-12)


def test_what_is_read_of_the_height_moves_the_end_as_the_standard_deviation_has_it() -> None:
    def end(kept: float) -> float:
        return last_bounce.FIRST / (1.0 - math.sqrt(kept))

    half = 0.5 * last_bounce.READ
    moved = end(last_bounce.KEPT + half) - end(last_bounce.KEPT - half)
    assert math.hypot(moved, 0.005 * last_bounce.END / last_bounce.FIRST) == pytest.approx(
        last_bounce.READINGS[0].sigma, rel=2e-3
    )


def test_galileo_heard_his_beats_no_worse_than_an_ear_does_and_his_frets_are_no_other_law() -> None:
    beats = range(1, rolling_beats.BEATS)
    squares = [(n / rolling_beats.BEATS) ** 2 for n in beats]

    assert deviation(squares, rolling_beats.READINGS) < 1.0
    assert deviation((n / rolling_beats.BEATS for n in beats), rolling_beats.READINGS) > 5.0 * farthest(7)


def test_the_first_page_sets_what_was_measured_apart() -> None:
    """A row for its physical gate, and none among every other test."""
    told = book(history(2))
    other = next(test for test in told.tests if test.gates())
    other.card = structs.replace(other.card, seven=False)
    before = index(told, ()).context
    assert before["measured"] == [] and any(
        row.test == other.name for group in before["others"] for row in group.lines
    )

    other.card = structs.replace(other.card, measured=True)
    gate = other.gates()[0]
    gate.told = replace(gate.told, definition=structs.replace(gate.definition, limit_kind="physical"))
    after = index(told, ()).context
    assert [row.test for row in after["measured"]] == [other.name]
    assert all(row.test != other.name for group in after["others"] for row in group.lines)
