"""Commits of a team's own repository, each built and asked as [build] of its tracker.toml says.

A commit is checked out into a clone that shares the repository's objects; the repository itself is left alone. A
commit builds itself by its own tracker.toml; one from before it had a [build] by today's.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec

from spook_tracker.tracker.document.errors import TrackerError
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.document.toml_file import read_toml

from .build_settings import FILE, TABLE, Build, build_of
from .commit import MOST
from .commits import CommitError, check_out, last_words

LIMIT = 3600.0  # s for one command: what hangs is a commit that cannot be had, and not the end of a search


@dataclass(frozen=True, kw_only=True)
class TeamRepository:
    """A repository whose commits can be had; `home` is the folder of tracker.toml in it."""

    repository: Path
    home: Path
    today: Build  # for commits that do not say it themselves
    always: str = ""  # shell command that builds every commit, whatever it says itself

    def built(self, commit: str, folder: Path) -> Path:
        """The folder of tracker.toml in that commit, built in `folder`; what is there is used again. CommitError."""
        place = folder / commit[:12]
        mark = place / ".git" / "built"
        if not mark.exists():
            check_out(self.repository, commit, place)
        home = place / self.home.relative_to(self.repository)
        if not home.is_dir():
            raise CommitError(f"{commit[:12]} has no folder {self.home.relative_to(self.repository)}")
        command = self.always or self.build_at(home).command
        if mark.exists() and mark.read_text(encoding="utf-8") == command:
            return home
        mark.unlink(missing_ok=True)
        done = self._shell(command, home, {})
        if done.returncode:
            why = last_words(done.stderr or done.stdout)
            raise CommitError(f"{commit[:12]} does not build: {why}")
        mark.write_text(command, encoding="utf-8")
        return home

    def build_at(self, home: Path) -> Build:
        """How the checkout there is built and asked. CommitError if its tracker.toml cannot be read."""
        file = home / FILE
        if not file.is_file():
            return self.today
        try:
            said = read_toml(file)
            return build_of(said[TABLE], file) if TABLE in said else self.today
        except (OSError, ValueError, TrackerError) as error:
            raise CommitError(f"its {FILE} cannot be read: {error}") from None

    def ask(self, commit: str, home: Path, tests: Sequence[str], *options: str) -> tuple[RunDocument, str]:
        """What a built commit answers, and whose questions these were, in words. CommitError."""
        reasons = []
        ours = (*self.today.questions, *(() if (home / FILE).is_file() else (FILE,)))
        if ours:
            try:
                with _laid_over(ours, self.home, home):
                    return self._answer(commit, home, self.today, tests, options, ours), "today's questions"
            except CommitError as error:
                reasons.append(f"today's questions: {error}")
        try:
            return self._answer(commit, home, self.build_at(home), tests, options, ()), "its own questions"
        except CommitError as error:
            reasons.append(f"its own questions: {error}" if reasons else str(error))
        raise CommitError(f"{commit[:12]} gives no answers; " + "; ".join(reasons))

    def ask_its_own(self, commit: str, home: Path, tests: Sequence[str], *options: str) -> RunDocument:
        """What it answers to its own questions. CommitError."""
        return self._answer(commit, home, self.build_at(home), tests, options, ())

    def ask_those_of(
        self, other: Path, commit: str, home: Path, tests: Sequence[str], *options: str
    ) -> RunDocument:
        """What it answers to the questions of another checkout. CommitError where no files are said to be questions."""
        questions = self.build_at(other).questions
        if not questions:
            raise CommitError(f"[{TABLE}] of {FILE} does not say which files are questions")
        with _laid_over((*questions, FILE), other, home):
            return self._answer(commit, home, self.build_at(home), tests, options, (*questions, FILE))

    def has_local_changes(self) -> bool:
        """Whether tracked files differ from the commit that is checked out."""
        return _git(self.repository, "diff", "--quiet", "HEAD").returncode == 1

    def first_ancestors(self, commit: str, most: int) -> list[str]:
        """The commit and those before it on the line of first parents."""
        return _git(self.repository, "rev-list", "--first-parent", f"-n{most}", commit).stdout.split()

    def measure(
        self, commit: str, folder: Path, tests: Sequence[str], *options: str
    ) -> tuple[RunDocument, str]:
        """Both in one."""
        return self.ask(commit, self.built(commit, folder), tests, *options)

    def _answer(
        self,
        commit: str,
        home: Path,
        build: Build,
        tests: Sequence[str],
        options: Sequence[str],
        laid: Sequence[str],
    ) -> RunDocument:
        file = home / "tracker-answers.json"
        file.unlink(missing_ok=True)
        given = {"ANSWERS": str(file), "TESTS": " ".join(tests), "OPTIONS": " ".join(options)}
        command: str | list[str] = build.ask or [
            *(sys.executable, "-m", "spook_tracker", "run", *tests, "--no-record", "--json", str(file)),
            *options,
        ]
        done = self._shell(command, home, given)
        try:
            content = file.read_bytes()
        except FileNotFoundError:
            raise CommitError(last_words(done.stderr) if done.returncode else f"nothing in {file}") from None
        finally:
            file.unlink(missing_ok=True)
        if done.returncode not in (0, 1) or (build.ask and done.returncode):
            raise CommitError(last_words(done.stderr))
        return _of_commit(_document(content, file), commit, home, laid)

    def _shell(
        self, command: str | list[str], home: Path, given: Mapping[str, str]
    ) -> subprocess.CompletedProcess[str]:
        build = self.build_at(home)
        said = {name: value.replace("{checkout}", str(home)) for name, value in build.environment.items()}
        programs = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
        line = ["bash", "-euo", "pipefail", "-c", command] if isinstance(command, str) else command
        with subprocess.Popen(
            line, cwd=home, env={**os.environ, "PATH": programs, **said, **given}, start_new_session=True, text=True,
            errors="replace", stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        ) as process:  # fmt: skip
            try:
                out, err = process.communicate(timeout=LIMIT)
            except BaseException as ended:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                if isinstance(ended, subprocess.TimeoutExpired):
                    raise CommitError(f"no end within {LIMIT:g} s: {line[-1]}") from None
                raise
        return subprocess.CompletedProcess(line, process.returncode, out, err)


def team_repository(home: Path | None, today: Build | None, always: str = "") -> TeamRepository | None:
    """That around the folder of tracker.toml; None if nothing says how it is built. TrackerError."""
    if home is None or (today is None and not always):
        return None
    found = _git(home, "rev-parse", "--show-toplevel")
    if found.returncode:
        raise TrackerError(f"{home} is in no git repository, so it has no commits that could be built")
    said = today or Build()
    for name in said.questions:
        if not (home / name).exists():
            raise TrackerError(f"{home / FILE}: there are no questions {name!r} to copy over earlier commits")
    return TeamRepository(
        repository=Path(found.stdout.strip()), home=home.resolve(), today=said, always=always
    )


@contextmanager
def _laid_over(questions: Sequence[str], today: Path, home: Path) -> Iterator[None]:
    """Today's questions in a commit's folder, as long as it is asked; what was built there stays."""
    added = []
    for name in questions:
        for file in sorted((today / name).rglob("*")) if (today / name).is_dir() else [today / name]:
            if file.is_file() and "__pycache__" not in file.parts:
                there = home / file.relative_to(today)
                added += [] if there.exists() else [there]
                there.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(file, there)
    try:
        yield
    finally:
        for file in added:
            file.unlink(missing_ok=True)
        for name in questions:  # one by one: git refuses all for one that this commit does not have
            _git(home, "checkout", "-q", "--", name)


def _document(content: bytes, file: Path) -> RunDocument:
    """A run document, or the one run in a file of another tool. CommitError."""
    from spook_tracker.tracker.document.json_form import decode

    from .other_tools import of_other_tools
    from .short_form import is_short, whole

    try:
        if (runs := of_other_tools(content, file.name)) is not None:
            if len(runs) != 1:
                raise CommitError(f"its answer holds {len(runs)} runs instead of one")
            return runs[0]
        return whole(content, file.name) if is_short(content) else decode(content, RunDocument)
    except (TrackerError, msgspec.DecodeError) as error:
        raise CommitError(str(error)) from None


def _of_commit(document: RunDocument, commit: str, home: Path, laid: Sequence[str]) -> RunDocument:
    """The run as one of that commit. CommitError if the engine that answered is another one."""
    told = document.engine.git_hash
    if told and not commit.startswith(told) and not told.startswith(commit):
        raise CommitError(
            f"the engine that answered is of commit {told[:12]}: what was built here is not what was asked"
        )
    others = [f":(exclude){name}" for name in laid]
    changed = _git(home, "diff", "--quiet", commit, "--", ".", *others).returncode == 1
    facts = _git(home, "show", "-s", "--format=%cI%x00%P%x00%s%x00%an", commit).stdout.strip("\n")
    made, parents, title, author = facts.split("\0")
    engine = msgspec.structs.replace(
        document.engine, git_hash=commit, dirty=changed, commit_time=made, parents=tuple(parents.split()),
        subject=title[:MOST], author=author[:MOST],
    )  # fmt: skip
    identity = str(
        uuid.uuid5(uuid.NAMESPACE_URL, f"{commit}/{document.id}")
    )  # another tool's file has its content's
    return msgspec.structs.replace(document, engine=engine, id=identity, idempotency_key=identity)


def _git(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["git", "-C", str(folder), *words], capture_output=True, text=True, errors="replace", check=False
    )
