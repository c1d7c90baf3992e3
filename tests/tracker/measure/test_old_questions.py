"""Old questions put to today's engine: everything that changed is asked, and what cannot be told is said."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner, Result
from msgspec.structs import replace

import spook_tracker.tracker.measure.commits as commits
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.json_form import Number
from spook_tracker.tracker.document.run_document import Asked, RunDocument
from spook_tracker.tracker.judge.work import FAMILIES
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record
from tests.histories.synthetic import document

TEST = "pendulum"
WHOLE = ("values", "sweep", "stability")


def run(night: int, version: str, families: tuple[str, ...] = WHOLE) -> RunDocument:
    """One night of one test, by one version of its questions and of some families alone."""
    made = document(night)
    series = tuple(
        replace(d, test_version=version)
        for d in made.series
        if d.test == TEST and FAMILIES[d.kind] in families and d.kind != "time"
    )
    keys = {d.key for d in series}
    return replace(
        made,
        series=series,
        samples=tuple(s for s in made.samples if s.series in keys),
        tests=tuple(card for card in made.tests if card.name == TEST),
        maps=(),
        figures=(),
        asked=Asked(tests=(TEST,), families=families, whole=False),
    )


class Repository:
    """Stands for the repository: what each old commit's questions are answered with today, and what was asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, place: Path) -> None:
        self.address = f"sqlite:///{place / 'h.db'}"
        self.sweep, self.values, self.now = run(0, "old"), run(1, "old", ("values",)), run(2, "new")
        self.answers = {
            then.engine.git_hash: replace(
                then, engine=self.now.engine, id=f"asked-{then.id}", started=self.now.started
            )
            for then in (self.sweep, self.values)
        }
        self.asked: list[tuple[str, tuple[str, ...]]] = []
        with session_on(self.address) as session:
            for made in (self.sweep, self.values, self.now):
                assert record(session, made)
        monkeypatch.setattr(commits, "repository_at", lambda folder: place)
        monkeypatch.setattr(commits, "checked_out", lambda repository, commit, kept: commit)
        monkeypatch.setattr(commits, "ask_today", self.ask)

    def ask(self, commit: str, tests: tuple[str, ...], *options: str) -> RunDocument:
        assert tests == (TEST,)
        self.asked.append((commit, options))
        if commit not in self.answers:
            raise commits.CommitError("it does not answer")
        return self.answers[commit]

    def without(self, kind: str) -> None:
        """Today's engine answers nothing of this kind to the questions of the sweep."""
        answer = self.answers[self.sweep.engine.git_hash]
        keys = {d.key for d in answer.series if d.kind == kind}
        families = tuple(family for family in WHOLE if family != FAMILIES[kind])
        self.answers[self.sweep.engine.git_hash] = replace(
            answer,
            samples=tuple(s for s in answer.samples if s.series not in keys),
            asked=Asked(tests=(TEST,), families=families, whole=False),
        )

    def judged(self, *options: str) -> Result:
        self.asked.clear()
        return CliRunner().invoke(
            main, ["judge", "latest", "--old-questions", "--db", self.address, *options]
        )


@pytest.fixture
def repository(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Repository:
    monkeypatch.chdir(tmp_path)
    return Repository(monkeypatch, tmp_path)


def test_sweeps_and_stability_are_asked_of_the_commit_that_has_them(repository: Repository) -> None:
    done = repository.judged()

    assert done.exit_code == 0, done.output
    assert repository.asked == [
        (repository.values.engine.git_hash, ()),
        (repository.sweep.engine.git_hash, ("--sweep", "--stability")),
    ]
    assert done.output.count("none worse") == 2
    assert "? of these, " not in done.output


def test_what_is_not_answered_is_no_green(repository: Repository) -> None:
    repository.without("ladder")
    ladders = sum(d.kind == "ladder" for d in repository.sweep.series)
    done = repository.judged("--junit", "found.xml")

    assert done.exit_code == 3, done.output
    assert f"{ladders} cannot be compared, {ladders} ladder: not measured in this run" in done.output
    skipped = [
        case
        for case in ElementTree.parse("found.xml").iter("testcase")
        if case.find("skipped") is not None and "/ladder:" in case.get("name", "")
    ]
    assert len(skipped) == ladders
    assert all(repository.sweep.engine.git_hash[:12] in case.get("name", "") for case in skipped)


def test_only_what_is_looked_at_is_asked(repository: Repository) -> None:
    done = repository.judged("--kind", "break_point", "--json")

    assert done.exit_code == 0, done.output
    assert repository.asked == [(repository.sweep.engine.git_hash, ("--stability",))]
    told = json.loads(done.output)
    points = {d.key for d in repository.sweep.series if d.kind == "break_point"}
    assert {one["series"] for one in told} == points
    then = [one for one in told if "asked_at" in one]
    assert {(one["word"], one["asked_at"]) for one in then} == {
        ("identical", repository.sweep.engine.git_hash)
    }


@pytest.mark.parametrize("kind", ["scalar", "ladder", "break_point"])
def test_what_became_worse_behind_a_new_definition_is_red_everywhere(
    repository: Repository, kind: str
) -> None:
    """A value that the run did not hold under the old question, of every family."""
    then = repository.sweep if kind != "scalar" else repository.values
    answer = repository.answers[then.engine.git_hash]
    bad = next(d.key for d in answer.series if d.kind == kind)
    repository.answers[then.engine.git_hash] = replace(
        answer,
        samples=tuple(
            replace(s, value=Number(float("nan")), outcome="diverged", state_hash="")
            if s.series == bad
            else s
            for s in answer.samples
        ),
    )
    done = repository.judged("--json", "--junit", "found.xml")

    assert done.exit_code == 1, done.output
    assert [one["series"] for one in json.loads(done.output) if one["red"]] == [bad]
    (case,) = [
        case for case in ElementTree.parse("found.xml").iter("testcase") if case.find("failure") is not None
    ]
    assert then.engine.git_hash[:12] in case.get("name", "")


def test_a_commit_that_answers_nothing_leaves_each_of_its_series_open(repository: Repository) -> None:
    del repository.answers[repository.sweep.engine.git_hash]
    done = repository.judged("--json")

    assert done.exit_code == 3
    open_ones = [
        one
        for one in json.loads(done.output)
        if one["word"] == "not_measured" and "/work:" not in one["series"]
    ]
    asked = [d for d in repository.sweep.series if FAMILIES[d.kind] != "values"]
    assert {one["series"] for one in open_ones} == {d.key for d in asked}
    assert {one["sentence"] for one in open_ones} == {"it does not answer"}
