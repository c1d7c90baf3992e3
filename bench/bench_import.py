"""What it costs to import a history: nights with their figures as files, read, checked and stored.

Synthetic runs (`tests/histories/synthetic.py`) stand for the nights, 0.3 MB of JSON each, most of it figures. Beside the
import, between its goes, the same by hand: files read as plain JSON, each sample and each definition a row, each figure
deflated, one transaction. The lesser of the goes counts.
"""

from __future__ import annotations

import resource
import sqlite3
import subprocess
import sys
import tempfile
import time
import zlib
from datetime import datetime, timedelta
from pathlib import Path

import msgspec

from bench.costs import asked, bench, cost
from spook_tracker.tracker.store.transfer import write_document
from tests.histories.synthetic import decade

NIGHTS = 1000
GOES = 2
EARLIER = timedelta(days=3650)


def long_ago(moment: str) -> str:
    """The moment as many days earlier: a thousand nights from today on would be ahead of the clock, and refused."""
    return (datetime.fromisoformat(moment) - EARLIER).isoformat()


def imported(folder: Path, database: Path) -> float:
    """Seconds of processor time for the files of the folder, by the command, start included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = ["import", str(folder), "--db", f"sqlite:///{database}"]
    subprocess.run([sys.executable, "-m", "spook_tracker", *words], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def by_hand(folder: Path, database: Path) -> float:
    """The same without any check, knowledge of earlier nights, or a second kind of database."""
    start = time.process_time()
    with sqlite3.connect(database) as connection:
        connection.execute("CREATE TABLE sample (run, series, value, rest)")
        connection.execute("CREATE TABLE definition (run, series, body)")
        connection.execute("CREATE TABLE figure (run, name, body)")
        for number, file in enumerate(sorted(folder.iterdir())):
            run = msgspec.json.decode(file.read_bytes())
            text = msgspec.json.encode
            rows = [(number, s["series"], s["value"], text(s)) for s in run["samples"]]
            connection.executemany("INSERT INTO sample VALUES (?, ?, ?, ?)", rows)
            bodies = [(number, d["key"], text(d)) for d in run["series"]]
            connection.executemany("INSERT INTO definition VALUES (?, ?, ?)", bodies)
            drawn = [(number, f["name"], zlib.compress(text(f), 6)) for f in run["figures"]]
            connection.executemany("INSERT INTO figure VALUES (?, ?, ?)", drawn)
    connection.close()
    return time.process_time() - start


def import_a_history() -> dict[str, float]:
    """The command, start included, by the same by hand."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "runs"
        folder.mkdir()
        for run in decade(NIGHTS).documents.values():
            whole = msgspec.structs.replace(
                run, idempotency_key=run.id, started=long_ago(run.started), finished=long_ago(run.finished)
            )
            write_document(whole, folder / f"{run.id}.json")
        goes = [
            (imported(folder, Path(place) / f"{go}.db"), by_hand(folder, Path(place) / f"{go}.hand.db"))
            for go in range(GOES)
        ]
    took, floor = map(min, zip(*goes, strict=True))
    return {"times_by_hand": took / floor}


TESTS = {
    "import": bench(
        "Import of a history",
        "What does it cost to import a history of files?",
        asked(
            f"{NIGHTS} nights",
            import_a_history,
            cost(
                "times_by_hand",
                "`tracker import`, by plain JSON into plain rows",
                2.0,
                "checks and identities",
            ),
        ),
        beside="the same files stored by hand, unchecked",
    )
}
