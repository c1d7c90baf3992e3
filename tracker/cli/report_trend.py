"""A series in the terminal: its sparkline, where its level changed, and its last values."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence

import click

from spook_tracker.tracker.document.run_document import Run, SeriesDefinition
from spook_tracker.tracker.document.wording import day
from spook_tracker.tracker.judge.events import in_full, name_of
from spook_tracker.tracker.judge.judged import BY_TIME, Judged, blame, commit_of, of_one_lineage
from spook_tracker.tracker.judge.maps import ToldMap
from spook_tracker.tracker.judge.series_history import Told, is_noisy, lanes_of, on_one_clock
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK, CLASSES, STATES, besides, spaced

from .console import NARROW, Column, clean, sparkline, table, width
from .report_table import ROLES, limit, number

FEW = 6  # series that are shown night by night; of more, those that are red
SMALL = 12  # columns of a small sparkline


def summary(trends: Sequence[Told], maps: Sequence[ToldMap] = ()) -> str:
    """One sentence over all: how many series are red in their newest night, which is the worst, how many recovered."""
    reds = [told for told in trends if told.nights and told.nights[-1].red]
    named = [
        (
            CLASS_RANK[told.nights[-1].stands],
            told.definition.role != "gate",
            told.key,
            name_of(told.nights[-1]),
        )
        for told in reds
    ]
    named += [
        (CLASS_RANK[told.stands], True, told.key, told.verdict.name) for told in maps if told.verdict.red
    ]
    every = len(trends) + len(maps)
    elsewhere = [line for told in trends for line in _red_elsewhere(told)]
    lines = [f"! the nights of {clean(told.key)} are {BY_TIME}" for told in trends if _by_time(told)]
    beside = "".join(f"\n{line}" for line in lines[:1])
    beside += "".join(f"\n! red when another machine was last asked: {line}" for line in elsewhere)
    states = [told.nights[-1].state for told in trends if told.nights] + [told.state for told in maps]
    also = besides(states)
    if not named:
        return click.style(f"✓ {every} series, none of them red tonight{also}", fg="green") + beside
    _, _, key, name = min(named, key=lambda one: one[:2])
    words = f"✗ {len(named)} of {every} series red; the worst: {clean(key)}, {name}{also}"
    return click.style(words, fg="red", bold=True) + beside


def _by_time(told: Told) -> bool:
    return not of_one_lineage(judged.night.run for judged in told.nights)


def _red_elsewhere(told: Told) -> Iterator[str]:
    """Machines other than tonight's whose newest night of this series is red: no run of tonight asked them."""
    for places in _clocks(told)[:-1]:
        last = told.nights[places[-1]]
        if last.red:
            yield clean(
                f"{told.key}, {name_of(last)}, {day(last.night.run.started)} on {machine_of(last.night.run)}"
            )


def _clocks(told: Told) -> list[list[int]]:
    """The nights of each machine, by their places, tonight's last; of values without noise all nights together."""
    if not is_noisy(told.definition):
        return [list(range(len(told.nights)))]
    clocks: dict[str, list[int]] = {}
    for place, judged in enumerate(told.nights):
        clocks.setdefault(judged.night.run.machine.fingerprint, []).append(place)
    return sorted(clocks.values(), key=lambda places: places[-1])


def machine_of(run: Run) -> str:
    """A machine as a reader knows it, and its mark."""
    return f"{run.machine.processor} ({mark_of(run)})"


def mark_of(run: Run) -> str:
    """What tells a machine from others in a table: the start of its fingerprint."""
    return run.machine.fingerprint[:8]


def gates_first(trends: Sequence[Told]) -> list[Told]:
    """As one reads them: what decides, then what keeps it honest, then the many rungs of ladders."""
    return sorted(trends, key=lambda told: (told.definition.kind != "scalar", ROLES[told.definition.role]))


def map_lines(maps: Sequence[ToldMap]) -> list[str]:
    """What became of each stability map, a line each."""
    return [
        clean(
            f"{CLASSES[told.stands][0]} {told.key}: {_map_word(told)}; "
            f"{told.verdict.sentence}" + (f"; {blame(told.bad, told.good)}" if told.verdict.red else "")
        )
        for told in maps
    ]


def _map_word(told: ToldMap) -> str:
    return "recovered" if told.state == "recovered" else told.verdict.name or spaced(told.verdict.word)


def overview_lines(trends: Sequence[Told]) -> list[str]:
    """A line for each value of a test, for those that are red of everything else, and how much that leaves out."""
    shown = [t for t in trends if t.definition.kind == "scalar" or (t.nights and t.nights[-1].red)]
    rows = [
        (
            clean(told.key.removeprefix(f"{told.definition.test}/")),
            sparkline([judged.night.value for judged in told.nights], SMALL),
            f"{number(told.nights[-1].night.value)} {told.definition.unit}".removesuffix(" 1"),
            limit(told.definition),
            STATES[told.nights[-1].state] or spaced(told.nights[-1].verdict.word),
        )
        for told in gates_first(shown)
    ]
    columns = (
        Column(clean(trends[0].definition.test), flexible=True),
        Column("nights"),
        Column("newest", "right"),
        Column("limit", "right"),
        Column("verdict"),
    )
    left = Counter(told.definition.kind for told in trends if told not in shown)
    kinds = ", ".join(f"{count} of kind {kind}" for kind, count in sorted(left.items()))
    more = [f"not shown: {kinds}; --all prints every series, --kind those of one"] if kinds else []
    return [*table(columns, rows), "", *more]


def trend_lines(told: Told, last: int = 10) -> list[str]:
    """The series as lines, oldest value at the left, newest at the bottom."""
    definition, judged = told.definition, told.nights
    unit = "" if definition.unit in ("", "1") else f" {definition.unit}"
    clocks = _clocks(told)
    several = len(clocks) > 1
    lines = [click.style(clean(told.key), bold=True)]
    for places in clocks:
        values = [judged[i].night.value for i in places]
        where = f"{machine_of(judged[places[-1]].night.run)}, " if several else ""
        count = f"values: {len(values)}, limit: {limit(definition)}"
        lines.append(f"{sparkline(values, width() - 2)}  ({clean(where + count)})")
    lines += [f"  {clean(line)}" for line in changes(definition, judged)]
    rows = [
        (
            day(j.night.run.started),
            j.night.run.engine.version,
            commit_of(j.night.run) + (" changed" if j.night.run.engine.dirty else ""),
            *([mark_of(j.night.run)] if several else []),
            number(j.night.value, 12) + unit if math.isfinite(j.night.value) else "no value",
            STATES[j.state] or spaced(j.verdict.word),
            j.verdict.sentence,
        )
        for j in judged[-last:]
    ]
    columns = (
        Column("night"),
        Column("version", flexible=True),
        Column("commit"),
        *([Column("machine")] if several else []),
        Column("value", "right"),
        Column("verdict"),
        Column("how", flexible=True),
    )
    if width() >= NARROW:
        return lines + table(columns, rows)
    # What was found stands below its night.
    below = [part for row in rows for part in (row[:-1], (f"  {row[-1]}",)) if part[0].strip()]
    return lines + table(columns[:-1], below)


def changes(definition: SeriesDefinition, judged: Sequence[Judged]) -> list[str]:
    """Where the level changed: exactly, or by statistics where there is noise."""
    if not is_noisy(definition):
        told = [j for j in judged if j.verdict.word not in ("identical", "same", "new") and not _repeats(j)]
        return [
            f"{day(j.night.run.started)} {commit_of(j.night.run)}: "
            + in_full(j.verdict.name or spaced(j.verdict.word), j.verdict.sentence)
            for j in told
        ]
    lanes = lanes_of([j.night for j in judged], on_one_clock)
    machines = {judged[places[0]].night.run.machine.fingerprint for places in lanes}
    return [
        line + (f" on {mark_of(judged[places[0]].night.run)}" if len(machines) > 1 else "")
        for places in lanes
        for line in _boundaries(judged, places)
    ]


def _boundaries(judged: Sequence[Judged], places: Sequence[int]) -> Iterator[str]:
    """Where one machine's level segments meet, and how sure that is."""
    before = None
    for place in places:
        now = judged[place].segment
        if now is not None and before is not None and now is not before and now.boundary is not None:
            yield (
                f"{day(judged[place].night.run.started)} {commit_of(judged[place].night.run)}: "
                f"level {number(before.level)} → {number(now.level)} ({100.0 * now.boundary.probability:.0f} % sure)"
            )
        before = now or before


def _repeats(judged: Judged) -> bool:
    """A night that is only still red."""
    return judged.red and not judged.news
