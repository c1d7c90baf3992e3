"""`make past`: is a planted commit found in this project's own history, and do ten old commits still answer?

A clone of this repository goes back some commits, gets one change that is wrong on purpose (`bench/mutant_list.py`) as
a commit among them, and the commits after it again on top. `tracker bisect` must name the planted one. Then `tracker
backfill` measures old commits, spread evenly over the whole history, and the table says of each whose questions it
answered: today's, its own, or why none. The exit code is 1 where the commit is not found or no old commit answers.

Builds take minutes. They are kept in build/past: called again, it goes on where it was ended.

    make past
    python bench/past.py --range 8 --commits 10 --page docs/past.md
"""

from __future__ import annotations

import argparse
import datetime
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.mutant_list import MUTANTS
from bench.mutants import ROOT, changed

MUTANT = next(mutant for mutant in MUTANTS if mutant.name == "coarse-update")
TEST = MUTANT.caught_by


def said(place: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(place), *arguments], check=True, capture_output=True, text=True, errors="replace"
    )
    return done.stdout.strip()


def committed(place: Path, *arguments: str) -> None:
    """A git command that makes commits, equal ones every time: what is built of them serves again."""
    day = said(place, "show", "-s", "--format=%cI", "HEAD")
    who = {"NAME": "mutant", "EMAIL": "mutant@example.org", "DATE": day}
    environment = {
        f"GIT_{role}_{key}": value for key, value in who.items() for role in ("AUTHOR", "COMMITTER")
    }
    subprocess.run(
        ["git", "-C", str(place), *arguments],
        check=True,
        capture_output=True,
        env={**os.environ, **environment},
    )


def tracker(place: Path, *arguments: str) -> tuple[int, str]:
    """A command of the tracker inside a clone: its exit code and what it said, shown as it comes."""
    lines = []
    with subprocess.Popen(
        [sys.executable, "-u", "-m", "spook_tracker", *arguments],
        cwd=place, text=True, errors="replace", stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        env={**os.environ, "COLUMNS": "200"},
    ) as running:  # fmt: skip
        assert running.stdout is not None
        for line in running.stdout:
            now = datetime.datetime.now(datetime.UTC)
            print(f"{now:%H:%M:%S} {line.rstrip()}", flush=True)
            lines.append(line)
    return running.returncode, "".join(lines)


def line_of(place: Path, count: int) -> list[str]:
    """The last commits of the first-parent line after the last that changed a file the mutant is in, oldest first."""
    files = {file for file, _, _ in MUTANT.changes}
    commits = said(place, "rev-list", "--first-parent", f"--max-count={count}", "HEAD").split()
    touched = set(said(place, "rev-list", "--first-parent", "HEAD", "--", *files).split())
    kept = []
    for commit in commits:
        kept.append(commit)
        if commit in touched:
            break
    return kept[::-1]


def planted(folder: Path, count: int) -> tuple[Path, str, str]:
    """A clone with a wrong commit in the middle of its last ones; the last good commit, and the planted one."""
    place = folder / "clone"
    shutil.rmtree(place, ignore_errors=True)
    subprocess.run(["git", "clone", "-q", str(ROOT), str(place)], check=True)
    said(place, "checkout", "-q", "--detach", said(ROOT, "rev-parse", "HEAD"))
    line = line_of(place, count)
    middle = len(line) // 2
    said(place, "checkout", "-q", "--detach", line[middle])
    changed(place, MUTANT.changes)
    committed(place, "commit", "-qam", f"Plant: {MUTANT.story}")
    wrong = said(place, "rev-parse", "HEAD")
    for later in line[middle + 1 :]:
        merge = ("-m", "1") if " " in said(place, "show", "-s", "--format=%P", later) else ()
        committed(place, "cherry-pick", "--allow-empty", *merge, later)
    return place, line[0], wrong


def found(folder: Path, count: int) -> tuple[bool, list[str]]:
    """Whether bisect names the planted commit, and the lines of the page that say so."""
    place, good, wrong = planted(folder, count)
    searched = int(said(place, "rev-list", "--first-parent", "--count", f"{good}..HEAD"))
    code, words = tracker(
        place, "bisect", TEST, "--good", good, "--bad", "HEAD", "--keep", str(folder / "built")
    )
    named = re.search(r"first bad commit ([0-9a-f]{12})", words)
    right = code == 1 and named is not None and wrong.startswith(named[1])
    tried = len(re.findall(r"^[0-9a-f]{12} (?:good|bad|skip): ", words, re.MULTILINE))
    outcome = f"{'found' if right else 'NOT FOUND'} among {searched} commits in {tried} steps"
    print(f"planted {wrong[:12]}: {outcome}", flush=True)
    return right, [f'Planted in its middle: "{MUTANT.story}". `tracker bisect {TEST}`: {outcome}.']


def backfilled(folder: Path, commits: Sequence[str]) -> tuple[int, list[str]]:
    """How many of the commits answered, and the lines of the table."""
    database = folder / "past.db"
    database.unlink(missing_ok=True)
    kept = ("--db", f"sqlite:///{database}", "--keep", str(folder / "built"))
    _, words = tracker(ROOT, "backfill", *commits, "--test", TEST, *kept)
    answers = 0
    rows = ["| commit | day | questions answered | values |", "| --- | --- | --- | ---: |"]
    for commit in commits:
        whose = re.search(rf"^{commit[:12]} answers ([^:]+):", words, re.MULTILINE)
        told = re.search(rf"\] {commit[:12]}: (.*)", words)
        values = re.match(r"\d+ of \d+", told[1]) if told else None
        answers += whose is not None
        why = whose[1] if whose else f"none: {told[1]}" if told else "nothing said"
        day = said(ROOT, "show", "-s", "--format=%cs", commit)
        rows.append(f"| {commit[:12]} | {day} | {why} | {values[0] if values else ''} |")
    return answers, rows


PAGE = """# This project's old commits, measured

Made by `make past`, not by hand, at commit {head}; `bench/past.py` explains how.

## A planted commit
{planted}

## Old commits
`tracker backfill` of {count} commits, spread evenly over the {all} of the first-parent line, with `{test}`: {answers}
could be measured, with today's questions where the old engine can answer them, else with its own.

{table}
"""


def main() -> int:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("--range", type=int, default=8, help="commits to search")
    reader.add_argument("--commits", type=int, default=10, help="old commits to measure")
    reader.add_argument("--page", type=Path, help="write what was found as Markdown")
    given = reader.parse_args()
    folder = ROOT / "build" / "past"
    folder.mkdir(parents=True, exist_ok=True)
    line = said(ROOT, "rev-list", "--first-parent", "HEAD").split()
    every = max(1, len(line) // (given.commits + 1))
    old = line[every::every][: given.commits]
    right, search = found(folder, given.range) if given.range else (True, ["Not searched."])
    answers, table = backfilled(folder, old) if old else (0, ["None measured."])
    print("\n".join(table))
    print(f"{answers} of {len(old)} old commits answered")
    if given.page:
        page = PAGE.format(
            head=line[0][:12], planted="\n".join(search), count=len(old), all=len(line), test=TEST,
            answers=answers, table="\n".join(table),
        )  # fmt: skip
        given.page.write_text(page, encoding="utf-8")
    return 0 if right and (answers or not old) else 1


if __name__ == "__main__":
    sys.exit(main())
