"""A mass on one row moves by a 2×2 matrix: its powers, eigenvalues, frequency, damping and growth, from the law.

Along the row the state is (z, v), z = |d| − L. With rho = 1/(1 + m Sig) the step is

    A = [[1 − rho a h, h (1 − rho b)], [−rho a, 1 − rho b]],   a = 4/(h (1 + 4 theta)),   b = 4 theta/(1 + 4 theta).
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spook_tracker.engine import Distance, Particle, Position, Result, Scene, Trace, Velocity, simulate
from tests.oracles.particles import Array

LENGTH = 1.0  # m


def matrix(mass: float, eps: float, theta: float, h: float) -> Array:
    spread = 1.0 + 4.0 * theta
    rho = 1.0 / (1.0 + mass * 4.0 * eps / (h**2 * spread))
    a, b = 4.0 / (h * spread), 4.0 * theta / spread
    return np.array([[1.0 - rho * a * h, h * (1.0 - rho * b)], [-rho * a, 1.0 - rho * b]])


def run(
    mass: float, eps: float, theta: float, h: float, z: float, v: float, steps: int, length: float = LENGTH
) -> Array:
    """(steps + 1, 2): z [m] and v [m/s] along the row, which points in a skew direction."""
    along = np.array([2.0, -3.0, 6.0]) / 7.0
    body = Particle(name="mass", mass=mass, position=tuple((length + z) * along), velocity=tuple(v * along))
    row = Distance(
        name="row", between=((0.0, 0.0, 0.0), "mass"), rest_length=length, compliance=eps, damping=theta * h
    )
    observe = {"x": Trace(quantity=Position("mass")), "v": Trace(quantity=Velocity("mass"))}
    result: Result = simulate(
        Scene(bodies=(body,), constraints=(row,)), time_step=h, steps=steps, observe=observe
    )
    return np.stack([result["x"] @ along - length, result["v"] @ along], axis=1)


def measured_map(mass: float, eps: float, theta: float, h: float, steps: int = 1) -> Array:
    """The matrix of `steps` steps in the units (z, h v), read off two runs; a long row keeps z far from −L."""
    columns = [run(mass, eps, theta, h, z, v / h, steps, 16.0)[-1] * (1.0, h) for z, v in ((1, 0), (0, 1))]
    return np.array(columns).T


CASES = [
    (mass, eps, theta, h)
    for mass in (0.3, 20.0)
    for eps in (0.0, 1e-10, 1e-4, 0.1)
    for theta in (0.0, 0.25, 1.0, 2.0, 7.5)
    for h in (1e-3, 1 / 60)
    if eps or theta  # without both it grows: asked below
]


@pytest.mark.parametrize(("mass", "eps", "theta", "h"), CASES)
def test_t1_states_are_powers_of_the_matrix(mass: float, eps: float, theta: float, h: float) -> None:
    z0, v0 = 1e-3, 5e-3
    states = run(mass, eps, theta, h, z0, v0, steps=100)
    exact, step = np.array([z0, v0]), matrix(mass, eps, theta, h)
    scale = np.array([1.0, h])
    for state in states:
        assert np.abs((state - exact) * scale).max() < 1e-12
        exact = step @ exact


@pytest.mark.parametrize(("mass", "eps", "theta", "h"), CASES)
def test_t2_eigenvalues_of_the_step_follow_the_closed_forms(
    mass: float, eps: float, theta: float, h: float
) -> None:
    step = measured_map(mass, eps, theta, h)
    rho = 1.0 / (1.0 + mass * 4.0 * eps / (h**2 * (1.0 + 4.0 * theta)))
    alpha = 1.0 - rho * 4.0 * theta / (1.0 + 4.0 * theta)
    beta = 1.0 - 2.0 * (theta + 1.0) * rho / (1.0 + 4.0 * theta)

    assert np.linalg.det(step) == pytest.approx(alpha, abs=1e-13)
    assert 0.5 * np.trace(step) == pytest.approx(beta, abs=1e-13)
    oscillates = rho < (1.0 + 4.0 * theta) / (1.0 + theta) ** 2 * (1.0 - 1e-9)
    critical = abs(rho * (1.0 + theta) ** 2 / (1.0 + 4.0 * theta) - 1.0) <= 1e-9
    if oscillates:
        first = np.linalg.eigvals(step)[0]
        assert abs(first) == pytest.approx(math.sqrt(alpha), rel=1e-12)
        assert abs(np.angle(first)) == pytest.approx(math.acos(beta / math.sqrt(alpha)), abs=1e-9)
    elif not critical:
        assert np.abs(np.linalg.eigvals(step).imag).max() == 0.0


def test_t2_two_steps_of_damping_without_compliance_are_critical() -> None:
    """A double root 1/3: trace 2/3 and determinant 1/9."""
    step = measured_map(mass=5.0, eps=0.0, theta=2.0, h=0.01)

    assert np.trace(step) == pytest.approx(2.0 / 3.0, abs=1e-14)
    assert np.linalg.det(step) == pytest.approx(1.0 / 9.0, abs=1e-14)


def test_t2_below_two_steps_of_damping_it_always_oscillates() -> None:
    assert np.iscomplex(np.linalg.eigvals(measured_map(1.0, 0.0, 1.999, 0.01))).all()
    assert np.isreal(np.linalg.eigvals(measured_map(1.0, 0.0, 2.001, 0.01))).all()


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    mass=st.floats(-6, 6).map(lambda e: 10.0**e),
    eps=st.one_of(st.just(0.0), st.floats(-15, 6).map(lambda e: 10.0**e)),
    theta=st.floats(-4, 4).map(lambda e: 10.0**e),
    h=st.floats(-6, 2).map(lambda e: 10.0**e),
)
def test_t3_any_damping_is_stable(mass: float, eps: float, theta: float, h: float) -> None:
    """No eigenvalue leaves the unit circle, whatever step, mass and compliance are."""
    assert np.abs(np.linalg.eigvals(measured_map(mass, eps, theta, h))).max() <= 1.0 + 1e-12


@pytest.mark.parametrize("speed", [0.05, 1.0, 1.99, 2.01, 30.0])
def test_t4_undamped_row_has_a_shifted_frequency_and_an_invariant(speed: float) -> None:
    """h w from well resolved to far beyond 2, where the mode is aliased and still bounded."""
    mass, h = 2.0, 0.02
    w = speed / h
    states = run(mass, 1.0 / (mass * w**2), 0.0, h, 0.1, 0.0, 400, length=10.0)
    z, v = states.T
    invariant = v**2 + w**2 * (z - 0.5 * h * v) ** 2
    turn = abs(np.angle(np.linalg.eigvals(measured_map(mass, 1.0 / (mass * w**2), 0.0, h))[0]))

    assert np.ptp(invariant) / invariant[0] < 1e-12
    assert turn / h == pytest.approx(2.0 / h * math.atan(0.5 * h * w), rel=1e-10)
    assert np.abs(z).max() <= 0.1 * math.sqrt(1.0 + 0.25 * speed**2) * (1.0 + 1e-12)


def test_t5_without_compliance_and_damping_it_grows_linearly() -> None:
    """The double eigenvalue −1: z_n = (−1)ⁿ (2 n + 1) z0, until the row leaves its linear range."""
    z = run(1.0, 0.0, 0.0, 0.01, 1e-4, 0.0, steps=300)[:, 0]
    n = np.arange(301)

    assert np.abs(z - (-1.0) ** n * (2 * n + 1) * 1e-4).max() < 1e-12


@pytest.mark.parametrize(
    ("steps_per_period", "left"),
    [(100, 0.961), (50, 0.857), (20, 0.414), (10, 0.0667), (7, 0.0142), (5, 2.7e-3), (2, 7.4e-5)],
)
def test_t10_two_steps_of_damping_filter_fast_modes(steps_per_period: float, left: float) -> None:
    """What is left of a mode after ten steps at theta = 2: .857 at 50 steps a period, not nothing."""
    h, mass = 0.01, 3.0
    w = 2.0 * math.pi / (steps_per_period * h)
    ten = measured_map(mass, 1.0 / (mass * w**2), 2.0, h, steps=10)
    digits = len(f"{left:.2e}".split("e")[0].rstrip("0")) - 1

    assert f"{np.abs(np.linalg.eigvals(ten)).max():.{digits}g}" == f"{left:.{digits}g}"
