"""A controller outside the engine: computed torque leads a six-joint arm along its path, through a run one holds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spook_tracker.engine import AngularVelocity, Hinge, JointCoordinate, Load, Method, Scene, start
from spook_tracker.engine.observe import Quantity
from spook_tracker.scalar_tests.robots import robot_arm

JOINTS = range(len(robot_arm.LINKS))
AMPLITUDE = np.array([0.5, 0.4, -0.6, 0.7, 0.5, -0.9])  # rad
RATE = 3.0  # rad/s
STIFFNESS, DAMPING = 400.0, 40.0  # 1/s², 1/s: critical, e'' + 40 e' + 400 e = 0


def path(time: float) -> tuple[Any, Any, Any]:
    """Angles, speeds and accelerations wanted at a time."""
    return (
        AMPLITUDE * (1.0 - math.cos(RATE * time)),
        AMPLITUDE * RATE * math.sin(RATE * time),
        AMPLITUDE * RATE**2 * math.cos(RATE * time),
    )


def arm() -> Scene:
    """The arm of the scalar test at rest, its drives taken out, a load on every link."""
    still = robot_arm.scene(robot_arm.POSES[0])
    joints = tuple(replace(joint, motor=None) for joint in still.constraints if isinstance(joint, Hinge))
    loads = tuple(Load(name=f"torque {k}", body=f"link {k + 1}") for k in JOINTS)
    return replace(still, constraints=joints, forces=loads)


def largest_error(time_step: float, method: Method) -> float:
    """Largest distance from the path [rad] in half a second under a computed torque."""
    observe: dict[str, Quantity] = {f"q{k}": JointCoordinate(f"joint {k + 1}") for k in JOINTS}
    observe |= {"w": AngularVelocity()}
    worst = 0.0
    with start(arm(), time_step=time_step, method=method, observe=observe) as run:
        for _ in range(round(0.5 / time_step)):
            now = run.result()
            angles = np.array([float(now[f"q{k}"]) for k in JOINTS])
            spins = np.vstack([np.zeros(3), now["w"]])
            axes = [axis for _, axis, _, _ in robot_arm.kinematics(angles)]
            speeds = np.array([axes[k] @ (spins[k + 1] - spins[k]) for k in JOINTS])
            wanted, wanted_speeds, ahead = path(run.time)
            worst = max(worst, float(np.abs(angles - wanted).max()))
            pull = ahead + DAMPING * (wanted_speeds - speeds) + STIFFNESS * (wanted - angles)
            torques, _, _ = robot_arm.inverse_dynamics(angles, speeds, pull)
            pushes = [torque * axis for torque, axis in zip(torques, axes, strict=True)] + [np.zeros(3)]
            for k in JOINTS:  # what drives a joint pushes the link before it back
                run.set_load(f"torque {k}", torque=tuple(pushes[k] - pushes[k + 1]))
            run.step()
    return worst


def allowed(time_step: float, method: Method) -> float:
    """What first order explains [rad]. A critical controller answers a disturbance d with d/STIFFNESS at most, and a speed
    too large at the start by v with v/(e √STIFFNESS). d: it sees the speed of half a step ago; links feel how they move two
    steps late at most. v: half a step of the path's first acceleration, and, where velocities live at mid-step, of the
    arm's own fall, which it began with no torque yet."""
    still = np.zeros(len(robot_arm.LINKS))

    def solved(angles: Any, torques: Any) -> Any:
        rest = robot_arm.inverse_dynamics(angles, still, still)[0]
        mass = [robot_arm.inverse_dynamics(angles, still, one)[0] - rest for one in np.eye(len(still))]
        return np.linalg.solve(np.array(mass).T, torques)

    def moving(time: float) -> Any:
        angles, speeds, _ = path(max(0.0, time))
        there = robot_arm.inverse_dynamics(angles, speeds, still)[0]
        return there - robot_arm.inverse_dynamics(angles, still, still)[0]

    pushed = max(
        float(
            np.max(
                np.abs(solved(path(time)[0], moving(time) - moving(time - 2.0 * time_step)))
                + 0.5 * time_step * DAMPING * np.abs(path(time)[2])
            )
        )
        for time in np.linspace(0.0, 0.5, 11)
    )
    start = float(np.abs(path(0.0)[2]).max())
    if method.half_step_velocities:
        start += float(np.abs(solved(still, robot_arm.inverse_dynamics(still, still, still)[0])).max())
    return pushed / STIFFNESS + 0.5 * time_step * start / (math.e * math.sqrt(STIFFNESS))


@pytest.mark.parametrize("method", [Method(), Method(half_step_velocities=True, corrections=1)], ids=repr)
def test_computed_torque_follows_its_path_with_order_one(method: Method) -> None:
    coarse, fine = largest_error(1 / 100, method), largest_error(1 / 200, method)

    assert fine < allowed(1 / 200, method)  # 2.4 and 4.6 mrad, of a path of 1.8 rad
    assert 1.6 < coarse / fine < 2.6
