"""The pile of spheres by another law of contact: springs, dashpots and dragged friction in small steps, in NumPy.

Nothing of the engine is in it but the scene. Contacts are soft (weights sink in by millimetres) and blows lose nearly
all they have; friction drags at `DRAG` times the speed up to Coulomb's bound. Other stiffnesses give the same loads
within what other starts do (`tests/test_scalar_tests_pile_limits.py`), which is what makes them a reference.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from spook_tracker.scalar_tests import pile

STEP = 1e-3  # s
STIFFNESS = 2e4  # N/m
DRAG = 100.0  # N s/m
DAMPED = 0.9  # of the critical damping
SKIN = 0.1  # m: pairs nearer than this beyond touching are looked at until a body has gone half of it
ASIDE = 0.005  # m: how far another start is from the pile's own, and none overlaps yet


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(n, 3) products of rows; numpy.cross takes three times as long for a few hundred of them."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=1)


def _dragged(speed: np.ndarray, load: np.ndarray, drag: float) -> np.ndarray:
    """Friction [N] against the speed [m/s] of points that are pushed together by the load [N]."""
    size = np.linalg.norm(speed, axis=1) + 1e-30
    force: np.ndarray = -(np.minimum(pile.FRICTION * load, drag * size) / size)[:, None] * speed
    return force


def floor_loads(
    count: int, seed: int, step: float = STEP, stiffness: float = STIFFNESS, drag: float = DRAG
) -> np.ndarray:
    """(seconds,) mean upward force of the floor in each second over the weight; seed 0 is the pile's own start."""
    seconds = round(pile.STEPS * pile.TIME_STEP)
    radius, mass, gravity = pile.RADIUS, pile.MASS, pile.GRAVITY
    x = np.array([body.position for body in pile.scene(count).bodies[1:]])
    if seed:
        x[:, :2] += np.random.default_rng(seed).uniform(-ASIDE, ASIDE, (count, 2))
    v, w, inertia = np.zeros((count, 3)), np.zeros((count, 3)), 0.4 * mass * radius**2
    pair_damping = 2.0 * DAMPED * np.sqrt(0.5 * stiffness * mass)
    floor_damping = 2.0 * DAMPED * np.sqrt(stiffness * mass)
    down = np.array([0.0, 0.0, -radius])
    loads, looked = [], np.full_like(x, np.inf)
    pairs = np.zeros((0, 2), dtype=int)
    for _ in range(round(seconds / step)):
        if np.abs(x - looked).max() > 0.5 * SKIN / np.sqrt(3.0):
            looked, pairs = x.copy(), cKDTree(x).query_pairs(2.0 * radius + SKIN, output_type="ndarray")
        between = x[pairs[:, 1]] - x[pairs[:, 0]]
        squares = np.einsum("ij,ij->i", between, between)
        touching = squares < 4.0 * radius**2
        a, b = pairs[touching].T
        apart = np.sqrt(squares[touching])
        u = between[touching] / apart[:, None]
        closing = v[b] - v[a]
        along = np.einsum("ij,ij->i", closing, u)
        load = np.maximum(0.0, stiffness * (2.0 * radius - apart) - pair_damping * along)
        slip = closing - along[:, None] * u - radius * _cross(w[a] + w[b], u)
        rub = _dragged(slip, load, drag)
        push = rub + load[:, None] * u
        moment = -radius * _cross(u, rub)
        force, torque = np.zeros((count, 3)), np.zeros((count, 3))
        force[:, 2] = -mass * gravity
        for k in range(3):
            force[:, k] += np.bincount(b, push[:, k], count) - np.bincount(a, push[:, k], count)
            torque[:, k] += np.bincount(b, moment[:, k], count) + np.bincount(a, moment[:, k], count)
        low = np.flatnonzero(x[:, 2] < radius)
        held = np.maximum(0.0, stiffness * (radius - x[low, 2]) - floor_damping * v[low, 2])
        slip = v[low] + _cross(w[low], down)
        slip[:, 2] = 0.0
        rub = _dragged(slip, held, drag)
        force[low] += rub
        force[low, 2] += held
        torque[low] += _cross(down, rub)
        v += step / mass * force
        w += step / inertia * torque
        x += step * v
        loads.append(held.sum() / (count * mass * gravity))
    each: np.ndarray = np.array(loads).reshape(seconds, -1).mean(axis=1)
    return each


def missing_loads(count: int, starts: int) -> np.ndarray:
    """(starts,) part of the weight the floor does not carry in the last second."""
    return np.array([1.0 - floor_loads(count, seed)[-1] for seed in range(starts)])
