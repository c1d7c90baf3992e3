"""A bouncing ball step by step, written from the equations of one blow and nothing of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from spook_tracker.scalar_tests.impacts import bouncing_ball


def dropped(
    scene: Any, *, time_step: float, duration: float = 0.0, steps: int = 0, observe: Any, **_: Any
) -> Any:
    """A ball on a floor, step by step: a step that would reach the floor turns the ball there, then."""
    ball = scene.bodies[1]
    z, v, h, g = ball.position[2] - bouncing_ball.RADIUS, ball.velocity[2], time_step, bouncing_ball.GRAVITY
    places, energies = [z], [0.0]
    start = 0.5 * v * v + g * z
    for _ in range(steps or round(duration / h)):
        reached = z + h * (v - h * g) <= 0.0
        if reached and -v > g * h:
            until = z / -(v - h * g)
            v = -bouncing_ball.RESTITUTION * (v - (0.5 * h + until) * g) - (0.5 * h - until) * g
            z = (h - until) * v
        elif reached:
            z, v = 0.0, 0.0
        else:
            v -= h * g
            z += h * v
        places.append(z)
        energies.append(0.5 * v * v + g * z - start)
    path = np.zeros((len(places), 3))
    path[:, 2] = np.array(places) + bouncing_ball.RADIUS
    values = {"place": path, "energy": np.array(max(energies))}
    times = {name: h * np.arange(len(places)) for name in observe}

    class Found(dict):  # type: ignore[type-arg]
        sample_times = times

    return Found(values)
