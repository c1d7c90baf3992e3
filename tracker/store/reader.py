"""Rows for plain statements, from whatever holds the history: a session, or a SQLite file read without SQLAlchemy.

To import SQLAlchemy takes longer than to compare two versions. A file that is as it should be is therefore read by
the driver alone; any other is left to tracker/store/database.py, which knows what is wrong with it.
Statements are such as SQLite and PostgreSQL both understand, with parameters as `:name`.
"""

from __future__ import annotations

import lzma
import os
import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import quote

import msgspec

from spook_tracker.tracker.document.errors import DatabaseError

from .head import head

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

LOCK_TIMEOUT = 30.0  # s to wait for another writer
SAFE = ("trusted_schema = OFF", "cell_size_check = ON")  # for files from elsewhere
CHUNK = 500  # values in one IN (...)
STREAMED = 10_000  # rows that a server sends at once
NONSENSE = (
    ValueError, LookupError, TypeError, AttributeError, ArithmeticError, sqlite3.Error, zlib.error, lzma.LZMAError,
    msgspec.MsgspecError,
)  # fmt: skip  # what comes of reading bytes that mean nothing
Row = Sequence[Any]  # of the columns that a statement names
SqlValue = str | int | float | bytes | datetime | None  # what a column can hold


class Reader(Protocol):
    """Rows of a statement, all from one moment."""

    def rows(self, statement: str, **parameters: SqlValue) -> Sequence[Row]: ...
    def each_row(self, statement: str) -> Iterator[Row]: ...  # without keeping them


class SessionReader:
    """Reads inside a session, and so what the session has written."""

    def __init__(self, session: Session) -> None:
        self.session = session

    def rows(self, statement: str, **parameters: SqlValue) -> Sequence[Row]:
        from sqlalchemy import text

        return self.session.connection().execute(text(statement), parameters).all()

    def each_row(self, statement: str) -> Iterator[Row]:
        from sqlalchemy import text

        yield from self.session.connection().execute(
            text(statement), execution_options={"yield_per": STREAMED}
        )


class FileReader:
    """Reads a SQLite file by itself."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self.connection, self.path = connection, path

    def rows(self, statement: str, **parameters: SqlValue) -> Sequence[Row]:
        try:
            return self.connection.execute(statement, parameters).fetchall()
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise DatabaseError(sentence(str(self.path), error)) from error

    def each_row(self, statement: str) -> Iterator[Row]:
        try:
            yield from self.connection.execute(statement)
        except (sqlite3.Error, UnicodeDecodeError) as error:
            raise DatabaseError(sentence(str(self.path), error)) from error

    def close(self) -> None:
        self.connection.close()


def listed(ids: Iterable[int]) -> str:
    """The list of an IN (...); an empty one, which PostgreSQL does not know, holds nothing.

    Ids are ours, and numbers: written out they need no parameters, whose number both databases bound, and whose
    names SQLite looks up one after the other.
    """
    return f"({', '.join(str(int(found)) for found in ids) or 'NULL'})"


def file_reader(database: str) -> FileReader | None:
    """A reader of the SQLite file at a URL or path, or None if anything about it is out of the ordinary."""
    name = database.removeprefix("sqlite:///")
    if name in ("", ":memory:") or "://" in name or any(sign in name for sign in "?%#"):
        return None
    path = Path(name)
    connection = None
    try:
        if not path.is_file() or not path.stat().st_size:
            return None
        connection = sqlite3.connect(
            address(path, readonly=True), uri=True, timeout=LOCK_TIMEOUT, isolation_level=None
        )
        for words in (*SAFE, "query_only = ON"):
            connection.execute(f"PRAGMA {words}")
        connection.execute("BEGIN")
        revisions = connection.execute("SELECT version_num FROM alembic_version").fetchall()
        triggers = connection.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall()
    except (sqlite3.Error, OSError, RuntimeError, UnicodeDecodeError):
        revisions, triggers = [], []
    if connection is not None and (revisions != [(head(),)] or triggers):
        connection.close()
        return None
    return FileReader(connection, path) if connection is not None else None


def address(path: Path, readonly: bool) -> str:
    """The file as SQLite's own URI, which alone can say that nothing may be written."""
    path = path.resolve()
    mode = "rwc"
    if readonly:
        # where writing is possible, the last reader must be able to tidy the log away
        mode = "rw" if os.access(path, os.W_OK) and os.access(path.parent, os.W_OK) else "ro"
    log = path.with_name(path.name + "-wal")
    if mode == "ro" and not os.access(path.parent, os.W_OK) and not (log.exists() and log.stat().st_size):
        mode += "&immutable=1"  # SQLite would want to write an index of the (empty) log beside the file
    return f"file:{quote(str(path))}?mode={mode}"


def sentence(name: str, error: Exception) -> str:
    """What the driver raised, in words, of the database called `name`."""
    reason = str(getattr(error, "orig", None) or error).strip().partition("\n")[0]
    lower = reason.lower()
    for sign, words in (
        ("locked", "is in use by another writer; try again"),
        ("readonly", "cannot be written; it, or its folder, is read-only"),
        ("read-only", "cannot be written; it, or its folder, is read-only"),
        ("is full", "cannot be written: no space left; nothing of this run was stored"),
        ("no space left", "cannot be written: no space left; nothing of this run was stored"),
        ("disk i/o", "cannot be written or read: the disk reports an error, or is full"),
        ("can't decode byte", "is damaged: it holds text that is none; restore it from a copy"),
        ("malformed", "is damaged; restore it from a copy (tracker db check says more)"),
        ("not a database", "is damaged or not a SQLite database; restore it from a copy"),
        ("unable to open", "cannot be opened; check the path and its permissions"),
    ):
        if sign in lower:
            return f"the database {name} {words}"
    return f"the database {name} failed: {reason[:300]}"
