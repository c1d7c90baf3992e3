"""Kinematic bodies along a path, by an angle, and with a pace of their spin apart."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    AngularVelocity,
    Ball,
    Box,
    Hinge,
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
    Table,
    Velocity,
    Violation,
    simulate,
    start,
)
from tests.scenes.seen import finals, traces

H = 0.01  # s
STEPS = 120
WAVE = Sinusoid(amplitude=0.2, frequency=1.0)
KNOTS = Table((0.0, 0.305, 0.5), (1.0, 1.4, 0.8))


def told(**motion: Any) -> RigidBody:
    return RigidBody(name="told", position=(0.0, 1.0, 2.0), motion="kinematic", **motion)


def followed(body: RigidBody, **method: Any) -> Any:
    observe = traces(x=Position("told"), v=Velocity("told"), q=Orientation("told"), w=AngularVelocity("told"))
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
    observe = finals(x=Position("load"), hook=Position("hook"))
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
        observe=finals(x=Position("box")),
    )
    np.testing.assert_allclose(result["x"], (0.0, 0.0, 0.2 + lift(0.8)), atol=1e-9)


SHAKE, ROD, G = Sinusoid(amplitude=0.3, frequency=0.4, phase=0.7), 1.0, 9.81  # m, Hz, rad; m; m/s²
LEAN, AHEAD = 0.8, 0.3 * math.sin(0.7)  # rad; m, where the wave begins


def shaken(h: float, method: Method, by_path: bool) -> tuple[float, float]:
    """Error of a rod's centre [m] that hangs on a hinge shaken from the start on, and how far the hinge opens [m] once
    the first step, before which its motion was not known, is forgotten."""
    speed = 0.3 * 0.8 * math.pi
    moved: dict[str, Any] = (
        {"path": (Sinusoid(amplitude=0.3, frequency=0.4, phase=0.7, offset=-AHEAD), 0.0, 0.0)}
        if by_path
        else {
            "velocity": (speed, 0.0, 0.0),
            "pace": Sinusoid(amplitude=1.0, frequency=0.4, phase=0.7 + 0.5 * math.pi),
        }
    )
    rod = RigidBody(
        name="rod",
        mass=1.0,
        inertia=(ROD**2 / 12, ROD**2 / 12, 1e-3),
        position=(0.5 * ROD * math.sin(LEAN), 0.0, -0.5 * ROD * math.cos(LEAN)),
        orientation=(math.cos(0.5 * LEAN), 0.0, -math.sin(0.5 * LEAN), 0.0),
        velocity=(speed * math.cos(0.7), 0.0, 0.0),
    )
    hinge = Hinge(
        name="hinge",
        between=("cart", "rod"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, 1.0, 0.0),
        compliance=0.0,
        damping=h,
    )
    cart = RigidBody(name="cart", motion="kinematic", position=(0.0, 0.0, 0.0), **moved)
    result = simulate(
        Scene(bodies=(cart, rod), constraints=(hinge,), gravity=(0.0, 0.0, -G), contacts=False),
        time_step=h,
        duration=2.0,
        method=method,
        observe=traces(x=Position("rod"), open=Violation("hinge")),
    )
    times = result.sample_times["x"]
    right = [SHAKE(t) - AHEAD for t in times] + 0.5 * ROD * np.sin(rod_angle(tuple(times)))
    return float(np.abs(result["x"][:, 0] - right).max()), float(
        np.abs(result["open"][len(times) // 2 :]).max()
    )


@functools.cache
def rod_angle(times: tuple[float, ...]) -> np.ndarray:
    def slope(t: float, y: np.ndarray) -> tuple[float, float]:
        pace = 0.8 * math.pi
        push = pace**2 * SHAKE(t)  # m/s², what the hinge's acceleration leaves in its frame
        return y[1], 1.5 / ROD * (push * math.cos(y[0]) - G * math.sin(y[0]))

    solved = solve_ivp(slope, (0.0, times[-1]), (LEAN, 0.0), "DOP853", times, rtol=1e-12, atol=1e-13)
    return np.asarray(solved.y[0])


@pytest.mark.parametrize("by_path", [True, False])
@pytest.mark.parametrize("corrections", [1, 2])
@pytest.mark.parametrize("half", [False, True])
def test_corrections_keep_their_order_on_what_accelerates(
    by_path: bool, corrections: int, half: bool
) -> None:
    """Order 1, and 2 with half steps, as on what stands still. Linearised rows hold to h² of the acceleration, and each
    correction takes two orders. The path's own speed before a step and in it differ by h times that."""
    method = Method(corrections=corrections, half_step_velocities=half)
    coarse, fine = (shaken(h, method, by_path) for h in (1 / 60, 1 / 240))
    linear = shaken(1 / 60, Method(half_step_velocities=half), by_path)

    assert math.log2(coarse[0] / fine[0]) / 2.0 == pytest.approx(2.0 if half else 1.0, abs=0.1)
    assert linear[1] > 1e-4
    assert coarse[1] < linear[1] * 1e-3**corrections
    assert fine[1] < max(1e-14, coarse[1] / 4.0 ** (1.9 + 1.9 * corrections))


def test_compositions_and_settings_from_outside_do_not_follow_a_path() -> None:
    with pytest.raises(MethodError, match="the path of 'told' does not follow"):
        followed(told(path=(WAVE, 1.0, 2.0)), composition="order4")
    with (
        start(Scene(bodies=(told(path=(WAVE, 1.0, 2.0)),)), time_step=H) as run,
        pytest.raises(SceneError, match="follows the time"),
    ):
        run.set_velocity("told", velocity=(1.0, 0.0, 0.0))
