"""The whole history as one file that can be handed on."""

from __future__ import annotations

import sqlite3

from spook_tracker.tracker.document.errors import DatabaseError

from .connection import database_url, is_file, shown


def database_file(given: str) -> bytes:
    """The SQLite database as its file, complete although others write. DatabaseError if it is no SQLite file."""
    url = database_url(given)
    if not is_file(url) or url.database is None:
        raise DatabaseError(
            f"{shown(url)} is no file that could be offered; copy it first: tracker db copy FROM sqlite:///FILE"
        )
    source, whole = sqlite3.connect(url.database), sqlite3.connect(":memory:")
    try:
        source.backup(whole)
        whole.execute("PRAGMA journal_mode = DELETE")
        return whole.serialize()
    except sqlite3.Error as error:
        raise DatabaseError(f"{shown(url)} cannot be read: {error}") from None
    finally:
        source.close()
        whole.close()
