"""Motors, joint springs and limits of hinges and rails, against exact discrete answers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    ConstraintForce,
    Final,
    Hinge,
    JointCoordinate,
    JointSpring,
    Limit,
    Load,
    Maximum,
    Method,
    Minimum,
    Motor,
    PotentialEnergy,
    Prismatic,
    RigidBody,
    Scene,
    Sinusoid,
    Trace,
    Velocity,
    simulate,
    start,
)
from tests.oracles.particles import Array

GRAVITY = 9.81  # m/s²
MASS, MOMENT = 2.0, 0.5  # kg and kg m² about the axis
AXIS = (0.0, 0.6, 0.8)


def wheel(spin: float = 0.0, **drive: object) -> Scene:
    """A body on a hinge through its centre, without gravity."""
    body = RigidBody(
        name="body",
        mass=MASS,
        inertia=(MOMENT, MOMENT, MOMENT),
        position=(1.0, 2.0, 3.0),
        angular_velocity=tuple(spin * np.array(AXIS)),
    )
    hinge = Hinge(name="joint", between=(WORLD, "body"), axis=AXIS, **drive)  # type: ignore[arg-type]
    return Scene(bodies=(body,), constraints=(hinge,))


def lift(speed: float = 0.0, **drive: object) -> Scene:
    """A body on a vertical rail, with gravity."""
    body = RigidBody(
        name="body", mass=MASS, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, speed)
    )
    rail = Prismatic(name="joint", between=(WORLD, "body"), axis=(0.0, 0.0, 1.0), **drive)  # type: ignore[arg-type]
    return Scene(bodies=(body,), constraints=(rail,), gravity=(0.0, 0.0, -GRAVITY))


def coordinate(scene: Scene, h: float, steps: int) -> Array:
    observe = {"s": Trace(quantity=JointCoordinate("joint"))}
    return simulate(scene, time_step=h, steps=steps, observe=observe)["s"]  # type: ignore[no-any-return]


@pytest.mark.parametrize("h", [1e-3, 1 / 60])
@pytest.mark.parametrize("speed", [3.0, -0.5])
def test_t13_an_unbounded_motor_reaches_its_speed_in_one_step(speed: float, h: float) -> None:
    observe = {"w": Trace(quantity=AngularVelocity("body")), "v": Trace(quantity=Velocity("body"))}
    turning = simulate(wheel(motor=Motor(speed=speed)), time_step=h, steps=5, observe=observe)["w"][1:] @ AXIS
    rising = simulate(lift(motor=Motor(speed=speed)), time_step=h, steps=5, observe=observe)["v"][1:, 2]

    assert np.abs(turning - speed).max() < 1e-12
    assert np.abs(rising - speed).max() < 1e-12


def test_a_bounded_motor_pushes_with_its_force_until_it_reaches_its_speed() -> None:
    h, torque, speed = 0.01, 1.5, 0.5
    observe = {"w": Trace(quantity=AngularVelocity("body")), "f": Trace(quantity=ConstraintForce("joint"))}
    result = simulate(
        wheel(motor=Motor(speed=speed, max_force=torque)), time_step=h, steps=40, observe=observe
    )
    n = np.arange(41)

    assert np.abs(result["w"] @ AXIS - np.minimum(n * h * torque / MOMENT, speed)).max() < 1e-12
    assert result["f"][10][3:] @ AXIS == pytest.approx(torque, rel=1e-10)
    assert abs(result["f"][30][3:] @ AXIS) < 1e-9


def test_a_motor_too_weak_for_the_weight_is_dragged_along() -> None:
    h, force = 0.01, 15.0  # N; the weight is 19.62 N
    observe = {"v": Trace(quantity=Velocity("body"))}
    v = simulate(lift(motor=Motor(speed=0.3, max_force=force)), time_step=h, steps=50, observe=observe)["v"]

    assert np.abs(v[:, 2] - (force / MASS - GRAVITY) * h * np.arange(51)).max() < 1e-11


def test_a_motor_of_no_force_does_nothing() -> None:
    assert np.abs(coordinate(wheel(motor=Motor(speed=5.0, max_force=0.0)), 0.01, 20)).max() < 1e-15


@pytest.mark.parametrize("theta", [0.5, 2.0])
def test_a_joint_spring_turns_its_body_by_the_powers_of_one_matrix(theta: float) -> None:
    """The spin follows the one-row matrix of T1 with the moment for the mass."""
    h, stiffness, rest, spin = 0.01, 40.0, 0.3, 0.8
    spread = 1.0 + 4.0 * theta
    rho = 1.0 / (1.0 + MOMENT * 4.0 / (stiffness * h**2 * spread))
    a, b = 4.0 / (h * spread), 4.0 * theta / spread
    step = np.array([[1.0 - rho * a * h, h * (1.0 - rho * b)], [-rho * a, 1.0 - rho * b]])
    spring = JointSpring(stiffness=stiffness, rest=rest, damping=theta * h)
    observe = {"w": Trace(quantity=AngularVelocity("body"))}
    w = simulate(wheel(spin, spring=spring), time_step=h, steps=60, observe=observe)["w"] @ AXIS
    stretch, rate = -rest, spin
    for n in range(1, 61):
        rate = step[1] @ (stretch, rate)
        stretch += h * rate
        assert w[n] == pytest.approx(rate, abs=1e-11)
    assert coordinate(wheel(spin, spring=spring), h, 60)[-1] == pytest.approx(stretch + rest, abs=1e-11)


def test_a_sprung_rail_rests_where_spring_and_weight_balance() -> None:
    spring = JointSpring(stiffness=500.0, rest=0.1, damping=0.1)

    assert coordinate(lift(spring=spring), 0.01, 5000)[-1] == pytest.approx(
        0.1 - MASS * GRAVITY / 500.0, abs=1e-10
    )


def test_a_spring_and_a_motor_share_a_joint() -> None:
    """The motor holds its speed against the spring and says with what force."""
    h, speed, stiffness = 0.01, 0.2, 100.0
    drives = {"motor": Motor(speed=speed), "spring": JointSpring(stiffness=stiffness)}

    assert coordinate(lift(**drives), h, 50) == pytest.approx(speed * h * np.arange(51), abs=1e-12)


@pytest.mark.parametrize("h", [1e-3, 1 / 60])
@pytest.mark.parametrize("eps", [1e-8, 1e-5])
def test_a_body_rests_on_its_limit_with_compliance_times_weight(eps: float, h: float) -> None:
    """g = −eps F, whatever the step; the rail then carries the whole weight."""
    scene = lift(limit=Limit(lower=-0.05, upper=1.0, compliance=eps, damping=0.05))
    observe = {"s": Final(quantity=JointCoordinate("joint")), "f": Final(quantity=ConstraintForce("joint"))}
    result = simulate(scene, time_step=h, duration=5.0, observe=observe)

    assert float(result["s"]) == pytest.approx(-0.05 - eps * MASS * GRAVITY, abs=1e-9 * (1.0 + eps / 1e-8))
    assert result["f"][2] == pytest.approx(MASS * GRAVITY, rel=1e-6)


@pytest.mark.parametrize(("speed", "bound"), [(4.0, "upper"), (-4.0, "lower")])
def test_a_limit_stops_a_body_and_lets_it_go_again(speed: float, bound: str) -> None:
    """It never passes by more than a step's way, is not thrown back faster than it came, and can leave."""
    h = 0.01
    scene = wheel(speed, limit=Limit(lower=-0.5, upper=0.5))
    angle = coordinate(scene, h, 200)
    side = 1.0 if bound == "upper" else -1.0

    assert (side * angle).max() < 0.5 + 0.5 * abs(speed) * h
    assert (side * angle).max() > 0.5 - abs(speed) * h
    back = -side * np.diff(angle) / h
    assert back.max() < 0.5 * abs(speed)
    driven = simulate(
        wheel(speed, limit=Limit(lower=-0.5, upper=0.5), motor=Motor(speed=-side * 1.0, max_force=10.0)),
        time_step=h,
        steps=60,
        observe={"s": Trace(quantity=JointCoordinate("joint"))},
    )
    assert side * driven["s"][-1] < 0.3


def test_a_motor_runs_into_a_limit_and_holds_there() -> None:
    observe = {
        "top": Maximum(quantity=JointCoordinate("joint")),
        "bottom": Minimum(quantity=JointCoordinate("joint")),
        "end": Final(quantity=JointCoordinate("joint")),
    }
    scene = wheel(motor=Motor(speed=1.0, max_force=2.0), limit=Limit(lower=-0.2, upper=0.2))
    result = simulate(scene, time_step=0.01, steps=300, observe=observe)

    assert float(result["end"]) == pytest.approx(0.2 + 1e-8 * 2.0, abs=1e-9)
    assert float(result["top"]) < 0.2 + 0.01
    assert float(result["bottom"]) >= 0.0


def test_equal_limits_hold_a_joint_still() -> None:
    angle = coordinate(
        wheel(0.0, limit=Limit(lower=0.0, upper=0.0), motor=Motor(speed=1.0, max_force=3.0)), 0.01, 100
    )

    assert np.abs(angle).max() < 1e-6


@pytest.mark.parametrize("half", [False, True])
def test_the_energy_of_a_spring_is_that_about_its_rest_of_the_moment(half: bool) -> None:
    """Where the rest moves: not about that of the step before; and after going back it is what it was."""
    h, stiffness, rest = 0.01, 40.0, Sinusoid(amplitude=0.3, frequency=0.5)
    scene = wheel(1.0, spring=JointSpring(stiffness=stiffness, rest=rest))
    energy, method = {"u": PotentialEnergy()}, Method(half_step_velocities=half)
    observe = {"u": Trace(quantity=PotentialEnergy()), "s": Trace(quantity=JointCoordinate("joint"))}
    run = simulate(scene, time_step=h, steps=100, method=method, observe=observe)
    rests = np.array([rest(h * k) for k in range(101)])

    np.testing.assert_allclose(run["u"], 0.5 * stiffness * (run["s"] - rests) ** 2, rtol=1e-12, atol=1e-15)
    with start(scene, time_step=h, method=method, observe=energy) as held:
        held.step(30)
        kept, before = held.save(), float(held["u"])
        held.step(20)
        held.restore(kept)
        assert float(held["u"]) == before == run["u"][30]


def test_a_broken_spring_holds_no_energy() -> None:
    """A load of 20 N on a rail that bears 10 N across: it breaks in the first step, and takes its spring along."""
    scene = lift(spring=JointSpring(stiffness=100.0, rest=0.2))
    (rail,) = scene.constraints
    push = Load(name="push", body="body", force=(20.0, 0.0, 0.0))
    weak = dataclasses.replace(rail, strength=10.0)
    scene = dataclasses.replace(scene, constraints=(weak,), forces=(push,), gravity=(0.0, 0.0, 0.0))
    run = simulate(scene, time_step=0.01, steps=3, observe={"u": Trace(quantity=PotentialEnergy())})

    assert [joint.step for joint in run.broken] == [1]
    assert run["u"][0] == pytest.approx(0.5 * 100.0 * 0.2**2)
    assert not run["u"][1:].any()
