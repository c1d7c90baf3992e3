"""How fast is the history? Records a million samples as nights of 1000 series, then reads them in the three ways
that people wait for: two versions side by side, one series over all nights, all series over all nights.

    python bench/bench_storage.py [--samples 1000000] [--db URL]

The default is a SQLite file in a temporary folder. Ends with 1 where `tracker compare` among these samples, or `tracker
trend` of a thousand noisy nights with a change point, takes more than 0.3 s of the processor, start-up included; on another machine as much more as Python takes there.
"""

from __future__ import annotations

import argparse
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
from sqlalchemy import text
from sqlalchemy.orm import Session

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.floors import here
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    RunDocument,
    Sample,
    SeriesDefinition,
)
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.history import History
from spook_tracker.tracker.store.record import record

SERIES = 1000  # in one night
MOST = 0.3  # s of the processor for a command, the quicker of two times
NOISE, STEP = 0.01, 1.1  # of a run time over the noisy nights, and by how much it rises after 600 of them
CHANGED = 0.02  # of them have other bits than the night before; most values never change


def definitions() -> tuple[SeriesDefinition, ...]:
    return tuple(
        SeriesDefinition(
            key=f"test{number % 40}/plain/metric{number}/h=0.0166667",
            test=f"test{number % 40}",
            title="A test",
            configuration="plain",
            metric=f"metric{number}",
            description="A number.",
            unit="m",
            role="gate",
            better="smaller_magnitude",
            kind="scalar",
            time_step=1 / 60,
            parameters={"mass": 1.0},
            limit=1.0,
            limit_source="",
            set_point=None,
            set_point_source="",
            reference=None,
            tolerance=0.0,
            relative_tolerance=1e-9,
            test_version="v1",
        )
        for number in range(SERIES)
    )


def night(number: int, series: tuple[SeriesDefinition, ...], chance: random.Random) -> RunDocument:
    day = f"{1996 + number // 336}-{number // 28 % 12 + 1:02}-{number % 28 + 1:02}"
    return RunDocument(
        schema_version=1,
        id=f"{number:032x}",
        idempotency_key=f"night {number}",
        started=f"{day}T03:17:00+00:00",
        finished=f"{day}T03:20:00+00:00",
        trigger="nightly",
        tracker_version="1",
        ci_address="",
        engine=EngineVersion(
            name="spook",
            version=f"1.0.dev{number}",
            git_hash=f"{number:040x}",
            dirty=False,
            commit_time=f"{day}T00:00:00+00:00",
            parents=(f"{number - 1:040x}",) if number else (),
        ),
        machine=Machine(fingerprint="m", processor="p", cores=2, operating_system="o", float_environment="f"),
        tests=(),
        series=series,
        samples=tuple(
            Sample(
                series=definition.key,
                value=0.5 + 1e-4 * place + (1e-13 if chance.random() < CHANGED else 0.0),
                outcome="value",
                passed=True,
                set_point_held=True,
                counters={"steps": 600, "rows_assembled": 1200},
                state_hash=f"{place:016x}",
            )
            for place, definition in enumerate(series)
        ),
    )


def noisy(number: int, definition: SeriesDefinition, chance: random.Random) -> RunDocument:
    """A night of one run time alone, another engine's."""
    found = night(number, (), chance)
    level = 1e-3 * (STEP if number >= 600 else 1.0) * (1.0 + chance.gauss(0.0, NOISE))
    taken = Sample(series=definition.key, value=level, outcome="value", passed=True, set_point_held=True)
    return msgspec.structs.replace(
        found, id=f"{number:031x}n", idempotency_key=f"noisy {number}", series=(definition,), samples=(taken,),
        engine=msgspec.structs.replace(found.engine, name="noisy"),
    )  # fmt: skip


def command(what: str, *words: str) -> float:
    """Run a command of the tracker as a user does, its start-up included, and print what the processor did for it."""
    before, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([sys.executable, "-m", "spook_tracker", *words], stdout=subprocess.DEVNULL, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{what:<58} {time.perf_counter() - wall:8.3f} s wall {processor:8.3f} s processor", flush=True)
    return processor


@contextmanager
def timed(what: str) -> Iterator[None]:
    wall, processor = time.perf_counter(), time.process_time()
    yield
    wall, processor = time.perf_counter() - wall, time.process_time() - processor
    print(f"{what:<58} {wall:8.3f} s wall {processor:8.3f} s processor", flush=True)


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--samples", type=int, default=1_000_000)
    options.add_argument("--db", default=None, help="an empty database; default: a temporary SQLite file")
    given = options.parse_args()
    nights = max(2, given.samples // SERIES)
    with tempfile.TemporaryDirectory() as folder:
        url = given.db or f"sqlite:///{folder}/bench.db"
        engine = open_database(url)
        series, chance = definitions(), random.Random(1)
        with timed(f"record {nights} nights of {SERIES} samples"), Session(engine) as session:
            for number in range(nights):
                record(session, night(number, series, chance))
        with timed("record one more night"), Session(engine) as session:
            record(session, night(nights, series, chance))
        if engine.dialect.name == "postgresql":
            with engine.begin() as connection:
                connection.execute(text("ANALYZE"))
        engine.dispose()
        for attempt in ("first", "second"):
            with timed(f"open, resolve and read two runs ({attempt} time)"):
                engine = open_database(url, readonly=True)
                with Session(engine) as session:
                    history = History(session)
                    for name in ("previous", "latest"):
                        assert len(history.samples(history.resolve(name).id)) == SERIES
        with Session(engine) as session:
            with timed("read one series over all nights"):
                (found,) = History(session).series([series[7].key]).values()
                assert len(found.points) == nights + 1
            with timed("read all series over all nights, values only"):
                assert len(History(session).series(evidence=False)) == SERIES
        engine.dispose()
        with (
            Session(engine := open_database(url)) as session,
            timed("record 1000 noisy nights of a run time"),
        ):
            (one,) = definitions()[:1]
            time_of = msgspec.structs.replace(
                one, key="noisy/plain/time", test="noisy", metric="time", kind="time", better="smaller", unit="s",
                role="reported", limit=None, time_step=None,
            )  # fmt: skip
            for number in range(1000):
                record(session, noisy(number, time_of, chance))
        engine.dispose()
        over, most = [], here(MOST, "interpreter")
        for words in (
            ("compare", "--engine", "spook", "previous", "latest"),
            ("trend", "test7", "metric7"),
            ("trend", "noisy"),
        ):
            said = " ".join(words)
            taken = [command(f"tracker {said}, with its start", *words, "--db", url) for _ in range(2)]
            over += [f"tracker {said}: {min(taken):.2f} s" for _ in (1,) if min(taken) > most]
    if over:
        print(
            f"more than {here(MOST, 'interpreter'):.2f} s of the processor: {'; '.join(over)}",
            file=sys.stderr,
        )
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
