"""The numbers asked of the beam: units, limits, set points and where they come from, configuration by configuration."""

from __future__ import annotations

from ... import case
from ...configurations import configured
from .measure import _measure_gate, _measure_long, _measure_sag, _measure_support, ladder_error
from .scene import COUNT, SAG, TIME_STEP

WOULD_CATCH = "thesis, section 4.2; it would catch a hidden compliance of 2.3e-15 in the locks"


def _deviation_metric(
    role: str, limit: float | None, source: str, set_point: float, kind: case.LimitKind = "physical"
) -> case.Metric:
    return case.Metric(
        name="height_deviation",
        description="largest height deviation of a box over the beam's length, last 50 of 1000 steps",
        unit="%",
        role=role,  # type: ignore[arg-type]
        limit=limit,
        limit_source=source,
        limit_kind=kind,
        set_point=(-set_point, set_point),
        set_point_source="rigid locks leave rounding only: a few units in the last place of the height",
        reference=0.0,
        tolerance=1e-13,
    )


MEASUREMENTS = (
    case.Measurement(
        configuration="plain",
        time_step=TIME_STEP,
        parameters={"N": COUNT},
        metrics=(_deviation_metric("gate", 4.9e-9, WOULD_CATCH, 1e-12),),
        measure=_measure_gate,
        note="Plain SPOOK, direct solver; one contact under the centre of each end box.",
    ),
    case.Measurement(
        configuration="plain",
        time_step=TIME_STEP,
        parameters={"N": 2000},
        metrics=(_deviation_metric("companion", 1e-12, "set point: rounding only", 1e-12, "method"),),
        measure=_measure_long,
        note="A beam of 250 m, 25 times the thesis' length.",
    ),
    case.Measurement(
        configuration="compliant",
        time_step=TIME_STEP,
        parameters={"N": COUNT},
        metrics=(
            case.Metric(
                name="sag",
                description="deepest sag with compliance 1e-12 in every lock row",
                unit="m",
                role="reported",
                reference=SAG,
            ),
            case.Metric(
                name="sag_error",
                description="sag over the closed form, minus one: the beam must bend exactly as much as asked",
                unit="1",
                role="companion",
                limit=1e-3,
                limit_source="unit-load theorem, 0.1 %",
                reference=0.0,
                tolerance=1e-8,
            ),
        ),
        measure=_measure_sag,
        note="Compliance 1e-12: proves that the gate is not green because nothing can bend.",
    ),
    *(
        case.Measurement(
            configuration=support,
            time_step=TIME_STEP,
            parameters={"N": COUNT},
            metrics=(_deviation_metric("companion", 4.9e-9, "thesis, section 4.2", 1e-12),),
            measure=_measure_support(support),  # type: ignore[arg-type]
            note=note,
        )
        for support, note in (
            ("edge", "Each pile touches along an edge: two contacts, one more than needed."),
            ("corners", "Each pile carries four corners: contact forces are not unique."),
        )
    ),
)

LADDERS = (
    case.Ladder(
        name="height",
        description="largest height deviation of 20 boxes over 2 s, of their length",
        unit="%",
        time_steps=tuple(1.0 / n for n in (15, 30, 60)),
        configurations=configured(
            {
                "direct": None,
                "direct, no refinement": None,
                "iterative, 50 iterations": None,
                "iterative, 200 iterations": None,
            }
        ),
        error=ladder_error,
        target_error=None,
        target_seconds=None,
    ),
)
