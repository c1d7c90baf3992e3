"""Elastic balls under gravity: no blow takes or gives energy, wherever in a step it is, and however many there are.

A step's velocity v is that of the middle of the step before: with the kick k = h g a ball in free flight goes along a parabola
on which it has v + k/2 where the step begins. Blows R at the shares s of a step act on v + (1/2 + s) k, and what is left of k, which
may be negative, comes after the last: v₊ = R(v + (1/2 + s) k) + (1/2 − s) k and q₊ = q + s h (v + k) + (1 − s) h v₊. Since R keeps |v|,
½ m |v + k/2|² − m g·q is the same for every s and every R, several blows included. With E of the velocities v it is
E − ½ h g·p, p the momentum, up to what does not change.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, Literal

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    ContactForce,
    Energy,
    Final,
    Load,
    Lock,
    Material,
    Method,
    Momentum,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)

GRAVITY = 9.81  # m/s²
ELASTIC = Material(restitution=1.0)
RADIUS = 0.2  # m
SOLVERS = ("direct", "iterative")
Impacts = Literal["simultaneous", "successive"]
IMPACTS: tuple[Impacts, ...] = ("simultaneous", "successive")
H = 1 / 60  # s


def wall(name: str, place: tuple[float, float, float], size: tuple[float, float, float]) -> RigidBody:
    return RigidBody(name=name, motion="static", shape=Box(size), position=place, material=ELASTIC)


def ball(
    name: str,
    place: tuple[float, ...],
    velocity: tuple[float, ...],
    mass: float = 1.0,
    radius: float = RADIUS,
) -> RigidBody:
    return RigidBody(
        name=name,
        mass=mass,
        shape=Sphere(radius),
        position=place,  # type: ignore[arg-type]
        velocity=velocity,  # type: ignore[arg-type]
        material=ELASTIC,
    )


def changes(
    bodies: list[RigidBody],
    steps: int,
    time_step: float,
    solver: str,
    impacts: Impacts,
    *locks: Lock,
    carried: bool = False,
) -> tuple[np.ndarray, float]:
    """What each step changes of the energy, J, and the energy above the lowest place there is, J. Of what lies on something, or
    is locked (`carried`), the speed at the start of a step is v."""
    result = simulate(
        Scene(bodies=tuple(bodies), constraints=locks, gravity=(0.0, 0.0, -GRAVITY)),
        time_step=time_step,
        steps=steps,
        method=Method(solver=solver, impacts=impacts),  # type: ignore[arg-type]
        observe={"energy": Trace(quantity=Energy()), "momentum": Trace(quantity=Momentum())},
    )
    assert result.status == "completed"
    energy = result["energy"] - (not carried) * 0.5 * time_step * GRAVITY * result["momentum"][:, 2]
    return np.diff(energy), float(result["energy"][0])


def flight(*masses: float) -> float:
    """What a step of free flight takes of the energy with v, J."""
    return 0.5 * sum(masses) * (GRAVITY * H) ** 2


def half_kicks(*masses: float) -> float:
    """The energy of half a kick, J: what lies still has none of it, and what begins to fall has."""
    return 0.125 * sum(masses) * (GRAVITY * H) ** 2


def touching(share: float) -> list[RigidBody]:
    """Two rise, one on top of the other, and meet a third."""
    up, down, heavy = 2.4, 1.5, 8.0
    gap = share * H * (up + down)
    return [
        ball("lower", (0.0, 0.0, 0.0), (0.0, 0.0, up), 4.0),
        ball("upper", (0.0, 0.0, 2 * RADIUS), (0.0, 0.0, up), 0.5),
        ball("third", (0.0, 0.0, 4 * RADIUS + gap), (0.0, 0.0, -down), heavy),
    ]


def along_a_wall(share: float) -> list[RigidBody]:
    speed = 3.0
    return [
        wall("side", (-0.5 - RADIUS, 0.0, 0.0), (1.0, 4.0, 8.0)),
        wall("roof", (0.0, 0.0, RADIUS + share * H * speed + 0.5), (4.0, 4.0, 1.0)),
        ball("ball", (0.0, 0.0, 0.0), (0.0, 0.0, speed)),
    ]


def off_the_floor(share: float) -> list[RigidBody]:
    """It begins the step on the floor, with a speed that gravity does not take back in it. Successive blows: in a
    simultaneous one the floor, which it still touches as the step begins, takes part and stops it."""
    _, *rest = along_a_wall(share)
    return [wall("floor", (0.0, 0.0, -0.5 - RADIUS), (4.0, 4.0, 1.0)), *rest]


def earlier(share: float) -> list[RigidBody]:
    """Two would meet late in the step; a third, sent up by the floor, hits the lower one before: both had been led to the
    time of their own blow."""
    heavy, light = 5.0, 0.4
    return [
        wall("floor", (0.0, 0.0, -0.5), (9.0, 9.0, 1.0)),
        ball("lowest", (0.0, 0.0, RADIUS + 0.1 * H * 12.0), (0.0, 0.0, -12.0), light),
        ball("lower", (0.0, 0.0, 3.0 * RADIUS + 0.03), (0.0, 0.0, 1.6), heavy),
        ball("upper", (0.0, 0.0, 5.0 * RADIUS + 0.03 + share * H * 2.6), (0.0, 0.0, -1.0), heavy),
    ]


SHARES = (0.1, 0.5, 0.9)
FLIGHTS = (  # what flies, the shares of the step after which it is met, steps, impacts, J
    (touching, SHARES, 3, IMPACTS, 1e-12),
    (along_a_wall, SHARES, 3, IMPACTS, 1e-12),
    (off_the_floor, SHARES, 1, ("successive",), 1e-12),
    (earlier, (0.9,), 1, ("successive",), 1e-9),
)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("flight", "share", "steps", "impacts", "bound"),
    [
        (f, share, steps, how, bound)
        for f, shares, steps, hows, bound in FLIGHTS
        for share in shares
        for how in hows
    ],
)
def test_what_flies_is_carried_by_no_body(
    flight: Any, share: float, steps: int, impacts: Impacts, bound: float, solver: str
) -> None:
    """Not by what it touches as it flies, rises along or has left: no impact gives or takes energy."""
    change, _ = changes(flight(share), steps, H, solver, impacts)

    np.testing.assert_allclose(change, 0.0, rtol=0, atol=bound)


@pytest.mark.parametrize("impacts", IMPACTS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_balls_locked_to_each_other_are_carried_by_no_body(
    share: float, solver: str, impacts: Impacts
) -> None:
    """One above the other they rise to a roof, and both turn round: a lock holds them together, and holds none up."""
    speed = 3.0
    bodies = [
        wall("roof", (0.0, 0.0, RADIUS + share * H * speed + 0.5), (4.0, 4.0, 1.0)),
        ball("upper", (0.0, 0.0, 0.0), (0.0, 0.0, speed)),
        ball("lower", (0.0, 0.0, -3.0 * RADIUS), (0.0, 0.0, speed), 3.0),
    ]
    lock = Lock(name="lock", between=("upper", "lower"), compliance=0.0)
    change, _ = changes(bodies, 3, H, solver, impacts, lock, carried=True)

    np.testing.assert_allclose(change, -flight(1.0, 3.0), rtol=0, atol=1e-9)


def plank(name: str, slope: float, along: float, size: float) -> RigidBody:
    """Its upper side through the origin, rising along x by that angle."""
    way, normal = (math.cos(slope), 0.0, math.sin(slope)), (-math.sin(slope), 0.0, math.cos(slope))
    return RigidBody(
        name=name, motion="static", shape=Box((size, 4.0, 1.0)), material=ELASTIC,
        position=tuple(along * w - 0.5 * n for w, n in zip(way, normal, strict=True)),
        orientation=(math.cos(0.5 * slope), 0.0, -math.sin(0.5 * slope), 0.0),
    )  # fmt: skip


def on_a_slope(slope: float, share: float) -> list[RigidBody]:
    """One rolls up a plank that carries it, and one that comes down knocks it back."""
    up = np.array((math.cos(slope), 0.0, math.sin(slope)))
    lies = RADIUS * np.array((-up[2], 0.0, up[0]))
    return [
        plank("plank", slope, 0.0, 9.0),
        ball("rises", tuple(lies), tuple(2.0 * up)),
        ball("falls", tuple(lies + (2 * RADIUS + share * H * 3.0) * up), tuple(-1.0 * up), 3.0),
    ]


def losing_its_support(share: float) -> list[RigidBody]:
    """A ball leans on a wall and on another, which a third knocks away: it falls, with the kick of the whole step."""
    large, speed, lean = 1.5 * RADIUS, 4.0, 0.6
    support = np.array((0.0, 0.0, large))
    leans = support + (large + RADIUS) * np.array((-math.sin(lean), 0.0, math.cos(lean)))
    way = np.array((0.5, math.sqrt(0.75), 0.0))
    comes = support - (2.0 * large + share * H * speed) * way
    return [
        wall("floor", (0.0, 0.0, -0.5), (9.0, 9.0, 1.0)),
        wall("wall", (leans[0] - RADIUS - 0.5, 0.0, 1.0), (1.0, 0.2, 2.0)),
        ball("leans", tuple(leans), (0.0, 0.0, 0.0)),
        ball("support", tuple(support), (0.0, 0.0, 0.0), 1.0, large),
        ball("comes", tuple(comes), tuple(speed * way), 1.0, large),
    ]


def onto_a_steeper_slope(share: float) -> list[RigidBody]:
    """It slides up a plank to one that is steeper."""
    up, normal = np.array((math.cos(0.3), 0.0, math.sin(0.3))), np.array((-math.sin(0.3), 0.0, math.cos(0.3)))
    place = RADIUS * normal - (RADIUS * math.tan(0.03) + share * H * 2.0) * up
    planks = plank("plank", 0.3, -2.0, 4.0), plank("steeper", 0.36, 2.0, 4.0)
    return [*planks, ball("slides", tuple(place), tuple(2.0 * up))]


CARRIED = (
    *((partial(on_a_slope, slope), 4) for slope in (-0.3, 0.3, 1.0)), (losing_its_support, 1), (onto_a_steeper_slope, 1),
)  # fmt: skip


@pytest.mark.parametrize("impacts", IMPACTS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("scene", "steps"), CARRIED)
@pytest.mark.parametrize("share", [0.2, 0.9])
def test_what_is_carried_wins_nothing_by_an_impact(
    share: float, scene: Any, steps: int, solver: str, impacts: Impacts
) -> None:
    change, energy = changes(scene(share), steps, H, solver, impacts, carried=True)

    assert change.max() <= 1e-9 * energy


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
        observe={
            "energy": Trace(quantity=Energy()),
            "velocity": Final(quantity=Velocity()),
            "floor": Final(quantity=ContactForce("floor")),
        },
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
        observe={
            "energy": Trace(quantity=Energy()),
            "velocity": Final(quantity=Velocity()),
            "roof": Final(quantity=ContactForce("roof")),
        },
    )
    (change,) = np.diff(result["energy"])
    change -= 0.5 * H * GRAVITY * result["velocity"][2:, 2] @ (1.0, 2.0)

    assert result["roof"][2] > 0.0
    assert -half_kicks(1.0, 2.0) < change <= 1e-12


@pytest.mark.parametrize("solver", SOLVERS)
def test_balls_that_are_pressed_together_as_they_fly_carry_each_other(solver: str) -> None:
    """Loads push two at each other, and a third strikes one from the side: at its time, with both where they lie."""
    bodies = [
        RigidBody(
            name=name,
            mass=1.0,
            shape=Sphere(RADIUS),
            position=(x, 0.0, 0.0),
            material=ELASTIC,
        )
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
        observe={"x": Final(quantity=Position()), "v": Final(quantity=Velocity())},
    )

    assert result["x"][1, 1] == pytest.approx(0.1 * H * 3.0, rel=1e-9)
    assert np.linalg.norm(result["x"][1] - result["x"][0]) > 2.0 * RADIUS - 1e-9
