"""The beam in pieces, and its closed form."""

from __future__ import annotations

import numpy as np

from spook_tracker import engine

LENGTH = 12.0  # m
COUNT = 60
WIDTH, HEIGHT = 0.120, 0.114  # m
DENSITY = 19.9  # kg/m
MODULUS = 210e9  # Pa
SECOND_MOMENT = 2.305e-6  # m⁴, HEA 120 about its weak axis
STIFFNESS = MODULUS * SECOND_MOMENT  # EI, N m²
GRAVITY = 9.81  # m/s²
LOAD = 10.0 * GRAVITY  # N at the tip
SMALL = 1e-3  # fraction of the load at which the large-deflection terms fall below 1e-9
TIME_STEP = 1.0 / 60.0  # s
DAMPING = 0.5  # s, near critical for the first mode; the static answer does not depend on it
LADDER_COUNT = 20
COUNTS = (10, 20, 40, 80, 160, 320)
TIP = LOAD * LENGTH**3 / (3.0 * STIFFNESS)  # m, .11673505
LARGE_DEFLECTION = -4.0 / 35.0 * (LOAD * LENGTH**2 / STIFFNESS) ** 2  # of the tip, leading order


def scene(
    count: int = COUNT, load: float = LOAD, *, self_weight: bool = False, damping: float = DAMPING
) -> engine.Scene:
    """`count` boxes locked in a row to the wall at x = 0, with a load [N] at the tip."""
    piece = LENGTH / count
    boxes = tuple(
        engine.RigidBody(
            name=f"box {i + 1}",
            mass=DENSITY * piece,
            shape=engine.Box((piece, WIDTH, HEIGHT)),
            position=((i + 0.5) * piece, 0.0, 0.0),
        )
        for i in range(count)
    )

    def lock(name: str, first: str, second: str, at: float, length: float) -> engine.Lock:
        shear, turn = length**3 / (12.0 * STIFFNESS), length / STIFFNESS
        compliance = (0.0, shear, shear, turn, turn, turn)
        return engine.Lock(
            name=name, between=(first, second), at=(at, 0.0, 0.0), compliance=compliance, damping=damping
        )

    locks = (
        lock("wall", engine.WORLD, "box 1", 0.25 * piece, 0.5 * piece),
        *(lock(f"lock {i}", f"box {i}", f"box {i + 1}", i * piece, piece) for i in range(1, count)),
    )
    # The load acts at the tip, half a piece beyond the last centre: a force there and its moment.
    tip = engine.Load(
        name="load", body=f"box {count}", force=(0.0, 0.0, -load), torque=(0.0, 0.5 * piece * load, 0.0)
    )
    gravity = (0.0, 0.0, -GRAVITY if self_weight else 0.0)
    return engine.Scene(bodies=boxes, constraints=locks, forces=(tip,), gravity=gravity, contacts=False)


def deflection(x: np.ndarray, load: float = LOAD) -> np.ndarray:
    """Euler-Bernoulli deflection [m] at x [m], downwards: eq 3.20 of the thesis."""
    return np.asarray(load * x**2 * (3.0 * LENGTH - x) / (6.0 * STIFFNESS))
