"""What spins steadily off its joint goes on as a rigid body does: its energy and its spin stay, whatever solves its rows.

Linear rows lose most of it. A third of a radian a step here, at 1/60 s.
"""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    PLAIN,
    WORLD,
    Ball,
    Energy,
    Hinge,
    JointCoordinate,
    JointSpring,
    KineticEnergy,
    Limit,
    Lock,
    Material,
    MaximumAbsolute,
    Method,
    Motor,
    Plane,
    Position,
    RigidBody,
    Scene,
    Sphere,
    Violation,
    compile,
    simulate,
)
from tests.scenes.seen import finals, traces

SPIN, ARM, SECONDS, G = 20.0, 0.1, 10.0, 9.81
CURVED = Method(corrections=2)
HALF = Method(corrections=2, half_step_velocities=True)


def wheel(**axle: object) -> Scene:
    body = RigidBody(
        name="wheel", mass=1.0, inertia=(0.01, 0.01, 0.01), position=(ARM, 0.0, 0.0),
        velocity=(0.0, SPIN * ARM, 0.0), angular_velocity=(0.0, 0.0, SPIN),
    )  # fmt: skip
    joint = Hinge(name="axle", between=(WORLD, "wheel"), at=(0.0, 0.0, 0.0), compliance=0.0, **axle)  # type: ignore[arg-type]
    return Scene(bodies=(body,), constraints=(joint,))


def boxes() -> Scene:
    """Three, locked in a row, that float."""
    parts = tuple(
        RigidBody(
            name=f"box {i}", mass=1.0, inertia=(1 / 6, 1 / 6, 1 / 6), position=(i - 1.0, 0.0, 0.0),
            velocity=(0.0, SPIN * (i - 1.0), 0.0), angular_velocity=(0.0, 0.0, SPIN),
        ) for i in range(3)
    )  # fmt: skip
    locks = tuple(
        Lock(name=f"lock {i}", between=(f"box {i}", f"box {i + 1}"), at=(i - 0.5, 0.0, 0.0)) for i in range(2)
    )
    return Scene(bodies=parts, constraints=locks)


def beside_a_floor(scene: Scene) -> Scene:
    """With a ball on a floor far away, so that contacts take part in every step."""
    floor = RigidBody(name="floor", position=(0.0, 0.0, -9.0), shape=Plane(), motion="static")
    ball = RigidBody(name="ball", mass=1.0, position=(0.0, 9.0, -8.9), shape=Sphere(0.1), material=Material())
    return dataclasses.replace(scene, bodies=(*scene.bodies, floor, ball))


RUBS = wheel(motor=Motor(speed=0.0, max_force=1e-9))
USUAL = Method()
SCENES = {
    "at the default": (wheel(), USUAL, 0.02),
    "locked, at the default": (boxes(), USUAL, 0.03),
    "beside a floor, at the default": (beside_a_floor(wheel()), USUAL, 0.02),
    "by iterations, at the default": (wheel(), Method(solver="iterative", iterations=200), 0.02),
    "a bounded motor, at the default": (RUBS, USUAL, 0.02),
    "direct": (wheel(), HALF, 0.01),
    "locked": (boxes(), HALF, 0.01),
    "beside a floor": (beside_a_floor(wheel()), HALF, 0.01),
    "a bounded motor": (RUBS, CURVED, 0.02),
    "by iterations": (wheel(), dataclasses.replace(CURVED, solver="iterative", iterations=200), 0.02),
}


def kept(scene: Scene, method: Method, h: float = 1 / 60) -> float:
    run = simulate(
        scene, time_step=h, duration=SECONDS, method=method, observe=traces(energy=KineticEnergy())
    )
    assert run.completed
    return float(run["energy"][-1] / run["energy"][0])


@pytest.mark.parametrize("name", SCENES)
def test_a_steady_spin_keeps_its_energy(name: str) -> None:
    scene, method, least = SCENES[name]

    assert kept(scene, method) == pytest.approx(1.0, abs=least)
    assert kept(scene, method, 1 / 240) == pytest.approx(1.0, abs=least / 10)


def test_linear_rows_do_not_and_explain_says_so() -> None:
    assert kept(wheel(), PLAIN) < 0.5
    told = {
        choice.stage: choice.reason for choice in compile(wheel(), time_step=0.01, method=PLAIN).explain()
    }
    assert 'turns="followed" and corrections=2 keep its energy' in told["correct_curvature"]


def around_a_wheel(joint: type[Ball] | type[Lock], turn: float, led: bool) -> tuple[Scene, float]:
    """A weight 1 m off the axle of a wheel that turns so far in a step, led by its motion or by a motor; and its spin."""
    spin = turn * 60.0
    moving = {"motion": "kinematic"} if led else {"mass": 50.0, "inertia": (5.0, 5.0, 5.0)}
    bodies = (
        RigidBody(name="wheel", angular_velocity=(0.0, 0.0, spin), position=(0.0, 0.0, 0.0), **moving),  # type: ignore[arg-type]
        RigidBody(
            name="weight", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0),
            velocity=(0.0, spin, 0.0), angular_velocity=(0.0, 0.0, spin),
        ),
    )  # fmt: skip
    held = joint(name="held", between=("wheel", "weight"), at=(1.0, 0.0, 0.0))
    axle = Hinge(name="axle", between=(WORLD, "wheel"), motor=Motor(speed=spin))
    return Scene(bodies=bodies, constraints=(held,) if led else (axle, held)), spin


@pytest.mark.parametrize("led", [True, False])
@pytest.mark.parametrize("joint", [Ball, Lock])
@pytest.mark.parametrize("turn", [0.05, 1 / 3, 0.95, 1.5, 3.3])
def test_what_is_held_by_a_wheel_stays_at_its_arm(
    joint: type[Ball] | type[Lock], turn: float, led: bool
) -> None:
    """However far the wheel turns in a step. Linear rows hold it at 1.16 m at a third of a radian, and at 1e58 m at three."""
    scene, _ = around_a_wheel(joint, turn, led)
    run = simulate(scene, time_step=1 / 60, duration=2.0, observe=finals(x=Position("weight")))

    assert run.completed
    assert np.linalg.norm(run["x"]) == pytest.approx(1.0, abs=2e-3)


def test_what_is_found_off_its_joint_by_more_than_its_arms_is_told() -> None:
    scene, _ = around_a_wheel(Lock, 3.3, True)
    run = simulate(scene, time_step=1 / 60, duration=2.0, method=PLAIN)

    assert run.status == "unsettled" and "off its joint, further than the joint's arms reach" in run.failure


@pytest.mark.parametrize("turn", [0.4, 1.2, 1.7])
def test_a_level_gyroscope_precesses_however_far_it_turns_in_a_step(turn: float) -> None:
    """A symmetric body on a ball joint on its axis: Ω = m g l/(J ω), level to the nod that the first step's kick begins."""
    h, length, along = 1 / 240, 0.1, 0.002
    spin = turn / h
    slow = G * length / (along * spin)
    body = RigidBody(
        name="top", mass=1.0, inertia=(along, 0.0015, 0.0015), position=(length, 0.0, 0.0),
        angular_velocity=(spin, 0.0, slow), velocity=(0.0, length * slow, 0.0),
    )  # fmt: skip
    joint = Ball(name="pivot", between=(WORLD, "top"), at=(0.0, 0.0, 0.0))
    scene = Scene(bodies=(body,), constraints=(joint,), gravity=(0.0, 0.0, -G))

    run = simulate(scene, time_step=h, duration=2.0, observe=traces(x=Position("top"), energy=Energy()))

    assert run.completed
    assert np.abs(run["x"][:, 2]).max() < 0.03 * length
    assert np.ptp(run["energy"]) < 0.02 * G * length
    angle = np.unwrap(np.arctan2(run["x"][:, 1], run["x"][:, 0]))
    assert angle[-1] / (2.0 * slow) == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(("h", "most"), [(1 / 480, 0.05), (1 / 960, 0.01)])
def test_a_leaning_top_that_is_let_go_nods_as_lagranges_does(h: float, most: float) -> None:
    """100 rad/s, from rest at 45°: its height, to a share of the arm, against dθ²/dt² with p_ψ and p_φ kept, to 1e-10."""
    arm, mass, along, across, spin, lean = 0.05, 0.5, 4e-4, 3e-4, 100.0, 0.25 * math.pi
    about = across + mass * arm * arm

    def nod(_: float, y: tuple[float, float]) -> tuple[float, float]:
        theta, rate = y
        turning = along * spin * (math.cos(lean) - math.cos(theta)) / (about * math.sin(theta) ** 2)
        torque = about * turning**2 * math.cos(theta) - along * spin * turning + mass * G * arm
        return rate, math.sin(theta) * torque / about

    axis = np.array([math.sin(lean), 0.0, math.cos(lean)])
    top = RigidBody(
        name="top", mass=mass, inertia=(across, across, along), position=tuple(arm * axis), angular_velocity=tuple(spin * axis),
        orientation=(math.cos(0.5 * lean), 0.0, math.sin(0.5 * lean), 0.0),
    )  # fmt: skip
    joint = Ball(name="pivot", between=(WORLD, "top"), at=(0.0, 0.0, 0.0), compliance=0.0)
    scene = Scene(bodies=(top,), constraints=(joint,), gravity=(0.0, 0.0, -G))

    run = simulate(scene, time_step=h, duration=2.0, observe=traces(x=Position("top")))

    times = h * np.arange(len(run["x"]))
    true = solve_ivp(nod, (0.0, 2.0), (lean, 0.0), t_eval=times, rtol=1e-10, atol=1e-12).y[0]
    assert np.ptp(np.cos(true)) > 0.1
    assert np.abs(run["x"][:, 2] / arm - np.cos(true)).max() < most


@pytest.mark.parametrize("name", ["direct", "a bounded motor", "by iterations"])
def test_it_turns_as_far_as_its_spin_says(name: str) -> None:
    """To second order."""
    scene, method, _ = SCENES[name]

    def wrong(h: float) -> float:
        observe = finals(angle=JointCoordinate("axle"))
        return (
            float(simulate(scene, time_step=h, duration=SECONDS, method=method, observe=observe)["angle"])
            / (SPIN * SECONDS)
            - 1.0
        )

    assert abs(wrong(1 / 60)) < 0.02
    assert math.log2(wrong(1 / 120) / wrong(1 / 240)) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("turn", [0.1, 0.7])
def test_a_motor_turns_as_fast_as_it_is_told_about_any_axis(turn: float) -> None:
    """The spin of a body with three moments, about none of its own axes, bends within a step, to first order."""
    steps = 400
    body = RigidBody(name="box", mass=1.0, inertia=(1.0, 2.0, 3.0), position=(0.0, 0.0, 0.0))
    motor = Motor(speed=turn * 60.0)
    axle = Hinge(name="axle", between=(WORLD, "box"), axis=(1.0, 2.0, 3.0), compliance=0.0, motor=motor)
    run = simulate(
        Scene(bodies=(body,), constraints=(axle,)),
        time_step=1 / 60,
        steps=steps,
        observe=traces(angle=JointCoordinate("axle")),
    )

    assert run["angle"][-1] - run["angle"][steps // 2] == pytest.approx(turn * steps / 2, rel=1e-6)


def rods(motor: Motor | None, count: int = 2) -> Scene:
    """Let go level, about an axis across."""
    bodies = tuple(
        RigidBody(name=f"rod {k}", mass=1.0, inertia=(0.01, 1 / 12, 1 / 12), position=(k + 0.5, 0.0, 0.0))
        for k in range(count)
    )
    joints = tuple(
        Hinge(
            name=f"hinge {k}", between=(f"rod {k - 1}" if k else WORLD, f"rod {k}"), at=(float(k), 0.0, 0.0),
            axis=(0.0, 1.0, 0.0), compliance=0.0, motor=motor,
        ) for k in range(count)
    )  # fmt: skip
    return Scene(bodies=bodies, constraints=joints, gravity=(0.0, 0.0, -9.81))


def test_bounded_rows_win_the_orders_of_the_violation_that_held_ones_do() -> None:
    """h² of linear rows, h⁴ with two corrections, of a double pendulum whose motors are too weak to be felt."""

    def largest(h: float, method: Method) -> float:
        observe = {"g": MaximumAbsolute(quantity=Violation("hinge 1"))}
        scene = rods(Motor(speed=0.0, max_force=1e-12))
        return float(simulate(scene, time_step=h, duration=1.0, method=method, observe=observe)["g"].max())

    plain, curved = ([largest(h, m) for h in (1 / 60, 1 / 120)] for m in (PLAIN, CURVED))
    assert math.log2(plain[0] / plain[1]) == pytest.approx(2.0, abs=0.2)
    assert math.log2(curved[0] / curved[1]) > 3.5
    assert curved[1] < plain[1] / 1000


TOO_WEAK = Motor(speed=0.0, max_force=1e-9)  # to be felt


@pytest.mark.parametrize(("h", "status"), [(1 / 60, "unsettled"), (1 / 240, "completed")])
def test_energy_that_corrections_make_of_long_steps_is_told(h: float, status: str) -> None:
    """A whip of ten rods: 191 J of 597 came out of nothing on the way, and were lost again by the end."""
    run = simulate(rods(TOO_WEAK, 10), time_step=h, duration=10.0, method=CURVED)

    assert run.status == status
    assert ("191 J that came out of nothing" in run.failure) == (status == "unsettled")


@pytest.mark.parametrize(("h", "status"), [(1 / 60, "unsettled"), (1 / 240, "completed")])
def test_so_is_that_of_joints_alone_in_space(h: float, status: str) -> None:
    """A hanging chain of ten bars of .1 to 1 kg that begin at some 20 rad/s about any axis: 254 J from nowhere."""
    at = np.random.default_rng(0)
    bodies, joints = [], []
    for i in range(10):
        mass = 0.1 + 0.9 * at.random()
        spin, way = 20.0 * at.standard_normal(3), at.standard_normal(3)
        bodies.append(
            RigidBody(
                name=f"bar {i}",
                mass=mass,
                inertia=(0.01 * mass, 0.08 * mass, 0.08 * mass),
                position=(i + 0.5, 0.0, 0.0),
                velocity=tuple(way),
                angular_velocity=tuple(spin),
            )
        )
        above = WORLD if i == 0 else f"bar {i - 1}"
        joints.append(Hinge(name=f"hinge {i}", between=(above, f"bar {i}"), at=(float(i), 0.0, 0.0)))
    chain = Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=(0.0, 0.0, -9.81))

    run = simulate(chain, time_step=h, duration=4.0, method=CURVED)

    assert run.status == status
    assert ("came out of nothing" in run.failure) == (status == "unsettled")


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.3, 1.0, 0.0)])
def test_so_is_that_of_half_steps(axis: tuple[float, float, float]) -> None:
    """5 t thrown on four rods of 1 kg, in a plane and in space: a fifth of the throw and more from nowhere, as `Energy` shows."""
    bodies = [
        RigidBody(name=f"rod {k}", mass=1.0, inertia=(1 / 12, 1 / 12, 0.01), position=(0.0, 0.0, -k - 0.5))
        for k in range(4)
    ]
    bodies.append(
        RigidBody(
            name="load",
            mass=5e3,
            inertia=(250.0,) * 3,
            position=(0.0, 0.0, -4.3),
            velocity=(3.0, 0.0, 0.0),
        )
    )
    joints = tuple(
        Hinge(
            name=f"hinge {k}", between=(bodies[k - 1].name if k else WORLD, body.name), at=(0.0, 0.0, -float(k)),
            axis=axis, compliance=0.0,
        ) for k, body in enumerate(bodies)
    )  # fmt: skip
    scene = Scene(bodies=tuple(bodies), constraints=joints, gravity=(0.0, 0.0, -G))
    method = dataclasses.replace(HALF, string_stiffness=True)

    run = simulate(scene, time_step=1 / 960, duration=4.0, method=method, observe=traces(energy=Energy()))

    gained = run["energy"].max() - run["energy"][0]
    assert gained > 0.1 * 22500.0
    assert run.status == "unsettled" and "came out of nothing" in run.failure


def hanging(**axle: object) -> Scene:
    body = RigidBody(name="arm", mass=1.0, inertia=(0.1,) * 3, position=(1.0, 0.0, 0.0))
    joint = Hinge(name="axle", between=(WORLD, "arm"), at=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0), **axle)  # type: ignore[arg-type]
    return Scene(bodies=(body,), constraints=(joint,), gravity=(0.0, 0.0, -9.81))


GIVEN = {
    "a motor": hanging(motor=Motor(speed=5.0, max_force=30.0)),
    "a force": hanging(motor=Motor(force=-12.0), limit=Limit(lower=-9.0, upper=9.0)),
    "a spring that gives way": hanging(spring=JointSpring(stiffness=40.0, rest=0.0, max_force=2.0)),
    "a limit begun beyond": hanging(limit=Limit(lower=-9.0, upper=-0.1)),
}


@pytest.mark.parametrize("name", GIVEN)
def test_energy_that_is_given_does_not_come_out_of_nothing(name: str) -> None:
    observe = traces(energy=Energy())
    run = simulate(GIVEN[name], time_step=1 / 60, duration=1.0, method=CURVED, observe=observe)

    assert run.completed
    assert run["energy"].max() > run["energy"][0] + 0.1
