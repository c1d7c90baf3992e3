"""The steps that ladders of rigid scenes fit their orders from: chosen by theory, not by the slopes found.

On a linear oscillator of rate ω a composition is a product of 2 × 2 matrices; the slope of its phase error is within
0.25 of the order up to h ω = 1. A constraint's forces are quadratic in the angular velocities, so that a body turning
at w moves like 2 w: the coarsest step of a fit keeps h w ≤ 1/2. Its finest one stays above the rounding of its stages.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

from spook_tracker.engine import Final, Method, Particle, Position, Scene, Spring, Velocity, simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.mechanisms import swinging_door
from spook_tracker.scalar_tests.multibody import four_bars
from spook_tracker.scalar_tests.oscillators import double_pendulum
from spook_tracker.scalar_tests.rotation import spinning_top

STAGES = {"order4": 5, "order6": 9, "order8": 17}
ROUNDING = 2e-15  # of a joint's size: where a stage counts as held
Z = 1.0  # h ω


@functools.cache
def fastest(test: str) -> float:
    """The largest angular velocity [rad/s] of a scene, from its closed form or its tight integration."""
    if test == "swinging_door":  # all of the lift at the lowest position
        door = swinging_door
        return math.sqrt(2.0 * door.MASS * door.ACROSS * door.LEVER / door.INERTIA)
    if (
        test == "spinning_top"
    ):  # a turn about its own axis is exact: what moves the pivot's rows is the axis, which nutates
        top = spinning_top
        return top.ALONG * top.SPIN / (top.ACROSS + top.MASS * top.ARM**2)
    if test == "four_bars":  # just level: θ̇² = 1 + 2 c g/l
        push, falls = four_bars.PUSH / four_bars.LENGTH, four_bars._falls_over(four_bars.FEW)
        return math.sqrt(push**2 + 2.0 * falls * four_bars.GRAVITY / four_bars.LENGTH)
    times = np.linspace(0.0, double_pendulum.DURATION, 2001)
    return float(np.abs(np.diff(double_pendulum.exact(tuple(times.tolist())), axis=0)).max() / times[1])


FITS = [
    (test, ladder, one)
    for test in ("swinging_door", "spinning_top", "double_pendulum", "four_bars")
    for ladder in CATALOGUE[test].ladders
    for one in ladder.configurations
    if one.method.composition != "none" and one.expected_order is not None
]


def test_every_scene_has_orders_four_six_and_eight() -> None:
    found = {(test, one.expected_order) for test, _, one in FITS}

    assert found == {(test, order) for test, _, _ in FITS for order in (4.0, 6.0, 8.0)}


@pytest.mark.parametrize(
    ("test", "ladder", "one"), FITS, ids=[f"{fit[0]} {fit[1].name} {fit[2].name}" for fit in FITS]
)
def test_an_order_is_fitted_where_theory_has_it(test: str, ladder: object, one: object) -> None:
    steps = ladder.steps_of(one)  # type: ignore[attr-defined]
    span = one.order_range or (min(steps), max(steps))  # type: ignore[attr-defined]
    used = [h for h in steps if span[0] * (1 - 1e-9) <= h <= span[1] * (1 + 1e-9)]

    assert max(used) * fastest(test) <= 0.5 * Z
    stages = STAGES[one.method.composition] / min(used)  # type: ignore[attr-defined]
    assert ladder.error(simulate, min(used), one.method) > ROUNDING * math.sqrt(stages)  # type: ignore[attr-defined]


@pytest.mark.parametrize("order", STAGES)
def test_on_an_oscillator_the_order_shows_up_to_there(order: str) -> None:
    spring = Spring(name="spring", between=((0.0, 0.0, 0.0), "ball"), stiffness=1.0)
    observe = {"x": Final(quantity=Position("ball")), "v": Final(quantity=Velocity("ball"))}

    def error(h: float) -> float:
        """Of the phase in a step: half the trace of its matrix is the cosine of it."""
        trace = 0.0
        for place, speed, kept in ((1.0, 0.0, "x"), (0.0, 1.0, "v")):
            ball = Particle(name="ball", mass=1.0, position=(place, 0.0, 0.0), velocity=(speed, 0.0, 0.0))
            scene = Scene(bodies=(ball,), forces=(spring,))
            method = Method(composition=order)  # type: ignore[arg-type]
            trace += simulate(scene, time_step=h, steps=1, method=method, observe=observe)[kept][0]
        return abs(math.acos(0.5 * trace) / h - 1.0)

    for z in (0.5 * Z, 0.7 * Z, Z):
        slope = math.log(error(z) / error(0.9 * z)) / math.log(1 / 0.9)
        assert slope == pytest.approx(float(order[-1]), abs=0.25)
