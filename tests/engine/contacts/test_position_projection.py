"""Bodies that overlap in flight are parted: momenta stay to rounding, energy is not gained, joints hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import Box, Maximum, Penetration, Position, RigidBody, Scene, Trace, simulate
from spook_tracker.scalar_tests.mechanisms import loose_bearing
from tests.scenes.corpus import solid


@pytest.mark.parametrize("time_step", [1 / 60, 1 / 240])
@pytest.mark.parametrize("mass", [1e-6, 1e-3, 1e3, 1e6, 1e9])
def test_a_heavy_body_does_not_sink_into_a_light_jointed_one(mass: float, time_step: float) -> None:
    """A pin on a crank leads a slider of another weight by its slot: contacts gave way by what moves the lighter side, and
    1000 t sank .43 mm into it at 1/240 s. What is left is a depth that counts as none, 1e-10 of a size."""
    slotted = loose_bearing.scene(time_step)
    weights = {"mass": mass, "inertia": (0.01 * mass,) * 3}
    bodies = tuple(replace(b, **weights) if b.name == "slider" else b for b in slotted.bodies)  # type: ignore[arg-type]
    result = simulate(
        replace(slotted, bodies=bodies),
        time_step=time_step,
        duration=1.2,
        observe={"depth": Maximum(quantity=Penetration())},
    )

    assert result.completed and result.counters["corrections"] > 10
    assert result["depth"] < 1e-10


@pytest.mark.parametrize("boxes", [2, 5])
def test_what_parts_is_not_pushed_into_a_third_that_nothing_touches(boxes: int) -> None:
    """A row along x, .1 mm between all, the first 4 mm inside a wall. Parting takes .8 mm in the first step: the next
    one was entered by .74 mm, since only pairs that touch had a say."""
    side, gap = 0.2, 1e-4
    row = [
        solid(f"box {k}", Box((side, side, side)), (side - 4e-3 + k * (side + gap), 0.0, 0.0))
        for k in range(boxes)
    ]
    wall = RigidBody(name="wall", motion="static", shape=Box((side, side, side)), position=(0.0, 0.0, 0.0))
    run = simulate(
        Scene(bodies=(wall, *row)),
        time_step=1 / 60,
        steps=40,
        observe={body.name: Trace(quantity=Position(body.name)) for body in row},
    )

    places = np.array([run[body.name][:, 0] for body in row])
    assert places[0, -1] == pytest.approx(side, abs=1e-6)
    assert np.diff(places, axis=0).min() > side - 1e-9
