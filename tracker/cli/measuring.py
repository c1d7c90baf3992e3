"""Commands that measure: a run, and a whole night."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import (
    RED,
    UNUSABLE,
    accepted_option,
    complain,
    database_option,
    documents_option,
    example,
    executor_option,
    limit_option,
    look,
    out_option,
    pages_options,
    recorded,
    refuse_unwritable,
    site_options,
    source_options,
    terminated_is_interrupted,
    website_options,
    with_database_option,
    workers_option,
    write,
)
from .settings import present

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import RunDocument
    from spook_tracker.tracker.judge.tonight import Finding
    from spook_tracker.tracker.measure.request import Request
    from spook_tracker.tracker.website.publish import Report

all_option = click.option(
    "--all", "everything", is_flag=True, help="Print every limit and value; ask everything of a --model."
)


@click.command("run", epilog=example("tracker run pendulum door --sweep --json run.json"))
@click.argument("tests", nargs=-1, metavar="[TEST]...")
@click.option("--sweep", is_flag=True, help="Also measure error against run time.")
@click.option("--stability", is_flag=True, help="Also find break points and stability maps.")
@click.option("--figures", is_flag=True, help="Also compute the figures' data.")
@click.option("--no-record", is_flag=True, help="Measure and print only.")
@all_option
@click.option(
    "--json", "json_file", metavar="FILE", type=click.Path(path_type=Path), help="Write the run document."
)
@click.option(
    "--junit", "junit_file", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML."
)
@executor_option
@workers_option
@limit_option
@source_options
@database_option
def run_command(
    tests: tuple[str, ...],
    sweep: bool,
    stability: bool,
    figures: bool,
    no_record: bool,
    everything: bool,
    json_file: Path | None,
    junit_file: Path | None,
    executor: str,
    workers: int,
    memory: int,
    time_limit: float,
    engine: str,
    limit: float | None,
    catalogue: str,
    database: str,
) -> None:
    """Run scalar tests (all, or those named) on one or more engines, print the pass tables and record the runs."""
    from spook_tracker.tracker.measure.questions import EngineUnavailable
    from spook_tracker.tracker.measure.request import Request

    from .console import say
    from .report_table import red as broken

    refuse_unwritable(json_file, junit_file)
    request = Request(
        tests=tests,
        figures=figures,
        sweep=sweep,
        stability=stability,
        workers=workers,
        memory_limit=memory << 20,
        time_limit=time_limit,
        executor=executor,
        look=None if everything or sweep or stability or figures else look(),
    )
    names = engine.split(",")
    red, kept = False, True
    for name in names:
        try:
            document = _measure(request, name, limit, catalogue, None if no_record else database)
        except EngineUnavailable as reason:
            if len(names) == 1:
                raise
            say(f"left out: {reason}", err=True)
            kept = False
            continue
        _print_run(document, everything)
        kept &= _answered(document)
        if json_file:
            kept &= write(_of_engine(json_file, name, names), _json(document))
        if junit_file:
            from .report_junit import junit_of_run

            kept &= write(_of_engine(junit_file, name, names), junit_of_run(document))
        red = red or bool(broken(document))
    ended(red, kept)


def _of_engine(file: Path, name: str, names: list[str]) -> Path:
    """One file each where several engines were asked: run.json, run-mujoco.json."""
    return file if name == names[0] else file.with_stem(f"{file.stem}-{name.replace(':', '-')}")


@click.command(epilog=example("tracker nightly --db sqlite:///tracker.db --out public"))
@out_option
@click.option("--quick", is_flag=True, help="Leave out sweeps and stability studies.")
@all_option
@executor_option
@workers_option
@limit_option
@click.option(
    "--json", "json_file", metavar="FILE", type=click.Path(path_type=Path), help="Write the run document."
)
@click.option(
    "--junit", "junit_file", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML."
)
@with_database_option
@website_options
@pages_options
@documents_option
@accepted_option
@source_options
@database_option
def nightly(
    out: Path,
    quick: bool,
    everything: bool,
    executor: str,
    workers: int,
    memory: int,
    time_limit: float,
    accepted: Path | None,
    json_file: Path | None,
    junit_file: Path | None,
    engine: str,
    limit: float | None,
    catalogue: str,
    database: str,
) -> None:
    """Run everything, record it, judge it against the history and publish the website."""
    from spook_tracker.tracker.document.errors import TrackerError
    from spook_tracker.tracker.library import nightly as night
    from spook_tracker.tracker.measure.questions import EngineUnavailable
    from spook_tracker.tracker.measure.request import Request
    from spook_tracker.tracker.website.folder import refuse_unusable
    from spook_tracker.tracker.website.page_mutants import read_mutants

    from .console import say, watching
    from .recorded import accepted_levels
    from .report_compare import finding_lines, summary

    refuse_unwritable(json_file, junit_file)
    refuse_unusable(out)
    site = site_options()
    if site.mutants:
        read_mutants(site.mutants)  # before the other engines are measured, too
    if site.recorded:
        from spook_tracker.tracker.website.recorded import read_files

        read_files(site.recorded)
    first, *others = engine.split(",")
    for other in others:
        asked = Request(
            sweep=not quick, workers=workers, memory_limit=memory << 20, time_limit=time_limit, trigger="nightly",
            executor=executor,
        )  # fmt: skip
        try:
            _print_run(_measure(asked, other, limit, catalogue, database), everything)
        except EngineUnavailable as reason:
            say(f"left out: {reason}", err=True)

    measured: list[RunDocument] = []
    judged: list[list[Finding]] = []
    kept = True

    def tell(news: RunDocument | list[Finding]) -> None:
        nonlocal kept
        if isinstance(news, list):
            judged.append(news)
            say("\n".join([*finding_lines(news, f"{out}/"), ""]))  # what the night came to stands first
            _print_run(measured[0], everything)
            if junit_file:
                from .report_junit import junit_of_night

                kept &= write(junit_file, junit_of_night(news))
            return
        recorded(news.id)
        measured.append(news)
        if json_file:
            kept &= write(json_file, _json(news))

    try:
        with watching("measuring") as step, terminated_is_interrupted():
            report = night(
                database,
                out,
                accepted=accepted_levels(accepted),
                watch=lambda p: step(p.done, p.total, p.test, p.finished, p.failed),
                tell=tell,
                site=site,
                catalogue=catalogue,
                engine=first,
                limits=present().limits_of(first),
                folder=present().modules,
                limit=limit,
                figures=True,
                sweep=not quick,
                stability=not quick,
                workers=workers,
                memory_limit=memory << 20,
                time_limit=time_limit,
                executor=executor,
            )
    except TrackerError as error:
        if not judged:
            raise
        complain(str(error))  # the website, for one: what the night came to is the exit code all the same
        return ended(any(finding.red for finding in judged[-1]), kept=False)
    for sentence in report.notes:
        say(f"note: {sentence}")
    say_published(report.published, out)
    say(summary(report.findings))  # and last
    return ended(report.red, _answered(report.document) and kept)


def _measure(
    request: Request, engine: str, limit: float | None, catalogue: str, database: str | None
) -> RunDocument:
    """Run what is asked for and record it, the database being opened first: no night is measured in vain."""
    from spook_tracker.tracker.measure.apart import run
    from spook_tracker.tracker.measure.questions import Questions
    from spook_tracker.tracker.measure.request import Interrupted

    from .console import watching

    engine = engine.strip()
    source = Questions(
        catalogue=catalogue,
        engine=engine,
        limit=limit,
        limits=present().limits_of(engine),
        folder=present().modules,
    )
    if database is None:
        with watching("measuring") as step, terminated_is_interrupted():
            return run(source, request, lambda p: step(p.done, p.total, p.test, p.finished, p.failed))
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.record import record

    with session_on(database) as session:
        try:
            with watching("measuring") as step, terminated_is_interrupted():
                document = run(source, request, lambda p: step(p.done, p.total, p.test, p.finished, p.failed))
        except Interrupted as ended:
            record(session, ended.document)
            ended.recorded = True
            raise
        if document.partial:  # a first look that is not whole is no history
            return document
        record(session, document)
    recorded(document.id)
    return document


def _print_run(document: RunDocument, everything: bool) -> None:
    from .console import say, width
    from .report_short import FEW, short_table
    from .report_table import pass_table

    few = len(document.tests) <= FEW
    say(pass_table(document, everything) if everything or few else short_table(document))
    timed = [sample.timing for sample in document.samples if sample.timing is not None]
    if timed and not any(timing.instructions for timing in timed):
        from spook_tracker.tracker.measure.instructions import why_not

        if why := why_not():
            say(textwrap.fill(f"note: retired instructions are not counted: {why}", width()))


def _answered(document: RunDocument) -> bool:
    """Whether the engine supports anything that was asked; if not, that is said: nothing is no green."""
    from .report_table import nothing_measured

    if why := nothing_measured(document):
        complain(why)
    return not why


def _json(document: RunDocument) -> str:
    from spook_tracker.tracker.document.json_form import readable

    return readable(document) + "\n"


def ended(red: bool, kept: bool) -> None:
    """Red goes before what could not be done: a file written, an engine asked."""
    if red or not kept:
        click.get_current_context().exit(RED if red else UNUSABLE)


def say_published(report: Report, out: Path) -> None:
    from .console import say

    say(
        f"published {out / 'index.html'}: {report.pages} files, {report.bytes / 1e6:.1f} MB, {report.written} of them new or changed"
    )
    for sentence in report.failed:
        say(f"not made: {sentence}", err=True)
