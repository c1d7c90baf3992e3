"""One mass on a spring, the studies of the thesis' chapter 2: scenes and the exact one-step map.

Symbols of the map: h time step, κ stiffness [N/m], ε = 1/κ, θ = τ/h, Υ = 1/(1 + 4θ), Σ = 4 ε Υ/h²,
ρ = 1/(1 + m Σ). A state is (x, v): x [m] from rest length, v [m/s] half a step old.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.observe import Observable
from spook_tracker.engine.theory import one_row_matrix

from ... import case

MASS = 1.0  # kg
TIME_STEP = 1.0 / 60.0  # s
STIFFNESS = 0.014 / TIME_STEP**2  # N/m: (h ω)² = 0.014, 53 steps a period (thesis, Eq 2.19)
START = 2.0  # m, the amplitude of Figs 2.4 to 2.7
STEPS = 300  # 5 s
REST_LENGTH = 64.0  # m: far beyond every amplitude, so that the row stays on its line; a power of two


def spring_scene(stiffness: float = STIFFNESS) -> engine.Scene:
    """The mass on a spring that is a plain force; no gravity."""
    mass = engine.Particle(name="mass", position=(0.0, 0.0, START), mass=MASS)
    spring = engine.Spring(name="spring", between=((0.0, 0.0, 0.0), "mass"), stiffness=stiffness)
    return engine.Scene(bodies=(mass,), forces=(spring,))


def row_scene(stiffness: float, damping: float, *, start: float = START, speed: float = 0.0) -> engine.Scene:
    """The mass on a distance row of compliance 1/κ along z; `damping` in s, `start` [m] from rest length."""
    mass = engine.Particle(name="mass", position=(0.0, 0.0, start), velocity=(0.0, 0.0, speed), mass=MASS)
    row = engine.Distance(
        name="spring",
        between=((0.0, 0.0, -REST_LENGTH), "mass"),
        rest_length=REST_LENGTH,
        compliance=1.0 / stiffness,
        damping=damping,
    )
    return engine.Scene(bodies=(mass,), constraints=(row,))


def traced(
    simulate: case.Simulate, scene: engine.Scene, time_step: float = TIME_STEP, steps: int = STEPS
) -> tuple[Any, Any, Any]:
    """Times [s], positions [m] and velocities [m/s] along z at every sample."""
    observe: dict[str, Observable] = {
        "x": engine.Trace(quantity=engine.Position("mass")),
        "v": engine.Trace(quantity=engine.Velocity("mass")),
    }
    result = simulate(scene, time_step=time_step, steps=steps, observe=observe)
    return result.sample_times["x"], result["x"][:, 2], result["v"][:, 2]


def one_step(stiffness: float, damping: float, time_step: float = TIME_STEP) -> np.ndarray:
    """The map A of (x, v) over one step of SPOOK: (1/m + Σ) λ = −a x − b v, v₊ = v + λ/m, x₊ = x + h v₊."""
    return one_row_matrix(MASS, 1.0 / stiffness, damping, time_step)


def decay(stiffness: float, damping: float, time_step: float = TIME_STEP) -> float:
    """√α per step, α = det A: the thesis' Eq 2.21 with Σ for its ε."""
    return math.sqrt(float(np.linalg.det(one_step(stiffness, damping, time_step))))


def growth(matrix: np.ndarray, steps: int = 1) -> float:
    """Largest |eigenvalue| per step of a 2 × 2 map over `steps` steps, from trace and determinant.

    The determinant decides for a complex pair, so that a double eigenvalue loses no digits.
    """
    half = 0.5 * float(matrix[0, 0] + matrix[1, 1])
    determinant = float(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
    square = half * half - determinant
    largest = math.sqrt(determinant) if square < 0.0 else abs(half) + math.sqrt(square)
    return math.pow(largest, 1.0 / steps)


def run_map(
    simulate: case.Simulate, stiffness: float, damping: float, time_step: float, steps: int
) -> np.ndarray:
    """The map of (x, h v) over `steps` steps, read off two runs: one from x = 1, one from h v = 1."""
    columns = []
    for start, speed in ((1.0, 0.0), (0.0, 1.0 / time_step)):
        scene = row_scene(stiffness, damping, start=start, speed=speed)
        _, x, v = traced(simulate, scene, time_step, steps)
        columns.append((x[-1], time_step * v[-1]))
    return np.array(columns).T


def stiffness_of_period(steps: float, time_step: float = TIME_STEP) -> float:
    """κ [N/m] of an oscillation that takes `steps` time steps."""
    return MASS * (2.0 * math.pi / (steps * time_step)) ** 2
