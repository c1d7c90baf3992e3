"""Metrics and measurements of questions whose answer is a closed form: the error is the value."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from . import case

ROUNDING = "closed form; rounding and the solver's tolerance remain"


def error(
    name: str, description: str, unit: str, limit: float, source: str = ROUNDING, role: case.Role = "gate"
) -> case.Metric:
    """An error against a closed form, at most `limit`; a tenth of that is only a change."""
    return case.Metric(
        name=name,
        description=description,
        unit=unit,
        role=role,
        limit=limit,
        limit_source=source,
        reference=0.0,
        tolerance=0.1 * limit,
    )


def ask(
    measure: Callable[[case.Simulate], Mapping[str, float]],
    metrics: tuple[case.Metric, ...],
    note: str,
    time_step: float,
    configuration: str = "plain",
) -> case.Measurement:
    """One measurement of plain SPOOK."""
    return case.Measurement(
        configuration=configuration, time_step=time_step, metrics=metrics, measure=measure, note=note
    )
