"""Rapier behind the protocol: what it has it does to single precision. Skipped, with the reason, without it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Ball,
    Box,
    Capsule,
    Cone,
    ContactForce,
    Distance,
    Final,
    Hinge,
    Lock,
    Material,
    Particle,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Trace,
)
from spook_tracker.engine.find import EngineMissing, find
from spook_tracker.engine.protocol import NotSupported

try:
    RAPIER = find("rapier")
except EngineMissing as reason:
    pytest.skip(str(reason), allow_module_level=True)

STEP = 1.0 / 60.0  # s
GRAVITY = (0.0, 0.0, -9.81)


def fallen(time_step: float) -> float:
    """How far a fall of 20 s is from the closed form."""
    ball = Particle(name="ball", mass=2.0, position=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(ball,), gravity=GRAVITY)
    end = {"end": Final(quantity=Position("ball"))}
    run = RAPIER.simulate(scene, time_step=time_step, duration=20.0, observe=end, configuration="defaults")
    return abs(float(run["end"][2]) + 0.5 * 9.81 * 400.0)


def test_a_smaller_step_stops_helping_where_single_precision_does() -> None:
    """A first-order step in double precision is g T h / 2 away: 0.02 m at 1/4000 s, and it always shrinks with h."""
    in_double = 0.5 * 9.81 * 20.0 / 4000.0

    assert fallen(1 / 60) < 2.0
    assert fallen(1 / 4000) > 4.0 * in_double


@pytest.mark.parametrize("kind", [Ball, Hinge, Lock])
def test_a_joint_holds_a_hanging_box(kind: Any) -> None:
    box = RigidBody(name="box", mass=2.0, shape=Box((0.2, 0.2, 0.2)), position=(0.0, 0.0, -1.0))
    more = {"axis": (0.0, 1.0, 0.0)} if kind is Hinge else {}
    joint = kind(name="joint", between=("world", "box"), at=(0.0, 0.0, 0.0), **more)
    scene = Scene(bodies=(box,), constraints=(joint,), gravity=GRAVITY)
    path = {"path": Trace(quantity=Position("box"))}
    run = RAPIER.simulate(scene, time_step=STEP, duration=2.0, observe=path)

    assert np.abs(run["path"] - [0.0, 0.0, -1.0]).max() < 1e-3


def test_a_hinged_box_swings_with_its_period() -> None:
    """Small swings about a hinge 1 m above the centre: 2 π √((I + m L²) / (m g L))."""
    mass, inertia, length, angle = 2.0, 0.5, 1.0, 0.02
    box = RigidBody(
        name="box",
        mass=mass,
        inertia=(inertia, inertia, inertia),
        position=(length * math.sin(angle), 0.0, -length * math.cos(angle)),
    )
    hinge = Hinge(name="hinge", between=("world", "box"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    period = 2.0 * math.pi * math.sqrt((inertia + mass * length**2) / (mass * 9.81 * length))
    run = RAPIER.simulate(
        Scene(bodies=(box,), constraints=(hinge,), gravity=GRAVITY),
        time_step=1 / 1000,
        duration=0.75 * period,
        observe={"path": Trace(quantity=Position("box"))},
    )
    sideways = run["path"][:, 0]
    crossings = np.flatnonzero(np.sign(sideways[1:]) != np.sign(sideways[:-1]))

    assert crossings[0] / 1000 == pytest.approx(period / 4.0, rel=2e-2)
    assert np.abs(np.linalg.norm(run["path"], axis=1) - length).max() < 1e-3


def test_friction_holds_below_its_coefficient_and_not_above() -> None:
    rough = Material(friction=0.5)

    def slid(pull: float) -> float:
        ground = RigidBody(
            name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough
        )
        box = RigidBody(
            name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, 0.5), material=rough
        )
        scene = Scene(bodies=(ground, box), gravity=(pull * 9.81, 0.0, -9.81))
        end = {"end": Final(quantity=Position("box"))}
        return float(RAPIER.simulate(scene, time_step=STEP, duration=2.0, observe=end)["end"][0])

    assert abs(slid(0.3)) < 0.02
    assert slid(0.7) == pytest.approx(0.5 * 0.2 * 9.81 * 4.0, rel=0.1)


def test_what_it_lacks_is_not_supported_by_name() -> None:
    ball = Particle(name="ball", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "ball"), compliance=0.0)
    with pytest.raises(NotSupported, match=r"many-iterations. does not support the joint distance"):
        RAPIER.simulate(Scene(bodies=(ball,), constraints=(rod,), gravity=GRAVITY), time_step=STEP, steps=1)


def lying(friction: float) -> Scene:
    """Two balls of 1 kg and 3 kg on a plane; the plane comes last among the bodies."""
    surface = Material(friction=friction)
    balls = (
        RigidBody(
            name=f"ball {i}", mass=mass, shape=Sphere(0.5), position=(2.0 * i, 0.0, 0.5), material=surface
        )
        for i, mass in enumerate((1.0, 3.0))
    )
    plane = RigidBody(
        name="plane", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=surface
    )
    return Scene(bodies=(*balls, plane), gravity=GRAVITY)


def test_the_force_of_a_contact_is_told_of_either_body_and_of_every_step() -> None:
    observe = {
        "up": Trace(quantity=ContactForce("ball 1", "plane")),
        "down": Final(quantity=ContactForce("plane", "ball 1")),
        "light": Final(quantity=ContactForce("ball 0")),
        "between": Final(quantity=ContactForce("ball 0", "ball 1")),
    }
    run = RAPIER.simulate(lying(0.0), time_step=STEP, duration=2.0, observe=observe)

    assert run["up"][-1] == pytest.approx([0.0, 0.0, 3.0 * 9.81], rel=1e-4)
    assert run["up"][0] == pytest.approx([0.0, 0.0, 0.0]), "before the first step"
    assert run["down"] == pytest.approx(-run["up"][-1])
    assert run["light"] == pytest.approx([0.0, 0.0, 9.81], rel=1e-4)
    assert run["between"] == pytest.approx([0.0, 0.0, 0.0])


def test_what_only_its_adapter_cannot_ask_is_said_so() -> None:
    """Rapier has cones, and its package tells nothing of a contact's friction."""
    log = RigidBody(name="log", mass=1.0, shape=Cone(0.5, 1.0), position=(0.0, 0.0, 0.5))
    plane = RigidBody(name="plane", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    asked = {"f": Final(quantity=ContactForce("ball 0"))}

    with pytest.raises(NotSupported, match=r"^our adapter cannot ask rapier for the shape cone$"):
        RAPIER.simulate(Scene(bodies=(log, plane), gravity=GRAVITY), time_step=STEP, steps=1)
    with pytest.raises(NotSupported, match="rapier does not support a contact force with friction"):
        RAPIER.simulate(lying(0.5), time_step=STEP, steps=1, observe=asked)


def test_a_ball_bounces_by_the_larger_of_two_restitutions() -> None:
    """From 1 m, half a step's fall g h²/2 or a step's speed off at each end."""
    dull, bouncy = Material(restitution=0.2), Material(restitution=0.5)
    ball = RigidBody(name="ball", mass=1.0, shape=Sphere(0.1), position=(0.0, 0.0, 1.1), material=bouncy)
    plane = RigidBody(name="plane", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=dull)
    path = {"path": Trace(quantity=Position("ball"))}
    run = RAPIER.simulate(
        Scene(bodies=(ball, plane), gravity=GRAVITY), time_step=1e-3, duration=0.8, observe=path
    )
    heights = run["path"][:, 2] - 0.1
    met = int(np.argmin(heights[:500]))

    assert heights[met:].max() == pytest.approx(0.25, rel=0.03)


def test_a_capsule_lies_along_its_own_axis() -> None:
    """Upright it stands on its cap, half its length and a radius high; its axis is z, as ours is."""
    upright = RigidBody(name="log", mass=1.0, shape=Capsule(0.2, 1.0), position=(0.0, 0.0, 0.72))
    plane = RigidBody(name="plane", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    end = {"end": Final(quantity=Position("log"))}
    run = RAPIER.simulate(
        Scene(bodies=(upright, plane), gravity=GRAVITY), time_step=STEP, steps=30, observe=end
    )

    assert float(run["end"][2]) == pytest.approx(0.7, abs=2e-3)


def test_a_slide_lets_a_body_fall_along_it_and_nowhere_else() -> None:
    """Down a rail of 30°: half of gravity along it."""
    down = (math.cos(math.radians(30.0)), 0.0, -0.5)
    box = RigidBody(name="box", mass=2.0, shape=Box((0.2, 0.2, 0.2)), position=(0.0, 0.0, 0.0))
    rail = Prismatic(name="rail", between=("world", "box"), at=(0.0, 0.0, 0.0), axis=down)
    end = {"end": Final(quantity=Position("box"))}
    run = RAPIER.simulate(
        Scene(bodies=(box,), constraints=(rail,), gravity=GRAVITY), time_step=1e-3, duration=1.0, observe=end
    )

    assert run["end"] == pytest.approx(0.25 * 9.81 * np.array(down), abs=0.01)


def test_a_belt_carries_what_lies_on_it_by_the_geometric_mean_of_frictions() -> None:
    """µ = √(0.9 · 0.1) = 0.3 on a platform at 2 m/s: the box slips for 2 / (µ g) s and is 2 t − µ g t²/2 behind."""
    belt = RigidBody(
        name="belt", motion="kinematic", shape=Box((50.0, 2.0, 1.0)), position=(0.0, 0.0, -0.5),
        velocity=(2.0, 0.0, 0.0), material=Material(friction=0.9),
    )  # fmt: skip
    box = RigidBody(
        name="box",
        mass=1.0,
        shape=Box((0.5, 0.5, 0.5)),
        position=(0.0, 0.0, 0.25),
        material=Material(friction=0.1),
    )
    observe = {"x": Final(quantity=Position("box")), "belt": Final(quantity=Position("belt"))}
    run = RAPIER.simulate(
        Scene(bodies=(belt, box), gravity=GRAVITY), time_step=STEP, duration=2.0, observe=observe
    )
    slipping = 2.0 / (0.3 * 9.81)

    assert float(run["belt"][0]) == pytest.approx(4.0, rel=1e-3)
    assert float(run["x"][0]) == pytest.approx(4.0 - slipping, rel=1e-3)


def test_what_is_faster_than_its_bound_is_not_supported() -> None:
    def end(speed: float) -> Any:
        ball = Particle(name="ball", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(speed, 0.0, 0.0))
        seen = {"x": Final(quantity=Position("ball"))}
        return RAPIER.simulate(Scene(bodies=(ball,)), time_step=STEP, steps=60, observe=seen)["x"][0]

    assert end(390.0) == pytest.approx(390.0, rel=1e-3)
    with pytest.raises(NotSupported, match=r"speeds of 399\.99 m/s and more"):
        end(600.0)
