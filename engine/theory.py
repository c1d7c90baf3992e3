"""Closed forms: what the discrete method, or the physics, must give. References for tests, no simulation.

The one-row system: a mass m [kg] on a distance row of compliance eps [m/N] and damping tau [s], linear about
rest; state (x, v) = (violation [m], its rate [m/s]). Derived from the step in `engine/native`; symbols as there:
theta = tau/h, rho = 1/(1 + m Sig), a, b, Sig the coefficients of the row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from spook_tracker.engine.result import Array


@dataclass(frozen=True, slots=True)
class RowCoefficients:
    """Lacoursière 2007, eqs 4.27 to 4.35, linearised."""

    violation_gain: float  # a, 1/s
    velocity_gain: float  # b, 1
    softness: float  # Sig, 1/kg
    upsilon: float  # 1/(1 + 4 theta), 1


def row_coefficients(compliance: float, damping: float, time_step: float) -> RowCoefficients:
    """a, b, Sig, Ups of a row; compliance [m/N], damping and time step [s]."""
    spread = 1.0 + 4.0 * damping / time_step
    return RowCoefficients(
        violation_gain=4.0 / (time_step * spread),
        velocity_gain=1.0 - 1.0 / spread,
        softness=4.0 * compliance / (time_step**2 * spread),
        upsilon=1.0 / spread,
    )


def one_row_matrix(mass: float, compliance: float, damping: float, time_step: float) -> Array:
    """(x, v) after one step = A (x, v). Exact for a mass on one row without other forces."""
    row = row_coefficients(compliance, damping, time_step)
    rho = 1.0 / (1.0 + mass * row.softness)
    a, b, h = row.violation_gain, row.velocity_gain, time_step
    return np.array([[1.0 - rho * a * h, h * (1.0 - rho * b)], [-rho * a, 1.0 - rho * b]])


def one_row_oscillates(mass: float, compliance: float, damping: float, time_step: float) -> bool:
    """Whether the eigenvalues of the one-row matrix are complex; always so for theta < 2."""
    row = row_coefficients(compliance, damping, time_step)
    theta = damping / time_step
    return 1.0 / (1.0 + mass * row.softness) < (1.0 + 4.0 * theta) / (1.0 + theta) ** 2


def one_row_decay(mass: float, compliance: float, damping: float, time_step: float) -> float:
    """Factor per step of the slowest mode of one row: its largest eigenvalue magnitude, 1."""
    return float(np.abs(np.linalg.eigvals(one_row_matrix(mass, compliance, damping, time_step))).max())


def undamped_row_frequency(angular_frequency: float, time_step: float) -> float:
    """Angular frequency [rad/s] the undamped row (tau = 0) shows for the true w [rad/s]: (2/h) atan(h w/2)."""
    return 2.0 / time_step * math.atan(0.5 * time_step * angular_frequency)


def undamped_row_invariant(x: float, v: float, angular_frequency: float, time_step: float) -> float:
    """v² + w² (x − h v/2)² [m²/s²], constant along the undamped row's discrete motion."""
    return v**2 + angular_frequency**2 * (x - 0.5 * time_step * v) ** 2


def plain_spring_invariant(x: float, v: float, angular_frequency: float, time_step: float) -> float:
    """v² − h w² x v + w² x² [m²/s²], constant along symplectic Euler; stable if and only if h w < 2."""
    w2 = angular_frequency**2
    return v**2 - time_step * w2 * x * v + w2 * x**2


def free_fall_error(gravity: float, time: float, time_step: float) -> float:
    """How much too far [m] a body has fallen from rest after `time` [s]: ½ g t h; zero with half-step velocities."""
    return 0.5 * gravity * time * time_step


def circle_radius_excess(
    radius: float, angle_per_step: float, mass: float, compliance: float, damping: float, time_step: float
) -> float:
    """r − L [m] of a steady circle of radius r [m] on a distance row, without gravity.

    The phase per step is `angle_per_step` [rad]. Exact for the discrete motion; free of the mass as eps → 0.
    """
    theta = damping / time_step
    return (
        radius
        * (1.0 - math.cos(angle_per_step))
        * (0.5 * (1.0 + 2.0 * theta) + 2.0 * mass * compliance / time_step**2)
    )


def pendulum_length_deviation(gravity: float, length: float, damping: float, time_step: float) -> float:
    """Largest |length deviation| / length, 1, of a stiff pendulum from 90°: (1 + 2 theta)/2 · g h²/l.

    The steady circle at the speed of the lowest point, v² = 2 g l; right to the order h².
    """
    return 0.5 * (1.0 + 2.0 * damping / time_step) * gravity * time_step**2 / length


def pendulum_period(gravity: float, length: float, amplitude: float) -> float:
    """Period [s] of a pendulum of that amplitude [rad]: 2 π √(l/g) / agm(1, cos(amplitude/2))."""
    a, b = 1.0, math.cos(0.5 * amplitude)
    for _ in range(6):  # quadratic convergence: rounding level for every amplitude below 180°
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    return 2.0 * math.pi * math.sqrt(length / gravity) / a


def static_violation(compliance: float, force: float) -> float:
    """g [m] of a row at rest that carries a tension [N]: eps F, for every time step and damping."""
    return compliance * force


def kepler_energy_swing(mean_motion: float, eccentricity: float, time_step: float) -> float:
    """Largest relative energy deviation, 1, of symplectic Euler on a slightly eccentric orbit: 2 h k xi."""
    return 2.0 * time_step * mean_motion * eccentricity


def kepler_radius(angle: float, eccentricity: float) -> float:
    """r [orbit parameter] at the angle [rad] of the planetarium's orbit: 1/(1 + xi sin θ)."""
    return 1.0 / (1.0 + eccentricity * math.sin(angle))


def kepler_period(mean_motion: float, eccentricity: float) -> float:
    """Period [s] of an orbit of parameter 1 with strength k² [1/s²]: (2 π/k) (1 − xi²)^(−3/2)."""
    return 2.0 * math.pi / mean_motion / math.sqrt(1.0 - eccentricity**2) ** 3
