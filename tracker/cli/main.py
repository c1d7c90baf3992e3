"""The command line: parse, call, print. Everything but click is imported inside the commands."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from . import past, releases
from . import rank as ranking
from .ci import ci
from .count import count
from .history import compare, explain, judge_command, list_tests, show, trend
from .init import init
from .measuring import ended, nightly, run_command, say_published
from .models import models_command
from .options import (
    OneLineErrors,
    accepted_option,
    database_option,
    documents_option,
    example,
    pages_options,
    refuse_unwritable,
    site_options,
    website_options,
    with_database_option,
    write,
)
from .storage import db, export, import_files, schema

if TYPE_CHECKING:
    pass

FIRST_STEPS = """\
Tracks whether a physics engine became less accurate, less stable or slower.

\b
Three ways to use it:
  tracker nightly --out public     for a cron job: run, record, judge, publish
  tracker compare previous latest  at a desk: what changed between two versions
  tracker serve public             view the website

\b
A first run:
  tracker init NAME                adapter, settings and workflow for an engine of your own
  tracker run                      measure every scalar test of this engine and record it
  tracker list                     list the tests
"""


@click.group(cls=OneLineErrors, help=FIRST_STEPS, invoke_without_command=True)
@click.option("--version", is_flag=True, help="Show the versions of tracker and engine, and exit.")
@click.pass_context
def main(context: click.Context, version: bool) -> None:
    if version:
        _print_versions()
    elif context.invoked_subcommand is None:
        click.echo(context.get_help())


def _print_versions() -> None:
    from spook_tracker.tracker.measure.run import Questions, present_version, tracker_version

    engine = present_version(Questions())
    click.echo(
        f"tracker {tracker_version()}, {engine.name} {engine.version} ({engine.git_hash[:10] or 'no commit'})"
    )


@main.command(epilog=example("tracker engines"))
def engines() -> None:
    """List the engines that can be tested, with their configurations, and what is missing for the others."""
    from . import report_engines as report
    from .console import say

    say("\n".join(report.engine_lines()))


@main.command(epilog=example("tracker publish --out public"))
@click.option(
    "--out", metavar="DIR", required=True, type=click.Path(path_type=Path), help="Folder for the website."
)
@with_database_option
@website_options
@pages_options
@documents_option
@accepted_option
@database_option
def publish(
    out: Path,
    accepted: Path | None,
    database: str,
) -> None:
    """Build the website from the recorded runs."""
    from spook_tracker.tracker.library import publish as build

    from .recorded import accepted_levels, history_of

    with history_of(database) as history:
        report = build(history, out, accepted_levels(accepted), database, site_options())
    say_published(report, out)


@main.command(epilog=example("tracker report --pdf night.pdf"))
@click.option("--pdf", type=click.Path(dir_okay=False, path_type=Path), help="Print the night as PDF (A4).")
@click.option("--html", type=click.Path(dir_okay=False, path_type=Path), help="Write it as one HTML file.")
@website_options
@accepted_option
@database_option
def report(
    pdf: Path | None,
    html: Path | None,
    accepted: Path | None,
    database: str,
) -> None:
    """Write the newest night as one document: a PDF, a self-contained HTML file, or both."""
    import tempfile

    from spook_tracker.tracker.website.printed import one_file, print_pdf

    from .console import say
    from .recorded import accepted_levels, history_of

    if pdf is None and html is None:
        raise click.UsageError("say what to write: --pdf FILE, --html FILE, or both")
    refuse_unwritable(pdf, html)
    with history_of(database) as history:
        text = one_file(history, accepted_levels(accepted), site_options())
    kept = html is None or write(html, text)
    if html is not None and kept:
        say(f"wrote {html}")
    if pdf is not None:
        with tempfile.TemporaryDirectory() as folder:
            page = Path(folder) / "night.html"
            page.write_text(text, encoding="utf-8")
            print_pdf(page, pdf)
        say(f"wrote {pdf}")
    ended(red=False, kept=kept)


@main.command(epilog=example("tracker serve public --port 8000"))
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "--port", default=8000, show_default=True, type=click.IntRange(0, 65535), help="0: any free one."
)
def serve(folder: Path, port: int) -> None:
    """Serve a published website on this machine."""
    from functools import partial
    from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

    from spook_tracker.tracker.document.errors import TrackerError

    from .console import say

    if not (folder / "index.html").is_file():
        raise TrackerError(f"{folder} holds no website; make one with: tracker publish --out {folder}")
    try:
        server = ThreadingHTTPServer(
            ("127.0.0.1", port), partial(SimpleHTTPRequestHandler, directory=str(folder))
        )
    except OSError as error:
        raise TrackerError(
            f"port {port} cannot be used ({error.strerror}); choose another with --port"
        ) from None
    say(f"http://127.0.0.1:{server.server_address[1]}/ shows {folder}; stop with Ctrl-C")
    with server:
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            click.echo()


for command in (
    run_command,
    nightly,
    init,
    past.bisect,
    count,
    ci,
    releases.backfill,
    releases.releases_command,
    ranking.rank,
    compare,
    judge_command,
    trend,
    list_tests,
    show,
    explain,
    models_command,
    export,
    import_files,
    db,
    schema,
):
    main.add_command(command)
