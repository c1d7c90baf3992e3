"""A bar between two points, an orientation from axis and angle, and gears by name are what closed forms say they are."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from spook_tracker import engine
from spook_tracker.engine import (
    WORLD,
    Box,
    Capsule,
    Distance,
    Hinge,
    Relation,
    SceneError,
    axis_angle,
    bar,
    gear_pair,
)
from spook_tracker.engine.check import Vector


def turned(q: tuple[float, ...], v: Vector) -> np.ndarray:
    """v + 2 w (u × v) + 2 u × (u × v)."""
    w, u = q[0], np.array(q[1:])
    return np.array(v) + 2.0 * w * np.cross(u, v) + 2.0 * np.cross(u, np.cross(u, v))


def test_a_turn_about_an_axis_is_rodrigues_formula() -> None:
    axis, angle, v = np.array([2.0, -1.0, 2.0]), 0.7, np.array([0.3, 4.0, -1.0])
    k = axis / 3.0
    formula = v * math.cos(angle) + np.cross(k, v) * math.sin(angle) + k * (k @ v) * (1.0 - math.cos(angle))

    assert np.abs(turned(axis_angle(tuple(axis), angle), tuple(v)) - formula).max() < 1e-15
    assert axis_angle((0.0, 0.0, 5.0), math.pi) == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-15)


@pytest.mark.parametrize(
    "end", [(3.0, 1.0, 2.0), (1.0, 1.0, 5.0), (1.0, 1.0, -5.0), (1.0 + 1e-9, 1.0, -5.0), (1.0, -7.0, 2.0)]
)
def test_a_bar_reaches_from_one_point_to_the_other(end: Vector) -> None:
    start = (1.0, 1.0, 2.0)
    round_bar = bar(start, end, name="rod", radius=0.05, mass=2.0)
    box = bar(start, end, name="beam", section=(0.1, 0.2), motion="static")

    for body, shape, length in ((round_bar, Capsule, round_bar.shape.length), (box, Box, box.shape.size[2])):
        half = turned(body.orientation, (0.0, 0.0, length / 2))
        assert isinstance(body.shape, shape)
        assert np.abs(body.position + half - end).max() < 1e-14
        assert np.abs(body.position - half - start).max() < 1e-14
    assert (round_bar.mass, box.motion, box.shape.size[:2]) == (2.0, "static", (0.1, 0.2))


def test_gears_turn_by_their_teeth() -> None:
    """Speeds as 1 : −teeth ratio, and a motor feels I₁ + I₂ (z₁/z₂)²; in a ring they turn in the same way."""
    for inner, way in ((False, -1.0), (True, 1.0)):
        mesh = gear_pair("mesh", ("a", 12), ("b", 36), inner=inner, compliance=0.0)
        assert mesh == Relation(name="mesh", terms=(("a", 12.0), ("b", -way * 36.0)), compliance=0.0)
        bodies = [
            engine.RigidBody(name=n, mass=1.0, inertia=(1.0, 1.0, i), position=(x, 0.0, 0.0))
            for n, i, x in (("a", 0.02, 0.0), ("b", 0.5, 1.0))
        ]
        hinges = [Hinge(name=n, between=(WORLD, n)) for n in "ab"]
        drive = engine.Load(name="drive", body="a", torque=(0.0, 0.0, 0.4))
        end = engine.simulate(
            engine.Scene(bodies=tuple(bodies), constraints=(*hinges, mesh), forces=(drive,)), time_step=0.01, steps=100
        ).final_state  # fmt: skip
        assert end["a"][12] == pytest.approx(0.4 / (0.02 + 0.5 / 9), rel=1e-9)
        assert end["b"][12] / end["a"][12] == pytest.approx(way / 3, rel=1e-9)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: axis_angle((0, 0, 0), 1.0), "axis_angle: axis must not be the zero vector"),
        (lambda: axis_angle((0, 0, 1), "x"), "axis_angle: angle must be a number, not 'x'"),
        (lambda: bar((0, 0, 0), (0, 0, 0), name="b", radius=1.0, mass=1.0), "bar 'b': start and end coincide"),
        (lambda: bar((0, 0, 0), (1, 0, 0), name="b", mass=1.0), "bar 'b': give either a radius"),
        (lambda: bar((0, 0, 0), (1, 0, 0), name="b", radius=1, section=(1, 1)), "bar 'b': give either a radius"),
        (lambda: bar((0, 0, 0), (1, 0, 0), name="b", section=0.1, mass=1.0), "section must be two lengths, not 0.1"),
        (lambda: gear_pair("m", ("a", 0), ("b", 2)), "gear pair 'm': the teeth of 'a' must be positive"),
        (lambda: gear_pair("m", "a", ("b", 2)), "gear pair 'm': needs a hinge and its teeth, not 'a'"),
    ],
)  # fmt: skip
def test_what_they_cannot_make_is_refused_in_a_sentence(make: Callable[[], object], words: str) -> None:
    with pytest.raises(SceneError) as refused:
        make()

    assert words in str(refused.value)


@pytest.mark.parametrize("kind", [Distance, engine.Spring])
def test_the_world_has_one_name_everywhere(kind: Callable[..., Distance]) -> None:
    """WORLD with an anchor is the point that `between` may name itself, as joints have it with `at`."""
    point, arm = (0.0, 1.0, 2.0), (0.1, 0.0, 0.0)
    more = {"stiffness": 3.0} if kind is engine.Spring else {}

    named = kind(name="c", between=(WORLD, "a"), anchors=(point, arm), **more)
    assert named == kind(name="c", between=(point, "a"), anchors=((0.0, 0.0, 0.0), arm), **more)
    assert kind(name="c", between=("a", WORLD), **more).between == ("a", (0.0, 0.0, 0.0))
    with pytest.raises(SceneError, match="at least one end must be a body"):
        kind(name="c", between=(WORLD, WORLD), **more)


WORDS = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


def what_acts() -> list[type]:
    """Every joint, coupling, tyre and force that is public."""
    names = (getattr(engine, name) for name in engine.__all__)
    forces = (engine.Spring, engine.CentralGravity, engine.Load, engine.Fluid)
    return [kind for kind in names if isinstance(kind, type) and (kind in forces or hasattr(kind, "rows"))]


def test_help_gives_the_units_and_the_cost_of_whatever_acts() -> None:
    kinds = what_acts()
    told = {kind.__name__: " ".join((kind.__doc__ or "").split()) for kind in kinds}
    rows = {kind.__name__: kind.rows for kind in kinds if hasattr(kind, "rows")}

    assert len(kinds) >= 16
    assert [
        name for name, text in told.items() if not any(f"[{unit}" in text for unit in ("m", "N", "rad"))
    ] == []
    assert [name for name, text in told.items() if "osts " not in text] == []
    assert [name for name, n in rows.items() if f"osts {WORDS[n]} row{'s' * (n > 1)}" not in told[name]] == []
