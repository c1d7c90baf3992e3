"""A plain SPOOK for particles, written only from the equations: dense matrices, np.linalg.solve, nothing shared.

A row asks, averaged over three positions (Lacoursière 2007, eqs 4.27 and 4.35),

    (eps/h) lambda + (g₋ + 2 g + g₊)/4 + (tau/h) (g₊ − g) = 0,      force of the row on the bodies Gᵀ lambda / h.

With g± = g ± h G v± + c±, the curvatures c dropped or kept, that is one linear system per step in the new
velocities and the row impulses lambda:

    [ M   −Gᵀ  ] [ v₊     ]   [ M v + h f                                              ]
    [ G    Sig ] [ lambda ] = [ Ups (G v − (4/h) g) − (4/h) Ups ((c₋ + c₊)/4 + theta c₊) ]

with theta = tau/h, Ups = 1/(1 + 4 theta), Sig = 4 eps Ups/h², and then x₊ = x + h v₊. String stiffness puts
M + (h²/4) Σ (T/l) (I − u uᵀ) for M, T the tension of the step before (its damping above T h²/(m l) = .3 is left out).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from spook_tracker.engine import PLAIN, CentralGravity, Distance, Load, Method, Particle, Scene, Spring
from spook_tracker.engine.forces import End

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Sample:
    """The state at one time; `velocity` is read at that time, `tension` (rows,) N is of the step before."""

    position: Array  # (n, 3) m
    velocity: Array  # (n, 3) m/s
    tension: Array  # (rows,) N, positive where a row pulls its ends together
    violation: Array  # (rows,) m


class Oracle:
    """One scene of particles, stepped with `step`; `x` and `v` are (n, 3)."""

    def __init__(self, scene: Scene, time_step: float, method: Method = PLAIN) -> None:
        self.scene, self.method, self.h = scene, method, time_step / method.substeps
        self.index = {body.name: i for i, body in enumerate(scene.bodies)}
        self.rows = [row for row in scene.constraints if isinstance(row, Distance)]
        assert len(self.rows) == len(scene.constraints)
        assert all(isinstance(body, Particle) for body in scene.bodies)
        self.mass = np.array([float(body.mass or 0.0) for body in scene.bodies])
        self.x = np.array([body.position for body in scene.bodies])
        self.v = np.array([body.velocity for body in scene.bodies])
        self.impulse = np.zeros(len(self.rows))  # lambda, N s
        self.rest = np.array([scene.length(r) if r.rest_length is None else r.rest_length for r in self.rows])
        self.eps = np.array([r.compliance for r in self.rows])
        self.theta = np.array([2.0 if r.damping is None else r.damping / self.h for r in self.rows])
        if method.half_step_velocities:
            self.v = self.v - 0.5 * self._gain()

    # --- the rows ---
    def between(self, ends: tuple[End, End], x: Array) -> Array:
        """From the first end to the second, m."""
        first, second = (x[self.index[end]] if isinstance(end, str) else np.array(end) for end in ends)
        return second - first

    def rate(self, ends: tuple[End, End], v: Array) -> Array:
        """How fast that changes, m/s; the world stands still."""
        first, second = (v[self.index[end]] if isinstance(end, str) else np.zeros(3) for end in ends)
        return second - first

    def apart(self, x: Array) -> Array:
        """(rows, 3): from the first end of each row to the second."""
        return np.array([self.between(row.between, x) for row in self.rows]).reshape(-1, 3)

    def violation(self, x: Array) -> Array:
        return np.linalg.norm(self.apart(x), axis=1) - self.rest

    def jacobian(self, x: Array) -> Array:
        """G (rows, 3 n): the gradient of the violations."""
        directions = self.apart(x)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        gradient = np.zeros((len(self.rows), *x.shape))
        for k, row in enumerate(self.rows):
            for end, sign in zip(row.between, (-1.0, 1.0), strict=True):
                if isinstance(end, str):
                    gradient[k, self.index[end]] += sign * directions[k]
        return gradient.reshape(len(self.rows), x.size)

    # --- the forces ---
    def force(self, x: Array, v: Array) -> Array:
        """External force f (n, 3) N."""
        total = self.mass[:, None] * np.array(self.scene.gravity)
        for force in self.scene.forces:
            if isinstance(force, CentralGravity):
                r = x - np.array(force.centre)
                distance = np.linalg.norm(r, axis=1)[:, None]
                total -= force.strength * self.mass[:, None] * r / distance**3
            elif isinstance(force, Load):
                total[self.index[force.body]] += force.force
            elif isinstance(force, Spring):
                d, rate = self.between(force.between, x), self.rate(force.between, v)
                length = float(np.linalg.norm(d))
                pull = force.stiffness * d
                if force.rest_length > 0.0:
                    pull = pull - force.stiffness * force.rest_length * d / length
                if force.viscosity > 0.0:
                    pull = pull + force.viscosity * (rate @ d) / length**2 * d
                for end, sign in zip(force.between, (1.0, -1.0), strict=True):
                    if isinstance(end, str):
                        total[self.index[end]] += sign * pull
        return total

    def inertia(self) -> Array:
        """(3 n, 3 n): M, with the transverse stiffness of taut rows if the method asks for it."""
        n = len(self.mass)
        heavy = np.zeros((n, 3, n, 3))
        heavy[range(n), :, range(n), :] = self.mass[:, None, None] * np.eye(3)
        if self.method.string_stiffness:
            for row, d, impulse in zip(self.rows, self.apart(self.x), self.impulse, strict=True):
                length = float(np.linalg.norm(d))
                across = np.eye(3) - np.outer(d, d) / length**2
                held = 0.25 * self.h**2 * max(0.0, -impulse / self.h) / length * across
                bodies = [self.index[end] for end in row.between if isinstance(end, str)]
                for i in bodies:
                    for j in bodies:
                        heavy[i, :, j, :] += held if i == j else -held
        return heavy.reshape(3 * n, 3 * n)

    # --- the step ---
    def solve(self, extra: Array) -> tuple[Array, Array]:
        """v₊ (n, 3) and lambda of the linear system, `extra` added to the right side of the rows."""
        n, rows, h = self.x.size, len(self.rows), self.h
        upsilon = 1.0 / (1.0 + 4.0 * self.theta)
        jacobian, mass = self.jacobian(self.x), self.inertia()
        matrix = np.zeros((n + rows, n + rows))
        matrix[:n, :n] = mass
        matrix[:n, n:] = -jacobian.T
        matrix[n:, :n] = jacobian
        matrix[n:, n:] = np.diag(4.0 * self.eps * upsilon / h**2)
        right = np.concatenate(
            [
                mass @ self.v.ravel() + h * self.force(self.x, self.v).ravel(),
                upsilon * (jacobian @ self.v.ravel() - 4.0 / h * self.violation(self.x)) + extra,
            ]
        )
        solution = np.linalg.solve(matrix, right)
        return solution[:n].reshape(-1, 3), solution[n:]

    def curvature(self, move: Array) -> Array:
        """c = g(x + move) − g(x) − G move, at most the cap."""
        straight = self.jacobian(self.x) @ move.ravel()
        exact = self.violation(self.x + move) - self.violation(self.x) - straight
        return np.minimum(exact, self.method.correction_cap * self.rest)

    def next_velocity(self) -> tuple[Array, Array]:
        """v₊ and lambda of the coming substep; the state does not change."""
        if not (self.rows and self.method.corrections):
            return self.solve(np.zeros(len(self.rows)))
        scale = 4.0 / self.h / (1.0 + 4.0 * self.theta)
        before = self.curvature(-self.h * self.v)
        velocity, impulse = self.solve(-scale * 0.25 * before)  # c₊ is not known yet
        for _ in range(self.method.corrections):
            after = self.curvature(self.h * velocity)
            velocity, impulse = self.solve(-scale * (0.25 * (before + after) + self.theta * after))
        return velocity, impulse

    def _gain(self) -> Array:
        """h times the acceleration at the start, of which half is taken back so that v lives at mid-step."""
        bend = np.zeros(len(self.rows))  # Ġ v = (|ḋ|² − (u·ḋ)²)/|d|
        if self.rows:
            d = self.apart(self.x)
            rate = np.array([self.rate(row.between, self.v) for row in self.rows])
            length = np.linalg.norm(d, axis=1)
            bend = (np.sum(rate**2, axis=1) - np.sum(rate * d, axis=1) ** 2 / length**2) / length
        return self.solve(-self.h * bend)[0] - self.v

    def step(self) -> None:
        """One reported time step: all its substeps."""
        for _ in range(self.method.substeps):
            self.v, self.impulse = self.next_velocity()
            self.x = self.x + self.h * self.v

    def samples(self, steps: int) -> Iterator[Sample]:
        """Samples 0 … steps, 0 the start as given. Velocities that live at mid-step are read as the mean of two."""
        start = np.array([body.velocity for body in self.scene.bodies])
        for sample in range(steps + 1):
            if sample > 0:
                self.step()
            seen = start if sample == 0 else self.v
            if sample > 0 and self.method.half_step_velocities:
                seen = 0.5 * (self.v + self.next_velocity()[0])
            yield Sample(self.x, seen, -self.impulse / self.h, self.violation(self.x))
