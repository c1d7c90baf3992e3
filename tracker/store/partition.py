"""SQL that lays the large tables out by time (TimescaleDB) or over several servers (Citus), from the models.

It is printed, not run: whoever looks after a server of that size wants to read it first. The keys need no change,
because the time leads the key of every large table and nobody refers to them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from sqlalchemy import Table

from spook_tracker.tracker.store.models import Base

Extension = Literal["timescaledb", "citus"]
CHUNK = "1 month"  # of time in one piece of a table: thirty nights, some hundred thousand samples of ours
TIME = "started_at"


def statements(extension: Extension) -> Iterator[str]:
    """The statements in their order, each with its semicolon."""
    yield f"CREATE EXTENSION IF NOT EXISTS {extension};"
    large = [table for table in Base.metadata.sorted_tables if is_large(table)]
    if extension == "timescaledb":
        for table in large:
            yield (
                f"SELECT create_hypertable('{table.name}', '{TIME}', chunk_time_interval => INTERVAL '{CHUNK}', "
                "migrate_data => true);"
            )
        return
    for table in Base.metadata.sorted_tables:
        if not is_large(table):
            yield f"SELECT create_reference_table('{table.name}');"
    first: dict[str, str] = {}
    for table in large:
        column = "series_id" if "series_id" in table.primary_key.columns else "run_key"
        beside = first.setdefault(column, table.name)
        where = "" if beside == table.name else f", colocate_with => '{beside}'"
        yield f"SELECT create_distributed_table('{table.name}', '{column}'{where});"


def is_large(table: Table) -> bool:
    """Whether a table grows with every night and refers to runs; the others are small and referred to."""
    return "run_key" in table.columns
