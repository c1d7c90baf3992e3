"""Many worlds in one call: steps a second against error, of each engine that has it, and of ours one after another.

    python bench/worlds.py
    python bench/worlds.py --worlds 1 --worlds 16 --scene slope newton mujoco_warp

Copies of one scene, which do not touch each other: MuJoCo XLA maps over them, MuJoCo Warp and Newton have worlds. Ours
runs them one after another, or in so many processes (--processes), each of which compiles the scene once. The error is
that of the farthest of all worlds from a closed form, steps are those of all worlds together, over wall time; models are
built and compiled before. A batch that would take longer than --limit, by what a smaller one took, is left out.

These engines are made for GPUs. What this prints says on which device they ran, and from a CPU no chart is drawn of it.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk

sys.path.insert(0, str(Path(__file__).parent.parent))

from spook_tracker.engine import PLAIN, Final, Position, Scene, prepare
from spook_tracker.engine.find import OURS, EngineMissing, find
from spook_tracker.engine.protocol import NotSupported, Task, refuse_unsupported
from spook_tracker.scalar_tests.stacks import resting_grid
from spook_tracker.scalar_tests.thesis.inclined_plane import slope_grid
from spook_tracker.scalar_tests.thesis.pendulum import scene as pendulum

COUNTS = (1, 16, 256, 4096)
STEPS_A_SECOND = (60, 240, 1000)
BATCHED = ("mjx", "motrixsim", "mujoco_warp", "newton")
DURATION, BOXES = 1.0, 10  # s
ON_CPU = "Engines made for GPUs, on a CPU: no chart is drawn of this."


@dataclass(frozen=True)
class Place:
    """A scene, and where its bodies are at the end by a closed form."""

    scene: Callable[[float], Scene]
    end: Callable[[], np.ndarray]  # (bodies, 3) m


def _swung() -> np.ndarray:
    """From level: the sine of half the angle is k sn(K - w t)."""
    k = math.sqrt(pendulum.MODULUS)
    pace = math.sqrt(pendulum.GRAVITY / pendulum.LENGTH)
    sn = float(ellipj(float(ellipk(k * k)) - pace * DURATION, k * k)[0])
    angle = 2.0 * math.asin(k * sn)
    return pendulum.LENGTH * np.array([[math.sin(angle), 0.0, -math.cos(angle)]])


def _slid() -> np.ndarray:
    built = _slope(0.0)
    way = 0.5 * DURATION * slope_grid.downhill(slope_grid.FRICTION, slope_grid.ASKEW, DURATION)
    return np.array([built.bodies[0].position, np.array(built.bodies[1].position) + way])


def _slope(_: float) -> Scene:
    return slope_grid.scene(slope_grid.STEEP * slope_grid.FRICTION, slope_grid.ASKEW)


def _stack(_: float) -> Scene:
    return resting_grid.stack(*(resting_grid.MASS,) * BOXES)


PLACES = {
    "pendulum": Place(pendulum.scene, _swung),
    "slope": Place(_slope, _slid),
    "stack": Place(_stack, lambda: np.array([body.position for body in _stack(0.0).bodies])),
}


@dataclass(frozen=True)
class Row:
    """One batch: what it came to, or why it did not."""

    scene: str
    engine: str
    per_second: int  # steps of one world
    worlds: int
    speed: float = math.nan  # steps of all worlds a second
    error: float = math.nan  # m
    seconds: float = math.nan
    why: str = ""

    def line(self) -> str:
        told = self.why or f"{self.speed:.3g} | {self.error:.2g}"
        return f"| {self.scene} | {self.engine} | 1/{self.per_second} | {self.worlds} | {told} |"


def task_of(place: Place, time_step: float, configuration: Any) -> Task:
    steps = round(DURATION / time_step)
    return Task(
        scene=place.scene(time_step), time_step=time_step, steps=steps, every_step=False, samples=np.array([0, steps]),
        configuration=configuration, constraint_forces=False, contacts=False, time_limit=None,
    )  # fmt: skip


def _ours(asked: tuple[str, float, int]) -> np.ndarray:
    """So many worlds of ours, one after another."""
    name, time_step, count = asked
    observe = {"end": Final(quantity=Position())}
    ready = prepare(
        PLACES[name].scene(time_step), time_step=time_step, duration=DURATION, method=PLAIN, observe=observe
    )
    return np.array([ready.run()["end"] for _ in range(count)])


def ours(name: str, time_step: float, count: int, processes: int) -> tuple[np.ndarray, float]:
    """Where their bodies came to, and in how long."""
    if processes == 1:
        began = time.perf_counter()
        return _ours((name, time_step, count)), time.perf_counter() - began
    shares = [count // processes + (k < count % processes) for k in range(processes)]
    with ProcessPoolExecutor(processes) as pool:
        list(pool.map(_ours, [(name, time_step, 1)] * processes))  # started, and what it imports is there
        began = time.perf_counter()
        found = list(pool.map(_ours, [(name, time_step, share) for share in shares if share]))
        return np.concatenate(found), time.perf_counter() - began


def batch(name: str, engine: str, setting: Any, per_second: int, count: int, processes: int) -> Row:
    """One batch of one engine; what it cannot be asked is said in its row."""
    place, time_step = PLACES[name], 1.0 / per_second
    label = (
        f"{engine} ({setting.name})"
        if setting
        else f"{engine} ({processes} processes)"
        if processes > 1
        else engine
    )
    row = {"scene": name, "engine": label, "per_second": per_second, "worlds": count}
    try:
        if setting is None:
            positions, seconds = ours(name, time_step, count, processes)
        else:
            adapter, task = find(engine).adapter, task_of(place, time_step, setting)
            refuse_unsupported(adapter, setting, task.scene, {})
            found = adapter.worlds(task, count)
            positions, seconds = found.positions, found.seconds
    except (NotSupported, RuntimeError, MemoryError) as error:
        return Row(**row, why=" ".join(str(error).split())[:120])
    steps = count * round(DURATION * per_second)
    error = float(np.abs(positions - place.end()).max())
    return Row(**row, speed=steps / seconds, error=error, seconds=seconds)


def rows(
    scenes: Sequence[str], engines: Sequence[str], counts: Sequence[int], steps: Sequence[int], limit: float, processes: int
) -> list[Row]:  # fmt: skip
    """All batches; those that would take too long are left out, and say so."""
    found = []
    for name in scenes:
        for engine in engines:
            for setting in (None,) if engine in OURS else find(engine).configurations:
                for per_second in steps:
                    last: Row | None = None
                    for count in sorted(counts):
                        if last is not None and (last.why or last.seconds * count / last.worlds > limit):
                            break
                        last = batch(name, engine, setting, per_second, count, processes)
                        found.append(last)
                        print(last.line(), flush=True)
    return found


def devices(engines: Sequence[str]) -> list[str]:
    """What each engine says of where it runs."""
    return [f"{name}: {find(name).build_info.compiler or 'CPU'}" for name in engines if name not in OURS]


def installed() -> list[str]:
    found = [OURS[0]]
    for name in BATCHED:
        try:
            find(name)
        except EngineMissing as reason:
            print(f"left out: {reason}", flush=True)
            continue
        found.append(name)
    return found


def main(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", action="append", choices=PLACES, help="this one alone; may be repeated")
    parser.add_argument("--worlds", action="append", type=int, help="so many; may be repeated")
    parser.add_argument("--steps", action="append", type=int, help="a second; may be repeated")
    parser.add_argument("--limit", type=float, default=20.0, help="s of one batch")
    parser.add_argument("--processes", type=int, default=1, help="of ours")
    parser.add_argument(
        "engines", nargs="*", help="by default ours and all that have worlds and are installed"
    )
    asked: Any = parser.parse_args(arguments)
    engines = asked.engines or installed()
    if strange := [name for name in engines if name not in (*OURS, *BATCHED)]:
        parser.error(f"{strange[0]!r} has no worlds; there are {', '.join((OURS[0], *BATCHED))}")
    told = devices(engines)
    print(
        "\n".join([*told, "", "| scene | engine (setting) | h [s] | worlds | steps a second | error [m] |"])
    )
    print("|---|---|---|---|---|---|")
    rows(
        asked.scene or list(PLACES), engines, asked.worlds or COUNTS, asked.steps or STEPS_A_SECOND, asked.limit,
        asked.processes,
    )  # fmt: skip
    if not any("cuda" in line or "gpu" in line for line in told):
        print(f"\n{ON_CPU}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
