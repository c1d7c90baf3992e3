"""A plain SPOOK for particles, written only from the equations: dense matrices, nothing clever, nothing shared.

One step solves, for all velocities v₊ and multipliers λ at once,

    [ M   −Gᵀ ] [ v₊ ]   [ M v + h f                  ]        Ups = 1/(1 + 4 τ/h)
    [ G   Sig ] [ λ  ] = [ −(4/h) Ups g + Ups G v      ]        Sig = 4 ε Ups/h²

and then moves x₊ = x + h v₊ (Lacoursière 2007, eqs 4.27 and 4.35, linearised). Slow on purpose.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from engine import PLAIN, CentralGravity, Distance, Load, Method, Scene, Spring

Array = npt.NDArray[np.float64]


class Oracle:
    """One scene of particles; `x` and `v` are (n, 3), `force` the row forces λ/h [N] of the last step."""

    def __init__(self, scene: Scene, time_step: float, method: Method = PLAIN) -> None:
        self.scene, self.method = scene, method
        self.h = time_step / method.substeps
        self.names = [body.name for body in scene.bodies]
        self.x = np.array([body.position for body in scene.bodies], dtype=float)
        self.v = np.array([body.velocity for body in scene.bodies], dtype=float)
        self.m = np.repeat([body.mass for body in scene.bodies], 3).astype(float)
        rows = [row for row in scene.constraints if isinstance(row, Distance)]
        self.ends = [row.between for row in rows]
        self.length = np.array([scene.length(r) if r.rest_length is None else r.rest_length for r in rows])
        self.eps = np.array([row.compliance for row in rows])
        self.tau = np.array([2.0 * self.h if row.damping is None else row.damping for row in rows])
        self.force = np.zeros(len(rows))
        if method.half_step_velocities:
            self.v = self.v - 0.5 * self.h * self.acceleration()

    def place(self, end: object, x: Array) -> Array:
        """Where an end of a row or spring is."""
        return x[self.names.index(end)] if isinstance(end, str) else np.array(end, dtype=float)

    def violation(self, x: Array) -> Array:
        """g = |d| − L of every row."""
        apart = [np.linalg.norm(self.place(b, x) - self.place(a, x)) for a, b in self.ends]
        return np.array(apart) - self.length

    def jacobian(self, x: Array) -> Array:
        """G, (rows, 3 n)."""
        out = np.zeros((len(self.ends), x.size))
        for row, (first, second) in enumerate(self.ends):
            apart = self.place(second, x) - self.place(first, x)
            unit = apart / np.linalg.norm(apart)
            for end, sign in ((first, -1.0), (second, 1.0)):
                if isinstance(end, str):
                    i = 3 * self.names.index(end)
                    out[row, i : i + 3] += sign * unit
        return out

    def external(self, x: Array, v: Array) -> Array:
        """f, (3 n,) N: gravity, central gravity, springs, loads."""
        mass = self.m.reshape(-1, 3)
        total = mass * np.array(self.scene.gravity)
        for force in self.scene.forces:
            if isinstance(force, CentralGravity):
                away = x - np.array(force.centre)
                total -= mass * force.strength * away / np.linalg.norm(away, axis=1, keepdims=True) ** 3
            elif isinstance(force, Load):
                total[self.names.index(force.body)] += force.force
            elif isinstance(force, Spring):
                total += self._spring(force, x, v)
        return total.reshape(-1)

    def _spring(self, spring: Spring, x: Array, v: Array) -> Array:
        first, second = spring.between
        apart = self.place(second, x) - self.place(first, x)
        pull = spring.stiffness * apart
        if spring.rest_length > 0.0:
            pull = spring.stiffness * (1.0 - spring.rest_length / np.linalg.norm(apart)) * apart
        if spring.viscosity > 0.0:
            unit = apart / np.linalg.norm(apart)
            zero = np.zeros(3)
            speeds = [v[self.names.index(e)] if isinstance(e, str) else zero for e in (first, second)]
            pull = pull + spring.viscosity * float((speeds[1] - speeds[0]) @ unit) * unit
        out = np.zeros_like(x)
        for end, sign in ((first, 1.0), (second, -1.0)):
            if isinstance(end, str):
                out[self.names.index(end)] += sign * pull
        return out

    def acceleration(self) -> Array:
        """Acceleration (n, 3) of a start from rest: M a − Gᵀ µ = f and G a + Sig µ = 0, softness included."""
        if np.any(self.v) or np.any(np.abs(self.violation(self.x)) > 1e-15):
            raise ValueError("the oracle's half-step start is for scenes at rest with closed rows")
        g, f = self.jacobian(self.x), self.external(self.x, self.v)
        softness = 4.0 * self.eps / (self.h * (self.h + 4.0 * self.tau))
        schur = (g / self.m) @ g.T + np.diag(softness)
        mu = np.linalg.solve(schur, -g @ (f / self.m)) if len(self.ends) else np.zeros(0)
        return ((f + g.T @ mu) / self.m).reshape(-1, 3)

    def velocity_after(self) -> tuple[Array, Array]:
        """v₊ (n, 3) and λ of one substep from the present state, which does not change."""
        h, x, v = self.h, self.x, self.v.reshape(-1)
        theta = self.tau / h
        ups = 1.0 / (1.0 + 4.0 * theta)
        g, jac = self.violation(x), self.jacobian(x)
        n, k = v.size, len(g)
        matrix = np.zeros((n + k, n + k))
        matrix[:n, :n] = np.diag(self.m)
        matrix[:n, n:] = -jac.T
        matrix[n:, :n] = jac
        matrix[n:, n:] = np.diag(4.0 * self.eps * ups / h**2)
        top = self.m * v + h * self.external(x, self.v)
        bottom = -(4.0 / h) * ups * g + ups * (jac @ v)
        corrections = self.method.corrections if k else 0
        cap = self.method.correction_cap * self.length
        if corrections:  # the curvature of g on the way here is known before the first solve
            behind = self.violation(x - h * self.v) - g + h * (jac @ v)
            bottom = bottom - (4.0 / h) * ups * np.minimum(behind, cap) / 4.0
        solved = np.linalg.solve(matrix, np.concatenate([top, bottom]))
        for _ in range(corrections):
            ahead = self.violation(x + h * solved[:n].reshape(-1, 3)) - g - h * (jac @ solved[:n])
            curved = bottom - (4.0 / h) * ups * (0.25 + theta) * np.minimum(ahead, cap)
            solved = np.linalg.solve(matrix, np.concatenate([top, curved]))
        return solved[:n].reshape(-1, 3), solved[n:]

    def step(self) -> None:
        """Advance one time step: all its substeps."""
        for _ in range(self.method.substeps):
            self.v, multiplier = self.velocity_after()
            self.force = multiplier / self.h
            self.x = self.x + self.h * self.v

    def samples(self, steps: int) -> Iterator[tuple[Array, Array, Array]]:
        """Position, velocity read at the sample's time, and row forces, for samples 0 … steps."""
        for sample in range(steps + 1):
            shown = self.v
            if self.method.half_step_velocities and sample == 0:
                shown = np.array([body.velocity for body in self.scene.bodies])
            elif self.method.half_step_velocities:
                shown = 0.5 * (self.v + self.velocity_after()[0])
            yield self.x.copy(), shown.copy(), self.force.copy()
            if sample < steps:
                self.step()
