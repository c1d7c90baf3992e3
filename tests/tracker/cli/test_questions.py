"""What a script asks of the commands: JSON, filters, and a comment for a pull request that is silent or short."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from msgspec.structs import replace

from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.store import git
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record
from tests.histories.synthetic import sample, series
from tests.tracker.judge.test_one_judge import night, one

FOLLOWED = series("u", "followed")


def pairs(gate: float, followed: float = 1.0) -> list[Any]:
    return [*one(gate), (FOLLOWED, sample(FOLLOWED, followed))]


def nights() -> list[RunDocument]:
    """A main line whose fourth commit is worse, and a branch that forked from its second and is worse itself."""
    main_line = [night(n, pairs(0.1 if n < 3 else 0.3)) for n in range(5)]
    branch = replace(
        night(6, pairs(0.1, 2.0)).engine, git_hash="b" * 40, parents=(main_line[1].engine.git_hash,)
    )
    return [*main_line, replace(night(6, pairs(0.1, 2.0)), engine=branch)]


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> str:
    url = f"sqlite:///{tmp_path_factory.mktemp('asked')}/t.db"
    with session_on(url) as session:
        for run in nights():
            record(session, run)
    return url


def tracker(*command: str) -> tuple[int, str]:
    shown = CliRunner().invoke(main, [*command], env={"COLUMNS": "200"})
    return shown.exit_code, shown.output


MAIN = nights()[4].id


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        ((), 1),
        (("--role", "gate"), 1),
        (("--test", "u"), 0),
        (("--test", "*", "--kind", "scalar", "--role", "reported"), 0),
        (("--test", "absent"), 2),
        (("--engine", "absent"), 2),
        (("--engine", "spook"), 1),
    ],
)
def test_a_filter_decides_what_is_judged(database: str, asked: tuple[str, ...], code: int) -> None:
    assert tracker("judge", MAIN, *asked, "--db", database)[0] == code
    assert tracker("compare", nights()[0].id, MAIN, *asked, "--db", database)[0] == code


def test_a_filter_counts_only_what_it_takes(database: str) -> None:
    asked = ("compare", nights()[0].id, MAIN, "--format", "json", "--db", database)
    whole, part = (
        json.loads(tracker(*asked, *more)[1]) for more in ((), ("--test", "u", "--kind", "scalar"))
    )

    assert {change["test"] for change in whole["changes"]} == {"t", "u"}
    assert [change["series"] for change in part["changes"]] == [FOLLOWED.key]
    assert (part["verdict"], part["exit_code"], part["counts"]) == ("identical", 0, {"identical": 1})


def test_the_sentence_over_all_comes_first_and_names_the_worst(database: str) -> None:
    key = one(0.1)[0][0].key

    for command in (("judge", MAIN), ("compare", nights()[0].id, MAIN), ("trend", "t", "m")):
        first = tracker(*command, "--db", database)[1].splitlines()[0]
        assert first.startswith("✗")
        assert key in first


def test_a_trend_as_json_has_every_night_with_its_verdict(database: str) -> None:
    (told,) = json.loads(tracker("trend", "t", "m", "--json", "--db", database)[1])

    assert told["series"] == one(0.1)[0][0].key
    assert [found["value"] for found in told["nights"]] == [0.1, 0.1, 0.1, 0.3, 0.3]
    assert [found["state"] for found in told["nights"]] == ["green"] * 3 + ["detected"] * 2
    assert told["nights"][4]["first_bad"] == nights()[3].engine.git_hash


def test_what_is_asked_is_told_as_json(database: str) -> None:
    (door,) = json.loads(tracker("list", "--test", "door", "--json")[1])
    shown = json.loads(tracker("show", "door", "--json")[1])
    stages = json.loads(tracker("explain", "door", "--json")[1])
    stored = json.loads(tracker("db", "stats", "--json", "--db", database)[1])

    assert (door["test"], door["metrics"]) == ("door", shown["metrics"])
    assert {metric["role"] for metric in door["metrics"]} >= {"gate"}
    assert shown["why"]
    assert any(choice["kept"] for choice in stages["stages"])
    assert (stored["engines"], stored["rows"]["run"]) == ({"spook": 6}, 6)


def test_a_pull_request_is_compared_with_its_fork_point(
    database: str, monkeypatch: Any, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)  # no repository: the nearest measured ancestor
    asked = ("compare", "fork-point", "bbbbbbb", "--db", database)
    compared = json.loads(tracker(*asked, "--format", "json")[1])
    code, said = tracker(*asked, "--format", "comment")

    assert compared["before"]["run"] == nights()[1].id
    assert code == 1
    assert FOLLOWED.key.replace("_", "\\_") in said
    assert len(said.splitlines()) <= 6
    assert tracker(*asked, "--format", "annotations")[1].startswith("::error title=spook became worse::")


def test_a_pull_request_without_news_gets_no_comment(database: str, monkeypatch: Any, tmp_path: Path) -> None:
    """Red already where it forked: not its fault."""
    monkeypatch.chdir(tmp_path)
    asked = ("compare", "fork-point", MAIN, "--db", database)

    for form in ("comment", "annotations"):
        assert tracker(*asked, "--format", form) == (0, "")


def test_a_commit_on_the_way_is_passed_over_where_git_knows_the_main_line(
    database: str, monkeypatch: Any
) -> None:
    """Of a branch with several measured commits the fork point is not the commit before."""
    line = {nights()[0].engine.git_hash}
    monkeypatch.setattr(git, "fork_point", lambda repository, commit: line)
    compared = json.loads(
        tracker("compare", "fork-point", "bbbbbbb", "--format", "json", "--db", database)[1]
    )

    assert compared["before"]["run"] == nights()[0].id


def test_an_annotation_from_outside_is_no_command_of_its_own(tmp_path: Path) -> None:
    hostile = series("t", "m%0A::set-env name=A::b", role="gate", limit=1.0)
    url = f"sqlite:///{tmp_path}/t.db"
    with session_on(url) as session:
        for n in range(2):
            record(session, night(n, [(hostile, sample(hostile, 0.1 + n))]))
    said = tracker("compare", "previous", "latest", "--format", "annotations", "--db", url)[1]

    assert len(said.splitlines()) == 1
    assert "%250A" in said


def test_previous_to_a_branch_is_what_it_was_built_on_as_for_the_judge(tmp_path: Path) -> None:
    mended = [night(n, pairs(0.3 if n < 2 else 0.1)) for n in range(5)]
    engine = replace(night(6, pairs(0.3)).engine, git_hash="b" * 40, parents=(mended[1].engine.git_hash,))
    url = stored(tmp_path, *mended, replace(night(6, pairs(0.3)), engine=engine))

    code, told = tracker("compare", "previous", "latest", "--db", url)

    assert code == tracker("judge", "latest", "--db", url)[0] == 0, told
    assert tracker("compare", mended[4].id, "latest", "--db", url)[0] == 1


def test_days_in_the_terminal_are_those_of_utc(tmp_path: Path) -> None:
    late = replace(night(0, one(0.1)), started="2026-03-01T23:30:00-05:00")

    assert "2026-03-02" in tracker("trend", "t", "--db", stored(tmp_path, late))[1]


def test_a_series_whose_runs_were_removed_is_not_called_green(tmp_path: Path) -> None:
    url = stored(tmp_path, night(0, one(0.1)))
    assert tracker("db", "remove", "latest", "--db", url)[0] == 0

    code, told = tracker("trend", "t", "--db", url)

    assert code == 2
    assert "was not measured in any run that is left" in told


def test_a_trend_lists_at_least_one_value(tmp_path: Path) -> None:
    assert tracker("trend", "t", "--last", "-5", "--db", stored(tmp_path, night(0, one(0.1))))[0] == 2


def test_a_run_that_measured_nothing_is_not_green(tmp_path: Path) -> None:
    url = stored(tmp_path, night(0, one(0.1)), replace(night(1, one(0.1)), samples=(), partial=True))

    code, told = tracker("judge", "latest", "--db", url)

    assert code == tracker("compare", "previous", "latest", "--db", url)[0] == 3
    assert told.startswith("? nothing was measured")


def test_a_file_of_accepted_levels_that_is_named_must_be_there(database: str, tmp_path: Path) -> None:
    code, told = tracker("judge", MAIN, "--accepted", str(tmp_path / "acepted.toml"), "--db", database)

    assert code == 2
    assert "acepted.toml" in told


def test_a_limit_that_moved_is_not_blamed_on_the_last_bits(tmp_path: Path) -> None:
    lower = one(0.4, limit=0.2)
    broken = [(lower[0][0], replace(lower[0][1], outcome="out_of_limit", passed=False))]
    url = stored(tmp_path, night(0, one(0.4)), night(1, broken))

    code, told = tracker("judge", "latest", "--db", url)

    assert code == 1
    assert "crossed its limit: the same value, at another limit" in told


def stored(folder: Path, *runs: RunDocument) -> str:
    url = f"sqlite:///{folder}/t.db"
    with session_on(url) as session:
        for run in runs:
            assert record(session, run)
    return url
