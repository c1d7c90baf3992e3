"""Error against run time in the terminal: a line for each ladder configuration."""

from __future__ import annotations

import math
from collections.abc import Sequence

import click

from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition
from spook_tracker.tracker.judge.standing import NO_VALUE
from spook_tracker.tracker.judge.vocabulary import spaced

from .console import NARROW, Column, table

Pair = tuple[SeriesDefinition, Sample]


def sweep_table(found: Sequence[Pair], room: int) -> list[str]:
    """Order with its expectation, time at the ladder's error, error in its time, and the rungs that failed."""
    groups: dict[tuple[str, str, str], list[Pair]] = {}
    for definition, sample in found:
        ladder = definition.metric.split(":")[1] if ":" in definition.metric else definition.metric
        groups.setdefault((definition.test, ladder, definition.configuration), []).append(
            (definition, sample)
        )
    rows: list[tuple[str, ...]] = []
    broken: list[bool] = []
    for (test, ladder, configuration), pairs in groups.items():
        by_kind = {definition.metric.split(":")[-1]: (definition, sample) for definition, sample in pairs}
        rungs = [sample for definition, sample in pairs if definition.kind == "ladder"]
        failed = sum(not sample.passed for sample in rungs)
        order = by_kind.get("order")
        broken.append(bool(order and not order[1].passed))
        rows.append(
            (
                f"{test} {ladder} [{configuration}]",
                _order(order),
                _reached(by_kind.get("time-to-error"), "target_error"),
                _reached(by_kind.get("error-in-time"), "target_seconds"),
                f"{len(rungs) - failed}/{len(rungs)}",
                "✗ WRONG ORDER" if broken[-1] else "✓" if order else "·",
            )
        )
    columns: tuple[Column, ...] = (
        Column("error against run time", flexible=True),
        Column("order (expected)", "right"),
        Column("time to error", "right"),
        Column("error in time", "right"),
        Column("rungs", "right"),
        Column("verdict"),
    )
    if room < NARROW:  # order and time to error are all there is room for
        columns, rows = (*columns[:3], columns[5]), [(*row[:3], row[5]) for row in rows]

    def paint(row: int, text: str) -> str:
        return click.style(text, fg="red" if broken[row] else "green" if text.startswith("✓") else None)

    return table(columns, rows, room, {len(columns) - 1: paint})


def _order(pair: Pair | None) -> str:
    if pair is None:
        return "-"
    definition, sample = pair
    value = sample.value
    shown = f"{value:.3f}" if math.isfinite(value) else sample.outcome
    return f"{shown} ({definition.reference:g})" if definition.reference is not None else shown


def _reached(pair: Pair | None, parameter: str) -> str:
    if pair is None:
        return "-"
    definition, sample = pair
    value, target = sample.value, definition.parameters.get(parameter, math.nan)
    if sample.outcome in NO_VALUE and not math.isinf(value) and sample.outcome != "missing":
        return spaced(sample.outcome)
    if parameter == "target_error":
        return f"{seconds(value)} to {target:g}" if math.isfinite(value) else f"never {target:g}"
    return f"{value:.3g} {definition.unit} in {seconds(target)}" if math.isfinite(value) else "too slow"


def seconds(value: float) -> str:
    """A time with a fitting unit."""
    for factor, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if abs(value) >= factor:
            return f"{value / factor:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"
