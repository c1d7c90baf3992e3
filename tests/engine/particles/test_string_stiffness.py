"""A taut chain is unstable where T h²/(m l) > 1; with string stiffness it is not, at nearly no cost elsewhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    AngularMomentum,
    ConstraintForce,
    Distance,
    Energy,
    Final,
    KineticEnergy,
    MaximumAbsolute,
    Method,
    Particle,
    Position,
    Result,
    Scene,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from tests.oracles.particles import Oracle
from tests.scenes.particle import KINDS
from tests.scenes.seen import traces

GRAVITY = 9.81  # m/s²
H = 1 / 60  # s
STRINGS = Method(string_stiffness=True)


LINKS = 10


def hanging(
    ratio: float, offset: float = 1e-6, length: float = 1.0, pushed: float = 0.0, damping: float | None = None
) -> Scene:
    """Links of 1 kg hanging straight but for a tiny zigzag, every second one `pushed` sideways; the last weighs `ratio` kg."""
    bodies = tuple(
        Particle(
            name=f"b{i}",
            mass=ratio if i == LINKS - 1 else 1.0,
            position=(offset * (-1.0) ** i, 0.0, -length * (1 + i)),
            velocity=(pushed * (i % 2) if i < LINKS - 1 else 0.0, 0.0, 0.0),
        )
        for i in range(LINKS)
    )
    rows = tuple(
        Distance(
            name=f"r{i}",
            between=((0.0, 0.0, 0.0) if i == 0 else f"b{i - 1}", f"b{i}"),
            compliance=1e-13,
            damping=damping,
        )
        for i in range(LINKS)
    )
    return Scene(bodies=bodies, constraints=rows, gravity=(0.0, 0.0, -GRAVITY))


def fastest(ratio: float, method: Method) -> float:
    """The largest speed [m/s] within 20 s of short links that are pushed; beyond 1 m/s the chain made energy."""
    scene, observe = hanging(ratio, 0.0, 0.1, 0.1, H), {"speed": MaximumAbsolute(quantity=Velocity())}
    return float(simulate(scene, time_step=H, duration=20.0, method=method, observe=observe)["speed"].max())


def hang(ratio: float, method: Method, duration: float = 20.0) -> Result:
    observe = {
        "x": MaximumAbsolute(quantity=Position()),
        "g": MaximumAbsolute(quantity=Violation()),
        "e": Trace(quantity=Energy()),
    }
    return simulate(hanging(ratio), time_step=H, duration=duration, method=method, observe=observe)


def sideways(result: Result) -> float:
    """Largest sideways excursion [m]; infinite if the run failed."""
    return float(result["x"][:, 0].max()) if result.completed else math.inf


def test_a_plain_chain_breaks_where_theory_says() -> None:
    """(M + a little) g h²/(m l) = 1 lies at 367: 350 hangs still, 380 does not. Links of 0.1 m, pushed, by a tenth of it."""
    assert sideways(hang(350.0, Method())) < 1e-4
    assert sideways(hang(380.0, Method())) > 1e-2
    assert fastest(20.0, Method()) < 1.0
    assert fastest(200.0, Method()) > 10.0


@pytest.mark.parametrize("ratio", [200.0, 380.0, 1000.0, 1e4, 1e6, 1e9])
def test_with_string_stiffness_it_holds(ratio: float) -> None:
    """A load that starts without stretch stretches the links at most twice as far as it does at rest."""
    result = hang(ratio, STRINGS)

    assert sideways(result) < 1e-5
    assert result["g"].max() < 1e-13 * GRAVITY * (ratio + 10.0) * 2.0 + 1e-9
    assert fastest(ratio, STRINGS) < 1.0


def test_a_chain_at_rest_stays_at_rest_and_carries_its_weight() -> None:
    """g = −eps F for every row, whatever the stepper does to the transverse motion."""
    observe = {
        "stretch": Final(quantity=Violation()),
        "kinetic": Final(quantity=KineticEnergy()),
        "aside": MaximumAbsolute(quantity=Position()),
    }
    scene = hanging(1e6, 0.0, 0.1, 0.0, H)
    result = simulate(scene, time_step=H, duration=20.0, method=STRINGS, observe=observe)
    weight = GRAVITY * (1e6 + np.arange(LINKS - 1, -1, -1))

    assert result["stretch"] == pytest.approx(1e-13 * weight, rel=1e-3)
    assert result["kinetic"] < 1e-9
    assert result["aside"][:, 0].max() == 0.0


def test_light_chains_hardly_notice() -> None:
    """The correction is of second order in the time step."""
    scene, ends = hanging(1.0, 0.0, 0.1, 0.1, H), []
    for step in (1 / 500, 1 / 1000):
        plain, string = (
            simulate(scene, time_step=step, duration=1.0, method=method).final_state[f"b{LINKS - 1}"][:3]
            for method in (Method(), STRINGS)
        )
        ends.append(float(np.abs(plain - string).max()))

    assert ends[1] < 0.4 * ends[0]
    assert ends[0] < 1e-3


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("offset", [1e-7, 1e-5, 1e-4])
@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e9])
def test_the_first_step_knows_the_tension(ratio: float, offset: float, half: bool) -> None:
    """A zigzag start swings from side to side; it is not thrown out by a first step without stiffness."""
    method = Method(string_stiffness=True, half_step_velocities=half)
    observe = {"x": MaximumAbsolute(quantity=Position()), "f": Trace(quantity=ConstraintForce())}
    result = simulate(hanging(ratio, offset), time_step=H, duration=5.0, method=method, observe=observe)

    assert result["x"][:, 0].max() < 4.0 * offset
    assert not result["f"][0].any()  # no step was done, so no impulse was given


@pytest.mark.parametrize("kind", ["chain", "tree", "loop"])
def test_string_stiffness_is_the_averaged_law_across_the_rows(kind: str) -> None:
    """The dense solve with (h²/4) (T/l) (I − u uᵀ) beside M, from the state after a first step on."""
    h, scene = 0.002, KINDS[kind](np.random.default_rng(1))
    observe = traces(x=Position(), v=Velocity(), f=ConstraintForce())
    run = simulate(scene, time_step=h, steps=30, method=STRINGS, observe=observe)
    dense = Oracle(scene, h, STRINGS)
    dense.x, dense.v, dense.impulse = run["x"][1], run["v"][1], -h * run["f"][1]
    for k in range(2, 31):
        dense.step()
        assert np.abs(run["x"][k] - dense.x).max() < 1e-12
    assert run["f"].max() * h**2 < 0.3 * min(dense.mass) * 0.5  # no damping here


def test_string_stiffness_costs_next_to_nothing_where_it_is_not_needed() -> None:
    """A light pendulum at 1/1000: the same motion within the error the method has anyway."""
    bob = Particle(name="bob", mass=1.0, position=(1.0, 0.0, 0.0))
    rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "bob"), compliance=1e-13)
    scene = Scene(bodies=(bob,), constraints=(rod,), gravity=(0.0, 0.0, -GRAVITY))
    observe = traces(x=Position("bob"), e=Energy())
    plain, strings = (
        simulate(scene, time_step=1e-3, duration=5.0, method=method, observe=observe)
        for method in (Method(), STRINGS)
    )

    assert np.abs(plain["x"] - strings["x"]).max() < 2e-3
    assert abs(strings["e"][-1] - plain["e"][-1]) < 1e-3 * GRAVITY


EDGES = {
    "one that is held": ({"a": (1.0, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))}, ((0.0, 0.0, 1.0), "a")),
    "a light one that turns about two heavy ones": (
        {
            "a": (1e15, (-1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            "b": (1e15, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
            "c": (1.0, (0.0, 0.5, 0.0), (0.0, 0.0, 1.0)),
        },
        ("a", "b"),
        ("a", "c"),
        ("c", "b"),
    ),
    "a heavy one and a speck": (
        {"a": (1.0, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "b": (1e-15, (1.0, 0.0, 0.0), (0.0, -1.0, 0.3))},
        ("a", "b"),
    ),
    "a tiny pair": (
        {"a": (1.0, (0.0, 0.0, 0.0), (0.0, -0.5, 0.0)), "b": (1.0, (1e-9, 0.0, 0.0), (0.0, 0.5, 0.0))},
        ("a", "b"),
    ),
}


@pytest.mark.parametrize("h", [H, 0.5])
@pytest.mark.parametrize("name", EDGES)
def test_nor_at_the_edges_of_what_floats(name: str, h: float) -> None:
    """Bodies of all masses, in one line and about it; what is held owes its momentum to what holds it."""
    bodies, *ends = EDGES[name]
    scene = Scene(
        bodies=tuple(Particle(name=k, mass=m, position=x, velocity=v) for k, (m, x, v) in bodies.items()),
        constraints=tuple(Distance(name=f"{a} {b}", between=(a, b)) for a, b in ends),  # type: ignore[arg-type]
    )
    observe = {"l": Trace(quantity=AngularMomentum()), "e": MaximumAbsolute(quantity=Energy())}
    run = simulate(scene, time_step=h, steps=400, method=STRINGS, observe=observe)

    assert run.status == "completed" and run["e"] < 1.0
    if name != "one that is held":
        assert np.abs(run["l"] - run["l"][0]).max() < 1e-11
