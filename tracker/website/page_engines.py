"""Engines beside each other, and a page for each of the others: nothing here is red, some are ahead."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby, pairwise
from typing import TypeVar

import msgspec

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.run_document import Sample, SeriesDefinition, TestCard
from spook_tracker.tracker.document.wording import (
    clean,
    conditions,
    day,
    limit,
    named,
    number,
    quantity,
    seconds,
    slug,
    version,
)
from spook_tracker.tracker.judge.rank import (
    ERRORS,
    TIE,
    Answer,
    Question,
    Samples,
    Standing,
    answers,
    question,
    races,
    scenes,
    standings,
)
from spook_tracker.tracker.judge.release_notes import moved
from spook_tracker.tracker.judge.standing import against_limit

from .diagrams import ladder_charts, trend_chart, view
from .engine_rows import (
    BehindRow,
    Cell,
    EngineCard,
    GateRow,
    OccasionRow,
    RankRow,
    VersionRow,
)
from .nights import Book, Chapter, TestHistory, Trend
from .page_chooser import topics
from .page_rows import Page
from .recorded import Recorded
from .topics import Group, grouped

ENGINES, RECORDED = "engines.html", "recorded.html"
MOST_RELEASES = 200  # in the table of an engine's versions
MOST_CHARTS = 24  # of series that changed over the versions
MOST_CHANGES = 6  # named for one version
STEADY = ("time", "work")  # kinds whose changes say nothing about an engine's answers


def engine_address(name: str, folder: str = "engines") -> str:
    """Where the page of another engine is: as asked tonight, or as recorded."""
    return f"{folder}/{slug(name)}.html"


def samples_of(chapter: Chapter, *, timed: bool = True) -> dict[str, tuple[SeriesDefinition, Sample]]:
    """The newest sample of every series of an engine, in the order of its document."""
    ordered = sorted(
        (t for test in chapter.tests for t in test.trends if t.latest is not None), key=lambda t: t.order
    )
    return {
        t.definition.key: (t.definition, t.latest if timed else _untimed(t.latest))
        for t in ordered
        if t.latest is not None
    }


def _untimed(sample: Sample) -> Sample:
    return msgspec.structs.replace(sample, timing=None)


def engines(book: Book, recorded: Recorded | None = None, path: str = ENGINES, beside: str = "") -> Page:
    """What each answers, and which is ahead at equal error: tonight, or in the recorded night with ours of tonight beside.

    `beside` is the other of the two pages, where there are both.
    """
    chapters = book.engines if recorded is None else [*recorded.chapters, book]
    machine = chapters[0].tonight.machine.fingerprint
    titles = [_title(chapter) for chapter in chapters]
    if recorded is not None:
        titles[-1] += " tonight"
    by_title = dict(zip(titles, chapters, strict=True))
    ours = next(title for title, chapter in by_title.items() if chapter.name == book.name)
    apart = {
        title: "another machine" if chapter.tonight.machine.fingerprint != machine else "another night"
        for title, chapter in by_title.items()
        if chapter.tonight.machine.fingerprint != machine or (recorded is not None and chapter is book)
    }
    asked: dict[str, Samples] = {
        title: samples_of(chapter, timed=title not in apart) for title, chapter in by_title.items()
    }
    gates = [(test, trend.definition) for test in book.tests for trend in test.gates()]
    told = answers([definition for _, definition in gates], asked)
    found = standings(asked)
    folder = "engines" if recorded is None else "recorded"
    addresses = [
        "index.html" if chapter.name == book.name else engine_address(chapter.name, folder)
        for chapter in chapters
    ]
    cards = {test.name: test.card for test in book.tests}
    chosen = topics(
        {title: samples for title, samples in asked.items() if title not in apart},
        {
            title: (address, chapter.name)
            for title, address, chapter in zip(titles, addresses, chapters, strict=True)
        },
        cards,
    )
    own = [chapter.name == book.name for chapter in chapters]
    lines = [
        _line(test, definition, of_gate, own)
        for (test, _), (definition, of_gate) in zip(gates, told, strict=True)
    ]
    ranks = _ranks(found, cards, apart, own)
    context = {
        "engines": [
            _card(title, chapter, address, told, found)
            for title, chapter, address in zip(titles, chapters, addresses, strict=True)
        ],
        "recorded": None if recorded is None else _occasion(recorded),
        "beside": beside,
        "topics": chosen,
        "topic_charts": [one.chart for one in chosen if one.chart is not None],
        "matrix": _by_topic(line for line in lines if line["others"]),
        "alone": _by_topic(line for line in lines if not line["others"]),
        "mine": [title for title, mine in zip(titles, own, strict=True) if mine],
        "ranks": _by_topic(ranks),
        "scenes": ranks,
        "ours": ours,
        "behind": None if ours in apart else _behind(found, ours, book),
        "apart": apart,
    }
    return Page(path, "engines.html", "Engines", "The same questions to other engines.", context, plotly=True)


def _occasion(recorded: Recorded) -> OccasionRow:
    """What has to be known of a recorded night: when, on which machine, how busy, and what is left out."""
    nights = [chapter.tonight for chapter in recorded.chapters]
    machine = nights[0].machine
    loads = [load for one in recorded.occasions for load in one.load]
    return {
        "first": day(min(night.started for night in nights)),
        "last": day(max(night.finished for night in nights)),
        "processor": machine.processor,
        "cores": machine.cores,
        "count": len(nights),
        "loads": [number(min(loads), 2), number(max(loads), 2)] if loads else [],
        "limits": sorted({one.limit for one in recorded.occasions}),
        "minutes": number(sum(one.seconds for one in recorded.occasions) / 60.0, 3),
        "stale": recorded.stale,
        "notes": list(dict.fromkeys(one.note for one in recorded.occasions if one.note)),
    }


def _title(chapter: Chapter) -> str:
    return clean(f"{chapter.name} {version(chapter.tonight.engine)}")


def _card(
    name: str,
    chapter: Chapter,
    address: str,
    told: Sequence[tuple[SeriesDefinition, Sequence[Answer]]],
    found: Sequence[Standing],
) -> EngineCard:
    """One engine: what it answers, and how often none is quicker."""
    mine = [answer for _, of_gate in told for answer in of_gate if answer.engine == name]
    supported = [a for a in mine if a.sample is not None and a.sample.outcome != "not_supported"]
    first = Counter(race.error for race in races(found) if race.order[0][1] == name)
    reached = Counter(race.error for race in races(found))
    return {
        "name": name,
        "address": address,
        "measured": day(chapter.tonight.started),
        "nights": len(chapter.nights),
        "kept": sum(a.stands == "pass" for a in mine),
        "supported": len(supported),
        "asked": len(told),
        "first": [(number(error), first[error], reached[error]) for error in ERRORS if reached[error]],
    }


def _line(test: TestHistory, gate: SeriesDefinition, told: Sequence[Answer], own: Sequence[bool]) -> GateRow:
    cells = [_answered(answer) for answer in told]
    return {
        "title": test.card.title,
        "address": page_of(test.name),
        "what": named(gate)[0],
        "limit": limit(gate),
        "topic": test.card.topic,
        "cells": cells,
        "mine": [cell for cell, mine in zip(cells, own, strict=True) if mine],
        "others": any(
            answer.sample is not None and answer.sample.outcome != "not_supported"
            for answer, mine in zip(told, own, strict=True)
            if not mine
        ),
    }


def _answered(answer: Answer) -> Cell:
    definition, sample = answer.definition, answer.sample
    if definition is None or sample is None:
        return Cell("not asked", "none")
    return Cell(_value(definition, sample), answer.stands, _told(definition, sample))


def _value(definition: SeriesDefinition, sample: Sample) -> str:
    if not math.isfinite(sample.value):
        return sample.outcome.replace("_", " ")
    return quantity(sample.value, definition.unit, 3)


def _told(definition: SeriesDefinition, sample: Sample) -> str:
    return clean(f"{conditions(definition)}{': ' + sample.failure if sample.failure else ''}")[:300]


Row = TypeVar("Row", GateRow, RankRow)


def _by_topic(rows: Iterable[Row]) -> list[Group[Row]]:
    return grouped(rows, lambda row: row["topic"])


def _ranks(
    found: Sequence[Standing], cards: Mapping[str, TestCard], apart: Mapping[str, str], own: Sequence[bool]
) -> list[RankRow]:
    """A line for every scene: its errors at h = 1/60, and the run times to each error; `apart` says whose do not compare,
    and why; which engines are `own`. In the order of `cards`."""
    places = {name: place for place, name in enumerate(cards)}
    rows: list[RankRow] = []
    for group in sorted(scenes(found), key=lambda group: places.get(group[0].test, len(places))):
        first = group[0]
        lacks = [one.outcome.replace("_", " ") for one in group]
        columns = [_cells([one.error for one in group], lacks, partial(_error, first.unit), TIE)]
        late = [
            apart.get(one.engine, lack if lack in ("not asked", "not supported") else "not reached")
            for one, lack in zip(group, lacks, strict=True)
        ]
        for place in range(len(ERRORS)):
            columns.append(_cells([one.seconds[place] for one in group], late, seconds))
        if any(cell.best for column in columns for cell in column):
            card = cards.get(first.test)
            row: RankRow = {
                "title": card.title if card else first.test,
                "address": page_of(first.test) if card else "",
                "topic": card.topic if card else "",
                "what": first.ladder.replace("_", " "),
                "unit": "" if first.unit == "1" else first.unit,
                "columns": columns,
                "others": [
                    any(
                        cell.stands != "none" or cell.text in apart.values()
                        for cell, mine in zip(column, own, strict=True)
                        if not mine
                    )
                    for column in columns
                ],
            }
            rows.append(row)
    return rows


def _error(unit: str, value: float) -> str:
    return quantity(value, unit, 2)


def _cells(
    values: Sequence[float | None], lacks: Sequence[str], say: Callable[[float], str], tie: float = 0.0
) -> list[Cell]:
    """The best of a line stand out, all within `tie` of it; the others say how many times as much they take, unless the
    best is rounding itself."""
    best = min((v for v in values if v is not None), default=math.nan)
    cells = []
    for value, lack in zip(values, lacks, strict=True):
        if value is None:
            cells.append(Cell(lack, "none"))
        else:
            times = value / best if best > tie and value - best > tie else math.nan
            behind = f"{number(times, 2)} times the best" if times > 1.0 else ""
            cells.append(Cell(say(value), "pass", behind, value - best <= tie))
    return cells


def _behind(found: Sequence[Standing], ours: str, book: Book) -> list[BehindRow]:
    """Where another engine reaches an error before ours does, the largest factor first."""
    titles = {test.name: test.card.title for test in book.tests}
    places: list[tuple[float, BehindRow]] = []
    for race in races(found):
        if (behind := race.behind(ours)) is None:
            continue
        first, theirs, mine = behind
        times = math.inf if mine is None else mine / theirs
        places.append(
            (
                times,
                {
                    "title": titles.get(race.test, race.test),
                    "address": page_of(race.test),
                    "what": race.ladder.replace("_", " "),
                    "error": quantity(race.error, race.unit),
                    "ahead": first,
                    "theirs": seconds(theirs),
                    "mine": "never" if mine is None else seconds(mine),
                    "factor": "" if mine is None else f"{number(times, 2)} ×",
                },
            )
        )
    return [place for _, place in sorted(places, key=lambda one: -one[0])]


def engine_page(book: Book, chapter: Chapter, recorded: Recorded | None = None) -> Page:
    """One other engine: its answers in every configuration, and what its versions changed, tonight's or recorded ones."""
    history = chapter if recorded is None else recorded.releases.get(chapter.name, chapter)
    ours = {test.name: test for test in book.tests}
    gates = {question(t.definition): t.definition for test in book.tests for t in test.gates()}
    cells: dict[Question, dict[str, Cell]] = {place: {} for place in gates}
    for definition, sample in samples_of(chapter).values():
        if (place := question(definition)) in gates:
            cells[place][definition.configuration] = Cell(
                _value(definition, sample), against_limit(definition, sample), _told(definition, sample)
            )
    names = list(dict.fromkeys(name for of_gate in cells.values() for name in of_gate))
    rows = [
        {
            "title": ours[gate.test].card.title,
            "address": page_of(gate.test),
            "what": named(gate)[0],
            "limit": limit(gate),
            "cells": [cells[place].get(name) for name in names],
        }
        for place, gate in gates.items()
        if cells[place]
    ]
    steps = _steps(history)
    night = chapter.tonight
    context = {
        "engine": night.engine,
        "shown": _title(chapter),
        "measured": night.started,
        "machine": night.machine,
        "nights": len(history.nights),
        "recorded": recorded is not None,
        "all_engines": RECORDED if recorded is not None and book.others else ENGINES,
        "configurations": names,
        "rows": rows,
        "counts": [
            _counts(name, [of_gate[name] for of_gate in cells.values() if name in of_gate]) for name in names
        ],
        "ladders": [
            view(chart)
            for test in chapter.tests
            for chart in ladder_charts(
                retitled(ours, test), f"{slug(test.name)}-", earlier=chapter.earlier[:1]
            )
            if chart.name.endswith("-seconds")
        ],
        "versions": _folded(list(reversed(_versions(history, steps))))[:MOST_RELEASES],
        "trends": [
            view(trend_chart(trend, history.nights, (), ours_title(ours, trend), "version"))
            for trend in _moving(history, steps)
        ],
    }
    path = engine_address(chapter.name, "engines" if recorded is None else "recorded")
    return Page(path, "engine.html", _title(chapter), "Another engine's answers.", context, plotly=True)


def _counts(name: str, answered: Sequence[Cell]) -> tuple[str, int, int, int]:
    """Of one configuration: gates kept, gates it supports, gates asked."""
    kept = sum(cell.stands == "pass" for cell in answered)
    return name, kept, sum(cell.stands != "none" for cell in answered), len(answered)


def retitled(tests: dict[str, TestHistory], test: TestHistory) -> TestHistory:
    """A test of another engine under the title it has in our catalogue."""
    known = tests.get(test.name)
    return replace(test, card=known.card) if known else test


def ours_title(tests: dict[str, TestHistory], trend: Trend) -> str:
    """The title of a test, from our catalogue where it is one of ours."""
    known = tests.get(trend.definition.test)
    return known.card.title if known else trend.definition.test


Steps = dict[int, list[tuple[Trend, int]]]  # night -> series that changed with it, and their place there


def _steps(chapter: Chapter) -> Steps:
    """What each version changed, to a reader of releases."""
    found: Steps = {}
    for test in chapter.tests:
        for trend in test.trends:
            if trend.definition.kind in STEADY:
                continue
            for i, j in pairwise(range(len(trend.nights))):
                outcomes = (trend.outcomes[i], trend.outcomes[j])
                if moved(trend.values[i], trend.values[j], outcomes):
                    found.setdefault(trend.nights[j], []).append((trend, j))
    return found


def _versions(chapter: Chapter, steps: Steps) -> list[VersionRow]:
    """Every version in order, with what it changed."""
    told: list[VersionRow] = []
    for night in chapter.nights:
        changes = steps.get(night.index, [])
        tests = Counter(trend.definition.test for trend, _ in changes)
        told.append(
            {
                "version": version(night.engine),
                "measured": day(night.started),
                "first": night.index == 0,
                "count": len(changes),
                "tests": ", ".join(f"{clean(name)} ({n})" for name, n in tests.most_common(MOST_CHANGES))
                + (f" and {len(tests) - MOST_CHANGES} more tests" if len(tests) > MOST_CHANGES else ""),
                "changes": [
                    _change(trend, place)
                    for trend, place in sorted(changes, key=_size, reverse=True)[:MOST_CHANGES]
                ],
            }
        )
    return told


def _folded(told: list[VersionRow]) -> list[VersionRow]:
    """Neighbours that changed nothing are one line."""
    folded: list[VersionRow] = []
    for quiet, group in groupby(told, key=lambda one: not one["count"] and not one["first"]):
        found = list(group)
        if quiet and len(found) > 1:
            names = f"{found[-1]['version']} … {found[0]['version']}"
            days = " … ".join(dict.fromkeys((found[-1]["measured"], found[0]["measured"])))
            folded.append({**found[0], "version": names, "measured": days, "tests": f"{len(found)} versions"})
        else:
            folded += found
    return folded


def _size(change: tuple[Trend, int]) -> tuple[bool, float]:
    """Another outcome before another value, then by decades."""
    trend, j = change
    before, after = trend.values[j - 1], trend.values[j]
    if trend.outcomes[j - 1] != trend.outcomes[j]:
        return True, 0.0
    smallest, largest = sorted((abs(before), abs(after)))
    return False, math.log10(largest / smallest) if smallest > 0.0 else math.inf


def _change(trend: Trend, j: int) -> str:
    def said(place: int) -> str:
        value, unit = trend.values[place], trend.definition.unit
        return quantity(value, unit, 5) if math.isfinite(value) else trend.outcomes[place].replace("_", " ")

    d = trend.definition
    return clean(f"{d.test}, {named(d)[0]} ({conditions(d)}): {said(j - 1)} to {said(j)}")


def _moving(chapter: Chapter, steps: Steps) -> list[Trend]:
    """The scalars that changed in most versions, for charts."""
    if len(chapter.nights) < 2:
        return []
    count: Counter[str] = Counter()
    trends: dict[str, Trend] = {}
    for changes in steps.values():
        for trend, _ in changes:
            if trend.definition.kind == "scalar":
                trends[trend.definition.key] = trend
                count[trend.definition.key] += 1
    return [trends[key] for key, _ in count.most_common(MOST_CHARTS)]
