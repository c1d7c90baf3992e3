"""What became of one recorded run, judged against everything recorded before it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from spook_tracker.tracker.document.run_document import MapData, SeriesDefinition
from spook_tracker.tracker.judge.accepted import Accepted, acceptance
from spook_tracker.tracker.judge.events import name_of
from spook_tracker.tracker.judge.lane import RECENT, Records, asked_for, histories, line_of
from spook_tracker.tracker.judge.series_history import (
    Judged,
    Told,
    blame,
    commit_of,
    judge_all,
    night_of,
)
from spook_tracker.tracker.judge.verdict import NEW_DEFINITION, Verdict, judge_map
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK

MOST_NAMED = 8  # tests in one sentence
HOW_TO_COMPARE = (
    "; to compare, put today's to the old commit: tracker backfill COMMIT, or the old ones to today's engine: "
    "tracker judge RUN --old-questions"
)
NO_MAP = Verdict(word="missing", sentence="a stability map asked for and not answered", name="missing")


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
    good: Any = None  # of a map: the run it is compared with
    bad: Any = None  # of a map: the run it is of

    @property
    def name(self) -> str:
        """What happened, in a word or two."""
        return name_of(self.judged) if self.judged else self.verdict.name or self.verdict.word

    @property
    def first_bad(self) -> str:
        """The commit where it began, as far as the history knows."""
        if self.judged is None or self.judged.first_bad is None:
            return ""
        return commit_of(self.judged.first_bad.run)

    @property
    def last_good(self) -> str:
        if self.judged is None or self.judged.last_good is None:
            return ""
        return commit_of(self.judged.last_good.run)

    @property
    def blame(self) -> str:
        """The commit or the range of commits it came with, in words; empty if history does not know."""
        if self.judged is None or self.judged.first_bad is None:
            return ""
        good = self.judged.last_good
        return blame(self.judged.first_bad.run, good.run if good else None)


def tonight(records: Records, run: Any, accepted: Sequence[Accepted] = ()) -> list[Finding]:
    """Findings of one recorded run against its history (tracker.store.history.History); red first."""
    line = line_of(records.runs(), run)
    findings = of_run(judge_all(histories(records, line), accepted), run.id)
    findings += _of_maps(records, line, run, accepted)
    return worst_first(findings)


def is_newest(records: Records, run: Any) -> bool:
    """Whether no later run of its engine is known: the maps of others may have been dropped, which is no answer lost."""
    of_engine = [other.id for other in records.runs() if other.engine.name == run.engine.name]
    return not of_engine or of_engine[-1] == run.id


def _of_maps(records: Records, line: Sequence[Any], run: Any, accepted: Sequence[Accepted]) -> list[Finding]:
    """Each stability map against the last run that has it: one that is not there any more stays missing."""
    asked = asked_for(run, {} if run.asked is not None else records.samples(run.id)).get("stability", set())
    if not is_newest(records, run):
        asked = set()
    maps, seen, findings = records.maps(run.id), set[str](), list[Finding]()
    for other in reversed(line[-RECENT:-1]):
        if other.machine.float_environment != run.machine.float_environment:
            continue
        earlier = [found for found in records.maps(other.id) if map_key(found) not in seen]
        seen.update(map(map_key, earlier))
        for finding in judge_maps(earlier, maps, asked):
            gone = finding.verdict.word == "missing"
            taken = (
                acceptance(accepted, finding.series, math.nan, night_of(run), removed=True) if gone else None
            )
            if taken is not None:
                known = replace(finding.verdict, word="accepted", name="")
                finding = replace(finding, verdict=known, red=False)
            findings.append(replace(finding, good=other, bad=run))
    return findings


def of_run(told: Mapping[str, Told], run_id: str) -> list[Finding]:
    """The findings of the newest run of some judged histories."""
    findings = []
    for key, series in told.items():
        judged = series.nights[-1] if series.nights else None
        if judged is None or judged.night.run.id != run_id:
            continue
        findings.append(
            Finding(
                series=key,
                definition=series.definition,
                test=series.definition.test,
                judged=judged,
                verdict=judged.verdict,
                red=judged.red,
                news=judged.news,
            )
        )
    return worst_first(findings)


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


def worst_first(findings: Sequence[Finding]) -> list[Finding]:
    """Red before the rest, FAIL before WATCH, news before what was red already."""

    def rank(finding: Finding) -> tuple[bool, int, bool, str]:
        stands = CLASS_RANK[finding.judged.stands] if finding.judged else CLASS_RANK["watch"]
        return not finding.red, stands, not finding.news, finding.series

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


def judge_maps(
    before: Sequence[MapData], after: Sequence[MapData], asked: Collection[str] = ()
) -> list[Finding]:
    """Tonight's stability maps against those of an earlier night; `asked` are the tests asked for stability tonight."""
    new = {map_key(found): found for found in after}
    findings = []
    for old in before:
        key = map_key(old)
        if key in new:
            verdict = judge_map(old, new[key])
        elif old.test in asked:
            verdict = NO_MAP
        else:
            continue
        findings.append(
            Finding(series=key, definition=None, test=old.test, judged=None, verdict=verdict, red=verdict.red)
        )
    return findings


def map_key(stability_map: MapData) -> str:
    """The series key of a map."""
    return f"{stability_map.test}/{stability_map.configuration}/map:{stability_map.name}"
