"""Every shape lands on every shape: it is stopped, carried with its whole weight, and never given energy."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    Compound,
    Cone,
    ContactForce,
    ConvexHull,
    Cylinder,
    Energy,
    Material,
    Maximum,
    Mean,
    Part,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Trace,
    Velocity,
    simulate,
)

GRAVITY = 9.81  # m/s²
ROUGH = Material(friction=0.6)
SHAPES: dict[str, Shape] = {
    "sphere": Sphere(0.3),
    "box": Box((0.6, 0.4, 0.5)),
    "capsule": Capsule(0.15, 0.5),
    "hull": ConvexHull(
        ((0.35, 0, 0), (-0.3, 0.05, 0), (0, 0.35, 0), (0.02, -0.3, 0), (0, 0, 0.3), (0, 0.03, -0.28))
    ),
    "cylinder": Cylinder(0.25, 0.4),
    "cone": Cone(0.35, 0.5),
    "compound": Compound(
        (
            Part(shape=Box((1.0, 0.2, 0.1))),
            Part(shape=Sphere(0.2), position=(0.4, 0.0, 0.0)),
            Part(shape=Capsule(0.1, 0.3), position=(-0.4, 0.0, 0.0)),
        )
    ),
}
GROUND = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=ROUGH)
OBSERVE = {
    "energy": Trace(quantity=Energy()),
    "depth": Maximum(quantity=Penetration()),
    "force": Mean(quantity=ContactForce("body"), first=270),
    "x": Trace(quantity=Position("body")),
    "v": Trace(quantity=Velocity("body")),
}


def dropped(shape: str, height: float, **changes: object) -> RigidBody:
    return RigidBody(
        name="body",
        mass=1.0,
        shape=SHAPES[shape],
        inertia=(0.02, 0.03, 0.03),
        position=(0.02, 0.03, height),
        material=ROUGH,
        **changes,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("falling", SHAPES)
@pytest.mark.parametrize("resting", SHAPES)
def test_a_shape_dropped_on_another_ends_up_carried(resting: str, falling: str) -> None:
    base = RigidBody(
        name="base", motion="static", shape=SHAPES[resting], position=(0.0, 0.0, 0.0), material=ROUGH
    )
    scene = Scene(bodies=(GROUND, base, dropped(falling, 1.2)), gravity=(0.0, 0.0, -GRAVITY))
    result = simulate(scene, time_step=1 / 60, duration=5.0, observe=OBSERVE)

    assert (
        np.diff(result["energy"]).max() < 3e-3
    )  # J of 11.8 at the start: what putting an overlap right lifts
    assert float(result["depth"]) < 5e-3
    assert result["force"][2] == pytest.approx(GRAVITY, rel=0.02)  # it may still roll
    assert result["x"][-1, 2] > 0.1


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("shape", SHAPES)
def test_a_shape_thrown_at_random_comes_to_rest_or_rolls(shape: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    turned = rng.standard_normal(4)
    body = dropped(
        shape,
        1.5,
        orientation=tuple(turned / np.linalg.norm(turned)),
        angular_velocity=tuple(rng.standard_normal(3)),
    )
    scene = Scene(bodies=(GROUND, body), gravity=(0.0, 0.0, -GRAVITY))
    result = simulate(scene, time_step=1 / 60, duration=10.0, observe=OBSERVE)

    assert np.diff(result["energy"]).max() < 1e-4
    assert float(result["depth"]) < 1e-3
    assert result["force"] == pytest.approx([0.0, 0.0, GRAVITY], abs=0.05)
    assert np.abs(result["v"][-20:, 2]).max() < 1e-3
