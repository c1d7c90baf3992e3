"""Random heaps from clean starts: does the energy ever rise, does anything crash, what settles? Exit code 1 if not kept.

    python bench/campaign.py [--heaps 200] [--first 0] [--wide]

A heap is 20 to 44 balls, boxes and capsules that fall on a plane and on each other for 1.2 s, with friction of 0 to .8,
restitution of 0 or .3, time steps of 1/60 to 1/240 s and each solver in turn; masses of .5 to 2 kg, or, with `--wide`,
1e-6 to 1e9 kg. A heap is its number: any one can be run again. Kept is a heap whose energy never rises by more than
1e-9 of what it starts with, in no step over the time limit. Diverged and unsettled runs are outcomes that say so; they
are counted apart, and their steps until then must keep their energy, too.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from dataclasses import dataclass

import numpy as np

from spook_tracker.engine import (
    Box,
    Capsule,
    Energy,
    Material,
    Method,
    Plane,
    RigidBody,
    Scene,
    SimulationFailed,
    Sphere,
    start,
)

DURATION = 1.2  # s
RISE = 1e-9  # of the energy at the start
STEP_LIMIT = 3.0  # s of one step
SHAPES = (Sphere(0.25), Box((0.4, 0.3, 0.5)), Capsule(0.15, 0.4))
SOLVERS = ("direct", "iterative", "hybrid")


@dataclass(frozen=True)
class Ending:
    """What became of a heap."""

    number: int
    solver: str
    outcome: str  # of the run: completed, unsettled, diverged, timed_out
    rise: float  # largest in a step, of the energy at the start
    step: int  # where
    words: str = ""

    @property
    def kept(self) -> bool:
        return self.rise <= RISE and self.outcome in ("completed", "unsettled", "diverged")


def heap(number: int, wide: bool) -> tuple[Scene, int, Method]:
    """The heap of that number, its steps per second, and how it is solved."""
    rng = np.random.default_rng(number)
    material = Material(
        friction=float(rng.choice((0.0, 0.1, 0.4, 0.8))), restitution=float(rng.choice((0.0, 0.3)))
    )
    bodies = [
        RigidBody(name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=material)
    ]
    for k in range(int(rng.integers(20, 45))):
        dx, dy = rng.uniform(-0.05, 0.05, 2)
        turn = rng.normal(size=4)
        bodies.append(
            RigidBody(
                name=f"body {k}",
                mass=float(10.0 ** rng.uniform(-6.0, 9.0) if wide else rng.uniform(0.5, 2.0)),
                shape=SHAPES[int(rng.integers(len(SHAPES)))],
                position=(0.9 * (k % 3) + dx, 0.9 * (k // 3 % 3) + dy, 0.6 + 0.9 * (k // 9)),
                orientation=tuple(turn / np.linalg.norm(turn)),
                material=material,
            )
        )
    method = Method(solver=SOLVERS[number % len(SOLVERS)], iterations=100)
    return Scene(bodies=tuple(bodies), gravity=(0.0, 0.0, -9.81)), int(rng.choice((60, 120, 240))), method


def fall(number: int, wide: bool = False) -> Ending:
    """One heap, watched step by step."""
    scene, rate, method = heap(number, wide)
    energies, outcome, words = [], "", ""
    try:
        with start(scene, time_step=1.0 / rate, method=method, observe={"energy": Energy()}) as run:
            energies.append(float(run["energy"]))
            for _ in range(round(DURATION * rate)):
                run.step(time_limit=STEP_LIMIT)
                energies.append(float(run["energy"]))
            outcome = run.result().status
    except SimulationFailed as failed:
        outcome, words = failed.result.status, str(failed)
    rises = np.diff(energies) / abs(energies[0]) if len(energies) > 1 else np.zeros(1)
    return Ending(number, str(method.solver), outcome, float(rises.max()), int(rises.argmax()) + 1, words)


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--heaps", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--wide", action="store_true", help="masses of 1e-6 to 1e9 kg")
    asked = parser.parse_args(arguments)
    endings = []
    for number in range(asked.first, asked.first + asked.heaps):
        ending = fall(number, asked.wide)
        endings.append(ending)
        if not ending.kept:
            print(
                f"  heap {number}, {ending.solver}: {ending.outcome}, energy {ending.rise:+.1e} in step {ending.step}"
                f"{': ' if ending.words else ''}{ending.words}",
                flush=True,
            )
    lost = [ending for ending in endings if not ending.kept]
    for (solver, outcome), count in sorted(Counter((e.solver, e.outcome) for e in endings).items()):
        print(f"  {solver:<10}{outcome:<12}{count:>5}")
    print(f"{len(endings) - len(lost)} of {len(endings)} heaps kept their energy and their time")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
