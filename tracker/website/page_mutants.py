"""Engines that are wrong on purpose: which test caught each, and what it said. Made from a record, not from nights."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from spook_tracker.tracker.document.addresses import page_of
from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.wording import clean

from .nights import Book
from .page_rows import Page

PATH = "mutants.html"


class Mutant(msgspec.Struct, frozen=True):
    """One engine made wrong in one place."""

    name: str
    room: str  # of the sources
    story: str  # what was broken
    caught_by: str  # a scalar test, or a test of the suite
    caught: bool
    said: str  # how the failure was called
    commit: str  # of the engine that was spoiled
    day: str  # ISO 8601


class RecordError(TrackerError):
    """The record of mutants cannot be read; one sentence that names the file."""


def read_mutants(file: Path) -> tuple[Mutant, ...]:
    """The record that `make mutants` writes. RecordError if the file is not one."""
    try:
        return decode(file.read_bytes(), tuple[Mutant, ...])
    except OSError as error:
        raise RecordError(f"{file}: {error.strerror or error}; `make mutants` writes it") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise RecordError(f"{file} is no record of mutants: {error}; `make mutants` writes one") from None


def mutants_page(mutants: Sequence[Mutant], book: Book) -> Page:
    """The table; the missed ones first."""
    tests = {test.name for test in book.tests}
    rows = [
        {
            **msgspec.structs.asdict(mutant),
            "commit": clean(mutant.commit)[:12],
            "state": "pass" if mutant.caught else "fail",
            "by": mutant.caught_by.rpartition("::")[2].replace("_", " ")
            if "::" in mutant.caught_by
            else mutant.caught_by,
            "file": mutant.caught_by.rpartition("::")[0],
            "address": page_of(mutant.caught_by) if mutant.caught_by in tests else "",
        }
        for mutant in sorted(mutants, key=lambda mutant: mutant.caught)
    ]
    caught = sum(mutant.caught for mutant in mutants)
    context = {"mutants": rows, "caught": caught, "missed": len(mutants) - caught}
    return Page(PATH, PATH, "Mutation tests", "Would the tests notice a wrong engine?", context)
