"""The pile of spheres by another law of contact: springs, dashpots and dragged friction in small steps, in NumPy.

Nothing of the engine is in it but the scene. Contacts are soft (weights sink in by millimetres) and blows lose nearly
all they have; friction drags at `DRAG` times the speed up to Coulomb's bound. Other stiffnesses give the same loads
within what other starts do (`tests/scalar_tests/test_pile_limits.py`), which is what makes them a reference.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from spook_tracker.scalar_tests.stacks import pile

STEP = 1e-3  # s
STIFFNESS = 2e4  # N/m
DRAG = 100.0  # N s/m
DAMPED = 0.9  # of the critical damping
SKIN = 0.1  # m: pairs nearer than this beyond touching are looked at until a body has gone half of it
ASIDE = 0.005  # m: how far another start is from the pile's own, and none overlaps yet
APART = 64.0  # m between piles that are let fall side by side


def _cross(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """(3, n) products of columns."""
    return np.stack((p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]))


def _dragged(speed: np.ndarray, load: np.ndarray, drag: float) -> np.ndarray:
    """Friction [N] against the speed [m/s] of points that are pushed together by the load [N]."""
    size = np.sqrt((speed * speed).sum(axis=0)) + 1e-30
    force: np.ndarray = speed * (np.minimum(pile.FRICTION * load, drag * size) / -size)
    return force


def floor_loads(
    count: int, starts: int, step: float = STEP, stiffness: float = STIFFNESS, drag: float = DRAG
) -> np.ndarray:
    """(starts, seconds) mean upward force of the floor in each second over the weight; the first start is the pile's own.
    The piles fall side by side, as one: what NumPy is called for takes less than the calls."""
    seconds = round(pile.STEPS * pile.TIME_STEP)
    radius, mass, gravity, total = pile.RADIUS, pile.MASS, pile.GRAVITY, starts * count
    own = np.array([body.position for body in pile.scene(count).bodies[1:]]).T
    x = np.tile(own, starts)
    for seed in range(1, starts):
        here = slice(seed * count, (seed + 1) * count)
        x[:2, here] += np.random.default_rng(seed).uniform(-ASIDE, ASIDE, (count, 2)).T
        x[0, here] += APART * seed
    v, w, inertia = np.zeros((3, total)), np.zeros((3, total)), 0.4 * mass * radius**2
    pair_damping = 2.0 * DAMPED * np.sqrt(0.5 * stiffness * mass)
    floor_damping = 2.0 * DAMPED * np.sqrt(stiffness * mass)
    down = np.array([[0.0], [0.0], [-radius]])
    loads, looked = [], np.full_like(x, np.inf)
    for _ in range(round(seconds / step)):
        if np.abs(x - looked).max() > 0.5 * SKIN / np.sqrt(3.0):
            looked, near = x.copy(), cKDTree(x.T).query_pairs(2.0 * radius + SKIN, output_type="ndarray")
            first, second = near.T.copy()
        between = x.take(second, axis=1) - x.take(first, axis=1)
        squares = (between * between).sum(axis=0)
        touching = np.flatnonzero(squares < 4.0 * radius**2)
        a, b = first.take(touching), second.take(touching)
        apart = np.sqrt(squares.take(touching))
        u = between.take(touching, axis=1) / apart
        closing = v.take(b, axis=1) - v.take(a, axis=1)
        along = (closing * u).sum(axis=0)
        load = np.maximum(0.0, stiffness * (2.0 * radius - apart) - pair_damping * along)
        turning = w.take(a, axis=1) + w.take(b, axis=1)
        rub = _dragged(closing - along * u - radius * _cross(turning, u), load, drag)
        push, moment = rub + load * u, -radius * _cross(u, rub)
        force, torque = np.empty((2, 3, total))
        for k in range(3):
            force[k] = np.bincount(b, push[k], total) - np.bincount(a, push[k], total)
            torque[k] = np.bincount(b, moment[k], total) + np.bincount(a, moment[k], total)
        force[2] -= mass * gravity
        low = np.flatnonzero(x[2] < radius)
        held = np.maximum(0.0, stiffness * (radius - x[2, low]) - floor_damping * v[2, low])
        slip = v[:, low] + _cross(w[:, low], down)
        slip[2] = 0.0
        rub = _dragged(slip, held, drag)
        force[:, low] += rub
        force[2, low] += held
        torque[:, low] += _cross(down, rub)
        v += step / mass * force
        w += step / inertia * torque
        x += step * v
        loads.append(np.bincount(low // count, held, starts))
    each = np.array(loads).reshape(seconds, -1, starts).mean(axis=1).T
    return np.asarray(each / (count * mass * gravity))


def missing_loads(count: int, starts: int, **law: float) -> np.ndarray:
    """(starts,) part of the weight the floor does not carry in the last second."""
    return np.asarray(1.0 - floor_loads(count, starts, **law)[:, -1])
