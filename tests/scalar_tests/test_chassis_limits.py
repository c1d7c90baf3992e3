"""Where the limits of a chassis on springs come from: its stiffness, and its motion in a plane by integration."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from spook_tracker.scalar_tests.vehicles import suspension
from tests.scalar_tests.limits import measurement


def test_a_chassis_on_four_springs_rolls_fastest() -> None:
    """Lengths of the springs by height, pitch and roll: one stiffness matrix, one mass matrix."""
    s = suspension
    stiff = np.zeros((3, 3))
    for x, side, stiffness in s.CORNERS.values():
        reach = np.array((1.0, -x, 0.5 * side * s.TRACK))
        stiff += stiffness * np.outer(reach, reach)
    squares = np.linalg.eigvals(np.diag((1.0 / s.MASS, 1.0 / s.PITCHING, 1.0 / s.ROLLING)) @ stiff).real

    np.testing.assert_allclose(np.sort(np.sqrt(squares)), (s.BOUNCE, s.PITCH, s.ROLL), rtol=1e-12)


def slower(tilt: float) -> float:
    """By how much a pitch of that size is slower than a small one: the chassis in its plane, springs between points."""
    s = suspension
    springs = []
    for x, _, stiffness in s.CORNERS.values():
        carried = 0.5 * s.MASS * s.GRAVITY * (s.REAR if x > 0.0 else s.FRONT) / (s.FRONT + s.REAR)
        springs.append((x, stiffness, s.LENGTH + carried / stiffness))

    def moved(_: float, y: np.ndarray) -> tuple[float, ...]:
        force, moment = np.zeros(2), 0.0
        for x, stiffness, rest in springs:
            arm = x * np.array((math.cos(y[2]), -math.sin(y[2])))
            along = y[:2] + arm - (x, 0.0)
            length = math.hypot(*along)
            pull = stiffness * (rest / length - 1.0) * along
            force, moment = force + pull, moment + float(arm[1] * pull[0] - arm[0] * pull[1])
        return (*y[3:], force[0] / s.MASS, force[1] / s.MASS - s.GRAVITY, moment / s.PITCHING)

    def level(_: float, y: np.ndarray) -> float:
        return float(y[2])

    level.direction = -1  # type: ignore[attr-defined]
    start = (0.0, s.LENGTH, tilt, 0.0, 0.0, 0.0)
    found = solve_ivp(moved, (0.0, 1.2), start, events=level, rtol=1e-11, atol=1e-13).t_events[0]
    return 1.0 - 2.0 * math.pi / (found[1] - found[0]) / s.PITCH


def test_a_pitch_is_slower_by_what_an_integration_of_the_plane_finds() -> None:
    limits = {m.name: m.limit for m in measurement("suspension", "plain").metrics}
    share = slower(0.02) / 0.02**2
    assert slower(0.01) / 0.01**2 == pytest.approx(share, rel=0.01)  # of order tilt²
    assert share * suspension.TILT**2 < limits["pitch_error"] < 1.1 * share * suspension.TILT**2
