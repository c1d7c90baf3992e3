"""A slide between two stops keeps what their restitution leaves, however often a step meets them.

The way of a free slide is known in closed form: it goes to and fro at a speed that each impact multiplies by the restitution.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Hinge,
    JointCoordinate,
    Limit,
    Method,
    Plane,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
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
    """By the default compliance of a limit, whose row gave way in an impact: at 1e-4 s an elastic one left .38 of the speed. A single
    blow was met as the step began, up to a step early: a hinge came back 599 times in 20 s at 1/60 s where 321 is right."""
    run = simulate(slide(psi), time_step=h, duration=SECONDS, method=Method(solver=solver), observe=OBSERVED)
    wanted = np.array([after(step * h, psi) for step in range(len(run["at"]))])
    at_an_end = np.abs(wanted[:, 0]) > HALF - 1e-9

    assert run.completed
    np.testing.assert_allclose(run["at"], wanted[:, 0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(run["v"][~at_an_end, 0], wanted[~at_an_end, 1], rtol=1e-9)
    assert run.counters["stopped_impacts"] == 0


@pytest.mark.parametrize("beside", [False, True], ids=["alone", "beside a floor"])
@pytest.mark.parametrize("h", [1 / 60, 1 / 97, 1e-3])
def test_a_slide_that_falls_on_an_elastic_stop_bounces_for_ever(h: float, beside: bool) -> None:
    """A step's velocity is that of the middle of the step before: let go at rest it falls as if it had g h/2 already."""
    drop, gravity = 0.11, 9.81
    body = RigidBody(name="slide", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, drop))
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, -9.0))
    guide = Prismatic(
        name="guide", between=(WORLD, "slide"), axis=(0.0, 0.0, 1.0),
        limit=Limit(lower=-drop, upper=9.0, restitution=1.0),
    )  # fmt: skip
    steps = round(20.0 / h)
    bodies = (replace(body, shape=Sphere(0.05)), floor) if beside else (body,)
    scene = Scene(bodies=bodies, constraints=(guide,), gravity=(0.0, 0.0, -gravity))
    run = simulate(scene, time_step=h, steps=steps, observe=OBSERVED)
    met = math.sqrt((0.5 * gravity * h) ** 2 + 2.0 * gravity * drop)
    since = (h * np.arange(steps + 1) + (met + 0.5 * gravity * h) / gravity) % (2.0 * met / gravity)

    assert run.completed
    np.testing.assert_allclose(run["at"] + drop, met * since - 0.5 * gravity * since**2, rtol=0.0, atol=1e-8)


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
