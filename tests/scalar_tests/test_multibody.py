"""The multibody library's problems: the references that its digits and theirs must agree on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import simulate
from spook_tracker.scalar_tests.multibody import bricard, four_bars, governor, squeezer
from spook_tracker.scalar_tests.multibody.library import library_error, turned
from spook_tracker.scalar_tests.thesis.pendulum.scene import angle


def test_the_error_measure_is_relative_except_near_zero() -> None:
    assert library_error([1.1, 2.0], [1.0, 2.0]) == pytest.approx(0.1 / math.sqrt(2.0))
    assert library_error([1e-3], [0.0]) == pytest.approx(1.0)


def test_a_vector_turns_as_its_body() -> None:
    quarter = np.array([[math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]])  # about z

    assert np.allclose(turned(quarter, (1.0, 2.0, 3.0)), [[-2.0, 1.0, 3.0]], atol=1e-15)


@pytest.mark.parametrize(
    ("time", "x", "y"),
    [
        (1.0, -0.986291751132, -0.165010853126),
        (10.0, 0.275087462576, -0.961419205099),
        (100.0, 0.181513351427, -0.983388480334),
    ],
)
def test_the_pendulum_of_a01_is_where_the_library_says(time: float, x: float, y: float) -> None:
    theta = float(angle(time))

    assert (math.sin(theta), -math.cos(theta)) == pytest.approx((x, y), abs=1e-11)


@pytest.mark.parametrize(
    ("count", "time", "place"),
    [
        (2, 1.0, (-0.19502030, -0.98079921)),
        (2, 5.0, (-0.81131046, -0.58461555)),
        (2, 10.0, (0.32845811, 0.94451854)),
        (40, 10.0, (0.18051223, 0.98357274)),
    ],
)
def test_the_linkages_of_a02_are_where_the_library_says(
    count: int, time: float, place: tuple[float, float]
) -> None:
    assert four_bars.exact(count, (time,))[0] == pytest.approx(place, abs=5e-9)


def test_the_loops_of_a03_are_closed_at_the_start_and_at_the_end() -> None:
    """K4 and K6 are 20 mm long, K2 28 mm, wherever the given angles put their ends."""
    for angles in (squeezer.START, squeezer.END):
        joint = squeezer.B + squeezer._turn(angles["triangle"]) @ [0.0, -0.035]
        crank = squeezer._turn(angles["crank"]) @ [0.007, 0.0]
        lower = squeezer.A + squeezer._turn(angles["lower"]) @ [0.04, 0.0]
        upper = squeezer.A + squeezer._turn(angles["upper"]) @ [0.0, -0.04]
        lengths = [float(np.linalg.norm(joint - end)) for end in (crank, lower, upper)]
        assert lengths == pytest.approx([0.028, 0.02, 0.02], abs=1e-12)


def test_the_governor_starts_with_the_angular_momentum_of_the_library() -> None:
    asked = governor.coarse(simulate)

    assert abs(asked["angular_momentum_error"]) < 1e-10


def test_halving_the_step_halves_the_error_of_the_loop_and_of_the_governor() -> None:
    for problem in (bricard, governor):
        coarse, fine = (problem.answers(simulate, 1 / n)["library_error"] for n in (1000, 2000))
        assert coarse / fine == pytest.approx(2.0, rel=0.05)


def test_forty_linkages_reach_both_classes_where_their_ladders_end() -> None:
    """Of the compositions, which cost a fraction of a second each; the plain step's end is the test's own gate."""
    for ladder in four_bars.TEST.ladders:
        if not ladder.name.startswith("forty, "):
            continue
        assert (
            ladder.target_error == {"forty, low precision": 1e-1, "forty, high precision": 1e-3}[ladder.name]
        )
        for configuration in ladder.configurations:
            if configuration.name == "plain":
                continue
            finest = ladder.steps_of(configuration)[-1]
            assert ladder.error(simulate, finest, configuration.method) <= ladder.target_error, (
                configuration.name
            )
