"""Lines of the pages that put engines beside each other, as their templates read them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

from spook_tracker.tracker.judge.vocabulary import Class


@dataclass(frozen=True)
class Cell:
    """One engine on one question, or on one scene at one error."""

    text: str
    stands: Class
    what: str = ""  # for a pointer that rests on it
    best: bool = False


class OccasionRow(TypedDict):
    """What has to be known of a recorded night."""

    first: str
    last: str
    processor: str
    cores: int
    count: int
    loads: list[str]
    limits: list[float]
    minutes: str
    stale: tuple[str, ...]
    notes: list[str]


class EngineCard(TypedDict):
    """One engine: what it answers, and how often none is quicker."""

    name: str
    address: str
    measured: str
    nights: int
    kept: int
    supported: int
    asked: int
    first: list[tuple[str, int, int]]


class GateRow(TypedDict):
    """A gate with what every engine answers."""

    title: str
    address: str
    what: str
    limit: str
    topic: str
    cells: list[Cell]
    mine: list[Cell]  # of them
    others: bool  # whether any other engine can be asked


class RankRow(TypedDict):
    """A scene with the errors and run times of every engine."""

    title: str
    address: str
    topic: str
    what: str
    unit: str
    columns: list[list[Cell]]
    others: list[bool]  # for each column, whether any other engine has a number there


class BehindRow(TypedDict):
    """Where another engine reaches an error before ours."""

    title: str
    address: str
    what: str
    error: str
    ahead: str
    theirs: str
    mine: str
    factor: str


class VersionRow(TypedDict):
    """A version of an engine as a line of its page."""

    version: str
    measured: str
    first: bool
    count: int
    tests: str
    changes: list[str]
