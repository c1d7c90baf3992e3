"""What a step of particles costs here, against the build of another checkout: slices in turn, the least of many.

    python bench/against.py OLD_CHECKOUT [--most 1.02] [--slices 400]

Both builds answer from a process of their own, on one core, in slices of about a millisecond in turn: whatever else the
machine does falls on both alike, and the least of many slices is undisturbed. Which begins changes with each slice. Exit code 1 where this build's step takes more than `--most` times the other's,
or ends in another state. OLD_CHECKOUT needs its own .venv (`make install` there).
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import bench_particles as scenes

from spook_tracker.engine import Distance, Particle, Scene, Spring, compile

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


ASKED: dict[str, Callable[[], Any]] = {
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


def serve() -> None:
    """Answer lines `scene, tab, steps` with `seconds, tab, hash of the state`: one side of the comparison."""
    programs: dict[str, Any] = {}
    for line in sys.stdin:
        name, _, steps = line.strip().partition("\t")
        if name not in programs:
            programs[name] = ASKED[name]()
        result = programs[name].run(int(steps))
        print(f"{result.seconds}\t{result.state_hash}", flush=True)


class Side:
    """A build of the engine in a process of its own."""

    def __init__(self, python: Path) -> None:
        self._process = subprocess.Popen(
            [str(python), __file__, "--serve"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def run(self, name: str, steps: int) -> tuple[float, str]:
        """Seconds of the native loop and the hash of where it ended."""
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


def compare(name: str, sides: tuple[Side, Side], slices: int) -> tuple[float, float, bool]:
    """ns per step of both sides, and whether they end in the same state to the bit."""
    steps = 1
    while steps < 2**30 and min(sides[0].run(name, steps)[0] for _ in range(5)) < SLICE:
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
    given.add_argument("--slices", type=int, default=400)
    given.add_argument("--scene", action="append", help="these alone")
    given.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    asked = given.parse_args()
    if asked.serve:
        serve()
        return 0
    python = asked.old / ".venv" / "bin" / "python" if asked.old else Path()
    if not asked.old or not python.exists():
        given.error(f"{asked.old or 'OLD_CHECKOUT'} has no .venv; run make install there")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    old, new = Side(python), Side(Path(sys.executable))
    slower = []
    print(f"{'scene':<32}{'theirs, ns/step':>16}{'ours':>12}{'ratio':>8}  same bits")
    for name in asked.scene or ASKED:
        before, after, same = compare(name, (old, new), asked.slices)
        print(
            f"{name:<32}{before:>16.2f}{after:>12.2f}{after / before:>8.3f}  {'yes' if same else 'NO'}",
            flush=True,
        )
        slower += [name] if after > asked.most * before else []
    old.close()
    new.close()
    print(
        f"slower by more than {100 * (asked.most - 1):g} %: {', '.join(slower)}"
        if slower
        else "none is slower"
    )
    return bool(slower)


if __name__ == "__main__":
    sys.exit(main())
