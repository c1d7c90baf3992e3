"""What joints carry, impacts included; joints and wires that break under more than their strength, and dry friction in a joint."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Ball,
    ConstraintForce,
    Final,
    Hinge,
    JointSpring,
    Limit,
    Load,
    Lock,
    Material,
    Method,
    Motor,
    Particle,
    Plane,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    Wire,
    simulate,
    start,
)
from tests.scenes.corpus import fixed, solid
from tests.scenes.coupling import H, Z, hung


@pytest.mark.parametrize(
    ("strength", "breaks_at"), [({"strength": 30.0}, 1.0), ({"torque_strength": 5.0}, 0.5), ({}, None)]
)
@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_a_joint_breaks_under_more_than_its_strength_and_holds_nothing_then(
    strength: Any, breaks_at: float | None, solver: Any
) -> None:
    observe = {"f": Trace(quantity=ConstraintForce("lock")), "v": Trace(quantity=Velocity("body"))}
    method = Method(solver=solver, iterations=200, residual_tolerance=1e-14)
    result = simulate(hung(**strength), time_step=H, steps=150, method=method, observe=observe)
    held = 20.0 + 10.0 * H * np.arange(150)  # N, in each step: the load is taken at its beginning
    if breaks_at is None:
        np.testing.assert_allclose(result["f"][1:, 2], held, rtol=1e-9)
        return
    last = int(np.flatnonzero(result["f"][:, 2])[-1])  # the load it broke at is the last it shows
    np.testing.assert_allclose(result["f"][1 : last + 1, 2], held[:last], rtol=1e-9)
    assert (last - 1) * H == pytest.approx(breaks_at + H, abs=1e-9)
    assert not result["f"][last + 1 :].any()
    falls = np.diff(result["v"][last:, 2])
    np.testing.assert_allclose(falls, -H * held[last:] / 2.0, rtol=1e-9)


JOINTS: dict[str, Any] = {
    "lock": Lock(name="neck", between=("foot", "head")),
    "ball": Ball(name="neck", between=("foot", "head"), at=(0.3, 0.0, 0.4)),
    "slide": Prismatic(
        name="neck",
        between=("foot", "head"),
        armature=0.7,
        spring=JointSpring(stiffness=200.0),
        limit=Limit(lower=-0.002, upper=0.002, restitution=0.6),
    ),
}


def thrown_down(joint: Any, restitution: float) -> Scene:
    """A ball that soon meets a floor, with a body above it that touches nothing."""
    surface = Material(friction=0.4, restitution=restitution)
    fall = (0.5, 0.0, -3.0)
    foot = solid("foot", Sphere(0.1), (0.0, 0.0, 0.2), velocity=fall, material=surface)
    head = RigidBody(name="head", mass=2.0, position=(0.3, 0.1, 0.8), velocity=fall, inertia=(0.2, 0.2, 0.1))
    floor = fixed("floor", Plane(), (0.0, 0.0, 0.0), material=surface)
    return Scene(bodies=(foot, head, floor), constraints=(joint,), gravity=(0.0, 0.0, -10.0))


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("kind", JOINTS)
def test_a_joint_shows_what_changes_the_momentum_in_impacts_too(
    kind: str, restitution: float, solver: Any
) -> None:
    scene = thrown_down(JOINTS[kind], restitution)
    observe = {"f": Trace(quantity=ConstraintForce("neck")), "v": Trace(quantity=Velocity("head"))}
    method = Method(solver=solver, iterations=2000, residual_tolerance=1e-13)
    run = simulate(scene, time_step=H, steps=30, method=method, observe=observe)
    needed = 2.0 * np.diff(run["v"], axis=0) / H - (0.0, 0.0, -20.0)
    assert np.abs(needed).max() > 100.0
    np.testing.assert_allclose(run["f"][1:, :3], needed, rtol=0.0, atol=1e-9 * np.abs(needed).max())


@pytest.mark.parametrize("push", [1e4, 500.0])
def test_a_motor_between_stops_shows_what_both_stops_carry(push: float) -> None:
    """It is driven to one, comes back by half, and is driven there again: some steps meet both ends."""
    limit = Limit(lower=-0.02, upper=0.0, restitution=0.5)
    motor = Motor(speed=-1.39, max_force=push)
    body = RigidBody(name="body", mass=4.5, inertia=(1.0,) * 3, position=(0.0,) * 3, velocity=(1.6, 0.0, 0.0))
    slide = Prismatic(name="slide", between=(WORLD, "body"), axis=(1.0, 0.0, 0.0), limit=limit, motor=motor)
    observe = {"f": Trace(quantity=ConstraintForce("slide")), "v": Trace(quantity=Velocity("body"))}
    run = simulate(Scene(bodies=(body,), constraints=(slide,)), time_step=0.01, steps=30, observe=observe)
    needed = 4.5 * np.diff(run["v"][:, 0]) / 0.01
    np.testing.assert_allclose(run["f"][1:, 0], needed, rtol=0.0, atol=1e-9 * np.abs(needed).max())


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize(("strength", "breaks"), [(0.9, True), (1.1, False)])
def test_a_blow_breaks_what_is_too_weak_for_it_whether_it_rebounds_or_not(
    restitution: float, strength: float, breaks: bool
) -> None:
    """The lock has to stop 2 kg at 3 m/s within a step, and to send them back."""
    foot = solid(
        "foot",
        Sphere(0.1),
        (0.0, 0.0, 0.1),
        velocity=(0.0, 0.0, -3.0),
        material=Material(restitution=restitution),
    )
    head = solid("head", None, (0.0, 0.0, 0.8), 2.0, (0.0, 0.0, -3.0), inertia=(0.2, 0.2, 0.1))
    floor = RigidBody(name="floor", position=(0.0, 0.0, 0.0), shape=Plane(), motion="static")
    blow = 2.0 * 3.0 * (1.0 + restitution) / H  # N
    neck = Lock(name="neck", between=("foot", "head"), compliance=0.0, strength=strength * blow)
    scene = Scene(bodies=(foot, head, floor), constraints=(neck,))
    result = simulate(scene, time_step=H, steps=5)
    assert [at.force for at in result.broken] == ([pytest.approx(blow)] if breaks else [])


def test_a_wire_breaks_and_what_is_saved_before_is_whole_again() -> None:
    stone = Particle(name="stone", mass=2.0, position=(0.0, 0.0, 0.0))
    wire = Wire(name="wire", through=((WORLD, (0.0, 0.0, 1.0)), ("stone", (0.0, 0.0, 0.0))), strength=25.0)
    more = Load(name="more", body="stone")
    scene = Scene(bodies=(stone,), constraints=(wire,), forces=(more,), gravity=(0.0, 0.0, -10.0))
    with start(scene, time_step=H, observe={"pull": ConstraintForce("wire")}) as run:
        run.step(10)
        saved = run.save()
        run.set_load("more", force=(0.0, 0.0, -6.0))
        run.step(2)
        assert float(run["pull"]) == 0.0
        run.restore(saved)
        run.step(100)
        assert float(run["pull"]) == pytest.approx(20.0, rel=1e-6)


def test_a_motor_that_wants_to_stand_is_dry_friction() -> None:
    """3 rad/s against 0.5 N m on 2 kg m²: 12 s of even slowing down, then rest; no more torque than what acts."""
    wheel = solid("wheel", None, (0.0, 0.0, 0.0), spin=(0.0, 0.0, 3.0), inertia=(2.0, 2.0, 2.0))
    rubbing = Hinge(name="axle", between=(WORLD, "wheel"), axis=Z, motor=Motor(speed=0.0, max_force=0.5))
    push = Load(name="push", body="wheel", torque=(0.0, 0.0, 0.1))
    observe = {"w": Trace(quantity=AngularVelocity("wheel")), "f": Final(quantity=ConstraintForce("axle"))}
    result = simulate(
        Scene(bodies=(wheel,), constraints=(rubbing,), forces=(push,)),
        time_step=H,
        steps=1600,
        observe=observe,
    )
    times = H * np.arange(1601)

    np.testing.assert_allclose(result["w"][:, 2], np.maximum(0.0, 3.0 - 0.2 * times), rtol=0, atol=1e-10)
    assert result["f"][5] == pytest.approx(-0.1, rel=1e-9)
