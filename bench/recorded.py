"""The recorded night of all engines and the recorded releases of some, as files that come with the sources.

    python bench/recorded.py               write bench/recorded/ from what `make engines` and `make engine-releases` measured
    python bench/recorded.py --check       which tests are asked otherwise by now, and how many that is of all
    python bench/recorded.py --restore     the databases again from the files, so that single tests can be asked anew
    python bench/recorded.py --releases    measure the newest releases of MuJoCo, Exudyn and Rapier that are not measured yet

The files hold run documents without drawings and motions, of each engine the newest answer to every test. `make nightly`
shows them on its website beside tonight's own. A test whose definition has changed since is left out there by name; too many
of them, and a test of the suite is red: `make recorded TESTS="door pendulum"` asks those alone, `make recorded` all.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

sys.path.insert(0, str(Path(__file__).parent.parent))

import spook_tracker.tracker as tracker
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.run_document import RunDocument, Sample, SeriesDefinition, Timing
from spook_tracker.tracker.measure.ladder import rung_series
from spook_tracker.tracker.measure.machine import machine as this_machine
from spook_tracker.tracker.measure.question import metric_series
from spook_tracker.tracker.store.database import session_on
from spook_tracker.tracker.store.months import import_months, write_runs
from spook_tracker.tracker.website import recorded

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "bench" / "recorded"
ENGINES_DB, RELEASES_DB = "sqlite:///build/engines.db", "sqlite:///build/engine-releases.db"
OURS = "spook"
MOST_STALE = 0.2  # of the tests: as many teams' changes as a site can leave out and still answer
RELEASED = ("mujoco", "exudyn", "rapier")
RELEASE_TESTS = (  # what its makers' changelogs speak of: docs/mujoco-releases.md
    "blow", "double_pendulum", "edge_roll", "falling_object", "force_ratio", "friction", "hanging_chain", "loaded_rods",
    "oscillator_spring", "overhang", "pendulum", "resting_ball", "resting_box", "resting_stack", "rocking_block",
    "rolling_coin", "rolling_friction", "rolling_sphere", "slip_angle", "spinning_top", "swinging_door",
)  # fmt: skip
CURE = 'ask them anew with: make recorded TESTS="{}"'


def occasions(database: str) -> Path:
    """Where the occasions of the nights in a database stand: beside it."""
    return Path(database.removeprefix("sqlite:///")).with_suffix(".occasions.json")


def add_occasion(database: str, occasion: recorded.Occasion) -> None:
    """Note how a night went."""
    file = occasions(database)
    found = msgspec.json.decode(file.read_bytes(), type=list[recorded.Occasion]) if file.exists() else []
    file.write_bytes(msgspec.json.format(msgspec.json.encode([*found, occasion]), indent=1) + b"\n")


def occasion_lines(database: str) -> list[str]:
    """How busy the machine was, for a page; nothing where it is not known."""
    if not database or not (file := occasions(database)).exists():
        return []
    newest = {one.engine: one for one in msgspec.json.decode(file.read_bytes(), type=list[recorded.Occasion])}
    loads = [load for one in newest.values() for load in one.load]
    busiest = max(newest.values(), key=lambda one: max(one.load))
    return [
        f"The machine's load was {min(loads):g} to {max(loads):g} meanwhile, highest around {busiest.engine}; all nights took "
        f"{sum(one.seconds for one in newest.values()) / 60.0:.0f} min so.",
        "Run times are the processor's, so that little of it is in them; limits are of processor time, errors know nothing of it.",
        *dict.fromkeys(f"In this night {one.note}." for one in newest.values() if one.note),
    ]


def newest_answers(runs: Iterable[RunDocument]) -> Iterator[RunDocument]:
    """Runs of one engine, the newest first, each with those tests alone that no newer one was asked."""
    later: set[str] = set()
    for run in runs:
        kept = {d.key for d in run.series if d.test not in later}
        if kept:
            yield msgspec.structs.replace(
                run,
                tests=tuple(card for card in run.tests if card.name not in later),
                series=tuple(d for d in run.series if d.key in kept),
                samples=tuple(_compared(s) for s in run.samples if s.series in kept),
            )
        later |= {d.test for d in run.series}


def _compared(sample: Sample) -> Sample:
    """What is compared with other engines: no bits of this machine, of the run times the repeats alone."""
    timing = sample.timing and Timing(
        seconds=sample.timing.seconds,
        cpu_seconds=sample.timing.cpu_seconds,
        runs_per_repeat=sample.timing.runs_per_repeat,
    )
    return msgspec.structs.replace(sample, state_hash="", counters={}, timing=timing)


def write(engines: str, releases: str, folder: Path, nights: Any) -> None:
    """The files, from the two databases; `nights` chooses the runs of each engine (bench/engines.py)."""
    folder.mkdir(parents=True, exist_ok=True)
    with session_on(engines, readonly=True) as session:
        history = tracker.History(session)
        found = [
            run
            for runs in nights(history).values()
            for run in newest_answers(history.document(info.id) for info in runs)
        ]
    write_runs(folder / recorded.NIGHT, found)
    names = {run.engine.name for run in found}
    noted = msgspec.json.decode(occasions(engines).read_bytes(), type=list[recorded.Occasion])
    newest = {one.engine: one for one in noted if one.engine in names}
    (folder / recorded.OCCASION).write_bytes(
        msgspec.json.format(msgspec.json.encode(list(newest.values())), indent=1) + b"\n"
    )
    if Path(releases.removeprefix("sqlite:///")).exists():
        with session_on(releases, readonly=True) as session:
            history = tracker.History(session)
            newest_run = {(run.engine.name, run.engine.version): run.id for run in history.runs()}
            write_runs(folder / recorded.RELEASES, [history.document(one) for one in newest_run.values()])


def asked_now(tests: Mapping[str, Any] = CATALOGUE) -> list[SeriesDefinition]:
    """The series of the catalogue as it stands, nothing being measured."""
    return [
        definition
        for name, test in tests.items()
        for definition in (
            *(metric_series(name, test, m, metric) for m in test.measurements for metric in m.metrics),
            *rung_series(name, test),
        )
    ]


def stale(files: recorded.Files, now: Sequence[SeriesDefinition]) -> tuple[str, ...]:
    """Recorded tests that are asked otherwise by now, or not at all."""
    then = [d for run in files.night if run.engine.name == OURS for d in run.series]
    here = {definition.test for definition in now}
    changed = recorded.asked_otherwise(then, now)
    gone = [test for test in dict.fromkeys(d.test for d in then) if test not in here]
    return (*changed, *gone)


def lines(files: recorded.Files, old: Sequence[str]) -> list[str]:
    """What is recorded, in words."""
    machine = files.night[0].machine
    engines = sorted({f"{run.engine.name} {run.engine.version}" for run in files.night})
    told = [
        f"{len(engines)} engines, measured from {min(run.started for run in files.night)[:10]} on "
        f"{machine.processor}, {machine.cores} cores: {', '.join(engines)}",
        f"{sum(len(run.samples) for run in files.night)} answers, {len(files.releases)} releases of "
        f"{', '.join(sorted({run.engine.name for run in files.releases})) or 'none'}",
    ]
    if old:
        told.append(
            f"asked otherwise by now, left out by name: {', '.join(old)}; {CURE.format(' '.join(old))}"
        )
    return told


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--db", default=ENGINES_DB)
    parser.add_argument("--releases-db", default=RELEASES_DB)
    parser.add_argument("--folder", default=FOLDER, type=Path)
    parser.add_argument("--check", action="store_true", help="write nothing")
    parser.add_argument(
        "--restore", action="store_true", help="record the files in databases that are not there"
    )
    parser.add_argument("--releases", action="store_true", help="measure releases, and write nothing else")
    parser.add_argument("--newest", type=int, default=12, help="of each engine")
    parser.add_argument("--minutes", type=float, default=10.0, help="of each engine; the next call goes on")
    asked: Any = parser.parse_args(arguments)
    if asked.restore:
        restore(asked.folder, asked.db, asked.releases_db)
        return 0
    if asked.releases:
        measure_releases(asked.releases_db, asked.newest, asked.minutes)
        return 0
    if not asked.check:
        import bench.engines as engines

        write(asked.db, asked.releases_db, asked.folder, engines.nights)
    files = recorded.read_files(asked.folder)
    print("\n".join(lines(files, stale(files, asked_now()))))
    return 0


def measure_releases(database: str, newest: int, minutes: float) -> None:
    """Of each engine those of the newest releases that the database has not."""
    for name in RELEASED:
        asked = [
            f"--engine={name}",
            f"--db={database}",
            f"--newest={newest}",
            f"--budget={minutes}",
            "--limit=5",
        ]
        asked += [f"--test={test}" for test in RELEASE_TESTS]
        subprocess.run(
            [sys.executable, "-m", "spook_tracker", "backfill", *asked], check=False
        )  # it names what it lacks


def restore(folder: Path, engines: str, releases: str) -> None:
    """Record the files in each database that is not there. SystemExit on another machine than that of the night."""
    night = recorded.read_files(folder).night[0].machine
    if night.fingerprint != this_machine().fingerprint:
        raise SystemExit(
            f"the recorded night is of another machine ({night.processor}), beside whose run times those of here mean nothing; "
            "measure all: make recorded"
        )
    for database, name in ((engines, recorded.NIGHT), (releases, recorded.RELEASES)):
        file = Path(database.removeprefix("sqlite:///"))
        if file.exists() or not (folder / name).exists():
            continue
        file.parent.mkdir(parents=True, exist_ok=True)
        with session_on(database) as session:
            import_months(session, [folder / name])
        if name == recorded.NIGHT:
            occasions(database).write_bytes((folder / recorded.OCCASION).read_bytes())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
