"""Where belts, turntables, vehicles and ropes must fail: each band found again without the engine."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.scalar_tests.friction import capstan, sorting, turntable
from spook_tracker.scalar_tests.mechanisms import scissor_lift
from spook_tracker.scalar_tests.ropes import taut_rope
from spook_tracker.scalar_tests.stacks import shaken_block
from spook_tracker.scalar_tests.vehicles import climb, suspension
from tests.scalar_tests.limits import band


def rolled(time_step: float) -> np.ndarray:
    """Places of the ball on the turntable by impulses: friction takes the slip at its lowest point, or what it may."""
    t = turntable
    x, v, n = np.array((*t.START, 0.0)), np.array((*t.PUSH, 0.0)), np.array((0.0, 0.0, 1.0))
    spin = np.cross(n, np.cross((0.0, 0.0, t.RATE), x) - v) * -1.0 / t.RADIUS
    places = [x]
    for _ in range(t.FEW):
        x = x + time_step * v
        slip = v - t.RADIUS * np.cross(spin, n) - np.cross((0.0, 0.0, t.RATE), x)
        impulse = -2.0 / 7.0 * t.MASS * slip
        size = float(np.linalg.norm(impulse))
        impulse *= min(1.0, time_step * t.FRICTION * t.MASS * t.GRAVITY / max(size, 1e-300))
        v = v + impulse / t.MASS
        spin = spin - t.RADIUS * np.cross(n, impulse) / (0.4 * t.MASS * t.RADIUS**2)
        places.append(x)
    return np.array(places)


def test_a_ball_rolls_on_a_turntable_until_friction_cannot_bend_its_way() -> None:
    low, high = band("turntable", "longest-step")
    for time_step, rolls in ((turntable.TIME_STEP, True), (low, True), (1.002 * high, False)):
        exact = turntable.recursion(time_step, turntable.FEW)
        found = rolled(time_step)[:, 0] + 1j * rolled(time_step)[:, 1]
        assert (float(np.abs(found - exact).max()) < 1e-6) is rolls, time_step


def test_the_shortest_waves_of_a_taut_rope_turn_by_half_a_turn_a_step() -> None:
    """Masses l/6 (2, 1; 1, 2) of rods and slopes of their ends, as matrices."""
    r = taut_rope

    def fastest(count: int) -> float:
        length, mass, inner = r.LENGTH / count, r.MASS / count, count - 1
        beside = np.eye(inner, k=1) + np.eye(inner, k=-1)
        stiffness = r.PULL / length * (2.0 * np.eye(inner) - beside)
        masses = mass / 6.0 * (4.0 * np.eye(inner) + beside)
        return math.sqrt(float(np.linalg.eigvals(np.linalg.solve(masses, stiffness)).real.max()))

    low, high = band("taut_rope", "finest")
    assert low == high
    assert r.TIME_STEP * fastest(int(high)) < 2.0 < r.TIME_STEP * fastest(int(high) + 1)


def test_a_chassis_too_light_for_its_springs_leaves_them() -> None:
    s = suspension
    corners = [(k, x, 0.5 * side * s.TRACK) for x, side, k in s.CORNERS.values()]
    stiffness = sum(k * np.outer((1.0, y, -x), (1.0, y, -x)) for k, x, y in corners)

    def grows(weight: float) -> float:
        """Largest eigenvalue of v₊ = v − h M⁻¹ K x, x₊ = x + h v₊."""
        masses = weight * np.diag((s.MASS, s.ROLLING, s.PITCHING))
        pull = -s.TIME_STEP * np.linalg.solve(masses, stiffness)
        one = np.eye(3)
        step = np.block([[one + s.TIME_STEP * pull, s.TIME_STEP * one], [pull, one]])
        return float(np.abs(np.linalg.eigvals(step)).max())

    low, high = band("suspension", "lightest")
    assert grows(high) < 1.0 + 1e-9
    assert grows(low) ** 30 > 100.0


def test_drives_stall_where_their_work_is_that_of_lifting() -> None:
    low, high = band("climb", "steepest")

    def gained(slope: float) -> float:
        """Work [J] of both drives along a metre of road, less what lifts the vehicle."""
        height = slope / math.hypot(1.0, slope)
        return 2.0 * climb.TORQUE / climb.RADIUS - climb.MASS * climb.GRAVITY * height

    assert gained(low) > 0.0 > gained(high)


def test_a_block_tips_over_its_edge_or_slides() -> None:
    """Friction at the base turns the block by µ m g times half its height, its weight holds it by half its width."""
    low, high = band("shaken_block", "smoothest")
    s = shaken_block
    assert low * s.HALF_HEIGHT <= s.HALF_WIDTH < high * s.HALF_HEIGHT
    assert high * s.GRAVITY < 1.2 * s.UPLIFT, "so that the smoothest floor that lifts an edge slides, too"


@pytest.mark.parametrize("times", [1.0, 1e3, 1e6])
def test_boxes_slow_down_alike_however_fast_they_come(times: float) -> None:
    s = sorting
    steps = np.arange(61)
    for friction in s.SORTS:
        lost = friction * s.GRAVITY * s.TIME_STEP / abs(times * s.SLIP)
        speeds = np.maximum(0.0, 1.0 - lost * steps[1:])
        way = times * s.SLIP * s.TIME_STEP * np.concatenate(((0.0,), np.cumsum(speeds)))
        found = s.ride(0.0, times * s.SLIP, friction, 0.0, s.TIME_STEP, 60)
        assert np.abs(found - way).max() < 1e-11 * np.abs(way).max()


def test_a_winch_lifts_what_its_torque_has_work_for() -> None:
    """A radian of the drum, and what the load gains in height by it."""
    low, high = band("capstan", "weakest")
    gains = capstan.LOAD * capstan.GRAVITY * capstan.DRUM
    assert 0.9999 * low < gains < high


def test_a_tall_lift_is_right_to_more_than_is_asked() -> None:
    s = scissor_lift
    assert band("scissor_lift", "tallest") == (s.TALL[-1], s.TALL[-1])
    assert s.TALL[-1] ** 2 * 2.0**-52 < 1e-9 and s.loaded(s.LOAD / s.ARM) < 1e-9
