"""Commands that ask: what changed, how did it go, what is asked of the engine, what does a scene need."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .filters import (
    engine_option,
    json_option,
    kind_options,
    of_engine,
    test_option,
)
from .options import (
    DEFAULT_DATABASE,
    NOT_COMPARABLE,
    RED,
    UNUSABLE,
    accepted_option,
    database_option,
    example,
    refuse_unwritable,
    source_options,
    write,
)
from .recorded import accepted_levels, history_of
from .settings import present

if TYPE_CHECKING:
    from spook_tracker.scalar_tests.case import ScalarTest
    from spook_tracker.tracker.document.run_document import RunDocument
    from spook_tracker.tracker.judge.choice import Choice
    from spook_tracker.tracker.judge.comparison_document import CompareDocument
    from spook_tracker.tracker.judge.tonight import Finding
    from spook_tracker.tracker.past import OldAnswers
    from spook_tracker.tracker.store.history import History
    from spook_tracker.tracker.store.versions import RunInfo


@click.command(
    epilog=example("tracker compare 1.2.0 latest", "tracker compare previous latest --format markdown")
)
@click.argument("before", metavar="V1")
@click.argument("after", metavar="V2")
@click.option(
    "--format",
    "form",
    type=click.Choice(["table", "markdown", "comment", "annotations", "json", "junit"]),
    default="table",
    show_default=True,
    help="How it is printed: for terminals, documents, pull requests (comment, annotations) or other tools.",
)
@click.option(
    "--fail-on",
    type=click.Choice(["regression", "change", "never"]),
    default="regression",
    show_default=True,
    help="What causes exit code 1.",
)
@click.option("--all", "everything", is_flag=True, help="Also show identical values.")
@click.option(
    "--against-history",
    is_flag=True,
    help="Run times that are red against their history are red, whatever V1 took.",
)
@engine_option
@test_option
@kind_options
@accepted_option
@database_option
def compare(
    before: str,
    after: str,
    form: str,
    fail_on: str,
    against_history: bool,
    everything: bool,
    engine: str | None,
    tests: tuple[str, ...],
    kinds: tuple[str, ...],
    roles: tuple[str, ...],
    accepted: Path | None,
    database: str,
) -> None:
    """Say what changed between two versions.

    A version V is an engine version, a git tag, the start of a commit hash, a run id, latest, previous or last-green.
    It comprises all runs of its commit; every machine that measured both versions is compared. "compare previous
    latest" takes the version before the latest on its branch, or an earlier run of the same version that measured the
    same on that machine; "compare last-green latest" takes the newest earlier version that kept every limit, whether or
    not a value had become worse within its limit. V1 may be fork-point: the nearest measured commit of the main line
    that V2 builds on. If V1 and V2 are names of engines, they are ranked: which is ahead at equal error, and by what
    factor. The formats comment and annotations are for pull requests, and empty when nothing became worse.
    """
    from spook_tracker.tracker.judge.choice import Choice
    from spook_tracker.tracker.library import FORK_POINT
    from spook_tracker.tracker.library import compare as compared

    from .console import say

    levels, choice = accepted_levels(accepted), Choice(tests=tests, kinds=kinds, roles=roles)
    with history_of(database) as history:
        if form == "table" and _are_engines(history, (before, after)):
            from . import rank as ranking

            say("\n".join(ranking.table_lines(history, (before, after), tests)))  # neither regressed
            return
        old = before if before == FORK_POINT else of_engine(engine, before)
        document = compared(history, old, of_engine(engine, after), levels, against_history)
    document = choice.of_comparison(document)
    if form == "json":
        from spook_tracker.tracker.document.json_form import readable

        click.echo(readable(document))
    elif form == "junit":
        from .report_junit import junit_of_comparison

        click.echo(junit_of_comparison(document), nl=False)
    elif form in ("comment", "annotations"):
        from .report_comment import comment, workflow_commands

        words = comment(document) if form == "comment" else workflow_commands(document)
        if words and form == "comment":
            say(words)
        elif words:
            click.echo(words)  # they are meant to be commands, and hold nothing else that is one
    elif form == "markdown":
        from .report_compare import compare_markdown

        say(compare_markdown(document).rstrip("\n"))
    else:
        from .report_compare import compare_table

        say(compare_table(document, everything))
    _exit_as(document, fail_on)


def _are_engines(history: History, names: tuple[str, str]) -> bool:
    """Whether both are engines by name: recorded ones, or known ones that no run is called by."""
    from spook_tracker.tracker.document.errors import UnknownName

    recorded = {run.engine.name for run in history.runs()}
    others = [name for name in names if name not in recorded]
    for name in others:
        try:
            history.resolve(name)
        except UnknownName:
            continue
        return False
    if not others:
        return True
    from spook_tracker.engine.find import known  # with NumPy: a comparison of two runs starts without

    return set(others) <= set(known())


def _exit_as(document: CompareDocument, fail_on: str) -> None:
    code: int = document.exit_code
    if fail_on == "never" and code == RED:
        code = 0
    if fail_on == "change" and code == 0 and document.verdict != "identical":
        code = RED
    click.get_current_context().exit(code)


@click.command("judge", epilog=example("tracker judge latest", "tracker judge 0f3c --junit judged.xml"))
@click.argument("run", metavar="RUN")
@json_option
@click.option(
    "--junit", "junit_file", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML."
)
@click.option(
    "--old-questions",
    is_flag=True,
    help="If a test's definition changed, also run the old test on this engine and compare.",
)
@engine_option
@test_option
@kind_options
@accepted_option
@database_option
def judge_command(
    run: str,
    as_json: bool,
    junit_file: Path | None,
    old_questions: bool,
    engine: str | None,
    tests: tuple[str, ...],
    kinds: tuple[str, ...],
    roles: tuple[str, ...],
    accepted: Path | None,
    database: str,
) -> None:
    """Judge a recorded or imported run against everything measured before it.

    RUN is named as for compare. A version comprises all runs of its commit: of each series the last on each machine; a
    run's id is that run alone. Latest is the latest night of every machine: what is red in the last runs of other
    machines within a day is reported, too. Exit code 1 if anything is red; 3 if the run measured nothing, or if some
    values of old questions could not be compared.
    """
    from spook_tracker.tracker.judge.choice import Choice
    from spook_tracker.tracker.library import idle_entries, judge_run

    from .console import say
    from .report_compare import finding_lines, findings_json, old_answer_lines

    refuse_unwritable(junit_file)
    kept = True
    choice = Choice(tests=tests, kinds=kinds, roles=roles)
    levels, run = accepted_levels(accepted), of_engine(engine, run)
    with history_of(database) as history:
        findings = judge_run(history, run, levels)
        notes = idle_entries(history, run, findings, levels)
        findings = choice.of_findings(findings)
        then = _by_old_questions(history, history.resolve(run), findings, choice) if old_questions else []
    if junit_file:
        from .report_junit import junit_of_night

        kept = write(junit_file, junit_of_night(findings, then))
    if as_json:
        click.echo(findings_json(findings, then))
    else:
        say("\n".join([*finding_lines(findings), *(f"note: {note}" for note in notes)]))
        for old in then:
            say("\n".join(old_answer_lines(old)))
    if any(finding.red for finding in findings) or any(old.red for old in then):
        click.get_current_context().exit(RED)
    if not findings or any(old.open for old in then):
        click.get_current_context().exit(NOT_COMPARABLE)
    if not kept:
        click.get_current_context().exit(UNUSABLE)


def _by_old_questions(
    history: History, run: RunInfo, findings: Sequence[Finding], choice: Choice
) -> list[OldAnswers]:
    """Answers of this engine to the questions of earlier commits, in the repository where one stands."""
    import spook_tracker.tracker.past as past
    from spook_tracker.tracker.measure.commits import ask_today, checked_out, repository_at

    from .past import KEPT

    repository = repository_at(Path.cwd())
    kept = Path(KEPT).resolve()

    def ask(commit: str, tests: tuple[str, ...], *options: str) -> RunDocument:
        return ask_today(checked_out(repository, commit, kept), tests, *options)

    return past.by_old_questions(history, run, findings, ask, choice)


@click.command(epilog=example("tracker trend pendulum max_length_deviation"))
@click.argument("test")
@click.argument("metric", required=False)
@click.option(
    "--last",
    type=click.IntRange(min=1),
    default=10,
    show_default=True,
    help="Number of values to list of each series.",
)
@click.option(
    "--all", "everything", is_flag=True, help="List the nights of every series, however many there are."
)
@engine_option
@kind_options
@json_option
@accepted_option
@database_option
def trend(
    test: str,
    metric: str | None,
    last: int,
    everything: bool,
    engine: str | None,
    kinds: tuple[str, ...],
    roles: tuple[str, ...],
    as_json: bool,
    accepted: Path | None,
    database: str,
) -> None:
    """Show the series of a test over versions: sparkline, change points, last values.

    Exit code 1 if one of them is red in its newest night.
    """
    from spook_tracker.tracker.judge.choice import Choice
    from spook_tracker.tracker.library import trend as told_of
    from spook_tracker.tracker.library import trend_of_maps

    from .console import say

    levels, choice = accepted_levels(accepted), Choice(kinds=kinds, roles=roles)
    with history_of(database) as history:
        every = told_of(history, test, metric, levels, engine)
        of_engine = every[0].nights[-1].night.run.engine.name
        maps = [] if metric else choice.of_maps(trend_of_maps(history, test, levels, of_engine))
    trends = [] if maps and kinds == ("map",) else choice.of_trends(every)
    red = any(told.nights and told.nights[-1].red for told in trends) or any(
        told.verdict.red for told in maps
    )
    code = RED if red else 0
    if as_json:
        from .report_json import trend_json

        click.echo(trend_json(trends, maps))
        click.get_current_context().exit(code)
    from .report_trend import (
        FEW,
        gates_first,
        map_lines,
        overview_lines,
        summary,
        trend_lines,
    )

    say(summary(trends, maps))
    if maps:
        say("\n".join(map_lines(maps)))
    whole = gates_first(trends)
    if len(whole) > FEW and not (everything or metric or kinds or roles):
        say("\n".join(["", *overview_lines(whole)]))
        whole = [told for told in whole if told.nights and told.nights[-1].red][:FEW]
    for told in whole:
        say()
        say("\n".join(trend_lines(told, last)))
    click.get_current_context().exit(code)


@click.command("list", epilog=example("tracker list"))
@test_option
@kind_options
@click.option(
    "--coverage",
    is_flag=True,
    help="Show for each test whether it has error against run time, stability and the savings of left-out stages, or why not.",
)
@json_option
@source_options
@database_option
def list_tests(
    tests: tuple[str, ...],
    kinds: tuple[str, ...],
    roles: tuple[str, ...],
    coverage: bool,
    as_json: bool,
    engine: str,
    catalogue: str,
    database: str,
) -> None:
    """List the scalar tests: the question, and the limit. --kind and --role select those with such series."""
    from contextlib import nullcontext
    from fnmatch import fnmatchcase

    from spook_tracker.tracker.measure.run import Questions

    from .console import say
    from .report_catalogue import catalogue_table

    source = Questions(
        catalogue=catalogue, engine=engine, limits=present().limits_of(engine), folder=present().modules
    )
    found = {
        name: test
        for name, test in source.tests().items()
        if (not tests or any(fnmatchcase(name, pattern) for pattern in tests))
        and (not kinds or _kinds_of(test) & set(kinds))
        and (not roles or {metric.role for _, metric in test.metrics()} & set(roles))
    }
    if coverage:
        from .report_catalogue import coverage_rows, coverage_table
        from .report_json import coverage_json

        unmeasured = database == DEFAULT_DATABASE and not Path(database.removeprefix("sqlite:///")).exists()
        with nullcontext() if unmeasured else history_of(database) as history:
            rows = coverage_rows(found, history)
        if as_json:
            click.echo(coverage_json(rows))
        else:
            say(coverage_table(rows))
    elif as_json:
        from .report_json import list_json

        click.echo(list_json(found))
    else:
        say(catalogue_table(found))


def _kinds_of(test: ScalarTest) -> set[str]:
    """The kinds of series that a test gives where all of it is asked."""
    has = {"scalar": test.measurements, "ladder": test.ladders, "break_point": test.stability}
    kinds = {kind for kind, parts in has.items() if parts}
    kinds |= {"order", "time", "run_time"} if test.ladders else set()
    return kinds | ({"map"} if test.stability else set()) | {"work"}


@click.command(epilog=example("tracker show pendulum"))
@click.argument("test")
@click.option(
    "--format",
    "form",
    type=click.Choice(["text", "mjcf"]),
    default="text",
    help="mjcf: the scene as a file for MuJoCo.",
)
@json_option
@source_options
def show(test: str, form: str, as_json: bool, engine: str, catalogue: str) -> None:
    """Show one test: question, model, theory, limits and their sources."""
    from spook_tracker.tracker.measure.run import Questions, select

    from .console import say
    from .report_catalogue import card

    tests = select(
        Questions(
            catalogue=catalogue, engine=engine, limits=present().limits_of(engine), folder=present().modules
        ).tests(),
        [test],
    )
    if as_json:
        from .report_json import show_json

        click.echo(show_json(test, tests[test]))
    elif form == "mjcf":
        from spook_tracker.tracker.measure.cards import scene_file

        click.echo(scene_file(tests[test]), nl=False)
    else:
        say(card(test, tests[test]))


@click.command(epilog=example("tracker explain falling_object --cost"))
@click.argument("test")
@click.option(
    "--cost", is_flag=True, help="Also measure what each stage costs, and what leaving it out saves."
)
@json_option
@source_options
def explain(test: str, cost: bool, as_json: bool, engine: str, catalogue: str) -> None:
    """Say which stages of the engine a test's scene needs, which are left out, and why."""
    from spook_tracker.tracker.measure.cards import explained
    from spook_tracker.tracker.measure.run import Questions, select
    from spook_tracker.tracker.measure.step_cost import leaving_out, step_cost

    from .console import say
    from .report_catalogue import stage_table

    source = Questions(
        catalogue=catalogue, engine=engine, limits=present().limits_of(engine), folder=present().modules
    )
    tests = select(source.tests(), [test])
    explained(tests[test], source.module())  # refused before anything is measured
    costs = out = None
    if cost:
        simulate = source.simulate()
        out = leaving_out(tests[test], simulate)
        costs = step_cost(tests[test], simulate)
    if as_json:
        from .report_json import explain_json

        click.echo(explain_json(test, explained(tests[test], source.module()), costs, out))
    else:
        say(stage_table(test, tests[test], source.module(), costs, out))
