"""Commands that ask: what changed, how did it go, what is asked of the engine, what does a scene need."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from spook_tracker.tracker.cli.options import RED, database_option, example, source_options

ACCEPTED = "accepted.toml"


@contextmanager
def history_of(database: str) -> Iterator[Any]:
    """The history in a database, for reading."""
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.history import History

    with session_on(database, readonly=True) as session:
        yield History(session)


def accepted_levels(file: Path | None = None) -> Any:
    """Entries of accepted.toml in the folder one works in."""
    from spook_tracker.tracker.judge.accepted import read_accepted

    return read_accepted(file or Path(ACCEPTED))


@click.command(
    epilog=example("tracker compare 1.2.0 latest", "tracker compare previous latest --format markdown")
)
@click.argument("before", metavar="V1")
@click.argument("after", metavar="V2")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "markdown", "json", "junit"]),
    default="table",
    show_default=True,
)
@click.option(
    "--fail-on",
    type=click.Choice(["regression", "change", "never"]),
    default="regression",
    show_default=True,
    help="What ends with exit code 1.",
)
@click.option("--all", "everything", is_flag=True, help="Show what is identical, too.")
@click.option(
    "--accepted",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help=f"Accepted levels; default {ACCEPTED}.",
)
@database_option
def compare(
    before: str, after: str, form: str, fail_on: str, everything: bool, accepted: Path | None, database: str
) -> None:
    """Say what changed between two versions.

    V is an engine version, a git tag, the start of a commit hash, a run id, latest, previous or last-green.
    """
    from spook_tracker.tracker.cli.console import say

    levels = accepted_levels(accepted)
    with history_of(database) as history:
        document = _compared(history, before, after, levels)
    if form == "json":
        import msgspec

        from spook_tracker.tracker.document.outside import escaped

        click.echo(escaped(msgspec.json.format(msgspec.json.encode(document), indent=1).decode()))
    elif form == "junit":
        from spook_tracker.tracker.cli.report_junit import junit_of_comparison

        click.echo(junit_of_comparison(document), nl=False)
    elif form == "markdown":
        from spook_tracker.tracker.cli.report_compare import compare_markdown

        say(compare_markdown(document).rstrip("\n"))
    else:
        from spook_tracker.tracker.cli.report_compare import compare_table

        say(compare_table(document, everything))
    _exit_as(document, fail_on)


def _exit_as(document: Any, fail_on: str) -> None:
    code = document.exit_code
    if fail_on == "never" and code == RED:
        code = 0
    if fail_on == "change" and code == 0 and document.verdict != "identical":
        code = RED
    click.get_current_context().exit(code)


def _compared(history: Any, before: str, after: str, levels: Any) -> Any:
    """The comparison, with what history knows: the noise of run times, the first bad commit of what is red."""
    from spook_tracker.tracker.judge.compare import Measured, side_of
    from spook_tracker.tracker.judge.compare import compare as compared

    old, new = history.resolve(before), history.resolve(after)
    earlier, later = (
        Measured(side=side_of(run), samples=history.samples(run.id), maps=history.maps(run.id))
        for run in (old, new)
    )
    usual = _usual_times(history, old, earlier.samples)
    document = compared(earlier, later, levels, usual=usual)
    reds = [change.series for change in document.changes if change.red]
    known = _first_bad(history, new, reds) if reds else {}
    return compared(earlier, later, levels, known, usual) if known else document


def _usual_times(history: Any, run: Any, samples: Any) -> dict[str, tuple[float, float]]:
    """Level and noise of each series of run times up to a run, on its machine and under its definition."""
    from spook_tracker.tracker.document.run_document import from_number
    from spook_tracker.tracker.judge.noise import usual_of

    timed = {key: definition for key, (definition, _) in samples.items() if definition.kind == "time"}
    found = {}
    for key, stored in history.series(timed, evidence=False).items() if timed else ():
        values = []
        for other, sample, version in stored.points:
            if (other.machine.fingerprint, version) == (run.machine.fingerprint, timed[key].test_version):
                values.append(from_number(sample.value))
            if other.id == run.id:
                break
        usual = usual_of(values)
        if usual is not None:
            found[key] = usual
    return found


def _first_bad(history: Any, run: Any, series: list[str]) -> dict[str, tuple[str, str]]:
    """Last good and first bad commit of red series, as far as the history knows them."""
    from spook_tracker.tracker.judge.series_history import commit_of, judge_history, nights

    known = {}
    for key, stored in history.series(series).items():
        told = judge_history(key, stored.definition, nights(stored.points))
        night = next((judged for judged in reversed(told) if judged.night.run.id == run.id), None)
        if night is not None and night.first_bad is not None:
            good = commit_of(night.last_good.run) if night.last_good else ""
            known[key] = (good, commit_of(night.first_bad.run))
    return known


@click.command(epilog=example("tracker trend pendulum max_length_deviation"))
@click.argument("test")
@click.argument("metric", required=False)
@click.option("--last", default=10, show_default=True, help="Values to list of each series.")
@click.option(
    "--accepted",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help=f"Accepted levels; default {ACCEPTED}.",
)
@database_option
def trend(test: str, metric: str | None, last: int, accepted: Path | None, database: str) -> None:
    """Show the series of a test over versions: sparkline, change points, last values."""
    import difflib

    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.cli.report_trend import trend_lines
    from spook_tracker.tracker.document.errors import UnknownName
    from spook_tracker.tracker.judge.series_history import nights

    levels = accepted_levels(accepted)
    with history_of(database) as history:
        every = history.series()
        found = {key: s for key, s in every.items() if test in (s.definition.test, key)}
        if not found:
            near = difflib.get_close_matches(test, {s.definition.test for s in every.values()}, n=3)
            hint = (
                f"did you mean {' or '.join(near)}?" if near else "`tracker db stats` shows what is recorded"
            )
            raise UnknownName(f"nothing is recorded of a test {test!r}; {hint}")
        if metric is not None:
            names = {s.definition.metric for s in found.values()}
            found = {key: s for key, s in found.items() if s.definition.metric == metric}
            if not found:
                raise UnknownName(f"{test} has no metric {metric!r}; it has {', '.join(sorted(names))}")
        for key, stored in found.items():
            say("\n".join(trend_lines(key, stored.definition, nights(stored.points), levels, last)))
            say()


@click.command("list", epilog=example("tracker list"))
@source_options
def list_tests(engine: str, catalogue: str) -> None:
    """List the scalar tests: what is asked, and against which limit."""
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.cli.report_catalogue import catalogue_table
    from spook_tracker.tracker.measure.run import Source

    say(catalogue_table(Source(catalogue=catalogue, engine=engine).tests()))


@click.command(epilog=example("tracker show pendulum"))
@click.argument("test")
@source_options
def show(test: str, engine: str, catalogue: str) -> None:
    """Show one test: question, model, theory, limits and their sources."""
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.cli.report_catalogue import card
    from spook_tracker.tracker.measure.run import Source, select

    tests = select(Source(catalogue=catalogue, engine=engine).tests(), [test])
    say(card(test, tests[test]))


@click.command(epilog=example("tracker explain falling_object --cost"))
@click.argument("test")
@click.option(
    "--cost", is_flag=True, help="Also measure what each stage takes, and saves where it is left out."
)
@source_options
def explain(test: str, cost: bool, engine: str, catalogue: str) -> None:
    """Say which stages of the engine the test's scene needs, which are left out, and why."""
    from spook_tracker.tracker.cli.console import say
    from spook_tracker.tracker.cli.report_catalogue import stage_table
    from spook_tracker.tracker.measure.ladder import saved_by_leaving_out, stage_costs
    from spook_tracker.tracker.measure.run import Source, select

    source = Source(catalogue=catalogue, engine=engine)
    tests = select(source.tests(), [test])
    if cost:
        simulate = source.simulate()
        saved = saved_by_leaving_out(tests, simulate).get(test, {})
        say(stage_table(test, tests[test], source.module(), stage_costs(tests[test], simulate), saved))
    else:
        say(stage_table(test, tests[test], source.module()))
