"""Cylinders: on planes, under balls, in water, and the sizes that are refused."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from spook_tracker.engine import (
    AngularVelocity,
    ContactForce,
    Cylinder,
    Energy,
    Final,
    Load,
    Material,
    Method,
    Orientation,
    Penetration,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)

H = 1.0 / 60.0
DOWN = (0.0, 0.0, -10.0)
ROUGH = Material(friction=0.5)
GROUND = RigidBody(name="ground", motion="static", shape=Plane(), position=(0, 0, 0), material=ROUGH)


def can(**fields: Any) -> RigidBody:
    given = {"mass": 2.0, "shape": Cylinder(0.3, 0.5), "position": (0.0, 0.0, 0.25), "material": ROUGH}
    return RigidBody(name="can", **(given | fields))


def turned(axis: Any, angle: float) -> tuple[float, float, float, float]:
    w, x, y, z = Rotation.from_rotvec(angle * np.asarray(axis) / np.linalg.norm(axis)).as_quat(
        scalar_first=True
    )
    return (w, x, y, z)


def depth(*bodies: RigidBody) -> float:
    found = simulate(Scene(bodies=bodies), time_step=H, steps=1, observe={"d": Trace(quantity=Penetration())})
    return float(found["d"].max())


@pytest.mark.parametrize("seed", range(8))
def test_a_ball_touches_it_where_a_search_finds_the_nearest_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    turn = Rotation.random(rng=rng)
    w, x, y, z = turn.as_quat(scalar_first=True)
    away = rng.standard_normal(3)
    ball = 0.8 * away / np.linalg.norm(away)
    inside = turn.inv().apply(ball)
    nearest = minimize(
        lambda p: float(np.sum((p - inside) ** 2)),
        (0.0, 0.0, 0.0),
        constraints=(
            {"type": "ineq", "fun": lambda p: 0.3**2 - p[0] ** 2 - p[1] ** 2},
            {"type": "ineq", "fun": lambda p: 0.25 - p[2]},
            {"type": "ineq", "fun": lambda p: 0.25 + p[2]},
        ),
        tol=1e-14,
    )
    distance = math.sqrt(nearest.fun)
    fixed = can(motion="static", mass=None, position=(0, 0, 0), orientation=(w, x, y, z))
    for closer, expected in ((1e-3, 1e-3), (-1e-3, 0.0)):
        other = RigidBody(name="ball", mass=1.0, shape=Sphere(distance + closer), position=tuple(ball))
        assert depth(fixed, other) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("orientation", [(1.0, 0.0, 0.0, 0.0), turned((1, 0, 0), math.pi / 2)])
def test_it_rests_on_its_foot_and_on_its_side(orientation: Any) -> None:
    height = 0.25 if orientation[0] == 1.0 else 0.3
    found = simulate(
        Scene(bodies=(GROUND, can(position=(0, 0, height), orientation=orientation)), gravity=DOWN),
        time_step=H,
        steps=120,
        observe={"x": Final(quantity=Position("can")), "force": Final(quantity=ContactForce("can"))},
    )

    np.testing.assert_allclose(found["x"], (0, 0, height), atol=1e-9)
    np.testing.assert_allclose(found["force"], (0, 0, 20.0), atol=1e-8)


@pytest.mark.parametrize("away", [0.0, 0.3, math.pi / 4, 1.1])
@pytest.mark.parametrize(("share", "falls"), [(0.98, False), (1.02, True)])
def test_it_tips_over_its_rim_in_any_direction(away: float, share: float, falls: bool) -> None:
    """Leaning by atan(2 r/l) its centre is over the rim's lowest point."""
    lean = share * math.atan(0.3 / 0.25)
    axis = (-math.sin(away), math.cos(away), 0.0)
    height = 0.3 * math.sin(lean) + 0.25 * math.cos(lean)
    body = can(position=(0, 0, height), orientation=turned(axis, lean), material=Material(friction=1.0))
    found = simulate(
        Scene(bodies=(GROUND, body), gravity=DOWN),
        time_step=1.0 / 240.0,
        steps=360,
        observe={"x": Final(quantity=Position("can")), "energy": Trace(quantity=Energy())},
    )

    assert float(found["x"][2]) == pytest.approx(0.3 if falls else 0.25, abs=2e-3)
    assert np.diff(found["energy"]).max() < 0.05  # J of 6


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("turn", [0.5, 0.99, 1.1, 2.0, 7.0])
def test_a_wheel_rolls_on_however_far_it_turns_in_a_step(turn: float, solver: str) -> None:
    """Points of its rim before and behind the one that touches are no obstacles: at 1/60 s 18 m/s were one radian of a wheel."""
    wheel = can(
        position=(0.0, 0.0, 0.3),
        orientation=turned((1.0, 0.0, 0.0), math.pi / 2.0),
        velocity=(0.3 * turn / H, 0.0, 0.0),
        angular_velocity=(0.0, turn / H, 0.0),
    )
    result = simulate(
        Scene(bodies=(GROUND, wheel), gravity=DOWN),
        time_step=H,
        steps=60,
        method=Method(solver=solver),  # type: ignore[arg-type]
        observe={"v": Trace(quantity=Velocity("can")), "w": Trace(quantity=AngularVelocity("can"))},
    )
    assert result["v"] == pytest.approx(np.tile([0.3 * turn / H, 0.0, 0.0], (61, 1)), abs=1e-9 / H)
    assert H * result["w"] == pytest.approx(np.tile([0.0, turn, 0.0], (61, 1)), abs=1e-9)


@pytest.mark.parametrize("lean", [6.0, 20.0, 29.0, 60.0, 90.0])  # degrees
def test_a_leaning_disc_keeps_its_spin_on_a_smooth_floor(lean: float) -> None:
    """Two radians a step about its own axis, one of symmetry: its rim goes nowhere."""
    angle = math.radians(lean)
    axis = np.array([math.sin(angle), 0.0, math.cos(angle)])
    smooth = Material(friction=0.0)
    floor = RigidBody(
        name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=smooth
    )
    x, y, z = (2.0 / H * axis).tolist()
    disc = can(
        shape=Cylinder(0.1, 0.02),
        position=(0.0, 0.0, 0.1 * math.sin(angle) + 0.01 * math.cos(angle)),
        orientation=turned((0.0, 1.0, 0.0), angle),
        angular_velocity=(x, y, z),
        material=smooth,
    )
    observe = {"w": Final(quantity=AngularVelocity("can"))}
    spin = simulate(Scene(bodies=(floor, disc)), time_step=H, steps=1, observe=observe)["w"]
    assert H * spin == pytest.approx(2.0 * axis, abs=1e-9)


def test_a_can_on_a_soft_floor_leans_on_all_four_points_that_give() -> None:
    """Closed points between count at any lean: pressed off its middle it leans and does not roll over sideways."""
    soft = Material(friction=0.5, compliance=1e-3)
    floor = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=soft)
    press = Load(name="press", body="can", force=(0.0, 0.0, -100.0), torque=(0.0, 5.0, 0.0))
    result = simulate(
        Scene(bodies=(floor, can(material=soft)), forces=(press,), gravity=DOWN),
        time_step=H,
        duration=3.0,
        observe={"q": Final(quantity=Orientation("can")), "w": Final(quantity=AngularVelocity("can"))},
    )
    w, x, y, z = map(float, result["q"])
    lean = math.hypot(2.0 * (x * z + w * y), 2.0 * (y * z - w * x))
    assert 0.06 < lean < 0.2 and abs(2.0 * (y * z - w * x)) < 1e-6
    assert np.abs(result["w"]).max() < 1e-6


@pytest.mark.parametrize("lean", [0.006, 0.02, 0.048, 0.051, 0.07, 0.1, 0.2])
@pytest.mark.parametrize("load", [500.0, 2000.0])  # N
def test_a_leaning_coin_is_pressed_flat_by_a_heavy_load_beside_its_lean(load: float, lean: float) -> None:
    """The load acts 6 cm beside the middle, inside the square of its four points: it comes to lie flat and still, though the
    load's moment would turn it by radians in one step."""
    floor = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=ROUGH)
    coin = can(
        shape=Cylinder(0.1, 0.02),
        position=(0.0, 0.0, 0.1 * math.sin(lean) + 0.01 * math.cos(lean)),
        orientation=turned((0.0, 1.0, 0.0), lean),
    )
    press = Load(name="press", body="can", force=(0.0, 0.0, -load), torque=(0.06 * load, 0.0, 0.0))
    result = simulate(
        Scene(bodies=(floor, coin), forces=(press,), gravity=DOWN),
        time_step=H,
        steps=60,
        observe={"w": Trace(quantity=AngularVelocity("can")), "x": Final(quantity=Position("can"))},
    )
    assert np.abs(result["w"][3:]).max() < 1e-9
    assert float(result["x"][2]) == pytest.approx(0.01, abs=1e-9)


@pytest.mark.parametrize("along", [3.0, 30.0, 100.0])  # m/s² down the slope
def test_a_wheel_that_speeds_up_is_not_held_at_a_radian_a_step(along: float) -> None:
    """A solid cylinder rolls with two thirds of what pulls it along, through more than four radians a step."""
    press = 200.0  # m/s²: friction does not limit it
    steps = round(80.0 / along / H)
    wheel = can(
        shape=Cylinder(0.3, 0.2),
        position=(0.0, 0.0, 0.3),
        orientation=turned((1.0, 0.0, 0.0), math.pi / 2.0),
        material=ROUGH,
    )
    floor = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=ROUGH)
    result = simulate(
        Scene(bodies=(floor, wheel), gravity=(along, 0.0, -press)),
        time_step=H,
        steps=steps,
        observe={"v": Final(quantity=Velocity("can")), "w": Final(quantity=AngularVelocity("can"))},
    )
    speed = 2.0 / 3.0 * along * steps * H
    assert H * speed / 0.3 > 2.0
    assert result["v"] == pytest.approx([speed, 0.0, 0.0], abs=1e-9)
    assert result["w"] == pytest.approx([0.0, speed / 0.3, 0.0], abs=1e-8)


@pytest.mark.parametrize("lean", [6.0, 20.0, 45.0])  # degrees
def test_a_leaning_disc_that_is_spun_up_turns_through_its_points(lean: float) -> None:
    """A torque about its own axis, up to four radians a step on a smooth floor: nothing but the disc's spin changes."""
    angle = math.radians(lean)
    axis = np.array([math.sin(angle), 0.0, math.cos(angle)])
    smooth = Material(friction=0.0)
    floor = RigidBody(
        name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=smooth
    )
    disc = can(
        shape=Cylinder(0.1, 0.02),
        position=(0.0, 0.0, 0.1 * math.sin(angle) + 0.01 * math.cos(angle)),
        orientation=turned((0.0, 1.0, 0.0), angle),
        material=smooth,
    )
    moment = 4.0 / H / (20.0 * H) * 0.5 * 2.0 * 0.1**2  # to four radians a step in 20
    x, y, z = (moment * axis).tolist()
    spun = Load(name="spun", body="can", torque=(x, y, z))
    observe = {"w": Final(quantity=AngularVelocity("can"))}
    spin = simulate(Scene(bodies=(floor, disc), forces=(spun,)), time_step=H, steps=20, observe=observe)["w"]
    assert H * spin == pytest.approx(4.0 * axis, abs=1e-7)
