"""Nights of other engines that were recorded elsewhere and come as files: shown beside tonight's own, stored nowhere.

`make recorded` writes them. Errors compare across machines, run times within one alone: so the night brings our own
engine's answers from its machine, too. A test that is asked otherwise by now is left out by name.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import RunDocument, SeriesDefinition
from spook_tracker.tracker.store.documents import DocumentHistory
from spook_tracker.tracker.store.release_order import in_release_order

from .nights import Book, Chapter, chapters

NIGHT, RELEASES, OCCASION = "engines.jsonl.xz", "releases.jsonl.xz", "occasion.json"


class RecordedError(TrackerError):
    """A folder of recorded nights cannot be read; one sentence that names the file."""


class Occasion(msgspec.Struct, frozen=True, kw_only=True):
    """How one engine's night went: what its run times have to be read with."""

    engine: str
    started: str  # ISO 8601 UTC
    seconds: float  # of the whole night
    load: tuple[float, float]  # the machine's, a minute's mean, as the night began and as it ended
    limit: float  # s, of processor time, for one simulation
    note: str = ""  # what was otherwise than a night is measured now


@dataclass(frozen=True)
class Files:
    """What the folder holds, unread by any page: runs of the night and of releases, oldest first."""

    night: tuple[RunDocument, ...]
    releases: tuple[RunDocument, ...] = ()
    occasions: tuple[Occasion, ...] = ()


@dataclass(frozen=True)
class Recorded:
    """The same as pages need it."""

    chapters: list[Chapter]  # ours first, without the stale tests
    releases: dict[str, Chapter]  # by engine
    occasions: tuple[Occasion, ...]
    stale: tuple[str, ...]  # tests that are asked otherwise tonight


def read_files(folder: Path) -> Files:
    """What `make recorded` wrote there. RecordedError if it is not there or cannot be read."""
    from spook_tracker.tracker.store.months import read_runs  # without such a folder SQLAlchemy is not needed

    try:
        night = read_runs(folder / NIGHT)
        releases = read_runs(folder / RELEASES) if (folder / RELEASES).exists() else []
        occasions = msgspec.json.decode((folder / OCCASION).read_bytes(), type=tuple[Occasion, ...])
    except OSError as error:
        raise RecordedError(f"{folder}: {error.strerror or error}; `make recorded` writes it") from None
    except (msgspec.DecodeError, TrackerError) as error:
        raise RecordedError(
            f"{folder} holds no recorded nights: {error}; `make recorded` writes them"
        ) from None
    if not night:
        raise RecordedError(f"{folder / NIGHT} holds no run; `make recorded` writes it")
    return Files(tuple(night), tuple(releases), occasions)


def told(files: Files, book: Book) -> Recorded:
    """The recorded nights beside the engine that `book` is about."""
    stale = asked_otherwise(
        (d for run in files.night if run.engine.name == book.name for d in run.series),
        [trend.definition for test in book.tests for trend in test.trends],
    )
    found = [_without(chapter, stale) for chapter in _chapters(files.night)]
    found.sort(key=lambda chapter: (chapter.name != book.name, chapter.name))
    releases = {chapter.name: chapter for chapter in _chapters(files.releases) if len(chapter.nights) > 1}
    return Recorded(found, releases, files.occasions, stale)


def asked_otherwise(then: Iterable[SeriesDefinition], now: Iterable[SeriesDefinition]) -> tuple[str, ...]:
    """Tests of which a series was measured under another definition then: the two are not comparable."""
    today = {definition.key: definition.test_version for definition in now}
    return tuple(dict.fromkeys(d.test for d in then if today.get(d.key, d.test_version) != d.test_version))


def _chapters(runs: Sequence[RunDocument]) -> list[Chapter]:
    ordered = in_release_order(sorted(runs, key=lambda run: (run.started, run.id)))
    return chapters(DocumentHistory(ordered))


def _without(chapter: Chapter, stale: Sequence[str]) -> Chapter:
    return replace(chapter, tests=[test for test in chapter.tests if test.name not in stale])
