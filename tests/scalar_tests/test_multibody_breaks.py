"""Where the library's mechanisms must fail: each band found again without the engine."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.scalar_tests.multibody import four_bars, governor, simple_pendulum, squeezer
from spook_tracker.scalar_tests.multibody.library import GRAVITY, LOW
from tests.oracles import squeezer as oracle_squeezer
from tests.scalar_tests.limits import band

KAHAN_LI_8 = (  # Math. Comp. 66 (1997) 1089: seventeen stages, which read the same backwards
    0.13020248308889008088,
    0.56116298177510838456,
    -0.38947496264484728641,
    0.15884190655515560090,
    -0.39590389413323757734,
    0.18453964097831570709,
    0.25837438768632204729,
    0.29501172360931029887,
    -0.60550853383003451170,
)


def growth(turn: float) -> float:
    """Spectral radius of v₊ = v − h ω² x, x₊ = x + h v₊ at h ω = `turn`."""
    return float(np.abs(np.linalg.eigvals([[1.0 - turn**2, turn], [-turn, 1.0]])).max())


def test_a_small_swing_is_stepped_up_to_half_a_turn() -> None:
    p = simple_pendulum
    low, high = band("simple_pendulum", "longest-step-curved")
    rate = math.sqrt(p.GRAVITY / p.LENGTH)
    assert growth(low * rate) < 1.0 + 1e-6 and growth(high * rate) ** p.SWINGS > 1e3 * p.WIDER


def test_a_composition_never_steps_a_small_swing_as_far_as_its_leapfrogs_bear() -> None:
    """The stage that gravity draws furthest off the circle is halved long before their product leaves the unit circle."""
    stages = np.array(KAHAN_LI_8 + KAHAN_LI_8[-2::-1])
    assert stages.sum() == pytest.approx(1.0, abs=1e-15)
    kicks = 0.5 * (
        stages + np.concatenate(((stages[-1],), stages[:-1]))
    )  # half of the stage before, half of its own
    drawn = float(np.abs(kicks * stages).max())  # of g h²
    longest = math.sqrt((math.sqrt(1.3) - 1.0) / drawn)  # h ω: |d|²/l² − 1 = 0.3
    assert longest < 0.9
    for turn in np.linspace(0.01, 0.9, 90):
        product = np.eye(2)
        for g in stages * turn:
            kick, drift = np.array([[1.0, 0.0], [-0.5 * g, 1.0]]), np.array([[1.0, g], [0.0, 1.0]])
            product = kick @ drift @ kick @ product
        assert abs(np.trace(product)) < 2.0
    assert band("simple_pendulum", "longest-step-order8") == (simple_pendulum.LONGEST,) * 2


def hung_rate(count: int) -> float:
    """ω [rad/s] of hanging linkages: energies of rods that stay parallel, from their ends' places, by differences."""
    f, d = four_bars, 1e-4

    def centres(angle: float) -> np.ndarray:
        """(rods, 2): the sides hang from the ground, the tops on them."""
        x, y = f.LENGTH * math.sin(angle), -f.LENGTH * math.cos(angle)
        sides = [(k * f.LENGTH + 0.5 * x, 0.5 * y) for k in range(count + 1)]
        return np.array(sides + [((k + 0.5) * f.LENGTH + x, y) for k in range(count)])

    speeds = (centres(d) - centres(-d)) / (2.0 * d)
    inertia = f.MASS * float((speeds**2).sum()) + (count + 1) * f.ACROSS
    heights = [f.MASS * GRAVITY * float(centres(angle)[:, 1].sum()) for angle in (-d, 0.0, d)]
    return math.sqrt((heights[0] - 2.0 * heights[1] + heights[2]) / d**2 / inertia)


def test_hanging_linkages_are_stepped_up_to_half_a_turn() -> None:
    f = four_bars
    low, high = band("four_bars", "longest-step")
    rate = hung_rate(f.FEW)
    assert growth(low * rate) < 1.0 + 1e-6 and growth(high * rate) ** f.HUNG_STEPS > 1e5
    assert band("four_bars", "most-linkages") == (f.COUNTS[-1], f.COUNTS[-1])
    assert all(growth(hung_rate(count) / 60.0) < 1.0 + 1e-6 for count in f.COUNTS)
    for n in f.COUNTS:
        assert hung_rate(n) ** 2 == pytest.approx(
            1.5 * (3 * n + 1) / (4 * n + 1) * GRAVITY / f.LENGTH, rel=1e-6
        )


def test_the_squeezer_keeps_its_low_class_in_as_many_steps_as_its_plane_needs() -> None:
    low, high = band("squeezer", "longest-step")
    assert round(squeezer.DURATION / low) == 213 and round(squeezer.DURATION / (1.0001 * high)) == 212
    assert oracle_squeezer.error(213) < LOW < oracle_squeezer.error(212)
    assert all(oracle_squeezer.error(count) < LOW for count in range(220, 601, 20))
    assert oracle_squeezer.error(600) < 0.4 * oracle_squeezer.error(300), "it is the mechanism"


def highest(spin: float) -> float:
    """Where the slider's first rise ends [m]: rods of points, springs as links, Lagrange's equation integrated."""
    g, points = governor, 2000
    along = np.append((np.arange(points) + 0.5) / points, 1.0)  # m from the hinge; the ball is the last
    mass = 2.0 * np.append(np.full(points, g.ROD / points), g.BALL)

    def inertia(lean: float) -> float:
        return float(mass @ (g.OUT + along * math.cos(lean)) ** 2) + g.ALONG + g.CUBE

    def moving(lean: float) -> float:
        return float(mass @ along**2) + g.SLIDER * math.cos(lean) ** 2  # the slider is at TOP − sin

    def weight(lean: float) -> float:
        return -g.GRAVITY * math.sin(lean) * (float(mass @ along) + g.SLIDER)

    turn = inertia(g.LEAN) * spin
    assert turn / spin == pytest.approx(g.TURN / g.SPIN, rel=1e-4), "the library's own"

    def slopes(_: float, state: np.ndarray) -> list[float]:
        lean, rate, d = float(state[0]), float(state[1]), 1e-6

        def energy(at: float) -> float:
            return 0.5 * turn**2 / inertia(at) + weight(at)

        push = -(energy(lean + d) - energy(lean - d)) / (2.0 * d)
        bend = 0.5 * (moving(lean + d) - moving(lean - d)) / (2.0 * d) * rate**2
        return [rate, (push - bend) / moving(lean)]

    found = solve_ivp(slopes, (0.0, 0.6), (g.LEAN, 0.0), "DOP853", rtol=1e-9, atol=1e-9, max_step=2e-3)
    return g.TOP - math.sin(float(found.y[0].min()))


def test_a_governor_rises_as_high_as_its_energy_at_kept_momentum_allows() -> None:
    g = governor
    low, high = band("governor", "fastest")
    assert highest(low) < g.CEILING < highest(high)
    assert highest(g.FASTEST) == pytest.approx(g.CEILING, abs=1e-3)
    assert highest(g.SPIN) == pytest.approx(g.HIGHEST, abs=1e-3)
    assert band("governor", "stiffest-springs") == (g.STIFFEST, g.STIFFEST)


def test_a_spring_of_a_governor_is_never_too_stiff_for_its_row() -> None:
    """What a row of compliance 1/k and damping d/k keeps of its motion in a step is stable for every k."""
    g = governor
    for stiffness in np.geomspace(g.STIFFNESS, g.STIFFEST, 10):
        spread = 1.0 + 4.0 * g.VISCOSITY / g.STIFFNESS / g.FINE
        soft = 4.0 / stiffness / (g.FINE**2 * spread)
        share = 1.0 / (1.0 + g.BALL * soft)
        step = np.array(
            [
                [1.0 - 4.0 / spread * share, g.FINE * (1.0 - (1.0 - 1.0 / spread) * share)],
                [-4.0 / (g.FINE * spread) * share, 1.0 - (1.0 - 1.0 / spread) * share],
            ]
        )
        assert np.abs(np.linalg.eigvals(step)).max() <= 1.0 + 1e-12
