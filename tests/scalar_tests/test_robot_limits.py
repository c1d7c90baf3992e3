"""Robots and mechanisms that touch something: what their limits and bands come from, without the engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.scalar_tests import box_push, latch
from tests.scalar_tests.limits import band, measurement

TINY = 1e-4  # s, between the places of a motion that differences are taken of


def limits(test: str, configuration: str) -> dict[str, Any]:
    return {metric.name: metric.limit for metric in measurement(test, configuration).metrics}


def links(shoulder: float, elbow: float) -> Any:
    """Middles of both links and the hand (x, z), both angles those of the drives about y."""
    b = box_push
    first = b.BENT - shoulder
    second = first - (2.0 * b.BENT + elbow)
    along, over = (b.LENGTH * np.array((math.cos(a), math.sin(a))) for a in (first, second))
    return np.array((0.5 * along, along + 0.5 * over, along + over))


def test_an_arm_that_pushes_gives_by_virtual_work_what_it_is_held_to() -> None:
    """Of all forces and inertias in a small turn of each drive; of the links as of the box places alone are known."""
    b = box_push
    for time in (0.0, 0.5, 1.0):
        drives = [np.array((b.RATE, -2.0 * b.RATE)) * (time + step * TINY) for step in (-1.0, 0.0, 1.0)]
        (before, now, after), here = (np.array([links(*q) for q in drives]), drives[1])
        place, push, torques = b.pushed(time)
        assert now[2] == pytest.approx((place - b.RADIUS - 0.5 * b.EDGE, 0.0), abs=1e-12)
        gain = (before - 2.0 * now + after) / TINY**2
        assert push == pytest.approx(b.MASS * (b.FRICTION * b.GRAVITY + gain[2, 0]), rel=1e-6)
        forces = -np.array((b.UPPER, b.LOWER))[:, None] * (gain[:2] + np.array((0.0, b.GRAVITY)))
        forces = np.vstack((forces, (-push, 0.0)))
        for torque, turn in zip(torques, TINY * np.eye(2), strict=True):
            moved = (links(*(here + turn)) - links(*(here - turn))) / (2.0 * TINY)
            assert torque + float((forces * moved).sum()) == pytest.approx(0.0, abs=1e-5)


def test_box_push_is_late_by_two_steps_and_its_hand_by_what_damped_rows_let_through() -> None:
    b, found = box_push, limits("box_push", "plain")
    h = b.TIME_STEP
    times = np.linspace(0.0, b.DURATION, 101)
    _, push, torques = b.pushed(times)
    _, earlier, before = b.pushed(times - 2.0 * h)
    assert found["torque_error"] == pytest.approx(
        np.abs(torques - before).max() / np.abs(torques).max(), rel=1e-3
    )
    assert found["push_error"] == pytest.approx(np.abs(earlier / push - 1.0).max(), rel=1e-3)
    standing = speed = 0.0
    for _ in range(100):  # a row of damping 2 h whose point gains that speed in every step
        speed = speed / 9.0 - 4.0 * standing / (9.0 * h)
        standing += h * speed + b.LENGTH * (b.RATE * h) ** 2
        speed += 2.0 * b.LENGTH * b.RATE**2 * h
    assert found["place_error"] == pytest.approx(standing, rel=1e-6)


def test_a_pushed_box_topples_where_its_front_edge_bears_it_all() -> None:
    b = box_push
    low, high = band("box_push", "highest")
    for height, flat in (
        (low, True),
        (high, False),
    ):  # rear and front edge over the weight, of forces and moments
        moment = b.FRICTION * height
        rear, front = np.linalg.solve([[1.0, 1.0], [-0.5 * b.EDGE, 0.5 * b.EDGE]], [1.0, moment])
        assert front > 0.0 and (rear > 0.0) == flat
    assert (2.0 * b.LENGTH * b.SLOW**2) / b.GRAVITY < 2e-5, "the push is slow"


def test_the_weakest_elbow_works_as_hard_as_floor_and_weight_take() -> None:
    """In a small turn of both drives: the shoulder's work is that of both links about it."""
    b, a = box_push, box_push.BENT
    low, high = band("box_push", "weakest")
    turn = TINY * np.array((1.0, -2.0))
    moved = (links(*turn) - links(*-turn)) / (2.0 * TINY)
    taken = float(np.array((b.UPPER, b.LOWER)) @ moved[:2, 1]) * b.GRAVITY
    taken += b.FRICTION * b.MASS * b.GRAVITY * moved[2, 0]
    shoulder = -(0.5 * b.UPPER + 1.5 * b.LOWER) * b.GRAVITY * b.LENGTH * math.cos(a)
    elbow = (taken - shoulder) / -2.0
    needed = b.LENGTH * (0.5 * b.LOWER * math.cos(a) + b.MASS * b.FRICTION * math.sin(a)) * b.GRAVITY
    assert low < -elbow / needed < high


@pytest.mark.parametrize(("study", "friction"), [("hardest", 0.0), ("hardest-rough", latch.FRICTION)])
def test_a_latch_opens_where_bolt_and_door_are_no_longer_in_balance(study: str, friction: float) -> None:
    """Unknown are the strike's force, and the force and the moment between door and bolt."""
    q = latch
    c, s = math.cos(q.BEVEL), math.sin(q.BEVEL)
    across, along = (
        np.array((-c, -s)),
        friction * np.array((s, -c)),
    )  # the strike's force, for a normal one of 1
    lever = -q.RADIUS * (across[0] * along[1] - across[1] * along[0])
    rows = [[*(across + along), lever], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    force, side, moment = np.linalg.solve(np.transpose(rows), [-q.STIFFNESS * q.PRESSED, 0.0, 0.0])
    assert force > 0.0
    low, high = band("latch", study)
    assert low < (q.WIDTH * side + moment) / q.opens(friction) < high
    turned, rate = q.opened(1.0 + 1e-4, 0.2)
    assert turned > q.LEAST and rate > 0.0, "what is a little too hard opens it"


def test_a_nose_goes_back_as_the_door_gains_energy() -> None:
    """And the latch leads by no more than half a step, by steps of its one coordinate."""
    q, share = latch, latch.PUSHED
    turned, rate = q.opened(share, q.OPENING)
    reach, slope, bend = q.nose(turned)
    assert slope == pytest.approx((q.nose(turned + TINY)[0] - q.nose(turned - TINY)[0]) / (2.0 * TINY))
    assert bend == pytest.approx((q.nose(turned + TINY)[1] - q.nose(turned - TINY)[1]) / (2.0 * TINY))
    door = q.DOOR * ((q.WIDTH - 0.06) ** 2 + q.THICKNESS**2) / 12.0 + q.DOOR * (0.5 * q.WIDTH) ** 2
    moving = door + 0.4 * q.BOLT * q.RADIUS**2 + q.BOLT * (reach**2 + slope**2)
    spring = 0.5 * q.STIFFNESS * ((q.PRESSED + q.WIDTH - reach) ** 2 - q.PRESSED**2)
    assert 0.5 * moving * rate**2 == pytest.approx(share * q.opens() * turned - spring, rel=1e-6)
    h, angle, speed = q.TIME_STEP, 0.0, 0.0
    for _ in range(round(q.OPENING / h)):
        speed += h * q.gained(angle, speed, share)
        angle += h * speed
    limit = limits("latch", "let go")["opening_error"]
    assert limit == pytest.approx(0.5 * h * rate) and 0.5 * limit < angle - turned < 1.2 * limit
