"""What is left of a rolling coin's errors after extrapolation: by an integration in steps that knows nothing of the engine."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from spook_tracker.scalar_tests.rotation import rolling_coin
from tests.scalar_tests.limits import measurement

MASS, RADIUS, THICKNESS = rolling_coin.MASS, rolling_coin.RADIUS, rolling_coin.THICKNESS
ALONG = 0.5 * MASS * RADIUS**2  # kg m², about the axis
ACROSS = MASS * (3.0 * RADIUS**2 + THICKNESS**2) / 12.0
UP = np.array((0.0, 0.0, 1.0))
NAMES = ("lean_error", "rate_error", "centre_error", "energy_error")


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """NumPy's own takes ten times as long for one pair."""
    (x, y, z), (u, v, w) = a, b
    return np.array((y * w - z * v, z * u - x * w, x * v - y * u))


def rate(axis: np.ndarray, momentum: np.ndarray) -> np.ndarray:
    """The angular velocity of a coin with that axis and angular momentum."""
    return momentum / ACROSS + axis * (axis @ momentum) * (1.0 / ALONG - 1.0 / ACROSS)


def turned(by: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Rodrigues' formula; its length is kept to rounding."""
    angle = math.sqrt(by @ by)
    k = by / angle
    found = axis * math.cos(angle) + cross(k, axis) * math.sin(angle)
    found += k * (k @ axis) * (1.0 - math.cos(angle))
    return np.asarray(found / math.sqrt(found @ found))


def lowest(axis: np.ndarray) -> np.ndarray:
    """From the centre to the point of the rim that touches."""
    down = axis * axis[2] - UP
    return np.asarray(RADIUS * down / math.sqrt(down @ down) - 0.5 * THICKNESS * axis)


@functools.cache
def stepped(motion: rolling_coin.Steady, steps: int) -> np.ndarray:
    """One turn by the simplest law of first order: each step rolls about the point that touched at its start (which may
    close a gap, and pulls as well as pushes), turns freely by the midpoint rule, and is put back on the floor by the
    shortest way as masses measure it. Errors as in the question."""
    h = 2.0 * math.pi / motion.rate / steps
    c, s = math.cos(motion.lean), math.sin(motion.lean)
    axis, place = np.array((s, 0.0, c)), np.array((motion.circle, 0.0, motion.height))
    speed = np.array((0.0, motion.rate * motion.circle, 0.0))
    momentum = ACROSS * motion.rate * (UP - c * axis) + ALONG * (motion.spin + motion.rate * c) * axis

    def energy() -> float:
        turning = 0.5 * float(rate(axis, momentum) @ momentum)
        return 0.5 * MASS * float(speed @ speed) + turning + MASS * rolling_coin.GRAVITY * float(place[2])

    start, angles = energy(), [0.0]
    for _ in range(steps):
        arm = lowest(axis)
        answers = [push / MASS + cross(rate(axis, cross(arm, push)), arm) for push in np.eye(3)]
        free = speed - rolling_coin.GRAVITY * h * UP
        slip = free + cross(rate(axis, momentum), arm)
        gap = max(0.0, float(place[2] + arm[2]))
        push = np.linalg.solve(np.transpose(answers), -gap / h * UP - slip)
        speed, momentum = free + push / MASS, momentum + cross(arm, push)
        place = place + h * speed
        w = rate(axis, momentum)
        for _ in range(4):
            w = rate(turned(0.5 * h * w, axis), momentum)
        axis = turned(h * w, axis)
        for _ in range(3):
            arm = lowest(axis)
            lever = cross(arm, UP)
            lift = -min(0.0, float(place[2] + arm[2])) / (1.0 / MASS + lever @ rate(axis, lever))
            place = place + lift / MASS * UP
            axis = turned(lift * rate(axis, lever), axis) if lift > 0.0 else axis
        angles.append(math.atan2(axis[1], axis[0]))
    return np.array(
        (
            math.acos(axis[2]) - motion.lean,
            float(np.unwrap(angles)[-1]) / (2.0 * math.pi) - 1.0,
            math.hypot(place[0], place[1]) - motion.circle,
            (energy() - start) / (MASS * rolling_coin.GRAVITY * motion.height),
        )
    )


@pytest.mark.parametrize("name", ["coin", "disk"])
def test_a_coin_in_steps_is_left_with_the_square_of_its_own_turn(name: str) -> None:
    """rolling_coin: errors are of first order in the step, and what extrapolation leaves is of second; the largest of the
    four, over its limit, is no less than a fifth."""
    motion = {"coin": rolling_coin.COIN, "disk": rolling_coin.DISK}[name]
    coarse, middle, fine = (stepped(motion, n * rolling_coin.STEPS_A_TURN // 2) for n in (1, 2, 4))
    more, left = 2.0 * middle - coarse, 2.0 * fine - middle
    by_name = {metric.name: metric.limit for metric in measurement("rolling_coin", name).metrics}
    limits = np.array([by_name[metric] for metric in NAMES])
    own_turn = motion.spin * 2.0 * math.pi / motion.rate / rolling_coin.STEPS_A_TURN
    reach = np.array((1.0, 1.0, motion.circle + RADIUS, 1.0))

    np.testing.assert_allclose(limits, own_turn**2 * reach)
    assert np.abs(middle).max() > abs(own_turn) / 5.0  # first order: nothing to be green with
    np.testing.assert_array_less(np.abs(left), limits)
    assert np.abs(left / limits).max() > 0.2
    assert (more / left).min() > 3.5  # where first order would be left it were 2
