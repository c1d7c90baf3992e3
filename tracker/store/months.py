"""The history as one compressed file for each month: what a CI service keeps between nights.

`2026-11.jsonl.xz` holds the run documents of that month, one JSON text a line, the oldest first. Most of a night
is the night before it again, and the compressor's window spans the month: a further night of ours takes about
a twentieth of its document. A night rewrites one file; a checkout of the newest commit is all there is to fetch.
"""

from __future__ import annotations

import lzma
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec
from sqlalchemy import select
from sqlalchemy.orm import Session

from spook_tracker.tracker.document.errors import DatabaseUnusable, DocumentError
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import RunDocument

from . import models
from .border import MAX_BYTES, checked, decoded
from .history import History
from .record import record_checked

NAME = re.compile(r"\d{4,}-\d\d\.jsonl\.xz")
WINDOW = 1 << 26  # bytes: a month of nights, each with the one before it in sight
FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 1, "dict_size": WINDOW}]


class _Id(msgspec.Struct):
    id: str
    started: str


def export_months(history: History, folder: Path) -> tuple[Path, ...]:
    """Bring the files in `folder` up to date; returns those that were written. What they hold stays, byte for byte."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DocumentError(f"the folder {folder} cannot be made: {error.strerror}") from None
    months: dict[str, list[str]] = {}
    for run in sorted(history.runs(), key=lambda run: (run.started_at, run.id)):
        months.setdefault(f"{run.started_at:%Y-%m}", []).append(run.id)
    written = []
    for month, ids in months.items():
        path = folder / f"{month}.jsonl.xz"
        there = {_peek(line, path).id: line for line in _lines(path)} if path.exists() else {}
        new = [run_id for run_id in ids if run_id not in there]
        if not new:
            continue
        lines = {**there, **{run_id: encode(checked(history.document(run_id))) for run_id in new}}
        ordered = sorted(lines.values(), key=lambda line: (_peek(line, path).started, _peek(line, path).id))
        _write(path, ordered)
        written.append(path)
    return tuple(written)


def import_months(session: Session, paths: Iterable[Path]) -> tuple[int, int]:
    """Record the runs in these files; how many are new, and how many were there. A known run is not even decoded."""
    known = set(session.scalars(select(models.Run.id)))
    session.rollback()  # recording begins a transaction of its own
    stored = present = 0
    for path in paths:
        for line in _lines(path):
            if _peek(line, path).id in known:
                present += 1
            elif record_checked(session, decoded(line, str(path))):
                stored += 1
            else:
                present += 1
    return stored, present


def refuse_other(history: History, paths: Iterable[Path]) -> None:
    """DatabaseUnusable if a run is stored otherwise than these files have it: where they travel, they are believed."""
    known = {run.id for run in (*history.runs(), *history.ahead)}
    for path in paths:
        for line in _lines(path):
            if (run_id := _peek(line, path).id) in known:
                kept, stored = decoded(line, str(path)), history.document(run_id)
                if _measured(kept) != _measured(stored):
                    raise DatabaseUnusable(f"the database holds another run {run_id} than {path}")


def _measured(run: RunDocument) -> RunDocument:
    """Without its drawings, which a database drops after some nights, and the same whatever order it is stored in."""
    return msgspec.structs.replace(run, figures=(), maps=(), trajectories=())


def write_runs(path: Path, runs: Iterable[RunDocument]) -> None:
    """Write these runs as one such file, as they come, without drawings and motions. DocumentError if it cannot."""
    _write(path, [encode(checked(_measured(run))) for run in runs])


def read_runs(path: Path) -> list[RunDocument]:
    """The runs in such a file. DocumentError if it cannot be read or a run in it is not valid."""
    return [decoded(line, str(path)) for line in _lines(path)]


def is_month(path: Path) -> bool:
    """Whether a file is named as those that are written here."""
    return NAME.fullmatch(path.name) is not None


def _peek(line: bytes, path: Path) -> _Id:
    try:
        return msgspec.json.decode(line, type=_Id)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise DocumentError(f"{path} holds a line that is no run: {error}") from None


def _lines(path: Path) -> Iterator[bytes]:
    try:
        with lzma.open(path, "rb") as file:
            while line := file.readline(MAX_BYTES + 1):
                if len(line) > MAX_BYTES:
                    raise DocumentError(f"{path} holds a run of more than {MAX_BYTES >> 20} MB")
                yield line.rstrip(b"\n")
    except OSError as error:
        raise DocumentError(f"{path} cannot be read: {error.strerror}") from None
    except (lzma.LZMAError, EOFError):
        raise DocumentError(f"{path} is damaged, or no xz file; restore it from a copy") from None


def _write(path: Path, lines: Iterable[bytes]) -> None:
    """A reader sees the old file or the whole new one."""
    beside = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with lzma.open(beside, "wb", format=lzma.FORMAT_XZ, filters=FILTERS) as file:
            for line in lines:
                file.write(line + b"\n")
        beside.replace(path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise DocumentError(f"{path} cannot be written: {error.strerror}") from None
