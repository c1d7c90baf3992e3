"""`make mutation`: change the code one place at a time, and see that the tests of its room notice; prints scores.

The judge's rules are changed as the table below says, and each must be noticed: one that survives is a rule that no test
checks, and ends this with 1, as one does that no longer applies. `python bench/mutation.py NAME …` runs only those named.
Of the other rooms, `--rooms tracker/store engine …` (or `all`), `--sample N` mutants each are drawn at random; some change
nothing that can be seen, so their score is to be set beside another of the same `--seed`, not beside 100 %.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from bench.random_mutants import ROOMS, ROOT, Mutant, drawn

JUDGE = "tracker/judge"
TESTS = tuple(
    f"tests/{JUDGE}/test_{name}.py" for name in (
        "rules", "detection", "verdict", "noise", "compare", "analyse", "accepted", "normal_nights", "segments"
    )
)  # fmt: skip
# In a copy it is the copy that is imported, by whatever its tests start, too.
COPY_FIRST = """import sys
sys.meta_path[:] = [found for found in sys.meta_path if "editable" not in type(found).__module__]
"""


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
        "small-shifts-count", "shifts", "from .slower import LEAST", "LEAST = 0.0"
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


class Copy:
    """The sources and tests as they are in the working tree, with the engine that is built; changed and asked."""

    def __init__(self, folder: Path) -> None:
        from spook_tracker.engine import _core

        self.folder, self.changes = folder, 0
        listed = ("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard")
        for name in (
            subprocess.run(listed, cwd=ROOT, capture_output=True, check=True).stdout.decode().split("\0")
        ):
            source, target = ROOT / name, folder / name
            if name and (source.is_symlink() or source.is_file()):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target, follow_symlinks=False)
        shutil.copy(str(_core.__file__), folder / "engine")
        (folder / ".first").mkdir()
        (folder / ".first" / "sitecustomize.py").write_text(COPY_FIRST)

    def asked(self, tests: Sequence[str], limit: float | None = None) -> tuple[int, str]:
        """Exit code and output of the tests; 1 where they take longer than the limit, s."""
        path = f"{self.folder / '.first'}{os.pathsep}{self.folder}"
        environment = os.environ | {
            "PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "", "OPENBLAS_NUM_THREADS": "1",
            "HYPOTHESIS_STORAGE_DIRECTORY": str(self.folder / ".hypothesis"),
        }  # fmt: skip
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:xdist",
            "--hypothesis-seed=0",
        ]
        try:
            done = subprocess.run(
                [*command, *tests], cwd=self.folder, env=environment, capture_output=True, text=True, check=False,
                timeout=limit,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return 1, "too slow"
        if done.returncode not in (0, 1):
            raise RuntimeError(done.stdout[-2000:] + done.stderr[-2000:])
        return done.returncode, done.stdout

    def killed(self, found: Mutant, tests: Sequence[str], limit: float | None = None) -> bool:
        """Whether the tests fail for this mutant."""
        file = self.folder / found.file
        sound, self.changes = file.stat(), self.changes + 1
        text = file.read_text(encoding="utf-8")
        try:
            file.write_text(found.applied(text), encoding="utf-8")
            os.utime(file, (0, self.changes))  # what was compiled of another mutant is not taken for it
            return self.asked(["-x", *tests], limit)[0] == 1
        finally:
            file.write_text(text, encoding="utf-8")
            os.utime(file, (sound.st_atime, sound.st_mtime))


def score(copies: Sequence[Copy], mutants: Sequence[Mutant], paths: Sequence[str]) -> list[bool] | None:
    """Which mutants these tests kill; None where they fail without any change and nothing can be said."""
    begun = time.perf_counter()
    files = [str(f.relative_to(ROOT)) for path in paths for f in tests_of(path)]
    _, output = copies[0].asked(files)
    deselected = [
        f"--deselect={name}"
        for name in re.findall(r"^(?:FAILED|ERROR) (\S+::[^\n]*?)(?: - |$)", output, re.M)
    ]
    limit = 4.0 * (time.perf_counter() - begun) + 60.0
    if len(deselected) > 5:
        return None
    free: SimpleQueue[Copy] = SimpleQueue()
    for copy in copies:
        free.put(copy)

    def killed(found: Mutant) -> bool:
        copy = free.get()
        try:
            name = Path(found.file).stem
            near = sorted(
                files,
                key=lambda file: not re.search(rf"\b{name}\b", (ROOT / file).read_text(encoding="utf-8")),
            )
            return copy.killed(found, [*deselected, *near], limit)
        finally:
            free.put(copy)

    with ThreadPoolExecutor(len(copies)) as pool:
        return list(pool.map(killed, mutants))


def tests_of(path: str) -> list[Path]:
    place = ROOT / path
    return sorted(place.rglob("test_*.py")) if place.is_dir() else sorted(ROOT.glob(path))


def told(mutants: Sequence[Mutant], results: Sequence[bool]) -> None:
    for found, dead in zip(mutants, results, strict=True):
        print(f"{'killed  ' if dead else 'SURVIVED'}  {found.name:32} {found.file if found.at < 0 else ''}")


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--rooms", nargs="+", choices=["all", *ROOMS], default=[])
    parser.add_argument("--sample", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    asked = parser.parse_args(words)
    rooms = list(ROOMS) if "all" in asked.rooms else asked.rooms
    with tempfile.TemporaryDirectory() as name:
        copies = [Copy(Path(name) / str(n)) for n in range(asked.workers)]
        if not rooms:
            chosen = [found for found in MUTANTS if not asked.names or found.name in asked.names]
            results = score(copies, chosen, TESTS)
            if results is None:
                print("the tests fail without any change; nothing can be said")
                return 1
            told(chosen, results)
            print(f"\n{sum(results)} of {len(results)} mutants killed")
            return 0 if all(results) else 1
        for room in rooms:
            mutants = drawn(room, asked.sample, asked.seed)
            results = score(copies, mutants, ROOMS[room])
            if results is None:
                print(f"{room}: the tests fail without any change; nothing can be said")
                continue
            told(mutants, results)
            print(f"{room}: {sum(results)} of {len(results)} random mutants killed", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
