"""Bodies on ideal joints as Lagrange's equations of the first kind have them, integrated tightly: no step of any engine.

M a = f + Gᵀ λ, G a = −Ġ v: each joint's rows are differentiated twice. Rows that repeat each other share their load by least norm.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import lstsq

from spook_tracker.engine import Distance, Hinge, Load, Lock, RigidBody, Scene
from spook_tracker.engine.rigid_program import normals

REPEATED = 1e-6  # a singular value so much smaller than the largest is that of a row that repeats others
TIGHT = 1e-10
X, Y, Z = np.eye(3)


def rotations(q: np.ndarray) -> np.ndarray:
    """(n, 3, 3) of quaternions (n, 4)."""
    w, u = q[:, 0, None, None], q[:, 1:]
    return (2.0 * w**2 - 1.0) * np.eye(3) + 2.0 * w * skew(u) + 2.0 * u[:, :, None] * u[:, None, :]


def skew(u: np.ndarray) -> np.ndarray:
    """u × as matrices, (n, 3, 3)."""
    return np.einsum("ijk,nj->nik", LEVI_CIVITA, u)


LEVI_CIVITA = np.zeros((3, 3, 3))
for cycle in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI_CIVITA[cycle], LEVI_CIVITA[cycle[0], cycle[2], cycle[1]] = 1.0, -1.0


class Mechanism:
    """Rigid bodies on hinges and locks, under gravity, constant loads and springs that are undamped compliant distances."""

    def __init__(self, scene: Scene) -> None:
        bodies = [body for body in scene.bodies if isinstance(body, RigidBody)]
        self.count = len(bodies)
        self.mass = np.array([body.mass for body in bodies], dtype=float)
        self.moments = np.array([body.inertia for body in bodies], dtype=float)
        self.start = np.concatenate([
            np.ravel([getattr(body, name) for body in bodies])
            for name in ("position", "orientation", "velocity", "angular_velocity")
        ])  # fmt: skip
        index = {body.name: k for k, body in enumerate(bodies)}
        place, turn = (
            self.start[: 3 * self.count].reshape(-1, 3),
            rotations(self.start[3 * self.count : 7 * self.count].reshape(-1, 4)),
        )
        place, turn = (
            np.vstack([place, np.zeros(3)]),
            np.concatenate([turn, np.eye(3)[None]]),
        )  # the world is the last

        def within(body: int, point: Any) -> np.ndarray:
            return np.asarray(turn[body].T @ (np.asarray(point) - place[body]))

        self.force = np.zeros((self.count, 6))
        self.force[:, :3] = self.mass[:, None] * scene.gravity
        for load in scene.forces:
            assert isinstance(load, Load)
            assert load.factor is None
            self.force[index[load.body]] += (*load.force, *load.torque)
        points, dots, self.springs = [], [], []
        for joint in scene.constraints:
            ends = [
                index.get(end, self.count) if isinstance(end, str) else self.count for end in joint.between
            ]
            if isinstance(joint, Distance):
                held = [within(end, scene.anchor(joint, k)) for k, end in enumerate(ends)]
                self.springs.append((ends, held, float(joint.rest_length), 1.0 / float(joint.compliance)))
                continue
            assert isinstance(joint, Hinge | Lock)
            points.append((ends, [within(end, joint.at) for end in ends]))
            one, two = normals(joint.axis) if isinstance(joint, Hinge) else (X, Y)
            pairs = (
                [(one, joint.axis), (two, joint.axis)]
                if isinstance(joint, Hinge)
                else [(X, Y), (Y, Z), (Z, X)]
            )
            dots += [
                (ends, [turn[end].T @ np.asarray(u) for end, u in zip(ends, pair, strict=True)])
                for pair in pairs
            ]
        self.point_ends, self.arms = (np.array([row[k] for row in points]) for k in (0, 1))
        self.dot_ends, self.directions = (np.array([row[k] for row in dots]) for k in (0, 1))

    def parts(self, state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Places, quaternions, velocities, spins, each (n, …)."""
        n = self.count
        x, q, v, w = np.split(state, [3 * n, 7 * n, 10 * n])
        return x.reshape(n, 3), q.reshape(n, 4), v.reshape(n, 3), w.reshape(n, 3)

    def slope(self, _: float, state: np.ndarray) -> np.ndarray:
        """The state's derivative."""
        x, q, v, w = self.parts(state)
        turn = rotations(q)
        spins, turns = np.vstack([w, np.zeros(3)]), np.concatenate([turn, np.eye(3)[None]])
        own = np.einsum("nij,nj,nkj,nk->ni", turn, self.moments, turn, w)  # angular momentum
        force = self.force.copy()
        force[:, 3:] -= np.cross(w, own)
        self._pull(force, x, turns)
        root = np.zeros((self.count, 6, 6))  # of the inverse mass: root rootᵀ
        root[:, [0, 1, 2], [0, 1, 2]] = self.mass[:, None] ** -0.5
        root[:, 3:, 3:] = turn / np.sqrt(self.moments)[:, None, :]
        free = np.einsum("nji,nj->ni", root, force)
        rows, curve = self._rows(turns, spins)
        weighed = np.einsum("rni,nij->rnj", rows[:, :-1], root)
        off = -curve - np.einsum("rni,ni->r", weighed, free)
        found = lstsq(
            weighed.reshape(len(rows), -1), off, cond=REPEATED, lapack_driver="gelsy", check_finite=False
        )[0].reshape(-1, 6)
        change = np.einsum("nij,nj->ni", root, free + found)
        rate = 0.5 * np.hstack(
            [-(w * q[:, 1:]).sum(axis=1, keepdims=True), q[:, :1] * w + np.cross(w, q[:, 1:])]
        )
        return np.concatenate([v.ravel(), rate.ravel(), change[:, :3].ravel(), change[:, 3:].ravel()])

    def _pull(self, force: np.ndarray, x: np.ndarray, turns: np.ndarray) -> None:
        places = np.vstack([x, np.zeros(3)])
        for ends, held, rest, stiffness in self.springs:
            arms = [turns[end] @ arm for end, arm in zip(ends, held, strict=True)]
            apart = places[ends[1]] + arms[1] - places[ends[0]] - arms[0]
            length = np.linalg.norm(apart)
            pull = stiffness * (length - rest) / length * apart
            for end, arm, sign in zip(ends, arms, (1.0, -1.0), strict=True):
                if end < self.count:
                    force[end] += sign * np.concatenate([pull, np.cross(arm, pull)])

    def _rows(self, turns: np.ndarray, spins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """G (rows, n + 1, 6) and Ġ v (rows,)."""
        points, dots = len(self.point_ends), len(self.dot_ends)
        rows, curve = np.zeros((3 * points + dots, self.count + 1, 6)), np.zeros(3 * points + dots)
        of = np.arange(points)
        for k, sign in enumerate((-1.0, 1.0)):  # the second's point less the first's
            end = self.point_ends[:, k]
            arm, spin = np.einsum("nij,nj->ni", turns[end], self.arms[:, k]), spins[end]
            block = sign * np.concatenate([np.tile(np.eye(3), (points, 1, 1)), -skew(arm)], axis=2)
            for row in range(3):
                rows[3 * of + row, end] += block[:, row]
            curve[: 3 * points] += sign * np.cross(spin, np.cross(spin, arm)).ravel()
        first, second = self.dot_ends[:, 0], self.dot_ends[:, 1]
        u, w = (
            np.einsum("nij,nj->ni", turns[end], self.directions[:, k])
            for k, end in enumerate((first, second))
        )
        normal, of = np.cross(u, w), 3 * points + np.arange(dots)
        rows[of, first, 3:] += normal
        rows[of, second, 3:] -= normal
        du, dw = np.cross(spins[first], u), np.cross(spins[second], w)
        curve[3 * points :] = (
            (np.cross(spins[first], du) * w).sum(axis=1)
            + 2.0 * (du * dw).sum(axis=1)
            + (u * np.cross(spins[second], dw)).sum(axis=1)
        )
        return rows, curve


@functools.lru_cache(maxsize=4)
def _solution(scene: Scene, duration: float) -> Callable[[np.ndarray], np.ndarray]:
    mechanism = Mechanism(scene)
    found = solve_ivp(
        mechanism.slope,
        (0.0, duration),
        mechanism.start,
        "DOP853",
        rtol=TIGHT,
        atol=1e-3 * TIGHT,
        dense_output=True,
    )
    assert found.success, found.message
    return found.sol  # type: ignore[no-any-return]


def moved(scene: Scene, times: np.ndarray) -> dict[str, Any]:
    """A recording's states at `times` [s]; how joints are damped or give way is no part of an ideal mechanism."""
    ideal = replace(scene, constraints=tuple(
        row if isinstance(row, Distance) else replace(row, damping=None, compliance=0.0) for row in scene.constraints
    ))  # fmt: skip
    states = _solution(ideal, float(times[-1]))(times).T
    count = len(scene.bodies)
    x, q, v, w = np.split(states, [3 * count, 7 * count, 10 * count], axis=1)
    shapes = {"positions": x, "orientations": q, "velocities": v, "angular_velocities": w}
    return {name: part.reshape(len(times), count, -1) for name, part in shapes.items()}
