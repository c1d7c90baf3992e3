"""T12: impacts. v₊ = −psi v₋ for one contact, momentum kept, energy never gained, joints taking part."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Ball,
    Box,
    Hinge,
    KineticEnergy,
    Lock,
    Material,
    Method,
    Momentum,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
)
from tests.scenes.corpus import fixed, solid
from tests.scenes.seen import finals, traces

H = 1 / 60


def ball(name: str, x: float, speed: float, mass: float, psi: float, y: float = 0.0) -> RigidBody:
    return solid(name, Sphere(0.1), (x, y, 0.0), mass, (speed, 0.0, 0.0), material=Material(restitution=psi))


@pytest.mark.parametrize("psi", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("speed", [0.5, 7.0, 60.0])
@pytest.mark.parametrize("h", [1 / 60, 1e-3])
def test_t12_a_ball_leaves_a_wall_with_its_restitution(psi: float, speed: float, h: float) -> None:
    wall = RigidBody(name="wall", motion="static", shape=Plane((-1.0, 0.0, 0.0)), position=(1.0, 0.0, 0.0))
    steps = 5 + math.ceil(1.8 / speed / h)
    v = simulate(
        Scene(bodies=(wall, ball("ball", 0.0, speed, 2.0, psi))),
        time_step=h,
        steps=steps,
        observe=finals(v=Velocity("ball")),
    )["v"]

    assert v == pytest.approx([-psi * speed, 0.0, 0.0], abs=1e-9 * speed)


@pytest.mark.parametrize("psi", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("ratio", [0.1, 1.0, 3.0, 1e6])
def test_t12_two_balls_part_with_their_restitution(ratio: float, psi: float) -> None:
    """Head on: relative speed −psi times that before, momentum kept, and energy by elastic balls."""
    first, second = ball("first", -0.5, 3.0, 1.0, psi), ball("second", 0.5, -1.0, ratio, 0.0)
    observe = finals(v=Velocity(), e=KineticEnergy()) | traces(p=Momentum())
    result = simulate(Scene(bodies=(first, second)), time_step=H, steps=40, observe=observe)
    centre = (3.0 - ratio) / (1.0 + ratio)
    exact = [centre - psi * 4.0 * ratio / (1.0 + ratio), centre + psi * 4.0 / (1.0 + ratio)]

    np.testing.assert_allclose(result["v"][:, 0], exact, rtol=0.0, atol=1e-13)
    assert np.abs(result["p"] - result["p"][0]).max() < 1e-13 * (3.0 + ratio)
    if psi == 1.0:
        assert result["e"] == pytest.approx(0.5 * (9.0 + ratio), rel=1e-12)


@pytest.mark.parametrize("h", [1 / 60, 1 / 240, 1 / 960])
def test_an_oblique_hit_without_rebound_comes_along_the_line_of_centres_of_its_meeting(h: float) -> None:
    """The ball that is hit leaves with half the speed along it, wherever in its step they meet."""
    speed, aside = 3.0, 0.05
    line = np.array([math.sqrt(0.2**2 - aside**2), -aside, 0.0]) / 0.2
    for before in np.linspace(1.0, 2.0, 9, endpoint=False):  # steps until they meet
        first = ball("first", -0.2 * line[0] - before * h * speed, speed, 1.0, 0.0, y=aside)
        v = simulate(
            Scene(bodies=(first, ball("second", 0.0, 0.0, 1.0, 0.0))),
            time_step=h,
            steps=4,
            observe=finals(v=Velocity("second")),
        )["v"]

        assert v == pytest.approx(0.5 * speed * line[0] * line, abs=1e-14 * speed)


@pytest.mark.parametrize("psi", [0.05, 0.6, 1.0])
@pytest.mark.parametrize(("kind", "bound"), [("hinge", 1e-12), ("lock that turns", 1e-6)])
def test_t12_joints_take_part_in_an_impact(kind: str, bound: float, psi: float) -> None:
    """A ball hits a hinged plank: the impulse is (1 + psi) V/(1/m + d²/I), I about the hinge."""
    speed, mass, arm = 4.0, 0.5, 0.8
    plank = solid("plank", Box((0.1, 1.0, 0.2)), (0.0, 0.5, 0.0), 3.0, material=Material(restitution=psi))
    moment = 3.0 * (1.0 + 0.01) / 12.0 + 3.0 * 0.25
    ends: tuple[str, str] = (WORLD, "plank")
    pin = {
        "hinge": Hinge(name="pin", between=ends, at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), compliance=0.0),
        "lock that turns": Lock(
            name="pin", between=ends, at=(0.0, 0.0, 0.0), compliance=(0, 0, 0, 1e9, 1e9, 1e9)
        ),
    }[kind]
    scene = Scene(bodies=(plank, ball("ball", -0.4, speed, mass, psi, y=arm)), constraints=(pin,))
    observe = traces(v=Velocity("ball"), w=AngularVelocity("plank"))
    result = simulate(scene, time_step=1e-3, steps=200, observe=observe)
    impulse = (1.0 + psi) * speed / (1.0 / mass + arm**2 / moment)
    hit = int(np.argmax(result["v"][:, 0] < speed - 1e-6))

    assert result["v"][hit, 0] == pytest.approx(speed - impulse / mass, abs=bound)
    assert result["w"][hit, 2] == pytest.approx(-impulse * arm / moment, abs=bound)


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_an_impact_runs_through_a_row_of_balls(gap: float) -> None:
    """Successive impacts, or gaps: the last ball leaves with the speed of the first. Touching and simultaneous,
    Newton's law for all at once gives −.6 and .4 for the rest."""
    row = [ball(f"b{k}", k * (0.2 + gap), 0.0, 1.0, 1.0) for k in range(1, 5)]
    bodies = (ball("b0", -0.3, 1.0, 1.0, 1.0), *row)
    for impacts, after in (
        ("successive", [0, 0, 0, 0, 1]),
        ("simultaneous", [0, 0, 0, 0, 1] if gap else [-0.6, 0.4, 0.4, 0.4, 0.4]),
    ):
        result = simulate(
            Scene(bodies=bodies),
            time_step=H,
            steps=60,
            method=Method(impacts=impacts),  # type: ignore[arg-type]
            observe=finals(v=Velocity()),
        )
        np.testing.assert_allclose(result["v"][:, 0], after, rtol=0, atol=1e-12)


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("h", [1e-3, 1 / 4000])
def test_balls_held_by_joints_go_on_after_an_impact_as_it_left_them(h: float, solver: str) -> None:
    """Equal balls on arms as long as they are thick exchange their spins. Led to the blow's time they were moved, not turned;
    the joints answered that with a speed in the next step, 8 % of the spin at any time step.

    A joint answers the curvature of its path, half (h w)² of its arm, with at most 4/h of it Ups, Ups = 1/9 at the damping
    of two steps: 2/9 h w² of spin.
    """
    arm, radius, lean, spin = 0.35, 0.3, 0.2, 1.5
    bodies, joints = [], []
    for i, (a, w) in enumerate(((-lean, spin), (0.0, 0.0))):
        reach = arm * np.array((math.sin(a), 0.0, -math.cos(a)))
        bodies.append(
            solid(
                f"b{i}",
                Sphere(radius),
                (reach[0] + 2 * radius * i, 0.0, reach[2]),
                velocity=tuple(np.cross((0.0, -w, 0.0), reach)),
                spin=(0.0, -w, 0.0),
                material=Material(restitution=1.0),
            )
        )
        joints.append(
            Ball(name=f"j{i}", between=(WORLD, f"b{i}"), at=(2 * radius * i, 0.0, 0.0), compliance=0)
        )
    result = simulate(
        Scene(bodies=tuple(bodies), constraints=tuple(joints)),
        time_step=h,
        duration=0.2,
        method=Method(solver=solver),  # type: ignore[arg-type]
        observe=traces(w=AngularVelocity()),
    )
    w = -result["w"][:, :, 1]
    hit = int(np.argmax(w[:, 1] > 0.5 * spin))

    assert hit * h == pytest.approx(lean / spin, abs=2 * h)
    assert np.abs(w[hit:] - (0.0, spin)).max() < 2 / 9 * h * spin**2


def meetings(
    places: np.ndarray, speeds: np.ndarray, masses: np.ndarray, size: float, until: float
) -> np.ndarray:
    """Speeds of elastic balls on a line after all their meetings, one at a time in order."""
    x, v = places.copy(), speeds.copy()
    while True:
        closing = v[:-1] - v[1:]
        gaps = np.maximum(0.0, np.diff(x) - size)
        times = np.where(closing > 1e-12, gaps / np.where(closing > 1e-12, closing, 1.0), np.inf)
        k = int(np.argmin(times))
        if times[k] >= until:
            return v
        x, until = x + times[k] * v, until - times[k]
        impulse = 2.0 * closing[k] / (1.0 / masses[k] + 1.0 / masses[k + 1])
        v[k : k + 2] += (-impulse / masses[k], impulse / masses[k + 1])


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("ends", [1, 2])
@pytest.mark.parametrize("seed", range(24))
def test_successive_impacts_come_in_the_order_of_their_times(seed: int, ends: int, solver: str) -> None:
    """Rows of up to seven balls with gaps of 1e-9 to 1e-4 m, struck from one end or both: blows follow each other within a
    step, and which comes first decides which leaves with what. All pairs that approached were answered at once: 16 of
    24 rows struck from one end left otherwise, by up to their whole speed."""
    rng, h = np.random.default_rng(seed), (H, 1 / 240, 1e-3)[seed % 3]
    count = int(rng.integers(3, 8))
    masses = 10.0 ** rng.uniform(-0.7, 0.7, count)
    places = np.concatenate(((0.0,), np.cumsum(0.2 + 10.0 ** rng.uniform(-9.0, -4.0, count - 1))))
    speeds = np.zeros(count)
    speeds[0] = rng.uniform(0.5, 4.0)
    places[0] -= rng.uniform(0.5, 3.0) * h * speeds[0]
    if ends == 2:
        speeds[-1] = -rng.uniform(0.5, 4.0)
        places[-1] -= rng.uniform(0.5, 3.0) * h * speeds[-1]
    after = meetings(places, speeds, masses, 0.2, 12 * h)
    row = zip(places, speeds, masses, strict=True)
    run = simulate(
        Scene(
            bodies=tuple(ball(f"b{k}", float(x), float(v), float(m), 1.0) for k, (x, v, m) in enumerate(row))
        ),
        time_step=h,
        steps=12,
        method=Method(impacts="successive", solver=solver),  # type: ignore[arg-type]
        observe=finals(v=Velocity()) | traces(p=Momentum(), energy=KineticEnergy()),
    )

    assert np.abs(run["v"][:, 0] - after).max() < 1e-6 * np.abs(speeds).max()
    assert np.abs(run["p"] - run["p"][0]).max() < 1e-12 * (masses @ np.abs(speeds))
    assert np.ptp(run["energy"]) < 1e-12 * run["energy"][0]


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("shape", [Plane(), Box((50.0, 50.0, 1.0))], ids=["planes", "boxes"])
@pytest.mark.parametrize("blows", [1, 2, 3, 6, 12])
def test_friction_turns_what_rebounds_about_its_own_surface_wherever_the_step_began(
    blows: int, shape: Plane | Box, solver: str
) -> None:
    """A gripping ball flies from the middle of a room to its middle: so many walls within one step, and the same speeds and
    place as by impulses. The lever is its radius, not the half gap of the step's start more."""
    rubber, deep = Material(friction=5.0, restitution=1.0), 0.5 if isinstance(shape, Box) else 0.0
    walls = [
        fixed(
            name,
            Plane((0.0, 0.0, up)) if isinstance(shape, Plane) else shape,
            (0.0, 0.0, z - up * deep),
            material=rubber,
        )
        for name, up, z in (("floor", 1.0, 0.0), ("ceiling", -1.0, 1.0))
    ]
    thrown = solid("ball", Sphere(0.1), (0.0, 0.0, 0.5), velocity=(3.0, 0.0, -4.0), material=rubber)
    result = simulate(
        Scene(bodies=(*walls, thrown)),
        time_step=0.2 * blows,
        steps=1,
        method=Method(solver=solver),  # type: ignore[arg-type]
        observe=finals(v=Velocity("ball"), w=AngularVelocity("ball"), x=Position("ball")),
    )
    along, way = 3.0, 0.3  # m/s, and half a flight of 0.2 s, m
    for blow in range(blows):
        along *= 5.0 / 7.0 if blow == 0 else 3.0 / 7.0
        way += 0.2 * along * (0.5 if blow == blows - 1 else 1.0)
    side = 1.0 if blows % 2 else -1.0
    assert result["v"] == pytest.approx([along, 0.0, 4.0 * side], abs=1e-12)
    assert result["w"] == pytest.approx([0.0, side * along / 0.1, 0.0], abs=1e-11)
    assert result["x"] == pytest.approx([way, 0.0, 0.5], abs=1e-12)
