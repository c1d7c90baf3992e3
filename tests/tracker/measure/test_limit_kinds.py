"""Whose a limit is decides which engine is held to it."""

from dataclasses import replace

import msgspec
import pytest

from spook_tracker.engine.protocol import Configuration
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.run_document import SeriesDefinition
from spook_tracker.tracker.measure.others import asked_of
from spook_tracker.tracker.measure.question import metric_series
from tests.histories.documents import run

THEIRS = (Configuration(name="default", reason="the only one"),)


def gates(test):
    return {metric.name for _, metric in test.metrics() if metric.role == "gate"}


def test_another_engine_is_held_to_physical_limits_alone():
    names = ("hanging_chain", "simple_pendulum", "falling_object", "grasp", "slip_angle")
    ours = {name: CATALOGUE[name] for name in names}

    asked = asked_of(ours, THEIRS, gating=True)

    assert gates(ours["hanging_chain"]) == {"length_deviation"}
    assert gates(ours["simple_pendulum"]) == {"library_error"}
    assert gates(asked["hanging_chain"]) == gates(asked["simple_pendulum"]) == set()
    assert gates(asked["falling_object"]) == {"position_error"}
    assert gates(asked["grasp"]) == {"held_time"}
    assert gates(asked["slip_angle"]) == {"slip_slope_error"}
    for test in asked.values():
        for _, metric in test.metrics():
            assert metric.limit is None or metric.limit_kind == "physical"
            assert metric.set_point is None


@pytest.mark.parametrize(
    ("name", "metric", "kept"),
    [
        ("falling_object", "position_error", None),
        ("oscillator_filter", "left_at_10", None),
        ("friction", "force_ratio", 0.5),
    ],
)
def test_another_engine_is_not_told_what_this_method_gives(name, metric, kept):
    """A reference that is this method's own is no right value of another's: neither drawn nor judged by."""

    def series_of(tests):
        return next(
            metric_series(name, tests[name], measurement, one)
            for measurement, one in tests[name].metrics()
            if one.name == metric
        )

    catalogue = {name: CATALOGUE[name]}
    assert series_of(catalogue).reference is not None
    theirs = series_of(asked_of(catalogue, THEIRS, gating=True))
    assert theirs.reference == kept

    whole = series_of(asked_of({name: all_physical(CATALOGUE[name])}, THEIRS, gating=True))
    assert whole.reference is not None
    assert theirs.test_version == whole.test_version, "the question is the same, and its history goes on"


def all_physical(test):
    measurements = (
        replace(one, metrics=tuple(replace(metric, reference_kind="physical") for metric in one.metrics))
        for one in test.measurements
    )
    return replace(test, measurements=tuple(measurements))


def test_a_teams_own_question_holds_its_own_engine_whatever_the_kind():
    theirs = {"their_chain": CATALOGUE["hanging_chain"]}

    assert gates(asked_of(theirs, THEIRS, gating=True)["their_chain"]) == {"length_deviation"}


@pytest.mark.parametrize("name", sorted(CATALOGUE))
def test_the_right_value_keeps_every_physical_limit(name):
    for _, metric in CATALOGUE[name].metrics():
        if metric.limit is None or metric.limit_kind != "physical":
            continue
        error = metric.better == "smaller_magnitude"  # of what is right, by name and description: nothing
        right = 0.0 if error else metric.reference
        if right is not None:
            assert metric.passes(right), (name, metric.name)


def test_a_document_from_before_the_kinds_is_read_as_the_methods_own():
    body = msgspec.json.decode(msgspec.json.encode(run().series[0]))
    del body["limit_kind"], body["set_point_kind"]

    read = msgspec.json.decode(msgspec.json.encode(body), type=SeriesDefinition)

    assert (read.limit_kind, read.set_point_kind) == ("method", "method")
