"""Error against run time: every configuration has the order of accuracy that theory gives it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import pytest

from spook_tracker.engine import PLAIN, Method, simulate
from spook_tracker.scalar_tests.case import Configuration, Ladder, Simulate, Unobserved
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.order import in_range, observed_order
from spook_tracker.tracker.measure.remembered import of_test

BAND = 0.1
LADDERS = [
    (name, ladder, configuration)
    for name, test in CATALOGUE.items()
    for ladder in test.ladders
    for configuration in ladder.configurations
]
TEST_OF = {id(ladder): name for name, ladder, _ in LADDERS}
ORDERED = [entry for entry in LADDERS if entry[2].expected_order is not None]
ORDERS = {(name, ladder.name, c.name): c.expected_order for name, ladder, c in LADDERS}


class Rung:
    """The error of a rung, asked of our engine once, however many tests look at it, and the steps it was found in."""

    KNOWN: ClassVar[dict[tuple[int, str, float], Rung]] = {}

    def __init__(self, ladder: Ladder, h: float, configuration: Configuration) -> None:
        self.steps: list[int] = []
        self.engine = of_test(TEST_OF[id(ladder)], simulate, scenes=True)  # two ladders may read one run
        self.error: float | Exception
        try:
            self.error = ladder.error(self._counting, h, configuration.method)
        except Exception as lost:  # an iterative solver may lose the scene
            self.error = lost

    def _counting(self, scene: Any, **options: Any) -> Any:
        result = self.engine(scene, **options)
        self.steps.append(result.steps if result.completed else -1)
        return result


def rung(ladder: Ladder, h: float, configuration: Configuration) -> Rung:
    place = id(ladder), configuration.name, h
    return Rung.KNOWN.get(place) or Rung.KNOWN.setdefault(place, Rung(ladder, h, configuration))


def error_at(ladder: Ladder, h: float, configuration: Configuration, engine: Simulate = simulate) -> float:
    if engine is not simulate:
        return ladder.error(engine, h, configuration.method)
    error = rung(ladder, h, configuration).error
    if isinstance(error, Exception):
        raise error
    return error


def order(ladder: Ladder, configuration: Configuration, engine: Simulate = simulate) -> float:
    steps = [h for h in ladder.steps_of(configuration) if in_range(h, configuration.order_range)]
    found = observed_order(steps, [error_at(ladder, h, configuration, engine) for h in steps])
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("ladder", "configuration"),
    [entry[1:] for entry in ORDERED],
    ids=[f"{name}-{ladder.name}-{configuration.name}" for name, ladder, configuration in ORDERED],
)
def test_the_observed_order_is_the_expected_one(ladder: Ladder, configuration: Configuration) -> None:
    assert configuration.expected_order is not None
    assert abs(order(ladder, configuration) - configuration.expected_order) < BAND


@pytest.mark.parametrize(
    ("test", "ladder", "configuration", "expected"),
    [
        ("falling_object", "position", "plain", 1.0),
        ("falling_object", "position", "half-step", None),
        ("pendulum", "length", "plain", 2.0),
        ("pendulum", "length", "curved", 4.0),
        ("planetarium", "position", "plain", 1.0),
        ("planetarium", "position", "half-step", 2.0),
        ("pendulum", "angle", "order 4", 4.0),
        ("planetarium", "position", "order 4", 4.0),
    ],
)
def test_the_orders_that_were_promised_are_asked_for(
    test: str, ladder: str, configuration: str, expected: float | None
) -> None:
    assert ORDERS[(test, ladder, configuration)] == expected


GIVEN = [ladder for test in CATALOGUE.values() for ladder in test.ladders if ladder.run]


@pytest.mark.parametrize("ladder", GIVEN, ids=lambda ladder: f"{TEST_OF[id(ladder)]}-{ladder.name}")
def test_running_and_measuring_simulate_the_same(ladder: Ladder) -> None:
    """What is timed does as many steps as what is measured, so that error and time belong together: where a ladder says
    itself what is timed. Otherwise it is what the error simulates, which is asked below."""
    for configuration in ladder.configurations:
        h = ladder.steps_of(configuration)[0]
        timed: list[int] = []

        def counted(_: Any, time_step: float, timed: list[int] = timed, **how: Any) -> Any:
            timed.append(how["steps"] if "steps" in how else round(how["duration"] / time_step))

        ladder.timed(counted, h, configuration.method)  # takes none of them
        measured = rung(ladder, h, configuration)
        if not isinstance(measured.error, Exception):
            assert set(measured.steps) == set(timed), configuration.name
            assert len(set(timed)) == 1


@pytest.mark.parametrize("method", [PLAIN, Method(half_step_velocities=True)], ids=["plain", "half-step"])
def test_what_is_timed_is_what_the_error_simulates_with_nothing_observed(method: Method) -> None:
    ladder = CATALOGUE["falling_object"].ladders[0]
    asked: list[dict[str, Any]] = []

    def engine(scene: Any, **how: Any) -> Any:
        asked.append(how)
        return simulate(scene, **how)

    measured, timed = (call(engine, 0.1, method) for call in (ladder.error, ladder.timed))
    with_observables, without = asked

    assert isinstance(measured, float) and timed.completed and timed.observables == {}
    assert with_observables.pop("observe") and with_observables == without and without["method"] == method
    assert ladder.timed == Unobserved(ladder.error) != Unobserved(simulate)  # equal runs share their times
    assert replace(ladder, error=simulate).timed == Unobserved(simulate)  # not what the error was before


def test_an_error_that_simulates_nothing_leaves_nothing_to_time() -> None:
    with pytest.raises(ValueError, match="give its ladder a `run`"):
        Unobserved(lambda simulate, h, method: 0.0)(simulate, 0.1, PLAIN)


def test_falling_with_half_step_velocities_is_exact() -> None:
    ladder = CATALOGUE["falling_object"].ladders[0]
    half_step = next(c for c in ladder.configurations if c.name == "half-step")

    assert all(abs(ladder.error(simulate, h, half_step.method)) < 1e-10 for h in ladder.time_steps)


def test_an_engine_that_forgets_its_options_has_the_wrong_order() -> None:
    def deaf(scene: Any, **options: Any) -> Any:
        return simulate(scene, **(options | {"method": PLAIN}))

    ladder = next(item for item in CATALOGUE["planetarium"].ladders if item.name == "position")
    half_step = next(c for c in ladder.configurations if c.name == "half-step")

    assert abs(order(ladder, half_step, deaf) - 1.0) < BAND


@pytest.mark.parametrize("name", [name for name, test in CATALOGUE.items() if test.ladders])
def test_every_target_is_within_reach(name: str) -> None:
    """Time to a given error is a trend only if each configuration reaches that error somewhere."""
    for ladder in CATALOGUE[name].ladders:
        if ladder.target_error is None:
            continue
        for configuration in ladder.configurations:
            assert any(
                abs(error_at(ladder, h, configuration)) <= ladder.target_error
                for h in sorted(ladder.steps_of(configuration), reverse=True)
            ), configuration.name
