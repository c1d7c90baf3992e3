"""Closed forms: what the discrete method, or the physics, must give. References for tests, no simulation.

The one-row system: a mass m [kg] on a distance row of compliance eps [m/N] and damping tau [s], linear about
rest; state (x, v) = (violation [m], its rate [m/s]). Derived from the step in `engine/native`; symbols as there:
theta = tau/h, rho = 1/(1 + m Sig), a, b, Sig the coefficients of the row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .result import Array


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


def undamped_row_phase(squared_frequency: float, time_step: float) -> float:
    """Phase [rad] the undamped row (tau = 0) turns per step for the true w² [1/s²]: 2 atan(h w/2)."""
    return 2.0 * math.atan(0.5 * time_step * math.sqrt(squared_frequency))


def undamped_row_invariant(x: Array, v: Array, squared_frequency: float, time_step: float) -> Array:
    """v² + w² (x − h v/2)² [m²/s²] of each state, constant along the undamped row's discrete motion."""
    return np.asarray(v**2 + squared_frequency * (x - 0.5 * time_step * v) ** 2)


def plain_spring_invariant(x: Array, v: Array, squared_frequency: float, time_step: float) -> Array:
    """v² − h w² x v + w² x² [m²/s²], constant along symplectic Euler; stable if and only if h w < 2."""
    return np.asarray(v**2 - squared_frequency * time_step * x * v + squared_frequency * x**2)


def free_fall_error(gravity: float, time: Any, time_step: float) -> Any:
    """How much too far [m] a body has fallen from rest after `time` [s]: ½ g t h; zero with half-step velocities."""
    return 0.5 * gravity * time * time_step


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


def kepler_energy_swing(mean_motion: float, eccentricity: float, time_step: float) -> float:
    """Largest relative energy deviation, 1, of symplectic Euler on a slightly eccentric orbit: 2 h k xi."""
    return 2.0 * time_step * mean_motion * eccentricity
