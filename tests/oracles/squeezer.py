"""Andrews' squeezing mechanism in its plane, step by step, written from its rows and nothing of the engine."""

from __future__ import annotations

import numpy as np

from spook_tracker.scalar_tests.multibody import squeezer as s

HOOK = np.array([0.02, -0.018])  # m, D from B on the triangle
BODIES = ("K1", "K2", "K3", "K4", "K5", "K6", "K7")


def ended(steps: int, torque: float = s.TORQUE) -> np.ndarray:
    """Turns [rad] of crank, triangle and both rockers after s.DURATION in so many steps.

    Twenty rows of ten hinges and one of the spring: (G M⁻¹ Gᵀ + Σ) λ = −4 Υ g/h + Υ G v − G (v + h M⁻¹ f),
    Υ = 1/(1 + 4 τ/h), Σ = 4 ε Υ/h².
    """
    h = s.DURATION / steps
    built = s.scene(h)
    names = {body.name: k for k, body in enumerate(built.bodies)}
    place = np.array([(*body.position[:2], 0.0) for body in built.bodies])
    weight = np.array([(body.mass, body.mass, body.inertia[2]) for body in built.bodies]).ravel()  # type: ignore[union-attr]
    ends, arms, marks, softs, damps = [], [], [], [], []
    for joint in built.constraints:
        if joint.name == "spring":
            continue
        pair = tuple(names.get(name, -1) for name in joint.between)  # type: ignore[arg-type]
        at = np.array(joint.at[:2])  # type: ignore[union-attr, index]
        ends.append(pair)
        arms.append([at - (place[k, :2] if k >= 0 else 0.0) for k in pair])
        marks.append(at)
        softs += [s.COMPLIANCE] * 2
        damps += [2.0 * h] * 2
    hook = s.B + s._turn(s.START["triangle"]) @ HOOK - place[2, :2]
    soft, damp = np.array([*softs, 1.0 / s.STIFFNESS]), np.array([*damps, 0.0])
    upsilon = 1.0 / (1.0 + 4.0 * damp / h)
    give = np.diag(4.0 * soft * upsilon / h**2)
    push = np.zeros(21)
    push[2] = h * torque
    v, size = np.zeros(21), len(soft)
    for _ in range(steps):
        gap, rows = np.zeros(size), np.zeros((size, 21))
        for k, (pair, two) in enumerate(zip(ends, arms, strict=True)):
            points = [
                mark if body < 0 else place[body, :2] + s._turn(place[body, 2]) @ arm
                for body, arm, mark in zip(pair, two, (marks[k], marks[k]), strict=True)
            ]
            gap[2 * k : 2 * k + 2] = points[1] - points[0]
            for sign, body in zip((-1.0, 1.0), pair, strict=True):
                if body >= 0:  # a reaction acts on both bodies at the second one's point
                    x, y = points[1] - place[body, :2]
                    rows[2 * k : 2 * k + 2, 3 * body : 3 * body + 3] = sign * np.array(
                        [[1, 0, -y], [0, 1, x]]
                    )
        arm = s._turn(place[2, 2]) @ hook
        along = place[2, :2] + arm - s.C
        length = np.linalg.norm(along)
        gap[-1], along = length - s.REST, along / length
        rows[-1, 6:9] = (*along, arm[0] * along[1] - arm[1] * along[0])
        free = v + push / weight
        right = -4.0 / h * upsilon * gap + upsilon * (rows @ v) - rows @ free
        v = free + (rows.T @ np.linalg.solve((rows / weight) @ rows.T + give, right)) / weight
        place += h * v.reshape(7, 3)
    return place[[0, 2, 4, 6], 2]


def error(steps: int) -> float:
    """The library's error of the four angles."""
    found = np.array(list(s.START.values())) + ended(steps)
    wanted = np.array(list(s.END.values()))
    return float(np.sqrt(np.mean(((found - wanted) / np.abs(wanted)) ** 2)))
