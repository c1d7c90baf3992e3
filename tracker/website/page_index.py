"""The first page: is the engine healthy tonight?"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Sequence
from dataclasses import fields
from itertools import groupby
from operator import attrgetter
from typing import TypedDict

from spook_tracker.tracker.document.points import columns
from spook_tracker.tracker.document.wording import clean, day, quantity, short_hash, version
from spook_tracker.tracker.judge.causes import Cause
from spook_tracker.tracker.judge.maps import ToldMap
from spook_tracker.tracker.judge.standing import Count, count, count_points, expected, worst
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK, CLASSES, WORSE_THAN_EXPECTED, Class

from .causes import ToldCause, damage_of, lasting, told
from .nights import Book, Night, TestHistory, Trend
from .page_rows import Page, Row, address, row
from .topics import Group, grouped

HEAT_NIGHTS = 60
MOST_RED = 30  # tests beyond the thesis with a row of their own there
MOST_OLD = 6  # causes of earlier nights on the first page; the page of regressions has all
MOST_TESTS = 14  # of one cause


def tonight(book: Book) -> list[Trend]:
    """The series measured in the newest night."""
    last = book.tonight.index
    return [t for test in book.tests for t in test.trends if t.nights[-1] == last]


def counted(book: Book) -> Count:
    """Limits and set points of the newest night."""
    return count_points((t.definition, t.told.nights[-1].night) for t in tonight(book))


def recovered(book: Book) -> int:
    """How many series and stability maps were red at their last verdict and no longer are."""
    maps = [told.state for test in book.tests for told in test.told_maps if told.tonight]
    return [*(t.told.nights[-1].state for t in tonight(book)), *maps].count("recovered")


def health(book: Book) -> tuple[Class, Count]:
    """What the newest night stands for, and how many limits and set points hold."""
    found = counted(book)
    states: list[Class] = [t.state for t in tonight(book)]
    state = worst([*states, *(told.stands for told in _red_maps(book))])
    return "none" if state == "followed" and not found.expected else state, found


def index(book: Book, causes: Sequence[Cause]) -> Page:
    """Is the engine healthy tonight?"""
    lacking = [test for test in book.tests if _lacks(test.trends)]
    gates = [(test, trend) for test in book.tests for trend in test.gates() if not _lacks([trend])]
    found = counted(book)
    seven = [row(t, test.card.title, address(test), book.nights) for test, t in gates if test.card.seven]
    measured = [
        row(t, test.card.title, address(test), book.nights)
        for test, t in gates
        if test.card.measured and t.definition.limit_kind == "physical"
    ]
    others = [
        (test.card.topic, _nearest(test, book))
        for test in book.tests
        if not ((test.card.seven or test.card.measured) and test.gates())
        and _judged(test)
        and not _lacks(_judged(test))
    ]
    steps = {t.definition.time_step for test, t in gates if test.card.seven}
    step = steps.pop() if len(steps) == 1 else None
    context = {
        **lead(book, causes),
        "kept": found.kept,
        "limits": found.limits,
        "held": found.set_points - found.left,
        "set_points": found.set_points,
        "nights": len(book.nights),
        "seven": seven,
        "measured": measured,
        "others": _by_topic(others),
        "lacking": [(test.card.title, address(test)) for test in lacking],
        "common_step": _step_words(step),
        "heat": heat(book, folded=True),
        "signs": [(name, said, meaning) for name, (_, said, meaning) in CLASSES.items()],
    }
    return Page("index.html", "index.html", "Tonight", str(context["summary"]), context)


class Lead(TypedDict):
    """What the first page and the report begin with."""

    state: Class
    night: Night
    headline: str
    summary: str
    new: list[ToldCause]
    old: list[ToldCause]
    old_left_out: int
    most_tests: int
    blamed: str


def lead(book: Book, causes: Sequence[Cause]) -> Lead:
    """What the first page and the report begin with: the state of the night, and what is red since when."""
    red = [told(cause, book) for cause in lasting(causes)]
    new, old = [c for c in red if c.new], [c for c in red if not c.new]
    state, found = health(book)
    if any(test.gates() for test in book.tests):
        headline = _headline(state, found, tonight(book), _red_maps(book))
    else:
        headline, state = _headline_without_limits(red), worst([state, *(cause.state for cause in red)])
    return {
        "state": state,
        "night": book.tonight,
        "headline": headline,
        "summary": summary(book),
        "new": new,
        "old": old[:MOST_OLD],
        "old_left_out": max(0, len(old) - MOST_OLD),
        "most_tests": MOST_TESTS,
        "blamed": _blamed(new, old, recovered(book), _worse_than_expected(book)),
    }


def _lacks(trends: Sequence[Trend]) -> bool:
    """Whether the engine supports none of what was asked."""
    return bool(trends) and all(trend.outcomes and trend.outcomes[-1] == "not_supported" for trend in trends)


def _judged(test: TestHistory) -> list[Trend]:
    """What stands for a test in the table: its gates, or its first companion."""
    return test.gates() or test.companions()[:1]


def _nearest(test: TestHistory, book: Book) -> Row:
    """One line for a test: the worst of its gates, or the one that is nearest to its limit."""
    rows = [row(trend, test.card.title, address(test), book.nights) for trend in _judged(test)]
    shown = min(rows, key=lambda one: (CLASS_RANK[one.state], -float(one.share or 0.0)))
    shown.more = len(rows) - 1
    shown.search = f"{shown.search} {clean(test.card.topic).lower()}"
    return shown


def _by_topic(rows: Sequence[tuple[str, Row]]) -> list[Group[Row]]:
    """What is red first, the worst on top; then topic by topic."""
    red = sorted((row for _, row in rows if row.state in RED), key=lambda row: CLASS_RANK[row.state])
    rest = grouped([one for one in rows if one[1].state not in RED], lambda one: one[0])
    told = [Group(one.title, one.anchor, [row for _, row in one.lines]) for one in rest]
    title = "Red" if any(one.title for one in told) else ""
    return [Group(title, "topic-red", red), *told] if red else told


def _red_maps(book: Book) -> list[ToldMap]:
    """Stability maps that the newest night was asked for and has not, and those with worse cells."""
    return [told for test in book.tests for told in test.red_maps]


NUMBERS = attrgetter(*(field.name for field in fields(Count)))


def counts_by_night(book: Book, most: int) -> dict[int, Count]:
    """Limits and set points of so many nights, the newest, by the index of the night."""
    counts: dict[int, list[tuple[int, ...]]] = {night.index: [] for night in book.nights[-most:]}
    for test in book.tests:
        for trend in test.trends:
            if not expected(trend.definition):
                continue
            said = columns(trend.told.points).said
            for start, end, (sample, _, recorded) in said.from_place(max(0, len(said) - most)):
                if recorded:
                    counted = NUMBERS(count([(trend.definition, sample)]))
                    for night in trend.nights[start:end]:
                        if night in counts:
                            counts[night].append(counted)
    return {night: Count(*map(sum, zip(*found, strict=True))) for night, found in counts.items()}


def _headline(state: Class, found: Count, fresh: Sequence[Trend], maps: Sequence[ToldMap]) -> str:
    if state == "none":
        return "No limit was tested tonight"
    if found.broken:
        return (
            "One limit is broken tonight"
            if found.broken == 1
            else f"{found.broken} limits are broken tonight"
        )
    lost = sum(t.state == "fail" for t in fresh)
    if lost:
        return (
            "Every limit is kept; one value is missing"
            if lost == 1
            else f"Every limit is kept; {lost} values are missing"
        )
    gone = sum(told.gone for told in maps)
    if gone:
        return "Every limit is kept; " + (
            "one stability map is missing" if gone == 1 else f"{gone} stability maps are missing"
        )
    red = sum(t.state == "watch" for t in fresh) + len(maps)
    if red:
        others = "one other series is red" if red == 1 else f"{red} other series are red"
        return f"Every limit is kept; {others}"
    if state == "accepted":
        return "Every limit is kept or accepted tonight"
    return "Every limit is kept tonight"


def _headline_without_limits(red: Sequence[ToldCause]) -> str:
    """Of histories that other tools measured: whatever is red, on the newest night or before it."""
    series = len(
        {(hit.series, hit.bad and hit.bad.machine.fingerprint) for cause in red for hit in cause.hits}
    )
    return ("One series is red" if series == 1 else f"{series} series are red") if red else "No series is red"


def summary(book: Book) -> str:
    """Tonight in two sentences."""
    fresh = [(test, t) for test in book.tests for t in test.gates() if t.nights[-1] == book.tonight.index]
    seven = [trend for test, trend in fresh if test.card.seven and trend.state != "none"]
    kept = sum(trend.state != "fail" for trend in seven)
    parts = []
    if seven:
        every = "The one limit" if len(seven) == 1 else f"All {len(seven)} limits"
        verb = "is" if len(seven) == 1 else "are"
        how_many = every if kept == len(seven) else f"{kept} of {len(seven)} limits"
        parts.append(f"{how_many} from the thesis {verb} kept.")
    asked = [(test, t) for test in book.tests for t in test.trends if t.nights[-1] == book.tonight.index]
    put = {test.name for test, _ in asked}
    ran = {test.name for test, t in asked if not _lacks([t])}
    engine = f"{clean(book.tonight.engine.name)} {version(book.tonight.engine)}"
    lacking = len(put) - len(ran)
    beside = f"; {lacking} {'needs' if lacking == 1 else 'need'} what it does not support" if lacking else ""
    parts.append(f"{len(ran)} {'test' if len(ran) == 1 else 'tests'} ran on {engine}{beside}.")
    missed = [test for test in book.tests if test.gates() and test.name not in put]
    if missed:
        parts.append(f"{len(missed)} {'was' if len(missed) == 1 else 'were'} not run tonight.")
    return " ".join(parts)


def _worse_than_expected(book: Book) -> int:
    """How many failures that are expected became worse."""
    return [t.told.nights[-1].verdict.name for t in tonight(book)].count(WORSE_THAN_EXPECTED)


def _blamed(new: Sequence[ToldCause], old: Sequence[ToldCause], recovered: int, worse: int) -> str:
    """How many causes there are, new apart from old; how many failures that are expected became worse; what recovered."""
    parts = []
    if new:
        parts.append(_worsened(new))
    elif old and not worse:
        parts.append("Nothing became worse tonight.")
    if worse:
        parts.append(f"{worse} expected {'failure is' if worse == 1 else 'failures are'} worse than before.")
    if old:
        parts.append(
            "One earlier cause is still red."
            if len(old) == 1
            else f"{len(old)} earlier causes are still red."
        )
    if recovered:
        parts.append("One series recovered." if recovered == 1 else f"{recovered} series recovered.")
    return " ".join(parts)


def _worsened(new: Sequence[ToldCause]) -> str:
    """One commit broke 12 limits tonight."""
    made = "One commit" if len(new) == 1 else f"{len(new)} commits"
    counts = Counter[str]()
    for cause in new:
        counts.update(dict(damage_of(cause.fresh)))
        counts["series"] += len(cause.fresh)
    for words, did in (("limit broken", "broke {} limit"), ("value lost", "lost {} value")):
        if number := counts[words.replace(" ", "s ")] + counts[words]:
            return (
                f"{made} {did.format('one' if number == 1 else number)}{'' if number == 1 else 's'} tonight."
            )
    series = counts["series"]
    return f"{made} made {'one' if series == 1 else series} series worse tonight."


def _step_words(step: float | None) -> str:
    if step is None:
        return ""
    inverse = 1.0 / step
    return f"1/{round(inverse)} s" if abs(inverse - round(inverse)) < 1e-6 * inverse else quantity(step, "s")


def said(state: Class) -> str:
    """The word of a class of nights."""
    return CLASSES[state][1]


RED: tuple[Class, ...] = ("fail", "watch")
QUIET: tuple[Class, ...] = ("pass", "followed", "none")  # the best first


class HeatRun(TypedDict):
    """Nights of equal verdict beside each other."""

    state: Class
    x: str
    width: str
    told: str
    places: list[float]


class HeatRow(TypedDict):
    """A test over nights, or several alike."""

    title: str
    address: str
    y: int
    runs: list[HeatRun]


class Heat(TypedDict):
    """Tests against nights, as the template draws it."""

    columns: Sequence[Night]
    rows: list[HeatRow]
    ticks: list[tuple[float, str]]
    width: int
    height: int
    left: int
    first: int
    description: str


def heat(book: Book, *, folded: bool = False) -> Heat:
    """Tests against nights: cells of equal verdict beside each other are one bar.

    Folded, only the tests of the thesis and those that were red have a row, the others share one.
    """
    shown = book.nights[-HEAT_NIGHTS:]
    first = shown[0].index if shown else 0
    left, step = 168.0, min(30.0, 700.0 / max(1, len(shown)))
    lines = [(test, [night_state(test, night.index) for night in shown]) for test in book.tests]
    apart = _told_apart(lines) if folded else {test.name for test in book.tests}
    named = [(clean(test.card.title), address(test), states) for test, states in lines if test.name in apart]
    rest = [states for test, states in lines if test.name not in apart]
    for red, words in ((False, "none red"), (True, "red before")):
        if alike := [states for states in rest if _ever_red(states) == red]:
            night = zip(*alike, strict=True)
            together = [worst(states) if red else min(states, key=QUIET.index) for states in night]
            named.append((f"{len(alike)} {'others' if named else 'tests'}, {words}", "#others", together))
    rows: list[HeatRow] = []
    for i, (title, where, states) in enumerate(named):
        runs: list[HeatRun] = []
        for state, group in groupby(range(len(states)), key=states.__getitem__):
            places = list(group)
            x, width = left + places[0] * step, step * len(places) - 2.0
            days = [day(shown[places[0]].started), day(shown[places[-1]].started)]
            told = f"{' to '.join(dict.fromkeys(days))}: {said(state)}"
            if len(places) == 1:
                told = f"{told} {short_hash(shown[places[0]].engine)}".rstrip()
            marks = [round(left + place * step + (step - 2.0) / 2.0, 1) for place in places]
            runs.append(
                {"state": state, "x": _short(x), "width": _short(width), "told": told, "places": marks}
            )
        title = title if len(title) < 25 else title[:23] + "…"
        rows.append({"title": title, "address": where, "y": 22 + 22 * i, "runs": runs})
    every = max(1, math.ceil(46.0 / step))
    ticks = [
        (round(max(left + j * step + step / 2.0 - 1.0, left + 17.0), 2), day(night.started)[5:])
        for j, night in reversed(list(enumerate(shown)))
        if (len(shown) - 1 - j) % every == 0
    ]
    return {
        "columns": shown,
        "rows": rows,
        "ticks": ticks,
        "width": round(left + max(step * len(shown), 46.0) + 4.0),
        "height": 26 + 22 * len(rows),
        "left": round(left),
        "first": first,
        "description": f"{len(book.tests)} tests over {len(shown)} nights; "
        f"{sum(len(r['places']) for x in rows for r in x['runs'] if r['state'] == 'fail')} red.",
    }


def _ever_red(states: Sequence[Class]) -> bool:
    return not set(states) <= set(QUIET)


def _told_apart(lines: Sequence[tuple[TestHistory, list[Class]]]) -> set[str]:
    """The tests of the thesis and those that were red, the most recent if there are many."""
    red = [(test.name, states) for test, states in lines if not test.card.seven and _ever_red(states)]

    def since(line: tuple[str, list[Class]]) -> int:
        return next(place for place, state in enumerate(reversed(line[1])) if state not in QUIET)

    recent = {name for name, _ in sorted(red, key=since)[:MOST_RED]}
    return recent | {test.name for test, _ in lines if test.card.seven}


def _short(value: float) -> str:
    """A coordinate with one decimal, if it has any."""
    return f"{value:.1f}".removesuffix(".0")


def night_state(test: TestHistory, night: int) -> Class:
    """The verdict of a test on one night: the worst of its series, as the judge says."""
    places = ((trend, place_of(trend, night)) for trend in test.trends)
    return worst(trend.state_at(place) for trend, place in places if place is not None)


def place_of(trend: Trend, night: int) -> int | None:
    """Where a night stands in a series, if it does."""
    place = bisect_left(trend.nights, night)
    return place if place < len(trend.nights) and trend.nights[place] == night else None
