"""Bodies held by joints that touch the ground and each other: solved directly, at a cost that does not run away."""

import math
from dataclasses import replace

import numpy as np
import pytest

from spook_tracker.engine import (
    WORLD,
    AngularVelocity,
    Box,
    Capsule,
    Hinge,
    JointSpring,
    Limit,
    Material,
    Method,
    Motor,
    Penetration,
    Plane,
    Position,
    Prismatic,
    RigidBody,
    Scene,
    Velocity,
    simulate,
    start,
)
from spook_tracker.scalar_tests.catalogue import CATALOGUE
from spook_tracker.scalar_tests.heavier import heavier
from spook_tracker.scalar_tests.mechanisms import loose_bearing
from tests.scenes.corpus import solid
from tests.scenes.seen import finals, maxima, traces

STEP = 1 / 60
G = 9.81


def legged(seed: int) -> Scene:
    """A trunk on two to five legs of two links each, stiff or slack, that falls on a floor and slides on."""
    random = np.random.default_rng(seed)
    mu = float(random.uniform(0.2, 1.0))
    rough = Material(friction=mu)
    bodies = [
        RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough),
        solid(
            "trunk",
            Box((0.6, 0.4, 0.1)),
            (0.0, 0.0, 0.62),
            float(10 ** random.uniform(-1, 1.5)),
            (float(random.uniform(-2, 2)), float(random.uniform(-1, 1)), -1.0),
            material=rough,
        ),
    ]
    joints = []
    for k in range(int(random.integers(2, 6))):
        x, y = float(random.uniform(-0.28, 0.28)), 0.18 if k % 2 else -0.18
        upper, lower = f"thigh{k}", f"shin{k}"
        for name, z in ((upper, 0.44), (lower, 0.2)):
            bodies.append(
                solid(
                    name, Capsule(0.03, 0.18), (x, y, z), float(10 ** random.uniform(-1, 0.5)), material=rough
                )
            )
        drive = JointSpring(stiffness=float(10 ** random.uniform(0, 3)), damping=0.02, max_force=50.0)
        joints += [
            Hinge(
                name=f"hip{k}",
                between=("trunk", upper),
                at=(x, y, 0.56),
                axis=(0, 1, 0),
                compliance=0.0,
                spring=drive,
            ),
            Hinge(
                name=f"knee{k}",
                between=(upper, lower),
                at=(x, y, 0.32),
                axis=(0, 1, 0),
                compliance=0.0,
                limit=Limit(lower=-1.0, upper=1.0),
            ),
        ]
    names = [body.name for body in bodies[1:]]
    apart = tuple((a, b) for i, a in enumerate(names) for b in names[i + 1 :])
    return Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=(0.0, 0.0, -G), no_contact=apart)


@pytest.mark.parametrize("seed", range(12))
def test_what_stands_on_legs_is_solved_at_every_step(seed):
    run = simulate(legged(seed), duration=1.5, time_step=STEP, observe=maxima(deepest=Penetration()))
    steps = round(1.5 / STEP)
    assert run.status == "completed"
    assert run["deepest"] <= 1e-6  # m
    assert run.residual <= 1e-5  # m/s, of the worst solve
    assert run.counters["factorisations"] <= 60 * steps
    assert run.counters["sweeps"] <= 100 * steps


@pytest.mark.parametrize("seed", [5, 10, 18, 26])
def test_what_stands_on_legs_is_settled_by_iterations_as_well(seed):
    """Fifty of them left up to 2 m/s in stiff legs, sixteen times as many, too."""
    run = simulate(legged(seed), duration=1.5, time_step=STEP, method=Method(solver="iterative"), observe={})
    assert run.status == "completed"
    assert run.residual <= 1e-3  # m/s


def test_what_was_solved_directly_after_iterations_overlaps_no_more_than_before() -> None:
    """Overlaps were parted with the masses of the last step that was iterated: .34 mm stayed."""
    run = simulate(
        CATALOGUE["falling_chain"].example().scene,
        duration=0.7,
        time_step=STEP,
        method=Method(solver="iterative", turns="linear"),
        observe=maxima(deepest=Penetration()),
    )
    assert run.status == "completed"
    assert run["deepest"] <= 1e-6  # m


@pytest.mark.parametrize("sideways", [4e-3, 8e-3, 12e-3])  # m/s
def test_limbs_that_tumble_do_not_sink_in_where_they_land(sideways: float) -> None:
    """They were looked for along a turn that no tumbling body takes: up to .3 mm stayed of a thrown ragdoll's."""
    scene = CATALOGUE["falling_chain"].example().scene
    thrown = tuple(
        replace(body, velocity=tuple(np.add(body.velocity, (sideways, 0.0, 0.0))))
        if body.motion == "dynamic"
        else body
        for body in scene.bodies
    )
    run = simulate(
        replace(scene, bodies=thrown),
        duration=0.7,
        time_step=STEP,
        method=Method(solver="iterative"),
        observe=maxima(deepest=Penetration()),
    )
    assert run.status == "completed"
    assert run["deepest"] <= 5e-6  # m


def test_a_hand_that_pushes_is_solved_with_its_box_at_once() -> None:
    """Its turn opens it by micrometres a step: it was solved without the box, was found in it, and solved again."""
    run = simulate(CATALOGUE["box_push"].example().scene, duration=1.0, time_step=STEP)
    assert run.status == "completed"
    assert run.counters["factorisations"] <= run.steps


def test_no_step_of_a_body_that_comes_to_lie_takes_many_rounds():
    """It lies on more points than it needs: where Newton's steps gain nothing they end, 500 of them or not."""
    run = start(CATALOGUE["falling_chain"].example().scene, time_step=STEP)
    rounds = [0]
    for _ in range(round(2.0 / STEP)):
        run.step(1)
        rounds.append(run.result().counters["friction_rounds"])
    assert max(np.diff(rounds)) <= 300
    assert run.result().residual <= 5e-5  # m/s, of the worst solve


def whips(limbs: int, links: int) -> Scene:
    """Chains of stiff links that stand on a plate which is about to fall over, a stop in each of their joints."""
    rough = Material(friction=0.6)
    bodies = [
        RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough),
        solid("trunk", Box((0.5, 0.3, 0.1)), (0.0, 0.0, 0.06), 2.0, spin=(0.3, 0.5, 0.0), material=rough),
    ]
    joints = []
    for limb in range(limbs):
        below, y = "trunk", -0.15 + 0.3 * limb / (limbs - 1)
        for k in range(links):
            name, z = f"{limb} {k}", 0.11 + 0.05 * k
            bodies.append(
                RigidBody(name=name, mass=0.05, inertia=(2e-5, 2e-5, 1e-5), position=(0.0, y, z + 0.025))
            )
            joints.append(
                Hinge(
                    name=f"under {name}",
                    between=(below, name),
                    at=(0.0, y, z),
                    axis=(0, 1, 0) if k % 2 else (1, 0, 0),
                    compliance=0.0,
                    limit=Limit(lower=-0.1 - 0.02 * limb, upper=0.15),
                )
            )
            below = name
    return Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=(0.0, 0.0, -G))


def test_a_body_with_many_stops_and_few_contacts_is_solved() -> None:
    """130 stops beside four points, few of which are reached at once."""
    run = simulate(whips(5, 26), duration=0.5, time_step=1 / 240)
    assert run.status == "completed"
    assert run.counters.get("unsettled_solves", 0) == 0
    assert run.residual <= 1e-9  # m/s, of the worst solve


def test_many_bodies_on_few_points_are_factored_once_a_step() -> None:
    """Newton's method on the whole took six factors of seventeen bodies for four points."""
    steps = 120
    run = simulate(whips(4, 4), duration=steps / 240, time_step=1 / 240)
    assert run.status == "completed"
    assert run.counters["factorisations"] <= 2 * steps
    assert run.residual <= 1e-9  # m/s, of the worst solve


def frame(mu: float, half_angle: float) -> Scene:
    """Two bars of 1 kg hinged at their tops, that stand on a floor."""
    length, radius = 1.0, 0.02
    rough = Material(friction=mu)
    top = radius + length * math.cos(half_angle)
    bars = [
        solid(
            name,
            Capsule(radius, length),
            (side * length / 2 * math.sin(half_angle), 0.0, radius + length / 2 * math.cos(half_angle)),
            orientation=(math.cos(half_angle / 2), 0.0, -side * math.sin(half_angle / 2), 0.0),
            material=rough,
        )
        for name, side in (("left", -1.0), ("right", 1.0))
    ]
    floor = RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough)
    hinge = Hinge(name="top", between=("left", "right"), at=(0.0, 0.0, top), axis=(0, 1, 0), compliance=0.0)
    return Scene(
        bodies=(floor, *bars), constraints=(hinge,), gravity=(0.0, 0.0, -G), no_contact=(("left", "right"),)
    )


@pytest.mark.parametrize(("share", "stands"), [(1.01, True), (0.99, False)])
def test_two_hinged_bars_stand_while_the_floor_rubs_enough(share, stands):
    """Moments about the hinge: friction m g (l/2) sin a / (l cos a + r) a foot, by a normal force of m g."""
    half = 0.4
    need = 0.5 * math.sin(half) / (math.cos(half) + 0.02)
    run = simulate(
        frame(share * need, half), duration=1.0, time_step=STEP, observe=finals(v=Velocity("left"))
    )
    speed = float(np.linalg.norm(run["v"]))
    assert run.status == "completed"
    assert (speed < 1e-9) == stands


def test_a_driven_slide_pushes_a_box_as_statics_say():
    """Pusher and box go together: a = (F − mu m g) / (M + m)."""
    force, pusher, box, mu = 30.0, 2.0, 3.0, 0.4
    rough = Material(friction=mu)
    smooth = Material(friction=0.0)
    scene = Scene(
        bodies=(
            RigidBody(name="floor", motion="static", shape=Plane(), position=(0.0, 0.0, 0.0), material=rough),
            solid("pusher", Box((0.1, 0.4, 0.1)), (-0.25, 0.0, 0.2), pusher, material=smooth),
            solid("box", Box((0.4, 0.4, 0.4)), (0.0, 0.0, 0.2), box, material=rough),
        ),
        constraints=(
            Prismatic(
                name="rail",
                between=(WORLD, "pusher"),
                at=(-0.25, 0.0, 0.2),
                axis=(1, 0, 0),
                compliance=0.0,
                motor=Motor(force=force),
            ),
        ),
        gravity=(0.0, 0.0, -G),
        no_contact=(("floor", "pusher"),),
    )
    run = simulate(scene, duration=1.0, time_step=STEP, observe=finals(v=Velocity("box")))
    speed = run["v"]
    assert run.status == "completed"
    assert speed[0] == pytest.approx((force - mu * box * G) / (pusher + box), rel=1e-9)


@pytest.mark.parametrize("solver", ["direct", "iterative"])
@pytest.mark.parametrize("mass", [5.0, 8.0])
def test_what_slips_out_of_a_gripper_falls_straight(mass: float, solver: str) -> None:
    """Of all ways to share a load among four corners the even one: a = g − 2 mu F / m, without a turn, while whole faces touch."""
    force, mu, seconds = 50.0, 0.4, 0.1
    rough = Material(friction=mu)
    pads = [
        solid(name, Box((0.06, 0.02, 0.1)), (0.0, y, 0.0), 0.5, material=rough)
        for name, y in (("left", 0.035), ("right", -0.035))
    ]
    presses = tuple(
        Prismatic(
            name=f"presses {pad.name}",
            between=(WORLD, pad.name),
            axis=(0, 1, 0),
            compliance=0.0,
            motor=Motor(force=-math.copysign(force, pad.position[1])),
        )
        for pad in pads
    )
    held = solid("box", Box((0.05, 0.05, 0.05)), (0.0, 0.0, 0.0), mass, material=rough)
    run = simulate(
        Scene(bodies=(*pads, held), constraints=presses, gravity=(0.0, 0.0, -G)),
        duration=seconds,
        time_step=STEP,
        method=Method(solver=solver),
        observe=finals(v=Velocity("box"), w=AngularVelocity("box")),
    )
    assert run["v"][2] == pytest.approx(-(G - 2.0 * mu * force / mass) * seconds, rel=1e-3)
    assert np.linalg.norm(run["w"]) < 1e-3


@pytest.mark.parametrize("rate", [60, 240])
def test_a_motor_moves_any_load_alike_where_it_turns_back(rate: int) -> None:
    """A slider in a loose bearing: held by its joints, of 10 kg or 1e9, it goes where the crank says. Where it turns back, its
    joints do far more work than anything moves with, and are no jam."""
    light, heavy = (
        simulate(
            heavier(loose_bearing.scene(1 / rate), mass / loose_bearing.SLIDER, "slider"),
            time_step=1 / rate,
            duration=loose_bearing.DURATION,
            observe=traces(x=Position("slider")),
        )["x"][:, 0]
        for mass in (10.0, 1e9)
    )

    assert np.abs(heavy - light).max() < 1e-9
