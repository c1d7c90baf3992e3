"""A change measured beside its base: what is exact is compared exactly, what differs between processes is not."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from spook_tracker.tracker.cli.change import _usual
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import Asked, RunDocument, Timing
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument
from spook_tracker.tracker.judge.pairs import BLOCKS, usual_spread
from spook_tracker.tracker.library import History, record
from spook_tracker.tracker.measure.commits import CommitError
from spook_tracker.tracker.pairs import compare_by_pairs
from tests.histories.documents import definition, engine, run, sample
from tests.team.repository import GRAVITY, SETTINGS, Pebble, git, needs_compiler

VALUE, RUNG = "pendulum/plain/length_deviation/h=0.0166667", "pendulum/plain/ladder:error/h=0.01"
RUN_TIME = "pendulum/plain/ladder:error:run-time"
BASE, CHANGE = "a" * 40, "b" * 40


class Side:
    """An engine of one commit; each call is a fresh process."""

    def __init__(self, commit: str, **said: Any) -> None:
        self.commit, self.said, self.calls = commit, said, 0

    def __call__(self, tests: Sequence[str]) -> RunDocument:
        self.calls += 1
        value, seconds = self._next("value", 0.4), self._next("seconds", 0.01)
        counters = self.said.get("counters", {"block_operations": 600})
        timing = Timing(seconds=(seconds,), runs_per_repeat=1)
        rung = {
            "kind": "ladder",
            "metric": "ladder:error",
            "role": "reported",
            "limit": None,
            "time_step": 0.01,
        }
        series = [definition(VALUE, **self.said.get("definition", {})), definition(RUNG, **rung)]
        samples = [sample(VALUE, value, timing=None, counters=counters), sample(RUNG, 1e-3, timing=timing)]
        if "outcome" in self.said:
            samples[0] = sample(VALUE, float("nan"), timing=None, outcome=self._next("outcome", "value"))
        if self.said.get("without"):
            del series[0], samples[0]
        asked = Asked(tests=("pendulum",), families=("values", "sweep"), whole=not tests)
        return run(
            engine=engine(self.commit), series=tuple(series), samples=tuple(samples), maps=(), asked=asked
        )  # fmt: skip

    def _next(self, name: str, otherwise: Any) -> Any:
        found = self.said.get(name, otherwise)
        return found() if callable(found) else found


def no_questions(tests: Sequence[str]) -> RunDocument:
    raise CommitError("no files are questions")


def compared(base: Side, change: Side, by_old: Any = no_questions, **more: Any) -> CompareDocument:
    return compare_by_pairs(base, change, by_old, seed="any", **more)


def told(document: CompareDocument, series: str = VALUE) -> Change:
    return next(change for change in document.changes if change.series == series)


def noisy(level: float, seed: int) -> Callable[[], float]:
    draw = random.Random(seed)
    return lambda: level * (1.0 + 0.01 * draw.gauss(0.0, 1.0))


def test_a_change_that_changes_nothing_is_asked_once() -> None:
    base, change = Side(BASE), Side(CHANGE)
    document = compared(base, change)

    assert (document.verdict, document.exit_code) == ("identical", 0)
    assert (base.calls, change.calls) == (1, 1)


def test_a_worse_value_is_red_when_every_process_repeats_it() -> None:
    base, change = Side(BASE), Side(CHANGE, value=0.45)
    document = compared(base, change)

    assert document.exit_code == 1
    assert (told(document).word, base.calls, change.calls) == ("regressed", 5, 5)


def test_one_more_operation_is_red_exactly() -> None:
    document = compared(Side(BASE), Side(CHANGE, counters={"block_operations": 601}))

    assert [c.series for c in document.changes if c.red] == ["pendulum/plain/work:values:block_operations"]


def test_a_value_that_is_one_or_another_by_the_process_is_red_in_one_change_of_a_thousand() -> None:
    """An engine that is not deterministic, or crashes now and then: what a few processes show is chance."""
    draw, blocked, sentences = random.Random(5), 0, []
    for _ in range(300):
        base, change = (Side(commit, value=lambda: draw.choice((0.4, 0.45))) for commit in (BASE, CHANGE))
        document = compared(base, change)
        blocked += document.exit_code == 1
        sentences += [told(document).sentence]

    assert blocked <= 2
    assert any("differs from process to process, no worse in" in sentence for sentence in sentences)


def test_a_value_that_is_worse_more_often_is_found() -> None:
    draw = random.Random(5)
    base = Side(BASE, value=lambda: draw.choice((0.4, 0.4, 0.4, 0.45)))
    change = Side(CHANGE, value=lambda: 0.45 + 0.01 * draw.random())

    document = compared(base, change)

    assert document.exit_code == 1
    assert "differs from process to process, worse in 13 processes" in told(document).sentence


def test_a_slower_change_is_found_and_says_by_how_much_and_in_how_many_processes() -> None:
    base, change = Side(BASE, seconds=noisy(0.01, 1)), Side(CHANGE, seconds=noisy(0.0105, 2))
    document = compared(base, change)
    found = told(document, RUN_TIME)

    assert (document.exit_code, found.name) == (1, "slower")
    assert "+5" in found.sentence or "+4" in found.sentence
    assert f"in {1 + sum(BLOCKS[:2])} processes of either side, which differ by" in found.sentence
    assert found.after == pytest.approx(0.0105, rel=0.02)


def test_a_run_time_that_only_looked_slower_is_not_red() -> None:
    times = itertools.chain((0.02,), itertools.repeat(0.01))
    document = compared(Side(BASE), Side(CHANGE, seconds=lambda: next(times)))

    assert document.exit_code == 0
    assert told(document, RUN_TIME).word == "same"


def test_a_value_that_fails_in_the_change_alone_is_red_and_the_other_way_round_is_fixed() -> None:
    assert told(compared(Side(BASE), Side(CHANGE, outcome="crashed"))).red
    document = compared(Side(BASE, outcome="crashed"), Side(CHANGE))
    assert (told(document).word, document.exit_code) == ("fixed", 0)


def test_a_gate_that_is_deleted_is_red_and_says_that_it_is_gone() -> None:
    base, change = Side(BASE), Side(CHANGE, without=True)
    document = compared(base, change)

    assert (document.exit_code, told(document).word) == (
        1,
        "removed" if told(document).word == "removed" else "missing",
    )
    assert change.calls == 1, "no process brings it back"


def test_a_series_that_is_renamed_goes_on() -> None:
    renamed = Side(CHANGE, value=0.45)

    def change(tests: Sequence[str]) -> RunDocument:
        asked = renamed(tests)
        key = VALUE.replace("length_deviation", "deviation")
        series = replace(asked.series[0], key=key, metric="deviation", aliases=(VALUE,))
        return replace(
            asked,
            series=(series, asked.series[1]),
            samples=(replace(asked.samples[0], series=key), asked.samples[1]),
        )

    document = compare_by_pairs(Side(BASE), change, no_questions)

    assert [c.series for c in document.changes if c.red] == [VALUE.replace("length_deviation", "deviation")]
    assert not [c for c in document.changes if c.word in ("new", "removed", "missing")]


def test_a_change_of_the_question_is_judged_by_the_question_of_the_base() -> None:
    another = {"definition": {"test_version": "v2"}}
    unasked = compared(Side(BASE), Side(CHANGE, **another))
    same = compared(Side(BASE), Side(CHANGE, **another), Side(CHANGE))
    worse = compared(Side(BASE), Side(CHANGE, **another), Side(CHANGE, value=0.45))

    assert (unasked.exit_code, same.exit_code, worse.exit_code) == (3, 0, 1)
    assert "not compared by the questions of the base: no files are questions" in unasked.notes
    assert "by the question of the base; the change asks another" in told(worse).sentence


def test_a_limit_that_is_loosened_is_not_taken_for_better() -> None:
    document = compared(Side(BASE, value=0.6), Side(CHANGE, value=0.6, definition={"limit": 5.0}))

    assert (told(document).word, document.exit_code) == ("not_comparable", 3)
    assert "another limit" in told(document).sentence


def test_one_engine_on_both_sides_is_refused() -> None:
    with pytest.raises(TrackerError, match="both sides answer as commit aaaaaaaaaaaa"):
        compared(Side(BASE), Side(BASE))


@pytest.fixture
def pebble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pebble:
    made = Pebble(tmp_path / "pebble", SETTINGS + 'questions = ["tracking"]\n')
    made.commit("Begin")
    git(made.folder, "checkout", "-q", "-b", "change")
    monkeypatch.chdir(made.folder)
    for name in ("GITHUB_BASE_REF", "GITHUB_STEP_SUMMARY", "GITHUB_ACTIONS"):
        monkeypatch.delenv(name, raising=False)
    return made


def asked(*words: str) -> Any:
    return CliRunner().invoke(main, ["ci", "change", "--comment", "comment.md", *words])


@needs_compiler
def test_a_pull_request_needs_no_history(pebble: Pebble) -> None:
    pebble.commit("Say it otherwise")
    good = asked()
    pebble.commit("Pull harder", GRAVITY.replace("time_step", "1.01 * time_step"))
    bad = asked("--quick")

    assert good.exit_code == 0, good.output
    assert f"base {pebble.commits[0][:12]} is built" in good.output
    assert "identical" in good.output
    assert bad.exit_code == 1, bad.output
    assert "limit crossed: -0.04905 → -0.0976095 m" in (pebble.folder / "comment.md").read_text()


@needs_compiler
def test_where_the_base_does_not_build_the_commit_before_it_is_the_base(pebble: Pebble) -> None:
    git(pebble.folder, "checkout", "-q", "main")
    pebble.commit("Break it", "no C++")
    git(pebble.folder, "checkout", "-q", "-B", "change")
    pebble.commit("Mend it")

    shown = asked("--quick")

    assert shown.exit_code == 0, shown.output
    assert f"base {pebble.commits[0][:12]} is built: 1 before it could not be" in shown.output
    assert f"{pebble.commits[1][:12]} does not build" in shown.stderr


@pytest.mark.parametrize("variable", ["GITHUB_BASE_REF", "CI_MERGE_REQUEST_DIFF_BASE_SHA", ""])
def test_the_base_is_where_the_service_says_that_the_change_leaves_its_branch(
    pebble: Pebble, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    """Of a change of two commits it is not the first of them; without a main line that is said."""
    from spook_tracker.tracker.cli.change import _base_of
    from spook_tracker.tracker.measure.build_settings import Build
    from spook_tracker.tracker.measure.builds import team_repository

    git(pebble.folder, "branch", "-q", "-m", "main", "stable")
    for subject in ("One", "Two"):
        pebble.commit(subject)
    begun, one, two = pebble.commits
    if variable:
        monkeypatch.setenv(variable, "stable" if variable == "GITHUB_BASE_REF" else begun)
    team = team_repository(pebble.folder, Build())

    assert _base_of(team, "fork-point", two, "sqlite://") == (begun if variable else one)


@needs_compiler
def test_a_change_that_does_not_build_is_said_in_a_line(pebble: Pebble) -> None:
    pebble.commit("Break it", "no C++")

    shown = asked("--quick")

    assert shown.exit_code == 2
    assert f"{pebble.commits[-1][:12]} does not build" in shown.stderr


@needs_compiler
def test_a_change_of_settings_and_questions_is_judged_by_those_of_the_base(pebble: Pebble) -> None:
    """It asks at half the speed, and pulls harder: its own question alone could not tell."""
    questions = (pebble.folder / "tracking" / "questions.py").read_text()
    settings = (pebble.folder / "tracker.toml").read_text()
    files = {
        "tracking/questions.py": questions.replace("SPEED = 9.81", "SPEED = 4.905"),
        "tracker.toml": settings.replace("-O1", "-O2"),
    }
    pebble.commit("Ask otherwise", files=files)
    alike = asked("--quick")
    pebble.commit("Pull harder", GRAVITY.replace("time_step", "1.01 * time_step"))
    worse = asked("--quick")

    assert alike.exit_code == 0, alike.output
    assert worse.exit_code == 1, worse.output
    assert "by the question of the base" in worse.output


@needs_compiler
def test_a_question_that_is_deleted_is_red(pebble: Pebble) -> None:
    questions = (pebble.folder / "tracking" / "questions.py").read_text()
    two = questions.replace('CATALOGUE = {"throw": THROW}', 'CATALOGUE = {"throw": THROW, "again": THROW}')
    git(pebble.folder, "checkout", "-q", "main")
    pebble.commit("Ask twice", files={"tracking/questions.py": two})
    git(pebble.folder, "checkout", "-q", "-B", "change")
    pebble.commit("Ask once", files={"tracking/questions.py": questions})

    shown = asked("--quick")

    assert shown.exit_code == 1, shown.output
    assert "removed" in shown.output


def slow(seconds: float, spread: float, seed: int) -> Callable[[], float]:
    draw = random.Random(seed)
    return lambda: seconds * (1.0 + spread * draw.gauss(0.0, 1.0))


def test_the_stored_history_says_how_much_noise_is_usual_and_decides_nothing() -> None:
    """Processes that differ by 1 % where nights differ by .2 %: said, and +10 % is found all the same."""
    asked: list[Any] = []

    def usual(machine: str, rungs: Any) -> dict[str, float]:
        asked.append((machine, dict(rungs)))
        return {RUN_TIME: 0.002}

    sides = [Side(BASE, seconds=slow(0.01, 0.01, 1)), Side(CHANGE, seconds=slow(0.011, 0.01, 2))]
    again = [Side(BASE, seconds=slow(0.01, 0.01, 1)), Side(CHANGE, seconds=slow(0.011, 0.01, 2))]
    told_of, without = compared(*sides, usual=usual), compared(*again)

    assert asked == [(told_of.after.machine, {RUN_TIME: (RUNG,)})]
    assert "(0.2 % is usual)" in told(told_of, RUN_TIME).sentence
    assert any(note.startswith("busy: 1 of 1 run times differ") for note in told_of.notes)
    assert (told_of.exit_code, without.exit_code) == (1, 1)
    assert not any("usual" in text for text in (*without.notes, told(without, RUN_TIME).sentence))


def test_what_is_usual_is_the_spread_between_nights_and_a_level_that_changed_once_adds_nothing() -> None:
    draw = random.Random(3)
    quiet = [0.01 * (1.0 + 0.003 * draw.gauss(0.0, 1.0)) for _ in range(30)]
    shifted = [level * (1.0 if night < 15 else 2.0) for night, level in enumerate(quiet)]
    middle = 0.003 * 0.6745  # the median distance of normal noise

    assert usual_spread(quiet) == pytest.approx(middle, rel=0.35)
    assert usual_spread(shifted) == pytest.approx(usual_spread(quiet), rel=0.25)
    assert math.isnan(usual_spread(quiet[:4])), "too few nights"


def test_what_is_usual_is_read_from_the_nights_of_that_machine(tmp_path: Path) -> None:
    database = f"sqlite:///{tmp_path}/x.db"
    levels = itertools.cycle((0.0100, 0.0102))
    side = Side(BASE, seconds=lambda: next(levels))
    for night in range(12):
        record(replace(side(()), id=f"{night:02}", idempotency_key=f"{night:02}"), database)

    with History.open(database) as history:
        machine = history.runs()[0].machine.fingerprint
        found = _usual(database, machine, {RUN_TIME: (RUNG,)})

    assert found == {RUN_TIME: pytest.approx(math.log(1.02) / math.sqrt(2.0))}
    assert _usual(database, "another", {RUN_TIME: (RUNG,)}) == {}
    assert _usual(f"sqlite:///{tmp_path}/none.db", machine, {RUN_TIME: (RUNG,)}) == {}
