"""What a year of nights costs a CI service that keeps its history as one file a month.

Synthetic runs (`tests/histories/synthetic.py`, 0.3 MB of JSON each, most of it figures) stand for the nights, one a day;
every run time and one value in fifty is another one each night, as those of a real night are.
Times are of the processor, as `tracker ci night` spends them beside measuring: bringing the files in, with the database
remembered from the night before (the usual case) and without, and writing the month again with one night more.
"""

from __future__ import annotations

import random
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TypeVar

import msgspec

from bench.costs import asked, bench, cost, exact
from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import RunDocument, Sample
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.months import export_months, import_months
from spook_tracker.tracker.store.record import record
from tests.histories.synthetic import decade

T = TypeVar("T")
NIGHTS = 365
FIRST = datetime(2025, 12, 1, 3, 17, tzinfo=UTC)


def other(run: RunDocument, chance: random.Random) -> RunDocument:
    """A night whose run times, and some of whose values, are new."""

    def changed(sample: Sample) -> Sample:
        if sample.timing is not None:
            seconds = tuple(
                second * (1.0 + 0.01 * chance.gauss(0.0, 1.0)) for second in sample.timing.seconds
            )
            timing = msgspec.structs.replace(sample.timing, seconds=seconds)
            return msgspec.structs.replace(sample, timing=timing)
        if sample.value is None or chance.random() > 0.02:
            return sample
        return msgspec.structs.replace(
            sample, value=type(sample.value)(sample.value * (1.0 + 1e-13 * chance.random()))
        )

    return msgspec.structs.replace(run, samples=tuple(map(changed, run.samples)))


def taken(work: Callable[[], T]) -> tuple[float, T]:
    """Seconds of the processor, and what came of it."""
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def a_year() -> dict[str, float]:
    """One night more on the last day of a month, where its file is largest."""
    with tempfile.TemporaryDirectory() as name:
        url, months = f"sqlite:///{name}/tracker.db", Path(name) / "history"
        plain, chance = 0, random.Random(1)
        with session_on(url) as session:
            for number, run in enumerate(decade(NIGHTS).documents.values()):
                day = (FIRST + timedelta(days=number)).isoformat()
                dated = other(run, chance)
                dated = msgspec.structs.replace(dated, idempotency_key=run.id, started=day, finished=day)
                plain += len(encode(dated))
                if number == NIGHTS - 1:
                    every, _ = taken(lambda: export_months(History(session), months))
                record(session, dated)
            again, written = taken(lambda: export_months(History(session), months))
        files = sorted(months.iterdir())
        size = sum(path.stat().st_size for path in files)
        with session_on(url) as session:
            remembered, there = taken(lambda: import_months(session, files))
        with session_on(f"sqlite:///{name}/new.db") as session:
            lost, new = taken(lambda: import_months(session, files))
        assert (there, new) == ((0, NIGHTS), (NIGHTS, 0))
    return {
        "one_night_more": again / every,
        "remembered": remembered / lost,
        "size": size / plain,
        "files_written": float(len(written)),
    }


TESTS = {
    "months": bench(
        "History as a file a month",
        "What does a night cost where the history is a file a month?",
        asked(
            f"{NIGHTS} nights",
            a_year,
            cost("one_night_more", "its month written, by all written", 0.15, "31 nights of 365 are .085"),
            cost(
                "remembered",
                "all months brought in with the database kept, by lost",
                0.1,
                "nothing is decoded",
            ),
            exact(
                "size", "of the files, by plain JSON", 0.02, "most values never change", unit="1", change=0.01
            ),
            exact("files_written", "for one night", 1.0, "its month's", unit="1"),
        ),
        beside="all months written and brought in, and plain JSON",
    )
}
