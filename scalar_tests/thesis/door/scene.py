"""The thesis' door on hinges: its scene, the hinge forces of a run, and the split of least norm."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

from ... import case

SIZE = (1.0, 0.06, 2.0)  # m
MASS = 45.0  # kg
GRAVITY = 10.0  # m/s²
COMPLIANCE = 1e-13  # m/N and rad/(N m)
PRINTED_DAMPING = 1e-13  # s, as printed in the thesis: next to nothing
TIME_STEP = 1.0 / 60.0  # s


def hinge_points(count: int) -> np.ndarray:
    """(count, 3) hinge points [m] from the door's centre: on its edge, evenly spaced over the height."""
    heights = SIZE[2] * ((np.arange(count) + 0.5) / count - 0.5)
    return np.column_stack([np.full(count, -0.5 * SIZE[0]), np.zeros(count), heights])


def scene(
    count: int = 2, mass: float = MASS, damping: float = PRINTED_DAMPING, compliance: float = COMPLIANCE
) -> engine.Scene:
    """The door at rest, hung on `count` hinges with vertical axes."""
    door = engine.RigidBody(name="door", mass=mass, shape=engine.Box(SIZE), position=(0.0, 0.0, 0.0))
    hinges = tuple(
        engine.Hinge(
            name=f"hinge {i + 1}",
            between=(engine.WORLD, "door"),
            at=(point[0], point[1], point[2]),
            axis=(0.0, 0.0, 1.0),
            compliance=compliance,
            damping=damping,
        )
        for i, point in enumerate(hinge_points(count).tolist())
    )
    return engine.Scene(bodies=(door,), constraints=hinges, gravity=(0.0, 0.0, -GRAVITY))


def forces(
    simulate: case.Simulate, steps: int, count: int = 2, time_step: float = TIME_STEP, **options: float
) -> np.ndarray:
    """(steps, count, 6) force [N] and torque [N m] of each hinge on the door, for steps 1 … steps."""
    observe = {
        f"hinge {i + 1}": engine.Trace(quantity=engine.ConstraintForce(f"hinge {i + 1}"), first=1)
        for i in range(count)
    }
    result = simulate(scene(count, **options), time_step=time_step, steps=steps, observe=observe)
    return np.stack([result[name] for name in observe], axis=1)


def least_norm_forces(count: int, mass: float = MASS) -> np.ndarray:
    """(count, 6) hinge forces [N] and torques [N m] of least norm that hold the door (pseudo-inverse)."""
    columns = []
    for point in hinge_points(count):
        push = np.eye(3)
        turn = np.cross(np.broadcast_to(point, (3, 3)), push).T  # torque about the centre of each unit force
        columns.append(
            np.block([[push, np.zeros((3, 2))], [turn, np.eye(3)[:, :2]]])
        )  # axis free: no torque z
    balance = np.hstack(columns)  # (6, 5 count)
    weight = np.array([0.0, 0.0, mass * GRAVITY, 0.0, 0.0, 0.0])
    rows = (np.linalg.pinv(balance, rcond=1e-12) @ weight).reshape(count, 5)
    return np.hstack([rows, np.zeros((count, 1))])


def weight_error(held: np.ndarray, mass: float = MASS) -> np.ndarray:
    """ΔFz [%] of the weight per step, eq 3.4 of the thesis."""
    weight = mass * GRAVITY
    return np.asarray(100.0 * (held[:, :, 2].sum(axis=1) - weight) / weight)
