"""Chains of particles on distance constraints: scenes, an independent reference, and small motion."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.special import roots_laguerre

from spook_tracker import engine

GRAVITY = 9.81  # m/s²
LENGTH = 1.0  # m, each link
MASS = 1.0  # kg, each sphere
COMPLIANCE = 1e-13  # m/N


def level_chain(count: int, damping: float, *, compliance: float = COMPLIANCE) -> engine.Scene:
    """`count` spheres in a level row from the pivot at the origin along x, at rest; damping in s."""
    return chain([(float(i + 1) * LENGTH, 0.0, 0.0) for i in range(count)], damping, compliance=compliance)


def hanging_chain(
    count: int,
    damping: float,
    *,
    load: float = MASS,
    compliance: float = COMPLIANCE,
    tilt: float = 0.0,
    zigzag: float = 0.0,
) -> engine.Scene:
    """`count` spheres below the pivot, the last of mass `load` [kg]; `tilt` [rad] leans the chain, `zigzag`
    [m] pushes its spheres left and right in turn."""
    x, z = np.sin(tilt), -np.cos(tilt)
    side = [zigzag * (-1.0) ** i for i in range(count)]
    places = [
        ((i + 1) * LENGTH * x - side[i] * z, 0.0, (i + 1) * LENGTH * z + side[i] * x) for i in range(count)
    ]
    return chain(places, damping, compliance=compliance, load=load)


def chain(places: Any, damping: float, *, compliance: float = COMPLIANCE, load: float = MASS) -> engine.Scene:
    """Spheres at `places`, each tied to the one before and the first to the origin by a link of 1 m."""
    count = len(places)
    spheres = tuple(
        engine.Particle(
            name=f"sphere {i + 1}",
            position=(float(place[0]), float(place[1]), float(place[2])),
            mass=load if i == count - 1 else MASS,
        )
        for i, place in enumerate(places)
    )
    ends: list[Any] = [(0.0, 0.0, 0.0), *(sphere.name for sphere in spheres)]
    links = tuple(
        engine.Distance(
            name=f"link {i + 1}",
            between=(ends[i], ends[i + 1]),
            rest_length=LENGTH,
            compliance=compliance,
            damping=damping,
        )
        for i in range(count)
    )
    return engine.Scene(bodies=spheres, constraints=links, gravity=(0.0, 0.0, -GRAVITY))


def fall_to_hanging(count: int) -> float:
    """Energy [J] between the level chain and the hanging one: m g l N (N + 1)/2."""
    return MASS * GRAVITY * LENGTH * count * (count + 1) / 2.0


@functools.cache
def exact_tip(count: int, time: float) -> tuple[float, float]:
    """Tip (x, z) [m] of the level chain after `time` [s], by DOP853 on the link angles; error about 1e-10 m.

    With angles θ from hanging and n(i,j) the spheres at or beyond both links:
    Σ n cos(θi − θj) θ̈j = −n(i,i) (g/l) sin θi − Σ n sin(θi − θj) θ̇j².
    """
    beyond = count - np.maximum.outer(np.arange(count), np.arange(count)).astype(float)

    def slopes(_: float, state: np.ndarray) -> np.ndarray:
        theta, rate = state[:count], state[count:]
        apart = theta[:, None] - theta[None, :]
        push = -np.diag(beyond) * GRAVITY / LENGTH * np.sin(theta) - (beyond * np.sin(apart)) @ rate**2
        return np.concatenate([rate, np.linalg.solve(beyond * np.cos(apart), push)])

    start = np.concatenate([np.full(count, np.pi / 2.0), np.zeros(count)])
    end = solve_ivp(slopes, (0.0, time), start, method="DOP853", rtol=1e-12, atol=1e-12).y[:count, -1]
    return float(LENGTH * np.sin(end).sum()), float(-LENGTH * np.cos(end).sum())


def sideways_modes(count: int, load: float = MASS) -> tuple[np.ndarray, np.ndarray]:
    """Squared frequencies [1/s²] and shapes (count, modes), normed by mass, of small motion about hanging.

    From the stiffness matrix of links that carry the weights below them; the last sphere weighs `load` [kg].
    """
    masses = np.full(count, MASS)
    masses[-1] = load
    tension = GRAVITY * np.cumsum(masses[::-1])[::-1]  # N, link by link
    below = np.append(tension[1:], 0.0)
    stiffness = (np.diag(tension + below) - np.diag(tension[1:], 1) - np.diag(tension[1:], -1)) / LENGTH
    squares, shapes = eigh(stiffness, np.diag(masses))
    return np.asarray(squares), np.asarray(shapes)


def small_motion(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same for equal masses: ω² = (g/l) x, x the roots of the Laguerre polynomial of degree N."""
    return GRAVITY / LENGTH * roots_laguerre(count)[0], sideways_modes(count)[1]
