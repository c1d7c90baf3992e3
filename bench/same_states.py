"""What random heaps end in, to the bit: state hash and counters, a line each, to be compared between two builds.

    python bench/same_states.py [HEAPS] > after; diff before after

Heaps of `bench/campaign.py`, plain, wide and bouncy, each twice: awake, and with sleep, gone back once in the middle and
on again. Exit code 1 if going back ended in other bits.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace

from campaign import bouncy_heap, heap

from spook_tracker.engine import Method, Scene, SimulationFailed, start

KINDS = ("plain", "wide", "bouncy")
STEPS = 160


def ended(scene: Scene, rate: int, method: Method, back: bool = False) -> str:
    """State hash and counters after STEPS steps, or the failure; `back`: half of them are taken twice."""
    try:
        with start(scene, time_step=1.0 / rate, method=method) as run:
            run.step(STEPS // 2)
            if back:
                snapshot = run.save()
                run.step(STEPS - STEPS // 2)
                run.restore(snapshot)
            run.step(STEPS - STEPS // 2)
            result = run.result()
    except SimulationFailed as failed:
        result = failed.result
    work = " ".join(f"{name}={count}" for name, count in sorted(result.counters.items()))
    return f"{result.status} {result.state_hash} {work}"


def lines(heaps: int) -> Iterator[tuple[str, bool]]:
    """What each heap ended in, and whether that was the same every way."""
    for number in range(heaps):
        for kind in KINDS:
            scene, rate, method = bouncy_heap(number) if kind == "bouncy" else heap(number, kind == "wide")
            one = ended(scene, rate, method)
            sleepy = replace(method, sleep_speed=0.05, sleep_after=0.02)
            on, back = (ended(scene, rate, sleepy, back) for back in (False, True))
            same = on.split()[:2] == back.split()[:2]
            yield f"{kind} {number} {method.solver}: {one} | asleep: {on} | gone back: {back}", same


def main(arguments: list[str]) -> int:
    all_same = True
    for line, same in lines(int(arguments[0]) if arguments else 30):
        print(line, flush=True)
        all_same = all_same and same
    return 0 if all_same else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
