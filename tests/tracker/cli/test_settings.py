"""tracker.toml: what it says holds for every command, and what it says wrongly is named."""

from __future__ import annotations

import gc
import re
import traceback
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from spook_tracker.engine.protocol import Configuration
from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.scalar_tests.catalogue import Catalogue
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.cli.settings import KINDS, NOT_MEANT, Settings, SettingsError, defaults, read
from spook_tracker.tracker.document.toml_file import read_toml
from spook_tracker.tracker.measure.limits import held_to
from spook_tracker.tracker.measure.others import asked_of
from spook_tracker.tracker.measure.run import Questions
from tests.places import ROOT

TOY = 'engine = "toy_engine"\ncatalogue = "toy_questions"\n'


pytestmark = pytest.mark.usefixtures("desk")


def tracker(*words: str) -> Result:
    return CliRunner().invoke(main, list(words), prog_name="tracker")


def test_engine_catalogue_and_database_are_those_of_the_file(tmp_path: Path) -> None:
    Path("tracker.toml").write_text(TOY + 'database = "sqlite:///ours.db"\nworkers = 0\n')

    done = tracker("run", "fall")

    assert done.exit_code == 0, done.output
    assert (tmp_path / "ours.db").is_file()
    assert not (tmp_path / "tracker.db").exists()


def test_the_command_line_and_the_environment_go_before_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("tracker.toml").write_text('engine = "nowhere"\ncatalogue = "nowhere_either"\n')
    monkeypatch.setenv("TRACKER_CATALOGUE", "toy_questions")

    assert "fall" in tracker("list", "--engine", "toy_engine").output
    assert "no catalogue" in tracker("list", "--catalogue", "nowhere_either", "--engine", "toy_engine").stderr
    assert "no engine 'nowhere'" in tracker("list").stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("engin = 'x'", "no setting 'engin'"),
        ("workers = 'two'", "workers must be a whole number, not 'two'"),
        ("workers = true", "workers must be a whole number"),
        ("engine = 3", "engine must be a text"),
        ("engine = ", "cannot be read"),
        ("limits = 3", "limits must be a table"),
        ("[limits]\n'a/*' = 'x'", "the limit of 'a/*' must be a number or two"),
        ("[limits]\n'a/*' = [1, 2, 3]", "must be a number or two"),
        ("[limits]\n'a/*' = nan", "must be a number or two"),
    ],
)
def test_what_is_wrong_in_the_file_is_one_sentence(text: str, said: str) -> None:
    Path("tracker.toml").write_text(text)

    done = tracker("list")

    assert done.exit_code == 2
    assert said in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_a_file_that_is_not_text_is_named(tmp_path: Path) -> None:
    (tmp_path / "tracker.toml").write_bytes(b"\xff\xfe")

    with pytest.raises(SettingsError, match=r"tracker\.toml cannot be read"):
        read(tmp_path)


def test_a_file_above_the_repository_belongs_to_others(tmp_path: Path) -> None:
    """A user that may write to a folder above could else name the module that is imported here."""
    (tmp_path / "tracker.toml").write_text('title = "theirs"\n')
    inside = tmp_path / "repository" / "src"
    inside.mkdir(parents=True)

    assert read(inside).values == {}
    (tmp_path / "repository" / ".git").mkdir()
    assert read(inside).values == {}
    (tmp_path / "repository" / "tracker.toml").write_text('title = "ours"\n')
    assert read(inside).values == {"title": "ours"}


def test_files_are_looked_for_beside_the_settings(tmp_path: Path) -> None:
    (tmp_path / ".git").mkdir()
    (tmp_path / "tracker.toml").write_text(
        'database = "sqlite:///h.db"\naccepted = "a.toml"\nout = "public"\n'
    )
    (tmp_path / "src").mkdir()

    assert read(tmp_path / "src").values == {
        "database": f"sqlite:///{tmp_path}/h.db",
        "accepted": f"{tmp_path}/a.toml",
        "out": f"{tmp_path}/public",
    }


def test_the_documented_file_is_understood(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "engine-protocol.md").read_text(encoding="utf-8")
    (tmp_path / "tracker.toml").write_text(page.partition("```toml\n")[2].partition("```")[0])

    settings = read(tmp_path)

    assert set(settings.values) == set(KINDS), "the page names every setting"
    assert settings.limits == (("falling_object/default/position_error/*", 2.0),)


def test_every_setting_is_an_option_of_some_command() -> None:
    options = {p.name for command in main.commands.values() for p in command.params}

    assert set(KINDS) <= options
    assert set(NOT_MEANT) <= set(main.commands)
    assert isinstance(main, click.Group)
    assert "out" not in defaults(main, Settings({"out": "x"}))["export"]  # runs, not pages


def limited(*limits: object) -> object:
    return Questions(catalogue="toy_questions", engine="toy_engine", limits=tuple(limits)).tests()["fall"]  # type: ignore[arg-type]


def test_a_limit_makes_a_followed_value_a_gate() -> None:
    before = {m.name: m for _, m in limited().metrics()}  # type: ignore[attr-defined]
    key, band = "fall/*/height/*", (-6.0, -4.0)

    after = {m.name: m for _, m in limited((key, band)).metrics()}  # type: ignore[attr-defined]

    assert (before["height"].role, before["height"].limit) == ("reported", None)
    assert (after["height"].role, after["height"].limit) == ("gate", band)
    assert after["position_error"] == before["position_error"]


def test_of_two_limits_the_later_one_counts() -> None:
    error = "fall/*/position_error/*"

    metrics = {m.name: m for _, m in limited((error, 1.0), (error, 0.5)).metrics()}  # type: ignore[attr-defined]

    assert metrics["position_error"].limit == 0.5


class Imported(Catalogue):
    """Our catalogue, and which of its tests were asked for."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def __getitem__(self, name: str) -> ScalarTest:
        self.names.append(name)
        return super().__getitem__(name)


@pytest.mark.parametrize(
    ("pattern", "may_be_of"),
    [
        ("falling_object/default/position_error/*", "falling_object$"),
        ("falling_object/*/position_error/h=0.0[1]*", "falling_object$"),
        ("fall*/position_error/*", "fall"),
        ("*/position_error/*", ""),
        ("[f]alling_object/*/position_error/*", ""),
        ("?alling_object/*/position_error/*", ""),
    ],
)
def test_a_limit_imports_the_tests_it_may_be_of_and_another_engine_those_it_is_asked(
    pattern: str, may_be_of: str
) -> None:
    tests = Imported()
    asked = asked_of(tests, (Configuration(name="default", reason="the only one"),), gating=True)
    assert tests.names == []

    held = held_to(asked, ((pattern, 3.0),))

    assert tests.names == [name for name in Catalogue() if re.match(may_be_of, name)]
    assert {3.0} <= {metric.limit for _, metric in held["falling_object"].metrics()}
    assert held["pendulum"] is held["pendulum"]
    assert "pendulum" in tests.names


@pytest.mark.parametrize(
    ("pattern", "limit", "said"),
    [
        ("fly/*", 1.0, "no series is called 'fly/*'"),
        ("fall/*/height/*", 1.0, "two numbers"),
        ("fall/*/position_error/*", (0.0, 1.0), "one number"),
    ],
)
def test_a_limit_that_means_nothing_is_refused(pattern: str, limit: object, said: str) -> None:
    with pytest.raises(Exception, match=said.replace("*", r"\*")):
        limited((pattern, limit))


def test_another_engine_asked_beside_theirs_is_not_held_to_their_limits(tmp_path: Path) -> None:
    (tmp_path / "tracker.toml").write_text(TOY + "[limits]\n'fall/*/position_error/*' = 1.0\n")
    settings = read(tmp_path)

    assert settings.limits_of("toy_engine") == (("fall/*/position_error/*", 1.0),)
    assert settings.limits_of("mujoco") == ()


def test_a_test_that_two_catalogues_have_is_refused() -> None:
    with pytest.raises(Exception, match="both have a test 'fall'"):
        Questions(catalogue="toy_questions,toy_questions:CATALOGUE", engine="toy_engine").tests()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("time_limit = " + "9" * 400, "time_limit is a whole number of more than 19 digits"),
        ("workers = " + "9" * 5000, "cannot be read"),
        ("[limits]\n" + '"a/*" = ' + "9" * 400, "a/* is a whole number of more than 19 digits"),
        ("x = " + "[" * 5000 + "]" * 5000, "it is nested too deeply"),
        ("x." * 5000 + "x = 1", "it is nested too deeply"),
        ("time_limit = nan", "time_limit must be a number, not nan"),
        ("home_page = 'javascript:alert(1)'", "is no address of the web"),
    ],
)
def test_settings_that_no_number_and_no_address_can_be_are_one_sentence(content, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tracker.toml").write_text(content)

    done = CliRunner().invoke(main, ["nightly", "--quick"], prog_name="tracker")

    assert done.exit_code == 2
    assert said in done.stderr
    assert "defect" not in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_no_finalizer_runs_where_a_nest_has_used_up_the_stack(tmp_path: Path) -> None:
    depths, goes_on = [], [True]

    class Garbage:  # there is always some
        def __init__(self) -> None:
            self.me = self

        def __del__(self) -> None:
            depths.append(sum(1 for _ in traceback.walk_stack(None)))
            if goes_on:
                Garbage()

    (tmp_path / "nest.toml").write_text("x = " + "[" * 5000 + "]" * 5000)
    thresholds = gc.get_threshold()
    gc.set_threshold(20)
    try:
        Garbage()
        with pytest.raises(ValueError, match="nested too deeply"):
            read_toml(tmp_path / "nest.toml")
    finally:
        gc.set_threshold(*thresholds)
        goes_on.clear()
    gc.collect()
    assert depths and max(depths) < 200
    assert gc.isenabled()


@pytest.mark.parametrize("option", ["--time-limit", "--limit"])
def test_what_is_no_number_is_no_limit(option, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    done = CliRunner().invoke(main, ["run", option, "nan"], prog_name="tracker")

    assert done.exit_code == 2
    assert "nan is no number of seconds" in done.stderr


def test_a_home_page_that_is_no_address_is_refused_before_anything_is_measured(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    done = CliRunner().invoke(main, ["nightly", "--home-page", "javascript:alert(1)"], prog_name="tracker")

    assert done.exit_code == 2
    assert "is no address of the web; write https://" in done.stderr
    assert not list(tmp_path.iterdir())
