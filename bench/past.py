"""`make past`: is a planted commit found in this project's own history, and do ten old commits still answer?

A clone of this repository goes back some commits, gets one change that is wrong on purpose (`bench/mutant_list.py`) as
a commit among them, and the commits after it again on top. `tracker bisect` must name the planted one. Then `tracker
backfill` measures old commits and the table says of each whose questions it answered: today's, its own, or that it does
not build. Builds take minutes; the exit code is 1 where the commit is not found or no old commit answers.

    make past
    python bench/past.py --range 8 --commits 10 --every 25
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.mutant_list import MUTANTS
from bench.mutants import ROOT, changed, git

PLANTED = "coarse-update"
TEST = "pendulum"


def said(place: Path, *arguments: str) -> str:
    done = subprocess.run(
        ["git", "-C", str(place), *arguments], check=True, capture_output=True, text=True, errors="replace"
    )
    return done.stdout.strip()


def tracker(place: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """A command of the tracker that is installed here, inside a clone."""
    return subprocess.run(
        [sys.executable, "-m", "spook_tracker", *arguments],
        cwd=place, capture_output=True, text=True, errors="replace", check=False,
        env={**os.environ, "COLUMNS": "200"},
    )  # fmt: skip


def line_of(place: Path, count: int) -> list[str]:
    """The last commits of the first-parent line that change no file the mutant is in, oldest first."""
    (file, _, _) = next(m for m in MUTANTS if m.name == PLANTED).changes[0]
    commits = said(place, "rev-list", "--first-parent", f"--max-count={count}", "HEAD").split()
    touched = set(said(place, "rev-list", f"--max-count={count}", "HEAD", "--", file).split())
    kept = []
    for commit in commits:
        kept.append(commit)
        if commit in touched:
            break
    return kept[::-1]


def planted(folder: Path, count: int) -> tuple[Path, str, str]:
    """A clone with a wrong commit in the middle of its last ones; the last good commit, and the planted one."""
    place = folder / "clone"
    subprocess.run(["git", "clone", "-q", str(ROOT), str(place)], check=True)
    git(place, "checkout", "-q", "--detach", said(ROOT, "rev-parse", "HEAD"))
    line = line_of(place, count)
    middle = len(line) // 2
    git(place, "checkout", "-q", "--detach", line[middle])
    mutant = next(m for m in MUTANTS if m.name == PLANTED)
    changed(place, mutant.changes)
    git(place, "commit", "-qam", f"Plant: {mutant.story}")
    wrong = said(place, "rev-parse", "HEAD")
    if later := line[middle + 1 :]:
        git(place, "cherry-pick", "--allow-empty", *later)
    return place, line[0], wrong


def found(folder: Path, count: int) -> bool:
    """Whether bisect names the planted commit."""
    place, good, wrong = planted(folder, count)
    done = tracker(place, "bisect", TEST, "--good", good, "--bad", "HEAD", "--keep", str(folder / "built"))
    print(done.stdout + done.stderr, flush=True)
    named = re.search(r"first bad commit ([0-9a-f]{12})", done.stdout)
    right = done.returncode == 1 and named is not None and wrong.startswith(named[1])
    print(f"planted {wrong[:12]}: {'found' if right else 'NOT FOUND'}", flush=True)
    return right


def backfilled(folder: Path, commits: Sequence[str]) -> int:
    """How many of the commits answered; prints the table."""
    asked = (
        "backfill",
        *commits,
        "--test",
        TEST,
        "--db",
        f"sqlite:///{folder}/past.db",
        "--keep",
        str(folder / "built"),
    )
    done = tracker(ROOT, *asked)
    if not done.stdout:
        print(done.stderr)
    answers = 0
    print("| commit | day | answered |\n| --- | --- | --- |")
    for commit in commits:
        whose = re.search(rf"^{commit[:12]} answers ([^:]+):", done.stdout, re.MULTILINE)
        why = re.search(rf"\] {commit[:12]}: (.*)", done.stdout)
        answers += whose is not None
        day = said(ROOT, "show", "-s", "--format=%cs", commit)
        print(
            f"| {commit[:12]} | {day} | {whose[1] if whose else why[1] if why else 'nothing said'} |",
            flush=True,
        )
    return answers


def main() -> int:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("--range", type=int, default=8, help="commits to search")
    reader.add_argument("--commits", type=int, default=10, help="old commits to measure")
    reader.add_argument("--every", type=int, default=25, help="commits between two of them")
    given = reader.parse_args()
    with tempfile.TemporaryDirectory(prefix="past-") as place:
        folder = Path(place)
        right = found(folder, given.range) if given.range else True
        line = said(ROOT, "rev-list", "--first-parent", "HEAD").split()
        answers = (
            backfilled(folder, line[: given.commits * given.every : given.every]) if given.commits else 0
        )
    print(f"{answers} of {given.commits} old commits answered")
    return 0 if right and (answers or not given.commits) else 1


if __name__ == "__main__":
    sys.exit(main())
