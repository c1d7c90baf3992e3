"""Random heaps from clean starts: does the energy ever rise, does anything crash, what settles? Exit code 1 if not kept.

    python bench/campaign.py [--heaps 2000] [--first 0 | --this-week] [--wide | --bouncy] [--workers 1]

A heap is 20 to 44 balls, boxes and capsules that fall on a plane and on each other for 1.2 s, with friction of 0 to .8,
restitution of 0 or .3, time steps of 1/60 to 1/240 s and each solver in turn; masses of .5 to 2 kg. With `--wide` they
are 8 to 24 bodies of every shape there is, of 1e-6 to 1e9 kg, on a plane, a slab, a mesh or a height field. With
`--bouncy` they are 3 to 18 balls, or bodies of every shape, of .1 to 10 kg, thrown at each other between six walls and at
both orders of blows, with restitution of .5, .8 or 1 and friction of 0 or .4; every other heap is columns that only rise
and fall, so that much touches in flight. A heap is its number: any one can be run again. Kept is a heap whose energy never rises by more than 1e-9 of what it starts with
(of what rebounds, see rise()), in no step over the time limit, and in which no body that is out of reach of all others feels anything but gravity.
Diverged and unsettled runs are outcomes that say so; they are counted apart, and until then the same is asked of them.
One that was timed out is lost. `--this-week` begins where the last week's heaps end, so that no week asks what another
has asked; `--workers` shares the heaps out over processes, and tells them in their order.
"""

from __future__ import annotations

import argparse
import datetime
import functools
import multiprocessing
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from spook_tracker.engine import (
    Box,
    Capsule,
    Compound,
    Cone,
    ConvexHull,
    Cylinder,
    Energy,
    HeightField,
    Material,
    Method,
    Part,
    Plane,
    Position,
    RigidBody,
    Scene,
    Shape,
    SimulationFailed,
    Sphere,
    TriangleMesh,
    Velocity,
    start,
)

HEAPS = 2000  # as many as are asked for at least
DURATION = 1.2  # s
RISE = 1e-9  # of the energy at the start
STEP_LIMIT = 3.0  # s of one step
SHAPES = (Sphere(0.25), Box((0.4, 0.3, 0.5)), Capsule(0.15, 0.4))
SOLVERS = ("direct", "iterative")
GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s²
REACH = 0.5  # m: no body is larger
WIDE_SHAPES: tuple[Shape, ...] = (
    *SHAPES,
    Cylinder(0.2, 0.5),
    Cone(0.3, 0.5),
    ConvexHull.placed(((0, 0, 0), (0.6, 0, 0), (0, 0.5, 0), (0, 0, 0.4), (0.3, 0.3, 0.3))).shape,
    Compound((Part(shape=Box((0.6, 0.1, 0.1))), Part(shape=Sphere(0.15), position=(0.25, 0.0, 0.0)))),
)
HILLS = tuple(tuple(0.1 * np.sin(2.0 * i) * np.cos(3.0 * j) for j in range(9)) for i in range(9))
TENTS = TriangleMesh(
    tuple((float(x), float(y), 0.05 * ((x + y) % 2)) for x in range(9) for y in range(9)),
    tuple(
        face
        for x in range(8)
        for y in range(8)
        for face in (
            (9 * x + y, 9 * x + y + 9, 9 * x + y + 10),
            (9 * x + y, 9 * x + y + 10, 9 * x + y + 1),
        )
    ),
)
BOUNCY_SHAPES: tuple[Shape, ...] = (Sphere(0.25),)
ROOM = 1.5  # m: half of what is between the walls of a bouncy heap
WALL = 1.0  # m, thick
GROUNDS: tuple[tuple[Shape, tuple[float, float, float]], ...] = (
    (Plane(), (0.0, 0.0, -0.1)),
    (Box((9.0, 9.0, 1.0)), (1.0, 1.0, -0.6)),
    (TENTS, (-3.0, -3.0, -0.1)),
    (HeightField((1.0, 1.0), HILLS), (-3.0, -3.0, -0.1)),
)


@dataclass(frozen=True)
class Ending:
    """What became of a heap."""

    number: int
    solver: str
    outcome: str  # of the run: completed, unsettled, diverged, timed_out
    rise: float  # largest in a step, of the energy at the start
    step: int  # where
    words: str = ""
    ghosts: int = 0  # steps of bodies that felt something out of reach

    @property
    def kept(self) -> bool:
        return (
            self.rise <= RISE and self.ghosts == 0 and self.outcome in ("completed", "unsettled", "diverged")
        )


def bouncy_heap(number: int) -> tuple[Scene, int, Method]:
    """The bouncy heap of that number, its steps per second, and how it is solved."""
    rng = np.random.default_rng((number, 1))
    material = Material(
        friction=float(rng.choice((0.0, 0.4))), restitution=float(rng.choice((0.5, 0.8, 1.0, 1.0)))
    )
    columns, all_shapes = bool(number % 2), bool(rng.integers(2))
    shapes = WIDE_SHAPES if all_shapes else BOUNCY_SHAPES
    bodies = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            place, size = np.array((0.0, 0.0, ROOM)), np.full(3, 2.0 * (ROOM + WALL))
            place[axis] += side * (ROOM + 0.5 * WALL)
            size[axis] = WALL
            name, wall = f"wall {2 * axis + int(side > 0.0)}", Box(tuple(size))
            bodies.append(
                RigidBody(name=name, motion="static", shape=wall, position=tuple(place), material=material)
            )
    for k, cell in enumerate(rng.permutation(18)[: int(rng.integers(3, 19))]):
        place = np.array((0.9 * (cell % 3 - 1), 0.9 * (cell // 3 % 2 - 0.5), 0.6 + 0.9 * (cell // 6)))
        velocity, spin, turn = 3.0 * rng.normal(size=3), rng.normal(size=3), rng.normal(size=4)
        if columns:
            velocity[:2], spin, turn = 0.0, np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0))
        else:
            place += rng.uniform(-0.05, 0.05, 3)
        mass, shape = float(10.0 ** rng.uniform(-1.0, 1.0)), shapes[int(rng.integers(len(shapes)))]
        bodies.append(
            RigidBody(
                name=f"body {k}",
                mass=mass,
                shape=shape,
                inertia=(0.01 * mass, 0.04 * mass, 0.04 * mass) if isinstance(shape, Compound) else None,
                position=tuple(place),
                velocity=tuple(velocity),
                angular_velocity=tuple(spin),
                orientation=tuple(turn / np.linalg.norm(turn)),
                material=material,
            )
        )
    method = Method(
        solver=SOLVERS[number % len(SOLVERS)],
        impacts="successive" if rng.integers(2) else "simultaneous",
        iterations=100,
    )
    return Scene(bodies=tuple(bodies), gravity=tuple(GRAVITY)), int(rng.choice((60, 240))), method


def heap(number: int, wide: bool) -> tuple[Scene, int, Method]:
    """The heap of that number, its steps per second, and how it is solved."""
    rng = np.random.default_rng(number)
    material = Material(
        friction=float(rng.choice((0.0, 0.1, 0.4, 0.8))), restitution=float(rng.choice((0.0, 0.3)))
    )
    floor, place = GROUNDS[number // len(SOLVERS) % len(GROUNDS)] if wide else (Plane(), (0.0, 0.0, 0.0))
    bodies = [RigidBody(name="ground", motion="static", shape=floor, position=place, material=material)]
    for k in range(int(rng.integers(8, 25) if wide else rng.integers(20, 45))):
        dx, dy = rng.uniform(-0.05, 0.05, 2)
        turn = rng.normal(size=4)
        mass = float(10.0 ** rng.uniform(-6.0, 9.0) if wide else rng.uniform(0.5, 2.0))
        shape = (WIDE_SHAPES if wide else SHAPES)[int(rng.integers(len(WIDE_SHAPES if wide else SHAPES)))]
        bodies.append(
            RigidBody(
                name=f"body {k}",
                mass=mass,
                shape=shape,
                inertia=(0.01 * mass, 0.04 * mass, 0.04 * mass) if isinstance(shape, Compound) else None,
                position=(0.9 * (k % 3) + dx, 0.9 * (k // 3 % 3) + dy, 0.6 + 0.9 * (k // 9)),
                orientation=tuple(turn / np.linalg.norm(turn)),
                material=material,
            )
        )
    method = Method(solver=SOLVERS[number % len(SOLVERS)], iterations=100)
    return Scene(bodies=tuple(bodies), gravity=tuple(GRAVITY)), int(rng.choice((60, 120, 240))), method


def felt(
    places: np.ndarray, before: np.ndarray, after: np.ndarray, time_step: float, still: int, bouncy: bool
) -> int:
    """How many bodies that nothing could reach in this step did more than fall; the first `still` rows do not move."""
    low, high = (-ROOM, ROOM) if bouncy else (-np.inf, np.inf)
    way = time_step * (np.linalg.norm(before, axis=1) + time_step * 9.81) + REACH
    apart = np.linalg.norm(places[:, None] - places[None, :], axis=2) - way[:, None] - way[None, :]
    np.fill_diagonal(apart, np.inf)
    alone = (apart[:, still:].min(axis=1) > 0.0) & (places[:, 2] > way + 0.1)
    alone &= (places[:, :2] - way[:, None] > low).all(axis=1) & (places[:, :2] + way[:, None] < high).all(
        axis=1
    )
    alone &= places[:, 2] + way < 2.0 * high
    expected = before + time_step * GRAVITY
    moved = np.abs(after - expected).max(axis=1) > 1e-12 * (1.0 + np.abs(before).max(axis=1))
    return int((alone & moved)[still:].sum())


def rise(masses: np.ndarray, before: np.ndarray, after: np.ndarray, change: float, time_step: float) -> float:
    """What a step has won, J, of a `change` of the energy with velocities v from `before` to `after`.

    What rebounds has v + k/2, k its fall in a step, on the parabola that it goes along: of it E + ½ m v·k is kept, and where rows
    hold a part of k they may leave it half of that, ⅛ m k². What changes its speed by no more than k besides falling does not.
    """
    kick = time_step * GRAVITY
    rebounds = masses * (np.linalg.norm(after - before - kick, axis=1) > 1.0001 * np.linalg.norm(kick))
    return (
        change + 0.5 * float(rebounds @ ((after - before) @ kick)) - float(rebounds.sum() * kick @ kick) / 8.0
    )


def fall(number: int, wide: bool = False, bouncy: bool = False) -> Ending:
    """One heap, watched step by step."""
    scene, rate, method = bouncy_heap(number) if bouncy else heap(number, wide)
    still = sum(body.motion == "static" for body in scene.bodies)
    masses = np.array([body.mass or 0.0 for body in scene.bodies])
    elastic = any(body.material.restitution for body in scene.bodies if isinstance(body, RigidBody))
    begun, rises, outcome, words, ghosts = 1.0, [0.0], "", "", 0
    watch = {"energy": Energy(), "x": Position(), "v": Velocity()}
    try:
        with start(scene, time_step=1.0 / rate, method=method, observe=watch) as run:
            begun = energy = float(run["energy"])
            for _ in range(round(DURATION * rate)):
                places, before = run["x"], run["v"]
                run.step(time_limit=STEP_LIMIT)
                change = float(run["energy"]) - energy
                energy += change
                rises.append(rise(masses, before, run["v"], change, 1.0 / rate) if elastic else change)
                ghosts += felt(places, before, run["v"], 1.0 / rate, still, bouncy)
            outcome = run.result().status
    except SimulationFailed as failed:
        outcome, words = failed.result.status, str(failed)
    worst = float("nan") if np.isnan(rises).any() else float(np.max(rises)) / abs(begun)
    return Ending(number, str(method.solver), outcome, worst, int(np.argmax(rises)), words, ghosts)


def fall_each(numbers: Sequence[int], wide: bool, workers: int, bouncy: bool = False) -> Iterator[Ending]:
    """What becomes of each, in their order; by so many processes."""
    if workers == 1:
        yield from (fall(number, wide, bouncy) for number in numbers)
        return
    with multiprocessing.get_context("spawn").Pool(
        workers
    ) as pool:  # nothing of this process is needed there
        yield from pool.imap(functools.partial(fall, wide=wide, bouncy=bouncy), numbers)


def first_of_week(day: datetime.date, heaps: int) -> int:
    """The first number of that day's week, where every week has so many."""
    return day.toordinal() // 7 * heaps


def told(endings: Sequence[Ending]) -> Iterator[str]:
    """The counts, a line each: what became of the heaps of each solver, of all, and how many kept what is asked."""
    for (solver, outcome), count in sorted(Counter((e.solver, e.outcome) for e in endings).items()):
        yield f"  {solver:<10}{outcome:<12}{count:>5}"
    counts = Counter(ending.outcome for ending in endings)
    for outcome in ("completed", "unsettled", "diverged", "timed_out"):
        yield f"  {outcome:<22}{counts.pop(outcome, 0):>5} of {len(endings)}"
    for outcome, count in sorted(counts.items()):
        yield f"  {outcome:<22}{count:>5} of {len(endings)}"
    kept = sum(ending.kept for ending in endings)
    yield f"{kept} of {len(endings)} heaps kept their energy and their time"


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--heaps", type=int, default=HEAPS, help="how many (default %(default)s)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--first", type=int, default=0, help="the first one's number (default %(default)s)")
    where.add_argument("--this-week", action="store_true", help="numbers that no other week has")
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--wide", action="store_true", help="every shape and ground, masses of 1e-6 to 1e9 kg")
    kind.add_argument("--bouncy", action="store_true", help="restitution of .5 to 1, between walls")
    parser.add_argument("--workers", type=int, default=1, help="processes (default %(default)s)")
    asked = parser.parse_args(arguments)
    if asked.heaps < 1 or asked.workers < 1:
        parser.error("there is no campaign without heaps and workers to drop them")
    first = first_of_week(datetime.date.today(), asked.heaps) if asked.this_week else asked.first
    sort = "wide" if asked.wide else "bouncy" if asked.bouncy else "ordinary"
    print(f"{asked.heaps} {sort} heaps from number {first}", flush=True)
    endings = []
    for ending in fall_each(range(first, first + asked.heaps), asked.wide, asked.workers, asked.bouncy):
        endings.append(ending)
        if not ending.kept:
            print(
                f"  heap {ending.number}, {ending.solver}: {ending.outcome}, energy {ending.rise:+.1e} in step {ending.step}"
                f"{f', {ending.ghosts} ghost hits' if ending.ghosts else ''}{': ' if ending.words else ''}{ending.words}",
                flush=True,
            )
    for line in told(endings):
        print(line)
    return 0 if all(ending.kept for ending in endings) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
