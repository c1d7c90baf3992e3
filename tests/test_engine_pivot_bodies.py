"""Bodies on balls of the world: the steps of the dense oracle, and those that joint coordinates in general take."""

from __future__ import annotations

import dataclasses

import numpy as np

from spook_tracker import engine
from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Hinge,
    Method,
    Orientation,
    Position,
    Scene,
    Trace,
    Velocity,
    simulate,
)
from tests import rigid_scenes
from tests.oracle_rigid_composition import ComposedOracle

OBSERVE = {
    "x": Trace(quantity=Position()),
    "v": Trace(quantity=Velocity()),
    "w": Trace(quantity=AngularVelocity()),
    "q": Trace(quantity=Orientation()),
}


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
    scene = pivots()
    oracle = ComposedOracle(scene, 0.02)

    run = simulate(scene, time_step=0.02, steps=2, method=Method(composition="order4"), observe=OBSERVE)

    assert "bodies on balls of the world" in reason(scene)
    for k in (1, 2):
        oracle.step()
        same = np.sign(np.sum(run["q"][k] * oracle.q, axis=1))[:, None]
        for quantity, exact in (("x", oracle.x), ("v", oracle.v), ("w", oracle.angular_velocity())):
            assert np.abs(run[quantity][k] - exact).max() < 1e-9, quantity
        assert np.abs(same * run["q"][k] - oracle.q).max() < 1e-10


def test_pivots_move_as_joint_coordinates_in_general_have_it() -> None:
    """A body on a hinge far away makes all of them joint coordinates: the same map by another formula."""
    alone = pivots()
    away = dataclasses.replace(rigid_scenes.rigid_body(np.random.default_rng(6), 7), name="away")
    pin = Hinge(name="pin", between=(WORLD, "away"), at=(9.0, 0.0, 0.0), axis=(0.6, 0.0, 0.8), compliance=0.0)
    beside = dataclasses.replace(alone, bodies=(*alone.bodies, away), constraints=(*alone.constraints, pin))

    runs = [
        simulate(s, time_step=0.02, steps=5, method=Method(composition="order8"), observe=OBSERVE)
        for s in (alone, beside)
    ]

    assert "10 joint coordinates" in reason(beside)
    for quantity in OBSERVE:
        assert np.abs(runs[0][quantity] - runs[1][quantity][:, :3]).max() < 1e-12, quantity
