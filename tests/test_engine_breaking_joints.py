"""Joints and wires that break under more than their strength, and dry friction in a joint."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    ConstraintForce,
    Final,
    Hinge,
    Load,
    Method,
    Motor,
    Particle,
    RigidBody,
    Scene,
    Trace,
    Velocity,
    Wire,
    simulate,
    start,
)
from tests.coupling_scenes import H, Z, hung


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
    wheel = RigidBody(
        name="wheel",
        mass=1.0,
        inertia=(2.0, 2.0, 2.0),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 3.0),
    )
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
