"""What every night changes on pages that stand still: two small scripts, so that the pages need not be written again."""

from __future__ import annotations

from collections.abc import Sequence

from spook_tracker.tracker.document.wording import clean, clock, day, short_hash, version

from .nights import Book, Night
from .templates import embedded

TONIGHT = "tonight.js"  # when it was measured, and the nights that may be laid beside it
NIGHTS = "charts/nights.js"  # day and commit of every night, for the axes of charts over nights


def tonight_scripts(book: Book) -> dict[str, bytes]:
    """Address and content of both."""
    choices = [[one.key, one.told(book.nights[one.index])] for one in book.earlier]
    tonight = {
        "measured": _measured(book.tonight) if book.nights else "Nothing is measured yet.",
        "earlier": choices,
    }
    days = [[day(night.started), _commit(night)] for night in book.nights]
    return {
        TONIGHT: f"const TONIGHT = {embedded(tonight)};\n".encode("utf-8", "replace"),
        NIGHTS: f"nightsAre({embedded(_short(days))});\n".encode("utf-8", "replace"),
    }


def _measured(night: Night) -> str:
    commit = short_hash(night.engine)
    at = f" at {commit}" if commit else ""
    return f"Measured {clock(night.started)} UTC with {clean(night.engine.name)} {clean(version(night.engine))}{at}."


def _commit(night: Night) -> str:
    return short_hash(night.engine)[:7] or clean(version(night.engine))


def _short(days: Sequence[Sequence[str]]) -> list[list[str]]:
    """A day that several nights share stands once."""
    return [
        ["" if place and told == days[place - 1][0] else told, commit]
        for place, (told, commit) in enumerate(days)
    ]
