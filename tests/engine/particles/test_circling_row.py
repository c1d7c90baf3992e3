"""Rows that turn: the radius of a steady circle, hanging weights, and the pendulum of the thesis in numbers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from spook_tracker.engine import (
    AngularMomentum,
    ConstraintForce,
    Distance,
    Energy,
    Final,
    MaximumAbsolute,
    Method,
    Particle,
    Position,
    Scene,
    Trace,
    Violation,
    simulate,
)

GRAVITY = 9.81  # m/s²


def steady_circle(
    r: float, turn: float, mass: float, eps: float, theta: float, h: float
) -> tuple[Scene, float]:
    """A scene that circles at radius r by `turn` [rad] a step if its row has the length returned with it."""
    sag = r * (1.0 - math.cos(turn)) * (0.5 * (1.0 + 2.0 * theta) + 2.0 * mass * eps / h**2)
    last = (r * math.cos(turn), -r * math.sin(turn))
    body = Particle(
        name="body", mass=mass, position=(r, 0.0, 0.0), velocity=((r - last[0]) / h, -last[1] / h, 0.0)
    )
    row = Distance(
        name="row", between=((0.0, 0.0, 0.0), "body"), rest_length=r - sag, compliance=eps, damping=theta * h
    )
    return Scene(bodies=(body,), constraints=(row,)), r - sag


@pytest.mark.parametrize(
    ("eps", "theta"),
    [(eps, theta) for eps in (0.0, 1e-6) for theta in (0.0, 0.5, 1.0, 2.0, 6.0) if eps or theta],
)
@pytest.mark.parametrize("turn", [0.01, 0.1])
def test_t9_a_steady_circle_stays_one(turn: float, eps: float, theta: float) -> None:
    """Its radius exceeds the row's length by r (1 − cos φ) [(1 + 2 theta)/2 + 2 m eps/h²], from the first step on."""
    h, mass = 0.01, 3.0
    scene, _ = steady_circle(1.3, turn, mass, eps, theta, h)
    observe = {
        "x": Trace(quantity=Position("body")),
        "l": Trace(quantity=AngularMomentum()),
        "f": Trace(quantity=ConstraintForce("row"), first=1),
    }
    result = simulate(scene, time_step=h, steps=500, observe=observe)
    x, y = result["x"][:, 0], result["x"][:, 1]
    steps = np.arange(501)

    assert np.abs(np.hypot(x, y) - 1.3).max() < 1e-12
    assert np.abs(x - 1.3 * np.cos(turn * steps)).max() < 1e-10
    assert np.ptp(result["l"][:, 2]) < 1e-12 * mass * 1.3**2 * turn / h
    assert result["f"] == pytest.approx(mass * 2.0 * 1.3 * (1.0 - math.cos(turn)) / h**2, rel=1e-9)


def test_t16_as_compliance_vanishes_the_circle_forgets_the_mass() -> None:
    trajectories = []
    for mass in (1e-3, 1.0, 1200.0, 1e6):
        scene, _ = steady_circle(1.0, 0.05, mass, 0.0, 1.0, 0.01)
        trajectories.append(
            simulate(scene, time_step=0.01, steps=300, observe={"x": Trace(quantity=Position("body"))})["x"]
        )

    for other in trajectories[1:]:
        assert np.abs(other - trajectories[0]).max() < 1e-12


MASSES = (1.0, 2.0, 4.0)  # kg, hanging under each other
CARRIED = GRAVITY * np.array([7.0, 6.0, 4.0])  # N


def hanging(eps: float, damping: float, sag: float) -> Scene:
    """Three weights in a column, each row stretched by `sag` times what it carries [m/N]."""
    heights = -np.cumsum(1.0 + sag * CARRIED)
    bodies = tuple(
        Particle(name=f"w{i}", mass=m, position=(0.0, 0.0, float(heights[i]))) for i, m in enumerate(MASSES)
    )
    above = ((0.0, 0.0, 0.0), "w0", "w1")
    rows = tuple(
        Distance(name=f"r{i}", between=(above[i], f"w{i}"), rest_length=1.0, compliance=eps, damping=damping)
        for i in range(3)
    )
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -GRAVITY))


@pytest.mark.parametrize("h", [1e-3, 1 / 60, 0.1])
@pytest.mark.parametrize("theta", [0.0, 0.5, 2.0, 5.0])
@pytest.mark.parametrize("eps", [1e-8, 1e-3])
def test_t8_a_weight_rests_where_its_row_sags_by_compliance_times_weight(
    eps: float, theta: float, h: float
) -> None:
    """It stays there for every time step and damping."""
    observe = {
        "x": MaximumAbsolute(quantity=Position(), from_start=True),
        "g": Final(quantity=Violation()),
        "f": Final(quantity=ConstraintForce()),
    }
    result = simulate(hanging(eps, theta * h, sag=eps), time_step=h, steps=200, observe=observe)

    assert result["x"].max() < 1e-12
    np.testing.assert_allclose(result["f"], CARRIED, rtol=1e-6 if eps < 1e-6 else 1e-10)
    np.testing.assert_allclose(result["g"], eps * CARRIED, rtol=0.0, atol=1e-12)


def test_t8_weights_settle_where_they_rest() -> None:
    """Let go with slack rows."""
    observe = {"g": Final(quantity=Violation()), "f": Final(quantity=ConstraintForce())}
    result = simulate(hanging(1e-5, 0.05, sag=0.0), time_step=0.02, steps=2000, observe=observe)

    np.testing.assert_allclose(result["f"], CARRIED, rtol=1e-9)
    np.testing.assert_allclose(result["g"], 1e-5 * CARRIED, rtol=1e-9)


def pendulum(h: float, mass: float = 1.0) -> Scene:
    """The thesis': level and at rest, eps 1e-13, tau = h."""
    bob = Particle(name="bob", mass=mass, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "bob"), compliance=1e-13, damping=h)
    return Scene(bodies=(bob,), constraints=(rod,), gravity=(0.0, 0.0, -GRAVITY))


def exact(t: np.ndarray) -> np.ndarray:
    """Angle from hanging [rad], by Jacobi's functions: from 90°, θ = 2 asin(k cd(w t | k²)), k² = ½."""
    _, cn, dn, _ = ellipj(math.sqrt(GRAVITY) * t, 0.5)
    return 2.0 * np.arcsin(math.sqrt(0.5) * cn / dn)


def test_the_exact_pendulum_has_the_known_period() -> None:
    period = 4.0 * ellipk(0.5) / math.sqrt(GRAVITY)

    assert period == pytest.approx(2.36784194757624, abs=1e-14)
    assert exact(np.array([period]))[0] == pytest.approx(0.5 * math.pi, abs=1e-7)


@pytest.mark.parametrize(
    ("corrections", "deviation", "digits"), [(0, 0.407038e-2, 1e-6), (1, 9.3e-6, 0.01), (2, 2.5e-8, 0.02)]
)
def test_the_length_of_the_pendulum(corrections: int, deviation: float, digits: float) -> None:
    """Over 22 s at h = 1/60: .407038 % linearised, 9.3e-4 % and 2.5e-6 % with the curvature kept."""
    observe = {"g": MaximumAbsolute(quantity=Violation("rod"))}
    result = simulate(
        pendulum(1 / 60),
        time_step=1 / 60,
        duration=22.0,
        method=Method(corrections=corrections),
        observe=observe,
    )

    assert float(result["g"]) == pytest.approx(deviation, rel=digits)


def test_t9_predicts_the_deviation_of_the_pendulum() -> None:
    """(1 + 2 theta)/4 · 2 g h²/L at the lowest point, to the order h²: .409 % and 7.2 % at theta = 1."""
    for h, rel in ((1 / 1000, 1e-3), (1 / 60, 0.01)):
        observe = {"g": MaximumAbsolute(quantity=Violation("rod"))}
        found = float(simulate(pendulum(h), time_step=h, duration=22.0, observe=observe)["g"])
        assert found == pytest.approx(0.75 * 2.0 * GRAVITY * h**2, rel=rel)


@pytest.mark.parametrize(("corrections", "order"), [(0, 2.0), (1, 4.0), (2, 6.0)])
def test_the_length_converges_with_two_orders_per_correction(corrections: int, order: float) -> None:
    method = Method(corrections=corrections)
    errors = []
    for h in (1 / 50, 1 / 100):
        observe = {"g": MaximumAbsolute(quantity=Violation("rod"))}
        errors.append(
            float(simulate(pendulum(h), time_step=h, duration=4.0, method=method, observe=observe)["g"])
        )

    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def angle_error(h: float, method: Method) -> float:
    """Error of the angle [rad] after 10 s."""
    final = simulate(pendulum(h), time_step=h, duration=10.0, method=method).final_state["bob"]
    return float(abs(np.arctan2(final[0], -final[2]) - exact(np.array([10.0]))[0]))


def test_half_steps_bring_the_angle_from_2e_3_to_3e_4_rad() -> None:
    """At h = 1/1000 over 10 s, at no cost."""
    assert angle_error(1e-3, Method()) == pytest.approx(1.9e-3, rel=0.05)
    assert angle_error(1e-3, Method(half_step_velocities=True)) == pytest.approx(3.0e-4, rel=0.05)


def test_the_pendulum_ends_with_an_energy_that_means_something() -> None:
    """Plain, 22 s at 1/60: max |E − E0| is 3.433 % of m g l, and the rod carries 3 m g at the lowest point."""
    observe = {
        "e": MaximumAbsolute(quantity=Energy(), from_start=True),
        "f": MaximumAbsolute(quantity=ConstraintForce("rod")),
    }
    plain = simulate(pendulum(1 / 60), time_step=1 / 60, duration=22.0, observe=observe)
    fine = simulate(
        pendulum(1e-4), time_step=1e-4, duration=1.0, method=Method(corrections=1), observe=observe
    )

    assert float(plain["e"]) / GRAVITY == pytest.approx(3.433e-2, rel=1e-4)
    assert float(fine["f"]) == pytest.approx(3.0 * GRAVITY, rel=1e-3)


def test_half_steps_start_on_a_moving_row() -> None:
    """A circle begun at its exact speed keeps its place to second order: the half kick knows Ġ v."""
    h, speed = 0.01, 2.0
    body = Particle(name="body", mass=1.0, position=(1.0, 0.0, 0.0), velocity=(0.0, speed, 0.0))
    row = Distance(name="row", between=((0.0, 0.0, 0.0), "body"), compliance=0.0, damping=h)
    scene = Scene(bodies=(body,), constraints=(row,))
    observe = {"x": Trace(quantity=Position("body")), "f": Trace(quantity=ConstraintForce("row"), first=1)}
    errors = []
    for step in (h, 0.5 * h):
        result = simulate(
            scene,
            time_step=step,
            duration=2.0,
            method=Method(half_step_velocities=True, corrections=2),
            observe=observe,
        )
        t = result.sample_times["x"]
        circle = np.stack([np.cos(speed * t), np.sin(speed * t)], axis=1)
        errors.append(np.abs(result["x"][:, :2] - circle).max())
        assert result["f"] == pytest.approx(speed**2, rel=2e-3)  # m v²/r from the first step on

    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
