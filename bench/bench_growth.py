"""How does the history grow? Nights of 1000 series up to ten million samples, on SQLite and on PostgreSQL, and at each
size what people wait for: one night in, one series, one comparison, the website, and how large it all is.

The first hundred nights are recorded as any other; further ones are copied inside the database, 2 % of their values
changed, which takes a tenth of the time and leaves the same rows. Each measure is a command of its own, as a user runs
it, start included, the less of two goes; times are of the processor, on PostgreSQL the server's beside the client's.
What is there beyond the smallest size grows with a power of the samples: its exponent is taken between the two largest
sizes. Ten million are 27 years of these nights.
"""

from __future__ import annotations

import contextlib
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from sqlalchemy import BigInteger, Column, Connection, Engine, MetaData, Table, insert, select, text
from sqlalchemy.orm import Session

from bench.bench_storage import CHANGED, SERIES, definitions, night
from bench.costs import asked, bench, cost, in_units
from spook_tracker.scalar_tests.case import Metric
from spook_tracker.tracker.document.run_document import RunDocument, SeriesDefinition
from spook_tracker.tracker.store import models, rows
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.identity import identity
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.transfer import write_document

SIZES = (100_000, 1_000_000, 10_000_000)  # samples
RECORDED = 100  # nights that go the usual way before others are copied
AT_ONCE = 500  # nights in one statement
LOOKS = 0.02  # s between two looks at a command's memory
NOISE = 0.1  # of a measure: a smaller difference between two sizes is none
COMMANDS = ("night", "series", "comparison", "website", "one_more")
SIZED = ("website_memory", "one_more_memory", "database")  # GB
CHANCE = {"sqlite": f"abs(random() % {round(1 / CHANGED)}) = 0", "postgresql": f"random() < {CHANGED}"}


@dataclass
class Place:
    """A database to fill: its URL, and the server's process where there is one."""

    url: str
    server: int | None = None

    def busy(self) -> float:
        """Seconds of processor time that the server's ended connections have taken."""
        if self.server is None:
            return 0.0
        ticks = Path(f"/proc/{self.server}/stat").read_text().rpartition(")")[2].split()[11:15]
        return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")


def fill(engine: Engine, begin: int, end: int, series: tuple[SeriesDefinition, ...]) -> None:
    """Bring the history from `begin` nights to `end`."""
    chance = random.Random(begin)
    with Session(engine) as session:
        for number in range(begin, min(end, RECORDED)):
            record(session, night(number, series, chance))
    for first in range(max(begin, RECORDED), end, AT_ONCE):
        with engine.begin() as connection:
            if connection.dialect.name == "sqlite":
                connection.exec_driver_sql("PRAGMA cache_size = -500000")
            copy(connection, [night(n, (), chance) for n in range(first, min(end, first + AT_ONCE))])


def copy(connection: Connection, nights: list[RunDocument]) -> None:
    """Further nights as copies of a recorded one: engine and run by us, samples and evidence by the database."""
    template = connection.execute(
        select(models.Run.__table__).where(models.Run.idempotency_key == f"night {RECORDED // 2}")
    ).mappings().one()  # fmt: skip
    engines = [rows.engine_row(document.engine) for document in nights]
    runs = [
        dict(template)
        | {
            "key": identity("run", document.id), "id": document.id, "idempotency_key": document.idempotency_key,
            "started_at": rows.moment(document.started), "started": document.started,
            "finished": document.finished, "engine_version_id": engine["id"], "content": document.id[-16:],
        }
        for document, engine in zip(nights, engines, strict=True)
    ]  # fmt: skip
    connection.execute(insert(models.EngineVersion), engines)
    connection.execute(insert(models.Run), runs)
    wanted = Table(
        "wanted", MetaData(), Column("started_at", models.UTCDateTime), Column("run_key", BigInteger),
        prefixes=["TEMPORARY"],
    )  # fmt: skip
    wanted.create(connection)
    connection.execute(insert(wanted), [{"started_at": r["started_at"], "run_key": r["key"]} for r in runs])
    changed = f"s.value + CASE WHEN {CHANCE[connection.dialect.name]} THEN 1e-13 ELSE 0.0 END"
    for model in (models.Sample, models.Evidence):
        names = [column.name for column in model.__table__.columns][2:]
        said = ", ".join(changed if name == "value" else f"s.{name}" for name in names)
        connection.execute(
            text(
                f"INSERT INTO {model.__tablename__} (started_at, run_key, {', '.join(names)}) "
                f"SELECT w.started_at, w.run_key, {said} FROM wanted w CROSS JOIN {model.__tablename__} s "
                "WHERE s.run_key = :run AND s.started_at = (SELECT started_at FROM run WHERE key = :run) "
                "ORDER BY w.started_at, w.run_key, s.series_id"
            ),
            {"run": template["key"]},
        )
    wanted.drop(connection)


def command(place: Place, *words: str) -> tuple[float, float]:
    """Run a command of the tracker as a user does: seconds of processor time, and GB at its largest."""
    before = place.busy()
    process = subprocess.Popen(
        [sys.executable, "-m", "spook_tracker", *words, "--db", place.url], stdout=subprocess.DEVNULL
    )
    largest = 0.0
    while (ended := os.wait4(process.pid, os.WNOHANG))[0] == 0:
        largest = max(largest, largest_so_far(process.pid))
        time.sleep(LOOKS)
    _, status, used = ended
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 1):
        raise SystemExit(f"tracker {' '.join(words)} ended with {process.returncode}")
    time.sleep(0.2)  # the server notices a little later that a connection has ended
    return used.ru_utime + used.ru_stime + place.busy() - before, largest


def largest_so_far(process: int) -> float:
    """GB at its largest of what the process runs; what the system tells of an ended one counts its parent's, too."""
    try:
        told = Path(f"/proc/{process}/status").read_text()
    except OSError:
        return 0.0
    found = [line.split()[1] for line in told.splitlines() if line.startswith("VmHWM:")]
    return int(found[0]) * 1024 / 1e9 if found else 0.0


def measured(place: Place, engine: Engine, number: int, folder: Path) -> dict[str, float]:
    """What people wait for in a history of that many nights [s, GB]; it has three more afterwards."""
    series, chance = definitions(), random.Random(number)
    if engine.dialect.name == "postgresql":
        with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.execute(text("VACUUM ANALYZE"))
            size = connection.scalar(text("SELECT pg_database_size(current_database())"))
    else:
        size = Path(str(engine.url.database)).stat().st_size
    for further in (number, number + 1, number + 2):
        write_document(night(further, series, chance), folder / f"{further}.json")
    publish = ("publish", "--out", str(folder / "public"))
    goes: dict[str, list[tuple[str, ...]]] = {
        "night": [("import", str(folder / f"{n}.json")) for n in (number, number + 1)],
        "series": [("trend", "test7", "metric7")] * 2,
        "comparison": [("compare", "previous", "latest")] * 2,
        "website": [publish],
        "one_more": [("import", str(folder / f"{number + 2}.json")), publish],
    }
    found = {"database": float(size or 0) / 1e9}
    for name, words in goes.items():
        taken = [command(place, *one) for one in words]
        counted = taken[-1:] if name == "one_more" else taken
        found[name] = min(seconds for seconds, _ in counted)
        found[f"{name}_memory"] = max(gb for _, gb in counted)
        print(
            f"  {number * SERIES:>11,} samples, {name}: {found[name]:.2f} s, {found[f'{name}_memory']:.2f} GB",
            flush=True,
        )
    shutil.rmtree(folder / "public", ignore_errors=True)
    (folder / ".public.kept").unlink(missing_ok=True)
    return found


def exponent(sizes: Sequence[int], values: Sequence[float]) -> float:
    """Of what grows beyond the smallest size; 0 where the two largest differ by noise alone."""
    least, before, last = values[0], *values[-2:]
    if last - before < NOISE * last or before <= least:
        return 0.0
    return math.log((last - least) / (before - least)) / math.log(sizes[-1] / sizes[-2])


@contextlib.contextmanager
def place_of(kind: str, folder: Path) -> Iterator[Place]:
    """An empty database of that kind."""
    if kind == "sqlite":
        yield Place(f"sqlite:///{folder}/bench.db")
        return
    from tests.tracker.store.postgresql import MISSING, binaries, running_server

    if (programs := binaries()) is None:
        raise SystemExit(MISSING)
    settings = {"shared_buffers": "512MB", "max_wal_size": "2GB", "work_mem": "64MB"}
    settings["autovacuum"] = "off"  # its time would be taken for that of a query meanwhile
    with running_server(programs, settings, str(folder.parent)) as server, server.new_database() as url:
        number = int((server.folder / "data" / "postmaster.pid").read_text().split()[0])
        yield Place(url, number)


def growing(kind: str) -> dict[str, float]:
    """Every measure at its largest, and how it grows."""
    found = []
    with tempfile.TemporaryDirectory() as name, place_of(kind, Path(name)) as place:
        engine, there = open_database(place.url), 0
        for samples in SIZES:
            nights = samples // SERIES
            fill(engine, there, nights, definitions())
            engine.dispose()
            found.append(measured(place, engine, nights, Path(name)))
            there = nights + 3
        engine.dispose()
    answer = {name: found[-1][name] for name in (*COMMANDS, *SIZED)}
    answer |= {f"{name}_grows": exponent(SIZES, [at[name] for at in found]) for name in (*COMMANDS, *SIZED)}
    return answer | {
        "times_smallest": found[-1]["night"] / found[0]["night"],
        "one_more_entries": in_units(found[-1]["one_more"], "entry"),
    }


def grows(kind: str) -> tuple[Metric, ...]:
    """Limits of what people wait for; one more night of the website is bounded whatever its exponent."""
    lasts = [
        cost(
            name,
            f"with {SIZES[-1]:,} samples",
            0.6 if name == "one_more_memory" else None,
            unit="GB" if name in SIZED else "s",
        )
        for name in (*COMMANDS, *SIZED)
    ]
    powers = [
        cost(
            f"{name}_grows",
            "exponent in the samples",
            None if name.startswith("one_more") else 1.3,
            "a logarithm above 1",
        )
        for name in (*COMMANDS, *SIZED)
    ]
    night = cost(
        "times_smallest",
        "one night in, by that of the smallest history",
        1.5,
        "it reads the last nights alone",
    )
    more = cost(
        "one_more_entries",
        "one more night of the website",
        3.7e7 if kind == "sqlite" else None,
        "five seconds",
        unit="entry",
    )
    return *lasts, *powers, night, more


TESTS = {
    f"growth_{kind}": bench(
        f"Growth on {title}",
        "How does what people wait for grow with the history?",
        asked(f"{SIZES[-1]:,} samples", partial(growing, kind), *grows(kind)),
        beside="smaller histories, and Python on this machine",
    )
    for kind, title in (("sqlite", "SQLite"), ("postgresql", "PostgreSQL"))
}
