"""Sleeping: what is at rest is left out of the steps, and back in the step that something comes to it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    ContactCount,
    ContactForce,
    ContactPoints,
    Energy,
    Hinge,
    KineticEnergy,
    Load,
    Material,
    Method,
    Momentum,
    Plane,
    Ramp,
    RigidBody,
    Sphere,
    Table,
    Trace,
    simulate,
    start,
)
from tests.scenes.corpus import solid
from tests.scenes.sleep import (
    FALLEN,
    FLOOR,
    GRAVITY,
    ROUGH,
    SLOW,
    SMOOTH,
    SOLVERS,
    TIME_STEP,
    asleep,
    box,
    heap,
    held,
    same,
    scene,
    sleepy,
    stack,
)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_heap_asleep_carries_its_weight_and_stays_to_the_last_bit(solver: str) -> None:
    built = heap()
    points = {"points": ContactPoints(200), "count": ContactCount()}
    slow = 1e-4
    method = Method(solver=solver, sleep_speed=slow)  # type: ignore[arg-type]
    run = held(built, method, FALLEN, load=ContactForce("floor"), **points)

    assert asleep(run) == 30
    before, load, there = run.state, run["load"], run["points"]
    # What falls asleep is slower than that before and after its last step: forces are off by what changes speeds so much.
    total = sum(body.mass or 0.0 for body in built.bodies)
    assert abs(-load[2] - total * GRAVITY) <= 2.0 * total * slow / TIME_STEP
    run.step(100)
    assert same(before, run.state)
    assert np.array_equal(load, run["load"])
    assert np.array_equal(there, run["points"], equal_nan=True)
    assert run["count"] == np.isfinite(there.reshape(200, 10)[:, 0]).sum()
    assert all(not value[7:].any() for value in run.state.values())
    assert run.result().counters["slept_steps"] >= 100 * 30


def test_nothing_is_different_until_a_body_sleeps() -> None:
    """Its bits are those of a run without: a ball that rolls for ever keeps its heap awake, and one alone does not."""
    rolls = solid("ball", Sphere(0.2), (9.0, 0.0, 0.2), velocity=(1.0, 0.0, 0.0), material=SMOOTH)
    built = scene(FLOOR, *stack(), rolls)
    awake, tired = (simulate(built, time_step=TIME_STEP, steps=25, method=m) for m in (Method(), sleepy()))
    assert "asleep" not in awake.counters
    assert tired.counters["asleep"] == 0  # 25 steps are less than half a second
    assert same(awake.final_state, tired.final_state)
    tired = simulate(built, time_step=TIME_STEP, steps=60, method=sleepy())
    assert tired.counters["asleep"] == 3
    assert np.allclose(tired.final_state["ball"][:3], (10.0, 0.0, 0.2), atol=1e-12)


def test_sleep_comes_after_the_time_asked_for_and_not_a_step_before() -> None:
    for after in (0.1, 0.5, 1.0):
        run = held(scene(FLOOR, *stack()), sleepy(sleep_after=after), round(after / TIME_STEP) - 1)
        assert asleep(run) == 0
        run.step()
        assert asleep(run) == 3
    run = held(scene(FLOOR, *stack()), sleepy(sleep_after=0.1, substeps=4), 5)
    assert asleep(run) == 0
    run.step()
    assert asleep(run) == 3


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_ball_dropped_onto_sleepers_does_to_them_what_it_does_without_sleep(solver: str) -> None:
    """The island it meets wakes as a whole, in the step it is met; the stack beside goes on sleeping. What they sleep with
    is speed of rounding, so that both runs are the same to rounding, times what tumbling boxes make of it, until the ball
    sleeps."""
    ball = RigidBody(name="ball", mass=3.0, shape=Sphere(0.3), position=(0.3, 0.1, 12.0), material=ROUGH)
    built = scene(FLOOR, *stack(), *stack(5.0, 2, "other"), ball)
    solved: dict[str, Any] = {"solver": solver, "iterations": 200, "residual_tolerance": 1e-13}
    tired, awake = (held(built, m, force=ContactForce("ball")) for m in (sleepy(**solved), Method(**solved)))
    seen = []
    for _ in range(105):
        tired.step()
        awake.step()
        seen.append((asleep(tired), float(np.abs(tired["force"]).max()) > 0.0))
    met = next(k for k, (_, touched) in enumerate(seen) if touched)
    assert math.isclose(
        (met + 1) * TIME_STEP, math.sqrt(2.0 * (12.0 - 3.3) / GRAVITY), abs_tol=2.0 * TIME_STEP
    )
    assert [count for count, _ in seen[met - 3 : met + 1]] == [5, 5, 5, 2]
    for name, value in awake.state.items():
        assert np.allclose(tired.state[name], value, atol=1e-8), name


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_sleeper_that_is_hit_gets_the_momentum(solver: str) -> None:
    """Plastic, without friction: both go on with m v/(m + M), whichever solver."""
    ball = solid("ball", Sphere(0.25), (-4.0, 0.0, 0.5), 0.5, (3.0, 0.0, 0.0), material=SMOOTH)
    target = box("target", 0.0, 0.5, mass=2.0, material=SMOOTH)
    run = held(scene(FLOOR, target, ball, weighs=False), sleepy(solver), 60, p=Momentum())
    assert asleep(run) == 1
    run.step(60)
    assert asleep(run) == 0
    assert np.allclose(run["p"], (1.5, 0.0, 0.0), atol=1e-14)
    assert math.isclose(run.state["target"][7], 0.6, rel_tol=1e-12)


def test_an_impact_runs_through_a_row_of_sleepers() -> None:
    """Newton's cradle, successive blows: the last leaves with all the speed, the others sleep again."""
    balls = [
        solid(f"ball {k}", Sphere(0.5), (float(k), 0.0, 0.0), material=Material(restitution=1.0))
        for k in range(4)
    ]
    first = solid(
        "first", Sphere(0.5), (-4.0, 0.0, 0.0), velocity=(2.0, 0.0, 0.0), material=Material(restitution=1.0)
    )
    run = held(scene(first, *balls, weighs=False), sleepy(impacts="successive"), 80)
    assert asleep(run) == 4
    run.step(20)
    speeds = [run.state[body.name][7] for body in (first, *balls)]
    assert np.allclose(speeds, (0.0, 0.0, 0.0, 0.0, 2.0), atol=1e-13)
    run.step(60)
    assert asleep(run) == 4


@pytest.mark.parametrize("speed", [30.0, 3000.0])
def test_nothing_flies_through_sleepers(speed: float) -> None:
    """A bullet that goes many times the thickness of a plate in a step."""
    plate = solid("plate", Box((0.02, 1.0, 1.0)), (0.0, 0.0, 0.0), material=SMOOTH)
    bullet = solid(
        "bullet", Sphere(0.01), (-speed * 1.003, 0.0, 0.0), 0.01, (speed, 0.0, 0.0), material=SMOOTH
    )
    run = held(scene(plate, bullet, weighs=False), sleepy(), 60, p=Momentum())
    assert asleep(run) == 1
    run.step(3)
    assert asleep(run) == 0
    assert run.state["bullet"][0] < run.state["plate"][0]
    assert np.allclose(run["p"], (0.01 * speed, 0.0, 0.0), rtol=1e-13, atol=1e-13 * speed)
    assert math.isclose(run.state["plate"][7], 0.01 * speed / 1.01, rel_tol=1e-9)


def table(**motion: Any) -> RigidBody:
    return RigidBody(
        name="table",
        motion="kinematic",
        shape=Box((4.0, 4.0, 1.0)),
        position=(0.0, 0.0, -0.5),
        material=ROUGH,
        **motion,
    )


def test_a_support_pulled_away_wakes_in_the_same_step() -> None:
    """It goes faster than bodies fall: what lay on it has g h after the step, all of it."""
    run = held(scene(table(), *stack()), sleepy(), 60)
    assert asleep(run) == 3
    run.set_velocity("table", velocity=(0.0, 0.0, -5.0))
    run.step()
    assert asleep(run) == 0
    for k in range(3):
        assert math.isclose(run.state[f"box {k}"][9], -GRAVITY * TIME_STEP, rel_tol=1e-12)


def test_a_support_that_follows_the_time_wakes_and_nothing_sleeps_on_what_moves() -> None:
    late = Ramp(start=1.0, end=2.0, start_value=-0.5, end_value=0.5)
    run = held(scene(table(path=(0.0, 0.0, late)), *stack()), sleepy(), 60)
    assert asleep(run) == 3
    run.step()
    assert asleep(run) == 0
    assert math.isclose(run.state["box 2"][9], 1.0, rel_tol=1e-9)
    smooth = table(velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.3))
    still = RigidBody(name="ball", mass=1.0, shape=Sphere(0.2), position=(0.0, 0.0, 0.2), material=SMOOTH)
    run = held(scene(smooth, still), sleepy(), 90)
    assert asleep(run) == 0


def test_on_a_path_that_has_come_to_its_end_bodies_sleep_again_and_a_plane_that_turns_wakes() -> None:
    """What follows a path stands still but for rounding."""
    path = Table(times=(0.0, 0.1, 0.9, 1.0), values=(-0.5, -0.5, -0.13, -0.13))
    run = held(scene(table(path=(0.0, 0.0, path)), *stack()), sleepy(), 100)
    assert asleep(run) == 3
    plate = solid("plate", Plane(), (0.0, 0.0, 0.0), None, motion="kinematic", material=ROUGH)
    run = held(scene(plate, *stack()), sleepy(), 60)
    assert asleep(run) == 3
    run.set_velocity("plate", angular_velocity=(0.0, 0.1, 0.0))
    run.step()
    assert asleep(run) == 0


def test_a_kinematic_body_that_comes_along_wakes() -> None:
    pusher = solid(
        "pusher",
        Box((0.2, 1.0, 0.5)),
        (-3.0, 0.0, 0.5),
        None,
        (2.0, 0.0, 0.0),
        motion="kinematic",
        material=SMOOTH,
    )
    target = box("target", 0.0, 0.5, material=SMOOTH)
    run = held(scene(FLOOR, target, pusher), sleepy(), 60)
    assert asleep(run) == 1
    run.step(30)
    assert asleep(run) == 0
    assert math.isclose(run.state["target"][7], 2.0, rel_tol=1e-9)


@pytest.mark.parametrize("impacts", ["simultaneous", "successive"])
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_sleeper_beside_what_bounces_has_no_speed_and_wakes_with_none(solver: str, impacts: str) -> None:
    """Half of a step's forces went to sleepers in each step in which others touched: a box flew up when it woke."""
    bouncy = Material(friction=0.5, restitution=0.9)
    ball = RigidBody(name="ball", mass=1.0, shape=Sphere(0.2), position=(5.0, 0.0, 3.0), material=bouncy)
    still = box("still", 0.0, 0.5, material=bouncy)
    push = Load(name="push", body="still")
    run = start(
        scene(FLOOR, still, ball, forces=(push,)),
        time_step=TIME_STEP,
        method=sleepy(solver, impacts=impacts),
        observe={"energy": Energy()},
    )
    run.step(60)
    assert asleep(run) == 1
    fell = float(run["energy"])
    run.step(60)
    assert asleep(run) == 1
    assert float(run["energy"]) < fell + 1e-9
    np.testing.assert_array_equal(run.state["still"][7:], 0.0)
    run.set_load("push", force=(0.0, 0.0, -1.0))
    run.step(10)
    np.testing.assert_allclose(run.state["still"][:3], (0.0, 0.0, 0.5), rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(run.state["still"][7:], 0.0, rtol=0.0, atol=1e-9)


def test_a_creeping_slide_above_the_speed_never_sleeps_and_one_below_does() -> None:
    for speed, sleeps in ((1.01 * SLOW, False), (0.99 * SLOW, True)):
        slider = box("slider", 0.0, 0.5, velocity=(speed, 0.0, 0.0), material=SMOOTH)
        run = held(scene(FLOOR, slider), sleepy(), 300)
        assert asleep(run) == sleeps
        way = speed * (0.5 if sleeps else 5.0)
        assert math.isclose(run.state["slider"][0], way, rel_tol=1e-12)


def test_a_slow_turn_counts_at_the_surface() -> None:
    """|v| + |w| r, r the half diagonal of a cube of 1 m."""
    for factor, sleeps in ((1.01, False), (0.99, True)):
        spin = factor * SLOW / (0.5 * math.sqrt(3.0))
        turns = box("turns", 0.0, 5.0, angular_velocity=(0.0, 0.0, spin))
        run = held(scene(FLOOR, turns, weighs=False), sleepy(), 40)
        assert asleep(run) == sleeps


def test_a_pendulum_at_its_turning_point_does_not_sleep() -> None:
    """Beside a floor, so that a body may sleep at all: to the bits of a run without."""
    bob = box("bob", 1.0, 5.0)
    post = Hinge(name="post", between=(WORLD, "bob"), at=(0.0, 0.0, 5.0), axis=(0.0, 1.0, 0.0))
    built = scene(FLOOR, bob, constraints=(post,))
    awake, tired = (
        simulate(
            built, time_step=TIME_STEP, steps=600, method=m, observe={"e": Trace(quantity=KineticEnergy())}
        )
        for m in (Method(), sleepy())
    )
    assert min(awake["e"][1:]) < 0.5 * SLOW**2  # it is slower for a moment
    assert same(awake.final_state, tired.final_state)
    assert tired.counters["slept_steps"] == 0
