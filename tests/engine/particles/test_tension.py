"""Tension that a composition's stages are too long for: it is taken in parts, and what still makes energy is not told as completed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    Distance,
    Energy,
    Method,
    Particle,
    Position,
    Result,
    Scene,
    Spring,
    Trace,
    simulate,
)

DOWN = (0.0, 0.0, -9.81)  # m/s²
LINKS = 10  # of .1 m
SPEED = 3.0  # m/s


def chain(load: float) -> Scene:
    """Light particles of 1 kg on rods with a load [kg] at the end, thrown sideways."""
    names = [f"{k}" for k in range(1, LINKS + 1)]
    bodies = [
        Particle(
            name=name,
            mass=load if name == names[-1] else 1.0,
            position=(0.0, 0.0, -0.1 * k),
            velocity=(SPEED if name == names[-1] else 0.0, 0.0, 0.0),
        )
        for k, name in enumerate(names, start=1)
    ]
    ends = [(0.0, 0.0, 0.0), *names]
    rods = [
        Distance(name=f"to {b}", between=(a, b), compliance=0.0) for a, b in zip(ends, names, strict=False)
    ]
    return Scene(bodies=bodies, constraints=rods, gravity=DOWN)


def thrown(load: float, steps: int, composition: str) -> tuple[Result, float]:
    """Two seconds of it; and how much its energy rises, over the throw's."""
    result = simulate(
        chain(load),
        time_step=1.0 / steps,
        duration=2.0,
        method=Method(composition=composition),
        observe={"energy": Trace(quantity=Energy())},
    )
    energy = result["energy"].ravel()
    return result, float((energy - energy[0]).max()) / (0.5 * load * SPEED**2)


@pytest.mark.parametrize(
    ("load", "steps", "composition"),
    [(100.0, 60, "order4"), (100.0, 240, "order4"), (1e4, 240, "order4"), (1e3, 60, "order6")],
)
def test_steps_that_are_too_long_for_the_tension_are_taken_in_parts(
    load: float, steps: int, composition: str
) -> None:
    """In whole steps they won 56, 56, 100 and 37 % of the throw."""
    result, gained = thrown(load, steps, composition)

    assert result.completed
    assert gained < 1e-3
    assert result.counters["halved_steps"] > 0


def test_what_a_spring_makes_of_steps_that_are_too_long_for_it_ends_unsettled() -> None:
    """A bob on a rod beside a spring with 200 rad/s, at 60 steps a second: springs do not part steps."""
    bob = Particle(name="bob", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "bob"), compliance=0.0)
    spring = Spring(name="spring", between=((1.0, 0.0, 1.0), "bob"), stiffness=4e4, rest_length=1.01)
    result = simulate(
        Scene(bodies=(bob,), constraints=(rod,), forces=(spring,)),
        time_step=1 / 60,
        steps=12,
        method=Method(composition="order4"),
    )

    assert result.status == "unsettled"
    assert "out of nothing" in result.failure
    assert result.failed_body == "bob"


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize(("light", "speed"), [(0.005, 2.5), (0.02, 0.1), (0.2, 2.5)])
def test_a_load_that_rods_let_fall_is_told_with_what_holds_it(light: float, speed: float, half: bool) -> None:
    """5 kg on nine light particles, 5 m of rods: what completes keeps the load within them."""
    names = [f"{k}" for k in range(1, LINKS + 1)]
    bodies = [
        Particle(name=n, mass=light, position=(0.0, 0.0, -0.5 * k)) for k, n in enumerate(names, start=1)
    ]
    bodies[-1] = replace(bodies[-1], mass=5.0, velocity=(speed, 0.0, 0.0))
    rods = [
        Distance(name=f"to {b}", between=(a, b), compliance=0.0)
        for a, b in zip([(0.0, 0.0, 0.0), *names], names, strict=False)
    ]

    def fell(string_stiffness: bool) -> tuple[Result, float]:
        run = simulate(
            Scene(bodies=tuple(bodies), constraints=tuple(rods), gravity=DOWN),
            time_step=1 / 60,
            duration=4.0,
            method=Method(corrections=2 * half, half_step_velocities=half, string_stiffness=string_stiffness),
            observe={"place": Trace(quantity=Position(names[-1]))},
        )
        return run, float(np.linalg.norm(run["place"], axis=1).max()) - 5.0

    run, off = fell(False)
    assert run.completed == (light == 0.2) == (off < 0.01)
    if not run.completed:
        assert run.status == "unsettled" and "string_stiffness=True" in run.failure
    cured, off = fell(True)
    assert cured.completed and off < 0.01
