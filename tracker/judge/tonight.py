"""What became of one recorded run, judged against everything recorded before it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from spook_tracker.tracker.document.run_document import MapData, SeriesDefinition
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.events import name_of
from spook_tracker.tracker.judge.lane import Records, histories, line_of
from spook_tracker.tracker.judge.series_history import Judged, Told, blame, commit_of, judge_all
from spook_tracker.tracker.judge.verdict import NEW_DEFINITION, Verdict, judge_map
from spook_tracker.tracker.judge.vocabulary import CLASS_RANK

MOST_NAMED = 8  # tests in one sentence


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
    for other in reversed(line[:-1]):
        if other.machine.float_environment == run.machine.float_environment and records.maps(other.id):
            found = judge_maps(records.maps(other.id), records.maps(run.id))
            findings += [replace(finding, good=other, bad=run) for finding in found]
            break
    return worst_first(findings)


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
        ask = "; to compare, put today's to the old commit: tracker backfill COMMIT" * (why == NEW_DEFINITION)
        said.append(f"not compared, {tests.total()} series of {len(tests)} tests ({named}): {why}{ask}")
    return said


def judge_maps(before: Sequence[MapData], after: Sequence[MapData]) -> list[Finding]:
    """Tonight's stability maps against those of an earlier night."""
    old = {(m.test, m.configuration, m.name): m for m in before}
    findings = []
    for new in after:
        earlier = old.get((new.test, new.configuration, new.name))
        if earlier is None:
            continue
        verdict = judge_map(earlier, new)
        findings.append(
            Finding(
                series=map_key(new),
                definition=None,
                test=new.test,
                judged=None,
                verdict=verdict,
                red=verdict.red,
            )
        )
    return findings


def map_key(stability_map: MapData) -> str:
    """The series key of a map."""
    return f"{stability_map.test}/{stability_map.configuration}/map:{stability_map.name}"
