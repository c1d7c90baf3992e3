"""The numbers asked of the door on its hinges: units, limits, set points and where they come from, configuration by configuration."""

from __future__ import annotations

from ... import case
from ...configurations import configured
from .measure import (
    _measure_balance,
    _measure_damped,
    _measure_printed,
    _measure_singular,
    _measure_split,
    ladder_error,
)
from .scene import TIME_STEP

MEASUREMENTS = (
    case.Measurement(
        configuration="damped",
        time_step=TIME_STEP,
        parameters={"N": 2},
        metrics=(
            case.Metric(
                name="weight_error",
                description="largest deviation of the vertical force from the weight, steps 1 to 1200",
                unit="%",
                role="gate",
                limit=0.02,
                limit_source="thesis, section 4.2; it would catch a weight off by 0.02 %, and nothing less",
                limit_kind="physical",
                set_point=(-5e-7, 5e-7),
                set_point_source="4.32e-7 % in the first step, as tests/oracles/rigid.py has it, rounding from then on",
                reference=0.0,
                tolerance=1e-11,
            ),
            case.Metric(
                name="weight_error_settled",
                description="the same over steps 100 to 1200",
                unit="%",
                role="companion",
                limit=1e-9,
                limit_source="set point: rounding only once the start has died out",
                reference=0.0,
                tolerance=1e-11,
            ),
        ),
        measure=_measure_damped,
        note="Two hinges, damping 2 h, as every joint of the engine has by default.",
    ),
    case.Measurement(
        configuration="printed",
        time_step=TIME_STEP,
        parameters={"N": 2},
        metrics=(
            case.Metric(
                name="weight_error",
                description="largest deviation of the vertical force from the weight in 20 s",
                unit="%",
                role="companion",
                limit=0.02,
                limit_source="thesis, section 4.2",
                limit_kind="physical",
                reference=0.0,
                tolerance=1e-6,
            ),
            case.Metric(
                name="weight_error_at_20_s",
                description="deviation of the vertical force at 20 s: it rings",
                unit="%",
                role="reported",
                tolerance=1e-6,
            ),
            case.Metric(
                name="weight_error_to_65_s",
                description="largest deviation of the vertical force in 65 s",
                unit="%",
                role="companion",
                limit=0.02,
                limit_source="thesis, section 4.2",
                limit_kind="physical",
                reference=0.0,
                tolerance=1e-6,
            ),
        ),
        measure=_measure_printed,
        note="Two hinges with the damping printed in the thesis, 1e-13 s: undamped in effect.",
    ),
    case.Measurement(
        configuration="damped",
        time_step=TIME_STEP,
        parameters={},
        metrics=(
            case.Metric(
                name="split_error",
                description="largest deviation of a hinge force from the least-norm split, 1 to 200 hinges",
                unit="1",
                role="companion",
                limit=1e-9,
                limit_source="pseudo-inverse of the balance, rounding",
                reference=0.0,
                tolerance=1e-10,
            ),
        ),
        measure=_measure_split,
        note="Doors on 1, 2, 3, 5, 10, 20, 50, 100 and 200 hinges.",
    ),
    case.Measurement(
        configuration="damped",
        time_step=TIME_STEP,
        parameters={"N": 2},
        metrics=(
            case.Metric(
                name="sideways_sum",
                description="sum of the horizontal forces of the two hinges, settled",
                unit="N",
                role="companion",
                limit=1e-6,
                limit_source="statics: F₁ₓ + F₂ₓ = 0; the thesis reads up to 2e-7 N",
                reference=0.0,
                tolerance=1e-9,
            ),
        ),
        measure=_measure_balance,
        note="Two hinges, damping 2 h.",
    ),
    case.Measurement(
        configuration="rigid",
        time_step=TIME_STEP,
        parameters={"N": 5},
        metrics=(
            case.Metric(
                name="weight_error_settled",
                description="largest deviation of the vertical force from the weight in 20 s, compliance 0",
                unit="%",
                role="companion",
                limit=1e-9,
                limit_source="rounding: the system is singular, its sum is not",
                reference=0.0,
                tolerance=1e-11,
            ),
        ),
        measure=_measure_singular,
        note="Five hinges of compliance 0: the split is undetermined, the sum is not.",
    ),
)

LADDERS = (
    case.Ladder(
        name="weight",
        description="largest deviation of the vertical force from the weight in the second second, five hinges",
        unit="%",
        time_steps=tuple(1.0 / n for n in (30, 60, 120, 240)),
        configurations=configured(
            {"direct": None, "direct, no refinement": None, "iterative, 50 iterations": None}
        ),
        error=ladder_error,
        target_error=1e-6,
        target_seconds=0.1,
    ),
)
