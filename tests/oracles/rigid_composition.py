"""Symmetric compositions for rigid bodies, written only from the equations: dense, Newton on Λ by least squares.

The base step over τ is RATTLE with the free turn of tests.oracles.rigid, or, where the engine takes joint coordinates, with that
of the discrete Lagrangian φ·I φ/2τ for a turn φ:

    p ← p + (τ/2) f(q) + G(q)ᵀ Λ        (p: momenta and world angular momenta)
    q ← the free motion of p over τ     with Λ such that g(q) = 0
    p ← p + (τ/2) f(q) + G(q)ᵀ N        with N such that G(q) v = 0

It is symmetric, so that a composition with stages γ_k of sum 1 that reads the same backwards is of the order the
γ_k say.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from spook_tracker.engine import (
    AngularVelocity,
    Method,
    Orientation,
    Position,
    Scene,
    Velocity,
    explain,
    simulate,
)
from tests.oracles.rigid import RigidOracle, free_turn, momentum_of_turn, product, rotation
from tests.scenes.seen import traces

Array = npt.NDArray[Any]
_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
STAGES = {2: (1.0,), 4: (_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI, _SUZUKI, _SUZUKI)}
STATE = traces(x=Position(), q=Orientation(), v=Velocity(), w=AngularVelocity())


def assert_dense_steps(
    scene: Scene, h: float, steps: int, within: float = 1e-9, *, oracle: type[ComposedOracle] | None = None
) -> None:
    """The engine takes the oracle's steps of order 4: m, m/s and rad/s to `within`, quaternions to a tenth of it."""
    dense = (oracle or ComposedOracle)(scene, h)
    run = simulate(scene, time_step=h, steps=steps, method=Method(composition="order4"), observe=STATE)

    for k in range(1, steps + 1):
        dense.step()
        same = np.sign(np.sum(run["q"][k] * dense.q, axis=1))[:, None]
        for quantity, exact in (("x", dense.x), ("v", dense.v), ("w", dense.angular_velocity())):
            assert np.abs(run[quantity][k] - exact).max() < within, quantity
        assert np.abs(same * run["q"][k] - dense.q).max() < 0.1 * within


class ComposedOracle(RigidOracle):
    """Steps of one order, 2 or 4; rows are held rigidly and forces do not depend on velocities."""

    order = 4

    def step(self) -> None:
        for gamma in STAGES[self.order]:
            self._stage(gamma * self.h)

    def _violation(self) -> Array:
        return np.concatenate(
            [joint.violation(self.x, self.q, self) for joint in self.joints] or [np.zeros(0)]
        )

    def _jacobian(self) -> Array:
        rows = [self.jacobian(joint.violation, joint.bodies) for joint in self.joints]
        return np.vstack(rows) if rows else np.zeros((0, 6 * len(self.x)))

    def _inverse_mass(self) -> Array:
        inverse = np.zeros((6 * len(self.x),) * 2)
        for i in np.nonzero(self.free)[0]:
            inverse[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = np.eye(3) / self.mass[i]
            inverse[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = np.linalg.inv(self.world_inertia(i))
        return inverse

    def _push(self, impulse: Array) -> None:
        push = impulse.reshape(-1, 6) * self.free[:, None]
        self.v = self.v + push[:, :3] / self.mass[:, None]
        self.ell = self.ell + push[:, 3:]

    def _stage(self, tau: float) -> None:
        self._push(0.5 * tau * self.force().ravel())
        rows = self._jacobian()
        matrix = tau * rows @ self._inverse_mass() @ rows.T
        x, q, h = self.x, self.q, self.h
        self.h = tau  # of the turn
        for _ in range(60):
            self.x, self.q = x + tau * self.v, q.copy()
            for i in np.nonzero(self.free)[0]:
                self._turn(i)
            wrong = self._violation()
            if not len(wrong) or np.abs(wrong).max() < 1e-15:
                break
            self._push(-rows.T @ np.linalg.lstsq(matrix, wrong, rcond=1e-10)[0])
        self.h = h
        self._push(0.5 * tau * self.force().ravel())
        self._project()

    def _project(self) -> None:
        rows, inverse = self._jacobian(), self._inverse_mass()
        slip = rows @ np.hstack([self.v, self.angular_velocity()]).ravel()
        if len(rows):
            self._push(-rows.T @ np.linalg.lstsq(rows @ inverse @ rows.T, slip, rcond=1e-10)[0])


class TreeOracle(ComposedOracle):
    """With the turn φ whose discrete momentum is that of the body, by Newton from a turn at the rate it has."""

    def _turn(self, body: int) -> None:
        h, moments = self.h, self.inertia[body]
        p = rotation(self.q[body]).T @ self.ell[body]
        turn, left = np.array([1.0, *(0.5 * h * p / moments)]), np.inf
        turn /= np.linalg.norm(turn)
        while (off := np.abs(wrong := p - momentum_of_turn(moments, h, turn)).max()) < 0.5 * left:
            turn, left = product(turn, np.array([1.0, *(0.5 * h * wrong / moments)])), off
            turn /= np.linalg.norm(turn)
        q = product(self.q[body], turn)
        self.q[body] = q / np.linalg.norm(q)


class PivotOracle(ComposedOracle):
    """Bodies on balls of the world: each turns about its pivot as a free one with the inertia about it."""

    def _stage(self, tau: float) -> None:
        self._push(0.5 * tau * self.force().ravel())
        for joint in self.joints:
            (i,) = (body for body in joint.bodies if body >= 0)
            pivot = joint.points(self.x, self.q, self)[joint.bodies.index(-1)]
            arm = joint.anchors[joint.bodies.index(i)]
            tensor = np.diag(self.inertia[i]) + self.mass[i] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
            moments, axes = np.linalg.eigh(tensor)
            axes[:, 2] *= np.linalg.det(axes)
            reach = rotation(self.q[i]) @ arm
            about = self.ell[i] - np.cross(reach, self.mass[i] * self.v[i])
            turn = free_turn(moments, tau, axes.T @ rotation(self.q[i]).T @ about)
            turn[1:] = axes @ turn[1:]
            self.q[i] = product(self.q[i], turn)
            self.q[i] /= np.linalg.norm(self.q[i])
            self.x[i] = pivot - rotation(self.q[i]) @ arm
            self.v[i] = (reach - rotation(self.q[i]) @ arm) / tau
            self.ell[i] = about + np.cross(reach, self.mass[i] * self.v[i])
        self._push(0.5 * tau * self.force().ravel())
        self._project()


def oracle_of(scene: Scene) -> type[ComposedOracle]:
    """The one whose turns are those of the solver that the engine chooses."""
    choices = explain(scene, time_step=0.02, method=Method(composition="order4"))
    reason = next(choice.reason for choice in choices if choice.stage == "solve_block")
    if "balls of the world" in reason:
        return PivotOracle
    return TreeOracle if "joint coordinates" in reason else ComposedOracle
