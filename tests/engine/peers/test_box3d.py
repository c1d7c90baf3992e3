"""Box3D behind the protocol: contacts right to single precision. Skipped, with the reason, where it is not built."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    ConstraintForce,
    ContactCount,
    ContactForce,
    Final,
    Hinge,
    Material,
    Motor,
    Particle,
    Penetration,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
)
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.scalar_tests.stacks import resting_stack
from spook_tracker.scalar_tests.thesis.inclined_plane.scene import scene as inclined

try:
    BOX3D = find("box3d")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

STEP = 1.0 / 60.0  # s
GRAVITY = (0.0, 0.0, -9.81)
GROUND = RigidBody(
    name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=Material(friction=0.5)
)


def test_contacts_of_a_stack_carry_what_lies_above() -> None:
    loads = resting_stack.loads(BOX3D.simulate, count=6)
    assert loads == pytest.approx(resting_stack.expected(6), rel=1e-3)


def test_a_box_on_a_slope_is_held_by_one_force_that_is_its_weight() -> None:
    """At rest the forces of its points, friction and normal, are the weight, and nothing creeps."""
    scene = inclined(0.3)
    seen = {
        "force": Final(quantity=ContactForce("box", "plane")),
        "way": Trace(quantity=Position("box"), first=60, every=600),
    }
    run = BOX3D.simulate(scene, time_step=STEP, duration=11.0, observe=seen)
    box = scene.body("box")

    assert run["force"] == pytest.approx(
        -np.array(scene.gravity) * float(box.mass or 0.0), rel=1e-3, abs=1e-3
    )
    assert float(np.abs(run["way"][-1] - run["way"][0]).max()) < 1e-4


@pytest.mark.parametrize(
    ("shape", "height", "points"),
    [(Sphere(0.5), 0.5, 1), (Box((1.0, 1.0, 1.0)), 0.5, 4), (Capsule(0.2, 1.0), 0.2, 2)],
)
def test_what_lies_on_the_ground_touches_it_in_the_points_it_has(
    shape: Any, height: float, points: int
) -> None:
    lying = math.sqrt(0.5)
    turn = (lying, 0.0, lying, 0.0) if isinstance(shape, Capsule) else (1.0, 0.0, 0.0, 0.0)
    body = RigidBody(name="body", mass=2.0, shape=shape, position=(0.0, 0.0, height), orientation=turn)
    seen = {
        "count": Final(quantity=ContactCount()),
        "depth": Final(quantity=Penetration()),
        "force": Final(quantity=ContactForce("body", "ground")),
        "place": Final(quantity=Position("body")),
    }
    run = BOX3D.simulate(
        Scene(bodies=(GROUND, body), gravity=GRAVITY), time_step=STEP, duration=2.0, observe=seen
    )

    assert int(run["count"]) == points
    assert run["force"] == pytest.approx([0.0, 0.0, 19.62], abs=2e-2)
    assert float(run["place"][2]) == pytest.approx(height - float(run["depth"]), abs=1e-4)


def test_a_ball_bounces_by_its_restitution_and_the_larger_counts() -> None:
    ball = RigidBody(
        name="ball", mass=1.0, shape=Sphere(0.1), position=(0.0, 0.0, 0.3), velocity=(0.0, 0.0, -4.0),
        material=Material(restitution=0.5),
    )  # fmt: skip
    seen = {"v": Final(quantity=Velocity("ball"))}
    run = BOX3D.simulate(Scene(bodies=(GROUND, ball)), time_step=STEP, duration=0.2, observe=seen)

    assert float(run["v"][2]) == pytest.approx(2.0, rel=1e-3)


@pytest.mark.parametrize(("kind", "place"), [(Hinge, 5), (Prismatic, 2)])
def test_a_motor_that_lifts_shows_what_it_gives(kind: Any, place: int) -> None:
    """4 N m or N along the joint's axis, until it has its speed: Box3D itself tells a hinge's twice, a slide's askew."""
    body = RigidBody(name="b", mass=2.0, inertia=(2.0, 2.0, 2.0), position=(0.0, 0.0, 0.0))
    drive = Motor(speed=10.0, max_force=4.0)
    joint = kind(name="j", between=("world", "b"), axis=(0.0, 0.0, 1.0), motor=drive, compliance=0.0)
    force = {"f": Final(quantity=ConstraintForce("j"))}
    run = BOX3D.simulate(Scene(bodies=(body,), constraints=(joint,)), time_step=STEP, steps=60, observe=force)

    expected = np.zeros(6)
    expected[place] = 4.0
    assert run["f"] == pytest.approx(expected, abs=1e-3)


def test_particles_fly_and_the_same_run_twice_is_the_same() -> None:
    point = Particle(name="p", position=(0.0, 0.0, 0.0), mass=1.0, velocity=(1.0, 0.0, 0.0))
    runs = [
        BOX3D.simulate(Scene(bodies=(point,), gravity=GRAVITY), time_step=STEP, duration=1.0)
        for _ in range(2)
    ]

    assert runs[0].final_state["p"][0] == pytest.approx(1.0, rel=1e-5)
    assert runs[0].state_hash == runs[1].state_hash
