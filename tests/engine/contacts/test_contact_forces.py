"""Resting contacts: depth by compliance, forces that sum to the weight, stacks, overlaps; and what may touch what."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    Capsule,
    Compound,
    ContactCount,
    ContactForce,
    ContactPoints,
    Final,
    Material,
    MethodError,
    Part,
    Particle,
    Penetration,
    Position,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Velocity,
    compile,
    simulate,
)
from tests.scenes.contact import DOWN, GRAVITY, ground
from tests.scenes.seen import finals, traces

H = 1 / 60  # s


def body(shape: Shape, height: float, name: str = "body", mass: float = 2.0, **extra: object) -> RigidBody:
    return RigidBody(name=name, mass=mass, shape=shape, position=(0.0, 0.0, height), **extra)  # type: ignore[arg-type]


LYING = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
CROSS = Compound((Part(shape=Box((1.0, 0.2, 0.1))), Part(shape=Box((0.2, 1.0, 0.1)))))
RESTING = [
    ("sphere", body(Sphere(0.3), 0.3), 1),
    ("box", body(Box((1.0, 0.6, 0.4)), 0.2), 4),
    ("standing capsule", body(Capsule(0.2, 0.5), 0.45), 1),
    ("lying capsule", body(Capsule(0.2, 0.5), 0.2, orientation=LYING), 2),
    ("compound cross", body(CROSS, 0.05, inertia=(0.2, 0.2, 0.3)), 8),
]


@pytest.mark.parametrize("h", [1e-3, 1 / 60])
@pytest.mark.parametrize("eps", [1e-7, 1e-4])
@pytest.mark.parametrize(("resting", "points"), [r[1:] for r in RESTING], ids=[r[0] for r in RESTING])
def test_t8_a_body_rests_at_the_depth_its_compliance_gives(
    resting: RigidBody, points: int, eps: float, h: float
) -> None:
    """eps m g over the number of contact points, whatever the step; the forces sum to the weight."""
    scene = Scene(bodies=(ground(Material(compliance=eps)), resting), gravity=DOWN)
    observe = finals(f=ContactForce("body"), n=ContactCount(), depth=Penetration(), v=Velocity("body"))
    result = simulate(scene, time_step=h, duration=600.0 * h if eps < 1e-5 else 5.0, observe=observe)

    assert int(result["n"]) == points
    assert float(result["depth"]) == pytest.approx(eps * 2.0 * GRAVITY / points, rel=1e-6)
    np.testing.assert_allclose(result["f"], [0.0, 0.0, 2.0 * GRAVITY], rtol=0.0, atol=1e-7)
    assert np.abs(result["v"]).max() < 1e-9


SLOPE = math.radians(20.0)
TILTED = (math.cos(SLOPE / 2), 0.0, math.sin(SLOPE / 2), 0.0)  # about y: the slope falls along x
NORMAL = np.array([math.sin(SLOPE), 0.0, math.cos(SLOPE)])


def test_the_points_of_a_box_on_a_slope_hold_it() -> None:
    """Four corners on the plane, each force in its cone; together they carry the weight, and so its torque."""
    slope = replace(ground(Material(friction=0.25)), orientation=TILTED)
    box = body(Box((1.0, 0.6, 0.4)), 0.0, orientation=TILTED, material=Material(friction=1.0))
    box = replace(box, position=tuple(0.2 * NORMAL))
    points, force = (Final(quantity=q) for q in (ContactPoints(6), ContactForce("body")))
    result = simulate(
        Scene(bodies=(slope, box), gravity=DOWN), time_step=1e-3, steps=20,
        observe={"points": points, "force": force, "position": Final(quantity=Position("body"))},
    )  # fmt: skip
    found = result["points"]

    assert found.shape == (6, 10)
    assert np.isnan(found[4:]).all()
    where, normal, pushes, friction = found[:4, :3], found[:4, 3:6], found[:4, 6:9], found[:4, 9]
    np.testing.assert_allclose(where @ NORMAL, 0.0, atol=1e-12)
    np.testing.assert_allclose(normal, np.tile(-NORMAL, (4, 1)), atol=1e-12)  # the ground is the first
    np.testing.assert_allclose(-pushes.sum(axis=0), result["force"], atol=1e-9)
    pressed = (pushes * normal).sum(axis=1)
    slips = np.linalg.norm(pushes - pressed[:, None] * normal, axis=1)
    assert np.all(slips <= friction * pressed * (1 + 1e-9))
    np.testing.assert_allclose(friction, 0.5)  # the geometric mean of both surfaces
    arms = where - result["position"]
    np.testing.assert_allclose(np.cross(arms, -pushes).sum(axis=0), 0.0, atol=1e-8)  # it does not tip


def test_points_beyond_those_asked_for_are_left_out_and_none_is_no_number() -> None:
    scene = Scene(bodies=(ground(), body(Box((1.0, 0.6, 0.4)), 0.2)), gravity=DOWN)
    two = simulate(scene, time_step=H, steps=2, observe=traces(p=ContactPoints(2)))["p"]
    flying = Scene(bodies=(body(Sphere(0.3), 9.0),), gravity=DOWN)
    none = simulate(flying, time_step=H, steps=2, observe=finals(p=ContactPoints(3)))["p"]
    dust = Scene(bodies=(Particle(name="dust", position=(0, 0, 0), mass=1.0),), gravity=DOWN)
    dusty = simulate(dust, time_step=H, steps=2, observe=finals(p=ContactPoints(3)))["p"]

    assert two.shape == (3, 2, 10)
    assert np.isnan(two[0]).all(), "no step has ended yet"
    assert np.isfinite(two[1:]).all()
    assert np.isnan(none).all() and np.isnan(dusty).all()


@pytest.mark.parametrize("most", [0, -1, 1.5, True, 10**9, "4", None])
def test_a_number_of_points_that_is_none_is_refused(most: object) -> None:
    with pytest.raises(MethodError, match="must ask for a whole number of points, from 1 to 100000"):
        ContactPoints(most)  # type: ignore[arg-type]


def test_action_and_reaction() -> None:
    boxes = (body(Box((1.0, 1.0, 1.0)), 0.5 + i, f"box {i}", mass=1.0) for i in range(3))
    scene = Scene(bodies=(ground(), *boxes), gravity=DOWN)
    names = [("box 0", "box 1"), ("box 1", "box 0"), ("box 1", None), ("box 2", None), ("ground", None)]
    observe = {f"{a} {b}": Final(quantity=ContactForce(a, b)) for a, b in names}
    result = simulate(scene, time_step=H, steps=60, observe=observe)

    np.testing.assert_allclose(result["box 0 box 1"], -result["box 1 box 0"], atol=1e-12)
    np.testing.assert_allclose(result["box 1 None"], [0.0, 0.0, GRAVITY], atol=1e-8)
    np.testing.assert_allclose(result["ground None"], [0.0, 0.0, -3.0 * GRAVITY], atol=1e-8)


def test_contacts_are_left_out_where_they_are_not_possible() -> None:
    ghost = RigidBody(name="ghost", mass=1.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 1.0))
    box = body(Box((1.0, 1.0, 1.0)), 3.0)
    alone = Scene(bodies=(ground(), ghost), gravity=DOWN)
    off = Scene(bodies=(ground(), box), gravity=DOWN, contacts=False)
    listed = Scene(bodies=(ground(), box), gravity=DOWN, no_contact=(("body", "ground"),))
    on = Scene(bodies=(ground(), box), gravity=DOWN)

    for scene in (alone, off, listed):
        assert not {"collision", "impact", "pivot", "friction"} & set(compile(scene, time_step=H).stages)
        result = simulate(scene, time_step=H, duration=2.0)
        assert result.counters.get("contacts", 0) == 0
        assert result.final_state[scene.bodies[1].name][2] < -5.0
    assert "collision" in compile(on, time_step=H).stages
    assert simulate(on, time_step=H, duration=2.0).final_state["body"][2] == pytest.approx(0.5, abs=1e-6)
