"""A team's own commits, built and asked as its tracker.toml says: the first bad one is found, old ones are recorded."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.measure.build_settings import Build, build_of
from spook_tracker.tracker.measure.builds import team_repository
from spook_tracker.tracker.measure.commits import CommitError
from tests.places import ROOT
from tests.team.repository import GRAVITY, SETTINGS, Pebble, needs_compiler

WRONG = GRAVITY.replace("time_step", "1.01 * time_step")


@pytest.fixture
def pebble(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pebble:
    made = Pebble(tmp_path / "pebble")
    monkeypatch.chdir(made.folder)
    return made


@needs_compiler
def test_the_first_bad_of_a_dozen_commits_is_found_in_the_range_that_the_history_accuses(
    pebble: Pebble,
) -> None:
    """Nights measured the third and the tenth; the seventh is wrong, the fifth and the eighth do not compile."""
    for number in range(12):
        gravity = "this is no C++" if number in (4, 7) else WRONG if number >= 6 else GRAVITY
        pebble.commit(f"Change number {number}", gravity)

    nights = CliRunner().invoke(main, ["backfill", pebble.commits[2], pebble.commits[9]])
    shown = CliRunner().invoke(main, ["bisect", "throw"])

    assert nights.exit_code == 0, nights.output
    assert nights.output.count("1 of 1 values, recorded as run") == 2
    assert shown.exit_code == 1, shown.output
    assert f"first bad commit {pebble.commits[6][:12]}: Change number 6 (Ada Example)" in shown.output
    assert f"{pebble.commits[2][:12]} measured with its own questions" in shown.output, (
        "the accused range begins there"
    )
    assert pebble.commits[0][:12] not in shown.output
    skipped = [line for line in shown.output.splitlines() if " skip: " in line]
    assert all("does not build: " in line and "error" in line for line in skipped)
    for line in skipped:
        assert line.split()[0] in (pebble.commits[4][:12], pebble.commits[7][:12])


@needs_compiler
def test_where_the_bad_one_hides_among_commits_that_do_not_build_all_of_them_are_named(
    pebble: Pebble,
) -> None:
    for gravity in (GRAVITY, "no C++", "no C++ either", WRONG):
        pebble.commit("Change", gravity)

    shown = CliRunner().invoke(main, ["bisect", "throw", "--good", pebble.commits[0], "--bad", "HEAD"])

    assert shown.exit_code == 1
    named = shown.output.splitlines()[-1]
    assert "could not be measured" in named
    assert all(commit[:12] in named for commit in pebble.commits[1:])


@needs_compiler
def test_old_commits_join_the_history_once_and_what_cannot_be_had_is_said(pebble: Pebble) -> None:
    for gravity in (GRAVITY, "no C++", GRAVITY):
        pebble.commit("Change", gravity)
    pebble.commit("Forget a bracket", files={"tracker.toml": SETTINGS + "]"})
    asked = ["backfill", *pebble.commits]
    (pebble.folder / "tracker.toml").write_text(SETTINGS)

    first, second = (CliRunner().invoke(main, asked) for _ in range(2))

    assert first.exit_code == 0, first.output
    assert first.output.count("recorded as run") == 2
    assert f"{pebble.commits[1][:12]}: {pebble.commits[1][:12]} does not build: " in first.output
    assert f"{pebble.commits[3][:12]}: its tracker.toml cannot be read: " in first.output
    assert second.output.count("recorded already") == 2


@needs_compiler
def test_todays_questions_are_put_to_commits_from_before_there_were_any(pebble: Pebble) -> None:
    kept = (pebble.folder / "tracking" / "questions.py").read_text()
    adapter = (pebble.folder / "tracking" / "adapter.py").read_text()
    shutil.rmtree(pebble.folder / "tracking")
    (pebble.folder / "tracker.toml").unlink()
    old = pebble.commit("Begin")
    (pebble.folder / "tracking").mkdir()
    said = SETTINGS + 'questions = ["tracking"]\n'
    binding = (ROOT / "examples" / "pebble" / "tracking" / "pebble.py").read_text()
    files = {"tracker.toml": said, "tracking/questions.py": kept, "tracking/adapter.py": adapter}
    pebble.commit("Ask", files={**files, "tracking/__init__.py": "", "tracking/pebble.py": binding})

    shown = CliRunner().invoke(main, ["backfill", old])

    assert "1 of 1 values, recorded as run" in shown.output, shown.output
    assert f"{old[:12]} measured with today's questions" in shown.output
    kept_there = {path.name for path in (pebble.folder / ".tracker-commits" / old[:12]).iterdir()}
    assert not kept_there & {"tracker.toml", "tracker-answers.json"}, (
        "what was laid over it is taken away again"
    )


@needs_compiler
def test_an_engine_that_is_not_the_one_built_is_refused(pebble: Pebble, tmp_path: Path) -> None:
    """An adapter that finds one library whatever was built would call every commit alike."""
    other = pebble.commit("Begin")
    shutil.copytree(pebble.folder, tmp_path / "installed")
    adapter = pebble.folder / "tracking" / "adapter.py"
    elsewhere = adapter.read_text().replace("checkout=__file__", f"checkout={str(tmp_path / 'installed')!r}")
    commit = pebble.commit("Load what is installed", files={"tracking/adapter.py": elsewhere})

    shown = CliRunner().invoke(main, ["backfill", commit])

    assert f"the engine that answered is of commit {other[:12]}" in shown.output
    assert "recorded as run" not in shown.output


def test_a_benchmark_of_another_tool_is_asked_by_its_own_command(pebble: Pebble) -> None:
    """What is asked need not be the tracker's: here a run in short form, told which tests are meant."""
    answer = {
        "engine": "pebble", "version": "1", "machine": "here",
        "results": [{"test": "throw", "metric": "height_error", "value": 0.25, "unit": "m"}],
    }  # fmt: skip
    said = '[build]\ncommand = "true"\nenvironment = {WHERE = "{checkout}/answer.json"}\n'
    files = {"tracker.toml": said + 'ask = \'test "$TESTS" = throw; cp "$WHERE" "$ANSWERS"\'\n'}
    commit = pebble.commit("Answer", files={**files, "answer.json": json.dumps(answer)})
    team = team_repository(pebble.folder, Build())
    assert team is not None

    document, whose = team.measure(commit, pebble.folder / ".tracker-commits", ("throw",))

    assert (whose, document.engine.git_hash) == ("its own questions", commit)
    assert [sample.value for sample in document.samples] == [0.25]
    with pytest.raises(CommitError, match="gives no answers"):
        team.measure(commit, pebble.folder / ".tracker-commits", ("another",))


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("make", "must be a table"),
        ({"comand": "make"}, "has no setting 'comand'"),
        ({"command": 3}, "command of [build] must be a shell command"),
        ({"questions": "tracking"}, "must be a list of paths"),
        ({"questions": ["../tracking"]}, "must be inside its folder"),
        ({"environment": {"CC": 3}}, "must be a table of texts"),
    ],
)
def test_a_build_that_makes_no_sense_names_the_file_and_the_setting(said: object, words: str) -> None:
    with pytest.raises(TrackerError) as raised:
        build_of(said, Path("tracker.toml"))
    assert words in str(raised.value)
    assert str(raised.value).startswith("tracker.toml: ")


def test_a_team_without_a_word_of_building_is_told_where_to_say_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tracker.toml").write_text('engine = "tracking.adapter"\n')
    monkeypatch.chdir(tmp_path)

    shown = CliRunner().invoke(main, ["bisect", "throw", "--good", "a", "--bad", "b"])

    assert shown.exit_code == 2
    assert "[build] with a command" in shown.stderr
