"""[build] of a team's tracker.toml: how a commit of its repository is built and asked. Imports nothing heavy.

[build]
command = "cmake -S . -B build && cmake --build build"
environment = {PYTHONPATH = "{checkout}/build/python"}  # for building and asking; {checkout} is the commit's folder
questions = ["tracking"]         # today's, laid over every commit, so that old ones answer what is asked now
ask = "build/bench > $ANSWERS"   # by default `tracker run`; a run document, or a run of pytest-benchmark …
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from spook_tracker.tracker.document.errors import TrackerError

if TYPE_CHECKING:
    from spook_tracker.tracker.document.toml_file import Toml

FILE = "tracker.toml"
TABLE = "build"
KINDS: Mapping[str, tuple[type, str]] = {
    "command": (str, "a shell command"),
    "ask": (str, "a shell command"),
    "environment": (dict, "a table of texts"),
    "questions": (list, "a list of paths"),
}


@dataclass(frozen=True, kw_only=True)
class Build:
    """How a commit is built and asked."""

    command: str = "true"  # shell
    ask: str = ""  # shell; empty: `tracker run`
    environment: Mapping[str, str] = field(default_factory=dict)
    questions: tuple[str, ...] = ()  # paths beside tracker.toml


def build_of(said: Toml, file: Path) -> Build:
    """What the table [build] says. TrackerError names the file and what is wrong with it."""
    if not isinstance(said, dict):
        raise TrackerError(f"{file}: {TABLE} must be a table with a command")
    texts: dict[str, str] = {}
    environment: dict[str, str] = {}
    questions: list[str] = []
    for name, value in said.items():
        kind, words = KINDS.get(name, (None, ""))
        if kind is None:
            raise TrackerError(f"{file}: [{TABLE}] has no setting {name!r}; it knows {', '.join(KINDS)}")
        parts = [*value.values()] if isinstance(value, dict) else value if isinstance(value, list) else []
        if type(value) is not kind or not all(isinstance(part, str) for part in parts):
            raise TrackerError(f"{file}: {name} of [{TABLE}] must be {words}, not {value!r}")
        if isinstance(value, str):
            texts[name] = value
        elif isinstance(value, dict):
            environment |= {key: str(part) for key, part in value.items()}
        else:
            questions += map(str, parts)
    for path in questions:
        if Path(path).is_absolute() or ".." in Path(path).parts:
            raise TrackerError(f"{file}: questions of [{TABLE}] must be inside its folder, unlike {path!r}")
    return Build(**texts, environment=environment, questions=tuple(questions))
