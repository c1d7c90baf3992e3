"""What earlier commits of this project answer: a history measured afterwards, and the first bad commit found.

Commits are built and asked by tracker/measure/builds.py and judged by tracker/judge/; git says which commit to try
next, also where ways part and meet again, and where one cannot be built.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import msgspec

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import RunDocument, Sample, SeriesDefinition
from spook_tracker.tracker.judge.choice import Choice
from spook_tracker.tracker.judge.compare import ComparedRun, compare, side_of
from spook_tracker.tracker.judge.comparison_document import Change, CompareDocument
from spook_tracker.tracker.judge.explaining import TIMES
from spook_tracker.tracker.judge.lane import asked_for, line_of
from spook_tracker.tracker.judge.tonight import Finding
from spook_tracker.tracker.judge.verdict import NEW_DEFINITION
from spook_tracker.tracker.judge.work import FAMILIES, with_work
from spook_tracker.tracker.measure.commits import CommitError, full_hash

if TYPE_CHECKING:
    from spook_tracker.tracker.document.run_document import Run
    from spook_tracker.tracker.judge.lane import Records

FIRST_BAD = re.compile(r"^([0-9a-f]{40,64}) is the first bad commit", re.MULTILINE)
Measure = Callable[[str], RunDocument]
CommitWord = Literal["good", "bad", "skip"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One commit that was tried."""

    commit: str
    word: CommitWord
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Blamed:
    """Where it became worse: one commit, or several of which none could be measured."""

    commits: tuple[str, ...]
    reds: tuple[Change, ...]  # what is worse in the bad commit than in the good one
    steps: tuple[Step, ...]


def compare_documents(before: RunDocument, after: RunDocument) -> CompareDocument:
    """What changed from one run to another, neither of which is recorded."""
    old, new = (
        ComparedRun(side=side_of(run), samples=with_work(_samples(run), run.engine), maps=run.maps)
        for run in (before, after)
    )
    return compare(old, new)


def _samples(run: RunDocument) -> dict[str, tuple[SeriesDefinition, Sample]]:
    definitions = {definition.key: definition for definition in run.series}
    return {sample.series: (definitions[sample.series], sample) for sample in run.samples}


UNTOLD = ("not_comparable", "not_measured")


@dataclass(frozen=True, slots=True, kw_only=True)
class OldAnswers:
    """What became of tests whose definition changed, by their old definition, as far as that can be told."""

    commit: str  # whose questions
    tests: tuple[str, ...]
    changes: tuple[Change, ...]  # of every series, also of those that could not be compared
    why_not: str = ""  # why nothing was answered

    @property
    def red(self) -> bool:
        return any(change.red for change in self.changes)

    @property
    def told(self) -> list[Change]:
        """What could be compared."""
        return [change for change in self.changes if change.word not in UNTOLD]

    @property
    def untold(self) -> list[Change]:
        """What could not; each says why."""
        return [change for change in self.changes if change.word in UNTOLD]

    @property
    def open(self) -> bool:
        """Whether it says nothing of some value: then it is not green. Work is only counted in the same build."""
        return any(change.kind not in (*TIMES, "work") for change in self.untold) or not self.told


def by_old_questions(
    history: Records,
    run: Run,
    findings: Sequence[Finding],
    ask: Callable[..., RunDocument],
    choice: Choice | None = None,
) -> list[OldAnswers]:
    """The tests of a run whose definition changed, judged by what they asked before.

    `ask(commit, tests, *options)` gives today's engine's answers to the questions of that commit, with the options of
    `tracker run`; it raises CommitError. Of each series the newest earlier answer counts: sweeps are rarer than values.
    """
    choice = choice or Choice()
    changed = {
        f.series: f.test
        for f in findings
        if f.verdict.word == "not_comparable" and f.verdict.sentence == NEW_DEFINITION
    }
    first, told = set(changed.values()), list[OldAnswers]()
    for old in reversed(line_of(history.runs(), run)[:-1]):
        if not changed and not first:
            break
        stored = {
            key: pair
            for key, pair in history.samples(old.id).items()
            if (key in changed or pair[0].test in first)
            and choice.takes(pair[0].test, pair[0].kind, pair[0].role)
        }
        if stored:
            tests = {definition.test for definition, _ in stored.values()}
            first -= tests
            changed = {key: test for key, test in changed.items() if key not in stored}
            answers = _by_questions_of(old, run, stored, tuple(sorted(tests)), ask)
            chosen = tuple(c for c in answers.changes if choice.takes(c.test, c.kind, c.role))
            told.append(replace(answers, changes=chosen))
    return told


def _by_questions_of(
    old: Run,
    run: Run,
    stored: dict[str, tuple[SeriesDefinition, Sample]],
    tests: tuple[str, ...],
    ask: Callable[..., RunDocument],
) -> OldAnswers:
    commit = old.engine.git_hash
    before = ComparedRun(side=side_of(old), samples=with_work(stored, old.engine))
    families = {FAMILIES[definition.kind] for definition, _ in stored.values()}
    try:
        if not commit or old.engine.dirty:
            raise CommitError(f"run {old.id[:8]} is of no commit: its questions cannot be read any more")
        document = ask(commit, tests, *(f"--{more}" for more in ("sweep", "stability") if more in families))
        if document.engine.git_hash != run.engine.git_hash:
            raise CommitError(
                f"the engine here is {document.engine.version}, not that of the run; check out and build its commit"
            )
    except CommitError as error:
        nothing = compare(before, ComparedRun(side=side_of(run), samples={})).changes
        untold = (msgspec.structs.replace(change, sentence=str(error)) for change in nothing)
        return OldAnswers(commit=commit, tests=tests, changes=tuple(untold), why_not=str(error))
    samples = {key: pair for key, pair in _samples(document).items() if key in stored}
    after = ComparedRun(
        side=side_of(document),
        samples=with_work(samples, document.engine),
        asked=asked_for(document, samples),
    )
    return OldAnswers(
        commit=commit,
        tests=tests,
        changes=tuple(change for change in compare(before, after).changes if change.word != "new"),
    )


def bisect(
    repository: Path,
    good: str,
    bad: str,
    measure: Measure,
    choice: Choice | None = None,
    watch: Callable[[Step], None] = lambda step: None,
) -> Blamed:
    """The first commit after `good` that is worse than it in what `bad` is worse in. Raises TrackerError.

    `measure` gives the run of a commit; where it raises CommitError the commit is passed over.
    """
    first, last = full_hash(repository, good), full_hash(repository, bad)
    if _git(repository, "merge-base", "--is-ancestor", first, last).returncode or first == last:
        raise TrackerError(f"{good} is no ancestor of {bad}; name a good commit that the bad one builds on")
    sound = measure(first)
    worse = _reds(sound, measure(last), choice or Choice())
    if not worse:
        raise TrackerError(
            f"nothing of it is worse at {last[:12]} than at {first[:12]}; look at other commits"
        )
    wanted = {change.series for change in worse}
    steps: list[Step] = []
    with tempfile.TemporaryDirectory(prefix="bisect-") as folder:
        clone = Path(folder) / "clone"
        _git(repository, "clone", "-q", "--shared", "--no-checkout", str(repository), str(clone))
        said = _git(clone, "bisect", "start", "--no-checkout", last, first).stdout
        while True:
            if found := FIRST_BAD.search(said):
                return Blamed(commits=(found[1],), reds=tuple(worse), steps=tuple(steps))
            if "only 'skip'ped commits left" in said:
                left = re.findall(r"^[0-9a-f]{40,64}$", said, re.MULTILINE)
                return Blamed(commits=tuple(left), reds=tuple(worse), steps=tuple(steps))
            commit = _git(clone, "rev-parse", "BISECT_HEAD").stdout.strip()
            step = _tried(commit, sound, measure, wanted)
            steps.append(step)
            watch(step)
            done = _git(clone, "bisect", step.word)
            said = done.stdout + done.stderr
            if not said.strip():
                raise TrackerError("git bisect said nothing; try it by hand: git bisect start")


def _tried(commit: str, sound: RunDocument, measure: Measure, wanted: set[str]) -> Step:
    try:
        document = compare_documents(sound, measure(commit))
    except CommitError as error:
        return Step(commit=commit, word="skip", why=str(error))
    told = {change.series: change for change in document.changes if change.series in wanted}
    reds = [change for change in told.values() if change.red]
    if reds:
        why = f"{reds[0].series}: {reds[0].sentence}"
        return Step(commit=commit, word="bad", why=why + (f"; and {len(reds) - 1} more" * (len(reds) > 1)))
    if not told or all(change.word == "not_comparable" for change in told.values()):
        why = next((change.sentence for change in told.values()), "it does not answer this")
        return Step(commit=commit, word="skip", why=f"cannot be compared: {why}")
    return Step(commit=commit, word="good", why="no worse than the good commit")


def _reds(before: RunDocument, after: RunDocument, choice: Choice) -> list[Change]:
    document = compare_documents(before, after)
    return [
        change
        for change in document.changes
        if change.red and choice.takes(change.test, change.kind, change.role)
    ]


def _git(repository: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        ["git", "-C", str(repository), *arguments],
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode and arguments[0] in ("clone",):
        raise TrackerError(f"git {arguments[0]} failed: {done.stderr.strip()[-200:]}")
    return done
