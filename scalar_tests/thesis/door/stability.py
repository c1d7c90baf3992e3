"""How many hinges, how soft, and how heavy a door."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

from ... import case
from ...bracket import break_count, break_point, table
from .scene import GRAVITY, MASS, TIME_STEP, forces, least_norm_forces, scene, weight_error

COUNTS = (1.0, 2.0, 3.0, 5.0, 10.0, 50.0, 200.0)  # hinges
COMPLIANCES = (0.0, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8)  # m/N and rad/(N m)
SAG = 1e-9  # m
SOME = 5  # hinges


def predicted_sag(count: int, compliance: float) -> float:
    """How far the door's centre sinks [m] by Castigliano: half compliance × Σ force² is the energy, m g the load."""
    return compliance * float(np.sum(least_norm_forces(count) ** 2)) / (MASS * GRAVITY)


def sag(simulate: case.Simulate, count: int, compliance: float) -> float:
    """How far it has sunk after 2 s [m]; NaN if it did not get there."""
    built = scene(count, damping=2.0 * TIME_STEP, compliance=compliance)
    place = {"place": engine.Final(quantity=engine.Position("door"))}
    result = simulate(built, time_step=TIME_STEP, steps=120, observe=place)
    return -float(result["place"][2]) if result.completed else float("nan")


def softest_hinges(simulate: case.Simulate) -> case.BreakPoint:
    """Largest compliance [m/N, rad/(N m)] of five hinges with which the door sinks by no more than SAG."""
    return break_point(lambda soft: sag(simulate, SOME, soft) <= SAG, 1e-13, 1e-8, resolution=0.002)


def redundancy_map(simulate: case.Simulate) -> case.StabilityMap:
    """(hinges, compliance): whether the redundant rows hold the door where least norm says."""

    def kind(count: float, compliance: float) -> str:
        found, right = sag(simulate, int(count), compliance), predicted_sag(int(count), compliance)
        if not np.isfinite(found):
            return "diverged"
        return "settled" if abs(found - right) <= 1e-6 * right + 1e-15 else "bounded"

    return case.StabilityMap(
        x=COUNTS,
        y=COMPLIANCES,
        cells=table(COMPLIANCES, COUNTS, kind),
        x_label="hinges",
        y_label="compliance [m/N, rad/(N m)]",
        note="Every hinge beyond the first is redundant. With equal compliance the split of least norm is the state "
        "of least energy, so the door sinks by compliance × Σ force² / (m g), and not at all without compliance.",
    )


def most_hinges(simulate: case.Simulate) -> case.BreakPoint:
    """Most hinges that carry the printed door."""

    def holds(count: int) -> bool:
        held = forces(simulate, steps=120, count=count, damping=2.0 * TIME_STEP)[-1:]
        right = least_norm_forces(count)
        split = float(np.abs(held[-1] - right).max() / np.abs(right).max())
        return abs(float(weight_error(held)[-1])) <= 1e-9 and split <= 1e-6

    return break_count(holds, (1, 2, 5, 10, 20, 50, 100, 200, 400))


def heaviest_door(simulate: case.Simulate) -> case.BreakPoint:
    """Heaviest door [kg] on five rigid hinges."""

    def holds(mass: float) -> bool:
        held = forces(simulate, steps=120, count=5, mass=mass, damping=2.0 * TIME_STEP, compliance=0.0)
        return float(np.abs(weight_error(held, mass)).max()) <= 1e-9

    return break_point(holds, 1.0, 1e12, resolution=0.1, walk=13)


STUDIES = (
    case.StabilityStudy(
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
    case.StabilityStudy(
        name="heaviest-door",
        title="Heaviest door on five hinges of compliance 0",
        configuration="plain",
        definition="for 2 s the vertical forces sum to the weight to 1e-9 % (damping 2 h)",
        study=heaviest_door,
        unit="kg",
        expected=(1e12, 1e12),
        expected_source="mass scales out of a system without compliance; the search ends at 1e12 kg",
    ),
    case.StabilityStudy(
        name="softest-hinges",
        title="Softest five hinges that hold the door within 1e-9 m",
        configuration="plain",
        definition="after 2 s the centre of the door hangs no more than 1e-9 m below its start (damping 2 h)",
        study=softest_hinges,
        unit="m/N",
        expected=(0.997 * SAG / predicted_sag(SOME, 1.0), 1.003 * SAG / predicted_sag(SOME, 1.0)),
        expected_source="Castigliano on the split of least norm: compliance × Σ force² / (m g), found to 0.2 %",
    ),
    case.StabilityStudy(
        name="redundancy-map",
        title="Redundant hinges and their compliance",
        configuration="plain",
        definition="settled if after 2 s the door has sunk by what Castigliano says of the split of least norm, to "
        "1e-6 of it or 1e-15 m (damping 2 h)",
        study=redundancy_map,
    ),
)
