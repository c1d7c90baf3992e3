"""Bodies that start inside each other part without being launched."""

from __future__ import annotations

import pytest

from spook_tracker.engine import Final, KineticEnergy, Maximum, Position, Scene, Trace, Velocity, simulate
from tests.contact_scenes import DOWN, TIME_STEP, ball, cube, ground


@pytest.mark.parametrize("depth", [1e-3, 0.1, 0.4])
def test_overlapping_bodies_part_without_being_launched(depth: float) -> None:
    """Two balls, free in space, start `depth` inside each other: they part and stay at rest."""
    result = simulate(
        Scene(bodies=(ball("low", 0.0), ball("high", 1.0 - depth))),
        time_step=TIME_STEP,
        duration=5.0,
        observe={
            "x": Final(quantity=Position()),
            "v": Trace(quantity=Velocity()),
            "e": Maximum(quantity=KineticEnergy()),
        },
    )

    assert result["x"][1, 2] - result["x"][0, 2] == pytest.approx(1.0, abs=1e-7)
    assert result["e"] < 1e-15
    assert abs(result["x"][:, 2].sum() - (1.0 - depth)) < 1e-12  # the centre of mass stays


def test_a_box_sunk_into_the_ground_rises_and_rests() -> None:
    result = simulate(
        Scene(bodies=(ground(), cube("box", (0, 0, 0.2)), cube("lid", (0.1, 0, 1.0))), gravity=DOWN),
        time_step=TIME_STEP,
        duration=5.0,
        observe={
            "x": Final(quantity=Position()),
            "v": Trace(quantity=Velocity()),
            "e": Maximum(quantity=KineticEnergy()),
        },
    )

    assert result["x"][1, 2] == pytest.approx(0.5, abs=1e-6)
    assert result["x"][2, 2] == pytest.approx(1.5, abs=1e-6)
    assert result["e"] < 1e-9
