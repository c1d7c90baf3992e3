"""The numbers asked of the cantilever: units, limits and where they come from."""

from __future__ import annotations

from ... import case
from ...configurations import configured
from .measure import _measure_nodes, _measure_tip, _measure_weight, ladder_error
from .scene import COUNT, LARGE_DEFLECTION, TIME_STEP, TIP

MEASUREMENTS = (
    case.Measurement(
        configuration="static",
        time_step=TIME_STEP,
        metrics=(
            case.Metric(
                name="node_error",
                description="largest relative error of a node against Euler-Bernoulli, 10 to 320 elements",
                unit="1",
                role="gate",
                limit=1e-9,
                limit_source="the nodes are exact in theory; ours, since the thesis prints none",
                reference=0.0,
                tolerance=1e-11,
            ),
        ),
        measure=_measure_nodes,
        note="A thousandth of the load, so that the linear formula holds to 1e-9.",
    ),
    case.Measurement(
        configuration="dynamic",
        time_step=TIME_STEP,
        parameters={"N": 80},
        metrics=(
            case.Metric(
                name="tip_deflection",
                description="tip deflection under the printed load, settled",
                unit="m",
                role="reported",
                reference=TIP,
                tolerance=1e-9,
            ),
            case.Metric(
                name="tip_against_linear",
                description="tip deflection over P l³/(3EI), minus one",
                unit="1",
                role="companion",
                better="inside",
                limit=(LARGE_DEFLECTION - 1e-6, LARGE_DEFLECTION + 1e-6),
                limit_source="elastica to leading order, −(4/35)(P l²/(EI))² = −9.73e-5; 1e-6 for 80 pieces",
                reference=LARGE_DEFLECTION,
                tolerance=1e-8,
            ),
            case.Metric(
                name="tip_against_statics",
                description="tip deflection over the statics of the same rigid pieces, minus one",
                unit="1",
                role="companion",
                limit=1e-7,
                limit_source="at rest g = −ε F exactly; angles of 3e-4 at a lock are taken by their sines",
                reference=0.0,
                tolerance=1e-9,
            ),
            case.Metric(
                name="tip_against_elastica",
                description="tip deflection over the elastica, minus one",
                unit="1",
                role="companion",
                limit=8.5e-7,
                limit_source="the statics of 80 rigid pieces is 7.45e-7 off by itself; 1e-7 for settling, as above",
                reference=0.0,
                tolerance=1e-8,
            ),
        ),
        measure=_measure_tip,
        note="The printed load, from rest, until every box has been slower than 1e-4 m/s for a second.",
    ),
    case.Measurement(
        configuration="self-weight",
        time_step=TIME_STEP,
        parameters={"N": COUNT},
        metrics=(
            case.Metric(
                name="self_weight_ratio",
                description="tip deflection with the beam's own weight over the linear sum",
                unit="1",
                role="companion",
                better="inside",
                limit=(0.9920, 0.9930),
                limit_source="large deflection with self-weight, 0.9925",
                reference=0.9925,
                tolerance=1e-6,
            ),
        ),
        measure=_measure_weight,
        note="Load and self-weight together.",
    ),
)

LADDERS = (
    case.Ladder(
        name="statics",
        description="settled tip of 20 pieces against their statics",
        unit="1",
        time_steps=tuple(1.0 / n for n in (15, 30, 60, 120)),
        configurations=configured({"direct": None, "direct, no refinement": None}),
        error=ladder_error,
        target_error=1e-6,
        target_seconds=1.0,
    ),
)
