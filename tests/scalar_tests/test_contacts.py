"""Limits and bands of the questions about contacts, found again without the engine, and the faults they must see."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from spook_tracker.engine import Method, Scene, SimulationFailed, simulate
from spook_tracker.scalar_tests.case import Simulate
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.friction import edge_roll
from spook_tracker.scalar_tests.impacts import between_walls, billiards
from spook_tracker.scalar_tests.stacks import overhang
from tests.toys.broken_engines import scaled, with_scene


def over_the_edge(speed: float, rolling: bool, h: float) -> tuple[float, float]:
    """Level speed [m/s] and spin [rad/s] of a ball stepped over an edge by hand.

    The normal of the moment, an open gap may close, friction rolls the ball whenever it touches.
    """
    g, r = edge_roll.GRAVITY, edge_roll.RADIUS
    place, velocity = np.array((-0.37 * speed * h, r)), np.array((speed, 0.0))
    spin = speed / r if rolling else 0.0
    for _ in range(round(0.7 / h)):
        normal = np.array((0.0, 1.0)) if place[0] <= 0.0 else place / np.linalg.norm(place)
        gap = (place[1] if place[0] <= 0.0 else float(np.linalg.norm(place))) - r
        velocity = velocity - (0.0, h * g)
        along = np.array((normal[1], -normal[0]))
        if velocity @ normal < -max(0.0, gap) / h:
            velocity = velocity - (velocity @ normal + max(0.0, gap) / h) * normal
            if rolling:
                slip = velocity @ along - r * spin
                velocity = velocity - 2.0 / 7.0 * slip * along
                spin += 5.0 / 7.0 * slip / r
        place = place + h * velocity
    return float(velocity[0]), spin


@pytest.mark.parametrize("h", [1e-3, 2.5e-4, 6.25e-5])
def test_a_ball_stepped_by_hand_leaves_the_edge_within_the_limits(h: float) -> None:
    angle, leaving = edge_roll.departure(edge_roll.SLOW, False)
    sliding, _ = over_the_edge(edge_roll.SLOW, False, h)
    assert abs(sliding - leaving * math.cos(angle)) <= edge_roll.GRAVITY * h

    angle, leaving = edge_roll.departure(edge_roll.SLOW, True)
    early = edge_roll.last_hop(edge_roll.SLOW, True, h)
    lost = 5.0 / 7.0 * edge_roll.GRAVITY / edge_roll.RADIUS * math.sin(angle) * early
    _, spin = over_the_edge(edge_roll.SLOW, True, h)
    assert abs(leaving / edge_roll.RADIUS - spin) <= lost


def test_the_limit_at_the_edge_is_that_of_its_own_step() -> None:
    (asked,) = CATALOGUE["edge_roll"].measurements
    limits = {metric.name: metric.limit for metric in asked.metrics}
    angle, _ = edge_roll.departure(edge_roll.SLOW, True)

    assert asked.time_step == 2.5e-4
    assert math.cos(angle) == pytest.approx((10 + 7 * 0.3**2 / (9.81 * 0.1)) / 17, rel=1e-12)
    assert limits["sliding_error"] == pytest.approx(9.81 * 2.5e-4, rel=1e-12)
    assert limits["rolling_spin_error"] == pytest.approx(0.251, rel=2e-3)


def test_a_cue_ball_that_spins_fast_enough_catches_up_with_what_it_hit() -> None:
    """Step by step, in a loop of its own: the cloth pushes until the ball rolls, and both go on."""
    h, pull, given = billiards.TIME_STEP, 0.2 * 9.81, 0.5 * (1.0 + 0.95)

    def lead(spin: float) -> float:
        speed, rolling, way = 1.0 - given, 0.03 * spin, 0.0
        for _ in range(round(billiards.DURATION / h)):
            push = min(pull * h, 2.0 / 7.0 * (rolling - speed))
            speed, rolling = speed + push, rolling - 2.5 * push
            way += h * speed
        return way - given * billiards.DURATION

    study = next(s for s in CATALOGUE["billiards"].stability if s.name == "fastest-spin")
    assert study.expected is not None
    low, high = study.expected
    assert brentq(lead, 100.0, 200.0) == pytest.approx(high, rel=1e-3)
    assert 0.98 < low / high < 1.0


def test_energy_is_never_gained_in_the_closed_forms() -> None:
    """What the questions call right must itself be possible."""
    for friction in (0.05, 0.3, 5.0):
        for restitution, slip in itertools.product((0.5, 1.0), (0.0, 0.5, 1.0)):
            blows = between_walls.expected(friction, restitution, slip)
            energy = [v**2 + 0.4 * s**2 + u**2 for v, s, u in blows]
            assert energy[0] <= 9.0 + 16.0 + 1e-12
            assert all(late <= early + 1e-12 for early, late in itertools.pairwise(energy))
        speeds, spins = billiards.expected_hit(friction)
        masses, radii = np.array((1.0, 3.0)), np.array(billiards.RADII)
        v, w1, w2 = map(np.array, billiards.ARRIVING)
        moments = 0.4 * masses * radii**2
        before = v @ v + moments @ (w1 @ w1, w2 @ w2)
        after = masses @ (speeds**2).sum(axis=1) + moments @ (spins**2).sum(axis=1)
        assert after < before
        np.testing.assert_allclose(masses @ speeds, v, atol=1e-12)


def test_the_harmonic_stack_is_critical_everywhere_at_once() -> None:
    """With every overhang at its limit the centre of all plates above each interface is at that interface's edge."""
    plates = [body for body in overhang.scene(overhang.COUNT, 1.0).bodies if body.name != "floor"]
    x = np.array([plate.position[0] for plate in plates])

    for level in range(1, len(x)):
        assert x[level:].mean() == pytest.approx(x[level - 1] + 0.5 * overhang.LENGTH, abs=1e-12)


# Faults, one at a time, by name --------------------------------------------------------------------------------


def times(factor: float, name: str) -> Simulate:
    """Takes that so much larger, where a scene has any."""
    return lambda scene, **options: simulate(scaled(scene, factor, (name,)), **options)


def bodies(change: Callable[..., object]) -> Simulate:
    return with_scene(lambda scene: replace(scene, bodies=tuple(change(body) for body in scene.bodies)))


def wide(scene: Scene, **options: object) -> object:
    """Sees bodies 1 cm before they touch: what a speculative half-space does."""

    def grown(body: object) -> object:
        shape = body.shape  # type: ignore[attr-defined]
        if hasattr(shape, "size"):
            return replace(body, shape=replace(shape, size=tuple(edge + 0.01 for edge in shape.size)))
        if hasattr(shape, "radius"):
            return replace(body, shape=replace(shape, radius=shape.radius + 0.01))
        return body

    return bodies(grown)(scene, **options)


def all_at_once(scene: Scene, **options: object) -> object:
    """Takes every blow for one of all that touch."""
    return simulate(scene, **(options | {"method": Method()}))  # type: ignore[arg-type]


def one_by_one(scene: Scene, **options: object) -> object:
    """Takes every blow for one of pairs."""
    return simulate(scene, **(options | {"method": Method(impacts="successive")}))  # type: ignore[arg-type]


def swept(scene: Scene, **options: object) -> object:
    """Sweeps where it was to solve."""
    return simulate(scene, **(options | {"method": Method(solver="iterative")}))  # type: ignore[arg-type]


def lifting(scene: Scene, **options: object) -> object:
    """Has a floor that creeps upwards, a millimetre in ten seconds."""

    def creeping(body: object) -> object:
        if body.name != "floor":  # type: ignore[attr-defined]
            return body
        return replace(body, motion="kinematic", velocity=(0.0, 0.0, 1e-4))

    return bodies(creeping)(scene, **options)


def stepped(scene: Scene, **options: object) -> object:
    """Lets every other tile stand a hundredth of a millimetre higher: inner edges are obstacles."""

    def raised(body: object) -> object:
        name, (x, y, z) = body.name, body.position  # type: ignore[attr-defined]
        return replace(body, position=(x, y, z + 1e-5)) if name.endswith("1") else body

    return bodies(raised)(scene, **options)


@pytest.mark.parametrize(
    ("test", "metric", "fault"),
    [
        ("billiards", "follow_error", times(0.0, "friction")),
        ("billiards", "draw_error", times(0.0, "friction")),
        ("billiards", "half_ball_error", times(0.0, "friction")),
        ("billiards", "sliding_hit_error", times(0.5, "friction")),
        ("billiards", "gripping_hit_error", times(0.0, "friction")),
        ("between_walls", "sliding_speed_error", times(0.5, "friction")),
        ("between_walls", "gripping_speed_error", times(0.0, "friction")),
        ("between_walls", "returning_speed_error", times(0.0, "tangential_restitution")),
        ("near_miss", "ball_change", wide),
        ("near_miss", "box_change", wide),
        ("near_miss", "capsule_change", wide),
        ("near_miss", "turning_box_on_tiles", stepped),
        ("near_miss", "rolling_capsule_on_tiles", stepped),
        ("edge_roll", "rolling_spin_error", times(0.0, "friction")),
        ("cradle", "one_ball_error", all_at_once),
        ("cradle", "two_balls_error", all_at_once),
        ("cradle", "lossy_error", all_at_once),
        ("cradle", "unequal_error", all_at_once),
        ("cradle", "touching_error", one_by_one),
        ("overhang", "standing_moved", times(0.97, "size")),
        ("overhang", "heap_overlap", swept),
        ("overhang", "heap_energy_rise", lifting),
    ],
)
def test_a_fault_turns_the_metric_red_that_is_there_for_it(test: str, metric: str, fault: Simulate) -> None:
    asked, judged = next(pair for pair in CATALOGUE[test].metrics() if pair[1].name == metric)

    assert judged.passes(asked.measure(simulate)[metric])
    try:
        wrong = asked.measure(fault)[metric]
    except SimulationFailed:  # a ball spun up beyond what a step can turn is red, too
        return
    assert not judged.passes(wrong)
