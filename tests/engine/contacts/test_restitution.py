"""One blow: restitution, what the bodies exchange, and where the energy goes, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    Capsule,
    Material,
    Method,
    Particle,
    Penetration,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
)
from spook_tracker.scalar_tests.impacts import bouncing_ball
from tests.oracles.ball import dropped
from tests.scenes.contact import DOWN, GRAVITY, TIME_STEP, ball, ground
from tests.scenes.seen import finals, maxima, traces


@pytest.mark.parametrize("psi", [0.0, 0.25, 0.5, 1.0])
@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_one_contact_returns_psi_times_the_approach(psi: float, solver: str) -> None:
    """Without gravity, touching at the start: v₊ = −psi v₋ along the normal, unchanged across it."""
    scene = Scene(bodies=(ground(Material(restitution=psi)), ball(velocity=(0.3, -0.2, -4.0))))
    result = simulate(
        scene, time_step=TIME_STEP, steps=1, method=Method(solver=solver), observe=finals(v=Velocity("ball"))
    )

    np.testing.assert_allclose(result["v"], (0.3, -0.2, 4.0 * psi), rtol=0, atol=1e-14)


def test_bounces_reach_e_to_the_2n_of_the_height_at_first_order() -> None:
    """Heights h0 e^{2n} and stop time t0 (1 + e)/(1 − e), both with an error proportional to the time step."""
    e, height = 0.5, 1.0
    material = Material(restitution=e)
    scene = Scene(bodies=(ground(material), ball(height=0.5 + height, material=material)), gravity=DOWN)
    errors = []
    for time_step in (1e-3, 2.5e-4):
        result = simulate(
            scene, time_step=time_step, duration=2.0, observe=traces(z=Position("ball"), v=Velocity("ball"))
        )
        z, v = result["z"][:, 2] - 0.5, result["v"][:, 2]
        tops = np.flatnonzero((v[1:] <= 0.0) & (v[:-1] > 0.0))
        expected = height * e ** (2.0 * np.arange(1, 4))
        errors.append(np.abs(z[tops[:3]] - expected).max())
        moving = np.flatnonzero(np.abs(v) > 1e-9)
        stop = math.sqrt(2.0 * height / GRAVITY) * (1.0 + e) / (1.0 - e)
        assert moving[-1] * time_step == pytest.approx(stop, abs=40.0 * time_step)
        assert z.min() > -1e-12

    assert errors[0] < 4e-3
    assert errors[1] < 0.35 * errors[0]


@pytest.mark.parametrize("speed", [10.0, 100.0, 180.0, 1000.0])
@pytest.mark.parametrize("shape", [Sphere(0.5), Box((1.0, 1.0, 1.0))], ids=["ball", "box"])
@pytest.mark.parametrize(("below", "top"), [(Box((4, 4, 0.02)), 0.01), (Plane(), 0.0)], ids=["wall", "plane"])
def test_a_fast_body_neither_enters_nor_rebounds(
    below: Box | Plane, top: float, shape: Sphere | Box, speed: float
) -> None:
    """Up to 17 metres a step onto a wall of 2 cm, or a plane: it stops at the surface with no speed left."""
    wall = RigidBody(name="wall", position=(0, 0, 0), shape=below, motion="static")
    result = simulate(
        Scene(bodies=(wall, ball(height=3.0, velocity=(0, 0, -speed), shape=shape))),
        time_step=TIME_STEP,
        steps=30,
        observe=traces(z=Position("ball"), v=Velocity("ball")) | maxima(depth=Penetration()),
    )

    assert result["z"][:, 2].min() == result["z"][-1, 2] == pytest.approx(0.5 + top, abs=1e-13)
    assert result["depth"] < 1e-13
    met = math.ceil(2.5 / speed / TIME_STEP) + 2
    assert np.abs(result["v"][met:, 2]).max() < 1e-12


# Rest -------------------------------------------------------------------------------------------------------


def test_a_ball_bounces_where_the_map_of_its_steps_says() -> None:
    """Five bounces of a metre: a blow within a step meets what gravity has done until then since the middle of the step before."""
    _, found = bouncing_ball.gaps(simulate, bouncing_ball.TIME_STEP, 3.0)
    _, expected = bouncing_ball.gaps(dropped, bouncing_ball.TIME_STEP, 3.0)

    assert np.count_nonzero(np.diff(np.sign(np.diff(expected))) > 0) >= 5
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("psi", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("guided", [False, True])
def test_an_impact_ahead_in_the_step_gives_back_what_it_meets_with(
    guided: bool, psi: float, solver: str
) -> None:
    """A step's v is that of the middle of the step before: what flies along v − g h is met as fast as it falls until then, given back ψ
    times as fast, and slower by what gravity takes until the middle of the step. On a guide it is met as the step begins, given back
    ψ times as fast as v² + 2 g d, slower by 2 g d up there again, and by g h in the step."""
    rubber = Material(restitution=psi)
    capsule = RigidBody(
        name="capsule", mass=1.0, shape=Capsule(0.1, 0.5), position=(0.0, 0.0, 1.0), material=rubber
    )
    guide = Prismatic(name="guide", between=(WORLD, "capsule"), axis=(0.0, 0.0, 1.0), compliance=0.0)
    result = simulate(
        Scene(bodies=(ground(rubber), capsule), constraints=(guide,) * guided, gravity=DOWN),
        time_step=TIME_STEP,
        steps=40,
        method=Method(solver=solver),
        observe=traces(v=Velocity("capsule"), x=Position("capsule")),
    )
    v, gap = result["v"][:, 2], result["x"][:, 2] - 0.35
    (blow, *_) = np.nonzero((v[:-1] < 0.0) & (v[1:] > 0.0))[0]
    assert gap[blow] > 1e-3
    if guided:
        back = math.sqrt(psi**2 * v[blow] ** 2 - (1.0 - psi**2) * 2.0 * GRAVITY * gap[blow])
        assert v[blow + 1] == pytest.approx(back - GRAVITY * TIME_STEP, rel=1e-9)
        return
    time = gap[blow] / (GRAVITY * TIME_STEP - v[blow])
    back = psi * (GRAVITY * (0.5 * TIME_STEP + time) - v[blow])
    left = TIME_STEP - time
    assert v[blow + 1] == pytest.approx(back - GRAVITY * (left - 0.5 * TIME_STEP), rel=1e-12)
    assert gap[blow + 1] == pytest.approx(left * v[blow + 1], abs=1e-12)


@pytest.mark.parametrize(
    "method", [Method(), Method(impacts="successive"), Method(half_step_velocities=True)]
)
def test_a_particle_beside_a_blow_falls_as_it_does_alone(method: Method) -> None:
    """Forces act on what is free in halves in such a step, and a particle has no inertia to turn by."""
    stone = Particle(name="stone", mass=2.0, position=(3.0, 0.0, 5.0), velocity=(0.5, 0.0, 1.0))
    bouncing = (ground(Material(restitution=0.5)), ball(position=(0.0, 0.0, 1.1)))
    observe = traces(x=Position("stone"), v=Velocity("stone"))
    beside, alone = (
        simulate(Scene(bodies=bodies, gravity=DOWN), time_step=0.01, steps=60, method=method, observe=observe)
        for bodies in ((*bouncing, stone), (stone,))
    )
    assert beside.completed and beside.counters["impacts"] > 0
    for name in observe:
        np.testing.assert_allclose(beside[name], alone[name], rtol=0.0, atol=1e-13)
