"""Files of other tools into the history: told apart, read as whole documents, stored with what they lost."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from spook_tracker.tracker.document.errors import DocumentError
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.measure.disappeared import LAST, Listed, with_missing
from spook_tracker.tracker.measure.other_folders import beside
from spook_tracker.tracker.measure.other_tools import of_other_tools
from spook_tracker.tracker.measure.record_tables import is_table, meanings, of_tables
from spook_tracker.tracker.measure.short_form import is_short, is_whole, whole
from spook_tracker.tracker.store.border import MAX_BYTES
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.transfer import record_all

if TYPE_CHECKING:
    from spook_tracker.tracker.store.database import Session
    from spook_tracker.tracker.store.versions import RunInfo

GO = re.compile(rb"^Benchmark\S+\s+\d+\s+\S+ ns/op", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Read:
    """What files held that are no run documents of ours."""

    files: frozenset[Path]  # those that were read here
    runs: tuple[tuple[RunDocument, Listed], ...]  # with what their tool says of its benchmarks
    unknown: tuple[str, ...]  # columns of numbers in no known unit
    absent: tuple[str, ...]  # columns that were given a meaning and are in no file
    empty: int  # runs without any value, which are left out


def read(
    files: Iterable[Path], engine: str = "", machine: str = "", branch: str = "", columns: Sequence[str] = ()
) -> Read:
    """Runs in short form and of other tools, as whole documents; other files are left. DocumentError."""
    told = meanings(columns)
    seen: set[Path] = set()
    runs: list[tuple[RunDocument, Listed]] = []
    tables: dict[Path, bytes] = {}
    for file in files:
        if not file.is_file() or file.stat().st_size > MAX_BYTES:
            continue
        content = file.read_bytes()
        if is_whole(content):
            continue
        around = beside(file, engine, machine, branch)
        if is_table(file, content):
            tables[file] = content
        elif (told_runs := of_other_tools(content, str(file), around)) is not None:
            listed = Listed(around.benchmarks, grids=b'"result_columns"' in content)
            runs += [(run, listed) for run in told_runs]
        elif is_short(content):  # only then: asv's files have results, too
            runs.append((whole(content, str(file)), Listed()))
        else:
            _refuse_strange(file, content)
            continue
        seen.add(file)
    found = of_tables(tables, told, beside(next(iter(tables), Path()), engine, machine, branch))
    runs += [(run, Listed()) for run in found.runs]
    whole_runs = tuple(one for one in runs if one[0].samples)
    return Read(frozenset(seen), whole_runs, found.unknown, found.absent, len(runs) - len(whole_runs))


def _refuse_strange(file: Path, content: bytes) -> None:
    """DocumentError for a JSON object of no form that is known, and for Go's text; what else is no JSON is told where it is read."""
    if GO.search(content):
        raise DocumentError(
            f"{file} is what `go test -bench` prints, which tells no commit; bring it as github-action-benchmark's "
            "data.js, or its values as CSV with a column for the commit"
        )
    with suppress(msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        msgspec.json.decode(content, type=dict[str, msgspec.Raw])
        raise DocumentError(
            f"{file} is no run, and of no tool that is known here; bring its values as JSON lines, CSV or a JSON list, "
            "and say with --column what they mean"
        )


def record(session: Session, found: Read) -> tuple[int, int]:
    """Store them; how many are new, and how many were there before."""
    stored = History(session)

    def before(run: RunDocument) -> list[RunDocument]:
        earlier: list[RunInfo] = [
            other
            for other in stored.runs(run.engine.name)
            if other.machine.fingerprint == run.machine.fingerprint and other.started < run.started
        ]
        return [
            stored.document(other.id) for other in sorted(earlier, key=lambda other: other.started)[-LAST:]
        ]

    new = record_all(session, with_missing(found.runs, before))
    return sum(new), len(new) - sum(new)
