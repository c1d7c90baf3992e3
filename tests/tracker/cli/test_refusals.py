"""What cannot be is refused in one sentence, before anything is measured."""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

import pytest
from click.testing import Result

from spook_tracker.tracker.store.transfer import encoded
from tests.histories.documents import run
from tests.tracker.cli.test_command_line import tracker

pytestmark = pytest.mark.usefixtures("toy_desk", "in_process")


def refused(done: Result, words: str) -> None:
    assert done.exit_code == 2, done.stdout
    assert re.search(words, done.stderr), done.stderr
    assert "defect" not in done.stderr
    assert done.stderr.count("\n") == 1


OUTPUTS = [
    (("--json", "no/such/run.json"), "the folder of no/such/run.json does not exist"),
    (("--junit", "."), "is a folder; name a file"),
    (("--out", "theirs"), "theirs"),
    (("--out", "file/public"), "no folder one may write to|not a folder"),
    (("--json", "loop"), "loop is a link that leads back to itself"),
    (("--junit", "pipe"), "pipe is a pipe that cannot be read; name a file"),
    (("--json", "old.db"), "old.db is a database; name another file"),
]


@pytest.mark.parametrize(("option", "words"), OUTPUTS)
def test_where_results_cannot_be_written_nothing_is_measured(option: tuple[str, str], words: str) -> None:
    Path("theirs").mkdir()
    Path("theirs", "precious.txt").write_text("do not touch")
    Path("file").write_text("a file")
    Path("loop").symlink_to("loop")
    os.mkfifo("pipe")
    tracker("db", "upgrade", "--db", "old.db")
    kept = Path("old.db").read_bytes()

    refused(tracker("nightly", "--workers", "0", *option), words)

    assert not Path("tracker.db").exists()
    assert not Path("public").exists()
    assert Path("old.db").read_bytes() == kept


def test_a_run_asks_for_its_files_first_as_well() -> None:
    refused(tracker("run", "--workers", "0", "--json", "no/run.json"), "does not exist")
    assert not Path("tracker.db").exists()


@pytest.mark.parametrize("named", ["os:environ", "os:getcwd", "math:pi", "toy_questions:FALL"])
def test_what_is_no_catalogue_is_named(named: str) -> None:
    refused(tracker("run", "--no-record", "--workers", "0", "--catalogue", named), "is no catalogue")


@pytest.mark.parametrize("named", [":", "::x", " ", ",", "toy_questions:CATALOGUE,", "..:x", ".", "a\0b:c"])
def test_a_name_of_nothing_is_no_catalogue_and_no_engine(named: str) -> None:
    """A stray comma is found before the first engine is measured."""
    measured = ("run", "--no-record", "--workers", "0")
    refused(tracker(*measured, "--catalogue", named), "there is no catalogue")
    engines = named.replace("toy_questions:CATALOGUE", "toy_engine")
    done = tracker(*measured, "--engine", engines)
    refused(done, "there is no engine")
    assert done.stdout == ""


@pytest.mark.parametrize(
    "named", ["", ":", ":x", "nosuch:x", "os:nosuch", "os:getcwd", "math:pi", "..:x", "dask://"]
)
def test_what_is_no_executor_is_named(named: str) -> None:
    measured = ("run", "--no-record", "--workers", "0")
    refused(tracker(*measured, "--executor", named), "executor|Dask|dask")


URLS = [
    ("sqlite:///tracker.db?mode=ro", "takes no options"),
    ("sqlite+aiosqlite:///tracker.db", "is not supported"),
    ("sqlite+pysqlcipher:///tracker.db", "is not supported"),
    ("postgresql+asyncpg://host/name", "is not supported"),
    ("postgresql://who:pass@word@host/name", "%40"),
    ("postgresql://who:pass#word?@host@x/name", "%40|cannot be read"),
    ("\udcff.db", "not UTF-8"),
    ("sqlite:///\udcff.db", "not UTF-8"),
    ("a\0b.db", "holds a character that no file can have"),
]


@pytest.mark.parametrize(("url", "words"), URLS)
@pytest.mark.parametrize("command", [("db", "stats"), ("run", "--workers", "0")])
def test_an_address_that_means_something_else_is_refused(
    url: str, words: str, command: tuple[str, ...]
) -> None:
    """What would be ignored, tried with another driver, or give the end of a password away."""
    done = tracker(*command, "--db", url)

    refused(done, words)
    assert "damaged" not in done.stderr
    assert "word" not in done.stderr.partition("password")[0]


def test_a_link_to_itself_and_a_pipe_are_no_databases() -> None:
    Path("a").symlink_to("b")
    Path("b").symlink_to("a")
    os.mkfifo("pipe")
    begun = time.monotonic()
    for command in (("run", "--workers", "0"), ("db", "check"), ("publish", "--out", "public")):
        refused(tracker(*command, "--db", "a"), "a link that leads back to itself")
        refused(tracker(*command, "--db", "pipe"), "a pipe or a device")
    assert time.monotonic() - begun < 60.0  # none waits for the other end of a pipe


@pytest.mark.parametrize("options", [(), ("--cost",), ("--json",)])
def test_an_engine_without_stages_is_not_asked_which_it_needs(options: tuple[str, ...]) -> None:
    told = tracker(
        "explain",
        "falling_object",
        "--engine",
        "tests.toys.stepping_engine",
        "--catalogue",
        "standard",
        *options,
    )

    refused(told, "does not say which stages a scene needs; ours does: --engine spook")


def test_the_old_name_of_postgresql_is_told_its_new_one() -> None:
    refused(tracker("db", "check", "--db", "postgres://user@host/name"), "begins with postgresql://")


@pytest.mark.parametrize("place", ["cores", "steps", "schema_version", "value"])
def test_a_number_of_four_hundred_digits_is_refused(place: str) -> None:
    text = re.sub(rf'("{place}": *)[0-9.]+', rf"\g<1>1{'0' * 400}", encoded(run()).decode(), count=1)
    assert "0" * 400 in text
    Path("big.json").write_text(text)

    refused(tracker("import", "big.json"), "big.json")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("ci", "night", "--history", "file"), "the folder file cannot be made"),
        (("ci", "night", "--history", "file/deeper"), "the folder file/deeper cannot be made"),
        (("ci", "change", "--comment", "file/comment.md"), "file is not a folder"),
        (("judge", "latest", "--junit", "no/such.xml"), "the folder of no/such.xml does not exist"),
        (("report", "--html", "no/such.html"), "the folder of no/such.html does not exist"),
    ],
)
def test_every_command_asks_for_its_places_first(command: tuple[str, ...], words: str) -> None:
    Path("file").write_text("a file")

    refused(tracker(*command), words)

    assert not Path("tracker.db").exists()
    assert Path("file").read_text() == "a file"
