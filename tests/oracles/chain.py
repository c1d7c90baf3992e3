"""A plain SPOOK for one chain in a plane, whole columns at a time: `tests/oracles/particles.py` where that would take minutes.

Spheres of 1 kg hang on links of 1 m from the origin. Between rows the system is the one of the oracle's docstring;
the velocities are eliminated, and what is left for the impulses of the links is tridiagonal:

    (G M⁻¹ Gᵀ + Sig) lambda = Ups (G v − (4/h) g) − (4/h) Ups ((c₋ + c₊)/4 + theta c₊) − G (v + h g),   theta = tau/h
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg.lapack import dptsv

Array = npt.NDArray[np.float64]
GRAVITY = np.array([0.0, -9.81])  # m/s²
LENGTH = 1.0  # m
RUNAWAY = 1e6  # m or m/s: what is beyond did not hold


@dataclass(frozen=True)
class Swing:
    """What a run leaves; `completed` is False where it ran away, and the rest ends there."""

    completed: bool
    violation: Array  # (samples, links) m
    energy: Array  # (samples,) J above the start
    places: Array  # (samples, spheres, 2) m


def links(places: Array) -> tuple[Array, Array]:
    """Directions (links, 2) and lengths (links,) m."""
    apart = from_before(places)
    length = np.sqrt(apart[:, 0] ** 2 + apart[:, 1] ** 2)
    return apart / length[:, None], length


def from_before(values: Array) -> Array:
    """Of each sphere less that of the sphere before it; the origin is before the first and rests."""
    apart = values.copy()
    apart[1:] -= values[:-1]
    return apart


def along(direction: Array, velocity: Array) -> Array:
    """G v: how fast each link grows, m/s."""
    return np.asarray(np.einsum("ij,ij->i", direction, from_before(velocity)))


def pulled(direction: Array, impulse: Array) -> Array:
    """Gᵀ lambda on the spheres."""
    push = direction * impulse[:, None]
    push[:-1] -= push[1:]
    return push


def swing(
    places: Array,
    time_step: float,
    steps: int,
    *,
    substeps: int = 1,
    corrections: int = 0,
    theta: float = 1.0,
    compliance: float = 1e-13,
    cap: float = 0.3,
) -> Swing:
    """From rest at `places` (spheres, 2); theta is damping over the length of a substep."""
    h, count = time_step / substeps, len(places)
    upsilon = 1.0 / (1.0 + 4.0 * theta)
    softness = 4.0 * compliance * upsilon / h**2
    x, v = np.array(places, dtype=float), np.zeros_like(places, dtype=float)
    violations, energies, path = [], [], []
    diagonal = softness + np.where(np.arange(count) == 0, 1.0, 2.0)

    def curvature(move: Array, direction: Array, length: Array) -> Array:
        return np.minimum(links(x + move)[1] - length - along(direction, move), cap * LENGTH)

    def solved(direction: Array, length: Array, bend: Array | float) -> tuple[Array, Array]:
        """v₊ for a curvature on the right side."""
        beside = -np.einsum("ij,ij->i", direction[1:], direction[:-1])
        kicked = v + h * GRAVITY
        wanted = upsilon * (along(direction, v) - 4.0 / h * (length - LENGTH)) - 4.0 / h * upsilon * bend
        *_, impulse, failed = dptsv(diagonal, beside, wanted - along(direction, kicked))
        assert failed == 0, "the matrix of a chain is positive definite"
        return kicked + pulled(direction, impulse), impulse

    completed = True
    for sample in range(steps + 1):
        for _ in range(substeps if sample else 0):
            direction, length = links(x)
            before = curvature(-h * v, direction, length) if corrections else np.zeros(count)
            after, _ = solved(direction, length, 0.25 * before)
            for _ in range(corrections):
                ahead = curvature(h * after, direction, length)
                after, _ = solved(direction, length, 0.25 * (before + ahead) + theta * ahead)
            v = after
            x = x + h * v
        if not (np.abs(x).max() < RUNAWAY and np.abs(v).max() < RUNAWAY):
            completed = False
            break
        violations.append(links(x)[1] - LENGTH)
        energies.append(0.5 * float(np.sum(v**2)) - float(np.sum(x @ GRAVITY)))
        path.append(x.copy())
    return Swing(completed, np.array(violations), np.array(energies) - energies[0], np.array(path))


def level(count: int) -> Array:
    """A level row from the origin along x."""
    return np.stack([np.arange(1.0, count + 1.0) * LENGTH, np.zeros(count)], axis=1)
