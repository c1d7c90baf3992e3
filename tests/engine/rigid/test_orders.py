"""Rigid bodies beyond plain SPOOK: every method has the order it claims, against answers that are not the engine's."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Ball,
    Box,
    CentralGravity,
    ConstraintForce,
    Hinge,
    JointCoordinate,
    Limit,
    MaximumAbsolute,
    Method,
    MethodError,
    Motor,
    Orientation,
    Position,
    Result,
    RigidBody,
    Scene,
    Spring,
    Universal,
    Velocity,
    Violation,
    compile,
    simulate,
)
from spook_tracker.scalar_tests.mechanisms import swinging_door
from spook_tracker.scalar_tests.rotation import spinning_top
from tests.oracles.rigid_composition import assert_dense_steps, oracle_of
from tests.scenes.corpus import solid
from tests.scenes.rigid import EVERY_JOINT, one_joint
from tests.scenes.seen import finals, traces

HALF = Method(half_step_velocities=True)
CURVED = Method(half_step_velocities=True, corrections=1)
METHODS = {
    "half": (HALF, 2),
    "curved": (CURVED, 2),
    "order4": (Method(composition="order4"), 4),
    "order6": (Method(composition="order6"), 6),
    "order8": (Method(composition="order8"), 8),
}
INERTIA = (0.9144, 1.098, 1.66)  # kg m²
SPIN = (0.3, 2.0, 0.5)  # rad/s
G = 9.81  # m/s²


def free_box() -> Scene:
    box = RigidBody(name="box", position=(0.0, 0.0, 0.0), mass=1.0, inertia=INERTIA, angular_velocity=SPIN)
    return Scene(bodies=(box,))


def rods() -> Scene:
    """Two rods of 1 kg and 1 m, straight out, on hinges across the swing."""
    made = tuple(
        RigidBody(name=name, mass=1.0, inertia=(1 / 12, 1 / 12, 1 / 12), position=(0.5 + i, 0.0, 0.0))
        for i, name in enumerate(("upper", "lower"))
    )
    hinges = tuple(
        Hinge(name=f"hinge {i}", between=ends, at=(float(i), 0.0, 0.0), axis=(0.0, 1.0, 0.0), compliance=0.0)
        for i, ends in enumerate(((WORLD, "upper"), ("upper", "lower")))
    )
    return Scene(bodies=made, constraints=hinges, gravity=(0.0, 0.0, -G))


def rods_at(time: float) -> np.ndarray:
    """Where the lower rod's centre is, from Lagrange's equations in the angles below the horizontal."""

    def slope(_: float, y: np.ndarray) -> list[float]:
        a, b, u, w = y
        mass = np.array([[4 / 3, 0.5 * math.cos(a - b)], [0.5 * math.cos(a - b), 1 / 3]])
        turn = 0.5 * math.sin(a - b)
        push = [1.5 * G * math.cos(a) - turn * w * w, 0.5 * G * math.cos(b) + turn * u * u]
        return [u, w, *np.linalg.solve(mass, push)]

    a, b = solve_ivp(slope, (0.0, time), np.zeros(4), method="DOP853", rtol=3e-14, atol=1e-14).y[:2, -1]
    return np.array([math.cos(a) + 0.5 * math.cos(b), 0.0, -math.sin(a) - 0.5 * math.sin(b)])


def box_at(time: float) -> np.ndarray:
    """Its orientation, from Euler's equations."""
    i = np.array(INERTIA)

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        w, x, z = y[:3], y[3], y[4:]
        return np.concatenate([np.cross(i * w, w) / i, [-0.5 * z @ w], 0.5 * (x * w + np.cross(z, w))])

    start = np.array([*SPIN, 1.0, 0.0, 0.0, 0.0])
    return np.asarray(solve_ivp(slope, (0.0, time), start, method="DOP853", rtol=3e-14, atol=1e-14).y[3:, -1])


def box_error(h: float, method: Method) -> float:
    end = simulate(free_box(), time_step=h, duration=4.0, method=method, observe=finals(q=Orientation("box")))
    exact = box_at(4.0)
    return float(np.abs(end["q"] * np.sign(end["q"] @ exact) - exact).max())


def rods_error(h: float, method: Method) -> float:
    observe = finals(x=Position("lower"))
    end = simulate(rods(), time_step=h, duration=1.0, method=method, observe=observe)
    return float(np.abs(end["x"] - rods_at(1.0)).max())


SCENES: dict[str, tuple[Callable[[float, Method], float], float]] = {  # error, coarsest time step
    "rods": (rods_error, 1 / 32),
    "door": (lambda h, method: swinging_door.ladder_error(simulate, h, method), 1 / 14),
    "top": (lambda h, method: spinning_top.ladder_error(simulate, h, method), 1 / 12),
}


@pytest.mark.parametrize("name", METHODS)
def test_a_free_box_turns_rightly_whatever_the_method_and_the_step(name: str) -> None:
    assert max(box_error(h, METHODS[name][0]) for h in (1.0, 0.1)) < 1e-13


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("place", SCENES)
def test_the_order_is_the_one_claimed(place: str, name: str) -> None:
    """Slope of log error over log h from the steps whose error is above rounding, the coarsest left out: there h times
    the fastest turn is below 1/2, where theory has the order within 0.25 (tests/scalar_tests/test_orders.py)."""
    error, coarsest = SCENES[place]
    method, order = METHODS[name]
    finest = 4 if order < 8 else 3
    steps = [coarsest / (16 if name == "half" else 1) / 2**k for k in range(finest)]
    errors = [error(h, method) for h in steps]
    kept = [(h, e) for h, e in zip(steps[1:], errors[1:], strict=True) if e > 3e-12]

    if len(kept) < 2:
        assert errors[-1] < 1e-10
        kept = list(zip(steps[:2], errors[:2], strict=True))
    slope = np.polyfit(np.log([h for h, _ in kept]), np.log([e for _, e in kept]), 1)[0]
    assert order - 0.3 < slope < order + 0.3, errors


def held(kind: str, bodies: int) -> Scene:
    """A random joint between random bodies, rigid."""
    scene = one_joint(np.random.default_rng(5), kind, bodies)
    rows = tuple(dataclasses.replace(row, compliance=0.0) for row in scene.constraints)
    return dataclasses.replace(scene, constraints=rows)


@pytest.mark.parametrize("bodies", [1, 2])
@pytest.mark.parametrize("kind", EVERY_JOINT)
def test_a_composition_is_the_dense_one_for_every_joint(kind: str, bodies: int) -> None:
    scene = held(kind, bodies)
    assert_dense_steps(scene, 0.04, 5, within=1e-10, oracle=oracle_of(scene))


@pytest.mark.parametrize("kind", EVERY_JOINT)
def test_half_steps_are_of_order_two_for_every_joint(kind: str) -> None:
    """Against the composition of order 8, after a start its rows allow."""
    scene = held(kind, 2)
    ends = finals(x=Position(), v=Velocity(), w=AngularVelocity())
    order8 = Method(composition="order8")
    allowed = simulate(scene, time_step=1e-9, steps=1, method=order8, observe=ends)
    bodies = tuple(
        dataclasses.replace(body, velocity=tuple(v), angular_velocity=tuple(w))
        for body, v, w in zip(scene.bodies, allowed["v"], allowed["w"], strict=True)
    )
    scene = dataclasses.replace(scene, bodies=bodies)
    exact = simulate(scene, time_step=0.01, steps=60, method=order8, observe=ends)

    def errors(h: float) -> list[float]:
        end = simulate(scene, time_step=h, duration=0.6, method=CURVED, observe=ends)
        return [float(np.abs(end[name] - exact[name]).max()) for name in ends]

    for coarse, fine in zip(errors(0.01), errors(0.005), strict=True):
        assert coarse < 0.05
        assert math.log2(coarse / fine) > 1.8


def test_the_force_on_the_tip_carries_the_top_round() -> None:
    """Weight upwards, m r Ω² inwards; order 8 gives it at the sample itself."""
    observe = traces(force=ConstraintForce("tip"), x=Position("top"))
    run = simulate(
        spinning_top.scene(),
        time_step=1 / 120,
        duration=2.0,
        method=Method(composition="order8"),
        observe=observe,
    )
    inwards = -spinning_top.MASS * spinning_top.PRECESSION**2 * run["x"][:, :2]

    assert np.abs(run["force"][:, 2] - spinning_top.MASS * spinning_top.GRAVITY).max() < 1e-7
    assert np.abs(run["force"][:, :2] - inwards).max() < 1e-7


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("pull", ["spring", "centre"])
def test_a_body_without_joints_goes_round_its_circle_in_time(pull: str, name: str) -> None:
    """Beside a swing, which makes the rows; a spring of no length and a central field both ask for w² of the circle."""
    method, order = METHODS[name]
    rate, radius = 1.3, 0.8  # rad/s, m
    free = solid("free", None, (radius, 0.0, 0.0), 2.0, (0.0, rate * radius, 0.0), inertia=INERTIA)
    rod = RigidBody(name="rod", mass=1.0, inertia=INERTIA, position=(0.0, 0.0, 3.0))
    swing = Hinge(name="swing", between=(WORLD, "rod"), at=(1.0, 0.0, 3.0), axis=(0.0, 1.0, 0.0))
    forces = {
        "spring": Spring(name="pull", between=("free", (0.0, 0.0, 0.0)), stiffness=2.0 * rate**2),
        "centre": CentralGravity(name="pull", strength=rate**2 * radius**3),
    }
    scene = Scene(bodies=(free, rod), constraints=(swing,), forces=(forces[pull],))
    ends = traces(x=Position("free"), v=Velocity("free"))

    def error(steps: int) -> float:
        run = simulate(scene, time_step=2.0 / steps, steps=steps, method=method, observe=ends)
        angle = rate * run.sample_times["x"][:, None]
        circle = np.hstack((np.cos(angle), np.sin(angle), 0.0 * angle))
        along = np.hstack((-np.sin(angle), np.cos(angle), 0.0 * angle))
        return max(
            float(np.abs(run["x"] - radius * circle).max()),
            float(np.abs(run["v"] - rate * radius * along).max()),
        )

    assert math.log2(error(10) / error(20)) > order - 0.3


@pytest.mark.parametrize("corrections", [0, 1, 2])
def test_each_correction_is_an_order_of_the_violation(corrections: int) -> None:
    """Linearised rows leave h² of it, the averaged law with its curvature kept h³, then h⁴."""
    method = Method(half_step_velocities=True, corrections=corrections)

    def largest(h: float) -> float:
        observe = {"g": MaximumAbsolute(quantity=Violation("hinge 1"))}
        return float(simulate(rods(), time_step=h, duration=1.0, method=method, observe=observe)["g"].max())

    assert math.log2(largest(1 / 120) / largest(1 / 240)) == pytest.approx(2 + corrections, abs=0.1)


def test_a_joint_started_against_its_stop_is_lost_not_wrong() -> None:
    """A velocity the joint forbids is taken away, as a blow against it would: however large it is in joint
    coordinates. Where rows are solved (a universal joint) one that leads farther than its arm even in the smallest part
    of a step, 0.1 s/2¹¹, finds no way back: named, not a number."""
    order4, place = Method(composition="order4"), finals(x=Position("lower"))

    def run(speed: float, scene: Scene) -> Result:
        fast = dataclasses.replace(scene.bodies[0], velocity=(speed, 0.0, 0.0))
        pushed = dataclasses.replace(scene, bodies=(fast, scene.bodies[1]))
        return simulate(pushed, time_step=0.1, steps=5, method=order4, observe=place)

    lower = rods().constraints[1]
    cross = Universal(
        name="cross", between=(WORLD, "upper"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0),
        cross_axis=(0.0, 0.0, 1.0), compliance=0.0,
    )  # fmt: skip
    crossed = dataclasses.replace(rods(), constraints=(cross, lower))

    still = run(0.0, rods())["x"]
    assert np.abs(run(100.0, rods())["x"] - still).max() < 1e-12
    assert np.abs(run(1e8, rods())["x"] - still).max() < 1e-6  # its digits
    assert (
        np.abs(run(100.0, crossed)["x"] - run(0.0, crossed)["x"]).max() < 0.01
    )  # halved steps beside whole ones
    assert run(1e8, crossed).status == "diverged"
    assert "no motion satisfies" in run(1e8, crossed).failure


def box(name: str, x: float) -> RigidBody:
    return RigidBody(name=name, mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(x, 0.0, 0.0))


@pytest.mark.parametrize("method", [HALF, Method(composition="order6")])
def test_what_a_method_cannot_carry_is_refused_by_name(method: Method) -> None:
    hinge = Hinge(name="knee", between=(WORLD, "a"), axis=(0.0, 0.0, 1.0), limit=Limit(lower=-1.0, upper=1.0))

    if method != HALF:
        why = r"surfaces may touch.*leaves order 1.*half_step_velocities, of order 2 while contacts last.*contacts=False"
        with pytest.raises(MethodError, match=why):
            compile(Scene(bodies=(box("a", 0.0), box("b", 3.0))), time_step=0.01, method=method)
    with pytest.raises(MethodError, match=r"'knee' has a limit; order 1 is the highest"):
        compile(Scene(bodies=(box("a", 0.0),), constraints=(hinge,)), time_step=0.01, method=method)
    with pytest.raises(MethodError, match="needs the direct solver"):
        compile(rods(), time_step=0.01, method=dataclasses.replace(method, solver="iterative"))


def test_a_composition_refuses_what_goes_back_in_time_badly() -> None:
    order4 = Method(composition="order4")
    soft = Ball(name="soft", between=(WORLD, "upper"), at=(0.0, 0.0, 0.0), compliance=1e-3)
    driven = Hinge(name="driven", between=(WORLD, "upper"), axis=(0.0, 1.0, 0.0), motor=Motor(speed=1.0))
    viscous = Spring(name="oil", between=("upper", "lower"), stiffness=1.0, rest_length=1.0, viscosity=1.0)

    for match, changed in (
        ("'soft' has a compliance", dataclasses.replace(rods(), constraints=(soft,))),
        ("the motor of 'driven'.*order 2", dataclasses.replace(rods(), constraints=(driven,))),
        ("viscosity of spring 'oil'", dataclasses.replace(rods(), forces=(viscous,))),
    ):
        with pytest.raises(MethodError, match=match):
            compile(changed, time_step=0.01, method=order4)


def test_a_motor_turns_at_its_speed_with_half_steps() -> None:
    driven = Hinge(name="driven", between=(WORLD, "a"), axis=(0.0, 0.0, 1.0), motor=Motor(speed=2.0))
    observe = finals(angle=JointCoordinate("driven"), spin=AngularVelocity("a"))
    end = simulate(
        Scene(bodies=(box("a", 0.0),), constraints=(driven,)),
        time_step=0.01,
        steps=100,
        method=HALF,
        observe=observe,
    )

    assert end["spin"][2] == pytest.approx(2.0, abs=1e-12)
