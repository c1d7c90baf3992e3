"""Wires: pulleys, slack, the blow of a rope that snaps taut, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    ConstraintForce,
    Energy,
    Final,
    MaximumAbsolute,
    Method,
    Momentum,
    Particle,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Velocity,
    Violation,
    Wire,
    simulate,
)
from tests.scenes.coupling import H, Z, masses
from tests.scenes.seen import finals, traces


@pytest.mark.parametrize("solver", ["direct", "iterative"])
def test_atwood(solver: Any) -> None:
    observe = traces(pull=ConstraintForce("wire"), v=Velocity())
    result = simulate(
        masses(), time_step=H, steps=60, method=Method(solver=solver, iterations=500), observe=observe
    )
    times = H * np.arange(61)

    np.testing.assert_allclose(result["v"][:, 0, 2], -5.0 * times, rtol=0, atol=1e-10)
    np.testing.assert_allclose(result["v"][:, 1, 2], 5.0 * times, rtol=0, atol=1e-10)
    np.testing.assert_allclose(result["pull"][1:], 15.0, rtol=1e-10)


def test_a_tackle_holds_n_times_its_pull() -> None:
    """Four strands carry the block: 40 kg against 10 kg."""
    block = RigidBody(name="block", mass=40.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    weight = Particle(name="weight", mass=10.0, position=(4.0, 0.0, 0.0))
    eyes = ((-0.3, 0.0), (-0.1, 0.1), (0.1, 0.2), (0.3, 0.3))
    through: list[tuple[str, tuple[float, float, float]]] = [(WORLD, (-0.3, 0.0, 3.0))]
    for (down, _), up in zip(eyes[::2], (0.1, 4.0), strict=True):
        through += [("block", (down, 0.0, 0.0)), (WORLD, (down + 0.0, 0.0, 3.5))]
        if up < 4.0:
            continue
        through += [(WORLD, (4.0, 0.0, 3.5))]
    wire = Wire(name="wire", through=(*through, ("weight", (4.0, 0.0, 0.0))), compliance=0.0)
    guide = Prismatic(name="guide", between=(WORLD, "block"), axis=Z, compliance=0.0)
    scene = Scene(bodies=(block, weight), constraints=(wire, guide), gravity=(0.0, 0.0, -10.0))
    # As many strands as end on the block, each all but vertical: the force is the sum of their slopes.
    points = [np.array(point) for _, point in wire.through]
    slope = sum(
        abs(b[2] - a[2]) / np.linalg.norm(b - a)
        for (first, _), (second, _), a, b in zip(
            wire.through, wire.through[1:], points, points[1:], strict=False
        )
        if "block" in (first, second)
    )
    observe = finals(pull=ConstraintForce("wire"))
    result = simulate(scene, time_step=1e-4, steps=1, observe=observe)
    # M a = n S − M g, m n a = m g − S: one degree of freedom.
    a = (slope * 10.0 * 10.0 - 40.0 * 10.0) / (40.0 + 10.0 * slope**2)

    assert float(result["pull"]) == pytest.approx(40.0 * (a + 10.0) / slope, rel=1e-6)


def test_a_slack_rope_is_not_there() -> None:
    scene = Scene(
        bodies=(Particle(name="stone", mass=2.0, position=(0.0, 0.0, 0.0)),),
        constraints=(
            Wire(name="rope", through=((WORLD, (0.0, 0.0, 1.0)), ("stone", (0.0, 0.0, 0.0))), length=9.0),
        ),
        gravity=(0.0, 0.0, -10.0),
    )
    free = Scene(bodies=scene.bodies, gravity=scene.gravity)
    seen = [
        simulate(s, time_step=H, steps=100, observe=traces(x=Position("stone")))["x"] for s in (scene, free)
    ]

    np.testing.assert_allclose(seen[0], seen[1], rtol=0, atol=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("phase", [0.0, 0.25, 0.7])
def test_a_rope_that_snaps_taut_is_an_impact(restitution: float, phase: float) -> None:
    """Momentum stays, the parting speed u becomes −e u, ½ µ u² (1 − e²) is lost."""
    one, two, u = 3.0, 2.0, 4.0
    scene = Scene(
        bodies=(
            Particle(name="one", mass=one, position=(0.0, 0.0, 0.0)),
            Particle(name="two", mass=two, position=(1.0, 0.0, 0.0), velocity=(u, 0.0, 0.0)),
        ),
        constraints=(
            Wire(
                name="rope",
                through=(("one", (0.0, 0.0, 0.0)), ("two", (1.0, 0.0, 0.0))),
                length=2.0 + phase * u * H,
                restitution=restitution,
                compliance=0.0,
            ),
        ),
    )
    observe = traces(v=Velocity(), p=Momentum(), E=Energy(), g=Violation("rope"))
    result = simulate(scene, time_step=H, steps=30, observe=observe)
    v, reduced = result["v"], one * two / (one + two)
    apart = v[:, 1, 0] - v[:, 0, 0]

    assert apart[-1] == pytest.approx(-restitution * u, abs=1e-9)
    np.testing.assert_allclose(result["p"][:, 0], two * u, rtol=1e-12)
    assert result["E"][0] - result["E"][-1] == pytest.approx(
        0.5 * reduced * u**2 * (1 - restitution**2), abs=1e-9
    )
    assert result["g"].max() <= u * H + 1e-9
    assert np.all(np.diff(result["E"]) <= 1e-12)


def test_a_wire_that_may_not_go_slack_is_a_row_of_its_length() -> None:
    bodies = (Particle(name="one", mass=1.0, position=(0.0, 0.0, 0.0), velocity=(0.0, 1.0, 0.0)),)
    wire = Wire(
        name="rod", through=((WORLD, (1.0, 0.0, 0.0)), ("one", (0.0, 0.0, 0.0))), slack=False, compliance=0.0
    )
    observe = {"g": MaximumAbsolute(quantity=Violation("rod")), "T": Final(quantity=ConstraintForce("rod"))}
    result = simulate(Scene(bodies=bodies, constraints=(wire,)), time_step=1e-3, steps=500, observe=observe)

    assert float(result["g"]) < 1e-5
    assert float(result["T"]) == pytest.approx(1.0, rel=5e-3)  # m v²/r
