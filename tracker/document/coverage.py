"""What is known of every scene: error against run time, where it breaks, what leaving out saves, or why not.

A cell that is empty is work to be done, and is shown empty.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .run_document import Sample, Saving, SeriesDefinition
from .wording import number

SMALL = 1e-4  # an error that every ladder should come down to, in its own unit
HEADINGS = ("Error against run time", "Stability", "Leaving out")


@dataclass(frozen=True, slots=True)
class Rungs:
    """The configurations of a scene's ladder, and the least error that any of its rungs reached."""

    name: str
    unit: str
    configurations: int
    least: float | None = None  # in `unit`; None: not measured
    short: str = ""  # what keeps it from SMALL

    def __str__(self) -> str:
        many = f"{self.name}: {self.configurations} configuration{'s' * (self.configurations != 1)}"
        if self.least is None:
            return many
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        short = f", not 1e-4: {self.short}" if self.least > SMALL and self.short else ""
        return f"{many}, down to {number(self.least, 2)}{unit}{short}"


@dataclass(frozen=True, slots=True)
class Coverage:
    """The three cells of a scene's row, in the order of HEADINGS; "" where nothing is known."""

    test: str
    title: str
    cells: tuple[str, str, str]
    explained: bool  # some cell is a reason


def coverage(
    test: str,
    title: str,
    ladders: Iterable[Rungs],
    break_points: int,
    maps: int,
    saving: Saving | None,
    lacks: Mapping[str, str],
) -> Coverage:
    """One scene's row."""
    sweep = "; ".join(map(str, ladders)) or lacks.get("ladder", "")
    found = [f"{n} {what}{'s' * (n != 1)}" for n, what in ((break_points, "break point"), (maps, "map")) if n]
    return Coverage(
        test,
        title,
        (sweep, ", ".join(found) or lacks.get("stability", ""), saved(saving)),
        explained=bool(lacks),
    )


def saved(saving: Saving | None) -> str:
    """How many times as long a whole step takes with what it leaves out, the least and the largest round, and whether it
    gives the same values; "" where that is not measured."""
    if saving is None:
        return ""
    if saving.factor is None or saving.spread is None:
        return "nothing to leave out"
    low, high = saving.spread
    same = "to the bit" if saving.difference == 0.0 else f"to {number(saving.difference, 1)}"
    return f"{number(saving.factor, 3)} times ({number(low, 3)} to {number(high, 3)}), same {same}"


def rungs(pairs: Iterable[tuple[SeriesDefinition, Sample]]) -> dict[str, dict[str, Rungs]]:
    """By test and ladder, from the samples of a run."""
    found: dict[tuple[str, str], tuple[str, dict[str, list[tuple[float, float]]]]] = {}
    for series, sample in pairs:
        if series.kind != "ladder":
            continue
        place = series.test, series.metric.removeprefix("ladder:")
        _, configurations = found.setdefault(place, (series.unit, {}))
        errors = configurations.setdefault(series.configuration, [])
        if sample.outcome == "value" and math.isfinite(sample.value) and series.time_step:
            errors.append((series.time_step, abs(float(sample.value))))
    told: dict[str, dict[str, Rungs]] = {}
    for (test, name), (unit, configurations) in found.items():
        measured = [sorted(errors) for errors in configurations.values() if errors]
        best = min(measured, key=lambda errors: min(error for _, error in errors), default=[])
        least = min((error for _, error in best), default=None)
        told.setdefault(test, {})[name] = Rungs(name, unit, len(configurations), least, _short_of(best))
    return told


def _short_of(errors: Sequence[tuple[float, float]]) -> str:
    """What keeps (time step [s], error) pairs, fine to coarse, from SMALL: the step that their order asks for, or that smaller
    steps do not help."""
    if len(errors) < 2:
        return "no smaller step was asked"
    if not 0.0 < errors[0][1] < errors[1][1]:
        return "smaller steps do not help"
    (fine, small), (coarse, large) = errors[:2]
    order = math.log(large / small) / math.log(coarse / fine)
    if order < 0.3:
        return "smaller steps do not help"
    return (
        f"order {number(order, 2)} asks for steps of {number(fine * (SMALL / small) ** (1.0 / order), 2)} s"
    )


def summary(rows: Sequence[Coverage]) -> str:
    """How many cells of each column are empty, and how many scenes stand with a reason."""
    empty = [sum(not row.cells[column] for row in rows) for column in range(len(HEADINGS))]
    told = ", ".join(f"{many} without {what.lower()}" for many, what in zip(empty, HEADINGS, strict=True))
    return f"{len(rows)} scenes: {told}; {sum(row.explained for row in rows)} with a reason"
