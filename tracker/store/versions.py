"""Which run a name stands for. A name on the command line is one of

latest, previous, last-green    the newest run, the one before it, the newest with every gate passed
an engine version               1.2.0 or 1.2.1.dev3+g1a2b3c4: its newest run; 1.2.1.dev3 as pages print it, if it is one
                                commit's
a commit                        its hash or the start of it (4 characters or more), a tag, a branch
a run                           its id or the start of it (4 characters or more)

of the engine that the history is about, wherever it has such a run; "mujoco@3.3.0" or "mujoco@latest" asks for another
one. The words are of that engine alone.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime

from spook_tracker.tracker.document import run_document as document
from spook_tracker.tracker.document.about import about
from spook_tracker.tracker.document.errors import UnknownName

SHORTEST = 4  # characters of a hash or an id
MOST_NAMED = 12  # engines in a sentence
WORDS = ("latest", "previous", "last-green")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunInfo:
    """A run without its samples. Times are ISO 8601 as in its document."""

    id: str
    started: str
    finished: str
    trigger: str
    engine: document.EngineVersion
    machine: document.Machine
    tracker_version: str
    ci_address: str
    key: int  # what the large tables carry
    started_at: datetime
    gates: int  # gate samples in this run, but for what the engine does not support
    gates_passed: int
    asked: document.Asked | None = None  # None: not known
    content: str = ""  # hash of what was measured; empty: not known
    lineage: str = ""  # runs of one are ordered by ancestry, of two by time; empty: not of a commit

    @property
    def green(self) -> bool:
        """Every gate that the engine supports was measured inside its limit; a run without gates is not green."""
        return 0 < self.gates == self.gates_passed

    @property
    def ordered(self) -> bool:
        """Built from a commit as it stands: only such runs have a place in the commit order."""
        return is_ordered(self.engine)


def is_ordered(engine: document.EngineVersion) -> bool:
    """Whether it is of a commit as that stands."""
    return bool(engine.git_hash) and not engine.dirty


def resolve(runs: Sequence[RunInfo], name: str, commit_of: Callable[[str], str | None]) -> RunInfo:
    """The run among `runs` (in commit order) that `name` stands for; `commit_of` asks git for a commit.

    UnknownName, one sentence with names that may be meant, if there is none or if it could be several.
    """
    if not runs:
        raise UnknownName("no runs are stored yet; record one with: tracker run")
    engine, at, rest = name.rpartition("@")
    engines = {run.engine.name for run in runs}
    if at and engine in engines:
        found = _among([run for run in runs if run.engine.name == engine], rest, commit_of)
    else:
        ours = about(runs)
        first = [run for run in runs if run.engine.name == ours]
        if name in WORDS:  # of one engine: nothing is previous to another's run
            found = _by_word(first, name)
        else:
            others = [run for run in runs if run.engine.name != ours]
            found = _among(first, name, commit_of) or _among(others, name, commit_of)
    if found is None:
        raise _unknown(runs, name)
    return found


def _among(runs: list[RunInfo], name: str, commit_of: Callable[[str], str | None]) -> RunInfo | None:
    if not runs:
        return None
    if name in WORDS:
        return _by_word(runs, name)
    for sought in (
        [run for run in runs if run.id == name],
        [run for run in runs if run.engine.version == name],
        [run for run in runs if run.engine.git_hash == name],
    ):
        if sought:
            return _newest(sought)
    started = _by_start(runs, name)
    if started is not None:
        return started
    commit = commit_of(name)
    of_commit = [run for run in runs if commit and run.engine.git_hash == commit]
    return _newest(of_commit) if of_commit else _by_public_version(runs, name)


def _by_public_version(runs: list[RunInfo], name: str) -> RunInfo | None:
    """The version without the commit behind its plus sign: no more can be told from a page or a terminal."""
    meant = [run for run in runs if run.engine.version.partition("+")[0] == name]
    versions = tuple(sorted({run.engine.version for run in meant}))
    if len(versions) > 1:
        raise UnknownName(f"{name!r} could be {', '.join(versions[:5])}; write it whole", versions[:5])
    return _newest(meant) if meant else None


def _by_word(runs: list[RunInfo], word: str) -> RunInfo | None:
    """A dirty or unversioned build is the latest only as long as nothing has run since.

    Engines that come without commits have no better order than the time of their runs.
    """
    newest = max(runs, key=lambda run: run.started_at)
    versioned = any(run.ordered for run in runs)
    line = [run for run in runs if run.ordered or run is newest or not versioned]
    if word == "latest":
        return line[-1]
    if word == "previous":
        return line[-2] if len(line) > 1 else None
    return next((run for run in reversed(line) if run.green), None)


def _by_start(runs: list[RunInfo], name: str) -> RunInfo | None:
    if len(name) < SHORTEST:
        return None
    by_hash = [run for run in runs if run.engine.git_hash.startswith(name.lower())]
    by_id = [run for run in runs if run.id.startswith(name)]
    meant = {run.engine.git_hash for run in by_hash} | {run.id for run in by_id}
    if len(meant) > 1:
        near = tuple(sorted(text[:12] for text in meant))[:5]
        raise UnknownName(f"{name!r} could be {', '.join(near)}; write more characters", near)
    return _newest(by_hash or by_id) if meant else None


def unknown_test(keys: Iterable[str], test: str) -> UnknownName:
    """What to say of a test of which none of the recorded series is, with the tests that may be meant."""
    near = difflib.get_close_matches(test, {key.partition("/")[0] for key in keys}, n=3)
    hint = f"did you mean {' or '.join(near)}?" if near else "`tracker db stats` shows what is recorded"
    return UnknownName(f"nothing is recorded of a test {test!r}; {hint}")


def _newest(runs: list[RunInfo]) -> RunInfo:
    """The run meant by a version: clean before dirty, and the last one recorded."""
    return max(runs, key=lambda run: (not run.engine.dirty, run.started_at, run.id))


def _unknown(runs: Sequence[RunInfo], name: str) -> UnknownName:
    if name == "previous":
        return UnknownName("there is only one run, and so no previous one; record another with: tracker run")
    if name == "last-green":
        return UnknownName(
            "no run has passed all its gates yet, and runs without gates, as imported ones, have none to pass; name a version instead"
        )
    engines = list(dict.fromkeys(run.engine.name for run in runs))
    asked, at, _ = name.rpartition("@")
    if at and name.endswith(("@latest", "@previous")) and asked not in engines:
        only = ", ".join(engines[:MOST_NAMED])
        return UnknownName(
            f"no run of an engine {asked[:80]!r} is recorded, only of {only}", tuple(engines[:1])
        )
    if name in engines:
        return UnknownName(
            f"{name!r} is an engine: compare it with another one that is recorded, or name a version of it, as in "
            f"{name}@latest",
            (f"{name}@latest",),
        )
    names = [run.engine.version for run in reversed(runs)]
    names += [run.engine.git_hash[:12] for run in reversed(runs) if run.engine.git_hash]
    unique = list(dict.fromkeys(names))
    near = (
        tuple(difflib.get_close_matches(name, unique, n=3, cutoff=0.5))
        or tuple(text for text in unique if re.search(re.escape(name), text))[:3]
    )
    ours = about(runs)
    newest = _by_word([run for run in runs if run.engine.name == ours], "latest")
    latest = newest.engine.version if newest else unique[0]
    hint = f"did you mean {', '.join(near)}?" if near else f"the newest is {latest}"
    return UnknownName(f"no run of a version, commit or id {name[:80]!r}; {hint}", near or (latest,))
