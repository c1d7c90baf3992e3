"""Earlier commits: the first bad one is found wherever ways part and meet, and old commits join the history."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace as replaced
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

import spook_tracker.engine as engine
import spook_tracker.tracker.cli.settings as settings
import spook_tracker.tracker.measure.builds as builds
import spook_tracker.tracker.measure.commits as commits
import spook_tracker.tracker.past as past
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.choice import Choice
from tests.places import ROOT
from tests.tracker.judge.test_one_judge import night, one


class Repository:
    """A git repository in which each commit gives one value."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.values: dict[str, float] = {}
        self.asked: list[str] = []
        self.git("init", "-q", "-b", "main")
        (folder / "engine" / "native").mkdir(parents=True)
        (folder / "engine" / "native" / "CMakeLists.txt").write_text("")
        (folder / "tracker.toml").write_text('[build]\ncommand = "true"\n')
        self.git("add", "-A")

    def git(self, *arguments: str) -> str:
        who = ("-c", "user.name=A", "-c", "user.email=a@example.org")
        return subprocess.run(
            ["git", "-C", str(self.folder), *who, *arguments], capture_output=True, text=True, check=True
        ).stdout.strip()

    def commit(self, value: float) -> str:
        self.git("commit", "-q", "--allow-empty", "-m", f"Let it be {value} {len(self.values)}")
        return self.has(value)

    def merge(self, branch: str, value: float) -> str:
        self.git("merge", "-q", "--no-ff", "-m", f"Merge {len(self.values)}", branch)
        return self.has(value)

    def has(self, value: float) -> str:
        head = self.git("rev-parse", "HEAD")
        self.values[head] = value
        return head

    def measure(self, commit: str) -> RunDocument:
        self.asked.append(commit)
        value = self.values[commit]
        if value < 0.0:
            raise commits.CommitError(f"{commit[:12]} does not build")
        found = night(0, one(value))
        return replace(
            found, id=commit, idempotency_key=commit, engine=replace(found.engine, git_hash=commit)
        )

    def bisect(self, good: str, bad: str, **asked: Any) -> past.Blamed:
        return past.bisect(self.folder, good, bad, self.measure, **asked)


@pytest.fixture
def repository(tmp_path: Path) -> Repository:
    folder = tmp_path / "repository"
    folder.mkdir()
    return Repository(folder)


def answering(monkeypatch: pytest.MonkeyPatch, ask: Any) -> None:
    """Commits that are not built give these answers."""
    monkeypatch.setattr(
        builds.TeamRepository, "measure", lambda self, commit, folder, tests, *options: ask(commit, options)
    )


def test_the_first_bad_commit_is_found_in_few_steps(repository: Repository) -> None:
    made = [repository.commit(0.1 if n < 11 else 0.3) for n in range(16)]
    found = repository.bisect(made[0], made[-1])

    assert found.commits == (made[11],)
    assert len(found.steps) <= 4
    assert {step.word for step in found.steps} == {"good", "bad"}
    assert [change.series for change in found.reds] == [one(0.1)[0][0].key]


def test_a_bad_commit_of_a_branch_is_blamed_and_not_its_merge(repository: Repository) -> None:
    start = repository.commit(0.1)
    repository.git("checkout", "-q", "-b", "side")
    repository.commit(0.1)
    bad = repository.commit(0.3)
    repository.commit(0.3)
    repository.git("checkout", "-q", "main")
    repository.commit(0.1)
    repository.merge("side", 0.3)
    last = repository.commit(0.3)

    assert repository.bisect(start, last).commits == (bad,)


def test_commits_that_do_not_build_are_passed_over_and_named_where_they_hide_the_bad_one(
    repository: Repository,
) -> None:
    made = [repository.commit(value) for value in (0.1, -1.0, 0.1, 0.3, -1.0, 0.3)]
    assert repository.bisect(made[0], made[-1]).commits == (made[3],)

    hidden = [repository.commit(value) for value in (0.1, -1.0, -1.0, 0.4)]
    found = repository.bisect(hidden[0], hidden[-1])
    assert set(found.commits) == set(hidden[1:])


def test_another_test_that_became_worse_on_the_way_leads_nowhere(repository: Repository) -> None:
    made = [repository.commit(0.1 if n < 3 else 0.3) for n in range(6)]

    with pytest.raises(TrackerError, match="nothing of it is worse"):
        repository.bisect(made[0], made[-1], choice=Choice(tests=("another",)))


def test_ends_that_say_nothing_are_refused(repository: Repository) -> None:
    made = [repository.commit(value) for value in (0.1, 0.1, 0.3)]

    with pytest.raises(TrackerError, match="nothing of it is worse"):
        repository.bisect(made[0], made[1])
    with pytest.raises(TrackerError, match="no ancestor"):
        repository.bisect(made[2], made[0])
    with pytest.raises(TrackerError, match="git knows no commit"):
        repository.bisect("absent", made[0])


def test_commits_are_named_one_by_one_or_as_a_range(repository: Repository) -> None:
    made = [repository.commit(0.1) for _ in range(5)]

    assert commits.commits_named(repository.folder, [made[3], made[1]]) == [made[1], made[3]]
    assert commits.commits_named(repository.folder, [f"{made[1]}..{made[3]}"]) == made[2:4]


def test_old_commits_join_the_history_once(
    repository: Repository, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [repository.commit(value) for value in (0.1, -1.0, 0.3)]
    monkeypatch.chdir(repository.folder)
    answering(monkeypatch, lambda commit, options: (repository.measure(commit), "its own questions"))
    asked = ["backfill", *reversed(made), "--db", f"sqlite:///{tmp_path}/t.db"]
    first, second = (CliRunner().invoke(main, asked) for _ in range(2))

    assert first.exit_code == 0
    assert next(x for x in first.output.splitlines() if "recorded as run" in x).startswith("[1/3]")
    assert f"{made[0][:12]} measured with its own questions" in first.output
    assert "does not build" in first.output
    assert second.output.count("recorded already") == 2


def test_old_commits_are_asked_only_with_the_options_that_were_given(
    repository: Repository, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An engine of long ago refuses what its own command did not know yet."""
    made, passed = repository.commit(0.1), []

    def ask(commit: str, options: tuple[str, ...]) -> object:
        passed.append(options)
        return repository.measure(commit), "its own questions"

    monkeypatch.chdir(repository.folder)
    answering(monkeypatch, ask)
    for number, given in enumerate(([], ["--time-limit", "60", "--memory", "100"])):
        CliRunner().invoke(main, ["backfill", made, *given, "--db", f"sqlite:///{tmp_path}/{number}.db"])

    assert not {"--time-limit", "--memory"} & set(passed[0])
    assert {"--time-limit", "60.0", "--memory", "100"} <= set(passed[1])


def test_what_the_history_blames_is_where_a_search_begins(
    repository: Repository, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from spook_tracker.tracker.library import record

    made = [repository.commit(0.1 if n < 5 else 0.3) for n in range(9)]
    database = f"sqlite:///{tmp_path}/t.db"
    for place, number in enumerate((0, 2, 7)):  # nights between which none was measured
        found = repository.measure(made[number])
        engine = replace(found.engine, commit_time=f"2026-01-0{place + 1}T00:00:00+00:00", parents=())
        record(replace(found, engine=engine, started=f"2026-01-0{place + 1}T00:00:00+00:00"), database)
    monkeypatch.chdir(repository.folder)
    answering(monkeypatch, lambda commit, options: (repository.measure(commit), "today's questions"))
    repository.asked.clear()
    shown = CliRunner().invoke(main, ["bisect", "t", "--db", database])

    assert shown.exit_code == 1
    assert f"first bad commit {made[5][:12]}: Let it be 0.3 5 (A)" in shown.output
    assert repository.asked[:2] == [made[2], made[7]]


def test_a_folder_that_says_nothing_of_builds_is_no_place_to_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shown = CliRunner().invoke(main, ["bisect", "pendulum", "--good", "a", "--bad", "b"])

    assert shown.exit_code == 2
    assert (
        "says how a commit is built; say it in tracker.toml: [build] with a command, such as make"
        in shown.stderr
    )
    assert "name commits to measure" in CliRunner().invoke(main, ["backfill"]).stderr


def of_this_repository() -> builds.TeamRepository:
    found = builds.team_repository(ROOT, settings.read(ROOT).build)
    assert found is not None
    return found


def test_todays_questions_are_put_to_a_commit_of_this_repository(tmp_path: Path) -> None:
    """What was compiled here stands for its build; the questions of then, which cannot be asked, are laid over."""
    team, commit = of_this_repository(), engine.build_info.git_hash
    place = tmp_path / commit[:12]
    commits.check_out(team.repository, commit, place)
    (place / ".git" / "built").write_text(team.today.command)
    shutil.copy(engine._core.__file__, place / "engine")
    (place / "scalar_tests" / "catalogue.py").write_text("nothing can be asked")

    answers, whose = team.measure(commit, tmp_path, ["falling_object"])

    assert whose == "today's questions"
    assert answers.engine.git_hash == commit
    assert {sample.outcome for sample in answers.samples} == {"value"}


def test_a_commit_from_before_the_package_answers_its_own_questions(repository: Repository) -> None:
    """Its rooms lie side by side at the top, and its tracker is called by its own name."""
    from spook_tracker.tracker.document.json_form import encode

    place, found = repository.folder, night(0, one(0.1))
    for room in ("engine", "tracker"):
        (place / room).mkdir(parents=True, exist_ok=True)
        (place / room / "__init__.py").write_text("")
    (place / "answers.json").write_bytes(encode(replace(found, engine=replace(found.engine, git_hash=""))))
    (place / "tracker" / "__main__.py").write_text(
        "import shutil, sys\nshutil.copy('answers.json', sys.argv[sys.argv.index('--json') + 1])\n"
    )
    today, commit = of_this_repository().today, repository.commit(0.1)
    (place / "tracker.toml").unlink()
    team = builds.TeamRepository(repository=place, home=place, today=replaced(today, questions=()))

    answers = team.ask_its_own(commit, place, ["t"])

    assert [sample.value for sample in answers.samples] == [0.1]


def test_what_a_changed_definition_hides_is_told_by_the_old_one(tmp_path: Path) -> None:
    """The questions of an old commit, where the fall lasts half as long, are put to the engine of today."""
    import spook_tracker.scalar_tests as questions
    from spook_tracker.tracker import library
    from spook_tracker.tracker.cli.report_compare import old_answer_lines
    from spook_tracker.tracker.document.json_form import Number
    from spook_tracker.tracker.judge.tonight import tonight
    from tests.histories.synthetic import DocumentHistory

    folder = tmp_path / "repository"
    folder.mkdir()
    old = Repository(folder)
    shutil.copytree(
        Path(questions.__file__).parent, folder / "scalar_tests", ignore=shutil.ignore_patterns("__pycache__")
    )
    asked = folder / "scalar_tests" / "thesis" / "falling_object.py"
    text = asked.read_text(encoding="utf-8")
    assert "DURATION = " in text
    asked.write_text(text.replace("DURATION = ", "DURATION = 0.5 * "), encoding="utf-8")
    old.git("add", "-A")
    commit = old.commit(1.0)
    place = commits.checked_out(folder, commit, tmp_path / "kept")
    then = commits.ask_today(place, ["falling_object"])
    now = library.run(["falling_object"], workers=0)
    assert {d.test_version for d in then.series} != {d.test_version for d in now.series}

    def history(factor: float) -> DocumentHistory:
        """The old commit's answers so many times as large, and tonight's."""
        samples = tuple(replace(s, value=Number(factor * s.value), state_hash="") for s in then.samples)
        engine = replace(
            then.engine, git_hash=commit, dirty=False, parents=(), commit_time="2020-01-01T00:00:00+00:00"
        )
        before = replace(then, samples=samples, engine=engine, started="2020-01-01T00:00:00+00:00")
        return DocumentHistory([before, now])

    def told(factor: float, ask: Any = lambda *asked: then) -> past.OldAnswers:
        records = history(factor)
        (found,) = past.by_old_questions(records, now, tonight(records, now), ask)
        return found

    same, worse = told(1.0), told(1e-3)
    assert (same.red, same.tests) == (False, ("falling_object",))
    assert len([change for change in same.changes if change.kind != "work"]) == len(then.samples)
    assert not same.untold
    assert worse.red
    assert "series worse" in old_answer_lines(worse)[0]

    def refuse(*asked: Any) -> RunDocument:
        raise commits.CommitError("it does not answer")

    assert old_answer_lines(told(1e-3, refuse))[0].endswith("cannot be compared; it does not answer")
    elsewhere = replace(then, engine=replace(then.engine, git_hash="f" * 40))
    assert "not that of the run" in told(1.0, lambda *asked: elsewhere).why_not
    shutil.rmtree(place / "scalar_tests")
    with pytest.raises(commits.CommitError, match="does not answer the questions"):
        commits.ask_today(place, ["falling_object"])
