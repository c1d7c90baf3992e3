"""Do the drives of a six-joint arm carry what inverse dynamics says, at rest and in motion?"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from spook_tracker import engine
from spook_tracker.engine.joints import Constraint
from spook_tracker.engine.observe import Observable

from .. import case
from ..bracket import break_point, unbroken
from ..configurations import configured
from ..sweep import line, told

GRAVITY = (0.0, 0.0, -9.81)  # m/s²
# Links from the base to the hand: where its joint is seen from the joint before, the joint's axis, where its centre of
# mass is seen from its joint, its mass and its principal moments; in world axes of the pose all angles are zero at.
LINKS = (
    ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.05, 0.20), 12.0, (0.20, 0.18, 0.10)),
    ((0.0, 0.1, 0.40), (0.0, 1.0, 0.0), (0.02, 0.0, 0.25), 9.0, (0.25, 0.24, 0.03)),
    ((0.0, -0.1, 0.50), (0.0, 1.0, 0.0), (0.15, 0.05, 0.02), 6.0, (0.02, 0.09, 0.10)),
    ((0.3, 0.0, 0.05), (1.0, 0.0, 0.0), (0.10, 0.0, 0.01), 3.0, (0.005, 0.02, 0.018)),
    ((0.2, 0.0, 0.0), (0.0, 1.0, 0.0), (0.04, 0.0, 0.0), 1.5, (0.002, 0.003, 0.0025)),
    ((0.1, 0.0, 0.0), (1.0, 0.0, 0.0), (0.05, 0.01, 0.0), 0.8, (0.001, 0.0012, 0.0014)),
)
POSES = (  # rad
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (0.4, 0.9, -0.6, 0.5, 0.8, -1.2),
    (-1.1, 1.4, 0.3, -0.9, -0.7, 0.4),
)
SPEEDS = (0.8, -0.6, 1.1, -1.5, 0.9, 2.0)  # rad/s, of the driven arm
TIME_STEP = 1.0 / 60.0  # s
FINE = 1e-4  # s, of the driven arm
SLOWEST = 1e-6  # rad/s, of a link that is no longer held
SETTLED = 50  # steps after which the torques of the driven arm are read
Vector = Any


def turned(axis: Vector, angle: float) -> Any:
    """The rotation matrix about a unit axis (Rodrigues)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew


def kinematics(pose: Vector) -> list[tuple[Any, Any, Any, Any]]:
    """Joint place, joint axis, centre of mass and rotation of every link in world axes."""
    rotation, place, found = np.eye(3), np.zeros(3), []
    for (step, axis, centre, _, _), angle in zip(LINKS, pose, strict=True):
        place = place + rotation @ np.array(step)
        world_axis = rotation @ np.array(axis)
        rotation = rotation @ turned(axis, angle)
        found.append((place, world_axis, place + rotation @ np.array(centre), rotation))
    return found


def inverse_dynamics(pose: Vector, speeds: Vector, accelerations: Vector) -> tuple[Any, list[Any], list[Any]]:
    """Torques [N m] about the joints, and every link's velocity and angular velocity: recursive Newton–Euler, outward
    the motion, inward the forces (Luh, Walker and Paul 1980), all in world axes."""
    arm = kinematics(pose)
    spin, turn = np.zeros(3), np.zeros(3)  # angular velocity and acceleration of the link before
    speed, pull = (
        np.zeros(3),
        -np.array(GRAVITY),
    )  # of the joint before: gravity as an acceleration of the base
    before = np.zeros(3)
    moving, forces, moments = [], [], []
    for (place, axis, centre, rotation), (_, _, _, mass, inertia), w, a in zip(
        arm, LINKS, speeds, accelerations, strict=True
    ):
        reach = place - before
        speed = speed + np.cross(spin, reach)
        pull = pull + np.cross(turn, reach) + np.cross(spin, np.cross(spin, reach))
        turn = turn + a * axis + np.cross(spin, w * axis)
        spin = spin + w * axis
        out = centre - place
        world = rotation @ np.diag(inertia) @ rotation.T
        forces.append(mass * (pull + np.cross(turn, out) + np.cross(spin, np.cross(spin, out))))
        moments.append(world @ turn + np.cross(spin, world @ spin))
        moving.append((speed + np.cross(spin, out), spin))
        before = place
    torques = np.zeros(len(LINKS))
    force, moment, next_place = np.zeros(3), np.zeros(3), np.zeros(3)
    for k in reversed(range(len(LINKS))):
        place, axis, centre, _ = arm[k]
        moment = (
            moments[k] + np.cross(centre - place, forces[k]) + moment + np.cross(next_place - place, force)
        )
        force = forces[k] + force
        next_place = place
        torques[k] = axis @ moment
    return torques, [v for v, _ in moving], [w for _, w in moving]


def quaternion(rotation: Any) -> tuple[float, float, float, float]:
    """Unit quaternion (w, x, y, z) of a rotation of less than half a turn."""
    w = 0.5 * math.sqrt(max(0.0, 1.0 + float(np.trace(rotation))))
    if w > 0.1:
        x, y, z = (
            (rotation[2, 1] - rotation[1, 2]) / (4 * w),
            (rotation[0, 2] - rotation[2, 0]) / (4 * w),
            (rotation[1, 0] - rotation[0, 1]) / (4 * w),
        )
        return (w, float(x), float(y), float(z))
    values, vectors = np.linalg.eigh(rotation + rotation.T)  # the axis, where the angle is nearly π
    axis = vectors[:, int(np.argmax(values))]
    sense = np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    if float(axis @ sense) < 0.0:
        axis = -axis
    length = math.sqrt(1.0 - w * w)
    x, y, z = (float(length * a) for a in axis)
    return (w, x, y, z)


def scene(
    pose: Vector, speeds: Vector = (0.0,) * 6, torque: float | Sequence[float | None] | None = None
) -> engine.Scene:
    """The arm in a pose, its links moving with the joints' speeds, each joint driven at its speed with at most `torque`
    [N m], of all or one by one."""
    bounds = torque if isinstance(torque, Sequence) else (torque,) * len(LINKS)
    arm = kinematics(pose)
    _, velocities, spins = inverse_dynamics(pose, speeds, np.zeros(6))
    bodies: list[engine.RigidBody] = []
    joints: list[Constraint] = []
    for k, ((place, axis, centre, rotation), (_, _, _, mass, inertia)) in enumerate(
        zip(arm, LINKS, strict=True)
    ):
        bodies.append(
            engine.RigidBody(
                name=f"link {k + 1}",
                mass=mass,
                inertia=inertia,
                position=tuple(centre),
                orientation=quaternion(rotation),
                velocity=tuple(velocities[k]),
                angular_velocity=tuple(spins[k]),
            )
        )
        joints.append(
            engine.Hinge(
                name=f"joint {k + 1}",
                between=(engine.WORLD if k == 0 else f"link {k}", f"link {k + 1}"),
                at=tuple(place),
                axis=tuple(axis),
                compliance=0.0,
                motor=engine.Motor(speed=float(speeds[k]), max_force=bounds[k]),
            )
        )
    return engine.Scene(bodies=tuple(bodies), constraints=tuple(joints), gravity=GRAVITY)


def torques(
    simulate: case.Simulate,
    pose: Vector,
    speeds: Vector,
    time_step: float,
    method: engine.Method = engine.PLAIN,
    steps: int = 1,
) -> Any:
    """What the drives carry about their axes in the last of so many steps [N m]."""
    observe: dict[str, Observable] = {
        f"{k}": engine.Final(quantity=engine.ConstraintForce(f"joint {k + 1}")) for k in range(len(LINKS))
    }
    result = simulate(
        scene(pose, speeds), time_step=time_step, duration=steps * time_step, method=method, observe=observe
    )
    there = np.asarray(pose) + (steps - 1) * time_step * np.asarray(speeds)
    axes = [axis for _, axis, _, _ in kinematics(there)]
    return np.array([axis @ result[f"{k}"][3:] for k, axis in enumerate(axes)])


def hold(simulate: case.Simulate) -> dict[str, float]:
    """Three poses held against gravity; and with drives of a tenth of what that takes."""
    worst, moved, bound = 0.0, 0.0, 0.0
    for pose in POSES:
        right, _, _ = inverse_dynamics(pose, np.zeros(6), np.zeros(6))
        found = torques(simulate, pose, (0.0,) * 6, TIME_STEP)
        worst = max(worst, float(np.abs(found - right).max() / np.abs(right).max()))
        still: dict[str, Observable] = {"w": engine.MaximumAbsolute(quantity=engine.AngularVelocity())}
        result = simulate(scene(pose), time_step=TIME_STEP, duration=2.0, observe=still)
        moved = max(moved, float(result["w"].max()))
    weak = 0.1 * float(np.abs(inverse_dynamics(POSES[1], np.zeros(6), np.zeros(6))[0]).max())
    observe: dict[str, Observable] = {"f": engine.Final(quantity=engine.ConstraintForce("joint 2"))}
    result = simulate(scene(POSES[1], torque=weak), time_step=1e-6, steps=1, observe=observe)
    axis = kinematics(POSES[1])[1][1]
    bound = abs(float(axis @ result["f"][3:])) / weak - 1.0
    return {"holding_error": worst, "creep": moved, "bound_error": bound}


def stays(simulate: case.Simulate, share: float) -> bool:
    """Whether the second pose is still held after half a second by drives that may carry so much of what that takes; the
    upright axis needs none and is held."""
    needed = np.abs(inverse_dynamics(POSES[1], np.zeros(6), np.zeros(6))[0])
    asked = scene(POSES[1], torque=[None, *(float(share * one) for one in needed[1:])])
    observe = {"w": engine.Final(quantity=engine.AngularVelocity())}
    result = simulate(asked, time_step=TIME_STEP, steps=30, observe=observe)
    return result.completed and float(np.abs(result["w"]).max()) < SLOWEST


def weakest(simulate: case.Simulate) -> case.BreakPoint:
    """The weakest drives that hold the arm."""
    return break_point(functools.partial(stays, simulate), 3.0, 0.3, resolution=1e-4, walk=5)


def held_for(simulate: case.Simulate, time_step: float) -> bool:
    """Whether the drives carry what statics asks in three poses, to 1e-9, after three steps so long [s]."""
    worst = 0.0
    for pose in POSES:
        right, _, _ = inverse_dynamics(pose, np.zeros(6), np.zeros(6))
        found = torques(simulate, pose, (0.0,) * 6, time_step, steps=3)
        worst = max(worst, float(np.abs(found - right).max() / np.abs(right).max()))
    return worst < 1e-9


def driven_error(
    simulate: case.Simulate, pose: Vector, time_step: float, method: engine.Method = engine.PLAIN
) -> tuple[float, float]:
    """Largest error of a torque after `SETTLED` steps at steady speeds, and the largest torque there [N m]."""
    there = np.asarray(pose) + SETTLED * time_step * np.asarray(SPEEDS)
    right, _, _ = inverse_dynamics(there, SPEEDS, np.zeros(6))
    found = torques(simulate, pose, SPEEDS, time_step, method, SETTLED)
    return float(np.abs(found - right).max()), float(np.abs(right).max())


def lag_bound(time_step: float = FINE) -> float:
    """Twice a step's largest change of a torque, over the largest torque, in any of the poses.

    The rows know the curvature of the motion from the violation of the step before, with the double root 1/3 of damping
    2 h: a delay of 2 (1/3)/(1 − 1/3) = 1 step on the mean, and the force of a step is held against its end.
    """
    worst = 0.0
    for pose in POSES:
        early, late = (
            inverse_dynamics(np.asarray(pose) + t * np.asarray(SPEEDS), SPEEDS, np.zeros(6))[0]
            for t in ((SETTLED - 2) * time_step, SETTLED * time_step)
        )
        worst = max(worst, float(np.abs(late - early).max() / np.abs(late).max()))
    return worst


def drive(simulate: case.Simulate) -> dict[str, float]:
    """Torques of the arm driven at steady joint speeds."""
    errors = [driven_error(simulate, pose, FINE) for pose in POSES]
    return {"driving_error": max(error / largest for error, largest in errors)}


def ladder_error(simulate: case.Simulate, time_step: float, method: engine.Method) -> float:
    """Largest error of a driving torque from the second pose on [N m]."""
    return driven_error(simulate, POSES[1], time_step, method)[0]


def ladder_run(simulate: case.Simulate, time_step: float, method: engine.Method) -> engine.Result:
    """The same steps with nothing observed."""
    return simulate(scene(POSES[1], SPEEDS), time_step=time_step, duration=SETTLED * time_step, method=method)


def draw(simulate: case.Simulate) -> case.Drawing:
    """Torques in the second pose, held and driven."""
    joints = list(range(1, len(LINKS) + 1))
    curves = []
    worst = 0.0
    for name, speeds, time_step, steps in (
        ("held", (0.0,) * 6, TIME_STEP, 1),
        ("driven", SPEEDS, FINE, SETTLED),
    ):
        there = np.asarray(POSES[1]) + steps * time_step * np.asarray(speeds)
        right, _, _ = inverse_dynamics(there, speeds, np.zeros(6))
        found = torques(simulate, POSES[1], speeds, time_step, engine.PLAIN, steps)
        worst = max(worst, float(np.abs(found - right).max()))
        curves += [line(f"{name}, Newton–Euler", joints, right, "reference"), line(name, joints, found)]
    return case.Drawing(
        curves=tuple(curves),
        x_label="joint, from the base",
        y_label="torque [N m]",
        note=f"The largest difference is {told(worst, 2)} N m, of {told(float(np.abs(found).max()), 3)} N m.",
    )


TEST = case.ScalarTest(
    title="Robot arm",
    question="Do the drives of a six-joint arm carry what inverse dynamics says?",
    why="A controller computes torques from a model of the arm. If the simulated arm needs other torques, the controller is "
    "tuned for a machine that does not exist.",
    model="Six links of 12 to 0.8 kg on hinges along z, y, y, x, y, x, their centres of mass off the axes: held in three "
    "poses, and driven at steady joint speeds. One joint with a tenth of the torque it needs.",
    parameters=(
        (
            "time step",
            f"1/60 s held; 1e-4 s driven, two steps of which change a torque by {told(100.0 * lag_bound())} % of the largest, "
            f"and by {told(100.0 * lag_bound(TIME_STEP))} % at 1/60 s",
        ),
        ("arm", "six links, 32.3 kg, 1.5 m"),
        ("speeds", "0.8, −0.6, 1.1, −1.5, 0.9, 2.0 rad/s"),
        ("gravity", "9.81 m/s²"),
    ),
    theory=(
        "Outward: ω, ω', accelerations of the links; inward: forces and moments; τ_i = axis_i · moment_i.",
        "At rest the discrete torques are those, exactly. In motion the step takes the gyroscopic and centrifugal "
        "terms at its own place in time, a step late: first order in h.",
        "A drive at its bound carries the bound. Nothing runs away while drives hold every joint at its speed: they do down to "
        "bounds of what inverse dynamics asks for.",
    ),
    reference="Recursive Newton–Euler written in this test (J. Luh, M. Walker, R. Paul, ASME JDSMC 102 (1980) 69).",
    conclusion="Green: drives, hinges and inertias act together as mechanics says. Red: a reaction, an inertia or a sign "
    "is wrong, or a bound is no bound.",
    source="ours; robots are asked for in the thesis, section 5.4",
    measurements=(
        case.Measurement(
            configuration="plain",
            time_step=TIME_STEP,
            metrics=(
                case.Metric(
                    name="holding_error",
                    description="largest error of a holding torque over the largest torque, three poses",
                    unit="1",
                    role="gate",
                    limit=1e-11,
                    limit_source="statics are exact in one step; rounding of quaternions and a solve remains",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="creep",
                    description="fastest turn of a link that is held for 2 s",
                    unit="rad/s",
                    role="companion",
                    limit=1e-11,
                    limit_source="rigid drives: nothing but rounding",
                    reference=0.0,
                    tolerance=1e-12,
                ),
                case.Metric(
                    name="bound_error",
                    description="torque of a drive at its bound over the bound, minus one",
                    unit="1",
                    role="companion",
                    limit=1e-9,
                    limit_source="a multiplier at its bound is the bound; the other rows share the axis to rounding",
                    reference=0.0,
                    tolerance=1e-10,
                ),
            ),
            measure=hold,
            note="held in three poses",
        ),
        case.Measurement(
            configuration="driven",
            time_step=FINE,
            metrics=(
                case.Metric(
                    name="driving_error",
                    description="largest error of a driving torque over the largest torque, three poses",
                    unit="1",
                    role="gate",
                    limit=2.54e-4,
                    limit_source="rows learn of the curvature a step late: two steps of the torques' change, 2.53e-4",
                    reference=0.0,
                    relative_tolerance=1e-6,
                ),
            ),
            measure=drive,
            note="steady joint speeds",
        ),
    ),
    example=lambda: case.Example(scene=scene(POSES[1], SPEEDS), time_step=TIME_STEP, duration=4.0),
    figures=(case.Figure(name="torques", title="Torques of the joints", draw=draw),),
    stability=(
        case.StabilityStudy(
            name="weakest",
            title="Weakest drives that hold the arm, over what inverse dynamics asks of each",
            configuration="plain",
            definition="after half a second in the second pose no link turns faster than 1e-6 rad/s",
            study=weakest,
            unit="1",
            better="smaller",
            expected=(1.0 - 1e-6, 1.0 + 1.01e-4),
            expected_source="statics: the torques of inverse dynamics hold it, and a millionth less does not; the search ends "
            "within 1e-4",
        ),
        unbroken(
            held_for,
            TIME_STEP,
            1e4,
            name="longest-step",
            title="Longest step in which the drives hold the arm",
            definition="torques of three poses are those of inverse dynamics after three steps, to 1e-9",
            source="gravity's impulse and those of all rows have the factor h alike, and nothing moves",
            unit="s",
        ),
    ),
    ladders=(
        case.Ladder(
            name="torque",
            description="largest error of a driving torque",
            unit="N m",
            time_steps=(1e-2, 5e-3, 2.5e-3, 1.25e-3, 6.25e-4, 3.125e-4),
            configurations=configured({"plain": 1.0, "half-step": None}, (3.125e-4, 1.25e-3)),
            error=ladder_error,
            run=ladder_run,
            target_error=0.1,
            target_seconds=0.01,
        ),
    ),
)
