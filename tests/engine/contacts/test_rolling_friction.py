"""Rolling and torsional friction: torques up to a bound in every contact, by every solver, in any direction."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    AngularVelocity,
    Box,
    Capsule,
    Cylinder,
    HeightField,
    KineticEnergy,
    Material,
    Method,
    Plane,
    Result,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
)
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals, traces

H = 1.0 / 60.0
DOWN = (0.0, 0.0, -10.0)
RADIUS = 0.1


def floor(mu: float = 0.5) -> RigidBody:
    return fixed("floor", Plane(), (0, 0, 0), material=Material(friction=mu))


def ball(name: str = "ball", height: float = RADIUS, mu: float = 0.5, **fields: object) -> RigidBody:
    given = {"mass": 2.0, "shape": Sphere(RADIUS), "position": (0, 0, height)}
    surface = {k: fields.pop(k) for k in ("rolling_friction", "torsional_friction") if k in fields}
    return RigidBody(name=name, material=Material(friction=mu, **surface), **(given | fields))  # type: ignore[arg-type]


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("away", [0.0, 0.4, 2.1, -1.3])
def test_a_ball_slows_down_alike_in_every_direction(solver: str, away: float) -> None:
    c, s = math.cos(away), math.sin(away)
    rolling = ball(
        rolling_friction=0.01, velocity=(c, s, 0.0), angular_velocity=(-s / RADIUS, c / RADIUS, 0.0)
    )
    v = simulate(
        Scene(bodies=(floor(), rolling), gravity=DOWN),
        time_step=H,
        steps=120,
        method=Method(solver=solver),  # type: ignore[arg-type]
        observe=traces(v=Velocity("ball")),
    )["v"]

    exact = np.maximum(0.0, 1.0 - 5.0 / 7.0 * 0.01 / RADIUS * 10.0 * H * np.arange(121))
    np.testing.assert_allclose(v[:, 0], exact * c, atol=1e-9)
    np.testing.assert_allclose(v[:, 1], exact * s, atol=1e-9)


def test_without_friction_a_spinning_ball_still_feels_the_torque() -> None:
    """No tangential force: the spin about a level axis falls by ρ m g h/I a step and nothing moves on."""
    spinning = ball(mu=0.0, rolling_friction=0.01, angular_velocity=(20.0, 0.0, 0.0))
    found = simulate(
        Scene(bodies=(floor(0.0), spinning), gravity=DOWN),
        time_step=H,
        steps=10,
        observe=traces(w=AngularVelocity("ball")) | finals(v=Velocity("ball")),
    )

    slowing = 0.01 * 10.0 / (0.4 * RADIUS**2)
    np.testing.assert_allclose(found["w"][:, 0], 20.0 - slowing * H * np.arange(11), atol=1e-9)
    assert not found["v"][:2].any()


def test_two_balls_that_turn_against_each_other_keep_their_angular_momentum() -> None:
    bodies = (
        ball(
            "left",
            height=0.0,
            position=(-RADIUS, 0, 0),
            torsional_friction=0.02,
            angular_velocity=(9.0, 0, 0),
        ),
        ball("right", height=0.0, position=(RADIUS, 0, 0), torsional_friction=0.02, velocity=(-1.0, 0, 0)),
    )
    observe = traces(momentum=AngularMomentum(), energy=KineticEnergy()) | finals(w=AngularVelocity("right"))
    found = simulate(Scene(bodies=bodies), time_step=H, steps=3, observe=observe)

    np.testing.assert_allclose(found["momentum"], np.tile(found["momentum"][0], (4, 1)), atol=1e-14)
    assert np.all(np.diff(found["energy"]) <= 1e-14)
    # A plastic blow of reduced mass 1 kg at 1 m/s: the torque's impulse is at most σ times 1 N s.
    assert found["w"][0] == pytest.approx(0.02 * 1.0 / (0.4 * 2.0 * RADIUS**2), abs=1e-9)


def test_a_box_and_a_capsule_take_it_at_every_point() -> None:
    """Torsional friction of four points is that of one with the whole load."""
    spins = {}
    for shape in (Box((0.2, 0.2, 0.2)), Capsule(0.1, 0.2)):
        body = ball(
            mu=0.0, torsional_friction=0.003, shape=shape, angular_velocity=(0.0, 0.0, 4.0), height=RADIUS
        )
        if isinstance(shape, Capsule):  # on its side: its axis is level
            half = math.sqrt(0.5)
            body = ball(
                mu=0.0,
                torsional_friction=0.003,
                shape=shape,
                orientation=(half, 0.0, half, 0.0),
                angular_velocity=(0.0, 0.0, 4.0),
                inertia=(0.02, 0.02, 0.02),
            )
        else:
            body = ball(
                mu=0.0,
                torsional_friction=0.003,
                shape=shape,
                angular_velocity=(0.0, 0.0, 4.0),
                inertia=(0.02, 0.02, 0.02),
            )
        found = simulate(
            Scene(bodies=(floor(0.0), body), gravity=DOWN),
            time_step=H,
            steps=30,
            observe=finals(w=AngularVelocity("ball")),
        )
        spins[type(shape)] = float(found["w"][2])

    exact = 4.0 - 0.003 * 2.0 * 10.0 / 0.02 * 30 * H
    assert spins == pytest.approx(dict.fromkeys(spins, exact), abs=1e-7)


def test_a_heap_with_rolling_friction_comes_to_rest_on_a_slope() -> None:
    """Twelve balls side by side on a slope they would roll down."""
    tilt = math.atan(0.05)
    balls = [
        ball(f"ball {i}", position=(0.3 * (i % 4), 0.3 * (i // 4), RADIUS), rolling_friction=0.01)
        for i in range(12)
    ]
    found = simulate(
        Scene(bodies=(floor(), *balls), gravity=(10.0 * math.sin(tilt), 0.0, -10.0 * math.cos(tilt))),
        time_step=H,
        steps=60,
        observe=finals(energy=KineticEnergy()),
    )

    assert found["energy"] < 1e-20


def coin_on_hills(solver: str, steps: int) -> Result:
    """A coin, thrown on a height field whose patches touch it at up to eight points at a time."""
    heights = tuple(tuple(0.15 * math.sin(0.9 * i) * math.cos(0.7 * j) for j in range(13)) for i in range(13))
    hills = fixed(
        "hills", HeightField((0.5, 0.5), heights), (-3.0, -3.0, 0.0), material=Material(friction=0.5)
    )
    coin = solid(
        "coin",
        Cylinder(0.3, 0.02),
        (0.3, 0.2, 0.5),
        velocity=(1.0, -0.5, 0.0),
        orientation=(0.9, 0.3, 0.3, 0.1),
        material=Material(friction=0.5, rolling_friction=0.01, torsional_friction=0.005),
    )
    return simulate(
        Scene(bodies=(hills, coin), gravity=DOWN),
        time_step=H,
        steps=steps,
        method=Method(solver=solver, iterations=5000),  # type: ignore[arg-type]
        observe=traces(v=Velocity("coin"), w=AngularVelocity("coin")),
    )


def test_many_points_that_resist_turning_are_solved_directly_without_a_search() -> None:
    """By rounds of pivoting it took 1700 factorisations a step, and most of them ended unsettled."""
    result = coin_on_hills("direct", 200)

    assert result.completed
    assert result.counters["factorisations"] < 2 * 200
    assert result.counters["unsettled_solves"] < 0.05 * 200
    assert result.residual < 1e-6


def test_what_is_solved_directly_is_what_iterations_go_towards() -> None:
    """Up to the first step that 5000 iterations leave unsettled."""
    direct, iterated = coin_on_hills("direct", 22), coin_on_hills("iterative", 22)

    assert direct.counters["contacts"] >= 5
    for name in ("v", "w"):
        np.testing.assert_allclose(direct[name], iterated[name], rtol=0.0, atol=1e-9)


def test_a_pile_that_resists_turning_is_solved_by_newtons_method() -> None:
    """Of sixty balls that begin inside each other: rounds of pivoting took a hundred thousand pivots a step and ended unsettled."""
    rng = np.random.default_rng(1)
    balls = [
        ball(
            f"ball {k}",
            position=(
                1.5 * RADIUS * (k % 3 + 0.2 * rng.random()),
                1.5 * RADIUS * (k // 3 % 3 + 0.2 * rng.random()),
                RADIUS * (1.2 + 2.2 * (k // 9)),
            ),
            rolling_friction=0.01,
            torsional_friction=0.005,
        )
        for k in range(60)
    ]
    result = simulate(Scene(bodies=(floor(), *balls), gravity=DOWN), time_step=1 / 60, steps=60, observe={})

    assert result.completed
    assert result.counters["pivots"] < 1000 * 60
    assert result.residual < 1e-3
