"""A recorded trajectory and every observable and reduction of it, for engines that can only be stepped.

An adapter records positions, orientations and velocities, and forces where its engine shows them; what a test
asks for is computed here, by the definitions of `engine.observe`. Shapes: s samples of n bodies, world axes, SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from . import recorded_joints
from .bodies import Particle, RigidBody
from .check import unknown
from .errors import MethodError
from .forces import CentralGravity, Spring
from .joints import AxialJoint, Distance, Hinge
from .observe import (
    AngularMomentum,
    AngularVelocity,
    ConstraintForce,
    ContactCount,
    ContactForce,
    Energy,
    Final,
    JointCoordinate,
    KineticEnergy,
    Maximum,
    MaximumAbsolute,
    Mean,
    Minimum,
    Momentum,
    Observable,
    Orientation,
    Penetration,
    Position,
    PotentialEnergy,
    Quantity,
    Trace,
    Velocity,
    Violation,
)
from .recorded_joints import cross, turned, turned_back
from .result import Array, Status
from .scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording:
    """What an engine did. `samples` are step numbers, 0 first: every step, or only the start and the end."""

    samples: npt.NDArray[np.int64]  # (s,)
    positions: Array  # (s, n, 3) m
    orientations: Array  # (s, n, 4) (w, x, y, z)
    velocities: Array  # (s, n, 3) m/s, of the centre of mass
    angular_velocities: Array  # (s, n, 3) rad/s, world axes
    steps: int  # done
    seconds: float  # of the engine's own loop; setting up not counted
    setup_seconds: float = 0.0  # building the engine's model
    cpu_seconds: float = 0.0  # of the processor, for the same as `seconds`; 0 where it cannot be told
    constraint_forces: Mapping[str, Array] = field(default_factory=dict)  # (s,) N, tension; or (s, 6) N, N m
    contact_forces: Mapping[tuple[str, str], Array] = field(default_factory=dict)  # (s, 3) N, on the first
    contact_count: Array | None = None  # (s,)
    penetration: Array | None = None  # (s,) m, the deepest
    turned: Mapping[str, Array] = field(default_factory=dict)  # (s,) rad, hinges whose turns were counted
    status: Status = "completed"
    failure: str = ""


def wanted_samples(observe: Mapping[str, Observable], steps: int) -> npt.NDArray[np.int64]:
    """The steps at which something is read, with the start and the end, ascending."""
    wanted = np.zeros(steps + 1, dtype=bool)
    wanted[[0, steps]] = True
    for what in observe.values():
        last = steps if what.last is None else min(what.last, steps)
        if isinstance(what, Final):
            wanted[max(last, 0)] = True
        else:
            wanted[what.first : last + 1 : what.every if isinstance(what, Trace) else 1] = True
    return np.flatnonzero(wanted)


def needs_every_step(observe: Mapping[str, Observable], steps: int) -> bool:
    """Whether something is read between the start and the end."""
    return any(not isinstance(what, Final) or what.last not in (None, steps) for what in observe.values())


def hinges_counted(scene: Scene, observe: Mapping[str, Observable]) -> tuple[str, ...]:
    """Those whose angle is read, and whose turns must be counted on the way."""
    asked = {what.quantity.joint for what in observe.values() if isinstance(what.quantity, JointCoordinate)}
    return tuple(c.name for c in scene.constraints if isinstance(c, Hinge) and c.name in asked)


def observed(
    scene: Scene, recording: Recording, observe: Mapping[str, Observable], time_step: float
) -> tuple[dict[str, Array], dict[str, Array]]:
    """The observables by name, and the times [s] of the traces among them."""
    values: dict[Quantity, Array] = {}
    found: dict[str, Array] = {}
    times: dict[str, Array] = {}
    for name, what in observe.items():
        if what.quantity not in values:
            values[what.quantity] = quantity(scene, recording, what.quantity)
        whole = values[what.quantity]
        series: Array = np.subtract(whole, whole[0]) if what.from_start else whole
        last = recording.samples[-1] if what.last is None else what.last
        kept = np.flatnonzero((recording.samples >= what.first) & (recording.samples <= last))
        if isinstance(what, Trace):
            kept = kept[(recording.samples[kept] - what.first) % what.every == 0]
            times[name] = np.asarray(recording.samples[kept] * time_step, dtype=np.float64)
        found[name] = _reduced(what, series[kept])
    return found, times


def _reduced(what: Observable, series: Array) -> Array:
    if isinstance(what, Trace):
        return series
    if not len(series):  # the run ended before the first sample asked for
        return np.full(series.shape[1:], np.nan)
    if isinstance(what, Final):
        return np.array(series[-1])
    if isinstance(what, Maximum):
        return np.array(series.max(axis=0))
    if isinstance(what, Minimum):
        return np.array(series.min(axis=0))
    if isinstance(what, MaximumAbsolute):
        return np.array(np.abs(series).max(axis=0))
    if isinstance(what, Mean):
        return np.array(np.add.accumulate(series, axis=0)[-1] / len(series))
    raise MethodError(f"observe: {what!r} is not a reduction that can be made of a recording")


def quantity(scene: Scene, recording: Recording, asked: Quantity) -> Array:
    """All samples of one quantity: (s, *shape of the quantity)."""
    if isinstance(asked, Position | Velocity | Orientation | AngularVelocity):
        states = {
            Position: recording.positions,
            Velocity: recording.velocities,
            Orientation: recording.orientations,
            AngularVelocity: recording.angular_velocities,
        }[type(asked)]
        if asked.body is None:
            return states
        index = _index(scene, asked.body)
        if not isinstance(asked, Position | Velocity) or not any(asked.point):
            return states[:, index]
        arm = turned(recording.orientations[:, index], np.broadcast_to(asked.point, states[:, index].shape))
        moved = cross(recording.angular_velocities[:, index], arm) if isinstance(asked, Velocity) else arm
        return np.asarray(states[:, index] + moved)
    if isinstance(asked, KineticEnergy):
        return _kinetic(scene, recording)
    if isinstance(asked, PotentialEnergy):
        return _potential(scene, recording)
    if isinstance(asked, Energy):
        return _kinetic(scene, recording) + _potential(scene, recording)
    if isinstance(asked, Momentum):
        return np.asarray(np.einsum("n,snk->sk", _masses(scene), recording.velocities))
    if isinstance(asked, AngularMomentum):
        return _angular_momentum(scene, recording, np.array(asked.about))
    if isinstance(asked, Violation):
        return _violation(scene, recording, asked.constraint)
    if isinstance(asked, JointCoordinate):
        if asked.joint in recording.turned:
            return recording.turned[asked.joint]
        return recorded_joints.coordinate(
            scene, scene.constraint(asked.joint), recording.positions, recording.orientations
        )
    return _force(scene, recording, asked)


def _force(scene: Scene, recording: Recording, asked: Quantity) -> Array:
    """What the engine itself must have shown."""
    count = len(recording.samples)
    if isinstance(asked, ConstraintForce):
        if asked.constraint is not None:
            return recording.constraint_forces[asked.constraint]
        names = [c.name for c in scene.constraints if isinstance(c, Distance)]
        return np.stack([recording.constraint_forces[name] for name in names], axis=1)
    if isinstance(asked, ContactForce):
        total = np.zeros((count, 3))
        for (first, second), force in recording.contact_forces.items():
            if first == asked.body and asked.other in (None, second):
                total += force
            elif second == asked.body and asked.other in (None, first):
                total -= force
        return total
    if isinstance(asked, ContactCount) and recording.contact_count is not None:
        return recording.contact_count
    if isinstance(asked, Penetration) and recording.penetration is not None:
        return recording.penetration
    raise MethodError(f"observe: {asked!r} is not in this recording")


def _index(scene: Scene, name: str) -> int:
    for index, body in enumerate(scene.bodies):
        if body.name == name:
            return index
    raise MethodError(f"observe: {unknown('body', name, (body.name for body in scene.bodies))}")


def _moves(body: Particle | RigidBody) -> bool:
    return isinstance(body, Particle) or body.motion == "dynamic"


def _masses(scene: Scene) -> Array:
    """Mass [kg] of each body, 0 for those that nothing moves."""
    return np.array([body.mass if _moves(body) else 0.0 for body in scene.bodies], dtype=float)


def _inertias(scene: Scene) -> Array:
    """Principal moments [kg m²], (n, 3)."""
    return np.array(
        [
            body.inertia if isinstance(body, RigidBody) and _moves(body) else (0.0, 0.0, 0.0)
            for body in scene.bodies
        ],
        dtype=float,
    )


def _kinetic(scene: Scene, recording: Recording) -> Array:
    moving = 0.5 * np.einsum("n,snk,snk->s", _masses(scene), recording.velocities, recording.velocities)
    inertias = _inertias(scene)
    if not inertias.any():
        return np.asarray(moving)
    spin = turned_back(recording.orientations, recording.angular_velocities)
    return np.asarray(moving + 0.5 * np.einsum("nk,snk,snk->s", inertias, spin, spin))


def _potential(scene: Scene, recording: Recording) -> Array:
    masses, where = _masses(scene), recording.positions
    energy = -np.einsum("n,k,snk->s", masses, np.array(scene.gravity), where)
    for force in scene.forces:
        if isinstance(force, CentralGravity):
            away = np.linalg.norm(where - np.array(force.centre), axis=2)
            energy = energy - force.strength * (masses / away).sum(axis=1)
        elif isinstance(force, Spring):
            first, second = (
                where[:, _index(scene, end)] if isinstance(end, str) else np.array(end)
                for end in force.between
            )
            stretch = np.linalg.norm(second - first, axis=1) - force.rest_length
            energy = energy + 0.5 * force.stiffness * stretch**2
    for joint in scene.constraints:
        if isinstance(joint, AxialJoint) and joint.spring is not None:
            place = recorded_joints.coordinate(scene, joint, where, recording.orientations)
            assert isinstance(joint.spring.rest, float)  # the protocol refuses what follows the time
            energy = energy + 0.5 * joint.spring.stiffness * (place - joint.spring.rest) ** 2
    return np.asarray(energy)


def _angular_momentum(scene: Scene, recording: Recording, about: Array) -> Array:
    arms = recording.positions - about
    orbit = np.einsum("n,snk->sk", _masses(scene), cross(arms, recording.velocities))
    inertias = _inertias(scene)
    if not inertias.any():
        return np.asarray(orbit)
    spin = turned_back(recording.orientations, recording.angular_velocities)
    return np.asarray(orbit + turned(recording.orientations, inertias * spin).sum(axis=1))


def _violation(scene: Scene, recording: Recording, name: str | None) -> Array:
    if name is not None:
        constraint = scene.constraint(name)
        return recorded_joints.violation(scene, constraint, recording.positions, recording.orientations)
    rods = [constraint for constraint in scene.constraints if isinstance(constraint, Distance)]
    return np.stack(
        [recorded_joints.violation(scene, rod, recording.positions, recording.orientations) for rod in rods],
        axis=1,
    )
