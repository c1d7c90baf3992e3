"""`make pairs`: changes measured beside their base; how many unchanged ones are blocked, how many slower ones found.

    make pairs                                          simulated noise, and real processes of this engine
    python bench/pairs.py --processes 60 --busy 2       so many fresh processes beside two that only compute
    python bench/pairs.py --levels levels.json          those of an earlier call, not measured again

Simulated: models of the noise between processes (tests/histories/process_noise.py), the whole rule as `tracker ci change` applies
it to one run time. Real: fresh processes of one build of this engine take the run times of a few tests, one process
after the other, so all differences between them are noise. Each unchanged change is a stretch of them at a random place
with sides drawn as the rule draws them; a slower one is the same with the times of its change so much longer.
Where many stretches are cut from the same processes they share them, so a share of theirs says less than its count.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from spook_tracker.tracker.document.json_form import decode
from spook_tracker.tracker.document.middle import median
from spook_tracker.tracker.document.run_document import RunDocument
from spook_tracker.tracker.judge.pairs import BLOCKS, ERROR, SMALLEST
from spook_tracker.tracker.pairs import run_time_levels
from tests.histories.process_noise import NOISE, Process, decided

CHANGES = (0.0, 0.02, 0.05, 0.10)
SPIN = "while True: sum(i * i for i in range(10_000))"
HEAD = (
    "| noise between processes | unchanged, blocked | +2 % found | +5 % found | +10 % found "
    "| processes of either side, unchanged | of +5 % |",
    "|---|---:|---:|---:|---:|---:|---:|",
)
Noise = Callable[[random.Random], Process]


def share(noise: Noise, change: float, count: int, seed: str) -> tuple[float, float]:
    """Of so many changes, the share called slower, and the mean number of processes of either side."""
    told = [decided(noise, change, random.Random(f"{seed} {change} {n}")) for n in range(count)]
    return sum(word == "slower" for word, _ in told) / count, sum(taken for _, taken in told) / count


def row(name: str, noise: Noise, unchanged: int, changed: int) -> str:
    """A line of the table."""
    found = [share(noise, change, changed if change else unchanged, name) for change in CHANGES]
    shares = " | ".join(
        f"{100.0 * part:.{2 if not change else 0}f} %"
        for (part, _), change in zip(found, CHANGES, strict=True)
    )
    return f"| {name} | {shares} | {found[0][1]:.1f} | {found[2][1]:.1f} |"


def measured(tests: Sequence[str], processes: int, busy: int) -> dict[str, list[float]]:
    """Run times of so many fresh processes, one after the other, by series, in s."""
    levels: dict[str, list[float]] = {}
    spinning = [subprocess.Popen([sys.executable, "-c", SPIN]) for _ in range(busy)]
    try:
        with tempfile.TemporaryDirectory() as folder:
            for number in range(processes):
                file = Path(folder) / "run.json"
                command = [sys.executable, "-m", "spook_tracker", "run", *tests, "--sweep", "--no-record"]
                subprocess.run(
                    [*command, "--workers", "1", "--json", str(file)], check=False, capture_output=True
                )
                for key, level in run_time_levels(decode(file.read_bytes(), RunDocument)).items():
                    levels.setdefault(key, []).append(level)
                print(f"process {number + 1} of {processes}", file=sys.stderr)
    finally:
        for process in spinning:
            process.kill()
    return {key: found for key, found in levels.items() if len(found) == processes}


def stretches(levels: Sequence[float]) -> Noise:
    """Noise that is a stretch of real processes, from a place that is drawn, round the end."""

    def begun(draw: random.Random) -> Process:
        place = draw.randrange(len(levels))

        def processes() -> Iterator[float]:
            for step in range(2 * (1 + sum(BLOCKS))):
                yield levels[(place + step) % len(levels)]

        return processes().__next__

    return begun


def real(tests: Sequence[str], processes: int, busy: int, file: Path | None) -> list[str]:
    """The table of real processes; what was measured is read from the file where it is there, else written to it."""
    if file and file.is_file():
        told = json.loads(file.read_text(encoding="utf-8"))
    else:
        told = {"busy": busy, "load": os.getloadavg()[0], "levels": measured(tests, processes, busy)}
        if file:
            file.write_text(json.dumps(told), encoding="utf-8")
    levels = told["levels"]
    count = len(next(iter(levels.values())))
    lines = [
        "\n## Real processes\n",
        f"{count} fresh processes of one build of this engine, one after the other, with {told['busy']} other processes busy",
        f"(load {told['load']:.0f} on {os.cpu_count()} cores); stretches cut from them, sides drawn, 2000 changes of every size. The",
        "spread is the median distance from the median of all.\n",
        HEAD[0].replace("noise between processes", "run time, spread between processes"),
        HEAD[1],
    ]
    for key, found in levels.items():
        spread = median([abs(level / median(found) - 1.0) for level in found])
        name = f"{key.removesuffix(':run-time')}, {100.0 * spread:.1f} %"
        lines.append(row(name, stretches(found), 2000, 2000))
    return lines


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    reader.add_argument("tests", nargs="*", default=("falling_object", "door"))
    reader.add_argument("--processes", type=int, default=60)
    reader.add_argument(
        "--busy", type=int, default=2, help="processes that only compute, beside the measurements"
    )
    reader.add_argument("--unchanged", type=int, default=20_000, help="changes simulated that change nothing")
    reader.add_argument("--changed", type=int, default=2_000, help="and of each size")
    reader.add_argument("--levels", type=Path, help="file of levels: read where it is there, else written")
    reader.add_argument("--page", type=Path, help="write the tables there")
    asked = reader.parse_args()
    lines = [
        "# Changes measured against their base\n",
        "Made by `make pairs`, not by hand. How a change is measured against its base: [in CI](how-to/ci.md); why that bounds the",
        f"share of unchanged changes that are blocked by {100.0 * ERROR:g} %: the head of `tracker/judge/pairs.py`. A change of at most",
        f"{100.0 * SMALLEST:g} % counts as none; blocks of {', '.join(map(str, BLOCKS))} processes of either side.\n",
        "## Simulated\n",
        f"{asked.unchanged} unchanged changes each, {asked.changed} of every size (`tests/histories/process_noise.py`).\n",
        *HEAD,
        *(row(name, noise, asked.unchanged, asked.changed) for name, noise in NOISE.items()),
    ]
    if asked.processes or asked.levels:
        lines += real(asked.tests, asked.processes, asked.busy, asked.levels)
    text = "\n".join(lines) + "\n"
    print(text)
    if asked.page:
        asked.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
