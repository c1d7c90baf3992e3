"""Motors that push with a given force, bounds that follow the time, and friction in joints, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    ConstraintForce,
    Cylindrical,
    Final,
    Hinge,
    JointCoordinate,
    KineticEnergy,
    Method,
    MethodError,
    Motor,
    Plane,
    Prismatic,
    Ramp,
    Relation,
    RigidBody,
    Scene,
    SceneError,
    Sinusoid,
    Sphere,
    Table,
    Trace,
    Velocity,
    simulate,
    start,
)
from tests.scenes.corpus import solid

Z, X = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
H = 0.01  # s
INERTIA = 0.5  # kg m²


def wheel(speed: float = 0.0, **joint: Any) -> Scene:
    body = solid("wheel", None, (0.0, 0.0, 0.0), 2.0, spin=(0.0, 0.0, speed), inertia=(1.0, 1.0, INERTIA))
    axle = Hinge(name="axle", between=(WORLD, "wheel"), axis=Z, compliance=0.0, **joint)
    return Scene(bodies=(body,), constraints=(axle,))


def spun(scene: Scene, steps: int = 100, **more: Any) -> np.ndarray:
    observe = {"w": Trace(quantity=AngularVelocity("wheel"))}
    return np.asarray(simulate(scene, time_step=H, steps=steps, observe=observe, **more)["w"])[:, 2]


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_a_motor_of_given_force_speeds_up_by_it_whatever_the_speed(solver: Any) -> None:
    w = spun(wheel(speed=-1.0, motor=Motor(force=3.0)), method=Method(solver=solver))
    np.testing.assert_allclose(w, -1.0 + 3.0 / INERTIA * H * np.arange(101), rtol=0.0, atol=1e-12)


def test_a_motor_pushes_back_on_the_body_it_stands_on() -> None:
    bodies = tuple(
        RigidBody(name=n, mass=1.0, inertia=(1.0, 1.0, i), position=(0.0, 0.0, 0.0))
        for n, i in (("a", 2.0), ("b", 0.5))
    )
    hinge = Hinge(name="hinge", between=("a", "b"), axis=Z, compliance=0.0, motor=Motor(force=1.5))
    observe = {n: Final(quantity=AngularVelocity(n)) for n in "ab"} | {
        "f": Final(quantity=ConstraintForce("hinge"))
    }
    result = simulate(Scene(bodies=bodies, constraints=(hinge,)), time_step=H, steps=50, observe=observe)
    np.testing.assert_allclose(result["a"], (0.0, 0.0, -1.5 / 2.0 * 0.5), atol=1e-12)
    np.testing.assert_allclose(result["b"], (0.0, 0.0, 1.5 / 0.5 * 0.5), atol=1e-12)
    np.testing.assert_allclose(result["f"][5], 1.5, rtol=1e-12)  # the torque on the second body


def test_a_force_that_follows_the_time_is_taken_where_each_step_begins() -> None:
    torque = Table((0.0, 0.2, 0.5), (0.0, 4.0, -2.0))
    w = spun(wheel(motor=Motor(force=torque)))
    sums = np.concatenate([[0.0], np.cumsum([torque(H * n) for n in range(100)])])
    np.testing.assert_allclose(w, H / INERTIA * sums, rtol=0.0, atol=1e-12)


def test_a_bound_that_follows_the_time_lets_the_wheel_fall_behind_its_speed() -> None:
    bound = Ramp(start=0.0, end=1.0, start_value=0.0, end_value=2.0)
    w = spun(wheel(motor=Motor(speed=1.0, max_force=bound)))
    reached = np.concatenate([[0.0], np.cumsum([bound(H * n) for n in range(100)])]) * H / INERTIA
    np.testing.assert_allclose(w, np.minimum(reached, 1.0), rtol=0.0, atol=1e-12)


def test_a_driven_hinge_sticks_until_the_torque_exceeds_its_friction_and_then_slips() -> None:
    """Torque t/s N m against 2 N m of friction: at rest for 2 s, then I w = (t − 2)²/2."""
    torque = Ramp(end=4.0, end_value=4.0)
    steps = 400
    w = spun(wheel(motor=Motor(force=torque), friction=2.0), steps)
    excess = np.maximum(0.0, np.array([torque(H * n) for n in range(steps)]) - 2.0)
    np.testing.assert_allclose(w[:201], 0.0, atol=1e-13)
    np.testing.assert_allclose(w[1:], H / INERTIA * np.cumsum(excess), rtol=0.0, atol=1e-11)


def test_friction_takes_the_energy_that_it_brakes_with_and_no_more() -> None:
    """From w₀ to rest in I w₀/τ: the angle is I w₀²/(2 τ), and the friction's work all of the energy."""
    speed, friction = 3.0, 2.0
    observe = {"angle": Final(quantity=JointCoordinate("axle")), "energy": Trace(quantity=KineticEnergy())}
    steps = 100
    result = simulate(wheel(speed, friction=friction), time_step=H, steps=steps, observe=observe)
    stops = INERTIA * speed / friction  # 0.75 s, a whole number of steps
    # w at the step's end turns the wheel: Σ h w_n = I w₀²/(2 τ) − h w₀/2, of order 1 as the method is.
    np.testing.assert_allclose(result["angle"], 0.5 * stops * speed - 0.5 * H * speed, rtol=1e-4)
    energy = np.array(result["energy"])
    assert np.all(np.diff(energy) <= 0.0)
    assert energy[round(stops / H) :].max() < 1e-24
    wanted = 0.5 * INERTIA * np.maximum(0.0, speed - friction / INERTIA * H * np.arange(steps + 1)) ** 2
    np.testing.assert_allclose(energy, wanted, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("way", ["along", "about"])
def test_a_cylindrical_joint_rubs_along_its_axis_and_about_it_apart(way: str) -> None:
    body = solid(
        "rod", None, (0.0, 0.0, 0.0), 2.0, (0.0, 0.0, 1.0), (0.0, 0.0, 2.0), inertia=(1.0, 1.0, INERTIA)
    )
    friction = (3.0, 0.0) if way == "along" else (0.0, 0.4)
    joint = Cylindrical(name="sleeve", between=(WORLD, "rod"), axis=Z, compliance=0.0, friction=friction)
    observe = {"v": Final(quantity=Velocity("rod")), "w": Final(quantity=AngularVelocity("rod"))}
    result = simulate(Scene(bodies=(body,), constraints=(joint,)), time_step=H, steps=40, observe=observe)
    np.testing.assert_allclose(result["v"][2], 1.0 - friction[0] / 2.0 * 0.4, rtol=1e-12)
    np.testing.assert_allclose(result["w"][2], 2.0 - friction[1] / INERTIA * 0.4, rtol=1e-12)


@pytest.mark.parametrize(("mu", "angle"), [(0.3, 20.0), (0.3, 16.0), (0.0, 10.0)])
def test_a_slide_on_a_slope_rubs_by_its_load(mu: float, angle: float) -> None:
    """a = g (sin α − µ cos α), or at rest where that is negative: µ = .3 holds to 16.7°."""
    slope, g = math.radians(angle), 10.0
    axis = (math.cos(slope), 0.0, -math.sin(slope))
    body = RigidBody(name="sledge", mass=3.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    joint = Prismatic(name="slide", between=(WORLD, "sledge"), axis=axis, compliance=0.0, load_friction=mu)
    scene = Scene(bodies=(body,), constraints=(joint,), gravity=(0.0, 0.0, -g))
    observe = {"v": Final(quantity=Velocity("sledge"))}
    result = simulate(scene, time_step=H, steps=50, observe=observe)
    falls = max(0.0, g * (math.sin(slope) - mu * math.cos(slope)))
    np.testing.assert_allclose(result["v"], falls * 0.5 * np.array(axis), rtol=0.0, atol=1e-10)


def test_an_axle_rubs_by_its_radius_and_its_load() -> None:
    """A wheel of weight m g on a rough axle of radius r is braked by µ r m g; the shift of the load is not modelled."""
    scene = wheel(4.0, load_friction=0.02)
    scene = Scene(bodies=scene.bodies, constraints=scene.constraints, gravity=(0.0, -10.0, 0.0))
    w = spun(scene)
    np.testing.assert_allclose(
        w, 4.0 - 0.02 * 2.0 * 10.0 / INERTIA * H * np.arange(101), rtol=0.0, atol=1e-10
    )


def test_friction_in_a_joint_of_a_geared_pair_beside_a_ball_on_a_floor() -> None:
    """The other wheel's friction brakes through the gear; surfaces that touch change nothing of it."""
    bodies = tuple(
        RigidBody(name=n, mass=1.0, inertia=(1.0, 1.0, INERTIA), position=(x, 0.0, 5.0))
        for n, x in (("wheel", 0.0), ("b", 2.0))
    )
    axles = (
        Hinge(name="a axle", between=(WORLD, "wheel"), axis=Z, compliance=0.0, motor=Motor(force=3.0)),
        Hinge(name="b axle", between=(WORLD, "b"), axis=Z, compliance=0.0, friction=1.0),
    )
    gear = Relation(name="gear", terms=(("a axle", 1.0), ("b axle", 2.0)), compliance=0.0)
    ground = (
        RigidBody(name="ball", mass=1.0, shape=Sphere(0.5), position=(9.0, 0.0, 0.5)),
        RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0)),
    )
    scene = Scene(bodies=(*bodies, *ground), constraints=(*axles, gear), gravity=(0.0, 0.0, -10.0))
    w = spun(scene, 50)
    gains = (3.0 - 0.5 * 1.0) / (
        INERTIA + INERTIA / 4.0
    )  # b turns half as fast: friction and inertia at the first
    np.testing.assert_allclose(w, gains * H * np.arange(51), rtol=1e-4, atol=1e-9)


def test_a_held_run_sets_the_force_of_a_motor_and_takes_it_back() -> None:
    with start(wheel(motor=Motor(force=1.0)), time_step=H, observe={"w": AngularVelocity("wheel")}) as run:
        run.step(10)
        before = run.save()
        run.set_motor("axle", force=-2.0)
        run.step(10)
        assert run["w"][2] == pytest.approx((10 * 1.0 - 10 * 2.0) * H / INERTIA, abs=1e-13)
        run.restore(before)
        run.step(10)
        assert run["w"][2] == pytest.approx(20 * 1.0 * H / INERTIA, abs=1e-13)
        for what, say in (
            ({"speed": 1.0}, "a motor of given force; set its force"),
            ({"max_force": 1.0}, "a motor of given force; set its force"),
        ):
            with pytest.raises(SceneError, match=say):
                run.set_motor("axle", **what)
    with (
        start(wheel(motor=Motor(speed=1.0)), time_step=H) as run,
        pytest.raises(SceneError, match="a motor of given speed; set its speed"),
    ):
        run.set_motor("axle", force=1.0)
    with (
        start(wheel(motor=Motor(force=Ramp(end=1.0))), time_step=H) as run,
        pytest.raises(SceneError, match="follows the time"),
    ):
        run.set_motor("axle", force=1.0)


@pytest.mark.parametrize(
    ("make", "error", "say"),
    [
        (lambda: Motor(), SceneError, "either a speed or a force"),
        (lambda: Motor(speed=1.0, force=1.0), SceneError, "either a speed or a force"),
        (lambda: Motor(force=1.0, max_force=2.0), SceneError, "leave it out"),
        (lambda: Motor(force=math.nan), SceneError, "finite"),
        (
            lambda: Motor(speed=0.0, max_force=Sinusoid(amplitude=2.0, frequency=1.0, offset=1.0)),
            SceneError,
            "falls to -1",
        ),
        (lambda: wheel(friction=-1.0), SceneError, "friction"),
        (lambda: Cylindrical(name="c", between=(WORLD, "a"), friction=1.0), SceneError, "two numbers"),  # type: ignore[arg-type]
        (
            lambda: spun(wheel(friction=1.0), method=Method(half_step_velocities=True)),
            MethodError,
            "has friction",
        ),
        (
            lambda: spun(wheel(motor=Motor(force=1.0)), method=Method(half_step_velocities=True)),
            MethodError,
            "given force",
        ),
    ],
)
def test_hostile_drives_are_refused_in_one_sentence(make: Any, error: type, say: str) -> None:
    with pytest.raises(error, match=say):
        make()
