"""Bodies on balls of the world: the steps of the dense oracle, and those that joint coordinates in general take."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import WORLD, AngularMomentum, Ball, Hinge, Method, Scene, Trace, simulate
from tests.oracles.rigid_composition import STATE, PivotOracle, assert_dense_steps
from tests.scenes import rigid as rigid_scenes


def pivots() -> Scene:
    """Three bodies, their pivots anywhere: off all of their axes; one is the first of its joint, one hangs at its centre."""
    rng = np.random.default_rng(5)
    bodies = tuple(rigid_scenes.rigid_body(rng, i) for i in range(3))
    places = ((0.5, 0.2, 0.1), (2.2, -0.4, 0.7), bodies[2].position)
    rows = [
        rigid_scenes.joint(rng, "ball", *(("b1", WORLD) if i == 1 else (WORLD, f"b{i}")), places[i])
        for i in range(3)
    ]
    rigid = tuple(dataclasses.replace(row, compliance=0.0) for row in rows)
    return Scene(bodies=bodies, constraints=rigid, gravity=rigid_scenes.GRAVITY, contacts=False)


def reason(scene: Scene) -> str:
    program = engine.compile(scene, time_step=0.02, method=Method(composition="order8"))
    return next(choice.reason for choice in program.explain() if choice.stage == "solve_block")


def test_pivots_take_the_dense_steps() -> None:
    assert "bodies on balls of the world" in reason(pivots())
    assert_dense_steps(pivots(), 0.1, 2, oracle=PivotOracle)


def test_pivots_move_as_joint_coordinates_in_general_have_it() -> None:
    """A body on a hinge far away makes all of them joint coordinates, whose turns are of another map, the same to order four."""
    alone = pivots()
    away = dataclasses.replace(rigid_scenes.rigid_body(np.random.default_rng(6), 7), name="away")
    pin = Hinge(name="pin", between=(WORLD, "away"), at=(9.0, 0.0, 0.0), axis=(0.6, 0.0, 0.8), compliance=0.0)
    beside = dataclasses.replace(alone, bodies=(*alone.bodies, away), constraints=(*alone.constraints, pin))

    runs = [
        simulate(s, time_step=0.01, steps=50, method=Method(composition="order4"), observe=STATE)
        for s in (alone, beside)
    ]

    assert "10 joint coordinates" in reason(beside)
    for quantity in STATE:
        assert np.abs(runs[0][quantity] - runs[1][quantity][:, :3]).max() < 1e-8, quantity


@pytest.mark.parametrize("turn", [0.05, 0.9])
def test_a_body_on_a_ball_at_its_centre_turns_as_a_free_one(turn: float) -> None:
    """Nothing pushes it: slowly, and so fast that most of a radian goes by in a step. Momentum stays as it was."""
    h = 0.01
    free = dataclasses.replace(
        rigid_scenes.rigid_body(np.random.default_rng(8), 0),
        velocity=(0.0, 0.0, 0.0),
        angular_velocity=tuple(turn / h * np.array([0.6, 0.48, 0.64])),
    )
    ball = Ball(name="ball", between=(WORLD, free.name), at=free.position, compliance=0.0)
    observe = {**STATE, "L": Trace(quantity=AngularMomentum())}

    held, loose = (
        simulate(Scene(bodies=(free,), constraints=rows, contacts=False), time_step=h, steps=50,
                 method=Method(composition="order6"), observe=observe)
        for rows in ((ball,), ())
    )  # fmt: skip

    for quantity in observe:
        scale = np.abs(loose[quantity]).max() or 1.0
        assert np.abs(held[quantity] - loose[quantity]).max() < 1e-11 * scale, quantity
    assert np.ptp(held["L"], axis=0).max() < 1e-13 * np.abs(held["L"]).max()
