"""One line for each cause: what became worse together, and with which commits.

A fault in one place reddens a hundred series at once. Every worsening of a series is blamed on a range of
commits, after the last good run and up to the first bad one; worsenings that end at one run share a cause,
and the narrowest of their ranges is the cause's. A series that becomes worse twice belongs to two causes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from spook_tracker.tracker.document.run_document import Point, Run, Runs, SeriesDefinition
from spook_tracker.tracker.document.wording import number, times

from .events import name_of
from .judged import Judged, blame
from .repeats import Nights
from .series_history import Told
from .standing import expected
from .tonight import Finding, least_of_none
from .verdict import limit_ratio, worse_times
from .vocabulary import CLASS_RANK, Class

Standing = Literal["detected", "accepted", "recovered"]
STANDINGS: tuple[Standing, ...] = ("detected", "accepted", "recovered")  # the worst first


@dataclass(frozen=True, slots=True, kw_only=True)
class Hit:
    """One series that became worse, or one stability map."""

    series: str
    test: str
    definition: SeriesDefinition | None  # None for a map
    name: str  # what happened: "limit crossed", "slower"
    sentence: str
    stands: Class
    before: float  # in the last good run; NaN if there is none, or for a map
    value: float  # in the first bad run
    good: Run | None  # the last good run; None if history knows none
    bad: Run | None  # the first bad run; None where only a comparison knows
    standing: Standing
    end: Run | None = None  # the run where it came back or was accepted; None while it lasts
    told: Run | None = None  # the run whose verdict said it first: of a run time perhaps some nights later

    @property
    def margin(self) -> float:
        """How many times its limit the value is, or the value before where it has no limit to be outside of.

        Infinite where there is no value; NaN where neither says how bad it is. Used to rank, and to be shown.
        """
        if self.definition is None:
            return math.nan
        return worse_times(self.definition, self.stands == "fail", self.before, self.value)

    @property
    def of_limit(self) -> bool:
        """Whether the margin is in limits."""
        d = self.definition
        return self.stands == "fail" and d is not None and not math.isnan(limit_ratio(d, self.value))

    @property
    def measure(self) -> str:
        """The margin in words, empty where there is none."""
        d, margin = self.definition, self.margin
        if math.isinf(margin):
            return "no value"
        if math.isnan(margin) or d is None or (d.kind == "order" and not self.of_limit):
            return ""
        if self.of_limit:
            return times(margin, "its limit", "beyond its limit")
        if d.reference is not None and d.better != "smaller_magnitude":
            of = number(d.reference)
            return times(margin, f"as far from {of}", f"further from {of}")
        if d.better == "larger" and self.value > 0.0:
            return times(1.0 / margin, "before", "below before")
        return times(margin, "before", "above before")


@dataclass(frozen=True, slots=True)
class Cause:
    """What became worse with one range of commits."""

    good: Run | None  # the last run without it; None if history knows none
    bad: Run | None  # the first run with it
    hits: tuple[Hit, ...]  # the worst first

    @property
    def worst(self) -> Hit:
        return self.hits[0]

    @property
    def tests(self) -> tuple[str, ...]:
        """The tests it hits, the worst first."""
        return tuple(dict.fromkeys(hit.test for hit in self.hits))

    @property
    def standing(self) -> Standing:
        """Detected while any of its series is red; then the least settled of what became of them."""
        return min((hit.standing for hit in self.hits), key=STANDINGS.index)

    @property
    def blame(self) -> str:
        """The commit, or the range of commits, in words."""
        return "since an unknown commit" if self.bad is None else blame(self.bad, self.good)

    @property
    def sentence(self) -> str:
        """The whole cause in one line."""
        series, tests = len(self.hits), len(self.tests)
        count = f"{series} series of {tests} tests" if tests > 1 else f"{series} series of {self.worst.test}"
        worst = f"the worst: {self.worst.series}, {self.worst.name}"
        measure = f" ({self.worst.measure})" if self.worst.measure else ""
        return f"{count}; {self.blame}; {worst}{measure}"


def causes(told: Mapping[str, Told], also: Iterable[Hit] = ()) -> list[Cause]:
    """Every cause in judged histories (`judge_all`): what lasts first, then the newest, then the widest.

    `also` are hits that no history tells: stability maps.
    """
    order = _order(told)
    hits = [*(hit for series in told.values() for hit in hits_of(series)), *also]
    found = _grouped(hits, order)
    return sorted(
        found, key=lambda c: (STANDINGS.index(c.standing), -order.get(_id(c.bad), -1), -len(c.hits))
    )


def causes_tonight(findings: Sequence[Finding]) -> list[Cause]:
    """The causes of what is red in one run: those of tonight first, then those that hit most."""
    hits: list[Hit] = []
    order: dict[str, int] = {}
    new: set[str] = set()
    for finding in findings:
        if not finding.red:
            continue
        if finding.judged is not None and finding.definition is not None:
            hit = _hit(finding.series, finding.definition, finding.judged)
        else:
            hit = Hit(
                series=finding.series, test=finding.test, definition=None, name=finding.name,
                sentence=finding.verdict.sentence, stands=finding.stands, before=math.nan, value=math.nan,
                good=finding.good, bad=finding.bad, standing="detected",
            )  # fmt: skip
        hits.append(hit)
        if hit.good is not None:
            order[_id(hit.good)] = len(order)
        if finding.news:
            new.add(_id(hit.bad))
    found = _grouped(hits, order)
    return sorted(found, key=lambda cause: (_id(cause.bad) not in new, -len(cause.hits)))


def hits_of(told: Told) -> list[Hit]:
    """Every worsening of one series, oldest first, each with what became of it."""
    return [hit for nights, over in told.lanes for hit in _hits_in(told, nights, over)]


def _hits_in(told: Told, nights: Sequence[Judged], over: Judged | None) -> list[Hit]:
    found: list[Hit] = []
    open_from = 0  # hits from here on are of the present red stretch
    last: Point | None = None  # where the series last became worse
    for judged in nights:
        if judged.red:
            if judged.news or open_from == len(found):
                found.append(replace(_hit(told.key, told.definition, judged), told=judged.night.run))
            elif judged.worse_at is not last:  # one more night tells better where it began
                found[-1] = replace(_hit(told.key, told.definition, judged), told=found[-1].told)
            last = judged.worse_at
        elif judged.state == "unjudged":
            continue
        elif judged.state == "accepted" and open_from == len(found):
            found.append(_hit(told.key, told.definition, judged, "accepted"))
            open_from = len(found)
        elif open_from < len(found):
            ended: Standing = "accepted" if judged.state == "accepted" else "recovered"
            found[open_from:] = [
                replace(hit, standing=ended, end=judged.night.run) for hit in found[open_from:]
            ]
            open_from = len(found)
    if over is not None:
        found[open_from:] = [
            replace(hit, standing="recovered", end=over.night.run) for hit in found[open_from:]
        ]
    return found


def _hit(key: str, definition: SeriesDefinition, judged: Judged, standing: Standing = "detected") -> Hit:
    bad = judged.worse_at or judged.first_bad or judged.night
    good = judged.before_worse or judged.last_good
    before, value = judged.worsening
    if standing == "accepted":
        good = judged.against
        before = judged.levels[0] if judged.levels else good.value if good else math.nan
    return Hit(
        series=key,
        test=definition.test,
        definition=definition,
        name=name_of(judged),
        sentence=judged.verdict.sentence,
        stands=judged.stands,
        before=before,
        value=value,
        good=good.run if good else None,
        bad=bad.run,
        standing=standing,
        end=judged.night.run if standing == "accepted" else None,
    )


def _grouped(hits: Iterable[Hit], order: Mapping[str, int]) -> list[Cause]:
    by_run: dict[str, list[Hit]] = {}
    for hit in hits:
        by_run.setdefault(_id(hit.bad), []).append(hit)
    return [_cause(found, order) for found in by_run.values()]


def _cause(hits: list[Hit], order: Mapping[str, int]) -> Cause:
    """The worst first; the narrowest range is that of the newest run that is good for any of them."""
    goods = [hit.good for hit in hits if hit.good is not None]
    good = max(goods, key=lambda run: order.get(_id(run), -1), default=None)
    return Cause(good=good, bad=hits[0].bad, hits=tuple(sorted(hits, key=_rank)))


def _rank(hit: Hit) -> tuple[int, int, bool, float, str]:
    """Of one class what has a limit before what is only followed, a lost rung says less; then by margin alone."""
    decides = hit.definition is not None and expected(hit.definition)
    return (
        STANDINGS.index(hit.standing),
        CLASS_RANK[hit.stands],
        not decides,
        -least_of_none(hit.margin),
        hit.series,
    )


def _order(told: Mapping[str, Told]) -> dict[str, int]:
    """The place of every run: as in the longest history, runs it lacks after it."""
    place: dict[str, int] = {}
    known: set[Runs] = set()  # most series were measured in the same
    for series in sorted(told.values(), key=lambda found: -len(found.nights)):
        runs = _runs(series.nights)
        if runs not in known:
            known.add(runs)
            for run in runs:
                place.setdefault(run.id, len(place))
    return place


def _runs(nights: Sequence[Judged]) -> Runs:
    return nights.points.runs if isinstance(nights, Nights) else Runs(judged.night.run for judged in nights)


def _id(run: Run | None) -> str:
    return "" if run is None else str(run.id)
