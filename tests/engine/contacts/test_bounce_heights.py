"""How high bodies bounce: an elastic one for ever as high, another e² of it each time, whatever the solver and the step.

A step's velocity is that of the middle of the step before, so that a ball let go at rest falls as if it had g h/2 already: it
rises (g h/2)²/2g higher than it was dropped from. What a step cannot tell is an eighth of g h², the sag of a parabola under its chord.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    Box,
    Capsule,
    Energy,
    Limit,
    Material,
    Method,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Shape,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.scenes.corpus import fixed, solid

GRAVITY = 9.81  # m/s²
HEIGHT = 2.0  # m
SOLVERS = [Method(), Method(solver="iterative"), Method(impacts="successive")]
HALF = Method(half_step_velocities=True)
STEPS = [1 / 60, 1 / 97, 1 / 240]


def dropped(shape: Shape, reach: float, restitution: float, h: float, duration: float, method: Method) -> Any:
    """Gap below a body [m] and energy [J], sampled each step; `reach` is from its middle to its lowest point, m."""
    material = Material(restitution=restitution)
    floor = fixed("floor", Plane(), (0.0, 0.0, 0.0), material=material)
    body = solid("body", shape, (0.0, 0.0, reach + HEIGHT), material=material)
    run = simulate(
        Scene(bodies=(floor, body), gravity=(0.0, 0.0, -GRAVITY)),
        time_step=h,
        duration=duration,
        method=method,
        observe={"place": Trace(quantity=Position("body")), "energy": Trace(quantity=Energy())},
    )
    assert run.completed
    return run["place"][:, 2] - reach, run["energy"]


def tops(gap: np.ndarray) -> np.ndarray:
    """Of the parabola through the three samples around each top: samples are up to half a step beside it, m."""
    at = np.flatnonzero((gap[1:-1] > gap[:-2]) & (gap[1:-1] >= gap[2:])) + 1
    slope, bend = 0.5 * (gap[at + 1] - gap[at - 1]), gap[at + 1] - 2.0 * gap[at] + gap[at - 1]
    return np.asarray(gap[at] - 0.5 * slope**2 / bend)


@pytest.mark.parametrize("method", [*SOLVERS, HALF])
@pytest.mark.parametrize("h", STEPS)
def test_an_elastic_ball_is_as_high_after_a_minute(method: Method, h: float) -> None:
    gap, _ = dropped(Sphere(0.1), 0.1, 1.0, h, 60.0, method)
    start = 0.0 if method == HALF else 0.5 * GRAVITY * h

    np.testing.assert_allclose(tops(gap), HEIGHT + start**2 / (2.0 * GRAVITY), rtol=1e-9)
    assert len(tops(gap)) > 40


@pytest.mark.parametrize("method", [*SOLVERS, HALF])
@pytest.mark.parametrize(
    ("shape", "reach"), [(Box((0.4, 0.3, 0.2)), 0.1), (Capsule(0.1, 0.5), 0.35)], ids=["box", "capsule"]
)
def test_bodies_with_sides_meet_at_the_start_of_the_step_and_lose_nothing_by_it(
    shape: Shape, reach: float, method: Method
) -> None:
    h = 1 / 60
    gap, _ = dropped(shape, reach, 1.0, h, 30.0, method)
    start = 0.0 if method == HALF else 0.5 * GRAVITY * h

    np.testing.assert_allclose(tops(gap), HEIGHT + start**2 / (2.0 * GRAVITY), rtol=1e-6)


@pytest.mark.parametrize("method", [*SOLVERS, HALF])
@pytest.mark.parametrize("restitution", [0.5, 0.8, 0.95])
@pytest.mark.parametrize("h", STEPS)
def test_a_ball_rises_to_e_squared_of_where_it_was(restitution: float, method: Method, h: float) -> None:
    """As long as bounces last several steps; met up to a sag of the path beside the floor."""
    gap, _ = dropped(Sphere(0.1), 0.1, restitution, h, 10.0, method)
    found = tops(gap)
    found = found[: np.argmax(found < 40.0 * GRAVITY * h * h) or len(found)]
    before = np.concatenate(([HEIGHT], found[:-1]))

    assert len(found) >= 2
    assert np.abs(found - restitution**2 * before).max() < GRAVITY * h * h / 4.0


@pytest.mark.parametrize("h", STEPS)
def test_energy_read_in_the_middle_of_half_steps_is_kept_through_every_blow(h: float) -> None:
    _, energy = dropped(Sphere(0.1), 0.1, 1.0, h, 30.0, HALF)

    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)


@pytest.mark.parametrize("method", [Method(), Method(solver="iterative")])
@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9])
def test_what_bounces_comes_to_rest(restitution: float, method: Method) -> None:
    """Bounces shorter than a step end on the floor, not above it, and not later than the last of them would."""
    fall = math.sqrt(2.0 * HEIGHT / GRAVITY)
    stop, h = fall * (1.0 + restitution) / (1.0 - restitution), 1 / 60
    gap, energy = dropped(Sphere(0.1), 0.1, restitution, h, stop + 1.0, method)

    assert np.abs(gap[-30:]).max() < 1e-12
    assert np.ptp(energy[-30:]) == 0.0


@pytest.mark.parametrize("h", [1 / 60, 1 / 240])
@pytest.mark.parametrize("method", SOLVERS)
def test_a_ball_between_closing_walls_is_hit_as_often_as_it_meets_them(method: Method, h: float) -> None:
    """Each meeting with the wall that comes on at .5 m/s makes it faster by 1 m/s; several fall into a step in the end."""
    elastic = Material(restitution=1.0)
    ball = solid("ball", Sphere(0.01), (0.51, 0.0, 0.0), velocity=(1.3, 0.0, 0.0), material=elastic)
    still = fixed("still", Plane((1.0, 0.0, 0.0)), (0.0, 0.0, 0.0), material=elastic)
    comes = solid(
        "comes",
        Box((1.0, 2.0, 2.0)),
        (1.52, 0.0, 0.0),
        None,
        (-0.5, 0.0, 0.0),
        motion="kinematic",
        material=elastic,
    )
    place, speed, wall, left, meetings = 0.51, 1.3, 1.02, 1.9, 0  # of the middle, and how far that may come
    while True:
        ahead = (wall - 0.01 - place) / (speed + 0.5) if speed > 0.0 else (place - 0.01) / -speed
        if ahead > left:
            break
        place, wall, left = place + ahead * speed, wall - 0.5 * ahead, left - ahead
        meetings += speed > 0.0
        speed = -speed - 1.0 if speed > 0.0 else -speed
    steps = round(1.9 / h)
    run = simulate(
        Scene(bodies=(ball, still, comes)),
        time_step=h,
        steps=steps,
        method=method,
        observe={"v": Trace(quantity=Velocity("ball"))},
    )

    assert abs(run["v"][-1, 0]) == pytest.approx(abs(speed), abs=1e-9)
    assert meetings == 30
    assert run.counters["stopped_impacts"] == 0


@pytest.mark.parametrize("method", SOLVERS)
@pytest.mark.parametrize("h", STEPS)
@pytest.mark.parametrize(
    "shape", [Sphere(0.05), Box((0.1, 0.1, 0.1)), Capsule(0.05, 0.1)], ids=["ball", "box", "capsule"]
)
@pytest.mark.parametrize(("play", "speed"), [(0.02, 3.0), (0.04, 5.0), (0.19, 1.7)])
def test_an_elastic_body_goes_to_and_fro_between_walls(
    play: float, speed: float, shape: Shape, h: float, method: Method
) -> None:
    """In closed form, up to four impacts a step. A box or a capsule was met where its step begins, once: it kept .14 to .56 of its
    speed at 1/60 s, or came back 200 times in 20 s where 179 is right."""
    elastic = Material(restitution=1.0)
    walls = [
        fixed(
            f"wall {side}",
            Plane((-side, 0.0, 0.0)),
            (side * (0.05 + play / 2), 0.0, 0.0),
            material=elastic,
        )
        for side in (-1.0, 1.0)
    ]
    body = solid("body", shape, (0.003, 0.0, 0.0), velocity=(speed, 0.0, 0.0), material=elastic)
    steps = round(4.0 / h)
    observe = {"x": Trace(quantity=Position("body")), "v": Trace(quantity=Velocity("body"))}
    run = simulate(
        Scene(bodies=(body, *walls)), time_step=h, steps=steps, method=method, observe=observe, books=True
    )
    way = (play / 2 + 0.003 + speed * h * np.arange(steps + 1)) % (2 * play)

    assert run.completed
    np.testing.assert_allclose(run["x"][:, 0], play / 2 - np.abs(way - play), rtol=0.0, atol=1e-9)
    assert abs(run["v"][-1, 0]) == pytest.approx(speed, rel=1e-9)
    assert run.books.stopped_impacts == 0


def guided(restitution: float) -> Scene:
    """A box on a guide at 3 m/s, which is not moved to the time of an impact, between two plates 4 mm off."""
    material = Material(restitution=restitution)
    plates = [
        fixed(f"plate {side}", Box((1.0, 2.0, 2.0)), (side * 0.602, 0.0, 0.0), material=material)
        for side in (-1.0, 1.0)
    ]
    box = solid("box", Box((0.2, 0.2, 0.2)), (0.0, 0.0, 0.0), velocity=(3.0, 0.0, 0.0), material=material)
    guide = Prismatic(name="guide", between=(WORLD, "box"), axis=(1.0, 0.0, 0.0))
    return Scene(bodies=(box, *plates), constraints=(guide,))


@pytest.mark.parametrize("method", SOLVERS)
def test_rebounds_that_are_lost_leave_a_run_unsettled_and_substeps_meet_them(method: Method) -> None:
    """It was "completed" at less than a twentieth of its energy."""
    lost = simulate(guided(1.0), time_step=1 / 60, steps=60, method=method)

    assert lost.status == "unsettled"
    assert lost.counters["stopped_impacts"] > 0
    assert lost.failed_body == "box"
    assert "4.32 J, of 4.5 J at most" in lost.failure and "substeps" in lost.failure

    met = simulate(guided(1.0), time_step=1 / 60, steps=60, method=replace(method, substeps=32))

    assert met.completed
    assert abs(met.final_state["box"][7]) == pytest.approx(3.0, rel=1e-9)
    assert met.counters["stopped_impacts"] == 0


@pytest.mark.parametrize("restitution", [0.0, 0.1])
def test_what_hardly_rebounds_may_be_stopped(restitution: float) -> None:
    """A hundredth of its energy is no more than solvers leave."""
    assert simulate(guided(restitution), time_step=1 / 60, steps=60).completed


def test_a_stop_whose_rebound_ends_at_the_other_end_leaves_a_run_unsettled() -> None:
    """Where surfaces may touch, a slide on what flies, at 3 m/s between elastic stops 8 mm apart, goes no further in a step than from
    one to the other."""
    slide = solid("slide", Sphere(0.1), (0.0, 0.0, 0.0), velocity=(3.0, 0.0, 0.0), inertia=(0.1,) * 3)
    guide = Prismatic(
        name="guide",
        between=("rail", "slide"),
        axis=(1.0, 0.0, 0.0),
        limit=Limit(lower=-0.004, upper=0.004, restitution=1.0),
    )
    scene = Scene(
        bodies=(
            RigidBody(name="rail", mass=1e3, position=(0.0, 0.0, 0.0), inertia=(1.0,) * 3),
            slide,
            RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, -9.0)),
        ),
        constraints=(guide,),
    )
    lost = simulate(scene, time_step=1 / 60, steps=60)

    assert lost.status == "unsettled"
    assert abs(lost.final_state["slide"][7]) < 1.0
    assert lost.counters["stopped_impacts"] > 0

    met = simulate(scene, time_step=1 / 60, steps=60, method=Method(substeps=16))

    assert met.completed
    assert abs(met.final_state["slide"][7]) == pytest.approx(3.0, rel=0.01)


@pytest.mark.parametrize("restitution", [1.0, 0.5])
@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-4, 0.005])
def test_half_steps_may_begin_with_an_impact(restitution: float, gap: float) -> None:
    """Half a step back from the start was half of what the impact of the first step gives: it met the floor twice as fast."""
    material = Material(restitution=restitution)
    floor = fixed("floor", Plane(), (0.0, 0.0, 0.0), material=material)
    ball = solid("ball", Sphere(0.1), (0.0, 0.0, 0.1 + gap), velocity=(0.0, 0.0, -1.0), material=material)
    run = simulate(
        Scene(bodies=(floor, ball)),
        time_step=0.01,
        duration=0.03,
        method=HALF,
        observe={"speed": Trace(quantity=Velocity("ball"))},
    )
    assert run["speed"][:, 2] == pytest.approx([-1.0, restitution, restitution, restitution], rel=1e-9)


@pytest.mark.parametrize("play", [0.02, 0.04])
def test_half_steps_may_begin_with_several_impacts(play: float) -> None:
    """A ball at 3 m/s to and fro between walls: half of what the impacts change was taken from it, and it began at rest."""
    elastic = Material(restitution=1.0)
    walls = [
        fixed(
            f"wall {side}", Plane((-side, 0.0, 0.0)), (side * (0.05 + play / 2), 0.0, 0.0), material=elastic
        )
        for side in (-1.0, 1.0)
    ]
    ball = solid("ball", Sphere(0.05), (0.003, 0.0, 0.0), velocity=(3.0, 0.0, 0.0), material=elastic)
    run = simulate(
        Scene(bodies=(ball, *walls)),
        time_step=1 / 60,
        steps=60,
        method=HALF,
        observe={"speed": Trace(quantity=Velocity("ball"))},
    )

    assert run.completed
    assert np.abs(run["speed"][:, 0]) == pytest.approx(np.full(61, 3.0), rel=1e-9)
