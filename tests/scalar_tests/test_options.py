"""The options of the solver: each is asked by a gate that an engine whose option is part of the answer turns red."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import pytest

from spook_tracker.engine import Method, simulate
from spook_tracker.scalar_tests.case import BreakPoint, Simulate
from spook_tracker.scalar_tests.stacks.solver_options import TEST


def taking(change: Callable[[Method], Method], longer: float = 0.0) -> Simulate:
    """An engine that takes another method than it was given, with steps so much longer where it does."""

    def engine(scene: Any, *, time_step: float, method: Method, **rest: Any) -> Any:
        changed = change(method)
        off = 0.0 if changed == method else longer
        return simulate(scene, time_step=time_step * (1.0 + off), method=changed, **rest)

    return cast(Simulate, engine)


def eager(scene: Any, **options: Any) -> Any:
    """Calls every run unsettled."""
    return replace(simulate(scene, **options), status="unsettled")


@pytest.mark.parametrize(
    ("configuration", "engine"),
    [
        ("sleeping", taking(lambda method: replace(method, sleep_speed=0.0))),
        ("thresholds", taking(lambda method: replace(method, unsettled_residual=1e9))),
        ("thresholds", eager),
        ("caps", taking(lambda m: replace(m, correction_cap=1e-4) if m.correction_cap < 0.3 else m)),
        ("floors", taking(lambda m: replace(m, floor=1e-5) if m.floor > 1e-9 else m)),
    ],
)
def test_an_option_that_is_part_of_the_answer_is_red(configuration: str, engine: Simulate) -> None:
    (asked,) = (one for one in TEST.measurements if one.configuration == configuration)

    assert all(metric.passes(asked.measure(simulate)[metric.name]) for metric in asked.metrics)
    values = asked.measure(engine)
    assert not all(metric.passes(values[metric.name]) for metric in asked.metrics), values


@pytest.mark.parametrize(("wider", "held"), [(1.0, True), (0.99, False), (1.01, False)])
def test_the_cap_bites_where_the_pendulum_bends_as_much(wider: float, held: bool) -> None:
    study = next(one for one in TEST.stability if one.name == "tightest")
    low, high = study.expected or (0.0, 0.0)
    found = study.study(taking(lambda m: replace(m, correction_cap=min(1.0, m.correction_cap * wider))))

    assert isinstance(found, BreakPoint)
    assert (low <= found.value <= high) == held


def test_every_guard_users_rely_on_is_asked() -> None:
    asked = {name for name, _ in TEST.parameters}

    assert {"sleep_speed", "unsettled_residual", "correction_cap", "floor"} <= asked
    assert asked - {"time step"} <= set(Method.__dataclass_fields__)


def test_no_run_of_a_measurement_is_unsettled() -> None:
    """The tracker takes a value from such a run for no value."""
    seen = []

    def engine(scene: Any, **options: Any) -> Any:
        seen.append(simulate(scene, **options))
        return seen[-1]

    for asked in TEST.measurements:
        asked.measure(cast(Simulate, engine))

    assert {result.status for result in seen} == {"completed"}
