"""Random mechanisms: is one that can move ever refused, or one that locks ever told as completed? Exit code 1 if so.

    python bench/mechanisms.py [--count 4500] [--first 0]

A mechanism is its number, and its kind what that leaves over the number of kinds. Those that stand or move have to complete:
lifts of 1 to 20 stages at .1° to 80°, held (the actuator's pull against the closed form) or driven (the platform's speed);
ladders of up to nine rungs that swing as parallelograms, loops of four to six hinges on parallel axes or through one point, and
pairs of folding legs at random angles, whose energy says that they move rightly; trusses with up to twelve bays, with and without a diagonal more than
they need, which stand. Those that lock have to be refused: ladders one of whose rungs is off by 1e-4 to 5e-3 of its place, loops and legs
with an axis out of line by as much.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from spook_tracker.engine import (
    WORLD,
    ConstraintForce,
    Energy,
    Final,
    Hinge,
    KineticEnergy,
    MaximumAbsolute,
    Method,
    Position,
    Result,
    RigidBody,
    Scene,
    Trace,
    Velocity,
    simulate,
)
from spook_tracker.engine.joints import Constraint
from spook_tracker.scalar_tests.mechanisms import scissor_lift

COUNT = 4500
STEP = 1 / 480  # s
DOWN = (0.0, 0.0, -9.81)  # m/s²
ACROSS = (0.0, 1.0, 0.0)
CURVED = Method(corrections=2)
KEPT = 0.03  # of the largest kinetic energy: what it may err by
HELD = 1e-3  # of a lift's pull, at .1°, where the tangent of rounding is a thousandth
STILL = 1e-6  # m, of what stands
Array = np.ndarray


@dataclass(frozen=True)
class Ending:
    """What became of a mechanism, and whether that is right."""

    number: int
    kind: str
    right: bool
    words: str = ""


def bar(name: str, a: Array, b: Array, mass: float) -> RigidBody:
    """From a to b, with its inertia about all axes alike but along it."""
    across = mass * float((b - a) @ (b - a)) / 12.0
    return RigidBody(name=name, mass=mass, inertia=(across,) * 3, position=tuple(0.5 * (a + b)))


def lift_of(rng: np.random.Generator) -> tuple[int, float, float]:
    return (
        int(rng.integers(1, 21)),
        math.radians(10.0 ** rng.uniform(-1.0, 1.9)),
        10.0 ** rng.uniform(0.0, 4.0),
    )


def held_lift(rng: np.random.Generator) -> tuple[bool, Result]:
    stages, angle, load = lift_of(rng)
    observe = {"pull": Final(quantity=ConstraintForce("actuator"))}
    run = simulate(scissor_lift.scene(stages, angle, load), time_step=1 / 60, steps=20, observe=observe)
    exact = scissor_lift.holding_force(stages, angle, load, scissor_lift.ARM)
    return run.completed and abs(float(run["pull"]) / exact - 1.0) < HELD, run


def driven_lift(rng: np.random.Generator) -> tuple[bool, Result]:
    """H = n √(l² − w²), whose speed is n cot θ of the foot's."""
    stages, angle, load = lift_of(rng)
    angle = max(angle, math.radians(2.0))  # flatter ones leap up
    observe = {"v": Final(quantity=Velocity("platform")), "x": Final(quantity=Position("foot"))}
    scene = scissor_lift.scene(stages, angle, load, driven=True)
    run = simulate(scene, time_step=1e-4, steps=20, observe=observe)
    if not run.completed:
        return False, run
    width = float(run["x"][0])
    exact = stages * scissor_lift.SPEED * width / math.sqrt(scissor_lift.BAR**2 - width**2)
    return abs(float(run["v"][2]) / exact - 1.0) < KEPT, run


def moves(scene: Scene, duration: float = 0.4) -> tuple[bool, Result]:
    """With the energy that it was let go with; links that whip round want shorter steps."""
    observe = {"energy": Trace(quantity=Energy()), "motion": Trace(quantity=KineticEnergy())}
    for h in (STEP, STEP / 8):
        run = simulate(scene, time_step=h, duration=duration, method=CURVED, observe=observe)
        most = float(run.partial["motion"].max())
        right = run.completed and most > 0.0 and float(np.ptp(run["energy"])) < KEPT * most
        if right or run.status == "diverged":
            break
    return right, run


def locks(scene: Scene) -> tuple[bool, Result]:
    run = simulate(scene, time_step=STEP, steps=120)
    return "locked by redundant joints" in run.failure or "contradict each other" in run.failure, run


def ladder(rng: np.random.Generator, off: float = 0.0) -> Scene:
    """Two stiles that hang beside each other and are tied by rungs of one length, one of them longer by `off` of it."""
    height, width = rng.uniform(0.5, 3.0), rng.uniform(0.3, 2.0)
    slope, rungs = rng.uniform(0.2, 2.8), int(rng.integers(2, 10))
    way = height * np.array([math.sin(slope), 0.0, -math.cos(slope)])
    beside = np.array([width, 0.0, 0.0])
    bodies, hinges = [], []
    for name, top in (("left", 0.0 * beside), ("right", beside)):
        bodies.append(bar(name, top, top + way, rng.uniform(0.5, 2.0)))
        hinges.append(
            Hinge(name=f"top {name}", between=(WORLD, name), at=tuple(top), axis=ACROSS, compliance=0.0)
        )
    places = np.sort(rng.uniform(0.2, 1.0, rungs))
    for k, place in enumerate(places):
        left = place * way
        right = beside + (place if k or not off else place + off) * way
        bodies.append(bar(f"rung {k}", left, right, rng.uniform(0.2, 1.0)))
        for side, end in (("left", left), ("right", right)):
            hinges.append(
                Hinge(
                    name=f"{side} {k}",
                    between=(side, f"rung {k}"),
                    at=tuple(end),
                    axis=ACROSS,
                    compliance=0.0,
                )
            )
    return Scene(bodies=tuple(bodies), constraints=tuple(hinges), gravity=DOWN, contacts=False)


def loop(rng: np.random.Generator, off: float = 0.0) -> Scene:
    """Four to six hinges in a loop with the world: on parallel axes, or on axes through a point; one out of line by `off` rad."""
    count, spherical = 4 if off else int(rng.integers(4, 7)), bool(rng.integers(2))
    points = rng.uniform(-1.0, 1.0, (count, 3))
    points[0] = 0.0
    axes = np.tile(ACROSS, (count, 1))
    if spherical:
        points = rng.normal(size=(count, 3))
        points *= rng.uniform(0.5, 1.5, (count, 1)) / np.linalg.norm(points, axis=1)[:, None]
        axes = points / np.linalg.norm(points, axis=1)[:, None]
    else:
        points[:, 1] = 0.0
    tilt = np.cross(axes[-1], rng.normal(size=3))
    axes[-1] += off * tilt / np.linalg.norm(tilt)
    links = [bar(f"{k}", a, b, rng.uniform(0.5, 2.0)) for k, (a, b) in enumerate(itertools.pairwise(points))]
    names = [WORLD, *(link.name for link in links), WORLD]
    hinges = tuple(
        Hinge(
            name=f"pin {k}",
            between=(names[k], names[k + 1]),
            at=tuple(points[k]),
            axis=tuple(axes[k]),
            compliance=0.0,
        )
        for k in range(count)
    )
    return Scene(bodies=tuple(links), constraints=hinges, gravity=DOWN, contacts=False)


def legs(rng: np.random.Generator, off: float = 0.0) -> Scene:
    """A plate on two or three pairs of bars that fold in planes of their own, at any angle: it only rises and sinks."""
    slope, long, foot = rng.uniform(0.3, 1.3), rng.uniform(0.3, 1.0), rng.uniform(0.1, 0.5)
    height = long * math.sin(slope)
    plate = RigidBody(name="plate", mass=1.0, inertia=(0.1, 0.1, 0.2), position=(0.0, 0.0, 2.0 * height))
    bodies, hinges = [plate], []
    first = rng.uniform(0.0, 2.0 * math.pi)
    for k in range(int(rng.integers(2, 4))):
        turn = first + k * rng.uniform(1.0, 2.0)
        out, axis = (
            np.array([math.cos(turn), math.sin(turn), 0.0]),
            np.array([-math.sin(turn), math.cos(turn), 0.0]),
        )
        a, top = foot * out, foot * out + (0.0, 0.0, 2.0 * height)
        knee = a + long * math.cos(slope) * out + (0.0, 0.0, height)
        bodies += [bar(f"low {k}", a, knee, 1.0), bar(f"high {k}", knee, top, 1.0)]
        tied = [(WORLD, f"low {k}"), (f"low {k}", f"high {k}"), (f"high {k}", "plate")]
        for part, ends, at in zip(("foot", "knee", "top"), tied, (a, knee, top), strict=True):
            bent = (*axis[:2], off if (k, part) == (0, "knee") else 0.0)
            hinges.append(Hinge(name=f"{part} {k}", between=ends, at=tuple(at), axis=bent, compliance=0.0))
    return Scene(bodies=tuple(bodies), constraints=tuple(hinges), gravity=DOWN, contacts=False)


def folds(rng: np.random.Generator) -> tuple[bool, Result]:
    """For half of the time that a fall to the ground takes: flat legs are another mechanism."""
    scene = legs(rng)
    return moves(scene, math.sqrt(0.5 * scene.bodies[0].position[2] / 9.81))


def truss(rng: np.random.Generator) -> tuple[bool, Result]:
    """Bays of random widths and heights over a hinge and a slide, each with one diagonal or, of half of them, two."""
    bays, crossed = int(rng.integers(1, 13)), bool(rng.integers(2))
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 2.0, bays))])
    low = [np.array([at, 0.0, 0.0]) for at in x]
    high = [np.array([at, 0.0, rng.uniform(0.5, 2.0)]) for at in x]
    ties = [(low[k], high[k]) for k in range(bays + 1)]
    for k in range(bays):
        ties += [(low[k], low[k + 1]), (high[k], high[k + 1])]
        diagonals = [(low[k], high[k + 1]), (high[k], low[k + 1])]
        ties += diagonals if crossed else [diagonals[int(rng.integers(2))]]
    bodies = tuple(bar(f"bar {k}", a, b, rng.uniform(0.5, 2.0)) for k, (a, b) in enumerate(ties))
    hinges: list[Constraint] = []
    for node in (*low, *high):
        here = [k for k, ends in enumerate(ties) if any(end is node for end in ends)]
        held = [WORLD] if node is low[0] or node is low[-1] else []
        names = held + [f"bar {k}" for k in here]
        hinges += [
            Hinge(
                name=f"pin {len(hinges) + k}",
                between=(names[0], name),
                at=tuple(node),
                axis=ACROSS,
                compliance=0.0,
            )
            for k, name in enumerate(names[1:])
        ]
    scene = Scene(bodies=bodies, constraints=tuple(hinges), gravity=DOWN, contacts=False)
    observe = {"x": MaximumAbsolute(quantity=Position(bodies[-1].name), from_start=True)}
    run = simulate(scene, time_step=1 / 60, steps=60, observe=observe)
    return run.completed and float(run["x"].max()) < STILL, run


def off_by(rng: np.random.Generator) -> float:
    return float(10.0 ** rng.uniform(-4.0, -2.3))


KINDS: dict[str, Callable[[np.random.Generator], tuple[bool, Result]]] = {
    "lift, held": held_lift,
    "lift, driven": driven_lift,
    "ladder": lambda rng: moves(ladder(rng)),
    "loop": lambda rng: moves(loop(rng)),
    "legs": folds,
    "truss": truss,
    "ladder that locks": lambda rng: locks(ladder(rng, off_by(rng))),
    "loop that locks": lambda rng: locks(loop(rng, off_by(rng))),
    "legs that lock": lambda rng: locks(legs(rng, off_by(rng))),
}


def judged(number: int) -> Ending:
    """What becomes of the mechanism of that number."""
    kind = tuple(KINDS)[number % len(KINDS)]
    right, run = KINDS[kind](np.random.default_rng(number))
    return Ending(number, kind, right, "" if right else run.failure or "completed, and wrong")


def told(endings: Sequence[Ending]) -> list[str]:
    """A line a kind, and the sum."""
    of, right = Counter(e.kind for e in endings), Counter(e.kind for e in endings if e.right)
    lines = [f"  {kind:<18}{right[kind]:>5} of {of[kind]}" for kind in KINDS if of[kind]]
    return [*lines, f"{sum(right.values())} of {len(endings)} mechanisms are judged rightly"]


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=COUNT, help="how many (default %(default)s)")
    parser.add_argument("--first", type=int, default=0, help="the first one's number (default %(default)s)")
    asked = parser.parse_args(arguments)
    if asked.count < 1:
        parser.error("there is nothing to judge without a mechanism")
    endings = []
    for number in range(asked.first, asked.first + asked.count):
        endings.append(judged(number))
        if not endings[-1].right:
            print(f"  {number}, {endings[-1].kind}: {endings[-1].words}", flush=True)
    print("\n".join(told(endings)))
    return 0 if all(ending.right for ending in endings) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
