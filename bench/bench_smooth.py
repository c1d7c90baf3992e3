"""What smooth rigid scenes cost to a given error, in plain SPOOK steps of the same scene timed side by side.

    python bench/bench_smooth.py

Each line is a method and a time step whose error is looked at first, against the scene's closed form. A limit is a
time on the machine of the other engines' tables over the time of a plain step there: door 0.98 µs, top 0.59 µs, forty
four-bars 74 µs, by rows of space, as a plain step was solved then; the time itself has a limit as well, that of the same
tables, carried to this machine by `bench/floors.py`. Where MuJoCo is installed, the same scene by its Runge-Kutta stands below: its error, its processor time, and that
over ours, which has to be above 1. It takes the longest step with which it reaches the error. On the forty four-bars it
reaches it with none up to a thousand steps a second, nor held by equalities: it takes 250, slower already, with an error a
hundred times ours.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))

from bench.floors import here
from spook_tracker.engine import (
    PLAIN,
    EngineError,
    Method,
    Position,
    Program,
    Result,
    Scene,
    Trace,
    compile,
    simulate,
)
from spook_tracker.engine.find import find
from spook_tracker.scalar_tests import spinning_top, swinging_door
from spook_tracker.scalar_tests.case import Simulate
from spook_tracker.scalar_tests.multibody import four_bars

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
    milliseconds: float
    plain_step: float  # s
    peer_per_second: float = 62.0  # steps of MuJoCo's Runge-Kutta


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
    Row("door to 4e-7 rad", swinging_door.scene, door_error, 4e-7, ORDER8, 9, 10.0, 1500.0, 1.5, 1 / 4000),
    Row("top to 1e-5 m", spinning_top.scene, top_error, 1e-5, ORDER6, 26, 20.0, 5100.0, 3.0, 1 / 4000),
    Row(
        "top to 1e-10 m",
        spinning_top.scene,
        top_error,
        1e-10,
        ORDER8,
        48,
        20.0,
        34000.0,
        20.0,
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
        100.0,
        1 / 1000,
        250.0,
    ),
)


def least(program: Program, steps: int) -> float:
    """Processor time of a run [s]."""
    return program.run(steps).cpu_seconds


def beside(row: Row, ours: float) -> tuple[str, bool]:
    """The other engine's line, or why there is none; and whether it is first. `ours` [s]."""
    try:
        engine = find("mujoco")
        h, steps = 1.0 / row.peer_per_second, round(row.seconds * row.peer_per_second)

        def asked(scene: Scene, **options: Any) -> Result:
            result: Result = engine.simulate(scene, configuration=PEER, **options)
            return result

        def cost(count: int) -> float:
            begun = time.process_time()
            asked(row.scene(h), time_step=h, steps=count)
            return time.process_time() - begun

        error = row.error(h, PLAIN, asked)
        times = [(cost(steps), cost(1)) for _ in range(2)]
    except EngineError as why:
        return f"MuJoCo: {why}", False
    whole, setup = (min(column) for column in zip(*times, strict=True))
    taken = whole - setup
    line = f" {error:9.1e} {1e3 * taken:8.2f} {taken / ours:8.1f} × ours"
    return f"MuJoCo {PEER}, 1/{row.peer_per_second:g} s".ljust(28) + line, taken <= ours


def main() -> None:
    missed = False
    print("smooth rigid scenes: error, ms (limit), in plain steps (limit), ms per step and beside the steps")
    for row in ROWS:
        h = 1.0 / row.per_second
        error = row.error(h, row.method)
        steps = round(row.seconds * row.per_second)
        program = compile(row.scene(h), time_step=h, method=row.method)
        plain = compile(row.scene(row.plain_step), time_step=row.plain_step, method=IN_SPACE)
        some = round(0.2 * row.limit)
        times = [
            (least(program, steps), least(program, 2 * steps), least(plain, some) / some)
            for _ in range(ROUNDS)
        ]
        whole, twice, one = (min(column) for column in zip(*times, strict=True))
        most = here(row.milliseconds, "arithmetic")
        within = error <= row.target and whole / one <= row.limit and 1e3 * whole <= most
        line, behind = beside(row, whole)
        missed = missed or not within or behind
        each = (twice - whole) / steps
        print(
            f"  {row.name:28s} {error:9.1e} {1e3 * whole:8.2f} ({most:.2f}) {whole / one:8.0f} ({row.limit:6.0f})"
            f"  {1e3 * each:8.4f} {1e3 * (whole - steps * each):7.3f}  {'' if within else 'MISSED'}",
            flush=True,
        )
        print(f"    {line}{'  MISSED' if behind else ''}", flush=True)
    if missed:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
