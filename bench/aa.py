"""Nights of one build, nothing changed: does the judge stay silent? Prints what is red on each night.

    make aa                       twenty nights beside two busy processes
    python bench/aa.py --nights 40 --busy 0 --db sqlite:///aa.db

Each night measures a few tests with their error-against-run-time ladders, records them and judges them against the
nights before, as `tracker nightly` does, and compares it with the night before, as `tracker compare previous latest`
does. Whatever is red is a false alarm; the exit code is 1 if anything was. An
experiment on a database that holds nights already goes on where it stood.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time

from spook_tracker.tracker import library
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.record import record

TESTS = ("pendulum", "n_pendulum", "falling_object")
SPIN = "while True: sum(i * i for i in range(10_000))"  # what a busy process does


def night(database: str, tests: tuple[str, ...]) -> tuple[int, list[str], list[str], int]:
    """One night recorded and judged: how many values it gave, what is red, what is suspected, how many
    rungs were timed again."""
    document = library.run(tests, sweep=True)
    with session_on(database) as session:
        record(session, document)
        document, findings = library.judged_again(session, document, sweep=True)
    again = sum(sample.timing is not None and sample.timing.again is not None for sample in document.samples)
    red = [
        f"{finding.series}: {finding.name}, {finding.verdict.sentence}" for finding in findings if finding.red
    ]
    suspected = [f.series for f in findings if f.judged is not None and f.judged.state == "suspected"]
    return len(findings), red, suspected, again


def compared(database: str) -> tuple[int, list[str]]:
    """The exit code of the comparison with the night before, and what is red in it."""
    with library.History.open(database) as history:
        if len(history.runs()) < 2:
            return 0, []
        runs = sorted(history.runs(), key=lambda run: run.started)[-2:]
        document = library.compare(history, *(run.id for run in runs))
    return document.exit_code, [f"{c.series}: {c.sentence}" for c in document.changes if c.red]


def main() -> int:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("tests", nargs="*", default=TESTS)
    reader.add_argument("--nights", type=int, default=20)
    reader.add_argument(
        "--busy", type=int, default=2, help="processes that only compute, beside the measurements"
    )
    reader.add_argument("--db", default="", help="default: a scratch file")
    asked = reader.parse_args()
    busy = [subprocess.Popen([sys.executable, "-c", SPIN]) for _ in range(asked.busy)]
    nights_red = compared_red = values = 0
    try:
        with tempfile.TemporaryDirectory() as folder:
            database = asked.db or f"sqlite:///{folder}/aa.db"
            for number in range(1, asked.nights + 1):
                start = time.perf_counter()
                judged, red, suspected, again = night(database, tuple(asked.tests))
                code, worse = compared(database)
                compared_red += code != 0
                nights_red, values = nights_red + bool(red), values + judged
                print(
                    f"night {number}: {judged} series judged, {len(red)} red, {len(suspected)} suspected, "
                    f"{again} rungs timed again; comparison with the night before ends with {code}; "
                    f"{time.perf_counter() - start:.0f} s, load {os.getloadavg()[0]:.1f}",
                    *red,
                    *(f"compared: {line}" for line in worse),
                    sep="\n  red: ",
                    flush=True,
                )
    finally:
        for process in busy:
            process.kill()
            process.wait()
    print(f"{nights_red} of {asked.nights} nights red, {values} night-values judged")
    print(f"{compared_red} of {asked.nights - 1} comparisons of neighbours red")
    return 1 if nights_red or compared_red else 0


if __name__ == "__main__":
    sys.exit(main())
