"""Scenes in which bodies come to rest, and how to see which sleep."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker.engine import Box, Material, Method, Plane, RigidBody, Run, Scene, start

GRAVITY = 9.81  # m/s²
TIME_STEP = 1.0 / 60.0  # s
SLOW = 0.02  # m/s: what is slower, sleeps
FALLEN = 240  # steps, within which all that is dropped here lies and sleeps
ROUGH = Material(friction=0.5)
SMOOTH = Material()
FLOOR = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=ROUGH)
SOLVERS = ("direct", "iterative")


def sleepy(solver: str = "direct", **options: Any) -> Method:
    return Method(solver=solver, sleep_speed=SLOW, **options)  # type: ignore[arg-type]


def scene(*bodies: RigidBody, weighs: bool = True, **rest: Any) -> Scene:
    return Scene(bodies=bodies, gravity=(0.0, 0.0, -GRAVITY if weighs else 0.0), **rest)


def box(name: str, x: float, z: float, **options: Any) -> RigidBody:
    options = {"mass": 1.0, "shape": Box((1.0, 1.0, 1.0)), "material": ROUGH, **options}
    return RigidBody(name=name, position=(x, 0.0, z), **options)


def stack(x: float = 0.0, count: int = 3, name: str = "box") -> list[RigidBody]:
    return [box(f"{name} {k}", x, 0.5 + k) for k in range(count)]


def heap(count: int = 30) -> Scene:
    """Boxes dropped in layers of four."""
    rng = np.random.default_rng(5)
    bodies = []
    for k in range(count):
        x, y = 0.55 * (k % 2) + rng.uniform(-0.02, 0.02), 0.55 * (k // 2 % 2) + rng.uniform(-0.02, 0.02)
        bodies.append(
            RigidBody(
                name=f"body {k}",
                mass=1.0 + k % 3,
                shape=Box((0.5, 0.5, 0.5)),
                position=(x, y, 0.4 + 0.55 * (k // 4)),
                material=ROUGH,
            )
        )
    return scene(FLOOR, *bodies)


def asleep(run: Run) -> int:
    return run.result().counters["asleep"]


def held(built: Scene, method: Method, steps: int = 0, **observe: Any) -> Run:
    run = start(built, time_step=TIME_STEP, method=method, observe=observe)
    if steps:
        run.step(steps)
    return run


def wakes_as_a_whole(run: Run, count: int, steps: int) -> bool:
    """`count` bodies sleep, and within so many steps from the start all wake in one."""
    assert asleep(run) == count
    while asleep(run) == count and run.steps < steps:
        run.step()
    return asleep(run) == 0


def same(a: Any, b: Any) -> bool:
    return all(np.array_equal(a[name], b[name]) for name in a)
