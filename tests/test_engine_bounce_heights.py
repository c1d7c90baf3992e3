"""How high bodies bounce: an elastic one for ever as high, another e² of it each time, whatever the solver and the step.

A step's velocity is that of the middle of the step before, so that a ball let go at rest falls as if it had g h/2 already: it
rises (g h/2)²/2g higher than it was dropped from. What a step cannot tell is an eighth of g h², the sag of a parabola under its chord.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    Energy,
    Material,
    Method,
    Plane,
    Position,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Trace,
    simulate,
)

GRAVITY = 9.81  # m/s²
HEIGHT = 2.0  # m
SOLVERS = [Method(), Method(solver="iterative"), Method(solver="hybrid"), Method(impacts="successive")]
HALF = Method(half_step_velocities=True)
STEPS = [1 / 60, 1 / 97, 1 / 240]


def dropped(shape: Shape, reach: float, restitution: float, h: float, duration: float, method: Method) -> Any:
    """Gap below a body [m] and energy [J], sampled each step; `reach` is from its middle to its lowest point, m."""
    material = Material(restitution=restitution)
    floor = RigidBody(
        name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=material
    )
    body = RigidBody(
        name="body", mass=1.0, shape=shape, position=(0.0, 0.0, reach + HEIGHT), material=material
    )
    run = simulate(
        Scene(bodies=(floor, body), gravity=(0.0, 0.0, -GRAVITY)),
        time_step=h,
        duration=duration,
        method=method,
        observe={"place": Trace(quantity=Position("body")), "energy": Trace(quantity=Energy())},
    )
    assert run.completed
    return run["place"][:, 2] - reach, run["energy"]


def tops(gap: np.ndarray) -> np.ndarray:
    """Of the parabola through the three samples around each top: samples are up to half a step beside it, m."""
    at = np.flatnonzero((gap[1:-1] > gap[:-2]) & (gap[1:-1] >= gap[2:])) + 1
    slope, bend = 0.5 * (gap[at + 1] - gap[at - 1]), gap[at + 1] - 2.0 * gap[at] + gap[at - 1]
    return np.asarray(gap[at] - 0.5 * slope**2 / bend)


@pytest.mark.parametrize("method", [*SOLVERS, HALF])
@pytest.mark.parametrize("h", STEPS)
def test_an_elastic_ball_is_as_high_after_a_minute(method: Method, h: float) -> None:
    gap, _ = dropped(Sphere(0.1), 0.1, 1.0, h, 60.0, method)
    start = 0.0 if method == HALF else 0.5 * GRAVITY * h

    np.testing.assert_allclose(tops(gap), HEIGHT + start**2 / (2.0 * GRAVITY), rtol=1e-9)
    assert len(tops(gap)) > 40


@pytest.mark.parametrize("method", [*SOLVERS, HALF])
@pytest.mark.parametrize(
    ("shape", "reach"), [(Box((0.4, 0.3, 0.2)), 0.1), (Capsule(0.1, 0.5), 0.35)], ids=["box", "capsule"]
)
def test_bodies_with_sides_meet_at_the_start_of_the_step_and_lose_nothing_by_it(
    shape: Shape, reach: float, method: Method
) -> None:
    h = 1 / 60
    gap, _ = dropped(shape, reach, 1.0, h, 30.0, method)
    start = 0.0 if method == HALF else 0.5 * GRAVITY * h

    np.testing.assert_allclose(tops(gap), HEIGHT + start**2 / (2.0 * GRAVITY), rtol=1e-6)


@pytest.mark.parametrize("method", [*SOLVERS, HALF])
@pytest.mark.parametrize("restitution", [0.5, 0.8, 0.95])
@pytest.mark.parametrize("h", STEPS)
def test_a_ball_rises_to_e_squared_of_where_it_was(restitution: float, method: Method, h: float) -> None:
    """As long as bounces last several steps; met up to a sag of the path beside the floor."""
    gap, _ = dropped(Sphere(0.1), 0.1, restitution, h, 10.0, method)
    found = tops(gap)
    found = found[: np.argmax(found < 40.0 * GRAVITY * h * h) or len(found)]
    before = np.concatenate(([HEIGHT], found[:-1]))

    assert len(found) >= 2
    assert np.abs(found - restitution**2 * before).max() < GRAVITY * h * h / 4.0


@pytest.mark.parametrize("h", STEPS)
def test_energy_read_in_the_middle_of_half_steps_is_kept_through_every_blow(h: float) -> None:
    _, energy = dropped(Sphere(0.1), 0.1, 1.0, h, 30.0, HALF)

    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)


@pytest.mark.parametrize("method", [Method(), Method(solver="iterative")])
@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
def test_what_bounces_comes_to_rest(restitution: float, method: Method) -> None:
    """Bounces shorter than a step end on the floor, not above it, and not later than the last of them would."""
    fall = math.sqrt(2.0 * HEIGHT / GRAVITY)
    stop, h = fall * (1.0 + restitution) / (1.0 - restitution), 1 / 60
    gap, energy = dropped(Sphere(0.1), 0.1, restitution, h, stop + 1.0, method)

    assert np.abs(gap[-30:]).max() < 1e-12
    assert np.ptp(energy[-30:]) == 0.0
