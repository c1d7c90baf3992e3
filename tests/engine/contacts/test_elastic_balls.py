"""Elastic balls under gravity: no blow takes or gives energy, wherever in a step it is, and however many there are.

A step's velocity v is that of the middle of the step before: with the kick k = h g a ball in free flight goes along a parabola
on which it has v + k/2 where the step begins. Blows R at the shares s of a step act on v + (1/2 + s) k, and what is left of k, which
may be negative, comes after the last: v₊ = R(v + (1/2 + s) k) + (1/2 − s) k and q₊ = q + s h (v + k) + (1 − s) h v₊. Since R keeps |v|,
½ m |v + k/2|² − m g·q is the same for every s and every R, several blows included. With E of the velocities v it is
E − ½ h g·p, p the momentum, up to what does not change.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pytest

from spook_tracker.engine import (
    ContactForce,
    Energy,
    Load,
    Method,
    Position,
    Scene,
    Sphere,
    Velocity,
    simulate,
)
from tests.scenes.blows import ELASTIC, RADIUS, H, ball, wall
from tests.scenes.corpus import GRAVITY, solid
from tests.scenes.seen import finals, traces

SOLVERS = ("direct", "iterative")
Impacts = Literal["simultaneous", "successive"]
IMPACTS: tuple[Impacts, ...] = ("simultaneous", "successive")


def half_kicks(*masses: float) -> float:
    """The energy of half a kick, J: what lies still has none of it, and what begins to fall has."""
    return 0.125 * sum(masses) * (GRAVITY * H) ** 2


@pytest.mark.parametrize("impacts", IMPACTS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_the_floor_carries_what_lies_on_it_until_an_impact_lifts_it(
    share: float, solver: str, impacts: Impacts
) -> None:
    """A ball at rest, hit by a smaller one from below its middle: it falls from then on, and has not fallen before. Over
    the step the floor has carried what forces and momentum ask for."""
    small, speed = 0.5 * RADIUS, 4.0
    reach = math.sqrt((RADIUS + small) ** 2 - (RADIUS - small) ** 2)
    bodies = [
        wall("floor", (0.0, 0.0, -0.5), (9.0, 9.0, 1.0)),
        ball("lies", (0.0, 0.0, RADIUS), (0.0, 0.0, 0.0)),
        ball("rolls", (-reach - share * H * speed, 0.0, small), (speed, 0.0, 0.0), 2.0, small),
    ]
    result = simulate(
        Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY)),
        time_step=H,
        steps=1,
        method=Method(solver=solver, impacts=impacts),  # type: ignore[arg-type]
        observe=traces(energy=Energy()) | finals(velocity=Velocity(), floor=ContactForce("floor")),
    )
    rises = result["velocity"][1:, 2]
    (change,) = np.diff(result["energy"])
    change -= 0.5 * H * GRAVITY * rises @ (1.0, 2.0)

    assert rises[0] > 1.0
    assert -half_kicks(1.0, 2.0) < change <= 1e-12
    assert -result["floor"][2] == pytest.approx(3.0 * GRAVITY + rises @ (1.0, 2.0) / H, rel=1e-12)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("share", [0.1, 0.3])
def test_what_an_impact_lifts_falls_until_the_next_one(share: float, solver: str) -> None:
    """Struck up from the floor, and down by a roof in the same step: free from the first blow on."""
    small, speed = 0.5 * RADIUS, 6.0
    reach = math.sqrt((RADIUS + small) ** 2 - (RADIUS - small) ** 2)
    bodies = [
        wall("floor", (0.0, 0.0, -0.5), (9.0, 9.0, 1.0)),
        wall("roof", (0.0, 0.0, 2.0 * RADIUS + 0.01 + 0.5), (9.0, 9.0, 1.0)),
        ball("lies", (0.0, 0.0, RADIUS), (0.0, 0.0, 0.0)),
        ball("rolls", (-reach - share * H * speed, 0.0, small), (speed, 0.0, 0.0), 2.0, small),
    ]
    result = simulate(
        Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -GRAVITY)),
        time_step=H,
        steps=1,
        method=Method(solver=solver, impacts="successive"),  # type: ignore[arg-type]
        observe=traces(energy=Energy()) | finals(velocity=Velocity(), roof=ContactForce("roof")),
    )
    (change,) = np.diff(result["energy"])
    change -= 0.5 * H * GRAVITY * result["velocity"][2:, 2] @ (1.0, 2.0)

    assert result["roof"][2] > 0.0
    assert -half_kicks(1.0, 2.0) < change <= 1e-12


@pytest.mark.parametrize("solver", SOLVERS)
def test_balls_that_are_pressed_together_as_they_fly_carry_each_other(solver: str) -> None:
    """Loads push two at each other, and a third strikes one from the side: at its time, with both where they lie."""
    bodies = [
        solid(name, Sphere(RADIUS), (x, 0.0, 0.0), material=ELASTIC)
        for name, x in (("left", -RADIUS), ("right", RADIUS))
    ]
    bodies.append(ball("comes", (RADIUS, -2.0 * RADIUS - 0.9 * H * 3.0, 0.0), (0.0, 3.0, 0.0)))
    result = simulate(
        Scene(
            bodies=tuple(bodies),
            forces=tuple(
                Load(name=name, body=name, force=(force, 0.0, 0.0))
                for name, force in (("left", 50.0), ("right", -50.0))
            ),
        ),
        time_step=H,
        steps=1,
        method=Method(solver=solver),  # type: ignore[arg-type]
        observe=finals(x=Position(), v=Velocity()),
    )

    assert result["x"][1, 1] == pytest.approx(0.1 * H * 3.0, rel=1e-9)
    assert np.linalg.norm(result["x"][1] - result["x"][0]) > 2.0 * RADIUS - 1e-9
