"""The questions themselves: the list, one test in full, and the stages its scene needs."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from spook_tracker.scalar_tests.case import LimitKind, Measurement, Metric, ScalarTest
from spook_tracker.tracker.document.coverage import HEADINGS, Coverage, Rungs, coverage, rungs, summary
from spook_tracker.tracker.document.coverage import saved as told_saving
from spook_tracker.tracker.document.wording import whose
from spook_tracker.tracker.measure.cards import explained
from spook_tracker.tracker.measure.step_cost import LeavingOut, StepCost

from .console import Column, table, width
from .report_sweep import seconds
from .report_table import number

if TYPE_CHECKING:
    from spook_tracker.tracker.measure.questions import Engine
    from spook_tracker.tracker.store.history import History


def catalogue_table(tests: Mapping[str, ScalarTest]) -> str:
    """Every test with its question, its first gate, and its topic where any has one."""
    rows: list[tuple[str, ...]] = []
    topics = any(test.topic for test in tests.values())
    for name, test in tests.items():
        gates = [metric for _, metric in test.metrics() if metric.role == "gate"]
        more = f" +{len(gates) - 1}" if len(gates) > 1 else ""
        limit = (limit_of(gates[0]) + more) if gates else "-"
        rows.append((name, *((test.topic,) if topics else ()), limit, test.question))
    topic = (Column("topic"),) if topics else ()
    columns = (Column("test"), *topic, Column("limit"), Column("question", flexible=True))
    seven = sum(test.seven for test in tests.values())
    footer = (
        f"{len(rows)} tests, {seven} of them the continuous tests of the thesis; more with: tracker show TEST"
    )
    return "\n".join([*table(columns, rows), "", footer])


def coverage_rows(tests: Mapping[str, ScalarTest], history: History | None) -> list[Coverage]:
    """What each scene has, and by the newest run of `history` (None: there is none) how far it came."""
    runs = history.runs() if history is not None else ()
    measured, saving = {}, {}
    if history is not None and runs:
        measured = rungs(history.samples(runs[-1].id).values())
        saving = {card.name: card.saving for card in history.cards(runs[-1].id)}
    rows = []
    for name, test in tests.items():
        reached = measured.get(name, {})
        ladders = [
            replace(
                reached.get(ladder.name, Rungs(ladder.name, ladder.unit, 0)),
                configurations=len(ladder.configurations),
            )
            for ladder in test.ladders
        ]
        points = sum(bool(study.unit or study.expected_source) for study in test.stability)
        maps = len(test.stability) - points
        rows.append(coverage(name, test.title, ladders, points, maps, saving.get(name), test.lacks))
    return rows


def coverage_table(rows: Sequence[Coverage]) -> str:
    """Every scene with what is known of it; an empty cell is work to be done."""
    columns = (
        Column("test"),
        *(Column(heading.lower(), flexible=heading == HEADINGS[0]) for heading in HEADINGS),
    )
    return "\n".join([*table(columns, [(row.test, *row.cells) for row in rows]), "", summary(rows)])


def limit_of(metric: Metric) -> str:
    """The limit in signs, with its unit."""
    unit = "" if metric.unit in ("", "1") else f" {metric.unit}"
    if metric.limit is None:
        return "no limit"
    if isinstance(metric.limit, tuple):
        return f"{number(metric.limit[0], 7)} … {number(metric.limit[1], 7)}{unit}"
    return f"{'≥' if metric.better == 'larger' else '≤'} {number(metric.limit)}{unit}"


def card(name: str, test: ScalarTest) -> str:
    """One test as its page says it."""
    room = min(width(), 100)

    def paragraph(title: str, *texts: str) -> Iterator[str]:
        if any(texts):
            yield click.style(title, bold=True)
            for text in texts:
                yield from textwrap.wrap(text, room, initial_indent="  ", subsequent_indent="  ")
            yield ""

    lines = [click.style(f"{test.title} ({name})", bold=True), *textwrap.wrap(test.question, room), ""]
    lines += paragraph("Why", test.why)
    lines += paragraph("Model", test.model, *(f"{label}: {value}" for label, value in test.parameters))
    lines += paragraph("Theory", *test.theory)
    lines += paragraph("Reference", test.reference)
    lines += [click.style("Measured", bold=True)]
    for measurement, metric in test.metrics():
        lines += [f"  {line}" for line in _metric(measurement, metric, room - 2)]
    lines += ["", *paragraph("Conclusion", test.conclusion), *paragraph("Questions", test.source)]
    lines += paragraph("Misprints", *test.misprints)
    return "\n".join(lines).rstrip()


def _metric(measurement: Measurement, metric: Metric, room: int) -> Iterator[str]:
    yield f"{metric.role} {metric.name} [{measurement.configuration}, h = {measurement.time_step:.6g} s]"
    limit = limit_of(metric)
    if metric.limit is not None:
        limit += _because(metric.limit_kind, metric.limit_source)
    yield from textwrap.wrap(
        f"{metric.description}; {limit}", room, initial_indent="  ", subsequent_indent="  "
    )
    if metric.set_point is not None:
        low, high = metric.set_point
        source = _because(metric.set_point_kind, metric.set_point_source)
        words = f"set point {number(low, 10)} … {number(high, 10)} {metric.unit}{source}"
        yield from textwrap.wrap(words, room, initial_indent="  ", subsequent_indent="  ")


def _because(kind: LimitKind, source: str) -> str:
    """Whose a limit or a set point is, and where it comes from."""
    return f" ({whose(kind)}: {source})" if source else f" ({whose(kind)})"


def _per_step(cost: float | None, verb: str) -> str:
    return "" if cost is None else f"{verb} {seconds(cost)}" if cost > 0.0 else f"{verb} nothing"


def _taken(stage: str, within: str, costs: Mapping[str, float]) -> str:
    if stage not in costs and within:
        return f"in {within}"
    return _per_step(costs.get(stage), "takes") or "did not run"


def stage_table(
    name: str,
    test: ScalarTest,
    engine: Engine,
    costs: StepCost | None = None,
    out: LeavingOut | None = None,
) -> str:
    """The stages of a step of this test's scene: first those kept, in order, then those left out, each with its reason.

    `costs` are those of stages kept, `out` what leaving out saves, if measured: of the stages that are left out only
    what was measured has a line then.
    """
    choices = sorted(explained(test, engine), key=lambda choice: not choice.kept)
    saved = out.saved if out is not None else {}
    kept = [choice.stage for choice in choices if choice.kept]
    rows: list[tuple[str, ...]] = [("✓ kept" if c.kept else "· left out", c.stage, c.reason) for c in choices]
    columns: tuple[Column, ...] = (Column("stage"), Column("name"), Column("why", flexible=True))
    after: list[str] = []
    if costs is not None:
        folded = [c.stage for c in choices if not c.kept and c.stage not in saved]
        choices = [c for c in choices if c.kept] + [c for c in choices if c.stage in saved]
        rows = [("✓ kept" if c.kept else "· left out", c.stage, c.reason) for c in choices]
        after = [
            "",
            f"A step takes {seconds(costs.whole)} while its stages are timed: {seconds(sum(costs.stages.values()))} in them, "
            f"{seconds(costs.beside)} between them.",
        ]
        after += (
            [f"With every stage that can be forced in: {told_saving(out.told())}."] if out is not None else []
        )
        after += textwrap.wrap(f"Also left out: {', '.join(folded)}.", width()) if folded else []
        told = [
            _taken(c.stage, getattr(c, "within", ""), costs.stages)
            if c.kept
            else _per_step(saved.get(c.stage), "saves")
            for c in choices
        ]
        columns = (*columns[:2], Column("a step", "right"), columns[2])
        rows = [(*row[:2], cost, row[2]) for row, cost in zip(rows, told, strict=True)]

    def paint(row: int, text: str) -> str:
        return click.style(text, fg="green" if choices[row].kept else None)

    lines = [f"{name}: {' → '.join(kept)}", ""]
    return "\n".join([*lines, *table(columns, rows, colour={0: paint}), *after])
