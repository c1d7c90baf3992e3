"""Commands that store: runs out, runs in, the schema of both, and the database itself."""

from __future__ import annotations

from pathlib import Path

import click

from tracker.cli_options import database_option, example


@click.command(epilog=example("tracker export latest --out runs/"))
@click.argument("versions", nargs=-1, metavar="[V]...")
@click.option(
    "--out", metavar="DIR", type=click.Path(path_type=Path), help="One file per run; default: print."
)
@database_option
def export(versions: tuple[str, ...], out: Path | None, database: str) -> None:
    """Write runs (all, or those named) as JSON documents."""
    import msgspec

    from tracker.cli_history import history_of

    with history_of(database) as history:
        runs = [history.resolve(name) for name in versions] or list(history.runs())
        for run in runs:
            text = msgspec.json.format(msgspec.json.encode(history.document(run.id)), indent=1)
            if out is None:
                click.echo(text)
            else:
                out.mkdir(parents=True, exist_ok=True)
                (out / f"{_file_name(run.id)}.json").write_bytes(text + b"\n")
    if out is not None:
        click.echo(f"{len(runs)} runs in {out}")


def _file_name(run_id: str) -> str:
    """The id where it is harmless as a file name, else a hash of it."""
    import hashlib
    import re

    safe = re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9-]{0,80}", run_id)
    return run_id if safe else hashlib.sha256(run_id.encode("utf-8", "replace")).hexdigest()[:32]


@click.command("import", epilog=example("tracker import runs/*.json"))
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path, dir_okay=False)
)
@database_option
def import_files(files: tuple[Path, ...], database: str) -> None:
    """Record runs from JSON documents; what is there already is left as it is."""
    from sqlalchemy.orm import Session

    from tracker.border import decoded
    from tracker.database import open_database
    from tracker.record import record

    documents = [decoded(file.read_bytes(), str(file)) for file in files]  # all valid, or nothing is written
    opened = open_database(database)
    try:
        with Session(opened) as session:
            new = sum(record(session, document) for document in documents)
    finally:
        opened.dispose()
    click.echo(f"{new} runs recorded, {len(documents) - new} were there already")


@click.command(epilog=example("tracker schema > run.schema.json"))
@click.argument("document", type=click.Choice(["run", "compare"]), default="run")
def schema(document: str) -> None:
    """Print the JSON Schema of a run document, or of a comparison."""
    import json

    from tracker.compare_document import compare_schema
    from tracker.schema import document_schema

    found = document_schema() if document == "run" else compare_schema()
    click.echo(json.dumps(found, indent=1, ensure_ascii=False))


@click.group(epilog=example("tracker db check"))
def db() -> None:
    """Look after the database."""


@db.command(epilog=example("tracker db upgrade --db sqlite:///tracker.db"))
@database_option
def upgrade(database: str) -> None:
    """Bring the schema to the newest revision; of an older SQLite file a copy is kept."""
    from tracker.database import head, open_database

    open_database(database).dispose()
    click.echo(f"the schema is at revision {head()}, the newest")
