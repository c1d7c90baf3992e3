"""Every command that a document tells a reader to type is there, with the options it names."""

from __future__ import annotations

import re
import shlex

import click
import pytest

from bench.pictures import PICTURES
from spook_tracker.tracker.cli.main import main as cli
from tests.places import ROOT

DOCUMENTS = (
    "README.md",
    "CONTRIBUTING.md",
    "ARCHITECTURE.md",
    *sorted(str(p.relative_to(ROOT)) for p in (ROOT / "docs").rglob("*.md")),
    "examples/pebble/README.md",
)
TYPED = re.compile(r"^(?: {4}|.*?`)(?:\S*/)?(?P<line>(?:tracker|make) [a-z][^`#\n]*)", re.MULTILINE)


def typed(document: str) -> list[str]:
    """Lines of a document that a reader can type, without their comments."""
    return [match["line"].strip() for match in TYPED.finditer((ROOT / document).read_text(encoding="utf-8"))]


LINES = [(document, line) for document in DOCUMENTS for line in typed(document)]


def unknown(line: str) -> str:
    """What of the line is not there; empty if all is."""
    program, name, *arguments = shlex.split(line)
    if program == "make":
        targets = set(
            re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
        )
        return "" if name in targets else f"target {name}"
    command: click.Command = cli
    words = [name, *arguments]
    while isinstance(command, click.Group):
        found = command.get_command(click.Context(command), words[0])
        if found is None:
            return f"command {words[0]}"
        command, words = found, words[1:]
    try:
        command.make_parser(click.Context(command)).parse_args(words)
    except click.UsageError as error:
        return error.format_message()
    return ""


@pytest.mark.parametrize(("document", "line"), LINES)
def test_what_a_document_says_to_type_exists(document: str, line: str) -> None:
    assert unknown(line) == ""


def test_commands_and_options_that_are_not_there_are_seen() -> None:
    assert len(LINES) > 15
    assert unknown("tracker fly") == "command fly"
    assert "--nowhere" in unknown("tracker run --nowhere")
    assert "--nowhere" in unknown("tracker db copy --nowhere")
    assert unknown("make coffee") == "target coffee"


def test_every_picture_is_made_by_one_command_and_shown_somewhere() -> None:
    made = {picture.name for picture in PICTURES}
    shown = set()
    for document in DOCUMENTS:
        shown |= set(
            re.findall(r"!\[[^\]]+\]\((?:docs/|\.\./)?([\w-]+)\.png\)", (ROOT / document).read_text())
        )

    assert made == {path.stem for path in (ROOT / "docs").rglob("*.png")} == shown
