"""How fast is the history? Records a million samples as nights of 1000 series, then asks the commands that people wait
for, start-up included: two versions side by side, one series over all nights, a thousand noisy nights of a run time
with a change point.
"""

from __future__ import annotations

import random
import resource
import subprocess
import sys
import tempfile

import msgspec
from sqlalchemy.orm import Session

from bench.costs import asked, bench, cost, in_units
from spook_tracker.tracker.document.run_document import (
    EngineVersion,
    Machine,
    RunDocument,
    Sample,
    SeriesDefinition,
)
from spook_tracker.tracker.store.database import open_database
from spook_tracker.tracker.store.record import record

SERIES = 1000  # in one night
NIGHTS = 1000
NOISE, STEP = 0.01, 1.1  # of a run time over the noisy nights, and by how much it rises after 600 of them
CHANGED = 0.02  # of them have other bits than the night before; most values never change
COMMANDS = {
    "compare": ("compare", "--engine", "spook", "previous", "latest"),
    "trend": ("trend", "test7", "metric7"),
    "noisy_trend": ("trend", "noisy"),
}


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


def command(*words: str) -> float:
    """Seconds of the processor of a command of the tracker, as a user runs it."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-m", "spook_tracker", *words], stdout=subprocess.DEVNULL, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def commands() -> dict[str, float]:
    """Each command among a million samples, the quicker of two times."""
    series, chance = definitions(), random.Random(1)
    time_of = msgspec.structs.replace(
        series[0], key="noisy/plain/time", test="noisy", metric="time", kind="time", better="smaller", unit="s",
        role="reported", limit=None, time_step=None,
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{folder}/bench.db"
        with Session(engine := open_database(url)) as session:
            for number in range(NIGHTS + 1):
                record(session, night(number, series, chance))
            for number in range(1000):
                record(session, noisy(number, time_of, chance))
        engine.dispose()
        return {
            name: in_units(min(command(*words, "--db", url) for _ in range(2)), "entry")
            for name, words in COMMANDS.items()
        }


TESTS = {
    "storage": bench(
        "History",
        "What do commands cost in a history of a million samples?",
        asked(
            "a million samples",
            commands,
            *(
                cost(name, f"`tracker {' '.join(words)}`", 2.2e6, "three tenths of a second", unit="entry")
                for name, words in COMMANDS.items()
            ),
        ),
        beside="Python on this machine",
    )
}
