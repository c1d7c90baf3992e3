"""TOML files of the team and of others: what no program here can hold is a ValueError in words, whatever TOML allows."""

from __future__ import annotations

import gc
import tomllib
from datetime import date, datetime, time
from pathlib import Path

Toml = str | int | float | datetime | date | time | list["Toml"] | dict[str, "Toml"]  # bool is an int
DEEPEST = 50  # tables in tables


def read_toml(file: Path) -> dict[str, Toml]:
    """What a file holds. OSError, or ValueError of its text, its TOML, its depth and its numbers."""
    text, collects = file.read_text(encoding="utf-8"), gc.isenabled()
    gc.disable()  # a finalizer that ran where brackets have used up the stack would fail
    try:
        said: dict[str, Toml] = tomllib.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    finally:
        if collects:
            gc.enable()
    waiting: list[tuple[Toml, str, int]] = [(said, "", 0)]
    while waiting:
        part, name, depth = waiting.pop()
        if depth > DEEPEST:
            raise ValueError("it is nested too deeply")
        if isinstance(part, dict):
            waiting += [(inner, key, depth + 1) for key, inner in part.items()]
        elif isinstance(part, list):
            waiting += [(inner, name, depth + 1) for inner in part]
        elif isinstance(part, int) and abs(part) >= 2**63:
            raise ValueError(f"{name} is a whole number of more than 19 digits")
    return said
