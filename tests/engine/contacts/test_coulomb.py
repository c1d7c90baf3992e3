"""Friction: Coulomb's law on slopes, in every direction, by every model and solver, and in heaps of balls."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pytest

from spook_tracker.engine import (
    AngularVelocity,
    Box,
    ContactForce,
    Cylinder,
    Material,
    Method,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals, traces

TIME_STEP = 1.0 / 60.0  # s
GRAVITY = 10.0  # m/s²
DIRECTIONS = [math.radians(10 * k) for k in range(36)] + [math.pi / 4]
Array = npt.NDArray[np.float64]


def slope(
    tangent: float,
    direction: float,
    mu: float = 0.5,
    mass: float = 1.0,
    slip_compliance: float = 0.0,
    below: float = 0.0,
) -> Scene:
    """A unit box on a level plane, gravity tilted by atan(tangent) towards `direction`."""
    theta = math.atan(tangent)
    pull = (math.sin(theta) * math.cos(direction), math.sin(theta) * math.sin(direction), -math.cos(theta))
    surface = Material(friction=mu, slip_compliance=below)
    plane = RigidBody(name="plane", position=(0, 0, 0), shape=Plane(), motion="static", material=surface)
    box = solid(
        "box",
        Box((1, 1, 1)),
        (0, 0, 0.5),
        mass,
        material=Material(friction=mu, slip_compliance=slip_compliance),
    )
    x, y, z = pull
    return Scene(bodies=(plane, box), gravity=(GRAVITY * x, GRAVITY * y, GRAVITY * z))


OBSERVE = {
    "force": Trace(quantity=ContactForce("box", "plane"), first=1),
    "velocity": Trace(quantity=Velocity("box"), first=1),
}


def ratio(force: Array) -> Array:
    """|F_t|/|F_n| of forces (…, 3) on a level plane."""
    return np.asarray(np.hypot(force[..., 0], force[..., 1]) / force[..., 2])


def angle_between(a: float, b: float) -> float:
    return abs(math.remainder(a - b, 2.0 * math.pi))


@pytest.mark.parametrize("tangent", [0.1, 0.3, 0.5, 0.6])
def test_the_cone_is_the_same_in_every_direction(tangent: float) -> None:
    """Standing up to tan θ = mu, held by what pulls it, and sliding at .6: F_t/F_n to 1e-9 at every step, along the slope
    to 1e-6°, with a = g (sin θ − mu cos θ)."""
    theta = math.atan(tangent)
    gain = max(0.0, GRAVITY * (math.sin(theta) - 0.5 * math.cos(theta)) * TIME_STEP)
    for direction in DIRECTIONS:
        result = simulate(slope(tangent, direction), time_step=TIME_STEP, duration=1.0, observe=OBSERVE)

        assert np.abs(ratio(result["force"]) - min(0.5, tangent)).max() <= 1e-9
        assert np.abs(result["force"][:, 2] / (GRAVITY * math.cos(theta)) - 1.0).max() <= 1e-9
        along = np.array([math.cos(direction), math.sin(direction), 0.0])
        exact = np.outer(gain * np.arange(1, 61), along)
        np.testing.assert_allclose(result["velocity"], exact, rtol=0, atol=1e-8)
        fx, fy, _ = result["force"][-1]
        assert math.degrees(angle_between(math.atan2(-fy, -fx), direction)) <= 1e-6
        if tangent > 0.5:
            vx, vy, _ = result["velocity"][-1]
            assert math.degrees(angle_between(math.atan2(vy, vx), direction)) <= 1e-6


@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("mass", [1.0, 1e4])
@pytest.mark.parametrize("direction", [0.0, 0.3, 0.4, math.pi / 4, math.pi / 2, 2.3, 3.7, 5.2])
def test_it_sticks_just_below_the_friction_angle_and_slips_just_above(
    mu: float, mass: float, direction: float
) -> None:
    """T11: sticks iff tan θ <= mu, whatever the mass; then a = g (sin θ − mu cos θ), at every step."""
    below = simulate(
        slope(mu * 0.9998, direction, mu, mass), time_step=TIME_STEP, duration=1.0, observe=OBSERVE
    )
    above = simulate(
        slope(mu * 1.0002, direction, mu, mass), time_step=TIME_STEP, duration=1.0, observe=OBSERVE
    )

    assert np.abs(below["velocity"]).max() < 1e-9
    theta = math.atan(mu * 1.0002)
    acceleration = GRAVITY * (math.sin(theta) - mu * math.cos(theta))
    speed = np.linalg.norm(above["velocity"], axis=1)
    np.testing.assert_allclose(speed, acceleration * TIME_STEP * np.arange(1, 61), rtol=0, atol=1e-9)


def test_without_friction_it_slides_freely() -> None:
    result = simulate(slope(0.3, 0.5, mu=0.0), time_step=TIME_STEP, duration=1.0, observe=OBSERVE)

    speed = np.linalg.norm(result["velocity"][-1])
    assert speed == pytest.approx(GRAVITY * math.sin(math.atan(0.3)), abs=1e-11)
    assert np.abs(result["force"][:, :2]).max() == 0.0


@pytest.mark.parametrize("model", ["box", "scaled_box"])
def test_the_box_models_hold_a_tenth_more_across_their_axes(model: str) -> None:
    """At tan θ = .6: sliding along an axis the ratio is .5; at 45° each axis allows .5, so the box stands at .6."""
    method = Method(friction=model)  # type: ignore[arg-type]
    ratios = []
    for direction in DIRECTIONS:  # the last is 45°
        result = simulate(
            slope(0.6, direction), time_step=TIME_STEP, duration=1.0, observe=OBSERVE, method=method
        )
        ratios.append(float(ratio(result["force"][-1])))

    assert np.abs(result["velocity"][-1]).max() < 1e-6
    assert min(ratios) == pytest.approx(0.5, abs=1e-9)
    assert max(ratios) - min(ratios) == pytest.approx(0.1, abs=1e-3)
    expected = [
        min(0.6, math.hypot(*(min(0.5, 0.6 * abs(c)) for c in (math.cos(d), math.sin(d)))))
        for d in DIRECTIONS
    ]
    # Sliding along one axis only, the other holding: at most that; the ratio is the norm of both.
    np.testing.assert_allclose(ratios, expected, rtol=0, atol=0.04)


def test_the_box_lags_a_step_behind_a_changing_load() -> None:
    """The box bounds friction by the normal force of the step before: a landing block feels the old load first."""
    material = Material(friction=0.5)
    bodies = (
        RigidBody(name="plane", position=(0, 0, 0), shape=Plane(), motion="static", material=material),
        solid("box", Box((1, 1, 1)), (0, 0, 0.52), velocity=(5.0, 0, -3.0), material=material),
    )
    scene = Scene(bodies=bodies, gravity=(0, 0, -GRAVITY))
    runs = {
        model: simulate(scene, time_step=TIME_STEP, steps=6, method=Method(friction=model), observe=OBSERVE)  # type: ignore[arg-type]
        for model in ("box", "scaled_box")
    }

    current = ratio(runs["scaled_box"]["force"])
    assert np.abs(current[np.isfinite(current)] - 0.5).max() < 1e-9
    force = runs["box"]["force"]
    hit = int(np.argmax(force[:, 2]))
    assert abs(force[hit + 1, 0]) > 0.7 * force[hit + 1, 2]  # still bounded by the blow


@pytest.mark.parametrize("tangent", [0.3, 0.6])
def test_iterations_reach_the_direct_answer(tangent: float) -> None:
    method = Method(solver="iterative", iterations=2000, residual_tolerance=1e-13)
    direct = simulate(slope(tangent, 0.3), time_step=TIME_STEP, duration=1.0, observe=OBSERVE)
    other = simulate(slope(tangent, 0.3), time_step=TIME_STEP, duration=1.0, observe=OBSERVE, method=method)

    np.testing.assert_allclose(other["velocity"], direct["velocity"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(ratio(other["force"]), min(tangent, 0.5), rtol=0, atol=1e-7)
    assert other.counters["sweeps"] > 0
    assert direct.counters["sweeps"] == 0


@pytest.mark.parametrize("below", [0.0, 1e-3])
def test_slip_compliance_lets_it_creep(below: float) -> None:
    """T11: creep speed gamma F_t, steadily; those of both surfaces add, four points share the force, none at its bound."""
    gamma = 1e-3
    scene = slope(0.2, 0.7, slip_compliance=gamma, below=below)
    result = simulate(scene, time_step=TIME_STEP, duration=5.0, observe=OBSERVE)

    force = GRAVITY * math.sin(math.atan(0.2))
    speeds = np.linalg.norm(result["velocity"][[-1, -50]], axis=1)
    assert speeds == pytest.approx((gamma + below) * force / 4.0, rel=1e-6)


def test_a_sliding_ball_begins_to_roll_and_keeps_five_sevenths() -> None:
    """It slows by mu g while it slides, exactly in discrete time, then rolls on without loss."""
    mu, start = 0.2, 3.0
    material = Material(friction=mu)
    bodies = (
        RigidBody(name="plane", position=(0, 0, 0), shape=Plane(), motion="static", material=material),
        solid("ball", Sphere(0.2), (0, 0, 0.2), velocity=(start, 0, 0), material=material),
    )
    result = simulate(
        Scene(bodies=bodies, gravity=(0, 0, -GRAVITY)),
        time_step=TIME_STEP,
        duration=2.0,
        observe=traces(v=Velocity("ball"), w=AngularVelocity("ball")),
    )

    time = TIME_STEP * np.arange(121)
    sliding = time < 2.0 / 7.0 * start / (mu * GRAVITY)
    np.testing.assert_allclose(
        result["v"][sliding, 0], start - mu * GRAVITY * time[sliding], rtol=0, atol=1e-9
    )
    assert result["v"][-1, 0] == pytest.approx(5.0 / 7.0 * start, abs=1e-9)
    assert result["w"][-1, 1] * 0.2 == pytest.approx(result["v"][-1, 0], abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "turn", "share"), [(Sphere(0.5), 0.0, 2 / 7), (Cylinder(0.3, 0.5), math.pi / 2, 1 / 3)]
)
def test_what_rolls_down_a_slope_gives_a_share_of_gravity_to_its_spin(
    shape: Sphere | Cylinder, turn: float, share: float
) -> None:
    """I/(m r²) over one more: five sevenths of g sin θ are left of a ball, two thirds of a cylinder."""
    theta, rough = math.atan(0.3), Material(friction=0.5)
    lies = (math.cos(turn / 2), math.sin(turn / 2), 0.0, 0.0)
    rolls = solid("it", shape, (0, 0, shape.radius), 2.0, orientation=lies, material=rough)
    result = simulate(
        Scene(
            bodies=(fixed("plane", Plane(), material=rough), rolls),
            gravity=(GRAVITY * math.sin(theta), 0, -GRAVITY * math.cos(theta)),
        ),
        time_step=TIME_STEP,
        duration=1.0,
        observe=traces(v=Velocity("it")) | finals(f=ContactForce("it")),
    )

    gain = (1.0 - share) * GRAVITY * math.sin(theta) * TIME_STEP
    np.testing.assert_allclose(result["v"][:, 0], gain * np.arange(61), rtol=0, atol=1e-9)
    assert result["f"][0] == pytest.approx(-share * 2.0 * GRAVITY * math.sin(theta), abs=1e-7)


def test_each_contact_in_a_heap_of_balls_obeys_the_law() -> None:
    """Every pair has one contact, so its force and slip can be read from outside: Signorini and Coulomb hold at
    each, and forces explain the motion of every ball.
    """
    mu, radius = 0.3, 0.5
    material = Material(friction=mu)
    places = [(0.0, 0.0), (0.97, 0.1), (0.45, 0.9), (-0.6, 0.75), (0.48, 0.38), (-0.1, 0.5)]
    heights = [0.5, 0.5, 0.5, 0.5, 1.35, 1.5]
    names = [f"ball{k}" for k in range(len(places))]
    bodies = [RigidBody(name="plane", position=(0, 0, 0), shape=Plane(), motion="static", material=material)]
    bodies += [
        solid(name, Sphere(radius), (x, y, z), 1.0 + k, (0.5 - 0.2 * k, 0.1 * k, 0), material=material)
        for k, (name, (x, y), z) in enumerate(zip(names, places, heights, strict=True))
    ]
    pairs = [*combinations(names, 2), *((name, "plane") for name in names)]
    result = simulate(
        Scene(bodies=tuple(bodies), gravity=(0, 0, -GRAVITY)),
        time_step=TIME_STEP,
        steps=60,
        observe=traces(x=Position(), v=Velocity(), w=AngularVelocity())
        | {f"{a} {b}": Trace(quantity=ContactForce(a, b)) for a, b in pairs},
    )
    index = {"plane": 0} | {name: k + 1 for k, name in enumerate(names)}

    sliding = sticking = 0
    for step in range(1, 61):
        x, v, w = result["x"][step - 1], result["v"][step], result["w"][step]
        total = np.zeros((len(bodies), 3))
        for a, b in pairs:
            i, j = index[a], index[b]
            force = result[f"{a} {b}"][step]
            total[i] += force
            total[j] -= force
            if not force.any():
                continue
            # A pair that only now meets has the normal of that moment within the step, which no sample shows.
            distance = x[i][2] if b == "plane" else np.linalg.norm(x[i] - x[j]) - radius
            if distance > radius + 1e-9 and not result[f"{a} {b}"][step - 1].any():
                continue
            # The engine takes a contact at the middle of the gap.
            if b == "plane":
                normal, arm = np.array((0.0, 0.0, 1.0)), (x[i][2] + radius) / 2.0
            else:
                distance = float(np.linalg.norm(x[i] - x[j]))
                normal, arm = (x[i] - x[j]) / distance, distance / 2.0
            slip = v[i] + np.cross(w[i], -arm * normal)
            if b != "plane":
                slip = slip - v[j] - np.cross(w[j], arm * normal)
            load = force @ normal
            tangential = force - load * normal
            slip -= (slip @ normal) * normal
            assert load >= -1e-9
            assert np.linalg.norm(tangential) <= mu * load + 1e-6 * GRAVITY
            if np.linalg.norm(slip) > 1e-7:
                sliding += 1
                against = -mu * load * slip / np.linalg.norm(slip)
                np.testing.assert_allclose(tangential, against, rtol=0, atol=1e-6 * max(1.0, load))
            else:
                sticking += 1
        # Two that overlap in flight are parted by displacements that keep their momenta together, not by forces.
        flying = step < 10 and np.linalg.norm(x[5] - x[6]) < 2.0 * radius - 1e-9
        for k in range(4 if flying else len(names)):
            gained = (1.0 + k) * (result["v"][step, k + 1] - result["v"][step - 1, k + 1]) / TIME_STEP
            weight = (1.0 + k) * np.array((0.0, 0.0, -GRAVITY))
            np.testing.assert_allclose(
                total[k + 1] + weight, gained, rtol=0, atol=1e-8 * (1.0 + np.abs(gained).max())
            )
    assert sliding > 100
    assert sticking > 50
