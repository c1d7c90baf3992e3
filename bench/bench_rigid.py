"""What a locked chain, a door on many hinges and a stack cost per step: proportional to their size, or not.

    python bench/bench_rigid.py [--largest 10000]

Each time is the shortest of many short runs, because other work on the machine only ever adds. The chain is the
peers' scene: n boxes locked in a row to the wall, full inertia, rows, one factorisation and one refinement. The ring is
held at both ends: no tree, so that its blocks are factored, with everything else the same. Mechanisms in a plane stand
beside the same ones by the rows of space, interleaved, and rods on hinges beside a loop written by hand for them alone
(`rigid_loops.cpp`), which must end in the same state.

Limits, with exit code 1: at its longest a chain costs no more per body than GROWTH times its cheapest length, and
MOST ns, on another machine as much more as arithmetic takes there (`bench/floors.py`). The first holds steps and what a run keeps of them to
take them back: 0.8 kB a link are read once they have left the caches, and copied once in sixteen steps. A ring, whose
factor leaves the caches as well, grows by RING at most, what a hinge of a door and a box of a stack costs by GROWTH.
Numbers of a plane are FASTER times as fast as rows of space, and no slower than HAND times the loop by hand: what it
costs to be told at run time how many bodies and joints there are, and of which kind, to keep impulses and to weigh each
step.
"""

from __future__ import annotations

import argparse
import ctypes
import itertools
import math
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from bench_particles import build_loops

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.floors import here
from spook_tracker.engine import WORLD, Box, Hinge, Lock, Method, Plane, Program, RigidBody, Scene, compile
from spook_tracker.scalar_tests.multibody import four_bars

TIME_STEP = 1.0 / 60.0  # s
EDGE = (0.125, 0.1, 0.1)  # m
GROWTH, MOST = 1.2, 350.0  # ×; ns per locked body and step
RING = 2.0  # ×; 1.6 when it was set
FASTER = 2.0  # ×
HAND = 7.0  # × a loop by hand; 4.0 for one rod to 6.0 for forty when it was set
ROUNDING = 1e-9  # m, between two orders of the same sums, in SAME steps: rods on hinges are chaotic later
SAME = 60


def chain(count: int) -> Scene:
    """`count` boxes locked in a row, the first to the wall."""
    boxes = [
        RigidBody(name=f"box {i}", mass=2.5, shape=Box(EDGE), position=((i + 0.5) * EDGE[0], 0.0, 0.0))
        for i in range(count)
    ]
    locks = [
        Lock(
            name=f"lock {i}",
            between=(f"box {i - 1}" if i else WORLD, f"box {i}"),
            at=(i * EDGE[0], 0.0, 0.0),
            compliance=1e-13,
        )
        for i in range(count)
    ]
    return Scene(bodies=tuple(boxes), constraints=tuple(locks), gravity=(0.0, 0.0, -9.81), contacts=False)


def ring(count: int) -> Scene:
    """The same chain locked to a wall at its far end as well."""
    scene = chain(count)
    last = Lock(
        name="last", between=(WORLD, f"box {count - 1}"), at=(count * EDGE[0], 0.0, 0.0), compliance=1e-13
    )
    return replace(scene, constraints=(*scene.constraints, last))


def door(count: int) -> Scene:
    """One box on `count` hinges."""
    panel = RigidBody(name="door", mass=45.0, shape=Box((1.0, 0.06, 2.0)), position=(0.0, 0.0, 0.0))
    hinges = [
        Hinge(
            name=f"hinge {i}",
            between=(WORLD, "door"),
            at=(-0.5, 0.0, 2.0 * (i + 0.5) / count - 1.0),
            compliance=1e-13,
        )
        for i in range(count)
    ]
    return Scene(bodies=(panel,), constraints=tuple(hinges), gravity=(0.0, 0.0, -10.0), contacts=False)


def stack(count: int) -> Scene:
    """`count` boxes on each other on the ground."""
    ground = RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
    boxes = [
        RigidBody(name=f"box {i}", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, i + 0.5))
        for i in range(count)
    ]
    return Scene(bodies=(ground, *boxes), gravity=(0.0, 0.0, -9.81))


def seconds_per_step(program: Program, size: int) -> float:
    """The shortest mean step [s] of many runs, in processor time. Before the first, second, fourth … step a run keeps
    its state, then once in sixteen or more: 64 steps pay no less of it than long runs do."""
    steps = max(64, 3000 // size)
    rounds = 40 if size < 20_000 else 3
    return min(program.run(steps).cpu_seconds / steps for _ in range(rounds))


def rods(count: int, both_ends: bool = False) -> Scene:
    """Rods of half a metre in a row on hinges, along an arc that hangs if both its ends are held."""
    points = [(0.5 * k, -0.3 * math.sin(math.pi * k / count) if both_ends else 0.0) for k in range(count + 1)]
    bodies, hinges = [], []
    for k, ((x, y), (u, v)) in enumerate(itertools.pairwise(points)):
        half, across = 0.5 * math.atan2(v - y, u - x), (0.25 + (v - y) ** 2) / 12.0
        bodies.append(
            RigidBody(
                name=f"rod {k}",
                mass=1.0,
                inertia=(0.1 * across, across, across),
                position=(0.5 * (x + u), 0.5 * (y + v), 0.0),
                orientation=(math.cos(half), 0.0, 0.0, math.sin(half)),
            )
        )
        hinges.append(
            Hinge(name=f"pin {k}", between=(f"rod {k - 1}" if k else WORLD, f"rod {k}"), at=(x, y, 0.0))
        )
    if both_ends:
        hinges.append(Hinge(name="end", between=(WORLD, f"rod {count - 1}"), at=(*points[-1], 0.0)))
    return Scene(bodies=tuple(bodies), constraints=tuple(hinges), gravity=(0.0, -9.81, 0.0), contacts=False)


PLANES = {
    "one rod": rods(1),
    "two rods": rods(2),
    "five rods": rods(5),
    "four rods, both ends held": rods(4, both_ends=True),
    "two four-bars": four_bars.scene(2, TIME_STEP / 4.0),
    "forty four-bars": four_bars.scene(40, TIME_STEP / 4.0),
}


def planes() -> bool:
    """A line per mechanism: ns a step in a plane and by the rows of space. Whether one is not fast enough."""
    print(f"mechanisms in a plane: ns per step, by rows of space, × (at least {FASTER:g})")
    missed = False
    for name, scene in PLANES.items():
        methods = (Method(), Method(force_stages=("solve_block",)))
        programs = [compile(scene, time_step=TIME_STEP / 4.0, method=method) for method in methods]
        steps = 20_000 // len(scene.bodies)
        rounds = [[p.run(steps).cpu_seconds / steps for p in programs] for _ in range(9)]
        plane, space = (1e9 * min(times) for times in zip(*rounds, strict=True))
        late = space < FASTER * plane
        missed = missed or late
        print(
            f"  {name:28s} {plane:8.0f}  {space:8.0f}  {space / plane:6.2f}{'  MISSED' if late else ''}",
            flush=True,
        )
    return missed


def by_hand() -> bool:
    """A line per row of rods: ns a step in a plane and of the loop by hand, interleaved. Whether one is not fast enough,
    or ends elsewhere."""
    print(f"rods on hinges: ns per step, by a loop written for them, × (at most {HAND:g}), same state")
    missed = False
    with tempfile.TemporaryDirectory() as folder:
        loop = build_loops(Path(folder), "rigid_loops.cpp").rods
        loop.restype = ctypes.c_double
        for count in (1, 2, 5, 40):
            program, steps = compile(rods(count), time_step=TIME_STEP / 4.0), 20_000 // count
            ours, hand = math.inf, math.inf
            for _ in range(25):
                begin = time.process_time()
                loop(ctypes.c_long(count), ctypes.c_long(steps))
                hand = min(hand, (time.process_time() - begin) / steps)
                ours = min(ours, program.run(steps).cpu_seconds / steps)
            end = next(reversed(program.run(SAME).final_state.values()))[0]
            same = abs(end - loop(ctypes.c_long(count), ctypes.c_long(SAME))) <= ROUNDING
            late = not same or ours > HAND * hand
            missed = missed or late
            print(
                f"  {count:2d} rods {1e9 * ours:8.0f}  {1e9 * hand:8.0f}  {ours / hand:6.2f}  {'yes' if same else 'NO'}"
                f"{'  MISSED' if late else ''}",
                flush=True,
            )
    return missed


def report(title: str, unit: str, make: Callable[[int], Scene], sizes: tuple[int, ...]) -> list[float]:
    """One line per size: time and block operations per step and element, and growth against the smallest. The times
    [ns]."""
    print(f"{title}: ns per {unit} and step, × the smallest, block operations per {unit}")
    smallest, times = None, []
    for size in sizes:
        program = compile(make(size), time_step=TIME_STEP)
        each = seconds_per_step(program, size) / size * 1e9
        smallest = smallest or each
        times.append(each)
        work = program.run(10).counters["block_operations"] / 10 / size
        print(f"  n = {size:6d}  {each:8.0f}  {each / smallest:6.2f}  {work:8.2f}", flush=True)
    return times


def grown(times: list[float], limit: float) -> bool:
    """Whether the largest of one kind costs too much, per element, beside the cheapest; says it."""
    growth = times[-1] / min(times)
    missed = growth > limit
    print(
        f"  the largest: {growth:.2f} × the cheapest (limit {limit:g}){'  MISSED' if missed else ''}",
        flush=True,
    )
    return missed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--largest", type=int, default=100_000, help="longest chain (default 100000)")
    largest = parser.parse_known_args()[0].largest
    times = report(
        "chain of locked boxes", "body", chain, tuple(10**k for k in range(1, 6) if 10**k <= largest)
    )
    missed = grown(times, GROWTH)
    most = here(MOST, "arithmetic")
    late = times[-1] > most
    missed = missed or late
    print(f"  the longest: {times[-1]:.0f} ns (limit {most:.0f}){'  MISSED' if late else ''}", flush=True)
    rings = tuple(10**k for k in range(1, 5) if 10**k <= largest)
    missed = grown(report("ring of locked boxes", "body", ring, rings), RING) or missed
    missed = grown(report("door", "hinge", door, (1, 2, 10, 50, 200)), GROWTH) or missed
    missed = grown(report("stack of boxes", "box", stack, (1, 5, 20)), GROWTH) or missed
    missed = planes() or missed
    missed = by_hand() or missed
    if missed:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
