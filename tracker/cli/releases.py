"""`tracker backfill`: the history of another engine, release by release, from the first day."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import click

from spook_tracker.tracker.cli.options import database_option, example, limit_option, workers_option

SEEN = 1e-6  # relative: below it a value that changed is rounding to a reader of releases


@click.command(epilog=example("tracker backfill --engine mujoco 3.3.7 3.4.0 --test friction"))
@click.argument("versions", nargs=-1, metavar="[VERSION]...")
@click.option("--engine", required=True, metavar="NAME", help="An engine that is released as a package.")
@click.option("--test", "tests", multiple=True, metavar="TEST", help="Only this test; may be repeated.")
@click.option("--newest", type=click.IntRange(min=1), metavar="N", help="Only the newest N of them.")
@click.option(
    "--keep",
    "folder",
    metavar="DIR",
    default=".tracker-releases",
    show_default=True,
    type=click.Path(path_type=Path),
    help="Where releases are installed.",
)
@click.option("--catalogue", default="spook_tracker.scalar_tests.catalogue:CATALOGUE", metavar="MODULE:NAME")
@limit_option
@workers_option
@database_option
def backfill(
    versions: tuple[str, ...],
    engine: str,
    tests: tuple[str, ...],
    newest: int | None,
    folder: Path,
    catalogue: str,
    limit: float | None,
    workers: int,
    time_limit: float,
    database: str,
) -> None:
    """Install released versions of an engine, measure each, and record them in release order.

    A release that is recorded already is not measured again; one that cannot be installed or does not start
    is named and passed over. In the end every change between two releases is named with its release.
    """
    import spook_tracker.tracker.measure.releases as releases
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.library import record

    chosen = releases.choose(releases.released(engine), versions, newest)
    have = _recorded(database, engine)
    measured: list[str] = []
    for place, version in enumerate(chosen, start=1):
        heading = f"[{place}/{len(chosen)}] {engine} {version}"
        if version in have:
            say(f"{heading}: recorded already")
            measured.append(version)
            continue
        try:
            where = releases.install(engine, version, folder.resolve())
            document = releases.measure_release(
                engine, where, tests, limit=limit, time_limit=time_limit, catalogue=catalogue, workers=workers
            )
        except releases.ReleaseError as error:
            say(f"{heading}: {error}")
            continue
        record(document, database)
        measured.append(version)
        values = sum(sample.outcome == "value" for sample in document.samples)
        say(f"{heading}: {values} of {len(document.samples)} values")
    say("\n".join(changes(database, engine, measured)))


def _recorded(database: str, engine: str) -> set[str]:
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.history import History

    with session_on(database) as session:  # made if it is not there yet
        return {run.engine.version for run in History(session).runs() if run.engine.name == engine}


def changes(database: str, engine: str, versions: list[str]) -> list[str]:
    """What each release changed, worst first, as `tracker compare` judges it."""
    from spook_tracker.tracker.cli.history import history_of
    from spook_tracker.tracker.library import compare

    lines: list[str] = []
    with history_of(database) as history:
        for before, after in itertools.pairwise(versions):
            found = compare(history, f"{engine}@{before}", f"{engine}@{after}")
            told = [change for change in found.changes if _visible(change)]
            lines.append(f"{engine} {after} after {before}: {len(told) or 'no'} changes")
            lines += [f"  {change.word:<14} {change.series}  {_values(change)}" for change in told]
    return lines


def _visible(change: Any) -> bool:
    """A change of class, or of value beyond rounding; run times of different nights say nothing here."""
    if change.kind in ("time", "run_time") or change.before is None or change.after is None:
        return False
    if change.before_outcome != change.after_outcome:
        return True
    before, after = float(change.before), float(change.after)
    return abs(after - before) > SEEN * max(abs(before), abs(after)) and abs(after - before) > 1e-12


def _values(change: Any) -> str:
    from spook_tracker.tracker.judge.standing import HAVE_VALUES

    def word(value: Any, outcome: str) -> str:
        return f"{float(value):.6g}" if outcome in HAVE_VALUES else outcome.replace("_", " ")

    before = word(change.before, change.before_outcome)
    return f"{before} -> {word(change.after, change.after_outcome)} {change.unit}"
