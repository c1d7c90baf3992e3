"""T11: Coulomb's law. Stick and slip on a slope, in every direction, creep, models and solvers, rolling."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    ContactForce,
    Final,
    Material,
    Method,
    PairFriction,
    Plane,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.oracles.particles import Array

MU = 0.5
G = 10.0  # m/s²
H = 1 / 60  # s
MASS = 2.0  # kg
Model = Literal["cone", "box", "scaled_box"]


def slope(tan: float, turn: float, material: Material, mass: float = MASS) -> Scene:
    """A box on a level plane under a gravity tilted by atan(tan) towards the direction `turn` [rad]."""
    tilt = math.atan(tan)
    pull = G * math.sin(tilt)
    ground = RigidBody(
        name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=material
    )
    box = RigidBody(
        name="box", mass=mass, shape=Box((1.0, 1.0, 0.2)), position=(0.0, 0.0, 0.1), material=material
    )
    gravity = (pull * math.cos(turn), pull * math.sin(turn), -G * math.cos(tilt))
    return Scene(bodies=(ground, box), gravity=gravity)


def slide(scene: Scene, steps: int = 90, method: Method | None = None) -> tuple[Array, Array]:
    """Velocity trace and final contact force of the box."""
    observe = {"v": Trace(quantity=Velocity("box")), "f": Final(quantity=ContactForce("box"))}
    result = simulate(scene, time_step=H, steps=steps, observe=observe, method=method or Method())
    return result["v"], result["f"]


DIRECTIONS = np.radians([0.0, 17.0, 45.0, 90.0, 133.0, 211.0, 300.0])


@pytest.mark.parametrize("turn", DIRECTIONS)
def test_t11_a_box_sticks_just_below_its_angle_and_slips_just_above(turn: float) -> None:
    still, _ = slide(slope(0.9998 * MU, turn, Material(friction=MU)))
    moving, _ = slide(slope(1.0002 * MU, turn, Material(friction=MU)))
    angle = math.atan(1.0002 * MU)
    gain = G * (math.sin(angle) - MU * math.cos(angle)) * H

    assert np.abs(still).max() < 1e-9
    assert np.linalg.norm(moving[-1]) == pytest.approx(90 * gain, rel=1e-4)


@pytest.mark.parametrize("turn", DIRECTIONS)
def test_t11_sliding_goes_straight_down_with_the_right_acceleration(turn: float) -> None:
    """a = g (sin − mu cos) in every direction, force ratio mu, no drift aside."""
    v, force = slide(slope(0.6, turn, Material(friction=MU)))
    angle = math.atan(0.6)
    along = np.array([math.cos(turn), math.sin(turn), 0.0])
    exact = np.outer(G * (math.sin(angle) - MU * math.cos(angle)) * H * np.arange(91), along)

    assert np.abs(v - exact).max() < 1e-8
    assert np.linalg.norm(force[:2]) / force[2] == pytest.approx(MU, rel=1e-9)
    assert force[2] == pytest.approx(MASS * G * math.cos(angle), rel=1e-9)
    assert abs(force[0] * along[1] - force[1] * along[0]) < 1e-7 * force[2]


@pytest.mark.parametrize("tan", [0.1, 0.3, 0.5])
def test_t11_a_sticking_box_is_held_by_what_pulls_it(tan: float) -> None:
    _, force = slide(slope(tan, 0.7, Material(friction=MU)))

    assert np.linalg.norm(force[:2]) / force[2] == pytest.approx(tan, rel=1e-9)


def test_t11_a_slip_compliance_creeps_by_gamma_times_force() -> None:
    """Four points, each with its share of the force: the speed is gamma F_t/4, for every step."""
    gamma, tan = 1e-4, 0.3
    scene = slope(tan, 1.1, Material(friction=MU, slip_compliance=gamma))
    v, force = slide(scene, steps=300)
    one = np.linalg.norm(force[:2])

    assert np.linalg.norm(v[-1]) == pytest.approx(np.linalg.norm(v[-50]), rel=1e-6)
    assert np.linalg.norm(v[-1]) == pytest.approx(
        2.0 * gamma * one / 4.0, rel=1e-6
    )  # gammas of both surfaces add


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("viscosity", [0.5, 20.0])
def test_viscous_friction_is_a_force_as_large_as_the_slip(solver: Any, viscosity: float) -> None:
    """F = c v of each of four points, 1/c both surfaces' together, under a friction that is never reached; a step takes it at
    its end, v₊ = v/(1 + 4 c h/m), which is e^(−4ct/m) to first order."""
    oil = Material(friction=1e6, slip_compliance=0.5 / viscosity)
    scene = slope(0.0, 0.0, oil)
    pushed = replace(scene, bodies=(scene.bodies[0], replace(scene.bodies[1], velocity=(0.3, -0.4, 0.0))))
    observe = {"v": Trace(quantity=Velocity("box")), "f": Trace(quantity=ContactForce("box"))}
    result = simulate(
        pushed, time_step=H, steps=60, observe=observe, method=Method(solver=solver, iterations=2000)
    )
    v, drag = result["v"], 4.0 * viscosity

    slower = (1.0 + drag * H / MASS) ** -np.arange(61.0)
    np.testing.assert_allclose(v[:, :2], np.outer(slower, (0.3, -0.4)), atol=1e-9)
    np.testing.assert_allclose(result["f"][1:, :2], -drag * v[1:, :2], atol=1e-6)
    exact = np.exp(-drag * H / MASS * np.arange(61.0))
    assert np.abs(slower - exact).max() < 0.5 * drag * H / MASS * math.exp(-1.0) * 1.1  # ½ (c h/m) · x e^(−x)


def test_friction_of_two_materials_is_their_geometric_mean() -> None:
    ground = RigidBody(
        name="ground",
        motion="static",
        shape=Plane(),
        position=(0.0, 0.0, 0.0),
        material=Material(friction=0.2),
    )
    box = RigidBody(
        name="box",
        mass=1.0,
        shape=Box((1.0, 1.0, 0.2)),
        position=(0.0, 0.0, 0.1),
        velocity=(3.0, 0.0, 0.0),
        material=Material(friction=0.8),
    )
    v, _ = slide(Scene(bodies=(ground, box), gravity=(0.0, 0.0, -G)), steps=20)

    assert v[:, 0] == pytest.approx(3.0 - 0.4 * G * H * np.arange(21), abs=1e-8)


@pytest.mark.parametrize("model", ["box", "scaled_box"])
def test_the_box_models_hold_more_across_the_diagonal(model: Model) -> None:
    """A square of bounds is √2 wide along its diagonal; the cone is not."""
    across = math.radians(45.0)
    held, _ = slide(slope(0.6, across, Material(friction=MU)), method=Method(friction=model))
    slips, _ = slide(slope(0.6, 0.0, Material(friction=MU)), method=Method(friction=model))
    cone, _ = slide(slope(0.6, across, Material(friction=MU)))

    assert np.abs(held[-1]).max() < 1e-6
    assert np.abs(slips[-1]).max() > 0.5
    assert np.abs(cone[-1]).max() > 0.5


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_all_solvers_find_coulombs_law(solver: Literal["direct", "iterative"]) -> None:
    method = Method(solver=solver, iterations=2000, residual_tolerance=1e-13)
    v, force = slide(slope(0.6, 0.4, Material(friction=MU)), method=method)
    angle = math.atan(0.6)

    assert np.linalg.norm(force[:2]) / force[2] == pytest.approx(MU, rel=1e-6)
    assert np.linalg.norm(v[-1]) == pytest.approx(
        90 * H * G * (math.sin(angle) - MU * math.cos(angle)), rel=1e-5
    )


def sphere(velocity: tuple[float, float, float], mu: float) -> tuple[RigidBody, RigidBody]:
    ground = RigidBody(
        name="ground",
        motion="static",
        shape=Plane(),
        position=(0.0, 0.0, 0.0),
        material=Material(friction=mu),
    )
    ball = RigidBody(
        name="box",
        mass=MASS,
        shape=Sphere(0.25),
        position=(0.0, 0.0, 0.25),
        velocity=velocity,
        material=Material(friction=mu),
    )
    return ground, ball


def test_a_sliding_sphere_comes_to_roll_at_five_sevenths() -> None:
    """After 2 v/(7 mu g); until then it slows by mu g."""
    mu, speed = 0.3, 4.0
    scene = Scene(bodies=sphere((speed, 0.0, 0.0), mu), gravity=(0.0, 0.0, -G))
    observe = {"v": Trace(quantity=Velocity("box")), "w": Trace(quantity=AngularVelocity("box"))}
    result = simulate(scene, time_step=1e-3, steps=1000, observe=observe)
    v, w = result["v"][:, 0], result["w"][:, 1]
    t = result.sample_times["v"]
    rolls = 2.0 * speed / (7.0 * mu * G)
    sliding = t < rolls - 2e-3

    assert np.abs(v[sliding] - (speed - mu * G * t[sliding])).max() < 1e-8
    assert v[-1] == pytest.approx(5.0 / 7.0 * speed, rel=1e-8)
    assert w[-1] * 0.25 == pytest.approx(v[-1], rel=1e-8)


def test_a_sphere_rolls_down_a_slope_with_five_sevenths_of_the_pull() -> None:
    tilt = math.radians(20.0)
    gravity = (G * math.sin(tilt), 0.0, -G * math.cos(tilt))
    v, force = slide(Scene(bodies=sphere((0.0, 0.0, 0.0), 0.8), gravity=gravity), steps=120)

    assert v[:, 0] == pytest.approx(5.0 / 7.0 * G * math.sin(tilt) * H * np.arange(121), abs=1e-8)
    assert force[0] == pytest.approx(-2.0 / 7.0 * MASS * G * math.sin(tilt), rel=1e-6)


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("edge", [(1.0, 1.0, 1.0), (1.0, 1.0, 0.1)])
def test_the_box_never_gives_more_than_its_corners(edge: tuple[float, float, float], solver: str) -> None:
    """Pulled along a diagonal down a slope steeper than µ: √2 µ N, also where a corner carries nothing and lifts."""
    mu, tilt = 0.5, math.atan(0.9)
    material = Material(friction=mu)
    bodies = (
        RigidBody(name="p", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=material),
        RigidBody(name="b", mass=1.0, shape=Box(edge), position=(0.0, 0.0, 0.5 * edge[2]), material=material),
    )
    down = 10.0 * math.sin(tilt) * math.sqrt(0.5)
    force = simulate(
        Scene(bodies=bodies, gravity=(-down, -down, -10.0 * math.cos(tilt))),
        time_step=1 / 60,
        steps=60,
        method=Method(friction="box", solver=solver),
        observe={"f": Trace(quantity=ContactForce("b"))},
    )["f"][1:]

    assert np.all(np.hypot(force[:, 0], force[:, 1]) <= math.sqrt(2.0) * mu * force[:, 2] * (1.0 + 1e-9))


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("model", ["cone", "box", "scaled_box"])
@pytest.mark.parametrize(("own", "mu"), [(0.0, 0.3), (0.9, 0.3), (0.9, 0.0), (0.0, 0.6)])
def test_a_pair_rubs_as_it_is_told_whatever_its_materials_say(
    own: float, mu: float, model: Model, solver: Any
) -> None:
    """To the bit as surfaces that both say so: it stands on 0.5, or loses µ g cos a every second. A third body is as before."""
    pair = PairFriction(between=("box", "ground"), friction=mu)
    told = replace(slope(0.5, 0.3, Material(friction=own)), pair_frictions=(pair,))
    of_two = slope(0.5, 0.3, Material(friction=mu))
    method = Method(friction=model, solver=solver)
    (v, f), (wanted, carried) = (slide(one, method=method) for one in (told, of_two))

    assert np.array_equal(v, wanted)
    assert np.array_equal(f, carried)
    assert (np.linalg.norm(v[-1]) < 1e-9) == (mu > 0.5)
    beside = replace(told.bodies[1], name="beside", position=(0.0, 5.0, 0.1))  # type: ignore[arg-type]
    both = replace(told, bodies=(*told.bodies, beside))
    found = simulate(
        both, time_step=H, steps=90, method=method, observe={"v": Final(quantity=Velocity("beside"))}
    )
    assert found["v"] == pytest.approx(
        slide(slope(0.5, 0.3, Material(friction=own)), method=method)[0][-1], abs=1e-9
    )


def test_a_pair_may_roll_with_friction_and_a_ball_without_it_goes_on() -> None:
    """A ball slows by 5/7 g µ_r / r; of two on one ground the pair alone has it."""
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    balls = [
        RigidBody(
            name=name, mass=MASS, shape=Sphere(0.5), position=(0.0, y, 0.5),
            velocity=(1.0, 0.0, 0.0), angular_velocity=(0.0, 2.0, 0.0),
        )
        for name, y in (("braked", 0.0), ("free", 3.0))
    ]  # fmt: skip
    pairs = (
        PairFriction(between=("ground", "braked"), friction=0.5, rolling_friction=0.01),
        PairFriction(between=("free", "ground"), friction=0.5),
    )
    scene = Scene(bodies=(ground, *balls), gravity=(0.0, 0.0, -G), pair_frictions=pairs)
    found = simulate(scene, time_step=H, steps=60, observe={"v": Final(quantity=Velocity())})["v"]

    assert found[1, 0] == pytest.approx(1.0 - 5.0 / 7.0 * G * 0.01 / 0.5, abs=1e-3)
    assert found[2, 0] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        (("box",), "'box' is not a PairFriction"),
        ((PairFriction(between=("box", "wall")),), "no rigid body named 'wall'"),
        (
            (PairFriction(between=("box", "ground")), PairFriction(between=("ground", "box"))),
            "stand there twice",
        ),
    ],
)
def test_a_pair_that_is_none_is_refused(pairs: Any, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        replace(slope(0.0, 0.0, Material()), pair_frictions=pairs)
    with pytest.raises(SceneError, match="does not rub on itself"):
        PairFriction(between=("box", "box"))
    for told in ("ab", ("box",), ("box", ["ground"]), 3):
        with pytest.raises(SceneError, match="is not a pair of names"):
            PairFriction(between=told)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="friction must"):
        PairFriction(between=("box", "ground"), friction=-0.1)
