"""One line a test: the limit that is broken or nearest to it; every limit that is broken, and what was measured beside."""

from __future__ import annotations

import math
from collections import Counter

import click

from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.standing import FOLLOWED, is_red

from .console import Column, table, width
from .report_table import (
    Pair,
    failures,
    limit,
    margin,
    measured,
    model_looks,
    pairs,
    title,
    verdict,
    verdict_styles,
    word,
)

FEW = 3  # tests of which every limit is shown
COLUMNS = (
    Column("test", flexible=True),
    Column("measured", "right"),
    Column("limit", "right"),
    Column("margin", "right"),
    Column("verdict"),
)


def short_table(run: RunDocument, room: int | None = None) -> str:
    """The night in a screen or two: its heading, a line a test, what is not there, and its verdict."""
    by_test: dict[str, list[Pair]] = {}
    for pair in pairs(run):
        if pair[0].limit is not None and pair[1].outcome != "not_supported":
            by_test.setdefault(pair[0].test, []).append(pair)
    shown = [pair for of_test in by_test.values() for pair in _told(of_test)]
    lines = [title(run), ""]
    if shown:
        lines += table(COLUMNS, [_row(pair) for pair in shown], room or width(), verdict_styles(4))
    missing = [*model_looks(run), *failures(run)]
    lines += ["", *missing] if missing else []
    lines += ["", *_more(run, by_test, len(shown)), verdict(run)]
    return "\n".join(lines)


def _told(of_test: list[Pair]) -> list[Pair]:
    """What is red of a test, else the limit with the least room, of those that decide something if there are such."""
    if red := [pair for pair in of_test if is_red(*pair)]:
        return red
    deciding = [pair for pair in of_test if pair[0].role not in FOLLOWED]
    return [max(deciding or of_test, key=_used)]


def _used(pair: Pair) -> float:
    """How much of its limit a value takes: 1 at the limit, 0 where none of it."""
    definition, sample = pair
    value, bound = sample.value, definition.limit
    if bound is None or not math.isfinite(value):
        return math.inf
    if isinstance(bound, tuple):
        centre, half = 0.5 * (bound[0] + bound[1]), 0.5 * (bound[1] - bound[0])
        return abs(value - centre) / half if half else float(value != centre)
    if definition.better == "larger":
        return bound / value if value else math.inf
    return abs(value) / bound if bound else float(value != 0.0)


def _row(pair: Pair) -> tuple[str, ...]:
    definition, sample = pair
    return (
        f"{definition.test} {definition.metric} [{definition.configuration}]",
        measured(definition, sample, 4),
        limit(definition, 4),
        margin(definition, sample),
        word(definition, sample),
    )


def _more(run: RunDocument, by_test: dict[str, list[Pair]], shown: int) -> list[str]:
    """What the table leaves out, and how to see it."""
    kinds = Counter(definition.kind for definition in run.series)
    limits = sum(map(len, by_test.values())) - shown
    parts = [
        f"{count} {name}{'s' * (count > 1)}{of}"
        for count, name, of in (
            (limits, "further limit", ""),
            (kinds["ladder"], "rung", " of error against run time"),
            (kinds["break_point"], "break point", ""),
            (len(run.maps), "stability map", ""),
        )
        if count
    ]
    return [click.style(f"not shown: {', '.join(parts)}; --all prints them", dim=True)] if parts else []
