"""What a step costs here, against the build of another checkout: slices in turn, the least of many.

    python bench/against.py OLD_CHECKOUT [--room particles|smooth|heaps] [--most 1.02] [--slices 400]

Both builds answer from a process of their own, on one core, in slices in turn: whatever else the machine does falls on
both alike, and the least of many slices is undisturbed. Which begins changes with each slice. Slices of particles and
smooth scenes take about a millisecond, those of heaps are whole falls (fewer are asked), since their steps cost what
touches. Exit code 1 where this build's steps, or those of a room of heaps in the mean, take more than `--most` times
the other's. OLD_CHECKOUT needs its own .venv (`make install` there).
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent.parent))

import bench.bench_heaps as heaps
import bench.bench_particles as scenes
import bench.bench_smooth as smooth
from spook_tracker.engine import Box, Distance, Method, Particle, Scene, Spring, compile
from spook_tracker.scalar_tests.oscillators import double_pendulum
from spook_tracker.scalar_tests.rotation import rotating_box

SLICE = 1e-3  # s
STEP = 1e-3  # s of simulated time: a chain of 100 links at 1/60 s is beyond what its rows can hold


def ring(links: int) -> Scene:
    """A hanging chain whose last link is held, too: a closed loop through the world."""
    chain = scenes.chain(links)
    last = Distance(name="last", between=(f"{links - 1}", (links + 1.0, 0.0, 0.0)), rest_length=1.0)
    return Scene(bodies=chain.bodies, constraints=(*chain.constraints, last), gravity=scenes.DOWN)


def oscillator() -> Scene:
    """A mass on a spring."""
    mass = Particle(name="mass", mass=1.0, position=(0.1, 0.0, 0.0))
    pull = Spring(name="spring", between=((-1.0, 0.0, 0.0), "mass"), rest_length=1.0, stiffness=40.0)
    return Scene(bodies=(mass,), forces=(pull,))


@dataclass(frozen=True)
class Asked:
    """A program, and how many of its steps are a slice; 0: as many as take about a millisecond."""

    compile: Callable[[], Any]
    steps: int = 0


PARTICLES: dict[str, Callable[[], Any]] = {
    "falling": lambda: compile(
        Scene(bodies=(Particle(name="0", mass=1.0, position=(0, 0, 0)),), gravity=scenes.DOWN), time_step=STEP
    ),
    "planetarium": lambda: compile(scenes.planetarium(), time_step=STEP),
    "oscillator": lambda: compile(oscillator(), time_step=STEP),
    **{
        f"chain of {n}": lambda n=n: compile(scenes.chain(n), time_step=STEP)  # type: ignore[misc]
        for n in (1, 2, 5, 26, 100, 1000)
    },
    **{f"ring of {n}": lambda n=n: compile(ring(n), time_step=STEP) for n in (5, 26)},  # type: ignore[misc]
    **{
        f"26, {name}": lambda method=method: compile(scenes.chain(26), time_step=STEP, method=method)  # type: ignore[misc]
        for name, method in scenes.METHODS.items()
    },
}


ITERATIVE = Method(solver="iterative")
PLAIN = Method()
BOX = Box((0.4, 0.3, 0.5))


def smooth_scenes() -> dict[str, Asked]:
    """The scenes of bench_smooth.py with their methods and plain ones, and two of the catalogue."""
    asked = {}
    for row in smooth.ROWS:
        for title, method, h in (("", row.method, 1.0 / row.per_second), (", plain", PLAIN, row.plain_step)):
            asked[row.name.partition(" to ")[0] + f" 1/{1.0 / h:g}{title}"] = Asked(
                lambda row=row, method=method, h=h: compile(row.scene(h), time_step=h, method=method)  # type: ignore[misc]
            )
    cases = ((double_pendulum, double_pendulum.scene(1e-3)), (rotating_box, rotating_box.scene()))
    for module, scene in cases:
        for title, method in (("plain", PLAIN), ("order 8", smooth.ORDER8)):
            case = f"{module.__name__.rpartition('.')[2]}, {title}"
            asked[case] = Asked(
                lambda scene=scene, method=method: compile(scene, time_step=1e-3, method=method)  # type: ignore[misc]
            )
    return asked


def heap_scenes() -> dict[str, Asked]:
    """Whole falls of spheres and boxes, directly and by iterations, and stacks at rest and knocked."""

    def fall(count: int, shape: Any, seed: int, method: Method) -> Callable[[], Any]:
        return lambda: heaps.prepared(heaps.heap(count, shape, seed), method)

    asked = {}
    for seed in (1, 2, 3):
        asked[f"64 spheres, direct, {seed}"] = Asked(fall(64, heaps.BALL, seed, PLAIN), 120)
        asked[f"24 boxes, direct, {seed}"] = Asked(fall(24, BOX, seed, PLAIN), 120)
        asked[f"64 boxes, iterative, {seed}"] = Asked(fall(64, BOX, seed, ITERATIVE), 120)
    asked["1000 spheres, iterative"] = Asked(fall(1000, heaps.BALL, 1, ITERATIVE), 90)
    for knock in (0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0):
        asked[f"stack of 30, knocked at {knock:g}"] = Asked(
            lambda knock=knock: heaps.prepared(heaps.stack(30, knock), PLAIN),  # type: ignore[misc]
            120,
        )
    return asked


ROOMS: dict[str, Callable[[], dict[str, Asked]]] = {
    "particles": lambda: {name: Asked(build) for name, build in PARTICLES.items()},
    "smooth": smooth_scenes,
    "heaps": heap_scenes,
}


def serve(room: str) -> None:
    """Answer lines `scene, tab, steps` with `seconds, tab, hash of the state`: one side of the comparison."""
    asked = ROOMS[room]()
    programs: dict[str, Any] = {}
    for line in sys.stdin:
        name, _, steps = line.strip().partition("\t")
        if name not in programs:
            programs[name] = asked[name].compile()
        result = programs[name].run(int(steps))
        print(f"{result.cpu_seconds}\t{result.state_hash}", flush=True)


class Side:
    """A build of the engine in a process of its own."""

    def __init__(self, python: Path, room: str) -> None:
        self._process = subprocess.Popen(
            [str(python), __file__, "--serve", "--room", room],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(self, name: str, steps: int) -> tuple[float, str]:
        """Processor seconds of the native loop and the hash of where it ended."""
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(f"{name}\t{steps}\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise SystemExit(f"{self._process.args} ended while it was asked {name}")
        seconds, _, state = answer.strip().partition("\t")
        return float(seconds), state

    def close(self) -> None:
        assert self._process.stdin
        self._process.stdin.close()
        self._process.wait()


def compare(name: str, whole: int, sides: tuple[Side, Side], slices: int) -> tuple[float, float, bool]:
    """ns per step of both sides, and whether they end in the same state to the bit. `whole`: see Asked.steps."""
    steps = whole or 1
    while not whole and steps < 2**30 and min(sides[0].run(name, steps)[0] for _ in range(5)) < SLICE:
        steps *= 2
    least = [math.inf, math.inf]
    states = ["", ""]
    for turn in range(slices):
        for one in (0, 1) if turn % 2 else (1, 0):
            seconds, states[one] = sides[one].run(name, steps)
            least[one] = min(least[one], seconds)
    return least[0] / steps * 1e9, least[1] / steps * 1e9, states[0] == states[1]


def main() -> int:
    given = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    given.add_argument("old", type=Path, nargs="?", help="a checkout with its own .venv")
    given.add_argument("--most", type=float, default=1.02, help="times the other's run time")
    given.add_argument("--room", choices=list(ROOMS), default="particles")
    given.add_argument("--slices", type=int, help="400; of heaps 6")
    given.add_argument("--scene", action="append", help="these alone")
    given.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    asked = given.parse_args()
    if asked.serve:
        serve(asked.room)
        return 0
    python = asked.old / ".venv" / "bin" / "python" if asked.old else Path()
    if not asked.old or not python.exists():
        given.error(f"{asked.old or 'OLD_CHECKOUT'} has no .venv; run make install there")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    old, new = Side(python, asked.room), Side(Path(sys.executable), asked.room)
    room = ROOMS[asked.room]()
    ratios = {}
    print(f"{'scene':<32}{'theirs, ns/step':>16}{'ours':>12}{'ratio':>8}  same bits")
    for name in asked.scene or room:
        whole = room[name].steps
        before, after, same = compare(name, whole, (old, new), asked.slices or (6 if whole else 400))
        ratios[name] = after / before
        print(
            f"{name:<32}{before:>16.2f}{after:>12.2f}{ratios[name]:>8.3f}  {'yes' if same else 'NO'}",
            flush=True,
        )
    old.close()
    new.close()
    mean = math.exp(sum(map(math.log, ratios.values())) / len(ratios))
    print(f"in the mean {mean:.3f}")
    if asked.room == "heaps":  # chaotic: where they end apart one costs more, one less
        return mean > asked.most
    slower = [name for name, ratio in ratios.items() if ratio > asked.most]
    print(
        f"slower by more than {100 * (asked.most - 1):g} %: {', '.join(slower)}"
        if slower
        else "none is slower"
    )
    return bool(slower)


if __name__ == "__main__":
    sys.exit(main())
