"""Break points and maps: the bracketing itself, what theory says about them, and that a broken engine is seen."""

from __future__ import annotations

import functools
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import PLAIN, Distance, simulate
from spook_tracker.engine.theory import one_row_matrix
from spook_tracker.scalar_tests.bracket import break_count, break_point, cell, is_stable
from spook_tracker.scalar_tests.case import BreakPoint, Simulate, StabilityMap, StabilityStudy
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.oscillators.oscillator.stability import (
    growth_error,
    measured_growth,
    predicted_growth,
)

KINDS = {"settled", "bounded", "growing", "diverged", "not_finite"}
STUDIES = [(name, study) for name, test in CATALOGUE.items() for study in test.stability]


def study_of(test: str, name: str) -> StabilityStudy:
    return next(study for study in CATALOGUE[test].stability if study.name == name)


@functools.cache
def answer(test: str, name: str) -> BreakPoint | StabilityMap:
    """What our engine gives, searched once."""
    return study_of(test, name).study(simulate)


def point(test: str, name: str, engine: Simulate = simulate) -> float:
    found = answer(test, name) if engine is simulate else study_of(test, name).study(engine)
    assert isinstance(found, BreakPoint)
    return found.value


# --- bracketing -----------------------------------------------------------------------------------------


def test_a_break_point_lies_within_its_resolution_below_the_first_failure() -> None:
    found = break_point(lambda value: value < 370.0, 1.0, 1e6, resolution=0.01)

    assert 370.0 * math.exp(-0.01) <= found.value < 370.0
    assert found.resolution == 0.01


def test_a_break_point_may_be_searched_downwards() -> None:
    found = break_point(lambda value: value > 2.5e-4, 1.0, 1e-8, resolution=0.01)

    assert 2.5e-4 < found.value <= 2.5e-4 * math.exp(0.01)


def test_holding_again_beyond_the_first_failure_does_not_count() -> None:
    found = break_point(lambda value: not 10.0 < value < 100.0, 1.0, 1e4, resolution=0.01, walk=20)

    assert found.value <= 10.0


def test_what_never_breaks_gives_the_end_and_what_never_holds_gives_no_number() -> None:
    assert break_point(lambda value: True, 1.0, 100.0).value == pytest.approx(100.0)
    assert math.isnan(break_point(lambda value: False, 1.0, 100.0).value)
    assert break_count(lambda count: True, (1, 2, 8)).value == 8.0
    assert math.isnan(break_count(lambda count: False, (1, 2, 8)).value)


def test_counts_are_found_exactly() -> None:
    assert break_count(lambda count: count <= 57, (2, 10, 50, 100)).value == 57.0


@pytest.mark.parametrize(
    ("history", "kind"),
    [
        (np.exp(-np.arange(90.0)), "settled"),
        (np.sin(np.arange(90.0)), "bounded"),
        (np.exp(0.1 * np.arange(90.0) - 12.0), "growing"),
        (np.where(np.arange(90) == 3, 50.0, 0.0), "growing"),
        (np.full(90, np.nan), "not_finite"),
    ],
)
def test_a_run_goes_into_the_cell_its_history_says(history: Any, kind: str) -> None:
    result: Any = SimpleNamespace(status="completed", completed=True)

    assert cell(result, history, bound=10.0, rest=1e-6) == kind


def test_a_run_that_did_not_complete_is_never_stable() -> None:
    for status, kind in (
        ("diverged", "diverged"),
        ("not_finite", "not_finite"),
        ("timed_out", "diverged"),
        ("stalled", "diverged"),
    ):
        result: Any = SimpleNamespace(status=status, completed=False)
        assert cell(result, np.zeros(9), bound=1.0) == kind
        assert not is_stable(kind)


# --- the studies ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("test", "study"), STUDIES, ids=[f"{test}-{study.name}" for test, study in STUDIES])
def test_every_study_answers_its_question(test: str, study: StabilityStudy) -> None:
    assert study.definition and study.title
    found = answer(test, study.name)
    if isinstance(found, StabilityMap):
        assert len(found.cells) == len(found.y) and all(len(row) == len(found.x) for row in found.cells)
        assert {kind for row in found.cells for kind in row} <= KINDS
        if found.prediction is not None:
            assert len(found.prediction) == len(found.y)
            assert all(len(row) == len(found.x) for row in found.prediction)
        return
    assert math.isfinite(found.value) and found.value > 0.0
    if study.expected is not None:
        assert study.expected_source
        assert study.expected[0] <= found.value <= study.expected[1] * (1.0 + 1e-12), found


def test_studies_are_repeatable_bit_for_bit() -> None:
    for test, name in (("pendulum", "damping-compliance-map"), ("n_pendulum", "longest-chain-plain")):
        assert study_of(test, name).study(simulate) == answer(test, name)


def test_plain_spook_breaks_where_the_explicit_sideways_step_must() -> None:
    assert 350.0 < point("hanging_chain", "mass-ratio-plain") < 380.0


def test_growth_rates_are_the_eigenvalues_of_the_method() -> None:
    assert growth_error(simulate) < 1e-10


def test_the_linear_row_is_never_predicted_to_grow() -> None:
    found = answer("oscillator_damped", "growth-map")

    assert isinstance(found, StabilityMap) and found.prediction is not None
    assert max(value for row in found.prediction for value in row) <= 1.0 + 1e-12


# --- a broken engine ------------------------------------------------------------------------------------


def test_losing_string_stiffness_moves_its_break_point_by_decades() -> None:
    def without(scene: Any, **options: Any) -> Any:
        return simulate(scene, **(options | {"method": PLAIN}))

    broken = point("hanging_chain", "mass-ratio-string", without)
    study = study_of("hanging_chain", "mass-ratio-string")

    assert study.expected is not None and broken < study.expected[0] / 1e5


def test_losing_damping_is_seen() -> None:
    """Damping a thousandth of what was asked, as a misplaced factor would make it."""

    def weak(scene: Any, **options: Any) -> Any:
        rows = [
            replace(c, damping=1e-3 * (c.damping or 0.0)) if isinstance(c, Distance) else c
            for c in scene.constraints
        ]
        return simulate(replace(scene, constraints=tuple(rows)), **options)

    assert growth_error(weak) > 1e-3
    assert point("pendulum", "smallest-damping", weak) > 100.0 * point("pendulum", "smallest-damping")


def test_the_misprinted_sign_of_the_damping_term_is_caught_by_name() -> None:
    """Eq 2.11 of the thesis has −τ where the method has +τ: one mass on one row, stepped so."""

    def misprinted(scene: Any, *, time_step: float, steps: int, observe: Any, **_: Any) -> Any:
        row, mass = scene.constraints[0], scene.bodies[0]
        step = one_row_matrix(mass.mass, row.compliance, -row.damping, time_step)
        states = [np.array([mass.position[2], mass.velocity[2]])]
        for _step in range(steps):
            states.append(step @ states[-1])
        path = np.array(states)
        place, speed = (np.pad(path[:, k : k + 1], ((0, 0), (2, 0))) for k in (0, 1))
        result = SimpleNamespace(completed=True, status="completed", sample_times={"x": np.arange(steps + 1)})
        found = {"x": place, "v": speed}
        return type("Run", (), {"__getitem__": lambda self, name: found[name], **vars(result)})()

    damped = CATALOGUE["oscillator_damped"].measurements[0]
    values = damped.measure(misprinted)

    assert [m.name for m in damped.metrics if m.role == "gate" and not m.passes(values[m.name])] == [
        "difference"
    ]
    assert abs(measured_growth(misprinted, 10.0, 2.0) - predicted_growth(10.0, 2.0)) > 1e-3
