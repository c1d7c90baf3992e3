"""How does the history grow? Nights of 1000 series up to ten million samples, on SQLite and on PostgreSQL, and at each
size what people wait for: one night in, one series, one comparison, the website, and how large it all is.

    python bench/bench_growth.py [--samples 100000 1000000 10000000] [--only sqlite] [--without-website]

The first hundred nights are recorded as any other; further ones are copied inside the database, 2 % of their values
changed, which takes a tenth of the time and leaves the same rows. Each measure is a command of its own, as a user runs
it, start included, the less of two goes; times are of the processor, on PostgreSQL the server's beside the client's.
What is there beyond the smallest size grows with a power of the samples: its exponent is taken between the two largest
sizes, and carried on to a hundred million, on paper. Ten million are 27 years of these nights. Exit code 1 where an exponent is above GROWS,
one night in costs more than NIGHT times what it costs in the smallest history, or one more night of the website more than
MORE seconds (on another machine as much more as Python takes there) or MOST_MEMORY.
"""

from __future__ import annotations

import argparse
import contextlib
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from sqlalchemy import BigInteger, Column, Connection, Engine, MetaData, Table, insert, select, text
from sqlalchemy.orm import Session

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.bench_storage import CHANGED, SERIES, definitions, night
from bench.floors import here
from spook_tracker.tracker.document.run_document import RunDocument, SeriesDefinition
from spook_tracker.tracker.store import models, rows
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.identity import identity
from spook_tracker.tracker.store.record import record
from spook_tracker.tracker.store.transfer import write_document

RECORDED = 100  # nights that go the usual way before others are copied
AT_ONCE = 500  # nights in one statement
LOOKS = 0.02  # s between two looks at a command's memory
NOISE = 0.1  # of a measure: a smaller difference between two sizes is none
GROWS = 1.3  # exponent; 1.17 at most when it was set
NIGHT = 1.5  # × one night in, of the smallest size; less than 1 when it was set
MORE = 5.0  # s of the processor for one more night of a website, of whatever size
MOST_MEMORY = 0.6  # GB, the same
PLANNED = 100_000_000  # samples, on paper
MEASURES = ("one night in", "one series", "one comparison", "the website", "one more night of it")
CHANCE = {"sqlite": f"abs(random() % {round(1 / CHANGED)}) = 0", "postgresql": f"random() < {CHANGED}"}


@dataclass
class Measured:
    """One size of one database."""

    samples: int
    size: int  # bytes
    seconds: dict[str, float] = field(default_factory=dict)  # of the processor
    memory: dict[str, float] = field(default_factory=dict)  # GB, of the command at its largest


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


def measure(place: Place, engine: Engine, number: int, folder: Path, without_website: bool) -> Measured:
    """What people wait for in a history of that many nights; it has three more afterwards."""
    series, chance = definitions(), random.Random(number)
    if engine.dialect.name == "postgresql":
        with engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.execute(text("VACUUM ANALYZE"))
            size = connection.scalar(text("SELECT pg_database_size(current_database())"))
    else:
        size = Path(str(engine.url.database)).stat().st_size
    found = Measured(number * SERIES, int(size or 0))
    for further in (number, number + 1, number + 2):
        write_document(night(further, series, chance), folder / f"{further}.json")
    asked: dict[str, list[tuple[str, ...]]] = {
        "one night in": [("import", str(folder / f"{n}.json")) for n in (number, number + 1)],
        "one series": [("trend", "test7", "metric7")] * 2,
        "one comparison": [("compare", "previous", "latest")] * 2,
        "the website": [("publish", "--out", str(folder / "public"))],
        "one more night of it": [("publish", "--out", str(folder / "public"))],
    }
    for name in MEASURES:
        if without_website and name in MEASURES[3:]:
            continue
        if name == "one more night of it":
            command(place, "import", str(folder / f"{number + 2}.json"))
        taken = [command(place, *words) for words in asked[name]]
        found.seconds[name], found.memory[name] = (
            min(seconds for seconds, _ in taken),
            max(gb for _, gb in taken),
        )
        print(f"  {found.samples:>11,} samples, {name}: {found.seconds[name]:.2f} s, "
              f"{found.memory[name]:.2f} GB", flush=True)  # fmt: skip
    shutil.rmtree(folder / "public", ignore_errors=True)
    (folder / ".public.kept").unlink(missing_ok=True)
    return found


def table(kind: str, found: list[Measured]) -> Iterator[str]:
    """What was measured, the exponent between the two largest sizes, and what follows for the size on paper."""
    yield f"| {kind} | {' | '.join(f'{at.samples:,}' for at in found)} | exponent | {PLANNED:,}, on paper |"
    yield "|---" * (len(found) + 3) + "|"
    for name in MEASURES:
        yield line(
            name, [(at.samples, at.seconds[name]) for at in found if name in at.seconds], "s", len(found)
        )
    for name in MEASURES[3:]:
        memory = [(at.samples, at.memory[name]) for at in found if name in at.memory]
        yield line(f"{name}, memory", memory, "GB", len(found))
    yield line("the database", [(at.samples, at.size / 1e9) for at in found], "GB", len(found))


def two_digits(value: float) -> str:
    """Two significant digits, without an exponent."""
    rounded = float(f"{value:.2g}")
    return f"{rounded:.0f}" if rounded >= 10.0 else f"{rounded:g}"


def exponent(values: list[tuple[int, float]]) -> float | None:
    """Of what grows beyond the smallest size; none where there are too few sizes, or they differ by noise alone."""
    if len(values) < 3:
        return None
    (_, least), (smaller, before), (larger, last) = values[0], *values[-2:]
    if last - before < NOISE * last or before <= least:
        return None
    return math.log((last - least) / (before - least)) / math.log(larger / smaller)


def line(name: str, values: list[tuple[int, float]], unit: str, columns: int) -> str:
    """One measure over the sizes."""
    told = [f"{two_digits(value)} {unit}" for _, value in values]
    told += ["not measured"] * (columns - len(told))
    if len(values) < 3:
        return f"| {name} | {' | '.join(told)} | | |"
    (_, least), (_, before), (larger, last) = values[0], *values[-2:]
    if last - before < NOISE * last:
        return f"| {name} | {' | '.join(told)} | none seen | {two_digits(last)} {unit} |"
    power = exponent(values)
    if power is None:  # no growth to carry on: the smallest two are noise
        return f"| {name} | {' | '.join(told)} | | |"
    planned = least + (last - least) * (PLANNED / larger) ** power
    return f"| {name} | {' | '.join(told)} | {power:.2f} | {two_digits(planned)} {unit} |"


def missed(kind: str, found: list[Measured]) -> list[str]:
    """What grows too much, a sentence each."""
    over = []
    measures = {
        name: [(at.samples, at.seconds[name]) for at in found if name in at.seconds]
        for name in MEASURES[:4]  # the last has a limit of its own
    }
    measures["memory"] = [
        (at.samples, at.memory["the website"]) for at in found if "the website" in at.memory
    ]
    measures["the database"] = [(at.samples, at.size / 1e9) for at in found]
    for name, values in measures.items():
        power = exponent(values)
        if power is not None and power > GROWS:
            over.append(f"{kind}: {name} grows with the power {power:.2f} (limit {GROWS:g})")
    for at in found:
        name = "one more night of it"
        if kind == "SQLite" and at.seconds.get(name, 0.0) > here(MORE, "interpreter"):
            over.append(
                f"{kind}: {name} takes {at.seconds[name]:.1f} s (limit {here(MORE, 'interpreter'):.1f})"
            )
        if at.memory.get(name, 0.0) > MOST_MEMORY:
            over.append(f"{kind}: {name} takes {at.memory[name]:.2f} GB (limit {MOST_MEMORY:g})")
    nights = measures["one night in"]
    if nights and nights[-1][1] > NIGHT * nights[0][1]:
        over.append(f"{kind}: one night in takes {nights[-1][1] / nights[0][1]:.1f} × (limit {NIGHT:g})")
    return over


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


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    options.add_argument("--samples", type=int, nargs="+", default=[100_000, 1_000_000, 10_000_000])
    options.add_argument("--only", choices=("sqlite", "postgresql"), help="one kind of database")
    options.add_argument(
        "--without-website", action="store_true", help="it needs some 6 GB of memory at ten million"
    )
    given = options.parse_known_args()[0]
    over: list[str] = []
    for kind in [given.only] if given.only else ["sqlite", "postgresql"]:
        with tempfile.TemporaryDirectory() as name, place_of(kind, Path(name)) as place:
            engine, there, found = open_database(place.url), 0, []
            for samples in sorted(given.samples):
                nights = max(2, samples // SERIES)
                start = time.process_time()
                fill(engine, there, nights, definitions())
                print(f"  filled to {nights * SERIES:,} in {time.process_time() - start:.0f} s of our processor time",
                      flush=True)  # fmt: skip
                engine.dispose()
                found.append(measure(place, engine, nights, Path(name), given.without_website))
                there = nights + 3
            engine.dispose()
        name_of_kind = {"sqlite": "SQLite", "postgresql": "PostgreSQL"}[kind]
        print("\n".join(table(name_of_kind, found)), flush=True)
        over += missed(name_of_kind, found)
    for sentence in over:
        print(f"MISSED: {sentence}")
    return 1 if over else 0


if __name__ == "__main__":
    sys.exit(main())
