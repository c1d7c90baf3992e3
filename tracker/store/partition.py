"""SQL that lays the large tables out by time (PostgreSQL itself, TimescaleDB) or over several servers (Citus), from the
models.

It is printed, not run: the administrator of a server of that size wants to read it first. The keys need no change,
because the time leads the key of every large table and no table refers to them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from sqlalchemy import MetaData, Table, make_url
from sqlalchemy.schema import (
    CreateIndex,
    CreateTable,
    ExecutableDDLElement,
    SetColumnComment,
    SetTableComment,
)

from . import views
from .connection import ONE_WRITER
from .models import NAMING, Base

Kind = Literal["postgresql", "timescaledb", "citus"]
CHUNK = "1 month"  # of time in one piece of a table: thirty nights, some hundred thousand samples of ours
TIME = "started_at"
MAKE = """
CREATE OR REPLACE FUNCTION months.make(since timestamptz, ahead interval) RETURNS void LANGUAGE plpgsql AS $$
DECLARE
    large text;
    part text;
    month timestamp;  -- begin, in UTC
    first timestamptz;
    past timestamptz;
    stray boolean;
BEGIN
    PERFORM pg_advisory_xact_lock({lock});  -- as a run is recorded
    FOREACH large IN ARRAY ARRAY[{large}] LOOP
        EXECUTE format('CREATE TABLE IF NOT EXISTS months.%I PARTITION OF %I DEFAULT', large || '_other', large);
        FOR month IN
            SELECT generate_series(
                date_trunc('month', since AT TIME ZONE 'UTC'), (now() AT TIME ZONE 'UTC') + ahead, INTERVAL '1 month')
            UNION SELECT date_trunc('month', started_at AT TIME ZONE 'UTC') FROM run
        LOOP
            part := large || to_char(month, '_YYYY_MM');
            CONTINUE WHEN to_regclass(format('months.%I', part)) IS NOT NULL;
            first := month AT TIME ZONE 'UTC';
            past := (month + INTERVAL '1 month') AT TIME ZONE 'UTC';
            EXECUTE format('SELECT EXISTS (SELECT FROM months.%I WHERE {time} >= %L AND {time} < %L)',
                large || '_other', first, past) INTO stray;
            IF stray THEN  -- nights from before their month was made: a part may not be added while another has its rows
                EXECUTE format('CREATE TABLE months.%I (LIKE %I INCLUDING DEFAULTS INCLUDING CONSTRAINTS)', part, large);
                EXECUTE format('WITH moved AS (DELETE FROM months.%I WHERE {time} >= %L AND {time} < %L RETURNING *) '
                    'INSERT INTO months.%I SELECT * FROM moved', large || '_other', first, past, part);
                EXECUTE format('ALTER TABLE %I ATTACH PARTITION months.%I FOR VALUES FROM (%L) TO (%L)',
                    large, part, first, past);
            ELSE
                EXECUTE format('CREATE TABLE months.%I PARTITION OF %I FOR VALUES FROM (%L) TO (%L)',
                    part, large, first, past);
            END IF;
        END LOOP;
    END LOOP;
END $$;"""
AHEAD = (
    "2 years"  # months that are made in advance, beside those of runs; the rest is kept in a part of its own
)


def statements(kind: Kind) -> Iterator[str]:
    """The statements in their order, each with its semicolon."""
    if kind == "postgresql":
        yield from _by_month()
    else:
        yield from _of_extension(kind)


def _by_month() -> Iterator[str]:
    """PostgreSQL's own partitions, a month each, in a schema `months`; what is there moves along, in one transaction."""
    here = MetaData(naming_convention=NAMING)
    tables = [table.to_metadata(here) for table in Base.metadata.sorted_tables]
    large = [table for table in tables if is_large(table)]
    dialect = make_url("postgresql+psycopg://").get_dialect()()
    yield "BEGIN;"
    yield f"SELECT pg_advisory_xact_lock({ONE_WRITER});"  # as a run is recorded
    yield from (f"DROP VIEW IF EXISTS {name};" for name in reversed([*views.VIEWS, "column_comments"]))
    yield "CREATE SCHEMA months;"
    yield "CREATE SCHEMA before;"
    for table in large:
        yield f"ALTER TABLE {table.name} SET SCHEMA before;"  # with its indexes, so that their names are free
        table.dialect_options["postgresql"]["partition_by"] = f"RANGE ({TIME})"
        made: list[ExecutableDDLElement] = [CreateTable(table), *map(CreateIndex, table.indexes)]
        made += [SetTableComment(table), *(SetColumnComment(c) for c in table.columns if c.comment)]
        yield from (f"{str(part.compile(dialect=dialect)).strip()};" for part in made)
    names = ", ".join(f"'{table.name}'" for table in large)
    yield MAKE.strip().format(large=names, lock=ONE_WRITER, time=TIME)
    yield f"SELECT months.make(now(), INTERVAL '{AHEAD}');"
    for table in large:
        names = ", ".join(column.name for column in table.columns)
        yield f"INSERT INTO {table.name} ({names}) SELECT {names} FROM before.{table.name};"
        yield f"DROP TABLE before.{table.name};"
    yield "DROP SCHEMA before;"
    yield from (f"{view.replace(chr(92) + chr(58), chr(58))};" for view in views.statements("postgresql"))
    yield "COMMIT;"


def _of_extension(extension: Kind) -> Iterator[str]:
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
