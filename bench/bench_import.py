"""What it costs to import a history: nights with their figures as files, read, checked and stored.

    python bench/bench_import.py [--nights 1000]

Synthetic runs (`tests/synthetic_history.py`) stand for the nights, 0.3 MB of JSON each, most of it figures. Times are of
the processor; beside them stands what reading the same files as plain JSON takes, which nothing can be quicker than.
Ends with 1 where a thousand nights take more than ten seconds, on another machine as much more as Python takes there.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from datetime import datetime, timedelta
from pathlib import Path

import msgspec

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.floors import here
from spook_tracker.tracker.store.transfer import write_document
from tests.synthetic_history import decade

MOST = 0.01  # s of the processor a night
EARLIER = timedelta(days=3650)


def long_ago(moment: str) -> str:
    """The moment as many days earlier: a thousand nights from today on would be ahead of the clock, and refused."""
    return (datetime.fromisoformat(moment) - EARLIER).isoformat()


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
        start = time.process_time()
        for file in sorted(folder.iterdir()):
            msgspec.json.decode(file.read_bytes())
        plain = time.process_time() - start
        asked = ["import", str(folder), "--db", f"sqlite:///{place}/tracker.db"]
        said = subprocess.run(
            [sys.executable, "-m", "spook_tracker", *asked], check=True, capture_output=True
        )
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        took = used.ru_utime + used.ru_stime
    print(said.stdout.decode().strip())
    print(f"{took:.1f} s of processor time, start included; {plain:.1f} s is what reading plain JSON takes")
    most = here(MOST * nights, "interpreter")
    if took > most:
        print(f"more than {most:.1f} s of the processor", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
