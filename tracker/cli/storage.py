"""Commands that store: runs out, runs in, the schema of both, and the database itself."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .filters import json_option
from .options import database_option, example

if TYPE_CHECKING:
    from spook_tracker.tracker.store.partition import Kind


@click.command(epilog=example("tracker export latest --out runs/"))
@click.argument("versions", nargs=-1, metavar="[V]...")
@click.option(
    "--out",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Folder for a file per run or month, or the file of a table; by default print.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(["json", "months", "csv", "parquet"]),
    default="json",
    show_default=True,
    help="months: a compressed file per month; csv, parquet: one table of all values.",
)
@database_option
def export(versions: tuple[str, ...], out: Path | None, form: str, database: str) -> None:
    """Write runs (all, or those named) as JSON documents, or all values as one table."""
    from spook_tracker.tracker.store.transfer import encoded, export_runs

    from .console import say
    from .recorded import history_of

    if form != "json" and (out is None or (versions and form == "months")):
        raise click.UsageError(
            f"--format {form} writes " + ("all runs; name none" if out else "files: say --out")
        )
    with history_of(database) as history:
        if form == "months":
            from spook_tracker.tracker.store.months import export_months

            say(f"{len(export_months(history, Path(str(out))))} files written in {out}")
            return
        if form in ("csv", "parquet"):
            from spook_tracker.tracker.store.table import write_table

            count = write_table(history.to_dataframe(versions), Path(str(out)), form)
            say(f"{count} values in {out}")
            return
        if out is not None:
            say(f"{len(export_runs(history, out, versions))} runs in {out}")
            return
        for run in [history.resolve(name) for name in versions] or history.runs():
            click.echo(encoded(history.document(run.id)), nl=False)


@click.command("import", epilog=example("tracker import runs/*.json"))
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path))
@click.option(
    "--engine", default="", metavar="NAME", help="For files of other tools: the engine that was measured."
)
@click.option(
    "--machine", default="", metavar="NAME", help="For files of other tools: the machine that measured."
)
@click.option(
    "--branch",
    default="",
    metavar="NAME",
    help="For files of other tools: only runs of commits on this branch.",
)
@click.option(
    "--column",
    "columns",
    multiple=True,
    metavar="NAME=MEANING",
    help="For JSON lines and CSV: MEANING is commit, started, test, metric, value, unit, parameter ...; a unit (s, B, steps/s); or - to ignore. Repeatable.",
)
@database_option
def import_files(
    files: tuple[Path, ...], engine: str, machine: str, branch: str, columns: tuple[str, ...], database: str
) -> None:
    """Record runs from JSON documents, whole or in short form; runs that are recorded already are skipped.

    Also reads files of pytest-benchmark, asv, Google Benchmark and github-action-benchmark, asv's folder of results or
    the repository that contains it, records of any tool as JSON lines or CSV (--column), and the compressed files of
    `tracker export --format months`.
    """
    from spook_tracker.tracker import importing
    from spook_tracker.tracker.document.errors import DocumentError
    from spook_tracker.tracker.measure.other_folders import files_in
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.months import import_months, is_month
    from spook_tracker.tracker.store.transfer import import_files as read_in

    files = tuple(file for given in files for file in (files_in(given) if given.is_dir() else (given,)))
    found = importing.read(files, engine, machine, branch, columns)
    months = [file for file in files if is_month(file)]
    with session_on(database) as session:
        done = read_in(session, [file for file in files if file not in found.files and file not in months])
        new, there = importing.record(session, found)
        fresh, known = import_months(session, months)
    stored, present = len(done.stored) + new + fresh, len(done.present) + there + known
    if not stored + present:
        of_branch = f" of the branch {branch}" if branch else ""
        more = f" and {len(files) - 1} more" if len(files) > 1 else ""
        raise DocumentError(f"no run{of_branch} is in {files[0]}{more}")
    click.echo(f"{stored} runs recorded, {present} were there already")
    if found.empty:
        click.echo(f"skipped, as they contain no value: {found.empty} of the files' runs")
    if found.unknown:
        names = ", ".join(found.unknown)
        click.echo(
            f"kept only as an explanation of changes, for lack of a unit: {names}; give one with --column {found.unknown[0]}=UNIT"
        )
    if found.absent:
        click.echo(f"no record has a column {', '.join(found.absent)}: --column has no effect on it")


@click.command(epilog=example("tracker schema > run.schema.json"))
@click.argument("document", type=click.Choice(["run", "compare"]), default="run")
def schema(document: str) -> None:
    """Print the JSON Schema of a run document, or of a comparison."""
    import json

    from spook_tracker.tracker.document.schema import document_schema
    from spook_tracker.tracker.judge.comparison_document import compare_schema

    found = document_schema() if document == "run" else compare_schema()
    click.echo(json.dumps(found, indent=1, ensure_ascii=False))


@click.group(epilog=example("tracker db check"))
def db() -> None:
    """Maintain the database."""


@db.command(epilog=example("tracker db upgrade --db sqlite:///tracker.db"))
@database_option
def upgrade(database: str) -> None:
    """Upgrade the schema to the newest revision; a copy of an older SQLite file is kept."""
    from spook_tracker.tracker.store.damage import told_of_damage
    from spook_tracker.tracker.store.database import head, open_database

    with told_of_damage(database):
        open_database(database).dispose()
    click.echo(f"the schema is at revision {head()}, the newest")


@db.command(epilog=example("tracker db check"))
@database_option
def check(database: str) -> None:
    """Check everything that is stored; exit code 1 if anything is wrong."""
    from spook_tracker.tracker.store.database import open_database
    from spook_tracker.tracker.store.database_check import check as faults_of

    from .console import say
    from .options import RED

    opened = open_database(database, readonly=True)
    try:
        faults = faults_of(opened)
    finally:
        opened.dispose()
    for fault in faults:
        say(f"✗ {fault}")
    say(f"{len(faults)} faults" if faults else "✓ nothing is wrong")
    if faults:
        click.get_current_context().exit(RED)


@db.command(epilog=example("tracker db copy sqlite:///tracker.db postgresql://host/tracker"))
@click.argument("source", metavar="FROM")
@click.argument("target", metavar="TO")
def copy(source: str, target: str) -> None:
    """Copy a whole history into an empty database, also between SQLite and PostgreSQL, without loss."""
    from spook_tracker.tracker.store.damage import told_of_damage
    from spook_tracker.tracker.store.database_copy import copy_database

    with told_of_damage(source):
        digests = copy_database(source, target)
    click.echo(
        f"copied {sum(digest.rows for digest in digests.values())} rows in {len(digests)} tables, all equal"
    )


@db.command(epilog=example("tracker db partition postgresql | psql postgresql://host/tracker"))
@click.argument("kind", type=click.Choice(["postgresql", "timescaledb", "citus"]))
def partition(kind: Kind) -> None:
    """Print the SQL that splits the large tables of a PostgreSQL database by month, or over several servers."""
    from spook_tracker.tracker.store.partition import statements

    click.echo("\n".join(statements(kind)))


@db.command(epilog=example("tracker db stats"))
@json_option
@database_option
def stats(as_json: bool, database: str) -> None:
    """Print how much is stored."""
    from spook_tracker.tracker.store.damage import told_of_damage
    from spook_tracker.tracker.store.database import open_database
    from spook_tracker.tracker.store.storage_counts import statistics

    from .console import say

    opened = open_database(database, readonly=True)
    try:
        with told_of_damage(database):
            found = statistics(opened)
    finally:
        opened.dispose()
    if as_json:
        from .report_json import stats_json

        click.echo(stats_json(found))
        return
    say(f"{found.database}: schema {found.revision}, {found.size / 1e6:.1f} MB")
    for engine, runs in found.engines.items():
        say(f"  {runs} {'run' if runs == 1 else 'runs'} of {engine}")
    if found.first and found.last:
        say(f"  from {found.first:%Y-%m-%d %H:%M} to {found.last:%Y-%m-%d %H:%M} UTC")
    for table, rows in found.rows.items():
        say(f"  {rows:>9} {table}")


@db.command(epilog=example("tracker db remove 3f2a91c0"))
@click.argument("run", metavar="RUN")
@database_option
def remove(run: str, database: str) -> None:
    """Remove a run from the history for good, named by id, start of id, or version."""
    from spook_tracker.tracker.document.wording import clean, clock, version
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.history import History
    from spook_tracker.tracker.store.remove import remove as take_out

    from .console import say

    with session_on(database) as session:
        found = History(session).resolve(run)
        samples = take_out(session, found)
    engine = f"{clean(found.engine.name)} {version(found.engine)}"
    say(f"removed run {clean(found.id)} of {engine}, {clock(found.started)} UTC, with {samples} values")
