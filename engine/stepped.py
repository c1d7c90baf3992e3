"""An adapter in a few lines, for an engine that takes steps and says where its bodies are.

    class Ours(Stepped):
        name = "ours"
        configurations = (Configuration(name="default", reason="as we ship it"),)

        def world(self, task):      # build your own world from task.scene and task.time_step
            return OurWorld(task)   # .step(count), .state() -> (positions, velocities)

    ENGINE = Ours(checkout=__file__)

The loop, the clock, the time limit and the recording are done here; only `step` is timed. Version, commit and
parents come from the repository the adapter lies in, so that the history knows their order.
"""

from __future__ import annotations

import subprocess
import time
from abc import ABC, abstractmethod
from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np

from .build_info import BuildInfo
from .protocol import Capabilities, Configuration, NotSupported, Task
from .recording import Recording
from .result import Array

__all__ = ["Capabilities", "Configuration", "NotSupported", "Stepped", "Task", "World", "of_checkout"]

LOOK = 0.05  # s of stepping after which the clock is looked at again, or sooner
BodyStates = tuple[Array, Array] | tuple[Array, Array, Array, Array]


class World(Protocol):
    """A scene in another engine's own terms."""

    def step(self, count: int) -> None:
        """Take that many steps of `task.time_step`, in the engine's own loop."""
        ...

    def state(self) -> BodyStates:
        """Positions (n, 3) m, velocities (n, 3) m/s; of rigid bodies also quaternions (n, 4), spins (n, 3) rad/s.

        Bodies in the order of the scene, world axes.
        """
        ...


class Stepped(ABC):
    """The part of an adapter that is the same for every engine that can be stepped."""

    name: ClassVar[str]
    capabilities: ClassVar[Capabilities] = Capabilities(rigid_bodies=False)
    configurations: ClassVar[tuple[Configuration, ...]]
    gating: ClassVar[bool] = True

    def __init__(self, checkout: str | Path, version: str = "", compiler: str = "", flags: str = "") -> None:
        self._info = of_checkout(self.name, Path(checkout), version, compiler, flags)

    def build_info(self) -> BuildInfo:
        """Which commit this is."""
        return self._info

    @abstractmethod
    def world(self, task: Task) -> World:
        """The scene of a task, ready to be stepped. May raise NotSupported."""

    def record(self, task: Task) -> Recording:
        """Step the world and keep what the task asks for."""
        began = time.perf_counter()
        world = self.world(task)
        setup = time.perf_counter() - began
        kept, states, done, seconds, cpu, block = [0], [_whole(world.state())], 0, 0.0, 0.0, 1
        out_of_time = False
        while done < task.steps and not out_of_time:
            count = 1 if task.every_step else min(block, task.steps - done)
            worked, began = time.process_time(), time.perf_counter()
            world.step(count)
            took = time.perf_counter() - began
            done, seconds, cpu = done + count, seconds + took, cpu + time.process_time() - worked
            block = 2 * block if took < LOOK else max(1, block // 2)
            if task.every_step or done == task.steps:
                kept.append(done)
                states.append(_whole(world.state()))
            out_of_time = task.time_limit is not None and seconds > task.time_limit and done < task.steps
        parts = [np.stack(part) for part in zip(*states, strict=True)]
        return Recording(
            samples=np.array(kept, dtype=np.int64),
            positions=parts[0],
            velocities=parts[1],
            orientations=parts[2],
            angular_velocities=parts[3],
            steps=done,
            seconds=seconds,
            cpu_seconds=cpu,
            setup_seconds=setup,
            status="timed_out" if out_of_time else "completed",
            failure=f"{task.time_limit:g} s were over after step {done}" if out_of_time else "",
        )


def _whole(state: BodyStates) -> tuple[Array, Array, Array, Array]:
    """A copy of the state: the engine goes on writing where it has it."""
    positions, velocities, *turning = (np.array(part, dtype=np.float64) for part in state)
    orientations, spins = turning or (
        np.tile([1.0, 0.0, 0.0, 0.0], (len(positions), 1)),
        np.zeros_like(positions),
    )
    return positions, velocities, orientations, spins


def of_checkout(name: str, inside: Path, version: str = "", compiler: str = "", flags: str = "") -> BuildInfo:
    """The commit that the repository around `inside` has checked out; without git, only the version is known."""
    folder = inside if inside.is_dir() else inside.parent
    told = _git(folder, "log", "-1", "--format=%H%x00%cI%x00%P")
    git_hash, made, parents = told.split("\0") if told else ("", "", "")
    dirty = bool(_git(folder, "status", "--porcelain", "--untracked-files=no")) if git_hash else None
    described = version or _git(folder, "describe", "--tags", "--always").removeprefix("v") or "unknown"
    return BuildInfo(name, described, git_hash, dirty, made, tuple(parents.split()), compiler, flags)


def _git(folder: Path, *words: str) -> str:
    try:
        command = ["git", "-C", str(folder), *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip("\n") if done.returncode == 0 else ""
