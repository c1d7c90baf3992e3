"""Tangential restitution: a blow that grips turns the slip round, by no more than friction holds, and energy never rises."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Final,
    Material,
    Method,
    Plane,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
)
from tests.scenes.corpus import solid

RADIUS = 0.1  # m
SOLVERS = ["direct", "iterative"]


def floor(material: Material) -> RigidBody:
    return RigidBody(name="floor", motion="static", shape=Plane(), position=(0, 0, 0), material=material)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("model", ["cone", "box", "scaled_box"])
@pytest.mark.parametrize(("mu", "returned"), [(5.0, 1.0), (5.0, 0.6), (0.2, 1.0), (0.0, 1.0)])
def test_an_impact_turns_the_slip_round_as_far_as_friction_holds(
    solver: str, model: str, mu: float, returned: float
) -> None:
    """Half a ball's mass over 7/2 takes up the slip: the impulse is (1 + psi_t) 2/7 of it, at most mu (1 + psi) u."""
    rubber = Material(friction=mu, restitution=0.8, tangential_restitution=returned)
    ball = solid(
        "ball", Sphere(RADIUS), (0.0, 0.0, 0.15), 2.0, (3.0, 0.0, -2.0), (0.0, -10.0, 0.0), material=rubber
    )

    end = simulate(
        Scene(bodies=(floor(rubber), ball)),
        time_step=1 / 60,
        steps=4,
        method=Method(solver=solver, friction=model),  # type: ignore[arg-type]
        observe={"v": Final(quantity=Velocity("ball")), "w": Final(quantity=AngularVelocity("ball"))},
    )

    slip = 3.0 + 10.0 * RADIUS
    taken = min((1.0 + returned) * slip * 2.0 / 7.0, mu * 1.8 * 2.0)
    np.testing.assert_allclose(end["v"], (3.0 - taken, 0.0, 1.6), atol=1e-9)
    np.testing.assert_allclose(end["w"], (0.0, -10.0 + 2.5 * taken / RADIUS, 0.0), atol=1e-7)
