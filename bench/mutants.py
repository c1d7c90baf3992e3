"""`make mutants`: build engines that are wrong on purpose, and see that `tracker compare` names each of them.

Each mutant is a clone of this repository with one change to the native source, committed and built, so that it
has a version and a hash of its own; all record into one scratch database. Rebuilds without a change must be
reported identical in every value. `python bench/mutants.py NAME …` runs only those named; `--rebuilds N` sets how
many unchanged rebuilds are tried.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import sysconfig
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent


@dataclass(frozen=True)
class Mutant:
    """One change to the source and what the comparison must say about it."""

    name: str
    story: str
    changes: tuple[tuple[str, str, str], ...]  # file, text as it is, text put in its place
    tests: tuple[str, ...]
    sweep: bool
    expected: tuple[str, ...]  # words that must appear among the verdicts or reasons of what is red


SRC = "engine/native/src"
MUTANTS = (
    Mutant(
        name="costly-solver",
        story="the elimination of a path wastes time and changes no bit",
        changes=(
            (
                f"{SRC}/particles/particle_kernels.cpp",
                "                link[k].u = u;\n",
                "                for (int i = 1; i < 30; ++i) { volatile double waste = 1.0 / (r.diagonal + i); (void)waste; }\n"
                "                link[k].u = u;\n",
            ),
        ),
        tests=("pendulum", "n_pendulum"),
        sweep=True,
        expected=("slower",),
    ),
    Mutant(
        name="coarse-update",
        story="only half of each violation is put right per step",
        changes=(
            (f"{SRC}/particles/particle_kernels.cpp", "-r.violation_gain * g", "-0.5 * r.violation_gain * g"),
            (
                f"{SRC}/particles/distance_rows.cpp",
                "-r.violation_gain * l.g",
                "-0.5 * r.violation_gain * l.g",
            ),
        ),
        tests=("pendulum", "n_pendulum"),
        sweep=True,
        expected=("regressed",),
    ),
    Mutant(
        name="no-refinement",
        story="solutions are not refined against the true equations",
        changes=(
            (f"{SRC}/linear/block_ldlt.cpp", "round < refinements", "round < 0 * refinements"),
            (
                f"{SRC}/contacts/pivot_solver.cpp",
                "    if (refined) {\n        refine(",
                "    if (false && refined) {\n        refine(",
            ),
        ),
        tests=("beam", "door", "lock_ring", "cantilever"),
        sweep=False,
        expected=("regressed",),
    ),
    Mutant(
        name="damping-sign",
        story="the damping term has the sign printed in equation 2.11 of the thesis",
        changes=(
            (f"{SRC}/linear/regularisation.hpp", "spread = 1.0 + 4.0 * theta", "spread = 1.0 - 4.0 * theta"),
            (
                f"{SRC}/linear/regularisation.hpp",
                "static_assert(regularise(0.0, 0.25, 0.25).velocity_gain == 0.8);\n",
                "",
            ),
        ),
        tests=("pendulum", "oscillator_damped", "door"),
        sweep=False,
        expected=("regressed",),
    ),
)


def call(*command: str, cwd: Path, check: bool = True, **env: str) -> subprocess.CompletedProcess[str]:
    """Run a command quietly; its output is shown only if it fails."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, env=os.environ | env)
    if check and done.returncode != 0:
        sys.exit(f"{' '.join(command[:6])} … failed in {cwd}:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return done


def build(clone: Path, changes: tuple[tuple[str, str, str], ...], message: str) -> None:
    """A clone of HEAD with the changes committed and the engine built in place."""
    call("git", "clone", "-q", str(ROOT), str(clone), cwd=ROOT)
    for file, old, new in changes:
        text = (clone / file).read_text()
        if old not in text:
            sys.exit(f"{file} no longer holds {old!r}; bring this mutant up to date")
        (clone / file).write_text(text.replace(old, new))
    author = ("-c", "user.name=mutant", "-c", "user.email=mutant@example.org")
    call("git", *author, "commit", "-q", "--allow-empty", "-am", message, cwd=clone)
    cmake = str(Path(sys.executable).with_name("cmake"))
    call(cmake, "-S", "engine/native", "-B", "build", f"-DPython_EXECUTABLE={sys.executable}", cwd=clone)
    call(cmake, "--build", "build", "-j2", cwd=clone)
    for module in (clone / "build").glob("_core*.so"):
        module.rename(clone / "engine" / module.name)


def tracker(clone: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The tracker of a clone, with that clone's engine."""
    # -S leaves out the finder of an editable install, here and in the worker processes it starts.
    packages = sysconfig.get_path("purelib")
    search = os.pathsep.join([str(clone), packages])
    return call(
        sys.executable, "-S", "-m", "spook_tracker", *arguments, cwd=clone, check=False, PYTHONPATH=search
    )


def measure(clone: Path, database: str, tests: tuple[str, ...], sweep: bool) -> str:
    """Record one run of the clone; returns its commit."""
    done = tracker(clone, "run", *tests, *(["--sweep"] if sweep else []), "--db", database)
    if done.returncode > 1:
        sys.exit(done.stderr)
    return call("git", "rev-parse", "HEAD", cwd=clone).stdout.strip()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="mutants to try; all if none is named")
    parser.add_argument("--rebuilds", type=int, default=2, help="unchanged rebuilds to try")
    given = parser.parse_args()
    chosen = [m for m in MUTANTS if not given.names or m.name in given.names]
    failed = 0
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        place = Path(folder)
        original = place / "original"
        build(original, (), "the engine as it is")
        for mutant in chosen:
            database = f"sqlite:///{place}/{mutant.name}.db"
            clone = place / mutant.name
            build(clone, mutant.changes, mutant.story)
            before = measure(original, database, mutant.tests, mutant.sweep)
            after = measure(clone, database, mutant.tests, mutant.sweep)
            table = tracker(original, "compare", before, after, "--db", database)
            caught = table.returncode == 1 and all(word in table.stdout for word in mutant.expected)
            failed += not caught
            print(f"{'caught' if caught else 'MISSED'}  {mutant.name}: {mutant.story}")
            print("\n".join(f"        {line}" for line in table.stdout.strip().splitlines()[:12]), flush=True)
        for number in range(given.rebuilds):
            database = f"sqlite:///{place}/rebuild-{number}.db"
            clone = place / f"rebuild-{number}"
            build(clone, (), f"rebuild {number}")
            tests, sweep = ("pendulum", "n_pendulum"), True
            before = measure(original, database, tests, sweep)
            after = measure(clone, database, tests, sweep)
            report = tracker(original, "compare", before, after, "--db", database, "--format", "json")
            same = report.returncode == 0
            failed += not same
            summary = json.loads(report.stdout)["counts"] if same else report.stdout[-1500:]
            print(
                f"{'identical' if same else 'DIFFERENT'}  rebuild {number + 1} of {given.rebuilds}: {summary}",
                flush=True,
            )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
