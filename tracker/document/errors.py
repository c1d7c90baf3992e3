"""What the tracker says when it cannot go on: one sentence, and the exit code a script can act on.

TrackerError            exit code 2
├── DatabaseError       the database cannot be opened, read or written
│   └── DatabaseUnusable    what it holds is of no use
├── DocumentError       a run document is not valid
├── UnknownName         (LookupError) no such version, run or series, or more than one
└── NotComparable       exit code 3: both exist, but comparing them would say nothing
"""

from __future__ import annotations

from typing import ClassVar


class TrackerError(Exception):
    """Base of all; `str(error)` is the sentence for the user: one line, whatever it repeats of what was given."""

    exit_code: ClassVar[int] = 2

    def __init__(self, sentence: str = "") -> None:
        super().__init__(" ".join(sentence.splitlines()))


class DatabaseError(TrackerError):
    """The database cannot be opened, read or written."""


class DatabaseUnusable(DatabaseError):
    """What the database holds is damaged, of a later tracker, or no history; opening it again will not help."""


class DocumentError(TrackerError, ValueError):
    """A run document is not valid; the message names the place in it."""


class UnknownName(TrackerError, LookupError):
    """No version, run or series of that name, or several; `near` holds names that were meant, perhaps."""

    def __init__(self, sentence: str, near: tuple[str, ...] = ()) -> None:
        super().__init__(sentence)
        self.near = near


class NotComparable(TrackerError):
    """Both sides exist, but comparing them would say nothing."""

    exit_code: ClassVar[int] = 3
