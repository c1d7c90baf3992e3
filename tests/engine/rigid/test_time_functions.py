"""Loads, drives and kinematic bodies that follow the time, against sums written here and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    JointCoordinate,
    JointSpring,
    Load,
    Method,
    MethodError,
    Motor,
    Particle,
    Position,
    Prismatic,
    Ramp,
    RigidBody,
    Scene,
    SceneError,
    Sinusoid,
    Table,
    Velocity,
    simulate,
    start,
)
from tests.scenes.seen import traces

H = 0.01
WAVE = Sinusoid(amplitude=1.5, frequency=0.7, phase=0.3, offset=-0.2)
STEPS = Table((0.1, 0.35, 0.5, 1.2), (0.0, 2.0, -1.0, 0.5))
RISE = Ramp(start=0.2, end=0.9, start_value=-1.0, end_value=3.0)
FUNCTIONS = {"sinusoid": WAVE, "table": STEPS, "ramp": RISE}


def reference(function: Any, times: Any) -> Any:
    """The same number by NumPy."""
    if isinstance(function, Sinusoid):
        return function.offset + function.amplitude * np.sin(
            2 * np.pi * function.frequency * times + function.phase
        )
    table = function.table() if isinstance(function, Ramp) else function
    return np.interp(times, table.times, table.values)


def slider(**changes: Any) -> Scene:
    block = RigidBody(name="block", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    rail = Prismatic(name="rail", between=(WORLD, "block"), axis=(1.0, 0.0, 0.0), compliance=0.0, **changes)
    return Scene(bodies=(block,), constraints=(rail,))


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("substeps", [1, 3])
def test_a_load_is_taken_at_the_beginning_of_each_step(name: str, substeps: int) -> None:
    function = FUNCTIONS[name]
    body = Particle(name="body", mass=2.0, position=(0.0, 0.0, 0.0))
    push = Load(name="push", body="body", force=(3.0, -1.0, 0.0), factor=function)
    still = Load(name="still", body="body", force=(0.0, 0.0, 0.5))
    scene = Scene(bodies=(body,), forces=(push, still), gravity=(0.0, 0.0, -9.81))
    method = Method(substeps=substeps)
    seen = simulate(scene, time_step=H, steps=150, method=method, observe=traces(v=Velocity("body")))["v"]
    h = H / substeps
    kicks = reference(function, h * np.arange(150 * substeps))
    sums = np.concatenate([[0.0], np.cumsum(h * kicks)])[::substeps]

    np.testing.assert_allclose(seen[:, 0], 1.5 * sums, rtol=0, atol=1e-12)
    np.testing.assert_allclose(seen[:, 1], -0.5 * sums, rtol=0, atol=1e-12)
    np.testing.assert_allclose(seen[:, 2], (0.25 - 9.81) * H * np.arange(151), rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_motor_has_the_speed_of_the_end_of_its_step(name: str) -> None:
    function = FUNCTIONS[name]
    observe = traces(v=Velocity("block"))
    seen = simulate(slider(motor=Motor(speed=function)), time_step=H, steps=150, observe=observe)["v"]

    np.testing.assert_allclose(seen[1:, 0], reference(function, H * np.arange(1, 151)), rtol=0, atol=1e-12)


def test_a_motor_at_mid_step_leads_its_joint_with_order_two() -> None:
    errors = []
    for steps in (100, 200, 400):
        scene = slider(motor=Motor(speed=WAVE))
        observe = traces(x=JointCoordinate("rail"))
        seen = simulate(
            scene,
            time_step=1.0 / steps,
            steps=steps,
            method=Method(half_step_velocities=True),
            observe=observe,
        )["x"]
        w = 2.0 * math.pi * WAVE.frequency
        right = WAVE.offset + WAVE.amplitude * (math.cos(WAVE.phase) - math.cos(w + WAVE.phase)) / w
        errors.append(abs(float(seen[-1]) - right))

    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_spring_follows_its_rest_as_the_averaged_law_says(name: str) -> None:
    """(M + eps' ) by hand: one row, G = 1, g = x − r(t); ¼(g₊ + 2g + g₋) and the damping, r taken exactly."""
    function, mass, k, tau = FUNCTIONS[name], 2.0, 80.0, 0.03
    rest = reference(function, H * np.arange(-1, 152))
    theta, x, v = tau / H, 0.0, 0.0
    ups = 1.0 / (1.0 + 4.0 * theta)
    sig = 4.0 / k * ups / H**2
    right = [0.0]
    for n in range(150):
        r_before, r, r_ahead = rest[n], rest[n + 1], rest[n + 2]
        before, ahead = (r - r_before) / H, (r_ahead - r) / H
        wanted = -4.0 / H * ups * (x - r) + ups * (v - before) + ahead
        impulse = (wanted - v) / (1.0 / mass + sig)
        v += impulse / mass
        x += H * v
        right.append(x)
    scene = slider(spring=JointSpring(stiffness=k, rest=function, damping=tau))
    seen = simulate(scene, time_step=H, steps=150, observe=traces(x=JointCoordinate("rail")))["x"]

    np.testing.assert_allclose(seen, right, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_kinematic_body_goes_as_the_middle_of_each_step_says(name: str) -> None:
    function = FUNCTIONS[name]
    floor = RigidBody(
        name="floor", motion="kinematic", position=(0.0, 0.0, 0.0), velocity=(0.0, 2.0, 0.0), pace=function
    )
    scene = Scene(bodies=(floor,))
    seen = simulate(scene, time_step=H, steps=150, observe=traces(x=Position("floor")))["x"]
    right = np.concatenate([[0.0], np.cumsum(2.0 * H * reference(function, H * (np.arange(150) + 0.5)))])

    np.testing.assert_allclose(seen[:, 1], right, rtol=0, atol=1e-12)


def test_compositions_and_settings_from_outside_do_not_follow_the_time() -> None:
    push = Load(name="push", body="block", force=(1, 0, 0), factor=WAVE)
    with pytest.raises(MethodError, match="'push' does not follow"):
        simulate(replace(slider(), forces=(push,)), time_step=H, steps=1, method=Method(composition="order4"))
    with pytest.raises(SceneError, match="follows the time"):
        start(slider(motor=Motor(speed=WAVE)), time_step=H).set_motor("rail", speed=1.0)
