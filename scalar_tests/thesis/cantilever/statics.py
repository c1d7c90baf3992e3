"""Where the tip must come to rest, without the engine: the elastica, and the rigid pieces' own statics."""

from __future__ import annotations

import functools
import math

import numpy as np
from scipy.integrate import solve_bvp

from .scene import LENGTH, LOAD, STIFFNESS, deflection


@functools.cache
def elastica_tip(load: float = LOAD) -> float:
    """Tip deflection [m] of the inextensible elastica EI θ'' = −P cos θ, clamped, by collocation to 1e-10."""

    def slopes(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.vstack([y[1], -load / STIFFNESS * np.cos(y[0]), np.sin(y[0])])

    s = np.linspace(0.0, LENGTH, 50)
    guess = np.vstack([load * s * (2.0 * LENGTH - s) / (2.0 * STIFFNESS), s * 0.0, deflection(s, load)])
    solved = solve_bvp(
        slopes, lambda a, b: np.array([a[0], b[1], a[2]]), s, guess, tol=1e-10, max_nodes=20_000
    )
    return float(solved.y[2, -1])


def chain_tip(count: int, load: float = LOAD) -> float:
    """Tip deflection [m] of the same rigid pieces at rest, by statics alone, to rounding.

    Lock i turns by M length/(EI), M the moment at it of the load and of the moment that stands for its lever,
    and slips by V length³/(12 EI) across the piece before it; iterated until the angles stand still.
    """
    piece = LENGTH / count
    lengths = np.full(count, piece)
    lengths[0] = 0.5 * piece
    angles = np.zeros(count)
    for _ in range(50):
        x = z = angle = 0.0
        joints = np.zeros(count)
        for i in range(count):
            ahead = 0.25 * piece if i == 0 else 0.5 * piece
            x, z = x + ahead * math.cos(angle), z + ahead * math.sin(angle)
            joints[i] = x
            slip = load * math.cos(angle) * lengths[i] ** 3 / (12.0 * STIFFNESS)
            x, z = x - slip * math.sin(angle), z + slip * math.cos(angle)
            angle = angles[i]
            ahead = 0.25 * piece if i == 0 else 0.5 * piece
            x, z = x + ahead * math.cos(angle), z + ahead * math.sin(angle)
        moments = load * (x - joints) + 0.5 * piece * load
        turned = np.cumsum(moments * lengths / STIFFNESS)
        if np.abs(turned - angles).max() < 1e-16:
            break
        angles = turned
    return float(z + 0.5 * piece * math.sin(angles[-1]))
