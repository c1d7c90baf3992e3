"""How many hinges, and how heavy a door."""

from __future__ import annotations

import numpy as np

from spook_tracker.scalar_tests.bracket import break_count, break_point
from spook_tracker.scalar_tests.case import BreakPoint, Simulate, StabilityStudy
from spook_tracker.scalar_tests.door.scene import TIME_STEP, forces, least_norm_forces, weight_error


def most_hinges(simulate: Simulate) -> BreakPoint:
    """Most hinges that carry the printed door."""

    def holds(count: int) -> bool:
        held = forces(simulate, steps=120, count=count, damping=2.0 * TIME_STEP)[-1:]
        right = least_norm_forces(count)
        split = float(np.abs(held[-1] - right).max() / np.abs(right).max())
        return abs(float(weight_error(held)[-1])) <= 1e-9 and split <= 1e-6

    return break_count(holds, (1, 2, 5, 10, 20, 50, 100, 200, 400))


def heaviest_door(simulate: Simulate) -> BreakPoint:
    """Heaviest door [kg] on five rigid hinges."""

    def holds(mass: float) -> bool:
        held = forces(simulate, steps=120, count=5, mass=mass, damping=2.0 * TIME_STEP, compliance=0.0)
        return float(np.abs(weight_error(held, mass)).max()) <= 1e-9

    return break_point(holds, 1.0, 1e12, resolution=0.1, walk=13)


STUDIES = (
    StabilityStudy(
        name="most-hinges",
        title="Most hinges that carry the door",
        configuration="plain",
        definition="after 2 s the vertical forces sum to the weight to 1e-9 % and split as least norm says to "
        "1e-6 (damping 2 h)",
        study=most_hinges,
        unit="hinges",
        expected=(200.0, 400.0),
        expected_source="any number, in theory; the search ends at 400",
    ),
    StabilityStudy(
        name="heaviest-door",
        title="Heaviest door on five hinges of compliance 0",
        configuration="plain",
        definition="for 2 s the vertical forces sum to the weight to 1e-9 % (damping 2 h)",
        study=heaviest_door,
        unit="kg",
        expected=(1e12, 1e12),
        expected_source="mass scales out of a system without compliance; the search ends at 1e12 kg",
    ),
)
