"""Runge-Kutta in joint coordinates: order 8 beside compositions, which know rows and stages, and within its tolerance."""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker import engine
from spook_tracker.engine import (
    WORLD,
    AngularMomentum,
    AngularVelocity,
    Box,
    CentralGravity,
    ConstraintForce,
    Cylindrical,
    Distance,
    Fluid,
    Hinge,
    JointCoordinate,
    JointSpring,
    Load,
    Method,
    MethodError,
    Motor,
    Orientation,
    Particle,
    Planar,
    PointOnLine,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Spring,
    Table,
    Universal,
    Velocity,
    simulate,
    start,
)
from tests.engine.rigid.test_joint_trees import floating, hung, rigid
from tests.scenes import rigid as rigid_scenes
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, traces

RK8 = Method(runge_kutta="order8")
ORDER8 = Method(composition="order8")
STATE = finals(x=Position(), q=Orientation(), v=Velocity(), w=AngularVelocity())


def within(tolerance: float) -> Method:
    return Method(runge_kutta="order8", tolerance=tolerance)


def state(scene: Scene, time_step: float, steps: int, method: Method) -> np.ndarray:
    run = simulate(scene, time_step=time_step, steps=steps, method=method, observe=STATE)
    return np.concatenate([np.ravel(run[name]) for name in STATE])


def guided(kind: type[Any]) -> Scene:
    free, axis = hung("ball", "hinge"), (0.6, 0.0, 0.8)
    slide = kind(name="slide", between=(WORLD, "b0"), at=(0.5, 0.0, 0.0), axis=axis, compliance=0.0)
    return dataclasses.replace(free, constraints=(slide, free.constraints[1]))


def sprung(scene: Scene) -> Scene:
    """With springs beside centres, a star, and a dot and a body on nothing."""
    dot = Particle(name="dot", mass=0.3, position=(2.0, 1.0, 0.5), velocity=(0.0, 1.0, 0.0))
    alone = dataclasses.replace(rigid_scenes.rigid_body(np.random.default_rng(7), 9), name="alone")
    springs = (
        Spring(name="one", between=("b0", "dot"), stiffness=20.0, anchors=((0.1, 0.2, 0.0), (0.0, 0.0, 0.0))),
        Spring(name="two", between=("b1", "alone"), stiffness=15.0, rest_length=0.5),
    )
    star = engine.CentralGravity(name="star", strength=3.0, centre=(0.0, 0.0, 4.0))
    return dataclasses.replace(scene, bodies=(*scene.bodies, dot, alone), forces=(*springs, star))


SCENES = {
    "hinges": hung("hinge", "hinge", "hinge", "hinge"),
    "every joint": hung("prismatic", "ball", "hinge", "lock", "ball"),
    "what floats": floating("ball", "hinge", "prismatic", "ball"),
    "on a line": guided(PointOnLine),
    "cylindrical": guided(Cylindrical),
    "planar": guided(Planar),
    "springs": sprung(hung("ball", "hinge", "prismatic")),
}


STEPS = {
    "hinges": 6,
    "what floats": 4,
    "cylindrical": 4,
    "planar": 4,
}  # in two seconds, of the coarser of two; others 18


@pytest.mark.parametrize("name", SCENES)
def test_its_order_is_eight_and_its_answer_that_of_compositions(name: str) -> None:
    scene, coarse = SCENES[name], STEPS.get(name, 18)
    reference = state(scene, 1 / 200, 400, ORDER8)

    errors = [np.abs(state(scene, 2.0 / n, n, RK8) - reference).max() for n in (coarse, 2 * coarse)]

    assert math.log2(errors[0] / errors[1]) > 7.0
    assert np.abs(state(scene, 2.0, 1, within(1e-12)) - reference).max() < 1e-9


def test_what_a_step_may_be_off_by_is_what_it_is_off_by() -> None:
    """And less of it costs more accelerations, as the order tells: a decade a third."""
    scene = SCENES["hinges"]
    reference = state(scene, 1 / 800, 800, ORDER8)
    tolerances = [1e-4, 1e-6, 1e-8, 1e-10]
    errors = [np.abs(state(scene, 1.0, 1, within(t)) - reference).max() for t in tolerances]
    parts = [
        simulate(scene, time_step=1.0, steps=1, method=within(t)).counters["newton_iterations"]
        for t in tolerances
    ]

    assert all(error < 300.0 * tolerance for error, tolerance in zip(errors, tolerances, strict=True))
    assert all(1.2 < more / less < 2.6 for less, more in itertools.pairwise(parts))


def test_steps_shorter_than_the_tolerance_asks_are_taken_whole() -> None:
    scene = SCENES["hinges"]
    fixed, free = (simulate(scene, time_step=0.001, steps=50, method=m) for m in (RK8, within(1e-3)))
    assert fixed.state_hash == free.state_hash
    assert free.counters["newton_iterations"] == 50


def test_a_body_alone_turns_as_euler_has_it() -> None:
    """Compositions turn it exactly; nothing is near a singular position, however far it turns."""
    body = dataclasses.replace(
        rigid_scenes.rigid_body(np.random.default_rng(2), 0), angular_velocity=(5.0, 0.1, 9.0)
    )
    scene = Scene(bodies=(body,), gravity=(0.0, 0.0, 0.0))
    assert np.abs(state(scene, 0.5, 20, within(1e-13)) - state(scene, 0.5, 20, ORDER8)).max() < 1e-9


def test_what_floats_keeps_its_momentum_as_well_as_its_tolerance_says() -> None:
    pair = dataclasses.replace(floating("ball", "hinge"), gravity=(0.0, 0.0, 0.0))
    seen = traces(turning=AngularMomentum())
    for tolerance, kept in ((1e-6, 1e-4), (1e-12, 1e-10)):
        turning = simulate(pair, time_step=0.1, steps=100, method=within(tolerance), observe=seen)["turning"]
        assert np.abs(turning - turning[0]).max() < kept * np.abs(turning).max()


def rail(**more: Any) -> Scene:
    """2 kg on a slide along x."""
    cart = RigidBody(name="cart", mass=2.0, inertia=(1.0, 1.0, 1.0), position=(0.0, 0.0, 0.0))
    forces = more.pop("forces", ())
    slide = Prismatic(name="rail", between=(WORLD, "cart"), axis=(1.0, 0.0, 0.0), compliance=0.0, **more)
    return Scene(bodies=(cart,), constraints=(slide,), gravity=(0.0, 0.0, -9.81), forces=forces)


LINE = Table(times=(0.0, 4.0), values=(0.5, 2.5))


def forced(name: str) -> tuple[Scene, Any]:
    """A scene, and what the force along x is in it."""
    if name == "a joint's spring":
        spring = JointSpring(stiffness=30.0, rest=0.4, damping=0.05)
        return rail(spring=spring), lambda t, x, v: -30.0 * (x - 0.4 + 0.05 * v)
    if name == "a rest that moves":
        spring = JointSpring(stiffness=30.0, rest=LINE, damping=0.0)
        return rail(spring=spring), lambda t, x, v: -30.0 * (x - 0.5 - 0.5 * t)
    if name == "a load in time":
        load = Load(name="push", body="cart", force=(3.0, 0.0, 0.0), factor=LINE)
        return rail(forces=(load,)), lambda t, x, v: 3.0 * (0.5 + 0.5 * t)
    if name == "a spring with viscosity":
        spring = Spring(
            name="s", between=((1.0, 0.0, 0.0), "cart"), stiffness=25.0, rest_length=0.5, viscosity=1.5
        )
        return rail(forces=(spring,)), lambda t, x, v: 25.0 * (1.0 - x - 0.5) - 1.5 * v
    box = Box(size=(1.0, 1.0, 1.0))
    sea = Fluid(name="sea", density=4.0, level=10.0, drag_coefficient=1.2, velocity=(1.5, 0.0, 0.0))
    cart = dataclasses.replace(rail().bodies[0], shape=box)
    scene = dataclasses.replace(rail(), bodies=(cart,), forces=(sea,))
    return scene, lambda t, x, v: 0.5 * 4.0 * 1.2 * (1.5 - v) * abs(1.5 - v)


@pytest.mark.parametrize(
    "name", ["a joint's spring", "a rest that moves", "a load in time", "a spring with viscosity", "a fluid"]
)
def test_forces_that_compositions_refuse_are_forces(name: str) -> None:
    scene, force = forced(name)
    there = solve_ivp(
        lambda t, s: [s[1], force(t, s[0], s[1]) / 2.0],
        (0.0, 1.0),
        [0.0, 0.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-14,
    ).y[:, -1]

    if name != "a rest that moves":
        with pytest.raises(MethodError):
            simulate(scene, time_step=0.1, steps=1, method=ORDER8)
    seen = finals(x=Position("cart"), v=Velocity("cart"))
    for step, method in ((0.05, RK8), (1.0, within(1e-12))):
        run = simulate(scene, time_step=step, duration=1.0, method=method, observe=seen)
        assert [float(run["x"][0]), float(run["v"][0])] == pytest.approx(there, abs=1e-10), method


def test_books_take_a_load_as_it_was_within_the_step() -> None:
    """By the trapezoidal rule, so that what they cannot explain falls with the square of the step."""
    scene, _ = forced("a load in time")
    left = []
    for steps in (20, 40):
        books = simulate(scene, time_step=1 / steps, steps=steps, method=RK8, books=True).books
        assert books is not None
        left.append(abs(books.unexplained) / books.energy_in)
    assert left[0] < 1e-3
    assert left[0] / left[1] == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize("backwards", [False, True])
def test_armature_and_springs_of_joints_either_way_round(backwards: bool) -> None:
    scene = hung("ball", "ball")
    ends = ("b1", "b0") if backwards else ("b0", "b1")
    hinge = Hinge(
        name="elbow", between=ends, at=scene.constraints[1].at, axis=(0.0, 0.6, 0.8), compliance=0.0, armature=0.3,
        spring=JointSpring(stiffness=12.0, rest=0.5, damping=0.0),
    )  # fmt: skip
    scene = dataclasses.replace(scene, constraints=(scene.constraints[0], hinge))
    seen = traces(f=ConstraintForce("elbow"), a=JointCoordinate("elbow"))
    runs = [
        simulate(scene, time_step=0.005, steps=100, method=method, observe=seen) for method in (RK8, ORDER8)
    ]

    for name in seen:
        assert np.abs(runs[0][name] - runs[1][name]).max() < 1e-8 * np.abs(runs[1][name]).max(), name


def test_what_is_locked_stays_and_a_load_that_is_set_acts_from_there_on() -> None:
    bodies = hung("lock", "hinge").bodies
    held = rigid(dataclasses.replace(hung("lock"), bodies=bodies[:1]))
    assert np.array_equal(state(held, 0.1, 5, RK8)[:3], bodies[0].position)

    push = Load(name="push", body="cart", force=(0.0, 0.0, 0.0))
    with start(rail(forces=(push,)), time_step=0.1, method=RK8, observe={"x": Position("cart")}) as run:
        run.step(10)
        run.set_load("push", force=(4.0, 0.0, 0.0))
        run.step(10)
        assert run["x"][0] == pytest.approx(1.0, abs=1e-12)  # 2 m/s² for 1 s


def test_it_says_how_it_steps() -> None:
    reasons = {
        c.stage: c.reason for c in engine.compile(SCENES["hinges"], time_step=0.02, method=RK8).explain()
    }
    assert "Runge-Kutta of order 8" in reasons["half_step"]
    assert "4 joint coordinates" in reasons["solve_block"]


def test_what_rests_takes_a_part_a_step_and_a_load_that_begins_or_jumps_is_followed() -> None:
    """A weight at rest on its spring, whose rates are rounding; then 1 kg that is pulled from rest, against its closed form."""
    weight = Particle(name="a", mass=0.2, position=(0.0, 0.0, -(1.0 + 0.2 * 9.81 / 50.0)))
    spring = Spring(name="s", between=((0.0, 0.0, 0.0), "a"), stiffness=50.0, rest_length=1.0, viscosity=2.0)
    hung_still = Scene(bodies=(weight,), forces=(spring,), gravity=(0.0, 0.0, -9.81), contacts=False)
    ball = RigidBody(name="p", mass=1.0, inertia=(0.1,) * 3, position=(0.0, 0.0, 0.0))
    end = finals(x=Position("p"))

    still = simulate(hung_still, time_step=1 / 60, steps=60, method=within(1e-6))
    assert still.completed and still.counters["newton_iterations"] <= 70

    for tolerance, strength in itertools.product((1e-3, 1e-6, 1e-9, 1e-12), (1.0, 1e6)):
        for times, values, right in (
            ((0.5, 1.0), (0.0, 1.0), 1.0 / 24.0 * 1.0 + 0.25 * 1.0 + 0.5),  # grows from .5 to 1 s
            ((0.5 - 1e-12, 0.5), (0.0, 1.0), 0.5 * 1.5**2),  # jumps
            ((0.7, 0.71, 0.72), (0.0, 1.0, 0.0), 0.01 * 1.29),  # a pulse of .01 s
        ):
            pull = Load(
                name="L", body="p", force=(strength, 0.0, 0.0), factor=Table(times=times, values=values)
            )
            scene = Scene(bodies=(ball,), forces=(pull,), contacts=False, gravity=(0.0, 0.0, 0.0))
            found = simulate(scene, time_step=1.0, duration=2.0, method=within(tolerance), observe=end)
            assert found["x"][0] / strength == pytest.approx(right, abs=1e-11 + 10.0 * tolerance), (
                tolerance,
                times,
            )


@pytest.mark.parametrize("step", [0.1, 0.5, 1.0, 2.0, 4.0])
def test_turns_are_counted_however_long_the_step(step: float) -> None:
    """A spring that turns a wheel by 4 rad and back; and a wheel that nothing holds, ten turns."""
    hinge = Hinge(name="h", between=(WORLD, "a"), at=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), compliance=0.0)
    wheel = RigidBody(name="a", mass=1.0, inertia=(0.1,) * 3, position=(0.0, 0.0, 0.0))
    wound = dataclasses.replace(hinge, spring=JointSpring(stiffness=2.0, rest=2.0, damping=0.0))
    weak = dataclasses.replace(hinge, spring=JointSpring(stiffness=1e-9, rest=0.0, damping=0.0))
    quick = dataclasses.replace(wheel, angular_velocity=(0.0, 0.0, 15.0))
    for body, joint, exact in (
        (wheel, wound, lambda t: 2.0 * (1.0 - np.cos(20.0**0.5 * t))),
        (quick, weak, lambda t: 15.0 * t),
    ):
        scene = Scene(bodies=(body,), constraints=(joint,), contacts=False, gravity=(0.0, 0.0, 0.0))
        run = simulate(
            scene, time_step=step, duration=4.0, method=within(1e-10), observe=traces(c=JointCoordinate("h"))
        )  # fmt: skip
        times = step * np.arange(len(run["c"]))
        assert np.ravel(run["c"]) == pytest.approx(exact(times), abs=2e-6)


def test_which_body_falls_in_is_named() -> None:
    far = Particle(name="innocent", mass=1.0, position=(50.0, 0.0, 0.0))
    near = Particle(name="dot", mass=1.0, position=(1.0, 0.0, 0.0))
    star = CentralGravity(name="star", strength=1.0, centre=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(far, near), forces=(star,), contacts=False, gravity=(0.0, 0.0, 0.0))

    run = simulate(scene, time_step=1.0, duration=3.0, method=within(1e-9))

    assert run.status != "completed" and "'dot'" in run.failure


def refused(name: str) -> tuple[Scene, Method]:
    scene = SCENES["hinges"]
    first = scene.constraints[0]
    assert isinstance(first, Hinge)
    if name == "loop":
        twice = dataclasses.replace(first, name="twice", at=(0.0, 0.0, 1.0))
        return dataclasses.replace(scene, constraints=(*scene.constraints, twice)), RK8
    if name == "soft":
        return dataclasses.replace(scene, constraints=(dataclasses.replace(first, compliance=1e-3),)), RK8
    if name == "motor":
        return dataclasses.replace(
            scene, constraints=(dataclasses.replace(first, motor=Motor(speed=1.0)),)
        ), RK8
    if name == "default damping":
        soft = dataclasses.replace(first, spring=JointSpring(stiffness=3.0))
        return dataclasses.replace(scene, constraints=(soft,)), RK8
    if name == "universal":
        cross = Universal(name="cross", between=(WORLD, "b0"), at=(0, 0, 0), axis=(1, 0, 0), cross_axis=(0, 1, 0), compliance=0.0)  # fmt: skip
        return dataclasses.replace(scene, constraints=(cross,)), RK8
    if name == "kinematic":
        moved = solid(
            "k", None, (9.0, 0.0, 0.0), velocity=(1.0, 0.0, 0.0), inertia=(1.0,) * 3, motion="kinematic"
        )
        return dataclasses.replace(scene, bodies=(*scene.bodies, moved)), RK8
    if name == "a damped rest that moves":
        spring = JointSpring(stiffness=3.0, rest=LINE, damping=0.1)
        return dataclasses.replace(scene, constraints=(dataclasses.replace(first, spring=spring),)), RK8
    if name == "distance":
        rod = Distance(name="rod", between=((0.0, 0.0, 0.0), "b0"))
        return dataclasses.replace(scene, constraints=(rod,)), RK8
    if name == "guided the wrong way":
        plane = Planar(
            name="plane", between=("b0", WORLD), at=(0.5, 0.0, 0.0), axis=(0.0, 0.0, 1.0), compliance=0.0
        )
        return dataclasses.replace(scene, constraints=(plane,)), RK8
    return scene, Method(runge_kutta="order8", solver="iterative")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("loop", "'twice' closes a loop; use composition='order8'"),
        ("soft", "runge_kutta holds rows rigidly, but 'hinge world b0' has a compliance"),
        ("motor", "the motor of 'hinge world b0' drives one"),
        (
            "default damping",
            "the spring of 'hinge world b0' as a force, and its damping would be two time steps",
        ),
        ("universal", "universal 'cross' has none here"),
        ("kinematic", "'k' moves as it is told"),
        ("a damped rest that moves", "how fast the rest of 'hinge world b0' moves"),
        ("distance", "distance 'rod' has none here"),
        ("guided the wrong way", "name first what carries them"),
        ("iterative", "runge_kutta needs the direct solver"),
    ],
)
def test_what_has_no_joint_coordinates_is_refused_by_name(name: str, said: str) -> None:
    scene, method = refused(name)
    with pytest.raises(MethodError, match=said):
        simulate(scene, time_step=0.01, steps=1, method=method)


def test_a_step_that_no_part_of_fits_is_told() -> None:
    """A body that falls into a centre: its acceleration grows without end."""
    dot = Particle(name="dot", mass=1.0, position=(1.0, 0.0, 0.0))
    star = engine.CentralGravity(name="star", strength=1.0, centre=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(dot,), forces=(star,), gravity=(0.0, 0.0, 0.0))
    run = simulate(scene, time_step=0.5, steps=10, method=within(1e-9))
    assert run.status == "diverged"
    assert "dot" in str(run.failure)
