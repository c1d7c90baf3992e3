"""Random bodies on joints that fall, walk and roll: does every step settle, in its time? Exit code 1 if not kept.

    python bench/robots.py [--robots 2000] [--first 0 | --this-week] [--workers 1]

A robot is its number, and its kind what that leaves over three: heaps of chains and of clumps on ball joints and hinges with
stops; trunks on two to five legs of two links, driven to places by springs that give way; chassis on three to eight wheels
with drives. Masses are of 1e-3 to 1e3 kg, within a hundred times of each other in a robot, the ground is a plane
or a height field, friction .1 to 1, a third of them rub while they roll. They are solved directly for a second with steps of 1/60 to 1/240 s.

Kept is a robot that completes with its books closed (what is made out of nothing is less than a twentieth of the largest kinetic
energy), and one step of which, begun anew from where it is by 5000 iterations, gives the velocities that the direct solve gives, within
what both leave; where it does not, 500 000 are asked, since iterations that crawl leave little and have far to go. Where both
settle to 1e-9 m/s and differ all the same, Coulomb's law has several answers, as for four wheels on a floor, which share their load
as they like: those are counted apart. Steps that take more than twenty times the median of all of
their size, bodies and contact points, are told at the end.
"""

from __future__ import annotations

import argparse
import datetime
import functools
import itertools
import math
import multiprocessing
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from spook_tracker.engine import (
    Ball,
    Box,
    Capsule,
    ContactCount,
    Cylinder,
    HeightField,
    Hinge,
    JointSpring,
    Limit,
    Material,
    Method,
    Motor,
    Plane,
    RigidBody,
    Scene,
    SimulationFailed,
    Sphere,
    Velocity,
    simulate,
    start,
)
from spook_tracker.engine.joints import Constraint

ROBOTS = 2000
DURATION = 1.0  # s
STEP_LIMIT = 3.0  # s of one step
MOST_OF_MEDIAN = 20.0  # times what steps of a size take
ITERATIONS, MORE = 5000, 500_000
SETTLED, NEAR = (
    1e-9,
    1e-6,
)  # m/s: what is left of a solve that settles, and how far apart its answers are then
KINDS = ("heap", "legged", "wheeled")
GRAVITY = (0.0, 0.0, -9.81)  # m/s²
HILLS = tuple(tuple(0.08 * math.sin(2.0 * i) * math.cos(3.0 * j) for j in range(13)) for i in range(13))
TOP = 0.08  # m, of the hills
UPRIGHT = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # a cylinder's axis along y
Vector = tuple[float, float, float]


@dataclass
class Ending:
    """What became of a robot."""

    number: int
    kind: str
    outcome: str  # of the run: completed, unsettled, diverged, timed_out
    words: str = ""
    residual: float = 0.0  # m/s, of the worst solve
    apart: float = 0.0  # m/s, between a step solved directly and by iterations
    left: float = 0.0  # m/s, by the worse of both
    own: float = 0.0  # m/s, by the direct one
    costs: list[tuple[int, float]] = field(default_factory=list)  # size and s of each step

    @property
    def several_answers(self) -> bool:
        return self.left <= SETTLED and self.apart > NEAR

    @property
    def kept(self) -> bool:
        return self.outcome == "completed" and (self.left <= SETTLED or self.apart <= 100.0 * self.left)


class Masses:
    """Of one robot's bodies, kg: within a hundred times of each other."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.scale = rng, 10.0 ** rng.uniform(-2.0, 2.0)

    def __call__(self) -> float:
        return float(self.scale * 10.0 ** self.rng.uniform(-1.0, 1.0))


def capsule(
    name: str, a: np.ndarray, b: np.ndarray, radius: float, kg: float, material: Material
) -> RigidBody:
    """From a to b, both ends round."""
    way = b - a
    size = float(np.linalg.norm(way))
    z = way / size
    turn = np.array([1.0 + z[2], -z[1], z[0], 0.0]) if z[2] > -0.999999 else np.array([0.0, 1.0, 0.0, 0.0])
    return RigidBody(
        name=name,
        mass=kg,
        shape=Capsule(radius, max(size - 2.0 * radius, 1e-3)),
        position=tuple(0.5 * (a + b)),
        orientation=tuple(turn / np.linalg.norm(turn)),
        material=material,
    )


def heap(
    rng: np.random.Generator, mass: Masses, material: Material
) -> tuple[list[RigidBody], list[Constraint]]:
    """Chains beside and over each other."""
    bodies: list[RigidBody] = []
    joints: list[Constraint] = []
    for k in range(int(rng.integers(1, 6))):
        at = np.array([0.5 * (k % 2), 0.4 * (k // 2 % 2), TOP + 0.3 + 0.5 * (k // 4)])
        before = ""
        for link in range(int(rng.integers(2, 8))):
            way = rng.normal(size=3) * (1.0, 1.0, 0.5)
            end = at + 0.2 * way / np.linalg.norm(way)
            end[2] = max(end[2], TOP + 0.15)
            name = f"{k} {link}"
            bodies.append(capsule(name, at, end, 0.03, mass(), material))
            if before and rng.integers(2):
                joints.append(Ball(name=f"at {name}", between=(before, name), at=tuple(at), compliance=0.0))
            elif before:
                axis = rng.normal(size=3)
                joints.append(
                    Hinge(
                        name=f"at {name}",
                        between=(before, name),
                        at=tuple(at),
                        axis=tuple(axis / np.linalg.norm(axis)),
                        compliance=0.0,
                        limit=Limit(lower=-0.5, upper=0.8) if rng.integers(2) else None,
                    )
                )
            at, before = end, name
    return bodies, joints


def legged(
    rng: np.random.Generator, mass: Masses, material: Material
) -> tuple[list[RigidBody], list[Constraint]]:
    """A trunk on legs of two links, whose hips are driven and whose knees have stops."""
    up = TOP + 0.05
    bodies = [
        RigidBody(
            name="trunk",
            mass=mass(),
            shape=Box((0.6, 0.4, 0.1)),
            position=(0.0, 0.0, up + 0.6),
            velocity=(float(rng.uniform(-2, 2)), float(rng.uniform(-1, 1)), 0.0),
            material=material,
        )
    ]
    joints: list[Constraint] = []
    for k in range(int(rng.integers(2, 6))):
        x, y = float(rng.uniform(-0.28, 0.28)), 0.18 if k % 2 else -0.18
        hip, knee, foot = (np.array([x, y, up + z]) for z in (0.55, 0.3, 0.05))
        bodies += [
            capsule(f"thigh {k}", hip, knee, 0.03, mass(), material),
            capsule(f"shin {k}", knee, foot, 0.03, mass(), material),
        ]
        drive = JointSpring(stiffness=float(10 ** rng.uniform(0, 4)), damping=0.02, max_force=100.0)
        limit = Limit(lower=-1.0, upper=1.0) if rng.integers(2) else None
        joints += [
            Hinge(
                name=f"hip {k}",
                between=("trunk", f"thigh {k}"),
                at=tuple(hip),
                axis=(0, 1, 0),
                compliance=0.0,
                spring=drive,
            ),
            Hinge(
                name=f"knee {k}",
                between=(f"thigh {k}", f"shin {k}"),
                at=tuple(knee),
                axis=(0, 1, 0),
                compliance=0.0,
                limit=limit,
            ),
        ]
    return bodies, joints


def wheeled(
    rng: np.random.Generator, mass: Masses, material: Material
) -> tuple[list[RigidBody], list[Constraint]]:
    """A chassis on driven wheels, cylinders or balls."""
    count = int(rng.integers(3, 9))
    shape = Cylinder(0.14, 0.08) if rng.integers(2) else Sphere(0.14)
    up = TOP + 0.16
    bodies = [
        RigidBody(
            name="chassis",
            mass=mass(),
            shape=Box((1.0, 0.5, 0.12)),
            position=(0.0, 0.0, up + 0.1),
            material=material,
        )
    ]
    joints: list[Constraint] = []
    for k, (x, y) in enumerate(itertools.product(np.linspace(-0.4, 0.4, (count + 1) // 2), (-0.4, 0.4))):
        if k == count:
            break
        at = (float(x), y, up)
        bodies.append(
            RigidBody(
                name=f"wheel {k}",
                mass=mass(),
                shape=shape,
                position=at,
                orientation=UPRIGHT,
                material=material,
            )
        )
        motor = Motor(speed=float(rng.uniform(-10, 10)), max_force=float(10 ** rng.uniform(0, 3)))
        joints.append(
            Hinge(
                name=f"axle {k}",
                between=("chassis", f"wheel {k}"),
                at=at,
                axis=(0, 1, 0),
                compliance=0.0,
                motor=motor if rng.integers(4) else None,
            )
        )
    return bodies, joints


def robot(number: int) -> tuple[Scene, int]:
    """The robot of that number, and its steps per second."""
    rng = np.random.default_rng((number, 2))
    material = Material(
        friction=float(rng.uniform(0.1, 1.0)), rolling_friction=float(rng.choice((0.0, 0.0, 0.01)))
    )
    kind = KINDS[number % len(KINDS)]
    bodies, joints = {"heap": heap, "legged": legged, "wheeled": wheeled}[kind](rng, Masses(rng), material)
    ground = RigidBody(
        name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, TOP), material=material
    )
    if number // len(KINDS) % 2:
        ground = RigidBody(
            name="ground",
            motion="static",
            shape=HeightField((0.5, 0.5), HILLS),
            position=(-3.0, -3.0, 0.0),
            material=material,
        )
    pairs = () if kind == "heap" else tuple(itertools.combinations([body.name for body in bodies], 2))
    scene = Scene(bodies=(ground, *bodies), constraints=tuple(joints), gravity=GRAVITY, no_contact=pairs)
    return scene, int(rng.choice((60, 120, 240)))


def asked_twice(
    scene: Scene, state: dict[str, np.ndarray], rate: int, iterations: int = ITERATIONS
) -> tuple[float, float, float]:
    """How far apart a step is that is solved directly and by iterations, m/s, what the worse of both leaves, and the direct one."""
    velocities, left = [], []
    many = Method(solver="iterative", iterations=iterations, residual_tolerance=1e-13)
    for method in (Method(), many):
        with start(scene, time_step=1.0 / rate, method=method, observe={"v": Velocity()}, state=state) as run:
            run.step()
            velocities.append(run["v"])
            left.append(run.result().residual)
    return float(np.abs(velocities[0] - velocities[1]).max()), max(left), left[0]


def live(number: int) -> Ending:
    """One robot, watched step by step; its books by a run of their own."""
    scene, rate = robot(number)
    ending = Ending(number, KINDS[number % len(KINDS)], "")
    count = len(scene.bodies)
    steps = round(DURATION * rate)
    look = int(np.random.default_rng((number, 3)).integers(steps // 4, steps))
    state: dict[str, np.ndarray] = {}
    try:
        with start(scene, time_step=1.0 / rate, observe={"points": ContactCount()}) as run:
            for k in range(steps):
                if k == look:
                    state = dict(run.state)
                begun = time.thread_time()
                run.step(time_limit=STEP_LIMIT)
                ending.costs.append((0, time.thread_time() - begun))
                ending.costs[-1] = (count + int(run["points"]), ending.costs[-1][1])
            ending.residual = run.result().residual
        result = simulate(scene, time_step=1.0 / rate, steps=steps, observe={}, books=True)
        ending.outcome, ending.words = result.status, result.failure
    except SimulationFailed as failed:
        ending.outcome, ending.words = failed.result.status, str(failed)
        return ending
    ending.apart, ending.left, ending.own = asked_twice(scene, state, rate)
    if not ending.kept:  # iterations crawl: what they leave says little about how far they have to go
        ending.apart, ending.left, ending.own = asked_twice(scene, state, rate, MORE)
    return ending


def live_each(numbers: Sequence[int], workers: int) -> Iterator[Ending]:
    """What becomes of each, in their order; by so many processes."""
    if workers == 1:
        yield from map(live, numbers)
        return
    with multiprocessing.get_context("spawn").Pool(workers) as pool:
        yield from pool.imap(functools.partial(live), numbers)


def slow_steps(endings: Sequence[Ending]) -> list[tuple[float, int, float]]:
    """Steps that took more than so many times the median of their size: how many times, whose, s."""
    sizes: dict[int, list[tuple[float, int]]] = {}
    for ending in endings:
        for size, seconds in ending.costs:
            sizes.setdefault(round(2.0 * math.log2(size)), []).append((seconds, ending.number))
    slow = []
    for costs in sizes.values():
        median = float(np.median([seconds for seconds, _ in costs]))
        slow += [(s / median, number, s) for s, number in costs if s > MOST_OF_MEDIAN * median]
    return sorted(slow, reverse=True)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=ROBOTS, help="how many (default %(default)s)")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--first", type=int, default=0, help="the first one's number (default %(default)s)")
    where.add_argument("--this-week", action="store_true", help="numbers that no other week has")
    parser.add_argument("--workers", type=int, default=1, help="processes (default %(default)s)")
    asked = parser.parse_args(arguments)
    if asked.robots < 1 or asked.workers < 1:
        parser.error("there is no campaign without robots and workers to move them")
    first = datetime.date.today().toordinal() // 7 * asked.robots if asked.this_week else asked.first
    print(f"{asked.robots} robots from number {first}", flush=True)
    endings = []
    for ending in live_each(range(first, first + asked.robots), asked.workers):
        endings.append(ending)
        if not ending.kept:
            print(
                f"  {ending.kind} {ending.number}: {ending.outcome}, residual {ending.residual:.1e} m/s, "
                f"{ending.apart:.1e} m/s from iterations, which leave {ending.left:.0e} where it leaves {ending.own:.0e} {ending.words}",
                flush=True,
            )
    for (kind, outcome), count in sorted(Counter((e.kind, e.outcome) for e in endings).items()):
        print(f"  {kind:<10}{outcome:<12}{count:>5}")
    slow = slow_steps(endings)
    for times, number, seconds in slow[:10]:
        print(
            f"  a step of robot {number} took {1e3 * seconds:.2f} ms, {times:.0f} times the median of its size"
        )
    print(f"  {sum(ending.several_answers for ending in endings)} single steps with several answers")
    residuals = np.array([ending.residual for ending in endings])
    print(
        f"  residuals: {np.median(residuals):.0e} m/s in the median, {np.quantile(residuals, 0.9):.0e} in nine of ten, {residuals.max():.0e} at most"
    )
    completed = sum(ending.outcome == "completed" for ending in endings)
    print(
        f"{completed} of {len(endings)} completed, {sum(e.kept for e in endings)} kept, {len(slow)} slow steps"
    )
    return 0 if all(ending.kept for ending in endings) and not slow else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
