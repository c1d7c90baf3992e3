"""Whoever asks what became of a series gets the same word: night, page, feed, trend, comparison, JUnit."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from click import unstyle
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from spook_tracker.tracker.cli.report_compare import compare_markdown, finding_lines
from spook_tracker.tracker.cli.report_junit import junit_of_comparison, junit_of_night
from spook_tracker.tracker.cli.report_trend import trend_lines
from spook_tracker.tracker.document.run_document import RunDocument, Timing
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.website.publish import publish
from tests.synthetic_history import MACHINE, DocumentHistory, document, sample, series

STEPS = (0.1, 0.05)


def night(number: int, pairs: list[Any], version: str = "", **changes: Any) -> RunDocument:
    """The run of one night with these series."""
    empty = document(number)
    engine = replace(empty.engine, version=version) if version else empty.engine
    tests = sorted({definition.test for definition, _ in pairs})
    return replace(
        empty,
        engine=engine,
        tests=tuple(replace(empty.tests[0], name=name, title=name) for name in tests),
        series=tuple(definition for definition, _ in pairs),
        samples=tuple(found for _, found in pairs),
        figures=(),
        maps=(),
        **changes,
    )


def rungs(seconds: float) -> list[Any]:
    """A ladder of two time steps that take so long."""
    found = []
    for h in STEPS:
        definition = series("t", "ladder:e", kind="ladder", time_step=h, unit="m")
        timing = Timing(seconds=(seconds / h, 1.01 * seconds / h), runs_per_repeat=1)
        found.append((definition, sample(definition, h * h, timing=timing)))
    return found


def one(value: float, **facts: Any) -> list[Any]:
    definition = series("t", "m", **{"role": "gate", "limit": 1.0, "unit": "m"} | facts)
    return [(definition, sample(definition, value))]


def seconds(value: float) -> list[Any]:
    definition = series("t", "time", kind="time", better="smaller", unit="s", time_step=None)
    return [(definition, sample(definition, value))]


def red_tonight(runs: list[RunDocument]) -> set[str]:
    return {finding.series for finding in tonight(DocumentHistory(runs), runs[-1]) if finding.red}


def red_on_the_site(runs: list[RunDocument], out: Path) -> set[str]:
    publish(DocumentHistory(runs), out)
    events = json.loads((out / "data" / "regressions.json").read_text())
    return {event["series"] for event in events if event["standing"] == "detected"}


def noise(number: int) -> float:
    return 1.0 + 0.004 * math.sin(7.0 * number)


def test_a_release_among_nights_that_stand_still_counts_for_night_and_page(tmp_path: Path) -> None:
    """Creep to 1.5 %, five flat nights with a release among them, creep to 3 %; the tolerance is 2 %."""
    creep = [1.0 + 0.015 * min(n, 15) / 15 for n in range(20)]
    creep += [1.015 * (1.0 + 0.0148 * (n + 1) / 16) for n in range(16)]
    runs = [
        night(n, one(0.5 * share, relative_tolerance=0.02), {0: "1.0.0", 17: "1.1.0"}.get(n, f"1.0.1.dev{n}"))
        for n, share in enumerate(creep)
    ]

    assert red_tonight(runs) == red_on_the_site(runs, tmp_path / "public") == set()


def test_run_times_of_a_ladder_are_red_on_the_page_as_in_the_night(tmp_path: Path) -> None:
    runs = [night(n, rungs(1e-3 * noise(n) * (1.4 if n >= 12 else 1.0))) for n in range(14)]

    assert red_tonight(runs) == red_on_the_site(runs, tmp_path / "public") == {"t/plain/ladder:e:run-time"}
    assert "slower" in (tmp_path / "public" / "regressions.html").read_text()


def test_the_command_and_the_page_compare_alike(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from spook_tracker.tracker.cli.main import main
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.history import History
    from spook_tracker.tracker.store.record import record

    pairs = [(one(0.5) + seconds(1e-3 * noise(n) * (1.4 if n >= 12 else 1.0))) for n in range(14)]
    runs = [night(n, found) for n, found in enumerate(pairs)]
    database = f"sqlite:///{tmp_path}/t.db"
    with session_on(database) as session:
        for run in runs:
            record(session, run)
    with session_on(database, readonly=True) as session:
        publish(History(session), tmp_path / "public")
    told = json.loads((tmp_path / "public" / "data" / "comparisons.json").read_text())["pairs"]

    for before, after in ((12, 13), (11, 13), (10, 11), (13, 9), (11, 12)):
        asked = ("compare", runs[before].id, runs[after].id, "--db", database)
        shown = CliRunner().invoke(main, [*asked, "--format", "json"])
        _, page = told[json.dumps([runs[before].id, runs[after].id])]
        assert shown.exit_code == page["code"]
        assert json.loads(shown.stdout)["counts"] == page["counts"]
    assert told[json.dumps([runs[12].id, runs[13].id])][1]["code"] == 1


LEVELS = st.sampled_from([0.5, 0.5, 0.5, 0.5004, 0.52, 0.7, 3.0, math.nan])
TIMES = st.sampled_from([1.0, 1.0, 1.0, 1.01, 1.6])


@st.composite
def histories(draw: Any) -> tuple[list[RunDocument], list[Accepted]]:
    """Nights with releases, gaps, machine changes, new definitions, missing tests and NaN."""
    runs: list[RunDocument] = []
    for number in range(draw(st.integers(2, 9))):
        if draw(st.integers(0, 7)) == 0:
            continue  # a gap
        pairs = one(draw(LEVELS), relative_tolerance=0.02, test_version=draw(st.sampled_from("aaaab")))
        bound = series("u", "c", role="companion", set_point=(0.0, 0.6), unit="m")
        if draw(st.integers(0, 5)):
            pairs.append((bound, sample(bound, draw(LEVELS))))
        point = series("u", "stable", role="companion", kind="break_point", better="larger", time_step=None)
        pairs.append((point, sample(point, draw(LEVELS))))
        if draw(st.booleans()):
            pairs += seconds(1e-3 * draw(TIMES))
        if draw(st.integers(0, 4)):
            pairs += rungs(1e-3 * draw(TIMES))
        machine = replace(MACHINE, fingerprint=draw(st.sampled_from("mmmn")))
        version = draw(st.sampled_from(["", "", "1.0.0", "1.1.0"]))
        runs.append(night(number, pairs, version, machine=machine))
    if not runs:
        runs.append(night(0, one(0.5)))
    level = Accepted(series="t/plain/m/*", low=0.6, high=5.0, who="Ada", why="known")
    return runs, [level] if draw(st.booleans()) else []


class Recorded(DocumentHistory):
    """As much of a stored history as the library asks for."""

    def series_keys(self) -> list[str]:
        return sorted({d.key for run in self.documents.values() for d in run.series})

    def resolve(self, name: str) -> RunDocument:
        return self.documents[name]


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(histories())
def test_every_output_says_the_same_of_a_series(
    given_history: tuple[list[RunDocument], list[Accepted]],
) -> None:
    from spook_tracker.tracker.judge.standing import count
    from spook_tracker.tracker.library import trend
    from spook_tracker.tracker.website.causes import causes_of
    from spook_tracker.tracker.website.events import all_events
    from spook_tracker.tracker.website.feed import atom
    from spook_tracker.tracker.website.nights import book
    from spook_tracker.tracker.website.page_index import health

    runs, accepted = given_history
    records: Any = Recorded(runs)
    findings = tonight(records, runs[-1], accepted)
    word = {f.series: f.verdict.word for f in findings}
    name = {f.series: f.name for f in findings if f.red}

    lines = [line for line in map(unstyle, finding_lines(findings)) if line.startswith(("✗ t/", "✗ u/"))]
    assert [line.split("; ")[0] for line in lines] == [f"✗ {key}: {name[key]}" for key in name]

    cases = ElementTree.fromstring(junit_of_night(findings).encode()).iter("testcase")
    failed = {f"{c.get('classname')}/{c.get('name')}" for c in cases if c.find("failure") is not None}
    assert failed == set(name)

    told = book(records, accepted)
    trends = {t.definition.key: t for test in told.tests for t in test.trends}
    last = told.tonight.index
    assert {key: t.told.nights[-1].verdict.word for key, t in trends.items() if t.nights[-1] == last} == word
    events = [e for e in all_events(told) if e.lasting and e.last is told.tonight]
    assert {e.definition.key: e.name for e in events} == name
    state, found = health(told)
    assert (state in ("fail", "watch")) == bool(name)
    assert found == count(
        (next(d for d in runs[-1].series if d.key == s.series), s) for s in runs[-1].samples
    )

    causes = causes_of(told)
    lasting = [(hit.series, cause) for cause in causes for hit in cause.hits if hit.end is None]
    assert {key for key, _ in lasting if key in word} == set(name)
    entries = [e for e in ElementTree.fromstring(atom(told, causes)) if e.tag.endswith("entry")]
    texts = [" ".join(e.text or "" for e in entry.iter()) for entry in entries]
    for event in events:  # a cause is named by the night it came: a red series may be called otherwise by now
        cause = next(cause for key, cause in lasting if key == event.definition.key)
        worst = f"{cause.worst.name}: {cause.worst.series}"
        assert any(worst in text and event.definition.test in text for text in texts)

    for test in {key.partition("/")[0] for key in word}:
        for series_told in trend(records, test, None, accepted):
            if series_told.key in word and series_told.nights[-1].night.run.id == runs[-1].id:
                assert series_told.nights[-1].verdict.word == word[series_told.key]
                assert ("✗ red" in trend_lines(series_told, 1)[-1]) == (series_told.key in name)

    if len(runs) > 1:
        _compares_alike(records, runs, accepted, told, {f.series: f for f in findings})


def _compares_alike(
    records: Any, runs: list[RunDocument], accepted: list[Accepted], told: Any, findings: dict[str, Any]
) -> None:
    """Command and page, every format; and the night, where it was compared with the night before."""
    from spook_tracker.tracker.library import compare
    from spook_tracker.tracker.website.comparisons import comparisons

    before, after = runs[-2].id, runs[-1].id
    document = compare(records, before, after, accepted)
    page = comparisons(records, told, accepted, {}).pairs[json.dumps([before, after])]
    assert (page["code"], page["counts"]) == (document.exit_code, document.counts)
    red = [change for change in document.changes if change.red]
    assert sum(bool(change[1]) for change in page["changes"]) == len(red)
    markdown = compare_markdown(document)
    cases = ElementTree.fromstring(junit_of_comparison(document).encode()).iter("failure")
    assert len(list(cases)) == len(red)
    assert all((change.name or change.word).split()[0] in markdown for change in red)
    for change in document.changes:
        finding = findings.get(change.series)
        judged = finding.judged if finding else None
        if judged is None or judged.against is None or judged.against.run.id != before:
            continue
        if judged.verdict.name in ("drift", "flip-flop") or change.word == "accepted":
            continue  # what only a longer look than two runs can know
        if judged.usual is None:
            assert change.word == judged.verdict.word, change.series
        elif change.kind in ("time", "run_time"):
            assert change.red == finding.red, change.series
