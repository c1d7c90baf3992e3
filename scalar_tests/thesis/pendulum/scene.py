"""The pendulum of the thesis: its scene, its exact motion and what is read from a run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.special import ellipj, ellipk

from spook_tracker import engine
from spook_tracker.engine.observe import Observable

from ... import case

MASS = 1.0  # kg
LENGTH = 1.0  # m
GRAVITY = 9.81  # m/s²
COMPLIANCE = 1e-13  # m/N
DURATION = 22.0  # s, 9.29 periods
TIME_STEP = 1.0 / 60.0  # s
CURVED = engine.Method(corrections=1)
CURVED_TWICE = engine.Method(corrections=2)
MODULUS = 0.5  # m = sin²(θ₀/2) for a start at 90°


def scene(
    time_step: float,
    *,
    mass: float = MASS,
    compliance: float = COMPLIANCE,
    damping: float | None = None,
    away: float = 0.0,
    start: float = LENGTH,
) -> engine.Scene:
    """A bob on a rod, level with the pivot and at rest; damping None is one time step [s].

    The pivot lies `away` [m] from the origin on every axis, the bob `start` [m] from the pivot.
    """
    bob = engine.Particle(name="bob", position=(away + start, away, away), mass=mass)
    rod = engine.Distance(
        name="rod",
        between=((away, away, away), "bob"),
        rest_length=LENGTH,
        compliance=compliance,
        damping=time_step if damping is None else damping,
    )
    return engine.Scene(bodies=(bob,), constraints=(rod,), gravity=(0.0, 0.0, -GRAVITY))


def period() -> float:
    """Period [s] of the swing from 90°: 4 K(½) √(l/g) = 2.36784194757624."""
    return 4.0 * float(ellipk(MODULUS)) * math.sqrt(LENGTH / GRAVITY)


def angle(time: Any) -> Any:
    """Angle [rad] from hanging: sin(θ/2) = √½ cd(√(g/l) t | ½), by Jacobi's elliptic functions."""
    _, cn, dn, _ = ellipj(np.asarray(time) * math.sqrt(GRAVITY / LENGTH), MODULUS)
    return 2.0 * np.arcsin(np.sqrt(MODULUS) * cn / dn)


def swing(
    simulate: case.Simulate,
    time_step: float,
    method: engine.Method = engine.PLAIN,
    *,
    duration: float = DURATION,
    observe: Mapping[str, Observable] | None = None,
    **options: Any,
) -> engine.Result:
    """One run; observed are the largest |violation| and the energy relative to the start, unless told."""
    wanted = observe or {
        "violation": engine.MaximumAbsolute(quantity=engine.Violation("rod")),
        "energy": engine.Trace(quantity=engine.Energy(), from_start=True),
    }
    return simulate(
        scene(time_step, **options), time_step=time_step, duration=duration, method=method, observe=wanted
    )


def percent_of_length(result: engine.Result) -> float:
    """Largest |length − l| of the run, % of l."""
    return 100.0 * float(result["violation"]) / LENGTH


def percent_of_energy(result: engine.Result, mass: float = MASS) -> Any:
    """E − E₀ at every sample, % of m g l, the fall from the start to the bottom."""
    return 100.0 * result["energy"] / (mass * GRAVITY * LENGTH)


def traced_angle(
    simulate: case.Simulate, time_step: float, duration: float, method: engine.Method
) -> tuple[Any, Any]:
    """Times [s] and unwrapped angles [rad] from hanging."""
    observe = {"bob": engine.Trace(quantity=engine.Position("bob"))}
    result = swing(simulate, time_step, method, duration=duration, observe=observe)
    bob = result["bob"]
    return result.sample_times["bob"], np.unwrap(np.arctan2(bob[:, 0], -bob[:, 2]))
