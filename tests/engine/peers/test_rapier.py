"""Rapier behind the protocol: what it has it does to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

from typing import Any

import pytest

from spook_tracker.engine import ContactForce, Material, Particle, Plane, Position, Scene, Sphere
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.engine.protocol import NotSupported
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals, traces

try:
    RAPIER = find("rapier")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

STEP = 1.0 / 60.0  # s
GRAVITY = (0.0, 0.0, -9.81)


def lying(friction: float) -> Scene:
    """Two balls of 1 kg and 3 kg on a plane; the plane comes last among the bodies."""
    surface = Material(friction=friction)
    balls = (
        solid(f"ball {i}", Sphere(0.5), (2.0 * i, 0.0, 0.5), mass, material=surface)
        for i, mass in enumerate((1.0, 3.0))
    )
    plane = fixed("plane", Plane(), (0.0, 0.0, 0.0), material=surface)
    return Scene(bodies=(*balls, plane), gravity=GRAVITY)


def test_the_force_of_a_contact_is_told_of_either_body_and_of_every_step() -> None:
    observe = traces(up=ContactForce("ball 1", "plane")) | finals(
        down=ContactForce("plane", "ball 1"),
        light=ContactForce("ball 0"),
        between=ContactForce("ball 0", "ball 1"),
    )
    run = RAPIER.simulate(lying(0.0), time_step=STEP, duration=2.0, observe=observe)

    assert run["up"][-1] == pytest.approx([0.0, 0.0, 3.0 * 9.81], rel=1e-4)
    assert run["up"][0] == pytest.approx([0.0, 0.0, 0.0]), "before the first step"
    assert run["down"] == pytest.approx(-run["up"][-1])
    assert run["light"] == pytest.approx([0.0, 0.0, 9.81], rel=1e-4)
    assert run["between"] == pytest.approx([0.0, 0.0, 0.0])


def test_what_is_faster_than_its_bound_is_not_supported() -> None:
    def end(speed: float) -> Any:
        ball = Particle(name="ball", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0))
        seen = finals(x=Position("ball"))
        return RAPIER.simulate(Scene(bodies=(ball,)), time_step=STEP, steps=60, observe=seen)["x"][0]

    assert end(390.0) == pytest.approx(390.0, rel=1e-3)
    with pytest.raises(NotSupported, match=r"speeds of 399\.99 m/s and more"):
        end(600.0)
