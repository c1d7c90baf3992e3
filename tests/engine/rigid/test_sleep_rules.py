"""Sleeping, rule by rule: what counts as at rest, what is connected, and what wakes what."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    ConstraintForce,
    ContactForce,
    Distance,
    Hinge,
    JointSpring,
    Load,
    Lock,
    Material,
    Method,
    Motor,
    Plane,
    Position,
    Prismatic,
    Ramp,
    RigidBody,
    Scene,
    Sinusoid,
    Sphere,
    Spring,
    Trace,
    Velocity,
    Wire,
    simulate,
)
from tests.scenes.corpus import solid
from tests.scenes.sleep import (
    FLOOR,
    GRAVITY,
    ROUGH,
    SMOOTH,
    SOLVERS,
    TIME_STEP,
    asleep,
    box,
    held,
    scene,
    sleepy,
    stack,
    wakes_as_a_whole,
)

AT_ONCE = {"sleep_after": TIME_STEP}  # one step at rest is enough: what moves in it must be seen in it


def still(name: str, x: float, z: float, **options: Any) -> RigidBody:
    return RigidBody(name=name, motion="static", shape=Box((1.0, 1.0, 1.0)), position=(x, 0.0, z), **options)


def told(name: str, x: float, z: float, **options: Any) -> RigidBody:
    options = {"shape": Box((0.2, 0.2, 0.2)), **options}
    return RigidBody(name=name, motion="kinematic", position=(x, 0.0, z), **options)


# --- what is at rest ----------------------------------------------------------------------------------------


def test_what_loses_its_hold_in_a_step_does_not_fall_asleep_in_it() -> None:
    """It stood still in the very step that broke the lock it hung on: asleep it would hang there for ever."""
    holds = Lock(name="holds", between=(WORLD, "hangs"), at=(0.0, 0.0, 6.0), strength=5.0)
    built = scene(FLOOR, box("hangs", 0.0, 5.0), constraints=(holds,))
    run = held(built, sleepy(**AT_ONCE), 1)
    assert [at.joint for at in run.result().broken] == ["holds"]
    run.step(30)
    assert math.isclose(run.state["hangs"][9], -30.0 * GRAVITY * TIME_STEP, rel_tol=1e-5)


def test_what_is_separated_from_what_it_overlaps_is_not_at_rest() -> None:
    """It goes without a velocity: a box from the floor, and a bar that two blocks turn about its middle."""
    run = held(scene(FLOOR, box("sunk", 0.0, 0.4)), sleepy(**AT_ONCE))
    while not asleep(run):
        before = run.state["sunk"][2]
        run.step()
        assert run.steps < 200
    assert run.state["sunk"][2] == pytest.approx(before, abs=0.02 * TIME_STEP)
    assert run.state["sunk"][2] == pytest.approx(0.5, abs=0.01)

    bar = RigidBody(name="bar", mass=1.0, shape=Box((3.0, 0.2, 0.2)), position=(0.0, 0.0, 0.0))
    built = scene(still("low", -1.5, -0.55), still("high", 1.5, 0.55), bar, weighs=False)
    run = held(built, sleepy(**AT_ONCE))
    turned = [1.0]
    while not asleep(run):
        run.step()
        turned.append(run.state["bar"][3])
        assert run.steps < 200
    assert np.allclose(run.state["bar"][:3], 0.0, atol=0.01)
    assert run.steps > 2
    assert abs(math.acos(turned[-1]) - math.acos(turned[-2])) < 0.02 * TIME_STEP


def test_what_comes_back_to_where_it_was_within_a_step_is_not_at_rest() -> None:
    """A ball that meets a wall in the middle of a step."""
    elastic = Material(restitution=1.0)
    ball = solid(
        "ball", Sphere(0.2), (-0.7 - 1.5 * TIME_STEP, 0.0, 0.0), velocity=(1.0, 0.0, 0.0), material=elastic
    )
    run = held(scene(still("wall", 0.0, 0.0, material=elastic), ball, weighs=False), sleepy(**AT_ONCE))
    for _ in range(6):
        before = run.state["ball"][0]
        run.step()
        assert asleep(run) == 0
        if run.steps == 2:
            assert abs(run.state["ball"][0] - before) < 1e-9
    assert math.isclose(run.state["ball"][7], -1.0, rel_tol=1e-12)


@pytest.mark.parametrize("belt_first", [True, False])
def test_no_body_sleeps_on_a_surface_that_moves_along_itself(belt_first: bool) -> None:
    """Though it stands still against a post."""
    belt = still("belt", 0.0, -0.5, material=ROUGH, surface_velocity=(1.0, 0.0, 0.0))
    rides = box("rides", 0.0, 0.5, material=ROUGH)
    both = (belt, rides) if belt_first else (rides, belt)
    run = held(scene(*both, still("post", 1.0, 0.55)), sleepy(), 60)
    assert np.linalg.norm(run.state["rides"][7:]) < 1e-9
    assert asleep(run) == 0


@pytest.mark.parametrize("kind", ["force", "rest", "bearing"])
def test_joints_that_follow_the_time_or_their_load_keep_awake(kind: str) -> None:
    wave = Sinusoid(amplitude=1e-9, frequency=1.0)
    drive: dict[str, Any] = {
        "force": {"motor": Motor(force=wave)},
        "rest": {"spring": JointSpring(stiffness=1.0, rest=wave)},
        "bearing": {"load_friction": 0.1},
    }[kind]
    slide = Prismatic(name="slide", between=(WORLD, "a"), at=(0.0, 0.0, 0.5), axis=(1.0, 0.0, 0.0), **drive)
    run = held(scene(FLOOR, box("a", 0.0, 0.5), box("b", 5.0, 0.5), constraints=(slide,)), sleepy(), 60)
    assert asleep(run) == 1


def test_bodies_sleep_on_what_stands_still_but_for_the_rounding_of_its_path() -> None:
    """A path that has come to its end is followed at 1e-14 m/s, for ever, where its end and the body's start ask for it."""
    start, end = -1.6370544387997217, 0.7391228681162545
    path = Ramp(start=0.2, end=2.2, start_value=start, end_value=end)
    lift = told("lift", 0.0, start, shape=Box((4.0, 4.0, 1.0)), path=(0.0, 0.0, path), material=ROUGH)
    run = held(scene(lift, box("rides", 0.0, start + 1.0)), sleepy(), 240)
    for _ in range(20):
        run.step()
        assert 0.0 < abs(run.state["lift"][9]) < 1e-12
        assert asleep(run) == 1


# --- what hangs together ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["wire", "aside"])
def test_wires_and_springs_that_pull_aside_tie_sleepers(kind: str) -> None:
    """A ball that strikes the last wakes all, in the same step."""
    places = (0.0, 4.0, 8.0)
    bodies = [box(f"b{k}", x, 0.0) for k, x in enumerate(places)]
    ball = solid("ball", Sphere(0.2), (14.0, 0.0, 0.0), velocity=(-4.0, 0.0, 0.0))
    if kind == "wire":
        ends = tuple((f"b{k}", (x, 0.0, 0.1)) for k, x in enumerate(places))
        built = Scene(bodies=(*bodies, ball), constraints=(Wire(name="tie", through=ends),))
    else:
        springs = tuple(
            Spring(
                name=f"tie {k}",
                between=(f"b{k}", f"b{k + 1}"),
                stiffness=10.0,
                rest_length=3.0,
                anchors=((0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)),
            )
            for k in range(2)
        )
        built = Scene(bodies=(*bodies, ball), forces=springs)
    assert wakes_as_a_whole(held(built, sleepy(), 60), 3, 120)


def test_a_woken_body_is_at_rest_no_sooner_than_any_other() -> None:
    """Two boxes that touch: one is pulled away, and the other sleeps again half a second later; what is set while awake
    begins anew."""
    bodies = (box("a", 0.0, 0.0), box("b", 1.0, 0.0))
    run = held(scene(*bodies, weighs=False, forces=(Load(name="pull", body="b"),)), sleepy(), 40)
    assert asleep(run) == 2
    run.set_load("pull", force=(60.0, 0.0, 0.0))
    run.step(29)
    assert asleep(run) == 0
    run.step()
    assert asleep(run) == 1
    assert run.state["a"][0] == 0.0

    run = held(scene(FLOOR, box("b", 0.0, 0.5), forces=(Load(name="pull", body="b"),)), sleepy(), 20)
    run.set_load("pull", force=(0.0, 0.0, -1e-6))
    run.step(29)
    assert asleep(run) == 0
    run.step()
    assert asleep(run) == 1


# --- what wakes ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize("kind", ["lock", "spring"])
def test_a_kinematic_body_that_holds_sleepers_wakes_them_in_the_step_it_goes(kind: str, first: bool) -> None:
    """Nothing touches: a weight on a lock, and one on a spring."""
    between = ("crane", "load") if first else ("load", "crane")
    tie: dict[str, Any] = (
        {"constraints": (Lock(name="tie", between=between),)}
        if kind == "lock"
        else {"forces": (Spring(name="tie", between=between, stiffness=GRAVITY, rest_length=3.0),)}
    )
    run = held(scene(FLOOR, told("crane", 0.0, 9.0), box("load", 0.0, 5.0), **tie), sleepy(), 60)
    assert asleep(run) == 1
    before = run.state["load"][2]
    run.set_velocity("crane", velocity=(0.0, 0.0, 1.0))
    run.step()
    assert asleep(run) == 0
    if kind == "lock":
        assert run.state["load"][2] > before + 0.8 * TIME_STEP
    run.step()
    assert run.state["load"][9] > 0.0


@pytest.mark.parametrize("first", [True, False])
def test_a_kinematic_body_wakes_what_it_leaves_whichever_is_listed_first(first: bool) -> None:
    table = told("table", 0.0, -0.5, shape=Box((4.0, 4.0, 1.0)), material=ROUGH)
    bodies = (table, box("a", 0.0, 0.5)) if first else (box("a", 0.0, 0.5), table)
    run = held(scene(*bodies), sleepy(), 60)
    assert asleep(run) == 1
    run.set_velocity("table", velocity=(0.0, 0.0, -5.0))
    run.step()
    assert asleep(run) == 0
    assert math.isclose(run.state["a"][9], -GRAVITY * TIME_STEP, rel_tol=1e-12)


@pytest.mark.parametrize("drive", ["motor", "rest"])
@pytest.mark.parametrize("solver", SOLVERS)
def test_what_drives_a_joint_on_the_world_wakes_when_it_is_set(drive: str, solver: str) -> None:
    """Its only sleeper is the second body of the joint."""
    what: dict[str, Any] = (
        {"motor": Motor(speed=0.0)}
        if drive == "motor"
        else {"spring": JointSpring(stiffness=100.0, rest=0.0)}
    )
    slide = Prismatic(name="slide", between=(WORLD, "sled"), at=(0.0, 0.0, 0.5), axis=(1.0, 0.0, 0.0), **what)
    built = scene(FLOOR, box("sled", 0.0, 0.5, material=SMOOTH), constraints=(slide,))
    run = held(built, sleepy(solver), 60)
    assert asleep(run) == 1
    if drive == "motor":
        run.set_motor("slide", speed=0.5)
    else:
        run.set_rest("slide", 1.0)
    run.step()
    assert asleep(run) == 0
    run.step(2)
    assert run.state["sled"][7] > 0.1


# --- what is read and kept ----------------------------------------------------------------------------------


def test_forces_of_a_joint_that_fell_asleep_before_anything_touched_are_read_when_something_does() -> None:
    """Steps without contacts and steps with them keep a joint's rows in different places."""
    hangs = box("hangs", 0.0, 5.0)
    post = Hinge(name="post", between=(WORLD, "hangs"), at=(0.0, 0.0, 6.0), axis=(0.0, 1.0, 0.0))
    falls = RigidBody(name="falls", mass=1.0, shape=Sphere(0.3), position=(20.0, 0.0, 9.0), material=ROUGH)
    run = held(scene(FLOOR, hangs, falls, constraints=(post,)), sleepy(), 40, pull=ConstraintForce("post"))
    assert asleep(run) == 1
    pull = run["pull"]
    assert pull[2] == pytest.approx(GRAVITY, rel=1e-6)
    for _ in range(100):
        run.step()
        assert np.array_equal(pull, run["pull"])


def test_what_fell_asleep_turning_slowly_wakes_without_that_turn() -> None:
    turns = box("turns", 0.0, 5.0, angular_velocity=(0.0, 0.0, 0.01))
    run = held(scene(FLOOR, turns, weighs=False, forces=(Load(name="push", body="turns"),)), sleepy(), 40)
    assert asleep(run) == 1
    run.set_load("push", force=(6.0, 0.0, 0.0))
    run.step()
    assert asleep(run) == 0
    assert run.state["turns"][7] == pytest.approx(0.1, rel=1e-12)
    assert not run.state["turns"][10:].any()


@pytest.mark.parametrize("hung", [False, True])
def test_what_begins_to_fall_slowly_is_not_asleep(hung: bool) -> None:
    """On a small moon a ball stays below sleep_speed for seconds: thrown up by 1 cm/s, or let go on a string."""
    gravity, seconds = 0.01, 5.0
    ball = solid("ball", Sphere(0.1), (0.0, 0.0, 1.0), velocity=(0.0, 0.0, 0.0 if hung else 0.01))
    floor = RigidBody(name="floor", position=(0.0, 0.0, 0.0), shape=Plane(), motion="static")
    rod = Distance(name="rod", between=((1.0, 0.0, 1.0), "ball"), compliance=0.0)
    result = simulate(
        Scene(bodies=(ball, floor), constraints=(rod,) if hung else (), gravity=(0.0, 0.0, -gravity)),
        time_step=1 / 60,
        duration=seconds,
        method=Method(sleep_speed=0.02),
        observe={"x": Trace(quantity=Position("ball"))},
    )
    fallen = 1.0 - result["x"][-1, 2]

    if hung:  # a quarter circle begins as a fall
        assert fallen == pytest.approx(0.5 * gravity * seconds**2, rel=0.01)
    else:
        assert fallen == pytest.approx(0.5 * gravity * seconds**2 - 0.01 * seconds, abs=1e-3)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("rolls", [False, True])
def test_what_gets_faster_is_not_asleep_however_slowly(rolls: bool, solver: str) -> None:
    """From rest on a slope of .05 degrees: half of sleep_speed after a second, sliding or rolling."""
    pull = GRAVITY * math.radians(0.05)
    surface = {"material": ROUGH if rolls else SMOOTH}
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), **surface)
    ball = solid("ball", Sphere(0.1), (0.0, 0.0, 0.1), **surface)
    slope = Scene(bodies=(floor, ball), gravity=(pull, 0.0, -GRAVITY))
    run = held(slope, sleepy(solver), round(3.0 / TIME_STEP))

    assert run.state["ball"][0] == pytest.approx((5 / 7 if rolls else 1.0) * pull * 9.0 / 2.0, rel=0.02)


@pytest.mark.parametrize(("thrown", "slow"), [(4.0, 3.0), (0.5, 3.0)])
def test_what_flies_is_left_alone_however_slow_it_is_at_its_top(thrown: float, slow: float) -> None:
    """To the bits of a run without sleeping: what nothing holds is not at rest."""
    ball = solid("ball", Sphere(0.1), (0.0, 0.0, 0.1), velocity=(0.0, 0.0, thrown))
    asked = scene(FLOOR, ball)
    observe = {"x": Trace(quantity=Position("ball"))}
    flight = 2.0 * thrown / GRAVITY - TIME_STEP
    flown, free = (
        simulate(asked, time_step=TIME_STEP, duration=flight, method=method, observe=observe)["x"]
        for method in (Method(sleep_speed=slow), Method())
    )

    assert np.array_equal(flown, free)


@pytest.mark.parametrize(("share", "sleeps"), [(0.98, False), (1.02, True)])
def test_a_ball_turns_back_on_a_slope_unless_it_is_slow_for_as_long_as_sleep_takes(
    share: float, sleeps: bool
) -> None:
    """Slower than s for 2 s/(g sin α): it sleeps where that is sleep_after, two steps more or less."""
    method, pull = Method(), 0.5 * GRAVITY  # along a smooth slope of 30°
    slow = share * 0.5 * pull * method.sleep_after
    ball = solid("ball", Sphere(0.1), (0.0, 0.0, 0.1), velocity=(2.0 * slow, 0.0, 0.0))
    ground = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    slope = Scene(bodies=(ground, ball), gravity=(-pull, 0.0, -math.sqrt(0.75) * GRAVITY))
    result = simulate(
        slope,
        time_step=1.0 / 240.0,
        duration=2.0 * slow / pull + method.sleep_after,
        method=replace(method, sleep_speed=slow),
        observe={"v": Trace(quantity=Velocity("ball"))},
    )

    assert (result["v"][-1, 0] == 0.0) == sleeps
    assert (result["v"][-1, 0] < 0.0) != sleeps


def test_a_stack_at_rest_from_the_start_sleeps_with_its_weight() -> None:
    run = held(scene(FLOOR, *stack(count=5)), sleepy(), 180, load=ContactForce("floor"))

    assert asleep(run) == 5
    assert abs(run["load"][2]) == pytest.approx(5.0 * GRAVITY, rel=1e-9)
