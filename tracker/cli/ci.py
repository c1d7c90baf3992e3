"""`tracker ci`: the two jobs a team's CI has, each one line there, whatever the service.

Where it runs on GitHub ($GITHUB_STEP_SUMMARY, $GITHUB_ACTIONS), what came of it stands in the job's summary and in
annotations beside the commit. The history travels as a folder of files, one a month.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

import click

from .options import (
    GREEN,
    RED,
    UNUSABLE,
    accepted_option,
    complain,
    database_option,
    documents_option,
    example,
    executor_option,
    limit_option,
    out_option,
    pages_options,
    recorded_runs,
    refuse_unwritable,
    source_options,
    website_options,
    workers_option,
    write,
)
from .past import KEPT
from .settings import present

if TYPE_CHECKING:
    from spook_tracker.tracker.judge.comparison_document import CompareDocument


class Asked(TypedDict):
    """Options that both jobs share with `tracker run`, as click hands them over."""

    executor: str
    workers: int
    memory: int  # MB
    time_limit: float  # s
    engine: str
    limit: float | None  # s
    catalogue: str


class AskedOfNight(Asked):
    """Those of a night."""

    quick: bool


HISTORY = click.option(
    "--history",
    metavar="DIR",
    default="history",
    show_default=True,
    type=click.Path(path_type=Path),
    help="Folder of the history, one file a month.",
)


@click.group("ci", epilog=example("tracker ci night", "tracker ci change"))
def ci() -> None:
    """For CI services: measure and judge a night, or a proposed change, with the history in a folder."""


@ci.command(epilog=example("tracker ci night --history history --out public"))
@HISTORY
@out_option
@click.option("--quick", is_flag=True, help="Leave out sweeps and stability studies.")
@click.option("--site", metavar="URL", default="", help="Address of the website, for links in the summary.")
@executor_option
@workers_option
@limit_option
@website_options
@pages_options
@documents_option
@accepted_option
@source_options
@database_option
@click.pass_context
def night(
    context: click.Context, /, history: Path, out: Path, site: str, accepted: Path | None, database: str,
    **asked: Unpack[AskedOfNight],
) -> None:  # fmt: skip
    """Read the history, run `tracker nightly`, and write the history back."""
    from spook_tracker.tracker.document.errors import TrackerError
    from spook_tracker.tracker.library import judge_run
    from spook_tracker.tracker.store.months import export_months

    from .console import say
    from .measuring import nightly
    from .recorded import accepted_levels, history_of
    from .report_ci import commands_of, night_markdown

    try:
        history.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise TrackerError(f"the folder {history} cannot be made: {error.strerror}") from None
    refuse_unwritable(history / "month.jsonl.xz")  # a file like those that a night writes
    _bring_in(history, database)
    same = {"json_file": None, "junit_file": None}
    code = _code_of(context, nightly, out=out, accepted=accepted, database=database, **same, **asked)
    with history_of(database) as kept:
        run = kept.resolve(recorded_runs()[-1])  # by its id: whatever its clock, or another's, has said
        findings = judge_run(kept, run.id, accepted_levels(accepted))
        _tell(night_markdown(run, findings, site), commands_of(findings))
        try:
            written = export_months(kept, history)
        except TrackerError as error:
            complain(str(error))  # a red night stays red
            context.exit(code or UNUSABLE)
    say(f"history: {', '.join(path.name for path in written) or 'nothing new'} in {history}")
    context.exit(code)


@ci.command(epilog=example("tracker ci change --comment comment.md"))
@HISTORY
@click.option(
    "--base",
    metavar="V",
    default="fork-point",
    show_default=True,
    help="What to compare with: a commit, or a version in the history. fork-point is where the change left the main "
    "line; if commits cannot be built, the nearest measured commit before that.",
)
@click.option(
    "--build",
    metavar="COMMAND",
    default="",
    help="Shell command that builds a commit; by default [build] of tracker.toml.",
)
@click.option("--quick", is_flag=True, help="Leave out run times.")
@click.option(
    "--keep",
    "folder",
    metavar="DIR",
    default=KEPT,
    show_default=True,
    type=click.Path(path_type=Path),
    help="Where commits are built.",
)
@click.option(
    "--comment",
    "comment_file",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write a comment for the pull request; empty when nothing became worse.",
)
@executor_option
@workers_option
@limit_option
@accepted_option
@source_options
@database_option
@click.pass_context
def change(
    context: click.Context, /, history: Path, base: str, build: str, quick: bool, folder: Path,
    comment_file: Path | None, accepted: Path | None, database: str, **asked: Unpack[Asked],
) -> None:  # fmt: skip
    """Build and measure a proposed change and its base side by side; nothing is added to the history.

    Values are compared exactly, run times between fresh processes of both, interleaved. If nothing says how a commit is
    built, the working tree is measured and compared with the history, without run times.
    """
    from spook_tracker.tracker.library import compare
    from spook_tracker.tracker.measure.builds import team_repository

    from .change import beside_its_base, run_options
    from .measuring import run_command
    from .recorded import accepted_levels, history_of

    refuse_unwritable(comment_file)
    if comment_file:
        comment_file.write_text("", encoding="utf-8")
    known = _bring_in(history, database)
    if team := team_repository(present().folder or Path.cwd(), present().build, build):
        said = {name: asked[name] for name in ("engine", "catalogue") if _on_command_line(context, name)}
        options = [
            *([] if quick else ["--sweep"]),
            *run_options(
                asked["workers"],
                asked["limit"],
                asked["memory"],
                asked["time_limit"],
                asked["executor"],
                said,
            ),
        ]
        document = beside_its_base(team, base, database, accepted_levels(accepted), options, folder.resolve())
        return _compared(context, document, comment_file)
    same: dict[str, object] = {"tests": (), "json_file": None, "junit_file": None}
    same |= dict.fromkeys(("sweep", "stability", "figures", "no_record", "everything"), False)
    code = _code_of(context, run_command, database=database, **same, **asked)
    if not known:
        _tell("No history yet: this run has nothing to be compared with.\n", [])
        context.exit(code)
    with history_of(database) as recorded:
        document = compare(recorded, base, recorded_runs()[0], accepted_levels(accepted))
    return _compared(context, document, comment_file)


def _on_command_line(context: click.Context, name: str) -> bool:
    return context.get_parameter_source(name) is click.core.ParameterSource.COMMANDLINE


def _compared(context: click.Context, document: CompareDocument, comment_file: Path | None) -> None:
    """Say what a comparison came to, wherever it is read, and end with its exit code."""
    from .console import say
    from .report_comment import comment, workflow_commands
    from .report_compare import compare_markdown, compare_table

    kept = True
    say(compare_table(document))
    if comment_file and (words := comment(document)):
        kept = write(comment_file, words + "\n")
    _tell(compare_markdown(document), workflow_commands(document).splitlines())
    context.exit(document.exit_code or (GREEN if kept else UNUSABLE))


def _bring_in(folder: Path, database: str) -> int:
    """Record what the folder holds; returns how many runs that is.

    A SQLite file beside it is a copy of it: one that cannot be read, or says otherwise, is set aside and made again.
    """
    from spook_tracker.tracker.document.errors import DatabaseUnusable
    from spook_tracker.tracker.store.database import session_on, set_aside
    from spook_tracker.tracker.store.history import History
    from spook_tracker.tracker.store.months import import_months, is_month, refuse_other

    files = sorted(path for path in folder.glob("*") if is_month(path)) if folder.is_dir() else []

    def bring() -> tuple[int, int]:
        with session_on(database) as session:
            refuse_other(History(session), files)
            session.rollback()
            return import_months(session, files)

    try:
        stored, present = bring()
    except DatabaseUnusable as error:
        if (aside := set_aside(database)) is None:
            raise
        complain(f"{error}; it was moved to {aside.name} and is built again from {folder}")
        stored, present = bring()
    click.echo(f"history: {stored} runs recorded, {present} were there already")
    return stored + present


def _code_of(context: click.Context, command: click.Command, **arguments: object) -> int:
    """Its exit code; what is neither green nor red ends this command, too."""
    try:
        context.invoke(command, **arguments)
    except click.exceptions.Exit as ended:
        if ended.exit_code not in (GREEN, RED):
            raise
        return ended.exit_code
    return GREEN


def _tell(markdown: str, commands: list[str]) -> None:
    """To the service, where there is one that listens."""
    if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
        try:
            with Path(summary).open("a", encoding="utf-8") as file:
                file.write(markdown + "\n")
        except OSError as error:
            complain(f"the summary {summary} cannot be written: {error.strerror}")
    if os.environ.get("GITHUB_ACTIONS") == "true":
        for command in commands:
            click.echo(command)
