"""What changed between two versions, as a document: `tracker compare --format json`.

Read like a run document: complete in itself, one published schema, non-finite values as strings.
"""

from __future__ import annotations

from typing import Literal

from spook_tracker.tracker.document.json_form import Number, schema_hook
from spook_tracker.tracker.document.run_document import Name, OutcomeClass, Struct, Text

from .vocabulary import Class, Overall, Word

COMPARE_SCHEMA_VERSION = 1


class Side(Struct, frozen=True, kw_only=True):
    """One of the two versions."""

    run: Name
    engine: Name
    version: Name
    git_hash: Text
    dirty: bool
    started: Text
    machine: Name  # fingerprint
    float_environment: Text


class Change(Struct, frozen=True, kw_only=True):
    """What became of one series, map or run time."""

    series: Name  # key; for a map "test/configuration/map:name", for run times ".../ladder:name:run-time"
    test: Name
    metric: Name
    configuration: Name
    role: Literal["gate", "companion", "reported", "explaining"]
    kind: Literal["scalar", "ladder", "order", "time", "break_point", "work", "map", "run_time"]
    unit: Text
    word: Word
    red: bool
    stands: Class  # of a red change: fail if a limit is broken or there is no value, else watch
    name: Text  # what to call a regression: "drift", "slower", "limit crossed"; else empty
    sentence: Text
    before: Number | None
    after: Number | None
    before_outcome: OutcomeClass | None
    after_outcome: OutcomeClass | None
    limit: float | tuple[float, float] | None
    decades: float | None = None  # of error magnitude
    ulps: int | None = None
    first_bad: Text = ""  # hash or version of the first bad commit, if history knows it
    last_good: Text = ""
    blame: Text = ""  # both in words: whether commits that were not measured lie between, and how sure it is
    accepted: Text = ""  # by which person and why, if accepted.toml takes this level
    rounding: Number | None = None  # where it was measured: a difference up to that is none
    machine: Text = ""  # where the versions were compared on several


class Frontier(Struct, frozen=True, kw_only=True):
    """Both versions on one ladder: at equal error and at equal time."""

    test: Name
    ladder: Name
    configuration: Name
    time_at_equal_error: float | None  # later / earlier, median over the errors both reach; machines equal
    error_at_equal_time: float | None  # later / earlier, median over the times both take; machines equal
    work_at_equal_error: float | None  # the same in exact steps, on any machine
    machine: Text = ""  # where the versions were compared on several


class CompareDocument(Struct, frozen=True, kw_only=True):
    """Two versions compared."""

    schema_version: Literal[1]
    before: Side
    after: Side
    verdict: Overall
    exit_code: Literal[0, 1, 3]
    counts: dict[str, int]  # by word
    changes: tuple[Change, ...]  # the worst first
    frontiers: tuple[Frontier, ...] = ()
    notes: tuple[str, ...] = ()


def compare_schema() -> dict[str, object]:
    """The JSON Schema (2020-12) of a comparison."""
    import msgspec

    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Two versions of an engine compared",
        **msgspec.json.schema(CompareDocument, schema_hook=schema_hook),
    }
