"""Where the oscillator is stable, and how fast it grows or decays, against the eigenvalues of the method."""

from __future__ import annotations

import math

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.theory import one_row_oscillates

from ... import case
from ...bracket import break_point, cell, table
from .scene import MASS, START, TIME_STEP, growth, one_step, row_scene, run_map, spring_scene

SPEEDS = tuple(float(value) for value in np.geomspace(0.01, 1e6, 17))  # h ω
DAMPINGS = (0.0, 0.125, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)  # θ = τ/h
MAP_STEPS = 8  # for growth rates
CELL_STEPS = 200
LONG_STEPS = 20_000
AT_REST = 1e-6  # of the start
SOFTEST = 2.0**-27  # h ω: (h ω)² START is half of what places below START are apart


def stiffness_of(speed: float) -> float:
    """κ [N/m] of an h ω."""
    return MASS * (speed / TIME_STEP) ** 2


def measured_growth(simulate: case.Simulate, speed: float, theta: float) -> float:
    """Growth per step read off two runs."""
    found = run_map(simulate, stiffness_of(speed), theta * TIME_STEP, TIME_STEP, MAP_STEPS)
    return _growth(found, speed, theta, MAP_STEPS)


def predicted_growth(speed: float, theta: float) -> float:
    """Largest |eigenvalue| of the one-step map."""
    return _growth(one_step(stiffness_of(speed), theta * TIME_STEP), speed, theta, 1)


def _growth(matrix: np.ndarray, speed: float, theta: float, steps: int) -> float:
    """Largest |eigenvalue| per step. Where the method says that the pair is complex, however nearly double,
    the determinant gives it to rounding; trace and determinant would lose half the digits there. Of another
    method's pair, real and of unlike signs, there is no such root."""
    determinant = float(np.linalg.det(matrix))
    if determinant > 0.0 and one_row_oscillates(
        MASS, 1.0 / stiffness_of(speed), theta * TIME_STEP, TIME_STEP
    ):
        return math.pow(determinant, 0.5 / steps)
    return growth(matrix, steps)


def amplitude(speed: float) -> float:
    """What the undamped row makes of a start at 1: √(1 + (h ω/2)²)."""
    return math.sqrt(1.0 + speed * speed / 4.0)


def growth_error(simulate: case.Simulate) -> float:
    """Largest |measured − predicted| growth per step over the whole map."""
    return max(
        abs(measured_growth(simulate, speed, theta) - predicted_growth(speed, theta))
        for speed in SPEEDS
        for theta in DAMPINGS
    )


def _kind(simulate: case.Simulate, speed: float, theta: float) -> str:
    observe: dict[str, Observable] = {"x": engine.Trace(quantity=engine.Position("mass"))}
    start = 1.0 / amplitude(speed)  # so that no run comes near turning the row over
    scene = row_scene(stiffness_of(speed), theta * TIME_STEP, start=start)
    result = simulate(scene, time_step=TIME_STEP, steps=CELL_STEPS, observe=observe)
    return cell(result, result.partial["x"][:, 2] / start, bound=2.0 * amplitude(speed), rest=AT_REST)


def growth_map(simulate: case.Simulate) -> case.StabilityMap:
    """(h ω, τ/h): what a run does, beside the method's own eigenvalue."""
    return case.StabilityMap(
        x=SPEEDS,
        y=DAMPINGS,
        cells=table(DAMPINGS, SPEEDS, lambda speed, theta: _kind(simulate, speed, theta)),
        x_label="h ω",
        y_label="damping, τ/h",
        prediction=table(DAMPINGS, SPEEDS, predicted_growth),
        note="Stable everywhere. Without damping the largest eigenvalue is 1 at every frequency; growth rates read "
        f"off the runs differ from the eigenvalues by at most {growth_error(simulate):.1e}.",
    )


def _largest(simulate: case.Simulate, spring: bool) -> case.BreakPoint:
    observe: dict[str, Observable] = {"x": engine.MaximumAbsolute(quantity=engine.Position("mass"))}

    def holds(speed: float) -> bool:
        start = START if spring else 1.0 / amplitude(speed)
        row = row_scene(stiffness_of(speed), 0.0, start=start)
        scene = spring_scene(stiffness_of(speed)) if spring else row
        result = simulate(scene, time_step=TIME_STEP, steps=LONG_STEPS, observe=observe)
        return result.completed and float(result["x"][2]) <= 100.0 * start * amplitude(speed)

    return break_point(holds, 0.1, 1e8, resolution=1e-4, walk=19)


def largest_spring(simulate: case.Simulate) -> case.BreakPoint:
    """Largest h ω of a spring that is a plain force."""
    return _largest(simulate, True)


def largest_row(simulate: case.Simulate) -> case.BreakPoint:
    """Largest h ω of an undamped row."""
    return _largest(simulate, False)


def _softest(simulate: case.Simulate, spring: bool) -> case.BreakPoint:
    observe: dict[str, Observable] = {"x": engine.Trace(quantity=engine.Position("mass"))}

    def moves(speed: float) -> bool:
        scene = spring_scene(stiffness_of(speed)) if spring else row_scene(stiffness_of(speed), 0.0)
        result = simulate(scene, time_step=TIME_STEP, steps=1, observe=observe)
        return result.completed and float(result["x"][1, 2]) < START

    return break_point(moves, 0.1, 1e-12, resolution=1e-3, walk=5)


def softest_spring(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest h ω of a spring force that moves the mass in its first step."""
    return _softest(simulate, True)


def softest_row(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest h ω of an undamped row that does."""
    return _softest(simulate, False)


BOUNDED = (
    "finite, and never beyond a hundred times the amplitude that the start holds by the method's invariant, in "
    "20 000 steps"
)
SPRING_STUDY = case.StabilityStudy(
    name="stiffest-spring",
    title="Largest h ω of a spring that is a plain force",
    configuration="plain",
    definition=BOUNDED,
    study=largest_spring,
    unit="1",
    expected=(1.999, 2.001),
    expected_source="symplectic Euler is stable while h ω < 2",
)
ROW_STUDY = case.StabilityStudy(
    name="stiffest-row",
    title="Largest h ω of an undamped distance row",
    configuration="plain",
    definition=BOUNDED,
    study=largest_row,
    unit="1",
    expected=(1e6, 1e8),
    expected_source="the undamped row is neutral at every h ω; the search ends at 1e8",
)
SOFT_SPRING_STUDY, SOFT_ROW_STUDY = (
    case.StabilityStudy(
        name=f"softest-{name}",
        title=f"Smallest h ω of {told} that moves the mass in its first step",
        configuration="plain",
        definition="after a step from 2 m it is nearer to rest",
        study=study,
        unit="1",
        better="smaller",
        expected=(SOFTEST, 1.001 * SOFTEST),
        expected_source="the first step moves it by (h ω)² x; places just below 2 m are 2^-52 m apart, and half of that is lost: "
        "2^-53 = (h ω)² · 2 m at h ω = 2^-27; to the resolution of the search",
    )
    for name, told, study in (
        ("spring", "a spring that is a plain force", softest_spring),
        ("row", "an undamped distance row", softest_row),
    )
)
MAP_STUDY = case.StabilityStudy(
    name="growth-map",
    title="Growth over h ω and damping",
    configuration="plain",
    definition="settled: below 1e-6 of the start in the last third of 200 steps; growing: beyond twice the amplitude "
    "the start holds, or twice as large in the last third as in the middle",
    study=growth_map,
)
