"""Runs as files: one JSON document for each run. What is exported here can be imported anywhere, any number
of times; results of other machines, engines and tools come in the same way.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.json_form import encode, readable
from spook_tracker.tracker.document.run_document import RunDocument

from .border import MAX_BYTES, checked, decoded
from .history import History
from .record import record_together
from .rows import moment
from .stored_runs import A_DAY
from .versions import RunInfo

TOGETHER = 5_000  # samples, and a little more, in one transaction


@dataclass(frozen=True, slots=True)
class Imported:
    """What an import did: ids of the runs stored now, and of those that were there before."""

    stored: tuple[str, ...]
    present: tuple[str, ...]


def encoded(run: RunDocument) -> bytes:
    """The document as JSON, one line for each part, with a line feed at the end."""
    return readable(checked(run)).encode() + b"\n"


def write_document(run: RunDocument, path: Path) -> None:
    """Write one document; a reader sees the old file or the whole new one. DocumentError if it cannot."""
    content = encoded(run)
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        beside.write_bytes(content)
        beside.replace(path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise DocumentError(f"{path} cannot be written: {error.strerror}") from None


def export_runs(history: History, folder: Path, names: Iterable[str] = ()) -> tuple[Path, ...]:
    """Write the runs that `names` stand for (none: all) into `folder`, a file each; returns the files."""
    runs = [history.resolve(name) for name in names] or list(history.runs())
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DocumentError(f"the folder {folder} cannot be made: {error.strerror}") from None
    written = []
    for run in dict.fromkeys(runs):
        path = folder / file_name(run)
        write_document(history.document(run.id), path)
        written.append(path)
    return tuple(written)


def file_name(run: RunInfo) -> str:
    """A name that sorts by time and is safe on every system, whatever the id is made of."""
    slug = re.sub(r"[^A-Za-z0-9-]+", "-", run.id).strip("-")[:36]
    mark = hashlib.sha256(run.id.encode()).hexdigest()[:8]
    return f"{run.started_at:%Y%m%dT%H%M%SZ}-{slug or 'run'}-{mark}.json"


def import_files(session: Session, paths: Iterable[Path]) -> Imported:
    """Store the documents in `paths`: files, or folders of *.json files. Runs already there are left alone.

    Every file is read and validated before anything is written: DocumentError names the file and the place
    in it. Each run is whole or absent, so an interrupted import can simply be repeated.
    """
    files = list(_files(paths))
    whole: set[bytes] = set()  # digests of what needs no second look when it is read to be stored
    for file in files:
        refuse_ahead(read_document(file, whole), str(file))
    stored: list[str] = []
    present: list[str] = []
    for runs in _together(read_document(file, whole) for file in files):
        for run, new in zip(runs, record_together(session, runs), strict=True):
            (stored if new else present).append(run.id)
    return Imported(tuple(stored), tuple(present))


def record_all(session: Session, runs: Iterable[RunDocument]) -> list[bool]:
    """Store runs that were made from other files, many in a transaction; whether each is new. DocumentError."""
    whole = (decoded(encode(run), run.id) for run in runs)
    return [new for together in _together(whole) for new in record_together(session, together)]


def refuse_ahead(run: RunDocument, origin: str) -> None:
    """DocumentError if a run is dated ahead of this clock by more than clocks differ."""
    if moment(run.started) > datetime.now(UTC) + A_DAY:
        raise DocumentError(
            f"{origin}: the run {run.id} is dated {run.started}, more than a day ahead of this clock; some clock is wrong"
        )


def _together(runs: Iterable[RunDocument]) -> Iterator[list[RunDocument]]:
    """Runs that are stored in one transaction: so many that it is short, and other writers need not wait."""
    found: list[RunDocument] = []
    for run in runs:
        found.append(run)
        if sum(len(one.samples) for one in found) >= TOGETHER:
            yield found
            found = []
    if found:
        yield found


def read_document(path: Path, whole: set[bytes] | None = None) -> RunDocument:
    """The run document in a file. DocumentError if it cannot be read or is not valid; `whole` as for `decoded`."""
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise DocumentError(f"{path} cannot be read: {error.strerror}") from None
    return decoded(content, str(path), whole)


def _files(paths: Iterable[Path]) -> Iterator[Path]:
    for path in paths:
        if not path.is_dir():
            yield path
            continue
        found = sorted(file for file in path.glob("*.json") if not file.name.startswith("."))
        if not found:
            raise DocumentError(f"the folder {path} holds no *.json files")
        yield from found
