"""What went wrong, grouped by cause, as pages and the feed tell it: a commit, what it hit, how badly.

The grouping is the judge's (tracker/judge/causes.py); here it becomes words, links and rows.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from spook_tracker.tracker.document.wording import (
    clean,
    conditions,
    limit,
    named,
    pair,
    short_hash,
    version,
)
from spook_tracker.tracker.judge.causes import Cause, Hit, causes
from spook_tracker.tracker.judge.judged import blame
from spook_tracker.tracker.judge.lane import machine_of
from spook_tracker.tracker.judge.maps import map_key
from spook_tracker.tracker.judge.vocabulary import Class

from .motions import SEEN, apart
from .nights import Book, Night, TestHistory, as_night
from .page_rows import address

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import Run

SAID = {"detected": "RED", "accepted": "ACCEPTED", "recovered": "RECOVERED"}
SIGN: dict[str, Class] = {"accepted": "accepted", "recovered": "pass"}


class HitRow(TypedDict):
    """One series, or one map, of a cause as a line of a table."""

    test: str
    address: str
    name: str
    sentence: str
    state: Class
    said: str
    measure: str
    end: Run | None
    what: str
    before: str
    after: str
    limit: str


@dataclass
class HitTest:
    """A test that a cause hits."""

    title: str
    address: str
    state: Class
    series: int


@dataclass
class ToldCause:
    """A cause in words."""

    anchor: str
    state: Class  # FAIL or WATCH while red, else what became of it
    said: str
    standing: str
    fresh: Sequence[Hit]  # what of it is told for the first time tonight
    night: Night
    good: Night | None
    subject: str
    author: str
    blame: str
    damage: list[tuple[str, int]]  # what, how often; nothing that is zero
    tests: list[HitTest]
    worst: HitRow
    replay: str  # where its first wrong moment can be seen; empty where no motion was recorded
    compare: str
    machines: list[str]  # that measured what is shown; none where all nights are of one
    ended: list[Night]  # runs where it came back or was accepted, first and last
    hits: Sequence[Hit]

    @property
    def new(self) -> bool:
        """Whether anything of it is told for the first time tonight, as `tracker judge` counts it."""
        return bool(self.fresh)


def causes_of(book: Book) -> list[Cause]:
    """Every cause of the history: what lasts first, then the newest, then the widest."""
    told = {trend.definition.key: trend.told for test in book.tests for trend in test.trends}
    return causes(told, [hit for test in book.tests for hit in _map_hits(test)])


def _map_hits(test: TestHistory) -> list[Hit]:
    """The stability maps of a test with worse cells than the night before that has them, and those that are gone."""
    return [
        Hit(
            series=told.key,
            test=test.name,
            definition=None,
            name=told.verdict.name,
            sentence=told.verdict.sentence,
            stands=told.stands,
            before=math.nan,
            value=math.nan,
            good=told.good,
            bad=told.bad,
            standing="detected",
            told=told.bad,
        )
        for told in test.told_maps
        if told.verdict.red
    ]


def lasting(found: Sequence[Cause]) -> list[Cause]:
    """What is red tonight: the newest commit first, of one night a broken limit before the rest."""
    return [cause for cause in found if cause.standing == "detected"]


def told(cause: Cause, book: Book) -> ToldCause:
    """A cause in words; its runs are the nights of the book."""
    night, good = as_night(cause.bad), None if cause.good is None else as_night(cause.good)
    red = [hit for hit in cause.hits if hit.standing == "detected"]
    shown = red or list(cause.hits)
    by_test: dict[str, list[Hit]] = {}
    for hit in shown:
        by_test.setdefault(hit.test, []).append(hit)
    known = {test.name: test for test in book.tests}
    failed = any(hit.stands == "fail" for hit in shown)
    state: Class = SIGN.get(cause.standing, "fail" if failed else "watch")
    tests = [
        HitTest(
            title=clean(known[name].card.title),
            address=address(known[name]),
            state="fail" if any(hit.stands == "fail" for hit in hits) else "watch",
            series=len(hits),
        )
        for name, hits in by_test.items()
    ]
    ends = sorted(
        {as_night(hit.end).index: as_night(hit.end) for hit in cause.hits if hit.end is not None}.items()
    )
    return ToldCause(
        anchor=anchor(cause),
        state=state,
        said=SAID[cause.standing],
        standing=cause.standing,
        fresh=[hit for hit in red if hit.told is not None and hit.told.id == book.tonight.id],
        night=night,
        good=good,
        subject=clean(night.engine.subject) or f"Version {version(night.engine)}",
        author=clean(night.engine.author),
        blame=blame(night, good),
        damage=damage_of(shown),
        tests=tests,
        worst=hit_row(shown[0], book),
        replay=_replay(by_test, known, good, book),
        compare=f"compare.html#after={night.id}&before={good.id}" if good is not None else "",
        machines=_machines(shown, book),
        ended=[ends[0][1], ends[-1][1]] if ends else [],
        hits=cause.hits,
    )


def _machines(hits: Sequence[Hit], book: Book) -> list[str]:
    if len({night.machine.fingerprint for night in book.nights}) < 2:
        return []
    return sorted({clean(machine_of(hit.bad)) for hit in hits if hit.bad is not None})


def anchor(cause: Cause) -> str:
    """Where a cause stands on the page of regressions: the same every night."""
    return f"c-{hashlib.sha256(as_night(cause.bad).id.encode('utf-8', 'replace')).hexdigest()[:10]}"


def damage_of(hits: Sequence[Hit]) -> list[tuple[str, int]]:
    gone = sum(hit.definition is None and hit.stands == "fail" for hit in hits)
    maps = sum(hit.definition is None for hit in hits) - gone
    lost = sum(hit.stands == "fail" and not math.isfinite(hit.value) for hit in hits) - gone
    broken = sum(hit.stands == "fail" for hit in hits) - lost - gone
    limits = any(hit.definition is not None and hit.definition.limit is not None for hit in hits)
    counts = [
        ("limit broken" if broken == 1 else "limits broken", broken),
        ("value lost" if lost == 1 else "values lost", lost),
        ("worse, limits kept" if limits else "worse", len(hits) - broken - lost - maps - gone),
        ("stability map lost" if gone == 1 else "stability maps lost", gone),
        ("stability map worse" if maps == 1 else "stability maps worse", maps),
    ]
    return [(words, count) for words, count in counts if count]


def _replay(
    by_test: dict[str, list[Hit]], known: dict[str, TestHistory], good: Night | None, book: Book
) -> str:
    """Where it is seen to go wrong: the first test hit whose motion parts from that of the last good night as far as
    an eye sees, else the one that parts furthest; empty if none does."""
    found: list[tuple[float, str]] = []
    for name in by_test:
        motions = {motion.night.id: motion for motion in book.motions[name]}
        if good is None or good.id not in motions or book.tonight.id not in motions:
            continue
        now, then = motions[book.tonight.id], motions[good.id]
        if now.key != then.key:
            far = apart(now.recorded, then.recorded)
            found.append((min(far, SEEN), f"{address(known[name])}#against={then.key}&at=first"))
    return max(found, key=lambda one: one[0], default=(0.0, ""))[1]


def hit_row(hit: Hit, book: Book) -> HitRow:
    """One series, or one map, of a cause as a line of a table."""
    test = next(t for t in book.tests if t.name == hit.test)
    d = hit.definition
    if d is None:
        found = next((m for m in test.maps if map_key(m) == hit.series), None)
        what = f"map: {found.title} ({found.configuration})" if found else f"map: {hit.series}"
        before = after = "–"
    else:
        what = f"{named(d)[0]} ({conditions(d)})"
        before, after = pair(hit.before, hit.value, d.unit)
        before = before if math.isfinite(hit.before) else "–"
        after = after if math.isfinite(hit.value) else "no value"
    return {
        "test": test.card.title,
        "address": address(test),
        "name": hit.name,
        "sentence": hit.sentence,
        "state": hit.stands if hit.standing == "detected" else SIGN[hit.standing],
        "said": "" if hit.standing == "detected" else SAID[hit.standing],
        "measure": hit.measure,
        "end": hit.end,
        "what": what,
        "before": before,
        "after": after,
        "limit": "" if d is None or d.limit is None else limit(d),
    }


def line(cause: Cause) -> str:
    """A cause in one line of plain text, for the feed: the commit, what it hit, how badly."""
    count, tests = len(cause.hits), len(cause.tests)
    series = "1 series" if count == 1 else f"{count} series"
    damage = ", ".join(f"{number} {words}" for words, number in damage_of(cause.hits))
    engine = as_night(cause.bad).engine
    commit = short_hash(engine) or version(engine)
    subject = f" “{clean(engine.subject)}”" if engine.subject else ""
    return f"{commit}{subject}: {damage} ({series} of {tests} {'test' if tests == 1 else 'tests'})"
