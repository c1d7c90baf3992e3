"""What friction two surfaces have: viscous, of unlike materials, of pairs that are told theirs, and the box's bound."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    ContactForce,
    Material,
    Method,
    PairFriction,
    Plane,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    Velocity,
    simulate,
)
from tests.oracles.particles import Array
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals, traces

MU = 0.5
G = 10.0  # m/s²
H = 1 / 60  # s
MASS = 2.0  # kg
Model = Literal["cone", "box", "scaled_box"]


def slope(tan: float, turn: float, material: Material, mass: float = MASS) -> Scene:
    """A box on a level plane under a gravity tilted by atan(tan) towards the direction `turn` [rad]."""
    tilt = math.atan(tan)
    pull = G * math.sin(tilt)
    ground = fixed("ground", Plane(), (0.0, 0.0, 0.0), material=material)
    box = solid("box", Box((1.0, 1.0, 0.2)), (0.0, 0.0, 0.1), mass, material=material)
    gravity = (pull * math.cos(turn), pull * math.sin(turn), -G * math.cos(tilt))
    return Scene(bodies=(ground, box), gravity=gravity)


def slide(scene: Scene, steps: int = 90, method: Method | None = None) -> tuple[Array, Array]:
    """Velocity trace and final contact force of the box."""
    observe = traces(v=Velocity("box")) | finals(f=ContactForce("box"))
    result = simulate(scene, time_step=H, steps=steps, observe=observe, method=method or Method())
    return result["v"], result["f"]


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("viscosity", [0.5, 20.0])
def test_viscous_friction_is_a_force_as_large_as_the_slip(solver: Any, viscosity: float) -> None:
    """F = c v of each of four points, 1/c both surfaces' together, under a friction that is never reached; a step takes it at
    its end, v₊ = v/(1 + 4 c h/m), which is e^(−4ct/m) to first order."""
    oil = Material(friction=1e6, slip_compliance=0.5 / viscosity)
    scene = slope(0.0, 0.0, oil)
    pushed = replace(scene, bodies=(scene.bodies[0], replace(scene.bodies[1], velocity=(0.3, -0.4, 0.0))))
    observe = traces(v=Velocity("box"), f=ContactForce("box"))
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
    ground = fixed("ground", Plane(), (0.0, 0.0, 0.0), material=Material(friction=0.2))
    box = solid(
        "box",
        Box((1.0, 1.0, 0.2)),
        (0.0, 0.0, 0.1),
        velocity=(3.0, 0.0, 0.0),
        material=Material(friction=0.8),
    )
    v, _ = slide(Scene(bodies=(ground, box), gravity=(0.0, 0.0, -G)), steps=20)

    assert v[:, 0] == pytest.approx(3.0 - 0.4 * G * H * np.arange(21), abs=1e-8)


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
        observe=traces(f=ContactForce("b")),
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
    found = simulate(both, time_step=H, steps=90, method=method, observe=finals(v=Velocity("beside")))
    assert found["v"] == pytest.approx(
        slide(slope(0.5, 0.3, Material(friction=own)), method=method)[0][-1], abs=1e-9
    )


def test_a_pair_may_roll_with_friction_and_a_ball_without_it_goes_on() -> None:
    """A ball slows by 5/7 g µ_r / r; of two on one ground the pair alone has it."""
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    balls = [
        solid(name, Sphere(0.5), (0.0, y, 0.5), MASS, (1.0, 0.0, 0.0), (0.0, 2.0, 0.0))
        for name, y in (("braked", 0.0), ("free", 3.0))
    ]  # fmt: skip
    pairs = (
        PairFriction(between=("ground", "braked"), friction=0.5, rolling_friction=0.01),
        PairFriction(between=("free", "ground"), friction=0.5),
    )
    scene = Scene(bodies=(ground, *balls), gravity=(0.0, 0.0, -G), pair_frictions=pairs)
    found = simulate(scene, time_step=H, steps=60, observe=finals(v=Velocity()))["v"]

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
