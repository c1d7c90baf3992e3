"""Sleeping with joints, springs and loads: what falls asleep together, and what wakes them that is no contact."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Ball,
    ConstraintForce,
    ContactForce,
    Distance,
    Fluid,
    Hinge,
    Load,
    Lock,
    Method,
    Motor,
    RigidBody,
    Scene,
    Sinusoid,
    Sphere,
    Spring,
    simulate,
)
from tests.scenes.sleep import (
    FLOOR,
    GRAVITY,
    ROUGH,
    SLOW,
    SMOOTH,
    SOLVERS,
    TIME_STEP,
    asleep,
    box,
    held,
    same,
    scene,
    sleepy,
    stack,
    wakes_as_a_whole,
)


def chain(**options: Any) -> Scene:
    """Three boxes on the floor, hinged in a row; the last may carry a motor."""
    bodies = [box(f"box {k}", 1.5 * k, 0.5) for k in range(3)]
    joints = (
        Hinge(name="first", between=("box 0", "box 1"), at=(0.75, 0.0, 0.5)),
        Hinge(name="second", between=("box 1", "box 2"), at=(2.25, 0.0, 0.5), **options),
    )
    push = Load(name="push", body="box 0")
    return scene(FLOOR, *bodies, constraints=joints, forces=(push,))


@pytest.mark.parametrize("solver", SOLVERS)
def test_joints_make_islands_and_what_drives_them_wakes(solver: str) -> None:
    motor = Motor(speed=0.0, max_force=50.0)
    run = held(chain(motor=motor), sleepy(solver), 60, wrench=ContactForce("floor"))
    assert asleep(run) == 3
    load = run["wrench"]
    run.set_motor("second", speed=0.0)  # what it does anyway
    run.step()
    assert asleep(run) == 3
    assert np.array_equal(load, run["wrench"])
    run.set_motor("second", speed=1.0)
    run.step()
    assert asleep(run) == 0
    turns = run.state["box 2"][12] - run.state["box 1"][12]
    assert abs(turns) > 0.1
    if solver == "iterative":  # which slide it finds of boxes on four points each depends on where it starts
        return
    awake = held(chain(motor=motor), Method(solver=solver), 61)  # type: ignore[arg-type]
    awake.set_motor("second", speed=1.0)
    awake.step()
    for name, value in awake.state.items():
        assert np.allclose(run.state[name], value, atol=1e-6), name


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_load_that_is_set_wakes_in_the_same_step(solver: str) -> None:
    sled = box("sled", 0.0, 0.5, mass=2.0, material=SMOOTH)
    built = scene(FLOOR, sled, forces=(Load(name="push", body="sled"),))
    run = held(built, sleepy(solver), 60)
    run.set_load("push", force=(0.0, 0.0, 0.0))
    run.step()
    assert asleep(run) == 1
    run.set_load("push", force=(3.0, 0.0, 0.0))
    run.step()
    assert asleep(run) == 0
    assert math.isclose(run.state["sled"][7], 3.0 / 2.0 * TIME_STEP, rel_tol=1e-12)


def test_where_bodies_went_before_a_run_is_restored_does_not_keep_them_awake() -> None:
    """Woken by next to nothing it sleeps again after so many steps, whatever was in between."""
    sled = box("sled", 0.0, 0.5, material=SMOOTH)
    run = held(scene(FLOOR, sled, forces=(Load(name="push", body="sled"),)), sleepy(), 60)
    saved = run.save()
    steps = []
    for _ in range(2):
        run.set_load("push", force=(1e-9, 0.0, 0.0))
        run.step()
        assert asleep(run) == 0
        while not asleep(run):
            run.step()
        steps.append(run.steps - saved.native.steps)
        run.restore(saved)
        run.set_load("push", force=(50.0, 0.0, 0.0))
        run.step(30)
        run.restore(saved)

    assert steps == [30, 30]


def test_a_load_so_light_that_it_gives_little_speed_in_a_step_is_not_slept_over() -> None:
    """.1 m/s²: .0017 m/s a step, and .05 m/s in the time before sleep."""
    sled = box("sled", 0.0, 0.5, material=SMOOTH)
    run = held(scene(FLOOR, sled, forces=(Load(name="push", body="sled"),)), sleepy(), 60)
    run.set_load("push", force=(0.1, 0.0, 0.0))
    run.step(60)
    assert math.isclose(run.state["sled"][7], 0.1, rel_tol=1e-9)


def test_a_joint_that_breaks_leaves_no_body_asleep() -> None:
    """A box hangs on a breakable lock, asleep with another: the load that breaks the lock wakes it, and it falls."""
    hangs = box("hangs", 0.0, 5.0)
    holds = Lock(name="holds", between=(WORLD, "hangs"), at=(0.0, 0.0, 6.0), strength=30.0)
    built = scene(FLOOR, hangs, constraints=(holds,), forces=(Load(name="push", body="hangs"),))
    run = held(built, sleepy(), 60)
    assert asleep(run) == 1
    run.set_load("push", force=(0.0, 0.0, -50.0))
    run.step()
    assert [at.joint for at in run.result().broken] == ["holds"]
    assert asleep(run) == 0
    run.set_load("push", force=(0.0, 0.0, 0.0))
    before = run.state["hangs"][9]
    run.step(30)
    assert math.isclose(run.state["hangs"][9], before - 30.0 * GRAVITY * TIME_STEP, rel_tol=1e-12)


@pytest.mark.parametrize("solver", SOLVERS)
def test_forces_of_joints_are_read_while_others_are_awake(solver: str) -> None:
    """A box hangs, asleep, on a lock: its weight; a ball rolls by, and then drops onto another one on the floor."""
    hangs = box("hangs", 0.0, 5.0)
    holds = Lock(name="holds", between=(WORLD, "hangs"), at=(0.0, 0.0, 6.0))
    drops = RigidBody(name="drops", mass=1.0, shape=Sphere(0.3), position=(20.0, 0.0, 9.0), material=ROUGH)
    built = scene(FLOOR, hangs, box("lies", 20.0, 0.5), drops, constraints=(holds,))
    run = held(built, sleepy(solver), 40, pull=ConstraintForce("holds"))
    assert asleep(run) == 2
    pull = run["pull"]
    assert np.allclose(pull[:3], (0.0, 0.0, GRAVITY), atol=2.0 * SLOW / TIME_STEP)
    for _ in range(60):
        run.step()
        assert np.array_equal(pull, run["pull"])
    assert asleep(run) == 1
    run.step(120)
    assert asleep(run) == 3


def test_springs_and_distances_tie_sleepers() -> None:
    """The one that is hit wakes the other, far away, in the same step."""
    ties: tuple[dict[str, Any], ...] = (
        {"forces": (Spring(name="tie", between=("a", "b"), stiffness=10.0, rest_length=4.0),)},
        {"constraints": (Distance(name="tie", between=("a", "b")),)},
    )
    for tie in ties:
        a, b = box("a", 0.0, 0.5), box("b", 4.0, 0.5)
        ball = RigidBody(
            name="ball", mass=1.0, shape=Sphere(0.2), position=(-4.0, 0.0, 0.5), velocity=(4.0, 0.0, 0.0)
        )
        built = Scene(bodies=(a, b, ball), **tie)
        assert wakes_as_a_whole(held(built, sleepy(), 40), 2, 60)


def test_what_follows_the_time_or_floats_stays_awake() -> None:
    wave = Load(
        name="wave", body="box 0", force=(1e-9, 0.0, 0.0), factor=Sinusoid(amplitude=1.0, frequency=1.0)
    )
    run = held(scene(FLOOR, *stack(count=1), *stack(5.0, 1, "other"), forces=(wave,)), sleepy(), 60)
    assert asleep(run) == 1
    water = Fluid(name="water", density=1.0, level=0.1)
    run = held(scene(FLOOR, *stack(), forces=(water,)), sleepy(), 60)
    assert asleep(run) == 0
    follows = Motor(speed=Sinusoid(amplitude=1e-9, frequency=1.0), max_force=1.0)
    run = held(chain(motor=follows), sleepy(), 60)
    assert asleep(run) == 0


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_saved_run_goes_on_with_the_same_bits_asleep_or_not(solver: str) -> None:
    """Saved asleep, struck and set since; restored, it sleeps as if nothing had been, and so does another run."""
    ball = RigidBody(name="ball", mass=3.0, shape=Sphere(0.3), position=(0.3, 0.1, 12.0), material=ROUGH)
    built = scene(FLOOR, *stack(), ball, forces=(Load(name="push", body="box 1"),))
    run = held(built, sleepy(solver), 60)
    saved = run.save()
    assert asleep(run) == 3
    run.step(60)
    end, counters = run.state, run.result().counters
    run.set_load("push", force=(9.0, 0.0, 0.0))
    run.step(5)
    run.restore(saved)
    assert asleep(run) == 3
    run.step(60)
    assert same(end, run.state)
    assert {k: run.result().counters[k] for k in ("asleep", "slept_steps")} == {
        k: counters[k] for k in ("asleep", "slept_steps")
    }
    other = held(built, sleepy(solver))
    other.restore(saved)
    other.step(60)
    assert same(end, other.state)
    assert same(end, simulate(built, time_step=TIME_STEP, steps=120, method=sleepy(solver)).final_state)


def test_a_jointed_island_that_is_hit_does_what_it_does_without_sleep() -> None:
    """Two boxes on a ball joint, one of them on the floor, hit from above."""
    ball = RigidBody(name="ball", mass=1.0, shape=Sphere(0.3), position=(1.6, 0.0, 12.0), material=ROUGH)
    joint = Ball(name="joint", between=("a", "b"), at=(0.75, 0.0, 0.5))
    built = scene(FLOOR, box("a", 0.0, 0.5), box("b", 1.5, 0.5), ball, constraints=(joint,))
    tired, awake = (held(built, m) for m in (sleepy(), Method()))
    tired.step(60)
    assert asleep(tired) == 2
    tired.step(40)
    awake.step(100)
    for name, value in awake.state.items():
        assert np.allclose(tired.state[name], value, atol=1e-6), name
    assert asleep(tired) == 0
