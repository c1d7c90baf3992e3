"""The bands of the break points, each found again without the engine."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import PLAIN, Method
from spook_tracker.engine.theory import one_row_matrix
from spook_tracker.scalar_tests.bracket import break_point
from spook_tracker.scalar_tests.case import StabilityStudy
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.multibody import bricard
from spook_tracker.scalar_tests.ropes import loaded_rods
from spook_tracker.scalar_tests.rotation import spinning_top
from spook_tracker.scalar_tests.thesis.beam import stability as beam
from spook_tracker.scalar_tests.thesis.n_pendulum import stability as chain
from spook_tracker.scalar_tests.thesis.pendulum import stability as pendulum
from spook_tracker.scalar_tests.thesis.planetarium.scene import GAUSS, PERIOD, SPEED
from tests.oracles import chain as oracle_chain
from tests.oracles import simulate as oracle_simulate
from tests.oracles.loop_theory import off
from tests.scalar_tests.limits import band

STUDIES = [
    pytest.param(study, id=f"{name}-{study.name}")
    for name, test in CATALOGUE.items()
    for study in test.stability
]


@pytest.mark.parametrize("study", STUDIES)
def test_every_study_says_what_theory_expects_or_why_nothing(study: StabilityStudy) -> None:
    if study.unit:  # a break point; a map has its prediction beside it
        assert study.expected_source
        assert study.expected is not None or study.expected_source.startswith("none: ")


def pendulum_holds(time_step: float = 1 / 60, method: Method = PLAIN, **options: float) -> bool:
    return pendulum.is_stable(pendulum._kind(oracle_simulate.simulate, time_step, method, **options))


@pytest.mark.parametrize(
    ("name", "method"),
    [("plain", PLAIN), ("curved", Method(corrections=1)), ("curved-twice", Method(corrections=2))],
)
def test_the_discrete_pendulum_breaks_inside_the_band_of_time_steps(name: str, method: Method) -> None:
    low, high = band("pendulum", f"largest-time-step-{name}")

    assert pendulum_holds(low, method) and not pendulum_holds(high, method)


def test_the_discrete_pendulum_breaks_inside_the_bands_of_damping_and_compliance() -> None:
    low, high = band("pendulum", "smallest-damping")
    assert pendulum_holds(relative_damping=high) and not pendulum_holds(relative_damping=low)
    low, high = band("pendulum", "smallest-compliance")
    assert pendulum_holds(relative_damping=0.0, compliance=high)
    assert not pendulum_holds(relative_damping=0.0, compliance=low)


def test_the_largest_start_violation_is_an_energy() -> None:
    h, theta, high = 1 / 60, 1.0, band("pendulum", "largest-start-violation")[1]
    taken_back = 4.0 / (h * (1.0 + 4.0 * theta))  # 1/s

    assert math.sqrt(2 * pendulum.BOUND * 9.81) / taken_back == pytest.approx(high, rel=2e-3)


def chain_holds(count: int, time_step: float = 1 / 60, **options: float) -> bool:
    run = oracle_chain.swing(oracle_chain.level(count), time_step, round(22.0 / time_step), **options)  # type: ignore[arg-type]
    fall = 9.81 * count * (count + 1) / 2
    return (
        run.completed
        and float(np.abs(run.violation).max()) <= chain.STRETCH_BOUND
        and float(run.energy.max()) <= chain.ENERGY_BOUND * fall
    )


@pytest.mark.parametrize(("name", "substeps"), [("plain", 1), ("four-substeps", 4)])
def test_the_discrete_chain_breaks_at_the_expected_number(name: str, substeps: int) -> None:
    low, high = band("n_pendulum", f"longest-chain-{name}")

    assert chain_holds(round(low), substeps=substeps) and not chain_holds(round(high), substeps=substeps)


def test_the_longest_chain_asked_for_is_no_limit_with_eight_substeps() -> None:
    assert band("n_pendulum", "longest-chain-eight-substeps") == (400.0, 400.0)
    assert chain_holds(400, substeps=8)


def test_the_discrete_chain_breaks_inside_the_band_of_time_steps() -> None:
    low, high = band("n_pendulum", "largest-time-step-plain")

    assert chain_holds(26, low) and not chain_holds(26, high)


def test_the_discrete_chain_breaks_inside_the_band_of_damping() -> None:
    low, high = band("n_pendulum", "smallest-damping")

    found = break_point(lambda theta: chain_holds(26, theta=theta), 1.0, 1e-6, resolution=0.05, walk=13)

    assert low <= found.value <= high


def test_a_curved_chain_breaks_where_chance_says() -> None:
    """Why two break points have no band: five spheres fail here and 64 hold in the engine; steps alternate."""
    assert not chain_holds(5, corrections=2)
    assert [chain_holds(26, h, corrections=2) for h in (0.029, 0.0292, 0.0295)] == [False, True, False]


def test_symplectic_euler_loses_the_orbit_inside_the_band() -> None:
    def holds(time_step: float) -> bool:
        x, v = np.array([1.0, 0.0]), np.array(SPEED[:2])
        start, swing, distances = 0.5 * v @ v - GAUSS**2, 0.0, [1.0]
        for _ in range(math.ceil(10.0 * PERIOD / time_step)):
            v = v - time_step * GAUSS**2 * x / np.linalg.norm(x) ** 3
            x = x + time_step * v
            distances.append(float(np.linalg.norm(x)))
            swing = max(swing, abs(0.5 * v @ v - GAUSS**2 / distances[-1] - start))
        return min(distances) >= 0.5 and max(distances) <= 2.0 and swing <= 0.1 * abs(start)

    low, high = band("planetarium", "largest-time-step")

    assert holds(low) and not holds(high)


def test_a_pushed_beam_rests_with_the_damping_that_the_map_of_a_row_needs() -> None:
    def rests(theta: float, time_step: float = beam.TIME_STEP) -> bool:
        step, state, heights = (
            one_row_matrix(1.0, 0.0, theta * time_step, time_step),
            np.array([0.0, beam.PUSH]),
            [],
        )
        for _ in range(beam.STEPS + 1):
            heights.append(abs(state[0]))
            state = step @ state
        return max(heights[-beam.STEPS // 3 :]) <= beam.AT_REST * beam.COUNT * beam.SIZE[0]

    low, high = band("beam", "smallest-damping")

    assert rests(high) and not rests(low)
    assert all(rests(2.0, h) for h in (0.01, 0.1, 1.0, 10.0))  # why the largest time step has no band


def test_ten_loaded_rods_break_where_an_explicit_step_of_their_angles_does() -> None:
    """Stepped by symplectic Euler in the rods' angles, written from Lagrange's equations of the straight chain."""
    low, high = band("loaded_rods", "heaviest-load-plain")
    count, h = loaded_rods.RODS, loaded_rods.TIME_STEP

    def growth(load: float) -> float:
        """Spectral radius of one step; the energies are sums over rods and load of where they are."""
        centres = np.tril(np.ones((count, count)), -1) + 0.5 * np.eye(count)  # sideways, per angle
        mass = loaded_rods.ACROSS * np.eye(count) + centres.T @ centres + load * np.ones((count, count))
        hung = 9.81 * (centres.sum(axis=0) + load)  # N m per angle
        turn = -h * np.linalg.solve(mass, np.diag(hung))
        step = np.block([[np.eye(count) + h * turn, h * np.eye(count)], [turn, np.eye(count)]])
        return float(np.abs(np.linalg.eigvals(step)).max())

    assert growth(low) < 1.0 + 1e-6 and growth(high) > 1.1


def test_ten_loaded_rods_take_the_step_that_an_explicit_one_of_their_angles_takes() -> None:
    low, high = band("loaded_rods", "longest-step-plain")
    count, load = loaded_rods.RODS, loaded_rods.SOME
    centres = np.tril(np.ones((count, count)), -1) + 0.5 * np.eye(count)  # sideways, per angle
    mass = loaded_rods.ACROSS * np.eye(count) + centres.T @ centres + load * np.ones((count, count))
    pull = np.linalg.solve(mass, np.diag(9.81 * (centres.sum(axis=0) + load)))

    def growth(h: float) -> float:
        step = np.block([[np.eye(count) - h * h * pull, h * np.eye(count)], [-h * pull, np.eye(count)]])
        return float(np.abs(np.linalg.eigvals(step)).max())

    assert growth(low) < 1.0 + 1e-6 and growth(high) > 1.1


def test_a_loop_stops_where_the_damping_of_rows_that_repeat_others_takes_its_motion() -> None:
    """Bricard's mechanism on its exact path, and what linearised rows take from it on the way."""
    low, high = band("bricard", "smallest-compliance")
    exact = np.array(bricard.EXACT[1.0])

    assert off(high, 1 / 240, exact) < bricard.AFTER_ONE_SECOND < off(low, 1 / 240, exact)
    assert off(1.0, 1e-9, exact) < 1e-3  # the path itself, by fifty steps


def test_the_slowest_upright_top_sleeps_by_its_linear_equations() -> None:
    """A z̈ − i C s ż − m g l z = 0 of the tilt z about the tip: it grows where the roots leave the imaginary axis."""
    low, high = band("spinning_top", "slowest-spin")

    def growing(spin: float) -> float:
        across = spinning_top.ACROSS + spinning_top.MASS * spinning_top.ARM**2
        turning = spinning_top.ALONG * spin
        fall = spinning_top.MASS * spinning_top.GRAVITY * spinning_top.ARM
        return float(np.roots([across, -1j * turning, -fall]).real.max())

    assert growing(low) > 0.05 and growing(high) < 1e-9
