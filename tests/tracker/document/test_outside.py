"""Names, units and failures from other people's files are shown, never obeyed."""

from __future__ import annotations

import json
import re
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

import spook_tracker.tracker.cli.console as console
import spook_tracker.tracker.document.outside as outside
from spook_tracker.tracker.cli.report_junit import junit_of_run
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.transfer import encoded
from tests.histories.documents import definition, engine, machine, run, sample
from tests.tracker.cli.test_command_line import tracker

HOSTILE = (
    "\x1b]0;owned\x07\x1b[2J\n::error file=x::run me\r\n##[error]me too \u202egpj.exe\u2066 \x9b31m \u200f"
    " amid ##[add-mask]a ##vso[task.setvariable variable=PATH]/x ##teamcity[buildStop] ##\x1b[31m[debug]d"
    "\n:\x1b[31m:error::e\u2028::error::f"
)
MARK = re.compile(r"##\w*\[")  # GitHub, Azure Pipelines and TeamCity look for these anywhere in a line
SHOWN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def hostile_run() -> RunDocument:
    key = "fall/plain/::error file=y::z"
    first = definition(key, unit=HOSTILE[:40], test="fall", description=HOSTILE)
    bad = sample(key, 99.0, outcome="crashed", passed=False, set_point_held=False, failure=HOSTILE)
    theirs = engine(
        name=HOSTILE[:200], version=HOSTILE[:200], compiler=HOSTILE, subject=HOSTILE, author=HOSTILE
    )
    return run(series=(first,), samples=(bad,), engine=theirs, machine=machine(processor=HOSTILE))


def obeyed(text: str) -> list[str]:
    """What a terminal or a CI service would act on."""
    plain = outside.COLOUR.sub("", text)
    lines = [line for line in plain.splitlines() if line.lstrip().startswith("::")]
    return lines + MARK.findall(plain) + SHOWN.findall(plain)


@pytest.fixture
def recorded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with session_on("tracker.db") as session:
        for number, night in enumerate((hostile_run(), hostile_run())):
            night = msgspec.structs.replace(night, id=f"run {number}", idempotency_key=f"key {number}")
            record(session, night)


COMMANDS = [
    ("trend", "fall"), ("compare", "previous", "latest", "--all"), ("compare", "previous", "latest", "--format", "json"),
    ("compare", "previous", "latest", "--format", "junit"), ("compare", "previous", "latest", "--format", "markdown"),
    ("export", "latest"), ("db", "stats"), ("trend", HOSTILE), ("compare", HOSTILE, "latest"), ("run", HOSTILE),
    ("judge",), ("judge", "--json"), ("db", "stats", "--json"),
    ("db", "check"), ("rank",), ("releases", HOSTILE), ("db", "remove", "latest"), ("import", HOSTILE),
    ("export", "--format", "csv", "--out", HOSTILE), ("serve", HOSTILE), ("show", HOSTILE), ("explain", HOSTILE),
    ("list", "--catalogue", HOSTILE), ("run", "--engine", HOSTILE), ("report", "--html", HOSTILE), ("trend", "fall", "--json"),
    ("export", HOSTILE), ("publish", "--out", "public", "--db", f"sqlite:///{HOSTILE}/x.db"),
]  # fmt: skip


@pytest.mark.usefixtures("recorded")
@pytest.mark.parametrize(
    "arguments", COMMANDS, ids=lambda words: " ".join(words)[:30].encode("unicode_escape")
)
def test_no_command_prints_what_a_terminal_or_a_ci_service_obeys(arguments: tuple[str, ...]) -> None:
    done = tracker(*arguments)

    assert done.stdout + done.stderr
    assert obeyed(done.stdout) == []
    assert obeyed(done.stderr) == []


def test_files_for_machines_carry_no_character_that_cannot_be_seen() -> None:
    document = hostile_run()

    text = encoded(document).decode()
    junit = junit_of_run(document)

    assert outside.UNSEEN.search(text) is None
    assert decode(text, RunDocument) == document  # an escape loses nothing
    assert SHOWN.findall(junit) == []
    ElementTree.fromstring(junit)


def test_a_refusal_repeats_only_so_much_of_what_it_was_given() -> None:
    done = tracker("compare", "x" * 70_000, "latest", "--db", "y" * 70_000)

    assert done.exit_code == 2
    assert len(done.stderr) < 1000
    assert done.stderr.count("\n") == 1


@given(st.text(max_size=60))
def test_whatever_is_written_lines_are_inert_and_json_keeps_its_meaning(text: str) -> None:
    assert obeyed(outside.inert(text.replace("\x0b", "").replace("\x0c", ""))) == []
    assert json.loads(outside.escaped(json.dumps(text, ensure_ascii=False))) == text
    assert outside.inert("\x1b[31m✗ red\x1b[0m\n  plain") == "\x1b[31m✗ red\x1b[0m\n  plain"


@pytest.mark.parametrize("closed", ["stdout", "stderr"])
def test_a_stream_that_is_closed_from_the_start_is_not_written_to(
    closed: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, closed, None)

    console.say("words", err=closed == "stderr")
    with console.watching("measuring") as step:
        step(1, 1, "fall", True, ())
