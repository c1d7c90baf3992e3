"""Relations between joint coordinates: ratios, torques and reactions, against closed forms and dense NumPy steps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    ConstraintForce,
    Final,
    JointCoordinate,
    Limit,
    Load,
    MaximumAbsolute,
    Method,
    Motor,
    Prismatic,
    Relation,
    Scene,
    Trace,
    Velocity,
    Violation,
    simulate,
)
from tests.scenes.coupling import H, X, axle, pair, rotor


@pytest.mark.parametrize(
    "method", [Method(), Method(solver="iterative", iterations=2000), Method(corrections=1)]
)
def test_gears_share_a_torque_as_their_teeth_say(method: Method) -> None:
    # a = T/(J_a + J_b (z_a/z_b)²) is steady: exact in the velocities of small turns.
    scene = pair(torque=1e-3)
    observe = {"mesh": Final(quantity=ConstraintForce("mesh"))}
    result = simulate(scene, time_step=H, steps=100, method=method, observe=observe)
    ratio, a = 1.5, 1e-3 / (1.0 + 4.0 * 1.5**2)
    w = result.final_state["a"][12], result.final_state["b"][12]

    assert w[0] == pytest.approx(a, rel=1e-8)
    assert w[1] == pytest.approx(-ratio * a, rel=1e-8)
    assert 2.0 * float(result["mesh"]) == pytest.approx(-4.0 * ratio * a, rel=1e-7)


def test_a_compliant_relation_is_the_row_of_the_method() -> None:
    """The discrete step of M, G = (3, 2) by hand, in the angles a hinge of tiny turns has."""
    eps, theta, mass = 2e-3, 2.0, np.diag([1.0, 4.0])
    ups = 1.0 / (1.0 + 4.0 * theta)
    sig = 4.0 * eps * ups / H**2
    g = np.array([[3.0, 2.0]])
    q, v = np.zeros(2), np.zeros(2)
    turned = [q.copy()]
    for _ in range(80):
        kkt = np.block([[mass, -g.T], [g, np.array([[sig]])]])
        right = np.concatenate([mass @ v + H * np.array([1e-4, 0.0]), -4.0 / H * ups * g @ q + ups * g @ v])
        v = np.linalg.solve(kkt, right)[:2]
        q = q + H * v
        turned.append(q.copy())
    observe = {k: Trace(quantity=JointCoordinate(f"{k} axle")) for k in "ab"}
    result = simulate(pair(compliance=eps, torque=1e-4), time_step=H, steps=80, observe=observe)

    np.testing.assert_allclose(np.stack([result["a"], result["b"]], axis=1), turned, rtol=0, atol=1e-13)


def test_ratios_hold_over_many_turns_and_turns_are_counted() -> None:
    scene = pair(torque=0.0, motor=Motor(speed=20.0))
    observe = {
        "a": Final(quantity=JointCoordinate("a axle")),
        "b": Final(quantity=JointCoordinate("b axle")),
        "off": MaximumAbsolute(quantity=Violation("mesh")),
    }
    result = simulate(scene, time_step=1e-3, steps=10_000, observe=observe)

    assert float(result["a"]) == pytest.approx(200.0, abs=1e-10)
    assert 3.0 * float(result["a"]) + 2.0 * float(result["b"]) == pytest.approx(0.0, abs=1e-10)
    assert float(result["off"]) < 1e-10


def test_a_rack_and_a_screw_turn_a_push_into_a_turn() -> None:
    for coefficient in (0.25, -0.05 / (2.0 * math.pi)):  # radius; pitch
        slide = Prismatic(name="slide", between=(WORLD, "rack"), axis=X, compliance=0.0)
        relation = Relation(name="mesh", terms=(("slide", 1.0), ("pinion axle", coefficient)), compliance=0.0)
        scene = Scene(
            bodies=(rotor("rack", 1.0, mass=3.0), rotor("pinion", 0.2, 5.0)),
            constraints=(slide, axle("pinion"), relation),
            forces=(Load(name="push", body="rack", force=(1e-3, 0.0, 0.0)),),
        )
        state = simulate(scene, time_step=H, steps=100).final_state
        a = 1e-3 / (3.0 + 0.2 / coefficient**2)

        assert state["rack"][7] == pytest.approx(a, rel=1e-8)
        assert state["pinion"][12] == pytest.approx(-a / coefficient, rel=1e-8)


@pytest.mark.parametrize(("near", "far"), [(0.3, 0.1), (0.1, 0.4)])
def test_a_belt_turns_both_pulleys_the_same_way_and_pulls_with_one_force(near: float, far: float) -> None:
    """r₁ φ₁ = r₂ φ₂, whatever lies between: I₁ a₁ = T − r₁ S, I₂ a₂ = r₂ S, S the pull of one side over the other."""
    belt = Relation(name="belt", terms=(("near axle", near), ("far axle", -far)), compliance=0.0)
    scene = Scene(
        bodies=(rotor("near", 1.0), rotor("far", 2.0)),
        constraints=(axle("near"), axle("far"), belt),
        forces=(Load(name="push", body="near", torque=(0.0, 0.0, 1e-3)),),
    )
    observe = {"pull": Final(quantity=ConstraintForce("belt"))}
    result = simulate(scene, time_step=H, steps=100, observe=observe)
    moments = (scene.bodies[0].inertia[2], scene.bodies[1].inertia[2])
    first, pull = np.linalg.solve(
        np.array(((moments[0], near), (moments[1] * near / far, -far))), (1e-3, 0.0)
    )
    w = result.final_state["near"][12], result.final_state["far"][12]

    assert w == pytest.approx((100 * H * first, 100 * H * first * near / far), rel=1e-8)
    assert abs(float(result["pull"])) == pytest.approx(pull, rel=1e-7)


def test_a_differential_gives_both_sides_half_the_torque() -> None:
    wheels = (rotor("left", 1.0), rotor("right", 2.0, 1.0), rotor("cage", 0.5, 2.0))
    relation = Relation(
        name="differential",
        terms=(("left axle", 1.0), ("right axle", 1.0), ("cage axle", -2.0)),
        compliance=0.0,
    )
    scene = Scene(
        bodies=wheels,
        constraints=(*(axle(wheel.name) for wheel in wheels), relation),
        forces=(Load(name="engine", body="cage", torque=(0.0, 0.0, 1e-3)),),
    )
    result = simulate(scene, time_step=H, steps=100)
    w = {name: state[12] for name, state in result.final_state.items()}

    assert w["left"] + w["right"] == pytest.approx(2.0 * w["cage"], rel=1e-9)
    assert 1.0 * w["left"] == pytest.approx(2.0 * w["right"], rel=1e-9)  # equal torques
    # T = J_c w_c' + 2 S, S = J_l w_l' = J_r w_r'
    assert 0.5 * w["cage"] + 2.0 * w["left"] == pytest.approx(1e-3, rel=1e-9)


def test_the_casing_feels_what_the_gears_do_not_balance() -> None:
    """Held still by two torques in the ratio of the teeth, the axles' bearings carry the sum."""
    gears = pair(torque=3.0)
    back = Load(name="back", body="b", torque=(0.0, 0.0, 2.0))
    scene = Scene(bodies=gears.bodies, constraints=gears.constraints, forces=(*gears.forces, back))
    observe = {"mesh": Final(quantity=ConstraintForce("mesh")), "w": MaximumAbsolute(quantity=Velocity())}
    result = simulate(scene, time_step=H, steps=50, observe=observe)

    assert float(result["mesh"]) == pytest.approx(-1.0, rel=1e-12)
    assert abs(result.final_state["a"][12]) < 1e-15


def test_bounded_rows_and_contacts_go_with_relations_of_two_bodies() -> None:
    scene = pair(torque=5.0, limit=Limit(lower=-1.0, upper=0.3))
    observe = {"b": Trace(quantity=JointCoordinate("b axle"))}
    turned = simulate(scene, time_step=H, steps=600, observe=observe)["b"]

    assert float(turned[-1]) == pytest.approx(-0.45, abs=1e-6)
