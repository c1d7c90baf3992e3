"""`tracker backfill` and `tracker releases`: the history of another engine, release by release."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import (
    Seconds,
    catalogue_option,
    database_option,
    example,
    limit_option,
    model_option,
    workers_option,
)

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import RunDocument

KEPT = ".tracker-releases"
MEGABYTE = 1e6


@click.command(
    epilog=example(
        "tracker backfill v0.2.0 v0.3.0 HEAD",
        "tracker backfill --engine mujoco --test resting_stack --budget 20",
        "tracker backfill --engine mujoco 3.3.7 3.4.0 --model robot.xml",
    )
)
@click.argument("versions", nargs=-1, metavar="[REV]...")
@click.option(
    "--engine",
    metavar="NAME",
    help="An engine that is released as a package: REV are its versions; by default all.",
)
@click.option("--sweep", is_flag=True, help="Of commits: also measure error against run time.")
@click.option("--test", "tests", multiple=True, metavar="TEST", help="Only this test; may be repeated.")
@click.option("--newest", type=click.IntRange(min=1), metavar="N", help="Only the newest N of them.")
@click.option(
    "--budget",
    type=Seconds(min=0.0),
    metavar="MINUTES",
    help="Start no release after that time; the next call goes on.",
)
@click.option(
    "--keep",
    "folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help=f"Where releases are installed ({KEPT}) or commits built (.tracker-commits).",
)
@click.option(
    "--out", metavar="DIR", type=click.Path(path_type=Path), help="Publish the website there afterwards."
)
@model_option
@catalogue_option
@limit_option
@workers_option
@database_option
def backfill(
    versions: tuple[str, ...],
    engine: str | None,
    sweep: bool,
    tests: tuple[str, ...],
    newest: int | None,
    budget: float | None,
    folder: Path | None,
    out: Path | None,
    catalogue: str,
    limit: float | None,
    workers: int,
    memory: int,
    time_limit: float,
    database: str,
) -> None:
    """Measure earlier commits of a repository, or released versions of another engine, and record them.

    REV are commits, tags or ranges A..B of the repository in the current folder; [build] of tracker.toml says how to
    build them. Each is built in a folder of its own and measured with today's tests if it can answer them, otherwise
    with its own; the output says with which.

    With --engine, released versions are installed and measured in release order.
    A release that is recorded already is not measured again, so that an interrupted backfill goes on when it is
    called again. One that cannot be installed, does not start or gives no answers is reported and skipped.
    Finally, every change between two releases is listed under its release.
    """
    import spook_tracker.tracker.measure.catalogues as catalogues
    import spook_tracker.tracker.measure.releases as releases

    from .console import say

    if engine is None:
        from .change import run_options
        from .past import KEPT as COMMITS
        from .past import backfill_commits

        if not versions:
            raise click.UsageError(
                "name commits to measure, or --engine NAME for the releases of another engine"
            )
        asked = [*["--sweep"] * sweep, *run_options(workers, limit, memory, time_limit)]
        backfill_commits(versions, tests, asked, folder or Path(COMMITS), database)
        return
    folder = folder or Path(KEPT)
    chosen = releases.choose(releases.released(engine), versions, newest)

    def measure(version: str) -> RunDocument:
        where = releases.install(engine, version, folder.resolve())
        return releases.measure_release(
            engine, where, tests, limit=limit, time_limit=time_limit, memory=memory, catalogue=catalogue,
            workers=workers,
        )  # fmt: skip

    ends = None if budget is None else time.monotonic() + 60.0 * budget
    wanted = tests or tuple(catalogues.find(catalogue))
    for line in progress(engine, chosen, measure, database, ends, wanted):
        say(line)
    if folder.exists():
        taken = releases.size(folder) / MEGABYTE
        say(f"the releases in {folder} take {taken:.0f} MB; delete the folder when you are done measuring")
    _tell(engine, database, None, False)
    if out is not None:
        from spook_tracker.tracker.library import History, publish

        from .recorded import accepted_levels

        with History.open(database) as history:
            publish(history, out, accepted_levels(None))
        say(f"published {out / 'index.html'}")


def progress(
    engine: str,
    chosen: Sequence[str],
    measure: Callable[[str], RunDocument],
    database: str,
    ends: float | None,
    tests: Sequence[str] = (),
) -> Iterator[str]:
    """Measure and record each release; a line as each is done. `ends` is a reading of the monotonic clock.

    One that was asked all these tests before is not measured again.
    """
    from spook_tracker.tracker.library import record
    from spook_tracker.tracker.measure.releases import ReleaseError

    have = _recorded(database, engine, tests)
    for place, version in enumerate(chosen, start=1):
        heading = f"[{place}/{len(chosen)}] {engine} {version}"
        if version in have:
            yield f"{heading}: recorded already"
            continue
        began = time.monotonic()
        if ends is not None and began >= ends:
            yield f"{heading}: time is up; run the same command again to go on"
            return
        try:
            document = measure(version)
            if document.engine.version != version:
                raise ReleaseError(f"it reports version {document.engine.version!r}, so nothing is recorded")
        except ReleaseError as error:
            yield f"{heading}: {error}"
            continue
        record(document, database)
        values = sum(sample.outcome in ("value", "unsettled") for sample in document.samples)
        yield f"{heading}: {values} of {len(document.samples)} values in {time.monotonic() - began:.0f} s"


def _recorded(database: str, engine: str, tests: Sequence[str]) -> set[str]:
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.history import History

    with session_on(database) as session:  # made if it is not there yet
        return {
            run.engine.version
            for run in History(session).runs()
            if run.engine.name == engine and (run.asked is None or {*tests} <= {*run.asked.tests})
        }


@click.command("releases", epilog=example("tracker releases mujoco --changelog docs/mujoco-changelog.toml"))
@click.argument("engine")
@click.option(
    "--changelog",
    metavar="FILE",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Its own changelog as TOML: shows which of its changes were found, which were missed, and what is not in it.",
)
@click.option("--markdown", is_flag=True, help="Print a page, with every change.")
@database_option
def releases_command(engine: str, changelog: Path | None, markdown: bool, database: str) -> None:
    """Say what each recorded release of an engine changed, without measuring anything."""
    _tell(engine, database, changelog, markdown)


def _tell(engine: str, database: str, changelog: Path | None, markdown: bool) -> None:
    from spook_tracker.tracker.judge.release_notes import read_changelog

    from .console import say
    from .recorded import history_of
    from .release_report import page, steps_between, text_lines

    read = None if changelog is None else read_changelog(changelog)
    with history_of(database) as history:
        runs, steps = steps_between(history, engine)
        if markdown and steps:
            say(page(engine, history, runs, steps, read).rstrip("\n"))
        else:
            say("\n".join(text_lines(engine, steps, read)))
