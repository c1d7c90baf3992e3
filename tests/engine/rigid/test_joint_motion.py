"""Every joint moves its bodies as tight references in coordinates without constraints say.

The plain step is first order in the trajectory (half a step early), so each test asks for order one, and that
Richardson's 2 x(h/2) − x(h) is right to second order: that leaves no room for a wrong mass, arm or axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Ball,
    Box,
    ConstraintForce,
    Distance,
    Hinge,
    JointCoordinate,
    Lock,
    MaximumAbsolute,
    Orientation,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Trace,
    Universal,
    simulate,
)
from spook_tracker.engine.observe import Quantity
from tests.oracles.particles import Array
from tests.oracles.rigid import conjugate, product, rotation
from tests.scenes.corpus import solid

GRAVITY = 9.81  # m/s²
DOWN = (0.0, 0.0, -GRAVITY)
RIGID = 1e-12  # m/N and rad/(N m)
DURATION = 2.0  # s


def traced(scene: Scene, h: float, quantity: Quantity) -> Array:
    """The quantity at 21 times 0 … DURATION."""
    every = round(DURATION / 20.0 / h)
    observe = {"seen": Trace(quantity=quantity, every=every)}
    return simulate(scene, time_step=h, duration=DURATION, observe=observe)["seen"]  # type: ignore[no-any-return]


TIMES = np.linspace(0.0, DURATION, 21)


def assert_converges(seen: Callable[[float], Array], exact: Array, h: float, close: float) -> None:
    """Order one at h, h/2, and the extrapolation within `close`, falling with order two."""
    coarse, middle, fine = seen(h), seen(0.5 * h), seen(0.25 * h)
    order = math.log2(np.abs(coarse - exact).max() / np.abs(middle - exact).max())
    twice = [np.abs(2.0 * b - a - exact).max() for a, b in ((coarse, middle), (middle, fine))]

    assert order == pytest.approx(1.0, abs=0.15)
    assert twice[1] < close
    assert math.log2(twice[0] / twice[1]) > 1.5


def pendulum_angle(rate: float, amplitude: float, t: Array) -> Array:
    """Angle from hanging [rad] after a start at rest at `amplitude`: sin(θ/2) = k cd(rate t | k²)."""
    k = math.sin(0.5 * amplitude)
    _, cn, dn, _ = ellipj(rate * t, k * k)
    return 2.0 * np.arcsin(k * cn / dn)


def test_a_hinge_makes_a_physical_pendulum() -> None:
    """A plank hinged .4 m off its centre, let go at 60°: Jacobi's functions with w² = m g d/(I + m d²)."""
    mass, arm, size = 3.0, 0.4, (1.2, 0.1, 0.3)
    inertia = mass * (size[0] ** 2 + size[2] ** 2) / 12.0
    start = math.radians(60.0)
    turned = 0.5 * math.pi - start  # the plank's x axis points from the pivot to its centre
    plank = solid(
        "plank",
        Box(size),
        (arm * math.cos(turned), 0.0, -arm * math.sin(turned)),
        mass,
        orientation=(math.cos(0.5 * turned), 0.0, math.sin(0.5 * turned), 0.0),
    )
    hinge = Hinge(
        name="hinge", between=(WORLD, "plank"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), compliance=RIGID
    )
    scene = Scene(bodies=(plank,), constraints=(hinge,), gravity=DOWN)
    rate = math.sqrt(mass * GRAVITY * arm / (inertia + mass * arm**2))
    exact = start - pendulum_angle(rate, start, TIMES)

    assert_converges(lambda h: traced(scene, h, JointCoordinate("hinge")), exact, 0.005, 2e-4)


def test_a_ball_joint_makes_a_heavy_top() -> None:
    """A tumbling body with three different moments held at a point: Euler's equations about that point."""
    moments, mass = np.array([0.3, 0.4, 0.5]), 2.0
    arm = np.array([0.1, 0.2, 0.6])  # pivot to centre, body axes
    q0 = np.array([0.8, 0.3, -0.4, 0.33])
    q0 /= np.linalg.norm(q0)
    w0 = np.array([0.5, -1.0, 4.0])  # body axes
    about_pivot = np.diag(moments) + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    def slope(_: float, y: Array) -> Array:
        q, w = y[:4], y[4:]
        torque = np.cross(arm, mass * rotation(q).T @ np.array(DOWN))
        return np.concatenate(
            [
                0.5 * product(q, np.concatenate([[0.0], w])),
                np.linalg.solve(about_pivot, torque - np.cross(w, about_pivot @ w)),
            ]
        )

    solved = solve_ivp(
        slope, (0.0, DURATION), np.concatenate([q0, w0]), "DOP853", TIMES, rtol=1e-12, atol=1e-12
    )
    exact = np.array([rotation(q / np.linalg.norm(q)) @ arm for q in solved.y[:4].T])
    spin = rotation(q0) @ w0
    top = solid(
        "top",
        None,
        tuple(rotation(q0) @ arm),
        mass,
        tuple(np.cross(spin, rotation(q0) @ arm)),
        tuple(spin),
        inertia=tuple(moments),
        orientation=tuple(q0),
    )
    pivot = Ball(name="pivot", between=(WORLD, "top"), at=(0.0, 0.0, 0.0), compliance=RIGID)
    scene = Scene(bodies=(top,), constraints=(pivot,), gravity=DOWN)

    assert_converges(lambda h: traced(scene, h, Position("top")), exact, 0.002, 2e-3)


def test_a_prismatic_joint_lets_a_body_slide_along_an_incline() -> None:
    """½ g sin α t (t + h) to rounding, without turning, its rail carrying m g cos α across and the tilt torque."""
    slope, h = math.radians(30.0), 0.01
    axis = (math.cos(slope), 0.0, -math.sin(slope))
    sled = RigidBody(name="sled", mass=4.0, shape=Box((0.5, 0.2, 0.1)), position=(0.0, 0.0, 2.0))
    rail = Prismatic(name="rail", between=(WORLD, "sled"), at=(0.0, 0.0, 1.5), axis=axis, compliance=1e-9)
    scene = Scene(bodies=(sled,), constraints=(rail,), gravity=DOWN)
    observe = {
        "s": Trace(quantity=JointCoordinate("rail")),
        "q": MaximumAbsolute(quantity=Orientation("sled"), from_start=True),
        "f": Trace(quantity=ConstraintForce("rail"), first=150),
    }
    result = simulate(scene, time_step=h, steps=200, observe=observe)
    t = result.sample_times["s"]
    across = 4.0 * GRAVITY * math.cos(slope) * np.array([math.sin(slope), 0.0, math.cos(slope)])
    torque = np.cross([0.0, 0.0, 0.5], across)  # the joint sits half a metre below the centre

    assert np.abs(result["s"] - 0.5 * GRAVITY * math.sin(slope) * t * (t + h)).max() < 1e-6
    assert result["q"].max() < 1e-6
    np.testing.assert_allclose(result["f"][-1], [*across, *torque], rtol=0.0, atol=1e-5)


def test_a_universal_joint_lets_two_axes_turn() -> None:
    """A lopsided body on a cross in the ceiling: rotation about the pivot with one torque along the blocked axis."""
    moments, mass = np.array([0.2, 0.3, 0.25]), 1.5
    arm, axis, cross = np.array([0.1, -0.15, -0.7]), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    about_pivot = np.diag(moments) + mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    w0 = np.array([1.5, -2.0, 0.0])  # no spin about z, the blocked axis

    def slope(_: float, y: Array) -> Array:
        q, w = y[:4], y[4:]  # w in world axes
        r = rotation(q)
        inertia, carried = r @ about_pivot @ r.T, r @ cross
        blocked = np.cross(carried, axis)
        torque = np.cross(r @ arm, mass * np.array(DOWN)) - np.cross(w, inertia @ w)
        drift = np.cross(np.cross(w, carried), axis) @ w  # d(blocked)/dt · w
        free = np.linalg.solve(inertia, torque)
        push = np.linalg.solve(inertia, blocked)
        turned = free - push * (blocked @ free + drift) / (blocked @ push)
        return np.concatenate([0.5 * product(np.concatenate([[0.0], w]), q), turned])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], w0])
    solved = solve_ivp(slope, (0.0, DURATION), start, "DOP853", TIMES, rtol=1e-12, atol=1e-12)
    exact = np.array([rotation(q / np.linalg.norm(q)) @ arm for q in solved.y[:4].T])
    body = solid("body", None, tuple(arm), mass, tuple(np.cross(w0, arm)), tuple(w0), inertia=tuple(moments))
    joint = Universal(
        name="cross", between=(WORLD, "body"), at=(0.0, 0.0, 0.0), axis=tuple(axis), cross_axis=tuple(cross),
        compliance=RIGID,
    )  # fmt: skip
    scene = Scene(bodies=(body,), constraints=(joint,), gravity=DOWN)

    assert_converges(lambda h: traced(scene, h, Position("body")), exact, 0.002, 1e-3)


def test_a_distance_holds_a_bar_by_its_end() -> None:
    """A bar on a massless rod, both let go at an angle: Lagrange's equations in the two angles."""
    mass, inertia, length, arm = 2.0, 0.3, 0.8, 0.5
    first, second = math.radians(50.0), math.radians(-20.0)

    def slope(_: float, y: Array) -> Array:
        a, b, da, db = y
        m = np.array(
            [
                [mass * length**2, mass * length * arm * math.cos(a - b)],
                [mass * length * arm * math.cos(a - b), inertia + mass * arm**2],
            ]
        )
        turn = mass * length * arm * math.sin(a - b)
        right = [
            -turn * db**2 - mass * GRAVITY * length * math.sin(a),
            turn * da**2 - mass * GRAVITY * arm * math.sin(b),
        ]
        return np.concatenate([[da, db], np.linalg.solve(m, right)])

    def centre(a: Array, b: Array) -> Array:
        x, z = length * np.sin(a) + arm * np.sin(b), -length * np.cos(a) - arm * np.cos(b)
        return np.stack([x, np.zeros_like(x), z], axis=-1)

    y0 = [first, second, 0.0, 0.0]
    solved = solve_ivp(slope, (0.0, DURATION), y0, "DOP853", TIMES, rtol=1e-12, atol=1e-12)
    half = -0.5 * second  # turned about y so that its −z axis points along (sin b, 0, −cos b)
    bar = solid(
        "bar",
        None,
        tuple(centre(np.array(first), np.array(second))),
        mass,
        inertia=(inertia, inertia, 0.1),
        orientation=(math.cos(half), 0.0, math.sin(half), 0.0),
    )
    rod = Distance(
        name="rod",
        between=((0.0, 0.0, 0.0), "bar"),
        anchors=((0.0, 0.0, 0.0), (0.0, 0.0, arm)),
        compliance=RIGID,
    )
    scene = Scene(bodies=(bar,), constraints=(rod,), gravity=DOWN)
    assert scene.length(rod) == pytest.approx(length, abs=1e-12)

    assert_converges(lambda h: traced(scene, h, Position("bar")), centre(*solved.y[:2]), 0.002, 1e-3)


def test_locked_bodies_turn_as_one() -> None:
    """Two boxes locked end to end and thrown: Euler's equations with the moments of both together."""
    mass, moments, arm = 1.5, np.array([0.2, 0.25, 0.3]), 0.5
    joined = 2.0 * moments + 2.0 * mass * np.array([0.0, arm**2, arm**2])
    w0 = np.array([2.0, 0.5, 1.0])

    def slope(_: float, y: Array) -> Array:
        q, w = y[:4], y[4:]
        return np.concatenate(
            [0.5 * product(q, np.concatenate([[0.0], w])), -np.cross(w, joined * w) / joined]
        )

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], w0])
    solved = solve_ivp(slope, (0.0, DURATION), start, "DOP853", TIMES, rtol=1e-12, atol=1e-12)
    exact = np.array([rotation(q / np.linalg.norm(q)) @ (arm, 0.0, 0.0) for q in solved.y[:4].T])
    bodies = tuple(
        solid(
            name,
            None,
            (sign * arm, 0.0, 0.0),
            mass,
            tuple(np.cross(w0, [sign * arm, 0.0, 0.0])),
            tuple(w0),
            inertia=tuple(moments),
        )
        for name, sign in (("right", 1.0), ("left", -1.0))
    )
    lock = Lock(name="lock", between=("left", "right"), at=(0.0, 0.0, 0.0), compliance=RIGID)
    scene = Scene(bodies=bodies, constraints=(lock,))

    errors = [np.abs(traced(scene, h, Position("right")) - exact).max() for h in (0.004, 0.002)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)  # no force, so no early half step
    assert errors[1] < 1e-4


def test_a_parallelogram_of_hinges_swings_as_one_pendulum() -> None:
    """A closed loop with more rows than it needs: two cranks and a coupler that never turns."""
    crank, coupler, length, span, start = 1.0, 2.0, 0.6, 1.0, math.radians(40.0)
    inertia = crank * length**2 / 12.0

    def bar(name: str, x: float) -> RigidBody:
        half = -0.5 * start
        return solid(
            name,
            None,
            (x + 0.5 * length * math.sin(start), 0.0, -0.5 * length * math.cos(start)),
            crank,
            inertia=(inertia, inertia, 0.01),
            orientation=(math.cos(half), 0.0, math.sin(half), 0.0),
        )

    low = (length * math.sin(start), -length * math.cos(start))
    bodies = (
        bar("left", 0.0),
        bar("right", span),
        solid("coupler", None, (low[0] + 0.5 * span, 0.0, low[1]), coupler, inertia=(0.1, 0.2, 0.2)),
    )

    def pin(first: str, second: str, x: float, z: float) -> Hinge:
        return Hinge(
            name=f"{first} {second}",
            between=(first, second),
            at=(x, 0.0, z),
            axis=(0.0, 1.0, 0.0),
            compliance=1e-10,
        )

    joints = (
        pin(WORLD, "left", 0.0, 0.0),
        pin(WORLD, "right", span, 0.0),
        pin("left", "coupler", *low),
        pin("right", "coupler", low[0] + span, low[1]),
    )
    scene = Scene(bodies=bodies, constraints=joints, gravity=DOWN)
    heavy = GRAVITY * (crank * length + coupler * length)
    rate = math.sqrt(heavy / (2.0 * (inertia + crank * (0.5 * length) ** 2) + coupler * length**2))
    exact = start - pendulum_angle(rate, start, TIMES)

    assert_converges(lambda h: traced(scene, h, JointCoordinate("world left")), exact, 0.004, 1e-3)
    turn = traced(scene, 0.002, Orientation("coupler"))
    assert np.abs(turn - turn[0]).max() < 1e-7


def test_the_pendulum_reference_has_its_period() -> None:
    amplitude, rate = 1.0, 3.0
    period = 4.0 * ellipk(math.sin(0.5 * amplitude) ** 2) / rate

    assert pendulum_angle(rate, amplitude, np.array([period]))[0] == pytest.approx(amplitude, abs=1e-7)


def test_orientation_and_angular_velocity_belong_together() -> None:
    """The rotation vector of one step is h times the angular velocity, to second order, in world axes."""
    body = solid(
        "body",
        None,
        (0.0, 0.0, 0.0),
        spin=(1.0, -2.0, 0.5),
        inertia=(0.5, 0.6, 0.7),
        orientation=(0.5, 0.5, -0.5, 0.5),
    )
    h = 1e-4
    observe = {"q": Trace(quantity=Orientation("body")), "w": Trace(quantity=AngularVelocity("body"))}
    result = simulate(Scene(bodies=(body,)), time_step=h, steps=1, observe=observe)
    turn = product(result["q"][1], conjugate(result["q"][0]))

    assert np.abs(2.0 * turn[1:] / h - result["w"].mean(axis=0)).max() < 1e-7
