"""Joints that begin beyond their limits come back by position: momenta stay, kinetic energy is not gained."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularMomentum,
    AngularVelocity,
    Box,
    Energy,
    Hinge,
    JointCoordinate,
    JointSpring,
    KineticEnergy,
    Limit,
    Method,
    Momentum,
    Motor,
    Prismatic,
    RigidBody,
    Scene,
    Trace,
    simulate,
)

BEYOND = 0.2  # rad or m
WATCH = {
    "kinetic": Trace(quantity=KineticEnergy()),
    "energy": Trace(quantity=Energy()),
    "at": Trace(quantity=JointCoordinate("joint")),
    "p": Trace(quantity=Momentum()),
    "l": Trace(quantity=AngularMomentum()),
}


def pair(kind: type, lower: float, upper: float, speed: float) -> Scene:
    """Two bars, one hung to the other off its centre, that fly and spin about the joint's axis."""
    bodies = tuple(
        RigidBody(
            name=name,
            mass=mass,
            shape=Box((0.1, 0.2, 1.0)),
            position=(0.0, 0.0, z),
            velocity=(0.3 * speed, 0.0, 0.0),
            angular_velocity=(0.0, speed if kind is Hinge else 0.0, 0.0),
        )
        for name, mass, z in (("first", 2.0, 0.0), ("second", 1.0, 0.0))
    )
    joint = kind(
        name="joint",
        between=("first", "second"),
        at=(0.0, 0.0, 0.4),
        axis=(0.0, 1.0, 0.0),
        limit=Limit(lower=lower, upper=upper),
    )
    return Scene(bodies=bodies, constraints=(joint,))


@pytest.mark.parametrize("time_step", [1e-6, 1e-4, 1 / 60])
@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("kind", [Hinge, Prismatic])
@pytest.mark.parametrize("ends", [(BEYOND, 1.0), (-1.0, -BEYOND)])
def test_a_joint_beyond_its_limit_comes_back_without_energy(
    kind: type, ends: tuple[float, float], solver: str, time_step: float
) -> None:
    """.2 rad beyond a stop at h = 1e-6 s was answered with 9e4 rad/s: 1.2 MJ out of nothing."""
    for speed in (0.0, 1.0):
        result = simulate(
            pair(kind, *ends, speed),
            time_step=time_step,
            steps=40,
            method=Method(solver=solver),
            observe=WATCH,
        )
        at, kinetic = result["at"], result["kinetic"]

        assert at[0] == 0.0
        assert ends[0] - 1e-6 < at[-1] < ends[1] + 1e-6
        assert kinetic.max() <= kinetic[0] * (1 + 1e-9) + 1e-18  # 1e-16 rad over 1e-6 s is 1e-10 rad/s
        assert np.abs(result["p"] - result["p"][0]).max() < 1e-11
        assert np.abs(result["l"] - result["l"][0]).max() < 1e-11


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
        observe={
            "angle": Trace(quantity=JointCoordinate("hinge")),
            "w": Trace(quantity=AngularVelocity("b")),
        },
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
