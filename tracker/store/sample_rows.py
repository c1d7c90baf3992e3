"""How samples are asked for, and what their rows say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.run_document import Sample

from . import rows
from .reader import Reader, Row, SqlValue

SAMPLE = "s.run_key, s.series_id, s.definition_id, s.value, s.special, s.outcome, s.passed, s.set_point_held"
EVIDENCE = """, e.failure, e.state_hash, e.counters, t.seconds, t.runs_per_repeat, t.instructions, t.stage_seconds,
    t.cpu_seconds, t.calibration, t.again"""
BESIDE = """
    LEFT JOIN evidence e ON e.started_at = s.started_at AND e.run_key = s.run_key AND e.series_id = s.series_id
    LEFT JOIN timing t ON t.started_at = s.started_at AND t.run_key = s.run_key AND t.series_id = s.series_id"""
OF_RUN = "s.started_at = (SELECT started_at FROM run WHERE key = :run) AND s.run_key = :run"  # one range of the key
OF_ITS_RUN = "s.started_at = r.started_at AND s.run_key = r.key"


def sample_of(key: str, row: Row) -> Sample:
    """A stored sample with its evidence: columns `SAMPLE` and `EVIDENCE`."""
    more: dict[str, Any] = {}
    if row[8] is not None:
        more = {"failure": row[8], "state_hash": row[9], "counters": rows.counters_of(row[10])}
    if row[11] is not None:
        more["timing"] = rows.timing_of(*row[11:18])
    return Sample(
        series=key,
        value=rows.joined(row[3], row[4]),
        outcome=row[5],
        passed=bool(row[6]),
        set_point_held=bool(row[7]),
        **more,
    )


def bare_sample_of(
    key: str, value: float | None, special: str | None, outcome: document.OutcomeClass, passed: int, held: int
) -> Sample:
    """A stored sample without its evidence."""
    return Sample(
        series=key,
        value=rows.joined(value, special),
        outcome=outcome,
        passed=bool(passed),
        set_point_held=bool(held),
    )


def sample_rows(
    reader: Reader, where: str, parameters: dict[str, SqlValue], by_run: bool = False
) -> Sequence[Row]:
    """Rows of samples with their evidence in the order of time, then of their document; `by_run` where runs are named."""
    query = f"SELECT {SAMPLE}{EVIDENCE} FROM "
    query += (
        "run r CROSS JOIN sample s" if by_run else "sample s"
    )  # SQLite keeps to the order of a cross join
    query += BESIDE + (f" WHERE {where}" if where else "")
    return reader.rows(f"{query} ORDER BY s.started_at, s.run_key, s.position", **parameters)
