"""What the particle scenes are held to agrees with what is known from elsewhere, and a broken engine is seen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import Particle, Position, Scene, SimulationFailed, simulate
from spook_tracker.scalar_tests.case import Metric, Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.oscillators.oscillator import scene as oscillator
from spook_tracker.scalar_tests.ropes import chain
from spook_tracker.scalar_tests.thesis.pendulum import scene as pendulum_scene
from spook_tracker.scalar_tests.thesis.planetarium import scene as planetarium_scene
from tests.scenes.seen import finals
from tests.toys.broken_engines import deaf, off_by, scaled, with_scene

PARTICLE_TESTS = [
    name
    for name, test in CATALOGUE.items()
    if all(isinstance(body, Particle) for body in test.example().scene.bodies)
]


def gates(test: str, engine: Simulate) -> list[tuple[Metric, float]]:
    found = []
    for measurement in CATALOGUE[test].measurements:
        metrics = [metric for metric in measurement.metrics if metric.role == "gate"]
        if metrics:
            values = measurement.measure(engine)
            found += [(metric, values[metric.name]) for metric in metrics]
    return found


# --- a broken engine ------------------------------------------------------------------------------------


def coarse(scene: Scene, *, time_step: float, duration: float, **options: Any) -> Any:
    """Takes steps of 20 s, whatever it is told."""
    return simulate(scene, time_step=20.0, duration=duration, **options)


BROKEN: dict[str, Any] = {
    "falling_object": off_by(1.01, "gravity"),
    "pendulum": deaf,
    "n_pendulum": deaf,
    "oscillator_spring": off_by(1.0 + 1e-12, "stiffness"),
    "oscillator_row": off_by(1.0 + 1e-9, "compliance"),
    "oscillator_damped": off_by(1.0 + 1e-9, "damping"),
    "oscillator_filter": off_by(1.0 + 1e-6, "damping"),
}


@pytest.mark.parametrize("test", BROKEN)
def test_a_broken_engine_turns_every_gate_red(test: str) -> None:
    for metric, value in gates(test, BROKEN[test]):
        assert not metric.passes(value), (metric.name, value)


def test_an_engine_that_steps_too_coarsely_loses_the_orbit() -> None:
    planet = CATALOGUE["planetarium"].measurements[0]
    found = planet.measure(coarse)

    assert not any(metric.passes(found[metric.name]) for metric in planet.metrics if metric.role == "gate")


@pytest.mark.parametrize("test", PARTICLE_TESTS)
def test_the_slightest_change_of_physics_leaves_a_set_point_or_a_limit(test: str) -> None:
    """A part in a thousand of gravity, stiffness or attraction is seen, though the printed limit may hold."""

    more, less = (1.001, ("gravity", "stiffness", "strength")), (0.999, ("compliance",))
    broken = with_scene(lambda scene: scaled(scaled(scene, *more), *less))
    seen = [
        not (metric.passes(value) and metric.holds_set_point(value))
        for measurement in CATALOGUE[test].measurements
        if "long" not in measurement.configuration
        for values in [measurement.measure(broken)]
        for metric in measurement.metrics
        for value in [values[metric.name]]
    ]

    assert any(seen)


def test_an_engine_that_fails_is_a_failure_and_not_a_value() -> None:
    def exploding(scene: Scene, **options: Any) -> Any:
        result = simulate(scene, **options)
        return replace(result, status="diverged", failure="body 'bob' ran away at step 3")

    with pytest.raises(SimulationFailed, match="ran away"):
        CATALOGUE["pendulum"].measurements[0].measure(exploding)


# --- the references themselves --------------------------------------------------------------------------


def test_the_period_of_the_pendulum_is_the_known_one() -> None:
    assert abs(pendulum_scene.period() - 2.36784194757624) < 1e-14
    assert abs(float(pendulum_scene.angle(0.0)) - np.pi / 2) < 1e-15
    assert abs(float(pendulum_scene.angle(pendulum_scene.period() / 2)) + np.pi / 2) < 1e-12


def test_kepler_starts_where_the_planet_starts_and_comes_back() -> None:
    assert np.allclose(planetarium_scene.exact_position(0.0), (1.0, 0.0), atol=1e-14)
    assert np.allclose(planetarium_scene.exact_position(planetarium_scene.PERIOD), (1.0, 0.0), atol=1e-12)
    assert abs(planetarium_scene.PERIOD - 365.1583) < 5e-5
    step = 1e-4
    forward, back = (np.array(planetarium_scene.exact_position(s)) for s in (step, -step))
    assert np.allclose((forward - back) / (2 * step), planetarium_scene.SPEED[:2], atol=1e-9)


def test_small_motion_of_the_chain_has_the_known_roots() -> None:
    squares, _ = chain.small_motion(26)

    assert abs(squares[0] / chain.GRAVITY - 0.05456448) < 5e-9
    assert abs(squares[-1] / chain.GRAVITY - 89.02840275) < 5e-9


def test_the_chain_reference_is_the_pendulum_for_one_link() -> None:
    x, z = chain.exact_tip(1, 2.0)
    theta = float(pendulum_scene.angle(2.0))

    assert np.allclose((x, z), (np.sin(theta), -np.cos(theta)), atol=1e-10)


def test_the_one_step_map_is_what_the_engine_does() -> None:
    exact = oscillator.one_step(50.4, 0.05) @ np.array([2.0, 3.0])
    result = simulate(
        oscillator.row_scene(50.4, 0.05, start=2.0, speed=3.0),
        time_step=oscillator.TIME_STEP,
        steps=1,
        observe=finals(x=Position("mass")),
    )

    assert abs(result["x"][2] - exact[0]) < 1e-13
