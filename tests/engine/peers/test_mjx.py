"""MuJoCo XLA behind the protocol: in double precision it is MuJoCo to rounding. Skipped, with the reason, without it."""

from __future__ import annotations

from functools import partial

import pytest

from spook_tracker.engine import Plane, Position, RigidBody, Scene, Sphere
from spook_tracker.engine.find import find
from tests.scenes import peer as peer_scenes
from tests.scenes.seen import finals

pytest.importorskip("mujoco.mjx", reason="the extra mjx is not installed: pip install 'spook-tracker[mjx]'")


@pytest.mark.parametrize("configuration", ["rk4", "defaults"])
def test_a_pendulum_gains_what_mujoco_s_gains_and_keeps_its_length(configuration: str) -> None:
    """The same equations, summed in another order: energies agree to a millionth of what they err by, or to rounding."""
    theirs = peer_scenes.swung(partial(find("mujoco").simulate, configuration=configuration), 1 / 60)
    length, energy = peer_scenes.swung(partial(find("mjx").simulate, configuration=configuration), 1 / 60)

    assert length < 1e-12
    assert energy == pytest.approx(theirs[1], rel=1e-6, abs=1e-13)


def test_a_box_slides_as_mujoco_s_but_for_its_own_points_of_contact() -> None:
    theirs = peer_scenes.slid(partial(find("mujoco").simulate, configuration="defaults"), 0.7)
    mine = peer_scenes.slid(partial(find("mjx").simulate, configuration="defaults"), 0.7)
    assert mine == pytest.approx(theirs, rel=0.01)


def test_a_ball_that_nothing_rubs_lies_where_mujoco_s_does() -> None:
    """MJX 3.17 breaks off at elliptic cones where no contact has one: it is not asked for cones there."""
    shape = Sphere(radius=0.5)
    ball = RigidBody(name="ball", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.5), shape=shape)
    floor = RigidBody(name="floor", motion="static", position=(0.0, 0.0, 0.0), shape=Plane())
    scene = Scene(bodies=(ball, floor), gravity=(0.0, 0.0, -10.0))
    heights = [
        find(engine).simulate(
            scene, time_step=1 / 60, steps=20, configuration="rk4", observe=finals(height=Position("ball"))
        )["height"][2]
        for engine in ("mjx", "mujoco")
    ]
    assert heights[0] == pytest.approx(heights[1], abs=1e-9)
