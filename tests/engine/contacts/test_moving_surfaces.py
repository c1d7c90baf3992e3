"""Conveyors: a surface that moves along itself takes along what rubs on it, whatever it is and whichever solver is used."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    Material,
    Method,
    Plane,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
)
from tests.scenes.seen import finals, traces

ROUGH = Material(friction=0.5)
DOWN = (0.0, 0.0, -10.0)
H = 1.0 / 60.0


def belt(**fields: object) -> RigidBody:
    given = {"motion": "static", "shape": Plane(), "position": (0, 0, 0), "material": ROUGH}
    return RigidBody(name="belt", **(given | {"surface_velocity": (1.0, 0.0, 0.0)} | fields))  # type: ignore[arg-type]


def box(**fields: object) -> RigidBody:
    given = {"mass": 1.0, "shape": Box((0.4, 0.4, 0.2)), "position": (0, 0, 0.1), "material": ROUGH}
    return RigidBody(name="box", **(given | fields))  # type: ignore[arg-type]


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("model", ["cone", "box", "scaled_box"])
def test_every_solver_and_model_brings_a_box_to_the_speed_of_the_belt(solver: str, model: str) -> None:
    method = Method(solver=solver, friction=model)  # type: ignore[arg-type]
    observe = traces(v=Velocity("box"))
    v = simulate(
        Scene(bodies=(belt(), box()), gravity=DOWN), time_step=H, steps=30, method=method, observe=observe
    )["v"]

    # The box bounds friction by the load of the step before: in sweeps its first step, without one, has none.
    late = 1 if (model, solver) == ("box", "iterative") else 0
    exact = np.minimum(1.0, 5.0 * H * np.maximum(0, np.arange(31) - late))
    np.testing.assert_allclose(v[:, 0], exact, atol=1e-9)


def test_a_belt_turned_with_its_body_carries_where_it_points() -> None:
    angle = 0.7
    turned = belt(orientation=(math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)))
    v = simulate(
        Scene(bodies=(turned, box()), gravity=DOWN), time_step=H, steps=30, observe=finals(v=Velocity("box"))
    )["v"]

    np.testing.assert_allclose(v, [math.cos(angle), math.sin(angle), 0.0], atol=1e-9)


def test_two_rollers_with_surfaces_push_each_other_apart_by_the_same_impulse() -> None:
    """The belt may be on a body that moves: what it gives it loses. A cart driven by its own belt on the floor."""
    cart = box(surface_velocity=(1.0, 0.0, 0.0))
    floor = belt(surface_velocity=(0.0, 0.0, 0.0))
    v = simulate(
        Scene(bodies=(floor, cart), gravity=DOWN), time_step=H, steps=30, observe=finals(v=Velocity("box"))
    )["v"]

    np.testing.assert_allclose(
        v, [-1.0, 0.0, 0.0], atol=1e-9
    )  # its track runs forwards below: it drives backwards


def test_a_ball_on_a_belt_ends_at_two_sevenths_of_its_speed() -> None:
    ball = box(shape=Sphere(0.1))
    found = simulate(
        Scene(bodies=(belt(), ball), gravity=DOWN),
        time_step=H,
        steps=60,
        observe=finals(v=Velocity("box"), w=AngularVelocity("box")),
    )

    assert found["v"][0] == pytest.approx(2.0 / 7.0, abs=1e-9)
    assert 0.1 * found["w"][1] == pytest.approx(-5.0 / 7.0, abs=1e-9)


def test_a_bounce_on_a_belt_takes_its_speed_along() -> None:
    """One blow: µ (1 + e) u of tangential speed, less than the 2/7 at which it would grip."""
    bouncy = Material(friction=0.08, restitution=0.5)
    ball = box(shape=Sphere(0.1), material=bouncy, velocity=(0.0, 0.0, -2.0))
    found = simulate(
        Scene(bodies=(belt(material=bouncy), ball)), time_step=H, steps=2, observe=finals(v=Velocity("box"))
    )

    assert found["v"][2] == pytest.approx(1.0, abs=1e-12)
    assert found["v"][0] == pytest.approx(0.08 * 3.0, abs=1e-12)
