"""What commands read before they say anything: the history in a database, and what is accepted of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from .options import ACCEPTED, complain

if TYPE_CHECKING:
    from spook_tracker.tracker.judge.accepted import Accepted
    from spook_tracker.tracker.store.history import History


@contextmanager
def history_of(database: str) -> Iterator[History]:
    """The history in a database, for reading; what is dated ahead is said."""
    from spook_tracker.tracker.store.history import History

    with History.open(database) as history:
        if history.ahead:
            complain(history.dated_ahead())
        yield history


def accepted_levels(file: Path | None = None) -> Sequence[Accepted]:
    """Entries of accepted.toml in the folder one works in."""
    from spook_tracker.tracker.judge.accepted import read_accepted

    return read_accepted(file or Path(ACCEPTED))
