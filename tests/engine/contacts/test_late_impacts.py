"""What is pushed in a step meets others in the same one: where, by which normal, and what the row of that meeting asks for.

A kinematic ball pushes a body, which without it would not move; only the solve sets it on its way to the next one. Of what
does not move by itself the normal is that of the meeting, or the body would be turned away from a side it never comes to.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from spook_tracker.engine import (
    AngularVelocity,
    Compound,
    Final,
    Method,
    Part,
    Plane,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
)

TIME_STEP = 1.0 / 60.0  # s
SOLVERS = ("direct", "iterative")


def after_a_step(bodies: tuple[RigidBody, ...], solver: str) -> np.ndarray:
    """Velocity and spin (bodies, 6) after one step, m/s and rad/s."""
    result = simulate(
        Scene(bodies=bodies, gravity=(0.0, 0.0, 0.0)),
        time_step=TIME_STEP,
        steps=1,
        method=Method(solver=solver, iterations=200),  # type: ignore[arg-type]
        observe={"v": Final(quantity=Velocity()), "w": Final(quantity=AngularVelocity())},
    )
    return np.hstack([result["v"], result["w"]])


RADIUS = 0.25  # m
GAP = 0.01  # m, between the pusher and the one it pushes
PUSH = 12.0  # m/s
PUSHED = PUSH - GAP / TIME_STEP  # m/s, so that the gap is closed where the step ends


def pushed_ball() -> tuple[RigidBody, ...]:
    """A ball at rest in the origin, about to be pushed along x. A third one beside it, which goes away, is so near that the
    blow of the pusher is not an event at its own time."""
    away = np.array([-0.6, 0.0, 0.8])
    return (
        RigidBody(
            name="pusher",
            motion="kinematic",
            shape=Sphere(RADIUS),
            position=(-2.0 * RADIUS - GAP, 0.0, 0.0),
            velocity=(PUSH, 0.0, 0.0),
        ),
        RigidBody(name="pushed", mass=1.0, shape=Sphere(RADIUS), position=(0.0, 0.0, 0.0)),
        RigidBody(
            name="beside",
            motion="kinematic",
            shape=Sphere(RADIUS),
            position=tuple((2.0 * RADIUS + 5e-4) * away),
            velocity=tuple(away),
        ),
    )


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_ball_pushed_past_a_post_is_turned_by_the_side_it_comes_to(solver: str) -> None:
    post = np.array([0.45, 0.0, 0.35])

    def centre(time: float) -> np.ndarray:
        return np.array([PUSHED * time, 0.0, 0.0])

    meets = brentq(lambda time: np.linalg.norm(centre(time) - post) - 2.0 * RADIUS, 0.0, post[0] / PUSHED)
    normal = (centre(meets) - post) / (2.0 * RADIUS)
    gap = -meets * PUSHED * normal[0]  # along that normal where the step begins

    velocity = after_a_step(
        (*pushed_ball(), RigidBody(name="post", motion="static", shape=Sphere(RADIUS), position=tuple(post))),
        solver,
    )[1]

    upwards = (-gap / TIME_STEP - PUSHED * normal[0]) / normal[2]
    assert velocity == pytest.approx([PUSHED, 0.0, upwards, 0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_ball_pushed_onto_a_wall_that_turns_meets_it_as_it_stands_then(solver: str) -> None:
    facing, place, spin = (
        np.array([-0.8, 0.0, -0.6]),
        np.array([0.38, 0.0, 0.15]),
        np.array([0.0, 2.0, 0.0]),
    )

    def normal_at(time: float) -> np.ndarray:
        turned: np.ndarray = Rotation.from_rotvec(spin * time).apply(facing)
        return turned

    def gap_at(time: float) -> float:
        return float(normal_at(time) @ (np.array([PUSHED * time, 0.0, 0.0]) - place)) - RADIUS

    meets = brentq(gap_at, 0.0, TIME_STEP)
    normal = normal_at(meets)
    surface = np.cross(spin, np.array([PUSHED * meets, 0.0, 0.0]) - RADIUS * normal - place)
    closing = -normal @ (np.array([PUSHED, 0.0, 0.0]) - surface)

    x, y, z, w = Rotation.align_vectors([facing], [[0.0, 0.0, 1.0]])[0].as_quat()
    wall = RigidBody(
        name="wall",
        motion="kinematic",
        shape=Plane(),
        position=tuple(place),
        orientation=(w, x, y, z),
        angular_velocity=tuple(spin),
    )
    velocity = after_a_step((*pushed_ball(), wall), solver)[1]

    upwards = (normal @ surface - meets / TIME_STEP * closing - PUSHED * normal[0]) / normal[2]
    assert velocity == pytest.approx([PUSHED, 0.0, upwards, 0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize("mass", [1.0, 1000.0])
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_far_end_of_a_bell_that_is_hit_meets_what_its_arc_leads_to(solver: str, mass: float) -> None:
    """One end of a dumbbell is hit; the other, nearly at rest at first, swings round its middle towards a ball between them,
    which it does not approach where the step begins. Both rows as they stand, with arms as they were then, give the rest."""
    radius, half, gap, push = 0.1, 0.5, 0.002, 40.0
    ball = np.array([half - 2.0 * radius - 0.01, 0.0, 0.0])
    bell = Compound(tuple(Part(shape=Sphere(radius), position=(x, 0.0, 0.0)) for x in (-half, half)))
    inertia = 0.4 * radius**2 + half**2  # about y, of 1 kg
    # Along x and z, and about y, of both.
    masses = np.array([1.0, 1.0, inertia, mass, mass, 0.4 * mass * radius**2])

    def arm(place: np.ndarray, normal: np.ndarray) -> float:
        return float(place[2] * normal[0] - place[0] * normal[2])

    hit = np.array([0.0, 1.0, arm(np.array([-half, 0.0, -radius]), np.array([0.0, 0.0, 1.0])), 0.0, 0.0, 0.0])
    wanted = push - gap / TIME_STEP
    first = hit / masses * wanted / (hit @ (hit / masses))
    rises, turns = first[1], first[2]

    def end(time: float) -> np.ndarray:
        return np.array([half * np.cos(turns * time), 0.0, rises * time - half * np.sin(turns * time)])

    meets = brentq(lambda time: np.linalg.norm(end(time) - ball) - 2.0 * radius, 1e-6, TIME_STEP)
    normal = (end(meets) - ball) / (2.0 * radius)
    point = ball + radius * normal

    def row(place: np.ndarray, middle: np.ndarray) -> np.ndarray:
        return np.array(
            [
                normal[0],
                normal[2],
                arm(place - middle, normal),
                -normal[0],
                -normal[2],
                -arm(place - ball, normal),
            ]
        )

    middle = np.array([0.0, 0.0, rises * meets])
    begun = -meets * float(row(point, middle) @ first)
    back = row(point - 0.5 * middle, np.zeros(3))  # half-way between both bodies' ways, where the step begins
    rows = np.array([hit, back])
    pushes = np.linalg.solve(rows @ (rows / masses).T, [wanted, -begun / TIME_STEP])
    assert (pushes > 0.0).all()

    found = after_a_step(
        (
            RigidBody(
                name="pusher",
                motion="kinematic",
                shape=Sphere(radius),
                position=(-half, 0.0, -2.0 * radius - gap),
                velocity=(0.0, 0.0, push),
            ),
            RigidBody(name="bell", mass=1.0, shape=bell, position=(0.0, 0.0, 0.0)),
            RigidBody(name="ball", mass=mass, shape=Sphere(radius), position=tuple(ball)),
        ),
        solver,
    )

    assert found[1:, [0, 2, 4]].ravel() == pytest.approx((rows.T @ pushes) / masses, rel=1e-6, abs=1e-6)
