"""Joints that begin beyond their limits come back by position: momenta stay, kinetic energy is not gained."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Box,
    Energy,
    Hinge,
    JointCoordinate,
    JointSpring,
    KineticEnergy,
    Limit,
    Method,
    Motor,
    RigidBody,
    Scene,
    simulate,
)
from tests.scenes.seen import traces

BEYOND = 0.2  # rad or m
WATCH = traces(kinetic=KineticEnergy(), energy=Energy(), at=JointCoordinate("joint"))


def test_a_stop_holds_while_its_joint_comes_back() -> None:
    """A weight that pushes further beyond its stop does not get there: only what the scene gave is no violation. It is
    lifted to its stop, and gains that height's energy and no other."""
    arm = RigidBody(name="arm", mass=1.0, shape=Box((1.0, 0.1, 0.1)), position=(0.5, 0.0, 0.0))
    hinge = Hinge(
        name="joint",
        between=(WORLD, "arm"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, 1.0, 0.0),
        limit=Limit(lower=-1.0, upper=-BEYOND),
    )
    result = simulate(
        Scene(bodies=(arm,), constraints=(hinge,), gravity=(0.0, 0.0, -9.81)),
        time_step=1e-3,
        steps=100,
        observe=WATCH,
    )

    assert result["at"].max() < 1e-6
    assert result["at"][-1] == pytest.approx(-BEYOND, abs=1e-5)
    assert result["kinetic"].max() < 1e-6
    lift = 1.0 * 9.81 * 0.5 * np.sin(BEYOND)  # J
    assert result["energy"].max() - result["energy"][0] == pytest.approx(lift, rel=1e-4)


@pytest.mark.parametrize("rate", [60, 240, 1000])
@pytest.mark.parametrize(
    ("speed", "upper"), [(2.0, 0.3), (7.18, 0.35), (13.8, 0.554), (17.6, 0.16), (40.0, 1.2)]
)
def test_a_stop_without_restitution_is_met_where_it_is(rate: int, speed: float, upper: float) -> None:
    """Asked for the gap, a step turns by the gap: not past the stop, and nothing comes back."""
    h = 1.0 / rate
    body = RigidBody(
        name="b", mass=1.0, inertia=(0.05,) * 3, position=(0, 0, 0), angular_velocity=(0.0, 0.0, speed)
    )
    hinge = Hinge(
        name="hinge",
        between=(WORLD, "b"),
        at=(0, 0, 0),
        limit=Limit(lower=-3.0, upper=upper, restitution=0.0, compliance=0.0),
        compliance=0.0,
    )
    gap, free = upper, 0  # rad before the step that meets the stop; steps before it
    while gap >= h * speed:
        gap, free = gap - h * speed, free + 1
    result = simulate(
        Scene(bodies=(body,), constraints=(hinge,)),
        time_step=h,
        steps=free + 2,
        observe=traces(angle=JointCoordinate("hinge"), w=AngularVelocity("b")),
    )

    assert result["angle"].ravel()[free + 1] == pytest.approx(upper, abs=1e-12)
    assert abs(result["w"][free + 2, 2]) < 1e-9 * speed


@pytest.mark.parametrize("end", [1e3, 1e6, 1e9, 1e15, 1e300])
@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize(
    "drives",
    [
        {"motor": Motor(speed=0.2, max_force=1.0), "spring": JointSpring(stiffness=30.0, rest=0.2)},
        {"motor": Motor(speed=0.2, max_force=1.0), "friction": 0.1},
        {"spring": JointSpring(stiffness=30.0, rest=0.2), "friction": 0.1},
    ],
)
def test_a_limit_too_far_to_matter_does_not_matter(drives: Any, solver: Any, end: float) -> None:
    """What stands for no limit at all was taken for the size of the speeds: at 1e9 rad a spring pulled no more."""
    arm = RigidBody(name="arm", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.0))
    free = Hinge(name="joint", between=(WORLD, "arm"), at=(0.0, 0.0, 0.3), axis=(0.0, 1.0, 0.0), **drives)
    held = replace(free, limit=Limit(lower=-end, upper=end))
    found = [
        simulate(
            Scene(bodies=(arm,), constraints=(joint,), gravity=(1.0, 0.0, -9.81)),
            time_step=0.005,
            steps=20,
            method=Method(solver=solver, residual_tolerance=1e-13),
            observe=WATCH,
        )["at"]
        for joint in (free, held)
    ]
    np.testing.assert_allclose(found[1], found[0], rtol=0.0, atol=1e-9)
