"""What help says of every option, and what the last line of a green run says of its limits."""

from __future__ import annotations

import click
import pytest

from spook_tracker.tracker.cli import report_table
from spook_tracker.tracker.cli.main import main
from spook_tracker.tracker.judge.standing import Count


def without_help(command: click.Command, name: str) -> list[str]:
    """Options of a command, and of what is below it, that `--help` lists without a word."""
    found = [
        f"{name} {option.opts[0]}"
        for option in command.params
        if isinstance(option, click.Option) and not option.hidden and not option.help
    ]
    if isinstance(command, click.Group):
        context = click.Context(command)
        for below in command.list_commands(context):
            found += without_help(command.get_command(context, below), f"{name} {below}")
    return found


def test_help_says_what_every_option_is_for():
    planted = click.Group("a", commands=[click.Command("b", params=[click.Option(["--c"])])])

    assert without_help(planted, "a") == ["a b --c"]
    assert without_help(main, "tracker") == []


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (Count(expected=1, limits=1, gates=1), "green: the one limit holds; gates (●) among them: 1"),
        (Count(expected=1, set_points=1), "green: the one set point holds; gates"),
        (Count(expected=1, limits=1, set_points=1), "green: the one limit and its set point hold; gates"),
        (Count(expected=2, limits=1, set_points=1), "green: all 2 limits and set points hold; gates"),
    ],
)
def test_the_verdict_of_a_green_run_counts_what_there_is(monkeypatch, found, words):
    monkeypatch.setattr(report_table, "count", lambda pairs: found)
    monkeypatch.setattr(report_table, "pairs", lambda run: [])

    assert words in report_table.verdict(None)
