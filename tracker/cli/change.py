"""`tracker ci change` beside its base: both commits built here, in one job, and asked in turn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from spook_tracker.tracker.measure.bounds import MEMORY, TIME_LIMIT

from .options import complain

if TYPE_CHECKING:
    from spook_tracker.tracker.judge.accepted import Accepted
    from spook_tracker.tracker.judge.comparison_document import CompareDocument
    from spook_tracker.tracker.measure.builds import TeamRepository

PROCESS = "process"  # the executor by default
NIGHTS = 30  # of a machine, from which what is usual is taken
NEAREST = 10  # ancestors of a base that does not build which are tried instead of it


def beside_its_base(
    team: TeamRepository,
    base: str,
    database: str,
    accepted: Sequence[Accepted],
    options: Sequence[str],
    folder: Path,
) -> CompareDocument:
    """What changed from the base to the commit that is checked out. Raises TrackerError."""
    from spook_tracker.tracker.document.errors import TrackerError
    from spook_tracker.tracker.measure.commits import full_hash
    from spook_tracker.tracker.pairs import compare_by_pairs

    from .console import say

    head = full_hash(team.repository, "HEAD")
    if team.has_local_changes():
        complain("uncommitted changes are not measured: a change is built from its commit")
    start = _base_of(team, base, head, database)
    if start == head:
        raise TrackerError(f"{head[:12]} is its own base; name another with --base")
    change = team.built(head, folder)
    say(f"change {head[:12]} is built")
    first, where = _built_or_before(team, start, folder, say)
    return compare_by_pairs(
        lambda tests: team.ask_its_own(first, where, tests, *options),
        lambda tests: team.ask_its_own(head, change, tests, *options),
        lambda tests: team.ask_those_of(where, head, change, tests, *options),
        accepted,
        f"{first} {head}",
        say,
        lambda machine, rungs: _usual(database, machine, rungs),
    )


def _usual(database: str, machine: str, rungs: Mapping[str, Sequence[str]]) -> Mapping[str, float]:
    """The spread of run times between the last nights of a machine; nothing without a history."""
    from spook_tracker.tracker.document.errors import TrackerError
    from spook_tracker.tracker.pairs import usual_spreads

    from .recorded import history_of

    try:
        with history_of(database) as history:
            nights = [run for run in history.runs() if run.machine.fingerprint == machine]
            return usual_spreads(history, nights[-NIGHTS:], rungs)
    except TrackerError:  # there is none yet
        return {}


def _base_of(team: TeamRepository, base: str, head: str, database: str) -> str:
    """A revision, or a name that the history knows; fork-point is where git says that it leaves the main line."""
    from spook_tracker.tracker.library import FORK_POINT
    from spook_tracker.tracker.measure.commits import CommitError, full_hash
    from spook_tracker.tracker.store.git import merge_base

    from .recorded import history_of

    if base == FORK_POINT:
        found = merge_base(team.repository, head)
        if found not in ("", head):
            return found
        complain(
            "git does not say where this leaves the main line: its base is the commit before; else say --base"
        )
        return full_hash(team.repository, "HEAD^")
    try:
        return full_hash(team.repository, base)
    except CommitError:
        with history_of(database) as history:
            return full_hash(team.repository, history.resolve(base).engine.git_hash)


def _built_or_before(
    team: TeamRepository, start: str, folder: Path, say: Callable[[str], None]
) -> tuple[str, Path]:
    """The base, built; where it cannot be, the nearest of its first ancestors that can."""
    from spook_tracker.tracker.document.errors import TrackerError
    from spook_tracker.tracker.measure.commits import CommitError

    reasons: list[str] = []
    for commit in team.first_ancestors(start, NEAREST):
        try:
            place = team.built(commit, folder)
        except CommitError as error:
            reasons.append(str(error))
            complain(f"{error}; the commit before it is tried")
            continue
        say(f"base {commit[:12]} is built" + f": {len(reasons)} before it could not be" * bool(reasons))
        return commit, place
    raise TrackerError(f"there is no base that builds: {reasons[0] if reasons else start}")


def run_options(
    workers: int,
    limit: float | None = None,
    memory: int = MEMORY,
    time_limit: float = TIME_LIMIT,
    executor: str = PROCESS,
    named: Mapping[str, str] | None = None,
) -> list[str]:
    """Those of `tracker run` that a commit is asked with; older commits need not know what was not asked for."""
    options = ["--workers", str(workers)]
    options += [] if limit is None else ["--limit", str(limit)]
    options += [] if time_limit == TIME_LIMIT else ["--time-limit", str(time_limit)]
    options += [] if memory == MEMORY else ["--memory", str(memory)]
    options += [] if executor == PROCESS else ["--executor", executor]
    return options + [word for name, value in (named or {}).items() for word in (f"--{name}", value)]
