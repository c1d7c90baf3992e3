"""Friction that differs with the direction: on the ellipse, normal to it along the slip, by every solver and model."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    Box,
    ContactForce,
    ContactPoints,
    Lock,
    Material,
    Method,
    Momentum,
    Plane,
    RigidBody,
    Scene,
    SceneError,
    Sphere,
    Velocity,
    simulate,
)
from tests.scenes.seen import finals, traces

H = 1.0 / 60.0
GRAVITY = 10.0
ALONG, ACROSS = 0.5, 0.2  # of the pair
GRAIN = 0.3  # rad from x
SOLVERS = ("direct", "iterative")
ONE = Material(friction=1.0)


def grained(along: float = ALONG, across: float = ACROSS, grain: float = GRAIN, **more: Any) -> Material:
    """What makes a pair of these coefficients with a surface of friction 1."""
    way = (math.cos(grain), math.sin(grain), 0.0)
    return Material(friction=along**2, friction_across=across**2, friction_direction=way, **more)


def floor(material: Material) -> RigidBody:
    return RigidBody(name="floor", motion="static", shape=Plane(), position=(0, 0, 0), material=material)


def box(name: str = "box", **fields: Any) -> RigidBody:
    given = {"mass": 2.0, "shape": Box((0.4, 0.4, 0.1)), "position": (0, 0, 0.05), "material": ONE}
    return RigidBody(name=name, **(given | fields))


def slope(tangent: float, way: float) -> tuple[float, float, float]:
    """Gravity on a plane tilted down along `way`."""
    tilt = math.atan(tangent)
    down = GRAVITY * math.sin(tilt)
    return (down * math.cos(way), down * math.sin(way), -GRAVITY * math.cos(tilt))


def tensor(along: float = ALONG, across: float = ACROSS, grain: float = GRAIN) -> Any:
    """M: the force of friction at the slip v is −N M v/√(v·M v)."""
    turn = np.array([[math.cos(grain), math.sin(grain)], [-math.sin(grain), math.cos(grain)]])
    return turn.T @ np.diag([along**2, across**2]) @ turn


def slid(velocity: Any, kick: float, ellipse: Any) -> Any:
    """v₊ = v − kick M v₊/√(v₊·M v₊), or 0 where the ellipse allows it: along its axes v₊ᵢ = vᵢ/(1 + kick µᵢ²/λ) with
    the one λ that makes Σ (µᵢ vᵢ/(λ + kick µᵢ²))² = 1."""
    squares, axes = np.linalg.eigh(ellipse)
    w = axes.T @ np.asarray(velocity, float)
    if np.sum(w**2 / (kick**2 * squares)) <= 1.0:
        return np.zeros(2)
    low, high = 0.0, 1e3 * math.sqrt(float(np.sum(squares * w**2)))
    for _ in range(200):
        middle = 0.5 * (low + high)
        above = float(np.sum(squares * w**2 / (middle + kick * squares) ** 2)) > 1.0
        low, high = (middle, high) if above else (low, middle)
    return axes @ (w / (1.0 + kick * squares / high))


def bound(way: float, model: str = "cone") -> float:
    """tan of the slope at which a box begins to slide down along `way`."""
    c, s = abs(math.cos(way - GRAIN)), abs(math.sin(way - GRAIN))
    return 1.0 / math.hypot(c / ALONG, s / ACROSS) if model == "cone" else min(ALONG / c, ACROSS / s)


def run(scene: Scene, steps: int, method: Method, body: str = "box") -> Any:
    observe = traces(v=Velocity(body))
    return simulate(scene, time_step=H, steps=steps, method=method, observe=observe)["v"]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(("along", "across"), [(0.5, 0.2), (0.2, 0.5), (0.5, 0.05), (0.3, 0.0095)])
@pytest.mark.parametrize("way", [0.9, 2.5])
def test_a_box_drifts_down_a_slope_askew(solver: str, along: float, across: float, way: float) -> None:
    """From rest the way is straight, v = a t with a = g − N M a/√(a·M a), in every step of the method, too."""
    gravity = slope(0.6, way)
    scene = Scene(bodies=(floor(grained(along, across)), box()), gravity=gravity)
    v = run(scene, 60, Method(solver=solver))  # type: ignore[arg-type]

    ellipse, load = tensor(along, across), -gravity[2]
    rate = slid(np.array(gravity[:2]), load, ellipse)  # the same equation
    np.testing.assert_allclose(rate, gravity[:2] - load * ellipse @ rate / math.sqrt(rate @ ellipse @ rate))
    np.testing.assert_allclose(v[:, :2], np.outer(np.arange(61) * H, rate), atol=1e-9)


@pytest.mark.parametrize(
    ("solver", "model"),
    [
        (s, m)
        for s, m in itertools.product(SOLVERS, ("cone", "box", "scaled_box"))
        if (s, m) != ("iterative", "box")
    ],
)
def test_it_begins_to_slide_where_the_ellipse_ends(solver: str, model: str) -> None:
    """And where its rectangle ends, under the box's models; sweeps with the box have no load in their first step."""
    method = Method(solver=solver, friction=model, iterations=500)  # type: ignore[arg-type]
    for way in np.linspace(0.05, 3.0, 7):
        speeds = []
        for share in (0.999, 1.001):
            gravity = slope(share * bound(way, model), way)
            scene = Scene(bodies=(floor(grained()), box()), gravity=gravity)
            speeds.append(math.hypot(*run(scene, 20, method)[-1, :2]))
        assert speeds[0] < 1e-9 and speeds[1] > 1e-4


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("on_the_box", [False, True])
def test_a_box_thrown_askew_turns_towards_the_slippery_direction(solver: str, on_the_box: bool) -> None:
    """Whichever of both surfaces has the direction, and if the body that has it is turned."""
    if on_the_box:
        turned = 1.1
        quarter = (math.cos(0.5 * turned), 0.0, 0.0, math.sin(0.5 * turned))
        own = grained(grain=GRAIN - turned)
        bodies = (floor(ONE), box(material=own, orientation=quarter, velocity=(2.0, 1.0, 0.0)))
    else:
        bodies = (floor(grained()), box(velocity=(2.0, 1.0, 0.0)))
    v = run(Scene(bodies=bodies, gravity=(0, 0, -GRAVITY)), 60, Method(solver=solver))  # type: ignore[arg-type]

    exact = [np.array([2.0, 1.0])]
    for _ in range(60):
        exact.append(slid(exact[-1], H * GRAVITY, tensor()))
    np.testing.assert_allclose(v[:, :2], exact, atol=1e-8)
    assert not exact[-1].any()
    late = np.array(exact[np.flatnonzero([e.any() for e in exact])[-1]])
    across = np.array([-math.sin(GRAIN), math.cos(GRAIN)])
    assert abs(late @ across) > 0.98 * math.hypot(*late)


@pytest.mark.parametrize("solver", SOLVERS)
def test_both_bodies_feel_the_same_force(solver: str) -> None:
    """A box with a grain slides on a plate that is free to move: momentum stays, the slip obeys the law."""
    slow = {"mass": 3.0, "inertia": (1e9, 1e9, 1e9), "velocity": (-0.4, -0.2, 0.0)}  # no push turns it
    plate = box("plate", shape=Box((4.0, 4.0, 0.1)), **slow)
    rider = box(position=(0, 0, 0.15), velocity=(0.6, 0.3, 0.0), material=grained())
    scene = Scene(bodies=(floor(Material()), plate, rider), gravity=(0, 0, -GRAVITY))
    observe = traces(p=Momentum(), a=Velocity("box"), b=Velocity("plate"))
    method = Method(solver=solver, iterations=2000)  # type: ignore[arg-type]
    found = simulate(scene, time_step=H, steps=30, method=method, observe=observe)

    slip = [np.array([1.0, 0.5])]
    for _ in range(30):
        slip.append(slid(slip[-1], H * GRAVITY * 2.0 * (1 / 2.0 + 1 / 3.0), tensor()))
    np.testing.assert_allclose(found["a"][:, :2] - found["b"][:, :2], slip, atol=1e-7)
    np.testing.assert_allclose((found["p"] - found["p"][0])[:, :2], 0.0, atol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("lean", [0.0, 0.4, 1.2, math.pi / 2])
def test_a_direction_that_leaves_the_surface_counts_by_its_shadow(solver: str, lean: float) -> None:
    """Along its shadow µ² = µ_a² + (µ_d² − µ_a²) cos² of the angle to the surface; a normal one leaves µ_a all round."""
    way = (math.cos(lean), 0.0, math.sin(lean))
    leaning = Material(friction=ALONG**2, friction_across=ACROSS**2, friction_direction=way)
    along = math.sqrt(ACROSS**2 + (ALONG**2 - ACROSS**2) * math.cos(lean) ** 2)
    for speed, mu in (((3.0, 0.0, 0.0), along), ((0.0, 3.0, 0.0), ACROSS)):
        scene = Scene(bodies=(floor(leaning), box(velocity=speed)), gravity=(0, 0, -GRAVITY))
        v = run(scene, 10, Method(solver=solver))  # type: ignore[arg-type]
        np.testing.assert_allclose(v[-1], np.array(speed) * (1.0 - mu * GRAVITY * 10 * H / 3.0), atol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_bounce_takes_its_impulse_from_the_ellipse(solver: str) -> None:
    """A ball without spin: nu = m (1 + e) u, and the slip after it is 7/2 of the impulse over the mass less."""
    material = grained(0.1, 0.04, restitution=0.5)
    ball = box(shape=Sphere(0.1), position=(0, 0, 0.1), velocity=(2.0, 1.0, -2.0))
    v = run(Scene(bodies=(floor(material), ball)), 2, Method(solver=solver))[-1]  # type: ignore[arg-type]

    start = np.array([2.0, 1.0])
    change = (slid(start, 3.5 * 3.0, tensor(0.1, 0.04)) - start) / 3.5
    np.testing.assert_allclose(v, [*(start + change), 1.0], atol=1e-9)


def test_creep_is_slower_where_friction_is_higher() -> None:
    """slip_compliance γ gives way by γ F where friction is lower, by γ (µ_low/µ_high)² F where it is higher, shared by
    four points."""
    soft = grained(grain=0.0, slip_compliance=1e-3)
    for force, rate in (((1.0, 0.0), (ACROSS / ALONG) ** 2), ((0.0, 1.0), 1.0)):
        gravity = (0.5 * force[0], 0.5 * force[1], -GRAVITY)  # 1 N
        v = run(Scene(bodies=(floor(soft), box()), gravity=gravity), 60, Method())[-1]
        np.testing.assert_allclose(v[:2], np.array(force) * 1e-3 * rate / 4.0, rtol=1e-7, atol=1e-12)


def test_the_forces_that_are_told_lie_in_the_ellipse() -> None:
    observe = finals(f=ContactForce("box"), points=ContactPoints(most=4))
    gravity = slope(0.6, 0.9)
    scene = Scene(bodies=(floor(grained()), box()), gravity=gravity)
    found = simulate(scene, time_step=H, steps=20, observe=observe)

    force, load = found["f"], -2.0 * gravity[2]
    rate = slid(np.array(gravity[:2]), -gravity[2], tensor())
    np.testing.assert_allclose(force[:2], 2.0 * (rate - gravity[:2]), atol=1e-7)
    assert force[:2] @ np.linalg.inv(tensor()) @ force[:2] == pytest.approx(load**2, rel=1e-9)
    np.testing.assert_allclose(found["points"][:, 9], ALONG, rtol=1e-12)


@pytest.mark.parametrize("solver", SOLVERS)
def test_rolling_friction_may_be_there_as_well(solver: str) -> None:
    """A ball that rolls without slip feels no ellipse: it stops as on any floor."""
    speeds = []
    for surface in (grained(rolling_friction=0.01), Material(friction=1.0, rolling_friction=0.01)):
        rolling = box(
            shape=Sphere(0.1), position=(0, 0, 0.1), velocity=(1.0, 0, 0), angular_velocity=(0, 10.0, 0)
        )
        scene = Scene(bodies=(floor(surface), rolling), gravity=(0, 0, -GRAVITY))
        speeds.append(run(scene, 60, Method(solver=solver, iterations=200)))  # type: ignore[arg-type]
    np.testing.assert_allclose(*speeds, atol=1e-8)
    assert 0.1 < speeds[0][-1, 0] < 0.9


def test_equal_coefficients_leave_every_bit() -> None:
    plain = Material(friction=0.25)
    runs = [
        run(Scene(bodies=(floor(m), box(velocity=(2.0, 1.0, 0.0))), gravity=(0, 0, -GRAVITY)), 40, Method())
        for m in (plain, grained(0.5, 0.5))
    ]
    assert (runs[0] == runs[1]).all()


def test_two_directions_may_not_meet() -> None:
    """Two ellipses that cross have no agreed law; bodies that cannot touch, or not move, may both have one."""
    one, two = box("one", material=grained()), box("two", material=grained(), position=(0, 0, 0.15))
    with pytest.raises(SceneError, match="'one' and 'two' may touch") as caught:
        Scene(bodies=(one, two))
    assert "\n" not in str(caught.value)
    Scene(bodies=(one, two), no_contact=(("two", "one"),))
    Scene(bodies=(one, two), constraints=(Lock(name="glue", between=("one", "two")),))
    Scene(bodies=(one, two), contacts=False)
    Scene(bodies=(floor(grained()), box("wall", motion="static", mass=None, material=grained())))
