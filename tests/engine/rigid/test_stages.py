"""What a rigid scene leaves out, what forcing it in changes (nothing), and how a rigid run says it failed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Distance,
    Final,
    Hinge,
    Method,
    Particle,
    Position,
    RigidBody,
    Scene,
    simulate,
)
from spook_tracker.scalar_tests.vehicles import cornering

TIME_STEP = 1.0 / 60.0
GRAVITY = (0.0, 0.0, -9.81)


def body(name: str = "body", **changes: object) -> RigidBody:
    return RigidBody(
        name=name, **{"mass": 1.0, "inertia": (1.0, 1.5, 2.0), "position": (0.0, 0.0, 0.0)} | changes
    )  # type: ignore[arg-type]


def hinge(name: str, **changes: object) -> Hinge:
    return Hinge(name=name, between=(WORLD, "body"), compliance=0.0, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("stages", [("collision",), ("rotation",), ("collision", "rotation")])
@pytest.mark.parametrize(
    "method",
    [PLAIN, Method(half_step_velocities=True), Method(corrections=2)],
    ids=["plain", "half-step", "curved"],
)
def test_forcing_a_stage_in_changes_the_work_and_not_the_motion(
    stages: tuple[str, ...], method: Method
) -> None:
    pendulum = Scene(
        bodies=(Particle(name="bob", mass=1.0, position=(1.0, 0.0, 0.0)),),
        constraints=(Distance(name="rod", between=((0.0, 0.0, 0.0), "bob")),),
        gravity=GRAVITY,
    )
    observe = {"x": Final(quantity=Position("bob"))}
    plain = simulate(pendulum, time_step=TIME_STEP, steps=300, observe=observe, method=method)

    forced = simulate(
        pendulum, time_step=TIME_STEP, steps=300, observe=observe, method=replace(method, force_stages=stages)
    )

    assert ("collision" in forced.stages) == ("collision" in stages)
    assert ("integrate_rotations" in forced.stages) == ("rotation" in stages)
    np.testing.assert_allclose(forced["x"], plain["x"], rtol=0.0, atol=1e-12)


def test_a_loaded_wheel_may_turn_by_more_than_a_radian_a_step() -> None:
    """At 20 m/s and 1/20 s a wheel turns by 3.3 rad a step; its axle goes through its middle and pulls at nothing."""
    result = simulate(cornering.scene(20.0, steer=0.0), time_step=1 / 20, steps=10)

    assert result.completed
    assert "tension" not in result.failure


def test_rows_that_cannot_hold_together_are_named_and_a_compliance_lets_them() -> None:
    def scene(compliance: float) -> Scene:
        # The rods ask for 1 m and 1.1 m between the same two points.
        rods = tuple(
            Distance(
                name=f"rod {length}",
                between=((0.0, 0.0, 1.0), "body"),
                rest_length=length,
                compliance=compliance,
            )
            for length in (1.0, 1.1)
        )
        return Scene(bodies=(body(),), constraints=rods)

    rigid = simulate(scene(0.0), time_step=TIME_STEP, steps=10)
    soft = simulate(
        scene(1e-6), time_step=TIME_STEP, steps=600, observe={"x": Final(quantity=Position("body"))}
    )

    assert (rigid.status, rigid.failed_body) == ("diverged", "body")
    assert "contradict each other" in rigid.failure
    assert soft["x"][2] == pytest.approx(-0.05, abs=1e-6)


def test_a_singular_system_without_a_floor_is_reported() -> None:
    scene = Scene(bodies=(body(),), constraints=(hinge("one"), hinge("two")), gravity=GRAVITY)

    result = simulate(scene, time_step=TIME_STEP, steps=10, method=Method(floor=0.0))

    assert result.status == "not_finite"
    assert "cannot be solved" in result.failure
