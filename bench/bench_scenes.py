"""What each scene adds to a night, of processor time, and to which part of it.

    make bench-scenes                                   all of them, a line each
    tracker explain pendulum --cost                     what a step of one takes

Every scene is asked as a night asks it, run times included, one after the other in this process.
"""

from __future__ import annotations

import statistics
import time
from collections import Counter

from bench.costs import asked, bench, cost, in_units
from spook_tracker.scalar_tests.case import ScalarTest
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.measure.questions import Questions
from spook_tracker.tracker.measure.request import Progress, Request
from spook_tracker.tracker.measure.run import run

PARTS = ("values", "figures", "replay", "stability", "ladders", "run times")
ADDS = 3.2e9  # operations: a second and a half where it was set


def parts_of(test: ScalarTest) -> list[str]:
    """Of which part each piece of work of a night is, in order."""
    rungs = sum(len(ladder.configurations) for ladder in test.ladders)
    counts = (len(test.measurements), len(test.figures), 1, len(test.stability), rungs, 1)
    return [part for part, count in zip(PARTS, counts, strict=True) for _ in range(count)]


def spent(source: Questions, name: str) -> Counter[str]:
    """Seconds of the processor for a scene, by part."""
    pieces, found, begun = iter(parts_of(source.tests()[name])), Counter[str](), time.process_time()

    def watch(progress: Progress) -> None:
        nonlocal begun
        now = time.process_time()
        if progress.done:  # told once before the first
            found[next(pieces)] += now - begun
        begun = now

    run(source, Request(tests=(name,), figures=True, sweep=True, stability=True, workers=0), watch)
    return found


def by_scene() -> dict[str, float]:
    """A line a scene on the terminal, the dearest first; in operations, each scene, the median one and all."""
    source = Questions()
    costs = {name: spent(source, name) for name in source.tests()}
    print(f"{'scene':<28}{'s':>8}" + "".join(f"{part:>11}" for part in PARTS))
    for name, found in sorted(costs.items(), key=lambda one: -one[1].total()):
        print(
            f"{name:<28}{found.total():>8.2f}" + "".join(f"{found[part]:>11.2f}" for part in PARTS),
            flush=True,
        )
    each = {name: in_units(found.total(), "operation") for name, found in costs.items()}
    return each | {"median": statistics.median(each.values()), "all": sum(each.values())}


TESTS = {
    "scenes": bench(
        "Scenes of a night",
        "What does a scene add to a night?",
        asked(
            "a night",
            by_scene,
            cost("median", "the scene in the middle", ADDS, "what a new one may add", unit="operation"),
            cost("all", "all scenes one after the other", 1.9e11, "ninety seconds", unit="operation"),
            *(cost(name, "this scene", unit="operation") for name in CATALOGUE),
        ),
        beside="arithmetic of this machine",
    )
}
