"""What it costs to import a history: nights with their figures as files, read, checked and stored.

    python bench/bench_import.py [--nights 1000]

Synthetic runs (`tests/histories/synthetic.py`) stand for the nights, 0.3 MB of JSON each, most of it figures. Times are of
the processor. Beside the import, between its goes, the same by hand: files read as plain JSON, each sample and each
definition a row, each figure deflated, one transaction. Ends with 1 where the lesser of the goes is more than MOST times
the lesser by hand.
"""

from __future__ import annotations

import argparse
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

sys.path.insert(0, str(Path(__file__).parent.parent))

from spook_tracker.tracker.store.transfer import write_document
from tests.histories.synthetic import decade

MOST = 2.0  # ×; 1.6 when it was set
GOES = 2
EARLIER = timedelta(days=3650)


def long_ago(moment: str) -> str:
    """The moment as many days earlier: a thousand nights from today on would be ahead of the clock, and refused."""
    return (datetime.fromisoformat(moment) - EARLIER).isoformat()


def imported(folder: Path, database: Path) -> float:
    """Seconds of processor time for the files of the folder, by the command, start included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    asked = ["import", str(folder), "--db", f"sqlite:///{database}"]
    said = subprocess.run([sys.executable, "-m", "spook_tracker", *asked], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(said.stdout.decode().strip())
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


def main() -> int:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("--nights", type=int, default=1000)
    nights = reader.parse_known_args()[0].nights
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "runs"
        folder.mkdir()
        for run in decade(nights).documents.values():
            whole = msgspec.structs.replace(
                run, idempotency_key=run.id, started=long_ago(run.started), finished=long_ago(run.finished)
            )
            write_document(whole, folder / f"{run.id}.json")
        goes = [
            (imported(folder, Path(place) / f"{go}.db"), by_hand(folder, Path(place) / f"{go}.hand.db"))
            for go in range(GOES)
        ]
    took, floor = map(min, zip(*goes, strict=True))
    print(
        f"{took:.1f} s of processor time, start included; {floor:.1f} s by hand: {took / floor:.2f} × (limit {MOST:g})"
    )
    return 1 if took > MOST * floor else 0


if __name__ == "__main__":
    sys.exit(main())
