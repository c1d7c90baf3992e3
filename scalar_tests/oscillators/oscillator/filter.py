"""How fast does damping of two time steps remove each oscillation?"""

from __future__ import annotations

import functools
import math

import numpy as np

from ... import case
from ...bracket import break_point
from ...sweep import apart, line, told
from .scene import START, TIME_STEP, decay, growth, row_scene, run_map, stiffness_of_period, traced

DAMPING = 2.0 * TIME_STEP  # s
STEPS = 10
PERIODS = (100, 50, 20, 10, 7, 5, 2)  # steps
DRAWN = (100.0, 50.0, 10.0, 5.0, 1.0, 0.1)  # steps a period, those of Fig 2.8
DRAWN_STEPS = 50
SHORTEST = 1e-6  # steps a period, where the search for the shortest ends: h ω = 6e6
# ten steps leave a half where α = 1 − 8/9 ρ = 2^(−1/5); ρ = 1/(1 + 4/(9 (h ω)²))
HALVED = 3.0 * math.pi * math.sqrt(1.0 / (9.0 / 8.0 * (1.0 - 2.0**-0.2)) - 1.0)  # steps a period, 23


def left(simulate: case.Simulate, period: float) -> float:
    """Fraction of an oscillation of `period` steps that is left after ten steps, read off two runs."""
    return growth(run_map(simulate, stiffness_of_period(period), DAMPING, TIME_STEP, STEPS))


def filtered(simulate: case.Simulate) -> dict[str, float]:
    """What is left at seven periods, and the largest deviation from √α¹⁰."""
    answers, worst = {}, 0.0
    for period in PERIODS:
        value = left(simulate, period)
        exact = decay(stiffness_of_period(period), DAMPING) ** STEPS
        worst = max(worst, abs(value / exact - 1.0))
        answers[f"left_at_{period}"] = value
    return answers | {"filter_error": worst}


def halves(simulate: case.Simulate, period: float) -> bool:
    """Whether ten steps leave less than a half of an oscillation of `period` steps."""
    return left(simulate, period) < 0.5


def filters(simulate: case.Simulate, period: float) -> bool:
    """Whether what is left is √α¹⁰ to 1e-6."""
    return abs(left(simulate, period) / decay(stiffness_of_period(period), DAMPING) ** STEPS - 1.0) < 1e-6


def slowest(simulate: case.Simulate) -> case.BreakPoint:
    """The longest period, in steps, that ten steps halve."""
    return break_point(functools.partial(halves, simulate), 2.0, 200.0, resolution=1e-3, walk=5)


def stiffest(simulate: case.Simulate) -> case.BreakPoint:
    """The shortest period, in steps, that is filtered as theory says."""
    return break_point(functools.partial(filters, simulate), 2.0, SHORTEST, walk=8)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Amplitude against steps for six periods."""
    curves = []
    for period in DRAWN:
        _, x, _ = traced(
            simulate, row_scene(stiffness_of_period(period), DAMPING), TIME_STEP, steps=DRAWN_STEPS
        )
        curves.append(line(f"{period:g} steps a period", range(DRAWN_STEPS + 1), x))
    return case.Drawing(
        curves=tuple(curves),
        x_label="number of time steps",
        y_label="position z [m]",
        note=f"A low-pass filter: at 50 steps a period {told(100.0 * left(simulate, 50.0))} % is left after ten steps, at 10 "
        f"{told(100.0 * left(simulate, 10.0))} %.",
    )


def draw_response(simulate: case.Simulate) -> case.Drawing:
    """What is left after ten steps against the period."""
    periods = [float(p) for p in np.geomspace(1.0, 300.0, 40)]
    exact = [decay(stiffness_of_period(p), DAMPING) ** STEPS for p in periods]
    found = [left(simulate, p) for p in periods]
    return case.Drawing(
        curves=(
            line("read off the run", periods, found, "points"),
            line("√α¹⁰", periods, exact, "reference"),
        ),
        x_label="steps a period",
        y_label="fraction left after ten steps",
        x_scale="log",
        y_scale="log",
        note=f"At most {apart(found, exact)} from the closed form, at θ = 2, the default of joints.",
    )


def _left(period: int) -> case.Metric:
    exact = decay(stiffness_of_period(period), DAMPING) ** STEPS
    return case.Metric(
        name=f"left_at_{period}",
        description=f"fraction left after ten steps at {period} steps a period",
        unit="1",
        role="reported",
        better="inside",
        set_point=(exact * (1.0 - 1e-9), exact * (1.0 + 1e-9)),
        set_point_source="√α¹⁰",
        reference=exact,
        reference_kind="method",
    )


TEST = case.ScalarTest(
    title="Oscillator: filter",
    question="How fast does damping of two time steps remove each oscillation?",
    why="Damping of two time steps is the default. What it takes away from motion that is meant to be there must be "
    "known, and must not change unnoticed.",
    model="A mass of 1 kg on a distance row of compliance 1/κ with damping 2 h; κ gives 100 down to 0.1 steps a "
    "period. What is left after ten steps is read off the map of two runs.",
    parameters=(
        ("time step", "1/60 s"),
        ("mass", "1 kg"),
        ("damping", "τ = 2 h"),
        ("periods", "100, 50, 20, 10, 7, 5, 2 steps; figure also 1 and 0.1"),
        ("start", f"{START:g} m from rest length, at rest (figure)"),
    ),
    theory=(
        "Each step leaves √α, α = 1 − 4θ ρ/(1 + 4θ), ρ = 1/(1 + m Σ), Σ = 4 ε/(h² (1 + 4θ)).",
        "At θ = 2 and ε → 0: α = 1/9, a third of the amplitude is left by each step.",
    ),
    reference="√α¹⁰ in closed form: .961 .857 .414 .0667 .0142 2.7e-3 7.4e-5.",
    conclusion="Green: the filter is the one the theory describes. Red: the default damping means something else.",
    source="thesis, section 2.1.2.2, Fig 2.8",
    misprints=(
        "Modes are not all gone within ten steps at 50 steps a period: 86 % is left; at ten steps a period 6.7 %.",
    ),
    lacks={"ladder": "exact at every step"},
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="filter_error",
                    description="fraction left after ten steps over √α¹⁰, minus one: the largest of seven",
                    unit="1",
                    role="gate",
                    limit=1e-10,
                    limit_source="exact; rounding remains, relative to what is left",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                *(_left(period) for period in PERIODS),
            ),
            measure=filtered,
            note="damping two time steps",
        ),
    ),
    example=lambda: case.Example(scene=row_scene(stiffness_of_period(10.0), DAMPING), time_step=TIME_STEP),
    figures=(
        case.Figure(name="filter", title="Decay at six frequencies", draw=draw, thesis="Fig 2.8"),
        case.Figure(name="response", title="Left after ten steps against the period", draw=draw_response),
    ),
    stability=(
        case.StabilityStudy(
            name="slowest",
            title="Longest period that ten steps halve",
            configuration="plain",
            definition="less than a half is left after ten steps, in steps a period",
            study=slowest,
            unit="1",
            expected=(0.999 * HALVED, HALVED),
            expected_source="√α¹⁰ = ½ with α = 1 − 8/9 ρ and ρ = 1/(1 + 4/(9 (h ω)²)); to the resolution of the search",
        ),
        case.StabilityStudy(
            name="stiffest",
            title="Shortest period that is filtered as theory says",
            configuration="plain",
            definition="what is left after ten steps is √α¹⁰ to 1e-6, in steps a period",
            study=stiffest,
            unit="1",
            better="smaller",
            expected=(SHORTEST, SHORTEST),
            expected_source="a row is implicit: α goes to 1/9 and stays there however stiff; the search ends at h ω = 6e6",
        ),
    ),
)
