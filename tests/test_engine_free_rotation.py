"""T15: a body turning freely keeps momentum to rounding and energy within bounds, and follows Euler's equations."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from spook_tracker.engine import (
    AngularMomentum,
    AngularVelocity,
    KineticEnergy,
    Orientation,
    RigidBody,
    Scene,
    SimulationFailed,
    Trace,
    simulate,
)
from tests.oracle import Array
from tests.oracle_rigid import rotation

MOMENTS = np.array([0.9144, 1.098, 1.66])  # kg m²
TILTED = np.array([0.9, 0.2, -0.3, 0.25]) / np.linalg.norm([0.9, 0.2, -0.3, 0.25])


class Euler:
    """Euler's equations solved by Jacobi's functions, for L² > 2 E I2 (Landau and Lifshitz, Mechanics, §37)."""

    def __init__(self, start: Array) -> None:
        """`start` is the body-frame angular velocity, second component zero, first and third positive."""
        i1, i2, i3 = MOMENTS
        two_e, l2 = float(MOMENTS @ start**2), float(np.sum((MOMENTS * start) ** 2))
        assert start[1] == 0.0 and l2 > two_e * i2
        self.rate = math.sqrt((i3 - i2) * (l2 - two_e * i1) / (i1 * i2 * i3))
        self.modulus = (i2 - i1) * (two_e * i3 - l2) / ((i3 - i2) * (l2 - two_e * i1))  # k²
        self.size = np.sqrt(
            [
                (two_e * i3 - l2) / (i1 * (i3 - i1)),
                (two_e * i3 - l2) / (i2 * (i3 - i2)),
                (l2 - two_e * i1) / (i3 * (i3 - i1)),
            ]
        )

    @property
    def period(self) -> float:
        return 4.0 * float(ellipk(self.modulus)) / self.rate

    def __call__(self, t: Array) -> Array:
        sn, cn, dn, _ = ellipj(self.rate * t, self.modulus)
        return np.stack([cn, sn, dn], axis=-1) * self.size


def run(start: Array, h: float, duration: float) -> tuple[Array, Array, Array, Array, Array]:
    """Times, body-frame angular velocities, world momenta, energies and orientations."""
    body = RigidBody(
        name="body",
        mass=2.0,
        inertia=tuple(MOMENTS),
        position=(0.0, 0.0, 0.0),
        orientation=tuple(TILTED),
        angular_velocity=tuple(rotation(TILTED) @ start),
    )
    observe = {
        "w": Trace(quantity=AngularVelocity("body")),
        "l": Trace(quantity=AngularMomentum()),
        "e": Trace(quantity=KineticEnergy()),
        "q": Trace(quantity=Orientation("body")),
    }
    result = simulate(Scene(bodies=(body,)), time_step=h, duration=duration, observe=observe)
    local = np.array([rotation(q).T @ w for q, w in zip(result["q"], result["w"], strict=True)])
    return result.sample_times["w"], local, result["l"], result["e"], result["q"]


FLIPPING = np.array([0.6, 0.0, 1.05])  # rad/s; L² just above 2 E I2: flips about the middle axis
STEADY = np.array([0.3, 0.0, 2.0])


def test_the_closed_form_solves_eulers_equations() -> None:
    t = np.linspace(0.0, 20.0, 41)
    for start in (FLIPPING, STEADY):
        euler, dt = Euler(start), 1e-4
        slope = (euler(t + dt) - euler(t - dt)) / (2.0 * dt)
        w = euler(t)
        assert np.abs(w[0] - start).max() < 1e-14
        assert np.abs(MOMENTS * slope - np.cross(MOMENTS * w, w)).max() < 1e-7


@pytest.mark.parametrize("h", [0.1, 0.01])
@pytest.mark.parametrize("start", [FLIPPING, STEADY, np.array([1.0, -0.7, 2.0])], ids=str)
def test_momentum_is_kept_to_rounding_and_energy_within_bounds(start: Array, h: float) -> None:
    """100 s at steps where explicit Euler gains a third of the energy."""
    _, _, spin, energy, q = run(start, h, 100.0)
    first, last = energy[: len(energy) // 2], energy[len(energy) // 2 :]

    assert np.abs(spin - spin[0]).max() < 1e-13 * np.linalg.norm(spin[0]) * max(1.0, 0.1 / h)
    assert np.abs(np.linalg.norm(q, axis=1) - 1.0).max() < 1e-14
    swing = np.ptp(first) / energy[0]
    assert swing < 2.0 * float(start @ start) * h**2
    assert np.ptp(last) / energy[0] < 1.02 * swing + 1e-13
    assert abs(last.mean() - first.mean()) / energy[0] < 0.1 * swing + 1e-13


@pytest.mark.parametrize("start", [FLIPPING, STEADY], ids=str)
def test_angular_velocity_converges_to_jacobis_functions_with_order_two(start: Array) -> None:
    errors = []
    for h in (0.02, 0.01, 0.005):
        t, w, *_ = run(start, h, 20.0)
        errors.append(np.abs(w - Euler(start)(t)).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])

    assert orders == pytest.approx([2.0, 2.0], abs=0.05)
    assert errors[-1] < 3e-4


def crossings(t: Array, values: Array) -> Array:
    """Times of sign changes by the parabola through three samples, error of third order."""
    found = []
    for i in np.nonzero(values[1:-1] * values[2:] < 0.0)[0] + 1:
        a, b, c = np.polyfit([-1.0, 0.0, 1.0], values[i - 1 : i + 2], 2)
        roots = np.roots([a, b, c]).real
        found.append(t[i] + (t[1] - t[0]) * roots[np.argmin(np.abs(roots - 0.5))])
    return np.array(found)


def test_the_flip_of_the_middle_axis_has_its_period_with_order_two() -> None:
    """A body thrown about its middle axis (Dzhanibekov) turns over every half period, to order two in the step."""
    period = Euler(FLIPPING).period
    errors = []
    for h in (0.04, 0.02):
        t, w, *_ = run(FLIPPING, h, 10.0 * period)
        flips = crossings(t, w[:, 1])
        errors.append(np.polyfit(np.arange(len(flips)), flips, 1)[0] - 0.5 * period)
    assert math.log2(abs(errors[0] / errors[1])) == pytest.approx(2.0, abs=0.1)
    assert abs(errors[1]) < 1e-3 * period


def test_a_symmetric_top_precesses_as_it_must() -> None:
    """Body-frame rate (1 − I3/I1) w3 of the transverse spin, and the axis circles the momentum at |L|/I1."""
    body = RigidBody(
        name="top",
        mass=1.0,
        inertia=(2.0, 2.0, 3.0),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.4, 0.0, 1.5),
    )
    observe = {"q": Trace(quantity=Orientation("top"))}
    spin = np.array([0.8, 0.0, 4.5])
    rate, along = np.linalg.norm(spin) / 2.0, spin / np.linalg.norm(spin)
    start = np.array([0.0, 0.0, 1.0])
    errors = []
    for h in (0.02, 0.01):
        result = simulate(Scene(bodies=(body,)), time_step=h, duration=10.0, observe=observe)
        axis = np.array([rotation(q)[:, 2] for q in result["q"]])
        angle = (rate * result.sample_times["q"])[:, None]
        exact = (
            start * np.cos(angle)
            + np.cross(along, start) * np.sin(angle)
            + along * (along @ start) * (1.0 - np.cos(angle))
        )  # Rodrigues
        errors.append(np.abs(axis - exact).max())

    assert math.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)
    assert errors[1] < 1e-3


def test_a_sphere_turns_by_the_arc_sine_of_its_step() -> None:
    """Equal moments leave c w = p: each step turns by asin(h |p|/I0), uniformly and about a fixed axis."""
    ball = RigidBody(
        name="ball",
        mass=1.0,
        inertia=(1.0, 1.0, 1.0),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 0.0, 3.0),
    )
    h, steps = 0.05, 400
    observe = {"q": Trace(quantity=Orientation("ball"))}
    q = simulate(Scene(bodies=(ball,)), time_step=h, steps=steps, observe=observe)["q"]
    angle = np.unwrap(2.0 * np.arctan2(q[:, 3], q[:, 0]))

    assert np.abs(angle - math.asin(3.0 * h) * np.arange(steps + 1)).max() < 1e-12


def test_a_body_too_fast_for_the_step_ends_the_run_by_name() -> None:
    """A ball turns by asin(h |L|/I) a step: beyond h |L|/I = 1 there is no answer, just below there is."""
    for spin, fits in ((9.9, True), (10.1, False)):
        ball = RigidBody(
            name="ball",
            mass=1.0,
            inertia=(1.0, 1.0, 1.0),
            position=(0.0, 0.0, 0.0),
            angular_velocity=(0.0, spin, 0.0),
        )
        assert simulate(Scene(bodies=(ball,)), time_step=0.1, steps=100).completed == fits
    body = RigidBody(
        name="fast",
        mass=1.0,
        inertia=(1.0, 1.0, 1.5),
        position=(0.0, 0.0, 0.0),
        angular_velocity=(0.0, 30.0, 0.0),
    )
    fine = simulate(Scene(bodies=(body,)), time_step=0.01, steps=10)
    coarse = simulate(
        Scene(bodies=(body,)), time_step=0.1, steps=10, observe={"q": Trace(quantity=Orientation("fast"))}
    )

    assert fine.completed
    assert coarse.status != "completed"
    assert coarse.failed_body == "fast" and coarse.failed_step == 1
    assert "'fast'" in coarse.failure and "time step" in coarse.failure
    with pytest.raises(SimulationFailed):
        coarse["q"]
