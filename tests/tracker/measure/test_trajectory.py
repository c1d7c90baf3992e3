"""Recorded motion: within the error it states, bounded in size, and a result whatever the engine does."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

import spook_tracker.tracker.measure.trajectory as motion
from spook_tracker.engine import Box, ContactPoints, Material, Particle, Plane, RigidBody, Scene, simulate
from spook_tracker.engine.protocol import NotSupported
from spook_tracker.scalar_tests.case import Example
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.tracker.document.run_document import Trajectory

MOST_BYTES, channel = motion.MOST_BYTES, motion.channel
trajectory, values_of = motion.trajectory, motion.values_of
GRAVITY = 9.81  # m/s²


def falling(duration: float, **changes):
    ball = Particle(name="ball", position=(0.0, 0.0, 0.0), mass=1.0)
    scene = Scene(bodies=(ball,), gravity=(0.0, 0.0, -GRAVITY))
    return lambda: Example(scene=scene, time_step=0.01, duration=duration, **changes)


class Named:
    """What the recorder asks of a test."""

    def __init__(self, example):
        self.example = example


def of(moved, name):
    return values_of(next(c for c in moved.channels if c.name == name), moved.count)


def test_numbers_come_back_within_half_a_step_and_gaps_as_gaps():
    random = np.random.default_rng(3)
    values = random.normal(size=(200, 7)) * 10.0 ** random.integers(-9, 9)
    values[17, 3], values[18, 3], values[199, 6] = np.nan, np.inf, -np.inf

    stored = channel("x", "m", values)
    back = values_of(stored, 200)

    finite = np.isfinite(values)
    assert np.array_equal(np.isfinite(back), finite)
    assert np.abs(back - values)[finite].max() <= 0.5000001 * stored.step
    assert stored.step <= (values[finite].max() - values[finite].min()) / 65_000


@pytest.mark.parametrize("constant", [0.0, 1e-300, -3.5])
def test_a_quantity_that_stands_still_is_exact(constant):
    assert np.all(values_of(channel("x", "m", np.full((5, 2), constant)), 5) == constant)


def test_a_falling_ball_falls_in_the_recording():
    moved = trajectory("fall", Named(falling(2.0)), simulate)
    assert moved is not None

    n = np.round(np.arange(moved.count) * moved.step / 0.01)
    discrete = -GRAVITY * 0.01**2 * n * (n + 1) / 2.0  # the step's own solution, m

    step = next(c.step for c in moved.channels if c.name == "position")
    assert np.abs(of(moved, "position")[:, 2] - discrete).max() <= step
    assert moved.exact == "a time step of h/16"


def test_the_exact_motion_is_the_closed_form_where_a_test_has_one():
    exact = falling(2.0, exact=lambda t: {"ball": (0.0, 0.0, -0.5 * GRAVITY * t * t)})
    moved = trajectory("fall", Named(exact), simulate)
    assert moved is not None

    t = np.arange(moved.count) * moved.step
    assert moved.exact == "the exact solution"
    assert np.abs(of(moved, "exact_position")[:, 2] + 0.5 * GRAVITY * t**2).max() < 1e-3


def test_an_engine_that_fails_or_crashes_gives_no_motion():
    def fails(*arguments, **options):
        raise RuntimeError("no such engine")

    assert trajectory("fall", Named(falling(1.0)), fails) is None


def test_a_motion_that_diverges_is_shown_until_it_does():
    def explodes(scene, **options):
        return simulate(
            Scene(bodies=(Particle(name="ball", position=(0, 0, 0), mass=1.0),), gravity=(0.0, 0.0, -1e102)),
            **options,
        )

    moved = trajectory("fall", Named(falling(1.0)), explodes)

    assert moved is None or "ball" in moved.failure


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_scene_of_the_catalogue_gives_a_motion(name):
    """Its first steps: how long it goes on is no question of what can be recorded."""
    example = CATALOGUE[name].example()
    short = replace(example, duration=min(example.duration, 4 * example.time_step))
    moved = trajectory(name, Named(lambda: short), simulate)

    assert moved is not None
    assert moved.failure == ""
    assert moved.bodies == min(len(example.scene.bodies), motion.MOST_SOLIDS)
    assert np.isfinite(of(moved, "position")).all()
    assert moved.exact, "nothing to compare it with"


@pytest.mark.parametrize("name", ["pendulum", "friction", "cantilever"])
def test_scenes_of_the_catalogue_move_within_the_budget(name):
    moved = trajectory(name, CATALOGUE[name], simulate)
    assert moved is not None

    assert sum(len(c.data) for c in moved.channels) <= MOST_BYTES
    assert len(moved.body_of_solid) == len(moved.solids)
    assert all(c.width * moved.count == values_of(c, moved.count).size for c in moved.channels)
    assert msgspec.json.decode(msgspec.json.encode(moved), type=Trajectory) == moved


SLOPE = 0.4  # the ratio of gravity along the ground to that into it


def on_rough_ground(friction: float) -> Example:
    """A box under tilted gravity: it stands where friction is more than the slope, else it slides."""
    rough = Material(friction=friction)
    ground = RigidBody(
        name="ground", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough
    )
    box = RigidBody(
        name="box", mass=1.0, shape=Box((1.0, 1.0, 0.2)), position=(0.0, 0.0, 0.1), material=rough
    )
    scene = Scene(bodies=(ground, box), gravity=(SLOPE * GRAVITY, 0.0, -GRAVITY))
    return Example(scene=scene, time_step=0.01, duration=0.2)


@pytest.mark.parametrize(("friction", "lean"), [(0.9, SLOPE), (0.25, 0.25)], ids=["stands", "slides"])
def test_the_cones_of_a_box_stand_at_its_corners_with_what_they_carry(friction, lean):
    moved = trajectory("box", Named(lambda: on_rough_ground(friction)), simulate)
    points, forces = of(moved, "cone_point").reshape(-1, 4, 3), of(moved, "cone_force").reshape(-1, 4, 3)
    axes, coefficients = of(moved, "cone_axis").reshape(-1, 4, 3), of(moved, "cone_friction")

    assert np.isnan(points[0]).all(), "no step has ended yet"
    np.testing.assert_allclose(coefficients[1:], friction, atol=1e-12)
    np.testing.assert_allclose(
        axes[1:], np.broadcast_to((0.0, 0.0, 1.0), (moved.count - 1, 4, 3)), atol=1e-12
    )
    np.testing.assert_allclose(points[1:, :, 2], 0.0, atol=1e-5)  # stored in sixteen bits
    carried = forces[1:].sum(axis=1)
    np.testing.assert_allclose(carried[:, 2], GRAVITY, rtol=1e-3)
    np.testing.assert_allclose(carried[:, 0], -lean * GRAVITY, rtol=1e-3)


def test_an_engine_that_keeps_its_contact_points_to_itself_still_moves():
    def silent(scene, **options):
        if any(isinstance(what.quantity, ContactPoints) for what in options["observe"].values()):
            raise NotSupported("silent cannot be asked the observable contact points")
        return simulate(scene, **options)

    moved = trajectory("box", Named(lambda: on_rough_ground(0.9)), silent)

    assert {c.name for c in moved.channels} >= {"position", "contact_force"}
    assert not any(c.name.startswith("cone") for c in moved.channels)
