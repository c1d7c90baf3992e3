"""Symmetric compositions have the order they claim, on scenes with and without rows, against independent answers."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    WORLD,
    CentralGravity,
    ConstraintForce,
    Distance,
    Energy,
    Hinge,
    JointSpring,
    Load,
    Method,
    Particle,
    Position,
    RigidBody,
    Run,
    Scene,
    Velocity,
    simulate,
    start,
)
from tests.scenes.seen import finals, traces

G = 9.81
ORDERS = {"order4": 4, "order6": 6, "order8": 8}


def line(links: int) -> Scene:
    bodies = [Particle(name=f"{i}", mass=1.0, position=(i + 1.0, 0.0, 0.0)) for i in range(links)]
    rows = [
        Distance(name=f"row {i}", between=(f"{i - 1}" if i else (0.0, 0.0, 0.0), f"{i}"), rest_length=1.0)
        for i in range(links)
    ]
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -G))


def planet(eccentricity: float = 0.3) -> Scene:
    speed = math.sqrt((1 + eccentricity) / (1 - eccentricity))
    body = Particle(name="planet", mass=1.0, position=(1 - eccentricity, 0, 0), velocity=(0.0, speed, 0.0))
    return Scene(bodies=(body,), forces=(CentralGravity(name="sun", strength=1.0),))


def planet_at(time: float, eccentricity: float = 0.3) -> np.ndarray:
    """Kepler's equation, by Newton's method; semi-major axis 1, mean motion 1."""
    anomaly = time
    for _ in range(50):
        anomaly -= (anomaly - eccentricity * math.sin(anomaly) - time) / (
            1 - eccentricity * math.cos(anomaly)
        )
    return np.array(
        [math.cos(anomaly) - eccentricity, math.sqrt(1 - eccentricity**2) * math.sin(anomaly), 0.0]
    )


def chain_tip(links: int, time: float) -> np.ndarray:
    """The tip of the chain in minimal coordinates, angles below the horizontal, by SciPy."""
    index = np.arange(links)
    below = links - np.maximum.outer(index, index)

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        angle, speed = state[:links], state[links:]
        difference = angle[:, None] - angle[None, :]
        push = -(below * np.sin(difference)) @ speed**2 - G * (links - index) * np.cos(angle)
        return np.concatenate([speed, np.linalg.solve(below * np.cos(difference), push)])

    answer = solve_ivp(rate, (0, time), np.zeros(2 * links), method="DOP853", rtol=1e-13, atol=1e-14)
    angle = answer.y[:links, -1]
    return np.array([np.cos(angle).sum(), 0.0, np.sin(angle).sum()])


def error(scene: Scene, body: str, reference: np.ndarray, time: float, time_step: float, name: str) -> float:
    result = simulate(
        scene,
        time_step=time_step,
        duration=time,
        method=Method(composition=name),
        observe=finals(x=Position(body)),
    )
    return float(np.abs(result["x"] - reference).max())


def observed_order(coarse: float, fine: float) -> float:
    return math.log2(coarse / fine)


@pytest.mark.parametrize(("name", "steps"), [("order4", 200), ("order6", 60), ("order8", 50)])
def test_the_order_holds_on_an_orbit(name: str, steps: int) -> None:
    errors = [error(planet(), "planet", planet_at(10.0), 10.0, 10 / n, name) for n in (steps, 2 * steps)]

    assert observed_order(*errors) == pytest.approx(ORDERS[name], abs=0.4)


def test_the_chain_of_26_goes_beyond_the_peers_accuracy() -> None:
    """1.9e-5 m at h = 1/60 is what a Runge-Kutta engine in joint coordinates reaches."""
    assert error(line(26), "25", chain_tip(26, 2.0), 2.0, 1 / 60, "order4") < 1.9e-5
    assert error(line(26), "25", chain_tip(26, 2.0), 2.0, 1 / 60, "order8") < 1e-9


def test_velocities_are_those_of_the_sample_and_lie_along_the_circle() -> None:
    result = simulate(
        line(1),
        time_step=1 / 100,
        duration=3.0,
        method=Method(composition="order6"),
        observe=traces(x=Position("0"), v=Velocity("0"), force=ConstraintForce("row 0")),
    )
    x, v = result["x"], result["v"]

    assert np.abs((x * v).sum(axis=1)).max() < 1e-12
    assert np.abs((v**2).sum(axis=1) + 2 * G * x[:, 2]).max() < 1e-7  # energy
    tension = (v**2).sum(axis=1) - G * x[:, 2]  # m (v²/l + g cos)
    assert np.abs(result["force"] - tension)[1:].max() < 1e-10


def test_going_back_in_time_comes_back_to_the_start() -> None:
    """The composition is symmetric: reversed velocities retrace the path, up to rounding."""
    method = Method(composition="order4")
    there = simulate(line(3), time_step=0.02, steps=100, method=method).final_state
    bodies = [
        Particle(name=name, mass=1.0, position=tuple(state[:3]), velocity=tuple(-state[7:10]))
        for name, state in there.items()
    ]
    scene = line(3)
    back = simulate(
        Scene(bodies=bodies, constraints=scene.constraints, gravity=scene.gravity),
        time_step=0.02,
        steps=100,
        method=method,
    ).final_state

    for i in range(3):
        assert back[f"{i}"][:3] == pytest.approx([i + 1.0, 0.0, 0.0], abs=1e-10)


def test_a_whip_is_halved_not_lost() -> None:
    """At this step the chain's whip crack has no solution within a stage; the step is done in parts."""
    result = simulate(line(26), time_step=1 / 60, duration=10.0, method=Method(composition="order4"))

    assert result.completed
    assert result.counters["halved_steps"] > 0


def test_rows_that_cannot_all_hold_end_the_run() -> None:
    """A body stretched between two walls cannot move sideways: no part of a step has a solution."""
    scene = Scene(
        bodies=(Particle(name="0", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0)),),
        constraints=(
            Distance(name="left", between=((-1.0, 0.0, 0.0), "0")),
            Distance(name="right", between=("0", (1.0, 0.0, 0.0))),
        ),
    )
    result = simulate(
        scene, time_step=0.1, steps=100_000, method=Method(composition="order8"), time_limit=5.0
    )

    assert result.status == "not_finite"
    assert (result.failed_body, result.failed_step, result.steps) == ("0", 1, 0)


@pytest.mark.parametrize("steps", [1, 2, 25])
def test_what_cannot_be_read_is_no_answer(steps: int) -> None:
    """Two rows of ten million kilometres from places next to each other are the same to rounding: what they share between
    them has no answer, and a run that is asked for it says so instead of giving none."""
    far = Particle(
        name="far",
        mass=3.0093846376260265,
        position=(0.44243727823566315, -11430029772.51713, 0.27432970785687516),
        velocity=(-0.9244847027246674, 0.7160325333241468, 2.0856026730339603),
    )
    places = (
        (0.41470853996604123, 0.5773027204846336, -0.17204804581774602),
        (1.317965792477156, 0.9979624139949076, 1.5489124201358133),
    )
    rows = (
        Distance(name="one", between=("far", places[0]), compliance=0.0),
        Distance(name="other", between=(places[1], "far")),
    )
    scene = Scene(bodies=(far,), constraints=rows, gravity=(0.0, 0.0, -9.81))
    observe = traces(f=ConstraintForce(), e=Energy())
    run = simulate(scene, time_step=1e-9, steps=steps, method=Method(composition="order4"), observe=observe)

    assert run.status == "not_finite" and "'far'" in run.failure


INERTIA, STIFFNESS, PUSH, REST = 0.3, 4.0, 6.0, 0.8  # kg m², N m/rad, N, rad


def swing(kind: str) -> Scene:
    """A bob of 1 kg at 1 m, level; as a particle, as a body on a hinge, and with a spring in the hinge."""
    push = Load(name="push", body="bob")
    if kind == "particle":
        bob = Particle(name="bob", mass=1.0, position=(1.0, 0.0, 0.0))
        rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "bob"))
        return Scene(bodies=(bob,), constraints=(rod,), forces=(push,), gravity=(0.0, 0.0, -G))
    body = RigidBody(name="bob", mass=1.0, inertia=(INERTIA,) * 3, position=(1.0, 0.0, 0.0))
    spring = JointSpring(stiffness=STIFFNESS, damping=0.0) if kind == "spring" else None
    hinge = Hinge(name="rod", between=(WORLD, "bob"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), spring=spring)
    return Scene(bodies=(body,), constraints=(hinge,), forces=(push,), gravity=(0.0, 0.0, -G))


def swing_at(kind: str, change: float, end: float) -> np.ndarray:
    """Its place by DOP853, in two pieces."""

    def motion(push: float, rest: float) -> Callable[[float, np.ndarray], tuple[float, float]]:
        def rates(_: float, state: np.ndarray) -> tuple[float, float]:
            angle, rate = state
            torque = G * math.cos(angle) - push * math.sin(angle)
            torque -= STIFFNESS * (angle - rest) if kind == "spring" else 0.0
            return rate, torque / (1.0 if kind == "particle" else 1.0 + INERTIA)

        return rates

    state = np.zeros(2)
    later = (0.0, REST) if kind == "spring" else (PUSH, 0.0)
    for (push, rest), span in (((0.0, 0.0), change), (later, end - change)):
        state = solve_ivp(motion(push, rest), (0.0, span), state, method="DOP853", rtol=1e-12, atol=1e-13).y[
            :, -1
        ]
    return np.array([math.cos(state[0]), 0.0, -math.sin(state[0])])


@pytest.mark.parametrize("name", ORDERS)
@pytest.mark.parametrize("kind", ["particle", "hinge", "spring"])
def test_what_is_set_between_two_steps_acts_from_there_on(kind: str, name: str) -> None:
    """Momenta wait for their last half kick until the next stage: it was made with what was set since."""

    def change(run: Run) -> None:
        if kind == "spring":
            run.set_rest("rod", REST)
        else:
            run.set_load("push", force=(PUSH, 0.0, 0.0))

    def error(steps: int) -> float:
        with start(swing(kind), time_step=1.0 / steps, method=Method(composition=name)) as run:
            run.step(steps // 2)
            change(run)
            run.step(steps // 2)
            return float(np.abs(run.state["bob"][:3] - swing_at(kind, 0.5, 1.0)).max())

    assert error(100) < 1e-6
    coarse = 64 // ORDERS[name] // 2 * 2  # above rounding
    assert math.log2(error(coarse) / error(2 * coarse)) > ORDERS[name] - 0.6
