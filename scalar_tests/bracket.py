"""Where a scene stops being stable: break points by bracketing, and the cell a run belongs in.

A break point is the last value before the first failure, walking from an easy value towards a hard one on a
grid and then halving the gap where the first failure was. Values that hold again beyond it do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from spook_tracker import engine

from . import case

WALK = 12  # grid values between easy and hard
GROWTH = 2.0  # a quantity that doubles from the middle third of a run to the last is growing


def break_point(
    holds: Callable[[float], bool], easy: float, hard: float, *, resolution: float = 0.01, walk: int = WALK
) -> case.BreakPoint:
    """The last value that holds on the way from `easy` to `hard`, both above zero, to a relative `resolution`.

    `hard` itself if everything holds; NaN if not even `easy` does.
    """
    grid = [float(value) for value in np.geomspace(easy, hard, walk)]
    good, bad, asked = math.nan, math.nan, 0
    for value in grid:
        asked += 1
        if not holds(value):
            bad = value
            break
        good = value
    if math.isnan(good) or math.isnan(bad):
        return case.BreakPoint(value=good, resolution=resolution, evaluations=asked)
    while abs(math.log(bad / good)) > resolution:
        middle = math.sqrt(good * bad)
        asked += 1
        if holds(middle):
            good = middle
        else:
            bad = middle
    return case.BreakPoint(value=good, resolution=resolution, evaluations=asked)


def unbroken(
    holds: Callable[[case.Simulate, float], bool],
    easy: float,
    hard: float,
    *,
    name: str,
    title: str,
    definition: str,
    source: str,
    unit: str,
    configuration: str = "plain",
    walk: int = 6,
) -> case.StabilityStudy:
    """The break point of what by theory holds all the way to `hard`, where the search ends; `source` says why it does."""

    def study(simulate: case.Simulate) -> case.BreakPoint:
        return break_point(lambda value: holds(simulate, value), easy, hard, walk=walk)

    return case.StabilityStudy(
        name=name,
        title=title,
        configuration=configuration,
        definition=definition,
        study=study,
        unit=unit,
        better="larger" if hard > easy else "smaller",
        expected=(hard, hard),
        expected_source=f"{source}; the search ends at {hard:g} {'' if unit == '1' else unit}".rstrip(),
    )


def break_count(holds: Callable[[int], bool], counts: Sequence[int]) -> case.BreakPoint:
    """The same for whole numbers: walks `counts` upwards, then halves the gap to single counts."""
    good, bad, asked = 0, 0, 0
    for count in counts:
        asked += 1
        if not holds(count):
            bad = count
            break
        good = count
    while good and bad - good > 1:
        middle = (good + bad) // 2
        asked += 1
        if holds(middle):
            good = middle
        else:
            bad = middle
    return case.BreakPoint(
        value=float(good) if good else math.nan, resolution=1.0 / max(1, good), evaluations=asked
    )


def cell(result: engine.Result, history: Any, *, bound: float, rest: float = 0.0) -> str:
    """settled, bounded, growing, diverged or not_finite.

    `history` is a magnitude at every sample, scaled so that 1 means as large as the scene itself: `bound` is
    how much of that is still stable, `rest` what counts as still. Growing is above the bound, or twice as
    large in the last third as in the middle third.
    """
    if result.status == "not_finite":
        return "not_finite"
    if not result.completed:
        return "diverged"
    size = np.abs(np.asarray(history, dtype=float)).reshape(len(history), -1).max(axis=1)
    if not np.isfinite(size).all():
        return "not_finite"
    third = max(1, len(size) // 3)
    middle, late = float(size[-2 * third : -third].max(initial=0.0)), float(size[-third:].max())
    if size.max() > bound or (late > GROWTH * middle and late > rest):
        return "growing"
    return "settled" if late <= rest else "bounded"


def is_stable(kind: str) -> bool:
    """Whether a cell counts as stable."""
    return kind in ("settled", "bounded")


def table(
    rows: Iterable[float], columns: Iterable[float], ask: Callable[[float, float], Any]
) -> tuple[tuple[Any, ...], ...]:
    """ask(column, row) for every cell, row by row."""
    across = tuple(columns)
    return tuple(tuple(ask(x, y) for x in across) for y in rows)
