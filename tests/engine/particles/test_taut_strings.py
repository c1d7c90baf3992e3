"""String stiffness holds a chain with a heavy end where the plain step must explode, and changes no equilibrium."""

from __future__ import annotations

import numpy as np
import pytest

from spook_tracker.engine import (
    PLAIN,
    Distance,
    Final,
    KineticEnergy,
    MaximumAbsolute,
    Method,
    Particle,
    Position,
    Scene,
    Velocity,
    Violation,
    simulate,
)

STRING = Method(string_stiffness=True)
LINKS, LENGTH, STEP = 10, 0.1, 1 / 60


def hanging(ratio: float, sideways: float = 0.1) -> Scene:
    """Ten links of 0.1 m and 1 kg, the last one `ratio` times as heavy, every second body pushed sideways."""
    bodies = [
        Particle(
            name=f"{i}",
            mass=ratio if i == LINKS - 1 else 1.0,
            position=(0.0, 0.0, -LENGTH * (i + 1)),
            velocity=(sideways * (i % 2), 0.0, 0.0) if i < LINKS - 1 else (0.0, 0.0, 0.0),
        )
        for i in range(LINKS)
    ]
    rows = [
        Distance(
            name=f"row {i}",
            between=(f"{i - 1}" if i else (0.0, 0.0, 0.0), f"{i}"),
            rest_length=LENGTH,
            compliance=1e-13,
            damping=STEP,
        )
        for i in range(LINKS)
    ]
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -9.81))


def fastest(ratio: float, method: Method) -> float:
    """The largest speed [m/s] within 20 s; beyond 1 m/s the chain made energy."""
    observe = {"speed": MaximumAbsolute(quantity=Velocity())}
    return float(
        simulate(hanging(ratio), time_step=STEP, duration=20.0, method=method, observe=observe)["speed"].max()
    )


def test_the_plain_step_holds_below_its_limit_and_explodes_above() -> None:
    """The limit is T h²/(m l) = 1, here a mass ratio of 36."""
    assert fastest(20.0, PLAIN) < 1.0
    assert fastest(200.0, PLAIN) > 10.0


@pytest.mark.parametrize("ratio", [200.0, 1e4, 1e6, 1e9])
def test_stiff_strings_hold_every_mass_ratio(ratio: float) -> None:
    assert fastest(ratio, STRING) < 1.0


def test_a_chain_at_rest_stays_at_rest_and_carries_its_weight() -> None:
    """g = −eps F for every row, whatever the stepper does to the transverse motion."""
    result = simulate(
        hanging(1e6, sideways=0.0),
        time_step=STEP,
        duration=20.0,
        method=STRING,
        observe={
            "stretch": Final(quantity=Violation()),
            "kinetic": Final(quantity=KineticEnergy()),
            "aside": MaximumAbsolute(quantity=Position()),
        },
    )
    weight = 9.81 * (1e6 + np.arange(LINKS - 1, -1, -1))

    assert result["stretch"] == pytest.approx(1e-13 * weight, rel=1e-3)
    assert result["kinetic"] < 1e-9
    assert result["aside"][:, 0].max() == 0.0


def test_slack_and_light_chains_hardly_notice() -> None:
    """The correction is of second order in the time step."""
    ends = []
    for step in (1 / 500, 1 / 1000):
        plain, string = (
            simulate(hanging(1.0), time_step=step, duration=1.0, method=method).final_state["9"][:3]
            for method in (PLAIN, STRING)
        )
        ends.append(float(np.abs(plain - string).max()))

    assert ends[1] < 0.4 * ends[0]
    assert ends[0] < 1e-3
