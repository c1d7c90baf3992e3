"""What a locked chain, a door on many hinges and a stack cost per step: proportional to their size, or not.

Each time is the shortest of many short runs, because other work on the machine only ever adds, and sizes take turns. The chain is the
peers' scene: n boxes locked in a row to the wall, full inertia, rows, one factorisation and one refinement. The ring is
held at both ends: no tree, so that its blocks are factored, with everything else the same. Mechanisms in a plane stand
beside the same ones by the rows of space, interleaved, and rods on hinges beside a loop written by hand for them alone
(`rigid_loops.cpp`), which must end in the same state.
"""

from __future__ import annotations

import ctypes
import itertools
import math
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from bench.bench_particles import build_loops
from bench.costs import asked, bench, cost, exact, in_units
from bench.floors import floor
from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Box,
    Hinge,
    Lock,
    Method,
    Plane,
    Program,
    RigidBody,
    Scene,
    compile,
)
from spook_tracker.scalar_tests.multibody import four_bars
from spook_tracker.tracker.measure.step_cost import allocated

TIME_STEP = 1.0 / 60.0  # s
EDGE = (0.125, 0.1, 0.1)  # m
SAME = 60  # steps: rods on hinges are chaotic later
ROUNDS, FEW_ROUNDS, LONG = 40, 3, 20_000  # over all sizes, and over those from LONG on


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
    """The mean step [s] of a run, in processor time. Before the first, second, fourth … step a run keeps its state, then
    once in sixteen or more: 64 steps pay no less of it than long runs do."""
    steps = max(64, 3000 // size)
    return program.run(steps).cpu_seconds / steps


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


def in_a_plane(scene: Scene) -> dict[str, float]:
    """A step by the rows of space, by one in the numbers of the plane, interleaved."""
    methods = (Method(), Method(force_stages=("solve_block",)))
    programs = [compile(scene, time_step=TIME_STEP / 4.0, method=method) for method in methods]
    steps = 20_000 // len(scene.bodies)
    rounds = [[p.run(steps).cpu_seconds / steps for p in programs] for _ in range(9)]
    plane, space = map(min, zip(*rounds, strict=True))
    return {"times_faster": space / plane}


def by_hand(count: int) -> dict[str, float]:
    """Rods in a plane by a loop written for them, interleaved, and how far apart both are after SAME steps [m]."""
    with tempfile.TemporaryDirectory() as folder:
        loop = build_loops(Path(folder), "rigid_loops.cpp").rods
        loop.restype = ctypes.c_double
        program, steps = compile(rods(count), time_step=TIME_STEP / 4.0, method=PLAIN), 20_000 // count
        ours, hand = math.inf, math.inf
        for _ in range(25):
            begin = time.process_time()
            loop(ctypes.c_long(count), ctypes.c_long(steps))
            hand = min(hand, (time.process_time() - begin) / steps)
            ours = min(ours, program.run(steps).cpu_seconds / steps)
        end = next(reversed(program.run(SAME).final_state.values()))[0]
        apart = abs(end - loop(ctypes.c_long(count), ctypes.c_long(SAME)))
    return {"times_by_hand": ours / hand, "apart": apart}


def grown(make: Callable[[int], Scene], sizes: tuple[int, ...]) -> dict[str, float]:
    """A step per element: the largest by the cheapest size, and by that and what the memory takes of this machine."""
    programs = {}
    for size in sizes:
        scene = make(size)
        before = allocated() or 0.0
        programs[size] = compile(scene, time_step=TIME_STEP)
        work = programs[size].run(10).counters["block_operations"]
        held = ((allocated() or 0.0) - before) / size
    each = dict.fromkeys(sizes, math.inf)
    for attempt in range(ROUNDS):
        for size, program in programs.items():
            if size < LONG or attempt < FEW_ROUNDS:
                each[size] = min(each[size], seconds_per_step(program, size) / size)
    cheapest, largest = min(each.values()), each[sizes[-1]]
    return {
        "times_floor": largest / (cheapest + held * floor("byte")),
        "times_cheapest": largest / cheapest,
        "element": in_units(largest, "operation"),
        "held": held,
        "work": work / 10 / sizes[-1],
    }


ELEMENT = cost("element", "an element and step of the largest", unit="operation")
FLOOR = partial(
    cost,
    "times_floor",
    "an element and step of the largest, by the cheapest size and one way of all it holds through memory",
)
CHEAPEST = partial(cost, "times_cheapest", "an element and step of the largest, by the cheapest size")
# What leaves the caches reads and writes once a step what it holds of an element, a locked box 3.1 kB.
LARGE = (FLOOR(1.2, "proportional"), CHEAPEST())
SMALL = (FLOOR(), CHEAPEST(1.2, "proportional"))
FOLLOWED = (
    cost("held", "allocated for an element of the largest", unit="B"),
    cost("work", "block operations an element and step of the largest"),
)
TESTS = {
    "rigid": bench(
        "Rigid bodies on joints",
        "What does a step of joints cost, and how does it grow with their number?",
        asked(
            "chain of 100000 locks",
            partial(grown, chain, (10, 100, 1000, 10_000, 100_000)),
            cost("element", "a link and step of the longest", 748.0, "what the peers take", unit="operation"),
            *LARGE,
            *FOLLOWED,
            time_step=TIME_STEP,
        ),
        *(
            asked(title, partial(grown, make, sizes), ELEMENT, *growth, *FOLLOWED, time_step=TIME_STEP)
            for title, make, sizes, growth in (
                ("ring of 10000 locks", ring, (10, 100, 1000, 10_000), LARGE),
                ("door on 200 hinges", door, (1, 2, 10, 50, 200), SMALL),
                ("stack of 20", stack, (1, 5, 20), SMALL),
            )
        ),
        *(
            asked(
                title,
                partial(in_a_plane, scene),
                cost("times_faster", "a step by rows of space, by one in the plane", 2.0, better="larger"),
                time_step=TIME_STEP / 4.0,
            )
            for title, scene in PLANES.items()
        ),
        *(
            asked(
                f"rods, {count}",
                partial(by_hand, count),
                # To be told at run time how many bodies and joints there are, and of which kind, to keep impulses and
                # to weigh each step.
                cost("times_by_hand", "a step, by a loop written for rods", 7.0, "what being general costs"),
                exact("apart", "how far from the loop's end we end", 1e-9, "rounding", unit="m"),
                time_step=TIME_STEP / 4.0,
            )
            for count in (1, 2, 5, 40)
        ),
        beside="smaller sizes, the rows of space, a loop by hand, arithmetic and memory of this machine",
    )
}
