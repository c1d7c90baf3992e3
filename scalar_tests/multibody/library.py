"""What the library's problems share: its error measure, its two precision classes, and bodies that are rods.

Gonzalez, Gonzalez and Cuadrado, "Library for computational benchmarking of multibody dynamics": the question is the
least run time within an allowed error, 1e-1 in the low class and 1e-3 in the high one.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from spook_tracker import engine

from .. import case

GRAVITY = 9.81  # m/s²
LOW, HIGH = 1e-1, 1e-3  # allowed errors of the two classes
THRESHOLD = 1e-3  # of a reference that passes zero
ALLOWED = {"low": LOW, "high": HIGH}
PLAIN_CONFIGURATION = case.Configuration(
    name="plain", method=engine.PLAIN, expected_order=None
)  # not yet in its range
FIRST_ORDER = case.Configuration(name="plain", method=engine.PLAIN, expected_order=1.0)


SECOND_ORDER = case.Configuration(
    name="half-step, curved twice",
    method=engine.Method(half_step_velocities=True, corrections=2),
    expected_order=2.0,
)


def library_error(found: Any, reference: Any, threshold: float = THRESHOLD) -> float:
    """Root mean square over all outputs of |y − y_ref| / max(|y_ref|, threshold)."""
    wanted = np.asarray(reference, dtype=float)
    return float(
        np.sqrt(np.mean(((np.asarray(found) - wanted) / np.maximum(np.abs(wanted), threshold)) ** 2))
    )


def rod(
    name: str, start: Any, end: Any, mass: float, inertia: tuple[float, float, float]
) -> engine.RigidBody:
    """A rod at rest between two points [m], its own axes those of the world at the start."""
    x, y, z = (0.5 * (np.asarray(start, dtype=float) + np.asarray(end, dtype=float))).tolist()
    return engine.RigidBody(name=name, mass=mass, inertia=inertia, position=(x, y, z))


def turned(orientation: Any, arm: Any) -> Any:
    """(n, 3): a body's vector `arm` in world axes, at every sample of its orientation (n, 4)."""
    w, axis = orientation[:, :1], orientation[:, 1:]
    arms = np.broadcast_to(np.asarray(arm, dtype=float), axis.shape)
    return arms + 2.0 * np.cross(axis, np.cross(axis, arms) + w * arms)


@functools.cache
def tightly(
    slopes: Callable[[float, np.ndarray], np.ndarray], start: tuple[float, ...], times: tuple[float, ...]
) -> np.ndarray:
    """(state, time): an ordinary differential equation by DOP853 at 1e-12."""
    found = solve_ivp(slopes, (0.0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-13)
    return np.asarray(found.y)


def ladders(
    what: str,
    classes: Mapping[str, tuple[tuple[float, ...], tuple[case.Configuration, ...]]],
    error: Callable[[case.Simulate, float, engine.Method], float],
    of: str = "",
) -> tuple[case.Ladder, ...]:
    """A ladder for each precision class, {"low" or "high": (time steps, configurations that reach it)}; `of` stands
    before their names.

    The time at which it is reached is the library's own question.
    """
    return tuple(
        case.Ladder(
            name=f"{of}{name} precision",
            description=f"{what}, the library's error; allowed {ALLOWED[name]:g}",
            unit="1",
            time_steps=time_steps,
            configurations=configurations,
            error=error,
            target_error=ALLOWED[name],
        )
        for name, (time_steps, configurations) in classes.items()
    )


def error_metric(
    role: case.Role, allowed: float, outputs: str, kind: case.LimitKind = "physical", **told: Any
) -> case.Metric:
    """The library's error of a run, against one of its classes; `kind` is whose its limit is at this time step."""
    return case.Metric(
        name="library_error",
        description=f"root mean square of |y − y_ref| / max(|y_ref|, 1e-3) over {outputs}",
        unit="1",
        role=role,
        limit=allowed,
        limit_source="allowed in the library's " + ("low" if allowed == LOW else "high") + " precision class",
        limit_kind=kind,
        reference=0.0,
        relative_tolerance=1e-4,
        **told,
    )
