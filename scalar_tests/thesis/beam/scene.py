"""The thesis' beam of locked boxes on two piles: its scene, what is read from a run, and its statics."""

from __future__ import annotations

import itertools

import numpy as np

from spook_tracker import engine

from ... import case

SIZE = (0.125, 0.1, 0.1)  # m, one box
MASS = 2.5  # kg, one box
GRAVITY = 9.81  # m/s²
COUNT = 80
STEPS = 1000
WINDOW = 50  # steps, the last of the run
TIME_STEP = 1.0 / 60.0  # s
PILE_RADIUS = 0.05  # m
SAG_COMPLIANCE = 1e-12  # m/N and rad/(N m)
SAG = 2.134e-7  # m, for 80 boxes with SAG_COMPLIANCE in every lock row; see `sag_of_compliant_beam`


def _pile(name: str, x: float, support: str) -> engine.RigidBody:
    """A fixed pile whose top touches the beam's underside at z = 0: in a point, along an edge, or flat."""
    if support == "corners":
        size = (SIZE[0], SIZE[1], 2.0 * PILE_RADIUS)
        return engine.RigidBody(
            name=name, motion="static", shape=engine.Box(size), position=(x, 0.0, -PILE_RADIUS)
        )
    if support == "edge":
        along_y = (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)  # the capsule's own axis is z
        shape = engine.Capsule(PILE_RADIUS, 0.5 * SIZE[1])
        return engine.RigidBody(
            name=name, motion="static", shape=shape, position=(x, 0.0, -PILE_RADIUS), orientation=along_y
        )
    return engine.RigidBody(
        name=name, motion="static", shape=engine.Sphere(PILE_RADIUS), position=(x, 0.0, -PILE_RADIUS)
    )


def scene(
    count: int = COUNT,
    *,
    time_step: float = TIME_STEP,
    compliance: float = 0.0,
    damping: float | None = None,
    support: str = "centre",
    push: float = 0.0,
) -> engine.Scene:
    """`count` boxes in a row along x, locked to each other, on piles under the centres of the end boxes.

    The locks' damping [s] is two time steps unless given. `push` is the middle box's speed upwards [m/s]; a
    pushed beam's boxes do not touch each other, so that only its locks and piles act.
    """
    smooth = engine.Material(friction=0.0)
    boxes = [
        engine.RigidBody(
            name=f"box {i + 1}",
            mass=MASS,
            shape=engine.Box(SIZE),
            position=((i + 0.5) * SIZE[0], 0.0, 0.5 * SIZE[2]),
            velocity=(0.0, 0.0, push if i == count // 2 else 0.0),
            material=smooth,
        )
        for i in range(count)
    ]
    locks = [
        engine.Lock(
            name=f"lock {i + 1}",
            between=(boxes[i].name, boxes[i + 1].name),
            at=((i + 1) * SIZE[0], 0.0, 0.5 * SIZE[2]),
            compliance=compliance,
            damping=2.0 * time_step if damping is None else damping,
        )
        for i in range(count - 1)
    ]
    piles = [
        _pile("left pile", boxes[0].position[0], support),
        _pile("right pile", boxes[-1].position[0], support),
    ]
    names = [box.name for box in boxes] if push else []
    return engine.Scene(
        bodies=(*boxes, *piles),
        constraints=tuple(locks),
        gravity=(0.0, 0.0, -GRAVITY),
        no_contact=tuple(itertools.combinations(names, 2)),
    )


def heights(
    simulate: case.Simulate,
    count: int = COUNT,
    time_step: float = TIME_STEP,
    *,
    compliance: float = 0.0,
    support: str = "centre",
) -> np.ndarray:
    """Height deviation [m] of each box: the one of largest magnitude over the last WINDOW of STEPS steps."""
    first = STEPS - WINDOW + 1
    built = scene(count, time_step=time_step, compliance=compliance, support=support)
    observe = {
        "highest": engine.Maximum(quantity=engine.Position(), first=first, from_start=True),
        "lowest": engine.Minimum(quantity=engine.Position(), first=first, from_start=True),
    }
    result = simulate(built, time_step=time_step, steps=STEPS, observe=observe)
    highest, lowest = result["highest"][:count, 2], result["lowest"][:count, 2]
    return np.asarray(np.where(np.abs(highest) > np.abs(lowest), highest, lowest))


def deviation(
    simulate: case.Simulate, count: int = COUNT, time_step: float = TIME_STEP, *, support: str = "centre"
) -> float:
    """Deepest height deviation over the beam's length [%], signed: negative hangs."""
    each = heights(simulate, count, time_step, support=support)
    return 100.0 * float(each[np.argmax(np.abs(each))]) / (count * SIZE[0])


def sag_of_compliant_beam(count: int = COUNT, compliance: float = SAG_COMPLIANCE) -> float:
    """Sag [m] of the middle of a chain of rigid pieces whose joints alone give way (statics, closed form).

    A lock at x carries the moment M(x) and the shear V(x) of a simply supported beam of weights at the box
    centres, and gives way by c M in angle and c V in height: unit-load theorem over the locks.
    """
    length, weight = SIZE[0], MASS * GRAVITY
    centres = (np.arange(count) + 0.5) * length
    joints = (np.arange(count - 1) + 1.0) * length
    left, right = centres[0], centres[-1]

    def moment_and_shear(loads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        reaction = np.sum(loads * (right - centres)) / (right - left)
        before = centres[None, :] < joints[:, None]
        shear = reaction - (before * loads).sum(axis=1)
        moment = reaction * (joints - left) - (before * loads * (joints[:, None] - centres)).sum(axis=1)
        return moment, shear

    moment, shear = moment_and_shear(np.full(count, weight))
    deepest = 0.0
    for middle in (count // 2, (count - 1) // 2):
        unit = np.zeros(count)
        unit[middle] = 1.0
        unit_moment, unit_shear = moment_and_shear(unit)
        deepest = max(deepest, compliance * float(moment @ unit_moment + shear @ unit_shear))
    return deepest
