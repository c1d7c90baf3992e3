"""`make mutation`: change the judge's rules one at a time, and see that its tests notice; prints the score.

Each mutant is a copy of the sources with one text replaced. It is killed if the tests of the judge fail, and it
survives if they pass: then a rule stands in the code that no test checks. `python bench/mutation.py NAME …`
runs only those named. Ends with 1 if one survives, or no longer applies.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
JUDGE = "tracker/judge"
TESTS = (
    "tests/tracker/judge/test_rules.py", "tests/tracker/judge/test_detection.py", "tests/tracker/judge/test_verdict.py", "tests/tracker/judge/test_noise.py",
    "tests/tracker/judge/test_compare.py", "tests/tracker/judge/test_analyse.py", "tests/tracker/judge/test_accepted.py",
    "tests/tracker/judge/test_normal_nights.py", "tests/tracker/judge/test_segments.py",
)  # fmt: skip
RUN = "import sys; sys.path[:0] = sys.argv[1:3]; import pytest; sys.exit(pytest.main(sys.argv[3:]))"


@dataclass(frozen=True)
class Mutant:
    """One rule changed."""

    name: str
    file: str
    old: str  # occurs once
    new: str


def mutant(name: str, file: str, old: str, new: str) -> Mutant:
    return Mutant(name, f"{JUDGE}/{file}.py", old, new)


MUTANTS = (
    mutant("three-sigmas", "level", "SIGMAS = 4.0", "SIGMAS = 3.0"),
    mutant("short-window", "level", "WINDOW = 30 ", "WINDOW = 8 "),
    mutant("long-window", "level", "WINDOW = 30 ", "WINDOW = 60 "),
    mutant("noise-times-level", "segments", "for value in values]) / abs(level)", "for value in values]) * abs(level)"),
    mutant("no-floor", "level", "max(FLOOR, SIGMAS * noise)", "SIGMAS * noise"),
    mutant("low-floor", "level", "\nFLOOR = 0.05", "\nFLOOR = 0.03"),
    mutant("noise-from-four", "level", "\nFEWEST = 5", "\nFEWEST = 4"),
    mutant("lenient-start", "level", "FEW_NIGHTS_FLOOR = 0.5", "FEW_NIGHTS_FLOOR = 0.6"),
    mutant("one-night-confirms", "run_times", "len(self.off) > 1 and", "len(self.off) > 0 and"),
    mutant("no-normal", "segments", "NORMAL = 1.4826", "NORMAL = 1.0"),
    mutant("larger-is-not-better", "slower", "return -change if larger_is_better == (level > 0.0) else change", "return change"),
    mutant("no-creep", "drift", "if len(self.anchor) < CREEP or len(last) < CREEP:", "if True:"),
    mutant("clusters-are-not-learnt", "level", "\nREACH = 1.25", "\nREACH = 0.0"),
    mutant("no-flaky-levels", "run_times", "OFTEN = 2 ", "OFTEN = 200 "),
    mutant("one-visit-is-enough", "run_times", "OFTEN = 2 ", "OFTEN = 1 "),
    mutant("a-visit-may-last", "run_times", "LONGER = 2 ", "LONGER = 200 "),
    mutant("a-walk-is-many-steps", "level", "len(moves) < WINDOW or len(worse)", "True or len(worse)"),
    mutant("faster-is-wandering", "level", "min(median(worse), median(", "max(median(worse), median("),
    mutant("one-slow-night-is-a-move", "level", "np.clip(forties, middle - far, middle + far)", "forties"),
    mutant("a-walk-is-long-remembered", "level", "len(moves) - REACHED", "len(moves) - 2 * REACHED"),
    mutant("no-memory", "shifts", "return min(strongest, 0.98)", "return 0.0"),
    mutant("what-was-once-remembered-stays", "shifts", "abs(once - found) <= CHANCE", "abs(once - found) <= 99.0"),
    mutant("each-segment-learns-anew", "shifts", "if spread > 0.0 and len(earlier) > lag:", "if False:"),
    mutant("no-permutations", "shifts", "if probability < enough else None", "if probability < 1.0 else None"),
    mutant("no-t-test", "shifts", "rise <= standard_error(base, len(last), memory)", "False"),
    mutant(
        "small-shifts-count", "shifts", "from spook_tracker.tracker.judge.slower import LEAST", "LEAST = 0.0"
    ),
    mutant("accidents-count-in-full", "normal_nights", "WEIGHT = 3.5", "WEIGHT = 6.0"),
    mutant("any-noise-is-normal", "normal_nights", "NORMAL_SCORE = 2.3263", "NORMAL_SCORE = 99.0"),
    mutant("memory-is-normal", "normal_nights", "WHITE = 1.2816", "WHITE = 99.0"),
    mutant("few-nights-tell-how-they-lie", "normal_nights", "LEARNT = 40", "LEARNT = 30"),
    mutant("one-freedom-more", "normal_nights", "1.0 / count)), count - 1)", "1.0 / count)), 4 * count)"),
    mutant("old-series-spend-as-young", "shifts", "RARE * min(1.0, LEARNING / max(age, 1.0))", "RARE"),
    mutant("normal-nights-need-a-permutation", "shifts", "if (by_chance := chance(base, last, rare)) < rare else None", "if (by_chance := 1.0) < rare else None"),
    mutant("a-visit-hides-a-step", "run_times", "told = found is not None and found.apart and", "told = False and"),
    mutant("slow-weekends-are-draws", "shifts", "OFTEN_ENOUGH = 1.5", "OFTEN_ENOUGH = 9.0"),
    mutant("draws-lie-anywhere", "shifts", "NEAR_ENOUGH = 3.0", "NEAR_ENOUGH = 1e9"),
    mutant("draws-are-segments", "run_times", "len(nights) >= max(FEWEST_BASE, asked + 1) and drawn_anew(", "False and drawn_anew("),
    mutant("one-night-mends", "run_times", "BACK, WEIGHT = 9.0, 6.0", "BACK, WEIGHT = 9.0, 99.0"),
    mutant("blame-is-never-looked-at-again", "run_times", "SETTLED = 30", "SETTLED = 0"),
    mutant("all-nights-are-of-one-age", "run_times", "age = self.ages[nights[-1]] - self.ages[self.start]", "age = 0"),
    mutant("slow-nights-are-not-counted", "run_times", "if found is None and strays:", "if False:"),
    mutant("a-fast-night-is-never-far", "run_times", "faster = way_back(change) if", "faster = -change if"),
    mutant("a-rate-falls-by-itself", "level", "return way_back(-change) if self.larger_is_better", "return change if self.larger_is_better"),
    mutant("first-nights-are-of-the-level", "level", "inner_split(costs, 1.0) or earlier_level(base)", "inner_split(costs, 1.0)"),
    mutant("any-first-nights-are-older", "segments", "math.comb(count, split) >= CHOICES and", ""),
    mutant("a-way-is-two-levels", "segments", "> APART * noise:\n            return int(split)", "> 0.0:\n            return int(split)"),
    mutant("bounded-is-growing", "verdict", '"bounded": 1, "growing": 2', '"bounded": 1, "growing": 1'),
    mutant("unknown-cell-is-best", "verdict", "CELL_RANK.get(cell, len(CELL_RANK))", "CELL_RANK.get(cell, 0)"),
    mutant("diverged-is-not-finite", "verdict", '"diverged": 4,\n    "crashed"', '"diverged": 3,\n    "crashed"'),
    mutant("timed-out-is-not-finite", "verdict", '"timed_out": 4', '"timed_out": 3'),
    mutant("missing-is-crashed", "verdict", '"missing": 5', '"missing": 4'),
    mutant("out-of-limit-is-value", "verdict", '"out_of_limit": 2', '"out_of_limit": 0'),
    mutant("unsettled-is-value", "verdict", '"unsettled": 1', '"unsettled": 0'),
    mutant("deep-inside-is-shallow", "verdict", "DEEP_INSIDE = 1e-3", "DEEP_INSIDE = 1e-1"),
    mutant("zero-may-go-far", "verdict", "EXACT_ZERO = 1e-6", "EXACT_ZERO = 1e-3"),
    mutant("missing-is-fine", "vocabulary", '"missing": Said("✗", red=True)', '"missing": Said("✗")'),
    mutant("contradiction-is-fine", "vocabulary", '"non_deterministic": Said("✗", red=True)', '"non_deterministic": Said("✗")'),
    mutant("dirty-is-clean", "compare", 'clean = before.git_hash != "" and not before.dirty and not after.dirty', 'clean = before.git_hash != ""'),
    mutant("any-commit-is-the-same", "compare", "return clean and (before.engine", "return clean or (before.engine"),
    mutant("history-dirty-is-clean", "judged", 'clean = old.git_hash != "" and not old.dirty and not new.dirty', 'clean = old.git_hash != ""'),
    mutant("history-any-commit-is-the-same", "judged", "return clean and (old.name", "return clean or (old.name"),
)  # fmt: skip


def applied(found: Mutant, text: str) -> str:
    """The text with the rule changed; ValueError if it is not there exactly once."""
    if text.count(found.old) != 1:
        raise ValueError(
            f"{found.name}: {found.old!r} is in {found.file} {text.count(found.old)} times, not once"
        )
    return text.replace(found.old, found.new)


def copied(folder: Path) -> None:
    """The sources and tests, with the engine that is built and the pages that tests hold to the judge."""
    from spook_tracker.engine import _core

    only = shutil.ignore_patterns("native", "__pycache__", "*.so")
    for name in ("engine", "scalar_tests", "tracker", "migrations", "site", "tests", "bench"):
        shutil.copytree(ROOT / name, folder / name, ignore=only)
    shutil.copytree(ROOT / "spook_tracker", folder / "spook_tracker", symlinks=True)
    (folder / "docs").mkdir()
    for page in (ROOT / "docs").glob("*.md"):
        shutil.copy(page, folder / "docs")
    shutil.copy(str(_core.__file__), folder / "engine")
    shutil.copy(ROOT / "pyproject.toml", folder)


def killed(found: Mutant | None) -> bool:
    """Whether the judge's tests fail for this mutant. None: the sources as they are."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copied(folder)
        if found is not None:
            file = folder / found.file
            file.write_text(applied(found, file.read_text()))
        tests = [test for test in TESTS if (folder / test).is_file()]
        arguments = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]
        command = [sys.executable, "-S", "-B", "-c", RUN, name, sysconfig.get_path("purelib"), *arguments]
        environment = os.environ | {"HYPOTHESIS_STORAGE_DIRECTORY": name}
        done = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
        if done.returncode not in (0, 1):
            raise RuntimeError(done.stdout[-2000:] + done.stderr[-2000:])
        return done.returncode == 1


def main(names: list[str]) -> int:
    chosen = [found for found in MUTANTS if not names or found.name in names]
    if killed(None):
        print("the tests fail without any change; nothing can be said")
        return 1
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        results = list(pool.map(killed, chosen))
    for found, dead in zip(chosen, results, strict=True):
        print(f"{'killed  ' if dead else 'SURVIVED'}  {found.name:32} {found.file}")
    print(f"\n{sum(results)} of {len(results)} mutants killed")
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
