"""What the limits of the arm along a path come from: steps of joint coordinates, without the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from spook_tracker.scalar_tests.bracket import break_point
from spook_tracker.scalar_tests.robots import arm_path, robot_arm
from tests.scalar_tests.limits import band, measurement

STILL = np.zeros(6)


def motion_part(pose: Any, speeds: Any) -> Any:
    """The torques that speeds alone ask for: c(q, q')."""
    return (
        robot_arm.inverse_dynamics(pose, speeds, STILL)[0] - robot_arm.inverse_dynamics(pose, STILL, STILL)[0]
    )


def mass_matrix(pose: Any) -> Any:
    """From the kinetic energy of the links' velocities, a pair of joints at a time; not from torques."""
    moving = [robot_arm.inverse_dynamics(pose, one, STILL)[1:] for one in np.eye(6)]
    found = np.zeros((6, 6))
    for link, ((_, _, _, turn), (_, _, _, mass, inertia)) in enumerate(
        zip(robot_arm.kinematics(pose), robot_arm.LINKS, strict=True)
    ):
        v, w = (np.array([joint[i][link] for joint in moving]) for i in (0, 1))
        found += mass * v @ v.T + w @ turn @ np.diag(inertia) @ turn.T @ w.T
    return found


def stepped(torques: Any, pose: Any, free: list[int], h: float, steps: int, late: int) -> Any:
    """Angles after every step v₊ = v + h M⁻¹(τ − c − g), q₊ = q + h v₊ of the free joints, c of so many steps before."""
    q, v = np.array(pose, dtype=float), np.zeros(6)
    known, found = [(q, v)] * 3, []
    for step in range(steps):
        rest = torques(step * h) - motion_part(*known[-1 - late])
        rest -= robot_arm.inverse_dynamics(q, STILL, STILL)[0]
        gain = np.zeros(6)
        gain[free] = np.linalg.solve(mass_matrix(q)[np.ix_(free, free)], rest[free])
        v = v + h * gain
        q = q + h * v
        known.append((q, v))
        found.append(q)
    return np.array(found)


def test_an_arm_led_by_torques_strays_as_steps_of_its_joints_do() -> None:
    a = arm_path
    h, steps = a.TIME_STEP, round(a.DURATION / a.TIME_STEP)
    wanted = np.array([a.path((k + 1) * h)[0] for k in range(steps)])
    led = [
        np.abs(
            stepped(lambda t: robot_arm.inverse_dynamics(*a.path(t))[0], STILL, [*range(6)], h, steps, late)
            - wanted
        ).max()
        for late in (0, 2)
    ]
    (gate,) = measurement("arm_path", "plain").metrics

    assert gate.limit == pytest.approx(led[0] + abs(led[1] - led[0]), rel=0.01)


def test_two_weak_joints_fall_as_steps_of_theirs_do() -> None:
    a = arm_path
    free, bounds = [*a.WEAK], np.zeros(6)
    bounds[free] = [-bound for bound in a.WEAK.values()]
    right = np.array(a.POSES[1])[free] + a.fallen()[0]
    on_time, later = (
        stepped(lambda t: bounds, a.POSES[1], free, a.TIME_STEP, a.FALL, late)[-1][free] for late in (0, 2)
    )
    limits = {m.name: m.limit for m in measurement("arm_path", "weak").metrics}
    off = np.abs(on_time - right) + np.abs(later - on_time)

    assert limits["fall_error"] == pytest.approx(off.max(), rel=0.02)
    # A row of damping 2 h between links that turn: its speed is a ninth, less 4 g/9h; the turn adds a h to it, ½ a h² to g.
    h, standing, speed = a.TIME_STEP, 0.0, 0.0
    turning = float(np.abs(a.fallen()[1]).sum())
    for _ in range(100):
        speed = speed / 9.0 - 4.0 * standing / (9.0 * h)
        standing += h * speed + 0.5 * (turning * h) ** 2
        speed += turning**2 * h
    assert limits["held_error"] == pytest.approx(standing, rel=1e-6)
    # The reference by itself: what the weight gives and the drives take is the energy of motion at the end.
    pose = np.array(a.POSES[1])
    pose[free] += a.fallen()[0]
    moving = np.zeros(6)
    moving[free] = a.fallen()[1]
    lifted = sum(
        mass * 9.81 * (after[2][2] - before[2][2])
        for (_, _, _, mass, _), before, after in zip(
            robot_arm.LINKS, robot_arm.kinematics(a.POSES[1]), robot_arm.kinematics(pose), strict=True
        )
    )
    kinetic = 0.5 * moving @ mass_matrix(pose) @ moving
    assert kinetic + lifted == pytest.approx(float(bounds[free] @ a.fallen()[0]), rel=1e-4)


def test_torques_of_a_guided_arm_are_two_steps_late_at_most() -> None:
    """And those of inverse dynamics with accelerations are mass matrix, motion and weight."""
    (gate,) = measurement("arm_path", "driven").metrics
    assert gate.limit == arm_path.late()
    for time in arm_path.READ:
        q, v, a = arm_path.path(time)
        whole = mass_matrix(q) @ a + motion_part(q, v) + robot_arm.inverse_dynamics(q, STILL, STILL)[0]
        np.testing.assert_allclose(robot_arm.inverse_dynamics(q, v, a)[0], whole, atol=1e-9)


def weight(pose: Any) -> Any:
    """The torques that hold the arm, from the slope of its potential energy; not from forces."""

    def energy(at: Any) -> float:
        arm = zip(robot_arm.LINKS, robot_arm.kinematics(at), strict=True)
        return sum(mass * 9.81 * float(link[2][2]) for (_, _, _, mass, _), link in arm)

    d = 1e-4
    return np.array([(energy(pose + d * one) - energy(pose - d * one)) / (2.0 * d) for one in np.eye(6)])


def test_the_arm_is_held_down_to_the_slope_of_its_energy() -> None:
    pose = np.array(robot_arm.POSES[1])
    needed = weight(pose)
    np.testing.assert_allclose(robot_arm.inverse_dynamics(pose, STILL, STILL)[0], needed, atol=1e-6)

    def stays(share: float) -> bool:
        """Drives of so much each: what the weight has left over turns the links for half a second; the axis needs none."""
        left = max(0.0, 1.0 - share) * needed[1:]
        speeds = np.append(0.0, 0.5 * np.linalg.solve(mass_matrix(pose)[1:, 1:], left))
        spins = robot_arm.inverse_dynamics(pose, speeds, STILL)[2]
        return float(np.abs(spins).max()) < robot_arm.SLOWEST

    low, high = band("robot_arm", "weakest")
    found = break_point(stays, 3.0, 0.3, resolution=1e-4, walk=5)

    assert not stays(low) and stays(1.0)
    assert low < found.value < high < low * (1.0 + 1.1e-4)


def test_a_correction_once_a_step_breaks_where_its_polynomial_and_steps_of_the_joints_do() -> None:
    h, pose = arm_path.TIME_STEP, np.array(robot_arm.POSES[1])

    def largest(rate: float) -> float:
        """Of the roots of z² − (2 − 2 x − x²) z + 1 − 2 x, from e₊ = e + h v₊, v₊ = v − h (ω² e + 2 ω v), x = h ω."""
        x = h * rate
        return float(np.abs(np.linalg.eigvals([[1.0 - x * x, 1.0 - 2.0 * x], [-x * x, 1.0 - 2.0 * x]])).max())

    def comes_back(rate: float) -> bool:
        """The torques of inverse dynamics on an arm of energies: the mass matrix of the kinetic, the slope of the other."""
        off, turned = np.full(6, arm_path.NUDGE), np.full(6, 2.0 * arm_path.NUDGE)
        for _ in range(arm_path.SWINGS):
            v = turned / h
            asked = robot_arm.inverse_dynamics(pose + off, v, -rate * rate * off - 2.0 * rate * v)[0]
            v = v + h * np.linalg.solve(mass_matrix(pose + off), asked - weight(pose + off))
            turned = h * v
            off = off + turned
        return bool(np.abs(off).max() <= arm_path.NUDGE)

    low, high = band("arm_path", "stiffest")

    assert largest(low) < 1.0 < largest(high) and comes_back(low) and not comes_back(high)
    assert largest(arm_path.FASTEST) == pytest.approx(1.0, abs=1e-12)
    assert high < 1.0031 * low
