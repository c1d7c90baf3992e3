"""A slide between two stops keeps what their restitution leaves, however often a step meets them.

The way of a free slide is known in closed form: it goes to and fro at a speed that each impact multiplies by the restitution.
"""

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Hinge,
    JointCoordinate,
    Limit,
    Method,
    Prismatic,
    RigidBody,
    Scene,
    Trace,
    Velocity,
    simulate,
)

SPEED, HALF, SECONDS = 3.0, 0.004, 0.5


def after(time: float, psi: float) -> tuple[float, float]:
    """Place and velocity of what starts in the middle."""
    place, way, speed = 0.0, 1.0, SPEED
    while (HALF - way * place) < speed * time:
        time -= (HALF - way * place) / speed
        place, way, speed = way * HALF, -way, psi * speed
    return place + way * speed * time, way * speed


def slide(psi: float) -> Scene:
    body = RigidBody(
        name="slide", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.0), velocity=(SPEED, 0.0, 0.0)
    )
    guide = Prismatic(
        name="guide", between=(WORLD, "slide"), axis=(1.0, 0.0, 0.0),
        limit=Limit(lower=-HALF, upper=HALF, restitution=psi),
    )  # fmt: skip
    return Scene(bodies=(body,), constraints=(guide,))


OBSERVED = {"v": Trace(quantity=Velocity("slide")), "at": Trace(quantity=JointCoordinate("guide"))}


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("h", [1 / 60, 1 / 240, 1e-3, 1e-4])
@pytest.mark.parametrize("psi", [1.0, 0.9, 0.5])
def test_blows_take_what_the_restitution_says(psi: float, h: float, solver: str) -> None:
    """By the default compliance of a limit, whose row gave way in an impact: at 1e-4 s an elastic one left .38 of the speed.
    A single blow is met as the step begins, up to a step early, so that there are more of them than time has by as many steps."""
    run = simulate(slide(psi), time_step=h, duration=SECONDS, method=Method(solver=solver), observe=OBSERVED)
    speeds = np.abs(run["v"][:, 0])
    powers = np.log(speeds / SPEED) / math.log(psi) if psi < 1.0 else speeds / SPEED
    right = math.log(abs(after(SECONDS, psi)[1]) / SPEED) / math.log(psi) if psi < 1.0 else 1.0

    assert run.completed
    assert np.abs(powers - powers.round()).max() < 1e-6
    if psi == 1.0 or h <= 1e-3:
        assert powers[-1] == pytest.approx(right, abs=1.5 if psi < 1.0 else 1e-9)
    assert np.abs(run["at"]).max() < HALF + 1e-9
    assert run.counters["stopped_impacts"] == 0


@pytest.mark.parametrize("psi", [1.0, 0.8])
def test_several_blows_in_a_step_end_where_a_free_slide_does(psi: float) -> None:
    """The first step, which no impact before it has shifted: six impacts at 1/60 s."""
    run = simulate(slide(psi), time_step=1 / 60, steps=1, observe=OBSERVED)
    place, velocity = after(1 / 60, psi)

    assert run["at"][1] == pytest.approx(place, abs=1e-9)
    assert run["v"][1, 0] == pytest.approx(velocity, rel=1e-9)


def test_a_door_between_near_stops_swings_on() -> None:
    door = RigidBody(
        name="door", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.5, 0.0, 0.0), velocity=(0.0, 1.0, 0.0),
        angular_velocity=(0.0, 0.0, 2.0),
    )  # fmt: skip
    hinge = Hinge(
        name="hinge",
        between=(WORLD, "door"),
        at=(0.0, 0.0, 0.0),
        limit=Limit(lower=-0.005, upper=0.005, restitution=1.0),
    )
    observe = {"w": Trace(quantity=AngularVelocity("door")), "at": Trace(quantity=JointCoordinate("hinge"))}
    run = simulate(Scene(bodies=(door,), constraints=(hinge,)), time_step=1 / 60, steps=300, observe=observe)

    assert np.abs(np.abs(run["w"][:, 2]) - 2.0).max() < 1e-3
    assert np.abs(run["at"]).max() < 0.005 + 1e-6
