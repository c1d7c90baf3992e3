"""Inertia that goes with a joint's coordinate: against statics, a tight integration, momentum, and MuJoCo's Runge-Kutta."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Box,
    Energy,
    Final,
    Hinge,
    JointCoordinate,
    JointSpring,
    Load,
    Material,
    Method,
    MethodError,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Sphere,
    Velocity,
    simulate,
    start,
)
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, traces

HALF = Method(half_step_velocities=True)
CORRECTED = Method(half_step_velocities=True, corrections=2)
FAR_FLOOR = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, -10.0))
MASS, MOMENT, ARM, ROTOR = 2.0, 0.05, 0.4, 0.7  # kg, kg m², m, kg m²


def pendulum(floor: bool = False, **hinge: Any) -> Scene:
    """A bob on a hinge, let go level; maybe above a floor that it does not reach."""
    bob = solid("bob", Sphere(0.05), (ARM, 0.0, 0.0), MASS, inertia=(MOMENT, MOMENT, MOMENT))
    joint = Hinge(
        name="joint",
        between=(WORLD, "bob"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, 1.0, 0.0),
        compliance=0.0,
        **hinge,
    )
    return Scene(
        bodies=(bob, *([FAR_FLOOR] if floor else [])), constraints=(joint,), gravity=(0.0, 0.0, -9.81)
    )


@pytest.mark.parametrize(
    ("method", "order"), [(Method(), 1.0), (HALF, 2.0), (CORRECTED, 2.0), (Method(solver="iterative"), 1.0)]
)
@pytest.mark.parametrize("floor", [False, True])
def test_a_pendulum_falls_by_the_sum_of_its_inertias(method: Method, order: float, floor: bool) -> None:
    inertia = MOMENT + MASS * ARM**2 + ROTOR
    reference = solve_ivp(
        lambda _, s: [s[1], MASS * 9.81 * ARM * math.cos(s[0]) / inertia], (0.0, 1.0), [0.0, 0.0], rtol=1e-11
    ).y[0, -1]
    errors = []
    for steps in (100, 200):
        seen = finals(angle=JointCoordinate("joint"))
        run = simulate(
            pendulum(floor, armature=ROTOR), time_step=1 / steps, duration=1.0, method=method, observe=seen
        )
        errors.append(abs(float(run["angle"]) - reference))
    assert errors[-1] < 0.02
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.15)


def test_its_energy_is_kept_and_counted() -> None:
    seen = traces(energy=Energy())
    run = simulate(pendulum(armature=ROTOR), time_step=1e-3, duration=2.0, method=HALF, observe=seen)
    assert np.ptp(run["energy"]) < 1e-4 * MASS * 9.81 * ARM


ARM_OF_THREE = """<mujoco><option timestep="2e-4" integrator="RK4"/><worldbody><body>
<joint type="hinge" axis="0 1 0" armature=".3"/><inertial pos=".3 0 0" mass="1.5" diaginertia=".02 .05 .06"/>
<body pos=".6 0 0"><joint type="hinge" axis="0 0 1" armature=".1"/><inertial pos=".2 .1 0" mass=".8" diaginertia=".01 .03 .02"/>
<body pos=".4 0 0"><joint type="slide" axis="1 0 1" armature=".5"/><inertial pos="0 0 .1" mass=".3" diaginertia=".01 .02 .03"/>
</body></body></body></worldbody></mujoco>"""
SPEEDS = (1.0, 4.0, 0.2)  # rad/s, rad/s, m/s


@pytest.mark.parametrize(
    ("method", "order", "least", "floor"),
    [
        (Method(), 1.0, 2e-2, True),
        (CORRECTED, 2.0, 3e-4, False),
        (CORRECTED, 2.0, 3e-4, True),
        (Method(composition="order4"), 4.0, 1e-6, False),
    ],
)
def test_an_arm_whose_axes_turn_goes_as_by_runge_kutta(
    method: Method, order: float, least: float, floor: bool
) -> None:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(ARM_OF_THREE)
    data = mujoco.MjData(model)
    data.qvel[:] = SPEEDS
    mujoco.mj_forward(model, data)
    bodies, joints = [], []
    for k, form in enumerate((Hinge, Hinge, Prismatic)):
        speed = np.zeros(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, k + 1, speed, 0)
        bodies.append(
            solid(
                f"b{k}",
                Sphere(0.01) if floor else None,
                tuple(data.xipos[k + 1]),
                float(model.body_mass[k + 1]),
                tuple(speed[3:]),
                tuple(speed[:3]),
                inertia=tuple(model.body_inertia[k + 1]),
            )
        )
        joints.append(
            form(
                name=f"j{k}",
                between=(WORLD if k == 0 else f"b{k - 1}", f"b{k}"),
                at=tuple(data.xanchor[k]),
                axis=tuple(data.xaxis[k]),
                compliance=0.0,
                armature=float(model.dof_armature[k]),
            )
        )
    if floor:
        bodies.append(FAR_FLOOR)
    scene = Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=(0.0, 0.0, -9.81))
    for _ in range(5000):
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    errors = []
    for steps in (100, 200, 400):
        run = simulate(
            scene,
            time_step=1 / steps,
            duration=1.0,
            method=method,
            observe={f"b{k}": Final(quantity=Position(f"b{k}")) for k in range(3)},
        )
        errors.append(max(float(np.abs(run[f"b{k}"] - data.xipos[k + 1]).max()) for k in range(3)))
    assert errors[-1] < least
    assert math.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.15)


def bar_and_ball(
    rotor: float, spin: float, ball_speed: float, gap: float = -1e-9
) -> tuple[Scene, float, float]:
    """A bar about the axis y that may turn as it is met [m above it]; and both speeds after an elastic impact."""
    elastic = Material(restitution=1.0)
    bar = solid(
        "bar",
        Box((1.0, 0.1, 0.1)),
        (0.5, 0.0, 0.0),
        2.0,
        (0.0, 0.0, 0.5 * spin),
        (0.0, -spin, 0.0),
        inertia=(0.01, 0.2, 0.2),
        material=elastic,
    )
    ball = solid("ball", Sphere(0.05), (0.8, 0.0, 0.1 + gap), 0.5, (0.0, 0.0, ball_speed), material=elastic)
    joint = Hinge(
        name="joint",
        between=(WORLD, "bar"),
        at=(0.0, 0.0, 0.0),
        axis=(0.0, -1.0, 0.0),
        compliance=0.0,
        armature=rotor,
    )
    inertia = 0.2 + 2.0 * 0.25 + rotor
    impulse = 2.0 * (0.8 * spin - ball_speed) / (1 / 0.5 + 0.8**2 / inertia)
    scene = Scene(bodies=(bar, ball), constraints=(joint,))
    return scene, ball_speed + impulse / 0.5, spin - 0.8 * impulse / inertia


@pytest.mark.parametrize("method", [Method(), HALF, Method(solver="iterative")])
@pytest.mark.parametrize("rotor", [0.0, 0.3, 5.0])
def test_an_elastic_ball_meets_the_bar_and_its_rotor(method: Method, rotor: float) -> None:
    scene, ball, bar = bar_and_ball(rotor, spin=0.0, ball_speed=-3.0, gap=0.3)
    seen = finals(ball=Velocity("ball"), bar=AngularVelocity("bar"))
    run = simulate(scene, time_step=1 / 240, duration=0.3, method=method, observe=seen)
    assert float(run["ball"][2]) == pytest.approx(ball, rel=1e-10)
    assert -float(run["bar"][1]) == pytest.approx(bar, rel=5e-4)  # it turns on: order 1


def test_between_two_free_bodies_it_moves_no_common_centre() -> None:
    bodies = (
        RigidBody(name="one", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.0)),
        RigidBody(name="two", mass=3.0, inertia=(0.1, 0.1, 0.1), position=(1.0, 0.0, 0.0)),
    )
    rail = Prismatic(name="rail", between=("one", "two"), axis=(1.0, 0.0, 0.0), compliance=0.0, armature=2.0)
    scene = Scene(
        bodies=bodies, constraints=(rail,), forces=(Load(name="pull", body="two", force=(6.0, 0.0, 0.0)),)
    )
    seen = {name: Final(quantity=Velocity(name)) for name in ("one", "two")}
    run = simulate(scene, time_step=0.01, duration=1.0, observe=seen)
    # x₁'' m₁ = 2 q'', x₂'' m₂ = 6 − 2 q'', q = x₂ − x₁
    rate = 6.0 / 3.0 / (1.0 + 2.0 * (1.0 + 1.0 / 3.0))
    assert float(run["one"][0]) == pytest.approx(2.0 * rate, rel=1e-12)
    assert float(run["two"][0]) == pytest.approx(2.0 * rate + rate, rel=1e-12)


@pytest.mark.parametrize(("composition", "order"), [("order4", 4.0), ("order6", 6.0)])
@pytest.mark.parametrize("rotor", [0.0, ROTOR])
def test_compositions_take_it_and_a_spring_of_the_coordinate(
    composition: Literal["order4", "order6"], order: float, rotor: float
) -> None:
    inertia = MOMENT + MASS * ARM**2 + rotor
    reference = solve_ivp(
        lambda _, s: [s[1], (MASS * 9.81 * ARM * math.cos(s[0]) - 9.0 * (s[0] - 0.3)) / inertia],
        (0.0, 1.0),
        [0.0, 0.0],
        rtol=1e-13,
        atol=1e-14,
        method="DOP853",
    ).y[:, -1]
    scene = pendulum(armature=rotor, spring=JointSpring(stiffness=9.0, rest=0.3, damping=0.0))
    seen = finals(angle=JointCoordinate("joint"), spin=AngularVelocity("bob"))
    errors = []
    for steps in (20, 40):
        run = simulate(
            scene, time_step=1 / steps, duration=1.0, method=Method(composition=composition), observe=seen
        )
        errors.append(np.array([float(run["angle"]), float(run["spin"][1])]) - reference)
    assert np.log2(np.abs(errors[0] / errors[1])) == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("method", [HALF, Method(composition="order4")])
def test_a_spring_that_is_set_while_it_runs_pulls_to_where_it_is_set(method: Method) -> None:
    scene = replace(
        pendulum(spring=JointSpring(stiffness=50.0, rest=0.0, damping=0.0)), gravity=(0.0, 0.0, 0.0)
    )
    rate = math.sqrt(50.0 / (MOMENT + MASS * ARM**2))
    with start(scene, time_step=0.005, method=method, observe={"angle": JointCoordinate("joint")}) as run:
        run.step(10)
        run.set_rest("joint", 0.7)
        run.step(60)
        assert float(run["angle"]) == pytest.approx(
            0.7 * (1.0 - math.cos(rate * 0.3)), abs=0.01
        )  # half a step late


def test_a_composition_refuses_a_spring_that_loses_energy() -> None:
    scene = pendulum(spring=JointSpring(stiffness=9.0))
    with pytest.raises(MethodError, match=r"the spring of 'joint' as a force .* give it damping=0"):
        simulate(scene, time_step=0.01, duration=0.1, method=Method(composition="order4"))


@pytest.mark.parametrize("method", [Method(), HALF, Method(solver="iterative")])
@pytest.mark.parametrize("rotor", [0.0, 5.0])
def test_a_rotor_that_turns_gives_its_momentum_to_what_is_met(method: Method, rotor: float) -> None:
    scene, ball, bar = bar_and_ball(rotor, spin=2.0, ball_speed=-1.0)
    seen = finals(ball=Velocity("ball"), bar=AngularVelocity("bar"))
    run = simulate(scene, time_step=1e-3, duration=2e-3, method=method, observe=seen)
    assert float(run["ball"][2]) == pytest.approx(ball, rel=1e-8)
    assert -float(run["bar"][1]) == pytest.approx(bar, rel=1e-5)


@pytest.mark.parametrize("method", [Method(), HALF])
@pytest.mark.parametrize("rotor", [0.0, 5.0])
def test_no_sample_lies_in_the_middle_of_an_impact(method: Method, rotor: float) -> None:
    """Half steps read the mean of two velocities: where one is of before the impact, energy seemed to go and to come back."""
    scene, _, _ = bar_and_ball(rotor, spin=2.0, ball_speed=-1.0, gap=0.0033)
    run = simulate(
        scene,
        time_step=1e-3,
        duration=8e-3,
        method=method,
        observe=traces(energy=Energy()) | finals(ball=Velocity("ball")),
    )
    assert float(run["ball"][2]) > 2.0
    assert np.ptp(run["energy"]) < 1e-5 * run["energy"][0]


def test_an_overlap_at_the_start_is_parted_as_without_a_rotor() -> None:
    def height(rotor: float) -> float:
        box = RigidBody(name="box", mass=1.0, shape=Box((1.0, 1.0, 1.0)), position=(0.0, 0.0, 0.499))
        floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
        rail = Prismatic(
            name="rail", between=(WORLD, "box"), axis=(0.0, 0.0, 1.0), compliance=0.0, armature=rotor
        )
        scene = Scene(bodies=(floor, box), constraints=(rail,), gravity=(0.0, 0.0, -9.81))
        seen = finals(at=Position("box"))
        return float(simulate(scene, time_step=0.01, duration=1.0, observe=seen)["at"][2])

    assert height(1e4) == pytest.approx(height(0.0), abs=1e-9)


def test_what_slept_goes_on_as_if_it_had_lain_awake() -> None:
    def angle(method: Method) -> tuple[float, int]:
        bar = solid("bar", Box((1.0, 0.1, 0.1)), (0.5, 0.0, 0.05), 2.0, material=Material(friction=0.5))
        floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0))
        joint = Hinge(
            name="joint",
            between=(WORLD, "bar"),
            at=(0.0, 0.0, 0.05),
            axis=(0.0, -1.0, 0.0),
            compliance=0.0,
            armature=0.5,
        )
        lift = Load(name="lift", body="bar")
        scene = Scene(
            bodies=(floor, bar),
            constraints=(joint,),
            forces=(lift,),
            gravity=(0.0, 0.0, -9.81),
            no_contact=(),
        )
        with start(scene, time_step=0.01, method=method, observe={"q": JointCoordinate("joint")}) as run:
            run.step(300)
            run.set_load("lift", force=(0.0, 0.0, 30.0))
            run.step(20)
            return float(run["q"]), run.result().counters.get("slept_steps", 0)

    woken, slept = angle(Method(sleep_speed=0.02))
    awake, _ = angle(Method())
    assert slept > 100
    assert woken == pytest.approx(awake, rel=1e-6) and awake > 0.05


@pytest.mark.parametrize("method", [Method(), HALF])
def test_a_rotor_may_turn_by_more_than_half_a_turn_a_step(method: Method) -> None:
    wheel = solid("wheel", None, (0.0, 0.0, 0.0), spin=(0.0, 0.0, 500.0), inertia=(0.1, 0.1, 0.1))
    axle = Hinge(name="axle", between=(WORLD, "wheel"), axis=(0.0, 0.0, 1.0), compliance=0.0, armature=0.3)
    seen = finals(angle=JointCoordinate("axle"), spin=AngularVelocity("wheel"))
    run = simulate(
        Scene(bodies=(wheel,), constraints=(axle,)),
        time_step=1 / 60,
        duration=1.0,
        method=method,
        observe=seen,
    )
    assert float(run["spin"][2]) == pytest.approx(500.0, rel=1e-9)
    assert float(run["angle"]) == pytest.approx(500.0, rel=1e-9)


def test_the_rotor_of_a_joint_that_breaks_keeps_its_energy() -> None:
    box = RigidBody(name="box", mass=1.0, inertia=(0.1, 0.1, 0.1), position=(0.0, 0.0, 0.0))
    rail = Prismatic(
        name="rail", between=(WORLD, "box"), axis=(0.0, 0.0, 1.0), compliance=0.0, armature=2.0, strength=1.0
    )
    scene = Scene(bodies=(box,), constraints=(rail,), gravity=(5.0, 0.0, -9.81))
    run = simulate(scene, time_step=1e-3, duration=1.0, observe=traces(energy=Energy()))
    assert run.broken
    assert np.ptp(run["energy"]) < 0.1  # J, of 60 that it falls by: order 1
