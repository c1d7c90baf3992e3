"""Piles too heavy for a night, as scalar tests: right, and at what error for which run time.

    python bench/piles.py [--largest 10000] [--no-ladder]

Each pile is asked what the nightly's pile of 1000 is asked (`scalar_tests/pile.py`): deepest overlap, load on the
floor, energy that never rises. The ladder runs the pile of 1000 with several numbers of sweeps and substeps; its
error is overlap and missing load. Run times are CPU seconds per step of this process. Exit code 1 if a limit is
missed or a run has no answer.
"""

from __future__ import annotations

import argparse
import sys
import time

from spook_tracker.engine import Method, SimulationFailed, simulate
from spook_tracker.scalar_tests import pile

SIZES = (1000, 10_000)


def kept(count: int) -> bool:
    """Whether a pile of `count` spheres keeps every limit; prints each value beside its limit."""
    print(f"pile of {count} spheres, ten sweeps")
    begin = time.process_time()
    try:
        values = pile.measure(simulate, count)
    except SimulationFailed as failed:
        print(f"  no answer: {failed}")
        return False
    cost = (time.process_time() - begin) / pile.STEPS
    right = True
    for metric in pile.metrics():
        value = values[metric.name]
        passes = metric.passes(value)
        right = right and passes
        verdict = "kept" if passes else "NOT KEPT"
        print(f"  {metric.name:<16}{value:>12.3g} {metric.unit:<3} limit {metric.limit:<8g} {verdict}")
    print(f"  {1e3 * cost:.2f} ms a step", flush=True)
    return right


def ladder(count: int) -> bool:
    """Error against run time; true if more sweeps leave less overlap: the finest at most a tenth of the coarsest."""
    print(f"pile of {count} spheres, error against run time")
    print(f"  {'sweeps':>7}{'substeps':>9}{'ms/step':>9}{'overlap [m]':>13}{'missing load':>14}")
    overlaps = []
    for sweeps, substeps in ((5, 1), (5, 2), (5, 4), (10, 1), (10, 2), (20, 1), (50, 1), (200, 1), (1000, 1)):
        method = Method(solver="iterative", iterations=sweeps, substeps=substeps)
        begin = time.process_time()
        try:
            found = pile.read(simulate, count, method)
        except SimulationFailed as failed:
            print(f"  {sweeps:>7}{substeps:>9}  no answer: {failed}")
            continue
        cost = (time.process_time() - begin) / pile.STEPS
        print(
            f"  {sweeps:>7}{substeps:>9}{1e3 * cost:>9.2f}{found.overlap:>13.2e}{found.missing_load:>14.2e}",
            flush=True,
        )
        if substeps == 1:
            overlaps.append(found.overlap)
    return len(overlaps) > 1 and overlaps[-1] <= 0.1 * overlaps[0]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--largest", type=int, default=max(SIZES), help="largest pile (default %(default)s)")
    parser.add_argument("--no-ladder", action="store_true", help="leave out error against run time")
    given = parser.parse_args()
    claims = {f"the pile of {count} is right": kept(count) for count in SIZES if count <= given.largest}
    if not given.no_ladder:
        claims["more sweeps leave less overlap"] = ladder(min(SIZES))
    for claim, right in claims.items():
        print(f"{'kept' if right else 'NOT KEPT'}: {claim}")
    return 0 if all(claims.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
