"""Tyres against their own law: load, slip along and across, the ellipse of sliding; springs beside bodies' centres."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    Energy,
    Final,
    Hinge,
    JointSpring,
    MaximumAbsolute,
    Method,
    MethodError,
    Momentum,
    Motor,
    Particle,
    Position,
    Result,
    RigidBody,
    Scene,
    SceneError,
    Spring,
    Trace,
    Tyre,
    Velocity,
    simulate,
)
from spook_tracker.engine.protocol import Capabilities, unsupported
from spook_tracker.engine.theory import one_row_matrix
from spook_tracker.scalar_tests.vehicles import cornering
from tests.scenes.corpus import solid

H = 1.0 / 240.0
GRAVITY = 10.0
MASS, SPIN, RADIUS = 300.0, 1.0, 0.3  # kg, kg m², m
STIFFNESS, ALONG, ACROSS = 2e5, 6e4, 5e4  # N/m, N, N/rad
SUNK = MASS * GRAVITY / STIFFNESS
Y = (0.0, 1.0, 0.0)


def tyre(**changes: Any) -> Tyre:
    given: dict[str, Any] = {
        "between": (WORLD, "wheel"),
        "axis": Y,
        "radius": RADIUS,
        "stiffness": STIFFNESS,
        "longitudinal": ALONG,
        "cornering": ACROSS,
        "friction": 0.8,
    }
    return Tyre(name="tyre", **(given | changes))


def wheel(
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    spin: float = 0.0,
    height: float = RADIUS - SUNK,
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY),
    moment: float = SPIN,
    **changes: Any,
) -> Scene:
    """A wheel that cannot tip over, at rest in its tyre if nothing else is said."""
    body = solid(
        "wheel", None, (0.0, 0.0, height), MASS, velocity, (0.0, spin, 0.0), inertia=(1e15, moment, 1e15)
    )
    return Scene(bodies=(body,), constraints=(tyre(**changes),), gravity=gravity)


def test_a_wheel_set_down_without_spin_slides_then_rolls() -> None:
    """Like a bowling ball: v = v₀ − µ g t while it slides, in the end v₀ m r²/(m r² + I) and r w = v."""
    observe = {"v": Trace(quantity=Velocity("wheel")), "w": Trace(quantity=AngularVelocity("wheel"))}
    result = simulate(wheel((10.0, 0.0, 0.0)), time_step=H, steps=60, observe=observe)
    rolls = 10.0 * MASS * RADIUS**2 / (MASS * RADIUS**2 + SPIN)

    np.testing.assert_allclose(result["v"][:8, 0], 10.0 - 8.0 * H * np.arange(8), rtol=1e-12)
    assert float(result["v"][-1, 0]) == pytest.approx(rolls, rel=1e-9)
    assert RADIUS * float(result["w"][-1, 1]) == pytest.approx(rolls, rel=1e-9)


@pytest.mark.parametrize("speed", [3.0, -20.0])
def test_slip_across_dies_out_by_the_slip_angle(speed: float) -> None:
    """m v_y' = −C v_y/V, implicit: v_y shrinks by 1/(1 + h C/(m V)) a step; the wheel rolls on, either way."""
    scene = wheel((speed, 0.05, 0.0), spin=speed / RADIUS)
    result = simulate(scene, time_step=H, steps=30, observe={"v": Trace(quantity=Velocity("wheel"))})
    shrinks = 1.0 / (1.0 + H * ACROSS / (MASS * (abs(speed) + 1e-3)))

    np.testing.assert_allclose(result["v"][:, 1], 0.05 * shrinks ** np.arange(31), rtol=1e-9)
    np.testing.assert_allclose(result["v"][:, 0], speed, rtol=1e-12)


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.5])
def test_a_sliding_wheel_is_held_by_the_ellipse(angle: float) -> None:
    """Locked (it has all inertia there is), at 20 m/s: (F_x/µ_x)² + (F_y/µ_y)² = N², F_x/µ_x : F_y/µ_y of the slips."""
    v = 20.0 * np.array((math.cos(angle), math.sin(angle), 0.0))
    scene = wheel(tuple(map(float, v)), moment=1e15, friction=(0.9, 0.5))
    observe = {"F": Final(quantity=ConstraintForce("tyre")), "v": Final(quantity=Velocity("wheel"))}
    result = simulate(scene, time_step=H, steps=3, observe=observe)
    fx, fy, load = result["F"][:3]
    slips = np.array((ALONG / 0.9, ACROSS / 0.5)) * result["v"][:2]

    assert float(load) == pytest.approx(MASS * GRAVITY, rel=1e-9)
    assert math.hypot(fx / 0.9, fy / 0.5) == pytest.approx(float(load), rel=1e-9)
    np.testing.assert_allclose(
        np.array((fx / 0.9, fy / 0.5)) / load, -slips / np.linalg.norm(slips), atol=1e-8
    )


def thrown_into_a_bend(seed: int, **given: float) -> tuple[Result, float, Any, Any]:
    """What runs for a second, the friction, and of each tyre and step how much it holds and carries [N]."""
    rng = np.random.default_rng(seed)
    friction = float(rng.uniform(0.05, 0.3))
    soft, hard = sorted(map(float, 10.0 ** rng.uniform(4.0, 5.5, 2)))
    speed, steer = float(rng.uniform(10.0, 40.0)), float(rng.uniform(0.05, 0.3))
    asked = cornering.scene(**({"speed": speed, "front": soft, "rear": hard, "steer": steer} | given))
    drive = Motor(speed=300.0, max_force=1500.0) if seed % 2 else None
    constraints = tuple(
        replace(one, friction=friction)
        if isinstance(one, Tyre)
        else replace(one, motor=drive if one.name.startswith("rear") else None)
        for one in asked.constraints
        if isinstance(one, Tyre | Hinge)
    )
    tyres = [one.name for one in constraints if isinstance(one, Tyre)]
    observe = {name: Trace(quantity=ConstraintForce(name)) for name in tyres}
    scene = replace(asked, constraints=constraints)
    result = simulate(scene, time_step=1.0 / 60.0, steps=60, observe=observe)
    forces = np.array([result[name][1:, :3] for name in tyres])
    return result, friction, np.hypot(forces[..., 0], forces[..., 1]), forces[..., 2]


@pytest.mark.parametrize("seed", range(12))
def test_a_vehicle_slides_on_circles_of_friction_for_a_few_factorisations_a_step(seed: int) -> None:
    """Thrown into a bend, rolling or driven: no tyre holds more than µ N, and all agree in some ten factorisations a step, where
    bounds that follow each other took up to a hundred and did not settle."""
    result, friction, held, load = thrown_into_a_bend(seed)
    assert np.all(held <= friction * load + 1e-7 * load.max())
    assert np.any(held > 0.999 * friction * load), "some tyre slides"
    assert result.counters["factorisations"] < 15 * 60


def test_what_two_stiff_tyres_of_one_axle_leave_of_their_circles_is_told() -> None:
    """A million times as stiff as a tyre is, they share the sliding force too freely to agree within a hundred rounds: what is
    left, as the speed that it would have given the wheel, is the result's residual."""
    result, friction, held, load = thrown_into_a_bend(1, front=1e12, rear=1e12)
    left = float(np.max(held - friction * load)) / 60.0 / cornering.WHEEL
    assert left > 1e-6, "they agree by now: the test is to ask stiffer ones"
    assert left <= 1.001 * math.sqrt(2.0) * result.residual  # which is by the larger of along and across
    assert thrown_into_a_bend(1)[0].residual == 0.0


def test_its_load_is_a_spring_that_only_pushes() -> None:
    """Half as deep as at rest it is the discrete one-row spring while pressed; thrown up it flies freely."""
    times, stretch = np.arange(25), 0.5 * SUNK
    matrix = np.array(one_row_matrix(MASS, 1.0 / STIFFNESS, 2.0 * H, H))
    state = np.array((stretch, 0.0))
    expected = []
    for _ in times:
        expected.append(state[0])
        state = matrix @ state
    observe = {"x": Trace(quantity=Position("wheel"))}
    swings = simulate(wheel(height=RADIUS - SUNK + stretch), time_step=H, steps=24, observe=observe)
    flies = simulate(wheel(height=RADIUS + 1.0), time_step=H, steps=24, observe=observe)

    np.testing.assert_allclose(swings["x"][:, 2] - RADIUS + SUNK, expected, rtol=0, atol=1e-12)
    falls = RADIUS + 1.0 - 0.5 * GRAVITY * H**2 * times * (times + 1)
    np.testing.assert_allclose(flies["x"][:, 2], falls, rtol=1e-13)


@pytest.mark.parametrize(("slope", "holds"), [(0.79, True), (0.81, False)])
@pytest.mark.parametrize("across", [True, False])
def test_a_parked_wheel_holds_up_to_its_friction(slope: float, holds: bool, across: bool) -> None:
    side = (0.0, 1.0) if across else (1.0, 0.0)
    gravity = (slope * GRAVITY * side[0], slope * GRAVITY * side[1], -GRAVITY)
    observe = {"x": Final(quantity=Position("wheel"))}
    result = simulate(wheel(gravity=gravity, moment=1e15), time_step=H, steps=120, observe=observe)

    moved = math.hypot(*result["x"][:2])
    # below it creeps by V F/C, V a millimetre a second and more by its own creep; above it slides with g (s − µ)
    assert moved < 2e-4 if holds else moved == pytest.approx(0.5 * 0.1 * 0.25, rel=0.05)


def test_a_road_that_moves_takes_the_wheel_along() -> None:
    road = RigidBody(name="road", motion="kinematic", position=(0.0, 0.0, 0.0), velocity=(5.0, 0.0, 0.0))
    scene = wheel((2.0, 0.0, 0.0))
    observe = {"v": Final(quantity=Velocity("wheel")), "w": Final(quantity=AngularVelocity("wheel"))}
    moving = Scene(
        bodies=(road, *scene.bodies), constraints=(tyre(between=("road", "wheel")),), gravity=scene.gravity
    )
    result = simulate(moving, time_step=H, steps=240, observe=observe)

    # m v + I w/r is what slip cannot change: m v₀ = m v + (I/r²)(v − 5) with r w = v − 5
    share = SPIN / RADIUS**2
    assert float(result["v"][0]) == pytest.approx((MASS * 2.0 + share * 5.0) / (MASS + share), rel=1e-9)
    assert RADIUS * float(result["w"][1]) == pytest.approx(float(result["v"][0]) - 5.0, rel=1e-9)


def test_it_is_named_where_an_engine_lacks_it() -> None:
    spring = JointSpring(stiffness=1.0, max_force=1.0)
    hinge = Hinge(name="axle", between=(WORLD, "wheel"), axis=Y, spring=spring)
    other = replace(wheel(), constraints=(hinge,))
    beside = Spring(name="s", between=(Y, "wheel"), stiffness=1.0, anchors=((0, 0, 0), (0, 0, 1)))
    can = Capabilities(joints=frozenset({Hinge}), forces=frozenset({Spring}), springs=True)

    assert unsupported(can, wheel(), {})[0] == "the joint tyre"
    assert unsupported(can, other, {}) == ("a spring of bounded force in a joint",)
    assert unsupported(can, replace(wheel(), constraints=(), forces=(beside,)), {}) == (
        "a spring beside a body's centre",
    )


def test_wheels_are_dynamic_bodies_and_methods_plain() -> None:
    point = Particle(name="wheel", mass=1.0, position=(0.0, 0.0, 0.3))
    with pytest.raises(SceneError, match="no body named 'ghost'"):
        wheel(between=(WORLD, "ghost"))
    with pytest.raises(SceneError, match="not above its road"):
        wheel(normal=(0.0, 0.0, -1.0))
    with pytest.raises(SceneError, match="'wheel' is a particle"):
        Scene(bodies=(point,), constraints=(tyre(),))
    with pytest.raises(SceneError, match="cannot move"):
        Scene(bodies=(RigidBody(name="wheel", motion="static", position=(0, 0, 0.3)),), constraints=(tyre(),))
    with pytest.raises(MethodError, match="'tyre' has a tyre"):
        simulate(wheel(), time_step=H, steps=1, method=Method(half_step_velocities=True))


# --- springs beside the centre --------------------------------------------------------------------------

BODY = solid("body", None, (0, 0, 0), 2.0, spin=(0.1, 0.2, 0.3), inertia=(0.3, 0.4, 0.5))
SPRING = Spring(
    name="spring",
    between=((0.0, 0.0, 3.0), "body"),
    anchors=((0.0, 0.0, 0.0), (0.3, 0.2, 0.4)),
    stiffness=30.0,
    rest_length=1.0,
)


def test_a_spring_beside_the_centre_pulls_and_turns() -> None:
    """In the first step h F/m and h I⁻¹ (r × F), F = k (|d| − l) along d."""
    still = replace(BODY, angular_velocity=(0.0, 0.0, 0.0))
    observe = {"v": Final(quantity=Velocity("body")), "w": Final(quantity=AngularVelocity("body"))}
    h = 1e-9  # the velocities seen are those of the end, after a turn of h w
    result = simulate(Scene(bodies=(still,), forces=(SPRING,)), time_step=h, steps=1, observe=observe)
    arm = np.array((0.3, 0.2, 0.4))
    d = np.array((0.0, 0.0, 3.0)) - arm
    force = 30.0 * (1.0 - 1.0 / np.linalg.norm(d)) * d

    np.testing.assert_allclose(result["v"], h * force / 2.0, rtol=1e-12)
    np.testing.assert_allclose(
        result["w"], h * np.cross(arm, force) / (0.3, 0.4, 0.5), rtol=1e-12, atol=1e-20
    )


@pytest.mark.parametrize(
    ("method", "order"),
    [(Method(), 1), (Method(half_step_velocities=True), 2), (Method(composition="order4"), 4)],
)
def test_it_keeps_energy_to_the_order_of_the_method(method: Method, order: int) -> None:
    scene = Scene(bodies=(BODY,), forces=(SPRING,), gravity=(0.0, 0.0, -9.81))
    observe = {"E": MaximumAbsolute(quantity=Energy(), from_start=True)}
    off = [
        float(simulate(scene, time_step=1.0 / n, steps=n, method=method, observe=observe)["E"])
        for n in (60, 120)
    ]

    assert math.log2(off[0] / off[1]) == pytest.approx(order, abs=0.3)


def test_two_bodies_it_ties_keep_their_momenta() -> None:
    other = replace(BODY, name="other", position=(1.0, 2.0, 1.0), velocity=(0.1, 0.0, 0.0))
    tie = replace(
        SPRING, between=("other", "body"), anchors=((0.0, -0.5, 0.1), (0.3, 0.2, 0.4)), viscosity=2.0
    )
    observe = {
        "p": MaximumAbsolute(quantity=Momentum(), from_start=True),
        "L": MaximumAbsolute(quantity=AngularMomentum(), from_start=True),
        "E": Trace(quantity=Energy()),
    }
    result = simulate(Scene(bodies=(BODY, other), forces=(tie,)), time_step=1e-3, steps=500, observe=observe)

    assert float(np.abs(result["p"]).max()) < 1e-13
    assert float(np.abs(result["L"]).max()) < 0.02  # first order: each arm is that of the step's start
    assert float(result["E"][-1]) < float(result["E"][0])


def test_a_spring_on_what_has_only_a_centre_is_refused() -> None:
    point = Particle(name="body", mass=1.0, position=(0.0, 0.0, 0.0))
    with pytest.raises(SceneError, match="particle 'body' has only its centre"):
        Scene(bodies=(point,), forces=(SPRING,))
    with pytest.raises(SceneError, match="point of the world already"):
        replace(SPRING, anchors=((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    with pytest.raises(SceneError, match="anchors must be two points"):
        replace(SPRING, anchors=((1.0, 0.0, 0.0),))  # type: ignore[arg-type]


# --- a joint spring of bounded force --------------------------------------------------------------------


def test_a_spring_of_bounded_force_gives_way_and_holds_again() -> None:
    """A flywheel on a spring too weak for it: it slows down with F/I, is turned back, and swings within the spring's reach."""
    body = solid("wheel", None, (0, 0, 0), spin=(0, 3.0, 0), inertia=(2.0, 2.0, 2.0))
    spring = JointSpring(stiffness=50.0, max_force=4.0)
    hinge = Hinge(name="axle", between=(WORLD, "wheel"), axis=Y, compliance=0.0, spring=spring)
    observe = {"w": Trace(quantity=AngularVelocity("wheel"))}
    result = simulate(Scene(bodies=(body,), constraints=(hinge,)), time_step=H, steps=600, observe=observe)
    change = np.diff(result["w"][:, 1]) / H

    assert float(np.abs(change).max()) <= 2.0 * (1.0 + 1e-12)
    np.testing.assert_allclose(change[40:200], -2.0, rtol=1e-12)
    with pytest.raises(MethodError, match="'axle' has a spring of bounded force"):
        simulate(
            Scene(bodies=(body,), constraints=(hinge,)),
            time_step=H,
            steps=1,
            method=Method(half_step_velocities=True),
        )


def test_a_car_parked_askew_is_held_by_iterations_as_well() -> None:
    """Bounds of sliding that were a step late took turns, and it crept .7 m a minute; at 1/240 s it did not."""
    chassis = RigidBody(name="car", mass=1000.0, position=(0.0, 0.0, 0.5), inertia=(300.0, 1200.0, 1300.0))
    places = {f"{i}{k}": (x, y, RADIUS) for i, x in enumerate((-1.3, 1.3)) for k, y in enumerate((-0.7, 0.7))}
    wheels = [
        RigidBody(name="w" + n, mass=20.0, position=place, inertia=(0.6, 1.0, 0.6))
        for n, place in places.items()
    ]
    brakes = [
        Hinge(
            name="h" + n, between=("car", "w" + n), at=place, axis=Y, motor=Motor(speed=0.0, max_force=3000.0)
        )
        for n, place in places.items()
    ]
    tyres = [
        replace(tyre(between=(WORLD, "w" + n), longitudinal=8e4, cornering=8e4, friction=0.9), name="t" + n)
        for n in places
    ]
    slope = math.radians(10.0)
    down = 0.7 * GRAVITY * math.sin(slope)
    scene = Scene(
        bodies=(chassis, *wheels),
        constraints=(*brakes, *tyres),
        gravity=(down, down, -GRAVITY * math.cos(slope)),
    )
    result = simulate(
        scene,
        time_step=1 / 60,
        duration=10.0,
        method=Method(solver="iterative"),
        observe={"x": Trace(quantity=Position("car"))},
    )

    crept = result["x"][-1] - result["x"][300]  # in the last 5 s, when it no longer rocks
    assert result.completed
    assert np.linalg.norm(crept) < 2e-3
