"""Move a whole history between SQLite and PostgreSQL. What arrives is read back and compared by digest."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, Table, func, insert, select

from spook_tracker.tracker.document.errors import DatabaseError

from . import models
from .database import in_words, open_database, shown
from .reader import SqlValue

if TYPE_CHECKING:
    from sqlalchemy import Row

CHUNK = 5000  # rows held in memory


@dataclass(frozen=True, slots=True)
class Digest:
    """A table's content, whatever the order of its rows: their number and the sum of their hashes."""

    rows: int
    total: str


def copy_database(source: str, target: str) -> dict[str, Digest]:
    """Copy everything from `source` to `target`, which must hold no runs; returns the digest of each table.

    One transaction: interrupted, the target stays empty. DatabaseError if the target is in use, or what was
    read back differs.
    """
    reading = open_database(source, readonly=True)
    try:
        writing = open_database(target)
        try:
            with in_words(writing):
                return _copy(reading, writing)
        finally:
            writing.dispose()
    finally:
        reading.dispose()


def _copy(source: Engine, target: Engine) -> dict[str, Digest]:
    tables = models.Base.metadata.sorted_tables  # parents before children
    with _snapshot(source) as old, target.begin() as new:
        for table in tables:
            if new.execute(select(func.count()).select_from(table)).scalar_one():
                raise DatabaseError(f"{shown(target.url)} already holds runs; copy into an empty database")
        digests = {}
        for table in tables:
            there = digest_of(_copied(old, new, table))
            digests[table.name] = digest(new, table)
            if digests[table.name] != there:
                raise DatabaseError(f"the copy of table {table.name} differs; nothing was copied")
    return digests


def _copied(old: Connection, new: Connection, table: Table) -> Iterator[Row[*tuple[SqlValue, ...]]]:
    names = [column.name for column in table.columns]
    for part in _partitions(old, table):
        new.execute(insert(table), [dict(zip(names, row, strict=True)) for row in part])
        yield from part


def _snapshot(engine: Engine) -> Connection:
    """A connection that sees one moment of the database, however long it reads."""
    connection = engine.connect()
    if engine.dialect.name == "postgresql":
        connection = connection.execution_options(isolation_level="REPEATABLE READ")
    return connection


def digest(connection: Connection, table: Table) -> Digest:
    """The digest of a table as stored."""
    return digest_of(row for part in _partitions(connection, table) for row in part)


def digest_of(rows: Iterable[Sequence[SqlValue]]) -> Digest:
    """Sum of the SHA-256 of every row: equal for equal rows in any order, and from any database."""
    count, total = 0, 0
    for row in rows:
        count += 1
        text = "\x1f".join(_plain(value) for value in row)
        total += int.from_bytes(hashlib.sha256(text.encode()).digest(), "big")
    return Digest(count, f"{total % 2**256:064x}")


def _partitions(connection: Connection, table: Table) -> Iterator[Sequence[Row[*tuple[SqlValue, ...]]]]:
    result = connection.execute(select(table), execution_options={"yield_per": CHUNK})
    yield from result.partitions()


def _plain(value: SqlValue) -> str:
    """A value as text that tells types, and floats by their bits, apart."""
    if isinstance(value, float):
        return f"float {value.hex()}"
    if isinstance(value, datetime):
        return f"time {value.isoformat()}"
    if isinstance(value, bytes):
        return f"bytes {value.hex()}"
    return f"{type(value).__name__} {value}"
