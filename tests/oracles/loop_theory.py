"""What redundant rows take from a loop's motion in a linearised step: Bricard's mechanism on its exact path.

A row relaxes to the violation (1 + 2θ)/4 h² b, b its second derivative when bodies go on with their momenta. At a
configuration δ away from the exact one by that much, the combination s of rows that repeats the others (sᵀG = 0) has
the speed u = sᵀ G(q + δ) q̇, of order h². Its force −τ u/ε takes the power τ u²/ε. Nothing here knows the engine: rows
are written from the geometry, the one freedom is integrated with its energy.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from spook_tracker.scalar_tests.multibody.bricard import ACROSS, ALONG, AXES, GRAVITY, MASS, POINTS
from tests.oracles.rigid import Array

CENTRES = 0.5 * (POINTS[:-1] + POINTS[1:])
INERTIAS = [np.diag(np.where(np.abs(end - start) > 0.5, ALONG, ACROSS)) for start, end in pairwise(POINTS)]
ENDS = ((-1, 0), (0, 1), (1, 2), (2, 3), (3, 4), (-1, 4))
WEIGHT = np.tile([0.0, -GRAVITY * MASS, 0.0, 0.0, 0.0, 0.0], 5)
Place = tuple[Array, Array]  # centres (5, 3) [m], turns (5, 3, 3)


def turning(r: Array) -> Array:
    """−r × as a matrix: the velocity that an angular velocity gives a point at r."""
    return np.array([[0.0, r[2], -r[1]], [-r[2], 0.0, r[0]], [r[1], -r[0], 0.0]])


def rows(at: Place) -> tuple[Array, Array]:
    """Violations (30,) and Jacobian (30, 30) of the six hinges, in the axes of their first bodies."""
    x, turn = at
    violation, jacobian = np.zeros(30), np.zeros((30, 30))
    for k, (first, second) in enumerate(ENDS):
        axis, row = np.array(AXES[k]), 5 * k
        arm = turn[second] @ (POINTS[k] - CENTRES[second])
        gap = x[second] + arm
        block = np.zeros((3, 30))
        block[:, 6 * second : 6 * second + 6] = np.hstack([np.eye(3), turning(arm)])
        if first < 0:
            gap = gap - POINTS[k]
        else:
            other = turn[first] @ (POINTS[k] - CENTRES[first])
            gap = gap - x[first] - other
            block[:, 6 * first : 6 * first + 6] = -np.hstack([np.eye(3), turning(other + gap)])
            block, gap = turn[first].T @ block, turn[first].T @ gap
        violation[row : row + 3], jacobian[row : row + 3] = gap, block
        carried = turn[second] @ axis
        for i in (1, 2):
            normal = np.roll(axis, i) if first < 0 else turn[first] @ np.roll(axis, i)
            violation[row + 2 + i] = normal @ carried
            jacobian[row + 2 + i, 6 * second + 3 : 6 * second + 6] = np.cross(carried, normal)
            if first >= 0:
                jacobian[row + 2 + i, 6 * first + 3 : 6 * first + 6] = -np.cross(carried, normal)
    return violation, jacobian


def moved(at: Place, by: Array) -> Place:
    """A straight way on, and turns about fixed axes."""
    step = by.reshape(5, 6)
    return at[0] + step[:, :3], Rotation.from_rotvec(step[:, 3:]).as_matrix() @ at[1]


def least(u: Array, size: Array, v: Array, right: Array) -> Array:
    """The smallest change with that change of the rows, from their singular values but the last."""
    return np.asarray(v[:-1].T @ ((u[:, :-1].T @ right) / size[:-1]))


def motion(at: Place, before: Array) -> tuple[Array, float]:
    """The motion [kg^-1/2] along `before`, one of unit kinetic energy ½, and how fast rows that repeat others part in it,
    over h² (1 + 2θ)/4 and the cube of its pace."""
    violation, jacobian = rows(at)
    u, size, v = np.linalg.svd(jacobian)
    way, against = v[-1], u[:, -1]
    energy, spun = 0.0, np.zeros(30)
    for i in range(5):
        inertia = at[1][i] @ INERTIAS[i] @ at[1][i].T
        energy += MASS * way[6 * i : 6 * i + 3] @ way[6 * i : 6 * i + 3]
        energy += way[6 * i + 3 : 6 * i + 6] @ inertia @ way[6 * i + 3 : 6 * i + 6]
    way = way * math.copysign(1.0 / math.sqrt(energy), way @ before)
    for i in range(5):
        inertia, w = at[1][i] @ INERTIAS[i] @ at[1][i].T, way[6 * i + 3 : 6 * i + 6]
        spun[6 * i + 3 : 6 * i + 6] = -np.linalg.solve(inertia, np.cross(w, inertia @ w))
    e = 1e-4
    bend = (rows(moved(at, e * way))[0] - 2.0 * violation + rows(moved(at, -e * way))[0]) / e**2
    apart = least(u, size, v, bend + jacobian @ spun)
    change = (rows(moved(at, e * apart))[1] - rows(moved(at, -e * apart))[1]) / (2.0 * e)
    return way, float(against @ change @ way)


def fall(seconds: float, loss: float, steps: int) -> Array:
    """P3 [m] after a fall from rest, where u takes `loss` × (its square over h⁴ (1 + 2θ)²/16) W. Midpoint rule."""
    at: Place = (CENTRES.copy(), np.tile(np.eye(3), (5, 1, 1)))
    pace, way, h = 0.0, WEIGHT, seconds / steps
    for _ in range(steps):
        way, parts = motion(at, way)
        middle = pace + 0.5 * h * (WEIGHT @ way - loss * parts**2 * pace**5)
        half, parts = motion(moved(at, 0.5 * h * pace * way), way)
        pace += h * (WEIGHT @ half - loss * parts**2 * middle**5)
        at = moved(at, h * middle * half)
        for _ in range(3):
            violation, jacobian = rows(at)
            at = moved(at, -least(*np.linalg.svd(jacobian), violation))
    return np.asarray(at[0][2] + at[1][2] @ [0.0, 0.0, 0.5])


def off(compliance: float, time_step: float, exact: Array, steps: int = 50) -> float:
    """How far P3 is from `exact` [m] after one second with damping of one time step: half a step ahead, as a symplectic
    step's start has it, and late by what redundant rows take."""
    theta = 1.0
    loss = theta * (1.0 + 2.0 * theta) ** 2 * time_step**5 / (16.0 * compliance)
    return float(np.linalg.norm(fall(1.0 + 0.5 * time_step, loss, steps) - exact))
