"""T15: a body turns freely as Euler's equations have it, to rounding, whatever it spins and however long the step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from spook_tracker.engine import (
    WORLD,
    AngularMomentum,
    AngularVelocity,
    Hinge,
    JointCoordinate,
    KineticEnergy,
    Lock,
    Method,
    Motor,
    Orientation,
    Scene,
    simulate,
)
from tests.oracles.particles import Array
from tests.oracles.rigid import free_turn, product, rotation
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, traces

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
    body = solid(
        "body",
        None,
        (0.0, 0.0, 0.0),
        2.0,
        spin=tuple(rotation(TILTED) @ start),
        inertia=tuple(MOMENTS),
        orientation=tuple(TILTED),
    )
    observe = traces(w=AngularVelocity("body"), l=AngularMomentum(), e=KineticEnergy(), q=Orientation("body"))
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


@pytest.mark.parametrize("h", [0.5, 0.1, 0.01])
@pytest.mark.parametrize("start", [FLIPPING, STEADY, np.array([1.0, -0.7, 2.0])], ids=str)
def test_momentum_and_energy_are_kept_to_rounding(start: Array, h: float) -> None:
    """100 s at steps where explicit Euler gains a third of the energy, and at such that turn by more than a radian."""
    _, _, spin, energy, q = run(start, h, 100.0)

    assert np.abs(spin - spin[0]).max() < 1e-13 * np.linalg.norm(spin[0]) * max(1.0, 0.1 / h)
    assert np.abs(np.linalg.norm(q, axis=1) - 1.0).max() < 1e-14
    assert np.ptp(energy) / energy[0] < 1e-13


@pytest.mark.parametrize("h", [1.0, 0.1, 0.01])
@pytest.mark.parametrize("start", [FLIPPING, STEADY], ids=str)
def test_angular_velocity_is_that_of_jacobis_functions_whatever_the_step(start: Array, h: float) -> None:
    t, w, *_ = run(start, h, 20.0)

    assert np.abs(w - Euler(start)(t)).max() < 1e-12


@pytest.mark.parametrize("h", [1.0, 0.1])
@pytest.mark.parametrize("start", [FLIPPING, STEADY], ids=str)
def test_orientation_is_that_of_the_power_series(start: Array, h: float) -> None:
    """Jacobi's functions say the momentum in body axes; how far the body has turned about it is in the orientation alone."""
    *_, q = run(start, h, 20.0)
    turn = product(TILTED, free_turn(MOMENTS, 20.0, MOMENTS * start))

    assert np.abs(q[-1] * np.sign(q[-1] @ turn) - turn).max() < 1e-12


def crossings(t: Array, values: Array) -> Array:
    """Times of sign changes by the parabola through three samples, error of third order."""
    found = []
    for i in np.nonzero(values[1:-1] * values[2:] < 0.0)[0] + 1:
        a, b, c = np.polyfit([-1.0, 0.0, 1.0], values[i - 1 : i + 2], 2)
        roots = np.roots([a, b, c]).real
        found.append(t[i] + (t[1] - t[0]) * roots[np.argmin(np.abs(roots - 0.5))])
    return np.array(found)


def test_the_flip_of_the_middle_axis_has_its_period() -> None:
    """A body thrown about its middle axis (Dzhanibekov) turns over every half period."""
    period = Euler(FLIPPING).period
    t, w, *_ = run(FLIPPING, 0.01, 10.0 * period)
    flips = crossings(t, w[:, 1])

    assert np.polyfit(np.arange(len(flips)), flips, 1)[0] == pytest.approx(0.5 * period, rel=1e-7)


@pytest.mark.parametrize("h", [0.5, 0.02])
def test_a_symmetric_top_precesses_as_it_must(h: float) -> None:
    """Body-frame rate (1 − I3/I1) w3 of the transverse spin, and the axis circles the momentum at |L|/I1."""
    body = solid("top", None, (0.0, 0.0, 0.0), spin=(0.4, 0.0, 1.5), inertia=(2.0, 2.0, 3.0))
    observe = traces(q=Orientation("top"))
    spin = np.array([0.8, 0.0, 4.5])
    rate, along = np.linalg.norm(spin) / 2.0, spin / np.linalg.norm(spin)
    start = np.array([0.0, 0.0, 1.0])
    result = simulate(Scene(bodies=(body,)), time_step=h, duration=10.0, observe=observe)
    axis = np.array([rotation(q)[:, 2] for q in result["q"]])
    angle = (rate * result.sample_times["q"])[:, None]
    exact = (
        start * np.cos(angle)
        + np.cross(along, start) * np.sin(angle)
        + along * (along @ start) * (1.0 - np.cos(angle))
    )  # Rodrigues

    assert np.abs(axis - exact).max() < 1e-12


def steady(inertia: tuple[float, float, float], rate: float, h: float, steps: int, **method: Any) -> Array:
    """Orientations of a body that spins about its z-axis."""
    body = solid("b", None, (0.0, 0.0, 0.0), spin=(0.0, 0.0, rate), inertia=inertia)
    observe = traces(q=Orientation("b"))
    return np.asarray(
        simulate(Scene(bodies=(body,)), time_step=h, steps=steps, observe=observe, **method)["q"]
    )


@pytest.mark.parametrize("turn", [1e-3, 0.99, 1.01, 3.0, 40.0, 1e4])  # rad a step
@pytest.mark.parametrize("inertia", [(1.0, 1.0, 1.0), (1.0, 1.0, 1.6), (1.0, 1.2, 1.6)], ids=str)
def test_a_steady_spin_turns_by_its_rate_in_every_step(
    inertia: tuple[float, float, float], turn: float
) -> None:
    h, steps = 0.05, 200
    for method in (Method(), Method(half_step_velocities=True), Method(composition="order4")):
        q = steady(inertia, turn / h, h, steps, method=method)
        half = 0.5 * turn * np.arange(steps + 1)
        exact = np.stack([np.cos(half), 0.0 * half, 0.0 * half, np.sin(half)], axis=-1)
        off = np.abs(q * np.sign(np.sum(q * exact, axis=1))[:, None] - exact).max()
        assert off < 1e-14 * steps * max(1.0, turn)


@pytest.mark.parametrize("turn", [0.3, 2.0, 30.0])
def test_a_body_locked_to_a_driven_one_turns_with_it(turn: float) -> None:
    h, steps = 0.05, 100
    driven = solid("driven", None, (0.0, 0.0, 0.0), None, spin=(0.0, 0.0, turn / h), motion="kinematic")
    held = solid("held", None, (0.0, 0.0, 0.0), spin=(0.0, 0.0, turn / h), inertia=(0.3, 0.4, 0.5))
    scene = Scene(bodies=(driven, held), constraints=(Lock(name="lock", between=("driven", "held")),))
    q = simulate(scene, time_step=h, steps=steps, observe=traces(q=Orientation()))["q"]

    assert np.abs(np.abs(np.sum(q[:, 0] * q[:, 1], axis=1)) - 1.0).max() < 1e-12


@pytest.mark.parametrize("turn", [0.3, 2.0, 30.0])
@pytest.mark.parametrize("method", [Method(), Method(composition="order4")], ids=["plain", "order4"])
def test_a_motor_turns_its_wheel_by_its_speed_times_the_time(turn: float, method: Method) -> None:
    """Also past half a turn a step, where the angle itself cannot tell which way it went."""
    h, steps = 0.02, 150
    wheel = solid("wheel", None, (0.0, 0.0, 0.0), spin=(0.0, 0.0, turn / h), inertia=(0.3, 0.4, 0.5))
    drive = {"motor": Motor(speed=turn / h)} if method == Method() else {}
    axle = Hinge(name="axle", between=(WORLD, "wheel"), axis=(0.0, 0.0, 1.0), compliance=0.0, **drive)
    observe = finals(angle=JointCoordinate("axle"))
    result = simulate(
        Scene(bodies=(wheel,), constraints=(axle,)), time_step=h, steps=steps, method=method, observe=observe
    )

    assert float(result["angle"]) == pytest.approx(turn * steps, rel=1e-11)


def test_what_tumbles_faster_than_a_thousand_radians_a_step_keeps_its_energy() -> None:
    body = solid("b", None, (0.0, 0.0, 0.0), spin=(3e5, 1e5, 2e5), inertia=tuple(MOMENTS))
    observe = traces(e=KineticEnergy(), l=AngularMomentum())
    for h in (1e-4, 0.1):
        result = simulate(Scene(bodies=(body,)), time_step=h, steps=50, observe=observe)
        assert np.ptp(result["e"]) < 1e-11 * result["e"][0]
        assert np.ptp(result["l"], axis=0).max() == 0.0
