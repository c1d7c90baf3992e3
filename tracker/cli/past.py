"""`tracker bisect` and `tracker backfill REV…`: earlier commits of a repository, built, asked and judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .filters import kind_options
from .options import RED, accepted_option, database_option, example
from .settings import present

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import RunDocument

KEPT = ".tracker-commits"


@click.command(epilog=example("tracker bisect pendulum --good v0.3.0 --bad HEAD"))
@click.argument("test")
@click.option("--good", metavar="REV", help="Default: the last good commit according to the history.")
@click.option("--bad", metavar="REV", help="Default: the first bad commit according to the history.")
@click.option(
    "--sweep", is_flag=True, help="Also measure error against run time, and search by those series."
)
@click.option("--stability", is_flag=True, help="Also find break points, and search by those.")
@kind_options
@click.option(
    "--keep", "folder", metavar="DIR", default=KEPT, show_default=True, type=click.Path(path_type=Path),
    help="Where commits are built.",
)  # fmt: skip
@accepted_option
@database_option
def bisect(
    test: str,
    good: str | None,
    bad: str | None,
    sweep: bool,
    stability: bool,
    kinds: tuple[str, ...],
    roles: tuple[str, ...],
    folder: Path,
    accepted: Path | None,
    database: str,
) -> None:
    """Build and measure commits between a good and a bad one, and name the first bad one.

    Nothing is recorded. A commit that does not build or gives no answers is skipped. Exit code 1 if a bad commit was
    found.
    """
    import spook_tracker.tracker.past as past
    from spook_tracker.tracker.judge.choice import Choice
    from spook_tracker.tracker.measure.commits import subject

    from .console import say
    from .report_compare import red_lines

    repository, measure = _commits(folder.resolve(), (test,), say)
    if good is None or bad is None:
        known_good, known_bad = _from_history(test, accepted, database)
        good, bad = good or known_good, bad or known_bad
    options = ["--sweep"] * sweep + ["--stability"] * stability
    found = past.bisect(
        repository,
        good,
        bad,
        lambda commit: measure(commit, *options),
        Choice(tests=(test,), kinds=kinds, roles=roles),
        lambda step: say(f"{step.commit[:12]} {step.word}: {step.why}"),
    )
    say("\n".join(red_lines(found.reds)))
    if len(found.commits) == 1:
        say(f"✗ first bad commit {found.commits[0][:12]}: {subject(repository, found.commits[0])}")
    else:
        said = ", ".join(commit[:12] for commit in found.commits)
        say(f"✗ the first bad commit is one of {said}: those before the last could not be measured")
    click.get_current_context().exit(RED)


def _from_history(test: str, accepted: Path | None, database: str) -> tuple[str, str]:
    """The narrowest range of commits that the history blames for what is red in a test now."""
    from spook_tracker.tracker.document.errors import UnknownName
    from spook_tracker.tracker.library import trend

    from .recorded import accepted_levels, history_of

    with history_of(database) as history:
        ends = []
        for told in trend(history, test, None, accepted_levels(accepted)):
            last = told.nights[-1]
            if last.red and last.accused is not None:
                good, bad = (night.run.engine.git_hash for night in last.accused)
                ends.append((good, bad))
            elif last.red and last.worse_at is not None and last.before_worse is not None:
                ends.append((last.before_worse.run.engine.git_hash, last.worse_at.run.engine.git_hash))
    if not ends or not all(ends[-1]):
        raise UnknownName(f"the history knows no first bad commit of {test!r}; name --good and --bad")
    return ends[-1]


def backfill_commits(
    names: Sequence[str], tests: Sequence[str], options: Sequence[str], folder: Path, database: str
) -> None:
    """Measure and record commits, oldest first; one that is recorded already is left as it is."""
    from spook_tracker.tracker.library import record
    from spook_tracker.tracker.measure.commits import CommitError, commits_named
    from spook_tracker.tracker.store.database import session_on
    from spook_tracker.tracker.store.history import History

    from .console import say

    repository, measure = _commits(folder.resolve(), tests, say)
    commits = commits_named(repository, names)
    with session_on(database) as session:  # made if it is not there yet
        have = {run.engine.git_hash for run in History(session).runs() if not run.engine.dirty}
    for place, commit in enumerate(commits, start=1):
        heading = f"[{place}/{len(commits)}] {commit[:12]}"
        if commit in have and not tests:
            say(f"{heading}: recorded already")
            continue
        try:
            document = measure(commit, *options)
        except CommitError as error:
            say(f"{heading}: {error}")
            continue
        record(document, database)
        values = sum(sample.outcome in ("value", "unsettled", "out_of_limit") for sample in document.samples)
        say(f"{heading}: {values} of {len(document.samples)} values, recorded as run {document.id}")


def _commits(
    folder: Path, tests: Sequence[str], say: Callable[[str], None]
) -> tuple[Path, Callable[..., RunDocument]]:
    """The repository one stands in, and a function that builds and measures a commit and says with whose tests.

    CommitError where no tracker.toml says how a commit is built.
    """
    from spook_tracker.tracker.measure.builds import team_repository
    from spook_tracker.tracker.measure.commits import CommitError, subject

    team = team_repository(present().folder, present().build)
    if team is None:
        raise CommitError(
            f"nothing in {Path.cwd()} or above says how a commit is built; say it in tracker.toml: [build] with a command, "
            "such as make; where there is nothing to build, 'true'"
        )

    if not team.today.questions:
        say(
            "each commit is asked the tests of its own checkout; to ask all of them today's, name their files as "
            "questions in [build] of tracker.toml"
        )

    def measure(commit: str, *options: str) -> RunDocument:
        document, whose = team.measure(commit, folder, tests, *options)
        say(f"{commit[:12]} measured with {whose}: {subject(team.repository, commit)}")
        return document

    return team.repository, measure
