"""The rigid oracle behind the signature of `engine.simulate`: questions about jointed bodies can be put to it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from spook_tracker.engine import (
    PLAIN,
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    Energy,
    JointCoordinate,
    KineticEnergy,
    Method,
    Orientation,
    Position,
    Result,
    Scene,
    Trace,
    Violation,
)
from spook_tracker.engine.observe import Observable, Quantity
from tests.oracles.rigid import Array, RigidOracle
from tests.oracles.simulate import REDUCTIONS


def reading(quantity: Quantity, oracle: RigidOracle) -> Array:
    """One sample of a quantity."""
    joints = {joint.constraint.name: joint for joint in oracle.joints}
    if isinstance(quantity, Position):
        return oracle.x.copy() if quantity.body is None else oracle.x[oracle.index[quantity.body]].copy()
    if isinstance(quantity, Violation):
        chosen = list(joints.values()) if quantity.constraint is None else [joints[quantity.constraint]]
        return np.concatenate([joint.violation(oracle.x, oracle.q, oracle) for joint in chosen])
    if isinstance(quantity, JointCoordinate):
        assert quantity.joint is not None
        return np.array(joints[quantity.joint].coordinate(oracle.x, oracle.q, oracle)[0])
    if isinstance(quantity, Orientation) and quantity.body is not None:
        return oracle.q[oracle.index[quantity.body]].copy()
    if isinstance(quantity, AngularVelocity) and quantity.body is not None:
        return np.asarray(oracle.angular_velocity()[oracle.index[quantity.body]])
    if isinstance(quantity, ConstraintForce) and quantity.constraint is not None:
        return oracle.loads[oracle.joints.index(joints[quantity.constraint])].copy()
    if isinstance(quantity, Energy | KineticEnergy):
        moving = 0.5 * float(oracle.mass @ np.sum(oracle.v**2, axis=1))
        turning = 0.5 * float(np.sum(oracle.ell * oracle.angular_velocity()))
        above = -float(oracle.mass @ (oracle.x @ np.array(oracle.scene.gravity)))
        return np.array(moving + turning + (above if isinstance(quantity, Energy) else 0.0))
    if isinstance(quantity, AngularMomentum):
        arm = oracle.x - np.array(quantity.about)
        return np.asarray(oracle.mass @ np.cross(arm, oracle.v) + oracle.ell.sum(axis=0))
    raise NotImplementedError(f"the rigid oracle does not know {quantity!r}")


def simulate(
    scene: Scene,
    *,
    time_step: float,
    duration: float | None = None,
    steps: int | None = None,
    method: Method = PLAIN,
    observe: Mapping[str, Observable] | None = None,
    time_limit: float | None = None,
) -> Result:
    """What `engine.simulate` answers for plain SPOOK, slowly; all samples are kept. `time_limit` is not looked at."""
    assert method == PLAIN
    count = round((duration or 0.0) / time_step) if steps is None else steps
    oracle = RigidOracle(scene, time_step)
    asked = dict(observe or {})
    seen: dict[Quantity, list[Array]] = {what.quantity: [] for what in asked.values()}
    for sample in range(count + 1):
        if sample:
            oracle.step()
        for quantity, found in seen.items():
            found.append(reading(quantity, oracle))
    observables, times = {}, {}
    for name, what in asked.items():
        samples = np.array(seen[what.quantity])
        samples = samples - samples[0] if what.from_start else samples
        every = what.every if isinstance(what, Trace) else 1
        chosen = samples[what.first : None if what.last is None else what.last + 1 : every]
        observables[name] = REDUCTIONS[type(what)](chosen)
        if isinstance(what, Trace):
            times[name] = time_step * (what.first + every * np.arange(len(chosen)))
    return Result(
        status="completed",
        failure="",
        failed_body=None,
        failed_step=None,
        time_step=time_step,
        steps=count,
        seconds=0.0,
        observables=observables,
        sample_times=times,
        final_state={},
        counters={"steps": count},
        state_hash="",
        stages=(),
    )
