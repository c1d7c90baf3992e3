"""Library problem A04: does Bricard's mechanism move, although counting its constraints says it cannot?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np

from spook_tracker import engine

from .. import case
from ..bracket import break_point, table
from .library import FIRST_ORDER, GRAVITY, HIGH, LOW, error_metric, ladders, library_error, rod, turned

POINTS = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float)  # m
AXES = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)) * 2
MASS, THICK = 1.0, 0.1  # kg, m
ACROSS, ALONG = MASS * (1.0 + THICK**2) / 12.0, MASS * THICK**2 / 6.0  # kg m²
COMPLIANCE = 1e-8  # m/N and rad/(N m), the engine's default
EXACT = {  # s: P3 in m
    0.5: (0.968283679, -1.224625159, 0.750146609),
    1.0: (0.510501461, -1.649167599, 0.140123115),
    2.5: (-1.000000000, -1.000016815, 0.999983185),
    10.0: (0.999999964, -1.000269013, 0.999730951),
}
AFTER_ONE_SECOND = 0.02  # m
LEAST = 3.38e-12  # m/N: where P3 is that far off at 1/240 s, see the study
MAP_COMPLIANCES = tuple(float(c) for c in np.geomspace(1e-14, 1e-2, 7))  # m/N and rad/(N m)
MAP_STEPS = (1 / 960, 1 / 480, 1 / 240, 1 / 120, 1 / 60)  # s
MAP_DEFINITION = (
    "settled: P3 within 0.02 m of its place after 1 s; bounded: elsewhere; diverged: refused or lost"
)


def scene(time_step: float, compliance: float = COMPLIANCE) -> engine.Scene:
    """Five rods of 1 m in a closed loop of six hinges, from rest; gravity along −y."""
    rods = []
    for k in range(5):
        inertia = [ACROSS] * 3
        inertia[int(np.argmax(np.abs(POINTS[k + 1] - POINTS[k])))] = ALONG
        rods.append(rod(f"rod {k + 1}", POINTS[k], POINTS[k + 1], MASS, (inertia[0], inertia[1], inertia[2])))
    ends = [
        (engine.WORLD, "rod 1"),
        *((f"rod {k}", f"rod {k + 1}") for k in range(1, 5)),
        (engine.WORLD, "rod 5"),
    ]
    hinges = tuple(
        engine.Hinge(
            name=f"P{k}",
            between=between,
            at=(float(at[0]), float(at[1]), float(at[2])),
            axis=axis,
            compliance=compliance,
            damping=time_step,
        )
        for k, (between, at, axis) in enumerate(zip(ends, POINTS, AXES, strict=True))
    )
    return engine.Scene(bodies=tuple(rods), constraints=hinges, gravity=(0.0, -GRAVITY, 0.0), contacts=False)


def answers(
    simulate: case.Simulate, time_step: float, method: engine.Method = engine.PLAIN
) -> dict[str, float]:
    """The library's error of P3 at the four times, the largest change of energy, P3 after 1 s."""
    place, energy = _third(simulate, time_step, 10.0, COMPLIANCE, method)
    times = [round(time / time_step) for time in EXACT]
    return {
        "library_error": library_error(place[times], list(EXACT.values())),
        "energy_deviation": energy / (5.0 * MASS * GRAVITY),
    }


def _third(
    simulate: case.Simulate,
    time_step: float,
    duration: float,
    compliance: float,
    method: engine.Method = engine.PLAIN,
) -> tuple[np.ndarray, float]:
    """P3 [m] at every sample and the largest |E − E₀| [J]."""
    result = simulate(
        scene(time_step, compliance),
        time_step=time_step,
        duration=duration,
        method=method,
        observe={
            "centre": engine.Trace(quantity=engine.Position("rod 3")),
            "turn": engine.Trace(quantity=engine.Orientation("rod 3")),
            "energy": engine.MaximumAbsolute(quantity=engine.Energy(), from_start=True),
        },
    )
    return result["centre"] + turned(result["turn"], (0.0, 0.0, 0.5)), float(result["energy"])


def coarse(simulate: case.Simulate) -> dict[str, float]:
    """At h = 1/240 s."""
    return answers(simulate, 1 / 240)


def fine(simulate: case.Simulate) -> dict[str, float]:
    """At h = 1/4000 s."""
    return answers(simulate, 1 / 4000)


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Of P3 at four times in 10 s."""
    return answers(simulate, time_step, method)["library_error"]


def stiffest(simulate: case.Simulate) -> case.BreakPoint:
    """Smallest compliance with which P3 is right after 1 s, h = 1/240 s."""

    def holds(compliance: float) -> bool:
        return _cell(simulate, compliance, 1 / 240, engine.PLAIN) == "settled"

    return break_point(holds, 1e-7, 1e-14, resolution=0.01, walk=8)


def _cell(simulate: case.Simulate, compliance: float, time_step: float, method: engine.Method) -> str:
    """settled: right after 1 s; bounded: it holds together and is somewhere else; diverged: refused or lost."""
    observe = {
        "centre": engine.Trace(quantity=engine.Position("rod 3")),
        "turn": engine.Trace(quantity=engine.Orientation("rod 3")),
    }
    built = scene(time_step, compliance)
    result = simulate(built, time_step=time_step, duration=1.0, method=method, observe=observe)
    if not result.completed:
        return "not_finite" if result.status == "not_finite" else "diverged"
    place = result["centre"][-1:] + turned(result["turn"][-1:], (0.0, 0.0, 0.5))
    return "settled" if float(np.linalg.norm(place[0] - EXACT[1.0])) <= AFTER_ONE_SECOND else "bounded"


def _map(method: engine.Method) -> Callable[[case.Simulate], case.StabilityMap]:
    def study(simulate: case.Simulate) -> case.StabilityMap:
        return case.StabilityMap(
            x=MAP_COMPLIANCES,
            y=MAP_STEPS,
            cells=table(MAP_STEPS, MAP_COMPLIANCES, lambda c, h: _cell(simulate, c, h, method)),
            x_label="compliance [m/N, rad/(N m)]",
            y_label="time step [s]",
            note="At the right end the hinges themselves give way. On the left linearised rows are pulled "
            "apart at speeds of order h²; what their damping takes, of order h⁵ over the compliance, stops the mechanism.",
        )

    return study


ENERGY = case.Metric(
    name="energy_deviation",
    description="largest |E − E₀| over the weight of all rods times 1 m",
    unit="1",
    role="reported",
    reference=0.0,
    relative_tolerance=1e-5,
)
HALF_STEP_CURVED = engine.Method(half_step_velocities=True, corrections=2)
COMPOSED: Mapping[Literal["order4", "order6", "order8"], tuple[float, ...]] = {
    "order4": (1 / 12, 1 / 16, 1 / 20, 1 / 24),
    "order6": (1 / 12, 1 / 16),  # already the reference's last digit
    "order8": (1 / 12,),
}
OUTPUTS = "P3 at 0.5, 1, 2.5 and 10 s"

TEST = case.ScalarTest(
    title="Multibody library A04: Bricard's mechanism",
    question="Does Bricard's mechanism move as it should, although counting its constraints says it cannot?",
    why="Six hinges take 30 freedoms from 30, and yet it moves: one constraint repeats the others as long as the shape "
    "is exact. A step that leaves curvature out makes them contradict each other, and the mechanism may lock.",
    model="Five rods of 1 kg and 1 × 0.1 × 0.1 m in a loop closed by the ground, hinges about y, z, x, y, z, x; from rest.",
    parameters=(
        ("time step", "1/4000 and 1/240 s; ladder 1/120 to 1/8000 s, compositions from 1/12 s"),
        ("rods", "1 kg, 1 m, 9.81 m/s² along −y"),
        ("hinges", "compliance 1e-8, damping one time step"),
        ("duration", "10 s"),
    ),
    theory=("One freedom, 30 rows of rank 29; P3 swings from (1, −1, 1) to (−1, −1, 1) and back.",),
    reference="P3 at four times, to nine digits, from a tight integration of the one freedom.",
    conclusion="Green: redundant rows share their load and let the mechanism go. Red: it locks or drifts.",
    source="Library for computational benchmarking of multibody dynamics, problem A04",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=1 / 240,
            metrics=(error_metric("companion", LOW, OUTPUTS), ENERGY),
            measure=coarse,
            note="the SPOOK step as it stands",
        ),
        case.Measurement(
            configuration="plain",
            time_step=1 / 4000,
            metrics=(error_metric("gate", HIGH, OUTPUTS), ENERGY),
            measure=fine,
            note="the SPOOK step as it stands",
        ),
    ),
    example=lambda: case.Example(scene=scene(1 / 240), time_step=1 / 240),
    ladders=ladders(
        "P3 at four times",
        {
            "low": (
                (1 / 120, 1 / 240, 1 / 480, 1 / 1000),
                (
                    FIRST_ORDER,
                    *(
                        case.Configuration(
                            name=order,
                            method=engine.Method(composition=order),
                            expected_order=None,
                            time_steps=steps,
                        )
                        for order, steps in COMPOSED.items()
                    ),
                ),
            ),
            "high": (
                (1 / 500, 1 / 1000, 1 / 2000, 1 / 4000, 1 / 8000),
                (
                    FIRST_ORDER,
                    case.Configuration(
                        name="half-step, curved twice", method=HALF_STEP_CURVED, expected_order=None
                    ),
                ),
            ),
        },
        ladder_error,
    ),
    stability=(
        case.StabilityStudy(
            name="smallest-compliance",
            title="Smallest compliance with which the mechanism moves at h = 1/240 s",
            configuration="plain",
            definition="P3 within 0.02 m of its place after 1 s",
            study=stiffest,
            unit="m/N",
            better="smaller",
            expected=(0.97 * LEAST, 1.03 * LEAST),
            expected_source="linearised rows stand apart by (1 + 2θ)/4 h² of their curvature; there the rows that repeat "
            "each other are pulled apart at a speed u of order h², and their damping takes τ u²/ε from the motion: 3.38e-12 "
            "on the exact path, led half a step; a per cent for the search and two for the next order in h",
        ),
        *(
            case.StabilityStudy(
                name=f"map-{name}",
                title=f"Compliance of redundant hinges and time step, {told}",
                configuration=told,
                definition=MAP_DEFINITION,
                study=_map(method),
            )
            for name, told, method in (
                ("plain", "plain", engine.PLAIN),
                ("curved", "curved", engine.Method(corrections=1)),
            )
        ),
    ),
)
