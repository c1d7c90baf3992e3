"""What became of one recorded run, judged against everything recorded before it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from spook_tracker.tracker.document.about import started
from spook_tracker.tracker.document.run_document import Run, SeriesDefinition

from .accepted import Accepted
from .events import name_of
from .explaining import beside_findings
from .judged import Judged, blame, blame_of, commit_of
from .known import judged_in
from .lane import NIGHT, Records, histories, line_of, machine_of, of_version
from .maps import ToldMap, stands_of, told_maps
from .repeats import looked_at
from .series_history import Told, is_noisy, judge_all
from .slower import FLAKY
from .standing import expected
from .verdict import NEW_DEFINITION, Verdict, worse_times
from .vocabulary import CLASS_RANK, WORSE_THAN_EXPECTED, Class, State

MOST_NAMED = 8  # tests in one sentence
HOW_TO_COMPARE = (
    "; to compare, measure the old commit with today's tests: tracker backfill COMMIT, or this engine with the old "
    "ones: tracker judge RUN --old-questions"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What became of one series or map tonight."""

    series: str
    definition: SeriesDefinition | None  # None for a map
    test: str
    judged: Judged | None  # None for a map
    verdict: Verdict
    red: bool
    news: bool = True  # red for a reason of tonight, not only still red
    good: Run | None = None  # of a map: the run it is compared with
    bad: Run | None = None  # of a map: the run it is of, or the first that has lost it
    state: State  # red, accepted, recovered …
    machine: str = ""  # where another than the run's own measured it

    @property
    def name(self) -> str:
        """What happened, in a word or two."""
        return name_of(self.judged) if self.judged else self.verdict.name or self.verdict.word

    @property
    def recovered(self) -> bool:
        """Red at the last verdict, and no longer."""
        return self.state == "recovered"

    @property
    def suspected(self) -> bool:
        """A slow night that no second one has confirmed."""
        return self.state == "suspected"

    @property
    def flaky(self) -> bool:
        """Slower tonight as nights of its level are now and then."""
        return self.verdict.name == FLAKY

    @property
    def worse_than_expected(self) -> bool:
        """Expected to fail, and worse than on the last such night."""
        return self.verdict.name == WORSE_THAN_EXPECTED

    @property
    def stands(self) -> Class:
        """What it stands for tonight."""
        return self.judged.stands if self.judged is not None else stands_of(self.verdict)

    @property
    def margin(self) -> float:
        """How many times worse it became, as of causes; NaN where nothing says so."""
        if self.judged is None or self.definition is None:
            return math.nan
        return worse_times(self.definition, self.stands == "fail", *self.judged.worsening)

    @property
    def _range(self) -> tuple[Run | None, Run | None]:
        """The last good run and the first bad one, each None where history knows none."""
        if self.judged is None:
            return (self.good, self.bad) if self.red else (None, None)
        good, bad = self.judged.before_worse, self.judged.worse_at
        return good and good.run, bad and bad.run

    @property
    def first_bad(self) -> str:
        """The commit where it began, as far as the history knows."""
        _, bad = self._range
        return "" if bad is None else commit_of(bad)

    @property
    def last_good(self) -> str:
        good, _ = self._range
        return "" if good is None else commit_of(good)

    @property
    def blame(self) -> str:
        """The commit or the range of commits it came with, in words; empty if history does not know."""
        if self.judged is not None:
            return blame_of(self.judged)
        good, bad = self._range
        return "" if bad is None else blame(bad, good)


def tonight(
    records: Records,
    run: Run,
    accepted: Sequence[Accepted] = (),
    *,
    version: bool = False,
    others: bool = False,
) -> list[Finding]:
    """Findings of one recorded run against its history (tracker.store.history.History); red first.

    `version`: also of the other runs of its version before it, whatever no later one tells on that machine. `others`:
    also what is red of the last runs of other machines within a day, as far as the run does not say so.
    """
    line = line_of(records.runs(), run)
    told = judge_all(histories(records, line), accepted)
    findings = of_run(told, run.id)
    findings += [_of_map(told) for told in told_maps(records, line, accepted) if told.tonight]
    if version:
        findings = _with_version(line, told, findings)
    if others:
        findings += _on_other_machines(line, told, findings)
    return worst_first(findings)


def _with_version(
    line: Sequence[Run], told: Mapping[str, Told], findings: Sequence[Finding]
) -> list[Finding]:
    """The findings of the last run, and those of earlier runs of its version: of each series on each machine the last."""
    of_last, *before = reversed(of_version(line, line[-1]))
    found = judged_in(told, [run.id for run in before])
    every, seen = (
        {of_last.id: list(findings)},
        {_place(told[f.series], f.judged) for f in findings if f.judged},
    )
    for run in before:
        fresh = {
            key: judged for key, judged in found[run.id].items() if _place(told[key], judged) not in seen
        }
        seen |= {_place(told[key], judged) for key, judged in fresh.items()}
        every[run.id] = beside_findings([_finding(key, told[key], judged) for key, judged in fresh.items()])
    machines = {run.id: machine_of(run) for run in (of_last, *before) if every[run.id]}
    several = len(set(machines.values())) > 1
    return [
        replace(finding, machine=machines[run_id] if several else "")
        for run_id, of_run in every.items()
        for finding in of_run
    ]


def _place(series: Told, judged: Judged) -> tuple[str, str]:
    """A series and where it is judged by itself: times on a machine, values in a float environment."""
    machine = judged.night.run.machine
    return series.key, machine.fingerprint if is_noisy(series.definition) else machine.float_environment


def _on_other_machines(
    line: Sequence[Run], told: Mapping[str, Told], findings: Sequence[Finding]
) -> Iterator[Finding]:
    run = line[-1]
    last = {other.machine.fingerprint: other for other in line}
    night = {
        other.id: machine_of(other)
        for fingerprint, other in last.items()
        if fingerprint != run.machine.fingerprint and abs(started(other) - started(run)) < NIGHT
    }
    if not night:
        return
    said = {finding.series for finding in findings if finding.red and not _of_a_clock(finding)}
    told_of = {(finding.series, id(finding.judged)) for finding in findings}
    for key, series in told.items():
        for judged in looked_at(series.nights):
            here = judged.red and judged.night.run.id in night
            if here and key not in said and (key, id(judged)) not in told_of:
                yield replace(_finding(key, series, judged), machine=night[judged.night.run.id])


def _of_a_clock(finding: Finding) -> bool:
    return finding.definition is not None and finding.definition.kind == "time"


def _of_map(told: ToldMap) -> Finding:
    return Finding(
        series=told.key,
        definition=None,
        test=told.newest.test,
        judged=None,
        verdict=told.verdict,
        red=told.verdict.red,
        news=told.news,
        good=told.good,
        bad=told.bad,
        state=told.state,
    )


def of_run(told: Mapping[str, Told], run_id: str) -> list[Finding]:
    """The findings of the newest run of some judged histories."""
    findings = []
    for key, series in told.items():
        judged = series.nights[-1] if series.nights else None
        if judged is None or judged.night.run.id != run_id:
            continue
        findings.append(_finding(key, series, judged))
    return worst_first(beside_findings(findings))


def _finding(key: str, series: Told, judged: Judged) -> Finding:
    return Finding(
        series=key,
        definition=series.definition,
        test=series.definition.test,
        judged=judged,
        verdict=judged.verdict,
        red=judged.red,
        news=judged.news,
        state=judged.state,
    )


def to_be_timed_again(findings: Sequence[Finding]) -> list[str]:
    """The tests whose run times seem slower than they were: timed once more before that is told."""
    return sorted(
        {
            finding.test
            for finding in findings
            if finding.judged is not None
            and finding.series.endswith(":run-time")
            and (finding.news or finding.judged.state == "suspected")
            and finding.judged.state in ("detected", "suspected")
        }
    )


def least_of_none(margin: float) -> float:
    """For an order: what nothing measures comes last."""
    return 0.0 if math.isnan(margin) else margin


def worst_first(findings: Sequence[Finding]) -> list[Finding]:
    """Red before the rest, FAIL before WATCH, news before what was red already, then what has a limit, then the largest."""

    def rank(finding: Finding) -> tuple[bool, int, bool, bool, float, str]:
        decides = finding.definition is not None and expected(finding.definition)
        size = -least_of_none(finding.margin) if finding.red else 0.0
        return (
            not finding.red,
            CLASS_RANK[finding.stands],
            not finding.news,
            not decides,
            size,
            finding.series,
        )

    return sorted(findings, key=rank)


def not_compared(verdicts: Iterable[tuple[str, Verdict]]) -> list[str]:
    """A sentence for each reason why series of some tests could be compared with nothing: how many, and of which."""
    counts: dict[str, Counter[str]] = {}
    for test, verdict in verdicts:
        if verdict.word == "not_comparable":
            counts.setdefault(verdict.sentence.partition(",")[0], Counter())[test] += 1
    said = []
    for why, tests in sorted(counts.items()):
        named = ", ".join(sorted(tests)[:MOST_NAMED]) + (" …" if len(tests) > MOST_NAMED else "")
        ask = HOW_TO_COMPARE if why == NEW_DEFINITION else ""
        said.append(f"not compared, {tests.total()} series of {len(tests)} tests ({named}): {why}{ask}")
    return said
