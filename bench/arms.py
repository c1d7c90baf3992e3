"""What does a smooth arm cost to an error, beside MuJoCo's Runge-Kutta in the same run? Exit code 1 where it is dearer,
2 without MuJoCo.

    python bench/arms.py [--rounds 5]

An arm of six hinges and a double pendulum on balls swing for a second. Errors are those of the last link's place beside a
composition of order 8 at 1/8192 s, which takes neither the equations nor the stages of the Runge-Kutta method it judges. Told is
the least processor time of interleaved rounds for the largest time step, or tolerance, that keeps the error. MuJoCo's time is
without the making of its model, that of ours without the compilation of the scene.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from spook_tracker.engine import (
    WORLD,
    Ball,
    Final,
    Hinge,
    Method,
    Position,
    RigidBody,
    Scene,
    SimulationFailed,
    find,
    simulate,
)

TARGETS = (1e-3, 1e-6, 1e-9)  # m
STEPS = (16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024, 2048, 4096)  # a second
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(4, 27))
LONGER = 9
# Of a step or tolerance: error [m], processor time [s] and what of it is no step's.
Way = Callable[[float], tuple[float, float, float]]


def link(name: str, a: Sequence[float], b: Sequence[float], mass: float) -> RigidBody:
    """A rod from a to b."""
    along = np.subtract(b, a)
    length = float(np.linalg.norm(along))
    x, y, z = (along / length).tolist()
    turn = np.array([1.0 + z, -y, x, 0.0])
    across = mass * length**2 / 12.0
    centre = tuple(float(c) for c in np.add(a, b) / 2.0)
    return RigidBody(
        name=name,
        mass=mass,
        inertia=(across, across, 0.02 * across + 1e-4),
        position=centre,
        orientation=tuple((turn / np.linalg.norm(turn)).tolist()),
    )


def arm() -> Scene:
    places = (
        (0, 0, 0),
        (0, 0, 0.3),
        (0.4, 0, 0.4),
        (0.7, 0, 0.5),
        (0.8, 0, 0.5),
        (0.9, 0, 0.45),
        (0.95, 0, 0.4),
    )
    axes = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))
    links = [link(f"l{k}", places[k], places[k + 1], m) for k, m in enumerate((5.0, 4.0, 3.0, 1.5, 1.0, 0.5))]
    joints = [
        Hinge(
            name=f"j{k}",
            between=(f"l{k - 1}" if k else WORLD, f"l{k}"),
            at=places[k],
            axis=axis,
            compliance=0.0,
        )
        for k, axis in enumerate(axes)
    ]
    return Scene(bodies=tuple(links), constraints=tuple(joints), gravity=(0.0, 0.0, -9.81), contacts=False)


def double_pendulum() -> Scene:
    places = ((0, 0, 0), (0.6, 0.2, -0.3), (1.0, 0.7, -0.2))
    links = [link(f"l{k}", places[k], places[k + 1], 1.0) for k in range(2)]
    joints = [
        Ball(name=f"j{k}", between=("l0" if k else WORLD, f"l{k}"), at=places[k], compliance=0.0)
        for k in range(2)
    ]
    return Scene(bodies=tuple(links), constraints=tuple(joints), gravity=(0.0, 0.0, -9.81), contacts=False)


def ways(scene: Scene, last: str) -> dict[str, tuple[Way, Sequence[float]]]:
    seen = {"x": Final(quantity=Position(last))}
    exact = simulate(
        scene, time_step=1 / 8192, steps=8192, method=Method(composition="order8"), observe=seen
    )["x"]

    def ours(
        method: Callable[[float], Method], steps: Callable[[float], int], chosen: float
    ) -> tuple[float, float, float]:
        n = steps(chosen)
        run = simulate(scene, time_step=1.0 / n, steps=n, method=method(chosen), observe=seen)
        try:
            return float(np.linalg.norm(run["x"] - exact)), run.cpu_seconds, 0.0
        except SimulationFailed:
            return math.inf, run.cpu_seconds, 0.0

    def mujoco(chosen: float) -> tuple[float, float, float]:
        n = int(chosen)
        spent, runs = [], []
        for steps in (n, LONGER * n):  # what a step costs, without the making of its model
            begun = time.process_time()
            runs.append(
                find.find("mujoco").simulate(
                    scene, configuration="rk4", time_step=1.0 / n, steps=steps, observe=seen
                )
            )
            spent.append((time.process_time() - begun) / (LONGER - 1))
        return float(np.linalg.norm(runs[0]["x"] - exact)), spent[1], spent[0]

    def composed(order: str) -> Way:
        return partial(ours, lambda _: Method(composition=order), int)  # type: ignore[arg-type]

    found: dict[str, tuple[Way, Sequence[float]]] = {
        o: (composed(o), STEPS) for o in ("order4", "order6", "order8")
    }
    found["runge_kutta"] = partial(ours, lambda _: Method(runge_kutta="order8"), int), STEPS
    found["runge_kutta, tolerance"] = (
        partial(ours, lambda tolerance: Method(runge_kutta="order8", tolerance=tolerance), lambda _: 1),
        TOLERANCES,
    )
    found["mujoco rk4"] = mujoco, STEPS
    return found


def cheapest(scene: Scene, last: str, rounds: int) -> dict[float, dict[str, tuple[float, float, float]]]:
    """By target and way: processor time [s], the step or tolerance it takes, the error it leaves."""
    known, out = ways(scene, last), {}
    for target in TARGETS:
        takes: dict[str, float] = {}
        left: dict[str, float] = {}
        for name, (way, choices) in known.items():
            for chosen in choices:
                error = way(chosen)[0]
                if error <= target:
                    takes[name], left[name] = chosen, error
                    break
        spent: dict[str, list[tuple[float, float]]] = {name: [] for name in takes}
        for _ in range(rounds):
            for name, chosen in takes.items():
                spent[name].append(known[name][0](chosen)[1:])
        least = {
            name: min(run for run, _ in of) - min(other for _, other in of) for name, of in spent.items()
        }
        out[target] = {name: (least[name], takes[name], left[name]) for name in takes}
    return out


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    try:
        find.find("mujoco")
    except find.EngineMissing as missing:
        print(missing, file=sys.stderr)
        return 2
    dearer = 0
    for name, scene, last in (
        ("arm of six hinges", arm(), "l5"),
        ("double pendulum", double_pendulum(), "l1"),
    ):
        for target, found in cheapest(scene, last, rounds).items():
            for way, (seconds, chosen, error) in found.items():
                at = f"tolerance {chosen:.1e}" if chosen < 1.0 else f"1/{chosen:g} s"
                print(
                    f"{name:18s} to {target:g} m  {way:23s} {1e3 * seconds:8.3f} ms, {at} (error {error:.1e} m)",
                    flush=True,
                )
            ours = min(
                (seconds for way, (seconds, _, _) in found.items() if way != "mujoco rk4"), default=math.inf
            )
            dearer += "mujoco rk4" in found and ours > found["mujoco rk4"][0]
    return 1 if dearer else 0


if __name__ == "__main__":
    sys.exit(main())
