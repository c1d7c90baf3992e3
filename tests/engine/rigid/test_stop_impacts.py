"""Stops of joints that are hit while bodies touch, here and elsewhere: each its own restitution, and no energy is gained."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Box,
    Final,
    Hinge,
    JointCoordinate,
    KineticEnergy,
    Limit,
    Load,
    Material,
    Maximum,
    Method,
    Penetration,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.engine.contacts.test_rough_impacts import SOLVERS, STEPS, ball, floor
from tests.scenes.corpus import solid


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("psi", [0.0, 0.5, 1.0])
def test_a_stop_returns_its_own_restitution(h: float, psi: float) -> None:
    """A bar turning freely at 2 rad/s meets the stop of its hinge at .5 rad."""
    bar = solid("bar", Box((1.0, 0.1, 0.1)), (0.5, 0, 0), velocity=(0, 1.0, 0), spin=(0, 0, 2.0))
    hinge = Hinge(
        name="hinge",
        between=(WORLD, "bar"),
        at=(0, 0, 0),
        axis=(0, 0, 1),
        compliance=0.0,
        limit=Limit(lower=-9.0, upper=0.5, compliance=0.0, restitution=psi),
    )
    result = simulate(
        Scene(bodies=(bar,), constraints=(hinge,)),
        time_step=h,
        duration=0.5,
        observe={"w": Trace(quantity=AngularVelocity("bar"))},
    )

    speed = result["w"][:, 2]
    hit = int(np.argmax(speed < 0.5 * speed[0]))
    met = speed[hit - 1]

    if psi > 0.0:
        assert speed[hit] == pytest.approx(-psi * met, abs=1e-6)
    # Without restitution the gap may close within the step: what is left of the speed then ends in the next.
    assert np.abs(speed[hit + 2 :] + psi * met).max() < (0.02 if psi > 0.0 else 1e-6)


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", [Hinge, Prismatic])
@pytest.mark.parametrize("phase", [-0.5, 0.0, 0.5])
def test_a_stop_knows_of_no_impact_far_away(kind: type, phase: float, solver: str, h: float) -> None:
    """A ball that rebounds 50 m away in the very step took all of the stop's rebound: rows were assembled again after it,
    and the stop seemed closed long since; in the blow it took part as one without restitution."""
    turns, speed, elastic = kind is Hinge, 2.0, Material(restitution=1.0)
    body = solid(
        "body",
        Box((1.0, 0.1, 0.1)),
        (0.0, 0.0, 5.0),
        velocity=(0.0, 0.0 if turns else speed, 0.0),
        spin=(0.0, 0.0, speed if turns else 0.0),
    )
    joint = kind(
        name="joint",
        between=(WORLD, "body"),
        at=(0.0, 0.0, 5.0),
        axis=(0.0, 0.0, 1.0) if turns else (0.0, 1.0, 0.0),
        compliance=0.0,
        limit=Limit(lower=-9.0, upper=0.5, compliance=0.0, restitution=0.5),
    )
    far = ball("far", (50.0, 0.0, 0.6 + phase * speed * h), (0.0, 0.0, -speed), material=elastic)
    result = simulate(
        Scene(bodies=(body, floor(elastic), far), constraints=(joint,)),
        time_step=h,
        duration=0.4,
        method=Method(solver=solver),
        observe={"v": Final(quantity=Velocity()), "w": Final(quantity=AngularVelocity("body"))},
    )

    assert (result["w"][2] if turns else result["v"][0, 1]) == pytest.approx(-0.5 * speed, rel=1e-9)
    assert result["v"][2, 2] == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("shape", [Sphere(0.1), Box((0.2, 0.2, 0.2))], ids=["balls", "boxes"])
@pytest.mark.parametrize("gap", [1e-4, 0.003, 0.1])
@pytest.mark.parametrize(("psi", "after"), [(1.0, (1.0, 3.0)), (0.0, (1.0, 1.0))])
def test_what_comes_back_from_a_stop_meets_what_follows(
    psi: float, after: tuple[float, float], gap: float, shape: Sphere | Box, solver: str, h: float
) -> None:
    """A slider at 3 m/s comes back from its stop and meets its like, which follows at 1 m/s. psi = 1: they exchange -1 and
    3, and the stop sends the slider back once more, in one step if impacts are successive; psi = 0: both go on with 1. The
    rebound was asked of the stop however hard the other pressed: at psi = 0 both left with up to 1.997."""
    bounces = Material(restitution=psi)
    slider = ball("slider", (0.0, 0.0, 0.0), (-3.0, 0.0, 0.0), shape=shape, material=bounces)
    follower = ball("follower", (0.2 + gap, 0.0, 0.0), (-1.0, 0.0, 0.0), shape=shape, material=bounces)
    guide = Prismatic(
        name="guide",
        between=(WORLD, "slider"),
        axis=(1.0, 0.0, 0.0),
        compliance=0.0,
        limit=Limit(lower=-0.06, upper=9.0, compliance=0.0, restitution=1.0),
    )
    result = simulate(
        Scene(bodies=(slider, follower), constraints=(guide,)),
        time_step=h,
        duration=0.5,
        method=Method(solver=solver, impacts="successive" if psi > 0.0 else "simultaneous"),
        observe={
            "v": Final(quantity=Velocity()),
            "x": Trace(quantity=Position("slider")),
            "deep": Maximum(quantity=Penetration()),
            "energy": Trace(quantity=KineticEnergy()),
        },
    )

    assert result.completed
    assert result["v"][:, 0] == pytest.approx(after, rel=1e-9)
    assert np.diff(result["energy"]).max() <= 1e-12 * result["energy"][0]
    assert result["x"][:, 0].min() >= -0.06 - 1e-9
    assert float(result["deep"]) < 1e-9


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("psi", [0.3, 1.0])
def test_what_is_stopped_without_rebound_is_met_by_what_follows(psi: float, solver: str, h: float) -> None:
    """A slider at 3 m/s ends at its stop 1.3 steps after the start; at 1.7 steps its follower, at 2.5 m/s, meets it there
    and rebounds from both. They did not see each other, and overlapped by what the follower goes in half a step."""
    bounces = Material(restitution=psi)
    slider = ball("slider", (0.0, 0.0, 0.0), (-3.0, 0.0, 0.0), material=bounces)
    follower = ball("follower", (0.2 + 0.35 * h, 0.0, 0.0), (-2.5, 0.0, 0.0), material=bounces)
    guide = Prismatic(
        name="guide",
        between=(WORLD, "slider"),
        axis=(1.0, 0.0, 0.0),
        compliance=0.0,
        limit=Limit(lower=-3.9 * h, upper=9.0, compliance=0.0),
    )
    result = simulate(
        Scene(bodies=(slider, follower), constraints=(guide,)),
        time_step=h,
        steps=5,
        method=Method(solver=solver),
        observe={"v": Trace(quantity=Velocity()), "deep": Maximum(quantity=Penetration())},
    )

    assert float(result["deep"]) < 1e-9
    np.testing.assert_allclose(result["v"][-1, :, 0], (0.0, 2.5 * psi), atol=1e-9)


@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", [Hinge, Prismatic])
@pytest.mark.parametrize("carried", [0.0, 2.0])
@pytest.mark.parametrize("compliance", [0.0, 1e-4])
def test_a_stop_met_from_the_other_end_is_the_stop_met_from_afar(
    compliance: float, carried: float, kind: type, solver: str, h: float
) -> None:
    """What a step leads from beside one end past the other does what it does where there is no first end: with the stop's
    own compliance, and on a carrier that moves as it is told."""
    turns = kind is Hinge
    ends = []
    for lower in (-9.0, -1e-3):
        load = Load(
            name="load",
            body="slider",
            force=(0.0 if turns else 5.0 / h, 0.0, 0.0),
            torque=(5.0 / h if turns else 0.0, 0.0, 0.0),
        )
        told = {"angular_velocity" if turns else "velocity": (carried, 0.0, 0.0)}
        carrier = RigidBody(name="carrier", motion="kinematic", position=(0.0, 0.0, 0.0), **told)
        slider = solid(
            "slider",
            None,
            (0.0, 0.0, 0.0),
            velocity=carrier.velocity,
            spin=carrier.angular_velocity,
            inertia=(1.0, 1.0, 1.0),
        )
        joint = kind(
            name="joint",
            between=("carrier", "slider"),
            axis=(1.0, 0.0, 0.0),
            compliance=0.0,
            limit=Limit(lower=lower, upper=3e-3, compliance=compliance),
        )
        result = simulate(
            Scene(bodies=(carrier, slider), constraints=(joint,), forces=(load,)),
            time_step=h,
            steps=8,
            method=Method(solver=solver),
            observe={"at": Trace(quantity=JointCoordinate("joint"))},
        )
        ends.append(result["at"])

    assert ends[0][1] > 2.9e-3
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-9, atol=1e-12)
