"""The books of a run: what came in, what was dissipated, and what nothing explains."""

from __future__ import annotations

import math

import pytest

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Ball,
    Box,
    Energy,
    Hinge,
    Limit,
    Load,
    Material,
    Method,
    Motor,
    Particle,
    Plane,
    Prismatic,
    Result,
    RigidBody,
    Scene,
    Sinusoid,
    Sphere,
    Spring,
    Trace,
    simulate,
)
from tests.scenes.corpus import solid

H = 1 / 240  # s
DOWN = (0.0, 0.0, -9.81)  # m/s²
ORDER_4 = Method(composition="order4")
HALF = Method(corrections=2, half_step_velocities=True)


def asked(scene: Scene, duration: float = 1.0, method: Method | None = None, h: float = H) -> Result:
    """The run with its books, which balance."""
    observe = {"energy": Trace(quantity=Energy())}
    run = simulate(
        scene, time_step=h, duration=duration, method=method or Method(), observe=observe, books=True
    )
    energy = run.partial["energy"].ravel()
    assert set(run.observables) == {"energy"}
    told = run.books.energy_in - run.books.dissipated + run.books.unexplained
    assert told == pytest.approx(energy[-1] - energy[0], abs=1e-9 * (1.0 + abs(energy).max()))
    return run


def test_books_change_no_bit() -> None:
    for method in (Method(), HALF, ORDER_4):
        alone, kept = (
            simulate(wheel(), time_step=H, steps=40, method=method, books=books) for books in (False, True)
        )

        assert alone.state_hash == kept.state_hash
        assert alone.books is None and kept.books is not None


def wheel(**axle: object) -> Scene:
    body = RigidBody(
        name="wheel", mass=1.0, inertia=(0.01,) * 3, position=(0.1, 0.0, 0.0), velocity=(0.0, 2.0, 0.0),
        angular_velocity=(0.0, 0.0, 20.0),
    )  # fmt: skip
    joint = Hinge(name="axle", between=(WORLD, "wheel"), at=(0.0, 0.0, 0.0), compliance=0.0, **axle)  # type: ignore[arg-type]
    return Scene(bodies=(body,), constraints=(joint,))


def test_what_spins_off_its_joint_loses_energy_that_nothing_took() -> None:
    """4 J, of which linearised rows keep .19 after ten seconds at 1/60."""
    plain = asked(wheel(), 10.0, PLAIN, h=1 / 60).books
    order_4 = asked(wheel(), 10.0, ORDER_4, h=1 / 60).books

    assert plain.unexplained == pytest.approx(-0.81 * 4.0, rel=0.01)
    assert (plain.energy_in, plain.dissipated) == (0.0, 0.0)
    assert abs(order_4.unexplained) < 1e-12
    assert order_4.largest_turn == pytest.approx(20.0 / 60, rel=1e-9)


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.0, 0.0, -2.0)])
@pytest.mark.parametrize("ground", ["world", "kinematic"])
def test_a_motor_gives_what_its_flywheel_has(axis: tuple[float, float, float], ground: str) -> None:
    """4 N m for a second on half a kilogram metre squared: 16 J; against a spin, 4 of them are taken first."""
    for spin, given, taken in ((0.0, 16.0, 0.0), (-4.0 * math.copysign(1.0, axis[2]), 4.0, 4.0)):
        body = solid("disc", None, (0.0, 0.0, 0.0), 2.0, spin=(0.0, 0.0, spin), inertia=(0.5,) * 3)
        floor = RigidBody(name="floor", motion="kinematic", position=(0.0, 0.0, 0.0))
        first = WORLD if ground == "world" else "floor"
        joint = Hinge(name="axle", between=(first, "disc"), axis=axis, motor=Motor(speed=1e3, max_force=4.0))
        books = asked(Scene(bodies=(floor, body), constraints=(joint,))).books

        assert books.energy_in == pytest.approx(given, rel=1e-6)
        assert books.dissipated == pytest.approx(taken, abs=1e-6)
        assert abs(books.unexplained) < 1e-6


def test_a_load_that_follows_the_time_gives_what_its_body_has() -> None:
    """F sin ω t on a mass at rest."""
    body = RigidBody(name="body", mass=2.0, position=(0.0, 0.0, 0.0), shape=Sphere(0.1))
    push = Load(
        name="push",
        body="body",
        force=(3.0, 0.0, 0.0),
        torque=(0.0, 0.01, 0.0),
        factor=Sinusoid(amplitude=1.0, frequency=0.3),
    )
    run = asked(Scene(bodies=(body,), forces=(push,)))

    assert run.books.energy_in == pytest.approx(float(run["energy"][-1]), rel=1e-9)
    assert abs(run.books.unexplained) < 1e-9
    assert run.books.dissipated == 0.0


def block(friction: float) -> Scene:
    rough = Material(friction=friction)
    floor = RigidBody(name="floor", motion="static", position=(0.0, 0.0, 0.0), shape=Plane(), material=rough)
    box = RigidBody(
        name="box", mass=5.0, position=(0.0, 0.0, 0.1), shape=Box((0.4, 0.4, 0.2)), velocity=(3.0, 0.0, 0.0), material=rough
    )  # fmt: skip
    return Scene(bodies=(floor, box), gravity=DOWN)


def test_friction_dissipates_what_a_block_had() -> None:
    books = asked(block(0.5)).books

    assert books.dissipated == pytest.approx(22.5, rel=1e-9)
    assert abs(books.unexplained) < 1e-9
    assert asked(block(0.0)).books.dissipated == pytest.approx(0.0, abs=1e-9)


def test_a_fall_is_read_half_a_step_apart() -> None:
    """½ m g² h² a step of plain ones, none at mid-step."""
    fall = Scene(bodies=(Particle(name="stone", mass=2.0, position=(0.0, 0.0, 0.0)),), gravity=DOWN)

    assert asked(fall).books.unexplained == pytest.approx(-0.5 * 2.0 * 9.81**2 * H, rel=1e-9)
    assert abs(asked(fall, method=Method(half_step_velocities=True)).books.unexplained) < 1e-9


def test_a_fall_that_something_may_brake_makes_nothing() -> None:
    """Its joint has a stop: half a step of the fall was taken each step, so that all of it came back out of nothing."""
    arms = tuple(
        RigidBody(name=n, mass=1.0, inertia=(0.1, 0.1, 0.1), position=(x, 0, 9))
        for n, x in (("a", 0), ("b", 1))
    )
    joint = Hinge(
        name="j", between=("a", "b"), at=(0.5, 0, 9), axis=(0, 1, 0), limit=Limit(lower=-1, upper=1)
    )
    run = asked(Scene(bodies=arms, constraints=(joint,), gravity=DOWN, contacts=False), 0.2, h=1 / 60)
    assert run.status == "completed", run.failure


def test_a_conveyor_gives_and_takes() -> None:
    rough = Material(friction=0.5)
    belt = RigidBody(
        name="belt", motion="static", position=(0.0, 0.0, 0.0), shape=Plane(), material=rough, surface_velocity=(2.0, 0.0, 0.0)
    )  # fmt: skip
    box = solid("box", Box((0.4, 0.4, 0.2)), (0.0, 0.0, 0.1), 5.0, material=rough)
    books = asked(Scene(bodies=(belt, box), gravity=DOWN)).books

    assert books.energy_in == pytest.approx(10.0, rel=1e-9)
    assert books.unexplained == 0.0


def test_impacts_that_end_without_a_rebound_are_counted() -> None:
    """A slide between elastic stops beside something that touches."""
    slide = solid("slide", None, (0.0, 0.0, 5.0), velocity=(3.0, 0.0, 0.0), inertia=(0.1,) * 3)
    stops = Prismatic(
        name="stops", between=(WORLD, "slide"), axis=(1.0, 0.0, 0.0), limit=Limit(lower=-0.004, upper=0.004, restitution=1.0)
    )  # fmt: skip
    run = asked(Scene(bodies=(slide,), constraints=(stops,)))

    assert run.books.stopped_impacts == run.counters["stopped_impacts"]
    assert run.books.dissipated + abs(run.books.unexplained) < 1e-9


def spring(method: Method, rate: float) -> Result:
    """A mass on a spring of so many radians a step."""
    stiffness = (rate / H) ** 2
    bob = Particle(name="bob", mass=1.0, position=(1.0, 0.0, 0.0))
    tie = Spring(name="tie", between=((0.0, 0.0, 0.0), "bob"), stiffness=stiffness)
    return asked(Scene(bodies=(bob,), forces=(tie,)), 0.2, method)


def test_energy_out_of_nothing_is_unsettled_whatever_the_method() -> None:
    """Symplectic Euler's ellipse: at 1.9 radians a step its energy swings by far more than there is."""
    made = spring(Method(), 1.9)

    assert made.status == "unsettled"
    assert "came out of nothing" in made.failure and made.failed_step > 0
    assert spring(Method(), 0.1).status == "completed"


@pytest.mark.parametrize("method", [Method(), HALF, ORDER_4], ids=["plain", "half", "order 4"])
def test_a_pendulum_makes_nothing(method: Method) -> None:
    body = RigidBody(name="bob", mass=1.0, position=(1.0, 0.0, 0.0), inertia=(0.1,) * 3)
    rod = Ball(name="rod", between=(WORLD, "bob"), at=(0.0, 0.0, 0.0), compliance=0.0)
    run = asked(Scene(bodies=(body,), constraints=(rod,), gravity=DOWN), 2.0, method)

    assert run.completed
    assert abs(run.books.unexplained) < 0.01 * 9.81
