"""What a test's page says first where it does not pass: the broken limits, since when, and where it is seen."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from spook_tracker.tracker.document.wording import clean, conditions, day, number, pair, quantity, short_hash
from spook_tracker.tracker.judge.causes import Hit, hits_of
from spook_tracker.tracker.judge.standing import expected

from .motions import Motion, Parting, parting
from .nights import Book, TestHistory, Trend, as_night

MOST_CARDS = 6
MOST_CHARTS = 3


@dataclass(frozen=True)
class Broken:
    """One series that is red tonight."""

    trend: Trend
    hit: Hit | None  # None where history knows no good night before

    @property
    def card(self) -> dict[str, str]:
        """As the page shows it."""
        d = self.trend.definition
        good, bad = (self.hit.good, self.hit.bad) if self.hit else (None, None)
        before = self.hit.before if self.hit else math.nan
        was, now = pair(before, self.trend.value, d.unit)
        return {
            "conditions": conditions(d),
            "state": self.trend.state,
            "now": now if math.isfinite(self.trend.value) else self.trend.outcomes[-1].replace("_", " "),
            "was": was if math.isfinite(before) else "",
            "measure": self.hit.measure if self.hit else "",
            "failure": self.trend.latest.failure if self.trend.latest else "",
            "sentence": self.hit.sentence if self.hit and not self.hit.measure else "",
            "commit": short_hash(bad.engine) if bad else "",
            "subject": clean(bad.engine.subject) if bad else "",
            "author": clean(bad.engine.author) if bad else "",
            "since": day(bad.started) if bad else "",
            "good": short_hash(good.engine) if good else "",
        }


def broken(test: TestHistory) -> list[Broken]:
    """The series to look at, limits before what is only followed, the worst first; none where the test passes."""
    state = test.state
    if state not in ("fail", "watch"):
        return []
    found = []
    for trend in test.trends:
        if trend.state == state:
            hits = [hit for hit in hits_of(trend.told) if hit.standing == "detected"]
            found.append(Broken(trend, hits[-1] if hits else None))

    def rank(one: Broken) -> tuple[bool, bool, float]:
        margin = one.hit.margin if one.hit else math.nan
        d = one.trend.definition
        return not expected(d), d.kind == "ladder", 0.0 if math.isnan(margin) else -margin

    return sorted(found, key=rank)


@dataclass(frozen=True)
class Shown:
    """Where the motion of tonight parts from the last good one."""

    sentence: str
    address: str  # on this page
    commands: tuple[str, ...]


def shown(test: TestHistory, found: Sequence[Broken], book: Book) -> Shown:
    """The sentence, the replay set to its first difference, and the commands that go on from here."""
    hit = next((one.hit for one in found if one.hit and one.hit.good), None)
    name = shlex.quote(test.name)
    commands = [f"tracker trend {name}"]
    if hit is None:
        return Shown("", "", tuple(commands))
    good, bad = as_night(hit.good), as_night(hit.bad)
    versions = short_hash(good.engine), short_hash(bad.engine)
    if all(versions):
        commands = [f"tracker compare {versions[0]} {versions[1]}", f"tracker bisect {name}", *commands]
    motions = {motion.night.id: motion for motion in book.motions[test.name]}
    now, then = motions.get(book.tonight.id), motions.get(good.id)
    if now is None or then is None or now.key == then.key:
        return Shown("", "", tuple(commands))
    apart = parting(now.recorded, then.recorded)
    if apart is None:
        return Shown("", "", tuple(commands))
    return Shown(_sentence(apart, now, then), f"#against={then.key}&at=first", tuple(commands))


def _sentence(apart: Parting, now: Motion, then: Motion) -> str:
    """From .9 s on body 26 of 26 leaves the path it had at 1f2e3d; .76 m apart at the end."""
    of = f"body {apart.body + 1} of {now.recorded.bodies}" if now.recorded.bodies > 1 else "the body"
    commit = short_hash(then.night.engine)
    path = f"the path it had at {commit}" if commit else "its path"
    return (
        f"From {quantity(apart.time, 's', 2)} on {of} leaves {path}: "
        f"{quantity(apart.furthest, 'm', 2)} apart at most, {number(100.0 * apart.share, 2)} % of the picture, "
        f"and {quantity(apart.end, 'm', 2)} at the end."
    )
