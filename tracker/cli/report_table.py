"""The pass table of one run: every limit, what was measured against it, and whether it held."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence

import click

from spook_tracker.tracker.document.run_document import (
    LEFT_OUT,
    MapData,
    RunDocument,
    Sample,
    SeriesDefinition,
)
from spook_tracker.tracker.document.wording import clock
from spook_tracker.tracker.judge.model_words import first_look
from spook_tracker.tracker.judge.standing import (
    FOLLOWED,
    HAVE_VALUES,
    Count,
    against_limit,
    count,
    is_red,
    standing,
)
from spook_tracker.tracker.judge.verdict import cell_rank
from spook_tracker.tracker.judge.vocabulary import CLASSES

from .console import NARROW, Column, Style, cells, clean, table, width
from .report_sweep import sweep_table

NAMED = 24  # columns that tell one metric's configurations apart; where fewer are left, the margin goes
ROLES = {"gate": 0, "companion": 1, "reported": 2, "explaining": 3}
OF_MODELS = ("differing_runs", "predictable_time", "real_time_factor")
Pair = tuple[SeriesDefinition, Sample]


def number(value: float, digits: int = 6) -> str:
    """A value as a reader wants it: six digits, no padding."""
    return f"{value + 0.0:.{digits}g}"  # no -0


def measured(definition: SeriesDefinition, sample: Sample, digits: int = 6) -> str:
    """The value with its unit, or the class of its failure; an unsettled one says both."""
    value = sample.value
    if sample.outcome not in HAVE_VALUES and not math.isinf(value):
        return sample.outcome.replace("_", " ")
    said = " unsettled" if sample.outcome == "unsettled" else ""
    return f"{number(value, digits)} {_unit(definition)}".rstrip() + said


def limit(definition: SeriesDefinition, digits: int = 6) -> str:
    """The limit in signs: "≤ 0.004 %", "≥ 100", "0.4999 … 0.5001"."""
    if definition.limit is None:
        return "-"
    if isinstance(definition.limit, tuple):
        low, high = definition.limit
        return f"{number(low, digits)} … {number(high, digits)}"
    sign = "≥" if definition.better == "larger" else "≤"
    return f"{sign} {number(definition.limit, digits)} {_unit(definition)}".rstrip()


def _unit(definition: SeriesDefinition) -> str:
    return "" if definition.unit in ("", "1") else definition.unit


def margin(definition: SeriesDefinition, sample: Sample) -> str:
    """How far inside the limit: per cent, or decades where per cent says nothing; negative is outside."""
    value, bound = sample.value, definition.limit
    if bound is None or not math.isfinite(value):
        return "-"
    if isinstance(bound, tuple):
        centre, half = 0.5 * (bound[0] + bound[1]), 0.5 * (bound[1] - bound[0])
        used, allowed = abs(value - centre), half
    elif definition.better in ("larger", "smaller"):
        if bound == 0.0:
            return "-"
        share = (value - bound) / abs(bound) * (1.0 if definition.better == "larger" else -1.0)
        return _percent(share)
    else:
        used, allowed = abs(value), bound
    if used == 0.0:
        return "exact"
    if allowed <= 0.0:
        return "-"
    decades = math.log10(allowed / used)
    return f"{decades:+.1f} decades" if abs(decades) >= 1.0 else _percent(1.0 - used / allowed)


def _percent(share: float) -> str:
    return f"{100.0 * share:+.3g} %" if abs(share) >= 1e-4 or share == 0.0 else f"{'+-'[share < 0.0]}<0.01 %"


def set_point(definition: SeriesDefinition, sample: Sample) -> str:
    """Whether the value stands where theory puts it."""
    if definition.set_point is None:
        return "-"
    return "held" if sample.set_point_held else "LEFT"


def word(definition: SeriesDefinition, sample: Sample) -> str:
    """The last column: what a reader looks for first."""
    shown_only = (
        definition.role == "reported" and definition.limit is not None
    )  # of an engine that gates nothing
    stands = against_limit(definition, sample) if shown_only else standing(definition, sample)
    mark, said, _ = CLASSES[stands]
    return f"{mark} {said}"


def pairs(run: RunDocument) -> list[Pair]:
    """Definitions with their samples, tests in order, gates first."""
    samples = {sample.series: sample for sample in run.samples}
    places = {card.name: i for i, card in enumerate(run.tests)}
    found = [(definition, samples[definition.key]) for definition in run.series if definition.key in samples]
    return sorted(found, key=lambda pair: (places.get(pair[0].test, len(places)), ROLES[pair[0].role]))


def red(run: RunDocument) -> list[Pair]:
    """What is red tonight."""
    return [pair for pair in pairs(run) if is_red(*pair)]


def pass_table(run: RunDocument, everything: bool = False, room: int | None = None) -> str:
    """The table with its heading and its verdict, ready to print."""
    shown = [pair for pair in pairs(run) if pair[0].kind == "scalar" or _asked_alone(pair[0])]
    if not everything:
        judged = [pair for pair in shown if pair[0].role not in FOLLOWED]
        # An engine that is only shown has no gates; what has a limit is what a reader asks for.
        shown = judged or [pair for pair in shown if pair[0].limit is not None]
    lines = [title(run), ""]
    lines += _scalars(shown, room or width())
    swept = ("ladder", "order", "time")
    ladders = [pair for pair in pairs(run) if pair[0].kind in swept and not _asked_alone(pair[0])]
    if ladders:
        lines += ["", *sweep_table(ladders, room or width())]
    points = [pair for pair in pairs(run) if pair[0].kind == "break_point"]
    if points or run.maps:
        lines += ["", click.style("Stability", bold=True)]
        lines += _scalars(points, room or width()) if points else []
        lines += [_map_line(found) for found in run.maps]
    lines += ["", *model_looks(run), *failures(run), verdict(run)]
    return "\n".join(lines)


def model_looks(run: RunDocument) -> list[str]:
    """Of each model file a line: how it ends, how long it can be predicted, what it costs, what broke off; and what a first
    look left out."""
    of_models = {one.test for one in run.series if one.metric in OF_MODELS}
    found: dict[str, list[Pair]] = {}
    for pair in pairs(run):
        if pair[0].test in of_models and (pair[0].kind == "scalar" or _asked_alone(pair[0])):
            found.setdefault(pair[0].test, []).append(pair)
    looks = [f"{test}: {said}" for test, of_test in found.items() if (said := _look(of_test))]
    return looks + [
        clean(
            f"{card.name}: left out of this first look: {card.lacks[LEFT_OUT]}; nothing is recorded; --all asks all"
        )
        for card in run.tests
        if LEFT_OUT in card.lacks
    ]


def _look(of_test: Sequence[Pair]) -> str:
    values = {one.metric: sample.value for one, sample in of_test if sample.outcome in HAVE_VALUES}
    moving = next(
        (s.failure for one, s in of_test if one.metric == "settled" and s.outcome == "unsettled"), ""
    )
    broken = {
        f"{one.configuration} {sample.outcome.replace('_', ' ')}: {sample.failure}": None
        for one, sample in of_test
        if sample.outcome not in (*HAVE_VALUES, "not_supported") and one.role in FOLLOWED
    }
    return clean("; ".join([*filter(None, [first_look(values, moving)]), *broken]))


def _asked_alone(definition: SeriesDefinition) -> bool:
    """A run time that was measured as a value, and not on a ladder."""
    return definition.kind == "time" and ":" not in definition.metric


def _map_line(found: MapData) -> str:
    """How many cells of a map are what."""
    count = Counter(cell for row in found.cells for cell in row)
    words = ", ".join(f"{count[cell]} {cell.replace('_', ' ')}" for cell in sorted(count, key=cell_rank))
    return clean(f"map {found.test} {found.name} [{found.configuration}]: {words}")


def title(run: RunDocument) -> str:
    """Which engine, which commit, which machine."""
    engine = run.engine
    commit = engine.git_hash[:10] + (" with local changes" if engine.dirty else "")
    facts = (f"{engine.name} {engine.version}", commit, run.machine.processor, f"{clock(run.started)} UTC")
    return click.style(clean(" · ".join(filter(None, facts))), bold=True) + "".join(
        "\n" + clean(f"{found.pieces} pieces measured on {found.processor}, {found.fingerprint}")
        for found in run.workers
    )


def _scalars(shown: Sequence[Pair], room: int) -> list[str]:
    """A heading row for each test, its values beneath; the set point where there is room, else the time step above."""
    narrow = room < NARROW
    columns: tuple[Column, ...] = NARROW_COLUMNS if narrow else WIDE_COLUMNS
    rows: list[tuple[str, ...]] = []
    previous = step_above = ""
    for definition, sample in shown:
        step = "" if definition.time_step is None else f"h = {number(definition.time_step, 4)} s"
        if definition.test != previous:
            rows.append((definition.test, step * narrow, *[""] * (len(columns) - 2)))
        elif narrow and step != step_above:
            rows.append(("", step, *[""] * (len(columns) - 2)))
        previous, step_above = definition.test, step
        rows.append(_row(definition, sample, narrow))
    if narrow and _left_for_names(columns, rows, room) < NAMED:
        columns, rows = columns[:3] + columns[4:], [row[:3] + row[4:] for row in rows]
    return table(columns, rows, room, _styles(narrow, len(columns)))


def _left_for_names(columns: Sequence[Column], rows: Sequence[Sequence[str]], room: int) -> int:
    """Columns that a table leaves to the first of its own; no more than are needed."""
    widest = [
        max(cells(text) for text in (c.title, *told))
        for c, told in zip(columns, zip(*rows, strict=True), strict=True)
    ]
    return room - sum(widest[1:]) - 2 * len(widest[1:]) if sum(widest) + 2 * len(widest[1:]) > room else NAMED


def _row(definition: SeriesDefinition, sample: Sample, narrow: bool) -> tuple[str, ...]:
    held, judged = set_point(definition, sample), word(definition, sample)
    facts = [definition.configuration]
    facts += [f"{name}={number(value, 4)}" for name, value in sorted(definition.parameters.items())]
    mark = "●" if definition.role == "gate" else " "
    name, room_left = f"{mark} {definition.metric} [{', '.join(facts)}]", margin(definition, sample)
    if narrow:
        left = room_left.replace("decades", "dec")
        return name, measured(definition, sample, 4), limit(definition, 4), left, judged
    step = "" if definition.time_step is None else number(definition.time_step, 4)
    return name, step, measured(definition, sample), limit(definition), room_left, held, judged


MEASURED = (Column("measured", "right"), Column("limit", "right"), Column("margin", "right"))
NARROW_COLUMNS = (Column("metric [configuration]", flexible=True), *MEASURED, Column("verdict"))
WIDE_COLUMNS = (
    Column("metric [configuration]", flexible=True),
    Column("h [s]"),
    *MEASURED,
    Column("set point"),
    Column("verdict"),
)


def verdict_styles(column: int) -> dict[int, Style]:
    """Green and red in the column of verdicts."""

    def paint(_row: int, text: str) -> str:
        return click.style(
            text, fg={"✓": "green", "✗": "red"}.get(text[:1]), dim=text.startswith("·") or None
        )

    return {column: paint}


def _styles(narrow: bool, columns: int) -> dict[int, Style]:
    def warn(_row: int, text: str) -> str:
        return click.style(text, fg="red") if text.startswith("LEFT") else text

    last = columns - 1
    return verdict_styles(last) if narrow else {**verdict_styles(last), last - 1: warn}


def failures(run: RunDocument) -> list[str]:
    """One sentence for each value that is not there or not settled; what is not supported is summed up."""
    failed = [pair for pair in pairs(run) if pair[1].failure and pair[0].role not in FOLLOWED]
    lines = [
        f"{definition.key}: {sample.outcome.replace('_', ' ')}: {clean(sample.failure)}"
        for definition, sample in failed
        if sample.outcome != "not_supported"
    ]
    return lines + _lacking([pair for pair in failed if pair[1].outcome == "not_supported"])


def _lacking(found: Sequence[Pair]) -> list[str]:
    """What an engine cannot be asked, by what it lacks: how many values wait for it, and of which tests."""
    waiting: dict[str, list[str]] = {}
    for definition, sample in found:
        for said in clean(sample.failure).split("; "):
            lead = re.match(r".*?(?:does not support |our adapter cannot ask \S+ for )", said)
            lacks = said[lead.end() :].split(", ") if lead else [said]
            by = " by our adapter" if lead and "adapter" in lead[0] else ""
            for lack in lacks:
                waiting.setdefault(f"not supported{by}: {lack}", []).append(definition.test)
    most_first = sorted(waiting.items(), key=lambda one: (-len(one[1]), one[0]))
    return [
        f"{lack}: {len(tests)} {'value' if len(tests) == 1 else 'values'} of {_some(tests)}"
        for lack, tests in most_first
    ]


def _some(tests: Sequence[str], most: int = 3) -> str:
    names = list(dict.fromkeys(tests))
    return ", ".join(names[:most]) + (f" and {len(names) - most} more tests" if len(names) > most else "")


def verdict(run: RunDocument) -> str:
    """The last line: how many limits held."""
    found = count(pairs(run))
    if not found.expected and not found.lost:
        shown = [against_limit(*pair) for pair in pairs(run) if pair[0].limit is not None]
        if "pass" not in shown and "fail" not in shown:
            return "nothing was measured against a limit"
        asked = len(shown) - shown.count("none")
        return (
            f"· {clean(run.engine.name)} does not decide the exit code: it keeps {shown.count('pass')} of the {asked} limits it "
            f"can be asked; {shown.count('none')} are not supported"
        )
    if not found.red:
        words = f"✓ green: {_all_hold(found)}; gates (●) among them: {found.gates}"
        return click.style(words, fg="green", bold=True)
    words = f"✗ red: {found.broken} of {found.limits} limits broken"
    words += f", {found.left} set points left" if found.left else ""
    words += f", {found.lost} values missing" if found.lost else ""
    return click.style(words, fg="red", bold=True)


def _all_hold(found: Count) -> str:
    if found.expected > 1:
        return f"all {found.expected} limits and set points hold"
    if found.limits and found.set_points:
        return "the one limit and its set point hold"
    return f"the one {'limit' if found.limits else 'set point'} holds"


def nothing_measured(document: RunDocument) -> str:
    """That an engine supports nothing of what was asked, and why, where there is one reason; empty if it does."""
    if any(sample.outcome != "not_supported" for sample in document.samples):
        return ""
    why = {f": {sample.failure}" for sample in document.samples}
    return (
        f"nothing was measured: {document.engine.name} supports none of the values asked for"
        f"{why.pop() if len(why) == 1 else ''}"
    )
