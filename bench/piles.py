"""Piles too heavy for a night, as scalar tests: right, and at what error for which run time.

    python bench/piles.py [--largest 10000] [--no-ladder]

Each pile is asked what the nightly's pile of 1000 is asked (`scalar_tests/stacks/pile.py`): deepest overlap, load on the
floor, energy that never rises. What the floor shall carry is found beside it on springs and dashpots
(`tests/oracles/pile.py`). The ladder of each size runs over sweeps and substeps, that of 1000 over solvers, too; its
errors are overlap and missing load, and each of its rungs must have an answer, a load as of springs, and no rise of the
energy. Many sweeps must leave less overlap than few, and a direct solve next to none. Run times are CPU seconds per
step of this process. Exit code 1 if any of it is missed.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from spook_tracker.engine import Method, SimulationFailed, simulate
from spook_tracker.scalar_tests.stacks import pile
from tests.oracles.pile import missing_loads

SIZES = (1000, 10_000)
STARTS = 2  # on springs
RISE = 1e-9  # of the energy lost in all, in a step
EXACT = 1e-9  # m, what a direct solve may leave
FEWER = 0.1  # × the overlap that the fewest sweeps leave, for the most
Rung = tuple[str, int, int]  # solver, sweeps, substeps
SWEPT: tuple[Rung, ...] = tuple(
    ("iterative", sweeps, substeps)
    for sweeps, substeps in ((5, 1), (5, 2), (5, 4), (10, 1), (10, 4), (20, 1), (50, 1), (200, 1), (1000, 1))
)
RUNGS: dict[int, tuple[Rung, ...]] = {
    1000: (*SWEPT, ("direct", 1, 1), ("direct", 1, 2)),
    10_000: SWEPT,  # directly, many a step of its fall takes more than 5 s: more than a job can bear
}


def expected(count: int) -> tuple[float, float]:
    """The missing load on springs, and its spread: of many spheres the luck is that of the nightly's many, averaged, and
    the mean of a few starts has its own."""
    spread = pile.SPREAD * math.sqrt(pile.COUNT / count)
    if count == pile.COUNT:
        return pile.MISSING_LOAD, spread
    return float(np.mean(missing_loads(count, STARTS))), spread * math.sqrt(1.0 + 1.0 / STARTS)


def kept(count: int, missing_load: float, spread: float) -> bool:
    """Whether a pile of `count` spheres keeps every limit; prints each value beside its limit."""
    print(f"pile of {count} spheres, {pile.SWEEPS.iterations} sweeps")
    begin = time.process_time()
    try:
        values = pile.measure(simulate, count)
    except SimulationFailed as failed:
        print(f"  no answer: {failed}")
        return False
    cost = (time.process_time() - begin) / pile.STEPS
    right = True
    for metric in pile.metrics(missing_load, spread):
        value = values[metric.name]
        passes = metric.passes(value)
        right = right and passes
        verdict = "kept" if passes else "NOT KEPT"
        limit = metric.limit if isinstance(metric.limit, tuple) else (metric.limit,)
        told = " to ".join(f"{bound:g}" for bound in limit if bound is not None)
        print(f"  {metric.name:<16}{value:>12.3g} {metric.unit:<3} limit {told:<24} {verdict}")
    print(f"  {1e3 * cost:.2f} ms a step", flush=True)
    return right


def faults(found: pile.Pile, solver: str, missing_load: float, spread: float) -> list[str]:
    """What is wrong with an answer, a word or two each."""
    wrong = []
    if not abs(found.slowed - missing_load) <= pile.STARTS * spread:
        wrong.append("load")
    if not found.energy_rise <= RISE:
        wrong.append(f"energy rises by {found.energy_rise:.1e}")
    if solver == "direct" and not found.overlap <= EXACT:
        wrong.append("overlap")
    return wrong


def ladder(count: int, missing_load: float, spread: float) -> bool:
    """Error against run time; whether every rung has a right answer and more sweeps leave less overlap."""
    print(f"pile of {count} spheres, error against run time; missing load {missing_load:.2e} on springs")
    print(
        f"  {'solver':<10}{'sweeps':>7}{'substeps':>9}{'ms/step':>9}{'overlap [m]':>13}{'missing load':>14}"
    )
    right, swept = True, []
    for solver, sweeps, substeps in RUNGS[count]:
        by_sweeps = {"iterations": sweeps} if solver == "iterative" else {}
        method = Method(solver=solver, substeps=substeps, **by_sweeps)  # type: ignore[arg-type]
        told = f"  {solver:<10}{sweeps if by_sweeps else '':>7}{substeps:>9}"
        begin = time.process_time()
        try:
            found = pile.read(simulate, count, method)
        except SimulationFailed as failed:
            print(f"{told}  NO ANSWER: {failed}", flush=True)
            right = False
            continue
        cost = (time.process_time() - begin) / pile.STEPS
        wrong = faults(found, solver, missing_load, spread)
        right = right and not wrong
        print(
            f"{told}{1e3 * cost:>9.2f}{found.overlap:>13.2e}{found.slowed:>14.2e}"
            f"{'  unsettled' if found.status == 'unsettled' else ''}{'  NOT KEPT: ' + ', '.join(wrong) if wrong else ''}",
            flush=True,
        )
        if by_sweeps and substeps == 1:
            swept.append(found.overlap)
    return right and len(swept) > 1 and swept[-1] <= FEWER * swept[0]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--largest", type=int, default=max(SIZES), help="largest pile (default %(default)s)")
    parser.add_argument("--no-ladder", action="store_true", help="leave out error against run time")
    given = parser.parse_args()
    claims = {}
    for count in SIZES:
        if count > given.largest:
            continue
        load = expected(count)
        claims[f"the pile of {count} is right"] = kept(count, *load)
        if not given.no_ladder:
            claims[f"every rung of {count} answers, and more sweeps leave less overlap"] = ladder(
                count, *load
            )
    for claim, right in claims.items():
        print(f"{'kept' if right else 'NOT KEPT'}: {claim}")
    return 0 if claims and all(claims.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
