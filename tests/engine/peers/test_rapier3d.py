"""Rapier's Python package behind the protocol: closed forms to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import Box, ContactForce, Material, Plane, Position, RigidBody, Scene, Velocity
from spook_tracker.engine.find import find
from tests.scenes import peer as peer_scenes
from tests.scenes.seen import finals

rapier = pytest.importorskip(
    "rapier3d", reason="the extra rapier3d is not installed: pip install 'spook-tracker[rapier3d]'"
)
DEFAULTS, MANY = "defaults", "many-iterations"


def run(configuration: str) -> Any:
    return partial(find("rapier3d").simulate, configuration=configuration)


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.48, 0.64, 0.6), (-0.48, 0.64, -0.6), (0.0, 1.0, 0.0)])
def test_a_contact_with_friction_shows_all_that_holds_a_box_on_any_slope(up: Any) -> None:
    """At rest it is the weight, across the slope, too; the tangents that Rapier takes depend on the normal alone."""
    rough, normal = Material(friction=0.5), np.array(up)
    pull = 9.81 * (0.3 * np.cross(normal, (0.6, 0.0, 0.8)) - normal)
    ground = RigidBody(
        name="ground", motion="static", shape=Plane(normal=up), position=(0.0, 0.0, 0.0), material=rough
    )
    ball = RigidBody(
        name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=tuple(0.5 * normal),
        orientation=upright_to(normal), material=rough,
    )  # fmt: skip
    scene = Scene(bodies=(ground, ball), gravity=tuple(pull))
    force = finals(f=ContactForce("box"))
    found = run("coulomb")(scene, time_step=1 / 60, duration=1.0, observe=force)
    assert found["f"] == pytest.approx(-pull, abs=5e-3)


def upright_to(normal: Any) -> Any:
    turn = np.array([1.0 + normal[2], -normal[1], normal[0], 0.0])
    return tuple(turn / np.linalg.norm(turn))


def test_two_bodies_that_must_not_touch_fall_through_each_other() -> None:
    boxes = tuple(
        RigidBody(name=name, mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, z))
        for name, z in (("low", 0.5), ("high", 1.5))
    )
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    end = finals(z=Position("high"))
    scene = Scene(bodies=(ground, *boxes), gravity=(0.0, 0.0, -9.81), no_contact=(("low", "high"),))
    assert run(MANY)(scene, time_step=1 / 60, duration=2.0, observe=end)["z"][2] == pytest.approx(
        0.5, abs=2e-3
    )


def test_a_stranger_s_ten_lines_give_the_same_numbers() -> None:
    """Place and speed of a pushed box from the package's own interface, without our adapter: equal to the last digit."""
    world = rapier.PhysicsWorld(gravity=(0.0, 0.0, -9.81))
    world.integration_parameters.dt = 1 / 60
    made = rapier.RigidBodyBuilder(rapier.RigidBodyType.DYNAMIC).can_sleep(False).translation((0.0, 0.0, 0.5))
    inertia = (1 / 6, 1 / 6, 1 / 6)
    made = made.additional_mass_properties(rapier.MassProperties((0.0, 0.0, 0.0), 1.0, inertia))
    ground = rapier.RigidBodyBuilder(rapier.RigidBodyType.FIXED)
    world.add_body(ground, [rapier.Collider.halfspace((0.0, 0.0, 1.0)).friction(0.5)])
    box = world.add_body(made, [rapier.Collider.cuboid(0.5, 0.5, 0.5).density(0.0).friction(0.5)])
    world.gravity = (0.7 * 9.81, 0.0, -9.81)
    for _ in range(120):
        world.step()
    theirs = world.rigid_bodies[box]

    observe = finals(place=Position("box"), speed=Velocity("box"))
    ours = run(DEFAULTS)(peer_scenes.box_on_ground(0.7), time_step=1 / 60, steps=120, observe=observe)
    assert tuple(ours["place"]) == tuple(theirs.translation)
    assert tuple(ours["speed"]) == tuple(theirs.linvel)
