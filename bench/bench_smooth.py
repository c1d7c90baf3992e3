"""What smooth rigid scenes cost to a given error, in plain SPOOK steps of the same scene timed side by side.

Each row is a method and a time step whose error is looked at first, against the scene's closed form. A limit in plain
steps is the time on the machine of the other engines' tables over the time of a plain step there (door 0.98 µs, top
0.59 µs, forty four-bars 74 µs, by rows of space, as a plain step was solved then); one in operations is the time itself.
Where MuJoCo is installed, the same scene by its Runge-Kutta stands beside it, with the longest step with which it reaches
the error. On the forty four-bars it reaches it with none up to a thousand steps a second, nor held by equalities: it
takes 250, slower already, with an error a hundred times ours.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from bench.costs import asked, bench, cost, exact, in_units
from spook_tracker.engine import (
    PLAIN,
    Method,
    Position,
    Result,
    Scene,
    Trace,
    compile,
    simulate,
)
from spook_tracker.engine.find import find
from spook_tracker.scalar_tests.case import Simulate
from spook_tracker.scalar_tests.mechanisms import swinging_door
from spook_tracker.scalar_tests.multibody import four_bars
from spook_tracker.scalar_tests.rotation import spinning_top

ORDER6, ORDER8 = Method(composition="order6"), Method(composition="order8")
ROUNDS = 7
PEER = "rk4"  # how MuJoCo is asked

IN_SPACE = Method(force_stages=("solve_block",))


@dataclass(frozen=True)
class Row:
    """A scene to an error: how, and what it may cost, in plain steps."""

    name: str
    scene: Callable[[float], Scene]
    error: Callable[..., float]  # of a time step, a method and an engine
    target: float  # rad or m
    method: Method
    per_second: float
    seconds: float  # simulated
    limit: float  # plain steps
    operations: float
    plain_step: float  # s
    peer_per_second: float = 62.0  # steps of MuJoCo's Runge-Kutta

    @property
    def unit(self) -> str:
        return "m" if self.name.endswith(" m") else "rad"


def bars_error(time_step: float, method: Method, simulate: Simulate = simulate) -> float:
    """Largest error of the angle of forty four-bars in 10 s [rad]."""
    observe = {"side": Trace(quantity=Position("side 0"))}
    built = four_bars.scene(four_bars.MANY, time_step)
    result = simulate(built, time_step=time_step, duration=10.0, method=method, observe=observe)
    found, right = (
        2.0 * result["side"][1:, :2],
        four_bars.exact(four_bars.MANY, result.sample_times["side"][1:]),
    )
    turned = found[:, 0] * right[:, 1] - found[:, 1] * right[:, 0]
    return float(np.abs(np.arctan2(turned, np.sum(found * right, axis=1))).max())


def door_error(time_step: float, method: Method, simulate: Simulate = simulate) -> float:
    return swinging_door.ladder_error(simulate, time_step, method)


def top_error(time_step: float, method: Method, simulate: Simulate = simulate) -> float:
    return spinning_top.ladder_error(simulate, time_step, method)


def many(time_step: float) -> Scene:
    return four_bars.scene(four_bars.MANY, time_step)


ROWS = (
    Row("door to 4e-7 rad", swinging_door.scene, door_error, 4e-7, ORDER8, 9, 10.0, 1500.0, 3.2e6, 1 / 4000),
    Row("top to 1e-5 m", spinning_top.scene, top_error, 1e-5, ORDER6, 26, 20.0, 5100.0, 6.4e6, 1 / 4000),
    Row(
        "top to 1e-10 m",
        spinning_top.scene,
        top_error,
        1e-10,
        ORDER8,
        48,
        20.0,
        34000.0,
        4.3e7,
        1 / 4000,
        1100.0,
    ),
    Row(
        "40 four-bars to 1.8e-5 rad",
        many,
        bars_error,
        1.8e-5,
        ORDER8,
        9.6,
        10.0,
        1340.0,
        2.1e8,
        1 / 1000,
        250.0,
    ),
)


def smooth(row: Row) -> dict[str, float]:
    """Its error, and what a run costs in plain steps and in operations."""
    h, steps, some = 1.0 / row.per_second, round(row.seconds * row.per_second), round(0.2 * row.limit)
    program = compile(row.scene(h), time_step=h, method=row.method)
    plain = compile(row.scene(row.plain_step), time_step=row.plain_step, method=IN_SPACE)
    times = [(program.run(steps).cpu_seconds, plain.run(some).cpu_seconds / some) for _ in range(ROUNDS)]
    whole, one = map(min, zip(*times, strict=True))
    return {
        "error": row.error(h, row.method),
        "plain_steps": whole / one,
        "run": in_units(whole, "operation"),
    }


def beside(row: Row) -> dict[str, float]:
    """MuJoCo's processor time by ours, and its error. NotSupported where it is not installed."""
    engine = find("mujoco")
    h, steps = 1.0 / row.peer_per_second, round(row.seconds * row.peer_per_second)

    def simulated(scene: Scene, **options: Any) -> Result:
        result: Result = engine.simulate(scene, configuration=PEER, **options)
        return result

    def taken(count: int) -> float:
        begun = time.process_time()
        simulated(row.scene(h), time_step=h, steps=count)
        return time.process_time() - begun

    own = 1.0 / row.per_second
    program = compile(row.scene(own), time_step=own, method=row.method)
    times = [
        (taken(steps), taken(1), program.run(round(row.seconds * row.per_second)).cpu_seconds)
        for _ in range(3)
    ]
    whole, setup, ours = map(min, zip(*times, strict=True))
    return {"times_ours": (whole - setup) / ours, "its_error": row.error(h, PLAIN, simulated)}


TESTS = {
    "smooth": bench(
        "Smooth rigid scenes",
        "What does a smooth rigid scene cost to a given error?",
        *(
            asked(
                row.name,
                partial(smooth, row),
                exact("error", "against the closed form", row.target, "what is asked", unit=row.unit),
                cost(
                    "plain_steps",
                    "a run, by a plain step of the scene",
                    row.limit,
                    "the best of other engines",
                ),
                cost("run", "a run", row.operations, "the best of other engines", unit="operation"),
                time_step=1.0 / row.per_second,
            )
            for row in ROWS
        ),
        *(
            asked(
                f"{row.name}, MuJoCo",
                partial(beside, row),
                cost("times_ours", "MuJoCo's run, by ours", 1.0, "ours is first", better="larger"),
                cost("its_error", "of MuJoCo", unit=row.unit),
                time_step=1.0 / row.peer_per_second,
            )
            for row in ROWS
        ),
        beside="plain steps of the same scene, and MuJoCo, timed side by side",
    )
}
