"""The oracle behind the signature of `engine.simulate`: any question about particles can be put to it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from time import perf_counter

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    AngularMomentum,
    CentralGravity,
    ConstraintForce,
    Energy,
    Final,
    KineticEnergy,
    Maximum,
    MaximumAbsolute,
    Mean,
    Method,
    Minimum,
    Momentum,
    Position,
    PotentialEnergy,
    Result,
    Scene,
    Spring,
    Trace,
    Velocity,
    Violation,
)
from spook_tracker.engine.observe import Observable, Quantity
from tests.oracles.particles import Array, Oracle, Sample

REDUCTIONS: dict[type[Observable], Callable[[Array], Array]] = {
    Trace: lambda samples: samples,
    Final: lambda samples: samples[-1],
    Maximum: lambda samples: np.max(samples, axis=0),
    Minimum: lambda samples: np.min(samples, axis=0),
    MaximumAbsolute: lambda samples: np.max(np.abs(samples), axis=0),
    Mean: lambda samples: np.mean(samples, axis=0),
}
DIVERGED = 1e100  # m or m/s


def kinetic_energy(oracle: Oracle, sample: Sample) -> float:
    return float(0.5 * oracle.mass @ np.sum(sample.velocity**2, axis=1))


def potential_energy(oracle: Oracle, sample: Sample) -> float:
    """−m g·x, −m k/r, ½ k (|d| − L)²; a compliant row counts nothing, nor does a constant load."""
    total = -float(oracle.mass @ (sample.position @ np.array(oracle.scene.gravity)))
    for force in oracle.scene.forces:
        if isinstance(force, CentralGravity):
            r = np.linalg.norm(sample.position - np.array(force.centre), axis=1)
            total -= float(force.strength * np.sum(oracle.mass / r))
        elif isinstance(force, Spring):
            stretch = (
                float(np.linalg.norm(oracle.between(force.between, sample.position))) - force.rest_length
            )
            total += 0.5 * force.stiffness * stretch**2
    return total


def reading(quantity: Quantity, oracle: Oracle, sample: Sample) -> Array:
    """One sample of a quantity."""

    def of(values: Array, name: str | None, names: list[str]) -> Array:
        return values if name is None else values[names.index(name)]

    bodies, rows = list(oracle.index), [row.name for row in oracle.rows]
    if isinstance(quantity, Position):
        return of(sample.position, quantity.body, bodies)
    if isinstance(quantity, Velocity):
        return of(sample.velocity, quantity.body, bodies)
    if isinstance(quantity, Violation):
        return of(sample.violation, quantity.constraint, rows)
    if isinstance(quantity, ConstraintForce):
        return of(sample.tension, quantity.constraint, rows)
    if isinstance(quantity, Momentum):
        return oracle.mass @ sample.velocity
    if isinstance(quantity, AngularMomentum):
        arm = sample.position - np.array(quantity.about)
        return oracle.mass @ np.cross(arm, sample.velocity)
    if isinstance(quantity, KineticEnergy):
        return np.array(kinetic_energy(oracle, sample))
    if isinstance(quantity, PotentialEnergy):
        return np.array(potential_energy(oracle, sample))
    if isinstance(quantity, Energy):
        return np.array(kinetic_energy(oracle, sample) + potential_energy(oracle, sample))
    raise NotImplementedError(f"the oracle does not know {quantity!r}")


def simulate(
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    method: Method = PLAIN,
    observe: Mapping[str, Observable] | None = None,
    time_limit: float | None = None,
    time_stages: bool = False,
) -> Result:
    """What `engine.simulate` answers, slowly; all samples are kept. `time_limit` is not looked at."""
    if steps is None:
        assert duration is not None
        steps = round(duration / time_step)
    oracle, started = Oracle(scene, time_step, method), perf_counter()
    asked = dict(observe or {})
    quantities = {what.quantity for what in asked.values()}
    seen: dict[Quantity, list[Array]] = {quantity: [] for quantity in quantities}
    status, failed = "completed", None
    with np.errstate(over="ignore", invalid="ignore"):
        for done, sample in enumerate(oracle.samples(steps)):
            state = np.hstack([sample.position, sample.velocity])
            if not np.isfinite(state).all() or np.abs(state).max() > DIVERGED:
                status, failed = "diverged" if np.isfinite(state).all() else "not_finite", done
                break
            for quantity in quantities:
                seen[quantity].append(reading(quantity, oracle, sample))
    observables: dict[str, Array] = {}
    sample_times: dict[str, Array] = {}
    for name, what in asked.items():
        samples = np.array(seen[what.quantity])
        samples = samples - samples[0] if what.from_start else samples
        every = what.every if isinstance(what, Trace) else 1
        chosen = samples[what.first : None if what.last is None else what.last + 1 : every]
        observables[name] = REDUCTIONS[type(what)](chosen)
        if isinstance(what, Trace):
            sample_times[name] = time_step * (what.first + every * np.arange(len(chosen)))
    culprit = next((n for n, i in oracle.index.items() if not (np.abs(oracle.x[i]) <= DIVERGED).all()), None)
    final = {
        name: np.concatenate([oracle.x[i], [1.0, 0.0, 0.0, 0.0], oracle.v[i], np.zeros(3)])
        for name, i in oracle.index.items()
    }
    return Result(
        status=status,  # type: ignore[arg-type]
        failure="" if failed is None else f"body {culprit!r} ran away in step {failed}",
        failed_body=culprit,
        failed_step=failed,
        time_step=time_step,
        steps=steps if failed is None else failed - 1,
        seconds=perf_counter() - started,
        observables=observables,
        sample_times=sample_times,
        final_state=final,
        counters={"steps": steps},
        state_hash=hashlib.sha256(oracle.x.tobytes() + oracle.v.tobytes()).hexdigest(),
        stages=(),
    )
