"""Bodies that start inside each other part without being launched."""

from __future__ import annotations

import pytest

from spook_tracker.engine import (
    Box,
    Final,
    KineticEnergy,
    Maximum,
    Method,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Trace,
    Velocity,
    simulate,
)
from tests.scenes.contact import DOWN, TIME_STEP, ball, cube, ground
from tests.scenes.corpus import solid


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


@pytest.mark.parametrize("shape", [Sphere(0.2), Box((0.4, 0.4, 0.4))], ids=["ball", "box"])
@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_what_is_sunk_into_one_body_sinks_into_no_other(solver: str, shape: Sphere | Box) -> None:
    """15 mm deep in a floor it comes to a wall, and no further: as much as twice its depth in the floor was let in."""
    depth, speed, face = 0.015, 3.0, 0.013
    floor, wall = (
        RigidBody(name=name, motion="static", shape=Box(size), position=place)
        for name, size, place in (
            ("floor", (4.0, 2.0, 0.5), (0.0, 0.0, -0.25)),
            ("wall", (0.4, 1.0, 1.0), (face + 0.2, 0.0, 0.5)),
        )
    )
    slider = solid("slider", shape, (-0.225, 0.0, 0.2 - depth), velocity=(speed, 0.0, 0.0))
    result = simulate(
        Scene(bodies=(floor, wall, slider)),
        time_step=TIME_STEP,
        steps=12,
        method=Method(solver=solver),
        observe={"x": Trace(quantity=Position("slider"))},
    )

    assert abs(result["x"][:, 0].max() - (face - 0.2)) < 1e-8
