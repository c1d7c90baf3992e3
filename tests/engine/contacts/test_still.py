"""What rests is found at rest and costs no factor; what only seems to rest is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    ContactForce,
    Load,
    Material,
    Plane,
    Position,
    Run,
    Scene,
    Sphere,
    Velocity,
    start,
)
from tests.scenes.contact import DOWN, GRAVITY, TIME_STEP, ground
from tests.scenes.corpus import fixed, solid

ROUGH = Material(friction=0.5)
EDGE = 0.3  # m, no binary fraction: gaps of boxes on boxes are never zero in every corner


def stacks() -> Scene:
    """Four stacks of five boxes let fall by a few centimetres, none straight; a push waits at the top of the first,
    a ball is on its way to the second."""
    rng = np.random.default_rng(4)
    boxes = [
        solid(f"box{column}{level}", Box((EDGE, EDGE, EDGE)), (1.1 * column + rng.uniform(-.02, .02), rng.uniform(-.02, .02), .17 + .32 * level), material=ROUGH)
        for column in range(4)
        for level in range(5)
    ]  # fmt: skip
    ball = solid("ball", Sphere(0.1), (1.1, 0.0, 35.0), 0.2, (0, 0, -2.0), material=ROUGH)
    push = Load(name="push", body="box04")
    return Scene(bodies=(ground(ROUGH), *boxes, ball), forces=(push,), gravity=DOWN)


def speeds(run: Run, name: str) -> bytes:
    """The bits of its velocity and angular velocity: those of a place near zero creep on by 1e-20 m."""
    return run.state[name][7:].tobytes()


def factors(run: Run) -> int:
    return run.result().counters["factorisations"]


@pytest.fixture(scope="module")
def rested() -> Run:
    """After two seconds: the ball is still above."""
    run = start(
        stacks(),
        time_step=TIME_STEP,
        observe={"floor": ContactForce("ground"), "height": Position("ball"), "pushed": Velocity("box04")},
    )
    run.step(120)
    return run


def test_stacks_off_the_grid_come_to_rest_to_the_last_bit(rested: Run) -> None:
    """A gap of rounding that is answered with a speed comes back as another, for ever."""
    saved = rested.save()
    before, work = {name: speeds(rested, name) for name in rested.state if name != "ball"}, factors(rested)

    rested.step(20)

    assert factors(rested) == work
    assert {name: speeds(rested, name) for name in before} == before
    assert max(np.abs(rested.state[name][7:]).max() for name in before) < 1e-13
    assert rested["floor"][2] == pytest.approx(-20 * GRAVITY, rel=1e-12)
    rested.restore(saved)


def test_a_load_on_what_rests_is_answered_in_the_same_step(rested: Run) -> None:
    saved, bound = rested.save(), 0.5 * GRAVITY

    rested.set_load("push", force=(0.9 * bound, 0.0, 0.0))
    rested.step()
    assert rested["floor"][0] == pytest.approx(
        0.9 * bound, rel=1e-9
    )  # friction carries it down, nothing moves
    assert abs(rested["pushed"][0]) < 1e-12

    rested.set_load("push", force=(1.1 * bound, 0.0, 0.0))
    rested.step()
    assert rested["pushed"][0] == pytest.approx(0.1 * bound * TIME_STEP, rel=1e-6)  # it slides, and only it

    rested.set_load("push", force=(0.0, 0.0, 2.0 * GRAVITY))
    rested.step()
    assert rested["pushed"][2] == pytest.approx(GRAVITY * TIME_STEP, rel=1e-9)  # it leaves
    rested.restore(saved)


def test_only_the_stack_that_is_hit_stirs_and_going_back_repeats_it(rested: Run) -> None:
    saved = rested.save()
    before = {name: speeds(rested, name) for name in rested.state}

    rested.step(60)
    assert rested["height"][2] < 2.0
    stirred = {name for name in before if speeds(rested, name) != before[name]} - {"ball", "ground"}
    assert stirred
    assert {name[3] for name in stirred} == {"1"}

    whole = rested.result().state_hash
    rested.restore(saved)
    rested.step(23)
    middle = rested.save()
    rested.step(11)
    rested.restore(middle)
    rested.step(37)
    assert rested.result().state_hash == whole
    rested.restore(saved)


@pytest.mark.parametrize("excess", [-1e-5, 1e-5])
def test_a_block_at_the_edge_of_sliding_rests_or_slides(excess: float) -> None:
    """Slope's friction at its bound but for a hundred-thousandth: speed g (sin a − mu cos a) t, or none."""
    angle = 0.3
    rough = Material(friction=math.tan(angle) * (1.0 + excess))
    turn = (math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0)
    up = (math.sin(angle), 0.0, math.cos(angle))
    slope = fixed("slope", Plane(), (0, 0, 0), orientation=turn, material=rough)
    middle = tuple(0.5 * EDGE * x for x in up)
    block = solid("block", Box((EDGE,) * 3), middle, orientation=turn, material=rough)
    with start(
        Scene(bodies=(slope, block), gravity=DOWN), time_step=TIME_STEP, observe={"v": Velocity("block")}
    ) as run:
        run.step(60)
        along = run["v"][0] * math.cos(angle) - run["v"][2] * math.sin(angle)
    assert along == pytest.approx(max(0.0, -excess) * GRAVITY * math.sin(angle), rel=1e-4, abs=1e-12)
