"""Options that say which series a command is to tell of: by engine, test, kind and role."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., None])
KINDS = ("scalar", "ladder", "order", "time", "break_point", "work", "map", "run_time")
ROLES = ("gate", "companion", "reported", "explaining")


def test_option(command: Command) -> Command:
    """--test NAME, again and again."""
    words = "Only this test, * for anything; may be repeated."
    return click.option("--test", "tests", multiple=True, metavar="NAME", help=words)(command)


def kind_options(command: Command) -> Command:
    """--kind and --role, again and again."""
    for name, names in (("kind", KINDS), ("role", ROLES)):
        words = f"Only series of this {name}; may be repeated."
        command = click.option(f"--{name}", f"{name}s", multiple=True, type=click.Choice(names), help=words)(
            command
        )
    return command


def engine_option(command: Command) -> Command:
    """--engine NAME: whose versions are meant."""
    words = "The engine that versions refer to; NAME@VERSION sets it for one version."
    return click.option("--engine", metavar="NAME", help=words)(command)


def json_option(command: Command) -> Command:
    """--json: the same for programs."""
    return click.option("--json", "as_json", is_flag=True, help="Print as JSON.")(command)


def of_engine(engine: str | None, version: str) -> str:
    """A version named as one of that engine, unless it says whose it is itself."""
    return version if engine is None or "@" in version else f"{engine}@{version}"
