"""Forces without rows: free fall, springs as plain forces, orbits. What the symplectic step must give."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    CentralGravity,
    Energy,
    Final,
    Load,
    Method,
    Particle,
    Position,
    Scene,
    Spring,
    Trace,
    Velocity,
    simulate,
)

HALF_STEPS = Method(half_step_velocities=True)


def traced(
    scene: Scene, h: float, steps: int, method: Method | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, positions and velocities of the first body."""
    name = scene.bodies[0].name
    observe = {"x": Trace(quantity=Position(name)), "v": Trace(quantity=Velocity(name))}
    result = simulate(scene, time_step=h, steps=steps, method=method or Method(), observe=observe)
    return result.sample_times["x"], result["x"], result["v"]


@pytest.mark.parametrize("h", [0.1, 1 / 60, 1 / 64, 1e-3])
def test_t7_free_fall_is_early_by_half_a_step(h: float) -> None:
    """Velocity is right; the position leads by ½ g t h, and by nothing when velocities live at half steps."""
    g, x0, v0 = np.array([0.5, -1.0, -9.81]), np.array([3.0, 2.0, 1.0]), np.array([1.0, 0.0, 4.0])
    body = Particle(name="body", mass=7.0, position=tuple(x0), velocity=tuple(v0))
    scene = Scene(bodies=(body,), gravity=tuple(g))
    steps = round(20.0 / h)
    t, x, v = traced(scene, h, steps)
    exact = x0 + np.outer(t, v0) + 0.5 * np.outer(t**2, g)

    rounding = 1e-16 * steps  # relative, were every step's rounding to add up
    assert np.abs(v - v0 - np.outer(t, g)).max() < rounding * np.abs(v).max()
    assert np.abs(x - exact - 0.5 * h * np.outer(t, g)).max() < rounding * np.abs(x).max()
    t, x, v = traced(scene, h, steps, HALF_STEPS)
    assert np.abs(v - v0 - np.outer(t, g)).max() < rounding * np.abs(v).max()
    assert np.abs(x - exact).max() < rounding * np.abs(x).max()


def test_a_load_is_a_force_and_gravity_an_acceleration() -> None:
    bodies = tuple(
        Particle(name=n, mass=m, position=(0.0, 0.0, m)) for n, m in (("light", 1.0), ("heavy", 5.0))
    )
    loads = tuple(Load(name=f"on {b.name}", body=b.name, force=(10.0, 0.0, 0.0)) for b in bodies)
    scene = Scene(bodies=bodies, forces=loads, gravity=(0.0, 3.0, 0.0))
    v = simulate(scene, time_step=0.1, steps=10, observe={"v": Trace(quantity=Velocity())})["v"][-1]

    np.testing.assert_allclose(v, [[10.0, 3.0, 0.0], [2.0, 3.0, 0.0]], rtol=0.0, atol=1e-14)


def oscillator(w: float) -> Scene:
    mass = 2.5
    ball = Particle(name="ball", mass=mass, position=(0.1, 0.0, 0.0))
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "ball"), stiffness=mass * w**2)
    return Scene(bodies=(ball,), forces=(spring,))


@pytest.mark.parametrize("speed", [0.01, math.sqrt(0.014), 1.0, 1.99])
def test_t6_a_spring_as_a_force_keeps_its_invariant(speed: float) -> None:
    """v² − h w² x v + w² x² is constant, and the phase per step is 2 asin(h w/2)."""
    h = 0.05
    w = speed / h
    _, xs, vs = traced(oscillator(w), h, 2000)
    x, v = xs[:, 0], vs[:, 0]
    invariant = v**2 - h * w**2 * x * v + w**2 * x**2
    turn = 2.0 * math.asin(0.5 * speed)
    n = np.arange(2001)
    exact = 0.1 * np.cos(n * turn) - 0.1 * math.tan(0.5 * turn) * np.sin(n * turn)

    assert np.ptp(invariant) / invariant[0] < 1e-11
    assert np.abs(x - exact).max() < 1e-10


def test_t6_beyond_two_radians_a_step_a_spring_as_a_force_explodes() -> None:
    h = 0.05
    stable = np.abs(traced(oscillator(1.999 / h), h, 2000)[1]).max()
    unstable = simulate(oscillator(2.001 / h), time_step=h, steps=100_000)

    assert stable < 0.1 * 50.0
    assert unstable.status == "diverged"
    assert unstable.failed_body == "ball"


K, XI = 2.0 * math.pi / 365.0, 0.017  # 1/s and 1: the thesis' planet


def planet() -> Scene:
    body = Particle(name="planet", mass=2.0, position=(1.0, 0.0, 0.0), velocity=(-XI * K, K, 0.0))
    return Scene(bodies=(body,), forces=(CentralGravity(name="sun", strength=K**2),))


def test_t14_an_orbit_keeps_angular_momentum_and_swings_in_energy_by_2hk_xi() -> None:
    h = 1 / 60
    observe = {"l": Trace(quantity=AngularMomentum()), "e": Trace(quantity=Energy())}
    result = simulate(planet(), time_step=h, duration=1200.0, observe=observe)
    spin, energy = result["l"][:, 2], result["e"]

    assert np.ptp(spin) / spin[0] < 1e-12
    assert energy[0] == pytest.approx(2.0 * (0.5 * K**2 * (1.0 + XI**2) - K**2), rel=1e-14)
    swing = np.abs(energy / energy[0] - 1.0).max()
    assert swing == pytest.approx(2.0 * h * K * XI, rel=0.02)


def kepler(t: np.ndarray) -> np.ndarray:
    """(n, 2) positions by Newton on Kepler's equation; the orbit r = 1/(1 + XI sin θ), at θ = 0 at the start."""
    a = 1.0 / (1.0 - XI**2)
    rate = K / a**1.5  # 1/s, mean motion
    # the perihelion lies where sin θ = 1, so the true anomaly is θ − 90°
    start = -0.5 * math.pi
    eccentric = 2.0 * math.atan(math.sqrt((1.0 - XI) / (1.0 + XI)) * math.tan(0.5 * start))
    mean = eccentric - XI * math.sin(eccentric) + rate * t
    e = mean.copy()
    for _ in range(20):
        e -= (e - XI * np.sin(e) - mean) / (1.0 - XI * np.cos(e))
    along, across = a * (np.cos(e) - XI), a * math.sqrt(1.0 - XI**2) * np.sin(e)
    return np.stack([-across, along], axis=1)  # turned by 90°


@pytest.mark.parametrize(("method", "order"), [(Method(), 1.0), (HALF_STEPS, 2.0)])
def test_t14_the_orbit_converges_to_keplers(method: Method, order: float) -> None:
    """First order with whole steps, second with half steps, against Kepler's equation."""
    errors = []
    for h in (0.4, 0.2):
        t, x, _ = traced(planet(), h, round(400.0 / h), method)
        errors.append(np.abs(x[:, :2] - kepler(t)).max())

    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.02)


def test_half_steps_bring_the_planet_from_2e_4_to_below_1e_6_m() -> None:
    """Where the planet is after 1200 s at h = 1/60."""
    for method, error in ((Method(), 2.51e-4), (HALF_STEPS, 5.25e-7)):
        t, x, _ = traced(planet(), 1 / 60, 72_000, method)
        assert np.linalg.norm(x[-1, :2] - kepler(t[-1:])[0]) == pytest.approx(error, rel=0.01)


@pytest.mark.parametrize(("viscosity", "order"), [(0.0, 2.0), (1.5, 1.0)])
def test_half_steps_are_of_order_2_but_where_a_force_follows_the_velocity(
    viscosity: float, order: float
) -> None:
    """m x'' = −k x − c x' against its closed form; the force of a step sees the velocity of half a step before."""
    k, mass, end = 20.0, 1.0, 1.0
    decay = 0.5 * viscosity / mass
    pace = math.sqrt(k / mass - decay**2)
    exact = 0.5 * math.exp(-decay * end) * (math.cos(pace * end) + decay / pace * math.sin(pace * end))
    spring = Spring(
        name="s", between=((0.0, 0.0, 0.0), "p"), stiffness=k, rest_length=1.0, viscosity=viscosity
    )
    scene = Scene(bodies=(Particle(name="p", mass=mass, position=(1.5, 0.0, 0.0)),), forces=(spring,))
    seen = {"x": Final(quantity=Position("p"))}
    errors = [
        float(simulate(scene, time_step=h, duration=end, method=HALF_STEPS, observe=seen)["x"][0])
        - 1.0
        - exact
        for h in (1 / 400, 1 / 800)
    ]

    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.02)
