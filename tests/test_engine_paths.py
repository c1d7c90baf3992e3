"""Kinematic bodies along a path, by an angle, and with a pace of their spin apart."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Ball,
    Box,
    Final,
    Material,
    Method,
    MethodError,
    Orientation,
    Position,
    Ramp,
    RigidBody,
    Scene,
    SceneError,
    Sinusoid,
    Sphere,
    Table,
    Trace,
    Velocity,
    simulate,
    start,
)

H = 0.01  # s
STEPS = 120
WAVE = Sinusoid(amplitude=0.2, frequency=1.0)
KNOTS = Table((0.0, 0.305, 0.5), (1.0, 1.4, 0.8))


def told(**motion: Any) -> RigidBody:
    return RigidBody(name="told", position=(0.0, 1.0, 2.0), motion="kinematic", **motion)


def followed(body: RigidBody, **method: Any) -> Any:
    observe = {
        "x": Trace(quantity=Position("told")),
        "v": Trace(quantity=Velocity("told")),
        "q": Trace(quantity=Orientation("told")),
        "w": Trace(quantity=AngularVelocity("told")),
    }
    return simulate(Scene(bodies=(body,)), time_step=H, steps=STEPS, observe=observe, method=Method(**method))


@pytest.mark.parametrize("method", [{}, {"half_step_velocities": True}, {"substeps": 3}])
def test_a_body_is_where_its_path_says_after_every_step(method: dict[str, Any]) -> None:
    result = followed(told(path=(WAVE, KNOTS, 2.0)), **method)
    times = H * np.arange(STEPS + 1)
    wanted = np.array([(WAVE(t), KNOTS(t), 2.0) for t in times])
    np.testing.assert_allclose(result["x"], wanted, rtol=0.0, atol=1e-14)  # no rounding gathers
    if not method:
        np.testing.assert_allclose(result["v"][1:], np.diff(wanted, axis=0) / H, rtol=0.0, atol=1e-11)


def test_a_body_stands_by_its_angle_after_every_step() -> None:
    angle = Sinusoid(amplitude=2.0, frequency=0.5)
    result = followed(told(angle=angle, angle_axis=(0.0, 2.0, 0.0)))
    half = 0.5 * np.array([angle(H * n) for n in range(STEPS + 1)])
    wanted = np.stack([np.cos(half), 0.0 * half, np.sin(half), 0.0 * half], axis=1)
    np.testing.assert_allclose(result["q"], wanted, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(result["w"][1:, 1], np.diff(2.0 * half) / H, rtol=0.0, atol=1e-11)


def test_spin_and_velocity_have_a_pace_each() -> None:
    ramp = Ramp(end=1.0)
    result = followed(
        told(velocity=(1.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 2.0), pace=ramp, spin_pace=WAVE)
    )
    middle = H * (np.arange(STEPS) + 0.5)
    np.testing.assert_allclose(result["v"][1:, 0], [ramp(t) for t in middle], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(result["w"][1:, 2], [2.0 * WAVE(t) for t in middle], rtol=0.0, atol=1e-14)
    alone = followed(told(velocity=(1.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 2.0), spin_pace=WAVE))
    np.testing.assert_allclose(alone["v"][1:, 0], 1.0, rtol=0.0, atol=0.0)
    np.testing.assert_allclose(alone["w"], result["w"], rtol=0.0, atol=0.0)


def test_a_path_carries_what_hangs_on_it_and_what_lies_on_it() -> None:
    hanger = RigidBody(name="load", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, -1.0))
    scene = Scene(
        bodies=(
            RigidBody(
                name="hook",
                position=(0.0, 0.0, 0.0),
                motion="kinematic",
                path=(Sinusoid(amplitude=0.1, frequency=0.5), 0.0, 0.0),
            ),
            hanger,
        ),
        constraints=(Ball(name="pin", between=("hook", "load"), at=(0.0, 0.0, 0.0), compliance=0.0),),
        gravity=(0.0, 0.0, -9.81),
    )
    observe = {"x": Final(quantity=Position("load")), "hook": Final(quantity=Position("hook"))}
    result = simulate(scene, time_step=1e-3, steps=1500, observe=observe)
    assert math.dist(result["x"], result["hook"]) == pytest.approx(1.0, abs=1e-6)

    lift = Table((0.0, 1.0), (0.0, 0.5))
    box = RigidBody(
        name="box",
        mass=1.0,
        shape=Box((0.2, 0.2, 0.2)),
        position=(0.0, 0.0, 0.2),
        material=Material(friction=0.5),
    )
    table = RigidBody(
        name="lift",
        shape=Box((1.0, 1.0, 0.2)),
        position=(0.0, 0.0, 0.0),
        motion="kinematic",
        path=(0.0, 0.0, lift),
        material=Material(friction=0.5),
    )
    result = simulate(
        Scene(bodies=(box, table), gravity=(0.0, 0.0, -9.81)),
        time_step=H,
        steps=80,
        observe={"x": Final(quantity=Position("box"))},
    )
    np.testing.assert_allclose(result["x"], (0.0, 0.0, 0.2 + lift(0.8)), atol=1e-9)


@pytest.mark.parametrize(
    ("make", "say"),
    [
        (lambda: told(path=(0.5, 1.0, 2.0)), "begins at x = 0.5 m, but it stands at 0 m"),
        (lambda: told(path=(0.0, 1.0)), "three numbers or functions"),
        (lambda: told(path=(0.0, 1.0, math.nan)), "finite"),
        (lambda: told(path=(0.0, 1.0, lambda t: t)), "must be a number, Sinusoid"),
        (lambda: told(path=(0.0, 1.0, 2.0), velocity=(1.0, 0.0, 0.0)), "leave its velocity"),
        (lambda: told(angle=Sinusoid(amplitude=1.0, frequency=1.0, phase=1.0)), "instead of 0"),
        (lambda: told(angle=WAVE, angular_velocity=(1.0, 0.0, 0.0)), "leave its angular velocity"),
        (lambda: told(angle=WAVE, angle_axis=(0.0, 0.0, 0.0)), "angle_axis"),
        (
            lambda: RigidBody(
                name="b", mass=1.0, shape=Sphere(1.0), position=(0.0, 0.0, 0.0), path=(0.0, 0.0, 0.0)
            ),
            "only a kinematic body has a path",
        ),
        (
            lambda: RigidBody(
                name="b", mass=1.0, shape=Sphere(1.0), position=(0.0, 0.0, 0.0), spin_pace=WAVE
            ),
            "only a kinematic body has a spin_pace",
        ),
    ],
)
def test_hostile_paths_are_refused_in_one_sentence(make: Any, say: str) -> None:
    with pytest.raises(SceneError, match=say):
        make()


def test_compositions_and_settings_from_outside_do_not_follow_a_path() -> None:
    with pytest.raises(MethodError, match="the path of 'told' does not follow"):
        followed(told(path=(WAVE, 1.0, 2.0)), composition="order4")
    with (
        start(Scene(bodies=(told(path=(WAVE, 1.0, 2.0)),)), time_step=H) as run,
        pytest.raises(SceneError, match="follows the time"),
    ):
        run.set_velocity("told", velocity=(1.0, 0.0, 0.0))
