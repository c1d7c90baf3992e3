"""Every answer to what became of a series is the same word: night, page, feed, trend, comparison, JUnit."""

from __future__ import annotations

import dataclasses
import json
import math
import random
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

from click import unstyle
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from spook_tracker.tracker.cli.report_compare import compare_markdown, finding_lines
from spook_tracker.tracker.cli.report_junit import junit_of_comparison, junit_of_night
from spook_tracker.tracker.cli.report_trend import summary, trend_lines
from spook_tracker.tracker.document.run_document import RunDocument, Timing
from spook_tracker.tracker.judge.accepted import Accepted
from spook_tracker.tracker.judge.tonight import tonight
from spook_tracker.tracker.library import trend
from spook_tracker.tracker.website.publish import publish
from tests.histories.synthetic import MACHINE, DocumentHistory, document, sample, series
from tests.tracker.judge.night_readers import read_alike
from tests.tracker.judge.recoveries import recovered_alike

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


def rungs(seconds: float, worst: float = STEPS[0] ** 2) -> list[Any]:
    """A ladder of two time steps that take so long; the error of the longer step."""
    found = []
    for h in STEPS:
        definition = series("t", "ladder:e", kind="ladder", time_step=h, unit="m")
        timing = Timing(seconds=(seconds / h, 1.01 * seconds / h), runs_per_repeat=1)
        found.append((definition, sample(definition, worst if h == STEPS[0] else h * h, timing=timing)))
    return found


def order(value: float) -> list[Any]:
    """The order a ladder shows; NaN where fewer than three of its points can be used."""
    definition = series(
        "t", "ladder:e:order", kind="order", role="companion", better="inside", time_step=None, limit=(0.9, 1.1),
        reference=1.0,
    )  # fmt: skip
    return [(definition, judged(definition, value, "fewer than three usable points"))]


def judged(definition: Any, value: float, why_not: str) -> Any:
    """A sample; NaN is a value that was looked for and is missing, as measuring writes it down."""
    if math.isnan(value):
        return sample(definition, value, outcome="missing", failure=why_not)
    return sample(definition, value)


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
    assert told[json.dumps([runs[11].id, runs[13].id])][1]["code"] == 1
    assert told[json.dumps([runs[12].id, runs[13].id])][1]["code"] == 0, "both are slow"


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
        if draw(st.integers(0, 4)):
            kept = series("u", "kept", role="gate", limit=0.6, unit="m")
            value = draw(LEVELS)
            pairs.append((kept, judged(kept, value, "the measurement gave no 'kept'")))
        if draw(st.booleans()):
            pairs += order(draw(st.sampled_from([1.0, 1.0, 1.05, 1.3, math.nan])))
        point = series("u", "stable", role="companion", kind="break_point", better="larger", time_step=None)
        pairs.append((point, sample(point, draw(LEVELS))))
        if draw(st.booleans()):
            pairs += seconds(1e-3 * draw(TIMES))
        if draw(st.integers(0, 4)):
            pairs += rungs(1e-3 * draw(TIMES), draw(st.sampled_from([0.01, 0.01, 0.02, math.nan])))
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
    say_the_same(*noted(*given_history))


def timed_history(seed: int, nights: int) -> tuple[list[RunDocument], list[Accepted]]:
    """Run times on three machines, each with a level and noise of its own; steps come to all of them or to one."""
    draws = random.Random(seed)
    level = {"m": 1.0, "n": 1.7, "o": 0.4}
    runs: list[RunDocument] = []
    for number in range(nights):
        if draws.random() < 0.15:
            step = draws.choice([0.7, 1.05, 1.3, 1.6])
            struck = draws.choice([list(level), [draws.choice("mno")]])
            level |= {machine: level[machine] * step for machine in struck}
        machine = draws.choice("mmmmnno")
        value = 1e-3 * level[machine] * draws.gauss(1.0, 0.005) * draws.choice([1.0] * 19 + [1.5])
        pairs = seconds(value) + (rungs(value) if draws.random() < 0.8 else [])
        version = draws.choice(["", "", "", "1.0.0"])
        runs.append(night(number, pairs, version, machine=replace(MACHINE, fingerprint=machine)))
    accepted = [Accepted(series="t/*", low=1.2e-3, high=5.0, who="Ada", why="known")]
    return runs, accepted if draws.random() < 0.3 else []


@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**6), st.integers(8, 24))
def test_every_output_says_the_same_of_run_times_on_several_machines(seed: int, nights: int) -> None:
    say_the_same(*noted(*timed_history(seed, nights)))


def test_every_output_says_that_a_run_time_recovered() -> None:
    """Slow for six nights and back: the second night at the old level ends it."""
    slow = [1.6 if 14 <= n < 20 else 1.0 for n in range(22)]
    runs = [night(n, seconds(1e-3 * noise(n) * by) + one(0.4 + 0.2 * (n == 20))) for n, by in enumerate(slow)]

    assert {f.series for f in tonight(DocumentHistory(runs), runs[-1]) if f.recovered} == {
        "t/plain/time",
        "t/plain/m/h=0.0166667",
    }
    say_the_same(runs, [])


def noted(runs: list[RunDocument], accepted: list[Accepted]) -> tuple[list[RunDocument], list[Accepted]]:
    """The same, told where a test fails on it."""
    samples = (
        f"{r.id} {r.engine.version} {[(s.series, s.value, s.outcome) for s in r.samples]}" for r in runs
    )
    note("\n".join(samples))
    return runs, accepted


def say_the_same(runs: list[RunDocument], accepted: list[Accepted]) -> None:
    """Night, JUnit, JSON, Markdown, page, feed, badge, trend, comparison."""
    from spook_tracker.tracker.judge.standing import worst
    from spook_tracker.tracker.website.causes import causes_of
    from spook_tracker.tracker.website.events import all_events
    from spook_tracker.tracker.website.feed import atom
    from spook_tracker.tracker.website.nights import book
    from spook_tracker.tracker.website.page_index import health
    from spook_tracker.tracker.website.page_index import recovered as page_recovered

    records: Any = Recorded(runs)
    findings = tonight(records, runs[-1], accepted)
    word = {f.series: f.verdict.word for f in findings}
    name = {f.series: f.name for f in findings if f.red}
    recovered = {f.series for f in findings if f.recovered}

    lines = [line for line in map(unstyle, finding_lines(findings)) if line.startswith(("✗ t/", "✗ u/"))]
    assert [line.split("; ")[0] for line in lines] == [f"✗ {key}: {name[key]}" for key in name]

    cases = list(ElementTree.fromstring(junit_of_night(findings).encode()).iter("testcase"))
    failed = {f"{c.get('classname')}/{c.get('name')}" for c in cases if c.find("failure") is not None}
    assert failed == set(name)
    recovered_alike(findings, recovered, cases, trend, records, accepted)

    told = book(records, accepted)
    trends = {t.definition.key: t for test in told.tests for t in test.trends}
    last = told.tonight.index
    assert {key: t.told.nights[-1].verdict.word for key, t in trends.items() if t.nights[-1] == last} == word
    events = [e for e in all_events(told) if e.lasting and e.last is told.tonight]
    assert {e.definition.key: e.name for e in events} == name
    state, found = health(told)
    stands = {f.series: f.judged.stands for f in findings if f.judged}
    assert {key: t.state for key, t in trends.items() if t.nights[-1] == last} == stands
    expects = found.expected > 0
    assert state == worst(stands.values()) or (state == "none" and not expects)
    assert (state in ("fail", "watch")) == bool(name)
    assert state == "fail" or not any(stands[key] == "fail" for key in name)
    _counts_alike(runs, told, stands, name)

    assert page_recovered(told) == len(recovered)
    causes = causes_of(told)
    tests = sorted({key.partition("/")[0] for key in word})
    every = [one for test in tests for one in trend(records, test, None, accepted)]
    read_alike(runs[-1], findings, every, told, causes)
    ended = {h.series for c in causes for h in c.hits if h.end is not None and h.end is told.tonight}
    assert recovered <= ended
    here = runs[-1].machine.fingerprint  # what is red on another machine lasts there
    lasting = [
        (hit.series, cause)
        for cause in causes
        for hit in cause.hits
        if hit.end is None and (not on_a_clock(hit) or hit.bad.machine.fingerprint == here)
    ]
    assert {key for key, _ in lasting if key in word} == set(name)
    entries = [e for e in ElementTree.fromstring(atom(told, causes)) if e.tag.endswith("entry")]
    texts = [" ".join(e.text or "" for e in entry.iter()) for entry in entries]
    for event in events:  # a cause is named by the night it came: a red series may be called otherwise by now
        cause = next(cause for key, cause in lasting if key == event.definition.key)
        worst = f"{cause.worst.name}: {cause.worst.series}"
        assert any(worst in text and event.definition.test in text for text in texts)

    for test in tests:
        trends_told = [one for one in every if one.definition.test == test]
        assert summary(trends_told).startswith("\x1b[32m✓") == (
            not any(found.nights[-1].red for found in trends_told)
        )
        for series_told in trends_told:
            machines = {j.night.run.machine.fingerprint for j in series_told.nights}
            noisy = series_told.definition.kind == "time"
            drawn = sum("(values: " in line or ", values: " in line for line in trend_lines(series_told))
            assert drawn == (len(machines) if noisy else 1)
            if series_told.key in word and series_told.nights[-1].night.run.id == runs[-1].id:
                assert series_told.nights[-1].verdict.word == word[series_told.key]
                assert ("✗ red" in "".join(trend_lines(series_told, 1))) == (series_told.key in name)

    if len(runs) > 1:
        _compares_alike(records, runs, accepted, told, {f.series: f for f in findings})


def on_a_clock(hit: Any) -> bool:
    return hit.definition is not None and hit.definition.kind == "time"


def without_lost(found: Any) -> Any:
    """The table of versions says only what is expected; a value that is only followed is not in it."""
    return dataclasses.replace(found, lost=0)


def _counts_alike(runs: list[RunDocument], told: Any, stands: dict[str, Any], red: dict[str, str]) -> None:
    """The command that shows a run, the badge, the heat map and the page count one number of limits."""
    from spook_tracker.tracker.cli.report_table import pairs, verdict, word
    from spook_tracker.tracker.judge.standing import count, worst
    from spook_tracker.tracker.judge.vocabulary import CLASSES
    from spook_tracker.tracker.website.feed import badge_words
    from spook_tracker.tracker.website.page_index import counts_by_night, health, heat, said

    _, found = health(told)
    assert found == count(pairs(runs[-1]))
    assert without_lost(found) == without_lost(counts_by_night(told, 1)[told.tonight.index])
    printed = unstyle(verdict(runs[-1]))
    if found.red:
        assert printed.startswith(f"✗ red: {found.broken} of {found.limits} limits broken")
        assert ("set points left" in printed) == (found.left > 0)
    elif found.expected:
        assert f"all {found.expected} limits" in printed or (found.expected == 1 and "one limit" in printed)
    assert badge_words(found) == f"{found.limits - found.broken} of {found.limits} limits kept"

    signs = {name: f"{mark} {called}" for name, (mark, called, _) in CLASSES.items()}
    for definition, measured in pairs(runs[-1]):
        shown, page = word(definition, measured), stands[definition.key]
        if page == "accepted":
            continue  # what was accepted, the bare number does not know
        if definition.key not in red:
            assert shown == signs[page], definition.key
        else:  # what only became worse than before, the bare number does not know either
            assert (shown == signs["fail"]) <= (page == "fail"), definition.key
            assert page == "fail" or shown in (signs["watch"], signs["pass"], signs["followed"])

    last = told.tonight.index
    for test, row in zip(told.tests, heat(told)["rows"], strict=True):
        tonight = [t.state for t in test.trends if t.nights[-1] == last]
        run = row["runs"][-1]
        assert (run["state"], run["told"].split(": ")[1].split(" ")[0]) == (
            worst(tonight),
            said(worst(tonight)).split(" ")[0],
        )


def test_an_order_that_cannot_be_read_is_a_broken_limit_for_the_command_and_for_the_page(
    tmp_path: Path,
) -> None:
    """The order of a ladder with fewer than three usable points is recorded as missing."""
    runs = [night(0, one(0.5) + order(1.0)), night(1, one(0.5) + order(math.nan))]

    publish(DocumentHistory(runs), tmp_path / "public")

    from spook_tracker.tracker.cli.report_table import verdict

    assert unstyle(verdict(runs[-1])).startswith("✗ red: 1 of 2 limits broken")
    assert json.loads((tmp_path / "public" / "badge.json").read_text())["message"] == "1 of 2 limits kept"
    assert "One limit is broken tonight" in (tmp_path / "public" / "index.html").read_text()


def test_a_series_that_was_not_measured_is_no_limit_of_that_run(tmp_path: Path) -> None:
    """What the history adds, because it was asked for and not answered, the command that shows a run cannot count."""
    runs = [night(0, one(0.5) + order(1.0)), night(1, one(0.5))]

    publish(DocumentHistory(runs), tmp_path / "public")

    assert json.loads((tmp_path / "public" / "badge.json").read_text())["message"] == "1 of 1 limits kept"


def test_an_order_that_moved_in_its_ninth_digit_is_not_called_wrong(tmp_path: Path) -> None:
    """Nearer to 2 is nearer; farther from it by one in the ninth digit is said to be that, and with its digits."""
    near, far = 1.98444647, 1.98444646
    facts: dict[str, Any] = {"reference": 2.0, "limit": (1.9, 2.1)}
    runs = [
        night(n, [(replace(order(1.0)[0][0], **facts), order(value)[0][1])])
        for n, value in enumerate((near, near, far))
    ]

    publish(DocumentHistory(runs), tmp_path / "public")
    (line,) = [line for line in finding_lines(tonight(DocumentHistory(runs), runs[-1])) if "✗ t/" in line]
    pages = " ".join(page.read_text() for page in (tmp_path / "public").rglob("*.html"))

    assert "further from its order; 1.98444647 → 1.98444646" in line
    for text in (line, pages):
        assert "wrong order" not in text
        assert "1.98445 → 1.98445" not in text


def test_a_run_time_that_fell_is_not_slower(tmp_path: Path) -> None:
    runs = [night(n, rungs(1e-3 * noise(n) * (0.45 if n >= 12 else 1.0))) for n in range(14)]

    assert red_tonight(runs) == red_on_the_site(runs, tmp_path / "public") == set()
    found = {f.series: f for f in tonight(DocumentHistory(runs), runs[-1])}
    assert found["t/plain/ladder:e:run-time"].verdict.word in ("improved", "same")
    assert not any("slower" in line for line in finding_lines(list(found.values())))
    assert "slower" not in (tmp_path / "public" / "regressions.html").read_text()


def test_the_first_night_of_a_database_does_not_hold_its_level() -> None:
    runs = [night(0, one(0.5) + order(1.0) + rungs(1e-3))]

    lines = " ".join(finding_lines(tonight(DocumentHistory(runs), runs[-1])))

    assert "hold" not in lines
    assert "measured for the first time" in lines


def test_a_rung_that_became_nan_turns_the_cell_of_its_test_red() -> None:
    from spook_tracker.tracker.website.nights import book
    from spook_tracker.tracker.website.page_index import heat

    runs = [night(0, rungs(1e-3)), night(1, rungs(1e-3, math.nan))]
    records: Any = Recorded(runs)

    (row,) = heat(book(records))["rows"]

    assert [run["state"] for run in row["runs"]] == ["followed", "fail"]


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


def test_trend_tells_machines_and_changed_trees_apart_and_what_is_red_elsewhere() -> None:
    runs = []
    for number in range(20):
        machine = "mn"[number % 2]
        slow = 1.4 if machine == "m" and number >= 14 else 1.0
        empty = night(
            number, seconds(1e-3 * noise(number) * slow), machine=replace(MACHINE, fingerprint=machine)
        )
        runs.append(replace(empty, engine=replace(empty.engine, dirty=number == 19)))

    (told,) = trend(Recorded(runs), "t", "time")  # type: ignore[arg-type]
    first, *beside = unstyle(summary([told])).splitlines()
    rows = [unstyle(line) for line in trend_lines(told)]

    assert first == "✓ 1 series, none of them red tonight"
    (elsewhere,) = beside
    assert elsewhere.startswith("! red when another machine was last asked: t/plain/time, slower, ")
    assert elsewhere.endswith(" (m)")
    assert sum("values: 10" in row for row in rows) == 2
    assert [" changed " in row for row in rows if row.startswith("20")] == [False] * 9 + [True]
    assert any("✗ red" in row and " m " in row for row in rows)
