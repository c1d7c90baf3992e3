"""Orders of accuracy of trajectories, against elliptic functions, Kepler's equation and a tight integration."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj

from spook_tracker.engine import (
    AngularMomentum,
    CentralGravity,
    Distance,
    Energy,
    MaximumAbsolute,
    Method,
    MethodError,
    Particle,
    Position,
    Scene,
    Spring,
    Trace,
    Violation,
    compile,
    simulate,
)
from tests.oracles.particles import Array

GRAVITY = 9.81  # m/s²
HALF_STEPS = Method(half_step_velocities=True)
CURVED_HALF_STEPS = Method(half_step_velocities=True, corrections=1)
ORDER4, ORDER6, ORDER8 = (Method(composition=order) for order in ("order4", "order6", "order8"))


def chain(links: int, h: float) -> Scene:
    """Unit links in a horizontal line at rest, 1 kg each, nearly rigid."""
    bodies = tuple(Particle(name=f"b{i}", mass=1.0, position=(i + 1.0, 0.0, 0.0)) for i in range(links))
    rows = tuple(
        Distance(
            name=f"r{i}",
            between=((0.0, 0.0, 0.0) if i == 0 else f"b{i - 1}", f"b{i}"),
            compliance=1e-13,
            damping=h,
        )
        for i in range(links)
    )
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -GRAVITY))


def positions(scene: Scene, h: float, duration: float, method: Method) -> tuple[Array, Array]:
    """Times and positions (samples, n, 3) of 21 evenly spaced samples."""
    observe = {"x": Trace(quantity=Position(), every=round(duration / h / 20.0))}
    result = simulate(scene, time_step=h, duration=duration, method=method, observe=observe)
    return result.sample_times["x"], result["x"]


def pendulum_error(h: float, method: Method) -> float:
    """Largest distance [m] from Jacobi's elliptic pendulum over 10 s, from 90°."""
    t, x = positions(chain(1, h), h, 10.0, method)
    _, cn, dn, _ = ellipj(math.sqrt(GRAVITY) * t, 0.5)
    angle = 2.0 * np.arcsin(math.sqrt(0.5) * cn / dn)
    return float(np.abs(x[:, 0] - np.stack([np.sin(angle), 0.0 * t, -np.cos(angle)], axis=1)).max())


def three_links(times: Array) -> Array:
    """(samples, 3, 3) positions of the chain of three: Lagrange's equations in the angles, DOP853 at 1e-13."""
    below = np.array([[3.0, 2.0, 1.0], [2.0, 2.0, 1.0], [1.0, 1.0, 1.0]])  # masses below both links

    def slope(_: float, y: Array) -> Array:
        a, da = y[:3], y[3:]
        difference = a[:, None] - a[None, :]
        right = -(below * np.sin(difference)) @ da**2 - GRAVITY * np.diag(below) * np.sin(a)
        return np.concatenate([da, np.linalg.solve(below * np.cos(difference), right)])

    start = np.array([0.5 * math.pi] * 3 + [0.0] * 3)
    y = solve_ivp(slope, (0.0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13).y[:3].T
    x, z = np.cumsum(np.sin(y), axis=1), -np.cumsum(np.cos(y), axis=1)
    return np.stack([x, np.zeros_like(x), z], axis=2)


def chain_error(h: float, method: Method) -> float:
    """Largest distance [m] of three links from the tight integration over 1 s."""
    t, x = positions(chain(3, h), h, 1.0, method)
    return float(np.abs(x - three_links(t)).max())


K, XI = 2.0 * math.pi / 365.0, 0.017


def planet() -> Scene:
    body = Particle(name="planet", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(-XI * K, K, 0.0))
    return Scene(bodies=(body,), forces=(CentralGravity(name="sun", strength=K**2),))


def orbit_error(h: float, method: Method) -> float:
    """Largest distance [m] over 1200 s from Kepler's equation, solved by Newton."""
    t, x = positions(planet(), h, 1200.0, method)
    a = 1.0 / (1.0 - XI**2)
    start = 2.0 * math.atan(-math.sqrt((1.0 - XI) / (1.0 + XI)))  # a quarter before the perihelion
    mean = start - XI * math.sin(start) + K / a**1.5 * t
    e = mean.copy()
    for _ in range(20):
        e -= (e - XI * np.sin(e) - mean) / (1.0 - XI * np.cos(e))
    exact = np.stack([-a * math.sqrt(1.0 - XI**2) * np.sin(e), a * (np.cos(e) - XI)], axis=1)
    return float(np.abs(x[:, 0, :2] - exact).max())


CASES = [
    (pendulum_error, Method(), 1.0, 1 / 2000),
    (pendulum_error, HALF_STEPS, 2.0, 1 / 1000),
    (pendulum_error, CURVED_HALF_STEPS, 2.0, 1 / 40),
    *((pendulum_error, ORDER4, 4.0, h) for h in (1 / 40, 1 / 120)),
    *((pendulum_error, ORDER6, 6.0, h) for h in (1 / 30, 1 / 40)),
    *((pendulum_error, ORDER8, 8.0, h) for h in (1 / 16, 1 / 20)),
    (chain_error, Method(), 1.0, 1 / 1000),
    (chain_error, HALF_STEPS, 2.0, 1 / 1000),
    (chain_error, CURVED_HALF_STEPS, 2.0, 1 / 200),
    (chain_error, ORDER4, 4.0, 1 / 200),
    (chain_error, ORDER6, 6.0, 1 / 100),
    (chain_error, ORDER8, 8.0, 1 / 40),
    (orbit_error, Method(), 1.0, 0.25),
    (orbit_error, HALF_STEPS, 2.0, 1.0),
    (orbit_error, ORDER4, 4.0, 5.0),
    (orbit_error, ORDER6, 6.0, 5.0),
    (orbit_error, ORDER8, 8.0, 10.0),
]


@pytest.mark.parametrize(("error", "method", "order", "h"), CASES)
def test_the_trajectory_has_its_order(
    error: Callable[[float, Method], float], method: Method, order: float, h: float
) -> None:
    """Halving the step divides the error by 2^order, to a tenth in the order."""
    assert math.log2(error(h, method) / error(0.5 * h, method)) == pytest.approx(order, abs=0.1)


def test_high_orders_reach_rounding() -> None:
    """What they are for: the pendulum to 1e-12 m and the orbit to 1e-12 m with steps a plain run is lost at."""
    assert pendulum_error(1 / 80, ORDER8) < 1e-12
    assert orbit_error(5.0, ORDER8) < 1e-11


@pytest.mark.parametrize("method", [ORDER4, ORDER6, ORDER8], ids=lambda m: m.composition)
def test_a_composition_keeps_lengths_momentum_and_energy(method: Method) -> None:
    observe = {
        "g": MaximumAbsolute(quantity=Violation()),
        "e": Trace(quantity=Energy()),
        "l": Trace(quantity=AngularMomentum()),
    }
    three = simulate(chain(3, 0.01), time_step=0.01, duration=5.0, method=method, observe=observe)
    orbit = simulate(
        planet(), time_step=2.0, duration=20_000.0, method=method, observe=observe | {"g": observe["e"]}
    )
    first, last = np.array_split(orbit["e"], 2)

    assert three["g"].max() < 1e-9
    assert np.ptp(orbit["l"][:, 2]) < 1e-12 * K
    assert abs(first.mean() / last.mean() - 1.0) < 1e-9
    assert np.ptp(last) < 1.1 * np.ptp(first) + 1e-15


def test_a_composition_treats_springs_as_the_smooth_forces_they_are() -> None:
    """x = x0 cos w t: order six with a linear spring in three dimensions."""
    ball = Particle(name="ball", mass=2.0, position=(0.3, 0.0, 0.0), velocity=(0.0, 0.6, 0.0))
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "ball"), stiffness=8.0)
    scene = Scene(bodies=(ball,), forces=(spring,))
    errors = []
    for h in (0.1, 0.05):
        t, x = positions(scene, h, 10.0, ORDER6)
        exact = np.stack([0.3 * np.cos(2.0 * t), 0.3 * np.sin(2.0 * t), 0.0 * t], axis=1)
        errors.append(np.abs(x[:, 0] - exact).max())

    assert math.log2(errors[0] / errors[1]) == pytest.approx(6.0, abs=0.1)


def test_a_composition_says_what_it_cannot_do() -> None:
    ball = Particle(name="ball", mass=2.0, position=(1.0, 0.0, 0.0))

    def rod(**changes: float) -> Distance:
        return Distance(name="rod", between=((0.0, 0.0, 0.0), "ball"), **changes)  # type: ignore[arg-type]

    damper = Spring(name="damper", between=((0.0, 0.0, 0.0), "ball"), stiffness=1.0, viscosity=0.1)
    refused = (
        (Scene(bodies=(ball,), constraints=(rod(compliance=1e-3),)), ORDER4, "rod"),
        *((Scene(bodies=(ball,), constraints=(rod(rest_length=r),)), ORDER4, "rod") for r in (0.9, 1.1)),
        (Scene(bodies=(ball,), forces=(damper,)), ORDER4, "damper"),
        (
            Scene(bodies=(ball,), constraints=(rod(),)),
            Method(composition="order4", solver="iterative"),
            "direct",
        ),
        (
            Scene(bodies=(ball,), constraints=(rod(),)),
            Method(composition="order4", string_stiffness=True),
            "string stiffness",
        ),
    )
    for scene, method, culprit in refused:
        with pytest.raises(MethodError, match=culprit):
            compile(scene, time_step=0.01, method=method)
