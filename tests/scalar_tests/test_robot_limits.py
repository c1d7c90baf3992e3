"""Robots and mechanisms that touch something: what their limits and bands come from, without the engine."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.scalar_tests.friction import coin_field
from spook_tracker.scalar_tests.mechanisms import latch
from spook_tracker.scalar_tests.robots import box_push, humanoid, quadruped
from spook_tracker.scalar_tests.standing import GRAVITY, Robot
from spook_tracker.scalar_tests.vehicles import rover
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


ROBOTS = {"quadruped": quadruped.robot(), "humanoid": humanoid.robot()}


def gone(robot: Robot, joint: Any, turn: float) -> float:
    """Work [J] of all weights and loads of feet where one joint has turned [rad]: bodies beyond it go round its axis."""
    beyond, at, axis = robot.beyond(joint), np.array(joint.at), np.array(joint.axis)

    def moved(place: Any) -> Any:
        arm = np.array(place) - at
        level = axis * (axis @ arm)
        return level + math.cos(turn) * (arm - level) + math.sin(turn) * np.cross(axis, arm) - arm

    lifted = (-GRAVITY * body.mass * moved(body.position)[2] for body in robot.bodies if body.name in beyond)
    pushed = (moved(place) @ np.array(force) for foot, (place, force) in robot.feet.items() if foot in beyond)
    return float(sum(lifted) + sum(pushed))


@pytest.mark.parametrize("name", ROBOTS)
def test_joints_of_what_stands_carry_the_work_of_weights_and_feet(name: str) -> None:
    robot = ROBOTS[name]
    for joint in robot.joints:
        work = (gone(robot, joint, TINY) - gone(robot, joint, -TINY)) / (2.0 * TINY)
        assert robot.torques()[joint.name] == pytest.approx(-work, abs=1e-6)
    assert band(name, "weakest")[0] < 1.0 < band(name, "weakest")[1]


@pytest.mark.parametrize(("name", "moments"), [("quadruped", False), ("humanoid", True)])
def test_feet_bear_the_weight_and_nothing_else_can_be(name: str, moments: bool) -> None:
    """Forces and moments of the whole balance; and no loads of the feet, with moments of flat ones, leave every joint's torque
    and that balance as they are."""
    robot, weights = ROBOTS[name], np.zeros(6)
    for body in robot.bodies:
        pull = np.array((0.0, 0.0, -GRAVITY * (body.mass or 0.0)))
        weights += np.concatenate((pull, np.cross(body.position, pull)))
    for place, force in robot.feet.values():
        weights += np.concatenate((force, np.cross(place, force)))
    np.testing.assert_allclose(weights, 0.0, atol=1e-9)
    columns = []
    for foot, (place, _) in robot.feet.items():
        chain = [(joint, joint.name) for joint in robot.joints if foot in robot.beyond(joint)]
        for unit in np.eye(3):
            for load, turn in ((unit, 0.0 * unit), (0.0 * unit, unit))[: 2 if moments else 1]:
                of = {
                    name: np.cross(place - np.array(j.at), load) @ j.axis + turn @ j.axis for j, name in chain
                }
                whole = np.concatenate((load, np.cross(place, load) + turn))
                columns.append([*whole, *(of.get(joint.name, 0.0) for joint in robot.joints)])
    values = np.linalg.svd(np.array(columns), compute_uv=False)
    assert len(values) == 12 and values.min() > 1e-3 * values.max()


@pytest.mark.parametrize("name", ROBOTS)
def test_a_pose_of_balance_is_one_at_any_step(name: str) -> None:
    """A step's impulses are h times forces that cancel: nothing gains speed, springs stay as long as they are."""
    module = {"quadruped": quadruped, "humanoid": humanoid}[name]
    assert band(name, "longest-step") == (module.LONGEST, module.LONGEST)
    robot = ROBOTS[name]
    springs = {joint.name: joint.spring for joint in module.scene().constraints}
    for joint, torque in robot.torques().items():
        assert springs[joint].stiffness * springs[joint].rest == pytest.approx(torque, abs=1e-12)


def test_six_wheels_slip_and_climb_where_coulomb_and_work_say() -> None:
    v = rover
    low, high = band("rover", "steepest")
    assert low < v.FRICTION < high
    assert v.TORQUE > v.FRICTION * v.WEIGHT * v.RADIUS, "a wheel that bears all spins"
    reached = v.SPEED * (v.LEVEL - 0.5 * v.SPEED / (v.FRICTION * v.GRAVITY))
    edge = math.sqrt(v.RADIUS**2 - (v.RADIUS - v.STEP) ** 2)
    assert reached < v.FIRST - v.AXLES["front"] - edge, "no wheel has met a step"
    low, high = band("rover", "weakest")
    lifted = v.WEIGHT * v.HILL / math.hypot(1.0, v.HILL)  # J a metre of road
    assert low * 6.0 / v.RADIUS < lifted < high * 6.0 / v.RADIUS
    places = np.array([(v.CHASSIS + 6.0 * v.WHEEL, 0.0), (v.LOAD, v.AHEAD)])
    assert pytest.approx(places[:, 0] @ places[:, 1] / places[:, 0].sum()) == v.CENTRE


@pytest.mark.parametrize("slope", [0.0, coin_field.SLOPE])
def test_a_coin_loses_in_a_metre_what_rolling_friction_takes(slope: float) -> None:
    """Energy of way and spin against the weight's work and ρ N times the angle; and where it stands these are equal."""
    c = coin_field
    tilt = math.atan(slope)
    work = c.MASS * c.GRAVITY * (math.sin(tilt) - c.ROLLING / c.RADIUS * math.cos(tilt))  # J a metre
    inertia = 0.5 * c.MASS * c.RADIUS**2
    gain = 0.5 * (c.MASS + inertia / c.RADIUS**2)  # of the square of its speed
    assert 2.0 * c.acceleration(slope) == pytest.approx(work / gain, rel=1e-12)
    low, high = band("coin_field", "slope")
    assert c.acceleration(low) < 0.0 < c.acceleration(high)


@pytest.mark.parametrize("time_step", [1.0 / 60.0, coin_field.LONGEST])
def test_a_coin_is_slowed_alike_in_steps_of_any_length(time_step: float) -> None:
    """Three steps of its spin and way: friction keeps it rolling, rolling friction takes what there is and no more."""
    c = coin_field
    assert band("coin_field", "longest-step")[1] == c.LONGEST
    speed = c.SPEED
    for k in range(3):
        taken = min(time_step * c.ROLLING * c.MASS * c.GRAVITY, 1.5 * c.MASS * speed * c.RADIUS)
        speed -= taken / (1.5 * c.MASS * c.RADIUS)
        assert speed == pytest.approx(c.gone(0.0, np.array((k + 1.0) * time_step)), abs=1e-12)
