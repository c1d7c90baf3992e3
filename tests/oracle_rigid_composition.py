"""Symmetric compositions for rigid bodies, written only from the equations: dense, Newton on Λ by least squares.

The base step over τ is RATTLE with the variational turn of tests.oracle_rigid:

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
    Trace,
    Velocity,
    simulate,
)
from tests.oracle_rigid import RigidOracle

Array = npt.NDArray[Any]
_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
STAGES = {2: (1.0,), 4: (_SUZUKI, _SUZUKI, 1.0 - 4.0 * _SUZUKI, _SUZUKI, _SUZUKI)}
STATE = {
    "x": Trace(quantity=Position()),
    "q": Trace(quantity=Orientation()),
    "v": Trace(quantity=Velocity()),
    "w": Trace(quantity=AngularVelocity()),
}


def assert_dense_steps(scene: Scene, h: float, steps: int, within: float = 1e-9) -> None:
    """The engine takes the oracle's steps of order 4: m, m/s and rad/s to `within`, quaternions to a tenth of it."""
    oracle = ComposedOracle(scene, h)
    run = simulate(scene, time_step=h, steps=steps, method=Method(composition="order4"), observe=STATE)

    for k in range(1, steps + 1):
        oracle.step()
        same = np.sign(np.sum(run["q"][k] * oracle.q, axis=1))[:, None]
        for quantity, exact in (("x", oracle.x), ("v", oracle.v), ("w", oracle.angular_velocity())):
            assert np.abs(run[quantity][k] - exact).max() < within, quantity
        assert np.abs(same * run["q"][k] - oracle.q).max() < 0.1 * within


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
        rows = [self.jacobian(joint.violation) for joint in self.joints]
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
