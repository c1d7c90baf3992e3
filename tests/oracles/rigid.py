"""A plain SPOOK for rigid bodies, written only from the equations: dense, one np.linalg.solve per step.

Violations are written once, as functions of positions and orientations; their Jacobian is their derivative by
complex steps, exact to rounding, so no Jacobian is derived by hand. One step solves

    [ M   −Gᵀ  −Aᵀ ] [ v₊    ]   [ M v + h f             ]      M = blocks (m, R I0 Rᵀ), v = (velocity, angular velocity)
    [ G    Sig  0  ] [ lambda ] = [ Ups (G v − (4/h) g)  ]      Sig = 4 eps Ups/h², Ups = 1/(1 + 4 tau/h)
    [ A    0    0  ] [ alpha  ]   [ motor speed           ]

and moves x₊ = x + h v₊. The new angular momentum ell₊ in world axes turns the body as Euler's equations have it:
q' = ½ q (I0⁻¹ R(q)ᵀ ell₊), integrated over h by Taylor series of its own; then w₊ = R₊ I0⁻¹ R₊ᵀ ell₊.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from spook_tracker.engine import (
    WORLD,
    Ball,
    CentralGravity,
    Cylindrical,
    Distance,
    Hinge,
    Load,
    Lock,
    Particle,
    Planar,
    PointOnLine,
    Prismatic,
    RigidBody,
    Scene,
    Spring,
    Universal,
)
from spook_tracker.engine.joints import AxialJoint, Constraint, GuidedJoint, Joint

Array = npt.NDArray[Any]
TINY = 1e-40  # of a complex step


def cross(a: Array, b: Array) -> Array:
    """a × b of two vectors; np.cross is made for many and takes ten times as long for one."""
    (a0, a1, a2), (b0, b1, b2) = a.tolist(), b.tolist()
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def product(a: Array, b: Array) -> Array:
    """Quaternion product, (w, x, y, z)."""
    (s, a0, a1, a2), (t, b0, b1, b2) = a.tolist(), b.tolist()
    return np.array(
        [
            s * t - (a0 * b0 + a1 * b1 + a2 * b2),
            s * b0 + t * a0 + (a1 * b2 - a2 * b1),
            s * b1 + t * a1 + (a2 * b0 - a0 * b2),
            s * b2 + t * a2 + (a0 * b1 - a1 * b0),
        ]
    )


def conjugate(q: Array) -> Array:
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def rotation(q: Array) -> Array:
    """Matrix of a unit quaternion: body to world."""
    w, x, y, z = q.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def frame(axis: Array) -> Array:
    """(3, 3): axis and two normals in rows; the first normal nearest the world axis farthest from `axis`."""
    away = np.eye(3)[np.argmin(np.abs(axis))]
    first = away - (away @ axis) * axis
    first /= np.linalg.norm(first)
    return np.array([axis, first, cross(axis, first)])


class Placed:
    """A constraint with its frame, fixed to both bodies where they start."""

    def __init__(self, constraint: Constraint, scene: Scene, oracle: RigidOracle) -> None:
        self.constraint = constraint
        self.bodies = [
            oracle.index.get(end, -1) if isinstance(end, str) and end != WORLD else -1
            for end in constraint.between
        ]
        if isinstance(constraint, Distance):
            points = [np.array(scene.anchor(constraint, i)) for i in (0, 1)]
            rest = constraint.rest_length
            self.rest = scene.length(constraint) if rest is None else rest
            self.axes = np.eye(3)
        else:
            at = constraint.at
            if at is None:
                at = scene.body([end for end in constraint.between if end != WORLD][-1]).position
            points = [np.array(at)] * 2
            self.axes = np.eye(3)
            if isinstance(constraint, AxialJoint | GuidedJoint):
                self.axes = frame(np.array(constraint.axis))
            elif isinstance(constraint, Universal):
                axis, across = np.array(constraint.axis), np.array(constraint.cross_axis)
                self.axes = np.array([axis, across, cross(axis, across)])
        self.anchors = []
        self.start = []
        for body, point in zip(self.bodies, points, strict=True):
            x, q = oracle.pose(body, oracle.x, oracle.q)
            self.anchors.append(rotation(q).T @ (point - x))
            self.start.append(q.copy())

    def points(self, x: Array, q: Array, oracle: RigidOracle) -> list[Array]:
        """Where the two anchors are."""
        poses = [oracle.pose(body, x, q) for body in self.bodies]
        return [p + rotation(o) @ a for (p, o), a in zip(poses, self.anchors, strict=True)]

    def relative(self, x: Array, q: Array, oracle: RigidOracle) -> tuple[Array, Array]:
        """Offset (3,) and rotation (4,) of the second joint frame in the first's, in the joint's axes."""
        first, second = self.points(x, q, oracle)
        turned = [
            product(oracle.pose(body, x, q)[1], conjugate(start))
            for body, start in zip(self.bodies, self.start, strict=True)
        ]
        offset = self.axes @ (rotation(turned[0]).T @ (second - first))
        turn = product(conjugate(turned[0]), turned[1])
        sign = 1.0 if turn[0].real >= 0.0 else -1.0
        return offset, sign * np.concatenate([turn[:1], self.axes @ turn[1:]])

    def violation(self, x: Array, q: Array, oracle: RigidOracle) -> Array:
        """The rows in the order of engine.joints."""
        kind = self.constraint
        if isinstance(kind, Distance):
            first, second = self.points(x, q, oracle)
            return np.array([np.sqrt(np.sum((second - first) ** 2)) - self.rest])
        offset, turn = self.relative(x, q, oracle)
        if isinstance(kind, Lock):
            return np.concatenate([offset, 2.0 * turn[1:]])
        if isinstance(kind, Ball):
            return offset
        if isinstance(kind, PointOnLine):
            return offset[1:]
        carried = rotation(turn)  # columns: the second frame's axes in the first frame
        tilt = cross(np.array([1.0, 0.0, 0.0]), carried[:, 0])[1:]
        if isinstance(kind, Hinge):
            return np.concatenate([offset, tilt])
        if isinstance(kind, Cylindrical):
            return np.concatenate([offset[1:], tilt])
        if isinstance(kind, Planar):
            return np.concatenate([offset[:1], tilt])
        if isinstance(kind, Prismatic):
            return np.concatenate([offset[1:], 2.0 * turn[1:]])
        assert isinstance(kind, Universal)
        return np.append(offset, carried[0, 1])

    def rate(self, oracle: RigidOracle) -> Array:
        """(1, 6 n): how velocities change the free coordinate; for a hinge about the first body's axis."""
        if isinstance(self.constraint, Prismatic):
            return oracle.jacobian(self.coordinate, self.bodies)
        about = (
            rotation(oracle.pose(self.bodies[0], oracle.x, oracle.q)[1])
            @ rotation(self.start[0]).T
            @ self.axes[0]
        )
        row = np.zeros((1, 6 * len(oracle.x)))
        for body, sign in zip(self.bodies, (-1.0, 1.0), strict=True):
            if body >= 0:
                row[0, 6 * body + 3 : 6 * body + 6] += sign * about
        return row

    def coordinate(self, x: Array, q: Array, oracle: RigidOracle) -> Array:
        """(1,): the free coordinate of an axial joint near zero turns; m or rad."""
        offset, turn = self.relative(x, q, oracle)
        if isinstance(self.constraint, Prismatic):
            return offset[:1]
        return np.array([2.0 * np.arctan2(turn[1], turn[0])])


class RigidOracle:
    """Bodies at x (n, 3), q (n, 4), velocities v (n, 3), world angular momenta ell (n, 3)."""

    def __init__(self, scene: Scene, time_step: float) -> None:
        self.scene, self.h = scene, time_step
        self.index = {body.name: i for i, body in enumerate(scene.bodies)}
        rigid = [b if isinstance(b, RigidBody) else None for b in scene.bodies]
        self.free = np.array([isinstance(b, Particle) or b.motion == "dynamic" for b in scene.bodies])
        self.mass = np.array([float(b.mass or 1.0) for b in scene.bodies])
        self.inertia = np.array([(b.inertia if b and b.inertia else (1.0, 1.0, 1.0)) for b in rigid])
        self.x = np.array([b.position for b in scene.bodies])
        self.q = np.array([b.orientation if b else (1.0, 0.0, 0.0, 0.0) for b in rigid])
        self.v = np.array([b.velocity for b in scene.bodies])
        omega = np.array([b.angular_velocity if b else (0.0, 0.0, 0.0) for b in rigid])
        self.ell = np.array([self.world_inertia(i) @ omega[i] for i in range(len(rigid))])
        self.joints = [Placed(constraint, scene, self) for constraint in scene.constraints]
        self.impulses = [np.zeros(joint.constraint.rows) for joint in self.joints]
        self.loads = [np.zeros(6) for _ in self.joints]

    def pose(self, body: int, x: Array, q: Array) -> tuple[Array, Array]:
        return (x[body], q[body]) if body >= 0 else (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))

    def world_inertia(self, body: int) -> Array:
        r = rotation(self.q[body])
        return r @ np.diag(self.inertia[body]) @ r.T

    def angular_velocity(self) -> Array:
        return np.array([np.linalg.solve(self.world_inertia(i), ell) for i, ell in enumerate(self.ell)])

    def jacobian(self, function: Any, of: list[int]) -> Array:
        """(rows, 6 n): derivative of function(x, q, self) by displacements and world rotations of the bodies that it is a
        function of, complex steps."""
        found: dict[int, Array] = {}
        for body in of:
            for degree in range(6 if body >= 0 else 0):
                x, q = self.x.astype(complex), self.q.astype(complex)
                if degree < 3:
                    x[body, degree] += 1j * TINY
                else:
                    turn = np.zeros(4, dtype=complex)
                    turn[degree - 2] = 0.5j * TINY
                    q[body] = q[body] + product(turn, self.q[body])
                found[6 * body + degree] = function(x, q, self).imag / TINY
        jacobian = np.zeros((len(next(iter(found.values()))), 6 * len(self.x)))
        jacobian[:, list(found)] = np.array(list(found.values())).T
        return jacobian

    def force(self) -> Array:
        """(n, 6) N and N m."""
        total = np.zeros((len(self.x), 6))
        total[:, :3] = self.mass[:, None] * np.array(self.scene.gravity)
        for force in self.scene.forces:
            if isinstance(force, CentralGravity):
                r = self.x - np.array(force.centre)
                total[:, :3] -= (
                    force.strength * self.mass[:, None] * r / np.linalg.norm(r, axis=1)[:, None] ** 3
                )
            elif isinstance(force, Load):
                total[self.index[force.body]] += (*force.force, *force.torque)
            elif isinstance(force, Spring):
                x = [self.x[self.index[e]] if isinstance(e, str) else np.array(e) for e in force.between]
                v = [self.v[self.index[e]] if isinstance(e, str) else np.zeros(3) for e in force.between]
                d, length = x[1] - x[0], np.linalg.norm(x[1] - x[0])
                pull = force.stiffness * (1.0 - force.rest_length / length) * d
                pull = pull + force.viscosity * ((v[1] - v[0]) @ d) / length**2 * d
                for end, sign in zip(force.between, (1.0, -1.0), strict=True):
                    if isinstance(end, str):
                        total[self.index[end], :3] += sign * pull
        return total

    def rows(self) -> list[tuple[Array, Array, Array, Array]]:
        """(G, g, eps, tau) of every constraint, then of every joint spring."""
        found = []
        for joint in self.joints:
            c, default = joint.constraint, 2.0 * self.h
            count = c.rows
            eps = np.broadcast_to(np.array(c.compliance, dtype=float), count)
            tau = np.broadcast_to(np.array(default if c.damping is None else c.damping, dtype=float), count)
            found.append(
                (
                    self.jacobian(joint.violation, joint.bodies),
                    joint.violation(self.x, self.q, self),
                    eps,
                    tau,
                )
            )
        for joint in self.joints:
            c = joint.constraint
            if isinstance(c, AxialJoint) and c.spring is not None:
                g = joint.coordinate(self.x, self.q, self) - c.spring.rest
                tau = 2.0 * self.h if c.spring.damping is None else c.spring.damping
                eps = np.array([1.0 / c.spring.stiffness])
                found.append((joint.rate(self), g, eps, np.array([tau])))
        return found

    def step(self) -> None:
        h, n = self.h, 6 * len(self.x)
        mass = np.zeros((n, n))
        for i in range(len(self.x)):
            mass[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = self.mass[i] * np.eye(3)
            mass[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = self.world_inertia(i)
        velocity = np.hstack([self.v, self.angular_velocity()]).ravel()
        push = self.force().ravel()
        free = np.repeat(self.free, 6)
        rows, motors = self.rows(), []
        for joint in self.joints:
            c = joint.constraint
            if isinstance(c, AxialJoint) and c.motor is not None:
                motors.append((joint.rate(self), c.motor.speed))
        g_all = [row[0] for row in rows] + [motor[0] for motor in motors]
        jacobian = np.vstack(g_all) if g_all else np.zeros((0, n))
        softness, right = [], []
        for g_rows, g, eps, tau in rows:
            upsilon = 1.0 / (1.0 + 4.0 * tau / h)
            softness.append(4.0 * eps * upsilon / h**2)
            right.append(upsilon * (g_rows @ velocity - 4.0 / h * g))
        right += [np.array([speed]) for _, speed in motors]
        softness += [np.zeros(1)] * len(motors)
        count = len(jacobian)
        matrix = np.zeros((n + count, n + count))
        matrix[:n, :n] = np.where(np.outer(free, free), mass, np.eye(n))
        matrix[:n, n:] = -jacobian.T * free[:, None]
        matrix[n:, :n] = jacobian
        matrix[n:, n:] = np.diag(np.concatenate(softness)) if count else 0.0
        top = np.where(free, mass @ velocity + h * push, velocity)
        solved = np.linalg.solve(matrix, np.concatenate([top, *right]))
        impulse = solved[n:]
        self._remember(jacobian, impulse)
        change = (h * push + jacobian.T @ impulse).reshape(-1, 6)
        after = solved[:n].reshape(-1, 6)
        for i in range(len(self.x)):
            self.v[i] = after[i, :3]
            self.x[i] = self.x[i] + h * self.v[i]
            if self.free[i] and isinstance(self.scene.bodies[i], RigidBody):
                self.ell[i] = self.ell[i] + change[i, 3:]
                self._turn(i)

    def _remember(self, jacobian: Array, impulse: Array) -> None:
        """Impulses of each constraint, and the load (force, torque at the joint) on its second body."""
        self.impulses, self.loads, row = [], [], 0
        owners = [(joint, joint.constraint.rows) for joint in self.joints]
        for drive in ("spring", "motor"):
            owners += [(joint, 1) for joint in self.joints if getattr(joint.constraint, drive, None)]
        totals = {id(joint): np.zeros(jacobian.shape[1]) for joint in self.joints}
        for joint, count in owners:
            totals[id(joint)] += jacobian[row : row + count].T @ impulse[row : row + count] / self.h
            if len(self.impulses) < len(self.joints):
                self.impulses.append(impulse[row : row + count])
            row += count
        for joint in self.joints:
            second, first = joint.bodies[1], joint.bodies[0]
            body, sign = (second, 1.0) if second >= 0 else (first, -1.0)
            load = sign * totals[id(joint)][6 * body : 6 * body + 6]
            if isinstance(joint.constraint, Joint):
                arm = joint.points(self.x, self.q, self)[1] - self.x[body]
                load[3:] -= cross(arm, load[:3])
            self.loads.append(load)

    def _turn(self, body: int) -> None:
        """Euler's equations over a step from the present world momentum."""
        p = rotation(self.q[body]).T @ self.ell[body]
        q = product(self.q[body], free_turn(self.inertia[body], self.h, p))
        self.q[body] = q / np.linalg.norm(q)


def free_turn(moments: Array, h: float, p: Array) -> Array:
    """Quaternion (w, x, y, z) by which a free body with angular momentum `p` [N m s, principal axes] turns in h [s].

    Power series of q' = ½ q (0, w), p' = p × w, w = p/I, in pieces of at most a quarter of a radian.
    """
    pieces = 1 + int(4.0 * abs(h) * float(np.linalg.norm(p / moments)))
    t, whole, orders = h / pieces, np.array([1.0, 0.0, 0.0, 0.0]), 24
    powers = t ** np.arange(orders + 1)
    for _ in range(pieces):
        ps, ws, qs = (np.zeros((orders + 1, count)) for count in (3, 3, 4))
        ps[0], ws[0], qs[0, 0] = p, p / moments, 1.0
        for n in range(orders):
            before = ws[n::-1]  # of the product of two series, the terms of order n: all pairs at once
            (_, a01, a02), (a10, _, a12), (a20, a21, _) = (ps[: n + 1].T @ before).tolist()
            (s0, s1, s2), (b00, b01, b02), (b10, b11, b12), (b20, b21, b22) = (
                qs[: n + 1].T @ before
            ).tolist()
            ps[n + 1] = np.array([a12 - a21, a20 - a02, a01 - a10]) / (n + 1)
            ws[n + 1] = ps[n + 1] / moments
            turned = [-b00 - b11 - b22, s0 + b12 - b21, s1 + b20 - b02, s2 + b01 - b10]
            qs[n + 1] = 0.5 * np.array(turned) / (n + 1)
        p, turn = powers @ ps, powers @ qs
        whole = product(whole, turn / np.linalg.norm(turn))
    return np.asarray(whole)


def momentum_of_turn(moments: Array, h: float, turn: Array) -> Array:
    """∂L/∂φ of L = φ·I φ/2h for a rotation vector φ [N m s, principal axes]: what compositions in joint coordinates turn by."""
    size = float(np.linalg.norm(turn[1:]))
    angle = 2.0 * np.arctan2(size, turn[0])
    phi = turn[1:] * (angle / size if size else 2.0)
    kappa = (1.0 - 0.5 * angle / np.tan(0.5 * angle)) / angle**2 if angle else 1.0 / 12.0
    spin = moments * phi
    return (spin + 0.5 * cross(phi, spin) + kappa * cross(phi, cross(phi, spin))) / h
