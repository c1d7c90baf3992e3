"""What a year of nights costs a CI service that keeps its history as one file a month.

    python bench/bench_months.py [--nights 365]

Synthetic runs (`tests/histories/synthetic.py`, 0.3 MB of JSON each, most of it figures) stand for the nights, one a day;
every run time and one value in fifty is another one each night, as those of a real night are.
Times are of the processor, as `tracker ci night` spends them beside measuring: bringing the files in, with the database
remembered from the night before (the usual case) and without, and writing the month again with one night more.

Limits, as ratios, with exit code 1: a night writes one file, of a twelfth of the year, and takes no more than AGAIN of the
time that all files take; with the database remembered it costs no more than REMEMBERED of bringing everything in; and
files are no larger than SMALL times the plain JSON.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import msgspec

sys.path.insert(0, str(Path(__file__).parent.parent))

from spook_tracker.tracker.document.json_form import encode
from spook_tracker.tracker.document.run_document import RunDocument, Sample
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.months import export_months, import_months
from spook_tracker.tracker.store.record import record
from tests.histories.synthetic import decade

AGAIN = 0.15  # ×; .07 when it was set, and 31 nights of 365 are .085
REMEMBERED = 0.1  # ×; .04 when it was set
SMALL = 0.02  # ×; .01 when it was set
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


def taken(what: str, work: Callable[[], Any], seconds: dict[str, float]) -> Any:
    """Do it and print, and keep, what the processor did for it."""
    start = time.process_time()
    result = work()
    seconds[what] = time.process_time() - start
    print(f"{what:<64}{seconds[what]:8.2f} s", flush=True)
    return result


def missed(claims: dict[str, tuple[float, float]]) -> bool:
    """Whether a value is above its limit; says each."""
    for name, (value, limit) in claims.items():
        print(f"{name}: {value:.3f} × (limit {limit:g}){'' if value <= limit else '  MISSED'}")
    return any(not value <= limit for value, limit in claims.values())


def size(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.iterdir())


def main() -> int:
    reader = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    reader.add_argument("--nights", type=int, default=365)
    nights = reader.parse_known_args()[0].nights
    spent: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        place, url = Path(name), f"sqlite:///{name}/tracker.db"
        months = place / "history"
        plain, chance = 0, random.Random(1)
        with session_on(url) as session:
            for number, run in enumerate(decade(nights).documents.values()):
                day = (FIRST + timedelta(days=number)).isoformat()
                dated = other(run, chance)
                dated = msgspec.structs.replace(dated, idempotency_key=run.id, started=day, finished=day)
                plain += len(encode(dated))
                if number == nights - 1:  # the last day of a month, where its file is largest
                    taken(
                        "write all months but a night",
                        lambda: export_months(History(session), months),
                        spent,
                    )
                    before = size(months)
                record(session, dated)
            files = taken(
                "write the month again with one night more",
                lambda: export_months(History(session), months),
                spent,
            )
        print(f"{nights} nights: {plain / 1e6:.0f} MB as plain JSON, {size(months) / 1e6:.1f} MB in "
              f"{len(list(months.iterdir()))} files; one night more: {(size(months) - before) / 1e3:.0f} kB, "
              f"{len(files)} file of {files[0].stat().st_size / 1e6:.2f} MB written")  # fmt: skip
        every = sorted(months.iterdir())
        with session_on(url) as session:
            there = taken(
                "bring all months in, database remembered", lambda: import_months(session, every), spent
            )
            assert there == (0, nights)
        with session_on(f"sqlite:///{name}/new.db") as session:
            new = taken("bring all months in, database lost", lambda: import_months(session, every), spent)
            assert new == (nights, 0)
        again, remembered, lost = list(spent.values())[1:]
        over = missed(
            {
                "one night more, beside all": (again / spent["write all months but a night"], AGAIN),
                "remembered, beside lost": (remembered / lost, REMEMBERED),
                "files, beside plain JSON": (size(months) / plain, SMALL),
                "files written for one night": (float(len(files)), 1.0),
            }
        )
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
